// Solids that tests and benchmarks of the drawing draw: balls, boxes; and normals of what moves.
#pragma once

#include "render/picture/shapes.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace flexframe::render {

// Ball about the origin.
inline Shape make_ball(double radius, int rings = 16) {
  Shape shape;
  const auto sides = static_cast<unsigned>(2 * rings), inner = static_cast<unsigned>(rings - 1);
  const auto add = [&](double x, double y, double z) {
    shape.normals.emplace_back(x, y, z);
    shape.positions.push_back(static_cast<float>(radius) * shape.normals.back());
  };
  // Rings between the poles, then the poles.
  for (unsigned j = 1; j <= inner; ++j)
    for (unsigned i = 0; i < sides; ++i) {
      const double a = std::numbers::pi * j / rings, b = 2.0 * std::numbers::pi * i / sides;
      add(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
    }
  add(0, 0, 1);
  add(0, 0, -1);
  const unsigned north = inner * sides, south = north + 1;
  for (unsigned i = 0; i < sides; ++i) {
    const unsigned next = (i + 1) % sides;
    shape.triangles.emplace_back(north, i, next);
    shape.triangles.emplace_back(south, (inner - 1) * sides + next, (inner - 1) * sides + i);
    for (unsigned j = 0; j + 1 < inner; ++j) {
      const unsigned a = j * sides + i, b = j * sides + next, c = a + sides, d = b + sides;
      shape.triangles.emplace_back(a, c, b);
      shape.triangles.emplace_back(b, c, d);
    }
  }
  return shape;
}

// Box about the origin with faces of their own normals; full edge lengths.
inline Shape make_box(const glm::dvec3& size) {
  Shape shape;
  const glm::vec3 h(0.5 * size);
  for (int axis = 0; axis < 3; ++axis)
    for (int sign = -1; sign <= 1; sign += 2) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      const auto base = static_cast<unsigned>(shape.positions.size());
      for (const auto& [cu, cv] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
        glm::vec3 p(0.0f), n(0.0f);
        n[axis] = static_cast<float>(sign);
        p[axis] = static_cast<float>(sign) * h[axis];
        p[u] = static_cast<float>(cu) * h[u];
        p[v] = static_cast<float>(cv) * h[v];
        shape.positions.push_back(p);
        shape.normals.push_back(n);
      }
      if (sign > 0) {
        shape.triangles.emplace_back(base, base + 1, base + 2);
        shape.triangles.emplace_back(base, base + 2, base + 3);
      } else {
        shape.triangles.emplace_back(base, base + 2, base + 1);
        shape.triangles.emplace_back(base, base + 3, base + 2);
      }
    }
  return shape;
}

// Normals as the mean of the adjacent triangles' normals weighted by area; zero where all triangles vanish.
inline void update_normals(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles, std::vector<glm::vec3>& normals) {
  normals.assign(positions.size(), glm::vec3(0.0f));
  for (const glm::uvec3& t : triangles) {
    const glm::vec3 n = glm::cross(positions[t.y] - positions[t.x], positions[t.z] - positions[t.x]);
    normals[t.x] += n;
    normals[t.y] += n;
    normals[t.z] += n;
  }
  for (glm::vec3& n : normals) {
    const float l = glm::length(n);
    if (l > 0.0f) n /= l;
  }
}

}  // namespace flexframe::render
