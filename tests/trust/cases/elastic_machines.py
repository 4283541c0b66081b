"""Machines of elastic and rigid parts: drives, gears, rotors, hammers."""
import math

import numpy as np
from cases.case import case
from cases.common import E, G, RHO, STEEL, circle, g, lagrange, out
from scene import Scene, beam, force, joint, output, rigid, simulation, weld
from scipy.linalg import eigh
from truths.formulas import Linear, beam_matrices, ode, rod_matrices


def held_modes(M, K, count):
    """Squares of the frequencies and mass-normalised shapes of the lowest modes."""
    squares, V = eigh(K, M)
    return squares[:count], V[:, :count]


@case("a ball falls on the middle of a beam between two hinges (Hertz): both move; all elements, more of them, few modes")
def ball_on_beam():
    s, A, I = circle(0.02)
    L, m, k, g, high = 1.0, 0.05, 1e7, 9.81, 0.02
    b = np.arange(1, 40, 2) * math.pi / L
    # Timoshenko's beam between hinges, whose waves are sines: w'' and the section's turn, the lower root.
    kGA, rI = 6 / 7 * G * A, RHO * I
    p, q = RHO * A * (E * I * b**2 + kGA) + rI * kGA * b**2, kGA * b**2 * (E * I * b**2)
    w2 = 2 * q / (p + np.sqrt(p * p - 4 * RHO * A * rI * q))
    turn = b - RHO * A * w2 / (kGA * b)
    at = np.sin(b * L / 2) / np.sqrt((RHO * A + rI * turn**2) * L / 2)

    followed = []  # the same for all
    for words in ("", "keep_modes = 4", "elements = 20"):

        def f(t, y):
            n = len(w2)
            q, v, z, vz = y[:n], y[n : 2 * n], y[2 * n], y[2 * n + 1]
            d = at @ q - (z - 0.01)
            F = k * max(d, 0.0) ** 1.5
            return np.r_[v, -w2 * q - at * F, vz, F / m - g]

        def truth(t):
            n = len(w2)
            if not followed:
                followed.append(ode(f, np.r_[np.zeros(2 * n), 0.01 + high, 0.0], t, rtol=1e-9, atol=1e-13, max_step=5e-5))
            y = followed[0]
            return {"ball": y[:, 2 * n : 2 * n + 1], "mid": np.c_[np.nan * t, y[:, :n] @ at, np.nan * t]}

        yield Scene(
            simulation(0.1, 2000)
            + beam("rod", L, s, STEEL, "frames = { middle = 0.5 }\n" + words)
            + joint("a", "revolute", "ground", "rod")
            + joint("b", "point-on-line", "ground", "rod.tip", "axis = [1, 0, 0]\nposition = [1, 0, 0]")
            + rigid("ball", m, (1e-5,) * 3)
            + joint(
                "fall", "prismatic", "ground", "ball", f"axis = [0, 1, 0]\nposition = [0.5, 0, 0]\ninitial = {{ value = {0.01 + high} }}"
            )
            + force("force", "ball", -m * g, (0, 1, 0))
            + f'[[force]]\nkind = "contact"\non = "ball"\nfrom = "rod.middle"\nshape = "sphere"\nradius = 0.01\n'
            + f"normal = [0, 1, 0]\nstiffness = {k}\nexponent = 1.5\n\n"
            + output("ball", "fall", "value")
            + output("mid", "rod.middle", "displacement"),
            truth,
            {},
            words or "as it comes",
        )


