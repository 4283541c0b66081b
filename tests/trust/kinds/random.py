"""Rigid mechanisms with any joints in any axes, trees and loops, against the principle of virtual work (lagrange.py)."""
import dataclasses
import math

import numpy as np
from truths.lagrange import Body, Joint, Mechanism, cross, turn, turn_vector
from scene import Scene, joint, pick, simulation

TREE_KINDS = ("revolute", "prismatic", "cylindrical", "universal", "constant-velocity", "spherical", "planar", "screw", "free", "weld")


def numbers(v):
    return [float(x) for x in np.ravel(v)]


def direction(r):
    v = np.array([r.gauss(0, 1) for _ in range(3)])
    return v / np.linalg.norm(v)


def some_axis(r):
    return pick(r, np.eye(3)[0], np.eye(3)[1], np.eye(3)[2], direction(r), direction(r))


@dataclasses.dataclass
class Drawn:
    """A mechanism as it is drawn: scale L (m), weight m (kg), time T (s); text of the scene's bodies, joints and forces."""

    L: float
    m: float
    T: float
    mechanism: Mechanism
    q: np.ndarray
    qd: np.ndarray
    text: str
    joints: list
    springs: list
    followers: list


def body_text(r, name, L, m, frames):
    """A body of point masses and a core, its text and numbers."""
    centre = np.array([r.uniform(-0.3, 0.3) * L for _ in range(3)]) if r.random() < 0.7 else np.zeros(3)
    arms = [direction(r) * L * r.uniform(0.1, 0.5) for _ in range(3)]
    I = sum(m / 3 * (a @ a * np.eye(3) - np.outer(a, a)) for a in arms) + m * 0.005 * L * L * np.eye(3)
    six = [I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]]
    points = ", ".join(f"{k} = {numbers(v)}" for k, v in frames.items())
    text = (
        f'[[body]]\nname = "{name}"\nkind = "rigid"\nmass = {m!r}\ninertia = {numbers(six)}\n'
        f"centre_of_mass = {numbers(centre)}\nframes = {{ {points} }}\n\n"
    )
    return text, I, centre


def on_coordinates(jt, at, k, c, rest, preload):
    """Generalised forces of a joint's spring: on a ball's and a free body's turns it acts on the angular velocity."""

    def act(q, qd):
        x, v = q[at : at + jt.size], qd[at : at + jt.size]
        if jt.kind not in ("spherical", "free"):
            return -(k * (x - rest) + c * v + preload)
        turned = 3 if jt.kind == "free" else 0
        J = np.eye(jt.size)
        J[turned:, turned:] = turn_rates(x[turned:])
        return -J.T @ (k * (x - rest) + c * (J @ v) + preload)

    return act


def turn_rates(v):
    """Matrix from the rate of a rotation vector to the angular velocity in the frame where the vector stands."""
    columns = []
    for e in np.eye(3):
        R = turn(v + 1e-30j * e)
        S = (R.imag / 1e-30) @ R.real.T
        columns.append([S[2, 1], S[0, 2], S[1, 0]])
    return np.array(columns).T


def initial_of(jt, x, v):
    """value and rate as a scene has them: rates of turns in space are angular velocities."""
    v = np.array(v)
    if jt.kind in ("spherical", "free"):
        turned = 3 if jt.kind == "free" else 0
        v[turned:] = turn_rates(x[turned:]) @ v[turned:]
    if jt.size == 0:
        return ""
    if jt.size == 1:
        return f"initial = {{ value = {float(x[0])!r}, rate = {float(v[0])!r} }}\n"
    return f"initial = {{ value = {numbers(x)}, rate = {numbers(v)} }}\n"


