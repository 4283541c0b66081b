"""Decks as they come: CalculiX' own frequencies of the same text, or theory. Each deck is written here; where `ccx` is installed it
computes it anew, else the figures below stand, made by `test_decks.py PROGRAM SOURCE --figures`."""
import itertools
import json
import math
import shutil
import subprocess

from program import *

# Frequencies in Hz of CalculiX 2.20, rigid motions left out.
FIGURES = {
    "kinematic coupling over quadratic faces": [223.8238, 332.6337, 1574.06, 2279.431],
    "rigid body of elements": [227.2707, 337.6357, 1811.008, 2603.003],
    "supports in the step": [426.5137, 629.9511, 2578.112, 3638.279],
    "equations": [540.8905, 2035.902, 3299.369, 3726.777],
    "supports in directions of their own": [672.1634, 2320.563, 3643.182, 5518.343],
    "springs": [632.9588, 817.3754, 2729.389, 3693.998],
    "wedges": [664.4873, 775.3799, 3959.286, 4551.802],
    "tied surfaces of two meshes": [421.7392, 625.4216, 2543.258, 3545.472],
    "orthotropic in directions of its own": [179.6563, 227.9136, 783.5201, 1082.218],
    "eight-node shells": [21.71385, 92.58358, 135.3161, 301.5738],
    "six-node shells": [21.84847, 96.19241, 137.053, 321.9558],
    "composite shells": [23.03402, 70.81087, 143.6944, 241.7388],
    "beams": [33.87659, 67.27223, 212.0845, 418.9463],
}

STEEL = "*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7850\n"


