"""What a scene does not use costs nothing: both machines under callgrind. Of all instructions less than a tenth of a per cent is spent in
the functions of couplings, contacts, blocks, readings, bushings and curves, in their empty loops; a scene that has all of these spends more
on each."""
import pathlib
import re
import shutil
import subprocess

from program import examples, expect, finish, flexframe, temporary_folder

# Functions by what only they are for.
features = {
    "contacts": r"contact",
    "couplings and ropes": r"coupling|rope",
    "blocks and readings": r"signal|StateFunction|state_function|block",
    "bushings": r"bushing",
    "curves": r"SpaceCurve|CubicTable",
    "friction and stops": r"friction|stop_force",
}

everything = """[simulation]
duration = 0.05
gravity = [0, -9.81, 0]
method = "adams"
[ground]
frames = { hook = [0, 1, 0] }
[[body]]
name = "a"
kind = "rigid"
mass = 1
inertia = [0.1, 0.1, 0.1]
[[body]]
name = "b"
kind = "rigid"
mass = 1
inertia = [0.1, 0.1, 0.1]
[[body]]
name = "c"
kind = "rigid"
mass = 1
inertia = [0.1, 0.1, 0.1]
[[joint]]
name = "a"
kind = "revolute"
parent = "ground"
child = "a"
initial = { rate = 2 }
stop = { upper = 0.01, stiffness = 1000 }
friction = { coefficient = 0.1, normal_force = 1 }
[[joint]]
name = "b"
kind = "prismatic"
parent = "ground"
child = "b"
axis = [1, 0, 0]
[[joint]]
name = "c"
kind = "point-on-curve"
parent = "ground"
child = "c"
curve = { x = "sin(u)", y = "-cos(u)", z = "0", to = 2 }
initial = { guess = 0.5 }
[[coupling]]
name = "rack"
kind = "rack"
joints = ["a", "b"]
radius = 0.2
[[coupling]]
name = "rope"
kind = "rope"
through = ["c", "ground.hook"]
length = 1.94
terms = [{ joint = "b", factor = 1 }]
[[output]]
name = "x"
of = "b"
quantity = "value"
[[block]]
name = "lag"
kind = "transfer-function"
input = "x"
numerator = [1]
denominator = [0.1, 1]
[[force]]
kind = "force"
on = "b"
direction = [1, 0, 0]
value = "-5*lag - abs(x)"
[[force]]
kind = "contact"
on = "b"
shape = "sphere"
radius = 0.1
normal = [0, 1, 0]
stiffness = 1000
[[force]]
kind = "bushing"
on = "b"
stiffness = [1, 1, 1, 1, 1, 1]
damping = [0, 0, 0, 0, 0, 0]
"""


def instructions(scene, folder):
    """All instructions of a run, and those of every function of the program."""
    out = folder / "callgrind.out"
    words = [flexframe, "simulate", scene, "-o", folder / "r.h5", "--no-error-estimate", "--no-effect-check"]
    done = subprocess.run(
        ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", *words], capture_output=True, text=True, timeout=500
    )
    expect(done.returncode == 0, f"callgrind run failed: {done.stderr[-500:]}")
    listed = subprocess.run(["callgrind_annotate", "--threshold=100", out], capture_output=True, text=True).stdout
    counts = {}
    for line in listed.splitlines():
        found = re.match(r"\s*([\d,]+) \([^)]*\)\s+\S*?:(.*flexframe::sim::.*)", line)
        if found:
            # the function's own name, without what it returns and takes
            name = re.sub(r"\(anonymous namespace\)::", "", found.group(2)).split("(")[0]
            name = re.sub(r"<.*", "", name).split(" ")[-1]
            counts[name] = counts.get(name, 0) + int(found.group(1).replace(",", ""))
    return int(re.search(r"Collected : (\d+)", done.stderr).group(1)), counts


def shares(scene, folder):
    total, counts = instructions(scene, folder)
    expect(len(counts) > 100, f"callgrind names {len(counts)} functions of sim")
    out = {}
    for feature, words in features.items():
        mine = {name: n for name, n in counts.items() if re.search(words, name) and not re.search(r"read_|::parse|Reader", name)}
        out[feature] = sum(mine.values()) / total
        shown = ", ".join(f"{name.split('::')[-1]} {n}" for name, n in sorted(mine.items(), key=lambda i: -i[1])[:4])
        print(f"{scene.stem}: {feature}: {100 * out[feature]:.3f} % of {total} instructions: {shown}")
    return out


with temporary_folder() as name:
    folder = pathlib.Path(name)
    expect(shutil.which("valgrind"), "valgrind is missing (tests/packages.txt)")
    if b"__asan_init" in pathlib.Path(flexframe).read_bytes():
        print("built with sanitizers: instructions are not counted")
    else:
        scene = folder / "everything.toml"
        scene.write_text(everything)
        for feature, share in shares(scene, folder).items():
            expect(share > 5e-5, f"a scene with {feature} spends {share:.2%} on them: their functions have other names now")
        for machine in ("pendulum", "slider_crank"):
            text = (examples / f"{machine}.toml").read_text()
            text = re.sub(r"^duration = .*$", "duration = 0.05", text, flags=re.M).split("[render]")[0]
            scene = folder / f"{machine}.toml"
            scene.write_text("\n".join(line for line in text.splitlines() if not line.startswith("mesh")))
            found = shares(scene, folder)
            expect(sum(found.values()) < 0.001, f"{machine}: what it does not use takes {sum(found.values()):.2%}")
finish()