def draw(r, count, kinds=TREE_KINDS, chain=False, still=False, stiff=False):
    """A tree of bodies with springs in some joints, weight, springs between points, followers. still: no rates; stiff: springs in all."""
    L, m, T = 10 ** r.uniform(-2, 1.5), 10 ** r.uniform(-2, 2), 10 ** r.uniform(-1.5, 0.7)
    w = 2 * math.pi / T
    gravity = direction(r) * L * w * w * 0.3 if r.random() < 0.7 else np.zeros(3)
    bodies, text, joints, acts, q, qd = [], "", [], [], [], []
    for i in range(count):
        parent = -1 if i == 0 else (i - 1 if chain else r.randrange(-1, i))
        kind = pick(r, *kinds)
        axis = some_axis(r)
        jt = Joint(
            kind,
            axis,
            [r.uniform(-0.5, 0.5) * L for _ in range(3)] if r.random() < 0.5 else (0, 0, 0),
            direction(r) * r.uniform(0, 2.5) if r.random() < 0.5 else (0, 0, 0),
            L * pick(r, 1, -1) * r.uniform(0.05, 0.5),
        )
        frames = {k: np.array([r.uniform(-0.7, 0.7) * L for _ in range(3)]) for k in "abc"}
        mass = m * 10 ** r.uniform(-0.7, 0.7)
        t, I, centre = body_text(r, f"b{i}", L, mass, frames)
        at = np.zeros(3) if parent < 0 else bodies[parent][1][pick(r, "b", "c")]
        where = "ground" if parent < 0 else f"b{parent}." + next(k for k, v in bodies[parent][1].items() if v is at)
        x, v = np.zeros(jt.size), np.zeros(jt.size)
        for c in range(jt.size):
            length = kind == "prismatic" or (kind == "cylindrical" and c == 0) or (kind == "planar" and c < 2) or (kind == "free" and c < 3)
            size = L if length else 1.0
            bound = 0.8 if kind in ("spherical", "free", "constant-velocity", "universal") else 2.0
            x[c] = r.uniform(-0.5, 0.5) * size * (1 if length else bound) * (r.random() < 0.8)
            v[c] = 0.0 if still else r.uniform(-0.3, 0.3) * size * w * (r.random() < 0.8)
        first = sum(b[2].size for b in bodies)
        more = f"axis = {numbers(axis)}\nposition = {numbers(jt.position)}\nrotation = {numbers(jt.rotation)}\n"
        more += f"pitch = {jt.pitch!r}\n" if kind == "screw" else ""
        more += initial_of(jt, x, v)
        if jt.size and (stiff or r.random() < 0.5):
            mixed = kind in ("cylindrical", "planar", "free")
            J = m * (1.0 if kind == "prismatic" or mixed else L * L) * w * w * (10 ** r.uniform(-0.5, 0.5)) * (4 if stiff else 1)
            k, c = J, J / w * pick(r, 0.0, 0.05, 0.3)
            rest = float(x[0]) * 0.5 if jt.size == 1 else 0.0
            preload = 0.1 * J * (L if kind == "prismatic" else 1.0) if jt.size == 1 and r.random() < 0.5 else 0.0
            more += f"spring = {{ stiffness = {k!r}, damping = {c!r}, rest = {rest!r}, preload = {preload!r} }}\n"
            acts.append((first, jt.size, on_coordinates(jt, first, k, c, rest, preload)))
        joints.append((f"j{i}", kind, where, f"b{i}.a", more))
        text += t
        bodies.append((Body(parent, at, jt, frames["a"], mass, I, centre), frames, jt))
        q.append(x)
        qd.append(v)
    springs, followers = [], []
    names = lambda i, k: "ground" if i < 0 else f"b{i}.{k}"
    if r.random() < 0.6:
        i, k = r.randrange(count), pick(r, *"bc")
        j = pick(r, -1, *[n for n in range(count) if n != i])
        other = pick(r, *"bc")
        stiffness = m * w * w * 10 ** r.uniform(-0.5, 0.5)
        data = (i, k, j, other, stiffness, stiffness / w * pick(r, 0.0, 0.1), L * r.uniform(0, 1), stiffness * L * pick(r, 0.0, 0.2))
        springs.append(data)
        text += (
            f'[[force]]\nname = "s"\nkind = "spring-damper"\non = "{names(i, k)}"\nfrom = "{names(j, other)}"\n'
            f"stiffness = {data[4]!r}\ndamping = {data[5]!r}\nrest = {data[6]!r}\npreload = {data[7]!r}\n\n"
        )
    if r.random() < 0.5 and not still:
        i, kind, frame = r.randrange(count), pick(r, "force", "torque"), pick(r, "world", "body")
        d, size = direction(r), 0.2 * m * w * w * L * 10 ** r.uniform(-0.5, 0.3) * (1.0)
        size *= L if kind == "torque" else 1.0
        speed = w * r.uniform(0.3, 2)
        followers.append((i, kind, frame, d, size, speed))
        text += (
            f'[[force]]\nname = "p"\nkind = "{kind}"\non = "b{i}.c"\ndirection = {numbers(d)}\nframe = "{frame}"\n'
            f'value = "{size!r}*cos({speed!r}*t)"\n\n'
        )
    only = [b[0] for b in bodies]
    points = [b[1] for b in bodies]

    def loads(mo):
        out = []
        place = lambda i, k: np.zeros(3) if i < 0 else mo["p"][i] + mo["R"][i] @ points[i][k]
        speed = lambda i, k: np.zeros(3) if i < 0 else mo["v"][i] + cross(mo["w"][i], mo["R"][i] @ points[i][k])
        for i, k, j, other, stiffness, damping, rest, preload in springs:
            d = place(j, other) - place(i, k)
            length = np.linalg.norm(d)
            e = d / length
            rate = e @ (speed(j, other) - speed(i, k))
            f = (stiffness * (length - rest) + damping * rate + preload) * e
            out.append((i, points[i][k], f, 0.0))
            if j >= 0:
                out.append((j, points[j][other], -f, 0.0))
        for i, kind, frame, d, size, speed_ in followers:
            f = size * math.cos(speed_ * mo["t"]) * (mo["R"][i] @ d if frame == "body" else d)
            out.append((i, points[i]["c"], f, 0.0) if kind == "force" else (i, np.zeros(3), np.zeros(3), f))
        return out

    def coordinate_loads(t, q, qd):
        Q = np.zeros(len(q))
        for first, size, act in acts:
            Q[first : first + size] += act(q, qd)
        return Q

    mechanism = Mechanism(only, gravity, loads, coordinate_loads)
    mechanism.points = points
    return Drawn(L, m, T, mechanism, np.concatenate(q), np.concatenate(qd), text, joints, springs, followers), gravity


