"""Every key of SCENE.md misspelt and mistyped, and every word among its values misspelt: exit 2, and a sentence with file, line and key.

The scenes are those of RECIPES.md and test_every_word.py, and two that have the remaining keys. Each pair of table (with its kind) and key
is tried once.
"""
import concurrent.futures
import pathlib
import re
import subprocess
import sys

from program import expect, finish, flexframe, source, temporary_folder

rest = [
    r"""
title = "All that is left of joints and beams"
include = "more.toml"
[simulation]
duration = 0.01
output_rate = 1000
gravity = [0, -9.81, 0]
tolerance = 1e-6
method = "auto"
max_steps = 1e6
start = "assembled"
[[body]]
name = "beam"
kind = "beam"
length = 1
section = { shape = "general", area = 1e-4, iy = 1e-9, iz = 1e-9, j = 1e-9, iyz = 0, shear_y = 0.8, shear_z = 0.8, \
    rotary_iy = 2e-9, rotary_iz = 2e-9 }
material = { density = 2700, youngs_modulus = 70e9, poisson = 0.3 }
model = "finite-element"
elements = 4
keep_modes = 2
keep_axial = 1
keep_torsion = 1
keep_static = true
keep_inertia = false
boundary = "clamped-free"
effects = "auto"
without = ["torsion"]
damping = { mass = 0, stiffness = 1e-5 }
shown = "joints"
color = "#112233"
frames = { f = { at = 0.5, rotation = [0, 0.1, 0] } }
[[body]]
name = "chain"
kind = "beam"
model = "lumped"
length = 1
section = { shape = "tube", outer_diameter = 0.02, inner_diameter = 0.01 }
material = { density = 2700, youngs_modulus = 70e9 }
curvature_coupling = true
initial = { static = false }
damping = { ratio = 0.01 }
[[body]]
name = "steps"
kind = "beam"
length = 1
volumes = 3
sections = [{ at = 0, shape = "tube", outer_diameter = 0.02, thickness = 0.002, angle = 0.1 }, { at = 1, shape = "tube", \
    outer_diameter = 0.02, thickness = 0.001, angle = 0.1 }]
material = { density = 2700, youngs_modulus = 70e9 }
[[body]]
name = "arc"
kind = "beam"
axis = { x = "sin(u)", y = "1 - cos(u)", z = "0", from = 0, to = 1, closed = false }
section = { shape = "circle", diameter = 0.01 }
material = { density = 2700, youngs_modulus = 70e9 }
[[body]]
name = "forms"
kind = "beam"
model = "modal"
length = 1
modes = { bending_xy = [1, 2] }
section = { shape = "box", width = 0.02, height = 0.02, web = 0.002, flange = 0.002 }
material = { density = 2700, youngs_modulus = 70e9 }
[[body]]
name = "box"
kind = "rigid"
density = 2700
shapes = [{ shape = "box", size = [0.1, 0.1, 0.1], position = [0, 0, 0], rotation = [0, 0, 0.1], color = "#cc3311", \
    density = 1000 }, { shape = "gear", radius = 0.1, teeth = 20, thickness = 0.01, inner_radius = 0.01 }, { shape = "link", \
    from = "origin", to = [1, 0, 0], width = 0.1, thickness = 0.01, hole = 0.05, axis = [0, 0, 1] }, { shape = "spring", \
    length = 0.1, radius = 0.02, wire = 0.002, turns = 5 }, { shape = "plate", size = [0.1, 0.1], thickness = 0.01 }, \
    { shape = "disc", radius = 0.1, inner_radius = 0.05, thickness = 0.01 }, { shape = "sphere", radius = 0.1 }, { shape = "cylinder", \
    radius = 0.1, inner_radius = 0.05, length = 0.1 }, { shape = "capsule", radius = 0.1, from = "origin", to = [1, 0, 0] }]
[[body]]
name = "port"
kind = "statespace"
mass = 1
mesh = { file = "wedge.obj", unit = "mm", scale = 1, position = [0, 0, 0], rotation = { quaternion = [1, 0, 0, 0] } }
drawing = { ghost = "body" }
inertia = [1, 1, 1]
omega = [[100]]
gamma = [[0.1]]
sigma = [[1, 0, 0]]
theta = [[1], [0], [0]]
frames = { p = [0.1, 0, 0], s = { position = [0.1, 0, 0], rotation = [0, 0, 0.1] } }
ports = ["p"]
[[joint]]
name = "clamp"
kind = "weld"
parent = "ground"
child = "beam"
position = [0, 0, 0]
rotation = { euler = "zxz", angles = [0.1, 0, 0] }
[[joint]]
name = "clamp 2"
kind = "weld"
parent = "ground"
child = "chain"
rotation = { axis = [0, 0, 1], angle = 0.1 }
[[joint]]
name = "clamp 3"
kind = "weld"
parent = "ground"
child = "steps"
rotation = { matrix = [[0, -1, 0], [1, 0, 0], [0, 0, 1]] }
[[joint]]
name = "clamp 4"
kind = "weld"
parent = "ground"
child = "arc"
[[joint]]
name = "clamp 5"
kind = "weld"
parent = "ground"
child = "forms"
[[joint]]
name = "slide"
kind = "prismatic"
parent = "ground"
child = "box"
initial = { value = 0, rate = 0 }
spring = { stiffness = 1, damping = 1, rest = 0, preload = 0 }
friction = { coefficient = 0.1, normal_force = 1, static_coefficient = 0.2, radius = 1, regularised = 0.01 }
stop = { lower = -1, upper = 1, stiffness = 100, damping = 1 }
[[joint]]
name = "screw"
kind = "screw"
parent = "ground"
child = "port"
pitch = 0.01
[[output]]
name = "s"
of = "beam"
quantity = "section_force"
at = 0.5
description = "in the middle"
[[output]]
name = "r"
of = "clamp"
quantity = "reaction"
frame = "parent"
[[output]]
name = "e"
expression = "s.N + r.x"
unit = "N"
""",
    r"""
[simulation]
duration = 0.01
accuracy = 1e-2
[[input]]
name = "valve"
value = 1
[[body]]
name = "a"
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
[[body]]
name = "b"
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
[[joint]]
name = "a"
kind = "prismatic"
parent = "ground"
child = "a"
[[joint]]
name = "b"
kind = "planar"
parent = "ground"
child = "b"
position = [0.3, 1, 0]
[[force]]
name = "gas"
kind = "force"
on = "a"
direction = [0, 0, 1]
frame = "body"
value = { table = [[0, 1], [0.7, 2], [1.4, 0], [2, 1]], of = "a", period = 2 }
[[force]]
name = "d"
kind = "drag"
on = "a"
linear = 1
quadratic = 1
wind = [1, 0, 0]
[[force]]
name = "s"
kind = "spring-damper"
on = "a"
from = "b"
stiffness = 1
damping = 1
rest = "1"
preload = 0
value = "0.1*length"
[[force]]
name = "k"
kind = "cable"
on = "a"
from = "ground"
through = ["b"]
stiffness = 1
damping = 1
rest = 1
[[force]]
name = "c"
kind = "contact"
on = "b"
from = "ground"
shape = "cylinder"
radius = 0.1
axis = [0, 0, 1]
width = 0.1
against = "plane"
normal = [0, 1, 0]
stiffness = 1e4
exponent = 1.5
damping = 0.1
friction = { coefficient = 0.1, static_coefficient = 0.2, stiffness = 100, damping = 1 }
[[force]]
name = "c2"
kind = "contact"
on = "b"
from = "ground"
shape = "sphere"
radius = 0.1
against = "sphere"
from_radius = 0.1
stiffness = 1e4
restitution = 0.5
[[force]]
name = "c3"
kind = "contact"
on = "b"
shape = "point"
against = "curve"
curve = { points = [[0, 0], [1, 0], [2, 0]], closed = false }
stiffness = 1e4
[[block]]
name = "g"
kind = "state-space"
input = ["valve"]
A = [[-1]]
B = [[1]]
C = [[1]]
D = [[0]]
sample = 0.001
discrete = true
initial = [0]
[[block]]
name = "filtered"
kind = "pid"
input = "t"
proportional = 1
integral = 1
derivative = 1
filter = 0.1
[[coupling]]
name = "lin"
kind = "linear"
terms = [{ joint = "a", coordinate = 1, factor = 1 }, { joint = "b", coordinate = 2, factor = 1 }]
value = 0
""",
]


