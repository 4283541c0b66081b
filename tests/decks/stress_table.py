#!/usr/bin/env python3
"""Stresses of reduced bodies at the nodes of their surface against CalculiX, mode by mode.

  stress_table.py PROGRAM [FOLDER]     one row for each element kind; exit 1 where one that must agree is above 1 %

A bent block (an arc of 60 degrees) held at one end is meshed with every solid element of CalculiX here. CalculiX writes the stresses of
its modes extrapolated to the nodes and averaged over their elements (`*EL FILE`); `flexframe reduce --stress -o BODY.h5` keeps the same for
each elastic coordinate. A row is the largest difference over all nodes of the surface of the six stresses, of von Mises and of the
principal stresses, over the largest von Mises stress of the mode; of the six lowest modes the worst. Modes of both have unit modal mass.
Needs numpy, h5py and ccx.
"""

import pathlib
import subprocess
import sys
import tempfile

import h5py
import numpy as np

# Nodes of an element, and the share within which both programs must agree: none where they differ by what sim/reduce/REDUCE.md says.
KINDS = {
    "C3D8": (8, 0.01),
    "C3D8I": (8, None),
    "C3D8R": (8, None),
    "C3D20": (20, 0.01),
    "C3D20R": (20, 0.01),
    "C3D4": (4, None),
    "C3D10": (10, 0.01),
    "C3D6": (6, None),
    "C3D15": (15, 0.01),
}
EDGES_20 = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
EDGES_10 = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
EDGES_15 = [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)]
TETS = [(0, 1, 3, 4), (1, 2, 3, 6), (1, 3, 4, 6), (3, 4, 6, 7), (1, 4, 5, 6)]
MIRRORED = [(1, 0, 2, 5), (0, 3, 2, 7), (0, 2, 5, 7), (0, 5, 4, 7), (2, 6, 5, 7)]


def mesh(kind, cells=(12, 3, 2)):
    """Nodes (n, 3) and elements of the arc: radius 0.3 to 0.4 m, 0.05 m thick."""
    number, nodes = {}, []

    def node(p):
        key = tuple(round(12 * x) for x in p)
        if key not in number:
            number[key] = len(nodes)
            a, r, z = np.pi / 3 * p[0] / cells[0], 0.3 + 0.1 * p[1] / cells[1], 0.05 * p[2] / cells[2]
            nodes.append([r * np.sin(a), r * np.cos(a), z])
        return number[key]

    elements = []
    # Counterclockwise seen from above: r falls with y in this order.
    ring = [(0, 1), (1, 1), (1, 0), (0, 0)]
    ring.reverse()
    for i in range(cells[0]):
        for j in range(cells[1]):
            for k in range(cells[2]):
                c = [np.array([i + a, j + b, k + d], float) for d in (0, 1) for a, b in ring]
                if KINDS[kind][0] in (8, 20):
                    parts, edges = [tuple(range(8))], EDGES_20
                elif KINDS[kind][0] in (4, 10):
                    parts, edges = (TETS if (i + j + k) % 2 == 0 else MIRRORED), EDGES_10
                else:
                    parts, edges = [(0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)], EDGES_15
                for part in parts:
                    corners = [c[p] for p in part]
                    x = [np.array(nodes[node(p)]) for p in corners]
                    middle = [] if KINDS[kind][0] in (4, 6, 8) else [0.5 * (corners[a] + corners[b]) for a, b in edges]
                    if len(part) == 4 and np.dot(np.cross(x[1] - x[0], x[2] - x[0]), x[3] - x[0]) < 0:
                        corners[0], corners[1] = corners[1], corners[0]
                        middle = [] if not middle else [0.5 * (corners[a] + corners[b]) for a, b in edges]
                    if len(part) > 4:
                        half = len(part) // 2
                        if np.dot(np.cross(x[1] - x[0], x[2] - x[0]), x[half] - x[0]) < 0:
                            corners = corners[half:] + corners[:half]
                            middle = [] if not middle else [0.5 * (corners[a] + corners[b]) for a, b in edges]
                    elements.append([node(p) for p in corners + middle])
    held = [n for key, n in number.items() if key[0] == 0]
    return np.array(nodes), elements, held


