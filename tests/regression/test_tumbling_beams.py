"""Beams that tumble freely or are driven, straight and curved, with few effects listed: what the rotary inertia of their sections, which
comes with shear, is worth is told as large as it is. The truth: a rigid body with the sections' tensors along its axis, and Euler's
equations."""
import json
import math
import pathlib
import re

import numpy as np
from program import expect, finish, history, near, run, temporary_folder
from scene_text import body, joint, output, simulation
from scipy.integrate import solve_ivp

E, rho = 7e10, 2700.0


def tensor(length, turned, wide, high):
    """About the centre of mass, in the axes of the root; the axis is an arc of `turned` rad, or straight."""
    angle = (np.arange(400) + 0.5) / 400 * turned
    along = np.array([np.cos(angle), np.sin(angle), 0 * angle]).T * (length / 400)
    place = np.cumsum(along, axis=0) - 0.5 * along
    place -= place.mean(axis=0)
    section = np.diag([wide * high * (wide**2 + high**2) / 12, high * wide**3 / 12, wide * high**3 / 12])
    out = np.zeros((3, 3))
    for p, a in zip(place, angle):
        c, s = math.cos(a), math.sin(a)
        R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        out += rho * length / 400 * (wide * high * (p @ p * np.eye(3) - np.outer(p, p)) + R @ section @ R.T)
    return out


def rates(J, first, times):
    """Angular velocity in the world."""

    def change(_, y):
        w, R = y[:3], y[3:].reshape(3, 3)
        K = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        return np.concatenate([np.linalg.solve(J, np.cross(J @ w, w)), (R @ K).ravel()])

    y = solve_ivp(change, [0, times[-1]], np.concatenate([first, np.eye(3).ravel()]), t_eval=times, rtol=1e-10, atol=1e-10).y
    return np.einsum("ijt,jt->it", y[3:].reshape(3, 3, -1), y[:3])


def told(says):
    found = re.search(r"shear of '\w+' (?:left out: |is left out, but its influence is )([\d.e-]+)", says)
    return float(found.group(1)) if found else 0.0


def beam(length, turned, wide, high, effects):
    r = length / turned if turned else 0.0
    shape = f'axis = {{ x = "{r!r}*sin(u)", y = "{r!r}*(1-cos(u))", to = {turned!r} }}' if turned else f"length = {length!r}"
    section = dict(shape="rectangle", width=wide, height=high)
    return body("b", "beam", shape, f"effects = {json.dumps(effects)}", section=section, material=dict(density=rho, youngs_modulus=E))


def tumbled(folder, length, turned, wide, high, effects, first):
    """By how much the rates are off, of their range, and what the program tells of it."""
    duration = 10 / np.linalg.norm(first)
    text = simulation(duration, output_rate=100 / duration, gravity=[0, 0, 0]) + beam(length, turned, wide, high, effects)
    text += joint("free", "free", "ground", "b.root", initial=dict(rate=list(first))) + output("w", "b.root", "angular_velocity")
    (folder / "s.toml").write_text(text)
    done = run("simulate", folder / "s.toml", "-o", folder / "r.h5", "--csv", folder / "h.csv")
    h = history(folder / "h.csv")
    found, wanted = np.array([h["w." + k] for k in "xyz"]), rates(tensor(length, turned, wide, high), first, np.array(h["t"]))
    return np.abs(found - wanted).max() / np.ptp(wanted, axis=1).max(), done.stdout + done.stderr


with temporary_folder() as name:
    folder = pathlib.Path(name)
    for length, turned, wide, high, effects, first in (
        (1.0, 2.8, 0.25, 0.25, ["torsion", "axial"], (3.0, -2.0, 1.5)),
        (0.5, 1.5, 0.07, 0.07, [], (2.0, 3.0, -1.0)),
        (1.0, 1.0, 0.09, 0.18, ["bending_xz"], (4.0, 0.5, 2.0)),
        (3.0, 0.0, 0.83, 0.83, ["bending_xy", "bending_xz", "torsion", "stiffening"], (-12.6, 1.16, -1.2)),
        (1.0, 0.0, 0.25, 0.08, ["torsion"], (1.0, 2.0, 2.5)),
    ):
        what = f"L/h {length / max(wide, high):.3g}, arc of {turned} rad, {effects}"
        off, says = tumbled(folder, length, turned, wide, high, effects, first)
        said = told(says)
        print(f"{what}: {off:.2g} of its rates off, told {said:.2g}")
        expect(0.7 * off < said < 1.5 * off, f"{what}: {off:.2g} of its rates off, told {said:.2g}")
        expect((off > 0.011) <= ("WARNING" in says), f"{what}: no warning")
        off, _ = tumbled(folder, length, turned, wide, high, [*effects, "shear"], first)
        near(off, 0, 1e-3, f"{what} and shear")

    # A drive takes the moment of the whole inertia.
    length, side = 0.6, 0.15
    text = simulation(1.0, output_rate=50, gravity=[0, 0, 0]) + beam(length, 0.0, side, side, [])
    text += joint("drive", "revolute", "ground", "b.root", axis=[0, 0, 1], motion="t^3")
    (folder / "s.toml").write_text(text + output("r", "drive", "reaction"))
    done = run("simulate", folder / "s.toml", "-o", folder / "r.h5", "--csv", folder / "h.csv")
    wanted = rho * side**2 * length * (length**2 / 3 + side**2 / 12) * 6
    off, said = 1 - history(folder / "h.csv")["r.mz"][-1] / wanted, told(done.stdout + done.stderr)
    print(f"drive of a stubby beam: {off:.2g} of its moment off, told {said:.2g}")
    expect(0.7 * off < said < 1.5 * off, f"drive of a stubby beam: {off:.2g} of its moment off, told {said:.2g}")

finish()
