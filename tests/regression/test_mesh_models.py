"""`flexframe reduce` on meshes of MED and VTK: every kind of element has the frequencies of the same mesh as an Abaqus deck, whichever way
its cells are turned; groups are sets; wrong files get a sentence. The MED files are written here by h5py in the layout of version 4."""
import base64
import json
import struct
import zlib

import h5py
import numpy as np

from program import expect, near, run, run_parts

STEEL = "2.1e11,0.3,7850"
# Abaqus' name, VTK's number, MED's name, corners of a cell, its edges in the order of their middle nodes; places when mirrored
TET = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
WEDGE = [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)]
BRICK = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
TURNED = {4: [0, 2, 1, 3], 6: [0, 2, 1, 3, 5, 4], 8: [0, 3, 2, 1, 4, 7, 6, 5]}
KINDS = {
    "C3D4": (10, "TE4", 4, []),
    "C3D10": (24, "T10", 4, TET),
    "C3D6": (13, "PE6", 6, []),
    "C3D15": (26, "P15", 6, WEDGE),
    "C3D8I": (12, "HE8", 8, []),
    "C3D20R": (25, "H20", 8, BRICK),
    "S3": (5, "TR3", 3, []),
    "S4": (9, "QU4", 4, []),
}


def grid(kind):
    """Points and cells of a bar (a strip of shells) of 6 x 2 x 2 (6 x 2) fields, bent a little so that nothing is regular."""
    corners, edges = KINDS[kind][2:]
    shell = kind[0] == "S"
    nx, ny, nz = 6, 2, 0 if shell else 2
    number = lambda i, j, k: (i * (ny + 1) + j) * (nz + 1) + k
    points = [
        (i / nx, 0.2 * j / ny, 0.1 * k / max(nz, 1) + 0.05 * (i / nx) ** 2)
        for i in range(nx + 1)
        for j in range(ny + 1)
        for k in range(nz + 1)
    ]
    boxes = [
        [number(i + a, j + b, k + c) for c in ((0,) if shell else (0, 1)) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
        for i in range(nx)
        for j in range(ny)
        for k in range(max(nz, 1))
    ]
    cut = {
        "S4": [[0, 1, 2, 3]],
        "S3": [[0, 1, 2], [0, 2, 3]],
        8: [list(range(8))],
        6: [[0, 1, 2, 4, 5, 6], [0, 2, 3, 4, 6, 7]],
        4: [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]],
    }
    cells = [[box[c] for c in part] for box in boxes for part in cut[kind if shell else corners]]
    middle = {}
    for cell in cells:
        for a, b in edges:
            pair = tuple(sorted((cell[a], cell[b])))
            if pair not in middle:
                middle[pair] = len(points)
                points.append(tuple((np.array(points[pair[0]]) + points[pair[1]]) / 2))
            cell.append(middle[pair])
    return np.array(points), cells


def mirrored(kind, cell):
    """The same cell, its first face seen from the other side."""
    corners, edges = KINDS[kind][2:]
    turn = TURNED[corners]
    of_edge = {frozenset(e): cell[corners + k] for k, e in enumerate(edges)}
    return [cell[k] for k in turn] + [of_edge[frozenset((turn[a], turn[b]))] for a, b in edges]


def inp(kind, points, cells):
    text = "*NODE\n" + "".join(f"{n + 1}, {x!r}, {y!r}, {z!r}\n" for n, (x, y, z) in enumerate(points.tolist()))
    text += f"*ELEMENT, TYPE={kind}, ELSET=ALL\n"
    for e, cell in enumerate(cells):
        words = [str(e + 1), *(str(n + 1) for n in cell)]
        lines = [", ".join(words[k : k + 15]) for k in range(0, len(words), 15)]
        text += ",\n".join(lines) + "\n"
    return text


