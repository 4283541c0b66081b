"""What test_python.py runs in the system's Python: python_module.py FLEXFRAME SOURCE FOLDER."""
import ast
import copy
import csv
import inspect
import os
import pathlib
import pickle
import re
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import scipy.integrate

import flexframe as ff

program, source, folder = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
examples = source / "examples"
failures = []


def expect(condition, message):
    if not condition:
        failures.append(message)
        print("FAILED:", message, flush=True)


def run(*words):
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True)
    expect(done.returncode == 0, f"{words}: {done.stderr}")
    return done.stdout


def raises(kind, call, *words):
    try:
        call()
    except kind as error:
        for word in words:
            expect(word in str(error), f"{error!r} lacks '{word}'")
        return
    except BaseException as error:
        expect(False, f"{kind.__name__} wanted, {error!r} came")
        return
    expect(False, f"{kind.__name__} wanted, nothing came")


def simulate_and_draw():
    scene = ff.load(examples / "slider_crank.toml")
    fractions = []
    r = ff.simulate(scene, progress=fractions.append)
    run("simulate", examples / "slider_crank.toml", "-o", folder / "r.h5", "--csv", folder / "r.csv")
    with open(folder / "r.csv", newline="") as file:
        rows = list(csv.reader(file))
    expect(rows[0] == ["t", *r.columns], f"columns {r.columns}")
    table = np.array(rows[1:], dtype=float)
    expect(np.array_equal(table[:, 0], r.t), "times are not the program's")
    for k, column in enumerate(r.columns):
        expect(np.array_equal(table[:, k + 1], r[column]), f"{column} is not the program's to the last bit")
    expect(r.csv() == (folder / "r.csv").read_text(), "the CSV text is not the program's")
    expect(r.t.base is not None and not r.t.flags.writeable, "times are a copy or may be written")
    back = ff.read_results(folder / "r.h5")
    for name, body in r.bodies.items():
        expect(body.q.size == 0 or np.array_equal(body.q, back.bodies[name].q), f"q of {name} is not the program's")
        expect(np.array_equal(body.position, back.bodies[name].position), f"position of {name} is not the program's")
        expect(body.position.shape == (len(r.t), 3), f"shape of the position of {name}")
    group = r.columns[0].split(".")[0]
    if "." in r.columns[0]:
        expect(np.array_equal(r[group][:, 0], r[r.columns[0]]), "columns of an output together")
    raises(KeyError, lambda: r["slidr.x"])
    # The results outlive nothing but themselves: views keep them alive.
    q = next(iter(ff.simulate(scene, estimate_error=False).bodies.values())).position
    expect(np.isfinite(q).all(), "a view of results that are gone")

    run("render", folder / "r.h5", "-o", folder / "drawn", "--frames", "3:5", "--size", "320x180", "--no-video")
    made = ff.drawing(r, size=(320, 180))
    for k in (3, 4):
        theirs = ff.read_png(folder / f"drawn/frames/frame_{k:05d}.png")
        expect(np.array_equal(made.draw(k), theirs), f"picture {k} has other pixels than the program's")
    picture = ff.draw(r, t=made.time(3), size=(320, 180))
    expect(picture.shape == (180, 320, 4) and picture.dtype == np.uint8, f"a picture is {picture.shape} {picture.dtype}")
    expect(np.array_equal(picture, made.draw(3)), "draw(t) is another picture")
    # After drawing here, processes draw the film.
    told = ff.film(r, folder / "film", frames=(0, 3), size=(320, 180), workers=2, video=False)
    expect(told["pictures"] == 3, f"film tells {told}")
    expect(np.array_equal(ff.read_png(folder / "film/frames/frame_00002.png"), made.draw(2)), "the film's pixels are others")
    expect(ff.compare(folder / "film/frames/frame_00002.png", made.draw(2))["equal"], "compare finds a difference")
    expect(not ff.compare(made.draw(0), made.draw(4))["passes"], "compare finds none")
    raises(ff.InputError, lambda: ff.draw(r, color_bay="stress"), "color_bay", "color_by")
    html = r._repr_html_()
    expect("data:image/png;base64," in html and "<svg" in html and r.columns[0] in html, "a result does not show itself")
    expect(r._repr_png_()[:4] == b"\x89PNG", "no PNG of a result")


def grid(n):
    """n x n vertices over [-1, 1]^2, a little wavy, and their triangles."""
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n))
    k = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    triangles = np.concatenate([np.stack([k, k + 1, k + n + 1], 1), np.stack([k, k + n + 1, k + n], 1)])
    return np.stack([x.ravel(), y.ravel(), 0.1 * np.sin(3 * x * y).ravel()], 1), triangles.astype(np.int32)


