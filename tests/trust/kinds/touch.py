"""Contacts of points, spheres and cylinders with planes and spheres: falls, bounces, knocks, rolling, sliding, cams, feet that stand.

Truths piece by piece with scipy from the law that the scene file states, or from rigid impacts and rolling in closed form."""
import math

import numpy as np
from scipy.linalg import eigh

from scene import Scene, beam, force, joint, output, pick, rigid, simulation, weld
from truths.formulas import beam_matrices, piecewise, restarted, rotate


def contact(name, on, more):
    return f'[[force]]\nname = "{name}"\nkind = "contact"\non = "{on}"\n{more}\n\n'


def law(r, m, depth, g):
    """A contact whose depth under the weight m g is `depth`: its lines, and its force as a function of depth and rate."""
    n = pick(r, 1.0, 1.5, 2.0, 1.2)
    k = m * g / depth**n
    D = pick(r, 0.0, r.uniform(0.05, 1.0))
    lines = f"stiffness = {k!r}\nexponent = {n}\n" + (f"damping = {D!r}\n" if D else "")
    return lines, lambda d, rate: max(0.0, k * max(d, 0.0) ** n * (1 + D * rate)), f"exponent {n}, damping {D:.2g} s/m"


def tilted(r):
    """A rotation, and its vector as the scene writes it."""
    v = np.array([r.uniform(-1, 1) for _ in range(3)])
    return rotate(v), [float(x) for x in v]


def plane_of(R):
    return f'against = "plane"\nnormal = {[float(x) for x in R[:, 2]]}\n'


def dropped_ball(r):
    """A ball or a point falls on a plane that lies obliquely, or on a sphere below it: linear, Hertz and other laws, damped or not."""
    m, g = 10 ** r.uniform(-3, 2), 9.81
    radius = pick(r, 0.0, 10 ** r.uniform(-2, 0))
    h = 10 ** r.uniform(-2, 0.5)
    lines, N, said = law(r, m, h * 10 ** r.uniform(-6, -2), g)
    R, _ = tilted(r)
    down = -g * R[:, 2]
    ball = pick(r, "plane", "sphere") if radius else "plane"
    shape = f'shape = "sphere"\nradius = {radius!r}\n' if radius else 'shape = "point"\n'
    place = R @ [0, 0, h + radius]
    duration = math.sqrt(2 * h / g) * r.uniform(2, 9)
    J = 0.4 * m * max(radius, 0.01) ** 2
    # On a sphere a ball would roll off after some bounces, wherever rounding sends it: on rails there.
    rails = f"axis = {[float(x) for x in R[:, 2]]}\ninitial = {{ value = {h + radius!r} }}"
    free = f"initial = {{ value = {[float(x) for x in place] + [0.0, 0.0, 0.0]} }}"
    below = f'against = "sphere"\nfrom_radius = 0.3\nfrom = "ground.under"\n' if ball == "sphere" else plane_of(R)
    text = (
        f"[ground]\nframes = {{ under = {[float(x) for x in -0.3 * R[:, 2]]} }}\n\n"
        + simulation(duration, 200 / duration, down)
        + rigid("ball", m, (J, J, J))
        + joint("flight", *(("prismatic", "ground", "ball", rails) if ball == "sphere" else ("free", "ground", "ball", free)))
        + contact("floor", "ball", shape + below + lines)
        + output("p", "ball", "position")
    )

    def truth(t):
        f = lambda _, y: [y[1], -g + N(-y[0], -y[1]) / m]
        y = restarted(f, [lambda _, y: y[0]], [h, 0.0], t)
        return {"p": (y[:, :1] + radius) * R[:, 2]}

    return Scene(text, truth, {}, f"{ball}, radius {radius:.2g}, {said}")


