"""Effects: the table, what is off costs nothing, what was left out and matters is found, --strict."""
import json
import math
import pathlib
import re
import shutil
import subprocess

from program import examples, expect, finish, flexframe, history, near, run, temporary_folder
from scene_text import body, joint, output, simulation, table

pendulum = (examples / "pendulum.toml").read_text()


def written(folder, name, text):
    path = folder / f"{name}.toml"
    path.write_text(text)
    return path


def row(report, effect, owner="pendulum"):
    return next(r for r in report["effects"] if r["effect"] == effect and r["owner"] == owner)


def instructions(scene, folder):
    """Instructions of a whole run, by callgrind."""
    out = folder / "callgrind.out"
    done = subprocess.run(
        [
            "valgrind",
            "--tool=callgrind",
            f"--callgrind-out-file={out}",
            flexframe,
            "simulate",
            scene,
            "--csv",
            folder / "c.csv",
            "--no-error-estimate",
            "--no-effect-check",
        ],
        capture_output=True,
        text=True,
        timeout=500,
    )
    expect(done.returncode == 0, f"callgrind run failed: {done.stderr[-500:]}")
    return int(re.search(r"Collected : (\d+)", done.stderr).group(1))


# A cantilever under its weight q, a round bar of stiffness k at its tip, which a spring ks or a rod holds along d = (0, c, s): what moves
# in a plane is computed there; what a tie pulls out of it is not.
L, D, E, RHO, KS = 1.0, 0.01, 70e9, 270.0, 300.0
BAR = f"""[simulation]
duration = 0.001
gravity = [0, -9.81, 0]
start = "static"
[ground]
frames = {{ in = [{L}, 0.5, 0], out = [{L}, 0.3, 0.4] }}
[[body]]
name = "bar"
kind = "beam"
length = {L}
section = {{ shape = "circle", diameter = {D} }}
material = {{ density = {RHO}, youngs_modulus = {E} }}
[[joint]]
name = "wall"
kind = "weld"
parent = "ground"
child = "bar"
[[output]]
name = "tip"
of = "bar.tip"
quantity = "position"
"""
SPRING = f'[[force]]\nkind = "spring-damper"\non = "bar.tip"\nfrom = "ground.%s"\nstiffness = {KS}\nrest = 0.5\n'
BUSHING = '[[force]]\nkind = "bushing"\non = "bar.tip"\nfrom = "ground.%s"\nstiffness = [0, %g, %g, 0, 0, 0]\n'
TIES = (
    ("a spring in the plane", SPRING % "in", True, (1.0, 0.0), KS),
    ("a spring that leaves it", SPRING % "out", False, (0.6, 0.8), KS),
    ("a bushing in the plane", (BUSHING % ("in", KS, 0)).replace('"ground.in"', '"ground.tip"'), True, (1.0, 0.0), KS),
    (
        "a rod that leaves it",
        '[[joint]]\nname = "rod"\nkind = "distance"\nparent = "ground.out"\nchild = "bar.tip"\nlength = 0.5\n',
        False,
        (0.6, 0.8),
        1e30,
    ),
    (
        "a rope that leaves it",
        '[[coupling]]\nname = "rope"\nkind = "rope"\nthrough = ["ground.out", "bar.tip"]\nlength = 0.5\n',
        False,
        (0.6, 0.8),
        1e30,
    ),
    ("drag in the plane", '[[force]]\nkind = "drag"\non = "bar.tip"\nlinear = 1\nwind = [0, 0, 0]\n', True, (1.0, 0.0), 0.0),
    ("drag in a wind across it", '[[force]]\nkind = "drag"\non = "bar.tip"\nlinear = 1\nwind = [0, 0, 1]\n', False, (1.0, 0.0), 0.0),
)


