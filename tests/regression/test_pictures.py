"""The pictures of `run`: whole, and the same bits when drawn by parts and resumed."""
import json
import pathlib

from program import examples, expect, finish, run, temporary_folder


def frames(folder):
    return {p.name: p.read_bytes() for p in sorted((folder / "frames").iterdir())}


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    small = ["--size", "160x90", "--no-error-estimate"]
    report = json.loads(run("run", examples / "slider_crank.toml", "-o", folder / "a", *small, "--json").stdout)
    count = report["drawing"]["pictures"]
    whole = frames(folder / "a")
    expect(count == 385 and len(whole) == count, f"{len(whole)} of {count} pictures, wanted 385")
    for name in ("results.h5", "histories.csv", "slider_crank.mp4"):
        expect((folder / "a" / name).stat().st_size > 1000, f"{name} is missing or empty")
    expect(
        set(p.name for p in (folder / "a").iterdir()) == {"results.h5", "histories.csv", "slider_crank.mp4", "frames"},
        "something else was written",
    )
    expect(len(set(whole.values())) > 0.95 * count, "pictures repeat: does anything move?")
    for stage in ("deformation", "drawing", "encoding"):
        expect(report["drawing"]["cpu_seconds"][stage] > 0, f"no CPU seconds of {stage}")

    # The same results, drawn by parts (shards, workers and kills: test_bits.py).
    results = folder / "a/results.h5"
    run("render", results, "-o", folder / "b", "--size", "160x90", "--frames", "46:60", "--no-video")
    done = json.loads(
        run("render", results, "-o", folder / "b", "--size", "160x90", "--frames", "50:70", "--resume", "--no-video", "--json").stdout
    )
    expect((done["kept"], done["drawn"]) == (10, 10), f"resume kept {done['kept']} and drew {done['drawn']}, wanted 10 and 10")
    expect(
        frames(folder / "b") == {n: d for n, d in whole.items() if "frame_00046.png" <= n < "frame_00070.png"},
        "resumed pictures are not the same",
    )
    done = json.loads(
        run(
            "render",
            results,
            "-o",
            folder / "b",
            "--size",
            "160x90",
            "--scales",
            "1,30",
            "--frames",
            "50:52",
            "--resume",
            "--no-video",
            "--json",
        ).stdout
    )
    expect(done["drawn"] == 2, "pictures of other settings were kept")
    run("render", results, "-o", folder / "b", "--frames", "9999:", code=2)
# Results of a scene in a folder of its own, drawn from elsewhere: the same pictures, joint symbols included; and where what they need is
# gone, a sentence instead of other pictures.
with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    (folder / "scene").mkdir()
    (folder / "other").mkdir()
    (folder / "scene/block.obj").write_text("v 0 0 0\nv .02 0 0\nv 0 .02 0\nv 0 0 .02\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    (folder / "scene/small.toml").write_text(
        """[simulation]
duration = 0.2
output_rate = 100
gravity = [0, -9.81, 0]
[[body]]
name = "block"
kind = "rigid"
mesh = "block.obj"
mass = 0.1
inertia = [1e-5, 1e-5, 1e-5]
centre_of_mass = [0.01, 0, 0]
[[joint]]
name = "pin"
kind = "revolute"
parent = "ground"
child = "block"
axis = [0, 0, 1]
[render]
size = [160, 90]
frame_rate = 10
speed = 1
"""
    )
    run("run", "small.toml", "-o", "out", "--no-video", cwd=folder / "scene")
    run("render", folder / "scene/out/results.h5", "-o", "again", "--no-video", cwd=folder / "other")
    here, there = frames(folder / "scene/out"), frames(folder / "other/again")
    expect(len(here) > 1 and here == there, "results drawn from another folder give other pictures")
    (folder / "scene/block.obj").rename(folder / "scene/gone.obj")
    lost = run("render", folder / "scene/out/results.h5", "-o", "lost", "--no-video", cwd=folder / "other", code=2)
    expect("block.obj" in lost.stderr and "--scene" in lost.stderr, f"a lost mesh is told as: {lost.stderr}")
finish()
