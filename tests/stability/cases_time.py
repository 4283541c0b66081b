"""Hard cases of the integration in time: motions of every size, stiff springs and dampers, runs that are far too long.

The truth is closed theory, or a Runge-Kutta integration of the same equation in plain Python.
"""
import math
import random

from cases import case, down
from scenes import beam, bar, circle, force, joint, output, rigid, simulation, steel


def spring_damper(on, stiffness, damping, more=""):
    return f'[[force]]\nkind = "spring-damper"\non = "{on}"\nstiffness = {stiffness!r}\ndamping = {damping!r}\n{more}\n'


def slide(mass, value=0.0, rate=0.0, more="", axis=(1, 0, 0), inertia=1e-3):
    return rigid("m", mass, (inertia,) * 3) + joint(
        "slide", "prismatic", "ground", "m", f"axis = {list(axis)}\ninitial = {{ value = {value!r}, rate = {rate!r} }}\n{more}"
    )


def worst(h, column, exact, size=None):
    """Largest difference from a function of time, relative to its range or a size."""
    truth = [exact(t) for t in h["t"]]
    return max(abs(a - b) for a, b in zip(h[column], truth)) / (size or max(truth) - min(truth))


def oscillator(t, x0, v0, w, zeta):
    """x'' + 2 zeta w x' + w^2 x = 0."""
    if zeta < 1:
        d = w * math.sqrt(1 - zeta * zeta)
        return math.exp(-zeta * w * t) * (x0 * math.cos(d * t) + (v0 + zeta * w * x0) / d * math.sin(d * t))
    if zeta == 1:
        return math.exp(-w * t) * (x0 + (v0 + w * x0) * t)
    r = math.sqrt(zeta * zeta - 1)
    fast, slow = -w * (zeta + r), -w / (zeta + r)
    a = (v0 - slow * x0) / (fast - slow)
    return a * math.exp(fast * t) + (x0 - a) * math.exp(slow * t)


# Motions that are polynomials of time


@case(
    "constant accelerations of 40 random sizes: lengths 1e-9 to 1e6 m, masses 1e-12 to 1e6 kg, 1e-6 to 1e5 s; free, sliding, on a screw",
    "end against g T^2 / 2 / itself",
    1e-6,
)
def constant_accelerations(run):
    dice, largest = random.Random(7), 0.0
    for _ in range(40):
        length, duration, mass = 10 ** dice.uniform(-9, 6), 10 ** dice.uniform(-6, 5), 10 ** dice.uniform(-12, 6)
        g, kind = 10 ** dice.uniform(-3, 3), dice.choice(("screw", "prismatic", "free", "cylindrical"))
        inertia = mass * length**2 * 10 ** dice.uniform(-4, 1)
        pitch = length * 10 ** dice.uniform(-1, 1)
        more = {"free": "", "screw": f"axis = [0, 1, 0]\npitch = {pitch!r}"}.get(kind, "axis = [0, 1, 0]")
        h = run(
            simulation(duration, 10 / duration, (0, -g, 0))
            + rigid("m", mass, (inertia,) * 3, frames={"p": (length, 0, 0)})
            + joint("j", kind, "ground", "m", more)
            + output("at", "m", "position")
        )
        if g * duration**2 < 1e-11 * length:
            continue  # less than the digits of a place at that distance
        exact = -g / 2 * duration**2 * (pitch**2 / (pitch**2 + inertia / mass) if kind == "screw" else 1)
        largest = max(largest, abs(h["at.y"][-1] / exact - 1))
    return largest


@case("constant torque on shafts of 1e-20 to 1e6 kg m^2, turned by 1e-9 to 1e6 rad", "angle at the end against M T^2 / 2 J", 1e-6)
def constant_torques(run):
    dice, largest = random.Random(3), 0.0
    for _ in range(20):
        inertia, angle, duration = 10 ** dice.uniform(-20, 6), 10 ** dice.uniform(-9, 6), 10 ** dice.uniform(-4, 4)
        torque = 2 * angle * inertia / duration**2
        h = run(
            simulation(duration, 10 / duration)
            + rigid("m", 1.0, (inertia,) * 3)
            + joint("shaft", "revolute", "ground", "m")
            + force("torque", "m", f"{torque!r}")
            + output("turn", "shaft", "value")
        )
        largest = max(largest, abs(h["turn"][-1] / angle - 1))
    return largest


