#!/usr/bin/env python3
"""Finite element decks of others, reduced and drawn: a body, a picture of an elastic mode and a row of a table each.

    draw_decks.py FLEXFRAME OUT DECK [OPTION...] [-- DECK [OPTION...]]...

OPTIONs are those of `flexframe reduce` for the deck before them: --units, --material, --thickness ... The lowest elastic mode is drawn by
`flexframe modes`, its picture at a quarter of the period is OUT/NAME.png. Prints a table in Markdown: name, nodes, elements, rigid motions,
lowest frequency, mass, CPU seconds of reading to writing; of a refused deck its reason. No text of any deck.
"""
import json
import pathlib
import re
import resource
import shutil
import subprocess
import sys


def groups(words):
    """Lists of words between '--'."""
    out = [[]]
    for word in words:
        if word == "--":
            out.append([])
        else:
            out[-1].append(word)
    return [g for g in out if g]


def cpu():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def draw(flexframe, folder, name):
    """The second of four pictures of a period: the mode at its largest."""
    pictures = folder / "pictures"
    words = ["modes", "body.h5", "--mode", "1", "--pictures", "4", "--size", "640x400", "--no-video", "-q", "-o", str(pictures)]
    done = subprocess.run([flexframe, *words], cwd=folder, capture_output=True, text=True)
    found = sorted(pictures.rglob("*.png"))
    if done.returncode != 0 or len(found) < 2:
        return f"not drawn: {done.stderr.strip()[-200:]}"
    shutil.copy(found[1], folder.parent / f"{name}.png")
    return "drawn"


def row(flexframe, out, deck, options):
    deck = pathlib.Path(deck).resolve()
    name = deck.name.replace(".", "_")
    folder = out / f"{name}.work"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    before = cpu()
    words = [
        "reduce",
        str(deck),
        "-o",
        "body.h5",
        "--method",
        "eigen",
        "--modes",
        "6",
        "--no-stiffening",
        "--cache",
        "none",
        "--json",
        "-q",
    ]
    done = subprocess.run([flexframe, *words, *options], cwd=folder, capture_output=True, text=True, errors="replace")
    seconds = cpu() - before
    said = " ".join(options)
    if done.returncode != 0:
        lines = [line for line in done.stderr.splitlines() if "error" in line.lower()] or done.stderr.splitlines() or ["?"]
        reason = re.sub(r"^(flexframe: )?error: ", "", lines[0]).replace(str(deck.parent) + "/", "").replace("|", "/")
        return f"| {deck.name} | {said} | refused: {reason} | | | | {seconds:.1f} |"
    made = json.loads(done.stdout)
    report = (folder / "body.md").read_text()
    nodes, elements = re.search(r"(\d+) nodes, (\d+) elements", report).groups()
    drawn = draw(flexframe, folder, name)
    return (
        f"| {deck.name} | {said} | {drawn} | {nodes}, {elements} | {made['rigid_motions']} | {made['frequencies'][0]:.4g} Hz, "
        f"{made['mass']:.4g} kg | {seconds:.1f} |"
    )


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    flexframe, out = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2]).resolve()
    out.mkdir(parents=True, exist_ok=True)
    print("| deck | options | answer | nodes, elements | rigid motions | lowest mode, mass | CPU s |\n|---|---|---|---|---|---|---|")
    for deck, *options in groups(sys.argv[3:]):
        print(row(flexframe, out, deck, options), flush=True)


if __name__ == "__main__":
    main()
