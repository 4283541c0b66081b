"""Dry friction in loops that run freely, stops at the start, short pulses, what falls and screws."""
import itertools
import math

import numpy as np
from cases.case import case
from scene import Scene, beam, force, joint, output, rigid, simulation, spring
from truths.formulas import piecewise

R, L, CRANK, ROD, PISTON = 0.1, 0.3, 0.0125, 0.5, 0.8
ROD_INERTIA = ROD * L * L / 12


def crank_scene(duration, rate, more=("", "", "", ""), order=(0, 1, 2, 3), swapped=(), start=0.7, forces="", turned=None, words=""):
    """A slider-crank; turned: rotation vector of the world."""
    tilt = -math.asin(R * math.sin(start) / L)
    at = R * math.cos(start) + L * math.cos(tilt)
    world = f"rotation = {list(turned)}\n" if turned else ""
    joints = [
        ("shaft", "revolute", "ground", "crank", start, f", rate = {rate!r}", world + more[0]),
        ("pin", "revolute", "crank.end", "rod", tilt - start, "", more[1]),
        ("wrist", "revolute", "rod.end", "piston", -tilt, "", more[2]),
        ("guide", "prismatic", "ground", "piston", at, "", world + "axis = [1, 0, 0]\n" + more[3]),
    ]
    text = (
        simulation(duration, 200)
        + rigid("crank", 1.0, (CRANK - 0.0025,) * 3, {"end": (R, 0, 0)}, (0.05, 0, 0))
        + rigid("rod", ROD, (ROD_INERTIA,) * 3, {"end": (L, 0, 0)}, (L / 2, 0, 0))
        + rigid("piston", PISTON, (1e-3,) * 3)
    )
    for k in order:
        name, kind, parent, child, value, rates, extra = joints[k]
        if k in swapped:
            parent, child, value = child, parent, -value
        text += joint(name, kind, parent, child, f"initial = {{ value = {value!r}{rates} }}\n{extra}")
    return text + forces + output("angle", "shaft", "value") + output("speed", "shaft", "rate")


def place(a):
    return R * np.cos(a) + np.sqrt(L * L - (R * np.sin(a)) ** 2)


def inertia(a):
    """Of the crank's coordinate, and its derivative."""

    def value(a):
        s = R / L * np.sin(a)
        c = np.sqrt(1 - s * s)
        tilt = -R / L * np.cos(a) / c
        vx, vy = -R * np.sin(a) + 0.5 * L * s * tilt, R * np.cos(a) + 0.5 * L * c * tilt
        slide = -R * np.sin(a) + L * s * tilt
        return CRANK + ROD * (vx * vx + vy * vy) + ROD_INERTIA * tilt * tilt + PISTON * slide * slide, slide

    I, slide = value(a)
    h = 1e-30  # complex step
    return I, np.imag(value(a + 1j * h)[0]) / h, slide


def free_crank(rate, start, mu, pull=lambda a: 0.0, k=0.0, c=0.0, rest=0.0):
    """Truth of the crank with friction mu (N) on its piston, a force pull(a) and a spring and damper on it; pieces between dead centres."""

    def f_of(sign):
        def f(t, y):
            a, v = y
            I, dI, slide = inertia(a)
            F = -mu * sign + pull(a) - k * (place(a) - rest) - c * slide * v
            return [v, (slide * F - 0.5 * dI * v * v) / I]

        return f

    def events_of(sign):
        g = lambda t, y: inertia(y[0])[2] * y[1]
        g.direction = -sign
        return [(g, -sign)]

    begin = int(np.sign(inertia(start)[2] * rate)) or -1

    def truth(t):
        y = piecewise(f_of, events_of, [start, rate], begin, t, rtol=1e-11, atol=1e-12)
        return {"angle": y[:, :1], "speed": y[:, 1:]}

    return truth


@case("dry friction on the piston of a rigid slider-crank that runs freely, any speed and tolerance", "FrictionLoops.EveryDeadCentre*")
def free_slider_crank():
    rub = "friction = { coefficient = 0.1, normal_force = 10 }"
    held = rub + "\nspring = { stiffness = 200, damping = 2, rest = 0.3 }"
    for rate, words in itertools.product((20.0, 50.0), ((), *(("--tolerance", f"1e-{n}") for n in (4, 5, 6, 7, 8)))):
        T = 20 / rate
        yield Scene(crank_scene(T, rate, ("", "", "", rub)), free_crank(rate, 0.7, 1.0), {"speed": rate}, f"{rate} rad/s {words}", words)
        if rate == 20:
            yield Scene(
                crank_scene(T, rate, ("", "", "", held)),
                free_crank(rate, 0.7, 1.0, k=200, c=2, rest=0.3),
                {"speed": rate},
                f"{rate} rad/s {words}, spring and damper",
                words,
            )


