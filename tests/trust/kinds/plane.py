"""Engineers' elastic mechanisms in the plane, everything left to the program; every reading is compared, reactions, accelerations,
section forces, stress and powers too. The truth is plane_elastic.py, which shares nothing with the program. And two in space with
truths of a few lines."""
import math

import numpy as np
from truths.formulas import Linear, beam_matrices, of_rectangles, ode

from truths.plane_machine import Machine, ramp, smooth, swing
from scene import Scene, beam, force, joint, output, pick, rigid, section_of, simulation, weld

STEEL = {"E": 2.1e11, "rho": 7850.0, "poisson": 0.3}
ALUMINIUM = {"E": 7e10, "rho": 2700.0, "poisson": 0.33}
SILICON = {"E": 1.6e11, "rho": 2330.0, "poisson": 0.22}


def bar(r, length, slender, m, shapes=("rectangle", "circle", "tube")):
    """A section for a beam of that length, its first clamped angular frequency and its mass."""
    shape = pick(r, *shapes)
    h = length / math.exp(r.uniform(math.log(slender[0]), math.log(slender[1])))
    s = section_of(r, shape, h)
    s["height"] = h
    return s, 3.516 / length**2 * math.sqrt(m["E"] * s["iz"] / (m["rho"] * s["area"])), m["rho"] * s["area"] * length


def told(r, machine, what, finest=3, **more):
    """Half of the scenes as they stand, half ask for an accuracy of 1e-1 to 10^-finest."""
    if r.random() < 0.5:
        return machine.scene(what, **more)
    a = 10.0 ** -min(pick(r, 1, 2, 2, 3), finest)
    more.setdefault("want", min(1e-3, 0.2 * a))
    return machine.scene(f"{what}; accuracy {a:g}", words=("--accuracy", repr(a)), claim=a, **more)


def run_up(speed, T):
    """An angle that begins at rest, without acceleration, and turns with `speed` from T on."""
    text = f"{speed!r}*(t < {T!r} ? t^3/{T!r}^2*(1 - t/{2 * T!r}) : t - {T / 2!r})"
    return text, lambda t: speed * (t**3 / T**2 * (1 - t / (2 * T)) if t < T else t - T / 2)


def luffing_crane(r):
    """A crane's elastic boom is luffed by its motor, a load swings on a rope from its tip; motor moment, section forces, stress"""
    L = r.uniform(5, 40)
    m = STEEL
    s, _, mass = bar(r, L, (15, 35), m, ("tube", "rectangle"))
    load = mass * r.uniform(0.1, 0.8)
    rope = L * r.uniform(0.2, 0.5)
    w = math.sqrt(3 * m["E"] * s["iz"] / L**3 / (load + 0.24 * mass))
    a0 = r.uniform(0.1, 0.8)
    T = 2 * math.pi / w * r.uniform(1.5, 4)
    x, y = L * math.cos(a0), L * math.sin(a0)
    d = Machine(1.5 * T, gravity=(0, -9.81), **({"start": "static"} if (rest := r.random() < 0.5) else {}))
    d.beam("boom", L, s, m, (0, 0, a0), damping=0.02 / w, places=[("middle", 4)])
    d.rigid("load", load, 0.02 * load * rope**2, (x, y, -math.pi / 2), centre=(rope, 0), frames={"hook": (rope, 0)})
    d.revolute("luff", (0, 0), "boom.root", motion=smooth(r.uniform(0.1, 0.6), T))
    d.revolute("sheave", "boom.tip", "load")
    d.reaction("motor", "luff")
    d.position("hook", "load.hook")
    d.acceleration("tip", "boom.tip")
    d.section("inside", "boom", 2)
    d.section("stress", "boom", 1, stress=True)
    return told(r, d, f"boom {L:.2g} m, load {load / mass:.2g} of its mass{', from rest' if rest else ''}", rest=rest)