def on_the_floor(r):
    """A ball lies exactly on a plane, or just above or in it, and begins to sink"""
    m, g = 10 ** r.uniform(-3, 2), 10 ** r.uniform(0, 1.5)
    radius = 10 ** r.uniform(-2, 0)
    depth = radius * 10 ** r.uniform(-6, -2)
    lines, N, said = law(r, m, depth, g)
    begin = depth * pick(r, 0.0, 0.0, 1e-7, -1e-7, 0.5, 3.0)
    n = float(said.split()[1].rstrip(","))
    period = 2 * math.pi * math.sqrt(depth / (n * g))
    duration = period * r.uniform(3, 12)
    J = 0.4 * m * radius**2
    text = (
        simulation(duration, 200 / duration, (0, -g, 0))
        + rigid("ball", m, (J, J, J))
        + joint("flight", "planar", "ground", "ball", f"initial = {{ value = [0.1, {radius - begin!r}, 0] }}")
        + contact("floor", "ball", f'shape = "sphere"\nradius = {radius!r}\nnormal = [0, 1, 0]\n' + lines)
        + output("p", "ball", "position")
        + output("F", "floor", "force")
    )

    def truth(t):
        f = lambda _, y: [y[1], -g + N(-y[0], -y[1]) / m]
        y = restarted(f, [lambda _, y: y[0]], [radius - (radius - begin) if begin == 0 else -begin, 0.0], t, scale=depth)
        F = np.array([[N(-a, -b)] for a, b in y])
        return {"p": np.stack([0.1 + 0 * t, y[:, 0] + radius, 0 * t], axis=1), "F": F}

    return Scene(text, truth, {}, f"{begin / depth:.1g} of its depth in it, {said}")


def comes_back(r):
    """A ball flies to and fro between two walls, or falls, with coefficients of restitution"""
    m, v = 10 ** r.uniform(-2, 2), 10 ** r.uniform(-1, 1)
    e = [pick(r, r.uniform(0.05, 1), r.uniform(0.5, 1), 1.0), r.uniform(0.2, 1)]
    gap = 10 ** r.uniform(-1, 1)
    n = pick(r, 1.0, 1.5)
    crossings = r.uniform(1.2, 4)
    # An impact as short as 1e-4 of a crossing, for the slowest too.
    slowest = v * min(1, e[0] * e[1]) ** 2
    depth = 1e-4 * gap * slowest / v
    k = m * v * v / depth ** (n + 1)
    duration = sum(gap / v / c for c in [1, e[1], e[0] * e[1], e[0] * e[1] * e[1]][: int(crossings) + 1])
    text = (
        simulation(duration, 300 / duration)
        + rigid("ball", m, (m, m, m))
        + joint("rail", "prismatic", "ground", "ball", f"axis = [1, 0, 0]\ninitial = {{ value = 0.0, rate = {v!r} }}")
        + contact(
            "right",
            "ball",
            f'shape = "point"\nfrom = "ground.right"\nnormal = [-1, 0, 0]\nstiffness = {k!r}\nexponent = {n}\nrestitution = {e[1]!r}\n',
        )
        + contact("left", "ball", f'shape = "point"\nnormal = [1, 0, 0]\nstiffness = {k!r}\nexponent = {n}\nrestitution = {e[0]!r}\n')
        + output("x", "rail", "value")
        + f"[ground]\nframes = {{ right = [{gap!r}, 0, 0] }}\n"
    )

    def truth(t):
        x, at, speed, wall = np.empty_like(t), 0.0, v, 1
        begin = 0.0
        while at <= t[-1]:
            end = at + gap / abs(speed)
            inside = (t >= at) & (t <= end)
            x[inside] = begin + speed * (t[inside] - at)
            begin, at = (gap if wall else 0.0), end
            speed, wall = -speed * e[wall], 1 - wall
        return {"x": x[:, None]}

    return Scene(text, truth, {}, f"restitution {e[0]:.2f}, {e[1]:.2f}, exponent {n}")


