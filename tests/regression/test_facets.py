"""Bodies reduced from flat shells on curved surfaces: mass, moments of inertia and frequencies beside those of the surface, as they are
told. Truth: closed forms of mass and inertia, the same surface by curved shells (S8R); plates with folds, whose facets are the surface."""

import json
import math
import re

from program import *

DENSITY, THICKNESS = 7850, 0.01


def deck(kind, along, around, place, closed=False, held=True):
    """place: from shares along and around."""
    fine = 2 if kind in ("S6", "S8R") else 1
    numbers, rows = {}, []

    def node(at):
        return numbers.setdefault((at[0], at[1] % (fine * around)) if closed else at, len(numbers) + 1)

    for i in range(along):
        for j in range(around):
            q = [(fine * (i + a), fine * (j + b)) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
            split = ((0, 1, 2), (0, 2, 3)) if (i + j) % 2 else ((0, 1, 3), (1, 2, 3))
            for part in [q] if kind in ("S4", "S8R") else [[q[k] for k in corners] for corners in split]:
                ends = part[1:] + part[:1]
                middles = [((a + c) // 2, (b + d) // 2) for (a, b), (c, d) in zip(part, ends)] if fine == 2 else []
                rows.append([node(at) for at in part + middles])
    text = "*NODE\n" + "".join(
        f"{n}, {', '.join(f'{x:.12g}' for x in place(i / fine / along, j / fine / around))}\n" for (i, j), n in numbers.items()
    )
    text += f"*ELEMENT, TYPE={kind}, ELSET=E\n" + "".join(f"{e}, {', '.join(map(str, row))}\n" for e, row in enumerate(rows, 1))
    text += "*NSET, NSET=ROOT\n" + "".join(f"{n},\n" for (i, _), n in numbers.items() if i == 0)
    text += f"*MATERIAL, NAME=M\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n{DENSITY}\n*SHELL SECTION, ELSET=E, MATERIAL=M\n{THICKNESS}\n"
    return text + ("*BOUNDARY\nROOT, 1, 6\n" if held else "")


def pipe(x, y):
    return x * 0.5, 0.2 * math.cos(2 * math.pi * y), 0.2 * math.sin(2 * math.pi * y)


def disc(x, y):
    r = 0.1 + 0.3 * x
    return r * math.cos(2 * math.pi * y), r * math.sin(2 * math.pi * y), 0.0


def folded(degrees):
    def place(x, y):
        s = 0.2 * y - 0.1
        a = math.radians(degrees) if s > 0 else 0.0
        return x, s * math.cos(a), s * math.sin(a)

    return place


def octagon(x, y):
    k, s = divmod(8 * y, 1)
    a, b = (0.2 * complex(math.cos(v), math.sin(v)) for v in (math.pi / 4 * k, math.pi / 4 * (k + 1)))
    at = a + s * (b - a)
    return x, at.real, at.imag


with temporary_folder() as name:
    folder = pathlib.Path(name)

    def reduced(text):
        (folder / "deck.inp").write_text(text)
        words = ("--no-stiffening", "--method", "eigen", "--modes", "6", "--quiet", "--json")
        return json.loads(run("reduce", folder / "deck.inp", "-o", folder / "body.h5", *words).stdout)

    def share(told, words):
        """Of the warning that has these words, above 0 where something is too large; 0: there is none."""
        found = [re.search(words + r".*?(\S+) % too (small|large)", w) for w in told["warnings"]]
        return next((float(m[1]) * (1 if m[2] == "large" else -1) for m in found if m), 0.0)

    # A pipe of flat facets has the mass of its polygon, an inscribed one, and all of that at its corners.
    whole = 2 * math.pi * 0.2 * 0.5 * THICKNESS * DENSITY
    for kind, around in (("S4", 8), ("S4", 11), ("S3", 12)):
        found = reduced(deck(kind, 4, around, pipe, closed=True, held=False))
        true = 100 * (found["mass"] / whole - 1)
        near(share(found, "the mass is"), true, 0.2 * abs(true), f"mass of a pipe of {around} {kind} around, too large by per cent")
    # Of 24 facets the mass is 0.3 % too small, and the inertia about the axis as much.
    found = reduced(deck("S4", 12, 24, pipe, closed=True, held=False))
    expect(share(found, "the mass is") == 0.0, f"mass of a pipe of 24 S4 around: {found['warnings']}")
    # The pipe's moments of inertia: of eight facets that about its axis lacks what the mass does, across it has the nodes' row at the ends.
    found = reduced(deck("S4", 16, 8, pipe, closed=True, held=False))
    true = 100 * (math.sin(math.pi / 8) / (math.pi / 8) - 1)
    near(share(found, "moment of inertia"), true, 0.25, "moment of inertia of a pipe of eight facets, too large by per cent")

    # What the finer mesh shows has the surface in it: edges in the plane of a disc, facets of a pipe, straight sides of S6.
    cases = [(kind, disc, (6, 24), (12, 48)) for kind in ("S4", "S3")] + [("S4", pipe, (6, 16), (12, 32)), ("S3", pipe, (8, 20), (12, 40))]
    for kind, place, cells, fine in cases:
        found, truth = (reduced(deck(k, *c, place, closed=True)) for k, c in ((kind, cells), ("S8R", fine)))
        for k, told in enumerate(found["mesh_errors"]):
            true = abs(found["frequencies"][k] / truth["frequencies"][k] - 1)
            near(told, true, max(0.3 * true, 2e-3), f"{kind} on a {place.__name__}, frequency {k + 1}: its error as told")

    # Plates that meet at an angle are what they are, whichever way their normals look.
    for degrees in (12, 30, 45):
        found, truth = (reduced(deck(k, *c, folded(degrees))) for k, c in (("S4", (8, 4)), ("S8R", (16, 8))))
        expect(share(found, "the mass is") == 0.0, f"mass of a fold of {degrees} degrees: {found['warnings']}")
        for k, told in enumerate(found["mesh_errors"]):
            true = abs(found["frequencies"][k] / truth["frequencies"][k] - 1)
            near(told, true, max(0.4 * true, 3e-3), f"fold of {degrees} degrees, frequency {k + 1}: its error as told")
    found, truth = (reduced(deck(k, *c, octagon, closed=True)) for k, c in (("S4", (6, 16)), ("S8R", (12, 32))))
    for k, told in enumerate(found["mesh_errors"]):
        true = abs(found["frequencies"][k] / truth["frequencies"][k] - 1)
        near(told, true, max(0.4 * true, 3e-3), f"tube of eight plates, frequency {k + 1}: its error as told")
    expect(share(found, "the mass is") == 0.0, f"mass of a tube of eight plates: {found['warnings']}")

    # Elements turned around: the wall jumps to the other side where it lies beside its nodes, else nothing changes. Elements written twice.
    def said(words, **changes):
        text = deck("S4", 4, 6, disc)
        rows = text.split("TYPE=S4, ELSET=E\n")[1].split("*NSET")[0].splitlines()
        for k in changes.get("turned", ()):
            number, *nodes = rows[k].split(",")
            text = text.replace(rows[k] + "\n", ",".join([number, *reversed(nodes)]) + "\n")
        if "again" in changes:
            text = text.replace("*NSET", "1000," + rows[changes["again"]].split(",", 1)[1] + "\n*NSET", 1)
        return [
            w for w in reduced(text.replace("MATERIAL=M\n0", f"MATERIAL=M, OFFSET={changes.get('offset', 0)}\n0"))["warnings"] if words in w
        ]

    turned = said("look opposite ways", turned=(7, 8), offset=0.5)
    expect(len(turned) == 1 and "6 pairs" in turned[0] and "OFFSET" in turned[0], f"two shells turned around: {turned}")
    for changes in ({"turned": (7, 8)}, {"offset": 0.5}):
        expect(not said("look opposite ways", **changes), f"nothing jumps to the other side: {changes}")
    again = said("same nodes", again=3)
    expect(len(again) == 1 and "element 1000 on those of element 4" in again[0], f"a shell written twice: {again}")
    expect(not said("same nodes"), "no shell is written twice")

finish()
