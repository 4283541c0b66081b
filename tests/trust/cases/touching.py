"""Friction, stops, bounces, ropes that slacken, short pulses."""
import itertools
import math
import random

import numpy as np
from cases.case import case
from cases.common import TINY, g, out
from kinds.wide import dropped_rod
from scene import Scene, force, joint, output, rigid, simulation, spring
from scipy.integrate import solve_ivp
from truths.formulas import ode


@case("a puck slides, turns and comes to rest on a rubbing plane; a ball joint rubs")
def rubbing_surfaces():
    m, J, mu, r, g, a = 2.0, 0.02, 0.3, 0.05, 9.81, 0.15
    v0, w0 = (1.2, -0.7), 9.0

    def f(t, y):
        s = math.sqrt(y[3] ** 2 + y[4] ** 2)
        F = mu * m * g
        return [y[3], y[4], y[5], -F * y[3] / s / m, -F * y[4] / s / m, -F * r * np.sign(y[5]) / J]

    T1 = math.hypot(*v0) / (mu * g)
    Tw = w0 * J / (mu * m * g * r)

    def truth(t):
        x = np.zeros((len(t), 3))
        for c in range(2):
            tt = np.minimum(t, T1)
            x[:, c] = v0[c] * tt * (1 - tt / (2 * T1))
        tt = np.minimum(t, Tw)
        x[:, 2] = w0 * tt * (1 - tt / (2 * Tw))
        return {"q": x}

    yield Scene(
        simulation(1.2, 200, (0, 0, -g))
        + rigid("puck", m, (J,) * 3)
        + joint(
            "j",
            "planar",
            "ground",
            "puck",
            f"initial = {{ rate = [{v0[0]}, {v0[1]}, {w0}] }}\n"
            f'friction = {{ coefficient = {mu}, normal_force = "reaction", radius = {r} }}',
        )
        + output("q", "j", "value"),
        truth,
        {},
        "puck, friction by the reaction",
    )
    I = np.array([0.03, 0.05, 0.07])
    M = 0.4
    w = np.array([3.0, 5.0, -4.0])

    def spin(t, y):
        n = np.linalg.norm(y)
        return (-M * y / n - np.cross(y, I * y)) / I

    def gone(t, y):
        return np.linalg.norm(y) - 1e-7

    gone.terminal = True
    done = solve_ivp(spin, (0, 3), w, method="DOP853", rtol=1e-11, atol=1e-12, events=gone, dense_output=True)
    end = done.t[-1]
    yield Scene(
        simulation(1.0, 200)
        + rigid("ball", 1.0, I)
        + joint(
            "j",
            "spherical",
            "ground",
            "ball",
            f"initial = {{ rate = {w.tolist()} }}\nfriction = {{ coefficient = 0.4, normal_force = 10, radius = 0.1 }}",
        )
        + output("w", "ball", "angular_velocity")
        + '[[output]]\nname = "w2"\nexpression = "w.x^2 + w.y^2 + w.z^2"\n\n',
        lambda t: {"w2": (np.where((t < end)[:, None], done.sol(np.minimum(t, end)).T, 0) ** 2).sum(axis=1).reshape(-1, 1)},
        {},
        "ball joint, its speed squared",
    )


@case("a ball drops on a platform that is shaken up and down, linear contact with damping")
def shaken_platform():
    m, k, D, g, radius = 0.5, 2e4, 0.2, 9.81, 0.05
    for A, W, tolerance in ((0.01, 25.0, 1e-6), (0.02, 40.0, 1e-7)):

        def truth(t, A=A, W=W):
            p, v = (lambda s: A * math.sin(W * s)), (lambda s: A * W * math.cos(W * s))

            def f(s, y, mode):
                d, rate = p(s) + radius - y[0], v(s) - y[1]
                return [y[1], -g + (max(0.0, k * d * (1 + D * rate)) / m if mode else 0.0)]

            return {"ball": bouncing(f, p, radius, [0.25, 0.0], t)}

        yield Scene(
            simulation(1.2, 200, (0, 0, -g), tolerance=tolerance)
            + rigid("table", 3.0, (0.1,) * 3)
            + rigid("ball", m, (2 / 5 * m * radius**2,) * 3)
            + joint("shaker", "prismatic", "ground", "table", f'axis = [0, 0, 1]\nmotion = "{A}*sin({W}*t)"')
            + joint("way", "prismatic", "ground", "ball", "axis = [0, 0, 1]\ninitial = { value = 0.25 }")
            + '[[force]]\nkind = "contact"\non = "ball"\nfrom = "table"\nshape = "sphere"\n'
            + f"radius = {radius}\nstiffness = {k}\ndamping = {D}\n\n"
            + output("ball", "way", "value"),
            truth,
            {},
            f"{A * W * W / g:.1f} g",
        )