def recipes(folder):
    """The scenes of RECIPES.md; the files that these and `rest` name are put into the folder."""
    page = (source / "sim" / "RECIPES.md").read_text()
    (folder / "wedge.obj").write_text(re.search(r"```text\n(?=v )(.*?)```", page, re.S).group(1))
    (folder / "more.toml").write_text("[parameters]\nmore = 1\n")
    return [part.split("```")[0] for part in page.split("```toml\n")[1:]]


def scenes_of_words():
    """The scenes of test_every_word.py, without running them."""
    text = (source / "tests" / "regression" / "test_every_word.py").read_text()
    space = {}
    exec(compile(text[: text.index("def look(")], "test_every_word.py", "exec"), space)
    return [space["text_of"](one, False, False) for one in space["cases"].values()]


def table_of(lines, at):
    """Line of the table's header, and table with its kind (shape, model)."""
    header = at
    while header >= 0 and not lines[header].startswith("["):
        header -= 1
    if header < 0:
        return 0, "scene"
    kind = ""
    for line in lines[header + 1 :]:
        if line.startswith("["):
            break
        found = re.match(r'(kind|model|shape) = "(.*)"', line)
        kind += " " + found.group(2) if found else ""
    return header, lines[header].strip("[]") + kind


# Keys whose text is free.
FREE = ("name", "title", "description", "unit")


def value_end(line, at):
    """Where a value of an inline table ends, which begins at `at`: at the comma or bracket that is not its own."""
    depth, quoted = 0, False
    for k in range(at, len(line)):
        quoted ^= line[k] == '"'
        if quoted:
            continue
        if depth == 0 and line[k] in ",}]":
            return k
        depth += (line[k] in "[{") - (line[k] in "]}")
    return len(line)


