// HDF5 access and the layout of sim/RESULTS.md. Metadata carry checksums (format 1.10), data blocks Fletcher's, strings have a fixed
// length: a damaged file is found, not followed. HDF5 1.10 itself follows what has no checksum: damaged metadata of older formats, read
// beyond their end, and the global heaps of variable-length data, where it can loop for ever. Files with either are refused before it sees
// them.
#include "sim/results/results_file.h"

#include "sim/base/file_output.h"
#include "sim/base/words.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <hdf5.h>

namespace flexframe::sim {

namespace {

constexpr const char* format_name = "flexframe results";
constexpr int format_version = 1;
constexpr std::size_t chunk_bytes = 256u << 10;
constexpr hsize_t most_times = 100'000'000;
constexpr std::size_t longest_string = 16u << 20;
constexpr char checked_format = 3;  // version of the superblock of files whose metadata all have checksums

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// HDF5 prints its error stack unless told not to; restores the caller's setting.
class Quiet {
 public:
  Quiet() {
    H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~Quiet() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

// Owns an identifier.
class Id {
 public:
  Id() = default;
  Id(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Id(Id&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Id& operator=(Id&& other) noexcept {
    reset();
    id_ = std::exchange(other.id_, -1);
    close_ = other.close_;
    return *this;
  }
  ~Id() { reset(); }
  operator hid_t() const { return id_; }
  bool valid() const { return id_ >= 0; }
  bool reset() {
    const hid_t id = std::exchange(id_, -1);
    return id < 0 || close_(id) >= 0;
  }

 private:
  hid_t id_ = -1;
  herr_t (*close_)(hid_t) = nullptr;
};

// The innermost reason of HDF5's error stack, such as "No space left on device".
std::string hdf5_reason() {
  std::string reason;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_DOWNWARD,
      [](unsigned, const H5E_error2_t* entry, void* out) -> herr_t {
        if (entry->desc && *entry->desc) *static_cast<std::string*>(out) = entry->desc;
        return 0;
      },
      &reason);
  const std::size_t at = reason.find("error message = '");
  if (at != std::string::npos) {
    const std::size_t from = at + std::strlen("error message = '");
    reason = reason.substr(from, reason.find('\'', from) - from);
  }
  return reason.empty() ? "unknown reason" : reason;
}

struct WriteFailure {
  std::string reason = hdf5_reason();  // now: the next call of HDF5 clears it
};

hid_t done(hid_t id) {
  if (id < 0) throw WriteFailure{};
  return id;
}
void check(herr_t status) {
  if (status < 0) throw WriteFailure{};
}

Id text_type(std::size_t length) {
  Id type(done(H5Tcopy(H5T_C_S1)), H5Tclose);
  check(H5Tset_size(type, std::max<std::size_t>(1, length)));
  check(H5Tset_cset(type, H5T_CSET_UTF8));
  check(H5Tset_strpad(type, H5T_STR_NULLPAD));
  return type;
}

void write_attribute(hid_t object, const std::string& name, const std::string& text) {
  const Id type = text_type(text.size()), space(done(H5Screate(H5S_SCALAR)), H5Sclose);
  const Id attribute(done(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT)), H5Aclose);
  check(H5Awrite(attribute, type, text.empty() ? "\0" : text.data()));
}

void write_attribute(hid_t object, const std::string& name, double value) {
  const Id space(done(H5Screate(H5S_SCALAR)), H5Sclose);
  const Id attribute(done(H5Acreate2(object, name.c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT)), H5Aclose);
  check(H5Awrite(attribute, H5T_NATIVE_DOUBLE, &value));
}

void write_attribute(hid_t object, const std::string& name, long value) {
  const Id space(done(H5Screate(H5S_SCALAR)), H5Sclose);
  const Id attribute(done(H5Acreate2(object, name.c_str(), H5T_STD_I64LE, space, H5P_DEFAULT, H5P_DEFAULT)), H5Aclose);
  check(H5Awrite(attribute, H5T_NATIVE_LONG, &value));
}

Id make_group(hid_t parent, const std::string& name) {
  return {done(H5Gcreate2(parent, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)), H5Gclose};
}

// rows x (cols of any shape): dims[0] = values.rows(), the product of the others = values.cols().
void write_numbers(hid_t parent, const std::string& name, const Eigen::Ref<const MatX>& values, std::vector<hsize_t> dims,
                   const std::string& unit, const std::string& meaning) {
  if (values.size() == 0) return;
  const std::size_t row_bytes = static_cast<std::size_t>(values.cols()) * sizeof(double);
  const auto block = static_cast<hsize_t>(std::clamp<std::size_t>(chunk_bytes / row_bytes, 1, static_cast<std::size_t>(values.rows())));
  const Id space(done(H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr)), H5Sclose);
  const Id creation(done(H5Pcreate(H5P_DATASET_CREATE)), H5Pclose);
  std::vector<hsize_t> chunk = dims;
  chunk[0] = block;
  check(H5Pset_chunk(creation, static_cast<int>(chunk.size()), chunk.data()));
  check(H5Pset_fletcher32(creation));
  const Id set(done(H5Dcreate2(parent, name.c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT, creation, H5P_DEFAULT)), H5Dclose);
  if (!unit.empty()) write_attribute(set, "unit", unit);
  write_attribute(set, "meaning", meaning);

  // a chunk at a time, turned to row-major
  RowMajor rows;
  for (hsize_t first = 0; first < dims[0]; first += block) {
    const hsize_t count = std::min(block, dims[0] - first);
    rows = values.middleRows(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(count));
    std::vector<hsize_t> start(dims.size(), 0), extent = dims;
    start[0] = first;
    extent[0] = count;
    check(H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, extent.data(), nullptr));
    const Id memory(done(H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr)), H5Sclose);
    check(H5Dwrite(set, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, rows.data()));
  }
}

void write_texts(hid_t parent, const std::string& name, const std::vector<std::string>& texts) {
  if (texts.empty()) return;
  std::size_t longest = 1;
  for (const std::string& text : texts) longest = std::max(longest, text.size());
  std::string packed(longest * texts.size(), '\0');
  for (std::size_t i = 0; i < texts.size(); ++i)
    std::copy(texts[i].begin(), texts[i].end(), packed.begin() + static_cast<std::ptrdiff_t>(i * longest));
  const hsize_t count = texts.size();
  const Id type = text_type(longest), space(done(H5Screate_simple(1, &count, nullptr)), H5Sclose);
  const Id set(done(H5Dcreate2(parent, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)), H5Dclose);
  check(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, packed.data()));
}

