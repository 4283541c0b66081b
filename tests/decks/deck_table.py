#!/usr/bin/env python3
"""Folders of finite element decks through `flexframe reduce`, and through CalculiX where it is there.

    deck_table.py FLEXFRAME FOLDER... [--write TABLE.md] [--reasons] [--no-ccx] [--jobs N] [--limit SECONDS] [--only TEXT] [--sample N]
                  [--kept FOLDER] [--json FILE]

Every .inp, .bdf, .nas and bulk data .dat below the folders is reduced to its first six modes with its own units, supports as the deck has
them; a deck that is there twice counts once. A deck without density is tried once more with that of steel, which CalculiX then gets too, a
deck of fewer motions with as many modes as it has. CalculiX computes the same model: everything before the first *STEP and the supports of
that step, followed by a *FREQUENCY step of its own. Of a model that is not large its matrices are solved here, since its Lanczos iteration
misses the lowest of few motions, and all below about a hertz. Nastran's own frequencies are taken from NAME.f06 beside NAME.bdf where its
table of real eigenvalues is there. The table holds names, answers and the largest difference of the frequencies, and where that is more
than 1 % what our side said of it; no text of any deck; the last lines count. --kept keeps what CalculiX said, so that a table of the next
build needs only our side. --reasons counts the reasons of refusals, numbers and names taken out; --sample takes N decks, evenly spread.
"""
import argparse
import collections
import concurrent.futures
import hashlib
import json
import math
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import numpy
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg

MODES = 6
AGREES = 0.01  # more than this between the frequencies is a difference that a warning must explain


def run(command, limit, folder):
    try:
        return subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=limit, cwd=folder)
    except subprocess.TimeoutExpired:
        return None


def reduce(flexframe, deck, folder, limit, *options, modes=MODES):
    """answer ('accepted' or 'refused' ...), its reasons, frequencies, rigid motions, notes and warnings."""
    done = run(
        [flexframe, "reduce", str(deck), "-o", "body.sid", "--method", "eigen", "--modes", str(modes), "--nodes", "2", "--no-stiffening"]
        + ["--memory", "4", "--json", "--quiet", *options],
        limit,
        folder,
    )
    if done is None:
        return {"answer": "no answer in time", "reasons": []}
    text = done.stderr.replace(str(deck.parent) + "/", "")
    if done.returncode == 0:
        made = json.loads(done.stdout)
        return {
            "answer": "accepted",
            "reasons": [],
            "frequencies": made["frequencies"],
            "rigid": made["rigid_motions"],
            "warnings": made["warnings"],
            "notes": made["notes"],
        }
    if done.returncode < 0:
        return {"answer": f"CRASH by signal {-done.returncode}", "reasons": []}
    lines = [line for line in text.splitlines() if line.strip() and "warning" not in line.lower() and not line.startswith("note")]
    return {"answer": "refused", "reasons": [re.sub(r"^(flexframe: )?error: ", "", line) for line in lines] or ["?"]}


def logical_lines(deck, depth=0):
    """Lines of a deck with those of its *INCLUDE files in place."""
    for line in deck.read_text(errors="replace").splitlines():
        found = re.match(r"(?i)\*\s*INCLUDE\s*,.*INPUT\s*=\s*\"?([^,\"]+)", line)
        other = deck.parent / found.group(1).strip() if found else None
        if other and other.exists() and depth < 8:
            yield from logical_lines(other, depth + 1)
        else:
            yield line.lstrip() if line.lstrip().startswith("*") else line


def f06_frequencies(deck):
    """Nastran's frequencies from the .f06 beside the deck, rigid motions among them; None where there are none."""
    found = None
    if re.search(r"(?im)^ *SOL +(105|106|SEBUCKL)", deck.read_text(errors="replace")):  # the eigenvalues are loads
        return None
    for line in deck.with_suffix(".f06").read_text(errors="replace").splitlines() if deck.with_suffix(".f06").exists() else []:
        words = line.split()
        if "R E A L   E I G E N V A L U E S" in line:
            found = found or []
        elif found is not None and len(words) == 7 and words[0].isdigit():
            if int(words[0]) != len(found) + 1:
                break
            found.append(float(words[4]))
        elif found and words and not words[0].isdigit():
            break
    return found or None


