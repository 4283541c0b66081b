"""What `flexframe effects` tells of every effect against what it is worth:  effects_told.py FLEXFRAME [--count N] [--seed S]

Random beams in motion and at rest, their effects chosen by the program or by hand. `effects` says which are on, which cannot occur, and
what the outputs change by where one is switched. The truth are two runs at a tight tolerance whose scenes list the effects by name, one
of them without the effect (or with it). Kept: an effect worth more than 1 % is told half of that at least, or said not to be measured.
Too large a number only costs time. The sum counts too: where the richest model is more than 1 % beside the reported one, one of the
effects that are off is told a third of that, or the scene's own run warns. Exit 1 if not.
"""
import collections
import json
import pathlib
import re
import subprocess
import sys

import numpy as np

sys.path[:0] = [
    str(pathlib.Path(__file__).parent),
    str(pathlib.Path(__file__).parents[1]),
]
import kinds.effects  # noqa: E402
import kinds.rich  # noqa: E402
import left_out  # noqa: E402
from arguments import judge_each, suite_parser  # noqa: E402
from run_trust import Program, make  # noqa: E402
from scene import Scene, pick  # noqa: E402

LISTED = (
    "axial",
    "bending_xy",
    "bending_xz",
    "torsion",
    "stiffening",
    "shear",
    "large_bending",
)
ALWAYS = ("gyroscopic", "damping")  # there unless `without` has them
ONE_PLANE = ("bending_xy", "bending_xz", "torsion")  # a second plane, or twist, rules large_bending out
COUNTS, HALF, SUM = 0.01, 2.0, 3.0
# Two methods: what they do not agree on is no truth.
TRUTHS = (
    ("--method", "dirk", "--tolerance", "1e-8"),
    ("--method", "erk", "--tolerance", "1e-7"),
)
ALONE = ("--no-error-estimate", "--no-effect-check")


def of_family(family):
    """A mechanism of left_out.py, its effects by hand."""

    def kind(r):
        made = family(r)
        if made is None:
            return None
        some = [e for e in made[1] if r.random() < 0.4] + ["bending_xy"]
        # Often the program's choice: a list that is not there.
        text = made[0]("@").replace("effects = @", pick(r, "", "", f"effects = {left_out.listed(some)}"))
        return Scene(text, "", {}, made[2])

    kind.__name__ = family.__name__
    return kind


# Those at rest and quick ones first.
QUICK = (kinds.effects.hand_column, kinds.effects.hand_bent, kinds.effects.hand_hoist, kinds.effects.hand_free)
KINDS = [*QUICK, *(k for k in kinds.effects.KINDS if k not in QUICK), *map(of_family, left_out.FAMILIES), *kinds.rich.KINDS]


def bodies(text):
    """The scene's text in pieces, each with the name of the beam that it is, None for the rest."""
    for piece in re.split(r"(?m)^(?=\[)", text):
        beam = piece.startswith("[[body]]") and re.search(r'(?m)^kind = "beam"', piece)
        yield piece, re.search(r'(?m)^name = "([^"]*)"', piece)[1] if beam else None


def with_effects(text, states):
    """The scene with the effects of every beam listed. states: {beam: {effect: on}}."""
    out = ""
    for piece, name in bodies(text):
        if name in states:
            piece = re.sub(r"(?m)^(effects|without) *=.*\n?", "", piece).rstrip("\n")
            on = [e for e in LISTED if states[name].get(e)]
            off = [e for e in ALWAYS if not states[name].get(e, True)]
            piece += f"\neffects = {left_out.listed(on)}\n" + (f"without = {left_out.listed(off)}\n" if off else "") + "\n"
        out += piece
    return out


def moved_by(a, b, scene):
    """The largest change of an output between two histories, and which; what stands still counts against the size of what moves it."""
    worst, where = 0.0, "-"
    for name, x in a.items():
        y = b[name]
        for part in (slice(0, 3), slice(3, 6)) if x.shape[1] == 6 else (slice(None),):
            u, v = x[:, part], y[:, part]
            scale = scene.scales.get(name)
            scale = scale(u) if callable(scale) else scale or max(np.ptp(u, axis=0).max(), np.ptp(v, axis=0).max())
            if scale <= max(1e-6 * max(abs(u).max(), abs(v).max()), 1e-9 * abs(x).max()):
                continue  # stands still but for rounding; the moment of a plain force is rounding of that
            change = float(np.linalg.norm(u - v, axis=1).max() / scale)
            if change > worst:
                worst, where = change, name
    return worst, where