@case("a slide that starts at 1e6 m and moves by a millimetre", "place against the exact one / way", 1e-5)
def far_value(run):
    h = run(simulation(1.0, 100, (-2e-3, 0, 0)) + slide(1.0, 1e6) + output("x", "slide", "value"))
    return worst(h, "x", lambda t: 1e6 - 1e-3 * t * t)


@case("a body that flies at 1e7 m/s and turns", "motion across against the exact one / way", 1e-6)
def fast_flight(run):
    h = run(
        simulation(1.0, 100)
        + rigid("m", 1.0, (1e-3, 1e-3, 2e-3), frames={"e": (1, 0, 0)})
        + joint("fly", "free", "ground", "m", "initial = { rate = [1e7, 0, 0, 0, 0, 10] }")
        + output("p", "m.e", "position")
    )
    return max(abs(y - math.sin(10 * t)) for t, y in zip(h["t"], h["p.y"])) / 1e7


# Damping and stiffness of joints, springs and bushings


def damped(run, k, c, mass=1.0, duration=1.0, by="joint", x0=0.1, v0=0.0, more=""):
    spring = f"spring = {{ stiffness = {k!r}, damping = {c!r} }}" if by == "joint" else ""
    text = simulation(duration, 100 / duration, more=more) + slide(mass, x0, v0, spring)
    if by == "bushing":
        text += f'[[force]]\nkind = "bushing"\non = "m"\nstiffness = [{k!r}, 0, 0, 0, 0, 0]\ndamping = [{c!r}, 0, 0, 0, 0, 0]\n'
    h = run(text + output("x", "slide", "value"))
    w = math.sqrt(k / mass)
    return worst(h, "x", lambda t: oscillator(t, x0, v0, w, c / (2 * mass * w)), abs(x0) or None)


@case("joint damper of 2e7 N s/m on 1 kg, spring of 1e5 N/m", "place against the exact one / its start", 1e-4)
def strong_joint_damper(run):
    return damped(run, 1e5, 2e7)


@case("spring-damper of 2e7 N s/m between points on 1 kg", "place against the exact one / its start", 1e-4)
def strong_spring_damper(run):
    h = run(simulation(1.0, 100) + slide(1.0, 0.1) + spring_damper("m", 1e5, 2e7) + output("x", "slide", "value"))
    return worst(h, "x", lambda t: 0.1 * math.exp(-5e-3 * t), 0.1)


@case("bushing damped 1e6 times beyond critical", "place against the exact one / its start", 1e-4)
def beyond_critical(run):
    return damped(run, 1e4, 2e8, by="bushing")


@case(
    "ratios of damping from 0.01 to 1e6, a tenth to ten periods, springs in joints and bushings",
    "place against the exact one / its start",
    1e-3,
)
def all_damping(run):
    return max(
        damped(run, 1e3, 2 * zeta * math.sqrt(1e3), duration=2.0, by=by)
        for zeta in (0.01, 0.3, 1.0, 30.0, 1e3, 1e6)
        for by in ("joint", "bushing")
    )


@case("a damped weight struck while a damper of 1e9 N s/m holds it", "speed integrated by hand / way", 1e-3)
def struck_overdamped(run):
    # m v' = F - c v - k x, m / c = 1e-9 s: x' = (F - k x) / c
    h = run(
        simulation(1.0, 100)
        + slide(1.0, 0.0, 0.0, "spring = { stiffness = 1e9, damping = 1e9 }")
        + force("force", "m", "t < 0.5 ? 1e6 : 0", (1, 0, 0))
        + output("x", "slide", "value")
    )
    return worst(h, "x", lambda t: 1e-3 * (1 - math.exp(-t)) if t < 0.5 else 1e-3 * (1 - math.exp(-0.5)) * math.exp(0.5 - t))


