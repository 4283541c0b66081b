"""What is asked, told, true and paid:  asked_everywhere.py FLEXFRAME EXAMPLES [--count N] [--seed S] [--only NAME ...] [--rows FILE]

All scenes of examples/ and N random scenes of run_trust.py, asked for 0.5 px, 2 px, 1e-2 and 1e-3 (or --asked). Each is compared with a
run of the richest model (all effects that the scene leaves to the program, many elements or modes, more volumes where it bends far) at a
tight tolerance: pictures by all vertices at the scene's cameras and exaggeration (`flexframe compare`), outputs relative to their ranges.
A second truth by another method and resolution says how well the first is known. Price: CPU time of the whole process that was asked, over
that of the cheapest of a grid of hand settings (tolerance, method, kept modes, effects, samples; without estimates and checks) that keeps
it too. Exit 1 where a distance or share is missed and nothing is said.

  --no-examples     random scenes only
  --only NAME       scenes and kinds by name, * and ? as in a shell
  --short           twenty scenes that cost little, 0.5 px and 1e-3, no prices: what continuous integration runs
  --asked A,B       what is asked: "1e-1,1e-2,1e-3" or with pixels, "0.5 px"
  --elastic         random scenes of kinds that have a flexible body only
  --prices FILE     a table of prices for the page, between the markers 'prices' and 'end prices'
  --no-prices       no hand settings are run, which is most of the time
  --rows FILE       results go there line by line; what is there is not run again
  --limit S         CPU seconds that an asked run may take (60); --truth-limit S a truth (60), --hand-limit S a hand run (10)
  --table FILE      the tables go between the markers 'everywhere' and 'end everywhere' of a Markdown page
"""
import collections
import csv
import fnmatch
import json
import math
import pathlib
import re
import resource
import signal
import subprocess
import sys
import tempfile
import tomllib

import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from arguments import suite_parser  # noqa: E402
from run_trust import KINDS, make, title  # noqa: E402

ASKED = ["0.5 px", "2 px", "1e-2", "1e-3"]
ALL = '["axial","bending_xy","bending_xz","torsion","stiffening","shear"]'
BARE = ("--no-error-estimate", "--no-effect-check")
FACTOR = 5.0
# Told and true below these shares of what is asked: nobody looks at them.
NOTHING = 1e-2
SHORT = """mechanisms/pendulum mechanisms/slider_crank mechanisms/four_bar mechanisms/quick_return mechanisms/eccentric mechanisms/governor
mechanisms/top mechanisms/beam_column mechanisms/swinging_atwood mechanisms/quarter_car pendulum double_pendulum
constant_acceleration bounce rubbing_block slider_crank crank_rocker driven_arm rubbing_loop cardan""".split()
SAMPLES = 20  # in a truth, for each of the scene's: pictures are drawn along straight lines between samples
LARGEST_FILE = 3e8  # bytes of a truth's results


class Case:
    """A scene as a file, with the words that its author gave."""

    def __init__(self, name, kind, path, text, words=()):
        self.name, self.kind, self.path, self.text = name, kind, path, text
        self.words = without(words, ("--accuracy", "--tolerance", "--method"))
        self.scene = tomllib.loads(text)
        self.beams = [b for b in self.scene.get("body", []) if b.get("kind") == "beam"]
        self.rate = self.scene.get("simulation", {}).get("output_rate", 1000.0)

    def quantities(self):
        return {o["name"]: o.get("quantity") for o in self.scene.get("output", []) if "name" in o}

    def elastic(self):
        return bool(self.beams) or any(b.get("kind") == "modal" for b in self.scene.get("body", []))


def without(words, options):
    out, skip = [], False
    for word in words:
        if not skip and word not in options:
            out.append(word)
        skip = not skip and word in options
    return tuple(out)


