"""Random scenes against truths that the program had no part in:  run_trust.py FLEXFRAME [--count N] [--seed S] [--kind NAME ...]

Each scene is run as a user would, and its outputs are compared with the truth. A run that gives a number beyond what it claims
and says nothing is a silent error: there must be none. Claim: 1 % for effects and five times the printed estimate for time, or the
accuracy that is asked for.
A run that is warned of, or refused in a sentence, is told; one whose truth was not found in its
time is open. Exit 1 if there is a silent error or a scene that ends in neither.

  --table FILE    replaces the table by kind of scene in a Markdown page, between its markers
  --rows FILE     verdicts go there line by line; scenes that are there are not run again. The table then counts all of the file
  --keep FOLDER   scenes with silent errors, and those that ended in nothing, each with a line in FOLDER/LIST
  --limit S       CPU seconds a run may take (60)
  --truth-limit S   CPU seconds a truth may take (300); a scene without one is "open"
  --jobs N        scenes at a time (1)
"""
import collections
import concurrent.futures
import csv
import json
import pathlib
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from arguments import suite_parser  # noqa: E402
import kinds.asked  # noqa: E402
import kinds.bent  # noqa: E402
import kinds.conditions  # noqa: E402
import kinds.contact  # noqa: E402
import kinds.coupled  # noqa: E402
import kinds.effects  # noqa: E402
import kinds.exact  # noqa: E402
import kinds.frames  # noqa: E402
import kinds.machines  # noqa: E402
import kinds.measures  # noqa: E402
import kinds.motion  # noqa: E402
import kinds.plane  # noqa: E402
import kinds.random  # noqa: E402
import kinds.read  # noqa: E402
import kinds.rich  # noqa: E402
import kinds.ringing  # noqa: E402
import kinds.states  # noqa: E402
import kinds.statics  # noqa: E402
import kinds.touch  # noqa: E402
import kinds.wide  # noqa: E402
import kinds.written  # noqa: E402
from shards import add_shard, in_shard  # noqa: E402

# What continuous integration runs: one scene of a kind, those whose truth costs little.
SHORT = [
    "tension",
    "across",
    "twist",
    "truss",
    "rod_pulled",
    "angle_section",
    "torsion_rod",
    "portal",
    "cantilever_force",
    "constant_acceleration",
    "pendulum",
    "tumbling",
    "driven_arm",
    "decay",
    "on_stop",
    "bounce",
    "rubbing_block",
    "slider_crank",
    "crank_rocker",
    "pulse",
    "sudden",
    "jerked_clamp",
    "jerked_beam",
    "jerked_line",
    "modal_q",
    "dropped_rod",
    "near_buckling",
    "belt",
    "dropped_ball",
    "landing_box",
    "rolling",
    "brushing",
    "narrow_bump",
    "passing_trigger",
    "controlled",
    "sampled_control",
    "filtered",
    "planetary",
    "shaped_pendulum",
    "forces_of_joints",
    "stubby_frame",
    "springs_along",
    "supports",
    "kept_modes",
    "tapered",
    "engine",
    "rubbing_loop",
    "cardan",
    "fast_top",
    "on_mounts",
    "several_rests",
    "above_the_floor",
    "twitching_drive",
    "steered_beam",
    "random_rest",
    "maxwell",
    "by_table",
    "statespace_body",
    "rolled_strip",
    "governor",
    "cam_follower",
    "rope_machine",
    "pin_in_slot",
    "regularised_rub",
    "swinging_spring",
    "shown_from",
    "outputs_of_blocks",
    "discs_on_beam",
]
KINDS = (
    kinds.statics.KINDS
    + kinds.motion.KINDS
    + kinds.contact.KINDS
    + kinds.rich.KINDS
    + kinds.effects.KINDS
    + kinds.wide.KINDS
    + kinds.asked.KINDS
    + kinds.touch.KINDS
    + kinds.read.KINDS
    + kinds.coupled.KINDS
    + kinds.exact.KINDS
    + kinds.frames.KINDS
    + kinds.machines.KINDS
    + kinds.states.KINDS
    + kinds.random.KINDS
    + kinds.written.KINDS
    + kinds.plane.KINDS
    + kinds.conditions.KINDS
    + kinds.measures.KINDS
    + kinds.bent.KINDS
    + kinds.ringing.KINDS
)
DEFAULT_CLAIM, ESTIMATES = 0.01, 5.0
# Of the largest number of a reaction: what is less is rounding. In runs of the richer model it grows where a direction is unstable (a rope
# pressed far beyond buckling: 1.2e-12).
ROUNDING, ROUNDING_OF_RUNS = 1e-13, 1e-11
BAD = ("silent", "slow", "broken")  # verdicts that must not be


