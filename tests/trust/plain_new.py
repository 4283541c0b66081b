"""Scenes made after the program was right on all others: one or two of each kind that a stranger would try next."""
import itertools
import math

import numpy as np
from plain_case import Modes, case
from plain_effects import E, G, RHO, STEEL, circle, still
from scene import Scene, beam, force, joint, output, rigid, simulation, spring, weld
from scipy.optimize import brentq
from truths import of_rectangles, ode, piecewise


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
def new_slotted():
    orders = [(0, 1, 2, 3), (3, 1, 0, 2), (1, 3, 2, 0), (2, 0, 1, 3)]
    for order, tolerance in zip(orders * 2, (None, "1e-4", "1e-5", "1e-8", "1e-6", None, "1e-7", "1e-5")):
        yield quick_return(tolerance, order)


@case("a body that rests on its stop until a load that grows lifts it")
def new_lifted():
    g, m = 9.81, 2.0
    for kind, both in itertools.product(("prismatic", "revolute"), (False, True)):
        L = 0.4
        J = m * L * L / 3
        weight = m * g if kind == "prismatic" else m * g * L / 2
        rise = 2.0 * weight  # of the load, per second
        t0 = weight / rise
        inertia = m if kind == "prismatic" else J

        def truth(t, kind=kind, rise=rise, t0=t0, inertia=inertia):
            lift = np.clip(t - t0, 0, None)
            if kind == "prismatic":
                return {"x": (rise * lift**3 / 6 / inertia).reshape(-1, 1)}
            late = np.linspace(t0, t[-1], 2000)
            y = ode(lambda s, y: [y[1], (rise * s - m * g * L / 2 * math.cos(y[0])) / inertia], [0.0, 0.0], late, atol=1e-14)
            return {"x": np.interp(t, late, y[:, 0], left=0.0).reshape(-1, 1)}

        stop = f"stop = {{ lower = 0.0, {'upper = 3.0, ' if both else ''}stiffness = 1e8, damping = 1e3 }}"
        body = rigid("b", m, (J,) * 3) if kind == "prismatic" else rigid("b", m, (0.01, m * L * L / 12, m * L * L / 12), {}, (L / 2, 0, 0))
        yield Scene(
            simulation(1.0, 200, (0, -g, 0))
            + body
            + joint("j", kind, "ground", "b", ("axis = [0, 1, 0]\n" if kind == "prismatic" else "") + stop)
            + force("force" if kind == "prismatic" else "torque", "b", f"{rise}*t", (0, 1, 0) if kind == "prismatic" else (0, 0, 1))
            + output("x", "j", "value"),
            truth,
            {},
            f"{kind}, {'two stops' if both else 'one stop'}",
        )