class Bench:
    """Runs of the program in a folder of its own."""

    def __init__(self, program, folder):
        self.program, self.folder = program, pathlib.Path(folder)

    def call(self, words, limit):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(
            [self.program, *map(str, words)],
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(limit), math.ceil(limit) + 5)),
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return done.returncode, done.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    def simulate(self, case, name, words, limit):
        """(summary or None, exit code, CPU s); results and histories are NAME.h5, NAME.csv."""
        files = [self.folder / f"{name}{end}" for end in (".h5", ".csv", ".settings.toml")]
        for file in files:
            file.unlink(missing_ok=True)
        code, out, cpu = self.call(["simulate", case.path, "-o", files[0], "--csv", files[1], "--json", *case.words, *words], limit)
        return (json.loads(out)["simulation"] if code == 0 else None), code, cpu

    def history(self, name):
        with open(self.folder / f"{name}.csv", newline="") as file:
            rows = list(csv.reader(file))
        values = np.array([[float(x) for x in row] for row in rows[1:]])
        history = collections.defaultdict(list)
        for i, column in enumerate(rows[0][1:], 1):
            history[column.split(".")[0]].append(values[:, i])
        return values[:, 0], {k: np.stack(v, axis=1) for k, v in history.items()}

    def pixels(self, truth, other):
        code, out, _ = self.call(["compare", self.folder / f"{truth}.h5", self.folder / f"{other}.h5", "--json"], 120)
        return json.loads(out)["pixels"] if code == 0 else float("nan")

    def error(self, truth, other, asked, case):
        if asked.endswith("px"):
            return self.pixels(truth, other)
        return apart(self.history(truth), self.history(other), case.quantities())


def matrices(vectors):
    """Rotation vectors (n, 3) as matrices (n, 3, 3): Rodrigues' formula."""
    angle = np.linalg.norm(vectors, axis=1)
    k = np.zeros((len(vectors), 3, 3))
    for (i, j), c, sign in (((0, 1), 2, -1), ((0, 2), 1, 1), ((1, 2), 0, -1)):
        k[:, i, j] = sign * vectors[:, c]
        k[:, j, i] = -k[:, i, j]
    half = np.sinc(angle / (2 * np.pi))[:, None, None]
    return np.eye(3) + np.sinc(angle / np.pi)[:, None, None] * k + 0.5 * half * half * (k @ k)


def turned(a, b):
    """Angles between orientations given as rotation vectors, which jump at full turns."""
    between = np.swapaxes(matrices(a), 1, 2) @ matrices(b)
    return 2 * np.arcsin(np.minimum(1.0, np.linalg.norm(between - np.eye(3), axis=(1, 2)) / np.sqrt(8)))


def apart(truth, other, quantities):
    """Largest difference over the outputs relative to an output's range; at the times that both have. Vectors as a whole; what stands
    still, but for places, against its size. None: nothing is seen."""
    (t, b), (u, a) = truth, other
    at = np.clip(np.searchsorted(t, u), 1, len(t) - 1)
    at -= (abs(t[at - 1] - u) < abs(t[at] - u)).astype(int)
    there = abs(t[at] - u) <= 1e-9 * max(abs(t[-1]), abs(u[-1]), 1e-300)
    worst, largest = None, collections.defaultdict(float)
    for name, true in b.items():
        largest[quantities.get(name)] = max(largest[quantities.get(name)], abs(true).max())
    for name, true in b.items():
        # Where nothing drives it the energy is constant but for rounding; a body has as many elastic coordinates as it has modes.
        if name not in a or not there.any() or name == "energy" or a[name].shape[1] != true.shape[1]:
            continue
        quantity = quantities.get(name)
        for part in (slice(0, 3), slice(3, 6)) if true.shape[1] == 6 else (slice(None),):
            span = np.ptp(true[:, part], axis=0).max()
            if span <= max(1e-5 * abs(true[:, part]).max(), 1e-9 * abs(true).max(), 1e-12):
                span = largest[quantity] if quantity in ("displacement", "deflection") else abs(true[:, part]).max()
                if quantity in (None, "position") or span <= max(1e-6 * largest[quantity], 1e-12):
                    continue
            mine, his = a[name][there][:, part], true[at[there]][:, part]
            off = turned(mine, his) if quantity == "rotation" and mine.shape[1] == 3 else np.linalg.norm(mine - his, axis=1)
            worst = max(worst or 0.0, off.max() / span)
    return None if worst is None else float(worst)


