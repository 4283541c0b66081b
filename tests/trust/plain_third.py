"""Machines of elastic and rigid parts, loops in space, drives, controllers: scenes that nobody tuned."""
import math

import numpy as np
from plain_case import Modes, case
from plain_effects import E, G, RHO, STEEL, circle, still
from scene import Scene, beam, force, joint, output, rigid, simulation, weld
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.optimize import brentq
from truths import Linear, beam_matrices, bending_element, ode, piecewise, rod_matrices

DOWN = "rotation = [0, 0, -1.5707963267948966]"


def out(name, of, quantity, more):
    return output(name, of, quantity).rstrip() + "\n" + more + "\n\n"


@case("a beam between a wall and a driven slide or hinge: pulled, sheared across, twisted, turned; reactions")
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


@case("a rod with a payload on a turning hub: the pull at its places")
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
            f"initial = {{ rate = [{v0[0]}, {v0[1]}, {w0}] }}\n"
            f'friction = {{ coefficient = {mu}, normal_force = "reaction", radius = {r} }}',
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


@case("a door on two hinges: that rigid bodies leave its reactions open is told; on a ball joint and a bearing they are right")
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
        + joint("a", "spherical", "ground", "door.low", "position = [0, 0, 0.3]\ninitial = { rate = [0, 0, 1] }")
        + joint("b", "point-on-line", "ground", "door.high", "position = [0, 0, 1.7]")
        + output("R", "b", "reaction"),
        lambda t: {
            "R": np.c_[carried * np.cos(t), carried * np.sin(t), 0 * t, np.nan * t, np.nan * t, np.nan * t],
        },
        {},
        "a door on a ball joint and a bearing",
    )


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


@case("a spatial four-bar of rigid bodies (RSSR) that runs freely, dry friction in its rocker, whichever joint is cut")
def spatial_crank_rocker():
    r, R, l = 0.1, 0.3, 0.5
    start, rate, J1, J2 = 0.4, 12.0, 0.02, 0.05
    base = np.array([0.35, 0.0, 0.25])  # of the rocker's hinge, whose axis is x

    crank = lambda a: np.array([r * np.cos(a), r * np.sin(a), 0 * a])
    rocker = lambda b: base + np.array([0 * b, R * np.sin(b), R * np.cos(b)])
    gap = lambda a, b: ((rocker(b) - crank(a)) ** 2).sum() - l * l
    b0 = brentq(lambda b: gap(start, b), -0.2, 1.4) if gap(start, -0.2) * gap(start, 1.4) < 0 else None
    if b0 is None:
        return

    def slopes(a, b):
        d = rocker(b) - crank(a)
        da, db = -d @ np.array([-r * math.sin(a), r * math.cos(a), 0]), d @ np.array([0, R * math.cos(b), -R * math.sin(b)])
        return -da / db

    def second(a, b, h=1e-5):
        g = slopes(a, b)
        return (slopes(a + h, b + g * h) - slopes(a - h, b - g * h)) / (2 * h)

    for rub, order in ((0.2, (0, 1, 2, 3)), (0.2, (3, 2, 1, 0)), (0.6, (1, 3, 0, 2))):

        def f_of(sign, rub=rub):
            def f(t, y):
                a, b, v = y
                g = slopes(a, b)
                acc = (-J2 * g * second(a, b) * v * v - rub * sign * g) / (J1 + J2 * g * g)
                return [v, g * v, acc]

            return f

        def events_of(sign):
            e = lambda t, y: slopes(y[0], y[1]) * y[2]
            e.direction = -sign
            return [(e, -sign)]

        def truth(t, f_of=f_of):
            y = piecewise(f_of, events_of, [start, b0, rate], math.copysign(1, slopes(start, b0) * rate), t, rtol=1e-10, atol=1e-12)
            return {"a": y[:, :1], "b": y[:, 1:2] - b0, "v": y[:, 2:]}

        joints = [
            joint("crank", "revolute", "ground", "c", f"initial = {{ value = {start}, rate = {rate} }}"),
            joint(
                "rocker",
                "revolute",
                "ground",
                "r",
                f"axis = [1, 0, 0]\nposition = {base.tolist()}\ninitial = {{ guess = {-b0!r} }}\n"
                f"friction = {{ coefficient = 0.1, normal_force = {10 * rub} }}",
            ),
            joint("rod", "distance", "c.end", "r.end", f"length = {l}"),
        ]
        keep = [joints[k] for k in order if k < 3]
        yield Scene(
            simulation(1.0, 300)
            + rigid("c", 1.0, (J1,) * 3, {"end": (r, 0, 0)})
            + rigid("r", 1.0, (J2,) * 3, {"end": (0, 0, R)})
            + "".join(keep)
            + output("a", "crank", "value")
            + output("bb", "rocker", "value")
            + f'[[output]]\nname = "b"\nexpression = "-bb - {b0!r}"\n\n'
            + output("v", "crank", "rate"),
            truth,
            {"v": rate},
            f"{rub} N m, {order}",
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


@case("curved beams under their own weight, across and in their plane; reactions at the foot")
def hooks():
    s, A, I = circle(0.01)
    for angle, R, across in ((math.pi / 2, 0.5, True), (math.pi, 0.3, True), (math.pi / 2, 0.5, False)):
        w = RHO * A * 9.81
        phi, wts = np.polynomial.legendre.leggauss(80)
        phi, wts = (phi + 1) / 2 * angle, wts / 2 * angle
        P = lambda q: np.array([R * np.sin(q), R * (1 - np.cos(q))])
        end = P(angle)

        def beyond(q, F):  # moment about P(q) of the weight beyond and of a unit force at the end
            out = np.zeros(3)
            xs, ws = np.polynomial.legendre.leggauss(20)
            for x, ww in zip((xs + 1) / 2 * (angle - q) + q, ws / 2 * (angle - q)):
                out += np.cross([*(P(x) - P(q)), 0], np.array(F) * w * R * ww)
            return out

        d = (0, 0, -1) if across else (0, -1, 0)
        u = 0.0
        for q, ww in zip(phi, wts):
            t = np.array([math.cos(q), math.sin(q), 0])
            Mw, M1 = beyond(q, d), np.cross([*(end - P(q)), 0], d)
            T, B = Mw @ t, Mw - (Mw @ t) * t
            u += ww * R * ((Mw @ t) * (M1 @ t) / (G * 2 * I) + B @ (M1 - (M1 @ t) * t) / (E * I))
        foot = -beyond(0.0, d)
        yield Scene(
            simulation(0.01, 100, tuple(9.81 * np.array(d)), start="static")
            + beam("hook", 1.0, s, STEEL, f'axis = {{ x = "{R!r}*sin(u)", y = "{R!r}*(1 - cos(u))", to = {angle!r} }}').replace(
                "length = 1.0\n", ""
            )
            + weld("wall", "ground", "hook.root")
            + output("tip", "hook.tip", "position")
            + output("R", "wall", "reaction"),
            still(
                tip=[np.nan if across else np.nan, np.nan if across else end[1] - u, -u if across else np.nan],
                R=[np.nan, np.nan, np.nan, *foot],
            ),
            {"tip": u, "R": float(np.linalg.norm(foot))},
            f"{math.degrees(angle):.0f} degrees, {'across' if across else 'in'} its plane",
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
