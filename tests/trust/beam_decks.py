"""Bodies reduced from random decks of beams against frames in numpy:  beam_decks.py FLEXFRAME [--count N] [--seed S] [--number N]

Frames in space of three to five members, trees or with a loop, each of its own section and direction of it, in several systems of units.
Written for Abaqus (B31, B32; *BEAM SECTION RECT and PIPE, *BEAM GENERAL SECTION, *MASS, *ROTARY INERTIA, *KINEMATIC COUPLING, *SPRING) or
for Nastran (CBAR, CBEAM; PBAR with and without shear, PBARL, PBEAM, masses per length, offsets, CONM2 beside its grid, RBE2, CELAS2).
Truth: Timoshenko's beams of `truths/space_frame.py`, sixteen elements a member. Compared: mass, six frequencies of the frame as its deck
holds it, and the deflection of a joint of the free body that a scene welds at another one, under a force and a torque. Wrong is, without a
warning, 1 % of a frequency or deflection, 1e-6 of the mass. Exit 1 if there is one, or a deck is refused.
"""
import json
import math
import pathlib
import sys

import numpy as np
import scipy.linalg

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from arguments import judge_each, suite_parser  # noqa: E402
from decks import Deck as Cards  # noqa: E402
from decks import UNITS, axes, numbers, run, welded_deflection  # noqa: E402
from meshed import set_of  # noqa: E402
from scene import MATERIALS, force, pick  # noqa: E402
from truths.formulas import torsion_rectangle  # noqa: E402
from truths.space_frame import SpaceFrame, arm, beam_element  # noqa: E402

MODES, OFF, MASS, EACH = 6, 0.01, 1e-6, 8
RIGID = 1e9  # a shear factor that leaves no shear


def rectangle(a, b):
    """Along y and z of the member."""
    area = a * b
    return {"area": area, "iz": b * a**3 / 12, "iy": a * b**3 / 12, "j": torsion_rectangle(a, b), "shear_y": 5 / 6, "shear_z": 5 / 6}


def pipe(outer, inner, shear):
    i = math.pi * (outer**4 - inner**4) / 4
    return {"area": math.pi * (outer**2 - inner**2), "iy": i, "iz": i, "j": 2 * i, "shear_y": shear, "shear_z": shear}


