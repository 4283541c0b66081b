"""Machines of elastic and rigid parts, loops in space, drives, controllers: scenes that nobody tuned."""
import math

import numpy as np
from plain_case import Modes, case
from plain_effects import E, G, RHO, STEEL, circle, still
from scene import Scene, beam, force, joint, output, rigid, simulation, spring, weld
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.optimize import brentq, fsolve
from truths import Linear, beam_matrices, ode, piecewise, rod_matrices

DOWN = "rotation = [0, 0, -1.5707963267948966]"


def out(name, of, quantity, more):
    return output(name, of, quantity).rstrip() + "\n" + more + "\n\n"


@case("a beam between two driven slides: pulled, sheared across, twisted by its supports; reactions and section forces")
def driven_ends():
    s, A, I = circle(0.02)
    L, T = 1.0, 4.0
    smooth = "(1 - cos(pi*t/4))/2"
    f = lambda t: (1 - np.cos(math.pi * t / T)) / 2
    for kind, size in (("pull", 5e-4), ("shear", 4e-4), ("twist", 0.05), ("turn", 0.002)):
        along = {"pull": (1, 0, 0), "shear": (0, 1, 0), "twist": (1, 0, 0), "turn": (0, 0, 1)}[kind]
        turning = kind in ("twist", "turn")
        shear = 12 * E * I / (6 / 7 * G * A)
        stiff = {
            "pull": E * A / L,
            "shear": 12 * E * I / (L**3 + shear * L),
            "twist": G * 2 * I / L,
            "turn": E * I / L * (4 + shear) / (1 + shear),
        }[kind]
        column = {"pull": 0, "shear": 1, "twist": 3, "turn": 5}[kind]

        def truth(t, k=stiff * size, column=column):
            R = np.full((len(t), 6), np.nan)
            R[:, column] = k * f(t)
            return {"R": R}

        yield Scene(
            simulation(T, 100)
            + rigid("head", 1.0, (1e-3,) * 3)
            + joint(
                "drive",
                "revolute" if turning else "prismatic",
                "ground",
                "head",
                f'axis = {list(along)}\nposition = [{L}, 0, 0]\nmotion = "{size}*{smooth}"',
            )
            + beam("rod", L, s, STEEL)
            + weld("wall", "ground", "rod")
            + weld("tool", "rod.tip", "head")
            + output("R", "tool", "reaction"),
            lambda t, truth=truth: {"R": -truth(t)["R"]},
            {"R": stiff * size},
            kind,
            sizes_only=True,
        )


@case("three bars on a turning hub: pull in each at its places, a payload beside it, angular speed that rises")
def spun_rods():
    s, A, I = circle(0.02)
    L, hub, W, m = 0.8, 0.15, 40.0, 0.5
    for at in (0.0, 0.3, 0.9):
        N = RHO * A * W * W * ((hub + L) ** 2 - (hub + at * L) ** 2) / 2 + m * W * W * (hub + L)
        yield Scene(
            simulation(0.2, 200, start="static")
            + rigid("hub", 1.0, (1,) * 3)
            + rigid("load", m, (1e-5,) * 3)
            + joint("spin", "revolute", "ground", "hub", f'motion = "{W}*t"')
            + beam("rod", L, s, STEEL)
            + weld("root", "hub", "rod", f"position = [{hub}, 0, 0]")
            + weld("end", "rod.tip", "load")
            + out("S", "rod", "section_force", f"at = {at}"),
            still(S=[N, np.nan, np.nan, np.nan, np.nan, np.nan]),
            {"S": N},
            f"at {at} of the length",
        )


@case("poles with controllers in the loop: PID on a body and on a beam, a filter between, forces that read speeds, wind")
def closed_loops():
    m, kp, ki, kd = 2.0, 300.0, 400.0, 30.0
    body = simulation(1.0, 100) + rigid("cart", m, (1,) * 3) + joint("j", "prismatic", "ground", "cart", "axis = [1, 0, 0]")
    reads = output("x", "j", "value") + output("v", "j", "rate")
    pid = f'[[block]]\nname = "pid"\nkind = "pid"\ninput = "0.3 - x"\nrate = "-v"\nproportional = {kp}\nintegral = {ki}\nderivative = {kd}\n\n'
    upper = lambda roots: tuple(sorted({complex(z.real, abs(z.imag)) for z in roots}, key=abs))
    yield Modes(body + pid + force("force", "cart", "pid", (1, 0, 0)) + reads, upper(np.roots([m, kd, kp, ki])), "PID", claim=1e-5)
    T = 0.02
    pid = f'[[block]]\nname = "pid"\nkind = "pid"\ninput = "0.3 - x"\nproportional = {kp}\nintegral = {ki}\nderivative = {kd}\nfilter = {T}\n\n'
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
    W = 12.0
    yield Modes(
        body
        + '[[force]]\nkind = "drag"\non = "cart"\nquadratic = 0.7\nwind = [12, 0, 0]\n\n'
        + spring("cart", "ground.wall", 800.0, 0.0, 0.5).replace('"ground.wall"', '"ground.wall"')
        + "[ground]\nframes = { wall = [-0.5, 0, 0] }\n",
        (),
        "drag in wind, no equilibrium there",
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


@case("poles of contacts and stops at rest, of bodies in ropes, gears with elastic shafts, a rack on a spring")
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
        + '[ground]\nframes = { p = [0, 0, 0], q = [0.5, 0, 0] }\n\n[[coupling]]\nname = "r"\nkind = "rope"\nthrough = ["a", "ground.p", "ground.q", "b"]\nlength = 2.5\n\n',
        (complex(0, math.sqrt(k / (m1 + m2))),),
        "a rope over pulleys",
        claim=1e-5,
    )


