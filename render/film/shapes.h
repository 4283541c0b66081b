// Meshes that the program makes itself: swept beams, and simple solids for bodies without a mesh and for joints.
// All are closed, with outward normals; positions in m in the body frame.
#pragma once

#include "render/picture/mesh.h"
#include "sim/scene/scene.h"

#include <span>

namespace flexframe::film {

// The outline of a section swept along x from 0 to length, with closed ends. Rings stand at every station and between them so
// that neither is further apart than length / 64; a section without outline is drawn as the circle of its area.
// stations: x of the simulation nodes, any order. divided: points along the sides of an outline with corners too, where torsion stresses it
// most.
render::Mesh make_beam_mesh(const sim::Section& section, double length, std::span<const double> stations, const std::string& name,
                            bool divided = false);

// Box with its centre and half edges, edges along the axes and slightly bevelled.
render::Mesh make_box(const glm::dvec3& centre, const glm::dvec3& half, const std::string& name);

render::Mesh make_sphere(const glm::dvec3& centre, double radius, const std::string& name);

// Cylinder with closed ends from a to b (a != b).
render::Mesh make_cylinder(const glm::dvec3& a, const glm::dvec3& b, double radius, const std::string& name);

// A rigid body that has no mesh, from what the scene says of it: the box of its mass and inertia about the centre of mass (limited to
// size), with bars to its frames where they lie outside. size: m, what a body without measures gets (a small block).
render::Mesh make_rigid_mesh(const sim::RigidDef& body, double size, const std::string& name);

}  // namespace flexframe::film
