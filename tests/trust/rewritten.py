"""The same scenes written otherwise:  rewritten.py FLEXFRAME [SCENE...] [--count N] [--seed S] [--kind NAME ...]

What a run gives may not depend on how the scene is written. Each scene is run as it is and
  - reversed: its bodies, joints, forces, couplings and blocks in the other order (another joint of a loop is cut),
  - shorter: to the middle of its time, compared with the first half of the whole run,
  - sparser: with half as many samples, compared at those,
  - alone: with its first output, and those that forces read, as the only ones,
  - exchanged: joints between bodies with parent and child exchanged,
  - beside: with a pendulum of 100 m and 1000 t and an oscillator of a micrometre beside it, which touch nothing of it,
  - tighter: at a thousandth of the tolerance,
  - finer: beams whose elements are the program's choice with twice as many,
  - divided: beams as two halves, welded,
and every output has to be the same within what both runs claim: 1 % of its range for effects, five times the printed estimates for time.
A run that is warned of claims nothing. Without scenes: random ones of run_trust.py, N of each kind. Exit 1 if an output differs by more.
"""
import math
import pathlib
import re
import sys
import tempfile
import tomllib

import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from arguments import suite_parser  # noqa: E402
import run_trust  # noqa: E402
from units import AT_REST, write  # noqa: E402

LISTS = ("body", "joint", "force", "coupling", "block")
# What a joint of these kinds does to its child it does to its parent, with the sign of its coordinate changed.
EXCHANGED = ("weld", "revolute", "prismatic", "spherical")
# What continuous integration runs.
SHORT = ["sprung_bob", "truss", "slider_crank", "rubbing_loop", "maxwell", "on_mounts"]


def negative(v):
    if isinstance(v, list):
        return [negative(x) for x in v]
    return f"-({v})" if isinstance(v, str) else -v


def reversed_order(scene):
    return {k: v[::-1] if k in LISTS else v for k, v in scene.items()}


def shorter(scene):
    given = dict(scene["simulation"])
    rate = given.get("output_rate", 1000)
    samples = math.floor(given["duration"] * rate / 2 + 1e-9)
    if samples < 2 or not all(isinstance(x, (int, float)) for x in (rate, given["duration"])):
        return None
    return scene | {"simulation": given | {"duration": samples / rate}}


def sparser(scene):
    given = scene["simulation"]
    rate, duration = given.get("output_rate", 1000), given["duration"]
    if not all(isinstance(x, (int, float)) for x in (rate, duration)) or round(rate * duration) % 2 or rate * duration < 4:
        return None
    return scene | {"simulation": given | {"output_rate": rate / 2}}


def mentions(tables, name):
    return re.search(rf"\b{re.escape(name)}\b", write(tables)) is not None


def alone(scene):
    others = {k: v for k, v in scene.items() if k != "output"}
    kept = scene["output"][:1] + [o for o in scene["output"][1:] if mentions(others, o["name"])]
    return scene | {"output": kept} if len(kept) < len(scene["output"]) else None


def beside(scene):
    duration = scene["simulation"]["duration"]
    if not isinstance(duration, (int, float)):
        return None
    bodies = [
        {"name": "far_tower", "kind": "rigid", "mass": 1e6, "inertia": [1e8, 1e8, 1e8], "frames": {"top": [0.0, 100.0, 0.0]}},
        {"name": "tiny_mass", "kind": "rigid", "mass": 1e-9},
    ]
    swing = {"name": "far_hinge", "kind": "revolute", "parent": "ground", "child": "far_tower.top", "initial": {"rate": 0.01}}
    # Five periods in the run.
    spring = {"stiffness": 1e-9 * (10 * math.pi / duration) ** 2, "rest": 0.0}
    slide = {"name": "tiny_slide", "kind": "prismatic", "axis": [1.0, 0.0, 0.0], "parent": "ground", "child": "tiny_mass"}
    joints = [swing | {"position": [5000.0, 300.0, 0.0]}, slide | {"spring": spring, "initial": {"value": 1e-6}}]
    added = [
        {"name": "far_angle", "quantity": "value", "of": "far_hinge"},
        {"name": "tiny_place", "quantity": "value", "of": "tiny_slide"},
    ]
    outputs = [o for o in scene["output"] if o.get("of") != "system"]  # of which the new bodies are a part
    return scene | {"body": scene["body"] + bodies, "joint": scene["joint"] + joints, "output": outputs + added}


