"""Scenes that move smoothly: rods and beams under loads in time, rigid bodies, springs over all scales, short pulses.

Truths by ODEs and modal series."""
import math

import numpy as np

from scene import Scene, beam, force, joint, output, pick, rigid, simulation, sizes, weld
from truths.formulas import Linear, beam_matrices, ode, oscillator, rod_matrices


def ramp(T):
    """A smooth rise from 0 to 1 within T, as an expression and as a function."""
    return f"(t < {T!r} ? sin(pi*t/{2 * T!r})^2 : 1)", lambda t: np.where(t < T, np.sin(np.pi * np.minimum(t, T) / (2 * T)) ** 2, 1.0)


def rod_pulled(r):
    """A clamped rod pulled along its axis: its first axial vibrations."""
    L, m, s = sizes(r, slender=(6, 40))
    wave = math.sqrt(m["E"] / m["rho"])
    T1 = 4 * L / wave
    F = m["E"] * s["area"] * 10 ** r.uniform(-5, -3.5)
    text, f = ramp(T1 * r.uniform(1.0, 3))
    duration = 8 * T1
    scene = (
        simulation(duration, 200 / duration)
        + beam("rod", L, s["text"], m)
        + weld("clamp", "ground", "rod.root")
        + force("force", "rod.tip", f"{F!r} * {text}", (1, 0, 0))
        + output("tip", "rod.tip", "displacement")
    )

    def truth(t):
        M, K = rod_matrices(L, m["E"] * s["area"], m["rho"] * s["area"])
        u = Linear(M, K).respond(np.eye(len(K))[-1], lambda x: F * f(x), t)[:, -1]
        return {"tip": np.stack([u, 0 * u, 0 * u], axis=1)}

    return Scene(scene, truth, {}, f"{F:.3g} N, {duration / T1:.0f} periods")


def hoist(r):
    """A load hangs on an elastic rod whose upper end is lifted: the load bounces."""
    L, m, s = sizes(r, slender=(30, 80), shapes=("circle", "rectangle"))
    mass = m["rho"] * s["area"] * L * 10 ** r.uniform(0, 1.5)
    EA = m["E"] * s["area"]
    if mass * 9.81 / EA > 2e-3:
        return None
    period = 2 * math.pi * math.sqrt((mass + m["rho"] * s["area"] * L / 3) * L / EA)
    T = period * r.uniform(1.2, 3)
    H = mass * 9.81 * L / EA * 10 ** r.uniform(0.3, 1.5)
    # s = H (x - sin(2 pi x) / 2 pi), x = t/T until T.
    motion = f"t < {T!r} ? {H!r} * (t/{T!r} - sin(2*pi*t/{T!r})/(2*pi)) : {H!r}"
    acceleration = lambda t: np.where(t < T, H * 2 * np.pi / T**2 * np.sin(2 * np.pi * np.minimum(t, T) / T), 0.0)
    duration = 3 * T
    more = pick(r, 'effects = ["auto", "axial"]', "", "")
    text = (
        simulation(duration, 200 / duration, (0, -9.81, 0), start="static")
        + joint("drum", "prismatic", "ground", "rope.root", f'axis = [0, 1, 0]\nmotion = "{motion}"\nrotation = [0, 0, 0]')
        + beam("rope", L, s["text"], m, more)
        + rigid("load", mass, (mass * 1e-3 * L * L,) * 3)
        + weld("hook", "rope.tip", "load")
        + output("tip", "rope.tip", "displacement")
    )
    # The rod hangs along -y: its joint's frame is turned by -90 degrees about z, and the axis of the guide is then -x of that frame.
    text = text.replace("axis = [0, 1, 0]", "axis = [-1, 0, 0]").replace("rotation = [0, 0, 0]", f"rotation = [0, 0, {-math.pi / 2!r}]")

    def truth(t):
        M, K = rod_matrices(L, EA, m["rho"] * s["area"], tip_mass=mass)
        load = M @ np.ones(len(M))
        load[0] += m["rho"] * s["area"] * L / len(M) / 6  # what the held node's mass shares with its neighbour
        u = Linear(M, K).respond(load, lambda x: 9.81 + acceleration(x), t, equilibrium=True)[:, -1]
        return {"tip": np.stack([u, 0 * u, 0 * u], axis=1)}

    return Scene(text, truth, {}, f"load of {mass:.3g} kg, stretch {mass * 9.81 * L / EA / L:.1e} of the length {more}")


