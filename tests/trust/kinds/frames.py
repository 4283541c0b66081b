"""Beams as a stranger mounts and loads them: several loads at once, stubby frames, springs along, all supports, pieces that taper, bodies
in between, kept modes. Small deflections.

Truths by finite elements of beams in space (`space_frame.py`)."""
import math

import numpy as np

from scene import Scene, beam, force, joint, output, pick, rigid, section_of, simulation, sizes, spring, weld
from truths.space_frame import SpaceFrame, axes_of
from truths.formulas import Linear

SHAPES = ("rectangle", "circle", "tube", "general", "box")
SMALL = 1e-3  # deflection over length: what is of second order stays below a tenth of the claim


def vector(r, size=1.0):
    v = np.array([r.gauss(0, 1) for _ in range(3)])
    return size * v / np.linalg.norm(v)


def still(t, **values):
    return {name: np.tile(np.asarray(v, float), (len(t), 1)) for name, v in values.items()}


def rise(T):
    """A load that comes within T and stays, as an expression and a function."""
    return f"(t < {T!r} ? sin(pi*t/{2 * T!r})^2 : 1)", lambda t: np.where(t < T, np.sin(np.pi * np.minimum(t, T) / (2 * T)) ** 2, 1.0)


def motion_of(frame, f, F, t):
    """Displacements (times x nodes x 6) under f F(t) from rest."""
    K, M, free = frame.matrices()
    u = np.zeros((len(t), len(f)))
    u[:, free] = Linear(M[np.ix_(free, free)], K[np.ix_(free, free)]).respond(f[free], F, t, fine=20000)
    return u.reshape(len(t), -1, 6)


def first_period(frame):
    K, M, free = frame.matrices()
    return 2 * math.pi / Linear(M[np.ix_(free, free)], K[np.ix_(free, free)]).omega[0]


def frames_line(places):
    return "frames = { " + ", ".join(f"{name} = {x!r}" for name, x in places.items()) + " }"


def in_time(r, frame):
    """Duration, samples a second, what goes in [simulation], the loads' factor as text and function (none: at rest)."""
    if r.random() < 0.5:
        return 0.02, 200.0, {"start": "static"}, "1", None
    T = first_period(frame)
    text, F = rise(T * r.uniform(0.3, 2))
    duration = T * r.uniform(2, 4)
    return duration, 300 / duration, {}, text, F


def truth_of(frame, f, F, places):
    """places: {output: (node, first place)}."""

    def truth(t):
        u = np.tile(frame.rest(f), (len(t), 1, 1)) if F is None else motion_of(frame, f, F, t)
        return {name: p + u[:, node, :3] for name, (node, p) in places.items()}

    return truth