@case("a mast with a guy rope that slackens and tightens, pushed at its top; a screw that runs against its stop")
def guys_and_screws():
    s, A, I = circle(0.02)
    L, F, k, w = 1.0, 80.0, 2e4, 60.0
    M, K = beam_matrices(L, E * I, RHO * A, 12)
    squares, V = held_modes(M, K, 8)
    tip = V[-2]
    far = 2.0
    length = far

    def f(t, y):
        v = tip @ y[:8]
        n = far + v
        pull = k * max(n - length, 0.0)
        return np.r_[y[8:], tip * (F * math.sin(w * t) - pull * (far + v) / n) - squares * y[:8]]

    yield Scene(
        simulation(0.5, 1000)
        + f"[ground]\nframes = {{ peg = [{L}, {far}, 0] }}\n\n"
        + beam("mast", L, s, STEEL)
        + weld("foot", "ground", "mast")
        + force("force", "mast.tip", f"{F}*sin({w}*t)", (0, -1, 0))
        + f'[[force]]\nkind = "cable"\non = "mast.tip"\nfrom = "ground.peg"\nstiffness = {k}\nrest = {length!r}\n\n'
        + output("tip", "mast.tip", "displacement"),
        lambda t: {"tip": np.c_[np.nan * t, -ode(f, np.zeros(16), t, rtol=1e-9, atol=1e-13, max_step=1e-4)[:, :8] @ tip, np.nan * t]},
        {},
        "guyed mast",
    )
    m, J, p, T, ks, c = 4.0, 0.01, 0.004, 2.0, 2e6, 500.0

    def screw(t, y):
        z = p * y[0]
        stop = ks * (z - 0.02) + c * p * y[1] if z > 0.02 else 0.0
        stop = max(stop, 0.0) if z > 0.02 else 0.0
        return [y[1], (T * math.cos(5 * t) - stop * p) / (J + m * p * p)]

    yield Scene(
        simulation(1.5, 500)
        + rigid("nut", m, (J, J, J))
        + rigid("plate", 1e-9, (0,) * 3).replace("inertia = [0.0, 0.0, 0.0]\n", "")
        + joint("screw", "screw", "ground", "nut", f"axis = [0, 0, 1]\npitch = {p}")
        + joint("slide", "prismatic", "ground", "plate", f"axis = [0, 0, 1]\nstop = {{ upper = 0.02, stiffness = {ks}, damping = {c} }}")
        + f'[[coupling]]\nname = "rides"\nkind = "screw"\njoints = ["screw", "slide"]\npitch = {p}\n\n'
        + force("torque", "nut", f"{T}*cos(5*t)", (0, 0, 1))
        + output("a", "screw", "value"),
        lambda t: {"a": ode(screw, [0.0, 0.0], t, rtol=1e-10, atol=1e-12, max_step=1e-3)[:, :1]},
        {},
        "screw with a stop on its slide",
    )


