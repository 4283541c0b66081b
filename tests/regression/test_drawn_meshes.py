"""Meshes that nobody tuned, drawn: the same bracket in many files, of sizes from a nanometre to ten kilometres, must give the picture that
its outline and light give; what is not drawn is told of.

    test_drawn_meshes.py FLEXFRAME SOURCE_DIR

Truth: the bracket's outline seen square on covers a known share of the picture (by hand, orthographic), its face has one colour.
"""
import io
import json
import math
import pathlib
import re
import struct
import subprocess
import zipfile

import numpy as np

from program import expect, finish, near, run, temporary_folder

# An L of area 0.64 in a square of side 1, half as thick; seen from +z.
OUTLINE = [(0, 0), (1, 0), (1, 0.4), (0.4, 0.4), (0.4, 1), (0, 1)]
AREA = 0.64
CAP = [(0, 1, 3), (1, 2, 3), (0, 3, 5), (3, 4, 5)]
POINTS = np.array([(x, y, z) for z in (-0.25, 0.25) for x, y in OUTLINE], float)
FACES = [(a + 6, b + 6, c + 6) for a, b, c in CAP] + [(c, b, a) for a, b, c in CAP]
FACES += [f for k in range(6) for m in [(k + 1) % 6] for f in ((k, m, m + 6), (k, m + 6, k + 6))]
FACES = np.array(FACES)
SIDE = 200  # pixels for 1.25 units


def normals_of(points, faces):
    n = np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
    length = np.linalg.norm(n, axis=1, keepdims=True)
    return n / np.where(length > 0, length, 1)


def obj(points, faces, normals=None, head="", tail=""):
    text = head + "".join("v %.9g %.9g %.9g\n" % tuple(p) for p in points)
    if normals is not None:
        text += "".join("vn %.6g %.6g %.6g\n" % tuple(n) for n in normals)
        text += "".join("f " + " ".join(f"{i + 1}//{k + 1}" for i in f) + "\n" for k, f in enumerate(faces))
    else:
        text += "".join("f " + " ".join(str(i + 1) for i in f) + "\n" for f in faces)
    return (text + tail).encode()


def stl(points, faces, normals):
    body = b"".join(struct.pack("<12fH", *n, *points[f].ravel(), 0) for f, n in zip(faces, normals))
    return b"mesh".ljust(80) + struct.pack("<I", len(faces)) + body


def ply(points, faces):
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\n"
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    return head.encode() + points.astype("<f4").tobytes() + b"".join(struct.pack("<B3i", 3, *f) for f in faces)


def dae(points, faces, up, metres):
    """Collada: its numbers stand in its own unit; its axes are the body's, whichever points up."""
    numbers = " ".join(f"{v / metres:.9g}" for v in points.ravel())
    words = "".join(f'<param name="{x}" type="float"/>' for x in "XYZ")
    return (
        '<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        f'<asset><unit meter="{metres}"/><up_axis>{up}</up_axis></asset><library_geometries><geometry id="g"><mesh><source id="s">'
        f'<float_array id="a" count="{points.size}">{numbers}</float_array><technique_common>'
        f'<accessor source="#a" count="{len(points)}" stride="3">{words}</accessor></technique_common></source>'
        '<vertices id="v"><input semantic="POSITION" source="#s"/></vertices>'
        f'<triangles count="{len(faces)}"><input semantic="VERTEX" source="#v" offset="0"/><p>{" ".join(map(str, faces.ravel()))}</p>'
        "</triangles></mesh></geometry></library_geometries><library_visual_scenes>"
        '<visual_scene id="w"><node id="n"><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>'
        '<scene><instance_visual_scene url="#w"/></scene></COLLADA>'
    ).encode()


def three_mf(points, faces):
    """3MF, a file that says its unit."""
    place = '<vertex x="%.9g" y="%.9g" z="%.9g"/>'
    corner = '<triangle v1="%d" v2="%d" v3="%d"/>'
    model = (
        '<?xml version="1.0"?><model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>'
        '<object id="1" type="model"><mesh><vertices>' + "".join(place % tuple(p) for p in points) + "</vertices><triangles>"
        "" + "".join(corner % tuple(f) for f in faces) + "</triangles></mesh></object></resources>"
        '<build><item objectid="1"/></build></model>'
    )
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as file:
        file.writestr(
            "_rels/.rels",
            '<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship '
            'Target="/3D/3dmodel.model" Id="r" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>',
        )
        file.writestr("3D/3dmodel.model", model)
    return out.getvalue()


