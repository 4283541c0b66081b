#!/usr/bin/env python3
"""Nineteen shapes that the kernel map was not tuned on: free modes of CalculiX as truth, nodes placed evenly, at random and in clusters.

  shapes.py FOLDER [NAME...]    makes the models there once (gmsh, ccx), then prints error and told error of every set

A set is silent where the map is wrong by more than a twentieth of the deflection and neither its error bars nor a warning say so; the last
lines count them. PYTHONPATH: the folder of the module flexframe (build/clang/python). Needs numpy.
"""

import pathlib
import subprocess
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import bodies  # noqa: E402

LIMIT = 0.05
COUNTS = (8, 16, 30, 60, 100)
HEAD = 'SetFactory("OpenCASCADE");\n'


def tube(number, ends, radius, inner=0.0):
    """A bar from one point to another, hollow where `inner` is given; its volume has that number."""
    a, b = np.array(ends[0]), np.array(ends[1])
    along = ", ".join(f"{x:.9g}" for x in np.concatenate([a, b - a]))
    text = f"Cylinder({number}) = {{{along}, {radius}, 2*Pi}};\n"
    if inner:
        text += f"Cylinder({number + 500}) = {{{along}, {inner}, 2*Pi}};\n"
    return text


def spoked_wheel():
    text = "Torus(1) = {0,0,0, 0.2, 0.012, 2*Pi}; Cylinder(2) = {0,0,-0.02, 0,0,0.04, 0.04, 2*Pi};\n"
    for k in range(5):
        c, s = np.cos(0.4 * np.pi * k), np.sin(0.4 * np.pi * k)
        text += tube(3 + k, ((0.03 * c, 0.03 * s, 0), (0.2 * c, 0.2 * s, 0)), 0.009)
    return text + "BooleanUnion(50) = { Volume{1}; Delete; }{ Volume{2:7}; Delete; };\n"


def crankshaft():
    text = tube(1, ((0, 0, 0), (0.1, 0, 0)), 0.025) + tube(2, ((0.12, 0, 0.05), (0.2, 0, 0.05)), 0.022)
    text += tube(3, ((0.22, 0, 0), (0.3, 0, 0)), 0.025) + tube(4, ((0.32, 0, -0.05), (0.4, 0, -0.05)), 0.022)
    text += tube(5, ((0.42, 0, 0), (0.52, 0, 0)), 0.025)
    for k, (x, low, high) in enumerate(((0.1, -0.07, 0.08), (0.2, -0.07, 0.08), (0.3, -0.08, 0.07), (0.4, -0.08, 0.07))):
        text += f"Box({6 + k}) = {{{x - 0.001}, -0.03, {low}, 0.022, 0.06, {high - low}}};\n"
    return text + "BooleanUnion(50) = { Volume{1}; Delete; }{ Volume{2:9}; Delete; };\n"


def truss_tower():
    text, k, half = "", 1, 0.05
    corners = [(half, half), (-half, half), (-half, -half), (half, -half)]
    for x, y in corners:
        text += tube(k, ((x, y, 0), (x, y, 0.6)), 0.007)
        k += 1
    for level in range(4):
        z = 0.2 * level
        for i in range(4):
            a, b = corners[i], corners[(i + 1) % 4]
            text += tube(k, ((*a, z), (*b, z)), 0.006)
            k += 1
            if level < 3:
                text += tube(k, ((*a, z), (*b, z + 0.2)), 0.006)
                k += 1
    return text + f"BooleanUnion(400) = {{ Volume{{1}}; Delete; }}{{ Volume{{2:{k - 1}}}; Delete; }};\n"


def size(h):
    return f"Mesh.ElementOrder = 2; Mesh.CharacteristicLengthMin = {h}; Mesh.CharacteristicLengthMax = {h}; Mesh.Optimize = 1;\n"


def gear():
    text = "Cylinder(1) = {0,0,0, 0,0,0.03, 0.1, 2*Pi};\nCylinder(2) = {0,0,-0.01, 0,0,0.05, 0.03, 2*Pi};\n"
    for k in range(16):
        text += (
            f"Box({10 + k}) = {{0.09, -0.009, 0, 0.035, 0.018, 0.03}}; Rotate {{{{0,0,1}},{{0,0,0}},{k}*Pi/8}} {{ Volume{{{10 + k}}}; }}\n"
        )
    text += "BooleanUnion(50) = { Volume{1}; Delete; }{ Volume{10:25}; Delete; };\n"
    return text + "BooleanDifference(51) = { Volume{50}; Delete; }{ Volume{2}; Delete; };\n"


