#!/usr/bin/env python3
"""Writes blade.obj and hub.obj beside this file, metres: a rotor blade along x from its hinge, leading edge towards y, and the mast with
its hub, axis z."""
import math
import pathlib

FOLDER = pathlib.Path(__file__).resolve().parent
LENGTH, CHORD, THICKNESS, SHANK = 6.0, 0.32, 0.12, 0.06
AROUND = 28


def profile(k):
    """Point k of a NACA four-digit section without camber, quarter chord at the origin, closed trailing edge (Jacobs, Ward, Pinkerton
    1933)."""
    angle = 2 * math.pi * k / AROUND
    x = 0.5 * (1 - math.cos(angle))
    y = 5 * THICKNESS * (0.2969 * math.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    return CHORD * (0.25 - x), CHORD * (y if angle < math.pi else -y)


def shank(k):
    angle = 2 * math.pi * k / AROUND
    return SHANK * math.cos(angle), SHANK * math.sin(angle)


def write(name, rings):
    """A closed body through rings of as many points each."""
    around = len(rings[0])
    lines = ["# " + name + ", metres; made by make_meshes.py"]
    lines += ["v %.5g %.5g %.5g" % p for ring in rings for p in ring]
    index = lambda r, k: 1 + r * around + k % around
    lines += [
        f"f {index(r, k)} {index(r, k + 1)} {index(r + 1, k + 1)} {index(r + 1, k)}" for r in range(len(rings) - 1) for k in range(around)
    ]
    lines.append("f " + " ".join(str(index(0, k)) for k in reversed(range(around))))
    lines.append("f " + " ".join(str(index(len(rings) - 1, k)) for k in range(around)))
    (FOLDER / (name + ".obj")).write_text("\n".join(lines) + "\n")


# A round shank that becomes the profile.
stations = [0.0, 0.15, 0.3, 0.38, 0.46, 0.54, 0.62, 0.7, 0.78] + [0.78 + (LENGTH - 0.78) * i / 24 for i in range(1, 25)]
rings = []
for x in stations:
    share = min(max((x - 0.3) / 0.48, 0.0), 1.0)
    share = share * share * (3 - 2 * share)
    rings.append([(x, *(a + (b - a) * share for a, b in zip(shank(k), profile(k)))) for k in range(AROUND)])
write("blade", rings)

outline = [(0.10, -0.9), (0.10, -0.14), (0.27, -0.09), (0.30, -0.05), (0.30, 0.05), (0.27, 0.09), (0.09, 0.14)]
write("hub", [[(r * math.cos(2 * math.pi * k / 40), r * math.sin(2 * math.pi * k / 40), z) for k in range(40)] for r, z in outline])
