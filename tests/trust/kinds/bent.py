"""Beams that bend far in the plane: leaf springs, flexures, fins, plastic rods, strips, struts. Nobody says how to model them; some scenes
choose elements or effects as a beginner would. The truth is plane_elastic.py: geometrically exact beams in absolute coordinates."""
import math

from kinds.plane import bar, run_up
from truths.plane_machine import Machine, ramp, smooth, swing
from scene import pick

SPRING_STEEL = {"E": 2.06e11, "rho": 7850.0, "poisson": 0.29}
PLASTIC = {"E": 2.5e9, "rho": 1200.0, "poisson": 0.38}
RUBBER = {"E": 2e7, "rho": 1100.0, "poisson": 0.47}
# Of a truth: an element turns by a twentieth of what its beam does.
FINE = 12


def told(r, machine, what, **more):
    """Two thirds of the scenes as they stand, a third asks for 1e-1 to 1e-2."""
    if r.random() < 0.67:
        return machine.scene(what, **more)
    a = pick(r, 1e-1, 3e-2, 1e-2)
    return machine.scene(f"{what}; accuracy {a:g}", words=("--accuracy", repr(a)), claim=a, **more)


def chosen(r):
    """What an author may write of a beam: mostly nothing."""
    kind = r.random()
    if kind < 0.6:
        return ""
    if kind < 0.75:
        return f'model = "finite-element"\nelements = {r.randint(3, 12)}'
    if kind < 0.9:
        return 'effects = ["bending_xy", "stiffening"]' if r.random() < 0.5 else 'effects = ["bending_xy", "axial", "stiffening"]'
    return 'effects = ["bending_xy"]'


def parallel_guide(r):
    """A stage on two parallel leaf springs is pushed aside, by up to a quarter of their length; stage, reaction, section forces"""
    m = pick(r, SPRING_STEEL, PLASTIC)
    L = r.uniform(0.03, 0.3)
    s, _, mass = bar(r, L, (40, 150), m, ("rectangle",))
    b, load = L * r.uniform(0.3, 1), 2 * mass * r.uniform(0.5, 5)
    k = 2 * 12 * m["E"] * s["iz"] / L**3
    w = math.sqrt(k / (load + 0.74 * mass))
    way = r.uniform(0.05, 0.25)
    T = 2 * math.pi / w * r.uniform(1, 3)
    d = Machine(1.4 * T, gravity=(0, pick(r, 0.0, -9.81) * min(1.0, 0.2 * k * L / 10 / (load * 9.81))))
    more = chosen(r)
    d.beam("left", L, s, m, (0, 0, math.pi / 2), elements=FINE, damping=0.03 / w, more=more)
    d.beam("right", L, s, m, (b, 0, math.pi / 2), elements=FINE, damping=0.03 / w, more=more)
    d.rigid("stage", load, load * b**2 / 6, (0, L, 0), centre=(b / 2, 0), frames={"end": (b, 0)})
    d.weld("a", (0, 0), "left.root")
    d.weld("b", (b, 0), "right.root")
    d.weld("c", "left.tip", "stage")
    d.weld("e", "right.tip", "stage.end")
    d.force("stage", (1, 0), ramp(k * L * way, T))
    d.position("place", "stage")
    d.reaction("foot", "a")
    d.section("inside", "right", 4)
    return told(r, d, f"pushed by {way:.2g} of its springs' length, L/h {L / s['height']:.0f}, {more or 'auto'}")


def cross_flexure(r):
    """A block on two crossed leaf springs is turned by a moment, by up to 20 degrees; block, reaction, section forces"""
    m = pick(r, SPRING_STEEL, PLASTIC)
    L = r.uniform(0.02, 0.2)
    s, _, mass = bar(r, L, (40, 120), m, ("rectangle",))
    half = r.uniform(0.5, 0.9)
    x, y = L * math.sin(half) / 2, L * math.cos(half)
    load = 2 * mass * r.uniform(1, 5)
    J = load * L**2 * r.uniform(0.1, 0.5)
    k = 2 * m["E"] * s["iz"] / L * r.uniform(1.0, 1.2)
    angle = r.uniform(0.05, 0.35)
    w = math.sqrt(k / (J + load * (L / 3) ** 2))
    T = 2 * math.pi / w * r.uniform(1, 3)
    d = Machine(1.4 * T)
    more = chosen(r)
    d.beam("one", L, s, m, (-x, 0, math.pi / 2 - half), elements=FINE, damping=0.03 / w, more=more)
    d.beam("two", L, s, m, (x, 0, math.pi / 2 + half), elements=FINE, damping=0.03 / w, more=more)
    x1, y1 = -x + L * math.sin(half), L * math.cos(half)
    x2 = x - L * math.sin(half)
    d.rigid("block", load, J, (0, y, 0), centre=(0, 0.1 * L), frames={"right": (x1, y1 - y), "left": (x2, y1 - y)})
    d.weld("a", (-x, 0), "one.root")
    d.weld("b", (x, 0), "two.root")
    d.weld("c", "one.tip", "block.right")
    d.weld("e", "two.tip", "block.left")
    d.torque("block", ramp(k * angle, T))
    d.position("place", "block")
    d.reaction("foot", "a")
    d.section("inside", "two", 4)
    return told(r, d, f"turned by {angle:.2g} rad, L/h {L / s['height']:.0f}, {more or 'auto'}")


