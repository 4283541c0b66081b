"""Bodies whose motion is known without the kernel map: closed forms of curved beams and plates, finite element modes, a frame of beams.

Each maker returns a Case: a mesh, the places and true motion of candidates for nodes, and the true motion of every vertex, linear in the
amplitude. Lengths in m, rotations in rad, arrays of points (N, 3). Python 3 with numpy and scipy.
"""

import dataclasses
import pathlib

import numpy as np

DATA = pathlib.Path(__file__).resolve().parents[2] / "unit" / "data" / "kernel_map"


@dataclasses.dataclass
class Case:
    name: str
    vertices: np.ndarray  # (M, 3)
    triangles: np.ndarray  # (K, 3)
    nodes: np.ndarray  # (N, 3)
    fields: list  # of (displacement of nodes, rotation of nodes or None, displacement of vertices)

    @property
    def rotations(self):
        return self.fields[0][1] is not None


def join(meshes):
    """Several meshes as one, without welding them."""
    vertices, triangles, first = [], [], 0
    for v, t in meshes:
        vertices.append(v)
        triangles.append(t + first)
        first += len(v)
    return np.vstack(vertices), np.vstack(triangles)


def box(lengths, cells, corner=(0.0, 0.0, 0.0)):
    """Closed surface of a block, a grid of cells on each face, welded, faces outward."""
    number, vertices, triangles = {}, [], []

    def vertex(p):
        if p not in number:
            number[p] = len(vertices)
            vertices.append([corner[d] + lengths[d] * p[d] / cells[d] for d in range(3)])
        return number[p]

    for d in range(3):
        e, f = (d + 1) % 3, (d + 2) % 3
        for side in (0, cells[d]):
            for i in range(cells[e]):
                for j in range(cells[f]):
                    quad = []
                    for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        p = [0, 0, 0]
                        p[d], p[e], p[f] = side, i + a, j + b
                        quad.append(vertex(tuple(p)))
                    if side == 0:
                        quad.reverse()
                    triangles += [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]
    return np.array(vertices), np.array(triangles)


def tube(centre, radius, around=16, closed=False):
    """Closed surface of a round bar along a line of points (n, 3); returns vertices, triangles and the row of the line of each vertex."""
    n = len(centre)
    tangent = np.gradient(centre, axis=0, edge_order=2)
    if closed:
        tangent = np.roll(centre, -1, 0) - np.roll(centre, 1, 0)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    side = np.cross(tangent[0], [0.3, 0.5, 0.81])
    angle = 2 * np.pi * np.arange(around) / around
    vertices, row = [], []
    for i in range(n):
        side = side - tangent[i] * (side @ tangent[i])
        side /= np.linalg.norm(side)
        other = np.cross(tangent[i], side)
        for a in angle:
            vertices.append(centre[i] + radius * (np.cos(a) * side + np.sin(a) * other))
            row.append(i)
    triangles = []
    # A closed line comes back with its frame turned: the last ring is joined to the first by the nearest corner.
    shift = 0
    if closed:
        shift = int(np.argmin(np.linalg.norm(np.array(vertices[:around]) - (vertices[(n - 1) * around] + centre[0] - centre[-1]), axis=1)))
    for i in range(n if closed else n - 1):
        j, turn = (i + 1) % n, shift if i == n - 1 else 0
        for k in range(around):
            a, b = i * around + k, i * around + (k + 1) % around
            c, d = j * around + (k + turn) % around, j * around + (k + 1 + turn) % around
            triangles += [[a, c, d], [a, d, b]]
    if not closed:
        for i, flip in ((0, False), (n - 1, True)):
            for k in range(1, around - 1):
                t = [i * around, i * around + k, i * around + k + 1]
                triangles.append([t[0], t[2], t[1]] if flip else t)
    return np.array(vertices), np.array(triangles), np.array(row)


def along(curve, turn, samples, start=0.0, end=1.0, closed=False):
    """Axis that keeps its length: displacement of the points curve(s) from their rotation turn(s), u' = theta x c', by Simpson's rule."""
    s = np.linspace(start, end, 2 * samples + 1)
    c, theta = curve(s), turn(s)
    h = (s[1] - s[0]) / 2.0
    middle = (s[1:] + s[:-1]) / 2.0
    eps = 1e-6
    tangent = lambda x: (curve(x + eps) - curve(x - eps)) / (2 * eps)
    rate = lambda x: np.cross(turn(x), tangent(x))
    step = h / 3.0 * (rate(s[:-1]) + 4.0 * rate(middle) + rate(s[1:]))
    u = np.vstack([np.zeros(3), np.cumsum(step, axis=0)])
    return s, c, u, theta