class Skids:
    """Points of a plane rigid body on the line y = 0: force k d^n (1 + D d'), friction mu; what sticks hangs on a spring and damper."""

    def __init__(self, m, J, g, points, N, mu, kt, ct, push=(0.0, 0.0)):
        self.m, self.J, self.g, self.points, self.N, self.mu, self.kt, self.ct, self.push = m, J, g, points, N, mu, kt, ct, push

    def at(self, y, i):
        c, s = math.cos(y[2]), math.sin(y[2])
        px, py = self.points[i]
        arm = np.array([c * px - s * py, s * px + c * py])
        return arm, y[:2] + arm, y[3:5] + y[5] * np.array([-arm[1], arm[0]])

    def forces(self, y, mode, i):
        _, p, v = self.at(y, i)
        N = self.N(-p[1], -v[1])
        if mode[i] == "off":
            return 0.0, 0.0
        if mode[i][0] == "stick":
            return N, -self.kt * (p[0] - mode[i][1]) - self.ct * v[0]
        return N, -self.mu * N * mode[i][1]

    def rate(self, mode):
        def f(t, y):
            F, M = np.array([self.push[0], -self.m * self.g]), 0.0
            for i in range(len(self.points)):
                N, T = self.forces(y, mode, i)
                arm = self.at(y, i)[0]
                F += [T, N]
                M += arm[0] * N - arm[1] * T
            return np.r_[y[3:], F / self.m, M / self.J]

        return f

    def begin(self, y, i, pulled=None):
        """How point i goes on: it slides the way it moves; at rest it sticks, or slides the way it is pulled."""
        _, p, v = self.at(y, i)
        if abs(v[0]) > 1e-12:
            return ("slide", math.copysign(1, v[0]))
        return ("slide", pulled) if pulled else ("stick", p[0])

    def events(self, mode):
        out = []
        for i in range(len(self.points)):
            replaced = lambda new, i=i: (lambda t, y: mode[:i] + (new(y) if callable(new) else new,) + mode[i + 1 :])
            # A piece ends a rounding beyond where it does, so that none ends where it begins.
            side = 1 if mode[i] == "off" else -1
            height = lambda t, y, i=i, side=side: self.at(y, i)[1][1] + side * 1e-13
            if mode[i] == "off":
                height.direction = -1
                out.append((height, replaced(lambda y, i=i: self.begin(y, i))))
                continue
            height.direction = 1
            out.append((height, replaced("off")))
            if mode[i][0] == "stick":
                for side in (1, -1):
                    tears = (
                        lambda t, y, i=i, side=side: side * self.forces(y, mode, i)[1]
                        - self.mu * self.forces(y, mode, i)[0]
                        - 1e-9 * self.m
                    )
                    tears.direction = 1
                    # A load that falls tears it off while its spring draws it back: what slides is braked whichever way it moves.
                    out.append((tears, replaced(lambda y, i=i, side=side: self.begin(y, i, -side))))
            else:
                rests = lambda t, y, i=i: self.at(y, i)[2][0] + 1e-11 * mode[i][1]
                rests.direction = -mode[i][1]
                out.append((rests, replaced(lambda y, i=i: ("stick", self.at(y, i)[1][0]))))
        return out

    def follow(self, y0, mode, t, shortest):
        return piecewise(self.rate, self.events, y0, mode, t, atol=1e-12, max_step=shortest)


def by_any_method(r):
    """Options of half the runs: Runge-Kutta methods repeat their steps to the events, where what comes to rest is nearly at rest."""
    methods = ("dirk", "erk", "bdf")
    return () if r.random() < 0.5 else ("--method", r.choice(methods))