def plastic_crank(r):
    """A slider-crank with a slender plastic rod that bends by 3 to 20 degrees; block, rod's middle, crank's reaction"""
    m = pick(r, PLASTIC, RUBBER)
    a = r.uniform(0.02, 0.1)
    L = a * r.uniform(2.5, 4)
    s, _, mass = bar(r, L, (20, 50), m, ("rectangle", "circle"))
    w1 = (math.pi / L) ** 2 * math.sqrt(m["E"] * s["iz"] / (m["rho"] * s["area"]))
    # A hinged rod that is shaken across by a w^2 at both of its ends' mean: 4/pi of half of it in its first mode.
    bend = r.uniform(0.05, 0.35)
    speed = w1 * math.sqrt(bend * L / math.pi / (0.64 * a))
    speed = min(speed, 0.6 * w1)
    T = 2 * math.pi / speed * r.uniform(0.5, 1.5)
    d = Machine(T + r.uniform(1, 2) * 2 * math.pi / speed, samples=160)
    more = chosen(r)
    d.rigid("crank", mass, mass * a * a / 3, (0, 0, 0), centre=(a / 2, 0), frames={"pin": (a, 0)})
    d.beam("rod", L, s, m, (a, 0, 0), elements=FINE, damping=0.05 / w1, places=[("middle", FINE // 2)], more=more)
    d.rigid("block", mass * r.uniform(0.1, 0.5), mass * a * a, (a + L, 0, 0))
    d.revolute("shaft", (0, 0), "crank", motion=run_up(speed, T))
    d.revolute("crank_pin", "crank.pin", "rod.root")
    d.revolute("wrist", "rod.tip", "block")
    d.prismatic("guide", (0, 0), "block", (1, 0))
    d.position("slider", "block")
    d.position("middle", "rod.middle")
    d.reaction("drive", "shaft")
    return told(r, d, f"speed/first frequency {speed / w1:.2g}, {more or 'auto'}")


def fin(r):
    """A fin is swung at its root and bends far; its tip, the motor's moment, section forces"""
    m = pick(r, PLASTIC, RUBBER, SPRING_STEEL)
    L = r.uniform(0.05, 0.5)
    s, w1, mass = bar(r, L, (25, 100), m, ("rectangle",))
    ratio = r.uniform(0.3, 0.8)
    w = ratio * w1
    amplitude = r.uniform(0.1, 0.5) * (1 - ratio**2)
    d = Machine(2 * math.pi / w * r.uniform(2, 3.5), samples=160)
    more = chosen(r)
    load = mass * pick(r, 0.0, r.uniform(0.05, 0.2))
    d.beam("fin", L, s, m, (0, 0, 0), elements=FINE, damping=0.1 / w1, places=[("middle", FINE // 2)], more=more)
    d.revolute("root", (0, 0), "fin.root", motion=swing(amplitude, w))
    if load:
        d.rigid("weight", load, load * (0.05 * L) ** 2, (L, 0, 0))
        d.weld("glue", "fin.tip", "weight")
    d.position("tip", "fin.tip")
    d.position("middle", "fin.middle")
    d.reaction("motor", "root")
    d.section("inside", "fin", 6)
    return told(r, d, f"at {ratio:.2g} of its first frequency by {amplitude:.2g} rad, L/h {L / s['height']:.0f}, {more or 'auto'}")


def bow(r):
    """A cantilever pulled far aside, at rest, is let go within a third of its period; tip, reaction, section forces"""
    m = pick(r, PLASTIC, SPRING_STEEL)
    L = r.uniform(0.1, 1)
    s, w1, mass = bar(r, L, (40, 150), m, ("rectangle", "circle"))
    pulled = r.uniform(0.2, 1.5)  # P L^2/EI: 4 to 24 degrees at the tip
    P = pulled * m["E"] * s["iz"] / L**2
    T = 2 * math.pi / w1 * r.uniform(0.3, 0.6)
    d = Machine(2 * math.pi / w1 * r.uniform(2, 4), samples=160, start="static")
    more = chosen(r)
    d.beam("bow", L, s, m, (0, 0, 0), elements=FINE, damping=0.03 / w1, more=more)
    d.weld("grip", (0, 0), "bow.root")
    text = f"{P!r}*(t < {T!r} ? (1 + cos(pi*t/{T!r}))/2 : 0)"
    d.force("bow.tip", (0, 1), (text, lambda t: P * ((1 + math.cos(math.pi * t / T)) / 2 if t < T else 0.0)))
    d.position("tip", "bow.tip")
    d.reaction("hand", "grip")
    d.section("inside", "bow", 6)
    return told(r, d, f"P L^2/EI {pulled:.2g}, L/h {L / s['height']:.0f}, {more or 'auto'}", rest=True)


def strip_pendulum(r):
    """A strip hinged at its end falls from rest at an angle and bends under its weight by 3 to 20 degrees; tip, reaction"""
    m = pick(r, PLASTIC, RUBBER, SPRING_STEEL)
    L = r.uniform(0.1, 0.8)
    soft = r.uniform(0.3, 2.5)  # m g L^2/EI; hinged-free in free fall it bends by 1/100 of it or so
    h = math.sqrt(12 * m["rho"] * 9.81 * L**3 / m["E"] / soft)
    if not 15 < L / h < 400:
        return None
    s, w1, mass = bar(r, L, (L / h, 1.01 * L / h), m, ("rectangle",))
    load = mass * pick(r, 0.0, r.uniform(0.1, 1))
    a0 = r.uniform(-0.8, 0.4)
    period = 2 * math.pi * math.sqrt(2 * L / 3 / 9.81)
    d = Machine(period * r.uniform(0.5, 1.0), samples=160, gravity=(0, -9.81))
    more = chosen(r)
    d.beam("strip", L, s, m, (0, 0, a0), elements=FINE, damping=0.05 / w1, places=[("middle", FINE // 2)], more=more)
    d.revolute("pin", (0, 0), "strip.root")
    if load:
        d.rigid("weight", load, load * (0.1 * L) ** 2, (L * math.cos(a0), L * math.sin(a0), a0))
        d.weld("glue", "strip.tip", "weight")
    d.position("tip", "strip.tip")
    d.position("middle", "strip.middle")
    d.reaction("held", "pin")
    return told(r, d, f"m g L^2/EI {soft:.2g}, load {load / mass:.2g}, L/h {L / s['height']:.0f}, {more or 'auto'}")


def strut(r):
    """A clamped strut is pressed slowly beyond what it carries, a small force says to which side; tip, moment at its foot"""
    m = pick(r, PLASTIC, SPRING_STEEL)
    L = r.uniform(0.1, 1)
    s, w1, mass = bar(r, L, (40, 150), m, ("rectangle", "circle"))
    Pcr = math.pi**2 * m["E"] * s["iz"] / (4 * L * L)
    beyond = r.uniform(0.7, 1.1)
    T = 2 * math.pi / w1 * r.uniform(4, 8)
    d = Machine(1.3 * T, samples=160)
    more = chosen(r)
    d.beam("strut", L, s, m, (0, 0, math.pi / 2), elements=FINE, damping=0.3 / w1, more=more)
    d.weld("foot", (0, 0), "strut.root")
    d.force("strut.tip", (0, -1), ramp(beyond * Pcr, T))
    d.force("strut.tip", (1, 0), ramp(r.uniform(0.01, 0.05) * Pcr, 0.5 * T))
    d.position("tip", "strut.tip")
    d.reaction("held", "foot")
    return told(r, d, f"P/Pcr {beyond:.2g}, L/h {L / s['height']:.0f}, {more or 'auto'}")


def catapult(r):
    """An elastic arm throws its payload round against a spring, bending far; payload, reaction"""
    m = pick(r, PLASTIC, SPRING_STEEL)
    L = r.uniform(0.2, 1)
    s, w1, mass = bar(r, L, (30, 100), m, ("rectangle", "circle"))
    load = mass * r.uniform(0.2, 1)
    w = math.sqrt(3 * m["E"] * s["iz"] / L**3 / (load + 0.24 * mass))
    turn = r.uniform(0.4, 1.2)
    bends = r.uniform(0.1, 0.4)
    T = 2 * math.pi / w * max(0.6, math.sqrt(2 * turn / bends / 6))
    d = Machine(1.3 * T, samples=160, gravity=(0, pick(r, 0.0, -9.81)))
    more = chosen(r)
    d.beam("arm", L, s, m, (0, 0, 0), elements=FINE, damping=0.03 / w, more=more)
    d.rigid("payload", load, load * (0.05 * L) ** 2, (L, 0, 0))
    d.revolute("shaft", (0, 0), "arm.root", motion=smooth(turn, T))
    d.weld("grip", "arm.tip", "payload")
    d.position("place", "payload")
    d.reaction("motor", "shaft")
    d.section("inside", "arm", 6)
    return told(r, d, f"turned by {turn:.2g} rad in {T * w / 2 / math.pi:.2g} periods, L/h {L / s['height']:.0f}, {more or 'auto'}")


KINDS = [parallel_guide, cross_flexure, plastic_crank, fin, bow, strip_pendulum, strut, catapult]