@case("a bushing of 1e15 N/m holds 1 kg against gravity, damped", "sag against m g / k / size; seconds", 1e-9)
def rigid_bushing(run):
    h = run(
        simulation(1.0, 100, down)
        + rigid("m", 1.0, (1e-3,) * 3, frames={"p": (1, 0, 0)})
        + joint("j", "free", "ground", "m")
        + '[[force]]\nkind = "bushing"\non = "m"\nstiffness = [1e15, 1e15, 1e15, 1e15, 1e15, 1e15]\ndamping = [1e7, 1e7, 1e7, 1e5, 1e5,'
        " 1e5]\n" + output("p", "m", "position")
    )
    return max(abs(y) for y in h["p.y"]) if run.cpu < 5 else math.inf


@case("the same bushing without damping", "sag / size, or a sentence within seconds", 1e-9)
def undamped_bushing(run):
    code, out, err, csv = run.simulate(
        simulation(1.0, 100, down)
        + rigid("m", 1.0, (1e-3,) * 3, frames={"p": (1, 0, 0)})
        + joint("j", "free", "ground", "m")
        + '[[force]]\nkind = "bushing"\non = "m"\nstiffness = [1e15, 1e15, 1e15, 1e15, 1e15, 1e15]\n'
        + output("p", "m", "position")
    )
    if run.cpu > 8:
        return math.inf
    return 0 if code == 0 or "steps" in err else 1


@case("1 kg vibrates on 1e15 N/m, seen for a second: 3e7 radians", "a sentence that names the joint, within seconds", 0)
def endless_vibration(run):
    message = run.fails(
        simulation(100.0, 1, (0, 0, 0)) + slide(1.0, 0.1, 0.0, "spring = { stiffness = 1e15 }") + output("x", "slide", "value"), (1,)
    )
    return 0 if "'slide'" in message and "--max-steps" in message and run.cpu < 8 else 1


@case("a budget of 500 steps for a run that takes more", "ends with a sentence", 0)
def small_budget(run):
    text = simulation(10.0, 10) + slide(1.0, 0.1, 0.0, "spring = { stiffness = 1e4 }") + output("x", "slide", "value")
    process, _, err = run.start(text, "simulate", "--csv", run.folder / "h.csv", "--max-steps", 500)
    told = process.returncode == 1 and "more than the 500" in err and "'slide'" in err
    message = run.fails(text.replace("[simulation]\n", "[simulation]\nmax_steps = 400\n"), (1,))
    return 0 if told and "more than the 400" in message and "'slide'" in message else 1


@case(
    "light weight on a stiff spring beside a heavy one on a soft spring: frequencies 1e5 apart",
    "heavy weight's place against the exact one / its start",
    1e-3,
)
def stiff_beside_soft(run):
    text = simulation(6.0, 20) + slide(1.0, 0.1, 0.0, "spring = { stiffness = 1.0 }")
    text += (
        rigid("light", 1e-6, (1e-9,) * 3)
        + joint("push", "prismatic", "m", "light", "axis = [1, 0, 0]\nspring = { stiffness = 1e4, damping = 10.0 }")
        + output("x", "slide", "value")
    )
    return worst(run(text), "x", lambda t: 0.1 * math.cos(t / math.sqrt(1 + 1e-6)), 0.1)


# Spin


@case("a wheel at 1e6 rad/s for 1e5 turns", "turns against the exact ones", 1e-6)
def fast_wheel(run):
    h = run(
        simulation(0.2 * math.pi, 100)
        + rigid("m", 1.0, (1e-3,) * 3, frames={"e": (1, 0, 0)})
        + joint("shaft", "revolute", "ground", "m", "initial = { rate = 1e6 }")
        + output("turn", "shaft", "value")
    )
    return max(abs(a - 1e6 * t) for t, a in zip(h["t"], h["turn"])) / (2e5 * math.pi)


