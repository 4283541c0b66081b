"""An accuracy asked of the pictures, "0.5 px", "0.1 mm": kept against a pendulum integrated here, told in shares, refused in words."""
import json
import math
import pathlib
import tempfile

from program import examples, expect, finish, history, run

L, G, START, WIDE, LINES = 1.0, 9.81, 1.2, 3.0, 600  # m, m/s^2, rad, m that the camera sees in LINES pixels

PENDULUM = f"""
[simulation]
duration = 2.0
output_rate = 100
gravity = [0, {-G}, 0]
ACCURACY
[[body]]
name = "rod"
kind = "rigid"
mass = 1.0
centre_of_mass = [{L / 2}, 0, 0]
inertia = [1e-4, {L * L / 12}, {L * L / 12}]
frames = {{ tip = [{L}, 0, 0] }}
shapes = [{{ shape = "link", from = [0, 0, 0], to = [{L}, 0, 0], width = 0.05, thickness = 0.02 }}]
[[joint]]
name = "pivot"
kind = "revolute"
parent = "ground"
child = "rod"
initial = {{ value = {START - math.pi / 2} }}
[[output]]
name = "tip"
of = "rod.tip"
quantity = "position"
[render]
size = [800, {LINES}]
frame_rate = 10
speed = 1.0
camera = {{ fit = false, position = [0, 0, 5], target = [0, 0, 0], height = {WIDE}, projection = "orthographic" }}
overlay = {{ title = false, time = false, scalar_bar = false, triad = false }}
"""

# A rod pressed along its axis, at rest.
PRESSED = """
[simulation]
duration = 0.1
output_rate = 100
gravity = [0, 0, 0]
start = "static"
[[body]]
name = "rod"
kind = "beam"
length = 2
section = { shape = "rectangle", width = 0.03, height = 0.03 }
material = { density = 2700, youngs_modulus = 7e10 }
effects = EFFECTS
[render]
scales = [1]
[[joint]]
name = "clamp"
kind = "weld"
parent = "ground"
child = "rod.root"
[[force]]
kind = "force"
on = "rod.tip"
direction = [-1, 0, 0]
value = 1e3
"""

# Two bars hinged to ground and to each other, a load at the apex, at rest.
BARS = (
    """
[simulation]
duration = 0.05
output_rate = 200
gravity = [0, 0, 0]
start = "static"
ACCURACY
"""
    + "".join(
        f"""
[[body]]
name = "{name}"
kind = "beam"
length = {math.hypot(1.2, 0.8)}
section = {{ shape = "circle", diameter = 0.064 }}
material = {{ density = 1200, youngs_modulus = 3e9, poisson = 0.38 }}
[[joint]]
name = "foot of {name}"
kind = "revolute"
parent = "ground"
child = "{name}.root"
position = [{x}, 0, 0]
rotation = [0, 0, {math.atan2(0.8, -x)}]
"""
        for name, x in (("left", -1.2), ("right", 1.2))
    )
    + f"""
[[joint]]
name = "apex"
kind = "revolute"
parent = "left.tip"
child = "right.tip"
rotation = [0, 0, {math.pi - 2 * math.atan2(0.8, 1.2)}]
[[force]]
kind = "force"
on = "left.tip"
direction = [0, -1, 0]
value = 4e3
[[output]]
name = "apex"
of = "left.tip"
quantity = "position"
"""
)


def true_tip(duration, samples):
    """Places of the tip by Runge-Kutta of fourth order, steps of 20 microseconds: its error is below 1e-12 m."""
    angle, rate, out = START, 0.0, []
    pull = -1.5 * G / L
    many = round(duration / samples / 2e-5)
    h = duration / samples / many
    for _ in range(samples + 1):
        out.append((L * math.sin(angle), -L * math.cos(angle)))
        for _ in range(many):
            k1, l1 = rate, pull * math.sin(angle)
            k2, l2 = rate + h / 2 * l1, pull * math.sin(angle + h / 2 * k1)
            k3, l3 = rate + h / 2 * l2, pull * math.sin(angle + h / 2 * k2)
            k4, l4 = rate + h * l3, pull * math.sin(angle + h * k3)
            angle, rate = angle + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), rate + h / 6 * (l1 + 2 * l2 + 2 * l3 + l4)
    return out


