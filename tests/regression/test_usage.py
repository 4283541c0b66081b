"""Words of the command line: exit codes, messages, help, locale."""
import json
import os
import pathlib
import re
import subprocess

from program import examples, expect, finish, flexframe, history, run, temporary_folder

expect("run" in run("--help").stdout, "--help does not list run")
expect(run("--version").stdout.strip() != "", "--version says nothing")
commands = ("run", "simulate", "render", "check", "info", "reduce", "modes", "deform", "compare", "effects", "study", "export")
commands += ("response", "spectrum", "load-path", "new", "sweep", "collect", "import")
for command in commands:
    text = run(command, "--help").stdout
    for word in ("--help", "--quiet", "--verbose", "--json", "Examples:", f"  flexframe {command} "):
        expect(word in text, f"{command} --help lacks '{word}'")
    for word in ("FLOAT", "INT", "TEXT:", "Excludes:", "POSITIVE", " in [", "e-0", "e+", "214748", "107374"):
        expect(word not in text, f"{command} --help says '{word}': {text}")
    # Examples: the command once, and only options that there are.
    known = set(re.findall(r"(?<=[ ,])--?[a-z][a-z-]*", text.split("Examples:")[0]))
    lines = re.findall(r"^  flexframe (.*)$", text.split("Examples:")[1], flags=re.M)
    expect(lines != [] and set(commands) & {line.split()[1] for line in lines} == set(), f"{command}: a command twice in {lines}")
    given = {word for line in lines for word in line.split() if re.match(r"--?[a-z]", word)}
    expect(given <= known, f"{command}: examples with options that there are not: {given - known}")
expect(set(re.findall(r"^  ([a-z][a-z-]*) {3,}", run("--help").stdout, flags=re.M)) == set(commands), "--help has other commands")
expect("; must be given" in run("response", "--help").stdout, "an option that must be given does not say so")
text = run("run", "--help").stdout
for word in ("--size WxH", "--frames A:B", "--tolerance N", "1e-13 to 0.1", "not with --accuracy", "--scales LIST", "--colormap WORD"):
    expect(word in text, f"run --help lacks '{word}': {text}")
expect("did you mean 'run'" in run("rum", code=2).stderr, "no hint for a misspelt command")
expect("did you mean '--size'" in run("run", "x.toml", "--siz", "1x1", code=2).stderr, "no hint for a misspelt option")
expect("renderer" in run("info", "--renderer").stdout, "info --renderer")