def ties(folder):
    inertia, q = math.pi * D**4 / 64, RHO * math.pi * D**2 / 4 * 9.81
    k, sag = 3 * E * inertia / L**3, q * L**4 / (8 * E * inertia)
    for what, tie, plane, (c, s), ks in TIES:
        text = BAR.replace("in = [", f"tip = [{L}, 0, 0], in = [") + tie
        scene = written(folder, "tie", text)
        said = run("simulate", scene, "--csv", folder / "tie.csv").stdout
        expect(("moves in a plane" in said) == plane, f"{what}: {said}")
        if "wind across" in what:
            continue
        h = history(folder / "tie.csv")
        held = ks / (k + ks)
        near(h["tip.y"][0], -sag * (1 - c * c * held), 3e-3 * sag, f"{what}, sag")
        near(h["tip.z"][0], sag * c * s * held, 3e-3 * sag, f"{what}, out of the plane")


# A clamped tube on a roller under its own weight: how its tip is turned, at rest.
PROPPED = """[simulation]
duration = 0.01
gravity = [0, -9.81, 0]
start = "static"
[[body]]
name = "tube"
kind = "beam"
length = 0.6
section = { shape = "tube", outer_diameter = 0.04, thickness = 0.004 }
material = { density = 7850, youngs_modulus = 2.1e11, poisson = 0.3 }
effects = ["bending_xy"]
[[body]]
name = "roller"
kind = "rigid"
mass = 0.1
inertia = [1e-4, 1e-4, 1e-4]
[[joint]]
name = "clamp"
kind = "weld"
parent = "ground"
child = "tube.root"
[[joint]]
name = "rail"
kind = "prismatic"
parent = "ground"
child = "roller"
axis = [1, 0, 0]
position = [0.6, 0, 0]
[[joint]]
name = "pin"
kind = "revolute"
parent = "roller"
child = "tube.tip"
[[output]]
name = "slope"
of = "tube.tip"
quantity = "rotation"
"""


def turned_at_rest(folder):
    """What is told of shear along the motion is between half and three times what it is worth: the angle is seen against itself."""
    slope = []
    for name, text in (("without", PROPPED), ("with", PROPPED.replace('"bending_xy"', '"bending_xy", "shear"'))):
        said = run("simulate", written(folder, name, text), "--csv", folder / "slope.csv").stdout
        slope.append(history(folder / "slope.csv")["slope.z"][-1])
        if name == "without":
            told = re.search(r"shear of 'tube' is left out, but its influence is ([0-9.e+-]+) of the range of slope.z", said)
            expect(told, f"nothing is told of shear: {said}")
    true = abs(slope[1] / slope[0] - 1)
    if told:
        expect(0.5 * true < float(told[1]) < 3 * true, f"shear is told {told[1]} where {true:.2g} is true")


def slowed_vibration(folder):
    """The rod's stretching vibrates on after the torque ends, and the crank's, which hardly strains it, runs it out of phase."""
    scene = (examples / "slider_crank.toml").read_text()
    rich = 'effects = ["bending_xy", "shear", "axial"]'
    expect(rich in scene, "the example's crank does not stretch")
    ends = []
    for name, text in (("poor", scene.replace(rich, 'effects = ["bending_xy", "shear"]')), ("rich", scene)):
        words = ("--tolerance", "1e-7") + (("--no-effect-check",) if name == "rich" else ())
        said = run("simulate", written(folder, name, text), *words, "--csv", folder / f"{name}.csv").stdout
        ends.append(history(folder / f"{name}.csv"))
        if name == "poor":
            told = re.search(r"WARNING +axial of 'crank' is left out, but its influence is ([0-9.e+-]+) of the range of rod_middle.x", said)
            expect(told, f"nothing is told of the crank's stretching: {said}")
    apart = max(abs(a - b) for a, b in zip(ends[0]["rod_middle.x"], ends[1]["rod_middle.x"]))
    true = apart / (max(ends[1]["rod_middle.y"]) - min(ends[1]["rod_middle.y"]))
    if told:
        expect(0.5 * true < float(told[1]) < 3 * true, f"stretching of the crank is told {told[1]} where {true:.2g} is true")


