"""flexframe import: results of other programs. Orientations against scipy's Rotation, motions against what the files were made of."""

import json
import pathlib
import sys

import h5py
import numpy as np
import scipy.io
from scipy.spatial.transform import Rotation

from program import examples, expect, finish, near, run, run_parts, source

data = source / "tests/regression/data/import"
rng = np.random.default_rng(7)
t = np.linspace(0.0, 0.5, 26)
# A turn that goes all round, and places.
turns = Rotation.from_rotvec(np.outer(9.0 * t, [0.36, -0.48, 0.8]) + [0.4, -0.2, 0.7])
places = np.stack([np.sin(3 * t), t**2 - 0.2, 0.1 + 0.3 * t], axis=1)


def write_table(path, columns, separator=",", number=repr, head=""):
    """columns: name -> values. Every number with all its digits."""
    rows = np.stack([np.asarray(v, float) for v in columns.values()], axis=1)
    text = head + separator.join(columns) + "\n"
    path.write_text(text + "".join(separator.join(number(float(v)) for v in row) + "\n" for row in rows))


def body(path, name):
    """Position, Rotation and the group of a body."""
    file = h5py.File(path, "r")
    group = file["bodies"][name]
    return group["position"][:], Rotation.from_quat(np.roll(group["orientation"][:], -1, axis=1)), group


def off_by(rotation, wanted):
    """Largest angle between two rotations, rad."""
    return (rotation * wanted.inv()).magnitude().max()


def check_body(path, name, position, rotation, what, tolerance=1e-9):
    p, R, _ = body(path, name)
    near(np.abs(p - position).max(), 0.0, tolerance, f"{what}: position")
    near(off_by(R, rotation), 0.0, tolerance, f"{what}: orientation")


def by_names(folder):
    """The documented CSV layout: quaternion, rotation vector, matrix; units in the header; nodes; other columns are outputs."""
    q, v, m = turns.as_quat(), turns.as_rotvec(), turns.as_matrix()
    columns = {"t": t}
    for name in ("one", "two", "three"):
        columns |= {f"{name}.x [mm]": 1e3 * places[:, 0], f"{name}.y [mm]": 1e3 * places[:, 1], f"{name}.z [mm]": 1e3 * places[:, 2]}
    columns |= {"one.qw": q[:, 3], "one.qx": q[:, 0], "one.qy": q[:, 1], "one.qz": q[:, 2]}
    columns |= {f"two.r{a} [deg]": np.degrees(v[:, k]) for k, a in enumerate("xyz")}
    columns |= {f"three.r{i + 1}{j + 1}": m[:, i, j] for i in range(3) for j in range(3)}
    u, theta = 1e-3 * rng.normal(size=(len(t), 3)), 1e-2 * rng.normal(size=(len(t), 3))
    columns |= {f"one:tip.{a}0": np.full(len(t), 0.1 * (k + 1)) for k, a in enumerate("xyz")}
    columns |= {f"one:tip.u{a}": u[:, k] for k, a in enumerate("xyz")} | {f"one:tip.r{a}": theta[:, k] for k, a in enumerate("xyz")}
    columns |= {"force [N]": 5 * t}
    write_table(folder / "names.csv", columns)
    run("import", folder / "names.csv", "-o", folder / "names.h5")
    for name in ("one", "two", "three"):
        check_body(folder / "names.h5", name, places, turns, name)
    _, _, group = body(folder / "names.h5", "one")
    expect(np.allclose(group["node_origin"][0], [0.1, 0.2, 0.3]) and np.abs(group["displacement"][:, 0] - u).max() < 1e-15, "node of 'one'")
    expect(np.abs(group["rotation"][:, 0] - theta).max() < 1e-12, "rotation of the node of 'one'")
    told = json.loads(run("info", folder / "names.h5", "--json").stdout)
    expect([o["column"] for o in told["outputs"]] == ["force"] and told["outputs"][0]["unit"] == "N", f"outputs {told['outputs']}")
    # The same by tabs, semicolons with decimal commas, blanks with Fortran's exponents.
    for separator, number in (("\t", repr), (";", lambda x: repr(x).replace(".", ",")), (" ", lambda x: f"{x:.16E}".replace("E", "D"))):
        plain = {name.replace(" ", ""): values for name, values in columns.items()}
        write_table(folder / "other.txt", plain, separator, number, head="# made by a test\n\n")
        run("import", folder / "other.txt", "-o", folder / "other.h5")
        check_body(folder / "other.h5", "two", places, turns, f"separator {separator!r}", 1e-9)


