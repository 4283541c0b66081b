"""Beams that ring, nothing asked: loads that come at once or in a ramp on thin rods, what holds them and what they hold inside.

The truths are sums of 1500 modes (Euler, Bernoulli) and d'Alembert's waves."""
import math

import numpy as np
from scene import MATERIALS, Scene, beam, force, joint, output, pick, simulation, weld

MODES = 1500


def clamped_roots():
    """Of cos b cosh b = -1"""
    b = np.array([1.87510406871196, 4.69409113297417] + [(k + 0.5) * math.pi for k in range(2, MODES)])
    for _ in range(3):
        e = np.exp(-b)
        b -= (np.cos(b) + 2 * e / (1 + e * e)) / (-np.sin(b) - 2 * e * (1 - e * e) / (1 + e * e) ** 2)
    return b


class Clamped:
    """Modes of a cantilever of length 1, of mean square 1: shapes at a place, their second and third derivative at the root"""

    def __init__(self):
        self.b = clamped_roots()
        e = np.exp(-self.b)
        below = 1 + e * e + 2 * e * np.cos(self.b)
        self.curved, self.growing = (1 - e * e - 2 * e * np.sin(self.b)) / below, e * (e + np.sin(self.b) + np.cos(self.b)) / below
        self.mean = 2 * self.curved / self.b

    def at(self, x):
        y = self.b * x
        growing = np.where(y < 700, self.growing * np.exp(np.minimum(y, 700.0)), 0.0)
        return growing + (1 + self.curved) / 2 * np.exp(-y) - np.cos(y) + self.curved * np.sin(y)

    def bent(self, x):
        assert x == 0
        return 2 * self.b**2, -2 * self.curved * self.b**3


class Span:
    """The same of a beam between two supports, at any place"""

    def __init__(self):
        self.b = np.arange(1, MODES + 1) * math.pi
        self.mean = math.sqrt(2) * (1 - np.cos(self.b)) / self.b

    def at(self, x):
        return math.sqrt(2) * np.sin(self.b * x)

    def bent(self, x):
        return -self.b**2 * self.at(x), -math.sqrt(2) * self.b**3 * np.cos(self.b * x)


def at_rest(held, place, x):
    """EI w'' and EI w''' (of P L and P; L = 1) of a force 1 at a place, or along the whole beam (None)"""
    if held == "clamped":
        if place is None:
            return (1 - x) ** 2 / 2, -(1 - x)
        return (place - x, -1.0) if x < place else (0.0, 0.0)
    if place is None:
        return -x * (1 - x) / 2, -(0.5 - x)
    return (-x * (1 - place), -(1 - place)) if x < place else (-place * (1 - x), place)


