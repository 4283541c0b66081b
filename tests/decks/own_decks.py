#!/usr/bin/env python3
"""Decks made here, every word of the list in sim/reduce/REDUCE.md among them, against CalculiX or against the same model written otherwise.

  own_decks.py FLEXFRAME [FOLDER] [--only TEXT]

A row is the largest relative difference of the first six frequencies to the truth: CalculiX' of the same deck where it reads its words
("ccx"), else flexframe's of an equivalent deck (another program's writing, parts written out, one formula). Differences above the row's
bound make the exit status 1. Needs numpy, scipy, gmsh and ccx.
"""
import argparse
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import deck_table  # noqa: E402

STEEL = "*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1E11, 0.3\n*DENSITY\n7850.\n"
HEX = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
HEX += [(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2), (0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]


class Mesh:
    """Nodes and elements with numbers, and words of a deck."""

    def __init__(self):
        self.x, self.elements, self.at = {}, [], {}

    def node(self, p, key=None):
        key = key if key is not None else tuple(round(1e7 * c) for c in p)
        if key not in self.at:
            self.at[key] = len(self.x) + 1
            self.x[self.at[key]] = np.array(p, float)
        return self.at[key]

    def add(self, kind, nodes, where):
        self.elements.append((len(self.elements) + 1, kind, nodes, where))

    def block(self, cells, corner, size, kind, where, shape=None, part=0):
        """Bricks, or shells where the last count is 0; shape: (x, y, z) -> place; part: nodes of other parts are not shared."""
        nx, ny, nz = cells
        corner, size = np.array(corner, float), np.array(size, float)
        h = size / np.maximum(2 * np.array(cells), 1)
        for i in range(nx):
            for j in range(ny):
                for k in range(max(nz, 1)):
                    if nz == 0:
                        places = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0)]
                        count = {"S4": 4, "S4R": 4, "S8": 8, "S8R": 8, "S3": 4, "S6": 8}[kind]
                    else:
                        places, count = HEX, 20 if "20" in kind else 8
                    nodes = []
                    for a, b, c in places[:count]:
                        p = corner + h * (2 * np.array((i, j, k)) + (a, b, c))
                        q = shape(p) if shape else p
                        nodes.append(self.node(q, (part, *(round(1e7 * v) for v in q))))
                    if kind in ("S3", "C3D6"):
                        for corners in ((0, 1, 2), (0, 2, 3)):
                            up = [nodes[c + 4] for c in corners] if kind == "C3D6" else []
                            self.add(kind, [nodes[c] for c in corners] + up, where)
                    else:
                        self.add(kind, nodes, where)

    def tetrahedra(self, geometry, h, where, folder):
        """C3D10 of a gmsh geometry."""
        (folder / "t.geo").write_text(
            'SetFactory("OpenCASCADE");\n'
            + geometry
            + f"Mesh.ElementOrder=2; Mesh.CharacteristicLengthMax={h}; Physical Volume(1)=Volume{{:}};\n"
        )
        subprocess.run(["gmsh", "-3", "-format", "msh2", "t.geo", "-o", "t.msh"], cwd=folder, check=True, capture_output=True)
        lines = iter((folder / "t.msh").read_text().splitlines())
        own = {}
        for line in lines:
            word = line.split()
            if line == "$Nodes":
                for _ in range(int(next(lines))):
                    word = next(lines).split()
                    own[word[0]] = [float(a) for a in word[1:]]
            elif len(word) > 13 and word[1] == "11":
                n = [self.node(own[a]) for a in word[-10:]]
                self.add("C3D10", n[:8] + [n[9], n[8]], where)

    def where(self, test):
        return [n for n, p in self.x.items() if test(p)]

    def used(self, where):
        return sorted({n for _, _, nodes, w in self.elements if w == where for n in nodes})

    def text(self, only=None):
        out = "*NODE, NSET=NALL\n"
        nodes = self.x if only is None else {n: self.x[n] for n in self.used(only)}
        out += "".join(f"{n}, {p[0]:.12g}, {p[1]:.12g}, {p[2]:.12g}\n" for n, p in nodes.items())
        for kind, where in dict.fromkeys((e[1], e[3]) for e in self.elements):
            if only is not None and where != only:
                continue
            out += f"*ELEMENT, TYPE={kind}, ELSET={where}\n"
            for number, k, list_, w in self.elements:
                if (k, w) == (kind, where):
                    words = [str(a) for a in [number, *list_]]
                    out += ", ".join(words[:11]) + (",\n" + ", ".join(words[11:]) if len(words) > 11 else "") + "\n"
        return out

    def nastran(self, property_of, large=False, system=None):
        """GRID and element cards; system: (number, place -> coordinates in it)."""
        order20 = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15]
        out = ""
        for n, p in self.x.items():
            q = system[1](p) if system else p
            cp = system[0] if system else 0
            if large:
                out += f"GRID*   {n:16d}{cp:16d}{q[0]:16.9e}{q[1]:16.9e}\n*       {q[2]:16.9e}\n"
            else:
                out += f"GRID,{n},{cp},{q[0]:.9e},{q[1]:.9e},{q[2]:.9e}\n"
        names = {
            "C3D6": "CPENTA",
            "C3D10": "CTETRA",
            "C3D20R": "CHEXA",
            "C3D20": "CHEXA",
            "C3D8I": "CHEXA",
            "S4": "CQUAD4",
            "S8R": "CQUAD8",
            "S3": "CTRIA3",
        }
        for number, kind, nodes, where in self.elements:
            given = [nodes[k] for k in order20] if len(nodes) == 20 else nodes
            words = [names[kind], number, property_of[where], *given]
            lines = [words[:9]]
            rest = words[9:]
            while rest:
                lines.append(["", *rest[:8]])
                rest = rest[8:]
            out += "".join(",".join(map(str, line)) + "\n" for line in lines)
        return out


