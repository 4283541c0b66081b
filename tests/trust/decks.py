"""Bodies reduced from random decks against CalculiX:  decks.py FLEXFRAME [--count N] [--seed S] [--number N]

Bars and blocks of all solid elements whose matrices are alike in both programs, hexahedra and wedges mixed, and shells, with what
decks have beside elements: materials in axes of their own, two materials, supports in turned or cylindrical directions, masses at nodes,
springs, equations, rigid bodies with a mass, units; written for Abaqus or, the same model, as Nastran bulk data (coordinate systems, all
three forms of fields, RBE2, CONM2, CELAS2, MPC). CalculiX computes the mesh of the Abaqus deck. Compared are, one by one, the first six
frequencies, the stresses of these modes at all nodes of the surface, and, of free bodies that a scene welds to the ground at an interface,
the deflection of another one (a rigid, an averaging one, a node) under a force, and the stress there. Wrong is, without a warning: 1 % of a
frequency or deflection, 2 % of the largest von Mises stress (shells, which are bricks in CalculiX and 1 to 3 % too stiff at a clamp: 3 %
of a frequency, 4 % of a deflection, no stress). Exit 1 if there is one, or a deck is refused.
"""
import csv
import json
import pathlib
import re
import subprocess
import sys
from fractions import Fraction

import h5py
import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).parents[k]) for k in (0, 1)] + [str(pathlib.Path(__file__).parents[1] / "decks")]
from arguments import judge_each, suite_parser  # noqa: E402
from meshed import KINDS, MIDDLES, Mesh, calculix, parts, set_of  # noqa: E402
from scene import force, output, pick, simulation, weld  # noqa: E402
from stress_table import read_frd  # noqa: E402

MODES = 6
UNITS = {"m": (1.0, 1.0), "mm": (1e-3, 1e3), "mm-kg-s": (1e-3, 1.0), "cm-g-s": (1e-2, 1e-3)}  # metres, kilograms
NASTRAN = {"C3D20": "CHEXA", "C3D10": "CTETRA", "C3D15": "CPENTA"}
ORDER_20 = [*range(12), 16, 17, 18, 19, 12, 13, 14, 15]
ORDER_15 = [*range(9), 12, 13, 14, 9, 10, 11]


class Mixed(Mesh):
    """Hexahedra of 20 nodes, some columns of them cut into wedges of 15."""

    def __init__(self, r, counts, place):
        super().__init__("C3D20", (1, 1, 1), place)
        self.nodes, self.points, self.elements, self.kinds = {}, [], [], []
        cut = {c for c in np.ndindex(*counts[:2]) if r.random() < 0.5}
        for cell in np.ndindex(*counts):
            form = "wedge" if cell[:2] in cut else "hex"
            for part in parts(form, cell):
                corners = [tuple(Fraction(c + p, n) for c, p, n in zip(cell, q, counts)) for q in part]
                between = [tuple((x + y) / 2 for x, y in zip(corners[a], corners[b])) for a, b in MIDDLES[form]]
                for at in corners + between:
                    if at not in self.nodes:
                        self.points.append(place(*map(float, at)))
                        self.nodes[at] = len(self.points)
                self.elements.append([self.nodes[at] for at in corners + between])
                self.kinds.append("C3D15" if form == "wedge" else "C3D20")

    def text(self):
        lines = ["*NODE, NSET=ALL"] + [f"{i}, {x:.13g}, {y:.13g}, {z:.13g}" for i, (x, y, z) in enumerate(self.points, 1)]
        for kind in dict.fromkeys(self.kinds):
            lines.append(f"*ELEMENT, TYPE={kind}, ELSET=BODY")
            for i, (e, k) in enumerate(zip(self.elements, self.kinds), 1):
                row = [i, *e]
                if k == kind:
                    lines.append(",\n".join(", ".join(map(str, row[a : a + 10])) for a in range(0, len(row), 10)))
        return "\n".join(lines) + "\n"


def axes(r):
    """Two directions at right angles."""
    q, _ = np.linalg.qr(np.array([[r.gauss(0, 1) for _ in range(3)] for _ in range(3)]))
    if np.linalg.det(q) < 0:
        q[:, 2] *= -1
    return q


def numbers(values):
    return ", ".join(f"{v:.12g}" for v in values)


