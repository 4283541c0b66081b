"""Features that nobody combined: wires and platforms that move, joints that slide on what turns, loads seen from machines that turn."""
import math

import numpy as np
from plain_case import Modes, case
from plain_effects import E, G, RHO, STEEL, circle, still
from plain_third import out
from scene import Scene, beam, force, joint, output, rigid, simulation, spring, weld
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from truths import ode


@case("stress near the tip of round consoles, where the shear force and a torque make it: Saint-Venant, both rims")
def shear_in_round_sections():
    L, F, T = 1.0, 3.0, 0.02
    for D, d, poisson, at in ((0.05, 0.0, 0.3, 0.97), (0.05, 0.036, 0.3, 0.97), (0.05, 0.036, 0.0, 0.99), (0.05, 0.046, 0.3, 0.6)):
        R, r, A, I = D / 2, d / 2, math.pi * (D * D - d * d) / 4, math.pi * (D**4 - d**4) / 64
        text = f'{{ shape = "tube", outer_diameter = {D}, thickness = {(D - d) / 2!r} }}'
        if not d:
            text = f'{{ shape = "circle", diameter = {D} }}'
        worst = 0.0
        for near, far in ((R, r), (r, R)) if d else ((R, 0.0),):
            flank = F / (4 * (1 + poisson) * I) * ((1 + 2 * poisson) * near**2 + (3 + 2 * poisson) * far**2)
            for a in np.linspace(0, 2 * math.pi, 721):
                sigma = F * L * (1 - at) * near / I * math.cos(a)
                worst = max(worst, math.hypot(sigma, math.sqrt(3) * (T * near / (2 * I) + flank * math.sin(a))))
        if not d:
            worst = max(worst, math.sqrt(3) * F / A * (3 + 2 * poisson) / (2 * (1 + poisson)))
        yield Scene(
            simulation(0.01, 100, start="static")
            + beam("rod", L, text, {**STEEL, "poisson": poisson})
            + weld("wall", "ground", "rod")
            + force("force", "rod.tip", F, (0, 1, 0))
            + force("torque", "rod.tip", T, (1, 0, 0))
            + out("s", "rod", "stress", f"at = {at}"),
            still(s=[worst]),
            {"s": worst},
            f"bore {d}, at {at}",
        )


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


@case("a ball drops on a platform that is shaken up and down, linear contact with damping")
def shaken_platform():
    m, k, D, g, radius = 0.5, 2e4, 0.2, 9.81, 0.05
    for A, W, tolerance in ((0.01, 25.0, 1e-6), (0.02, 40.0, 1e-7)):

        def truth(t, A=A, W=W):
            p, v = (lambda s: A * math.sin(W * s)), (lambda s: A * W * math.cos(W * s))

            def f(s, y, mode):
                d, rate = p(s) + radius - y[0], v(s) - y[1]
                return [y[1], -g + (max(0.0, k * d * (1 + D * rate)) / m if mode else 0.0)]

            return {"ball": bouncing(f, p, radius, [0.25, 0.0], t)}

        yield Scene(
            simulation(1.2, 200, (0, 0, -g), tolerance=tolerance)
            + rigid("table", 3.0, (0.1,) * 3)
            + rigid("ball", m, (2 / 5 * m * radius**2,) * 3)
            + joint("shaker", "prismatic", "ground", "table", f'axis = [0, 0, 1]\nmotion = "{A}*sin({W}*t)"')
            + joint("way", "prismatic", "ground", "ball", "axis = [0, 0, 1]\ninitial = { value = 0.25 }")
            + '[[force]]\nkind = "contact"\non = "ball"\nfrom = "table"\nshape = "sphere"\n'
            + f"radius = {radius}\nstiffness = {k}\ndamping = {D}\n\n"
            + output("ball", "way", "value"),
            truth,
            {},
            f"{A * W * W / g:.1f} g",
        )


def bouncing(f, p, radius, y0, times):
    """Free flight and contact by turns, told by the gap; the damped force never pulls, so that it ends with the gap at the latest."""
    values, t, y, mode = np.empty((len(times), 1)), 0.0, list(y0), 0
    while t < times[-1]:

        def gap(s, y):
            return y[0] - radius - p(s)

        gap.terminal, gap.direction = True, 1 if mode else -1
        part = solve_ivp(lambda s, y: f(s, y, mode), (t, times[-1]), y, rtol=1e-11, atol=1e-14, events=gap, dense_output=True)
        inside = (times >= t) & (times <= part.t[-1])
        values[inside, 0] = part.sol(times[inside])[0]
        t, y, mode = part.t[-1], part.y[:, -1], 1 - mode
    return values