def perforated():
    text = "Box(1) = {0,0,0, 1,0.6,0.01};\n"
    for i in range(4):
        for j in range(3):
            text += f"Cylinder({10 + 3 * i + j}) = {{{0.14 + 0.24 * i}, {0.1 + 0.2 * j}, -0.01, 0,0,0.03, 0.06, 2*Pi}};\n"
    return text + "BooleanDifference(50) = { Volume{1}; Delete; }{ Volume{10:21}; Delete; };\n"


def spring():
    points = "".join(
        f"Point({k + 1}) = {{{0.1 * np.cos(0.25 * np.pi * k):.9g}, {0.1 * np.sin(0.25 * np.pi * k):.9g}, {0.00625 * k:.9g}}};\n"
        for k in range(33)
    )
    return (
        points + "Spline(1) = {1:33};\nWire(2) = {1};\nDisk(1) = {0.1, 0, 0, 0.01};\nRotate {{1,0,0},{0.1,0,0},Pi/2} { Surface{1}; }\n"
        "Extrude { Surface{1}; } Using Wire {2}\nDelete { Surface{1}; }\n"
    )


def airfoil():
    x = 0.5 * (1 - np.cos(np.linspace(0, np.pi, 25)))
    y = 0.6 * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    points = list(zip(x[::-1], y[::-1])) + list(zip(x[1:-1], -y[1:-1]))
    text = "".join(f"Point({k + 1}) = {{{0.4 * a:.9g}, {0.4 * b:.9g}, 0}};\n" for k, (a, b) in enumerate(points))
    return text + f"Spline(1) = {{1:25}};\nSpline(2) = {{25:{len(points)},1}};\nExtrude {{0.02,0,1.5}} {{ Curve{{1,2}}; }}\n"


SHAPES = {
    "bent bracket": (
        "Box(1) = {0,0,0, 0.3,0.15,0.012}; Box(2) = {0,0,0, 0.012,0.15,0.2};\nBox(3) = {0.1,0.03,-0.01, 0.12,0.09,0.03};\n"
        "BooleanUnion(4) = { Volume{1}; Delete; }{ Volume{2}; Delete; };\n"
        "BooleanDifference(5) = { Volume{4}; Delete; }{ Volume{3}; Delete; };\n",
        0.012,
        0,
    ),
    "T-beam of sheet": (
        "Rectangle(1) = {0,-0.1,0, 1.5,0.2}; Rectangle(2) = {0,0,0, 1.5,0.18};\nRotate {{1,0,0},{0,0,0},-Pi/2} { Surface{2}; }\n"
        "BooleanFragments { Surface{1}; Delete; }{ Surface{2}; Delete; }\n",
        0.04,
        0.004,
    ),
    "perforated plate": (perforated(), 0.024, 0),
    "coil spring": (spring(), 0.009, 0),
    "stepped shaft": (
        "Cylinder(1) = {0,0,0, 0.2,0,0, 0.02, 2*Pi}; Cylinder(2) = {0.2,0,0, 0.3,0,0, 0.04, 2*Pi};\n"
        "Cylinder(3) = {0.5,0,0, 0.25,0,0, 0.025, 2*Pi};\n"
        "BooleanUnion(4) = { Volume{1}; Delete; }{ Volume{2,3}; Delete; };\n",
        0.014,
        0,
    ),
    "hollow box": (
        "Box(1) = {0,0,0, 0.4,0.3,0.2}; Box(2) = {0.006,0.006,0.006, 0.388,0.288,0.188};\n"
        "BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };\n",
        0.025,
        0,
    ),
    "gear": (gear(), 0.013, 0),
    "chain link": (
        "Torus(1) = {0.06,0,0, 0.05,0.014, Pi}; Rotate {{0,0,1},{0.06,0,0},-Pi/2} { Volume{1}; }\n"
        "Torus(2) = {-0.06,0,0, 0.05,0.014, Pi}; Rotate {{0,0,1},{-0.06,0,0},Pi/2} { Volume{2}; }\n"
        "Cylinder(3) = {-0.06,0.05,0, 0.12,0,0, 0.014, 2*Pi}; Cylinder(4) = {-0.06,-0.05,0, 0.12,0,0, 0.014, 2*Pi};\n"
        "BooleanUnion(5) = { Volume{1}; Delete; }{ Volume{2,3,4}; Delete; };\n",
        0.009,
        0,
    ),
    "airfoil shell": (airfoil(), 0.05, 0.003),
    "two-legged fork": (
        "Box(1) = {0,0,0, 0.15,0.2,0.06}; Box(2) = {0.15,0,0, 0.5,0.05,0.06}; Box(3) = {0.15,0.12,0, 0.6,0.08,0.06};\n"
        "BooleanUnion(4) = { Volume{1}; Delete; }{ Volume{2,3}; Delete; };\n",
        0.025,
        0,
    ),
}