def skidding_point(r):
    """A mass is thrown on a plane, bounces, skids and comes to rest by friction"""
    m, g = 10 ** r.uniform(-1, 1), 9.81
    v, mu = r.uniform(0.5, 4), r.uniform(0.1, 0.7)
    h = pick(r, 0.0, r.uniform(0.01, 0.2))
    k = m * g / (0.01 * 10 ** r.uniform(-2, 0))
    D = r.uniform(0.2, 2)
    kt, ct = k * r.uniform(0.3, 1), 2 * math.sqrt(k * m) * r.uniform(0.05, 0.5)
    y0 = h if h else -m * g / k
    duration = v / (mu * g) * r.uniform(0.8, 1.5) + 2 * math.sqrt(2 * h / g)
    text = (
        simulation(duration, 200 / duration, (0, -g, 0))
        + rigid("body", m, (m, m, m))
        + joint("flight", "planar", "ground", "body", f"initial = {{ value = [0, {y0!r}, 0], rate = [{v!r}, 0, 0] }}")
        + contact(
            "floor",
            "body",
            f'shape = "point"\nnormal = [0, 1, 0]\nstiffness = {k!r}\ndamping = {D!r}\n'
            f"friction = {{ coefficient = {mu!r}, stiffness = {kt!r}, damping = {ct!r} }}\n",
        )
        + output("p", "body", "position")
        + output("F", "floor", "force")
    )

    def truth(t):
        N = lambda d, rate: max(0.0, k * max(d, 0.0) * (1 + D * rate))
        model = Skids(m, m, g, [(0.0, 0.0)], N, mu, kt, ct)
        y = model.follow([0, y0, 0, v, 0, 0], ("off",) if h else (("slide", 1.0),), t, 0.3 * math.sqrt(m / k))
        return {"p": np.stack([y[:, 0], y[:, 1], 0 * t], axis=1)}

    return Scene(text, truth, {}, f"from {h:.2g} m, friction {mu:.2f}", words=by_any_method(r))


def landing_box(r):
    """A box falls askew on its feet, rocks, slides and settles"""
    m, g = 10 ** r.uniform(-1, 1), 9.81
    a, b = r.uniform(0.1, 0.4), r.uniform(0.05, 0.3)
    J = m / 3 * (a * a + b * b)
    mu = pick(r, 0.0, r.uniform(0.1, 0.7))
    k = m * g / (0.004 * r.uniform(0.5, 3))
    D = r.uniform(0.1, 1)
    kt, ct = k * r.uniform(0.3, 1), 2 * math.sqrt(k * m) * r.uniform(0.05, 0.5)
    tilt, h = r.uniform(-0.4, 0.4), r.uniform(0.0, 0.1)
    lowest = min(math.sin(tilt) * x - math.cos(tilt) * b for x in (-a, a))
    y0 = h - lowest
    v = r.uniform(-1, 1)
    duration = r.uniform(0.3, 0.8)
    rub = f"friction = {{ coefficient = {mu!r}, stiffness = {kt!r}, damping = {ct!r} }}\n" if mu else ""
    text = (
        simulation(duration, 300 / duration, (0, -g, 0))
        + rigid("box", m, (J, J, J), {"left": (-a, -b, 0), "right": (a, -b, 0)})
        + joint("flight", "planar", "ground", "box", f"initial = {{ value = [0, {y0!r}, {tilt!r}], rate = [{v!r}, 0, 0] }}")
    )
    for foot in ("left", "right"):
        text += contact(foot, f"box.{foot}", f'shape = "point"\nnormal = [0, 1, 0]\nstiffness = {k!r}\ndamping = {D!r}\n' + rub)
    text += output("p", "box", "position") + output("turn", "flight", "value")

    def truth(t):
        N = lambda d, rate: max(0.0, k * max(d, 0.0) * (1 + D * rate))
        model = Skids(m, J, g, [(-a, -b), (a, -b)], N, mu, kt, ct)
        y = model.follow([0, y0, tilt, v, 0, 0], ("off", "off"), t, 0.3 * math.sqrt(m / k))
        return {"p": np.stack([y[:, 0], y[:, 1], 0 * t], axis=1), "turn": y[:, :3]}

    return Scene(text, truth, {}, f"{tilt:.2f} rad, friction {mu:.2f}", words=by_any_method(r))


