// VTKHDF files.
#include "render/import/hdf5_reader.h"
#include "render/import/vtk_series.h"

#include "sim/base/words.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::imports {
namespace {

Hdf5Reader open(const std::filesystem::path& path) {
  Hdf5Reader reader(path);
  if (!reader.has("/VTKHDF")) reader.fail("is no VTKHDF file: it lacks the group VTKHDF");
  return reader;
}

// Where the data of a step begin.
struct Step {
  std::optional<double> time;
  hsize_t part = 0, point = 0, cell = 0, connectivity = 0;
  hsize_t index = 0;
  int parts = -1;  // all
};

// Cells of every part of a step: of the group itself, of polygons in Polygons.
void add_cells(const Hdf5Reader& reader, const std::string& group, bool polygons, const Step& step, VtkMoment& moment) {
  const std::string at = polygons ? group + "/Polygons" : group;
  if (!reader.has(at + "/Connectivity")) return;
  const std::vector<double> points = reader.rows(group + "/NumberOfPoints", step.part, step.parts),
                            cells = reader.rows(at + "/NumberOfCells", step.part, step.parts),
                            ids = reader.rows(at + "/NumberOfConnectivityIds", step.part, step.parts);
  if (cells.size() != points.size() || ids.size() != points.size()) reader.fail("its parts have counts that differ in number");
  hsize_t cell = step.cell, offset = step.cell + step.part, id = step.connectivity;
  int first_point = 0;
  for (size_t p = 0; p < cells.size(); ++p) {
    const auto count = static_cast<std::int64_t>(cells[p]);
    const std::vector<double> nodes = reader.rows(at + "/Connectivity", id, static_cast<std::int64_t>(ids[p])),
                              ends = reader.rows(at + "/Offsets", offset, count + 1),
                              types =
                                  polygons ? std::vector<double>(static_cast<size_t>(count), 7.0) : reader.rows(at + "/Types", cell, count);
    for (size_t c = 0; c + 1 < ends.size(); ++c) {
      if (!(ends[c] >= 0.0 && ends[c + 1] >= ends[c] && ends[c + 1] <= static_cast<double>(nodes.size())))
        reader.fail("the ends of its cells do not rise");
      std::vector<int> of_cell;
      for (auto k = static_cast<size_t>(ends[c]); k < static_cast<size_t>(ends[c + 1]); ++k)
        of_cell.push_back(first_point + static_cast<int>(nodes[k]));
      add_vtk_cell(static_cast<int>(types[c]), of_cell, moment);
    }
    cell += static_cast<hsize_t>(count);
    offset += static_cast<hsize_t>(count) + 1;
    id += static_cast<hsize_t>(ids[p]);
    first_point += static_cast<int>(points[p]);
  }
}

VtkMoment read_step(const Hdf5Reader& reader, const std::string& file, bool polygons, const Step& step) {
  const std::string group = "/VTKHDF";
  VtkMoment moment;
  moment.file = file;
  moment.time = step.time;
  double points = 0.0;
  for (const double count : reader.rows(group + "/NumberOfPoints", step.part, step.parts)) points += count;
  hsize_t width = 0;
  moment.points = reader.rows(group + "/Points", step.point, static_cast<std::int64_t>(points), &width);
  if (width != 3) reader.fail(fmt::format("its points have {} coordinates", width));
  add_cells(reader, group, polygons, step, moment);
  for (const std::string& name : reader.members(group + "/PointData")) {
    const std::string offsets = group + "/Steps/PointDataOffsets/" + name;
    const hsize_t first = reader.has(offsets) ? static_cast<hsize_t>(reader.number(offsets, step.index)) : step.point;
    VtkMoment::Field field{.name = name, .components = 1, .values = {}};
    field.values = reader.rows(group + "/PointData/" + name, first, static_cast<std::int64_t>(points), &width);
    field.components = static_cast<int>(width);
    moment.fields.push_back(std::move(field));
  }
  return moment;
}

}  // namespace

NodalSeries read_vtkhdf(const std::filesystem::path& file, const VtkRequest& request) {
  const sim::hdf5::Quiet quiet;
  const Hdf5Reader reader = open(file);
  const std::string type = reader.text("/VTKHDF", "Type");
  if (type != "UnstructuredGrid" && type != "PolyData")
    reader.fail(fmt::format("holds {}; UnstructuredGrid or PolyData is needed", sim::quote(type)));
  const bool polygons = type == "PolyData";
  std::vector<VtkMoment> moments;
  if (!reader.has("/VTKHDF/Steps")) {
    moments.push_back(read_step(reader, file.string(), polygons, {}));
    return to_series(std::move(moments), "VTKHDF file", request);
  }
  const std::string steps = "/VTKHDF/Steps/";
  const std::vector<double> times = reader.rows(steps + "Values", 0, -1);
  const auto offset = [&](const char* name, hsize_t i) {
    if (!reader.has(steps + name)) return hsize_t{0};
    const std::vector<double> row = reader.rows(steps + name, i, 1);
    // PolyData: of vertices, lines, polygons, strips.
    return static_cast<hsize_t>(std::max(0.0, row.size() == 4 ? row[2] : row.front()));
  };
  for (hsize_t i = 0; i < times.size(); ++i) {
    Step step{.time = times[i], .part = offset("PartOffsets", i), .point = offset("PointOffsets", i), .cell = offset("CellOffsets", i)};
    step.connectivity = offset("ConnectivityIdOffsets", i);
    step.index = i;
    step.parts = reader.has(steps + "NumberOfParts") ? static_cast<int>(reader.number(steps + "NumberOfParts", i)) : 1;
    moments.push_back(read_step(reader, file.string(), polygons, step));
  }
  if (moments.empty()) reader.fail("its Steps hold no times");
  return to_series(std::move(moments), "VTKHDF file", request);
}

}  // namespace flexframe::imports
