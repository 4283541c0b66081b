"""Shafts on which all acts along and about their axes: automatic effects go without bending, which nothing excites, and a run takes a
fraction of the time; the truth by finite elements of torsion (numpy). What bends after all, and shafts near to where they bend by
themselves, keep it. Forces that are nothing but rounding ask for nothing."""

import json

import numpy as np
from program import expect, finish, history, near, pathlib, run, temporary_folder
from scene_text import body, force, joint, output, rigid, simulation
from scipy.linalg import eigh

E, rho, nu, L, d = 2.1e11, 7850.0, 0.3, 0.8, 0.03
G, Ip = E / (2 * (1 + nu)), np.pi * d**4 / 32
DISC, LOAD, TORQUE = 0.02, 0.05, 20.0
along = dict(axis=[1, 0, 0])


def shaft(name, **words):
    return body(
        name, "beam", length=L, section=dict(shape="circle", diameter=d), material=dict(density=rho, youngs_modulus=E, poisson=nu), **words
    )


def drive(centre=(0, 0, 0), bearing="cylindrical", gravity=(0, 0, 0), torque=TORQUE, effects="auto", **words):
    """A disc in a bearing, a shaft, a load in another bearing; the torque on the disc."""
    return (
        simulation(0.05, output_rate=4000, gravity=list(gravity), **words)
        + rigid("disc", mass=5.0, inertia=[DISC, 0.011, 0.011])
        + rigid("load", mass=8.0, inertia=[LOAD, 0.03, 0.03], centre_of_mass=list(centre))
        + shaft("s", effects=effects)
        + joint("b", "revolute", "ground", "disc", **along)
        + joint("w", "weld", "disc", "s.root")
        + joint("v", "weld", "s.tip", "load")
        + joint("c", bearing, "ground", "load", position=[L, 0, 0], **along)
        + force("torque", "disc", value=torque, direction=[1, 0, 0])
        + output("a", "b", "value")
        + output("w", "load", "angular_velocity")
    )


def truth(t):
    """Angle of the disc and rate of the load, n linear elements of torsion."""
    n = 40
    h = L / n
    M, K = np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1))
    for e in range(n):
        M[e : e + 2, e : e + 2] += rho * Ip * h / 6 * np.array([[2, 1], [1, 2]])
        K[e : e + 2, e : e + 2] += G * Ip / h * np.array([[1, -1], [-1, 1]])
    M[0, 0] += DISC
    M[n, n] += LOAD
    squares, phi = eigh(K, M)
    p = phi[0] * TORQUE
    q, rate = np.empty((len(t), n + 1)), np.empty((len(t), n + 1))
    q[:, 0], rate[:, 0] = p[0] * t**2 / 2, p[0] * t
    w = np.sqrt(squares[1:])
    q[:, 1:] = p[1:] / w**2 * (1 - np.cos(np.outer(t, w)))
    rate[:, 1:] = p[1:] / w * np.sin(np.outer(t, w))
    return q @ phi[0], rate @ phi[n]


with temporary_folder() as name:
    folder = pathlib.Path(name)

    def result(text, *words):
        (folder / "s.toml").write_text(text)
        done = json.loads(run("simulate", folder / "s.toml", "-o", folder / "r.h5", "--csv", folder / "h.csv", "--json", *words).stdout)
        return done["simulation"], history(folder / "h.csv")

    def notes(text, *words):
        (folder / "s.toml").write_text(text)
        done = run("simulate", folder / "s.toml", "-o", folder / "r.h5", *words)
        return done.stdout + done.stderr

    off, on = "bending_xy and bending_xz off", "bending_xy and bending_xz on"
    for words in ({}, {"accuracy": 1e-2}, {"gravity": [0, -9.81, 0]}):
        got, columns = result(drive(**words))
        t = np.array(columns["t"])
        angle, rate = truth(t)
        near(np.abs(np.array(columns["a"]) - angle).max(), 0, 2e-3 * np.ptp(angle), f"angle, {words}")
        near(np.abs(np.array(columns["w.x"]) - rate).max(), 0, 1.5e-2 * np.ptp(rate), f"rate, {words}")
        expect(not got["warnings"], f"{words}: {got['warnings']}")
    expect(off in notes(drive()), "bending that nothing excites is on")
    expect(off in notes(drive(gravity=[0, -9.81, 0])), "bending by weight that outputs do not tell is on")

    # What does bend it: a load beside the axis, weight where it is seen.
    def overhung(**words):
        """The load in no bearing, the shaft of three elements."""
        parts = drive(**words).replace('kind = "beam"', 'kind = "beam"\nelements = 3').split('[[joint]]\nname = "c"')
        return parts[0] + parts[1][parts[1].index("[[force]]") :]

    check = ("--no-error-estimate",)
    expect(on in notes(overhung(centre=[0, 1e-3, 0]), *check), "a load beside the axis does not bend the shaft")
    driven = overhung(centre=[0, 1e-5, 0]).replace('kind = "revolute"', 'kind = "revolute"\nmotion = "2e4 * t^3"')
    says = notes(driven, *check)
    expect(on in says and "switched on" not in says, f"a load beside the axis of a driven shaft is found after a run only: {says}")
    weighed = overhung(gravity=[0, -9.81, 0]) + output("m", "b", "reaction")
    expect(on in notes(weighed, *check), "weight that a reaction tells does not bend the shaft")
    # What comes later, and a shaft that turns faster than it bends: the motion tells.
    one = overhung() + output("p", "load", "position")
    says = notes(one + force("force", "load", value="t > 0.02 && t < 0.021 ? 100 : 0", direction=[0, 1, 0]), *check)
    expect("bending_xy of 's' switched on" in says and on in says, f"a force that comes and goes: {says}")
    says = notes(one.replace('kind = "revolute"', 'kind = "revolute"\ninitial = { rate = 500 }'), *check)
    expect("bending of 's' switched on: what turns, presses or twists it" in says and on in says, f"a fast shaft: {says}")

    # A moment about an axis that turns freely is rounding, and none that errors are measured against.
    text = drive(effects=["torsion", "axial"], accuracy=1e-2) + output("m", "b", "reaction")
    text += force("torque", "load", value="-6 * tanh(90 * t)", direction=[1, 0, 0])
    got, columns = result(text)
    told = got["error_estimate"]
    expect(told["column"] != "m.mx" and told["relative"] < 1e-2, f"rounding is taken for an output: {told}")
    expect(not got["warnings"], f"rounding is warned of: {got['warnings']}")

finish()
