// The kernel map alone: a table of nodes from any program moves a mesh file. What `flexframe deform` does.
#pragma once

#include "interp/map.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::film {

// Nodes x,y,z with displacements ux,uy,uz and, if the table has them, rotation vectors rx,ry,rz.
struct NodeTable {
  interp::Nodes nodes;
  interp::Points displacement;  // N x 3
  interp::Points rotation;      // N x 3 or 0 x 3
  std::string note;             // what was made of units in the header line, or empty
};

// Reads a table with a header line: columns by name in any order, others are left alone. Comma, semicolon, tab or blanks; upper or lower
// case, quotes and the usual spellings (u_x, dx, rot_x, Points:0, X Location, u v w, ...) are understood, the header may stand behind '#'
// or '%'. Units in brackets: displacements are taken to the unit of the positions, rotations in degrees to radians; without brackets all
// lengths have one unit, rotations are radians. Decimal commas are read where the separator is none. Throws sim::InputError with file,
// line, column.
NodeTable read_node_table(const std::filesystem::path& path);

struct DeformOptions {
  interp::Scheme scheme = interp::Scheme::automatic;
  std::optional<double> scale = 1.0;  // of the displacements; none: auto (largest displacement a tenth of the mesh)
  bool corotated = false;             // exaggerate by rotation and stretch
};

struct DeformReport {
  interp::Report map;
  interp::LeaveOneOutError leave_one_out;
  int nodes = 0, vertices = 0;
  double scale = 1.0;
  double largest = 0.0;               // |u| over the vertices before scaling, m
  std::vector<std::string> warnings;  // of mesh, map and data
};

// Writes the deformed mesh (OBJ) or one displacement a line in the file's vertex order (CSV, header ux,uy,uz), by output's extension.
// Throws sim::InputError, interp::InputError, render::MeshError (bad input), interp::MapError, FileError (not written).
DeformReport deform(const std::filesystem::path& nodes, const std::filesystem::path& mesh, const std::filesystem::path& output,
                    const DeformOptions& options = {});

}  // namespace flexframe::film
