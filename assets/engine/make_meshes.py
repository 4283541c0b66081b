#!/usr/bin/env python3
"""Writes crank.obj and piston.obj beside this file: closed cylinders, metres."""
import math
import pathlib

FOLDER = pathlib.Path(__file__).resolve().parent
SIDES = 48


def cylinder(vertices, faces, centre, radius, low, high, axis):
    """Closed cylinder along axis 0 (x) or 2 (z); centre gives the two other coordinates in cyclic order."""
    first = len(vertices) + 1
    u, v = (axis + 1) % 3, (axis + 2) % 3
    for end in (low, high):
        for k in range(SIDES):
            angle = 2 * math.pi * k / SIDES
            p = [0.0, 0.0, 0.0]
            p[axis] = end
            p[u] = centre[0] + radius * math.cos(angle)
            p[v] = centre[1] + radius * math.sin(angle)
            vertices.append(p)
    for k in range(SIDES):
        n = (k + 1) % SIDES
        faces.append([first + k, first + n, first + SIDES + n, first + SIDES + k])
    faces.append([first + k for k in reversed(range(SIDES))])
    faces.append([first + SIDES + k for k in range(SIDES)])


def write(name, parts):
    vertices, faces = [], []
    for part in parts:
        cylinder(vertices, faces, *part)
    lines = ["# " + name + ", metres; made by make_meshes.py"]
    lines += ["v %.6g %.6g %.6g" % tuple(v) for v in vertices]
    lines += ["f " + " ".join(map(str, f)) for f in faces]
    (FOLDER / (name + ".obj")).write_text("\n".join(lines) + "\n")


# Flywheel behind the rod, its shaft, the crank pin through the big end.
write("crank", [((0, 0), 0.085, -0.034, -0.018, 2), ((0, 0), 0.018, -0.075, -0.034, 2), ((0.04, 0), 0.0285, -0.018, 0.014, 2)])
# Piston above the small end, and the gudgeon pin through it.
write("piston", [((0, 0), 0.036, 0.024, 0.06, 0), ((0, 0), 0.0125, -0.02, 0.02, 2)])