def simulate(folder, text, name, *words):
    scene = folder / "scene.toml"
    scene.write_text(text)
    done = run("simulate", scene, "-o", folder / f"{name}.h5", "--csv", folder / f"{name}.csv", "--json", "--fresh", *words)
    return json.loads(done.stdout)["simulation"]


with tempfile.TemporaryDirectory() as temporary:
    folder = pathlib.Path(temporary)
    truth = true_tip(2.0, 200)
    pixel = WIDE / LINES
    for asked, words, metres in [
        ('accuracy = "2 mm"', (), 2e-3),
        ('accuracy = "0.05 mm"', (), 5e-5),
        ('accuracy = "0.5 px"', (), 0.5 * pixel),
        ("", ("--accuracy", "0.05 px"), 0.05 * pixel),
        ('accuracy = "5 px"', ("--accuracy", "20 um"), 2e-5),  # the command line counts
    ]:
        told = simulate(folder, PENDULUM.replace("ACCURACY", asked), "run", *words)
        columns = history(folder / "run.csv")
        expect(list(columns) == ["t", "tip.x", "tip.y", "tip.z"], f"{asked}: columns are {list(columns)}")
        every = (len(columns["t"]) - 1) // 200  # more samples where they were too far apart
        apart = max(math.hypot(columns["tip.x"][i * every] - x, columns["tip.y"][i * every] - y) for i, (x, y) in enumerate(truth))
        shares = told["accuracy"]["picture"]
        unit = pixel if shares["unit"] == "px" else 1.0
        estimate = shares["total"] * unit
        print(f"{shares['asked']}: {apart:.2e} m, estimated {estimate:.2e}, tolerance {told['tolerance']:.1e}, rate x{every}")
        expect(abs(shares["allowed"] * unit - metres) < 1e-9 * metres, f"{asked} {words}: {shares['allowed']} is allowed")
        expect(apart <= metres, f"{asked} {words}: {apart:.2e} m of {metres:.2e}")
        expect(estimate <= metres and not told["warnings"], f"{asked} {words}: {told['warnings']}, {shares}")
        expect(apart <= 5 * (shares["time"] * unit), f"{asked}: off by {apart:.2e}, told {shares['time'] * unit:.2e} for time")
        parts = shares["time"] + math.hypot(shares["space"], shares["effects"]) + shares["map"] + shares["samples"] + shares["raster"]
        expect(parts <= 1.2 * shares["total"] + 1e-9, f"the shares add up to {parts}, the total is {shares['total']}")

    # Poses turn evenly between samples: a rotor at constant speed lacks nothing there, a pendulum what its angular acceleration brings.
    seldom = PENDULUM.replace("output_rate = 100", "output_rate = 20").replace("frame_rate = 10", "frame_rate = 30")
    rotor = seldom.replace(f"[0, {-G}, 0]", "[0, 0, 0]").replace("{ value =", "{ rate = 20, value =")
    for name, text in (("rotor", rotor), ("pendulum", seldom)):
        asked = simulate(folder, text.replace("ACCURACY", 'accuracy = "5 px"'), name)["accuracy"]
        simulate(folder, text.replace("ACCURACY", "").replace("output_rate = 20", "output_rate = 1200"), "tight", "--tolerance", "1e-11")
        apart = json.loads(run("compare", folder / "tight.h5", folder / f"{name}.h5", "--json").stdout)["pixels"]
        shares = asked["picture"]
        print(f"{name}: {apart:.2e} px, told {shares['total']:.2e}, of samples {shares['samples']:.2e}; {asked['chosen']}")
        if name == "rotor":
            expect(max(apart, shares["samples"]) < 1e-6, f"a rotor is off by {apart} px, told {shares}")
            expect(not any("output_rate" in words for words in asked["chosen"]), f"more samples for a rotor: {asked['chosen']}")
        else:
            expect(apart <= shares["total"] <= 5 * apart, f"a pendulum is off by {apart} px, told {shares}")
            expect(shares["samples"] > 0.5 * apart, f"samples take {shares['samples']} px of {apart}")

    # Two results compared by their vertices: a loose run is as far from the truth as its histories say.
    simulate(folder, PENDULUM.replace("ACCURACY", ""), "loose", "--tolerance", "1e-3")
    simulate(folder, PENDULUM.replace("ACCURACY", ""), "tight", "--tolerance", "1e-11")
    columns, tight = history(folder / "loose.csv"), history(folder / "tight.csv")
    tips = [math.dist(*[(c["tip.x"][i], c["tip.y"][i]) for c in (columns, tight)]) for i in range(0, 201, 10)]
    vertices = json.loads(run("compare", folder / "loose.h5", folder / "tight.h5", "--json").stdout)
    print(f"vertices {vertices['metres']:.4e} m and {vertices['pixels']:.3f} px apart, the tip {max(tips):.4e} m")
    expect(max(tips) > 1e-4, "the loose run is none")
    # The link ends beyond its tip by half its width.
    expect(0.99 * max(tips) <= vertices["metres"] <= 1.06 * max(tips), f"vertices {vertices}, tip {max(tips)}")
    expect(abs(vertices["pixels"] * pixel / vertices["metres"] - 1) < 0.01, f"pixels do not fit metres: {vertices}")
    run("compare", folder / "loose.h5", folder / "tight.h5", "--pixels", 0.5 * vertices["pixels"], code=1)
    run("compare", folder / "loose.h5", folder / "tight.h5", "--pixels", 2 * vertices["pixels"])
    # What only pictures have is refused: a test that asks for equal pixels or a report would get neither.
    for words in (("--exact",), ("--junit", folder / "j.xml"), ("--levels", 3), ("--update", "why")):
        told = run("compare", folder / "loose.h5", folder / "tight.h5", *words, code=2).stderr
        expect(f"{words[0]} is for pictures" in told, f"{words}: {told}")
    # A run that ended earlier is compared as far as it goes, and told; one of other bodies is refused.
    half = str(0.5 * columns["t"][-1])
    simulate(folder, PENDULUM.replace("ACCURACY", ""), "short", "--tolerance", "1e-11", "--set", f"simulation.duration={half}")
    done = run("compare", folder / "tight.h5", folder / "short.h5", "--json")
    short = json.loads(done.stdout)
    expect(short["metres"] < 1e-5 and short["left_out"] > 0, f"a run that is the same as far as it goes: {short}")
    expect("only" in done.stderr and f"{short['left_out']} pictures" in done.stderr, f"nothing is said of its end: {done.stderr}")
    simulate(folder, PENDULUM.replace("ACCURACY", "").replace('"rod', '"bar'), "renamed")
    expect("other bodies" in run("compare", folder / "tight.h5", folder / "renamed.h5", code=2).stderr, "another body is compared")

    # Vibrations exaggerated 20 times: what pictures ask of them is a share of what they move, not of the picture, which made steps a
    # thousand times too short (19 CPU s for 2 px, 1 now).
    crank = (examples / "slider_crank.toml").read_text()
    told = simulate(folder, crank, "crank", "--accuracy", "2 px")
    finer = [("rod", "elements", 192), ("rod", "keep_modes", 16), ("rod", "keep_axial", 4)]
    finer += [("crank", "elements", 36), ("crank", "keep_modes", 3), ("crank", "keep_axial", 2)]
    words = [w for body, key, value in finer for w in ("--set", f"body.{body}.{key}={value}")]
    words += ["--tolerance", "1e-7", "--method", "exponential", "--no-error-estimate", "--no-effect-check"]
    simulate(folder, crank, "finer", *words)
    apart = json.loads(run("compare", folder / "finer.h5", folder / "crank.h5", "--json").stdout)["pixels"]
    total = told["accuracy"]["picture"]["total"]
    print(f"slider-crank: {apart:.2f} px, told {total:.2f}, {told['evaluations']} evaluations at {told['tolerance']:.1e}")
    expect(apart <= total <= 2 and not told["warnings"], f"slider-crank: {apart} px, told {total}: {told['warnings']}")
    expect(told["evaluations"] < 20000, f"slider-crank: {told['evaluations']} evaluations")

    # A body that bends in one run only, in either order.
    for name, effects in (("stiff", "[]"), ("pressed", '["axial"]')):
        simulate(folder, PRESSED.replace("EFFECTS", effects), name)
    for pair in (("stiff", "pressed"), ("pressed", "stiff")):
        apart = json.loads(run("compare", *(folder / f"{name}.h5" for name in pair), "--json").stdout)["metres"]
        shorter = 1e3 * 2.0 / (7e10 * 0.03**2)
        expect(abs(apart / shorter - 1) < 1e-3, f"{pair}: {apart} m apart, the pressed one is {shorter} m shorter")

    # What nothing but stretching deforms is drawn stretched, though no output asks for it: 3e-5 m, exaggerated.
    unasked = PRESSED.replace("EFFECTS", '"auto"').replace("scales = [1]", "")
    told = simulate(folder, unasked, "unasked")
    expect(any("axial of 'rod' switched on" in note for note in told["notes"]), f"stretching is off: {told['notes']}")
    asked = simulate(folder, unasked.replace("[simulation]", '[simulation]\naccuracy = "0.5 px"'), "asked")["accuracy"]["picture"]
    for name in ("asked", "unasked"):
        apart = json.loads(run("compare", folder / "pressed.h5", folder / f"{name}.h5", "--json").stdout)["metres"]
        expect(apart < 1e-3 * shorter, f"{name}: {apart} m beside the run that stretches")
    expect(asked["total"] < 0.1, f"a rod that stretches evenly is told to be {asked['total']} px off")
    # Where outputs ask for less it is told.
    looked = unasked + '[[output]]\nname = "turn"\nof = "rod.tip"\nquantity = "rotation"\n'
    told = simulate(folder, looked, "looked")
    expect(any("pictures do not show its 3e-05 m" in note for note in told["notes"]), f"not told: {told['notes']}")

    # Without stretching, which nobody chose, the pilot run shows roundings as its only deformation: they are not exaggerated, and what is
    # asked for is measured by the exaggeration of the run itself.
    told = simulate(folder, BARS.replace("ACCURACY", 'accuracy = "0.5 px"'), "bars")
    shares = told["accuracy"]["picture"]
    print(f"two bars: {shares['total']:.2g} px of 0.5, search {told['accuracy']['search_cpu_seconds']:.2f} CPU s")
    expect(shares["total"] <= 0.5 and not told["warnings"], f"two bars: {shares}, {told['warnings']}")

    # A body of few nodes whose map alone takes what is asked: said, and an error where warnings are errors. The same body with its own
    # shapes (reduced to .h5) is 0.42 px away by `flexframe compare`.
    solid = examples / "pendulum_solid.toml"
    told = json.loads(run("simulate", solid, "--csv", folder / "s.csv", "--accuracy", "0.5 px", "--json", "--fresh").stdout)["simulation"]
    share = told["accuracy"]["picture"]["map"]
    print(f"map of the solid: {share:.2f} px")
    expect(0.42 / 3 <= share <= 3 * 0.42, f"the map's share is {share}, true are 0.42 px")
    expect(any("kernel map of 'pendulum'" in w for w in told["warnings"]), f"nothing is said of the map: {told['warnings']}")
    done = run("simulate", solid, "--csv", folder / "strict.csv", "--accuracy", "0.5 px", "--strict", code=1)
    expect("0.5 px" in done.stderr and not (folder / "strict.csv").exists(), f"strict: {done.stderr}")

    # What makes no sense is refused with file, line and key.
    scene = folder / "scene.toml"
    for value, words in [
        ('"0.5 kg"', ("kg", "no unit of length")),
        ('"0.5 pz"', ("pz", "unknown", "px")),
        ('"-1 px"', ("above 0",)),
        ('"half a pixel"', ("0.5 px",)),
        ("2.0", ("from 1e-12 to 0.5", "0.5 px")),
    ]:
        scene.write_text(PENDULUM.replace("ACCURACY", f"accuracy = {value}"))
        message = run("simulate", scene, "--csv", folder / "w.csv", code=2).stderr
        line = next(i for i, text in enumerate(scene.read_text().splitlines(), 1) if text.startswith("accuracy"))
        for word in (f"scene.toml:{line}", "'accuracy'", *words):
            expect(word in message, f"accuracy = {value}: {word} is not in: {message}")
        if value.startswith('"'):
            message = run("simulate", solid, "--csv", folder / "w.csv", "--accuracy", value[1:-1], code=2).stderr
            expect("--accuracy" in message, f"--accuracy {value}: {message}")
    scene.write_text(PENDULUM.replace("ACCURACY", 'accuracy = "1 px"\ntolerance = 1e-6'))
    message = run("simulate", scene, "--csv", folder / "w.csv", code=2).stderr
    expect("excludes 'tolerance'" in message, f"both given: {message}")
    done = run("sweep", solid, "--set", "simulation.duration=0.1,0.2", "-o", folder / "sweep", "--accuracy", "1 px", code=2)
    expect("a sweep compares numbers" in done.stderr, f"sweep: {done.stderr}")

finish()
