"""flexframe import of tables: orientations against scipy's Rotation, motions against what the files were made of."""

import json

import h5py
import numpy as np
from scipy.spatial.transform import Rotation

from motions import body, check_body, off_by, places, rng, t, turns, write_table
from program import expect, near, run, run_parts


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
    # What spreadsheets save: the mark of UTF-8, UTF-16 either way round, Windows' and old line ends.
    text = (folder / "names.csv").read_text()
    for what, content in (
        ("mark of UTF-8", b"\xef\xbb\xbf" + text.encode()),
        ("UTF-16, small end first", b"\xff\xfe" + text.encode("utf-16-le")),
        ("UTF-16, big end first", b"\xfe\xff" + text.encode("utf-16-be")),
        ("Windows", text.replace("\n", "\r\n").encode()),
        ("carriage returns", text.replace("\n", "\r").encode()),
    ):
        (folder / "saved.csv").write_bytes(content)
        run("import", folder / "saved.csv", "-o", folder / "saved.h5")
        check_body(folder / "saved.h5", "two", places, turns, what, 1e-12)
    # Names of robots' frames.
    (folder / "slash.csv").write_text(text.replace("two.", "arm/two."))
    done = run("import", folder / "slash.csv", "-o", folder / "slash.h5")
    expect("'arm/two' is called 'arm.two'" in done.stdout, done.stdout)
    check_body(folder / "slash.h5", "arm.two", places, turns, "a name with a slash", 1e-12)


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
    head = "t,a.x,a.y,a.z,a.qw,a.qx,a.qy,a.qz\n"
    refused(["w.csv:2", "'NA' is no number"], text=head + "0,NA,1,2,1,0,0,0\n1,1,2,3,1,0,0,0\n")
    refused(["two columns are named 'a.x'"], text="t,a.x,a.y,a.z,a.x\n0,1,2,3,4\n1,1,2,3,4\n")
    refused(["'a.qy'", "'a.qz' is missing"], text="t,a.x,a.y,a.z,a.qw,a.qx,a.qy\n0,1,2,3,1,0,0\n1,1,2,3,1,0,0\n")
    refused(["w.csv:1", "decimal commas", "semicolons"], text="t,a.x,a.y,a.z\n0,0,1,5,2,5,3,5\n1,0,1,5,2,5,3,5\n")
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


run_parts(by_names, conventions, nodes_and_points, wrong_tables)
