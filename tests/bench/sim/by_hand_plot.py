#!/usr/bin/env python3
"""Draws the rows of bench_by_hand and writes their page:  by_hand_plot.py ROWS.csv FOLDER  (ninja work_precision)

FOLDER gets work_precision.csv, work_precision.svg (CPU time over error, a panel for each mechanism) and README.md with the CPU time at
equal error: read from each curve by straight lines between its points in logarithms, on the least CPU time that reaches the error.
"""

import csv
import math
import pathlib
import shutil
import sys

SIDES = {"by hand": ("#c1121f", "minimal equations by hand"), "scene, auto": ("#2a6f97", "scene, method auto")}
ERRORS = (1e-3, 1e-5, 1e-7)


def front(points):
    """The points that nothing cheaper beats, from the largest error to the smallest."""
    best, out = math.inf, []
    for error, seconds in sorted(points, key=lambda p: p[1]):
        if error < best:
            best = error
            out.append((error, seconds))
    return out


def seconds_at(points, error):
    """CPU time at which the front reaches the error, s; None where it does not."""
    line = front(points)
    if error >= line[0][0]:
        return line[0][1]
    for (e0, s0), (e1, s1) in zip(line, line[1:]):
        if e1 <= error <= e0:
            share = math.log(e0 / error) / math.log(e0 / e1)
            return s0 * (s1 / s0) ** share
    return None


def draw(table, file):
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "flexframe", "font.family": "DejaVu Sans", "svg.fonttype": "none", "font.size": 9})
    import matplotlib.pyplot as plt

    names = list(table)
    figure, axes = plt.subplots(1, len(names), figsize=(3.1 * len(names), 3.6), sharex=True, sharey=True)
    for axis, name in zip(axes, names):
        for side, (colour, label) in SIDES.items():
            points = table[name][side]
            axis.loglog([e for e, _, _ in points], [1e3 * s for _, s, _ in points], "o-", markersize=3.5, color=colour, label=label)
        axis.set_title(name)
        axis.set_xlabel("error, share of the range")
        axis.grid(True, which="major", color="#ddd")
        axis.set_xticks([1e-2, 1e-4, 1e-6, 1e-8, 1e-10])
        axis.minorticks_off()
    axes[0].invert_xaxis()
    axes[0].set_ylabel("CPU time, ms")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncol=2, frameon=False)
    figure.tight_layout(rect=(0, 0.08, 1, 1))
    figure.savefig(file, metadata={"Date": None})


def page(table):
    lines = [
        "# Against equations written by hand",
        "",
        "What does it cost to let a general program set up the equations? Five mechanisms, once as a scene and once as a",
        "specialist writes them for this one mechanism in minimal coordinates, both integrated by CVODE's Adams method with",
        "fixed-point iteration (what `auto` takes here). Errors are relative to the output's range, against each side's own run",
        "at 1e-13; these two references differ by less than 1e-9 of the range. Set-up, which a scene pays once, and the estimate",
        "of the error are not in the times. Made by `ninja work_precision`.",
        "",
        "![CPU time over error](work_precision.svg)",
        "",
        "CPU time in ms at equal error, by hand and as a scene, and their ratio; then microseconds an evaluation, everything included.",
        "",
        "| mechanism | " + " | ".join(f"{e:.0e}" for e in ERRORS) + " | by hand | scene |",
        "|---|" + "---|" * (len(ERRORS) + 2),
    ]
    for name, sides in table.items():
        cells = []
        for error in ERRORS:
            hand, ours = (seconds_at([(e, s) for e, s, _ in sides[side]], error) for side in SIDES)
            cells.append("-" if hand is None or ours is None else f"{1e3 * hand:.2g} / {1e3 * ours:.2g} = {ours / hand:.1f}")
        for side in SIDES:
            cells.append(f"{1e6 * min(s / n for _, s, n in sides[side]):.2g}")
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    lines += [
        "",
        "The hand-written sides know what a program cannot see from a scene: that the top's spin is constant and drops out (a",
        "scene integrates its 32 turns), and that the rigid motion of the elastic slider-crank is known beforehand. An evaluation",
        "by hand costs little more than CVODE's own work for it.",
        "",
    ]
    return "\n".join(lines)


def main():
    rows, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    table = {}
    with rows.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            sides = table.setdefault(row["mechanism"], {side: [] for side in SIDES})
            if row["equations"] in sides:
                sides[row["equations"]].append((float(row["error"]), float(row["seconds"]), int(row["evaluations"])))
    shutil.copyfile(rows, folder / "work_precision.csv")
    draw(table, folder / "work_precision.svg")
    (folder / "README.md").write_text(page(table), encoding="utf-8")


if __name__ == "__main__":
    main()
