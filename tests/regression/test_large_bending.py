"""A cantilever under a load that comes at once and stays, in its own frame: large_bending against the equations of third order of a beam
that does not stretch (Crespo da Silva and Glynn 1978), in as many of the clamped beam's modes as the program keeps."""
import math
import pathlib

import numpy as np
from numpy.polynomial import Polynomial
from program import expect, finish, history, near, run, temporary_folder
from scene_text import body, force, ground, joint, output, simulation
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

L, d, E, density = 0.8, 0.01, 7e10, 2700
EI, m = E * math.pi * d**4 / 64, density * math.pi * d**2 / 4
n, places = 4, 60
roots = [brentq(lambda x: math.cos(x) + 1 / math.cosh(x), (k + 0.5) * math.pi - 0.6, (k + 0.5) * math.pi + 0.6) for k in range(n)]
x, weights = (a / 2 for a in np.polynomial.legendre.leggauss(places))
x = x + 0.5


def shape(b, order):
    """A clamped mode's derivative at x; its end moves by 2 or -2."""
    s = (math.sinh(b) - math.sin(b)) / (math.cosh(b) + math.cos(b))
    waves = (np.cosh(b * x), np.sinh(b * x), np.cos(b * x), np.sin(b * x))
    signs = {1: (-s, 1, s, 1), 2: (1, -s, 1, -s)}[order]
    return b**order * sum(a * w for a, w in zip(signs, waves))


slope = np.array([shape(b, 1) for b in roots])
curvature = np.array([shape(b, 2) for b in roots])
tip = 2.0 * (-1.0) ** np.arange(n)
# What the beam shortens by up to x: half of q' B(x) q, integrated as polynomials through the places.
fit = np.polynomial.legendre.Legendre.fit
B = np.array(
    [[(lambda p: p(x) - p(0))(fit(x, slope[i] * slope[j], places - 1, domain=[0, 1]).integ()) for j in range(n)] for i in range(n)]
)
B = np.moveaxis(B, 2, 0)


def moves(load, duration, samples):
    """The end's deflection over L; load: F L^2 / EI; time in sqrt(m L^4 / EI)."""

    def rates(_, y):
        q, v = y[:n], y[n:]
        turned = B @ q
        w1, w2 = q @ slope, q @ curvature
        M = np.eye(n) + np.einsum("i,ia,ib->ab", weights, turned, turned)
        f = load * tip - np.array(roots) ** 4 * q - curvature @ (weights * w2 * w1**2) - slope @ (weights * w2**2 * w1)
        return np.concatenate([v, np.linalg.solve(M, f - turned.T @ (weights * (B @ v @ v)))])

    t = np.linspace(0, duration, samples)
    y = solve_ivp(rates, (0, duration), np.zeros(2 * n), method="DOP853", rtol=1e-9, atol=1e-12, t_eval=t).y
    return tip @ y[:n]


expect(abs((curvature * weights) @ curvature.T - np.diag(np.array(roots) ** 4)).max() < 1e-8 * roots[-1] ** 4, "the modes' stiffness")

with temporary_folder() as name:
    folder = pathlib.Path(name)
    unit = math.sqrt(m * L**4 / EI)
    # The end moves by about such a share of L: what one frame of second order is off by at least, and at most what is of fifth order.
    for share, at_least, at_most in ((0.004, 1e-5, 3e-6), (0.016, 1.5e-4, 5e-6), (0.05, 1.5e-3, 8e-5)):
        load, turns = 1.5 * share, 4.7
        duration = turns * 2 * math.pi / roots[0] ** 2
        truth = moves(load, duration, 201)

        def off(*effects):
            text = simulation(duration * unit, output_rate=200 / duration / unit, gravity=[0, 0, 0])
            words = dict(length=L, section=dict(shape="circle", diameter=d), material=dict(density=density, youngs_modulus=E))
            text += body("b", "beam", effects=effects, elements=48, keep_modes=n, keep_static=False, **words)
            text += joint("w", "weld", "ground", "b") + force("force", "b.tip", direction=[0, 1, 0], value=load * EI / L**2)
            (folder / "s.toml").write_text(text + output("p", "b.tip", "displacement"))
            words = ("--method", "exponential", "--tolerance", "1e-8", "--no-error-estimate", "--no-effect-check")
            run("simulate", folder / "s.toml", "-o", folder / "r.h5", "--csv", folder / "h.csv", *words)
            return max(abs(np.array(history(folder / "h.csv")["p.y"]) / L - truth)) / np.ptp(truth)

        near(off("bending_xy", "stiffening", "large_bending"), 0, at_most, f"bent by {share} of its length: end's deflection")
        expect(off("bending_xy", "stiffening") > at_least, f"bent by {share} of its length: one frame of second order is not off")
finish()
