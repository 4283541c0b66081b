"""Estimated errors of larger meshes against true ones:  large_meshes.py FLEXFRAME [--count N] [--seed S] [--number N] [--kind KIND]

Random bars, plates, L-shaped and holed bodies of some 4000 to 15000 degrees of freedom or more, from one to many layers of tetrahedra or
bricks, tapered, bent and twisted, held at one end or free: models that `reduce` cannot simply divide in a second. Truth: the same body by
elements of the second order (C3D20) at half the size or less; --calculix has CalculiX solve it (minutes a body), else the program does,
whose frequencies of a given mesh are CalculiX' (decks.py). Modes are paired by their shapes. Verdicts: mesh_verdicts.py. Exit 1 if
there is a silent one, or more than 5 % low or high.
"""
import argparse
import json
import pathlib
import random
import resource
import subprocess
import sys

import h5py
import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from mesh_verdicts import MODES, judge_bodies, verdicts  # noqa: E402
from meshed import KINDS, MIDDLES, calculix_frequencies, parts, set_of  # noqa: E402
from scene import pick  # noqa: E402

MOST = 230_000  # degrees of freedom of a truth
SEEN = 150  # nodes that modes are compared at
ELEMENTS = ["C3D8", "C3D4", "C3D20", "C3D8I", "C3D10", "C3D20R", "C3D8", "C3D4", "C3D8R", "C3D15", "C3D6"]
# Nodes a cell of a large grid has, by element.
NODES = {"C3D8": 1, "C3D8I": 1, "C3D8R": 1, "C3D4": 1, "C3D6": 1, "C3D20": 4, "C3D20R": 4, "C3D10": 7, "C3D15": 5.5}


