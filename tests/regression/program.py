"""Runs the real program for the regression tests: each test is a script called as  test_x.py FLEXFRAME SOURCE_DIR."""
import csv
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.append(str(pathlib.Path(__file__).parents[1]))
import one_thread  # noqa: E402, F401 - tests import numpy before this file

flexframe = str(pathlib.Path(sys.argv[1]).resolve())
source = pathlib.Path(sys.argv[2]).resolve()
examples = source / "examples"

# What a test runs is made, not remembered from another run.
os.environ["FLEXFRAME_CACHE"] = "none"

failures = []


def expect(condition, message):
    if not condition:
        failures.append(message)
        print("FAILED:", message, flush=True)


def near(value, wanted, tolerance, what):
    print(f"{what}: {value:.7g} (wanted {wanted:.7g}, off by {abs(value - wanted):.2g} of {tolerance:.2g})")
    expect(abs(value - wanted) <= tolerance, f"{what} is {value:.9g}, wanted {wanted:.9g} within {tolerance:.2g}")


def run(*words, code=0, cwd=None, timeout=300, **more):
    """The finished process; a wrong exit code is a failure."""
    done = subprocess.run(
        [flexframe, *map(str, words)], capture_output=True, text=True, cwd=cwd, timeout=timeout, stdin=subprocess.DEVNULL, **more
    )
    expect(
        done.returncode == code,
        f"flexframe {' '.join(map(str, words))}: exit {done.returncode}, wanted {code}; stderr: {done.stderr.strip()[:2000]}",
    )
    return done


def history(path):
    """Columns of a CSV history by name, as lists of floats."""
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    return {name: [float(row[i]) for row in rows[1:]] for i, name in enumerate(rows[0])}


def at(columns, name, t):
    """The sample at time t, which must be one."""
    i = min(range(len(columns["t"])), key=lambda k: abs(columns["t"][k] - t))
    expect(abs(columns["t"][i] - t) < 1e-9, f"no sample at t = {t}")
    return columns[name][i]


def bending_slider_crank(path):
    """The example as Schiavo et al. 2005 have it, written to `path`: rods that neither stretch nor shear, tolerance 1e-6."""
    text = (examples / "slider_crank.toml").read_text()
    for word, plain in [(', "shear", "axial"', ""), (', "axial", "shear"', ""), ("tolerance = 3e-7", "tolerance = 1e-6")]:
        expect(text.count(word) == 1, f"the slider-crank is another: {word}")
        text = text.replace(word, plain)
    path.write_text(text)
    return path


def bending_pendulum(path):
    """The example as Schiavo et al. 2005 have it, written to `path`: a beam that does not shear, tolerance 1e-6."""
    text = (examples / "pendulum.toml").read_text()
    for word, plain in [(', "shear"', ""), ("tolerance = 1e-7", "tolerance = 1e-6")]:
        expect(text.count(word) == 1, f"the pendulum is another: {word}")
        text = text.replace(word, plain)
    path.write_text(text)
    return path


def temporary_folder():
    return tempfile.TemporaryDirectory(prefix="flexframe_test_")


def run_parts(*parts):
    """Runs the parts of a test, functions of a folder that they share, and ends the test."""
    with temporary_folder() as folder:
        for part in parts:
            print(f"== {part.__name__}", flush=True)
            part(pathlib.Path(folder))
    finish()


def finish():
    print("failed" if failures else "passed", f"({len(failures)} failures)")
    sys.stdout.flush()
    os._exit(1 if failures else 0)
