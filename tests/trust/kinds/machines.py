"""Machines as a stranger writes them: engines with gas force and friction by reaction, loops with friction in every joint and
any joint cut, rotors that whirl, universal joints, beads on wires, ropes, tops, mounts on bushings.

Truths by Newton and Euler in numpy, followed by scipy."""
import math

import numpy as np
from scipy.integrate import quad
from scipy.linalg import eigh, expm

from scene import Scene, beam, force, joint, output, pick, rigid, simulation, sizes, weld
from truths.space_frame import SpaceFrame, axes_of
from truths.formulas import ode, piecewise, restarted


class SliderCrank:
    """Crank a, rod l, slider on x; rates and accelerations of all parts over the crank's angle. Masses: crank's inertia Jc about the shaft,
    rod mr, Jr about its middle, slider ms."""

    def __init__(self, a, l, Jc, mr, Jr, ms):
        self.a, self.l, self.Jc, self.mr, self.Jr, self.ms = a, l, Jc, mr, Jr, ms

    def shape(self, p):
        """Slider's place, rod's angle b, each with its first and second derivative."""
        s, c = math.sin(p), math.cos(p)
        a, l = self.a, self.l
        q = math.sqrt(l * l - a * a * s * s)
        dq = -a * a * s * c / q
        ddq = (-a * a * (c * c - s * s) - dq * dq) / q
        return (a * c + q, -a * s + dq, -a * c + ddq), (math.atan2(-a * s, q), -a * c / q, a * s / q + a * c * dq / (q * q))

    def mass(self, p):
        """Inertia about the crank's angle and its derivative."""
        (_, x1, x2), (_, b1, b2) = self.shape(p)
        s, c = math.sin(p), math.cos(p)
        dq, ddq = x1 + self.a * s, x2 + self.a * c
        u1, v1, u2, v2 = -self.a * s + dq / 2, self.a * c / 2, -self.a * c + ddq / 2, -self.a * s / 2
        M = self.Jc + self.mr * (u1 * u1 + v1 * v1) + self.Jr * b1 * b1 + self.ms * x1 * x1
        return M, 2 * (self.mr * (u1 * u2 + v1 * v2) + self.Jr * b1 * b2 + self.ms * x1 * x2)

    def driven(self, p, w, torque, pull, rub):
        """Angular acceleration and the force of the guide on the slider across it, under a torque on the crank, a force `pull` on the
        slider along x and friction rub |side force| along x."""
        (_, x1, x2), (b, b1, b2) = self.shape(p)
        s, c = math.sin(p), math.cos(p)
        a, l = self.a, self.l
        # Unknown: p'', pin force on the rod (Cx, Cy), wrist force on the slider (Px, Py), side force of the guide N.
        ux = (-a * s + (x1 + a * s) / 2, (-a * c + (x2 + a * c) / 2) * w * w)
        uy = (a * c / 2, -a * s / 2 * w * w)
        rx, ry = l / 2 * math.cos(b), l / 2 * math.sin(b)
        best = None
        for side in (1, -1):
            A, f = np.zeros((6, 6)), np.zeros(6)
            A[0] = [self.ms * x1, 0, 0, -1, 0, -rub * side]
            f[0] = pull - self.ms * x2 * w * w
            A[1] = [0, 0, 0, 0, 1, 1]
            A[2] = [self.mr * ux[0], -1, 0, 1, 0, 0]
            f[2] = -self.mr * ux[1]
            A[3] = [self.mr * uy[0], 0, -1, 0, 1, 0]
            f[3] = -self.mr * uy[1]
            # About the rod's middle: C acts at -r, -P at +r.
            A[4] = [self.Jr * b1, -ry, rx, -ry, rx, 0]
            f[4] = -self.Jr * b2 * w * w
            A[5] = [self.Jc, -a * s, a * c, 0, 0, 0]
            f[5] = torque
            x = np.linalg.solve(A, f)
            if best is None or x[5] * side > best[1] * best[2]:
                best = x[0], x[5], side
        return best[0], best[1]


