"""Words of the command line: exit codes, messages, help, locale."""
import pathlib

from program import examples, expect, finish, history, run, temporary_folder

expect("run" in run("--help").stdout, "--help does not list run")
expect(run("--version").stdout.strip() != "", "--version says nothing")
for command in ("run", "simulate", "render", "check", "info"):
    expect("--help" in run(command, "--help").stdout, f"{command} --help")
expect("renderer" in run("info", "--renderer").stdout, "info --renderer")

with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    pendulum = examples / "pendulum.toml"
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

    # Results and histories say the same; info reads what simulate wrote.
    run("simulate", pendulum, "-o", folder / "deep/er/p.h5", cwd=folder)
    text = run("info", folder / "deep/er/p.h5").stdout
    for word in ("Flexible pendulum", "1201 samples", "tip.x"):
        expect(word in text, f"info lacks '{word}': {text}")
    run("info", pendulum)
    (folder / "broken.h5").write_bytes((folder / "deep/er/p.h5").read_bytes()[:5000])
    run("info", folder / "broken.h5", code=2)
    run("render", folder / "broken.h5", "-o", folder / "x", code=2)
    expect(not (folder / "x").exists(), "broken results leave a folder")
finish()
