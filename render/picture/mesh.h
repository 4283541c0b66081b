// Meshes from files: Wavefront OBJ (with MTL), STL, PLY, glTF and whatever else assimp reads.
//
// Positions keep the order and the double precision of the file: vertex i of an OBJ file (i-th `v` line, unused ones
// included) is positions[i], whatever assimp does with it afterwards, and coordinates far from the origin lose nothing.
// Formats other than OBJ hold single precision; their vertices come mesh by mesh in the file's order, in world position, in the axes of
// the file (Collada's unit is counted, other formats' are warned of).
//
// Triangles refer to positions, and beside that to shading points: a position with one normal. A position on a crease or on
// a normal seam of the file has several shading points; the copies of a position that a file repeats share a normal group.
// What is drawn is indexed by shading points; normals of a deformed mesh are summed per normal group.
#pragma once

#include "render/picture/picture.h"
#include "sim/base/error.h"

#include <glm/glm.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace flexframe::render {

using flexframe::MeshError;

struct MeshMaterial {
  std::string name;
  Material look;         // colour in sRGB as the file gives it
  float opacity = 1.0f;  // `d` of the MTL file
};

struct Mesh {
  std::string name;                    // file name without folder
  std::vector<glm::dvec3> positions;   // M, the file's order
  std::vector<glm::vec3> colors;       // M vertex colours 0..1, or empty
  std::vector<glm::ivec3> triangles;   // K, indices of positions, polygons are cut into triangles
  std::vector<int> triangle_material;  // K, index of materials
  std::vector<std::uint8_t>
      triangle_edges;  // K where faces of the file were cut: bit k: the edge from corner k to the next is one of its face; else empty
  std::vector<MeshMaterial> materials;      // at least one
  std::vector<int> point_position;          // P shading points: their position
  std::vector<int> point_group;             // P: their normal group 0..normal_groups-1
  std::vector<glm::ivec3> triangle_points;  // K, indices of shading points, corner by corner as in triangles
  int normal_groups = 0;
  std::vector<std::string> warnings;  // what was mended or left out, one sentence each
  std::vector<std::string> faults;    // why its picture is not what the file says, one sentence each
};

// Half of what lies between two numbers of single precision, relative.
inline constexpr double single_precision = 6e-8;

struct MeshOptions {
  double crease_angle = 40.0;  // degrees; without normals in the file, edges sharper than this are creases
};

// Reads a mesh. Throws MeshError if the file is missing, no mesh, empty, without faces, or has indices out of range or
// coordinates that are not finite.
Mesh read_mesh(const std::filesystem::path& path, const MeshOptions& options = {});

// Makes a mesh of bare arrays (a swept section, a test): shading points by crease_angle, one grey material.
// Throws MeshError as read_mesh does; name stands for the file in its messages.
Mesh make_mesh(std::vector<glm::dvec3> positions, std::vector<glm::ivec3> triangles, const std::string& name = "mesh",
               const MeshOptions& options = {});

// Fills in the shading points of a mesh with positions, triangles and their materials. corner_normals: one unit normal per corner (3 K), or
// empty: then edges sharper than the crease angle, borders of materials excepted, separate normals.
void compute_shading_points(Mesh& mesh, const std::vector<glm::vec3>& corner_normals, double crease_angle);

// Writes positions as `v` lines (17 digits) and triangles as `f` lines; whole or not at all.
// Throws FileError if the file cannot be written.
void write_obj(const std::filesystem::path& path, const Mesh& mesh, const std::vector<glm::dvec3>& positions);

// Takes out the positions that no triangle uses; the order of the others stays.
void drop_unused_positions(Mesh& mesh);

// The box about the positions that triangles use, m.
Bounds compute_bounds(const Mesh& mesh);

}  // namespace flexframe::render
