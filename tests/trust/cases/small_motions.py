"""Poles and frequencies: small systems, controllers, contacts at rest, rotors, beams that taper."""
import math

import numpy as np
from cases.case import Modes, case
from cases.common import E, G, RHO, STEEL, circle, still
from scene import Scene, beam, force, joint, output, rigid, simulation, spring, weld
from scipy.linalg import eigh
from scipy.optimize import brentq
from truths.formulas import beam_matrices, bending_element


@case("poles with controllers in the loop: PID, filter, a lag, a beam's tip fed back, forces that read speeds, flutter")
def closed_loops():
    m, kp, ki, kd = 2.0, 300.0, 400.0, 30.0
    body = simulation(1.0, 100) + rigid("cart", m, (1,) * 3) + joint("j", "prismatic", "ground", "cart", "axis = [1, 0, 0]")
    reads = output("x", "j", "value") + output("v", "j", "rate")
    gains = f"proportional = {kp}\nintegral = {ki}\nderivative = {kd}\n"
    pid = f'[[block]]\nname = "pid"\nkind = "pid"\ninput = "0.3 - x"\nrate = "-v"\n{gains}\n'
    upper = lambda roots: tuple(sorted({complex(z.real, abs(z.imag)) for z in roots}, key=abs))
    yield Modes(body + pid + force("force", "cart", "pid", (1, 0, 0)) + reads, upper(np.roots([m, kd, kp, ki])), "PID", claim=1e-5)
    T = 0.02
    pid = f'[[block]]\nname = "pid"\nkind = "pid"\ninput = "0.3 - x"\n{gains}filter = {T}\n\n'
    poly = np.polyadd(
        np.polymul([m, 0, 0], np.polymul([T, 1], [1, 0])), np.polyadd(np.polymul([kd, 0], [1, 0]), np.polymul([T, 1], [kp, ki]))
    )
    yield Modes(body + pid + force("force", "cart", "pid", (1, 0, 0)) + reads, upper(np.roots(poly)), "PID with a filter", claim=1e-5)
    late = '[[block]]\nname = "late"\nkind = "transfer-function"\ninput = "-x"\nnumerator = [500]\ndenominator = [0.1, 1]\n\n'
    roots = np.roots(np.polyadd(np.polymul([m, 0, 0], [0.1, 1]), [500]))
    yield Modes(
        body + late + force("force", "cart", "late", (1, 0, 0)) + reads,
        upper(roots),
        "a lag makes it unstable",
        unstable=sum(z.real > 0 for z in upper(roots)),
        claim=1e-5,
    )
    yield Modes(
        body + force("force", "cart", "-50*x + 3*v*(1 - x^2)", (1, 0, 0)) + reads,
        upper(np.roots([m, -3, 50])),
        "van der Pol",
        unstable=1,
        claim=1e-5,
    )
    s, A, I = circle(0.02)
    k, c = 4000.0, 60.0
    M, K = beam_matrices(1.0, E * I, RHO * A, 20)
    C = np.zeros_like(K)
    K[-2, -2] += k
    C[-2, -2] += c
    n = len(M)
    z = np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]]))
    z = sorted((p for p in z if p.imag > 0), key=abs)[:2]
    yield Modes(
        simulation(1.0, 100)
        + beam("rod", 1.0, s, STEEL, 'effects = ["bending_xy"]')
        + weld("wall", "ground", "rod")
        + output("y", "rod.tip", "position")
        + output("vy", "rod.tip", "velocity")
        + force("force", "rod.tip", f"-{k}*y.y - {c}*vy.y", (0, 1, 0)),
        tuple(z),
        "a beam whose tip is fed back",
        claim=2e-3,
    )
    # Flutter of a plate section: lift follows the angle.
    ma, J, x, kh, ka = 10.0, 1.0, 0.2, 1000.0, 300.0
    for q in (100.0, 400.0):
        M2 = np.array([[ma, ma * x], [ma * x, J + ma * x * x]])
        K2 = np.array([[kh, q], [0, ka - 0.1 * q]])
        squares = np.linalg.eigvals(np.linalg.solve(M2, K2))
        poles = upper([r for z in squares.astype(complex) for r in (1j * np.sqrt(z), -1j * np.sqrt(z))])
        poles = tuple(p for p in poles)
        yield Modes(
            simulation(1.0, 100)
            + rigid("slide", 0.0, (0,) * 3).replace("inertia = [0.0, 0.0, 0.0]\n", "")
            + rigid("wing", ma, (J, J, J), {}, (x, 0, 0))
            + joint("h", "prismatic", "ground", "slide", f"axis = [0, 1, 0]\nspring = {{ stiffness = {kh} }}")
            + joint("a", "revolute", "slide", "wing", f"spring = {{ stiffness = {ka} }}")
            + output("angle", "a", "value")
            + force("force", "wing", f"-{q}*angle", (0, 1, 0))
            + force("torque", "wing", f"{0.1 * q}*angle", (0, 0, 1)),
            poles,
            f"flutter, lift {q} N/rad",
            unstable=sum(p.real > 1e-6 * abs(p) for p in poles),
            claim=1e-5,
        )


