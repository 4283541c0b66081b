"""The same scenes in other units:  units.py FLEXFRAME [SCENE...] [--count N] [--seed S] [--kind NAME ...]

Physics knows no metre. Each scene is run as it is and with its lengths, times and masses multiplied by powers of two, which no sum or
product rounds: every output has to be the same number times its unit, every warning the same sentence. A difference is a length, a time
or a mass written into the program where the scene's own belongs. Without scenes: random ones of run_trust.py, N of each kind.

Scenes that say what has no single dimension here (controllers, readings, modal coordinates, files) are counted as left out. Exit 1 if an
output differs by more than both runs claim (run_trust.py; by rounding, if they take the same steps), or if warnings or poles differ.
"""
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import tomllib


sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from arguments import suite_parser  # noqa: E402
import run_trust  # noqa: E402

# Powers of two of length, time, mass, which roots do not round either: a micrometre's world of the same material, a kilometre's, heavier
# matter, faster and slower time.
WORLDS = {"small": (-20, -20, -60), "large": (12, 12, 36), "heavy": (0, 0, 36), "fast": (0, -20, 0), "slow": (0, 20, 0)}
NONE, L, T, M = (0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)
FORCE, MOMENT = (1, -2, 1), (2, -2, 1)
# What one run may differ by from another whose steps are the same: rounding of sines of times.
ROUNDING = 1e-9
# What moves by less than that of its size is at rest.
AT_REST = 1e-7


# What continuous integration runs: rigid and elastic, at rest and in motion, loops, springs, friction, stops, contacts, what has no mass.
SHORT = ["sprung_bob", "tumbling", "springs_at_rest", "slider_crank", "rubbing_loop", "near_buckling", "rolling", "maxwell", "kept_modes"]
SHORT += ["landing_box", "bracket_in_space"]


class LeftOut(Exception):
    pass


def over(dimension, other):
    return tuple(a - b for a, b in zip(dimension, other))


def times(dimension, n):
    return tuple(n * a for a in dimension)


PER_LENGTH = over(FORCE, L)
STIFFNESS, DAMPING = PER_LENGTH, over(FORCE, over(L, T))
# Joints: one letter a coordinate, as the table of kinds has them.
COORDINATES = {
    "weld": "",
    "revolute": "r",
    "screw": "r",
    "prismatic": "m",
    "cylindrical": "mr",
    "universal": "rr",
    "spherical": "rrr",
    "planar": "mmr",
    "free": "mmmrrr",
    "constant-velocity": "rr",
    "pin-slot": "mr",
    "point-on-curve": "m",
    "point-on-line": "m",
    "point-on-plane": "",
    "distance": "",
}
SHAPE = dict.fromkeys(("size", "thickness", "radius", "inner_radius", "length", "position", "width", "hole", "wire", "from", "to"), L)
SHAPE |= dict.fromkeys(("shape", "rotation", "color", "axis", "turns", "teeth"), NONE) | {"density": over(M, times(L, 3))}
SECTION = dict.fromkeys(
    ("diameter", "radius", "outer_diameter", "inner_diameter", "thickness", "width", "height", "y", "z", "web", "flange"), L
)
SECTION |= dict.fromkeys(("shape", "angle", "at", "shear_y", "shear_z"), NONE) | {"area": times(L, 2)}
SECTION |= dict.fromkeys(("iy", "iz", "iyz", "j", "rotary_iy", "rotary_iz"), times(L, 4))
MATERIAL = {"density": over(M, times(L, 3)), "youngs_modulus": over(FORCE, times(L, 2)), "poisson": NONE}
BODY = dict.fromkeys(
    ("name", "kind", "color", "drawing", "shown", "model", "elements", "volumes", "modes", "keep_modes", "keep_axial", "keep_torsion")
    + ("keep_static", "keep_inertia", "curvature_coupling", "boundary", "effects", "without"),
    NONE,
)
BODY |= {"mass": M, "inertia": (2, 0, 1), "centre_of_mass": L, "density": over(M, times(L, 3)), "length": L}
SIMULATION = dict.fromkeys(("tolerance", "accuracy", "method", "max_steps", "start"), NONE)
SIMULATION |= {"duration": T, "output_rate": times(T, -1), "gravity": (1, -2, 0)}
WORDS = {"t", "pi", "e", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "ln", "log", "log10", "sqrt"}
WORDS |= {"abs", "sign", "min", "max", "rint"}