def two_link_robot(r):
    """A robot of two elastic links swings its payload and stops; motor moments, payload's acceleration, section forces"""
    m = pick(r, STEEL, ALUMINIUM)
    L1, L2 = r.uniform(0.3, 1.2), r.uniform(0.3, 1.2)
    s1, _, m1 = bar(r, L1, (12, 40), m)
    s2, _, m2 = bar(r, L2, (15, 50), m)
    load = (m1 + m2) * r.uniform(0.1, 1)
    soft = (L1 + L2) ** 3 / (3 * m["E"] * s1["iz"]) + L2**3 / (3 * m["E"] * s2["iz"])
    w = 1 / math.sqrt(soft * (load + 0.3 * (m1 + m2)))
    T = 2 * math.pi / w * r.uniform(1.2, 4)
    a1, a2 = r.uniform(-1, 1), r.uniform(-1, 1)
    x, y = L1 * math.cos(a1), L1 * math.sin(a1)
    d = Machine(1.4 * T, gravity=(0, pick(r, 0.0, -9.81)))
    d.beam("upper", L1, s1, m, (0, 0, a1), damping=0.02 / w)
    d.beam("fore", L2, s2, m, (x, y, a2), damping=0.02 / w, places=[("middle", 4)])
    J = load * (0.1 * L2) ** 2
    d.rigid("payload", load, J, (x + L2 * math.cos(a2), y + L2 * math.sin(a2), a2), centre=(0.05 * L2, 0), frames={"tool": (0.1 * L2, 0)})
    d.revolute("shoulder", (0, 0), "upper.root", motion=smooth(r.uniform(-1.2, 1.2), T))
    d.revolute("elbow", "upper.tip", "fore.root", motion=smooth(r.uniform(-1.2, 1.2), 0.8 * T))
    d.weld("grip", "fore.tip", "payload")
    d.reaction("M1", "shoulder")
    d.reaction("M2", "elbow")
    d.acceleration("tool", "payload.tool")
    d.position("place", "payload.tool")
    d.section("inside", "fore", 1)
    return told(r, d, f"{L1:.2g} m and {L2:.2g} m, payload {load / (m1 + m2):.2g} of the links")


def scissor_lift(r):
    """A scissor lift of crossed elastic bars lifts a load by its lower slide; the drive's force, pins, section forces"""
    m = pick(r, STEEL, ALUMINIUM)
    L = r.uniform(0.4, 2.5)
    s, _, mass = bar(r, L, (15, 45), m)
    a0 = r.uniform(0.3, 0.6)
    load = mass * r.uniform(0.5, 5)
    c, n = L * math.cos(a0), L * math.sin(a0)
    w = math.sqrt(48 * m["E"] * s["iz"] / L**3 / (load + mass))
    T = 2 * math.pi / w * r.uniform(2, 6)
    d = Machine(1.3 * T, gravity=(0, -9.81))
    d.beam("left", L, s, m, (0, 0, a0), damping=0.02 / w, places=[("middle", 4)])
    d.beam("right", L, s, m, (c, 0, math.pi - a0), damping=0.02 / w, places=[("middle", 4)])
    d.rigid("shoe", 0.1 * mass, 0.01 * mass * L**2, (c, 0, 0))
    d.rigid("platform", load, load * L**2 / 12, (0, n, 0), centre=(0.5 * c, 0))
    d.rigid("block", 0.05 * mass, 0.01 * mass * L**2, (c, n, 0))
    d.revolute("foot", (0, 0), "left.root")
    d.prismatic("slide", (0, 0), "shoe", (1, 0), motion=smooth(-c * r.uniform(0.05, 0.3), T))
    d.revolute("heel", "shoe", "right.root")
    d.revolute("cross", "left.middle", "right.middle")
    d.revolute("top", "right.tip", "platform")
    d.revolute("eye", "left.tip", "block")
    d.prismatic("guide", "platform", "block", (1, 0))
    d.reaction("drive", "slide", moment=False)
    d.reaction("pin", "cross")
    d.position("load", "platform")
    d.section("inside", "left", 2)
    return told(r, d, f"bars of {L:.2g} m, load {load / mass:.2g} of a bar")


def closed_four_bar(a, b, c, ground, p0):
    """Angles of coupler and rocker of a four-bar, crank a at p0, coupler b, rocker c, hinge at (ground, 0); rocker seen from its hinge."""
    x, y = a * math.cos(p0), a * math.sin(p0)
    D = math.hypot(ground - x, y)
    if not abs(b - c) < D < b + c:
        return None
    th = math.atan2(-y, ground - x) + math.acos((b * b + D * D - c * c) / (2 * b * D))
    px, py = x + b * math.cos(th), y + b * math.sin(th)
    return th, math.atan2(py, px - ground)


