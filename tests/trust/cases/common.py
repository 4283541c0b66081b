"""What several files of cases use."""
import math

import numpy as np
from scene import MATERIALS, output
from scipy.linalg import eigh
from truths.formulas import ode


STEEL = MATERIALS[0]


E, RHO, G = STEEL["E"], STEEL["rho"], STEEL["E"] / 2.6


def circle(d):
    return f'{{ shape = "circle", diameter = {d!r} }}', math.pi * d * d / 4, math.pi * d**4 / 64


def after_a_step(M, K, f, t):
    """M u'' + K u = f from rest, in closed form."""
    squares, modes = eigh(K, M)
    return (1 - np.cos(np.outer(t, np.sqrt(squares)))) @ (modes.T @ f / squares * modes).T


def still(**values):
    return lambda t: {k: np.tile(np.asarray(v, float).reshape(1, -1), (len(t), 1)) for k, v in values.items()}


def size(v):
    return lambda b: np.linalg.norm(b, axis=1).max()


SIZE = size(0)


g = 9.81


TINY = (1e-12,) * 3


def out(name, of, quantity, more=""):
    return output(name, of, quantity).rstrip() + "\n" + more + "\n\n"


def lagrange(mass, rest, y0, t, rtol=1e-11):
    """q and its rates of mass(q) q'' = rest(q, q')."""
    n = len(y0) // 2
    return ode(lambda s, y: np.r_[y[n:], np.linalg.solve(mass(y[:n]), rest(y[:n], y[n:], s))], y0, t, rtol=rtol)
