"""Beams as bodies reduced from finite elements:  as_solids.py FLEXFRAME [--count N] [--seed S] [--kind NAME ...] [--keep FOLDER]

Random scenes of run_trust.py whose beams are rectangles held at their ends: each beam becomes a bar of 20-node bricks (.inp, in metres or
millimetres), reduced with rigid interfaces at both ends to a .sid or .h5 file, and stands in the scene as a body of kind "modal". The
scene's own truth judges it: 1 % of an output's range for what the program leaves out, five times the printed estimate for time. Poisson's
ratio is zero, so that ends held rigidly are no stiffer than a beam's, and beams are slender: what a solid is besides a beam is small then
(SOLID of a range). Scenes that bend farther than linear shapes follow have to be warned of.
Exit 1 if one is silent.
"""
import collections
import dataclasses
import math
import pathlib
import random
import subprocess
import sys
import tempfile
import tomllib

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from arguments import suite_parser  # noqa: E402
import run_trust  # noqa: E402
from scene import MATERIALS  # noqa: E402
from units import write  # noqa: E402

SOLID = 0.01  # of an output's range
SLENDER = 8.0  # length over the larger side
# Of a beam, what a solid has too; the rest is its geometry.
KEPT = ("name", "kind", "length", "section", "material", "damping", "shown", "effects")
WARPED = ("torsion_rod",)  # between rigid ends a solid cannot warp and twists less than a beam that may
READ = (
    "position",
    "velocity",
    "acceleration",
    "displacement",
    "value",
    "rate",
    "reaction",
    "rotation",
    "angular_velocity",
    "energy",
    "kinetic",
)


def bricks(length, height, width, material, scale):
    """A bar along x as an .inp of 20-node bricks, 2 x 2 across; lengths times `scale`, kg s and that length."""
    along = max(8, min(40, math.ceil(length / max(height, width) / 1.5)))
    nodes, numbers, elements = [], {}, []

    def node(i, j, k):  # in halves of elements
        if (i, j, k) not in numbers:
            numbers[i, j, k] = len(nodes) + 1
            nodes.append((i * length / (2 * along), (j / 4 - 0.5) * height, (k / 4 - 0.5) * width))
        return numbers[i, j, k]

    for a in range(along):
        for b in range(2):
            for c in range(2):
                at = lambda i, j, k: node(2 * a + i, 2 * b + j, 2 * c + k)
                bottom = [(0, 0), (2, 0), (2, 2), (0, 2)]
                middle = [(1, 0), (2, 1), (1, 2), (0, 1)]
                row = [at(i, j, 0) for i, j in bottom] + [at(i, j, 2) for i, j in bottom]
                row += [at(i, j, 0) for i, j in middle] + [at(i, j, 2) for i, j in middle] + [at(i, j, 1) for i, j in bottom]
                elements.append(row)
    lines = ["*NODE"] + [f"{n}, " + ", ".join(f"{scale * x:.12g}" for x in p) for n, p in enumerate(nodes, 1)]
    lines.append("*ELEMENT, TYPE=C3D20, ELSET=BAR")
    for n, row in enumerate(elements, 1):
        lines += [f"{n}, " + ", ".join(map(str, row[:11])) + ",", ", ".join(map(str, row[11:]))]
    for name, i in (("ROOT", 0), ("TIP", 2 * along)):
        lines += [f"*NSET, NSET={name}"] + [f"{n}," for (a, _, _), n in numbers.items() if a == i]
    # mm, t, s: Pa is N/mm^2 1e-6, kg/m^3 t/mm^3 1e-12.
    E, rho = (
        (material["youngs_modulus"], material["density"])
        if scale == 1
        else (material["youngs_modulus"] * 1e-6, material["density"] * 1e-12)
    )
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{E!r}, {material.get('poisson', 0.3)!r}", "*DENSITY", f"{rho!r}"]
    lines += ["*SOLID SECTION, ELSET=BAR, MATERIAL=M", ""]
    return "\n".join(lines)


def fits(scene):
    """Whether every beam is a rectangle that is held, loaded and read at its ends alone."""
    beams = {b["name"]: b for b in scene["body"] if b["kind"] == "beam"}
    if not beams:
        return False
    for b in beams.values():
        effects = b.get("effects", "auto")
        if set(b) - set(KEPT) or b["section"]["shape"] != "rectangle" or "length" not in b or effects != "auto":
            return False
        if not all(isinstance(b["section"].get(k), (int, float)) for k in ("height", "width")) or "angle" in b["section"]:
            return False
        if b["length"] < SLENDER * max(b["section"]["height"], b["section"]["width"]):
            return False
    for table in scene["joint"] + scene.get("force", []) + scene["output"]:
        for key in ("parent", "child", "on", "from", "of"):
            name, _, frame = str(table.get(key, "")).partition(".")
            if name in beams and frame not in ("root", "tip"):
                return False
    return all(o.get("quantity") in READ for o in scene["output"])