class World:
    def __init__(self, powers):
        self.powers = powers

    def unit(self, dimension):
        return math.ldexp(1.0, sum(a * b for a, b in zip(self.powers, dimension)))

    def expression(self, text, dimension, time=True):
        """Of t, of a curve's u, or of nothing."""
        words = set(re.findall(r"[A-Za-z_][A-Za-z_0-9.]*", re.sub(r"\d+\.?\d*[eE][-+]?\d+", "0", text)))
        if words - WORDS - {"u"}:
            raise LeftOut(f"'{text}'")
        if time:
            text = re.sub(r"\bt\b", f"(t*{1.0 / self.unit(T)!r})", text)
        return f"{self.unit(dimension)!r}*({text})"

    def value(self, given, dimension):
        if isinstance(given, bool) or dimension == NONE:
            return given
        if isinstance(given, str):
            return self.expression(given, dimension)
        if isinstance(given, list):
            return [self.value(v, dimension) for v in given]
        if isinstance(given, dict):
            raise LeftOut(f"table {given}")
        return given * self.unit(dimension)

    def table(self, given, dimensions, where):
        out = {}
        for key, v in given.items():
            if key not in dimensions:
                raise LeftOut(f"{where}.{key}")
            rule = dimensions[key]
            out[key] = rule(v) if callable(rule) else self.value(v, rule)
        return out

    def pairs(self, given, dimension):
        """A table of time, or an expression of it."""
        if isinstance(given, str):
            return self.expression(given, dimension)
        if not isinstance(given, dict):
            return self.value(given, dimension)
        if set(given) - {"table", "period"}:
            raise LeftOut("a table that is not of time")
        out = dict(given, table=[[x * self.unit(T), y * self.unit(dimension)] for x, y in given["table"]])
        if "period" in given:
            out["period"] = given["period"] * self.unit(T)
        return out

    def frames(self, given):
        return {
            k: self.table(v, {"position": L, "rotation": NONE}, "frame") if isinstance(v, dict) else self.value(v, L)
            for k, v in given.items()
        }

    def curve(self, given):
        rules = {"points": L, "closed": NONE, "from": NONE, "to": NONE}
        return self.table(given, rules | {k: lambda v: self.expression(str(v), L, time=False) for k in "xyz"}, "curve")

    def body(self, given):
        rules = dict(BODY)
        if given["kind"] == "beam":
            rules["frames"] = NONE
            rules["damping"] = lambda v: self.table(v, {"ratio": NONE, "mass": times(T, -1), "stiffness": T}, "damping")
            rules["initial"] = lambda v: self.table(v, {"static": NONE}, "initial")
            rules["axis"] = self.curve
        else:
            rules["frames"] = self.frames
        if given["kind"] not in ("beam", "rigid"):
            raise LeftOut(given["kind"])
        if given.get("inertia") == "shapes":
            rules["inertia"] = NONE
        rules["section"] = lambda v: self.table(v, SECTION, "section")
        rules["sections"] = lambda v: [self.table(s, SECTION, "section") for s in v]
        rules["material"] = lambda v: self.table(v, MATERIAL, "material")
        rules["shapes"] = lambda v: [
            self.table({k: x for k, x in s.items() if not (k in ("from", "to") and isinstance(x, str))}, SHAPE, "shape")
            | {k: x for k, x in s.items() if k in ("from", "to") and isinstance(x, str)}
            for s in v
        ]
        return self.table({k: v for k, v in given.items() if k != "mesh"}, rules, "body")

    def joint(self, given):
        letters = COORDINATES[given["kind"]]
        one = {"m": L, "r": NONE}
        many = [one[c] for c in letters]

        def each(v, per=NONE):
            if isinstance(v, list):
                # The angular velocity of a free body may stand alone.
                dims = many if len(v) == len(many) else many[3:]
                return [self.value(x, over(d, per)) for x, d in zip(v, dims)]
            return self.value(v, over(many[0] if many else NONE, per))

        def loaded(word, v):
            """A spring, a stop or friction acts on coordinates of one sort."""
            if len(set(letters)) != 1:
                raise LeftOut(f"{word} on lengths and angles")
            at = many[0]
            load = FORCE if at == L else MOMENT
            rules = {"stiffness": over(load, at), "damping": over(load, over(at, T)), "rest": at, "preload": load, "lower": at, "upper": at}
            rules |= {"coefficient": NONE, "static_coefficient": NONE, "radius": L, "regularised": over(at, T)}
            rules["normal_force"] = NONE if v.get("normal_force") == "reaction" else FORCE
            if word == "friction" and at == NONE:
                v = {"radius": 1.0} | v
            return self.table(v, rules, word)

        rules = dict.fromkeys(("name", "kind", "parent", "child", "axis", "rotation"), NONE)
        rules |= {"position": L, "pitch": L, "length": L, "curve": self.curve}
        rules["initial"] = lambda v: {k: each(x, T if k == "rate" else NONE) for k, x in v.items()}
        rules["motion"] = lambda v: self.pairs(v, many[0])
        rules |= {word: (lambda v, word=word: loaded(word, v)) for word in ("spring", "stop", "friction")}
        return self.table(given, rules, "joint")

    def coupling(self, given, joints):
        rules = dict.fromkeys(("name", "kind", "joints", "teeth", "internal", "ratio", "carrier", "through"), NONE)
        rules |= {"radius": L, "pitch": L, "length": L}
        if given["kind"] == "linear":
            if len({COORDINATES[joints[t["joint"]]["kind"]] for t in given["terms"]}) > 1:
                raise LeftOut("a sum of lengths and angles")
            rules["terms"] = NONE
        return self.table(given, rules, "coupling")

    def force(self, given):
        kind = given["kind"]
        rules = dict.fromkeys(("name", "kind", "on", "from", "through", "direction", "frame", "normal", "axis", "against", "shape"), NONE)
        if kind in ("force", "torque", "distributed"):
            load = {"force": FORCE, "torque": MOMENT, "distributed": PER_LENGTH}[kind]
            rules["value"] = lambda v: self.pairs(v, load)
        elif kind in ("spring-damper", "cable"):
            rules |= {"stiffness": STIFFNESS, "damping": DAMPING, "rest": L, "preload": FORCE, "value": FORCE}
        elif kind == "drag":
            rules |= {"linear": DAMPING, "quadratic": over(M, L), "wind": over(L, T)}
        elif kind == "bushing":
            six = lambda a: lambda v: [self.value(x, a if k < 3 else over(MOMENT, over(FORCE, a))) for k, x in enumerate(v)]
            rules |= {
                "stiffness": six(STIFFNESS),
                "damping": lambda v: [self.value(x, DAMPING if k < 3 else over(MOMENT, times(T, -1))) for k, x in enumerate(v)],
            }
            rules["stiffness"] = lambda v: [self.value(x, STIFFNESS if k < 3 else MOMENT) for k, x in enumerate(v)]
        elif kind == "contact":
            n = given.get("exponent", 1)
            if n != int(n):
                raise LeftOut("a power of a length that is not whole")
            rules |= {"radius": L, "width": L, "from_radius": L, "restitution": NONE, "exponent": NONE, "curve": self.curve}
            rules |= {"stiffness": over(FORCE, times(L, int(n))), "damping": over(T, L)}
            friction = {"coefficient": NONE, "static_coefficient": NONE, "stiffness": STIFFNESS, "damping": DAMPING}
            rules["friction"] = lambda v: self.table(v, friction, "friction")
        else:
            raise LeftOut(kind)
        return self.table(given, rules, "force")

    def scene(self, given):
        for key in given:
            if key not in ("title", "simulation", "ground", "body", "joint", "force", "coupling", "output", "render"):
                raise LeftOut(key)
        joints = {j["name"]: j for j in given.get("joint", [])}
        out = {"simulation": self.table(given["simulation"], SIMULATION, "simulation")}
        if isinstance(given["simulation"].get("accuracy"), str):
            raise LeftOut("accuracy of pictures")
        if "ground" in given:
            out["ground"] = {"frames": self.frames(given["ground"]["frames"])}
        out["body"] = [self.body(b) for b in given["body"]]
        out["joint"] = [self.joint(j) for j in given.get("joint", [])]
        out["force"] = [self.force(f) for f in given.get("force", [])]
        out["coupling"] = [self.coupling(c, joints) for c in given.get("coupling", [])]
        out["output"] = [o for o in given.get("output", []) if has_units(o)]
        if not out["output"]:
            raise LeftOut("outputs without a dimension here")
        return out


