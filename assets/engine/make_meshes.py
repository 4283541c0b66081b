#!/usr/bin/env python3
"""Writes crank.obj and piston.obj beside this file: closed solids, metres."""
import math
import pathlib

FOLDER = pathlib.Path(__file__).resolve().parent
SIDES = 48


def circle(centre, radius):
    angles = [2 * math.pi * k / SIDES for k in range(SIDES)]
    return [(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a)) for a in angles]


def lug(radius, reach):
    """Round about the origin, and straight from there to x = reach."""
    angles = [math.pi / 2 + math.pi * k / (SIDES // 2) for k in range(SIDES // 2 + 1)]
    return [(radius * math.cos(a), radius * math.sin(a)) for a in angles] + [(reach, -radius), (reach, radius)]


def prism(vertices, faces, outline, low, high, axis):
    """Closed prism along axis 0 (x) or 2 (z); the outline has the two other coordinates in cyclic order, turning from the first to the
    second."""
    first, count = len(vertices) + 1, len(outline)
    for end in (low, high):
        for u, v in outline:
            p = [0.0, 0.0, 0.0]
            p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = end, u, v
            vertices.append(p)
    for k in range(count):
        n = (k + 1) % count
        faces.append([first + k, first + n, first + count + n, first + count + k])
    faces.append([first + k for k in reversed(range(count))])
    faces.append([first + count + k for k in range(count)])


def turned(vertices, faces, profile):
    """Closed solid turned about x; the profile: (x, radius) from its lower end to its upper one."""
    first, rows = len(vertices) + 1, len(profile)
    for x, radius in profile:
        vertices += [[x, u, v] for u, v in circle((0, 0), radius)]
    for r in range(rows - 1):
        for k in range(SIDES):
            a, b = first + r * SIDES + k, first + r * SIDES + (k + 1) % SIDES
            faces.append([a, b, b + SIDES, a + SIDES])
    faces.append([first + k for k in reversed(range(SIDES))])
    faces.append([first + (rows - 1) * SIDES + k for k in range(SIDES)])


def write(name, vertices, faces):
    lines = ["# " + name + ", metres; made by make_meshes.py"]
    lines += ["v %.6g %.6g %.6g" % tuple(v) for v in vertices]
    lines += ["f " + " ".join(map(str, f)) for f in faces]
    (FOLDER / (name + ".obj")).write_text("\n".join(lines) + "\n")


def crank():
    """Flywheel behind the rod, its shaft, the crank pin through the big end."""
    vertices, faces = [], []
    prism(vertices, faces, circle((0, 0), 0.085), -0.034, -0.018, 2)
    prism(vertices, faces, circle((0, 0), 0.018), -0.075, -0.034, 2)
    prism(vertices, faces, circle((0.04, 0), 0.0285), -0.018, 0.014, 2)
    write("crank", vertices, faces)


def piston():
    """A crown above the small end with grooves for three rings; two lugs carry the gudgeon pin on both sides of the rod."""
    vertices, faces = [], []
    outer, inner = 0.036, 0.0345
    grooves = [(0.041, 0.0425), (0.0465, 0.048), (0.052, 0.0535)]
    profile = [(0.024, outer)]
    for low, high in grooves:
        profile += [(low, outer), (low, inner), (high, inner), (high, outer)]
    turned(vertices, faces, profile + [(0.06, outer)])
    for low, high in ((-0.026, -0.0135), (0.0135, 0.026)):
        prism(vertices, faces, lug(0.0175, 0.024), low, high, 2)
    prism(vertices, faces, circle((0, 0), 0.0125), -0.028, 0.028, 2)
    write("piston", vertices, faces)


crank()
piston()
