"""What effects left out are told to be worth against what they are:  left_out.py FLEXFRAME [--count N] [--seed S] [--only NAME]

Random slider-cranks, four-bars, pendulums, arms and slider-cranks with a soft rod. In each scene one effect after the other is left out by
hand; the run without it says what that is worth, and a run with it, everything else the same, shows it. Kept: no less is told than half of
what is true, and a true influence beyond 1 % is a warning. Exit 1 if not.

  --table FILE    replaces the table in a Markdown page, between the markers 'left out' and 'end left out'
"""
import math
import pathlib
import random
import re
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from arguments import suite_parser  # noqa: E402
from run_trust import ESTIMATES, Program, compare  # noqa: E402
from scene import Scene, beam, force, joint, output, pick, rigid, simulation, sizes, weld  # noqa: E402

DEFORMATIONS = ("axial", "bending_xy", "bending_xz", "torsion", "stiffening", "shear")
MISSED, LOUD = 2.0, 0.01


def listed(names):
    return "[" + ", ".join(f'"{n}"' for n in names) + "]"


def slider_crank(r):
    """Slider-crank with elastic rod and crank."""
    L, m, s = sizes(r, slender=(12, 40), shapes=("rectangle", "circle"))
    a = L / r.uniform(1.6, 5)
    w1 = math.pi**2 / L**2 * math.sqrt(m["E"] * s["iz"] / (m["rho"] * s["area"]))
    rod = m["rho"] * s["area"] * L
    slider = rod * 10 ** r.uniform(-1.5, 1.2)
    driven = r.random() < 0.5
    speed = w1 / 10 ** r.uniform(0.3, 1.4)
    duration = 2 * math.pi / speed * 1.2
    J = rod * a * a
    torque = 0.3 * J * speed**2
    T = 0.5 * duration
    motion = f'motion = "{speed!r} * (t < {T!r} ? t/2 - {T!r}/(2*pi)*sin(pi*t/{T!r}) : t - {T!r}/2)"'

    def make(effects):
        return (
            simulation(duration, 300 / duration)
            + beam("crank", a, s["text"], m, f"elements = 3\neffects = {effects}")
            + beam("rod", L, s["text"], m, f"elements = 8\neffects = {effects}\nframes = {{ mid = 0.5 }}")
            + rigid("slider", slider, (slider * a * a * 0.1,) * 3)
            + joint("shaft", "revolute", "ground", "crank.root", motion if driven else f"initial = {{ rate = {0.2 * speed!r} }}")
            + joint("pin", "revolute", "crank.tip", "rod.root")
            + joint("wrist", "revolute", "rod.tip", "slider")
            + joint("guide", "prismatic", "ground", "slider", "axis = [1, 0, 0]")
            + ("" if driven else force("torque", "crank.root", f"{torque!r} * (1 - exp(-t/{0.1 * duration!r}))", (0, 0, 1)))
            + output("x", "slider", "position")
            + output("mid", "rod.mid", "displacement")
            + output("v", "slider", "velocity")
            + output("N", "wrist", "reaction")
        )

    return make, ("axial", "stiffening", "shear"), f"slider-crank, {'driven' if driven else 'by a torque'}"


