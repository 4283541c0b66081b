"""Words of decks that were passed over: motions that averaging elements leave free, shells soft against transverse shear (sandwiches,
thick plates of triangles), springs on arms, directions of beams, solids numbered the other way round. Formulas are the truth."""
import json
import math
import pathlib

import numpy as np
from program import *
from rod_deck import rod_deck

pi = math.pi
SPAN, ACROSS, CELLS = 1.0, 0.02, 12  # a beam and its square section, m; cells of a plate's edge
YOUNG, STEEL = 2.1e11, 7850.0
BEAM = math.sqrt(YOUNG * ACROSS**2 / 12 / STEEL) / (2 * pi * SPAN**2)
HINGED, CLAMPED, FREE = 15.4182 * BEAM, 22.3733 * BEAM, 3.51602 * BEAM


def reduced(name, text, *words, modes=4):
    (folder / name).write_text(text)
    done = run("reduce", folder / name, "-o", folder / "body.h5", "--modes", modes, "--json", *words)
    return json.loads(done.stdout) if done.returncode == 0 else {"frequencies": [0.0] * modes, "warnings": [], "notes": []}


def beam_on_four(mean, far="123456"):
    """A beam whose first grid hangs on four held grids by an averaging element; Nastran."""
    n = 12
    text = "SOL 103\nCEND\nBEGIN BULK\n" + "".join(f"GRID,{i + 1},,{i * SPAN / n:.9g},0.,0.\n" for i in range(n + 1))
    text += "".join(f"CBAR,{i + 1},1,{i + 1},{i + 2},0.,1.,0.\n" for i in range(n))
    text += f"PBAR,1,1,{ACROSS**2:.9g},{ACROSS**4 / 12:.9g},{ACROSS**4 / 12:.9g},{0.141 * ACROSS**4:.9g}\nMAT1,1,{YOUNG:.3e},,.3,{STEEL}\n"
    text += "".join(f"GRID,{101 + k},,0.,{y},{z}\n" for k, (y, z) in enumerate(((0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1))))
    text += "CQUAD4,200,2,101,102,103,104\nPSHELL,2,1,.01,1,,1\n" + mean
    return text + f"SPC1,1,{far},{n + 1}\nSPC1,1,123456,101,102,103,104\nENDDATA\n"


def averaging():
    for motions, wanted in (("123456", CLAMPED), ("123", HINGED)):
        found = reduced("mean.bdf", beam_on_four(f"RBE3,300,,1,{motions},1.,123,101,102,+A\n+A,103,104\n"))["frequencies"]
        near(found[0], wanted, 3e-3 * wanted, f"RBE3 of the motions {motions}")
    # One turn is free: about y the beam is hinged, about z it is not.
    found = reduced("mean.bdf", beam_on_four("RBE3,300,,1,12346,1.,123,101,102,+A\n+A,103,104\n"))["frequencies"]
    near(found[0], HINGED, 3e-3 * HINGED, "RBE3 that leaves the turn about y")
    near(found[1], CLAMPED, 3e-3 * CLAMPED, "the other direction")
    n = 12
    text = "*NODE\n" + "".join(f"{i + 1}, {i * SPAN / n:.9g}, 0, 0\n" for i in range(n + 1))
    text += "101, 0, .1, .1\n102, 0, -.1, .1\n103, 0, -.1, -.1\n104, 0, .1, -.1\n*ELEMENT, TYPE=B33, ELSET=B\n"
    text += "".join(f"{i + 1}, {i + 1}, {i + 2}\n" for i in range(n)) + "*ELEMENT, TYPE=S4, ELSET=S\n200, 101, 102, 103, 104\n"
    text += f"*MATERIAL, NAME=M\n*ELASTIC\n{YOUNG}, .3\n*DENSITY\n{STEEL}\n*BEAM SECTION, ELSET=B, MATERIAL=M, SECTION=RECT\n"
    text += f"{ACROSS}, {ACROSS}\n*SHELL SECTION, ELSET=S, MATERIAL=M\n.01\n*NSET, NSET=SS\n101, 102, 103, 104\n"
    text += "*SURFACE, NAME=SU, TYPE=NODE\nSS, 1.\n*COUPLING, CONSTRAINT NAME=C, REF NODE=1, SURFACE=SU\n*DISTRIBUTING\n"
    for motions, wanted in (("", CLAMPED), ("1, 3\n", HINGED)):
        found = reduced("mean.inp", text + motions + f"*BOUNDARY\n{n + 1}, 1, 6\nSS, 1, 6\n")["frequencies"]
        near(found[0], wanted, 1e-2 * wanted, f"*DISTRIBUTING {motions.strip() or 'of all motions'}")