def engine(r):
    """A free engine: gas force over the crank angle or the piston's place, friction of the piston by its side force, any joint cut"""
    a = 10 ** r.uniform(-1.5, 0)
    l = a * r.uniform(2.5, 4.5)
    ms, mr = (10 ** r.uniform(-1, 0.5) for _ in range(2))
    Jc, Jr = (ms + mr) * a * a * r.uniform(2, 10), mr * l * l / 12
    w0, mu = 10 ** r.uniform(0.5, 2), r.uniform(0.05, 0.25)
    p0 = r.uniform(0.3, 2.6)
    machine = SliderCrank(a, l, Jc, mr, Jr, ms)
    turns = r.uniform(1, 2.5)
    duration = turns * 2 * math.pi / w0
    energy = 0.5 * machine.mass(p0)[0] * w0 * w0
    # A force that works to and fro, less than would stop it.
    F = energy / (8 * a) * r.uniform(0.3, 1)
    by_angle = r.random() < 0.5
    gas = f"{-F!r}*(1 + cos(turn))^2/4" if by_angle else f"{-F!r}*exp(-((place.x - {l + a!r})/{a!r})^2)"
    pull = lambda p: -F * (1 + math.cos(p)) ** 2 / 4 if by_angle else -F * math.exp(-(((machine.shape(p)[0][0] - l - a) / a) ** 2))
    load = energy / (2 * math.pi * turns) * r.uniform(-0.2, 0.2)
    swap = [r.random() < 0.5 for _ in range(2)]
    parts = [
        joint("shaft", "revolute", "ground", "crank", f"initial = {{ value = {p0!r}, rate = {w0!r} }}"),
        joint("pin", "revolute", *(("rod", "crank.end") if swap[0] else ("crank.end", "rod"))),
        joint("wrist", "revolute", *(("slider", "rod.end") if swap[1] else ("rod.end", "slider"))),
        joint(
            "guide",
            "prismatic",
            "ground",
            "slider",
            f"axis = [1, 0, 0]\ninitial = {{ value = {machine.shape(p0)[0][0]!r} }}\n"
            f'friction = {{ coefficient = {mu!r}, normal_force = "reaction" }}',
        ),
    ]
    r.shuffle(parts)
    bar = lambda name, m, J, length, centre: rigid(name, m, (J / 50, J, J), {"end": (length, 0, 0)}, centre=(centre, 0, 0))
    text = (
        simulation(duration, 200 / duration)
        + bar("crank", 1.0, Jc, a, 0.0)
        + bar("rod", mr, Jr, l, l / 2)
        + rigid("slider", ms, (ms * a * a * 0.1,) * 3)
        + "".join(parts)
        + force("force", "slider", gas, (1, 0, 0))
        + force("torque", "crank", load, (0, 0, 1))
        + output("turn", "shaft", "value")
        + output("w", "shaft", "rate")
        + output("place", "slider", "position")
    )

    def truth(t):
        def f(mode):
            sign, side = mode
            return lambda _, y: [y[1], machine.driven(y[0], y[1], load, pull(y[0]), -mu * sign)[0]]

        def events(mode):
            sign, side = mode
            turn = lambda _, y: machine.shape(y[0])[0][1] * y[1]
            turn.direction = -sign
            swing = lambda _, y: machine.driven(y[0], y[1], load, pull(y[0]), -mu * sign)[1] * side
            swing.direction = -1
            return [(turn, lambda _, y: (-sign, side)), (swing, lambda _, y: (sign, -side))]

        sign = int(math.copysign(1, machine.shape(p0)[0][1] * w0))
        side = int(math.copysign(1, machine.driven(p0, w0, load, pull(p0), -mu * sign)[1]))
        y = piecewise(f, events, [p0, w0], (sign, side), t)
        if y[:, 1].min() < 0.2 * w0:
            raise RuntimeError("it stops")
        x = np.array([[machine.shape(p)[0][0], 0, 0] for p in y[:, 0]])
        return {"w": y[:, 1:], "place": x}

    what = f"rod/crank {l / a:.2g}, {w0:.2g} rad/s, gas by {'angle' if by_angle else 'place'}, friction {mu:.2g}"
    return Scene(text, truth, {"w": w0}, what)


