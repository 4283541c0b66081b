"""The scenes of sim/RECIPES.md as they stand on the page: each runs without a warning and gives what the formula beside it says."""
import json
import math
import pathlib
import re

from program import expect, finish, history, near, run, source, temporary_folder

page = (source / "sim" / "RECIPES.md").read_text()
recipes = {title: scene for title, scene in re.findall(r"^## (.+?)\n.*?```toml\n(.*?)```", page, re.S | re.M)}
checked = set()


def simulate(title, folder):
    checked.add(title)
    scene = folder / "scene.toml"
    scene.write_text(recipes[title])
    run("simulate", scene, "-o", folder / "r.h5", "--csv", folder / "h.csv", "--strict")
    return history(folder / "h.csv")


def crossings(t, x):
    """Times at which x rises through zero, linearly between samples."""
    return [t[k] + (t[k + 1] - t[k]) * -x[k] / (x[k + 1] - x[k]) for k in range(len(x) - 1) if x[k] < 0 <= x[k + 1]]


def pendulum(folder):
    h = simulate("A pendulum from two numbers", folder)
    times = crossings(h["t"], h["angle"])
    # The first correction for the amplitude is a^2 / 16.
    period = 2 * math.pi * math.sqrt(2 * 0.5 / (3 * 9.81)) * (1 + math.radians(2) ** 2 / 16)
    near(times[1] - times[0], period, 1e-6, "pendulum, period")


def four_bar(folder):
    h = simulate("A four-bar linkage, and which way it is put together", folder)
    worst = 0.0
    for t, angle in zip(h["t"], h["rocker"]):
        a = math.radians(60) + 2 * math.pi * t
        x, y = math.cos(a) - 4, math.sin(a)
        d = math.hypot(x, y)
        wanted = math.atan2(y, x) - math.acos((d * d + 4 - 3.5**2) / (4 * d))
        worst = max(worst, abs(math.remainder(angle - wanted, 2 * math.pi)))
    near(worst, 0.0, 1e-9, "four-bar linkage, angle of the rocker")


def spring(folder):
    h = simulate("A spring to a place in the world", folder)
    near(h["length"][0], 0.5 + 3 * 9.81 / 2000, 1e-9, "spring, length at the start")
    near(h["length"][-1], 0.5 + 3 * 9.81 / 2000, 1e-7, "spring, length at the end")


def sledge(folder):
    h = simulate("A sledge on a slope, by a turned frame", folder)
    a = math.radians(20)
    for k, t in enumerate(h["t"]):
        way = (math.sin(a) - 0.1 * math.cos(a)) * 9.81 * t * t / 2
        expect(abs(h["way.x"][k] - way) < 1e-6 and abs(h["way.y"][k]) < 1e-9, f"sledge at t = {t}: {h['way.x'][k]}, wanted {way}")
    near(h["way.x"][-1], 6.16, 0.005, "sledge, its way on the page")
    near(max(abs(x) for x in h["seat.z"]), 0, 1e-12, "sledge, the seat stays level")


def supported_beam(folder):
    h = simulate("A beam on two supports", folder)
    inertia = 0.04 * 0.02**3 / 12
    sag = 5 * 7850 * 0.04 * 0.02 * 9.81 * 2**4 / (384 * 210e9 * inertia)
    # The middle of a beam whose tip slides in also follows its own shortening, of second order.
    near(-h["sag.y"][0], sag, 2e-3 * sag, "supported beam, sag of the middle")
    near(-h["chord.y"][0], sag, 2e-3 * sag, "supported beam, its middle from the chord")
    near(h["tangent.y"][0], 0.6 * sag, 5e-3 * sag, "supported beam, its middle from the root's tangent")


