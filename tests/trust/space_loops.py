"""Elastic loops in space that are let go:  space_loops.py FLEXFRAME [--count N] [--seed S] [--number N] [--keep FOLDER]

A driven crank, a rod on a universal and a spherical joint, a rocker; all three elastic, with a few modes each and now and then damping, and
let go undeformed, so that they ring. Run as the program does by itself. The truth are runs by two methods at tight tolerances that agree.
Kept: every output, reactions too, is within 1.2 % of its range, or a warning tells a fifth of what is true at least. Exit 1 if not.
"""
import collections
import json
import math
import pathlib
import subprocess
import sys

import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from arguments import judge_each, suite_parser  # noqa: E402
from scene_text import body, ground, joint, output, simulation  # noqa: E402

# Explicit steps follow the fastest vibrations, which reactions at the crank show, to 4e-3 at 1e-10.
TRUTHS = (("--method", "erk", "--tolerance", "1e-10"), ("--method", "exponential", "--tolerance", "1e-8"))
KEPT, UNSURE, MARGIN = 0.012, 6e-3, 5.0
Loop = collections.namedtuple("Loop", "text what", defaults=["let go"])
EFFECTS = ["bending_xy", "bending_xz", "torsion", "stiffening"]  # listed: all runs have the same
STEEL = dict(density=7850, youngs_modulus=2.1e11)


def axes(first, second):
    """Columns: along `first`, across it towards `second`, across both."""
    x = first / np.linalg.norm(first)
    y = second - x * (x @ second)
    y /= np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])


def closed(D, radius, plane, at, B, length):
    """The rocker's angle beside `at` at which its end is `length` from B, and how well the rod moves it there; None beyond its reach."""
    for _ in range(30):
        C = D + radius * (plane[:, 0] * math.cos(at) + plane[:, 1] * math.sin(at))
        way = plane[:, 1] * math.cos(at) - plane[:, 0] * math.sin(at)
        slope = 2 * radius * (C - B) @ way
        if abs(slope) < 1e-9:
            return None
        at -= float(np.clip(((C - B) @ (C - B) - length**2) / slope, -0.2, 0.2))
    C = D + radius * (plane[:, 0] * math.cos(at) + plane[:, 1] * math.sin(at))
    return (at, abs((C - B) @ way) / length) if abs(np.linalg.norm(C - B) - length) < 1e-9 else None


