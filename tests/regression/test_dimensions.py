"""[render] dimensions: lines between frames at the place that a camera of known scale gives them, values as the history has them."""
import re
import xml.etree.ElementTree

import numpy as np

from program import expect, finish, history, near, run, temporary_folder

SCENE = """[simulation]
duration = 1.0
gravity = [0, -9.81, 0]
[[body]]
name = "rod"
kind = "rigid"
density = 500.0
shapes = [{ shape = "box", size = [0.4, 0.03, 0.03], position = [0.2, 0, 0] }]
frames = { tip = [0.4, 0, 0], middle = [0.2, 0, 0] }
[[body]]
name = "bob"
kind = "rigid"
density = 500.0
shapes = [{ shape = "sphere", radius = 0.03 }]
frames = { hook = [-0.15, 0, 0] }
[[joint]]
name = "pin"
kind = "revolute"
parent = "ground"
child = "rod"
[[joint]]
name = "hinge"
kind = "revolute"
parent = "rod.tip"
child = "bob.hook"
[[output]]
name = "tip"
quantity = "position"
of = "rod.tip"
[[output]]
name = "bob"
quantity = "position"
of = "bob"
[render]
size = [640, 480]
frame_rate = 5
speed = 1.0
channels = ["vector"]
ground = false
dimensions = [
  { from = "ground", to = "bob", label = "reach" },
  { from = "ground", to = "bob", along = "x", offset = [0, 0.2, 0], label = "width" },
  { at = "rod.tip", from = "rod", to = "bob", label = "bend", radius = 0.08 },
  { from = "rod", to = "rod.tip" },
]
camera = { position = [0, 0, 5], target = [0, 0, 0], projection = "orthographic", height = 1.6, fit = false }
overlay = { title = false, time = false, scalar_bar = false, triad = false, legend = false, note = false }
"""
NAME = "{http://www.w3.org/2000/svg}"
SCALE = 480 / 1.6


def pixel(p):
    return np.array([320 + SCALE * p[0], 240 - SCALE * p[1]])


def paths(root):
    out = []
    for path in root.iter(NAME + "path"):
        out.append(np.array(re.findall(r"-?[\d.]+", path.get("d")), float).reshape(-1, 2))
    return out


def has_line(lines, a, b):
    return any(np.abs(line[0] - a).max() < 0.02 and np.abs(line[-1] - b).max() < 0.02 for line in lines)


def check(folder):
    h = history(folder / "out/histories.csv")
    for k in range(6):
        root = xml.etree.ElementTree.fromstring((folder / f"out/vector/frame_{k:05d}.svg").read_text(encoding="utf-8"))
        i = min(range(len(h["t"])), key=lambda j: abs(h["t"][j] - k / 5))
        expect(abs(h["t"][i] - k / 5) < 1e-9, "a sample at the picture's time")
        tip, bob = (np.array([h[f"{name}.{c}"][i] for c in "xyz"]) for name in ("tip", "bob"))
        words = {}
        for text in root.iter(NAME + "text"):
            found = re.fullmatch(r"(?:(\w+) )?([\d.]+)(°|\u202fm{1,2})", text.text)
            expect(found, f"picture {k}: {text.text} is no dimension")
            words[found.group(1)] = float(found.group(2)) * {"°": 1, "\u202fm": 1, "\u202fmm": 1e-3}[found.group(3)]
        expect(set(words) == {"reach", "width", "bend", None}, f"picture {k}: values {words}")
        a, b = -tip, bob - tip
        wanted = {
            "reach": np.linalg.norm(bob),
            "width": abs(bob[0]),
            "bend": np.degrees(np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1, 1))),
            None: 0.4,
        }
        for name, value in wanted.items():
            near(words.get(name, np.nan), value, 0.051 if name == "bend" else 0.6e-4, f"picture {k}: {name}")
        lines = paths(root)
        expect(has_line(lines, pixel([0, 0]), pixel(bob)), f"picture {k}: reach goes from frame to frame")
        expect(has_line(lines, pixel([0, 0.2]), pixel([bob[0], 0.2])), f"picture {k}: width lies where its offset says")
        expect(has_line(lines, pixel(bob), pixel([bob[0], 0.2])), f"picture {k}: a helper leads to the width")
        arcs = [line for line in lines if len(line) > 2 and np.abs(np.linalg.norm(line - pixel(tip), axis=1) - 0.08 * SCALE).max() < 0.02]
        expect(arcs, f"picture {k}: the arc lies about its vertex")
        for arc in arcs[:1]:
            for end, side in ((arc[0], a), (arc[-1], b)):
                wanted_end = pixel(tip + 0.08 * side / np.linalg.norm(side))
                expect(np.abs(end - wanted_end).max() < 0.02, f"picture {k}: the arc ends on its sides")