# Nine more, made when the error bars and the choice of patches were settled with the ten above.
MORE = {
    "I-beam": (
        "Box(1) = {0,0,0, 1.2,0.12,0.01}; Box(2) = {0,0.056,0.0, 1.2,0.008,0.2}; Box(3) = {0,0.01,0.19, 1.2,0.1,0.01};\n"
        "BooleanUnion(4) = { Volume{1}; Delete; }{ Volume{2,3}; Delete; };\n",
        0.02,
        0,
    ),
    "curved panel": (
        "Point(1) = {0,0,0}; Point(2) = {0.5,0,0}; Point(3) = {0.35355339,0.35355339,0}; Circle(1) = {2,1,3};\n"
        "Extrude {0,0,0.7} { Curve{1}; }\n",
        0.03,
        0.003,
    ),
    "thick ring": (
        "Cylinder(1) = {0,0,0, 0,0,0.04, 0.15, 2*Pi}; Cylinder(2) = {0,0,-0.01, 0,0,0.06, 0.13, 2*Pi};\n"
        "BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };\n",
        0.012,
        0,
    ),
    "tuning fork": (
        "Torus(1) = {0,0,0, 0.02,0.005, Pi}; Rotate {{0,0,1},{0,0,0},Pi} { Volume{1}; }\n"
        "Cylinder(2) = {0.02,0,0, 0,0.12,0, 0.005, 2*Pi}; Cylinder(3) = {-0.02,0,0, 0,0.12,0, 0.005, 2*Pi};\n"
        "Cylinder(4) = {0,-0.07,0, 0,0.051,0, 0.005, 2*Pi};\n"
        "BooleanUnion(5) = { Volume{1}; Delete; }{ Volume{2:4}; Delete; };\n",
        0.0035,
        0,
    ),
    "spoked wheel": (spoked_wheel(), 0.011, 0),
    "crankshaft": (crankshaft(), 0.015, 0),
    "pipe bend": (
        "Point(1) = {0.3,0,0}; Point(2) = {0.3,0.05,0}; Point(3) = {0.3,0,0.05}; Point(4) = {0.3,-0.05,0}; Point(5) = {0.3,0,-0.05};\n"
        "Circle(1) = {2,1,3}; Circle(2) = {3,1,4}; Circle(3) = {4,1,5}; Circle(4) = {5,1,2};\n"
        "a[] = Extrude { {0,0,1}, {0,0.3,0}, Pi/2 } { Curve{1:4}; };\nRotate {{0,1,0},{0,0,0},0} { Surface{:}; }\n",
        0.03,
        0.002,
    ),
    "dome": (
        "Sphere(1) = {0,0,0, 0.3, 0, Pi/2, 2*Pi};\nDelete { Volume{1}; }\nDelete { Surface{2}; }\n",
        0.035,
        0.003,
    ),
    "truss tower": (truss_tower(), 0.008, 0),
}
SHAPES |= MORE


def read_msh(path):
    """Nodes by number and elements by gmsh type of a file of version 2."""
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
    """Frequency and displacements by node of every mode of a .frd file."""
    modes, current, frequency = [], None, 0.0
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


def faces_of(body, shell):
    """Flat triangles of the surface, four to each six-node face."""
    faces = {}
    for e in body:
        if shell:
            faces[tuple(e)] = [e]
            continue
        a, b, c, d, ab, bc, ca, ad, cd, bd = e
        for f in ((a, c, b, ca, bc, ab), (a, b, d, ab, bd, ad), (b, c, d, bc, cd, bd), (c, a, d, ca, ad, cd)):
            faces.setdefault(tuple(sorted(f[:3])), []).append(f)
    out = []
    for f in faces.values():
        if len(f) == 1:
            a, b, c, ab, bc, ca = f[0]
            out += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return out


