#!/usr/bin/env python3
"""A page of 100 352 triangles that deform, for page_figures.py: a ring that bends across its plane by two shapes while it turns (numpy).

    ring_page.py FLEXFRAME OUT.html [OPTION...]         options of flexframe export: --scales 1 leaves out the ghost
"""
import pathlib
import subprocess
import sys
import tempfile

import numpy as np


def ring(around=224, across=224):
    """Points of a torus of radii 1 m and 0.3 m, their bending shapes of two and three waves, triangles."""
    u, v = np.meshgrid(*(np.linspace(0, 2 * np.pi, n, endpoint=False) for n in (around, across)), indexing="ij")
    r = 1 + 0.3 * np.cos(v)
    points = np.stack([r * np.cos(u), r * np.sin(u), 0.3 * np.sin(v)], -1).reshape(-1, 3)
    shapes = [np.stack([0 * u, 0 * u, np.cos(waves * u)], -1).reshape(-1, 3) for waves in (2, 3)]
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    at = lambda a, b: (a % around) * across + b % across
    first = np.stack([at(i, j), at(i + 1, j), at(i + 1, j + 1)], -1).reshape(-1, 3)
    second = np.stack([at(i, j), at(i + 1, j + 1), at(i, j + 1)], -1).reshape(-1, 3)
    return points, np.stack(shapes, -1), np.concatenate([first, second])


def main():
    flexframe, out, *options = sys.argv[1:]
    points, shapes, triangles = ring()
    t = np.linspace(0, 2, 101)
    arrays = {"times": t, "ring.position": np.zeros((101, 3)), "ring.rotation_vector": np.outer(t, [0, 0, 0.5])}
    arrays |= {"ring.node_origin": points, "ring.node_phi": shapes, "ring.triangles": triangles}
    arrays["ring.q"] = np.stack([0.05 * np.sin(7 * t), 0.03 * np.sin(11 * t)], 1)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        np.savez(folder / "ring.npz", **arrays)
        subprocess.run([flexframe, "import", folder / "ring.npz", "-o", folder / "ring.h5"], check=True)
        words = ["--to", "html", "--color-by", "displacement", "-o", out, *options]
        subprocess.run([flexframe, "export", folder / "ring.h5", *words], check=True)


if __name__ == "__main__":
    main()