def deck(kind, steps):
    nodes, elements, held = mesh(kind)
    lines = ["*NODE, NSET=ALL"] + [f"{i + 1}, {x[0]:.12g}, {x[1]:.12g}, {x[2]:.12g}" for i, x in enumerate(nodes)]
    lines.append(f"*ELEMENT, TYPE={kind}, ELSET=BODY")
    for e, row in enumerate(elements):
        numbers = [str(e + 1)] + [str(n + 1) for n in row]
        lines.append(", ".join(numbers[:12]) + ("," if len(numbers) > 12 else ""))
        if len(numbers) > 12:
            lines.append(", ".join(numbers[12:]))
    lines += ["*NSET, NSET=HELD"] + [f"{n + 1}," for n in held]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", "2.1e11, 0.3", "*DENSITY", "7850", "*SOLID SECTION, ELSET=BODY, MATERIAL=M"]
    lines += ["*BOUNDARY", "HELD, 1, 3"]
    if steps:
        lines += ["*STEP", "*FREQUENCY", "6", "*NODE FILE", "U", "*EL FILE", "S", "*END STEP"]
    return "\n".join(lines) + "\n"


def read_frd(file):
    """Blocks of values at nodes: a list of (name, {node: values})."""
    blocks, name, values = [], None, None
    for line in open(file, encoding="ascii", errors="replace"):
        if line.startswith(" -4"):
            name, values = line[5:13].strip(), {}
        elif line.startswith(" -1") and values is not None:
            count = (len(line.rstrip("\n")) - 13) // 12
            values[int(line[3:13])] = [float(line[13 + 12 * k : 25 + 12 * k]) for k in range(count)]
        elif line.startswith(" -3") and values is not None:
            blocks.append((name, values))
            values = None
    return blocks


def tensors(s):
    """(n, 6) xx yy zz xy yz xz -> (n, 3, 3)."""
    return s[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(-1, 3, 3)


def von_mises(s):
    d = s[:, [0, 1, 2]] - s[:, [1, 2, 0]]
    return np.sqrt(0.5 * (d**2).sum(1) + 3 * (s[:, 3:] ** 2).sum(1))


def compare(program, kind, folder):
    base = folder / kind
    base.with_suffix(".inp").write_text(deck(kind, True))
    (folder / f"{kind}_own.inp").write_text(deck(kind, False))
    subprocess.run(["ccx", kind], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    words = ["--hold", "HELD", "--method", "eigen", "--modes", "6", "--stress", "--quiet", "--cache", "none"]
    subprocess.run(
        [program, "reduce", folder / f"{kind}_own.inp", "-o", folder / f"{kind}.h5", *words], check=True, stderr=subprocess.DEVNULL
    )
    blocks = read_frd(folder / f"{kind}.frd")
    stress = [v for n, v in blocks if n == "STRESS"]
    shape = [v for n, v in blocks if n == "DISP"]
    with h5py.File(folder / f"{kind}.h5") as file:
        ids = file["surface/ids"][:].astype(int)
        own = file["surface/stress"][:]  # m x 6 x n
        phi = file["surface/phi"][:]
    worst = np.zeros(3)
    for k in range(6):
        theirs = np.array([stress[k][i] for i in ids])  # XX YY ZZ XY YZ ZX
        moved = np.array([shape[k][i][:3] for i in ids])
        sign = np.sign((moved * phi[:, :, k]).sum())
        mine = sign * own[:, :, k]
        scale = von_mises(theirs).max()
        worst[0] = max(worst[0], np.abs(mine - theirs).max() / scale)
        worst[1] = max(worst[1], np.abs(von_mises(mine) - von_mises(theirs)).max() / scale)
        principal = [np.linalg.eigvalsh(tensors(s)) for s in (mine, theirs)]
        worst[2] = max(worst[2], np.abs(principal[0] - principal[1]).max() / scale)
    return len(ids), worst


def main():
    program = str(pathlib.Path(sys.argv[1]).resolve())
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else temporary)
        folder.mkdir(exist_ok=True)
        print("| elements | nodes of the surface | six stresses | von Mises | principal stresses |\n|---|---|---|---|---|")
        failed = False
        for kind in KINDS:
            count, worst = compare(program, kind, folder)
            print(f"| {kind} | {count} | {100 * worst[0]:.2g} % | {100 * worst[1]:.2g} % | {100 * worst[2]:.2g} % |", flush=True)
            failed = failed or (KINDS[kind][1] is not None and worst.max() > KINDS[kind][1])
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