def square(kind):
    """Nodes and elements of a plate of 1 m with edges on hinges that do not turn along the edge: theory has a closed form then."""
    step = 2 if kind == "S8R" else 1
    n = CELLS * step
    number = {(i, j): 1 + i + (n + 1) * j for j in range(n + 1) for i in range(n + 1) if not (step == 2 and i % 2 and j % 2)}
    text = "*NODE\n" + "".join(f"{k}, {i / n:.9g}, {j / n:.9g}, 0\n" for (i, j), k in number.items())
    elements = []
    for i, j in np.ndindex(CELLS, CELLS):
        c = [(step * a, step * b) for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))]
        if kind == "S3":
            elements += [[number[k] for k in (c[0], c[1], c[2])], [number[k] for k in (c[0], c[2], c[3])]]
            continue
        middles = [((c[k][0] + c[k - 3][0]) // 2, (c[k][1] + c[k - 3][1]) // 2) for k in range(4)] if step == 2 else []
        elements.append([number[k] for k in c + middles])
    edge = lambda at: [k for ij, k in number.items() if at(ij)]
    across, along = edge(lambda ij: ij[0] in (0, n)), edge(lambda ij: ij[1] in (0, n))
    return text, elements, across, along


def plate(kind, section):
    text, elements, across, along = square(kind)
    text += f"*ELEMENT, TYPE={kind}, ELSET=E\n" + "".join(f"{k + 1}, {', '.join(map(str, e))}\n" for k, e in enumerate(elements))
    text += "*MATERIAL, NAME=FACE\n*ELASTIC\n7e10, .33\n*DENSITY\n2700\n*MATERIAL, NAME=CORE\n*ELASTIC\n5.2e7, .3\n*DENSITY\n50\n" + section
    for name, edge, turn in (("X", across, 4), ("Y", along, 5)):
        text += f"*NSET, NSET={name}\n" + "".join(f"{k},\n" for k in edge) + f"*BOUNDARY\n{name}, 1, 3\n{name}, {turn}, {turn}\n"
    return text


def soft_shells():
    # Faces of 1 mm on a core of 20 mm whose shear modulus is 20 MPa: without shear 163.5 Hz.
    E, nu, face, core, G = 7e10, 0.33, 1e-3, 20e-3, 2e7
    waves = 2 * pi**2
    D = E / (1 - nu**2) * (face * (core + face) ** 2 / 2 + face**3 / 6)
    S, mass = G * (core + face) ** 2 / core, 2 * 2700 * face + 50 * core
    wanted = math.sqrt(D * waves**2 / (1 + D * waves / S) / mass) / (2 * pi)
    layers = f"*SHELL SECTION, ELSET=E, COMPOSITE\n{face}, 3, FACE\n{core}, 3, CORE\n{face}, 3, FACE\n"
    for kind in ("S4", "S3", "S8R"):
        told = reduced("plate.inp", plate(kind, layers))
        near(told["frequencies"][0], wanted, 6e-3 * wanted, f"sandwich of {kind}")
        expect(not any("no solid" in w for w in told["warnings"]), f"a foam is a solid: {told['warnings']}")
    # The same by Nastran's stiffness of bending and its material of transverse shear.
    text, elements, across, along = square("S4")
    rows = [row.replace(" ", "").split(",") for row in text.splitlines()[1:]]
    deck = "SOL 103\nCEND\nBEGIN BULK\n" + "".join(f"GRID,{r[0]},,{float(r[1]):.8f},{float(r[2]):.8f},0.\n" for r in rows)
    deck += "".join(f"CQUAD4,{k + 1},1,{','.join(map(str, e))}\n" for k, e in enumerate(elements))
    bend, shear = 12 * D * (1 - nu**2) / E / (2 * face) ** 3, (core + face) ** 2 / core / (2 * face)
    deck += f"MAT1,1,7.+10,,.33,2700.\nMAT1,2,,{G:.1f},.3,50.\n"
    deck += "".join(f"SPC1,1,1234,{k}\n" for k in across) + "".join(f"SPC1,1,1235,{k}\n" for k in along)
    sandwich = f"PSHELL,1,1,{2 * face},1,{bend:.6g},2,{shear:.6g},{50 * core}\n"
    found = reduced("plate.bdf", deck + sandwich + "ENDDATA\n")["frequencies"][0]
    near(found, wanted, 6e-3 * wanted, "PSHELL with MID3 of a core")
    stiff = reduced("plate.bdf", deck + sandwich.replace(f",2,{shear:.6g}", ",,") + "ENDDATA\n")
    rigid = math.sqrt(D * waves**2 / mass) / (2 * pi)
    near(stiff["frequencies"][0], rigid, 6e-3 * rigid, "PSHELL without MID3")
    expect(any("rigid against transverse shear" in n for n in stiff["notes"]), f"which is told: {stiff['notes']}")
    # A thick plate of triangles: shear takes 2.8 %, the turning of its mass 0.8 %.
    h = 0.1
    D, S = E * h**3 / 12 / (1 - nu**2), 5 / 6 * E / 2 / (1 + nu) * h
    M = np.diag([2700 * h, 2700 * h**3 / 12])  # deflection, turn in the direction of the waves
    k = math.sqrt(waves)
    K = np.array([[S * k * k, S * k], [S * k, S + D * k * k]])
    wanted = math.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).min()) / (2 * pi)
    for kind in ("S3", "S4"):
        found = reduced("plate.inp", plate(kind, f"*SHELL SECTION, ELSET=E, MATERIAL=FACE\n{h}\n"))["frequencies"][0]
        near(found, wanted, 8e-3 * wanted, f"thick plate of {kind}")


