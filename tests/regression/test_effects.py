"""Effects: the table, what is off costs nothing, what was left out and matters is found, --strict."""
import json
import pathlib
import re
import shutil
import subprocess

from program import examples, expect, finish, flexframe, run, temporary_folder

pendulum = (examples / "pendulum.toml").read_text()


def written(folder, name, text):
    path = folder / f"{name}.toml"
    path.write_text(text)
    return path


def row(report, effect, owner="pendulum"):
    return next(r for r in report["effects"] if r["effect"] == effect and r["owner"] == owner)


def instructions(scene, folder):
    """Instructions of a whole run, by callgrind."""
    out = folder / "callgrind.out"
    done = subprocess.run(["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", flexframe, "simulate", scene, "--csv", folder / "c.csv", "--no-error-estimate"],
                          capture_output=True, text=True, timeout=500)
    expect(done.returncode == 0, f"callgrind run failed: {done.stderr[-500:]}")
    return int(re.search(r"Collected : (\d+)", done.stderr).group(1))


with temporary_folder() as folder:
    folder = pathlib.Path(folder)

    # The table: every effect, who decided, coordinates, share. The pendulum's stiffening is worth all of its deflection (ACCURACY).
    report = json.loads(run("effects", examples / "pendulum.toml", "--json").stdout)
    for effect in ["axial", "bending_xy", "bending_xz", "torsion", "stiffening", "gyroscopic", "shear", "damping"]:
        r = row(report, effect)
        expect(set(r["registry"]) == {"meaning", "equation", "matters", "estimate"} and all(r["registry"].values()), f"registry of {effect} is incomplete")
    bending, stiffening = row(report, "bending_xy"), row(report, "stiffening")
    expect(bending["on"] and bending["decided_by"] == "scene" and bending["coordinates"] == 20, f"bending_xy: {bending}")
    expect(stiffening["on"] and stiffening["share"] > 0.3 and stiffening["column"].startswith("deflection"), f"stiffening: {stiffening}")
    expect(not row(report, "bending_xz")["possible"] and row(report, "bending_xz")["share"] == 0, "a plane scene cannot bend out of its plane")
    expect(row(report, "gravity", "scene")["on"], "gravity is not told")
    text = run("effects", "--list").stdout
    expect("stiffening" in text and "equation" in text, "no registry")

    # Auto in a plane: bending in it only, by symmetry.
    automatic = pendulum.replace('effects = ["bending_xy", "stiffening"]', 'effects = "auto"')
    report = json.loads(run("effects", written(folder, "auto", automatic), "--json").stdout)
    expect(row(report, "bending_xy")["on"] and row(report, "bending_xy")["decided_by"] == "symmetry", "bending_xy is not decided by symmetry")
    expect(not row(report, "torsion")["on"] and row(report, "torsion")["coordinates"] == 0, "torsion in the plane")

    # Left out and worth it: a warning that names the switch; an error with --strict, and no files.
    bare = pendulum.replace('effects = ["bending_xy", "stiffening"]', 'effects = ["bending_xy"]')
    scene = written(folder, "bare", bare)
    text = run("simulate", scene, "--csv", folder / "bare.csv").stdout
    expect(re.search(r"WARNING +stiffening of 'pendulum' .* add \"stiffening\" to 'effects'", text), f"no warning of stiffening: {text}")
    done = run("simulate", scene, "--csv", folder / "strict.csv", "--strict", code=1)
    expect("stiffening" in done.stderr and not (folder / "strict.csv").exists(), "--strict leaves a file or does not name the effect")
    text = run("simulate", written(folder, "without", automatic.replace('effects = "auto"', 'effects = "auto"\nwithout = ["stiffening"]')), "--csv", folder / "w.csv").stdout
    expect("take \"stiffening\" out of 'without'" in text, f"no remedy for without: {text}")

    # Words.
    done = run("check", written(folder, "word", pendulum.replace('boundary = "clamped-free"', 'without = ["stifening"]')), code=2)
    expect("stiffening" in done.stderr and "word.toml:" in done.stderr, f"misspelt effect: {done.stderr}")
    done = run("check", written(folder, "both", pendulum.replace('boundary = "clamped-free"', 'without = ["stiffening"]')), code=2)
    expect("'effects' lists" in done.stderr, f"on and off: {done.stderr}")

    # What is off costs nothing: left out of "auto" by hand against a scene that never had it. Valgrind cannot run a program with sanitizers in it, whose
    # instructions are not those of the scene either.
    valgrind = shutil.which("valgrind")
    expect(valgrind, "valgrind is missing (tests/packages.txt)")
    if b"__asan_init" in pathlib.Path(flexframe).read_bytes():
        print("built with sanitizers: instructions are not counted")
    elif valgrind:
        short = automatic.replace("duration = 1.2", "duration = 0.05").replace("tolerance = 1e-6", "tolerance = 1e-4")
        never = short.replace('effects = "auto"', 'effects = ["bending_xy"]')
        left_out = short.replace('effects = "auto"', 'effects = "auto"\nwithout = ["stiffening"]')
        a = instructions(written(folder, "never", never), folder)
        b = instructions(written(folder, "left_out", left_out), folder)
        print(f"instructions without stiffening: {a} never there, {b} left out, {abs(b / a - 1):.2%} apart")
        expect(abs(b / a - 1) < 0.01, f"an effect that is off costs {b / a - 1:.2%}")
finish()
