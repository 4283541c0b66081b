"""What happens when the machine fails: kill -9, a folder that cannot be written, a full disk."""
import os
import pathlib
import resource
import signal
import subprocess
import sys
import time
import zlib

from program import examples, expect, finish, flexframe, run, source, temporary_folder


def is_whole_png(data):
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        return False
    at, last = 8, b""
    while at + 12 <= len(data):
        length, last = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        body = data[at + 4 : at + 8 + length]
        if int.from_bytes(data[at + 8 + length : at + 12 + length], "big") != zlib.crc32(body):
            return False
        at += 12 + length
    return at == len(data) and last == b"IEND"


COIL = """
[simulation]
duration = 0.1
start = "static"

[[body]]
name = "coil"
kind = "beam"
axis = { x = "0.05*sin(u) + 0.003*u", y = "0.05*(1 - cos(u))", z = "0.004*(1 - cos(u/6))", to = "6*pi" }
volumes = 200
section = { shape = "circle", radius = 0.003 }
material = { density = 7850, youngs_modulus = 2.1e11 }

[[body]]
name = "plate"
kind = "rigid"
mass = 0.1
inertia = [1e-5, 1e-5, 1e-5]

[[joint]]
name = "clamp"
kind = "weld"
parent = "ground"
child = "coil"

[[joint]]
name = "guide"
kind = "prismatic"
parent = "ground"
child = "plate"
axis = [1, 0, 0]
position = [0, 0, 0.008]
initial = { guess = 0.06 }

[[joint]]
name = "top"
kind = "spherical"
parent = "plate"
child = "coil.tip"

[[force]]
kind = "force"
on = "plate"
direction = [1, 0, 0]
value = 0.5
"""

