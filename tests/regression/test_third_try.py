"""Twenty-two more mechanisms as a reader of SCENE.md writes them, numbers of three digits, against formulas and integrations of scipy."""
import csv
import json
import math
import pathlib

import numpy as np
from program import expect, finish, near, run, temporary_folder
from scene_text import coupling, force, joint, output
from scipy.integrate import solve_ivp
from scipy.linalg import eigvals, solve_continuous_are
from scipy.optimize import brentq, fsolve
from scipy.spatial.transform import Rotation
from written_scenes import ground, head, meet, ode, rigid, same, simulate, written

sin, cos, pi, g = np.sin, np.cos, math.pi, 9.81


# ---- linkages -------------------------------------------------------------------------------------------------------------------------


def geneva(folder):
    """The pin of a driver in the slot of a Geneva wheel, while it is in: tan(wheel) = r sin(a) / (d - r cos(a))."""
    d, r = 0.1, 0.0707
    text = head(1, "[0, 0, 0]") + ground(f"post = [{d}, 0, 0]") + rigid("driver", frames=f"pin = [{r}, 0, 0]") + rigid("wheel")
    text += joint("motor", "revolute", "ground", "driver", 'motion = "-0.7 + 1.4*t"')
    text += joint("shaft", "revolute", "ground.post", "wheel", 'initial = { guess = "-135 deg" }')
    text += joint("slot", "point-on-line", "wheel", "driver.pin", "axis = [1, 0, 0]")
    h = simulate(folder, "geneva", text + output("a", "shaft", "value") + output("w", "shaft", "rate"))
    a = -0.7 + 1.4 * h["t"]
    same("geneva", h, "a", -pi - np.arctan2(r * sin(a), d - r * cos(a)), 1e-8)
    same("geneva", h, "w", -1.4 * r * (d * cos(a) - r) / (d * d + r * r - 2 * d * r * cos(a)), 1e-6)


def bennett(folder):
    """Four skew hinges that move though they should not: tan(p/2) tan(q/2) = sin((beta + alpha)/2) / sin((beta - alpha)/2)."""
    a, b = 0.2, 0.4  # sin(alpha) / a = sin(beta) / b with alpha of 30, beta of 90 degrees
    text = head(1.5, "[0, 0, 0]") + ground('last = { position = [-0.4, 0, 0], rotation = ["-90 deg", 0, 0] }')
    for name, length, twist in (("first", a, 30), ("second", b, 90), ("third", a, 30)):
        text += rigid(name, frames=f'end = {{ position = [{length}, 0, 0], rotation = ["{twist} deg", 0, 0] }}')
    text += joint("p", "revolute", "ground", "first", 'motion = "1.2 + 0.8*t"')
    text += joint("q", "revolute", "first.end", "second", 'initial = { guess = "136 deg" }')
    text += joint("r", "revolute", "second.end", "third", 'initial = { guess = "-69 deg" }')
    text += joint("s", "revolute", "ground.last", "third.end")
    h = simulate(folder, "bennett", text + output("q", "q", "value") + output("r", "r", "value"))
    ratio = np.tan((1.2 + 0.8 * h["t"]) / 2) * np.tan(h["q"] / 2)
    near(np.max(np.abs(ratio - sin(pi / 3) / sin(pi / 6))), 0, 1e-6, "bennett: product of the half angles' tangents")


def tusi(folder):
    """A wheel that rolls in a ring of twice its size: a point of its rim runs straight."""
    text = head(2, "[0, 0, 0]") + rigid("ring") + rigid("arm", frames="end = [0.06, 0, 0]") + rigid("wheel", frames="rim = [0.06, 0, 0]")
    text += joint("ring", "revolute", "ground", "ring", 'motion = "0"') + joint("arm", "revolute", "ground", "arm", 'motion = "0.4 + 3*t"')
    text += joint("wheel", "revolute", "arm.end", "wheel", 'initial = { value = "-0.8" }')
    text += coupling("teeth", "gear", ["ring", "wheel"], teeth=[60, 30], internal=True, carrier="arm")
    h = simulate(folder, "tusi", text + output("rim", "wheel.rim", "position"))
    # The wheel turns by -(0.4 + 3t) against the world.
    same("tusi", h, "rim.x", 0.12 * cos(0.4 + 3 * h["t"]), 1e-8)
    same("tusi", h, "rim.y", 0, 1e-8)