def conventions(folder):
    """Every Euler sequence about moving and fixed axes, orders of quaternions and matrices, both ways, against scipy."""
    columns, lines = {"time": 1e3 * t}, ['units = { length = "mm", angle = "deg", time = "ms" }', 'table = { time = "time" }']
    wanted = {}

    def add(name, numbers, form, words, rotation):
        numbers = np.asarray(numbers).reshape(len(t), -1)
        names = [f"{name}_{k}" for k in range(numbers.shape[1])]
        columns.update({n: numbers[:, k] for k, n in enumerate(names)})
        value = json.dumps(names) if form != "angle" else json.dumps(names[0])
        lines.append(f'[[body]]\nname = "{name}"\nposition = ["x", "-y", 3.5]\n{form} = {value}\n{words}')
        wanted[name] = rotation

    columns |= {"x": 1e3 * places[:, 0], "y": 1e3 * places[:, 1]}
    for sequence in ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz"):
        for axes, scipy_word in (("body", sequence.upper()), ("fixed", sequence)):
            angles = rng.uniform(-1.4, 1.4, (len(t), 3))
            rotation = Rotation.from_euler(scipy_word, angles)
            add(f"{sequence}_{axes}", np.degrees(angles), "euler", f'sequence = "{sequence}"\naxes = "{axes}"', rotation)
    q, m = turns.as_quat(), turns.as_matrix()
    for way, rotation in (("body to world", turns), ("world to body", turns.inv())):
        end = f'\nturns = "{way}"'
        mark = way[:1]
        add(f"wxyz_{mark}", np.roll(q, 1, axis=1), "quaternion", 'order = "wxyz"' + end, rotation)
        add(f"xyzw_{mark}", q, "quaternion", 'order = "xyzw"' + end, rotation)
        add(f"rows_{mark}", m, "matrix", 'order = "rows"' + end, rotation)
        add(f"columns_{mark}", m.transpose(0, 2, 1), "matrix", 'order = "columns"' + end, rotation)
        add(f"vector_{mark}", np.degrees(turns.as_rotvec()), "rotation_vector", end, rotation)
    about = np.array([1.0, 2.0, -2.0]) / 3
    add("angle", 400 * t, "angle", "axis = [1, 2, -2]", Rotation.from_rotvec(np.outer(np.radians(400 * t), about)))
    write_table(folder / "table.csv", columns)
    (folder / "map.toml").write_text("\n".join(lines))
    run("import", folder / "table.csv", "--map", folder / "map.toml", "-o", folder / "c.h5")
    with h5py.File(folder / "c.h5") as file:
        near(np.abs(file["times"][:] - t).max(), 0.0, 1e-12, "times in ms")
    worst = 0.0
    for name, rotation in wanted.items():
        p, R, _ = body(folder / "c.h5", name)
        worst = max(worst, off_by(R, rotation))
        expect(off_by(R, rotation) < 1e-9, f"{name}: orientation off by {off_by(R, rotation)} rad")
        expect(np.abs(p - np.stack([places[:, 0], -places[:, 1], 0 * t + 0.0035], 1)).max() < 1e-12, f"{name}: position")
    near(worst, 0.0, 1e-9, f"{len(wanted)} ways to write an orientation")


