// One VTKHDF file for the whole sequence (Kitware, VTK file formats: VTKHDF 2.0, temporal unstructured grid): the mesh once, points and
// data a step. Triangles as an unstructured grid and not as poly data: readers of version 1.0, as VTK 9.1's, know the former and open the
// first step of such a file.
#include "render/film/vtk.h"

#include "render/film/vtk_surface.h"
#include "sim/base/hdf5_file.h"

#include <algorithm>

namespace flexframe::film {
namespace {

namespace hdf = sim::hdf5;
using hdf::check;
using hdf::done;
using hdf::Id;

Id group(hid_t parent, const std::string& name) {
  return {done(H5Gcreate2(parent, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)), H5Gclose};
}

// A name without the sign that would make it a path.
std::string plain(std::string name) {
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

// A table that rows are added to, packed; width 1: a plain row of numbers.
class Table {
 public:
  Table(hid_t parent, const std::string& name, hid_t type, hsize_t width, hsize_t chunk, const std::string& unit = "")
      : type_(type), rank_(width > 1 ? 2 : 1), width_(width) {
    const hsize_t none[2] = {0, width}, any[2] = {H5S_UNLIMITED, width};
    // A megabyte at a time: small enough for the reader's cache of chunks.
    const hsize_t most = std::max<hsize_t>(1, (1u << 20) / (H5Tget_size(type) * width)),
                  chunks[2] = {std::clamp<hsize_t>(chunk, 1, most), width};
    const Id space(done(H5Screate_simple(rank_, none, any)), H5Sclose), how(done(H5Pcreate(H5P_DATASET_CREATE)), H5Pclose);
    check(H5Pset_chunk(how, rank_, chunks));
    check(H5Pset_shuffle(how));
    check(H5Pset_deflate(how, 4));
    set_ = Id(done(H5Dcreate2(parent, name.c_str(), type, space, H5P_DEFAULT, how, H5P_DEFAULT)), H5Dclose);
    if (!unit.empty()) hdf::write_attribute(set_, "unit", unit);
  }
  // rows x width numbers of the type, row by row.
  void add(const void* numbers, hsize_t rows) {
    if (rows == 0) return;
    const hsize_t start[2] = {rows_, 0}, extent[2] = {rows, width_}, all[2] = {rows_ + rows, width_};
    check(H5Dset_extent(set_, all));
    const Id space(done(H5Dget_space(set_)), H5Sclose), memory(done(H5Screate_simple(rank_, extent, nullptr)), H5Sclose);
    check(H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, extent, nullptr));
    check(H5Dwrite(set_, type_, memory, space, H5P_DEFAULT, numbers));
    rows_ += rows;
  }

 private:
  hid_t type_;
  int rank_;
  hsize_t width_, rows_ = 0;
  Id set_;
};

using Counts = std::vector<std::int64_t>;
void write_counts(hid_t parent, const std::string& name, const Counts& values, hsize_t width = 1) {
  Table(parent, name, H5T_NATIVE_INT64, width, values.size()).add(values.data(), values.size() / width);
}

void write_versions(hid_t root) {
  const hsize_t two = 2;
  const std::int64_t version[2] = {2, 0};
  const Id space(done(H5Screate_simple(1, &two, nullptr)), H5Sclose);
  const Id attribute(done(H5Acreate2(root, "Version", H5T_NATIVE_INT64, space, H5P_DEFAULT, H5P_DEFAULT)), H5Aclose);
  check(H5Awrite(attribute, H5T_NATIVE_INT64, version));
  // VTK wants the type as ASCII of just its length.
  const std::string type = "UnstructuredGrid";
  const Id one(done(H5Screate(H5S_SCALAR)), H5Sclose), text(done(H5Tcopy(H5T_C_S1)), H5Tclose);
  check(H5Tset_size(text, type.size()));
  check(H5Tset_strpad(text, H5T_STR_NULLPAD));
  const Id word(done(H5Acreate2(root, "Type", text, one, H5P_DEFAULT, H5P_DEFAULT)), H5Aclose);
  check(H5Awrite(word, text, type.data()));
}

// The mesh, once for all steps.
void write_cells(hid_t root, const VtkSurface& surface) {
  constexpr std::uint8_t vtk_triangle = 5;
  const std::size_t count = surface.body.size();
  Counts ends{0};
  for (std::size_t k = 0; k < count; ++k) ends.push_back(static_cast<std::int64_t>(3 * (k + 1)));
  write_counts(root, "NumberOfPoints", {static_cast<std::int64_t>(surface.points.size() / 3)});
  write_counts(root, "NumberOfCells", {static_cast<std::int64_t>(count)});
  write_counts(root, "NumberOfConnectivityIds", {static_cast<std::int64_t>(surface.corners.size())});
  write_counts(root, "Offsets", ends);
  write_counts(root, "Connectivity", surface.corners);
  const std::vector<std::uint8_t> types(count, vtk_triangle);
  Table(root, "Types", H5T_NATIVE_UINT8, 1, count).add(types.data(), count);
  const Id data = group(root, "CellData");
  Table(data, "body", H5T_NATIVE_INT32, 1, count).add(surface.body.data(), count);
}

// Where each step finds its rows: points and their data one behind the other, one and the same part and cells.
void write_steps(hid_t root, const std::vector<double>& times, std::int64_t points, const std::vector<std::string>& point_data,
                 const std::vector<std::string>& fields) {
  const Id steps = group(root, "Steps");
  const std::size_t n = times.size();
  const Id one(done(H5Screate(H5S_SCALAR)), H5Sclose);
  const auto count = static_cast<std::int64_t>(n);
  const Id attribute(done(H5Acreate2(steps, "NSteps", H5T_NATIVE_INT64, one, H5P_DEFAULT, H5P_DEFAULT)), H5Aclose);
  check(H5Awrite(attribute, H5T_NATIVE_INT64, &count));
  Table(steps, "Values", H5T_NATIVE_DOUBLE, 1, n, "s").add(times.data(), n);
  Counts rows, numbers;
  for (std::int64_t k = 0; k < count; ++k) rows.push_back(k * points), numbers.push_back(k);
  write_counts(steps, "PartOffsets", Counts(n, 0));
  write_counts(steps, "NumberOfParts", Counts(n, 1));
  write_counts(steps, "PointOffsets", rows);
  write_counts(steps, "CellOffsets", Counts(n, 0));
  write_counts(steps, "ConnectivityIdOffsets", Counts(n, 0));
  const Id at = group(steps, "PointDataOffsets"), cell = group(steps, "CellDataOffsets"), field = group(steps, "FieldDataOffsets"),
           sizes = group(steps, "FieldDataSizes");
  for (const std::string& name : point_data) write_counts(at, name, rows);
  write_counts(cell, "body", Counts(n, 0));
  for (const std::string& name : fields) {
    write_counts(field, name, numbers);
    write_counts(sizes, name, Counts(2 * n, 1), 2);  // one component, one value
  }
}

void write_sequence(const Animation& animation, double scale, hid_t file, const std::function<void(int, int)>& progress) {
  const Id root = group(file, "VTKHDF");
  write_versions(root);
  BodyMemory memory;
  std::vector<double> times;
  VtkSurface surface = vtk_surface(animation, picture_time(animation, 0), scale, memory);
  write_cells(root, surface);
  const hsize_t n = surface.points.size() / 3;
  Table points(root, "Points", H5T_NATIVE_DOUBLE, 3, n, "m");
  struct Data {
    std::string name;
    Table table;
    std::vector<float> VtkSurface::*values;
  };
  const Id point_data = group(root, "PointData"), field_data = group(root, "FieldData");
  std::vector<Data> all;
  const auto add = [&](const std::string& name, hsize_t width, const char* unit, std::vector<float> VtkSurface::*values) {
    if (!(surface.*values).empty() || n == 0) all.push_back({name, Table(point_data, name, H5T_NATIVE_FLOAT, width, n, unit), values});
  };
  add("displacement", 3, "m", &VtkSurface::displacement);
  add("velocity", 3, "m/s", &VtkSurface::velocity);
  add("stress", 1, "Pa", &VtkSurface::stress);
  if (!surface.scalars.empty()) add(scalar_name(animation), 1, "", &VtkSurface::scalars);
  const sim::Results& results = *animation.results;
  std::vector<Table> histories;
  std::vector<std::string> names, fields;
  for (const sim::ResultOutput& o : results.outputs) {
    fields.push_back(plain(o.column));
    histories.emplace_back(field_data, fields.back(), H5T_NATIVE_DOUBLE, 1, animation.count, o.unit);
  }
  for (int k = 0; k < animation.count; ++k) {
    times.push_back(picture_time(animation, k));
    if (k > 0) surface = vtk_surface(animation, times.back(), scale, memory);
    points.add(surface.points.data(), n);
    for (Data& data : all) data.table.add((surface.*data.values).data(), n);
    for (std::size_t o = 0; o < histories.size(); ++o) {
      const double value = output_at(results, results.outputs[o], times.back());
      histories[o].add(&value, 1);
    }
    if (progress) progress(k + 1, animation.count);
  }
  for (const Data& data : all) names.push_back(data.name);
  write_steps(root, times, static_cast<std::int64_t>(n), names, fields);
}

}  // namespace

VtkReport write_vtkhdf(const Animation& animation, double scale, const std::filesystem::path& file,
                       const std::function<void(int, int)>& progress) {
  hdf::write_hdf5(file, [&](hid_t id) { write_sequence(animation, scale, id, progress); });
  return {animation.count, file};
}

}  // namespace flexframe::film