def rhombic(folder):
    """Two geared cranks carry a yoke between two rods: e + r cos(a) - c = the rod's part across, the rest along."""
    e, r, c, l = 0.04, 0.03, 0.015, 0.12
    text = head(1, "[0, 0, 0]") + ground(f"left = [{-e}, 0, 0], right = [{e}, 0, 0]")
    for side, s in (("left", -1), ("right", 1)):
        text += rigid(side, frames=f"pin = [{s * r}, 0, 0]") + rigid(f"{side}rod", 0.3, frames=f"end = [0, {l}, 0]")
    text += rigid("yoke", 2, frames=f"left = [{-c}, 0, 0], right = [{c}, 0, 0]")
    text += joint("right", "revolute", "ground.right", "right", 'motion = "0.5 + 5*t"')
    text += joint("left", "revolute", "ground.left", "left", "initial = { value = -0.5 }")
    text += coupling("gears", "gear", ["right", "left"], teeth=[40, 40])
    text += joint("slide", "prismatic", "ground", "yoke", "axis = [0, 1, 0]\ninitial = { guess = 0.1 }")
    for side in ("left", "right"):
        text += joint(f"{side}big", "revolute", f"{side}.pin", f"{side}rod", "initial = { guess = 0.4 }" if side == "right" else "")
        text += joint(f"{side}small", "revolute", f"{side}rod.end", f"yoke.{side}")
    h = simulate(folder, "rhombic", text + output("y", "slide", "value") + output("T", "system", "kinetic"))
    a = 0.5 + 5 * h["t"]
    same("rhombic", h, "y", r * sin(a) + np.sqrt(l * l - (e + r * cos(a) - c) ** 2), 1e-8)


def delta(folder):
    """A delta robot, each arm with two rods: the platform stays level where three spheres meet."""
    L, l, R, c = 0.2, 0.5, 0.15, 0.05
    # The platform's marks l1 .. l3, r1 .. r3: beside the middle of its sides.
    marks = []
    for i in (1, 2, 3):
        turn = 2 * pi / 3 * i
        for name, y in (("l", 0.04), ("r", -0.04)):
            marks.append(f"{name}{i} = [{c * cos(turn) - y * sin(turn):.17g}, {c * sin(turn) + y * cos(turn):.17g}, 0]")
    text = head(1, "[0, 0, -9.81]") + rigid("platform", 0.5, "[1e-3, 1e-3, 2e-3]", ", ".join(marks))
    text += '[[group]]\nname = "arm"\n[[group.body]]\nname = "upper"\nkind = "rigid"\nmass = 0.3\ninertia = [1e-4, 1e-3, 1e-3]\n'
    text += f"frames = {{ l = [{L}, 0.04, 0], r = [{L}, -0.04, 0] }}\n"
    text += '[[group.joint]]\nname = "motor"\nkind = "revolute"\nparent = "ground"\nchild = "upper"\naxis = [0, 1, 0]\n'
    text += f'position = [{R}, 0, 0]\nmotion = "0.3 + 0.2*sin(2*t + i)"\n'
    for side in "lr":
        text += (
            f'[[group.joint]]\nname = "{side}"\nkind = "distance"\nparent = "upper.{side}"\nchild = "platform.{side}{{i}}"\nlength = {l}\n'
        )
    text += '[[instance]]\ngroup = "arm"\nname = "a"\ncount = 3\nrotation = "[0, 0, 2*pi/3*i]"\n'
    text += joint("all", "free", "ground", "platform", "initial = { guess = [0, 0, -0.5, 0, 0, 0] }")
    h = simulate(folder, "delta", text + output("p", "platform", "position") + output("tilt", "platform", "angle", relative_to="ground"))
    same("delta", h, "tilt", 0, 1e-7)
    truth, guess = [], np.array([0, 0, -0.5])
    for t in h["t"]:

        def spheres(p):
            out = []
            for i in (1, 2, 3):
                q, a = 0.3 + 0.2 * sin(2 * t + i), 2 * pi / 3 * i
                reach = R + L * cos(q) - c
                out.append((p[0] - reach * cos(a)) ** 2 + (p[1] - reach * sin(a)) ** 2 + (p[2] + L * sin(q)) ** 2 - l * l)
            return out

        guess = fsolve(spheres, guess, xtol=1e-11)
        truth.append(guess)
    for k, axis in enumerate("xyz"):
        same("delta", h, f"p.{axis}", np.array(truth)[:, k], 1e-8)


# ---- gears and pendulums that are carried ----------------------------------------------------------------------------------------------