@case("short smooth pulses of other shapes: sech^2, a Lorentz peak, a torque on a pendulum, a twitch of a drive")
def new_pulses():
    m = 2.0
    shapes = {
        "sech": ("500/cosh((t - 1.37)/2e-4)^2", lambda t: 500 / np.cosh(np.clip((t - 1.37) / 2e-4, -300, 300)) ** 2, 500 * 4e-4),
        "gauss": ("800*exp(-((t - 2.71)/1e-4)^2)", lambda t: 800 * np.exp(-(((t - 2.71) / 1e-4) ** 2)), 800 * 1e-4 * math.sqrt(math.pi)),
        "lorentz": ("300/(1 + ((t - 0.93)/1e-5)^2)", lambda t: 300 / (1 + ((t - 0.93) / 1e-5) ** 2), None),
    }
    for name, (text, f, whole) in shapes.items():
        when = {"sech": 1.37, "gauss": 2.71, "lorentz": 0.93}[name]
        width = {"sech": 2e-4, "gauss": 1e-4, "lorentz": 1e-5}[name]

        def speed(t, name=name, when=when, width=width, whole=whole):
            if name == "lorentz":
                return 300 * width / m * (np.arctan((t - when) / width) + math.atan(when / width))
            shape = (1 + np.tanh((t - when) / width)) / 2 if name == "sech" else np.vectorize(math.erf)((t - when) / width) / 2 + 0.5
            return whole / m * shape

        yield Scene(
            simulation(4.0, 50)
            + rigid("b", m, (1,) * 3)
            + joint("j", "prismatic", "ground", "b", "axis = [1, 0, 0]")
            + force("force", "b", text, (1, 0, 0))
            + output("v", "j", "rate"),
            lambda t, speed=speed: {"v": speed(t).reshape(-1, 1)},
            {},
            name,
        )
    L, blow = 0.5, 3e-2 * math.sqrt(math.pi) / 1.0  # N m s
    J = m * L * L / 3

    def swung(t):
        before, after = t[t <= 2.0], np.r_[2.0, t[t > 2.0]]
        y = ode(lambda s, y: [y[1], -m * 9.81 * L / 2 / J * math.sin(y[0])], [0.0, blow / J], after, atol=1e-13)
        return {"a": np.r_[0 * before, y[1:, 0]].reshape(-1, 1)}

    yield Scene(
        simulation(5.0, 50, (0, -9.81, 0))
        + rigid("b", m, (1e-3, m * L * L / 12, m * L * L / 12), {}, (L / 2, 0, 0))
        + joint("j", "revolute", "ground", "b", "rotation = [0, 0, -1.5707963267948966]")
        + force("torque", "b", "300*exp(-((t - 2.0)/1e-4)^2)", (0, 0, 1))
        + output("a", "j", "value"),
        swung,
        {},
        "a blow on a hanging pendulum",
    )
    k, c = 900.0, 1.2

    def shaken(t):
        # Base x = A exp(-((t - 1)/w)^2): the relative motion feels -A m x''; over so short a time only its integrals count.
        A, w = 1e-2, 2e-3
        y = ode(
            lambda s, y: [
                y[1],
                (
                    k * (A * math.exp(-(((s - 1) / w) ** 2)) - y[0])
                    + c * (-2 * A * (s - 1) / w**2 * math.exp(-(((s - 1) / w) ** 2)) - y[1])
                )
                / m,
            ],
            [0.0, 0.0],
            t,
            atol=1e-15,
            max_step=5e-4,
        )
        return {"x": np.c_[y[:, 0], np.nan * t, np.nan * t]}

    yield Scene(
        simulation(3.0, 50)
        + rigid("base", 1.0, (1,) * 3)
        + rigid("b", m, (1,) * 3)
        + joint("drive", "prismatic", "ground", "base", 'axis = [1, 0, 0]\nmotion = "1e-2*exp(-((t - 1)/2e-3)^2)"')
        + joint("j", "prismatic", "base", "b", f"axis = [1, 0, 0]\nspring = {{ stiffness = {k}, damping = {c} }}")
        + output("x", "b", "position"),
        shaken,
        {},
        "a twitch of the base",
    )


@case("static starts: a guyed mast, a bent console across its plane, a beam on three supports, an arm on an oblique spring")
def new_rests():
    s, A, I = circle(0.02)
    L, F, k = 1.0, 60.0, 3000.0
    beam_k = 1 / (L**3 / (3 * E * I) + L / (6 / 7 * G * A))
    tip = F / (beam_k + k)
    yield Scene(
        simulation(0.01, 100, start="static")
        + beam("mast", L, s, STEEL)
        + weld("foot", "ground", "mast")
        + '[[force]]\nkind = "bushing"\non = "mast.tip"\nstiffness = [0, 3000.0, 0, 0, 0, 0]\ndamping = [0, 0, 0, 0, 0, 0]\n\n'
        + force("force", "mast.tip", F, (0, 1, 0))
        + output("tip", "mast.tip", "displacement"),
        still(tip=[np.nan, tip, np.nan]),
        {"tip": tip},
        "guyed mast",
    )
    a, b = 0.6, 0.4  # L in the plane, force along z at its end: bending of both, torsion of the first
    J = 2 * I
    down = F * (a**3 / (3 * E * I) + b**3 / (3 * E * I) + a * b * b / (G * J) + (a + b) / (6 / 7 * G * A))
    yield Scene(
        simulation(0.01, 100, start="static")
        + beam("one", a, s, STEEL)
        + beam("two", b, s, STEEL)
        + weld("foot", "ground", "one")
        + weld("corner", "one.tip", "two", "rotation = [0, 0, 1.5707963267948966]")
        + force("force", "two.tip", F, (0, 0, 1))
        + output("tip", "two.tip", "position"),
        still(tip=[np.nan, np.nan, down]),
        {"tip": down},
        "bent console",
    )
    w = 200.0
    middle = 10 * w * (L / 2) / 8  # 1.25 w l, two spans
    yield Scene(
        simulation(0.01, 100, start="static")
        + beam("rod", L, s, STEEL, "frames = { middle = 0.5 }")
        + joint("a", "revolute", "ground", "rod")
        + joint("m", "point-on-line", "ground", "rod.middle", f"axis = [1, 0, 0]\nposition = [{L / 2}, 0, 0]")
        + joint("b", "point-on-line", "ground", "rod.tip", f"axis = [1, 0, 0]\nposition = [{L}, 0, 0]")
        + force("distributed", "rod", w, (0, -1, 0))
        + output("R", "m", "reaction"),
        lambda t: {"R": np.c_[np.nan * t, 0 * t + middle, np.nan * t, np.nan * t, np.nan * t, np.nan * t]},
        {"R": middle},
        "beam on three supports, the middle reaction",
        sizes_only=True,
    )
    m, l0, ks = 3.0, 0.3, 2000.0
    top = np.array([0.1, 0.5])

    def moment(x):
        p = np.array([0.4 * math.cos(x), 0.4 * math.sin(x)])
        d = top - p
        n = np.hypot(*d)
        f = ks * (n - l0) * d / n
        return p[0] * f[1] - p[1] * f[0] - m * 9.81 * 0.2 * math.cos(x)

    rest = brentq(moment, -1.2, 0.8)
    yield Scene(
        simulation(0.01, 100, (0, -9.81, 0), start="static")
        + rigid("post", 1.0, (1,) * 3, {"top": (*top, 0)})
        + weld("w", "ground", "post")
        + rigid("arm", m, (0.01, 0.04, 0.04), {"end": (0.4, 0, 0)}, (0.2, 0, 0))
        + joint("j", "revolute", "ground", "arm")
        + spring("arm.end", "post.top", ks, rest=l0)
        + output("a", "j", "value"),
        still(a=[rest]),
        {"a": 1.0},
        "arm on an oblique spring",
        claim=1e-6,
    )