def wiper(r):
    """A wiper: crank and rod swing a lever with an elastic arm, rubbed in proportion to its speed; motor moment, arm's root"""
    a, ground = r.uniform(0.04, 0.08), r.uniform(0.4, 0.7)
    c = a * r.uniform(1.4, 2.5)
    b = ground * r.uniform(0.97, 1.03)
    p0 = r.uniform(0, 2 * math.pi)
    both = closed_four_bar(a, b, c, ground, p0)
    if both is None or a + max(b, c, ground) > 0.98 * (b + c + ground - max(b, c, ground)):
        return None
    th, ps = both
    m = STEEL
    L = r.uniform(0.4, 0.7)
    s, w1, mass = bar(r, L, (25, 70), m, ("rectangle", "tube"))
    rod, _, _ = bar(r, b, (30, 60), m, ("rectangle", "circle"))
    speed = min(w1 / r.uniform(5, 20), 60.0)
    T = 2 * math.pi / speed
    drive = run_up(speed, T)
    d = Machine(1.8 * T)
    d.rigid("crank", 0.3, 1e-4, (0, 0, p0), frames={"end": (a, 0)})
    d.beam("rod", b, rod, m, (a * math.cos(p0), a * math.sin(p0), th), damping=0.02 / w1)
    d.rigid("lever", 0.2, 2e-4, (ground, 0, ps), frames={"end": (c, 0)})
    d.beam("arm", L, s, m, (ground, 0, ps), damping=0.02 / w1, places=[("middle", 4)])
    d.rigid("blade", mass * r.uniform(0.2, 1), 1e-4, (ground + L * math.cos(ps), L * math.sin(ps), ps))
    d.revolute("motor", (0, 0), "crank", motion=drive)
    d.revolute("pin", "crank.end", "rod.root")
    d.revolute("hinge", (ground, 0), "lever", spring=(0.0, 0.02 * mass * L**2 * w1))
    d.revolute("eye", "lever.end", "rod.tip")
    d.weld("seat", "lever", "arm.root")
    d.weld("clip", "arm.tip", "blade")
    d.reaction("M", "motor")
    d.reaction("root", "seat")
    d.reaction("bolt", "eye")
    d.acceleration("tip", "blade")
    d.value("swing", "hinge")
    return told(r, d, f"arm {L:.2g} m, {speed / w1:.2g} of its frequency")


def geared_arm(r):
    """A motor turns an elastic arm through a pair of gears; tip, arm's root, angle of the motor"""
    m = pick(r, STEEL, ALUMINIUM)
    L = r.uniform(0.2, 1.5)
    s, w1, mass = bar(r, L, (12, 60), m)
    ratio = -1 / r.uniform(1.5, 6)
    J = mass * L**2 / 3 * r.uniform(0.2, 3)
    T = 2 * math.pi / w1 * r.uniform(1.5, 5)
    M = r.uniform(0.3, 1) * (J / 3 + mass * L**2 / 3) / T**2
    d = Machine(1.5 * T, gravity=(0, pick(r, 0.0, -9.81 * min(1.0, 0.1 * w1**2 * L / 9.81))))
    d.rigid("pinion", 1.0, J * ratio**2, (0, 0, 0.3))
    d.rigid("wheel", 2.0, J, (0.3, 0, 0.1))
    d.beam("arm", L, s, m, (0.3, 0, 0.1), damping=0.02 / w1)
    d.revolute("motor", (0, 0), "pinion", spring=(0.0, 0.1 * abs(ratio) * M * T))
    d.revolute("axle", (0.3, 0), "wheel")
    d.weld("seat", "wheel", "arm.root")
    d.gear("motor", "axle", ratio)
    value, f = ramp(M * ratio, T)
    d.torque("pinion", (value, f), name="drive")
    d.value("turned", "motor")
    d.position("tip", "arm.tip")
    d.reaction("root", "seat")
    d.force_of("power", "drive", "power")
    d.section("stress", "arm", 0, stress=True)
    return told(r, d, f"arm {L:.2g} m behind {abs(1 / ratio):.2g} to 1")


def press(r):
    """A press: a driven crank, an elastic rod, a slide that squeezes a spring and damper; pin forces, rod's forces and stress"""
    m = STEEL
    a = r.uniform(0.03, 0.2)
    L = a * r.uniform(3, 5)
    s, _, mass = bar(r, L, (10, 40), m)
    w1 = math.pi**2 / L**2 * math.sqrt(m["E"] * s["iz"] / (m["rho"] * s["area"]))
    slide = mass * r.uniform(0.5, 5)
    speed = w1 / r.uniform(8, 30)
    p0 = r.uniform(0.2, 1.2)
    T = 2 * math.pi / speed
    x = a * math.cos(p0) + math.sqrt(L * L - (a * math.sin(p0)) ** 2)
    b = math.asin(-a * math.sin(p0) / L)
    drive = run_up(speed, T)
    k = slide * speed**2 * r.uniform(1, 10)
    d = Machine(1.6 * T)
    d.rigid("crank", 5 * mass, 5 * mass * a * a, (0, 0, p0), frames={"end": (a, 0)})
    d.beam("rod", L, s, m, (a * math.cos(p0), a * math.sin(p0), b), damping=0.02 / w1, places=[("middle", 4)])
    d.rigid("ram", slide, slide * a * a, (x, 0, 0))
    d.revolute("shaft", (0, 0), "crank", motion=drive)
    d.revolute("pin", "crank.end", "rod.root")
    d.revolute("wrist", "rod.tip", "ram")
    d.prismatic("guide", (0, 0), "ram", (1, 0))
    d.spring("work", "ram", (x + 1.5 * a, 0.0), k, 0.05 * slide * speed, rest=1.5 * a)
    d.reaction("M", "shaft")
    d.reaction("bolt", "wrist")
    d.reaction("side", "guide", moment=False)
    d.acceleration("ram", "ram")
    d.section("inside", "rod", 4)
    d.section("stress", "rod", 3, stress=True)
    d.force_of("squeeze", "work")
    return told(r, d, f"rod/crank {L / a:.2g}, {speed / w1:.2g} of the rod's frequency")