@case("poles of a contact and a stop at rest, of a rope over pulleys, gears with elastic shafts")
def small_couplings():
    m, k, g = 3.0, 1e7, 9.81
    d = (m * g / k) ** (2 / 3)
    yield Modes(
        simulation(1.0, 100, (0, 0, -g), start="static")
        + rigid("ball", m, (0.01,) * 3)
        + joint("j", "prismatic", "ground", "ball", "axis = [0, 0, 1]\ninitial = { guess = 0.0499 }".replace("guess", "guess"))
        + f'[[force]]\nkind = "contact"\non = "ball"\nshape = "sphere"\nradius = 0.05\nstiffness = {k}\nexponent = 1.5\n\n',
        (complex(0, math.sqrt(1.5 * k * math.sqrt(d) / m)),),
        "a ball rests on a plane (Hertz)",
        claim=1e-4,
    )
    kn, c = 5e4, 20.0
    half = c / (2 * m)
    yield Modes(
        simulation(1.0, 100, (0, -g, 0), start="static")
        + rigid("b", m, (0.01,) * 3)
        + joint("j", "prismatic", "ground", "b", f"axis = [0, 1, 0]\nstop = {{ lower = 0.0, stiffness = {kn}, damping = {c} }}"),
        (complex(-half, math.sqrt(kn / m - half * half)),),
        "a body rests on its stop",
        claim=1e-4,
    )
    # Two elastic shafts in gear, discs at their far ends.
    s, A, I = circle(0.02)
    L1, L2, J1, J2, n = 0.8, 0.5, 0.05, 0.02, -2.5
    GJ, rhoJ = G * 2 * I, RHO * 2 * I
    N = 40
    M, K = np.zeros((2 * N + 2,) * 2), np.zeros((2 * N + 2,) * 2)
    for at, L in ((0, L1), (N + 1, L2)):
        h = L / N
        for e in range(N):
            i = slice(at + e, at + e + 2)
            M[i, i] += rhoJ * h / 6 * np.array([[2, 1], [1, 2]])
            K[i, i] += GJ / h * np.array([[1, -1], [-1, 1]])
    M[0, 0] += J1
    M[-1, -1] += J2
    P = np.delete(np.eye(2 * N + 2), N + 1, axis=1)
    P[N + 1, N] = n
    M, K = P.T @ M @ P, P.T @ K @ P
    w = np.sqrt(eigh(K, M, eigvals_only=True)[1:3])
    words = 'effects = ["torsion"]'
    yield Modes(
        simulation(1.0, 100)
        + rigid("one", 1.0, (J1,) * 3)
        + rigid("two", 1.0, (J2,) * 3)
        + beam("a", L1, s, STEEL, words)
        + beam("b", L2, s, STEEL, words)
        + joint("ja", "revolute", "ground", "a.tip", f"axis = [1, 0, 0]\nposition = [{L1}, 0, 0]")
        + joint("jb", "revolute", "ground", "b", f"axis = [1, 0, 0]\nposition = [{L1}, 0.2, 0]")
        + weld("wa", "a", "one")
        + weld("wb", "b.tip", "two")
        + f'[[coupling]]\nname = "mesh"\nkind = "gear"\njoints = ["ja", "jb"]\nratio = {n}\n\n',
        tuple(complex(0, x) for x in w),
        "gears with elastic shafts",
        rigid=1,
        claim=2e-3,
    )
    m1, m2, k = 4.0, 3.0, 500.0  # a mass over a pulley, on a spring
    yield Modes(
        simulation(1.0, 100, (0, -g, 0), start="static")
        + rigid("a", m1, (0.01,) * 3)
        + rigid("b", m2, (0.01,) * 3)
        + joint("ja", "prismatic", "ground", "a", "axis = [0, 1, 0]\nposition = [0, -1, 0]")
        + joint("jb", "prismatic", "ground", "b", f"axis = [0, 1, 0]\nposition = [0.5, -1, 0]\nspring = {{ stiffness = {k} }}")
        + "[ground]\nframes = { p = [0, 0, 0], q = [0.5, 0, 0] }\n\n"
        + '[[coupling]]\nname = "r"\nkind = "rope"\nthrough = ["a", "ground.p", "ground.q", "b"]\nlength = 2.5\n\n',
        (complex(0, math.sqrt(k / (m1 + m2))),),
        "a rope over pulleys",
        claim=1e-5,
    )


