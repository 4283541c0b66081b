#!/usr/bin/env python3
"""What points of a sweep cost: the figures of sim/sweep/SCALE.md.

    sweep_scale.py FLEXFRAME [--points N] [--duration S] [--kill S] [--made N] [--keep FOLDER]

N points (500) of the elastic slider-crank over its first S seconds (0.4), on two workers: CPU seconds, memory, files and bytes; with
--kill the sweep is ended by kill -9 after so many seconds and resumed. What a point costs beside its integration is counted in
instructions (valgrind), which other work on the machine does not change. --made copies the rows to N points and puts
these together (`flexframe collect`). One line of figures each.
"""
import argparse
import hashlib
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import tempfile
import time

SCENE = pathlib.Path(__file__).resolve().parents[3] / "examples" / "slider_crank.toml"
SETTINGS = ["body.rod.length=0.30:0.308", "body.crank.length=0.15:0.154", "body.rod.material.youngs_modulus=4.5e7:5.5e7"]
SETTINGS += ["body.rod.keep_modes=12", "body.rod.keep_static=false", "body.crank.keep_modes=3", "body.crank.keep_static=false"]


def words(flexframe, points, duration, out):
    settings = [word for s in [f"simulation.duration={duration}", *SETTINGS] for word in ("--set", s)]
    responses = ["--response", "deflection=max(abs(rod_middle.y))", "--response", "slide=range(slider.x)"]
    more = ["--tolerance", "1e-5", "--method", "dirk", "--no-effect-check", "--workers", "2", "-o", out, "-q"]
    return [flexframe, "sweep", SCENE, "--sample", f"lhs:{points}", *settings, *responses, *more]


def used():
    times = resource.getrusage(resource.RUSAGE_CHILDREN)
    return times.ru_utime + times.ru_stime


def children(process):
    return [int(p) for p in pathlib.Path(f"/proc/{process}/task/{process}/children").read_text().split()]


def resident(process):
    for line in pathlib.Path(f"/proc/{process}/status").read_text().splitlines():
        if line.startswith("VmHWM"):
            return int(line.split()[1]) / 1024
    return 0.0


def watched(command, kill=0.0):
    """Runs it; largest memory (MB) of the parent and of a worker, early and at the last look; wall seconds."""
    began, looks = time.monotonic(), []
    process = subprocess.Popen(list(map(str, command)), stdout=subprocess.DEVNULL)
    while process.poll() is None:
        time.sleep(0.2)
        try:
            looks.append((resident(process.pid), max((resident(c) for c in children(process.pid)), default=0.0)))
        except (OSError, ValueError):
            pass
        if kill and time.monotonic() - began > kill:
            process.send_signal(signal.SIGKILL)
            process.wait()
            return looks
    if process.returncode != 0:
        raise SystemExit(f"{command[0]} ended with {process.returncode}")
    return looks


def rows_of(folder):
    return [line for file in sorted((folder / "rows").glob("*.rows")) for line in file.read_bytes().splitlines()[1:]]


def cpu_of(rows):
    return sum(float(row.split(b"\t")[2]) for row in rows)


def size(path):
    return sum(f.stat().st_size for f in path.rglob("*") if f.is_file()) if path.is_dir() else path.stat().st_size


def instructions(flexframe, duration, work):
    """Of one point in the middle of the ranges: from the scene as text to its histories, and of the integration alone."""
    settings = [word for s in [f"simulation.duration={duration}", *SETTINGS[3:]] for word in ("--set", s)]
    command = [flexframe, "simulate", SCENE, "-o", work / "point.h5", "-q", *settings, "--tolerance", "1e-5", "--method", "dirk"]
    valgrind = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={work / 'callgrind'}"]
    subprocess.run(list(map(str, [*valgrind, *command, "--no-effect-check"])), check=True, capture_output=True)
    annotate = ["callgrind_annotate", "--inclusive=yes", "--threshold=100", str(work / "callgrind")]
    text = subprocess.run(annotate, check=True, capture_output=True, text=True).stdout

    def inclusive(name):
        found = re.search(rf"^ *([0-9,]+) .*:{re.escape(name)}", text, re.MULTILINE)
        return int(found.group(1).replace(",", "")) if found else 0

    names = ("flexframe::sim::parse_document(", "flexframe::sim::make_scene(", "flexframe::sim::run_scene(")
    return sum(inclusive(n) for n in names), inclusive("flexframe::sim::integrate(")