def hanging_chain(r):
    """A chain of two or three elastic links falls from a slant; angles, pin forces, accelerations"""
    m = pick(r, STEEL, ALUMINIUM)
    n = pick(r, 2, 3)
    L = r.uniform(0.2, 1)
    d = None
    T = 2 * math.pi * math.sqrt(n * L / 9.81) * r.uniform(0.2, 0.45)
    d = Machine(T, gravity=(0, -9.81))
    x = y = 0.0
    for i in range(n):
        s, w1, mass = bar(r, L, (25, 70), m, ("rectangle", "circle"))
        angle = -math.pi / 2 + r.uniform(-0.8, 0.8)
        d.beam(f"link{i}", L, s, m, (x, y, angle), damping=0.02 / w1)
        d.revolute(f"pin{i}", f"link{i - 1}.tip" if i else (0.0, 0.0), f"link{i}.root")
        x, y = x + L * math.cos(angle), y + L * math.sin(angle)
    load = mass * r.uniform(0.2, 2)
    d.rigid("bob", load, load * (0.1 * L) ** 2, (x, y, 0), centre=(0.0, 0.0))
    d.weld("bolt", f"link{n - 1}.tip", "bob")
    for i in range(n):
        d.value(f"a{i}", f"pin{i}")
    d.reaction("hook", "pin0")
    d.reaction("last", f"pin{n - 1}")
    d.acceleration("bob", "bob")
    return told(r, d, f"{n} links of {L:.2g} m", finest=2, per=8, most=64)


def stacker_mast(r):
    """A mast on a driven cart with a load on top, like a stacker crane; drive's force, foot's moment, swaying"""
    m = pick(r, STEEL, ALUMINIUM)
    L = r.uniform(1, 15)
    s, _, mass = bar(r, L, (15, 50), m)
    load = mass * r.uniform(0.05, 1)
    w = math.sqrt(3 * m["E"] * s["iz"] / L**3 / (load + 0.24 * mass))
    T = 2 * math.pi / w * r.uniform(0.8, 3)
    cart = mass * r.uniform(0.5, 3)
    g = min(9.81, 0.1 * w * w * L)
    d = Machine(2 * T, gravity=(0, -g))
    d.rigid("cart", cart, cart * 0.05 * L**2, (0, 0, 0))
    d.beam("mast", L, s, m, (0, 0, math.pi / 2), damping=0.02 / w, places=[("middle", 4)])
    d.rigid("load", load, load * (0.05 * L) ** 2, (0, L, 0), centre=(0.03 * L, 0))
    d.prismatic("rail", (0, 0), "cart", (1, 0), motion=smooth(L * r.uniform(0.05, 0.5), T))
    d.weld("foot", "cart", "mast.root")
    d.weld("head", "mast.tip", "load")
    d.reaction("drive", "rail")
    d.reaction("root", "foot")
    d.section("middle", "mast", 4)
    d.section("stress", "mast", 0, stress=True)
    d.acceleration("load", "load")
    return told(r, d, f"mast {L:.2g} m, load {load / mass:.2g} of it, cart in {T * w / 2 / math.pi:.2g} periods")