def inertia():
    """A strip of one row of shells has its mass at its edges: three times the moment of inertia about its axis, which is told."""
    for rows, told_of in ((1, True), (16, False)):
        n = 20
        number = lambda i, j: 1 + i + (n + 1) * j
        text = "*NODE\n" + "".join(f"{number(i, j)}, {i / n}, {0.1 * j / rows + 3}, 0\n" for j in range(rows + 1) for i in range(n + 1))
        text += "*ELEMENT, TYPE=S4, ELSET=E\n"
        for i, j in np.ndindex(n, rows):
            text += f"{1 + i + n * j}, {number(i, j)}, {number(i + 1, j)}, {number(i + 1, j + 1)}, {number(i, j + 1)}\n"
        text += f"*MATERIAL, NAME=M\n*ELASTIC\n{YOUNG}, .3\n*DENSITY\n{STEEL}\n*SHELL SECTION, ELSET=E, MATERIAL=M\n.001\n"
        said = [w for w in reduced("strip.inp", text)["warnings"] if "moment of inertia" in w]
        expect(bool(said) == told_of, f"a strip of {rows} rows: {said}")
        if told_of:
            share = float(said[0].split("centre of mass ")[1].split(" %")[0])
            near(share, 200, 5, "the moment of inertia about the strip is too large by per cent")


def bushes():
    """A mass on a spring that lies on arms between its grids."""
    length, mass, J, k, kr = 0.4, 3.0, 0.05, 2e5, 700.0
    head = (
        "SOL 103\nCEND\nBEGIN BULK\nGRID,1,,0.,0.,0.,,123456\n"
        + f"GRID,2,,{length},0.,0.,,1345\nCONM2,5,2,,{mass},,,,,+A\n+A,1.,,1.,,,{J}\n"
    )
    for way, place in (("", 0.5), (",+B\n+B,0.2", 0.2), (",+B\n+B,,0,0.1,0.,0.", 0.25)):
        for frame in ("0.,1.,0.,", ",,,0"):
            bush = f"CBUSH,9,9,1,2,{frame}{way}\nPBUSH,9,B,1.,,,,,,+C\n+C,,K,1.e6,{k},{k},{kr},{kr},{kr}\nENDDATA\n"
            arm = place * length - length
            K = np.array([[k, k * arm], [k * arm, k * arm**2 + kr]])
            wanted = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(np.diag([mass, J]), K)))) / (2 * pi)
            found = reduced("bush.bdf", head + bush, modes=2)["frequencies"]
            for f, w in zip(found, wanted):
                near(f, w, 1e-6 * w, f"CBUSH at {place} of its length")


