"""Hard cases of dry friction in loops that run freely, and of stops, and of loads that act for a short time."""
import itertools
import math

from cases import case, swing
from scenes import bar, beam, circle, energies, force, joint, output, rigid, simulation, steel

crank_length, rod_length, crank_inertia, rod_mass, piston_mass = 0.1, 0.3, 0.0125, 0.5, 0.8


def slider_crank(duration, rate, friction="", tolerance=1e-6, order=(0, 1, 2, 3), swapped=(), others=("", "", ""), start=0.7, more=""):
    """A rigid slider-crank from crank angle `start`; `order` of its joints decides which of them closes the loop."""
    tilt = -math.asin(crank_length * math.sin(start) / rod_length)
    at = crank_length * math.cos(start) + rod_length * math.cos(tilt)
    joints = [
        ("shaft", "revolute", "ground", "crank", start, f", rate = {rate!r}", others[0]),
        ("pin", "revolute", "crank.end", "rod", tilt - start, "", others[1]),
        ("wrist", "revolute", "rod.end", "piston", -tilt, "", others[2]),
        ("guide", "prismatic", "ground", "piston", at, "", "axis = [1, 0, 0]\n" + friction),
    ]
    text = (
        simulation(duration, 200, tolerance=tolerance)
        + rigid("crank", 1.0, (0.01,) * 3, (0.05, 0, 0), {"end": (crank_length, 0, 0)})
        + rigid("rod", rod_mass, (rod_mass * rod_length**2 / 12,) * 3, (rod_length / 2, 0, 0), {"end": (rod_length, 0, 0)})
        + rigid("piston", piston_mass, (1e-3,) * 3)
    )
    for k in order:
        name, kind, parent, child, value, rates, words = joints[k]
        if k in swapped:
            parent, child, value = child, parent, -value
        text += joint(name, kind, parent, child, f"initial = {{ value = {value!r}{rates} }}\n{words}")
    return text + more + output("angle", "shaft", "value") + output("speed", "shaft", "rate") + energies()


def piston_at(angle):
    return crank_length * math.cos(angle) + math.sqrt(rod_length**2 - (crank_length * math.sin(angle)) ** 2)


def inertia_at(angle):
    """Twice the kinetic energy over the square of the crank's speed."""
    sine = crank_length / rod_length * math.sin(angle)
    cosine = math.sqrt(1 - sine * sine)
    tilt = -crank_length / rod_length * math.cos(angle) / cosine
    vx = -crank_length * math.sin(angle) + 0.5 * rod_length * sine * tilt
    vy = crank_length * math.cos(angle) + 0.5 * rod_length * cosine * tilt
    slide = -crank_length * math.sin(angle) + rod_length * sine * tilt
    return crank_inertia + rod_mass * (vx * vx + vy * vy) + rod_mass * rod_length**2 / 12 * tilt * tilt + piston_mass * slide * slide


def path(start, end):
    """The piston's way between two crank angles, back and forth."""
    way, last = 0.0, start
    for k in range(math.ceil(start / math.pi), math.ceil(end / math.pi)):
        way += abs(piston_at(k * math.pi) - piston_at(last))
        last = k * math.pi
    return way + abs(piston_at(end) - piston_at(last))


def speed_error(h, rate, pull, start=0.7):
    """A constant friction force takes out force times path: what the crank's speed is at every angle."""
    worst = 0.0
    for angle, speed in zip(h["angle"], h["speed"]):
        energy = 0.5 * inertia_at(start) * rate * rate - pull * path(start, angle)
        worst = max(worst, abs(speed - math.sqrt(2 * energy / inertia_at(angle))) / rate)
    return worst


