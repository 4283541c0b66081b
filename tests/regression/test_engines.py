"""Work handed to other engines: GNU parallel here, Slurm (--slurm, needs root, slurm-wlm and munge) in the nightly run. What comes of it is
the same, bit for bit, as what the program does by itself; what is killed is named and mended."""
import csv
import json
import os
import pathlib
import shutil
import signal
import sys
import time

from program import examples, expect, flexframe, run, run_parts

import slurm

SLURM = "--slurm" in sys.argv

sweep_words = ["--set", "body.rod.length=0.28:0.32", "--set", "body.crank.length=normal(0.152,0.002)", "--sample", "lhs:200"]
sweep_words += ["--set", "simulation.tolerance=1e-4", "--set", "simulation.method=dirk"]
sweep_words += ["--response", "slide=range(slider.x)", "--response", "max(abs(rod_middle.y))"]


def table_of(folder):
    with open(folder / "table.csv", newline="") as file:
        return [{k: v for k, v in row.items() if k != "cpu_s"} for row in csv.DictReader(file)]


def pictures_of(folder):
    return {p.name: p.read_bytes() for p in sorted((folder / "frames").glob("*.png"))}


def crank_in(folder, points):
    """The slider-crank, short: the whole of it where points are many."""
    scene = folder / "crank.toml"
    text = (examples / "slider_crank.toml").read_text().replace("duration = 1.6", "duration = 0.3")
    scene.write_text(text)
    words = [w.replace("lhs:200", f"lhs:{points}") for w in sweep_words]
    return scene, words


def tasks_of(folder):
    """Processes of this program that work in the folder, by /proc: pid -> words."""
    out = {}
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if words and os.path.basename(words[0]) == b"flexframe" and any(str(folder).encode() in w for w in words):
            out[int(process.name)] = [w.decode() for w in words if w]
    return out


def dry_runs(folder):
    scene, words = crank_in(folder, 40)
    out = folder / "dry"
    slurm_words = ["--engine", "slurm", "--shards", "4", "--sbatch", "partition=short", "--sbatch", "--mem=1G", "--dry-run"]
    (folder / "head.sh").write_text("#!/bin/bash\n#SBATCH --account=me\necho never\n")
    text = run("sweep", scene, *words, "-o", out, *slurm_words, "--sbatch-file", folder / "head.sh").stdout
    for part in [
        "--array=1-4",
        "--time=",
        "--requeue",
        "--partition=short",
        "--mem=1G",
        "--account=me",
        "afterany:",
        "--resume",
        "collect",
    ]:
        expect(part in text, f"{part!r} is missing in the scripts: {text}")
    expect("echo never" not in text, "lines of the user's file that are none of Slurm's got into the script")
    expect(not (out / "rows").exists(), "a dry run ran")
    text = run("sweep", scene, *words, "-o", out, "--engine", "parallel", "--dry-run").stdout
    expect("seq 1 " in text and "--joblog" in text, f"the script for GNU parallel: {text}")
    done = run("sweep", scene, *words, "-o", out, "--dry-run", code=2)
    expect("--engine" in done.stderr, f"a dry run of local: {done.stderr}")
    # An engine that is not there.
    bare = {k: v for k, v in os.environ.items() if k != "PATH"} | {"PATH": str(folder)}
    done = run("sweep", scene, *words, "-o", out, "--engine", "parallel", "--shards", "2", code=2, env=bare)
    expect("Debian: parallel" in done.stderr, f"no engine: {done.stderr}")


def gnu_parallel(folder):
    if not shutil.which("parallel"):
        expect(False, "GNU parallel is not installed (tests/packages.txt)")
        return
    # A name with a space and a quote: words of a shell.
    place = folder / "a folder's"
    place.mkdir()
    scene, words = crank_in(place, 40)
    run("sweep", scene, *words, "-o", folder / "local")
    run("sweep", scene, *words, "-o", place / "out", "--engine", "parallel", "--shards", "3")
    expect(table_of(place / "out") == table_of(folder / "local"), "GNU parallel makes another table")
    expect(len(list((place / "out" / "rows").glob("*.rows"))) == 3, "there are not three shards")
    # Pictures.
    run("simulate", scene, "-o", place / "crank.h5")
    size = ["--size", "160x120", "--frames", "0:12"]
    run("render", place / "crank.h5", "-o", folder / "film", *size)
    run("render", place / "crank.h5", "-o", place / "film", *size, "--engine", "parallel", "--shards", "3")
    expect(pictures_of(place / "film") == pictures_of(folder / "film"), "GNU parallel draws other pictures")
    expect(len(pictures_of(folder / "film")) == 12, "there are not twelve pictures")
    if shutil.which("ffmpeg"):
        expect((place / "film" / "crank.mp4").is_file(), "there is no video")
    # Both in one: a simulation, then its pictures in shards.
    both = ["run", scene, "--set", "simulation.tolerance=1e-5", "--no-effect-check", *size]
    run(*both, "-o", folder / "both")
    run(*both, "-o", place / "both", "--engine", "parallel", "--shards", "3")
    expect(pictures_of(place / "both") == pictures_of(folder / "both"), "run by GNU parallel makes other pictures")
    names = [sorted(p.name for p in out.iterdir() if p.name != "jobs") for out in (folder / "both", place / "both")]
    expect(names[0] == names[1], f"run by GNU parallel leaves other files: {names}")
    expect((place / "both/histories.csv").read_bytes() == (folder / "both/histories.csv").read_bytes(), "other histories")
    # A simulation that fails: no pictures are begun.
    failing = ["--set", "simulation.max_steps=3", "--engine", "parallel", "--shards", "3"]
    done = run("run", scene, *size, "-o", place / "failed", *failing, code=1)
    expect("max_steps" in done.stderr and not (place / "failed/frames").exists(), f"a failed simulation: {done.stderr}")


