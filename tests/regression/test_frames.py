"""Turned frames of bodies, beams and the ground, and what stands in their axes, against formulas and integrations of scipy."""
import pathlib

import numpy as np
from arrays import off, refused, simulate
from program import finish, source, temporary_folder
from scene_text import joint, output
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

g = np.array([0.0, -9.81, 0.0])
# As a scene writes them, and what they mean: uppercase letters are axes as they lie by then.
wall = ('{ euler = "zxz", angles = ["20 deg", 0.7, "-35 deg"] }', Rotation.from_euler("ZXZ", [np.radians(20), 0.7, np.radians(-35)]))
pin = ('{ axis = [1, 2, -1], angle = "130 deg" }', Rotation.from_rotvec(np.radians(130) * np.array([1, 2, -1]) / np.sqrt(6)))


def head(duration, more="gravity = [0, -9.81, 0]", rate=100):
    return f"[simulation]\nduration = {duration}\noutput_rate = {rate}\ntolerance = 1e-10\n{more}\n"


def rigid(name, mass, inertia, frames=""):
    frames = f"frames = {{ {frames} }}\n" if frames else ""
    return f'[[body]]\nname = "{name}"\nkind = "rigid"\nmass = {mass}\ninertia = {inertia}\n{frames}'


def vector(r, name):
    return np.stack([r[f"{name}.{a}"] for a in "xyz"], 1)


def vector_of(rotation):
    return rotation.as_rotvec().tolist()


def words(folder):
    """The ways to write a rotation mean the same, and a frame at rest shows them as its rotation."""
    R = wall[1]
    q = R.as_quat()
    matrix = "[" + ", ".join(str([round(x, 3) for x in row]) for row in R.as_matrix().tolist()) + "]"
    given = {"euler": wall[0], "vector": str(R.as_rotvec().tolist()), "quaternion": f"{{ quaternion = {[2 * q[3], *(2 * q[:3])]} }}"}
    given["matrix"] = f"{{ matrix = {matrix} }}"
    text = head(0.01) + "[ground]\nframes = { plain = [0, 1, 0], "
    text += ", ".join(f"{name} = {{ position = [1, 0, 2], rotation = {r} }}" for name, r in given.items()) + " }\n"
    text += rigid("block", 1, "[1, 1, 1]", 'here = { rotation = [0, 0, "30 deg"] }') + joint("weld", "weld", "ground.euler", "block.here")
    for name in given:
        text += output(name, "block.here", "rotation", f'relative_to = "ground.{name}"')
    text += output("block", "block", "rotation") + output("seen", "block", "position", 'relative_to = "ground.plain"')
    r = simulate(folder, text)
    for name in given:
        off(vector(r, name), 0, 2e-3 if name == "matrix" else 1e-12, f"rotation by {name}")
    off(vector(r, "block"), (R * Rotation.from_rotvec([0, 0, -np.pi / 6])).as_rotvec(), 1e-12, "a body welded by a turned frame")
    off(vector(r, "seen"), [1, -1, 2], 1e-12, "a place seen from an unturned frame")


def pendulum(folder):
    """A hinge between a turned frame of the ground or a hub and one of the rod, parent and child exchanged, against an integration."""
    m, J, p, pw = 1.3, np.diag([0.02, 0.05, 0.06]), np.array([-0.4, 0.1, 0.05]), np.array([0.2, 1.0, -0.3])
    Rw, Rp = wall[1].as_matrix(), pin[1].as_matrix()
    n, nb = Rw[:, 2], Rp[:, 2]
    about = nb @ (J + m * (p @ p * np.eye(3) - np.outer(p, p))) @ nb
    place = lambda q: -Rw @ Rotation.from_rotvec([0, 0, q]).as_matrix() @ Rp.T @ p  # of the rod's origin from the pin

    ode = lambda t, y: [y[1], n @ np.cross(place(y[0]), m * g) / about]
    times = np.linspace(0, 2, 201)
    q = solve_ivp(ode, (0, 2), [0.3, 0.5], t_eval=times, rtol=1e-11, atol=1e-12).y[0]
    body = rigid("rod", m, "[0.02, 0.05, 0.06]", f"pin = {{ position = {p.tolist()}, rotation = {pin[0]} }}")
    hub = rigid("hub", 1, "[1, 1, 1]", f"wall = {{ position = {pw.tolist()}, rotation = {wall[0]} }}") + joint(
        "fix", "weld", "ground", "hub"
    )
    start = "initial = { value = %s0.3, rate = %s0.5 }"
    ways = {
        "ground": f"[ground]\nframes = {{ wall = {{ position = {pw.tolist()}, rotation = {wall[0]} }} }}\n"
        + body
        + joint("pin", "revolute", "ground.wall", "rod.pin", start % ("", "")),
        "hub": body + hub + joint("pin", "revolute", "hub.wall", "rod.pin", start % ("", "")),
        "exchanged": body + hub + joint("pin", "revolute", "rod.pin", "hub.wall", start % ("-", "-")),
        "joint's own": body.replace(f", rotation = {pin[0]}", "")
        + joint("pin", "revolute", "rod.pin", "hub", f"rotation = {pin[0]}\n" + start % ("-", "-"))
        + rigid("hub", 1, "[1, 1, 1]")
        + joint("fix", "weld", "ground", "hub", f"position = {pw.tolist()}\nrotation = {wall[0]}"),
    }
    wanted = np.array([pw + place(a) for a in q])
    for way, text in ways.items():
        r = simulate(folder, head(2) + text + output("rod", "rod", "position") + output("v", "rod.pin", "angular_velocity"))
        off(vector(r, "rod"), wanted, 1e-7, f"pendulum by turned frames, {way}")
        off(np.cross(vector(r, "v"), n), 0, 1e-9, f"pendulum by turned frames, {way}: turns about the frame's axis")


