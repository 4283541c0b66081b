"""What the reducer costs against CalculiX: the con rod of assets/ meshed finer and finer, 16 modes of the free body, everything from
reading the mesh to writing the results. CPU seconds (user + system of the process) and largest memory; the two programs take turns on
each mesh, the best of the repeats counts.

    python3 tests/bench/sim/reduce_cost.py build/clang/flexframe [--sizes 15,60,181] [--repeats 2] [--large] [--write sim/reduce]

--sizes: thousands of degrees of freedom. --large adds a mesh of a million, which only flexframe reduces. --write DIR: puts the table
between the marks of DIR/REDUCE.md and the plot into DIR/cost.svg. Needs gmsh and CalculiX (Debian packages gmsh, calculix-ccx).
"""
import argparse
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

source = pathlib.Path(__file__).resolve().parents[3]
modes = 16


def cost(words, folder):
    """CPU seconds and bytes of one run, by the kernel's account of the child."""
    with open(folder / "log.txt", "w") as log:
        child = subprocess.Popen(words, cwd=folder, stdout=log, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL)
        _, status, used = os.wait4(child.pid, 0)
    if status != 0:
        sys.exit(f"{' '.join(map(str, words))}: status {status}\n{(folder / 'log.txt').read_text()[-2000:]}")
    return used.ru_utime + used.ru_stime, 1024.0 * used.ru_maxrss


def mesh(folder, scale):
    """The con rod with elements `scale` times as large: name.inp for both programs; degrees of freedom."""
    subprocess.run(
        ["gmsh", "-3", "-format", "msh2", "-clscale", repr(scale), source / "assets/conrod/conrod.geo", "-o", folder / "rod.msh"],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    nodes, elements, used = [], [], set()
    section = ""
    for line in open(folder / "rod.msh"):
        if line.startswith("$"):
            section = line.strip()
        elif section == "$Nodes" and line.count(" ") >= 3:
            nodes.append(line.split())
        elif section == "$Elements":
            word = line.split()
            if len(word) > 10 and word[1] == "11":
                n = word[-10:]
                elements.append([word[0]] + n[:8] + [n[9], n[8]])
                used.update(n)
    with open(folder / "rod.inp", "w") as out:
        out.write("*NODE, NSET=ALL\n")
        # CalculiX takes numbers of at most 20 characters.
        out.writelines(f"{i}, {float(x):.11g}, {float(y):.11g}, {float(z):.11g}\n" for i, x, y, z in nodes if i in used)
        out.write("*ELEMENT, TYPE=C3D10, ELSET=ROD\n")
        out.writelines(", ".join(e) + "\n" for e in elements)
        out.write(
            "*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7850\n*SOLID SECTION, ELSET=ROD, MATERIAL=STEEL\n"
            f"*STEP\n*FREQUENCY\n{modes + 6}\n*NODE FILE\nU\n*END STEP\n"
        )
    return 3 * len(used)


def frequencies_of_calculix(folder):
    out = []
    for line in open(folder / "rod.dat"):
        word = line.split()
        if len(word) == 5 and word[0].isdigit():
            out.append(float(word[3]))
        elif out and "P A R T I C I P" in line:
            break
    return [f for f in out if f > 1.0]


def plot(rows, path):
    """Seconds against degrees of freedom, both logarithmic."""
    width, height, left, bottom = 640, 400, 70, 50
    sizes = [r["dof"] for r in rows]
    times = [r[k][0] for r in rows for k in ("calculix", "flexframe") if r[k]]
    low_x, high_x = math.log10(min(sizes)) - 0.1, math.log10(max(sizes)) + 0.1
    low_y, high_y = math.floor(math.log10(min(times))), math.ceil(math.log10(max(times)))
    px = lambda v: left + (math.log10(v) - low_x) / (high_x - low_x) * (width - left - 20)
    py = lambda v: height - bottom - (math.log10(v) - low_y) / (high_y - low_y) * (height - bottom - 20)
    s = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="13">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
    ]
    for e in range(low_y, high_y + 1):
        y = py(10**e)
        s.append(
            f'<line x1="{left}" x2="{width - 20}" y1="{y:.1f}" y2="{y:.1f}" stroke="#ddd"/><text x="{left - 8}" y="{y + 4:.1f}"'
            f' text-anchor="end">{10.0**e:g}</text>'
        )
    for v in (10000, 30000, 100000, 300000, 1000000):
        if low_x <= math.log10(v) <= high_x:
            s.append(
                f'<line x1="{px(v):.1f}" x2="{px(v):.1f}" y1="20" y2="{height - bottom}" stroke="#ddd"/><text x="{px(v):.1f}"'
                f' y="{height - bottom + 18}" text-anchor="middle">{v // 1000}k</text>'
            )
    for name, colour in (("calculix", "#b04020"), ("flexframe", "#2050a0")):
        points = [(px(r["dof"]), py(r[name][0])) for r in rows if r[name]]
        s.append(f'<polyline fill="none" stroke="{colour}" stroke-width="2" points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in points)}"/>')
        s += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colour}"/>' for x, y in points]
        label = "CalculiX 2.20" if name == "calculix" else "flexframe reduce"
        s.append(f'<text x="{points[-1][0] - 8:.1f}" y="{points[-1][1] - 8:.1f}" fill="{colour}" text-anchor="end">{label}</text>')
    s.append(f'<text x="{(left + width) / 2}" y="{height - 12}" text-anchor="middle">degrees of freedom</text>')
    s.append(f'<text x="18" y="{height / 2}" text-anchor="middle" transform="rotate(-90 18 {height / 2})">CPU seconds</text></svg>')
    pathlib.Path(path).write_text("\n".join(s) + "\n")


