"""Shapes of rigid bodies: mass and inertia by closed formulas (seen in the frequency of a torsion spring), placed meshes, errors."""
import json
import math
import pathlib
import tempfile

from program import expect, finish, near, run
from scene_text import joint, rigid, simulation

STIFFNESS = 1000.0


def frequency(folder, keys, axis, name="t"):
    """Moment of inertia and mass of a body on a torsion spring about an axis through its origin, from its frequency."""
    scene = folder / f"{name}.toml"
    scene.write_text(
        f"""[simulation]
duration = 0.1
[[body]]
name = "b"
kind = "rigid"
{keys}
[[joint]]
name = "j"
kind = "revolute"
parent = "ground"
child = "b"
axis = {axis}
spring = {{ stiffness = {STIFFNESS} }}
"""
    )
    report = json.loads(run("check", scene, "--json").stdout)
    omega = 2 * math.pi * report["modes"][0]["frequency"]
    return STIFFNESS / omega**2, report["bodies"][0]["mass"]


X, Y, Z = "[1, 0, 0]", "[0, 1, 0]", "[0, 0, 1]"


def formulas(folder):
    rho = 2700.0
    pi = math.pi

    def check(what, shape, mass, inertia):
        for axis, wanted in zip((X, Y, Z), inertia):
            found, weight = frequency(folder, f"density = {rho}\nshapes = [{shape}]", axis)
            near(weight, mass, 1e-6 * mass, f"{what}: mass")
            near(found, wanted, 1e-6 * wanted, f"{what}: inertia about {axis}")

    m = rho * 0.3 * 0.2 * 0.1
    check("box", '{ shape = "box", size = [0.3, 0.2, 0.1] }', m, [m / 12 * (0.04 + 0.01), m / 12 * (0.09 + 0.01), m / 12 * (0.09 + 0.04)])
    m = rho * pi * (0.1**2 - 0.04**2) * 0.5
    across = m / 12 * (3 * (0.1**2 + 0.04**2) + 0.25)
    check(
        "tube along x",
        '{ shape = "cylinder", radius = 0.1, inner_radius = 0.04, from = [-0.25, 0, 0], to = [0.25, 0, 0] }',
        m,
        [m / 2 * (0.1**2 + 0.04**2), across, across],
    )
    m = rho * 4 / 3 * pi * 0.1**3
    check(
        "ball off the origin",
        '{ shape = "sphere", radius = 0.1, position = [0, 0, 0.5] }',
        m,
        [0.4 * m * 0.01 + m * 0.25, 0.4 * m * 0.01 + m * 0.25, 0.4 * m * 0.01],
    )
    # Two half balls and a cylinder, by Steiner's theorem.
    ball, middle = rho * 4 / 3 * pi * 0.05**3, rho * pi * 0.05**2 * 0.3
    along = 0.4 * ball * 0.05**2 + 0.5 * middle * 0.05**2
    half = 83 / 320 * ball * 0.05**2 + ball * (0.15 + 3 / 8 * 0.05) ** 2
    across = half + middle / 12 * (3 * 0.05**2 + 0.3**2)
    check("capsule", '{ shape = "capsule", radius = 0.05, length = 0.3 }', ball + middle, [across, across, along])
    m = rho * pi * 0.2**2 * 0.02
    check(
        "disc turned onto y",
        '{ shape = "disc", radius = 0.2, thickness = 0.02, rotation = ["90 deg", 0, 0] }',
        m,
        [m / 12 * (3 * 0.04 + 0.0004), m / 2 * 0.04, m / 12 * (3 * 0.04 + 0.0004)],
    )