def truss_frequencies(m, held, E=2.1e11, rho=7850.0, area=1e-4):
    """Of bars that only stretch, with consistent mass."""
    n = len(m.x)
    K, M = np.zeros((3 * n, 3 * n)), np.zeros((3 * n, 3 * n))
    for _, _, (a, b), _ in m.elements:
        d = m.x[b] - m.x[a]
        L = np.linalg.norm(d)
        for i, p in enumerate((a, b)):
            for j, q in enumerate((a, b)):
                at = np.ix_(range(3 * p - 3, 3 * p), range(3 * q - 3, 3 * q))
                K[at] += (1 if i == j else -1) * E * area / L**3 * np.outer(d, d)
                M[at] += rho * area * L / 6 * (2 if i == j else 1) * np.eye(3)
    free = [3 * k + d for k in range(n) if k + 1 not in held for d in range(3)]
    values = np.linalg.eigvals(np.linalg.solve(M[np.ix_(free, free)], K[np.ix_(free, free)]))
    return sorted(np.sqrt(np.abs(values)) / (2 * math.pi))


def set_of(name, nodes):
    return f"*NSET, NSET={name}\n" + "".join(", ".join(map(str, nodes[k : k + 12])) + ",\n" for k in range(0, len(nodes), 12))


def coupling(reference, kind):
    return f"*COUPLING, REF NODE={reference}, SURFACE=END, CONSTRAINT NAME=C\n*{kind}\n1, 3\n"