def make(kind, seed, number):
    """Scene `number` of a kind: the same for ever, whatever else is run."""
    for attempt in range(100):
        scene = kind(random.Random(f"{seed} {kind.__name__} {number} {attempt}"))
        if scene is not None:  # parameters that make no such scene are drawn again
            scene.kind, scene.number = kind.__name__, number
            return scene
    raise RuntimeError(f"{kind.__name__} {number}: no scene in a hundred attempts")


class NoTruth(Exception):
    """A truth that was not found, or not in its time: the scene is open."""


def find_truth(truth, times, seconds):
    """truth(times), given up after so many CPU seconds."""

    def give_up(*_):
        raise NoTruth(f"its truth takes more than {seconds:g} CPU s")

    before = signal.signal(signal.SIGPROF, give_up)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        return truth(times)
    except (RuntimeError, np.linalg.LinAlgError) as error:
        raise NoTruth(f"its truth: {error}") from error
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


class Program:
    def __init__(self, path, folder, limit, truth_limit=300):
        self.path, self.folder, self.limit, self.truth_limit = path, pathlib.Path(folder), limit, truth_limit

    def run(self, text, words, limit=None):
        """Exit code, summary or message, history {output: array}, times, CPU seconds."""
        limit = limit or self.limit
        scene, table = self.folder / "scene.toml", self.folder / "h.csv"
        scene.write_text(text)
        table.unlink(missing_ok=True)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(
            [self.path, "simulate", str(scene), "--csv", str(table), "--json", *words],
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5)),
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        if done.returncode != 0:
            return done.returncode, done.stderr, None, None, cpu
        with open(table, newline="") as file:
            rows = list(csv.reader(file))
        values = np.array([[float(x) for x in row] for row in rows[1:]])
        history = collections.defaultdict(list)
        for i, name in enumerate(rows[0][1:], 1):
            history[name.split(".")[0]].append(values[:, i])
        return 0, json.loads(done.stdout), {k: np.stack(v, axis=1) for k, v in history.items()}, values[:, 0], cpu


def compare(scene, history, truth):
    """Largest error over outputs and times relative to the output's scale, and where."""
    worst, where = 0.0, "-"
    for name, true in truth.items():
        # Columns without a truth are NaN. A reaction is two vectors: force and moment.
        for part in (slice(0, 3), slice(3, 6)) if true.shape[1] == 6 else (slice(None),):
            known = ~np.isnan(true[:, part]).all(axis=0)
            if not known.any():
                continue
            there = ~np.isnan(true[:, part][:, known]).any(axis=1)  # samples that have a truth
            a, b = history[name][there, part][:, known], true[there, part][:, known]
            if scene.sizes_only:
                a, b = abs(a), abs(b)
            difference = np.linalg.norm(a - b, axis=1).max()
            scale = scene.scales.get(name)
            scale = scale(b) if callable(scale) else scale or (b.max(axis=0) - b.min(axis=0)).max()
            # The moment of a reaction that is a plain force (or its force, of a plain moment) is rounding of the other one.
            rounding = ROUNDING if callable(scene.truth) else ROUNDING_OF_RUNS
            if true.shape[1] == 6 and difference <= rounding * np.nanmax(abs(true)):
                continue
            error = difference / scale if scale > 0 else (0.0 if difference == 0 else np.inf)
            if not error <= worst:
                worst, where = float(error), name
    return worst, where