def kernel_map():
    rng = np.random.default_rng(1)
    nodes = rng.uniform(-1, 1, (12, 3)) * [1, 1, 0.1]
    u = 0.1 * np.sin(nodes[:, [1, 2, 0]])
    side = 1000 if "--large" in sys.argv else 500
    vertices, triangles = grid(side)
    start = time.perf_counter()
    big = ff.KernelMap(nodes, vertices, triangles, scheme="r3")
    setup = time.perf_counter() - start
    out = np.zeros((len(vertices), 3), np.float32)
    big.apply(u, out=out)
    before = resident()
    got = big.apply(u, out=out)
    grown = resident() - before
    expect(got is out, "apply returns another array than out")
    # A copy of the displacements would take 12 bytes a vertex, one in double 24.
    expect(grown < 4 * side**2, f"apply into an array takes {grown / 1e6:.1f} MB")
    start = time.perf_counter()
    for _ in range(5):
        big.apply(u, out=out)
    applied = (time.perf_counter() - start) / 5
    print(f"{side**2} vertices: set up in {setup:.2f} s, applied in {1e3 * applied:.1f} ms, {grown / 1e6:.1f} MB grown")
    # Against numpy: one global r^3 kernel with a linear polynomial.
    at, faces = grid(15)
    few = ff.KernelMap(nodes, at, faces, scheme="r3", precise=True)
    d = np.linalg.norm(nodes[:, None] - nodes[None], axis=2) ** 3
    p = np.hstack([np.ones((12, 1)), nodes])
    weights = np.linalg.solve(np.block([[d, p], [p.T, np.zeros((4, 4))]]), np.vstack([u, np.zeros((4, 3))]))
    truth = np.linalg.norm(at[:, None] - nodes[None], axis=2) ** 3 @ weights[:12] + np.hstack([np.ones((len(at), 1)), at]) @ weights[12:]
    off = np.abs(few.apply_precise(u) - truth).max()
    expect(off < 1e-8, f"r3 map off by {off}")
    print(f"r3 map against numpy: {off:.1e} m")
    # A cloud of points: the global kernel knows nothing of faces.
    cloud = ff.KernelMap(nodes, at, scheme="r3", precise=True)
    expect(np.abs(cloud.apply_precise(u) - truth).max() < 1e-8, "r3 map of a cloud of points")
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]) - np.eye(3)
    moved = ff.KernelMap(nodes, at, precise=True).apply_precise(nodes @ turn.T)
    expect(np.abs(moved - at @ turn.T).max() < 1e-9, "a cloud turned with its nodes")
    raises(ff.InputError, lambda: ff.KernelMap(nodes, at, scheme="elastic"), "needs a mesh with faces")
    raises(ff.ArgumentError, lambda: few.apply(u, out=np.empty((len(at), 3))), "float32")
    raises(ff.InputError, lambda: ff.KernelMap(nodes * np.nan, at, faces), "finite")
    raises(ff.InputError, lambda: ff.KernelMap(nodes, at, faces + 10**6), "")
    raises(ValueError, lambda: few.apply(u[:5]))
    # The program's own command on the same mesh: the same numbers to the last bit that its file holds.
    with open(folder / "grid.obj", "w") as file:
        file.writelines(f"v {float(x)!r} {float(y)!r} {float(z)!r}\n" for x, y, z in at)
        file.writelines(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces)
    with open(folder / "nodes.csv", "w") as file:
        file.write("x,y,z,ux,uy,uz\n")
        file.writelines(",".join(repr(float(x)) for x in (*a, *b)) + "\n" for a, b in zip(nodes, u))
    run("deform", "--nodes", folder / "nodes.csv", "--mesh", folder / "grid.obj", "-o", folder / "moved.csv", "--scheme", "r3")
    theirs = np.loadtxt(folder / "moved.csv", delimiter=",", skiprows=1)
    expect(np.array_equal(theirs, few.apply_precise(u)), f"the map is not the program's: {np.abs(theirs - few.apply_precise(u)).max()}")


def study():
    """A study's errors against own runs of its settings, its files, its diagram."""
    scene = examples / "mechanisms/double_pendulum.toml"
    fractions = []
    s = ff.study(scene, folder / "study", axes=["tolerance"], repeats=1, reference_seconds=5, progress=fractions.append)
    expect(sorted(fractions) == fractions and all(0 <= f <= 1 for f in fractions), f"progress of a study: {fractions}")
    reference = ff.simulate(scene, tolerance=1e-12, method="erk", estimate_error=False)
    compared = 0
    for point in s["points"]:
        if not 1e-7 < point["tolerance"] < 1e-2:
            continue
        r = ff.simulate(scene, tolerance=point["tolerance"], method=point["method"], estimate_error=False)
        for column, told in point["column_errors"].items():
            truth = np.abs(r[column] - reference[column]).max() / np.ptp(reference[column])
            expect(0.3 * truth < told < 3 * truth, f"a study's error of {column} at {point['tolerance']}: {told} where {truth} is true")
            compared += 1
    expect(compared >= 6, f"{compared} errors of a study compared")
    html = s._repr_html_()
    expect("<svg" in html and "pendulum" in repr(s).lower(), f"a study does not show itself: {s!r}")
    raises(ff.InputError, lambda: ff.study(scene, axes=["colour"]), "colour")


