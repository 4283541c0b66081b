"""flexframe reduce on small models of every kind, made here: bodies of several materials and sets, matrices, stress modes, and wrong
models, each answered by a sentence with its place. Closed forms or the solution of the same matrices say what is right."""
import json
import math
import re
import struct

from program import *

with temporary_folder() as name:
    folder = pathlib.Path(name)

    def put(file, content):
        (folder / file).write_bytes(content if isinstance(content, bytes) else content.encode())
        return folder / file

    def reduce(model, *words):
        done = run("reduce", model, "-o", folder / "body.sid", "--quiet", "--json", *words)
        return json.loads(done.stdout) if done.returncode == 0 else {"frequencies": [], "mass": 0}

    def nearest(frequencies, wanted, tolerance, what):
        near(min(frequencies, key=lambda f: abs(f - wanted), default=0.0), wanted, tolerance * wanted, what)

    # A rod along x of nx by 1 by 1 bricks; Poisson's ratio zero, so that stretching it is one-dimensional.
    nx, length, side = 20, 1.0, 0.1
    corners = [(length * i / nx, side * j, side * k) for i in range(nx + 1) for j in (0, 1) for k in (0, 1)]
    number = lambda i, j, k: 4 * i + 2 * j + k + 1
    bricks = [
        [
            number(i, 0, 0),
            number(i + 1, 0, 0),
            number(i + 1, 1, 0),
            number(i, 1, 0),
            number(i, 0, 1),
            number(i + 1, 0, 1),
            number(i + 1, 1, 1),
            number(i, 1, 1),
        ]
        for i in range(nx)
    ]
    nodes = "*NODE, NSET=ALL\n" + "".join("%d, %.9g, %.9g, %.9g\n" % (n + 1, *x) for n, x in enumerate(corners))
    elements = "*ELEMENT, TYPE=C3D8I, ELSET=ROD\n" + "".join("%d, %s\n" % (e + 1, ", ".join(map(str, b))) for e, b in enumerate(bricks))
    sets = (
        "*NSET, NSET=LEFT\n1, 2, 3, 4\n*NSET, NSET=RIGHT, GENERATE\n%d, %d\n*ELSET, ELSET=FIRST, GENERATE\n1, %d\n*ELSET, ELSET=SECOND,"
        " GENERATE\n%d, %d\n" % (4 * nx + 1, 4 * nx + 4, nx // 2, nx // 2 + 1, nx)
    )
    stiff, soft = (2.0e11, 8000.0), (5.0e10, 2000.0)
    material = "*MATERIAL, NAME=%s\n*ELASTIC\n%g, 0\n*DENSITY\n%g\n"
    two = (
        material % ("STIFF", *stiff)
        + material % ("SOFT", *soft)
        + "*SOLID SECTION, ELSET=FIRST, MATERIAL=STIFF\n*SOLID SECTION, ELSET=SECOND, MATERIAL=SOFT\n"
    )
    model = put("rod.inp", nodes + elements + sets + two)

    # Both materials have the same speed of sound and impedances 4 : 1; held at the stiff end: tan^2(w l / c) = 4 with l half the length.
    made = reduce(model, "--hold", "LEFT", "--method", "eigen", "--modes", 12)
    near(made["mass"], side * side * length * (stiff[1] + soft[1]) / 2, 1e-9, "mass of two materials")
    nearest(
        made["frequencies"],
        math.atan(2.0) * math.sqrt(stiff[0] / stiff[1]) / (0.5 * length) / (2 * math.pi),
        0.01,
        "stretching of a rod of two materials",
    )
    # The assembled system: the free body, welded by its root in a scene, has the held model's frequencies.
    held = reduce(
        put("rigid.inp", nodes + elements + sets + two),
        "--hold",
        "LEFT",
        "--interface",
        "tip=rigid:RIGHT",
        "--method",
        "eigen",
        "--modes",
        5,
    )["frequencies"]
    reduce(model, "--interface", "root=rigid:LEFT", "--interface", "tip=rigid:RIGHT")
    (folder / "held.toml").write_text(
        'title = "held"\n[simulation]\nduration = 1\n[[body]]\nname = "rod"\nkind = "modal"\nfile = "body.sid"\n'
        '[[joint]]\nname = "wall"\nkind = "weld"\nparent = "ground"\nchild = "rod.root"\n'
    )
    assembled = sorted(m["frequency"] for m in json.loads(run("check", folder / "held.toml", "--json").stdout)["modes"])
    for k, wanted in enumerate(held):
        near(assembled[k], wanted, 0.01 * wanted, f"frequency {k + 1} of the assembled rod")
    # The same materials by option, for sets of the model; the kept nodes from a set.
    bare = put("bare.inp", nodes + elements + sets)
    again = reduce(
        bare,
        "--material",
        "FIRST=2e11,0,8000",
        "--material",
        "SECOND=5e10,0,2000",
        "--hold",
        "LEFT",
        "--method",
        "eigen",
        "--modes",
        12,
        "--node-set",
        "RIGHT",
        "--stress",
    )
    for a, b in zip(again["frequencies"], made["frequencies"]):
        near(a, b, 1e-9 * b, "materials by option")
    expect(again["nodes"] == 4, f"{again['nodes']} nodes from a set of 4")
    expect(
        (folder / "body.sid").read_text().count("new node") == 4 and (folder / "body.sid").read_text().count("end sigma") == 4,
        "stress modes of the four nodes are not in the file",
    )

    # Pictures of these modes coloured by stress; mapped modes are kept between runs in the folder that is asked for and nowhere else.
    before = sorted(p.name for p in folder.iterdir())
    draw = lambda out, **more: run(
        "modes",
        folder / "body.sid",
        "--mode",
        1,
        "--pictures",
        2,
        "--size",
        "64x48",
        "--no-video",
        "--color-by",
        "stress",
        "-o",
        folder / out,
        **more,
    )
    plain = draw("plain")
    expect("stress" not in plain.stderr + plain.stdout, f"a body with stress modes: {plain.stderr}{plain.stdout}")
    expect(sorted(p.name for p in folder.iterdir()) == sorted([*before, "plain"]), "pictures without a cache write elsewhere")
    for out in ("first", "second"):
        draw(out, env={**os.environ, "FLEXFRAME_CACHE": str(folder / "cache")})
    expect(len(list((folder / "cache").iterdir())) == 1, "one file of mapped modes in the cache")
    pictures = [sorted((folder / out).rglob("*.png")) for out in ("plain", "first", "second")]
    expect(
        len(pictures[0]) == 2 and all([p.read_bytes() for p in some] == [p.read_bytes() for p in pictures[0]] for some in pictures),
        "pictures with the cache are the pictures without it",
    )

    # gmsh, text, both formats: the same rod with its physical groups, in millimetres.
    mm = [(1000 * x, 1000 * y, 1000 * z) for x, y, z in corners]
    msh = '$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 7 "LEFT"\n3 8 "ROD"\n$EndPhysicalNames\n$Nodes\n%d\n' % len(mm)
    msh += "".join("%d %.9g %.9g %.9g\n" % (n + 1, *x) for n, x in enumerate(mm)) + "$EndNodes\n$Elements\n%d\n1 3 2 7 1 1 2 4 3\n" % (
        nx + 1
    )
    msh_bricks = "".join("%d 5 2 8 1 %s\n" % (e + 2, " ".join(map(str, b))) for e, b in enumerate(bricks))
    one = reduce(
        put("rod.msh", msh + msh_bricks + "$EndElements\n"),
        "--units",
        "mm",
        "--material",
        "2e11,0,8000",
        "--hold",
        "LEFT",
        "--method",
        "eigen",
        "--modes",
        12,
    )
    nearest(one["frequencies"], math.sqrt(stiff[0] / stiff[1]) / (4 * length), 0.01, "stretching of a rod of gmsh")

    # K and M: as CalculiX 2.20 wrote them for two bricks, and the same numbers as Matrix Market with a node table.
    corpus = source / "tests/fuzz/corpus/fe"
    wanted = [7068.79701, 8914.08675, 9079.50314, 14249.8373, 15102.3850, 29677.3101]  # scipy.linalg.eigh of the two files
    found = reduce(corpus / "bricks.sti", "--modes", 6)
    expect(found["rigid_motions"] == 6 and len(found["frequencies"]) == 6, "matrices of CalculiX: rigid motions or modes")
    for k, (a, b) in enumerate(zip(found["frequencies"], wanted)):
        near(a, b, 1e-6 * b, f"matrices of CalculiX, mode {k + 1}")
    dofs = [line.strip().split(".") for line in (corpus / "bricks.dof").read_text().split()]
    table = [
        line.split(",") for line in (corpus / "bricks.inp").read_text().split("*NODE")[1].split("*")[0].split("\n")[1:] if line.strip()
    ]
    ids = [int(row[0]) for row in table]
    place = [3 * ids.index(int(n)) + int(d) for n, d in dofs]
    for end, file in ((".sti", "K.mtx"), (".mas", "M.mtx")):
        entries = {}
        for line in (corpus / f"bricks{end}").read_text().split("\n"):
            if line.strip():
                r, c, value = line.split()
                i, j = sorted((place[int(r) - 1], place[int(c) - 1]), reverse=True)
                entries[i, j] = value
        put(
            file,
            "%%%%MatrixMarket matrix coordinate real symmetric\n%% made by a test\n36 36 %d\n" % len(entries)
            + "".join("%d %d %s\n" % (i, j, v) for (i, j), v in entries.items()),
        )
    put("nodes.txt", "# id x y z\n" + "".join("%s %s %s %s\n" % tuple(row[:4]) for row in table))
    found = reduce(folder / "K.mtx", "--mass", folder / "M.mtx", "--node-table", folder / "nodes.txt", "--modes", 6)
    for k, (a, b) in enumerate(zip(found["frequencies"], wanted)):
        near(a, b, 1e-6 * b, f"Matrix Market, mode {k + 1}")

    # Wrong models.
    def refused(what, file, content, word, *words):
        put(file, content)
        done = run("reduce", folder / file, "-o", folder / "wrong.sid", "--quiet", *words, code=2)
        expect(word in done.stderr and file in done.stderr, f"{what}: {done.stderr}")
        expect(done.stderr.strip().count("\n") == 0, f"{what}: more than a sentence: {done.stderr}")
        expect(not (folder / "wrong.sid").exists(), f"{what} leaves a body")

    line = lambda text: text.count("\n") + 1
    refused("no material", "bad.inp", nodes + elements + sets, f"bad.inp:{line(nodes) + 1}: element 1 has no material")
    refused(
        "half of the elements without material",
        "bad.inp",
        nodes + elements + sets + material % ("STIFF", *stiff) + "*SOLID SECTION, ELSET=FIRST, MATERIAL=STIFF\n",
        f"bad.inp:{line(nodes) + 1 + nx // 2}: element {nx // 2 + 1} has no material",
    )
    refused(
        "a section of a missing material",
        "bad.inp",
        nodes + elements + sets + "*SOLID SECTION, ELSET=FIRST, MATERIAL=GONE\n",
        f"bad.inp:{line(nodes + elements + sets)}: section: material 'GONE'",
    )
    refused(
        "a material without density",
        "bad.inp",
        nodes + elements + sets + "*MATERIAL, NAME=STIFF\n*ELASTIC\n2e11, 0.3\n*SOLID SECTION, ELSET=ROD, MATERIAL=STIFF\n",
        "density",
    )
    refused(
        "an unknown element type", "bad.inp", nodes + elements.replace("C3D8I", "C3D27"), f"bad.inp:{line(nodes)}: element type 'C3D27'"
    )
    turned = elements.replace("\n2, " + ", ".join(map(str, bricks[1])), "\n2, " + ", ".join(map(str, bricks[1][4:] + bricks[1][:4])))
    refused("an element inside out", "bad.inp", nodes + turned + sets + two, f"bad.inp:{line(nodes) + 2}: element 2")
    refused(
        "a node that is not there",
        "bad.inp",
        nodes + elements.replace("\n2, 5,", "\n2, 5555,") + sets + two,
        f"bad.inp:{line(nodes) + 2}: element 2: node 5555",
    )
    refused("an element of too few nodes", "bad.inp", nodes + "*ELEMENT, TYPE=C3D8\n1, 1, 2, 3\n", f"bad.inp:{line(nodes) + 1}: element 1")
    gap = elements.replace("\n%d, " % (nx // 2) + ", ".join(map(str, bricks[nx // 2 - 1])), "")
    refused(
        "parts that nothing connects",
        "bad.inp",
        nodes + gap + sets.replace("1, %d\n*ELSET" % (nx // 2), "1, %d\n*ELSET" % (nx // 2 - 1)) + two,
        "2 unconnected parts",
    )
    refused("nodes of no element kept", "bad.inp", nodes + "9999, 5, 5, 5\n" + elements + sets + two, "node 9999", "--node", 9999)
    # The mark of UTF-8 before the first word changes nothing: without *NODE there would be no node.
    put("marked.inp", "\ufeff" + nodes + elements + sets + two)
    put("plain.inp", nodes + elements + sets + two)
    marked, plain = (reduce(folder / f"{name}.inp", "--modes", 2) for name in ("marked", "plain"))
    expect(marked["frequencies"] == plain["frequencies"], f"a marked deck: {marked}")
    refused("an empty file", "bad.inp", "", "is no deck")
    refused("an empty mesh", "bad.msh", "", "MeshFormat")
    refused("an empty matrix", "bad.mtx", "", "bad.mtx", "--mass", folder / "M.mtx", "--node-table", folder / "nodes.txt")
    refused(
        "an unknown gmsh element",
        "bad.msh",
        msh + msh_bricks.replace("2 5 2", "2 777 2", 1) + "$EndElements\n",
        f"bad.msh:{line(msh)}: gmsh element type 777",
    )
    refused(
        "a gmsh node that is not there",
        "bad.msh",
        msh + msh_bricks.replace(" 1 5 ", " 1 5555 ", 1) + "$EndElements\n",
        f"bad.msh:{line(msh)}: element 2: node 5555",
    )
    flipped = "2 5 2 8 1 %s\n" % " ".join(map(str, bricks[0][4:] + bricks[0][:4]))
    refused(
        "a gmsh element inside out",
        "bad.msh",
        msh + flipped + msh_bricks.split("\n", 1)[1] + "$EndElements\n",
        f"bad.msh:{line(msh)}: element 2",
        "--material",
        "2e11,0,8000",
    )
    # Sizes that no file of some hundred bytes can have: 10 GB and more.
    start = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n"
    refused("10 GB of nodes", "bad.msh", start + "1250000000\n1 0 0 0\n", "bad.msh:5: a count of 1250000000")
    refused(
        "10 GB of nodes, binary",
        "bad.msh",
        b"$MeshFormat\n4.1 1 8\n"
        + struct.pack("<i", 1)
        + b"\n$EndMeshFormat\n$Nodes\n"
        + struct.pack("<4Q", 1, 10**10, 1, 10**10)
        + struct.pack("<3iQ", 3, 1, 0, 10**10),
        "count of 10000000000",
    )
    refused(
        "10 GB of entries",
        "bad.mtx",
        "%%MatrixMarket matrix coordinate real symmetric\n36 36 10000000000\n1 1 1\n",
        "bad.mtx",
        "--mass",
        folder / "M.mtx",
        "--node-table",
        folder / "nodes.txt",
    )
    refused("a set of all numbers", "bad.inp", nodes + elements + "*NSET, NSET=ALL, GENERATE\n1, 2000000000\n", "bad.inp")
    # A body of a file that claims much more than it holds.
    put("bad.sid", "1000000000 1000000000 : huge\npart\nnew modal\nrefmod\nmass = 1\nnelastq = 1000000000\nend refmod\n")
    (folder / "bad.toml").write_text((folder / "held.toml").read_text().replace("body.sid", "bad.sid"))
    done = run("check", folder / "bad.toml", code=2)
    expect("bad.sid:" in done.stderr, f"a body that claims too much: {done.stderr}")

    # The same body as HDF5: the same numbers and motion, the elements' surface in it, drawn without a mesh and told of where it is missing.
    import hashlib

    words = ("--hold", "LEFT", "--method", "eigen", "--modes", 3, "--stress", "--nodes", 8, "--quiet", "--json")
    text = json.loads(run("reduce", model, "-o", folder / "rod.sid", *words).stdout)
    binary = json.loads(run("reduce", model, "-o", folder / "rod.h5", *words).stdout)
    expect(text["frequencies"] == binary["frequencies"], "a body as HDF5 has other frequencies")
    told = json.loads(run("info", folder / "rod.h5", "--json").stdout)
    expect(told["kind"] == "flexible body" and not told["faults"], f"info of a body as HDF5: {told}")
    expect(told["surface"] == {"nodes": 4 * (nx + 1), "faces": 4 * nx + 2, "stress": True}, f"surface of the rod: {told['surface']}")
    expect(told["origin"]["model_sha256"] == hashlib.sha256(model.read_bytes()).hexdigest(), "the model's hash in the body")
    swing = (
        'title = "rod"\n[simulation]\nduration = 0.002\noutput_rate = 1000\n[[body]]\nname = "rod"\nkind = "modal"\nfile = "rod.%s"\n'
        "initial = { qd = [0.5, 0.2, 0.1] }\n"
        '[[joint]]\nname = "wall"\nkind = "weld"\nparent = "ground"\nchild = "rod"\n'
        '[[output]]\nname = "tip"\nof = "rod.node[%d]"\nquantity = "position"\n[render]\nsize = [64, 48]\ncolor_by = "stress"\n'
    )
    kept = next(n for n in range(4 * nx + 1, 4 * nx + 5) if f"new node = {n}\n" in (folder / "rod.sid").read_text())
    for kind in ("sid", "h5"):
        (folder / f"rod_{kind}.toml").write_text(swing % (kind, kept))
        run("simulate", folder / f"rod_{kind}.toml", "-o", folder / f"rod_{kind}.r.h5", "--csv", folder / f"rod_{kind}.csv")
    expect((folder / "rod_sid.csv").read_bytes() == (folder / "rod_h5.csv").read_bytes(), "a body as HDF5 moves otherwise")
    picture = ("--frames", "0:2", "--no-video", "--quiet", "--json")
    seen = json.loads(run("render", folder / "rod_h5.r.h5", "-o", folder / "shapes", *picture).stdout)
    expect(not seen["warnings"], f"pictures of a body as HDF5: {seen['warnings']}")
    seen = json.loads(run("render", folder / "rod_sid.r.h5", "-o", folder / "doubt", "--color-by", "map_error", *picture).stdout)
    off = [n for n in seen["notes"] if "the mesh may be off by up to" in n]
    expect(len(off) == 1, f"colours by the error of the map: {seen['notes']}")
    # Shapes of the elements have no map, and so no error of one; two nodes cannot tell any. Neither is passed over in silence.
    seen = json.loads(run("render", folder / "rod_h5.r.h5", "-o", folder / "none", "--color-by", "map_error", *picture).stdout)
    expect(any("no map moves a mesh" in n for n in seen["notes"]), f"no map, no error: {seen}")
    run("reduce", model, "-o", folder / "few.sid", *words[:7], "--nodes", 2, "--quiet")
    few = swing.replace("rod.%s", "few.%s").replace("node[%d]", "node[%s]") % (
        "sid",
        min(re.findall(r"new node = (\d+)", (folder / "few.sid").read_text())),
    )
    (folder / "few.toml").write_text(few.replace('"few.sid"\n', '"few.sid"\nmesh = "few.obj"\n'))
    run("simulate", folder / "few.toml", "-o", folder / "few.r.h5")
    seen = json.loads(run("render", folder / "few.r.h5", "-o", folder / "few", "--color-by", "map_error", *picture).stdout)
    told = [w for w in seen["warnings"] if "none is coloured" in w]
    expect(len(told) == 1 and "no body has an error of its mesh's map" in told[0], f"too few nodes to tell: {seen}")
    run("reduce", bare, "-o", folder / "rod.h5", "--material", "1e11,0.3,8000", *words)
    seen = json.loads(run("render", folder / "rod_h5.r.h5", "-o", folder / "nodes", *picture).stdout)
    expect(any("is not the one that was simulated" in w for w in seen["warnings"]), f"pictures with another file: {seen['warnings']}")
    (folder / "bad.toml").write_text(swing % ("h5", kept))
    (folder / "rod.h5").write_bytes((folder / "rod_h5.r.h5").read_bytes())
    done = run("check", folder / "bad.toml", code=2)
    expect("rod.h5: is a file of 'flexframe results', not a flexible body" in done.stderr, f"results as a body: {done.stderr}")

    # A dense mesh by few nodes: about how far it is off between them, and what helps; nothing of it with enough nodes (3 % and less of the
    # deflection, examples/accuracy-interp) or by the elements' own shapes.
    root = source.resolve()
    for name, nodes, told in (("few.sid", 8, True), ("many.sid", 97, False), ("shapes.h5", 8, False)):
        rod = root / "tests" / "unit" / "data" / "kernel_map" / "conrod.inp"
        run("reduce", rod, "-o", folder / name, "--modes", 3, "--nodes", nodes, "--quiet")
        (folder / "doubt.toml").write_text(
            f'[simulation]\nduration = 0.001\n[[body]]\nname = "rod"\nkind = "modal"\nfile = "{name}"\n'
            f'mesh = "{root / "assets" / "conrod" / "conrod.obj"}"\ninitial = {{ qd = [0.5, 0.2, 0.1] }}\n[render]\nsize = [64, 48]\n'
        )
        run("simulate", folder / "doubt.toml", "-o", folder / "doubt.r.h5", "--quiet")
        seen = json.loads(run("render", folder / "doubt.r.h5", "-o", folder / "doubtful", *picture).stdout)
        off = [w for w in seen["warnings"] if "the mesh may be off by about" in w]
        expect(len(off) == told and all("body 'rod': between its 8 nodes" in w for w in off), f"{name}: {seen['warnings']}")
    scene = (folder / "doubt.toml").read_text()
    (folder / "doubt.toml").write_text(scene.replace("initial", "drawing = { thickness = -1 }\ninitial"))
    done = run("run", folder / "doubt.toml", "-o", folder / "thick", code=2)
    expect("'drawing.thickness' must be a length > 0 in m" in done.stderr, f"a thickness below zero: {done.stderr}")

finish()
