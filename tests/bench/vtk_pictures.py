"""The job of bench_render by VTK: a waving tube, deformed anew for every picture, with normals and colours by displacement, to PNG.
CPU milliseconds a picture, all threads. Usage: vtk_pictures.py [pictures = 10] [triangles ...]   (Debian package python3-vtk9)"""
import math
import os
import sys
import tempfile
import time

try:
    import numpy as np
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
except ImportError as missing:
    sys.exit(f"{missing}: install python3-vtk9 and run /usr/bin/python3 " + " ".join(sys.argv))

count = int(sys.argv[1]) if len(sys.argv) > 1 else 10
targets = [int(a) for a in sys.argv[2:]] or [5000, 100000, 1000000]
print("VTK", vtk.vtkVersion.GetVTKVersion())

for target in targets:
    sides = round(math.sqrt(target / 10))
    rings = target // 2 // sides
    x = np.repeat(2.0 * np.arange(rings + 1) / rings, sides)
    angle = np.tile(2 * np.pi * np.arange(sides) / sides, rings + 1)
    rest = np.column_stack([x, 0.1 * np.cos(angle), 0.1 * np.sin(angle)]).astype(np.float32)
    ring, side = np.meshgrid(np.arange(rings), np.arange(sides), indexing="ij")
    a, b = ring * sides + side, ring * sides + (side + 1) % sides
    triangles = np.concatenate([np.stack([a, a + sides, b + sides], -1).reshape(-1, 3), np.stack([a, b + sides, b], -1).reshape(-1, 3)])
    cells = vtk.vtkCellArray()
    cells.SetCells(
        len(triangles),
        numpy_to_vtkIdTypeArray(np.column_stack([np.full(len(triangles), 3), triangles]).astype(np.int64).ravel(), deep=True),
    )
    data = vtk.vtkPolyData()
    data.SetPolys(cells)
    normals = vtk.vtkPolyDataNormals()
    normals.SetInputData(data)
    normals.SplittingOff()
    normals.ConsistencyOff()
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputConnection(normals.GetOutputPort())
    mapper.SetScalarRange(0, 0.2)
    actor = vtk.vtkActor()
    actor.SetMapper(mapper)
    renderer = vtk.vtkRenderer()
    renderer.AddActor(actor)
    renderer.SetBackground(0.9, 0.92, 0.95)
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(4)
    window.SetSize(1280, 720)
    window.AddRenderer(renderer)
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    writer = vtk.vtkPNGWriter()
    writer.SetCompressionLevel(1)
    writer.SetInputConnection(grab.GetOutputPort())
    with tempfile.TemporaryDirectory() as folder:
        for k in range(-1, count):
            if k == 0:
                start = time.process_time()
            wave = 0.2 * math.sin(0.3 * k) * np.sin(3.1 * rest[:, 0])
            now = rest.copy()
            now[:, 1] += wave
            points = vtk.vtkPoints()
            points.SetData(numpy_to_vtk(now, deep=True))
            data.SetPoints(points)
            data.GetPointData().SetScalars(numpy_to_vtk(np.abs(wave).astype(np.float32), deep=True))
            data.Modified()
            if k == -1:
                renderer.ResetCamera(-0.1, 2.1, -0.3, 0.3, -0.1, 0.1)
            window.Render()
            grab.Modified()
            writer.SetFileName(os.path.join(folder, f"frame_{max(k, 0):05d}.png"))
            writer.Write()
        print(f"{len(triangles):>10} triangles {1e3 * (time.process_time() - start) / count:>8.1f} ms", flush=True)