@case("small motions: a double pendulum, a cantilever on a spring, an inverted pendulum on a spring, two pendulums with a damper between")
def new_small():
    l, m, g = 0.7, 2.0, 9.81
    J = m * l * l / 12
    M = np.array([[m * l * l / 4 + J + m * l * l, m * l * l / 2], [m * l * l / 2, m * l * l / 4 + J]])
    K = np.diag([1.5 * m * g * l, 0.5 * m * g * l])
    w = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)))
    rod = lambda name: rigid(name, m, (1e-3, J, J), {"end": (l, 0, 0)}, (l / 2, 0, 0))
    down = "rotation = [0, 0, -1.5707963267948966]"
    yield Modes(
        simulation(1.0, 100, (0, -g, 0))
        + rod("a")
        + rod("b")
        + joint("j", "revolute", "ground", "a", down)
        + joint("k", "revolute", "a.end", "b"),
        tuple(complex(0, x) for x in w),
        "double pendulum",
        claim=1e-6,
    )
    s, A, I = circle(0.02)
    k = 5 * 3 * E * I
    f = lambda x: x**3 * (1 + math.cos(x) * math.cosh(x)) + k / (E * I) * (math.sin(x) * math.cosh(x) - math.cos(x) * math.sinh(x))
    root = brentq(f, 1.9, 3.9)
    yield Modes(
        simulation(1.0, 100)
        + beam("rod", 1.0, s, STEEL, 'effects = ["bending_xy"]')
        + weld("wall", "ground", "rod")
        + f'[[force]]\nkind = "bushing"\non = "rod.tip"\nstiffness = [0, {k!r}, 0, 0, 0, 0]\ndamping = [0, 0, 0, 0, 0, 0]\n\n',
        (complex(0, root**2 * math.sqrt(E * I / (RHO * A))),),
        "cantilever on a spring",
        claim=2e-3,
    )
    for kt in (0.5, 2.0):
        stiff = kt * m * g * l / 2
        z = (stiff - m * g * l / 2) / (m * l * l / 3)
        pole = complex(0, math.sqrt(z)) if z > 0 else complex(math.sqrt(-z), 0)
        yield Modes(
            simulation(1.0, 100, (0, -g, 0))
            + rod("a")
            + joint("j", "revolute", "ground", "a", f"rotation = [0, 0, 1.5707963267948966]\nspring = {{ stiffness = {stiff!r} }}"),
            (pole,),
            f"inverted, spring {kt} of what it needs",
            unstable=0 if z > 0 else 1,
            claim=1e-6,
        )
    c, h = 4.0, 0.4
    M1 = m * l * l / 3
    slow = math.sqrt(m * g * l / 2 / M1)
    half = 2 * c * h * h / (2 * M1)
    pole = complex(-half, math.sqrt(slow**2 - half**2))
    yield Modes(
        simulation(1.0, 100, (0, -g, 0))
        + rigid("a", m, (1e-3, J, J), {"p": (h, 0, 0)}, (l / 2, 0, 0))
        + rigid("b", m, (1e-3, J, J), {"p": (h, 0, 0)}, (l / 2, 0, 0))
        + joint("j", "revolute", "ground", "a", down)
        + joint("k", "revolute", "ground", "b", down + "\nposition = [0.5, 0, 0]")
        + spring("b.p", "a.p", 0.0, c),
        (complex(0, slow), pole),
        "two pendulums with a damper",
        claim=1e-6,
    )


