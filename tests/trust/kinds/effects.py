"""Scenes whose author chose the effects of the beams by hand, more or less wisely, and the same left to the program.

The truth is the richest model; what the choice leaves out and is worth more than 1 % has to be warned of."""
import math

import numpy as np
from kinds.rich import ALL, first_bending, pair, smooth
from scene import beam, force, joint, output, pick, rigid, simulation, sizes, weld
from truths.formulas import rotate

DEFORMATIONS = ("bending_xy", "bending_xz", "axial", "torsion")


def by_hand(r, *wanted):
    """Lines of a beam: what it bends in, and by chance some of the rest; often what a beginner writes, sometimes nothing."""
    kind = r.random()
    if kind < 0.2:
        return ""
    if kind < 0.4:
        return (
            "without = ["
            + ", ".join(f'"{e}"' for e in pick(r, ("stiffening",), ("gyroscopic",), ("stiffening", "gyroscopic"), ("shear",)))
            + "]"
        )
    names = list(wanted) + [e for e in DEFORMATIONS + ("stiffening", "shear") if e not in wanted and r.random() < 0.25]
    return "effects = [" + ", ".join(f'"{e}"' for e in names) + "]"


def hand_spun(r):
    """An arm with a tip mass is spun up and shaken by gravity, its effects chosen by hand."""
    L, m, s = sizes(r, slender=(10, 60), shapes=("rectangle", "circle", "tube"))
    w1 = first_bending(L, m, s)
    mass = m["rho"] * s["area"] * L * pick(r, 0.0, 10 ** r.uniform(-1, 0.3))
    w1 /= math.sqrt(1 + 4 * mass / (m["rho"] * s["area"] * L))
    speed = w1 * 10 ** r.uniform(-1.5, 0.2)
    T = 2 * math.pi / w1 * r.uniform(1.5, 3)
    duration = 1.5 * T
    g = pick(r, 0.0, 1e-3 * L * w1**2)
    motion = f"t < {T!r} ? {speed!r} * (t/2 - {T!r}/(2*pi)*sin(pi*t/{T!r})) : {speed!r} * (t - {T!r}/2)"
    chosen = by_hand(r, "bending_xy")

    def make(more):
        return (
            simulation(duration, 200 / duration, (0, -g, 0))
            + beam("arm", L, s["text"], m, more or chosen)
            + joint("shaft", "revolute", "ground", "arm.root", f'motion = "{motion}"')
            + (rigid("load", mass, (mass * 1e-4 * L * L,) * 3) + weld("grip", "arm.tip", "load") if mass else "")
            + output("tip", "arm.tip", "displacement")
            + output("place", "arm.tip", "position")
        )

    return pair(make, f"speed/first frequency {speed / w1:.2g}, {chosen or 'auto'}", rich=ALL.format(12))


def hand_free(r):
    """A beam flies freely, spins and bends: its inertia follows the deformation."""
    L, m, s = sizes(r, slender=(20, 60), shapes=("rectangle", "circle"))
    w1 = first_bending(L, m, s) * 6.36  # free-free
    speed = w1 * 10 ** r.uniform(-2, -0.5)
    T = 2 * math.pi / w1
    duration = T * r.uniform(4, 10)
    F = 3 * m["E"] * s["iz"] / L**2 * 10 ** r.uniform(-3, -1.3)
    chosen = by_hand(r, "bending_xy")
    spin = [0.0, 0.0, speed]

    def make(more):
        return (
            simulation(duration, 200 / duration)
            + beam("bar", L, s["text"], m, more or chosen)
            + joint("flight", "planar", "ground", "bar.root", f"initial = {{ rate = [0.0, 0.0, {spin[2]!r}] }}")
            + force("force", "bar.tip", f"{F!r} * (t < {2 * T!r} ? sin(pi*t/{2 * T!r})^2 : 0)", (0, 1, 0), 'frame = "body"')
            + output("tip", "bar.tip", "position")
            + output("turn", "bar", "angular_velocity")
        )

    return pair(
        make,
        f"spin/first frequency {speed / w1:.2g}, push {F * L * L / (3 * m['E'] * s['iz']):.1e}, {chosen or 'auto'}",
        rich=ALL.format(12),
    )


def hand_column(r):
    """A clamped column is pressed or pulled and pushed sideways: forces along it change its stiffness."""
    L, m, s = sizes(r, slender=(15, 60), shapes=("rectangle", "circle"))
    EI = m["E"] * s["iz"]
    P = math.pi**2 * EI / (4 * L * L) * pick(r, 1, 1, -1) * 10 ** r.uniform(-3, -0.3)
    F = 3 * EI / L**2 * 10 ** r.uniform(-4, -2)
    T = 2 * math.pi / first_bending(L, m, s)
    chosen = by_hand(r, "bending_xy")
    still = r.random() < 0.5
    ramp = f"(t < {T!r} ? sin(pi*t/{2 * T!r})^2 : 1)"
    value = (lambda x: repr(x)) if still else (lambda x: f"{x!r} * {ramp}")
    duration = 0.1 * T if still else 3 * T

    def make(more):
        return (
            simulation(duration, (20 if still else 200) / duration, **({"start": "static"} if still else {}))
            + beam("column", L, s["text"], m, more or chosen)
            + joint("foot", "weld", "ground", "column.root", f"rotation = [0, 0, {math.pi / 2!r}]")
            + force("force", "column.tip", value(P), (0, -1, 0))
            + force("force", "column.tip", value(F), (1, 0, 0))
            + output("tip", "column.tip", "displacement")
        )

    scene = pair(
        make,
        f"P/Pcr {P * 4 * L * L / (math.pi**2 * EI):.2g}, {'at rest' if still else 'in motion'}, {chosen or 'auto'}",
        rich=ALL.format(10),
    )
    if still:
        scene.scales = {"tip": F * L**3 / (3 * EI)}
    return scene