def richer(case, far, fine):
    """Words of a richer model. far: beams bend far, so that they are divided into volumes. fine: the better of two resolutions."""
    words = []
    for b in case.beams:
        key = f"body.{b['name']}."
        if b.get("effects", "auto") == "auto":
            words += ["--set", f"{key}effects={json.dumps([e for e in json.loads(ALL) if e not in b.get('without', [])])}"]
        if "node[" in case.text or "station[" in case.text:
            continue  # the place is another one with other elements
        if b.get("model") == "mixed":
            words += ["--set", f"{key}volumes={int(b.get('volumes', 4) * (2 if fine else 1.5))}"]
        elif "modes" in b:
            more = {d: [m for m in range(1, (3 if fine else 2) * (v if isinstance(v, int) else max(v)) + 1)] for d, v in b["modes"].items()}
            words += ["--set", f"{key}modes=" + "{" + ",".join(f"{d}={v}" for d, v in more.items()) + "}"]
        elif b.get("model") == "lumped":
            words += ["--set", f"{key}elements={b.get('elements', 10) * (4 if fine else 3)}"]
        elif far and "without" not in b:  # volumes have again what the scene leaves out
            words += ["--set", f'{key}model="mixed"', "--set", f"{key}volumes={16 if fine else 10}", "--set", f"{key}elements=2"]
        else:
            words += ["--set", f"{key}elements={96 if fine else 64}", "--set", f"{key}keep_modes={32 if fine else 20}"]
    return words


def of_elements(case, folder):
    """The scene with finite elements where it lists eigenforms: more of these converge slowly to the wrong ends of a beam."""
    if not any("modes" in b and b.get("model") == "modal" for b in case.beams):
        return case
    text = re.sub(r'(?m)^(modes|boundary) = .*\n|^model = "modal".*\n', "", case.text)
    path = folder / "of_elements.toml"
    path.write_text(re.sub(r'"(?=\.\.?/)', f'"{case.path.parent}/', text))
    return Case(case.name, case.kind, path, path.read_text(), case.words)


def truths(bench, case, limit, far, finer, both=True):
    """Makes truth.h5 and, where it succeeds, second.h5; returns their words or None."""
    case = of_elements(case, bench.folder)
    samples = ["--set", f"simulation.output_rate={finer * case.rate!r}"]
    rich = [richer(case, far, True), richer(case, far, False)] if case.beams else [[], []]
    made, used = [], None
    for name, forms in (("truth", rich), ("second", rich[::-1])):
        if name == "second":
            tries = [(m, forms[0], "1e-9") for m in ("dirk", "erk", "bdf") if m != used]
        elif far:
            tries = [("auto", forms[0], "1e-9"), ("dirk", forms[0], "1e-8")]
        else:
            first = ("exponential", forms[0], "1e-9") if case.elastic() else ("auto", forms[0], "1e-11")
            # Beams of many elements may take too long where they bend far, volumes do not; the scene's own form is the last resort.
            volumes = [("dirk", richer(case, True, name == "truth"), "1e-9")] if case.beams else []
            tries = [first, ("auto", forms[0], "1e-9"), *volumes, ("dirk", [], "1e-9")]
        for method, form, tolerance in tries:
            words = ["--method", method, "--tolerance", tolerance, *BARE, *form, *samples]
            summary, _, _ = bench.simulate(case, name, words, limit)
            if summary:
                made.append(" ".join(words))
                used = summary.get("method", method)
                break
        else:
            return made
        if not both:
            break
    return made