def direction(degrees):
    """Two axes of an orientation turned about z."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return f"{c:.12g}, {s:.12g}, 0., {-s:.12g}, {c:.12g}, 0."


def on(axis, value):
    return lambda p: abs(p[axis] - value) < 1e-6


def bar(kind="C3D20R", cells=(8, 2, 2)):
    m = Mesh()
    m.block(cells, (0, 0, 0), (0.8, 0.06, 0.1), kind, "BAR")
    return m


SOLID = "*SOLID SECTION, ELSET=BAR, MATERIAL=STEEL\n"
HELD = "*BOUNDARY\nROOT, 1, 3\n"


def arc(p):
    r, phi = 0.25 - p[1], p[0]
    return np.array([r * math.cos(phi), r * math.sin(phi), p[2]])


def faces_at(m, axis, value):
    """(element, face number) of bricks whose corner face lies there."""
    out = []
    faces = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    for number, _, nodes, _ in m.elements:
        if len(nodes) not in (8, 20):
            continue
        for k, f in enumerate(faces):
            if all(abs(m.x[nodes[c]][axis] - value) < 1e-6 for c in f):
                out.append((number, k + 1))
    return out


def tet_faces(m, test):
    faces = [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)]
    return [(e[0], k + 1) for e in m.elements for k, f in enumerate(faces) if all(test(m.x[e[2][c]]) for c in f)]


def face_nodes(m, element, face):
    nodes = m.elements[element - 1][2]
    if len(nodes) == 10:
        corners, middles = [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)][face - 1], {
            (0, 1): 4,
            (1, 2): 5,
            (0, 2): 6,
            (0, 3): 7,
            (1, 3): 8,
            (2, 3): 9,
        }
    else:
        corners = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)][face - 1]
        edges = [(0, 1), (1, 2), (2, 3), (0, 3), (4, 5), (5, 6), (6, 7), (4, 7), (0, 4), (1, 5), (2, 6), (3, 7)]
        middles = {e: 8 + k for k, e in enumerate(edges)}
    pairs = [tuple(sorted((a, b))) for a, b in zip(corners, corners[1:] + corners[:1])]
    return [nodes[c] for c in corners] + [nodes[middles[p]] for p in pairs]


def face_shares(m, faces):
    """Weight of each node: its share of the faces' area, as *DISTRIBUTING has them here."""
    out = {}
    for e, f in faces:
        nodes = face_nodes(m, e, f)
        corners = [m.x[n] for n in nodes[: len(nodes) // 2]]
        area = sum(np.linalg.norm(np.cross(corners[k] - corners[0], corners[k + 1] - corners[0])) / 2 for k in range(1, len(corners) - 1))
        for n in nodes:
            out[n] = out.get(n, 0.0) + area / len(nodes)
    return out


def mean_motion(m, weights, node, place):
    """A node that moves as the weighted least-squares rigid motion of others, as three equations."""
    total = sum(weights.values())
    middle = sum(w * m.x[n] for n, w in weights.items()) / total
    cross = lambda r: np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    J = sum(w * cross(m.x[n] - middle).T @ cross(m.x[n] - middle) for n, w in weights.items())
    turn = {n: np.linalg.solve(J, w * cross(m.x[n] - middle)) for n, w in weights.items()}
    arm = cross(np.array(place) - middle)
    out = ""
    for d in range(3):
        terms = [(node, d + 1, -1.0)]
        for n, w in weights.items():
            row = w / total * np.eye(3)[d] - arm[d] @ turn[n]
            terms += [(n, k + 1, row[k]) for k in range(3) if abs(row[k]) > 1e-14]
        lines = [", ".join(f"{a}, {b}, {c:.12g}" for a, b, c in terms[k : k + 4]) for k in range(0, len(terms), 4)]
        out += f"*EQUATION\n{len(terms)}\n" + ",\n".join(lines) + "\n"
    return out


def surface(name, faces):
    return f"*SURFACE, NAME={name}, TYPE=ELEMENT\n" + "".join(f"{e}, S{f}\n" for e, f in faces)


def decks(folder):
    """(name, deck text, truth: 'ccx' or another deck's text, bound, files beside)."""
    m = bar()
    root, tip = m.where(on(0, 0.0)), m.where(on(0, 0.8))
    base = m.text() + set_of("ROOT", root) + set_of("TIP", tip) + STEEL + SOLID
    yield "bar", base + HELD, "ccx", 1e-4
    yield (
        "supports in the first step",
        base + "*STEP\n*STATIC\n" + HELD + "*END STEP\n*STEP\n*STATIC\n*BOUNDARY\n" "TIP,1,3\n*END STEP\n",
        "ccx",
        1e-4,
    )
    equations = "".join(
        f"*EQUATION\n2\n{n}, 2, 1., {tip[0]}, 2, -1.\n*EQUATION\n3\n{n}, 3, 2., {tip[0]}, 3, -1., {tip[1]}, 3, -1.\n" for n in tip[2:]
    )
    yield "equations", base + HELD + equations, "ccx", 1e-4
    yield "springs", base + HELD + (
        f"*ELEMENT, TYPE=SPRING1, ELSET=SA\n9001, {tip[0]}\n*SPRING, ELSET=SA\n2\n3.E6\n"
        f"*ELEMENT, TYPE=SPRING2, ELSET=SB\n9002, {tip[0]}, {root[3]}\n"
        f"*SPRING, ELSET=SB\n3, 3\n5.E6\n*NODE\n5000, 0.8, 0.5, 0.3\n*ELEMENT, TYPE=SPRINGA, ELSET=SC\n"
        f"9003, {tip[4]}, 5000\n*SPRING, ELSET=SC\n\n4.E6\n"
        "*BOUNDARY\n5000, 1, 3\n"
    ), "ccx", 1e-4
    yield "masses", base + HELD + f"*ELEMENT, TYPE=MASS, ELSET=M\n9001, {tip[0]}\n9002, {tip[5]}\n*MASS, ELSET=M\n3.5\n", "ccx", 1e-4
    heavier = base.replace("7850.", f"{7850 + 20 / (0.8 * 0.06 * 0.1):.12g}")
    yield "nonstructural mass, total", base + HELD + "*NONSTRUCTURAL MASS, ELSET=BAR, UNITS=TOTAL MASS\n20.,\n", heavier + HELD, 1e-6
    yield "nonstructural mass, per volume", base + HELD + "*NONSTRUCTURAL MASS, ELSET=BAR, UNITS=MASS PER VOLUME\n500.,\n", base.replace(
        "7850.", "8350."
    ) + HELD, 1e-6
    skew = f"*TRANSFORM, NSET=TIP, TYPE=R\n0.6, 0.8, 0., -0.8, 0.6, 0.\n*BOUNDARY\nTIP, 2, 2\n"
    yield "transform", base + HELD + skew, "ccx", 1e-4
    point = "*NODE\n5000, 0.9, 0.03, 0.05\n*ELEMENT, TYPE=MASS, ELSET=M\n9001, 5000\n*MASS, ELSET=M\n4.\n"
    end = surface("END", faces_at(m, 0, 0.8))
    yield ("kinematic coupling over faces", base + HELD + point + end + coupling(5000, "KINEMATIC"), "ccx", 1e-3)
    yield "kinematic coupling of some directions", base + HELD + point + end + (
        "*COUPLING, REF NODE=5000, SURFACE=END, CONSTRAINT NAME=C\n*KINEMATIC\n2, 3\n*BOUNDARY\n5000, 1, 1\n5000, 4, 6\n"
    ), base + HELD + point + "*BOUNDARY\n5000, 1, 1\n" + "".join(
        f"*EQUATION\n2\n{n}, {d}, 1., 5000, {d}, -1.\n" for n in tip for d in (2, 3)
    ), 1e-6
    shares = face_shares(m, faces_at(m, 0, 0.8))
    yield "distributing coupling over faces", base + HELD + point + end + coupling(5000, "DISTRIBUTING"), (
        base + HELD + point + mean_motion(m, shares, 5000, (0.9, 0.03, 0.05))
    ), 1e-6
    inertia = "*ELEMENT, TYPE=ROTARYI, ELSET=RI\n9002, 5000\n*ROTARY INERTIA, ELSET=RI\n0.02, 0.03, 0.04\n"
    arms = "".join(f"*ELEMENT, TYPE=MASS, ELSET=M{k}\n{9010 + k}, {5010 + k}\n*MASS, ELSET=M{k}\n1.\n" for k in range(6))
    # Six masses of a kilogramme: moments 2 (b^2 + c^2), ... about the point.
    a, b, c = (math.sqrt(0.25 * s) for s in (0.03 + 0.04 - 0.02, 0.02 + 0.04 - 0.03, 0.02 + 0.03 - 0.04))
    places = (
        [(0.9 + s * a, 0.03, 0.05) for s in (-1, 1)]
        + [(0.9, 0.03 + s * b, 0.05) for s in (-1, 1)]
        + [(0.9, 0.03, 0.05 + s * c) for s in (-1, 1)]
    )
    six = "*NODE, NSET=SIX\n" + "".join(f"{5010 + k}, {p[0]:.12g}, {p[1]:.12g}, {p[2]:.12g}\n" for k, p in enumerate(places)) + arms
    coupled = coupling(5000, "KINEMATIC")
    yield "rotary inertia", base + HELD + point.replace("4.\n", "6.\n") + inertia + end + coupled, base + HELD + (
        "*NODE\n5000, 0.9, 0.03, 0.05\n" + six + "*NSET, NSET=ALL6\nTIP, SIX\n*RIGID BODY, NSET=ALL6, REF NODE=5000\n"
    ), 1e-5
    yield (
        "rigid body",
        base + HELD + "*NODE\n5000, 0.9, 0.1, 0.05\n5001, 0.9, 0.1, 0.05\n"
        "*RIGID BODY, NSET=TIP, REF NODE=5000, ROT NODE=5001\n*BOUNDARY\n5000, 2, 2\n5001, 1, 1\n",
        "ccx",
        1e-4,
    )
    corners = [n for n in tip if m.x[n][1] in (0.0, 0.06) and m.x[n][2] in (0.0, 0.1)]
    thrice = ", ".join(f"{n}" for n in corners for _ in range(3))
    yield "mean rotation", base + HELD + f"*NODE\n5000, 2., 0., 0.\n*MPC\nMEANROT, {thrice}, 5000\n*BOUNDARY\n5000, 1, 1\n", "ccx", 1e-4
    beside = [n for n in tip if n not in corners][:3]
    pairs = [(beside[0], corners[0]), (beside[1], corners[1])]
    same = "".join(f"*EQUATION\n2\n{a}, {d}, 1., {b}, {d}, -1.\n" for a, b in pairs for d in (1, 2, 3))
    mpc = f"*MPC\nTIE, {beside[0]}, {corners[0]}\nPIN, {beside[1]}, {corners[1]}\n"
    yield "mpc of tie and pin", base + HELD + mpc, base + HELD + same, 1e-9
    # Words for numbers: exponents with D, continued lines of sets, nodes without coordinates, extra numbers.
    odd = base.replace("2.1E11", "2.1D11").replace("7850.", " 7.85e+3 ") + "*NODE\n7000\n7001,0.3\n"
    yield "odd numbers", odd.replace("*BOUNDARY", "*boundary") + HELD.lower(), "ccx", 1e-4
    # Materials in directions.
    ortho = base[: base.index("*MATERIAL")] + (
        "*MATERIAL, NAME=STEEL\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n"
        "1.4E11, 1.E10, 0.9E10, 0.3, 0.28, 0.4, 5.E9, 4.8E9,\n3.E9\n*DENSITY\n1600.\n"
    )
    yield "orthotropic in turned axes", ortho + (
        "*ORIENTATION, NAME=O, SYSTEM=RECTANGULAR\n0.8, 0.6, 0., -0.6, 0.8, 0.\n*SOLID SECTION, ELSET=BAR, MATERIAL=STEEL, ORIENTATION=O\n"
        + HELD
    ), "ccx", 1e-4
    r = Mesh()
    r.block((8, 2, 2), (0, 0, 0), (1.2, 0.05, 0.04), "C3D20R", "BAR", arc)
    ring = r.text() + set_of("ROOT", r.where(lambda p: abs(p[1]) < 1e-9)) + ortho[ortho.index("*MATERIAL") :]
    # CalculiX has the directions at each integration point, here they are those of the element's middle.
    yield "orthotropic in a cylinder's axes", ring + (
        "*ORIENTATION, NAME=O, SYSTEM=CYLINDRICAL\n0., 0., 0., 0., 0., 1.\n*SOLID SECTION, ELSET=BAR, MATERIAL=STEEL, ORIENTATION=O\n"
        + HELD
    ), "ccx", 1e-2
    aniso = (
        "*ELASTIC, TYPE=ANISO\n2.0E11, 0.8E11, 1.9E11, 0.7E11, 0.75E11, 2.1E11, 0.1E11, 0.05E11,\n"
        "-0.02E11, 0.6E11, 0.03E11, 0.01E11, 0.02E11, 0.04E11, 0.55E11, 0.01E11,\n"
        "0.02E11, -0.03E11, 0.015E11, 0.025E11, 0.65E11\n"
    )
    yield "anisotropic", base.replace("*ELASTIC\n2.1E11, 0.3\n", aniso) + HELD, "ccx", 1e-4
    held_ring = r.text() + set_of("INNER", r.where(lambda p: abs(math.hypot(p[0], p[1]) - 0.2) < 1e-6)) + STEEL + SOLID
    yield (
        "transform in a cylinder's directions",
        held_ring + "*TRANSFORM, NSET=INNER, TYPE=C\n" "0., 0., 0., 0., 0., 1.\n*BOUNDARY\nINNER, 1, 2\n",
        "ccx",
        1e-4,
    )
    # Coarse ones of C3D6 and C3D8I differ from CalculiX' by 2 % (told of: the mesh is coarse).
    for kind in ("C3D6", "C3D8", "C3D20", "C3D8I"):
        k = bar(kind, (12, 2, 3))
        allowed = 1e-4 if kind in ("C3D8", "C3D20") else 5e-2
        yield kind, k.text() + set_of("ROOT", k.where(on(0, 0.0))) + STEEL + SOLID + HELD, "ccx", allowed
    # Tetrahedra with couplings over their faces.
    t = Mesh()
    t.tetrahedra(
        "Cylinder(1) = {0,0,0, 0,0,0.4, 0.05, 2*Pi}; Cylinder(2) = {0,0,-0.1, 0,0,0.6, 0.03, 2*Pi};\n"
        "BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };\n",
        0.025,
        "BAR",
        folder,
    )
    top = tet_faces(t, lambda p: abs(p[2] - 0.4) < 1e-6)
    pipe = (
        t.text()
        + set_of("ROOT", t.where(on(2, 0.0)))
        + STEEL
        + SOLID
        + HELD
        + "*NODE\n50000, 0., 0., 0.5\n*ELEMENT, TYPE=MASS, ELSET=M\n90001, 50000\n*MASS, ELSET=M\n2.\n"
        + surface("END", top)
    )
    yield ("kinematic coupling over faces of C3D10", pipe + coupling(50000, "KINEMATIC"), "ccx", 1e-3)
    yield "distributing coupling over faces of C3D10", pipe + coupling(50000, "DISTRIBUTING"), (
        pipe + mean_motion(t, face_shares(t, top), 50000, (0.0, 0.0, 0.5))
    ), 1e-3  # the faces at the edge are curved
    # Two parts tied, as one deck and as instances.
    two = Mesh()
    two.block((6, 2, 2), (0, 0, 0), (0.4, 0.06, 0.1), "C3D20R", "A", part=0)
    two.block((5, 3, 3), (0.4, 0, 0), (0.3, 0.06, 0.1), "C3D20R", "B", part=1)
    a_end, b_end = [f for f in faces_at(two, 0, 0.4) if f[0] <= 24], [f for f in faces_at(two, 0, 0.4) if f[0] > 24]
    sections = STEEL + "*SOLID SECTION, ELSET=A, MATERIAL=STEEL\n*SOLID SECTION, ELSET=B, MATERIAL=STEEL\n"
    tied = two.text() + surface("SM", a_end) + surface("SS", b_end) + sections + "*TIE, NAME=T, POSITION TOLERANCE=0.001\nSS, SM\n"
    yield "tie", tied + set_of("ROOT", two.where(on(0, 0.0))) + HELD, "ccx", 5e-3
    part = Mesh()
    part.block((5, 3, 3), (0, 0, 0), (0.3, 0.06, 0.1), "C3D20R", "B")
    first = Mesh()
    first.block((6, 2, 2), (0, 0, 0), (0.4, 0.06, 0.1), "C3D20R", "A")
    # The second part lies turned by 90 degrees about z, at another place, and is turned back by its instance.
    back = Mesh()
    back.block((5, 3, 3), (0, 0, 0), (0.3, 0.06, 0.1), "C3D20R", "B", lambda p: np.array([-p[1] + 1.0, p[0] + 2.0, p[2] - 0.5]))
    assembly = (
        "*PART, NAME=PA\n"
        + first.text()
        + set_of("ROOT", first.where(on(0, 0.0)))
        + surface("SM", faces_at(first, 0, 0.4))
        + "*SOLID SECTION, ELSET=A, MATERIAL=STEEL\n*END PART\n*PART, NAME=PB\n"
        + back.text()
        + surface("SS", faces_at(part, 0, 0.0))
        + "*SOLID SECTION, ELSET=B, MATERIAL=STEEL\n*END PART\n*ASSEMBLY, NAME=AS\n"
        "*INSTANCE, NAME=I1, PART=PA\n*END INSTANCE\n*INSTANCE, NAME=I2, PART=PB\n-1.6, 1., 0.5\n"
        "-1.6, 1., 0.5, -1.6, 1., 1.5, 0.\n*END INSTANCE\n*TIE, NAME=T, POSITION TOLERANCE=0.001\nI2.SS, I1.SM\n*END ASSEMBLY\n" + STEEL
    )
    # x' = -(y - 2) ..: turned by -90 degrees about the origin after the shift (the shift comes first in Abaqus).
    shift = "-1., -2., 0.5\n-1., -2., 0.5, -1., -2., 1.5, 0.\n"
    assembly = assembly.replace("-1.6, 1., 0.5\n-1.6, 1., 0.5, -1.6, 1., 1.5, 0.\n", "-1., -1.6, 0.5\n0., 0.4, 0., 0., 0.4, 1., -90.\n")
    del shift
    yield "instances", assembly.replace(
        "-1., -1.6, 0.5\n0., 0.4, 0., 0., 0.4, 1., -90.\n", "-1., -2., 0.5\n0., 0., 0., 0., 0., 1., -90.\n"
    ).replace("*INSTANCE, NAME=I1, PART=PA\n", "*INSTANCE, NAME=I1, PART=PA\n-0.4, 0., 0.\n") + "*BOUNDARY\nI1.ROOT, 1, 3\n", tied + set_of(
        "ROOT", two.where(on(0, 0.0))
    ) + HELD, 1e-6
    # Shells.
    for kind, cells, bound in (("S8R", (20, 8, 0), 1e-2), ("S8", (20, 8, 0), 5e-2)):
        s = Mesh()
        s.block(cells, (0, 0, 0), (1.0, 0.4, 0), kind, "P", lambda p: np.array([p[0], 0.5 * math.sin(p[1]), 0.5 * math.cos(p[1])]))
        plate = (
            s.text()
            + set_of("ROOT", s.where(on(0, 0.0)))
            + STEEL
            + "*SHELL SECTION, ELSET=P, MATERIAL=STEEL\n0.01\n*BOUNDARY\nROOT, 1, 6\n"
        )
        yield f"curved shell of {kind}", plate, "ccx", bound
    s = Mesh()
    s.block((12, 6, 0), (0, 0, 0), (0.6, 0.3, 0), "S8R", "P")
    carbon = (
        "*MATERIAL, NAME=STEEL\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n"
        "1.4E11, 1.E10, 1.E10, 0.3, 0.3, 0.3, 5.E9, 5.E9,\n3.5E9\n*DENSITY\n1600.\n"
    )
    lam = s.text() + set_of("ROOT", s.where(on(0, 0.0))) + carbon
    layers = "".join(f"0.001, , STEEL, O{abs(a)}{'M' if a < 0 else ''}\n" for a in (0, 45, -45, 90, 90, -45, 45, 0))
    ways = "".join(f"*ORIENTATION, NAME=O{abs(a)}{'M' if a < 0 else ''}\n" f"{direction(a)}\n" for a in (0, 45, -45, 90))
    yield "composite shell", lam + ways + "*SHELL SECTION, ELSET=P, COMPOSITE\n" + layers + "*BOUNDARY\nROOT, 1, 6\n", "ccx", 1e-2
    plain = s.text() + set_of("ROOT", s.where(on(0, 0.0))) + STEEL
    held6 = "*BOUNDARY\nROOT, 1, 6\n"
    layered = "*SHELL SECTION, ELSET=P, COMPOSITE\n0.003,,STEEL\n0.005,,STEEL\n0.002,,STEEL\n"
    one = "*SHELL SECTION, ELSET=P, MATERIAL=STEEL\n0.01\n"
    yield "shell of equal layers", plain + layered + held6, plain + one + held6, 1e-6
    # Beams against formulas by fine solids of CalculiX are in the unit tests; here B31, B32 and their truth of each other.
    for shape, numbers in (("RECT", "0.02, 0.03"), ("PIPE", "0.02, 0.003"), ("BOX", "0.04, 0.03, 0.003, 0.003, 0.003, 0.003")):
        texts = []
        for kind, n in (("B31", 40), ("B32R", 20)):
            b = Mesh()
            for k in range(n):
                step = 2 if kind != "B31" else 1
                b.add(kind, [b.node((((step * k + i) / (step * n)), 0.1 * ((step * k + i) / (step * n)), 0)) for i in range(step + 1)], "P")
            texts.append(
                b.text() + STEEL + f"*BEAM SECTION, ELSET=P, MATERIAL=STEEL, SECTION={shape}\n{numbers}\n0., 0., -1.\n*BOUNDARY\n1, 1, 6\n"
            )
        yield f"beams {shape}: B31 and B32R", texts[0], texts[1], 5e-3
    # Trusses.
    dome = Mesh()
    top_node = dome.node((0, 0, 0.5))
    outer = [dome.node((math.cos(a), math.sin(a), 0)) for a in np.linspace(0, 2 * math.pi, 6, endpoint=False)]
    inner = [dome.node((0.5 * math.cos(a + 0.5), 0.5 * math.sin(a + 0.5), 0.35)) for a in np.linspace(0, 2 * math.pi, 6, endpoint=False)]
    for i in range(6):
        for pair in ((top_node, inner[i]), (inner[i], inner[(i + 1) % 6]), (inner[i], outer[i]), (inner[i], outer[(i + 1) % 6])):
            dome.add("T3D2", list(pair), "P")
    yield "trusses", dome.text() + set_of(
        "ROOT", outer
    ) + STEEL + "*SOLID SECTION, ELSET=P, MATERIAL=STEEL\n1.E-4\n*BOUNDARY\nROOT, 1, 3\n", truss_frequencies(dome, outer), 1e-6
    # Generated meshes.
    generated = (
        "*NODE, NSET=NALL\n1, 0., 0., 0.\n11, 0.5, 0., 0.\n101, 0., 0.05, 0.\n111, 0.5, 0.05, 0.\n*NGEN, NSET=LOW\n"
        "1, 11, 1\n*NGEN, NSET=HIGH\n101, 111, 1\n"
        "*NSET, NSET=ZERO, GENERATE\n1, 11, 1\n*NFILL, NSET=ALL\nLOW, HIGH, 2, 50\n"
    )
    flat = Mesh()
    flat.block((10, 2, 0), (0, 0, 0), (0.5, 0.05, 0), "S4", "P")
    shell = STEEL + "*SHELL SECTION, ELSET=P, MATERIAL=STEEL\n0.004\n"
    rows = "*ELEMENT, TYPE=S4, ELSET=P\n1, 1, 2, 52, 51\n*ELGEN, ELSET=P\n1, 10, 1, 1, 2, 50, 100\n"
    written = flat.text() + set_of("ROOT", flat.where(on(0, 0.0))) + shell + held6
    yield "generated nodes and elements", generated + rows + shell + "*NSET, NSET=ROOT\n1, 51, 101\n" + held6, written, 1e-6
    (folder / "part.inc").write_text(m.text() + set_of("ROOT", root))
    yield "included file", "*HEADING\nodd\n*INCLUDE, INPUT=part.inc\n" + STEEL + SOLID + HELD, base + HELD, 1e-9
    # Nastran's writing of the same.
    hold = "SPC1,1,123," + ",".join(map(str, root[:5])) + "\n" + "".join(f"SPC1,1,123,{n}\n" for n in root[5:])
    mat = "MAT1,1,2.1+11,,.3,7850.\n"
    yield "Nastran: CHEXA, large fields", m.nastran({"BAR": 5}, large=True) + mat + "PSOLID,5,1\n" + hold, bar("C3D20").text() + set_of(
        "ROOT", root
    ) + STEEL + SOLID + HELD, 5e-3
    cylinder = "CORD2C,7,,0.1,-.2,.3,.1,-.2,1.3\n,1.1,-.2,.3\n"
    origin = np.array([0.1, -0.2, 0.3])

    def polar(p):
        q = p - origin
        return math.hypot(q[0], q[1]), math.degrees(math.atan2(q[1], q[0])), q[2]

    pipe_held = t.text() + set_of("ROOT", t.where(on(2, 0.0))) + STEEL + SOLID + HELD
    hold_t = "".join(f"SPC1,1,123,{n}\n" for n in t.where(on(2, 0.0)))
    yield "Nastran: CTETRA in a cylinder's coordinates", cylinder + t.nastran(
        {"BAR": 5}, system=(7, polar)
    ) + mat + "PSOLID,5,1\n" + hold_t, pipe_held, 1e-5
    ring_nodes = sorted(
        {m_ for e, f in top for m_ in [t.elements[e - 1][2][c] for c in [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)][f - 1]]}
    )
    spider = "".join(f"RBE2,{900 + k},50000,123,{n}\n" for k, n in enumerate(ring_nodes))
    rigid_inp = (
        pipe_held
        + "*NODE\n50000, 0., 0., 0.5\n*ELEMENT, TYPE=MASS, ELSET=M\n90001, 50000\n*MASS, ELSET=M\n2.\n"
        + set_of("RN", ring_nodes)
        + "*RIGID BODY, NSET=RN, REF NODE=50000\n"
    )
    yield "Nastran: RBE2 and CONM2", t.nastran(
        {"BAR": 5}
    ) + "GRID,50000,,0.,0.,.5\nCONM2,90001,50000,,2.\n" + mat + "PSOLID,5,1\n" + hold_t + spider, rigid_inp, 1e-6
    mpc_nodes = tip[2:]
    mpcs = "".join(f"MPC,3,{n},2,1.,{tip[0]},2,-1.\nMPC,3,{n},3,2.,{tip[0]},3,-1.\n,,{tip[1]},3,-1.\n" for n in mpc_nodes)
    yield "Nastran: MPC", m.nastran({"BAR": 5}) + mat + "PSOLID,5,1\n" + hold + mpcs, bar("C3D20").text() + set_of(
        "ROOT", root
    ) + STEEL + SOLID + HELD + equations, 5e-3
    weights = ",".join(str(n) for n in tip[:2])
    mean = f"RBE3,900,,5000,123456,1.,123,{weights}\n"
    mean += "".join("," + ",".join(str(n) for n in tip[k : k + 8]) + "\n" for k in range(2, len(tip), 8))
    distributed = "*SURFACE, NAME=END, TYPE=NODE\nTIP,\n" + coupling(5000, "DISTRIBUTING").replace("1, 3\n", "")
    point_cards = "GRID,5000,,.9,.03,.05\nCONM2,9001,5000,,4.\n"
    quadratic = bar("C3D20").text() + set_of("ROOT", root) + set_of("TIP", tip) + STEEL + SOLID + HELD
    cards = m.nastran({"BAR": 5}) + mat + "PSOLID,5,1\n" + hold
    yield "Nastran: RBE3", cards + point_cards + mean, quadratic + point + distributed, 1e-6
    springs = f"CELAS2,800,3.+6,{tip[0]},2\nCELAS1,801,4,{tip[3]},1,{root[3]},1\nPELAS,3,1.,,,4,5.+6\n"
    abaqus_springs = f"*ELEMENT, TYPE=SPRING1, ELSET=SA\n9001, {tip[0]}\n*SPRING, ELSET=SA\n2\n3.E6\n"
    abaqus_springs += f"*ELEMENT, TYPE=SPRING2, ELSET=SB\n9002, {tip[3]}, {root[3]}\n*SPRING, ELSET=SB\n1, 1\n5.E6\n"
    yield "Nastran: CELAS1, CELAS2", cards + springs, quadratic + abaqus_springs, 1e-6
    inner = r.where(lambda p: abs(math.hypot(p[0], p[1]) - 0.2) < 1e-6)
    grids = r.nastran({"BAR": 5})
    for n in inner:
        grids = re.sub(rf"(?m)^(GRID,{n},.*)$", r"\1,8", grids)
    around = "CORD2C,8,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\n" + "".join(f"SPC1,1,12,{n}\n" for n in inner)
    ring20 = Mesh()
    ring20.block((8, 2, 2), (0, 0, 0), (1.2, 0.05, 0.04), "C3D20", "BAR", arc)
    ring_text = ring20.text() + set_of("INNER", inner) + STEEL + SOLID
    turned = "*TRANSFORM, NSET=INNER, TYPE=C\n0., 0., 0., 0., 0., 1.\n*BOUNDARY\nINNER, 1, 2\n"
    yield "Nastran: supports in a cylinder's directions", grids + mat + "PSOLID,5,1\n" + around, ring_text + turned, 1e-6
    S = np.diag([1 / 1.4e11, 1 / 1e10, 1 / 0.9e10, 1 / 5e9, 1 / 3e9, 1 / 4.8e9])
    for i, j, value in ((0, 1, 0.3 / 1.4e11), (0, 2, 0.28 / 1.4e11), (1, 2, 0.4 / 1e10)):
        S[i, j] = S[j, i] = -value
    C = np.linalg.inv(S)
    constants = [f"{C[i, j]:.7e}" if i == j or (i < 3 and j < 3) else "" for i in range(6) for j in range(i, 6)] + ["1600."]
    words = ["MAT9", "1", *constants]
    mat9 = "".join(("," if k else "") + ",".join(words[k : k + (8 if k else 9)]) + "\n" for k in [0, *range(9, len(words), 8)])
    mat9 += "CORD2R,9,,0.,0.,0.,0.,0.,1.\n,.8,.6,0.\n"
    ortho20 = bar("C3D20").text() + set_of("ROOT", root) + ortho[ortho.index("*MATERIAL") :]
    ortho20 += (
        "*ORIENTATION, NAME=O, SYSTEM=RECTANGULAR\n0.8, 0.6, 0., -0.6, 0.8, 0.\n*SOLID SECTION, ELSET=BAR, MATERIAL=STEEL, ORIENTATION=O\n"
    )
    yield "Nastran: MAT9 in turned axes", m.nastran({"BAR": 5}) + mat9 + "PSOLID,5,1,9\n" + hold, ortho20 + HELD, 1e-5
    wedge = bar("C3D6")
    wedge_root = wedge.where(on(0, 0.0))
    wedge_cards = wedge.nastran({"BAR": 5}) + mat + "PSOLID,5,1\n" + "".join(f"SPC1,1,123,{n}\n" for n in wedge_root)
    yield "Nastran: CPENTA", wedge_cards, wedge.text() + set_of("ROOT", wedge_root) + STEEL + SOLID + HELD, 1e-6
    flat_cards = flat.nastran({"P": 5}) + "PSHELL,5,1,.004,1,,1\n" + mat + "".join(f"SPC1,1,123456,{n}\n" for n in flat.where(on(0, 0.0)))
    yield "Nastran: CQUAD4", flat_cards, flat.text() + set_of("ROOT", flat.where(on(0, 0.0))) + shell + held6, 1e-6
    plies = (0, 45, -45, 90, 90, -45, 45, 0)
    cards = [f"1,.001,{a}.,YES" for a in plies]
    pcomp = "PCOMP,5\n" + "".join(f",{cards[k]},{cards[k + 1]}\n" for k in range(0, 8, 2))
    mat8 = "MAT8,1,1.4+11,1.+10,.3,5.+9,5.+9,3.5+9,1600.\n"
    lamina = s.nastran({"P": 5}) + pcomp + mat8 + "".join(f"SPC1,1,123456,{n}\n" for n in s.where(on(0, 0.0)))
    yield "Nastran: PCOMP on CQUAD8", lamina, lam + ways + "*SHELL SECTION, ELSET=P, COMPOSITE\n" + layers + held6, 5e-3


def reduced(flexframe, path, folder):
    return deck_table.reduce(flexframe, path, folder, 300)


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("flexframe", type=pathlib.Path)
    words.add_argument("folder", nargs="?", type=pathlib.Path)
    words.add_argument("--only", default="")
    given = words.parse_args()
    flexframe = given.flexframe.resolve()
    bad = 0
    with tempfile.TemporaryDirectory(prefix="flexframe_own_") as scratch:
        folder = (given.folder or pathlib.Path(scratch)).resolve()
        folder.mkdir(exist_ok=True)
        print("| deck | truth | largest difference |\n|---|---|---|")
        for name, text, truth, bound in decks(folder):
            if not re.search(given.only, name):
                continue
            stem = "".join(c if c.isalnum() else "_" for c in name)
            path = folder / (stem + (".bdf" if name.startswith("Nastran") else ".inp"))
            path.write_text(text)
            ours = reduced(flexframe, path, folder)
            if ours["answer"] != "accepted":
                bad += 1
                print(f"| {name} | {ours['answer']}: {'; '.join(ours['reasons'])[:200]} | |", flush=True)
                continue
            if isinstance(truth, list):
                wanted = truth
            elif truth == "ccx":
                wanted = deck_table.ccx_frequencies(path, folder, 600, None)
                wanted = [f for f in wanted or [] if f > 1e-3 * max(wanted)] if wanted else None
            else:
                other = folder / (stem + "_truth.inp")
                other.write_text(truth)
                answer = reduced(flexframe, other, folder)
                wanted = answer.get("frequencies")
            if not wanted:
                bad += 1
                print(f"| {name} | no truth | |", flush=True)
                continue
            count = min(len(wanted), len(ours["frequencies"]), 6)
            off = max(abs(a / b - 1) for a, b in zip(ours["frequencies"][:count], wanted[:count]))
            told = "; ".join(ours["warnings"])[:150] if off > bound else ""
            bad += off > bound
            source = "CalculiX" if truth == "ccx" else "formula" if isinstance(truth, list) else "written otherwise"
            print(f"| {name} | {source} | {off:.1e}{' (bound %.0e) ' % bound + told if off > bound else ''} |", flush=True)
            if off > bound:
                print("   ", json.dumps([round(f, 3) for f in ours["frequencies"][:6]]), json.dumps([round(f, 3) for f in wanted[:6]]))
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