def console_pushed_slowly(folder):
    """Two slender welded beams in space, bent across their plane in 30 periods: shear is worth what it adds at rest, by closed formula.
    Coordinates of a micrometre that swing between the samples say nothing of it."""
    L1, L2, E, rho, d, F, poisson, k = 0.5, 0.3, 7e10, 2700.0, 0.008, 0.2, 0.3, 0.9
    EI, area = E * math.pi * d**4 / 64, math.pi * d * d / 4
    G = E / (2 * (1 + poisson))
    compliance = (L1**3 + L2**3) / (3 * EI) + L2 * L2 * L1 / (G * math.pi * d**4 / 32)
    T = 30 * 2 * math.pi * math.sqrt(compliance * rho * area * (L1 + L2))
    text = f"[simulation]\nduration = {1.1 * T!r}\noutput_rate = {200 / (1.1 * T)!r}\ngravity = [0, 0, 0]\n"
    for name, length in (("one", L1), ("two", L2)):
        text += (
            f'[[body]]\nname = "{name}"\nkind = "beam"\nlength = {length}\nsection = {{ shape = "circle", diameter = {d} }}\n'
            f"material = {{ density = {rho}, youngs_modulus = {E}, poisson = {poisson} }}\n"
        )
    text += (
        '[[joint]]\nname = "wall"\nkind = "weld"\nparent = "ground"\nchild = "one.root"\n'
        f'[[joint]]\nname = "knee"\nkind = "weld"\nparent = "one.tip"\nchild = "two.root"\nrotation = [0, 0, {math.pi / 2!r}]\n'
        f'[[force]]\nkind = "force"\non = "two.tip"\ndirection = [0, 0, 1]\n'
        f'value = "{F} * (t < {T!r} ? t/{T!r} - sin(2*pi*t/{T!r})/(2*pi) : 1)"\n'
        '[[output]]\nname = "knee"\nof = "one.tip"\nquantity = "displacement"\n'
    )
    said = run("simulate", written(folder, "console", text), "--no-error-estimate", "-v", "--csv", folder / "console.csv").stdout
    expect("switched on" not in said, f"console pushed slowly: an effect is called for: {said}")
    expect("too fast for" not in said, f"console pushed slowly: nothing that is seen vibrates: {said}")
    told = [float(x) for x in re.findall(r"shear of .* left out: (?:at most )?([0-9.e+-]+) of the range of knee.z", said)]
    true = 3 * EI / (k * G * area * L1**2)
    # Vibrations are 3e-4 of the deflection, of which shear moves no more than all.
    expect(told and 0.5 * true < max(told) < 3 * true + 3e-4, f"shear is told {told} where {true:.2g} is true: {said}")


def hidden_by_time(folder):
    """An arm that a motor turns and stops, its shear left out: beside a run that is far off in time, and warned of, nothing is measured,
    which a note says; beside a tight one it is."""
    text = (
        "[simulation]\nduration = 0.5\noutput_rate = 200\n"
        '[[body]]\nname = "arm"\nkind = "beam"\nlength = 1.0\nsection = { shape = "rectangle", height = 0.02, width = 0.02 }\n'
        "material = { density = 1200, youngs_modulus = 3e9, poisson = 0.38 }\n"
        'effects = ["bending_xy", "stiffening"]\n'
        '[[joint]]\nname = "drive"\nkind = "revolute"\nparent = "ground"\nchild = "arm.root"\n'
        'motion = "t < 0.3 ? 0.5*(t/0.3 - sin(2*pi*t/0.3)/(2*pi)) : 0.5"\n'
        '[[output]]\nname = "tip"\nof = "arm.tip"\nquantity = "displacement"\n'
    )
    for tolerance, hidden in (("1e-4", True), ("1e-7", False)):
        words = ("simulate", written(folder, "hidden", text), "-v", "--tolerance", tolerance, "--csv", folder / "hidden.csv")
        said = run(*words).stdout
        expect(("error of the time integration is" in said) == hidden, f"{tolerance}: time is warned of or not: {said}")
        expect(bool(re.search("note +shear of 'arm' left out: .*would hide it", said)) == hidden, f"{tolerance}: hidden or not: {said}")
        expect(bool(re.search("shear of 'arm' left out: .*", said)), f"{tolerance}: something is said of shear: {said}")