def excavator(r):
    """Boom and stick on sprung cylinders, at rest under their weight, then a load on the bucket; cylinders' forces, pins, section forces"""
    m = STEEL
    L1, L2 = r.uniform(2, 6), r.uniform(1.5, 4)
    s1, _, m1 = bar(r, L1, (10, 25), m, ("rectangle",))
    s2, _, m2 = bar(r, L2, (10, 25), m, ("rectangle",))
    a1, a2 = r.uniform(0.3, 0.9), r.uniform(-1.2, -0.5)
    x, y = L1 * math.cos(a1), L1 * math.sin(a1)
    bucket = (m1 + m2) * r.uniform(0.1, 0.5)
    w = math.sqrt(3 * m["E"] * s1["iz"] / L1**3 / (bucket + m2 + 0.3 * m1))
    k = 3 * m["E"] * s1["iz"] / L1**3 * r.uniform(2, 20)
    T = 2 * math.pi / w * r.uniform(1, 3)
    d = Machine(2.5 * T, gravity=(0, -9.81), start="static")
    d.beam("boom", L1, s1, m, (0, 0, a1), damping=0.02 / w, places=[("ear", 4)])
    d.beam("stick", L2, s2, m, (x, y, a2), damping=0.02 / w, places=[("ear", 2)])
    d.rigid("bucket", bucket, bucket * 0.04 * L2**2, (x + L2 * math.cos(a2), y + L2 * math.sin(a2), a2), centre=(0.1 * L2, -0.05 * L2))
    d.revolute("foot", (0, 0), "boom.root")
    d.revolute("elbow", "boom.tip", "stick.root")
    d.weld("bolt", "stick.tip", "bucket")
    for name, on, start in (("lift", "boom.ear", (0.3 * L1, -0.2 * L1)), ("crowd", "stick.ear", "boom.ear")):
        p, o = d.pose(on), d.pose(start)
        length = math.hypot(p[0] - o[0], p[1] - o[1])
        d.spring(name, on, start, k, 2 * 0.1 * k / w, rest=length)
    F = 9.81 * bucket * r.uniform(0.3, 1.5)
    d.force("bucket", (0.3, -1), ramp(F, 0.7 * T), name="dig")
    d.force_of("cylinder", "lift")
    d.force_of("second", "crowd")
    d.force_of("power", "dig", "power")
    d.reaction("pin", "foot")
    d.section("inside", "boom", 5)
    d.position("tooth", "bucket")
    return told(r, d, f"{L1:.2g} m and {L2:.2g} m, cylinders {k / 3 / m['E'] / s1['iz'] * L1**3:.2g} times as stiff", rest=True)


def micro_resonator(r):
    """A shuttle of 100 um between two clamped silicon beams, driven by a force beside resonance, small or so that they stretch"""
    L = r.uniform(40e-6, 200e-6)
    h = L / r.uniform(30, 80)
    s = section_of(r, "rectangle", h, 2e-6)
    s["height"] = h
    m = SILICON
    mass = m["rho"] * s["area"] * L
    shuttle = mass * r.uniform(2, 20)
    k = 24 * m["E"] * s["iz"] / L**3
    w = math.sqrt(k / (shuttle + 0.75 * mass))
    F = k * h * 10 ** r.uniform(-2.5, -0.2)
    T = 2 * math.pi / w
    d = Machine(4 * T, samples=160)
    # With 8 elements the stress beside the clamp, where the pull bends the curve most, is 2.4e-3 of its range off.
    d.beam("left", L, s, m, (-L, 0, 0), damping=0.04 / w, elements=24)
    d.rigid("shuttle", shuttle, shuttle * (0.1 * L) ** 2, (0, 0, 0))
    d.beam("right", L, s, m, (0, 0, 0), damping=0.04 / w, elements=24)
    d.weld("anchor", (-L, 0.0), "left.root")
    d.weld("a", "left.tip", "shuttle")
    d.weld("b", "shuttle", "right.root")
    # The far end comes last: it closes the loop.
    d.weld("far", (L, 0.0), "right.tip")
    d.force("shuttle", (0, 1), swing(F, w * r.uniform(0.5, 1.2)))
    d.position("y", "shuttle")
    d.reaction("R", "anchor")
    d.section("stress", "left", 1, stress=True)
    return told(r, d, f"beams {L * 1e6:.3g} um, force {F / k / h:.2g} of the thickness")


def footbridge(r):
    """A bridge on a pin and a roller carries a vehicle on its spring, which a bump shakes; supports, bending, the spring's force"""
    m = pick(r, STEEL, ALUMINIUM)
    L = r.uniform(5, 40)
    s, _, mass = bar(r, L, (15, 40), m, ("rectangle",))
    w1 = math.pi**2 / L**2 * math.sqrt(m["E"] * s["iz"] / (m["rho"] * s["area"]))
    car = mass * r.uniform(0.05, 0.6)
    k = car * (w1 * r.uniform(0.3, 1.5)) ** 2
    T = 2 * math.pi / w1
    at = pick(r, 2, 3, 4, 5)
    d = Machine(r.uniform(2, 4) * T, gravity=(0, -min(9.81, 0.02 * L * w1**2)), start="static")
    d.beam("deck", L, s, m, (0, 0, 0), damping=0.02 / w1, places=[("seat", at)])
    x = L * at / 8
    d.rigid("shoe", 0.01 * mass, 0.001 * mass * L, (L, 0, 0))
    d.rigid("car", car, car * 0.1, (x, 0.05 * L, 0))
    d.revolute("pin", (0, 0), "deck.root")
    d.revolute("roller", "deck.tip", "shoe")
    d.prismatic("rail", (L, 0.0), "shoe", (1, 0))
    d.prismatic("mast", (x, 0.05 * L), "car", (0, 1))
    d.spring("wheel", "car", "deck.seat", k, 0.1 * math.sqrt(k * car), rest=0.05 * L)
    d.force("car", (0, 1), swing(9.81 * car * r.uniform(0.1, 0.5), w1 * r.uniform(0.3, 0.9)))
    d.reaction("left", "pin")
    d.reaction("right", "rail", moment=False)
    d.section("inside", "deck", 6)
    d.force_of("wheel_force", "wheel")
    d.distance("gap", "car", "deck.seat")
    d.acceleration("seat", "deck.seat")
    return told(r, d, f"bridge {L:.2g} m, vehicle {car / mass:.2g} of it at {at}/8", rest=True)