def cantilever_force(r):
    """A clamped beam shaken at its tip, in small deflection: from nanometres to millimetres."""
    L, m, s = sizes(r, slender=(25, 60), shapes=("rectangle", "circle", "general"))
    EI, rhoA = m["E"] * s["iz"], m["rho"] * s["area"]
    w1 = 3.516 / L**2 * math.sqrt(EI / rhoA)
    size = L * 10 ** r.uniform(-9, -3.3)
    F = 3 * EI * size / L**3
    w = w1 * r.uniform(0.2, 0.7)
    duration = 2 * math.pi / w1 * 4
    text = (
        simulation(duration, 200 / duration)
        + beam("arm", L, s["text"], m)
        + weld("clamp", "ground", "arm.root")
        + force("force", "arm.tip", f"{F!r} * sin({w!r}*t)^3", (0, 1, 0))
        + output("tip", "arm.tip", "displacement")
    )

    def truth(t):
        M, K = beam_matrices(L, EI, rhoA, kGA=m["E"] / (2 + 2 * m["poisson"]) * s["area"] * s["shear_y"], rhoI=m["rho"] * s["iz"])
        u = Linear(M, K).respond(np.eye(len(K))[-2], lambda x: F * np.sin(w * x) ** 3, t)[:, -2]
        return {"tip": np.stack([0 * u, u, 0 * u], axis=1)}

    scene = Scene(text, truth, {}, f"tip {size:.1e} m of {L:.2g} m")
    if r.random() < 0.3:
        scene.claim = pick(r, 1e-2, 1e-3)
        scene.words = ("--accuracy", repr(scene.claim))
        scene.what += f", accuracy {scene.claim:g}"
    return scene


def stubby_vibration(r):
    """A stubby clamped beam let go from a load that stops: shear and rotary inertia."""
    L, m, s = sizes(r, slender=(3, 9), shapes=("rectangle",))
    G = m["E"] / (2 * (1 + m["poisson"]))
    EI, rhoA = m["E"] * s["iz"], m["rho"] * s["area"]
    w1 = 3.516 / L**2 * math.sqrt(EI / rhoA)
    F = 3 * EI / L**2 * 10 ** r.uniform(-6, -4)
    text, f = ramp(2 * math.pi / w1 * r.uniform(0.8, 2))
    duration = 2 * math.pi / w1 * 5
    scene = (
        simulation(duration, 200 / duration)
        + beam("arm", L, s["text"], m)
        + weld("clamp", "ground", "arm.root")
        + force("force", "arm.tip", f"{F!r} * {text}", (0, 1, 0))
        + output("tip", "arm.tip", "displacement")
    )

    def truth(t):
        M, K = beam_matrices(L, EI, rhoA, kGA=G * s["area"] * s["shear_y"], rhoI=m["rho"] * s["iz"])
        u = Linear(M, K).respond(np.eye(len(K))[-2], lambda x: F * f(x), t)[:, -2]
        return {"tip": np.stack([0 * u, u, 0 * u], axis=1)}

    return Scene(scene, truth, {}, f"length/height {L / s['height']:.2g}")


