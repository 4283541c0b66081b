"""Stress where bending, pull, twist and shear force meet."""
import math

import numpy as np
from cases.case import case
from cases.common import E, STEEL, out, still
from scene import Scene, beam, force, simulation, weld


@case("stress near the tip of round consoles, where the shear force and a torque make it: Saint-Venant, both rims")
def shear_in_round_sections():
    L, F, T = 1.0, 3.0, 0.02
    for D, d, poisson, at in ((0.05, 0.0, 0.3, 0.97), (0.05, 0.036, 0.3, 0.97), (0.05, 0.036, 0.0, 0.99), (0.05, 0.046, 0.3, 0.6)):
        R, r, A, I = D / 2, d / 2, math.pi * (D * D - d * d) / 4, math.pi * (D**4 - d**4) / 64
        text = f'{{ shape = "tube", outer_diameter = {D}, thickness = {(D - d) / 2!r} }}'
        if not d:
            text = f'{{ shape = "circle", diameter = {D} }}'
        worst = 0.0
        for near, far in ((R, r), (r, R)) if d else ((R, 0.0),):
            flank = F / (4 * (1 + poisson) * I) * ((1 + 2 * poisson) * near**2 + (3 + 2 * poisson) * far**2)
            for a in np.linspace(0, 2 * math.pi, 721):
                sigma = F * L * (1 - at) * near / I * math.cos(a)
                worst = max(worst, math.hypot(sigma, math.sqrt(3) * (T * near / (2 * I) + flank * math.sin(a))))
        if not d:
            worst = max(worst, math.sqrt(3) * F / A * (3 + 2 * poisson) / (2 * (1 + poisson)))
        yield Scene(
            simulation(0.01, 100, start="static")
            + beam("rod", L, text, {**STEEL, "poisson": poisson})
            + weld("wall", "ground", "rod")
            + force("force", "rod.tip", F, (0, 1, 0))
            + force("torque", "rod.tip", T, (1, 0, 0))
            + out("s", "rod", "stress", f"at = {at}"),
            still(s=[worst]),
            {"s": worst},
            f"bore {d}, at {at}",
        )


@case("stress where bending, pull and twist meet: rectangle and tube at several places")
def combined_stresses():
    L = 0.8
    h, b = 0.04, 0.02
    F, N = 150.0, 4000.0
    iz = b * h**3 / 12
    for at in (0.0, 0.25, 0.6):
        pulled = math.sqrt(N / (E * iz))  # the pull takes part of the moment
        true = F * math.sinh(pulled * (1 - at) * L) / (pulled * math.cosh(pulled * L)) * h / 2 / iz + N / (b * h)
        yield Scene(
            simulation(0.01, 100, start="static")
            + beam("rod", L, f'{{ shape = "rectangle", height = {h}, width = {b} }}', STEEL)
            + weld("wall", "ground", "rod")
            + force("force", "rod.tip", F, (0, 1, 0))
            + force("force", "rod.tip", N, (1, 0, 0))
            + f'[[output]]\nname = "s"\nof = "rod"\nquantity = "stress"\nat = {at}\n\n',
            still(s=[true]),
            {"s": true},
            f"rectangle, bent and pulled, at {at}",
        )
        D, t = 0.05, 0.004
        i = math.pi * (D**4 - (D - 2 * t) ** 4) / 64
        T = 120.0
        bent, twist = F * (1 - at) * L * D / 2 / i, T * D / 2 / (2 * i)
        true = math.sqrt(bent**2 + 3 * twist**2)
        yield Scene(
            simulation(0.01, 100, start="static")
            + beam("rod", L, f'{{ shape = "tube", outer_diameter = {D}, thickness = {t} }}', STEEL)
            + weld("wall", "ground", "rod")
            + force("force", "rod.tip", F, (0, 1, 0))
            + force("torque", "rod.tip", T, (1, 0, 0))
            + f'[[output]]\nname = "s"\nof = "rod"\nquantity = "stress"\nat = {at}\n\n',
            still(s=[true]),
            {"s": true},
            f"tube, bent and twisted, at {at}",
        )
