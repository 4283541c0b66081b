"""flexframe new: every template is made, checks, runs and is drawn; names that are taken or unknown are answered."""
import json
import pathlib
import re
import subprocess

from program import expect, finish, history, run, temporary_folder

with temporary_folder() as name:
    folder = pathlib.Path(name)
    words = re.findall(r"^  (\S+) +\S", run("new", "--help").stdout.split("Templates:")[1].split("Examples:")[0], re.M)
    wanted = "pendulum slider-crank four-bar rotor robot-arm beam fe-body suspension results".split()
    expect(words == wanted, f"templates: {words}")
    for word in wanted:
        print("--", word, flush=True)
        made = folder / word / f"my_{word.replace('-', '_')}"
        told = json.loads(run("new", made, "-t", word, "--json").stdout)
        expect(str(made) in told["next"] and all(pathlib.Path(file).exists() for file in told["made"]), f"{word}: {told}")
        if word == "results":
            script = subprocess.run(["/usr/bin/python3", f"{made}.py"], cwd=made.parent, capture_output=True, text=True)
            if "No module named" in script.stderr:
                print("skipped:", script.stderr.strip().splitlines()[-1])
                continue
            expect(script.returncode == 0, f"{word}: {script.stderr}")
            run("render", f"{made}.h5", "-o", folder / "drawn", "--size", "160x120", "--no-video", "--frames", "0:2")
            continue
        scene = pathlib.Path(f"{made}.toml")
        text = scene.read_text()
        expect("@NAME@" not in text and scene.stem in text, f"{word}: the name is not filled in")
        expect(text.count("#") >= 3, f"{word}: no comments")
        run("check", scene)
        out = folder / f"{word}_run"
        done = run("run", scene, "-o", out, "--size", "160x120", "--no-video", "--frames", "0:2")
        expect("WARNING" not in done.stdout.upper() + done.stderr.upper(), f"{word}: {done.stdout}")
        columns = history(out / "histories.csv")
        expect(any(max(c) - min(c) > 1e-9 for n, c in columns.items() if n != "t"), f"{word}: nothing moves")
    expect("next " in run("new", folder / "plain").stdout, "what to do next is not said")
    message = run("new", folder / "beam" / "my_beam", "-t", "beam", code=2).stderr
    expect("my_beam.toml: is there already" in message, message)
    message = run("new", folder / "x", "-t", "beem", code=2).stderr
    expect("did you mean 'beam'" in message and "suspension" in message, message)
finish()
