"""Beams that twist: blades that spin, with the moments that turn their flat sections into the plane of rotation and untwist their fibres,
against the equation of torsion by scipy; what a look at a run without twist tells of what a beam's turned end carries."""
import pathlib
import re

import numpy as np
from program import expect, finish, history, near, run, temporary_folder
from scene_text import body, force, joint, output, simulation
from scipy.integrate import solve_bvp

E, rho, nu = 7e10, 2700.0, 0.3
G = E / (2 * (1 + nu))


def twist(length, section, spin, torque, pitch):
    """Turn of the tip: (G J + N Ip/A) theta' is the moment, d/dx of it rho (Iz - Iy) spin^2 sin(pitch + theta) cos(pitch + theta)."""
    A, iy, iz, J = (section[k] for k in ("area", "iy", "iz", "j"))

    def stiffness(x):
        return G * J + 0.5 * rho * spin**2 * (length**2 - x**2) * (iy + iz)

    found = solve_bvp(
        lambda x, y: np.vstack([y[1] / stiffness(x), 0.5 * rho * (iz - iy) * spin**2 * np.sin(2 * (pitch + y[0]))]),
        lambda a, b: [a[0], b[1] - torque],
        np.linspace(0, length, 50),
        np.zeros((2, 50)),
        tol=1e-9,
    )
    expect(found.success, "the twist is not found")
    return found.y[0, -1]


def blade(folder, effects, length, section, spin, torque, pitch):
    text = simulation(1e-3, output_rate=1000, gravity=[0, 0, 0], start="static", tolerance=1e-8)
    text += joint("hub", "revolute", "ground", "blade.root", axis=[0, 0, 1], motion=f"{spin} * t")
    material = dict(density=rho, youngs_modulus=E, poisson=nu)
    text += body(
        "blade", "beam", f"effects = {effects}", length=length, section=dict(shape="general", angle=pitch, **section), material=material
    )
    text += force("torque", "blade.tip", direction=[1, 0, 0], value=torque, frame="body")
    text += output("twist", "blade.tip", "rotation", relative_to="blade.root")
    (folder / "s.toml").write_text(text)
    done = run("simulate", folder / "s.toml", "-o", folder / "r.h5", "--csv", folder / "h.csv")
    return history(folder / "h.csv")["twist.x"][0], done.stdout + done.stderr


def told(says, effect):
    found = re.search(rf"{effect} of '\w+' (?:left out: |is left out, but its influence is )([\d.e-]+)", says)
    return float(found.group(1)) if found else 0.0


with temporary_folder() as name:
    folder = pathlib.Path(name)
    bends = '"bending_xy", "bending_xz", "torsion", "stiffening"'
    for wide, thick, length, spin, pitch in (
        (0.05, 0.005, 0.5, 300.0, 0.0),
        (0.03, 0.006, 0.8, 150.0, 0.4),
        (0.004, 0.06, 0.4, 500.0, 0.7),
    ):
        # wide: along y, in the plane of rotation or across it
        a, b = max(wide, thick), min(wide, thick)
        J = 0.312 * a * b**3
        section = dict(area=wide * thick, iy=wide * thick**3 / 12, iz=thick * wide**3 / 12, j=J, shear_y=5 / 6, shear_z=5 / 6)
        torque = 0.05 * G * J / length
        wanted = twist(length, section, spin, torque, pitch)
        lists = (('"auto"', 5e-3), (f'[{bends}, "shear"]', 1e-4), (f"[{bends}]", 1e-4), ('["torsion", "stiffening"]', 1e-4))
        for effects, within in lists:
            name = f"{wide} x {thick}, {effects}"
            near(blade(folder, effects, length, section, spin, torque, pitch)[0], wanted, within * abs(wanted), name)
        without, says = blade(folder, '["torsion"]', length, section, spin, torque, pitch)
        off, said = abs(without / wanted - 1), told(says, "stiffening")
        expect(0.5 * off < said < 3 * off, f"{wide} x {thick} whose fibres do not untwist: {off:.2g} off, told {said:.2g}")

    # An arm across the end of a beam that is not let twist.
    text = simulation(1.0, output_rate=100, gravity=[0, 0, 0])
    section, material = dict(shape="rectangle", width=0.02, height=0.01), dict(density=7800.0, youngs_modulus=2.1e11, poisson=0.3)
    text += joint("clamp", "weld", "ground", "beam.root")
    text += body("beam", "beam", 'effects = ["bending_xy", "bending_xz"]', length=1.0, section=section, material=material)
    text += body("arm", "rigid", mass=1.0, inertia=[1e-3] * 3, centre_of_mass=[0, 0.3, 0]) + joint("hold", "weld", "beam.tip", "arm")
    text += (
        force("force", "arm", direction=[0, 0, 1], value="20*sin(6*t)")
        + output("turn", "arm", "rotation")
        + output("place", "arm", "position")
    )
    (folder / "s.toml").write_text(text)
    done = run("simulate", folder / "s.toml", "-o", folder / "r.h5")
    said = told(done.stdout + done.stderr, "torsion")
    expect(said > 0.3, f"twist of a beam that carries an arm: told {said:.2g}, the turn of the arm is all of it")
finish()
