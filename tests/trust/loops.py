"""Random closed mechanisms by every method at many tolerances:  loops.py FLEXFRAME [--count N] [--seed S] [--kind NAME ...]

Rigid slider-cranks, four-bars (some beside a change point), five-bars and six-bars, driven or free, from rest or fast, through positions in
which one link or another stands badly, against their truth (truths/plane_loops.py, in which no coordinate leads); rigid loops in space
against virtual work (truths/lagrange.py); elastic slider-cranks and four-bars, whose methods have to agree; and four-bars driven beyond
their reach. Places, rates, accelerations and reactions count, relative to their ranges. Wrong is

  stopped    a run that ends: every one of these motions goes on; beyond the reach one that does not end there, or with other words
  flat       errors of rigid ones that shrink by less than the square root of the tolerance, above what the truth is good to
  far        an error of more than FAR times the tolerance at the tightest one, times what the motion makes of a small error at its start
  leapt      a rigid one in the plane whose place changes at once, at loose tolerances: over into another assembly

The table tells how errors follow the tolerance: the power by which they shrink with it, and how many times as large they are. Exit 1 if
anything is wrong.

  --number N          scene N alone                        --keep FOLDER    scenes in which something is wrong
  --methods A,B       --tolerances 1e-4,1e-6   --limit S   those alone; CPU seconds a run may take (60)
"""
import collections
import pathlib
import re
import sys
import tempfile

import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from arguments import suite_parser  # noqa: E402
import kinds.closed  # noqa: E402
import left_out  # noqa: E402
from kinds.random import random_loop  # noqa: E402
from run_trust import NoTruth, Program, compare, find_truth, make  # noqa: E402
from scene import Scene  # noqa: E402
from shards import add_shard, in_shard  # noqa: E402

METHODS = "dirk,erk,adams,bdf,ida,exponential"
TOLERANCES = "1e-4,1e-5,1e-6,1e-7,1e-8,1e-9"
FLAT, FAR = 0.5, 3e4
LOOSE = ("1e-2", "1e-3")  # where steps are long enough to pass into another assembly
LEAP, LOOKS = 0.02, 20  # of the range; samples for one of the scene
ALONE = ("--no-error-estimate", "--no-effect-check")
KNOWN, SOLVED = 1e-9, 1e-7  # of the range: no truth is better; what hangs on no tolerance


def of_beams(family):
    """The elastic mechanisms of left_out.py with all their effects: no truth, the methods have to agree."""

    def kind(r):
        made = family(r)
        return made and Scene(made[0](left_out.listed(("axial", "bending_xy", "stiffening", "shear"))), "", {}, made[2])

    kind.__name__, kind.__doc__ = family.__name__, family.__doc__
    return kind