def bouncing(f, p, radius, y0, times):
    """Free flight and contact by turns, told by the gap; the damped force never pulls, so that it ends with the gap at the latest."""
    values, t, y, mode = np.empty((len(times), 1)), 0.0, list(y0), 0
    while t < times[-1]:

        def gap(s, y):
            return y[0] - radius - p(s)

        gap.terminal, gap.direction = True, 1 if mode else -1
        part = solve_ivp(lambda s, y: f(s, y, mode), (t, times[-1]), y, rtol=1e-11, atol=1e-14, events=gap, dense_output=True)
        inside = (times >= t) & (times <= part.t[-1])
        values[inside, 0] = part.sol(times[inside])[0]
        t, y, mode = part.t[-1], part.y[:, -1], 1 - mode
    return values


@case("a mass on an elastic string in wind: spring with rest length, drag, in space")
def string_in_wind():
    k, rest, m, g = 80.0, 0.6, 0.3, 9.81
    for wind, start in (((6.0, 2.0, 0.0), (0.0, 0.0, -0.7)), ((-3.0, 8.0, 1.0), (0.5, -0.3, -0.4))):

        def f(_, y, w=np.array(wind)):
            r, v = y[:3], y[3:]
            length, past = np.linalg.norm(r), v - w
            F = -k * (length - rest) * r / length - (0.05 + 0.02 * np.linalg.norm(past)) * past
            return [*v, *(F / m + [0, 0, -g])]

        yield Scene(
            simulation(4.0, 100, (0, 0, -g))
            + rigid("ball", m, (1e-3,) * 3)
            + joint("free", "free", "ground", "ball", f"initial = {{ value = {[*start, 0, 0, 0]} }}")
            + spring("ball", "ground", k, 0.0, rest)
            + f'[[force]]\nkind = "drag"\non = "ball"\nlinear = 0.05\nquadratic = 0.02\nwind = {list(wind)}\n\n'
            + output("ball", "ball", "position"),
            lambda t, f=f, start=start: {"ball": ode(f, [*start, 0, 0, 0], t)[:, :3]},
            {},
            f"wind {wind}",
        )


@case("stick and slip on a belt that slows down: dry friction on what is driven")
def belt_that_slows():
    m, k, mu, stick, N = 1.0, 50.0, 0.3, 0.45, 10.0
    belt = lambda t: 0.25 - 0.04 * t

    def f(t, y, mode):
        return [y[1], (-k * y[0] + mode * mu * N) / m] if mode else [belt(t), -0.04]

    def events(mode):
        if not mode:
            # On the belt, which slows down by itself: k x + m a is what friction has to give.
            return [(lambda t, y: stick * N - abs(k * y[0] - 0.04 * m), -1, lambda y: (1 if k * y[0] > 0 else -1, y))]
        return [(lambda t, y, s=mode: s * (belt(t) - y[1]), -1, lambda y: (0, y))]

    def truth(t):
        now, y, mode = 0.0, [0.0, belt(0.0)], 0
        values = np.empty((len(t), 1))
        while now < t[-1]:
            test, direction, then = events(mode)[0]
            test.terminal, test.direction = True, direction
            first = min(t[-1], now + 1e-9)  # off the event where it stands
            y = np.array(y) + (first - now) * np.array(f(now, y, mode))
            part = solve_ivp(lambda s, y, m=mode: f(s, y, m), (first, t[-1]), y, rtol=1e-11, atol=1e-13, events=test, dense_output=True)
            inside = (t >= now) & (t <= part.t[-1])
            values[inside, 0] = part.sol(t[inside])[0]
            now, y = part.t[-1], part.y[:, -1]
            mode, y = then(y)
        return {"x": values}

    yield Scene(
        simulation(5.0, 100)
        + rigid("belt", 1.0, (0.1,) * 3)
        + rigid("block", m, (0.1,) * 3)
        + joint("drive", "prismatic", "ground", "belt", 'axis = [1, 0, 0]\nmotion = "0.25*t - 0.02*t^2"')
        + joint(
            "slip",
            "prismatic",
            "belt",
            "block",
            f"axis = [1, 0, 0]\nfriction = {{ coefficient = {mu}, static_coefficient = {stick}, normal_force = {N} }}",
        )
        + spring("block", "ground", k)
        + output("x", "block", "position"),
        lambda t: {"x": np.c_[truth(t)["x"], np.full((len(t), 2), np.nan)]},
        {},
        "spring to the ground",
    )


