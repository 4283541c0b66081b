"""Scenes of the hard cases, as TOML text made from a few numbers."""
import math

from scene_text import joint, output


def simulation(duration, rate=100.0, gravity=(0, 0, 0), tolerance=1e-6, more=""):
    return f"[simulation]\nduration = {duration!r}\noutput_rate = {rate!r}\ngravity = {list(gravity)}\ntolerance = {tolerance!r}\n{more}\n"


def rigid(name, mass, inertia=(0, 0, 0), centre=(0, 0, 0), frames=None):
    points = ", ".join(f"{k} = {list(v)}" for k, v in (frames or {}).items())
    return (
        f'[[body]]\nname = "{name}"\nkind = "rigid"\nmass = {mass!r}\ninertia = {list(inertia)}\n'
        f"centre_of_mass = {list(centre)}\nframes = {{ {points} }}\n"
    )


def slender(mass, length):
    """Inertia of a rod along x, 1 % thick."""
    return (mass * (0.01 * length) ** 2 / 6, mass * length**2 / 12, mass * length**2 / 12)


def bar(name, length, mass):
    """A slender rigid rod along x from its own frame to 'end'."""
    return rigid(name, mass, slender(mass, length), (length / 2, 0, 0), {"end": (length, 0, 0), "middle": (length / 2, 0, 0)})


def beam(name, length, section, material, more=""):
    return f'[[body]]\nname = "{name}"\nkind = "beam"\nlength = {length!r}\nsection = {section}\nmaterial = {material}\n{more}\n'


def force(kind, on, value, direction=(0, 0, 1), more=""):
    return f'[[force]]\nkind = "{kind}"\non = "{on}"\ndirection = {list(direction)}\nvalue = "{value}"\n{more}\n'


def energies():
    return output("energy", "system", "energy") + output("kinetic", "system", "kinetic") + output("strain", "system", "strain")


steel = "{ density = 7800.0, youngs_modulus = 2.1e11 }"


def circle(diameter):
    return f'{{ shape = "circle", diameter = {diameter!r} }}'


def rotation(v):
    """Rotation matrix (rows) of a rotation vector."""
    a = math.sqrt(sum(c * c for c in v))
    x, y, z = (c / a for c in v) if a > 0 else (1, 0, 0)
    c, s, k = math.cos(a), math.sin(a), 1 - math.cos(a)
    return [
        [c + x * x * k, x * y * k - z * s, x * z * k + y * s],
        [y * x * k + z * s, c + y * y * k, y * z * k - x * s],
        [z * x * k - y * s, z * y * k + x * s, c + z * z * k],
    ]