def hand_bent(r):
    """A bent console of two welded beams with a load at its end, in any direction, its effects chosen by hand."""
    L, m, s = sizes(r, slender=(4, 40), shapes=("rectangle", "tube", "circle", "box"))
    L2 = L * r.uniform(0.2, 1)
    a = r.uniform(-2, 2)
    d = [round(r.uniform(-1, 1), 3) for _ in range(3)]
    F = 3 * m["E"] * min(s["iz"], s["iy"]) / (L + L2) ** 2 * 10 ** r.uniform(-4, -2.5)
    chosen = [by_hand(r, "bending_xy", "bending_xz"), by_hand(r, "bending_xy", "bending_xz")]
    axis = pick(r, (0, 0, 1), (0, 1, 0), (0, 0.6, 0.8))
    turn = [a * x for x in axis]

    def make(more):
        return (
            simulation(0.01, 200, start="static")
            + beam("one", L, s["text"], m, more or chosen[0])
            + beam("two", L2, s["text"], m, more or chosen[1])
            + weld("wall", "ground", "one.root")
            + weld("knee", "one.tip", "two.root", f"rotation = {turn}")
            + force("force", "two.tip", F, d)
            + output("end", "two.tip", "position")
            + output("knee", "one.tip", "displacement")
        )

    # At rest an output has no range in time: its size is what the load moves.
    unloaded = np.array([L, 0, 0]) + rotate(turn) @ (L2, 0, 0)
    scene = pair(make, f"bent by {math.degrees(a):.0f} degrees, {chosen[0] or 'auto'}; {chosen[1] or 'auto'}", rich=ALL.format(10))
    scene.scales = {"end": lambda true: np.linalg.norm(true[0] - unloaded), "knee": lambda true: np.linalg.norm(true[0])}
    return scene


def hand_crank(r):
    """A slider-crank, its rod's and crank's effects chosen by hand, driven fast."""
    L, m, s = sizes(r, slender=(12, 60), shapes=("rectangle", "circle"))
    a = L / r.uniform(2, 5)
    w1 = math.pi**2 / L**2 * math.sqrt(m["E"] * s["iz"] / (m["rho"] * s["area"]))
    speed = w1 / 10 ** r.uniform(0.5, 1.6)
    duration = 2 * math.pi / speed * 1.2
    rod = m["rho"] * s["area"] * L
    slider = rod * 10 ** r.uniform(-1, 1.3)
    chosen = by_hand(r, "bending_xy")
    T = 0.5 * duration
    motion = f"{speed!r} * (t < {T!r} ? t/2 - {T!r}/(2*pi)*sin(pi*t/{T!r}) : t - {T!r}/2)"

    def make(more):
        return (
            simulation(duration, 200 / duration)
            + rigid("crank", rod, (rod * a * a,) * 3, {"end": (a, 0, 0)})
            + beam("rod", L, s["text"], m, more or chosen)
            + rigid("slider", slider, (slider * a * a * 0.1,) * 3)
            + joint("shaft", "revolute", "ground", "crank", f'motion = "{motion}"')
            + joint("pin", "revolute", "crank.end", "rod.root")
            + joint("wrist", "revolute", "rod.tip", "slider")
            + joint("guide", "prismatic", "ground", "slider", f"axis = [1, 0, 0]\ninitial = {{ value = {a + L!r} }}")
            + output("x", "slider", "position")
            + output("tip", "rod.at50", "displacement")
        ).replace('kind = "beam"', 'kind = "beam"\nframes = { at50 = 0.5 }', 1)

    return pair(make, f"{w1 / speed:.3g} bending periods a turn, slider {slider / rod:.2g} rods, {chosen or 'auto'}", rich=ALL.format(12))


def hand_hoist(r):
    """A load on an elastic rod or on two in a row is lifted; stretching may be left out by hand."""
    L, m, s = sizes(r, slender=(20, 60), shapes=("circle", "rectangle"))
    EA, rod = m["E"] * s["area"], m["rho"] * s["area"] * L
    mass = rod * 10 ** r.uniform(-0.3, 1.3)
    w = math.sqrt(EA / (L * (mass + rod / 3)))
    T = 2 * math.pi / w * r.uniform(0.8, 3)
    H = L * 10 ** r.uniform(-4, -1)
    duration = 2 * T
    chosen = pick(
        r,
        "",
        'effects = ["bending_xy"]',
        'effects = ["bending_xy", "stiffening"]',
        'effects = ["axial"]',
        'without = ["axial"]',
        "effects = []",
    )
    quantity = pick(r, "displacement", "position", "reaction")

    def make(more):
        return (
            simulation(duration, 200 / duration)
            + joint("drum", "prismatic", "ground", "rope.root", f'axis = [1, 0, 0]\nmotion = "{smooth(H, T)}"')
            + beam("rope", L, s["text"], m, more or chosen)
            + rigid("load", mass, (mass * 1e-3 * L * L,) * 3)
            + weld("hook", "rope.tip", "load")
            + output("out", "drum" if quantity == "reaction" else "rope.tip", quantity)
        )

    return pair(make, f"load {mass / rod:.2g} rods, {w * T / 6.28:.2g} periods, {quantity}, {chosen or 'auto'}", rich=ALL.format(8))


KINDS = [hand_spun, hand_free, hand_column, hand_bent, hand_crank, hand_hoist]
