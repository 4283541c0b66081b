"""Random sweeps to an asked accuracy:  sweeps.py FLEXFRAME [--count N] [--seed S] [--kind NAME ...] [--keep FOLDER]

What points of a sweep share (settings searched for at a few places) must not make a point wrong. Each scene is swept over one or two keys,
60 points, twice: to the accuracy, and point by point as the richest model at a tolerance of 1e-8. Wrong is a point whose largest, smallest
or last value is further off than asked, relative to the range of its output as a whole, and that says nothing. Exit 1 if there is one.
"""
import collections
import csv
import math
import pathlib
import random
import resource
import subprocess
import sys
import tempfile

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from arguments import suite_parser  # noqa: E402
from scene_text import body, force, joint, output, rigid, section, simulation  # noqa: E402

POINTS = 60
RICHEST = ('effects = ["axial", "bending_xy", "stiffening", "shear", "large_bending"]', "elements = 16")
TIGHT = ["--tolerance", "1e-8", "--method", "dirk", "--no-error-estimate", "--no-effect-check"]
STEEL = "material = {{ density = 7850.0, youngs_modulus = {}, poisson = 0.3 }}"


def strip(name, length, height, modulus, more):
    """A beam of a flat section, twice as wide as high."""
    shape = f'section = {{ shape = "rectangle", height = {height!r}, width = {2 * height!r} }}'
    return body(name, "beam", shape, STEEL.format(modulus), *more, frames={"middle": {"at": 0.5}}, length=length)


def rod(name):
    return rigid(name, mass=1.0, inertia=[1e-3, 1 / 12, 1 / 12], centre_of_mass=[0.5, 0, 0], frames={"tip": [1.0, 0, 0]})


def on_slide(*lines):
    return rigid("m", mass=1.0, inertia=[1, 1, 1]) + joint("s", "prismatic", "ground", "m", "axis = [1, 0, 0]", *lines)


def push(value):
    return force("force", "m", direction=[1, 0, 0], value=value)


# Each: random numbers, lines of the beams -> the scene, {key: (from, to, whether by ratios)}, outputs with the components that move.
def oscillator(r, more):
    w = 10 ** r.uniform(0, 2)
    text = (
        section("parameters", w=w, zeta=0.05)
        + simulation(2 * math.pi / w * r.uniform(5, 60), output_rate=10 * w, gravity=[0, 0, 0])
        + on_slide(f'spring = {{ stiffness = {w * w!r}, damping = "2 * zeta * {w!r}" }}')
        + push("sin(w*t)")
        + output("x", "m", "position")
    )
    return text, {"w": (0.2 * w, 3 * w, True), "zeta": (1e-4, 0.3, True)}, {"x": "x"}


def double_pendulum(r, more):
    high = r.choice([1.0, 1.6, 2.5, 3.0])
    text = (
        section("parameters", a=1.0)
        + simulation(r.uniform(2, 6), output_rate=100, gravity=[0, -9.81, 0])
        + rod("one")
        + rod("two")
        + joint("hinge", "revolute", "ground", "one", 'initial = { value = "a" }')
        + joint("elbow", "revolute", "one.tip", "two")
        + output("tip", "two.tip", "position")
    )
    return text, {"a": (-1.5, high - 1.57, False)}, {"tip": "xy"}


def bouncing(r, more):
    k = 10 ** r.uniform(3, 6)
    text = (
        section("parameters", k=k, gap=0.1)
        + simulation(r.uniform(1, 3), output_rate=200, gravity=[-9.81, 0, 0])
        + on_slide(f'stop = {{ lower = "-gap", stiffness = "k", damping = {0.04 * math.sqrt(k)!r} }}')
        + output("x", "m", "position")
        + output("v", "m", "velocity")
    )
    return text, {"k": (0.03 * k, 30 * k, True), "gap": (0.02, 1.0, False)}, {"x": "x", "v": "x"}


def rubbing(r, more):
    text = (
        section("parameters", mu=0.3, F=3.0)
        + simulation(r.uniform(2, 6), output_rate=100, gravity=[0, 0, 0])
        + on_slide("spring = { stiffness = 30, damping = 0.2 }", 'friction = { coefficient = "mu", normal_force = 9.81 }')
        + push("F*sin(4*t)")
        + output("x", "m", "position")
    )
    return text, {"mu": (0.0, 0.6, False), "F": (1.0, 20.0, True)}, {"x": "x"}


