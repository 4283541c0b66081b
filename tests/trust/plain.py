"""Cases as a stranger writes them from SCENE.md alone, run with defaults: plain.py FLEXFRAME [--only NAME ...] [--table FILE]

Each case yields scenes with a truth that the program had no part in (a formula, numpy, scipy). A scene is right within 1 % (or the accuracy
that it asks for) of the output's range, told where it is farther off and warned of, refused where it ends with a message; a number farther
off without a warning is silent: there must be none. Exit 1 if there is one, or a scene that ends without a message.

  --table FILE    replaces the table in a Markdown page, between its markers
  --jobs N        scenes at a time (1)
  --limit S       CPU seconds a run may take (90)
  --keep FOLDER   scenes that are not right go there
"""
import collections
import concurrent.futures
import functools
import json
import multiprocessing
import pathlib
import subprocess
import sys
import tempfile

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from arguments import suite_parser  # noqa: E402
import cases.bodies  # noqa: E402, F401
import cases.effects  # noqa: E402, F401
import cases.elastic_machines  # noqa: E402, F401
import cases.events  # noqa: E402, F401
import cases.frames  # noqa: E402, F401
import cases.mechanisms  # noqa: E402, F401
import cases.scales  # noqa: E402, F401
import cases.second_order  # noqa: E402, F401
import cases.small_motions  # noqa: E402, F401
import cases.states  # noqa: E402, F401
import cases.stresses  # noqa: E402, F401
import cases.touching  # noqa: E402, F401
import cases.toys  # noqa: E402, F401
from cases.case import CASES, Modes  # noqa: E402
from run_trust import Program, compare, replace_table  # noqa: E402

BAD = ("silent", "slow", "broken", "not refused")


def judge_modes(program, scene):
    """As judge, of small motions."""
    path = program.folder / "scene.toml"
    path.write_text(scene.text)
    done = subprocess.run([program.path, "check", str(path), "--json"], capture_output=True, text=True)
    if done.returncode:
        return "refused" if done.returncode in (1, 2) else "broken", None, done.stderr.strip(), 0.0
    found = json.loads(done.stdout)
    modes = found["modes"]
    error, where = 0.0, ""
    for pole in scene.poles:
        nearest = min((complex(m["real"], m["imaginary"]) for m in modes), key=lambda z: abs(z - pole), default=complex("inf"))
        off = abs(nearest - pole) / (scene.scale or abs(pole))
        if off > error:
            error, where = off, f"{nearest:.6g} for {pole:.6g}"
    kinds = collections.Counter(m["kind"] for m in modes)
    if kinds["unstable"] != scene.unstable or (scene.rigid is not None and kinds["rigid"] != scene.rigid):
        return "silent", error, f"kinds {dict(kinds)}", 0.0
    warned = " ".join(w for w in found.get("warnings", []))
    if error > scene.claim:
        return ("told" if warned else "silent"), error, f"{where} {warned}", 0.0
    return "right", error, warned, 0.0


def judge(program, scene):
    """(verdict, error, what was said, CPU seconds)."""
    if isinstance(scene, Modes):
        return judge_modes(program, scene)
    code, summary, history, times, cpu = program.run(scene.text, scene.words)
    if code != 0:
        lines = [line for line in summary.strip().splitlines() if not line.startswith("simulating")]
        if cpu >= program.limit - 1 or code not in (1, 2):
            return "slow" if cpu >= program.limit - 1 else "broken", None, f"exit {code} " + " ".join(lines[:1]), cpu
        return "refused", None, " ".join(lines[:1]), cpu
    warnings = summary["simulation"]["warnings"]
    said = warnings[0] if warnings else ""
    if scene.truth is None:
        return ("told" if warnings else "not refused"), None, said, cpu
    error, where = compare(scene, history, scene.truth(times))
    if error <= (scene.claim or 0.01):
        return "right", error, said, cpu
    return ("told", error, f"{where}: {said}", cpu) if warnings else ("silent", error, where, cpu)


@functools.cache
def scenes(name):
    return list(CASES[name].make())


def judge_one(task):
    path, limit, name, number, folder = task
    scene = scenes(name)[number]
    with tempfile.TemporaryDirectory(prefix="flexframe_plain_") as place:
        verdict, error, said, cpu = judge(Program(path, place, limit), scene)
    if folder and verdict != "right":
        pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
        (pathlib.Path(folder) / f"{name}_{number}.toml").write_text(
            f"# {verdict} {error} {said}\n# {getattr(scene, 'words', 'check')}\n{scene.text}"
        )
    return name, number, scene.what, verdict, error, said, cpu


def table(rows):
    lines = [
        "| case | scenes | right | largest error | told | refused | silent | warned though right | besides held by |",
        "|---" * 9 + "|",
    ]
    for name, case in CASES.items():
        found = [row for row in rows if row[0] == name]
        if not found:
            continue
        n = collections.Counter(row[3] for row in found)
        errors = [row[4] for row in found if row[3] == "right"]
        largest = f"{max(errors):.1e}" if errors else "-"
        alarms = sum(row[3] == "right" and bool(row[5]) for row in found)
        bad = sum(n[v] for v in BAD)
        lines.append(
            f"| {case.says} | {len(found)} | {n['right']} | {largest} | {n['told']} | {n['refused']} | {bad} | {alarms} | {case.held} |"
        )
    return "\n".join(lines)


def main():
    parser = suite_parser(__doc__, "table", "keep", jobs=1, limit=90)
    parser.add_argument("--only", action="append", default=[])
    args = parser.parse_args()
    names = [name for name in CASES if not args.only or any(name.startswith(word) for word in args.only)]
    tasks = [(args.program, args.limit, name, k, args.keep) for name in names for k in range(len(scenes(name)))]
    rows = []
    # Processes that begin afresh: a fork has the libraries' locks but not their threads, and waits for ever.
    pool = concurrent.futures.ProcessPoolExecutor(args.jobs, multiprocessing.get_context("spawn")) if args.jobs > 1 else None
    for row in (pool.map if pool else map)(judge_one, tasks):
        rows.append(row)
        name, number, what, verdict, error, said, cpu = row
        figure = "" if error is None else f"{error:.1e} "
        print(f"{verdict:8} {name} {number}: {figure}{cpu:.2f} s; {what}; {said[:220]}", flush=True)
    count = collections.Counter(row[3] for row in rows)
    print(", ".join(f"{count[v]} {v}" for v in ("right", "told", "refused", *BAD)))
    if args.table:
        replace_table(args.table, table(rows))
    sys.exit(1 if any(count[v] for v in BAD) else 0)


if __name__ == "__main__":
    main()
