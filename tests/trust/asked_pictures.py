"""Accuracies asked of pictures against what is kept:  asked_pictures.py FLEXFRAME EXAMPLES [--asked "0.5 px"] [--only NAME] [--limit S]
[--table FILE]

Every example that ends in its time is simulated to the asked distance, then with twice the resolution and a thousandth of the tolerance,
and `flexframe compare` tells how far the vertices of the two are apart. A distance that is not kept without a warning is an error. The
table goes between the markers 'pictures' and 'end pictures' of a Markdown page. The truth has the same models: what a model leaves out
is the claim of its warnings, not of this table.
"""
import argparse
import json
import pathlib
import re
import resource
import subprocess
import sys
import tempfile

# Examples that a machine does quickly: the others need minutes for their truths.
QUICK = [
    "mechanisms/pendulum",
    "mechanisms/double_pendulum",
    "mechanisms/slider_crank",
    "mechanisms/scotch_yoke",
    "mechanisms/oscillator",
    "mechanisms/chebyshev",
    "mechanisms/quick_return",
    "mechanisms/cardan",
    "mechanisms/trammel",
    "mechanisms/two_masses",
    "mechanisms/inclined_block",
    "mechanisms/swinging_atwood",
    "mechanisms/quarter_car",
    "mechanisms/conical_pendulum",
    "mechanisms/tautochrone",
    "mechanisms/eccentric",
    "mechanisms/governor",
    "mechanisms/oscillating_cylinder",
    "mechanisms/top",
    "pendulum_solid",
]


def run(program, words, limit):
    """Exit code, standard output, CPU seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [program, *words],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5)),
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done.returncode, done.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def refined(text):
    """Words that double elements and volumes of the scene's beams."""
    words = []
    for block in re.split(r"(?m)^\[\[body\]\]", text)[1:]:
        block = re.split(r"(?m)^\[", block)[0]
        name = re.search(r'(?m)^name\s*=\s*"([^"]+)"', block)
        for key in ("elements", "volumes"):
            found = re.search(rf"(?m)^{key}\s*=\s*(\d+)", block)
            if name and found:
                words += ["--set", f"body.{name[1]}.{key}={2 * int(found[1])}"]
    return words


def finer_samples(text):
    """Words for twenty times as many samples: between them pictures are drawn along straight lines, in the truth too."""
    rate = re.search(r"(?m)^output_rate\s*=\s*([0-9.e+]+)", text)
    return ["--set", f"simulation.output_rate={20 * float(rate[1] if rate else 1000):g}"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("examples", type=pathlib.Path)
    parser.add_argument("--asked", action="append", default=[])
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--limit", type=int, default=60, help="CPU seconds a run may take")
    parser.add_argument("--table", type=pathlib.Path)
    args = parser.parse_args()
    rows, bad = [], 0
    with tempfile.TemporaryDirectory(prefix="flexframe_pictures_") as temporary:
        folder = pathlib.Path(temporary)
        for name in args.only or QUICK:
            scene = args.examples / f"{name}.toml"
            text = scene.read_text()
            truth = ["simulate", str(scene), "-o", str(folder / "truth.h5"), "--tolerance", "1e-10", "--no-error-estimate"]
            known = run(args.program, [*truth, *finer_samples(text), *refined(text)], args.limit)[0] == 0
            _, plain, _ = run(args.program, ["simulate", str(scene), "-o", str(folder / "plain.h5"), "--json"], args.limit)
            own = json.loads(plain)["simulation"]["cpu_seconds"] if plain else float("nan")
            for asked in args.asked or ["0.5 px", "0.05 px"]:
                ask = ["simulate", str(scene), "-o", str(folder / "asked.h5"), "--accuracy", asked, "--json", "--fresh"]
                code, out, cpu = run(args.program, ask, args.limit)
                if code != 0:
                    rows.append(f"| {name} | {asked} | - | - | - | - | failed |")
                    bad += 1
                    print(f"failed: {name}, {asked}: exit {code}", flush=True)
                    continue
                told = json.loads(out)["simulation"]
                shares = told["accuracy"]["picture"]
                error = float("nan")
                if known:
                    compared = run(args.program, ["compare", str(folder / "truth.h5"), str(folder / "asked.h5"), "--json"], args.limit)[1]
                    error = json.loads(compared)["pixels"]
                kept = error <= shares["allowed"]
                verdict = "kept" if kept else "no truth" if error != error else "warned" if told["warnings"] else "SILENT"
                bad += verdict == "SILENT"
                # What the simulation claims: the truth is drawn with the same map and samples.
                claim = shares["total"] - shares["map"] - shares["raster"]
                rows.append(f"| {name} | {asked} | {claim:.1e} | {error:.1e} | {cpu:.2f} | {own:.3f} | {verdict} |")
                print(f"{verdict}: {name}, {asked}: estimated {claim:.1e}, true {error:.1e} px, {cpu:.2f} CPU s", flush=True)
    print(f"{len(rows)} rows, {bad} wrong without a word or failed")
    if args.table:
        head = [
            "| example | asked | estimated, px | true, px | CPU s in all | CPU s of a default run | verdict |",
            "|---|---|---|---|---|---|---|",
        ]
        page = args.table.read_text()
        begin, end = "<!-- pictures -->\n", "<!-- end pictures -->"
        args.table.write_text(page[: page.index(begin) + len(begin)] + "\n".join(head + rows) + "\n" + page[page.index(end) :])
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
