"""Thirty more mechanisms as a reader of SCENE.md writes them, numbers of three digits, against formulas and integrations of scipy."""
import math
import pathlib

import numpy as np
from arrays import off
from program import expect, finish, history, near, run, temporary_folder
from scene_text import force, joint, output
from scipy.optimize import brentq
from scipy.special import ellipk
from written_scenes import ground, head, meet, ode, rigid, same, simulate, written

sin, cos, pi, g = np.sin, np.cos, math.pi, 9.81


# ---- linkages -------------------------------------------------------------------------------------------------------------------------


def four_bar(folder, name, crank, coupler, rocker, base, tip, start, side, guess, rate=1):
    """A crank turned steadily; the coupler's point `tip` in its frame against the triangle's geometry."""
    text = head(2, "[0, 0, 0]") + ground(f"far = [{base}, 0, 0]")
    for body, length in (("crank", crank), ("coupler", coupler), ("rocker", rocker)):
        text += rigid(body, frames=f"end = [{length}, 0, 0]" + (f", tip = {tip}" if body == "coupler" else ""))
    text += joint("motor", "revolute", "ground", "crank", f'motion = "{start} + {rate}*t"') + joint("a", "revolute", "crank.end", "coupler")
    text += joint("c", "revolute", "ground.far", "rocker", f'initial = {{ guess = "{guess} deg" }}')
    text += joint("b", "revolute", "coupler.end", "rocker.end") + output("tip", "coupler.tip", "position")
    h = simulate(folder, name, text)
    a = crank * np.exp(1j * (start + rate * h["t"]))
    along = (meet(a, coupler, base + 0j, rocker, side) - a) / coupler
    same(name, h, "tip.x", (a + along * (tip[0] + 1j * tip[1])).real, 1e-8)
    same(name, h, "tip.y", (a + along * (tip[0] + 1j * tip[1])).imag, 1e-8)
    return h


def hoeken(folder):
    h = four_bar(folder, "hoeken", 0.1, 0.25, 0.25, 0.2, [0.5, 0, 0], 2.2, 1, 80)
    flat = np.abs(h["t"] + 2.2 - pi) < 0.9
    expect(np.ptp(h["tip.y"][flat]) < 0.002, f"Hoeken's linkage is straight: {np.ptp(h['tip.y'][flat])}")


def double_rocker(folder):
    four_bar(folder, "double_rocker", 0.3, 0.2, 0.3, 0.4, [0.1, -0.283, 0], 0.5, 1, 100, 0.4)


def scott_russell(folder):
    """The free end of a bar of twice the crank, whose other end slides along x, runs along y."""
    text = head(1, "[0, 0, 0]") + rigid("crank", frames="end = [0.2, 0, 0]")
    text += rigid("bar", frames="slide = [0.2, 0, 0], free = [-0.2, 0, 0]") + rigid("block")
    text += joint("motor", "revolute", "ground", "crank", 'motion = "0.4 + 0.7*t"') + joint("a", "revolute", "crank.end", "bar")
    text += joint("rail", "prismatic", "ground", "block", "axis = [1, 0, 0]\ninitial = { guess = 0.37 }")
    text += joint("b", "revolute", "block", "bar.slide") + output("p", "bar.free", "position")
    h = simulate(folder, "scott_russell", text)
    same("scott_russell", h, "p.x", 0, 1e-9)
    same("scott_russell", h, "p.y", 0.4 * sin(0.4 + 0.7 * h["t"]), 1e-8)


def sarrus(folder):
    """Two pairs of hinged plates at right angles keep the upper plate level: it rises by 2 L sin(angle)."""
    text = (
        head(1, "[0, 0, -9.81]") + ground("x = [0.2, 0, 0], y = [0, 0.2, 0]") + rigid("top", 2, frames="x = [0.2, 0, 0], y = [0, 0.2, 0]")
    )
    # The plates of x turn about y, those of y about x.
    for side, axis, sign in (("x", "[0, 1, 0]", -1), ("y", "[1, 0, 0]", 1)):
        end = "[0.3, 0, 0]" if side == "x" else "[0, 0.3, 0]"
        text += rigid(f"low{side}", frames=f"end = {end}") + rigid(f"high{side}", frames=f"end = {end}")
        motion = 'motion = "-0.5 - 0.4*t"' if side == "x" else f"initial = {{ guess = {0.5 * sign} }}"
        text += joint(f"foot{side}", "revolute", f"ground.{side}", f"low{side}", f"axis = {axis}\n{motion}")
        text += joint(f"knee{side}", "revolute", f"low{side}.end", f"high{side}.end", f"axis = {axis}\ninitial = {{ guess = {-sign} }}")
        text += joint(f"head{side}", "revolute", f"high{side}", f"top.{side}", f"axis = {axis}")
    text += output("top", "top", "position") + output("tilt", "top", "rotation")
    h = simulate(folder, "sarrus", text)
    same("sarrus", h, "top.z", 0.6 * sin(0.5 + 0.4 * h["t"]), 1e-8)
    for a in "xyz":
        same("sarrus", h, f"tilt.{a}", 0, 1e-8)