void write_section(hid_t body, const Section& section) {
  const Id group = make_group(body, "section");
  write_attribute(group, "shape", section.shape);
  const std::pair<const char*, double> numbers[] = {{"area", section.area},      {"iy", section.iy}, {"iz", section.iz},
                                                    {"iyz", section.iyz},        {"j", section.j},   {"shear_y", section.shear_y},
                                                    {"shear_z", section.shear_z}};
  for (const auto& [name, number] : numbers) write_attribute(group, name, number);
  const Id sizes = make_group(group, "sizes");
  for (const auto& [name, size] : section.size) write_attribute(sizes, name, size);
  for (std::size_t i = 0; i < section.outline.size(); ++i) {
    const auto& loop = section.outline[i];
    MatX points(static_cast<Eigen::Index>(loop.size()), 2);
    for (std::size_t k = 0; k < loop.size(); ++k) points.row(static_cast<Eigen::Index>(k)) = loop[k].transpose();
    write_numbers(group, fmt::format("outline_{}", i), points, {loop.size(), 2}, "m", "closed loop of points (y, z) from the centroid");
  }
}

// `parts` nn x n (a node's x y z, or its stresses, below each other) as nn rows of `parts` n.
MatX node_rows(const MatX& shapes, Eigen::Index parts = 3) {
  const Eigen::Index nn = shapes.rows() / parts, n = shapes.cols();
  MatX rows(nn, parts * n);
  for (Eigen::Index i = 0; i < nn; ++i)
    for (Eigen::Index a = 0; a < parts; ++a) rows.row(i).segment(a * n, n) = shapes.row(parts * i + a);
  return rows;
}

// Its inverse.
MatX node_columns(const MatX& rows, Eigen::Index parts = 3) {
  const Eigen::Index nn = rows.rows(), n = rows.cols() / parts;
  MatX shapes(parts * nn, n);
  for (Eigen::Index i = 0; i < nn; ++i)
    for (Eigen::Index a = 0; a < parts; ++a) shapes.row(parts * i + a) = rows.row(i).segment(a * n, n);
  return shapes;
}

void write_body(hid_t bodies, const ResultBody& body, long index, hsize_t nt) {
  const Id group = make_group(bodies, body.name);
  write_attribute(group, "index", index);
  write_attribute(group, "kind", body.kind);
  if (body.length > 0.0) write_attribute(group, "length", body.length);
  if (!body.mesh.empty()) {
    write_attribute(group, "mesh", body.mesh);
    const std::string hash = body.mesh_sha256.empty() ? sha256_of_file(body.mesh) : body.mesh_sha256;
    if (!hash.empty()) write_attribute(group, "mesh_sha256", hash);
  }
  if (!body.section.shape.empty()) write_section(group, body.section);
  write_numbers(group, "position", body.position, {nt, 3}, "m", "origin of the body frame in world axes");
  write_numbers(group, "orientation", body.orientation, {nt, 4}, "", "unit quaternion w x y z, body axes to world axes");

  const auto nn = static_cast<hsize_t>(body.nodes.size());
  std::vector<std::string> names;
  MatX origins(static_cast<Eigen::Index>(nn), 3);
  for (std::size_t i = 0; i < body.nodes.size(); ++i) {
    names.push_back(body.nodes[i].name);
    origins.row(static_cast<Eigen::Index>(i)) = body.nodes[i].origin.transpose();
  }
  write_texts(group, "node_names", names);
  write_numbers(group, "node_origin", origins, {nn, 3}, "m", "undeformed position in the body frame");
  write_numbers(group, "displacement", body.displacement, {nt, nn, 3}, "m",
                "of the nodes from their undeformed position, in the body frame");
  write_numbers(group, "rotation", body.rotation, {nt, nn, 3}, "rad",
                "rotation vector of the nodes from their undeformed orientation, in the body frame");

  const auto n = static_cast<hsize_t>(body.q.cols());
  write_numbers(group, "q", body.q, {nt, n}, "", "elastic coordinates");
  write_numbers(group, "qd", body.qd, {nt, n}, "", "elastic rates");
  write_texts(group, "labels", body.labels);
  write_numbers(group, "node_phi", node_rows(body.node_phi), {nn, 3, n}, "",
                "displacement of the nodes per elastic coordinate, in the body frame");
  write_numbers(group, "node_psi", node_rows(body.node_psi), {nn, 3, n}, "",
                "rotation of the nodes per elastic coordinate, in the body frame");
  write_numbers(group, "strain_stations", body.strain_stations, {static_cast<hsize_t>(body.strain_stations.size())}, "m",
                "stations of 'section_strain' along x");
  write_numbers(group, "section_strain", body.section_strain, {static_cast<hsize_t>(body.section_strain.rows()), 3}, "",
                "row, coordinate of 'q', factor; row: 4 station + field (u', v'', w'', theta')");
  write_texts(group, "unstrained", body.unstrained);
  write_numbers(group, "held_position", body.held_position, {nt, 3}, "m", "origin of the frame of 'q' and 'node_phi' in the body frame");
  write_numbers(group, "held_rotation", body.held_rotation, {nt, 3}, "rad",
                "rotation vector of the frame of 'q' and 'node_phi' in the body frame");
  write_numbers(group, "shown_columns", body.shown_columns, {6, n}, "",
                "translation and rotation of the body frame in the frame of 'q' per elastic coordinate");
  const auto ns = static_cast<hsize_t>(body.stress_nodes.size());
  const MatX places = Eigen::Map<const Eigen::VectorXi>(body.stress_nodes.data(), static_cast<Eigen::Index>(ns)).cast<double>();
  write_numbers(group, "stress_nodes", places, {ns}, "", "nodes of 'node_stress', counted from 0");
  write_numbers(group, "node_stress", node_rows(body.node_stress, 6), {ns, 6, n}, "Pa",
                "stress xx yy zz xy yz xz per elastic coordinate, in the body frame");
}

