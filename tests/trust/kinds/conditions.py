"""Couplings and joints that tie coordinates by a law: cams, ropes over pulleys, pins in slots; friction that is regularised."""
import math

import numpy as np
from scene import Scene, force, joint, output, pick, rigid, simulation
from truths.formulas import ode
from truths.lagrange import Body, Joint, Mechanism


def cam_follower(r):
    """A cam drives a follower on a spring, turned by a motor or free; what the coupling exerts, the motor's moment"""
    R = 10 ** r.uniform(-2, 0)
    m, J = 10 ** r.uniform(-1, 1), 0.0
    J = m * R * R * 10 ** r.uniform(-1, 1)
    h, n, p = R * r.uniform(0.05, 0.4), r.randrange(1, 4), r.uniform(0, 2 * math.pi)
    h2 = h * r.uniform(0, 0.2)
    W = 10 ** r.uniform(0, 2)
    k, c, rest, preload = m * W * W * r.uniform(0, 3), m * W * r.uniform(0, 0.5), -h * r.uniform(0, 3), m * W * W * h * r.uniform(0, 3)
    g, value = pick(r, 0.0, 9.81), pick(r, 0.0, h * r.uniform(-1, 1))
    driven = r.random() < 0.5
    lift = lambda a: h * np.sin(n * a + p) + h2 * np.cos(2 * n * a)
    lift1 = lambda a: n * h * np.cos(n * a + p) - 2 * n * h2 * np.sin(2 * n * a)
    lift2 = lambda a: -n * n * h * np.sin(n * a + p) - 4 * n * n * h2 * np.cos(2 * n * a)
    duration = 2 * math.pi / W * r.uniform(1, 4)
    A, wa = r.uniform(0.1, 0.6), W * r.uniform(0.3, 2)
    T, wt = J * W * W * r.uniform(0.1, 1), W * r.uniform(0.2, 3)
    a0 = r.uniform(-3, 3)
    turning = f'motion = "{a0!r} + {W!r}*t + {A!r}*sin({wa!r}*t)"' if driven else f"initial = {{ value = {a0!r}, rate = {W!r} }}"
    text = (
        simulation(duration, 200 / duration, (0, -g, 0))
        + rigid("wheel", m, (J, J, J))
        + rigid("follower", m, (J, J, J))
        + joint("shaft", "revolute", "ground", "wheel", turning)
        + joint(
            "guide",
            "prismatic",
            "ground",
            "follower",
            f"axis = [0, 1, 0]\nspring = {{ stiffness = {k!r}, damping = {c!r}, rest = {rest!r}, preload = {preload!r} }}",
        )
        + f'[[coupling]]\nname = "cam"\nkind = "cam"\njoints = ["shaft", "guide"]\n'
        + f'lift = "{h!r}*sin({n}*angle + {p!r}) + {h2!r}*cos({2 * n}*angle)"\nvalue = {value!r}\n\n'
        + ("" if driven else force("torque", "wheel", f"{T!r}*cos({wt!r}*t)", (0, 0, 1)))
        + output("angle", "shaft", "value")
        + output("way", "guide", "value")
        + output("speed", "guide", "rate")
        + output("push", "cam", "force")
        + output("bearing", "shaft", "reaction")
    )
    of_guide = lambda a, v: k * (lift(a) - value - rest) + c * lift1(a) * v + preload + m * g

    def acceleration(t, a, v):
        if driven:
            return -A * wa * wa * np.sin(wa * t)
        return (T * np.cos(wt * t) - lift1(a) * (m * lift2(a) * v * v + of_guide(a, v))) / (J + m * lift1(a) ** 2)

    def truth(t):
        if driven:
            a, v = a0 + W * t + A * np.sin(wa * t), W + A * wa * np.cos(wa * t)
        else:
            a, v = ode(lambda s, y: [y[1], acceleration(s, *y)], [a0, W], t, atol=np.array([1e-11, 1e-11 * W])).T
        acc = acceleration(t, a, v)
        F = m * (lift1(a) * acc + lift2(a) * v * v) + of_guide(a, v)
        none = 0 * t
        motor = J * acc + F * lift1(a) if driven else none
        return {
            "angle": a[:, None],
            "way": (lift(a) - value)[:, None],
            "speed": (lift1(a) * v)[:, None],
            "push": np.stack([-F * lift1(a), F], 1),
            "bearing": np.stack([none, none + m * g, none, none, none, motor], 1),
        }

    return Scene(
        text, truth, {"bearing": m * (W * W * h + g)}, f"lift {h / R:.2g} of the radius, {n} a turn, {'driven' if driven else 'free'}"
    )


