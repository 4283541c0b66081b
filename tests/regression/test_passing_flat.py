"""Parallelograms whose coupler bends pass the place where all bars lie in line: its length has to give there, which automatic effects see
once the run has ended without it; the truth by energy, as the bars are stiff. What is driven beyond its reach is refused as before, though
a coupler that is pulled apart could follow."""

import math

from program import expect, history, near, run, run_parts
from scene_text import body, joint, output, rigid, simulation

a, d, m, M, g = 0.2, 0.5, 0.8, 2.0, 9.81  # crank, coupler (m); a crank's mass, a load on the coupler's middle (kg)
steel = dict(density=7850, youngs_modulus=2.0e11, poisson=0.3)
h = 0.008
coupler_mass = steel["density"] * h * h * d


def bar(name, length):
    J = m * length**2 / 12
    return rigid(name, mass=m, inertia=[J, J, J], centre_of_mass=[length / 2, 0, 0], frames={"tip": [length, 0, 0]})


def parallelogram(start):
    section = dict(shape="rectangle", height=h, width=h)
    return (
        simulation(0.5, output_rate=400, gravity=[0, -g, 0])
        + bar("crank", a)
        + body(
            "coupler",
            "beam",
            length=d,
            section=section,
            material=steel,
            frames={"middle": 0.5, "third": 1 / 3},
            damping=dict(stiffness=1e-4),
        )
        + rigid("load", mass=M, inertia=[1e-3, 1e-3, 1e-3])
        + bar("rocker", a)
        + bar("third", a)
        + joint("A", "revolute", "ground", "crank", initial=dict(value=start))
        + joint("B", "revolute", "crank.tip", "coupler.root", initial=dict(guess=-start))
        + joint("D", "revolute", "ground", "rocker", position=[d, 0, 0], initial=dict(guess=start))
        + joint("C", "revolute", "coupler.tip", "rocker.tip", initial=dict(guess=start))
        + joint("K", "revolute", "ground", "third", position=[d / 3, 0, 0], initial=dict(guess=start))
        + joint("L", "revolute", "coupler.third", "third.tip", initial=dict(guess=start))
        + joint("grip", "weld", "coupler.middle", "load")
        + output("angle", "A", "value")
        + output("rate", "A", "rate")
    )


def check_passing(folder):
    start = 2.6
    (folder / "p.toml").write_text(parallelogram(start))
    done = run("simulate", folder / "p.toml", "--csv", folder / "p.csv")
    h = history(folder / "p.csv")
    expect("axial of 'coupler' switched on: without it the motion ended (joint" in done.stdout, "no word of what went on")
    expect(max(h["angle"]) > 1.4 * math.pi, f"it comes to {max(h['angle']):.3g} rad only")
    J, weight = m * a * a + (M + coupler_mass) * a * a, (1.5 * m + M + coupler_mass) * a * g
    rate = [math.sqrt(2 * weight * max(0.0, math.sin(start) - math.sin(x)) / J) for x in h["angle"]]
    off = max(abs(abs(w) - v) for w, v in zip(h["rate"], rate)) / max(rate)
    near(off, 0.0, 0.015, "rate by energy")


def check_reach(folder):
    """A crank that would have to pull the coupler apart."""
    section = dict(shape="rectangle", height=0.01, width=0.01)
    (folder / "r.toml").write_text(
        simulation(1.0, output_rate=200)
        + bar("crank", 0.3)
        + body("coupler", "beam", length=0.5, section=section, material=steel)
        + bar("rocker", 0.3)
        + joint("A", "revolute", "ground", "crank", motion="1.0+3*t")
        + joint("B", "revolute", "crank.tip", "coupler.root", initial=dict(guess=-0.5))
        + joint("D", "revolute", "ground", "rocker", position=[0.6, 0, 0], initial=dict(guess=1.5))
        + joint("C", "revolute", "coupler.tip", "rocker.tip", initial=dict(guess=1.0))
        + output("p", "coupler.tip", "position")
    )
    done = run("simulate", folder / "r.toml", "--csv", folder / "r.csv", code=1)
    expect("limit of its reach" in done.stderr and "t = 0.37559" in done.stderr, f"beyond its reach: {done.stderr.strip()[-300:]}")


run_parts(check_passing, check_reach)
