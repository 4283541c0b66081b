"""Beams that ring: a span whose weight comes at once, a clamp whose load does, nothing asked. Forces hold the square of the wave number
where deflections hold its fifth power, and more elements tell what ten of them lack; sums of modes for the truth (numpy)."""

import json
import math

import numpy as np
from program import expect, finish, history, pathlib, run, temporary_folder
from scene_text import body, joint, output, simulation

L, E, rho, side, g = 3.0, 2.1e11, 7850.0, 0.03, 9.81
EI, mass = E * side**4 / 12, rho * side**2


def beam(**words):
    return body(
        "span",
        "beam",
        length=L,
        section=dict(shape="rectangle", width=side, height=side),
        material=dict(density=rho, youngs_modulus=E, poisson=0.3),
        **words,
    )


def span(more="", **words):
    return (
        simulation(0.3, output_rate=1000, gravity=[0, -g, 0])
        + (f"{more}\n" if more else "")
        + beam(effects=["bending_xy"], **words)
        + joint("left", "revolute", "ground", "span.root")
        + joint("right", "point-on-line", "ground", "span.tip", axis=[1, 0, 0], position=[L, 0, 0])
        + output("hold", "left", "reaction")
        + output("mid", "span.mid", "position")
    )


def support(t):
    """Of a support: every odd mode takes up the rest of the weight that it carries, 4 m g L / (k pi)^2."""
    k = np.arange(1, 4000, 2)
    w = (k * math.pi / L) ** 2 * math.sqrt(EI / mass)
    return mass * g * L * (0.5 - np.cos(np.outer(t, w)) @ (4 / (k * math.pi) ** 2))


def made(folder, name, text, *words):
    scene = pathlib.Path(folder) / f"{name}.toml"
    scene.write_text(text)
    done = run("simulate", scene, "--json", "--csv", scene.with_suffix(".csv"), *words)
    rows = {column: np.array(values) for column, values in history(scene.with_suffix(".csv")).items()}
    return rows, [w for w in json.loads(done.stdout)["simulation"]["warnings"] if "elements" in str(w)]


with temporary_folder() as folder:
    frames = dict(frames=dict(mid=0.5))
    for name, words in (
        ("ten", {}),
        ("twenty", dict(elements=20)),
        ("lumped", dict(model="lumped", elements=20)),
        ("mixed", dict(model="mixed", volumes=4, elements=2)),
        ("kept", dict(keep_modes=12)),
        ("modal", dict(model="modal", boundary="supported-supported", modes=dict(bending_xy=[1, 2, 3, 4, 5]))),
    ):
        rows, said = made(folder, name, span(**frames, **words))
        true = support(rows["t"])
        error = abs(rows["hold.y"] - true).max() / np.ptp(true)
        expect(error > 0.011 and said, f"{name}: {error:.3g} of the force, {said}")
    rows, said = made(folder, "asked", span(**frames), "--accuracy", "0.01")
    true = support(rows["t"])
    error = abs(rows["hold.y"] - true).max() / np.ptp(true)
    expect(error < 0.01 and not said, f"asked: {error:.3g}, {said}")
    # Where the force is not read nothing is lacking, and nothing said.
    rows, said = made(folder, "place", span(**frames).replace('name = "hold"', 'name = "turn"').replace('"reaction"', '"value"'))
    expect(not said, f"place: {said}")
    # The same at rest from the start, and with damping that leaves the first sample: a clamp holds its first element's weight.
    rows, said = made(folder, "static", span(**frames).replace("[simulation]\n", '[simulation]\nstart = "static"\n'))
    expect(not said and abs(rows["hold.y"] - mass * g * L / 2).max() < 1e-6 * mass * g * L, f"static: {said}")
    clamp = (
        simulation(0.6, output_rate=500, gravity=[0, -g, 0])
        + beam(effects=["bending_xy"], damping=dict(ratio=0.05))
        + joint("left", "weld", "ground", "span.root")
        + output("hold", "left", "reaction")
    )
    rows, said = made(folder, "clamp", clamp)
    expect(rows["hold.y"][0] > 0.01 * np.ptp(rows["hold.y"]) and said, f"clamp: {rows['hold.y'][0]:.3g} N at t = 0, {said}")
    rows, said = made(folder, "forty", clamp.replace("effects = ", "elements = 40\neffects = "))
    expect(rows["hold.y"][0] < 0.005 * np.ptp(rows["hold.y"]) and not said, f"forty: {rows['hold.y'][0]:.3g} N at t = 0, {said}")

finish()