def rolling(r):
    """A ball or a wheel is set on an incline, with speed and spin or at rest: slides, then rolls"""
    m, g = 10 ** r.uniform(-1, 2), 9.81
    radius, mu, slope = 10 ** r.uniform(-1.5, 0), r.uniform(0.05, 0.6), r.uniform(0.0, 0.5)
    share = pick(r, 0.4, 0.5, 0.9)  # J / (m r^2)
    J = share * m * radius**2
    rest = r.random() < 0.3
    v0 = 0.0 if rest else r.uniform(-2, 3)
    w0 = 0.0 if rest else r.uniform(-3, 3) / radius
    if rest and slope < 0.02:
        return None
    wheel = r.random() < 0.4
    N = m * g * math.cos(slope)
    k = N / (radius * 1e-4)
    width = pick(r, 0.0, radius)
    duration = r.uniform(0.5, 2.0)
    R, turned = tilted(r)
    gravity = R @ [g * math.sin(slope), -g * math.cos(slope), 0]
    depth = N / ((2 if wheel and width else 1) * k)
    shape = (
        f'shape = "cylinder"\nradius = {radius!r}\naxis = [0, 0, 1]\nwidth = {width!r}\n'
        if wheel
        else f'shape = "sphere"\nradius = {radius!r}\n'
    )
    text = (
        simulation(duration, 200 / duration, gravity)
        + rigid("ball", m, (J, J, J))
        + joint(
            "flight",
            "planar",
            "ground",
            "ball",
            f"axis = [0, 0, 1]\nrotation = {turned}\ninitial = {{ value = [0, {radius - depth!r}, 0], rate = [{v0!r}, 0, {w0!r}] }}",
        )
        + contact(
            "floor",
            "ball",
            shape
            + f"normal = {[float(x) for x in R[:, 1]]}\nstiffness = {k!r}\n"
            + f"friction = {{ coefficient = {mu!r}, damping = {0.3 * math.sqrt(k * m)!r} }}\n",
        )
        + output("x", "flight", "value")
    )

    def truth(t):
        x, angle, v, w, at = 0.0, 0.0, v0, w0, 0.0
        out = np.zeros((len(t), 3))
        drive = g * math.sin(slope)
        grip = mu * g * math.cos(slope)
        # Slip of the lowest point: v + w r (w about z, x to the right, y up).
        for _ in range(5):
            slip = v + w * radius
            if abs(slip) < 1e-12:
                needed = drive * share / (1 + share)  # friction per mass that rolling takes
                if needed <= grip:
                    a, alpha, length = drive - needed, -(drive - needed) / radius, math.inf
                else:
                    a, alpha, length = drive - grip, -grip / share / radius, math.inf
            else:
                s = math.copysign(1, slip)
                a, alpha = drive - s * grip, -s * grip / share / radius
                closing = a + alpha * radius
                length = -slip / closing if slip * closing < 0 else math.inf
            here = (t >= at) & (t <= at + length)
            u = t[here] - at
            out[here, 0] = x + v * u + a * u * u / 2
            out[here, 2] = angle + w * u + alpha * u * u / 2
            if not math.isfinite(length):
                break
            angle += w * length + alpha * length**2 / 2
            x, v, w, at = x + v * length + a * length**2 / 2, v + a * length, w + alpha * length, at + length
            w = -v / radius
        out[:, 1] = np.nan  # vibrates by a share of its depth
        return {"x": out}

    return Scene(
        text, truth, {}, f"{'wheel' if wheel else 'ball'}, slope {slope:.2f}, friction {mu:.2f}, {'at rest' if rest else 'thrown'}"
    )