@case("the same with its joints in any order, parent and child exchanged, turned in the world", "FrictionLoops.WhicheverJointIsCut")
def crank_any_order():
    rub = "friction = { coefficient = 0.1, normal_force = 10 }"
    for n, order in enumerate(itertools.permutations(range(4))):
        if n % 2:
            continue
        words = ("--tolerance", f"1e-{4 + n // 2 % 5}")
        swapped = ((), (1,), (2,), (1, 2))[n % 4]
        yield Scene(
            crank_scene(0.4, 50.0, ("", "", "", rub), order, swapped, turned=(0.3, 0.5, -0.7) if n % 3 else None),
            free_crank(50.0, 0.7, 1.0),
            {"speed": 50.0},
            f"{order} {swapped} {words}",
            words,
        )


@case("a crank-rocker that runs freely, dry friction in the rocker's hinge, whichever joint is cut", "FrictionLoops.CrankRocker*; trust")
def free_rocker():
    a, b, c, d = 0.1, 0.4, 0.3, 0.35
    Ia, mb, Ib, Ic = 0.02, 0.3, 0.004, 0.01  # crank about its pin with its mass there; rocker likewise
    mu = 0.2 * 20 * 0.02

    def shape(al):
        x, y = d - a * math.cos(al), -a * math.sin(al)  # from the crank's pin to the rocker's pivot
        r2 = x * x + y * y
        return math.atan2(y, x) + math.acos((b * b + r2 - c * c) / (2 * b * math.sqrt(r2)))  # coupler's angle

    def rates(al):
        """The coupler's angle, and rates of coupler and rocker over the crank's."""
        be = shape(al)
        ro = math.atan2(a * math.sin(al) + b * math.sin(be), a * math.cos(al) + b * math.cos(be) - d)
        A = [[-b * math.sin(be), c * math.sin(ro)], [b * math.cos(be), -c * math.cos(ro)]]
        w, r = np.linalg.solve(A, [a * math.sin(al), -a * math.cos(al)])
        return be, w, r

    def mass(al):
        be, w, r = rates(al)
        vx, vy = -a * math.sin(al) - b / 2 * math.sin(be) * w, a * math.cos(al) + b / 2 * math.cos(be) * w
        return Ia + mb * (vx * vx + vy * vy) + Ib * w * w + Ic * r * r, r

    def f_of(sign):
        def f(t, y):
            h = 1e-5
            I, r = mass(y[0])
            dI = (8 * (mass(y[0] + h)[0] - mass(y[0] - h)[0]) - mass(y[0] + 2 * h)[0] + mass(y[0] - 2 * h)[0]) / (12 * h)
            return [y[1], (-mu * sign * r - 0.5 * dI * y[1] ** 2) / I]

        return f

    def events_of(sign):
        g = lambda t, y: rates(y[0])[2] * y[1]
        g.direction = -sign
        return [(g, -sign)]

    def truth(t):
        y = piecewise(f_of, events_of, [0.5, 40.0], int(np.sign(rates(0.5)[2])), t, rtol=1e-10, atol=1e-11)
        return {"angle": y[:, :1], "speed": y[:, 1:]}

    be = shape(0.5)
    px, py = a * math.cos(0.5) + b * math.cos(be), a * math.sin(0.5) + b * math.sin(be)
    swing = math.atan2(py, px - d)
    for n, order in enumerate(((0, 1, 2, 3), (3, 2, 1, 0), (1, 3, 0, 2), (2, 0, 3, 1))):
        turned = n % 2
        one, other = ("coupler.end", "rocker.end") if not turned else ("rocker.end", "coupler.end")
        joints = [
            joint("shaft", "revolute", "ground", "crank", "initial = { value = 0.5, rate = 40 }"),
            joint("a", "revolute", "crank.end", "coupler", f"initial = {{ guess = {be - 0.5!r} }}"),
            joint("b", "revolute", one, other),
            joint(
                "pivot",
                "revolute",
                "ground",
                "rocker",
                f"position = [{d}, 0, 0]\ninitial = {{ guess = {swing!r} }}\n"
                "friction = { coefficient = 0.2, normal_force = 20, radius = 0.02 }",
            ),
        ]
        for tolerance in (None, "1e-4", "1e-5", "1e-8"):
            yield Scene(
                simulation(0.5, 200)
                + rigid("crank", 1.0, (Ia,) * 3, {"end": (a, 0, 0)})
                + rigid("coupler", mb, (Ib,) * 3, {"end": (b, 0, 0)}, (b / 2, 0, 0))
                + rigid("rocker", 0.6, (Ic,) * 3, {"end": (c, 0, 0)})
                + "".join(joints[k] for k in order)
                + output("angle", "shaft", "value")
                + output("speed", "shaft", "rate"),
                truth,
                {"speed": 40.0},
                f"{order} {tolerance}",
                ("--tolerance", tolerance) if tolerance else (),
            )