@case(
    "a free body at 1e6 rad/s for 1e4 turns",
    "place of a point 1 m off its axis against the exact one, m; or a sentence within seconds",
    0.2,
)
def fast_spin(run):
    code, out, err, csv = run.simulate(
        simulation(0.02 * math.pi, 1000)
        + rigid("m", 1.0, (1e-3, 1e-3, 2e-3), frames={"e": (1, 0, 0)})
        + joint("fly", "free", "ground", "m", "initial = { rate = [0, 0, 0, 0, 0, 1e6] }")
        + output("p", "m.e", "position")
    )
    if code:
        return 0 if "turns at" in err and run.cpu < 8 else math.inf
    lines = [[float(x) for x in line.split(",")] for line in csv.read_text().splitlines()[1:]]
    return max(math.hypot(x - math.cos(1e6 * t), y - math.sin(1e6 * t)) for t, x, y, _ in lines)


# Motion far below the mechanism's size


def tip_response(run, newton, tolerance=1e-6, wave="1", duration=0.5):
    h = run(
        simulation(duration, 400, tolerance=tolerance)
        + beam("b", 1.0, circle(0.01), steel, "damping = { ratio = 0.02 }")
        + joint("root", "weld", "ground", "b.root")
        + force("force", "b.tip", f"{newton!r}*({wave})", (0, 1, 0))
        + output("tip", "b.tip", "position")
    )
    return [y / newton for y in h["tip.y"]]


def scaled(run, newton, **words):
    small, large = tip_response(run, newton, **words), tip_response(run, 1e-2, **{**words, "tolerance": 1e-9})
    return max(abs(a - b) for a, b in zip(small, large)) / (max(large) - min(large))


@case("a 1 m cantilever answers a force of 1e-6 N by 3 nm", "against that to 0.01 N at 1e-9, per newton / range", 3e-3)
def nanometres(run):
    return scaled(run, 1e-6, tolerance=1e-7)


@case("the same by 0.3 um, force as a sine", "against that to 0.01 N at 1e-9, per newton / range", 3e-3)
def micrometres(run):
    return scaled(run, 1e-4, wave="sin(20*t)")


@case("a pendulum of 1 m swings by 1e-9 rad", "angle against the linear one / its start", 1e-4)
def tiny_swing(run):
    h = run(
        simulation(4.0, 50, down)
        + rigid("m", 1.0, (0, 0, 0), frames={"e": (0, 1, 0)})
        + joint("pin", "revolute", "ground", "m.e", "initial = { value = 1e-9 }")
        + output("a", "pin", "value")
    )
    return worst(h, "a", lambda t: 1e-9 * math.cos(math.sqrt(9.81) * t), 1e-9)


@case("a film of 1 nm falls on its clamped edge", "finite and soon, or a sentence", 0)
def thin_film(run):
    code, out, err, csv = run.simulate(
        simulation(0.1, 100, down)
        + beam("b", 1.0, '{ shape = "rectangle", width = 0.1, height = 1e-9 }', steel)
        + joint("root", "weld", "ground", "b.root")
        + output("tip", "b.tip", "position")
    )
    return 0 if run.cpu < 10 and (code == 0 or len(err) > 30) else 1


# Snap-through


def heights(accelerate, y, duration, steps, each):
    """y after every `each` steps of y'' = accelerate(y, y') from rest, by Runge and Kutta's method of fourth order."""
    dt, v, out = duration / steps, 0.0, [y]
    for i in range(steps):
        k1, l1 = v, accelerate(y, v)
        k2, l2 = v + dt / 2 * l1, accelerate(y + dt / 2 * k1, v + dt / 2 * l1)
        k3, l3 = v + dt / 2 * l2, accelerate(y + dt / 2 * k2, v + dt / 2 * l2)
        k4, l4 = v + dt * l3, accelerate(y + dt * k3, v + dt * l3)
        y, v = y + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4), v + dt / 6 * (l1 + 2 * l2 + 2 * l3 + l4)
        if (i + 1) % each == 0:
            out.append(y)
    return out


