"""flexframe sweep --minimise: minima that formulas and scipy know, limits, walls, several minima, kills and shards."""
import csv
import json
import math
import signal
import subprocess
import time

import numpy
import scipy.linalg
import scipy.optimize

from program import expect, flexframe, near, run, run_parts
from scene_text import joint, output, rigid, section, simulation

# A mass of 1 kg on a spring of one cycle a second, let go at 1 m; beside it an absorber on its own spring, at rest, for main = 1.
oscillator = (
    section("parameters", damping=1, stiffness=3, absorb=0.5, main=1, a=0, b=0)
    + simulation(20, output_rate=200, gravity=[0, 0, 0], tolerance=1e-9)
    + rigid("mass", mass="main", inertia=[1, 1, 1])
    + joint(
        "slide", "prismatic", "ground", "mass", axis=[1, 0, 0], initial=dict(value=1), spring=dict(stiffness="4*pi^2", damping="damping")
    )
    + output("x", "slide", "value")
)
absorber = rigid("absorber", mass=0.1, inertia=[1, 1, 1]) + joint(
    "on_top", "prismatic", "mass", "absorber", axis=[1, 0, 0], spring=dict(stiffness="stiffness", damping="absorb")
)


def scene_in(folder, text=oscillator):
    scene = folder / "oscillator.toml"
    scene.write_text(text)
    return scene


def found_in(out, *words, code=0):
    return json.loads(run(*words, "-o", out, "--json", code=code).stdout)["found"]


def rows_of(out):
    with open(out / "table.csv", newline="") as file:
        return [{k: v for k, v in row.items() if k != "cpu_s"} for row in csv.DictReader(file)]


def damping_of_least_square(folder):
    """The integral of x^2 is (4 z^2 + 1) / (4 z w): smallest at half the critical damping, where it is 1 / w."""
    omega = 2 * math.pi
    words = ["sweep", scene_in(folder), "--set", "damping=0.5:40:log"]
    square = found_in(folder / "square", *words, "--minimise", "integral(x^2)")
    near(square["settings"]["damping"], omega, 2e-3 * omega, "damping of the smallest integral of x^2")
    near(square["value"], 1 / omega, 1e-5 / omega, "that integral")
    expect(square["warnings"] == [] and square["at_ends"] == [], f"warnings: {square}")
    # With an overshoot of at most 5 %: where exp(-pi z / sqrt(1 - z^2)) is that. The samples miss the turning point by 1e-4 of it at most.
    ratio = -math.log(0.05) / math.hypot(math.pi, math.log(0.05))
    limited = found_in(folder / "limited", *words, "--minimise", "integral(x^2)", "--limit", "min(x) >= -0.05")
    near(limited["settings"]["damping"], 2 * ratio * omega, 4e-3 * omega, "damping within the overshoot")
    near(limited["value"], (4 * ratio**2 + 1) / (4 * ratio * omega), 1e-3 / omega, "its integral")
    expect(limited["active_limits"] == ["min(x) >= -0.05"] and limited["limits"][0]["value"] >= -0.05, f"the limit: {limited}")
    # The range ends before the minimum, and a limit that nothing keeps.
    ends = found_in(folder / "ends", *words[:2], "--set", "damping=8:40", "--minimise", "integral(x^2)")
    expect(ends["at_ends"] == ["damping (lower end)"] and abs(ends["settings"]["damping"] - 8) < 0.05, f"an end: {ends}")
    none = found_in(folder / "none", *words, "--minimise", "integral(x^2)", "--limit", "max(x) <= 0.5", code=1)
    expect(none["point"] is None and "keeps all limits" in none["warnings"][0], f"no run keeps the limit: {none}")


def absorber_of_two_keys(folder):
    """Stiffness and damping of an absorber: the integral is that of Lyapunov's equation, its minimum scipy's."""

    def integral(p):
        k, c, m = p[0], p[1], 0.1
        w2 = 4 * math.pi**2
        # x, v, y (of the absorber against the mass), its rate
        a = numpy.array([[0, 1, 0, 0], [-w2, -0.1, k, c], [0, 0, 0, 1], [w2, 0.1, -k - k / m, -c - c / m]])
        p = scipy.linalg.solve_continuous_lyapunov(a.T, -numpy.diag([1.0, 0, 0, 0]))
        return p[0, 0]

    wanted = scipy.optimize.minimize(integral, [3.5, 0.3], method="Nelder-Mead", options={"xatol": 1e-8, "fatol": 1e-14})
    scene = scene_in(folder, oscillator + absorber)
    words = ["--set", "damping=0.1", "--set", "stiffness=1:8", "--set", "absorb=0.02:2:log", "--set", "simulation.duration=40"]
    found = found_in(folder / "two", "sweep", scene, *words, "--minimise", "square=integral(x^2)", "--searches", 3)
    near(found["value"], wanted.fun, 1e-4 * wanted.fun, "the absorber's integral")
    near(found["settings"]["stiffness"], wanted.x[0], 0.01 * wanted.x[0], "its stiffness")
    near(found["settings"]["absorb"], wanted.x[1], 0.02 * wanted.x[1], "its damping")
    expect(sum(s["same"] for s in found["searches"]) >= 2, f"searches: {found['searches']}")
    expect((folder / "two/searches.svg").exists() and (folder / "two/matrix.png").exists(), "diagrams of the searches")