def nested(folder):
    """Sun and planet on an arm of an arm of a cart: the sun turns by -2.5 t against the arm that carries the planet."""
    text = head(1, "[0, 0, 0]") + rigid("cart") + rigid("first", frames="end = [0.2, 0, 0]") + rigid("second", frames="end = [0.1, 0, 0]")
    text += rigid("sun") + rigid("planet") + joint("cart", "prismatic", "ground", "cart", 'axis = [0, 1, 0]\nmotion = "0.1*sin(5*t)"')
    text += joint("first", "revolute", "cart", "first", 'motion = "2*t"') + joint("sun", "revolute", "first.end", "sun", 'motion = "0.5*t"')
    text += joint("second", "revolute", "first.end", "second", 'motion = "3*t"') + joint("planet", "revolute", "second.end", "planet")
    text += coupling("teeth", "gear", ["sun", "planet"], teeth=[30, 20], carrier="second")
    h = simulate(folder, "nested", text + output("p", "planet", "value") + output("w", "planet", "angular_velocity"))
    same("nested", h, "p", 1.5 * 2.5 * h["t"], 1e-9)
    same("nested", h, "w.z", 2 + 3 + 3.75, 1e-9)


def belted(folder):
    """A wheel at the end of a falling arm, joined to a wheel that stands by a belt of equal pulleys: it stays as it was turned."""
    text = head(1) + rigid("arm", 1, "[0.05, 0.05, 0.05]", "end = [0.3, 0, 0]", "centre_of_mass = [0.15, 0, 0]")
    text += rigid("wheel", 0.5, "[1e-3, 1e-3, 2e-3]") + rigid("fixed") + joint("fixed", "revolute", "ground", "fixed", 'motion = "0"')
    text += joint("arm", "revolute", "ground", "arm") + joint("wheel", "revolute", "arm.end", "wheel")
    text += coupling("belt", "gear", ["fixed", "wheel"], ratio=1, carrier="arm")
    h = simulate(folder, "belted", text + output("a", "arm", "value") + output("w", "wheel", "angular_velocity"))
    inertia, weight = 0.05 + 1 * 0.15**2 + 0.5 * 0.3**2, (1 * 0.15 + 0.5 * 0.3) * g
    same("belted", h, "a", ode(lambda t, y: [y[1], -weight * cos(y[0]) / inertia], [0, 0], h["t"])[0], 1e-5)
    same("belted", h, "w.z", 0, 1e-9)


def wave(folder):
    """Ten pendulums of one group, whose lengths follow from their numbers of swings in three seconds."""
    text = head(3) + "[parameters]\nN = 10\nT = 3\n" + '[[group]]\nname = "pendulum"\nparameters = { L = 1 }\n'
    text += '[[group.body]]\nname = "bob"\nkind = "rigid"\nmass = 0.1\ncentre_of_mass = [0, "-L", 0]\n'
    text += '[[group.joint]]\nname = "pin"\nkind = "revolute"\nparent = "ground"\nchild = "bob"\ninitial = { value = "3 deg" }\n'
    text += '[[group.output]]\nname = "a"\nof = "pin"\nquantity = "value"\n[[instance]]\ngroup = "pendulum"\nname = "w"\ncount = "N"\n'
    text += 'position = "[0, 0, 0.1*i]"\nparameters = { L = "9.81*(T/(2 + i)/2/pi)^2" }\n'
    h = simulate(folder, "wave", text)
    for i in range(1, 11):
        rate = (2 * pi * (2 + i) / 3) ** 2
        same("wave", h, f"w{i}:a", ode(lambda t, y: [y[1], -rate * sin(y[0])], [math.radians(3), 0], h["t"])[0], 1e-5)


# ---- motions under forces -------------------------------------------------------------------------------------------------------------


def coin(folder):
    """A coin that rolls round in a circle of 0.3 m, leaning by 15 degrees: the moment of its weight turns its angular momentum."""
    m, r, lean, rho, k = 0.3, 0.05, math.radians(15), 0.3, 1e7
    across, along = m * r * r / 4, m * r * r / 2
    axis, up = np.array([cos(lean), 0, sin(lean)]), np.array([-sin(lean), 0, cos(lean)])
    centre, touch = np.array([rho, 0, 0]) + r * up, np.array([rho, 0, 0])
    z, arm = np.array([0, 0, 1.0]), touch - centre

    def steady(W):
        v = W * np.cross(z, centre)
        spin = -(v + np.cross(W * z, arm))[1] / np.cross(axis, arm)[1]  # the touching point rests
        w = W * z + spin * axis
        momentum = across * w + (along - across) * (axis @ w) * axis
        push = m * W * np.cross(z, v) + m * g * z
        return (np.cross(arm, push) - W * np.cross(z, momentum))[1], v, w

    W = brentq(lambda W: steady(W)[0], -8, -0.5)
    _, v, w = steady(W)
    turned = Rotation.from_matrix(np.column_stack([up, np.cross(axis, up), axis])).as_rotvec()
    place = centre - np.array([0, 0, m * g / k])  # pressed in by its weight
    start = f"value = {[float(x) for x in (*place, *turned)]}, rate = {[float(x) for x in (*v, *w)]}"
    text = head(4, "[0, 0, -9.81]", "tolerance = 1e-8") + rigid("coin", m, f"[{across!r}, {across!r}, {along!r}]")
    text += joint("flight", "free", "ground", "coin", f"initial = {{ {start} }}")
    more = f'shape = "cylinder"\nradius = {r}\nstiffness = {k}\ndamping = 5\nfriction = {{ coefficient = 0.7 }}'
    h = simulate(folder, "coin", text + force("contact", "coin", more) + output("p", "coin", "position"))
    same("coin", h, "p.x", centre[0] * cos(W * h["t"]), 1e-5)
    same("coin", h, "p.y", centre[0] * sin(W * h["t"]), 1e-5)
    same("coin", h, "p.z", centre[2], 1e-6)


