"""What a process finds around it: closed and full streams, no home, odd names of files, locales with a comma or another capital i."""
import json
import os
import pathlib
import subprocess

from program import examples, expect, flexframe, run, run_parts

python = "/usr/bin/python3"
module = pathlib.Path(flexframe).resolve().parent / "python"


def closed_streams(folder):
    """No message lands in a results file that got the number of a closed stream; a stderr that takes nothing ends nothing."""
    words = ["simulate", examples / "pendulum.toml", "--no-error-estimate", "--csv"]
    run(*words, folder / "open.csv", "-o", folder / "open.h5")
    text = (folder / "open.csv").read_bytes()
    command = " ".join(map(str, [flexframe, *words]))
    for streams, code in [
        ("0<&-", 0),
        ("2>&-", 0),
        ("2>/dev/full", 0),
        (">&-", 1),
        (">/dev/full", 1),
        ("<&- >&- 2>&-", 1),
        ("0<&- 2>&-", 0),
    ]:
        name = folder / f"r{abs(hash(streams))}"
        done = subprocess.run(["sh", "-c", f"{command} {name}.csv -o {name}.h5 {streams}"], capture_output=True, text=True)
        expect(done.returncode == code, f"{streams}: exit {done.returncode}, wanted {code}: {done.stderr}")
        expect(pathlib.Path(f"{name}.csv").read_bytes() == text, f"{streams}: other histories")
        run("info", f"{name}.h5")
        expect(b"simulating" not in pathlib.Path(f"{name}.h5").read_bytes(), f"{streams}: messages in the results")


def odd_names(folder):
    names = [b"\xc3\xa4 b'c\"$ \xe6\x97\xa5.toml", b"no\xff\xfeUTF-8.toml", b"-dash.toml", b"two\nlines.toml"]
    for name in names:
        scene = os.fsdecode(os.fsencode(folder) + b"/" + name)
        pathlib.Path(scene).write_text((examples / "pendulum.toml").read_text())
        out = scene + " out"
        words = ["--size", "160x90", "--frames", "0:2", "-q"]
        run("run", scene, "-o", out, "--no-error-estimate", *words)
        expect(len(list(pathlib.Path(out).glob("frames/*.png"))) == 2, f"pictures of {name}")
        for kind in (["info", out + "/results.h5"], ["check", scene], ["render", out + "/results.h5", "-o", out + "/again", *words]):
            json.loads(run(*kind, "--json").stdout)


def no_home(folder):
    bare = {k: v for k, v in os.environ.items() if k not in ("HOME", "XDG_CACHE_HOME", "FLEXFRAME_CACHE")}
    small = ["--size", "160x90", "--frames", "0:2", "--no-error-estimate", "-q"]
    run("run", examples / "pendulum.toml", "-o", folder / "homeless", *small, env=bare)
    run("run", examples / "pendulum.toml", "-o", folder / "nowhere", *small, env={**bare, "HOME": "/proc", "TZ": "no/zone"})


chain = '''
import locale, pathlib, sys
import flexframe as ff
n = 4
stiffness, mass = {}, {}
for a in range(n):
    for d in range(3):
        mass[3*a+d+1, 3*a+d+1] = 0.55
        for i, j, k in ((a, a, 1), (a+1, a+1, 1), (a+1, a, -1)):
            if a + 1 < n:
                key = 3*i+d+1, 3*j+d+1
                stiffness[key] = stiffness.get(key, 0) + k * 1234.5
for name, matrix in (("k.mtx", stiffness), ("m.mtx", mass)):
    lines = [f"{i} {j} {v}" for (i, j), v in matrix.items()]
    head = "%%MatrixMarket matrix coordinate real symmetric\\n" + f"{3*n} {3*n} {len(lines)}\\n"
    pathlib.Path(name).write_text(head + "\\n".join(lines) + "\\n")
pathlib.Path("nodes.txt").write_text("".join(f"{a+1} {a} 0 {a % 2}\\n" for a in range(n)))
pathlib.Path("BODY.INP").write_text("""*node
1, 0, 0, 0
2, 0.1, 0, 0
3, 0, 0.1, 0
4, 0, 0, 0.1
*element, type=c3d4, elset=all
1, 1, 2, 3, 4
*material, name=steel
*elastic
2.1e11, 0.3
*density
7850.5
*solid section, elset=all, material=steel
""")
locale.setlocale(locale.LC_ALL, sys.argv[1])
a = ff.reduce("k.mtx", mass="m.mtx", node_table="nodes.txt", modes=3)
b = ff.reduce("BODY.INP", modes=2)
r = ff.simulate(ff.load(sys.argv[2]))
print(repr(a.mass), list(map(float, a.frequencies)), repr(b.mass), list(map(float, b.frequencies)), r.t[-1], sum(r[r.columns[1]]))
'''


def locales(folder):
    """Python in a process that has set its user's locale, as windows and plots do: the same numbers."""
    if not (module / "flexframe").exists():
        print("the build has no Python module")
        return
    made = ["C"]
    for name in ("de_DE", "tr_TR"):
        done = subprocess.run(["localedef", "-i", name, "-f", "UTF-8", str(folder / f"{name}.UTF-8")], capture_output=True)
        expect(
            (folder / f"{name}.UTF-8" / "LC_NUMERIC").exists() and b"cannot" not in done.stderr,
            f"no locale {name} (package locales): {done.stderr[:300]}",
        )
        made.append(f"{name}.UTF-8")
    seen = {}
    for name in made:
        environment = {"PYTHONPATH": str(module), "PATH": "/usr/bin:/bin", "LOCPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
        done = subprocess.run(
            [python, "-c", chain, name, str((examples / "pendulum.toml").resolve())],
            capture_output=True,
            text=True,
            cwd=folder,
            env=environment,
        )
        expect(done.returncode == 0, f"{name}: {done.stderr[-1000:]}")
        seen[name] = done.stdout
        print(name, done.stdout.strip()[:160])
    expect(len(set(seen.values())) == 1, f"other numbers in another locale: {seen}")


run_parts(closed_streams, odd_names, no_home, locales)
