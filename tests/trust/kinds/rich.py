"""Flexible mechanisms in large motion, without a closed solution.

The truth is the richest model, all effects and more elements, at a tight tolerance.

What looks like an error is measured again by a method of another family before anybody is blamed."""
import math

from scene import Scene, beam, force, joint, output, pick, rigid, simulation, sizes, weld

ALL = 'effects = ["axial", "bending_xy", "bending_xz", "torsion", "stiffening", "shear"]\nelements = {}'
MIXED = 'model = "mixed"\nvolumes = {}\nelements = 2\neffects = ["axial", "bending_xy", "bending_xz", "torsion", "stiffening", "shear"]'
TIGHT = ("--method", "dirk", "--tolerance", "1e-9", "--no-error-estimate", "--no-effect-check")
OTHER = ("--method", "erk", "--tolerance", "1e-8", "--no-error-estimate", "--no-effect-check")


def pair(make, what, rich=ALL.format(14), words=(), claim=None, truth_words=TIGHT):
    """make(text of the beams' further lines) -> the scene's text."""
    divided = make(MIXED.format(6))
    return Scene(make(""), make(rich), {}, what, words=words, claim=claim, truth_words=truth_words, confirm_words=OTHER, divided=divided)


def first_bending(L, m, s, key="iz"):
    return 3.516 / L**2 * math.sqrt(m["E"] * s[key] / (m["rho"] * s["area"]))


def smooth(A, T):
    return f"t < {T!r} ? {A!r} * (t/{T!r} - sin(2*pi*t/{T!r})/(2*pi)) : {A!r}"


def spun_arm(r):
    """An arm is spun up about an axis across it: stiffening, lag, stretch; sometimes with a force across the plane."""
    L, m, s = sizes(r, slender=(15, 60), shapes=("rectangle", "circle", "tube"))
    w1 = first_bending(L, m, s)
    speed = w1 * 10 ** r.uniform(-1.5, 0.5)
    T = 2 * math.pi / w1 * r.uniform(1.5, 4)
    # Angle with rate speed (1 - cos(2 pi t / 2T))/2 until T.
    motion = f"t < {T!r} ? {speed!r} * (t/2 - {T!r}/(2*pi)*sin(pi*t/{T!r})) : {speed!r} * (t - {T!r}/2)"
    duration = 1.7 * T
    hub = L * pick(r, 0.0, r.uniform(0, 0.5))
    F = 3 * m["E"] * s["iy"] / L**2 * 1e-3 * pick(r, 0.0, 0.0, 1.0)

    def make(more):
        text = (
            simulation(duration, 200 / duration)
            + rigid("hub", 1.0, (1, 1, 1), {"rim": (hub, 0, 0)})
            + beam("arm", L, s["text"], m, more)
            + joint("shaft", "revolute", "ground", "hub", f'motion = "{motion}"')
            + weld("root", "hub.rim", "arm.root")
        )
        return (
            text
            + (force("force", "arm.tip", F, (0, 0, 1)) if F else "")
            + output("tip", "arm.tip", "displacement")
            + output("place", "arm.tip", "position")
        )

    return pair(
        make, f"speed/first frequency {speed / w1:.2g}, length/height {L / s['height']:.2g}{', force across the plane' if F else ''}"
    )


def payload_arm(r):
    """A driven arm with a payload beside its plane: bending out of the plane and twist."""
    L, m, s = sizes(r, slender=(15, 50), shapes=("rectangle", "tube", "box", "circle"))
    mass = m["rho"] * s["area"] * L * 10 ** r.uniform(-1, 0.7)
    e = L * r.uniform(0.02, 0.3)
    w1 = first_bending(L, m, s) / math.sqrt(1 + 4 * mass / (m["rho"] * s["area"] * L))
    T, A = 2 * math.pi / w1 * r.uniform(1, 3), r.uniform(0.05, 1)
    duration = 1.5 * T
    J = mass * (0.1 * L) ** 2

    def make(more):
        return (
            simulation(duration, 200 / duration)
            + beam("arm", L, s["text"], m, more)
            + rigid("load", mass, (J, J, J), {"p": (0, 0, e)}, centre=(0, 0, e))
            + joint("drive", "revolute", "ground", "arm.root", f'motion = "{smooth(A, T)}"')
            + weld("grip", "arm.tip", "load")
            + output("tip", "arm.tip", "displacement")
            + output("p", "load.p", "position")
        )

    return pair(make, f"payload {mass / (m['rho'] * s['area'] * L):.2g} of the arm, {e / L:.2g} of its length beside the plane")