class Runs:
    """Runs of a scene's variants at tight tolerances, each once."""

    def __init__(self, program, folder, limit):
        self.program, self.known = Program(program, folder, limit), {}

    def of(self, text, words):
        if (text, words) not in self.known:
            code, _, history, _, _ = self.program.run(text, (*words, *ALONE))
            self.known[text, words] = history if code == 0 else None
        return self.known[text, words]

    def worth(self, here, other, scene, told):
        """What lies between two scenes, and where; None where a run fails. Where more is told than half of it nothing is looked at twice,
        else it is less by what two methods disagree by on each: vibrations that a method steps over go elsewhere with every change."""
        ours, theirs = self.of(here, TRUTHS[0]), self.of(other, TRUTHS[0])
        if ours is None or theirs is None:
            return None
        worth, where = moved_by(ours, theirs, scene)
        if worth <= max(COUNTS, HALF * told):
            return worth, where
        for text, run in ((here, ours), (other, theirs)):
            again = self.of(text, TRUTHS[1])
            if again is None:
                return None
            worth -= moved_by(run, again, scene)[0]
        return max(0.0, worth), where


def told(program, folder, text, limit):
    path = folder / "told.toml"
    path.write_text(text)
    done = subprocess.run(
        [program, "effects", str(path), "--json", "--quiet"],
        capture_output=True,
        text=True,
        timeout=limit,
    )
    if done.returncode != 0:
        raise ValueError(done.stderr.strip()[-200:])
    return json.loads(done.stdout)


def judge(program, scene, folder, limit):
    try:
        report = told(program, folder, scene.text, 10 * limit)
    except subprocess.TimeoutExpired:
        return "slow", "the report"
    states = collections.defaultdict(dict)
    beams = [name for _, name in bodies(scene.text) if name]
    for row in report["effects"]:
        if row["owner"] in beams:
            states[row["owner"]][row["effect"]] = row["on"]
    runs, wrong, useless, measured, floor = (
        Runs(program, folder, limit),
        [],
        0,
        0,
        report["floor"],
    )
    here = with_effects(scene.text, states)
    for row in report["effects"]:
        owner, effect = row["owner"], row["effect"]
        if owner not in beams or effect == "damping" or (effect in ALWAYS and not row["possible"]):
            continue
        # What rules another effect out is worth what it changes where that is off.
        this = {b: dict(s) for b, s in states.items()}
        if effect in ONE_PLANE and not row["on"]:
            this[owner]["large_bending"] = False
        other = {b: dict(s) for b, s in this.items()}
        other[owner][effect] = not row["on"]
        share = row["share"]
        if share is None or floor >= 1.0:
            continue  # said not to be measured
        true = runs.worth(with_effects(scene.text, this), with_effects(scene.text, other), scene, share + floor)
        if true is None:
            continue
        measured += 1
        if true[0] > COUNTS and share + floor < true[0] / HALF:
            wrong.append(
                f"{owner} {effect} {'on' if row['on'] else 'off'}{'' if row['possible'] else ', cannot occur'}: "
                f"told {share:.2g} (floor {floor:.1g}), true {true[0]:.2g} of {true[1]}"
            )
        useless += row["on"] and true[0] < COUNTS / 10
    richest = {b: {**dict.fromkeys(LISTED[:-1], True), **{e: s[e] for e in ALWAYS if e in s}} for b, s in states.items()}
    off = max(
        (row["share"] or 0.0 for row in report["effects"] if row["owner"] in beams and not row["on"]),
        default=0.0,
    )
    rich = runs.worth(here, with_effects(scene.text, richest), scene, off + floor)
    if rich and rich[0] > COUNTS and off + floor < rich[0] / SUM and not warned(runs, scene):
        wrong.append(f"all that is off: told {off:.2g} at most, true {rich[0]:.2g} of {rich[1]}")
    if not measured:
        return "open", "no run without an effect"
    what = f"{measured} effects, {useless} on that are worth less than a thousandth"
    return ("silent", "; ".join(wrong)) if wrong else ("right", what)


def warned(runs, scene):
    code, summary, _, _, _ = runs.program.run(scene.text, ())
    return code != 0 or bool(summary["simulation"]["warnings"])


def main():
    parser = suite_parser(__doc__, "number", "keep", count=len(KINDS), limit=30)
    args = parser.parse_args()

    def sample(r, number):
        kind = KINDS[number % len(KINDS)]
        scene = make(kind, args.seed, number // len(KINDS))
        scene.what = f"{kind.__name__}, {scene.what}"
        return scene

    judge_each(
        args,
        "effects told",
        sample,
        lambda program, scene, folder, _: judge(program, scene, folder, args.limit),
    )


if __name__ == "__main__":
    main()
