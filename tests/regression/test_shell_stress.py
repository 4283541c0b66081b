"""Stress of shells in pictures: on the larger of both faces, of the plate that carries most where plates meet, whatever way the normals of
the elements point. Strips with Poisson's ratio zero against beam theory."""

from picture_stress import largest_stress
from program import *

E, rho, width, t, nx, ny = 2.1e11, 7850.0, 0.1, 0.004, 20, 2


def strip(place, thickness, turned, supports, kind="S4"):
    """A strip of nx x ny cells; place: share of its length -> (x, z); thickness and turned: column -> m, whether its normals point down."""
    fine = 2 if kind == "S8R" else 1
    numbers, elements = {}, []
    for i in range(nx):
        for j in range(ny):
            corners = [(fine * (i + a), fine * (j + b)) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
            if turned(i):
                corners = [corners[k] for k in (0, 3, 2, 1)]
            middles = [tuple((p + q) // 2 for p, q in zip(corners[k], corners[(k + 1) % 4])) for k in range(4)] if fine == 2 else []
            elements.append((i, [numbers.setdefault(at, len(numbers) + 1) for at in corners + middles]))
    text = "*NODE\n"
    for (i, j), n in numbers.items():
        x, z = place(i / nx / fine)
        text += f"{n}, {x:.9g}, {j * width / ny / fine:.9g}, {z:.9g}\n"
    columns = sorted({thickness(i) for i in range(nx)})
    for k, own in enumerate(columns):
        text += f"*ELEMENT, TYPE={kind}, ELSET=E{k}\n"
        text += "".join(f"{e}, {', '.join(map(str, nodes))}\n" for e, (i, nodes) in enumerate(elements, 1) if thickness(i) == own)
    for name, column in (("ROOT", 0), ("MIDDLE", fine * nx // 2), ("TIP", fine * nx)):
        text += f"*NSET, NSET={name}\n" + "".join(f"{n}\n" for (i, j), n in numbers.items() if i == column)
    text += f"*MATERIAL, NAME=STEEL\n*ELASTIC\n{E}, 0\n*DENSITY\n{rho}\n"
    for k, own in enumerate(columns):
        text += f"*SHELL SECTION, ELSET=E{k}, MATERIAL=STEEL\n{own}\n"
    return text + "*BOUNDARY\n" + supports


with temporary_folder() as name:
    folder = pathlib.Path(name)

    def stress(deck, at, loads):
        (folder / "strip.inp").write_text(deck)
        return largest_stress(folder, "strip.inp", f"at=rigid:{at}", "at", loads)

    section, modulus, length = width * t, width * t**2 / 6, 0.4
    for kind, down, force in (("S4", False, 0.02), ("S4", True, 0.02), ("S8R", False, 0.02)):
        # Flat elements have one curvature each, that of their middle.
        bent = force * (length * (1 - 0.5 / nx) if kind == "S4" else length) / modulus
        deck = strip(lambda s: (length * s, 0), lambda i: t, lambda i: down, "ROOT, 1, 6\n", kind)
        found = stress(deck, "TIP", (([0, 0, 1], force), ([1, 0, 0], bent * section)))
        near(found, 2 * bent, 0.01 * bent, f"{kind}, stretched and bent, normals down: {down}")

    # On two supports, a force in the middle, where normals of both sides point either way.
    ends = "ROOT, 1, 3\nTIP, 2, 3\n"
    bent = 0.25 * 0.02 * (length - 0.5 * length / nx * 2) / modulus
    found = stress(strip(lambda s: (length * s, 0), lambda i: t, lambda i: i % 2 == 1, ends), "MIDDLE", (([0, 0, 1], 0.02),))
    near(found, bent, 0.01 * bent, "bent between supports")

    # A bracket, its foot twice as thick: the thinner plate carries most, where it begins at the fold.
    deck = strip(
        lambda s: (length * min(s, 0.5), length * max(s - 0.5, 0)), lambda i: t if i >= nx // 2 else 2 * t, lambda i: False, "ROOT, 1, 6\n"
    )
    bent = 0.02 * length / 2 * (1 - 1 / nx) / modulus
    near(stress(deck, "TIP", (([1, 0, 0], 0.02),)), bent, 0.01 * bent, "the plate of a bracket at its fold")

finish()