def row_of_balls(r):
    """Balls on a rail knock against each other, some of them touching at the start"""
    n = r.randint(2, 4)
    m = [pick(r, 1.0, 10 ** r.uniform(-0.5, 0.5)) for _ in range(n)]
    radius = [r.uniform(0.02, 0.06) for _ in range(n)]
    v = [r.uniform(1, 3)] + [pick(r, 0.0, r.uniform(-1, 0.5)) for _ in range(n - 1)]
    p = pick(r, 1.0, 1.5)
    x = [0.0]
    for i in range(1, n):
        gap = pick(r, 0.0, r.uniform(0.001, 0.1)) if i > 1 and v[i] == v[i - 1] else r.uniform(0.001, 0.1)
        x.append(x[-1] + radius[i - 1] + radius[i] + gap)
    k = 10 ** r.uniform(4, 7)
    duration = r.uniform(0.05, 0.4)
    text = simulation(duration, 300 / duration)
    for i in range(n):
        J = 0.4 * m[i] * radius[i] ** 2
        text += rigid(f"b{i}", m[i], (J, J, J))
        text += joint(f"r{i}", "prismatic", "ground", f"b{i}", f"axis = [1, 0, 0]\ninitial = {{ value = {x[i]!r}, rate = {v[i]!r} }}")
        text += output(f"x{i}", f"r{i}", "value")
        if i:
            text += contact(
                f"c{i}",
                f"b{i}",
                f'from = "b{i - 1}"\nshape = "sphere"\nradius = {radius[i]!r}\nagainst = "sphere"\nfrom_radius = {radius[i - 1]!r}\n'
                f"stiffness = {k!r}\nexponent = {p}\n",
            )

    def truth(t):
        gaps = [lambda _, y, i=i: y[i] - y[i - 1] - radius[i] - radius[i - 1] for i in range(1, n)]

        def f(s, y):
            a = np.zeros(n)
            for i in range(1, n):
                F = k * max(0.0, -gaps[i - 1](s, y)) ** p
                a[i] += F / m[i]
                a[i - 1] -= F / m[i - 1]
            return np.r_[y[n:], a]

        y = restarted(f, gaps, [*x, *v], t)
        return {f"x{i}": y[:, i : i + 1] for i in range(n)}

    return Scene(text, truth, {}, f"{n} balls, exponent {p}")


def brushing(r):
    """An arm turns at a given speed and brushes a sprung mass with its tip, for a small share of each turn"""
    L, w = 10 ** r.uniform(-1, 0.5), 10 ** r.uniform(0, 2)
    dip = L * 10 ** r.uniform(-7, -2)
    m = 10 ** r.uniform(-1, 1)
    w0 = w * 10 ** r.uniform(-1, 1)
    k0, c0 = m * w0**2, 2 * m * w0 * pick(r, 0.0, 0.02)
    kc = m * w0**2 * 10 ** r.uniform(1, 4)
    p = pick(r, 1.0, 1.5)
    if p == 1.5:
        kc /= math.sqrt(dip)
    duration = 2 * math.pi / w * r.uniform(1.2, 3.5)
    rest = L - dip  # x of the plane, while the mass rests
    text = (
        simulation(duration, 300 / duration)
        + rigid("arm", 1.0, (1, 1, 1), {"tip": (0, L, 0)})
        + rigid("plate", m, (m, m, m))
        + joint("shaft", "revolute", "ground", "arm", f'motion = "{w!r}*t"')
        + joint(
            "rail",
            "prismatic",
            "ground",
            "plate",
            f"axis = [1, 0, 0]\nposition = [{rest!r}, 0, 0]\nspring = {{ stiffness = {k0!r}, damping = {c0!r} }}",
        )
        + contact("brush", "arm.tip", f'from = "plate"\nshape = "point"\nnormal = [-1, 0, 0]\nstiffness = {kc!r}\nexponent = {p}\n')
        + output("x", "rail", "value")
    )

    def truth(t):
        depth = lambda s, y: -L * math.sin(w * s) - (rest + y[0])

        def f(s, y):
            d = max(0.0, depth(s, y))
            return [y[1], (-k0 * y[0] - c0 * y[1] + kc * d**p) / m]

        # The tip is at its farthest where sin(w t) = -1.
        tops = [(1.5 * math.pi + 2 * math.pi * i) / w for i in range(int(duration * w / 6.28) + 2)]
        return {"x": restarted(f, [depth], [0.0, 0.0], t, scale=dip, stops=tops)[:, :1]}

    return Scene(text, truth, {}, f"dip {dip / L:.1e} of the arm, {w0 / w:.2g} swings a turn, exponent {p}")


