"""flexframe sweep and collect: rows against runs made one by one, failed points, kills, shards, damage, HDF5."""
import csv
import json
import math
import os
import pathlib
import shlex
import signal
import subprocess
import time

import h5py

from program import bending_pendulum, examples, expect, flexframe, history, run, run_parts
from scene_text import body, force, joint, output, rigid, section, simulation

pendulum = (
    section("parameters", L=0.5, start=0.5)
    + simulation(1.5, output_rate=500, gravity=[0, -9.81, 0], tolerance=1e-8)
    + rigid("rod", mass=2, inertia=[0, "2*L^2/12", "2*L^2/12"], centre_of_mass=["L/2", 0, 0], frames=dict(tip=["L", 0, 0]))
    + joint("pin", "revolute", "ground", "rod", initial=dict(value="start - pi/2"))
    + output("tip", "rod.tip", "position")
    + output("angle", "pin", "value")
)


def scene_in(folder):
    scene = folder / "pendulum.toml"
    scene.write_text(pendulum)
    return scene


def table_of(folder):
    with open(folder / "table.csv", newline="") as file:
        return list(csv.DictReader(file))


def without_cpu(rows):
    return [{k: v for k, v in row.items() if k != "cpu_s"} for row in rows]


def rows_are_runs(folder):
    scene = scene_in(folder)
    words = ["--set", "L=0.4:0.6:3", "--set", "start=0.1,0.7", "--set", "simulation.method=erk,adams"]
    words += ["--response", "reach=range(tip.x)/L", "--response", "max(abs(angle + pi/2))", "--response", "time_of(angle > -pi/2)"]
    out = folder / "grid"
    text = run("sweep", scene, *words, "-o", out).stdout
    expect("12 of 12: 12 done" in text, f"summary: {text}")
    rows = table_of(out)
    expect([int(r["point"]) for r in rows] == list(range(12)), "the points are not in order")
    for row in rows:
        settings = [x for key in ["L", "start", "simulation.method"] for x in ["--set", f"{key}={row[key]}"]]
        run("simulate", scene, "--csv", folder / "one.csv", *settings)
        h = history(folder / "one.csv")
        wanted = {
            "reach": (max(h["tip.x"]) - min(h["tip.x"])) / float(row["L"]),
            "max(abs(angle + pi/2))": max(abs(a + 1.5707963267948966) for a in h["angle"]),
            "time_of(angle > -pi/2)": next(t for t, a in zip(h["t"], h["angle"]) if a > -1.5707963267948966),
        }
        for name, number in wanted.items():
            expect(abs(float(row[name]) - number) < 1e-12, f"point {row['point']}: {name} is {row[name]}, a run of its own says {number}")
    expect(rows[0]["L"] == "0.4" and rows[-1]["L"] == "0.6" and rows[4]["L"] == "0.5", "the range has other values")
    # Two of the keys again in HDF5, as a stranger reads it.
    with h5py.File(out / "table.h5") as file:
        expect(list(file["points/point"][:]) == list(range(12)), "HDF5: points")
        expect(list(file["settings/L"][:]) == [float(r["L"]) for r in rows], "HDF5: L")
        expect([x.decode() for x in file["settings/simulation.method"][:]] == [r["simulation.method"] for r in rows], "HDF5: words")
        expect(list(file["responses/reach/value"][:]) == [float(r["reach"]) for r in rows], "HDF5: reach")
        expect([x.decode() for x in file["points/end"][:]] == ["done"] * 12, "HDF5: ends")