PLAIN = {"position": L, "velocity": over(L, T), "acceleration": (1, -2, 0), "rotation": NONE, "angular_velocity": times(T, -1)}
PLAIN |= {"displacement": L, "distance": L, "distance_rate": over(L, T), "angle": NONE, "length": L, "length_rate": over(L, T)}
PLAIN |= dict.fromkeys(("energy", "kinetic", "strain", "potential", "work"), MOMENT) | {"power": over(MOMENT, T)}
PLAIN["stress"] = over(FORCE, times(L, 2))
OF_JOINTS = {"value": lambda d: d, "rate": lambda d: over(d, T)}
OF_JOINTS |= dict.fromkeys(("spring_force", "stop_force", "friction_force"), lambda d: over(MOMENT, d))
MOMENTS = ("mx", "my", "mz", "T", "My", "Mz")


def has_units(output):
    return output.get("quantity") in (*PLAIN, *OF_JOINTS, "reaction", "section_force", "force")


def unit_of(world, output, column, scene):
    """Of a column of the histories."""
    q, last = output["quantity"], column.rpartition(".")[2]
    if q in PLAIN:
        return world.unit(PLAIN[q])
    if q in OF_JOINTS:
        letters = COORDINATES[next(j for j in scene["joint"] if j["name"] == output["of"])["kind"]]
        return world.unit(OF_JOINTS[q](L if letters[int(last) - 1 if last.isdigit() and len(letters) > 1 else 0] == "m" else NONE))
    if q == "force" and output["of"] in [c["name"] for c in scene.get("coupling", [])]:
        return None
    torque = q == "force" and any(f.get("name") == output["of"] and f["kind"] == "torque" for f in scene.get("force", []))
    return world.unit(MOMENT if torque or last in MOMENTS else FORCE)