def directions():
    """The node behind a beam's own gives the first direction of its section."""
    n = 16
    text = "*NODE\n" + "".join(f"{i + 1}, {i * SPAN / n:.9g}, 0, 0\n" for i in range(n + 1)) + "1000, .3, 1, 0\n"
    text += "*ELEMENT, TYPE=B31, ELSET=B\n" + "".join(f"{i + 1}, {i + 1}, {i + 2}, 1000\n" for i in range(n))
    text += (
        f"*MATERIAL, NAME=M\n*ELASTIC\n{YOUNG}, .3\n*DENSITY\n{STEEL}\n*BEAM SECTION, ELSET=B, MATERIAL=M, SECTION=RECT\n{ACROSS}, .005\n"
    )
    text += "*NSET, NSET=ALL, GENERATE\n1, 17\n*BOUNDARY\n1, 1, 6\nALL, 3, 3\nALL, 5, 5\n"
    found = reduced("beam.inp", text, modes=2)["frequencies"][0]
    near(found, FREE, 5e-3 * FREE, "a beam bends about its stiff axis")


def handedness():
    """Solids seen from the other side, and lines that go on under names with two signs."""
    grids = {(i, j, k): 1 + i + 5 * (j + 2 * k) for k in range(2) for j in range(2) for i in range(5)}
    out = []
    for ring in (((0, 0), (1, 0), (1, 1), (0, 1)), ((0, 0), (0, 1), (1, 1), (1, 0))):
        deck = "SOL 103\nCEND\nBEGIN BULK\n" + "".join(
            f"GRID,{n},,{0.1 * i:.1f},{0.1 * j:.1f},{0.1 * k:.1f}\n" for (i, j, k), n in grids.items()
        )
        for i in range(4):
            corners = [grids[i, *jk] for jk in ring] + [grids[i + 1, *jk] for jk in ring]
            deck += (
                "CHEXA   "
                + "".join(f"{x:<8}" for x in (i + 1, 1, *corners[:6]))
                + f"+{i:06}\n"
                + f"++{i:06}"
                + "".join(f"{x:<8}" for x in corners[6:])
                + "\n"
            )
        deck += (
            f"PSOLID,1,1\nMAT1,1,{YOUNG:.3e},,.3,{STEEL}\n"
            + "".join(f"SPC1,1,123,{n}\n" for at, n in grids.items() if at[0] == 0)
            + "ENDDATA\n"
        )
        out.append(reduced("bar.bdf", deck)["frequencies"])
    for a, b in zip(*out):
        near(b, a, 1e-9 * a, "solids either way round")
    expect(out[0][0] > 100, "the bar has frequencies")


def turning_interfaces():
    """An interface at a grid that carries a mass on a rigid arm turns freely only where no beam ends there."""
    n = 4
    text = "SOL 103\nCEND\nBEGIN BULK\n" + "".join(f"GRID,{i + 1},,{i * SPAN / n:.9g},0.,0.\n" for i in range(n + 1))
    text += "".join(f"CBAR,{i + 1},1,{i + 1},{i + 2},0.,1.,0.\n" for i in range(n))
    text += f"PBAR,1,1,{ACROSS**2:.9g},{ACROSS**4 / 12:.9g},{ACROSS**4 / 12:.9g},{0.141 * ACROSS**4:.9g}\nMAT1,1,{YOUNG:.3e},,.3,{STEEL}\n"
    text += f"GRID,50,,{SPAN},0.1,0.\nCONM2,60,50,0,0.5\nRBE2,61,{n + 1},123456,50\nENDDATA\n"
    told = reduced("arm.bdf", text, "--hold", "none", "--interface", "root=1", "--interface", f"tip={n + 1}")
    expect(told["frequencies"][0] > 1, "the beam with a mass on an arm is reduced")
    expect(not any("resists no turn" in w for w in told["warnings"]), f"the beam holds its end: {told['warnings']}")