def gate(folder):
    """A gate on a post that leans by 5 degrees: a pendulum of g sin(lean)."""
    lean = np.radians(5)
    text = head(4) + ground('post = { rotation = { axis = [1, 0, 0], angle = "-85 deg" } }')
    text += rigid("gate", 12, "[0.5, 4.2, 4.6]", more="centre_of_mass = [0.9, 0, 0]")
    text += joint("hinge", "revolute", "ground.post", "gate", 'initial = { value = "-50 deg" }') + output("a", "hinge", "value")
    h = simulate(folder, "gate", text)
    # Downhill is the frame's -y: the horizontal part of the axis leans towards z.
    about = 4.6 + 12 * 0.9**2
    f = lambda t, y: [y[1], -12 * g * 0.9 * sin(lean) * cos(y[0]) / about]
    same("gate", h, "a", ode(f, [np.radians(-50), 0], h["t"])[0], 1e-5)


# ---- gears, screws, ropes -------------------------------------------------------------------------------------------------------------


def gear_train(folder):
    """A reverted train of two steps with a torque at the input: the inertia seen there."""
    text = head(1, "[0, 0, 0]") + ground("side = [0.12, 0, 0]")
    text += rigid("in", inertia="[1, 1, 0.02]") + rigid("middle", inertia="[1, 1, 0.05]") + rigid("out", inertia="[1, 1, 0.3]")
    for name, parent in (("in", "ground"), ("middle", "ground.side"), ("out", "ground")):
        text += joint(name, "revolute", parent, name) + output(name, name, "value")
    text += '[[coupling]]\nname = "first"\nkind = "gear"\njoints = ["in", "middle"]\nteeth = [18, 42]\n'
    text += '[[coupling]]\nname = "second"\nkind = "gear"\njoints = ["middle", "out"]\nteeth = [20, 40]\n'
    text += force("torque", "in", "direction = [0, 0, 1]\nvalue = 0.6") + output("tooth", "second", "force")
    h = simulate(folder, "gear_train", text)
    i, k = -18 / 42, 18 / 42 * 20 / 40
    rate = 0.6 / (0.02 + 0.05 * i**2 + 0.3 * k**2)
    same("gear_train", h, "in", 0.5 * rate * h["t"] ** 2, 1e-6)
    same("gear_train", h, "out", 0.5 * rate * k * h["t"] ** 2, 1e-6)
    same("gear_train", h, "tooth.2", 0.3 * rate * k, 1e-7)


def differential_screw(folder):
    """Two threads of 3 and 2.5 mm a turn on one spindle: the nut goes half a millimetre a turn."""
    text = head(1, "[0, 0, 0]") + rigid("spindle", 0.4, "[1e-4, 1e-4, 5e-5]") + rigid("nut", 2)
    text += joint("thread", "screw", "ground", "spindle", 'pitch = "3 mm/rev"\nmotion = "8*pi*t"')
    text += joint("nut", "screw", "spindle", "nut", 'pitch = "2.5 mm/rev"') + joint("rail", "prismatic", "ground", "nut")
    text += output("way", "rail", "value")
    h = simulate(folder, "differential_screw", text)
    same("differential_screw", h, "way", 4 * 0.0005 * h["t"], 1e-9)


def tackle(folder):
    """Four falls lift 30 kg by 8 kg that sink."""
    text = head(0.5) + ground("a = [0, 3, 0], top = [0.1, 3, 0], end = [0.2, 3, 0], out = [0.3, 3, 0]")
    text += rigid("load", 30) + rigid("weight", 8)
    text += joint("l", "prismatic", "ground", "load", "axis = [0, 1, 0]\nposition = [0.1, 0, 0]")
    text += joint("w", "prismatic", "ground", "weight", "axis = [0, 1, 0]\nposition = [0.4, 1.5, 0]")
    # The rope's straight lines: four of the load's, one of the weight's.
    text += '[[coupling]]\nname = "rope"\nkind = "linear"\nterms = [{ joint = "l", factor = 4 }, { joint = "w", factor = 1 }]\n'
    text += output("l", "l", "value") + output("pull", "rope", "force")
    h = simulate(folder, "tackle", text)
    a = g * (4 * 8 - 30) / (30 + 16 * 8)
    same("tackle", h, "l", 0.5 * a * h["t"] ** 2, 1e-9)
    same("tackle", h, "pull.2", 8 * g - 8 * 4 * a, 1e-8)