class Frame:
    def __init__(self, r):
        self.nastran = r.random() < 0.6
        self.unit = pick(r, *UNITS)
        self.m, self.kg = UNITS[self.unit]
        self.words = ["Nastran" if self.nastran else "Abaqus", self.unit]
        self.truth, self.mass = SpaceFrame(), 0.0
        self.grids, self.lines, self.cards = {}, [], []  # grids: number -> place, m
        count = r.randint(3, 5)
        self.joints = []
        for k in range(count + 1):
            at = (
                np.zeros(3)
                if k == 0
                else self.joints[-1][1] + np.array([r.uniform(0.4, 1) * pick(r, -1, 1), r.gauss(0, 0.5), r.gauss(0, 0.5)])
            )
            self.joints.append((self.grid(at), at, self.truth.node(at)))
        self.material = pick(r, *MATERIALS)
        E, rho = self.material["E"] * self.m / self.kg, self.material["rho"] * self.m**3 / self.kg
        self.cards.append(["MAT1", 1, E, "", self.material["poisson"], rho])
        self.lines.append(f"*MATERIAL, NAME=M\n*ELASTIC\n{E:.10g}, {self.material['poisson']}\n*DENSITY\n{rho:.10g}")
        pairs = [(k, k + 1) for k in range(count)]
        if count > 2 and r.random() < 0.4:
            pairs.append((count, pick(r, 0, 1)))
            self.words.append("loop")
        self.element = 0
        for number, (a, b) in enumerate(pairs, 1):
            self.member(r, number, self.joints[a], self.joints[b], E, rho)
        self.held, self.sprung = {0: range(6)}, False
        self.extras(r)
        if r.random() < 0.3:
            self.held[count] = sorted(r.sample(range(6), r.randint(1, 3)))
        for k, which in self.held.items():
            self.truth.hold(self.joints[k][2], which)
        self.what = ", ".join(dict.fromkeys(self.words))

    def grid(self, at):
        self.grids[len(self.grids) + 1] = at
        return len(self.grids)

    def member(self, r, number, first, last, E, rho):
        d = last[1] - first[1]
        L = float(np.linalg.norm(d))
        t = d / L
        n = axes(r)[:, 0]
        y = n - (n @ t) * t
        y /= np.linalg.norm(y)
        Q = np.column_stack([t, y, np.cross(t, y)])
        h = L / r.uniform(15, 40)
        w = h * r.uniform(0.4, 1.5)
        per_length, offset = 0.0, np.zeros(3)
        m = self.m
        if self.nastran:
            kind = pick(r, "PBAR", "PBAR", "PBARL BAR", "PBARL TUBE", "PBEAM")
            if self.nastran and r.random() < 0.4:
                per_length = r.uniform(0.1, 1) * self.material["rho"] * h * w
                self.words.append("mass per length")
            nsm = per_length * m / self.kg
            if kind == "PBAR" or kind == "PBEAM":
                s = {"area": h * w, "iz": w * h**3 / 12 * r.uniform(0.5, 2), "iy": h * w**3 / 12 * r.uniform(0.5, 2)}
                s["j"] = r.uniform(0.3, 0.9) * (s["iy"] + s["iz"])
                A, I1, I2, J = s["area"] / m**2, s["iz"] / m**4, s["iy"] / m**4, s["j"] / m**4
                if kind == "PBAR":
                    shear = r.random() < 0.5
                    s["shear_y"], s["shear_z"] = (0.7, 0.8) if shear else (RIGID, RIGID)
                    more = [*[""] * 8, 0.7, 0.8] if shear else []
                    self.cards.append(["PBAR", number, 1, A, I1, I2, J, nsm, *(["", *more] if more else [])])
                else:
                    s["shear_y"] = s["shear_z"] = 1.0
                    self.cards.append(["PBEAM", number, 1, A, I1, I2, 0.0, J, nsm])
            elif kind == "PBARL BAR":
                s = rectangle(h, w)
                self.cards.append(["PBARL", number, 1, "", "BAR", "", "", "", "", w / m, h / m, nsm])
            else:
                s = pipe(h / 2, 0.35 * h, 0.5)
                self.cards.append(["PBARL", number, 1, "", "TUBE", "", "", "", "", h / 2 / m, 0.35 * h / m, nsm])
            self.words.append(kind)
            if r.random() < 0.3:
                offset = h * np.array([r.gauss(0, 1) for _ in range(3)])
                self.words.append("offset")
        else:
            kind = pick(r, "RECT", "PIPE", "GENERAL")
            if kind == "RECT":
                s = rectangle(h, w)
                text = f"*BEAM SECTION, ELSET=M{number}, MATERIAL=M, SECTION=RECT\n{numbers([h / m, w / m])}\n"
            elif kind == "PIPE":
                s = pipe(h / 2, 0.35 * h, 0.6)
                text = f"*BEAM SECTION, ELSET=M{number}, MATERIAL=M, SECTION=PIPE\n{numbers([h / 2 / m, 0.15 * h / m])}\n"
            else:
                s = {"area": h * w, "iz": w * h**3 / 12, "iy": h * w**3 / 12, "shear_y": RIGID, "shear_z": RIGID}
                s["j"] = r.uniform(0.3, 0.9) * (s["iy"] + s["iz"])
                text = f"*BEAM GENERAL SECTION, ELSET=M{number}, SECTION=GENERAL, DENSITY={rho:.10g}\n"
                text += numbers([s["area"] / m**2, s["iy"] / m**4, 0.0, s["iz"] / m**4, s["j"] / m**4]) + "\n"
            text += numbers(y) + "\n"
            if kind == "GENERAL":
                text += numbers([E, E / (2 * (1 + self.material["poisson"]))]) + "\n"
            self.lines.append(text.rstrip())
            self.words.append(kind)
        self.mass += L * (self.material["rho"] * s["area"] + per_length)
        self.elements(r, number, kind, first, last, y, offset)
        # The truth: twice as many elements; mass per length turns nothing.
        p, steps = first[1], 2 * EACH
        nodes = [first[2]] + [self.truth.node(p + d * k / steps) for k in range(1, steps)] + [last[2]]
        K, M = beam_element(L / steps, self.material, s)
        if per_length:
            M = M + beam_element(L / steps, {**self.material, "rho": per_length / s["area"]}, {**s, "iy": 0.0, "iz": 0.0, "j": s["j"]})[1]
        T = np.kron(np.eye(4), Q.T)
        A = np.kron(np.eye(2), arm(offset))
        for a, b in zip(nodes, nodes[1:]):
            self.truth.elements.append((a, b, A.T @ T.T @ K @ T @ A, A.T @ T.T @ M @ T @ A))

    def elements(self, r, number, kind, first, last, y, offset):
        quadratic = not self.nastran and r.random() < 0.4
        pieces = EACH * (2 if quadratic else 1)
        grids = [first[0]] + [self.grid(first[1] + (last[1] - first[1]) * k / pieces) for k in range(1, pieces)] + [last[0]]
        rows = []
        for k in range(0, pieces, 2 if quadratic else 1):
            self.element += 1
            ends = grids[k : k + (3 if quadratic else 2)]
            rows.append(", ".join(map(str, [self.element, *ends])))
            w = offset / self.m
            name = "CBEAM" if kind == "PBEAM" else "CBAR"
            self.cards.append([name, self.element, number, *ends[:2], *y, *(["", "", "", *w, *w] if offset.any() else [])])
        self.lines.append(f"*ELEMENT, TYPE={'B32' if quadratic else 'B31'}, ELSET=M{number}\n" + "\n".join(rows))

    def extras(self, r):
        scale = self.mass
        m, kg = self.m, self.kg
        number = 10**6
        for joint in self.joints[1:]:
            chance = r.random()
            grid, at, node = joint
            mass = scale * r.uniform(0.05, 0.4)
            J = mass * np.array([r.uniform(0.5, 1) for _ in range(3)]) * 0.01
            turned = J / (kg * m * m)
            if chance < 0.3:
                # Beside its grid in Nastran.
                offset = np.array([r.gauss(0, 0.05) for _ in range(3)]) if self.nastran else np.zeros(3)
                self.cards.append(["CONM2", number, grid, 0, mass / kg, *(offset / m), "", turned[0], 0.0, turned[1], 0.0, 0.0, turned[2]])
                self.lines.append(f"*ELEMENT, TYPE=MASS, ELSET=E{number}\n{number}, {grid}\n*MASS, ELSET=E{number}\n{mass / kg:.10g}")
                self.lines.append(f"*ELEMENT, TYPE=ROTARYI, ELSET=R{number}\n{number + 1}, {grid}\n*ROTARY INERTIA, ELSET=R{number}")
                self.lines.append(numbers([*turned, 0, 0, 0]))
                self.truth.body(node, mass, J, offset)
                self.words.append("mass")
                self.mass += mass
            elif chance < 0.5:
                # On a rigid arm.
                offset = np.array([r.gauss(0, 0.1) for _ in range(3)])
                point = 500000 + grid
                self.grids[point] = at + offset
                self.cards.append(["CONM2", number, point, 0, mass / kg])
                self.cards.append(["RBE2", number + 1, grid, 123456, point])
                self.lines.append(f"*ELEMENT, TYPE=MASS, ELSET=E{number}\n{number}, {point}\n*MASS, ELSET=E{number}\n{mass / kg:.10g}")
                self.lines.append(f"*KINEMATIC COUPLING, REF NODE={point}\n{grid}, 1, 6")
                self.truth.body(node, mass, np.zeros(3), offset)
                self.words.append("arm")
                self.mass += mass
            elif chance < 0.6:
                value, axis = self.material["E"] * 10 ** r.uniform(-7, -5), r.randrange(3)
                self.cards.append(["CELAS2", number, value / kg, grid, axis + 1])
                self.lines.append(
                    f"*ELEMENT, TYPE=SPRING1, ELSET=E{number}\n{number}, {grid}\n*SPRING, ELSET=E{number}\n{axis + 1}\n{value / kg:.10g}"
                )
                self.truth.spring(node, np.diag(np.eye(3)[axis] * value))
                self.words.append("spring")
                self.sprung = True
            number += 10

    def text(self):
        if not self.nastran:
            out = "*NODE\n" + "".join(f"{i}, {numbers(p / self.m)}\n" for i, p in self.grids.items())
            out += "\n".join(self.lines) + "\n" + set_of("ALL", list(self.grids)) + "*BOUNDARY\n"
            return out + "".join(f"{self.joints[k][0]}, {i + 1}, {i + 1}\n" for k, which in self.held.items() for i in which)
        cards = [["GRID", i, 0, *(p / self.m)] for i, p in self.grids.items()] + self.cards
        cards += [["SPC1", 1, int("".join(str(i + 1) for i in which)), self.joints[k][0]] for k, which in self.held.items()]
        return "SOL 103\nCEND\nSPC = 1\nBEGIN BULK\n" + "".join(Cards.card(c, "free") for c in cards) + "ENDDATA\n"


