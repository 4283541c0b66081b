"""Meshes of every kind of element from one grid of cells, as decks that the program and CalculiX read alike, and CalculiX' answers."""
import re
import subprocess
from fractions import Fraction

import numpy as np

HEX = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
# Corners of a cell, per element it is cut into. Tetrahedra of neighbours fit: every other cell is cut the other way.
TETRAHEDRA = [(0, 1, 3, 4), (1, 2, 3, 6), (1, 3, 4, 6), (3, 4, 6, 7), (1, 4, 5, 6)]
MIRRORED = [(0, 1, 2, 5), (0, 2, 3, 7), (0, 2, 7, 5), (0, 5, 7, 4), (2, 5, 6, 7)]
WEDGES = [(0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)]
# Corners whose middles follow, in Abaqus' order.
MIDDLES = {
    "hex": [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)],
    "tet": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    "wedge": [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
    "quad": [(0, 1), (1, 2), (2, 3), (3, 0)],
    "tri": [(0, 1), (1, 2), (2, 0)],
    "line": [(0, 1)],
}
# Form, and whether there are nodes in the middles.
KINDS = {
    "C3D8": ("hex", False),
    "C3D8I": ("hex", False),
    "C3D8R": ("hex", False),
    "C3D20": ("hex", True),
    "C3D20R": ("hex", True),
    "C3D4": ("tet", False),
    "C3D10": ("tet", True),
    "C3D6": ("wedge", False),
    "C3D15": ("wedge", True),
    "S4": ("quad", False),
    "S8": ("quad", True),
    "S8R": ("quad", True),
    "S3": ("tri", False),
    "S6": ("tri", True),
    "B31": ("line", False),
    "B32": ("line", True),
}
DIMENSION = {"hex": 3, "tet": 3, "wedge": 3, "quad": 2, "tri": 2, "line": 1}


def parts(form, cell):
    """Lists of corners (places in the unit cell) of the elements in a cell."""
    odd = sum(cell) % 2
    if form == "tet":
        chosen = MIRRORED if odd else TETRAHEDRA
        out = []
        for part in chosen:
            p = [np.array(HEX[c]) for c in part]
            turned = np.dot(np.cross(p[1] - p[0], p[2] - p[0]), p[3] - p[0]) < 0
            out.append([HEX[c] for c in ((part[1], part[0], *part[2:]) if turned else part)])
        return out
    if form == "wedge":
        return [[HEX[c] for c in part] for part in WEDGES]
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    if form == "tri":
        return [[square[c] for c in part] for part in ([(0, 1, 2), (0, 2, 3)] if odd else [(0, 1, 3), (1, 2, 3)])]
    return [{"hex": HEX, "quad": square, "line": [(0,), (1,)]}[form]]


class Mesh:
    """place: function of 1 to 3 shares (0 to 1) of the grid that gives a point. nodes: share -> number, from 1."""

    def __init__(self, kind, counts, place):
        self.kind, self.nodes, self.points, self.elements = kind, {}, [], []
        form, middles = KINDS[kind]
        counts = counts[: DIMENSION[form]]

        def node(at):
            if at not in self.nodes:
                self.points.append(place(*map(float, at)))
                self.nodes[at] = len(self.points)
            return self.nodes[at]

        for cell in np.ndindex(*counts):
            for part in parts(form, cell):
                corners = [tuple(Fraction(c + p, n) for c, p, n in zip(cell, q, counts)) for q in part]
                between = [tuple((x + y) / 2 for x, y in zip(corners[a], corners[b])) for a, b in MIDDLES[form]] if middles else []
                if form == "line" and middles:
                    corners, between = [corners[0], between[0], corners[1]], []
                self.elements.append([node(at) for at in corners + between])

    def where(self, test):
        return [k for at, k in self.nodes.items() if test(at)]

    def text(self):
        """*NODE and *ELEMENT (set BODY)."""
        lines = ["*NODE, NSET=ALL"] + [f"{i}, {x:.13g}, {y:.13g}, {z:.13g}" for i, (x, y, z) in enumerate(self.points, 1)]
        lines.append(f"*ELEMENT, TYPE={self.kind}, ELSET=BODY")
        for i, e in enumerate(self.elements, 1):
            row = [i, *e]
            lines.append(",\n".join(", ".join(map(str, row[k : k + 10])) for k in range(0, len(row), 10)))
        return "\n".join(lines) + "\n"


def set_of(name, members):
    return f"*NSET, NSET={name}\n" + "".join(", ".join(map(str, members[k : k + 8])) + "\n" for k in range(0, len(members), 8))


def calculix(folder, name, text):
    """Rows of its NAME.dat."""
    (folder / f"{name}.inp").write_text(text)
    done = subprocess.run(["ccx", name], cwd=folder, capture_output=True, text=True, timeout=300)
    if done.returncode:
        raise RuntimeError(done.stdout[-300:])
    return (folder / f"{name}.dat").read_text().splitlines()


def calculix_frequencies(folder, name, text, count, free):
    """Hz; free: its six rigid motions are passed over."""
    rows = calculix(folder, name, f"{text}*STEP\n*FREQUENCY\n{count + 6 * free}\n*END STEP\n")
    hertz = [float(row.split()[3]) for row in rows if re.match(r"\s+\d+\s+\S+E\S+\s+\S+\s+\S+E", row)]
    return np.array(hertz[6 * free : count + 6 * free])