def sweep():
    """A sweep's rows against the program's table, bit for bit; against a formula; a minimum; scenes from dicts."""
    pendulum = {
        "simulation": {"duration": 0.3, "output_rate": 200, "tolerance": 1e-8, "gravity": [0, -9.81, 0]},
        "parameters": {"L": 0.5, "start": 0.05},
        "body": [{"name": "bob", "kind": "rigid", "mass": 1.0, "inertia": [0.0, 0.0, 0.0], "centre_of_mass": [0, "-L", 0]}],
        "joint": [
            {"name": "pin", "kind": "revolute", "parent": "ground", "child": "bob", "axis": [0, 0, 1], "initial": {"value": "start"}}
        ],
        "output": [{"name": "angle", "of": "pin", "quantity": "value"}],
    }
    lengths = np.linspace(0.3, 0.7, 5)
    fractions = []
    out = folder / "swept"
    keys, wanted = {"L": lengths, "start": [0.05, 0.1]}, {"end": "final(angle)", "least": "min(angle)/start"}
    s = ff.sweep(pendulum, keys, wanted, out, workers=2, progress=fractions.append)
    expect(len(s) == 10 and s.ends == ["done"] * 10 and s.found is None, f"{s!r} {s.ends} {s.messages}")
    expect(np.array_equal(s["L"], np.repeat(lengths, 2)) and np.array_equal(s["start"], [0.05, 0.1] * 5), "keys of a sweep")
    # Small swings by Jacobi's series to the second order of the amplitude: the period is longer by amplitude^2 / 16.
    omega = np.sqrt(9.81 / s["L"]) / (1 + s["start"] ** 2 / 16)
    off = np.abs(s["end"] - s["start"] * np.cos(0.3 * omega)).max() / 0.1
    expect(off < 1e-3, f"swings of a sweep off by {off:.1e}")
    expect(
        (s.error < 1e-5).all() and (s.cpu > 0).all() and fractions and fractions[-1] == 1.0,
        f"errors, CPU, progress: {s.error} {s.cpu} {fractions}",
    )
    html = s._repr_html_()
    expect("<svg" in html and "10 done" in html and (out / "report.html").exists(), "a sweep does not show itself")
    # The program makes the same rows of the same scene.
    words = ["--set", "L=" + ",".join(map(repr, map(float, lengths))), "--set", "start=0.05,0.1"]
    run("sweep", out / "scene.toml", *words, "--response", "end=final(angle)", "-o", folder / "theirs", "--no-plots")
    with open(folder / "theirs/table.csv", newline="") as file:
        head, *rows = csv.reader(file)
    theirs = [float(row[head.index("end")]) for row in rows]
    expect(np.array_equal(theirs, s["end"]), "rows of a sweep are not the program's to the last bit")
    again = ff.sweep(pendulum, keys, wanted, out, resume=True, plots=False)
    expect(np.array_equal(again.cpu, s.cpu), "a resumed sweep is made again")
    # A spring turns what has no inertia.
    sprung = {**pendulum, "joint": [{**pendulum["joint"][0], "spring": {"stiffness": 1.0}}]}
    failed = ff.sweep(sprung, {"L": [0.5, 0.0]}, {"end": "final(angle)"}, plots=False)
    expect(failed.ends[0] == "done" and failed.ends[1] != "done" and np.isnan(failed["end"][1]), f"a failed point: {failed.ends}")
    expect(failed.messages.get(1, ""), "a failed point says nothing")
    best = ff.sweep(pendulum, {"L": "0.3:0.7"}, minimise="(final(angle) - 0.01)^2", searches=1, runs=40, plots=False)
    wanted_length = 9.81 * (0.3 / np.arccos(0.2)) ** 2 / (1 + 0.05**2 / 16) ** 2
    got = best.found["settings"]["L"]
    expect(abs(got / wanted_length - 1) < 2e-3, f"the length of a wanted swing is {got}, {wanted_length} by formula")
    raises(ff.InputError, lambda: ff.sweep(pendulum, {"length": "1:2:3"}, {"end": "final(angle)"}), "length")
    raises(ff.InputError, lambda: ff.sweep(pendulum, {"L": "1:2:3"}, {"end": "finl(angle)"}), "finl")
    raises(ff.ArgumentError, lambda: ff.sweep(pendulum, {"L": "1:2"}, minimise="L", maximise="L"), "excludes")
    raises(KeyError, lambda: s["ende"])
    stop = RuntimeError("enough")

    def enough(fraction):
        raise stop

    slow = dict(pendulum, simulation=dict(pendulum["simulation"], duration=60.0))
    raises(RuntimeError, lambda: ff.sweep(slow, keys, wanted, progress=enough, workers=2), "enough")