def rubbing_loop(r):
    """A slider-crank that runs freely with dry friction in every joint, their order and direction as it comes"""
    a = 10 ** r.uniform(-2, 0.3)
    l = a * r.uniform(1.5, 4)
    ms, mr = (10 ** r.uniform(-1, 1) for _ in range(2))
    Jc, Jr = (ms + mr) * a * a * r.uniform(0.5, 4), mr * l * l / 12
    w0, p0 = 10 ** r.uniform(0, 2), r.uniform(0.2, 2.8) + pick(r, 0, math.pi)
    machine = SliderCrank(a, l, Jc, mr, Jr, ms)
    turns = r.uniform(1, 2.5)
    duration = turns * 2 * math.pi / w0
    energy = 0.5 * machine.mass(p0)[0] * w0 * w0
    share = [pick(r, 0.0, r.uniform(0.02, 0.1)) for _ in range(4)]
    way = (2 * math.pi, 2 * math.pi, 4 * math.asin(a / l), 4 * a)  # of shaft, pin, wrist, guide in a turn
    R = [energy * c / (turns * d) for c, d in zip(share, way)]
    rub = lambda k, more="": f"friction = {{ coefficient = 0.5, normal_force = {2 * R[k]!r}{more} }}" if R[k] else ""
    swap = [r.random() < 0.5 for _ in range(2)]
    parts = [
        joint("shaft", "revolute", "ground", "crank", f"initial = {{ value = {p0!r}, rate = {w0!r} }}\n{rub(0)}"),
        joint("pin", "revolute", *(("rod", "crank.end") if swap[0] else ("crank.end", "rod")), rub(1)),
        joint("wrist", "revolute", *(("slider", "rod.end") if swap[1] else ("rod.end", "slider")), rub(2)),
        joint("guide", "prismatic", "ground", "slider", f"axis = [1, 0, 0]\ninitial = {{ guess = {machine.shape(p0)[0][0]!r} }}\n{rub(3)}"),
    ]
    r.shuffle(parts)
    bar = lambda name, m, J, length, centre: rigid(name, m, (J / 50, J, J), {"end": (length, 0, 0)}, centre=(centre, 0, 0))
    text = (
        simulation(duration, 200 / duration)
        + bar("crank", 1.0, Jc, a, 0.0)
        + bar("rod", mr, Jr, l, l / 2)
        + rigid("slider", ms, (ms * a * a * 0.1,) * 3)
        + "".join(parts)
        + output("w", "shaft", "rate")
        + output("x", "slider", "position")
    )

    def slips(p):
        (_, x1, _), (_, b1, _) = machine.shape(p)
        return np.array([1.0, b1 - 1.0, -b1, x1])

    def truth(t):
        def f(signs):
            def rhs(_, y):
                M, dM = machine.mass(y[0])
                return [y[1], (-0.5 * dM * y[1] ** 2 - sum(R[k] * signs[k] * v for k, v in enumerate(slips(y[0])))) / M]

            return rhs

        def events(signs):
            out = []
            for k in (2, 3):  # shaft and pin never turn round while it runs
                turn = lambda _, y, k=k: slips(y[0])[k]
                turn.direction = -signs[k]
                out.append((turn, tuple(-s if i == k else s for i, s in enumerate(signs))))
            return out

        y = piecewise(f, events, [p0, w0], tuple(np.sign(slips(p0)).astype(int)), t)
        return {"w": y[:, 1:], "x": np.array([[machine.shape(p)[0][0], 0, 0] for p in y[:, 0]])}

    names = [n for n, x in zip(("shaft", "pin", "wrist", "guide"), R) if x]
    return Scene(text, truth, {"w": w0}, f"friction in {', '.join(names) or 'none'}; {w0:.2g} rad/s")