void write_joint(hid_t joints, const ResultJoint& joint, long index, hsize_t nt) {
  const Id group = make_group(joints, joint.name);
  write_attribute(group, "index", index);
  write_attribute(group, "kind", joint.kind);
  write_numbers(group, "position", joint.position, {nt, 3}, "m", "origin of the joint's parent frame in world axes");
  write_numbers(group, "orientation", joint.orientation, {nt, 4}, "", "unit quaternion w x y z, parent frame to world axes");
  write_numbers(group, "value", joint.value, {nt, static_cast<hsize_t>(joint.value.cols())}, "", "joint coordinates (m, rad, quaternion)");
  write_numbers(group, "rate", joint.rate, {nt, static_cast<hsize_t>(joint.rate.cols())}, "", "joint rates (m/s, rad/s)");
}

void write_all(hid_t file, const Results& results) {
  const auto nt = static_cast<hsize_t>(results.times.size());
  write_attribute(file, "format", std::string(format_name));
  write_attribute(file, "format_version", static_cast<long>(format_version));
  write_attribute(file, "units", std::string("SI: m, kg, s, rad, N, J"));
  write_attribute(file, "title", results.title);
  write_attribute(file, "scene_file", results.scene_file);
  // Where files that the scene names are looked for, also by a reader that works in another folder.
  std::error_code error;
  const std::filesystem::path scene = std::filesystem::absolute(results.scene_file, error);
  if (!results.scene_file.empty() && !error) write_attribute(file, "scene_folder", scene.lexically_normal().parent_path().string());
  write_attribute(file, "scene_sha256", sha256(results.scene_text));
  write_texts(file, "scene", {results.scene_text});
  write_numbers(file, "times", results.times, {nt}, "s", "times of the samples, increasing");

  const Id bodies = make_group(file, "bodies");
  for (std::size_t i = 0; i < results.bodies.size(); ++i) write_body(bodies, results.bodies[i], static_cast<long>(i), nt);
  const Id joints = make_group(file, "joints");
  for (std::size_t i = 0; i < results.joints.size(); ++i) write_joint(joints, results.joints[i], static_cast<long>(i), nt);

  const Id outputs = make_group(file, "outputs");
  std::vector<std::string> columns, units, descriptions;
  bool described = false;
  MatX values(static_cast<Eigen::Index>(nt), static_cast<Eigen::Index>(results.outputs.size()));
  for (std::size_t i = 0; i < results.outputs.size(); ++i) {
    columns.push_back(results.outputs[i].column);
    units.push_back(results.outputs[i].unit);
    descriptions.push_back(results.outputs[i].description);
    described = described || !descriptions.back().empty();
    values.col(static_cast<Eigen::Index>(i)) = results.outputs[i].values;
  }
  write_texts(outputs, "columns", columns);
  write_texts(outputs, "units", units);
  if (described) write_texts(outputs, "descriptions", descriptions);
  write_numbers(outputs, "values", values, {nt, columns.size()}, "", "histories of the scene's outputs, one column each");

  const Id energy = make_group(file, "energy");
  const std::pair<const char*, const VecX*> energies[] = {{"kinetic", &results.kinetic},
                                                          {"strain", &results.strain},
                                                          {"potential", &results.potential},
                                                          {"supplied", &results.supplied},
                                                          {"dissipated", &results.dissipated}};
  for (const auto& [name, values_of] : energies) write_numbers(energy, name, *values_of, {nt}, "J", "of the whole system");

  const SolverStatistics& s = results.statistics;
  const Id statistics = make_group(file, "statistics");
  write_attribute(statistics, "method", s.method);
  write_attribute(statistics, "tolerance", s.tolerance);
  const std::pair<const char*, long> counts[] = {
      {"steps", s.steps}, {"evaluations", s.evaluations}, {"jacobians", s.jacobians}, {"events", s.events}, {"restarts", s.restarts}};
  for (const auto& [name, count] : counts) write_attribute(statistics, name, count);
  write_attribute(statistics, "cpu_seconds", s.cpu_seconds);
  write_attribute(statistics, "error_estimate", s.error_estimate);
  write_attribute(statistics, "error_column", s.error_column);
  write_texts(statistics, "notes", s.notes.texts(Severity::note));
  write_texts(statistics, "warnings", s.notes.texts(Severity::warning));
}

// Sizes and numbers of results, before a file is begun.
void check_results(const Results& results) {
  const auto fail = [](const std::string& message) { throw SimulationError("the results cannot be written: " + message); };
  const Eigen::Index nt = results.times.size();
  if (nt == 0) fail("they hold no times");
  const auto series = [&](const std::string& what, const Eigen::Ref<const MatX>& values, Eigen::Index cols, bool optional) {
    if (values.size() == 0 && (optional || cols == 0)) return;
    if (values.rows() != nt || values.cols() != cols)
      fail(fmt::format("{} is {} x {}, not {} x {}", what, values.rows(), values.cols(), nt, cols));
    if (!values.allFinite()) fail(fmt::format("{} holds a value that is not finite", what));
  };
  const auto name = [&](const char* what, const std::string& text) {
    if (text.empty() || text == "." || text.find('/') != std::string::npos || text.find('\0') != std::string::npos)
      fail(fmt::format("{} is no name of a {}", quote(text), what));
  };
  series("times", results.times, 1, false);
  for (const ResultBody& body : results.bodies) {
    name("body", body.name);
    const auto nn = static_cast<Eigen::Index>(body.nodes.size());
    series(body.name + ": position", body.position, 3, false);
    series(body.name + ": orientation", body.orientation, 4, false);
    series(body.name + ": displacement", body.displacement, 3 * nn, false);
    series(body.name + ": rotation", body.rotation, 3 * nn, true);
    series(body.name + ": q", body.q, body.q.cols(), true);
    series(body.name + ": qd", body.qd, body.q.cols(), true);
    for (const ResultNode& node : body.nodes)
      if (!node.origin.allFinite()) fail(fmt::format("{}: a node's origin is not finite", body.name));
    for (const MatX* shapes : {&body.node_phi, &body.node_psi})
      if (shapes->size() > 0 && (shapes->rows() != 3 * nn || shapes->cols() != body.q.cols() || !shapes->allFinite()))
        fail(fmt::format("{}: the mode shapes are {} x {}, not finite {} x {}", body.name, shapes->rows(), shapes->cols(), 3 * nn,
                         body.q.cols()));
    for (Eigen::Index i = 0; i < body.section_strain.rows(); ++i)
      if (const Vec3 e = body.section_strain.row(i);
          !e.allFinite() || !(e[0] >= 0.0 && e[0] < 4.0 * static_cast<double>(body.strain_stations.size()) && e[1] >= 0.0 &&
                              e[1] < static_cast<double>(body.q.cols())))
        fail(fmt::format("{}: row {} of the sections' strains names no station or coordinate", body.name, i));
    series(body.name + ": held_position", body.held_position, 3, true);
    series(body.name + ": held_rotation", body.held_rotation, 3, true);
    if (body.held_rotation.rows() != body.held_position.rows() ||
        (body.held_position.rows() > 0 && (body.shown_columns.cols() != body.q.cols() || !body.shown_columns.allFinite())))
      fail(fmt::format("{}: 'held_position' needs 'held_rotation' and finite 'shown_columns' of the {} coordinates", body.name,
                       body.q.cols()));
    const auto ns = static_cast<Eigen::Index>(body.stress_nodes.size());
    if (body.node_stress.rows() != 6 * ns || (ns > 0 && body.node_stress.cols() != body.q.cols()) || !body.node_stress.allFinite())
      fail(fmt::format("{}: the stress modes are {} x {}, not finite {} x {}", body.name, body.node_stress.rows(), body.node_stress.cols(),
                       6 * ns, body.q.cols()));
    for (int i : body.stress_nodes)
      if (i < 0 || i >= nn) fail(fmt::format("{}: node {} with stress is not there", body.name, i));
  }
  for (const ResultJoint& joint : results.joints) {
    name("joint", joint.name);
    series(joint.name + ": position", joint.position, 3, true);
    series(joint.name + ": orientation", joint.orientation, 4, true);
    series(joint.name + ": value", joint.value, joint.value.cols(), true);
    series(joint.name + ": rate", joint.rate, joint.rate.cols(), true);
  }
  for (const ResultOutput& output : results.outputs) series("output " + output.column, output.values, 1, false);
  for (const VecX* energy : {&results.kinetic, &results.strain, &results.potential, &results.supplied, &results.dissipated})
    series("energy", *energy, 1, true);
}

