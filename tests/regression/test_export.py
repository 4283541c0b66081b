"""`flexframe export`: what other programs would read, read here by the formats' own rules; with --vtk by VTK itself.

    test_export.py FLEXFRAME SOURCE_DIR [--vtk]
"""
import json
import math
import pathlib
import struct
import sys
import xml.etree.ElementTree as xml

import h5py
import numpy as np

from program import bending_pendulum, examples, expect, finish, history, near, run, temporary_folder


def read_glb(path):
    data = path.read_bytes()
    magic, version, length, json_length, kind = struct.unpack_from("<5I", data)
    expect(
        magic == 0x46546C67 and version == 2 and length == len(data) and kind == 0x4E4F534A and json_length % 4 == 0,
        "the GLB header is wrong",
    )
    document = json.loads(data[20 : 20 + json_length])
    at = 20 + json_length
    size, kind = struct.unpack_from("<2I", data, at)
    expect(
        kind == 0x004E4942 and at + 8 + size == len(data) and document["buffers"][0]["byteLength"] <= size, "the GLB data chunk is wrong"
    )
    return document, data[at + 8 :]


def array(document, data, index):
    """Accessor as a list of tuples (or numbers)."""
    a = document["accessors"][index]
    view = document["bufferViews"][a["bufferView"]]
    n = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[a["type"]]
    code = {5126: "f", 5125: "I"}[a["componentType"]]
    expect(view["byteLength"] == 4 * n * a["count"] and view["byteOffset"] % 4 == 0, f"accessor {index} does not fit its view")
    flat = struct.unpack_from(f"<{n * a['count']}{code}", data, view["byteOffset"])
    return list(flat) if n == 1 else [flat[i : i + n] for i in range(0, len(flat), n)]


def turn(q, v):
    x, y, z, w = q
    t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])]
    return [v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2], v[2] + w * t[2] + x * t[1] - y * t[0]]


def read_vtp(path):
    """Arrays of a surface file by name, by the rules of appended raw data."""
    data = path.read_bytes()
    start = data.index(b'<AppendedData encoding="raw">')
    raw = data.index(b"_", start) + 1
    tree = xml.fromstring(data[:start] + b"</VTKFile>")
    codes = {"Float64": "d", "Float32": "f", "Int64": "q", "Int32": "i"}
    out = {}
    for a in tree.iter("DataArray"):
        if a.get("format") == "ascii":  # field data
            out[a.get("Name")] = float(a.text)
            continue
        at = raw + int(a.get("offset"))
        (size,) = struct.unpack_from("<Q", data, at)
        code = codes[a.get("type")]
        out[a.get("Name")] = struct.unpack_from(f"<{size // struct.calcsize(code)}{code}", data, at + 8)
    for a in tree.iter("Array"):
        out[a.get("Name")] = bytes(int(w) for w in a.text.split()).rstrip(b"\0").decode()
    piece = next(tree.iter("Piece"))
    expect(
        len(out["Points"]) == 3 * int(piece.get("NumberOfPoints")) and len(out["offsets"]) == int(piece.get("NumberOfPolys")),
        f"{path.name}: counts do not agree",
    )
    return out


def check_vtkhdf(path, surfaces, steps):
    """The steps at some times against the surface files of these times."""
    with h5py.File(path) as file:
        root = file["VTKHDF"]
        expect(root.attrs["Type"] == b"UnstructuredGrid" and list(root.attrs["Version"]) == [2, 0], "what VTKHDF says it is")
        at = root["Steps"]
        expect(at.attrs["NSteps"] == steps == len(at["Values"]) and (at["NumberOfParts"][:] == 1).all(), "its steps")
        n = root["NumberOfPoints"][0]
        expect(at["CellOffsets"].shape == (steps,) and not at["CellOffsets"][:].any(), "the mesh stands there once")
        expect((root["Types"][:] == 5).all() and len(root["Types"]) == root["NumberOfCells"][0], "its cells are triangles")
        for time, surface in surfaces:
            k = int(np.argmin(np.abs(at["Values"][:] - time)))
            expect(at["Values"][k] == time, f"no step at {time}")
            first = at["PointOffsets"][k]
            expect(np.array_equal(root["Points"][first : first + n].ravel(), surface["Points"]), "points of a step")
            for name in ("displacement", "velocity", "stress"):
                first = at["PointDataOffsets"][name][k]
                expect(np.array_equal(root["PointData"][name][first : first + n].ravel(), surface[name]), f"{name} of a step")
            expect(np.array_equal(root["Connectivity"][:], surface["connectivity"]), "its triangles")
            expect(np.array_equal(root["Offsets"][1:], surface["offsets"]), "their ends")
            expect(np.array_equal(root["CellData/body"][:], surface["body"]), "their bodies")
            row = at["FieldDataOffsets/tip.x"][k]
            expect(root["FieldData/tip.x"][row] == surface["tip.x"], "a history of a step")
        expect(root["PointData/stress"].attrs["unit"] == b"Pa" and root["FieldData/tip.x"].attrs["unit"] == b"m", "units")


