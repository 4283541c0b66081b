"""Pendulums, beads, ropes and toys: a few lines of Lagrange, or a closed formula."""
import math

import numpy as np
from cases.case import case
from cases.common import TINY, g, lagrange, out, still
from scene import Scene, force, joint, output, rigid, simulation
from scipy.optimize import brentq
from truths.formulas import ode


@case("a bead on a hoop that a motor turns: places, and what the motor has to give")
def turning_hoop():
    R, m, g = 0.3, 0.2, 9.81
    for W, start, c in ((8.0, 0.4, 0.0), (4.0, 1.2, 0.05), (12.0, 0.1, 0.02)):

        def truth(t, W=W, start=start, c=c):
            # The bead's angle from the lowest point, a damper along the wire, the hoop turning about its upright.
            y = ode(lambda _, y: [y[1], math.sin(y[0]) * (W * W * math.cos(y[0]) - g / R) - c / m * y[1]], [start, 0.0], t, rtol=1e-11)
            a, s = y[:, 0], y[:, 1]
            x, z = R * np.sin(a), -R * np.cos(a)
            torque = 2 * m * R * R * np.sin(a) * np.cos(a) * s * W
            M = np.full((len(t), 6), np.nan)
            M[:, 5] = torque
            return {"bead": np.c_[x * np.cos(W * t), x * np.sin(W * t), z], "motor": M}

        # The way along the wire is counted from u = -pi, the top.
        yield Scene(
            simulation(3.0, 100, (0, 0, -g))
            + rigid("hoop", 1.0, (0.01,) * 3)
            + rigid("bead", m, (0.0, 0.0, 0.0))
            + joint("motor", "revolute", "ground", "hoop", f'motion = "{W}*t"')
            + joint(
                "wire",
                "point-on-curve",
                "hoop",
                "bead",
                f'curve = {{ x = "{R}*sin(u)", z = "-{R}*cos(u)", y = "0", from = "-pi", to = "pi", closed = true }}\n'
                f"initial = {{ value = {R * (math.pi + start)!r} }}\nspring = {{ stiffness = 0, damping = {c} }}",
            )
            + output("bead", "bead", "position")
            + output("motor", "motor", "reaction"),
            truth,
            {},
            f"{W} rad/s from {start} rad, damper {c}",
        )


@case("a pendulum whose pivot is shaken fast stands upright (Kapitza), or does not")
def kapitza():
    L, g, c = 0.2, 9.81, 0.02
    for A, W in ((0.02, 150.0), (0.02, 60.0)):

        def f(t, y, A=A, W=W):
            return [y[1], (g - A * W * W * math.sin(W * t)) / L * math.sin(y[0]) - c / (L * L) * y[1]]

        def truth(t, f=f, A=A, W=W):
            a = ode(f, [0.3, 0.0], t)[:, 0]
            return {"tip": np.c_[-L * np.sin(a), L * np.cos(a) + A * np.sin(W * t), 0 * t]}

        yield Scene(
            simulation(2.0, 200, (0, -g, 0))
            + rigid("pivot", 1.0, (0.1,) * 3)
            + rigid("bob", 1.0, (0, 0, 0), {"pin": (0, -L, 0)})
            + joint("shaker", "prismatic", "ground", "pivot", f'axis = [0, 1, 0]\nmotion = "{A}*sin({W}*t)"')
            + joint("pin", "revolute", "pivot", "bob.pin", f"initial = {{ value = 0.3 }}\nspring = {{ stiffness = 0, damping = {c} }}")
            + output("tip", "bob", "position"),
            truth,
            {},
            f"{A * W / math.sqrt(2 * g * L):.2f} of the speed that holds it",
        )