def loop(r):
    """Scene of a random loop that reaches all of its way."""
    while True:
        crank, start, swing, duration = r.uniform(0.1, 0.18), r.uniform(0, 2 * math.pi), r.uniform(0.5, 1.2), r.uniform(0.4, 0.7)
        tip = lambda turn, a=crank, s=start: a * np.array([math.cos(s + turn), math.sin(s + turn), 0.0])
        D = np.array([r.uniform(0.3, 0.5), r.uniform(-0.1, 0.1), r.uniform(-0.15, 0.15)])
        hinge = np.array([r.uniform(-0.7, 0.7), r.uniform(-0.7, 0.7), 1.0])
        rocker, angle = r.uniform(0.3, 0.4), r.uniform(-0.4, 0.4)
        hinge /= np.linalg.norm(hinge)
        plane = axes(np.cross(np.cross(hinge, [0.0, 1.0, 0.0]), hinge), np.cross(hinge, [0.0, 1.0, 0.0]))
        B, C = tip(0), D + rocker * (plane[:, 0] * math.cos(angle) + plane[:, 1] * math.sin(angle))
        length, at = float(np.linalg.norm(C - B)), angle
        for turn in np.linspace(0, swing, 50):
            found = closed(D, rocker, plane, at, tip(turn), length)
            if found is None or found[1] < 0.35:
                break
            at = found[0]
        else:
            break
    up = np.array([0.0, 0.0, 1.0])
    # Joints turn about z; the universal one about z and x, both across the rod.
    turns, swings = axes(B, np.cross(up, B)), axes(C - D, np.cross(hinge, C - D))
    rod = axes(C - B, up)[:, [1, 0, 2]] * [1, -1, 1]
    keep, damping = r.randint(1, 3), r.choice([None, 2e-5])

    def beam(name, a, b, frames):
        own = axes(b - a, up)
        words = dict(length=float(np.linalg.norm(b - a)), material=STEEL, keep_modes=keep, effects=EFFECTS)
        if damping:
            words["damping"] = dict(stiffness=damping)
        sides = dict(shape="rectangle", width=r.uniform(0.006, 0.015), height=r.uniform(0.006, 0.015))
        places = {n: dict(at=x, rotation=dict(matrix=(own.T @ R).tolist())) for n, (x, R) in frames.items()}
        return body(name, "beam", section=sides, frames={**places, "m": dict(at=0.5)}, **words)

    return (
        simulation(duration, output_rate=300, gravity=[0, 0, -9.81])
        + ground(g0=dict(rotation=dict(matrix=turns.tolist())), g1=dict(position=D.tolist(), rotation=dict(matrix=swings.tolist())))
        + beam("crank", np.zeros(3), B, {"f0": (0.0, turns), "f1": (1.0, rod)})
        + beam("rod", B, C, {"f0": (0.0, rod), "f1": (1.0, rod)})
        + beam("rocker", D, C, {"f0": (0.0, swings), "f1": (1.0, rod)})
        + joint("J0", "revolute", "ground.g0", "crank.f0", motion=f"{swing}*(1-cos(pi*t/{duration}))/2")
        + joint("J1", "universal", "crank.f1", "rod.f0")
        + joint("J3", "revolute", "ground.g1", "rocker.f0")
        + joint("J2", "spherical", "rocker.f1", "rod.f1")
        + output("rod", "rod.m", "position")
        + output("rocker", "rocker.m", "position")
        + output("J0", "J0", "reaction")
        + output("J3", "J3", "reaction")
    )


def simulated(program, scene, *words, limit):
    """Columns of its outputs as vectors {name: samples x components}, and the summary; None where it takes too long."""
    table = scene.with_suffix(".csv")
    try:
        done = subprocess.run([program, "simulate", scene, "--csv", table, "--json", *words], capture_output=True, text=True, timeout=limit)
    except subprocess.TimeoutExpired:
        return None
    if done.returncode:
        raise ValueError(done.stderr.strip().splitlines()[-1])
    names = next(line for line in table.read_text().splitlines() if not line.startswith("#")).split(",")
    rows = np.genfromtxt(table, delimiter=",", comments="#", skip_header=1)
    vectors = {}
    for k, name in enumerate(names[1:], 1):
        vectors.setdefault((name.split(".")[0], ".m" in name), []).append(rows[:, k])
    return {n: np.column_stack(v) for n, v in vectors.items()}, json.loads(done.stdout)["simulation"]


def apart(a, b):
    """The largest difference of a vector's components over the largest of their ranges."""
    return max(float(np.abs(a[n] - b[n]).max() / np.ptp(b[n], axis=0).max()) for n in b)


def judge(program, sample, folder, r):
    scene = folder / "loop.toml"
    scene.write_text(sample.text)
    alone = ("--no-error-estimate", "--no-effect-check")
    truths = [simulated(program, scene, *words, *alone, limit=300) for words in TRUTHS]
    if None in truths or apart(truths[0][0], truths[1][0]) > UNSURE:
        return "open", "no truth"
    run = simulated(program, scene, limit=120)
    if run is None:
        return "open", "more than 120 s"
    off, summary = apart(run[0], truths[1][0]), run[1]
    told = summary["error_estimate"]["relative"]
    words = f"{off:.1e} off, told {told:.1e}, {summary['method']}, {summary['tolerance']:.0e}, {summary['cpu_seconds']:.1f} CPU s"
    if off <= KEPT:
        return "right", words
    warned = any("time integration" in w for w in summary["warnings"])
    return ("warned" if warned and off <= MARGIN * told else "silent"), words


judge_each(suite_parser(__doc__, "number", "keep", count=6).parse_args(), "space loops", lambda r, number: Loop(loop(r)), judge)