class Deck:
    """`abaqus`: the deck without its step; `nastran`: the same model, or None. `flat`: shells."""

    def __init__(self, r):
        kind = pick(r, "C3D8", "C3D20", "C3D20R", "C3D10", "C3D15", "mixed", "S8R")
        self.flat = kind == "S8R"
        self.unit = pick(r, *UNITS)
        m, kg = UNITS[self.unit]
        L, B = r.uniform(0.2, 1) / m, r.uniform(0.05, 0.2) / m
        H = B * (r.uniform(0.02, 0.06) if self.flat else r.uniform(0.4, 1))
        counts = (10, 4, 1) if self.flat else (r.randint(3, 6), 2, 2) if kind != "C3D8" else (r.randint(4, 9), 3, 3)
        bent, turn = r.uniform(-0.3, 0.3), axes(r)
        shift = np.array([r.uniform(-1, 1) for _ in range(3)]) / m

        def place(x, y=0.5, z=0.5):
            s = 1 - 0.3 * x
            at = np.array([x * L, (y - 0.5) * B * s, bent * L * x * x + (0.0 if self.flat else (z - 0.5) * H * s)])
            return turn @ at + shift

        self.mesh = mesh = Mixed(r, counts, place) if kind == "mixed" else Mesh(kind, counts, place)
        if kind != "mixed":
            mesh.kinds = [kind] * len(mesh.elements)
        self.root, self.tip = mesh.where(lambda at: at[0] == 0), mesh.where(lambda at: at[0] == 1)
        self.corners = sorted(
            set(self.tip) & {e[k] for e in mesh.elements for k in range(3 if "10" in kind else 8 if not self.flat else 4)}
        )
        self.words = [kind, self.unit]
        stress, density = m / kg, m**3 / kg  # what a pascal and a kg/m^3 are in the deck's units
        self.newton = m * kg  # of its unit of force
        E, nu, rho = pick(r, (2.1e11, 0.3, 7850.0), (7e10, 0.33, 2700.0), (3e9, 0.38, 1200.0))
        E, rho = E * stress, rho * density
        self.nastran_possible = kind in NASTRAN and r.random() < 0.5
        text, cards = mesh.text(), []
        text += set_of("ROOT", self.root) + set_of("TIP", self.tip)
        text, cards = self.material(r, text, cards, E, nu, rho, H)
        text, cards = self.supports(r, text, cards)
        text, cards = self.extras(r, text, cards, rho * L * B * H, E)
        self.abaqus = text
        self.nastran = self.bulk(r, cards) if self.nastran_possible else None
        self.what = ", ".join(self.words + (["as Nastran"] if self.nastran else []))

    def material(self, r, text, cards, E, nu, rho, H):
        chance = r.random()
        self.stress = True
        if self.flat:
            text += f"*MATERIAL, NAME=M\n*ELASTIC\n{E:.8g}, {nu}\n*DENSITY\n{rho:.8g}\n*SHELL SECTION, ELSET=BODY, MATERIAL=M\n{H:.10g}\n"
            self.stress = False
            return text, cards
        if chance < 0.4:
            text += f"*MATERIAL, NAME=M\n*ELASTIC\n{E:.8g}, {nu}\n*DENSITY\n{rho:.8g}\n*SOLID SECTION, ELSET=BODY, MATERIAL=M\n"
            cards.append(["MAT1", 1, E, "", nu, rho])
            self.pid = {i: 1 for i in range(1, len(self.mesh.elements) + 1)}
            cards.append(["PSOLID", 1, 1])
        elif chance < 0.6:
            half = len(self.mesh.elements) // 2
            text += f"*ELSET, ELSET=A, GENERATE\n1, {half}\n*ELSET, ELSET=B, GENERATE\n{half + 1}, {len(self.mesh.elements)}\n"
            for name, e, d in (("A", E, rho), ("B", 0.4 * E, 0.7 * rho)):
                text += (
                    f"*MATERIAL, NAME=M{name}\n*ELASTIC\n{e:.8g}, {nu}\n*DENSITY\n{d:.8g}\n*SOLID SECTION, ELSET={name}, MATERIAL=M{name}\n"
                )
            self.pid = {i: 1 if i <= half else 2 for i in range(1, len(self.mesh.elements) + 1)}
            cards += [["MAT1", 1, E, "", nu, rho], ["MAT1", 2, 0.4 * E, "", nu, 0.7 * rho], ["PSOLID", 1, 1], ["PSOLID", 2, 2]]
            self.words.append("two materials")
            self.stress = False  # averaged across the border, or not
        else:
            e = [E, E * r.uniform(0.3, 1), E * r.uniform(0.1, 0.6)]
            p = [r.uniform(0.1, 0.3) for _ in range(3)]  # 12, 13, 23
            g = [E * r.uniform(0.1, 0.3) for _ in range(3)]
            text += "*MATERIAL, NAME=M\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n" + numbers(e + p + g[:2]) + f"\n{g[2]:.12g}\n"
            text += f"*DENSITY\n{rho:.8g}\n"
            q = axes(r)
            if chance < 0.85 or self.nastran_possible:
                text += "*ORIENTATION, NAME=O, SYSTEM=RECTANGULAR\n" + numbers([*q[:, 0], *q[:, 1]]) + "\n"
                self.words.append("orthotropic")
            else:
                # About a line beside the body.
                a = np.array(self.mesh.points).mean(0) - 3 * np.ptp(np.array(self.mesh.points), axis=0).max() * q[:, 0]
                text += "*ORIENTATION, NAME=O, SYSTEM=CYLINDRICAL\n" + numbers([*a, *(a + q[:, 2])]) + "\n"
                self.words.append("orthotropic in a cylinder's axes")
                self.stress = False  # CalculiX turns it point by point, the program element by element
            text += "*SOLID SECTION, ELSET=BODY, MATERIAL=M, ORIENTATION=O\n"
            S = np.diag([1 / e[0], 1 / e[1], 1 / e[2], 1 / g[0], 1 / g[2], 1 / g[1]])
            S[0, 1] = S[1, 0] = -p[0] / e[0]
            S[0, 2] = S[2, 0] = -p[1] / e[0]
            S[1, 2] = S[2, 1] = -p[2] / e[1]
            C = np.linalg.inv(S)
            cards.append(["MAT9", 1, *[C[i, j] for i in range(6) for j in range(i, 6)], rho])
            cards += [["CORD2R", 7, 0, 0.0, 0.0, 0.0, *q[:, 2], *q[:, 0]], ["PSOLID", 1, 1, 7]]
            self.pid = {i: 1 for i in range(1, len(self.mesh.elements) + 1)}
        return text, cards

    def supports(self, r, text, cards):
        chance = r.random()
        self.cd, self.welded = {}, False
        if chance < 0.35:
            self.words.append("welded by a scene")
            self.welded = True
            return text, cards
        if chance < 0.5 or self.flat:
            text += f"*BOUNDARY\nROOT, 1, {6 if self.flat else 3}\n"
            cards.append(["SPC1", 1, 123, *self.root])
        elif chance < 0.75:
            q = axes(r)
            held = pick(r, (1, 1), (1, 2), (2, 3))
            text += "*TRANSFORM, NSET=ROOT, TYPE=R\n" + numbers([*q[:, 0], *q[:, 1]]) + f"\n*BOUNDARY\nROOT, {held[0]}, {held[1]}\n"
            cards.append(["CORD2R", 8, 0, 0.0, 0.0, 0.0, *q[:, 2], *q[:, 0]])
            cards.append(["SPC1", 1, int("".join(map(str, range(held[0], held[1] + 1)))), *self.root])
            self.cd = {n: 8 for n in self.root}
            self.words.append("turned support")
        else:
            # Held along the circumference and the axis of a cylinder beside the root.
            q, p = axes(r), np.array(self.mesh.points)
            a = p[[n - 1 for n in self.root]].mean(0) - np.ptp(p, axis=0).max() * q[:, 0]
            text += "*TRANSFORM, NSET=ROOT, TYPE=C\n" + numbers([*a, *(a + q[:, 2])]) + "\n*BOUNDARY\nROOT, 2, 3\n"
            cards.append(["CORD2C", 8, 0, *a, *(a + q[:, 2]), *(a + q[:, 0])])
            cards.append(["SPC1", 1, 23, *self.root])
            self.cd = {n: 8 for n in self.root}
            self.words.append("cylinder's support")
        return text, cards

    def extras(self, r, text, cards, mass, E):
        """Mass, springs, equations."""
        free = [n for n in range(1, len(self.mesh.points) + 1) if n not in self.root]
        corner = self.corners
        scale = E * np.ptp(np.array(self.mesh.points), axis=0).max()
        element = 10**6
        if r.random() < 0.4:
            # CalculiX moves them with their nodes.
            n, value = pick(r, *corner), mass * r.uniform(0.05, 0.5)
            text += f"*ELEMENT, TYPE=MASS, ELSET=EM\n{element}, {n}\n*MASS, ELSET=EM\n{value:.8g}\n"
            cards.append(["CONM2", element, n, 0, value])
            element += 1
            self.words.append("mass")
        if r.random() < 0.4 and not self.welded and not self.flat:
            n, value = pick(r, *corner), scale * 10 ** r.uniform(-5, -3)
            text += f"*ELEMENT, TYPE=SPRING1, ELSET=ES\n{element}, {n}\n*SPRING, ELSET=ES\n2\n{value:.8g}\n"
            cards.append(["CELAS2", element, value, n, 2])
            element += 1
            self.words.append("spring")
        if r.random() < 0.3 and not self.flat and not self.welded:
            a, b = r.sample(free, 2)
            text += f"*EQUATION\n2\n{a}, 3, 1., {b}, 3, -1.\n"
            cards.append(["MPC", 2, a, 3, 1.0, b, 3, -1.0])
            self.words.append("equation")
        return text, cards

    def bulk(self, r, cards):
        """Nastran: case control for the supports and the equations, fields in one of the three forms."""
        form = pick(r, "free", "large", "small")
        self.words.append(form + " fields")
        system, to = 0, lambda p: p
        if r.random() < 0.5:
            q, a = axes(r), np.array([r.uniform(-1, 1) for _ in range(3)]) / UNITS[self.unit][0]
            if r.random() < 0.5:
                cards.append(["CORD2R", 9, 0, *a, *(a + q[:, 2]), *(a + q[:, 0])])
                to = lambda p: q.T @ (p - a)  # noqa: E731
            else:
                cards.append(["CORD2C", 9, 0, *a, *(a + q[:, 2]), *(a + q[:, 0])])

                def to(p):
                    x = q.T @ (p - a)
                    return np.array([np.hypot(x[0], x[1]), np.degrees(np.arctan2(x[1], x[0])), x[2]])

            system = 9
            self.words.append("grids in a system")
        out = [["GRID", i, system, *to(np.array(p)), self.cd.get(i, 0)] for i, p in enumerate(self.mesh.points, 1)]
        for i, (e, kind) in enumerate(zip(self.mesh.elements, self.mesh.kinds), 1):
            order = {"C3D20": ORDER_20, "C3D15": ORDER_15}.get(kind, range(len(e)))
            out.append([NASTRAN[kind], i, self.pid[i], *[e[k] for k in order]])
        names = {c[0] for c in cards}
        head = "SOL 103\nCEND\n" + ("SPC = 1\n" if "SPC1" in names else "") + ("MPC = 2\n" if "MPC" in names else "") + "BEGIN BULK\n"
        self.interfaced = lambda more: head + "".join(self.card(c, form) for c in out + cards + more) + "ENDDATA\n"
        return self.interfaced([])

    @staticmethod
    def card(fields, form):
        name, rest = fields[0], fields[1:]

        def word(v, width):
            if isinstance(v, (float, np.floating)):
                if width >= 16:
                    return f"{v:.9E}"
                # Eight characters: as many digits as fit, the E left out.
                for digits in range(6, -1, -1):
                    t = f"{v:.{digits}E}"
                    mantissa, power = t.split("E")
                    if "." not in mantissa:
                        mantissa += "."
                    t = f"{mantissa}{int(power):+d}"
                    if len(t) <= 8:
                        return t
            return str(v)

        if form == "free" or (form == "small" and any(isinstance(v, (float, np.floating)) and len(word(v, 16)) > 8 for v in rest)):
            # Places in eight characters would move the nodes: those cards are free.
            words = [word(v, 16) for v in rest]
            lines = [",".join([name, *words[:8]])]
            lines += [",".join(["", *words[k : k + 8]]) for k in range(8, len(words), 8)]
            return "\n".join(lines) + "\n"
        per, width = (4, 16) if form == "large" else (8, 8)
        words = [word(v, width) for v in rest]
        rows = [words[k : k + per] for k in range(0, len(words), per)]
        star = "*" if form == "large" else ""
        out = ""
        for k, row in enumerate(rows):
            out += (name + star if k == 0 else star).ljust(8) + "".join(w.rjust(width) for w in row) + "\n"
        if form == "large" and len(rows) % 2:
            out += "*\n"
        return out