@case(
    "von Mises truss snaps through: weight on two inclined springs under a load beyond their limit",
    "height against a Runge-Kutta integration / range",
    1e-4,
)
def snap_through(run):
    a, h0, k, c, mass, load = 1.0, 0.1, 1e6, 20.0, 1.0, 500.0
    length = math.hypot(a, h0)

    def accelerate(y, v):
        now = math.hypot(a, y)
        n = k * (now - length)
        return (-2 * (n + c * v * y / now) * y / now - load) / mass

    truth = heights(accelerate, h0, 0.5, 200000, 1000)
    text = (
        simulation(0.5, 400)
        + rigid("m", mass, (1e-3,) * 3)
        + joint("slide", "prismatic", "ground", "m", f"axis = [0, 1, 0]\ninitial = {{ value = {h0} }}")
    )
    for side, x in (("left", -a), ("right", a)):
        text += rigid(side, 1.0) + joint(side + "_held", "weld", "ground", side, f"position = [{x}, 0, 0]")
        text += spring_damper("m", k, c, f'from = "{side}"\nrest = {length!r}')
    h = run(text + force("force", "m", f"{-load}", (0, 1, 0)) + output("y", "slide", "value"))
    return max(abs(p - q) for p, q in zip(h["y"], truth)) / (max(truth) - min(truth))


@case(
    "two elastic bars are pushed through their line by a damped weight; they stretch and do not bend",
    "height against an ODE of the two bars / range, tolerance 1e-7",
    1e-3,
)
def arch_in_motion(run):
    half, rise, d, m, c, E, rho = 0.5, 0.05, 0.01, 5.0, 2000.0, 2.1e11, 7850.0
    area, length = math.pi * d * d / 4, math.hypot(half, rise)
    load = 4.5 * E * area * (rise / half) ** 3 / (3 * math.sqrt(3))
    mass = m + rho * area * length * 2 / 3

    def accelerate(y, v):
        now = math.hypot(half, y)
        return (-2 * E * area * (now - length) / length * y / now - load - c * v) / mass

    truth = heights(accelerate, rise, 0.05, 20000, 400)
    text = simulation(0.05, 1000, tolerance=1e-7) + rigid("m", m, (1e-3,) * 3)
    for name in "ab":
        text += (
            f'[[body]]\nname = "{name}"\nkind = "beam"\nlength = {length!r}\nsection = {{ shape = "circle", diameter = {d} }}\n'
            f'material = {{ density = {rho}, youngs_modulus = {E!r}, poisson = 0.3 }}\neffects = ["axial"]\n\n'
        )
    tilt = math.atan2(rise, half)
    text += (
        joint("left", "revolute", "ground", "a", f"rotation = [0, 0, {tilt!r}]")
        + joint("right", "revolute", "ground", "b", f"position = [{2 * half}, 0, 0]\nrotation = [0, 0, {math.pi - tilt!r}]")
        + joint("crown", "revolute", "a.tip", "b.tip", f"rotation = [0, 0, {math.pi - 2 * tilt!r}]")
        + joint(
            "slide",
            "prismatic",
            "ground",
            "m",
            f"axis = [0, 1, 0]\nposition = [{half}, 0, 0]\ninitial = {{ value = {rise} }}\nspring = {{ damping = {c} }}",
        )
        + joint("hang", "revolute", "m", "a.tip")
    )
    h = run(text + force("force", "m", f"{-load}", (0, 1, 0)) + output("y", "slide", "value"))
    return max(abs(p - q) for p, q in zip(h["y"], truth)) / (max(truth) - min(truth))


# Cantilevers: a load that comes at once, by Euler's modes


def cantilever_modes(count):
    """Wave numbers k L of a clamped-free beam: cos x cosh x = -1."""
    out = []
    for n in range(count):
        low, high = n * math.pi + 1e-9, (n + 1) * math.pi
        value = lambda x: math.cos(x) + 1 / math.cosh(x)  # noqa: E731
        for _ in range(80):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if value(low) * value(middle) > 0 else (low, middle)
        out.append(low)
    return out