// Reading: every error names the file and the object.
class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : name_(path.string()) {}

  [[noreturn]] void fail(const std::string& object, const std::string& message) const {
    throw InputError(fmt::format("{}: {}: {}", name_, object, message));
  }

  Id open_file() const {
    std::error_code error;
    const auto status = std::filesystem::status(name_, error);
    if (status.type() == std::filesystem::file_type::not_found) throw InputError(fmt::format("{}: no such file", name_));
    if (std::filesystem::is_directory(status)) throw InputError(fmt::format("{}: is a directory; a results file is expected", name_));
    if (!std::filesystem::is_regular_file(status)) throw InputError(fmt::format("{}: cannot be read: it is no regular file", name_));
    std::ifstream bytes(name_, std::ios::binary);
    if (!bytes) throw InputError(fmt::format("{}: cannot be read: {}", name_, std::strerror(errno)));
    char start[9] = {};
    bytes.read(start, sizeof start);
    if (bytes.gcount() != sizeof start || std::memcmp(start, "\x89HDF\r\n\x1a\n", 8) != 0)
      throw InputError(fmt::format("{}: is no HDF5 file; a results file of flexframe is expected", name_));
    if (start[8] != checked_format)
      throw InputError(
          fmt::format("{}: has one of HDF5's older formats, without checksums, which are not read; write format 1.10, in h5py File(name, "
                      "\"w\", libver=\"v110\")",
                      name_));
    if (holds_global_heap(bytes))
      throw InputError(
          fmt::format("{}: holds data of variable length (an HDF5 global heap), which is not read; write strings with a fixed length, in "
                      "h5py as numpy.bytes_(\"text\")",
                      name_));
    Id file(H5Fopen(name_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
    if (!file.valid()) throw InputError(fmt::format("{}: cannot be opened (damaged or cut short?): {}", name_, hdf5_reason()));
    // What holds_global_heap looks for has sizes of 8 bytes.
    const Id creation(H5Fget_create_plist(file), H5Pclose);
    std::size_t address_bytes = 0, size_bytes = 0;
    if (!creation.valid() || H5Pget_sizes(creation, &address_bytes, &size_bytes) < 0 || address_bytes != 8 || size_bytes != 8)
      throw InputError(fmt::format("{}: has addresses and sizes of {} and {} bytes; 8 are expected", name_, address_bytes, size_bytes));
    return file;
  }

  // A link to another file, or one by name, is none: nothing beyond the file is opened.
  bool has(hid_t parent, const std::string& name) const {
    H5L_info_t link{};
    return H5Lexists(parent, name.c_str(), H5P_DEFAULT) > 0 && H5Lget_info(parent, name.c_str(), &link, H5P_DEFAULT) >= 0 &&
           link.type == H5L_TYPE_HARD && H5Oexists_by_name(parent, name.c_str(), H5P_DEFAULT) > 0;
  }

  Id group(hid_t parent, const std::string& name, const std::string& path) const {
    if (!has(parent, name)) fail(fmt::format("group '{}'", path), "is missing");
    Id group(H5Gopen2(parent, name.c_str(), H5P_DEFAULT), H5Gclose);
    if (!group.valid()) fail(fmt::format("group '{}'", path), "is no group, or damaged");
    return group;
  }

  std::vector<std::string> group_names(hid_t parent, const std::string& path) const {
    struct Found {
      std::vector<std::string> names;
      bool too_many = false;
    } found;
    const herr_t status = H5Literate(
        parent, H5_INDEX_NAME, H5_ITER_INC, nullptr,
        [](hid_t, const char* name, const H5L_info_t*, void* out) -> herr_t {
          auto& list = *static_cast<Found*>(out);
          if (list.names.size() >= 1'000'000) {
            list.too_many = true;
            return 1;
          }
          list.names.emplace_back(name);
          return 0;
        },
        &found);
    if (status < 0 || found.too_many) fail(fmt::format("group '{}'", path), "cannot be listed (damaged?)");
    return std::move(found.names);
  }

  // Strings of fixed length.
  std::vector<std::string> texts_of(hid_t id, const Id& type, const Id& space, bool attribute, const std::string& object) const {
    if (!type.valid() || !space.valid() || H5Tget_class(type) != H5T_STRING) fail(object, "must be text");
    if (H5Tis_variable_str(type) != 0) fail(object, "must be text of fixed length");
    const hssize_t count = H5Sget_simple_extent_npoints(space);
    if (count < 0 || count > 1'000'000) fail(object, "has too many entries");
    std::vector<std::string> texts;
    if (count == 0) return texts;
    Id memory(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_cset(memory, H5Tget_cset(type));
    const std::size_t length = H5Tget_size(type);
    if (length == 0 || length > longest_string || length * static_cast<std::size_t>(count) > 16 * longest_string)
      fail(object, "has strings that are too long");
    H5Tset_size(memory, length);
    H5Tset_strpad(memory, H5Tget_strpad(type));
    std::string packed(length * static_cast<std::size_t>(count), '\0');
    const herr_t status =
        attribute ? H5Aread(id, memory, packed.data()) : H5Dread(id, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, packed.data());
    if (status < 0) fail(object, "cannot be read (damaged?): " + hdf5_reason());
    const bool blanks = H5Tget_strpad(type) == H5T_STR_SPACEPAD;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      std::string text = packed.substr(i * length, length);
      text.resize(std::min(text.find('\0'), text.size()));
      while (blanks && !text.empty() && text.back() == ' ') text.pop_back();
      texts.push_back(std::move(text));
    }
    return texts;
  }

  std::string text(hid_t object, const std::string& name, const std::string& path, std::optional<std::string> otherwise) const {
    const std::string label = fmt::format("attribute '{}' of '{}'", name, path);
    if (H5Aexists(object, name.c_str()) <= 0) {
      if (otherwise) return *otherwise;
      fail(label, "is missing");
    }
    const Id attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose);
    if (!attribute.valid()) fail(label, "cannot be read (damaged?)");
    const auto found = texts_of(attribute, Id(H5Aget_type(attribute), H5Tclose), Id(H5Aget_space(attribute), H5Sclose), true, label);
    if (found.size() != 1) fail(label, "must be one string");
    return found[0];
  }

  double number(hid_t object, const std::string& name, const std::string& path, std::optional<double> otherwise) const {
    const std::string label = fmt::format("attribute '{}' of '{}'", name, path);
    if (H5Aexists(object, name.c_str()) <= 0) {
      if (otherwise) return *otherwise;
      fail(label, "is missing");
    }
    const Id attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose);
    if (!attribute.valid()) fail(label, "cannot be read (damaged?)");
    const Id type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
    if (!plain_number(type) || H5Sget_simple_extent_npoints(space) != 1) fail(label, "must be one number");
    double value = 0.0;
    if (H5Aread(attribute, H5T_NATIVE_DOUBLE, &value) < 0) fail(label, "cannot be read (damaged?)");
    if (!std::isfinite(value)) fail(label, "is not finite");
    return value;
  }

  long count(hid_t object, const std::string& name, const std::string& path) const {
    const double value = number(object, name, path, 0.0);
    return std::abs(value) < 9e18 ? static_cast<long>(value) : 0;
  }

  // HDF5 converts what a type's bits are said to mean without checking that they lie in the number: only the usual types are let through.
  static bool plain_number(hid_t type) {
    const hid_t usual[] = {H5T_IEEE_F64LE, H5T_IEEE_F32LE, H5T_IEEE_F64BE, H5T_IEEE_F32BE, H5T_STD_I64LE, H5T_STD_I32LE, H5T_STD_I16LE,
                           H5T_STD_I8LE,   H5T_STD_U64LE,  H5T_STD_U32LE,  H5T_STD_U16LE,  H5T_STD_U8LE,  H5T_STD_I64BE, H5T_STD_I32BE,
                           H5T_STD_I16BE,  H5T_STD_I8BE,   H5T_STD_U64BE,  H5T_STD_U32BE,  H5T_STD_U16BE, H5T_STD_U8BE};
    return type >= 0 && std::any_of(std::begin(usual), std::end(usual), [&](hid_t known) { return H5Tequal(type, known) > 0; });
  }

  // A dataset whose values lie in this file, plain or packed by the filters that HDF5 always has.
  Id dataset(hid_t parent, const std::string& name, const std::string& label) const {
    Id set(H5Dopen2(parent, name.c_str(), H5P_DEFAULT), H5Dclose);
    if (!set.valid()) fail(label, "is no dataset, or damaged");
    const Id creation(H5Dget_create_plist(set), H5Pclose);
    if (!creation.valid()) fail(label, "cannot be read (damaged?): " + hdf5_reason());
    if (H5Pget_external_count(creation) != 0 || H5Pget_layout(creation) == H5D_VIRTUAL)
      fail(label, "lies in another file, which is not read");
    const int filters = H5Pget_nfilters(creation);
    for (int i = 0; i < filters; ++i) {
      unsigned flags = 0, config = 0;
      std::size_t values = 0;
      const H5Z_filter_t filter = H5Pget_filter2(creation, static_cast<unsigned>(i), &flags, &values, nullptr, 0, nullptr, &config);
      if (filter != H5Z_FILTER_DEFLATE && filter != H5Z_FILTER_SHUFFLE && filter != H5Z_FILTER_FLETCHER32)
        fail(label, fmt::format("is packed by HDF5's filter {}; only deflate, shuffle and fletcher32 are read", filter));
    }
    return set;
  }

  std::vector<std::string> texts(hid_t parent, const std::string& name, const std::string& path) const {
    const std::string label = fmt::format("dataset '{}{}'", path, name);
    if (!has(parent, name)) return {};
    const Id set = dataset(parent, name, label);
    return texts_of(set, Id(H5Dget_type(set), H5Tclose), Id(H5Dget_space(set), H5Sclose), false, label);
  }

  static constexpr hsize_t any = std::numeric_limits<hsize_t>::max();

  // A dataset of numbers as rows x (product of the other dimensions). `shape`: the expected one, `any` where free; `dims` tells the
  // found one.
  MatX numbers(hid_t parent, const std::string& name, const std::string& path, const std::vector<hsize_t>& shape, bool optional,
               std::vector<hsize_t>* dims_out = nullptr) const {
    const std::string label = fmt::format("dataset '{}{}'", path, name);
    if (!has(parent, name)) {
      if (optional) return {};
      fail(label, "is missing");
    }
    const Id set = dataset(parent, name, label);
    const Id type(H5Dget_type(set), H5Tclose), space(H5Dget_space(set), H5Sclose);
    if (!plain_number(type)) fail(label, "must hold numbers (of 32 or 64 bits, or whole)");

    // shape
    const int rank = H5Sget_simple_extent_ndims(space);
    if (rank < 0 || rank > H5S_MAX_RANK) fail(label, "has no shape (damaged?)");
    std::vector<hsize_t> dims(rank);
    if (rank > 0) H5Sget_simple_extent_dims(space, dims.data(), nullptr);
    bool same = dims.size() == shape.size();
    for (std::size_t i = 0; same && i < dims.size(); ++i) same = shape[i] == any || shape[i] == dims[i];
    if (!same) fail(label, fmt::format("must be {}, found {}", shape_text(shape), shape_text(dims)));
    double values_held = 1.0;
    for (const hsize_t extent : dims) values_held *= static_cast<double>(extent);
    if (dims_out) *dims_out = dims;
    if (values_held == 0.0) return {};
    // a few bytes may claim any shape; even deflate packs no more than a thousand to one
    if (values_held * sizeof(double) > 1100.0 * 8.0 * static_cast<double>(H5Dget_storage_size(set)))
      fail(label, fmt::format("claims {:.3g} values but holds {} bytes", values_held, H5Dget_storage_size(set)));

    // blocks of rows, turned to column-major
    hsize_t cols = 1;
    for (std::size_t i = 1; i < dims.size(); ++i) cols *= dims[i];
    MatX values(static_cast<Eigen::Index>(dims[0]), static_cast<Eigen::Index>(cols));
    const hsize_t block = std::clamp<hsize_t>(4 * chunk_bytes / (cols * sizeof(double)), 1, dims[0]);
    RowMajor rows;
    for (hsize_t first = 0; first < dims[0]; first += block) {
      const hsize_t count = std::min(block, dims[0] - first);
      rows.resize(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(cols));
      std::vector<hsize_t> start(dims.size(), 0), extent = dims;
      start[0] = first;
      extent[0] = count;
      H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, extent.data(), nullptr);
      const Id memory(H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr), H5Sclose);
      if (H5Dread(set, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, rows.data()) < 0)
        fail(label, "cannot be read (damaged or cut short?): " + hdf5_reason());
      if (!rows.allFinite()) {
        for (Eigen::Index i = 0; i < rows.rows(); ++i)
          if (!rows.row(i).allFinite())
            fail(label, fmt::format("holds a value that is not finite in row {}", first + static_cast<hsize_t>(i)));
      }
      values.middleRows(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(count)) = rows;
    }
    return values;
  }

  static std::string shape_text(const std::vector<hsize_t>& shape) {
    std::string text;
    for (const hsize_t extent : shape) text += (text.empty() ? "" : " x ") + (extent == any ? std::string("n") : fmt::format("{}", extent));
    return text.empty() ? "one number" : text;
  }

 private:
  // Whether the file's bytes contain the head of a global heap's collection: "GCOL", version 1, three bytes of any value, its size.
  static bool holds_global_heap(std::ifstream& file) {
    constexpr std::string_view mark("GCOL\1", 5);
    constexpr std::size_t head = 16;
    file.seekg(0, std::ios::end);
    const auto length = static_cast<std::uint64_t>(std::max<std::streamoff>(file.tellg(), 0));
    file.seekg(0);
    std::string block(std::min<std::size_t>(length + head, 1u << 20), '\0');
    std::size_t kept = 0;
    while (file) {
      file.read(block.data() + kept, static_cast<std::streamsize>(block.size() - kept));
      const std::string_view bytes(block.data(), kept + static_cast<std::size_t>(file.gcount()));
      for (std::size_t at = bytes.find(mark); at != std::string_view::npos && at + head <= bytes.size(); at = bytes.find(mark, at + 1)) {
        std::uint64_t size = 0;
        for (std::size_t k = 8; k-- > 0;) size = size << 8 | static_cast<unsigned char>(bytes[at + 8 + k]);
        // By chance alone: once in 2^70 bytes.
        if (size <= length) return true;
      }
      kept = std::min(bytes.size(), head - 1);
      std::memmove(block.data(), bytes.data() + bytes.size() - kept, kept);
    }
    return false;
  }

  std::string name_;
};