def mixed_loads(r):
    """A clamped beam in any axes under several loads at once: forces and torques at places along it, loads along its length, its weight."""
    L, m, s = sizes(r, slender=(3, 30), shapes=SHAPES)
    turn = [r.uniform(-1.5, 1.5) for _ in range(3)]
    R = axes_of(turn)
    frame = SpaceFrame()
    root, tip = frame.node((0, 0, 0)), frame.node(R @ [L, 0, 0])
    nodes = frame.beam(root, tip, s, m, R, elements=10)
    frame.hold(root)
    EI = m["E"] * min(s["iy"], s["iz"])
    size = 3 * EI / L**2
    loads, text = np.zeros(6 * len(frame.places)), []
    for _ in range(r.randint(2, 4)):
        kind, where = pick(r, "force", "torque", "distributed"), r.randint(3, 10)
        d = vector(r, size * 10 ** r.uniform(-0.5, 0.5))
        on = "arm" if kind == "distributed" else "arm.tip" if where == 10 else f"arm.p{where}"
        d = d * (L if kind == "torque" else 1 / L if kind == "distributed" else 1)
        text.append((kind, on, d))
        part = frame.along(nodes, d) if kind == "distributed" else None
        loads += part if part is not None else frame.at(nodes[where], **{"force" if kind == "force" else "moment": d})
    g = vector(r, 1.0) if r.random() < 0.5 else np.zeros(3)
    g = g * size / (m["rho"] * s["area"] * L)
    scale = SMALL * L * r.uniform(0.05, 1) / np.abs(frame.rest(loads + frame.weight(g))[:, :3]).max()
    heavy = bool(g.any())
    f = scale * (loads + frame.weight(g))
    if heavy:  # weight does not rise
        duration, rate, more, factor, F = 0.02, 200.0, {"start": "static"}, "1", None
    else:
        duration, rate, more, factor, F = in_time(r, frame)
    words = (
        simulation(duration, rate, scale * g, **more)
        + beam("arm", L, s["text"], m, frames_line({f"p{k}": k / 10 for k in range(3, 10)}))
        + weld("clamp", "ground", "arm.root", f"rotation = {turn}")
    )
    for kind, on, d in text:
        words += force(kind, on, f"{float(np.linalg.norm(scale * d))!r}*{factor}", d)
    words += output("tip", "arm.tip", "position") + output("p5", "arm.p5", "position")
    places = {"tip": (tip, R @ [L, 0, 0]), "p5": (nodes[5], R @ [L / 2, 0, 0])}
    size = float(np.linalg.norm(frame.rest(f)[tip][:3]))
    kinds = ", ".join(k for k, _, _ in text)
    return Scene(
        words,
        truth_of(frame, f, F, places),
        {"tip": size, "p5": size} if F is None else {},
        f"{s['shape']}, length/height {L / s['height']:.2g}, {kinds}{', weight' if heavy else ''}{', in time' if F else ''}",
    )


def stubby_frame(r):
    """Stubby frames of welded beams, two to four, with forces, moments and loads along a beam; clamped or hinged feet"""
    _, m, s = sizes(r, slender=(1, 1), shapes=("rectangle", "circle", "tube"))
    height = s["height"]
    form = pick(r, "L", "portal", "gable", "T")
    a, b = height * r.uniform(2.5, 9), height * r.uniform(2.5, 9)
    corners = {
        "L": [(0, 0), (0, a), (b, a)],
        "portal": [(0, 0), (0, a), (b, a), (b, 0)],
        "gable": [(0, 0), (0, a), (b / 2, a + b * 0.2), (b, a), (b, 0)],
        "T": [(0, 0), (0, a), (b, a), (-b, a)],
    }[form]
    bars = [(0, 1), (1, 2), (1, 3)] if form == "T" else [(k, k + 1) for k in range(len(corners) - 1)]
    feet = [0] if form in "LT" else [0, len(corners) - 1]
    hinged = form in ("portal", "gable") and r.random() < 0.5
    frame = SpaceFrame()
    at = [frame.node((*c, 0)) for c in corners]
    text, turns, along = "", [], []
    for i, (p, q) in enumerate(bars):
        d = np.subtract(corners[q], corners[p])
        turns.append(math.atan2(d[1], d[0]))
        along.append(frame.beam(at[p], at[q], s, m, axes_of([0, 0, turns[i]])))
        text += beam(f"b{i}", float(np.hypot(*d)), s["text"], m)
    plane = (2, 3, 4)
    for n in range(len(frame.places)):
        frame.hold(n, plane)
    for foot in feet:
        frame.hold(at[foot], (0, 1) if hinged else (0, 1, 5))
    kind = "revolute" if hinged else "weld"
    text += joint("foot0", kind, "ground", "b0.root", f"rotation = [0, 0, {turns[0]!r}]")
    for i in range(1, len(bars)):
        before = 0 if form == "T" else i - 1
        text += weld(f"w{i}", f"b{before}.tip", f"b{i}.root", f"rotation = [0, 0, {turns[i] - turns[before]!r}]")
    if len(feet) == 2:
        x, y = corners[-1]
        text += joint("foot1", kind, "ground", f"b{len(bars) - 1}.tip", f"position = [{x!r}, {y!r}, 0]\nrotation = [0, 0, {turns[-1]!r}]")
    f = np.zeros(6 * len(frame.places))
    loads = []
    for _ in range(r.randint(1, 3)):
        bar, what = r.randrange(len(bars)), pick(r, "force", "torque", "distributed")
        if what != "distributed" and bars[bar][1] in feet:
            bar = 0
        d = np.array([r.gauss(0, 1), r.gauss(0, 1), 0.0]) if what != "torque" else np.array([0, 0, r.gauss(0, 1) * a])
        d = d / a if what == "distributed" else d
        loads.append((what, f"b{bar}" if what == "distributed" else f"b{bar}.tip", d))
        if what == "distributed":
            f += frame.along(along[bar], d)
        else:
            f += frame.at(at[bars[bar][1]], **{"force" if what == "force" else "moment": d})
    scale = SMALL * min(a, b) * r.uniform(0.05, 1) / np.abs(frame.rest(f)[:, :3]).max()
    f = f * scale
    duration, rate, more, factor, F = in_time(r, frame)
    for what, on, d in loads:
        text += force(what, on, f"{float(np.linalg.norm(scale * d))!r}*{factor}", d)
    places = {f"p{i}": (at[q], np.array([*corners[q], 0.0])) for i, (_, q) in enumerate(bars) if q not in feet}
    text = simulation(duration, rate, **more) + text
    for i, (_, q) in enumerate(bars):
        if q not in feet:
            text += output(f"p{i}", f"b{i}.tip", "position")
    size = float(np.abs(frame.rest(f)[:, :3]).max())
    what = f"{form}{', hinged' if hinged else ''}, lengths/height {a / height:.2g}, {b / height:.2g}{', in time' if F else ''}"
    return Scene(text, truth_of(frame, f, F, places), {name: size for name in places} if F is None else {}, what)