def weston(folder):
    """Weston's pulley: a chain over two drums of 100 and 90 mm carries a block in its loop."""
    text = head(0.5) + rigid("drums", 5, "[1, 1, 0.04]") + rigid("block", 40)
    text += joint("shaft", "revolute", "ground", "drums") + joint("rail", "prismatic", "ground", "block", "axis = [0, 1, 0]")
    text += '[[coupling]]\nname = "chain"\nkind = "linear"\nterms = [{ joint = "rail", factor = 2 }, { joint = "shaft", factor = -0.01 }]\n'
    text += force("torque", "drums", "direction = [0, 0, 1]\nvalue = 3") + output("up", "rail", "value")
    h = simulate(folder, "weston", text)
    r = 0.005
    same("weston", h, "up", 0.5 * (3 * r - 40 * g * r * r) / (0.04 + 40 * r * r) * h["t"] ** 2, 1e-8)


# ---- oscillators, impacts, control ----------------------------------------------------------------------------------------------------


def slot(folder):
    """A mass on a spring in a tube that turns at 6 rad/s: r'' = (w^2 - k/m) r + k/m r0."""
    text = head(1, "[0, 0, 0]") + rigid("tube") + rigid("mass", 0.5)
    text += joint("motor", "revolute", "ground", "tube", 'motion = "6*t"')
    text += joint(
        "slot", "prismatic", "tube", "mass", "axis = [1, 0, 0]\ninitial = { value = 0.1 }\nspring = { stiffness = 50, rest = 0.1 }"
    )
    text += output("r", "slot", "value") + output("side", "slot", "reaction", 'frame = "parent"')
    h = simulate(folder, "slot", text)
    w2 = 100 - 36
    r = 100 * 0.1 / w2 + (0.1 - 100 * 0.1 / w2) * cos(8 * h["t"])
    rate = -(0.1 - 100 * 0.1 / w2) * 8 * sin(8 * h["t"])
    same("slot", h, "r", r, 1e-6)
    same("slot", h, "side.y", 0.5 * 2 * 6 * rate, 1e-4)


def cradle(folder):
    """Three equal balls on rails: the first one's speed goes to the last."""
    text = head(0.6, "[0, 0, 0]")
    for k, x in enumerate((0.0, 0.16, 0.3)):
        rate = "initial = { rate = 0.5 }" if k == 0 else ""
        text += rigid(f"b{k}", 0.2) + joint(f"r{k}", "prismatic", "ground", f"b{k}", f"axis = [1, 0, 0]\nposition = [{x}, 0, 0]\n{rate}")
        text += output(f"v{k}", f"r{k}", "rate")
    for k in (0, 1):
        text += force(
            "contact",
            f"b{k}",
            f'from = "b{k + 1}"\nshape = "sphere"\nradius = 0.05\nagainst = "sphere"\nfrom_radius = 0.05\nstiffness = 1e6',
        )
    h = simulate(folder, "cradle", text)
    for k, v in enumerate((0, 0, 0.5)):
        near(h[f"v{k}"][-1], v, 1e-6, f"cradle: ball {k} at last")


def coulomb(folder):
    """A mass on a spring with dry friction: each half swing is 2 mu N / k shorter."""
    text = head(3, "[0, 0, 0]") + rigid("m", 2)
    text += joint(
        "rail",
        "prismatic",
        "ground",
        "m",
        "axis = [1, 0, 0]\ninitial = { value = 0.105 }\nspring = { stiffness = 200 }\n"
        "friction = { coefficient = 0.2, normal_force = 10 }",
    )
    text += output("x", "rail", "value")
    h = simulate(folder, "coulomb", text)
    t, x = h["t"], np.empty(len(h["t"]))
    amplitude, side, f, w = 0.105, 1, 0.01, 10.0
    for k in range(10):
        part = t >= k * pi / w - 1e-12
        x[part] = side * ((amplitude - f) * cos(w * (t[part] - k * pi / w)) + f)
        amplitude, side = amplitude - 2 * f, -side
        if amplitude <= f:
            x[t >= (k + 1) * pi / w - 1e-12] = side * amplitude
            break
    same("coulomb", h, "x", x, 1e-6)