def mutants(text):
    """(what, words, text, first and last line that may be named) of every key, once for its table."""
    lines = text.split("\n")
    for at, line in enumerate(lines):
        found = re.match(r"(\w+) = (.*)$", line)
        if not found or line.startswith("#"):
            continue
        key, value = found.group(1), found.group(2)
        header, table = table_of(lines, at)
        if table in ("parameters",):
            continue
        keys = [(key, (0, len(key)), value, (found.start(2), found.end(2)), "")]
        shape = re.search(r'shape = "(\w+)"', line)
        for inner in re.finditer(r"(?<=[{,]) (\w+) = ", line):
            inside = key + (" " + shape.group(1) if shape and key.startswith("s") else "")
            place = key == "frames" and inner.group(1) in ("at", "position", "rotation")
            if place or key not in ("frames", "modes", "parameters"):
                end = value_end(line, inner.end())
                keys.append((inner.group(1), inner.span(1), line[inner.end() : end], (inner.end(), end), inside))
        for word, (a, b), value, (c, d), inside in keys:
            # Words among the values: kinds, shapes, quantities, names of what is meant.
            for inner in re.finditer(r'"([a-z][a-z_-]{2,})"', value) if "{" not in value and word not in FREE else ():
                other = inner.group(1)[:-1] + ("z" if inner.group(1)[-1] != "z" else "s")
                at_word = (c + inner.start(1), c + inner.end(1))
                yield ("misnamed", table, inside, f"{word} {inner.group(1)}"), other, line[: at_word[0]] + other + line[
                    at_word[1] :
                ], header, at
            wrong = word[:-2] + word[-1] + word[-2] if len(word) > 3 and word[-1] != word[-2] else word + "z"
            yield ("misspelt", table, inside, word), wrong, line[:a] + wrong + line[b:], header, at
            wrong = '"blue"' if value.strip() in ("true", "false") else "true"
            yield ("mistyped", table, inside, word), word, line[:c] + wrong + line[d:], header, at


def checked(folder, number, text):
    scene = folder / f"s{number}.toml"
    scene.write_text(text)
    return subprocess.run([flexframe, "check", str(scene)], capture_output=True, text=True, timeout=120)


def checked_at_once(folder, jobs):
    """The same of many scenes by the Python module, without a start of the program for each: (refused, message) of each job's text. By
    the program where the build has no module, for what the module takes, and for every twentieth scene, whose exit code has to be 2."""
    module = pathlib.Path(flexframe).resolve().parent / "python"
    if (module / "flexframe").exists():
        sys.path.insert(0, str(module))
        import flexframe as ff

        def answer(k):
            if k % 20 == 0:
                return by_program(k)
            scene = folder / f"s{k}.toml"
            scene.write_text(jobs[k][2])
            try:
                ff.Simulation(ff.load(scene))
            except ff.InputError as error:
                return True, str(error)
            return by_program(k)  # looks of bodies are read where they are drawn

    else:
        print("the build has no Python module: every scene by the program")
        answer = None

    def by_program(k):
        done = checked(folder, k, jobs[k][2])
        return done.returncode == 2, done.stderr.strip()

    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        return list(pool.map(answer or by_program, range(len(jobs))))


def documented_keys():
    """Keys in SCENE.md's tables of keys, up to [render]."""
    page = (source / "sim" / "SCENE.md").read_text().split("## [render]")[0]
    keys = set()
    for table in re.findall(r"^\| key \|.*\n(?:\|.*\n)+", page, re.M):
        for row in re.findall(r"^\| (`[^|]*) \|", table, re.M):
            keys.update(re.findall(r"`(\w+)`", row))
    return keys


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    tried, jobs = set(), []
    # inline tables stand on one line, as TOML has them; here they are broken for the page
    for number, text in enumerate(recipes(folder) + scenes_of_words() + [re.sub(r"\\\n\s*", "", text) for text in rest]):
        good = checked(folder, f"good{number}", text)
        expect(good.returncode == 0, f"a scene that should be right is refused: {good.stderr}\n{text[:300] if good.returncode else ''}")
        lines = text.split("\n")
        for what, word, line, header, at in mutants(text) if good.returncode == 0 else []:
            if what in tried:
                continue
            tried.add(what)
            jobs.append((what, word, "\n".join(lines[:at] + [line] + lines[at + 1 :]), header, at))
    for k, ((refused, says), (what, word, text, header, at)) in enumerate(zip(checked_at_once(folder, jobs), jobs)):
        expect(refused, f"{what}: not refused; {text.splitlines()[at]}: {says}")
        if not refused:
            continue
        named = [int(n) for n in re.findall(rf"s{k}\.toml:(\d+):", says)]
        expect(any(header + 1 <= n <= at + 1 for n in named), f"{what}: lines {named}, wanted {header + 1} to {at + 1}: {says}")
        expect(word in says, f"{what}: '{word}' is not in: {says}")
    walked = {what[3] for what in tried}
    missing = documented_keys() - walked
    expect(not missing, f"keys of SCENE.md that no scene here has: {sorted(missing)}")
    print(f"{len(jobs)} wrong scenes, {len(walked)} keys and words")
finish()
