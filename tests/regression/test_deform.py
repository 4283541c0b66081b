"""flexframe deform through the real program: a plate moved by its corners, tables of other programs, and what goes wrong."""
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

    # A tube that goes oval with three waves (Rayleigh): few nodes do not know how, and it is told about how far off the mesh is; with many
    # nodes nothing is told.
    def tube(columns, rows):
        def row(x, f):
            radial, along = 0.01 * math.cos(3 * f), -0.01 * math.sin(3 * f) / 3
            place = (x, 0.2 * math.sin(f), 0.2 * math.cos(f))
            return place, (0.0, radial * math.sin(f) + along * math.cos(f), radial * math.cos(f) - along * math.sin(f))

        return [row(0.8 * i / (columns - 1), 2 * math.pi * (k + 0.5 * (i % 2)) / rows) for i in range(columns) for k in range(rows)]

    tube_out = os.path.join(folder, "tube_out.csv")
    fine = tube(21, 48)
    tube_lines = ["v %.17g %.17g %.17g" % place for place, _ in fine]
    for i in range(20):
        for k in range(48):
            a, b, c, d = (48 * (i + p) + (k + q) % 48 + 1 for p, q in ((0, 0), (0, 1), (1, 0), (1, 1)))
            tube_lines += ["f %d %d %d" % t for t in (((a, b, d), (a, d, c)) if i % 2 else ((a, b, c), (b, d, c)))]
    tube_mesh = file("tube.obj", "\n".join(tube_lines) + "\n")
    for columns, around, told in ((3, 6, True), (7, 18, False)):
        table = "".join("%.17g,%.17g,%.17g,%.17g,%.17g,%.17g\n" % (*place, *shift) for place, shift in tube(columns, around))
        told_of = run("--nodes", file("tube.csv", "x,y,z,ux,uy,uz\n" + table), "--mesh", tube_mesh, "-o", tube_out)
        moved = read(tube_out)
        truth = [v for _, v in fine]
        off = math.sqrt(sum((a - b) ** 2 for g, w in zip(moved, truth) for a, b in zip(g, w)) / sum(b * b for w in truth for b in w))
        check(
            ("may be off by about" in told_of.stderr) == told, "tube, %d nodes, off by %.3g: %s" % (columns * around, off, told_of.stderr)
        )
        check((off > 0.05) == told, "tube, %d nodes: off by %.3g" % (columns * around, off))

    # The same nodes as another program would write them.
    other = file(
        "other.csv",
        '\ufeff"Node ID";"X [m]";"Y [m]";"Z [m]";"U_x";"U_y";"U_z"\r\n'
        + "".join("%d;%s\r\n" % (k, line.replace(",", ";").replace(".", ",")) for k, line in enumerate((corners % "1").split())),
    )
    second = os.path.join(folder, "second.csv")
    result = run("--nodes", other, "--mesh", mesh, "-o", second)
    check(result.returncode == 0 and read(second) == u, "semicolons, decimal commas, units, quotes: " + result.stderr)

    # Header lines of other programs, each with the same nodes: what it is called, the text, a word of the warning or none.
    rows = [line.split(",") for line in (corners % "1").split()]

    def table(head, line):
        return head + "\n" + "".join(line(k, row) + "\n" for k, row in enumerate(rows))

    heads = (
        ("other order, tabs", table("uz\tux\tuy\tz\ty\tx", lambda k, r: "\t".join((r[5], r[3], r[4], r[2], r[1], r[0]))), None),
        ("tabs and decimal commas", table("x\ty\tz\tux\tuy\tuz", lambda k, r: "\t".join(r).replace(".", ",")), None),
        ("a table of pandas with tabs", table("\tx\ty\tz\tux\tuy\tuz", lambda k, r: "%d\t" % k + "\t".join(r)), None),
        (
            "ParaView",
            table(
                '"Displacement:0","Displacement:1","Displacement:2","Points:0","Points:1","Points:2"', lambda k, r: ",".join(r[3:] + r[:3])
            ),
            None,
        ),
        (
            "Ansys",
            table(
                (
                    '"Node Number","X Location (m)","Y Location (m)","Z Location (m)","X Displacement (mm)","Y Displacement (mm)","Z'
                    ' Displacement (mm)"'
                ),
                lambda k, r: "%d," % (k + 1) + ",".join(r[:3]) + ",0,0," + str(1000 * float(r[5])),
            ),
            "multiplied by 0.001",
        ),
        ("Comsol", table("% Model: plate.mph\n% Dimension: 3\n% X,Y,Z,u (m),v (m),w (m)", lambda k, r: ",".join(r)), None),
        ("Abaqus", table("Node Label, X, Y, Z, U-U1, U-U2, U-U3", lambda k, r: "%d, " % (k + 1) + ", ".join(r)), None),
        ("blanks, a name with a comma in quotes", table('"Part, Instance",x,y,z,ux,uy,uz', lambda k, r: '"a, b",' + ",".join(r)), None),
        ("runs of blanks", table("  x   y z   ux uy uz", lambda k, r: "   " + "  ".join(r)), None),
        ("separators at the ends of lines", table("x,y,z,ux,uy,uz", lambda k, r: ",".join(r) + ",,"), None),
    )
    for what, text, note in heads:
        result = run("--nodes", file("head.csv", text), "--mesh", mesh, "-o", second)
        check(
            result.returncode == 0 and max(abs(p - q) for a, b in zip(read(second), u) for p, q in zip(a, b)) < 1e-12,
            what + ": " + result.stderr,
        )
        check(note is None or note in result.stderr, what + " warns: " + result.stderr)
    # Degrees are taken as radians.
    turned = ["0,0,0,0,0,0,0,0,%s", "1,0,0,0,0,0,0,0,%s", "0,1.3,0,0,0,0,0,0,%s", "1,1.3,0,0,0,0.01,0,0,%s"]
    for k, (unit, angle) in enumerate((("rad", 0.1), ("deg", math.degrees(0.1)))):
        head = "x,y,z,ux,uy,uz,rx [%s],ry [%s],rz [%s]\n" % (unit, unit, unit)
        result = run(
            "--nodes", file("turn.csv", head + "\n".join(line % angle for line in turned) + "\n"), "--mesh", mesh, "-o", (out, second)[k]
        )
        check(result.returncode == 0, "rotations in " + unit + result.stderr)
    check(max(abs(p - q) for a, b in zip(read(out), read(second)) for p, q in zip(a, b)) < 1e-12, "degrees and radians agree")

    moved = os.path.join(folder, "moved.obj")
    result = run("--nodes", nodes, "--mesh", mesh, "-o", moved, "--scale", "0.5")
    z = [float(line.split()[3]) for line in open(moved) if line.startswith("v ")]
    check(len(z) == 165 and abs(z[164] - 0.5) < 1e-12, "OBJ with half the displacement")

    # Linear exaggeration is warned of above 15 degrees (here the plate's end turns by 12), corotated is not.
    bent = "".join(
        "%g,%g,0,0,0,%.9g\n" % (i / 4, 1.3 * j / 4, math.tan(math.radians(12)) * (i / 4) ** 2 / 2) for i in range(5) for j in range(5)
    )
    bent = file("bent.csv", "x,y,z,ux,uy,uz\n" + bent)
    for words, warned in (
        (["--scale", "1.2"], False),
        (["--scale", "1.5"], True),
        (["--scale", "1.5", "--corotated"], False),
        (["--scale", "1"], False),
    ):
        result = run("--nodes", bent, "--mesh", mesh, "-o", out, *words)
        check(
            result.returncode == 0 and ("degrees" in result.stderr) == warned,
            "warning of exaggeration with %s: %s" % (words, result.stderr),
        )

    # A ring of nine sides and four nodes, half of them beside it: the elastic surface hangs on them too loosely, the kernel takes over.
    rings = [(2 * i / 3, 3 * math.cos(2 * math.pi * j / 9), 0.5 * math.sin(2 * math.pi * j / 9)) for i in range(4) for j in range(9)]
    tube = file(
        "tube.obj",
        "".join("v %.17g %.17g %.17g\n" % v for v in rings)
        + "".join(
            "f %d %d %d %d\n" % tuple(k + 1 for k in (9 * i + j, 9 * i + (j + 1) % 9, 9 * i + 9 + (j + 1) % 9, 9 * i + 9 + j))
            for i in range(3)
            for j in range(9)
        ),
    )
    few = file(
        "few.csv",
        "x,y,z,ux,uy,uz,rx,ry,rz\n"
        + "".join(p + ",0.1,0.2,0.3,0,0,0\n" for p in ("0,3,0", "0.66666666666666663,3,0", "1.2,0.3,0.45", "2,0.2,0.45")),
    )
    result = run("--nodes", few, "--mesh", tube, "-o", second)
    check(
        result.returncode == 0
        and "kernel instead of elastic: its Lebesgue constant" in result.stderr
        and "kernel (4 nodes are too few" in result.stdout,
        "loose elastic surface: " + result.stdout + result.stderr,
    )
    check(all(abs(a - b) < 1e-9 for w in read(second) for a, b in zip(w, (0.1, 0.2, 0.3))), "a translation stays one")
    result = run("--nodes", few, "--mesh", tube, "-o", second, "--scheme", "elastic")
    check(result.returncode == 0 and "Lebesgue constant" in result.stderr, "elastic where it is asked for: " + result.stderr)

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
    wrong(
        "millimetres",
        ["--nodes", file("mm.csv", "x,y,z,ux,uy,uz\n0,0,0,0,0,0\n1000,0,0,0,0,0\n0,1300,0,0,0,0\n1000,1300,0,0,0,1\n"), "--mesh", mesh],
        "units",
    )
    for factor in (10, 25.4, 100, 0.1, 0.01, 0.001):
        other = "".join(
            "%g,%g,0,0,0,%g\n" % (factor * i / 4, factor * 1.3 * j / 4, factor * 0.1 * i * j) for i in range(5) for j in range(5)
        )
        wrong(
            "nodes %g times as large" % factor,
            ["--nodes", file("unit.csv", "x,y,z,ux,uy,uz\n" + other), "--mesh", mesh],
            "units may differ: multiplied by %.4g" % (1 / factor),
        )
    wrong(
        "decimal commas between commas",
        ["--nodes", file("comma.csv", "x,y,z,ux,uy,uz\n" + "0,5,0,5,0,0,0,0,0,0,0,0\n"), "--mesh", mesh],
        "decimal comma",
    )
    wrong("two units", ["--nodes", file("two.csv", "x [m],y [mm],z [m],ux,uy,uz\n0,0,0,0,0,0\n"), "--mesh", mesh], "one unit")
    wrong("two columns of a name", ["--nodes", file("twice.csv", "x,y,z,ux,uy,uz,u1\n0,0,0,0,0,0,0\n"), "--mesh", mesh], "twice")
    wrong("half the rotations", ["--nodes", file("half.csv", "x,y,z,ux,uy,uz,rx\n0,0,0,0,0,0,0\n"), "--mesh", mesh], "rx, ry, rz")
    wrong(
        "far away",
        ["--nodes", file("far.csv", "x,y,z,ux,uy,uz\n50,0,0,0,0,0\n51,0,0,0,0,0\n50,1,0,0,0,0\n"), "--mesh", mesh],
        "do not belong",
    )
    wrong("no faces", ["--nodes", nodes, "--mesh", file("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n")], "no face")
    wrong("no mesh", ["--nodes", nodes, "--mesh", os.path.join(folder, "missing.obj")], "no such")
    wrong("scheme", ["--nodes", nodes, "--mesh", mesh, "--scheme", "spline"], "kernel")
    result = run("--nodes", nodes, "--mesh", mesh, "-o", os.path.join(folder, "out.txt"))
    check(result.returncode == 2, "unknown kind of output")

print("test_deform:", "failed" if failures else "passed")
sys.exit(1 if failures else 0)