def springs_along(r):
    """A beam on springs along its length, like a rail, one end clamped, hinged or free; a load between them, at rest or pushed"""
    L, m, s = sizes(r, slender=(5, 40), shapes=("rectangle", "circle", "tube", "box"))
    n, end = r.randint(2, 6), pick(r, "weld", "revolute", "free")
    EI = m["E"] * s["iz"]
    k = EI / L**3 * 10 ** r.uniform(-0.5, 2.5)
    frame = SpaceFrame()
    root, tip = frame.node((0, 0, 0)), frame.node((L, 0, 0))
    nodes = frame.beam(root, tip, s, m, np.eye(3), elements=2 * n)
    for node in range(len(frame.places)):
        frame.hold(node, (2, 3, 4))
    if end != "free":
        frame.hold(root, (0, 1, 5) if end == "weld" else (0, 1))
    else:
        frame.hold(root, (0,))
    at = [2 * i for i in range(n + 1)] if end == "free" else [2 * i for i in range(1, n + 1)]
    h = L * r.uniform(0.2, 1)
    ground = ", ".join(f"g{i} = [{nodes_x!r}, {-h!r}, 0]" for i, nodes_x in ((i, L * i / (2 * n)) for i in at))
    for i in at:
        frame.spring(nodes[i], np.diag([0, k, 0]))
    where = r.randint(1, 2 * n)
    f = frame.at(nodes[where], (0, -1, 0))
    F0 = SMALL * L * r.uniform(0.05, 1) / np.abs(frame.rest(f)[:, :3]).max()
    f = f * F0
    duration, rate, more, factor, F = in_time(r, frame)
    model = pick(r, "", "", 'model = "mixed"\n', 'model = "lumped"\nelements = 20\n')
    text = (
        f"[ground]\nframes = {{ {ground} }}\n\n"
        + simulation(duration, rate, **more)
        + beam("rail", L, s["text"], m, model + frames_line({f"p{i}": i / (2 * n) for i in range(1, 2 * n)}))
    )
    name = lambda i: "rail.root" if i == 0 else "rail.tip" if i == 2 * n else f"rail.p{i}"
    if end == "free":  # up and down and about itself, which the springs hold
        text += rigid("shoe", 0.0, (0, 0, 0)) + joint("way", "prismatic", "ground", "shoe", "axis = [0, 1, 0]")
        text += joint("end", "revolute", "shoe", "rail.root")
    else:
        text += joint("end", end, "ground", "rail.root")
    for i in at:
        text += spring(name(i), f"ground.g{i}", k, rest=h)
    text += force("force", name(where), f"{F0!r}*{factor}", (0, -1, 0))
    text += output("load", name(where), "position") + output("tip", "rail.tip", "position")
    places = {"load": (nodes[where], np.array([L * where / (2 * n), 0, 0])), "tip": (tip, np.array([L, 0, 0]))}
    size = float(np.abs(frame.rest(f)[:, :3]).max())
    return Scene(
        text,
        truth_of(frame, f, F, places),
        {"load": size, "tip": size} if F is None else {},
        f"{n} springs of {k * L**3 / EI:.2g} EI/L^3, root {end}{', in time' if F else ''} {model.strip()[:16]}",
    )