def turning_means():
    """RBE3 that counts all six motions of its grids: the weighted mean of translations and turns, which weigh by the mean distance squared;
    MPC with its shares is the same."""
    nx, ny = 6, 2
    grids = {(i, j): 1 + i + (nx + 1) * j for j in range(ny + 1) for i in range(nx + 1)}
    place = {n: np.array([0.05 * i, 0.05 * j, 0.0]) for (i, j), n in grids.items()}
    bulk = "".join(f"GRID,{n},,{x[0]:.9g},{x[1]:.9g},0.\n" for n, x in place.items())
    for k, (i, j) in enumerate(((i, j) for i in range(nx) for j in range(ny)), 1):
        bulk += f"CQUAD4,{k},1,{grids[i, j]},{grids[i + 1, j]},{grids[i + 1, j + 1]},{grids[i, j + 1]}\n"
    bulk += f"PSHELL,1,1,.004,1,,1\nMAT1,1,{YOUNG:.3e},,.3,{STEEL}\n" + "".join(f"SPC1,1,123456,{grids[0, j]}\n" for j in range(ny + 1))
    point = np.array([0.33, 0.04, 0.02])
    bulk += f"GRID,900,,{point[0]},{point[1]},{point[2]}\nCONM2,901,900,,.5\n"
    for ids in ([grids[nx, j] for j in range(ny + 1)], [grids[nx, 0], grids[nx, 1], grids[nx - 1, 0]]):
        arms = [place[n] - point for n in ids]
        length = np.mean([np.linalg.norm(r) for r in arms])
        weighed = []
        for x, y, z in arms:
            motion = np.eye(6)
            motion[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
            weighed.append((motion, motion.T @ np.diag([1.0] * 3 + [length**2] * 3)))
        shares = np.linalg.solve(sum(w @ m for m, w in weighed), np.hstack([w for _, w in weighed]))
        equations = ""
        for d in range(6):
            terms = [(900, d + 1, -1.0)] + [(n, e + 1, shares[d, 6 * k + e]) for k, n in enumerate(ids) for e in range(6)]
            terms = [t for t in terms if abs(t[2]) > 1e-13]
            rows = ["".join(f",{n},{e},{c:.10e}" for n, e, c in terms[k : k + 2]) for k in range(0, len(terms), 2)]
            equations += "MPC,3" + "\n,".join(rows) + "\n"
        wanted = reduced("mean.bdf", f"BEGIN BULK\n{bulk}{equations}ENDDATA\n")["frequencies"]
        mean = f"RBE3,500,,900,123456,1.,123456,{ids[0]},{ids[1]}\n,{ids[2]}\n"
        found = reduced("mean.bdf", f"BEGIN BULK\n{bulk}{mean}ENDDATA\n")["frequencies"]
        for a, b in zip(found, wanted):
            near(a, b, 1e-6 * b, "RBE3 of translations and turns")
    told = reduced("mean.bdf", f"BEGIN BULK\n{bulk}{mean.replace('1.,123456', '1.,12346')}ENDDATA\n")["warnings"]
    expect(any("takes translations of its grids alone" in w for w in told), f"RBE3 of some turns: {told}")


def turned(points, degrees=35.0):
    """About (1, 2, 3)."""
    n = np.array([1.0, 2.0, 3.0]) / math.sqrt(14)
    a = math.radians(degrees)
    return [math.cos(a) * p + math.sin(a) * np.cross(n, p) + (1 - math.cos(a)) * (n @ p) * n for p in map(np.array, points)]


def idle_turns():
    """Turns that move nothing, about an edge that an interface holds and of a beam without torsion, whatever way the body lies."""
    lines = rod_deck(YOUNG, STEEL, 0.4, 0.08, 0.06, 6).splitlines()
    rows = [k for k, line in enumerate(lines) if k > 0 and not line.startswith("*") and k < lines.index("*ELEMENT, TYPE=C3D8I, ELSET=ROD")]
    places = [[float(x) for x in lines[k].split(",")[1:]] for k in rows]
    tip = len(places) - 4
    wanted = None
    for own in (places, turned(places)):
        for k, n, x in zip(rows, range(1, len(rows) + 1), own):
            lines[k] = f"{n}, " + ", ".join(f"{c:.12g}" for c in x)
        beside = ",".join(f"{c:.9g}" for c in 1.02 * np.array(own[tip]) + 0.3 * (np.array(own[tip + 2]) - own[tip]))
        for point in ("", f"@{beside}"):
            deck = "\n".join(lines) + f"\n*NSET, NSET=EDGE\n{tip + 1}, {tip + 2}\n"
            found = reduced("edge.inp", deck, "--interface", f"edge=rigid:EDGE{point}", "--method", "eigen")["frequencies"]
            wanted = wanted or found
            for a, b in zip(found, wanted):
                near(a, b, 1e-5 * b, f"free bar with an interface on an edge{point and ', of a point beside it'}")
    corners = [(0, 0, 0), (0.5, 0, 0), (0.2, 0.4, 0), (0.2, 0.1, 0.5), (-0.2, 0, 0), (-0.4, 0, 0), (0.1, 0.2, 1)]
    wanted = None
    for own in (corners, turned(corners)):
        direction = ",".join(f"{c:.7f}" for c in own[6])
        text = "SOL 103\nCEND\nBEGIN BULK\n" + "".join(f"GRID,{k},,{x:.10f},{y:.10f},{z:.10f}\n" for k, (x, y, z) in enumerate(own[:6], 1))
        ends = [(1, 2), (2, 3), (3, 1), (1, 4), (2, 4), (3, 4), (1, 5), (5, 6)]
        text += "".join(f"CBAR,{e},{1 + (e > 6)},{a},{b},{direction}\n" for e, (a, b) in enumerate(ends, 1))
        text += f"PBAR,1,1,4.-4,1.333-8,1.333-8,2.-8\nPBAR,2,1,4.-4,1.333-8,1.333-8\nMAT1,1,{YOUNG:.3e},,.3,{STEEL}\nENDDATA\n"
        found = reduced("frame.bdf", text, "--method", "eigen")["frequencies"]
        wanted = wanted or found
        for a, b in zip(found, wanted):
            near(a, b, 1e-5 * b, "free frame with a beam without torsion")


def hourglass():
    """A single node of a single layer with reduced integration gives way in motions that its points do not see; a face does not."""
    n, number, elements = 4, {}, []
    cell = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    cell += [tuple((p + q) // 2 for p, q in zip(cell[a], cell[b])) for a, b in edges]
    for i in range(n):
        elements.append([number.setdefault((2 * i + x, y, z), len(number) + 1) for x, y, z in cell])
    text = "*NODE\n" + "".join(f"{k}, {0.05 * x:.9g}, {0.03 * y:.9g}, {0.03 * z:.9g}\n" for (x, y, z), k in number.items())
    text += "*ELEMENT, TYPE=C3D20R, ELSET=E\n"
    text += "".join(f"{e}, {', '.join(map(str, k[:12]))},\n{', '.join(map(str, k[12:]))}\n" for e, k in enumerate(elements, 1))
    for name, x in (("ROOT", 0), ("TIP", 2 * n)):
        text += f"*NSET, NSET={name}\n" + "".join(f"{k}\n" for at, k in number.items() if at[0] == x)
    text += f"*MATERIAL, NAME=M\n*ELASTIC\n{YOUNG}, .3\n*DENSITY\n{STEEL}\n*SOLID SECTION, ELSET=E, MATERIAL=M\n*BOUNDARY\nROOT, 1, 3\n"
    for where, told in ((number[2 * n, 0, 0], True), ("rigid:TIP", False)):
        warnings = reduced("layer.inp", text, "--interface", f"tip={where}")["warnings"]
        expect(any("interfaces 'tip' that of the small stiffness" in w for w in warnings) == told, f"{where}: {warnings}")


def chosen():
    """What decks say twice, or choose and do not have, is told or refused."""
    n = 4
    bulk = "".join(f"GRID,{i + 1},,{i * SPAN / n:.9g},0.,0.\n" for i in range(n + 1))
    bulk += "".join(f"CBAR,{i + 1},1,{i + 1},{i + 2},0.,1.,0.\n" for i in range(n))
    bulk += f"PBAR,1,1,{ACROSS**2:.9g},{ACROSS**4 / 12:.9g},{ACROSS**4 / 12:.9g},{0.141 * ACROSS**4:.9g}\nMAT1,1,{YOUNG:.3e},,.3,{STEEL}\n"
    bulk += f"SPC1,1,123456,1\nSPC1,2,123456,{n + 1}\n"
    for control, more, wanted in (
        ("SPC = 1\n", "", ""),
        ("SUBCASE 1\nSPC = 1\nSUBCASE 2\nSPC = 2\n", "", "subcases choose SPC = 1 and 2"),
        ("SPC = 7\n", "", "there is no SPC of set 7"),
        ("SPC = 1\nMPC = 3\n", "", "there is no MPC of set 3"),
        ("SPC = 9\n", "SPCADD,9,1,5\n", "there is no SPC of set 5"),
    ):
        warnings = reduced("chosen.bdf", f"SOL 103\nCEND\n{control}BEGIN BULK\n{bulk}{more}ENDDATA\n")["warnings"]
        told = [w for w in warnings if "choose" in w]
        expect(bool(told) == bool(wanted) and wanted in "".join(told), f"{control}{more}: {told}")
    grids = "GRID,21,,1.,.1,0.\nGRID,22,,1.,.2,0.\n"
    for more, wanted in (
        (grids + "RBE2,30,5,123456,21,22,21,22,21,22\n", "'22' is the tenth field"),
        ("BEGIN SUPER=1\n", "superelements"),
    ):
        (folder / "refused.bdf").write_text(f"SOL 103\nCEND\nBEGIN BULK\n{bulk}{more}ENDDATA\n")
        said = run("reduce", folder / "refused.bdf", "-o", folder / "body.h5", code=2).stderr
        expect(wanted in said, f"{more}: {said}")
    steel, sections = f"*MATERIAL, NAME=M\n*ELASTIC\n{YOUNG}, .3\n*DENSITY\n{STEEL}\n", "*SOLID SECTION, ELSET=E, MATERIAL=M\n"
    light = steel.replace("NAME=M", "NAME=N").replace(str(STEEL), "2700.")
    corners = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    nodes = "".join(f"{k}, {x}, {y}, {z}\n" for k, (x, y, z) in enumerate(corners, 1))
    cube = "*ELEMENT, TYPE=C3D8I, ELSET=E\n1, 1, 2, 3, 4, 5, 6, 7, 8\n"
    mass = "*ELEMENT, TYPE=MASS, ELSET=P\n9, 1\n"
    for text, wanted in (
        (nodes + cube + steel + sections, ""),
        (nodes + cube + steel + light + sections + sections.replace("=M", "=N"), "element 1 has a section already"),
        (nodes + cube + steel + "*DENSITY\n2700.\n" + sections, "*DENSITY a second time"),
        (nodes + cube + steel + "*ELASTIC\n7e10, .3\n" + sections, "*ELASTIC a second time"),
        (nodes + cube + mass + steel + sections, "have no mass"),
        (nodes.replace("1, 0, 0, 0\n", "1, 0, 0, 0, 0, 0, 1\n") + cube + steel + sections, "numbers behind the coordinates"),
    ):
        warnings = reduced("twice.inp", "*NODE\n" + text)["warnings"]
        told = [w for w in warnings if "coarse" not in w]
        expect(len(told) == bool(wanted) and wanted in "".join(told), f"{wanted}: {told}")
    (folder / "twice.inp").write_text("*NODE\n" + nodes + cube + steel + light.replace("NAME=N", "NAME=m") + sections)
    said = run("reduce", folder / "twice.inp", "-o", folder / "body.h5", code=2).stderr
    expect("twice.inp:17: *MATERIAL: 'm' is there already" in said, said)


with temporary_folder() as name:
    folder = pathlib.Path(name)
    for case in (
        averaging,
        soft_shells,
        inertia,
        bushes,
        directions,
        handedness,
        turning_interfaces,
        turning_means,
        idle_turns,
        hourglass,
        chosen,
    ):
        case()

finish()
