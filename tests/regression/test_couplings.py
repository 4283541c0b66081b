"""Gears, racks, screws, differentials and linear couplings of joints through the real program, against closed formulas."""
import math

import numpy as np
from arrays import off, refused, simulate
from program import run_parts

simulation = "[simulation]\nduration = %g\noutput_rate = 50\ngravity = %s\ntolerance = 1e-9\n"


def wheel(name, inertia, mass=1.0, more=""):
    return f'[[body]]\nname = "{name}"\nkind = "rigid"\nmass = {mass}\ninertia = [{inertia}, {inertia}, {inertia}]\n{more}'


def joint(name, kind, parent, child, more="axis = [0, 0, 1]"):
    return f'[[joint]]\nname = "{name}"\nkind = "{kind}"\nparent = "{parent}"\nchild = "{child}"\n{more}\n'


def value(name, of=None, quantity="value"):
    return f'[[output]]\nname = "{name}"\nof = "{of or name}"\nquantity = "{quantity}"\n'


def torque(on, size, direction="[0, 0, 1]"):
    return f'[[force]]\nkind = "torque"\non = "{on}"\ndirection = {direction}\nvalue = "{size}"\n'


energy = value("E", "system", "energy")


def gears(folder):
    pair = '[[coupling]]\nname = "pair"\nkind = "gear"\njoints = ["one", "two"]\n%s\n'
    bodies = wheel("a", 0.02) + wheel("b", 0.3)
    plain = (
        bodies + joint("one", "revolute", "ground", "a") + joint("two", "revolute", "ground", "b", "axis = [0, 0, 1]\nposition = [1, 0, 0]")
    )
    turned = bodies + "".join(
        joint(n, "revolute", "ground", b, f"axis = [0.6, 0, 0.8]\nposition = [{x}, 0.3, 0]\nrotation = [0.2, -0.4, 0.7]")
        for n, b, x in (("one", "a", 0), ("two", "b", 1))
    )
    start = simulation % (2, "[0, 0, 0]")
    outs = value("one") + value("two") + energy
    for what, scene, push in (
        ("a gear pair", plain, torque("a", 0.1)),
        ("a gear pair about turned axes", turned, torque("a", 0.1, "[0.6, 0, 0.8]").replace("kind", 'frame = "body"\nkind')),
    ):
        # Turned joints: the torque follows the body, whose axes the joint's rotation does not turn; its frame is the joint's.
        for teeth, r in (("teeth = [20, 50]", -0.4), ("teeth = [20, 50]\ninternal = true", 0.4), ("ratio = -3", -3.0)):
            h = simulate(folder, start + scene + pair % teeth + push + outs)
            angle = 0.5 * 0.1 / (0.02 + 0.3 * r * r) * h["t"] ** 2
            off(h["one"], angle, 1e-7, f"{what} ({teeth}), driving wheel")
            off(h["two"], r * angle, 1e-7, f"{what} ({teeth}), driven wheel")
            off(h["E"], 0.1 * angle, 1e-7, f"{what} ({teeth}), energy")
    # The wheels' joints the other way round: their angles and so the ratio's sense stay those of the joints.
    base = wheel("base", 1) + joint("hold", "weld", "ground", "base")
    back = base + bodies + joint("one", "revolute", "a", "base") + joint("two", "revolute", "ground", "b", "position = [1, 0, 0]")
    h = simulate(folder, start + back + pair % "ratio = 0.4" + torque("a", 0.1) + outs)
    off(-h["one"], 0.5 * 0.1 / (0.02 + 0.3 * 0.16) * h["t"] ** 2, 1e-7, "a gear pair with parent and child exchanged")
    # A driven wheel takes the other along; it starts with its teeth where the joints stand.
    driven = plain.replace('name = "one"', 'name = "one"\nmotion = "0.3*t^2"').replace(
        "position = [1, 0, 0]", "position = [1, 0, 0]\ninitial = { value = 0.7 }"
    )
    h = simulate(folder, start + driven + pair % "ratio = -2" + outs)
    off(h["two"], 0.7 - 0.6 * h["t"] ** 2, 1e-9, "a wheel driven by a motion")


def planets(folder):
    """Sun, planet on an arm, ring held: by gear with carrier and by a linear coupling."""
    zs, zp, zr, arm = 24, 18, 60, 0.21
    text = (
        simulation % (2, "[0, 0, 0]")
        + wheel("sun", 0.01)
        + wheel("arm", 0.05, 1, "frames = { pin = [0.21, 0, 0] }\n")
        + wheel("planet", 0.004, 0.7)
    )
    text += joint("s", "revolute", "ground", "sun") + joint("c", "revolute", "ground", "arm") + joint("p", "revolute", "arm.pin", "planet")
    text += f'[[coupling]]\nname = "in"\nkind = "gear"\njoints = ["s", "p"]\nteeth = [{zs}, {zp}]\ncarrier = "c"\n'
    text += f'[[coupling]]\nname = "out"\nkind = "linear"\nterms = [{{ joint = "p", factor = {zp} }}, {{ joint = "c", factor = {zr} }}]\n'
    h = simulate(folder, text + torque("sun", 0.2) + value("s") + value("c") + value("p") + value("x", "planet", "position"))
    i = zs / (zs + zr)  # arm per sun
    spin = i * (1 - zr / zp)  # planet in the world
    whole = 0.01 + (0.05 + 0.7 * arm**2) * i * i + 0.004 * spin**2
    angle = 0.5 * 0.2 / whole * h["t"] ** 2
    off(h["s"], angle, 1e-7, "planetary gear, sun")
    off(h["c"], i * angle, 1e-7, "planetary gear, arm")
    off(h["p"], -zr / zp * i * angle, 1e-7, "planetary gear, planet on the arm")
    off(h["x.x"], arm * np.cos(i * angle), 1e-7, "planetary gear, the planet's place")