@case("a rotary pendulum on a hub that turns freely: both angles")
def rotary_pendulum():
    r, m, l, Jh, J = 0.2, 0.1, 0.15, 3e-3, 4e-4  # J: of the pendulum across its rod, about its centre of mass; none along it
    for tilt, spin, c in ((1.0, 3.0, 0.0), (2.8, 0.0, 2e-4), (0.3, 12.0, 0.0)):
        # Hub about z; at r along its x the pendulum turns about that x, its rod down at a = 0.
        def mass(q):
            s, c_ = math.sin(q[1]), math.cos(q[1])
            return np.array([[Jh + m * r * r + (m * l * l + J) * s * s, m * r * l * c_], [m * r * l * c_, m * l * l + J]])

        def rest(q, v, _, c=c):
            s, c_ = math.sin(q[1]), math.cos(q[1])
            I = m * l * l + J
            return [-2 * I * s * c_ * v[0] * v[1] + m * r * l * s * v[1] ** 2, I * s * c_ * v[0] ** 2 - m * g * l * s - c * v[1]]

        yield Scene(
            simulation(3, 100, (0, 0, -g))
            + rigid("hub", 1.0, (2e-3, 2e-3, Jh), {"eye": (r, 0, 0)})
            + rigid("rod", m, (J, J, 0.0), centre=(0, 0, -l))
            + joint("post", "revolute", "ground", "hub", f"initial = {{ value = 0, rate = {spin} }}")
            + joint(
                "eye",
                "revolute",
                "hub.eye",
                "rod",
                f"axis = [1, 0, 0]\ninitial = {{ value = {tilt}, rate = 0 }}\nspring = {{ stiffness = 0, damping = {c} }}",
            )
            + out("hub", "post", "value")
            + out("rod", "eye", "value"),
            lambda t, tilt=tilt, spin=spin, mass=mass, rest=rest: (lambda y: {"hub": y[:, :1], "rod": y[:, 1:2]})(
                lagrange(mass, rest, [0.0, tilt, spin, 0.0], t)
            ),
            {},
            f"tilt {tilt}, spin {spin}",
        )


@case("a pendulum on a point that a motor shakes up and down fast: it stands (Kapitza), or falls")
def shaken_pivot():
    L = 0.1
    for amplitude, w, start in ((0.008, 300.0, math.pi - 0.2), (0.008, 120.0, math.pi - 0.2), (0.02, 40.0, 0.5)):
        yield Scene(
            simulation(2, 200, (0, -g, 0))
            + rigid("head", 0.5, TINY)
            + rigid("bob", 0.1, (1e-9, 1e-9, 1e-9), centre=(0, -L, 0))
            + joint("guide", "prismatic", "ground", "head", f'axis = [0, 1, 0]\nmotion = "{amplitude}*sin({w}*t)"')
            + joint("pin", "revolute", "head", "bob", f"initial = {{ value = {start!r}, rate = 0 }}")
            + out("angle", "pin", "value"),
            lambda t, a=amplitude, w=w, s=start: {
                "angle": ode(
                    lambda x, y: [y[1], -(g - a * w * w * math.sin(w * x)) * math.sin(y[0]) * 0.1 * L / (0.1 * L * L + 1e-9)],
                    [s, 0.0],
                    t,
                    rtol=1e-11,
                )[:, :1]
            },
            {},
            f"{amplitude} m at {w} rad/s",
        )


@case("two loads on a rope over a pulley on the ceiling, one of them swings (Atwood's swinging machine)")
def swinging_atwood():
    L = 1.5
    for M, m, start in ((1.1, 0.6, 0.9), (2.0, 0.8, 1.2), (0.9, 0.85, 0.3)):
        r0 = 0.7

        def f(_, y, M=M, m=m):
            r, a, v, w = y
            return [v, w, (m * r * w * w - M * g + m * g * math.cos(a)) / (M + m), (-g * math.sin(a) - 2 * v * w) / r]

        yield Scene(
            simulation(1.0, 200, (0, -g, 0))
            + rigid("bob", m, TINY)
            + rigid("weight", M, TINY)
            + joint(
                "plane",
                "planar",
                "ground",
                "bob",
                f"initial = {{ value = [{r0 * math.sin(start)!r}, {-r0 * math.cos(start)!r}, 0], rate = [0, 0, 0] }}",
            )
            + joint(
                "shaft",
                "prismatic",
                "ground",
                "weight",
                f"axis = [0, -1, 0]\nposition = [-0.4, 0, 0]\ninitial = {{ value = {L - r0}, rate = 0 }}",
            )
            + "[ground]\nframes = { eye = [0, 0, 0], other = [-0.4, 0, 0] }\n"
            + f'[[coupling]]\nname = "rope"\nkind = "rope"\nthrough = ["bob", "ground.eye"]\n'
            + f'length = {L}\nterms = [{{ joint = "shaft", factor = 1 }}]\n\n'
            + output("bob", "bob", "position")
            + out("pull", "rope", "force"),
            lambda t, f=f, m=m, M=M, s=start: (
                lambda y: {
                    "bob": np.c_[y[:, 0] * np.sin(y[:, 1]), -y[:, 0] * np.cos(y[:, 1]), 0 * t],
                    "pull": np.array([[M * (g + f(0, row)[2])] for row in y]),
                }
            )(ode(f, [r0, s, 0.0, 0.0], t, rtol=1e-11)),
            {},
            f"{M} and {m} kg",
        )