def solid(program, folder, b, r, modes, stiffer=1.0):
    """The table of body b as a reduced one, so many times as stiff; makes its file."""
    name, s = b["name"], b["section"]
    scale, ending = r.choice((1, 1000)), r.choice(("sid", "h5"))
    deck, made = folder / f"{name}.inp", folder / f"{name}.{ending}"
    material = b["material"] | {"youngs_modulus": stiffer * b["material"]["youngs_modulus"]}
    deck.write_text(bricks(b["length"], s["height"], s["width"], material, scale))
    words = ["reduce", str(deck), "-o", str(made), "--modes", str(modes), "--cache", "none", "--units", "m" if scale == 1 else "mm"]
    for end, x in (("root", 0.0), ("tip", b["length"])):
        words += ["--interface", f"{end}=rigid:{end.upper()}@{x!r},0,0"]
    done = subprocess.run([program, *words], capture_output=True, text=True, stdin=subprocess.DEVNULL)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip()[-300:])
    return {"name": name, "kind": "modal", "file": str(made)} | {k: b[k] for k in ("damping", "shown") if k in b}


def as_solids(program, scene, seed, folder, stiffer=1.0):
    """The scene's text with every beam reduced from bricks."""
    table = {"output": [], "joint": []} | tomllib.loads(scene.text)
    r = random.Random(f"solid {seed} {scene.kind} {scene.number}")
    modes = r.choice((8, 12, 20))
    table["body"] = [solid(program.path, folder, b, r, modes, stiffer) if b["kind"] == "beam" else b for b in table["body"]]
    return write(table)


def judge(program, scene, seed, folder):
    beams = dataclasses.replace(scene)
    scene.text = as_solids(program, beams, seed, folder)
    scene.claim = None
    verdict, error, claim, said, cpu = run_trust.judge(program, scene)
    if verdict == "silent" and error <= claim + SOLID:
        verdict = "right"
    if verdict == "silent":
        # What bounces many times may tell a solid from a beam: so does half a per cent of its stiffness then.
        _, _, first, _, _ = program.run(scene.text, scene.words)
        code, _, second, _, _ = program.run(as_solids(program, beams, seed, folder, 1.005), scene.words)
        if code == 0 and run_trust.compare(scene, second, first)[0] > 0.5 * error:
            verdict, said = "open", "half a per cent of the stiffness changes it as much"
    return verdict, error, claim, said, cpu


def main():
    parser = suite_parser(__doc__, "kind", "keep", count=1, limit=60)
    args = parser.parse_args()
    for m in MATERIALS:
        m["poisson"] = 0.0
    count = collections.Counter()
    for kind in run_trust.KINDS:
        for number in range(args.count if not args.kind or kind.__name__ in args.kind else 0):
            scene = run_trust.make(kind, args.seed, number)
            if (
                kind.__name__ in WARPED
                or "--accuracy" in scene.words
                or not fits({"output": [], "joint": [], "body": []} | tomllib.loads(scene.text))
            ):
                continue
            with tempfile.TemporaryDirectory(prefix="flexframe_solids_") as place:
                program = run_trust.Program(args.program, place, args.limit, 120)
                verdict, error, claim, said, cpu = judge(program, scene, args.seed, pathlib.Path(place))
                if args.keep and verdict in run_trust.BAD:
                    args.keep.mkdir(parents=True, exist_ok=True)
                    for f in pathlib.Path(place).iterdir():
                        (args.keep / f"{kind.__name__}_{number}_{f.name}").write_bytes(f.read_bytes())
            count[verdict] += 1
            numbers = "" if error is None else f"error {error:.2e} claim {claim:.2e} "
            print(f"{verdict:8} {kind.__name__} {args.seed} {number}: {numbers}{cpu:.2f} s; {scene.what}; {said[:200]}", flush=True)
    print(", ".join(f"{count[v]} {v}" for v in ("right", "warned", "refused", *run_trust.BAD, "open")))
    return 1 if any(count[v] for v in run_trust.BAD) or not count else 0


if __name__ == "__main__":
    sys.exit(main())
