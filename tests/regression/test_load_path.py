"""Load-deflection curves through limit points: `flexframe load-path` against closed formulas and the elastica."""
import csv
import json
import math
import pathlib

import numpy as np
from program import expect, finish, near, run, temporary_folder
from scipy.integrate import solve_bvp
from scipy.optimize import brentq


def path(folder, text, *words, code=0):
    """Columns of the curve, and what was said."""
    scene = folder / "scene.toml"
    scene.write_text(text)
    done = run("load-path", scene, "-o", folder / "path.csv", *words, code=code)
    if code:
        return done.stderr
    rows = list(csv.reader((folder / "path.csv").open()))
    columns = {name: np.array([float(r[i]) for r in rows[1:]]) for i, name in enumerate(rows[0])}
    expect((folder / "path.svg").read_text().startswith("<svg"), "no diagram beside the curve")
    return columns, done.stdout + done.stderr


def elastica_tip(force):
    """Tip of a cantilever of length and bending stiffness 1 under a dead load across it."""
    s = np.linspace(0, 1, 101)
    solved = solve_bvp(lambda s, y: [y[1], -force * np.cos(y[0])], lambda a, b: [a[0], b[1]], s, [1.2 * s, 1.2 - s], tol=1e-8)
    angle = solved.sol(np.linspace(0, 1, 4001))[0]
    return np.trapz(np.cos(angle), dx=1 / 4000), np.trapz(np.sin(angle), dx=1 / 4000)


def cantilever(folder):
    """A beam that bends little: the straight line F L^3 / (3 E I), whatever its coordinates are measured in."""
    text = "[simulation]\nduration = 1\ngravity = [0, 0, 0]\n"
    text += '[[body]]\nname = "beam"\nkind = "beam"\nlength = 1\nsection = { shape = "rectangle", width = 0.01, height = 0.01 }\n'
    text += "material = { youngs_modulus = 2e11, poisson = 0.3, density = 7800 }\n"
    text += '[[joint]]\nname = "clamp"\nkind = "weld"\nparent = "ground"\nchild = "beam"\n'
    text += '[[force]]\nname = "tip"\nkind = "force"\non = "beam.tip"\ndirection = [0, 1, 0]\nvalue = 1\n'
    text += '[[output]]\nname = "at"\nof = "beam.tip"\nquantity = "position"\n'
    deflection = 1.0 / (3 * 2e11 * 0.01**4 / 12)
    modes = ["--set", "body.beam.modes={ axial = [1, 2], bending_xy = [1, 2, 3, 4, 5, 6], bending_xz = [1, 2, 3, 4, 5, 6], torsion = [1] }"]
    weight = 7800 * 1e-4 * 9.81 / (8 * 2e11 * 0.01**4 / 12)
    for model, off in (("modal", 5e-4), ("finite-element", 5e-4), ("mixed", 5e-4), ("lumped", 4e-3)):
        words = modes if model == "modal" else []
        h_, said = path(folder, text, "--set", f"body.beam.model={model}", "--to", "2", *words)
        expect(h_["load"][-1] == 2 and "warning" not in said, f"a {model} cantilever: {said}")
        expect(np.all(h_["stable"] == 1) and not np.any(h_["limit"]), f"a {model} cantilever is not stable")
        worst = np.max(np.abs(h_["at.y"] - h_["load"] * deflection)) / (2 * deflection)
        near(worst, 0, off, f"a {model} cantilever's line")
    # Bent far: the elastica's, or a warning.
    for model, load in (("finite-element", 250), ("finite-element", 1000), ("modal", 100), ("modal", 30), ("mixed", 1000)):
        words = modes if model == "modal" else []
        h_, said = path(folder, text, "--set", f"body.beam.model={model}", "--set", f"force.tip.value={load}", *words)
        e = elastica_tip(load / (2e11 * 0.01**4 / 12))
        off = math.hypot(h_["at.x"][-1] - e[0], h_["at.y"][-1] - e[1]) / math.hypot(1 - e[0], e[1])
        print(f"{model} cantilever under {load} N: {100 * off:.2g} % off the elastica: {said}")
        expect(off < 0.01 or "degrees within its own frame" in said, f"a {model} cantilever is {off:.3g} off, and nobody says so")
        expect(h_["load"][-1] == 1, f"a {model} cantilever under {load} N: {said}")
    # Its own weight besides, in the other direction.
    h_, said = path(folder, text, "--set", "simulation.gravity=[0, 0, -9.81]")
    expect(h_["load"][-1] == 1 and "warning" not in said, f"a cantilever under its weight: {said}")
    near(h_["at.z"][-1], -weight, 2e-3 * weight, "a cantilever under its weight")
    near(h_["at.y"][-1], deflection, 2e-3 * deflection, "and its load")
    # What holds it.
    held = '[[output]]\nname = "held"\nof = "clamp"\nquantity = "reaction"\n'
    h_, said = path(folder, text + held)
    near(max(np.max(np.abs(np.abs(h_["held.y"]) - h_["load"])), 0), 0, 1e-6, f"what holds a cantilever, N: {said}")