def hand_forms(case):
    """(name, words) of what one would try by hand."""
    forms = [("as written", [])]
    plain = [b for b in case.beams if b.get("model", "finite-element") == "finite-element" and "modes" not in b]
    if plain:
        for n in (3, 8, 16):
            words = [w for b in plain for w in ("--set", f"body.{b['name']}.elements={3 * n}", "--set", f"body.{b['name']}.keep_modes={n}")]
            forms.append((f"{n} modes", words))
            effects = [w for b in plain if b.get("effects", "auto") == "auto" for w in ("--set", f"body.{b['name']}.effects={ALL}")]
            if effects and n > 3:
                forms.append((f"{n} modes, all effects", words + effects))
    return forms


def hand_grid(bench, case, asked, limit, longest):
    """{asked: (CPU s, words)} of the cheapest hand settings that keep it. limits: {asked: allowed error}."""
    best = {}
    methods = ["auto", "exponential"] if case.elastic() else ["auto", "adams"]
    for form, words in hand_forms(case):
        for method in methods:
            last = None
            for k in range(2, 10):
                for rate in (1, 4) if any(a.endswith("px") for a in asked) and k == 4 and not words else (1,):
                    finer = ["--set", f"simulation.output_rate={rate * case.rate!r}"] if rate > 1 else []
                    setting = ["--tolerance", f"1e-{k}", "--method", method, *BARE, *words, *finer]
                    summary, _, cpu = bench.simulate(case, "hand", setting, longest)
                    if not summary:
                        break
                    errors = {a: bench.error("truth", "hand", a, case) or 0.0 for a in asked}
                    for a in asked:
                        if errors[a] <= limit[a] and cpu < best.get(a, (1e9,))[0]:
                            best[a] = (cpu, f"{form}, {method}, 1e-{k}" + (f", {rate} x samples" if rate > 1 else ""))
                if not summary or all(a in best and best[a][0] < cpu for a in asked):
                    break
                if last and all(errors[a] > 0.9 * last[a] for a in asked):
                    break  # not the tolerance's any more
                last = errors
    return best


def told_of(summary, asked, case):
    """What a run says its error is, in the unit that is asked for; of pictures without the raster, and without the map where the truth has
    no more nodes than the run."""
    if not asked.endswith("px"):
        return summary["accuracy"]["error"]
    p = summary["accuracy"]["picture"]
    return p["total"] - p["raster"] - (0.0 if case.beams else p["map"])


def leaves_out_by_hand(case, notes):
    """Whether the run is told to lack an effect that its scene leaves out: its truth has none either."""
    chosen = any("without" in b or b.get("effects", "auto") != "auto" for b in case.beams)
    return chosen and any(re.match(r"\w+ of .* left out(: [0-9]|, but)", words) for words in notes)


