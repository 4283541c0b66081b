"""The pendulum of Schiavo et al. 2005 section 5.2 as a solid: a bar of 20-node bricks along x, written as an Abaqus/CalculiX model.

    python3 assets/beam/make_beam.py beam.inp [NX NY NZ]

Length 0.4 m, thickness 0.009 m (y) and width 0.2 m (z): area 18e-4 m^2 and second moment 1.215e-8 m^4 as there; density 5540 kg/m^3, E
1e9 Pa, Poisson's ratio 0 as a beam has it. Node sets ROOT and TIP: the end faces.
"""
import sys

length, thickness, width = 0.4, 0.009, 0.2


def model(nx, ny, nz):
    index, nodes, elements = {}, [], []

    def node(i, j, k):
        """Number of the node at half steps (i, j, k)."""
        if (i, j, k) not in index:
            index[i, j, k] = len(nodes) + 1
            nodes.append((length * i / (2 * nx), thickness * (j / (2 * ny) - 0.5), width * (k / (2 * nz) - 0.5)))
        return index[i, j, k]

    corner = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
    edge = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    places = corner + [tuple((corner[a][d] + corner[b][d]) // 2 for d in range(3)) for a, b in edge]
    for x in range(nx):
        for y in range(ny):
            for z in range(nz):
                elements.append([node(2 * x + i, 2 * y + j, 2 * z + k) for i, j, k in places])
    lines = ["*NODE"] + [f"{n + 1}, {x:.10g}, {y:.10g}, {z:.10g}" for n, (x, y, z) in enumerate(nodes)]
    lines.append("*ELEMENT, TYPE=C3D20R, ELSET=BEAM")
    for n, e in enumerate(elements):
        lines += [f"{n + 1}, " + ", ".join(map(str, e[:10])) + ",", ", ".join(map(str, e[10:]))]
    for name, place in (("ROOT", 0), ("TIP", 2 * nx)):
        lines.append(f"*NSET, NSET={name}")
        lines += [str(number) for (i, _, _), number in sorted(index.items()) if i == place]
    lines += ["*MATERIAL, NAME=BEAM", "*ELASTIC", "1e9, 0", "*DENSITY", "5540", "*SOLID SECTION, ELSET=BEAM, MATERIAL=BEAM"]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    if len(sys.argv) not in (2, 5):
        sys.exit(__doc__)
    with open(sys.argv[1], "w") as out:
        out.write(model(*(map(int, sys.argv[2:5]) if len(sys.argv) == 5 else (20, 1, 4))))
