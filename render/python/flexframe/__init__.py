"""Flexible multibody simulation and its pictures, without a display.

    import flexframe as ff

    scene = ff.load("slider_crank.toml")
    r = ff.simulate(scene, accuracy=1e-3)
    r.t, r["slider.x"], r.bodies["rod"].q
    picture = ff.draw(r, t=0.7, size=(1280, 720))        # uint8 array, height x width x 4
    ff.film(r, "out")                                    # PNG pictures and a video

SI units throughout. Long calls release the GIL and answer Ctrl-C. Errors are flexframe.Error and its kinds; the words of scenes are
documented in SCENE.md.
"""

import copyreg as _copyreg
import json as _json
import os as _os
import pathlib as _pathlib
import tempfile as _tempfile

import numpy as _np

from ._core import (
    ArgumentError,
    Body,
    DrawError,
    Drawing,
    Error,
    FileError,
    InputError,
    KernelMap,
    MapError,
    MeshError,
    ResultBody,
    ResultJoint,
    Results,
    Scene,
    Simulation,
    SimulationError,
    State,
    __version__,
    png,
    read_png,
    read_results,
)
from . import _core
from ._toml import to_toml as _to_toml
from . import _show

__all__ = [
    "ArgumentError",
    "Body",
    "DrawError",
    "Drawing",
    "Error",
    "FileError",
    "InputError",
    "KernelMap",
    "MapError",
    "MeshError",
    "ResultBody",
    "ResultJoint",
    "Results",
    "Scene",
    "Simulation",
    "SimulationError",
    "State",
    "Study",
    "Sweep",
    "__version__",
    "compare",
    "draw",
    "drawing",
    "film",
    "load",
    "png",
    "read_png",
    "read_results",
    "reduce",
    "scene",
    "simulate",
    "study",
    "sweep",
    "write_results",
]


def _settings(values):
    """{"L": 0.4, "body.rod.elements": 12}, ["L=0.4"] or "L=0.4" as the words of --set."""
    if isinstance(values, dict):
        return [f"{key}={_to_toml(value, at=str(key))}" for key, value in values.items()]
    return [values] if isinstance(values, str) else list(values)


def load(file, set=()):
    """Reads a scene file (TOML).

    set: parameters and keys in place of the file's, {"L": 0.4, "body.rod.elements": 12}.
    Returns a Scene. Raises InputError with file, line and key.
    """
    return _core._load(_os.fspath(file), _settings(set))


def scene(words, name="scene.toml", set=()):
    """A Scene from a dict as a scene file has it, or from TOML text.

    name stands for the file: it appears in messages, and relative file names start in its folder. Raises InputError.
    """
    if not isinstance(words, (str, dict)):
        raise ArgumentError(f"a scene is made of a dict or of TOML text, found {type(words).__name__}")
    text = words if isinstance(words, str) else _to_toml(words, root=True)
    return _core._parse(text, _os.fspath(name), _settings(set))


def _scene(given):
    if isinstance(given, Scene):
        return given
    if not isinstance(given, (dict, str, _os.PathLike)):
        raise ArgumentError(f"a scene is a Scene, a dict or a file name, found {type(given).__name__}")
    return scene(given) if isinstance(given, dict) else load(given)


def _number(name, value, low, high):
    """A number between two others, or None. Raises ArgumentError."""
    if value is None or (isinstance(value, (float, int, _np.floating, _np.integer)) and low <= value <= high):
        return value
    raise ArgumentError(f"{name} must be a number from {low:g} to {high:g}, or None; found {value!r}")


def simulate(scene, *, accuracy=None, tolerance=None, method=None, estimate_error=True, check_effects=True, progress=None):
    """Simulates a scene (a Scene, a dict, or a file name) and returns Results.

    accuracy        asked error of the outputs relative to their ranges, 1e-9 .. 0.5, or a distance in the pictures of the scene's [render]
                    table as text, "0.5 px" or "0.1 mm", for every drawn vertex (render/film/README.md; its shares stand in
                    Results.statistics["picture"]): tolerance, modes and effects are chosen; excludes tolerance
    tolerance       relative local error, 1e-13 .. 0.1, in place of the scene's
    method          auto, adams, bdf, erk, dirk, ida or exponential
    estimate_error  runs the scene once more, looser, and compares (less than half the run's cost)
    check_effects   looks at what effects that are off are worth
    progress        called now and then with the share of the run that is done, 0..1; may raise to stop

    Theory: Schiavo et al. 2005, Heckmann et al. 2006 (sim/README.md); how an accuracy is reached: sim/accuracy/README.md. Raises
    InputError for a scene that makes no mechanism, SimulationError where it cannot be integrated. Look at Results.warnings.
    """
    if not isinstance(accuracy, str):
        accuracy = _number("accuracy", accuracy, 1e-9, 0.5)
    tolerance = _number("tolerance", tolerance, 1e-13, 0.1)
    return _core._simulate(_scene(scene), accuracy, tolerance, method, estimate_error, check_effects, progress)