def cantilever(folder):
    h = simulate("A cantilever with a damping ratio", folder)
    inertia = 0.03 * 0.002**3 / 12
    sag = 0.4**3 / (3 * 210e9 * inertia)
    near(-h["tip.y"][0], sag, 2e-3 * sag, "cantilever, deflection under 1 N")
    y = h["tip.y"]
    peaks = [y[k] for k in range(1, len(y) - 1) if y[k - 1] < y[k] >= y[k + 1] and y[k] > 0]
    # Swings of the first mode: higher ones, which the release also rings, have died away in the later half.
    late = peaks[len(peaks) // 2 :]
    decrement = math.log(late[0] / late[-1]) / (len(late) - 1)
    near(decrement, 2 * math.pi * 0.02 / math.sqrt(1 - 0.02**2), 1e-3, "cantilever, logarithmic decrement")


def blades(folder):
    h = simulate("Three blades on a hub", folder)
    speed = 300 * 2 * math.pi / 60
    mass = 2700 * (0.06 * 0.02 - 0.056 * 0.016)
    pull = mass * speed**2 * ((1.3**2 - 0.1**2) / 2)
    for number in (1, 2, 3):
        angle = 2 * math.pi / 3 * number
        near(h[f"b{number}:tip.x"][0], 1.3 * math.cos(angle), 1e-4, f"blade {number}, tip at the start")
        # The hub starts at full speed: along the blade it pulls with the centrifugal force of the whole, towards the hub.
        near(-h[f"b{number}:pull.x"][0], pull, 1e-2 * pull, f"blade {number}, pull on its root")


def buffer(folder):
    h = simulate("A buffer", folder)
    near(max(h["x"]), 0.3 + math.sqrt(2 / 5000), 1e-5, "buffer, deepest, between samples")
    near(h["v"][-1], -1.0, 1e-5, "buffer, speed after it")


def crank(folder):
    h = simulate("A crank with a load that depends on its angle", folder)
    worst = 0.0
    for piston, angle in zip(h["piston"], h["shaft"]):
        worst = max(worst, abs(piston - 0.05 * math.cos(angle) - math.sqrt(0.18**2 - (0.05 * math.sin(angle)) ** 2)))
    near(worst, 0.0, 1e-9, "crank, place of the piston")


def cam(folder):
    h = simulate("A cam and its follower", folder)
    near(max(abs(y - 0.01 * (1 - math.cos(10 * t))) for y, t in zip(h["rise"], h["t"])), 0, 1e-12, "cam, rise")
    near(max(abs(f - 0.5 * (9.81 + math.cos(10 * t))) for f, t in zip(h["push.2"], h["t"])), 0, 1e-9, "cam, push")


def flat(folder):
    h = simulate("A cam under a flat face", folder)
    a, b = 0.03, 0.02
    high = [math.hypot(a * math.sin(10 * t), b * math.cos(10 * t)) for t in h["t"]]
    # Of y^2 = a^2 sin^2 + b^2 cos^2 the derivatives: y y' = (a^2 - b^2) 10 sin cos, y'^2 + y y'' = (a^2 - b^2) 100 cos 20 t.
    wide = a * a - b * b
    rates = [wide * 5 * math.sin(20 * t) / y for t, y in zip(h["t"], high)]
    pushes = [0.5 * (9.81 + (wide * 100 * math.cos(20 * t) - v * v) / y) for t, y, v in zip(h["t"], high, rates)]
    near(max(abs(x - y) for x, y in zip(h["rise"], high)), 0, 2e-6, "cam under a flat, rise")
    late = [abs(f - p) for t, f, p in zip(h["t"], h["push"], pushes) if t > 0.2]
    near(max(late), 0, 0.02, "cam under a flat, push")


def teeth(folder):
    h = simulate("The force between two teeth", folder)
    # The motor keeps what turns itself and hands the rest on.
    moment = 2 - 0.002 * 2 / (0.002 + 0.05 / 9)
    near(h["tangential"][-1], -moment / 0.036, 1e-6, "teeth, tangential force")
    near(h["radial"][-1], moment / 0.036 * math.tan(math.radians(20)), 1e-6, "teeth, radial force")


def rail(folder):
    h = simulate("A rail on an elastic bed", folder)
    k, ei, ga = 1e7, 210e9 * 0.07 * 0.15**3 / 12, 5 / 6 * 210e9 / 2.6 * 0.07 * 0.15
    # Waves of every number n: P / pi times the integral of 1 / (k + EI n^4 / (1 + EI n^2 / GA)); without shear P b / (2 k).
    step = 0.001
    sag = 1e5 / math.pi * step * sum(1 / (k + ei * n**4 / (1 + ei * n * n / ga)) for n in ((i + 0.5) * step for i in range(60000)))
    near(sag, 1e5 * (k / (4 * ei)) ** 0.25 / (2 * k), 1.2e-2 * sag, "rail, what shear adds")
    near(-h["sag.y"][0], sag, 5e-3 * sag, "rail, sag under the wheel")


def mast(folder):
    h = simulate("A mast on the middle of a beam", folder)
    ei = 210e9 * 0.04 * 0.02**3 / 12
    top = 20 * 0.8 * 2 / (12 * ei) * 0.8 + 20 * 0.8**3 / (3 * ei)
    near(h["top.x"][0] - 1, top, 3e-3 * top, "mast, its top")


def winch(folder):
    h = simulate("A winch with a pulley block", folder)
    near(max(abs(y - 0.025 * t * t) for y, t in zip(h["height"], h["t"])), 0, 1e-9, "winch, height")
    near(h["pull"][-1], 10 * (9.81 + 0.05) / 2, 1e-6, "winch, pull")


def snap(folder):
    simulate("A truss that snaps through", folder)
    said = run("load-path", folder / "scene.toml", "--force", "load", "--to", "2", "-o", folder / "path.csv").stdout
    # P = 2 k (l0 - l) y / l is largest where l^3 = b^2 l0.
    l = 1.04 ** (1 / 6)
    y = math.sqrt(l * l - 1)
    wanted = 2 * 5000 * (math.sqrt(1.04) - l) * y / l / 10
    near(float(said.split("limit point  load ")[1].split(",")[0]), wanted, 1e-6, "truss, limit load")


def mesh(folder):
    (folder / "wedge.obj").write_text(re.search(r"```text\n(?=v )(.*?)```", page, re.S).group(1))
    expect("120" in run("info", folder / "wedge.obj").stdout, "the wedge's size")
    h = simulate("Your own mesh", folder)
    # A pendulum: energy between the start and the end, by the inertia about the pin.
    place = lambda a: (0.02 * math.sin(a) - 0.06 * math.cos(a)) * 0.5 * 9.81
    about, step = 4e-4 + 0.5 * (0.02**2 + 0.06**2), h["t"][1] - h["t"][0]
    rate = [(h["angle"][k + 1] - h["angle"][k - 1]) / (2 * step) for k in range(1, len(h["t"]) - 1)]
    energy = [about * w**2 / 2 + place(a) for w, a in zip(rate, h["angle"][1:])]
    near(max(abs(e - place(math.radians(40))) for e in energy), 0, 1e-5, "wedge, change of its energy (J of 0.4 J)")
    run("run", folder / "scene.toml", "-o", folder / "out", "--size", "160x120", "--no-video", "--frames", "0:1")
    run("export", folder / "out" / "results.h5", "--to", "gltf", "-o", folder / "wedge.gltf")
    corners = [a for a in json.loads((folder / "wedge.gltf").read_text())["accessors"] if a["type"] == "VEC3" and "min" in a]
    wanted = ([0, -0.14, -0.01], [0.06, -0.02, 0.01])
    found = [max(abs(x - y) for ends, key in zip(wanted, ("min", "max")) for x, y in zip(ends, a[key])) for a in corners]
    expect(min(found) < 1e-6, f"wedge, its corners in the body's axes: {found}")


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    for recipe in (
        pendulum,
        four_bar,
        spring,
        sledge,
        supported_beam,
        cantilever,
        blades,
        buffer,
        crank,
        cam,
        flat,
        teeth,
        rail,
        mast,
        winch,
        snap,
        mesh,
    ):
        recipe(folder)
expect(checked == set(recipes), f"recipes without a check: {set(recipes) - checked}")
finish()
