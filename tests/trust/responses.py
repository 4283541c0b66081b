"""Frequency responses of random machines:  responses.py FLEXFRAME [--count N] [--seed S] [--kind K] [--number N] [--keep FOLDER]

Cantilevers, portals, columns, machines on springs, chains, linkages and rotors in a plane about a deflected start, frames and blocks on
bushings in space, described as an author may do it, with dampers, followers, preloads and every output that follows a force. `response`
tells amplitudes and phases; the truth are matrices of finite elements (truths/plane_elastic.py, space_frame.py) and their complex
response (truths/small_motion.py). Wrong is, without a warning: a complex amplitude that the truth has at no frequency within 1.5 %, to 5 %
of its size (of what is rigid 1e-5 and 1e-3), or a largest amplitude 10 % off. Exit 1 if there is one, or one that takes 120 s, or where
more than a tenth of the machines that are right to a third of that are warned of.
"""
import collections
import csv
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile

import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from arguments import suite_parser  # noqa: E402
from kinds.bent import PLASTIC, RUBBER, SPRING_STEEL  # noqa: E402
from kinds.plane import ALUMINIUM, STEEL, bar  # noqa: E402
from scene import beam, by_chance, force, joint, output, pick, rigid, section_of, simulation, sizes, weld  # noqa: E402
from truths.plane_machine import Machine  # noqa: E402
from truths.small_motion import SmallMotion, of_machine  # noqa: E402
from truths.space_frame import SpaceFrame, arm, axes_of  # noqa: E402

OFF, AMPLITUDE, PEAK = 0.015, 0.05, 0.1
RIGID = (1e-5, 1e-3)
LIMIT = 120  # s
G = 9.81


def chosen(r):
    """What an author may write of a beam, mostly nothing."""
    return by_chance(
        r,
        (0.5, ""),
        (0.65, lambda r: f"elements = {r.randint(2, 20)}"),
        (0.75, lambda r: f'model = "mixed"\nvolumes = {r.randint(2, 6)}'),
        (0.85, 'effects = ["axial", "bending_xy"]'),
        (0.9, lambda r: f'model = "lumped"\nelements = {r.randint(4, 30)}'),
        (1.0, lambda r: f"keep_modes = {r.randint(1, 6)}"),
    )


class Case:
    """build(elements) -> (scene's text, SmallMotion). exact: nothing bends."""

    def __init__(self, build, what, exact=False):
        self.build, self.what, self.exact = build, what, exact


# ---- machines in a plane


class Told(Machine):
    """With the force that is asked for, and readings that a frequency response has."""

    def __init__(self, gravity=(0.0, 0.0), start="static"):
        super().__init__(1.0, gravity=gravity, **({"start": start} if start else {}))

    def push(self, on, direction=None, turns=False):
        """A force along a direction, that turns with its body or not, or (without) a torque."""
        p = self.point(on)
        if direction is None:
            self.torque(on, ("0", lambda t: 0.0), name="push")
            i = 3 * p.node + 2
            self.pushed = lambda q: np.eye(len(q))[i]
            return
        d = np.array(direction, float) / np.hypot(*direction)
        self.force(on, d, ("0", lambda t: 0.0), body=turns, name="push")

        def pushed(q):
            a = q[3 * p.node + 2] if turns else 0.0
            Q = np.zeros(len(q))
            p.push(q, np.array([math.cos(a) * d[0] - math.sin(a) * d[1], math.sin(a) * d[0] + math.cos(a) * d[1]]), Q)
            return Q

        self.pushed = pushed

    def turning(self, name, frame):
        i = 3 * self.point(frame).node + 2
        start = self.pose(frame)[2]
        self.read(name, frame, "rotation", lambda t, q, v, a, l: [0.0, 0.0, q[i] - start])
        self.read(name + "_rate", frame, "angular_velocity", lambda t, q, v, a, l: [0.0, 0.0, v[i]])

    def rate(self, name, of):
        terms = self.joints[of]["terms"]
        self.read(name, of, "rate", lambda t, q, v, a, l: [sum(f * v[i] for i, f in terms)])

    def spring_force(self, name, of):
        law = self.joints[of]["torque"]
        self.read(name, of, "spring_force", lambda t, q, v, a, l: [float(law(q, v))])

    def everything(self, r, frame, name="tip"):
        """One to three readings of a frame."""
        for what in r.sample(["position", "velocity", "acceleration", "turning"], r.randint(1, 3)):
            getattr(self, what)(f"{name}_{what}", frame)

    def pair(self, what=""):
        self.plane.prepare()
        if abs(self.plane.rest()[0] - self.plane.q0)[2::3].max() > 1.0:
            raise RuntimeError("so far from the start there may be another rest")
        return self.scene(what).text, of_machine(self, self.pushed)


def dead(F):
    return repr(float(F)), lambda t: F


def direction(r):
    a = r.uniform(-math.pi, math.pi)
    return math.cos(a), math.sin(a)