def kept_frequencies(deck, folder, limit, density, kept):
    """ccx_frequencies, or what they were the last time for the same lines; kept: folder or None."""
    if kept is None:
        return ccx_frequencies(deck, folder, limit, density)
    digest = hashlib.md5(("\n".join(logical_lines(deck)) + str(density)).encode()).hexdigest()
    answer = kept / (digest + ".json")
    if not answer.exists():
        answer.write_text(json.dumps(ccx_frequencies(deck, folder, limit, density)))
    return json.loads(answer.read_text())


def ccx_frequencies(deck, folder, limit, density):
    """CalculiX' own frequencies of the same model, rigid motions among them; None where it has none."""
    model, supports, steps, keyword = [], [], 0, ""
    for line in logical_lines(deck):
        if line.startswith("*") and not line.startswith("**"):
            keyword = line[1:].split(",")[0].strip().upper()
            if keyword == "STEP":
                steps += 1
        if steps == 0:
            model.append(line)
        elif steps == 1 and keyword == "BOUNDARY" and not line.startswith("**"):
            supports.append("*BOUNDARY" if line.startswith("*") else ",".join(line.split(",")[:3]))
    text = "\n".join(model)
    if density:
        # A material without density gets one.
        blocks = re.split(r"(?im)^(?=\*\s*MATERIAL)", text)
        text = "".join(
            b
            if not re.match(r"(?i)\*\s*MATERIAL", b) or re.search(r"(?im)^\*\s*DENSITY", b)
            else re.sub(r"(?im)^(?=\*\s*ELASTIC)", f"*DENSITY\n{density}\n", b, count=1)
            for b in blocks
        )
    if sum(bool(re.match(r" *\d+ *,", line)) for line in model) < 3000:
        if found := matrix_frequencies(text, supports, limit, folder):
            return found
    found = ccx_run(text, supports, MODES + 6, limit, folder)
    return found if found and any(f > 0 for f in found) else None


def matrix_frequencies(text, supports, limit, folder):
    """Frequencies of a model from the matrices that CalculiX writes: its Lanczos iteration misses the lowest of few motions, and of plates
    that are held at few points. None where there are no matrices or they are too large."""
    (folder / "asked.inp").write_text(text + "\n*STEP\n*FREQUENCY,SOLVER=MATRIXSTORAGE\n2\n" + "\n".join(supports) + "\n*END STEP\n")
    if run(["ccx", "asked"], limit, folder) is None or not (folder / "asked.sti").exists():
        return None
    pair = []
    for ending in (".sti", ".mas"):
        table = numpy.loadtxt(folder / ("asked" + ending), ndmin=2)
        if not len(table) or table[:, 0].max() > 40000:
            return None
        rows, columns = table[:, 0].astype(int) - 1, table[:, 1].astype(int) - 1
        off = rows != columns
        size = max(rows.max(), columns.max()) + 1
        values = numpy.concatenate([table[:, 2], table[off, 2]])
        places = (numpy.concatenate([rows, columns[off]]), numpy.concatenate([columns, rows[off]]))
        pair.append(scipy.sparse.csc_matrix((values, places), shape=(size, size)))
    # What has neither stiffness nor mass does nothing.
    acts = numpy.flatnonzero((abs(pair[0]).max(axis=0).toarray()[0] > 0) | (abs(pair[1]).max(axis=0).toarray()[0] > 0))
    stiffness, mass = (matrix[acts][:, acts] for matrix in pair)
    # Inner motions of elements have no mass: the inverse problem, shifted so that rigid motions do not matter.
    shift = 1e-6 * stiffness.diagonal().sum() / max(mass.diagonal().sum(), 1e-300)
    shifted = (stiffness + shift * mass).tocsc()
    try:
        if len(acts) < 1500:
            inverse = scipy.linalg.eigh(mass.toarray(), shifted.toarray(), eigvals_only=True)[::-1]
        else:
            solve = scipy.sparse.linalg.splu(shifted, permc_spec="MMD_AT_PLUS_A").solve
            operator = scipy.sparse.linalg.LinearOperator(shifted.shape, solve)
            inverse = scipy.sparse.linalg.eigsh(mass, MODES + 6, shifted, Minv=operator, which="LA", return_eigenvectors=False)[::-1]
            inverse = numpy.sort(inverse)[::-1]
    except (numpy.linalg.LinAlgError, ValueError, RuntimeError):
        return None
    values = [1 / v - shift for v in inverse[: MODES + 6] if v > 1e-12 * inverse[0]]
    return [math.sqrt(v) / (2 * math.pi) if v > 1e-6 * shift else 0.0 for v in values]