def failed_points_are_rows(folder):
    scene = scene_in(folder)
    out = folder / "failed"
    words = ["--set", "body.rod.mass=2,-1", "--set", "simulation.max_steps=3,1e6", "--response", "final(angle)"]
    words += ["--response", "time_of(angle > 3)"]
    text = run("sweep", scene, *words, "-o", out).stdout
    rows = table_of(out)
    expect([r["end"] for r in rows] == ["failed", "lacking", "refused", "refused"], f"ends: {[r['end'] for r in rows]}")
    expect("max_steps" in rows[0]["message"] and "never true" in rows[1]["message"], f"messages: {[r['message'] for r in rows]}")
    expect("pendulum.toml:" in rows[2]["message"] and "'mass'" in rows[2]["message"], f"message: {rows[2]['message']}")
    expect([r["final(angle)"] != "" for r in rows] == [False, True, False, False], "responses of failed points")
    expect("1 lacking, 2 refused, 1 failed" in text, f"summary: {text}")
    with h5py.File(out / "table.h5") as file:
        expect(list(file["responses/final(angle)/point"][:]) == [1], "HDF5 has a response of a failed point")
    # A limit of CPU time; every point of it fails, which the exit code says.
    run("sweep", scene, "--set", "simulation.duration=2000,4000", "--response", "final(angle)", "--longest", 0.1, "-o", out, code=1)
    expect([r["end"] for r in table_of(out)] == ["too long"] * 2, "points that take too long")
    # Warnings travel with their point, and are failures where asked.
    crank = folder / "crank.toml"
    crank.write_text((examples / "slider_crank.toml").read_text().replace("duration = 1.6", "duration = 0.5"))
    loose = ["--set", "simulation.tolerance=1e-3,1e-8", "--set", "simulation.method=dirk", "--response", "final(slider.x)"]
    loose += ["--no-effect-check"]
    run("sweep", crank, *loose, "-o", out)
    rows = table_of(out)
    expect([r["end"] for r in rows] == ["warned", "done"], f"a tolerance of 0.001: {[(r['end'], r['message']) for r in rows]}")
    expect("estimated error" in rows[0]["message"] and float(rows[0]["error"]) > 0.01, f"the warning: {rows[0]}")


def wrong_questions(folder):
    scene = scene_in(folder)
    wrong = [
        (["--set", "L=0.1:0.2:3"], ["--response"]),
        (["--set", "M=0.1:0.2:3", "--response", "final(angle)"], ["'M'", "no parameter"]),
        (["--set", "L=0.1:0.2:3", "--response", "final(angel)"], ["angel", "angle"]),
        (["--set", "L=0.1:0.2:3", "--response", "angle"], ["is a history"]),
        (["--set", "L=0.1:0.2:3", "--response", "my name=final(angle)"], ["'my name'", "letters"]),
        (["--set", "L=0.1:0.2:3", "--response", "a b + final(angle)"], ["unknown"]),
        (["--set", "L=0.1:0.2", "--response", "final(angle)"], ["--sample"]),
        (["--set", "L=0.1:0.2:3", "--response", "final(angle)", "--response", "final(angle)"], ["two of this name"]),
        (["--set", "L=0.1:0.2:3", "--response", "final(angle)", "--shard", "4/3"], ["I/N"]),
        (["--set", "L=0.1:0.2:3", "--response", "final(angle)", "--method", "ark"], ["erk"]),
        (["--set", "body.rod.mass=-1,-2", "--response", "final(angle)"], ["pendulum.toml", "'mass'", "-1"]),
    ]
    for words, parts in wrong:
        done = run("sweep", scene, *words, "-o", folder / "wrong", code=2)
        for part in parts:
            expect(part in done.stderr, f"{part!r} is missing in: {done.stderr}")
        expect("response__" not in done.stderr, f"a name of the program's own is told: {done.stderr}")
        expect(not (folder / "wrong").exists(), f"{words} left a folder")
    done = run("collect", folder, code=2)
    expect("sweep.toml" in done.stderr, f"collect of no sweep: {done.stderr}")