def rope_machine(r):
    """A rope runs from a drum or the ground over pulleys to weights on oblique guides; its pull, their motion"""
    size = 10 ** r.uniform(-1, 1)
    count = r.randrange(1, 3) + 1
    g = 9.81
    w = math.sqrt(g / size)
    random_point = lambda: np.array([r.uniform(-2, 2), r.uniform(-1, 1), r.uniform(-1, 1)]) * size
    masses, axes, places, words, through, path = [], [], [], "", [], []
    for i in range(count):
        axis = np.array([r.uniform(-0.4, 0.4), r.uniform(-0.4, 0.4), 1.0])
        axes.append(axis / np.linalg.norm(axis))
        places.append(random_point() - np.array([0, 0, 2.5 * size]))
        masses.append(10 ** r.uniform(-0.5, 0.5))
    pulleys = [random_point() + np.array([0, 0, 1.0 * size]) for _ in range(count + 1)]
    # pulley, weight, pulley, weight, ... ; the last weight at the end of the rope or a pulley beyond it
    for i in range(count):
        path += [("fixed", i), ("weight", i)]
    if r.random() < 0.5:
        path.append(("fixed", count))
    drum = r.random() < 0.5
    rho, Jd = size * r.uniform(0.05, 0.2), 0.0
    Jd = masses[0] * rho * rho * 10 ** r.uniform(-1, 1)
    k = [m * w * w * r.uniform(0, 1) for m in masses]
    frames = ", ".join(f"p{i} = {[float(x) for x in p]}" for i, p in enumerate(pulleys))
    words += f"[ground]\nframes = {{ {frames} }}\n\n"
    for i in range(count):
        words += rigid(f"w{i}", masses[i], [masses[i] * size**2] * 3)
        words += joint(
            f"g{i}",
            "prismatic",
            "ground",
            f"w{i}",
            f"position = {[float(x) for x in places[i]]}\naxis = {[float(x) for x in axes[i]]}\ninitial = {{ value = 0 }}\n"
            f"spring = {{ stiffness = {k[i]!r} }}",
        )
    if drum:
        words += rigid("drum", 1.0, [Jd] * 3) + joint("shaft", "revolute", "ground", "drum", "initial = { value = 0 }")
    through = [f"ground.p{i}" if kind == "fixed" else f"w{i}" for kind, i in path]

    def point(kind, i, q):
        return pulleys[i] + 0 * q[0] if kind == "fixed" else places[i] + axes[i] * q[i]

    def length(q):
        points = [point(*p, q) for p in path]
        total = rho * q[count] if drum else 0.0
        for a, b in zip(points, points[1:]):
            d = b - a
            total = total + np.sqrt((d * d).sum())
        return total

    size_q = count + int(drum)
    M = np.array(masses + ([Jd] if drum else []))
    L0 = float(length(np.zeros(size_q)))
    steps = [1e-30j * np.eye(size_q)[i] for i in range(size_q)]
    gradient = lambda q: np.array([length(q + s).imag / 1e-30 for s in steps])

    def accelerations(t, q, v):
        G = gradient(q)
        h = 1e-5 * size / max(np.linalg.norm(v), 1e-12)
        curved = (gradient(q + h * v) - gradient(q - h * v)) @ v / (2 * h) if np.linalg.norm(v) > 0 else 0.0
        Q = np.array([-masses[i] * g * axes[i][2] - k[i] * q[i] for i in range(count)] + ([0.0] if drum else []))
        pull = (G @ (Q / M) + curved) / (G @ (G / M))
        return (Q - pull * G) / M, pull

    duration = 2 / w * r.uniform(0.5, 1.5)
    times = np.linspace(0, duration, 200)
    follow = lambda t: ode(
        lambda s, y: np.concatenate([y[size_q:], accelerations(s, y[:size_q], y[size_q:])[0]]),
        np.zeros(2 * size_q),
        t,
        rtol=1e-10,
        atol=1e-11 * size,
    )
    try:
        y = follow(times)
    except RuntimeError:
        return None
    pulls = [accelerations(0, z[:size_q], z[size_q:])[1] for z in y]
    reach = [min(np.linalg.norm(point(*a, z) - point(*b, z)) for a, b in zip(path, path[1:])) for z in y[:, :size_q]]
    if min(pulls) < 0.02 * max(pulls) or min(reach) < 0.2 * size:
        return None
    names = ", ".join(f'"{p}"' for p in through)
    terms = f'terms = [{{ joint = "shaft", factor = {rho!r} }}]\n' if drum else ""
    text = (
        simulation(duration, 100 / duration, (0, 0, -g))
        + words
        + f'[[coupling]]\nname = "rope"\nkind = "rope"\nthrough = [{names}]\nlength = {L0!r}\n{terms}\n'
        + "".join(output(f"way{i}", f"g{i}", "value") + output(f"speed{i}", f"g{i}", "rate") for i in range(count))
        + (output("turn", "shaft", "value") if drum else "")
        + output("pull", "rope", "force")
    )

    def truth(t):
        y = follow(t)
        out = {f"way{i}": y[:, i : i + 1] for i in range(count)} | {f"speed{i}": y[:, size_q + i : size_q + i + 1] for i in range(count)}
        if drum:
            out["turn"] = y[:, count : count + 1]
        out["pull"] = np.array([[accelerations(0, z[:size_q], z[size_q:])[1]] for z in y])
        return out

    return Scene(text, truth, {}, f"{count} weights, {'a drum' if drum else 'held'}, {len(path)} points")