@case("a mass on an elastic string in wind: spring with rest length, drag, in space")
def string_in_wind():
    k, rest, m, g = 80.0, 0.6, 0.3, 9.81
    for wind, start in (((6.0, 2.0, 0.0), (0.0, 0.0, -0.7)), ((-3.0, 8.0, 1.0), (0.5, -0.3, -0.4))):

        def f(_, y, w=np.array(wind)):
            r, v = y[:3], y[3:]
            length, past = np.linalg.norm(r), v - w
            F = -k * (length - rest) * r / length - (0.05 + 0.02 * np.linalg.norm(past)) * past
            return [*v, *(F / m + [0, 0, -g])]

        yield Scene(
            simulation(4.0, 100, (0, 0, -g))
            + rigid("ball", m, (1e-3,) * 3)
            + joint("free", "free", "ground", "ball", f"initial = {{ value = {[*start, 0, 0, 0]} }}")
            + spring("ball", "ground", k, 0.0, rest)
            + f'[[force]]\nkind = "drag"\non = "ball"\nlinear = 0.05\nquadratic = 0.02\nwind = {list(wind)}\n\n'
            + output("ball", "ball", "position"),
            lambda t, f=f, start=start: {"ball": ode(f, [*start, 0, 0, 0], t)[:, :3]},
            {},
            f"wind {wind}",
        )


@case("a throw seen from a wheel that turns ever faster: place, velocity and distance in its axes")
def seen_from_a_wheel():
    a, v, g = 3.0, np.array([2.0, 1.0, 4.0]), np.array([0, 0, -9.81])

    def truth(t):
        phi, W = a * t * t / 2, a * t
        p, q = np.outer(t, v) + np.outer(t * t / 2, g), v + np.outer(t, g)
        rim = np.c_[np.cos(phi), np.sin(phi), 0 * t]
        d = p - rim
        rate = q - W[:, None] * np.c_[-rim[:, 1], rim[:, 0], 0 * t]
        # Seen from the wheel: the rate of the place in its axes.
        seen = rate - np.c_[-W * d[:, 1], W * d[:, 0], 0 * t]
        turn = lambda x: np.c_[np.cos(phi) * x[:, 0] + np.sin(phi) * x[:, 1], np.cos(phi) * x[:, 1] - np.sin(phi) * x[:, 0], x[:, 2]]
        length = np.linalg.norm(d, axis=1)
        return {
            "p": turn(d),
            "v": turn(seen),
            "far": length[:, None],
            "rate": ((d * rate).sum(axis=1) / length)[:, None],
        }

    yield Scene(
        simulation(1.5, 100, g)
        + rigid("wheel", 5.0, (1.0,) * 3, {"rim": (1, 0, 0)})
        + rigid("ball", 0.1, (1e-4,) * 3)
        + joint("axle", "revolute", "ground", "wheel", f'motion = "{a / 2}*t^2"')
        + joint("free", "free", "ground", "ball", f"initial = {{ rate = {[*map(float, v), 0, 0, 0]} }}")
        + out("p", "ball", "position", 'relative_to = "wheel.rim"')
        + out("v", "ball", "velocity", 'relative_to = "wheel.rim"')
        + out("far", "ball", "distance", 'relative_to = "wheel.rim"')
        + out("rate", "ball", "distance_rate", 'relative_to = "wheel.rim"'),
        truth,
        {},
        "3 rad/s^2",
    )