def read_by_vtk(folder, series, rate):
    """What VTK's own readers see: points, data, histories, units, motion. Debian's VTK 9.1 knows VTKHDF 1.0: the first step."""
    from scipy.spatial import cKDTree
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOGeometry import vtkGLTFReader
    from vtkmodules.vtkIOHDF import vtkHDFReader
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    points_of = lambda data: vtk_to_numpy(data.GetPoints().GetData())

    def check(data, surface, what):
        expect(np.array_equal(points_of(data).ravel(), surface["Points"]), f"{what}: points as VTK reads them")
        for name, width in (("displacement", 3), ("velocity", 3), ("stress", 1)):
            array = data.GetPointData().GetArray(name)
            expect(array is not None and array.GetNumberOfComponents() == width, f"{what}: {name} as VTK reads it")
            expect(np.array_equal(vtk_to_numpy(array).ravel(), np.float32(surface[name])), f"{what}: numbers of {name}")
        expect(np.array_equal(vtk_to_numpy(data.GetCellData().GetArray("body")), surface["body"]), f"{what}: bodies of the triangles")
        expect(data.GetFieldData().GetArray("tip.x").GetValue(0) == surface["tip.x"], f"{what}: a history")

    reader = vtkXMLPolyDataReader()
    gltf = vtkGLTFReader()
    gltf.SetFileName(str(folder / "p.glb"))
    gltf.ApplyDeformationsToGeometryOn()
    gltf.UpdateInformation()
    gltf.EnableAnimation(0)
    gltf.SetFrameRate(rate)
    gltf.UpdateInformation()
    worst = 0.0
    for k in range(0, len(series), len(series) // 4):
        reader.SetFileName(str(series[k][1]))
        reader.Update()
        data = reader.GetOutput()
        check(data, read_vtp(series[k][1]), series[k][1].name)
        expect(data.GetFieldData().GetArray("TimeValue").GetValue(0) == series[k][0], "the time of a surface")
        expect("stress Pa" in data.GetFieldData().GetAbstractArray("units").GetValue(0), "units of a surface")
        gltf.Modified()
        gltf.UpdateTimeStep(k / rate)
        blocks = gltf.GetOutput().NewIterator()
        solid = points_of(blocks.GetCurrentDataObject())
        worst = max(worst, cKDTree(points_of(data)).query(solid)[0].max())
    # Single precision, and what the morph targets leave out.
    near(worst, 0.0, 1e-5, "animated glTF as VTK reads it against the surfaces, m")
    reader = vtkHDFReader()
    expect(reader.CanReadFile(str(folder / "p.vtkhdf")) == 1, "VTK can read the VTKHDF file")
    reader.SetFileName(str(folder / "p.vtkhdf"))
    reader.Update()
    check(reader.GetOutput(), read_vtp(series[0][1]), "VTKHDF")


BEAM = """[simulation]
duration = 0.2
output_rate = 500
gravity = [0, -9.81, 3]
[[body]]
name = "b"
kind = "beam"
length = 1.0
section = { shape = "box", width = 0.04, height = 0.06, thickness = 0.003 }
material = { density = 2700, youngs_modulus = 7e9 }
MORE
[[joint]]
name = "j"
kind = "weld"
parent = "ground"
child = "b"
[[force]]
kind = "torque"
on = "b.tip"
direction = [1, 0, 0]
value = "4000*t"
[[output]]
name = "tip"
of = "b.tip"
quantity = "position"
[render]
frame_rate = 10
speed = 1
"""


def warnings_stay_warnings(folder):
    """What a run warned of, and what the pictures do: on stderr, quiet or not, whatever it is exported to."""
    scene = folder / "beam.toml"
    scene.write_text(BEAM.replace("MORE", 'elements = 6\neffects = ["bending_xy", "bending_xz", "torsion"]'))
    done = run("simulate", scene, "-o", folder / "b.h5")
    expect("WARNING      shear of 'b' is left out" in done.stdout, f"the run has nothing to warn of: {done.stdout}")
    for to in ("csv", "html", "gltf", "vtk", "vtkhdf"):
        name = folder / f"warned{'' if to == 'vtk' else '.glb' if to == 'gltf' else '.' + to}"
        for words in ((), ("-q",), ("--json",)):
            done = run("export", folder / "b.h5", "--to", to, "-o", name, *words)
            expect("WARNING      shear of 'b' is left out" in done.stderr, f"{to} {words}: {done.stderr}")
        told = json.loads(done.stdout)
        expect(any("shear of 'b'" in w for w in told["warnings"]) and set(told["warnings"]) <= set(told["notes"]), f"{to}: {told}")


def sections_keep_their_size(folder):
    """A beam of eigenforms twists by 0.3 rad: its sections turn as they are, though its axis moves along straight lines."""
    corners = [(x, y, z) for x in (0, 0.25, 0.5, 0.75, 1) for y, z in ((0.1, 0), (0, 0.1), (-0.1, 0), (0, -0.1))]
    faces = [(4 * i + k, 4 * i + 4 + k, 4 * i + 4 + (k + 1) % 4, 4 * i + (k + 1) % 4) for i in range(4) for k in range(4)]
    lines = ["v %r %r %r" % c for c in corners] + ["f %d %d %d %d" % tuple(a + 1 for a in f) for f in faces]
    (folder / "bar.obj").write_text("\n".join(lines) + "\n")
    more = 'mesh = "bar.obj"\nmodel = "modal"\nmodes = { bending_xy = [1, 2], bending_xz = [1], torsion = [1, 2] }\n'
    (folder / "twist.toml").write_text(BEAM.replace("MORE", more + 'effects = ["bending_xy", "bending_xz", "torsion"]'))
    run("simulate", folder / "twist.toml", "-o", folder / "t.h5")
    run("export", folder / "t.h5", "--to", "vtk", "-o", folder / "twist")
    last = read_vtp(sorted((folder / "twist").glob("*.vtp"))[-1])
    points, moved = (np.reshape(last[n], (-1, 3)) for n in ("Points", "displacement"))
    tip = np.abs((points - moved)[:, 0] - 1) < 1e-3
    arms = points[tip] - points[tip].mean(axis=0)
    turned = np.linalg.norm(moved[tip] - moved[tip].mean(axis=0), axis=1).max() / 0.1
    expect(turned > 0.2, f"the tip is turned by {turned} rad")
    off = np.abs(np.linalg.norm(arms, axis=1) / 0.1 - 1).max()
    expect(off < 1e-3, f"corners of a section turned by {turned:.3f} rad are off by {off:.1e} of their distance")


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    warnings_stay_warnings(folder)
    sections_keep_their_size(folder)
    run("simulate", bending_pendulum(folder / "paper.toml"), "-o", folder / "p.h5", "--csv", folder / "wanted.csv", "--no-error-estimate")

    run("export", folder / "p.h5", "--to", "csv", "-o", folder / "p.csv")
    expect((folder / "p.csv").read_bytes() == (folder / "wanted.csv").read_bytes(), "the histories are not those of simulate")
    h = history(folder / "p.csv")

    report = json.loads(run("export", folder / "p.h5", "--to", "vtk", "-o", folder / "vtk", "--json").stdout)
    series = [(float(d.get("timestep")), folder / "vtk" / d.get("file")) for d in xml.parse(folder / "vtk/p.pvd").getroot().iter("DataSet")]
    expect(len(series) == report["pictures"] > 30 and all(f.exists() for _, f in series), "the index does not name the files")
    t, file = series[len(series) // 2]
    surface = read_vtp(file)
    i = min(range(len(h["t"])), key=lambda k: abs(h["t"][k] - t))
    points = [surface["Points"][k : k + 3] for k in range(0, len(surface["Points"]), 3)]
    expect(max(surface["connectivity"]) < len(points) and min(surface["connectivity"]) >= 0, "a triangle has no points")
    # The tip's section lies around the tip: 4.5 mm up and down, with points along its sides, where torsion stresses it most.
    tip = [h["tip.x"][i], h["tip.y"][i], 0.0]
    near(min(math.dist(p, tip) for p in points), 0.0045, 1e-5, "distance of the tip's sides from the tip")
    largest = max(math.dist((0, 0, 0), surface["displacement"][k : k + 3]) for k in range(0, len(surface["displacement"]), 3))
    expect(1e-4 < largest < 0.02, f"displacement {largest}")

    # Velocity is what the points do between the pictures; histories and units stand in the field data.
    k = len(series) // 2
    before, after = read_vtp(series[k - 1][1]), read_vtp(series[k + 1][1])
    apart = series[k + 1][0] - series[k - 1][0]
    fastest = max(abs(v) for v in surface["velocity"])
    worst = max(abs(v - (b - a) / apart) for v, a, b in zip(surface["velocity"], before["Points"], after["Points"]))
    # Differences over two pictures leave a third derivative: 3 % where it changes fastest.
    near(worst / fastest, 0.0, 0.05, "velocity against the points of the neighbours")
    near(surface["TimeValue"], t, 1e-12, "TimeValue")
    expect(abs(surface["tip.x"] - h["tip.x"][i]) < 1e-6, "a history in the field data")
    expect("velocity m/s" in surface["units"] and "stress Pa" in surface["units"] and "tip.x m" in surface["units"], surface["units"])
    expect(len(surface["stress"]) == len(points) and max(surface["stress"]) > 1e3, "stress of a beam")

    # One VTKHDF file, read here by its documented layout: the same arrays at every picture, packed.
    report = json.loads(run("export", folder / "p.h5", "--to", "vtkhdf", "-o", folder / "p.vtkhdf", "--json").stdout)
    check_vtkhdf(folder / "p.vtkhdf", [(time, read_vtp(file)) for time, file in series[:: max(1, len(series) // 5)]], len(series))
    expect((folder / "p.vtkhdf").stat().st_size < 0.5 * sum(file.stat().st_size for _, file in series), "VTKHDF is not smaller")
    run("import", folder / "p.vtkhdf", "-o", folder / "back.h5")
    with h5py.File(folder / "back.h5") as back:
        body = next(iter(back["bodies"].values()))
        expect(len(back["times"]) == len(series) and len(body["surface/points"]) == len(points), "VTKHDF read back")
    run("export", folder / "p.h5", "--to", "vtkhdf", "-o", folder / "p.hdf", code=2)

    # glTF: the surface at that time is the VTK one, within single precision and what the morph targets leave out.
    report = json.loads(run("export", folder / "p.h5", "--to", "gltf", "-o", folder / "p.glb", "--json").stdout)
    document, data = read_glb(folder / "p.glb")
    expect(document["asset"]["version"] == "2.0" and report["morph_targets"] >= 2, f"{report}")
    number, node = next((k, n) for k, n in enumerate(document["nodes"]) if n["name"] == "pendulum")
    mesh = document["meshes"][node["mesh"]]
    primitive = mesh["primitives"][0]
    positions = array(document, data, primitive["attributes"]["POSITION"])
    low = document["accessors"][primitive["attributes"]["POSITION"]]["min"]
    expect(all(abs(low[c] - min(p[c] for p in positions)) < 1e-12 for c in range(3)), "the accessor's least values are wrong")
    animation = document["animations"][0]
    tracks = {c["target"]["path"]: animation["samplers"][c["sampler"]] for c in animation["channels"] if c["target"]["node"] == number}
    times = array(document, data, tracks["weights"]["input"])
    expect(len(times) == len(series) and times[0] == 0 and all(b > a for a, b in zip(times, times[1:])), "times do not rise")
    k, n = len(series) // 2, len(primitive["targets"])
    weights = array(document, data, tracks["weights"]["output"])[k * n : (k + 1) * n]
    moved = [list(p) for p in positions]
    for w, target in zip(weights, primitive["targets"]):
        for p, d in zip(moved, array(document, data, target["POSITION"])):
            for c in range(3):
                p[c] += w * d[c]
    rotation = array(document, data, tracks["rotation"]["output"])[k] if "rotation" in tracks else node["rotation"]
    place = array(document, data, tracks["translation"]["output"])[k] if "translation" in tracks else node["translation"]
    world = [[a + b for a, b in zip(turn(rotation, p), place)] for p in moved]
    if "--vtk" in sys.argv:
        read_by_vtk(folder, series, round((len(times) - 1) / times[-1]))
    off = max(min(math.dist(p, q) for q in points) for p in world[:: max(1, len(world) // 50)])
    near(off, 0.0, 2e-6 + 2 * report["error"], "glTF surface against the VTK one")
    expect(report["error"] < 1e-3 * report["largest_displacement"], f"morph targets miss {report['error']} m")

    run("export", folder / "p.h5", "--to", "gltf", "-o", folder / "p.gltf")
    text = json.loads((folder / "p.gltf").read_text())
    expect(text["buffers"][0]["uri"].startswith("data:application/octet-stream;base64,"), "the .gltf holds no data")
    # What reads glTF reads it.
    told = run("info", folder / "p.glb").stdout
    expect(str(len(positions)) in told.replace(",", "") or "vertices" in told, f"info: {told}")

    # Ghosts are the same shapes with larger weights; traces are lines.
    traced = folder / "traced.toml"
    traced.write_text('[render]\nscales = [1, 20]\ntraces = ["pendulum.tip"]\n')
    run("export", folder / "p.h5", "--to", "gltf", "--ghosts", "--traces", "--scene", traced, "-o", folder / "g.glb")
    more, data = read_glb(folder / "g.glb")
    names = [node["name"] for node in more["nodes"]]
    expect("pendulum x 20" in names and "trace of pendulum" in names, f"nodes {names}")
    line = more["meshes"][more["nodes"][names.index("trace of pendulum")]["mesh"]]["primitives"][0]
    path = array(more, data, line["attributes"]["POSITION"])
    expect(line["mode"] == 3 and len(path) == len(array(more, data, 0)), "a trace is a line through every picture")
    near(max(abs(math.dist(p, (0, 0, 0)) - math.dist(path[0], (0, 0, 0))) for p in path), 0.0, 0.02, "the tip stays on its circle")
    tracks = {
        c["target"]["node"]: array(more, data, more["animations"][0]["samplers"][c["sampler"]]["output"])
        for c in more["animations"][0]["channels"]
        if c["target"]["path"] == "weights"
    }
    solid, ghost = tracks[names.index("pendulum")], tracks[names.index("pendulum x 20")]
    near(max(abs(20 * a - b) for a, b in zip(solid, ghost)), 0.0, 1e-4, "weights of the ghost")

    run("export", folder / "p.h5", "--to", "mp4", "-o", folder / "film.mp4", "--size", "160x90")
    expect((folder / "film.mp4").stat().st_size > 1000, "no video")
    expect(not [p for p in folder.iterdir() if p.name.startswith(".")], "temporary folders are left")

    # Refusals.
    run("export", folder / "p.h5", "--to", "stl", code=2)
    run("export", folder / "none.h5", "--to", "csv", code=2)
    (folder / "mute.csv").write_text("t,arm.x,arm.y,arm.z,arm.qw,arm.qx,arm.qy,arm.qz\n0,0,0,0,1,0,0,0\n1,1,0,0,1,0,0,0\n")
    run("import", folder / "mute.csv", "-o", folder / "mute.h5")
    told = run("export", folder / "mute.h5", "--to", "csv", "-o", folder / "mute_out.csv", code=2).stderr
    expect(told == f"flexframe: {folder / 'mute.h5'}: holds no outputs\n", f"results of no scene and no outputs: {told}")
    text = (examples / "mechanisms/top.toml").read_text()
    (folder / "silent.toml").write_text(text[: text.index("[[output]]")].replace("duration = ", "duration = 0.01 #"))
    run("simulate", folder / "silent.toml", "-o", folder / "silent.h5", "--no-error-estimate")
    told = run("export", folder / "silent.h5", "--to", "csv", "-o", folder / "mute_out.csv", code=2).stderr
    expect(
        "silent.h5: holds no outputs; add [[output]] tables to " in told and "silent.toml and simulate again" in told,
        f"results without outputs: {told}",
    )
    run("export", folder / "p.h5", "--to", "gltf", "-o", folder / "p.obj", code=2)
    (folder / "file").write_text("x")
    run("export", folder / "p.h5", "--to", "vtk", "-o", folder / "file", code=1)
finish()
