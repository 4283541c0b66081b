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

import json as _json
import os as _os
import pathlib as _pathlib
import tempfile as _tempfile

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
    "write_results",
]


def _settings(values):
    """{"L": 0.4, "body.rod.elements": 12} or ["L=0.4"] as the words of --set."""
    if isinstance(values, dict):
        return [f"{key}={_to_toml(value)}" for key, value in values.items()]
    return list(values)


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
    text = words if isinstance(words, str) else _to_toml(words, root=True)
    return _core._parse(text, _os.fspath(name), _settings(set))


def _scene(given):
    if isinstance(given, Scene):
        return given
    return scene(given) if isinstance(given, dict) else load(given)


def simulate(scene, *, accuracy=None, tolerance=None, method=None, estimate_error=True, check_effects=True, progress=None):
    """Simulates a scene (a Scene, a dict, or a file name) and returns Results.

    accuracy        asked error of the outputs relative to their ranges: tolerance, modes and effects are chosen; excludes tolerance
    tolerance       relative local error, in place of the scene's
    method          auto, adams, bdf, erk, dirk, ida or exponential
    estimate_error  runs the scene once more, looser, and compares (less than half the run's cost)
    check_effects   looks at what effects that are off are worth
    progress        called now and then with the share of the run that is done, 0..1; may raise to stop

    Raises InputError for a scene that makes no mechanism, SimulationError where it cannot be integrated. Look at Results.warnings.
    """
    return _core._simulate(_scene(scene), accuracy, tolerance, method, estimate_error, check_effects, progress)


def drawing(results, *, size=None, **words):
    """Results made ready to be drawn, a Drawing: for many pictures of one motion.

    size: (width, height) in pixels. words: those of the scene's [render] table, in place of its own (color_by="stress", scales=[1, 20]).
    Raises InputError for an unknown word.
    """
    if size is not None:
        words["size"] = list(size)
    return Drawing(results, [f"render.{key}={_to_toml(value)}" for key, value in words.items()])


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

    The gate is that of `flexframe compare`. exact: only equal pixels pass.
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
    text = _to_toml({"render": render}, root=True) if render else ""
    _core._write_results(_os.fspath(path), t, bodies, outputs or {}, title, text)
    return read_results(_os.fspath(path))


_show.attach(Results)