def von_mises(s):
    d = s[:, [0, 1, 2]] - s[:, [1, 2, 0]]
    return np.sqrt(0.5 * (d**2).sum(1) + 3 * (s[:, 3:] ** 2).sum(1))


def run(program, folder, *words):
    done = subprocess.run([program, *map(str, words)], cwd=folder, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=120)
    if done.returncode:
        raise ValueError(done.stderr.strip()[-300:])
    return done


def frequencies(rows):
    """Hz of rows of a .dat, rigid motions (also as negative squares) with the others."""
    found = [row.split() for row in rows if re.match(r"\s+\d+\s+-?\d\.\d+E\S+\s+\S+\s+\S+\s+\S+$", row)]
    return np.array([float(f[3]) for f in found])


def stress_of_modes(folder, deck, count, told):
    """The largest difference of the stresses of modes of single frequencies, over the mode's largest von Mises stress."""
    m, kg = UNITS[deck.unit]
    blocks = read_frd(folder / "modes.frd")
    stress, shape = ([v for n, v in blocks if n == name] for name in ("STRESS", "DISP"))
    with h5py.File(folder / "body.h5") as file:
        ids, own, phi = file["surface/ids"][:].astype(int), file["surface/stress"][:], file["surface/phi"][:]
    worst = 0.0
    for k in range(MODES):
        alone = min(abs(told[j] / told[k] - 1) for j in range(len(told)) if j != k) > 0.02
        if not alone:
            continue
        theirs = np.array([stress[k + count][i] for i in ids])
        moved = np.array([shape[k + count][i][:3] for i in ids])
        # Shapes scaled alike: CalculiX' have unit modal mass in the deck's units.
        a, b = phi[:, :, k].ravel(), moved.ravel()
        theirs = theirs * (a @ b) / (b @ b) * (kg / m) / m  # stress per displacement: to Pa per metre
        mine = own[:, :, k]
        worst = max(worst, abs(mine - theirs).max() / von_mises(theirs).max())
    return worst


