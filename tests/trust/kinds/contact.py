"""Scenes whose motion has pieces: stops, dry friction that sticks and slips, loops that run freely with friction.

Truths piece by piece with scipy."""
import math

import numpy as np

from scene import Scene, force, joint, output, pick, rigid, simulation, spring
from truths.formulas import ode, piecewise


def on_stop(r):
    """A body that starts exactly on its stop, presses on it or is shot into it, on a slide or a hinge."""
    m, k = 10 ** r.uniform(-1, 2), 10 ** r.uniform(3, 7)
    rotary = r.random() < 0.4
    side = pick(r, 1, -1)
    w = math.sqrt(k / m)
    g = 10 ** r.uniform(-1, 1.5)
    depth = m * g / k
    v = pick(r, 0.0, depth * w * r.uniform(0.5, 5))
    duration = pick(r, 4, 12) * 2 * math.pi / w + 4 * v / g
    gap = depth * r.uniform(3, 50) + 4 * v * v / g if r.random() < 0.4 else None
    # side 1: a lower stop at 0, pushed down; -1: an upper one, pushed up.
    limits = ("lower = 0.0" if side > 0 else "upper = 0.0") + (
        "" if gap is None else f", {'upper' if side > 0 else 'lower'} = {side * gap!r}"
    )
    more = f"axis = [0, 0, 1]\nstop = {{ {limits}, stiffness = {k!r} }}\n" + (f"initial = {{ rate = {-side * v!r} }}" if v else "")
    text = (
        simulation(duration, 200 / duration)
        + rigid("body", m if not rotary else 1.0, (m, m, m))
        + joint("guide", "revolute" if rotary else "prismatic", "ground", "body", more)
        + force("torque" if rotary else "force", "body", -side * m * g, (0, 0, 1))
        + output("x", "guide", "value")
    )

    def truth(t):
        def f(mode):
            return lambda _, y: [y[1], -g + (-k / m * y[0] if mode == "in" else -k / m * (y[0] - gap) if mode == "far" else 0.0)]

        def events(mode):
            leave, enter = (lambda _, y: y[0]), (lambda _, y: y[0])
            leave.direction, enter.direction = 1, -1
            if mode == "in":
                return [(leave, "free")]
            if mode == "far":
                back = lambda _, y: y[0] - gap
                back.direction = -1
                return [(back, "free")]
            reach = lambda _, y: y[0] - (gap or 1e30)
            reach.direction = 1
            return [(enter, "in")] + ([(reach, "far")] if gap else [])

        y = piecewise(f, events, [0.0, -v], "in", t, atol=1e-14 * depth)
        return {"x": side * y[:, :1]}

    return Scene(text, truth, {}, f"{'hinge' if rotary else 'slide'}, {limits}, {v:.2g} into it")


def bounce(r):
    """A body falls on a stop and bounces, or swings between two."""
    m, k = 10 ** r.uniform(-1, 2), 10 ** r.uniform(3, 8)
    g, h = 9.81, 10 ** r.uniform(-2, 0.5)
    duration = 2 * math.sqrt(2 * h / g) * r.uniform(2, 6)
    text = (
        simulation(duration, 200 / duration, (0, 0, -g))
        + rigid("ball", m, (m, m, m))
        + joint("guide", "prismatic", "ground", "ball", f"initial = {{ value = {h!r} }}\nstop = {{ lower = 0.0, stiffness = {k!r} }}")
        + output("x", "guide", "value")
    )

    def truth(t):
        # Flight and contact in closed form, one after the other.
        w, x0 = math.sqrt(k / m), -m * g / k
        fall, v = math.sqrt(2 * h / g), math.sqrt(2 * g * h)
        # Contact: x = x0 + a cos(w s) + b sin(w s), x(0) = 0, x'(0) = -v.
        a, b = -x0, -v / w
        contact = 2 * (math.pi - math.atan2(v / w, -x0)) / w
        period = 2 * v / g + contact
        out = np.empty_like(t)
        for i, s in enumerate(t):
            if s < fall:
                out[i] = h - g * s * s / 2
                continue
            s = (s - fall) % period
            out[i] = x0 + a * math.cos(w * s) + b * math.sin(w * s) if s < contact else v * (s - contact) - g * (s - contact) ** 2 / 2
        return {"x": out[:, None]}

    return Scene(text, truth, {}, f"from {h:.2g} m, stop {k:.1e} N/m")