def supports(r):
    """A beam between two supports, clamped, hinged, sliding or free, with whatever `boundary` and model the author took for it"""
    L, m, s = sizes(r, slender=(15, 60), shapes=("rectangle", "circle", "tube"))
    ends = pick(r, ("weld", "revolute"), ("weld", "roller"), ("revolute", "roller"), ("weld", "guide"), ("weld", "free"))
    boundary = pick(r, "", "", "clamped-free", "supported-supported", "supported-free", "free-free", "clamped-clamped", "clamped-supported")
    modal = r.random() < 0.4
    count = r.randint(2, 5)
    model = f'model = "modal"\nmodes = {{ bending_xy = {[k + 1 for k in range(count)]} }}' if modal else f"elements = {pick(r, 6, 10, 16)}"
    more = model + (f'\nboundary = "{boundary}"' if boundary else "") + "\nframes = { mid = 0.5 }"
    frame = SpaceFrame()
    root, tip = frame.node((0, 0, 0)), frame.node((L, 0, 0))
    nodes = frame.beam(root, tip, s, m, np.eye(3), elements=12)
    for node in range(len(frame.places)):
        frame.hold(node, (2, 3, 4))
    frame.hold(root, (0, 1, 5) if ends[0] == "weld" else (0, 1))
    held = {"revolute": (0, 1), "roller": (1,), "guide": (1, 5), "free": ()}[ends[1]]
    frame.hold(tip, held)
    mid = nodes[6]
    f = frame.at(mid, (0, 1, 0))
    F0 = 0.3 * SMALL * L * r.uniform(0.05, 1) / np.abs(frame.rest(f)[:, :3]).max()
    f = f * F0
    duration, rate, more_sim, factor, F = in_time(r, frame)
    text = (
        simulation(duration, rate, **more_sim)
        + beam("b", L, s["text"], m, more)
        + joint("left", ends[0], "ground", "b.root")
        + force("force", "b.mid", f"{F0!r}*{factor}", (0, 1, 0))
        + output("mid", "b.mid", "position")
    )
    place = f"position = [{L!r}, 0, 0]"
    if ends[1] == "revolute":
        text += joint("right", "revolute", "ground", "b.tip", place)
    elif ends[1] == "guide":
        text += joint("right", "prismatic", "ground", "b.tip", f"axis = [1, 0, 0]\n{place}")
    elif ends[1] == "roller":
        text += joint("right", "point-on-line", "ground", "b.tip", f"axis = [1, 0, 0]\n{place}")
    else:
        text += output("tip", "b.tip", "position")
    places = {"mid": (mid, np.array([L / 2, 0, 0]))} | ({"tip": (tip, np.array([L, 0, 0]))} if ends[1] == "free" else {})
    size = float(np.abs(frame.rest(f)[:, :3]).max())
    return Scene(
        text,
        truth_of(frame, f, F, places),
        {name: size for name in places} if F is None else {},
        f"{ends[0]}-{ends[1]}, {'modal ' + str(count) if modal else 'elements'}, {boundary or 'no boundary'}{', in time' if F else ''}",
    )