class Body:
    """A grid of cells, some of them left out, and where its points lie."""

    def __init__(self, r, kind):
        self.kind = kind
        self.shape = pick(r, "bar", "plate", "L", "holed")
        L, B = 1.0, r.uniform(0.05, 0.3) if self.shape == "bar" else r.uniform(0.4, 1)
        H = B * r.uniform(0.3, 1) if self.shape == "bar" else r.uniform(0.01, 0.15)
        cells = np.exp(r.uniform(np.log(4000), np.log(15000))) / 3 / NODES[kind]
        layers = r.randint(1, 4) if self.shape != "bar" else r.randint(1, 6)
        # Elements up to three times as long as broad, or the other way.
        across = max(2, round((cells / layers * B / L) ** 0.5 * np.exp(r.uniform(-0.5, 0.5))))
        along = max(4, round(cells / layers / across))
        self.counts = (along, across, layers)
        taper, bent, twist = r.uniform(0.6, 1), pick(r, 0.0, r.uniform(-0.3, 0.3)), pick(r, 0.0, r.uniform(-0.5, 0.5))
        self.free = r.random() < 0.3
        self.material = pick(r, (2.1e11, 0.3, 7850.0), (7e10, 0.33, 2700.0), (3e9, 0.38, 1200.0))
        cut = (r.uniform(0.3, 0.7), r.uniform(0.3, 0.6))

        def kept(x, y):
            """Of a cell's middle, in shares."""
            if self.shape == "L":
                return x < cut[0] or y < cut[1]
            return self.shape != "holed" or abs(x - 0.5) > cut[0] / 3 or abs(y - 0.5) > cut[1] / 2

        def place(x, y, z):
            s, a = 1 + (taper - 1) * x, twist * x
            across, up = (y - 0.5) * B * s, (z - 0.5) * H * s
            c, n = np.cos(a), np.sin(a)
            return x * L, c * across - n * up, n * across + c * up + bent * L * x * x

        self.kept, self.place = kept, place
        self.what = f"{kind} {self.shape} {'x'.join(map(str, self.counts))}, L/H {L / H:.2g}" + (", free" if self.free else "")
        # Corners that every mesh of the body has.
        corners = sorted({tuple(c + d for c, d in zip(cell, q)) for cell in self.cells(self.counts) for q in np.ndindex(2, 2, 2)})
        self.seen = {tuple(c / n for c, n in zip(corner, self.counts)) for corner in r.sample(corners, min(SEEN, len(corners)))}

    def cells(self, counts):
        return [c for c in np.ndindex(*counts) if self.kept((c[0] + 0.5) / counts[0], (c[1] + 0.5) / counts[1])]

    def truth(self):
        """Times that each cell is divided for it."""
        cells = len(self.cells(self.counts))
        return max([n for n in (2, 3, 4) if 12 * cells * n**3 < MOST], default=1)

    def deck(self, kind, times):
        """Text and degrees of freedom."""
        form, middles = KINDS[kind]
        counts = tuple(n * times for n in self.counts)
        # Cut places of a coarse cell stay where they are.
        coarse = set(self.cells(self.counts))
        nodes, points, elements = {}, [], []

        def node(at):
            if at not in nodes:
                nodes[at] = len(nodes) + 1
                points.append(self.place(*(a / (2 * n) for a, n in zip(at, counts))))
            return nodes[at]

        for cell in np.ndindex(*counts):
            if tuple(c // times for c in cell) not in coarse:
                continue
            for part in parts(form, cell):
                corners = [tuple(2 * (c + q) for c, q in zip(cell, p)) for p in part]
                between = [tuple((a + b) // 2 for a, b in zip(corners[i], corners[j])) for i, j in MIDDLES[form]] if middles else []
                elements.append([node(at) for at in corners + between])
        lines = ["*NODE, NSET=ALL"] + [f"{i}, {x:.13g}, {y:.13g}, {z:.13g}" for i, (x, y, z) in enumerate(points, 1)]
        lines.append(f"*ELEMENT, TYPE={kind}, ELSET=BODY")
        for i, e in enumerate(elements, 1):
            row = [i, *e]
            lines.append(",\n".join(", ".join(map(str, row[k : k + 10])) for k in range(0, len(row), 10)))
        E, nu, rho = self.material
        text = "\n".join(lines) + "\n" + set_of("ROOT", [k for at, k in nodes.items() if at[0] == 0])
        seen = [nodes[tuple(round(2 * s * n) for s, n in zip(place, counts))] for place in sorted(self.seen)]
        text += set_of("SEEN", seen) + f"*MATERIAL, NAME=M\n*ELASTIC\n{E:.8g}, {nu}\n*DENSITY\n{rho:.8g}\n"
        text += "*SOLID SECTION, ELSET=BODY, MATERIAL=M\n" + ("" if self.free else "*BOUNDARY\nROOT, 1, 3\n")
        return text, 3 * len(points)


def reduced(program, folder, name, text, modes):
    """What reduce says, shapes (nodes x 3, modes), CPU seconds."""
    (folder / f"{name}.inp").write_text(text)
    words = ["reduce", f"{name}.inp", "-o", f"{name}.h5", "--method", "eigen", "--modes", str(modes), "--json", "--no-stiffening"]
    words += ["--node-set", "SEEN", "--cache", "none"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([program, *words], cwd=folder, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=600)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise ValueError(done.stderr.strip()[-200:])
    with h5py.File(folder / f"{name}.h5") as file:
        points, phi = (file[f"nodes/{word}"][:] for word in ("origin", "phi"))
    order = np.lexsort(np.round(points, 7).T)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return json.loads(done.stdout), phi[order].reshape(-1, phi.shape[2]), seconds


def judge(program, body, folder, calculix):
    """[(true, told, verdict)], and a line about cost."""
    text, size = body.deck(body.kind, 1)
    told, shapes, seconds = reduced(program, folder, "coarse", text, MODES)
    text, fine_size = body.deck("C3D20", body.truth())
    fine, fine_shapes, _ = reduced(program, folder, "fine", text, MODES + 6)
    truth = np.array(fine["frequencies"])
    if calculix:
        other = calculix_frequencies(folder, "truth", text, MODES + 6, body.free)
        if abs(other / truth - 1)[:MODES].max() > 1e-3:
            return None, f"CalculiX has other frequencies by {abs(other / truth - 1)[:MODES].max():.2g}"
    stages = told.get("cpu_seconds", {})
    rest = sum(v for k, v in stages.items() if k != "mesh error")
    cost = f"{seconds:.2f} s, mesh error {stages.get('mesh error', 0):.2f} of {rest:.2f} s"
    return verdicts(told, shapes, fine_shapes, truth), f"{size} dof ({fine_size}), {cost}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--count", type=int, default=22)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--number", type=int)
    parser.add_argument("--kind", choices=list(NODES))
    parser.add_argument("--calculix", action="store_true")
    args = parser.parse_args()
    program = str(pathlib.Path(args.program).resolve())

    def body_of(number):
        return Body(random.Random(f"large meshes {args.seed} {number}"), args.kind or ELEMENTS[number % len(ELEMENTS)])

    judge_bodies(args, body_of, lambda body, folder: judge(program, body, folder, args.calculix))


if __name__ == "__main__":
    main()