def duffing(folder):
    """A cubic spring: the period is 4 sqrt(2m / c) K(-1) / A."""
    text = head(4, "[0, 0, 0]") + rigid("m", 1.5) + joint("rail", "prismatic", "ground", "m", "axis = [1, 0, 0]\ninitial = { value = 0.2 }")
    text += output("x", "rail", "value") + force("force", "m", 'direction = [1, 0, 0]\nvalue = "-400*x^3"')
    h = simulate(folder, "duffing", text)
    x, t = h["x"], h["t"]
    up = [t[i] - x[i] * (t[i + 1] - t[i]) / (x[i + 1] - x[i]) for i in range(len(t) - 1) if x[i] < 0 <= x[i + 1]]
    if len(up) > 1:
        near(up[1] - up[0], 4 * math.sqrt(2 * 1.5 / 400) / 0.2 * ellipk(-1), 1e-4, "duffing: period")
    f = lambda s, y: [y[1], -400 * y[0] ** 3 / 1.5]
    same("duffing", h, "x", ode(f, [0.2, 0], t)[0], 2e-5)


def van_der_pol(folder):
    text = head(10, "[0, 0, 0]") + rigid("m", 1) + joint("rail", "prismatic", "ground", "m", "axis = [1, 0, 0]\ninitial = { value = 0.1 }")
    text += output("x", "rail", "value") + output("v", "rail", "rate")
    text += force("force", "m", 'direction = [1, 0, 0]\nvalue = "1.5*(1 - x^2)*v - x"')
    h = simulate(folder, "van_der_pol", text)
    same("van_der_pol", h, "x", ode(lambda t, y: [y[1], 1.5 * (1 - y[0] ** 2) * y[1] - y[0]], [0.1, 0], h["t"])[0], 2e-4)


def servo(folder):
    """A PID controller turns a disc to 0.8 rad against a constant load."""
    text = head(3, "[0, 0, 0]") + rigid("disc", 1, "[1, 1, 0.05]") + joint("pin", "revolute", "ground", "disc")
    text += output("a", "pin", "value") + output("w", "pin", "rate")
    text += '[[block]]\nname = "control"\nkind = "pid"\ninput = "0.8 - a"\nrate = "-w"\nproportional = 4\nintegral = 6\nderivative = 0.6\n'
    text += force("torque", "disc", 'direction = [0, 0, 1]\nvalue = "control - 0.5"')
    h = simulate(folder, "servo", text)
    f = lambda t, y: [y[1], (4 * (0.8 - y[0]) + 6 * y[2] - 0.6 * y[1] - 0.5) / 0.05, 0.8 - y[0]]
    same("servo", h, "a", ode(f, [0, 0, 0], h["t"])[0], 1e-5)


# ---- arms, pendulums, beams -----------------------------------------------------------------------------------------------------------


def arm(folder):
    """A two-link arm moved as asked: the torques of its motors by Lagrange's equations."""
    l1, l2, m1, m2, i1, i2 = 0.5, 0.4, 3.0, 2.0, 0.07, 0.03
    text = head(1) + rigid("upper", m1, "[0.01, 0.07, 0.07]", "end = [0.5, 0, 0]", "centre_of_mass = [0.25, 0, 0]")
    text += rigid("lower", m2, "[0.01, 0.03, 0.03]", more="centre_of_mass = [0.2, 0, 0]")
    text += joint("shoulder", "revolute", "ground", "upper", 'motion = "0.3 + sin(2*t)"')
    text += joint("elbow", "revolute", "upper.end", "lower", 'motion = "1 - 0.5*t^2"')
    text += output("s", "shoulder", "reaction") + output("e", "elbow", "reaction")
    h = simulate(folder, "arm", text)
    t = h["t"]
    a, b, da, db, dda, ddb = 0.3 + sin(2 * t), 1 - 0.5 * t**2, 2 * cos(2 * t), -t, -4 * sin(2 * t), -np.ones_like(t)
    c = m2 * l1 * l2 / 2
    m12 = i2 + m2 * l2**2 / 4 + c * cos(b)
    e = m12 * dda + (i2 + m2 * l2**2 / 4) * ddb + c * sin(b) * da**2 + m2 * g * l2 / 2 * cos(a + b)
    m11 = i1 + m1 * l1**2 / 4 + m2 * l1**2 + i2 + m2 * l2**2 / 4 + 2 * c * cos(b)
    s = m11 * dda + m12 * ddb - c * sin(b) * (2 * da * db + db**2)
    s += (m1 / 2 + m2) * g * l1 * cos(a) + m2 * g * l2 / 2 * cos(a + b)
    same("arm", h, "s.mz", s, 1e-5)
    same("arm", h, "e.mz", e, 1e-5)