def four_bar(r):
    """Four-bar with elastic coupler."""
    L, m, s = sizes(r, slender=(12, 40), shapes=("rectangle", "circle"))
    a, b, d = L * r.uniform(0.25, 0.4), L * r.uniform(0.7, 1.0), L * r.uniform(0.9, 1.1)
    if a + max(L, b, d) > 0.95 * (L + b + d - max(L, b, d)):
        return None
    w1 = math.pi**2 / L**2 * math.sqrt(m["E"] * s["iz"] / (m["rho"] * s["area"]))
    speed = w1 / 10 ** r.uniform(0.4, 1.3)
    rod = m["rho"] * s["area"] * L
    load = rod * 10 ** r.uniform(-1, 1)
    duration = 2 * math.pi / speed * 1.2
    p0 = r.uniform(0.4, 2.5)
    ax, ay = a * math.cos(p0), a * math.sin(p0)
    D = math.hypot(d - ax, ay)
    base = math.atan2(-ay, d - ax)
    th = base + math.acos((L * L + D * D - b * b) / (2 * L * D))
    px, py = ax + L * math.cos(th), ay + L * math.sin(th)
    ps = math.atan2(py, px - d)
    T = 0.5 * duration
    motion = f'motion = "{p0!r} + {speed!r} * (t < {T!r} ? t/2 - {T!r}/(2*pi)*sin(pi*t/{T!r}) : t - {T!r}/2)"'

    def make(effects):
        return (
            simulation(duration, 300 / duration)
            + rigid("crank", rod, (rod * a * a,) * 3, {"end": (a, 0, 0)})
            + beam("coupler", L, s["text"], m, f"elements = 8\neffects = {effects}\nframes = {{ mid = 0.5 }}")
            + rigid("rocker", load, (load * b * b / 12,) * 3, {"end": (b, 0, 0)}, centre=(b / 2, 0, 0))
            + joint("shaft", "revolute", "ground", "crank", motion)
            + joint("pin", "revolute", "crank.end", "coupler.root", f"rotation = [0, 0, {th - p0!r}]")
            + joint("hinge", "revolute", "ground", "rocker", f"position = [{d!r}, 0, 0]\nrotation = [0, 0, {ps!r}]")
            + joint("top", "revolute", "rocker.end", "coupler.tip", f"rotation = [0, 0, {th - ps!r}]")
            + output("q", "hinge", "value")
            + output("mid", "coupler.mid", "displacement")
            + output("tip", "coupler.tip", "velocity")
            + output("M", "shaft", "reaction")
        )

    return make, ("axial", "stiffening", "shear"), "four-bar"


def pendulum(r):
    """Elastic pendulum with a mass at its end, in the plane or with the mass beside it."""
    L, m, s = sizes(r, slender=(8, 60), shapes=("rectangle", "circle"))
    droop = 10 ** r.uniform(-3.5, -1.7)
    EI, rhoA = m["E"] * s["iz"], m["rho"] * s["area"]
    load = rhoA * L * 10 ** r.uniform(-1.5, 0.5)
    g = droop * EI / (L**3 * (rhoA / 8 + load / 3 / L)) / L * L
    start = r.uniform(-1.2, 0.4)
    beside = pick(r, 0.0, L * r.uniform(0.03, 0.2))
    duration = 2 * math.pi * math.sqrt(2 * L / (3 * g)) * r.uniform(0.3, 0.8)

    def make(effects):
        return (
            simulation(duration, 300 / duration, (0, -g, 0))
            + beam("rod", L, s["text"], m, f"elements = 6\neffects = {effects}\nframes = {{ mid = 0.5 }}")
            + rigid("bob", load, (load * 0.01 * L * L,) * 3, centre=(0, 0, beside))
            + joint("pivot", "revolute", "ground", "rod.root", f"initial = {{ value = {start!r} }}")
            + weld("grip", "rod.tip", "bob")
            + output("tip", "rod.tip", "position")
            + output("mid", "rod.mid", "displacement")
            + output("F", "pivot", "reaction")
        )

    left = ("axial", "stiffening", "shear") + (("torsion", "bending_xz") if beside else ())
    return make, left, f"pendulum{', mass beside its plane' if beside else ''}"