def study_words(folder):
    scene = folder / "short.toml"
    text = (examples / "pendulum.toml").read_text().replace("duration = 1.2", "duration = 0.2").replace("elements = 10", "elements = 4")
    scene.write_text(text)
    # The reference ends with its refinements, not with its time: on a busy machine it would end earlier once, and errors would differ.
    return ["study", scene, "--axes", "tolerance,elements", "--repeats", "2", "--reference-seconds", "60", "--longest", "60"]


def errors_of(folder):
    study = json.loads((folder / "study.json").read_text())
    return [(p["axis"], p["label"], p["error"], p["axis_error"], p["column"]) for p in study["points"]]


def study_by_parallel(folder):
    words = study_words(folder)
    run(*words, "-o", folder / "study")
    run(*words, "-o", folder / "study3", "--engine", "parallel", "--shards", "3")
    expect(errors_of(folder / "study3") == errors_of(folder / "study"), "three shards of a study measure other errors")
    expect(len(errors_of(folder / "study")) > 8, "a study of few points")
    done = run(*words[:-2], "-o", folder / "x", "--shard", "1/3", code=2)
    expect("--longest" in done.stderr, f"a shard without --longest: {done.stderr}")


def compared_by(folder, engine, **more):
    """Two folders of pictures in shards: the verdict is the local one; a picture that changes afterwards is compared again."""
    for name in ("a", "b"):
        shutil.copytree(folder / "film" / "frames", folder / engine / name)
    a, b, parts = folder / engine / "a", folder / engine / "b", folder / engine / "parts"
    (b / "frame_00003.png").write_bytes((a / "frame_00009.png").read_bytes())
    (b / "frame_00005.png").unlink()
    verdict = lambda *words, code=1: json.loads(run("compare", a, b, *words, "--json", code=code).stdout)
    wanted = verdict()
    expect(len([p for p in wanted["pictures"] if p["result"] == "differs"]) == 1, f"the local verdict: {wanted}")
    words = ["compare", a, b, "--engine", engine, "--shards", "3", "--parts", parts]
    report = ["--json"] if engine == "parallel" else ["--junit", folder / engine / "verdict.xml"]
    done = run(*words, *report, code=1 if engine == "parallel" else 0, **more)
    yield
    expect(len(list(parts.glob("part_*_of_3.json"))) == 3, "there are not three parts")
    if engine == "parallel":
        text = done.stdout[done.stdout.index("{") :]
        expect(json.loads(text)["pictures"] == wanted["pictures"], f"another verdict: {text}")
    again = verdict("--parts", parts)
    expect(again["pictures"] == wanted["pictures"] and not again["notes"], f"by the parts alone: {again['notes']}")
    # One part is gone, one picture is mended: both are compared anew, and told.
    (parts / "part_2_of_3.json").unlink()
    (b / "frame_00003.png").write_bytes((a / "frame_00003.png").read_bytes())
    again = verdict("--parts", parts)
    states = {p["name"]: p["result"] for p in again["pictures"]}
    expect([n for n, s in states.items() if s != "equal"] == ["frame_00005.png"], f"after mending: {states}")
    expect("not found compared" in again["notes"][0], f"notes: {again['notes']}")
    done = run("compare", a, b, "--levels", "9", "--parts", parts, code=1)
    expect("not found compared" in done.stderr, "another rule takes the old verdicts")


def compare_by_parallel(folder):
    scene, _ = crank_in(folder, 4)
    run("simulate", scene, "-o", folder / "crank.h5")
    run("render", folder / "crank.h5", "-o", folder / "film", "--size", "160x120", "--frames", "0:12", "--no-video")
    for _ in compared_by(folder, "parallel"):
        pass