def forces(folder):
    """Slope, contact and bushing on a turned frame of the ground; a force in the axes of a turned frame of a body."""
    slope, a, frames = "30 deg", np.radians(30), '[ground]\nframes = { slope = { position = [0, 2, 0], rotation = [0, 0, "%s"] }, '
    frames = frames % slope + f"wall = {{ rotation = {wall[0]} }} }}\n"
    text = head(1) + frames + rigid("sledge", 2, "[1, 1, 1]") + joint("rail", "prismatic", "ground.slope", "sledge", "axis = [1, 0, 0]")
    text += output("way", "rail", "value") + output("at", "sledge", "position") + output("rail", "rail", "reaction", 'frame = "parent"')
    r = simulate(folder, text)
    way = -0.5 * 9.81 * np.sin(a) * r["t"] ** 2
    off(r["way"], way, 1e-9, "slope, way")
    off(vector(r, "at"), np.outer(way, [np.cos(a), np.sin(a), 0]) + [0, 2, 0], 1e-9, "slope, place")
    off(vector(r, "rail"), [0, 2 * 9.81 * np.cos(a), 0], 1e-8, "slope, what the rail carries, in the axes of the turned frame")

    text = head(1) + frames + rigid("ball", 2, "[1, 1, 1]")
    text += joint("free", "free", "ground.slope", "ball", "initial = { value = [0, 0.1, 0, 0, 0, 0] }")
    text += '[[force]]\nname = "floor"\nkind = "contact"\non = "ball"\nfrom = "ground.slope"\nshape = "sphere"\nradius = 0.1\n'
    text += "normal = [0, 1, 0]\nstiffness = 1e6\n" + output("seen", "ball", "position", 'relative_to = "ground.slope"')
    r = simulate(folder, text)
    off(r["seen.x"], way, 1e-6, "ball on a turned plane, way")
    off(r["seen.y"], 0.1, 1e-4, "ball on a turned plane, height")

    R, K = wall[1].as_matrix(), np.array([300.0, 500.0, 900.0])
    text = (
        head(0.1, 'gravity = [0, -9.81, 0]\nstart = "static"')
        + frames
        + rigid("block", 2, "[1, 1, 1]", f"foot = {{ rotation = {wall[0]} }}")
    )
    text += (
        f'[[force]]\nname = "mount"\nkind = "bushing"\non = "block.foot"\nfrom = "ground.wall"\nstiffness = {[*K.tolist(), 50, 60, 70]}\n'
    )
    text += output("at", "block", "position") + output("turn", "block", "rotation") + output("mount", "mount", "force")
    r = simulate(folder, text)
    off(vector(r, "at"), R @ (R.T @ (2 * g) / K), 1e-7, "bushing in turned axes, deflection")
    off(vector(r, "turn"), 0, 1e-9, "bushing in turned axes, its ends are turned alike")
    off(vector(r, "mount"), -R.T @ (2 * g), 1e-6, "bushing in turned axes, its force")

    text = head(1, "") + rigid("block", 2, "[1, 1, 1]", f"jet = {{ rotation = {pin[0]} }}")
    text += '[[force]]\nkind = "force"\non = "block.jet"\ndirection = [0, 1, 0]\nvalue = 3\nframe = "body"\n' + output(
        "at", "block", "position"
    )
    r = simulate(folder, text)
    off(vector(r, "at"), np.outer(0.75 * r["t"] ** 2, pin[1].as_matrix()[:, 1]), 1e-9, "a force in the axes of a turned frame")


