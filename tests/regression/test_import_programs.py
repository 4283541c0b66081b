"""flexframe import of simulators: Modelica, MBDyn, EXUDYN, Chrono, robots, NumPy, and one slider-crank from three sources."""

import json
import struct

import h5py
import numpy as np
import scipy.io
from scipy.spatial.transform import Rotation

from motions import body, check_body, data, off_by, places, rng, t, turns, write_table
from program import examples, expect, near, run, run_parts


def modelica_file(path, variables, parameters, normal=False, times=t):
    """A result in the layout of Dymola and OpenModelica (version 1.1): name -> (values, description)."""
    series = {"Time": (times, "Time [s]")} | variables
    names = list(series) + list(parameters)
    texts = [series[n][1] for n in series] + [parameters[n][1] for n in parameters]
    info, columns = [], []
    for name, (values, _) in series.items():
        if isinstance(values, str):  # an alias, negated by a minus
            column = info[names.index(values.lstrip("-"))][1]
            info.append([2, -column if values[0] == "-" else column, 0, -1])
            continue
        columns.append(values)
        info.append([0 if name == "Time" else 2, len(columns), 0, -1])
    info += [[1, k + 2, 0, 0] for k in range(len(parameters))]
    data_1 = np.array([[times[0], *(v for v, _ in parameters.values())], [times[-1], *(v for v, _ in parameters.values())]])
    data_2 = np.stack(columns, 1)

    def letters(words, transposed):
        width = max(map(len, words))
        rows = np.array([list(w.ljust(width)) for w in words])
        return np.array(["".join(row) for row in (rows.T if transposed else rows)])

    turn = (lambda a: a) if normal else (lambda a: a.T)
    content = {
        "Aclass": letters(["Atrajectory", "1.1", "", "binNormal" if normal else "binTrans"], False),
        "name": letters(names, not normal),
        "description": letters(texts, not normal),
        "dataInfo": turn(np.array(info, np.int32)),
        "data_1": turn(data_1),
        "data_2": turn(data_2),
    }
    scipy.io.savemat(path, content, format="4")


