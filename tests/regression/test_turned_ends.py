"""How the sections of a beam turn that bends and twists, to second order: what it carries at its end goes by it. A torque acts on its
middle, a force on the end of a bracket at its tip. The truth is the rod of Kirchhoff under dead loads, integrated by scipy."""

import math

import numpy as np
from program import *
from scipy.integrate import solve_ivp

E, NU, L, D, ARM = 7e10, 0.3, 1.0, 0.02, 0.5
I = math.pi * D**4 / 64
EI, GJ = E * I, E / 2 / (1 + NU) * 2 * I


def skew(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def rod(force, torque):
    """The far end of a bracket on the rod's tip, ahead of it by ARM, where the force (y) acts; the torque (x) on the middle."""
    F = np.array([0, force, 0.0])
    far = np.array([L + ARM, 0, 0.0])
    for _ in range(60):

        def rates(_, y, torque):
            r, R = y[:3], y[3:].reshape(3, 3)
            m = R.T @ ([torque, 0, 0] + np.cross(far - r, F))
            return np.concatenate([R[:, 0], (R @ skew(m / [GJ, EI, EI])).ravel()])

        y = np.concatenate([np.zeros(3), np.eye(3).ravel()])
        for M in (torque, 0.0):
            y = solve_ivp(rates, (0, L / 2), y, rtol=1e-11, atol=1e-13, args=(M,)).y[:, -1]
        new = y[:3] + ARM * y[3:].reshape(3, 3)[:, 0]
        if np.abs(new - far).max() < 1e-13:
            break
        far = new
    return far


with temporary_folder() as name:
    folder = pathlib.Path(name)

    def bent(twist, model):
        """Error of the bracket's end over its way."""
        force, torque = 0.02 * EI / L**2, 2 * twist * GJ / L
        (folder / "rod.toml").write_text(
            '[simulation]\nduration = 1e-3\noutput_rate = 2000\nstart = "static"\n'
            f'[[body]]\nname = "rod"\nkind = "beam"\nlength = {L}\nsection = {{ shape = "circle", diameter = {D} }}\n{model}\n'
            f"material = {{ density = 2700, youngs_modulus = {E}, poisson = {NU} }}\nframes = {{ middle = 0.5 }}\n"
            f'[[body]]\nname = "bracket"\nkind = "rigid"\nmass = 0.01\ninertia = [1e-6, 1e-5, 1e-5]\nframes = {{ far = [{ARM}, 0, 0] }}\n'
            '[[joint]]\nname = "clamp"\nkind = "weld"\nparent = "ground"\nchild = "rod.root"\n'
            '[[joint]]\nname = "seat"\nkind = "weld"\nparent = "rod.tip"\nchild = "bracket"\n'
            f'[[force]]\nkind = "force"\non = "bracket.far"\ndirection = [0, 1, 0]\nvalue = {force!r}\n'
            f'[[force]]\nkind = "torque"\non = "rod.middle"\ndirection = [1, 0, 0]\nvalue = {torque!r}\n'
            '[[output]]\nname = "far"\nof = "bracket.far"\nquantity = "position"\n'
        )
        run("simulate", folder / "rod.toml", "-o", folder / "r.h5", "--csv", folder / "r.csv", "--quiet")
        columns, true = history(folder / "r.csv"), rod(force, torque)
        got = np.array([columns["far." + c][0] for c in "xyz"])
        error = np.abs(got - true)[1:].max() / np.abs(true[1:]).max()
        print(f"twisted by {twist}, {model}: {error:.2g} of its way off, {got} {true}")
        return error

    for twist, most in ((0.02, 2e-5), (0.25, 2e-4)):
        for model in ("elements = 6", "elements = 12\nkeep_modes = 6", 'model = "mixed"\nvolumes = 4\nelements = 2'):
            error = bent(twist, model)
            expect(error < most, f"a rod twisted by {twist}, {model}, is {error:.2g} off")

finish()