def spring_mass(r):
    """A mass on a spring and damper over all scales, undamped to far beyond critical damping."""
    m, k = 10 ** r.uniform(-3, 3), 10 ** r.uniform(-1, 9)
    w = math.sqrt(k / m)
    zeta = pick(r, 0.0, 0.01, 0.3, 1.0, 30.0, 10 ** r.uniform(1, 5))
    c = 2 * zeta * math.sqrt(k * m)
    x0 = 10 ** r.uniform(-6, 1)
    duration = 2 * math.pi / w * r.uniform(2, 10) if zeta < 5 else pick(r, 1.0, 1.0, 1e3) * c / k
    joint_spring = r.random() < 0.5
    text = (
        simulation(duration, 200 / duration)
        + rigid("block", m, (m, m, m))
        + joint(
            "rail",
            "prismatic",
            "ground",
            "block",
            f"axis = [1, 0, 0]\ninitial = {{ value = {x0!r} }}"
            + (f"\nspring = {{ stiffness = {k!r}, damping = {c!r} }}" if joint_spring else ""),
        )
        + (
            ""
            if joint_spring
            else f'[[force]]\nkind = "bushing"\non = "block"\nstiffness = [{k!r}, 0, 0, 0, 0, 0]\ndamping = [{c!r}, 0, 0, 0, 0, 0]\n\n'
        )
        + output("x", "rail", "value")
        + output("v", "rail", "rate")
    )

    def truth(t):
        x = oscillator(m, c, k, x0, 0.0, t)
        root = np.sqrt(complex(c * c - 4 * m * k))
        s1 = (-c - root) / (2 * m)
        if abs(root) < 1e-9 * max(c, math.sqrt(m * k)):
            s = -c / (2 * m)
            v = (-s * x0 * s * t) * np.exp(s * t)
        else:
            s2 = k / (m * s1)
            a2 = -s1 * x0 / (s2 - s1)
            v = ((x0 - a2) * s1 * np.exp(s1 * t) + a2 * s2 * np.exp(s2 * t)).real
        return {"x": x[:, None], "v": v[:, None]}

    return Scene(text, truth, {}, f"m {m:.2g} k {k:.2g} damping ratio {zeta:.2g}, {'joint' if joint_spring else 'bushing'}")


def pulse(r):
    """A mass on a spring under short smooth pulses: Gaussian bells and high powers of a sine."""
    m, T = 10 ** r.uniform(-2, 2), 10 ** r.uniform(-2, 2)
    w = 2 * math.pi / T
    k = m * w * w
    duration = 5 * T
    width = T * 10 ** r.uniform(-3.5, -1)
    at = duration * r.uniform(0.2, 0.7)
    F = 10 ** r.uniform(-2, 2)
    if r.random() < 0.6:
        value, f = f"{F!r} * exp(-((t - {at!r})/{width!r})^2)", lambda t: F * np.exp(-(((t - at) / width) ** 2))
        what = "Gaussian pulse"
    else:
        n, a = pick(r, 100, 200, 1000, 20000), math.pi / duration * r.uniform(1, 2)
        value, f = f"{F!r} * sin({a!r}*t)^{n}", lambda t: F * np.sin(a * t) ** n
        what, width = f"sin^{n}", 1 / (a * math.sqrt(n))
    text = (
        simulation(duration, 200 / duration)
        + rigid("block", m, (m, m, m))
        + joint("rail", "prismatic", "ground", "block", f"axis = [1, 0, 0]\nspring = {{ stiffness = {k!r} }}")
        + force("force", "block", value, (1, 0, 0))
        + output("x", "rail", "value")
    )

    def truth(t):
        # Duhamel's integral on a fine grid: x = (S sin - C cos)/(m w), S = int F cos, C = int F sin.
        fine = np.linspace(0, duration, 400001)
        F_, h = f(fine), fine[1]
        S = np.concatenate([[0], np.cumsum((F_[1:] * np.cos(w * fine[1:]) + F_[:-1] * np.cos(w * fine[:-1])) * h / 2)])
        C = np.concatenate([[0], np.cumsum((F_[1:] * np.sin(w * fine[1:]) + F_[:-1] * np.sin(w * fine[:-1])) * h / 2)])
        x = (np.interp(t, fine, S) * np.sin(w * t) - np.interp(t, fine, C) * np.cos(w * t)) / (m * w)
        return {"x": x[:, None]}

    return Scene(text, truth, {}, f"{what}, width {width / duration:.1e} of the run")


