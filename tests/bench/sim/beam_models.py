"""Every beam model on three scenes: its CPU seconds beside its error. Prints tables as they stand in examples/beams.

    beam_models.py FLEXFRAME SOURCE_DIR
"""
import csv
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile

flexframe, source = sys.argv[1], pathlib.Path(sys.argv[2])
place = pathlib.Path(tempfile.mkdtemp(prefix="flexframe_bench_"))


def run(text):
    """Columns of the history and the least CPU of five runs, s."""
    scene, table = place / "scene.toml", place / "history.csv"
    scene.write_text(text)
    cpu = math.inf
    for _ in range(5):
        done = subprocess.run(
            [flexframe, "simulate", scene, "--csv", table, "--no-error-estimate", "--json"], capture_output=True, text=True
        )
        if done.returncode:
            return None, done.stderr.strip().splitlines()[-1]
        cpu = min(cpu, json.loads(done.stdout)["simulation"]["cpu_seconds"])
    rows = list(csv.reader(table.open()))
    return {name: [float(r[i]) for r in rows[1:]] for i, name in enumerate(rows[0])}, cpu


def with_model(name, pattern, model, *changes):
    text = (source / "examples" / name).read_text()
    for old, new in changes:
        text = text.replace(old, new)
    found = re.search(pattern, text)
    return text[: found.start()] + model + text[found.end() :]


pendulum = (0.25210834, -0.31056317)
models = {
    "lumped, 10": 'model = "lumped"\nelements = 10',
    "lumped, 20 coupled": 'model = "lumped"\nelements = 20\ncurvature_coupling = true',
    "finite elements, 4": 'model = "finite-element"\nelements = 4',
    "finite elements, 10": 'model = "finite-element"\nelements = 10',
    "modal, 3 forms": 'model = "modal"\nmodes = { bending_xy = [1, 2, 3] }',
    "modal, 6 forms": 'model = "modal"\nmodes = { bending_xy = [1, 2, 3, 4, 5, 6] }',
    "mixed, 5 x 2": 'model = "mixed"\nvolumes = 5\nelements = 2',
    "mixed, 10 x 2": 'model = "mixed"\nvolumes = 10\nelements = 2',
}

scenes = [
    (
        "cantilever.toml of Chudnovsky et al. 2006: tip under 196.2 N against 3.55435 mm, relative",
        "beams/cantilever.toml",
        r'model = "lumped"\nelements = 10',
        (),
        lambda h: abs(-h["tip.y"][-1] / 3.55435e-3 - 1),
    ),
    (
        "pendulum.toml of Schiavo et al. 2005: tip after 1 s, m",
        "pendulum.toml",
        None,
        ((', "shear"', ""), ("tolerance = 1e-7", "tolerance = 1e-6")),
        lambda h: math.dist([h[c][[round(t, 9) for t in h["t"]].index(1.0)] for c in ("tip.x", "tip.y")], pendulum),
    ),
    (
        "elastica.toml, P L^2/EI = 5: tip, m",
        "beams/elastica.toml",
        r'model = "mixed"\nvolumes = 10\nelements = 2',
        (('"10*14', '"5*14'),),
        lambda h: math.dist((h["tip.x"][-1], h["tip.y"][-1]), (1 - 0.3876283607, 0.7137915236)),
    ),
]
for title, name, pattern, changes, error in scenes:
    if pattern is None:
        text = (source / "examples" / name).read_text()
        pattern = re.escape(re.search(r"model = .*(\n(elements|volumes|modes) = .*)*", text)[0])
    print(f"\n{title}\n\n| model | error | CPU s |\n|---|---|---|")
    for label, model in models.items():
        h, cpu = run(with_model(name, pattern, model, *changes))
        print(f"| {label} | {error(h):.2e} | {cpu:.4f} |" if h else f"| {label} | stops: {cpu[:60]} | - |", flush=True)
