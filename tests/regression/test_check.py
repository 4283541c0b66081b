"""flexframe check: the frequencies of Schiavo et al. 2005 Table 1, and what it says of the examples."""
import json
import math
import pathlib
import re

from program import examples, expect, finish, near, run, source, temporary_folder

text = run("check", source / "tests/regression/cantilever.toml").stdout
numbers = [float(word) for word in re.findall(r"(?<![\w.])\d+\.\d+(?:e[+-]?\d+)?", text)]
for wanted in [2.0854750, 13.0698705, 36.6041219, 71.7795490, 118.842591]:
    found = min(numbers, key=lambda value: abs(value - wanted), default=0.0)
    near(found, wanted, 1e-6 * wanted, "frequency of Table 1")
for name, words in [("pendulum", ["pendulum", "bending_xy", "stiffening"]), ("slider_crank", ["crank", "rod", "block"])]:
    text = run("check", examples / f"{name}.toml").stdout
    for word in words:
        expect(word in text, f"check of {name} does not mention {word}: {text}")
# Shapes: hanging in line, two equal point masses on strings swing together and against each other, the lower joint by sqrt(2) -+ 1 ... of
# the upper.
bob = 'kind = "rigid"\nmass = 1\ncentre_of_mass = [0, -1, 0]\nframes = { end = [0, -1, 0] }\n'
with temporary_folder() as folder:
    scene = pathlib.Path(folder) / "double.toml"
    scene.write_text(
        f"""[simulation]
duration = 1
gravity = [0, -9.81, 0]
[[body]]
name = "a"
{bob}[[body]]
name = "b"
{bob}[[joint]]
name = "upper"
kind = "revolute"
parent = "ground"
child = "a"
[[joint]]
name = "lower"
kind = "revolute"
parent = "a.end"
child = "b"
"""
    )
    modes = json.loads(run("check", "--json", scene).stdout)["modes"]
    for mode, sign in zip(modes, (1, -1)):
        near(mode["frequency"], math.sqrt(9.81 * (2 - sign * math.sqrt(2))) / (2 * math.pi), 1e-8, "frequency of the double pendulum")
        part = {mover["coordinate"]: mover["part"] for mover in mode["shape"]}
        near(part["joint 'lower'"] / part["joint 'upper'"], sign * math.sqrt(2) - 1, 1e-7, "shape of the double pendulum")
    expect("joint 'upper' 1, joint 'lower' 0.414" in run("check", scene).stdout, "check does not print the shape")
expect(not pathlib.Path("cantilever").exists(), "check writes something")
# Places that outputs name are looked for too.
with temporary_folder() as folder:
    scene = pathlib.Path(folder) / "outputs.toml"
    text = (source / "tests/regression/cantilever.toml").read_text().split("[render]")[0]
    body = re.search(r'\[\[body\]\]\s*name = "([^"]*)"', text)[1]
    for wrong in (
        f'of = "{body}.tip"\nquantity = "displacement"\nrelative_to = ["rooz", "tip"]',
        f'of = "{body}.tipp"\nquantity = "position"',
    ):
        scene.write_text(f'{text}\n[[output]]\nname = "where"\n{wrong}\n')
        message = run("check", scene, code=2).stderr
        expect("where" in message and ("rooz" in message or "tipp" in message), f"check of a place that is not there: {message}")
finish()