def triple(folder):
    """Three point masses on massless rods (as thin rods that weigh at their ends)."""
    text, parent, n = head(2), "ground", 3
    for k in range(n):
        text += rigid(f"p{k}", 1, "[0, 0, 0]", "end = [0.4, 0, 0]", "centre_of_mass = [0.4, 0, 0]")
        start = 'initial = { value = "%s deg" }' % (-60 if k == 0 else 15)
        text += joint(f"j{k}", "revolute", parent, f"p{k}", start) + output(f"e{k}", f"p{k}.end", "position")
        parent = f"p{k}.end"
    h = simulate(folder, "triple", text)
    weight = np.array([[n - max(i, j) for j in range(n)] for i in range(n)])

    def f(t, y):
        a, w = y[:n], y[n:]
        d = a[:, None] - a[None, :]
        return np.concatenate([w, np.linalg.solve(0.4 * weight * cos(d), -0.4 * (weight * sin(d)) @ w**2 - g * np.diag(weight) * cos(a))])

    a = ode(f, np.concatenate([np.radians([-60, -45, -30]), np.zeros(n)]), h["t"])[:n]
    same("triple", h, "e2.x", 0.4 * cos(a).sum(0), 2e-4)
    same("triple", h, "e2.y", 0.4 * sin(a).sum(0), 2e-4)


def spherical(folder):
    text = head(3, "[0, 0, -9.81]") + rigid("bob", 0.8, "[0, 0, 0]", more="centre_of_mass = [0.7, 0, 0]\nframes = { c = [0.7, 0, 0] }")
    text = text.replace('more="', "")
    text += joint("ball", "spherical", "ground", "bob", "initial = { rate = [0, 0, 2.5] }") + output("c", "bob.c", "position")
    h = simulate(folder, "spherical", text)

    def f(t, y):
        p, v = y[:3], y[3:]
        pull = (v @ v + np.array([0, 0, -g]) @ p) / 0.49
        return np.concatenate([v, [0, 0, -g] - pull * p])

    p = ode(f, [0.7, 0, 0, 0, 1.75, 0], h["t"])
    for k, a in enumerate("xyz"):
        same("spherical", h, f"c.{a}", p[k], 1e-4)


STEEL = "material = { density = 7850, youngs_modulus = 210e9 }\n"


def two_spans(folder):
    """A beam over three supports under its weight: 3/8, 10/8, 3/8 of a span's weight."""
    text = (
        head(0.01, more='start = "static"')
        + '[[body]]\nname = "beam"\nkind = "beam"\nlength = 4\nelements = 16\nframes = { middle = 0.5 }\n'
    )
    text += 'section = { shape = "rectangle", width = 0.05, height = 0.03 }\n' + STEEL
    text += joint("left", "revolute", "ground", "beam") + joint("middle", "point-on-line", "ground", "beam.middle", "axis = [1, 0, 0]")
    text += joint("right", "point-on-line", "ground", "beam.tip", "axis = [1, 0, 0]")
    for name in ("left", "middle", "right"):
        text += output(name, name, "reaction")
    h = simulate(folder, "two_spans", text)
    span = 7850 * 0.05 * 0.03 * 2 * g
    for name, share in (("left", 3 / 8), ("middle", 10 / 8), ("right", 3 / 8)):
        near(abs(h[f"{name}.y"][0]), share * span, 2e-4 * span, f"two spans: {name}")


def propped(folder):
    """A clamped beam with a spring under its end: force shared by the stiffnesses."""
    text = head(0.01, "[0, 0, 0]", 'start = "static"') + '[[body]]\nname = "beam"\nkind = "beam"\nlength = 1\n'
    text += 'section = { shape = "circle", diameter = 0.02 }\n' + STEEL + joint("clamp", "weld", "ground", "beam")
    text += force("force", "beam.tip", "direction = [0, -1, 0]\nvalue = 60").replace("[[force]]\n", '[[force]]\nname = "load"\n')
    text += force("spring-damper", "beam.tip", 'from = "ground.foot"\nstiffness = 4000\nrest = 0.5').replace(
        "[[force]]\n", '[[force]]\nname = "prop"\n'
    )
    text += ground("foot = [1, -0.5, 0]") + output("prop", "prop", "force") + output("u", "beam.tip", "displacement")
    h = simulate(folder, "propped", text)
    k = 3 * 210e9 * pi * 0.02**4 / 64
    near(h["u.y"][0], -60 / (k + 4000), 2e-3 * 60 / (k + 4000), "propped beam: deflection")
    near(-h["prop"][0], 4000 * 60 / (k + 4000), 0.05, "propped beam: force of the spring")