def rubbing_block(r):
    """A block with dry friction, pulled by a spring or by a force that goes to and fro: sticks and slips."""
    m, N, mu = 10 ** r.uniform(-1, 1.5), 10 ** r.uniform(0, 2), r.uniform(0.1, 0.8)
    R = mu * N
    k = pick(r, 0.0, m * 10 ** r.uniform(0, 2))
    w = 10 ** r.uniform(-0.5, 1)
    A = R * r.uniform(1.1, 3)
    x0 = pick(r, 0.0, R / k * r.uniform(-4, 4)) if k else 0.0
    duration = 2 * math.pi / w * r.uniform(2, 4)
    text = (
        simulation(duration, 200 / duration)
        + rigid("block", m, (m, m, m))
        + joint(
            "rail",
            "prismatic",
            "ground",
            "block",
            f"axis = [1, 0, 0]\ninitial = {{ value = {x0!r} }}\nfriction = {{ coefficient = {mu!r}, normal_force = {N!r} }}"
            + (f"\nspring = {{ stiffness = {k!r} }}" if k else ""),
        )
        + force("force", "block", f"{A!r}*sin({w!r}*t)", (1, 0, 0))
        + output("x", "rail", "value")
    )

    def truth(t):
        push = lambda s, y: A * math.sin(w * s) - k * y[0]

        def f(mode):
            if mode == 0:
                return lambda s, y: [0.0, 0.0]
            return lambda s, y: [y[1], (push(s, y) - mode * R) / m]

        def events(mode):
            if mode == 0:
                up, down = (lambda s, y: push(s, y) - R), (lambda s, y: push(s, y) + R)
                up.direction, down.direction = 1, -1
                return [(up, 1), (down, -1)]
            stop = lambda s, y: y[1]
            stop.direction = -mode
            return [(stop, lambda s, y: 0 if abs(push(s, y)) <= R else int(math.copysign(1, push(s, y))))]

        start = push(0.0, [x0])
        y = piecewise(f, events, [x0, 0.0], 0 if abs(start) <= R else int(math.copysign(1, start)), t)
        return {"x": y[:, :1]}

    return Scene(text, truth, {}, f"friction {R:.2g} N, force {A:.2g} N, spring {k:.2g}")


class Crank:
    """A free slider-crank or four-bar with dry friction: M(p) p'' + M'(p)/2 p'^2 = -R sign(s'(p) p') s'(p).

    p is the crank's angle, s what slips."""

    def __init__(self, mass, slip, R):
        self.mass, self.slip, self.R = mass, slip, R

    def run(self, p0, w0, times):
        def f(sign):
            def rhs(_, y):
                M, dM = self.mass(y[0])
                return [y[1], (-0.5 * dM * y[1] ** 2 - self.R * sign * self.slip(y[0])[1]) / M]

            return rhs

        def events(sign):
            turn = lambda _, y: self.slip(y[0])[1]
            turn.direction = -sign
            return [(turn, -sign)]

        sign = int(math.copysign(1, self.slip(p0)[1] * w0))
        return piecewise(f, events, [p0, w0], sign, times)