def make_rows(folder, source, count):
    """A file of rows with so many points, made of those that are there; the design is widened to them."""
    file = next((folder / "rows").glob("*.rows"))
    head = file.read_bytes().split(b"\n", 1)[0]
    fields = [row.split(b"\t")[1:-1] for row in source]
    with open(file, "wb") as out:
        out.write(head + b"\n")
        for point in range(count):
            text = b"\t".join([b"%d" % point, *fields[point % len(fields)]])
            out.write(text + b"\t" + hashlib.sha256(text + b"\t").hexdigest()[:12].encode() + b"\n")
    return size(file)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flexframe")
    parser.add_argument("--points", type=int, default=500)
    parser.add_argument("--duration", type=float, default=0.4)
    parser.add_argument("--kill", type=float, default=0.0)
    parser.add_argument("--made", type=int, default=0)
    parser.add_argument("--keep", default="")
    options = parser.parse_args()
    work = pathlib.Path(options.keep or tempfile.mkdtemp())
    flexframe = pathlib.Path(options.flexframe).resolve()
    out = work / "sweep"
    if options.kill:
        watched(words(flexframe, options.points, options.duration, out), options.kill)
        print(f"killed        after {options.kill:g} s with {len(rows_of(out))} rows")
    before = used()
    there = len(rows_of(out)) if out.exists() else 0
    looks = watched([*words(flexframe, options.points, options.duration, out), "--resume"])
    rows = rows_of(out)
    beyond = used() - before - cpu_of(rows[there:])
    all_of_it = 1e3 * cpu_of(rows) / len(rows)
    print(f"points        {len(rows)} of {options.duration:g} s, {cpu_of(rows):.1f} CPU s in all, {all_of_it:.2f} ms a point")
    whole, integration = instructions(flexframe, options.duration, work)
    print(
        f"instructions  {whole / 1e6:.0f} million a point, beside its integration {100 * (whole - integration) / integration:.0f} % of that"
    )
    print(f"the sweep     {beyond:.2f} CPU s beyond the points: processes, rows, table, diagrams")
    parents, workers = zip(*looks)
    print(f"memory        parent {parents[0]:.0f} to {max(parents):.0f} MB, worker {max(workers):.1f} MB")
    sizes = [size(out / name) / 1e6 for name in ("rows", "table.csv", "table.h5")]
    print("disk          rows {:.2f} MB, table.csv {:.2f} MB, table.h5 {:.2f} MB".format(*sizes))
    if options.made:
        made = work / "made"
        shutil.rmtree(made, ignore_errors=True)
        one = [*words(flexframe, options.made, options.duration, made), "--shard", f"1/{min(100000, options.made)}"]
        subprocess.run(list(map(str, one)), check=True, stdout=subprocess.DEVNULL)
        for file in (made / "rows").glob("*.rows"):
            file.rename(made / "rows" / "shard_1_of_1.rows")
        bytes_of_rows = make_rows(made, rows, options.made)
        for plots in ("--no-plots", ""):
            before = used()
            looks = watched([flexframe, "collect", made, "-q", *([plots] if plots else [])])
            what = "table" if plots else "table and plots"
            print(f"made rows     {options.made}: {what} {used() - before:.1f} CPU s, {max((a for a, _ in looks), default=0):.0f} MB")
        sizes = [bytes_of_rows, size(made / "table.csv"), size(made / "table.h5")]
        print("disk          rows {:.0f} MB, table.csv {:.0f} MB, table.h5 {:.0f} MB".format(*(s / 1e6 for s in sizes)))
    if not options.keep:
        shutil.rmtree(work)


if __name__ == "__main__":
    main()