def whirl(r):
    """A shaft with an eccentric disc in its middle, turned steadily below or above its critical speed, at rest in its own frame"""
    L, m, s = sizes(r, slender=(20, 60), shapes=("circle", "tube"))
    rhoA = m["rho"] * s["area"]
    M = rhoA * L * 10 ** r.uniform(-0.5, 1)
    J = M * (0.1 * L) ** 2
    frame = SpaceFrame()
    root, mid, tip = frame.node((0, 0, 0)), frame.node((L / 2, 0, 0)), frame.node((L, 0, 0))
    # In the turning frame translation pulls outward; sections that tilt are turned back by their moment of inertia about the axis, twice
    # that about a diameter.
    turned = {**m, "tilting": -1.0}
    frame.beam(root, mid, s, turned, np.eye(3), elements=8)
    frame.beam(mid, tip, s, turned, np.eye(3), elements=8)
    for n in range(len(frame.places)):  # in a plane through the axis: y and the turn about z
        frame.hold(n, (0, 2, 3, 4))
    frame.hold(root, (1,))
    frame.hold(tip, (1,))
    K, A, free = frame.matrices()
    A[6 * mid + 1, 6 * mid + 1] += M
    critical = 1 / math.sqrt(eigh(A[np.ix_(free, free)], K[np.ix_(free, free)], eigvals_only=True)[-1])
    share = pick(r, r.uniform(0.2, 0.85), r.uniform(0.85, 0.97), r.uniform(1.03, 1.2), r.uniform(1.2, 1.8))
    w = share * critical
    e = L * 10 ** r.uniform(-5, -4)
    f = np.zeros(len(K))
    f[6 * mid + 1] = M * w * w * e
    u = np.zeros(len(K))
    u[free] = np.linalg.solve((K - w * w * A)[np.ix_(free, free)], f[free])
    y = float(u[6 * mid + 1])
    text = (
        simulation(2 * math.pi / w * 0.2, 200 / (2 * math.pi / w), start="static")
        + beam("left", L / 2, s["text"], m)
        + beam("right", L / 2, s["text"], m)
        + rigid("disc", M, (J, J / 2, J / 2), centre=(0, e, 0))
        + joint("bearing", "revolute", "ground", "hub", f'axis = [1, 0, 0]\nmotion = "{w!r}*t"')
        + rigid("hub", 1.0, (J, J, J))
        + joint("a", "constant-velocity", "hub", "left.root", "axis = [1, 0, 0]")
        + weld("b", "left.tip", "right.root")
        + weld("c", "left.tip", "disc")
        + joint("d", "point-on-line", "ground", "right.tip", "axis = [1, 0, 0]")
        + output("middle", "left.tip", "position")
    )

    def truth(t):
        return {"middle": np.stack([np.nan * t, y * np.cos(w * t), y * np.sin(w * t)], axis=1)}

    return Scene(text, truth, {"middle": abs(y)}, f"{share:.2g} of the critical speed, disc {M / (rhoA * L):.2g} of the shaft")


def slotted_disc(r):
    """A mass on springs in a slot of a disc that turns steadily, slow to far beyond where the spring can hold it"""
    m, k = 10 ** r.uniform(-2, 2), 10 ** r.uniform(1, 6)
    w1 = math.sqrt(k / m)
    w = w1 * pick(r, r.uniform(0.05, 0.9), r.uniform(1.1, 2.0), 10 ** r.uniform(0.5, 1.5))
    x0, c = 10 ** r.uniform(-3, 1), pick(r, 0.0, 2 * m * w1 * r.uniform(0.01, 0.3))
    rate = math.sqrt(abs(w1 * w1 - w * w))
    duration = r.uniform(1, 4) / rate * (1 if w > w1 else 2 * math.pi)
    across = r.random() < 0.4 and w < 5 * w1
    text = simulation(duration, 200 / duration) + rigid("disc", 1.0, (1, 1, 1)) + rigid("bob", m, (m, m, m))
    text += joint("shaft", "revolute", "ground", "disc", f'motion = "{w!r}*t"')
    spring_of = f"spring = {{ stiffness = {k!r}, damping = {c!r} }}"
    if across:
        text += joint("slot", "planar", "disc", "bob", f"initial = {{ value = [{x0!r}, 0, 0] }}\n{spring_of}")
    else:
        text += joint("slot", "prismatic", "disc", "bob", f"axis = [1, 0, 0]\ninitial = {{ value = {x0!r} }}\n{spring_of}")
    text += output("x", "slot", "value") + output("place", "bob", "position")
    if across:  # x'' + c/m x' + (k/m - w^2) x - 2 w y' = 0, likewise y
        A = np.zeros((4, 4))
        A[0, 2] = A[1, 3] = 1
        A[2] = [w * w - k / m, 0, -c / m, 2 * w]
        A[3] = [0, w * w - k / m, -2 * w, -c / m]
    else:
        A = np.array([[0, 1], [w * w - k / m, -c / m]])

    def truth(t):
        step = expm(A * (t[1] - t[0]))
        y = np.zeros((len(t), len(A)))
        y[0, 0] = x0
        for i in range(1, len(t)):
            y[i] = step @ y[i - 1]
        a, b = y[:, 0], y[:, 1] if across else 0 * t
        place = np.stack([a * np.cos(w * t) - b * np.sin(w * t), a * np.sin(w * t) + b * np.cos(w * t), 0 * t], axis=1)
        x = np.stack([a, b, np.nan * t], axis=1) if across else a[:, None]
        return {"x": x, "place": place}

    return Scene(text, truth, {}, f"speed {w / w1:.2g} of sqrt(k/m), damping {c / (2 * m * w1):.2g}{', both ways' if across else ''}")