@case("an overhung rotor with a heavy disc: whirls forward and backward")
def overhung_rotor():
    s, A, I = circle(0.02)
    L, m, Jp, Jd = 0.4, 8.0, 0.12, 0.065
    light = {"E": E, "rho": 1e-3, "poisson": 0.3}
    K = E * I * np.array([[12 / L**3, -6 / L**2], [-6 / L**2, 4 / L]])
    for W in (0.0, 100.0, 600.0):
        # u = y + i z, a = turn: M u'' - i W G u' + K u = 0 seen from outside.
        M = np.diag([m, Jd])
        Gy = np.diag([0.0, Jp * W])
        n = np.zeros((2, 2))
        A1 = np.block([[n, np.eye(2)], [-np.linalg.solve(M, K), 1j * np.linalg.solve(M, Gy)]])
        outside = np.linalg.eigvals(A1).imag
        seen = outside - W  # from the shaft
        yield Modes(
            simulation(1.0, 100)
            + rigid("chuck", 1.0, (1,) * 3)
            + rigid("disc", m, (Jp, Jd, Jd))
            + joint("spin", "revolute", "ground", "chuck", f'axis = [1, 0, 0]\nmotion = "{W}*t"')
            + beam("shaft", L, s, light, 'effects = ["bending_xy", "bending_xz"]')
            + weld("w", "chuck", "shaft")
            + weld("d", "shaft.tip", "disc"),
            tuple(complex(0, abs(x)) for x in seen),
            f"{W} rad/s",
            claim=1e-3,
        )


