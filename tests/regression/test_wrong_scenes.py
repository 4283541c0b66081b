"""Wrong scenes: exit 2, a message with file, line and what is allowed, nothing written."""
import pathlib

from program import examples, expect, finish, history, near, run, temporary_folder

good = (examples / "slider_crank.toml").read_text()

# (what stands there, what stands there instead, words of the message)
cases = [
    ("length = 0.152", "lenght = 0.152", ["lenght", "did you mean 'length'"]),
    ("length = 0.152", "length = 0", ["length", "> 0"]),
    ("length = 0.152", "length = nan", ["length"]),
    ("length = 0.152", 'length = "long"', ["length", "long"]),
    ("density = 2770.0, youngs_modulus = 1e9", "density = -2770.0, youngs_modulus = 1e9", ["density", "> 0"]),
    ('kind = "rigid"', 'kind = "rigit"', ["rigit", "did you mean 'rigid'"]),
    ('child = "rod.root"', 'child = "rod.rot"', ["crank_pin", "rod", "root", "tip", "middle"]),
    ('parent = "crank.tip"', 'parent = "krank.tip"', ["krank"]),
    ('of = "rod.middle"', 'of = "rod.midle"', ["rod", "middle"]),
    ('value = "t <= 0.7 ?', 'value = "t <= 0.7 ? (', ["value"]),
    ("axis = [1, 0, 0]", "axis = [0, 0, 0]", ["axis"]),
    ("mass = 0\n", "mass = 1\ncentre_of_mass = [0, 1e160, 0]\n", ["centre_of_mass", "beyond double precision"]),
    ("duration = 1.6", "duration = -1", ["duration", "> 0"]),
    ("duration = 1.6", "duration = 1e300", []),
    ("tolerance = 3e-7", 'method = "euler"', ["euler", "bdf"]),
    ('color_by = "displacement"', 'color_by = "displacements"', ["color_by", "did you mean 'displacement'"]),
    ("scales = [1, 20]", 'scales = "some"', ["scales", "auto"]),
    ('plot = ["slider.x"', 'plot = ["slidr.x"', ["plot", "slidr.x"]),
    ("size = [1280, 720]", "size = [1280, 0]", ["size"]),
    ("frame_rate = 60", "frame_rate = 60\nmesh = 3", ["mesh"]),
    ('name = "block"', 'name = "block"\nmesh = "missing.obj"', ["missing.obj"]),
    ('name = "rod"\nkind', 'name = "crank"\nkind', ["crank"]),
    ("[simulation]", "[simulation", []),
]

with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    scene = folder / "wrong.toml"
    for old, new, words in cases:
        expect(old in good, f"the example has changed: no '{old}'")
        text = good.replace(old, new, 1)
        scene.write_text(text)
        line = text[: text.index(new)].count("\n") + 1
        for command in (["run", scene], ["run", scene, "-o", folder / "out"], ["simulate", scene, "-o", folder / "r.h5"], ["check", scene]):
            done = run(*command, code=2, cwd=folder, timeout=60)
            expect(done.stdout == "", f"'{new}': stdout is not empty: {done.stdout[:200]}")
            for word in ["flexframe: ", "wrong.toml", *words]:
                expect(word in done.stderr, f"'{new}': the message lacks '{word}': {done.stderr.strip()}")
            # Line numbers: of the key, or of its table.
            numbers = [int(part) for part in done.stderr.replace(":", " ").replace(",", " ").split() if part.isdigit()]
            expect(
                any(line - 8 <= n <= line + 1 for n in numbers), f"'{new}' in line {line}: no line near it is named: {done.stderr.strip()}"
            )
            left = sorted(p.name for p in folder.iterdir())
            expect(left == ["wrong.toml"], f"'{new}': written: {left}")

    # A mechanism that cannot be assembled: which joint is open, and by how much.
    scene.write_text(good.replace("axis = [1, 0, 0]", "axis = [1, 0, 0]\nposition = [0, 2, 0]", 1))
    done = run("run", scene, code=2, cwd=folder)
    expect(any(name in done.stderr for name in ("guide", "wrist_pin", "crank_pin")), f"no joint is named: {done.stderr}")
    expect(sorted(p.name for p in folder.iterdir()) == ["wrong.toml"], "an open mechanism leaves files")

    # A beam held at both ends whose support is beside its tip: what to write instead is said, and does.
    held = (
        "[simulation]\nduration = 1\noutput_rate = 100\ngravity = [0, 0, 0]\n[ground]\nframes = { e = [2, 0.001, 0] }\n"
        '[[body]]\nname = "b"\nkind = "beam"\nlength = 2.0\nsection = { shape = "rectangle", height = 0.05, width = 0.02 }\n'
        "material = { density = 7800, youngs_modulus = 2e11, poisson = 0.3 }\ndamping = { stiffness = 1e-3 }\n"
        '[[joint]]\nname = "l"\nkind = "weld"\nparent = "ground"\nchild = "b"\n'
        '[[output]]\nname = "h"\nof = "l"\nquantity = "reaction"\n'
    )
    scene.write_text(held + '[[joint]]\nname = "r"\nkind = "weld"\nparent = "ground.e"\nchild = "b.tip"\n')
    done = run("run", scene, code=2, cwd=folder)
    expect("'b' is to give way" in done.stderr and "'motion' of a joint" in done.stderr, f"a support that settled: {done.stderr}")
    scene.write_text(
        held
        + '[[body]]\nname = "support"\nkind = "rigid"\nmass = 1\n'
        + '[[joint]]\nname = "settles"\nkind = "prismatic"\nparent = "ground"\nchild = "support"\nposition = [2, 0, 0]\naxis = [0, 1, 0]\n'
        + 'motion = "0.001*(t < 0.8 ? (1 - cos(pi*t/0.8))/2 : 1)"\n'
        + '[[joint]]\nname = "r"\nkind = "weld"\nparent = "support"\nchild = "b.tip"\n'
    )
    run("simulate", scene, "-o", folder / "r.h5", "--csv", folder / "h.csv", cwd=folder)
    force = history(folder / "h.csv")["h.y"][-1]
    EI = 2e11 * 0.02 * 0.05**3 / 12
    near(abs(force), 12 * EI * 0.001 / 2**3, 1e-2 * 62.5, "a support that settles: force")
    for name in ("r.h5", "h.csv"):
        (folder / name).unlink()

    # Files that are no scenes.
    for content in (b"", b"\x00\x01\xff" * 100, b"[render]\n" * 2, b"title = " + b"[" * 100000):
        scene.write_bytes(content)
        run("run", scene, code=2, cwd=folder, timeout=60)
    run("run", folder / "no_such_scene.toml", code=2, cwd=folder)
    run("run", folder, code=2, cwd=folder)
    expect(sorted(p.name for p in folder.iterdir()) == ["wrong.toml"], "wrong files leave something")
finish()