def glb(points, faces, textured=False):
    data = faces.astype("<u4").tobytes() + points.astype("<f4").tobytes()
    texture = {"baseColorTexture": {"index": 0}} if textured else {}
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 1}, "indices": 0, "material": 0}]}],
        "materials": [{"name": "paint", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.45, **texture}}],
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": faces.size * 4},
            {"buffer": 0, "byteOffset": faces.size * 4, "byteLength": points.size * 4},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5125, "count": int(faces.size), "type": "SCALAR"},
            {
                "bufferView": 1,
                "componentType": 5126,
                "count": len(points),
                "type": "VEC3",
                "min": points.min(0).tolist(),
                "max": points.max(0).tolist(),
            },
        ],
    }
    if textured:
        tree |= {"textures": [{"source": 0}], "images": [{"uri": "wood.png"}]}
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def body(name, file, place, scale=1.0):
    return f"""[[body]]
name = "{name}"
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
color = [0.5, 0.5, 0.5]
mesh = {{ file = "{file}", scale = {scale!r}, position = [{place[0]!r}, {place[1]!r}, 0] }}
[[joint]]
name = "hold {name}"
kind = "weld"
parent = "ground"
child = "{name}"
"""


def picture(folder, bodies, width, height, unit):
    """Pixels of the bodies, seen square on; 160 pixels are `unit`, the lower left corner lies an eighth of it below the origin."""
    high, wide = 1.25 * unit * height / SIDE, 1.25 * unit * width / SIDE
    x, y = 0.5 * wide - 0.125 * unit, 0.5 * high - 0.125 * unit
    (folder / "scene.toml").write_text(
        f"""title = "meshes"
[simulation]
duration = 1.0
gravity = [0, 0, 0]
{bodies}
[render]
size = [{width}, {height}]
frame_rate = 1
look = "plain"
background = "white"
ground = false
shadows = false
occlusion = false
joints = false
camera = {{ position = [{x!r}, {y!r}, {10 * unit!r}], target = [{x!r}, {y!r}, 0], projection = "orthographic", height = {high!r} }}
"""
    )
    done = run("run", "scene.toml", "-o", "out", "--frames", "0:1", "--no-video", "--no-overlay", "--workers", "1", cwd=folder)
    words = ["ffmpeg", "-v", "error", "-i", str(folder / "out/frames/frame_00000.png"), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    raw = subprocess.run(words, capture_output=True, check=True).stdout
    return (np.frombuffer(raw, np.uint8).reshape(height, width, 3).astype(int), done.stdout + done.stderr)


def check(what, cell, wanted=None):
    """Covered share and colour of a cell of SIDE x SIDE pixels; returns the colour of the face."""
    cover = (255 - cell).sum(2) > 6
    near(cover.mean(), AREA / 1.25**2, 0.006, f"{what}: covered share")
    # A quarter in from the corner: on the face.
    color = cell[SIDE - 1 - 60, 60]
    if wanted is not None:
        expect(np.abs(color - wanted).max() <= 6, f"{what}: its face has the colour {color}, wanted {wanted}")
    return color


with temporary_folder() as name:
    folder = pathlib.Path(name)
    normals = normals_of(POINTS, FACES)
    flat = POINTS[FACES].reshape(-1, 3)  # every triangle with corners of its own
    alone = np.arange(len(flat)).reshape(-1, 3)
    turned = FACES[:, ::-1]
    mixed = np.where((np.arange(len(FACES)) % 2 == 0)[:, None], FACES, turned)
    thin = np.concatenate([POINTS, [(0.5, 0.1, 0.25)] * 3])
    variants = {
        "obj": ("a.obj", obj(POINTS, FACES)),
        "normals of the file": ("b.obj", obj(POINTS, FACES, normals)),
        "normals turned inwards": ("c.obj", obj(POINTS, FACES, -normals)),
        "normals of no length": ("d.obj", obj(POINTS, FACES, 0 * normals)),
        "faces wound inwards": ("e.obj", obj(POINTS, turned)),
        "half of the faces wound inwards": ("f.obj", obj(POINTS, mixed)),
        "faces of no area": ("g.obj", obj(thin, np.concatenate([FACES, [(12, 13, 14), (0, 1, 1), (6, 7, 12)]]))),
        "every face twice": ("h.obj", obj(POINTS, np.concatenate([FACES, FACES]))),
        "stl": ("i.stl", stl(POINTS, FACES, normals)),
        "stl without normals": ("j.stl", stl(POINTS, FACES, 0 * normals)),
        "ply": ("k.ply", ply(POINTS, FACES)),
        "glb": ("l.glb", glb(POINTS, FACES)),
        "dae, z up": ("o.dae", dae(POINTS, FACES, "Z_UP", 1.0)),
        "dae, x up, in inches": ("p.dae", dae(POINTS, FACES, "X_UP", 0.0254)),
        "corners of their own": ("m.obj", obj(flat, alone)),
        "materials of odd numbers": ("n.obj", obj(POINTS, FACES, head="mtllib n.mtl\nusemtl odd\n")),
    }
    (folder / "n.mtl").write_text("newmtl odd\nKd nan 2 -1\nNs 1e9\nd 1.0\nillum 99\nPr -3\nmap_Kd wood.png\n")
    bodies = ""
    for k, (what, (file, data)) in enumerate(variants.items()):
        (folder / file).write_bytes(data)
        bodies += body(what, file, (1.25 * (k % 5), 1.25 * (k // 5)))
    rows = (len(variants) + 4) // 5
    pixels, said = picture(folder, bodies, 5 * SIDE, rows * SIDE, 1.0)
    first = None
    for k, what in enumerate(variants):
        x, y = SIDE * (k % 5), SIDE * (rows - 1 - k // 5)
        color = check(what, pixels[y : y + SIDE, x : x + SIDE], first)
        first = color if first is None else first
    expect("textures are not drawn" in said, f"a texture is passed over in silence: {said}")

    # A unit that is not read is told of.
    expect("may say their unit" not in said, f"units of files that have none, or that are counted: {said}")
    (folder / "u.3mf").write_bytes(three_mf(POINTS, FACES))
    pixels, said = picture(folder, body("3mf", "u.3mf", (0.0, 0.0)), SIDE, SIDE, 1.0)
    check("3mf", pixels)
    expect("may say their unit" in said, f"the unit of a 3mf is passed over in silence: {said}")

    # A texture of another format is told of too.
    (folder / "t.glb").write_bytes(glb(POINTS, FACES, textured=True))
    pixels, said = picture(folder, body("glb with a texture", "t.glb", (0.0, 0.0)), SIDE, SIDE, 1.0)
    check("glb with a texture", pixels)
    expect("textures are not drawn" in said, f"a texture of a glb is passed over in silence: {said}")

    # Sizes: the file itself in nanometres to tens of kilometres, then the scene's scale.
    for size in (1e-9, 1e-6, 1e-3, 1e4):
        (folder / "s.ply").write_bytes(ply(size * POINTS, FACES))
        pixels, said = picture(folder, body("bracket", "s.ply", (0.0, 0.0)), SIDE, SIDE, size)
        check(f"{size:g} m", pixels, first)
    (folder / "s.stl").write_bytes(stl(POINTS, FACES, normals))
    pixels, said = picture(folder, body("bracket", "s.stl", (0.0, 0.0), 1e-7), SIDE, SIDE, 1e-7)
    check("scaled to 100 nm", pixels, first)

    # One triangle ten thousand times the picture, behind the bracket: it fills the rest.
    far = np.array([(-1e4, -1e4, -1.0), (1e4, -1e4, -1.0), (0.0, 2e4, -1.0)])
    (folder / "far.obj").write_bytes(obj(far, [(0, 1, 2)]))
    pixels, said = picture(folder, body("b", "a.obj", (0.0, 0.0)) + body("far", "far.obj", (0.0, 0.0)), SIDE, SIDE, 1.0)
    expect(((255 - pixels).sum(2) > 6).all(), "a huge triangle does not fill the picture")

    # A bracket that turns at 2 rad/s about an axis through its face: it stands still where it has no corner, its far corners, 0.825 m
    # away, are the fastest.
    (folder / "turning.toml").write_text(
        """title = "turning"
[simulation]
duration = 1.0
gravity = [0, 0, 0]
[[body]]
name = "bracket"
kind = "rigid"
mass = 1.0
inertia = [1, 1, 1]
centre_of_mass = [0.2, 0.2, 0]
frames = { hub = [0.2, 0.2, 0] }
mesh = "a.obj"
[[joint]]
name = "pin"
kind = "revolute"
parent = "ground"
child = "bracket.hub"
axis = [0, 0, 1]
initial = { value = 0, rate = 2 }
[render]
frame_rate = 5
color_by = "velocity"
extremes = true
channels = ["vector"]
"""
    )
    run("run", "turning.toml", "-o", "turned", "--frames", "1:2", "--no-video", cwd=folder)
    svg = (folder / "turned/vector/frame_00001.svg").read_text()
    told = dict(re.findall(r"(min|max) (-?[0-9.]+) m/s", svg))
    expect(set(told) == {"min", "max"}, f"extremes: {told}")
    near(float(told.get("min", "nan")), 0.0, 1e-9, "smallest speed of what is drawn")
    near(float(told.get("max", "nan")), 2 * math.hypot(0.8, 0.2), 0.006, "largest speed")

    # Points of the file that no face uses are not drawn: they count neither for the camera that fits the whole nor for speeds.
    whole = (folder / "turned/frames/frame_00001.png").read_bytes()
    stray = np.concatenate([[(30.0, 40.0, 5.0)], POINTS, [(-100.0, 0.0, 0.0)]])
    (folder / "a.obj").write_bytes(obj(stray, FACES + 1))
    run("run", "turning.toml", "-o", "stray", "--frames", "1:2", "--no-video", cwd=folder)
    svg = (folder / "stray/vector/frame_00001.svg").read_text()
    told = dict(re.findall(r"(min|max) (-?[0-9.]+) m/s", svg))
    near(float(told.get("max", "nan")), 2 * math.hypot(0.8, 0.2), 0.006, "largest speed beside points that no face uses")
    expect((folder / "stray/frames/frame_00001.png").read_bytes() == whole, "points that no face uses change the picture")

finish()
