"""kill -9 at random moments of run, simulate, render, reduce, export and study: whole files or none, and the next try gives the bits of
an undisturbed run.

FLEXFRAME_KILLS sets the number of kills a command (3; the nightly run 100), FLEXFRAME_SEED the moments.
"""
import json
import os
import pathlib
import random
import shutil
import signal
import subprocess
import time

from program import examples, expect, finish, flexframe, run, temporary_folder

kills = int(os.environ.get("FLEXFRAME_KILLS", "3"))
seed = int(os.environ.get("FLEXFRAME_SEED", str(random.randrange(10**6))))
print(f"{kills} kills a command, seed {seed}", flush=True)
chance = random.Random(seed)


def bar_model(path):
    """A bar of 12 x 4 x 4 bricks."""
    nx, ny, nz = 12, 4, 4
    number = lambda i, j, k: 1 + i + (nx + 1) * (j + (ny + 1) * k)
    lines = ["*NODE"]
    lines += [
        f"{number(i, j, k)}, {i * 0.025}, {j * 0.01}, {k * 0.01}" for k in range(nz + 1) for j in range(ny + 1) for i in range(nx + 1)
    ]
    lines.append("*ELEMENT, TYPE=C3D8, ELSET=ALL")
    for k in range(nz):
        for j in range(ny):
            for i in range(nx):
                corners = [
                    number(i + a, j + b, k + c)
                    for a, b, c in ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
                ]
                lines.append(f"{1 + i + nx * (j + ny * k)}, " + ", ".join(map(str, corners)))
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "2.1e11, 0.3", "*DENSITY", "7800.", "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL"]
    path.write_text("\n".join(lines) + "\n")


def files_below(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()} if folder.exists() else {}


def living(group):
    """Commands of the group's processes that run; those that ended and wait for init to take notice do not."""
    out = []
    for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            name, rest = stat.read_text().split("(", 1)[1].rsplit(")", 1)
        except (OSError, ValueError, IndexError):
            continue  # ended while it was looked at
        state, _, of = rest.split()[:3]
        if int(of) == group and state not in "ZX":
            out.append(name)
    return out


def killed(words, duration):
    process = subprocess.Popen(
        [flexframe, *map(str, words)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        stdin=subprocess.DEVNULL,
        start_new_session=True,
    )
    time.sleep(chance.uniform(0.0, 1.1 * duration))
    ended = process.poll() is not None
    process.send_signal(signal.SIGKILL)
    process.wait()
    # Workers end with their parent; a kill of the parent alone must be enough.
    until = time.monotonic() + 10
    while (left := living(process.pid)) and time.monotonic() < until:
        time.sleep(0.05)
    expect(not left, f"{words[0]}: processes live on after the kill of their parent: {left}")
    return ended


def disturb(name, words_of, resume, folder, same, told=lambda path, data: data):
    """words_of(out): the command's words. Kills it again and again in one folder, then lets it finish. `told`: what of a file has to be
    the same."""
    whole, out = folder / f"{name}_whole", folder / f"{name}_killed"
    whole.mkdir()
    out.mkdir()
    start = time.monotonic()
    run(*words_of(whole))
    duration = time.monotonic() - start
    wanted = files_below(whole)
    ended = 0
    for _ in range(kills):
        late = killed([*words_of(out), *resume], duration)
        ended += late
        for path, data in files_below(out).items():
            # What has its final name is complete; what has not is hidden.
            if pathlib.Path(path).name.startswith("."):
                continue
            expect(path in wanted, f"{name}: {path} is left by a killed run")
            if same(path):
                expect(
                    path in wanted and told(path, data) == told(path, wanted[path]),
                    f"{name}: {path} of a killed run is not that of an undisturbed one",
                )
        # With everything there the next try would have nothing to do that a kill could disturb.
        if late:
            shutil.rmtree(out)
            out.mkdir()
    run(*words_of(out), *resume)
    left = files_below(out)
    expect(set(left) == set(wanted), f"{name}: after the kills there are {sorted(set(left) ^ set(wanted))[:5]} too many or too few")
    for path, data in left.items():
        if same(path):
            expect(told(path, data) == told(path, wanted[path]), f"{name}: {path} differs from an undisturbed run")
    print(f"{name}: {kills} kills in {duration:.2f} s runs ({ended} came after the end)", flush=True)


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    small = ["--size", "160x90", "--no-video", "--no-shadows"]
    scene = folder / "pendulum.toml"
    scene.write_text((examples / "pendulum.toml").read_text())
    bar_model(folder / "bar.inp")
    # Results and reports hold the CPU seconds they took; everything else is the same bit for bit.
    timed = lambda path: not path.endswith((".h5", ".md"))

    disturb("run", lambda out: ["run", scene, "-o", out, *small], ["--resume"], folder, timed)
    disturb("simulate", lambda out: ["simulate", scene, "-o", out / "r.h5", "--csv", out / "r.csv"], [], folder, timed)
    run("simulate", scene, "-o", folder / "r.h5")
    disturb("render", lambda out: ["render", folder / "r.h5", "-o", out, *small], ["--resume"], folder, timed)
    disturb("reduce", lambda out: ["reduce", folder / "bar.inp", "-o", out / "bar.sid", "--modes", "6", "--nodes", "20"], [], folder, timed)
    # A study holds the CPU seconds of its runs; their histories and errors are the same bit for bit.
    scene.write_text(scene.read_text().replace("duration = 1.2", "duration = 0.2"))
    run("simulate", scene, "--csv", folder / "reference.csv", "--tolerance", "1e-8", "--no-error-estimate")
    disturb(
        "study",
        lambda out: [
            "study",
            scene,
            "-o",
            out,
            "--axes",
            "tolerance",
            "--repeats",
            "1",
            "--longest",
            "60",
            "--reference",
            folder / "reference.csv",
        ],
        ["--resume"],
        folder,
        lambda path: path == "study.json" or path.startswith("runs/") and path.endswith(".csv"),
        lambda path, data: [(p["axis"], p["setting"], p["error"], p["axis_error"]) for p in json.loads(data)["points"]]
        if path == "study.json"
        else data,
    )
    disturb("export", lambda out: ["export", folder / "r.h5", "--to", "vtk", "-o", out], [], folder, lambda path: True)
finish()