def cam(r):
    """A roller is pressed by a spring on an eccentric and follows it, or jumps"""
    e, R1, R2 = 0.02, 0.06, 0.02
    m, w = 10 ** r.uniform(-1, 0.5), 10 ** r.uniform(0.5, 2)
    k = 10 ** r.uniform(5, 7)
    x0 = R1 + R2 + r.uniform(-0.2, 1) * e
    stiff = m * w * w * r.uniform(0.2, 4)
    load = m * w * w * e * r.uniform(0.5, 3)
    D = r.uniform(0, 1)
    duration = 2 * math.pi / w * r.uniform(1, 4)
    text = (
        simulation(duration, 300 / duration)
        + rigid("cam", 1.0, (1, 1, 1), {"middle": (e, 0, 0)})
        + rigid("roller", m, (m, m, m))
        + joint("shaft", "revolute", "ground", "cam", f'motion = "{w!r}*t"')
        + joint(
            "guide",
            "prismatic",
            "ground",
            "roller",
            f"axis = [0, 1, 0]\ninitial = {{ value = {x0!r} }}\nspring = {{ stiffness = {stiff!r}, rest = {x0!r}, preload = {load!r} }}",
        )
        + contact(
            "nip",
            "roller",
            f'from = "cam.middle"\nshape = "sphere"\nradius = {R2}\nagainst = "sphere"\nfrom_radius = {R1}\n'
            f"stiffness = {k!r}\ndamping = {D!r}\n",
        )
        + output("x", "guide", "value")
    )

    def truth(t):
        def gap(s, y):
            return math.hypot(e * math.cos(w * s), y[0] - e * math.sin(w * s)) - R1 - R2

        def f(s, y):
            dx, dy = -e * math.cos(w * s), y[0] - e * math.sin(w * s)
            L = math.hypot(dx, dy)
            rate = (dx * e * w * math.sin(w * s) + dy * (y[1] - e * w * math.cos(w * s))) / L
            F = max(0.0, k * max(0.0, R1 + R2 - L) * (1 - D * rate))
            return [y[1], (-stiff * (y[0] - x0) - load + F * dy / L) / m]

        return {"x": restarted(f, [gap], [x0, 0.0], t)[:, :1]}

    return Scene(text, truth, {}, f"{w:.2g} rad/s, {math.sqrt(k / m) / w:.2g} swings of the contact a turn")


