"""Bodies reduced from random finite element models against CalculiX:  reduced.py FLEXFRAME [--count N] [--seed S] [--number N]

Bars of solid elements, tapered and bent, in metres or millimetres, held at one end. `reduce` makes a body of two interfaces, a scene welds
it and loads its free end; CalculiX computes the same mesh. Wrong is, without a warning: mass 0.1 %, one of the first six frequencies or
the deflection at the end under a force or moment 1 % off. Exit 1 if there is one. Without the program ccx nothing is compared.
"""
import csv
import json
import math
import pathlib
import re
import subprocess
import sys

import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from arguments import judge_each, suite_parser  # noqa: E402
from scene import force, output, pick, simulation, weld  # noqa: E402

OFF, MASS = 0.01, 0.001
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]


class Bar:
    """A random deck; unit: metres of its unit of length."""

    def __init__(self, r):
        self.kind = pick(r, "C3D8", "C3D20", "C3D20R", "C3D8I")
        self.unit = pick(r, 1.0, 1e-3)
        fine = 2 if self.kind.startswith("C3D20") else 1
        count = (r.randint(4, 12), r.randint(2, 3), r.randint(2, 3))
        L, B, H = (x / self.unit for x in (r.uniform(0.1, 1), r.uniform(0.02, 0.1), r.uniform(0.02, 0.1)))
        m = pick(r, (2.1e11, 0.3, 7850.0), (7e10, 0.33, 2700.0))
        taper, bent = r.uniform(0.5, 1), r.uniform(-0.3, 0.3) * L
        self.nodes, ids, elements = [], {}, []

        def node(at):
            if at not in ids:
                x, y, z = (a / (n * fine) for a, n in zip(at, count))
                s = 1 + (taper - 1) * x
                self.nodes.append((x * L, (y - 0.5) * B * s + bent * x * x, (z - 0.5) * H * s))
                ids[at] = len(self.nodes)
            return ids[at]

        for cell in np.ndindex(*count):
            corners = [tuple(int(fine * (cell[q] + c[q])) for q in range(3)) for c in CORNERS]
            middles = [tuple((corners[a][q] + corners[b][q]) // 2 for q in range(3)) for a, b in EDGES] if fine == 2 else []
            elements.append([node(at) for at in corners + middles])
        self.root = [k for at, k in ids.items() if at[0] == 0]
        self.tip = [k for at, k in ids.items() if at[0] == count[0] * fine]
        lines = ["*NODE, NSET=ALL"] + [f"{i}, {x:.12g}, {y:.12g}, {z:.12g}" for i, (x, y, z) in enumerate(self.nodes, 1)]
        lines.append(f"*ELEMENT, TYPE={self.kind}, ELSET=E")
        for i, e in enumerate(elements, 1):
            row = [i, *e]
            parts = [", ".join(map(str, row[k : k + 10])) for k in range(0, len(row), 10)]
            lines += [",\n".join(parts)]
        for name, members in (("ROOT", self.root), ("TIP", self.tip)):
            lines += [f"*NSET, NSET={name}"] + [", ".join(map(str, members[k : k + 8])) for k in range(0, len(members), 8)]
        # Of millimetres, tonnes and seconds: MPa and t/mm^3.
        E, rho = (m[0], m[2]) if self.unit == 1.0 else (m[0] * 1e-6, m[2] * 1e-12)
        lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{E:.8g}, {m[1]}", "*DENSITY", f"{rho:.8g}", "*SOLID SECTION, ELSET=E, MATERIAL=M"]
        self.text = "\n".join([*lines, "*BOUNDARY", "ROOT, 1, 3", ""])
        # Area of a section is quadratic in the share of the length: Simpson's rule is exact.
        self.mass = m[2] * self.unit**3 * L * B * H * (1 + 4 * ((1 + taper) / 2) ** 2 + taper**2) / 6
        d = np.array([r.gauss(0, 1) for _ in range(3)])
        self.force = 100 * d / np.linalg.norm(d)
        self.what = f"{self.kind}, {len(elements)} elements, {'m' if self.unit == 1.0 else 'mm'}, L/B {L / B:.2g}"


def calculix(folder, name, text):
    (folder / f"{name}.inp").write_text(text)
    done = subprocess.run(["ccx", name], cwd=folder, capture_output=True, text=True, timeout=120)
    if done.returncode:
        raise RuntimeError(done.stdout[-300:])
    return (folder / f"{name}.dat").read_text().splitlines()


def truth(bar, folder):
    """Frequencies (Hz), the tip's mean displacement (m)."""
    rows = calculix(folder, "modes", bar.text + "*STEP\n*FREQUENCY\n6\n*END STEP\n")
    hertz = [float(row.split()[3]) for row in rows if re.match(r"\s+\d+\s+\S+E\S+\s+\S+\s+\S+E", row)][:6]
    loads = "".join(f"{n}, {k + 1}, {f / len(bar.tip)}\n" for n in bar.tip for k, f in enumerate(bar.force))
    rows = calculix(folder, "static", bar.text + f"*STEP\n*STATIC\n*CLOAD\n{loads}*NODE PRINT, NSET=TIP\nU\n*END STEP\n")
    moved = [[float(x) for x in row.split()[1:4]] for row in rows if re.match(r"\s+\d+\s+\S+E", row)]
    return np.array(hertz), np.mean(moved, axis=0) * bar.unit


def run(program, folder, *words):
    done = subprocess.run([program, *map(str, words)], cwd=folder, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=120)
    if done.returncode:
        raise ValueError(done.stderr.strip())
    return done


def judge(program, bar, folder, _):
    """(verdict, what)."""
    hertz, moved = truth(bar, folder)
    (folder / "bar.inp").write_text(bar.text)
    words = ["--interface", "tip=average:TIP", "--interface", "root=rigid:ROOT", "--hold", "none", "--modes", 12]
    words += ["--units", "m" if bar.unit == 1.0 else "mm", "--no-cut-off", "--json"]
    try:
        told = json.loads(run(program, folder, "reduce", "bar.inp", "-o", "bar.sid", *words).stdout)
        text = simulation(0.01, 100, start="static", tolerance=1e-8) + '[[body]]\nname = "bar"\nkind = "modal"\nfile = "bar.sid"\n\n'
        text += weld("clamp", "ground", "bar.root") + output("moved", "bar.tip", "displacement", 'relative_to = "bar.root"')
        text += force("force", "bar.tip", float(np.linalg.norm(bar.force)), bar.force)
        (folder / "bar.toml").write_text(text)
        modes = json.loads(run(program, folder, "modes", "bar.toml", "--no-pictures", "--json").stdout)
        run(program, folder, "simulate", "bar.toml", "-q", "-o", "bar.h5", "--csv", "bar.csv")
    except ValueError as refusal:
        return "refused", str(refusal)
    row = next(csv.DictReader((folder / "bar.csv").open()))
    mine = np.array([float(row[f"moved.{x}"]) for x in "xyz"])
    frequencies = np.array([m["frequency"] for m in modes["modes"] if m["frequency"] > 0][: len(hertz)])
    worst = {
        "mass": abs(told["mass"] / bar.mass - 1) / MASS if not bar.kind.startswith("C3D20") else 0.0,
        "frequencies": abs(frequencies / hertz - 1).max() / OFF if len(frequencies) == len(hertz) else math.inf,
        "deflection": np.linalg.norm(mine - moved) / np.linalg.norm(moved) / OFF,
    }
    note = ", ".join(f"{k} {v * (MASS if k == 'mass' else OFF):.1e}" for k, v in worst.items())
    warnings = [*told.get("warnings", []), *modes["warnings"]]
    if max(worst.values()) > 1:
        return ("warned" if warnings else "silent"), note + (f": {warnings[0][:150]}" if warnings else "")
    return "right", note


def main():
    args = suite_parser(__doc__, "number", count=40).parse_args()
    judge_each(args, "reduced", lambda r, number: Bar(r), judge, needs_ccx=True)


if __name__ == "__main__":
    main()