def straight(folder):
    slide = joint("way", "prismatic", "ground", "b", "axis = [0, 1, 0]\nposition = [0.3, 0, 0]")
    both = wheel("a", 0.02) + wheel("b", 0.1, 2.5) + joint("turn", "revolute", "ground", "a") + slide
    outs = value("turn") + value("way") + energy
    h = simulate(
        folder,
        simulation % (2, "[0, -9.81, 0]")
        + both
        + '[[coupling]]\nname = "teeth"\nkind = "rack"\njoints = ["turn", "way"]\nradius = 0.08\n'
        + outs,
    )
    off(h["way"], -0.5 * 9.81 * 2.5 / (2.5 + 0.02 / 0.08**2) * h["t"] ** 2, 1e-7, "a rack that falls")
    off(h["turn"], h["way"] / 0.08, 1e-8, "its pinion")
    off(h["E"], h["E"][0] + 0 * h["t"], 1e-6, "energy of rack and pinion")
    h = simulate(
        folder,
        simulation % (2, "[0, -9.81, 0]")
        + both
        + '[[coupling]]\nname = "lead"\nkind = "screw"\njoints = ["turn", "way"]\npitch = "5 mm/rad"\n'
        + outs,
    )
    off(h["turn"], -0.5 * 9.81 * 2.5 * 0.005 / (0.02 + 2.5 * 0.005**2) * h["t"] ** 2, 1e-7, "a screw driven by its nut")


def differentials(folder):
    text = simulation % (2, "[0, 0, 0]") + wheel("l", 0.03) + wheel("r", 0.05) + wheel("in", 0.02)
    text += (
        joint("left", "revolute", "ground", "l") + joint("right", "revolute", "ground", "r") + joint("input", "revolute", "ground", "in")
    )
    text += '[[coupling]]\nname = "diff"\nkind = "differential"\njoints = ["left", "right", "input"]\nratio = 0.25\n'
    h = simulate(folder, text + torque("in", 0.4) + torque("l", -0.02) + value("left") + value("right") + value("input"))
    # Lagrange: inputs' torque / ratio is shared in halves; 0.5 (a + b) = 0.25 c.
    J, G = np.diag([0.03, 0.05, 0.02]), np.array([0.5, 0.5, -0.25])
    K = np.block([[J, G[:, None]], [G[None, :], np.zeros((1, 1))]])
    a = np.linalg.solve(K, [-0.02, 0, 0.4, 0])[:3]
    for name, x in zip(("left", "right", "input"), a):
        off(h[name], 0.5 * x * h["t"] ** 2, 1e-6, f"a differential, {name}")


def geared_five_bar(folder):
    """Two cranks that gears turn against each other carry a point straight along the line between them."""
    bar = '[[body]]\nname = "%s"\nkind = "rigid"\nmass = 1\ninertia = [0.01, 0.1, 0.1]\n'
    bar += "centre_of_mass = [%g, 0, 0]\nframes = { tip = [%g, 0, 0] }\n"
    text = simulation % (1.5, "[0, -9.81, 0]")
    for name, length in (("a", 0.3), ("b", 0.3), ("c", 0.8), ("d", 0.8)):
        text += bar % (name, length / 2, length)
    text += joint("A", "revolute", "ground", "a", "position = [-0.3, 0, 0]\ninitial = { value = 1.2, rate = 6 }")
    text += joint("B", "revolute", "ground", "b", f"position = [0.3, 0, 0]\ninitial = {{ value = {math.pi - 1.2!r} }}")
    text += joint("C", "revolute", "a.tip", "c", "initial = { guess = 0.1 }") + joint(
        "D", "revolute", "b.tip", "d", "initial = { guess = -0.1 }"
    )
    text += (
        joint("E", "revolute", "c.tip", "d.tip") + '[[coupling]]\nname = "gears"\nkind = "gear"\njoints = ["A", "B"]\nteeth = [30, 30]\n'
    )
    h = simulate(folder, text + value("A") + value("B") + value("tip", "c.tip", "position") + energy)
    off(h["A"] + h["B"], math.pi + 0 * h["t"], 1e-9, "gears of a five-bar linkage")
    off(h["tip.x"], 0 * h["t"], 1e-9, "the straight line of a geared five-bar linkage")
    x = -0.3 + 0.3 * np.cos(h["A"])
    off(h["tip.y"], 0.3 * np.sin(h["A"]) + np.sqrt(0.64 - x * x), 1e-9, "the place on it")
    off(h["E"], h["E"][0] + 0 * h["t"], 2e-6, "its energy")


