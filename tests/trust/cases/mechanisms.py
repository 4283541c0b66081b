"""Rigid mechanisms and vehicles: equations by hand, or a closed formula."""
import math

import numpy as np
from cases.case import case
from cases.common import TINY, g, out, still
from scene import Scene, force, joint, output, rigid, simulation, spring
from scipy.optimize import brentq, root
from truths.formulas import ode, piecewise


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


@case("a throw seen from a wheel that turns ever faster: place, velocity and distance in its axes")
def seen_from_a_wheel():
    a, v, g = 3.0, np.array([2.0, 1.0, 4.0]), np.array([0, 0, -9.81])

    def truth(t):
        phi, W = a * t * t / 2, a * t
        p, q = np.outer(t, v) + np.outer(t * t / 2, g), v + np.outer(t, g)
        rim = np.c_[np.cos(phi), np.sin(phi), 0 * t]
        d = p - rim
        rate = q - W[:, None] * np.c_[-rim[:, 1], rim[:, 0], 0 * t]
        # Seen from the wheel: the rate of the place in its axes.
        seen = rate - np.c_[-W * d[:, 1], W * d[:, 0], 0 * t]
        turn = lambda x: np.c_[np.cos(phi) * x[:, 0] + np.sin(phi) * x[:, 1], np.cos(phi) * x[:, 1] - np.sin(phi) * x[:, 0], x[:, 2]]
        length = np.linalg.norm(d, axis=1)
        return {
            "p": turn(d),
            "v": turn(seen),
            "far": length[:, None],
            "rate": ((d * rate).sum(axis=1) / length)[:, None],
        }

    yield Scene(
        simulation(1.5, 100, g)
        + rigid("wheel", 5.0, (1.0,) * 3, {"rim": (1, 0, 0)})
        + rigid("ball", 0.1, (1e-4,) * 3)
        + joint("axle", "revolute", "ground", "wheel", f'motion = "{a / 2}*t^2"')
        + joint("free", "free", "ground", "ball", f"initial = {{ rate = {[*map(float, v), 0, 0, 0]} }}")
        + out("p", "ball", "position", 'relative_to = "wheel.rim"')
        + out("v", "ball", "velocity", 'relative_to = "wheel.rim"')
        + out("far", "ball", "distance", 'relative_to = "wheel.rim"')
        + out("rate", "ball", "distance_rate", 'relative_to = "wheel.rim"'),
        truth,
        {},
        "3 rad/s^2",
    )


@case("a satellite that spins draws its booms in: spin by the angular momentum, force of the drives")
def booms():
    J, m, W = 2.0, 0.5, 3.0
    r = lambda t: 1.0 - 0.35 * (1 - np.cos(math.pi * t / 2))
    a = lambda t: -0.35 * (math.pi / 2) ** 2 * np.cos(math.pi * t / 2)

    def truth(t):
        w = (J + 2 * m) * W / (J + 2 * m * r(t) ** 2)
        R = np.full((len(t), 6), np.nan)
        R[:, 0] = m * (a(t) - w**2 * r(t))  # along the boom, in its axes
        return {"w": np.c_[0 * t, 0 * t, w], "drive": R}

    motion = 'motion = "1 - 0.35*(1 - cos(pi*t/2))"'
    yield Scene(
        simulation(4.0, 100)
        + rigid("hub", 20.0, (1.0, 1.0, J))
        + rigid("a", m, (0, 0, 0))
        + rigid("b", m, (0, 0, 0))
        + joint("free", "free", "ground", "hub", f"initial = {{ rate = [0, 0, 0, 0, 0, {W}] }}")
        + joint("left", "prismatic", "hub", "a", f"axis = [1, 0, 0]\n{motion}")
        + joint("right", "prismatic", "hub", "b", f"axis = [-1, 0, 0]\n{motion}")
        + output("w", "hub", "angular_velocity")
        + out("drive", "left", "reaction", 'frame = "parent"'),
        truth,
        {},
        "two booms",
    )