def loose_pulley(folder):
    """An elastic cable from a hook under a loose pulley and over a ring to a weight."""
    m, M, k, c, rest = 1.5, 2.0, 5e3, 2.0, 6.3
    text = head(2) + ground("hook = [-0.1, 2, 0], ring = [0.3, 2, 0]") + rigid("pulley", M) + rigid("weight", m)
    text += joint("pulley", "prismatic", "ground", "pulley", "axis = [0, 1, 0]")
    text += joint("weight", "prismatic", "ground", "weight", "axis = [0, 1, 0]\nposition = [0.3, 0, 0]")
    more = f'from = "ground.hook"\nthrough = ["pulley", "ground.ring"]\nstiffness = {k}\ndamping = {c}\nrest = {rest}'
    text += force("cable", "weight", more) + output("p", "pulley", "value") + output("w", "weight", "value")

    def f(t, y):
        left, right = math.hypot(0.1, 2 - y[0]), math.hypot(0.3, 2 - y[0])
        lift = (2 - y[0]) / left + (2 - y[0]) / right
        longer = left + right + 2 - y[2] - rest
        pull = max(0.0, k * longer - c * (lift * y[1] + y[3])) if longer > 0 else 0.0
        return [y[1], -g + pull * lift / M, y[3], -g + pull / m]

    h = simulate(folder, "loose_pulley", text)
    y = solve_ivp(f, (0, 2), [0, 0, 0, 0], t_eval=h["t"], rtol=1e-9, atol=1e-11, max_step=1e-3).y
    same("loose_pulley", h, "p", y[0], 1e-5)
    same("loose_pulley", h, "w", y[2], 1e-5)


def sleeve(folder):
    """A sleeve thrown along its spindle while it turns: friction against the slip of both together, until it rests."""
    m, J, mu, N, r = 1.0, 0.002, 0.2, 20.0, 0.03
    text = head(0.4, "[0, 0, 0]") + rigid("sleeve", m, f"[{J}, {J}, {J}]")
    rub = f"friction = {{ coefficient = {mu}, normal_force = {N}, radius = {r} }}"
    text += joint("spindle", "cylindrical", "ground", "sleeve", f"initial = {{ rate = [1.0, 40] }}\n{rub}") + output(
        "c", "spindle", "value"
    )

    def f(t, y):
        slip = math.hypot(y[2], r * y[3])
        return [y[2], y[3], -mu * N * y[2] / slip / m, -mu * N * r * r * y[3] / slip / J] if slip > 1e-7 else [0, 0, 0, 0]

    h = simulate(folder, "sleeve", text)
    y = solve_ivp(f, (0, 0.4), [0, 0, 1, 40], t_eval=h["t"], rtol=1e-9, atol=1e-11, max_step=1e-3).y
    same("sleeve", h, "c.1", y[0], 1e-5)
    same("sleeve", h, "c.2", y[1], 1e-4)


def kepler(folder):
    """A satellite round a sun, in a plane tilted by 28 degrees: Kepler's equation."""
    mu, m, r0, v0 = 39.5, 2.0, 1.02, 7.1
    tilt = math.radians(28)
    text = head(1, "[0, 0, 0]", "tolerance = 1e-8") + rigid("satellite", m)
    start = f"value = [{r0}, 0, 0, 0, 0, 0], rate = [0, {v0 * cos(tilt)!r}, {v0 * sin(tilt)!r}, 0, 0, 0]"
    text += joint("flight", "free", "ground", "satellite", f"initial = {{ {start} }}")
    text += force("spring-damper", "satellite", 'preload = 0\nstiffness = 0\nvalue = "39.5*2/length^2"\nname = "pull"')
    h = simulate(folder, "kepler", text + output("p", "satellite", "position") + output("E", "system", "kinetic"))
    a = 1 / (2 / r0 - v0 * v0 / mu)
    e = r0 * v0 * v0 / mu - 1
    n = math.sqrt(mu / a**3)
    E = n * h["t"]
    for _ in range(60):
        E = E - (E - e * sin(E) - n * h["t"]) / (1 - e * cos(E))
    x, y = a * (cos(E) - e), a * math.sqrt(1 - e * e) * sin(E)
    same("kepler", h, "p.x", x, 1e-5)
    same("kepler", h, "p.y", y * cos(tilt), 1e-5)
    same("kepler", h, "p.z", y * sin(tilt), 1e-5)