def valleys_walls_and_several_minima(folder):
    """Functions of the keys alone, whose minima are known."""
    scene = scene_in(folder, oscillator.replace("duration = 20", "duration = 0.02"))
    plain = ["sweep", scene, "--no-error-estimate", "--no-effect-check", "--set", "a=-2:2", "--set", "b=-1:3"]
    valley = found_in(folder / "valley", *plain, "--minimise", "(1-a)^2 + 100*(b-a^2)^2", "--searches", 2, "--runs", 600)
    near(valley["settings"]["a"], 1, 2e-3, "Rosenbrock's valley: a")
    near(valley["settings"]["b"], 1, 4e-3, "Rosenbrock's valley: b")
    # On the disc a^2 + b^2 <= 1 it is smallest at (0.7864, 0.6177).
    disc = found_in(
        folder / "disc", *plain, "--minimise", "(1-a)^2 + 100*(b-a^2)^2", "--limit", "a^2 + b^2 <= 1", "--searches", 2, "--runs", 800
    )
    near(disc["value"], 0.0456748, 1e-4, "Rosenbrock's valley on a disc")
    expect(disc["settings"]["a"] ** 2 + disc["settings"]["b"] ** 2 <= 1, "beyond its limit")
    # A mass below zero is refused: the smallest lies beside that wall.
    wall = ["sweep", scene, "--no-error-estimate", "--no-effect-check", "--set", "main=-1:1.5", "--set", "a=-1:1"]
    wall = found_in(folder / "wall", *wall, "--maximise", "-(main-0.1)^2 - a^2")
    near(wall["settings"]["main"], 0.1, 2e-3, "beside the wall")
    expect(sum(s["without"] for s in wall["searches"]) > 0, f"no run was refused: {wall}")
    # Two minima, of which only one search comes to the lower one.
    two = found_in(folder / "several", *plain[:-2], "--minimise", "(a^2-1)^2 + 0.2*a", "--searches", 6)
    near(two["settings"]["a"], -1.0241, 2e-3, "the lower of two minima")
    expect(any(not s["same"] for s in two["searches"]), f"all searches end at one place: {two['searches']}")
    one = found_in(folder / "one", *plain[:-2], "--minimise", "(a^2-1)^2 + 0.2*a", "--searches", 1)
    expect("one search" in one["warnings"][0], f"warnings: {one['warnings']}")
    flat = found_in(folder / "flat", *plain, "--minimise", "3 + 1e-9*a", "--searches", 2)
    expect("do not decide" in flat["warnings"][0], f"a response that does not change: {flat['warnings']}")
    few = found_in(folder / "few", *plain, "--minimise", "(1-a)^2 + 100*(b-a^2)^2", "--searches", 2, "--runs", 12)
    expect(any("had not settled" in w for w in few["warnings"]), f"warnings: {few['warnings']}")


def killed_and_sharded(folder):
    scene = scene_in(folder, oscillator + absorber)
    words = ["sweep", scene, "--set", "stiffness=1:8", "--set", "absorb=0.02:2:log", "--minimise", "integral(x^2)", "--searches", "3"]
    run(*words, "-o", folder / "whole")
    wanted = rows_of(folder / "whole")
    out, kills = folder / "killed", 0
    for wait in (0.4, 0.6, 0.8, 1.0):
        process = subprocess.Popen(
            [flexframe, *map(str, words), "-o", str(out), "--resume"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        time.sleep(wait)
        if process.poll() is None:
            process.send_signal(signal.SIGKILL)
            kills += 1
        process.wait()
    print("kills while it ran:", kills)
    text = run(*words, "-o", out, "--resume").stdout
    expect(rows_of(out) == wanted, f"the rows differ after kills: {text}")
    # A row that was cut off, and what comes behind it, is made again.
    rows = out / "rows/search_2_of_3.rows"
    data = rows.read_bytes()
    rows.write_bytes(data[: len(data) // 2])
    half = run("collect", out, code=1)
    expect("1 of 3 searches have not ended" in half.stdout, f"half a search: {half.stdout}")
    run("collect", out, "--run-missing")
    expect(rows_of(out) == wanted, "the rows differ after mending")
    shards = folder / "shards"
    for shard in ("1/2", "2/2"):
        run(*words, "-o", shards, "--shard", shard)
    run("collect", shards)
    expect(rows_of(shards) == wanted, "two shards make other rows")


def wrong_questions(folder):
    scene = scene_in(folder)
    goal = ["--minimise", "integral(x^2)"]
    for words, parts in [
        (["--set", "damping=1,2", *goal], ["LOW:HIGH"]),
        (["--set", "damping=normal(1,2)", *goal], ["LOW:HIGH"]),
        (["--set", "damping=1:2", *goal, "--sample", "lhs:9"], ["--sample"]),
        (["--set", "damping=1:2", *goal, "--maximise", "max(x)"], ["--maximise"]),
        (["--set", "damping=1:2", "--minimise", "integral(y^2)"], ["y", "x"]),
        (["--set", "damping=1:2", *goal, "--limit", "max(x)"], ["<="]),
        (["--set", "damping=1:2", *goal, "--limit", "max(x) <= much"], ["much", "no number"]),
        (["--set", "damping=1:2:3", "--response", "max(x)", "--limit", "max(x) <= 1"], ["--limit"]),
    ]:
        done = run("sweep", scene, *words, "-o", folder / "wrong", code=2)
        for part in parts:
            expect(part in done.stderr, f"{part!r} is missing in: {done.stderr}")
        expect(not (folder / "wrong").exists(), f"{words} left a folder")


if "NLopt" in run("--version").stdout:
    run_parts(damping_of_least_square, absorber_of_two_keys, valleys_walls_and_several_minima, killed_and_sharded, wrong_questions)
else:
    print("built without NLopt: nothing to test")
