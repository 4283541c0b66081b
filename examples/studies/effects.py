#!/usr/bin/env python3
"""The table of automatic effects: examples/studies/effects.py build/release/flexframe > examples/studies/effects.md

Every example is simulated to an accuracy of 1e-2 with effects = "auto" and with sets chosen by hand; the error of each is told against the
richest set at fine tolerance and elements. CPU seconds are of the last run, and of the search that found the setting."""
import csv
import json
import pathlib
import re
import subprocess
import sys
import tempfile

flexframe = pathlib.Path(sys.argv[1]).resolve()
examples = pathlib.Path(__file__).resolve().parent.parent
asked = 1e-2
sets = {"auto": '"auto"', "bending": '["bending_xy"]', "bending, stiffening": '["bending_xy", "stiffening"]', "bending, stiffening, axial": '["bending_xy", "stiffening", "axial"]'}


def history(path):
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    return {name: [float(row[i]) for row in rows[1:]] for i, name in enumerate(rows[0])}


def error(found, wanted):
    groups = {}
    for name in wanted:
        if name not in ("t", "energy"):
            groups.setdefault(name.rsplit(".", 1)[0], []).append(name)
    return max(max(abs(a - b) for n in names for a, b in zip(found[n], wanted[n])) / max(max(wanted[n]) - min(wanted[n]) for n in names) for names in groups.values())


def simulate(text, folder, *words):
    scene = folder / "scene.toml"
    scene.write_text(text)
    done = subprocess.run([flexframe, "simulate", scene, "--csv", folder / "h.csv", "--json", *words], capture_output=True, text=True)
    if done.returncode != 0:
        return None, done.stderr.strip().splitlines()[-1]
    return history(folder / "h.csv"), json.loads(done.stdout)["simulation"]


print("# Automatic effects against hand-chosen sets\n\nMade by `examples/studies/effects.py build/release/flexframe`; accuracy 1e-2 asked of every run.\n")
print("| scene | effects | what was chosen | error | estimate | CPU s | CPU s of the search |\n|---|---|---|---|---|---|---|")
with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    for scene in sys.argv[2:] or ["pendulum", "slider_crank"]:
        plain = (examples / f"{scene}.toml").read_text()
        put = lambda words: re.sub(r"^effects = .*$", f"effects = {words}", plain, flags=re.M)
        fine = re.sub(r"^elements = (\d+)", lambda m: f"elements = {2 * int(m[1])}", put(sets["bending, stiffening"]), flags=re.M)
        truth, _ = simulate(fine, folder, "--tolerance", "1e-8", "--no-error-estimate")
        for label, words in sets.items():
            found, summary = simulate(put(words), folder, "--accuracy", str(asked))
            if found is None:
                print(f"| {scene} | {label} | {summary} | | | | |", flush=True)
                continue
            a = summary["accuracy"]
            print(f"| {scene} | {label} | {'; '.join(a['chosen'])} | {error(found, truth):.1e} | {a['error']:.1e} | {summary['cpu_seconds']:.3f} | {a['search_cpu_seconds']:.3f} |", flush=True)
