#!/usr/bin/env python3
"""Measures of the kernel map: error by number of nodes, `auto` as a user gets it, on bodies whose motion is known without it.

  measures.py FOLDER            writes measures.csv and measures.svg there and prints the page's table (ninja measures_interp)
  measures.py --unseen [SETS [SEED]]   auto and kernel against one global r^3 kernel on random and uneven sets of nodes: ratio of errors

PYTHONPATH: the folder of the module flexframe (build/clang/python). Needs numpy; the figure needs matplotlib.
"""

import pathlib
import sys

import numpy as np

import bodies

MEASURES = [
    ("con rod", lambda n: bodies.fe_body("conrod", n), (8, 20, 40, 60, 97, 200)),
    ("fork", lambda n: bodies.fe_body("fork", n), (8, 20, 40, 60, 97, 200)),
    ("chassis", lambda n: bodies.fe_body("channel", n), (8, 20, 40, 60, 97, 200)),
    ("ring", bodies.ring, (6, 8, 12, 16, 24, 64)),
    ("quarter circle", bodies.quarter_circle, (4, 6, 8, 12, 24, 64)),
    ("thin plate", lambda n: bodies.thin_plate(n, cells=(30, 24)), (8, 20, 40, 60, 97, 200)),
    ("thin shell", lambda n: bodies.thin_shell(n, "outer face"), (8, 20, 40, 60, 97, 200)),
    ("thin tube", lambda n: bodies.thin_tube(n, "outer face"), (8, 20, 40, 60, 97, 200)),
    ("two plates", bodies.two_plates, (8, 16, 24, 40, 97, 200)),
]


def rows():
    """(body, nodes, error of displacements, error of normals, scheme) of every measure."""
    for name, make, counts in MEASURES:
        for count in counts:
            error, normals, kernel = bodies.measure(make(count))
            print(
                f"{name:16} {count:4} nodes  displacement {100 * error:8.3g} %  normals {100 * normals:8.3g} %  {kernel.scheme}", flush=True
            )
            yield name, count, error, normals, kernel.scheme


def draw(table, file):
    """Both errors over the number of nodes, a line for each body."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "flexframe", "font.family": "DejaVu Sans", "svg.fonttype": "none"})
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(12, 4.6), sharex=True, sharey=True)
    for name, _, _ in MEASURES:
        own = [r for r in table if r[0] == name]
        for axis, column in zip(axes, (2, 3)):
            axis.loglog([r[1] for r in own], [100 * r[column] for r in own], "o-", markersize=4, label=name)
    for axis, title in zip(axes, ("displacements", "turns of the normals")):
        axis.set_title(title)
        axis.set_xlabel("simulation nodes")
        axis.grid(True, which="major", color="#ddd")
        axis.axhline(0.5, color="#888", linewidth=1, linestyle="--")
        axis.set_xticks([4, 8, 16, 32, 64, 128], ["4", "8", "16", "32", "64", "128"])
        axis.minorticks_off()
    axes[0].set_ylabel("relative L2 error, %")
    axes[0].set_yticks([0.001, 0.01, 0.1, 1, 10, 100], ["0.001", "0.01", "0.1", "1", "10", "100"])
    axes[1].legend(frameon=False, fontsize=9, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.tight_layout()
    figure.savefig(file, metadata={"Date": None})


def unseen(sets, seed=11):
    """Random sets of nodes: drawn evenly, in clusters, or along one side of the body, on the three finite element bodies."""
    rng = np.random.default_rng(seed)
    worst = {"auto": [], "kernel": []}
    for k in range(sets):
        name = ("conrod", "fork", "channel")[k % 3]
        whole = bodies.fe_body(name, 4)
        count = int(rng.choice([20, 40, 70, 97, 150]))
        weight = np.ones(len(whole.vertices))
        if k % 2:
            near = whole.vertices[rng.integers(len(weight))]
            reach = 0.3 * np.linalg.norm(np.ptp(whole.vertices, axis=0))
            weight += 8.0 * np.exp(-np.sum((whole.vertices - near) ** 2, axis=1) / reach**2)
        pick = np.sort(rng.choice(len(weight), count, replace=False, p=weight / weight.sum()))
        case = bodies.fe_body(name, pick=pick)
        plain = bodies.measure(case, "r3")[0]
        for scheme in worst:
            error, _, kernel = bodies.measure(case, scheme)
            worst[scheme].append(error / plain)
            found = f"{scheme:7} {kernel.scheme:8} {100 * error:8.3g} % r3 {100 * plain:8.3g} % ratio {error / plain:.2f}"
            print(f"{name:8} {count:4} {'clustered' if k % 2 else 'even':9} {found}", flush=True)
    for scheme, ratios in worst.items():
        worse = sum(r > 1.0 for r in ratios)
        print(f"{scheme}: ratio median {np.median(ratios):.2f}, largest {max(ratios):.2f}, above 1 in {worse} of {sets}")


def main():
    if len(sys.argv) > 1 and sys.argv[1] == "--unseen":
        unseen(*[int(word) for word in sys.argv[2:]] or [200])
        return
    folder = pathlib.Path(sys.argv[1])
    table = list(rows())
    with open(folder / "measures.csv", "w", encoding="utf-8") as file:
        file.write("body,nodes,displacement,normals,scheme\n")
        for name, count, error, normals, scheme in table:
            file.write(f"{name},{count},{error:.4g},{normals:.4g},{scheme}\n")
    print("| body | nodes: displacements / normals |\n|---|---|")
    for name, _, _ in MEASURES:
        cells = [f"{r[1]}: {100 * r[2]:.2g} / {100 * r[3]:.2g}" for r in table if r[0] == name]
        print(f"| {name} | {'; '.join(cells)} |")
    draw(table, folder / "measures.svg")


if __name__ == "__main__":
    main()
