"""Modes of mechanisms as films and over a parameter, frequency response, spectra: against closed formulas and numpy."""
import csv
import json
import math
import pathlib
import re

import numpy as np
from program import expect, finish, near, run, temporary_folder
from scene_text import body, force, ground, joint, output, rigid, section, simulation

STEEL = dict(material=dict(density=7850, youngs_modulus=2.1e11))
OSCILLATORS = (
    simulation(4, output_rate=256)
    + section("parameters", m=2, k=800)
    + rigid("a", mass="m")
    + rigid("b", mass="m")
    + joint("ja", "prismatic", "ground", "a", axis=[1, 0, 0], spring=dict(stiffness="k", damping=4))
    + joint("jb", "prismatic", "a", "b", axis=[1, 0, 0], spring=dict(stiffness="k", damping=4))
    + force("force", "a", name="push", direction=[1, 0, 0], value="FORCE")
)


OUTPUTS = (
    output("a", "a", "position")
    + output("b", "b", "velocity")
    + output("c", "b", "acceleration")
    + output("d", "jb", "value")
    + output("e", "system", "energy")
)


def rows(path):
    with open(path, newline="") as file:
        table = list(csv.reader(file))
    return {name: [float(row[i]) for row in table[1:]] for i, name in enumerate(table[0]) if i == 0 or not table[1][i].isalpha()}


def solve(w):
    """The two masses under a unit force on the first: (K + i w D - w^2 M) x = F, by hand."""
    m, s = 2, 800 + 4j * w
    a, b, d = 2 * s - m * w * w, -s, s - m * w * w
    det = a * d - b * b
    return d / det, -b / det


def response(folder):
    scene = folder / "two.toml"
    scene.write_text(OSCILLATORS.replace("FORCE", "0") + OUTPUTS)
    done = run("response", scene, "--force", "push", "--from", 0.5, "--to", 20, "--points", 60, "-o", folder / "r.csv")
    expect("left out" in done.stdout and "e" in done.stdout, done.stdout)
    table = rows(folder / "r.csv")
    for i in range(0, len(table["frequency"]), 5):
        w = 2 * math.pi * table["frequency"][i]
        first, second = solve(w)
        for column, wanted in (("a.x", first), ("b.x", 1j * w * second), ("c.x", -w * w * second), ("d", second - first)):
            near(table[column][i], abs(wanted), 1e-6 * abs(wanted), f"{column} at {w:.3g} rad/s")
            phase = math.degrees(math.atan2(wanted.imag, wanted.real))
            near(math.remainder(table[f"{column}:phase"][i] - phase, 360), 0, 1e-3, f"phase of {column}")
    expect("<svg" in (folder / "r.svg").read_text(), "the diagram is no SVG")
    words = ("--from", 0.5, "--to", 20, "--points", 60, "-o", folder / "r.csv", "--json")
    told = json.loads(run("response", scene, "--force", "push", *words).stdout)
    for one in told["outputs"]:
        values = table[one["column"]]
        expect(one["largest"] == max(values) == values[table["frequency"].index(one["frequency"])], f"{one} told as a peak")
    expect(told["left_out"] and told["csv"] == str(folder / "r.csv"), f"response as JSON: {told}")
    expect(told["warnings"] == [], f"warnings of damped oscillators: {told}")
    bare = re.sub(r"damping *= *[0-9.]+", "damping = 0", scene.read_text())
    (folder / "bare.toml").write_text(bare)
    told = json.loads(run("response", folder / "bare.toml", "--force", "push", *words).stdout)
    expect(any("without damping: the response there has no limit" in one for one in told["warnings"]), f"undamped: {told['warnings']}")
    message = run("response", scene, "--force", "pus", code=2).stderr
    expect("two.toml" in message and "did you mean 'push'" in message, message)
    # Nothing gives the size of drag or contact: it cannot be a unit.
    scene.write_text(scene.read_text() + '[[force]]\nname = "air"\nkind = "drag"\non = "a"\nlinear = 0.5\n')
    message = run("response", scene, "--force", "air", code=2).stderr
    expect("'air' is no force, torque or distributed force with a name" in message, message)