def drawing(results, *, size=None, **words):
    """Results made ready to be drawn, a Drawing: for many pictures of one motion.

    size: (width, height) in pixels. words: those of the scene's [render] table, in place of its own (color_by="stress", scales=[1, 20]).
    Raises InputError for an unknown word.
    """
    if not isinstance(results, Results):
        raise ArgumentError(f"pictures are drawn of Results (simulate(), read_results()), found {type(results).__name__}")
    if size is not None:
        words["size"] = list(size) if isinstance(size, (tuple, list, _np.ndarray)) else size
    return Drawing(results, [f"render.{key}={_to_toml(value, at=key)}" for key, value in words.items()])


def draw(results, t=None, *, picture=None, size=None, **words):
    """One picture of results: a uint8 array of shape (height, width, 4), sRGB with straight alpha.

    t: time in s, the nearest picture of the sequence is drawn (None: the last one); picture: its number instead. Others: drawing().
    The pixels are those of `flexframe render`. Raises DrawError where OSMesa is missing.
    """
    made = drawing(results, size=size, **words)
    if picture is None:
        picture = made.count - 1 if t is None else made.picture_at(t)
    return made.draw(picture)


def film(results, folder, *, frames=None, workers=0, video=True, progress=None, size=None, **words):
    """Draws the sequence into folder/frames/*.png and folder/film.mp4 (where ffmpeg is there).

    frames: (first, end) as a slice; workers: processes, 0: one a core; video: True, False or a file name (.mp4, .gif, .apng).
    Returns what was made, a dict. Raises InputError, DrawError, FileError.
    """
    folder = _pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    file = None if video is False else folder / "film.mp4" if video is True else _pathlib.Path(video)
    if frames is not None and not (isinstance(frames, (tuple, list)) and len(frames) == 2):
        raise ArgumentError(f"frames are (first, end), as a slice has them; found {frames!r}")
    first, end = frames if frames is not None else (0, -1)
    made = drawing(results, size=size, **words)
    return made._film(folder / "frames", (first, -1 if end is None else end), workers, file, progress)


def _listed(value):
    """A text as it is, numbers with commas between."""
    return ",".join(repr(float(v)) for v in value) if isinstance(value, (list, tuple)) else str(value)


def _named(words):
    """{"name": value} as ["name=value"]; a list of texts as it is; one text, number or row of numbers as a list of one."""
    if isinstance(words, dict):
        return [f"{name}={_listed(value)}" if name else _listed(value) for name, value in words.items()]
    if isinstance(words, (list, tuple)) and any(isinstance(word, str) for word in words):
        return list(words)
    return [] if isinstance(words, (list, tuple)) and not words else [_listed(words)]


