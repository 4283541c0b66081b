"""Beams that are pulled, pressed, spun, shaken along: what the load does to the stiffness."""
import math

import numpy as np
from cases.case import Modes, case
from cases.common import E, G, RHO, STEEL, circle, out, still
from scene import Scene, beam, force, joint, output, rigid, simulation, weld
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from truths.formulas import beam_matrices, ode, torsion_rectangle


def rectangle(height, width):
    """Text, area, iz (bending in xy), iy, torsion constant."""
    text = f'{{ shape = "rectangle", height = {height!r}, width = {width!r} }}'
    return (
        text,
        height * width,
        width * height**3 / 12,
        height * width**3 / 12,
        torsion_rectangle(min(height, width), max(height, width)),
    )


def geometric(L, n, pull):
    """Stiffness of a beam clamped at its root by its pull N(x), over (deflection, slope) of the free nodes."""
    h = L / n
    x, w = np.polynomial.legendre.leggauss(4)
    K = np.zeros((2 * n + 2,) * 2)
    for e in range(n):
        for xi, wi in zip((x + 1) / 2, w / 2 * h):
            T = np.array([6 * (xi**2 - xi) / h, 1 - 4 * xi + 3 * xi**2, 6 * (xi - xi**2) / h, 3 * xi**2 - 2 * xi])
            K[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += wi * pull((e + xi) * h) * np.outer(T, T)
    return K[2:, 2:]


def bending_poles(L, EI, rhoA, pull, count, less=0.0, n=40):
    """Frequencies (rad/s) of a clamped beam under a pull N(x); less: subtracted from the squares. Unstable ones as real poles."""
    M, K = beam_matrices(L, EI, rhoA, n)
    squares = eigh(K + geometric(L, n, pull) - less * M, M, eigvals_only=True)[:count]
    return [complex(0, math.sqrt(z)) if z > 0 else complex(math.sqrt(-z), 0) for z in squares]


def sideways(share, L, EI, GJ):
    """Deflection over that without the load of a narrow cantilever, pushed sideways a little under share of Prandtl's load at its tip."""
    F = share * 4.0126 * math.sqrt(EI * GJ) / L**2

    def f(x, y):  # twist phi and its rate, w', w under a unit force aside; moment F (L - x)
        M = F * (L - x)
        return [y[1], M * ((L - x) - M * y[0]) / (EI * GJ), ((L - x) - M * y[0]) / EI, y[2]]

    part = solve_ivp(f, (0, L), [0, 0, 0, 0], rtol=1e-10, atol=1e-14).y[:, -1]
    free = solve_ivp(f, (0, L), [0, 1, 0, 0], rtol=1e-10, atol=1e-14).y[:, -1] - part
    a = -part[1] / free[1]
    return F, part[3] + a * free[3]


@case("a deep narrow cantilever under a load across its strong way tips over sideways: Prandtl's load")
def tips_over():
    h, b, L = 0.2, 0.003, 2.0
    s, A, iz, iy, J = rectangle(h, b)
    for share, elements in ((0.3, 10), (0.6, 10), (0.8, 10), (0.9, 10), (0.8, 30), (0.9, 30)):
        F, w = sideways(share, L, E * iy, G * J)
        aside = 1e-3 * F
        yield Scene(
            simulation(0.01, 100, start="static")
            + beam("rod", L, s, STEEL, f"elements = {elements}")
            + weld("wall", "ground", "rod")
            + force("force", "rod.tip", F, (0, -1, 0))
            + force("force", "rod.tip", aside, (0, 0, 1))
            + output("tip", "rod.tip", "displacement"),
            still(tip=[np.nan, np.nan, w * aside]),
            {"tip": w * aside},
            f"{share} of the critical load, {elements} elements, {w * 3 * E * iy / L**3:.2f} times the deflection without it",
        )
    for share in (0.5, 0.95, 1.1, 1.5):
        F, _ = sideways(share, L, E * iy, G * J)
        down = F * L**3 / (3 * E * iz) + F * L / (5 / 6 * G * A)
        yield Scene(
            simulation(0.01, 100, start="static")
            + beam("rod", L, s, STEEL)
            + weld("wall", "ground", "rod")
            + force("force", "rod.tip", F, (0, -1, 0))
            + output("tip", "rod.tip", "displacement"),
            still(tip=[np.nan, -down, np.nan]) if share < 1 else None,
            {"tip": down},
            f"{share} of the critical load and nothing aside",
        )


@case("a strip that is pulled is stiffer against twist; one that is pressed is softer")
def pulled_and_twisted():
    b, t, L = 0.04, 0.002, 1.0
    s, A, iz, iy, J = rectangle(b, t)
    for stress in (-1e5, 20e6, 100e6, 200e6):
        N, T = stress * A, 0.5
        phi = T * L / (G * J + N * (iy + iz) / A)
        yield Scene(
            simulation(0.01, 100, start="static")
            + beam("rod", L, s, STEEL)
            + weld("wall", "ground", "rod")
            + force("force", "rod.tip", N, (1, 0, 0))
            + force("torque", "rod.tip", T, (1, 0, 0))
            + output("turn", "rod.tip", "rotation"),
            still(turn=[phi, np.nan, np.nan]),
            {"turn": phi},
            f"{stress:g} Pa, {phi * G * J / (T * L):.3f} of the twist without it",
        )


@case("a heavy column that stands, a heavy strip that hangs: poles under the own weight (Greenhill)")
def own_weight():
    s, A, I = circle(0.01)
    for share in (0.5, 0.9, 1.1, -3.0, -20.0):
        g = 9.81
        L = (7.8373 * abs(share) * E * I / (RHO * A * g)) ** (1 / 3)
        up = 1 if share > 0 else -1
        poles = bending_poles(L, E * I, RHO * A, lambda x: -up * RHO * A * g * (L - x), 2)
        yield Modes(
            simulation(1.0, 100, (-up * g, 0, 0)) + beam("rod", L, s, STEEL) + weld("foot", "ground", "rod"),
            tuple(poles),
            f"{share} of the critical weight",
            unstable=int(share > 1),
        )


@case("a blade that turns: poles across the disc, in it, and about its own axis")
def turning_blade():
    for height, width, L, hub, W in ((0.04, 0.006, 1.0, 0.1, 50.0), (0.04, 0.006, 1.0, 0.0, 200.0), (0.005, 0.05, 0.6, 0.2, 120.0)):
        s, A, iz, iy, J = rectangle(height, width)
        pull = lambda x: RHO * A * W * W * (hub * (L - x) + (L * L - x * x) / 2)
        flap = bending_poles(L, E * iy, RHO * A, pull, 1)
        lag = bending_poles(L, E * iz, RHO * A, pull, 1, W * W)
        text = (
            simulation(1.0, 100, start="static")
            + rigid("hub", 1.0, (1, 1, 1))
            + joint("spin", "revolute", "ground", "hub", f'motion = "{W}*t"')
            + beam("rod", L, s, STEEL, 'effects = ["bending_xy", "bending_xz", "torsion", "stiffening"]')
            + weld("root", "hub", "rod", f"position = [{hub}, 0, 0]")
        )
        yield Modes(text, (*flap, *lag), f"{height} x {width} m, {W} rad/s")
        # Torsion: the pull's stiffness (Ip/A N) and the centrifugal moment of a section that leaves the disc.
        n, Ip = 60, iy + iz
        h = L / n
        M, K = np.zeros((n + 1,) * 2), np.zeros((n + 1,) * 2)
        for e in range(n):
            i = slice(e, e + 2)
            M[i, i] += RHO * Ip * h / 6 * np.array([[2, 1], [1, 2]])
            K[i, i] += (G * J + pull((e + 0.5) * h) * Ip / A) / h * np.array([[1, -1], [-1, 1]])
            K[i, i] += RHO * W * W * (iz - iy) * h / 6 * np.array([[2, 1], [1, 2]])
        square = eigh(K[1:, 1:], M[1:, 1:], eigvals_only=True)[0]
        share = math.sqrt(square) / (math.pi / 2 / L * math.sqrt(G * J / (RHO * Ip)))
        yield Modes(
            text,
            (complex(0, math.sqrt(square)),),
            f"{height} x {width} m, {W} rad/s, torsion, {share:.3f} of that at rest",
        )


@case("a column shaken along its axis at twice its frequency (Mathieu): it bends more and more")
def mathieu():
    s, A, I = circle(0.01)
    L = 1.0
    for pulse, rate in ((0.2, 2.0), (0.4, 2.0), (0.4, 1.5)):
        M, K = beam_matrices(L, E * I, RHO * A, 12)
        Kg = geometric(L, 12, lambda x: 1.0)
        squares, V = eigh(K, M)
        V, squares = V[:, :6], squares[:6]
        P = math.pi**2 / 4 * E * I / L**2 * pulse
        w = math.sqrt(squares[0]) * rate
        g = V.T @ Kg @ V * P
        f = V.T[:, -2] * 0.2

        def truth(t, w=w, g=g, f=f, squares=squares, V=V):
            y = ode(lambda x, y: np.r_[y[6:], f - squares * y[:6] + math.cos(w * x) * (g @ y[:6])], np.zeros(12), t, rtol=1e-9)
            return {"tip": np.c_[np.nan * t, y[:, :6] @ V[-2], np.nan * t]}

        yield Scene(
            simulation(1.0, 500)
            + beam("rod", L, s, STEEL)
            + weld("foot", "ground", "rod")
            + force("force", "rod.tip", f"{P!r}*cos({w!r}*t)", (-1, 0, 0))
            + force("force", "rod.tip", 0.2, (0, 1, 0))
            + output("tip", "rod.tip", "displacement"),
            truth,
            {},
            f"{pulse} of the critical load at {rate} times the frequency",
        )


@case("a column in a plane whose weak way lies across the plane: pressed beyond what it bears there, it is told")
def weak_way():
    s, A, iz, iy, J = rectangle(0.02, 0.01)
    for share in (0.5, 1.3, 2.5):
        P = share * math.pi**2 / 4 * E * iy
        top = 1.0
        k = math.sqrt(P / (E * iz))
        tip = top / P * (math.tan(k) / k - 1)
        text = (
            beam("rod", 1.0, s, STEEL)
            + weld("foot", "ground", "rod")
            + force("force", "rod.tip", P, (-1, 0, 0))
            + force("force", "rod.tip", top, (0, 1, 0))
        )
        yield Scene(
            simulation(0.01, 100, start="static") + text + output("tip", "rod.tip", "displacement"),
            still(tip=[np.nan, tip, np.nan]) if share < 1 else None,
            {"tip": tip},
            f"{share} of the weak way's load, at rest",
        )


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


@case("a bar that turns with a blade welded to it at an angle: what the root of a spinning oblique rod carries")
def oblique_rod():
    # A uniform rod at 45 degrees to the axis it turns about: moment m L^2 W^2 sin a cos a / 3 across, force m W^2 L/2 sin a.
    L, d, W, a = 0.5, 0.02, 30.0, math.pi / 4
    m = STEEL["rho"] * math.pi * d * d / 4 * L
    for more in ("", "keep_modes = 0", 'model = "mixed"\nvolumes = 4'):
        moment = m * L * L * W * W * math.sin(a) * math.cos(a) / 3
        pull = m * W * W * L / 2 * math.sin(a)
        yield Scene(
            simulation(0.5, 200, start="static")
            + rigid("hub", 1.0, (1e-3,) * 3)
            + beam("rod", L, circle(d)[0], STEEL, more)
            + joint("motor", "revolute", "ground", "hub", f'motion = "{W}*t"')
            + weld("root", "hub", "rod", f"rotation = [0, {-a!r}, 0]")
            + out("root", "root", "reaction", 'frame = "parent"'),
            lambda t, moment=moment, pull=pull: {
                "root": np.c_[0 * t - pull * math.cos(a), 0 * t, 0 * t + pull * math.sin(a), 0 * t, 0 * t + moment, 0 * t]
            },
            {"root": max(pull, moment)},
            more or "default",
            sizes_only=True,
        )