def cardan(r):
    """Two shafts at an angle joined by a universal joint, driven evenly or by a torque against a brake that reads the speed"""
    angle = r.uniform(0.05, 1.0)
    J1, J2 = (10 ** r.uniform(-2, 1) for _ in range(2))
    w0 = 10 ** r.uniform(0, 2)
    turns = r.uniform(1, 4)
    duration = turns * 2 * math.pi / w0
    driven, phase = r.random() < 0.5, pick(r, 0.0, r.uniform(-1, 1))
    cb = math.cos(angle)
    T, c = J2 * w0**2 * r.uniform(0.02, 0.2), J2 * w0 * r.uniform(0.0, 0.1)
    # Input along x, output along x turned by `angle` about z. The cross' first axis on the input lies along z at turn 0 (phase).
    more = f'motion = "{phase!r} + {w0!r}*t"' if driven else f"initial = {{ value = {phase!r}, rate = {w0!r} }}"
    text = (
        simulation(duration, 300 / duration)
        + rigid("first", 1.0, (J1, J1, J1))
        + rigid("cross", 0.0, (0, 0, 0))
        + rigid("second", 1.0, (J2, J2, J2))
        + joint("input", "revolute", "ground", "first", f"axis = [1, 0, 0]\n{more}")
        + joint("output", "revolute", "ground", "second", f"axis = [1, 0, 0]\nrotation = [0, 0, {angle!r}]")
        + joint("knuckle", "revolute", "first", "cross", "axis = [0, 0, 1]")
        + joint("fork", "revolute", "cross", "second", "axis = [0, 1, 0]")
        + output("turn", "output", "value")
        + output("speed", "output", "rate")
    )
    if not driven:
        text += force("torque", "first", f"{T!r}", (1, 0, 0)) + force("torque", "second", f"-{c!r}*speed", (cb, math.sin(angle), 0))
    # The cross' axes stay normal: (0, -sin a, cos a)(z of the input) . (y of the output turned by b) = 0.
    # z1 = (0, -sin a, cos a); y2 = R (0, cos b, sin b) = (-sin g cos b, cos g cos b, sin b): -sin a cos g cos b + cos a sin b = 0.
    out_of = lambda a: math.atan2(math.sin(a) * cb, math.cos(a))

    def ratio(a):
        """d b / d a and its derivative: b = atan(cos g tan a)."""
        n = math.cos(a) ** 2 + cb * cb * math.sin(a) ** 2
        return cb / n, -cb * (cb * cb - 1) * math.sin(2 * a) / (n * n)

    def truth(t):
        if driven:
            a = phase + w0 * t
            v = np.full_like(t, w0)
        else:

            def f(_, y):
                q, dq = ratio(y[0])
                return [y[1], (T - c * q * q * y[1] - J2 * q * dq * y[1] ** 2) / (J1 + J2 * q * q)]

            y = ode(f, [phase, w0], t)
            a, v = y[:, 0], y[:, 1]
        b = np.unwrap([out_of(x) for x in a])
        speed = np.array([ratio(x)[0] for x in a]) * v
        return {"turn": b[:, None], "speed": speed[:, None]}

    return Scene(text, truth, {}, f"{math.degrees(angle):.0f} degrees, {'driven evenly' if driven else 'by a torque'}")