def modelica(folder):
    """MultiBody frames by the mass of their component, aliases and parameters; both ways round of the matrices; what is no such result."""
    T = turns.inv().as_matrix()
    variables = {}
    for name in ("arm", "arm.body"):
        variables |= {f"{name}.frame_a.r_0[{k + 1}]": (places[:, k], "Position vector [m]") for k in range(3)}
        variables |= {f"{name}.frame_a.R.T[{i + 1},{j + 1}]": (T[:, i, j], "Transformation matrix") for i in range(3) for j in range(3)}
    variables |= {"rev.phi": (9 * t, "Angle [rad|deg]"), "rev.flange.phi": ("-rev.phi", "Angle [deg]"), "g": (0 * t, "no body")}
    variables |= {f"world.frame_b.r_0[{k + 1}]": (0 * t, "[m]") for k in range(3)}
    parameters = {"arm.m": (2.5, "Mass [kg]"), "arm.body.m": (2.5, "Mass [kg]"), "L": (0.3, "Length [m]")}
    for normal in (False, True):
        modelica_file(folder / "m.mat", variables, parameters, normal)
        done = run("import", folder / "m.mat", "-o", folder / "m.h5", "--json")
        told = json.loads(done.stdout)
        expect(told["kind"] == "Modelica result" and [b["name"] for b in told["bodies"]] == ["arm"], f"{told}")
        columns = {c["column"]: c for c in json.loads(run("info", folder / "m.mat", "--json").stdout)["outputs"]}
        expect(columns["L"]["range"] == [0.3, 0.3] and columns["rev.phi"]["unit"] == "rad" and len(columns) == 33, f"info {len(columns)}")
        check_body(folder / "m.h5", "arm", places, turns, f"Modelica frame, {'binNormal' if normal else 'binTrans'}")
        with h5py.File(folder / "m.h5") as file:
            names = [c.decode() for c in file["outputs/columns"][:]]
            values = file["outputs/values"][:]
            expect(np.allclose(values[:, names.index("rev.phi")], 9 * t, atol=0), "a variable")
            expect(np.allclose(values[:, names.index("rev.flange.phi")], -9 * t, atol=0), "a negated alias")
            expect(np.allclose(values[:, names.index("L")], 0.3, atol=0), "a parameter")
            expect(file["outputs/units"][names.index("rev.phi")] == b"rad", "the unit of a variable")
    # Dymola writes blanks in an index, OpenModelica none; either is understood in a mapping file.
    spaced = {name.replace(",", ", "): v for name, v in variables.items()}
    modelica_file(folder / "d.mat", spaced, parameters)
    run("import", folder / "d.mat", "-o", folder / "d.h5")
    check_body(folder / "d.h5", "arm", places, turns, "Modelica frame, blanks in the index")
    named = 'outputs = ["arm.frame_a.R.T[1, 2]", "arm.frame_a.R.T[2,1]"]\n'
    (folder / "d.toml").write_text(named + '[[body]]\nname = "arm"\nframe = "arm.frame_a"\n')
    run("import", folder / "d.mat", "--map", folder / "d.toml", "-o", folder / "d.h5")
    check_body(folder / "d.h5", "arm", places, turns, "frame of a mapping file, blanks in the index")
    with h5py.File(folder / "d.h5") as file:
        values = file["outputs/values"][:]
        expect(np.array_equal(values, np.stack([T[:, 0, 1], T[:, 1, 0]], 1)), "outputs named with and without blanks")
    (folder / "m.toml").write_text(
        '[[body]]\nname = "shaft"\nposition = [0, 0, "L"]\nangle = "rev.phi"\naxis = [0, 1, 0]\n'
        '[[body]]\nname = "arm"\nframe = "arm.frame_a"\n'
    )
    run("import", folder / "m.mat", "--map", folder / "m.toml", "-o", folder / "m.h5")
    check_body(folder / "m.h5", "arm", places, turns, "frame of a mapping file")
    check_body(folder / "m.h5", "shaft", [0, 0, 0.3], Rotation.from_rotvec(np.outer(9 * t, [0, 1, 0])), "angle and parameter")
    whole = (folder / "m.mat").read_bytes()
    for damage, words in ((whole[: len(whole) // 2], []), (b"MATLAB 5.0 MAT-file" + bytes(200), []), (b"", [])):
        (folder / "bad.mat").write_bytes(damage)
        done = run("import", folder / "bad.mat", "-o", folder / "bad.h5", code=2)
        expect("bad.mat" in done.stderr and not (folder / "bad.h5").exists(), f"damaged: {done.stderr}")
    scipy.io.savemat(folder / "bad.mat", {"x": np.eye(3)})
    done = run("import", folder / "bad.mat", "-o", folder / "bad.h5", code=2)
    expect("no Modelica result" in done.stderr and "Aclass" in done.stderr, f"another MAT file: {done.stderr}")
    modelica_file(folder / "bad.mat", {k: v for k, v in variables.items() if "R.T" not in k}, parameters)
    done = run("import", folder / "bad.mat", "-o", folder / "bad.h5", code=2)
    expect("no component has a mass" in done.stderr, f"no body: {done.stderr}")


def slider_crank(folder):
    """One and the same slider-crank from three sources: ours, a Modelica result and a CSV table. Equal pictures by `compare`."""
    words = ["--size", "320x180", "--frames", "10:14", "--no-video"]
    run(
        "simulate",
        examples / "slider_crank.toml",
        "-o",
        folder / "ours.h5",
        "--set",
        "simulation.duration=0.4",
        "--no-error-estimate",
        "--no-effect-check",
    )
    run("render", folder / "ours.h5", "-o", folder / "ours", *words)
    with h5py.File(folder / "ours.h5") as file:
        times = file["times"][:]
        bodies = {
            name: {
                k: group[k][:] for k in group if k in ("position", "orientation", "node_origin", "node_names", "displacement", "rotation")
            }
            for name, group in file["bodies"].items()
        }
        names, units = ([c.decode() for c in file[f"outputs/{k}"][:]] for k in ("columns", "units"))
        outputs = dict(zip(names, file["outputs/values"][:].T))

    # Modelica: matrices from world to body; displacements of the nodes as arrays.
    variables, lines = {}, []
    for name, b in bodies.items():
        T = Rotation.from_quat(np.roll(b["orientation"], -1, axis=1)).inv().as_matrix()
        frame = f"crankshaft.{name}.frame_a"
        variables |= {f"{frame}.r_0[{k + 1}]": (b["position"][:, k], "[m]") for k in range(3)}
        variables |= {f"{frame}.R.T[{i + 1},{j + 1}]": (T[:, i, j], "") for i in range(3) for j in range(3)}
        lines.append(f'[[body]]\nname = "{name}"\nframe = "{frame}"\nnode = [')
        for n, origin in enumerate(b.get("node_origin", [])):
            for what in ("displacement", "rotation"):
                variables |= {f"{name}.{what}[{n + 1},{k + 1}]": (b[what][:, n, k], "[m]" if what[0] == "d" else "[rad]") for k in range(3)}
            three = {what: [f"{name}.{what}[{n + 1},{k + 1}]" for k in range(3)] for what in ("displacement", "rotation")}
            lines.append(
                f'{{ name = "{b["node_names"][n].decode()}", origin = {origin.tolist()}, '
                f'displacement = {three["displacement"]}, rotation_vector = {three["rotation"]} }},'
            )
        lines.append("]")
    variables |= {name: (values, f"[{unit}]") for unit, (name, values) in zip(units, outputs.items())}
    modelica_file(folder / "sc.mat", variables, {"J": (0.0, "Inertia [kg.m2]")}, times=times)
    (folder / "sc.toml").write_text(f"outputs = {list(outputs)}\n" + "\n".join(lines))
    run("import", folder / "sc.mat", "--map", folder / "sc.toml", "--scene", examples / "slider_crank.toml", "-o", folder / "modelica.h5")

    # A table as Adams writes one: mm, degrees, ms; angles of Cardan; the nodes by their places in the world.
    columns, lines = {"Time": 1e3 * times}, ['units = { length = "mm", angle = "deg", time = "ms" }', f"outputs = {list(outputs)}"]
    for name, b in bodies.items():
        turn = Rotation.from_quat(np.roll(b["orientation"], -1, axis=1))
        columns |= {f"{name}.{a}": 1e3 * b["position"][:, k] for k, a in enumerate("XYZ")}
        columns |= {f"{name}.{a}": v for a, v in zip(("AX", "AY", "AZ"), turn.as_euler("XYZ", degrees=True).T)}
        lines.append(
            f'[[body]]\nname = "{name}"\nposition = {[f"{name}.{a}" for a in "XYZ"]}\n'
            f'euler = {[f"{name}.A{a}" for a in "XYZ"]}\nsequence = "xyz"\nnode = ['
        )
        for n, origin in enumerate(b.get("node_origin", [])):
            node = f"{name}.{n}"
            where = b["position"] + turn.apply(origin + b["displacement"][:, n])
            q = (turn * Rotation.from_rotvec(b["rotation"][:, n])).as_quat()
            columns |= {f"{node}.{a}": 1e3 * where[:, k] for k, a in enumerate("xyz")} | {f"{node}.q{k}": q[:, k] for k in range(4)}
            quaternion = [f"{node}.q{k}" for k in range(4)]
            lines.append(
                f'{{ name = "{b["node_names"][n].decode()}", origin = {origin.tolist()}, '
                f'position = "{node}", quaternion = {quaternion}, order = "xyzw" }},'
            )
        lines.append("]")
    write_table(folder / "sc.csv", columns | {f"{n} [{unit}]": v for unit, (n, v) in zip(units, outputs.items())})
    (folder / "sc.toml").write_text("\n".join(lines))
    run("import", folder / "sc.csv", "--map", folder / "sc.toml", "--scene", examples / "slider_crank.toml", "-o", folder / "table.h5")
    for name in ("modelica", "table"):
        run("render", folder / f"{name}.h5", "-o", folder / name, *words)
        told = run("compare", folder / "ours/frames", folder / f"{name}/frames").stdout
        print(name, told.strip().splitlines()[-1])
    # Another motion is found out.
    run("render", folder / "table.h5", "-o", folder / "other", "--size", "320x180", "--frames", "12:16", "--no-video")
    for k in range(12, 16):
        (folder / f"other/frames/frame_{k:05d}.png").rename(folder / f"other/frames/frame_{k - 2:05d}.png")
    run("compare", folder / "ours/frames", folder / "other/frames", code=1)


def numpy_archive(folder):
    """Arrays of the documented layout: nodal and modal bodies, surfaces, either order of dimensions and bytes."""
    u, theta = 1e-3 * rng.normal(size=(len(t), 4, 3)), 1e-2 * rng.normal(size=(len(t), 4, 3))
    origin = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    q, phi = rng.normal(size=(len(t), 2)), 1e-3 * rng.normal(size=(4, 3, 2))
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32)
    arrays = {"times": t, "a.position": places.astype(">f8"), "a.orientation": np.roll(turns.as_quat(), 1, axis=1), "a.node_origin": origin}
    arrays |= {"a.displacement": np.asfortranarray(u), "a.rotation": theta, "a.triangles": faces, "force [N]": 5 * t}
    arrays |= {"b.position": places, "b.rotation_matrix": turns.as_matrix(), "b.node_origin": origin, "b.q": q, "b.node_phi": phi}
    arrays |= {"c.position": places.astype("f4"), "c.rotation_vector": turns.as_rotvec(), "c.mesh": np.array("c.stl")}
    stl = b"facet".ljust(80) + struct.pack("<I", 4)
    for f in faces:
        stl += struct.pack("<12fH", 0, 0, 0, *(1000 * origin[f]).ravel(), 0)
    (folder / "c.stl").write_bytes(stl)
    for save in (np.savez, np.savez_compressed):
        save(folder / "n.npz", **arrays)
        run("import", folder / "n.npz", "-o", folder / "n.h5")
        check_body(folder / "n.h5", "a", places, turns, "quaternions")
        check_body(folder / "n.h5", "b", places, turns, "matrices")
        check_body(folder / "n.h5", "c", places, turns, "rotation vectors, single precision", 1e-7)
    _, _, a = body(folder / "n.h5", "a")
    expect(np.array_equal(a["displacement"][:], u) and np.array_equal(a["rotation"][:], theta), "nodal displacements")
    expect(np.array_equal(a["surface/triangles"][:], faces), "the surface")
    _, _, b = body(folder / "n.h5", "b")
    near(np.abs(b["displacement"][:] - np.einsum("ncm,tm->tnc", phi, q)).max(), 0.0, 1e-15, "modal displacements")
    # A mesh in mm, taken in with its size.
    run("import", folder / "n.npz", "-o", folder / "n.h5", "--mesh", f"c={folder / 'c.stl'}", "--mesh-unit", "mm")
    _, _, c = body(folder / "n.h5", "c")
    near(np.abs(c["surface/points"][:]).max(), 1.0, 1e-6, "size of a mesh in mm")
    run("render", folder / "n.h5", "-o", folder / "n", "--size", "160x90", "--frames", "0:1", "--no-video")
    for changes, words in (
        ({"a.position": places[:-1]}, ["'a.position'", "(25, 3)", "(26, 3)"]),
        ({"times": t[::-1]}, ["'times'", "must increase"]),
        ({"a.triangles": faces + 2}, ["'a.triangles'", "4 nodes"]),
        ({"a.displacment": u}, ["'a.displacment'", "did you mean 'displacement'"]),
        ({"a.position": np.full_like(places, np.nan)}, ["'a.position'", "not finite"]),
        ({"a.orientation": np.ones((len(t), 4))}, ["no unit quaternion"]),
        ({"x": np.array([{}])}, ["'x'"]),
    ):
        np.savez(folder / "bad.npz", **(arrays | changes))
        done = run("import", folder / "bad.npz", "-o", folder / "bad.h5", code=2)
        expect(all(w in done.stderr for w in words), f"{words} not in {done.stderr}")
    whole = bytearray((folder / "n.npz").read_bytes())
    whole[len(whole) // 3] ^= 0x55
    for damaged in (whole, whole[: len(whole) // 2], b"PK\x03\x04"):
        (folder / "bad.npz").write_bytes(damaged)
        done = run("import", folder / "bad.npz", "-o", folder / "bad.h5", code=2)
        expect("bad.npz" in done.stderr and not (folder / "bad.h5").exists(), f"damaged: {done.stderr}")


def h5py_layout(folder):
    """The example of sim/RESULTS.md, with a body's own surface: our layout written by h5py."""
    text = (data.parents[3] / "sim/RESULTS.md").read_text()
    lines = [line[4:] for line in text.splitlines() if line.startswith("    ")]
    program = "\n".join(lines[lines.index("import h5py, numpy as np") :]).replace('"mine.h5"', repr(str(folder / "mine.h5")))
    expect(0 < program.count("\n") < 20, "the example has grown")
    (folder / "rod.obj").write_bytes((examples.parent / "assets/beam/beam.obj").read_bytes())
    exec(program + "\nf.close()", {})
    told = json.loads(run("info", folder / "mine.h5", "--json").stdout)
    expect([b["name"] for b in told["bodies"]] == ["rod"] and told["bodies"][0]["nodes"] == 2, f"{told}")
    run("render", folder / "mine.h5", "-o", folder / "mine", "--size", "160x90", "--frames", "0:1", "--no-video")


def mbdyn(folder):
    """Nodes of .mov files with their .log and .out, and of NetCDF, in every way in which MBDyn writes orientations."""
    words = {"euler123": ("XYZ", 1.0), "euler313": ("ZXZ", 1.0), "euler321": ("ZYX", 1.0), "phi": None, "mat": None}
    log, rows, nodes = "", [[] for _ in t], {}
    for k, (word, sequence) in enumerate(words.items()):
        label = 10 * (k + 1)
        log += f"structural node: {label} 0. 0. 0. {word} 0. 0. 0.\n"
        if sequence:
            numbers = turns.as_euler(sequence[0], degrees=True)
        else:
            numbers = turns.as_rotvec() if word == "phi" else turns.as_matrix().reshape(-1, 9)
        nodes[label] = (word, numbers)
        for i in range(len(t)):
            rows[i].append(f"{label:8d} " + " ".join(f"{v:.16e}" for v in [*places[i], *numbers[i], *np.zeros(6)]))
    (folder / "m.mov").write_text("\n".join("\n".join(r) for r in rows) + "\n")
    (folder / "m.log").write_text(log)
    head = "# Step Time TStep NIter ResErr SolErr SolConv Out\n"
    # Every second step is written.
    steps = [f"Step {2 * i + j} {t[i] + 0.01 * j} 0.01 1 0. 0. 0 {1 - j}" for i in range(len(t)) for j in range(2)]
    (folder / "m.out").write_text(head + "\n".join(steps) + "\n")
    run("import", folder / "m.mov", "-o", folder / "m.h5")
    with h5py.File(folder / "m.h5") as file:
        near(np.abs(file["times"][:] - t).max(), 0.0, 1e-15, "times of the steps that were written")
    for label, (word, _) in nodes.items():
        check_body(folder / "m.h5", f"node {label}", places, turns, word)
    for name, version in (("m3.nc", 1), ("m3b.nc", 2)):
        with scipy.io.netcdf_file(folder / name, "w", version=version) as file:
            for d, size in (("time", None), ("Vec3", 3)):
                file.createDimension(d, size)
            file.createVariable("time", "d", ("time",))[:] = t
            for label, (word, numbers) in nodes.items():
                base = f"node.struct.{label}."
                file.createVariable(base + "X", "d", ("time", "Vec3"))[:] = places
                letter = {"phi": "Phi", "mat": "R"}.get(word, "E")
                shape = ("time", "Vec3", "Vec3") if word == "mat" else ("time", "Vec3")
                variable = file.createVariable(base + letter, "d", shape)
                # Columns one after the other: R11 R21 R31 R12 ...
                variable[:] = numbers.reshape(-1, 3, 3).transpose(0, 2, 1) if word == "mat" else numbers
                variable.description = f"global orientation Euler angles ({word[5:]}) (E_X, E_Y, E_Z)".encode()
        run("import", folder / name, "-o", folder / "nc.h5")
        for label, (word, _) in nodes.items():
            check_body(folder / "nc.h5", f"node {label}", places, turns, f"NetCDF {word}")
    # NetCDF 4 is HDF5; this is what its reader says of one that is none of MBDyn's.
    with h5py.File(folder / "other.nc", "w") as file:
        file["x"] = t
    done = run("import", folder / "other.nc", "-o", folder / "bad.h5", code=2)
    expect("other.nc" in done.stderr, done.stderr)
    text = (folder / "m.mov").read_text()
    told = json.loads(run("info", folder / "m.mov", "--json").stdout)
    expect(len(told["bodies"]) == len(nodes) and not any("--step" in n for n in told["simulation"]["notes"]), f"info with times: {told}")
    (folder / "m.out").write_text(head)
    told = json.loads(run("info", folder / "m.mov", "--json").stdout)
    expect(told["samples"] == len(t) and any("wants --step" in n for n in told["simulation"]["notes"]), f"info without times: {told}")
    expect("give --step" in run("import", folder / "m.mov", "-o", folder / "bad.h5", code=2).stderr, "no times")
    run("import", folder / "m.mov", "--step", "0.02", "-o", folder / "m.h5")
    for damage, word in (
        (text[: len(text) // 2 - 600], "m.mov"),
        (text.replace("e-01", "x-01", 1), "holds no line of numbers"),
        ("", "no nodes"),
    ):
        (folder / "m.mov").write_text(damage)
        done = run("import", folder / "m.mov", "--step", "0.02", "-o", folder / "bad.h5", code=2)
        expect(word in done.stderr and not (folder / "bad.h5").exists(), f"damaged: {done.stderr}")


def exudyn_and_chrono(folder):
    """EXUDYN's sensors and solution by its documented heads, and a table without names, by mapping files."""
    head = "#Exudyn generalized alpha solver sensor output file\n#measure Body number = 0\n#OutputVariableType = {}\n#\n"
    for name, kind, values in (("pos", "Position", places), ("rot", "RotationMatrix", turns.as_matrix().reshape(-1, 9))):
        rows = "".join(",".join(repr(float(v)) for v in [t[i], *values[i]]) + "\n" for i in range(len(t)))
        (folder / f"{name}.txt").write_text(head.format(kind) + rows)
    (folder / "e.toml").write_text('[[body]]\nname = "arm"\nposition = "pos"\nmatrix = "rot"\n')
    told = json.loads(
        run("import", folder / "pos.txt", folder / "rot.txt", "--map", folder / "e.toml", "-o", folder / "e.h5", "--json").stdout
    )
    expect(told["kind"] == "EXUDYN sensor", f"{told['kind']}")
    check_body(folder / "e.h5", "arm", places, turns, "EXUDYN sensors")
    # Coordinates of a rigid body: displacements from a reference, Euler parameters from theirs.
    reference = np.array([0.5, -0.25, 1.0, 1.0, 0, 0, 0])
    q = np.hstack([places, np.roll(turns.as_quat(), 1, axis=1)]) - reference
    text = "#Exudyn generalized alpha solver solution file\n#columns contain: time, ODE2 displacements, ODE2 velocities\n"
    text += "#number of written coordinates [nODE2, nVel2, nAcc2, nODE1, nVel1, nAlgebraic, nData] = [7,7,0,0,0,0,0]\n#\n"
    text += "".join(",".join(repr(float(v)) for v in [t[i], *q[i], *np.zeros(7)]) + "\n" for i in range(len(t)))
    (folder / "solution.txt").write_text(text + "#simulation finished=2026-01-01,10:00:00\n")
    sources = [f'{{ column = "q{k}", offset = {reference[k]} }}' for k in range(7)]
    (folder / "e.toml").write_text(
        f'outputs = ["v0"]\n[[body]]\nname = "arm"\nposition = [{", ".join(sources[:3])}]\nquaternion = [{", ".join(sources[3:])}]\n'
    )
    run("import", folder / "solution.txt", "--map", folder / "e.toml", "-o", folder / "e.h5")
    check_body(folder / "e.h5", "arm", places, turns, "EXUDYN solution")
    # Chrono's CSV writers write no names: time, position, quaternion e0 e1 e2 e3.
    rows = np.hstack([t[:, None], places, np.roll(turns.as_quat(), 1, axis=1)])
    (folder / "chrono.csv").write_text("".join(",".join(f"{v:.17g}" for v in row) + "\n" for row in rows))
    (folder / "c.toml").write_text('[[body]]\nname = "arm"\nposition = ["c2", "c3", "c4"]\nquaternion = ["c5", "c6", "c7", "c8"]\n')
    run("import", folder / "chrono.csv", "--map", folder / "c.toml", "-o", folder / "c.h5")
    check_body(folder / "c.h5", "arm", places, turns, "Chrono's table")


URDF = """<robot name="arm">
<material name="blue"><color rgba="0.1 0.2 0.9 1"/></material>
<link name="base"><visual><geometry><box size="0.4 0.3 0.1"/></geometry><material name="blue"/></visual></link>
<link name="upper"><visual><origin xyz="0 0 0.25" rpy="0.1 0.2 0.3"/><geometry><cylinder radius="0.05" length="0.5"/></geometry>
  </visual></link>
<link name="slide"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>
<link name="tool"><visual><geometry><mesh filename="package://arm_description/meshes/tool.stl" scale="0.001 0.001 0.001"/>
  </geometry></visual></link>
<link name="frame"/>
<joint name="lift" type="prismatic"><parent link="upper"/><child link="slide"/><origin xyz="0 0 0.5" rpy="0 0.4 0"/>
  <axis xyz="0 0 1"/></joint>
<joint name="turn" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0.1 0 0.05" rpy="0.3 -0.2 0.7"/>
  <axis xyz="0 1 1"/></joint>
<joint name="wrist" type="continuous"><parent link="slide"/><child link="tool"/><axis xyz="1 0 0"/>
  <mimic joint="turn" multiplier="-2" offset="0.1"/></joint>
<joint name="weld" type="fixed"><parent link="tool"/><child link="frame"/><origin xyz="0 0 1"/></joint>
</robot>
"""


def robot(folder):
    """A URDF robot by forward kinematics with scipy: origins, axes, a slide, a joint that follows another, shapes and their units."""
    package = folder / "arm_description"
    (package / "urdf").mkdir(parents=True)
    (package / "meshes").mkdir()
    corners = np.array([[0, 0, 0], [100, 0, 0], [0, 100, 0], [0, 0, 100]], float)
    stl = b"tool".ljust(80) + struct.pack("<I", 4)
    for f in ([0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]):
        stl += struct.pack("<12fH", 0, 0, 0, *corners[f].ravel(), 0)
    (package / "meshes/tool.stl").write_bytes(stl)
    urdf = package / "urdf/arm.urdf"
    urdf.write_text(URDF)
    angle, lift = 3 * np.sin(5 * t), 0.1 * t
    write_table(folder / "j.csv", {"time [ms]": 1e3 * t, "turn [deg]": np.degrees(angle), "lift [mm]": 1e3 * lift})
    run("import", urdf, folder / "j.csv", "-o", folder / "r.h5")
    # A robot stands along z; another axis is said, and is seen in the camera that a page has.
    for words, up in (([], [0, 0, 1]), (["--up", "x"], [1, 0, 0])):
        run("import", urdf, folder / "j.csv", "-o", folder / "up.h5", *words)
        run("export", folder / "up.h5", "--to", "html", "-o", folder / "up.html")
        page = (folder / "up.html").read_text()
        camera = json.loads(page.split('id="scene">')[1].split("</script>")[0])["camera"]
        ahead = np.subtract(camera["target"], camera["position"])
        expect(camera["up"] == up and ahead @ up < 0, f"up with {words}: {camera}")
    scene = ["--scene", examples / "pendulum.toml", "--up", "z"]
    expect("leave out --up" in run("import", urdf, folder / "j.csv", "-o", folder / "up.h5", *scene, code=2).stderr, "two words of up")
    upper = Rotation.from_euler("xyz", [0.3, -0.2, 0.7]) * Rotation.from_rotvec(np.outer(angle, np.array([0, 1, 1]) / np.sqrt(2)))
    at = np.tile([0.1, 0.0, 0.05], (len(t), 1))
    check_body(folder / "r.h5", "upper", at, upper, "a revolute joint")
    slide = upper * Rotation.from_euler("y", 0.4)
    at = at + upper.apply([0, 0, 0.5]) + slide.apply(np.outer(lift, [0, 0, 1]))
    check_body(folder / "r.h5", "slide", at, slide, "a prismatic joint")
    check_body(folder / "r.h5", "tool", at, slide * Rotation.from_rotvec(np.outer(0.1 - 2 * angle, [1, 0, 0])), "a joint that follows")
    _, _, tool = body(folder / "r.h5", "tool")
    near(np.abs(tool["surface/points"][:]).max(), 0.1, 1e-7, "a mesh in mm")
    _, _, base = body(folder / "r.h5", "base")
    near(np.abs(base["surface/colors"][0] - [0.1, 0.2, 0.9]).max(), 0.0, 1e-6, "a material's colour")
    near(np.abs(base["surface/points"][:]).max(axis=0)[0], 0.2, 1e-9, "half the length of a box")
    run("render", folder / "r.h5", "-o", folder / "r", "--size", "160x90", "--frames", "0:1", "--no-video")
    for text, words in (
        (URDF.replace('type="revolute"', 'type="ball"'), ["'turn'", "'ball'", "revolute"]),
        (URDF.replace('<parent link="upper"/>', '<parent link="lower"/>'), ["'lift'", "'lower'"]),
        (URDF.replace('radius="0.1"', 'radius="big"'), ["radius", "big"]),
        (URDF.replace("</robot>", ""), ["no whole XML file"]),
        (URDF.replace('name="turn"', 'name="spin"'), ["'turn'"]),
        ("<sdf/>", ["<robot>"]),
    ):
        urdf.write_text(text)
        done = run("import", urdf, folder / "j.csv", "-o", folder / "bad.h5", code=2)
        expect(all(w in done.stderr for w in words), f"{words} not in {done.stderr}")
    urdf.write_text(URDF.replace("tool.stl", "hammer.stl"))
    done = run("import", urdf, folder / "j.csv", "-o", folder / "r.h5")
    expect("hammer.stl" in done.stderr and "WARNING" in done.stderr, f"a missing mesh is told: {done.stderr}")


run_parts(modelica, slider_crank, numpy_archive, h5py_layout, mbdyn, exudyn_and_chrono, robot)
