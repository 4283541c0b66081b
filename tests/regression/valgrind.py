"""The short ways through the program under valgrind: no wrong access, nothing undefined, nothing lost.  valgrind.py FLEXFRAME SOURCE_DIR
(nightly)"""
import pathlib
import subprocess

from program import expect, finish, flexframe, source, temporary_folder

scene_text = """[simulation]
duration = 0.05
output_rate = 100
gravity = [0, -9.81, 0]
tolerance = 1e-4
[[body]]
name = "rod"
kind = "beam"
length = 0.5
section = { shape = "circle", diameter = 0.02 }
material = { density = 7800.0, youngs_modulus = 2.1e11 }
elements = 2
effects = ["bending_xy", "stiffening"]
[[body]]
name = "bob"
kind = "rigid"
mass = 1
inertia = [0.01, 0.01, 0.01]
frames = { q = [0.3, 0.1, 0] }
[[joint]]
name = "pin"
kind = "revolute"
parent = "ground"
child = "rod.root"
[[joint]]
name = "other"
kind = "revolute"
parent = "ground"
child = "bob"
position = [0.4, 0.5, 0]
[[joint]]
name = "link"
kind = "distance"
parent = "rod.tip"
child = "bob.q"
length = 0.6324555320336759
[[output]]
name = "tip"
of = "rod.tip"
quantity = "position"
[render]
size = [64, 36]
frame_rate = 20
"""


def checked(*words, code=0):
    done = subprocess.run(
        [
            "valgrind",
            "-q",
            "--error-exitcode=99",
            "--leak-check=full",
            "--errors-for-leak-kinds=definite",
            "--trace-children=no",
            flexframe,
            *map(str, words),
        ],
        capture_output=True,
        text=True,
        timeout=3600,
    )
    expect(done.returncode == code, f"{words[0]} under valgrind: exit {done.returncode}, wanted {code}: {done.stderr[-3000:]}")


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    scene = folder / "scene.toml"
    scene.write_text(scene_text)
    checked("check", scene)
    checked("simulate", scene, "-o", folder / "r.h5", "--csv", folder / "r.csv")
    checked("info", folder / "r.h5")
    for kind, out in [("csv", "e.csv"), ("gltf", "e.glb"), ("vtk", "e")]:
        checked("export", folder / "r.h5", "--to", kind, "-o", folder / out)
    (folder / "wrong.toml").write_text(scene_text.replace("rod.tip", "rod.tpi"))
    checked("check", folder / "wrong.toml", code=2)
    (folder / "cut.h5").write_bytes((folder / "r.h5").read_bytes()[:5000])
    checked("info", folder / "cut.h5", code=2)
finish()