def truss(folder):
    """Two elastic bars over a low apex: P = 2 k (l0 - l) (h - w) / l."""
    b, h, k = 1.0, 0.2, 5000.0
    l0 = math.hypot(b, h)
    force = lambda w: 2 * k * (l0 - math.hypot(b, h - w)) * (h - w) / math.hypot(b, h - w)
    text = "[simulation]\nduration = 1\n[ground]\nframes = { left = [-1, 0, 0], right = [1, 0, 0] }\n"
    text += f'[[body]]\nname = "apex"\nkind = "rigid"\nmass = 1\n[[joint]]\nname = "down"\nkind = "prismatic"\n'
    text += f'parent = "ground"\nchild = "apex"\n'
    text += f"axis = [0, -1, 0]\nposition = [0, {h}, 0]\n"
    for side in ("left", "right"):
        text += (
            f'[[force]]\nname = "{side}"\nkind = "spring-damper"\non = "apex"\nfrom = "ground.{side}"\nstiffness = {k}\nrest = {l0:.17g}\n'
        )
    text += '[[force]]\nname = "load"\nkind = "force"\non = "apex"\ndirection = [0, -1, 0]\nvalue = 10\n'
    text += '[[output]]\nname = "w"\nof = "down"\nquantity = "value"\n[[output]]\nname = "bar"\nof = "left"\nquantity = "force"\n'
    text += '[[output]]\nname = "slide"\nof = "down"\nquantity = "reaction"\n'
    for words in (("--force", "load", "--to", "4"), ("--to", "4")):
        h_, said = path(folder, text, *words)
        off = np.max(np.abs(10 * h_["load"] - [force(w) for w in h_["w"]]))
        near(off, 0, 1e-8, f"truss {words}: loads of its states, N")
        top = brentq(lambda w: force(w + 1e-6) - force(w - 1e-6), 0.01, h - 1e-3)
        limits = h_["load"][h_["limit"] == 1]
        expect(len(limits) == 2, f"truss: limit points at {limits}")
        near(10 * limits[0], force(top), 1e-7, "truss, limit load")
        near(10 * limits[1], -force(top), 1e-7, "truss, lower limit load")
        slope = np.array([(force(w + 1e-6) - force(w - 1e-6)) for w in h_["w"]])
        wrong = (h_["stable"] == 1) != (slope > 0)
        expect(not np.any(wrong & (h_["limit"] == 0)), "truss: stable states are those of rising load")
        near(h_["load"][-1], 4, 1e-12, "truss, the last load")
        expect("limit point" in said, f"truss: limit points are not told: {said}")
    told = json.loads(run("load-path", folder / "scene.toml", "--to", 4, "-o", folder / "path.csv", "--json").stdout)
    near(10 * told["limit_points"][0]["load"], 10 * limits[0], 1e-9, "truss, limit load as JSON")
    near(told["limit_points"][0]["outputs"]["w"], top, 1e-6, "truss, where it snaps, as JSON")
    # Backwards, from a load.
    h_, said = path(folder, text, "--force", "load", "--from", "1", "--to", "-2")
    near(np.max(np.abs(10 * h_["load"] - [force(w) for w in h_["w"]])), 0, 1e-8, "truss backwards, N")
    near(h_["load"][-1], -2, 1e-12, "truss backwards, the last load")