def elastic_pendulum(r):
    """A beam hangs on a hinge and swings under gravity, stiff to soft."""
    L, m, s = sizes(r, slender=(30, 120), shapes=("rectangle",))
    start = r.uniform(-1.5, 0.5)
    droop = 10 ** r.uniform(-4, -1.5)  # deflection of the clamped beam under its weight / length
    g = droop * 8 * m["E"] * s["iz"] / (m["rho"] * s["area"] * L**3)
    duration = 2 * math.pi * math.sqrt(2 * L / (3 * g)) * r.uniform(0.4, 1.0)
    make = lambda more: (
        simulation(duration, 200 / duration, (0, -g, 0))
        + beam("rod", L, s["text"], m, more)
        + joint("pivot", "revolute", "ground", "rod.root", f"initial = {{ value = {start!r} }}")
        + output("tip", "rod.tip", "position")
    )
    return pair(make, f"droop {droop:.1e} of the length, from {math.degrees(start):.0f} degrees", rich=ALL.format(12))


def let_go(r):
    """A clamped beam falls from its straight shape under gravity: small to large deflection."""
    L, m, s = sizes(r, slender=(40, 150), shapes=("rectangle",))
    load = 10 ** r.uniform(-1.5, 1.0)
    EI, rhoA = m["E"] * s["iz"], m["rho"] * s["area"]
    g = load * EI / (rhoA * L**3)
    duration = 2 * math.pi / first_bending(L, m, s) * 1.2
    make = lambda more: (
        simulation(duration, 200 / duration, (0, -g, 0))
        + beam("strip", L, s["text"], m, more)
        + weld("clamp", "ground", "strip.root")
        + output("tip", "strip.tip", "position")
    )
    scene = pair(make, f"weight L^3/EI = {load:.2g}", rich=MIXED.format(10))
    if r.random() < 0.3:
        scene.words, scene.claim = ("--accuracy", "1e-2"), 1e-2
        scene.what += ", accuracy 1e-2"
    return scene


def elastic_slider_crank(r):
    """A slider-crank with an elastic rod, driven evenly or by a torque."""
    L, m, s = sizes(r, slender=(15, 60), shapes=("rectangle", "circle"))
    a = L / r.uniform(2, 5)
    w1 = math.pi**2 / L**2 * math.sqrt(m["E"] * s["iz"] / (m["rho"] * s["area"]))
    speed = w1 / r.uniform(5, 40)
    duration = 2 * math.pi / speed * 1.2
    rod = m["rho"] * s["area"] * L
    slider = rod * 10 ** r.uniform(-1, 1)
    p0 = r.uniform(0.3, 1.3)
    tilt = -math.asin(a / L * math.sin(p0)) - p0

    def make(more):
        T = 0.5 * duration
        motion = f"{p0!r} + {speed!r} * (t < {T!r} ? t/2 - {T!r}/(2*pi)*sin(pi*t/{T!r}) : t - {T!r}/2)"
        return (
            simulation(duration, 200 / duration)
            + rigid("crank", rod, (rod * a * a,) * 3, {"end": (a, 0, 0)})
            + beam("rod", L, s["text"], m, more)
            + rigid("slider", slider, (slider * a * a * 0.1,) * 3)
            + joint("shaft", "revolute", "ground", "crank", f'motion = "{motion}"')
            + joint("pin", "revolute", "crank.end", "rod.root", f"rotation = [0, 0, {tilt!r}]")
            + joint("wrist", "revolute", "rod.tip", "slider", f"rotation = [0, 0, {-tilt - p0!r}]")
            + joint(
                "guide",
                "prismatic",
                "ground",
                "slider",
                f"axis = [1, 0, 0]\ninitial = {{ value = {a * math.cos(p0) + math.sqrt(L * L - (a * math.sin(p0)) ** 2)!r} }}",
            )
            + output("x", "slider", "position")
            + output("middle", "rod.node[5]" if "elements" not in more else "rod.node[7]", "displacement")
        )

    return pair(make, f"{w1 / speed:.3g} bending periods a turn, slider {slider / rod:.2g} rods")