@case("a crank slides a block by a linear coupling, a rack winds a rope, a screw lifts: accelerations by hand")
def coupled_by_hand():
    g = 9.81
    # A drum of radius r under a motor torque lifts m by a rope coupling of rack and a counterweight on the other side.
    r, J, m, c, T = 0.1, 0.05, 3.0, 2.0, 4.0
    a = (T - (m - c) * g * r) / (J + (m + c) * r * r)
    yield Scene(
        simulation(1.0, 100, (0, 0, -g))
        + rigid("drum", 1.0, (J,) * 3)
        + rigid("load", m, (0.1,) * 3)
        + rigid("weight", c, (0.1,) * 3)
        + joint("axle", "revolute", "ground", "drum", "axis = [0, 1, 0]")
        + joint("up", "prismatic", "ground", "load", "axis = [0, 0, 1]")
        + joint("down", "prismatic", "ground", "weight", "axis = [0, 0, 1]\nposition = [1, 0, 0]")
        + f'[[coupling]]\nname = "one"\nkind = "rack"\njoints = ["axle", "up"]\nradius = {r}\n\n'
        + f'[[coupling]]\nname = "two"\nkind = "rack"\njoints = ["axle", "down"]\nradius = {-r}\n\n'
        + force("torque", "drum", T, (0, 1, 0))
        + output("turn", "axle", "value")
        + output("pull", "one", "force"),
        lambda t, a=a, pull=m * (g + r * a): {"turn": (a * t * t / 2)[:, None], "pull": np.tile([-r * pull, pull], (len(t), 1))},
        {"pull": m * g},
        "drum, load and counterweight",
    )
    # A screw joint whose nut carries a load, turned by a torque against dry friction in a guide.
    p, J, m, T, N, mu = 0.01, 0.02, 5.0, 1.2, 40.0, 0.2
    a = (T - m * g * p - mu * N * p) / (J + m * p * p)
    yield Scene(
        simulation(1.0, 100, (0, 0, -g))
        + rigid("screw", m, (J,) * 3)
        + rigid("sleeve", 0.0, (0, 0, 0))
        + joint("thread", "screw", "ground", "screw", f"axis = [0, 0, 1]\npitch = {p}")
        + joint("turns", "revolute", "screw", "sleeve", "axis = [0, 0, 1]")
        + joint("guide", "prismatic", "ground", "sleeve", f"axis = [0, 0, 1]\nfriction = {{ coefficient = {mu}, normal_force = {N} }}")
        + force("torque", "screw", T, (0, 0, 1))
        + output("way", "screw", "position"),
        lambda t, a=a: {"way": np.c_[np.full((len(t), 2), np.nan), p * a * t * t / 2]},
        {},
        "screw, guide with friction",
    )


@case("a mass in a tube that turns freely: a spring holds it, the spin slows down as it goes out")
def spinning_tube():
    m, k, L, J = 0.5, 200.0, 0.1, 0.02
    for spin, c in ((5.0, 0.0), (15.0, 0.0), (30.0, 2.0)):

        def f(_, y, c=c):
            x, a, v, w = y
            return [v, w, x * w * w - k / m * (x - L) - c / m * v, -2 * m * x * v * w / (J + m * x * x)]

        yield Scene(
            simulation(3, 200)
            + rigid("tube", 1.0, (1e-3, J, J))
            + rigid("mass", m, TINY)
            + joint("post", "revolute", "ground", "tube", f"initial = {{ value = 0, rate = {spin} }}")
            + joint(
                "slide",
                "prismatic",
                "tube",
                "mass",
                f"axis = [1, 0, 0]\ninitial = {{ value = {L}, rate = 0 }}\nspring = {{ stiffness = {k}, damping = {c}, rest = {L} }}",
            )
            + out("turn", "post", "rate")
            + out("way", "slide", "value"),
            lambda t, f=f, s=spin: (lambda y: {"turn": y[:, 3:], "way": y[:, :1]})(ode(f, [L, 0.0, 0.0, s], t)),
            {},
            f"{spin} rad/s, damper {c}",
        )


