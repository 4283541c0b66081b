"""Closed mechanisms by chance for loops.py: rigid ones in a plane with their truth, and elastic ones without."""
import math

import numpy as np
from kinds.random import scales_of
from scene import Scene, by_chance, joint, output, pick, rigid, simulation
from truths.plane_loops import NotClosed, PlaneLoops

SAMPLES = 60
TURN = lambda a: np.array([[math.cos(a), -math.sin(a)], [math.sin(a), math.cos(a)]])


def meet(A, B, a, b, side):
    """The point at the distances a from A and b from B on one side of the line between them; None where there is none."""
    D = B - A
    L = np.linalg.norm(D)
    x = (L * L + a * a - b * b) / (2 * L)
    if a * a <= x * x:
        return None
    return A + (x * D + side * math.sqrt(a * a - x * x) * np.array([-D[1], D[0]])) / L


class Drawn:
    """A mechanism in the place where it starts: points in the world, bodies by the points that they join, the first their origin."""

    def __init__(self, r):
        self.r, self.points, self.bodies, self.pins, self.slides, self.drive = r, {}, [], [], [], None

    def point(self, name, at):
        self.points[name] = np.array(at, float)
        return self.points[name]

    def body(self, *points, mass=None):
        """A plate over its points; -1 stands for the ground."""
        r = self.r
        at = [self.points[p] for p in points]
        d = at[1] - at[0] if len(at) > 1 else np.zeros(2)
        size = max(np.linalg.norm(p - at[0]) for p in at) if len(at) > 1 else self.size
        angle = math.atan2(d[1], d[0]) if len(at) > 1 else 0.0
        mass = mass or 10 ** r.uniform(-1, 1)
        centre = TURN(-angle) @ (np.mean(at, 0) - at[0]) + size * np.array([r.uniform(-0.1, 0.1), r.uniform(-0.1, 0.1)])
        if len(at) == 1:
            centre = np.zeros(2)
        self.bodies.append((points, angle, mass, mass * size**2 * 10 ** r.uniform(-1.5, -0.3), centre))
        return len(self.bodies) - 1

    def local(self, i, point):
        """A point from the centre of mass in the body's axes; of ground in the world."""
        if i < 0:
            return self.points[point]
        points, angle, _, _, centre = self.bodies[i]
        return TURN(-angle) @ (self.points[point] - self.points[points[0]]) - centre

    def pin(self, i, j, point):
        self.pins.append((i, j, point))

    def truth(self, gravity):
        pins = [(i, self.local(i, p), j, self.local(j, p)) for i, j, p in self.pins]
        slides = [(i, self.local(i, p), self.points[p], u) for i, p, u in self.slides]
        drive = None
        if self.drive:
            i, f = self.drive
            drive = (i, -1, lambda t: (self.bodies[i][1] + f(t)[0],) + f(t)[1:])
        return PlaneLoops([(m, J) for _, _, m, J, _ in self.bodies], pins, slides, drive, gravity)

    def start(self):
        return np.concatenate(
            [np.append(self.points[points[0]] + TURN(angle) @ centre, angle) for points, angle, _, _, centre in self.bodies]
        )


def four_links(r, d, base="A", near=None):
    """A four-bar A-B-C-D: crank, coupler, rocker. near: by how much of its size it misses a change point."""
    a = d.size
    c, b, e = (a * r.uniform(0.8, 3.5) for _ in range(3))
    if near is not None:
        # The shortest and the longest link are as long as the others together, but for a little.
        lengths = [a, c, b, e]
        k = pick(r, 1, 2, 3)
        order = sorted(range(4), key=lambda i: lengths[i])
        wanted = sum(lengths[i] for i in order[1:3]) - lengths[order[0]] + near * a
        k = order[3]
        if k == 0:
            return None
        lengths[k] = wanted
        if wanted < max(lengths[i] for i in order[:3]):
            return None
        a, c, b, e = lengths
    A, D = d.point("A", (0, 0)), d.point("D", TURN(r.uniform(-3, 3)) @ (e, 0))
    B = d.point("B", TURN(r.uniform(-3, 3)) @ (a, 0))
    C = meet(B, D, c, b, pick(r, -1, 1))
    if C is None:
        return None
    d.point("C", C)
    return a, c, b, e