def judge(program, scene):
    """(verdict, error, claim, what was said, CPU seconds). Verdicts: right, warned, refused, silent, slow, broken, open (no truth)."""
    code, summary, history, times, cpu = program.run(scene.text, scene.words)
    if code != 0:
        message = summary.strip().splitlines()
        said = next((line for line in message if not line.startswith("simulating")), "")
        if code in (1, 2):
            return "refused", None, None, said, cpu
        slow = cpu >= program.limit - 1 or code == -signal.SIGXCPU
        return ("slow" if slow else "broken"), None, None, f"exit {code} {said}", cpu
    if not all(np.isfinite(v).all() for v in history.values()):
        return "broken", None, None, "numbers that are not finite", cpu
    estimate = (summary["simulation"].get("error_estimate") or {}).get("relative") or 0.0
    claim = scene.claim if scene.claim is not None else DEFAULT_CLAIM + ESTIMATES * estimate
    if callable(scene.truth):
        try:
            truth = find_truth(scene.truth, times, program.truth_limit)
        except NoTruth as reason:
            return "open", None, None, str(reason), cpu
    else:
        richer = scene.truth
        code, said, truth, _, _ = program.run(richer, scene.truth_words, program.truth_limit)
        if code == 0 and scene.divided and any("bends by up to" in warning for warning in said["simulation"]["warnings"]):
            richer = scene.divided
            code, said, truth, _, _ = program.run(richer, scene.truth_words, program.truth_limit)
        if code == -signal.SIGXCPU:
            return "open", None, None, f"the richer model takes more than {program.truth_limit} CPU s", cpu
        if code != 0:
            return "broken", None, None, "the richer model: " + said.strip()[-300:], cpu
    error, where = compare(scene, history, truth)
    warnings = summary["simulation"]["warnings"]
    if error <= claim:
        return "right", error, claim, ("warned: " + warnings[0] if warnings else ""), cpu
    if warnings:
        return "warned", error, claim, warnings[0], cpu
    if scene.confirm_words:
        code, said, other, _, _ = program.run(richer, scene.confirm_words)
        if code == 0 and compare(scene, other, truth)[0] > 0.5 * error:
            return "open", error, claim, "the richer model by two methods differs as much", cpu
    return "silent", error, claim, where, cpu


def keep(folder, program, scene, seed, verdict, error, claim, said):
    """The scene and what it gives, for whoever mends it."""
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    name = f"{scene.kind}_{seed}_{scene.number}"
    (folder / f"{name}.toml").write_text(
        f"# {scene.what}\n# {verdict}: error {error}, claim {claim}; {said}\n# words: {' '.join(scene.words)}\n" + scene.text
    )
    if callable(scene.truth):
        times = np.linspace(0, float(scene.text.split("duration = ")[1].split()[0]), 11)
        try:
            truth = find_truth(scene.truth, times, program.truth_limit)
        except NoTruth:
            truth = {}
        lines = [
            "t,"
            + ",".join(
                f"{k}.{('x', 'y', 'z', 'mx', 'my', 'mz')[c] if v.shape[1] > 1 else ''}".rstrip(".")
                for k, v in truth.items()
                for c in range(v.shape[1])
            )
        ]
        lines += [",".join(f"{x:.12g}" for x in [t, *(a for v in truth.values() for a in v[i])]) for i, t in enumerate(times)]
        (folder / f"{name}_truth.csv").write_text("\n".join(lines) + "\n")
    else:
        (folder / f"{name}_truth.toml").write_text(f"# words: {' '.join(scene.truth_words)}\n" + scene.truth)
    with open(folder / "LIST", "a") as file:
        numbers = "" if error is None else f" error {error:.3g}, claim {claim:.3g}, in {said}"
        file.write(f"{time.strftime('%H:%M')} {name}: {verdict}{numbers or ' ' + said}; {scene.what}\n")


def title(kind):
    """What a kind is, from its docstring."""
    line = kind.__doc__.splitlines()[0].rstrip(".")
    return line.replace("Asked: ", "Asked for an accuracy, ") if line.startswith("Asked: ") else line.split(":")[0]


