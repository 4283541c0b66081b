#include "render/import/vtk_series.h"

#include "sim/base/words.h"

#include "sim/base/plain_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace flexframe::imports {
namespace {

using sim::InputError;

std::string lower(std::string text) {
  text = sim::plain_lower(text);
  return text;
}

// The field whose name is among these words (lower case) and that has so many components, or null.
const VtkMoment::Field* find_field(const VtkMoment& moment, std::initializer_list<const char*> words, int components) {
  for (const char* word : words)
    for (const VtkMoment::Field& field : moment.fields)
      if (field.components == components && lower(field.name) == word) return &field;
  return nullptr;
}

const VtkMoment::Field* displacement_of(const VtkMoment& moment) {
  return find_field(moment, {"displacement", "displacements", "disp", "u", "deplacement", "depl"}, 3);
}

// Von Mises stress of every point; empty where the file has none.
std::vector<double> stress_of(const VtkMoment& moment) {
  if (const auto* scalar =
          find_field(moment, {"von_mises", "von mises", "vonmises", "s_mises", "mises", "von_mises_stress", "s, mises"}, 1))
    return scalar->values;
  std::vector<double> out;
  for (const int components : {6, 9}) {
    const auto* stress = find_field(moment, {"stress", "stresses", "s", "sigma"}, components);
    if (!stress) continue;
    for (size_t i = 0; i + components <= stress->values.size(); i += components) {
      const double* v = stress->values.data() + i;
      // Six: xx yy zz xy yz xz, as VTK orders symmetric tensors; nine: row by row.
      const double six[] = {v[0], v[4], v[8], v[1], v[5], v[2]};
      out.push_back(von_mises(components == 6 ? v : six));
    }
    return out;
  }
  return out;
}

std::string field_names(const VtkMoment& moment) {
  std::vector<std::string> names;
  for (const VtkMoment::Field& field : moment.fields) names.push_back(fmt::format("{} ({})", field.name, field.components));
  return names.empty() ? "none" : sim::list_words(names, 12);
}

bool same_cells(const Cells& a, const Cells& b) { return a.shapes == b.shapes && a.begin == b.begin && a.nodes == b.nodes; }

// The times of the moments: their own, of --step, or 0 of a single one.
sim::VecX times_of(const std::vector<VtkMoment>& moments, const VtkRequest& request) {
  sim::VecX times(std::ssize(moments));
  for (size_t i = 0; i < moments.size(); ++i) {
    const VtkMoment& moment = moments[i];
    if (!moment.time && !request.step && moments.size() > 1)
      throw InputError(
          fmt::format("{}: holds no time (field data TimeValue); read a .pvd file, which lists files with their times, or give "
                      "--step SECONDS",
                      moment.file));
    times[static_cast<Eigen::Index>(i)] = moment.time ? *moment.time : request.step.value_or(0.0) * static_cast<double>(i);
    if (i > 0 && !(times[static_cast<Eigen::Index>(i)] > times[static_cast<Eigen::Index>(i) - 1]))
      throw InputError(fmt::format("{}: its time {:g} s is not after that of {}", moment.file, times[static_cast<Eigen::Index>(i)],
                                   moments[i - 1].file));
  }
  return times;
}

void check_moment(const VtkMoment& moment, const VtkMoment& first) {
  if (moment.points.size() != first.points.size() || !same_cells(moment.cells, first.cells))
    throw InputError(fmt::format("{}: has {} points and {} cells, not those of {} ({} and {}): a series keeps its mesh", moment.file,
                                 moment.points.size() / 3, moment.cells.count(), first.file, first.points.size() / 3, first.cells.count()));
  for (const double x : moment.points)
    if (!std::isfinite(x)) throw InputError(fmt::format("{}: a point has a coordinate that is not finite", moment.file));
  for (const VtkMoment::Field& field : moment.fields)
    if (field.values.size() * 3 != moment.points.size() * field.components)
      throw InputError(fmt::format("{}: point data {} has {} values for {} points of {} components", moment.file, sim::quote(field.name),
                                   field.values.size(), moment.points.size() / 3, field.components));
}

}  // namespace