def elastic(seed, number):
    """Elastic slider-crank or four-bar of left_out.py, the methods against one another"""
    family = (left_out.slider_crank, left_out.four_bar)[number % 2]
    return make(of_beams(family), seed, number // 2)


def lost_energy(seed, number):
    """Driven slider-crank whose rod loses its second-order kinetic energy, always the same; steps come to rest before one finds it lost"""
    scene = make(of_beams(left_out.slider_crank), 79, 1)
    scene.words = ("adams",)
    return scene


def as_drawn(kind):
    def scene(seed, number):
        return make(kind, seed, number)

    scene.__name__, scene.__doc__ = kind.__name__, kind.__doc__
    return scene


KINDS = {k.__name__: k for k in (*map(as_drawn, (*kinds.closed.KINDS, kinds.closed.beyond_reach, random_loop)), lost_energy, elastic)}


PLANE = [k.__name__ for k in kinds.closed.KINDS]


class Errors:
    """Of one method in one scene: tolerance -> error, and where."""

    def __init__(self, tolerances):
        self.tolerances, self.error, self.where, self.stopped = tolerances, {}, {}, {}

    def power(self, floor):
        """By which power of the tolerance errors shrink, from 0.05 down to what the truth is good to; None where they say too little.
        The loosest run may be near by chance (six-bar at 1e-4: 0.013, at 1e-5 0.12): the larger power of those with and without it.
        """
        known = sorted((np.log10(t), np.log10(e)) for t, e in self.error.items() if floor < e < 0.05)
        spans = [k for k in (known, known[:-1]) if len(k) > 1 and k[-1][0] - k[0][0] > 1.9]
        if len(known) < 3 or not spans:
            return None
        return max(float(np.polyfit(*zip(*k), 1)[0]) for k in spans)


def agreed(program, text, tolerances):
    """What two methods agree on at a tenth of the tightest tolerance, and by how much they differ."""
    tight = f"{min(map(float, tolerances)) / 10:.0e}"
    runs = [program.run(text, ("--tolerance", tight, "--method", m, *ALONE)) for m in ("exponential", "erk")]
    if any(code != 0 for code, *_ in runs):
        return None, 0.0
    return runs[0][2], compare(Scene("", "", {}), runs[1][2], runs[0][2])[0]


def beyond(scene, method, program, tolerance):
    """What is wrong with the end of a run beyond the mechanism's reach; empty where nothing is."""
    code, said, *_ = program.run(scene.text, ("--tolerance", tolerance, "--method", method, *ALONE))
    if code == 0:
        return f"goes on beyond t = {scene.truth:.6g} s"
    when = re.search(r"at t = ([0-9.e+-]+) s", said)
    if "limit of its reach" not in said:
        return f"says {said.strip()[-160:]}"
    if not when or abs(float(when[1]) - scene.truth) > 0.01 * scene.truth:
        return f"ends at {when and when[1]} s, not at {scene.truth:.6g} s"
    return ""


def leap(history, times):
    """How far a point goes at once, farther than three times its speed before and after would carry it; of its range."""
    gone = np.linalg.norm(np.diff(history["x"], axis=0), axis=1)
    speed = np.linalg.norm(history["v"], axis=1)
    return float((gone - 3 * np.diff(times) * np.maximum(speed[1:], speed[:-1])).max() / np.ptp(history["x"], axis=0).max())


def leaps(scene, program, methods):
    """Lines about loose runs that change their assembly, and how many runs ended."""
    text = re.sub(r"output_rate = (\S+)", lambda rate: f"output_rate = {LOOKS * float(rate[1])!r}", scene.text)
    wrong, ended = [], 0
    for m in methods:
        for t in LOOSE:
            code, _, history, times, _ = program.run(text, ("--tolerance", t, "--method", m, *ALONE))
            ended += code != 0
            if code == 0 and (far := leap(history, times)) > LEAP:
                wrong.append(f"leapt    {m} {t}: {far:.2g} of the range")
    return wrong, ended


def follow(scene, program, methods, tolerances):
    """Errors of every method, what the truth is good to, and what the motion makes of a small error; lines about what is wrong."""
    wrong, found = [], {}
    if isinstance(scene.truth, float):
        for m in methods:
            for t in tolerances:
                if why := beyond(scene, m, program, t):
                    wrong.append(f"stopped  {m} {t}: {why}")
        return found, KNOWN, 1.0, wrong
    # What a rigid drive moves is solved for, not integrated: as good as the closure of its loops.
    truth, floor, growth = None, SOLVED if getattr(scene.truth, "driven", False) else KNOWN, None
    if not callable(scene.truth):
        truth, apart = agreed(program, scene.text, tolerances)
        floor = max(KNOWN, 5 * apart)
        if truth is None:
            return found, floor, growth, ["stopped  at a tenth of the tightest tolerance"]
        if apart > 1e-3:
            return found, floor, growth, [f"far      exponential and erk: {apart:.2g} at a tenth of the tightest tolerance"]
    for m in methods:
        found[m] = errors = Errors(tolerances)
        for t in tolerances:
            code, said, history, times, _ = program.run(scene.text, ("--tolerance", t, "--method", m, *ALONE))
            if code != 0:
                wrong.append(f"stopped  {m} {t}: {said.strip()[-200:]}")
                continue
            if truth is None:
                truth = find_truth(scene.truth, times, program.truth_limit)
                if hasattr(scene.truth, "beside"):
                    push, beside = scene.truth.beside(times)
                    growth = max(1.0, compare(scene, beside, truth)[0] / push)
                    floor = max(KNOWN, 1e-11 * growth)
            errors.error[float(t)], errors.where[float(t)] = compare(scene, history, truth)
        power, tightest = errors.power(floor), min(errors.error, default=None)
        if tightest is None:
            continue
        last = errors.error[tightest]
        # Implicit methods step over vibrations of beams: what these do to forces falls late and by leaps.
        if callable(scene.truth) and power is not None and power < FLAT and last > 100 * tightest * (growth or 1.0):
            wrong.append(f"flat     {m}: power {power:.2f}, {last:.1e} at {tightest:g} ({errors.where[tightest]})")
        if getattr(scene.truth, "driven", False) and last > floor:
            wrong.append(f"far      {m}: {last:.1e} at {tightest:g} ({errors.where[tightest]}), where nothing is integrated")
        if growth is not None and last > max(floor, FAR * tightest * growth):
            wrong.append(f"far      {m}: {last:.1e} at {tightest:g} ({errors.where[tightest]}), sensitivity {growth:.1e}")
    return found, floor, growth, wrong


def quartiles(values):
    if not values:
        return "-"
    return ", ".join(f"{x:.2g}" for x in np.quantile(values, (0.0, 0.5, 1.0)))


def main():
    parser = suite_parser(__doc__, "number", "keep", count=24, limit=60)
    parser.add_argument("--kind", nargs="+", choices=list(KINDS), default=list(KINDS))
    parser.add_argument("--methods", default=METHODS)
    parser.add_argument("--tolerances", default=TOLERANCES)
    add_shard(parser)
    args = parser.parse_args()
    methods, tolerances = args.methods.split(","), args.tolerances.split(",")
    powers, sizes, runs, bad, shown = collections.defaultdict(list), collections.defaultdict(list), 0, 0, 0
    loose = ended = 0
    with tempfile.TemporaryDirectory(prefix="flexframe_loops_") as folder:
        program = Program(args.program, folder, args.limit)
        for i in range(args.count):
            name, number = args.kind[i % len(args.kind)], i // len(args.kind)
            if args.number is not None and number != args.number or not in_shard(i, args.shard):
                continue
            scene = KINDS[name](args.seed, number)
            try:
                found, floor, growth, wrong = follow(scene, program, scene.words or methods, tolerances)
            except NoTruth as error:
                print(f"open     {name} {number}: {error}")
                continue
            if name in PLANE:
                leapt, stopped = leaps(scene, program, scene.words or methods)
                wrong, ended, loose = wrong + leapt, ended + stopped, loose + len(LOOSE) * len(scene.words or methods)
            shown += 1
            told = []
            for m, errors in found.items():
                runs += len(errors.error)
                power = errors.power(floor)
                powers[m] += [power] if power is not None else []
                sizes[m] += [e / t for t, e in errors.error.items() if e > floor][-1:]
                told.append(f"{m} {min(errors.error.values(), default=np.nan):.1e}" + (f" ({power:.2f})" if power is not None else ""))
            print(f"{'WRONG' if wrong else 'right':8} {name} {number}: {scene.what}; {', '.join(told)}", flush=True)
            for line in wrong:
                print("  " + line)
            bad += len(wrong)
            if wrong and args.keep:
                args.keep.mkdir(exist_ok=True)
                (args.keep / f"{name}_{number}.toml").write_text(scene.text)
    print("method: power of the tolerance (least, median, largest), share of at least 0.8; error over tolerance at the tightest one")
    for m in methods:
        share = np.mean([p >= 0.8 for p in powers[m]]) if powers[m] else np.nan
        print(f"{m}: {quartiles(powers[m])}, {share:.2f}; {quartiles(sizes[m])}")
    print(f"{shown} mechanisms, {runs} runs, {bad} wrong; {loose} loose runs, {ended} of them ended in a sentence")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