@case("a bead on a cycloid: the period does not depend on how far it swings")
def tautochrone():
    r = 0.25
    for share in (0.05, 0.4, 0.8):
        # s = 4 r sin, s'' = -g / (4 r) s from the lowest point; parameter u from -pi to pi, y = r (1 - cos u).
        s0 = share * 4 * r
        yield Scene(
            simulation(4, 100, (0, -g, 0))
            + rigid("bead", 0.3, (0, 0, 0))
            + joint(
                "wire",
                "point-on-curve",
                "ground",
                "bead",
                f'curve = {{ x = "{r}*(u + sin(u))", y = "{r}*(1 - cos(u))", from = -3.1, to = 3.1 }}\n'
                f"initial = {{ value = {4 * r * math.sin(1.55) + s0!r}, rate = 0 }}",
            )
            + out("way", "wire", "value"),
            lambda t, s0=s0: {"way": (4 * r * math.sin(1.55) + s0 * np.cos(math.sqrt(g / (4 * r)) * t))[:, None]},
            {},
            f"{share} of the way",
        )


@case("a ladder slides down between two smooth guides; a rod between two slides at a right angle")
def ladder():
    L, m = 2.0, 10.0
    for start, J in ((0.3, m * L * L / 12), (0.05, 0.3 * m * L * L)):
        # a from upright; centre at (L/2 sin, L/2 cos). (m L^2/4 + J) a'' = m g L/2 sin a. Feet's forces by Newton.
        I = m * L * L / 4 + J

        def truth(t, start=start, I=I):
            y = ode(lambda _, y: [y[1], m * g * L / 2 * math.sin(y[0]) / I], [start, 0.0], t, rtol=1e-11)
            a, w = y[:, 0], y[:, 1]
            acc = m * g * L / 2 * np.sin(a) / I
            fx = m * L / 2 * (np.cos(a) * acc - np.sin(a) * w * w)
            fy = m * g + m * L / 2 * (-np.sin(a) * acc - np.cos(a) * w * w)
            z = 0 * t
            return {
                "foot": np.c_[L * np.sin(a), z, z],
                "wall": np.c_[fx, z, z, z * np.nan, z * np.nan, z * np.nan],
                "floor": np.c_[z, fy, z, z * np.nan, z * np.nan, z * np.nan],
            }

        end = 0.9 * brentq(
            lambda T: ode(lambda _, y: [y[1], m * g * L / 2 * math.sin(y[0]) / I], [start, 0.0], np.array([0, T]))[-1, 0] - 1.5, 0.1, 3
        )
        yield Scene(
            simulation(end, 200, (0, -g, 0))
            + rigid("ladder", m, (J, 0, J), {"foot": (0, -L / 2, 0), "head": (0, L / 2, 0)})
            + rigid("shoe", 0.0, (0, 0, 0))
            + rigid("cap", 0.0, (0, 0, 0))
            + joint("floor", "prismatic", "ground", "shoe", f"axis = [1, 0, 0]\ninitial = {{ guess = {L * math.sin(start)!r} }}")
            + joint("wall", "prismatic", "ground", "cap", f"axis = [0, 1, 0]\ninitial = {{ guess = {L * math.cos(start)!r} }}")
            + joint("low", "revolute", "shoe", "ladder.foot", f"initial = {{ value = {start!r}, rate = 0 }}")
            + joint("high", "revolute", "cap", "ladder.head")
            + output("foot", "ladder.foot", "position")
            + out("wall", "wall", "reaction")
            + out("floor", "floor", "reaction"),
            truth,
            {"wall": m * g, "floor": m * g},
            f"from {start} rad",
        )