def bead(r):
    """A bead runs on a wire, parabola, wave or circle, under gravity, with a spring, a damper or dry friction along it"""
    scale, g = 10 ** r.uniform(-2, 1), 9.81
    m, form = 10 ** r.uniform(-3, 1), pick(r, "parabola", "wave", "circle")
    if form == "parabola":
        h = r.uniform(0.3, 1.5)
        x, y = (lambda u: u), (lambda u: h * u * u)
        text_x, text_y, lo, hi = f"{scale!r}*u", f"{scale * h!r}*u^2", -2.0, 2.0
    elif form == "wave":
        h = r.uniform(0.1, 0.4)
        x, y = (lambda u: u), (lambda u: -h * math.cos(2 * u))
        text_x, text_y, lo, hi = f"{scale!r}*u", f"{-scale * h!r}*cos(2*u)", -1.5, 1.5
    else:
        x, y = math.sin, (lambda u: -math.cos(u))
        text_x, text_y, lo, hi = f"{scale!r}*sin(u)", f"{-scale!r}*cos(u)", -3.0, 3.0
    u0 = r.uniform(0.3, 0.9) * pick(r, 1, -1)
    c = m * math.sqrt(g / scale) * pick(r, 0.0, r.uniform(0.02, 0.5))
    R = m * g * pick(r, 0.0, r.uniform(0.01, 0.08))
    duration = 2 * math.pi * math.sqrt(scale / g) * r.uniform(1, 3)

    def slope(u):
        if form == "circle":
            return np.array([math.cos(u), math.sin(u)]), np.array([-math.sin(u), math.cos(u)])
        if form == "parabola":
            return np.array([1.0, 2 * h * u]), np.array([0.0, 2 * h])
        return np.array([1.0, 2 * h * math.sin(2 * u)]), np.array([0.0, 4 * h * math.cos(2 * u)])

    start = scale * quad(lambda u: np.linalg.norm(slope(u)[0]), lo, u0, epsabs=1e-13, epsrel=1e-13)[0]
    rub = f"friction = {{ coefficient = 1.0, normal_force = {R!r} }}\n" if R else ""
    text = (
        simulation(duration, 200 / duration, (0, -g, 0))
        + rigid("bead", m, (m * scale**2 * 1e-4,) * 3)
        + joint(
            "wire",
            "point-on-curve",
            "ground",
            "bead",
            f'curve = {{ x = "{text_x}", y = "{text_y}", from = {lo}, to = {hi} }}\ninitial = {{ value = {start!r} }}\n{rub}'
            + (f"spring = {{ stiffness = 0.0, damping = {c!r} }}" if c else ""),
        )
        + output("p", "bead", "position")
    )

    def truth(t):
        # Unit: scale. s' = |r'| u'; m s'' = -m g y_s - c s' - R sign.
        def rhs(sign):
            def f(_, z):
                r1, r2 = slope(z[0])
                n = r1 @ r1
                drive = -g / scale * r1[1] / n
                drag = -(c / m) * z[1] - sign * R / (m * scale) / math.sqrt(n)
                return [z[1], drive + drag - (r1 @ r2) / n * z[1] ** 2]

            return f

        if not R:
            z = ode(rhs(0), [u0, 0.0], t)
        else:

            def push(_, z):
                r1, _ = slope(z[0])
                return -m * g * r1[1] / np.linalg.norm(r1)

            def go(s, z):
                F = push(s, z)
                return 0 if abs(F) <= R else int(math.copysign(1, F))

            def f(mode):
                return rhs(mode) if mode else (lambda _, z: [0.0, 0.0])

            def events(mode):
                if mode == 0:
                    return []
                stop = lambda _, z: z[1]
                stop.direction = -mode
                return [(stop, go)]

            z = piecewise(f, events, [u0, 0.0], go(0, [u0, 0.0]), t)
        return {"p": scale * np.array([[x(u), y(u), 0.0] for u in z[:, 0]])}

    return Scene(text, truth, {}, f"{form}, {scale:.2g} m, damping {c:.2g}, friction {R / (m * g):.2g} of the weight")