def tighter(scene):
    given = scene["simulation"]
    return scene | {"simulation": given | {"tolerance": 1e-3 * given.get("tolerance", 1e-6)}} if "accuracy" not in given else None


def finer(scene):
    chosen = [b["name"] for b in scene["body"] if b["kind"] == "beam" and not set(b) & {"elements", "modes", "model", "axis", "sections"}]
    free = [name for name in chosen if not re.search(rf'"{re.escape(name)}\.(node|q)', write(scene))]
    free = [b for b in free if not any(o.get("of") == b and o["quantity"] in ("q", "qd") for o in scene["output"])]
    bodies = [b | {"elements": 20} if b["name"] in free else b for b in scene["body"]]
    return scene | {"body": bodies} if free else None


DIVISIBLE = {"name", "kind", "length", "section", "material", "effects", "without", "color", "elements"}


def divided(scene):
    """Each beam that can be is two of half its length; what stood at its tip stands at the second one's."""
    bodies, joints, halves = [], [], set()
    for b in scene["body"]:
        if b["kind"] != "beam" or not set(b) <= DIVISIBLE or not isinstance(b["length"], (int, float)):
            bodies.append(b)
            continue
        name, half = b["name"], {k: v for k, v in b.items() if k != "elements"} | {"length": b["length"] / 2}
        halves.add(name)
        bodies += [half, half | {"name": name + "_b"}]
        joints.append({"name": f"{name}_halves", "kind": "weld", "parent": f"{name}.tip", "child": f"{name}_b.root"})
    if not halves:
        return None

    def moved(v):
        if isinstance(v, dict):
            return {k: moved(x) for k, x in v.items()}
        if isinstance(v, list):
            return [moved(x) for x in v]
        if isinstance(v, str) and v.endswith(".tip") and v[:-4] in halves:
            return v[:-4] + "_b.tip"
        return v

    forces = []
    for f in scene.get("force", []):
        on = f.get("on")
        if f["kind"] == "distributed" and on in halves:
            if set(f) - {"name", "kind", "on", "value", "direction", "frame"}:
                return None
            forces += [f, f | {"name": f["name"] + "_b", "on": on + "_b"}]
        else:
            forces.append(moved(f))
    outputs = [moved(o) for o in scene["output"] if not any(o.get(k) in halves for k in ("of", "on", "body"))]
    if not outputs or any(not o["quantity"] in ("position", "velocity", "acceleration", "rotation", "value", "rate") for o in outputs):
        outputs = [o for o in outputs if o["quantity"] in ("position", "velocity", "value", "rate", "reaction")]
    out = scene | {"body": bodies, "joint": [moved(j) for j in scene["joint"]] + joints, "output": outputs}
    return out | ({"force": forces} if forces else {}) if outputs else None


def exchanged(scene):
    names = {b["name"] for b in scene["body"]}
    joints, changed = [], set()
    for j in scene["joint"]:
        between = all(j[end].split(".")[0] in names for end in ("parent", "child"))
        plain = set(j) <= {"name", "kind", "parent", "child", "axis", "initial", "spring", "stop", "friction"}
        if not (between and plain and j["kind"] in EXCHANGED):
            joints.append(j)
            continue
        other = j | {"parent": j["child"], "child": j["parent"]}
        if "initial" in j:
            # The angular velocity of a ball joint counts in its parent's frame: another one now.
            if j["kind"] == "spherical":
                joints.append(j)
                continue
            other["initial"] = {k: negative(v) for k, v in j["initial"].items()}
        if "spring" in j:
            other["spring"] = {k: negative(v) if k in ("rest", "preload") else v for k, v in j["spring"].items()}
        if "stop" in j:
            ends = {"lower": "upper", "upper": "lower"}
            other["stop"] = {ends.get(k, k): negative(v) if k in ends else v for k, v in j["stop"].items()}
        changed.add(j["name"])
        joints.append(other)
    outputs = [o for o in scene["output"] if o.get("of") not in changed]
    others = {k: v for k, v in scene.items() if k not in ("joint", "output")}
    dropped = [o["name"] for o in scene["output"] if o not in outputs]
    if not changed or not outputs or any(mentions(others, name) for name in [*changed, *dropped]):
        return None
    return scene | {"joint": joints, "output": outputs}