def ccx_run(text, supports, modes, limit, folder):
    """Frequencies of a model's text with these supports; None where CalculiX finds none."""
    (folder / "asked.inp").write_text(text + f"\n*STEP\n*FREQUENCY\n{modes}\n" + "\n".join(supports) + "\n*END STEP\n")
    (folder / "asked.dat").unlink(missing_ok=True)
    if run(["ccx", "asked"], limit, folder) is None or not (folder / "asked.dat").exists():
        return None
    found = []
    for line in (folder / "asked.dat").read_text(errors="replace").splitlines():
        words = line.split()
        if len(words) == 5 and words[0].isdigit():
            try:
                found.append(float(words[3]))
            except ValueError:
                break
        elif found:
            break
    return found or None


def density_for(deck):
    """The density of steel in the deck's units as its first modulus tells: CalculiX needs frequencies well above a hertz."""
    found = re.search(r"(?im)^\*\s*ELASTIC[^\n]*\n\s*([-+.\dEeDd]+)", "\n".join(logical_lines(deck)))
    return "7.8e-9" if found and float(re.sub("[Dd]", "e", found.group(1))) < 1e8 else "7800"


def one(flexframe, deck, limit, with_ccx, kept=None):
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        row = reduce(flexframe, deck, folder, limit)
        without = density_for(deck) if any("--density" in r for r in row["reasons"]) else None
        options = ["--density", without] if without else []
        if without:
            row = reduce(flexframe, deck, folder, limit, *options)
        fewer = re.search(r"the model has (\d+)$|only (\d+) of \d+ modes", " ".join(row["reasons"]))
        if fewer and (count := int(fewer.group(1) or fewer.group(2))) > 0:
            row = reduce(flexframe, deck, folder, limit, *options, modes=count)
        if row["answer"] == "accepted" and without:
            row["answer"] = "accepted (--density)"
        row["deck"], row["path"], row["difference"] = deck.name, str(deck), None
        if row.get("frequencies"):
            theirs = None
            if deck.suffix.lower() != ".inp":
                theirs = f06_frequencies(deck)
            elif with_ccx:
                theirs = kept_frequencies(deck, folder, limit, without, kept)
            row["theirs"] = theirs
            if theirs and len(theirs) > row["rigid"]:
                pairs = list(zip(row["frequencies"], theirs[row["rigid"] :]))
                row["difference"] = max(abs(a - b) / b if b > 0 else float("inf") for a, b in pairs)
    return row


def explained(row):
    """What our side says of a row whose frequencies are others: warnings (units aside, which are no cause), notes of other elements."""
    told = [w for w in row["warnings"] if "which no solid has" not in w] + [
        n for n in row["notes"] if "CalculiX makes" in n or "Nastran lumps" in n or "C3D8R" in n
    ]
    return "; ".join(re.sub(r"^\S+?:(\d+:)? ", "", t).replace("|", "/")[:150] for t in told)


