"""A gallery picture's mesh by Blender's path tracer Cycles, as a user of Blender gets it in a quarter of an hour: three lamps, a floor,
smooth faces with sharp edges, values as vertex colours.
Usage: blender -b --factory-startup -P blender_picture.py -- MESH.npz OUT.png [SAMPLES = 24]      (mesh by vtk_picture.py)"""
import math
import sys

import bpy
import numpy as np
from mathutils import Matrix, Vector

words = sys.argv[sys.argv.index("--") + 1 :]
kept = np.load(words[0])
points, faces, colors, up = kept["points"].astype(float), kept["faces"], kept["colors"], Vector(kept["up"])
# In lengths near 1 about the middle: Blender's clipping and lamps are made for metres.
middle, size = 0.5 * (points.min(axis=0) + points.max(axis=0)), np.ptp(points, axis=0).max()
points = (points - middle) / size

bpy.ops.object.select_all(action="SELECT")
bpy.ops.object.delete()
scene = bpy.context.scene
mesh = bpy.data.meshes.new("bodies")
mesh.from_pydata(points.tolist(), [], faces.tolist())
layer = mesh.color_attributes.new("values", "FLOAT_COLOR", "POINT")
linear = np.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)
layer.data.foreach_set("color", np.column_stack([linear, np.ones(len(linear))]).ravel())
mesh.shade_smooth() if hasattr(mesh, "shade_smooth") else [setattr(p, "use_smooth", True) for p in mesh.polygons]
mesh.use_auto_smooth = True
mesh.auto_smooth_angle = math.radians(40)
bodies = bpy.data.objects.new("bodies", mesh)
scene.collection.objects.link(bodies)


def material(name, roughness, metallic, color=None):
    new = bpy.data.materials.new(name)
    new.use_nodes = True
    nodes = new.node_tree.nodes
    shader = nodes["Principled BSDF"]
    shader.inputs["Roughness"].default_value, shader.inputs["Metallic"].default_value = roughness, metallic
    if color:
        shader.inputs["Base Color"].default_value = color
    else:
        values = nodes.new("ShaderNodeVertexColor")
        values.layer_name = "values"
        new.node_tree.links.new(values.outputs["Color"], shader.inputs["Base Color"])
    return new


mesh.materials.append(material("body", 0.4, 0.0))
axis = max(range(3), key=lambda k: abs(up[k]))
low = points[:, axis].min() - 0.01
bpy.ops.mesh.primitive_plane_add(size=40)
floor = bpy.context.object
floor.rotation_euler = up.to_track_quat("Z", "Y").to_euler()
floor.location = low * up
floor.data.materials.append(material("floor", 0.8, 0.0, (0.75, 0.78, 0.82, 1)))

direction = Vector(kept["direction"]).normalized()
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
scene.collection.objects.link(camera)
camera.data.angle = math.radians(55)  # across; 35 degrees upright
right = direction.cross(up).normalized()
rotation = [right, right.cross(direction).normalized(), -direction]
camera.matrix_world = Matrix([(*[rotation[c][r] for c in range(3)], 0) for r in range(3)] + [(0, 0, 0, 1)])
# As near as everything is seen, with a tenth around it.
seen = points @ np.array([list(v) for v in (*rotation[:2], direction)]).T
half = np.array([math.tan(0.5 * camera.data.angle), math.tan(0.5 * camera.data.angle) * kept["size"][1] / kept["size"][0]]) / 1.1
camera.location = -max((np.abs(seen[:, k]) / half[k] - seen[:, 2]).max() for k in range(2)) * direction
scene.camera = camera
for strength, place in ((60, -direction * 2 + up * 2.2 - right), (25, -direction * 2 + right * 2), (20, direction + up * 2)):
    lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "AREA"))
    lamp.data.energy, lamp.data.size, lamp.location = strength, 1.2, place
    lamp.rotation_euler = (-place).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(lamp)
scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.8, 0.86, 0.93, 1)
scene.world.node_tree.nodes["Background"].inputs[1].default_value = 0.5
scene.render.engine = "CYCLES"
scene.cycles.samples = int(words[2]) if len(words) > 2 else 24
scene.cycles.use_denoising = False
scene.view_settings.view_transform = "Standard"
scene.render.resolution_x, scene.render.resolution_y = map(int, kept["size"])
scene.render.resolution_percentage = 50  # half as wide: a picture takes 4 CPU s
scene.render.filepath = words[1]
bpy.ops.render.render(write_still=True)
