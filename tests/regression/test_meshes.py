"""Meshes as real files bring them, through flexframe deform: whatever the file looks like, each vertex gets the displacement of its
place, a line a vertex in the file's order. --large: a mesh of a million vertices (nightly)."""
import base64
import json
import math
import struct
import time
import zipfile

from program import *

large = "--large" in sys.argv
nx, ny = (1000, 1000) if large else (10, 14)
width, height = 1.0, 1.3
points = [(width * i / nx, height * j / ny, 0.0) for j in range(ny + 1) for i in range(nx + 1)]
quads = [(a, a + 1, a + nx + 2, a + nx + 1) for j in range(ny) for i in range(nx) for a in [(nx + 1) * j + i]]
triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]


def lift(x, y):
    """What the nodes do, and a linear field is followed exactly by every vertex."""
    return 0.01 + 0.02 * x - 0.03 * y


def vertices(of=points, shift=0.0):
    return "".join(f"v {x + shift:.17g} {y + shift:.17g} {z + shift:.17g}\n" for x, y, z in of)


def faces(polygons, corner=lambda i: str(i + 1)):
    return "".join("f " + " ".join(corner(i) for i in p) + "\n" for p in polygons)


with temporary_folder() as name:
    folder = pathlib.Path(name)

    def node_table(shift=0.0):
        rows = [(x, y) for x in (0.0, 0.37, 1.0) for y in (0.0, 0.6, 1.3)]
        text = "x,y,z,ux,uy,uz\n" + "".join(f"{x + shift:.17g},{y + shift:.17g},{shift:.17g},0,0,{lift(x, y):.17g}\n" for x, y in rows)
        (folder / "nodes.csv").write_text(text)

    def check(what, file, content, of=points, shift=0.0, tolerance=1e-9, more=()):
        if isinstance(content, str):
            content = content.encode()
        (folder / file).write_bytes(content)
        out = folder / "out.csv"
        out.unlink(missing_ok=True)
        start = time.time()
        done = run("deform", "--nodes", folder / "nodes.csv", "--mesh", folder / file, "-o", out, timeout=1200, *more)
        if not out.exists():
            return expect(False, f"{what}: no output; {done.stderr}")
        rows = [list(map(float, line.split(","))) for line in out.read_text().split()[1:]]
        expect(len(rows) == len(of), f"{what}: {len(rows)} lines for {len(of)} vertices")
        worst = max(max(abs(u), abs(v), abs(w - lift(x, y))) for (u, v, w), (x, y, z) in zip(rows, of))
        expect(worst <= tolerance, f"{what}: a vertex is off by {worst:g}")
        print(f"{what}: {len(rows)} vertices, largest error {worst:.2g}" + (f", {time.time() - start:.1f} s" if large else ""))
        return done

    node_table()
    if large:
        check("a million vertices", "large.obj", vertices() + faces(quads))
        finish()

    plain = vertices() + faces(quads)
    check("plain", "mesh.obj", plain)
    count = len(points)
    check("negative indices", "mesh.obj", vertices() + faces(quads, lambda i: str(i - count)))
    check("faces before vertices", "mesh.obj", faces(quads) + vertices())
    check("triangles", "mesh.obj", vertices() + faces(triangles))
    rim = [
        *range(nx + 1),
        *((nx + 1) * j + nx for j in range(1, ny + 1)),
        *(count - 2 - i for i in range(nx)),
        *((nx + 1) * j for j in range(ny - 1, 0, -1)),
    ]
    inner = [i for i in range(count) if i not in set(rim)]
    check("one polygon of all the rim, the other vertices in no face", "mesh.obj", vertices() + faces([rim]))
    comb = [
        (0.0, 0.0, 0.0),
        (1.0, 0.0, 0.0),
        (1.0, 1.3, 0.0),
        (0.8, 1.3, 0.0),
        (0.8, 0.2, 0.0),
        (0.6, 0.2, 0.0),
        (0.6, 1.3, 0.0),
        (0.0, 1.3, 0.0),
    ]
    check("a polygon that is not convex", "mesh.obj", vertices(comb) + faces([range(len(comb))]), comb)
    groups = (
        "mtllib none.mtl\no plate\ng left\nusemtl red\ns 1\n"
        + vertices()
        + faces(quads[::2])
        + "g right upper\nusemtl blue\ns off\n"
        + faces(quads[1::2])
    )
    check("groups and objects, materials whose library is missing", "mesh.obj", groups)
    (folder / "two.mtl").write_text("newmtl red\nKd 0.8 0.1 0.1\nnewmtl blue\nKd 0.1 0.1 0.8\nNs 50\nd 0.5\n")
    check("several materials", "mesh.obj", groups.replace("none.mtl", "two.mtl"))
    check(
        "normals and texture coordinates",
        "mesh.obj",
        vertices() + "vn 0 0 1\nvt 0 0\nvt 1 1\n" + faces(quads, lambda i: f"{i + 1}/{1 + i % 2}/1"),
    )
    check("normals without texture coordinates", "mesh.obj", vertices() + "vn 0 0 1\n" + faces(quads, lambda i: f"{i + 1}//1"))
    check(
        "some corners without normals",
        "mesh.obj",
        vertices() + "vn 0 0 1\n" + faces(quads[::2], lambda i: f"{i + 1}//1") + faces(quads[1::2]),
    )
    # Normals are light alone: a mesh whose faces name some that are not there, or are none, can be used.
    for what, normals in (("none", ""), ("too few", "vn 0 0 1\n"), ("no numbers", "vn 0 0 1\nvn nan nan nan\nvn -nan(ind) 0 1\n")):
        done = check(
            f"faces with normals, {what} of them there", "mesh.obj", vertices() + normals + faces(quads, lambda i: f"{i + 1}//{1 + i % 3}")
        )
        expect(done is not None and "name normals ('vn')" in done.stdout + done.stderr, f"normals, {what} of them there, are told of")
    check("faces with texture coordinates that are not there", "mesh.obj", vertices() + faces(quads, lambda i: f"{i + 1}/{i + 1}"))
    check("CRLF", "mesh.obj", plain.replace("\n", "\r\n"))
    check("bare carriage returns", "mesh.obj", plain.replace("\n", "\r"))
    check("comments, blanks and tabs", "mesh.obj", "# plate\n\n   \n" + plain.replace("v ", "\tv\t ").replace("\n", " # here\n# there\n"))
    check("a comment of a million characters", "mesh.obj", "# " + "x" * 1000000 + "\n" + plain)
    fan = [(0.5 + 0.5 * math.cos(2 * math.pi * k / 3000), 0.65 + 0.65 * math.sin(2 * math.pi * k / 3000), 0.0) for k in range(3000)]
    check("a face of 3000 corners in one line", "mesh.obj", vertices(fan) + faces([range(3000)]), fan)
    check("lines that go on", "mesh.obj", plain.replace(" ", " \\\n ", 700))
    check("words nobody knows, no new line at the end", "mesh.obj", "shadow_obj x\ncurv 1 2\n" + plain.rstrip("\n"))
    check("colours and weights of vertices", "mesh.obj", vertices().replace("\n", " 0.5 0.2 0.1\n") + faces(quads))
    # Weights are those of curves and surfaces; faces stay where they are.
    done = check("a fourth number of vertices", "mesh.obj", vertices().replace("\n", " 0.25\n") + faces(quads))
    expect(done is not None and "fourth numbers" in done.stdout + done.stderr, "fourth numbers are told of")
    check("faces without area and with a corner twice", "mesh.obj", plain + "f 1 1 2\nf 1 2 2 13\nf 1 2\nl 1 2 3\np 4\n")

    node_table(1e6)
    check("a thousand kilometres from the origin", "mesh.obj", vertices(shift=1e6) + faces(quads), tolerance=1e-8)
    node_table()

    # Other formats, by their own order of vertices.
    soup = [points[i] for t in triangles for i in t]
    facet = "facet normal 0 0 1\nouter loop\n{}endloop\nendfacet\n"
    check(
        "STL, text",
        "mesh.stl",
        "solid plate\n"
        + "".join(facet.format("".join("vertex %.9g %.9g %.9g\n" % points[i] for i in t)) for t in triangles)
        + "endsolid plate\n",
        soup,
        tolerance=1e-7,
    )
    for what, direction in (("as C writes it", "-nan(ind) -nan(ind) -nan(ind)"), ("as C wrote it", "1.#QNAN 1.#QNAN 1.#QNAN")):
        facets = "".join(facet.format("".join("vertex %.9g %.9g %.9g\n" % points[i] for i in t)) for t in triangles)
        mended = "\ufeffsolid plate\n" + facets.replace("normal 0 0 1", "normal " + direction, 2) + "endsolid plate\n"
        check("STL, no direction " + what, "mesh.stl", mended, soup, tolerance=1e-7)
    check(
        "STL, binary",
        "mesh.stl",
        b"binary".ljust(80)
        + struct.pack("<I", len(triangles))
        + b"".join(struct.pack("<12fH", 0, 0, 1, *(c for i in t for c in points[i]), 0) for t in triangles),
        soup,
        tolerance=1e-7,
    )
    head = (
        f"ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\nelement face"
        f" {len(quads)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    check(
        "PLY",
        "mesh.ply",
        head + "".join("%.9g %.9g %.9g\n" % p for p in points) + "".join("4 %d %d %d %d\n" % q for q in quads),
        tolerance=1e-7,
    )
    check(
        "PLY with a remark in its header",
        "mesh.ply",
        head.replace("element vertex", "Created by hand\nelement vertex")
        + "".join("%.9g %.9g %.9g\n" % p for p in points)
        + "".join("4 %d %d %d %d\n" % q for q in quads),
        tolerance=1e-7,
    )
    data = b"".join(struct.pack("<3f", *p) for p in points) + b"".join(struct.pack("<3H", *t) for t in triangles)
    gltf = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}],
        "bufferViews": [{"buffer": 0, "byteLength": 12 * count}, {"buffer": 0, "byteOffset": 12 * count, "byteLength": 6 * len(triangles)}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1.3, 0]},
            {"bufferView": 1, "componentType": 5123, "count": 3 * len(triangles), "type": "SCALAR"},
        ],
    }
    check("glTF", "mesh.gltf", json.dumps(gltf), tolerance=1e-7)
    # A part that its scene turns and moves: x and y change places.
    gltf["nodes"] = [
        {"children": [1], "translation": [0, 1.3, 0]},
        {"mesh": 0, "rotation": [0, 0, -(0.5**0.5), 0.5**0.5], "scale": [1, 1 / 1.3, 1]},
    ]
    check("glTF with a scene of nodes", "mesh.gltf", json.dumps(gltf), [(y / 1.3, 1.3 - x, z) for x, y, z in points], tolerance=1e-6)

    packed = json.dumps({**gltf, "extensionsUsed": ["KHR_mesh_quantization"], "extensionsRequired": ["KHR_mesh_quantization"]})

    # What no file may do.
    def refused(what, file, content, word):
        (folder / file).write_bytes(content.encode() if isinstance(content, str) else content)
        done = run("deform", "--nodes", folder / "nodes.csv", "--mesh", folder / file, "-o", folder / "wrong.csv", code=2)
        expect(word in done.stderr and file in done.stderr, f"{what}: {done.stderr}")
        expect(not (folder / "wrong.csv").exists(), f"{what} leaves a file")

    refused("an index beyond the end", "bad.obj", vertices() + "f 1 2 9999\n", f"bad.obj:{count + 1}: face refers to vertex 9999")
    refused("a negative index beyond the start", "bad.obj", vertices() + "f -1 -2 -9999\n", "-9999")
    refused("an index of zero", "bad.obj", vertices() + "f 0 1 2\n", "start at 1")
    refused("a coordinate that is none", "bad.obj", "v 0 0 zero\n" + plain, "bad.obj:1: coordinate 'zero'")
    refused(
        "a coordinate beyond what can be drawn", "bad.obj", "v 0 0 1e308\n" + plain, "bad.obj:1: vertex (0, 0, 1e+308) lies beyond 1e+15"
    )
    refused("a coordinate that is not finite", "bad.obj", "v 0 0 nan\n" + plain, "bad.obj:1")
    refused("two coordinates", "bad.obj", "v 0 0\n" + plain, "bad.obj:1")
    refused("no faces", "bad.obj", vertices(), "no face")
    refused("an empty file", "bad.obj", "", "empty")
    refused("a picture", "bad.obj", b"\x89PNG\r\n\x1a\n" + bytes(range(256)), "no vertices")
    refused("STL that ends early", "bad.stl", b"x".ljust(80) + struct.pack("<I", 1000000) + b"abc", "bad.stl")
    refused("PLY that ends early", "bad.ply", head + "0 0 0\n", "bad.ply")
    refused("PLY that ends in its header", "bad.ply", head[: len(head) // 2], "end_header")
    refused("glTF without its buffer", "bad.gltf", json.dumps({**gltf, "buffers": [{"byteLength": 99, "uri": "gone.bin"}]}), "bad.gltf")
    with zipfile.ZipFile(folder / "parts.zip", "w") as parts:
        for part in ("3D/3dmodel.model", "3D/Objects/a.model"):
            parts.writestr(part, "<model/>")
    refused("glTF of an extension", "bad.gltf", packed, "KHR_mesh_quantization")
    refused("3MF of several files", "bad.3mf", (folder / "parts.zip").read_bytes(), "production extension")
    refused("an unknown format", "bad.xyzzy", "a letter to a friend\n", "bad.xyzzy")

    # A part whose file is in millimetres dwarfs the beam that it hangs on; with its unit nothing is said.
    cube = [(x, y, z) for x in (-20, 20) for y in (-20, 20) for z in (-20, 20)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    (folder / "bob.obj").write_text(vertices(cube) + faces(sides))
    for mesh, told_of in (('"bob.obj"', True), ('{ file = "bob.obj", unit = "mm" }', False)):
        (folder / "hung.toml").write_text(
            "[simulation]\nduration = 0.01\ngravity = [0, -9.81, 0]\n"
            '[[body]]\nname = "arm"\nkind = "beam"\nlength = 0.1\nsection = { shape = "circle", diameter = 0.01 }\n'
            "material = { density = 7850, youngs_modulus = 2.1e11 }\n"
            f'[[body]]\nname = "bob"\nkind = "rigid"\nmass = 1\ninertia = [1e-3, 1e-3, 1e-3]\nmesh = {mesh}\n'
            '[[joint]]\nname = "pin"\nkind = "revolute"\nparent = "ground"\nchild = "arm"\n'
            '[[joint]]\nname = "weld"\nkind = "weld"\nparent = "arm.tip"\nchild = "bob"\n'
            '[render]\nsize = [64, 64]\nframe_rate = 1\nvideo = "none"\n'
        )
        done = run("run", folder / "hung.toml", "-o", folder / "hung")
        told = "if the file is in millimetres" in done.stdout + done.stderr
        expect(told == told_of, f"a mesh {mesh}: {done.stdout[-600:]}{done.stderr[-600:]}")

finish()
