"""A gallery picture's moment drawn by VTK, as a user of VTK or ParaView would with an hour's care: the same mesh in scale, the same
values, size, number of samples and direction of view; feature edges, bar, axes, gradient and, on request, ambient occlusion.
Usage: xvfb-run -a vtk_picture.py FLEXFRAME RESULTS WORDS.toml PICTURE_INDEX OUT.png y|z [MESH.npz]
MESH.npz: the mesh, colours and view for blender_picture.py too.      (Debian: python3-vtk9, python3-h5py, xvfb)"""
import math
import pathlib
import subprocess
import sys
import tempfile
import tomllib

import h5py
import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

flexframe, results, words, index, out, upwards = sys.argv[1:7]
render = tomllib.loads(pathlib.Path(words).read_text())["render"]
with h5py.File(results) as file:
    times = file["times"][:]
duration = times[-1] - times[0]


def playback_speed():
    """As sim/SCENE.md has it: simulated seconds per second of playback where the scene gives none."""
    if "speed" in render:
        return render["speed"]
    if 2.0 <= duration <= 600.0:
        return 1.0
    longest = duration / (2.0 if 0.1 <= duration < 2.0 else 6.0)
    power = 10.0 ** math.floor(math.log10(longest) + 1e-9)
    return next((step * power for step in (5.0, 2.0) if step * power <= longest * (1.0 + 1e-9)), power)


# One picture of the export is that moment.
moment = int(index) * playback_speed() / render.get("frame_rate", 30.0)
with tempfile.TemporaryDirectory() as folder:
    once = pathlib.Path(folder) / "once.toml"
    kept = {k: render[k] for k in ("color_by", "mode") if k in render}
    lines = "\n".join(f'{k} = "{v}"' if isinstance(v, str) else f"{k} = {v}" for k, v in kept.items())
    once.write_text(f"[render]\nframe_rate = 1\nspeed = {moment!r}\n{lines}\n")
    subprocess.run(
        [flexframe, "export", results, "--to", "vtk", "--scene", str(once), "-o", folder + "/vtk", "-q"], check=True, capture_output=True
    )
    files = sorted(pathlib.Path(folder + "/vtk").glob("**/*.vtp")) or sorted(pathlib.Path(folder + "/vtk").glob("**/*.vtu"))
    reader = vtk.vtkXMLPolyDataReader() if files[0].suffix == ".vtp" else vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(files[1]))
    reader.Update()
data = reader.GetOutput()
if not isinstance(data, vtk.vtkPolyData):
    surface = vtk.vtkGeometryFilter()
    surface.SetInputData(data)
    surface.Update()
    data = surface.GetOutput()

color_by = render.get("color_by", "displacement")
array = data.GetPointData().GetArray(color_by) if color_by in ("displacement", "stress", "velocity", "strain") else None
normals = vtk.vtkPolyDataNormals()
normals.SetInputData(data)
normals.SetFeatureAngle(40)
mapper = vtk.vtkPolyDataMapper()
mapper.SetInputConnection(normals.GetOutputPort())
mapper.ScalarVisibilityOff()
renderer = vtk.vtkRenderer()
renderer.GradientBackgroundOn()
renderer.SetBackground(0.97, 0.975, 0.98)
renderer.SetBackground2(0.80, 0.85, 0.91)
if array is not None:
    table = vtk.vtkColorTransferFunction()
    viridis = [(0.267, 0.005, 0.329), (0.283, 0.141, 0.458), (0.254, 0.265, 0.530), (0.207, 0.372, 0.553), (0.164, 0.471, 0.558)]
    viridis += [(0.128, 0.567, 0.551), (0.135, 0.659, 0.518), (0.267, 0.749, 0.441), (0.478, 0.821, 0.318), (0.741, 0.873, 0.150)]
    viridis += [(0.993, 0.906, 0.144)]
    if array.GetNumberOfComponents() > 1:
        table.SetVectorModeToMagnitude()
    values = vtk_to_numpy(array)
    high = float((values**2).sum(axis=-1).max() ** 0.5 if values.ndim > 1 else values.max()) or 1.0
    for k, color in enumerate(viridis):
        table.AddRGBPoint(high * k / (len(viridis) - 1), *color)
    mapper.SetLookupTable(table)
    mapper.SetScalarModeToUsePointFieldData()
    mapper.SelectColorArray(color_by)
    mapper.ScalarVisibilityOn()
    mapper.InterpolateScalarsBeforeMappingOn()
    bar = vtk.vtkScalarBarActor()
    bar.SetLookupTable(table)
    bar.SetTitle(color_by)
    bar.SetPosition(0.9, 0.2)
    bar.SetWidth(0.07)
    bar.SetHeight(0.6)
    for property_of in (bar.GetTitleTextProperty(), bar.GetLabelTextProperty()):
        property_of.SetColor(0.1, 0.12, 0.15)
        property_of.ItalicOff()
        property_of.ShadowOff()
    renderer.AddActor2D(bar)