def controlled(folder):
    """A controller's states are part of the response: a PID on the first mass, and a filter in its place; and of the modes."""
    scene = folder / "controlled.toml"
    head = OSCILLATORS.replace("FORCE", "0") + output("a", "a", "position") + output("x", "ja", "value") + output("v", "ja", "rate")
    head += '[[force]]\nkind = "force"\non = "a"\ndirection = [1, 0, 0]\nvalue = "c"\n[[block]]\nname = "c"\ninput = "-x"\n'
    pid = 'kind = "pid"\nrate = "-v"\nproportional = 300\nintegral = 2000\nderivative = 5\n'
    lead = 'kind = "transfer-function"\nnumerator = [10, 300]\ndenominator = [0.02, 1]\n'
    for kind, law in ((pid, lambda s: 300 + 2000 / s + 5 * s), (lead, lambda s: (10 * s + 300) / (0.02 * s + 1))):
        scene.write_text(head + kind)
        run("response", scene, "--force", "push", "--from", 0.5, "--to", 20, "--points", 30, "-o", folder / "c.csv")
        table = rows(folder / "c.csv")
        for i, frequency in enumerate(table["frequency"]):
            w = 2 * math.pi * frequency
            s = 800 + 4j * w
            first = (s - 2 * w * w) / ((2 * s - 2 * w * w + law(1j * w)) * (s - 2 * w * w) - s * s)
            near(table["a.x"][i], abs(first), 1e-6 * abs(first), f"with a controller, {w:.3g} rad/s")
        # Every pole makes the determinant zero; there is one more than without the controller.
        modes = json.loads(run("check", scene, "--json").stdout)["modes"]
        for mode in modes:
            p = complex(mode["real"], mode["imaginary"])
            s = 800 + 4 * p
            terms = [(2 * s + 2 * p * p + law(p)) * (s + 2 * p * p), -s * s]
            expect(abs(sum(terms)) < 1e-6 * sum(map(abs, terms)), f"{p} is no pole with a controller: {terms}")
        count = sum(1 if mode["imaginary"] == 0 else 2 for mode in modes)
        expect(count == 5, f"{count} poles with a controller")
    scene.write_text(head + pid + "sample = 0.01\n")
    expect("outputs of sampled blocks" in run("check", scene).stdout, "check does not say that sampled blocks are held")
    expect("'c'" in run("response", scene, "--force", "push", code=2).stderr, "a sampled block has a frequency response")
    # Damping is that beside the state, whatever the law of the rate: of quadratic drag none at rest, of a tanh its slope.
    for law, damping in (
        ('kind = "drag"\non = "a"\nquadratic = 50', 0.0),
        ('kind = "force"\non = "a"\ndirection = [1, 0, 0]\nvalue = "-0.4*tanh(v/0.01)"', 40.0),
    ):
        alone = OSCILLATORS.replace("FORCE", "0").replace('parent = "a"', 'parent = "ground"')
        scene.write_text(alone + output("v", "ja", "rate") + f"[[force]]\n{law}\n")
        found = [m["damping"] for m in json.loads(run("check", scene, "--json").stdout)["modes"]]
        near(max(found), (4 + damping) / (2 * math.sqrt(800 * 2)), 1e-6, f"damping of {law}")


def beam(folder):
    """A cantilever driven at its tip: static compliance L^3 / (3 E I), the peak at its first frequency."""
    scene = folder / "beam.toml"
    scene.write_text(
        simulation(1, gravity=[0, -9.81, 0], start="static")
        + body(
            "rod",
            "beam",
            length=1,
            section=dict(shape="rectangle", width=0.04, height=0.01),
            material=dict(density=7850, youngs_modulus=210e9),
            damping=dict(ratio=0.02),
        )
        + joint("wall", "weld", "ground", "rod")
        + force("force", "rod.tip", name="shaker", direction=[0, 1, 0], value=0)
        + output("tip", "rod.tip", "displacement")
    )
    run("response", scene, "--force", "shaker", "--from", 0.01, "--to", 60, "--points", 200, "-o", folder / "b.csv")
    table = rows(folder / "b.csv")
    inertia, m = 0.04 * 0.01**3 / 12, 7850 * 0.0004
    near(table["tip.y"][0], 1 / (3 * 210e9 * inertia), 1e-3 / (3 * 210e9 * inertia), "static compliance")
    f1 = 1.8751041**2 / (2 * math.pi) * math.sqrt(210e9 * inertia / m)
    i = max(range(len(table["frequency"])), key=lambda k: table["tip.y"][k])
    near(table["frequency"][i], f1, 0.01 * f1, "first resonance")
    # One mode: 4 / (m L w^2 2 zeta), as the tip of the first form is 2.
    height = 4 / (m * (2 * math.pi * f1) ** 2 * 0.04)
    near(table["tip.y"][i], height, 0.03 * height, "its height")


