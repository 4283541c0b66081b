"""Asked accuracies against what is kept:  asked.py FLEXFRAME [--count N] [--seed S] [--limit S] [--table FILE]

Scenes of kinds/asked.py, asked for 1e-1 .. 1e-4 by turns. A run has to end within --limit CPU seconds with the accuracy kept or with a
warning; exit 1 if one is wrong without a word, or too slow. The table goes between the markers 'asked' and 'end asked' of a Markdown page.
"""
import hashlib
import pathlib
import random
import sys
import tempfile

import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from arguments import suite_parser  # noqa: E402
from kinds.asked import KINDS  # noqa: E402
from run_trust import Program, compare  # noqa: E402


def follow(program, text, words, limit, kept):
    """Exit code and history of a truth; taken from the folder `kept` where an earlier build has followed the same scene."""
    place = kept and kept / (hashlib.sha256(repr((text, words)).encode()).hexdigest()[:24] + ".npz")
    if place and place.exists():
        return 0, dict(np.load(place))
    code, _, history, _, _ = program.run(text, words, limit)
    if place and code == 0:
        kept.mkdir(parents=True, exist_ok=True)
        np.savez_compressed(place, **history)
    return code, history


def main():
    parser = suite_parser(__doc__, "kind", "table", count=40, limit=95, truth_limit=300)
    parser.add_argument("--truths", type=pathlib.Path, help="folder in which histories of the truth are kept, for the next build")
    args = parser.parse_args()
    rows, bad = [], 0
    with tempfile.TemporaryDirectory(prefix="flexframe_asked_") as folder:
        program = Program(args.program, folder, args.limit)
        for i in range(args.count):
            kind, number = KINDS[i % len(KINDS)], i // len(KINDS)
            accuracy = 10.0 ** -(1 + (i + number) % 4)
            if args.kind and kind.__name__ not in args.kind:
                continue
            scene = kind(random.Random(f"{args.seed} {kind.__name__} {number}"), accuracy)
            code, summary, history, _, cpu = program.run(scene.text, scene.words)
            name = kind.__doc__.splitlines()[0].removeprefix("Asked: ").rstrip(".")
            if code != 0:
                said = summary.strip().splitlines()
                verdict = "refused" if code in (1, 2) else "slow or broken"
                bad += verdict != "refused"
                rows.append(f"| {name} | {accuracy:g} | - | - | - | {verdict} |")
                print(f"{verdict}: {kind.__name__} {number}, {accuracy:g}, {cpu:.1f} CPU s; {said[-1][:200] if said else ''}", flush=True)
                continue
            s = summary["simulation"]
            code, truth = follow(program, scene.truth, scene.truth_words, args.truth_limit, args.truths)
            error = compare(scene, history, truth)[0] if code == 0 else float("nan")
            if error > accuracy and not s["warnings"]:
                code, other = follow(program, scene.truth, scene.confirm_words, args.truth_limit, args.truths)
                if code == 0 and compare(scene, other, truth)[0] > 0.5 * error:
                    error = float("nan")  # the richer model by two methods differs as much
            estimate = s["error_estimate"]["relative"]
            ratio = s["accuracy"]["search_cpu_seconds"] / max(s["cpu_seconds"], 1e-3)
            verdict = "kept" if error <= accuracy else "warned" if s["warnings"] else "no truth" if error != error else "SILENT"
            bad += verdict == "SILENT"
            rows.append(f"| {name} | {accuracy:g} | {estimate:.1e} | {error:.1e} | {ratio:.0f} | {verdict} |")
            print(
                f"{verdict}: {kind.__name__} {number}, asked {accuracy:g}, estimated {estimate:.1e}, true {error:.1e}; {cpu:.1f} CPU s,"
                f" search/run {ratio:.0f}; {scene.what}; {'; '.join(s['warnings'])[:200]}",
                flush=True,
            )
    print(f"{len(rows)} scenes, {bad} wrong without a word or too slow")
    if args.table:
        lines = ["| scene | asked | estimated | true | CPU time of the search / of the run | verdict |", "|---|---|---|---|---|---|", *rows]
        page = args.table.read_text()
        begin, end = "<!-- asked -->\n", "<!-- end asked -->"
        args.table.write_text(page[: page.index(begin) + len(begin)] + "\n".join(lines) + "\n" + page[page.index(end) :])
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
