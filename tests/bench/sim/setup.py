#!/usr/bin/env python3
"""What it takes from a scene file to the first step: reading, bodies, loops, start.

    setup.py BENCH_EVALUATION [SCENE...] [--ms]

BENCH_EVALUATION is the program of the target bench_evaluation; all scenes of examples/ where none are named. A line a scene, the dearest
first: million instructions (valgrind), which other work on the machine does not change, without those of the empty program; with --ms
the least CPU milliseconds of five besides.
"""
import argparse
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[3]


def instructions(program, *words):
    """Million instructions of the program; None where it fails."""
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", program, *words]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, cwd=ROOT)
    counted = re.search(r"Collected : (\d+)", done.stderr)
    return int(counted.group(1)) / 1e6 if done.returncode == 0 and counted else None


def main():
    words = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    words.add_argument("program", type=pathlib.Path)
    words.add_argument("scenes", nargs="*", type=pathlib.Path)
    words.add_argument("--ms", action="store_true")
    asked = words.parse_args()
    scenes = asked.scenes or sorted((ROOT / "examples").rglob("*.toml"))
    empty = instructions(asked.program.resolve(), "--setup") or 0.0
    rows = []
    for scene in scenes:
        count = instructions(asked.program.resolve(), "--setup", scene.resolve())
        if count is None:
            continue
        row = [count - empty, scene.resolve().relative_to(ROOT) if scene.resolve().is_relative_to(ROOT) else scene]
        if asked.ms:
            told = subprocess.run([asked.program.resolve(), "--setup", "--runs", "5", scene.resolve()], capture_output=True, text=True)
            row.append(float(told.stdout.split()[-2]))
        rows.append(row)
    for count, scene, *ms in sorted(rows, key=lambda row: -row[0]):
        print(f"{str(scene):<44}  {count:10.2f} million" + "".join(f"  {m:8.2f} ms" for m in ms))


if __name__ == "__main__":
    main()