def dyad(r, d, body, on, to):
    """Two more links, or a link and a slider, from a point of `body` to ground or to another body (to)."""
    P, size = d.points[on], d.size
    l1, l2 = size * r.uniform(1.0, 3.0), size * r.uniform(1.0, 3.0)
    Q = d.point("Q", P + TURN(r.uniform(-3.1, 3.1)) @ (l1, 0))
    k = d.body(on, "Q")
    d.pin(body, k, on)
    if to is None and r.random() < 0.4:
        s = d.body("Q")
        d.pin(k, s, "Q")
        # Along a line that the link reaches well.
        u = (Q - P) / l1
        d.slides.append((s, "Q", TURN(r.uniform(-1.1, 1.1)) @ u))
        return
    if to is None:
        d.point("R", Q + TURN(r.uniform(-3.1, 3.1)) @ (l2, 0))
        end = -1
    else:
        end, _ = to
        d.point("R", d.points[to[1]])
    m = d.body("Q", "R")
    d.pin(k, m, "Q")
    d.pin(m, end, "R")


def slider_crank(r):
    """Slider-crank, rod from little longer than the crank to five times, guide beside the shaft or through it"""
    d = Drawn(r)
    d.size = a = 10 ** r.uniform(-1.5, 0.5)
    ratio = by_chance(r, (0.3, lambda r: 1 + 10 ** r.uniform(-3, -1)), (1.0, lambda r: r.uniform(1.3, 5)))
    beside = by_chance(r, (0.5, lambda r: 0.0), (1.0, lambda r: a * r.uniform(-0.25, 0.25)))
    p = r.uniform(-3, 3)
    u = TURN(pick(r, 0.0, r.uniform(-3, 3)))
    d.point("A", (0, 0))
    B = d.point("B", u @ (a * math.cos(p), a * math.sin(p)))
    h = beside - a * math.sin(p)
    if abs(h) > 0.97 * ratio * a:
        return None
    d.point("C", B + u @ (math.sqrt((ratio * a) ** 2 - h * h), h))
    crank, rod, slider = d.body("A", "B"), d.body("B", "C"), d.body("C")
    d.pin(crank, -1, "A")
    d.pin(crank, rod, "B")
    d.pin(rod, slider, "C")
    d.slides.append((slider, "C", u @ (1, 0)))
    return d


def four_bar(r):
    """Four-bar of any lengths"""
    d = Drawn(r)
    d.size = 10 ** r.uniform(-1.5, 0.5)
    if four_links(r, d) is None:
        return None
    return close_four(d)


def four_bar_near_change(r):
    """Four-bar that misses a change point by a tenth to a thousandth of its crank"""
    d = Drawn(r)
    d.size = 10 ** r.uniform(-1.5, 0.5)
    if four_links(r, d, near=pick(r, -1, 1) * 10 ** r.uniform(-3, -1)) is None:
        return None
    return close_four(d)


def close_four(d, coupler=("B", "C"), rocker=("D", "C"), crank=("A", "B")):
    i, j, k = d.body(*crank), d.body(*coupler), d.body(*rocker)
    d.pin(i, -1, "A")
    d.pin(i, j, "B")
    d.pin(j, k, "C")
    d.pin(k, -1, "D")
    return d


