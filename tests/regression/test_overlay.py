"""Two runs in one picture: render A.h5 B.h5 --overlay or --beside. Pictures and differences against those of the runs alone."""

import json

import h5py
import numpy as np

from program import examples, expect, near, run, run_parts

words = ["--size", "320x180", "--frames", "20:22", "--no-video"]


def two_runs(folder):
    """Differences of the outputs are those of the histories, at the times of the first run; curves and legend are in the picture."""
    scene = examples / "slider_crank.toml"
    rough = ["--set", "body.rod.material.youngs_modulus=2e7", "--set", "simulation.output_rate=730", "--set", "simulation.duration=0.3"]
    quick = ["--no-error-estimate", "--no-effect-check"]
    run("simulate", scene, "-o", folder / "stiff.h5", "--set", "simulation.duration=0.4", *quick)
    run("simulate", scene, "-o", folder / "soft.h5", *rough, *quick)
    told = json.loads(run("render", folder / "stiff.h5", folder / "soft.h5", "--overlay", "-o", folder / "o", "--json", *words).stdout)
    columns = {}
    for name in ("stiff", "soft"):
        with h5py.File(folder / f"{name}.h5") as file:
            names = [c.decode() for c in file["outputs/columns"][:]]
            columns[name] = file["times"][:], dict(zip(names, file["outputs/values"][:].T))
    t, stiff = columns["stiff"]
    for difference in told["differences"]:
        name = difference["column"]
        wanted = np.abs(np.interp(t, columns["soft"][0], columns["soft"][1][name]) - stiff[name])[t <= 0.3 + 1e-9].max()
        near(difference["largest"], wanted, 1e-9 * max(wanted, 1e-12) + 1e-15, f"difference of {name}")
    expect({d["column"] for d in told["differences"]} == set(stiff), "every shared column is compared")
    expect(any("soft ends at 0.3 s" in note for note in told["notes"]), f"the shorter run is told of: {told['notes']}")
    # Side by side, and a run beside itself: no difference.
    run("render", folder / "stiff.h5", folder / "soft.h5", "--beside", "-o", folder / "b", *words)
    told = json.loads(run("render", folder / "stiff.h5", folder / "stiff.h5", "--overlay", "-o", folder / "same", "--json", *words).stdout)
    near(max(d["largest"] for d in told["differences"]), 0.0, 0.0, "a run and itself")
    # A later run is seen where the first is not: the picture is another than that of the run beside itself.
    run("compare", folder / "o/frames", folder / "same/frames", code=1)
    # What cannot be asked for.
    for wrong, word in (
        ([folder / "stiff.h5", folder / "soft.h5"], "--overlay or --beside"),
        ([folder / "stiff.h5", "--overlay"], "two or more"),
        ([folder / "stiff.h5", folder / "none.h5", "--overlay"], "none.h5"),
    ):
        expect(word in run("render", *wrong, "-o", folder / "w", code=2).stderr, f"{word} is said")


run_parts(two_runs)
