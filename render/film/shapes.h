// Meshes that the program makes itself: swept beams, and simple solids of which others are made.
// All are closed, with outward normals; positions in m in the body frame.
#pragma once

#include "render/film/polygon.h"
#include "render/picture/mesh.h"
#include "sim/scene/scene.h"

#include <span>
#include <string>
#include <vector>

namespace flexframe::film {

// The outline of a section swept along x from 0 to length, with closed ends. Rings stand at every station and between them so
// that neither is further apart than length / 64; a section without outline is drawn as the circle of its area.
// stations: x of the simulation nodes, any order. divided: points along the sides of an outline with corners too, where torsion stresses it
// most.
render::Mesh make_beam_mesh(const sim::Section& section, double length, std::span<const double> stations, const std::string& name,
                            bool divided = false);

render::Mesh make_sphere(const glm::dvec3& centre, double radius, const std::string& name);

// Cylinder with closed ends from a to b (a != b).
render::Mesh make_cylinder(const glm::dvec3& a, const glm::dvec3& b, double radius, const std::string& name);

// Solids that are put together before they become a mesh.
struct Build {
  std::vector<glm::dvec3> positions;
  std::vector<glm::ivec3> triangles;
  void add(const Build& part);
};

// The facets at a box's corners meet the bevels at 30 and its ends at 35 degrees: smoothed, they would shade the large faces.
inline constexpr render::MeshOptions flat_bevels{.crease_angle = 25.0};

Loop circle(double radius);

// Loops (an outline, then holes) in the plane of (u, v) swept along w through the stations: origin + x w + y u + z v, (u, v, w)
// right-handed as (y, z, x).
Build sweep(std::vector<Loop> loops, const std::vector<double>& stations, const glm::dvec3& origin, const glm::dvec3& w,
            const glm::dvec3& u, const glm::dvec3& v);
Build cylinder(const glm::dvec3& a, const glm::dvec3& b, double radius);
Build box(const glm::dvec3& centre, const glm::dvec3& half);
// Along z; length between the centres of its ends, 0: a ball.
Build capsule(const glm::dvec3& centre, double radius, double length);

}  // namespace flexframe::film