def reduce(
    model,
    *,
    method="auto",
    modes=10,
    highest=0.0,
    lowest=0.0,
    interfaces=(),
    hold=True,
    units="m",
    materials=(),
    densities=(),
    elastics=(),
    contact="refuse",
    thickness=0.0,
    nodes=(),
    node_sets=(),
    node_count=97,
    cut_off=5.0,
    static_error=0.005,
    stiffening=True,
    stress=False,
    damping=0.0,
    mass=None,
    node_table=None,
    dofs=None,
    threads=1,
    memory=0.0,
    progress=None,
):
    """A flexible Body from a finite element model, to the last bit that of `flexframe reduce`. SI units but for the model's own.

    model         .inp (Abaqus, CalculiX), .bdf .nas .dat (Nastran), .msh (gmsh), .sti or .mtx (matrices; mass, node_table, dofs beside
                  them)
    method        auto, eigen, guyan, craig-bampton or response
    modes         number of modes (with interfaces held for craig-bampton); highest: all modes up to this frequency instead, Hz
    lowest        lowest frequency of interest for response, Hz
    interfaces    {"name": node number, name of a spider, "rigid:SET[@x,y,z]" or "average:SET[@x,y,z]"}: where the system takes hold
    hold          True: held by the model's supports; False: a free body; or the name of a node set to clamp
    units         m, mm, mm-kg-s, mm-kg-ms, mm-g-ms, cm-g-s, in-lbf-s, or (length, mass, time) factors to SI
    materials     {"SET": (young, poisson, density)} for elements without one, or (young, poisson, density) for all
    densities     {"MATERIAL": density}; elastics: {"MATERIAL": (young, poisson)}: for materials that lack them; thickness of shells, m
    contact       contact pairs of an .inp: "refuse", "tie" their surfaces, or leave them "open"
    nodes         numbers of the nodes to keep, node_sets: those of these sets; else node_count of them, spread over the surface
    cut_off       drops modes above this many times `highest` (0: none) but for those that keep the static deflection within static_error
    stiffening    True, False, or "all": geometric stiffening at all nodes, however many modes there are
    stress        stress of each mode at the kept nodes; damping: ratio of critical damping of every mode
    threads       of the dense kernels; memory: limit in GB, 0: what is free
    progress      called now and then with what is done (text); may raise to stop

    Theory: Heckmann et al. 2006, section 4 (sim/reduce/REDUCE.md). Raises InputError for what is wrong with the model or the words,
    SimulationError for what cannot be computed.
    """
    words = {
        "method": method,
        "modes": modes,
        "highest": highest,
        "lowest": lowest,
        "interfaces": _named(interfaces),
        "hold": {True: "auto", False: "none"}.get(hold, hold),
        "units": _listed(units),
        "materials": _named(materials),
        "densities": _named(densities),
        "elastics": _named(elastics),
        "contact": contact,
        "thickness": thickness,
        "nodes": list(nodes),
        "node_sets": list(node_sets),
        "node_count": node_count,
        "cut_off": cut_off,
        "static_error": static_error,
        "stiffening": bool(stiffening),
        "stiffening_forced": stiffening == "all",
        "stress": stress,
        "damping": damping,
        "threads": threads,
        "memory": memory,
    }
    words.update({name: _os.fspath(file) for name, file in (("mass", mass), ("node_table", node_table), ("dofs", dofs)) if file})
    return _core._reduce(_os.fspath(model), words, progress)


def compare(a, b, *, exact=False):
    """Are two pictures (arrays or PNG files) the same? A dict: passes, equal, largest and mean difference, ssim, flip, ...

    The gate is that of `flexframe compare`, whose differences are levels of 255. exact: only equal pixels pass. Pictures: (height,
    width, 3 or 4) uint8. SSIM: Wang et al. 2004; FLIP: Andersson et al. 2020. Raises ArgumentError for other arrays, FileError.
    """
    a, b = (read_png(_os.fspath(p)) if isinstance(p, (str, _os.PathLike)) else p for p in (a, b))
    return _core._compare(a, b, exact)


class Study:
    """What accuracy costs: the report (a dict, as study.json has it) and the folder with its diagrams. Shows its diagram in Jupyter."""

    def __init__(self, folder):
        self.folder = _pathlib.Path(folder)
        self.report = _json.loads((self.folder / "study.json").read_text(encoding="utf-8"))

    def __getitem__(self, key):
        return self.report[key]

    def _repr_html_(self):
        return (self.folder / "front.svg").read_text(encoding="utf-8")

    def __repr__(self):
        return f"<flexframe.Study of {self.report.get('title', '')!r} in {self.folder}>"


def study(scene, folder=None, *, axes=(), repeats=3, reference_seconds=60.0, progress=None):
    """Accuracy against CPU time of a scene over its settings, a Study.

    folder: where report, tables and diagrams go; None: a temporary one. axes: tolerance, method, elements, ...; empty: all that it has.
    Raises InputError for a scene without outputs or an axis that it does not have.
    """
    folder = _tempfile.mkdtemp(prefix="flexframe-study-") if folder is None else folder
    _core._study(_scene(scene), _os.fspath(folder), list(axes), repeats, reference_seconds, progress)
    return Study(folder)