@case(
    "free slider-crank with dry friction on its piston, tolerances 1e-4 to 1e-8: 16 dead centres",
    "speed against energy less friction x path / (first speed x tolerance)",
    350,
)
def friction_dead_centres(run):
    return max(
        speed_error(run(slider_crank(1.0, 50.0, "friction = { coefficient = 0.1, normal_force = 10 }", tolerance)), 50.0, 1.0) / tolerance
        for tolerance in (1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
    )


@case(
    "the same with its joints in every order, parent and child exchanged", "speed against energy less friction x path / first speed", 2e-5
)
def friction_whatever_is_cut(run):
    return max(
        speed_error(
            run(slider_crank(0.3, 50.0, "friction = { coefficient = 0.1, normal_force = 10 }", 1e-6, order, (1,) if n % 2 else (2,))),
            50.0,
            1.0,
        )
        for n, order in enumerate(itertools.permutations(range(4)))
        if n % 3 == 0
    )


@case(
    "slider-crank that starts in its dead centre, friction on the piston", "speed against energy less friction x path / first speed", 2e-5
)
def friction_from_dead_centre(run):
    return max(
        speed_error(run(slider_crank(0.5, 30.0, "friction = { coefficient = 0.2, normal_force = 10 }", start=start)), 30.0, 2.0, start)
        for start in (0.0, math.pi)
    )


@case(
    "friction of every joint by its own reaction, parent and child exchanged",
    "speed by one order of the joints against another / first speed",
    3e-5,
)
def friction_by_reaction(run):
    pins = 'friction = { coefficient = 0.2, normal_force = "reaction", radius = 0.02 }'
    both = [
        run(slider_crank(0.5, 50.0, 'friction = { coefficient = 0.1, normal_force = "reaction" }', 1e-7, order, swapped, ("", pins, pins)))
        for order, swapped in (((0, 1, 2, 3), ()), ((3, 2, 1, 0), (1, 2)), ((1, 3, 0, 2), (2,)))
    ]
    return max(abs(a - b) for h in both[1:] for a, b in zip(h["speed"], both[0]["speed"])) / 50


@case(
    "an engine's gas force over the crank angle, friction of the piston by its reaction", "tolerance 1e-6 against 1e-9 / first speed", 1e-4
)
def friction_gas_force(run):
    gas = (
        '[[force]]\nkind = "force"\non = "piston"\ndirection = [-1, 0, 0]\nvalue = { table = [[0, 100], [0.3, 140], [0.8, 60], [2, 15],'
        ' [3.1, 5], [4.5, 5], [5.5, 20]], of = "shaft", period = 6.283185307179586 }\n'
    )
    a, b = (
        run(slider_crank(0.5, 40.0, 'friction = { coefficient = 0.1, normal_force = "reaction" }', tolerance, more=gas))
        for tolerance in (1e-6, 1e-9)
    )
    return max(abs(x - y) for x, y in zip(a["speed"], b["speed"])) / 40


def rocker(duration, tolerance, order):
    joints = [
        joint("shaft", "revolute", "ground", "crank", "initial = { value = 0.5, rate = 40 }"),
        joint("a", "revolute", "crank.end", "coupler"),
        joint("b", "revolute", "coupler.end", "rocker.end"),
        joint(
            "pivot",
            "revolute",
            "ground",
            "rocker",
            "position = [0.35, 0, 0]\nfriction = { coefficient = 0.2, normal_force = 20, radius = 0.02 }",
        ),
    ]
    return (
        simulation(duration, 1000, tolerance=tolerance)
        + bar("crank", 0.1, 1.0)
        + bar("coupler", 0.4, 0.3)
        + bar("rocker", 0.3, 0.6)
        + "".join(joints[k] for k in order)
        + output("swing", "pivot", "value")
        + energies()
    )


@case(
    "free crank-rocker with dry friction in the rocker's pin",
    "energy lost against friction moment x way of the rocker / largest kinetic energy",
    1e-3,
)
def friction_rocker(run):
    worst = 0.0
    for order in ((0, 1, 2, 3), (3, 2, 1, 0), (1, 2, 3, 0)):
        h = run(rocker(1.0, 1e-6, order))
        # The samples leave out what the rocker goes beyond them at its turning points.
        way = sum(abs(b - a) for a, b in zip(h["swing"], h["swing"][1:]))
        worst = max(worst, abs(h["energy"][0] - h["energy"][-1] - 0.2 * 20 * 0.02 * way) / max(h["kinetic"]))
    return worst


@case(
    "elastic rod and dry friction on the piston: reversals beside the dead centres",
    "tolerance 1e-5 against 1e-7, speed / first speed",
    2e-4,
)
def friction_elastic_rod(run):
    def scene(tolerance):
        return (
            simulation(0.3, 1000, tolerance=tolerance)
            + rigid("crank", 1.0, (0.01,) * 3, (0.05, 0, 0), {"end": (0.1, 0, 0)})
            + beam("rod", 0.3, circle(0.01), steel, 'elements = 2\neffects = ["bending_xy"]')
            + rigid("piston", 0.8, (1e-3,) * 3)
            + joint("shaft", "revolute", "ground", "crank", "initial = { value = 0.7, rate = 30 }")
            + joint("pin", "revolute", "crank.end", "rod.root")
            + joint("wrist", "revolute", "rod.tip", "piston")
            + joint("guide", "prismatic", "ground", "piston", "axis = [1, 0, 0]\nfriction = { coefficient = 0.1, normal_force = 50 }")
            + output("speed", "shaft", "rate")
        )

    a, b = run(scene(1e-5)), run(scene(1e-7))
    return max(abs(x - y) for x, y in zip(a["speed"], b["speed"])) / 30


@case("two slides on one another, each with dry friction, stop one after the other", "place against the exact one / size", 1e-7)
def friction_stops_both(run):
    # The upper slows by mu g against the lower until they go together, then both by the floor's.
    h = run(
        simulation(3.0, 100, (0, -9.81, 0), 1e-9)
        + rigid("low", 1.0, (1,) * 3)
        + rigid("high", 1.0, (1,) * 3)
        + joint("floor", "prismatic", "ground", "low", 'axis = [1, 0, 0]\nfriction = { coefficient = 0.1, normal_force = "reaction" }')
        + joint(
            "deck",
            "prismatic",
            "low",
            "high",
            'axis = [1, 0, 0]\ninitial = { rate = 3 }\nfriction = { coefficient = 0.3, normal_force = "reaction" }',
        )
        + output("low", "low", "position")
        + output("high", "high", "position")
    )
    g = 9.81
    up, low = 0.3 * g, (0.3 - 0.2) * g  # the floor bears both: 0.1 x 2 g
    t = 3.0 / (up + low)  # until they go together, then both at 0.1 g
    v = low * t
    high_end = 3 * t - 0.5 * up * t * t + v * v / (2 * 0.1 * g)
    low_end = 0.5 * low * t * t + v * v / (2 * 0.1 * g)
    return max(abs(h["high.x"][-1] - high_end), abs(h["low.x"][-1] - low_end))


@case("body that starts exactly on its stop, every side, method and kind of joint", "depth against k a (1 - cos) + v sin / size", 1e-5)
def start_on_stop(run):
    worst = 0.0
    for kind, (stop, side), method, rate in itertools.product(
        ("prismatic", "revolute"),
        (("lower = 0.25", -1), ("upper = 0.25", 1), ("lower = -1, upper = 0.25", 1)),
        ("auto", "erk", "dirk", "bdf"),
        (0.0, 0.5),
    ):
        h = run(
            simulation(0.03, 1000, tolerance=1e-7, more=f'method = "{method}"')
            + rigid("block", 1.0, (1,) * 3)
            + joint(
                "slide",
                kind,
                "ground",
                "block",
                f"initial = {{ value = 0.25, rate = {side * rate} }}\nstop = {{ {stop}, stiffness = 1e4 }}",
            )
            + force("force" if kind == "prismatic" else "torque", "block", side * 10)
            + output("x", "slide", "value")
        )
        for t, x in zip(h["t"], h["x"]):
            worst = max(worst, abs(side * (x - 0.25) - 1e-3 * (1 - math.cos(100 * t)) - rate / 100 * math.sin(100 * t)))
    return worst


@case(
    "ball that reaches its stop by a millionth of its flight, within one long step", "energy / largest kinetic energy, and one blow", 1e-4
)
def grazed_stop(run):
    h = run(
        simulation(0.8, 10, down, 1e-6)
        + rigid("ball", 1.0, (1,) * 3)
        + joint(
            "flight",
            "prismatic",
            "ground",
            "ball",
            f"axis = [0, 1, 0]\ninitial = {{ rate = {math.sqrt(2 * 9.81 * (1 + 1e-6))!r} }}\nstop = {{ upper = 1, stiffness = 1e9 }}",
        )
        + energies()
    )
    assert run.notes.count("meets its upper stop") >= 1, "the stop was passed by"
    return swing(h)


down = (0, -9.81, 0)


def kicked(run, value, impulse, method="auto", duration=1.0):
    h = run(
        simulation(duration, 10, more=f'method = "{method}"')
        + rigid("block", 1.0, (1,) * 3)
        + joint("slide", "prismatic", "ground", "block")
        + force("force", "block", value)
        + output("v", "slide", "rate")
    )
    return abs(h["v"][-1] - impulse) / impulse


@case("Gaussian pulses of a millionth to a tenth of the duration, every method", "speed against impulse", 2e-4)
def gaussian_pulses(run):
    return max(
        kicked(
            run,
            f"3*exp(-((t-0.6180339)/{width})^2)/{width}",
            3 * math.sqrt(math.pi) * (math.erf(0.6180339 / width) + math.erf(0.3819661 / width)) / 2,
            method,
        )
        for width in (1e-6, 1e-4, 1e-2, 0.1)
        for method in ("auto", "erk", "dirk", "bdf")
    )


@case("sin(t)^200 over ten seconds, sech and its products", "speed against impulse", 1e-4)
def smooth_pulses(run):
    # Over a half period sin^200 has the mean 200! / (2^100 100!)^2.
    mean = math.exp(math.lgamma(201) - 2 * (100 * math.log(2) + math.lgamma(101)))
    return max(
        kicked(run, "sin(t)^200", 3 * math.pi * mean, duration=3 * math.pi),
        kicked(run, "1e5/cosh((t-0.37)/1e-5)", math.pi),
        kicked(run, "1e4*exp(-((t-0.8)/1e-4)^2)*cos((t-0.8)/1e-4)", math.sqrt(math.pi) * math.exp(-0.25)),
    )


@case("a drive that twitches for 0.1 ms, and a peak of a force over the way", "amplitude, and energy, against the exact ones", 2e-3)
def short_drives(run):
    h = run(
        simulation(1.0, 1000, tolerance=1e-8)
        + rigid("base", 1.0, (1,) * 3)
        + rigid("block", 1.0, (1,) * 3)
        + joint("drive", "prismatic", "ground", "base", 'motion = "0.01*exp(-((t-0.7)/1e-4)^2)"')
        + joint("slide", "prismatic", "base", "block", "spring = { stiffness = 100 }")
        + output("z", "block", "position")
    )
    amplitude = 10 * 0.01 * 1e-4 * math.sqrt(math.pi)
    worst = max(abs(z - amplitude * math.sin(10 * (t - 0.7))) for t, z in zip(h["t"], h["z.z"]) if t > 0.701) / amplitude
    h = run(
        simulation(0.1, 100)
        + rigid("block", 1.0, (1,) * 3)
        + joint("slide", "prismatic", "ground", "block", "initial = { rate = 10 }")
        + '[[force]]\nkind = "force"\non = "block"\ndirection = [0, 0, 1]\nvalue = { table = ['
        + ", ".join(f"[{0.44 + 1e-3 * k:.3f}, {1000 if k == 60 else 0}]" for k in range(121))
        + '], of = "slide" }\n'
        + output("v", "slide", "rate")
    )
    # The integral of a cubic spline through points at even distances is their trapezoidal sum, ends aside: 1 J.
    return max(worst, abs(0.5 * (h["v"][-1] ** 2 - 100) - 1))


@case("spring with a rest length between points that coincide", "clear refusal", 0)
def undirected_spring(run):
    message = run.fails(
        simulation(1.0)
        + rigid("block", 1.0, (1,) * 3)
        + joint("free", "free", "ground", "block")
        + '[[force]]\nkind = "spring-damper"\non = "block"\nstiffness = 100\nrest = 0.1\n'
        + output("x", "block", "position"),
        (2,),
    )
    return 0 if "same point" in message and "direction" in message else 1


@case("static start held by a load that ends at t = 0", "place against x cos(w t) / x", 1e-6)
def released(run):
    h = run(
        simulation(1.0, 1000, tolerance=1e-8, more='start = "static"')
        + rigid("block", 1.0, (1,) * 3)
        + joint("slide", "prismatic", "ground", "block", "spring = { stiffness = 100 }")
        + force("force", "block", "t <= 0 ? 5 : 0")
        + output("x", "slide", "value")
    )
    return max(abs(x - 0.05 * math.cos(10 * t)) for t, x in zip(h["t"], h["x"])) / 0.05


# Balls on springy floors: flights and blows follow one another, each by its formula


def ball(duration, stiffness, damping, height, rate=100.0, more="", tolerance=1e-6):
    return (
        simulation(duration, rate, down, tolerance, more)
        + rigid("ball", 1.0, (1,) * 3)
        + joint(
            "flight",
            "prismatic",
            "ground",
            "ball",
            f"axis = [0, 1, 0]\ninitial = {{ value = {height!r} }}\n"
            f"stop = {{ lower = 0, stiffness = {stiffness!r}, damping = {damping!r} }}",
        )
        + output("y", "flight", "value")
        + output("v", "flight", "rate")
    )


def bouncing(t, stiffness, height):
    """Height of an undamped ball let go at rest."""
    g, w = 9.81, math.sqrt(stiffness)
    v, fall = math.sqrt(2 * g * height), math.sqrt(2 * height / g)
    phase, depth = math.atan2(v / w, g / stiffness), math.hypot(g / stiffness, v / w)
    s = (t + fall) % (2 * fall + (2 * math.pi - 2 * phase) / w)
    return v * s - g * s * s / 2 if s < 2 * fall else depth * math.cos(w * (s - 2 * fall) + phase) - g / stiffness


@case(
    "22 blows of a ball on floors of 1e4 to 1e8 N/m, tolerances 1e-4 to 1e-6", "height against flights and blows / (height x tolerance)", 20
)
def many_blows(run):
    return max(
        max(abs(y - bouncing(t, stiffness, 1.0)) for t, y in zip(*(h[c] for c in ("t", "y")))) / tolerance
        for stiffness in (1e4, 1e6, 1e8)
        for tolerance in (1e-4, 1e-5, 1e-6)
        for h in (run(ball(10.0, stiffness, 0.0, 1.0, tolerance=tolerance)),)
    )


def pulled_up(stiffness, damping, speed):
    """A blow at `speed` on a damped floor: its time, and the speed and place at which the floor would begin to pull."""
    g, sigma = 9.81, damping / 2
    w = math.sqrt(stiffness - sigma * sigma)
    rest = -g / stiffness

    def at(t):
        a, b = -rest, (-speed - sigma * rest) / w
        e, c, s = math.exp(-sigma * t), math.cos(w * t), math.sin(w * t)
        x = e * (a * c + b * s)
        return rest + x, e * w * (b * c - a * s) - sigma * x

    def push(t):
        x, v = at(t)
        return -stiffness * x - damping * v

    low, high = 0.5 * math.pi / w, 2 * math.pi / w
    if push(high) > 0 and all(push(low + (high - low) * k / 400) > 0 for k in range(401)):
        return None
    high = next(low + (high - low) * k / 400 for k in range(401) if push(low + (high - low) * k / 400) <= 0)
    low = high - (2 * math.pi / w - low) / 400
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if push(middle) > 0 else (low, middle)
    return (high, *at(high))


@case(
    "a ball comes to rest on a floor of 1e8 N/m, damped at a twentieth: blows until it only grazes the floor",
    "height of the flights against flights and blows by formula, and where it rests, / first height; events < 3000, seconds",
    1e-3,
)
def grazing_to_rest(run):
    stiffness, damping, height, g = 1e8, 1000.0, 0.1, 9.81
    h = run(ball(4.0, stiffness, damping, height, 1000.0, tolerance=1e-7))
    t0, y0, v0, worst, at = 0.0, height, 0.0, 0.0, 0
    for _ in range(12):
        # A flight from (t0, y0, v0), which may lie a little below the floor, until it meets it from above.
        lands = t0 + (v0 + math.sqrt(v0 * v0 + 2 * g * y0)) / g
        while at < len(h["t"]) and h["t"][at] < lands:
            t = h["t"][at]
            if t >= t0:
                worst = max(worst, abs(h["y"][at] - (y0 + v0 * (t - t0) - g / 2 * (t - t0) ** 2)))
            at += 1
        took, y0, v0 = pulled_up(stiffness, damping, g * (lands - t0) - v0)
        t0 = lands + took
    rests = abs(h["y"][-1] + g / stiffness)
    return max(worst / height, rests / height) if run.cpu < 5 and run.notes.count("meets") < 3000 else math.inf


@case(
    "a slider-crank whose slide has a guess, friction in other joints, on either side of the shaft",
    "place at the start against the guess' side, m",
    1e-9,
)
def guess_whatever_is_cut(run):
    a, l, p0, worst = 0.1, 0.3, 0.7, 0.0
    for side in (1, -1):
        for rubs in (("shaft",), ("shaft", "wrist"), ("pin", "wrist"), ()):
            rub = lambda name: "friction = { coefficient = 0.5, normal_force = 0.01 }" if name in rubs else ""
            x = a * math.cos(p0) + side * math.sqrt(l * l - (a * math.sin(p0)) ** 2)
            text = (
                simulation(0.01, 100)
                + rigid("crank", 1.0, (0.01, 0.01, 0.01), frames={"end": (a, 0, 0)})
                + rigid("rod", 1.0, (0.01, 0.01, 0.01), frames={"end": (l, 0, 0)})
                + rigid("slider", 1.0, (0.01, 0.01, 0.01))
                + joint("shaft", "revolute", "ground", "crank", f"initial = {{ value = {p0}, rate = 1.0 }}\n{rub('shaft')}")
                + joint("pin", "revolute", "crank.end", "rod", rub("pin"))
                + joint("wrist", "revolute", "rod.end", "slider", rub("wrist"))
                + joint("guide", "prismatic", "ground", "slider", f"axis = [1, 0, 0]\ninitial = {{ guess = {1.1 * x!r} }}")
                + output("p", "slider", "position")
            )
            worst = max(worst, abs(run(text)["p.x"][0] - x))
    return worst