def beam_case(name, curve, turns, radius, count, rings=160, around=16, closed=False, shifts=None):
    """A round bar along curve(s), s in 0..1, whose sections stay rigid and turn by turns[k](s); count nodes on its axis, evenly."""
    fields = []
    dense = 20 * rings
    last = rings if closed else rings - 1
    at_ring = np.round(np.arange(rings) * (2 * dense) / last).astype(int)
    spans = count if closed else count - 1
    at_node = np.round(np.arange(count) * (2 * dense) / spans).astype(int)
    for k, turn in enumerate(turns):
        _, c, u, theta = along(curve, turn, dense)
        if shifts is not None and shifts[k] is not None:
            u = shifts[k](np.linspace(0.0, 1.0, 2 * dense + 1))
        v, t, row = tube(c[at_ring], radius, around, closed)
        i = at_ring[row]
        truth = u[i] + np.cross(theta[i], v - c[i])
        fields.append((u[at_node], theta[at_node], truth))
    return Case(name, v, t, c[at_node], fields)


def quarter_circle(count, radius=0.05, plain=False):
    """Quarter circle of radius 1 held at one end: shapes under forces at the other (Timoshenko, Strength of materials), and a waved one."""
    a = np.pi / 2
    curve = lambda s: np.stack([np.sin(a * s), 1.0 - np.cos(a * s), 0.0 * s], 1)
    # Force in the plane at the end, along its radius and along its tangent: moment about z by statics, integrated.
    radial = lambda s: np.stack([0 * s, 0 * s, np.sin(a * s)], 1)
    tangential = lambda s: np.stack([0 * s, 0 * s, a * s - (1 - np.cos(a * s))], 1)
    # Force across the plane at the end: bending and torsion, EI / GJ = 1.3; angles by integration of the moments.

    def across(s):
        f = np.linspace(0.0, a, 4001)
        m, q = np.cos(f), 1.0 - np.sin(f)
        rate = np.stack([m * np.sin(f) + 1.3 * q * np.cos(f), -m * np.cos(f) + 1.3 * q * np.sin(f), 0 * f], 1)
        whole = np.vstack([np.zeros(3), np.cumsum((rate[1:] + rate[:-1]) / 2 * (f[1] - f[0]), axis=0)])
        x = np.clip(a * np.asarray(s), 0.0, a)
        return np.stack([np.interp(x, f, whole[:, d]) for d in range(3)], 1)

    wave = lambda s: np.stack([0 * s, 0 * s, np.sin(2 * np.pi * s)], 1)
    return beam_case("quarter circle", curve, [radial, tangential, across, wave], radius, count)


def ring(count, radius=0.08, orders=(2,)):
    """Ring of radius 1 in its free modes (Love, A treatise on the mathematical theory of elasticity, 293): in its plane, across it with
    twist, and the roll of all sections about the axis."""
    f = lambda s: 2 * np.pi * s
    curve = lambda s: np.stack([np.cos(f(s)), np.sin(f(s)), 0 * s], 1)
    turns, shifts = [], []
    for n in orders:
        turns.append(lambda s, n=n: np.stack([0 * s, 0 * s, (n - 1.0 / n) * np.sin(n * f(s))], 1))
        # Radial cos n phi, tangential -sin n phi / n: no stretch.
        shifts.append(
            lambda s, n=n: np.cos(n * f(s))[:, None] * curve(s)
            - np.sin(n * f(s))[:, None] / n * np.stack([-np.sin(f(s)), np.cos(f(s)), 0 * s], 1)
        )
        # Across: u_z = cos n phi; slope along the tangent is the turn about the radius with minus sign; twist about the tangent.

        def twist(s, n=n):
            radial, tangent = curve(s), np.stack([-np.sin(f(s)), np.cos(f(s)), 0 * s], 1)
            return n * np.sin(n * f(s))[:, None] * -radial + (n * n / 2.0) * np.cos(n * f(s))[:, None] * tangent * -1.0

        turns.append(twist)
        shifts.append(lambda s, n=n: np.stack([0 * s, 0 * s, np.cos(n * f(s))], 1))
    turns.append(lambda s: np.stack([-np.sin(f(s)), np.cos(f(s)), 0 * s], 1))
    shifts.append(lambda s: np.zeros((len(s), 3)))
    case = beam_case("ring", curve, turns, radius, count, rings=200, closed=True, shifts=shifts)
    return case


