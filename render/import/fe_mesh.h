// Meshes of other programs as finite element models without material: MED (Salome, Code_Aster) and VTK's .vtu.
#pragma once

#include "sim/reduce/fe_model.h"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace flexframe::imports {

// Points and cells as such a file has them. A cell's nodes stand in VTK's order: corners, then the middles of the edges of the first face,
// of the opposite one and of those between. MED has the same order, seen from the other side of the cell.
struct CellMesh {
  std::string file;
  std::vector<double> points;                                     // 3 n, in the file's unit
  std::vector<int> kinds;                                         // VTK's number of each cell's type
  std::vector<int> begin{0}, nodes;                               // of cell k: nodes[begin[k]..begin[k+1]], points from 0
  std::map<std::string, std::vector<int>> cell_sets, point_sets;  // from 0
  std::vector<std::string> notes;
  int cells() const { return static_cast<int>(kinds.size()); }
  void add(int kind, const std::vector<int>& of_cell) {
    kinds.push_back(kind);
    nodes.insert(nodes.end(), of_cell.begin(), of_cell.end());
    begin.push_back(static_cast<int>(nodes.size()));
  }
};

// An unstructured grid; integers of its cells become sets "NAME:VALUE". Layout: VTK XML formats of the VTK User's Guide. Throws
// sim::InputError.
CellMesh read_vtu_cells(const std::filesystem::path& path);

// The first mesh of most dimensions in a MED file, version 3 or 4; groups become sets. Throws sim::InputError.
CellMesh read_med_cells(const std::filesystem::path& path);

// The cells of the highest dimension as elements (bricks of 8 nodes with incompatible modes, of 20 with reduced integration, as of gmsh),
// turned the right way out where the file sees them from the other side. Points are numbered from 1 in the file's order. A set of
// elements for each set of cells, a set of nodes for each set, of cells of fewer dimensions too. Throws sim::InputError: a cell of a kind
// that is no element, a point that is not there or not finite, no volume and no surface.
sim::FeModel make_fe_model(const CellMesh& mesh, const sim::FeUnits& units);

// By the file's ending, .med or .vtu.
sim::FeModel read_fe_mesh(const std::filesystem::path& path, const sim::FeUnits& units);

}  // namespace flexframe::imports