@case("a satellite that spins draws its booms in: spin by the angular momentum, force of the drives")
def booms():
    J, m, W = 2.0, 0.5, 3.0
    r = lambda t: 1.0 - 0.35 * (1 - np.cos(math.pi * t / 2))
    a = lambda t: -0.35 * (math.pi / 2) ** 2 * np.cos(math.pi * t / 2)

    def truth(t):
        w = (J + 2 * m) * W / (J + 2 * m * r(t) ** 2)
        R = np.full((len(t), 6), np.nan)
        R[:, 0] = m * (a(t) - w**2 * r(t))  # along the boom, in its axes
        return {"w": np.c_[0 * t, 0 * t, w], "drive": R}

    motion = 'motion = "1 - 0.35*(1 - cos(pi*t/2))"'
    yield Scene(
        simulation(4.0, 100)
        + rigid("hub", 20.0, (1.0, 1.0, J))
        + rigid("a", m, (0, 0, 0))
        + rigid("b", m, (0, 0, 0))
        + joint("free", "free", "ground", "hub", f"initial = {{ rate = [0, 0, 0, 0, 0, {W}] }}")
        + joint("left", "prismatic", "hub", "a", f"axis = [1, 0, 0]\n{motion}")
        + joint("right", "prismatic", "hub", "b", f"axis = [-1, 0, 0]\n{motion}")
        + output("w", "hub", "angular_velocity")
        + out("drive", "left", "reaction", 'frame = "parent"'),
        truth,
        {},
        "two booms",
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


@case("stick and slip on a belt that slows down: dry friction on what is driven")
def belt_that_slows():
    m, k, mu, stick, N = 1.0, 50.0, 0.3, 0.45, 10.0
    belt = lambda t: 0.25 - 0.04 * t

    def f(t, y, mode):
        return [y[1], (-k * y[0] + mode * mu * N) / m] if mode else [belt(t), -0.04]

    def events(mode):
        if not mode:
            # On the belt, which slows down by itself: k x + m a is what friction has to give.
            return [(lambda t, y: stick * N - abs(k * y[0] - 0.04 * m), -1, lambda y: (1 if k * y[0] > 0 else -1, y))]
        return [(lambda t, y, s=mode: s * (belt(t) - y[1]), -1, lambda y: (0, y))]

    def truth(t):
        now, y, mode = 0.0, [0.0, belt(0.0)], 0
        values = np.empty((len(t), 1))
        while now < t[-1]:
            test, direction, then = events(mode)[0]
            test.terminal, test.direction = True, direction
            first = min(t[-1], now + 1e-9)  # off the event where it stands
            y = np.array(y) + (first - now) * np.array(f(now, y, mode))
            part = solve_ivp(lambda s, y, m=mode: f(s, y, m), (first, t[-1]), y, rtol=1e-11, atol=1e-13, events=test, dense_output=True)
            inside = (t >= now) & (t <= part.t[-1])
            values[inside, 0] = part.sol(t[inside])[0]
            now, y = part.t[-1], part.y[:, -1]
            mode, y = then(y)
        return {"x": values}

    yield Scene(
        simulation(5.0, 100)
        + rigid("belt", 1.0, (0.1,) * 3)
        + rigid("block", m, (0.1,) * 3)
        + joint("drive", "prismatic", "ground", "belt", 'axis = [1, 0, 0]\nmotion = "0.25*t - 0.02*t^2"')
        + joint(
            "slip",
            "prismatic",
            "belt",
            "block",
            f"axis = [1, 0, 0]\nfriction = {{ coefficient = {mu}, static_coefficient = {stick}, normal_force = {N} }}",
        )
        + spring("block", "ground", k)
        + output("x", "block", "position"),
        lambda t: {"x": np.c_[truth(t)["x"], np.full((len(t), 2), np.nan)]},
        {},
        "spring to the ground",
    )


@case("a console on a hinge with a torsion spring, a disc at its tip: deflection and poles")
def sprung_root():
    s, A, I = circle(0.02)
    L, k, m, J, F = 0.8, 900.0, 0.6, 0.01, 20.0
    body = (
        beam("rod", L, s, STEEL)
        + joint("root", "revolute", "ground", "rod", f"spring = {{ stiffness = {k} }}")
        + rigid("disc", m, (J,) * 3)
        + weld("w", "rod.tip", "disc")
    )
    down = F * L**3 / (3 * E * I) + F * L / (6 / 7 * G * A) + F * L * L / k
    yield Scene(
        simulation(0.01, 100, start="static") + body + force("force", "rod.tip", F, (0, 1, 0)) + output("tip", "rod.tip", "position"),
        still(tip=[np.nan, down, np.nan]),
        {"tip": down},
        "at rest",
    )

    # w = a cos + b sin + c cosh + d sinh; w(0) = 0, EI w'' = k w' at the root; at the tip EI w''' = -m w^2 w, EI w'' = J w^2 w'.
    def condition(x):
        b = x / L
        w2 = E * I * b**4 / (RHO * A)
        c, sn, ch, sh = math.cos(x), math.sin(x), math.cosh(x), math.sinh(x)
        rows = np.array(
            [
                [1, 0, 1, 0],
                [-E * I * b * b, -k * b, E * I * b * b, -k * b],
                np.array([sn, -c, sh, ch]) * E * I * b**3 + m * w2 * np.array([c, sn, ch, sh]),
                np.array([-c, -sn, ch, sh]) * E * I * b * b - J * w2 * b * np.array([-sn, c, sh, ch]),
            ]
        )
        return np.linalg.det(rows / np.linalg.norm(rows, axis=1)[:, None])

    grid = np.linspace(0.05, 5, 2000)
    roots = [brentq(condition, a, b) for a, b in zip(grid, grid[1:]) if condition(a) * condition(b) < 0][:2]
    yield Modes(
        simulation(1.0, 100) + body.replace('\n\n[[joint]]\nname = "root"', '\neffects = ["bending_xy"]\n\n[[joint]]\nname = "root"', 1),
        tuple(complex(0, (x / L) ** 2 * math.sqrt(E * I / (RHO * A))) for x in roots),
        "poles",
    )


@case("a crank slides a block by a linear coupling, a rack winds a rope, a screw lifts: accelerations by hand")
def coupled_by_hand():
    g = 9.81
    # A drum of radius r under a motor torque lifts m by a rope coupling of rack and a counterweight on the other side.
    r, J, m, c, T = 0.1, 0.05, 3.0, 2.0, 4.0
    a = (T - (m - c) * g * r) / (J + (m + c) * r * r)
    yield Scene(
        simulation(1.0, 100, (0, 0, -g))
        + rigid("drum", 1.0, (J,) * 3)
        + rigid("load", m, (0.1,) * 3)
        + rigid("weight", c, (0.1,) * 3)
        + joint("axle", "revolute", "ground", "drum", "axis = [0, 1, 0]")
        + joint("up", "prismatic", "ground", "load", "axis = [0, 0, 1]")
        + joint("down", "prismatic", "ground", "weight", "axis = [0, 0, 1]\nposition = [1, 0, 0]")
        + f'[[coupling]]\nname = "one"\nkind = "rack"\njoints = ["axle", "up"]\nradius = {r}\n\n'
        + f'[[coupling]]\nname = "two"\nkind = "rack"\njoints = ["axle", "down"]\nradius = {-r}\n\n'
        + force("torque", "drum", T, (0, 1, 0))
        + output("turn", "axle", "value")
        + output("pull", "one", "force"),
        lambda t, a=a, pull=m * (g + r * a): {"turn": (a * t * t / 2)[:, None], "pull": np.tile([-r * pull, pull], (len(t), 1))},
        {"pull": m * g},
        "drum, load and counterweight",
    )
    # A screw joint whose nut carries a load, turned by a torque against dry friction in a guide.
    p, J, m, T, N, mu = 0.01, 0.02, 5.0, 1.2, 40.0, 0.2
    a = (T - m * g * p - mu * N * p) / (J + m * p * p)
    yield Scene(
        simulation(1.0, 100, (0, 0, -g))
        + rigid("screw", m, (J,) * 3)
        + rigid("sleeve", 0.0, (0, 0, 0))
        + joint("thread", "screw", "ground", "screw", f"axis = [0, 0, 1]\npitch = {p}")
        + joint("turns", "revolute", "screw", "sleeve", "axis = [0, 0, 1]")
        + joint("guide", "prismatic", "ground", "sleeve", f"axis = [0, 0, 1]\nfriction = {{ coefficient = {mu}, normal_force = {N} }}")
        + force("torque", "screw", T, (0, 0, 1))
        + output("way", "screw", "position"),
        lambda t, a=a: {"way": np.c_[np.full((len(t), 2), np.nan), p * a * t * t / 2]},
        {},
        "screw, guide with friction",
    )


@case("a wheel out of balance on an elastic console, turned steadily: the answer of its first mode, from rest")
def unbalanced_on_console():
    s, A, I = circle(0.02)
    L, m, e, me = 0.5, 2.0, 0.01, 0.05
    light = {"E": E, "rho": 1e-2, "poisson": 0.3}
    K = 3 * E * I / L**3
    w0 = math.sqrt(K / (m + me))
    for share in (0.4, 0.9):
        W = share * w0
        # A point mass me turns at the radius e about the tip: y'' + w0^2 y = me e W^2 sin(W t) / (m + me), its rate at t = 0 kept.

        def truth(t, W=W):
            amp = me * e * W * W / (m + me) / (w0 * w0 - W * W)
            return {"y": np.c_[np.full(len(t), np.nan), amp * (np.sin(W * t) - W / w0 * np.sin(w0 * t)), np.full(len(t), np.nan)]}

        yield Scene(
            simulation(40 / w0 * 2, 2.0 * w0)
            + beam("rod", L, s, light, 'effects = ["bending_xy"]')
            + weld("wall", "ground", "rod")
            + rigid("housing", m, (1e-9,) * 3)
            + weld("w", "rod.tip", "housing")
            + rigid("eccentric", me, (0, 0, 0), centre=(e, 0, 0))
            + joint("axle", "revolute", "housing", "eccentric", f'motion = "{W!r}*t"')
            + output("y", "rod.tip", "displacement"),
            truth,
            {},
            f"{share} of its frequency",
            claim=0.03,
        )