def readings(folder):
    """Forces that follow rates by any law; outputs with a corner at the start; friction; axial forces that are left out."""

    def told(name, text, *words):
        (folder / f"{name}.toml").write_text(text)
        out = json.loads(run("response", folder / f"{name}.toml", "--force", "push", "--json", "-o", folder / f"{name}.csv", *words).stdout)
        return out, rows(folder / f"{name}.csv")

    mass = simulation(1) + rigid("a", mass=2) + force("force", "a", name="push", direction=[1, 0, 0], value=0)
    spring = joint("j", "prismatic", "ground", "a", axis=[1, 0, 0], spring=dict(stiffness=800))
    brake = force("force", "a", name="brake", direction=[1, 0, 0], value="-0.4*tanh(v/0.01)")
    seen = output("v", "j", "rate") + output("f", "brake", "force") + output("p", "push", "force")
    _, table = told("brake", mass + spring + brake + seen)
    for f, v, brakes, own in zip(table["frequency"], table["v"], table["f"], table["p"]):
        w = 2 * math.pi * f
        near(v, abs(1j * w / (800 - 2 * w * w + 40j * w)), 1e-6 * v, f"rate at {f} Hz")
        near(brakes, 40 * v, 1e-5 * brakes, f"a brake that follows the rate by tanh, at {f} Hz")
        near(own, 1, 1e-9, "the force itself")
    arm = rigid("a", mass=2, inertia=[0.1, 0.1, 0.1], frames=dict(end=[0.5, 0, 0])) + "[ground]\nframes = { x = [0.5, 0, 0] }\n"
    arm = simulation(1) + arm + joint("j", "revolute", "ground", "a", spring=dict(stiffness=80, damping=1))
    arm += force("force", "a.end", name="push", direction=[0, 1, 0], value=0) + output("turn", "a", "rotation")
    arm += output("angle", "a", "angle", relative_to="ground") + output("way", "a.end", "distance", relative_to="ground.x")
    out, table = told("corner", arm + output("far", "a.end", "distance", relative_to="ground"))
    expect(sorted(out["left_out"]) == ["angle", "way"] and "far" in table, f"angle and distance that start at zero: {out['left_out']}")
    rubs = spring.replace("spring =", "friction = { coefficient = 0.3, normal_force = 10 }\nspring =")
    out, _ = told("rubs", mass + rubs + output("x", "j", "value"))
    expect(any("friction of joint 'j'" in one for one in out["warnings"]), f"dry friction: {out['warnings']}")
    # Half its critical load on a column; without stiffening the load follows bending in part only.
    steel, bar = dict(density=7850, youngs_modulus=2.1e11), dict(shape="rectangle", width=0.02, height=0.01)
    load = 0.5 * math.pi**2 / 4 * 2.1e11 * 0.02 * 0.01**3 / 12
    column = simulation(1, start="static") + body("b", "beam", 'effects = ["bending_xy"]', length=1, section=bar, material=steel)
    column += joint("w", "weld", "ground", "b", rotation=[0, 0, math.pi / 2]) + force("force", "b.tip", direction=[0, -1, 0], value=load)
    column += force("force", "b.tip", name="push", direction=[1, 0, 0], value=0) + output("tip", "b.tip", "position")
    out, _ = told("column", column.replace('["bending_xy"]', '["bending_xy", "stiffening"]'), "--from", 1, "--to", 15)
    expect(not any("axial forces" in one for one in out["warnings"]), f"a pressed column with stiffening: {out['warnings']}")
    stiff, _ = told("column", column, "--from", 1, "--to", 15)
    expect(any('add "stiffening"' in one for one in stiff["warnings"]), f"a pressed column without stiffening: {stiff['warnings']}")
    expect(out["modes"][0] < 0.95 * stiff["modes"][0], f"what pressing does to a column: {out['modes'][0]}, {stiff['modes'][0]}")