def valve_train(r):
    """A cam lifts a pushrod's spring, an elastic rocker on its pivot opens a sprung valve; springs, pivot, valve's acceleration"""
    m = STEEL
    L = r.uniform(0.06, 0.15)
    s, _, mass = bar(r, L, (8, 15), m, ("rectangle",))
    w1 = math.pi**2 / L**2 * math.sqrt(m["E"] * s["iz"] / (m["rho"] * s["area"]))
    at = pick(r, 3, 4)
    valve = mass * r.uniform(0.3, 1)
    kv = valve * (w1 / r.uniform(10, 25)) ** 2
    kp = kv * r.uniform(10, 40)
    lift = L * r.uniform(0.03, 0.1)
    T = 2 * math.pi / math.sqrt(kv / valve) * r.uniform(0.5, 1.5)
    d = Machine(1.5 * T)
    low = 0.8 * L
    d.rigid("tappet", mass, mass * L**2, (0, -low, 0))
    # With 8 elements the shear force, whose curve an element does not see, is 1.2e-3 of its range off.
    d.beam("rocker", L, s, m, (0, 0, 0), damping=0.02 / w1, elements=24, places=[("pivot", 3 * at)])
    d.rigid("valve", valve, valve * L**2 * 0.1, (L, -low, 0))
    d.prismatic("cam", (0, -low), "tappet", (0, 1), motion=swing(lift, 2 * math.pi / T))
    d.revolute("pivot", (L * at / 8, 0.0), "rocker.pivot")
    d.prismatic("guide", (L, -low), "valve", (0, 1))
    d.spring("pushrod", "rocker.root", "tappet", kp, 0.05 * math.sqrt(kp * mass), rest=low)
    d.spring("stem", "rocker.tip", "valve", 10 * kv, 0.05 * math.sqrt(kv * valve), rest=low)
    d.spring("coil", "valve", (L, -2 * low), kv, 0.1 * math.sqrt(kv * valve), rest=low)
    d.force_of("push", "pushrod")
    d.force_of("seat", "coil")
    d.reaction("shaft", "pivot")
    d.acceleration("valve", "valve")
    d.section("inside", "rocker", 3 * at + 4)
    d.distance("long", "rocker.root", "tappet")
    return told(r, d, f"rocker {L * 1e3:.3g} mm on {at}/8")


def leaf_gear(r):
    """A leaf spring carries a wheel of an aeroplane that comes down on its tyre; leaf's root, tyre's force, fuselage's acceleration"""
    m = pick(r, STEEL, ALUMINIUM)
    L = r.uniform(0.5, 1.5)
    s, w1, mass = bar(r, L, (18, 40), m, ("rectangle",))
    leaf = 3 * m["E"] * s["iz"] / L**3
    slant = -r.uniform(0.2, 0.7)
    body = leaf * L * r.uniform(0.02, 0.06) / 9.81
    wheel = max(body * r.uniform(0.03, 0.1), 0.5 * mass)
    tyre = leaf * r.uniform(2, 10)
    w = math.sqrt(leaf / body)
    d = Machine(2 * math.pi / w * r.uniform(1, 2), gravity=(0, -9.81))
    x, y = L * math.cos(slant), L * math.sin(slant)
    d.rigid("fuselage", body, body * L**2, (0, 0, 0))
    d.beam("leaf", L, s, m, (0, 0, slant), damping=0.05 / w)
    d.rigid("wheel", wheel, wheel * 0.02 * L**2, (x, y, 0))
    d.prismatic("fall", (0, 0), "fuselage", (0, 1))
    d.weld("root", "fuselage", "leaf.root")
    d.revolute("axle", "leaf.tip", "wheel", spring=(0.0, 0.01 * body * L**2 * w))
    d.spring("tyre", "wheel", (x, y - 0.3 * L), tyre, 0.1 * math.sqrt(tyre * body), rest=0.3 * L)
    d.reaction("bolts", "root")
    d.force_of("ground", "tyre")
    d.acceleration("cabin", "fuselage")
    d.section("stress", "leaf", 0, stress=True)
    d.section("inside", "leaf", 3)
    return told(r, d, f"leaf {L:.2g} m, {body:.3g} kg, sinks {9.81 * body / leaf / L:.2g} of its length")


