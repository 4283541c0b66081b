"""The reducer through the real program: a solid beam against the beam model, static deflection and assembled frequencies against the full
model."""
import json
import math
import subprocess

from program import *

with temporary_folder() as name:
    folder = pathlib.Path(name)
    subprocess.run([sys.executable, source / "assets/beam/make_beam.py", folder / "beam.inp"], check=True)

    def reduce(body, *words):
        return json.loads(run("reduce", folder / "beam.inp", "-o", folder / body, "--quiet", "--json", *words).stdout)

    # The body of examples/pendulum_solid.toml is what the command in its head makes.
    ends = ["--interface", "root=average:ROOT", "--interface", "tip=average:TIP"]
    made = reduce("beam.sid", *ends, "--modes", 6, "--nodes", 20)
    expect(made["rigid_motions"] == 6, f"{made['rigid_motions']} rigid motions")
    near(made["mass"], 5540 * 0.4 * 18e-4, 1e-9, "mass of the beam")
    given = [
        float(line.split(":")[-1].split()[0]) for line in (source / "assets/beam/beam.sid").read_text().splitlines() if "Eigen Mode" in line
    ]
    expect(len(given) == len(made["frequencies"]), "the committed beam has another number of modes")
    for a, b in zip(given, made["frequencies"]):
        expect(abs(a - b) < 1e-3 * b, f"the committed beam has {a} Hz where {b} Hz comes out")

    # Tip of the pendulum of Schiavo et al. 2005 section 5.2 as a reduced solid against the beam model: 1 % of the path's range and of the
    # largest deflection from the tangent at the pivot. Point by point the deflections come apart by 4 % of their range: their phases grow
    # apart.
    def pendulum(scene, table):
        run("simulate", scene, "-o", folder / "p.h5", "--csv", folder / table)
        c = history(folder / table)
        return c, max(abs(y * math.cos(a) - x * math.sin(a)) for x, y, a in zip(c["tip.x"], c["tip.y"], c["angle"]))

    beam = (
        (examples / "pendulum.toml")
        .read_text()
        .replace("[render]", '[[output]]\nname = "angle"\nof = "pivot"\nquantity = "value"\n\n[render]')
    )
    (folder / "pendulum.toml").write_text(beam)
    wanted, largest = pendulum(folder / "pendulum.toml", "beam.csv")
    solid, deflection = pendulum(examples / "pendulum_solid.toml", "solid.csv")
    apart = max(math.hypot(a - c, b - d) for a, b, c, d in zip(solid["tip.x"], solid["tip.y"], wanted["tip.x"], wanted["tip.y"]))
    near(apart, 0.0, 0.01 * 0.4, "tip of the solid pendulum from the beam's")
    near(deflection, largest, 0.01 * largest, "largest deflection of the solid pendulum")
    # The rigorous solution's checkpoints; 2e-4 m is what a modal model may miss, 2e-4 more is shear.
    for t, x, y in ((0.5, -0.38966942, -0.09033313), (1.0, 0.25210834, -0.31056317)):
        near(at(solid, "tip.x", t), x, 4e-4, f"tip.x at {t} s")
        near(at(solid, "tip.y", t), y, 4e-4, f"tip.y at {t} s")

    # Without a word about method or cut-off the static deflection at the interfaces is the full model's within 1 %; with response modes
    # and their cut-off too.
    expect(reduce("auto.sid", *ends)["static_error"] < 0.01, "static deflection with default options")
    for highest in (40, 150):
        words = ["--method", "response", "--highest", highest]
        expect(reduce("response.sid", *ends, *words)["static_error"] < 0.01, f"static deflection with response modes to {highest} Hz")

    # Clamped where it was free: the assembled system's frequencies against the full model held there.
    reduce("rigid.sid", "--interface", "root=rigid:ROOT", "--interface", "tip=rigid:TIP")
    full = reduce("held.sid", "--hold", "ROOT", "--interface", "tip=rigid:TIP", "--method", "eigen", "--modes", 5)["frequencies"]
    (folder / "clamped.toml").write_text(
        'title = "clamped"\n[simulation]\nduration = 1\n[[body]]\nname = "beam"\nkind = "modal"\nfile = "rigid.sid"\n'
        '[[joint]]\nname = "wall"\nkind = "weld"\nparent = "ground"\nchild = "beam.root"\n'
    )
    check = json.loads(run("check", folder / "clamped.toml", "--json").stdout)
    assembled = sorted(m["frequency"] for m in check["modes"])
    for k, wanted_frequency in enumerate(full):
        near(assembled[k], wanted_frequency, 0.01 * wanted_frequency, f"frequency {k + 1} of the clamped beam")

    # A place in millimetres, as a deck in them suggests, lies far outside.
    near_end = ["--interface", "tip=rigid:TIP@0.4,0,0"]
    expect(not any("@x,y,z" in w for w in reduce("near.sid", *near_end)["warnings"]), "a place beside the beam is warned of")
    far_end = ["--interface", "tip=rigid:TIP@400,0,0"]
    expect(any("@x,y,z are in metres" in w for w in reduce("far.sid", *far_end)["warnings"]), "a place 400 m away is not warned of")

finish()