def modes(folder):
    scene = folder / "two.toml"
    scene.write_text(OSCILLATORS.replace("FORCE", "0") + OUTPUTS)
    done = run("modes", scene, "-o", folder / "films", "--pictures", 4, "--size", "160x120", "--no-video", "--mode", "2")
    for ratio in (0.5 * (3 - math.sqrt(5)), 0.5 * (3 + math.sqrt(5))):
        omega = math.sqrt(400 * ratio)
        f = omega * math.sqrt(1 - (0.5 * 4 / 800 * omega) ** 2) / (2 * math.pi)
        expect(f"{f:.4f}"[:5] in done.stdout, f"{f} Hz is not among: {done.stdout}")
    expect(len(list((folder / "films").rglob("*.png"))) == 4, "four pictures of mode 2")
    run("modes", scene, "--over", "k=200:800:4", "-o", folder / "sweep")
    with open(folder / "sweep" / "two.csv", newline="") as file:
        table = list(csv.DictReader(file))
    expect(len(table) == 8, f"{len(table)} rows")
    for row in table:
        k = float(row["k"])
        ratio = 0.5 * (3 - math.sqrt(5)) if row["mode"] == "1" else 0.5 * (3 + math.sqrt(5))
        omega = math.sqrt(k / 2 * ratio)
        # Damping in proportion to stiffness: 4/k of it.
        near(float(row["damping"]), 0.5 * 4 / k * omega, 1e-6, f"damping at k = {k}")
        near(float(row["frequency"]), omega * math.sqrt(1 - (0.5 * 4 / k * omega) ** 2) / (2 * math.pi), 1e-6, f"frequency at k = {k}")
    expect("<svg" in (folder / "sweep" / "two.svg").read_text(), "no Campbell diagram")
    message = run("modes", scene, "--over", "k=200", code=2).stderr
    expect("NAME=FROM:TO:COUNT" in message, message)
    message = run("modes", scene, "--mode", "7", code=2).stderr
    expect("there are 1 to 2" in message, message)


def at_times(folder):
    """A load on a hoist: theta'' + 2 L'/L theta' + g/L theta = 0, the length as it is at that time."""
    scene = folder / "hoist.toml"
    body = '[[body]]\nname = "%s"\nkind = "rigid"\nmass = %s\ninertia = [1e-9, 1e-9, 1e-9]\n'
    joint = '[[joint]]\nname = "%s"\nkind = "%s"\nparent = "%s"\nchild = "%s"\n%s\n'
    scene.write_text(
        "[simulation]\nduration = 2\ngravity = [0, -9.81, 0]\n"
        + body % ("arm", "1e-9")
        + body % ("load", "1")
        + joint % ("pin", "revolute", "ground", "arm", "")
        + joint % ("winch", "prismatic", "arm", "load", 'axis = [0, -1, 0]\nmotion = "1 + 0.5*t"')
    )
    run("modes", scene, "--at", "0,0.5,2", "-o", folder / "times")
    with open(folder / "times" / "hoist.csv", newline="") as file:
        table = list(csv.DictReader(file))
    expect([float(row["t"]) for row in table] == [0, 0.5, 2], f"times of {table}")
    for row in table:
        length = 1 + 0.5 * float(row["t"])
        near(float(row["frequency"]), math.sqrt(9.81 / length - (0.5 / length) ** 2) / (2 * math.pi), 1e-6, "hoist, frequency")
        near(float(row["damping"]), 0.5 / length / math.sqrt(9.81 / length), 1e-6, "hoist, damping")
    message = run("modes", scene, "--at", "3", code=2).stderr
    expect("times from 0 to the scene's duration" in message, message)
    message = run("modes", scene, "--at", "1", "--over", "a=1:2:3", code=2).stderr
    expect("exclude each other" in message, message)