def resident():
    return int(open("/proc/self/statm").read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def reduce_bodies():
    deck = source / "tests/unit/data/kernel_map/conrod.inp"
    run("reduce", deck, "-o", folder / "program.sid", "--modes", "4")
    body = ff.reduce(deck, modes=4)
    body.write_sid(folder / "python.sid")
    expect(
        (folder / "python.sid").read_bytes() == (folder / "program.sid").read_bytes(), "a reduced body is not the program's to the last bit"
    )
    back = ff.Body.from_sid(folder / "program.sid")
    expect(back.n == body.n and back.mass == body.mass, "a body from a file is another one")
    expect(np.array_equal(back.Ke, body.Ke) and np.array_equal(back.phi(0), body.phi(0)), "its matrices are others")
    omega = np.sqrt(np.diag(body.Ke)) / (2 * np.pi)
    expect(np.allclose(back.frequencies, omega, rtol=1e-8), f"frequencies {back.frequencies} {omega}")
    raises(ff.InputError, lambda: ff.Body.from_sid(folder / "none.sid"), "none.sid")

    # Every word of the command, told to both: sets, spiders, materials by option, matrices, units, what is kept.
    fe = source / "tests/fuzz/corpus/fe"
    subprocess.run(["/usr/bin/python3", source / "assets/beam/make_beam.py", folder / "beam.inp", "10", "1", "2"], check=True)
    bare = (folder / "beam.inp").read_text().replace("*DENSITY", "** DENSITY").splitlines()
    number = next(k for k, line in enumerate(bare) if line.startswith("** DENSITY")) + 1
    (folder / "bare.inp").write_text("\n".join(bare[:number] + ["** " + bare[number]] + bare[number + 1 :]) + "\n")
    ends = ["--interface", "root=average:ROOT", "--interface", "tip=rigid:TIP@0.4,0,0"]
    both = {"root": "average:ROOT", "tip": "rigid:TIP@0.4,0,0"}
    pairs = [
        ("beam.inp", [*ends, "--modes", 6, "--nodes", 20], dict(interfaces=both, modes=6, node_count=20)),
        ("beam.inp", ["--hold", "ROOT", "--method", "eigen", "--highest", 900], dict(hold="ROOT", method="eigen", highest=900)),
        ("beam.inp", ["--hold", "none", "--stress", "--no-stiffening"], dict(hold=False, stress=True, stiffening=False)),
        ("beam.inp", [*ends, "--method", "response", "--highest", 150, "--cut-off", 3], None),
        ("bare.inp", ["--density", 5540, "--node-set", "TIP", "--damping", 0.01], dict(densities=5540, node_sets=["TIP"], damping=0.01)),
        (
            fe / "tet22.msh",
            ["--material", "2e11,0.3,7800", "--units", "mm", "--modes", 4],
            dict(modes=4, materials=(2e11, 0.3, 7800), units="mm"),
        ),
        (
            fe / "tet22.msh",
            ["--material", "2e11,0.3,7800", "--units", "1e-3,1e3,1", "--modes", 4],
            dict(modes=4, materials=["2e11,0.3,7800"], units=(1e-3, 1e3, 1)),
        ),
        (fe / "bricks.sti", ["--modes", 3], dict(modes=3)),
    ]
    for k, (model, words, keywords) in enumerate(pairs):
        if keywords is None:
            keywords = dict(interfaces=both, method="response", highest=150, cut_off=3)
        run("reduce", folder / model, "-o", folder / f"p{k}.sid", *words)
        told = []
        ff.reduce(folder / model, progress=told.append, **keywords).write_sid(folder / f"y{k}.sid")
        same = (folder / f"p{k}.sid").read_bytes() == (folder / f"y{k}.sid").read_bytes()
        expect(same, f"reduce {keywords}: the module's body is not the program's")
        expect(all(isinstance(text, str) for text in told), f"progress of reduce tells {told}")
    raises(ff.InputError, lambda: ff.reduce(folder / "beam.inp", interfaces={"a": "rigid:TIPS"}), "TIPS", "TIP")
    raises(ff.InputError, lambda: ff.reduce(folder / "beam.inp", method="guayan"), "did you mean 'guyan'")
    raises(ff.InputError, lambda: ff.reduce(folder / "beam.inp", modes=-1), "modes = -1")
    raises(ff.InputError, lambda: ff.reduce(folder / "beam.inp", damping=float("nan")), "damping")
    raises(TypeError, lambda: ff.reduce(folder / "beam.inp", modes="many"), "modes")
    raises(TypeError, lambda: ff.reduce(folder / "beam.inp", mods=3), "mods")


def drive():
    scene = ff.load(examples / "library/cart.toml")
    sim = ff.Simulation(scene)
    start = sim.state()

    def balance(steps):
        out = []
        for _ in range(steps):
            sim.set_input("push", 9.7 * sim.output("x") + 10.8 * sim.output("v") - 61.0 * sim.output("angle") - 13.9 * sim.output("turn"))
            sim.step(0.01)
            out.append(sim.outputs.copy())
        return np.array(out)

    first = balance(100)
    sim.restore(start)
    expect(np.array_equal(balance(100), first), "after restore other bits")
    expect(abs(first[-1][2]) < 0.01, f"the pendulum is not balanced: {first[-1]}")
    raises(ff.ArgumentError, lambda: sim.set_input("pusj", 1), "push")
    raises(ff.ArgumentError, lambda: sim.step(-1.0))
    expect(sim.inputs == ["push"] and sim.columns == ["x", "v", "angle", "turn"], f"{sim.inputs} {sim.columns}")

    # A force in Python: a spring to the cart, seen in its energy; an exception in it comes out as it is, and the simulation goes on.
    broken = []

    def spring(t, position, rotation, velocity, angular_velocity):
        if broken:
            raise RuntimeError("from the user's force")
        return -20.0 * position - 5.0 * velocity

    held = ff.Simulation(scene, forces={"cart": spring})
    for _ in range(20):
        held.step(0.01)
    now = held.outputs.copy()
    broken.append(1)
    raises(RuntimeError, lambda: held.step(0.01), "from the user's force")
    broken.clear()
    expect(np.array_equal(held.outputs, now), "an error has moved the simulation")
    held.step(0.01)
    free = ff.Simulation(scene)
    free.advance_to(held.time)
    expect(abs(free.output("x") - held.output("x")) > 1e-4, "the force does nothing")

    # What a call costs beyond the work it asks for, in CPU time, the best of several goes: reading an output, and an input that is set
    # to what it is already (looked up and left; a step does no more of it, and releases the GIL).
    def price(call, n=4000):
        goes = []
        for _ in range(7):
            begin = time.process_time()
            for _ in range(n):
                call()
            goes.append((time.process_time() - begin) / n)
        return min(goes)

    push = sim.input("push")
    costs = {
        "time": price(lambda: sim.time),
        "output": price(lambda: sim.output("turn")),
        "input": price(lambda: sim.set_input("push", push)),
    }
    print("a call in us: " + ", ".join(f"{name} {1e6 * cost:.2f}" for name, cost in costs.items()))
    expect(max(costs.values()) < 2e-6, f"a call costs {1e6 * max(costs.values()):.2f} us")


def scenes():
    words = {
        "simulation": {"duration": 0.5, "gravity": [0, 0, -10.0], "output_rate": 100},
        "body": [{"name": "ball", "kind": "rigid", "mass": 1.0, "inertia": np.array([1.0, 1, 1])}],
        "joint": [{"name": "fall", "kind": "free", "parent": "ground", "child": "ball"}],
        "output": [{"name": "z", "of": "ball", "quantity": "position"}],
    }
    r = ff.simulate(words)
    expect(np.abs(r["z.z"] + 5 * r.t**2).max() < 1e-9, "a ball from a dict does not fall")
    slow = ff.simulate(ff.scene(words, set={"simulation.gravity": [0, 0, -1.0]}))
    expect(abs(slow["z.z"][-1] + 0.125) < 1e-9, "set= does nothing")
    words["body"][0]["mas"] = 1
    raises(ff.InputError, lambda: ff.scene(words), "mas", "did you mean 'mass'")
    raises(ff.Error, lambda: ff.load(folder / "none.toml"), "none.toml")

    # Results of another program.
    t = np.linspace(0, 1, 11)
    bodies = {
        "plate": {
            "position": np.outer(t, [1, 0, 0]),
            "nodes": np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]),
            "displacement": np.zeros((11, 4, 3)),
        }
    }
    theirs = ff.write_results(folder / "theirs.h5", t, bodies, outputs={"s": t**2}, title="Theirs", render={"size": [320, 180]})
    expect(
        np.array_equal(theirs.bodies["plate"].position[:, 0], t) and np.array_equal(theirs["s"], t**2),
        "results of others come back changed",
    )
    expect("Theirs" in run("info", folder / "theirs.h5"), "info of foreign results")
    expect(ff.draw(theirs, t=0.5).shape == (180, 320, 4), "a picture of foreign results")
    # With a surface and stresses of its own, whose points are the nodes.
    plate = bodies["plate"]
    corners, triangles = plate["nodes"], np.array([[0, 1, 2], [0, 2, 3]])
    surface = {"points": corners, "triangles": triangles, "colors": np.full((2, 3), 0.5), "point_nodes": np.arange(4)}
    stress = np.outer(t, [1.0, 2, 3, 4])
    own = {"plate": {**plate, **surface, "von_mises": stress, "node_names": list("abcd")}}
    mine = ff.write_results(folder / "mine.h5", t, own).bodies["plate"]
    expect(np.array_equal(mine.points, corners) and np.array_equal(mine.triangles, triangles), "a surface comes back changed")
    expect(np.array_equal(mine.von_mises, stress) and mine.node_names == list("abcd"), "stresses and names come back changed")
    expect(ff.draw(ff.read_results(folder / "mine.h5"), t=0.5, size=(80, 60)).shape == (60, 80, 4), "its picture")
    for key, wrong in [("triangles", [[0, 1, 4]]), ("triangles", [[0, 1, 1.5]]), ("point_nodes", [0, 1, 2, np.nan]), ("von_mises", [1])]:
        bad = {"plate": {**own["plate"], key: wrong}}
        raises(ff.ArgumentError, lambda bad=bad: ff.write_results(folder / "w.h5", t, bad), key)
    raises(ff.ArgumentError, lambda: ff.write_results(folder / "w.h5", t, {"plate": {**plate, "points": corners}}), "triangles")
    # What a run of its own has: shapes of a modal body, poses of joints, what columns are.
    r = ff.simulate(ff.load(examples / "pendulum.toml", set={"simulation.duration": 0.05}))
    body, joint = next(b for b in r.bodies.values() if b.q.size), next(iter(r.joints.values()))
    n, nn = body.q.shape[1], len(body.node_names)
    expect(len(body.labels) in (0, n) and body.nodes.shape == (nn, 3) and body.length > 0, f"{len(body.labels)} labels of {n} coordinates")
    expect(body.node_phi.size == 0 or body.node_phi.shape == (3 * nn, n), f"shapes {body.node_phi.shape}")
    expect(joint.position.shape == (len(r.t), 3) and np.allclose(np.linalg.norm(joint.orientation, axis=1), 1), "poses of a joint")
    expect(set(r.descriptions) == set(r.columns) and "restarts" in r.statistics, "descriptions and statistics")
    bodies["plate"]["displacement"] = np.zeros((11, 3, 3))
    raises(ff.ArgumentError, lambda: ff.write_results(folder / "w.h5", t, bodies), "displacement")