@case("a jumper on an elastic rope that is slack at first, against the drag of the air")
def bungee():
    for m, k, L, d, drag in ((80.0, 60.0, 20.0, 15.0, 0.25), (60.0, 150.0, 12.0, 0.0, 0.4), (100.0, 45.0, 5.0, 200.0, 0.1)):

        def f(_, y, m=m, k=k, L=L, d=d, drag=drag):
            pull = k * (y[0] - L) + d * y[1] if y[0] > L else 0.0
            return [y[1], g - (max(pull, 0.0) + drag * abs(y[1]) * y[1]) / m]

        def truth(t, f=f, L=L, d=d, k=k):
            # Small steps over the corners: where it tightens and where it no longer pulls.
            s = solve_ivp(f, (0, t[-1]), [0.0, 0.0], t_eval=t, rtol=1e-9, atol=1e-10, max_step=2e-3, method="RK45")
            return {"way": -s.y[0][:, None], "speed": -s.y[1][:, None]}

        yield Scene(
            simulation(12, 50, (0, 0, -g))
            + rigid("jumper", m, (1, 1, 1))
            + joint("line", "prismatic", "ground", "jumper", "initial = { value = -1e-6, rate = 0 }")
            + f'[[force]]\nkind = "cable"\non = "jumper"\nstiffness = {k}\ndamping = {d}\nrest = {L}\n\n'
            + f'[[force]]\nkind = "drag"\non = "jumper"\nquadratic = {drag}\n\n'
            + out("way", "line", "value")
            + out("speed", "line", "rate"),
            truth,
            {},
            f"{m} kg on {k} N/m",
        )


@case("Newton's cradle of pendulums that knock (linear contact)")
def cradle():
    L, R, m, k = 0.5, 0.03, 0.2, 2e5
    for n, lifted in ((2, 1), (3, 1), (4, 2)):
        q0 = np.array([-0.4 if i < lifted else 0.0 for i in range(n)])

        def f(_, y, n=n):
            q, v = y[:n], y[n:]
            x, z = 2 * R * np.arange(n) + L * np.sin(q), -L * np.cos(q)
            Q = -m * g * L * np.sin(q)
            for i in range(n - 1):
                dx, dz = x[i + 1] - x[i], z[i + 1] - z[i]
                D = math.hypot(dx, dz)
                if D < 2 * R:
                    F = k * (2 * R - D)
                    Q[i] -= F * (dx * math.cos(q[i]) + dz * math.sin(q[i])) / D * L
                    Q[i + 1] += F * (dx * math.cos(q[i + 1]) + dz * math.sin(q[i + 1])) / D * L
            return np.r_[v, Q / (m * L * L)]

        yield Scene(
            simulation(2.0, 200, (0, -g, 0), tolerance=1e-8)
            + "".join(
                rigid(f"b{i}", m, TINY, {"c": (0, -L, 0)}, centre=(0, -L, 0))
                + joint(
                    f"p{i}", "revolute", "ground", f"b{i}", f"position = [{2 * R * i!r}, 0, 0]\ninitial = {{ value = {q0[i]!r}, rate = 0 }}"
                )
                + out(f"a{i}", f"p{i}", "value")
                for i in range(n)
            )
            + "".join(
                f'[[force]]\nkind = "contact"\nname = "k{i}"\non = "b{i}.c"\nfrom = "b{i + 1}.c"\nshape = "sphere"\nradius = {R}\n'
                f'against = "sphere"\nfrom_radius = {R}\nstiffness = {k}\n\n'
                for i in range(n - 1)
            ),
            lambda t, f=f, n=n, q0=q0: (lambda y: {f"a{i}": y[:, i : i + 1] for i in range(n)})(
                ode(f, [*q0, *[0.0] * n], t, rtol=1e-10, max_step=2e-4)
            ),
            {f"a{i}": 0.4 for i in range(n)},
            f"{n} balls, {lifted} lifted",
        )


@case("a body that rests on its stop until a load that grows lifts it")
def lifted_off():
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
def short_pulses():
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


@case("a rod dropped along its axis on a stop as stiff as it is, in contact between two samples")
def unseen_blows():
    for seed in (0, 1, 2):
        yield dropped_rod(random.Random(f"unseen blow {seed}"))
