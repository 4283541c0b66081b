"""A mechanism in the plane told once: the scene's text, and the equations of plane_elastic.py that are its truth."""
import math

import numpy as np

from truths import plane_elastic
from truths.plane_elastic import Plane, Point
from scene import Scene, force, joint, material, simulation


def text_of(v):
    return repr(float(v))


class Machine:
    """Bodies are put where they start, (x, y, angle) of their frames; joints then need no numbers."""

    def __init__(self, duration, samples=120, gravity=(0.0, 0.0), **more):
        self.head = simulation(duration, samples / duration, (*gravity, 0.0), **more)
        self.duration, self.samples = duration, samples
        self.plane = Plane(gravity)
        self.parts, self.bodies, self.readings, self.joints, self.springs = [], {}, {}, {}, {}

    # ---- bodies

    def rigid(self, name, mass, J, at, centre=(0.0, 0.0), frames=None):
        x, y, a = at
        c, s = math.cos(a), math.sin(a)
        node = self.plane.node(x + c * centre[0] - s * centre[1], y + s * centre[0] + c * centre[1], a, mass, J)
        frames = {"": (0.0, 0.0), **(frames or {})}
        self.bodies[name] = {
            "at": at,
            "points": {k: (node, (v[0] - centre[0], v[1] - centre[1])) for k, v in frames.items()},
        }
        listed = ", ".join(f"{k} = [{text_of(v[0])}, {text_of(v[1])}, 0.0]" for k, v in frames.items() if k)
        # The thinnest body that has this J: nothing turns out of the plane.
        self.parts.append(
            f'[[body]]\nname = "{name}"\nkind = "rigid"\nmass = {text_of(mass)}\ninertia = [{text_of(J / 2)}, {text_of(J / 2)}, '
            f"{text_of(J)}]\ncentre_of_mass = [{text_of(centre[0])}, {text_of(centre[1])}, 0.0]\nframes = {{ {listed} }}\n\n"
        )

    def beam(self, name, length, s, m, at, elements=8, damping=0.0, places=(), more=""):
        """s: a section of scene.section_of. places: multiples of 1/elements with names. damping: s, of the strain rates."""
        x, y, a = at
        G = m["E"] / (2 * (1 + m["poisson"]))
        h = length / elements
        nodes = [self.plane.node(x + i * h * math.cos(a), y + i * h * math.sin(a), a) for i in range(elements + 1)]
        first = len(self.plane.beams)
        for i, j in zip(nodes, nodes[1:]):
            self.plane.element(
                i,
                j,
                h,
                m["E"] * s["area"],
                G * s["area"] * s["shear_y"],
                m["E"] * s["iz"],
                m["rho"] * s["area"],
                m["rho"] * s["iz"],
                damping,
            )
        points = {"": (nodes[0], (0, 0)), "root": (nodes[0], (0, 0)), "tip": (nodes[-1], (0, 0))}
        for k, i in places:
            points[k] = (nodes[i], (0, 0))
        self.bodies[name] = {"at": at, "points": points, "first": first, "elements": elements, "section": s, "length": length}
        listed = ", ".join(f"{k} = {text_of(i / elements)}" for k, i in places)
        lines = f"damping = {{ stiffness = {text_of(damping)} }}\n" if damping else ""
        self.parts.append(
            f'[[body]]\nname = "{name}"\nkind = "beam"\nlength = {text_of(length)}\nsection = {s["text"]}\nmaterial = {material(m)}\n'
            f"{lines}{f'frames = {{ {listed} }}' if listed else ''}\n{more}\n\n"
        )

    def point(self, frame):
        if isinstance(frame, tuple):
            return Point(None, frame)
        body, _, place = frame.partition(".")
        return Point(*self.bodies[body]["points"][place])

    def pose(self, frame):
        """(x, y, angle) at the start."""
        if isinstance(frame, tuple):
            return (*frame, 0.0)
        p = self.point(frame)
        q = np.array(self.plane.start, float).ravel()
        return (*p.at(q), self.bodies[frame.partition(".")[0]]["at"][2])

    # ---- joints. Parents are frames, or places (x, y) of the ground.

    def _joint(self, name, kind, parent, child, turn, more, rows):
        ground = isinstance(parent, tuple)
        assert kind == "prismatic" or np.allclose(self.pose(parent)[:2], self.pose(child)[:2], atol=1e-9), f"{name} does not fit"
        lines = f"position = [{text_of(parent[0])}, {text_of(parent[1])}, 0.0]\n" if ground else ""
        lines += f"rotation = [0.0, 0.0, {text_of(turn)}]\n" if turn else ""
        self.parts.append(joint(name, kind, "ground" if ground else parent, child, lines + more))
        self.joints[name] = {"child": child, "parent": parent, **rows}

    def revolute(self, name, parent, child, motion=None, spring=None, stop=None, more=""):
        """motion: (text, function) of t, beginning at 0: what the joint turns from its start. spring: (stiffness, damping), at rest at the
        start. stop: (upper, stiffness, damping), from the start; it never pulls."""
        p, c = self.point(parent), self.point(child)
        turn = self.pose(child)[2] - self.pose(parent)[2]
        rows = {"pin": self.plane.pin(c, p)}
        terms = [(3 * c.node + 2, 1.0)] + ([(3 * p.node + 2, -1.0)] if p.node is not None else [])
        if motion:
            rows["angle"] = self.plane.linear(terms, lambda t: turn + motion[1](t))
            more += f'motion = "{motion[0]}"\n'
        if spring or stop:
            rows["torque"] = self._turning(terms, turn, spring or (0.0, 0.0), stop)
        if spring:
            more += f"spring = {{ stiffness = {text_of(spring[0])}, damping = {text_of(spring[1])} }}\n"
        if stop:
            more += f"stop = {{ upper = {text_of(stop[0])}, stiffness = {text_of(stop[1])}, damping = {text_of(stop[2])} }}\n"
        rows["terms"], rows["turn"] = terms, turn
        self._joint(name, "revolute", parent, child, turn, more, rows)

    def _turning(self, terms, turn, spring, stop):
        def torque(q, v):
            angle = sum(f * q[..., i] for i, f in terms) - turn
            rate = sum(f * v[..., i] for i, f in terms)
            M = -spring[0] * angle - spring[1] * rate
            if stop:
                deep = angle - stop[0]
                on = (deep.real > 0) if np.iscomplexobj(deep) else deep > 0
                push = stop[1] * deep + stop[2] * rate
                M = M - np.where(on & (push.real > 0), push, 0.0)  # it never pulls
            return M

        def load(t, q, v, Q):
            M = torque(q, v)
            for i, f in terms:
                Q[..., i] += f * M

        self.plane.loads.append(load)
        return torque

    def weld(self, name, parent, child, more=""):
        p, c = self.point(parent), self.point(child)
        turn = self.pose(child)[2] - self.pose(parent)[2]
        terms = [(3 * c.node + 2, 1.0)] + ([(3 * p.node + 2, -1.0)] if p.node is not None else [])
        self._joint(
            name, "weld", parent, child, turn, more, {"pin": self.plane.pin(c, p), "angle": self.plane.linear(terms, lambda t: turn)}
        )

    def prismatic(self, name, parent, child, direction, motion=None, spring=None, more=""):
        """Slides along `direction` (parent's axes) through where the child starts; the way is counted from there."""
        p, c = self.point(parent), self.point(child)
        x, y, a = self.pose(parent)
        cx, cy, ca = self.pose(child)
        turn = ca - a
        d = np.array(direction, float) / np.hypot(*direction)
        away = np.array([cx - x, cy - y])
        away = np.array([math.cos(a) * away[0] + math.sin(a) * away[1], -math.sin(a) * away[0] + math.cos(a) * away[1]])
        here = Point(p.node, p.offset + away)
        rows = {"side": self.plane.slide(c, here, d), "normal": (d, p.node)}
        terms = [(3 * c.node + 2, 1.0)] + ([(3 * p.node + 2, -1.0)] if p.node is not None else [])
        rows["angle"] = self.plane.linear(terms, lambda t: turn)
        rows["way"] = (c, here, d)
        if motion:
            assert p.node is None and abs(abs(d).max() - 1) < 1e-12 and not c.offset.any()
            k = int(abs(d[1]) > 0.5)
            start = (cx, cy)[k]
            rows["drive"] = self.plane.linear([(3 * c.node + k, float(d[k]))], lambda t: start * d[k] + motion[1](t))
            more += f'motion = "{motion[0]}"\n'
        if spring:
            assert p.node is None
            more += f"spring = {{ stiffness = {text_of(spring[0])}, damping = {text_of(spring[1])} }}\n"

            def pull(q, v):
                return -spring[0] * ((c.at(q) - here.offset) @ d) - spring[1] * (c.rate(q, v) @ d)

            def load(t, q, v, Q):
                c.push(q, pull(q, v)[..., None] * d, Q)

            rows["spring"] = pull
            self.plane.loads.append(load)
        axis = turned(d, -turn)
        ground = isinstance(parent, tuple)
        place = (parent[0] + away[0], parent[1] + away[1]) if ground else parent
        if not ground:
            more += f"position = [{text_of(away[0])}, {text_of(away[1])}, 0.0]\n"
        self._joint(name, "prismatic", place, child, turn, more + f"axis = [{text_of(axis[0])}, {text_of(axis[1])}, 0.0]\n", rows)

    def gear(self, first, second, ratio):
        """Angle of the second joint = ratio x that of the first, both on the ground or on bodies."""
        a, b = self.joints[first], self.joints[second]
        terms = [*b["terms"], *[(i, -ratio * f) for i, f in a["terms"]]]
        constant = b["turn"] - ratio * a["turn"]
        self.plane.linear(terms, lambda t: constant)
        self.parts.append(
            f'[[coupling]]\nname = "mesh_{first}"\nkind = "gear"\njoints = ["{first}", "{second}"]\nratio = {text_of(ratio)}\n\n'
        )

    # ---- loads

    def force(self, on, direction, value, body=False, name=None):
        """value: (text, function of t)."""
        p, d = self.point(on), np.array(direction, float) / np.hypot(*direction)

        def load(t, q, v, Q):
            w = np.broadcast_to(d, q.shape[:-1] + (2,))
            if body:
                a = q[..., 3 * p.node + 2] - 0.0
                w = np.stack([np.cos(a) * d[0] - np.sin(a) * d[1], np.sin(a) * d[0] + np.cos(a) * d[1]], -1)
            p.push(q, value[1](t) * w, Q)

        self.plane.loads.append(load)
        more = 'frame = "body"' if body else ""
        self.parts.append(force("force", on, value[0], (d[0], d[1], 0), more + (f'\nname = "{name}"' if name else "")))
        if name:
            self.springs[name] = lambda t, q, v, a: value[1](t) * ((turned(d, q[3 * p.node + 2]) if body else d) @ p.rate(q, v))

    def torque(self, on, value, name=None):
        p = self.point(on)

        def load(t, q, v, Q):
            Q[..., 3 * p.node + 2] += value[1](t)

        self.plane.loads.append(load)
        self.parts.append(force("torque", on, value[0], (0, 0, 1), f'name = "{name}"' if name else ""))
        if name:
            self.springs[name] = lambda t, q, v, a: value[1](t) * v[3 * p.node + 2]

    def spring(self, name, on, start, stiffness, damping=0.0, rest=0.0, preload=0.0):
        p, o = self.point(on), self.point(start)

        def pull(q, v):
            d = p.at(q) - o.at(q)
            length = np.sqrt((d * d).sum(-1))
            rate = (d * (p.rate(q, v) - o.rate(q, v))).sum(-1) / length
            return stiffness * (length - rest) + damping * rate + preload, d / length[..., None]

        def load(t, q, v, Q):
            F, e = pull(q, v)
            p.push(q, -F[..., None] * e, Q)
            o.push(q, F[..., None] * e, Q)

        self.plane.loads.append(load)
        origin = f"ground.{name}_place" if isinstance(start, tuple) else start
        if isinstance(start, tuple):
            self.places = {**getattr(self, "places", {}), f"{name}_place": start}
        self.parts.append(
            f'[[force]]\nname = "{name}"\nkind = "spring-damper"\non = "{on}"\nfrom = "{origin}"\nstiffness = {text_of(stiffness)}\n'
            f"damping = {text_of(damping)}\nrest = {text_of(rest)}\npreload = {text_of(preload)}\n\n"
        )
        self.springs[name] = lambda t, q, v, a: pull(q, v)[0]

    # ---- what is read: outputs of the scene, with their truth from one state (t, q, v, a, multipliers)

    def read(self, name, of, quantity, value, scale=None, more=""):
        """Forces and accelerations have no truth at the first instant of a weight that comes at once: a joint then holds the share of
        the nearest node alone, half an element's (8 elements: 2 %, 24: 0.7 %; in truth nothing)."""
        self.readings[name] = (value, scale, quantity)
        self.parts.append(f'[[output]]\nname = "{name}"\nof = "{of}"\nquantity = "{quantity}"\n{more}\n\n')

    def position(self, name, frame):
        p = self.point(frame)
        self.read(name, frame, "position", lambda t, q, v, a, l: [*p.at(q), np.nan])

    def velocity(self, name, frame):
        p = self.point(frame)
        self.read(name, frame, "velocity", lambda t, q, v, a, l: [*p.rate(q, v), np.nan])

    def acceleration(self, name, frame):
        p = self.point(frame)
        self.read(name, frame, "acceleration", lambda t, q, v, a, l: [*p.acceleration(q, v, a), np.nan])

    def value(self, name, of):
        j = self.joints[of]
        if "terms" in j:
            self.read(name, of, "value", lambda t, q, v, a, l: [sum(f * q[i] for i, f in j["terms"]) - j["turn"]])
        else:
            c, b, d = j["way"]
            angle = lambda q: q[3 * b.node + 2] if b.node is not None else 0.0
            self.read(name, of, "value", lambda t, q, v, a, l: [turned(d, angle(q)) @ (c.at(q) - b.at(q))])

    def reaction(self, name, of, moment=True):
        """moment = False: of a slide whose moment is zero by construction."""
        j = self.joints[of]

        def value(t, q, v, a, l):
            r = [np.nan] * 6
            if "pin" in j:
                r[0], r[1] = -l[j["pin"]], -l[j["pin"] + 1]
            else:
                d, node = j["normal"]
                n = turned(np.array([-d[1], d[0]]), q[3 * node + 2] if node is not None else 0.0)
                f = -l[j["side"]] * n
                if "drive" in j:
                    f = f - l[j["drive"]] * d
                if "spring" in j:
                    f = f + j["spring"](q, v) * d
                r[0], r[1] = f
            if "angle" in j and moment:
                r[5] = -l[j["angle"]]
            elif "torque" in j:
                r[5] = float(j["torque"](q, v))
            return r

        self.read(name, of, "reaction", value)

    def section(self, name, beam, element, stress=False):
        """Forces in the section in the middle of an element, or its stress; loads of the beam do not act within three elements of it."""
        b = self.bodies[beam]
        e = b["first"] + element
        s = b["section"]

        def value(t, q, v, a, l):
            cuts = self.plane.stresses(q, v)[0]
            N, V, M = cuts[e]
            # An element has the mean of the moment over it; what the curve of the moment adds is told by the elements beside it.
            # The first and the last element have it from the next two, in a line.
            bend = lambda k: cuts[b["first"] + k - 1, 2] - 2 * cuts[b["first"] + k, 2] + cuts[b["first"] + k + 1, 2]
            k = min(max(element, 1), b["elements"] - 2)
            inwards = 2 * k - element
            M -= (bend(k) if k == element or not 0 < inwards < b["elements"] - 1 else 2 * bend(k) - bend(inwards)) / 24
            if stress:
                return [largest_stress(s, N, V, M)]
            return [N, V, np.nan, np.nan, np.nan, M]

        at = (element + 0.5) / b["elements"]
        self.read(name, beam, "stress" if stress else "section_force", value, more=f"at = {text_of(at)}")

    def distance(self, name, frame, other):
        p, o = self.point(frame), self.point(other)
        self.read(name, frame, "distance", lambda t, q, v, a, l: [float(np.hypot(*(p.at(q) - o.at(q))))], more=f'relative_to = "{other}"')

    def force_of(self, name, of, quantity="force"):
        law = self.springs[of]
        self.read(name, of, quantity, lambda t, q, v, a, l: [float(law(t, q, v, a))])

    # ---- the scene

    def scene(self, what, words=(), claim=None, rest=False, want=1e-3, per=4, most=32):
        places = getattr(self, "places", {})
        ground = "[ground]\nframes = { " + ", ".join(f"{k} = [{text_of(v[0])}, {text_of(v[1])}, 0.0]" for k, v in places.items()) + " }\n\n"
        text = (ground if places else "") + self.head + "".join(self.parts)

        def truth(times):
            def read(plane, q, v, a, l):
                out = {k: np.array([f(t, *state) for t, *state in zip(times, q, v, a, l)], float) for k, (f, _, _) in self.readings.items()}
                for k, (_, _, quantity) in self.readings.items():
                    if quantity in ("reaction", "acceleration", "section_force", "stress") and not rest and self.plane.gravity.any():
                        out[k][0] = np.nan
                return out

            def static(plane):
                return plane.rest()

            return plane_elastic.converged(self.plane, times, read, static if rest else None, want, per, most)

        scales = {k: s for k, (_, s, _) in self.readings.items() if s}
        return Scene(text, truth, scales, what, words=words, claim=claim)