def magnified(folder):
    """In an inset the lines end at its frame: none leaves the picture but what is clipped."""
    scene = SCENE.replace("ground = false\n", 'ground = false\ninsets = [{ at = "rod.tip", zoom = 6 }]\n')
    (folder / "inset.toml").write_text(scene)
    run("render", folder / "out/results.h5", "--scene", folder / "inset.toml", "-o", folder / "inset", "--no-video", "--frames", "0:3")
    for k in range(3):
        root = xml.etree.ElementTree.fromstring((folder / f"inset/vector/frame_{k:05d}.svg").read_text(encoding="utf-8"))
        clipped = {path for frame in root.iter(NAME + "svg") if frame is not root for path in frame.iter(NAME + "path")}
        leaving = []
        for path in root.iter(NAME + "path"):
            points = np.array(re.findall(r"-?[\d.]+", path.get("d")), float).reshape(-1, 2)
            if points.min() < 0 or points[:, 0].max() > 640 or points[:, 1].max() > 480:
                leaving.append(path)
        expect(leaving, f"inset of picture {k}: nothing of the dimensions is as large as the inset shows it")
        expect(clipped.issuperset(leaving), f"inset of picture {k}: {len(leaving)} lines leave the picture")


def refused(folder):
    """Wrong dimensions: the line and what is allowed."""
    for text, told in [
        ('{ from = "ground", to = "bobb" }', "did you mean 'bob'"),
        ('{ from = "ground", to = "ground" }', "another frame"),
        ('{ from = "ground" }', "to"),
        ('{ from = "ground", to = "bob", along = "w" }', "along"),
        ('{ from = "ground", to = "bob", radius = 0.1 }', "radius"),
        ('{ from = "ground", to = "bob", at = "rod", along = "x" }', "along"),
        ('{ from = "ground", to = "bob", at = "rod", radius = -1 }', "radius"),
        ('{ from = "ground", to = "bob", offset = 3 }', "offset"),
        ('{ from = "ground", to = "bob", of = "x" }', "allowed"),
    ]:
        start, end = SCENE.index("dimensions = ["), SCENE.index("camera =")
        (folder / "wrong.toml").write_text(SCENE[:start] + f"dimensions = [{text}]\n" + SCENE[end:])
        error = run(
            "render", folder / "out/results.h5", "--scene", folder / "wrong.toml", "-o", folder / "wrong", "--no-video", code=2
        ).stderr
        expect(told in error and "dimensions" in error, f"{text}: {error}")


def camera(folder):
    """A camera that is fitted sees the dimensions too, in metres and in micrometres."""
    for size in (1.0, 1e-4):
        scene = re.sub(r"camera = .*\n", "", SCENE).replace("offset = [0, 0.2, 0]", "offset = [0, 0.6, 0]")
        if size != 1.0:
            scene = (
                re.sub(r"(?<![\w.])0\.(\d+)", lambda m: repr(float(m.group(0)) * size), scene.split("[render]")[0])
                + "[render]"
                + (
                    re.sub(
                        r"(radius = |offset = \[0, )([\d.]+)",
                        lambda m: m.group(1) + repr(float(m.group(2)) * size),
                        scene.split("[render]")[1],
                    )
                )
            )
            scene = scene.replace("9.81", repr(9.81 * size))
        (folder / "fit.toml").write_text(scene)
        run("run", folder / "fit.toml", "-o", folder / "fit", "--no-video", "--no-error-estimate", "--no-effect-check")
        for k in range(6):
            root = xml.etree.ElementTree.fromstring((folder / f"fit/vector/frame_{k:05d}.svg").read_text(encoding="utf-8"))
            points = np.concatenate(paths(root))
            expect(points.min() >= 0 and points[:, 0].max() <= 640 and points[:, 1].max() <= 480, f"size {size}, picture {k}: seen")
            values = [t.text for t in root.iter(NAME + "text") if t.text.startswith("reach")]
            expect(len(values) == 1 and ("µm" in values[0]) == (size != 1.0), f"size {size}, picture {k}: {values}")


with temporary_folder() as name:
    import pathlib

    folder = pathlib.Path(name)
    (folder / "scene.toml").write_text(SCENE)
    run("run", folder / "scene.toml", "-o", folder / "out", "--no-video", "--no-error-estimate", "--no-effect-check")
    for part in (check, magnified, refused, camera):
        print(f"== {part.__name__}", flush=True)
        part(folder)
finish()
