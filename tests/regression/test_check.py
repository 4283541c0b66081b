"""flexframe check: the frequencies of seed 000 Table 1, and what it says of the examples."""
import pathlib
import re

from program import examples, expect, finish, near, run, source

text = run("check", source / "tests/regression/cantilever.toml").stdout
numbers = [float(word) for word in re.findall(r"(?<![\w.])\d+\.\d+(?:e[+-]?\d+)?", text)]
for wanted in [2.0854750, 13.0698705, 36.6041219, 71.7795490, 118.842591]:
    found = min(numbers, key=lambda value: abs(value - wanted), default=0.0)
    near(found, wanted, 1e-6 * wanted, "frequency of Table 1")
for name, words in [("pendulum", ["pendulum", "bending_xy", "stiffening"]), ("slider_crank", ["crank", "rod", "block"])]:
    text = run("check", examples / f"{name}.toml").stdout
    for word in words:
        expect(word in text, f"check of {name} does not mention {word}: {text}")
expect(not pathlib.Path("cantilever").exists(), "check writes something")
finish()