def stopped_flap(r):
    """An elastic flap on a hinge is thrown by a torque against a stop of its hinge; hinge, stop, tip's acceleration"""
    m = pick(r, STEEL, ALUMINIUM)
    L = r.uniform(0.1, 0.8)
    s, w1, mass = bar(r, L, (20, 60), m, ("rectangle",))
    J = mass * L**2 / 3
    # The stop is as stiff as the flap is about its root: it rings, but every wave is not a blow.
    k = 3 * m["E"] * s["iz"] / L * 10 ** r.uniform(-1, 0.3)
    T = 2 * math.pi / w1 * r.uniform(3, 8)
    way = r.uniform(0.1, 0.5)
    M = 2 * J * way / (0.4 * T) ** 2
    d = Machine(T, samples=200)
    d.beam("flap", L, s, m, (0, 0, -0.3), damping=0.05 / w1)
    d.rigid("hub", 0.3 * mass, 0.1 * J, (0, 0, -0.3))
    d.revolute("hinge", (0, 0), "hub", spring=(0.0, 0.05 * math.sqrt(k * J)), stop=(way, k, 0.05 * math.sqrt(k * J)))
    d.weld("seat", "hub", "flap.root")
    d.torque("hub", ramp(M, 0.2 * T), name="blow")
    d.value("angle", "hinge")
    d.reaction("root", "seat")
    d.position("tip", "flap.tip")
    d.force_of("power", "blow", "power")
    return told(
        r, d, f"flap {L:.2g} m, stop {k / 3 / m['E'] / s['iz'] * L:.2g} of its root's stiffness", finest=2, want=1.5e-3, per=8, most=64
    )


def drum(r):
    """A washing machine's tub on springs and dampers, its drum runs up with a lump of laundry; spring forces, bearing, the tub's way"""
    tub, laundry = r.uniform(15, 40), r.uniform(0.3, 3)
    R = r.uniform(0.2, 0.3)
    k = tub * (2 * math.pi * r.uniform(1.5, 4)) ** 2 / 2
    c = r.uniform(0.05, 0.2) * math.sqrt(k * tub)
    speed = 2 * math.pi * r.uniform(3, 12)
    T = r.uniform(1.5, 4)
    d = Machine(1.3 * T, samples=400, gravity=(0, -9.81), start="static")
    d.rigid(
        "tub", tub, tub * R**2 / 2, (0, 0, 0), centre=(0, -0.2 * R), frames={"left": (-R, 0.5 * R), "right": (R, 0.5 * R), "low": (0, -R)}
    )
    d.rigid("drum", 6.0, 6 * R**2, (0, 0, 0), frames={"wall": (0.8 * R, 0)})
    d.rigid("laundry", laundry, laundry * 0.01, (0.8 * R, 0, 0))
    d.revolute("shaft", "tub", "drum", motion=run_up(speed, T))
    d.weld("lump", "drum.wall", "laundry")
    for name, x in (("left", -R), ("right", R)):
        d.spring(f"spring_{name}", f"tub.{name}", (1.3 * x, 2 * R), k, c, rest=1.2 * R)
    d.spring("damper", "tub.low", (0.6 * R, -2.5 * R), 0.1 * k, 2 * c, rest=1.5 * R)
    d.force_of("pull", "spring_left")
    d.force_of("rub", "damper")
    d.reaction("bearing", "shaft")
    d.acceleration("shake", "tub.low")
    return told(r, d, f"{tub:.2g} kg, {laundry:.2g} kg of laundry up to {speed * 9.55:.3g} rpm", rest=True, per=8, most=64)


