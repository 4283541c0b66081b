// Finite element meshes whose nodes move: of CalculiX, of VTK series. Drawn as the skin of their elements, each corner at its node.
#pragma once

#include "sim/results/results.h"

#include <string>
#include <vector>

namespace flexframe::imports {

// Shapes of elements; nodes in VTK's order (corners, then the middles of edges; hexahedra: bottom, top, upright edges).
enum class CellShape { none, triangle, quad, tetrahedron, pyramid, wedge, hexahedron, polygon };

struct Cells {
  // One a cell; quadratic: the nodes of edges stand behind the corners.
  std::vector<CellShape> shapes;
  std::vector<bool> quadratic;
  std::vector<int> begin{0};  // cells + 1: where the nodes of each begin
  std::vector<int> nodes;
  void add(CellShape shape, bool is_quadratic, const std::vector<int>& of_cell);
  int count() const { return static_cast<int>(shapes.size()); }
};

// Corners of a shape; 0 for polygons and none. Nodes of a quadratic one.
int corner_count(CellShape shape);
int quadratic_count(CellShape shape);

struct NodalSeries {
  std::string file, kind;  // for messages
  sim::VecX times;         // nt, s
  sim::MatX points;        // n x 3, m: undeformed
  Cells cells;
  sim::MatX displacement;  // nt x 3 n, m, world axes
  sim::MatX von_mises;     // nt x n, Pa, or empty
  std::vector<std::string> node_names;
  std::vector<std::string> notes;
};

// Triangles of the faces that belong to one cell, and of all shells, seen from outside. Faces of quadratic cells are cut at the nodes of
// their edges.
std::vector<Eigen::Vector3i> skin_of(const Cells& cells, const sim::MatX& points);

// One body of the name, at rest in the world: its nodes on the skin move. Throws sim::InputError where there is no skin.
sim::ResultBody to_body(const NodalSeries& series, const std::string& name);

// Von Mises stress of xx yy zz xy yz zx.
double von_mises(const double* stress);

}  // namespace flexframe::imports