def table(rows):
    lines = [
        "| kind of scene | scenes | right | largest error | right and warned | warned, wrong | refused | silent, slow, broken | open | "
        "CPU s, median |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    total = collections.Counter()
    for kind, results in rows.items():
        n = collections.Counter(v[0] for v in results)
        n["both"] = sum(v[0] == "right" and v[3].startswith("warned") for v in results)
        total.update(n)
        largest = max((v[1] for v in results if v[0] == "right"), default=float("nan"))
        cpu = float(np.median([v[4] for v in results]))
        lines.append(
            f"| {title(kind)} | {len(results)} | {n['right']} | {largest:.1e} | {n['both']} | {n['warned']} | {n['refused']} | "
            f"{n['silent'] + n['slow'] + n['broken']} | {n['open']} | {cpu:.2f} |"
        )
    count = sum(len(v) for v in rows.values())
    lines.append(
        f"| all | {count} | {total['right']} | | {total['both']} | {total['warned']} | {total['refused']} | "
        f"{total['silent'] + total['slow'] + total['broken']} | {total['open']} | |"
    )
    return "\n".join(lines)


def replace_table(path, text):
    page = path.read_text()
    begin, end = "<!-- table -->\n", "<!-- end -->"
    path.write_text(page[: page.index(begin) + len(begin)] + text + "\n" + page[page.index(end) :])


def judge_one(task):
    """A row: kind, seed, number, verdict, error, claim, what was said, CPU seconds, what the scene is. Runs in a process of its own."""
    path, limits, name, seed, number, folder = task
    kind = next(k for k in KINDS if k.__name__ == name)
    with tempfile.TemporaryDirectory(prefix="flexframe_trust_") as place:
        program = Program(path, place, *limits)
        scene = make(kind, seed, number)
        verdict, error, claim, said, cpu = judge(program, scene)
        if folder and verdict in BAD:
            keep(folder, program, scene, seed, verdict, error, claim, said)
    return [name, seed, number, verdict, error, claim, said, cpu, scene.what]


def judge_all(tasks, jobs):
    """Rows as they come."""
    if jobs == 1:
        yield from map(judge_one, tasks)
        return
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        for done in concurrent.futures.as_completed([pool.submit(judge_one, t) for t in tasks]):
            yield done.result()


def main():
    parser = suite_parser(__doc__, "kind", "number", "keep", "table", "rows", "short", count=20, limit=60, truth_limit=300, jobs=1)
    parser.add_argument("--quiet", action="store_true")
    add_shard(parser)
    args = parser.parse_args()
    if args.short:
        args.kind, args.count = SHORT, len(SHORT)
    kinds = [k for k in KINDS if not args.kind or k.__name__ in args.kind]
    rows = []
    if args.rows and args.rows.exists():
        rows = [json.loads(line) for line in args.rows.read_text().splitlines()]
    known = {tuple(row[:3]) for row in rows}
    tasks = []
    for i in range(args.count):
        name, number = kinds[i % len(kinds)].__name__, i // len(kinds) if args.number is None else args.number
        if (name, args.seed, number) not in known and in_shard(i, args.shard):
            tasks.append((args.program, (args.limit, args.truth_limit), name, args.seed, number, args.keep))
    for row in judge_all(tasks, args.jobs):
        rows.append(row)
        if args.rows:
            with open(args.rows, "a") as file:
                file.write(json.dumps(row) + "\n")
        name, seed, number, verdict, error, claim, said, cpu, what = row
        if verdict in BAD or not args.quiet:
            numbers = "" if error is None else f"error {error:.2e} claim {claim:.2e} "
            print(f"{verdict:8} {name} {seed} {number}: {numbers}{cpu:.2f} s; {what}; {said[:200]}", flush=True)
    count = collections.Counter(row[3] for row in rows)
    print(", ".join(f"{count[v]} {v}" for v in ("right", "warned", "refused", *BAD, "open")))
    if args.table:
        found = {k: [row[3:8] for row in rows if row[0] == k.__name__] for k in KINDS}
        replace_table(args.table, table({k: v for k, v in found.items() if v}))
    sys.exit(1 if any(count[v] for v in BAD) else 0)


if __name__ == "__main__":
    main()