def loop(folder):
    """A linkage swings about its static equilibrium with its loop closed: the film's samples hold the rod's length."""
    scene = folder / "loop.toml"
    scene.write_text(
        simulation(1, gravity=[0, -9.81, 0])
        + "".join(
            f'[[body]]\nname = "{n}"\nkind = "rigid"\nmass = 1\ninertia = [0.01, 0.01, 0.01]\n'
            f"centre_of_mass = [{l / 2}, 0, 0]\nframes = {{ end = [{l}, 0, 0] }}\n"
            for n, l in (("p", 0.3), ("c", 0.4), ("r", 0.3))
        )
        + joint("1", "revolute", "ground", "p", initial=dict(guess=-1.4), spring=dict(stiffness=20))
        + joint("2", "revolute", "p.end", "c", initial=dict(guess=1.4))
        + joint("3", "revolute", "c.end", "r.end")
        + joint("4", "revolute", "ground", "r", position=[0.4, 0, 0], initial=dict(guess=-1.4))
    )
    run("modes", scene, "-o", folder / "loop", "--pictures", 3, "--size", "160x120", "--no-video", "--amplitude", 0.05)
    expect(len(list((folder / "loop").rglob("*.png"))) == 3, "three pictures of the one mode")


def spectra(folder):
    scene = folder / "driven.toml"
    # Free of the springs: a mass on a rail that is moved by a sum of sines has them exactly.
    scene.write_text(
        simulation(4, output_rate=256)
        + rigid("m", mass=1)
        + joint("j", "prismatic", "ground", "m", axis=[1, 0, 0], motion="0.3 + 0.02*sin(2*pi*8*t) + 0.005*sin(2*pi*20*t + 1)")
        + rigid("w", mass=1, inertia=[1, 1, 1])
        + joint("shaft", "revolute", "ground", "w", motion="2*pi*(2*t + 0.5*t*t)")
        + joint("cam", "prismatic", "ground", "v", axis=[0, 1, 0], motion="0.01*sin(3*2*pi*(2*t + 0.5*t*t))")
        + rigid("v", mass=1)
        + output("x", "j", "value")
        + output("angle", "shaft", "value")
        + output("y", "cam", "value")
    )
    run("simulate", scene, "-o", folder / "d.h5")
    run("spectrum", folder / "d.h5", "--column", "x", "-o", folder / "s.csv")
    table = rows(folder / "s.csv")

    def peak(low, high, column, axis):
        return max((table[column][i], f) for i, f in enumerate(table[axis]) if low < f < high)

    size, where = peak(6, 10, "x", "frequency")
    near(size, 0.02, 2e-4, "amplitude at 8 Hz")
    near(where, 8, 0.05, "its frequency")
    near(peak(18, 22, "x", "frequency")[0], 0.005, 1e-4, "amplitude at 20 Hz")
    near(table["x"][0], 0.3, 1e-3, "mean")
    told = json.loads(run("spectrum", folder / "d.h5", "--column", "x", "-o", folder / "s.csv", "--json").stdout)["outputs"]
    # The report tells the sine itself.
    expect([one["column"] for one in told] == ["x"], f"spectrum as JSON: {told}")
    near(told[0]["largest"], 0.02, 2e-5, "amplitude of the sine")
    near(told[0]["frequency"], 8, 1e-3, "frequency of the sine")
    run("simulate", scene, "--set", "joint.j.motion=0.3 + 0.02*sin(2*pi*7.37*t)", "-o", folder / "b.h5")
    told = json.loads(run("spectrum", folder / "b.h5", "--column", "x", "-o", folder / "b.csv", "--json").stdout)["outputs"]
    near(told[0]["largest"], 0.02, 2e-5, "amplitude between two lines")
    near(told[0]["frequency"], 7.37, 1e-3, "frequency between two lines")
    # The speed rises all the time: a line over the order, none over the frequency.
    run("spectrum", folder / "d.h5", "--column", "y", "--order", "angle", "-o", folder / "o.csv", "--highest", 10)
    table = rows(folder / "o.csv")
    size, where = max(zip(table["y"][1:], table["order"][1:]))
    near(where, 3, 0.07, "order of the cam")
    near(size, 0.01, 0.0015, "its amplitude")
    # The ramp of an angle is no sine; what a cam does 40 times a turn has fewer and fewer samples as the shaft runs up.
    text = scene.read_text()
    told = json.loads(run("spectrum", folder / "d.h5", "--column", "angle", "-o", folder / "s.csv", "--json").stdout)["warnings"]
    expect(any(one.startswith("angle:") and "drift" in one for one in told), f"a shaft's angle as a sine: {told}")
    scene.write_text(text.replace("sin(3*2*pi", "sin(20*2*pi"))
    run("simulate", scene, "-o", folder / "c.h5")
    told = json.loads(run("spectrum", folder / "c.h5", "--column", "y", "--order", "angle", "-o", folder / "o.csv", "--json").stdout)
    expect(any("samples a period" in one for one in told["warnings"]), f"few samples where the shaft is fast: {told}")
    # A shaft that turns 200 times a second, seen 256 times.
    scene.write_text(text.replace('2*pi*(2*t + 0.5*t*t)"', '2*pi*200*t"') + output("tip", "w.p", "position"))
    scene.write_text(scene.read_text().replace("inertia = [1, 1, 1]", "inertia = [1, 1, 1]\nframes = { p = [1, 0, 0] }"))
    run("simulate", scene, "-o", folder / "t.h5")
    told = json.loads(run("spectrum", folder / "t.h5", "--column", "tip.x", "-o", folder / "s.csv", "--json").stdout)["warnings"]
    expect(any("turns 200 times a second" in one for one in told), f"a fast shaft: {told}")
    run("simulate", scene, "--set", "joint.j.motion=0.3 + 0.02*sin(2*pi*900*t)", "--set", "joint.shaft.motion=0", "-o", folder / "f.h5")
    told = json.loads(run("spectrum", folder / "f.h5", "--column", "x", "-o", folder / "s.csv", "--json").stdout)["warnings"]
    expect(any("joint 'j'" in one and "lower frequency" in one for one in told), f"a drive faster than its samples: {told}")
    # Too little to be seen in the way, and more than half of the acceleration: 900 Hz stand at 124.
    scene.write_text(
        simulation(4, output_rate=256)
        + rigid("m", mass=1)
        + joint("j", "prismatic", "ground", "m", axis=[1, 0, 0], motion="0.02*sin(2*pi*8*t) + 1e-6*sin(2*pi*900*t)")
        + output("x", "m", "position")
        + output("a", "m", "acceleration")
    )
    run("simulate", scene, "-o", folder / "a.h5")
    for column, expected in (("x.x", 0), ("a.x", 1)):
        told = json.loads(run("spectrum", folder / "a.h5", "--column", column, "-o", folder / "s.csv", "--json").stdout)["warnings"]
        fast = [one for one in told if "joint 'j' also vibrates at about 900 Hz" in one]
        expect(len(fast) == expected and len(told) == expected, f"a fast acceleration, {column}: {told}")
    # Of a product the sum of two frequencies: 180 Hz of 256 samples a second stand at 76. A sum of the same outputs has nothing so fast.
    scene.write_text(
        simulation(4, output_rate=256)
        + rigid("m", mass=1)
        + joint("j", "prismatic", "ground", "m", axis=[1, 0, 0], motion="0.02*sin(2*pi*90*t)")
        + output("x", "j", "value")
        + section("[output]", name="square", expression="x^2")
        + section("[output]", name="twice", expression="2*x + 0.01")
        + section("[output]", name="time", expression="x + 0.004*sin(2*pi*512*t)")
    )
    run("simulate", scene, "-o", folder / "p.h5")
    for column, expected, place in (("square", 1, 76), ("twice", 0, 90), ("time", 1, 90)):
        told = json.loads(run("spectrum", folder / "p.h5", "--column", column, "-o", folder / "s.csv", "--json").stdout)
        expect(abs(told["outputs"][0]["frequency"] - place) < 0.1, f"largest of {column}: {told}")
        fast = [one for one in told["warnings"] if one.startswith(f"{column}: ") and "its expression is faster" in one]
        expect(len(fast) == expected and len(told["warnings"]) == expected, f"samples of {column}: {told}")
    message = run("spectrum", folder / "d.h5", "--column", "z", code=2).stderr
    expect("no column" in message and "angle" in message, message)


