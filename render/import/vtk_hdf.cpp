// VTKHDF files.
#include "render/import/vtk_series.h"

#include "sim/base/hdf5_file.h"
#include "sim/base/words.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::imports {
namespace {

using sim::InputError;
using sim::hdf5::Id;

class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : name_(path.string()) {
    H5dont_atexit();
    if (!std::filesystem::is_regular_file(path)) throw InputError(fmt::format("{}: no such file", name_));
    file_ = Id(H5Fopen(name_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
    if (!file_.valid()) fail(fmt::format("is no HDF5 file that can be read: {}", sim::hdf5::hdf5_reason()));
    if (!has("/VTKHDF")) fail("is no VTKHDF file: it lacks the group VTKHDF");
  }
  [[noreturn]] void fail(const std::string& message) const { throw InputError(fmt::format("{}: {}", name_, message)); }

  bool has(const std::string& path) const {
    // Every step of the way must be there.
    for (size_t at = path.find('/', 1); at != std::string::npos; at = path.find('/', at + 1))
      if (H5Lexists(file_, path.substr(0, at).c_str(), H5P_DEFAULT) <= 0) return false;
    return H5Lexists(file_, path.c_str(), H5P_DEFAULT) > 0;
  }

  // Rows first ... first + count of a dataset as numbers; count < 0: all. width: numbers a row.
  std::vector<double> rows(const std::string& path, hsize_t first, std::int64_t count, hsize_t* width = nullptr) const {
    const Id set(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose);
    if (!set.valid()) fail(fmt::format("lacks the dataset {}", path));
    const Id type(H5Dget_type(set), H5Tclose), space(H5Dget_space(set), H5Sclose);
    const H5T_class_t kind = H5Tget_class(type);
    const int rank = H5Sget_simple_extent_ndims(space);
    if ((kind != H5T_INTEGER && kind != H5T_FLOAT) || rank < 1 || rank > 2) fail(fmt::format("dataset {} is no table of numbers", path));
    hsize_t dims[2] = {0, 1};
    H5Sget_simple_extent_dims(space, dims, nullptr);
    const hsize_t wanted = count < 0 ? dims[0] - std::min(dims[0], first) : static_cast<hsize_t>(count);
    // No packing makes a byte into more than about a thousand.
    const std::uintmax_t most = 1100 * std::filesystem::file_size(name_);
    if (first + wanted > dims[0] || wanted > most / std::max<hsize_t>(1, dims[1]))
      fail(fmt::format("dataset {} has {} rows, {} from row {} on are needed", path, dims[0], wanted, first));
    std::vector<double> out(wanted * dims[1]);
    if (width) *width = dims[1];
    if (out.empty()) return out;
    const hsize_t start[2] = {first, 0}, extent[2] = {wanted, dims[1]};
    const Id memory(H5Screate_simple(rank, extent, nullptr), H5Sclose);
    if (H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, extent, nullptr) < 0 ||
        H5Dread(set, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, out.data()) < 0)
      fail(fmt::format("dataset {} cannot be read: {}", path, sim::hdf5::hdf5_reason()));
    return out;
  }
  double number(const std::string& path, hsize_t row) const { return rows(path, row, 1).front(); }

  std::string type() const {
    const Id group(H5Gopen2(file_, "/VTKHDF", H5P_DEFAULT), H5Gclose);
    const Id attribute(H5Aopen(group, "Type", H5P_DEFAULT), H5Aclose);
    if (!attribute.valid()) fail("lacks the attribute Type of the group VTKHDF");
    const Id kind(H5Aget_type(attribute), H5Tclose);
    if (H5Tget_class(kind) != H5T_STRING) fail("the attribute Type is no text");
    if (H5Tis_variable_str(kind) > 0) {
      char* text = nullptr;
      if (H5Aread(attribute, kind, &text) < 0 || !text) fail("the attribute Type cannot be read");
      std::string out(text);
      H5free_memory(text);
      return out;
    }
    std::string text(std::min<size_t>(H5Tget_size(kind), 1000), '\0');
    if (text.size() < H5Tget_size(kind) || H5Aread(attribute, kind, text.data()) < 0) fail("the attribute Type cannot be read");
    return text.substr(0, std::min(text.find('\0'), text.size()));
  }

  std::vector<std::string> members(const std::string& path) const {
    std::vector<std::string> names;
    if (!has(path)) return names;
    H5Literate_by_name(
        file_, path.c_str(), H5_INDEX_NAME, H5_ITER_INC, nullptr,
        [](hid_t, const char* name, const H5L_info_t*, void* out) -> herr_t {
          static_cast<std::vector<std::string>*>(out)->emplace_back(name);
          return 0;
        },
        &names, H5P_DEFAULT);
    return names;
  }

 private:
  std::string name_;
  Id file_;
};

// Where the data of a step begin.
struct Step {
  std::optional<double> time;
  hsize_t part = 0, point = 0, cell = 0, connectivity = 0;
  hsize_t index = 0;
  int parts = -1;  // all
};

// Cells of every part of a step: of the group itself, of polygons in Polygons.
void add_cells(const Reader& reader, const std::string& group, bool polygons, const Step& step, VtkMoment& moment) {
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

VtkMoment read_step(const Reader& reader, const std::string& file, bool polygons, const Step& step) {
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
  const Reader reader(file);
  const std::string type = reader.type();
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