def joints_text(r, drawn):
    """In any order: nothing depends on it."""
    order = list(drawn.joints)
    r.shuffle(order)
    return "".join(joint(*j) for j in order)


def turning(m, i):
    """Rotation of a body as a vector."""
    return turn_vector(m["R"][i])


def wanted_outputs(r, drawn, with_reactions=True):
    """Text of a handful of outputs, and name -> function of an instant; scales of those that have no range of their own."""
    me, n = drawn.mechanism, len(drawn.mechanism.bodies)
    text, truth, w = "", {}, 2 * math.pi / drawn.T
    usual = {"position": drawn.L, "velocity": drawn.L * w, "acceleration": drawn.L * w * w, "angular_velocity": w}
    usual |= {"distance": drawn.L, "distance_rate": drawn.L * w, "angle": 1.0}
    sizes = {"hold": 1e3 * drawn.m * drawn.L * w * w * min(1.0, drawn.L)}

    def of_frame(i, k):
        x = me.points[i][k]
        place = lambda m: m["p"][i] + m["R"][i] @ x
        speed = lambda m: m["v"][i] + cross(m["w"][i], m["R"][i] @ x)

        def push(m):
            y = m["R"][i] @ x
            return m["a"][i] + cross(m["alpha"][i], y) + cross(m["w"][i], cross(m["w"][i], y))

        return place, speed, push

    for number in range(3):
        i, k = (n - 1 if number == 0 else r.randrange(n)), pick(r, *"bc")
        place, speed, push = of_frame(i, k)
        what = "position" if number == 0 else pick(r, "velocity", "acceleration", "angular_velocity", "position")
        sizes[f"o{number}"] = usual[what]
        text += f'[[output]]\nname = "o{number}"\nof = "b{i}.{k}"\nquantity = "{what}"\n\n'
        truth[f"o{number}"] = {"position": place, "velocity": speed, "acceleration": push, "angular_velocity": lambda m, i=i: m["w"][i]}[
            what
        ]
    if n > 1:
        i, j = r.sample(range(n), 2)
        k, o = pick(r, *"bc"), pick(r, *"bc")
        (place, speed, _), (base, flow, _) = of_frame(i, k), of_frame(j, o)
        what = pick(r, "position", "velocity", "angular_velocity", "distance", "distance_rate", "angle")
        sizes["seen"] = usual[what]
        text += f'[[output]]\nname = "seen"\nof = "b{i}.{k}"\nquantity = "{what}"\nrelative_to = "b{j}.{o}"\n\n'
        apart = lambda m: place(m) - base(m)
        truth["seen"] = {
            "position": lambda m: m["R"][j].T @ apart(m),
            "velocity": lambda m: m["R"][j].T @ (speed(m) - flow(m) - cross(m["w"][j], apart(m))),
            "angular_velocity": lambda m: m["R"][j].T @ (m["w"][i] - m["w"][j]),
            "distance": lambda m: [np.linalg.norm(apart(m))],
            "distance_rate": lambda m: [apart(m) @ (speed(m) - flow(m)) / np.linalg.norm(apart(m))],
            "angle": lambda m: [np.linalg.norm(turn_vector(m["R"][j].T @ m["R"][i]))],
        }[what]
    if with_reactions:
        held = r.randrange(n)
        axes = pick(r, "world", "parent", "child")
        text += f'[[output]]\nname = "hold"\nof = "j{held}"\nquantity = "reaction"\nframe = "{axes}"\n\n'

        def hold(m):
            b = me.bodies[held]
            base = np.eye(3) if b.parent < 0 else m["R"][b.parent]
            R = {"world": np.eye(3), "parent": base @ b.joint.R, "child": m["R"][held]}[axes]
            v = me.reaction(held, m)
            return np.concatenate([R.T @ v[:3], R.T @ v[3:]])

        truth["hold"] = hold
    return text, truth, sizes