def mass_damping(folder):
    """Rayleigh's mass a: every mode of the mounted beam decays by a / 2, in whatever frame its deformations are given. A hinged beam in its
    clamped frame decayed eleven times as fast, a welded one in a free frame a hundredth."""
    scene, a = folder / "mass.toml", 2.0
    mountings = {"hinge": "revolute", "free": "planar", "weld": "weld"}
    for boundary in ("clamped-free", "free-free", "supported-free", "supported-supported"):
        for mounting, kind in mountings.items():
            for more in ({}, dict(keep_modes=5)):
                beam = body(
                    "b",
                    kind="beam",
                    length=1.0,
                    section=dict(shape="rectangle", width=0.02, height=0.01),
                    material=dict(density=7800, youngs_modulus=2e11),
                    boundary=boundary,
                    damping=dict(mass=a),
                    **more,
                )
                scene.write_text(simulation(0.1) + beam + joint("j", kind, "ground", "b.root"))
                found = [m for m in json.loads(run("check", scene, "--json").stdout)["modes"] if m["kind"] == "vibration"]
                for mode in found[:3]:
                    near(-mode["real"], a / 2, 1e-6 * a, f"decay of {mode['frequency']:.1f} Hz, {mounting}, {boundary}, {more}")
                expect(len(found) >= 3, f"{mounting}, {boundary}: {len(found)} modes")