void check_quaternions(const Reader& reader, const Eigen::MatrixX4d& q, const std::string& path) {
  // single precision and integration drift are fine, anything else is no quaternion
  for (Eigen::Index i = 0; i < q.rows(); ++i)
    if (std::abs(q.row(i).norm() - 1.0) > 1e-4)
      reader.fail(fmt::format("dataset '{}orientation'", path),
                  fmt::format("row {} is no unit quaternion, its norm is {:.6g}", i, q.row(i).norm()));
}

Section read_section(const Reader& reader, hid_t body, const std::string& path) {
  const Id group = reader.group(body, "section", path + "section");
  Section section;
  section.shape = reader.text(group, "shape", path + "section", std::nullopt);
  const std::pair<const char*, double*> numbers[] = {{"area", &section.area},      {"iy", &section.iy}, {"iz", &section.iz},
                                                     {"iyz", &section.iyz},        {"j", &section.j},   {"shear_y", &section.shear_y},
                                                     {"shear_z", &section.shear_z}};
  for (const auto& [name, number] : numbers) *number = reader.number(group, name, path + "section", 0.0);
  if (reader.has(group, "sizes")) {
    const Id sizes = reader.group(group, "sizes", path + "section/sizes");
    std::vector<std::string> names;
    H5Aiterate2(
        sizes, H5_INDEX_NAME, H5_ITER_INC, nullptr,
        [](hid_t, const char* name, const H5A_info_t*, void* out) -> herr_t {
          static_cast<std::vector<std::string>*>(out)->emplace_back(name);
          return 0;
        },
        &names);
    for (const std::string& name : names) section.size[name] = reader.number(sizes, name, path + "section/sizes", std::nullopt);
  }
  for (int i = 0; reader.has(group, fmt::format("outline_{}", i)); ++i) {
    const MatX points = reader.numbers(group, fmt::format("outline_{}", i), path + "section/", {Reader::any, 2}, false);
    std::vector<Eigen::Vector2d> loop;
    loop.reserve(points.rows());
    for (Eigen::Index k = 0; k < points.rows(); ++k) loop.emplace_back(points.row(k).transpose());
    if (loop.size() < 3) reader.fail(fmt::format("dataset '{}section/outline_{}'", path, i), "must have at least 3 points");
    section.outline.push_back(std::move(loop));
  }
  return section;
}

