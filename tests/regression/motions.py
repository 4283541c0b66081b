"""A motion that files of other programs are made of, and what flexframe import made of them."""

import h5py
import numpy as np
from scipy.spatial.transform import Rotation

from program import near, source

data = source / "tests/regression/data/import"
rng = np.random.default_rng(7)
t = np.linspace(0.0, 0.5, 26)
# A turn that goes all round, and places.
turns = Rotation.from_rotvec(np.outer(9.0 * t, [0.36, -0.48, 0.8]) + [0.4, -0.2, 0.7])
places = np.stack([np.sin(3 * t), t**2 - 0.2, 0.1 + 0.3 * t], axis=1)


def write_table(path, columns, separator=",", number=repr, head=""):
    """columns: name -> values. Every number with all its digits."""
    rows = np.stack([np.asarray(v, float) for v in columns.values()], axis=1)
    text = head + separator.join(columns) + "\n"
    path.write_text(text + "".join(separator.join(number(float(v)) for v in row) + "\n" for row in rows))


def body(path, name):
    """Position, Rotation and the group of a body."""
    file = h5py.File(path, "r")
    group = file["bodies"][name]
    return group["position"][:], Rotation.from_quat(np.roll(group["orientation"][:], -1, axis=1)), group


def off_by(rotation, wanted):
    """Largest angle between two rotations, rad."""
    return (rotation * wanted.inv()).magnitude().max()


def check_body(path, name, position, rotation, what, tolerance=1e-9):
    p, R, _ = body(path, name)
    near(np.abs(p - position).max(), 0.0, tolerance, f"{what}: position")
    near(off_by(R, rotation), 0.0, tolerance, f"{what}: orientation")


def volume(group):
    """Of the body's surface, by the divergence theorem: closed and seen from outside where it is what the elements fill."""
    corners = group["surface/points"][:][group["surface/triangles"][:].astype(int)]
    return np.einsum("ti,ti->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
