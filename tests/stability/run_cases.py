"""Runs the hard cases of cases.py:  run_cases.py FLEXFRAME [--long | --all] [--only NAME ...] [--table FILE]

Exit 1 if a case misses its bound. --table replaces the table in a Markdown file between its markers.
"""
import argparse
import json
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from cases import cases  # noqa: E402
from shards import add_shard, in_shard  # noqa: E402


class Missed(Exception):
    pass


class Runner:
    """Calling it simulates a scene's text and returns its history; every number in it must be finite."""

    def __init__(self, program, folder, limit):
        self.program, self.folder, self.limit = program, pathlib.Path(folder), limit
        self.cpu = self.total = 0.0
        self.peak_memory, self.notes = 0, ""

    def start(self, text, *words):
        scene = self.folder / "scene.toml"
        scene.write_text(text)
        process = subprocess.Popen(
            [self.program, *map(str, words[:1]), str(scene), *map(str, words[1:])],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (self.limit, self.limit)),
        )
        with process.stdout, process.stderr:
            out, err = process.communicate()
        return process, out, err

    def simulate(self, text):
        csv = self.folder / "h.csv"
        csv.unlink(missing_ok=True)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        process, out, err = self.start(text, "simulate", "--csv", csv, "--json", "--no-error-estimate")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        self.total += self.cpu
        self.peak_memory = after.ru_maxrss * 1024
        if process.returncode < 0:
            raise Missed(f"killed by signal {-process.returncode} after {self.cpu:.1f} CPU s")
        return process.returncode, out, err, csv

    def __call__(self, text):
        code, out, err, csv = self.simulate(text)
        if code != 0:
            raise Missed(f"exit {code}: {err.strip()[-600:]}")
        summary = json.loads(out)
        self.notes = json.dumps(summary) + err
        self.summary = summary
        with open(csv) as file:
            names = file.readline().strip().split(",")
            columns = list(zip(*([float(x) for x in line.split(",")] for line in file)))
        for name, column in zip(names, columns):
            if not all(abs(x) < 1e300 for x in column):
                raise Missed(f"column {name} holds what is no number")
        return dict(zip(names, columns))

    def check(self, text):
        """What `check --json` says of a scene: its modes, and what they are about."""
        process, out, err = self.start(text, "check", "--json")
        if process.returncode != 0:
            raise Missed(f"check: exit {process.returncode}: {err.strip()[-600:]}")
        return json.loads(out)

    def fails(self, text, codes):
        """The message of a run that may end with one of these exit codes; empty if it went well."""
        code, out, err, csv = self.simulate(text)
        if code not in codes:
            raise Missed(f"exit {code}, wanted one of {codes}: {err.strip()[-600:]}")
        if code != 0 and csv.exists():
            raise Missed("a history was left by a run that failed")
        self.notes = out + err
        return err.strip() if code else ""

    def program_words(self, *words):
        """The finished process of any command; it must end well."""
        done = subprocess.run(
            [self.program, *map(str, words)],
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (self.limit, self.limit)),
        )
        if done.returncode != 0:
            raise Missed(f"{words[0]}: exit {done.returncode}: {done.stderr.strip()[-600:]}")
        return done


def number(x):
    return f"{x:.2g}" if isinstance(x, float) else str(x)


def main():
    words = argparse.ArgumentParser()
    words.add_argument("program")
    words.add_argument("--long", action="store_true")
    words.add_argument("--all", action="store_true")
    words.add_argument("--only", nargs="*")
    words.add_argument("--limit", type=int, default=120, help="CPU seconds a run may take")
    words.add_argument("--table", type=pathlib.Path)
    add_shard(words)
    options = words.parse_args()
    rows, failed = [], 0
    for c in (c for k, c in enumerate(cases) if in_shard(k, options.shard)):
        if (
            options.only is not None
            and c["name"] not in options.only
            or options.only is None
            and not options.all
            and c["long"] != options.long
        ):
            continue
        with tempfile.TemporaryDirectory(prefix="flexframe_hard_") as folder:
            run = Runner(options.program, folder, options.limit)
            try:
                measured = c["measure"](run)
                good, text = measured <= c["bound"], number(measured)
            except (Missed, AssertionError) as e:
                good, text = False, f"{type(e).__name__}: {e}"
        failed += not good
        print(f"{'ok    ' if good else 'FAILED'} {c['name']:26} {text} (bound {number(c['bound'])}), {run.total:.2f} CPU s", flush=True)
        rows.append(
            f"| {c['name']} | {c['hard']} | {c['invariant']} | {number(c['bound'])} | {text} |"
            f" {run.total:.1f} |{' nightly' if c['long'] else ''}"
        )
    if options.table:
        page = options.table.read_text()
        table = "| case | what is hard | invariant | bound | measured | CPU s |\n|---|---|---|---|---|---|\n" + "\n".join(r for r in rows)
        options.table.write_text(re.sub(r"(<!-- cases -->\n).*?(\n<!-- end -->)", lambda m: m[1] + table + m[2], page, flags=re.S))
    print("failed" if failed else "passed", f"({failed} of {len(rows)} cases missed their bounds)")
    sys.stdout.flush()
    os._exit(1 if failed else 0)


if __name__ == "__main__":
    main()