# Two tolerances, and the share of a coordinate's range by which the two may differ: where motions part, neither is a truth.
LOOSE, TIGHT, PARTED = 1e-7, 1e-9, 1e-3


def truth_of(drawn, wanted):
    def truth(times):
        follow = lambda rtol: drawn.mechanism.follow(drawn.q, drawn.qd, times, rtol, 1e-2 * rtol * min(1.0, drawn.L))
        loose, (qs, qds) = follow(LOOSE)[0], follow(TIGHT)
        if drawn.mechanism.farthest_turn(qs) > 5.0:  # rotation vectors end at a full turn: no truth
            return {name: np.full((len(times), 6 if name == "hold" else 3), np.nan) for name in wanted}
        apart = (abs(loose - qs) > PARTED * np.maximum(np.ptp(qs, axis=0), 1e-300)).any(axis=1) & (abs(loose - qs) > 1e-12).any(axis=1)
        known = np.cumsum(apart) == 0
        rows = {name: [] for name in wanted}
        for m in drawn.mechanism.instants(qs, qds, times):
            for name, f in wanted.items():
                rows[name].append(f(m))
        told = {name: np.array(v, float).reshape(len(times), -1) for name, v in rows.items()}
        for values in told.values():
            values[~known] = np.nan
        return told

    return truth


def scales_of(sizes):
    """What errors are measured against: ranges, but no less than a millionth of what such a thing is in a mechanism of this size, weight
    and speed (reactions: a thousandth): what stands still by construction has no range."""
    return {name: lambda true, least=1e-6 * size: max((true.max(axis=0) - true.min(axis=0)).max(), least) for name, size in sizes.items()}


def random_tree(r):
    """A tree of one to four rigid bodies on any joints in any axes, springs and followers; places, what is seen from a body, reactions"""
    drawn, gravity = draw(r, r.randint(1, 4))
    if drawn.mechanism.size == 0:
        return None
    wanted_text, wanted, sizes = wanted_outputs(r, drawn)
    duration = drawn.T * r.uniform(0.4, 1.0)
    text = simulation(duration, 30 / duration, gravity) + drawn.text + joints_text(r, drawn) + wanted_text
    kinds = ", ".join(j[1] for j in drawn.joints)
    return Scene(text, truth_of(drawn, wanted), scales_of(sizes), kinds)


