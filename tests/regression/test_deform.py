"""flexframe deform through the real program: the seed's plate, tables of other programs, and what goes wrong."""
import math
import os
import subprocess
import sys
import tempfile

program = sys.argv[1]
failures = 0


def check(condition, what):
    global failures
    if not condition:
        failures += 1
        print("FAILED:", what)


def run(*words):
    return subprocess.run([program, "deform", *words], capture_output=True, text=True)


def plate():
    lines = ["v %.17g %.17g 0" % (i / 10, 1.3 * j / 14) for j in range(15) for i in range(11)]
    lines += ["f %d %d %d %d" % (a, a + 1, a + 12, a + 11) for j in range(14) for i in range(10) for a in [11 * j + i + 1]]
    return "\n".join(lines) + "\n"


def read(path):
    rows = open(path).read().split()
    check(rows[0] == "ux,uy,uz", "header of the CSV")
    return [[float(x) for x in r.split(",")] for r in rows[1:]]


with tempfile.TemporaryDirectory() as folder:
    def file(name, text):
        path = os.path.join(folder, name)
        with open(path, "w") as out:
            out.write(text)
        return path

    mesh = file("plate.obj", plate())
    corners = "0,0,0,0,0,0\n1,0,0,0,0,0\n0,1.3,0,0,0,0\n1,1.3,0,0,0,%s\n"
    nodes = file("nodes.csv", "x,y,z,ux,uy,uz\n" + corners % "1")
    out = os.path.join(folder, "out.csv")

    result = run("--nodes", nodes, "--mesh", mesh, "-o", out)
    check(result.returncode == 0, "plate: " + result.stderr)
    for word in ("scheme", "Lebesgue", "leave-one-out", "time"):
        check(word in result.stdout, "report tells " + word)
    u = read(out)
    check(len(u) == 165, "one line a vertex")
    check(abs(u[5 + 77][2] - 0.25) < 1e-9, "centre is a quarter")
    check(abs(u[10 + 77][2] - 0.5) < 1e-9 and abs(u[5 + 154][2] - 0.5) < 1e-9, "edges at the moved corner are a half")
    check(all(abs(w[2] - (i % 11) / 10 * (i // 11) / 14) < 0.02 for i, w in enumerate(u)), "bilinear within 0.02")

    # The same nodes as another program would write them.
    other = file("other.csv", '\ufeff"Node ID";"X [m]";"Y [m]";"Z [m]";"U_x";"U_y";"U_z"\r\n' + "".join(
        "%d;%s\r\n" % (k, line.replace(",", ";").replace(".", ",")) for k, line in enumerate((corners % "1").split())))
    second = os.path.join(folder, "second.csv")
    result = run("--nodes", other, "--mesh", mesh, "-o", second)
    check(result.returncode == 0 and read(second) == u, "semicolons, decimal commas, units, quotes: " + result.stderr)

    moved = os.path.join(folder, "moved.obj")
    result = run("--nodes", nodes, "--mesh", mesh, "-o", moved, "--scale", "0.5")
    z = [float(line.split()[3]) for line in open(moved) if line.startswith("v ")]
    check(len(z) == 165 and abs(z[164] - 0.5) < 1e-12, "OBJ with half the displacement")

    def wrong(what, words, needle):
        target = os.path.join(folder, "wrong.csv")
        result = run(*words, "-o", target)
        check(result.returncode == 2, "%s: exit %d" % (what, result.returncode))
        check(needle in result.stderr, "%s: %s" % (what, result.stderr))
        check(not os.path.exists(target), what + " leaves no file")

    wrong("NaN", ["--nodes", file("nan.csv", "x,y,z,ux,uy,uz\n" + corners % "nan"), "--mesh", mesh], "nan.csv:5: uz")
    wrong("no nodes", ["--nodes", file("none.csv", "x,y,z,ux,uy,uz\n"), "--mesh", mesh], "no nodes")
    wrong("empty", ["--nodes", file("empty.csv", ""), "--mesh", mesh], "header line")
    wrong("no header", ["--nodes", file("bare.csv", corners % "1"), "--mesh", mesh], "header line")
    wrong("missing column", ["--nodes", file("column.csv", "x,y,z,ux,uy\n0,0,0,0,0\n"), "--mesh", mesh], "'uz'")
    wrong("millimetres", ["--nodes", file("mm.csv", "x,y,z,ux,uy,uz\n0,0,0,0,0,0\n1000,0,0,0,0,0\n0,1300,0,0,0,0\n1000,1300,0,0,0,1\n"), "--mesh", mesh], "units")
    wrong("no faces", ["--nodes", nodes, "--mesh", file("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n")], "no face")
    wrong("no mesh", ["--nodes", nodes, "--mesh", os.path.join(folder, "missing.obj")], "no such")
    wrong("scheme", ["--nodes", nodes, "--mesh", mesh, "--scheme", "spline"], "kernel")
    result = run("--nodes", nodes, "--mesh", mesh, "-o", os.path.join(folder, "out.txt"))
    check(result.returncode == 2, "unknown kind of output")

print("test_deform:", "failed" if failures else "passed")
sys.exit(1 if failures else 0)