def engine_truth(rate, start, mu, gas):
    """Slider-crank under gas(a) on its piston (against x), friction mu |N| of the guide by its side force N, solved for the acceleration.

    N follows from the moments on the rod about its crank pin: unknown a'' enters it linearly, so that sign(N) is tried both ways."""

    def pieces(a, v):
        """Kinematics: rod angle th, its rate and acceleration = p + q a''; likewise piston's x and the rod's centre."""
        s = R * math.sin(a) / L
        th = -math.asin(s)
        cth = math.cos(th)
        dth = -R * math.cos(a) / (L * cth)
        d2 = (R * math.sin(a) / L + math.sin(th) * dth * dth) / cth  # from L sin th = -R sin a, differentiated twice
        return th, dth, d2

    def side(a, v, acceleration, sign, F):
        """Side force that the guide exerts on the piston (along y), for friction mu |N| against slide sign: N by moments of the rod."""
        th, dth, d2 = pieces(a, v)
        w, dw = dth * v, dth * acceleration + d2 * v * v
        # Piston's acceleration and the rod's centre's.
        ax = -R * (math.cos(a) * v * v + math.sin(a) * acceleration) - L * (math.cos(th) * w * w + math.sin(th) * dw)
        cx = -R * (math.cos(a) * v * v + math.sin(a) * acceleration) - L / 2 * (math.cos(th) * w * w + math.sin(th) * dw)
        cy = R * (-math.sin(a) * v * v + math.cos(a) * acceleration) + L / 2 * (-math.sin(th) * w * w + math.cos(th) * dw)
        # Moments about the crank pin: r x (m a) + I dw = wrist arm x force of the piston on the rod (fx, fy);
        # piston: m ax = F - fx - friction, 0 = N - fy.
        rx, ry = math.cos(th), math.sin(th)
        inertia_moment = L / 2 * ROD * (rx * cy - ry * cx) + ROD_INERTIA * dw
        # L (rx fy - ry fx) = inertia_moment, fx = F - mu sign |N| - m ax, fy = N
        best = None
        for sn in (1, -1):
            N = (inertia_moment / L + ry * (F - PISTON * ax)) / (rx + ry * mu * sign * sn)
            if N * sn >= 0:
                best = N
        return best

    def accelerate(a, v, sign):
        I, dI, slide = inertia(a)
        F = -gas(a)
        acceleration = 0.0
        for _ in range(100):
            N = side(a, v, acceleration, sign, F)
            new = (slide * (F - mu * sign * abs(N)) - 0.5 * dI * v * v) / I
            if abs(new - acceleration) < 1e-12 * (1 + abs(new)):
                return new
            acceleration = new
        return acceleration

    f_of = lambda sign: lambda t, y: [y[1], accelerate(y[0], y[1], sign)]

    def events_of(sign):
        g = lambda t, y: inertia(y[0])[2] * y[1]
        g.direction = -sign
        return [(g, -sign)]

    def truth(t):
        y = piecewise(f_of, events_of, [start, rate], int(np.sign(inertia(start)[2] * rate)), t, rtol=1e-9, atol=1e-10)
        return {"angle": y[:, :1], "speed": y[:, 1:]}

    return truth