def foucault(folder):
    """A pendulum whose hook turns at 0.5 rad/s swings on in its plane; seen from the table the plane turns back."""
    text = (
        head(4, "[0, 0, -9.81]", "tolerance = 1e-8")
        + rigid("table")
        + rigid("bob", 0.8, "[0, 0, 0]", "bob = [0, 0, -0.7]", "centre_of_mass = [0, 0, -0.7]")
    )
    text += joint("table", "revolute", "ground", "table", 'motion = "0.5*t"')
    text += joint("hook", "spherical", "table", "bob", "initial = { value = [0, -0.3, 0], rate = [0, 0, -0.5] }")
    h = simulate(folder, "foucault", text + output("p", "bob.bob", "position") + output("s", "bob.bob", "position", relative_to="table"))
    a = ode(lambda t, y: [y[1], -g / 0.7 * sin(y[0])], [0.3, 0], h["t"])[0]
    x = 0.7 * sin(a)
    same("foucault", h, "p.x", x, 1e-4)
    same("foucault", h, "p.y", 0, 1e-4)
    same("foucault", h, "s.x", x * cos(0.5 * h["t"]), 1e-4)
    same("foucault", h, "s.y", -x * sin(0.5 * h["t"]), 1e-4)


def turntable(folder):
    """A ball that rolls on a table turning at 3 rad/s goes round in circles at 2/7 of that."""
    r, m, W, v = 0.02, 0.15, 3.0, 0.3
    j = 0.4 * m * r * r
    text = (
        head(4, "[0, 0, -9.81]", "tolerance = 1e-8") + rigid("table") + joint("table", "revolute", "ground", "table", f'motion = "{W}*t"')
    )
    # Rolling at the start: v - r (w x z) = W x place.
    k = 1e5
    start = f"value = [0.2, 0, {r - m * g / k!r}, 0, 0, 0], rate = [0, {v}, 0, {(W * 0.2 - v) / r!r}, 0, 0]"
    text += rigid("ball", m, f"[{j!r}, {j!r}, {j!r}]") + joint("flight", "free", "ground", "ball", f"initial = {{ {start} }}")
    more = f'from = "table"\nshape = "sphere"\nradius = {r}\nstiffness = {k}\ndamping = 20\nfriction = {{ coefficient = 0.6 }}'
    h = simulate(folder, "turntable", text + force("contact", "ball", more) + output("p", "ball", "position"))
    w = 2 / 7 * W
    # v' = w z x v: the velocity turns, the place goes round a circle of radius v / w.
    same("turntable", h, "p.x", 0.2 + v / w * (cos(w * h["t"]) - 1), 1e-4)
    same("turntable", h, "p.y", v / w * sin(w * h["t"]), 1e-4)


def half_pipe(folder):
    """A ball rolls in a gutter: 7/5 (R - r) a'' = -g sin(a)."""
    R, r, m, k = 0.3, 0.03, 0.4, 1e6
    j = 0.4 * m * r * r
    a0 = 0.6
    place = f"[{(R - r) * sin(a0)!r}, {-(R - r) * cos(a0)!r}, 0]"
    text = (
        head(3)
        + rigid("ball", m, f"[{j!r}, {j!r}, {j!r}]")
        + joint("flight", "planar", "ground", "ball", f"initial = {{ value = {place} }}")
    )
    text += force(
        "contact",
        "ball",
        f'shape = "sphere"\nradius = {r}\nagainst = "curve"\nstiffness = {k}\ndamping = 5\nfriction = {{ coefficient = 0.5 }}\n'
        'curve = { x = "0.3*sin(u)", y = "-0.3*cos(u)", from = -1.5, to = 1.5 }',
    )
    h = simulate(folder, "half_pipe", text + output("p", "ball", "position"))
    a = ode(lambda t, y: [y[1], -5 / 7 * g / (R - r) * sin(y[0])], [a0, 0], h["t"])[0]
    same("half_pipe", h, "p.x", (R - r) * sin(a), 5e-4)


