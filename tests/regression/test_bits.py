"""Pictures are the same bits whoever draws them: any number of workers, shards, what is resumed after kill -9, OSMesa or EGL; and meshes
that change are noticed."""
import os
import pathlib
import shutil
import signal
import struct
import subprocess
import time

from program import examples, expect, finish, flexframe, run, temporary_folder

# Everything that is drawn by other means: shadows, occlusion, ghosts, past positions, wires, words, a plot.
scene_words = """
size = [120, 90]
trail = 3
silhouette = true
traces = ["rod.tip"]
"""


def pictures(folder):
    return {p.name: p.read_bytes() for p in sorted((folder / "frames").iterdir())}


def pixels(data):
    """Header and pixels of a PNG: without the words that name the renderer."""
    at, kept = 8, []
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        if kind in (b"IHDR", b"IDAT"):
            kept.append(data[at : at + 12 + size])
        at += 12 + size
    return b"".join(kept)


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    mesh = folder / "crank.obj"
    shutil.copy(source_mesh := examples.parent / "assets/engine/crank.obj", mesh)
    scene = folder / "s.toml"
    text = (examples / "slider_crank.toml").read_text()
    head, render = text.split("[render]")
    render = "\n".join(line for line in render.splitlines() if not line.startswith("size"))
    scene.write_text(
        head.replace('name = "block"\n', f'name = "block"\nmesh = "{mesh.name}"\ndrawing = {{ edges = "creases" }}\n', 1)
        + "[render]"
        + scene_words
        + render
    )
    results = folder / "r.h5"
    run("simulate", scene, "-o", results, "--no-error-estimate", "--no-effect-check")
    words = ["--frames", "100:112", "--no-video"]

    def draw(name, *more):
        return run("render", results, "-o", folder / name, *words, *more)

    draw("one", "--workers", "1")
    one = pictures(folder / "one")
    expect(len(one) == 12 and len(set(map(pixels, one.values()))) == 12, "pictures repeat: does anything move?")
    draw("four", "--workers", "4")
    expect(pictures(folder / "four") == one, "four workers draw other pictures than one")
    for shard, workers in ((1, 1), (2, 2), (3, 1)):
        draw("shards", "--shard", f"{shard}/3", "--workers", workers)
    expect(pictures(folder / "shards") == one, "shards are other pictures")

    # Killed when some are there, and resumed by another number of workers.
    process = subprocess.Popen(
        [flexframe, "render", str(results), "-o", str(folder / "killed"), *words, "--workers", "2"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        stdin=subprocess.DEVNULL,
    )
    there = lambda: len(list((folder / "killed/frames").glob("frame_*.png"))) if (folder / "killed/frames").exists() else 0
    until = time.monotonic() + 60
    while there() < 3 and process.poll() is None and time.monotonic() < until:
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.wait()
    expect(there() >= 3, "no pictures before the kill")
    told = draw("killed", "--resume", "--workers", "1").stdout
    expect(" kept)" in told, f"nothing was kept after the kill: {told}")
    expect(pictures(folder / "killed") == one, "what was resumed after a kill are other pictures")

    # Another way to Mesa, and one that must compile its shaders anew.
    egl = subprocess.run([flexframe, "info", "--renderer", "egl"], capture_output=True, text=True)
    if egl.returncode == 0 and "llvmpipe" in egl.stdout:
        run("render", results, "-o", folder / "egl", "--no-video", "--workers", "1", "--frames", "104:107", "--renderer", "egl")
        expect(
            {n: pixels(d) for n, d in pictures(folder / "egl").items()} == {n: pixels(one[n]) for n in sorted(one)[4:7]},
            "EGL draws other pictures than OSMesa",
        )
    else:
        print("EGL in software is not here:", egl.stderr.strip() or egl.stdout.strip())
    run(
        "render",
        results,
        "-o",
        folder / "uncached",
        "--no-video",
        "--workers",
        "1",
        "--frames",
        "104:106",
        env={**os.environ, "MESA_SHADER_CACHE_DISABLE": "true"},
    )
    uncached = pictures(folder / "uncached")
    expect(len(uncached) == 2 and all(one[n] == d for n, d in uncached.items()), "without Mesa's shader cache other pictures are drawn")

    # A mesh that is no longer the one of the results: said, and nothing of it counts as done.
    lines = mesh.read_text().splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("v "))
    x, y, z = map(float, lines[first].split()[1:4])
    lines[first] = f"v {x + 0.002} {y} {z}"
    mesh.write_text("\n".join(lines) + "\n")
    resume = lambda: run("render", results, "-o", folder / "one", "--no-video", "--workers", "1", "--frames", "100:102", "--resume").stdout
    told = resume()
    expect("WARNING" in told and "crank.obj has changed since the results were made" in told, f"the changed mesh is not noticed: {told}")
    expect("kept" not in told, f"pictures of the old mesh were kept: {told}")
    expect(pictures(folder / "one") != one, "the new mesh is not to be seen")
    shutil.copy(source_mesh, mesh)
    told = resume()
    expect("WARNING" not in told and pictures(folder / "one") == one, "with the old mesh back the pictures are not those of before")
finish()