with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    pendulum = examples / "pendulum.toml"
    # A reader that has seen enough, as head has, is told nothing.
    reader, writer = os.pipe()
    os.close(reader)
    closed = subprocess.run([flexframe, "check", str(pendulum)], stdout=writer, stderr=subprocess.PIPE, text=True)
    os.close(writer)
    expect(closed.returncode == 1 and closed.stderr == "", f"closed pipe: exit {closed.returncode}, {closed.stderr}")
    wrong = [
        [],
        ["rum"],
        ["run"],
        ["run", pendulum, "--siz", "1x1"],
        ["simulate", pendulum],
        ["info"],
        ["info", "nothing.h5"],
        ["render", "nothing.h5"],
        ["run", pendulum, "--size", "10"],
        ["run", pendulum, "--scales", "a"],
        ["run", pendulum, "--method", "euler"],
        ["run", pendulum, "--tolerance", "0"],
        ["run", pendulum, "--tolerance", "x"],
        ["run", pendulum, "--renderer", "vulkan"],
        ["run", pendulum, "--color-by", "heat"],
    ]
    for words in wrong:
        done = run(*words, code=2, cwd=folder, timeout=60)
        expect(done.stderr.startswith("flexframe: "), f"{words}: {done.stderr}")
        expect(done.stdout == "", f"{words}: stdout {done.stdout[:100]}")
    expect(list(folder.iterdir()) == [], f"wrong usage leaves {list(folder.iterdir())}")

    # Numbers keep their point under a locale with a comma, and progress stays off stdout.
    done = run(
        "simulate",
        pendulum,
        "--csv",
        folder / "de.csv",
        cwd=folder,
        env={"LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8", "PATH": "/usr/bin:/bin"},
    )
    expect("simulating" not in done.stdout, "progress on stdout")
    expect(len(history(folder / "de.csv")["t"]) == 1201, "rows of the history")

    # Quiet says nothing, progress neither; verbose says more; NO_COLOR and a terminal's colours make no difference.
    done = run("simulate", pendulum, "--csv", folder / "quiet.csv", "-q", cwd=folder)
    expect(done.stdout == "" and "%" not in done.stderr, f"-q says {done.stdout} {done.stderr}")
    done = run("simulate", pendulum, "--csv", folder / "loud.csv", "-v", cwd=folder)
    expect("Jacobians" in done.stdout and "simulating took" in done.stderr, f"-v says {done.stdout} {done.stderr}")
    expect((folder / "quiet.csv").read_bytes() == (folder / "loud.csv").read_bytes(), "the history depends on what is said")

    # Quiet is quiet everywhere: a command's warnings alone, on stderr; the answer where it is asked for as JSON, and info's.
    run("simulate", pendulum, "-o", folder / "q.h5", "--set", "simulation.duration=0.1", "-q", cwd=folder)
    quiet = [("check", pendulum), ("export", "q.h5", "--to", "csv"), ("spectrum", "q.h5", "--column", "tip.y"), ("new", "mine")]
    quiet += [
        ("modes", pendulum, "--no-pictures"),
        ("effects", pendulum),
        ("render", "q.h5", "-o", "q", *"--frames 0:1 --no-video".split()),
    ]
    for words in quiet:
        done = run(*words, "-q", cwd=folder)
        told = [line for line in done.stderr.splitlines() if not line.startswith("WARNING")]
        expect(done.stdout == "" and told == [], f"{words} -q says {done.stdout} {done.stderr}")
    expect(json.loads(run("check", pendulum, "-q", "--json", cwd=folder).stdout) != {}, "check -q --json says nothing")
    expect(run("info", "q.h5", "-q", cwd=folder).stdout != "", "info -q says nothing")

    # Results and histories say the same; info reads what simulate wrote.
    run("simulate", pendulum, "-o", folder / "deep/er/p.h5", cwd=folder)
    text = run("info", folder / "deep/er/p.h5").stdout
    for word in ("Flexible pendulum", "1201 samples", "tip.x"):
        expect(word in text, f"info lacks '{word}': {text}")
    run("info", pendulum)
    told = json.loads(run("info", folder / "deep/er/p.h5", "--json").stdout)
    expect(told["samples"] == 1201 and told["outputs"][0]["column"] == "tip.x", f"info --json: {told}")
    expect(json.loads(run("info", pendulum, "--json").stdout)["bodies"] == [{"name": "pendulum", "kind": "beam"}], "info --json of a scene")
    expect(json.loads(run("info", "--renderer", "--json").stdout)["backend"] == "osmesa", "info --renderer --json")

    # Words of [render] on the command line and in a file of their own; lists by comma or space.
    results, small = folder / "deep/er/p.h5", ["--frames", "20:21", "--no-video", "--size", "160x90"]

    def picture(name, *words):
        run("render", results, "-o", folder / name, *small, *words, cwd=folder)
        return (folder / name / "frames/frame_00020.png").read_bytes()

    plain = picture("plain")
    expect(picture("comma", "--scales", "1,5") == picture("space", "--scales", "1", "5"), "--scales 1,5 and 1 5 differ")
    expect(picture("c", "--view", "front,iso") == picture("d", "--view", "front", "iso"), "--view front,iso and front iso differ")
    place = ["1", "-2", "0.5"], ["0", "0", "-0.1"]
    commas = picture("e", "--camera", ",".join(place[0]), "--target", ",".join(place[1]))
    expect(commas == picture("f", "--camera", *place[0], "--target", *place[1]), "--camera 1,-2,0.5 and 1 -2 0.5 differ")
    expect(commas != plain, "--camera does nothing")
    stressed = picture("g", "--color-by", "stress", "--color-range", "0", "1e8", "--fov", "20", "--projection", "orthographic")
    expect(stressed != plain, "--color-by stress does nothing")
    run("render", "--scales", "1", "5", results, "-o", folder / "before", *small, cwd=folder)
    expect((folder / "before/frames/frame_00020.png").read_bytes() == picture("again", "--scales", "1", "5"), "a list before the file")
    (folder / "style.toml").write_text('[render]\ncolormap = "turbo"\nbackground = "white"\n')
    # A view or a place on the command line takes the place of whatever camera the file has.
    (folder / "no_camera.toml").write_text("[render]\n")
    two_views = picture("v", "--scene", folder / "no_camera.toml", "--view", "front,iso")
    one_place = picture("p", "--scene", folder / "no_camera.toml", "--camera", ",".join(place[0]), "--target", ",".join(place[1]))
    for k, camera in enumerate(
        (
            "direction = [-0.35, 1, -0.22]",
            "orbit = 90",
            "position = [1, 2, 3]\ntarget = [0, 0, 0]",
            'preset = "iso"',
            'views = ["top"]',
            "window = [0, 0.1]",
            "path = [{ t = 0, position = [1, 2, 3] }, { t = 1, position = [2, 2, 3] }]",
        )
    ):
        file = folder / f"camera_{k}.toml"
        file.write_text(f"[render.camera]\n{camera}\n")
        expect(
            camera.startswith("window") or picture(f"v{k}", "--scene", file, "--view", "front,iso") == two_views, f"--view beside {camera}"
        )
        here = picture(f"p{k}", "--scene", file, "--camera", ",".join(place[0]), "--target", ",".join(place[1]))
        expect(camera == "orbit = 90" or here == one_place, f"--camera beside {camera}")
    styled = picture("styled", "--scene", folder / "style.toml")
    expect(styled != plain, "a file with only [render] does nothing")
    run("run", pendulum, "-o", folder / "word", *small, "--colormap", "turbo", "--background", "white", "--speed", "0.25", cwd=folder)
    expect((folder / "word/frames/frame_00020.png").read_bytes() != plain, "--colormap and --background do nothing")
    for words in (["--colormap", "turbow"], ["--view", "under"], ["--speed", "x"], ["--camera", "1,2"]):
        done = run("render", results, "-o", folder / "none", *words, code=2, cwd=folder)
        expect("render" in done.stderr or "camera" in done.stderr, f"{words}: {done.stderr}")
    # The video's and the sequence's length follow the words.
    told = json.loads(
        run(
            "render",
            results,
            "-o",
            folder / "slow",
            "--frame-rate",
            "10",
            "--speed",
            "1",
            "--size",
            "64x48",
            "--no-video",
            "--json",
            cwd=folder,
        ).stdout
    )
    expect(told["pictures"] == 13, f"1.2 s at 10 pictures a second are {told['pictures']}")
    (folder / "broken.h5").write_bytes((folder / "deep/er/p.h5").read_bytes()[:5000])
    run("info", folder / "broken.h5", code=2)
    run("render", folder / "broken.h5", "-o", folder / "x", code=2)
    expect(not (folder / "x").exists(), "broken results leave a folder")
finish()