WAYS = {"reversed": reversed_order, "shorter": shorter, "sparser": sparser, "alone": alone, "exchanged": exchanged}
WAYS |= {"beside": beside, "tighter": tighter, "finer": finer, "divided": divided}


def run(program, scene, words):
    code, summary, history, times, _ = program.run(write(scene), words)
    if code != 0:
        first = next((l for l in summary.splitlines() if not l.startswith("simulating")), f"exit {code}")
        return first, None, None, None
    return "", history, times, summary["simulation"]


def largest(name, history, times, other, other_times):
    """Largest difference at the instants both have, relative to the range there."""
    rows = np.searchsorted(times, other_times)
    rows[rows == len(times)] -= 1
    rows -= (rows > 0) & (abs(times[rows - 1] - other_times) < abs(times[rows] - other_times))
    same = abs(times[rows] - other_times) < 1e-9 * times[-1]
    a, b = history[rows[same]], other[same]
    if not len(a):
        return math.nan
    worst = 0.0
    for part in (slice(0, 3), slice(3, 6)) if a.shape[1] == 6 else (slice(None),):
        x, y = a[:, part], b[:, part]
        size = (x.max(axis=0) - x.min(axis=0)).max()
        size = size if size > AT_REST * abs(x).max() else abs(x).max()
        difference = np.linalg.norm(x - y, axis=1).max()
        # What is rounding of the other vector, or of the larger whole.
        if difference > run_trust.ROUNDING_OF_RUNS * abs(a).max():
            worst = max(worst, difference / size if size > 0 else math.inf)
    return worst


def compare(program, name, text, words, ways=WAYS):
    """(runs compared, lines that say what differs)."""
    scene = {"output": [], "joint": []} | tomllib.loads(text)
    said, history, times, told = run(program, scene, words)
    compared, found = 0, []
    for way in ways:
        other = WAYS[way](scene)
        if other is None:
            continue
        why, second, other_times, summary = run(program, other, words)
        compared += 1
        if bool(why) != bool(said):
            found.append(f"{name}, {way}: '{said[:160]}' became '{why[:160]}'")
        if said or why or told["warnings"] or summary["warnings"]:
            continue
        allowed = 2 * run_trust.DEFAULT_CLAIM + run_trust.ESTIMATES * sum(
            (s.get("error_estimate") or {}).get("relative") or 0.0 for s in (told, summary)
        )
        for output in other["output"]:
            key = output["name"].split(".")[0]
            if key in second and key in history:
                apart = largest(key, history[key], times, second[key], other_times)
                if apart > allowed:
                    found.append(f"{name}, {way}: {key} differs by {apart:.2g} of its range, {allowed:.2g} told")
    return compared, found


def main():
    parser = suite_parser(__doc__, "kind", "short", count=1, limit=20)
    parser.add_argument("scenes", nargs="*", type=pathlib.Path)
    parser.add_argument("--way", action="append", choices=list(WAYS), help="only these")
    args = parser.parse_args()
    args.kind += SHORT if args.short else []
    cases = [(str(path), path.read_text(), ()) for path in args.scenes]
    if not cases:
        for kind in run_trust.KINDS:
            for number in range(args.count if not args.kind or kind.__name__ in args.kind else 0):
                scene = run_trust.make(kind, args.seed, number)
                if "--accuracy" not in scene.words:
                    cases.append((f"{kind.__name__} {args.seed} {number}", scene.text, scene.words))
    runs = wrong = 0
    with tempfile.TemporaryDirectory(prefix="flexframe_rewritten_") as folder:
        program = run_trust.Program(args.program, folder, args.limit)
        for name, text, words in cases:
            compared, found = compare(program, name, text, words, args.way or WAYS)
            runs += compared
            wrong += bool(found)
            for line in found:
                print(line, flush=True)
    print(f"{len(cases)} scenes, {runs} rewritten runs: {wrong} scenes differ")
    return 1 if wrong or not runs else 0


if __name__ == "__main__":
    sys.exit(main())