@case("a body hung on two strings side by side turns about the upright (bifilar)")
def bifilar():
    h, a, m, J = 1.0, 0.3, 2.0, 0.05
    for start in (0.1, 1.2, 2.4):
        # z of the bar: strings of length h between (+-a, 0, 0) and the bar's ends at +-a turned by p: h^2 = z^2 + 4 a^2 sin^2(p/2).
        def f(_, y):
            p, w = y
            z = math.sqrt(h * h - 4 * a * a * math.sin(p / 2) ** 2)
            dz = -a * a * math.sin(p) / z  # dz/dp
            ddz = -(a * a * math.cos(p) + dz * dz) / z
            return [w, (m * g * dz - m * dz * ddz * w * w) / (J + m * dz * dz)]

        yield Scene(
            simulation(4, 100, (0, 0, -g))
            + "[ground]\nframes = { left = [-0.3, 0, 0], right = [0.3, 0, 0] }\n"
            + rigid("bar", m, (1e-3, J, J), {"left": (-a, 0, 0), "right": (a, 0, 0)})
            + joint(
                "line",
                "cylindrical",
                "ground",
                "bar",
                f"initial = {{ value = [{-math.sqrt(h * h - 4 * a * a * math.sin(start / 2) ** 2)!r}, {start}], rate = [0, 0] }}",
            )
            + joint("one", "distance", "ground.left", "bar.left", f"length = {h}")
            + joint("two", "distance", "ground.right", "bar.right", f"length = {h}")
            + out("turn", "line", "value"),
            lambda t, f=f, s=start: (lambda y: {"turn": np.c_[-np.sqrt(h * h - 4 * a * a * np.sin(y[:, 0] / 2) ** 2), y[:, 0]]})(
                ode(f, [s, 0.0], t, rtol=1e-11)
            ),
            {},
            f"from {start} rad",
        )


@case("a yo-yo on its thread, a spool on a rack, a load that a screw lets turn: constant accelerations by hand")
def yo_yo():
    m, r, J = 0.2, 0.01, 6e-5
    a = m * g / (m + J / r**2)
    yield Scene(
        simulation(1, 100, (0, -g, 0))
        + rigid("carriage", 1e-9, TINY)
        + rigid("spool", m, (J / 2, J / 2, J))
        + joint("line", "prismatic", "ground", "carriage", "axis = [0, -1, 0]")
        + joint("axle", "revolute", "carriage", "spool")
        + f'[[coupling]]\nname = "thread"\nkind = "rack"\njoints = ["axle", "line"]\nradius = {r}\n\n'
        + out("way", "line", "value")
        + out("pull", "thread", "force"),
        lambda t: {"way": (a / 2 * t * t)[:, None], "pull": np.c_[0 * t + m * (g - a) * r, 0 * t - m * (g - a)]},
        {"pull": m * (g - a)},
        "yo-yo",
        sizes_only=True,
    )
    p, J2, M = 0.004, 3e-5, 3.0
    b = M * g / (M + J2 / p**2)
    yield Scene(
        simulation(1, 100, (0, 0, -g))
        + rigid("load", M, (J2, J2, J2))
        + joint("nut", "screw", "ground", "load", f"pitch = {p}\naxis = [0, 0, -1]")
        + output("load", "load", "position"),
        lambda t: {"load": np.c_[0 * t, 0 * t, -b / 2 * t * t]},
        {},
        "screw",
    )