@case("a puck slides, turns and comes to rest on a rubbing plane; a ball joint rubs")
def rubbing_surfaces():
    m, J, mu, r, g, a = 2.0, 0.02, 0.3, 0.05, 9.81, 0.15
    v0, w0 = (1.2, -0.7), 9.0

    def f(t, y):
        s = math.sqrt(y[3] ** 2 + y[4] ** 2)
        F = mu * m * g
        return [y[3], y[4], y[5], -F * y[3] / s / m, -F * y[4] / s / m, -F * r * np.sign(y[5]) / J]

    T1 = math.hypot(*v0) / (mu * g)
    Tw = w0 * J / (mu * m * g * r)

    def truth(t):
        x = np.zeros((len(t), 3))
        for c in range(2):
            tt = np.minimum(t, T1)
            x[:, c] = v0[c] * tt * (1 - tt / (2 * T1))
        tt = np.minimum(t, Tw)
        x[:, 2] = w0 * tt * (1 - tt / (2 * Tw))
        return {"q": x}

    yield Scene(
        simulation(1.2, 200, (0, 0, -g))
        + rigid("puck", m, (J,) * 3)
        + joint(
            "j",
            "planar",
            "ground",
            "puck",
            f'initial = {{ rate = [{v0[0]}, {v0[1]}, {w0}] }}\nfriction = {{ coefficient = {mu}, normal_force = "reaction", radius = {r} }}',
        )
        + output("q", "j", "value"),
        truth,
        {},
        "puck, friction by the reaction",
    )
    I = np.array([0.03, 0.05, 0.07])
    M = 0.4
    w = np.array([3.0, 5.0, -4.0])

    def spin(t, y):
        n = np.linalg.norm(y)
        return (-M * y / n - np.cross(y, I * y)) / I

    def gone(t, y):
        return np.linalg.norm(y) - 1e-7

    gone.terminal = True
    done = solve_ivp(spin, (0, 3), w, method="DOP853", rtol=1e-11, atol=1e-12, events=gone, dense_output=True)
    end = done.t[-1]
    yield Scene(
        simulation(1.0, 200)
        + rigid("ball", 1.0, I)
        + joint(
            "j",
            "spherical",
            "ground",
            "ball",
            f"initial = {{ rate = {w.tolist()} }}\nfriction = {{ coefficient = 0.4, normal_force = 10, radius = 0.1 }}",
        )
        + output("w", "ball", "angular_velocity")
        + '[[output]]\nname = "w2"\nexpression = "w.x^2 + w.y^2 + w.z^2"\n\n',
        lambda t: {"w2": (np.where((t < end)[:, None], done.sol(np.minimum(t, end)).T, 0) ** 2).sum(axis=1).reshape(-1, 1)},
        {},
        "ball joint, its speed squared",
    )


@case(
    "a door on two hinges, a table on four welded legs, a beam with too many bearings of a rigid body: shares of reactions are told or right"
)
def too_many_bearings():
    g, m = 9.81, 20.0
    carried = -(0.2 * m + 0.4 * m * g / 1.4)
    yield Scene(
        simulation(0.5, 100, (0, 0, -g))
        + rigid("door", m, (1, 1, 1), {"low": (0, 0, 0.3), "high": (0, 0, 1.7)}, (0.4, 0, 1.0))
        + joint("a", "revolute", "ground", "door.low", "position = [0, 0, 0.3]\ninitial = { rate = 1.0 }")
        + joint("b", "revolute", "ground", "door.high", "position = [0, 0, 1.7]")
        + output("R", "a", "reaction"),
        None,
        {},
        "a door on two full hinges: who carries what is not known",
    )
    yield Scene(
        simulation(0.5, 100, (0, 0, -g))
        + rigid("door", m, (1, 1, 1), {"low": (0, 0, 0.3), "high": (0, 0, 1.7)}, (0.4, 0, 1.0))
        + joint("a", "revolute", "ground", "door.low", "position = [0, 0, 0.3]\ninitial = { rate = 1.0 }")
        + joint("b", "point-on-line", "ground", "door.high", "position = [0, 0, 1.7]")
        + output("R", "b", "reaction")
        + output("angle", "a", "value"),
        lambda t: {
            "R": np.c_[carried * np.cos(t), carried * np.sin(t), 0 * t, np.nan * t, np.nan * t, np.nan * t],
            "angle": t.reshape(-1, 1),
        },
        {},
        "a door on a hinge and a bearing",
    )