def nodes_and_points(folder):
    """Positions of another point of the body; nodes by displacement in body and world axes and by position; modes by a SID file."""
    point, origin = np.array([0.1, -0.2, 0.05]), np.array([0.3, 0.1, -0.1])
    u = 1e-2 * rng.normal(size=(len(t), 3))
    turn = Rotation.from_rotvec(0.1 * rng.normal(size=(len(t), 3)))
    com = places + turns.apply(point)
    world = turns.apply(u)
    where = places + turns.apply(origin + u)
    columns = {"t": t} | {f"c.{a}": com[:, k] for k, a in enumerate("xyz")}
    columns |= {f"c.{n}": v for n, v in zip(("qw", "qx", "qy", "qz"), np.roll(turns.as_quat(), 1, axis=1).T)}
    for name, values in (("a", u), ("b", world)):
        columns |= {f"{name}.u{a}": values[:, k] for k, a in enumerate("xyz")}
    columns |= {f"w.{a}": where[:, k] for k, a in enumerate("xyz")}
    for name, rotation in (("a", turn), ("b", turns * turn * turns.inv()), ("w", turns * turn)):
        columns |= {f"{name}.r{a}": rotation.as_rotvec()[:, k] for k, a in enumerate("xyz")}
    write_table(folder / "n.csv", columns)
    (folder / "n.toml").write_text(
        f"""[[body]]
name = "bar"
position = "c"
point = {point.tolist()}
quaternion = "c"
node = [
  {{ name = "a", origin = {origin.tolist()}, displacement = "a", rotation_vector = "a" }},
  {{ name = "b", origin = {origin.tolist()}, displacement = "b", rotation_vector = "b", axes_of = "world" }},
  {{ name = "w", origin = {origin.tolist()}, position = "w", rotation_vector = "w" }},
]
"""
    )
    run("import", folder / "n.csv", "--map", folder / "n.toml", "-o", folder / "n.h5")
    check_body(folder / "n.h5", "bar", places, turns, "position of another point")
    _, _, group = body(folder / "n.h5", "bar")
    for k, name in enumerate("abw"):
        near(np.abs(group["displacement"][:, k] - u).max(), 0.0, 1e-12, f"displacement of node {name}")
        near(np.abs(group["rotation"][:, k] - turn.as_rotvec()).max(), 0.0, 1e-9, f"rotation of node {name}")


def modelica_file(path, variables, parameters, normal=False):
    """A result in the layout of Dymola and OpenModelica (version 1.1): name -> (values, description)."""
    series = {"Time": (t, "Time [s]")} | variables
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
    data_1 = np.array([[t[0], *(v for v, _ in parameters.values())], [t[-1], *(v for v, _ in parameters.values())]])
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
        check_body(folder / "m.h5", "arm", places, turns, f"Modelica frame, {'binNormal' if normal else 'binTrans'}")
        with h5py.File(folder / "m.h5") as file:
            names = [c.decode() for c in file["outputs/columns"][:]]
            values = file["outputs/values"][:]
            expect(np.allclose(values[:, names.index("rev.phi")], 9 * t, atol=0), "a variable")
            expect(np.allclose(values[:, names.index("rev.flange.phi")], -9 * t, atol=0), "a negated alias")
            expect(np.allclose(values[:, names.index("L")], 0.3, atol=0), "a parameter")
            expect(file["outputs/units"][names.index("rev.phi")] == b"rad", "the unit of a variable")
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
    global t
    before, t = t, times
    modelica_file(folder / "sc.mat", variables, {"J": (0.0, "Inertia [kg.m2]")})
    t = before
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