NodalSeries to_series(std::vector<VtkMoment> moments, const std::string& kind, const VtkRequest& request) {
  const VtkMoment& first = moments.front();
  for (const VtkMoment& moment : moments) check_moment(moment, first);
  NodalSeries series;
  series.file = first.file;
  series.kind = kind;
  series.times = times_of(moments, request);
  const Eigen::Index nt = series.times.size(), n = std::ssize(first.points) / 3;
  double size = 0.0, moved = 0.0;
  for (const auto coordinate : first.points) size = std::max(size, std::abs(coordinate));
  for (const VtkMoment& moment : moments)
    for (size_t k = 0; k < first.points.size(); ++k) moved = std::max(moved, std::abs(moment.points[k] - first.points[k]));
  const bool by_points = moved > 1e-12 * size;
  if (!by_points && !displacement_of(first))
    throw InputError(
        fmt::format("{}: nothing moves: its points stay, and it has no point data 'displacement' (U, disp) of three components; its "
                    "point data: {}",
                    first.file, field_names(first)));
  if (by_points && displacement_of(first))
    series.notes.emplace_back("its points move: the motion is theirs, and the point data of displacements are not used");
  if (first.left_out > 0) series.notes.push_back(fmt::format("{} cells without a surface (points, lines) are left out", first.left_out));

  series.points = request.unit * Eigen::Map<const Eigen::Matrix<double, -1, 3, Eigen::RowMajor>>(first.points.data(), n, 3);
  series.displacement.resize(nt, 3 * n);
  for (Eigen::Index i = 0; i < nt; ++i) {
    const VtkMoment& moment = moments[i];
    const VtkMoment::Field* field = by_points ? nullptr : displacement_of(moment);
    if (!by_points && !field)
      throw InputError(fmt::format("{}: lacks the point data of displacements that {} has", moment.file, first.file));
    const Eigen::Map<const Eigen::RowVectorXd> now(by_points ? moment.points.data() : field->values.data(), 3 * n);
    series.displacement.row(i) = request.unit * now;
    if (by_points) series.displacement.row(i) -= request.unit * Eigen::Map<const Eigen::RowVectorXd>(first.points.data(), 3 * n);
    if (!series.displacement.row(i).allFinite()) throw InputError(fmt::format("{}: a displacement is not finite", moment.file));
    const std::vector<double> stress = stress_of(moment);
    if (i == 0 && !stress.empty()) series.von_mises.resize(nt, n);
    if (series.von_mises.size() == 0) continue;
    if (std::ssize(stress) != n) throw InputError(fmt::format("{}: lacks the stress that {} has", moment.file, first.file));
    series.von_mises.row(i) = request.stress * Eigen::Map<const Eigen::RowVectorXd>(stress.data(), n);
    if (!series.von_mises.row(i).allFinite()) throw InputError(fmt::format("{}: a stress is not finite", moment.file));
  }
  series.cells = std::move(moments.front().cells);
  return series;
}

void add_vtk_cell(int type, const std::vector<int>& nodes, VtkMoment& moment) {
  struct Kind {
    CellShape shape;
    bool quadratic;
  };
  // vtkCellType.h
  static const std::map<int, Kind> kinds = {
      {5, {CellShape::triangle, false}},     {7, {CellShape::polygon, false}},     {9, {CellShape::quad, false}},
      {10, {CellShape::tetrahedron, false}}, {12, {CellShape::hexahedron, false}}, {13, {CellShape::wedge, false}},
      {14, {CellShape::pyramid, false}},     {22, {CellShape::triangle, true}},    {23, {CellShape::quad, true}},
      {24, {CellShape::tetrahedron, true}},  {25, {CellShape::hexahedron, true}},  {26, {CellShape::wedge, true}},
      {27, {CellShape::pyramid, true}},      {28, {CellShape::quad, true}},        {29, {CellShape::hexahedron, true}}};
  const int count = static_cast<int>(moment.points.size() / 3);
  for (const int node : nodes)
    if (node < 0 || node >= count) throw InputError(fmt::format("{}: a cell names point {} of {}", moment.file, node, count));
  if ((type >= 0 && type <= 4) || type == 21) {
    ++moment.left_out;
    return;
  }
  const auto at = kinds.find(type);
  if (at == kinds.end())
    throw InputError(
        fmt::format("{}: cells of VTK type {} are not read; triangles, quads, tetrahedra, hexahedra, wedges, pyramids, linear and "
                    "quadratic, are",
                    moment.file, type));
  std::vector<int> kept = nodes;
  const Kind& kind = at->second;
  if (kind.shape != CellShape::polygon) {
    const size_t wanted = kind.quadratic ? quadratic_count(kind.shape) : corner_count(kind.shape);
    if (kept.size() < wanted)
      throw InputError(fmt::format("{}: a cell of VTK type {} has {} points, {} are needed", moment.file, type, kept.size(), wanted));
    kept.resize(wanted);  // without the nodes within faces of types 28 and 29
  } else if (kept.size() < 3) {
    ++moment.left_out;
    return;
  }
  moment.cells.add(kind.shape, kind.quadratic, kept);
}

}  // namespace flexframe::imports
