"""Lumped beams: what few links lack is measured beside half or twice as many of them, and the shear that they cannot have beside finite
elements, not guessed from how fast the beam goes to and fro.

The truth: the same beam of twenty finite elements at a tighter tolerance, another model (its errors are hundreds of times smaller)."""

import json
import math

import numpy as np
from program import expect, finish, history, pathlib, run, temporary_folder
from scene_text import body, force, joint, output, rigid, simulation

E, rho, side = 2.1e11, 7850.0, 0.01


def beam(L, **words):
    w1 = math.pi**2 / L**2 * math.sqrt(E * side**2 / 12 / rho)
    section = dict(shape="rectangle", width=side, height=side)
    material = dict(density=rho, youngs_modulus=E, poisson=0.3)
    return body("rod", "beam", length=L, section=section, material=material, damping=dict(stiffness=0.04 / w1), **words)


def crank(**words):
    """A slider-crank that runs up smoothly: its rod bends as its mass asks, which five links show well."""
    a, L, speed, until = 0.08, 0.4, 40.0, 0.06
    turn = f"1 + {speed}*(t < {until} ? t*t/(2*{until}) + (cos(2*pi*t/{until}) - 1)*{until}/(4*pi*pi) : t - {until / 2})"
    lean = math.asin(-a * math.sin(1.0) / L)
    return (
        simulation(0.24, output_rate=600, gravity=[0, 0, 0])
        + rigid("crank", mass=1.0, inertia=[0.01, 0.01, 0.02], frames=dict(end=[a, 0, 0]))
        + beam(L, **words)
        + rigid("ram", mass=0.7, inertia=[0.01, 0.01, 0.02])
        + joint("shaft", "revolute", "ground", "crank", motion=turn)
        + joint("pin", "revolute", "crank.end", "rod.root", initial=dict(value=lean - 1.0))
        + joint("wrist", "revolute", "rod.tip", "ram", initial=dict(value=-lean))
        + joint("guide", "prismatic", "ground", "ram", axis=[1, 0, 0], initial=dict(value=a * math.cos(1.0) + L * math.cos(lean)))
        + output("x", "guide", "value")
        + output("F", "rod", "section_force", at=0.45)
    )


def clamp(L=1.0, **words):
    T = 0.7 * L**2
    F = 0.07 * 3 * E * side**4 / 12 / L**2
    return (
        simulation(T, output_rate=140 / T, gravity=[0, 0, 0])
        + beam(L, **words)
        + joint("seat", "weld", "ground", "rod.root")
        + force("force", "rod.tip", name="push", direction=[0, 1, 0], value=f"{F}*(t < {T / 2} ? (1 - cos(2*pi*t/{T}))/2 : 1)")
        + output("tip", "rod.tip", "position")
    )


def strip(**words):
    """Between two hinges, at rest under its weight: its length is held, and eight links sag 1.2 % less."""
    return (
        simulation(0.1, output_rate=20, gravity=[0, -9.81, 0], start="static")
        + beam(1.0, frames=dict(mid=0.5), **words).replace(f"width = {side}, height = {side}", "width = 0.02, height = 0.001")
        + joint("left", "revolute", "ground", "rod.root")
        + joint("right", "revolute", "ground", "rod.tip", position=[1.0, 0, 0])
        + output("mid", "rod.mid", "position")
    )


def made(folder, text, *words):
    scene = pathlib.Path(folder) / "scene.toml"
    scene.write_text(text)
    done = run("simulate", scene, "--json", "--csv", scene.with_suffix(".csv"), *words)
    rows = {column: np.array(values) for column, values in history(scene.with_suffix(".csv")).items()}
    return rows, [str(w) for w in json.loads(done.stdout)["simulation"]["warnings"]]


def off(few, truth, columns):
    return max(abs(few[c] - truth[c]).max() for c in columns) / max(np.ptp(truth[c]) for c in columns)


with temporary_folder() as folder:
    links = dict(model="lumped")
    few, said = made(folder, crank(elements=5, **links))
    truth, _ = made(folder, crank(elements=20), "--tolerance", "1e-8", "--no-effect-check")
    for columns in (["x"], ["F.N", "F.Vy"], ["F.Mz"]):
        expect(off(few, truth, columns) < 2e-3, f"five links of a rod: {columns[0]} is {off(few, truth, columns):.2g} off")
    expect(not any("elements" in w for w in said), f"five links of a rod are blamed: {said}")

    few, said = made(folder, clamp(elements=4, **links))
    truth, _ = made(folder, clamp(elements=20), "--tolerance", "1e-8", "--no-effect-check")
    error = off(few, truth, ["tip.x", "tip.y"])
    blamed = [w for w in said if "its 4 elements are too few for how it moves" in w]
    expect(error > 0.012 and len(blamed) == 1, f"four links of a clamp: {error:.2g} off, {said}")
    told = float(blamed[0].split("changes by ")[1].split()[0]) if blamed else 0.0
    expect(0.5 < told / error < 1.5, f"four links of a clamp: {told} told of {error:.2g}")

    few, said = made(folder, strip(elements=8, **links))
    truth, _ = made(folder, strip(elements=20))
    error = abs(few["mid.y"][0] / truth["mid.y"][0] - 1)
    blamed = [w for w in said if "its 8 elements are too few for how it moves" in w]
    expect(0.008 < error < 0.016 and len(blamed) == 1, f"eight links of a held strip: {error:.2g} off, {said}")

    # Shear, which lumped beams cannot have: measured between finite elements without and with it.
    few, said = made(folder, clamp(L=0.1, elements=24, **links))
    truth, _ = made(folder, clamp(L=0.1, elements=24, effects=["auto", "shear"]), "--tolerance", "1e-8", "--no-effect-check")
    error = off(few, truth, ["tip.x", "tip.y"])
    lacking = [w for w in said if "shear of 'rod' is left out" in w]
    told = float(lacking[0].split("influence is ")[1].split()[0]) if lacking else 0.0
    expect(error > 0.008 and 0.7 < told / error < 1.4, f"shear of a stubby clamp: {told} told of {error:.2g}, {said}")

finish()