def solve(name, folder):
    """vertices, triangles, modes (4, M, 3): free modes of steel from CalculiX, kept in the folder."""
    kept = folder / (name.replace(" ", "_") + ".npz")
    if kept.exists():
        data = np.load(kept)
        return data["v"], data["t"], data["m"]
    geometry, h, thickness = SHAPES[name]
    stem = kept.stem
    physical = 'Physical Surface("body") = Surface{:};\n' if thickness else 'Physical Volume("body") = Volume{:};\n'
    (folder / (stem + ".geo")).write_text(HEAD + geometry + size(h) + physical)
    subprocess.run(
        ["gmsh", "-2" if thickness else "-3", "-format", "msh2", stem + ".geo", "-o", stem + ".msh"],
        cwd=folder,
        check=True,
        capture_output=True,
    )
    nodes, elements = read_msh(folder / (stem + ".msh"))
    body = elements[9 if thickness else 11]
    text = "*NODE, NSET=NALL\n" + "".join("%d, %.9g, %.9g, %.9g\n" % (n, *nodes[n]) for n in sorted({n for e in body for n in e}))
    text += "*ELEMENT, TYPE=%s, ELSET=EALL\n" % ("S6" if thickness else "C3D10")
    for k, e in enumerate(body):
        # gmsh and Abaqus number the last two edges of a tetrahedron the other way round.
        text += "%d, %s\n" % (k + 1, ", ".join(map(str, e if thickness else e[:8] + [e[9], e[8]])))
    text += "*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7850\n"
    text += f"*SHELL SECTION, ELSET=EALL, MATERIAL=STEEL\n{thickness}\n" if thickness else "*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL\n"
    (folder / (stem + ".inp")).write_text(text + "*STEP\n*FREQUENCY\n12\n*NODE FILE, OUTPUT=2D\nU\n*END STEP\n")
    subprocess.run(["ccx", stem], cwd=folder, check=True, capture_output=True)
    modes = read_modes(folder / (stem + ".frd"))
    elastic = [m for f, m in modes if f > 1e-2 * modes[-1][0]][:4]
    triangles = faces_of(body, thickness > 0)
    order = sorted({n for t in triangles for n in t})
    number = {n: k for k, n in enumerate(order)}
    v = np.array([nodes[n] for n in order])
    t = np.array([[number[n] for n in f] for f in triangles])
    m = np.array([[s[n] for n in order] for s in elastic])
    m /= np.linalg.norm(m, axis=2).max(axis=1)[:, None, None]
    np.savez(kept, v=v, t=t, m=m)
    return v, t, m


def pick_nodes(v, kind, count, rng):
    if kind == "even":
        return bodies.farthest(v, count, int(rng.integers(len(v))))
    weight = np.ones(len(v))
    if kind == "clustered":
        reach = 0.3 * np.linalg.norm(np.ptp(v, axis=0))
        weight += 8.0 * np.exp(-np.sum((v - v[rng.integers(len(v))]) ** 2, axis=1) / reach**2)
    return np.sort(rng.choice(len(v), count, replace=False, p=weight / weight.sum()))


def look(v, t, modes, pick):
    """Error and told error of each mode, relative to its deflection, and the map."""
    import flexframe

    extent = np.linalg.norm(np.ptp(v, axis=0))
    kernel = flexframe.KernelMap(v[pick], v, t.astype(np.int32), precise=True, motions=[m[pick] for m in modes])
    error, told = [], []
    for m in modes:
        s = 1e-6 * extent
        got = kernel.apply_precise(s * m[pick]) / s
        bar = kernel.map_error(s * m[pick], v) / s
        scale = np.sqrt(np.mean(np.sum(m**2, axis=1)))
        error.append(np.sqrt(np.mean(np.sum((got - m) ** 2, axis=1))) / scale)
        told.append(np.sqrt(np.mean(bar.astype(float) ** 2)) / scale if len(bar) else np.nan)
    return np.array(error), np.array(told), kernel


def main():
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(exist_ok=True)
    silent = looked = wrong = cried = 0
    for name in sys.argv[2:] or SHAPES:
        v, t, modes = solve(name, folder)
        rng = np.random.default_rng(5)
        print(f"{name}: {len(v)} vertices, {len(t)} triangles", flush=True)
        for kind in ("even", "random", "clustered"):
            for count in COUNTS:
                error, told, kernel = look(v, t, modes, pick_nodes(v, kind, count, rng))
                warned = bool(kernel.warnings)
                missed = (error > LIMIT) & ~(told > LIMIT) & (not warned)
                looked += len(error)
                wrong += int((error > LIMIT).sum())
                silent += int(missed.sum())
                cried += int(((error <= LIMIT) & (told > LIMIT)).sum())
                print(
                    f"{name:16} {kind:9} {count:4} {kernel.scheme:8} error %",
                    " ".join(f"{100 * e:6.2f}" for e in error),
                    " told",
                    " ".join(f"{100 * e:6.2f}" for e in told),
                    " SILENT" if missed.any() else "",
                    kernel.warnings[0][:80] if warned else "",
                    flush=True,
                )
    print(f"{looked} motions, {wrong} wrong by more than {LIMIT:.0%}, {silent} of these without a word; {cried} told of that are right")


if __name__ == "__main__":
    main()