def judge(program, frame, folder, r):
    name = "frame.bdf" if frame.nastran else "frame.inp"
    (folder / name).write_text(frame.text())
    common = ["--units", frame.unit, "--cache", "none", "--json"]
    told = json.loads(run(program, folder, "reduce", name, "-o", "frame.sid", "--method", "eigen", "--modes", MODES, *common).stdout)
    warnings = list(told.get("warnings", []))
    K, M, free = frame.truth.matrices()
    values = scipy.linalg.eigh(K[np.ix_(free, free)], M[np.ix_(free, free)], eigvals_only=True, subset_by_index=[0, MODES - 1])
    hertz = np.sqrt(values) / (2 * np.pi)
    worst = {
        "mass": abs(told["mass"] / frame.mass - 1) / MASS,
        "frequencies": abs(np.array(told["frequencies"]) / hertz - 1).max() / OFF,
    }
    if len(frame.held) == 1 and not frame.sprung:
        worst["deflection"] = deflection(program, frame, folder, r, name, common, warnings) / OFF
    note = ", ".join(f"{k} {v * (MASS if k == 'mass' else OFF):.1e}" for k, v in worst.items())
    if max(worst.values()) > 1:
        return ("warned" if warnings else "silent"), note + (f": {warnings[0][:130]}" if warnings else "")
    return "right", note


def deflection(program, frame, folder, r, name, common, warnings):
    grid, _, node = pick(r, *frame.joints[1:])
    f, c = (np.array([r.gauss(0, 1) for _ in range(3)]) for _ in range(2))
    moved = frame.truth.rest(frame.truth.at(node, f, c))[node, :3]
    little = 1e-5 / np.linalg.norm(moved)
    f, c, moved = f * little, c * little, moved * little
    loads = force("force", "bar.tip", float(np.linalg.norm(f)), f) + force("torque", "bar.tip", float(np.linalg.norm(c)), c)
    mine, said = welded_deflection(program, folder, name, [f"tip={grid}", f"root={frame.joints[0][0]}"], common, loads)
    warnings += said
    return np.linalg.norm(mine - moved) / np.linalg.norm(moved)


def main():
    args = suite_parser(__doc__, "number", "keep", count=40).parse_args()
    judge_each(args, "beam decks", lambda r, number: Frame(r), judge)


if __name__ == "__main__":
    main()
