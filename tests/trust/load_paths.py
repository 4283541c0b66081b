"""Load paths of random structures:  load_paths.py FLEXFRAME [--count N] [--seed S] [--kind K] [--number N] [--short]
    [--keep FOLDER]

Cantilevers, columns, toggles, arches, portals and levers in a plane, from little bent to far beyond buckling, described as an author may
do it. `load-path` follows their states; the truth follows those of geometrically exact beams in absolute coordinates
(truths/plane_elastic.py) by a continuation of its own. Wrong is, without a warning: a state more than 1 % of the ranges of load and
outputs beside the true curve, a limit load more than 2 % off or missed, a state called stable that is not. Exit 1 if there is one, or one
that takes 300 s, or where more than a tenth of the structures that are right to a third of that are warned of.
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
from scipy.interpolate import CubicSpline
from scipy.linalg import eigvalsh, null_space

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from arguments import suite_parser  # noqa: E402
from kinds.bent import PLASTIC, RUBBER, SPRING_STEEL  # noqa: E402
from kinds.plane import bar  # noqa: E402
from scene import by_chance, pick  # noqa: E402
from truths.plane_machine import Machine  # noqa: E402

OFF, LIMIT = 0.01, 0.02
PER = 12  # places between two states of a truth
# What continuous integration runs of seed 1: one structure of each kind. Arch 4 is followed over 328 states, 10 over 68.
SHORT = [0, 1, 2, 10]
STEEL = {"E": 2.1e11, "rho": 7850.0, "poisson": 0.3}


def chosen(r):
    """What an author may write of a beam, mostly nothing."""
    return by_chance(
        r,
        (0.5, ""),
        (0.65, lambda r: f'model = "finite-element"\nelements = {r.randint(4, 20)}'),
        (0.8, lambda r: f'model = "mixed"\nvolumes = {r.randint(2, 6)}'),
        (0.9, 'effects = ["axial", "bending_xy", "stiffening"]'),
        (1.0, lambda r: f"keep_modes = {r.randint(2, 6)}"),
    )


def load(F):
    return repr(float(F)), lambda t: F * t


class Case:
    """A structure: `build(elements)` gives its Machine, whose loads are factors of t in the truth and stand at t = 1 in the scene."""

    def __init__(self, build, what, to=1.0):
        self.build, self.what, self.to = build, what, to


def clamped(L, s, m, stands, force, way, more):
    """A beam that stands at an angle on its clamp, a dead load along `way` at its tip."""

    def build(n):
        d = Machine(1.0)
        d.beam("beam", L, s, m, (0, 0, stands), elements=n, more=more)
        d.weld("clamp", (0, 0), "beam.root")
        d.force("beam.tip", way, load(force), name="load")
        d.position("tip", "beam.tip")
        d.reaction("foot", "clamp")
        return d

    return build


def cantilever(r):
    """A clamped beam under a dead load at its tip in any direction, from little to far"""
    m = pick(r, STEEL, SPRING_STEEL, PLASTIC, RUBBER)
    L = 10 ** r.uniform(-1, 0.7)
    s, _, _ = bar(r, L, (8, 100), m)
    force, way, more = 10 ** r.uniform(-2, 0.7) * m["E"] * s["iz"] / L**2, r.uniform(0.2, 2.9), chosen(r)
    build = clamped(L, s, m, 0, force, (math.cos(way), math.sin(way)), more)
    return Case(build, f"P L^2/EI = {force * L * L / (m['E'] * s['iz']):.2g} at {math.degrees(way):.0f} degrees, {more or 'auto'}")


def column(r):
    """A clamped column pressed by up to twice its critical load, with a small force across"""
    m = pick(r, STEEL, SPRING_STEEL, PLASTIC)
    L = 10 ** r.uniform(-1, 0.7)
    s, _, _ = bar(r, L, (20, 120), m)
    critical = math.pi**2 / 4 * m["E"] * s["iz"] / L**2
    force, share, more = critical * r.uniform(0.5, 2.0), 10 ** r.uniform(-3, -1.5), chosen(r)
    build = clamped(L, s, m, math.pi / 2, force, (share, -1), more)
    return Case(build, f"{force / critical:.2g} of the critical load, {share:.1g} of it across, {more or 'auto'}")


def toggle(r):
    """Two flat beams, hinged or clamped at their feet and at the apex, pushed down through flat"""
    m = pick(r, STEEL, SPRING_STEEL, PLASTIC)
    L = 10 ** r.uniform(-1, 0.5)
    s, _, _ = bar(r, L, (20, 100), m)
    angle, apex, feet, more = r.uniform(0.03, 0.25), pick(r, "weld", "revolute"), pick(r, "weld", "revolute"), chosen(r)
    side = 0.0 if r.random() < 0.5 else r.uniform(0.01, 0.05)
    # Of two hinged bars, and what their bending holds.
    bars = 2 * m["E"] * s["area"] * angle**3 * 0.385 / 2
    force = 2 * (bars + 24 * m["E"] * s["iz"] * angle / L**2 * (apex == "weld" or feet == "weld"))

    def build(n):
        d = Machine(1.0)
        x, y = L * math.cos(angle), L * math.sin(angle)
        d.beam("left", L, s, m, (0, 0, angle), elements=n, more=more)
        d.beam("right", L, s, m, (x, y, -angle), elements=n, more=more)
        getattr(d, feet)("a", (0, 0), "left.root")
        getattr(d, apex)("c", "left.tip", "right.root")
        getattr(d, feet)("b", (2 * x, 0), "right.tip")
        d.force("right.root", (side, -1), load(force), name="load")
        d.position("apex", "right.root")
        d.reaction("foot", "a")
        return d

    return Case(build, f"{math.degrees(angle):.1f} degrees, {feet} feet, {apex} at the apex, {side:.2g} aside, {more or 'auto'}")


def portal(r):
    """A portal frame pushed aside while its posts carry a share of what buckles them"""
    m = pick(r, STEEL, SPRING_STEEL, PLASTIC)
    H = 10 ** r.uniform(-0.7, 0.7)
    s, _, _ = bar(r, H, (15, 80), m)
    B = H * r.uniform(0.6, 2)
    feet, more = pick(r, "weld", "revolute"), chosen(r)
    k = m["E"] * s["iz"] / H**2
    aside, down = k * 10 ** r.uniform(-1.5, 0.5), k * r.uniform(0, 0.8)

    def build(n):
        d = Machine(1.0)
        d.beam("left", H, s, m, (0, 0, math.pi / 2), elements=n // 2, more=more)
        d.beam("bar", B, s, m, (0, H, 0), elements=n // 2, more=more)
        d.beam("right", H, s, m, (B, H, -math.pi / 2), elements=n // 2, more=more)
        getattr(d, feet)("a", (0, 0), "left.root")
        d.weld("c", "left.tip", "bar.root")
        d.weld("e", "bar.tip", "right.root")
        getattr(d, feet)("b", (B, 0), "right.tip")
        d.force("left.tip", (aside, -down), load(math.hypot(aside, down)), name="load")
        d.force("right.root", (0, -1), load(down), name="other")
        d.position("corner", "left.tip")
        d.reaction("foot", "b")
        return d

    return Case(build, f"{aside / k:.2g} EI/H^2 aside, {down / k:.2g} down, {feet} feet, {more or 'auto'}")


def arch(r):
    """An arch of three to six straight beams over a part of a circle, hinged or clamped, pushed at its top or beside it"""
    m = pick(r, STEEL, SPRING_STEEL, PLASTIC)
    R = 10 ** r.uniform(-1, 0.7)
    half, count = r.uniform(0.25, 0.8), pick(r, 4, 6)
    L = 2 * R * math.sin(half / count)
    s, _, _ = bar(r, R * half, (20, 80), m)
    feet, more = pick(r, "weld", "revolute"), "" if r.random() < 0.7 else 'effects = ["axial", "bending_xy", "stiffening"]'
    at = count // 2 if r.random() < 0.6 else count // 2 - 1
    force = m["E"] * s["iz"] / (R * half) ** 2 * r.uniform(3, 30)

    def build(n):
        d = Machine(1.0)
        x, y = -R * math.sin(half), R * math.cos(half)
        x0, y0 = x, y
        for k in range(count):
            a = half * (1 - (2 * k + 1) / count)
            d.beam(f"b{k}", L, s, m, (x - x0, y - y0, a), elements=n // 3, more=more)
            x, y = x + L * math.cos(a), y + L * math.sin(a)
            if k == 0:
                getattr(d, feet)("a", (0.0, 0.0), "b0.root")
            else:
                d.weld(f"c{k}", f"b{k - 1}.tip", f"b{k}.root")
        getattr(d, feet)("z", (x - x0, y - y0), f"b{count - 1}.tip")
        d.force(f"b{at}.root", (0, -1), load(force), name="load")
        d.position("top", f"b{at}.root")
        d.reaction("foot", "a")
        return d

    return Case(build, f"{math.degrees(half):.0f} degrees to each side, {count} beams, {feet} feet, {more or 'auto'}")


def lever(r):
    """A rigid lever on a spring at its hinge or aside, pushed over; a force that turns with it or not"""
    L, k, follows, first = 10 ** r.uniform(-1, 0.5), 10 ** r.uniform(0, 4), r.random() < 0.4, r.uniform(-0.3, 0.3)
    force, way = k / L * r.uniform(0.3, 2.5), r.uniform(-math.pi, math.pi)
    aside = r.random() < 0.4

    def build(n):
        d = Machine(1.0)
        d.rigid("lever", 1.0, L * L / 3, (0, 0, math.pi / 2 + first), centre=(L / 2, 0), frames={"end": (L, 0), "at": (L / 2, 0.0)})
        d.revolute("hinge", (0, 0), "lever", spring=(k, 0.0))
        if aside:
            away = np.hypot(1.3 * L + L / 2 * math.sin(first), 0.2 * L - L / 2 * math.cos(first))
            d.spring("brace", "lever.at", (1.3 * L, 0.2 * L), 2 * k / L**2, rest=float(away))
        d.force("lever.end", (math.cos(way), math.sin(way)), load(force), body=follows, name="load")
        d.position("end", "lever.end")
        d.reaction("pin", "hinge", moment=False)
        return d

    return Case(build, f"P L/k = {force * L / k:.2g} at {math.degrees(way):.0f} degrees{', turns with it' if follows else ''}")


KINDS = [cantilever, column, toggle, portal, arch, lever]


# ---- the truth


class Curve:
    """States of rest over a factor of the loads, by continuation (H. B. Keller 1977): rows of load and outputs, and the smallest
    eigenvalue of the stiffness in the plane over its first. Throws RuntimeError: lost, or too long."""

    def __init__(self, machine, to, size):
        p = self.plane = machine.plane
        p.prepare()
        self.readings = machine.readings
        force = np.abs(p.forces(1.0, p.q0, 0 * p.q0)).max()
        # One unit of a coordinate: the structure's size, or a radian; of a multiplier what loads it; the load's range.
        self.unit = np.r_[np.tile([size, size, 1.0], p.n // 3), np.full(p.m, force), to]
        # Angles with which conditions turn: of rigid bodies, whose joints lie beside their centres.
        self.turning = [3 * i + 2 for i, (m, _) in enumerate(p.mass) if m]
        self.rows, self.stable = [], []
        self.follow(to)
        self.stable = np.array(self.stable) / self.stable[0]

    def residual(self, z):
        p, q, l, t = self.plane, z[: self.plane.n], z[self.plane.n : -1], z[-1]
        c, G = p.conditions(q, 0.0)
        return np.r_[p.forces(t, q, 0 * q) - G.T @ l, c]

    def stiffness(self, z):
        """Of the equations of rest along the coordinates, conditions held; and the conditions' Jacobian."""
        p, q, l = self.plane, z[: self.plane.n], z[self.plane.n : -1]
        S = p.tangents(z[-1], q, 0 * q)[0].copy()
        for i in self.turning:
            step = np.zeros(p.n)
            step[i] = 1e-6
            S[:, i] -= (p.conditions(q + step, 0.0)[1].T @ l - p.conditions(q - step, 0.0)[1].T @ l) / 2e-6
        return S, p.conditions(q, 0.0)[1]

    def equations(self, z):
        """Derivatives of the residual along coordinates, multipliers and load in their units, rows of size one; and the rows' sizes."""
        p, q, t = self.plane, z[: self.plane.n], z[-1]
        S, G = self.stiffness(z)
        A = np.zeros((p.n + p.m, p.n + p.m + 1))
        A[: p.n, : p.n], A[: p.n, p.n : -1], A[p.n :, : p.n] = S, -G.T, G
        A[: p.n, -1] = p.forces(t + 1.0, q, 0 * q) - p.forces(t, q, 0 * q)
        A *= self.unit
        rows = np.abs(A).max(1)
        return A / rows[:, None], rows

    def length(self, d):
        """Of a direction, by coordinates (their mean square over the nodes) and load; and the vector that measures it."""
        w = np.r_[d[: self.plane.n] / (self.plane.n / 3), np.zeros(self.plane.m), d[-1]]
        return math.sqrt(w @ d), w

    def direction(self, z, along):
        A, _ = self.equations(z)
        d = np.linalg.solve(np.vstack([A, along]), np.r_[np.zeros(len(A)), 1.0])
        return d / self.length(d)[0]

    def beside(self, z, d, h):
        """The state that lies h along d, or None."""
        w = self.length(d)[1]
        guess = z + h * d * self.unit
        for _ in range(10):
            A, rows = self.equations(guess)
            r = np.r_[-self.residual(guess) / rows, h - w @ ((guess - z) / self.unit)]
            x = np.linalg.solve(np.vstack([A, w]), r)
            guess = guess + x * self.unit
            change = np.abs(np.r_[x[: self.plane.n], x[-1]]).max()
            if not change < 1:
                return None
            if change < 1e-9:
                return guess
        return None

    def note(self, z):
        p, q, l = self.plane, z[: self.plane.n], z[self.plane.n : -1]
        out = [z[-1]]
        for read, _, _ in self.readings.values():
            out += list(np.asarray(read(0.0, q, 0 * q, 0 * q, l), float))
        self.rows.append(np.nan_to_num(out))  # what a plane has not is zero
        S, G = self.stiffness(z)
        u = self.unit[: p.n]
        N = null_space(G * u)
        K = -0.5 * N.T @ (u[:, None] * (S + S.T) * u) @ N
        self.stable.append(eigvalsh(K, subset_by_index=[0, 0])[0])

    def follow(self, to):
        z = np.r_[self.plane.q0, np.zeros(self.plane.m + 1)]
        d = self.direction(z, np.r_[np.zeros(len(z) - 1), 1.0])
        h = 0.01
        self.note(z)
        while len(self.rows) < 1500:
            new = self.beside(z, d, h)
            along = None if new is None else self.direction(new, self.length(d)[1])
            if new is None or self.length(d)[1] @ along < 0.98:
                h /= 2
                if h < 1e-7:
                    raise RuntimeError("the truth is lost")
                continue
            z, d, h = new, along, min(1.5 * h, 0.02)
            self.note(z)
            if z[-1] >= to or z[-1] < -10 * to:
                return
        raise RuntimeError("the truth is too long")