def judge(program, deck, folder, r):
    worst, off = {}, 0.03 if deck.flat else 0.01
    name = "body.bdf" if deck.nastran else "body.inp"
    (folder / name).write_text(deck.nastran or deck.abaqus)
    common = ["--units", deck.unit, "--cache", "none", "--json"]
    told = json.loads(
        run(program, folder, "reduce", name, "-o", "body.h5", "--method", "eigen", "--modes", MODES + 1, "--stress", *common).stdout
    )
    warnings = list(told.get("warnings", []))
    rigid = told["rigid_motions"]
    files = "*NODE FILE\nU\n*EL FILE\nS\n" if deck.stress else ""
    rows = calculix(folder, "modes", f"{deck.abaqus}*STEP\n*FREQUENCY\n{MODES + 1 + rigid}\n{files}*END STEP\n")
    hertz = frequencies(rows)[rigid : rigid + MODES]
    mine = np.array(told["frequencies"])
    worst["frequencies"] = abs(mine[: len(hertz)] / hertz - 1).max() / off if len(hertz) == MODES else np.inf
    if deck.stress:
        worst["stress"] = stress_of_modes(folder, deck, rigid, mine) / 0.02
    if deck.welded:
        worst["deflection"] = deflection(program, deck, folder, r, name, common, warnings) / (0.04 if deck.flat else off)
    note = ", ".join(f"{k} {v * (0.02 if k == 'stress' else off):.1e}" for k, v in worst.items())
    if max(worst.values()) > 1:
        return ("warned" if warnings else "silent"), note + (f": {warnings[0][:130]}" if warnings else "")
    return "right", note


