#!/usr/bin/env python3
"""Makes fork.txt, channel.txt, conrod.txt and conrod.inp again: true finite element modes that the kernel map and the reducer are
measured against.

Needs gmsh and ccx (Debian packages gmsh, calculix-ccx) and numpy. python3 make_bodies.py [NAME...]
fork: a tuning fork of steel, tines 1 m x 0.1 m x 0.1 m, slit 17 mm (1.7 % of their length), ten-node tetrahedra.
channel: an open thin-walled frame of sheet 4 mm thick (U section with a cross member), six-node shells.
conrod: the con rod of assets/conrod/conrod.geo, ten-node tetrahedra; conrod.inp is the model that CalculiX solved, its last comment
the frequencies that CalculiX found: they do not come from the program that is tested with them.
All free; the modes are the first three that are not rigid. File: counts, then a vertex a line (x y z and three modes of ux uy uz,
each scaled to a largest displacement of 1), then a triangle a line (vertex numbers from 0).
"""
import pathlib
import subprocess
import sys
import tempfile

import numpy

FORK = """SetFactory("OpenCASCADE");
Box(1) = {-0.4, 0, -0.1085, 1.4, 0.1, 0.217};
Box(2) = {0, -0.1, -0.0085, 1.1, 0.3, 0.017};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Mesh.ElementOrder = 2; Mesh.CharacteristicLengthMin = 0.05; Mesh.CharacteristicLengthMax = 0.05; Mesh.Optimize = 1;
Physical Volume("body") = {3};
"""
CHANNEL = """SetFactory("OpenCASCADE");
Rectangle(1) = {0, -0.25, 0, 2, 0.5};
Rectangle(2) = {0, 0, 0, 2, 0.15};
Rotate {{1,0,0},{0,0,0},Pi/2} { Surface{2}; }
Translate {0,-0.25,0} { Surface{2}; }
Rectangle(3) = {0, 0, 0, 2, 0.15};
Rotate {{1,0,0},{0,0,0},Pi/2} { Surface{3}; }
Translate {0,0.25,0} { Surface{3}; }
Rectangle(4) = {0, -0.25, 0, 0.15, 0.5};
Rotate {{0,1,0},{0,0,0},-Pi/2} { Surface{4}; }
Translate {0.8,0,0} { Surface{4}; }
BooleanFragments { Surface{1}; Delete; }{ Surface{2,3,4}; Delete; }
Mesh.ElementOrder = 2; Mesh.CharacteristicLengthMin = 0.09; Mesh.CharacteristicLengthMax = 0.09;
Physical Surface("body") = Surface{:};
"""


def read_msh(path):
    """Nodes by number and elements by gmsh type (9: six-node triangle, 11: ten-node tetrahedron) of a version 2 file."""
    lines = iter(path.read_text().splitlines())
    nodes, elements = {}, {}
    for line in lines:
        if line == "$Nodes":
            for _ in range(int(next(lines))):
                word = next(lines).split()
                nodes[int(word[0])] = [float(a) for a in word[1:4]]
        if line == "$Elements":
            for _ in range(int(next(lines))):
                word = [int(a) for a in next(lines).split()]
                elements.setdefault(word[1], []).append(word[3 + word[2] :])
    return nodes, elements


def read_modes(path):
    """Frequency and displacements by node of every mode in a .frd file."""
    modes, current = [], None
    for line in path.read_text().splitlines():
        if line.startswith("  100CL"):
            frequency = float(line[12:24])
        elif line.startswith(" -4"):
            current = {} if line.split()[1] == "DISP" else None
            if current is not None:
                modes.append((frequency, current))
        elif line.startswith(" -1") and current is not None:
            current[int(line[3:13])] = [float(line[13 + 12 * k : 25 + 12 * k]) for k in range(3)]
        elif line.startswith(" -3"):
            current = None
    return modes


def quarters(face):
    """Four flat triangles of a six-node one."""
    a, b, c, ab, bc, ca = face
    return [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]


def make(name, geometry, kind):
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        (folder / "m.geo").write_text(geometry)
        subprocess.run(
            ["gmsh", "-3" if kind == "C3D10" else "-2", "-format", "msh2", "m.geo", "-o", "m.msh"],
            cwd=folder,
            check=True,
            capture_output=True,
        )
        nodes, elements = read_msh(folder / "m.msh")
        body = elements[11 if kind == "C3D10" else 9]
        used = sorted({n for e in body for n in e})
        text = "*NODE, NSET=NALL\n" + "".join("%d, %.9g, %.9g, %.9g\n" % (n, *nodes[n]) for n in used)
        text += "*ELEMENT, TYPE=%s, ELSET=EALL\n" % kind
        for k, e in enumerate(body):
            # gmsh and Abaqus number the last two edges of a tetrahedron the other way round.
            order = e[:8] + [e[9], e[8]] if kind == "C3D10" else e
            text += "%d, %s\n" % (k + 1, ", ".join(map(str, order)))
        text += "*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7850\n"
        text += "*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL\n" if kind == "C3D10" else "*SHELL SECTION, ELSET=EALL, MATERIAL=STEEL\n0.004\n"
        (folder / "m.inp").write_text(text + "*STEP\n*FREQUENCY\n12\n*NODE FILE, OUTPUT=2D\nU\n*END STEP\n")
        subprocess.run(["ccx", "m"], cwd=folder, check=True, capture_output=True)
        modes = read_modes(folder / "m.frd")
    frequencies = [f for f, _ in modes]
    elastic = [m for f, m in modes if f > 1e-2 * frequencies[-1]][:3]
    if name == "conrod":
        text += "** CalculiX finds, Hz: %s\n" % " ".join("%.6g" % f for f in frequencies if f > 1e-2 * frequencies[-1])
        pathlib.Path(__file__).with_name("conrod.inp").write_text(text)
    if kind == "C3D10":
        # Faces that belong to one tetrahedron.
        faces = {}
        for e in body:
            a, b, c, d, ab, bc, ca, ad, cd, bd = e
            for f in ((a, c, b, ca, bc, ab), (a, b, d, ab, bd, ad), (b, c, d, bc, cd, bd), (c, a, d, ca, ad, cd)):
                faces.setdefault(tuple(sorted(f[:3])), []).append(f)
        triangles = [t for f in faces.values() if len(f) == 1 for t in quarters(f[0])]
    else:
        triangles = [t for e in body for t in quarters(e)]
    order = sorted({n for t in triangles for n in t})
    number = {n: k for k, n in enumerate(order)}
    shapes = [numpy.array([m[n] for n in order]) for m in elastic]
    shapes = [s / numpy.linalg.norm(s, axis=1).max() for s in shapes]
    rows = ["%d %d" % (len(order), len(triangles))]
    for k, n in enumerate(order):
        rows.append(" ".join("%.6g" % a for a in nodes[n]) + "  " + " ".join("%.5g" % a for s in shapes for a in s[k]))
    rows += ["%d %d %d" % tuple(number[n] for n in t) for t in triangles]
    pathlib.Path(__file__).with_name(name + ".txt").write_text("\n".join(rows) + "\n")
    print(name, len(order), "vertices,", len(triangles), "triangles; frequencies", " ".join("%.4g" % f for f in frequencies), "Hz")


CONROD = (pathlib.Path(__file__).parents[4] / "assets/conrod/conrod.geo").read_text()
for name, geometry, kind in (("fork", FORK, "C3D10"), ("channel", CHANNEL, "S6"), ("conrod", CONROD, "C3D10")):
    if not sys.argv[1:] or name in sys.argv[1:]:
        make(name, geometry, kind)