def kept_modes(r):
    """A clamped beam with a body at its tip or between, few modes kept or eigenforms taken, loads along it, at rest or pushed"""
    L, m, s = sizes(r, slender=(12, 50), shapes=("rectangle", "circle", "tube"))
    frame = SpaceFrame()
    root, tip = frame.node((0, 0, 0)), frame.node((L, 0, 0))
    nodes = frame.beam(root, tip, s, m, np.eye(3), elements=12)
    frame.hold(root)
    rod = m["rho"] * s["area"] * L
    mass, where = rod * pick(r, 0.0, 10 ** r.uniform(-1, 1)), pick(r, 12, 12, 6)
    J = mass * (0.05 * L) ** 2
    if mass:
        frame.body(nodes[where], mass, (J, J, J))
    d = np.array([0.0, r.gauss(0, 1), r.gauss(0, 1) if r.random() < 0.5 else 0.0])
    spread, place = r.random() < 0.4, pick(r, 3, 6, 12)
    f = frame.along(nodes, d) if spread else frame.at(nodes[place], d)
    scale = SMALL * L * r.uniform(0.05, 1) / np.abs(frame.rest(f)[:, :3]).max()
    f = f * scale
    duration, rate, more, factor, F = in_time(r, frame)
    few = pick(r, "keep_modes = 1", "keep_modes = 2", "keep_modes = 4", "keep_modes = 8", "keep_modes = 3\nkeep_static = false")
    name = lambda i: "b.tip" if i == 12 else f"b.p{i}"
    text = (
        simulation(duration, rate, **more)
        + beam("b", L, s["text"], m, few + "\nframes = { p3 = 0.25, p6 = 0.5 }")
        + weld("clamp", "ground", "b.root")
        + (rigid("load", mass, (J, J, J)) + weld("grip", name(where), "load") if mass else "")
        + force("distributed" if spread else "force", "b" if spread else name(place), f"{float(scale * np.linalg.norm(d))!r}*{factor}", d)
        + output("tip", "b.tip", "position")
        + output("p6", "b.p6", "position")
    )
    places = {"tip": (tip, np.array([L, 0, 0])), "p6": (nodes[6], np.array([L / 2, 0, 0]))}
    size = float(np.abs(frame.rest(f)[:, :3]).max())
    few = few.replace("\n", ", ")
    return Scene(
        text,
        truth_of(frame, f, F, places),
        {name: size for name in places} if F is None else {},
        f"{few}; body {mass / rod:.2g} of the beam at {where / 12:.2g}; load {'spread' if spread else f'at {place / 12:.2g}'}"
        f"{', in time' if F else ''}",
    )