def pin_in_slot(r):
    """A body runs with a pin in the slot of a turning one, springs along the slot and about the pin; any axis"""
    size, g = 10 ** r.uniform(-1, 1), 9.81
    w = math.sqrt(g / size)
    vector = lambda s: [r.uniform(-s, s) for _ in range(3)]
    axis = vector(1)
    if np.linalg.norm(axis) < 0.2:
        return None
    m = [10 ** r.uniform(-0.5, 0.5) for _ in range(2)]
    J = [m[i] * size**2 * r.uniform(0.05, 0.3) for i in range(2)]
    centres = [[x * size for x in vector(0.2)] for _ in range(2)]
    at, turned = [x * size for x in vector(0.3)], vector(1.5)
    k, kt = m[1] * w * w * r.uniform(1, 6), 0.0
    kt = k
    hub = Joint("revolute", vector(1) if r.random() < 0.5 else axis)
    slot = Joint("pin-slot", axis, at, turned)
    rates = [w * r.uniform(-1, 1) for _ in range(3)]
    start = [r.uniform(-1, 1), size * r.uniform(-0.2, 0.2), r.uniform(-1, 1)]
    damping = m[1] * w * r.uniform(0, 0.3)
    bodies = [
        Body(-1, [0, 0, 0], hub, [0, 0, 0], m[0], np.eye(3) * J[0], centres[0]),
        Body(0, [0, 0, 0], slot, [0, 0, 0], m[1], np.eye(3) * J[1], centres[1]),
    ]
    springs = lambda t, q, v: np.array([0.0, -k * q[1] - damping * v[1], -kt * q[2] - damping * v[2]])
    truth_of = Mechanism(bodies, (0, 0, -g), coordinate_loads=springs)
    duration = 2 / w * r.uniform(1, 3)
    numbers = lambda v: str([float(x) for x in v])
    text = (
        simulation(duration, 100 / duration, (0, 0, -g))
        + "".join(rigid(n, m[i], [J[i]] * 3, centre=centres[i]) for i, n in enumerate(("hub", "slider")))
        + joint(
            "turn", "revolute", "ground", "hub", f"axis = {numbers(hub.axis)}\ninitial = {{ value = {start[0]!r}, rate = {rates[0]!r} }}"
        )
        + joint(
            "slot",
            "pin-slot",
            "hub",
            "slider",
            f"axis = {numbers(axis)}\nposition = {numbers(at)}\nrotation = {numbers(turned)}\n"
            + f"initial = {{ value = {numbers(start[1:])}, rate = {numbers([rates[1] * size, rates[2]])} }}\n"
            + f"spring = {{ stiffness = {k!r}, damping = {damping!r} }}",
        )
        + output("turn", "turn", "value")
        + output("slides", "slot", "value")
        + output("place", "slider", "position")
        + output("reaction", "slot", "reaction")
    )

    def truth(t):
        q, v = truth_of.follow(np.array(start), np.array([rates[0], rates[1] * size, rates[2]]), t, rtol=1e-9, atol=1e-11)
        place, reaction = [], []
        for motion in truth_of.instants(q, v, t):
            place.append(motion["p"][1])
            reaction.append(truth_of.reaction(1, motion))
        return {"turn": q[:, :1], "slides": q[:, 1:], "place": np.array(place), "reaction": np.array(reaction)}

    return Scene(text, truth, {}, f"axis {np.round(slot.axis, 2)}, {k / m[1] / w / w:.2g} m g / size")


