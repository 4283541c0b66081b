"""What a damped beam goes without is told by the phase that its vibrations lose while they last, not over the whole run: a four-bar of many
turns whose coupler is damped, without shear, beside the same with shear."""

import json
import re

from program import expect, history, run, run_parts
from scene_text import body, joint, output, rigid, simulation

beam = dict(
    length=0.4,
    section=dict(shape="rectangle", height=0.03, width=0.02),
    material=dict(density=2700, youngs_modulus=7e10, poisson=0.3),
    damping=dict(stiffness=1e-4),
)


def rigid_link(name, length, mass):
    J = mass * length**2 / 12
    return rigid(name, mass=mass, inertia=[J, J, J], centre_of_mass=[length / 2, 0, 0], frames={"tip": [length, 0, 0]})


def four_bar(effects):
    return (
        simulation(1.5, output_rate=400)
        + rigid_link("crank", 0.1, 0.2)
        + body("b", "beam", effects=effects, **beam)
        + rigid_link("rocker", 0.3, 0.5)
        + joint("A", "revolute", "ground", "crank", motion="1.0 + 60*t - 6*sin(10*t)")
        + joint("B", "revolute", "crank.tip", "b.root", initial=dict(guess=-0.6))
        + joint("D", "revolute", "ground", "rocker", position=[0.4, 0, 0], initial=dict(guess=1.4))
        + joint("C", "revolute", "b.tip", "rocker.tip", initial=dict(guess=1.0))
        + output("tip", "b.tip", "position", relative_to="b.root")
    )


def check_shear(folder):
    tips = []
    for name, effects in (("without", ["bending_xy", "stiffening"]), ("with", ["bending_xy", "stiffening", "shear"])):
        (folder / f"{name}.toml").write_text(four_bar(effects))
        done = run("simulate", folder / f"{name}.toml", "--csv", folder / f"{name}.csv", "--json")
        tips.append(history(folder / f"{name}.csv")["tip.y"])
        if name == "without":
            said = json.loads(done.stdout)["simulation"]
    found = [
        re.match(r"shear of 'b' (?:is left out, but its influence is|left out:) ([0-9.e+-]+)", w) for w in said["warnings"] + said["notes"]
    ]
    told = max([float(f[1]) for f in found if f], default=0.0)
    true = max(abs(x - y) for x, y in zip(*tips)) / (max(tips[1]) - min(tips[1]))
    print(f"shear: told {told:.2g}, true {true:.2g}")
    expect(0.5 * true <= told <= 8 * true, f"shear of a damped beam: told {told:.2g}, true {true:.2g}")


run_parts(check_shear)
