#include "render/import/fe_mesh.h"

#include "sim/base/error.h"
#include "sim/base/files_read.h"
#include "sim/base/plain_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace flexframe::imports {
namespace {

using sim::FeFormulation;
using sim::FeShape;
using sim::InputError;

// order: place in the file of our node i, empty: as it stands; mirrored: likewise for a cell that is inside out.
struct Kind {
  int number, nodes, dimension;
  bool usable;
  FeShape shape;
  std::vector<int> order = {}, mirrored = {};
};

constexpr FeShape none = FeShape::point_mass;

// VTK's numbers; nodes 0: any.
const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all{
      {1, 0, 0, false, none},
      {2, 0, 0, false, none},
      {3, 0, 1, false, none},
      {4, 0, 1, false, none},
      {21, 0, 1, false, none},
      {35, 0, 1, false, none},
      {5, 3, 2, true, FeShape::triangle3},
      {8, 4, 2, true, FeShape::quadrangle4, {0, 1, 3, 2}},
      {9, 4, 2, true, FeShape::quadrangle4},
      {22, 6, 2, true, FeShape::triangle6},
      {23, 8, 2, true, FeShape::quadrangle8},
      {6, 0, 2, false, none},
      {7, 0, 2, false, none},
      {28, 0, 2, false, none},
      {34, 0, 2, false, none},
      {10, 4, 3, true, FeShape::tetrahedron4, {}, {0, 2, 1, 3}},
      {11, 8, 3, true, FeShape::hexahedron8, {0, 1, 3, 2, 4, 5, 7, 6}, {0, 2, 3, 1, 4, 6, 7, 5}},
      {12, 8, 3, true, FeShape::hexahedron8, {}, {0, 3, 2, 1, 4, 7, 6, 5}},
      {13, 6, 3, true, FeShape::wedge6, {}, {0, 2, 1, 3, 5, 4}},
      {24, 10, 3, true, FeShape::tetrahedron10, {}, {0, 2, 1, 3, 6, 5, 4, 7, 9, 8}},
      {25, 20, 3, true, FeShape::hexahedron20, {}, {0, 3, 2, 1, 4, 7, 6, 5, 11, 10, 9, 8, 15, 14, 13, 12, 16, 19, 18, 17}},
      {26, 15, 3, true, FeShape::wedge15, {}, {0, 2, 1, 3, 5, 4, 8, 7, 6, 11, 10, 9, 12, 14, 13}},
      {14, 0, 3, false, none},
      {15, 0, 3, false, none},
      {16, 0, 3, false, none},
      {27, 0, 3, false, none},
      {29, 0, 3, false, none},
      {32, 0, 3, false, none},
      {33, 0, 3, false, none},
      {37, 0, 3, false, none},
      {42, 0, 3, false, none},
  };
  return all;
}

const Kind& kind_of(const CellMesh& mesh, int cell) {
  const int number = mesh.kinds[static_cast<size_t>(cell)];
  const auto found = std::find_if(kinds().begin(), kinds().end(), [&](const Kind& k) { return k.number == number; });
  if (found == kinds().end()) throw InputError(fmt::format("{}: cell {}: VTK's type {} is not known", mesh.file, cell + 1, number));
  return *found;
}

std::string upper(std::string text) {
  for (char& c : text) c = sim::plain_upper(c);
  return text;
}

// Whether the first face of a solid is seen from outside as its nodes turn: then its volume is negative.
bool inside_out(const std::vector<sim::Vec3>& points, const std::vector<int>& node, int corners) {
  const int face = corners == 8 ? 4 : 3;
  sim::Vec3 first = sim::Vec3::Zero(), rest = sim::Vec3::Zero(), normal = sim::Vec3::Zero();
  for (int k = 0; k < corners; ++k)
    (k < face ? first : rest) += points[static_cast<size_t>(node[static_cast<size_t>(k)])] / (k < face ? face : corners - face);
  for (int k = 0; k < face; ++k) {
    const sim::Vec3 a = points[static_cast<size_t>(node[static_cast<size_t>(k)])] - first;
    normal += a.cross(points[static_cast<size_t>(node[static_cast<size_t>((k + 1) % face)])] - first);
  }
  return normal.dot(rest - first) < 0.0;
}

int corners_of(FeShape shape) {
  switch (shape) {
    case FeShape::tetrahedron4:
    case FeShape::tetrahedron10:
      return 4;
    case FeShape::wedge6:
    case FeShape::wedge15:
      return 6;
    default:
      return 8;
  }
}

