"""Makes solids.inp, solids.frd and solids.dat: elements of every solid kind of CalculiX, pulled. ccx (calculix-ccx) writes the last two.

python3 make_frd.py
"""

import pathlib
import subprocess

import numpy as np

# Corners of a brick, a wedge and a tetrahedron, apart from each other; edges in CalculiX's order.
BRICK = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [0, 0, 1], [2, 0, 1], [2, 1, 1], [0, 1, 1]], float)
WEDGE = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 1], [2, 0, 1], [0, 1, 1]], float)
TET = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 1]], float)
BRICK_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
WEDGE_EDGES = [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)]
TET_EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
KINDS = [
    ("C3D8", BRICK, []),
    ("C3D6", WEDGE, []),
    ("C3D4", TET, []),
    ("C3D20", BRICK, BRICK_EDGES),
    ("C3D15", WEDGE, WEDGE_EDGES),
    ("C3D10", TET, TET_EDGES),
]

lines, elements, held, pulled, number = ["*NODE, NSET=ALL"], [], [], [], 10
for k, (kind, corners, edges) in enumerate(KINDS):
    points = np.vstack([corners] + [0.5 * (corners[a] + corners[b]) for a, b in edges]) + [0, 3 * k, 0]
    nodes = list(range(number, number + len(points)))
    number += len(points) + 7  # numbers with gaps
    lines += [f"{n}, {p[0]}, {p[1]}, {p[2]}" for n, p in zip(nodes, points)]
    words = ", ".join(map(str, [k + 1, *nodes]))
    words = words if len(nodes) < 16 else ", ".join(map(str, [k + 1, *nodes[:15]])) + ",\n" + ", ".join(map(str, nodes[15:]))
    elements += [f"*ELEMENT, TYPE={kind}, ELSET=E", words]
    held += [n for n, p in zip(nodes, points) if p[0] == 0]
    pulled += [n for n, p in zip(nodes, points) if p[0] == 2]
lines += elements + ["*MATERIAL, NAME=STEEL", "*ELASTIC", "210000, 0.3", "*DENSITY", "7.8e-9", "*SOLID SECTION, ELSET=E, MATERIAL=STEEL"]
lines += ["*BOUNDARY"] + [f"{n}, 1, 3" for n in held] + ["*AMPLITUDE, NAME=RAMP", "0, 0, 1, 1"]
lines += (
    ["*STEP", "*DYNAMIC, DIRECT", "1e-4, 3e-4"]
    + ["*CLOAD"]
    + [f"{n}, {a}, {f}" for n in pulled for a, f in ((1, 100.0), (2, -30.0), (3, 20.0))]
)
lines += ["*NODE FILE", "U", "*EL FILE", "S", "*NODE PRINT, NSET=ALL", "U", "*END STEP"]
folder = pathlib.Path(__file__).parent
(folder / "solids.inp").write_text("\n".join(lines) + "\n")
subprocess.run(["ccx", "solids"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
for ending in ("12d", "cvg", "sta"):
    (folder / f"solids.{ending}").unlink(missing_ok=True)
(folder / "spooles.out").unlink(missing_ok=True)