def lifted_by_rope(r):
    """Two loads on an elastic rope over pulleys, or hung by slack cables that catch them: pulls and places"""
    m1, m2, g = 10 ** r.uniform(-1, 2), 10 ** r.uniform(-1, 2), 9.81
    if abs(m1 - m2) < 0.05 * (m1 + m2):
        return None
    k = (m1 + m2) * g / 10 ** r.uniform(-3, -1)
    c = 2 * math.sqrt(k * m1 * m2 / (m1 + m2)) * pick(r, 0.0, r.uniform(0.05, 0.5))
    h, slack = 2.0, pick(r, 0.0, r.uniform(0.01, 0.1))
    rest = 2 * h + 1.0 + slack
    a = g * abs(m1 - m2) / (m1 + m2)
    duration = math.sqrt(2 * 0.5 / a) * r.uniform(0.3, 0.9)
    guide = lambda n, x: joint(f"g{n}", "prismatic", "ground", f"m{n}", f"position = [{x!r}, {-h!r}, 0]\naxis = [0, 1, 0]")
    rope = '[[force]]\nname = "rope"\nkind = "cable"\non = "m2"\nfrom = "m1"\nthrough = ["ground.left", "ground.right"]\n'
    text = "[ground]\nframes = { left = [0, 0, 0], right = [1, 0, 0] }\n\n" + simulation(duration, 300 / duration, (0, -g, 0))
    text += rigid("m1", m1, (m1, m1, m1)) + rigid("m2", m2, (m2, m2, m2)) + guide(1, 0.0) + guide(2, 1.0)
    text += f"{rope}stiffness = {k!r}\ndamping = {c!r}\nrest = {rest!r}\n\n"
    text += output("y1", "g1", "value") + output("y2", "g2", "value")

    def truth(t):
        def pull(y):
            stretch, rate = 2 * h + 1.0 - y[0] - y[1] - rest, -y[2] - y[3]
            return k * stretch + c * rate, stretch

        def f(_, y):
            F, stretch = pull(y)
            F = F if stretch > 0 and F > 0 else 0.0
            return np.array([y[2], y[3], F / m1 - g, F / m2 - g])

        y = restarted(f, [lambda _, y: pull(y)[1], lambda _, y: pull(y)[0]], [0, 0, 0, 0], t)
        return {"y1": y[:, :1], "y2": y[:, 1:2]}

    return Scene(text, truth, {}, f"masses {m1 / m2:.2g}, stretch {(m1 + m2) * g / k:.1e} m, slack {slack:.2g}, damping {c:.2g}")


def fast_top(r):
    """A heavy top on a point, from slow to very fast spin: place of its end, and how it is turned"""
    m, l = 10 ** r.uniform(-1, 1), 10 ** r.uniform(-1.5, 0)
    A, g = m * l * l * r.uniform(1.05, 1.5), 9.81
    C = (A - m * l * l) * r.uniform(0.2, 1.9)
    slow = math.sqrt(m * g * l / A)
    spin = math.sqrt(4 * A * m * g * l) / C * 10 ** r.uniform(-0.5, 1.5)
    tilt = r.uniform(0.1, 1.3)
    duration = min(2 * math.pi / slow * r.uniform(0.5, 2), 60 * 2 * math.pi / spin)
    # Inertia about the point: A across, C along; about the centre A - m l^2.
    w0 = [spin, r.uniform(-1, 1) * slow, r.uniform(-1, 1) * slow]
    R0 = axes_of([0, -tilt, 0])  # x of the body up to the side
    turn = [0.0, -tilt, 0.0]
    rate = [float(x) for x in R0 @ w0]
    text = (
        simulation(duration, 400 / duration, (0, 0, -g))
        + rigid("top", m, (C, A - m * l * l, A - m * l * l), {"end": (2 * l, 0, 0)}, centre=(l, 0, 0))
        + joint("point", "spherical", "ground", "top", f"initial = {{ value = {turn}, rate = {rate} }}")
        + output("end", "top.end", "position")
        + output("w", "top", "angular_velocity")
    )

    def truth(t):
        I = np.diag([C, A, A])

        def f(_, y):
            R, w = y[:9].reshape(3, 3), y[9:]
            M = np.cross([l, 0, 0], R.T @ [0, 0, -m * g])
            S = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
            return np.r_[(R @ S).ravel(), np.linalg.solve(I, M - np.cross(w, I @ w))]

        y = ode(f, np.r_[R0.ravel(), w0], t, rtol=1e-12)
        R = y[:, :9].reshape(-1, 3, 3)
        return {"end": 2 * l * R[:, :, 0], "w": np.einsum("tij,tj->ti", R, y[:, 9:])}

    return Scene(text, truth, {}, f"spin {spin:.2g} rad/s, {duration * spin / 6.283:.0f} turns, tilt {math.degrees(tilt):.0f}")