class Sweep:
    """What came of a sweep, row by row: arrays over the points that were run. Shows its diagrams in Jupyter.

    folder     where table.csv, table.h5, report.html and the diagrams are
    points     numbers of the points, (n,)
    keys       {"body.rod.length": (n,) values, SI, or a list of words}
    responses  {"deflection": (n,) values, SI; not a number where a point has none}
    ends       n words: done, warned, lacking, refused, failed, too long, crashed (sim/sweep/README.md)
    cpu        CPU seconds of each point, (n,)
    error      estimated error of each run relative to the range of the output error_of; not a number: not estimated
    messages   {point: why it has no response, or what its run warned of}
    indices    {response: {key: {"first", "total", ...} of Sobol or {"mean_size", "mean", "deviation"} of Morris}}
    found      of minimise and maximise: {"point", "value", "settings", "at_ends", "active_limits", "warnings"}; else None
    """

    def __init__(self, folder, table):
        self.folder = _pathlib.Path(folder)
        self.points = _np.array(table["point"], dtype=_np.int64)
        self.keys, self.responses, self.ends = table["keys"], table["responses"], table["end"]
        self.cpu, self.error, self.error_of = table["cpu"], table["error"], table["error_of"]
        self.messages, self.indices, self.found = table["messages"], table["indices"], table["found"]

    def __getitem__(self, name):
        """The values of a response or of a key."""
        for table in (self.responses, self.keys):
            if name in table:
                return table[name]
        raise KeyError(f"{name}: the sweep has {', '.join([*self.responses, *self.keys])}")

    def __len__(self):
        return len(self.points)

    def _counts(self):
        return ", ".join(f"{self.ends.count(word)} {word}" for word in dict.fromkeys(self.ends))

    def __repr__(self):
        return f"<flexframe.Sweep of {len(self)} points ({self._counts()}) in {self.folder}>"

    def _repr_html_(self):
        return _show.sweep_html(self)


def _values(value):
    """Values of a key as --set takes them: a text as it is, a row of numbers or words as a list, a number."""
    if isinstance(value, _np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple, range)):
        return ",".join(v if isinstance(v, str) else _to_toml(v) for v in value)
    return value if isinstance(value, str) else _to_toml(value)


def sweep(
    scene,
    set,
    responses=(),
    folder=None,
    *,
    sample="",
    sensitivity="",
    seed=1,
    minimise=None,
    maximise=None,
    limits=(),
    searches=4,
    runs=200,
    precision=1e-4,
    accuracy=None,
    tolerance=None,
    method=None,
    estimate_error=True,
    check_effects=True,
    strict=False,
    longest=0.0,
    workers=0,
    resume=False,
    plots=True,
    progress=None,
):
    """A scene many times: its keys over ranges, lists or chance, and of each run some numbers. A Sweep; `flexframe sweep` of Python.

    scene        a file name, a Scene or a dict; one that is no file as it stands is written to folder/scene.toml, where its relative
                 file names then start
    set          {"body.rod.length": [0.2, 0.3, 0.4], "L": "0.2:0.4:21", "mu": "normal(0.1,0.01)"}: numbers, or a text as --set takes it
    responses    {"deflection": "max(abs(rod_middle.y))"}, or texts "NAME=EXPRESSION"
    folder       where rows, tables and diagrams go; None: a temporary one
    sample       "lhs:N", "sobol:N", "random:N" for keys by chance; sensitivity: "sobol:N" or "morris:N" for indices; seed of both
    minimise     an expression or the name of a response: the settings are searched that make it smallest, keys between "LOW:HIGH";
                 maximise: largest; limits: ["max(abs(motor)) <= 200"]; searches, runs of each, precision of the keys in their ranges
    accuracy, tolerance, method, estimate_error, check_effects   as simulate() has them; strict: a run that warns counts as failed
    longest      CPU seconds after which a point is given up; 0: none
    workers      processes, 0: one a core; resume: keep the rows that folder has of the same scene, options and module
    plots        diagrams and report.html; progress: called with the share of the points that is done, 0..1; may raise to stop

    The rows are those of the program to the last bit. Failed points are rows with their sentence. A point's own warnings are in messages.
    Raises InputError for a key, value or response that cannot be used, FileError. Words: sim/sweep/README.md.
    """
    if minimise is not None and maximise is not None:
        raise ArgumentError("minimise excludes maximise: of two goals one can be a limit")
    folder = _pathlib.Path(_tempfile.mkdtemp(prefix="flexframe-sweep-") if folder is None else folder)
    file = scene
    if isinstance(scene, (Scene, dict)):
        made = _scene(scene)
        file = _pathlib.Path(made.file)
        if not file.is_file() or file.read_text(encoding="utf-8") != made.text:
            folder.mkdir(parents=True, exist_ok=True)
            file = folder / "scene.toml"
            file.write_text(made.text, encoding="utf-8")
    accuracy, tolerance = _number("accuracy", accuracy, 1e-9, 0.5), _number("tolerance", tolerance, 1e-13, 0.1)
    goal = minimise if minimise is not None else maximise
    words = {
        "settings": [f"{key}={_values(value)}" for key, value in set.items()] if isinstance(set, dict) else list(set),
        "responses": [f"{name}={text}" for name, text in responses.items()] if isinstance(responses, dict) else list(responses),
        "sample": sample,
        "sensitivity": sensitivity,
        "seed": seed,
        "accuracy": accuracy,
        "tolerance": tolerance,
        "method": method,
        "estimate_error": estimate_error,
        "check_effects": check_effects,
        "strict": strict,
        "longest": longest,
    }
    if goal is not None:
        words.update(goal=goal, maximise=minimise is None, limits=list(limits), precision=precision, searches=searches, runs=runs)
    elif limits:
        raise ArgumentError("limits belong to minimise or maximise")
    place = {"folder": _os.fspath(folder), "workers": workers, "resume": resume, "plots": plots}
    return Sweep(folder, _core._sweep(_os.fspath(file), words, place, progress))