ResultBody read_body(const Reader& reader, hid_t group, const std::string& name, hsize_t nt) {
  const std::string path = "/bodies/" + name + "/";
  ResultBody body;
  body.name = name;
  body.kind = reader.text(group, "kind", path, "rigid");
  body.length = reader.number(group, "length", path, 0.0);
  body.mesh = reader.text(group, "mesh", path, "");
  body.mesh_sha256 = reader.text(group, "mesh_sha256", path, "");
  if (reader.has(group, "section")) body.section = read_section(reader, group, path);
  body.position = reader.numbers(group, "position", path, {nt, 3}, false);
  body.orientation = reader.numbers(group, "orientation", path, {nt, 4}, false);
  check_quaternions(reader, body.orientation, path);

  const MatX origins = reader.numbers(group, "node_origin", path, {Reader::any, 3}, true);
  const auto nn = static_cast<hsize_t>(origins.rows());
  std::vector<std::string> names = reader.texts(group, "node_names", path);
  if (!names.empty() && names.size() != nn)
    reader.fail(fmt::format("dataset '{}node_names'", path),
                fmt::format("must name {} nodes like 'node_origin', found {}", nn, names.size()));
  for (hsize_t i = 0; i < nn; ++i)
    body.nodes.push_back({names.empty() ? fmt::format("node[{}]", i) : names[i], origins.row(static_cast<Eigen::Index>(i)).transpose()});
  if (nn > 0) {
    body.displacement = reader.numbers(group, "displacement", path, {nt, nn, 3}, false);
    body.rotation = reader.numbers(group, "rotation", path, {nt, nn, 3}, true);
  }

  body.q = reader.numbers(group, "q", path, {nt, Reader::any}, true);
  const auto n = static_cast<hsize_t>(body.q.cols());
  body.qd = reader.numbers(group, "qd", path, {nt, n}, true);
  body.labels = reader.texts(group, "labels", path);
  if (!body.labels.empty() && body.labels.size() != n)
    reader.fail(fmt::format("dataset '{}labels'", path),
                fmt::format("must name {} elastic coordinates like 'q', found {}", n, body.labels.size()));
  body.node_phi = node_columns(reader.numbers(group, "node_phi", path, {nn, 3, n}, true));
  body.node_psi = node_columns(reader.numbers(group, "node_psi", path, {nn, 3, n}, true));
  if (reader.has(group, "strain_stations")) {
    body.strain_stations = reader.numbers(group, "strain_stations", path, {Reader::any}, false);
    body.section_strain = reader.numbers(group, "section_strain", path, {Reader::any, 3}, true);
    body.unstrained = reader.texts(group, "unstrained", path);
    for (Eigen::Index i = 1; i < body.strain_stations.size(); ++i)
      if (body.strain_stations[i] < body.strain_stations[i - 1])
        reader.fail(fmt::format("dataset '{}strain_stations'", path), "must ascend");
    const double rows = 4.0 * static_cast<double>(body.strain_stations.size());
    for (Eigen::Index i = 0; i < body.section_strain.rows(); ++i)
      if (const Vec3 e = body.section_strain.row(i); !(e[0] >= 0.0 && e[0] < rows && e[1] >= 0.0 && e[1] < static_cast<double>(n)))
        reader.fail(fmt::format("dataset '{}section_strain'", path), fmt::format("row {} names no station or coordinate", i + 1));
  }
  if (reader.has(group, "held_position")) {
    body.held_position = reader.numbers(group, "held_position", path, {nt, 3}, false);
    body.held_rotation = reader.numbers(group, "held_rotation", path, {nt, 3}, false);
    body.shown_columns = reader.numbers(group, "shown_columns", path, {6, n}, false);
  }
  const MatX places = reader.numbers(group, "stress_nodes", path, {Reader::any}, true);
  for (const double place : places.reshaped()) {
    if (!(place >= 0.0 && place < static_cast<double>(nn) && place == std::floor(place)))
      reader.fail(fmt::format("dataset '{}stress_nodes'", path), fmt::format("must hold indices of the {} nodes, found {}", nn, place));
    body.stress_nodes.push_back(static_cast<int>(place));
  }
  if (!body.stress_nodes.empty())
    body.node_stress = node_columns(reader.numbers(group, "node_stress", path, {body.stress_nodes.size(), 6, n}, false), 6);
  return body;
}

