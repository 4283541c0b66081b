"""Files that a failing disk gives only the beginning of (failing_disk.cpp) are refused; of what a cache holds nothing is taken."""
import os
import shutil
import subprocess
import sys

from program import examples, expect, flexframe, run, run_parts, source

LIBRARY = os.environ.get("FLEXFRAME_FAILING_DISK")
if not LIBRARY:
    sys.exit("FLEXFRAME_FAILING_DISK names no library: build the target failing_disk and run the test by ctest")
corpus = source / "tests/fuzz/corpus"

SHELF = """SOL 103
CEND
BEGIN BULK
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
GRID,3,,1.,1.,0.
GRID,4,,0.,1.,0.
CQUAD4,1,1,1,2,3,4
PSHELL,1,1,0.01,1
MAT1,1,2.1+11,,0.3,7850.
CONM2,7,3,,5.
"""


def failing(name, at):
    return {**os.environ, "LD_PRELOAD": LIBRARY, "FLEXFRAME_FAILING": f"{name}:{at}"}


def readers(folder):
    subprocess.run([sys.executable, source / "assets/beam/make_beam.py", folder / "block.inp", "2", "2", "4"], check=True)
    for name in ("bricks.inp", "bricks.sti", "bricks.mas", "bricks.dof", "tet22.msh"):
        shutil.copy(corpus / "fe" / name, folder)
    shutil.copy(source / "tests/regression/data/import/solids.frd", folder)
    shutil.copy(source / "assets/beam/beam.obj", folder)
    (folder / "mass.inc").write_text("*ELEMENT, TYPE=MASS, ELSET=M\n9001, 1\n*MASS, ELSET=M\n50.\n")
    (folder / "heavy.inp").write_text((folder / "block.inp").read_text() + "*INCLUDE, INPUT=mass.inc\n")
    (folder / "shelf.bdf").write_text(SHELF)
    (folder / "scene.toml").write_text((examples / "mechanisms/slider_crank.toml").read_text())
    (folder / "nodes.csv").write_text("x,y,z,ux,uy,uz\n" + "".join(f"{i / 9},0,0,0,{i * i / 1000},0\n" for i in range(10)))
    (folder / "table.csv").write_text(
        "t,arm.x,arm.y,arm.z,arm.qw,arm.qx,arm.qy,arm.qz\n" + "".join(f"{i / 9},{i},0,0,1,0,0,0\n" for i in range(10))
    )
    out = folder / "out"
    reduce = lambda model, *words: ["reduce", folder / model, "-o", out / "b.sid", "--modes", "1", "--no-stiffening", *words]
    reduce_matrices = reduce("bricks.sti", "--dofs", folder / "bricks.dof", "--node-table", folder / "bricks.inp")
    out.mkdir()
    run(*reduce("block.inp"))
    shutil.move(out / "b.sid", folder / "body.sid")
    run("simulate", folder / "scene.toml", "-o", folder / "r.h5", "--csv", folder / "reference.csv", "--no-error-estimate")
    deform = ["deform", "--nodes", folder / "nodes.csv", "--mesh", folder / "beam.obj", "-o", out / "d.obj"]
    study = ["study", folder / "scene.toml", "-o", out, "--reference", folder / "reference.csv", "--axes", "tolerance"]
    for name, words in [
        ("block.inp", reduce("block.inp")),
        ("mass.inc", reduce("heavy.inp")),
        ("shelf.bdf", reduce("shelf.bdf")),
        ("tet22.msh", reduce("tet22.msh", "--material", "2e11,0.3,7800")),
        *((f"bricks.{ending}", reduce_matrices) for ending in ("sti", "mas", "dof")),
        ("scene.toml", ["simulate", folder / "scene.toml", "--csv", out / "h.csv"]),
        ("body.sid", ["info", folder / "body.sid"]),
        ("r.h5", ["export", folder / "r.h5", "--to", "csv", "-o", out / "h.csv"]),
        ("beam.obj", deform),
        ("nodes.csv", deform),
        ("table.csv", ["import", folder / "table.csv", "-o", out / "x.h5"]),
        ("solids.frd", ["import", folder / "solids.frd", "-o", out / "x.h5"]),
        ("reference.csv", study),
    ]:
        size = (folder / name).stat().st_size
        # Behind whole lines, where what is there looks like a shorter file.
        half = (folder / name).read_bytes().rfind(b"\n", 0, size // 2) + 1
        for at in (0, half or size // 2, size - 1):
            shutil.rmtree(out)
            out.mkdir()
            done = subprocess.run([flexframe, *map(str, words)], capture_output=True, text=True, env=failing(name, at), timeout=120)
            last = [line for line in done.stderr.splitlines() if line.startswith("flexframe: ") or name in line]
            said = (
                last and name in last[0] and ("cannot be read to its end" in last[0] or "cannot read" in last[0] or "be read: " in last[0])
            )
            expect(done.returncode in (1, 2) and said, f"{name} failing at {at} of {size}: exit {done.returncode}: {done.stderr}")
            left = [p.name for p in out.rglob("*") if p.is_file()]
            # A study keeps the runs that it has made.
            expect(not left or words is study, f"{name} failing at {at} leaves {left}")


def matrices_cut_short(folder):
    """Without a failing disk: a mass matrix of which the last columns are not there is told of."""
    words = ["reduce", folder / "bricks.sti", "--dofs", folder / "bricks.dof", "--node-table", folder / "bricks.inp", "--modes", "1"]
    expect("WARNING" not in run(*words, "-o", folder / "whole.sid").stderr, "a warning of whole matrices")
    lines = (corpus / "fe/bricks.mas").read_text().splitlines(keepends=True)
    (folder / "bricks.mas").write_text("".join(line for line in lines if int(line.split()[1]) <= 30))
    told = run(*words, "-o", folder / "cut.sid").stderr
    expect("bricks.mas: 6 of 36 rows have no diagonal entry (the first: 31)" in told, f"a mass matrix cut short: {told}")


def caches(folder):
    """Entries of a cache that cannot be read are made anew."""
    out, cache = folder / "kept", folder / "cache"
    out.mkdir()
    jobs = [
        ["reduce", folder / "block.inp", "-o", out / "b.sid", "--modes", "2"],
        ["modes", folder / "body.sid", "--mesh", folder / "beam.obj", "--mode", "1", "--pictures", "2", "--size", "64x48", "--no-video"],
    ]
    jobs[1] += ["-o", out / "m"]
    below = lambda: {p: p.read_bytes() for p in out.rglob("*") if p.is_file() and p.suffix != ".md"}  # reports tell CPU seconds
    for words in jobs:
        run(*words, "--cache", cache, *(["--fresh"] if words[0] == "reduce" else []))
    wanted, kept = below(), list(cache.iterdir())
    expect({p.suffix for p in kept} >= {".modes"}, f"the cache holds {kept}")
    for entry in kept:
        entry.unlink()
        entry.mkdir()
    for words in jobs:
        run(*words, "--cache", cache)
    expect(below() == wanted, "other outcomes with a cache that cannot be read")


run_parts(readers, matrices_cut_short, caches)