@case("tapered consoles: frequencies of a wedge and a cone cut off, whose width falls to a fifth")
def tapered_modes():
    for shape in ("rectangle", "circle"):
        L, a, b = 1.0, 0.05, 0.01
        n = 120
        h = L / n
        M, K = np.zeros((2 * n + 2,) * 2), np.zeros((2 * n + 2,) * 2)
        for e in range(n):
            D = a + (b - a) * (e + 0.5) / n
            I, A = (0.02 * D**3 / 12, 0.02 * D) if shape == "rectangle" else (math.pi * D**4 / 64, math.pi * D * D / 4)
            i = slice(2 * e, 2 * e + 4)
            m, k = bending_element(h, E * I, RHO * A)
            M[i, i] += m
            K[i, i] += k
        w = np.sqrt(eigh(K[2:, 2:], M[2:, 2:], eigvals_only=True)[:2])
        sec = lambda D: f'shape = "rectangle", height = {D}, width = 0.02' if shape == "rectangle" else f'shape = "circle", diameter = {D}'
        for words in ("", "volumes = 60\n"):
            yield Modes(
                simulation(1.0, 100)
                + beam("rod", L, "X", STEEL, words + 'effects = ["bending_xy"]').replace(
                    "section = X\n", f"sections = [{{ at = 0, {sec(a)} }}, {{ at = 1, {sec(b)} }}]\n"
                )
                + weld("wall", "ground", "rod"),
                tuple(complex(0, x) for x in w),
                f"{shape}, {words.strip() or 'as many volumes as there are by default'}",
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


@case("small motions: a double pendulum, a cantilever on a spring, an inverted pendulum on a spring, two pendulums with a damper between")
def small_systems():
    l, m, g = 0.7, 2.0, 9.81
    J = m * l * l / 12
    M = np.array([[m * l * l / 4 + J + m * l * l, m * l * l / 2], [m * l * l / 2, m * l * l / 4 + J]])
    K = np.diag([1.5 * m * g * l, 0.5 * m * g * l])
    w = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)))
    rod = lambda name: rigid(name, m, (1e-3, J, J), {"end": (l, 0, 0)}, (l / 2, 0, 0))
    down = "rotation = [0, 0, -1.5707963267948966]"
    yield Modes(
        simulation(1.0, 100, (0, -g, 0))
        + rod("a")
        + rod("b")
        + joint("j", "revolute", "ground", "a", down)
        + joint("k", "revolute", "a.end", "b"),
        tuple(complex(0, x) for x in w),
        "double pendulum",
        claim=1e-6,
    )
    s, A, I = circle(0.02)
    k = 5 * 3 * E * I
    f = lambda x: x**3 * (1 + math.cos(x) * math.cosh(x)) + k / (E * I) * (math.sin(x) * math.cosh(x) - math.cos(x) * math.sinh(x))
    root = brentq(f, 1.9, 3.9)
    yield Modes(
        simulation(1.0, 100)
        + beam("rod", 1.0, s, STEEL, 'effects = ["bending_xy"]')
        + weld("wall", "ground", "rod")
        + f'[[force]]\nkind = "bushing"\non = "rod.tip"\nstiffness = [0, {k!r}, 0, 0, 0, 0]\ndamping = [0, 0, 0, 0, 0, 0]\n\n',
        (complex(0, root**2 * math.sqrt(E * I / (RHO * A))),),
        "cantilever on a spring",
        claim=2e-3,
    )
    for kt in (0.5, 2.0):
        stiff = kt * m * g * l / 2
        z = (stiff - m * g * l / 2) / (m * l * l / 3)
        pole = complex(0, math.sqrt(z)) if z > 0 else complex(math.sqrt(-z), 0)
        yield Modes(
            simulation(1.0, 100, (0, -g, 0))
            + rod("a")
            + joint("j", "revolute", "ground", "a", f"rotation = [0, 0, 1.5707963267948966]\nspring = {{ stiffness = {stiff!r} }}"),
            (pole,),
            f"inverted, spring {kt} of what it needs",
            unstable=0 if z > 0 else 1,
            claim=1e-6,
        )
    c, h = 4.0, 0.4
    M1 = m * l * l / 3
    slow = math.sqrt(m * g * l / 2 / M1)
    half = 2 * c * h * h / (2 * M1)
    pole = complex(-half, math.sqrt(slow**2 - half**2))
    yield Modes(
        simulation(1.0, 100, (0, -g, 0))
        + rigid("a", m, (1e-3, J, J), {"p": (h, 0, 0)}, (l / 2, 0, 0))
        + rigid("b", m, (1e-3, J, J), {"p": (h, 0, 0)}, (l / 2, 0, 0))
        + joint("j", "revolute", "ground", "a", down)
        + joint("k", "revolute", "ground", "b", down + "\nposition = [0.5, 0, 0]")
        + spring("b.p", "a.p", 0.0, c),
        (complex(0, slow), pole),
        "two pendulums with a damper",
        claim=1e-6,
    )