@case("a one-cylinder engine with gas force, the piston's friction by its reaction, wrist either way", "FrictionLoops.FrictionByReaction*")
def gas_engine():
    gas = lambda a: 200 * math.exp(math.cos(a - 0.3) * 2 - 2) + 20 * math.cos(a)
    value = "200*exp(cos(angle - 0.3)*2 - 2) + 20*cos(angle)"
    rub = 'friction = { coefficient = 0.1, normal_force = "reaction" }'
    truth = engine_truth(50.0, 0.7, 0.1, gas)
    for n, (order, swapped) in enumerate(
        (((0, 1, 2, 3), ()), ((0, 1, 2, 3), (2,)), ((3, 2, 1, 0), (1,)), ((1, 2, 0, 3), (1, 2)), ((2, 3, 1, 0), ()))
    ):
        for words in ((), ("--tolerance", f"1e-{5 + n % 4}")):
            text = crank_scene(0.4, 50.0, ("", "", "", rub), order, swapped, forces=force("force", "piston", value, (-1, 0, 0)))
            yield Scene(text, truth, {"speed": 50.0}, f"{order} {swapped} {words}", words)


@case(
    "an elastic rod with dry friction on the piston: a stiff one moves as a rigid one",
    "FrictionLoops.ElasticRod; stability friction_elastic_rod",
)
def elastic_rod():
    m = {"E": 2.1e11, "rho": 7850.0, "poisson": 0.3}
    d = math.sqrt(ROD / (m["rho"] * L) * 4 / math.pi)  # as heavy as the rigid one
    for effects, words in itertools.product(
        ("", 'effects = ["bending_xy"]', 'without = ["stiffening"]'), ((), ("--tolerance", "1e-5"), ("--tolerance", "1e-8"))
    ):
        rub = "friction = { coefficient = 0.1, normal_force = 10 }"
        text = crank_scene(0.3, 50.0, ("", "", "", rub))
        begin = text.index('[[body]]\nname = "rod"')
        end = text.index('[[body]]\nname = "piston"')
        text = text[:begin] + beam("rod", L, f'{{ shape = "circle", diameter = {d!r} }}', m, effects) + text[end:]
        yield Scene(text.replace("rod.end", "rod.tip"), free_crank(50.0, 0.7, 1.0), {"speed": 50.0}, f"{effects} {words}", words)


@case("a body that starts exactly on its stop", "Stops.CarriesWhatStartsOnIt; stability start_on_stop; trust on_stop")
def on_stop():
    for kind, (stop, side), rate, method in itertools.product(
        ("prismatic", "revolute"),
        (("lower", -1), ("upper", 1), ("both", 1), ("both", -1)),
        (0.0, 2.0),
        ("auto", "adams", "bdf", "erk", "dirk", "ida"),
    ):
        if kind == "revolute" and method not in ("auto", "erk"):
            continue
        k, push, v = 1e5, 20.0, side * rate
        words = {
            "lower": "lower = 0.3",
            "upper": "upper = 0.3",
            "both": "lower = 0.3, upper = 1" if side < 0 else "lower = -1, upper = 0.3",
        }
        w, a = math.sqrt(k), push / k

        def truth(t, side=side, w=w, a=a, rate=rate):
            # On the stop, or away where it has let go: depth a (1 - cos) + v/w sin >= 0, for ever where it had no rate.
            depth = a * (1 - np.cos(w * t)) + rate / w * np.sin(w * t)
            if rate:
                end = (2 * math.pi - 2 * math.atan(rate / (w * a))) / w  # depth is zero again, the speed is -rate
                period = end + 2 * rate / (push)
                s = np.mod(t, period)
                inside = a * (1 - np.cos(w * s)) + rate / w * np.sin(w * s)
                u = s - end
                depth = np.where(s < end, inside, -rate * u + push / 2 * u * u)
            return {"x": (0.3 + side * depth)[:, None]}

        yield Scene(
            simulation(0.02 if not rate else 0.5, 2000 if not rate else 200, method=method)
            + rigid("block", 1.0, (1, 1, 1))
            + joint(
                "way", kind, "ground", "block", f"initial = {{ value = 0.3, rate = {v!r} }}\nstop = {{ {words[stop]}, stiffness = {k} }}"
            )
            + force("force" if kind == "prismatic" else "torque", "block", side * push, (0, 0, 1))
            + output("x", "way", "value"),
            truth,
            {},
            f"{kind} {stop} {side} {rate} {method}",
        )