def toggle(folder):
    """Half of Williams' toggle, a bar clamped at a low angle whose other end slides upright: extensible elastica."""
    L, beta, E, d = 0.6, math.radians(6), 70e9, 0.012
    A, I = math.pi * d * d / 4, math.pi * d**4 / 64
    b, h = L * math.cos(beta), L * math.sin(beta)

    def bar(s, y, p):
        H, V = p
        stretch = 1 + (H * np.cos(y[2]) + V * np.sin(y[2])) / (E * A)
        return np.stack([stretch * np.cos(y[2]), stretch * np.sin(y[2]), y[3] / (E * I), stretch * (H * np.sin(y[2]) - V * np.cos(y[2]))])

    def load(w, guess):
        ends = lambda a, z, p: np.array([a[0], a[1], a[2] - beta, z[0] - b, z[1] - (h - w), z[2] - beta])
        done = solve_bvp(bar, ends, *guess, tol=1e-8, max_nodes=20000)
        expect(done.success, f"elastica at w = {w}: {done.message}")
        return -done.p[1], (done.x, done.y, done.p)

    text = "[simulation]\nduration = 1\n"
    text += f'[[body]]\nname = "bar"\nkind = "beam"\nlength = {L}\nsection = {{ shape = "circle", '
    text += f'diameter = {d} }}\nmodel = "mixed"\nvolumes = 6\n'
    text += f'material = {{ density = 2700, youngs_modulus = {E} }}\neffects = ["axial", "bending_xy", "stiffening"]\n'
    text += '[[body]]\nname = "apex"\nkind = "rigid"\nmass = 1\ninertia = [1, 1, 1]\n'
    text += f'[[joint]]\nname = "clamp"\nkind = "weld"\nparent = "ground"\nchild = "bar"\nrotation = [0, 0, {beta:.17g}]\n'
    text += f'[[joint]]\nname = "upright"\nkind = "prismatic"\nparent = "ground"\nchild = "apex"\naxis = [0, -1, '
    text += f"0]\nposition = [{b:.17g}, {h:.17g}, 0]\n"
    text += f'[[joint]]\nname = "end"\nkind = "weld"\nparent = "bar.tip"\nchild = "apex"\nrotation = [0, 0, {-beta:.17g}]\n'
    text += '[[force]]\nname = "load"\nkind = "force"\non = "apex"\ndirection = [0, -1, 0]\nvalue = 100\n'
    text += '[[output]]\nname = "w"\nof = "upright"\nquantity = "value"\n'
    h_, said = path(folder, text, "--force", "load", "--to", "30", "--states", "400")
    s = np.linspace(0, L, 40)
    guess = (s, np.stack([s * math.cos(beta), s * math.sin(beta), np.full(40, beta), 0 * s]), [0.0, 0.0])
    worst, largest, at = 0.0, 0.0, 0.0
    for w, factor in zip(h_["w"], h_["load"]):
        # In small steps, so that the guess is near.
        for x in np.linspace(at, w, max(2, int(abs(w - at) / 0.004) + 1))[1:]:
            P, guess = load(x, guess)
        at = w
        if w == 0:
            continue
        worst, largest = max(worst, abs(P - 100 * factor)), max(largest, abs(P))
    print(f"toggle: {len(h_['w'])} states, loads up to {largest:.4g} N, limits {100 * h_['load'][h_['limit'] == 1]}")
    near(worst, 0, 4e-3 * largest, "toggle, loads of its states against the elastica, N")
    expect(np.sum(h_["limit"]) >= 2, f"toggle: it snaps: {said}")


def wrong_words(folder):
    text = '[simulation]\nduration = 1\n[[body]]\nname = "a"\nkind = "rigid"\nmass = 1\n'
    text += '[[joint]]\nname = "x"\nkind = "prismatic"\nparent = "ground"\nchild = "a"\n%s'
    force = '[[force]]\nname = "load"\nkind = "force"\non = "a"\ndirection = [1, 0, 0]\nvalue = 1\n'
    out = '[[output]]\nname = "x"\nof = "x"\nquantity = "value"\n'
    spring = "spring = { stiffness = 10 }\n"
    for scene, words, says in (
        (text % spring + force + out, ("--force", "lod"), "did you mean 'load'"),
        (text % spring + force, (), "no [[output]]"),
        (text % spring + force + out, ("--to", "0"), "range of loads"),
        (text % "" + force + out, ("--from", "1", "--to", "2"), "no equilibrium"),
        (text % 'motion = "t"\n' + force + out, (), "motion has a rate"),
    ):
        told = path(folder, scene, *words, code=2)
        expect(says in told, f"{words}: '{says}' is not in: {told}")


def no_load(folder):
    """A load that begins at zero has no factors."""
    text = '[simulation]\nduration = 1\n[[body]]\nname = "a"\nkind = "rigid"\nmass = 1\n'
    text += '[[joint]]\nname = "x"\nkind = "prismatic"\nparent = "ground"\nchild = "a"\naxis = [1, 0, 0]\nspring = { stiffness = 10 }\n'
    text += '[[force]]\nname = "load"\nkind = "force"\non = "a"\ndirection = [1, 0, 0]\nvalue = "5*t"\n'
    text += '[[output]]\nname = "x"\nof = "x"\nquantity = "value"\n'
    said = path(folder, text, "--force", "load")[1]
    expect("nothing moves" in said, f"a load of zero: {said}")
    h_, said = path(folder, text.replace("5*t", "5"), "--force", "load")
    expect("nothing moves" not in said, f"a load that moves: {said}")
    near(h_["x"][-1], 0.5, 1e-12, "a spring under its load, m")


with temporary_folder() as folder:
    for part in (cantilever, truss, toggle, wrong_words, no_load):
        part(pathlib.Path(folder))
finish()