def vtu(kind, points, cells, packed=False, material=None):
    """An unstructured grid in text, or packed and appended in base64."""
    arrays = {
        "connectivity": ("Int64", np.concatenate(cells).astype("<i8")),
        "offsets": ("Int64", np.cumsum([len(c) for c in cells]).astype("<i8")),
        "types": ("UInt8", np.full(len(cells), KINDS[kind][0], "u1")),
    }
    appended = b""

    def array(name, type_, values, more=""):
        nonlocal appended
        if not packed:
            words = " ".join(repr(v) for v in values.ravel().tolist())
            return f'<DataArray type="{type_}" Name="{name}" {more} format="ascii">{words}</DataArray>'
        raw = values.tobytes()
        blocks = zlib.compress(raw)
        at = len(appended)
        appended += base64.b64encode(struct.pack("<4I", 1, len(raw), 0, len(blocks))) + base64.b64encode(blocks)
        return f'<DataArray type="{type_}" Name="{name}" {more} format="appended" offset="{at}"/>'

    data = ""
    if material is not None:
        data = "<CellData>" + array("material", "Int32", np.array(material, "<i4")) + "</CellData>"
    body = f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}">{data}<Points>'
    body += array("Points", "Float64", points.astype("<f8"), 'NumberOfComponents="3"') + "</Points><Cells>"
    body += "".join(array(name, *of) for name, of in arrays.items()) + "</Cells></Piece>"
    head = '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian"'
    head += ' compressor="vtkZLibDataCompressor">' if packed else ">"
    tail = f'<AppendedData encoding="base64">_{appended.decode()}</AppendedData>' if packed else ""
    return f"{head}<UnstructuredGrid>{body}</UnstructuredGrid>{tail}</VTKFile>\n"


def write_med(path, kinds, points, groups=(), version=4):
    """kinds: MED's name -> (cells, family of each); groups: (number of the family, its groups)."""
    with h5py.File(path, "w") as file:
        file.create_group("INFOS_GENERALES").attrs.update({"MAJ": version, "MIN": 1, "REL": 0})
        mesh = file.create_group("ENS_MAA/bar")
        mesh.attrs.update({"DIM": 3, "ESP": 3, "TYP": 0, "REP": 0, "UNI": np.bytes_("m".ljust(16) * 3)})
        state = mesh.create_group("-0000000000000000001-0000000000000000001")
        state.create_group("NOE")["COO"] = np.ascontiguousarray(points.T).ravel()
        for name, (cells, families) in kinds.items():
            place = state.create_group(f"MAI/{name}")
            place["NOD"] = (np.array(cells).T + 1).ravel()
            place["FAM"] = np.array(families)
        for number, names in groups:
            family = file.create_group(f"FAS/bar/ELEME/FAM_{-number}")
            family.attrs["NUM"] = number
            text = np.array([list(n.encode().ljust(80, b"\0")) for n in names], "i1")
            family.create_dataset("GRO/NOM", (len(names),), np.dtype(("i1", (80,))))[...] = text


def reduce(folder, model, *words):
    done = run(
        "reduce", model, "-o", folder / "body.sid", "--method", "eigen", "--modes", 5, "--no-stiffening", "--quiet", "--json", *words
    )
    return json.loads(done.stdout) if done.returncode == 0 else {"frequencies": [0.0] * 5, "mass": 0.0}


def every_kind(folder):
    for kind, (_, med_name, _, _) in KINDS.items():
        points, cells = grid(kind)
        words = ["--material", STEEL] + (["--thickness", "0.01"] if kind[0] == "S" else [])
        (folder / "m.inp").write_text(inp(kind, points, cells))
        wanted = reduce(folder, folder / "m.inp", *words)
        # Every second cell is seen from the other side, and in MED all of them as it has them.
        turned = cells if kind[0] == "S" else [mirrored(kind, c) if k % 2 else c for k, c in enumerate(cells)]
        (folder / "m.vtu").write_text(vtu(kind, points, turned))
        (folder / "packed.vtu").write_text(vtu(kind, points, cells, packed=True))
        write_med(folder / "m.med", {med_name: (turned, [0] * len(cells))}, points)
        for file in ("m.vtu", "packed.vtu", "m.med"):
            made = reduce(folder, folder / file, *words)
            for a, b in zip(made["frequencies"], wanted["frequencies"]):
                near(a, b, 1e-8 * b, f"{kind} from {file}")
            near(made["mass"], wanted["mass"], 1e-9 * wanted["mass"], f"mass of {kind} from {file}")