def helix(count, turns=2.0, pitch=0.4, radius=0.05):
    """Helix of radius 1 held at one end, its sections turning about fixed directions."""
    f = lambda s: 2 * np.pi * turns * s
    curve = lambda s: np.stack([np.cos(f(s)), np.sin(f(s)), pitch * turns * s], 1)
    fields = [
        lambda s: np.stack([0 * s, 0 * s, s], 1),
        lambda s: np.stack([s**2, 0.5 * s, 0 * s], 1),
        lambda s: np.stack([0.3 * np.sin(f(s)) * s, -0.3 * np.cos(f(s)) * s, 0.2 * s], 1),
    ]
    return beam_case("helix", curve, fields, radius, count, rings=300)


def beam_stiffness(a, b):
    """Stiffness 12 x 12 of a round bar between two points: bending 1, torsion 1 / 1.3, stretch 3 / r^2 with r = 0.03."""
    axis = (b - a) / np.linalg.norm(b - a)
    length = np.linalg.norm(b - a)
    side = np.cross(axis, [0.31, 0.52, 0.79])
    side /= np.linalg.norm(side)
    turn = np.stack([axis, side, np.cross(axis, side)])
    k = np.zeros((12, 12))
    stretch, torsion = 4.0 / 0.03**2 / length, 1.0 / 1.3 / length
    for i, value in ((0, stretch), (3, torsion)):
        k[i, i] = k[i + 6, i + 6] = value
        k[i, i + 6] = k[i + 6, i] = -value
    bend = np.array([[12, 6 * length, -12, 6 * length], [6 * length, 4 * length**2, -6 * length, 2 * length**2]])
    bend = np.vstack([bend, -bend[0], [6 * length, 2 * length**2, -6 * length, 4 * length**2]]) / length**3
    for rows, sign in (((1, 5, 7, 11), (1, 1, 1, 1)), ((2, 4, 8, 10), (1, -1, 1, -1))):
        for i in range(4):
            for j in range(4):
                k[rows[i], rows[j]] += bend[i, j] * sign[i] * sign[j]
    whole = np.kron(np.eye(4), turn)
    return whole.T @ k @ whole


BICYCLE = {
    "points": [[0, 0, 0], [-0.12, 0, 0.5], [0.48, 0, 0.6], [0.5, 0, 0.48], [-0.42, 0.06, 0.05], [-0.42, -0.06, 0.05]],
    "tubes": [(0, 1), (1, 2), (2, 3), (0, 3), (0, 4), (0, 5), (1, 4), (1, 5)],
}