def loop_conditions(kind, i, k, j, o, points, jt, length):
    """Residuals of a joint that closes a loop: of its frame on body i (point k) against body j (point o; -1: ground)."""

    def poses(R, p):
        base, origin = (np.broadcast_to(np.eye(3), R.shape[:-3] + (3, 3)), np.zeros(3)) if j < 0 else (R[..., j, :, :], p[..., j, :])
        at = (np.zeros(3) if j < 0 else points[j][o]) + jt.position
        Rf = base @ jt.R
        origin = origin + (base @ at[:, None])[..., 0]
        place = p[..., i, :] + (R[..., i, :, :] @ points[i][k][:, None])[..., 0]
        d = np.swapaxes(Rf, -1, -2) @ (place - origin)[..., None]
        return d[..., 0], np.swapaxes(Rf, -1, -2) @ R[..., i, :, :]

    a, x, y = jt.axis, jt.x, jt.y

    def conditions(R, p):
        d, Q = poses(R, p)
        on = lambda v: (d * v).sum(-1)[..., None]
        # u . Q v: zero while direction v of the child stays normal to u.
        across = lambda u, v: np.einsum("i,...ij,j->...", u, Q, v)[..., None]
        if kind == "spherical":
            return d
        if kind == "revolute":
            return np.concatenate([d, across(x, a), across(y, a)], -1)
        if kind == "cylindrical":
            return np.concatenate([on(x), on(y), across(x, a), across(y, a)], -1)
        if kind == "prismatic":
            return np.concatenate([on(x), on(y), across(x, a), across(y, a), across(x, y)], -1)
        if kind == "planar":
            return np.concatenate([on(a), across(x, a), across(y, a)], -1)
        if kind == "universal":
            return np.concatenate([d, across(a, x)], -1)
        if kind == "point-on-line":
            return np.concatenate([on(x), on(y)], -1)
        if kind == "point-on-plane":
            return on(a)
        return ((d * d).sum(-1)[..., None] - length**2) / length

    return conditions


def random_loop(r):
    """A chain of rigid bodies closed to a loop by any joint, which fits where it starts; springs, followers, rates that the loop allows"""
    closing = pick(
        r,
        "spherical",
        "revolute",
        "cylindrical",
        "prismatic",
        "planar",
        "universal",
        "point-on-line",
        "point-on-plane",
        "distance",
    )
    count = r.randint(2, 4)
    drawn, gravity = draw(
        r, count, ("revolute", "prismatic", "cylindrical", "universal", "spherical", "planar", "screw", "constant-velocity"), chain=True
    )
    me = drawn.mechanism
    i, k, o = count - 1, pick(r, *"bc"), pick(r, *"bc")
    j = pick(r, -1, -1, *range(count - 1))
    axis = some_axis(r)
    R, p = me.poses(drawn.q)
    base, origin = (np.eye(3), np.zeros(3)) if j < 0 else (R[j], p[j])
    place = p[i] + R[i] @ me.points[i][k]
    far = direction(r) * drawn.L * r.uniform(0.5, 1.5) if closing == "distance" else np.zeros(3)
    position = base.T @ (place + far - origin) - (np.zeros(3) if j < 0 else me.points[j][o])
    rotation = turn_vector(base.T @ R[i])
    jt = Joint("weld", axis, position, rotation)
    length = float(np.linalg.norm(far))
    me.conditions = loop_conditions(closing, i, k, j, o, me.points, jt, length)
    # Rates that the loop allows, and how many ways it has to move.
    G = me.rates(drawn.q, np.eye(me.size))[2].T
    units = np.linalg.norm(G, axis=1, keepdims=True)
    _, s, V = np.linalg.svd(G / np.where(units > 0, units, 1))
    rank = int((s > 1e-6 * s[0]).sum())
    if rank == me.size or (s[rank - 1] < 0.02 * s[0]) or rank < len(s) and s[rank] > 1e-10 * s[0]:
        return None  # cannot move, or begins beside a change point
    N = V[rank:]
    drawn.qd = N.T @ (N @ drawn.qd)
    more = f"axis = {numbers(axis)}\nposition = {numbers(position)}\nrotation = {numbers(rotation)}\n"
    more += f"length = {length!r}\n" if closing == "distance" else ""
    first = me.first
    joints = []
    for n, (name, kind, where, child, lines) in enumerate(drawn.joints):
        begin = [line for line in lines.splitlines() if not line.startswith("initial")]
        b = me.bodies[n].joint
        x, v = drawn.q[first[n] : first[n + 1]], drawn.qd[first[n] : first[n + 1]]
        joints.append((name, kind, where, child, "\n".join(begin) + "\n" + initial_of(b, x, v)))
    joints.append(("closing", closing, "ground" if j < 0 else f"b{j}.{o}", f"b{i}.{k}", more))
    drawn.joints = joints
    wanted_text, wanted, sizes = wanted_outputs(r, drawn, with_reactions=False)
    duration = drawn.T * r.uniform(0.2, 0.5)
    text = simulation(duration, 30 / duration, gravity) + drawn.text + joints_text(r, drawn) + wanted_text
    kinds = ", ".join(j[1] for j in drawn.joints)
    return Scene(text, truth_of(drawn, wanted), scales_of(sizes), f"{kinds}; {me.size - rank} ways to move")


