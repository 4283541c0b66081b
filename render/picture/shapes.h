// Meshes of simple solids with smooth normals: arrows, tubes, springs, cylinders. Closed, counterclockwise from outside.
#pragma once

#include <glm/glm.hpp>

#include <span>
#include <vector>

namespace flexframe::render {

struct Shape {
  std::vector<glm::vec3> positions;
  std::vector<glm::vec3> normals;  // one per position
  std::vector<glm::uvec3> triangles;
  void append(const Shape& other);
};

// Arrow from the origin along +x of the given length; radius of the shaft (0: 2.5 % of the length); the head is 3 radii wide.
Shape make_arrow(double length, double radius = 0.0, int sides = 24);

// Round tube along a polyline (at least two different points, m; repeated ones are dropped) with flat ends; rotation-minimising frames, so
// that it does not twist. Source: Wang, Jüttler, Zheng, Liu, "Computation of rotation minimizing frames", 2008 (double reflection).
Shape make_tube(std::span<const glm::dvec3> path, double radius, int sides = 16);

// Coil spring between two points with straight ends: `turns` windings of the given coil and wire radius.
Shape make_spring(const glm::dvec3& from, const glm::dvec3& to, double coil_radius, double wire_radius, int turns = 8);

// Cylinder along z about the origin, flat ends.
Shape make_cylinder(double radius, double length, int sides = 32);

}  // namespace flexframe::render
