"""Bodies reduced from layered shells and shells beside their nodes: what decks say of them, and their motion. Truth: the same plate written
otherwise, closed forms, or layers of solids by CalculiX 2.20."""

import json
import math

from program import *

CFRP = (1.4e11, 1e10, 0.3, 5e9, 5e9, 3.5e9)  # E1 E2 nu12 G12 G13 G23
RHO = 1600.0


def plate(length, width, cells, kind="S4", place=lambda x, y: (x, y, 0.0)):
    """Nodes and elements of a plate; its nodes' places, of the edges x = 0 and x = length too."""
    fine = 2 if kind in ("S8R", "S6") else 1
    numbers, rows = {}, []
    for i in range(cells[0]):
        for j in range(cells[1]):
            corners = [(fine * (i + a), fine * (j + b)) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
            parts = [corners] if kind in ("S4", "S8R") else [[corners[k] for k in part] for part in ((0, 1, 2), (0, 2, 3))]
            for part in parts:
                n = len(part)
                middles = [tuple((p + q) // 2 for p, q in zip(part[k], part[(k + 1) % n])) for k in range(n)] if fine == 2 else []
                rows.append([numbers.setdefault(at, len(numbers) + 1) for at in part + middles])
    places = {n: place(i * length / cells[0] / fine, j * width / cells[1] / fine) for (i, j), n in numbers.items()}
    ends = [[n for (i, _), n in numbers.items() if i == column] for column in (0, fine * cells[0])]
    return places, rows, ends


def inp(mesh, section, material=CFRP, kind="S4", more="", held=True):
    places, rows, ends = mesh
    text = "*NODE\n" + "".join(f"{n}, {x:.9g}, {y:.9g}, {z:.9g}\n" for n, (x, y, z) in places.items())
    text += f"*ELEMENT, TYPE={kind}, ELSET=E\n" + "".join(f"{e}, {', '.join(map(str, row))}\n" for e, row in enumerate(rows, 1))
    for name, nodes in zip(("ROOT", "TIP"), ends):
        text += f"*NSET, NSET={name}\n" + "".join(f"{n},\n" for n in nodes)
    text += f"*MATERIAL, NAME=M\n*ELASTIC, TYPE=LAMINA\n{', '.join(map(str, material))}\n*DENSITY\n{RHO}\n"
    text += "*MATERIAL, NAME=FOAM\n*ELASTIC\n1e8, 0.3\n*DENSITY\n80\n"
    return text + section + more + ("*BOUNDARY\nROOT, 1, 6\n" if held else "")


with temporary_folder() as name:
    folder = pathlib.Path(name)

    def reduced(text, *words, ending="inp"):
        (folder / f"deck.{ending}").write_text(text)
        done = run("reduce", folder / f"deck.{ending}", "-o", folder / "body.h5", "--quiet", "--json", *words)
        return json.loads(done.stdout)

    def told(result, word):
        return [w for w in result["warnings"] + result["notes"] if word in w]

    # The axis of an orientation's additional rotation is the shell's normal in Abaqus, and the next one the material's first: fibres along
    # x, or along y, are 3.7 times as stiff in bending.
    strip = plate(0.4, 0.1, (8, 2))
    section = "*SHELL SECTION, ELSET=E, MATERIAL=M, ORIENTATION=O\n0.004\n"
    along, across = (
        reduced(inp(strip, section, more=f"*ORIENTATION, NAME=O\n1, 0, 0, 0, 1, 0\n3, {angle}\n"))["frequencies"][0] for angle in (0, 90)
    )
    expect(along > 3.5 * across, f"fibres along and across: {along:g} and {across:g} Hz")
    for points, second, wanted in (
        ("0, 0, 1, 1, 0, 0", "1, 0\n", along),
        ("0, 0, 1, 1, 0, 0", "1, 90\n", across),
        ("0, 0, 1, 0, 1, 0", "1, 0\n", across),
        ("0, 1, 0, 0, 0, 1", "2, 0\n", along),
        ("0, 0, 1, 1, 0, 0", "", along),
    ):
        which = section if second.endswith("0\n") else "*SHELL SECTION, ELSET=E, COMPOSITE, ORIENTATION=O\n0.004, 3, M, 0\n"
        found = reduced(inp(strip, which, more=f"*ORIENTATION, NAME=O\n{points}\n{second}"))
        near(found["frequencies"][0], wanted, 1e-6 * wanted, f"orientation {points}, second line {second.strip()}")
        expect(told(found, "is taken for the normal"), f"no warning of CalculiX' other meaning: {points}, {second.strip()}")

    # *NODAL THICKNESS counts where the section asks for it, and scales the layers.
    axes = "*ORIENTATION, NAME=O\n1, 0, 0, 0, 1, 0\n3, 0\n"
    for kind in ("S4", "S8R"):
        mesh = plate(0.4, 0.1, (6, 2), kind)
        thicker = "*NODAL THICKNESS\n" + "".join(f"{n}, 0.006\n" for n in mesh[0])
        layers = "*SHELL SECTION, ELSET=E, COMPOSITE, ORIENTATION=O{}\n{}, 3, M, 0\n{}, 3, M, 90\n"
        wanted = reduced(inp(mesh, layers.format("", 0.002, 0.004), kind=kind, more=axes))
        asked = reduced(inp(mesh, layers.format(", NODAL THICKNESS", 0.001, 0.002), kind=kind, more=axes + thicker))
        near(asked["frequencies"][0], wanted["frequencies"][0], 1e-9 * wanted["frequencies"][0], f"{kind}: layers thicker at nodes")
        near(asked["mass"], wanted["mass"], 1e-9 * wanted["mass"], f"{kind}: their mass")
        plain = reduced(inp(mesh, layers.format("", 0.002, 0.004), kind=kind, more=axes + thicker.replace("0.006", "0.01")))
        near(plain["mass"], wanted["mass"], 1e-9 * wanted["mass"], f"{kind}: thicknesses that the section does not ask for")
        expect(told(plain, "NODAL THICKNESS counts only"), f"{kind}: thicknesses passed over without a word")

    # MAT8 without G1Z and G2Z is rigid against transverse shear, as in Nastran: a thin strip's frequency by its thickness.
    def bdf(thickness, across):
        places, rows, ends = plate(0.2, 0.1, (16, 4))
        text = "BEGIN BULK\n" + "".join(f"GRID,{n},,{x:.8f},{y:.8f},{z:.8f}\n" for n, (x, y, z) in places.items())
        text += "".join(f"CQUAD4,{e},1,{','.join(map(str, row))},0.\n" for e, row in enumerate(rows, 1))
        text += f"PCOMP,1\n+,1,{thickness},0.,YES,1,{thickness},0.,YES\nMAT8,1,1.4+11,1.+10,.3,5.+9,{across},1600.\n"
        return text + "".join(f"SPC1,1,123456,{n}\n" for n in ends[0]) + "ENDDATA\n"

    thin = reduced(bdf(0.0001, "5.+9,3.5+9"), ending="bdf")["frequencies"][0]
    thick = reduced(bdf(0.01, ","), ending="bdf")
    # The rotary inertia of a clamped strip ten times as long as thick takes 0.4 %.
    near(thick["frequencies"][0], 100 * thin, 0.006 * 100 * thin, "MAT8 without G1Z")
    expect(told(thick, "MAT8 without G1Z"), "no note of MAT8 without G1Z")
    expect(reduced(bdf(0.01, "5.+9,3.5+9"), ending="bdf")["frequencies"][0] < 0.97 * 100 * thin, "MAT8 with G1Z shears")

    # The transverse shear of a thick laminate does not depend on the way its elements lie. Layers of C3D20R: 135.65, 243.65 Hz.
    fibres = "*SHELL SECTION, ELSET=E, COMPOSITE, ORIENTATION=O\n0.1, 3, M, 0\n0.1, 3, M, 90\n"
    lowest = {}
    for kind, cells in (("S4", (16, 12)), ("S3", (16, 12)), ("S6", (6, 5)), ("S8R", (6, 5))):
        lowest[kind] = reduced(inp(plate(1.0, 0.8, cells, kind), fibres, kind=kind, more=axes), "--method", "eigen")["frequencies"][:2]
    for kind in ("S4", "S3", "S6"):
        for found, wanted in zip(lowest[kind], lowest["S8R"]):
            near(found, wanted, 0.006 * wanted, f"{kind}: a thick cross-ply")

    # Faces that bend each by itself on a soft core: more than a straight normal has. Layers of C3D20R: 60.7 Hz.
    thick_faces = "*SHELL SECTION, ELSET=E, COMPOSITE\n0.0208333, 3, STEEL\n0.0833333, 3, FOAM\n0.0625, 3, ALU\n"
    metals = "*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7850\n*MATERIAL, NAME=ALU\n*ELASTIC\n7e10, 0.33\n*DENSITY\n2700\n"
    for kind, cells in (("S4", (12, 10)), ("S3", (12, 10)), ("S8R", (8, 6))):
        found = reduced(inp(plate(1.0, 0.8, cells, kind), thick_faces, kind=kind, more=metals))
        text = "".join(told(found, "their layers shear one by one"))
        first = found["frequencies"][0]
        percent = text.partition(f"{first:.4g} Hz by ")[2].split(" ")[0]
        expect(percent, f"{kind}: no warning of a soft core: {text}")
        near(first * (1 + float(percent or 0) / 100), 60.7, 8, f"{kind}: thick faces on a soft core, with the estimate")

    # Nodes on the outer face of a pipe's half: the area is theirs, 5 % more than the wall's.
    def pipe(x, y):
        return x, 0.2 * math.sin(y / 0.2), 0.2 * math.cos(y / 0.2)

    for kind, cells in (("S4", (4, 12)), ("S8R", (2, 6))):
        for offset, place, wanted in ((0.5, pipe, True), (0.0, pipe, False), (0.5, lambda x, y: (x, y, 0.0), False)):
            wall = f"*SHELL SECTION, ELSET=E, MATERIAL=FOAM, OFFSET={offset}\n0.02\n"
            found = reduced(inp(plate(0.2, 0.6, cells, kind, place), wall, kind=kind))
            expect(bool(told(found, "beside their nodes")) == wanted, f"{kind}, offset {offset}: {found['warnings']}")

    # Spun about an axis in its plane: the same plate with its nodes in the middle and beside it; and a laminate that stretching bends.
    def spun(text, offset, rate, width=0.12):
        root = f"root=rigid:ROOT@0,{width / 2},{-offset:.9g}"
        (folder / "deck.inp").write_text(text)
        run("reduce", folder / "deck.inp", "-o", folder / "body.h5", "--quiet", "--interface", root, "--interface", "tip=average:TIP")
        (folder / "scene.toml").write_text(
            '[simulation]\nduration = 0.0001\noutput_rate = 10000\ngravity = [0, 0, 0]\nstart = "static"\n'
            '[[body]]\nname = "hub"\nkind = "rigid"\nmass = 1\ninertia = [1, 1, 1]\n'
            '[[body]]\nname = "b"\nkind = "modal"\nfile = "body.h5"\n'
            f'[[joint]]\nname = "turns"\nkind = "revolute"\nparent = "ground"\nchild = "hub"\naxis = [0, 1, 0.02]\nmotion = "{rate} * t"\n'
            f'[[joint]]\nname = "held"\nkind = "weld"\nparent = "hub"\nchild = "b.root"\nposition = [0.1, 0, {-offset:.9g}]\n'
            '[[output]]\nname = "tip"\nof = "b.tip"\nquantity = "displacement"\nrelative_to = "b.root"\n'
        )
        modes = json.loads(run("check", folder / "scene.toml", "--json").stdout)["modes"]
        run("simulate", folder / "scene.toml", "-o", folder / "out.h5", "--quiet")
        run("export", folder / "out.h5", "--to", "csv", "-o", folder / "out.csv", "--quiet")
        return [m["frequency"] for m in modes if m["kind"] == "vibration"][:4], history(folder / "out.csv")

    panel = (0.3, 0.12, (8, 4), "S8R")
    # Layers of C3D20R by CalculiX: centrifugal step, then frequencies.
    for layers, solids in (((0.003, 0), (51.575, 104.494, 316.73)), ((0.003, 0, 0.003, 90), (49.954, 172.139, 306.358))):
        results = []
        for offset in (0.0, 1.5):
            thickness = sum(layers[::2])
            mesh = plate(*panel, place=lambda x, y: (x, y, -offset * thickness))
            section = f"*SHELL SECTION, ELSET=E, COMPOSITE, ORIENTATION=O, OFFSET={-offset}\n"
            section += "".join(f"{t}, 3, M, {angle}\n" for t, angle in zip(layers[::2], layers[1::2]))
            results.append(spun(inp(mesh, section, kind="S8R", more=axes, held=False), offset * thickness, 80))
        for frequencies, _ in results:
            for found, wanted in zip(frequencies, solids):
                near(found, wanted, 0.01 * wanted, f"{len(layers) // 2} layers that spin")
    # The laminate bends as it is stretched.
    found, wanted = (columns["tip.z"][0] for _, columns in results[::-1])
    near(found, wanted, 0.01 * abs(wanted), "what the tip of nodes beside the middle moves by")

finish()