def spun_arm(r):
    """Arm with a tip mass, spun up and stopped by a motor."""
    L, m, s = sizes(r, slender=(8, 40), shapes=("rectangle", "circle", "tube"))
    rhoA = m["rho"] * s["area"]
    mass = rhoA * L * 10 ** r.uniform(-1, 0.5)
    w1 = 3.516 / L**2 * math.sqrt(m["E"] * s["iz"] / rhoA) / math.sqrt(1 + 4 * mass / (rhoA * L))
    T = 2 * math.pi / w1 * r.uniform(1, 4)
    A = r.uniform(0.05, 2)
    motion = f"t < {T!r} ? {A!r} * (t/{T!r} - sin(2*pi*t/{T!r})/(2*pi)) : {A!r}"
    duration = 1.5 * T
    beside = pick(r, 0.0, L * r.uniform(0.03, 0.2))

    def make(effects):
        return (
            simulation(duration, 300 / duration)
            + beam("arm", L, s["text"], m, f"elements = 6\neffects = {effects}")
            + rigid("load", mass, (mass * 0.01 * L * L,) * 3, {"p": (0, 0, beside)}, centre=(0, 0, beside))
            + joint("drive", "revolute", "ground", "arm.root", f'motion = "{motion}"')
            + weld("grip", "arm.tip", "load")
            + output("tip", "arm.tip", "displacement")
            + output("p", "load.p", "velocity")
            + output("M", "drive", "reaction")
        )

    left = ("axial", "stiffening", "shear") + (("torsion", "bending_xz") if beside else ())
    return make, left, f"driven arm{', load beside its plane' if beside else ''}"


def stiff_crank(r):
    """Slider-crank with a softer rod that stretches and vibrates, what is left out being the crank's alone."""
    L, m, s = sizes(r, slender=(12, 40), shapes=("rectangle", "circle"))
    a = L / r.uniform(1.6, 4)
    w1 = math.pi**2 / L**2 * math.sqrt(m["E"] * s["iz"] / (m["rho"] * s["area"]))
    stiffer = dict(m, E=m["E"] * 10 ** r.uniform(0.3, 1.5))
    rod = m["rho"] * s["area"] * L
    slider = rod * 10 ** r.uniform(-3, 0)
    speed = w1 / 10 ** r.uniform(0.5, 1.2)
    duration = 2 * math.pi / speed * r.uniform(1.5, 3)
    torque = 0.3 * rod * a * a * speed**2
    rich = listed(("axial", "bending_xy", "stiffening", "shear"))

    def make(effects):
        return (
            simulation(duration, 300 / duration)
            + beam("crank", a, s["text"], stiffer, f"elements = 3\neffects = {effects}")
            + beam("rod", L, s["text"], m, f"elements = 6\neffects = {rich}\nframes = {{ mid = 0.5 }}")
            + rigid("slider", slider, (slider * a * a * 0.1,) * 3)
            + joint("shaft", "revolute", "ground", "crank.root", f"initial = {{ rate = {0.2 * speed!r} }}")
            + joint("pin", "revolute", "crank.tip", "rod.root")
            + joint("wrist", "revolute", "rod.tip", "slider")
            + joint("guide", "prismatic", "ground", "slider", "axis = [1, 0, 0]")
            + force("torque", "crank.root", f"t < {0.4 * duration!r} ? {torque!r} * (1 - exp(-t/{0.1 * duration!r})) : 0", (0, 0, 1))
            + output("x", "slider", "position")
            + output("mid", "rod.mid", "displacement")
            + output("end", "rod.tip", "displacement")
        )

    return make, ("axial", "stiffening", "shear"), "slider-crank, effects of its crank"


FAMILIES = (slider_crank, four_bar, pendulum, spun_arm, stiff_crank)
WORDS = ("--tolerance", "1e-8")


def told_by(summary, effect):
    """What the run says the effect is worth, and whether it warns of it; None where it says nothing."""
    best = None
    for key, loud in (("warnings", True), ("notes", False)):
        for line in summary["simulation"][key]:
            if not re.match(rf"{effect} of '", line):
                continue
            number = re.search(r"(?:influence is|left out: (?:at most )?)\s*([0-9.e+-]+) of the range of (.*?)(?::|$)", line)
            if number and (best is None or float(number[1]) > best[0]):
                best = (float(number[1]), loud, number[2])
            elif best is None and ("no influence" in line or "below" in line):
                small = re.search(r"below the ([0-9.e+-]+)", line)
                best = (float(small[1]) if small else 0.0, loud, "-")
    return best


