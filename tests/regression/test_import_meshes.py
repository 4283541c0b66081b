"""flexframe import of finite element results: CalculiX and VTK, against files that these programs wrote."""

import json
import re

import h5py
import numpy as np

from motions import body, data, volume
from program import expect, near, run, run_parts


def calculix(folder):
    """Displacements against what ccx prints, stress against the components in the file, skins against the volumes of the elements."""
    done = run("import", data / "solids.frd", "-o", folder / "s.h5", "--length-unit", "mm", "--stress-unit", "MPa", "--json")
    expect(json.loads(done.stdout)["kind"] == "CalculiX .frd" and json.loads(done.stdout)["notes"] == [], done.stdout)
    _, _, group = body(folder / "s.h5", "solids")
    names = [int(n) for n in group["node_names"][:]]
    told = json.loads(run("info", data / "solids.frd", "--json").stdout)
    expect(told["kind"] == "CalculiX .frd" and told["samples"] == 3 and told["bodies"][0]["nodes"] == len(names), f"info {told}")
    printed, times = {}, []
    for line in (data / "solids.dat").read_text().splitlines():
        words = line.split()
        if "time" in words:
            times.append(float(words[-1]))
        elif len(words) == 4:
            printed[len(times) - 1, int(words[0])] = [1e-3 * float(w) for w in words[1:]]
    with h5py.File(folder / "s.h5") as file:
        expect(len(times) == 3 and np.allclose(file["times"][:], times, rtol=1e-6), f"times {times}")
    u = group["displacement"][:]
    wanted = np.array([[printed[i, n] for n in names] for i in range(len(times))])
    near(np.abs(u - wanted).max() / np.abs(wanted).max(), 0.0, 2e-6, "displacements against the printed ones")
    # Brick, wedge and tetrahedron, with and without nodes on their edges: 2 + 1 + 1/3, twice.
    near(volume(group), 2 * (2 + 1 + 1 / 3) * 1e-9, 1e-18, "volume within the skin")
    stress, step = {}, -1
    for line in (data / "solids.frd").read_text().splitlines():
        if line.startswith(" -4"):
            inside = line.split()[1] == "STRESS"
            step += inside
        elif step >= 0 and inside and line.startswith(" -1"):
            stress[step, int(line[3:13])] = [float(line[13 + 12 * k : 25 + 12 * k]) for k in range(6)]
    s = np.array([[stress[i, n] for n in names] for i in range(len(times))]) * 1e6
    tensor = s[..., [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(*s.shape[:2], 3, 3)
    deviator = tensor - np.trace(tensor, axis1=2, axis2=3)[..., None, None] * np.eye(3) / 3
    mises = np.sqrt(1.5 * (deviator**2).sum(axis=(2, 3)))
    near(np.abs(group["node_von_mises"][:] - mises).max() / mises.max(), 0.0, 1e-12, "von Mises stress")
    run("render", folder / "s.h5", "-o", folder / "s", "--color-by", "stress", "--size", "160x90", "--frames", "0:2", "--no-video")
    # The stress goes on to ParaView as it came.
    run("export", folder / "s.h5", "--to", "vtk", "-o", folder / "v")
    surface = folder / "v" / sorted(p.name for p in (folder / "v").glob("*.vtp"))[-1]
    text = surface.read_bytes()
    offset = int(re.search(rb'Name="stress" NumberOfComponents="1" format="appended" offset="(\d+)"', text)[1])
    at = text.index(b"_", text.index(b"<AppendedData")) + 1 + offset
    stress = np.frombuffer(text, "<f4", len(names), at + 8)
    near(np.abs(stress / mises[-1] - 1).max(), 0.0, 1e-6, "stress in the exported surface")
    # Damage is told with its line.
    whole = (data / "solids.frd").read_text()
    for text, word in (
        (whole[: len(whole) // 2], "solids.frd"),
        (whole.replace(" -4  DISP", " -4  TEMP"), "no displacements"),
        (whole.replace("    1C", "    7C", 1), "solids.frd:1: is no CalculiX result"),
        (whole.replace(" 2.00000E+00", " 2.00000x+00", 1), "a coordinate"),
        ("", "solids.frd"),
    ):
        (folder / "solids.frd").write_text(text)
        done = run("import", folder / "solids.frd", "-o", folder / "bad.h5", code=2)
        expect(word in done.stderr and not (folder / "bad.h5").exists(), f"damaged: {done.stderr}")


def check_grid(group, times, what):
    """The motion that make_vtk.py writes: displacement 0.01 t (x y, z, x^2), stress t (1 + x) with shear 2 t and 3 t."""
    x, y, z = group["node_origin"][:].T
    u = 0.01 * times[:, None, None] * np.stack([x * y, z, x * x], axis=1)
    near(np.abs(group["displacement"][:] - u).max(), 0.0, 1e-12, f"{what}: displacement")
    mises = times[:, None] * np.sqrt((1 + x) ** 2 + 3 * (2**2 + 3**2))
    near(np.abs(group["node_von_mises"][:] / np.maximum(mises, 1e-300) - 1)[times > 0].max(), 0.0, 1e-6, f"{what}: stress")
    # Bricks, wedges, tetrahedra and pyramids, linear and quadratic: 2 + 1 + 1/3 + 2/3, twice.
    near(volume(group), 8.0, 1e-9, f"{what}: volume within the skin")


def vtk(folder):
    """Files of VTK in all its ways to write numbers, and VTKHDF by its documented layout."""
    told = json.loads(run("import", data / "grid.pvd", "-o", folder / "g.h5", "--length-unit", "m", "--stress-unit", "Pa", "--json").stdout)
    expect(told["bodies"][0]["name"] == "grid" and told["notes"] == ["1 cells without a surface (points, lines) are left out"], f"{told}")
    times = 0.5 * np.arange(5)
    _, _, group = body(folder / "g.h5", "grid")
    check_grid(group, times, "VTK series")
    for name in ("ascii", "binary", "packed", "raw", "appended"):
        run("import", data / f"grid_{name}.vtu", "-o", folder / "one.h5")
    run("import", data / "moved_0.vtp", data / "moved_1.vtp", "--step", "0.1", "-o", folder / "v.h5", "--length-unit", "mm")
    _, _, moved = body(folder / "v.h5", "moved_0")
    near(np.abs(moved["displacement"][1] - [1e-4, 2e-4, 0.0]).max(), 0.0, 1e-10, "points that move")

    # VTKHDF: the same grid, its points and cells once, point data of every step behind each other.
    p, q = group["surface/points"][:], group["node_origin"][:]
    expect(np.array_equal(p, q), "the corners of the surface are the nodes")
    corners = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [0, 0, 1], [2, 0, 1], [2, 1, 1], [0, 1, 1]], float)
    points = np.vstack([corners + [0, 3 * k, 0] for k in range(4)])
    cells = np.arange(32)
    x, y, z = points.T
    u = np.stack([0.01 * t * np.stack([x * y, z, x * x], axis=1) for t in times])
    stress = np.concatenate([t * (1 + x) for t in times])

    def vtkhdf(path, temporal=True, **changes):
        with h5py.File(path, "w") as file:
            root = file.create_group("VTKHDF")
            root.attrs["Version"] = [2, 0]
            root.attrs.create("Type", np.bytes_(changes.get("type", "UnstructuredGrid")))
            # Two parts of two bricks each.
            root["NumberOfPoints"], root["NumberOfCells"], root["NumberOfConnectivityIds"] = [16, 16], [2, 2], [16, 16]
            root["Points"], root["Connectivity"] = points, np.tile(np.arange(16), 2) + changes.get("shift", 0)
            root["Offsets"], root["Types"] = [0, 8, 16, 0, 8, 16], np.full(4, 12, np.uint8)
            root["PointData/displacement"] = np.concatenate(u) if temporal else u[-1]
            root["PointData/mises"] = stress if temporal else stress[-32:]
            if temporal:
                steps = root.create_group("Steps")
                steps.attrs["NSteps"], steps["Values"] = 5, times
                for name in ("PartOffsets", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets"):
                    steps[name] = np.zeros(5, int)
                steps["NumberOfParts"] = np.full(5, 2)
                for name in ("displacement", "mises"):
                    steps[f"PointDataOffsets/{name}"] = 32 * np.arange(5)

    for temporal in (True, False):
        vtkhdf(folder / "h.vtkhdf", temporal)
        run("import", folder / "h.vtkhdf", "-o", folder / "h.h5")
        _, _, hdf = body(folder / "h.h5", "h")
        near(np.abs(hdf["displacement"][:] - (u if temporal else u[-1:])).max(), 0.0, 1e-15, f"VTKHDF, temporal {temporal}")
        near(volume(hdf), 8.0, 1e-12, "VTKHDF: volume within the skin")
    # What is damaged, and what does not move.
    whole = (data / "grid_ascii.vtu").read_text()
    for text, word in (
        (whole[: len(whole) // 2], "no whole XML file"),
        (whole.replace('"displacement"', '"velocity"'), "nothing moves"),
        (whole.replace("UnstructuredGrid", "ImageData"), "ImageData"),
        ("solid", "bad.vtu"),
    ):
        (folder / "bad.vtu").write_text(text)
        done = run("import", folder / "bad.vtu", "-o", folder / "bad.h5", code=2)
        expect(word in done.stderr and "bad.vtu" in done.stderr, f"damaged: {done.stderr}")
    raw = (data / "grid_raw.vtu").read_bytes()
    (folder / "bad.vtu").write_bytes(raw[: len(raw) * 2 // 3])
    run("import", folder / "bad.vtu", "-o", folder / "bad.h5", code=2)
    for changes, word in (({"type": "ImageData"}, "ImageData"), ({"shift": 40}, "names point")):
        vtkhdf(folder / "bad.vtkhdf", **changes)
        done = run("import", folder / "bad.vtkhdf", "-o", folder / "bad.h5", code=2)
        expect(word in done.stderr, f"{changes}: {done.stderr}")
    expect(not (folder / "bad.h5").exists(), "a file is left")


run_parts(calculix, vtk)
