"""Frequencies and responses of random frames:  vibrations.py FLEXFRAME [--count N] [--seed S] [--number N] [--short] [--keep FOLDER]

Beams welded to one another at any angle, in a plane or in space, with masses at their ends. `modes` lists their vibrations,
`response` the amplitude at their ends under a force. Truth: finite elements of Timoshenko's beams (truths/space_frame.py), many of them.
Wrong is, without a warning: one of the first six vibrations that is more than 1.5 % off or not in the list; an amplitude that the truth
has at no frequency within 1.5 % (and 3 % of its size). Exit 1 if there is one, or a false alarm: all is right to a third of that, and a
warning says it is not, in more than a tenth of the scenes.
"""
import collections
import csv
import json
import pathlib
import random
import subprocess
import sys
import tempfile

import numpy as np
from scipy.linalg import eigh

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from arguments import suite_parser  # noqa: E402
from scene import beam, by_chance, force, output, pick, rigid, section_of, simulation, sizes, weld  # noqa: E402
from truths.space_frame import SpaceFrame, axes_of  # noqa: E402

OFF, AMPLITUDE, FIRST = 0.015, 0.03, 6
# What continuous integration runs of seed 1: one, two and three beams, in a plane and in space, right and warned of.
# Those left out of the first twenty (7, 9, 11 to 14, 16, 18) take three times as long as these twelve.
SHORT = [1, 3, 4, 6, 10, 15]


def chosen(r):
    """What an author may write of a beam, mostly nothing."""
    return by_chance(
        r,
        (0.5, ""),
        (0.65, lambda r: f"elements = {r.randint(2, 30)}\n"),
        (0.8, 'effects = ["bending_xy", "bending_xz", "axial", "torsion"]\n'),
        (0.9, 'effects = ["bending_xy", "bending_xz", "axial", "torsion", "shear"]\n'),
        (1.0, lambda r: f"elements = 20\nkeep_modes = {r.randint(2, 8)}\n"),
    )


class Frame:
    """A random frame as a scene's text and as matrices."""

    def __init__(self, r):
        self.frame = frame = SpaceFrame()
        plane = r.random() < 0.5
        count = r.randint(1, 3)
        length, m, s = sizes(r, slender=(5, 60), shapes=("rectangle", "circle", "tube", "box"))
        places, axes, ends = [np.zeros(3)], [np.eye(3)], [frame.node((0, 0, 0))]
        frame.hold(ends[0])
        share = 10 ** r.uniform(-2.5, -1.5)  # of critical damping, of the third vibration
        text, self.outputs = "", {}
        for k in range(count):
            L = length * r.uniform(0.4, 1.0)
            sk = s if r.random() < 0.5 else section_of(r, pick(r, "rectangle", "circle", "tube"), s["height"] * r.uniform(0.7, 1.4))
            at = k if r.random() < 0.7 else r.randint(0, k)
            turn = [0.0, 0.0, r.uniform(-2, 2)] if plane else [r.uniform(-1.5, 1.5) for _ in range(3)]
            R = axes[at] @ axes_of(turn)
            place = places[at] + R @ [L, 0, 0]
            tip = frame.node(place)
            frame.beam(ends[at], tip, sk, m, R, elements=16)
            places.append(place), axes.append(R), ends.append(tip)
            text += beam(f"b{k}", L, sk["text"], m, chosen(r) + "damping = { stiffness = %BETA% }")
            text += weld(f"w{k}", "ground" if at == 0 else f"b{at - 1}.tip", f"b{k}.root", f"rotation = {turn}")
            if r.random() < 0.4:
                mass = m["rho"] * sk["area"] * L * 10 ** r.uniform(-1.5, 0.5)
                J = mass * (0.1 * L) ** 2
                frame.body(tip, mass, (J, J, J))
                text += rigid(f"m{k}", mass, (J, J, J)) + weld(f"g{k}", f"b{k}.tip", f"m{k}")
        self.plane = plane
        K, M, free = frame.matrices()
        self.K, self.M, self.free = K[np.ix_(free, free)], M[np.ix_(free, free)], free
        self.hertz = np.sqrt(eigh(self.K, self.M, eigvals_only=True)) / (2 * np.pi)
        self.beta = share / (np.pi * self.hertz[2])
        tip = ends[-1]
        d = np.array([r.gauss(0, 1), r.gauss(0, 1), 0.0 if plane else r.gauss(0, 1)])
        self.direction, self.node = d / np.linalg.norm(d), tip
        self.text = (
            simulation(1.0, 10)
            + text.replace("%BETA%", repr(float(self.beta)))
            + force("force", f"b{count - 1}.tip", "0", self.direction, 'name = "push"')
            + output("tip", f"b{count - 1}.tip", "position")
        )
        self.what = f"{count} beams in {'a plane' if plane else 'space'}, length/height {length / s['height']:.2g}"

    def response(self, hertz):
        """Displacements of the tip (frequencies x 3), complex, per newton."""
        w = 2 * np.pi * np.asarray(hertz)
        squares, modes = eigh(self.K, self.M)
        f = np.zeros(len(self.K))
        rows = [list(self.free).index(6 * self.node + k) for k in range(3)]
        f[rows] = self.direction
        p = modes.T @ f
        q = p / (squares - w[:, None] ** 2 + 1j * w[:, None] * self.beta * squares)
        return q @ modes[rows].T


