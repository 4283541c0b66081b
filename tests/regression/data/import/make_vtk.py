"""Makes grid_*.vtu, grid.pvd and moved_*.vtp by VTK (Debian python3-vtk9): one mesh at three times in each way in which VTK writes numbers.

python3 make_vtk.py
"""

import pathlib

import vtk

folder = pathlib.Path(__file__).parent
points = vtk.vtkPoints()
points.SetDataTypeToDouble()
grid = vtk.vtkUnstructuredGrid()


def add(kind, corners, edges=(), shift=0.0):
    """A cell with its own points; nodes in the middle of edges."""
    places = [list(c) for c in corners] + [[0.5 * (corners[a][k] + corners[b][k]) for k in range(3)] for a, b in edges]
    ids = [points.InsertNextPoint(p[0], p[1] + shift, p[2]) for p in places]
    grid.InsertNextCell(kind, len(ids), ids)


BRICK = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [0, 0, 1], [2, 0, 1], [2, 1, 1], [0, 1, 1]]
WEDGE = [[0, 0, 0], [0, 1, 0], [2, 0, 0], [0, 0, 1], [0, 1, 1], [2, 0, 1]]  # VTK's wedges wind the other way
TET = [[0, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 1]]
PYRAMID = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [0, 0, 1]]
BRICK_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
WEDGE_EDGES = [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)]
TET_EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
PYRAMID_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)]
add(vtk.VTK_HEXAHEDRON, BRICK)
add(vtk.VTK_WEDGE, WEDGE, shift=3)
add(vtk.VTK_TETRA, TET, shift=6)
add(vtk.VTK_PYRAMID, PYRAMID, shift=9)
add(vtk.VTK_QUADRATIC_HEXAHEDRON, BRICK, BRICK_EDGES, 12)
add(vtk.VTK_QUADRATIC_WEDGE, WEDGE, WEDGE_EDGES, 15)
add(vtk.VTK_QUADRATIC_TETRA, TET, TET_EDGES, 18)
add(vtk.VTK_QUADRATIC_PYRAMID, PYRAMID, PYRAMID_EDGES, 21)
grid.InsertNextCell(vtk.VTK_VERTEX, 1, [0])
grid.SetPoints(points)


def fields(data, time):
    """Displacement 0.01 t (x y, z, x^2) in m; stress t (1 + x) in one, 2 and 3 in the shear components."""
    u, s = vtk.vtkDoubleArray(), vtk.vtkFloatArray()
    u.SetName("displacement"), u.SetNumberOfComponents(3), s.SetName("stress"), s.SetNumberOfComponents(6)
    for i in range(points.GetNumberOfPoints()):
        x, y, z = points.GetPoint(i)
        u.InsertNextTuple3(0.01 * time * x * y, 0.01 * time * z, 0.01 * time * x * x)
        s.InsertNextTuple6(time * (1 + x), 0, 0, 2 * time, 3 * time, 0)
    data.GetPointData().AddArray(u)
    data.GetPointData().AddArray(s)


writer = vtk.vtkXMLUnstructuredGridWriter()
ways = {
    "ascii": lambda: writer.SetDataModeToAscii(),
    "binary": lambda: (writer.SetDataModeToBinary(), writer.SetCompressorTypeToNone()),
    "packed": lambda: (
        writer.SetDataModeToBinary(),
        writer.SetCompressorTypeToZLib(),
        writer.SetHeaderTypeToUInt64(),
        writer.SetBlockSize(512),
    ),
    "raw": lambda: (writer.SetDataModeToAppended(), writer.EncodeAppendedDataOff(), writer.SetCompressorTypeToZLib()),
    "appended": lambda: (writer.SetEncodeAppendedData(1), writer.SetCompressorTypeToNone(), writer.SetByteOrderToBigEndian()),
}
for k, (name, set_up) in enumerate(ways.items()):
    set_up()
    fields(grid, 0.5 * k)
    writer.SetInputData(grid)
    writer.SetFileName(str(folder / f"grid_{name}.vtu"))
    writer.Write()
sets = "".join(f'<DataSet timestep="{0.5 * k}" part="0" file="grid_{name}.vtu"/>\n' for k, name in enumerate(ways))
(folder / "grid.pvd").write_text(
    f'<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n<Collection>\n{sets}</Collection>\n</VTKFile>\n'
)

# Points that move, as triangles and polygons.
source = vtk.vtkCubeSource()
for k in range(2):
    source.SetCenter(0.1 * k, 0.2 * k, 0.0)
    source.Update()
    surface = vtk.vtkXMLPolyDataWriter()
    surface.SetInputData(source.GetOutput())
    surface.SetFileName(str(folder / f"moved_{k}.vtp"))
    surface.Write()