def six_bar(r):
    """Six-bar: a four-bar and two more links, or a link and a slider, from its coupler or rocker to ground or to another of its links"""
    d = Drawn(r)
    d.size = 10 ** r.uniform(-1.5, 0.5)
    if four_links(r, d) is None:
        return None
    beside = (
        lambda i, j: d.points[i]
        + (d.points[j] - d.points[i]) * r.uniform(0.3, 1.5)
        + TURN(r.uniform(-3, 3))
        @ (
            d.size * r.uniform(0.1, 1),
            0,
        )
    )
    on_coupler = r.random() < 0.6
    d.point("P", beside("B", "C") if on_coupler else beside("D", "C"))
    watt = r.random() < 0.4
    if not watt:
        close_four(d, ("B", "C", "P") if on_coupler else ("B", "C"), ("D", "C") if on_coupler else ("D", "C", "P"))
        dyad(r, d, 1 if on_coupler else 2, "P", None)
        return d
    # Watt's: from the coupler to the rocker's or the crank's other point.
    other = pick(r, "crank", "rocker") if on_coupler else "crank"
    d.point("S", beside("A", "B") if other == "crank" else beside("D", "C"))
    d.points["R"] = d.points["S"]
    close_four(
        d,
        ("B", "C", "P") if on_coupler else ("B", "C"),
        ("D", "C") + (("R",) if other == "rocker" else ()) + (() if on_coupler else ("P",)),
        ("A", "B") + (("R",) if other == "crank" else ()),
    )
    dyad(r, d, 1 if on_coupler else 2, "P", (2 if other == "rocker" else 0, "R"))
    return d


def five_bar(r):
    """Five-bar with two ways to move"""
    d = Drawn(r)
    d.size = s = 10 ** r.uniform(-1.5, 0.5)
    d.point("A", (0, 0))
    B = d.point("B", TURN(r.uniform(-3, 3)) @ (s, 0))
    E = d.point("E", TURN(r.uniform(-3, 3)) @ (s * r.uniform(1, 3), 0))
    D = d.point("D", E + TURN(r.uniform(-3, 3)) @ (s * r.uniform(0.6, 2), 0))
    C = meet(B, D, s * r.uniform(1, 3), s * r.uniform(1, 3), pick(r, -1, 1))
    if C is None:
        return None
    d.point("C", C)
    i, j, k, m = d.body("A", "B"), d.body("B", "C"), d.body("C", "D"), d.body("D", "E")
    for a, b, p in ((i, -1, "A"), (i, j, "B"), (j, k, "C"), (k, m, "D"), (m, -1, "E")):
        d.pin(a, b, p)
    return d


def motions(r, w):
    """A driven angle as text and as a function of t with its rates: at once evenly, from rest, to and fro."""
    T = 2 * math.pi / w
    even = (f"{w!r}*t", lambda t: (w * t, w, 0.0))
    rest = (
        f"{w!r}*t - {w * T!r}/pi*sin(pi*t/{T!r})/1",
        lambda t: (
            w * t - w * T / math.pi * math.sin(math.pi * t / T),
            w * (1 - math.cos(math.pi * t / T)),
            w * math.pi / T * math.sin(math.pi * t / T),
        ),
    )
    A = r.uniform(0.3, 2)
    to_and_fro = (
        f"{A!r}*(1 - cos({w!r}*t))",
        lambda t: (A * (1 - math.cos(w * t)), A * w * math.sin(w * t), A * w * w * math.cos(w * t)),
    )
    return pick(r, even, rest, to_and_fro)


def worst_pivot(loops, q, t):
    """How near to singular the conditions are: the least of their singular values over the largest, every length 1."""
    _, G, _, _ = loops.close(t, q)
    unit = G / np.sqrt(loops.M) * np.sqrt(loops.M[:2].max())
    s = np.linalg.svd(unit / np.linalg.norm(unit, axis=1, keepdims=True), compute_uv=False)
    return s[-1] / s[0]