def constant_acceleration(r):
    """Bodies that accelerate evenly: slides and screws under gravity or a force, over all scales."""
    size = 10 ** r.uniform(-3, 3)
    T = 10 ** r.uniform(-2, 2)
    g = size / T**2
    kind = pick(r, "prismatic", "screw", "screw", "revolute")
    m, I = 10 ** r.uniform(-2, 2), 10 ** r.uniform(-4, 0)
    if kind == "prismatic":
        a = -g
        text = rigid("block", m, (I, I, I)) + joint("rail", kind, "ground", "block", "axis = [0, 1, 0]")
        x = lambda t: -g * t * t / 2
    elif kind == "screw":
        pitch = size * 10 ** r.uniform(-3, 0)
        # Angle a: m p^2 a'' + I a'' = -m g p.
        a = -m * g * pitch / (m * pitch**2 + I)
        text = rigid("block", m, (I, I, I)) + joint("rail", kind, "ground", "block", f"axis = [0, 1, 0]\npitch = {pitch!r}")
        x = lambda t: a * t * t / 2
    else:
        M = 10 ** r.uniform(-2, 2)
        text = (
            rigid("block", m, (I, I, I))
            + joint("rail", kind, "ground", "block", "axis = [0, 1, 0]")
            + force("torque", "block", M, (0, 1, 0))
        )
        x = lambda t: M / I * t * t / 2
    text = simulation(T, 100 / T, (0, -g, 0)) + text + output("x", "rail", "value")
    return Scene(text, lambda t: {"x": x(t)[:, None]}, {}, f"{kind}, {T:.2g} s, {g:.2g} m/s^2, end {x(np.array(T)):.3g}")


def pendulum(r):
    """A rigid pendulum of any size, from small swings to turns over the top."""
    l = 10 ** r.uniform(-3, 3)
    g = 10 ** r.uniform(-1, 1.5)
    m = 10 ** r.uniform(-2, 2)
    J = m * l * l * r.uniform(0.01, 0.5)
    a0, w0 = r.uniform(-3, 3), pick(r, 0.0, r.uniform(-4, 4) * math.sqrt(g / l))
    duration = 2 * math.pi * math.sqrt(l / g) * r.uniform(2, 6)
    axis = pick(r, (0, 0, 1), (0, 0, 1), (0, 0, -1))
    text = (
        simulation(duration, 200 / duration, (0, -g, 0))
        + rigid("bob", m, (J, J, J), {"end": (l, 0, 0)}, centre=(l, 0, 0))
        + joint(
            "pivot",
            "revolute",
            "ground",
            "bob",
            f"axis = {list(axis)}\nrotation = [0, 0, {-math.pi / 2!r}]\ninitial = {{ value = {a0!r}, rate = {w0!r} }}",
        )
        + output("angle", "pivot", "value")
        + output("end", "bob.end", "position")
        + output("pull", "pivot", "reaction")
    )

    def truth(t):
        b = m * g * l / (J + m * l * l)
        y = ode(lambda _, y: [y[1], -b * math.sin(y[0])], [a0, w0], t)
        s = axis[2]
        return {"angle": y[:, :1], "end": np.stack([l * np.sin(s * y[:, 0]), -l * np.cos(s * y[:, 0]), 0 * t], axis=1)}

    scene = Scene(text, truth, {}, f"{l:.2g} m, from {math.degrees(a0):.0f} degrees")
    if r.random() < 0.3:
        scene.words, scene.claim = ("--accuracy", "1e-4"), 1e-4
    return scene


def double_pendulum(r):
    """Two rigid rods on hinges, a few swings."""
    l1, l2 = r.uniform(0.2, 2), r.uniform(0.2, 2)
    m1, m2 = r.uniform(0.2, 3), r.uniform(0.2, 3)
    a, b = r.uniform(-1.5, 1.5), r.uniform(-1, 1)
    duration = 1.5 * math.sqrt(l1 + l2)
    J1, J2 = m1 * l1**2 / 12, m2 * l2**2 / 12
    bar = lambda n, l, m, J: rigid(n, m, (J / 100, J, J), {"end": (l, 0, 0)}, centre=(l / 2, 0, 0))
    text = (
        simulation(duration, 200 / duration, (0, -9.81, 0))
        + bar("one", l1, m1, J1)
        + bar("two", l2, m2, J2)
        + joint("a", "revolute", "ground", "one", f"initial = {{ value = {a!r} }}")
        + joint("b", "revolute", "one.end", "two", f"initial = {{ value = {b!r} }}")
        + output("a", "a", "value")
        + output("end", "two.end", "position")
    )

    def f(_, y):
        p, q, pd, qd = y  # angles to x
        c, s = math.cos(p - q), math.sin(p - q)
        A = np.array([[J1 + m1 * l1**2 / 4 + m2 * l1**2, m2 * l1 * l2 / 2 * c], [m2 * l1 * l2 / 2 * c, J2 + m2 * l2**2 / 4]])
        h = np.array(
            [
                -m2 * l1 * l2 / 2 * s * qd**2 - 9.81 * math.cos(p) * l1 * (m1 / 2 + m2),
                m2 * l1 * l2 / 2 * s * pd**2 - 9.81 * math.cos(q) * l2 * m2 / 2,
            ]
        )
        return [pd, qd, *np.linalg.solve(A, h)]

    def truth(t):
        y = ode(f, [a, a + b, 0, 0], t)
        p, q = y[:, 0], y[:, 1]
        return {"a": y[:, :1], "end": np.stack([l1 * np.cos(p) + l2 * np.cos(q), l1 * np.sin(p) + l2 * np.sin(q), 0 * t], axis=1)}

    return Scene(text, truth, {}, f"{l1:.2g} and {l2:.2g} m")


