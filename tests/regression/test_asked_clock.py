"""What is chosen for an asked accuracy does not hang on how fast the processor is: the same settings and numbers under a clock of CPU time
that runs forty times as fast (fast_clock.cpp)."""
import json
import os
import pathlib
import sys

from program import examples, expect, finish, history, run, temporary_folder

FAST = os.environ.get("FLEXFRAME_FAST_CLOCK")
if not FAST:
    sys.exit("FLEXFRAME_FAST_CLOCK names no library: build the target fast_clock and run the test by ctest")

# A beam that is thrown on a stop: what follows vibrations straight away is not for it, and a search of some thirty runs begins.
STOPPED = """
[simulation]
duration = 0.3
output_rate = 500

[[body]]
name = "flap"
kind = "beam"
length = 1.0
section = { shape = "rectangle", height = 0.02, width = 0.05 }
material = { density = 7850, youngs_modulus = 2.1e11 }

[[joint]]
name = "hinge"
kind = "revolute"
parent = "ground"
child = "flap"
axis = [0, 0, 1]
initial = { value = 0.4 }
stop = { lower = 0.0, stiffness = 2e4, damping = 5 }

[[output]]
name = "angle"
of = "hinge"
quantity = "value"
[[output]]
name = "bend"
of = "flap.tip"
quantity = "displacement"
"""


def simulate(folder, name, scene, accuracy, words, fast):
    environment = {**os.environ, "LD_PRELOAD": FAST} if fast else None
    table = folder / f"{name}_{fast}.csv"
    done = run(
        "simulate", scene, "-o", folder / "out.h5", "--csv", table, "--accuracy", accuracy, "--fresh", "--json", *words, env=environment
    )
    said = json.loads(done.stdout)["simulation"]
    return said, history(table)


with temporary_folder() as name_of_folder:
    folder = pathlib.Path(name_of_folder)
    stopped = folder / "stopped.toml"
    stopped.write_text(STOPPED)
    auto = ["--set", "body.crank.effects=auto", "--set", "body.rod.effects=auto"]
    for name, scene, accuracy, words in (
        ("pendulum", examples / "pendulum.toml", "1e-3", ["--set", "body.pendulum.effects=auto"]),
        ("slider-crank", examples / "slider_crank.toml", "1e-2", auto),
        ("stopped", stopped, "1e-2", []),
        ("blade", examples / "beams" / "blade.toml", "1e-2", ["--set", "simulation.duration=1"]),
    ):
        (slow, a), (fast, b) = (simulate(folder, name, scene, accuracy, words, f) for f in (False, True))
        print(f"{name}: {slow['accuracy']['chosen']}; CPU s {slow['cpu_seconds']:.3g} and {fast['cpu_seconds']:.3g}")
        expect(fast["cpu_seconds"] > 5 * slow["cpu_seconds"], f"{name}: the clock does not run faster")
        expect(slow["accuracy"]["chosen"] == fast["accuracy"]["chosen"], f"{name}: other settings: {fast['accuracy']['chosen']}")
        expect(slow["error_estimate"] == fast["error_estimate"], f"{name}: another error told")
        expect(a == b, f"{name}: other numbers")
finish()