def largest_stress(s, N, V, M):
    """Largest von Mises stress of a section under pull, shear and bending, Pa. Of a rectangle with V Q / (I b); of others where bending and
    pull decide, else not known (NaN)."""
    pull, bends, shear = abs(N) / s["area"], abs(M) * s["height"] / 2 / s["iz"], abs(V) / s["area"]
    if '"rectangle"' in s["text"]:
        y = np.linspace(0, 1, 41)
        return float(np.sqrt((pull + bends * y) ** 2 + 3 * (1.5 * shear * (1 - y * y)) ** 2).max())
    return pull + bends if pull + bends > 4 * math.sqrt(3) * shear else math.nan


def turned(d, angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * d[0] - s * d[1], s * d[0] + c * d[1]])


def smooth(A, T):
    """From 0 to A within T, at rest before and after: text and function."""
    text = f"{A!r}*(t < {T!r} ? t/{T!r} - sin(2*pi*t/{T!r})/(2*pi) : 1)"
    return text, lambda t: A * (t / T - math.sin(2 * math.pi * t / T) / (2 * math.pi) if t < T else 1.0)


def swing(A, w):
    """To and fro: A (1 - cos(w t)) eased in over the first period, text and function."""
    T = 2 * math.pi / w
    ease = f"(t < {T!r} ? (t/{T!r})^3*(10 - 15*t/{T!r} + 6*(t/{T!r})^2) : 1)"

    def value(t):
        x = min(t / T, 1.0)
        return A * math.sin(w * t) * x**3 * (10 - 15 * x + 6 * x * x)

    return f"{A!r}*sin({w!r}*t)*{ease}", value


def ramp(A, T):
    """A load that rises smoothly from 0 to A within T."""
    text = f"{A!r}*(t < {T!r} ? (1 - cos(pi*t/{T!r}))/2 : 1)"
    return text, lambda t: A * ((1 - math.cos(math.pi * t / T)) / 2 if t < T else 1.0)