def tapered(r):
    """A clamped beam whose section tapers or steps, under a load at its tip, along, across and about its axis, or its weight"""
    L, m, s0 = sizes(r, slender=(10, 40), shapes=("rectangle", "circle"))
    shape, h0 = s0["shape"], s0["height"]
    count = r.randint(2, 4)
    at = [0.0] + sorted(r.uniform(0.2, 0.9) for _ in range(count - 2)) + [1.0]
    heights = [h0 * r.uniform(0.5, 1.2) for _ in at]
    width = h0 * r.uniform(0.6, 1.5)
    stepped = r.random() < 0.3
    lines, pieces = [], []

    def numbers(h):
        return section_of(r, shape, h, width) | {"shape": shape, "height": h}

    for k, (x, h) in enumerate(zip(at, heights)):
        inner = numbers(h)["text"].strip("{} ")
        if stepped and k > 0:
            before = numbers(heights[k - 1])["text"].strip("{} ")
            lines.append(f"{{ at = {x!r}, {before} }}")
        if not (stepped and x == 1.0):
            lines.append(f"{{ at = {x!r}, {inner} }}")
        if k > 0:
            pieces.append((at[k - 1], x, heights[k - 1], heights[k - 1] if stepped else h))
    frame = SpaceFrame()
    first = frame.node((0, 0, 0))
    frame.hold(first)
    last = first
    for x0, x1, ha, hb in pieces:
        n = 1 if ha == hb else 30
        for k in range(n):
            node = frame.node((L * (x0 + (x1 - x0) * (k + 1) / n), 0, 0))
            frame.beam(last, node, numbers(ha + (hb - ha) * (k + 0.5) / n), m, np.eye(3), elements=4 if n == 1 else 1)
            last = node
    what = pick(r, "across", "along", "torque", "weight")
    f = {
        "across": lambda: frame.at(last, (0, 1, 0)),
        "along": lambda: frame.at(last, (1, 0, 0)),
        "torque": lambda: frame.at(last, moment=(1, 0, 0)),
        "weight": lambda: frame.weight((0, -1, 0)),
    }[what]()
    u = frame.rest(f)[last]
    size = abs(u[3]) if what == "torque" else np.abs(u[:3]).max() / L
    F0 = (1e-5 if what == "along" else SMALL) * r.uniform(0.05, 1) / size
    u = u * F0
    gravity = (0, -F0, 0) if what == "weight" else (0, 0, 0)
    text = (
        simulation(0.02, 200, gravity, start="static")
        + beam("b", L, "{}", m).replace("section = {}", "sections = [\n  " + ",\n  ".join(lines) + ",\n]")
        + weld("clamp", "ground", "b.root")
        + (
            ""
            if what == "weight"
            else force("torque" if what == "torque" else "force", "b.tip", F0, {"across": (0, 1, 0)}.get(what, (1, 0, 0)))
        )
        + output("tip", "b.tip", "rotation" if what == "torque" else "position")
    )
    true = u[3:] if what == "torque" else np.array([L, 0, 0]) + u[:3]
    scale = float(np.linalg.norm(u[3:] if what == "torque" else u[:3]))
    return Scene(
        text, lambda t: still(t, tip=true), {"tip": scale}, f"{shape}, {'steps' if stepped else 'tapers'} at {count} places, {what}"
    )


def bracket_in_space(r):
    """Two or three welded beams at right angles in space with a rigid body in a corner, loads in any direction; slender to stubby"""
    _, m, s = sizes(r, slender=(1, 1), shapes=("rectangle", "circle", "box"))
    h = s["height"]
    lengths = [h * r.uniform(4, 25) for _ in range(r.randint(2, 3))]
    turns = [
        [0.0, 0.0, 0.0],
        pick(r, [0.0, 0.0, math.pi / 2], [0.0, -math.pi / 2, 0.0]),
        pick(r, [0.0, -math.pi / 2, 0.0], [math.pi / 2, 0.0, 0.0]),
    ]
    frame = SpaceFrame()
    nodes, R, text, last = [frame.node((0, 0, 0))], np.eye(3), "", "ground"
    frame.hold(nodes[0])
    mass = m["rho"] * s["area"] * h * 20 * pick(r, 0.0, 1.0)
    J = 0.1 * mass * h * h * 4
    for i, length in enumerate(lengths):
        R = R @ axes_of(turns[i])
        nodes.append(frame.node(frame.places[nodes[-1]] + R @ [length, 0, 0]))
        frame.beam(nodes[-2], nodes[-1], s, m, R, elements=6)
        text += beam(f"b{i}", length, s["text"], m)
        text += weld(f"w{i}", last, f"b{i}.root", f"rotation = {turns[i]}")
        last = f"b{i}.tip"
        if i == 0 and mass:
            text += rigid("block", mass, (J, J, J)) + weld("held", "b0.tip", "block")
            frame.body(nodes[-1], mass, (J, J, J))
    d, T = vector(r), vector(r) * pick(r, 0.0, float(np.mean(lengths)))
    f = frame.at(nodes[-1], d, T)
    scale = SMALL * min(lengths) * r.uniform(0.05, 1) / np.abs(frame.rest(f)[:, :3]).max()
    f = f * scale
    duration, rate, more, factor, F = in_time(r, frame)
    text = simulation(duration, rate, **more) + text + force("force", last, f"{scale!r}*{factor}", d)
    if T.any():
        text += force("torque", last, f"{float(scale * np.linalg.norm(T))!r}*{factor}", T)
    places = {}
    for i in range(len(lengths)):
        text += output(f"p{i}", f"b{i}.tip", "position")
        places[f"p{i}"] = (nodes[i + 1], frame.places[nodes[i + 1]])
    size = float(np.abs(frame.rest(f)[:, :3]).max())
    said = ", ".join(f"{x / h:.2g}" for x in lengths)
    return Scene(
        text,
        truth_of(frame, f, F, places),
        {k: size for k in places} if F is None else {},
        f"{s['shape']}, lengths/height {said}{', in time' if F else ''}",
    )