def bicycle_frame(per_tube, radius=0.018, rings=60, fine=16):
    """Frame of tubes, each a mesh of its own: four free bending modes of beams (lumped masses), nodes at the joints and between."""
    from scipy.linalg import eigh

    points = np.array(BICYCLE["points"], float)
    places = [p for p in points]
    tubes = []
    for a, b in BICYCLE["tubes"]:
        inner = [len(places) + k for k in range(fine - 1)]
        places += [points[a] + (points[b] - points[a]) * (k + 1) / fine for k in range(fine - 1)]
        tubes.append([a] + inner + [b])
    places = np.array(places)
    size = 6 * len(places)
    k, m = np.zeros((size, size)), np.zeros(size)
    for line in tubes:
        for a, b in zip(line, line[1:]):
            dof = np.r_[6 * a : 6 * a + 6, 6 * b : 6 * b + 6]
            k[np.ix_(dof, dof)] += beam_stiffness(places[a], places[b])
            length = np.linalg.norm(places[b] - places[a])
            m[dof] += np.tile([1, 1, 1, 1e-4, 1e-4, 1e-4], 2) * length / 2
    _, shapes = eigh(k, np.diag(m), subset_by_index=[6, 9])
    # Displacement between the fine nodes: exact cubic of the beam, sections rigid.
    meshes, truth = [], [[] for _ in range(4)]
    for line in tubes:
        a, b = places[line[0]], places[line[-1]]
        s = np.linspace(0.0, 1.0, rings)
        v, t, row = tube(a + (b - a) * s[:, None], radius)
        meshes.append((v, t))
        axis = (b - a) / np.linalg.norm(b - a)
        h = np.linalg.norm(b - a) / fine
        for mode in range(4):
            q = shapes[:, mode].reshape(-1, 6)[line]
            e = np.minimum((s * fine).astype(int), fine - 1)
            x = (s * fine - e)[:, None]
            y = 1 - x
            slope = np.cross(q[:, 3:], axis)
            u0, u1, g0, g1 = q[e, :3], q[e + 1, :3], slope[e], slope[e + 1]
            across = y * y * (1 + 2 * x) * u0 + x * x * (3 - 2 * x) * u1 + h * x * y * y * g0 - h * x * x * y * g1
            straight = y * u0 + x * u1
            u = across + np.outer(((straight - across) @ axis), axis)
            rate = (-6 * x * y * u0 + 6 * x * y * u1) / h + y * (1 - 3 * x) * g0 + x * (3 * x - 2) * g1
            twist = ((y * q[e, 3:] + x * q[e + 1, 3:]) @ axis)[:, None] * axis
            theta = np.cross(axis, rate) + twist
            truth[mode].append(u[row] + np.cross(theta[row], v - (a + (b - a) * s[row, None])))
    pick = list(range(len(points)))
    for line in tubes:
        pick += [line[round(j * fine / per_tube)] for j in range(1, per_tube)]
    v, t = join(meshes)
    fields = []
    for mode in range(4):
        q = shapes[:, mode].reshape(-1, 6)
        fields.append((q[pick, :3], q[pick, 3:], np.vstack(truth[mode])))
    return Case("bicycle frame", v, t, places[pick], fields)


def bend_plate(p, middle, w, wx, wy):
    """Kirchhoff plate in the plane z = middle with deflection w(x, y): points follow the normals."""
    x, y, z = p[:, 0], p[:, 1], p[:, 2] - middle
    return np.stack([-z * wx(x, y), -z * wy(x, y), w(x, y)], 1)


def plate_shapes(a, b):
    """Deflections of a plate a x b with their slopes: bending, twist, saddle, a wave."""
    kx, ky = np.pi / a, np.pi / b
    return [
        (lambda x, y: x**2 / a, lambda x, y: 2 * x / a, lambda x, y: 0 * y),
        (lambda x, y: x * y / b, lambda x, y: y / b, lambda x, y: x / b),
        (
            lambda x, y: 0.3 * a * np.sin(kx * x) * np.cos(ky * y),
            lambda x, y: 0.3 * a * kx * np.cos(kx * x) * np.cos(ky * y),
            lambda x, y: -0.3 * a * ky * np.sin(kx * x) * np.sin(ky * y),
        ),
        (
            lambda x, y: 0.2 * a * np.cos(2 * kx * x),
            lambda x, y: -0.4 * a * kx * np.sin(2 * kx * x),
            lambda x, y: 0 * y,
        ),
    ]


def scattered(count, low, high, rng):
    """Points in a rectangle, the best of some candidates each: uneven but not on top of one another; its corners among them."""
    points = [np.array([x, y]) for x in (low[0], high[0]) for y in (low[1], high[1])][:count]
    while len(points) < count:
        candidates = rng.uniform(low, high, (8, 2))
        gap = [min(np.linalg.norm(c - p) for p in points) for c in candidates]
        points.append(candidates[int(np.argmax(gap))])
    return np.array(points)


def thin_plate(count, where="middle", seed=1, thickness=0.005, cells=(50, 40)):
    """Plate 1 x 0.8 with two faces; nodes in its middle surface or on one of its faces."""
    v, t = box((1.0, 0.8, thickness), (*cells, 1), (0, 0, -thickness / 2))
    at = scattered(count, (0.0, 0.0), (1.0, 0.8), np.random.default_rng(seed))
    nodes = np.column_stack([at, np.full(count, 0.0 if where == "middle" else thickness / 2)])
    fields = [(bend_plate(nodes, 0.0, *w), None, bend_plate(v, 0.0, *w)) for w in plate_shapes(1.0, 0.8)]
    return Case(f"thin plate, {where}", v, t, nodes, fields)