@case("a platform on six struts (Stewart): where it rests under a load beside its middle")
def hexapod():
    base = [(math.cos(x), math.sin(x), 0.0) for x in np.radians([10, 110, 130, 230, 250, 350])]
    plate = [(0.6 * math.cos(x), 0.6 * math.sin(x), 0.0) for x in np.radians([50, 70, 170, 190, 290, 310])]
    k, m, h = 2e4, 40.0, 0.9
    rest = [math.dist(b, (p[0], p[1], h)) for b, p in zip(base, plate)]
    for c in ((0.0, 0.0, 0.0), (0.25, 0.1, 0.05)):

        def forces(x, c=c):
            angle = np.linalg.norm(x[3:]) + 1e-300
            K = np.array([[0, -x[5], x[4]], [x[5], 0, -x[3]], [-x[4], x[3], 0]]) / angle
            Rm = np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K
            F, M = np.array([0, 0, -m * g]), np.cross(Rm @ c, [0, 0, -m * g])
            for b, p, r0 in zip(base, plate, rest):
                arm = Rm @ p
                d = x[:3] + arm - b
                s = np.linalg.norm(d)
                f = -k * (s - r0) * d / s
                F, M = F + f, M + np.cross(arm, f)
            return np.r_[F, M]

        x = root(forces, [0, 0, h - 0.01, 1e-3, 1e-3, 1e-3], tol=1e-12).x
        yield Scene(
            simulation(0.01, 200, (0, 0, -g), start="static")
            + "[ground]\nframes = { "
            + ", ".join(f"b{i} = {[float(v) for v in b]}" for i, b in enumerate(base))
            + " }\n"
            + rigid("plate", m, (2, 2, 4), {f"p{i}": p for i, p in enumerate(plate)}, centre=c)
            + joint("free", "free", "ground", "plate", f"position = [0, 0, {h}]")
            + "".join(spring(f"plate.p{i}", f"ground.b{i}", k, 100.0, rest[i]) for i in range(6))
            + output("plate", "plate", "position"),
            still(plate=x[:3]),
            {"plate": max(1e-4, float(np.linalg.norm(x[:3] - [0, 0, h])))},
            f"centre of mass {c}",
        )


@case("half a car over a bump in the road: wheels as circles on a curve, springs and dampers (flat where it rests)")
def quarter_car():
    m, mu, ks, cs, kt, R, v = 300.0, 40.0, 2e4, 1.5e3, 2e5, 0.3, 5.0
    for height, width in ((0.04, 2.0), (0.08, 3.0)):
        # Road y = h exp(-(x/w)^2), x from -4; a circle of radius R on it: nearest point by Newton, convex enough.
        x0 = -4.0
        road = lambda u, h=height, w=width: h * math.exp(-((u / w) ** 2))
        slope = lambda u, h=height, w=width: -2 * u / w**2 * road(u, h, w)

        def f(t, y, road=road, slope=slope):
            x = x0 + v * t
            c = y[0]
            u = x
            for _ in range(30):
                F = (u - x) + (road(u) - c) * slope(u)
                dF = 1 + slope(u) ** 2 + (road(u) - c) * (slope(u + 1e-6) - slope(u - 1e-6)) / 2e-6
                u -= F / dF
            D = math.hypot(x - u, c - road(u))
            N = kt * max(0.0, R - D) * (c - road(u)) / D
            S = ks * (y[1] - y[0] - 0.5) + cs * (y[3] - y[2])
            return [y[2], y[3], (N + S - mu * g) / mu, (-S - m * g) / m]

        c0 = R - (m + mu) * g / kt + 0.0
        start = root(lambda z: f(0, [z[0], z[1], 0, 0])[2:], [c0 + road(x0), c0 + 0.5 - m * g / ks], tol=1e-13).x
        yield Scene(
            simulation(1.8, 200, (0, -g, 0), tolerance=1e-8)
            + rigid("sledge", 10.0, TINY)
            + rigid("wheel", mu, TINY)
            + rigid("body", m, TINY)
            + joint("drive", "prismatic", "ground", "sledge", f'axis = [1, 0, 0]\nmotion = "{x0} + {v}*t"')
            + joint("low", "prismatic", "sledge", "wheel", f"axis = [0, 1, 0]\ninitial = {{ value = {float(start[0])!r}, rate = 0 }}")
            + joint("high", "prismatic", "sledge", "body", f"axis = [0, 1, 0]\ninitial = {{ value = {float(start[1])!r}, rate = 0 }}")
            + spring("body", "wheel", ks, cs, 0.5)
            + f'[[force]]\nkind = "contact"\nname = "tyre"\non = "wheel"\nshape = "sphere"\nradius = {R}\nagainst = "curve"\n'
            + f'curve = {{ x = "u", y = "{height}*exp(-(u/{width})^2)", from = -8, to = 8 }}\nstiffness = {kt}\n\n'
            + out("wheel", "low", "value")
            + out("body", "high", "value"),
            lambda t, f=f, start=start: (lambda y: {"wheel": y[:, :1], "body": y[:, 1:2]})(ode(f, [*start, 0.0, 0.0], t, rtol=1e-10)),
            {},
            f"{height} m by {width} m",
        )