def size_of(machine):
    return np.abs(np.array(machine.plane.start)[:, :2]).max()  # the origin is on the ground


def spline(curve):
    rows = np.array(curve.rows)
    return CubicSpline(np.arange(len(rows)), rows)


def groups(machine, curve):
    """Columns of each vector and what its errors are measured against: its range; of forces and moments at least a hundredth of the
    loads', of places a billionth of the structure's size."""
    out, k, truth = [], 1, np.array(curve.rows)
    size, force = size_of(machine), curve.unit[-2]
    for _, _, quantity in machine.readings.values():
        least = [1e-9 * size] if quantity == "position" else [0.01 * force, 0.01 * force * size]
        for unit in least:
            part = slice(k, k + 3)
            out.append((part, max(unit, np.linalg.norm(np.ptp(truth[:, part], axis=0)))))
            k += 3
    return out


def gaps(rows, fine, to, columns):
    """(rows, places of the curve): the largest difference of load and vectors over their ranges."""
    total = np.abs(rows[:, None, 0] - fine[None, :, 0]) / to
    for part, unit in columns:
        total = np.maximum(total, np.linalg.norm(rows[:, None, part] - fine[None, :, part], axis=2) / unit)
    return total


def limits(loads):
    """Largest and smallest loads inside a curve, from a fine one."""
    turns = np.sign(np.diff(loads))
    return [loads[i + 1] for i in range(len(turns) - 1) if turns[i] * turns[i + 1] < 0]