def interrupts():
    long = ff.load(examples / "slider_crank.toml", set={"simulation.duration": 2000, "simulation.output_rate": 10})
    # Another thread runs meanwhile, so the GIL is free; then Ctrl-C.
    ticks = []

    def tick():
        end = time.time() + 0.4
        while time.time() < end:
            ticks.append(1)
            time.sleep(0.001)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=tick)
    begin = time.time()
    thread.start()
    raises(KeyboardInterrupt, lambda: ff.simulate(long))
    thread.join()
    expect(time.time() - begin < 10, f"Ctrl-C took {time.time() - begin:.1f} s")
    expect(len(ticks) > 20, f"another thread ran {len(ticks)} times only: the GIL is held")

    # A driven simulation too; it is then as it was before the call.
    driven = ff.Simulation(ff.load(examples / "library/cart.toml"))
    driven.advance_to(0.1)
    before = driven.outputs.copy()
    threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    raises(KeyboardInterrupt, lambda: driven.advance_to(1e5))
    expect(driven.time == 0.1 and np.array_equal(driven.outputs, before), "Ctrl-C has moved a driven simulation")
    driven.step(0.01)

    # Films, sweeps and studies too; their processes end, and half a picture or row is none.
    def soon(seconds, call):
        threading.Timer(seconds, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
        raises(KeyboardInterrupt, call)

    drawn = ff.simulate(ff.load(examples / "pendulum.toml"), estimate_error=False)
    soon(0.5, lambda: ff.film(drawn, folder / "stopped", size=(1920, 1080), speed=0.001, workers=2, video=False))
    expect(all(ff.read_png(p).shape == (1080, 1920, 4) for p in (folder / "stopped/frames").glob("*.png")), "half a picture")
    begin = time.time()
    soon(0.5, lambda: ff.sweep(long, {"simulation.tolerance": [1e-6, 1e-7]}, {"x": "max(slider.x)"}, folder / "stopped", workers=2))
    soon(0.5, lambda: ff.study(long, axes=["tolerance"]))
    expect(time.time() - begin < 30, f"Ctrl-C in a sweep and a study took {time.time() - begin:.1f} s")

    # Maps of large meshes, by patches and by one factorisation, and what a drawing makes before its first picture.
    def sheet(n, held):
        x, y = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij"))
        points = np.stack([x, y, 0.1 * np.sin(9 * x) * np.cos(7 * y)], -1)
        corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()[:, None]
        triangles = np.concatenate([corner + [0, n, n + 1], corner + [0, n + 1, 1]])
        return points[np.random.default_rng(2).choice(n * n, held, False)], points, triangles

    # A call of a second or so, stopped in its first third, takes much less CPU than the whole: wall time would be other programs' too. On a
    # busy machine the signal may come late, so that one of three tries has to show it.
    def early(what, call):
        begin, work = time.time(), time.process_time()
        call()
        wall, work = time.time() - begin, time.process_time() - work
        for _ in range(3):
            begin = time.process_time()
            soon(0.3 * wall, call)
            stopped = time.process_time() - begin
            if stopped < 0.75 * work:
                return
        expect(False, f"Ctrl-C after 0.3 of {what} came through after {stopped:.2f} of {work:.2f} CPU s")

    nodes, points, triangles = sheet(600, 100)
    waved = {"sheet": {"nodes": nodes, "displacement": np.zeros((2, 100, 3)), "points": points, "triangles": triangles}}
    drawn = ff.write_results(folder / "sheet.h5", [0.0, 1.0], waved)
    early("a drawing", lambda: ff.drawing(drawn))
    early("a map", lambda: ff.KernelMap(*sheet(200, 400), scheme="r3"))
    begin = time.time()
    soon(0.5, lambda: ff.KernelMap(*sheet(160, 40), scheme="elastic"))
    expect(time.time() - begin < 10, f"Ctrl-C in an elastic map took {time.time() - begin:.1f} s")
    children = pathlib.Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read_text().split()
    expect(children == [], f"processes left behind: {children}")

    def stop(fraction):
        raise StopIteration(f"at {fraction:.3f}")

    raises(StopIteration, lambda: ff.simulate(long, progress=stop), "at 0.0")


REDUCE = """
import os, signal, sys, threading, time
import flexframe as ff

def stopped():
    sent = []

    def told(text):
        if "degrees of freedom" in text:  # the factorisation comes next, of seconds
            threading.Timer(0.3, lambda: (sent.append(time.monotonic()), os.kill(os.getpid(), signal.SIGINT))).start()

    try:
        ff.reduce("block.inp", modes=4, stiffening=False, progress=told)
    except KeyboardInterrupt:
        print(time.monotonic() - sent[0], flush=True)

stopped()
ff.reduce(sys.argv[1], modes=4).write_sid("after.sid")
stopped()
sys.exit(7)
"""


def interrupted_reduction():
    # The factorisation goes on beside for a while: the next reduction waits for it and has its bits, the process ends in the midst of it.
    subprocess.run(["/usr/bin/python3", source / "assets/beam/make_beam.py", folder / "block.inp", "14", "14", "14"], check=True)
    deck = source / "tests/unit/data/kernel_map/conrod.inp"
    words = [sys.executable, "-c", REDUCE, deck]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=300)
    reactions = [float(line) for line in done.stdout.split()]
    print(f"Ctrl-C in a factorisation: {reactions} s")
    expect(len(reactions) == 2 and max(reactions) < 2.0, f"Ctrl-C in a factorisation: {reactions} s {done.stderr}")
    expect(done.returncode == 7 and done.stderr == "", f"the end amid a factorisation: exit {done.returncode} {done.stderr}")
    ff.reduce(deck, modes=4).write_sid(folder / "before.sid")
    expect((folder / "after.sid").read_bytes() == (folder / "before.sid").read_bytes(), "a reduction after a stopped one is another")