void add_element(const CellMesh& mesh, int cell, const Kind& kind, sim::FeModel& model) {
  const auto at = static_cast<size_t>(cell);
  const int count = mesh.begin[at + 1] - mesh.begin[at];
  if (!kind.usable)
    throw InputError(
        fmt::format("{}: cell {} (VTK's type {}, {} nodes) cannot be used: no pyramids, polygons or polyhedra; "
                    "tetrahedra of 4 or 10 nodes, hexahedra of 8 or 20, wedges of 6 or 15, shells of 3, 4, 6 or 8 can",
                    mesh.file, cell + 1, kind.number, count));
  if (count != kind.nodes)
    throw InputError(
        fmt::format("{}: cell {} has {} nodes; {} are needed for {}", mesh.file, cell + 1, count, kind.nodes, fe_name(kind.shape)));
  const int* from = mesh.nodes.data() + mesh.begin[at];
  std::vector<int> node(from, from + count);
  const auto arrange = [&](const std::vector<int>& order) {
    for (size_t i = 0; i < order.size(); ++i) node[i] = from[order[i]];
  };
  arrange(kind.order);
  if (kind.dimension == 3 && inside_out(model.nodes, node, corners_of(kind.shape))) arrange(kind.mirrored);
  sim::FeElement e;
  e.id = cell + 1;
  e.shape = kind.shape;
  if (kind.shape == FeShape::hexahedron8) e.formulation = FeFormulation::incompatible;
  if (kind.shape == FeShape::hexahedron20) e.formulation = FeFormulation::reduced;
  e.first = static_cast<int>(model.connectivity.size());
  e.count = count;
  model.connectivity.insert(model.connectivity.end(), node.begin(), node.end());
  model.elements.push_back(e);
}

}  // namespace

sim::FeModel make_fe_model(const CellMesh& mesh, const sim::FeUnits& units) {
  sim::FeModel model;
  model.file = mesh.file;
  model.notes = mesh.notes;
  const auto points = static_cast<int>(mesh.points.size() / 3);
  for (int p = 0; p < points; ++p) {
    const sim::Vec3 x(mesh.points.data() + 3 * static_cast<size_t>(p));
    if (!x.allFinite()) throw InputError(fmt::format("{}: point {} has a coordinate that is not finite", mesh.file, p + 1));
    model.nodes.emplace_back(x * units.length);
    model.node_ids.push_back(p + 1);
  }
  for (const int n : mesh.nodes)
    if (n < 0 || n >= points) throw InputError(fmt::format("{}: a cell names point {}; there are {}", mesh.file, n + 1, points));
  int dimension = 0;
  for (int c = 0; c < mesh.cells(); ++c) dimension = std::max(dimension, kind_of(mesh, c).dimension);
  if (dimension < 2) throw InputError(fmt::format("{}: the mesh has neither volume nor surface elements", mesh.file));
  std::vector<int> element_of(static_cast<size_t>(mesh.cells()), -1);
  std::vector<std::vector<int>> lower;
  for (int c = 0; c < mesh.cells(); ++c) {
    const Kind& kind = kind_of(mesh, c);
    if (kind.dimension != dimension) {
      if (kind.dimension > 0)
        lower.emplace_back(mesh.nodes.begin() + mesh.begin[static_cast<size_t>(c)],
                           mesh.nodes.begin() + mesh.begin[static_cast<size_t>(c) + 1]);
      continue;
    }
    element_of[static_cast<size_t>(c)] = static_cast<int>(model.elements.size());
    add_element(mesh, c, kind, model);
  }
  warn_of_loose_cells(model, lower);
  for (const auto& [name, cells] : mesh.cell_sets) {
    std::set<int> nodes, elements;
    for (const int c : cells) {
      const auto at = static_cast<size_t>(c);
      nodes.insert(mesh.nodes.begin() + mesh.begin[at], mesh.nodes.begin() + mesh.begin[at + 1]);
      if (element_of[at] >= 0) elements.insert(element_of[at]);
    }
    model.node_sets[upper(name)].assign(nodes.begin(), nodes.end());
    if (!elements.empty()) model.element_sets[upper(name)].assign(elements.begin(), elements.end());
  }
  for (const auto& [name, members] : mesh.point_sets) {
    std::vector<int>& set = model.node_sets[upper(name)];
    std::set<int> all(set.begin(), set.end());
    all.insert(members.begin(), members.end());
    set.assign(all.begin(), all.end());
  }
  return model;
}

sim::FeModel read_fe_mesh(const std::filesystem::path& path, const sim::FeUnits& units) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) throw InputError(fmt::format("{}: cannot be opened", path.string()));
  sim::note_file_read(path);
  const bool med = sim::plain_lower(path.extension().string()) == ".med";
  return make_fe_model(med ? read_med_cells(path) : read_vtu_cells(path), units);
}

}  // namespace flexframe::imports