def pushed_rocket(r):
    """A beam that flies freely is pushed at one end, along and across; how its ends move"""
    L, m, s = sizes(r, slender=(6, 40), shapes=("rectangle", "circle", "tube"))
    frame = SpaceFrame()
    root, tip = frame.node((0, 0, 0)), frame.node((L, 0, 0))
    frame.beam(root, tip, s, m, np.eye(3), elements=16)
    for node in range(len(frame.places)):
        frame.hold(node, (2, 3, 4))
    K, M, free = frame.matrices()
    modes = Linear(M[np.ix_(free, free)], K[np.ix_(free, free)])
    along = r.random() < 0.5
    w = [x for x in modes.omega if x > 1e-3 * modes.omega[3]]
    T = 2 * math.pi / (math.pi / L * math.sqrt(m["E"] / m["rho"]) if along else w[0])
    push, duration = T * r.uniform(0.3, 1.5), T * r.uniform(2, 4)
    rod = m["rho"] * s["area"] * L
    # It moves by a share of a thousandth of its length in the time: turns stay small.
    F0 = SMALL * L * r.uniform(0.1, 1) * rod / (0.5 * push * duration)
    text = (
        simulation(duration, 300 / duration)
        + beam("rocket", L, s["text"], m)
        + joint("flight", "free", "ground", "rocket")
        + force("force", "rocket.root", f"t < {push!r} ? {F0!r}*sin(pi*t/{push!r})^2 : 0", (1, 0, 0) if along else (0, 1, 0))
        + output("tail", "rocket.root", "position")
        + output("nose", "rocket.tip", "position")
    )

    def truth(t):
        f = np.zeros(len(K))
        f[6 * root + (0 if along else 1)] = 1.0
        p = modes.modes.T @ f[free]
        pulse = lambda x: F0 * np.where(x < push, np.sin(np.pi * x / push) ** 2, 0.0)
        rigid_ones = modes.omega < 1e-3 * modes.omega[3]
        q = np.zeros((len(t), len(p)))
        some = Linear(np.eye(int((~rigid_ones).sum())), np.diag(modes.omega[~rigid_ones] ** 2))
        # Unit modes come out in the order of their frequencies, each of one sign or the other.
        q[:, ~rigid_ones] = some.respond(p[~rigid_ones], pulse, t, fine=20000)
        x = np.minimum(t, push)
        v = F0 * (x / 2 - push / (4 * np.pi) * np.sin(2 * np.pi * x / push))
        moved = F0 * (x * x / 4 + push**2 / (8 * np.pi**2) * (np.cos(2 * np.pi * x / push) - 1)) + v * (t - x)
        q[:, rigid_ones] = moved[:, None] * p[rigid_ones]
        u = np.zeros((len(t), len(K)))
        u[:, free] = q @ modes.modes.T
        return {"tail": u[:, 6 * root : 6 * root + 3], "nose": np.array([L, 0, 0]) + u[:, 6 * tip : 6 * tip + 3]}

    return Scene(text, truth, {}, f"{'along' if along else 'across'}, length/height {L / s['height']:.2g}, {duration / T:.1f} periods")


KINDS = [mixed_loads, stubby_frame, springs_along, supports, kept_modes, tapered, bracket_in_space, pushed_rocket]