def tumbling(r):
    """A free rigid body turns about any axis, slow or very fast."""
    I = sorted(r.uniform(0.2, 1.5) for _ in range(3))
    if I[2] > I[0] + I[1]:
        return None
    scale = 10 ** r.uniform(-3, 4)
    w = [scale * r.uniform(-1, 1) for _ in range(3)]
    v = [r.uniform(-1, 1) * 10 ** r.uniform(-2, 5) for _ in range(3)]
    duration = r.uniform(5, 30) / scale
    text = (
        simulation(duration, 200 / duration)
        + rigid("body", 2.0, I, {"p": (0.5, 0, 0)})
        + joint("free", "free", "ground", "body", f"initial = {{ rate = {v + w} }}")
        + output("w", "body", "angular_velocity")
        + output("p", "body.p", "position")
    )

    def f(_, y):
        w, R = y[:3], y[3:].reshape(3, 3)
        K = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        return np.concatenate([np.cross(I * w, w) / I, (R @ K).ravel()])

    def truth(t):
        y = ode(f, np.concatenate([w, np.eye(3).ravel()]), t, scale=1.0)
        R = y[:, 3:].reshape(-1, 3, 3)
        return {"w": np.einsum("tij,tj->ti", R, y[:, :3]), "p": 0.5 * R[:, :, 0] + np.outer(t, v)}

    return Scene(text, truth, {}, f"{scale:.1e} rad/s, {duration * scale / 6.28:.1f} turns")


def tumbling_beam(r):
    """A free beam, all but rigid, turns about any axis; effects free or some listed, by elements, eigenforms or links."""
    L, m, s = sizes(r, slender=(6, 30), shapes=("rectangle",))
    A, iy, iz = s["area"], s["iy"], s["iz"]
    angle = pick(r, 0.0, r.uniform(-1, 1))
    bending = 22.4 / L**2 * math.sqrt(m["E"] * min(iy, iz) / (m["rho"] * A))
    size = bending * 10 ** r.uniform(-3, -1.7)
    w = [size * r.uniform(-1, 1) for _ in range(3)]
    duration = 20 / np.linalg.norm(w)
    J = m["rho"] * L * np.diag([iy + iz, iy + A * L**2 / 12, iz + A * L**2 / 12])
    c, d = math.cos(angle), math.sin(angle)
    turn = np.array([[1, 0, 0], [0, c, -d], [0, d, c]])
    J = turn @ J @ turn.T
    bends = ["bending_xy", "bending_xz"]
    lists = [], ["torsion"], bends[:1], bends[1:], bends, [*bends, "torsion", "stiffening"], [*bends, "torsion", "stiffening", "axial"]
    more = pick(r, "", 'model = "lumped"\nelements = 6', 'model = "modal"\nmodes = { bending_xy = [1, 2], bending_xz = [1, 2] }')
    if r.random() < 0.6:
        more = f"effects = {lists[r.randrange(len(lists))]}".replace("'", '"')
    text = (
        simulation(duration, 100 / duration)
        + beam("plate", L, s["text"].replace(" }", f", angle = {angle!r} }}"), m, more + "\nframes = { middle = 0.5 }")
        + joint("free", "free", "ground", "plate.root", f"initial = {{ rate = {w} }}")
        + output("w", "plate.middle", "angular_velocity")
    )

    def f(_, y):
        v, R = y[:3], y[3:].reshape(3, 3)
        K = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
        return np.concatenate([np.linalg.solve(J, np.cross(J @ v, v)), (R @ K).ravel()])

    def truth(t):
        y = ode(f, np.concatenate([w, np.eye(3).ravel()]), t, scale=1.0)
        return {"w": np.einsum("tij,tj->ti", y[:, 3:].reshape(-1, 3, 3), y[:, :3])}

    slender = L / math.sqrt(12 * max(iy, iz) / A)
    return Scene(text, truth, {}, f"L/h {slender:.2g}, section at {angle:.2g} rad, {size / bending:.1e} of its bending, {more or 'auto'}")