def on_mounts(r):
    """A heavy body on bushings or springs in space, at rest under its weight or shaken: small motions in all six directions"""
    m = 10 ** r.uniform(-1, 3)
    size = 10 ** r.uniform(-1, 0.5)
    J = [m * size**2 * r.uniform(0.1, 0.2) for _ in range(3)]
    g = 9.81
    n = r.randint(3, 5)
    at = [np.array([r.uniform(-1, 1), r.uniform(-1, 1), r.uniform(-0.3, 0.0)]) * size for _ in range(n)]
    stiff = [[m * g / (size * 10 ** r.uniform(-4, -3)) for _ in range(3)] + [0.0] * 3 for _ in range(n)]
    frame = SpaceFrame()
    node = frame.node((0, 0, 0))
    frame.body(node, m, J)
    for p, k in zip(at, stiff):
        frame.spring(node, np.diag(k[:3]), p)
    K, M, _ = frame.matrices()
    if np.linalg.cond(K / np.sqrt(np.outer(np.diag(M), np.diag(M)))) > 1e5:
        return None
    rest = r.random() < 0.4
    ground = ", ".join(f"g{i} = {[float(x) for x in p]}" for i, p in enumerate(at))
    text = (
        f"[ground]\nframes = {{ {ground} }}\n\n"
        + rigid("block", m, J, {f"p{i}": p for i, p in enumerate(at)})
        + joint("flight", "free", "ground", "block")
    )
    w1 = math.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real.min())
    d = [r.gauss(0, 1) for _ in range(3)]
    F = 0.3 * m * g
    zeta = pick(r, 0.0, 0.02)
    beta = 2 * zeta / w1
    for i, k in enumerate(stiff):
        text += (
            f'[[force]]\nname = "m{i}"\nkind = "bushing"\non = "block.p{i}"\nfrom = "ground.g{i}"\nstiffness = {k}\n'
            f"damping = {[beta * x for x in k]}\n\n"
        )
    text += output("p", "block", "position") + output("corner", "block.p0", "position")
    if rest:
        head = simulation(0.02, 200, (0, 0, -g), start="static")
        f = frame.weight((0, 0, -g))
        u = frame.rest(f)[0]
        size_of = float(np.linalg.norm(u[:3]))

        def truth(t):
            u6 = np.tile(u, (len(t), 1))
            return places(u6)

        scales = {"p": size_of, "corner": size_of}
    else:
        duration = 2 * math.pi / w1 * r.uniform(1, 4)
        head = simulation(duration, 300 / duration)
        text += force("force", "block.p0", f"{F!r}*sin({1.7 * w1!r}*t)", d)
        f = frame.at(node, F * np.array(d) / np.linalg.norm(d), offset=at[0])
        scales = {}

        def truth(t):
            A = np.zeros((12, 12))
            A[:6, 6:] = np.eye(6)
            A[6:, :6], A[6:, 6:] = -np.linalg.solve(M, K), -beta * np.linalg.solve(M, K)
            b = np.r_[np.zeros(6), np.linalg.solve(M, f)]
            y = ode(lambda s, z: A @ z + b * math.sin(1.7 * w1 * s), np.zeros(12), t, scale=1e-3 * np.abs(np.linalg.solve(K, f)).max())
            return places(y[:, :6])

    def places(u6):
        turns = np.cross(u6[:, 3:], at[0])
        return {"p": u6[:, :3], "corner": at[0] + u6[:, :3] + turns}

    return Scene(head + text, truth, scales, f"{n} mounts, {m:.2g} kg{', at rest' if rest else f', damping {zeta}'}")


KINDS = [engine, rubbing_loop, whirl, slotted_disc, cardan, bead, lifted_by_rope, fast_top, on_mounts]