def memory(b):
    return f"{b / 1e9:.2f} GB" if b >= 1e9 else f"{b / 1e6:.0f} MB"


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("flexframe", type=lambda f: pathlib.Path(f).resolve())
    p.add_argument("--sizes", default="15,60,181")
    p.add_argument("--repeats", type=int, default=2)
    p.add_argument("--large", action="store_true")
    p.add_argument("--write", type=pathlib.Path)
    words = p.parse_args()
    for program in ("gmsh", "ccx"):
        if not shutil.which(program):
            sys.exit(f"{program} is not there (Debian packages gmsh, calculix-ccx)")
    wanted = [(1000 * float(s), True) for s in words.sizes.split(",")] + ([(1.0e6, False)] if words.large else [])
    rows = []
    with tempfile.TemporaryDirectory(prefix="flexframe_bench_") as name:
        folder = pathlib.Path(name)
        for size, compared in wanted:
            # Degrees of freedom go with the cube of the element size, by and by.
            scale = (15252 / size) ** (1 / 3)
            for _ in range(4):
                dof = mesh(folder, scale)
                if abs(dof - size) <= 0.01 * size:
                    break
                scale *= (dof / size) ** (1 / 3)
            row = {"dof": dof, "calculix": None, "flexframe": None}
            reduce = [words.flexframe, "reduce", "rod.inp", "-o", "rod.sid", "--modes", str(modes), "--quiet"]
            for turn in range(words.repeats if compared else 1):
                for program, command in (("calculix", ["ccx", "rod"]), ("flexframe", reduce)):
                    if program == "calculix" and not compared:
                        continue
                    used = cost(command, folder)
                    print(f"{dof} degrees of freedom, turn {turn + 1}: {program} {used[0]:.2f} s, {memory(used[1])}", flush=True)
                    if row[program] is None or used[0] < row[program][0]:
                        row[program] = used
            ours = [
                float(line.split("|")[2])
                for line in open(folder / "rod.md")
                if line.startswith("| ") and line.split("|")[1].strip().isdigit()
            ]
            if compared:
                theirs = frequencies_of_calculix(folder)
                row["difference"] = max(abs(a / b - 1) for a, b in zip(ours, theirs))
                if len(theirs) < modes:
                    sys.exit(f"CalculiX gave {len(theirs)} of {modes} frequencies")
            rows.append(row)
    lines = ["| degrees of freedom | CalculiX | flexframe reduce | ratio | frequencies differ by at most |", "|---|---|---|---|---|"]
    for r in rows:
        c, f = r["calculix"], r["flexframe"]
        lines.append(
            f"| {r['dof']} | "
            + (f"{c[0]:.1f} s, {memory(c[1])}" if c else "")
            + f" | {f[0]:.1f} s, {memory(f[1])} | "
            + (f"{c[0] / f[0]:.1f} | {r['difference']:.1e} |" if c else "| |")
        )
    table = "\n".join(lines)
    print(table)
    if words.write:
        page = words.write / "REDUCE.md"
        text = page.read_text()
        begin, end = "<!-- cost -->\n", "<!-- end -->"
        i, j = text.index(begin) + len(begin), text.index(end)
        page.write_text(text[:i] + table + "\n" + text[j:])
        plot(rows, words.write / "cost.svg")


if __name__ == "__main__":
    main()
