"""Hashes of the histories of all examples and hard cases: bits.py FLEXFRAME FILE [--only NAME ...] [--long]; bits.py --compare BEFORE AFTER

A line a history: name, number of the run, SHA-256 of what the run wrote or of its refusal. --compare names what differs between two builds
of the program; exit 1 if anything does. A change that shall keep the motion runs it before and after.
"""
import argparse
import hashlib
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from run_cases import Missed, Runner, cases  # noqa: E402

root = pathlib.Path(__file__).resolve().parents[2]


def digest(data):
    return hashlib.sha256(data).hexdigest()[:32]


class Recorder(Runner):
    """A Runner that keeps the hash of each history."""

    def __init__(self, *words):
        super().__init__(*words)
        self.seen = []

    def simulate(self, text):
        code, out, err, csv = super().simulate(text)
        self.seen.append(digest(csv.read_bytes() if csv.exists() else f"{code} {err.replace(str(self.folder), '')}".encode()))
        return code, out, err, csv


def example(program, scene, folder):
    csv = folder / "h.csv"
    csv.unlink(missing_ok=True)
    done = subprocess.run([program, "simulate", scene, "--csv", csv, "--no-error-estimate"], capture_output=True, text=True)
    return digest(csv.read_bytes() if csv.exists() else f"{done.returncode} {done.stderr}".replace(str(root), "").encode())


def record(options):
    scenes = sorted(p for p in (root / "examples").glob("**/*.toml") if "[simulation]" in p.read_text() and "studies" not in p.parts)
    with open(options.files[1], "w") as file, tempfile.TemporaryDirectory(prefix="flexframe_bits_") as folder:
        for scene in scenes:
            name = scene.relative_to(root).as_posix()
            if not options.only or name in options.only:
                print(name, 0, example(options.files[0], scene, pathlib.Path(folder)), file=file, flush=True)
        for c in cases:
            if options.only and c["name"] not in options.only or c["long"] and not options.long:
                continue
            run = Recorder(options.files[0], folder, 300)
            try:
                c["measure"](run)
            except (Missed, AssertionError) as e:
                print(f"{c['name']}: {e}", file=sys.stderr)
            for number, kept in enumerate(run.seen):
                print(c["name"], number, kept, file=file, flush=True)


def compare(before, after):
    a, b = ({line.rsplit(" ", 1)[0]: line for line in pathlib.Path(f).read_text().splitlines()} for f in (before, after))
    other = sorted(name for name in a.keys() | b.keys() if a.get(name) != b.get(name))
    for name in other:
        print(f"{name}: {'differs' if name in a and name in b else 'is in one file only'}")
    print(f"{len(a.keys() & b.keys())} histories, {len(other)} differ")
    return 1 if other or not a else 0


words = argparse.ArgumentParser()
words.add_argument("files", nargs=2)
words.add_argument("--compare", action="store_true")
words.add_argument("--long", action="store_true")
words.add_argument("--only", nargs="*")
options = words.parse_args()
if options.compare:
    sys.exit(compare(*options.files))
record(options)
sys.stdout.flush()
os._exit(0)