def balanced(r, more):
    text = (
        section("parameters", P=30.0, d=0.1)
        + simulation(r.uniform(3, 10), output_rate=100, gravity=[0, -9.81, 0])
        + rod("pole")
        + joint("hinge", "revolute", "ground", "pole", "initial = { value = 1.4 }")
        + output("angle", "hinge", "value")
        + output("rate", "hinge", "rate")
        + output("tip", "pole.tip", "position")
        + force("torque", "pole", direction=[0, 0, 1], value="-P*(angle - pi/2) - d*rate")
    )
    return text, {"P": (1.0, 60.0, True), "d": (-0.5, 2.0, False)}, {"tip": "xy"}


def pulse(r, more):
    T = r.uniform(2, 10)
    text = (
        section("parameters", s=0.1, at=T / 2)
        + simulation(T, output_rate=100, gravity=[0, 0, 0])
        + on_slide("spring = { stiffness = 40, damping = 0.3 }")
        + push("exp(-((t - at)/s)^2)/s")
        + output("x", "m", "position")
    )
    return text, {"s": (1e-3, 1.0, True), "at": (0.1 * T, 0.95 * T, False)}, {"x": "x"}


def swinging_beam(r, more):
    L = r.uniform(0.3, 2)
    text = (
        section("parameters", E=2e10)
        + simulation(r.uniform(1, 2.5), output_rate=200, gravity=[0, -9.81, 0])
        + strip("rod", L, L / 80, '"E"', more)
        + joint("hinge", "revolute", "ground", "rod.root", "initial = { value = -0.3 }")
        + output("tip", "rod.tip", "position")
        + output("mid", "rod.middle", "displacement")
    )
    return text, {"E": (1e8, 2e11, True)}, {"tip": "xy", "mid": "xy"}


def elastic_crank(r, more):
    L = r.uniform(0.2, 0.5)
    a, h, E = L / r.uniform(2.5, 4), L / r.uniform(25, 50), 2.1e11
    w = math.pi**2 / L**2 * math.sqrt(E * h * h / 12 / 7850) / 5
    text = (
        section("parameters", w=w)
        + simulation(4 * math.pi / w, output_rate=100 * w, gravity=[0, 0, 0])
        + rigid("crank", mass=0.1, inertia=[1e-4] * 3, frames={"tip": [a, 0, 0]})
        + strip("rod", L, h, E, more)
        + rigid("slider", mass=0.05, inertia=[1e-4] * 3)
        + joint("shaft", "revolute", "ground", "crank", 'motion = "w*t"')
        + joint("pin", "revolute", "crank.tip", "rod.root")
        + joint("guide", "prismatic", "ground", "slider", "axis = [1, 0, 0]")
        + joint("wrist", "revolute", "rod.tip", "slider")
        + output("mid", "rod.middle", "displacement")
        + output("slide", "slider", "position")
    )
    return text, {"w": (w / 4, 2 * w, True)}, {"mid": "xy", "slide": "x"}


def shaken_beam(r, more):
    L = r.uniform(0.3, 1.0)
    h, E = L / r.uniform(20, 60), 2.1e11
    w = 3.516 / L**2 * math.sqrt(E * h * h / 12 / 7850)
    F = E * h**4 / 2 / L**2 * 1e-4
    text = (
        section("parameters", w=w, m=0.1)
        + simulation(2 * math.pi / w * r.uniform(3, 10), output_rate=8 * w, gravity=[0, 0, 0])
        + strip("beam", L, h, E, more)
        + rigid("load", mass="m", inertia=[1e-5] * 3)
        + joint("clamp", "weld", "ground", "beam.root")
        + joint("grip", "weld", "beam.tip", "load")
        + force("force", "beam.tip", direction=[0, 1, 0], value=f"{F!r}*sin(w*t)")
        + output("tip", "beam.tip", "displacement")
        + output("acc", "beam.tip", "acceleration")
    )
    return text, {"w": (0.1 * w, 8 * w, True), "m": (0.01, 3.0, True)}, {"tip": "xy", "acc": "xy"}


def swung_beam(r, more):
    text = (
        section("parameters", L=0.5, w=40.0)
        + simulation(r.uniform(0.2, 0.5), output_rate=500, gravity=[0, -9.81, 0])
        + strip("beam", "L", 0.005, 2.1e11, more)
        + joint("drive", "revolute", "ground", "beam.root", 'motion = "0.5*sin(w*t)"')
        + output("tip", "beam.tip", "displacement")
        + output("place", "beam.tip", "position")
    )
    return text, {"L": (0.1, 1.0, True), "w": (5.0, 200.0, True)}, {"tip": "xy", "place": "xy"}