def stick_slip(folder):
    """A block on a belt, held by a spring: it goes along until the spring breaks it loose, and is caught again."""
    m, k, v, N, mus, muk = 1.5, 60.0, 0.2, 14.7, 0.5, 0.3
    text = head(5, "[0, 0, 0]") + ground("wall = [-1, 0, 0]") + rigid("belt") + rigid("block", m)
    text += joint("belt", "prismatic", "ground", "belt", f'axis = [1, 0, 0]\nmotion = "{v}*t"')
    text += joint(
        "rub",
        "prismatic",
        "belt",
        "block",
        f"axis = [1, 0, 0]\nfriction = {{ coefficient = {muk}, static_coefficient = {mus}, normal_force = {N} }}",
    )
    text += force("spring-damper", "block", f'from = "ground.wall"\nstiffness = {k}\nrest = 1') + output("x", "block", "position")
    h = simulate(folder, "stick_slip", text)
    # Sticks to x1 = mus N / k; slides as a cosine about x0 = muk N / k until its speed is the belt's again, at 2 x0 - x1.
    x1, x0, w = mus * N / k, muk * N / k, math.sqrt(k / m)
    c = x1 - x0
    slide = 2 * (pi - math.atan2(c * w, v)) / w  # c cos + v/w sin is at -c again with the speed v
    out = []
    for t in h["t"]:
        x, sticking = 0.0, x1 / v
        if t < sticking:
            out.append(v * t)
            continue
        t -= sticking
        again = 2 * c / v
        t = t % (slide + again)
        if t < slide:
            out.append(x0 + c * cos(w * t) + v / w * sin(w * t))
        else:
            out.append(x0 - c + v * (t - slide))
    same("stick_slip", h, "x.x", np.array(out), 2e-5)


def maxwell(folder):
    """A mass held by a spring and a damper one behind the other: m x'' = -k (x - y), c y' = k (x - y)."""
    m, k, c = 2.5, 340.0, 45.0
    text = head(2, "[0, 0, 0]") + rigid("m", m) + rigid("knot", 0, "[0, 0, 0]") + ground("wall = [-0.5, 0, 0]")
    text += joint("rail", "prismatic", "ground", "m", "axis = [1, 0, 0]\nposition = [0.5, 0, 0]\ninitial = { rate = 1.2 }")
    text += joint("knot", "prismatic", "ground", "knot", "axis = [1, 0, 0]")
    text += force("spring-damper", "m", f'from = "knot"\nstiffness = {k}\nrest = 0.5')
    text += force("spring-damper", "knot", f'from = "ground.wall"\ndamping = {c}')
    h = simulate(folder, "maxwell", text + output("x", "rail", "value") + output("y", "knot", "value"))
    y = ode(lambda t, y: [y[1], -k * (y[0] - y[2]) / m, k * (y[0] - y[2]) / c], [0, 1.2, 0], h["t"])
    same("maxwell", h, "x", y[0], 1e-5)
    same("maxwell", h, "y", y[2], 1e-5)


# ---- control --------------------------------------------------------------------------------------------------------------------------


def furuta(folder):
    """A pendulum on a turned arm, held upright by the state's feedback: Lagrange's equations."""
    L, l, J, m = 0.21, 0.16, 0.0023, 0.12

    def rates(y, torque):
        a, w, u = y[1], y[2], y[3]
        M = np.array([[J + m * L * L + m * l * l * sin(a) ** 2, m * L * l * cos(a)], [m * L * l * cos(a), m * l * l]])
        b = [
            torque - 2 * m * l * l * sin(a) * cos(a) * u * w + m * L * l * sin(a) * u * u,
            m * l * l * sin(a) * cos(a) * w * w + m * g * l * sin(a),
        ]
        return np.concatenate([[w, u], np.linalg.solve(M, b)])

    A, B, d = np.zeros((4, 4)), np.zeros((4, 1)), 1e-6
    for k in range(4):
        A[:, k] = (rates(d * np.eye(4)[k], 0) - rates(-d * np.eye(4)[k], 0)) / (2 * d)
    B[:, 0] = (rates(np.zeros(4), d) - rates(np.zeros(4), -d)) / (2 * d)
    K = [float(f"{v:.3g}") for v in (B.T @ solve_continuous_are(A, B, np.diag([1, 1, 0.1, 0.1]), [[50]])).ravel() / 50]
    text = head(3, "[0, 0, -9.81]", "tolerance = 1e-8") + rigid("arm", 0.2, f"[{J}, {J}, {J}]", f"end = [{L}, 0, 0]")
    text += rigid("bob", m, "[0, 0, 0]", more=f"centre_of_mass = [0, 0, {l}]")
    text += joint("motor", "revolute", "ground", "arm")
    text += joint("hinge", "revolute", "arm.end", "bob", 'axis = [-1, 0, 0]\ninitial = { value = "14 deg" }')
    for name, of in (("q", "motor"), ("a", "hinge")):
        text += output(name, of, "value") + output(f"d{name}", of, "rate")
    law = "-({}*q + {}*a + {}*dq + {}*da)".format(*K)
    text += force("torque", "arm", f'direction = [0, 0, 1]\nvalue = "{law}"')
    h = simulate(folder, "furuta", text)
    y = ode(lambda t, y: rates(y, -np.dot(K, y)), [0, math.radians(14), 0, 0], h["t"])
    same("furuta", h, "q", y[0], 1e-4)
    same("furuta", h, "a", y[1], 1e-4)
    near(y[1][-1], 0, 0.02, "furuta: it stands")