def arch(r):
    """A shallow arch of two beams, hinged or clamped at its ends, pushed at its top: held lengths."""
    L, m, s = sizes(r, slender=(20, 60), shapes=("rectangle",))
    angle = r.uniform(0.1, 0.5)
    a = L * math.cos(angle)
    ends, top = pick(r, ("revolute", "revolute"), ("weld", "revolute"), ("weld", "weld"), ("revolute", "weld"))
    EA, EI = m["E"] * s["area"], m["E"] * s["iz"]
    P = min(0.02 * 2 * EA * math.sin(angle) ** 3, 0.2 * math.pi**2 * EI / L**2 * 2 * math.sin(angle)) * r.uniform(0.2, 1)
    w = math.pi**2 / L**2 * math.sqrt(EI / (m["rho"] * s["area"]))
    T = 2 * math.pi / w
    duration = 3 * T

    def make(more):
        return (
            simulation(duration, 200 / duration)
            + beam("left", L, s["text"], m, more)
            + beam("right", L, s["text"], m, more)
            + joint("a", ends, "ground", "left.root", f"position = [{-a!r}, 0, 0]\nrotation = [0, 0, {angle!r}]")
            + joint("b", ends, "ground", "right.root", f"position = [{a!r}, 0, 0]\nrotation = [0, 0, {math.pi - angle!r}]")
            + joint("top", top, "left.tip", "right.tip", f"rotation = [0, 0, {math.pi - 2 * angle!r}]")
            + force("force", "left.tip", f"{P!r} * (t < {T!r} ? sin(pi*t/{2 * T!r})^2 : 1)", (0, -1, 0))
            + output("top", "left.tip", "position")
        )

    return pair(make, f"{math.degrees(angle):.0f} degrees, ends {ends}, top {top}", rich=ALL.format(12))


def start_up_loads(r):
    """A driven elastic arm: moment and force in its bearing, and acceleration of its tip, at the default tolerance."""
    L, m, s = sizes(r, slender=(20, 60), shapes=("rectangle", "circle"))
    w1 = first_bending(L, m, s)
    T, A = 2 * math.pi / w1 * r.uniform(1.5, 6), r.uniform(0.1, 1.5)
    duration = 1.2 * T
    quantity = pick(r, "reaction", "reaction", "acceleration")

    def make(more):
        return (
            simulation(duration, 200 / duration)
            + beam("arm", L, s["text"], m, more)
            + joint("drive", "revolute", "ground", "arm.root", f'motion = "{smooth(A, T)}"')
            + output("load", "drive" if quantity == "reaction" else "arm.tip", quantity)
        )

    return pair(make, f"{quantity}, {T * w1 / 6.28:.2g} periods long", rich=ALL.format(12))


def space_arm(r):
    """Two elastic arms and an elbow in space, driven about oblique axes."""
    L, m, s = sizes(r, slender=(20, 50), shapes=("rectangle", "tube", "circle", "box"))
    L2 = L * r.uniform(0.5, 1)
    w1 = first_bending(L + L2, m, s) / 2
    T = 2 * math.pi / w1 * r.uniform(1, 2.5)
    duration = 1.3 * T
    a, b = r.uniform(0.1, 0.8), r.uniform(0.1, 0.8)
    axis = [round(r.uniform(-1, 1), 3) for _ in range(3)]

    def make(more):
        return (
            simulation(duration, 200 / duration)
            + beam("upper", L, s["text"], m, more)
            + beam("fore", L2, s["text"], m, more)
            + joint("shoulder", "revolute", "ground", "upper.root", f'axis = [0, 0, 1]\nmotion = "{smooth(a, T)}"')
            + joint("elbow", "revolute", "upper.tip", "fore.root", f'axis = {axis}\nrotation = [0.3, 0.4, 1.0]\nmotion = "{smooth(b, T)}"')
            + output("tip", "fore.tip", "position")
            + output("bent", "upper.tip", "displacement")
        )

    return pair(make, f"axis {axis}", rich=ALL.format(8))


KINDS = [spun_arm, payload_arm, elastic_pendulum, let_go, elastic_slider_crank, arch, start_up_loads, space_arm]