def groups_are_sets(folder):
    """Half of the bar of another material, its left face held: sets of cells, of faces and of VTK's integers."""
    points, cells = grid("C3D8I")
    half = [k < len(cells) // 2 for k in range(len(cells))]
    left = [n for n, p in enumerate(points) if p[0] == 0.0]
    number = lambda j, k: left[j * 3 + k]
    faces = [[number(j, k), number(j + 1, k), number(j + 1, k + 1), number(j, k + 1)] for j in range(2) for k in range(2)]
    text = inp("C3D8I", points, cells) + "*NSET, NSET=WALL\n" + ", ".join(str(n + 1) for n in left) + "\n"
    text += "*ELSET, ELSET=STIFF, GENERATE\n" + f"1, {sum(half)}\n*ELSET, ELSET=SOFT, GENERATE\n{sum(half) + 1}, {len(cells)}\n"
    (folder / "m.inp").write_text(text)
    words = lambda stiff, soft, wall: ["--material", f"{stiff}={STEEL}", "--material", f"{soft}=7e10,0.3,2700", "--hold", wall]
    wanted = reduce(folder, folder / "m.inp", *words("STIFF", "SOFT", "WALL"))
    families = [-1 if h else -2 for h in half]
    kinds = {"HE8": (cells, families), "QU4": (faces, [-3] * 4)}
    write_med(folder / "m.med", kinds, points, [(-1, ["stiff"]), (-2, ["soft", "other"]), (-3, ["wall"])])
    made = reduce(folder, folder / "m.med", *words("stiff", "soft", "wall"))
    (folder / "m.vtu").write_text(vtu("C3D8I", points, cells, material=[1 if h else 2 for h in half]))
    near(made["mass"], wanted["mass"], 1e-9 * wanted["mass"], "mass of two groups of MED")
    for a, b in zip(made["frequencies"], wanted["frequencies"]):
        near(a, b, 1e-8 * b, "two groups of MED, one held")
    free = ["--material", f"material:1={STEEL}", "--material", "material:2=7e10,0.3,2700"]
    made = reduce(folder, folder / "m.vtu", *free)
    near(made["mass"], wanted["mass"], 1e-9 * wanted["mass"], "mass of two values of VTK")


def msh(kind, points, cells, groups):
    """gmsh's format 2.2; groups: (dimension, number of gmsh's type, group, nodes) of each element."""
    text = '$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n3 1 "all"\n3 2 "right"\n$EndPhysicalNames\n'
    text += (
        f"$Nodes\n{len(points)}\n" + "".join(f"{n + 1} {x!r} {y!r} {z!r}\n" for n, (x, y, z) in enumerate(points.tolist())) + "$EndNodes\n"
    )
    rows = [f"{k + 1} {of} 2 {group} 1 " + " ".join(str(n + 1) for n in nodes) for k, (of, group, nodes) in enumerate(groups)]
    return text + f"$Elements\n{len(rows)}\n" + "\n".join(rows) + "\n$EndElements\n"


def elements_of_gmsh(folder):
    """Format 2 writes an element again for each further group that it is in: it is one all the same. Shells of second order."""
    points, cells = grid("C3D8I")
    half = len(cells) // 2
    once = [(5, 1, c) for c in cells]
    again = [(5, 2, c) for c in cells[half:]]
    (folder / "m.inp").write_text(inp("C3D8I", points, cells) + f"*ELSET, ELSET=RIGHT, GENERATE\n{half + 1}, {len(cells)}\n")
    words = ["--material", STEEL, "--material", "RIGHT=7e10,0.3,2700"]
    wanted = reduce(folder, folder / "m.inp", *words)
    (folder / "m.msh").write_text(msh("C3D8I", points, cells, once + again))
    made = reduce(folder, folder / "m.msh", *words)
    near(made["mass"], wanted["mass"], 1e-9 * wanted["mass"], "mass of elements in two groups of gmsh")
    for a, b in zip(made["frequencies"], wanted["frequencies"]):
        near(a, b, 1e-8 * b, "elements in two groups of gmsh")
    # Written twice in a deck they do count twice, which is told.
    twice = inp("C3D8I", points, cells + cells[:1])
    (folder / "twice.inp").write_text(twice)
    told = reduce(folder, folder / "twice.inp", "--material", STEEL)["warnings"]
    expect(any("1 solids lie on the same nodes as others (element 25 on those of element 1)" in w for w in told), f"twice: {told}")
    # A bar that stands off the solids is left out, and that is told.
    far = np.vstack([points, [[2.0, 0.0, 0.0]]])
    (folder / "bar.msh").write_text(msh("C3D8I", far, cells, once + [(1, 3, [0, len(points)]), (1, 3, [0, 1])]))
    told = reduce(folder, folder / "bar.msh", "--material", STEEL)["warnings"]
    expect(any("1 surface and line cells are left out" in w for w in told), f"a bar beside solids: {told}")
    for kind, of, edges in (("S6", 9, [(0, 1), (1, 2), (2, 0)]), ("S8R", 16, [(0, 1), (1, 2), (2, 3), (3, 0)])):
        points, cells = grid("S3" if kind == "S6" else "S4")
        points, middle = points.tolist(), {}
        for cell in cells:
            for a, b in edges:
                pair = tuple(sorted((cell[a], cell[b])))
                if pair not in middle:
                    middle[pair] = len(points)
                    points.append([(u + v) / 2 for u, v in zip(points[pair[0]], points[pair[1]])])
                cell.append(middle[pair])
        points = np.array(points)
        (folder / "s.inp").write_text(inp(kind, points, cells))
        (folder / "s.msh").write_text(msh(kind, points, cells, [(of, 1, c) for c in cells]))
        shell = ["--material", STEEL, "--thickness", "0.01"]
        wanted, made = (reduce(folder, folder / f"s.{ending}", *shell)["frequencies"] for ending in ("inp", "msh"))
        for a, b in zip(made, wanted):
            near(a, b, 1e-8 * b, f"{kind} of gmsh")


def wrong_files(folder):
    points, cells = grid("C3D4")
    good = vtu("C3D4", points, cells)

    def refused(name, content, *parts):
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        done = run("reduce", folder / name, "-o", folder / "no.sid", "--material", STEEL, code=2)
        for part in (name, *parts):
            expect(part in done.stderr and len(done.stderr.splitlines()) == 1, f"{part!r} is missing in: {done.stderr}")
        expect(not (folder / "no.sid").exists(), f"{name} left a body")

    refused("no.vtu", "hello", "XML")
    refused("cut.vtu", good[: len(good) // 2], "XML")
    refused("poly.vtu", good.replace("UnstructuredGrid", "PolyData"), "PolyData")
    refused("nan.vtu", good.replace(repr(float(points[3, 0])), "nan", 1), "finite")
    refused("many.vtu", good.replace('connectivity"  format="ascii">0 ', 'connectivity"  format="ascii">99999 '), "names point")
    refused("pyramid.vtu", good.replace("10 10 10", "10 14 10", 1), "pyramids")
    refused("lines.vtu", vtu("C3D4", points, cells).replace("10 ", "4 ").replace(" 10<", " 4<"), "neither volume nor surface")
    refused("no.med", "hello", "no HDF5 file")
    write_med(folder / "a.med", {"TE4": (cells, [0] * len(cells))}, points)
    data = (folder / "a.med").read_bytes()
    refused("half.med", data[: len(data) // 2], "HDF5")
    write_med(folder / "a.med", {"TE4": (cells, [0] * len(cells))}, points, version=2)
    refused("old.med", (folder / "a.med").read_bytes(), "MED 2")
    write_med(folder / "a.med", {"TE4": (cells, [0] * 3)}, points)
    refused("family.med", (folder / "a.med").read_bytes(), "FAM has 3 numbers")
    write_med(folder / "a.med", {"TE4": ([[0, 1, 2, 999]], [0])}, points)
    refused("node.med", (folder / "a.med").read_bytes(), "1000")
    with h5py.File(folder / "a.med", "w") as file:
        file["x"] = [1.0]
    refused("other.med", (folder / "a.med").read_bytes(), "no MED file")
    # Polygons beside no solid would be missing from a shell.
    write_med(folder / "a.med", {"TR3": ([[0, 1, 2]], [0]), "POG": ([[2, 3, 4, 5, 6]], [0])}, points)
    refused("polygon.med", (folder / "a.med").read_bytes(), "polygons")
    refused("mesh.unv", "    -1\n  2411\n", "gmsh -0 FILE.unv -format msh41")
    refused("avs.inp", "8 1 0 0 0\n1 0 0 0\n", "no line begins with a keyword")


run_parts(every_kind, groups_are_sets, elements_of_gmsh, wrong_files)