def rows_of(bench, case, args, asked):
    """A row for each question: {scene, kind, asked, told, true, unsure, verdict, cpu, hand, by, said}."""
    rows, runs, far = [], {}, False
    for n, a in enumerate(asked):
        summary, code, cpu = bench.simulate(case, f"asked{n}", ["--accuracy", a, "--fresh"], args.limit)
        runs[a] = summary
        row = {"scene": case.name, "kind": case.kind, "asked": a, "cpu": cpu}
        if not summary:
            row["verdict"] = "refused" if code in (1, 2) else "slow" if code == -signal.SIGXCPU or cpu > args.limit - 2 else "broken"
        else:
            row["told"], row["said"] = told_of(summary, a, case), summary["warnings"][:3]
            row["by_hand"] = leaves_out_by_hand(case, summary["warnings"] + summary["notes"])
            words = " ".join(summary["warnings"] + summary["accuracy"].get("chosen", []))
            far = far or "volumes" in words or "linear displacements" in words
        rows.append(row)
    if not any(runs.values()):
        return rows
    sizes = [(bench.folder / f"asked{n}.h5").stat().st_size for n, a in enumerate(asked) if runs[a]]
    finer = max(1, min(SAMPLES, int(LARGEST_FILE / max(min(sizes), 1))))
    made = truths(bench, case, args.truth_limit, far, finer, both=not args.short)
    limit = {a: float(a.split()[0]) for a in asked}
    for n, row in enumerate(rows):
        if "told" not in row:
            continue
        if not made:
            row["verdict"] = "no truth"
            continue
        a, error = row["asked"], bench.error("truth", f"asked{n}", row["asked"], case)
        if error is None:  # no output moves or has a size
            row["verdict"] = "kept"
            continue
        if error > limit[a] and not row["said"] and case.beams and not far:
            # One frame a beam lacks what volumes have, also where it bends too little for a word at the default accuracy.
            far = True
            # One that fails has overwritten the one before.
            both = not args.short
            made = truths(bench, case, args.truth_limit, True, finer, both) or truths(bench, case, args.truth_limit, False, finer, both)
            if not made:
                row["verdict"] = "no truth"
                continue
            error = bench.error("truth", f"asked{n}", a, case)
        if error > limit[a] and not row["said"] and len(made) == 1:
            made = truths(bench, case, args.truth_limit, far, finer)
            if not made:
                row["verdict"] = "no truth"
                continue
        row["true"] = error
        row["unsure"] = bench.error("truth", "second", a, case) if len(made) > 1 else None
        unsure = row["unsure"] or 0.0
        if error != error:
            row["verdict"] = "no truth"
        elif error <= limit[a]:
            row["verdict"] = "open" if unsure > 2 * limit[a] and not row["said"] else "kept"
        else:
            row["verdict"] = "warned" if row["said"] else "open" if error - unsure <= limit[a] or unsure > 0.5 * error else "SILENT"
        row["truth"] = made[0]
        # The scene as written has the effects of the default accuracy only.
        row["weak"] = "effects=" not in made[0] and any(b.get("effects", "auto") == "auto" for b in case.beams)
    if made and not args.short and not args.no_prices:
        longest = min(args.hand_limit, 1.0 + max(r["cpu"] for r in rows))  # a dearer one is no answer to what asking costs
        best = hand_grid(bench, case, [r["asked"] for r in rows if "true" in r], limit, longest)
        for row in rows:
            if row["asked"] in best:
                row["hand"], row["by"] = best[row["asked"]]
    if not args.short and not far and case.beams and any(estimate(r) == "too large" for r in rows):
        by_volumes(bench, case, args.truth_limit, finer, rows)
    return rows


def by_volumes(bench, case, limit, finer, rows):
    """What is told of bending in one frame is not seen by a truth that has one frame too: volumes, where two numbers of them agree."""
    made = truths(bench, case, limit, True, finer)
    if len(made) < 2:
        return
    for n, row in enumerate(rows):
        if estimate(row) != "too large":
            continue
        a = row["asked"]
        error, unsure = bench.error("truth", f"asked{n}", a, case), bench.error("truth", "second", a, case)
        if row["true"] < error <= float(a.split()[0]) and unsure < 0.25 * error:
            row.update(true=error, unsure=unsure, truth=made[0])
        elif error <= float(a.split()[0]):
            row["bent"] = error + unsure  # no more is known


def estimate(row):
    """kept, too large, too small, or None where what is true is not known so well: what is told against what is true."""
    if row.get("true") is None or row.get("weak") or row["verdict"] in ("open", "no truth"):
        return None
    if any(words.startswith("shear of") for words in row["said"]):  # its truth has none either
        return None
    told, true, unsure = row["told"], row["true"], row.get("unsure")
    if max(told, true) <= NOTHING * float(row["asked"].split()[0]):
        return "kept"
    if unsure is None:  # one truth only: nobody knows how good it is
        return None
    if told / FACTOR <= true - unsure and true + unsure <= told * FACTOR:
        return "kept"
    if true - unsure > told * FACTOR:
        return "too small"
    if true + unsure >= told / FACTOR or row.get("by_hand") or row.get("bent", 0.0) >= told / FACTOR:
        return None  # undecided
    return "too large"