# ---- ten more -------------------------------------------------------------------------------------------------------------------------


def cardan(folder):
    """A planet that rolls in a ring of twice its radius: a point of its rim runs on a straight line (Cardan's circles)."""
    text = head(2, "[0, 0, 0]") + rigid("arm", 0.2, "[1e-4, 1e-4, 2e-4]", "pin = [0.06, 0, 0]")
    text += rigid("planet", 0.35, "[2e-4, 2e-4, 4e-4]", "rim = [0.06, 0, 0]")
    text += joint("shaft", "revolute", "ground", "arm", 'motion = "3*t"') + joint("pin", "revolute", "arm.pin", "planet")
    text += rigid("ring") + joint("held", "revolute", "ground", "ring", 'motion = "0*t"')
    text += '[[coupling]]\nname = "mesh"\nkind = "gear"\njoints = ["held", "pin"]\nteeth = [96, 48]\ninternal = true\ncarrier = "shaft"\n'
    h = simulate(folder, "cardan", text + output("rim", "planet.rim", "position"))
    same("cardan", h, "rim.x", 0.12 * cos(3 * h["t"]), 1e-8)
    same("cardan", h, "rim.y", 0, 1e-8)


def yo_yo(folder):
    """A yo-yo unwinds from a thread that is held: g / (1 + J / (m r^2)); the thread pulls with m (g - a)."""
    m, r, J = 0.055, 0.008, 2.2e-5
    text = head(0.6) + rigid("slide", 0) + rigid("disc", m, f"[{J / 2}, {J / 2}, {J}]")
    text += joint("down", "prismatic", "ground", "slide", "axis = [0, -1, 0]") + joint("spin", "revolute", "slide", "disc")
    text += f'[[coupling]]\nname = "thread"\nkind = "rack"\njoints = ["spin", "down"]\nradius = {r}\n'
    h = simulate(folder, "yo-yo", text + output("fall", "down", "value") + output("thread", "thread", "force"))
    a = g / (1 + J / (m * r * r))
    same("yo-yo", h, "fall", a * h["t"] ** 2 / 2, 1e-8)
    same("yo-yo", h, "thread.2", m * (a - g), 1e-7)


def kapitza(folder):
    """A pendulum on its head whose foot is shaken fast enough stays up (Kapitza)."""
    L, a, w = 0.25, 0.012, 250.0
    text = head(2).replace("output_rate = 100", "output_rate = 500") + rigid("foot", 0.1)
    text += rigid("rod", 0.3, "[1e-5, 0.0004, 0.0004]", more=f"centre_of_mass = [0, {L}, 0]")
    text += joint("shaker", "prismatic", "ground", "foot", f'axis = [0, 1, 0]\nmotion = "{a}*sin({w}*t)"')
    text += joint("hinge", "revolute", "foot", "rod", 'initial = { value = "12 deg" }')
    h = simulate(folder, "kapitza", text + output("lean", "hinge", "value"))
    J = 0.0004 + 0.3 * L * L
    lean = ode(lambda t, y: (y[1], 0.3 * L / J * (g - a * w * w * sin(w * t)) * sin(y[0])), [math.radians(12), 0], h["t"])[0]
    expect(np.abs(lean).max() < 1, "the truth stays up")
    same("kapitza", h, "lean", lean, 2e-4)


def wilberforce(folder):
    """A mass on a coil whose stretch and twist are coupled: the swing goes from one to the other and back."""
    m, J, k, d, e = 0.49, 1.39e-4, 2.8, 7.86e-4, 9.27e-3
    text = head(40, "[0, 0, 0]") + rigid("slide", 0) + rigid("bob", m, f"[{J}, {J}, {J}]")
    text += joint("up", "prismatic", "ground", "slide", f"spring = {{ stiffness = {k} }}\ninitial = {{ value = 0.1 }}")
    text += joint("turn", "revolute", "slide", "bob", f"spring = {{ stiffness = {d} }}")
    text += force("force", "bob", f'direction = [0, 0, 1]\nvalue = "-{e / 2}*twist"')
    text += force("torque", "bob", f'direction = [0, 0, 1]\nvalue = "-{e / 2}*stretch"')
    h = simulate(folder, "wilberforce", text + output("stretch", "up", "value") + output("twist", "turn", "value"))
    squares, shapes = np.linalg.eig(np.array([[k / m, e / 2 / m], [e / 2 / J, d / J]]))
    truth = shapes @ (np.linalg.solve(shapes, [0.1, 0])[:, None] * cos(np.sqrt(squares)[:, None] * h["t"]))
    same("wilberforce", h, "stretch", truth[0], 2e-4)
    same("wilberforce", h, "twist", truth[1], 2e-4 * np.abs(truth[1]).max() / 0.1)


