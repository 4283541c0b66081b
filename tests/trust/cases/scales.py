"""Extreme numbers: strong dampers, stiff bushings, fast spin, thin films, tiny motions; kept modes; asked accuracies."""
import math

import numpy as np
from cases.case import case
from cases.common import E, G, RHO, STEEL, after_a_step, circle
from cases.effects import bars
from scene import Scene, beam, force, joint, output, rigid, simulation, spring, weld
from truths.formulas import Linear, beam_matrices, ode, oscillator


def column(values):
    return np.asarray(values, float).reshape(-1, 1)


@case(
    "snap-through of a shallow arch of bars that stretch and do not bend, damped; told that they would buckle",
    "stability snap_through, arch_in_motion; Statics.SnapThrough*",
)
def snap_arch():
    half, rise, d, m = 0.5, 0.05, 0.01, 5.0
    s, A, _ = circle(d)
    length = math.hypot(half, rise)
    limit = 2 * E * A * (rise / half) ** 3 / (3 * math.sqrt(3))
    mass = m + RHO * A * length * 2 / 3  # bars that turn about their feet: a third each of both
    for share in (1.5, 3.0):
        load = share * limit
        c = 2000.0

        def truth(t, load=load, c=c):
            def f(_, y):
                now = math.hypot(half, y[0])
                N = E * A * (now - length) / length
                return [y[1], (-2 * N * y[0] / now - load - c * y[1]) / mass]

            return {"load": np.c_[np.nan * t, ode(f, [rise, 0.0], t)[:, 0], np.nan * t]}

        text = bars(half, rise, d, load, "revolute").replace('name = "crown"\nof', 'name = "load"\nof')
        text = text.replace('kind = "beam"\n', 'kind = "beam"\neffects = ["axial"]\n')
        text += (
            rigid("weight", m, (1e-3,) * 3)
            + joint(
                "way",
                "prismatic",
                "ground",
                "weight",
                f"axis = [0, 1, 0]\nposition = [{half}, 0, 0]\n" f"initial = {{ value = {rise} }}\nspring = {{ damping = {c} }}",
            )
            + joint("hang", "revolute", "weight", "a.tip")
        )
        yield Scene(simulation(0.1, 1000) + text, truth, {}, f"{share} of the limit load", claim=0.02)


@case(
    "damping far beyond critical (1e6 times), in a joint, a spring-damper and a bushing; 2e7 N s/m on 1 kg",
    "stability strong_*_damper, all_damping",
)
def strong_damping():
    for m, k, c in ((1.0, 1e5, 2e7), (1.0, 1e4, 2e8), (1e-3, 1.0, 6e4), (1e3, 1e7, 2e11), (1.0, 0.0, 2e7)):
        for by in ("joint", "spring", "bushing"):
            if by == "spring":
                more = spring("m", "ground", k, c)
            elif by == "bushing":
                more = f'[[force]]\nkind = "bushing"\non = "m"\nstiffness = [{k}, 0, 0, 0, 0, 0]\ndamping = [{c}, 0, 0, 0, 0, 0]\n\n'
            else:
                more = ""
            own = f"spring = {{ stiffness = {k}, damping = {c} }}" if by == "joint" else ""
            T = min(10.0, 3 * c / k) if k else 1.0
            for load in (0.0, 50.0):
                x0 = 0.1
                scale = x0 if k else None

                def truth(t, m=m, k=k, c=c, load=load):
                    if not k:
                        return {"x": column(x0 + load / c * (t - m / c * (1 - np.exp(-c / m * t))))}
                    return {"x": column(load / k + oscillator(m, c, k, x0 - load / k, 0.0, t))}

                if not k and not load:
                    continue
                yield Scene(
                    simulation(T, 100 / T)
                    + rigid("m", m, (1e-3,) * 3)
                    + joint("way", "prismatic", "ground", "m", f"axis = [1, 0, 0]\ninitial = {{ value = {x0} }}\n{own}")
                    + more
                    + (force("force", "m", load, (1, 0, 0)) if load else "")
                    + output("x", "way", "value"),
                    truth,
                    {"x": scale} if scale else {},
                    f"{by} {m} kg {k} N/m {c} N s/m, {load} N",
                )


@case("a bushing of 1e15 N/m", "stability rigid_bushing, undamped_bushing, endless_vibration")
def hard_bushing():
    for damping, gravity in ((0.0, -9.81), (1e7, -9.81), (1e3, -9.81), (0.0, 0.0)):
        yield Scene(
            simulation(1.0, 100, (0, gravity, 0))
            + rigid("m", 1.0, (1e-2,) * 3)
            + rigid("base", 1.0, (1e-2,) * 3)
            + joint("drive", "prismatic", "ground", "base", 'axis = [1, 0, 0]\nmotion = "0.1*sin(2*t)"')
            + joint("f", "free", "ground", "m")
            + '[[force]]\nkind = "bushing"\non = "m"\nfrom = "base"\n'
            + f"stiffness = [1e15, 1e15, 1e15, 1e15, 1e15, 1e15]\ndamping = {[damping] * 6}\n\n"
            + output("p", "m", "position"),
            lambda t: {"p": np.c_[0.1 * np.sin(2 * t), 0 * t, 0 * t]},
            {},
            f"damping {damping}, gravity {gravity}, on a driven base",
        )