def quick_return(tolerance, order, rate=30.0, R=0.1, d=0.25, rub=1.0):
    """A crank's block slides in a slotted arm that swings about a pivot beside the shaft; dry friction in the slot."""
    J1, J2, m, J = 0.012, 0.02, 0.5, 2e-4

    def at(a):
        s = np.sqrt(R * R + d * d + 2 * R * d * np.cos(a))
        return s, -R * d * np.sin(a) / s, (R * R + R * d * np.cos(a)) / s**2

    def mass(a):
        return J1 + m * R * R + (J2 + J) * at(a)[2] ** 2

    def f_of(sign):
        def f(_, y):
            a, v = y
            slope = np.imag(mass(a + 1e-30j)) / 1e-30
            return [v, (-rub * sign * at(a)[1] - 0.5 * slope * v * v) / mass(a)]

        return f

    def events_of(sign):
        g = lambda t, y: at(y[0])[1] * y[1]
        g.direction = -sign
        return [(g, -sign)]

    start = 0.7
    s, _, _ = at(start)
    swing = math.atan2(R * math.sin(start), d + R * math.cos(start))
    joints = [
        joint("shaft", "revolute", "ground", "crank", f"initial = {{ value = {start}, rate = {rate} }}"),
        joint("pivot", "revolute", "ground", "arm", f"position = [{-d}, 0, 0]\ninitial = {{ guess = {swing!r} }}"),
        joint("pin", "revolute", "crank.end", "block", f"initial = {{ guess = {swing - start!r} }}"),
        joint(
            "slot",
            "prismatic",
            "arm",
            "block",
            f"axis = [1, 0, 0]\ninitial = {{ guess = {float(s)!r} }}\nfriction = {{ coefficient = 0.1, normal_force = {10 * rub} }}",
        ),
    ]

    def truth(t):
        y = piecewise(f_of, events_of, [start, rate], -1, t, rtol=1e-11, atol=1e-12)
        return {"angle": y[:, :1], "speed": y[:, 1:]}

    return Scene(
        simulation(0.6, 300)
        + rigid("crank", 1.0, (J1,) * 3, {"end": (R, 0, 0)})
        + rigid("arm", 2.0, (J2,) * 3)
        + rigid("block", m, (J,) * 3)
        + "".join(joints[k] for k in order)
        + output("angle", "shaft", "value")
        + output("speed", "shaft", "rate"),
        truth,
        {"speed": rate},
        f"{order} {tolerance}",
        ("--tolerance", tolerance) if tolerance else (),
    )


@case("a quick-return mechanism that runs freely, dry friction of its block in the slot, whichever joint is cut")
def slotted_lever():
    orders = [(0, 1, 2, 3), (3, 1, 0, 2), (1, 3, 2, 0), (2, 0, 1, 3)]
    for order, tolerance in zip(orders * 2, (None, "1e-4", "1e-5", "1e-8", "1e-6", None, "1e-7", "1e-5")):
        yield quick_return(tolerance, order)