def thin_shell(count, where="middle", seed=1, thickness=0.005):
    """Third of a pipe, two faces 5 mm apart, which bends without stretch of its middle surface: the sheet rolls up and down."""
    wide, radius = 2 * np.pi / 3, 0.5
    v, t = box((1.0, wide, thickness), (40, 40, 1), (0, -wide / 2, -thickness / 2))
    at = scattered(count, (0.0, -wide / 2), (1.0, wide / 2), np.random.default_rng(seed))
    flat = np.column_stack([at, np.full(count, 0.0 if where == "middle" else thickness / 2)])

    def place(p):
        r = radius + p[:, 2]
        return np.stack([p[:, 0], r * np.sin(p[:, 1]), r * np.cos(p[:, 1])], 1)

    def motion(p, n):
        # Radial cos n phi, tangential - sin n phi / n, the normals follow.
        f, z = p[:, 1], p[:, 2]
        radial, tangential = np.cos(n * f), -np.sin(n * f) / n
        slope = (-n * np.sin(n * f) - tangential) / radius
        e_r, e_t = np.stack([0 * f, np.sin(f), np.cos(f)], 1), np.stack([0 * f, np.cos(f), -np.sin(f)], 1)
        return radial[:, None] * e_r + (tangential - z * slope)[:, None] * e_t

    fields = [(motion(flat, n), None, motion(v, n)) for n in (2, 3)]
    return Case(f"thin shell, {where}", place(v), t, place(flat), fields)


def thin_tube(count, where="middle", seed=1, thickness=0.004, length=0.8, radius=0.2):
    """Tube with two faces which goes oval without stretch of its middle surface, alike along it (Rayleigh) and growing (Love), n = 2, 3."""
    around, along_ = 72, 40
    phi = 2 * np.pi * np.arange(around) / around
    vertices, triangles = [], []
    for side in (-0.5, 0.5):
        for i in range(along_ + 1):
            vertices += [(length * i / along_, p, side * thickness) for p in phi]

    def at(side, i, k):
        return (side * (along_ + 1) + i) * around + k % around

    for k in range(around):
        for i in range(along_):
            for side in (0, 1):
                q = [at(side, i, k), at(side, i + 1, k), at(side, i + 1, k + 1), at(side, i, k + 1)]
                if side == 1:
                    q.reverse()
                triangles += [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]
        for i in (0, along_):
            q = [at(0, i, k), at(0, i, k + 1), at(1, i, k + 1), at(1, i, k)]
            if i:
                q.reverse()
            triangles += [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]
    rng = np.random.default_rng(seed)

    def place(p):
        return np.stack([p[:, 0], (radius + p[:, 2]) * np.sin(p[:, 1]), (radius + p[:, 2]) * np.cos(p[:, 1])], 1)

    height = 0.0 if where == "middle" else thickness / 2
    flat = []
    while len(flat) < count:
        # A third of them on the rims.
        across = [rng.choice([0.0, length]) if len(flat) < count // 3 else rng.uniform(0, length) for _ in range(12)]
        new = [np.array([x, rng.uniform(0, 2 * np.pi), height]) for x in across]
        gap = [min((np.linalg.norm(place(n[None]) - place(f[None])) for f in flat), default=1.0) for n in new]
        flat.append(new[int(np.argmax(gap))])
    flat, v = np.array(flat), np.array(vertices)

    def motion(p, n, grow):
        x, f, z = p[:, 0], p[:, 1], p[:, 2]
        g, dg = (x / length, np.full(len(x), 1 / length)) if grow else (np.ones(len(x)), np.zeros(len(x)))
        radial, tangential = g * np.cos(n * f), -g * np.sin(n * f) / n
        axial = -radius * dg * np.cos(n * f) / n**2
        slope = (-n * g * np.sin(n * f) - tangential) / radius
        e_r, e_t = np.stack([0 * f, np.sin(f), np.cos(f)], 1), np.stack([0 * f, np.cos(f), -np.sin(f)], 1)
        out = radial[:, None] * e_r + (tangential - z * slope)[:, None] * e_t
        out[:, 0] += axial - z * dg * np.cos(n * f)
        return out

    fields = [(motion(flat, n, g), None, motion(v, n, g)) for n in (2, 3) for g in (False, True)]
    return Case(f"thin tube, {where}", place(v), np.array(triangles), place(flat), fields)


def two_plates(count, gap=0.010, thickness=0.004, seed=1):
    """Two plates 1 x 0.8 with a gap, each bending in its own way; count nodes in all, on the outer faces."""
    low, t = box((1.0, 0.8, thickness), (40, 32, 1))
    high = low + [0, 0, thickness + gap]
    rng = np.random.default_rng(seed)
    half = count // 2
    a, b = scattered(half, (0, 0), (1.0, 0.8), rng), scattered(count - half, (0, 0), (1.0, 0.8), rng)
    nodes_a = np.column_stack([a, np.zeros(half)])
    nodes_b = np.column_stack([b, np.full(count - half, gap + 2 * thickness)])
    v, t = join([(low, t), (high, t)])
    shapes = plate_shapes(1.0, 0.8)
    fields = []
    for k in range(3):
        below, above = shapes[k], shapes[(k + 1) % 3]
        middle = thickness / 2, thickness / 2 + gap + thickness
        u = np.vstack([bend_plate(nodes_a, middle[0], *below), bend_plate(nodes_b, middle[1], *above)])
        fields.append((u, None, np.vstack([bend_plate(low, middle[0], *below), bend_plate(high, middle[1], *above)])))
    return Case("two plates", v, t, np.vstack([nodes_a, nodes_b]), fields)


def farthest(points, count, first=0):
    """Indices of count points, each next one the farthest from all before."""
    order = [first]
    distance = np.linalg.norm(points - points[first], axis=1)
    while len(order) < count:
        order.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[order[-1]], axis=1))
    return np.array(order)