def write_results(path, t, bodies, *, outputs=None, title="", render=None):
    """Writes the results of another program, to be drawn by draw(), film() or `flexframe render`.

    t       (nt,) times, ascending, s
    bodies  {"name": {"position": (nt, 3), "orientation": (nt, 4) w x y z, "mesh": "part.obj",
             "nodes": (nn, 3), "displacement": (nt, nn, 3), "rotation": (nt, nn, 3)}}; SI units, all but one of them may be left out:
            displacements are those of the nodes relative to the undeformed body, in the body frame; "node_names": nn words;
            "von_mises": (nt, nn), Pa; in place of "mesh" a surface: "points" (m, 3), "triangles" (k, 3) from 0, "colors" (k, 3)
            sRGB 0..1, "point_nodes" (m,): the node that each point is (without it the kernel map carries the nodes' motion to them)
    outputs {"column": (nt,)}; render: the [render] table, a dict
    Returns the Results. Raises ArgumentError for wrong shapes, FileError.
    """
    if not isinstance(bodies, dict):
        raise ArgumentError(f"bodies are a dict, name: arrays; found {type(bodies).__name__}")
    text = _to_toml({"render": render}, root=True) if render else ""
    _core._write_results(_os.fspath(path), t, bodies, outputs or {}, title, text)
    return read_results(_os.fspath(path))


def _scene_again(text, file):
    return _core._parse(text, file, [])


def _results_again(data):
    with _tempfile.TemporaryDirectory(prefix="flexframe-") as folder:
        file = _pathlib.Path(folder) / "results.h5"
        file.write_bytes(data)
        return read_results(file)


def _pickle_results(results):
    """Results travel to other processes as their file does."""
    with _tempfile.TemporaryDirectory(prefix="flexframe-") as folder:
        file = _pathlib.Path(folder) / "results.h5"
        results.save(file)
        return _results_again, (file.read_bytes(),)


# Scenes and results may be handed to other processes (multiprocessing); both are constant, so that a copy is the thing itself.
_copyreg.pickle(Scene, lambda s: (_scene_again, (s.text, _os.fspath(s.file))))
_copyreg.pickle(Results, _pickle_results)
for _kind in (Scene, Results, State, Body, KernelMap):
    _kind.__copy__ = lambda self: self
    _kind.__deepcopy__ = lambda self, memo: self


def _no_copy(self, *ignored):
    raise TypeError("a Simulation is not copied or pickled: b = Simulation(scene), then b.restore(a.state()) is its copy")


Simulation.__copy__ = Simulation.__deepcopy__ = Simulation.__reduce_ex__ = _no_copy
_show.attach(Results)