def share(r):
    """Of critical damping."""
    return 10 ** r.uniform(-3, -1)


def first(m, s, L):
    return 3.516 / L**2 * math.sqrt(m["E"] * s["iz"] / (m["rho"] * s["area"]))


def cantilever(r):
    """A clamped beam at any angle with a disc at its tip, sagging under its weight or a dead load, from little to far"""
    m = pick(r, STEEL, ALUMINIUM, SPRING_STEEL, PLASTIC, RUBBER)
    L = 10 ** r.uniform(-1, 0.7)
    s, _, mass = bar(r, L, (6, 100), m)
    disc = mass * 10 ** r.uniform(-1.5, 0.5) if r.random() < 0.6 else 0.0
    stands, more, more_seed = r.uniform(-math.pi, math.pi), chosen(r), r.random()
    damping = 2 * share(r) / first(m, s, L)
    k = m["E"] * s["iz"] / L**2
    heavy, load = r.random() < 0.5, k * 10 ** r.uniform(-2, 0.3) if r.random() < 0.5 else 0.0
    way, to, turns, at = direction(r), direction(r) if r.random() < 0.7 else None, r.random() < 0.4, pick(r, "beam.tip", "beam.middle")

    def build(n):
        q = random.Random(more_seed)
        d = Told((0, -G) if heavy else (0, 0))
        d.beam("beam", L, s, m, (0, 0, stands), elements=n, damping=damping, places=[("middle", n // 2)], more=more)
        d.weld("clamp", (0, 0), "beam.root")
        if disc:
            d.rigid("disc", disc, disc * (0.05 * L) ** 2, (L * math.cos(stands), L * math.sin(stands), stands))
            d.weld("hub", "beam.tip", "disc")
        if load:
            d.force("beam.tip", way, dead(load), body=turns)
        d.push(at, to, turns)
        d.everything(q, "disc" if disc else "beam.tip")
        d.everything(q, "beam.middle", "middle")
        return d.pair()

    sag = (mass / 8 + disc / 3) * G * L * L / (m["E"] * s["iz"]) if heavy else 0.0
    return Case(build, f"sag {sag:.2g}, load {load / k:.2g} EI/L^2{' turning' if turns else ''}, {more or 'auto'}")


def column(r):
    """A clamped column under a weight on its top, up to most of its critical load"""
    m = pick(r, STEEL, ALUMINIUM, PLASTIC)
    L = 10 ** r.uniform(-1, 1)
    s, _, mass = bar(r, L, (15, 100), m)
    k = math.pi**2 * m["E"] * s["iz"] / (4 * L * L)
    load = k * r.uniform(0.05, 0.85)
    by_mass, more, damping = r.random() < 0.5, chosen(r), 2 * share(r) / first(m, s, L)
    up = pick(r, 1, 1, -1)

    def build(n):
        d = Told((0, -up * G) if by_mass else (0, 0))
        d.beam("beam", L, s, m, (0, 0, math.pi / 2), elements=n, damping=damping, places=[("middle", n // 2)], more=more)
        d.weld("clamp", (0, 0), "beam.root")
        if by_mass:
            d.rigid("top", load / G, 0.01 * load / G * L * L, (0, L, math.pi / 2))
            d.weld("seat", "beam.tip", "top")
        else:
            d.force("beam.tip", (0, -up), dead(load))
        d.push("beam.tip", (1, 0))
        d.position("tip", "beam.tip")
        d.acceleration("middle", "beam.middle")
        d.turning("turn", "beam.tip")
        return d.pair()

    return Case(build, f"{up * load / k:.2g} of the critical {'weight' if by_mass else 'load'}, {more or 'auto'}")


def portal(r):
    """A portal frame with weight on its bar, a force or torque on it anywhere"""
    m = pick(r, STEEL, ALUMINIUM, PLASTIC)
    H = 10 ** r.uniform(-0.7, 1)
    s, _, mass = bar(r, H, (8, 60), m)
    B, feet, more = H * r.uniform(0.6, 2), pick(r, "weld", "revolute"), chosen(r)
    damping = 2 * share(r) / first(m, s, H)
    load = 0.25 * math.pi**2 * m["E"] * s["iz"] / H**2 * r.uniform(0, 0.6)
    on, way, seed = pick(r, "left.tip", "bar.middle", "right.root"), direction(r) if r.random() < 0.8 else None, r.random()

    def build(n):
        q = random.Random(seed)
        d = Told()
        for name, length, at in (("left", H, (0, 0, math.pi / 2)), ("bar", B, (0, H, 0)), ("right", H, (B, H, -math.pi / 2))):
            d.beam(name, length, s, m, at, elements=n // 2, damping=damping, places=[("middle", n // 4)], more=more)
        getattr(d, feet)("a", (0, 0), "left.root")
        d.weld("c", "left.tip", "bar.root")
        d.weld("e", "bar.tip", "right.root")
        getattr(d, feet)("b", (B, 0), "right.tip")
        d.force("bar.root", (0, -1), dead(load))
        d.force("bar.tip", (0, -1), dead(load))
        d.push(on, way)
        d.everything(q, "bar.middle", "middle")
        d.everything(q, "left.tip", "corner")
        d.distance("wide", "left.middle", "right.middle")
        return d.pair()

    return Case(build, f"{feet} feet, {more or 'auto'}")


def on_springs(r):
    """A machine's bed on two to four springs and dampers between points, an elastic post with a weight on it, at rest under gravity"""
    m = pick(r, STEEL, ALUMINIUM)
    W = 10 ** r.uniform(-1, 0.7)
    mass = 10 ** r.uniform(-1, 3)
    hertz = 10 ** r.uniform(0, 1.5)
    k, z = mass * (2 * math.pi * hertz) ** 2 / 2, share(r)
    count, post = r.randint(2, 4), r.random() < 0.6
    L = W * r.uniform(0.5, 2)
    s, _, _ = bar(r, L, (10, 60), m)
    more, way, seed, sag = chosen(r), direction(r) if r.random() < 0.7 else None, r.random(), mass * G / (2 * k)
    places = [(W * r.uniform(-1, 1), -W * r.uniform(0.3, 1)) for _ in range(count)]
    feet = [((-1) ** i * W * r.uniform(0.3, 0.5), -0.1 * W) for i in range(count)]
    joined = pick(r, "free", "guide")

    def build(n):
        q = random.Random(seed)
        d = Told((0, -G), "static")
        frames = {f"foot{i}": feet[i] for i in range(count)} | {"seat": (0.1 * W, 0.1 * W)}
        d.rigid("bed", mass, mass * W * W / 12, (0, 0, 0), frames=frames)
        if joined == "guide":
            d.prismatic("guide", (0, 0), "bed", (0, 1))
        for i in range(count):
            at = (feet[i][0], places[i][1] - 0.1 * W) if i < 2 else places[i]
            rest = math.hypot(at[0] - feet[i][0], at[1] - feet[i][1])
            if i < 2:
                rest += sag
            d.spring(f"spring{i}", f"bed.foot{i}", at, k, 2 * z * k / (2 * math.pi * hertz), rest)
            d.force_of(f"pull{i}", f"spring{i}")
        if joined == "free":  # something holds it aside
            d.parts.append(joint("plane", "planar", "ground", "bed"))
            d.spring("aside", "bed", (-2 * W, 0.0), k, 0.0, 2 * W)
        if post:
            d.beam("post", L, s, m, (0.1 * W, 0.1 * W, 1.2), elements=n, damping=2 * z / first(m, s, L), more=more)
            d.weld("bolt", "bed.seat", "post.root")
            d.rigid("weight", 0.1 * mass, 1e-3 * mass * L * L, (0.1 * W + L * math.cos(1.2), 0.1 * W + L * math.sin(1.2), 1.2))
            d.weld("top", "post.tip", "weight")
            d.everything(q, "weight", "weight")
        d.push("bed.foot0" if way else "bed", way)
        d.everything(q, "bed.seat", "bed")
        return d.pair()

    return Case(build, f"{count} springs, {joined}{f', a post, {more}' if post else ''}", exact=not post)


def chain(r):
    """Rods on hinges with springs and dampers hang, stand or are drawn aside by a dead load, rigid or elastic"""
    count, L = r.randint(1, 4), 10 ** r.uniform(-1, 0.7)
    m = pick(r, STEEL, ALUMINIUM, PLASTIC)
    s, _, mass = bar(r, L, (15, 60), m)
    elastic = r.random() < 0.5
    soft = [10 ** r.uniform(-1, 1.5) * mass * G * L if r.random() < 0.7 else 0.0 for _ in range(count)]
    z, more = share(r), chosen(r)
    load = mass * G * r.uniform(0, 2)
    way, to, seed, turns = direction(r), direction(r) if r.random() < 0.7 else None, r.random(), r.random() < 0.3
    w = math.sqrt(G / L)

    def build(n):
        q = random.Random(seed)
        d = Told((0, -G))
        x, y, before = 0.0, 0.0, (0.0, 0.0)
        for i in range(count):
            a = -math.pi / 2 + 0.3 * q.uniform(-1, 1)
            if elastic:
                d.beam(f"rod{i}", L, s, m, (x, y, a), elements=max(n // 2, 6), damping=2 * z / first(m, s, L), more=more)
            else:
                d.rigid(f"rod{i}", mass, mass * L * L / 12, (x, y, a), centre=(L / 2, 0), frames={"root": (0, 0), "tip": (L, 0)})
            damper = 0.05 * mass * L * L * w
            d.revolute(f"hinge{i}", before, f"rod{i}.root", spring=(soft[i], damper))
            x, y, before = x + L * math.cos(a), y + L * math.sin(a), f"rod{i}.tip"
        d.force(before, way, dead(load), body=turns)
        d.push(pick(q, before, "rod0.tip"), to, turns)
        d.everything(q, before)
        for i in range(count):
            getattr(d, pick(q, "value", "rate", "spring_force"))(f"hinge{i}", f"hinge{i}")
        return d.pair()

    return Case(build, f"{count} {'elastic' if elastic else 'rigid'} rods, {more if elastic else ''}", exact=not elastic)


def linkage(r):
    """A four-bar or slider-crank held by a spring in its crank, at rest under weight and a load, its coupler rigid or elastic"""
    a = 10 ** r.uniform(-1, 0.3)
    b = a * r.uniform(1.8, 3)
    m = pick(r, STEEL, ALUMINIUM)
    s, _, mass = bar(r, b, (15, 60), m)
    elastic, slides, more, z = r.random() < 0.5, r.random() < 0.5, chosen(r), share(r)
    k, start, c = mass * G * a * 10 ** r.uniform(0.5, 2), r.uniform(0.4, 1.3), a * r.uniform(1.2, 2)
    load, to, seed = mass * G * r.uniform(-1, 1), direction(r), r.random()
    w = math.sqrt(k / (mass * a * a))

    def build(n):
        q = random.Random(seed)
        d = Told((0, -G))
        x, y = a * math.cos(start), a * math.sin(start)
        d.rigid("crank", 0.4 * mass, 0.03 * mass * a * a, (0, 0, start), centre=(a / 2, 0), frames={"pin": (a, 0)})
        d.revolute("shaft", (0, 0), "crank", spring=(k, 2 * z * k / w))
        turn = -math.asin(y / b) if slides else 0.2
        ex, ey = x + b * math.cos(turn), y + b * math.sin(turn)
        if elastic:
            d.beam("rod", b, s, m, (x, y, turn), elements=n, damping=2 * z / first(m, s, b), places=[("middle", n // 2)], more=more)
        else:
            d.rigid(
                "rod",
                mass,
                mass * b * b / 12,
                (x, y, turn),
                centre=(b / 2, 0),
                frames={"root": (0, 0), "middle": (b / 2, 0), "tip": (b, 0)},
            )
        d.revolute("pin", "crank.pin", "rod.root")
        if slides:
            d.rigid("slider", mass, mass * a * a, (ex, ey, 0))
            d.revolute("wrist", "rod.tip", "slider")
            d.prismatic("guide", (0, ey), "slider", (1, 0))
            d.force("slider", (1, 0), dead(load))
            d.value("way", "guide")
            d.push(pick(q, "slider", "rod.middle"), (1, 0.3))
        else:
            d.rigid("rocker", mass, mass * c * c / 12, (ex, ey, -1.4), centre=(c / 2, 0), frames={"foot": (c, 0)})
            d.revolute("wrist", "rod.tip", "rocker")
            d.revolute("pivot", (ex + c * math.cos(-1.4), ey + c * math.sin(-1.4)), "rocker.foot")
            d.force("rod.tip", (1, 0), dead(load))
            d.value("way", "pivot")
            d.push(pick(q, "rod.tip", "rod.middle"), to)
        d.everything(q, "rod.middle", "middle")
        d.spring_force("torque", "shaft")
        d.rate("speed", "shaft")
        return d.pair()

    return Case(build, f"{'slider-crank' if slides else 'four-bar'}, {f'elastic rod, {more}' if elastic else 'rigid'}", exact=not elastic)


def train(r):
    """Rotors with torsion springs and gears between them, one of them held by its drive or free"""
    count, J = r.randint(2, 4), 10 ** r.uniform(-4, 2)
    k = J * (2 * math.pi * 10 ** r.uniform(0, 2)) ** 2
    z, held, ratio, seed = share(r), r.random() < 0.5, r.uniform(0.3, 3) * pick(r, 1, -1), r.random()

    def build(n):
        q = random.Random(seed)
        d = Told(start=None)
        before = (0.0, 0.0)
        for i in range(count):
            d.rigid(f"wheel{i}", 1.0, J * q.uniform(0.2, 3), (0.0, 0.0, 0.0))
            soft = (k * q.uniform(0.3, 3), z * k / 100) if i or held else None
            d.revolute(f"shaft{i}", before, f"wheel{i}", spring=soft)
            before = f"wheel{i}"
        d.rigid("gear", 1.0, J, (1.0, 0.0, 0.0))
        d.revolute("other", (1.0, 0.0), "gear")
        d.gear("shaft0", "other", ratio)
        d.push(f"wheel{count - 1}")
        for i in range(count):
            getattr(d, pick(q, "value", "rate"))(f"angle{i}", f"shaft{i}")
        d.turning("gear", "gear")
        d.spring_force("torque", f"shaft{count - 1}")
        return d.pair()

    return Case(build, f"{count} rotors and a gear, {'held' if held else 'free'}", exact=True)


# ---- in space


def space_frame(r):
    """Beams welded to one another at any angle in space, discs beside their ends, springs and dampers to the ground, any load and output"""
    count = r.randint(1, 3)
    length, m, s = sizes(r, slender=(5, 60), shapes=("rectangle", "circle", "tube", "box", "general"))
    z, seed, kind = share(r), r.random(), pick(r, "force", "torque", "along", "body")
    plane = r.random() < 0.3
    words = [chosen_in_space(r) for _ in range(count)]

    def build(n):
        q = random.Random(seed)
        frame = SpaceFrame()
        places, axes, ends = [np.zeros(3)], [np.eye(3)], [frame.node((0, 0, 0))]
        frame.hold(ends[0])
        D = []  # (node, 6 x 6)
        text, lines = "", []
        for k in range(count):
            L = length * q.uniform(0.5, 1.0)
            turn = [0.0, 0.0, q.uniform(-2, 2)] if plane else [q.uniform(-1.5, 1.5) for _ in range(3)]
            R = axes[-1] @ axes_of(turn)
            place = places[-1] + R @ [L, 0, 0]
            tip = frame.node(place)
            lines.append(frame.beam(ends[-1], tip, s, m, R, elements=n // 2))
            places.append(place), axes.append(R), ends.append(tip)
            text += beam(f"b{k}", L, s["text"], m, words[k] + "damping = { stiffness = %BETA% }\nframes = { middle = 0.5 }")
            text += weld(f"w{k}", "ground" if k == 0 else f"b{k - 1}.tip", f"b{k}.root", f"rotation = {turn}")
        elastic = frame.matrices()[0]
        tip, R = ends[-1], axes[-1]
        mass = m["rho"] * s["area"] * length * 10 ** q.uniform(-1.5, 0.5)
        centre = np.zeros(3) if q.random() < 0.5 else 0.1 * length * np.array([q.gauss(0, 1), q.gauss(0, 1), 0 if plane else q.gauss(0, 1)])
        J = mass * (0.1 * length) ** 2 * np.array([1.0, 1.2, 1.4])
        if q.random() < 0.6:
            frame.body(tip, mass, R @ np.diag(J) @ R.T, R @ centre)
            text += rigid("disc", mass, J, centre=centre) + weld("hub", f"b{count - 1}.tip", "disc")
        stiff = m["E"] * s["iz"] / length**3
        if q.random() < 0.5:  # a bushing to the ground at the tip, in the world's axes
            k = [stiff * 10 ** q.uniform(-1, 1) for _ in range(3)]
            c = [0.05 * x * math.sqrt(m["rho"] * s["area"] * length / stiff) for x in k]
            frame.spring(tip, np.diag(k))
            D.append((tip, np.diag([*c, 0, 0, 0])))
            where = [float(x) for x in places[-1]]
            text = f"[ground]\nframes = {{ post = {where} }}\n\n" + text
            text += f'[[force]]\nkind = "bushing"\non = "b{count - 1}.tip"\nfrom = "ground.post"\n'
            text += f"stiffness = {[*k, 0, 0, 0]}\ndamping = {[*c, 0, 0, 0]}\n\n"
        K, M, free = frame.matrices()
        hertz = np.sqrt(np.abs(np.linalg.eigvals(np.linalg.solve(M[np.ix_(free, free)], K[np.ix_(free, free)])))) / (2 * np.pi)
        beta = z / (np.pi * np.sort(hertz)[1])
        C = beta * elastic
        for node, c in D:
            C[6 * node : 6 * node + 6, 6 * node : 6 * node + 6] += c
        d = np.array([q.gauss(0, 1), q.gauss(0, 1), 0.0 if plane and kind != "torque" else q.gauss(0, 1)])
        if plane and kind == "torque":
            d[:2] = 0
        d /= np.linalg.norm(d)
        on = pick(q, "tip", "middle")
        node = tip if on == "tip" else lines[-1][n // 4]
        if kind == "along":
            f = frame.along(lines[-1], d)
            push = force("distributed", f"b{count - 1}", "0", d, 'name = "push"')
        elif kind == "torque":
            f = frame.at(node, moment=d)
            push = force("torque", f"b{count - 1}.{on}", "0", d, 'name = "push"')
        elif kind == "body":
            f = frame.at(node, force=R @ d)
            push = force("force", f"b{count - 1}.{on}", "0", d, 'name = "push"\nframe = "body"')
        else:
            f = frame.at(node, force=d)
            push = force("force", f"b{count - 1}.{on}", "0", d, 'name = "push"')
        names, rows = [], {k: [] for k in "ABC"}
        for i in range(q.randint(2, 4)):
            b, where = q.randrange(count), pick(q, "tip", "middle")
            here = ends[b + 1] if where == "tip" else lines[b][n // 4]
            quantity, key, at = pick(
                q,
                ("position", "A", 0),
                ("velocity", "B", 0),
                ("acceleration", "C", 0),
                ("rotation", "A", 3),
                ("angular_velocity", "B", 3),
            )
            if quantity == "rotation":  # of small motions only where the body is not turned at rest; else seen from its own start
                quantity, key = "angular_velocity", "B"
            text += output(f"o{i}", f"b{b}.{where}", quantity)
            for j, axis in enumerate("xyz"):
                names.append(f"o{i}.{axis}")
                for letter in "ABC":
                    row = np.zeros(len(K))
                    row[6 * here + at + j] = letter == key
                    rows[letter].append(row[free])
        i = np.ix_(free, free)
        text = simulation(1.0, 10) + text.replace("%BETA%", repr(float(beta))) + push
        return text, SmallMotion(M[i], C[i], K[i], f[free], names, *(np.array(rows[k]) for k in "ABC"))

    said = " | ".join(w.strip() or "auto" for w in words)
    return Case(build, f"{count} beams{' in a plane' if plane else ''}, {kind}, {said}")


def chosen_in_space(r):
    return by_chance(
        r,
        (0.5, ""),
        (0.65, lambda r: f"elements = {r.randint(2, 30)}\n"),
        (0.8, 'effects = ["bending_xy", "bending_xz", "axial", "torsion"]\n'),
        (0.85, 'effects = ["bending_xy", "bending_xz", "axial", "torsion", "shear"]\n'),
        (0.9, lambda r: f'model = "mixed"\nvolumes = {r.randint(2, 5)}\n'),
        (0.95, lambda r: f"keep_modes = {r.randint(1, 6)}\n"),
        (1.0, 'model = "modal"\nmodes = { bending_xy = [1, 2, 3], bending_xz = [1, 2, 3], axial = [1], torsion = [1] }\n'),
    )


def block(r):
    """A rigid block in space on three to five bushings with dampers, its weight beside them, an absorber on it"""
    size, mass = 10 ** r.uniform(-1, 0.5), 10 ** r.uniform(-1, 3)
    hertz, z, count, seed = 10 ** r.uniform(0, 2), share(r), r.randint(3, 5), r.random()
    absorber = r.random() < 0.5

    def build(n):
        q = random.Random(seed)
        centre = 0.2 * size * np.array([q.gauss(0, 1) for _ in range(3)])
        J = mass * size**2 * np.array([0.1, 0.12, 0.15])
        M, K, C = np.zeros((7, 7)), np.zeros((7, 7)), np.zeros((7, 7))
        X = arm(centre)
        M[:6, :6] = X.T @ np.diag([mass] * 3 + list(J)) @ X
        k0 = mass * (2 * math.pi * hertz) ** 2 / count
        places = [size * np.array([q.uniform(-1, 1) for _ in range(3)]) for _ in range(count)]
        frames = {f"f{i}": p for i, p in enumerate(places)} | {"at": size * np.array([q.uniform(-1, 1) for _ in range(3)])}
        text = simulation(1.0, 10)
        text += "[ground]\nframes = { " + ", ".join(f"g{i} = {[float(x) for x in p]}" for i, p in enumerate(places)) + " }\n\n"
        text += rigid("block", mass, J, frames=frames, centre=centre) + joint("free", "free", "ground", "block")
        for i, p in enumerate(places):
            k = [k0 * 10 ** q.uniform(-0.5, 0.5) for _ in range(3)]
            k = np.array(k + [k0 * size**2 * 10 ** q.uniform(-2, -1) for _ in range(3)])
            c = 2 * z / (2 * math.pi * hertz) * k * [q.uniform(0, 2) for _ in range(6)]
            X = arm(p)
            K[:6, :6] += X.T @ np.diag(k) @ X
            C[:6, :6] += X.T @ np.diag(c) @ X
            text += f'[[force]]\nname = "bushing{i}"\nkind = "bushing"\non = "block.f{i}"\nfrom = "ground.g{i}"\n'
            text += f"stiffness = {[float(x) for x in k]}\ndamping = {[float(x) for x in c]}\n\n"
        at = frames["at"]
        Y = arm(at)
        d = np.array([q.gauss(0, 1) for _ in range(3)])
        d /= np.linalg.norm(d)
        if absorber:  # a mass on a slide at `at` along d; the 7th coordinate is its way along it
            ma, ka = 0.05 * mass, 0.05 * mass * (2 * math.pi * hertz * q.uniform(0.5, 1.5)) ** 2
            ca = 2 * 0.05 * math.sqrt(ma * ka)
            row = np.zeros((3, 7))
            row[:, :6], row[:, 6] = Y[:3], d
            M += ma * row.T @ row
            K[6, 6], C[6, 6] = ka, ca
            text += rigid("absorber", ma, (0, 0, 0)) + joint(
                "slide",
                "prismatic",
                "block.at",
                "absorber",
                f"axis = {[float(x) for x in d]}\nspring = {{ stiffness = {ka!r}, damping = {ca!r} }}\n",
            )
        else:
            M, K, C = M[:6, :6], K[:6, :6], C[:6, :6]
        n = len(M)
        e = np.array([q.gauss(0, 1) for _ in range(3)])
        e /= np.linalg.norm(e)
        turns = q.random() < 0.4
        f = np.zeros(n)
        f[:6] = Y.T @ np.r_[np.zeros(3), e] if turns else Y.T @ np.r_[e, np.zeros(3)]
        text += force("torque" if turns else "force", "block.at", "0", e, 'name = "push"')
        names, A, B, D = [], [], [], []
        W = [row_of(Y[i], n) for i in range(6)]
        O = [row_of(np.eye(6)[i], n) for i in range(6)]
        zero = [np.zeros(n)] * 3
        for name, of, quantity, rows, key in (
            ("p", "block.at", "position", W[:3], "A"),
            ("v", "block", "velocity", O[:3], "B"),
            ("a", "block.at", "acceleration", W[:3], "C"),
            ("r", "block", "rotation", O[3:], "A"),
            ("w", "block.at", "angular_velocity", O[3:], "B"),
        ):
            text += output(name, of, quantity)
            names += [f"{name}.{x}" for x in "xyz"]
            A += rows if key == "A" else zero
            B += rows if key == "B" else zero
            D += rows if key == "C" else zero
        if absorber:
            for name, quantity, a, b in (("s", "value", 1, 0), ("t", "rate", 0, 1), ("u", "spring_force", -K[6, 6], -C[6, 6])):
                text += output(name, "slide", quantity)
                names.append(name)
                A.append(a * np.eye(n)[6]), B.append(b * np.eye(n)[6]), D.append(np.zeros(n))
        return text, SmallMotion(M, C, K, f, names, np.array(A), np.array(B), np.array(D))

    return Case(build, f"{count} bushings{', an absorber' if absorber else ''}", exact=True)


def row_of(row, n):
    return np.r_[row, np.zeros(n - len(row))]


KINDS = [cantilever, column, portal, on_springs, chain, linkage, train, space_frame, block]


# ---- the verdict


def groups_of(names):
    """Rows of each output."""
    out = {}
    for k, name in enumerate(names):
        out.setdefault(name.partition(".")[0], []).append(k)
    return list(out.values())


class Truth:
    """A motion's response about frequencies that are asked for, `off` to each side, and about the poles between them."""

    def __init__(self, motion, hertz, off, poles):
        near = [f * (1 + off * np.linspace(-1, 1, 15)) for f in hertz]
        for p in poles:
            f, wide = p.imag / (2 * np.pi), max(-p.real / (2 * np.pi), 1e-7 * p.imag)
            near.append(f + wide * np.sinh(np.linspace(-5, 5, 41)))
        grid = np.unique(np.concatenate(near))
        self.hertz, self.off, self.names = hertz, off, motion.names
        self.grid = grid[(grid >= hertz[0] * (1 - off)) & (grid <= hertz[-1] * (1 + off))]
        self.values, self.at = motion(self.grid), motion(hertz)
        log = np.log(np.maximum(abs(self.values), 1e-300))
        wide = [slice(*np.searchsorted(self.grid, (f / 1.4, f * 1.4))) for f in hertz]
        self.mean = np.array([np.exp(log[w].mean(axis=0)) for w in wide])

    def compare(self, values):
        """Largest error over its size: (error, where)."""
        worst, off = (0.0, ""), self.off
        for rows in groups_of(self.names):
            size = np.linalg.norm(self.values[:, rows], axis=1)
            for i, f in enumerate(self.hertz):
                here = slice(*np.searchsorted(self.grid, (f * (1 - off) * (1 - 1e-12), f * (1 + off) * (1 + 1e-12))))
                for k in rows:
                    line = self.values[here, k]
                    unit = max(abs(line).max(), 0.02 * size[here].max(), 0.3 * self.mean[i, k])
                    gap = to_line(values[i, k], line) / unit
                    if gap > worst[0]:
                        worst = (gap, f"{self.names[k]} at {f:.5g} Hz: {abs(values[i, k]):.4g} for {abs(self.at[i, k]):.4g}")
        return worst

    def largest(self):
        """Amplitude within the range, of each name."""
        inside = (self.grid >= self.hertz[0]) & (self.grid <= self.hertz[-1])
        return abs(self.values[inside]).max(axis=0)


def to_line(point, line):
    """Distance of a complex number from a line through several."""
    if len(line) == 1:
        return abs(point - line[0])
    a, d = line[:-1], np.diff(line)
    t = np.clip(((point - a) * d.conj()).real / np.maximum(abs(d) ** 2, 1e-300), 0, 1)
    return abs(point - a - t * d).min()


def judge(program, case, folder, r, elements=16):
    """(verdict, what)."""
    try:
        text, rough = case.build(elements)
        motion = rough if case.exact else case.build(2 * elements)[1]
    except (RuntimeError, np.linalg.LinAlgError) as problem:
        return "open", str(problem)
    if not motion.stable():
        return "open", "the truth's rest is unstable"
    poles = motion.poles()
    off, amplitude = RIGID if case.exact else (OFF, AMPLITUDE)
    vibrations = [p.imag / (2 * np.pi) for p in poles]
    if not vibrations:
        vibrations = [1.0]
    low = vibrations[0] * 10 ** r.uniform(-1.3, -0.1)
    high = vibrations[min(len(vibrations) - 1, r.randint(0, 7))] * r.uniform(1.05, 1.6)
    scene, table = folder / "r.toml", folder / "r.csv"
    scene.write_text(text)
    words = [program, "response", scene, "--force", "push", "--from", low, "--to", high, "--points", 50, "-o", table, "--json"]
    try:
        done = subprocess.run(list(map(str, words)), capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=LIMIT)
    except subprocess.TimeoutExpired:
        return "slow", f"more than {LIMIT} s"
    if done.returncode:
        return "refused", done.stderr.strip()
    told = json.loads(done.stdout)
    rows = list(csv.reader(table.open()))
    data = np.array(rows[1:], float)
    hertz, head = data[:, 0], rows[0]
    names = motion.names
    missing = [n for n in names if n not in head]
    if missing:
        return "refused", f"no columns {missing}"
    at = [head.index(n) for n in names]
    values = data[:, at] * np.exp(1j * np.radians(data[:, [i + 1 for i in at]]))
    near = [p for p in poles if hertz[0] * (1 - 2 * off) <= p.imag / (2 * np.pi) <= hertz[-1] * (1 + 2 * off)]
    undamped = [p for p in near if -p.real < 1e-8 * abs(p)]
    keep = np.array([all(abs(f - p.imag / (2 * np.pi)) > 1e-6 * f for p in undamped) for f in hertz])
    hertz, values = hertz[keep], values[keep]
    truth = Truth(motion, hertz, off, near)
    if not case.exact:
        unsure, where = truth.compare(rough(hertz))
        if unsure > AMPLITUDE / 4:
            return "open", f"two truths differ by {unsure:.2g}: {where}"
    worst, where = truth.compare(values)
    wrong = [f"{worst:.2g} of {where}"] if worst > amplitude else []
    peak = 0.0
    if not undamped and not any(abs(p.imag / (2 * np.pi) / f - 1) < 2 * off for p in near for f in (hertz[0], hertz[-1])):
        biggest = {o["column"]: o["largest"] for o in told["outputs"]}
        most = truth.largest()
        for group in groups_of(names):
            for k in group:
                if most[k] > 0.02 * max(most[group]):
                    peak = max(peak, abs(biggest[names[k]] / most[k] - 1))
    if peak > PEAK:
        wrong.append(f"largest {peak:.2g} off")
    warnings = [w for w in told["warnings"] if not (undamped and "without damping" in w)]
    note = f"{worst:.1e}, peak {peak:.1e}, {len(near)} resonances"
    if wrong:
        return ("warned" if warnings else "silent"), "; ".join(wrong) + (f": {warnings[0][:200]}" if warnings else "")
    if warnings and max(worst / amplitude, peak / PEAK) < 1 / 3:
        return "alarm", f"{note}: {warnings[0][:200]}"
    return "right", note + (f", warned: {warnings[0][:100]}" if warnings else "")


def main():
    parser = suite_parser(__doc__, "number", "keep", count=63)
    parser.add_argument("--kind", default="")
    args = parser.parse_args()
    counts = collections.Counter()
    kinds = [k for k in KINDS if not args.kind or k.__name__ == args.kind]
    for number in range(args.count) if args.number is None else [args.number]:
        kind = kinds[number % len(kinds)]
        r = random.Random(f"response {kind.__name__} {args.seed} {number}")
        case = kind(r)
        with tempfile.TemporaryDirectory(prefix="flexframe_responses_") as folder:
            folder = pathlib.Path(folder)
            verdict, what = judge(args.program, case, folder, r)
            if args.keep and verdict in ("silent", "refused", "alarm"):
                args.keep.mkdir(parents=True, exist_ok=True)
                (args.keep / f"{kind.__name__}_{args.seed}_{number}.toml").write_text(case.build(16)[0])
        counts[verdict] += 1
        print(f"{verdict:8} {kind.__name__} {args.seed}/{number}: {case.what}: {what}".replace("\n", " "), flush=True)
    print(", ".join(f"{n} {v}" for v, n in counts.items()))
    sound = counts["right"] + counts["alarm"]
    sys.exit(1 if counts["silent"] or counts["slow"] or counts["alarm"] > 0.1 * max(sound, 10) else 0)


if __name__ == "__main__":
    main()