def one_run_off(folder):
    """A bracket in space, pushed slowly: over its vibrations the run without stiffening is 0.036 of a range off at the loose tolerance of
    the pair, the one with it is not. What is told is above its own floor only where it is true."""
    text = simulation(1.6, gravity=[0, 0, 0])
    plastic = {"density": 1200.0, "youngs_modulus": 3e9, "poisson": 0.38}
    for name, length in (("b0", 2.53), ("b1", 3.45)):
        text += body(name, "beam", length=length, elements=3, section={"shape": "circle", "diameter": 0.248}, material=plastic)
    text += joint("w0", "weld", "ground", "b0.root") + joint("w1", "weld", "b0.tip", "b1.root", rotation=[0, 0, math.pi / 2])
    rises = "(t < 1.08 ? sin(pi*t/2.16)^2 : 1)"
    text += table("force", kind="force", on="b1.tip", direction=[-0.003, -0.895, 0.446], value=f"149*{rises}")
    text += table("force", kind="torque", on="b1.tip", direction=[-0.52, 2.77, 1.0], value=f"446*{rises}") + output(
        "p1", "b1.tip", "position"
    )
    scene = written(folder, "bracket", text)
    exact = {}
    for without in ("", "without = ['stiffening']\n"):
        columns = folder / f"bracket{len(without)}.csv"
        there = text.replace('name = "b1"\n', f'name = "b1"\n{without}')
        run("simulate", written(folder, "exact", there), "--method", "exponential", "--csv", columns, "--no-effect-check", "--quiet")
        exact[without] = history(columns)
    a, b = exact.values()
    range_of = lambda c: max(a[c]) - min(a[c])
    largest = max(range_of(c) for c in ("p1.x", "p1.y", "p1.z"))
    true = max(max(abs(x - y) for x, y in zip(a[c], b[c])) for c in ("p1.x", "p1.y", "p1.z")) / largest
    told = row(json.loads(run("effects", scene, "--json").stdout), "stiffening", "b1")
    print(f"stiffening of a bracket: told {told['share']:.2g} above {told['floor']:.2g}, {true:.2g} is true")
    expect(told["share"] <= told["floor"] or told["share"] <= 2 * true, f"stiffening of a bracket: {told}, where {true:.2g} is true")
    expect(true <= 2 * max(told["share"], told["floor"]), f"stiffening of a bracket: {told}, less than {true:.2g} that is true")