def regularised_rub(r):
    """A block on a belt: friction that is regularised, with a falling characteristic or without; it chatters or creeps"""
    m, w = 10 ** r.uniform(-1, 1), 10 ** r.uniform(0, 2)
    mu, N = r.uniform(0.1, 0.5), m * 9.81 * r.uniform(0.3, 3)
    static = mu * pick(r, 1.0, r.uniform(1, 2))
    x1 = mu * N / (m * w * w)  # what friction bends the spring by
    v0 = x1 * w * 10 ** r.uniform(-2, -0.5)
    belt, F = x1 * w * r.uniform(0.2, 2), mu * N * r.uniform(0, 2)
    wf = w * r.uniform(0.2, 2)
    duration = 2 * math.pi / w * r.uniform(2, 6)
    text = (
        simulation(duration, 300 / duration)
        + rigid("belt", 1.0, (1, 1, 1))
        + rigid("block", m, (m, m, m))
        + joint("drive", "prismatic", "ground", "belt", f'axis = [1, 0, 0]\nmotion = "{belt!r}*t"')
        + joint(
            "rubs",
            "prismatic",
            "belt",
            "block",
            f"axis = [1, 0, 0]\nfriction = {{ coefficient = {mu!r}, static_coefficient = {static!r}, normal_force = {N!r}, "
            f"regularised = {v0!r} }}\ninitial = {{ value = 0, rate = {-belt!r} }}",
        )
        + f'[[force]]\nkind = "bushing"\non = "block"\nstiffness = [{m * w * w!r}, 0, 0, 0, 0, 0]\n\n'
        + force("force", "block", f"{F!r}*sin({wf!r}*t)", (1, 0, 0))
        + output("x", "block", "position")
        + output("v", "block", "velocity")
        + output("rub", "rubs", "friction_force")
    )

    def rub(v):
        s = v - belt
        return -(mu + (static - mu) * np.exp(-((s / (5 * v0)) ** 2))) * N * np.tanh(s / v0)

    def truth(t):
        f = lambda s, y: [y[1], (-m * w * w * y[0] + F * math.sin(wf * s) + rub(y[1])) / m]
        y = ode(f, [0.0, 0.0], t, atol=np.array([1e-11 * x1, 1e-11 * x1 * w]))
        none = 0 * t
        at = lambda c: np.stack([c, none, none], 1)
        return {"x": at(y[:, 0]), "v": at(y[:, 1]), "rub": rub(y[:, 1])[:, None]}

    return Scene(text, truth, {}, f"scale {v0 / (x1 * w):.2g}, belt {belt / (x1 * w):.2g}, {static / mu:.2g} static")


KINDS = [cam_follower, rope_machine, pin_in_slot, regularised_rub]