def slider_crank(r):
    """A rigid slider-crank that runs freely, dry friction on its slider."""
    a = 10 ** r.uniform(-2, 0.3)
    l = a * r.uniform(1.6, 5)
    ms, mr, mc = (10 ** r.uniform(-1, 1) for _ in range(3))
    Jc, Jr = mc * a * a * r.uniform(0.4, 5), mr * l * l / 12
    w0 = 10 ** r.uniform(0, 2)
    p0 = r.uniform(0.2, 2.8) + pick(r, 0, math.pi)

    def shape(p):
        s, c = math.sin(p), math.cos(p)
        q = math.sqrt(l * l - a * a * s * s)
        dq = -a * a * s * c / q
        ddq = (-a * a * (c * c - s * s) - dq * dq) / q
        b1 = -a * c / q  # rod's angle: sin b = -a sin p / l
        b2 = a * s / q + a * c * dq / (q * q)
        return a * c + q, -a * s + dq, -a * c + ddq, b1, b2, dq, ddq

    def mass(p):
        _, x1, x2, b1, b2, dq, ddq = shape(p)
        s, c = math.sin(p), math.cos(p)
        # Rod's middle: (a c + q/2, a s / 2).
        u1, v1 = -a * s + dq / 2, a * c / 2
        u2, v2 = -a * c + ddq / 2, -a * s / 2
        M = Jc + mr * (u1 * u1 + v1 * v1) + Jr * b1 * b1 + ms * x1 * x1
        return M, 2 * (mr * (u1 * u2 + v1 * v2) + Jr * b1 * b2 + ms * x1 * x2)

    slip = lambda p: shape(p)[:2]
    turns = r.uniform(1.5, 3)
    duration = turns * 2 * math.pi / w0
    R = 0.5 * mass(p0)[0] * w0**2 * r.uniform(0.02, 0.12) / (turns * 4 * a)
    order = r.random()
    parts = [
        joint("shaft", "revolute", "ground", "crank", f"initial = {{ value = {p0!r}, rate = {w0!r} }}"),
        joint("pin", "revolute", "crank.end", "rod"),
        joint("wrist", "revolute", *(("rod.end", "slider") if order < 0.5 else ("slider", "rod.end"))),
        joint(
            "guide",
            "prismatic",
            "ground",
            "slider",
            f"axis = [1, 0, 0]\ninitial = {{ value = {shape(p0)[0]!r} }}\nfriction = {{ coefficient = 0.5, normal_force = {2 * R!r} }}",
        ),
    ]
    if r.random() < 0.3:
        parts = [parts[0], parts[3], parts[1], parts[2]]
    bar = lambda name, m, J, length, centre: rigid(name, m, (J / 50, J, J), {"end": (length, 0, 0)}, centre=(centre, 0, 0))
    text = (
        simulation(duration, 200 / duration)
        + bar("crank", mc, Jc, a, 0.0)
        + bar("rod", mr, Jr, l, l / 2)
        + rigid("slider", ms, (ms * a * a * 0.1,) * 3)
        + "".join(parts)
        + output("w", "shaft", "rate")
        + output("x", "slider", "position")
    )

    def truth(t):
        y = Crank(mass, slip, R).run(p0, w0, t)
        return {"w": y[:, 1:], "x": np.array([[slip(p)[0], 0, 0] for p in y[:, 0]])}

    # The crank's inertia is about its centre of mass, which lies on the shaft.
    return Scene(text, truth, {"w": w0}, f"rod/crank {l / a:.2g}, {w0:.2g} rad/s, friction {R:.2g} N")