def resting(me, q):
    """Equilibrium near q and whether it is stable, by Newton on the generalised forces; None where there is none near."""
    n = len(q)
    zero = np.zeros(n)

    def push(x):
        m = me.motion(0.0, x, zero)
        F, T = me.wrenches(m)
        Q = me.coordinate_loads(0.0, x, zero)
        return Q + sum(m["Jv"][:, i] @ F[i] + m["Jw"][:, i] @ T[i] for i in range(len(me.bodies)))

    def stiffness(x):
        h = 1e-6 * np.where(abs(x) > 1e-3, abs(x), 1e-3)
        return -np.array([(push(x + h[k] * e) - push(x - h[k] * e)) / (2 * h[k]) for k, e in enumerate(np.eye(n))]).T

    for _ in range(30):
        K = stiffness(q)
        step = np.linalg.solve(K, push(q))
        q = q + step
        if np.linalg.norm(step) < 1e-11 * (1 + np.linalg.norm(q)):
            return q, K
    return None


def random_rest(r):
    """A tree of rigid bodies on any joints, all of them sprung, hangs at rest under its weight; it starts beside its place"""
    drawn, gravity = draw(r, r.randint(1, 3), TREE_KINDS[:-1], still=True, stiff=True)
    me = drawn.mechanism
    if not gravity.any():
        return None
    found = resting(me, drawn.q)
    if found is None:
        return None
    q, K = found
    moved = np.abs(q - drawn.q).max()
    if moved > min(0.5, 0.5 * drawn.L) or np.linalg.eigvalsh((K + K.T) / 2)[0] <= 0:
        return None  # far from the start another one may be found
    joints = []
    for name, kind, where, child, lines in drawn.joints:
        begin = [
            line.replace("value = ", "guess = ").split(", rate")[0] + " }" if line.startswith("initial") else line
            for line in lines.splitlines()
        ]
        joints.append((name, kind, where, child, "\n".join(begin) + "\n"))
    drawn.joints = joints
    duration = 0.05 * drawn.T
    wanted = {}
    text = simulation(duration, 10 / duration, gravity, start="static") + drawn.text + joints_text(r, drawn)
    m = me.motion(0.0, q, np.zeros(me.size))
    R0, p0 = me.poses(drawn.q)
    scales = {}
    for i in range(len(me.bodies)):
        text += f'[[output]]\nname = "o{i}"\nof = "b{i}.c"\nquantity = "position"\n\n'
        wanted[f"o{i}"] = m["p"][i] + m["R"][i] @ me.points[i]["c"]
        scales[f"o{i}"] = max(float(np.linalg.norm(wanted[f"o{i}"] - p0[i] - R0[i] @ me.points[i]["c"])), 1e-3 * drawn.L)
    kinds = ", ".join(j[1] for j in drawn.joints)
    return Scene(text, lambda t: {k: np.tile(v, (len(t), 1)) for k, v in wanted.items()}, scales, f"{kinds}; moved by {moved:.2g}")


KINDS = [random_tree, random_loop, random_rest]