def inline(v):
    if isinstance(v, bool):
        return "true" if v else "false"
    if isinstance(v, str):
        return '"' + v.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(v, dict):
        return "{ " + ", ".join(f"{inline(k)} = {inline(x)}" for k, x in v.items()) + " }"
    if isinstance(v, list):
        return "[" + ", ".join(map(inline, v)) + "]"
    return repr(v)


def write(scene):
    lines = []
    for name, tables in scene.items():
        for table in tables if isinstance(tables, list) else [tables]:
            lines.append(f"[[{name}]]" if isinstance(tables, list) else f"[{name}]")
            lines += [f"{k} = {inline(v)}" for k, v in table.items()]
    return "\n".join(lines) + "\n"


def words_of(warnings):
    """Warnings without their numbers."""
    return sorted(re.sub(r"[-+]?\d[\d.]*(e[-+]?\d+)?", "#", w) for w in warnings)


def run(program, text, words):
    code, summary, history, _, _ = program.run(text, words)
    if code != 0:
        return ("refused", words_of([l for l in summary.splitlines() if not l.startswith("simulating")][:1])), None, None
    return ("ran", words_of(summary["simulation"]["warnings"])), history, summary["simulation"]


def poles(program, text, world):
    """Of the small motions about the start, in the units of the scene as it is; none where `check` has none."""
    scene = program.folder / "scene.toml"
    scene.write_text(text)
    done = subprocess.run([program.path, "check", str(scene), "--json"], capture_output=True, text=True, stdin=subprocess.DEVNULL)
    if done.returncode != 0:
        return []
    modes = json.loads(done.stdout).get("modes") or []
    return [(m["kind"], complex(m["real"], m["imaginary"]) * world.unit(T)) for m in modes]


