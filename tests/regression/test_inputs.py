"""Inputs that change, vanish or are cut off, and scenes that try to write where they should not."""
import os
import pathlib
import shutil

from program import expect, finish, run, temporary_folder
from scene_text import joint, output, rigid, simulation

pinned = (
    simulation(0.1)
    + rigid("%s", mass=1, inertia=[1, 1, 1], mesh="part.obj")
    + joint("pin", "revolute", "ground", "%s", initial=dict(rate=1))
    + output("angle", "pin", "value")
)
triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def listing(folder):
    return {p.relative_to(folder).as_posix() for p in folder.rglob("*")}


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    scene, mesh, results = folder / "scene.toml", folder / "part.obj", folder / "r.h5"
    scene.write_text(pinned % ("rod", "rod"))
    mesh.write_text(triangle)
    run("simulate", scene, "-o", results)
    small = ["--size", "64x64", "--no-video"]

    # A mesh that is gone is an error that names it.
    mesh.unlink()
    gone = run("render", results, "-o", folder / "gone", *small, code=2)
    expect("part.obj" in gone.stderr and not (folder / "gone").exists(), f"vanished mesh: {gone.stderr}")
    mesh.write_text(triangle)

    # Results cut off anywhere, or with a byte turned, are refused by name and leave nothing.
    whole = results.read_bytes()
    for size in [0, 1, 100, 1000, len(whole) // 2, len(whole) - 1]:
        (folder / "cut.h5").write_bytes(whole[:size])
        done = run("render", folder / "cut.h5", "-o", folder / "cut", *small, code=2)
        expect("cut.h5" in done.stderr and not (folder / "cut").exists(), f"cut to {size} bytes: {done.stderr}")
    done = run("render", folder / "none.h5", "-o", folder / "cut", code=2)
    expect("none.h5" in done.stderr, done.stderr)

    # Files of a scene that cannot be read.
    for text, word in [(pinned.replace("part.obj", "../none.obj"), "none.obj"), (pinned.replace("part.obj", "."), "directory")]:
        scene.write_text(text % ("rod", "rod"))
        done = run("run", scene, "-o", folder / "no", *small, code=2)
        expect(word in done.stderr and not (folder / "no").exists(), f"{word}: {done.stderr}")

    # Names that are paths are refused; what a scene makes lies below the output folder.
    before = listing(folder)
    for name in ["../up", "/tmp/up", "..", "a/b", "a\\\\b", ".hidden", "x.png"]:
        scene.write_text(pinned % (name, name))
        done = run("run", scene, "-o", folder / "out", *small, code=2)
        expect("name" in done.stderr, f"name {name!r}: {done.stderr}")
    expect(listing(folder) == before, f"refused scenes left {listing(folder) - before}")
    # Links planted in the output folder are replaced, not followed.
    victim, out = folder / "victim", folder / "out"
    victim.write_text("kept")
    before = listing(folder)
    (out / "frames").mkdir(parents=True)
    for place in ["results.h5", "histories.csv", "scene.mp4", ".scene.unfinished.mp4", "frames/frame_00000.png"]:
        (out / place).symlink_to(victim)
    scene.write_text('title = "../../../title"\n' + (pinned % ("rod", "rod")).replace('"angle"', '"out angle"'))
    run("run", scene, "-o", out, "--size", "64x64")
    fresh = listing(folder) - before
    expect(
        fresh and all(p == "out" or p.startswith("out/") for p in fresh),
        f"written beside the output folder: {[p for p in fresh if not p.startswith('out')]}",
    )
    expect(victim.read_text() == "kept" and not any(p.is_symlink() for p in out.rglob("*")), "a link in the output folder was followed")
    shutil.rmtree(folder / "out")

    # Folders that cannot be written; the superuser writes everywhere but in /proc.
    locked = pathlib.Path("/proc") if os.geteuid() == 0 else folder / "locked"
    locked.mkdir(mode=0o555, exist_ok=True)
    for words in [
        ("simulate", scene, "-o", locked / "r.h5"),
        ("export", results, "--to", "csv", "-o", locked / "r.csv"),
        ("render", results, "-o", locked / "out"),
        ("run", scene, "-o", locked / "out"),
        ("study", scene, "-o", locked / "out"),
        ("export", results, "--to", "gltf", "-o", locked / "r.glb"),
    ]:
        done = run(*words, code=1)
        expect(str(locked) in done.stderr, f"{words[0]} into a read-only folder: {done.stderr}")
finish()