actor = vtk.vtkActor()
actor.SetMapper(mapper)
actor.GetProperty().SetColor(0.66, 0.69, 0.73)
actor.GetProperty().SetSpecular(0.3)
actor.GetProperty().SetSpecularPower(30)
renderer.AddActor(actor)
edges = vtk.vtkFeatureEdges()
edges.SetInputData(data)
edges.SetFeatureAngle(40)
edges.ManifoldEdgesOff()
edges.NonManifoldEdgesOff()
edges.ColoringOff()
edge_mapper = vtk.vtkPolyDataMapper()
edge_mapper.SetInputConnection(edges.GetOutputPort())
edge_mapper.ScalarVisibilityOff()
edge_actor = vtk.vtkActor()
edge_actor.SetMapper(edge_mapper)
edge_actor.GetProperty().SetColor(0.1, 0.1, 0.12)
renderer.AddActor(edge_actor)

# From where flexframe looks at flat and at spatial things.
bounds = data.GetBounds()
extent = [bounds[1] - bounds[0], bounds[3] - bounds[2], bounds[5] - bounds[4]]
up = [0, 1, 0] if upwards == "y" else [0, 0, 1]
direction = render.get("camera", {}).get("direction")
if direction is None:
    flat = min(extent) < 0.3 * (sum(extent) - max(extent) - min(extent))
    if flat and extent[2] == min(extent):
        direction, up = [0.22, -0.34, -1.0], [0, 1, 0]
    else:
        direction = [-0.62, -0.55, -1.0] if upwards == "y" else [-0.62, 1.0, -0.55]
if len(sys.argv) > 7:
    triangles = vtk.vtkTriangleFilter()
    triangles.SetInputData(data)
    triangles.Update()
    mesh = triangles.GetOutput()
    colors = np.zeros((mesh.GetNumberOfPoints(), 3)) + (0.66, 0.69, 0.73)
    if array is not None:
        share = np.linalg.norm(values, axis=-1) if values.ndim > 1 else values
        colors = np.array([table.GetColor(float(v)) for v in share])
    faces = vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    points = vtk_to_numpy(mesh.GetPoints().GetData())
    np.savez(sys.argv[7], points=points, faces=faces, colors=colors, direction=direction, up=up, size=render["size"])
camera = renderer.GetActiveCamera()
centre = [0.5 * (bounds[2 * k] + bounds[2 * k + 1]) for k in range(3)]
camera.SetFocalPoint(*centre)
camera.SetPosition(*[c - d for c, d in zip(centre, direction)])
camera.SetViewUp(*up)
camera.SetViewAngle(35)
renderer.ResetCamera()
camera.Zoom(1.3)
renderer.ResetCameraClippingRange()
text = vtk.vtkTextActor()
text.SetInput(f"t = {moment:.4g} s")
text.GetTextProperty().SetColor(0.1, 0.12, 0.15)
text.GetTextProperty().SetFontSize(15)
text.SetPosition(10, render["size"][1] - 26)
renderer.AddActor2D(text)

window = vtk.vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetMultiSamples(8)
window.SetSize(*render["size"])
window.AddRenderer(renderer)
axes = vtk.vtkAxesActor()
axes.SetShaftTypeToCylinder()
corner = vtk.vtkRenderer()
corner.SetLayer(1)
corner.SetViewport(0.0, 0.0, 0.14, 0.22)
corner.AddActor(axes)
window.SetNumberOfLayers(2)
window.AddRenderer(corner)
corner.GetActiveCamera().SetPosition(*[-3.5 * d / math.dist(direction, [0, 0, 0]) for d in direction])
corner.GetActiveCamera().SetFocalPoint(0, 0, 0)
corner.GetActiveCamera().SetViewUp(*up)
corner.ResetCamera()
window.Render()
grab = vtk.vtkWindowToImageFilter()
grab.SetInput(window)
grab.ReadFrontBufferOff()
writer = vtk.vtkPNGWriter()
writer.SetInputConnection(grab.GetOutputPort())
writer.SetFileName(out)
writer.Write()