def crank_rocker(r):
    """A rigid four-bar that runs freely, dry friction in the rocker's hinge."""
    a = 10 ** r.uniform(-1.5, 0.3)
    d, c, b = a * r.uniform(3, 4), a * r.uniform(2.5, 3.5), a * r.uniform(2, 3)
    lengths = sorted((a, b, c, d))
    if lengths[0] != a or lengths[0] + lengths[3] > 0.9 * (lengths[1] + lengths[2]):
        return None
    mb, mc = (10 ** r.uniform(-1, 1) for _ in range(2))
    Ja, Jb, Jc = a * a * 10 ** r.uniform(0, 1.5), mb * b * b / 3, mc * c * c / 12
    w0, p0 = 10 ** r.uniform(0, 2), r.uniform(0.3, 6)

    def angles(p):
        """Coupler's and rocker's angle, the branch with the coupler above."""
        A = np.array([a * math.cos(p), a * math.sin(p)])
        B = np.array([d, 0.0])
        D = B - A
        L = np.linalg.norm(D)
        x = (L * L + c * c - b * b) / (2 * L)
        y = math.sqrt(c * c - x * x)
        P = A + (x * D + y * np.array([-D[1], D[0]])) / L
        return math.atan2(P[1] - A[1], P[0] - A[0]), math.atan2(P[1] - B[1], P[0] - B[0])

    def rates(p):
        th, ps = angles(p)
        # a e^ip + c e^ith = d + b e^ips, differentiated once and twice.
        A = np.array([[-c * math.sin(th), b * math.sin(ps)], [c * math.cos(th), -b * math.cos(ps)]])
        t1, s1 = np.linalg.solve(A, [a * math.sin(p), -a * math.cos(p)])
        t2, s2 = np.linalg.solve(
            A,
            [
                a * math.cos(p) + c * t1**2 * math.cos(th) - b * s1**2 * math.cos(ps),
                a * math.sin(p) + c * t1**2 * math.sin(th) - b * s1**2 * math.sin(ps),
            ],
        )
        return th, ps, t1, s1, t2, s2

    def mass(p):
        th, ps, t1, s1, t2, s2 = rates(p)
        u1 = np.array([-a * math.sin(p) - c / 2 * math.sin(th) * t1, a * math.cos(p) + c / 2 * math.cos(th) * t1])
        u2 = np.array(
            [
                -a * math.cos(p) - c / 2 * (math.cos(th) * t1**2 + math.sin(th) * t2),
                -a * math.sin(p) + c / 2 * (-math.sin(th) * t1**2 + math.cos(th) * t2),
            ]
        )
        return Ja + mc * u1 @ u1 + Jc * t1**2 + Jb * s1**2, 2 * (mc * u1 @ u2 + Jc * t1 * t2 + Jb * s1 * s2)

    slip = lambda p: (rates(p)[1], rates(p)[3])
    turns = r.uniform(1.2, 2.5)
    duration = turns * 2 * math.pi / w0
    R = 0.5 * mass(p0)[0] * w0**2 * r.uniform(0.02, 0.1) / (turns * 3)
    th0, ps0 = angles(p0)
    flip = r.random() < 0.5
    bar = lambda name, m, J, length, centre: rigid(name, m, (J / 50, J, J), {"end": (length, 0, 0)}, centre=(centre, 0, 0))
    text = (
        simulation(duration, 200 / duration)
        + bar("crank", 1.0, Ja, a, 0.0)
        + bar("coupler", mc, Jc, c, c / 2)
        + bar("rocker", mb, mb * b * b / 12, b, b / 2)
        + joint("shaft", "revolute", "ground", "crank", f"initial = {{ value = {p0!r}, rate = {w0!r} }}")
        + joint("pin", "revolute", "crank.end", "coupler", f"rotation = [0, 0, {th0 - p0!r}]")
        + joint(
            "hinge",
            "revolute",
            "ground",
            "rocker",
            (
                f"position = [{d!r}, 0, 0]\nrotation = [0, 0, {ps0!r}]\n"
                f"friction = {{ coefficient = 0.5, normal_force = {2 * R!r}, radius = 1.0 }}"
            ),
        )
        + joint(
            "top",
            "revolute",
            *(("rocker.end", "coupler.end") if flip else ("coupler.end", "rocker.end")),
            f"rotation = [0, 0, {(th0 - ps0) * (1 if flip else -1)!r}]",
        )
        + output("w", "shaft", "rate")
        + output("q", "hinge", "value")
    )

    def truth(t):
        y = Crank(mass, slip, R).run(p0, w0, t)
        return {"w": y[:, 1:], "q": np.array([[math.remainder(angles(p)[1] - ps0, 2 * math.pi)] for p in y[:, 0]])}

    return Scene(text, truth, {"w": w0}, f"{w0:.2g} rad/s, friction {R:.2g} Nm")


def sprung_bob(r):
    """A body on two springs and dampers between points, free in the plane: large motion."""
    m, k = r.uniform(0.2, 5), 10 ** r.uniform(1, 4)
    rest, c = r.uniform(0.3, 1.5), pick(r, 0.0, 10 ** r.uniform(-1, 1.5))
    a = r.uniform(0.5, 2)
    x0, y0 = r.uniform(-1, 1), r.uniform(-2, -0.3)
    duration = r.uniform(3, 8) * 2 * math.pi * math.sqrt(m / k)
    text = (
        simulation(duration, 200 / duration, (0, -9.81, 0))
        + rigid("bob", m, (m, m, m))
        + rigid("post", 1.0, (1, 1, 1), {"left": (-a, 0, 0), "right": (a, 0, 0)})
        + joint("fixed", "weld", "ground", "post")
        + joint("plane", "planar", "ground", "bob", f"initial = {{ value = [{x0!r}, {y0!r}, 0.0] }}")
        + spring("bob", "post.left", k, c, rest)
        + spring("bob", "post.right", k, c, rest)
        + output("p", "bob", "position")
    )

    def f(_, y):
        out = np.array([y[2], y[3], 0.0, -9.81])
        for px in (-a, a):
            d = np.array([y[0] - px, y[1]])
            L = np.linalg.norm(d)
            out[2:] -= (k * (L - rest) + c * (d @ y[2:]) / L) * d / L / m
        return out

    def truth(t):
        y = ode(f, [x0, y0, 0, 0], t)
        return {"p": np.stack([y[:, 0], y[:, 1], 0 * t], axis=1)}

    return Scene(text, truth, {}, f"{k:.2g} N/m, {c:.2g} Ns/m")


KINDS = [on_stop, bounce, rubbing_block, slider_crank, crank_rocker, sprung_bob]