def link(folder):
    """A flat link, integrated on a fine grid."""
    length, width, thickness, hole, rho = 0.4, 0.08, 0.01, 0.03, 7850.0
    n = 1200
    step = (length + width) / n
    area = second = across = 0.0
    for i in range(n):
        z = -(length + width) / 2 + (i + 0.5) * step
        over = max(0.0, abs(z) - length / 2)
        outer = math.sqrt(max(0.0, (width / 2) ** 2 - over**2))
        inner = math.sqrt(max(0.0, (hole / 2) ** 2 - (abs(z) - length / 2) ** 2))
        area += 2 * (outer - inner) * step
        second += 2 * (outer - inner) * z * z * step
        across += 2 / 3 * (outer**3 - inner**3) * step
    m = rho * thickness * area
    ends = "frames = { a = [-0.2, 0, 0], b = [0.2, 0, 0] }"
    sizes = f"width = {width}, thickness = {thickness}, hole = {hole}"
    keys = f'density = {rho}\n{ends}\nshapes = [{{ shape = "link", from = "a", to = "b", {sizes} }}]'
    found, weight = frequency(folder, keys, Z)
    near(weight, m, 1e-4 * m, "link: mass")
    near(found, rho * thickness * (second + across), 2e-4 * found, "link: inertia about its pins' axis")
    found, _ = frequency(folder, keys, X)
    near(found, rho * thickness * across + m * thickness**2 / 12, 1e-3 * found, "link: inertia about its length")


def asked(folder):
    """A given mass spread over the shapes; several with densities of their own; products of inertia."""
    keys = 'mass = 3\ninertia = "shapes"\nshapes = [{ shape = "box", size = [0.3, 0.2, 0.1], position = [0.1, 0, 0] }]'
    found, weight = frequency(folder, keys, Z)
    near(weight, 3, 1e-12, "given mass")
    near(found, 3 / 12 * (0.09 + 0.04) + 3 * 0.01, 1e-8, "given mass: inertia")
    keys = (
        'shapes = [{ shape = "sphere", radius = 0.1, density = 1000 }, { shape = "box", size = [1, 1, 1], density = 0, color = "#cc3311" }]'
    )
    found, weight = frequency(folder, keys, X)
    near(weight, 1000 * 4 / 3 * math.pi * 1e-3, 1e-6, "what has no density weighs nothing")
    # A plate turned by 30 degrees about z has a product of inertia; about an axis turned along, its own moment.
    keys = 'density = 2700\nshapes = [{ shape = "box", size = [0.3, 0.2, 0.1], rotation = [0, 0, "30 deg"] }]'
    m = 2700 * 0.006
    found, _ = frequency(folder, keys, f"[{math.cos(math.pi / 6)}, 0.5, 0]")
    near(found, m / 12 * (0.04 + 0.01), 1e-8, "turned box about its own axis")