@case(
    "smooth short pulses: Gaussian pulses, sin(t)^200, on free and on sprung bodies",
    "stability gaussian_pulses, smooth_pulses; trust pulse",
)
def pulses():
    shapes = []
    for width, at in ((1e-7, 5.123), (1e-5, 3.0), (1e-3, 9.99), (1e-2, 0.001)):
        shapes.append((f"100*exp(-((t-{at})/{width})^2)", lambda s, w=width, a=at: 100 * np.exp(-(((s - a) / w) ** 2)), [at], width))
    shapes.append(("sin(t)^200", lambda s: np.sin(s) ** 200, [math.pi / 2 + k * math.pi for k in range(4)], 0.1))
    shapes.append(
        ("5*sin(3*t+1)^2000", lambda s: 5 * np.sin(3 * s + 1) ** 2000, [(math.pi / 2 - 1 + k * math.pi) / 3 for k in range(11)], 0.01)
    )
    for text, f, peaks, width in shapes:
        for k in (0.0, 400.0):
            w = math.sqrt(k) if k else 0.0

            def truth(t, f=f, peaks=peaks, width=width, w=w):
                # Duhamel by quadrature around every peak (12 widths), exact beyond.
                x = np.zeros_like(t)
                for p in peaks:
                    nodes, weights = np.polynomial.legendre.leggauss(200)
                    low = max(0.0, p - 8 * width)
                    for i, s in enumerate(t):
                        high = min(s, p + 8 * width)
                        if high <= low:
                            continue
                        tau = low + (high - low) * (nodes + 1) / 2
                        kernel = np.sin(w * (s - tau)) / w if w else s - tau
                        x[i] += (high - low) / 2 * np.sum(weights * f(tau) * kernel)
                return {"x": x[:, None]}

            for kind in ("prismatic", "revolute"):
                yield Scene(
                    simulation(10.0, 20)
                    + rigid("block", 1.0, (1, 1, 1))
                    + joint("way", kind, "ground", "block", f"spring = {{ stiffness = {k} }}" if k else "")
                    + force("force" if kind == "prismatic" else "torque", "block", text, (0, 0, 1))
                    + output("x", "way", "value"),
                    truth,
                    {},
                    f"{text}, {kind}, spring {k}",
                )


@case("screw joints and other constant accelerations at 1e-6", "stability constant_accelerations, constant_torques; trust")
def constant():
    g, T = 9.81, 1.0
    for m, J, pitch in ((2.0, 0.01, 0.02), (2.0, 0.01, -0.5), (1e-3, 1e-9, 1e-3), (1e3, 50.0, 0.1), (1.0, 1e-3, 1e3)):
        # z = pitch angle: (m pitch^2 + J) angle'' = -m g pitch.
        a = -m * g * pitch / (m * pitch**2 + J)
        for axis, turned in (((0, 0, 1), ""), ((0, 1, 0), "")):
            gravity = tuple(-g * x for x in axis)
            yield Scene(
                simulation(T, 100, gravity, tolerance=1e-6)
                + rigid("nut", m, (J, J, J))
                + joint("thread", "screw", "ground", "nut", f"axis = {list(axis)}\npitch = {pitch}")
                + output("angle", "thread", "value")
                + output("place", "nut", "position"),
                lambda t, a=a, p=pitch, axis=axis: {"angle": (a * t * t / 2)[:, None], "place": np.outer(p * a * t * t / 2, axis)},
                {},
                f"screw {m} kg {J} kg m^2 {pitch} m/rad, axis {axis}",
            )
    for kind, out in (("free", "position"), ("prismatic", "position"), ("cylindrical", "position"), ("planar", "position")):
        axis = "axis = [0, 1, 0]" if kind in ("prismatic", "cylindrical") else ""
        for centre in ((0, 0, 0), (0.3, -0.2, 0.1)):
            if kind == "planar" and any(centre):
                continue
            yield Scene(
                simulation(1.0, 100, (0, -g, 0), tolerance=1e-6)
                + rigid("body", 3.0, (1.0, 2.0, 2.5), centre=centre)
                + joint("j", kind, "ground", "body", axis)
                + output("p", "body", out),
                lambda t: {"p": np.c_[0 * t, -g * t * t / 2, 0 * t]},
                {},
                f"{kind}, centre {centre}",
                claim=1e-5,
            )


@case("a spring with a rest length between points that coincide, its direction undefined: said", "stability undirected_spring")
def undirected():
    for stiffness, damping, rest, preload in ((100, 0, 0.1, 0), (100, 1, 0.0, 5), (0, 1, 0.0, 5)):
        yield Scene(
            simulation(1.0, 100)
            + rigid("a", 1.0, (1, 1, 1))
            + joint("f", "free", "ground", "a")
            + spring("a", "ground", stiffness, damping, rest, preload)
            + output("p", "a", "position"),
            None,
            {},
            f"rest {rest}, preload {preload}",
        )