def cell(row):
    if row is None:
        return "-"
    if "true" not in row:
        return row["verdict"]
    price = f", {row['cpu'] / row['hand']:.1f}" if row.get("hand") else ""
    mark = "" if row["verdict"] == "kept" else f" {row['verdict']}"
    return f"{row['told']:.1e} / {row['true']:.1e}{price}{mark}"


def questions(rows):
    """What was asked, in the order of ASKED and then as it came."""
    there = dict.fromkeys(r["asked"] for r in rows)
    return [a for a in ASKED if a in there] + [a for a in there if a not in ASKED]


def price_lines(rows):
    """What asking costs over the cheapest setting by hand that keeps the same: over all scenes, and the worst one of each question."""
    lines = ["| asked | scenes | kept | warned | open, no truth | refused, slow | silent | with a price | median | ninth decile | worst |",
             "|---" * 11 + "|"]  # fmt: skip
    for a in sorted(questions(rows), key=lambda a: -float(a.split()[0])):
        mine = [r for r in rows if r["asked"] == a]
        n = collections.Counter(r["verdict"] for r in mine)
        dear = sorted((r for r in mine if r.get("hand") and r["verdict"] == "kept"), key=lambda r: -r["cpu"] / r["hand"])
        of = [r["cpu"] / r["hand"] for r in dear]
        worst = ", ".join(f"{r['scene'].split('/')[-1]} {r['cpu'] / r['hand']:.1f} ({r['cpu']:.2g} s)" for r in dear[:1])
        lines.append(
            f"| {a} | {len(mine)} | {n['kept']} | {n['warned']} | {n['open'] + n['no truth']} | {n['refused'] + n['slow'] + n['broken']} | "
            f"{n['SILENT']} | {len(of)} | " + " | ".join(f"{np.percentile(of, q):.1f}" if of else "-" for q in (50, 90)) + f" | {worst} |"
        )
    return lines


def summary_lines(rows):
    """A line for each question: verdicts, estimates, prices."""
    lines = ["| asked | scenes | kept | warned | open, no truth | refused, slow | silent | estimate within five | too large | too small | "
             "price, median | price, ninth decile |", "|---" * 12 + "|"]  # fmt: skip
    for a in questions(rows):
        mine = [r for r in rows if r["asked"] == a]
        n = collections.Counter(r["verdict"] for r in mine)
        e = collections.Counter(estimate(r) for r in mine)
        prices = [r["cpu"] / r["hand"] for r in mine if r.get("hand")]
        price = [f"{np.percentile(prices, q):.1f}" if prices else "-" for q in (50, 90)]
        lines.append(
            f"| {a} | {len(mine)} | {n['kept']} | {n['warned']} | {n['open'] + n['no truth']} | {n['refused'] + n['slow'] + n['broken']} | "
            f"{n['SILENT']} | {e['kept']} | {e['too large']} | {e['too small']} | {price[0]} | {price[1]} |"
        )
    return lines