def absorber(folder):
    """A machine with an absorber tuned to 6.5 Hz: at that frequency it stands still; the response is F (k2 - m2 w^2) / det."""
    m1, k1, m2 = 48.0, 1.1e5, 6.0
    k2 = m2 * (2 * pi * 6.5) ** 2
    text = head(1, "[0, 0, 0]") + rigid("machine", m1) + rigid("absorber", m2)
    text += joint("base", "prismatic", "ground", "machine", f"spring = {{ stiffness = {k1} }}")
    text += joint("top", "prismatic", "machine", "absorber", f'spring = {{ stiffness = "{m2}*(2*pi*6.5)^2" }}')
    text += force("force", "machine", 'name = "shake"\ndirection = [0, 0, 1]\nvalue = 0') + output("x", "machine", "position")
    written.append("absorber")
    (folder / "absorber.toml").write_text(text)
    run("response", folder / "absorber.toml", "--force", "shake", "--from", 2, "--to", 15, "--points", 27, "-o", folder / "response.csv")
    rows = history(folder / "response.csv")
    f = np.array(rows[next(iter(rows))])
    w2 = (2 * pi * f) ** 2
    truth = (k2 - m2 * w2) / ((k1 + k2 - m1 * w2) * (k2 - m2 * w2) - k2 * k2)
    beside = np.abs(truth) < 1e-3  # the program adds the very poles, where nothing bounds the response
    expect(beside.sum() == 27 and len(f) == 29, f"27 frequencies and two poles: {f}")
    off(np.array(rows["x.z"])[beside] / np.abs(truth[beside]), 1, 1e-9, "absorber: response of the machine")


def clutch(folder):
    """Two discs pressed together with dry friction: one speed after J1 J2 (w1 - w2) / (M (J1 + J2))."""
    J1, J2, M, w = 0.32, 0.11, 0.5 * 140 * 0.06, 45.0
    text = head(1, "[0, 0, 0]") + rigid("driver", 2, f"[0.2, 0.2, {J1}]") + rigid("driven", 1, f"[0.1, 0.1, {J2}]")
    text += joint("bearing", "revolute", "ground", "driver", f"initial = {{ rate = {w} }}")
    friction = "friction = { coefficient = 0.5, normal_force = 140, radius = 0.06 }"
    text += joint("clutch", "revolute", "driver", "driven", f"initial = {{ rate = {-w} }}\n{friction}")
    h = simulate(folder, "clutch", text + output("w1", "driver", "angular_velocity") + output("w2", "driven", "angular_velocity"))
    end = J1 * w / (J1 + J2)
    expect(0 < J2 * end / M < 0.9, "they stick within the run")
    same("clutch", h, "w1.z", np.maximum(w - M / J1 * h["t"], end), 1e-6 * w)
    same("clutch", h, "w2.z", np.minimum(M / J2 * h["t"], end), 1e-6 * w)


def trammel(folder):
    """Archimedes' trammel: the ends of a bar slide on two lines at right angles, its tip draws an ellipse."""
    text = head(3, "[0, 0, 0]") + rigid("shoe", 0.1) + rigid("bar", 0.6, "[1e-4, 0.01, 0.01]", "other = [0.18, 0, 0], tip = [0.3, 0, 0]")
    text += joint("across", "prismatic", "ground", "shoe", "axis = [1, 0, 0]\ninitial = { guess = 0.17 }")
    text += joint("pin", "revolute", "shoe", "bar", 'motion = "2.6 + 2*t"')
    text += joint("along", "point-on-line", "ground", "bar.other", "axis = [0, 1, 0]")
    h = simulate(folder, "trammel", text + output("tip", "bar.tip", "position"))
    angle = 2.6 + 2 * h["t"]
    same("trammel", h, "tip.x", 0.12 * cos(angle), 1e-8)
    same("trammel", h, "tip.y", 0.3 * sin(angle), 1e-8)