ResultJoint read_joint(const Reader& reader, hid_t group, const std::string& name, hsize_t nt) {
  const std::string path = "/joints/" + name + "/";
  ResultJoint joint;
  joint.name = name;
  joint.kind = reader.text(group, "kind", path, "");
  if (reader.has(group, "position")) joint.position = reader.numbers(group, "position", path, {nt, 3}, false);
  if (reader.has(group, "orientation")) joint.orientation = reader.numbers(group, "orientation", path, {nt, 4}, false);
  check_quaternions(reader, joint.orientation, path);
  joint.value = reader.numbers(group, "value", path, {nt, Reader::any}, true);
  joint.rate = reader.numbers(group, "rate", path, {nt, Reader::any}, true);
  return joint;
}

// The members of a group in the order of their attribute `index` (absent: by name).
template <class Item, class Read>
std::vector<Item> read_members(const Reader& reader, hid_t file, const std::string& name, bool required, Read&& read) {
  std::vector<Item> items;
  if (!required && !reader.has(file, name)) return items;
  const Id parent = reader.group(file, name, "/" + name);
  std::vector<std::pair<double, Item>> ordered;
  for (const std::string& member : reader.group_names(parent, "/" + name)) {
    const Id group = reader.group(parent, member, fmt::format("/{}/{}", name, member));
    ordered.emplace_back(reader.number(group, "index", fmt::format("/{}/{}", name, member), 0.0), read(group, member));
  }
  std::stable_sort(ordered.begin(), ordered.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (auto& entry : ordered) items.push_back(std::move(entry.second));
  return items;
}

}  // namespace

