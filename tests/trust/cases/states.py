"""Small motions about a start, and static starts."""
import cmath
import math

import numpy as np
from cases.case import Modes, case
from cases.common import E, RHO, STEEL, circle, still
from cases.effects import bars
from scene import Scene, beam, force, joint, output, rigid, simulation, weld
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from truths.formulas import oscillator


def beck_pole(share, L, EI, rhoA, n=20):
    """Poles of a column under a follower force share EI / L^2, plane finite elements with geometric stiffness and the load's turn."""
    from truths.formulas import beam_matrices

    M, K = beam_matrices(L, EI, rhoA, n)
    h, P = L / n, share * EI / L**2
    g = (
        P
        / (30 * h)
        * np.array(
            [[36, 3 * h, -36, 3 * h], [3 * h, 4 * h * h, -3 * h, -h * h], [-36, -3 * h, 36, -3 * h], [3 * h, -h * h, -3 * h, 4 * h * h]]
        )
    )
    G = np.zeros((2 * n + 2,) * 2)
    for e in range(n):
        G[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += g
    G = G[2:, 2:]
    G[-2, -1] -= P  # the force across, -P phi, that the turned load has
    squares = np.linalg.eigvals(np.linalg.solve(M, K - G))
    return sorted((cmath.sqrt(-z) for z in squares.astype(complex)), key=abs)


@case("Beck's column: flutter begins at 20.05 EI/L^2, not at 19.8", "Linearise.BecksColumn; stability becks_column, becks_chain")
def beck():
    for L, d in ((1.0, 0.01), (0.2, 0.004)):
        s, A, I = circle(d)
        for share in (10.0, 19.8, 20.0, 20.1, 22.0):
            wanted = [z for z in beck_pole(share, L, E * I, RHO * A)[:4]]
            poles = tuple({complex(abs(z.real) if share > 20.06 else 0.0, abs(z.imag)) for z in wanted[:2]})
            for words in ("", "elements = 12"):
                if words and d != 0.01:
                    continue
                yield Modes(
                    simulation(1.0, 100)
                    + beam("c", L, s, STEEL, words + '\neffects = ["bending_xy", "stiffening"]')
                    + weld("foot", "ground", "c")
                    + force("force", "c.tip", share * E * I / L**2, (-1, 0, 0), 'frame = "body"'),
                    poles,
                    f"{share} EI/L^2, {d} m thick, {words}",
                    unstable=1 if share > 20.06 else 0,
                )
                yield Modes(
                    simulation(1.0, 100)
                    + beam("c", L, s, STEEL, words)
                    + weld("foot", "ground", "c")
                    + force("force", "c.tip", share * E * I / L**2, (-1, 0, 0), 'frame = "body"'),
                    poles,
                    f"{share} EI/L^2, {d} m thick, automatic, {words}",
                    unstable=1 if share > 20.06 else 0,
                )


def disc_on_slides(W, k, c, ci, m=1.0, springs="joints"):
    own = f"spring = {{ stiffness = {k}, damping = {ci} }}"
    return (
        simulation(1.0, 100)
        + rigid("hub", 1.0, (1, 1, 1))
        + '[[body]]\nname = "link"\nkind = "rigid"\nmass = 0\n\n'
        + rigid("disc", m, (0.1,) * 3)
        + joint("spin", "revolute", "ground", "hub", f'motion = "{W}*t"')
        + joint("x", "prismatic", "hub", "link", f"axis = [1, 0, 0]\n{own}")
        + joint("y", "prismatic", "link", "disc", f"axis = [0, 1, 0]\n{own}")
        + f'[[force]]\nkind = "bushing"\non = "disc"\nstiffness = [0, 0, 0, 0, 0, 0]\ndamping = [{c}, {c}, 0, 0, 0, 0]\n\n'
    )


@case(
    "a shaft damped from outside and inside, below and above its critical speed",
    "Linearise.RotorWithInnerAndOuterDamper; stability damped_rotor",
)
def damped_shaft():
    for k, W, c, ci, m in (
        (400.0, 10.0, 3.0, 0.0, 1.0),
        (400.0, 30.0, 3.0, 0.0, 1.0),
        (400.0, 30.0, 0.0, 3.0, 1.0),
        (400.0, 100.0, 2.0, 1.0, 1.0),
        (4e6, 1000.0, 30.0, 10.0, 2.0),
        (4e6, 5000.0, 30.0, 0.0, 2.0),
        (4e6, 5000.0, 1e4, 1.0, 2.0),
    ):
        half = (c + ci + 2j * m * W) / (2 * m)
        root = cmath.sqrt(half * half - (k - m * W * W + 1j * c * W) / m)
        found = [-half + root, -half - root]
        poles = tuple(complex(z.real, abs(z.imag)) for z in found)
        yield Modes(
            disc_on_slides(W, k, c, ci, m), poles, f"k {k} W {W} c {c} ci {ci}", unstable=sum(z.real > 1e-9 * abs(z) for z in poles)
        )
    # The same as a beam: an elastic shaft between two bearings with a disc in the middle, damped from outside by a bushing.
    s, A, I = circle(0.01)
    L, m = 0.5, 2.0
    k = 48 * E * I / L**3
    wc = math.sqrt(k / m)
    for W, c in ((0.5 * wc, 20.0), (2.0 * wc, 20.0)):
        half = (c + 2j * m * W) / (2 * m)
        root = cmath.sqrt(half * half - (k - m * W * W + 1j * c * W) / m)
        light = {"E": E, "rho": 1.0, "poisson": 0.3}
        yield Modes(
            simulation(1.0, 100)
            + rigid("chuck", 1.0, (1, 1, 1))
            + beam("shaft", L, s, light, 'frames = { middle = 0.5 }\neffects = ["bending_xy", "bending_xz"]')
            + rigid("disc", m, (1e-6, 1e-6, 1e-6))
            + joint("spin", "revolute", "ground", "chuck", f'axis = [1, 0, 0]\nmotion = "{W}*t"')
            + joint("left", "constant-velocity", "chuck", "shaft", "axis = [1, 0, 0]")
            + joint("right", "point-on-line", "ground", "shaft.tip", "axis = [1, 0, 0]")
            + weld("key", "shaft.middle", "disc")
            + f'[[force]]\nkind = "bushing"\non = "disc"\nstiffness = [0, 0, 0, 0, 0, 0]\ndamping = [0, {c}, {c}, 0, 0, 0]\n\n',
            tuple(complex(z.real, abs(z.imag)) for z in (-half + root, -half - root)),
            f"elastic shaft at {W / wc} of the critical speed",
            claim=0.01,
        )


@case("two masses with one strong damper", "Linearise.OneStrongDamper; stability one_strong_damper")
def strong_damper():
    for k1, k2, k, c, ma, mb in (
        (400, 500, 300, 200, 1, 2),
        (200, 200, 0.0, 1e4, 1, 1),
        (1e3, 1e3, 1e3, 1e6, 10, 1),
        (400, 500, 300, 5, 1, 2),
    ):
        A = np.zeros((4, 4))
        A[:2, 2:] = np.eye(2)
        A[2:, :2] = [[-(k1 + k) / ma, k / ma], [k / mb, -(k2 + k) / mb]]
        A[3, 3] = -c / mb
        poles = tuple(z for z in np.linalg.eigvals(A) if z.imag >= 0)
        yield Modes(
            simulation(1.0, 100)
            + rigid("a", ma, (1,) * 3)
            + rigid("b", mb, (1,) * 3)
            + joint("ja", "prismatic", "ground", "a", f"axis = [1, 0, 0]\nspring = {{ stiffness = {k1} }}")
            + joint("jb", "prismatic", "ground", "b", f"axis = [1, 0, 0]\nspring = {{ stiffness = {k2}, damping = {c} }}")
            + f'[[force]]\nkind = "bushing"\non = "a"\nfrom = "b"\nstiffness = [{k}, 0, 0, 0, 0, 0]\n\n',
            poles,
            f"{c} N s/m",
        )


@case("a free box under gravity, a free beam, a sleeping top: no false instability", "Linearise.FreeMotionsAreRigid, SleepingTop")
def free_bodies():
    for scale in (1e-6, 1.0, 1e6):
        yield Modes(
            simulation(1.0, 100, (0, -9.81, 0)) + rigid("box", scale, (scale, 2 * scale, 2.5 * scale), centre=(0.1, 0.2, 0.3)),
            (),
            f"box of {scale} kg without a joint",
            rigid=6,
        )
    s, A, I = circle(0.01)
    for more in ("", 'effects = ["bending_xy", "bending_xz"]', "elements = 20"):
        w = 22.3733 * math.sqrt(E * I / (RHO * A))
        yield Modes(simulation(1.0, 100, (0, -9.81, 0)) + beam("b", 1.0, s, STEEL, more), (1j * w,), f"free beam {more}", claim=0.005)
    m, l, g, A, C = 2.0, 0.5, 9.81, 0.52, 0.03
    critical = 2 * math.sqrt(A * m * g * l) / C
    for W in (0.9 * critical, 1.01 * critical, 10 * critical):
        root = cmath.sqrt((C * W) ** 2 - 4 * A * m * g * l)
        poles = [1j * (C * W + root) / (2 * A), 1j * (C * W - root) / (2 * A)]
        yield Modes(
            simulation(1.0, 100, (0, 0, -g))
            + rigid("top", m, (0.02, 0.02, C), centre=(0, 0, l))
            + joint("ball", "spherical", "ground", "top", f"initial = {{ rate = [0, 0, {W}] }}"),
            tuple(complex(abs(z.real), abs(z.imag)) for z in poles),
            f"top at {W / critical:.2f} of the critical spin",
            unstable=1 if W < critical else 0,
            claim=1e-3,
        )


@case("a lumped cantilever hangs by its springs at a static start", "Statics.LumpedCantileverIsHeldByItsSprings; stability lumped_at_rest")
def lumped():
    for d, L, n in ((0.05, 1.0, 10), (0.02, 1.0, 20), (0.2, 3.0, 40)):
        s, A, I = circle(d)
        y = RHO * A * 9.81 * L**4 / (8 * E * I)
        yield Scene(
            simulation(0.01, 100, (0, -9.81, 0), start="static")
            + beam("rod", L, s, STEEL, f'model = "lumped"\nelements = {n}')
            + weld("wall", "ground", "rod")
            + output("tip", "rod.tip", "position"),
            still(tip=[np.nan, -y, 0]),
            {"tip": y},
            f"{d} m thick, {n} pieces",
        )


@case("a rotor above its critical speed rests beside its start", "Statics.RotorAboveItsCriticalSpeed; trust turning_shaft")
def whirl():
    for e, share in ((1e-3, 0.5), (1e-3, 1.5), (1e-3, 3.0), (1e-5, 10.0), (1e-2, 1.2)):
        k, m = 400.0, 1.0
        W = share * math.sqrt(k / m)
        x = e * W * W / (k / m - W * W)
        text = disc_on_slides(W, k, 0.0, 0.0).replace("output_rate = 100.0", 'output_rate = 100.0\nstart = "static"')
        text = text.replace(
            "centre_of_mass = [0.0, 0.0, 0.0]\nframes = {  }\n\n[[joint]]", f"centre_of_mass = [{e}, 0, 0]\nframes = {{ }}\n\n[[joint]]", 1
        )
        yield Scene(
            text + output("x", "x", "value") + output("y", "y", "value"),
            still(x=[x], y=[0.0]),
            {"x": abs(x), "y": abs(x)},
            f"{share} of the critical speed, {e} m",
        )
    # An elastic shaft of length 0.5: whirl of an eccentric disc.
    s, A, I = circle(0.01)
    L, m, e = 0.5, 2.0, 1e-3
    k = 48 * E * I / L**3
    for share in (0.5, 2.0, 4.0):
        W = share * math.sqrt(k / m)
        x = e * W * W / (k / m - W * W)
        light = {"E": E, "rho": 1.0, "poisson": 0.3}
        yield Scene(
            simulation(0.01, 1000, start="static")
            + rigid("chuck", 1.0, (1, 1, 1))
            + beam("shaft", L, s, light, "frames = { middle = 0.5 }")
            + rigid("disc", m, (1e-6, 1e-6, 1e-6), centre=(0, e, 0))
            + joint("spin", "revolute", "ground", "chuck", f'axis = [1, 0, 0]\nmotion = "{W}*t"')
            + joint("left", "constant-velocity", "chuck", "shaft", "axis = [1, 0, 0]")
            + joint("right", "point-on-line", "ground", "shaft.tip", "axis = [1, 0, 0]")
            + weld("key", "shaft.middle", "disc")
            + '[[output]]\nname = "p"\nof = "shaft.middle"\nquantity = "position"\nrelative_to = "chuck"\n\n',
            still(p=[np.nan, x, 0.0]),
            {"p": abs(x)},
            f"elastic shaft, {share} of the critical speed",
        )


def elastica(P, EI, L):
    """Tip (x, y) of a strip clamped along x under a dead load P along y: shooting for the tip's angle."""

    def end(m0):
        f = lambda s, y: [y[1], -P * math.cos(y[0]) / EI, math.cos(y[0]), math.sin(y[0])]
        return solve_ivp(f, (0, L), [0.0, m0, 0.0, 0.0], rtol=1e-11, atol=1e-13).y[:, -1]

    k = brentq(lambda m0: end(m0)[1], 0.0, P * L / EI * 1.0001, xtol=1e-12)
    return end(k)[2:4]


@case(
    "a static strip in large deflection: the elastica, or refused, or told",
    "Statics.ElasticaOfAMixedBeam, BendingBeyondLinear*; far_bent_strip",
)
def strip():
    L, b, h = 1.0, 0.03, 0.001
    EI = E * b * h**3 / 12
    s = f'{{ shape = "rectangle", width = {b}, height = {h} }}'
    for load in (0.1, 0.3, 1.0, 3.0, 10.0):
        x, y = elastica(load * EI / L**2, EI, L)
        for words in (
            "",
            'model = "mixed"',
            'model = "mixed"\nvolumes = 20',
            'model = "modal"\nmodes = { bending_xy = [1, 2, 3] }',
            'model = "lumped"\nelements = 40',
        ):
            yield Scene(
                simulation(0.01, 100, start="static")
                + beam("strip", L, s, STEEL, words)
                + weld("wall", "ground", "strip")
                + force("force", "strip.tip", load * EI / L**2, (0, 1, 0))
                + output("tip", "strip.tip", "position"),
                still(tip=[x, y, 0.0]),
                {"tip": math.hypot(1 - x, y)},
                f"P L^2/EI {load}, {words}".replace("\n", ", "),
            )


@case("snap-through of two bars at a static start: the state beyond", "Statics.SnapThroughFindsTheStateBeyond; stability snapped_roof")
def snapped():
    for half, rise, d, elements in ((1.0, 0.05, 0.01, None), (1.0, 0.1, 0.01, 2), (0.2, 0.01, 0.002, None), (0.4, 0.012, 0.04, None)):
        s, A, I = circle(d)
        length = math.hypot(half, rise)
        limit = 2 * E * A * (rise / length) ** 3 / (3 * math.sqrt(3))
        for share in (0.5, 0.9, 1.1, 2.0, 10.0):
            load = share * limit
            force_at = lambda y: 2 * E * A * (length - math.hypot(half, y)) / length * y / math.hypot(half, y) - load
            # Below the limit load the bars stay up, unless they buckle before: slender ones do at a part of it.
            up = (
                share < 1
                and E * A * (1 - math.hypot(half, pinned_truss_upper(force_at, rise)) / length) < math.pi**2 * E * I / length**2
            )
            y = pinned_truss_upper(force_at, rise) if up else brentq(force_at, -50 * rise, -rise)
            yield Scene(
                simulation(0.01, 100, start="static") + bars(half, rise, d, load, "revolute", elements),
                still(crown=[half, y, 0.0]),
                {"crown": abs(rise - y)},
                f"{share} of the limit, half {half}, rise {rise}",
            )


def pinned_truss_upper(force_at, rise):
    """The root between the limit point, at rise / sqrt(3), and the start."""
    return brentq(force_at, rise / math.sqrt(3) * 1.02, rise)


@case('"t <= 0 ? F : 0" at a static start takes F; the motion let go after it', "Statics.WhatHoldsAtTimeZero; stability let_go, released")
def released():
    for k, m, F in ((100.0, 1.0, 5.0), (1e6, 2.0, 1e4), (1e-2, 1e-3, 1e-4)):
        T = 3 * 2 * math.pi * math.sqrt(m / k)
        yield Scene(
            simulation(T, 100 / T, start="static")
            + rigid("m", m, (m,) * 3)
            + joint("x", "prismatic", "ground", "m", f"axis = [1, 0, 0]\nspring = {{ stiffness = {k} }}")
            + force("force", "m", f"t <= 0 ? {F} : 0", (1, 0, 0))
            + output("x", "x", "value"),
            lambda t, k=k, m=m, F=F: {"x": oscillator(m, 0.0, k, F / k, 0.0, t)[:, None]},
            {},
            f"{k} N/m",
        )


@case("prescribed accelerations at t = 0 are named where nothing rests", "Statics.WhatHoldsAtTimeZero; stability accelerated_rest")
def accelerated():
    yield Scene(
        simulation(1.0, 100, start="static")
        + rigid("cart", 1.0, (1,) * 3)
        + rigid("m", 1.0, (1,) * 3)
        + joint("drive", "prismatic", "ground", "cart", 'axis = [1, 0, 0]\nmotion = "3*t*t"')
        + joint("slide", "prismatic", "cart", "m", "axis = [1, 0, 0]")
        + output("x", "slide", "value"),
        None,
        {},
        "free on a driven cart",
    )
