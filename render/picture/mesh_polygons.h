// Private to the readers of meshes: faces as a file has them, on their way to triangles.
#pragma once

#include "render/picture/mesh.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

namespace flexframe::render {

struct Polygons {
  std::vector<int> corner, begin{0}, material;  // corners of polygon k: begin[k]..begin[k+1]
  std::vector<glm::vec3> corner_normal;         // per corner, or empty
};

// The whole file. Throws MeshError: missing, a folder, unreadable, empty.
std::string read_text(const std::filesystem::path& path);

// Largest coordinate, m: a light month. Areas and squares of lengths stay far inside single precision, in which pictures are drawn.
inline constexpr double largest_coordinate = 1e15;
inline bool too_far(const glm::dvec3& p) {
  return !(std::abs(p.x) <= largest_coordinate && std::abs(p.y) <= largest_coordinate && std::abs(p.z) <= largest_coordinate);
}
MeshError far_away(const std::string& vertex, const glm::dvec3& p);

// Blinn-Phong exponent > 0 to roughness: alpha^2 = 2 / (Ns + 2), alpha = roughness^2 (Walter, Marschner, Li, Torrance 2007).
inline float roughness_of_exponent(float exponent) { return std::clamp(std::pow(2.0f / (exponent + 2.0f), 0.25f), 0.05f, 1.0f); }

// Cuts the polygons into triangles, finds the shading points, and with that completes a mesh that has its positions, colours and materials.
void finish_mesh(Polygons polygons, const MeshOptions& options, Mesh& mesh, const std::string& nothing_left);

// Of corners that were read in single precision: a fault where they lie so far from the origin that they have moved.
void tell_of_steps(Mesh& mesh);

Mesh read_obj(const std::filesystem::path& path, const MeshOptions& options);
Mesh read_ply(const std::filesystem::path& path, const MeshOptions& options);

}  // namespace flexframe::render
