"""Text of scenes from numbers, and what a scene is to this suite."""
import math
from dataclasses import dataclass, field
from typing import Callable

from scene_text import joint, output  # noqa: F401 - output for whoever imports from here
from truths.formulas import of_rectangles, torsion_rectangle

MATERIALS = [
    {"E": 2.1e11, "rho": 7850.0, "poisson": 0.3},
    {"E": 7e10, "rho": 2700.0, "poisson": 0.33},
    {"E": 3e9, "rho": 1200.0, "poisson": 0.38},
    {"E": 1e9, "rho": 5540.0, "poisson": 0.3},
    {"E": 1.1e11, "rho": 4430.0, "poisson": 0.31},
]


@dataclass
class Scene:
    """A scene's text, its truth: times -> {output: array (times, components)}, or the text of a richer scene whose run is the truth.

    scales: what an error of an output is measured against; without one the range of the true output, as the program measures.
    words: options of the program; truth_words: of the richer run; confirm_words: of another one that has to agree with it
    before an error is called one. divided: the richer scene with several volumes a beam, the truth where beams of the other one bend
    further than one frame can follow.
    claim: asked accuracy, None for the default of 1 % and five times the printed estimate.
    sizes_only: signs are not compared.
    """

    text: str
    truth: Callable | str
    scales: dict = field(default_factory=dict)
    what: str = ""
    words: tuple = ()
    truth_words: tuple = ()
    confirm_words: tuple = ()
    divided: str = ""
    claim: float | None = None
    sizes_only: bool = False
    kind: str = ""
    number: int = 0


def pick(r, *choices):
    return choices[r.randrange(len(choices))]


def by_chance(r, *choices):
    """The text of the first (below, text) that a number from 0 to 1 lies below; `text` may be a function of r."""
    chance = r.random()
    text = next(text for below, text in choices if chance < below)
    return text(r) if callable(text) else text


def material(m):
    return f"{{ density = {m['rho']!r}, youngs_modulus = {m['E']!r}, poisson = {m['poisson']!r} }}"


def section_of(r, shape, height, width=None):
    """A section as the scene writes it and its numbers; shear factors 5/6, 6/7 and for thin walls the web's share."""
    w = width or height * r.uniform(0.5, 2)
    if shape == "circle":
        A, i = math.pi * height**2 / 4, math.pi * height**4 / 64
        return {
            "text": f'{{ shape = "circle", diameter = {height!r} }}',
            "area": A,
            "iy": i,
            "iz": i,
            "j": 2 * i,
            "shear_y": 6 / 7,
            "shear_z": 6 / 7,
        }
    if shape == "rectangle":
        return {
            "text": f'{{ shape = "rectangle", height = {height!r}, width = {w!r} }}',
            "area": height * w,
            "iy": height * w**3 / 12,
            "iz": w * height**3 / 12,
            "j": torsion_rectangle(w, height),
            "shear_y": 5 / 6,
            "shear_z": 5 / 6,
        }
    if shape == "tube":
        t = height * r.uniform(0.05, 0.2)
        d = height - 2 * t
        i, A, q = math.pi * (height**4 - d**4) / 64, math.pi * (height**2 - d**2) / 4, d / height
        k = 6 * (1 + q * q) ** 2 / (7 * (1 + q * q) ** 2 + 20 * q * q)  # Cowper 1966, hollow circle, poisson 0
        return {
            "text": f'{{ shape = "tube", outer_diameter = {height!r}, thickness = {t!r} }}',
            "area": A,
            "iy": i,
            "iz": i,
            "j": 2 * i,
            "shear_y": k,
            "shear_z": k,
        }
    if shape == "box":
        t = min(height, w) * r.uniform(0.03, 0.06)
        A, iy, iz, _, _ = of_rectangles(
            [
                (height / 2 - t / 2, 0, t, w),
                (t / 2 - height / 2, 0, t, w),
                (0, w / 2 - t / 2, height - 2 * t, t),
                (0, t / 2 - w / 2, height - 2 * t, t),
            ]
        )
        a, b = height - t, w - t
        # Bredt's closed cell, and the walls' own share.
        j = 2 * t * (a * b) ** 2 / (a + b) + 2 * (a + b) * t**3 / 3
        return {
            "text": f'{{ shape = "box", height = {height!r}, width = {w!r}, thickness = {t!r} }}',
            "area": A,
            "iy": iy,
            "iz": iz,
            "j": j,
            "shear_y": 2 * t * height / A,
            "shear_z": 2 * t * w / A,
        }
    # Numbers alone: what the scene says is what holds.
    A, iz, iy = height * w, w * height**3 / 12 * r.uniform(1, 2), height * w**3 / 12 * r.uniform(1, 2)
    j, ky, kz = r.uniform(0.2, 0.9) * (iy + iz), r.uniform(0.3, 0.9), r.uniform(0.3, 0.9)
    return {
        "text": f'{{ shape = "general", area = {A!r}, iy = {iy!r}, iz = {iz!r}, j = {j!r}, shear_y = {ky!r}, shear_z = {kz!r} }}',
        "area": A,
        "iy": iy,
        "iz": iz,
        "j": j,
        "shear_y": ky,
        "shear_z": kz,
    }


def sizes(r, slender=(5, 50), shapes=("rectangle", "rectangle", "circle", "tube", "general")):
    """Length, material and section of a random beam."""
    L = 10 ** r.uniform(-1, 1)
    shape = pick(r, *shapes)
    height = L / math.exp(r.uniform(math.log(slender[0]), math.log(slender[1])))
    s = section_of(r, shape, height)
    s["shape"], s["height"] = shape, height
    return L, pick(r, *MATERIALS), s


def simulation(duration, rate, gravity=(0, 0, 0), **more):
    lines = "".join(f'{k} = "{v}"\n' if isinstance(v, str) else f"{k} = {v!r}\n" for k, v in more.items())
    return (
        f"[simulation]\nduration = {float(duration)!r}\noutput_rate = {float(rate)!r}\ngravity = {[float(g) for g in gravity]}\n{lines}\n"
    )


def rigid(name, mass, inertia, frames=None, centre=(0, 0, 0)):
    points = ", ".join(f"{k} = {[float(x) for x in v]}" for k, v in (frames or {}).items())
    return (
        f'[[body]]\nname = "{name}"\nkind = "rigid"\nmass = {float(mass)!r}\ninertia = {[float(i) for i in inertia]}\n'
        f"centre_of_mass = {[float(c) for c in centre]}\nframes = {{ {points} }}\n\n"
    )


def beam(name, length, section, m, more=""):
    return f'[[body]]\nname = "{name}"\nkind = "beam"\nlength = {length!r}\nsection = {section}\nmaterial = {material(m)}\n{more}\n\n'


def weld(name, parent, child, more=""):
    return joint(name, "weld", parent, child, more)


def force(kind, on, value, direction, more=""):
    value = f'"{value}"' if isinstance(value, str) else repr(float(value))
    return f'[[force]]\nkind = "{kind}"\non = "{on}"\ndirection = {[float(d) for d in direction]}\nvalue = {value}\n{more}\n\n'


def spring(on, start, stiffness, damping=0.0, rest=0.0, preload=0.0):
    return (
        f'[[force]]\nkind = "spring-damper"\non = "{on}"\nfrom = "{start}"\n'
        f"stiffness = {float(stiffness)!r}\ndamping = {float(damping)!r}\n"
        f"rest = {float(rest)!r}\npreload = {float(preload)!r}\n\n"
    )
