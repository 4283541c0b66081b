// Which columns of a table are the bodies' motion, in which units and conventions: of a mapping file (TOML, README.md), or by the names of
// the columns.
#pragma once

#include "render/import/rotations.h"
#include "render/import/table.h"

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::imports {

// factor * column + constant; column empty: the constant alone.
struct Source {
  std::string column;
  double factor = 1.0, constant = 0.0;
  int line = 0;  // of the mapping file; 0: by name
};

struct TurnSource {
  TurnWriting writing;
  std::array<Source, 9> numbers;
};

// Where a node is; one of the two.
struct NodeSource {
  std::string name;
  sim::Vec3 origin = sim::Vec3::Zero();  // undeformed, m, body frame
  std::array<Source, 3> rest;            // the same by columns, whose first row counts; no column: `origin`
  bool by_position = false;              // `place` is the node's position in world axes, from which its displacement follows
  bool world_axes = false;               // displacement and rotation in world axes
  std::array<Source, 3> place;           // displacement or position
  TurnSource turn;                       // relative to the undeformed node; by_position: of the node to world axes
  bool has_turn = false;
};

struct BodySource {
  std::string name, kind = "rigid";
  std::string mesh;        // file, absolute, or empty
  double mesh_unit = 1.0;  // m
  double length = 0.0;     // beams, m
  std::vector<double> color;
  std::array<Source, 3> position;
  sim::Vec3 point = sim::Vec3::Zero();  // the point of the body whose position it is, m, body frame
  TurnSource turn;
  std::vector<NodeSource> nodes;
  std::filesystem::path sid;  // modal bodies: nodes and mode shapes
  std::vector<Source> q;
  int line = 0;
};

struct Mapping {
  std::string file;  // of the mapping, "" where columns are taken by name
  std::string title;
  TableFormat format;
  double length_unit = 1.0, angle_unit = 1.0;  // of columns without a unit of their own: m, rad
  bool units_given = false;
  std::vector<BodySource> bodies;
  std::vector<std::string> outputs;  // columns to keep as histories
  bool all_outputs = true;           // all that are not used by a body
  std::vector<std::string> notes;
};

// Throws InputError "MAP.toml:LINE: [[body]] 'crank': ...".
Mapping read_mapping(const std::filesystem::path& path);

// By the names of columns: NAME.x NAME.y NAME.z, NAME.qw ... or NAME.rx ... or NAME.r11 ..., NAME:NODE.ux ... (README.md). of Modelica
// results: components with a mass and frame_a. Throws InputError where no body is found.
Mapping mapping_by_names(const Table& table);

}  // namespace flexframe::imports
