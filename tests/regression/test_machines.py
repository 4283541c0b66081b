"""Both machines of Schiavo et al. 2005 against rigorous solutions (geometrically exact rods, error estimates 1e-6 or better)."""
import json
import math
import pathlib

from program import at, bending_pendulum, bending_slider_crank, examples, expect, finish, history, near, run, temporary_folder

with temporary_folder() as folder:
    folder = pathlib.Path(folder)

    # Pendulum, section 5.2: the paper's beam does not shear.
    paper_pendulum = bending_pendulum(folder / "pendulum.toml")
    summary = json.loads(run("simulate", paper_pendulum, "-o", folder / "p.h5", "--csv", folder / "p.csv", "--json").stdout)
    h = history(folder / "p.csv")
    for t, x, y in [(0.3, 0.01919, -0.39955), (0.5, -0.38966942, -0.09033313), (0.6, -0.40000, -0.00052), (1.0, 0.25210834, -0.31056317)]:
        near(at(h, "tip.x", t), x, 3e-4, f"pendulum tip.x at {t}")
        near(at(h, "tip.y", t), y, 3e-4, f"pendulum tip.y at {t}")
    # The deflection's sign follows the side the beam bends to; its size is what the reference gives.
    for t, size in [(0.1, 3.485e-3), (0.2, 3.665e-3), (0.9, 1.803e-3), (1.2, 4.629e-3)]:
        near(abs(at(h, "deflection.y", t)), size, 3e-4, f"pendulum |deflection| at {t}")
    drift = max(h["energy"]) - min(h["energy"])
    expect(drift < 1e-3 * 5540 * 18e-4 * 0.4 * 9.81 * 0.4, f"pendulum energy drifts by {drift} J")
    cpu = summary["simulation"]["cpu_seconds"]
    print("pendulum CPU", cpu)
    expect(cpu < 1.0, f"pendulum needs {cpu} CPU s")

    # The first scenes that a newcomer runs say nothing that needs an answer.
    for name in ("slider_crank", "pendulum"):
        first = json.loads(run("simulate", examples / f"{name}.toml", "--csv", folder / "first.csv", "--json", "--strict").stdout)
        expect(not first["simulation"]["warnings"], f"{name} warns: {first['simulation']['warnings']}")

    # Slider-crank, section 5.3: the paper's rods neither stretch nor shear.
    paper = bending_slider_crank(folder / "slider_crank.toml")
    summary = json.loads(run("simulate", paper, "-o", folder / "s.h5", "--csv", folder / "s.csv", "--json").stdout)
    h = history(folder / "s.csv")
    near(at(h, "slider.x", 0.0), 0.456, 1e-12, "slider at 0")
    for t, x in [
        (0.2, 0.4552350),
        (0.4, 0.4327325),
        (0.6, 0.3536366),
        (0.7, 0.2974842),
        (1.0, 0.1619844),
        (1.2, 0.1655611),
        (1.6, 0.3673853),
    ]:
        near(at(h, "slider.x", t), x, 1e-4, f"slider.x at {t}")
    near(at(h, "rod_middle.y", 0.7), 1.055e-3, 5e-5, "rod middle at 0.7")
    near(at(h, "rod_middle.y", 1.2), -1.135e-3, 5e-5, "rod middle at 1.2")
    expect(max(map(abs, h["slider.y"])) < 1e-9, "the slider leaves its guide")
    # No torque after 0.7 s: the energy stays.
    late = [e for t, e in zip(h["t"], h["energy"]) if t > 0.7]
    expect(max(late) - min(late) < 1e-3 * max(late), f"energy changes from {min(late)} to {max(late)} after the torque's end")
    expect(summary["simulation"]["events"] >= 1, "the torque's end is no event")
    cpu = summary["simulation"]["cpu_seconds"]
    print("slider-crank CPU", cpu)
    expect(cpu < 1.0, f"slider-crank needs {cpu} CPU s")

    # A tighter run tells the same within the asked accuracy: nothing is tuned to one tolerance.
    for scene, column in [(paper_pendulum, "tip.x"), (paper, "slider.x")]:
        name = scene.stem
        run("simulate", scene, "--csv", folder / "tight.csv", "--tolerance", "1e-8", "--no-error-estimate")
        tight, usual = history(folder / "tight.csv"), history(folder / f"{name[0]}.csv")
        off = max(abs(a - b) for a, b in zip(tight[column], usual[column]))
        print(name, "against tolerance 1e-8:", off)
        expect(off < 5e-5, f"{name}: {column} differs by {off} m from the run at 1e-8")
        expect(all(math.isfinite(v) for values in tight.values() for v in values), f"{name}: a value is not finite")
finish()
