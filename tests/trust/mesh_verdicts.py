"""Told errors of meshes against true ones, frequency by frequency: what meshes.py and large_meshes.py have in common.

"low" is a true error above 1 % that is told three times too small (and below 30 %), "silent" one without a warning; "high" an error told
above 1 % and three times too large.
"""
import collections
import pathlib
import sys
import tempfile

import numpy as np

MODES, TOLD, FACTOR = 6, 0.01, 3.0
USELESS = 0.3  # an error told above this says that the frequency is nothing to go by, however large it is


def verdicts(told, shapes, fine_shapes, truth):
    """[(true, told, verdict)]; told: the report of `reduce`, shapes (n, modes) at the same places, truth: of the fine mesh, Hz."""
    like = (shapes.T @ fine_shapes) ** 2 / np.outer((shapes**2).sum(0), (fine_shapes**2).sum(0))
    errors, out = told.get("mesh_errors") or [], []
    warned = any("mesh is coarse" in w or "error of the mesh" in w for w in told.get("warnings", []))
    for k, f in enumerate(told["frequencies"][:MODES]):
        match = int(np.argmax(like[k]))
        if like[k, match] < 0.6:
            continue  # no mode of the fine mesh among those that are looked at, or none that is like it at the few nodes of the coarse one
        true = abs(f / truth[match] - 1)
        if k >= len(errors):
            out.append((true, None, "silent" if true > TOLD and not warned else "untold"))
            continue
        e = errors[k]
        if true > TOLD and e < min(true / FACTOR, USELESS):
            verdict = "low" if warned else "silent"
        elif e > TOLD and e > FACTOR * true:
            verdict = "high"
        else:
            verdict = "right"
        out.append((true, e, verdict))
    return out


def judge_bodies(args, body_of, judge):
    """Bodies of the numbers that are asked for; judge(body, folder): (rows or None, note). Ends the program."""
    counts, by_kind = collections.Counter(), collections.defaultdict(collections.Counter)
    for number in range(args.count) if args.number is None else [args.number]:
        body = body_of(number)
        with tempfile.TemporaryDirectory(prefix="flexframe_meshes_") as folder:
            try:
                rows, note = judge(body, pathlib.Path(folder))
            except ValueError as refusal:
                rows, note = None, f"refused: {refusal}"
            except RuntimeError as failure:
                rows, note = None, "CalculiX: " + " ".join(str(failure).split())[-100:]
        if rows is None:
            counts["open"] += 1
            print(f"open     {number}: {body.what}: {note}", flush=True)
            continue
        for _, _, verdict in rows:
            counts[verdict] += 1
            by_kind[body.kind][verdict] += 1
        text = ", ".join(
            f"{100 * t:.2g}/{'-' if e is None else format(100 * e, '.2g')}{'' if v == 'right' else ' ' + v}" for t, e, v in rows
        )
        print(f"{number}: {body.what}: true/told %: {text}{note and '; ' + note}", flush=True)
    for kind, found in by_kind.items():
        print(f"{kind}: " + ", ".join(f"{n} {v}" for v, n in sorted(found.items())))
    print("all: " + ", ".join(f"{n} {v}" for v, n in sorted(counts.items())))
    judged = sum(counts.values()) - counts["open"]
    sys.exit(1 if counts["silent"] or counts["low"] + counts["high"] > 0.05 * judged else 0)