@case("a bushing whose ends turn against each other: right below half a turn, told beyond", "stability turned_bushing")
def turned_bushing():
    for rate, k, beyond in ((2.0, 1e-6, False), (4.0, 0.01, True), (300.0, 0.01, True), (300.0, 0.0, False)):
        yield Scene(
            simulation(1.0, 20)
            + rigid("wheel", 1.0, (1.0, 1.0, 1.0))
            + joint("fly", "free", "ground", "wheel", f"initial = {{ rate = [0, 0, 0, 0, 0, {rate}] }}")
            + f'[[force]]\nkind = "bushing"\non = "wheel"\nstiffness = [1, 1, 1, {k}, {k}, {k}]\n\n'
            + output("w", "wheel", "angular_velocity"),
            None if beyond else lambda t, rate=rate: {"w": np.c_[0 * t, 0 * t, rate + 0 * t]},
            {"w": rate},
            f"{rate} rad/s for a second, {k} N m/rad",
        )


@case("a body that spins at 1e6 rad/s for 1e5 turns, a translation at 1e7 m/s", "stability fast_wheel, fast_spin, fast_flight")
def fast():
    T = 1e5 * 2 * math.pi / 1e6
    yield Scene(
        simulation(T, 100)
        + rigid("m", 1.0, (1e-3, 1e-3, 2e-3))
        + joint("pin", "revolute", "ground", "m", "initial = { rate = 1e6 }")
        + output("a", "pin", "value"),
        lambda t: {"a": column(1e6 * t)},
        {},
        "on a shaft",
    )
    for J in ((1e-3, 1e-3, 2e-3), (1e-3, 1e-3, 1e-3), (1e-3, 2e-3, 3e-3)):
        yield Scene(
            simulation(T, 100)
            + rigid("m", 1.0, J)
            + joint("fly", "free", "ground", "m", "initial = { rate = [0, 0, 0, 0, 0, 1e6] }")
            + output("w", "m", "angular_velocity"),
            lambda t: {"w": np.c_[0 * t, 0 * t, 1e6 + 0 * t]},
            {"w": 1e6},
            f"free, inertia {J}",
        )
    for kind, rate, words in (("free", "[1e7, 0, 0, 0, 0, 0]", ""), ("prismatic", "1e7", "axis = [1, 0, 0]")):
        yield Scene(
            simulation(1.0, 100, (0, 0, -9.81) if kind == "free" else (-9.81, 0, 0))
            + rigid("m", 1.0, (1e-3,) * 3)
            + joint("fly", kind, "ground", "m", f"{words}\ninitial = {{ rate = {rate} }}")
            + output("v", "m", "velocity")
            + output("p", "m", "position"),
            lambda t, k=kind: {
                "v": np.c_[1e7 - (9.81 * t if k == "prismatic" else 0 * t), 0 * t, -9.81 * t if k == "free" else 0 * t],
                "p": np.c_[1e7 * t, 0 * t, 0 * t],
            },
            {"v": 9.81},
            f"{kind} at 1e7 m/s",
        )


@case("a beam of 500 elements in space", "stability five_hundred_elements")
def many_elements():
    s, A, I = circle(0.02)
    F = 20.0
    M, K = beam_matrices(1.0, E * I, RHO * A, 30)
    f = np.zeros(len(M))
    f[-2] = F
    for more in ("elements = 500", "elements = 500\nkeep_modes = 4"):
        yield Scene(
            simulation(0.1, 500)
            + beam("rod", 1.0, s, STEEL, f'{more}\neffects = ["bending_xy", "bending_xz"]')
            + weld("wall", "ground", "rod")
            + force("force", "rod.tip", F, (0, 1, 0))
            + force("force", "rod.tip", 2 * F, (0, 0, 1))
            + output("tip", "rod.tip", "displacement"),
            lambda t: {"tip": np.outer(after_a_step(M, K, f, t)[:, -2], [0, 1, 2])},
            {},
            more.replace("\n", ", "),
        )