def accuracy_of_pictures():
    """A pendulum whose tip is asked to be within half a pixel: against one integrated here, and the same as the program's."""
    length, lines, wide = 1.0, 600, 3.0
    words = {
        "simulation": {"duration": 1.0, "gravity": [0, -9.81, 0], "output_rate": 50},
        "body": [
            {"name": "rod", "kind": "rigid", "mass": 1.0, "centre_of_mass": [0.5, 0, 0], "inertia": [1e-4, 1 / 12, 1 / 12]}
            | {"frames": {"tip": [length, 0, 0]}, "shapes": [{"shape": "link", "from": [0, 0, 0], "to": [length, 0, 0], "width": 0.05}]}
        ],
        "joint": [{"name": "pivot", "kind": "revolute", "parent": "ground", "child": "rod", "initial": {"value": -0.3}}],
        "output": [{"name": "tip", "of": "rod.tip", "quantity": "position"}],
        "render": {
            "size": [800, lines],
            "camera": {"fit": False, "position": [0, 0, 5], "target": [0, 0, 0], "height": wide, "projection": "orthographic"},
        },
    }
    r = ff.simulate(words, accuracy="0.5 px")
    shares = r.statistics["picture"]
    expect(shares["asked"] == "0.5 px" and shares["unit"] == "px" and shares["allowed"] == 0.5, f"what was asked: {shares}")
    parts = sum(shares[key] for key in ("time", "space", "effects", "map", "samples", "raster"))
    expect(abs(parts - shares["total"]) < 1e-9 and 0 < shares["total"] <= 0.5, f"shares make the whole: {shares}")
    swing = scipy.integrate.solve_ivp(lambda t, y: (y[1], -1.5 * 9.81 * np.cos(y[0])), (0, 1), (-0.3, 0), "DOP853", r.t, rtol=1e-12)
    off = np.hypot(r["tip.x"] - length * np.cos(swing.y[0]), r["tip.y"] - length * np.sin(swing.y[0])).max() * lines / wide
    expect(off < 0.5, f"the tip is {off} px off")
    scene = {**words, "simulation": {**words["simulation"], "accuracy": "0.5 px"}}
    again = ff.simulate(scene)
    expect(np.array_equal(again["tip.x"], r["tip.x"]) and "picture" in again.statistics, "the scene's own word")
    expect("picture" not in ff.simulate(scene, accuracy=1e-2).statistics, "a share in its place")
    expect("picture" not in ff.simulate(scene, tolerance=1e-6).statistics, "a tolerance in its place")
    mm = ff.simulate(words, accuracy="2 mm").statistics["picture"]
    expect(mm["unit"] == "m" and mm["allowed"] == 2e-3 and mm["total"] <= 2e-3, f"a length: {mm}")
    raises(ff.ArgumentError, lambda: ff.simulate(words, accuracy="0.5 kg"), "accuracy", "no unit of length")
    raises(ff.ArgumentError, lambda: ff.simulate(words, accuracy="0 px"), "above 0")
    raises(ff.ArgumentError, lambda: ff.simulate(words, accuracy="0.5 px", tolerance=1e-6), "excludes tolerance")