def governor(r):
    """A governor: a ball on a hinged arm turns with a shaft that runs up, rubbed in proportion to its rate; angle, motor, hinge"""
    l, e, m = r.uniform(0.05, 0.4), r.uniform(0.0, 0.1), r.uniform(0.2, 5)
    J, Js = 0.4 * m * (0.2 * l) ** 2, m * l * l * r.uniform(0.2, 2)
    w1 = math.sqrt(9.81 / l) * r.uniform(1.5, 5)
    T = 2 * math.pi / w1 * r.uniform(2, 6)
    c = m * l * l * math.sqrt(9.81 / l) * r.uniform(0.1, 0.6)
    p0 = -r.uniform(0.9, 1.4)
    drive = run_up(w1, T)[0]
    text = (
        simulation(2 * T, 200 / T, (0, 0, -9.81))
        + rigid("shaft", 1.0, (Js, Js, Js), {"ear": (e, 0, 0)})
        + rigid("arm", m, (J, J, J), {"ball": (l, 0, 0)}, centre=(l, 0, 0))
        + joint("motor", "revolute", "ground", "shaft", f'motion = "{drive}"')
        + joint(
            "hinge",
            "revolute",
            "shaft.ear",
            "arm",
            f"axis = [0, -1, 0]\ninitial = {{ value = {p0!r} }}\nspring = {{ stiffness = 0.0, damping = {c!r} }}",
        )
        + output("angle", "hinge", "value")
        + output("M", "motor", "reaction")
        + output("ball", "arm.ball", "acceleration")
    )

    def turning(t):
        """Angle, rate and acceleration of the shaft."""
        if t >= T:
            return w1 * (t - T / 2), w1, 0.0
        x = t / T
        return w1 * T * x**3 * (1 - x / 2), w1 * x * x * (3 - 2 * x), w1 / T * (6 * x - 6 * x * x)

    def bends(t, p, v):
        w = turning(t)[1]
        return (-m * w * w * (e + l * math.cos(p)) * l * math.sin(p) - m * 9.81 * l * math.cos(p) - c * v) / (J + m * l * l)

    def truth(t):
        y = ode(lambda s, y: [y[1], bends(s, *y)], [p0, 0.0], t, max_step=T / 50)
        M, a = np.full((len(t), 6), np.nan), np.zeros((len(t), 3))
        for i, (s, (p, v)) in enumerate(zip(t, y)):
            q, w, dw = turning(s)
            R, A = e + l * math.cos(p), bends(s, p, v)
            M[i, 5] = (m * R * R + J + Js) * dw - 2 * m * R * l * math.sin(p) * v * w
            out, along = -l * (math.cos(p) * v * v + math.sin(p) * A) - R * w * w, R * dw - 2 * l * math.sin(p) * v * w
            a[i] = (
                out * math.cos(q) - along * math.sin(q),
                out * math.sin(q) + along * math.cos(q),
                l * (math.cos(p) * A - math.sin(p) * v * v),
            )
        return {"angle": y[:, :1], "M": M, "ball": a}

    return Scene(text, truth, {}, f"arm {l:.2g} m, up to {w1 / math.sqrt(9.81 / l):.2g} of its frequency at rest")


def angle_mast(r):
    """A slender mast of an L section, whose principal axes are oblique, shaken at its top along one leg; both deflections, foot's force"""
    L = r.uniform(0.5, 8)
    h, width = L / r.uniform(25, 60), L / r.uniform(25, 60)
    t = min(h, width) * r.uniform(0.06, 0.12)
    A, iy, iz, iyz, _ = of_rectangles([(0.0, t / 2, h, t), (t / 2 - h / 2, t / 2 + width / 2, t, width - t)])
    m = pick(r, STEEL, ALUMINIUM)
    weak = 3.516 / L**2 * math.sqrt(m["E"] * min(iy, iz) / (m["rho"] * A))
    F, T = 0.002 * 3 * m["E"] * min(iy, iz) / L**2, 2 * math.pi / weak
    value, pull = swing(F, weak * r.uniform(0.3, 0.8))
    tau = 0.04 / weak
    across = pick(r, (0, 1, 0), (0, 0, 1))
    text = (
        simulation(3 * T, 60 / T)
        + beam(
            "mast", L, f'{{ shape = "l", height = {h!r}, width = {width!r}, thickness = {t!r} }}', m, f"damping = {{ stiffness = {tau!r} }}"
        )
        + weld("foot", "ground", "mast.root")
        + force("force", "mast.tip", value, across)
        + output("tip", "mast.tip", "position")
    )

    def truth(times):
        # Principal bending: (v, w) along y, z of the section; the stiffness is E [[iz, iyz], [iyz, iy]].
        squares, axes = np.linalg.eigh(np.array([[iz, iyz], [iyz, iy]]))
        u = np.zeros((len(times), 2))
        for i, d in zip(squares, axes.T):
            M, K = beam_matrices(L, m["E"] * i, m["rho"] * A)
            line = Linear(M, K)
            line.zeta = np.minimum(0.5 * tau * line.omega, 0.999)
            f = np.zeros(len(M))
            f[-2] = d @ np.array(across[1:])
            u += line.respond(f, lambda s: np.array([pull(x) for x in s]), times, fine=12000)[:, -2:-1] * d
        return {"tip": np.column_stack([np.full(len(times), np.nan), u])}

    return Scene(text, truth, {}, f"L section {h / width:.2g}, thickness {t / h:.2g} of its height")


KINDS = [
    governor,
    angle_mast,
    luffing_crane,
    two_link_robot,
    scissor_lift,
    wiper,
    geared_arm,
    press,
    hanging_chain,
    stacker_mast,
    excavator,
    micro_resonator,
    footbridge,
    valve_train,
    leaf_gear,
    stopped_flap,
    drum,
]