def until_end(loads, to):
    """Those before one that is so near to the end of the range that the curve may end there, or turn."""
    end = next((i for i, x in enumerate(loads) if x > (1 - LIMIT) * to), len(loads))
    return loads[:end]


def judge(program, case, folder, elements=12):
    """(verdict, what)."""
    machine = case.build(elements)
    try:
        curves = [Curve(m, case.to, size_of(m)) for m in (machine, case.build(2 * elements))]
    except (RuntimeError, np.linalg.LinAlgError) as problem:
        return "open", str(problem)
    fine = [spline(c)(np.linspace(0, len(c.rows) - 1, PER * len(c.rows))) for c in curves]
    truth, columns = fine[1], groups(machine, curves[1])
    unsure = gaps(fine[0][::PER], truth, case.to, columns).min(1).max()
    if unsure > OFF / 4:
        return "open", f"two truths differ by {unsure:.2g}"
    scene, table = folder / "path.toml", folder / "path.csv"
    scene.write_text(machine.scene(case.what).text)
    words = [program, "load-path", scene, "-o", table, "--json"]
    if len(machine.plane.loads) == 1:
        words += ["--force", "load"]
    try:
        done = subprocess.run(words, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=300)
    except subprocess.TimeoutExpired:
        return "slow", "more than 300 s"
    if done.returncode:
        return "refused", done.stderr.strip()
    told = json.loads(done.stdout)
    rows = list(csv.reader(table.open()))
    head = rows[0]
    data = np.array([[float(x or "nan") for x in row] for row in rows[1:]])
    first = min(k for k, name in enumerate(head) if "." in name)
    states = np.c_[data[:, head.index("load")], data[:, first:]]
    near = gaps(states, truth, case.to, columns)
    off = near.min(1)
    warned = bool(told.get("warnings"))
    at = off.argmax()
    wrong = [f"{off[at]:.2g} off at load {states[at, 0]:.3g}"] if off[at] > OFF else []
    complete = states[-1, 0] >= case.to * (1 - 1e-9)
    found, true = until_end([x["load"] for x in told["limit_points"]], case.to), until_end(limits(truth[:, 0]), case.to)
    if complete and len(found) != len(true):
        wrong.append(f"limits {found} for {true}")
    away = max((abs(a - b) for a, b in zip(found, true)), default=0.0) / case.to
    if away > LIMIT:
        wrong.append(f"limits {away:.2g} off: {found} for {true}")
    stable = data[:, head.index("stable")] == 1
    least = np.interp(near.argmin(1) / PER, np.arange(len(curves[1].stable)), curves[1].stable)
    if (stable & (least < -0.02)).any():
        wrong.append(f"stable at load {states[(stable & (least < -0.02)).argmax(), 0]:.3g}, which is not")
    note = f"{off[at]:.1e}, limits {away:.1e}, {len(states)} states{'' if complete else ', ended: ' + str(told.get('ended'))}"
    if wrong:
        return ("warned" if warned else "silent"), "; ".join(wrong)
    if warned and max(off[at] / OFF, away / LIMIT) < 1 / 3:
        return "alarm", f"{note}: {told['warnings'][0][:160]}"
    return "right", note