def dc_motor(folder):
    """A direct-current motor with its winding as a transfer function and a PI controller of the speed, sampled at 10 ms; a load at 1 s."""
    J, R, Lw, k, b = 0.0021, 1.4, 0.012, 0.06, 0.0003
    text = head(2, "[0, 0, 0]", "tolerance = 1e-8") + rigid("rotor", 1, f"[{J}, {J}, {J}]")
    text += joint("shaft", "revolute", "ground", "rotor", f"spring = {{ damping = {b} }}") + output("w", "shaft", "rate")
    text += '[[block]]\nname = "volts"\nkind = "pid"\ninput = "120 - w"\nproportional = 0.1\nintegral = 0.8\nsample = "10 ms"\n'
    text += f'[[block]]\nname = "amps"\nkind = "transfer-function"\ninput = "volts - {k}*w"\nnumerator = [1]\ndenominator = [{Lw}, {R}]\n'
    text += force("torque", "rotor", f'direction = [0, 0, 1]\nvalue = "{k}*amps - (t > 1 ? 0.2 : 0)"') + output("i", "amps", "output")
    h = simulate(folder, "dc_motor", text)
    # From sample to sample; the integral is taken over one period for an input that is held.
    T, state, total, w, i = 0.01, [0.0, 0.0], 0.0, [0.0], [0.0]
    for n in range(200):
        u = 0.1 * (120 - state[0]) + 0.8 * total
        total += T * (120 - state[0])
        load = 0.2 if n >= 100 else 0.0
        f = lambda t, y: [(k * y[1] - load - b * y[0]) / J, (u - k * y[0] - R * y[1]) / Lw]
        state = solve_ivp(f, (0, T), state, rtol=1e-10, atol=1e-12).y[:, -1]
        w.append(state[0])
        i.append(state[1])
    same("dc_motor", h, "w", np.array(w), 1e-3)
    same("dc_motor", h, "i", np.array(i), 1e-3)


# ---- equilibria and frequencies -------------------------------------------------------------------------------------------------------