# Of beams the truth has no more than a few digits, of accelerations three: not asked for 1e-3.
BEAMS = [swinging_beam, elastic_crank, shaken_beam, swung_beam]
KINDS = [oscillator, double_pendulum, bouncing, rubbing, balanced, pulse, *BEAMS]


def columns(outputs):
    return {name: [f"{name}_{axis}" for axis in axes] for name, axes in outputs.items()}


def sweep(program, text, keys, outputs, folder, words):
    """Rows of the table and CPU seconds; a sentence instead where the program ends with one."""
    folder.mkdir(parents=True)
    (folder / "scene.toml").write_text(text)
    sets = []
    for key, (low, high, ratios) in keys.items():
        number = f":{POINTS}" if len(keys) == 1 else ""
        sets += ["--set", f"{key}={low!r}:{high!r}{number}{':log' if ratios else ''}"]
    if len(keys) > 1:
        sets += ["--sample", f"lhs:{POINTS}"]
    for name, parts in columns(outputs).items():
        for column in parts:
            for what in ("max", "min", "final"):
                sets += ["--response", f"{what}_{column}={what}({name}.{column[-1]})"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    command = [program, "sweep", folder / "scene.toml", *sets, "-o", folder / "out", "--workers", "1", "--no-plots", "--quiet", *words]
    done = subprocess.run(command, capture_output=True, text=True)
    cpu = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    if done.returncode:
        return done.stderr.strip()[-300:], cpu
    with open(folder / "out" / "table.csv", newline="") as file:
        return list(csv.DictReader(file)), cpu


def judge(program, kind, seed, number, folder):
    """(verdict, what there is to say) of one sweep. silent: a point that is off says nothing."""
    name = f"{seed} {kind.__name__} {number}"
    text, keys, outputs = kind(random.Random(name), ())
    rich = kind(random.Random(name), RICHEST)[0]
    asked = random.Random(name + " asked").choice([1e-1, 1e-2, 1e-2, 1e-2 if kind in BEAMS else 1e-3])
    rows, cpu = sweep(program, text, keys, outputs, folder / "asked", ["--accuracy", repr(asked)])
    if isinstance(rows, str):
        return "refused", rows
    truth, _ = sweep(program, rich, keys, outputs, folder / "truth", TIGHT)
    if isinstance(truth, str):
        return "open", truth
    worst, off, silent, known = 0.0, 0, [], 0
    for row, true in zip(rows, truth):
        if row["end"] not in ("done", "warned") or true["end"] not in ("done", "warned"):
            continue
        known += 1
        errors = []
        for parts in columns(outputs).values():
            span = max(float(true["max_" + c]) - float(true["min_" + c]) for c in parts)
            apart = max(abs(float(row[w + c]) - float(true[w + c])) for c in parts for w in ("max_", "min_", "final_"))
            errors.append(apart / span if span > 0 else 0.0 if apart < 1e-12 else math.inf)  # what sticks stays where it is
        worst = max(worst, *errors)
        off += max(errors) > asked
        if max(errors) > asked and not row["message"]:
            silent.append(f"{max(errors):.2g} at {', '.join(f'{key} = {row[key]}' for key in keys)}")
    said = f"asked {asked:g}, worst {worst:.2g} of {known} points, {off} off; {cpu:.1f} CPU s"
    if silent:
        return "silent", f"{said}; {len(silent)} say nothing: {'; '.join(silent[:3])}"
    return ("warned" if off else "right" if known > POINTS / 2 else "open"), said


def main():
    parser = suite_parser(__doc__, "keep", count=20)
    parser.add_argument("--kind", action="append", default=[], choices=[kind.__name__ for kind in KINDS])
    args = parser.parse_args()
    kinds = [kind for kind in KINDS if not args.kind or kind.__name__ in args.kind]
    counts = collections.Counter()
    for i in range(args.count):
        kind, number = kinds[i % len(kinds)], i // len(kinds)
        with tempfile.TemporaryDirectory(prefix="flexframe_sweeps_") as place:
            folder = (args.keep or pathlib.Path(place)) / f"{kind.__name__}_{args.seed}_{number}"
            verdict, said = judge(args.program, kind, args.seed, number, folder)
        counts[verdict] += 1
        print(f"{verdict:8} {kind.__name__} {args.seed} {number}: {said}", flush=True)
    print(", ".join(f"{counts[v]} {v}" for v in ("right", "warned", "refused", "open", "silent")))
    sys.exit(1 if counts["silent"] or counts["refused"] or counts["open"] > args.count / 5 else 0)


if __name__ == "__main__":
    main()