def fe_body(name, count=None, pick=None):
    """A body of tests/unit/data/kernel_map, three modes of CalculiX; nodes: a farthest-point order or those picked."""
    with open(DATA / f"{name}.txt", encoding="utf-8") as file:
        m, k = map(int, file.readline().split())
        rows = np.loadtxt(file, max_rows=m)
        triangles = np.loadtxt(file, max_rows=k, dtype=int)
    v = rows[:, :3]
    if pick is None:
        pick = farthest(v, count)
    fields = [(rows[pick, 3 * i : 3 * i + 3], None, rows[:, 3 * i : 3 * i + 3]) for i in (1, 2, 3)]
    return Case({"conrod": "con rod", "channel": "chassis"}.get(name, name), v, triangles, v[pick], fields)


def normals_of(vertices, triangles):
    """Vertex normals, the sum of their triangles' by area."""
    corner = vertices[triangles]
    face = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    out = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(out, triangles[:, k], face)
    return out / np.maximum(np.linalg.norm(out, axis=1), 1e-300)[:, None]


def measure(case, scheme="auto", amplitude=1e-5, known=True):
    """Relative L2 error of the displacements and of the turns of the normals over all vertices, all fields together, and the map.

    known: the map is told what the nodes do, as a run tells it.
    """
    import flexframe

    size = np.linalg.norm(np.ptp(case.vertices, axis=0))
    kernel = flexframe.KernelMap(
        case.nodes,
        case.vertices,
        case.triangles.astype(np.int32),
        scheme=scheme,
        rotations=case.rotations,
        precise=True,
        motions=[f[0] for f in case.fields] if known else [],
        turns=[f[1] for f in case.fields] if known and case.rotations else [],
    )
    rest = normals_of(case.vertices, case.triangles)
    error = truth = turned = turn = 0.0
    for u, theta, field in case.fields:
        factor = amplitude * size / np.abs(field).max()
        found = kernel.apply_precise(factor * u, None if theta is None else factor * theta) / factor
        error += np.sum((found - field) ** 2) / np.sum(field**2)
        truth += 1.0
        wanted = normals_of(case.vertices + factor * field, case.triangles)
        got = normals_of(case.vertices + factor * found, case.triangles)
        turned += np.sum((got - wanted) ** 2) / np.sum((wanted - rest) ** 2)
        turn += 1.0
    return np.sqrt(error / truth), np.sqrt(turned / turn), kernel
