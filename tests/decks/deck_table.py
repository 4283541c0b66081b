#!/usr/bin/env python3
"""Folders of finite element decks through `flexframe reduce`, and through CalculiX where it is there.

    deck_table.py FLEXFRAME FOLDER... [--write TABLE.md] [--no-ccx] [--jobs N] [--limit SECONDS] [--only TEXT]

Every .inp, .bdf and .nas below the folders is reduced to its first six modes with its own units, supports as the deck has them. A deck
without density is tried once more with --density 7800, a beside-the-point number that CalculiX then gets too. CalculiX computes the same
model: everything before the first *STEP and the supports of that step, followed by a *FREQUENCY step of its own. The table holds names,
answers and the largest difference of the frequencies, no text of any deck; the last lines count them.
"""
import argparse
import concurrent.futures
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

MODES = 6


def run(command, limit, folder):
    try:
        return subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=limit, cwd=folder)
    except subprocess.TimeoutExpired:
        return None


def reduce(flexframe, deck, folder, limit, *options):
    """(answer, frequencies, rigid motions, notes): answer is 'accepted' or the refusal."""
    done = run(
        [flexframe, "reduce", str(deck), "-o", "body.sid", "--method", "eigen", "--modes", str(MODES), "--nodes", "2", "--no-stiffening"]
        + ["--memory", "4", "--json", "--quiet", *options],
        limit,
        folder,
    )
    if done is None:
        return "no answer in time", None, 0, []
    if done.returncode == 0:
        made = json.loads(done.stdout)
        return "accepted", made["frequencies"], made["rigid_motions"], made["notes"]
    if done.returncode < 0:
        return f"CRASH by signal {-done.returncode}", None, 0, []
    text = (done.stderr.strip().splitlines() or ["?"])[-1].replace(str(deck.parent) + "/", "")
    return text, None, 0, []


def ccx_frequencies(deck, folder, limit, density):
    """CalculiX' own frequencies of the same model, rigid motions among them; None where it has none."""
    for other in deck.parent.iterdir():  # what *INCLUDE may ask for
        if other.is_file() and other.stat().st_size < 2e8:
            (folder / other.name).symlink_to(other)
    model, supports, steps, keyword = [], [], 0, ""
    for line in deck.read_text(errors="replace").splitlines():
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
            else re.sub(r"(?im)^(?=\*\s*ELASTIC)", "*DENSITY\n7800.\n", b, count=1)
            for b in blocks
        )
    # CalculiX asks for fewer modes than a small model has: try less.
    for modes in (MODES + 6, 4, 1):
        (folder / "asked.inp").write_text(text + f"\n*STEP\n*FREQUENCY\n{modes}\n" + "\n".join(supports) + "\n*END STEP\n")
        (folder / "asked.dat").unlink(missing_ok=True)
        if run(["ccx", "asked"], limit, folder) is None:
            return None
        if not (folder / "asked.dat").exists():
            continue
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
        if found:
            return found
    return None


def one(flexframe, deck, limit, with_ccx):
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        answer, frequencies, rigid, notes = reduce(flexframe, deck, folder, limit)
        density = answer != "accepted" and "density" in answer and "--density" in answer
        if density:
            answer, frequencies, rigid, notes = reduce(flexframe, deck, folder, limit, "--density", "7800")
        difference = None
        if frequencies and with_ccx and deck.suffix.lower() == ".inp":
            theirs = ccx_frequencies(deck, folder, limit, density)
            if theirs and len(theirs) > rigid:
                pairs = list(zip(frequencies, theirs[rigid:]))
                difference = max(abs(a - b) / b if b > 0 else float("inf") for a, b in pairs)
    return answer + (" (--density)" if density and answer == "accepted" else ""), difference, notes


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flexframe")
    parser.add_argument("folders", nargs="+")
    parser.add_argument("--write")
    parser.add_argument("--no-ccx", action="store_true")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--limit", type=float, default=30.0)
    parser.add_argument("--only", default="")
    words = parser.parse_args()
    flexframe = str(pathlib.Path(words.flexframe).resolve())
    decks = sorted(
        d
        for f in words.folders
        for d in pathlib.Path(f).resolve().rglob("*")
        if d.suffix.lower() in (".inp", ".bdf", ".nas") and words.only in str(d)
    )
    with_ccx = not words.no_ccx and shutil.which("ccx") is not None
    rows = []
    with concurrent.futures.ThreadPoolExecutor(words.jobs) as pool:
        for deck, (answer, difference, notes) in zip(decks, pool.map(lambda d: one(flexframe, d, words.limit, with_ccx), decks)):
            shown = "" if difference is None else f"{difference:.1e}"
            rows.append(f"| {deck.name} | {answer.replace('|', '/')[:300]} | {shown} |")
            print(rows[-1], flush=True)
    accepted = sum("| accepted" in r for r in rows)
    text = "\n".join(
        [
            "| deck | answer | largest difference of frequencies to CalculiX |",
            "|---|---|---|",
            *rows,
            "",
            f"{accepted} of {len(rows)} accepted",
            "",
        ]
    )
    if words.write:
        pathlib.Path(words.write).write_text(text)
    print(f"{accepted} of {len(rows)} accepted")
    return 0


if __name__ == "__main__":
    sys.exit(main())