def chimney(folder):
    """A chimney falls over about its foot: the bending moment m g sin(a) s (1 - s)^2 L / 4 is largest at a third of its height."""
    L, m = 24.0, 2400 * 3.2 * 24
    text = head(3) + '[[body]]\nname = "stack"\nkind = "beam"\nlength = 24\nmaterial = { density = 2400, youngs_modulus = "30 GPa" }\n'
    text += 'section = { shape = "general", area = 3.2, iy = 0.4, iz = 0.4, j = 0.8 }\neffects = []\nframes = { third = "1/3" }\n'
    text += joint("foot", "revolute", "ground", "stack", 'initial = { value = "84 deg" }')
    for name, at in (("low", 0.2), ("third", "third"), ("high", 0.6)):
        of = "stack.third" if at == "third" else "stack"
        text += output(name, of, "section_force", "" if at == "third" else f"at = {at}")
    h = simulate(folder, "chimney", text + output("lean", "foot", "value"))
    for name, s in (("low", 0.2), ("third", 1 / 3), ("high", 0.6)):
        moment = m * g * cos(h["lean"]) * s * (1 - s) ** 2 * L / 4
        same("chimney", h, f"{name}.Mz", np.sign(h[f"{name}.Mz"][50]) * moment, 2e-3 * np.abs(moment).max())


def quarter_circle(folder):
    """A clamped quarter circle with a force at its tip towards the centre's side: pi F R^3 / (4 E I) and F R^3 / (2 E I)."""
    R, F, EI = 0.5, 0.05, 2.1e11 * pi * 0.012**4 / 64
    text = head(0.1, "[0, 0, 0]").replace("output_rate", 'start = "static"\noutput_rate')
    text += '[[body]]\nname = "hook"\nkind = "beam"\naxis = { x = "0.5*sin(u)", y = "0.5*(1 - cos(u))", to = "pi/2" }\nvolumes = 30\n'
    text += 'section = { shape = "circle", diameter = "12 mm" }\nmaterial = { density = 7850, youngs_modulus = "210 GPa", poisson = 0.3 }\n'
    text += joint("clamp", "weld", "ground", "hook") + force("force", "hook.tip", f"direction = [1, 0, 0]\nvalue = {F}")
    h = simulate(folder, "quarter circle", text + output("tip", "hook.tip", "position"))
    off((h["tip.x"][0] - R) / (pi * F * R**3 / (4 * EI)), 1, 1e-3, "quarter circle: along the force")
    off((R - h["tip.y"][0]) / (F * R**3 / (2 * EI)), 1, 1e-3, "quarter circle: across it")


def bifilar(folder):
    """A rod on two threads of 0.8 m, 0.3 m apart, turned by 5 deg: (J + m (dz/da)^2) a'' ...; by energy, against an integration."""
    m, J, c, L = 1.2, 0.0312, 0.15, 0.8
    text = head(4, "[0, 0, -9.81]").replace("output_rate = 100", "output_rate = 100\ntolerance = 1e-8")
    text += ground(f"a = [{c}, 0, {L}], b = [{-c}, 0, {L}]") + rigid("rod", m, f"[1e-4, {J}, {J}]", f"a = [{c}, 0, 0], b = [{-c}, 0, 0]")
    turn = math.radians(5)
    text += joint("all", "free", "ground", "rod", f"initial = {{ guess = [0, 0, 0.001, 0, 0, {turn:.4g}] }}")
    text += joint("left", "distance", "ground.a", "rod.a", f"length = {L}") + joint(
        "right", "distance", "ground.b", "rod.b", f"length = {L}"
    )
    h = simulate(folder, "bifilar", text + output("turn", "rod", "rotation"))
    start = h["turn.z"][0]
    expect(abs(start - turn) < 0.02, f"it starts turned by {start} rad")

    def slope(a):
        under = np.sqrt(L * L - 2 * c * c * (1 - cos(a)))
        z, dz = L - under, c * c * sin(a) / under
        return dz, (c * c * cos(a) - dz * dz) / under

    def f(t, y):
        dz, d2z = slope(y[0])
        return y[1], -(m * dz * d2z * y[1] ** 2 + m * g * dz) / (J + m * dz * dz)

    same("bifilar", h, "turn.z", ode(f, [start, 0], h["t"])[0], 1e-5)


with temporary_folder() as name:
    folder = pathlib.Path(name)
    for test in (
        hoeken,
        double_rocker,
        scott_russell,
        sarrus,
        gate,
        gear_train,
        differential_screw,
        tackle,
        weston,
        slot,
        cradle,
        coulomb,
        duffing,
    ):
        test(folder)
    for test in (van_der_pol, servo, arm, triple, spherical, two_spans, propped):
        test(folder)
    for test in (cardan, yo_yo, kapitza, wilberforce, absorber, clutch, trammel, chimney, quarter_circle, bifilar):
        test(folder)
expect(len(set(written)) == 30, f"{len(set(written))} mechanisms")
finish()
