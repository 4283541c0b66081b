"""Bodies reduced from shells: elements with straight sides on curved surfaces, and what PSHELL says of bending, shear and stress. Truth:
the same surface with curved sides, closed forms for strips, the same strip written otherwise."""

import json
import math

from picture_stress import largest_stress
from program import *


def panel(kind, along, around, straight):
    """A panel of 108 degrees, an eighth of its radius thick, clamped at one end."""
    fine = 2 if kind in ("S6", "S8R") else 1
    angle, radius, length = math.radians(108), 0.11, 0.5
    numbers, rows = {}, []
    for i in range(along):
        for j in range(around):
            q = [(fine * (i + a), fine * (j + b)) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
            split = ((0, 1, 2), (0, 2, 3)) if (i + j) % 2 else ((0, 1, 3), (1, 2, 3))
            for part in [q] if kind == "S8R" else [[q[k] for k in corners] for corners in split]:
                middles = (
                    [tuple((a + b) // 2 for a, b in zip(part[k], (part[1:] + part)[k])) for k in range(len(part))] if fine == 2 else []
                )
                rows.append([numbers.setdefault(at, len(numbers) + 1) for at in part + middles])

    def around_axis(j):
        v = angle * (j / fine / around - 0.5)
        return radius * math.sin(v), radius * math.cos(v)

    def place(i, j):
        if not straight or fine == 1 or j % 2 == 0:
            return around_axis(j)
        return tuple((a + b) / 2 for a, b in zip(around_axis(j - 1), around_axis(j + 1)))

    text = "*NODE\n" + "".join(
        f"{n}, {length * i / fine / along:.9g}, {', '.join(f'{x:.9g}' for x in place(i, j))}\n" for (i, j), n in numbers.items()
    )
    text += f"*ELEMENT, TYPE={kind}, ELSET=E\n" + "".join(f"{e}, {', '.join(map(str, row))}\n" for e, row in enumerate(rows, 1))
    text += "*NSET, NSET=ROOT\n" + "".join(f"{n},\n" for (i, _), n in numbers.items() if i == 0)
    return text + (
        "*MATERIAL, NAME=M\n*ELASTIC\n7e10, 0.3\n*DENSITY\n2700\n*SHELL SECTION, ELSET=E, MATERIAL=M\n0.014\n*BOUNDARY\nROOT, 1, 6\n"
    )


LENGTH, WIDTH, NX, NY, FORCE = 0.4, 0.1, 20, 2, 0.5


def strip(cards, kind="CQUAD4"):
    """A clamped strip along x with a rigid spider of its tip, grid 1000."""
    text = "BEGIN BULK\n" + "GRID,1000,,0.4,0.05,0.\n"
    at = {(i, j): 1 + i * (NY + 1) + j for i in range(NX + 1) for j in range(NY + 1)}
    text += "".join(f"GRID,{n},,{LENGTH * i / NX:.6f},{WIDTH * j / NY:.6f},0.\n" for (i, j), n in at.items())
    rows = [[at[i, j], at[i + 1, j], at[i + 1, j + 1], at[i, j + 1]] for i in range(NX) for j in range(NY)]
    if kind == "CTRIA3":
        rows = [part for r in rows for part in (r[:3], [r[0], r[2], r[3]])]
    text += "".join(f"{kind},{e},1,{','.join(map(str, row))}\n" for e, row in enumerate(rows, 1))
    text += f"RBE2,2000,1000,123456,{','.join(str(at[NX, j]) for j in range(NY + 1))}\n"
    return text + "".join(f"SPC1,1,123456,{at[0, j]}\n" for j in range(NY + 1)) + cards + "ENDDATA\n"


with temporary_folder() as name:
    folder = pathlib.Path(name)

    def reduced(text, *words, ending="inp", code=0):
        (folder / f"deck.{ending}").write_text(text)
        done = run(
            "reduce",
            folder / f"deck.{ending}",
            "-o",
            folder / "body.h5",
            "--no-stiffening",
            "--modes",
            "4",
            "--quiet",
            "--json",
            *words,
            code=code,
        )
        return json.loads(done.stdout) if code == 0 else done.stderr

    # Facets hand on what twists them as moments about each other's normal, whatever the elements: of a thousandth of their shear stiffness
    # the second frequency was 193 Hz, and fell on finer meshes.
    truth = reduced(panel("S8R", 12, 6, False))["frequencies"]
    for kind, cells, tolerance in (("S8R", (16, 8), 0.01), ("S6", (16, 8), 0.015), ("S3", (32, 16), 0.035)):
        for k, found in enumerate(reduced(panel(kind, *cells, True))["frequencies"]):
            near(found, truth[k], tolerance * truth[k], f"panel of straight {kind}, frequency {k + 1}")

    def stress(cards, kind, direction):
        (folder / "strip.bdf").write_text(strip(cards, kind))
        return largest_stress(folder, "strip.bdf", "tip=1000", "tip", [(direction, FORCE)])

    # Faces on a core: their stress is that of bending at Z1 and Z2, whatever stretches. Flat quadrangles have the moment of their middle.
    metals = "MAT1,1,7.+10,,0.,2700.\nMAT1,2,1.4+11,,0.,2700.\n"
    face, modulus = 0.012, 300 * 0.002**3 / 12 * WIDTH / 0.012
    for kind, arm in (("CQUAD4", LENGTH * (1 - 0.5 / NX)), ("CTRIA3", LENGTH)):
        found = stress(f"PSHELL,1,1,.002,2,300.,1,,\n+,{-face},{face}\n" + metals, kind, [0, 0, 1])
        near(found, FORCE * arm / modulus, 0.02 * FORCE * arm / modulus, f"{kind}: faces on a core that bends")
    found = stress(f"PSHELL,1,1,.002,2,300.,1,,\n+,{-face},{face}\n" + metals, "CQUAD4", [1, 0, 0])
    near(found, FORCE / WIDTH / 0.002, 0.001 * FORCE / WIDTH / 0.002, "faces on a core that stretches")
    found = stress("PSHELL,1,1,.002,1,,1\n" + metals, "CQUAD4", [0, 0, 1])
    plain = FORCE * LENGTH * (1 - 0.5 / NX) * 6 / WIDTH / 0.002**2
    near(found, plain, 0.01 * plain, "a plain plate")

    # A soft core's transverse shear by MAT1, MAT8 and MAT2, whatever stretches.
    sandwich = "PSHELL,1,1,.002,1,300.,3,10.\n"
    cores = ("MAT1,3,,1.+7,.3", "MAT8,3,1.+7,1.+7,.3,1.+7,1.+7,1.+7", "MAT2,3,1.+7,0.,0.,1.+7", "MAT1,3,2.6+7,,.3")
    soft = reduced(strip(sandwich + metals + cores[0] + "\n"), ending="bdf")["frequencies"]
    stiff = reduced(strip(sandwich.replace(",3,10.", ",1,10.") + metals), ending="bdf")["frequencies"]
    expect(soft[0] < 0.95 * stiff[0], f"a core that shears: {soft[0]:g} and {stiff[0]:g} Hz")
    alike = "MAT8,1,7.+10,7.+10,0.,3.5+10,3.5+10,3.5+10,2700.\n"
    for first in (metals, alike):
        for core in cores:
            found = reduced(strip(sandwich + first + core + "\n"), ending="bdf")
            for a, b in zip(found["frequencies"], soft):
                near(a, b, 1e-6 * b, f"{first[:6]} with a core of {core[:6]}")
    directed = reduced(strip(sandwich + metals + "MAT8,3,1.+7,1.+7,.3,1.+7,1.+7,1.+8\n"), ending="bdf")["frequencies"]
    near(directed[0], soft[0], 2e-3 * soft[0], "a core stiffer across the strip")
    turned = reduced(strip(sandwich + metals + "MAT8,3,1.+7,1.+7,.3,1.+7,1.+8,1.+7\n"), ending="bdf")["frequencies"]
    expect(turned[0] > 1.03 * soft[0], f"a core stiffer along the strip: {turned[0]:g} Hz")
    both = reduced(strip("PSHELL,1,1,.002,1,300.,1,10.\nMAT2,1,7.+10,0.,0.,7.+10,0.,3.5+10,2700.\n"), ending="bdf")
    expect(any("MID3 is a MAT2 with G33" in w for w in both["warnings"]), f"MID3 of a MAT2 with G33: {both['warnings']}")

    # A flat membrane is a mechanism: the refusal says of which shells.
    says = reduced(strip("PSHELL,1,1,.002\n" + metals), ending="bdf", code=1)
    expect("element 1 and those like it are membranes (PSHELL without MID2)" in says, f"a flat membrane: {says}")

    # What no plate has, and fields that other programs have behind MID4.
    for cards, words in (
        ("PSHELL,1,1,.002,1,-1.,1\n", "12 I / T^3 must be > 0, found -1"),
        ("PSHELL,1,1,.002,1,,1,-.8\n", "TS/T must be > 0, found -0.8"),
        ("PSHELL,1,1,.002,-1\n", "MID2 = -1 (plane strain) cannot be read"),
        ("PSHELL,1,1,.002,1,,1,,\n+,,,,,.001\n", "what stands behind MID4 cannot be read"),
        ("PSHELL,1,1,.002,1,,1,,\n+,,,3\n", "MID4 (bending that couples with stretching) cannot be read"),
    ):
        says = reduced(strip(cards + metals), ending="bdf", code=2)
        expect(words in says, f"{cards.strip()}: {says}")

finish()