def placed_mesh(folder):
    """A mesh in millimetres, turned and moved: the glTF file holds where its corners come to lie."""
    (folder / "part.obj").write_text("v 0 0 0\nv 400 0 0\nv 0 100 0\nv 0 0 50\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    scene = folder / "mesh.toml"
    scene.write_text(
        simulation(0.1)
        + rigid(
            "b", mass=1, inertia=[0.1, 0.1, 0.1], mesh=dict(file="part.obj", unit="mm", position=[0, 0, 0.2], rotation=[0, 0, "90 deg"])
        )
        + joint("j", "weld", "ground", "b")
    )
    run("run", scene, "-o", folder / "out", "--size", "160x120", "--no-video", "--frames", "0:1")
    run("export", folder / "out" / "results.h5", "--to", "gltf", "-o", folder / "mesh.gltf")
    accessors = [a for a in json.loads((folder / "mesh.gltf").read_text())["accessors"] if a["type"] == "VEC3" and a.get("max")]
    corners = [a for a in accessors if abs(a["max"][1] - 0.4) < 1e-6]
    expect(corners, f"no accessor reaches y = 0.4: {accessors}")
    if corners:
        near(corners[0]["min"][0], -0.1, 1e-6, "placed mesh: smallest x")
        near(corners[0]["max"][2], 0.25, 1e-6, "placed mesh: largest z")


def wrong_unit(folder):
    """A mesh a thousand times the body is told of by check as by run; with its unit it is not."""
    scene = folder / "unit.toml"
    text = """[simulation]
duration = 0.1
[[body]]
name = "b"
kind = "rigid"
mass = 1
inertia = [0.1, 0.1, 0.1]
frames = { end = [0.4, 0, 0] }
mesh = MESH
[[joint]]
name = "j"
kind = "weld"
parent = "ground"
child = "b"
"""
    scene.write_text(text.replace("MESH", '"part.obj"'))
    for words in (("check", scene), ("run", scene, "-o", folder / "o", "--size", "160x120", "--no-video", "--frames", "0:1")):
        message = run(*words).stderr
        expect("WARNING" in message and "'b'" in message and "415 m" in message and 'unit = "mm"' in message, f"{words[0]}: {message!r}")
    scene.write_text(text.replace("MESH", '{ file = "part.obj", unit = "mm" }'))
    expect("WARNING" not in run("check", scene).stderr, "a mesh with its unit fits")


def materials(folder):
    """A material library that is not there, and textures, are told of by check as by run."""
    scene = folder / "materials.toml"
    (folder / "tex.mtl").write_text("newmtl red\nKd 0.8 0.1 0.1\nmap_Kd wood.png\n")
    for library, words in (("none.mtl", "its material library none.mtl is not there"), ("tex.mtl", "its textures are not drawn")):
        (folder / "seen.obj").write_text(f"mtllib {library}\nv 0 0 0\nv 0.4 0 0\nv 0 0.1 0\nusemtl red\nf 1 2 3\n")
        scene.write_text(simulation(0.1) + rigid("b", mass=1, inertia=[0.1, 0.1, 0.1], mesh="seen.obj") + joint("j", "weld", "ground", "b"))
        for command in (("check", scene), ("run", scene, "-o", folder / "o", "--size", "160x120", "--no-video", "--frames", "0:1")):
            said = run(*command)
            named = any(b in said.stdout for b in ("b: ", "'b': "))
            expect(named and words in said.stdout, f"{command[0]}: {words!r} is not in {said.stdout!r} {said.stderr!r}")


def errors(folder):
    scene = folder / "wrong.toml"

    def wrong(keys, *words):
        scene.write_text(f'[simulation]\nduration = 1\n[[body]]\nname = "b"\nkind = "rigid"\n{keys}\n')
        message = run("check", scene, code=2).stderr
        for word in ("wrong.toml:", *words):
            expect(word in message, f"{keys!r}: {word!r} is missing in {message!r}")

    wrong('mass = 1\nshapes = [{ shape = "bix", size = [1, 1, 1] }]', "shape 1", "'bix'", "did you mean 'box'")
    wrong('mass = 1\nshapes = [{ shape = "box", radius = 1 }]', "key 'radius' is unknown", "size")
    wrong('mass = 1\nshapes = [{ shape = "link", from = "a", to = [1, 0, 0] }]', "'from'", "frame of the body", "origin")
    wrong('mass = 1\nshapes = [{ shape = "cylinder", radius = 1, inner_radius = 2, length = 1 }]', "smaller than the radius")
    wrong('mass = 1\nshapes = [{ shape = "link", from = [0, 0, 0], to = [0, 0, 0] }]', "same point")
    wrong('mass = 1\ndensity = 7800\nshapes = [{ shape = "sphere", radius = 1 }]', "'mass' excludes 'density'")
    wrong("density = 7800", "needs 'shapes'")
    wrong('mass = 1\ninertia = "shapes"', "has no 'shapes'")
    wrong('mass = 1\nshapes = [{ shape = "sphere", radius = 1, color = "reddish" }]', "shape 1", "'color'", "#rrggbb")
    (folder / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    wrong('mass = 1\nmesh = { file = "m.obj", unit = "kg" }', "'mesh.unit'", "unit of length")


with tempfile.TemporaryDirectory() as name:
    here = pathlib.Path(name)
    formulas(here)
    link(here)
    asked(here)
    placed_mesh(here)
    wrong_unit(here)
    materials(here)
    errors(here)
finish()
