"""Estimated errors against true ones:  estimates.py FLEXFRAME [--count N] [--seed S] [--kind NAME ...] [--rows FILE] [--table FILE]

Scenes of run_trust.py that ask for no accuracy, as a user would run them. Time integration: what the run tells against how far it is from
the same scene at a tolerance a thousand times tighter (a hundred where that is beyond what can be had). Total (with effects, elements,
modes): against the truth, whose errors are taken from the rows of run_trust.py where --rows names them. Kept: the true error lies between
a fifth and five times the estimate. Exit 1 if an estimate is too small by more than that and the true error is above 1e-6.
A run whose true and estimated errors are both below 1e-12 of the ranges counts as kept: rounding, of which no estimate can be right.

  --short         one scene of each of twenty kinds that cost little: what continuous integration runs
  --rows FILE     rows of run_trust.py (not changed)
  --done FILE     results go there line by line; what is there is not run again
  --table FILE    the table goes between the markers 'estimates' and 'end estimates' of a Markdown page
"""
import json
import pathlib
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from arguments import suite_parser  # noqa: E402
from run_trust import KINDS, Program, make, title  # noqa: E402

FACTOR, NOTHING = 5.0, 1e-12
WRONG = 1e-6  # a true error above that has to be told
SHORT = """decay pendulum double_pendulum tumbling bounce rubbing_block slider_crank crank_rocker belt dropped_ball landing_box brushing
forces_of_joints rubbing_loop bead maxwell scotch_yoke governor modal_q offset_tip""".split()


def apart(history, other):
    """Largest difference of two histories over their outputs, relative to its range; what does not move (energy) does not count."""
    worst = 0.0
    for name, b in other.items():
        for part in (slice(0, 3), slice(3, 6)) if b.shape[1] == 6 else (slice(None),):
            span = np.ptp(b[:, part], axis=0).max()
            if span > max(1e-5 * abs(b[:, part]).max(), 1e-9 * abs(b).max(), 1e-12):  # not a moment or a rate that is zero by construction
                worst = max(worst, np.linalg.norm(history[name][:, part] - b[:, part], axis=1).max() / span)
    return float(worst)


def of(program, kind, seed, number):
    """[kind, seed, number, estimate, true error of time], or None where there is nothing to compare."""
    scene = make(kind, seed, number)
    if scene.claim is not None:
        return None
    code, summary, history, _, _ = program.run(scene.text, scene.words)
    if code != 0:
        return None
    run = summary["simulation"]
    estimate = (run.get("error_estimate") or {}).get("relative")
    if not estimate:
        return None
    # A tighter run that says it is further off than this one (accelerations at the edge of rounding) is no truth: a less tight one is.
    for factor in (1e-3, 1e-2):
        tight = max(1e-13, factor * run["tolerance"])
        code, said, other, _, _ = program.run(scene.text, (*scene.words, "--set", f"simulation.tolerance={tight!r}"), 3 * program.limit)
        if code == 0 and ((said["simulation"].get("error_estimate") or {}).get("relative") or 0.0) <= estimate:
            return [kind.__name__, seed, number, estimate, apart(history, other)]
    return [kind.__name__, seed, number, estimate, None]


def verdict(estimate, true):
    if max(estimate, true) < NOTHING or estimate / FACTOR <= true <= estimate * FACTOR:
        return "kept"
    return "too large" if true < estimate else "too small"


def shortened(text, most=112):
    """The text up to its last comma or semicolon before `most` characters, if it is longer: rows of a page have 140."""
    if len(text) <= most:
        return text
    head = text[:most]
    at = max(head.rfind(","), head.rfind(";"))
    return head[:at] if at > 0 else head[: head.rfind(" ")]


def table(done, errors):
    """Rows by kind: how many estimates are kept, too large, too small; median of true over estimated."""
    heads = ["kind of scene", "scenes", "time: kept", "estimate too large", "too small", "largest true/told"]
    if errors:
        heads += ["total: kept", "too large", "too small"]
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    sums = np.zeros(7, int)
    for kind in KINDS:
        rows = [r for r in done if r[0] == kind.__name__ and r[4] is not None]
        if not rows:
            continue
        time = [verdict(r[3], r[4]) for r in rows]
        total = [verdict(r[3], errors[tuple(r[:3])]) for r in rows if tuple(r[:3]) in errors]
        counts = [len(rows)] + [time.count(v) for v in ("kept", "too large", "too small")]
        counts += [total.count(v) for v in ("kept", "too large", "too small")]
        sums += counts
        largest = max(r[4] / r[3] for r in rows)
        totals = "".join(f" {n} |" for n in counts[4:]) if errors else ""
        lines.append(f"| {shortened(title(kind))} | " + " | ".join(map(str, counts[:4])) + f" | {largest:.2g} |" + totals)
    totals = "".join(f" {n} |" for n in sums[4:]) if errors else ""
    lines.append("| all | " + " | ".join(map(str, sums[:4])) + " | |" + totals)
    print(
        f"time: {sums[1]} of {sums[0]} kept, {sums[2]} too large, {sums[3]} too small; total: {sums[4]} of {sum(sums[4:])} kept, "
        f"{sums[5]} too large, {sums[6]} too small"
    )
    return "\n".join(lines)


def main():
    parser = suite_parser(__doc__, "kind", "short", "rows", "table", count=200, limit=60)
    parser.add_argument("--done", type=pathlib.Path)
    args = parser.parse_args()
    if args.short:
        args.kind, args.count = SHORT, len(SHORT)
    kinds = [k for k in KINDS if not args.kind or k.__name__ in args.kind]
    done = [json.loads(x) for x in args.done.read_text().splitlines()] if args.done and args.done.exists() else []
    known = {tuple(r[:3]) for r in done}
    with tempfile.TemporaryDirectory(prefix="flexframe_estimates_") as folder:
        program = Program(args.program, folder, args.limit)
        for i in range(args.count):
            kind, number = kinds[i % len(kinds)], i // len(kinds)
            if (kind.__name__, args.seed, number) in known:
                continue
            row = of(program, kind, args.seed, number) or [kind.__name__, args.seed, number, 0.0, None]
            done.append(row)
            if args.done:
                with open(args.done, "a") as file:
                    file.write(json.dumps(row) + "\n")
            if row[4] is not None and verdict(row[3], row[4]) != "kept":
                print(f"{row[0]} {number}: estimated {row[3]:.2e}, true {row[4]:.2e}", flush=True)
    errors = {}
    if args.rows:
        errors = {tuple(r[:3]): r[4] for r in map(json.loads, args.rows.read_text().splitlines()) if r[4] is not None}
    text = table(done, errors)
    if args.table:
        page = args.table.read_text()
        begin, end = "<!-- estimates -->\n", "<!-- end estimates -->"
        args.table.write_text(page[: page.index(begin) + len(begin)] + text + "\n" + page[page.index(end) :])
    wrong = [r for r in done if r[4] is not None and verdict(r[3], r[4]) == "too small" and r[4] > WRONG]
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
