"""What a command writes: never in place of what it reads, in place of links, into streams without replacing them."""
import os
import pathlib
import shutil
import subprocess
import threading

from program import expect, finish, flexframe, run, source, temporary_folder

SCENE = """
[simulation]
duration = 0.02
output_rate = 1000

[[body]]
name = "rod"
kind = "modal"
file = "rod.sid"
mesh = "part.obj"

[[joint]]
name = "holds"
kind = "weld"
parent = "ground"
child = "rod"

[[output]]
name = "at"
of = "rod"
quantity = "position"
"""
CUBE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def contents(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    scene = folder / "scene.toml"
    scene.write_text(SCENE)
    (folder / "asked.settings.toml").write_text(SCENE)
    (folder / "part.obj").write_text(CUBE)
    (folder / "nodes.csv").write_text("x,y,z,ux,uy,uz\n0,0,0,0,0,0\n1,0,0,0,0,1\n0,1,0,0,0,0\n0,0,1,0,0,0\n")
    shutil.copy(source / "assets/conrod/conrod.sid", folder / "rod.sid")
    (folder / "link.toml").symlink_to("scene.toml")
    (folder / "same").symlink_to(".")
    results = folder / "results.h5"
    run("simulate", scene, "-o", results)

    # Inputs stay: the scene, by its own name and by links, its bodies and meshes, results, models, tables.
    kept = contents(folder)
    read = "is a file that is read and would be overwritten: give the output another name"
    twice = "would be written twice, as two outputs: give one of them another name"
    for words, why in [
        (["simulate", scene, "-o", scene], read),
        (["simulate", folder / "link.toml", "-o", folder / "x.h5", "--csv", scene], read),
        (["simulate", folder / "link.toml", "-o", folder / "link.toml"], read),
        (["simulate", scene, "-o", folder / "rod.sid"], read),
        (["simulate", scene, "--csv", folder / "same/rod.sid"], read),
        (["simulate", scene, "--csv", folder / "part.obj"], read),
        (["simulate", folder / "asked.settings.toml", "--accuracy", "0.01", "-o", folder / "asked.h5"], read),
        (["simulate", scene, "-o", folder / "x", "--csv", folder / "." / "x"], twice),
        (["run", scene, "-o", folder / "out", "--csv", scene], read),
        (["export", results, "--to", "csv", "-o", results], read),
        (["spectrum", results, "-o", results], read),
        (["spectrum", results, "-o", folder / "x.svg"], twice),
        (["load-path", scene, "-o", scene], read),
        (["deform", "--nodes", folder / "nodes.csv", "--mesh", folder / "part.obj", "-o", folder / "part.obj"], read),
        (["import", results, "-o", results], read),
        (["compare", folder / "a.png", folder / "a.png", "--report", folder / "a.png"], None),
    ]:
        done = run(*words, code=2)
        expect(why is None or why in done.stderr, f"{words}: {done.stderr}")
        expect(contents(folder) == kept, f"{words}: files changed: {set(contents(folder)) ^ set(kept)}")
    model = source / "tests/fuzz/corpus/fe"
    deck = sorted(model.glob("*.inp"))[0]
    shutil.copy(deck, folder / "deck.inp")
    done = run("reduce", folder / "deck.inp", "--report", folder / "deck.inp", "-o", folder / "d.sid", code=2)
    expect(read in done.stderr and (folder / "deck.inp").read_bytes() == deck.read_bytes(), f"reduce: {done.stderr}")

    # A link at an output's name is replaced; what it led to stays.
    (folder / "kept.csv").write_text("kept\n")
    (folder / "table.csv").symlink_to("kept.csv")
    run("simulate", scene, "--csv", folder / "table.csv")
    table = (folder / "table.csv").read_text()
    expect(not (folder / "table.csv").is_symlink() and table.startswith("t,at.x"), "a link was not replaced")
    expect((folder / "kept.csv").read_text() == "kept\n", "a link was followed")

    # Streams: stdout as a pipe and as a file, whole and with nothing else in it; a named pipe.
    for name in ("/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"):
        before = os.lstat(name).st_mode if name == "/dev/stdout" else None
        done = run("simulate", scene, "--csv", name)
        expect(done.stdout == table, f"{name} as a pipe: {done.stdout[:200]}")
        with open(folder / "caught.csv", "w", encoding="utf-8") as caught:
            caught.write("# first\n")
            caught.flush()
            subprocess.run([flexframe, "simulate", str(scene), "--csv", name], stdout=caught, stderr=subprocess.DEVNULL, check=True)
        expect((folder / "caught.csv").read_text() == "# first\n" + table, f"{name} as a file")
        expect(before is None or os.lstat(name).st_mode == before, f"{name} is something else now")
    expect(run("export", results, "--to", "csv", "-o", "/dev/stdout").stdout == table, "export to stdout")
    os.mkfifo(folder / "pipe")
    came = []
    reader = threading.Thread(target=lambda: came.append((folder / "pipe").read_text()))
    reader.start()
    run("simulate", scene, "--csv", folder / "pipe")
    reader.join(60)
    expect(came == [table] and (folder / "pipe").is_fifo(), "a named pipe")
    done = run("simulate", scene, "--csv", "/dev/full", code=1)
    expect("/dev/full: cannot be written: No space left on device" in done.stderr, f"/dev/full: {done.stderr}")

finish()