def strangers():
    """What others hand over: other types, shapes and orders, what is not finite; threads, forks, copies. Right, or a sentence."""
    words = {
        "simulation": {"duration": 0.2, "gravity": [0, 0, -10.0], "output_rate": 100},
        "body": [{"name": "ball", "kind": "rigid", "mass": 1.0, "inertia": [1.0, 1, 1]}],
        "joint": [{"name": "fall", "kind": "free", "parent": "ground", "child": "ball"}],
        "output": [{"name": "z", "of": "ball", "quantity": "position"}],
    }
    ball = words["body"][0]
    raises(TypeError, lambda: ff.scene({**words, "body": [{**ball, "mass": None}]}), "body[0].mass", "None")
    raises(ValueError, lambda: ff.scene({**words, "body": [{**ball, "inertia": np.array([1, np.nan, 1])}]}), "body[0].inertia[1]")
    raises(TypeError, lambda: ff.scene({5: 1}), "a key must be text")
    for call in (lambda: ff.scene(5), lambda: ff.simulate(None), lambda: ff.draw(words)):
        raises(ff.ArgumentError, call, "found")
    expect(ff.scene(words, set="simulation.duration=0.1").duration == 0.1, "set= of one text")
    for name, value in (("accuracy", -1), ("accuracy", float("nan")), ("accuracy", "high"), ("tolerance", 0.0)):
        raises(ff.ArgumentError, lambda name=name, value=value: ff.simulate(words, **{name: value}), name, "must be a number from 1e-")
    r = ff.simulate(words)
    expect("z.z" in r and "z" in r and 5 not in r and list(r) == r.columns, "what is in results")
    # Scenes and results travel to other processes.
    scene = ff.scene(words, set={"simulation.duration": 0.1})
    again, twin = pickle.loads(pickle.dumps(r)), pickle.loads(pickle.dumps(scene))
    expect(np.array_equal(again["z.z"], r["z.z"]) and again.bodies["ball"].position.shape == (21, 3), "results through pickle")
    expect(twin.text == scene.text and twin.duration == 0.1 and copy.deepcopy(r) is r, "a scene through pickle, a copy of results")

    rng = np.random.default_rng(0)
    nodes, at = rng.uniform(-1, 1, (12, 3)), rng.uniform(-1, 1, (300, 3))
    faces = rng.integers(0, 300, (200, 3))
    m = ff.KernelMap(nodes, at, faces, scheme="r3")
    moved = m.apply(0.1 * nodes)
    for kind, change in {
        "column by column": np.asfortranarray,
        "every other row": lambda a: np.repeat(a, 2, 0)[::2],
        "lists": np.ndarray.tolist,
        "the other byte order": lambda a: a.astype(a.dtype.newbyteorder()),
    }.items():
        other = ff.KernelMap(change(nodes), change(at), change(faces), scheme="r3").apply(change(0.1 * nodes))
        expect(np.array_equal(other, moved), f"a map of arrays {kind} is another")
    for wrong in (faces + 0.5, faces + 2**40, -faces - 1):
        raises(ff.Error, lambda wrong=wrong: ff.KernelMap(nodes, at, wrong), "")
    raises(ff.ArgumentError, lambda: m.apply(nodes, rotation=nodes), "rotations=True")
    raises(ff.InputError, lambda: m.apply(1e300 * nodes), "single precision")
    raises(ff.ArgumentError, lambda: ff.compare(np.zeros((4, 4, 4)), np.ones((4, 4, 4))), "uint8", "float64")
    raises(ff.ArgumentError, lambda: ff.png(np.zeros((4, 4), np.uint8)), "shape")

    t = np.linspace(0, 1, 5)
    file = folder / "never.h5"
    for body, told in (
        ({"displacement": np.zeros((5, 4, 3))}, "belongs to 'nodes'"),
        ({"nodes": nodes[:4], "displacement": np.zeros((5, 3, 4))}, "found the shape (5, 3, 4)"),
        ({"orientation": np.zeros((5, 4))}, "no unit quaternion"),
        ({"position": np.full((5, 3), np.nan)}, "not finite"),
        (5, "a dict of arrays"),
    ):
        raises(ff.Error, lambda body=body: ff.write_results(file, t, {"a": body}), told)
    raises(ff.Error, lambda: ff.write_results(file, t[::-1], {"a": {}}), "rise")
    expect(not file.exists(), "refused results leave a file")

    # A driven simulation: no copies, one thread at a time, and forces that are none.
    cart = examples / "library/cart.toml"
    sim = ff.Simulation(cart)
    for call in (copy.copy, copy.deepcopy, pickle.dumps):
        raises(TypeError, lambda call=call: call(sim), "restore")
    raises(ff.ArgumentError, lambda: ff.Simulation(cart, forces={"cart": 5}), "must be a function")
    for answer in (None, [1, 2], "abc", ((1, 2, 3), (0, 0))):
        held = ff.Simulation(cart, forces={"cart": lambda *moment, answer=answer: answer})
        raises(ff.ArgumentError, lambda held=held: held.step(0.01), "three numbers")
    held = ff.Simulation(cart, forces={"cart": lambda *moment: [np.nan] * 3})
    raises(ff.SimulationError, lambda: held.step(0.01), "not finite")
    own = []
    own.append(ff.Simulation(cart, forces={"cart": lambda *moment: own[0].step(0.01) if own else [0, 0, 0]}))
    raises(ff.ArgumentError, lambda: own[0].step(0.01), "in a step")
    refused = []

    def steps():
        for _ in range(100):
            try:
                sim.step(0.001)
            except ff.ArgumentError:
                refused.append(1)

    crew = [threading.Thread(target=steps) for _ in range(4)]
    for one in crew:
        one.start()
    for one in crew:
        one.join()
    expect(abs(sim.time - 0.001 * (400 - len(refused))) < 1e-9, f"four threads: {sim.time} s after {len(refused)} refused steps")

    # A child of this process, which has drawn, draws the same.
    picture = ff.draw(r, size=(64, 48))
    child = os.fork()
    if child == 0:
        signal.alarm(60)
        os._exit(0 if np.array_equal(ff.draw(r, size=(64, 48)), picture) and np.array_equal(m.apply(0.1 * nodes), moved) else 3)
    expect(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0, "a forked child draws otherwise, or hangs")