def killed_and_resumed(folder):
    scene = scene_in(folder)
    words = [
        "sweep",
        scene,
        "--set",
        "L=0.3:0.7",
        "--set",
        "start=normal(0.5,0.1)",
        "--sample",
        "lhs:300",
        "--response",
        "reach=range(tip.x)",
    ]
    run(*words, "-o", folder / "whole")
    wanted = table_of(folder / "whole")
    out = folder / "killed"
    kills = 0
    for wait in [0.15, 0.3, 0.45, 0.6]:
        process = subprocess.Popen(
            [flexframe, *map(str, words), "-o", str(out), "--resume"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        time.sleep(wait)
        if process.poll() is None:
            process.send_signal(signal.SIGKILL)
            kills += 1
        process.wait()
        # Killed between the last row and its exit, it has written the table: a whole one.
        half = (out / "table.csv").exists() and without_cpu(table_of(out)) != without_cpu(wanted)
        expect(not half, "a killed sweep left a table that is not whole")
    # A worker that is killed takes nothing with it: its point is made again.
    process = subprocess.Popen([flexframe, *map(str, words), "-o", str(out)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    for _ in range(200):
        children = pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        if children:
            os.kill(int(children[0]), signal.SIGKILL)
            break
        time.sleep(0.005)
    expect(process.wait(timeout=120) == 0, "a sweep whose worker was killed failed")
    expect(without_cpu(table_of(out)) == without_cpu(wanted), "the table differs after a worker was killed")
    rows = out / "rows" / "shard_1_of_1.rows"
    # Cut off in the middle of a row, and one row spoilt.
    data = rows.read_bytes()
    rows.write_bytes(data[: len(data) // 2])
    text = run("collect", out, code=1).stdout
    expect("missing" in text and "--resume" in text, f"collect of half a sweep: {text}")
    run(*words, "-o", out, "--resume")
    expect(without_cpu(table_of(out)) == without_cpu(wanted), "the table differs after resuming")
    data = bytearray(rows.read_bytes())
    # Within a row: two rows would be missing where its end is spoilt.
    at = next(k for k in range(len(data) // 3, len(data)) if 10 not in (data[k], data[k] ^ 1))
    data[at] ^= 1
    rows.write_bytes(data)
    done = run("collect", out, code=1)
    expect("1 of 300 points" in done.stdout and "damaged" in done.stderr, f"a damaged row: {done.stdout} {done.stderr}")
    run("collect", out, "--run-missing")
    expect(without_cpu(table_of(out)) == without_cpu(wanted), "the table differs after mending")
    print("kills while it ran:", kills)
    expect(kills >= 1, "no kill came in time")


def shards_make_the_same_table(folder):
    scene = scene_in(folder)
    words = ["sweep", scene, "--set", "L=0.3:0.7:11", "--set", "start=0.1,0.2,0.3", "--response", "reach=range(tip.x)"]
    run(*words, "-o", folder / "one")
    # The commands that are told can be pasted into a shell, whatever the folder is called.
    out = folder / "drei Stücke & mehr"
    run(*words, "-o", out, "--shard", "2/3")
    report = json.loads(run("collect", out, "--json", code=1).stdout)
    expect(report["missing"] == 22 and len(report["run_again"]) == 2, f"two shards of three are missing: {report}")
    for command in report["run_again"]:
        run(*shlex.split(command)[1:])
    run("collect", out)
    expect(without_cpu(table_of(out)) == without_cpu(table_of(folder / "one")), "three shards make another table")
    # Rows of another question, and a scene that was changed meanwhile, are refused.
    stranger = folder / "one" / "rows" / "shard_1_of_1.rows"
    (out / "rows" / "shard_1_of_4.rows").write_text(stranger.read_text().replace("sweep rows 1 ", "sweep rows 1 0"))
    done = run("collect", out)
    expect("another sweep" in done.stderr, f"rows of another sweep: {done.stderr}")
    scene.write_text(pendulum.replace("mass = 2", "mass = 2.5"))
    done = run("collect", out, code=2)
    expect("not the one that the sweep was begun with" in done.stderr, f"a changed scene: {done.stderr}")


def plots_and_indices(folder):
    """Files of diagrams by kind of design; indices of a sum of squares, which are known."""
    scene = scene_in(folder)
    out = folder / "map"
    words = ["--set", "L=0.3:0.7:4", "--set", "start=0.1:0.5:3", "--response", "reach=range(tip.x)", "--sheet", "0.2"]
    run("sweep", scene, *words, "-o", out)
    sheet = json.loads(run("info", out / "sheet.png", "--json").stdout)
    # Three columns, the values of the second key, and four rows with their captions below a title.
    cell = 1920 // 3
    expect(abs(sheet["size"][0] - 3 * cell) < 20 and sheet["size"][1] > 4 * cell * 9 / 16, f"the contact sheet: {sheet}")
    names = {p.stem for p in out.glob("*.svg")}
    expect(names == {"curve_reach", "map_reach"} == {p.stem for p in out.glob("*.png")} - {"sheet"}, f"diagrams of a grid: {names}")
    page = (out / "report.html").read_text()
    expect(page.count("<svg") == 2 and page.count("</svg>") == 2 and "nan" not in page.lower(), "the page of a grid")
    # f = 3 a + b over equal intervals: nine tenths of the variance are the first's.
    text = pendulum.replace("[parameters]", "[parameters]\na = 0\nb = 0").replace("duration = 1.5", "duration = 0.01")
    scene.write_text(text)
    out = folder / "indices"
    words = ["--set", "a=0:1", "--set", "b=0:1", "--sensitivity", "sobol:256", "--response", "f=3*a+b", "--response", "final(angle)"]
    text = run("sweep", scene, *words, "-o", out, "--no-error-estimate").stdout
    expect("a: first 0.9" in text, f"indices: {text}")
    names = {p.stem for p in out.glob("*.svg")}
    expect(names == {"sensitivity_f", "matrix", "histogram_1"}, f"diagrams of indices: {names}")
    page = (out / "report.html").read_text()
    expect("no indices" in page, "a response that does not vary has indices")
    for name in ["table.csv", "report.html", "matrix.svg"]:
        expect(b"nan" not in (out / name).read_bytes(), f"{name} holds a nan")


def few_samples(folder):
    """A vibration of 70 Hz seen 100 times a second is one of 30 Hz in the samples: rows and spectra say so. 700 a second show it."""
    text = (
        simulation(2, output_rate=100)
        + rigid("m", mass=1)
        + joint("j", "prismatic", "ground", "m", initial=dict(value=0.01), spring=dict(stiffness="(2*pi*70)^2"))
        + output("x", "j", "value")
    )
    scene = folder / "fast.toml"
    for rate, end in ((100, "warned"), (700, "done")):
        scene.write_text(text.replace("output_rate = 100", f"output_rate = {rate}"))
        out = folder / f"fast{rate}"
        run("sweep", scene, "--set", "body.m.mass=1,1.1", "--response", "f=frequency(x)", "-o", out)
        row = table_of(out)[0]
        expect(row["end"] == end, f"{rate} samples a second: {row}")
        run("simulate", scene, "-o", folder / "fast.h5")
        done = run("spectrum", folder / "fast.h5", "-o", folder / "fast.csv", "--json")
        told = json.loads(done.stdout)
        expect(bool(told["warnings"]) == (rate == 100) == ("WARNING" in done.stderr), f"{rate} samples a second: {told}")
    expect("joint 'j' vibrates at about 70" in table_of(folder / "fast100")[0]["message"], f"{table_of(folder / 'fast100')}")
    expect(abs(float(row["f"]) - 70) < 0.05, f"a vibration of 70 Hz: {row}")
    # The smallest of five samples a period, at the same instants of each, is no smallest value: 0.81 of it.
    scene.write_text(text.replace("duration = 2", "duration = 0.1").replace("output_rate = 100", "output_rate = 350"))
    run("sweep", scene, "--set", "body.m.mass=1,1.1", "--response", "low=min(x)", "-o", folder / "coarse")
    row = table_of(folder / "coarse")[0]
    off = abs(float(row["low"]) / -0.01 - 1)
    expect(row["end"] == "warned" and off > 0.15 and "low would change" in row["message"], f"the smallest of few samples: {row}")


def shared_settings(folder):
    """An asked accuracy of many points: a clamped beam driven at its tip through its first resonance, against the sum of its modes."""
    F, E, rho, d, L, duration, rate = 1e-3, 2e9, 1000.0, 0.01, 1.0, 5.0, 100
    round_section = dict(shape="circle", diameter=d)
    text = (
        section("parameters", W=10.0)
        + simulation(duration, output_rate=rate, gravity=[0, 0, 0])
        + body(
            "beam",
            "beam",
            length=L,
            section=round_section,
            material=dict(density=rho, youngs_modulus=E),
            elements=12,
            effects=["bending_xy"],
        )
        + joint("wall", "weld", "ground", "beam.root")
        + force("force", "beam.tip", direction=[0, 1, 0], value=f"{F}*sin(W*t)")
        + output("tip", "beam.tip", "position")
    )
    scene = folder / "driven.toml"
    scene.write_text(text)
    words = ["sweep", scene, "--set", "W=4:26:45", "--accuracy", "1e-2"]
    words += ["--response", "span=range(tip.y)", "--response", "last=final(tip.y)", "--response", "high=max(tip.y)"]
    told = run(*words, "-o", folder / "one", "--workers", "1").stdout
    expect("settings     of all points" in told and "searched for at the points" in told, f"what is shared is not told: {told}")
    rows = table_of(folder / "one")
    # m' L q'' of each mode under the force, from rest; the standard form is 2 at the tip.
    per_length, stiffness = rho * math.pi * d**2 / 4, E * math.pi * d**4 / 64
    roots = [1.875104068711961, 4.694091132974175, 7.854757438237613, 10.995540734875467] + [(n - 0.5) * math.pi for n in range(5, 12)]
    times = [k / rate for k in range(round(duration * rate) + 1)]
    for row in rows:
        W, y = float(row["W"]), [0.0] * len(times)
        for root in roots:
            w = (root / L) ** 2 * math.sqrt(stiffness / per_length)
            y = [a + 4 * F / (per_length * L) / (w * w - W * W) * (math.sin(W * t) - W / w * math.sin(w * t)) for a, t in zip(y, times)]
        span = max(y) - min(y)
        for name, truth, most in (("span", span, 0.02), ("last", y[-1], 0.01), ("high", max(y), 0.01)):
            off = abs(float(row[name]) - truth) / span
            expect(off < most, f"{name} at W = {W:g} is {off:.2g} of the range off: {row}")
    # Near the resonance the tip moves far more than where the settings were searched for: those points are simulated by themselves.
    errors = [row["error"] for row in rows]
    shared = max(errors, key=errors.count)
    alone = [float(row["W"]) for row in rows if row["error"] != shared]
    expect(errors.count(shared) > 25 and float(shared) < 1e-2, f"{errors.count(shared)} points share the settings: {errors}")
    expect(any(11.5 < W < 13.5 for W in alone), f"at the resonance like elsewhere: by themselves are {alone}")
    # The same table by two workers, and by the rows that are left after half of them are gone; with the settings in the folder.
    run(*words, "-o", folder / "two", "--workers", "2")
    expect(without_cpu(table_of(folder / "two")) == without_cpu(rows), "two workers made another table")
    file = next((folder / "two" / "rows").glob("*.rows"))
    lines = file.read_bytes().splitlines(keepends=True)
    file.write_bytes(b"".join(lines[: len(lines) // 2]))
    run(*words, "-o", folder / "two", "--resume")
    expect(without_cpu(table_of(folder / "two")) == without_cpu(rows), "a resumed sweep made another table")


def shared_shapes(folder):
    """What points share leaves out the shapes under inertia, which their judges keep; against the whole beam by another method."""
    scene = bending_pendulum(folder / "bending_pendulum.toml")
    words = ["--set", "body.pendulum.material.youngs_modulus=0.9e9:1.1e9:41", "--accuracy", "1e-2", "--workers", "1"]
    words += ["--response", "deflection=range(deflection.y)", "--response", "last=final(tip.x)"]
    run("sweep", scene, *words, "-o", folder / "shapes")
    settings = {name: (folder / "shapes" / "settings" / f"{name}.toml").read_text() for name in ("chosen", "finer")}
    expect("keep_inertia = false" in settings["chosen"], f"shapes under inertia are left in: {settings['chosen']}")
    expect("keep_inertia = true" in settings["finer"], f"those that judge lack shapes: {settings['finer']}")
    rows = table_of(folder / "shapes")
    for row in (rows[0], rows[13], rows[40]):
        expect(float(row["error"]) < 1e-2, f"no error below what is asked: {row}")
        out = folder / "whole.csv"
        whole = ["--set", f"body.pendulum.material.youngs_modulus={row['body.pendulum.material.youngs_modulus']}"]
        whole += ["--set", "body.pendulum.elements=20", "--method", "dirk", "--tolerance", "1e-8"]
        run("simulate", scene, *whole, "--no-error-estimate", "--no-effect-check", "--csv", out, "-o", folder / "whole.h5")
        table = history(out)
        y, x = table["deflection.y"], table["tip.x"]
        span = max(y) - min(y)
        off = abs(float(row["deflection"]) - span) / span
        expect(off < 1e-2, f"range of the deflection {off:.2g} off: {row}")
        off = abs(float(row["last"]) - x[-1]) / (max(x) - min(x))
        expect(off < 1e-2, f"last place {off:.2g} of the range off: {row}")


run_parts(
    shared_settings,
    shared_shapes,
    rows_are_runs,
    failed_points_are_rows,
    wrong_questions,
    killed_and_resumed,
    shards_make_the_same_table,
    plots_and_indices,
    few_samples,
)