def beam_on_bump(r):
    """The tip of a clamped beam is pushed against a spring-like plane a small way off, to and fro"""
    L, E, rho = 10 ** r.uniform(-1, 0.5), 7e10, 2700.0
    h = L / r.uniform(30, 80)
    A, I = h * h, h**4 / 12
    w1 = 3.516 / L**2 * math.sqrt(E * I / (rho * A))
    k0 = 3 * E * I / L**3
    F = k0 * L * 10 ** r.uniform(-4, -3)
    gap = F / k0 * r.uniform(0.05, 0.6)
    kc = k0 * 10 ** r.uniform(0, 2)
    w = w1 * r.uniform(0.1, 0.6)
    duration = 2 * math.pi / w * r.uniform(1, 2)
    text = (
        simulation(duration, 400 / duration)
        + beam("b", L, f'{{ shape = "rectangle", height = {h!r}, width = {h!r} }}', {"E": E, "rho": rho, "poisson": 0.33})
        + weld("clamp", "ground", "b.root")
        + force("force", "b.tip", f"{F!r}*sin({w!r}*t)", (0, 1, 0))
        + f"[ground]\nframes = {{ bump = [{L!r}, {gap!r}, 0] }}\n\n"
        + contact("bump", "b.tip", f'from = "ground.bump"\nshape = "point"\nnormal = [0, -1, 0]\nstiffness = {kc!r}\n')
        + output("tip", "b.tip", "displacement")
    )

    def truth(t):
        M, K = beam_matrices(L, E * I, rho * A, elements=12, rhoI=rho * I, kGA=5 / 6 * A * E / 2.66)
        squares, modes = eigh(K, M)
        squares, phi = squares[:8], modes[-2, :8]
        tip = lambda y: phi @ y[:8]
        f = lambda s, y: np.r_[y[8:], -squares * y[:8] + phi * (F * math.sin(w * s) - kc * max(0.0, tip(y) - gap))]
        y = restarted(f, [lambda s, y: tip(y) - gap], np.zeros(16), t, scale=gap, rtol=1e-9)
        v = y[:, :8] @ phi
        return {"tip": np.stack([0 * v, v, 0 * v], axis=1)}

    return Scene(text, truth, {}, f"contact {kc / k0:.2g} tip stiffnesses, {w / w1:.2g} of the first frequency")


def three_feet(r):
    """A plate stands on feet at rest: static start, its load beside the middle, linear or Hertz"""
    m, g = 10 ** r.uniform(-1, 2), 9.81
    feet = [
        (r.uniform(0.2, 0.5), r.uniform(-0.1, 0.1)),
        (-r.uniform(0.2, 0.5), r.uniform(0.2, 0.4)),
        (-r.uniform(0.2, 0.5), -r.uniform(0.2, 0.4)),
    ]
    n, radius = pick(r, 1.0, 1.5), 0.02
    load, at = m * g * r.uniform(0, 1), (r.uniform(-0.05, 0.1), r.uniform(-0.05, 0.05))
    k = m * g / (1e-3 * 10 ** r.uniform(-3, 0)) ** n
    text = (
        simulation(0.02, 1000, (0, 0, -g), start="static")
        + rigid("plate", m, (m * 0.1, m * 0.1, m * 0.2), {"load": (*at, 0)} | {f"f{i}": (*p, 0) for i, p in enumerate(feet)})
        + joint("flight", "free", "ground", "plate", f"initial = {{ guess = [0, 0, {radius!r}, 0, 0, 0] }}")
        + force("force", "plate.load", -load, (0, 0, 1))
    )
    for i in range(3):
        text += contact(
            f"c{i}",
            f"plate.f{i}",
            f'shape = "sphere"\nradius = {radius!r}\nstiffness = {k!r}\nexponent = {n}\n'
            f"friction = {{ coefficient = 0.5, stiffness = {m * g / 1e-4!r}, damping = {math.sqrt(m * k)!r} }}\n",
        )
        text += output(f"p{i}", f"plate.f{i}", "position")

    def truth(t):
        A = np.array([[1, 1, 1], [p[0] for p in feet], [p[1] for p in feet]])
        N = np.linalg.solve(A, [m * g + load, load * at[0], load * at[1]])
        z = radius - (N / k) ** (1 / n)
        return {f"p{i}": np.stack([np.nan * t, np.nan * t, z[i] + 0 * t], axis=1) for i in range(3)}

    scale = (m * g / k) ** (1 / n)
    return Scene(text, truth, {f"p{i}": scale for i in range(3)}, f"depth {scale:.1e} m, exponent {n}")


KINDS = [
    dropped_ball,
    on_the_floor,
    comes_back,
    skidding_point,
    landing_box,
    rolling,
    row_of_balls,
    brushing,
    cam,
    beam_on_bump,
    three_feet,
]