def struck_tip(load, length, ei, mass, stiffness_damping, count=8):
    """Deflection of the tip (m, as a function of time) under a force that acts there from t = 0; mass per length."""
    modes = []
    for x in cantilever_modes(count):
        w2 = x**4 * ei / (mass * length**4)
        # The normalised form is 2 at the tip: modal mass m L, static share 4 F / (m L w^2).
        modes.append((4 * load / (mass * length * w2), math.sqrt(w2), 0.5 * stiffness_damping * math.sqrt(w2)))
    return lambda t: sum(a * (1 - oscillator(t, 1.0, 0.0, w, zeta)) for a, w, zeta in modes)


def strip(height, more, elements=10, load=(2.0, 0.0), duration=1.0, length=1.0):
    return (
        simulation(duration, 200)
        + beam("b", length, f'{{ shape = "rectangle", width = 0.02, height = {height!r} }}', steel, f"elements = {elements}\n{more}")
        + joint("root", "weld", "ground", "b.root")
        + "".join(force("force", "b.tip", f"{f!r}", d) for f, d in zip(load, ((0, 1, 0), (0, 0, 1))) if f)
        + output("tip", "b.tip", "position")
    )


@case(
    "cantilevers damped beyond critical in their fast modes and lightly in the slow ones: the method follows the slow ones",
    "tip against Euler's modes / range; 3000 steps each",
    1e-2,
)
def light_damping_of_slow_modes(run):
    largest = 0.0
    for tau in (3e-5, 1e-4, 3e-4):
        h = run(strip(0.01, f'effects = ["bending_xy"]\ndamping = {{ stiffness = {tau!r} }}'))
        exact = struck_tip(2.0, 1.0, 2.1e11 * 0.02 * 0.01**3 / 12, 7800 * 0.02 * 0.01, tau)
        largest = max(largest, worst(h, "tip.y", exact)) if run.summary["simulation"]["steps"] < 3000 else math.inf
    return largest


@case("a cantilever of 500 elements in space, keep_modes = 3", "tips in both planes against Euler's modes / range; 5 s", 1e-2)
def five_hundred_elements(run):
    h = run(strip(0.01, 'effects = ["bending_xy", "bending_xz"]\nkeep_modes = 3\ndamping = { stiffness = 3e-4 }', 500, (2.0, 4.0)))
    iz, iy, mass = 0.02 * 0.01**3 / 12, 0.01 * 0.02**3 / 12, 7800 * 0.02 * 0.01
    both = (
        worst(h, "tip.y", struck_tip(2.0, 1.0, 2.1e11 * iz, mass, 3e-4)),
        worst(h, "tip.z", struck_tip(4.0, 1.0, 2.1e11 * iy, mass, 3e-4)),
    )
    return max(both) if run.cpu < 5 else math.inf


@case("a film of 1 nm, 1 um long, struck at its tip by a piconewton's thousandth", "tip against Euler's modes / range", 1e-2)
def struck_film(run):
    length, height, width, load = 1e-6, 1e-9, 1e-7, 1e-13
    iz, mass = width * height**3 / 12, 7800 * width * height
    w = cantilever_modes(1)[0] ** 2 * math.sqrt(2.1e11 * iz / (mass * length**4))
    duration, tau = 20 / w, 0.1 / w
    h = run(
        simulation(duration, 200 / duration)
        + beam(
            "b",
            length,
            f'{{ shape = "rectangle", width = {width!r}, height = {height!r} }}',
            steel,
            f'effects = ["bending_xy"]\ndamping = {{ stiffness = {tau!r} }}',
        )
        + joint("root", "weld", "ground", "b.root")
        + force("force", "b.tip", f"{load!r}", (0, 1, 0))
        + output("tip", "b.tip", "position")
    )
    return worst(h, "tip.y", struck_tip(load, length, 2.1e11 * iz, mass, tau))


@case("a cantilever that its weight will bend far", "said by check before any run, with degrees", 0)
def told_before(run):
    text = (
        simulation(1.0, 100, down)
        + beam("b", 4.0, circle(0.01), steel)
        + joint("root", "weld", "ground", "b.root")
        + output("tip", "b.tip", "position")
    )
    stiff = text.replace("diameter = 0.01", "diameter = 0.2")
    said, unsaid = (any("degrees" in note for note in run.check(t)["notes"]) for t in (text, stiff))
    return 0 if said and not unsaid else 1