def call(program, words):
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=120)
    return done.returncode, done.stdout, done.stderr


def judge(program, frame, folder):
    """(verdict, what)."""
    scene, table = folder / "frame.toml", folder / "r.csv"
    scene.write_text(frame.text)
    code, out, err = call(program, ["modes", scene, "--no-pictures", "--json"])
    if code != 0:
        return "refused", err.strip()
    told = json.loads(out)
    listed = np.sort([np.hypot(*x["pole"]) for x in told["modes"] if x["frequency"] > 0]) / (2 * np.pi)  # undamped
    true = frame.hertz[:FIRST]
    n = min(len(listed), FIRST)
    off = max((abs(listed[k] / true[k] - 1) for k in range(n)), default=1.0)
    off = max(off, 1.0 if n < FIRST else 0.0)
    warned = bool(told["warnings"])
    if off > OFF and not warned:
        return "silent", f"modes {off:.2g}: {listed[:FIRST]} for {true}"
    alarm = warned and off < OFF / 3
    range_of = ["--from", 0.3 * frame.hertz[0], "--to", frame.hertz[5], "--points", 80]
    code, out, err = call(program, ["response", scene, "--force", "push", *range_of, "-o", table, "--json"])
    if code != 0:
        return "refused", err.strip()
    warnings = json.loads(out).get("warnings", [])
    with open(table, newline="") as file:
        rows = list(csv.DictReader(file))
    hertz = np.array([float(next(iter(row.values()))) for row in rows])
    near = np.linspace(1 - OFF, 1 + OFF, 61)
    around = abs(frame.response((hertz[:, None] * near).ravel())).reshape(len(hertz), len(near), 3)
    worst = 0.0
    size = around.max(axis=(1, 2))
    for k, axis in enumerate("xyz"):
        column = next((c for c in rows[0] if c.startswith(f"tip.{axis}") and "amplitude" in c), None) or f"tip.{axis}"
        mine = np.array([float(row[column]) for row in rows])
        low, high = around[:, :, k].min(axis=1), around[:, :, k].max(axis=1)
        beyond = np.maximum(low - mine, mine - high)
        worst = max(worst, (beyond / np.maximum(high, 0.02 * size)).max())
    if worst > AMPLITUDE and not warnings:
        return "silent", f"response {worst:.2g}"
    if warnings or warned:
        said = (told["warnings"] + warnings)[0]
        return ("alarm" if alarm and worst < AMPLITUDE / 3 else "warned"), f"modes {off:.2g}, response {worst:.2g}; {said}"
    return "right", f"modes {off:.2g}, response {worst:.2g}"


def main():
    parser = suite_parser(__doc__, "number", "keep", "short", count=40)
    args = parser.parse_args()
    counts = collections.Counter()
    numbers = SHORT if args.short else range(args.count) if args.number is None else [args.number]
    for number in numbers:
        frame = Frame(random.Random(f"{args.seed} vibrations {number}"))
        with tempfile.TemporaryDirectory(prefix="flexframe_vibrations_") as place:
            verdict, said = judge(args.program, frame, args.keep or pathlib.Path(place))
        counts[verdict] += 1
        print(f"{verdict:8} {number}: {frame.what}; {said[:300]}", flush=True)
    print(", ".join(f"{counts[v]} {v}" for v in ("right", "warned", "alarm", "refused", "silent")))
    sys.exit(1 if counts["silent"] or counts["alarm"] > 0.1 * len(numbers) else 0)


if __name__ == "__main__":
    main()
