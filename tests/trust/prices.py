"""What default runs cost:  prices.py FLEXFRAME [--count N] [--seed S] [--kind NAME ...] [--rows FILE] [--table PAGE] [--limit S]

Random scenes of run_trust.py that ask for no accuracy, by default and plain (--no-error-estimate --no-effect-check). Two prices, both of
the CPU time of the whole default process: over that of the plain one, and over that of the run that stays, which is made with the effects
that the motion calls for and perhaps at a tighter tolerance (the plain process with the time of that run's integration). Exit 1 where the
latter is above --most and the run that stays takes more than 0.1 s.

  --rows FILE     results go there line by line; what is there is not run again
  --table PAGE    the table goes between the markers 'prices of checks' and 'end prices of checks' of a Markdown page: the dearest
"""
import json
import pathlib
import statistics
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from arguments import suite_parser  # noqa: E402
from run_trust import KINDS, Program, make  # noqa: E402

PLAIN = ("--no-error-estimate", "--no-effect-check")
COUNTS = 0.1  # CPU s of a run that stays: a start takes 0.02
REPEATS = 3  # of runs shorter than half a second, of which the least counts


def least(program, scene, words):
    """Exit code, summary, least CPU seconds of a few runs."""
    code, summary, _, _, cpu = program.run(scene.text, words)
    for _ in range(REPEATS - 1 if code == 0 and cpu < 0.5 else 0):
        cpu = min(cpu, program.run(scene.text, words)[4])
    return code, summary, cpu


def of(program, kind, seed, number):
    """[kind, seed, number, plain, default, run that stays, tolerance]: CPU s; None for a scene that asks for an accuracy or is refused."""
    scene = make(kind, seed, number)
    if scene.claim is not None:
        return None
    code, summary, plain = least(program, scene, (*scene.words, *PLAIN))
    if code != 0:
        return None
    code, said, default = least(program, scene, scene.words)
    if code != 0:
        return None if code in (1, 2) else [kind.__name__, seed, number, plain, default, plain, 0.0]
    first, last = summary["simulation"], said["simulation"]
    stays = max(0.0, plain - first["cpu_seconds"]) + last["cpu_seconds"]
    return [kind.__name__, seed, number, plain, default, stays, last["tolerance"]]


def table(rows, dearest):
    lines = [
        "| scene | plain, CPU s | the run that stays | its tolerance | default | over plain | over the run that stays |",
        "|---|---|---|---|---|---|---|",
    ]
    for kind, seed, number, plain, default, stays, tolerance in sorted(rows, key=lambda r: r[5] - r[4])[:dearest]:
        lines.append(
            f"| {kind} {seed}.{number} | {plain:.2f} | {stays:.2f} | {tolerance:.0e} | {default:.2f} | {default / plain:.1f} | "
            f"{default / stays:.1f} |"
        )
    return "\n".join(lines)


def told(name, prices):
    if not prices:
        return f"{name}: none"
    ninth = sorted(prices)[int(0.9 * (len(prices) - 1) + 0.5)]
    return f"{name}: {len(prices)} scenes, median {statistics.median(prices):.2f}, ninth decile {ninth:.1f}, worst {max(prices):.1f}"


def main():
    parser = suite_parser(__doc__, "kind", "number", "rows", "table", count=40, limit=120)
    parser.add_argument("--most", type=float, default=5.0)
    args = parser.parse_args()
    kinds = [k for k in KINDS if not args.kind or k.__name__ in args.kind]
    rows = [json.loads(x) for x in args.rows.read_text().splitlines()] if args.rows and args.rows.exists() else []
    known = {tuple(r[:3]) for r in rows}
    with tempfile.TemporaryDirectory(prefix="flexframe_prices_") as folder:
        program = Program(args.program, folder, args.limit)
        for i in range(args.count):
            # Spread over all kinds where there are fewer scenes than these.
            kind = kinds[i * len(kinds) // args.count if args.count < len(kinds) else i % len(kinds)]
            number = args.number if args.number is not None else i // len(kinds)
            row = None if (kind.__name__, args.seed, number) in known else of(program, kind, args.seed, number)
            if row is None:
                continue
            rows.append(row)
            print(
                f"{row[0]} {number}: plain {row[3]:.2f}, stays {row[5]:.2f} ({row[6]:.0e}), default {row[4]:.2f}, "
                f"prices {row[4] / row[3]:.1f}, {row[4] / row[5]:.1f}",
                flush=True,
            )
            if args.rows:
                with open(args.rows, "a") as file:
                    file.write(json.dumps(row) + "\n")
    long = [r for r in rows if r[5] > COUNTS]
    for name, some in (("all", rows), (f"runs that stay above {COUNTS:g} s", long)):
        print(told(f"{name}, over plain", [r[4] / r[3] for r in some]))
        print(told(f"{name}, over the run that stays", [r[4] / r[5] for r in some]))
    if args.table:
        page = args.table.read_text()
        begin, end = "<!-- prices of checks -->\n", "<!-- end prices of checks -->"
        text = table(rows, 20)
        args.table.write_text(page[: page.index(begin) + len(begin)] + text + "\n" + page[page.index(end) :])
    sys.exit(1 if any(r[4] > args.most * r[5] for r in long) else 0)


if __name__ == "__main__":
    main()