def closed(r, shape):
    """A drawn mechanism as a scene: driven or free, with weight or without, its outputs and their truth."""
    d = shape(r)
    if d is None:
        return None
    w = 10 ** r.uniform(0, 2)
    driven = shape is not five_bar and r.random() < 0.4
    heavy = r.random() < 0.5
    g = heavy * d.size * w * w * 10 ** r.uniform(-1, 0.5)
    way = TURN(r.uniform(-3, 3)) @ (0, -g) if heavy else np.zeros(2)
    text_of_motion = ""
    if driven:
        text_of_motion, f = motions(r, w)
        d.drive = (0, f)
    loops = d.truth(way)
    q0 = d.start()
    duration = 2 * math.pi / w * r.uniform(0.5, 2.5)
    try:
        q0, G, _, _ = loops.close(0.0, q0)
        if worst_pivot(loops, q0, 0.0) < 1e-3:
            return None
        qd0 = np.zeros(loops.size)
        at_rest = heavy and r.random() < 0.3
        if driven:
            qd0 = loops.close_rates(G, qd0)
        elif not at_rest:
            wanted = np.array([x for _ in d.bodies for x in (0.0, 0.0, r.uniform(-1, 1) * w)])
            wanted[2] = w
            qd0 = loops.close_rates(G, wanted)
            largest = abs(qd0[2::3]).max()
            if largest < 1e-3 * w:
                return None
            qd0 *= w / largest
        else:
            duration *= 1.5
        if driven:
            times = np.linspace(0, duration, 400)
            qs, qds = loops.follow(q0, qd0, times)
            turned = abs(np.diff(qs[:, 2::3], axis=0)).max()
            if abs(qds[:, 2::3]).max() > 100 * max(abs(loops.drive[2](t)[1]) for t in times) or turned > 0.7:
                return None  # too near to where it ends, or over into another way to close
    except (NotClosed, np.linalg.LinAlgError):
        return None
    return write(r, d, loops, q0, qd0, duration, way, text_of_motion)


def write(r, d, loops, q0, qd0, duration, way, text_of_motion):
    text = simulation(duration, SAMPLES / duration, (way[0], way[1], 0))
    angle = lambda i: q0[3 * i + 2] if i >= 0 else 0.0
    rate = lambda i, qd=qd0: qd[..., 3 * i + 2] if i >= 0 else 0.0 * qd[..., 0]
    for i, (points, _, m, J, centre) in enumerate(d.bodies):
        frames = {p: (*(d.local(i, p) + centre), 0) for p in points[1:]}
        text += rigid(f"b{i}", m, (J, J, J), frames, centre=(*centre, 0))
    name_of = lambda i, p: "ground" if i < 0 else f"b{i}" if d.bodies[i][0][0] == p else f"b{i}.{p}"
    joints, wanted, sizes = [], {}, {}
    order = list(range(len(d.pins)))
    for k in order:
        i, j, p = d.pins[k]
        child, parent = (i, j) if j < 0 or r.random() < 0.5 else (j, i)
        lines = "" if parent >= 0 else f"position = [{float(d.points[p][0])!r}, {float(d.points[p][1])!r}, 0]\n"
        value, speed = math.remainder(angle(child) - angle(parent), 2 * math.pi), float(rate(child) - rate(parent))
        if d.drive and k == 0:
            lines += f'motion = "{value!r} + {text_of_motion}"'
        else:
            lines += f"initial = {{ value = {value!r}" + ("" if d.drive else f", rate = {speed!r}") + " }"
        joints.append((joint(f"j{k}", "revolute", name_of(parent, p), name_of(child, p), lines), k, child, parent))
    texts = [x[0] for x in joints]
    for n, (i, p, u) in enumerate(d.slides):
        P = d.points[p]
        speed = float(u @ (qd0[3 * i : 3 * i + 2]))
        lines = f"axis = [{float(u[0])!r}, {float(u[1])!r}, 0]\nposition = [{float(P[0])!r}, {float(P[1])!r}, 0]\n"
        lines += "initial = { value = 0.0" + ("" if d.drive else f", rate = {speed!r}") + " }"
        texts.append(joint(f"s{n}", "prismatic", "ground", f"b{i}", lines))
    if r.random() < 0.5:
        r.shuffle(texts)
    text += "".join(texts)
    speed = max(abs(qd0[2::3]).max(), math.sqrt(np.linalg.norm(way) / d.size), abs(loops.rate_of_drive))
    mass = sum(m for _, _, m, _, _ in d.bodies)
    for _, k, child, parent in joints:
        text += output(f"w{k}", f"j{k}", "rate")
        wanted[f"w{k}"] = lambda x, c=child, p=parent: x["qd"][3 * c + 2] - (x["qd"][3 * p + 2] if p >= 0 else 0.0)
        sizes[f"w{k}"] = speed
    # The far end of the second body: it hangs on the first one.
    arm = d.local(1, d.bodies[1][0][1])
    for name, quantity, of in (("x", "position", 0), ("v", "velocity", 1), ("a", "acceleration", 2)):
        text += output(name, f"b1.{d.bodies[1][0][1]}", quantity)

        def place(x, of=of):
            c = TURN(x["q"][5]) @ arm
            n = np.array([-c[1], c[0]])
            w, e = x["qd"][5], x["qdd"][5]
            at = slice(3, 5)
            return (x["q"][at] + c, x["qd"][at] + w * n, x["qdd"][at] + e * n - w * w * c)[of]

        wanted[name] = place
        sizes[name] = d.size * speed**of
    for _, k, child, parent in joints:
        text += output(f"F{k}", f"j{k}", "reaction")
        sign = 1.0 if child == d.pins[k][0] else -1.0
        wanted[f"F{k}"] = lambda x, k=k, sign=sign: sign * x["multipliers"][2 * k : 2 * k + 2]
        sizes[f"F{k}"] = 1e3 * 1e-3 * mass * d.size * speed**2

    def follow(times, push=0.0, rtol=1e-12):
        weight = loops.weight.copy()
        loops.weight = weight * (1 + push) if not qd0.any() else weight
        qs, qds = loops.follow(q0, qd0 * (1 + push), times, rtol)
        loops.weight = weight
        rows = {name: [] for name in wanted}
        for t, q, qd in zip(times, qs, qds):
            q, G, A, B = loops.close(t, q)
            qdd, multipliers = loops.accelerations(G, A, B, qd)
            x = {"q": q, "qd": qd, "qdd": qdd, "multipliers": multipliers}
            for name, f in wanted.items():
                rows[name].append(np.atleast_1d(f(x)))
        told = {}
        for name, values in rows.items():
            values = np.array(values)
            columns = {"w": 1, "F": 6}.get(name[0], 3)
            full = np.full((len(times), columns), np.nan)
            full[:, : values.shape[1]] = values
            told[name] = full
        return told

    def truth(times):
        return follow(times)

    truth.driven = d.drive is not None
    if not d.drive:  # how far a start that is a millionth faster, or heavier, leads away
        truth.beside = lambda times: (1e-6, follow(times, 1e-6, 1e-10))
    near = f", {worst_pivot(loops, q0, 0.0):.1g} from singular"
    what = f"{'driven' if d.drive else 'free'}{', heavy' if way.any() else ''}{'' if abs(qd0).max() > 0 else ', from rest'}{near}"
    return Scene(text, truth, scales_of(sizes), what)


