"""[render] level_of_detail: a tube of 320 000 triangles that bends, drawn with all of them and with fewer.

    test_detail.py FLEXFRAME SOURCE_DIR

Truth: the pictures with all triangles. What is covered must agree but along the outline: half a pixel shifts an outline by one pixel at
most, so where the two differ no 2 x 2 pixels may lie together, and colours inside must be those of the values within two hundredths.
"""
import json
import math
import pathlib
import subprocess

import numpy as np

from program import expect, finish, run, temporary_folder

SCENE = """
title = "Tube"
[simulation]
duration = 0.6
output_rate = 50
gravity = [0, -9.81, 0]
[[body]]
name = "tube"
kind = "beam"
length = 2.0
elements = 4
section = {{ shape = "circle", diameter = 0.2 }}
material = {{ density = 1000, youngs_modulus = 6e7 }}
mesh = "tube.ply"
[[joint]]
name = "clamp"
kind = "weld"
parent = "ground"
child = "tube.root"
[render]
size = [960, 540]
scales = [1]
color_by = "displacement"
extremes = true
ground = false
channels = ["depth"]
level_of_detail = {}
{}
"""


def write_tube(path, rings, sides, length=2.0, radius=0.1):
    """A closed tube along x as binary PLY."""
    angle = 2 * math.pi * np.arange(sides) / sides
    ring = np.stack([np.zeros(sides), radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    points = np.concatenate([ring + [length * i / rings, 0, 0] for i in range(rings + 1)] + [[[0, 0, 0], [length, 0, 0]]])
    k = np.arange(sides)
    n = (k + 1) % sides
    faces = []
    for i in range(rings):
        a, b = i * sides + k, i * sides + n
        faces += [np.stack([a, b, b + sides], axis=1), np.stack([a, b + sides, a + sides], axis=1)]
    first, last = len(points) - 2, len(points) - 1
    faces += [np.stack([0 * k + first, n, k], axis=1), np.stack([0 * k + last, rings * sides + k, rings * sides + n], axis=1)]
    faces = np.concatenate(faces)
    rows = np.zeros(len(faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, faces
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
    head += "property float x\nproperty float y\nproperty float z\n"
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    path.write_bytes(head.encode() + points.astype("<f4").tobytes() + rows.tobytes())
    return len(faces)


def pixels(path, layout, dtype):
    """The picture's channels by ffmpeg, another reader than the program's."""
    done = subprocess.run(
        ["ffmpeg", "-v", "error", "-i", str(path), "-f", "rawvideo", "-pix_fmt", layout, "-"], capture_output=True, check=True
    )
    data = np.frombuffer(done.stdout, dtype)
    return data.reshape(540, 960, -1).astype(int)


def together(different):
    """Whether 2 x 2 pixels lie together."""
    return bool((different[1:, 1:] & different[:-1, 1:] & different[1:, :-1] & different[:-1, :-1]).any())


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    count = write_tube(folder / "tube.ply", 894, 179)
    expect(count > 300000, f"{count} triangles")
    told = {}
    for word in ("true", "false"):
        (folder / f"{word}.toml").write_text(SCENE.format(word, ""))
        done = run("run", folder / f"{word}.toml", "-o", folder / word, "--no-video", "--frames", "0:12", "--json")
        told[word] = json.loads(done.stdout)
    notes = {word: [n for n in t["drawing"]["notes"] if "level_of_detail" in n] for word, t in told.items()}
    expect(len(notes["true"]) == 1 and not notes["false"], f"told where triangles are left out, and only there: {notes}")

    depths, frames = sorted((folder / "true/depth").glob("*.png")), sorted((folder / "true/frames").glob("*.png"))
    expect(len(frames) >= 10 and len(depths) == len(frames), f"pictures: {frames}, {depths}")
    changed = 0
    for frame in frames:
        other = folder / "false" / frame.relative_to(folder / "true")
        a, b = pixels(frame, "rgb24", np.uint8), pixels(other, "rgb24", np.uint8)
        changed += (a != b).any()
        off = np.abs(a - b).max(axis=2)
        expect(not together(off > 24), f"{frame.name}: more than an outline differs, by up to {off.max()}")
        expect(off.mean() < 0.05, f"{frame.name}: colours differ by {off.mean():.3f} of 255 in the mean")
    expect(changed > len(frames) / 2, f"fewer triangles are drawn at all: {changed} of {len(frames)} pictures differ")
    for depth in depths:
        other = folder / "false" / depth.relative_to(folder / "true")
        a, b = pixels(depth, "gray16le", np.uint16)[:, :, 0], pixels(other, "gray16le", np.uint16)[:, :, 0]
        expect(not together((a == 65535) != (b == 65535)), f"{depth.name}: the outline is off by more than a pixel")

finish()