@case("displacement of an overhanging beam, of a coupler between its pins, of a mast on a cart")
def new_frames():
    s, A, I = circle(0.02)
    F, l, a = 20.0, 0.7, 0.3
    tip = F * a * a * (l + a) / (3 * E * I) + F / (6 / 7 * G * A) * (a + a * a / l)
    yield Scene(
        simulation(0.01, 100, start="static")
        + beam("rod", 1.0, s, STEEL, "frames = { seat = 0.7 }")
        + joint("a", "revolute", "ground", "rod")
        + joint("b", "point-on-line", "ground", "rod.seat", "axis = [1, 0, 0]\nposition = [0.7, 0, 0]")
        + force("force", "rod.tip", F, (0, 1, 0))
        + output("tip", "rod.tip", "displacement"),
        still(tip=[np.nan, tip, np.nan]),
        {"tip": tip},
        "overhanging",
    )
    sag = 5 * RHO * A * 9.81 / (384 * E * I)
    yield Scene(
        simulation(0.01, 100, (0, -9.81, 0), start="static")
        + rigid("left", 1.0, (1,) * 3, {"end": (0, 0.5, 0)})
        + rigid("right", 1.0, (1,) * 3, {"end": (0, 0.5, 0)})
        + beam("coupler", 1.0, s, STEEL, "frames = { middle = 0.5 }")
        + joint("j", "revolute", "ground", "left", 'motion = "0"')
        + joint("k", "revolute", "ground", "right", "position = [1, 0, 0]")
        + joint("p", "revolute", "left.end", "coupler")
        + joint("q", "revolute", "coupler.tip", "right.end")
        + output("middle", "coupler.middle", "displacement")
        + output("root", "coupler.root", "displacement"),
        still(middle=[np.nan, -sag, np.nan], root=[0.0, 0.0, 0.0]),
        {"middle": sag, "root": sag},
        "coupler between its pins",
    )
    bend = 2.0 * RHO * A / (8 * E * I)
    yield Scene(
        simulation(0.01, 100, start="static")
        + rigid("cart", 1.0, (1,) * 3)
        + beam("mast", 1.0, s, STEEL)
        + joint("j", "prismatic", "ground", "cart", 'axis = [1, 0, 0]\nmotion = "t^2"')
        + weld("foot", "cart", "mast", "rotation = [0, 0, 1.5707963267948966]")
        + output("tip", "mast.tip", "displacement"),
        still(tip=[np.nan, bend, np.nan]),
        {"tip": bend},
        "mast on a cart that accelerates",
    )


@case("stress where bending, pull and twist meet: rectangle and tube at several places")
def new_stresses():
    L = 0.8
    h, b = 0.04, 0.02
    F, N = 150.0, 4000.0
    iz = b * h**3 / 12
    for at in (0.0, 0.25, 0.6):
        pulled = math.sqrt(N / (E * iz))  # the pull takes part of the moment
        true = F * math.sinh(pulled * (1 - at) * L) / (pulled * math.cosh(pulled * L)) * h / 2 / iz + N / (b * h)
        yield Scene(
            simulation(0.01, 100, start="static")
            + beam("rod", L, f'{{ shape = "rectangle", height = {h}, width = {b} }}', STEEL)
            + weld("wall", "ground", "rod")
            + force("force", "rod.tip", F, (0, 1, 0))
            + force("force", "rod.tip", N, (1, 0, 0))
            + f'[[output]]\nname = "s"\nof = "rod"\nquantity = "stress"\nat = {at}\n\n',
            still(s=[true]),
            {"s": true},
            f"rectangle, bent and pulled, at {at}",
        )
        D, t = 0.05, 0.004
        i = math.pi * (D**4 - (D - 2 * t) ** 4) / 64
        T = 120.0
        bent, twist = F * (1 - at) * L * D / 2 / i, T * D / 2 / (2 * i)
        true = math.sqrt(bent**2 + 3 * twist**2)
        yield Scene(
            simulation(0.01, 100, start="static")
            + beam("rod", L, f'{{ shape = "tube", outer_diameter = {D}, thickness = {t} }}', STEEL)
            + weld("wall", "ground", "rod")
            + force("force", "rod.tip", F, (0, 1, 0))
            + force("torque", "rod.tip", T, (1, 0, 0))
            + f'[[output]]\nname = "s"\nof = "rod"\nquantity = "stress"\nat = {at}\n\n',
            still(s=[true]),
            {"s": true},
            f"tube, bent and twisted, at {at}",
        )