def tables(rows):
    """The sums, then a row for every example and one for every kind of random scene."""
    lines, asked = summary_lines(rows), questions(rows)
    scenes = collections.defaultdict(dict)
    for r in rows:
        scenes[(r["kind"], r["scene"])][r["asked"]] = r
    lines += ["", "Told / true, price:", "", "| example | " + " | ".join(asked) + " |", "|---" * (1 + len(asked)) + "|"]
    lines += [f"| {name} | " + " | ".join(cell(of.get(a)) for a in asked) + " |" for (kind, name), of in scenes.items() if not kind]
    heads = ["kind of scene", "questions", "kept", "warned", "silent", "else", "estimates within five", "of", "price, median"]
    lines += ["", "| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for kind in KINDS:
        mine = [r for r in rows if r["kind"] == kind.__name__]
        if not mine:
            continue
        n = collections.Counter(r["verdict"] for r in mine)
        told = [e for e in map(estimate, mine) if e]
        prices = [r["cpu"] / r["hand"] for r in mine if r.get("hand")]
        price = f"{np.median(prices):.1f}" if prices else "-"
        rest = len(mine) - n["kept"] - n["warned"] - n["SILENT"]
        lines.append(
            f"| {title(kind)} | {len(mine)} | {n['kept']} | {n['warned']} | {n['SILENT']} | {rest} | {told.count('kept')} | {len(told)} | "
            f"{price} |"
        )
    return lines


def is_elastic(kind, seed):
    scene = make(kind, seed, 0)
    return Case("", "", "", scene.text, scene.words).elastic()


def cases(args, folder):
    """Examples, then random scenes."""
    known = {}
    if not args.no_examples:
        for path in sorted(args.examples.rglob("*.toml")):
            name = str(path.relative_to(args.examples).with_suffix(""))
            if name.split("/")[0] in ("library", "studies", "notebooks") or "[simulation]" not in path.read_text():
                continue
            known[name] = lambda name=name, path=path: Case(name, "", path, path.read_text())
    kinds = [k for k in KINDS if not args.elastic or is_elastic(k, args.seed)]
    count = len(kinds) if args.short else args.count
    for i in range(count):
        # Fewer scenes than kinds: spread over all of them.
        kind, number = kinds[i * len(kinds) // count if count < len(kinds) else i % len(kinds)], i // len(kinds)

        def random_case(kind=kind, number=number):
            scene = make(kind, args.seed, number)
            path = pathlib.Path(folder) / "scene.toml"
            path.write_text(scene.text)
            return Case(f"{kind.__name__} {args.seed}.{number}", kind.__name__, path, scene.text, scene.words)

        known[kind.__name__ if args.short else f"{kind.__name__} {args.seed}.{number}"] = random_case
    only = SHORT if args.short else args.only
    return {k: v for k, v in known.items() if not only or any(fnmatch.fnmatchcase(k.split()[0], o) for o in only)}


def main():
    parser = suite_parser(__doc__, "short", "rows", "table", count=200, limit=60, truth_limit=60)
    parser.add_argument("examples", type=pathlib.Path)
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--asked", type=lambda words: [a.strip() for a in words.split(",")])
    parser.add_argument("--elastic", action="store_true")
    parser.add_argument("--prices", type=pathlib.Path)
    parser.add_argument("--no-examples", action="store_true")
    parser.add_argument("--no-prices", action="store_true")
    parser.add_argument("--hand-limit", type=int, default=10)
    args = parser.parse_args()
    rows = [json.loads(x) for x in args.rows.read_text().splitlines()] if args.rows and args.rows.exists() else []
    done = {r["scene"] for r in rows}
    asked = args.asked or (["0.5 px", "1e-3"] if args.short else ASKED)
    with tempfile.TemporaryDirectory(prefix="flexframe_everywhere_") as folder:
        bench = Bench(args.program, folder)
        for name, case_of in cases(args, folder).items():
            if name in done:
                continue
            for row in rows_of(bench, case_of(), args, asked):
                rows.append(row)
                if args.rows:
                    with open(args.rows, "a") as file:
                        file.write(json.dumps(row) + "\n")
                e = estimate(row)
                print(
                    f"{row['verdict']}: {row['scene']}, {row['asked']}: {cell(row)}{', estimate ' + e if e and e != 'kept' else ''}; "
                    f"{row['cpu']:.2f} CPU s{', by hand ' + format(row['hand'], '.3f') + ': ' + row['by'] if row.get('hand') else ''}",
                    flush=True,
                )
    print("\n".join(summary_lines(rows) + [""] + price_lines(rows)))
    for file, word, lines in ((args.table, "everywhere", tables), (args.prices, "prices", price_lines)):
        if not file:
            continue
        page = file.read_text()
        begin, end = f"<!-- {word} -->\n", f"<!-- end {word} -->"
        file.write_text(page[: page.index(begin) + len(begin)] + "\n".join(lines(rows)) + "\n" + page[page.index(end) :])
    bad = [r for r in rows if r["verdict"] in ("SILENT", "broken")]
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