def main():
    parser = suite_parser(__doc__, "number", "keep", "short", count=60)
    parser.add_argument("--kind", default="")
    args = parser.parse_args()
    count = collections.Counter()
    kinds = [k for k in KINDS if not args.kind or k.__name__ == args.kind]
    numbers = SHORT if args.short else range(args.count) if args.number is None else [args.number]
    for number in numbers:
        kind = kinds[number % len(kinds)] if args.number is None else kinds[0]
        case = kind(random.Random(f"load path {kind.__name__} {args.seed} {number}"))
        with tempfile.TemporaryDirectory() as folder:
            verdict, what = judge(args.program, case, pathlib.Path(folder))
            if args.keep and verdict in ("silent", "refused", "alarm"):
                args.keep.mkdir(parents=True, exist_ok=True)
                (args.keep / f"{kind.__name__}_{args.seed}_{number}.toml").write_text(case.build(4).scene("").text)
        count[verdict] += 1
        print(f"{verdict:8} {kind.__name__} {args.seed}/{number}: {case.what}: {what}", flush=True)
    print(", ".join(f"{n} {v}" for v, n in count.items()))
    sound = count["right"] + count["alarm"]
    sys.exit(1 if count["silent"] or count["slow"] or count["alarm"] > 0.1 * max(sound, 10) else 0)


if __name__ == "__main__":
    main()