def preloaded_cables(folder):
    """A body between four cables of 1 m that are stretched by a share e of it: (2 k + 2 k e) / m, however little it takes to slacken them;
    a cable that is just as long as its rest is told."""
    k, m, damping = 1e6, 2.0, 30.0
    for share in (1e-1, 1e-3, 1e-4, 1e-6, 1e-7, 0.0):
        for damped in (False, True):
            text = simulation(1, start="static") + rigid("block", mass=m, inertia=[0.1] * 3)
            text += joint("plane", "planar", "ground", "block") + ground(l=[-1, 0, 0], r=[1, 0, 0], u=[0, 1, 0], d=[0, -1, 0])
            more = {"damping": damping} if damped else {}
            for side in "lrud":
                text += force("cable", "block", from_=f"ground.{side}", name=side, stiffness=k, rest=1 - share, **more)
            (folder / "cables.toml").write_text(text)
            found = json.loads(run("check", folder / "cables.toml", "--json").stdout)
            told = any("just as long as its rest" in warning for warning in found.get("warnings", []))
            expect(told == (share == 0.0), f"cables stretched by {share}: told {told}")
            if share == 0.0:
                continue
            vibrations = [mode for mode in found["modes"] if mode["kind"] == "vibration"]
            expect(len(vibrations) == 2, f"cables stretched by {share}: {len(vibrations)} vibrations")
            for mode in vibrations:
                size = math.sqrt(2 * k * (1 + share) / m)
                near(
                    math.hypot(mode["real"], mode["imaginary"]),
                    size,
                    1e-6 * size,
                    f"cables stretched by {share}, damped {damped}: pole, 1/s",
                )
                near(mode["real"], -damping / m if damped else 0.0, 1e-6 * size, f"cables stretched by {share}: decay, 1/s")


