"""A rod of solid elements as a deck, along x from the origin, with the sets ROOT and TIP at its ends."""


def rod_deck(youngs_modulus, density, length, wide, high, count):
    """CalculiX deck of `count` bricks, SI units, steel without lateral contraction."""
    corners = [(length * i / count, wide * (j - 0.5), high * (k - 0.5)) for i in range(count + 1) for j in (0, 1) for k in (0, 1)]
    bricks = [[4 * i + n for n in (1, 5, 7, 3, 2, 6, 8, 4)] for i in range(count)]
    last = 4 * count
    return (
        "*NODE, NSET=ALL\n"
        + "".join("%d, %.9g, %.9g, %.9g\n" % (n + 1, *x) for n, x in enumerate(corners))
        + "*ELEMENT, TYPE=C3D8I, ELSET=ROD\n"
        + "".join("%d, %s\n" % (e + 1, ", ".join(map(str, b))) for e, b in enumerate(bricks))
        + f"*NSET, NSET=ROOT\n1, 2, 3, 4\n*NSET, NSET=TIP\n{last + 1}, {last + 2}, {last + 3}, {last + 4}\n"
        + f"*MATERIAL, NAME=STEEL\n*ELASTIC\n{youngs_modulus}, 0\n*DENSITY\n{density}\n*SOLID SECTION, ELSET=ROD, MATERIAL=STEEL\n"
    )