def parameters(text):
    """Names of the parameters in "f(self: X, a: int = 3, *, b: float) -> Y" without self."""
    arguments = ast.parse(f"def f{text}: ...").body[0].args
    names = [a.arg for a in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)]
    names += [arguments.kwarg.arg] if arguments.kwarg else []
    return [name for name in names if name != "self"]


def members_of(thing):
    """Public members that a class has itself: name -> parameters, or None for a property."""
    out = {}
    for name, value in vars(thing).items():
        if name in ("__init__", "__getitem__", "__contains__", "__iter__", "__len__") or not name.startswith("_"):
            if isinstance(value, property):
                out[name] = None
            elif callable(value) or isinstance(value, staticmethod):
                plain = getattr(thing, name)
                try:
                    out[name] = [p for p in inspect.signature(plain).parameters if p != "self"]
                except ValueError:  # pybind11 writes the parameters into the first line of the docstring
                    line = plain.__doc__.splitlines()[0]
                    out[name] = re.findall(r"[(,] ?(\w+): ", line)
                    out[name] = [p for p in out[name] if p != "self"]
    return out


def documented():
    """Every public name has a docstring; names, members and parameters of the type information file are those of the module."""
    tree = ast.parse((pathlib.Path(ff.__file__).parent / "__init__.pyi").read_text())
    stubs = {node.name: node for node in tree.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
    public = [name for name in ff.__all__ if not name.startswith("__")]
    helpers = {"Path", "Words", "Picture", "Floats", "Force", "Settings", "Progress", "Numbers"}
    expect(set(stubs) - helpers == set(public), f"stubs and module differ in {set(stubs) ^ set(public)}")
    for name in public:
        thing = getattr(ff, name)
        expect((thing.__doc__ or "").strip() != "", f"{name} has no docstring")
        if name not in stubs or (isinstance(thing, type) and issubclass(thing, Exception)):
            continue
        if not isinstance(thing, type):
            wanted = re.findall(r"[(,] ?(\w+): ", thing.__doc__.splitlines()[0]) if thing.__module__ == "flexframe._core" else None
            wanted = wanted or list(inspect.signature(thing).parameters)
            got = parameters("(" + ast.unparse(stubs[name].args) + ")")
            expect(got == wanted, f"{name}: the type file's parameters {got}, the module's {wanted}")
            continue
        there, said = members_of(thing), {}
        for node in stubs[name].body:
            if isinstance(node, ast.FunctionDef):
                is_property = any(isinstance(d, ast.Name) and d.id == "property" for d in node.decorator_list)
                said[node.name] = None if is_property else parameters("(" + ast.unparse(node.args) + ")")
        for member in there.keys() | said.keys():
            if member.startswith("__") and member not in said:
                continue
            expect(member in there and member in said, f"{name}.{member} is only in {'the module' if member in there else 'the type file'}")
            if member.startswith("__") or member not in there or member not in said:
                continue
            expect(there[member] == said[member], f"{name}.{member}: the type file's {said[member]}, the module's {there[member]}")
            text = getattr(thing, member).__doc__ or ""
            expect(text.strip() != "" and not text.strip().endswith(f"-> {member}"), f"{name}.{member} has no docstring")


for test in (
    scenes,
    simulate_and_draw,
    kernel_map,
    reduce_bodies,
    study,
    sweep,
    drive,
    interrupts,
    interrupted_reduction,
    accuracy_of_pictures,
    strangers,
    documented,
):
    begin = time.time()
    test()
    print(f"{test.__name__}: {time.time() - begin:.1f} s", flush=True)
sys.exit(1 if failures else 0)