def block(counts, sizes, kind, first=1, origin=(0, 0, 0), element=1, elset="ALL"):
    """Nodes and elements of a brick of C3D8, C3D20 or C3D6 kinds; and the nodes' places by number."""
    quadratic = kind.startswith(("C3D20", "C3D15"))
    step = 2 if quadratic else 1
    n = [step * c for c in counts]
    number, places = {}, {}
    for k in itertools.product(*(range(m + 1) for m in n)):
        if quadratic and sum(i % 2 for i in k) > 1 and not kind.startswith("C3D15"):
            continue
        number[k] = first + len(number)
        places[number[k]] = tuple(o + s * i / m for o, s, i, m in zip(origin, sizes, k, n))
    corner = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    elements = []
    for cell in itertools.product(*(range(c) for c in counts)):
        at = [tuple(step * (a + b) for a, b in zip(cell, c)) for c in corner]
        nodes = [number[a] for a in at]
        if quadratic:
            nodes += [number[tuple((i + j) // 2 for i, j in zip(at[a], at[b]))] for a, b in edges]
        if kind == "C3D6":
            elements += [[nodes[k] for k in (0, 1, 2, 4, 5, 6)], [nodes[k] for k in (0, 2, 3, 4, 6, 7)]]
        else:
            elements.append(nodes)
    text = "*NODE, NSET=N%s\n" % elset + "".join("%d, %.9g, %.9g, %.9g\n" % (i, *x) for i, x in places.items())
    text += "*ELEMENT, TYPE=%s, ELSET=%s\n" % (kind, elset)
    for e, nodes in enumerate(elements):
        words = [element + e, *nodes]
        text += ",\n".join(", ".join(map(str, words[i : i + 10])) for i in range(0, len(words), 10)) + "\n"
    return text, places


def some(name, places, where):
    chosen = [i for i, x in places.items() if where(*x)]
    return "*NSET, NSET=%s\n" % name + "".join("%d,\n" % i for i in chosen)


def plate(counts, sizes, kind):
    """A plate in the xy plane of S8R, S6, S4 or S3."""
    nx, ny = (2 * c for c in counts)
    quadratic = kind in ("S8R", "S8", "S6")
    number, places = {}, {}
    for i, j in itertools.product(range(nx + 1), range(ny + 1)):
        if not quadratic and (i % 2 or j % 2) or (kind in ("S8R", "S8") and i % 2 and j % 2):
            continue
        number[i, j] = 1 + len(number)
        places[number[i, j]] = (sizes[0] * i / nx, sizes[1] * j / ny, 0.0)
    elements = []
    for a, b in itertools.product(range(0, nx, 2), range(0, ny, 2)):
        p = [(a, b), (a + 2, b), (a + 2, b + 2), (a, b + 2)]
        pieces = [p] if kind in ("S8R", "S8", "S4") else [[p[0], p[1], p[2]], [p[0], p[2], p[3]]]
        for q in pieces:
            nodes = [number[k] for k in q]
            if quadratic:
                nodes += [number[(q[i][0] + q[(i + 1) % len(q)][0]) // 2, (q[i][1] + q[(i + 1) % len(q)][1]) // 2] for i in range(len(q))]
            elements.append(nodes)
    text = "*NODE\n" + "".join("%d, %.9g, %.9g, %.9g\n" % (i, *x) for i, x in places.items())
    text += "*ELEMENT, TYPE=%s, ELSET=ALL\n" % kind + "".join(", ".join(map(str, [e + 1, *n])) + "\n" for e, n in enumerate(elements))
    return text, places


def cases():
    """name -> (deck, supports, largest difference allowed)"""
    out = {}
    solid = "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL\n"
    held = "*BOUNDARY\nROOT, 1, 3\n"
    ends = lambda places, length: some("ROOT", places, lambda x, y, z: x == 0) + some("TIP", places, lambda x, y, z: abs(x - length) < 1e-9)
    # A couplings' reference point with a mass on it, over faces of quadratic elements.
    text, places = block((4, 1, 1), (0.2, 0.02, 0.03), "C3D20R")
    face = "*SURFACE, NAME=END, TYPE=ELEMENT\n4, S4\n"
    heavy = "*NODE\n9000, 0.23, 0.01, 0.02\n*ELEMENT, TYPE=MASS, ELSET=M\n9000, 9000\n*MASS, ELSET=M\n0.4\n"
    beam = text + ends(places, 0.2) + STEEL + solid
    out["kinematic coupling over quadratic faces"] = (
        beam + face + heavy + "*COUPLING, REF NODE=9000, SURFACE=END, CONSTRAINT NAME=C\n*KINEMATIC\n1, 3\n",
        held,
        2e-4,
    )
    out["rigid body of elements"] = (beam + heavy + "*ELSET, ELSET=LAST\n4\n*RIGID BODY, ELSET=LAST, REF NODE=9000\n", held, 2e-4)
    out["supports in the step"] = (beam, held, 2e-4)
    full, corners = block((4, 1, 1), (0.2, 0.02, 0.03), "C3D20")
    tip = "%d, 2, 1., %d, 3, -1.\n" % (max(corners), max(corners) - 5)
    out["equations"] = (full + ends(corners, 0.2) + STEEL + solid + "*EQUATION\n2\n" + tip, held, 2e-4)
    out["supports in directions of their own"] = (
        beam + "*TRANSFORM, NSET=TIP, TYPE=R\n0.8, 0.6, 0., -0.6, 0.8, 0.\n",
        held + "*BOUNDARY\nTIP, 2, 2\n",
        5e-4,
    )
    # Point loads on single layers of C3D20R move what no integration point sees: full elements.
    out["springs"] = (
        full
        + ends(corners, 0.2)
        + STEEL
        + solid
        + "*ELEMENT, TYPE=SPRING1, ELSET=S1\n8001, %d\n*SPRING, ELSET=S1\n2\n2.e6\n" % max(places)
        + "*NODE\n9001, 0.2, 0.2, 0.1\n*ELEMENT, TYPE=SPRINGA, ELSET=S2\n8002, %d, 9001\n*SPRING, ELSET=S2\n\n3.e6\n" % max(places)
        + "*BOUNDARY\n9001, 1, 3\n",
        held,
        2e-4,
    )
    text, places = block((8, 2, 2), (0.2, 0.02, 0.03), "C3D6")
    # CalculiX has two points for the mass too, which loses inertia of each element; the mass is exact here.
    out["wedges"] = (text + ends(places, 0.2) + STEEL + solid, held, 1.6e-2)
    one, a = block((3, 2, 2), (0.1, 0.02, 0.03), "C3D20", elset="A")
    two, b = block((3, 1, 1), (0.1, 0.02, 0.03), "C3D20", first=5001, element=501, origin=(0.1, 0, 0), elset="B")
    out["tied surfaces of two meshes"] = (
        one
        + two
        + some("ROOT", a, lambda x, y, z: x == 0)
        + "*ELSET, ELSET=ALL\nA, B\n"
        + STEEL
        + solid
        + "*SURFACE, NAME=SA\nA, S4\n*SURFACE, NAME=SB\nB, S6\n".replace("A, S4", "9, S4\n10, S4\n11, S4\n12, S4").replace(
            "B, S6", "501, S6"
        )
        + "*TIE, NAME=T, POSITION TOLERANCE=1e-4\nSA, SB\n",
        held,
        2e-3,
    )
    wood = "*MATERIAL, NAME=WOOD\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n1.2e10, 8e8, 5e8, 0.4, 0.35, 0.3, 7e8, 6e8,\n5e7\n*DENSITY\n500\n"
    text, places = block((4, 1, 1), (0.2, 0.02, 0.03), "C3D20")
    out["orthotropic in directions of its own"] = (
        text
        + ends(places, 0.2)
        + wood
        + "*ORIENTATION, NAME=O\n0.8, 0.6, 0.1, -0.6, 0.8, 0.2\n*SOLID SECTION, ELSET=ALL, MATERIAL=WOOD, ORIENTATION=O\n",
        held,
        2e-4,
    )
    text, places = plate((8, 4), (0.4, 0.2), "S8R")
    shell = "*SHELL SECTION, ELSET=ALL, MATERIAL=STEEL\n0.004\n"
    fixed = "*BOUNDARY\nROOT, 1, 6\n"
    # CalculiX makes solids of shells and beams, and holds all of their thickness.
    out["eight-node shells"] = (text + ends(places, 0.4) + STEEL + shell, fixed, 2e-2)
    text, places = plate((8, 4), (0.4, 0.2), "S6")
    out["six-node shells"] = (text + ends(places, 0.4) + STEEL + shell, fixed, 2e-2)
    text, places = plate((8, 4), (0.4, 0.2), "S8R")
    ply = "*MATERIAL, NAME=PLY\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n1.3e11, 9e9, 9e9, 0.3, 0.3, 0.4, 5e9, 5e9,\n3.2e9\n*DENSITY\n1600\n"
    turned = "*ORIENTATION, NAME=O0\n1., 0., 0., 0., 1., 0.\n*ORIENTATION, NAME=O45\n1., 1., 0., -1., 1., 0.\n"
    layers = "*SHELL SECTION, ELSET=ALL, COMPOSITE\n0.001, , PLY, O0\n0.001, , PLY, O45\n0.002, , STEEL, O0\n"
    out["composite shells"] = (text + ends(places, 0.4) + STEEL + ply + turned + layers, fixed, 1e-2)
    beams = "*NODE\n" + "".join("%d, %.9g, 0, 0\n" % (i + 1, 0.5 * i / 16) for i in range(17))
    beams += "*ELEMENT, TYPE=B32R, ELSET=ALL\n" + "".join("%d, %d, %d, %d\n" % (e + 1, 2 * e + 1, 2 * e + 2, 2 * e + 3) for e in range(8))
    beams += "*NSET, NSET=ROOT\n1\n" + STEEL + "*BEAM SECTION, ELSET=ALL, MATERIAL=STEEL, SECTION=RECT\n0.01, 0.02\n0., 0., -1.\n"
    out["beams"] = (beams, fixed, 2e-2)
    return out


def ccx(folder, text, supports, modes):
    (folder / "truth.inp").write_text(text + "*STEP\n*FREQUENCY\n%d\n" % modes + supports + "*END STEP\n")
    subprocess.run(["ccx", "truth"], cwd=folder, capture_output=True, timeout=120)
    found = []
    for line in (folder / "truth.dat").read_text().splitlines():
        words = line.split()
        if len(words) == 5 and words[0].isdigit():
            found.append(float(words[3]))
        elif found:
            break
    return found


def nastran(text):
    """Nodes and C3D20R elements of a deck as bulk data in large and small fields."""
    out, word = (
        "CEND\nSPC = 7\nBEGIN BULK\nMAT1*                  1          2.1+11                             0.3\n"
        "*                7.85+03\nPSOLID,5,1\n",
        "",
    )
    pending = []
    for line in text.splitlines():
        if line.startswith("*"):
            word = line[1:].split(",")[0].strip()
            root = "NSET=ROOT" in line
            continue
        numbers = [w.strip() for w in line.split(",") if w.strip()]
        if word == "NODE":
            out += "GRID*   %16s%16s%16.9g%16.9g\n*       %16.9g\n" % (numbers[0], "", *map(float, numbers[1:]))
        elif word == "ELEMENT":
            pending += numbers
            if len(pending) == 21:
                n = pending[1:]
                n = n[:12] + n[16:] + n[12:16]
                fields = [pending[0], "5", *n]
                rows = [fields[i : i + 8] for i in range(0, len(fields), 8)]
                out += (
                    "\n".join(("CHEXA   " if k == 0 else "+       ") + "".join("%8s" % f for f in row) for k, row in enumerate(rows)) + "\n"
                )
                pending = []
        elif word == "NSET" and root:
            out += "".join("SPC1,7,123,%s\n" % n for n in numbers)
    return out + "ENDDATA\n"


with temporary_folder() as name:
    folder = pathlib.Path(name)

    def put(file, text):
        (folder / file).write_text(text)
        return folder / file

    def reduce(model, *words, modes=4):
        done = run(
            "reduce",
            model,
            "-o",
            folder / "body.sid",
            "--quiet",
            "--json",
            "--method",
            "eigen",
            "--modes",
            modes,
            "--nodes",
            8,
            "--no-stiffening",
            *words,
        )
        return json.loads(done.stdout)

    there = shutil.which("ccx") is not None
    for what, (text, supports, bound) in cases().items():
        wanted = ccx(folder, text, supports, 4) if there else FIGURES.get(what, [])
        if "--figures" in sys.argv:
            print(f"    {what!r}: {wanted},")
        expect(len(wanted) >= 4, f"{what}: CalculiX gives {wanted}")
        made = reduce(put("deck.inp", text + "*STEP\n*STATIC\n" + supports + "*END STEP\n"))
        for k, (ours, theirs) in enumerate(zip(made["frequencies"], wanted)):
            expect(abs(ours - theirs) < bound * theirs, f"{what}: mode {k + 1} {ours:.6g} Hz, CalculiX {theirs:.6g} Hz")
        expect(any("first step" in n for n in made["notes"]), f"{what}: supports of the step are not told")

    # A cantilever plate twice as long as wide: A. W. Leissa, Vibration of Plates, 1969, table 4.60, omega a^2 sqrt(rho h / D) = 3.439.
    text, places = plate((8, 4), (0.4, 0.2), "S8R")
    root = some("ROOT", places, lambda x, y, z: x == 0)
    first = reduce(put("deck.inp", text + root + STEEL + "*SHELL SECTION, ELSET=ALL, MATERIAL=STEEL\n0.004\n*BOUNDARY\nROOT, 1, 6\n"))[
        "frequencies"
    ][0]
    wanted = 3.439 / (2 * math.pi * 0.4**2) * math.sqrt(2.1e11 * 0.004**2 / (12 * (1 - 0.3**2) * 7850))
    near(first, wanted, 2e-3 * wanted, "cantilever plate of eight-node shells")

    # Nastran's bulk data of the same mesh gives the same numbers.
    text, places = block((4, 1, 1), (0.2, 0.02, 0.03), "C3D20R")
    root = some("ROOT", places, lambda x, y, z: x == 0)
    plain = text.replace("C3D20R", "C3D20") + root + STEEL + "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL\n"
    wanted = reduce(put("deck.inp", plain + "*BOUNDARY\nROOT, 1, 3\n"))
    bulk = nastran(text + root)
    made = reduce(put("deck.bdf", bulk))
    near(made["mass"], wanted["mass"], 1e-9, "mass of the bulk data")
    for a, b in zip(made["frequencies"], wanted["frequencies"]):
        near(a, b, 1e-6 * b, "frequency of the bulk data")
    # A rod on an RBE2 with a heavy grid at its end is what the coupling of the other deck gives; springs and masses in the same words.
    tip = [i for i, x in places.items() if abs(x[0] - 0.2) < 1e-9]
    tied = bulk.replace(
        "ENDDATA",
        "GRID,9000,,.23,.01,.02\nCONM2,9001,9000,,.4\nRBE2,9002,9000,123,"
        + ",".join(map(str, tip[:5]))
        + "\n,"
        + ",".join(map(str, tip[5:]))
        + "\nENDDATA",
    )
    heavy = "*NODE\n9000, 0.23, 0.01, 0.02\n*ELEMENT, TYPE=MASS, ELSET=M\n9000, 9000\n*MASS, ELSET=M\n0.4\n"
    other = (
        plain
        + "*BOUNDARY\nROOT, 1, 3\n"
        + some("TIP", places, lambda x, y, z: abs(x - 0.2) < 1e-9)
        + heavy
        + "*RIGID BODY, NSET=TIP, REF NODE=9000\n"
    )
    for a, b in zip(reduce(put("deck.bdf", tied))["frequencies"], reduce(put("deck.inp", other))["frequencies"]):
        near(a, b, 1e-6 * b, "frequency of a heavy grid on an RBE2")

    # Two instances of one part, one moved and turned, tied by equations of a set of the assembly, are the flat deck.
    part = "*PART, NAME=P\n" + text.replace("C3D20R", "C3D20") + root + some("TIP", places, lambda x, y, z: abs(x - 0.2) < 1e-9)
    part += "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL\n*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=I, PART=P\n*END INSTANCE\n"
    part += "*INSTANCE, NAME=J, PART=P\n0.2, 0., 0.\n0.2, 0.01, 0., 0.2, 0.01, 1., 180.\n*END INSTANCE\n"
    one = reduce(
        put(
            "deck.inp",
            part.replace("*INSTANCE, NAME=J", "*INSTANCE, NAME=K").split("*INSTANCE, NAME=K")[0]
            + "*END ASSEMBLY\n"
            + STEEL
            + "*BOUNDARY\nI.ROOT, 1, 3\n",
        )
    )
    for a, b in zip(one["frequencies"], wanted["frequencies"]):
        near(a, b, 1e-9 * b, "frequency of an instance")
    # Turned by half about z through the middle of the tip it lies on the first: the mirror image, tied at no node, two parts.
    apart = run("reduce", put("deck.inp", part + "*END ASSEMBLY\n" + STEEL), "-o", folder / "body.sid", "--quiet", code=2).stderr
    expect("2 unconnected parts" in apart, f"two instances that nothing ties: {apart}")

    # Masses spread over elements.
    spread = plain + "*NONSTRUCTURAL MASS, ELSET=ALL, UNITS=TOTAL MASS\n0.5\n"
    near(reduce(put("deck.inp", spread))["mass"], wanted["mass"] + 0.5, 1e-9, "non-structural mass")

    # Nodes and elements that keywords make: the same block as written out. A temperature (degree of freedom 0) holds nothing.
    written, places = block((6, 2, 3), (0.3, 0.02, 0.03), "C3D8")
    frame = STEEL + "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL\n*BOUNDARY\nROOT, 1, 3\n"
    written_out = reduce(put("deck.inp", written + some("ROOT", places, lambda x, y, z: x == 0) + frame))

    def at(i, j, k):
        return 1 + i + 100 * j + 10000 * k

    made = "*NODE\n"
    for i, j, k in itertools.product((0, 6), (0, 2), (0, 3)):
        made += "%d, %g, %g, %g\n" % (at(i, j, k), 0.05 * i, 0.01 * j, 0.01 * k)
    for k, name in ((0, "LOW"), (3, "HIGH")):
        for j in (0, 2):
            made += "*NGEN, NSET=%s%d\n%d, %d\n" % (name, j, at(0, j, k), at(6, j, k))
        made += "*NFILL, NSET=%s\n%s0, %s2, 2, 100\n" % (name, name, name)
    made += "*NFILL, NSET=NALL\nLOW, HIGH, 3, 10000\n*NSET, NSET=ROOT\n"
    made += "".join("%d,\n" % at(0, j, k) for j in range(3) for k in range(4))
    corners = [at(i, j, k) for k in (0, 1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
    made += "*ELEMENT, TYPE=C3D8, ELSET=ALL\n" + ", ".join(map(str, [1, *corners])) + "\n"
    made += "*ELGEN, ELSET=ALL\n1, 6, 1, 1, 2, 100, 100, 3, 10000, 10000\n"
    generated = reduce(put("deck.inp", made + frame + "NALL, 0, 0\n"))
    near(generated["mass"], written_out["mass"], 1e-12, "mass of generated elements")
    for a, b in zip(generated["frequencies"], written_out["frequencies"]):
        near(a, b, 1e-6 * b, "frequency of generated elements")
    held = reduce(put("deck.inp", made + frame.replace("ROOT, 1, 3", "NALL, 0, 0\nROOT, 0, 3")))
    near(held["frequencies"][0], written_out["frequencies"][0], 1e-6 * held["frequencies"][0], "a range from degree of freedom 0")
    answer = run("reduce", put("deck.inp", made.replace("LOW, HIGH, 3", "LOW0, HIGH, 3")), "-o", folder / "body.sid", code=2).stderr
    expect("*NFILL: the sets have 7 and 21 nodes" in answer, f"uneven sets: {answer}")

    # Every refusal at once, each with its line and what to do instead.
    bad = plain + "*CONTACT PAIR, INTERACTION=X\nA, B\n*ELEMENT, TYPE=CPS4, ELSET=P\n1, 1, 2, 3, 4\n*NCOPY\n1, 2, 3\n"
    answer = run("reduce", put("deck.inp", bad), "-o", folder / "body.sid", code=2).stderr
    for words in ("*TIE", "mesh it with solids or shells", "*NCOPY"):
        expect(words in answer and answer.count("deck.inp:") >= 3, f"refusals: {answer}")
    # Of elements of a mesher whose properties are not there each property is told once.
    bare = "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,1.,1.,0.\n"
    bare += "CTRIA3,1,5,1,2,3\nCTRIA3,2,5,2,4,3\nCROD,3,6,1,2\nENDDATA\n"
    answer = run("reduce", put("deck.bdf", bare), "-o", folder / "body.sid", code=2).stderr
    for words in ("deck.bdf:5: CTRIA3: property 5 is not there: give its card (PSHELL", "deck.bdf:7: CROD: property 6 is not there"):
        expect(answer.count(words) == 1 and answer.count("is not there") == 2, f"missing properties: {answer}")
    # What a deck says beside the linear structure is told, not passed over in silence.
    beside = plain.replace("*DENSITY", "*DAMPING, ALPHA=10.\n*DENSITY") + "*INITIAL CONDITIONS, TYPE=STRESS\n1, 1, 1e8, 0, 0, 0, 0, 0\n"
    beside += "*STEP\n*STATIC\n*BOUNDARY\nROOT, 1, 3\n*MODEL CHANGE, TYPE=ELEMENT, REMOVE\n4\n*END STEP\n"
    told = reduce(put("deck.inp", beside))
    for words in ("TYPE=STRESS", "*MODEL CHANGE, REMOVE"):
        expect(any(words in w for w in told["warnings"]), f"{words}: {told['warnings']}")
    expect(any("*DAMPING" in n for n in told["notes"]), f"*DAMPING: {told['notes']}")
    # Heat and loads of steps, where the deck's own structure would be another one by them; loads alone are the scene's.
    hot = plain.replace("*DENSITY", "*EXPANSION\n1.2e-5\n*DENSITY").replace("2.1e11, 0.3", "2.1e11, 0.3, 20\n1e11, 0.3, 500")
    hot += "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nROOT, 20\n*BOUNDARY\nROOT, 1, 3\n*STEP\n*STATIC\n*TEMPERATURE\nROOT, 120\n*END STEP\n"
    perturbed = "*STEP, PERTURBATION\n*FREQUENCY\n4\n*END STEP\n"
    pulled = plain + "*BOUNDARY\nROOT, 1, 3\n*STEP\n*STATIC\n*CLOAD\n1, 1, 1e5\n*END STEP\n"
    for deck, told_of in (
        (hot, ("though elasticity depends on it", "does not expand by it")),
        (hot + perturbed, ("though elasticity depends on it", "does not expand by it", "as stiff as without them")),
        (pulled, ()),
        (pulled + perturbed, ("as stiff as without them",)),
        (pulled.replace("*CLOAD\n1, 1, 1e5\n", "") + perturbed, ()),
    ):
        told = [w for w in reduce(put("deck.inp", deck))["warnings"] if "STEP" in w or "TEMPERATURE" in w]
        expect(
            len(told) == len(told_of) and all(any(words in w for w in told) for words in told_of), f"loads of steps: {told}, not {told_of}"
        )

    # What is missing is named with the option that gives it; all of it.
    bare = plain.replace("*DENSITY\n7850\n", "").replace("*ELASTIC\n2.1e11, 0.3\n", "")
    answer = run("reduce", put("deck.inp", bare), "-o", folder / "body.sid", code=2).stderr
    expect("--density STEEL=" in answer and "--elastic STEEL=" in answer, f"what is missing: {answer}")
    given = reduce(put("deck.inp", bare + "*BOUNDARY\nROOT, 1, 3\n"), "--density", 7850, "--elastic", "STEEL=2.1e11,0.3")
    near(given["frequencies"][0], wanted["frequencies"][0], 1e-9 * wanted["frequencies"][0], "density and elasticity from options")

    # Millimetres and tonnes read as SI are told of, with the units that make steel of them; then nothing is told.
    small = (
        "".join(
            ", ".join([w[0], *("%.9g" % (1000 * float(v)) for v in w[1:])]) + "\n"
            if len(w := line.split(", ")) == 4 and "." in line and line[0].isdigit()
            else line + "\n"
            for line in plain.splitlines()
        )
        .replace("2.1e11, 0.3", "2.1e5, 0.3")
        .replace("7850", "7.85e-9")
    )
    wrong = reduce(put("deck.inp", small))
    expect(any("--units mm " in w for w in wrong["warnings"]), f"wrong units: {wrong['warnings']}")
    right = reduce(folder / "deck.inp", "--units", "mm")
    told = [w for w in right["warnings"] if "the mesh is coarse" not in w]
    expect(told == [] and abs(right["mass"] - wanted["mass"]) < 1e-9, f"right units: {right['warnings']}")

finish()