def welded_deflection(program, folder, name, interfaces, words, loads):
    """Where the interface tip of a reduced free body moves, welded to the ground at its interface root and under loads on bar.tip at rest;
    and what reduce warns of."""
    words = [word for i in interfaces for word in ("--interface", i)] + ["--hold", "none", "--modes", 4, "--no-cut-off", *words]
    told = json.loads(run(program, folder, "reduce", name, "-o", "welded.sid", *words).stdout)
    scene = simulation(0.01, 100, start="static", tolerance=1e-8) + '[[body]]\nname = "bar"\nkind = "modal"\nfile = "welded.sid"\n\n'
    scene += weld("clamp", "ground", "bar.root") + output("moved", "bar.tip", "displacement", 'relative_to = "bar.root"')
    (folder / "welded.toml").write_text(scene + loads)
    run(program, folder, "simulate", "welded.toml", "-q", "-o", "welded.h5", "--csv", "welded.csv")
    row = next(csv.DictReader((folder / "welded.csv").open()))
    return np.array([float(row[f"moved.{x}"]) for x in "xyz"]), told.get("warnings", [])


def deflection(program, deck, folder, r, name, common, warnings):
    """Relative to CalculiX' of an interface under a force."""
    m, kg = UNITS[deck.unit]
    way = pick(r, "rigid", "average", "node") if not deck.flat else pick(r, "rigid", "node")
    deck.what += f", {way} interface"
    d = np.array([r.gauss(0, 1) for _ in range(3)])
    d /= np.linalg.norm(d)
    newtons = 1.0
    middle = np.array(deck.mesh.points)[[n - 1 for n in deck.tip]].mean(0)
    node = pick(r, *deck.corners)
    load = newtons / deck.newton
    text = deck.abaqus + f"*BOUNDARY\nROOT, 1, {6 if deck.flat else 3}\n"
    if way == "average":
        loads = "".join(f"{n}, {k + 1}, {load * f / len(deck.tip):.12g}\n" for n in deck.tip for k, f in enumerate(d))
        wanted = "TIP"
    elif way == "node":
        loads = "".join(f"{node}, {k + 1}, {load * f:.12g}\n" for k, f in enumerate(d))
        text += f"*NSET, NSET=SEEN\n{node}\n"
        wanted = "SEEN"
    else:
        text += f"*NODE\n900001, {numbers(middle)}\n900002, {numbers(middle)}\n*RIGID BODY, NSET=TIP, REF NODE=900001, ROT NODE=900002\n"
        text += "*NSET, NSET=SEEN\n900001\n"
        loads = "".join(f"900001, {k + 1}, {load * f:.12g}\n" for k, f in enumerate(d))
        wanted = "SEEN"
    rows = calculix(folder, "static", f"{text}*STEP\n*STATIC\n*CLOAD\n{loads}*NODE PRINT, NSET={wanted}\nU\n*END STEP\n")
    moved = np.mean([[float(x) for x in row.split()[1:4]] for row in rows if re.match(r"\s+\d+\s+-?\d\.\d+E", row)], axis=0) * m
    # So small that a scene, which stiffens and turns, is linear too.
    little = 1e-5 * np.linalg.norm(np.ptp(np.array(deck.mesh.points), axis=0)) * m / np.linalg.norm(moved)
    newtons, moved = newtons * little, moved * little
    at = ",".join(f"{x * m:.12g}" for x in middle)
    interfaces = [{"rigid": f"tip=rigid:TIP@{at}", "average": "tip=average:TIP", "node": f"tip={node}"}[way], "root=rigid:ROOT"]
    if deck.nastran:
        # Sets are spiders there.
        base = np.array(deck.mesh.points)[[n - 1 for n in deck.root]].mean(0)
        more = [["GRID", 900003, 0, *base], ["RBE2", 910003, 900003, 123456, *deck.root]]
        if way != "node":
            more.append(["GRID", 900001, 0, *middle])
            if way == "rigid":
                more.append(["RBE2", 910001, 900001, 123456, *deck.tip])
            else:
                more.append(["RBE3", 910001, "", 900001, 123456, 1.0, 123, *deck.tip])
        (folder / name).write_text(deck.interfaced(more))
        interfaces = [f"tip={node if way == 'node' else 900001}", "root=900003"]
    mine, said = welded_deflection(program, folder, name, interfaces, common, force("force", "bar.tip", newtons, d))
    warnings += said
    return np.linalg.norm(mine - moved) / np.linalg.norm(moved)


def main():
    args = suite_parser(__doc__, "number", "keep", count=40).parse_args()
    judge_each(args, "decks", lambda r, number: Deck(r), judge, needs_ccx=True)


if __name__ == "__main__":
    main()