def beams(folder):
    """A mass welded to the turned middle of a beam; section forces keep the section's axes."""

    def scene(frame, back):
        text = head(0.05).replace("1e-10", "1e-8") + '[[body]]\nname = "beam"\nkind = "beam"\nlength = 1\nelements = 4\n'
        text += 'section = { shape = "rectangle", width = 0.02, height = 0.01 }\n'
        text += f"material = {{ density = 2700, youngs_modulus = 70e9 }}\nframes = {{ middle = {frame} }}\n"
        text += joint("clamp", "weld", "ground", "beam", "rotation = [0.3, 0.2, 0.1]")
        text += rigid("mass", 0.5, "[0.001, 0.002, 0.003]", "side = [0, 0.1, 0.05]") + joint("weld", "weld", "beam.middle", "mass", back)
        for name, quantity in (("cut", "section_force"), ("u", "displacement"), ("s", "stress")):
            text += output(name, "beam.middle", quantity)
        return text + output("side", "mass.side", "position") + output("turn", "beam.middle", "rotation")

    plain = simulate(folder, scene("0.5", ""))
    back = f"rotation = {(-pin[1].as_rotvec()).tolist()}"
    turned = simulate(folder, scene(f"{{ at = 0.5, rotation = {pin[0]} }}", back))
    for column, values in plain.items():
        if not column.startswith("turn"):
            off(turned[column], values, 1e-6 * np.max(np.abs(values)) + 1e-12, f"beam with a turned frame, {column}")
    wanted = (Rotation.from_rotvec(vector(plain, "turn")) * pin[1]).as_matrix()
    off(Rotation.from_rotvec(vector(turned, "turn")).as_matrix(), wanted, 1e-6, "beam with a turned frame, its rotation")


def nodes(folder):
    """Turned nodes of a body of a file, the world turned as well: a hinge at one end, a mass and a force at the other."""
    W, P, Q = wall[1], pin[1], Rotation.from_euler("xyz", [0.4, -1.1, 2.0])
    ends = ("root", "tip")

    def scene(turned):
        world = W if turned else Rotation.identity()
        text = head(0.1, f"gravity = {world.apply(g).tolist()}")
        text += f"[ground]\nframes = {{ wall = {{ rotation = {vector_of(world * P if turned else world)} }} }}\n"
        text += f'[[body]]\nname = "rod"\nkind = "modal"\nfile = "{(source / "assets/beam/beam.sid").as_posix()}"\n'
        if turned:
            text += f'frames = {{ "{ends[0]}" = {{ rotation = {vector_of(P)} }}, "{ends[1]}" = {{ rotation = {vector_of(Q)} }} }}\n'
        axis = (P.inv().apply([0, 0, 1]) if turned else np.array([0, 0, 1])).tolist()
        text += joint("hinge", "revolute", "ground.wall", f"rod.{ends[0]}", f"axis = {axis}")
        text += rigid("mass", 0.5, "[0.001, 0.002, 0.003]", "side = [0, 0.1, 0.05]")
        text += joint("weld", "weld", f"rod.{ends[1]}", "mass", "" if turned else f"rotation = {vector_of(Q)}")
        along = Q.inv().apply([0, 1, 0]) if turned else np.array([0, 1, 0])
        text += f'[[force]]\nkind = "force"\non = "rod.{ends[1]}"\nframe = "body"\ndirection = {along.tolist()}\nvalue = 3\n'
        text += output("seen", f"rod.{ends[0]}", "position", f'relative_to = "rod.{ends[1]}"')
        text += output("turn", f"rod.{ends[1]}", "rotation") + output("hold", "hinge", "reaction", 'frame = "child"')
        return text + output("side", "mass.side", "position") + output("angle", "hinge", "value") + output("q", "rod", "q")

    plain, turned = simulate(folder, scene(False)), simulate(folder, scene(True))
    off(turned["angle"], plain["angle"], 1e-7, "turned nodes: the hinge")
    q, same = (np.stack([r[f"q.{k + 1}"] for k in range(18)]) for r in (plain, turned))
    off(same, q, 1e-6 * np.abs(q).max(), "turned nodes: elastic coordinates")
    off(vector(turned, "side"), W.apply(vector(plain, "side")), 1e-6, "turned nodes: the mass")
    off(vector(turned, "seen"), Q.inv().apply(vector(plain, "seen")), 1e-6, "turned nodes: a place seen from one")
    wanted = (W * Rotation.from_rotvec(vector(plain, "turn")) * Q).as_matrix()
    off(Rotation.from_rotvec(vector(turned, "turn")).as_matrix(), wanted, 1e-6, "turned nodes: the rotation of one")
    held = P.inv().apply(vector(plain, "hold"))
    off(vector(turned, "hold"), held, 1e-5 * np.abs(held).max(), "turned nodes: the reaction in the axes of one")