def with_slurm(folder):
    with slurm.running(folder / "slurm") as s:
        sweep_on(s, folder)
        film_on(s, folder)
        words = study_words(folder)
        run(*words, "-o", folder / "study")
        run(*words, "-o", folder / "study3", "--engine", "slurm", "--shards", "3", env=s.environment)
        s.wait_until_idle()
        expect(errors_of(folder / "study3") == errors_of(folder / "study"), "three shards of a study measure other errors")
        run("simulate", crank_in(folder, 4)[0], "-o", folder / "crank.h5")
        run("render", folder / "crank.h5", "-o", folder / "film", "--size", "160x120", "--frames", "0:12", "--no-video")
        for _ in compared_by(folder, "slurm", env=s.environment):
            s.wait_until_idle()
            expect((folder / "slurm" / "verdict.xml").is_file(), "the last job made no verdict")


def sweep_on(s, folder):
    scene, words = crank_in(folder, 200)
    run("sweep", scene, *words, "-o", folder / "local")
    out = folder / "out"
    run("sweep", scene, *words, "-o", out, "--engine", "slurm", "--shards", "8", env=s.environment)
    # The node is drained while two tasks run: they end, the others wait until it is back.
    slurm.wait_for(lambda: len(s.jobs("RUNNING")) == 2, "two running tasks", 300.0)
    s.drain()
    # One of the two is killed.
    slurm.wait_for(lambda: any((out / "rows").glob("*.rows")), "the first rows", 300.0)
    tasks = {pid: words for pid, words in tasks_of(out).items() if "--shard" in words}
    expect(len(tasks) >= 1, "no task to kill")
    first = min(tasks)
    os.kill(first, signal.SIGKILL)
    victim = tasks[first][tasks[first].index("--shard") + 1]
    busy = lambda: s.jobs("RUNNING") or s.jobs("COMPLETING")
    slurm.wait_for(lambda: not busy(), "the end of the tasks of a drained node", 300.0)
    time.sleep(2.0)
    expect(not s.jobs("RUNNING") and len(s.jobs("PENDING")) >= 6, f"a drained node runs tasks: {s.jobs()}")
    s.resume()
    s.wait_until_idle()
    log = (out / "jobs" / "last.log").read_text()
    expect("missing" in log and f"--shard {victim} --resume" in log, f"the last job does not name the killed shard {victim}: {log}")
    expect(table_of(out) != table_of(folder / "local"), "nothing is missing")
    # Just the missing shard, by the command that was named.
    line = next(line for line in log.splitlines() if f"--shard {victim}" in line)
    run(*line[line.index("flexframe ") :].split()[1:])
    run("collect", out)
    expect(table_of(out) == table_of(folder / "local"), "Slurm makes another table")
    # Handed over again nothing is left to do; a task that is requeued goes on.
    rows = out / "rows" / "shard_1_of_8.rows"
    rows.write_bytes(rows.read_bytes()[:-100])
    (out / "table.csv").unlink()
    run("sweep", out, "--engine", "slurm", env=s.environment)
    s.wait_until_idle()
    expect(table_of(out) == table_of(folder / "local"), "Slurm makes another table when it goes on")


def film_on(s, folder):
    scene = folder / "film.toml"
    text = (examples / "slider_crank.toml").read_text()
    expect("speed = 0.25" in text and "frame_rate = 60" in text, "the slider-crank is another")
    scene.write_text(text.replace("speed = 0.25", "speed = 0.16"))
    run("simulate", scene, "-o", folder / "film.h5", "--tolerance", "1e-4")
    size = ["--size", "160x120"]
    run("render", folder / "film.h5", "-o", folder / "film_local", *size)
    wanted = pictures_of(folder / "film_local")
    expect(len(wanted) >= 600, f"{len(wanted)} pictures")
    out = folder / "film_slurm"
    run("render", folder / "film.h5", "-o", out, *size, "--engine", "slurm", "--shards", "4", env=s.environment)
    slurm.wait_for(lambda: tasks_of(out) and len(list((out / "frames").glob("*.png"))) > 20, "some pictures", 300.0)
    tasks = [pid for pid, words in tasks_of(out).items() if "--shard" in words]
    os.kill(min(tasks), signal.SIGKILL)
    s.wait_until_idle()
    expect(pictures_of(out) == wanted, "Slurm draws other pictures, or not all")
    expect(not shutil.which("ffmpeg") or (out / "film.mp4").is_file(), "there is no video")


if SLURM:
    why = slurm.missing()
    if why:
        print("no Slurm here:", why)
        expect("FLEXFRAME_NO_SLURM" in os.environ, f"no Slurm here: {why}; FLEXFRAME_NO_SLURM=1 leaves this test out")
        run_parts()
    else:
        run_parts(with_slurm)
else:
    run_parts(dry_runs, gnu_parallel, study_by_parallel, compare_by_parallel)