def reason(text):
    """A reason without the place, numbers and names that are this deck's own."""
    text = re.sub(r"^\S+?:(\d+:)? ", "", text)
    text = re.sub(r"'[^']*'", "'...'", text)
    return re.sub(r"(?<![A-Za-z0-9])-?\d[\d.e+-]*", "#", text)[:160]


def decks_of(folders, only, sample):
    """Paths of the decks below the folders, each text once; every n-th of them where a sample is asked for."""
    found, seen = [], set()
    for deck in sorted(d for f in folders for d in pathlib.Path(f).resolve().rglob("*") if d.is_file() and only in str(d)):
        ending = deck.suffix.lower()
        if ending not in (".inp", ".bdf", ".nas", ".dat"):
            continue
        content = deck.read_bytes()
        if ending == ".dat" and not re.search(rb"(?im)^BEGIN +BULK", content):
            continue
        if ending == ".inp" and not re.search(rb"(?im)^\*\s*(NODE|INCLUDE|PART)", content):
            continue
        digest = hashlib.md5(content).digest()
        if digest not in seen:
            seen.add(digest)
            found.append(deck)
    if sample and sample < len(found):
        found = [found[i * len(found) // sample] for i in range(sample)]
    return found


def summary(rows):
    """Lines that count the rows."""
    accepted = [r for r in rows if r["answer"].startswith("accepted")]
    compared = [r for r in accepted if r["difference"] is not None]
    off = [r for r in compared if r["difference"] > AGREES]
    return [
        f"{len(accepted)} of {len(rows)} accepted",
        f"{len(compared)} compared with CalculiX or Nastran: {len(compared) - len(off)} within {AGREES:.0%}, {len(off)} not, "
        f"{sum(not explained(r) for r in off)} of these without a word about it",
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flexframe")
    parser.add_argument("folders", nargs="+")
    parser.add_argument("--write")
    parser.add_argument("--json", help="everything that was found, for a closer look")
    parser.add_argument("--reasons", action="store_true")
    parser.add_argument("--no-ccx", action="store_true")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--limit", type=float, default=30.0)
    parser.add_argument("--only", default="")
    parser.add_argument("--sample", type=int, default=0)
    parser.add_argument("--kept", type=pathlib.Path)
    words = parser.parse_args()
    flexframe = str(pathlib.Path(words.flexframe).resolve())
    decks = decks_of(words.folders, words.only, words.sample)
    with_ccx = not words.no_ccx and shutil.which("ccx") is not None
    rows, lines = [], []
    if words.kept:
        words.kept = words.kept.resolve()
        words.kept.mkdir(exist_ok=True)
    with concurrent.futures.ThreadPoolExecutor(words.jobs) as pool:
        for row in pool.map(lambda d: one(flexframe, d, words.limit, with_ccx, words.kept), decks):
            rows.append(row)
            shown = "" if row["difference"] is None else f"{row['difference']:.1e}"
            answer = row["answer"] + (": " + row["reasons"][0].replace("|", "/")[:200] if row["reasons"] else "")
            if row["difference"] is not None and row["difference"] > AGREES:
                answer += "; told: " + (explained(row) or "nothing")
            lines.append(f"| {row['deck']} | {answer} | {shown} |")
            print(lines[-1], flush=True)
    if words.json:
        pathlib.Path(words.json).write_text(json.dumps(rows, indent=1))
    if words.reasons:
        counts = collections.Counter(kind for r in rows for kind in {reason(text) for text in r["reasons"]})
        for kind, count in counts.most_common():
            print(f"{count:5d}  {kind}")
    last = summary(rows)
    if words.write:
        head = ["| deck | answer | largest difference of frequencies to CalculiX or Nastran |", "|---|---|---|"]
        pathlib.Path(words.write).write_text("\n".join([*head, *lines, "", *last, ""]))
    print("\n".join(last))
    return 0


if __name__ == "__main__":
    sys.exit(main())