def jerked_beam(r):
    """A thin cantilever or span whose weight or force comes at once: reaction, section force or stress"""
    L, m = 10 ** r.uniform(-1, 1), pick(r, *MATERIALS)
    d = L / r.uniform(60, 200)
    EI, mass = m["E"] * math.pi * d**4 / 64, m["rho"] * math.pi * d**2 / 4
    held, load, read = pick(r, "clamped", "span"), pick(r, "weight", "force"), pick(r, "reaction", "section", "stress")
    zeta = 0.0 if read == "stress" else pick(r, 0.0, 0.0, 0.01, 0.05)
    modes = Clamped() if held == "clamped" else Span()
    place = None if load == "weight" else 1.0 if held == "clamped" and r.random() < 0.5 else r.uniform(0.2, 0.9)
    looked = 0.4 if read == "stress" and held == "span" else 0.0
    w = modes.b**2 * math.sqrt(EI / mass) / L**2
    P = 3e-4 * EI / L**2
    duration = 2 * math.pi / w[0] * r.uniform(0.5, 5)
    sign = -1 if load == "weight" else 1
    more = 'effects = ["bending_xy"]'
    if zeta:
        more += f"\ndamping = {{ ratio = {zeta} }}"
    if place not in (None, 1.0):
        more += f"\nframes = {{ at = {place!r} }}"
    text = simulation(duration, pick(r, 100, 200, 400) / duration, (0, -P / (mass * L) if load == "weight" else 0, 0))
    text += beam("rod", L, f'{{ shape = "circle", diameter = {d!r} }}', m, more)
    if held == "clamped":
        text += weld("left", "ground", "rod.root")
    else:
        text += joint("left", "revolute", "ground", "rod.root")
        text += joint("right", "point-on-line", "ground", "rod.tip", f"axis = [1, 0, 0]\nposition = [{L!r}, 0, 0]")
    if load == "force":
        text += force("force", "rod.tip" if place == 1.0 else "rod.at", P, (0, 1, 0))
    if read == "reaction":
        text += output("holds", "left", "reaction")
    elif read == "section":
        text += output("inside", "rod", "section_force", "at = 0")
    else:
        text += output("stress", "rod", "stress", f"at = {looked}")

    def truth(t):
        moved = (modes.mean if place is None else modes.at(place)) / modes.b**4
        turned = np.outer(t, w * math.sqrt(1 - zeta**2))
        rest = np.exp(-zeta * np.outer(t, w)) * (np.cos(turned) - zeta / math.sqrt(1 - zeta**2) * np.sin(turned))
        second, third = modes.bent(looked)
        M, V = at_rest(held, place, looked)
        M, V = sign * P * L * (M - rest @ (moved * second)), sign * P * (V - rest @ (moved * third))
        zero, none = np.zeros(len(t)), np.full(len(t), np.nan)  # none: a hinge's moment
        if read == "reaction":
            return {"holds": np.column_stack([zero, V, zero, zero, zero, -M if held == "clamped" else none])}
        if read == "section":
            return {"inside": np.column_stack([zero, -V, zero, zero, zero, M if held == "clamped" else none])}
        return {"stress": np.abs(M)[:, None] * 32 / math.pi / d**3}

    return Scene(text, truth, what=f"{held}, {load}, {read}, {duration * w[0] / 6.283:.2g} periods, damping {zeta}")


def jerked_line(r):
    """A rod pulled or twisted at its end by a load that rises in a ramp: its clamp's force or moment"""
    L, m = 10 ** r.uniform(-1, 1), pick(r, *MATERIALS)
    d, shear = L / r.uniform(20, 200), m["E"] / (2 * (1 + m["poisson"]))
    pulled = r.random() < 0.5
    c = math.sqrt((m["E"] if pulled else shear) / m["rho"])
    ramp, duration = L / c * 10 ** r.uniform(-1.5, 2), 4 * L / c * r.uniform(1, 4)
    P = 1e-5 * m["E"] * math.pi * d**2 / 4 if pulled else 1e-3 * shear * math.pi * d**4 / 32 / L
    model = pick(r, "", "", "elements = 20", f"keep_modes = {r.randint(3, 10)}", 'model = "lumped"\nelements = 20')
    model = pick(r, model, model, model, 'model = "mixed"\nvolumes = 4\nelements = 3')
    effects = 'effects = ["axial"]\n' if pulled else 'effects = ["torsion", "stiffening"]\n'
    text = simulation(duration, pick(r, 100, 200, 400) / duration)
    text += beam("rod", L, f'{{ shape = "circle", diameter = {d!r} }}', m, effects + model) + weld("clamp", "ground", "rod.root")
    text += force("force" if pulled else "torque", "rod.tip", f"{P!r} * min(1, t / {ramp!r})", (1, 0, 0))
    text += output("holds", "clamp", "reaction")

    def truth(t):
        # Every wave comes back from the tip with its sign, from the clamp with the opposite.
        passed = sum(2 * (-1) ** k * np.clip((t - (2 * k + 1) * L / c) / ramp, 0, 1) for k in range(20))
        held = np.full((len(t), 6), np.nan)  # a twisted rod pulls a little
        held[:, 0 if pulled else 3] = -P * passed
        return {"holds": held}

    what = f"{'pulled' if pulled else 'twisted'} in {ramp * c / L:.2g} L/c, {duration * c / L:.2g} L/c; {model!r}"
    return Scene(text, truth, what=what)


KINDS = [jerked_beam, jerked_line]