def volume(group):
    """Of the body's surface, by the divergence theorem: closed and seen from outside where it is what the elements fill."""
    corners = group["surface/points"][:][group["surface/triangles"][:].astype(int)]
    return np.einsum("ti,ti->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6


def calculix(folder):
    """Displacements against what ccx prints, stress against the components in the file, skins against the volumes of the elements."""
    done = run("import", data / "solids.frd", "-o", folder / "s.h5", "--length-unit", "mm", "--stress-unit", "MPa", "--json")
    expect(json.loads(done.stdout)["kind"] == "CalculiX .frd" and json.loads(done.stdout)["notes"] == [], done.stdout)
    _, _, group = body(folder / "s.h5", "solids")
    names = [int(n) for n in group["node_names"][:]]
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


def wrong_tables(folder):
    """A sentence with place and what is needed; never a file."""
    good = {"t": t, "a.x": t, "a.y": t, "a.z": t, "a.qw": 0 * t + 1, "a.qx": 0 * t, "a.qy": 0 * t, "a.qz": 0 * t}

    def refused(words, name="w.csv", mapping=None, **changes):
        if changes:
            columns = {k: np.array(v) for k, v in good.items()} | changes.get("columns", {})
            write_table(folder / name, columns)
        if "text" in changes:
            (folder / name).write_text(changes["text"])
        more = []
        if mapping is not None:
            (folder / "w.toml").write_text(mapping)
            more = ["--map", folder / "w.toml"]
        done = run("import", folder / name, "-o", folder / "w.h5", *more, code=2)
        expect(all(w in done.stderr for w in words), f"{words} not in: {done.stderr}")
        expect(not (folder / "w.h5").exists(), f"a file is left: {words}")

    refused(["no unit quaternion", "t = 0 s", "'a'"], columns={"a.qx": 0 * t + 0.5})
    refused(["times must not fall", "row 26"], columns={"t": np.append(t[:-1], -1.0)})
    refused(["w.csv:3", "has 4 values, the first row has 8"], text="t,a.x,a.y,a.z,a.qw,a.qx,a.qy,a.qz\n0,1,2,3,1,0,0,0\n1,1,2,3\n")
    refused(["w.csv:3", "'a.z'", "'many'"], text="t,a.x,a.y,a.z\n0,1,2,3\n1,1,2,many\n")
    refused(["not finite", "'a.x'"], text="t,a.x,a.y,a.z\n0,1,2,3\n1,nan,2,3\n")
    refused(["no row of numbers"], text="t,a.x\n")
    refused(["no body is found", "NAME.x"], text="t,a,b\n0,1,2\n1,1,2\n")
    refused(["no column is named t"], text="x,a.x,a.y,a.z\n0,1,2,3\n1,1,2,3\n")
    position = 'position = ["a.x", "a.y", "a.z"]\n'
    plain = "t,a.x,a.y,a.z,f [N],w\n0,1,2,3,1,1\n1,1,2,3,1,1\n"
    for mapping, words in (
        ('[[body]]\nname = "b"\nposition = ["a.x", "a.y", "az"]', ["w.toml:3", "'az'", "did you mean 'a.z'"]),
        ('[[body]]\nname = "b"\nposition = ["a.x", "a.y", "f"]', ["'N'", "a length is needed"]),
        ('[[body]]\nname = "b"\n' + position + 'euler = ["w", "w", "w"]', ["'sequence'", "missing"]),
        ('[[body]]\nname = "b"\n' + position + 'euler = ["w", "w", "w"]\nsequence = "xxy"', ["'sequence'", "xxy"]),
        ('[[body]]\nname = "b"\n' + position + 'matrix = ["w", "w", "w", "w", "w", "w", "w", "w", "w"]', ["no rotation matrix"]),
        ('[[body]]\nname = "b"\n' + position + "matrix = [1, 0, 0, 0, 1, 0, 0, 0, -1]", ["mirrors"]),
        ('[[body]]\nname = "b"\n' + position + 'order = "wxyz"', ["'order'", "needs an orientation"]),
        ('[[body]]\nname = "b"\n' + position + 'turn = "wxyz"', ["'turn'", "unknown", "turns"]),
        ('units = { length = "kg" }\n[[body]]\nname = "b"\n' + position, ["'length'", "kg"]),
        ('outputs = ["g"]\n[[body]]\nname = "b"\n' + position, ["'g'"]),
    ):
        refused(words, text=plain, mapping=mapping)


run_parts(by_names, conventions, nodes_and_points, modelica, slider_crank, calculix, vtk, wrong_tables)