@case("a thin film of 1 nm pushed at its tip; and deep in gravity", "stability thin_film, struck_film")
def film():
    b, h, L = 1e-3, 1e-9, 1e-5
    A, iz = b * h, b * h**3 / 12
    s = f'{{ shape = "rectangle", width = {b}, height = {h} }}'
    F = 1e-2 * E * iz / L**2
    M, K = beam_matrices(L, E * iz, RHO * A)
    f = np.zeros(len(M))
    f[-2] = F
    T = 3 * 2 * math.pi / Linear(M, K).omega[0]
    yield Scene(
        simulation(T, 100 / T)
        + beam("film", L, s, STEEL)
        + weld("wall", "ground", "film")
        + force("force", "film.tip", F, (0, 1, 0))
        + output("tip", "film.tip", "displacement"),
        lambda t: {"tip": np.c_[np.nan * t, after_a_step(M, K, f, t)[:, -2], np.nan * t]},
        {},
        "struck",
    )
    yield Scene(
        simulation(1.0, 100, (0, -9.81, 0))
        + beam("film", 1.0, s, STEEL)
        + weld("wall", "ground", "film")
        + output("tip", "film.tip", "displacement"),
        None,
        {},
        "1 m long under its weight: told or refused",
    )


@case(
    "motion far below the size of the mechanism: 12 nm, 1.2 um and 1 pm of a 1 m cantilever, with and without an asked accuracy",
    "stability nanometres, micrometres",
)
def tiny():
    s, A, I = circle(0.02)
    M, K = beam_matrices(1.0, E * I, RHO * A, 20, 6 / 7 * G * A, RHO * I)
    f = np.zeros(len(M))
    f[-2] = 1.0
    for tip in (12e-9, 1.2e-6, 1e-12):
        F = tip * 3 * E * I
        for w in (0.0, 30.0):
            load = f"{F!r}*sin({w}*t)" if w else F
            shape = (lambda s, w=w: np.sin(w * s)) if w else np.ones_like
            for words, claim in (((), 0.01), (("--accuracy", "1e-2"), 0.01), (("--accuracy", "1e-3"), 1e-3)):
                yield Scene(
                    simulation(0.5, 200)
                    + beam("rod", 1.0, s, STEEL)
                    + weld("wall", "ground", "rod")
                    + force("force", "rod.tip", load, (0, 1, 0))
                    + output("tip", "rod.tip", "position"),
                    lambda t, F=F, shape=shape: {
                        "tip": np.c_[np.nan * t, Linear(M, K).respond(F * f, shape, t, fine=8000)[:, -2], np.nan * t]
                    },
                    {},
                    f"{tip} m, {'sine' if w else 'step'} {words}",
                    words,
                    claim=claim,
                )


@case(
    "keep_modes under distributed loads and gravity, seen at 0.4 L", "KeepModes.WeightAndSpread*; stability kept_weight; trust kept_modes"
)
def kept():
    s, A, I = circle(0.02)
    w = RHO * A * 9.81
    x = 0.4
    y = w * x * x / (24 * E * I) * (6 - 4 * x + x * x)
    for n in (1, 2, 4):
        for kind in ("gravity", "distributed"):
            load = "" if kind == "gravity" else force("distributed", "rod", w, (0, -1, 0))
            yield Scene(
                simulation(0.01, 100, (0, -9.81, 0) if kind == "gravity" else (0, 0, 0), start="static")
                + beam("rod", 1.0, s, STEEL, f"keep_modes = {n}\nframes = {{ place = {x} }}")
                + weld("wall", "ground", "rod")
                + load
                + output("p", "rod.place", "displacement"),
                lambda t: {"p": np.c_[np.nan * t, -y + 0 * t, np.nan * t]},
                {"p": y},
                f"{kind}, {n} kept",
            )


@case(
    "a boundary or a set of modes that does not fit the joints",
    "ModelCheck.FormsOfOtherEnds*; stability clamped_ends, other_forms; trust supports",
)
def wrong_boundary():
    s, A, I = circle(0.02)
    M, K = beam_matrices(1.0, E * I, RHO * A)
    f = np.zeros(len(M))
    f[-2] = 10.0
    for words in (
        'boundary = "clamped-clamped"',
        'boundary = "supported-supported"',
        'boundary = "clamped-supported"',
        'model = "modal"\nmodes = { bending_xy = [1, 2, 3] }\nboundary = "clamped-clamped"',
        'model = "modal"\nmodes = { bending_xy = [1, 2, 3] }\nboundary = "supported-supported"',
        'model = "modal"\nmodes = { bending_xy = [1, 2, 3] }\nboundary = "free-free"',
        'model = "modal"\nmodes = { bending_xy = [1, 2, 3] }',
    ):
        yield Scene(
            simulation(0.2, 500)
            + beam("rod", 1.0, s, STEEL, words)
            + weld("wall", "ground", "rod")
            + force("force", "rod.tip", 10.0, (0, 1, 0))
            + output("tip", "rod.tip", "position"),
            lambda t: {"tip": np.c_[np.nan * t, after_a_step(M, K, f, t)[:, -2], np.nan * t]},
            {},
            words.replace("\n", ", "),
        )