def catenary(folder):
    """Twelve links between two hooks at rest: all pins carry one pull across, and upwards they differ by a link's weight."""
    n, l, m, span = 12, 0.1, 0.25, 0.9
    text = head(0.01, more='start = "static"') + ground(f"left = [0, 0, 0], right = [{span}, 0, 0]")
    for k in range(n):
        text += rigid(f"l{k}", m, f"[0, {m * l * l / 12!r}, {m * l * l / 12!r}]", f"end = [{l}, 0, 0]", f"centre_of_mass = [{l / 2}, 0, 0]")
        guess = 'initial = { guess = "-40 deg" }' if k == 0 else 'initial = { guess = "7 deg" }'
        text += joint(f"p{k}", "revolute", "ground.left" if k == 0 else f"l{k - 1}.end", f"l{k}", guess) + output(
            f"e{k}", f"l{k}.end", "position"
        )
    text += joint("last", "revolute", "ground.right", f"l{n - 1}.end") + output("pull", "p0", "reaction")
    h = simulate(folder, "catenary", text)
    slope = lambda H: [math.atan2(m * g * (k + 0.5 - n / 2), H) for k in range(n)]
    H = fsolve(lambda H: sum(l * cos(a) for a in slope(H[0])) - span, [5.0], xtol=1e-11)[0]
    x = np.cumsum([l * cos(a) for a in slope(H)])
    y = np.cumsum([l * sin(a) for a in slope(H)])
    for k in (0, 3, n // 2 - 1, n - 2):
        same("catenary", h, f"e{k}.x", x[k], 1e-6)
        same("catenary", h, f"e{k}.y", y[k], 1e-6)
    same("catenary", h, "pull.x", -H, 1e-4 * H)


def frequencies(folder, name, text, *words):
    written.append(name)
    scene = folder / f"{name}.toml"
    scene.write_text(text)
    found = json.loads(run("check", scene, "--json", *words).stdout)["modes"]
    return sorted(v["frequency"] for v in found if v["kind"] == "vibration")


def geared_shafts(folder):
    """Two discs on elastic shafts that a pair of gears joins: the second shaft seen from the first with the squares of the ratio."""
    J1, J2, k1, k2, n = 0.8, 0.35, 1200.0, 900.0, -2.5
    text = head(1, "[0, 0, 0]") + rigid("engine", 1, "[0.8, 0.8, 0.8]") + rigid("load", 1, "[0.35, 0.35, 0.35]")
    text += rigid("pinion", 1, "[0.02, 0.02, 0.02]") + rigid("wheel", 1, "[0.11, 0.11, 0.11]")
    text += joint("engine", "revolute", "ground", "engine") + joint(
        "first", "revolute", "engine", "pinion", f"spring = {{ stiffness = {k1} }}"
    )
    text += joint("load", "revolute", "ground", "load", "position = [0.3, 0, 0]")
    text += joint("second", "revolute", "load", "wheel", f"spring = {{ stiffness = {k2} }}")
    # Wheels that turn on shafts that turn: their own angles against the ground, by bearings.
    text += joint("b1", "revolute", "ground", "pinion") + joint("b2", "revolute", "ground", "wheel", "position = [0.3, 0, 0]")
    text += coupling("teeth", "gear", ["b1", "b2"], ratio=n)
    found = frequencies(folder, "geared_shafts", text)
    # engine, pinion (the wheel turns n times as far), load
    M = np.diag([J1, 0.02 + n * n * 0.11, J2])
    K = np.array([[k1, -k1, 0], [-k1, k1 + n * n * k2, -n * k2], [0, -n * k2, k2]])
    wanted = sorted(np.sqrt(np.abs(eigvals(K, M).real)) / 2 / pi)[1:]
    for a, b in zip(found, wanted):
        near(a, b, 1e-5 * b, "geared_shafts: a frequency")
    expect(len(found) == 2, f"geared_shafts: {found}")


def overhung(folder):
    """A disc at the end of a light shaft that turns: four whirls, by the shaft's stiffness against force and moment (Campbell)."""
    L, d, m, Jp, Jt = 0.4, 0.02, 8.0, 0.06, 0.033
    EI = 2.1e11 * pi * d**4 / 64
    text = head(1, "[0, 0, 0]") + "[parameters]\nW = 0\n"
    text += '[[body]]\nname = "shaft"\nkind = "beam"\nlength = "400 mm"\nsection = { shape = "circle", diameter = "20 mm" }\n'
    text += 'material = { density = 1, youngs_modulus = "210 GPa" }\neffects = ["bending_xy", "bending_xz", "stiffening"]\n'
    text += rigid("disc", m, f"[{Jp}, {Jt}, {Jt}]")
    text += joint("bearing", "revolute", "ground", "shaft", 'axis = [1, 0, 0]\nmotion = "W*t"') + joint("seat", "weld", "shaft.tip", "disc")
    written.append("overhung")
    (folder / "overhung.toml").write_text(text)
    run("modes", folder / "overhung.toml", "--over", "W=0:500:6", "-o", folder / "campbell")
    with open(folder / "campbell" / "overhung.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    expect((folder / "campbell" / "overhung.svg").read_text().startswith("<svg"), "overhung: no diagram")
    K = EI * np.array([[12 / L**3, -6 / L**2], [-6 / L**2, 4 / L]])
    M, G = np.diag([m, Jt]), np.diag([0, Jp])
    for W in (0.0, 100.0, 200.0, 300.0, 400.0, 500.0):
        found = sorted(float(row["frequency"]) for row in rows if float(row["W"]) == W)
        # Whirl w in the world: w^2 M - w W G - K = 0, forward w > 0. The program tells it as seen from the shaft: |w - W|.
        whole = np.block([[np.zeros((2, 2)), np.eye(2)], [np.linalg.solve(M, K), np.linalg.solve(M, W * G)]])
        wanted = sorted(abs(w - W) / 2 / pi for w in np.linalg.eigvals(whole).real)
        expect(len(found) >= 4, f"overhung at {W} rad/s: {found}")
        for a, b in zip(found, wanted):
            near(a, b, 2e-3 * b, f"overhung: a whirl at {W} rad/s, Hz")


with temporary_folder() as name:
    folder = pathlib.Path(name)
    for test in (geneva, bennett, tusi, rhombic, delta, kepler, foucault, turntable, half_pipe, stick_slip, maxwell):
        test(folder)
    for test in (furuta, dc_motor, catenary, geared_shafts, overhung, nested, belted, wave, coin, loose_pulley, sleeve):
        test(folder)
expect(len(set(written)) == 22, f"{len(set(written))} mechanisms")
finish()