void write_results(const Results& results, const std::filesystem::path& path) {
  check_results(results);
  PendingFile pending(path);
  // at exit HDF5 would try again to write what a full disk refused; only its first call counts
  H5dont_atexit();
  const Quiet quiet;
  const auto fail = [&](const std::string& reason) { throw FileError(fmt::format("{}: cannot be written: {}", path.string(), reason)); };
  Id file;
  try {
    const Id access(done(H5Pcreate(H5P_FILE_ACCESS)), H5Pclose);
    check(H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110));
    check(H5Pset_fclose_degree(access, H5F_CLOSE_STRONG));
    file = Id(done(H5Fcreate(pending.path().c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access)), H5Fclose);
    write_all(file, results);
    check(H5Fflush(file, H5F_SCOPE_LOCAL));
  } catch (const WriteFailure& failure) {
    fail(failure.reason);
  }
  if (!file.reset()) fail(hdf5_reason());
  pending.commit();
}

Results read_results(const std::filesystem::path& path) {
  H5dont_atexit();
  const Quiet quiet;
  const Reader reader(path);
  const Id file = reader.open_file();
  if (H5Aexists(file, "format") <= 0 || reader.text(file, "format", "/", "") != format_name)
    throw InputError(
        fmt::format("{}: is an HDF5 file, but no results file: the attribute 'format' must be \"{}\"", path.string(), format_name));
  const double version = reader.number(file, "format_version", "/", std::nullopt);
  if (version != format_version)
    throw InputError(fmt::format("{}: has the format version {}; this program reads version {}", path.string(), version, format_version));

  Results results;
  results.title = reader.text(file, "title", "/", "");
  results.scene_file = reader.text(file, "scene_file", "/", "");
  // Given relative to a folder that is not this one: from that folder.
  namespace fs = std::filesystem;
  const fs::path folder = reader.text(file, "scene_folder", "/", ""), scene = results.scene_file;
  if (!scene.empty() && scene.is_relative() && fs::is_directory(folder) && fs::absolute(scene).lexically_normal().parent_path() != folder)
    results.scene_file = (folder / scene.filename()).string();
  const std::vector<std::string> text = reader.texts(file, "scene", "/");
  if (text.size() > 1) reader.fail("dataset '/scene'", "must be one string");
  if (!text.empty()) results.scene_text = text[0];
  const std::string hash = reader.text(file, "scene_sha256", "/", "");
  if (!hash.empty() && hash != sha256(results.scene_text))
    reader.fail("dataset '/scene'", "does not agree with its checksum 'scene_sha256' (damaged or changed)");

  results.times = reader.numbers(file, "times", "/", {Reader::any}, false).reshaped();
  const auto nt = static_cast<hsize_t>(results.times.size());
  if (nt == 0) reader.fail("dataset '/times'", "is empty");
  if (nt > most_times) reader.fail("dataset '/times'", fmt::format("has {} values; at most {} are allowed", nt, most_times));
  for (Eigen::Index i = 1; i < results.times.size(); ++i)
    if (!(results.times[i] > results.times[i - 1]))
      reader.fail("dataset '/times'", fmt::format("must increase, but value {} is {} after {}", i, results.times[i], results.times[i - 1]));

  results.bodies = read_members<ResultBody>(reader, file, "bodies", true,
                                            [&](hid_t group, const std::string& name) { return read_body(reader, group, name, nt); });
  for (ResultBody& body : results.bodies)
    if (!body.mesh.empty() && std::filesystem::path(body.mesh).is_relative())
      body.mesh = (std::filesystem::absolute(path).parent_path() / body.mesh).lexically_normal().string();
  results.joints = read_members<ResultJoint>(reader, file, "joints", false,
                                             [&](hid_t group, const std::string& name) { return read_joint(reader, group, name, nt); });

  if (reader.has(file, "outputs")) {
    const Id outputs = reader.group(file, "outputs", "/outputs");
    const std::vector<std::string> columns = reader.texts(outputs, "columns", "/outputs/");
    const std::vector<std::string> units = reader.texts(outputs, "units", "/outputs/");
    const MatX values = reader.numbers(outputs, "values", "/outputs/", {nt, columns.size()}, columns.empty());
    if (!units.empty() && units.size() != columns.size())
      reader.fail("dataset '/outputs/units'", fmt::format("must have {} entries like 'columns', found {}", columns.size(), units.size()));
    std::vector<std::string> descriptions(columns.size());
    if (reader.has(outputs, "descriptions")) descriptions = reader.texts(outputs, "descriptions", "/outputs/");
    if (descriptions.size() != columns.size())
      reader.fail("dataset '/outputs/descriptions'",
                  fmt::format("must have {} entries like 'columns', found {}", columns.size(), descriptions.size()));
    for (std::size_t i = 0; i < columns.size(); ++i)
      results.outputs.push_back(
          {columns[i], units.empty() ? "" : units[i], values.col(static_cast<Eigen::Index>(i)), std::move(descriptions[i])});
  }

  if (reader.has(file, "energy")) {
    const Id energy = reader.group(file, "energy", "/energy");
    const std::pair<const char*, VecX*> energies[] = {{"kinetic", &results.kinetic},
                                                      {"strain", &results.strain},
                                                      {"potential", &results.potential},
                                                      {"supplied", &results.supplied},
                                                      {"dissipated", &results.dissipated}};
    for (const auto& [name, values] : energies) *values = reader.numbers(energy, name, "/energy/", {nt}, true).reshaped();
  }

  if (reader.has(file, "statistics")) {
    const Id group = reader.group(file, "statistics", "/statistics");
    SolverStatistics& s = results.statistics;
    s.method = reader.text(group, "method", "/statistics", "");
    s.tolerance = reader.number(group, "tolerance", "/statistics", 0.0);
    const std::pair<const char*, long*> counts[] = {{"steps", &s.steps},
                                                    {"evaluations", &s.evaluations},
                                                    {"jacobians", &s.jacobians},
                                                    {"events", &s.events},
                                                    {"restarts", &s.restarts}};
    for (const auto& [name, count] : counts) *count = reader.count(group, name, "/statistics");
    s.cpu_seconds = reader.number(group, "cpu_seconds", "/statistics", 0.0);
    s.error_estimate = reader.number(group, "error_estimate", "/statistics", -1.0);
    s.error_column = reader.text(group, "error_column", "/statistics", "");
    s.notes.warn(reader.texts(group, "warnings", "/statistics/"));
    s.notes.tell(reader.texts(group, "notes", "/statistics/"));
  }
  return results;
}

}  // namespace flexframe::sim