def hooke(folder):
    """A universal joint between shafts along x that stand at 35 degrees: tan(out) = tan(in) / cos(35 deg)."""
    bend, cross = np.radians(35), 'rotation = [0, "90 deg", 0]'
    text = head(1, "") + '[ground]\nframes = { bearing = { position = [0.3, 0, 0], rotation = [0, 0, "35 deg"] } }\n'
    text += rigid("in", 1, "[0.01, 0.01, 0.01]", f"end = {{ position = [0.3, 0, 0], {cross} }}")
    text += rigid("out", 1, "[0.01, 0.01, 0.01]", f"start = {{ {cross} }}, end = [0.4, 0, 0]")
    text += joint("motor", "revolute", "ground", "in", 'axis = [1, 0, 0]\nmotion = "2*t"')
    text += joint("cross", "universal", "in.end", "out.start", 'axis = [0, 1, 0]\ninitial = { guess = [0, "35 deg"] }')
    text += joint("bearing", "point-on-line", "ground.bearing", "out.end", "axis = [1, 0, 0]")
    r = simulate(folder, text + output("turn", "out", "rotation", 'relative_to = "ground.bearing"'))
    wanted = np.unwrap(np.arctan2(np.sin(2 * r["t"]), np.cos(2 * r["t"]) * np.cos(bend)))
    off(r["turn.x"], wanted, 1e-7, "universal joint of shafts along x")
    off(np.hypot(r["turn.y"], r["turn.z"]), 0, 1e-7, "universal joint of shafts along x, the second stays in its bearing")


def wrong(folder):
    frames = head(1) + '[[body]]\nname = "b"\nkind = "rigid"\nmass = 1\nframes = { pin = %s }\n'
    cases = [
        ("{ place = [0, 0, 1] }", ["scene.toml:10", "frames.pin", "frames.pin.place", "position", "rotation"]),
        ("{ position = [0, 0] }", ["scene.toml:10", "position"]),
        ('{ rotation = "30 deg" }', ["scene.toml:10", "frames.pin.rotation", "must be a rotation", "euler"]),
        ("{ rotation = [0, 1] }", ["scene.toml:10", "rotation"]),
        ("{ rotation = { quaternion = [0, 0, 0, 0] } }", ["quaternion", "zero"]),
        ("{ rotation = { quaternion = [1, 0, 0] } }", ["scene.toml:10", "quaternion", "4"]),
        ("{ rotation = { matrix = [[1, 0, 0], [0, 1, 0], [0, 0, -1]] } }", ["scene.toml:10", "matrix", "reflection"]),
        ("{ rotation = { matrix = [[1, 0, 0], [0, 2, 0], [0, 0, 1]] } }", ["scene.toml:10", "matrix", "unit vectors"]),
        ("{ rotation = { matrix = [[1, 0], [0, 1]] } }", ["scene.toml:10", "matrix", "3 rows of 3 numbers"]),
        ('{ rotation = { euler = "xxz", angles = [1, 2, 3] } }', ["scene.toml:10", "euler"]),
    ]
    refused(folder, lambda case: frames % case, cases)
    still = frames % "[0, 0, 1]" + output("o", "ground", "position", 'relative_to = "b.pin"')
    refused(folder, lambda case: still, [("of the ground", ["key 'of'", "stands still", "relative_to"])])
    beam = head(1) + '[[body]]\nname = "b"\nkind = "beam"\nlength = 1\nsection = { shape = "circle", diameter = 0.1 }\n'
    beam += "material = { density = 1, youngs_modulus = 1 }\nframes = { middle = %s }\n"
    cases = [("{ rotation = [0, 0, 1] }", ["scene.toml:12", "at"]), ("{ at = 2, rotation = [0, 0, 1] }", ["scene.toml:12", "x/length"])]
    refused(folder, lambda case: beam % case, cases)
    modal = head(1) + f'[[body]]\nname = "b"\nkind = "modal"\nfile = "{(source / "assets/beam/beam.sid").as_posix()}"\nframes = %s\n'
    modal += joint("weld", "weld", "ground", "b")
    cases = [
        ('{ "node[99]" = { rotation = [0, 0, 1] } }', ["scene.toml:6", "'frames' turns", "node[99]", "it has"]),
        ('{ "node[1]" = { position = [0, 0, 1] } }', ["scene.toml:10", "frames.node[1]", "must say the rotation"]),
        ('{ "node[1]" = { at = 1, rotation = [0, 0, 1] } }', ["scene.toml:10", "rotation", "allowed"]),
        ('{ "node[1]" = [0, 0, 1] }', ["scene.toml:10", "node[1]", "table"]),
    ]
    refused(folder, lambda case: modal % case, cases)


with temporary_folder() as name:
    folder = pathlib.Path(name)
    words(folder)
    pendulum(folder)
    forces(folder)
    beams(folder)
    nodes(folder)
    hooke(folder)
    wrong(folder)
finish()