def driven_arm(r):
    """A rigid arm driven by a smooth motion: moment of the drive and force in the bearing at start-up."""
    m, c = r.uniform(0.5, 5), r.uniform(0.1, 1)
    J = m * c * c * r.uniform(0.05, 0.3)
    T, A = 10 ** r.uniform(-1, 1), r.uniform(0.2, 3)
    motion = f"t < {T!r} ? {A!r} * (t/{T!r} - sin(2*pi*t/{T!r})/(2*pi)) : {A!r}"
    duration = 1.5 * T
    text = (
        simulation(duration, 200 / duration, (0, -9.81, 0))
        + rigid("arm", m, (J, J, J), centre=(c, 0, 0))
        + joint("drive", "revolute", "ground", "arm", f'motion = "{motion}"')
        + output("load", "drive", "reaction")
        + output("a", "arm", "angular_velocity")
    )

    def truth(t):
        x = np.minimum(t, T) / T
        a = A * (x - np.sin(2 * np.pi * x) / (2 * np.pi))
        w = np.where(t < T, A / T * (1 - np.cos(2 * np.pi * x)), 0.0)
        wd = np.where(t < T, A * 2 * np.pi / T**2 * np.sin(2 * np.pi * x), 0.0)
        M = (J + m * c * c) * wd + m * 9.81 * c * np.cos(a)
        Fx = m * c * (-wd * np.sin(a) - w**2 * np.cos(a))
        Fy = m * c * (wd * np.cos(a) - w**2 * np.sin(a)) + m * 9.81
        zero = 0 * t
        return {"load": np.stack([Fx, Fy, zero, zero, zero, M], axis=1), "a": np.stack([zero, zero, w], axis=1)}

    return Scene(text, truth, {}, f"{A:.2g} rad in {T:.2g} s")


def decay(r):
    """A clamped beam with a damping ratio swings down from a load that is taken away."""
    L, m, s = sizes(r, slender=(30, 60), shapes=("rectangle", "circle"))
    EI, rhoA = m["E"] * s["iz"], m["rho"] * s["area"]
    w1 = 3.516015 / L**2 * math.sqrt(EI / rhoA)
    zeta = 10 ** r.uniform(-2.5, -0.7)
    F = 3 * EI * 1e-4 / L**2
    text, f = ramp(2 * math.pi / w1 * r.uniform(0.8, 1.5))
    duration = 2 * math.pi / w1 * 6
    scene = (
        simulation(duration, 200 / duration)
        + beam("arm", L, s["text"], m, f"damping = {{ ratio = {zeta!r} }}")
        + weld("clamp", "ground", "arm.root")
        + force("force", "arm.tip", f"{F!r} * {text}", (0, 1, 0))
        + output("tip", "arm.tip", "displacement")
    )

    def truth(t):
        M, K = beam_matrices(L, EI, rhoA)
        u = Linear(M, K, zeta).respond(np.eye(len(K))[-2], lambda x: F * f(x), t)[:, -2]
        return {"tip": np.stack([0 * u, u, 0 * u], axis=1)}

    return Scene(scene, truth, {}, f"ratio {zeta:.2g}")


KINDS = [
    rod_pulled,
    hoist,
    cantilever_force,
    stubby_vibration,
    spring_mass,
    pulse,
    constant_acceleration,
    pendulum,
    double_pendulum,
    tumbling,
    tumbling_beam,
    driven_arm,
    decay,
]