@case("a trebuchet: counterweight, arm and sling, until the sling is along the arm")
def trebuchet():
    a, b, l, M, m, Ja, ma = 0.5, 2.0, 1.2, 300.0, 5.0, 20.0, 15.0

    # Arm about its pivot: the counterweight hangs on a point at -a, the sling of length l from +b with the stone.
    def mass(q):
        p, s, h = q
        A = Ja + M * a * a + m * b * b
        ps, ph = m * b * l * math.cos(p - s), -M * a * 0.4 * math.cos(p - h)
        return np.array([[A, ps, ph], [ps, m * l * l, 0], [ph, 0, M * 0.16]])

    def rest(q, v, _):
        p, s, h = q
        # Potential: y of stone b sin p + l sin s, of weight -a sin p + 0.4 sin h.
        Q = [-g * math.cos(p) * (m * b - M * a), -g * math.cos(s) * m * l, -g * math.cos(h) * M * 0.4]
        Q[0] += -m * b * l * math.sin(p - s) * v[1] ** 2 + M * a * 0.4 * math.sin(p - h) * v[2] ** 2
        Q[1] += m * b * l * math.sin(p - s) * v[0] ** 2
        Q[2] += -M * a * 0.4 * math.sin(p - h) * v[0] ** 2
        return Q

    for start in (-0.8, -0.3):
        q0 = [start, 0.1, -math.pi / 2]
        yield Scene(
            simulation(0.9, 200, (0, -g, 0))
            + rigid("arm", ma, (0.0, Ja, Ja), {"short": (-a, 0, 0), "long": (b, 0, 0)})
            + rigid("weight", M, TINY, centre=(0.4, 0, 0))
            + rigid("sling", m, TINY, centre=(l, 0, 0))
            + joint("axle", "revolute", "ground", "arm", f"initial = {{ value = {q0[0]}, rate = 0 }}")
            + joint("hook", "revolute", "arm.short", "weight", f"initial = {{ value = {q0[2] - q0[0]!r}, rate = 0 }}")
            + joint("loop", "revolute", "arm.long", "sling", f"initial = {{ value = {q0[1] - q0[0]!r}, rate = 0 }}")
            + out("axle", "axle", "value")
            + out("loop", "loop", "value"),
            lambda t, q0=q0: (lambda y: {"axle": y[:, :1], "loop": y[:, 1:2] - y[:, :1]})(lagrange(mass, rest, [*q0, 0.0, 0.0, 0.0], t)),
            {},
            f"from {start} rad",
        )


@case("a lamp on a chain of bars that hangs between two points: where the pins rest (links of equal length)")
def hanging_links():
    from scipy.optimize import fsolve

    n, l, m, span = 5, 0.3, 0.4, 1.0
    for load in (0.0, 3.0):

        def balance(x):
            # Unknown: horizontal pull H, vertical force at the left; angle of each link from its forces.
            H, V = x
            X = Y = 0.0
            v = V
            for i in range(n):
                # A uniform link's line: moments about its end: tan = (v - m g / 2) / H.
                a = math.atan2(v - m * g / 2, H)
                X, Y = X + l * math.cos(a), Y - l * math.sin(a)
                v -= m * g + (load * g if i == 1 else 0.0)
            return [X - span, Y]

        H, V = fsolve(balance, [5.0, n * m * g / 2 + load * g * 0.6], xtol=1e-13)
        places, X, Y, v = [], 0.0, 0.0, V
        for i in range(n):
            a = math.atan2(v - m * g / 2, H)
            X, Y = X + l * math.cos(a), Y - l * math.sin(a)
            places.append((X, Y))
            v -= m * g + (load * g if i == 1 else 0.0)
        text = simulation(0.01, 200, (0, -g, 0), start="static") + f"[ground]\nframes = {{ far = [{span}, 0, 0] }}\n"
        for i in range(n):
            text += rigid(f"l{i}", m, (0.0, m * l * l / 12, m * l * l / 12), {"end": (l, 0, 0)}, centre=(l / 2, 0, 0))
        guess = [-0.9, -0.5, 0.0, 0.5, 0.9]
        for i in range(n):
            turn = guess[i] - (guess[i - 1] if i else 0.0)
            text += joint(f"j{i}", "revolute", "ground" if i == 0 else f"l{i - 1}.end", f"l{i}", f"initial = {{ guess = {turn} }}")
        text += joint("last", "revolute", "ground.far", f"l{n - 1}.end")
        if load:
            text += force("force", "l1.end", load * g, (0, -1, 0))
        text += "".join(output(f"p{i}", f"l{i}.end", "position") for i in range(n - 1)) + out("last", "last", "reaction")
        yield Scene(
            text,
            still(**{f"p{i}": [*places[i], 0] for i in range(n - 1)}, last=[H, -v, 0, np.nan, np.nan, np.nan]),
            {**{f"p{i}": l for i in range(n - 1)}, "last": H},
            f"load {load} kg",
            sizes_only=True,
        )