def elastic_shafts(folder):
    """Torsion of a beam between a flywheel and a geared one: the frequency of the closed formula for a massless shaft."""
    shaft = '[[body]]\nname = "shaft"\nkind = "beam"\nlength = 0.5\nsection = { shape = "circle", diameter = 0.01 }\n'
    shaft += "material = { density = 1, youngs_modulus = 2e11 }\n"
    shaft += 'elements = 4\neffects = ["torsion"]\n'
    text = simulation % (0.5, "[0, 0, 0]") + shaft + wheel("big", 0.2) + wheel("small", 0.01)
    text += joint("held", "revolute", "ground", "shaft.root", "axis = [1, 0, 0]")
    text += joint("rigid", "weld", "shaft.root", "big") + joint(
        "turn", "revolute", "ground", "small", "axis = [1, 0, 0]\nposition = [0.5, 0.2, 0]"
    )
    text += joint("end", "revolute", "ground", "shaft.tip", "axis = [1, 0, 0]\nposition = [0.5, 0, 0]")
    text += '[[coupling]]\nname = "gears"\nkind = "gear"\njoints = ["end", "turn"]\nratio = -2\n'
    h = simulate(folder, text + torque("big", 5, "[1, 0, 0]") + value("turn") + value("held"))
    k = 2e11 / 2.6 * math.pi * 0.01**4 / 32 / 0.5
    one, two = 0.2, 0.01 * 4
    w = math.sqrt(k * (one + two) / (one * two))
    twist, mean = 5 / one / w**2 * (1 - np.cos(w * h["t"])), 2.5 / (one + two) * h["t"] ** 2
    off(h["turn"], -2 * (mean - one / (one + two) * twist), 2e-5, "a gear at the end of an elastic shaft")
    off(h["held"], mean + two / (one + two) * twist, 2e-5, "the other end of the shaft")


def screws(folder):
    """What turns a screw joint by way of a coupling is a moment about its axis: no part of the joint's reaction."""
    m, J, J2, k, T = 3.0, 0.02, 0.5, 0.4, 0.7
    for p in (0.05, -0.6, 4.0):
        scene = simulation % (1, "[0, 0, 0]") + wheel("nut", J, m) + wheel("fly", J2)
        scene += joint("thread", "screw", "ground", "nut", f"axis = [0, 0, 1]\npitch = {p}") + joint("shaft", "revolute", "ground", "fly")
        scene += '[[coupling]]\nname = "teeth"\nkind = "linear"\n'
        scene += f'terms = [{{ joint = "thread", factor = 1 }}, {{ joint = "shaft", factor = {k} }}]\n' + torque("fly", T)
        scene += value("R", "thread", "reaction") + value("C", "teeth", "force") + value("thread")
        h = simulate(folder, scene)
        a = -k * T / (J2 + k * k * (J + m * p * p))
        off(h["thread"], 0.5 * a * h["t"] ** 2, 1e-7, "a geared screw")
        off(h["C.1"], (J + m * p * p) * a + 0 * h["t"], 1e-7, "the moment on a geared screw")
        off(h["R.z"], m * p * a + 0 * h["t"], 1e-7, "the thread's force along a geared screw")
        off(h["R.mz"], -p * m * p * a + 0 * h["t"], 1e-7, "the thread's moment about a geared screw")


def wrong_words(folder):
    text = (
        simulation % (1, "[0, 0, 0]")
        + wheel("a", 1)
        + wheel("b", 1)
        + joint("one", "revolute", "ground", "a")
        + joint("two", "prismatic", "ground", "b")
    )
    refused(
        folder,
        lambda more: text + f'[[coupling]]\nname = "x"\n{more}\n',
        (
            (
                'kind = "gear"\njoints = ["one", "tow"]\nteeth = [1, 2]',
                ("scene.toml:", "[[coupling]] 'x': key 'joints'", "did you mean 'two'"),
            ),
            ('kind = "gear"\njoints = ["one", "two"]\nteeth = [1, 2]', ("'two', a prismatic joint, has no angle",)),
            ('kind = "gear"\njoints = ["one"]\nteeth = [1, 2]', ("must be 2 joints",)),
            ('kind = "rack"\njoints = ["one", "two"]', ("key 'radius'",)),
            ('kind = "rack"\njoints = ["one", "two"]\nradius = 0', ("must not be 0",)),
            ('kind = "linear"\nterms = [{ joint = "one", factor = 1 }]', ("at least two",)),
            (
                'kind = "linear"\nterms = [{ joint = "one", factor = 1 }, { joint = "two", coordinate = 2, factor = 1 }]',
                ("key 'coordinate'", "from 1 to 1"),
            ),
            ('kind = "gears"\njoints = ["one", "two"]', ("did you mean 'gear'",)),
            ('kind = "gear"\njoints = ["one", "two"]\nradius = 3', ("key 'radius' is unknown",)),
        ),
    )


run_parts(gears, planets, straight, differentials, geared_five_bar, elastic_shafts, screws, wrong_words)