def told_over(folder):
    """What does not hold is told by `modes`, and by its table over a parameter with the value: about places that are left, equations that
    change, too few elements. A value without an equilibrium leaves the others in the table."""
    arm = simulation(1, gravity=[0, -9.81, 0]) + section("parameters", lean=0.2, k=50)
    arm += rigid("arm", mass=1, inertia=[0.01] * 3, centre_of_mass=[0.5, 0, 0])
    (folder / "arm.toml").write_text(
        arm + joint("pin", "revolute", "ground", "arm", spring=dict(stiffness="k"), initial=dict(value="lean"))
    )
    for words in ((), ("--over", "lean=0:0.4:3", "-o", folder / "arm")):
        told = run("modes", folder / "arm.toml", "--no-pictures", *words).stdout
        expect("no equilibrium" in told and "WARNING" in told, f"an arm that falls: {told}")
    shaft = simulation(1) + section("parameters", w=100) + rigid("house", mass=1, inertia=[0.1] * 3) + ground(far=[1, 0, 0])
    shaft += body("shaft", "beam", length=1, section=dict(shape="circle", diameter=0.02), elements=2, **STEEL)
    shaft += joint("seat", "prismatic", "ground", "house", axis=[0, 1, 0], spring=dict(stiffness=1e5))
    shaft += joint("spin", "revolute", "house", "shaft", axis=[1, 0, 0], motion="w*t")
    (folder / "shaft.toml").write_text(shaft + output("tip", "shaft.tip", "position"))
    told = run("modes", folder / "shaft.toml", "--over", "w=0:100:3", "-o", folder / "shaft").stdout
    expect(re.search("WARNING +at w = 50 and at 1 more: the linearised equations change", told), f"a shaft on a soft bearing: {told}")
    expect("finer elements" in told, f"two elements: {told}")
    rests = simulation(1, start="static") + section("parameters", k=1) + rigid("mass", mass=1, inertia=[1] * 3)
    rests += joint("rail", "prismatic", "ground", "mass", axis=[1, 0, 0], spring=dict(stiffness="k"))
    (folder / "rests.toml").write_text(rests + force("force", "mass", direction=[1, 0, 0], value=1))
    told = run("modes", folder / "rests.toml", "--over", "k=0:40:3", "-o", folder / "rests").stdout
    expect("at k = 0: no modes" in told, f"a mass without a spring: {told}")
    with open(folder / "rests" / "rests.csv", newline="") as file:
        table = list(csv.DictReader(file))
    expect([float(row["k"]) for row in table] == [20, 40], f"values of {table}")
    for row in table:
        near(float(row["imaginary"]), math.sqrt(float(row["k"])), 1e-6, "mass on a spring")


def turning_on_springs(folder):
    """A shaft in volumes turns between springs without a load: seen from it the vibrations w of the shaft at rest are w + W and w - W."""
    L, d, W, springs, n = 0.4822731325604218, 0.0124, 558.0, (101815.0, 88069.0), 40
    text = simulation(1) + ground(far=[L, 0, 0])
    text += body("shaft", "beam", length=L, section=dict(shape="circle", diameter=d), model="mixed", volumes=6, **STEEL)
    text += joint("fly", "free", "ground", "shaft", initial=dict(rate=[W, 0, 0]))
    for at, seat, k in zip(("root", "tip"), ("ground", "ground.far"), springs):
        text += force("bushing", f"shaft.{at}", from_=seat, stiffness=[k, k, k, 0, 0, 0], damping=[0] * 6)
    (folder / "turning.toml").write_text(text + output("tip", "shaft.tip", "position"))
    found = json.loads(run("check", folder / "turning.toml", "--json").stdout)
    expect("steady motion" in found["linearised"] and not found.get("warnings"), f"{found['linearised']}, {found.get('warnings')}")
    h, EI, mass = L / n, 2.1e11 * math.pi * d**4 / 64, 7850 * math.pi * d**2 / 4
    M, K = np.zeros((2 * n + 2, 2 * n + 2)), np.zeros((2 * n + 2, 2 * n + 2))
    m = [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h], [54, 13 * h, 156, -22 * h]]
    m.append([-13 * h, -3 * h * h, -22 * h, 4 * h * h])
    k = [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h], [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]
    for e in range(n):
        at = slice(2 * e, 2 * e + 4)
        M[at, at] += mass * h / 420 * np.array(m)
        K[at, at] += EI / h**3 * np.array(k)
    K[0, 0] += springs[0]
    K[2 * n, 2 * n] += springs[1]
    there = [abs(mode["imaginary"]) for mode in found["modes"]]
    for w in np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)[:3]):
        for seen in (w + W, abs(w - W)):
            near(min(there, key=lambda one: abs(one - seen)), seen, 3e-3 * w, f"a turning shaft, {w:.5g} rad/s from outside")


with temporary_folder() as name:
    here = pathlib.Path(name)
    for test in (
        response,
        controlled,
        beam,
        readings,
        modes,
        at_times,
        loop,
        spectra,
        mass_damping,
        preloaded_cables,
        told_over,
        turning_on_springs,
    ):
        print(f"-- {test.__name__}", flush=True)
        test(here)
finish()
