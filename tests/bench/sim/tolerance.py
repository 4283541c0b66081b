"""What a tolerance is worth: error of slow outputs against it, by method.

    tolerance.py FLEXFRAME SOURCE_DIR [--scene TEXT] [--points] [--table FILE]

Slow outputs are positions of mechanisms and values of joints: what a user reads off, while the beams vibrate. The error is the largest over
time and over these outputs, relative to their ranges, against the same scene at 1e-11 by another method (erk, adams where erk is meant).
Order: slope of the error over tolerances 1e-3 to 1e-8, as far as it is above what the two tight runs differ by and below 0.1. A run of more
CPU seconds than --limit is left out.

  --scene TEXT    only scenes whose name contains it
  --points        the errors themselves
  --table FILE    replaces the table of a Markdown page between its markers 'tolerance' and 'end tolerance'
"""
import argparse
import csv
import json
import pathlib
import re
import resource
import subprocess
import sys
import tempfile

import numpy as np

METHODS = ["dirk", "exponential", "erk", "adams", "bdf", "ida"]
TOLERANCES = [10.0**-k for k in range(3, 9)]
AXIAL = 'effects = ["bending_xy", "axial", "stiffening"]'
BENDING = 'effects = ["bending_xy", "stiffening"]'
FEW = [(r"elements = 8", "elements = 4"), (r"elements = 3", "elements = 2")]  # explicit truths of the stretching rods take seconds
# Name, file, changes of its text, slow outputs.
SCENES = [
    ("slider-crank, bending", "slider_crank.toml", [*FEW, (r"effects = .*", BENDING)], ["slider.x", "crank_angle"]),
    ("slider-crank, bending and axial", "slider_crank.toml", [*FEW, (r"effects = .*", AXIAL)], ["slider.x", "crank_angle"]),
    ("slider-crank as it stands", "slider_crank.toml", FEW, ["slider.x", "crank_angle"]),
    ("slider-crank of the DLR", "dlr_slider_crank.toml", [(r"duration = .*", "duration = 2")], ["slider.x"]),
    ("pendulum, bending", "pendulum.toml", [(r"effects = .*", BENDING)], ["tip.x", "tip.y"]),
    ("pendulum, bending and axial", "pendulum.toml", [(r"elements = 10", "elements = 4"), (r"effects = .*", AXIAL)], ["tip.x", "tip.y"]),
    ("cart with an elastic pole", "beams/cart.toml", [], ["cart.x", "tip.x", "tip.y"]),
    ("controlled cart, elastic pole", "cart_pendulum.toml", [], ["cart", "angle"]),
    ("engine", "engine.toml", [], ["crank_angle", "piston.x", "piston.y"]),
    ("solid pendulum", "pendulum_solid.toml", [], ["tip.x", "tip.y", "angle"]),
    ("strip in large motion", "beams/strip.toml", [], ["tip.x", "tip.y"]),
    ("double pendulum, rigid", "mechanisms/double_pendulum.toml", [], ["upper", "lower"]),
    ("four-bar, rigid", "mechanisms/four_bar.toml", [], ["rocker", "angle"]),
    ("top, rigid", "mechanisms/top.toml", [], ["tip.x", "tip.y", "tip.z"]),
]


class Bench:
    def __init__(self, program, source, limit):
        self.program, self.source, self.limit = program, pathlib.Path(source), limit
        self.place = pathlib.Path(tempfile.mkdtemp(prefix="flexframe_tolerance_"))

    def run(self, text, slow, tolerance, method, limit):
        """Slow outputs, columns x times, and CPU seconds; None where the run fails or takes too long."""
        scene, table = self.place / "scene.toml", self.place / "h.csv"
        scene.write_text(text)
        words = ["--tolerance", repr(tolerance), "--method", method, "--no-error-estimate", "--no-effect-check", "--json"]
        done = subprocess.run(
            [self.program, "simulate", scene, "--csv", table, *words],
            capture_output=True,
            text=True,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit)),
        )
        if done.returncode:
            return None, 0.0
        rows = list(csv.reader(table.open()))
        names = [re.sub(r" *\[.*", "", n) for n in rows[0]]
        values = np.array([[float(r[names.index(c)]) for r in rows[1:]] for c in slow])
        return values, json.loads(done.stdout)["simulation"]["cpu_seconds"]

    def text(self, file, changes):
        text = (self.source / "examples" / file).read_text()
        text = re.sub(r"(?m)^(tolerance|accuracy|mesh) = .*\n", "", text)
        text = re.sub(r'(?m)^file = "', f'file = "{(self.source / "examples" / file).parent.resolve()}/', text)
        text = re.sub(r"(?s)\n\[render\].*", "", text)
        for old, new in changes:
            text = re.sub(old, new, text)
        return text


def error_of(run, truth):
    ranges = max(np.ptp(row) for row in truth)
    n = min(run.shape[1], truth.shape[1])
    return np.abs(run[:, :n] - truth[:, :n]).max() / ranges


def order_of(points, floor):
    """Least squares of log error over log tolerance; None with fewer than three points."""
    use = [(t, e) for t, e, _ in points if 3 * floor < e < 0.1]
    if len(use) < 3:
        return None
    t, e = np.log10([p[0] for p in use]), np.log10([p[1] for p in use])
    return np.polyfit(t, e, 1)[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("source")
    parser.add_argument("--scene", default="")
    parser.add_argument("--method", action="append", default=[])
    parser.add_argument("--limit", type=int, default=20)
    parser.add_argument("--points", action="store_true")
    parser.add_argument("--table", type=pathlib.Path)
    args = parser.parse_args()
    bench = Bench(args.program, args.source, args.limit)
    methods = args.method or METHODS
    lines = ["| scene | " + " | ".join(methods) + " |", "|---" * (len(methods) + 1) + "|"]
    for name, file, changes, slow in SCENES:
        if args.scene not in name:
            continue
        text = bench.text(file, changes)
        truths = {m: bench.run(text, slow, 1e-11, m, 10 * args.limit)[0] for m in ("erk", "adams")}
        if all(t is None for t in truths.values()):
            print(f"{name}: no truth", flush=True)
            continue
        both = all(t is not None for t in truths.values())
        floor = error_of(truths["erk"], truths["adams"]) if both else 1e-7
        row = []
        for method in methods:
            truth = truths["adams" if method == "erk" and truths["adams"] is not None else "erk"]
            truth = truth if truth is not None else truths["adams"]
            points = []
            for tolerance in TOLERANCES:
                values, cpu = bench.run(text, slow, tolerance, method, args.limit)
                if values is not None:
                    points.append((tolerance, error_of(values, truth), cpu))
            order = order_of(points, floor)
            at = next((e for t, e, _ in points if t < 2e-6), None)
            row.append(("-" if not points else "exact" if order is None else f"{order:.2f}") + (f" ({at:.0e})" if at is not None else ""))
            if args.points:
                print(f"{name}; {method}: order {row[-1]}; " + "  ".join(f"{t:.0e}: {e:.1e} {c:.3f}s" for t, e, c in points), flush=True)
        lines.append(f"| {name} | " + " | ".join(row) + " |")
        print(lines[-1], f"  (truth to {floor:.0e})", flush=True)
    if args.table:
        page = args.table.read_text()
        begin, end = "<!-- tolerance -->\n", "<!-- end tolerance -->"
        args.table.write_text(page[: page.index(begin) + len(begin)] + "\n".join(lines) + "\n" + page[page.index(end) :])


if __name__ == "__main__":
    sys.exit(main())