@case("a valve rod driven by a cam: the elastic rod and its spring answer the lift; section forces of a shaken console")
def driven_elastics():
    s, A, I = circle(0.008)
    L, m, k, W, lift = 0.3, 0.1, 3e4, 60.0, 0.004
    M, K = rod_matrices(L, E * A, RHO * A, 30, tip_mass=m)
    K[-1, -1] += k
    ones = np.ones(len(M))
    z = lambda t, W=W: lift * (1 - np.cos(W * t)) / 2
    zdd = lambda t, W=W: lift * W * W / 2 * np.cos(W * t)

    def push(t, L=L, M=M, K=K, ones=ones):
        rel = Linear(M, K).respond(-(M @ ones), zdd, t, fine=4000) + Linear(M, K).respond(-k * np.eye(len(M))[-1], z, t, fine=4000)
        return {"tip": np.c_[rel[:, -1] + z(t) + L, 0 * t, 0 * t], "F": (k * (rel[:, -1:] + z(t)[:, None]))}

    yield Scene(
        simulation(0.3, 1000)
        + rigid("cam", 1.0, (1e-3,) * 3)
        + rigid("foot", 0.01, (1e-6,) * 3)
        + rigid("plate", m, (1e-6,) * 3)
        + joint("shaft", "revolute", "ground", "cam", f'position = [0, -0.2, 0]\nmotion = "{W}*t"')
        + joint("slide", "prismatic", "ground", "foot", "axis = [1, 0, 0]")
        + f'[[coupling]]\nname = "lobe"\nkind = "cam"\njoints = ["shaft", "slide"]\nlift = "{lift}*(1 - cos(angle))/2"\n\n'
        + beam("rod", L, s, STEEL)
        + weld("a", "foot", "rod")
        + weld("b", "rod.tip", "plate")
        + f'[[force]]\nname = "spring"\nkind = "bushing"\non = "plate"\nfrom = "ground.seat"\nstiffness = [{k}, 0, 0, 0, 0, 0]\n'
        + f"damping = [0, 0, 0, 0, 0, 0]\n\n[ground]\nframes = {{ seat = [{L}, 0, 0] }}\n\n"
        + output("tip", "plate", "position"),
        lambda t: {"tip": push(t)["tip"]},
        {},
        "valve rod",
    )
    s, A, I = circle(0.02)
    L, W, a0 = 1.0, 70.0, 20.0
    M, K = beam_matrices(L, E * I, RHO * A, 16)
    ones = np.zeros(len(M))
    ones[::2] = 1
    acc = lambda t: a0 * np.sin(W * t) ** 2
    full_M, full_K = beam_matrices(L, E * I, RHO * A, 16)

    def shaken(t):
        rel = Linear(M, K).respond(-(M @ ones), acc, t, fine=4000)
        # Root moment by the first element's end: E I v''.
        h = L / 16
        v1, s1 = rel[:, 0], rel[:, 1]
        return {"S": np.c_[np.nan * t, np.nan * t, np.nan * t, np.nan * t, np.nan * t, E * I * (6 * v1 - 2 * h * s1) / h**2]}

    yield Scene(
        simulation(0.5, 1000)
        + rigid("base", 1.0, (1,) * 3)
        + joint("j", "prismatic", "ground", "base", f'axis = [0, 1, 0]\nmotion = "{a0 / 2}*(t^2/2 - (1 - cos({2 * W}*t))/{4 * W * W})"')
        + beam("rod", L, s, STEEL)
        + weld("foot", "base", "rod")
        + out("S", "rod", "section_force", "at = 0"),
        shaken,
        {},
        "root moment of a shaken console",
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


@case("three discs on two elastic shafts, driven by a torque that comes and goes: numbers of the chain by hand")
def torsional_chain():
    d, L = 0.02, 0.4
    K = G * math.pi * d**4 / 32 / L
    J = np.array([0.02, 0.05, 0.03])
    for T, w in ((10.0, 60.0), (10.0, 300.0)):

        def f(t, y, T=T, w=w):
            q, v = y[:3], y[3:]
            m = K * np.array([q[1] - q[0], q[0] - 2 * q[1] + q[2], q[1] - q[2]])
            m[0] += T * math.sin(w * t)
            return np.r_[v, m / (J + Jb)]

        rho = 1.0  # shafts of next to no mass
        Jb = rho * math.pi * d**4 / 32 * L * np.array([1 / 3, 2 / 3, 1 / 3])
        shaft = lambda n: beam(n, L, circle(d)[0], {**STEEL, "rho": rho})
        yield Scene(
            simulation(0.4, 500)
            + "".join(rigid(f"d{i}", 1.0, (j, j, j)) for i, j in enumerate(J))
            + shaft("one")
            + shaft("two")
            + joint("bearing", "revolute", "ground", "d0", "axis = [1, 0, 0]")
            + weld("a", "d0", "one.root")
            + weld("b", "one.tip", "d1")
            + weld("c", "d1", "two.root")
            + weld("d", "two.tip", "d2")
            + force("torque", "d0", f"{T}*sin({w}*t)", (1, 0, 0))
            + output("spin0", "d0", "angular_velocity")
            + output("spin2", "d2", "angular_velocity"),
            lambda t, f=f: (lambda y: {"spin0": np.c_[y[:, 3], 0 * t, 0 * t], "spin2": np.c_[y[:, 5], 0 * t, 0 * t]})(ode(f, [0.0] * 6, t)),
            {},
            f"{w} rad/s",
        )


@case("a robot of two links on springy gears: its motors hold a course by proportional and derivative action")
def elastic_gears():
    l, m, J, k, d = 0.5, 2.0, 0.05, 400.0, 1.0

    def mass(q):
        c = math.cos(q[1])
        A = J + m * l * l / 4
        return np.array(
            [
                [A + J + m * (l * l + l * l / 4 + l * l * c), J + m * (l * l / 4 + l * l / 2 * c)],
                [J + m * (l * l / 4 + l * l / 2 * c), J + m * l * l / 4],
            ]
        )

    for a, w in ((0.8, 3.0), (0.3, 12.0)):

        def rest(q, v, t, a=a, w=w):
            s = math.sin(q[1])
            h = m * l * l / 2 * s
            G_ = [
                m * g * l / 2 * math.cos(q[0]) + m * g * (l * math.cos(q[0]) + l / 2 * math.cos(q[0] + q[1])),
                m * g * l / 2 * math.cos(q[0] + q[1]),
            ]
            wish, speed = a * math.sin(w * t), a * w * math.cos(w * t)
            u = [k * (wish - q[0]) + 20 * (speed - v[0]), k * (-wish - q[1]) + 20 * (-speed - v[1])]
            return [u[0] - G_[0] + h * (2 * v[0] * v[1] + v[1] ** 2) - d * v[0], u[1] - G_[1] - h * v[0] ** 2 - d * v[1]]

        yield Scene(
            simulation(3, 200, (0, -g, 0))
            + rigid("one", m, (J, J, J), {"elbow": (l, 0, 0)}, centre=(l / 2, 0, 0))
            + rigid("two", m, (J, J, J), {"hand": (l, 0, 0)}, centre=(l / 2, 0, 0))
            + joint("shoulder", "revolute", "ground", "one", f"initial = {{ value = 0, rate = 0 }}\nspring = {{ damping = {d} }}")
            + joint("elbow", "revolute", "one.elbow", "two", f"initial = {{ value = 0, rate = 0 }}\nspring = {{ damping = {d} }}")
            + out("q1", "shoulder", "value")
            + out("v1", "shoulder", "rate")
            + out("q2", "elbow", "value")
            + out("v2", "elbow", "rate")
            + f'[[block]]\nname = "c1"\nkind = "pid"\n'
            + f'input = "{a}*sin({w}*t) - q1"\nrate = "{a * w}*cos({w}*t) - v1"\nproportional = {k}\nintegral = 0\nderivative = 20\n\n'
            + f'[[block]]\nname = "c2"\nkind = "pid"\n'
            + f'input = "-{a}*sin({w}*t) - q2"\nrate = "-{a * w}*cos({w}*t) - v2"\nproportional = {k}\nintegral = 0\nderivative = 20\n\n'
            + force("torque", "one", "c1 - c2", (0, 0, 1))
            + force("torque", "two", "c2", (0, 0, 1)),
            lambda t, rest=rest: (lambda y: {"q1": y[:, :1], "q2": y[:, 1:2]})(lagrange(mass, rest, [0.0] * 4, t)),
            {},
            f"{a} rad at {w} rad/s",
        )


@case("gears whose shafts bend: an elastic arm on each wheel, in small motion; poles that Lagrange gives for two rods and a ratio")
def arm_on_gears():
    # Torsion springs ground both wheels' shafts; q2 = -2 q1.
    J1, J2, k1, k2, c = 0.02, 0.005, 50.0, 20.0, 0.1
    J, k = J1 + 4 * J2, k1 + 4 * k2
    for start in (0.2, 1.0):
        w = math.sqrt(k / J - (c / (2 * J)) ** 2)
        yield Scene(
            simulation(2, 200)
            + rigid("a", 1.0, (J1,) * 3)
            + rigid("b", 1.0, (J2,) * 3)
            + joint(
                "ja",
                "revolute",
                "ground",
                "a",
                f"initial = {{ value = {start}, rate = 0 }}\nspring = {{ stiffness = {k1}, damping = {c}, rest = 0 }}",
            )
            + joint(
                "jb",
                "revolute",
                "ground",
                "b",
                f"position = [0.3, 0, 0]\ninitial = {{ value = {-2 * start}, rate = 0 }}\nspring = {{ stiffness = {k2}, rest = 0 }}",
            )
            + '[[coupling]]\nname = "mesh"\nkind = "gear"\njoints = ["ja", "jb"]\nteeth = [40, 20]\n\n'
            + out("a", "ja", "value")
            + out("b", "jb", "value"),
            lambda t, s=start, w=w: (lambda x: {"a": x[:, None], "b": -2 * x[:, None]})(
                s * np.exp(-c / (2 * J) * t) * (np.cos(w * t) + c / (2 * J) / w * np.sin(w * t))
            ),
            {},
            f"from {start}",
        )


@case("a hammer on a leaf strikes a wall: a mass on a clamped light beam against a stiff plane, many blows")
def leaf_hammer():
    L, b, h, m, k = 0.2, 0.02, 0.002, 0.5, 5e5
    I = b * h**3 / 12
    kb = 3 * E * I / L**3
    for y0, gap, D in ((0.01, 0.002, 0.0), (0.01, 0.0, 2.0)):

        def f(_, y, gap=gap, D=D):
            depth = -y[0] - gap
            N = max(0.0, k * depth * (1 - D * y[1])) if depth > 0 else 0.0
            return [y[1], (-kb * y[0] + N) / m]

        v0 = 0.3
        yield Scene(
            simulation(0.6, 500, tolerance=1e-8)
            + "[ground]\nframes = { wall = ["
            + f"{L}, {-gap}, 0] }}\n"
            + beam("leaf", L, f'{{ shape = "rectangle", height = {h}, width = {b} }}', {**STEEL, "rho": 10.0}, "keep_modes = 1")
            + rigid("head", m, (1e-9,) * 3)
            + weld("root", "ground", "leaf")
            + joint("pin", "revolute", "leaf.tip", "head")
            + f'[[force]]\nkind = "force"\non = "head"\ndirection = [0, 1, 0]\nvalue = "{m * v0 / 1e-3!r}*(t < 1e-3 ? 1 : 0)"\n\n'
            + f'[[force]]\nkind = "contact"\nname = "blow"\non = "head"\nfrom = "ground.wall"\nshape = "point"\n'
            + f"normal = [0, 1, 0]\nstiffness = {k}\ndamping = {D}\n\n"
            + output("head", "head", "position"),
            lambda t, f=f: (lambda y: {"head": np.c_[np.nan * t, y[:, 0], 0 * t]})(
                ode(lambda s, y: [f(s, y)[0], f(s, y)[1] + (v0 / 1e-3 if s < 1e-3 else 0.0)], [0.0, 0.0], t, rtol=1e-10, max_step=1e-4)
            ),
            {},
            f"gap {gap}, damped {D}",
            claim=0.02,
        )