def poles_apart(a, b):
    """What differs between two lists of poles; empty where nothing does. A thousandth: drag is differenced at other rates."""
    if len(a) != len(b):
        return f"{len(a)} and {len(b)} modes"
    nothing = 1e-9 * max((abs(p) for _, p in a), default=0.0)
    for (kind, p), (other, q) in zip(a, b):
        if kind != other and max(abs(p), abs(q)) > nothing:
            return f"a mode of {p:.3g} 1/s is {kind} and {other}"
        if abs(p - q) > 1e-3 * abs(p) + nothing:
            return f"a pole of {p:.6g} 1/s is {q:.6g}"
    return ""


def compare(program, name, text, words=()):
    """Lines that say what differs; None where the scene is left out."""
    given = tomllib.loads(text)
    try:
        plain = World((0, 0, 0)).scene(given)
        others = {k: World(p) for k, p in WORLDS.items()}
        scaled = {k: w.scene(given) for k, w in others.items()}
    except LeftOut as why:
        return None, str(why)
    first, history, summary = run(program, write(plain), words)
    modes = poles(program, write(plain), World((0, 0, 0)))
    found = []
    for k, world in others.items():
        said, other, told = run(program, write(scaled[k]), words)
        if said != first:
            found.append(f"{name}, {k}: {first} became {said}")
        if apart := poles_apart(modes, poles(program, write(scaled[k]), world)):
            found.append(f"{name}, {k}: {apart}")
        if not history or not other:
            continue
        # What takes other steps may go another way, as a box that lands on its corners: within what both claim.
        same_steps = summary["steps"] == told["steps"]
        allowed = (ROUNDING if same_steps else 2 * run_trust.DEFAULT_CLAIM) + run_trust.ESTIMATES * sum(
            (s.get("error_estimate") or {}).get("relative") or 0.0 for s in (summary, told)
        )
        worst, where = 0.0, ""
        for output in plain["output"]:
            columns = history[output["name"]]
            for c in range(columns.shape[1]):
                six = columns.shape[1] == 6
                label = f"{output['name']}.{('x', 'y', 'z', 'mx', 'my', 'mz')[c] if six else c + 1}"
                unit = unit_of(world, output, label, plain)
                if unit is None:
                    continue
                part = columns[:, 3 * (c // 3) : 3 * (c // 3) + 3] if six else columns
                # The moment of a reaction that is a plain force is rounding of that.
                if six and abs(part).max() < run_trust.ROUNDING * abs(columns).max():
                    continue
                size = (part.max(axis=0) - part.min(axis=0)).max()
                size = size if size > AT_REST * abs(part).max() else abs(part).max()
                difference = abs(other[output["name"]][:, c] / unit - columns[:, c]).max()
                if difference > worst * size:
                    worst, where = (difference / size if size > 0 else math.inf), label
        if worst > allowed:
            found.append(
                f"{name}, {k}: {where} differs by {worst:.2g} of its range, {allowed:.2g} told (steps {summary['steps']}, {told['steps']})"
            )
    return found, ""


def main():
    parser = suite_parser(__doc__, "kind", "short", count=1, limit=20)
    parser.add_argument("scenes", nargs="*", type=pathlib.Path)
    args = parser.parse_args()
    args.kind += SHORT if args.short else []
    cases = [(str(path), path.read_text(), ()) for path in args.scenes]
    if not cases:
        for kind in run_trust.KINDS:
            if args.kind and kind.__name__ not in args.kind:
                continue
            for number in range(args.count):
                scene = run_trust.make(kind, args.seed, number)
                if "--accuracy" not in scene.words:  # a search takes what costs least, which the machine has a say in
                    cases.append((f"{kind.__name__} {number}", scene.text, scene.words))
    compared = left_out = wrong = 0
    with tempfile.TemporaryDirectory(prefix="flexframe_units_") as folder:
        program = run_trust.Program(args.program, folder, args.limit)
        for name, text, words in cases:
            found, why = compare(program, name, text, words)
            if found is None:
                left_out += 1
                print(f"left out: {name}: {why}", flush=True)
                continue
            compared += 1
            wrong += bool(found)
            for line in found:
                print(line, flush=True)
    print(f"{compared} scenes in {len(WORLDS)} worlds, {left_out} left out: {wrong} differ")
    return 1 if wrong or not compared else 0


if __name__ == "__main__":
    sys.exit(main())