def beyond_reach(r):
    """Four-bar driven beyond its reach; its truth is the time at which it gets there"""
    d = four_bar(r)
    if d is None:
        return None
    w = 10 ** r.uniform(0, 2)
    d.drive = (0, lambda t: (w * t, w, 0.0))
    loops, q = d.truth((0.0, 0.0)), d.start()
    t, step = 0.0, 0.01 / w
    try:
        q0, G, _, _ = loops.close(0.0, q)
        if worst_pivot(loops, q0, 0.0) < 0.02:
            return None
    except (NotClosed, np.linalg.LinAlgError):
        return None
    q = q0
    while step > 1e-7 / w and t < 5.0 / w:
        try:
            q, t = loops.close(t + step, q)[0], t + step
        except (NotClosed, np.linalg.LinAlgError):
            step *= 0.5
    if t < 0.2 / w or t >= 5.0 / w or worst_pivot(loops, q, t) > 0.01:
        return None
    scene = write(r, d, loops, q0, loops.close_rates(G, np.zeros(loops.size)), 2.0 * t, np.zeros(2), f"{w!r}*t")
    scene.truth = t
    return scene


def named(shape):
    kind = lambda r: closed(r, shape)
    kind.__name__, kind.__doc__ = shape.__name__, shape.__doc__
    return kind


KINDS = tuple(named(s) for s in (slider_crank, four_bar, four_bar_near_change, six_bar, five_bar))