small = ["--size", "320x180", "--no-error-estimate", "--no-video"]
with temporary_folder() as folder:
    folder = pathlib.Path(folder)

    # Killed at several moments: only whole files under final names; resumed, the outcome is that of an undisturbed run.
    start = time.monotonic()
    run("run", examples / "pendulum.toml", "-o", folder / "whole", *small)
    duration = time.monotonic() - start
    whole = {p.name: p.read_bytes() for p in (folder / "whole/frames").iterdir()}
    for moment in (share * duration for share in (0.1, 0.3, 0.5, 0.7, 0.9)):
        process = subprocess.Popen(
            [flexframe, "run", str(examples / "pendulum.toml"), "-o", str(folder / "k"), "--resume", *small],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        time.sleep(moment)
        process.send_signal(signal.SIGKILL)
        process.wait()
        for path in (folder / "k").rglob("*.png") if (folder / "k").exists() else []:
            if not path.name.startswith("."):
                expect(is_whole_png(path.read_bytes()), f"killed after {moment:.2f} s: {path.name} is not whole")
    time.sleep(0.5)
    run("run", examples / "pendulum.toml", "-o", folder / "k", "--resume", *small)
    expect({p.name: p.read_bytes() for p in (folder / "k/frames").iterdir()} == whole, "resumed pictures differ from an undisturbed run")
    expect((folder / "k/histories.csv").read_bytes() == (folder / "whole/histories.csv").read_bytes(), "histories differ")

    # Ctrl-C as soon as there is a picture: exit 130, whole pictures, no temporary files.
    process = subprocess.Popen(
        [flexframe, "run", str(examples / "pendulum.toml"), "-o", str(folder / "c"), *small],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    while process.poll() is None and not any((folder / "c").glob("frames/*.png")):
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    _, message = process.communicate(timeout=30)
    expect(process.returncode == 130 and "interrupted" in message, f"ctrl-C: exit {process.returncode}: {message}")
    for path in (folder / "c").rglob("*") if (folder / "c").exists() else []:
        expect(not path.name.startswith("."), f"ctrl-C leaves {path.name}")

    # Amid the factorisation of a reduction, which no library can be stopped in: at once, and no file is there.
    subprocess.run([sys.executable, source / "assets/beam/make_beam.py", folder / "block.inp", "14", "14", "14"], check=True)
    (folder / "body").mkdir()
    words = ["reduce", str(folder / "block.inp"), "-o", str(folder / "body/block.sid"), "--modes", "4", "--no-stiffening"]
    process = subprocess.Popen([flexframe, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while (line := process.stderr.readline()) and "factorising" not in line:
        pass
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    sent = time.monotonic()
    _, message = process.communicate(timeout=60)
    took = time.monotonic() - sent
    expect(process.returncode == 130 and message == "flexframe: interrupted\n", f"ctrl-C: exit {process.returncode}: {message}")
    expect(took < 2.0, f"ctrl-C amid a factorisation took {took:.1f} s")
    expect(not any((folder / "body").iterdir()), f"ctrl-C leaves {list((folder / 'body').iterdir())}")

    # A folder that cannot be written to is told of before a reduction, not after it; one that is missing is made, with the body in it.
    for out in (folder / "block.inp/b.sid", pathlib.Path("/proc/flexframe/b.sid")):
        done = run(*words[:2], "-o", out, "--modes", "4", code=1)
        expect(str(out.parent) in done.stderr and "factorising" not in done.stderr, f"{out}: {done.stderr}")
    (folder / "small.inp").write_text((source / "tests/fuzz/corpus/fe/tet.inp").read_text())
    run("reduce", folder / "small.inp", "-o", folder / "new/deep/b.sid", "--mesh", folder / "meshes/b.obj", "--modes", "1")
    expect((folder / "new/deep/b.sid").exists() and (folder / "meshes/b.obj").exists(), "no body in a new folder")
    (folder / "wrong.inp").write_text("*NODE\n1,0,0\n")
    run("reduce", folder / "wrong.inp", "-o", folder / "other/b.sid", "--modes", "1", code=2)
    expect(not (folder / "other").exists(), "a reduction that fails leaves a folder")

    # A static start of minutes does not look at the request to end (a coil of many pieces in a loop); the program ends all the same.
    (folder / "coil.toml").write_text(COIL)
    process = subprocess.Popen(
        [flexframe, "simulate", str(folder / "coil.toml"), "--csv", str(folder / "coil.csv")], stderr=subprocess.PIPE, text=True
    )
    # It says that it is at work, though it cannot tell how far.
    while (line := process.stderr.readline()) and "so far" not in line:
        pass
    expect("bodies, start" in line, f"a long start says only {line!r}")
    process.send_signal(signal.SIGTERM)
    _, message = process.communicate(timeout=60)
    expect(process.returncode == 130 and "interrupted" in message, f"SIGTERM in a static start: exit {process.returncode}: {message}")

    # An output folder that cannot be: a file in its place, a folder of the kernel.
    (folder / "file").write_text("x")
    for out in (folder / "file", folder / "file/below", pathlib.Path("/proc/flexframe")):
        done = run("run", examples / "pendulum.toml", "-o", out, *small, code=1)
        expect(str(out) in done.stderr and done.stderr.splitlines()[-1].startswith("flexframe: "), f"{out}: {done.stderr}")
    expect((folder / "file").read_text() == "x", "a file in the way was harmed")
    if os.geteuid() != 0:
        (folder / "locked").mkdir(mode=0o555)
        run("run", examples / "pendulum.toml", "-o", folder / "locked/out", *small, code=1)

    # A disk that is full after so many bytes in a file: the results or the pictures do not fit.
    for limit in (2000, 30000):

        def lower(limit=limit):
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

        out = folder / f"full{limit}"
        process = subprocess.run(
            [flexframe, "run", str(examples / "pendulum.toml"), "-o", str(out), "--no-video"],
            capture_output=True,
            text=True,
            preexec_fn=lower,
            restore_signals=False,
        )
        expect(
            process.returncode == 1 and process.stderr.splitlines()[-1].startswith("flexframe: "),
            f"full at {limit}: exit {process.returncode}: {process.stderr}",
        )
        left = [p for p in out.rglob("*") if p.is_file()] if out.exists() else []
        for path in left:
            expect(path.suffix != ".png" or is_whole_png(path.read_bytes()), f"full disk: {path.name} is not whole")
            expect(path.stat().st_size < limit, f"full disk: {path.name} is cut off")
            expect(not path.name.startswith("."), f"full disk leaves {path.name}")
finish()