def main():
    parser = suite_parser(__doc__, "number", "table", "keep", count=36)
    parser.add_argument("--only")
    args = parser.parse_args()
    rows, bad = {}, 0
    with tempfile.TemporaryDirectory(prefix="flexframe_left_out_") as folder:
        program = Program(args.program, folder, 60)
        for i in range(args.count):
            family, number = FAMILIES[i % len(FAMILIES)], i // len(FAMILIES)
            if args.only and family.__name__ != args.only or args.number is not None and number != args.number:
                continue
            made = None
            for attempt in range(100):
                made = made or family(random.Random(f"{args.seed} {family.__name__} {number} {attempt}"))
            make, effects, what = made
            every = [e for e in DEFORMATIONS if e in effects or e == "bending_xy"]
            code, said, rich, _, _ = program.run(make(listed(every)), (*WORDS, "--no-error-estimate", "--no-effect-check"))
            if code != 0:
                print(f"refused  {family.__name__} {number}: {said.strip()[-150:]}")
                continue
            for effect in effects:
                text = make(listed([e for e in every if e != effect]))
                code, summary, poor, _, _ = program.run(text, WORDS)
                if code != 0:
                    print(f"refused  {family.__name__} {number} {effect}: {summary.strip()[-150:]}")
                    continue
                true, where = 0.0, ""
                for name, values in rich.items():
                    parts = [slice(0, 3)] + ([slice(3, 6)] if values.shape[1] == 6 else [])
                    for part in parts:
                        if np.ptp(values[:, part], axis=0).max() < 1e-6 * abs(values).max():
                            continue  # stands still but for rounding
                        error, _ = compare(Scene("", "", {}), {name: poor[name][:, part]}, {name: values[:, part]})
                        if error > true:
                            true, where = error, name
                told = told_by(summary, effect)
                worth, loud, column = told or (0.0, False, "-")
                # What either run may err by in time is not the effect's.
                noise = (summary["simulation"].get("error_estimate") or {}).get("relative") or 0.0
                late = any("time integration" in line for line in summary["simulation"]["warnings"])
                true = max(0.0, true - ESTIMATES * noise)
                missed = true > 1e-4 and true > MISSED * worth and not loud
                silent = true > LOUD and not loud
                wrong = (missed and true > LOUD / 10 or silent) and not late
                bad += wrong
                rows.setdefault((family, effect), []).append((worth, true, loud, wrong))
                verdict = "WRONG" if wrong else "low" if missed else "right"
                print(
                    f"{verdict:8} {family.__name__} {number} {effect}: told {worth:.2g} of {column}{' (warning)' if loud else ''},"
                    f" true {true:.2g} of {where} (time {noise:.1g}{' warned' if late else ''}); {what}",
                    flush=True,
                )
                if wrong and args.keep:
                    args.keep.mkdir(exist_ok=True)
                    (args.keep / f"{family.__name__}_{number}_{effect}.toml").write_text(text)
                    (args.keep / f"{family.__name__}_{number}_rich.toml").write_text(make(listed(every)))
    print(f"{sum(len(v) for v in rows.values())} effects left out, {bad} told wrongly")
    if args.table:
        lines = [
            "| mechanism | effect | cases | told / true, least, median, largest (where true is above 1e-4) | true above 1 % "
            "| of these warned | told wrongly |",
            "|---|---|---|---|---|---|---|",
        ]
        for (family, effect), found in rows.items():
            ratio = sorted(w / t for w, t, _, _ in found if t > 1e-4)
            said = f"{ratio[0]:.2g}, {ratio[len(ratio) // 2]:.2g}, {ratio[-1]:.2g}" if ratio else "-"
            large = [x for x in found if x[1] > LOUD]
            lines.append(
                f"| {family.__doc__.rstrip('.')} | {effect} | {len(found)} | {said} | {len(large)} | {sum(x[2] for x in large)} |"
                f" {sum(x[3] for x in found)} |"
            )
        page = args.table.read_text()
        begin, end = "<!-- left out -->\n", "<!-- end left out -->"
        args.table.write_text(page[: page.index(begin) + len(begin)] + "\n".join(lines) + "\n" + page[page.index(end) :])
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