def stopped_rod(folder):
    """A rod runs along its axis against its joint's stop, k = EA/20L, asked for 1e-2: its stretching moves no output along the motion
    without it, but takes up 2 % of the blow. The rate of its root while it is pressed is a sum over the modes of a rod with a spring at its
    end."""
    length, diameter, modulus, density, speed, gap = 0.55, 0.03, 2.1e11, 7850.0, 2.6, 0.002
    area = math.pi * diameter**2 / 4
    k = modulus * area / (20 * length)
    text = simulation(0.0042, output_rate=1e5, accuracy=1e-2)
    steel = {"density": density, "youngs_modulus": modulus}
    text += body("rod", "beam", length=length, section={"shape": "circle", "diameter": diameter}, material=steel)
    start, stop = {"value": 0.0, "rate": speed}, {"upper": gap, "stiffness": k}
    text += joint("guide", "prismatic", "ground", "rod.root", axis=[1, 0, 0], initial=start, stop=stop)
    text += output("rate", "guide", "rate")
    (folder / "rod.toml").write_text(text)
    done = run("simulate", folder / "rod.toml", "--csv", folder / "rod.csv", "-o", folder / "rod.h5", "--fresh")
    h = history(folder / "rod.csv")
    # x tan x = k L / EA; the root moves by cos x of the tip.
    modes = []
    for n in range(300):
        low, high = n * math.pi, (n + 0.5) * math.pi
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if middle * math.tan(middle) < 1 / 20 else (low, middle)
        x = low
        share = (math.sin(x) / x) / (0.5 + math.sin(2 * x) / (4 * x)) * math.cos(x)
        modes.append((share, x / length * math.sqrt(modulus / density)))
    far, looks = 0.0, 0
    for t, rate in zip(h["t"], h["rate"]):
        since = t - gap / speed
        if since < 0:
            continue
        if sum(a / w * math.sin(w * since) for a, w in modes) < 0:
            break  # let go
        looks += 1
        far = max(far, abs(rate - speed * sum(a * math.cos(w * since) for a, w in modes)))
    expect(looks > 100, f"stopped rod: {looks} samples while it is pressed")
    near(far / (2 * speed), 0, 1e-2, "stopped rod: rate of its root, of its range")


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    ties(folder)
    console_pushed_slowly(folder)
    hidden_by_time(folder)
    one_run_off(folder)
    stopped_rod(folder)
    turned_at_rest(folder)
    slowed_vibration(folder)

    # The table: every effect, who decided, coordinates, share. The pendulum's stiffening is worth all of its deflection (ACCURACY).
    report = json.loads(run("effects", examples / "pendulum.toml", "--json").stdout)
    for effect in ["axial", "bending_xy", "bending_xz", "torsion", "stiffening", "gyroscopic", "shear", "damping"]:
        r = row(report, effect)
        expect(
            set(r["registry"]) == {"meaning", "equation", "matters", "estimate"} and all(r["registry"].values()),
            f"registry of {effect} is incomplete",
        )
    bending, stiffening = row(report, "bending_xy"), row(report, "stiffening")
    expect(bending["on"] and bending["decided_by"] == "scene" and bending["coordinates"] == 20, f"bending_xy: {bending}")
    expect(stiffening["on"] and stiffening["share"] > 0.3 and stiffening["column"].startswith("deflection"), f"stiffening: {stiffening}")
    expect(
        not row(report, "bending_xz")["possible"] and row(report, "bending_xz")["share"] == 0, "a plane scene cannot bend out of its plane"
    )
    expect(row(report, "gravity", "scene")["on"], "gravity is not told")
    text = run("effects", "--list").stdout
    expect("stiffening" in text and "equation" in text, "no registry")

    # Auto in a plane: bending in it only, by symmetry.
    automatic = pendulum.replace('effects = ["bending_xy", "stiffening", "shear"]', 'effects = "auto"')
    report = json.loads(run("effects", written(folder, "auto", automatic), "--json").stdout)
    expect(
        row(report, "bending_xy")["on"] and row(report, "bending_xy")["decided_by"] == "symmetry", "bending_xy is not decided by symmetry"
    )
    expect(not row(report, "torsion")["on"] and row(report, "torsion")["coordinates"] == 0, "torsion in the plane")

    # Left out and worth it: a warning that names the switch; an error with --strict, and no files.
    bare = pendulum.replace('effects = ["bending_xy", "stiffening", "shear"]', 'effects = ["bending_xy"]')
    scene = written(folder, "bare", bare)
    text = run("simulate", scene, "--csv", folder / "bare.csv").stdout
    expect(re.search(r"WARNING +stiffening of 'pendulum' .* add \"stiffening\" to 'effects'", text), f"no warning of stiffening: {text}")
    done = run("simulate", scene, "--csv", folder / "strict.csv", "--strict", code=1)
    expect("stiffening" in done.stderr and not (folder / "strict.csv").exists(), "--strict leaves a file or does not name the effect")
    text = run(
        "simulate",
        written(folder, "without", automatic.replace('effects = "auto"', 'effects = "auto"\nwithout = ["stiffening"]')),
        "--csv",
        folder / "w.csv",
    ).stdout
    expect("take \"stiffening\" out of 'without'" in text, f"no remedy for without: {text}")

    # What "auto" takes, against closed formulas, at equilibrium: nothing that is worth 1 % stays out without a warning.
    E, nu, L = 2.1e11, 0.3, 1.0
    G = E / (2 * (1 + nu))

    def beam(name, section, more="", length=L):
        return (
            f'[[body]]\nname = "{name}"\nkind = "beam"\nlength = {length!r}\nsection = {section}\nmaterial = {{ density = 7800,'
            f" youngs_modulus = {E} }}\nelements = 6\n{more}\n"
        )

    def joint(name, kind, parent, child, more=""):
        return f'[[joint]]\nname = "{name}"\nkind = "{kind}"\nparent = "{parent}"\nchild = "{child}"\n{more}\n'

    def force(on, direction, value, kind="force"):
        return f'[[force]]\nkind = "{kind}"\non = "{on}"\ndirection = {direction}\nvalue = {value}\n'

    def output(name, of, quantity):
        return f'[[output]]\nname = "{name}"\nof = "{of}"\nquantity = "{quantity}"\n'

    static = '[simulation]\nduration = 0.01\noutput_rate = 1000\nstart = "static"\n'

    def held(name, text, words=("--strict",), code=0):
        """The last sample at the default tolerance."""
        csv = folder / f"{name}.csv"
        done = run("simulate", written(folder, name, text), "--csv", csv, *words, code=code)
        columns = history(csv) if code == 0 else {}
        return {c: values[-1] for c, values in columns.items()}, done.stdout + done.stderr

    def rectangle(width, height):
        return f'{{ shape = "rectangle", width = {width!r}, height = {height!r} }}'

    rod = beam("rod", '{ shape = "circle", diameter = 0.01 }') + joint("wall", "weld", "ground", "rod")
    A = math.pi * 0.01**2 / 4
    found, text = held("pulled", static + rod + force("rod.tip", [1, 0, 0], 1e4) + output("tip", "rod.tip", "displacement"))
    near(found["tip.x"], 1e4 * L / (E * A), 1e-3 * 1e4 * L / (E * A), "rod pulled along")
    expect("axial of 'rod' switched on" in text, f"nothing says that axial was counted in: {text}")

    # Two bars at 45 degrees, pinned: the apex sinks by F L / (2 E A sin^2).
    bar = '{ shape = "circle", diameter = 0.02 }'
    half = math.sqrt(0.5)
    truss = (
        static
        + beam("a", bar)
        + beam("b", bar)
        + joint("pa", "revolute", "ground", "a", f"rotation = [0, 0, {-math.pi / 4}]")
        + joint("pb", "revolute", "ground", "b", f"position = [{2 * half}, 0, 0]\nrotation = [0, 0, {-3 * math.pi / 4}]")
        + joint("apex", "revolute", "a.tip", "b.tip", f"rotation = [0, 0, {-math.pi / 2}]")
        + force("a.tip", [0, -1, 0], 2e4)
        + output("apex", "a.tip", "position")
    )
    found, _ = held("truss", truss)
    sinks = 2e4 * L / (2 * E * math.pi * 0.02**2 / 4 * 0.5)
    near(-half - found["apex.y"], sinks, 5e-3 * sinks, "truss of two bars")

    # A load beside the axis bends and twists: F L^3 / 3 E I + F L / k G A + F z^2 L / G J at the load.
    section = rectangle(0.02, 0.04)
    arm = '[[body]]\nname = "arm"\nkind = "rigid"\nmass = 0.05\ninertia = [1e-4, 1e-4, 1e-4]\nframes = { end = [0, 0, 0.15] }\n'
    offset = (
        static
        + beam("b", section)
        + arm
        + joint("wall", "weld", "ground", "b")
        + joint("w", "weld", "b.tip", "arm")
        + force("arm.end", [0, -1, 0], 20)
        + output("end", "arm.end", "position")
    )
    found, _ = held("offset", offset)
    J = 0.02**3 * 0.04 * 0.229  # Roark: 0.229 for sides as 2 to 1
    sag = 20 * (L**3 / (3 * E * 0.02 * 0.04**3 / 12) + L / (5 / 6 * G * 0.02 * 0.04) + 0.15**2 * L / (G * J))
    near(-found["end.y"], sag, 5e-3 * sag, "load beside the axis")

    # Consoles: shear is counted in where it is worth something, and named where the model cannot have it.
    for slender in [3, 5, 10, 15]:
        h = L / slender
        load = 1e6 / slender**3
        console = (
            static
            + beam("b", rectangle(h / 2, h))
            + joint("wall", "weld", "ground", "b")
            + force("b.tip", [0, -1, 0], load)
            + output("tip", "b.tip", "displacement")
        )
        found, _ = held(f"console_{slender}", console)
        sag = load * (L**3 / (3 * E * h / 2 * h**3 / 12) + L / (5 / 6 * G * h * h / 2))
        near(-found["tip.y"], sag, 4e-3 * sag, f"console, length / height {slender}")
        if slender != 5:
            continue
        for model in ['model = "modal"\nmodes = { bending_xy = [1, 2, 3] }', 'model = "lumped"']:
            other = console.replace("elements = 6", model)
            _, text = held("console_other", other, code=1)
            advice = re.search(r"shear of 'b' is left out, .*take (model = \S+).* (effects = \[.*?\])", text)
            expect(advice, f"no advice for shear with {model}: {text}")
            if advice:
                found, _ = held("console_advised", console.replace("elements = 6", f"{advice[1]}\n{advice[2]}"))
                near(-found["tip.y"], sag, 1e-2 * sag, f"advice for {model}")

    # Advice, followed literally, ends the warning; "auto" may stand in a list.
    _, text = held(
        "alone",
        static
        + rod.replace("elements = 6", 'elements = 6\neffects = ["bending_xy"]')
        + force("rod.tip", [1, 0, 0], 1e4)
        + output("tip", "rod.tip", "displacement"),
        code=1,
    )
    advice = re.search(r"axial of 'rod' is left out, .*: (effects = \[.*\])", text)
    expect(advice, f"no advice for axial: {text}")
    for words in [advice[1] if advice else "", 'effects = ["auto", "axial"]']:
        found, _ = held(
            "advised",
            static
            + rod.replace("elements = 6", "elements = 6\n" + words)
            + force("rod.tip", [1, 0, 0], 1e4)
            + output("tip", "rod.tip", "displacement"),
        )
        near(found["tip.x"], 1e4 * L / (E * A), 1e-3 * 1e4 * L / (E * A), words)

    # Close to its critical speed a shaft's deflection, and what shear adds to it, grow by 1 / |1 - r^2|: y = e r^2 / (1 - r^2) of a disc M
    # in the middle of a light shaft (17/35 of its mass count there), whose stiffness has shear, 48 EI / L^3 / (1 + 12 EI / (k G A L^2)).
    # Told without this growth shear was left out where it is worth 4 % (r = 0.95) and 9 % (0.98), and nothing was said.
    L, d, E, M, e = 1.6, 0.057, 7e10, 4.0, 2e-5
    EI, kGA = E * math.pi * d**4 / 64, 6 / 7 * E / 2 * math.pi * d**2 / 4
    k = 48 * EI / L**3 / (1 + 12 * EI / (kGA * L**2))
    swung = M + 17 / 35 * math.pi * d**2 / 4 * L
    for r in (0.95, 0.98, 1.05):
        w = r * math.sqrt(k / swung)
        scene = simulation(duration=1 / w, output_rate=20 * w, gravity=[0, 0, 0], start="static")
        for name in ("left", "right"):
            scene += body(name, "beam", length=L / 2, section={"shape": "circle", "diameter": d}, model="finite-element", elements=4)
            scene += f"material = {{ density = 1.0, youngs_modulus = {E!r}, poisson = 0 }}\n"
        scene += body("disc", "rigid", mass=M, inertia=[0.04, 0.02, 0.02], centre_of_mass=[0, e, 0])
        scene += body("hub", "rigid", mass=1.0, inertia=[0.02, 0.02, 0.02])
        scene += joint("bearing", "revolute", "ground", "hub", f'axis = [1, 0, 0]\nmotion = "{w!r}*t"')
        scene += joint("a", "constant-velocity", "hub", "left.root", "axis = [1, 0, 0]")
        scene += joint("b", "weld", "left.tip", "right.root") + joint("c", "weld", "left.tip", "disc")
        scene += joint("d", "point-on-line", "ground", "right.tip", "axis = [1, 0, 0]") + output("y", "disc", "position")
        run("simulate", written(folder, "shaft", scene), "-o", folder / "r.h5", "--csv", folder / "h.csv")
        y = M / swung * e * r**2 / (1 - r**2)
        near(history(folder / "h.csv")["y.y"][0], y, 1e-4 * abs(y), f"shaft at {r} of its critical speed")

    # So does a pressed column's, by 1 / (1 - P / Pcr); with shear (Engesser): Timoshenko, Gere, Theory of Elastic Stability, art. 2.17.
    L, d, E = 1.0, 0.03, 7e10
    EI, kGA = E * math.pi * d**4 / 64, 6 / 7 * E / 2 * math.pi * d**2 / 4
    P, Q = 0.97 * math.pi**2 * EI / 4 / L**2, 3e-5 * EI / L**2
    bent = math.sqrt(P / EI / (1 - P / kGA))
    y = Q / P * (math.tan(bent * L) / bent * kGA / (kGA - P) - L)
    column = f'{static}[[body]]\nname = "rod"\nkind = "beam"\nmodel = "finite-element"\nlength = {L}\n'
    column += f'section = {{ shape = "circle", diameter = {d} }}\nmaterial = {{ density = 1.0, youngs_modulus = {E}, poisson = 0 }}\n'
    column += joint("wall", "weld", "ground", "rod.root") + force("rod.tip", [-1, 0, 0], P) + force("rod.tip", [0, 1, 0], Q)
    column = column.replace('start = "static"', 'start = "static"\ngravity = [0, 0, 0]') + output("tip", "rod.tip", "displacement")
    run("simulate", written(folder, "column", column), "-o", folder / "r.h5", "--csv", folder / "h.csv")
    near(history(folder / "h.csv")["tip.y"][0], y, 1e-2 * y, "column at 0.97 of its buckling load")

    # Words.
    done = run("check", written(folder, "word", pendulum.replace('boundary = "clamped-free"', 'without = ["stifening"]')), code=2)
    expect("stiffening" in done.stderr and "word.toml:" in done.stderr, f"misspelt effect: {done.stderr}")
    done = run("check", written(folder, "both", pendulum.replace('boundary = "clamped-free"', 'without = ["stiffening"]')), code=2)
    expect("'effects' lists" in done.stderr, f"on and off: {done.stderr}")

    # What is off costs nothing: left out of "auto" by hand against a scene that never had it. Valgrind cannot run a program with
    # sanitizers in it, whose instructions are not those of the scene either.
    valgrind = shutil.which("valgrind")
    expect(valgrind, "valgrind is missing (tests/packages.txt)")
    if b"__asan_init" in pathlib.Path(flexframe).read_bytes():
        print("built with sanitizers: instructions are not counted")
    elif valgrind:
        short = automatic.replace("duration = 1.2", "duration = 0.05").replace("tolerance = 1e-7", "tolerance = 1e-4")
        never = short.replace('effects = "auto"', 'effects = ["bending_xy"]')
        left_out = short.replace('effects = "auto"', 'effects = "auto"\nwithout = ["stiffening"]')
        a = instructions(written(folder, "never", never), folder)
        b = instructions(written(folder, "left_out", left_out), folder)
        print(f"instructions without stiffening: {a} never there, {b} left out, {abs(b / a - 1):.2%} apart")
        expect(abs(b / a - 1) < 0.01, f"an effect that is off costs {b / a - 1:.2%}")
finish()
