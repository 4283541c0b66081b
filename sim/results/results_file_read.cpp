// A file of the layout of sim/RESULTS.md to results.
#include "sim/base/file_output.h"
#include "sim/base/hdf5_reader.h"
#include "sim/base/words.h"
#include "sim/results/results_file.h"
#include "sim/results/results_format.h"

#include <cmath>

namespace flexframe::sim {

using namespace hdf5;

namespace {

constexpr hsize_t most_times = 100'000'000;

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
  const std::pair<const char*, double*> numbers[] = {
      {"area", &section.area}, {"iy", &section.iy},           {"iz", &section.iz},           {"iyz", &section.iyz},
      {"j", &section.j},       {"shear_y", &section.shear_y}, {"shear_z", &section.shear_z}, {"shear_yz", &section.shear_yz}};
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

// Whole numbers from 0 to below `count`.
void check_indices(const Reader& reader, const MatX& values, hsize_t count, const std::string& dataset, const char* what) {
  for (const double v : values.reshaped())
    if (!(v >= 0.0 && v < static_cast<double>(count) && v == std::floor(v)))
      reader.fail(fmt::format("dataset '{}'", dataset), fmt::format("must hold indices of the {} {}, found {}", count, what, v));
}

ResultSurface read_surface(const Reader& reader, hid_t body, const std::string& body_path, hsize_t nn) {
  const std::string path = body_path + "surface/";
  const Id group = reader.group(body, "surface", body_path + "surface");
  ResultSurface surface;
  surface.points = reader.numbers(group, "points", path, {Reader::any, 3}, false);
  const auto m = static_cast<hsize_t>(surface.points.rows());
  const MatX triangles = reader.numbers(group, "triangles", path, {Reader::any, 3}, false);
  check_indices(reader, triangles, m, path + "triangles", "points");
  if (triangles.rows() == 0) reader.fail(fmt::format("dataset '{}triangles'", path), "is empty");
  surface.triangles = triangles.cast<int>();
  surface.colors = reader.numbers(group, "colors", path, {static_cast<hsize_t>(triangles.rows()), 3}, true);
  const MatX nodes = reader.numbers(group, "nodes", path, {m}, true);
  check_indices(reader, nodes, nn, path + "nodes", "nodes");
  for (const double node : nodes.reshaped()) surface.nodes.push_back(static_cast<int>(node));
  return surface;
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
    body.displacement = reader.rows(group, "displacement", path, {nt, nn, 3}, false);
    body.rotation = reader.rows(group, "rotation", path, {nt, nn, 3}, true);
  }

  body.node_shear = reader.numbers(group, "node_shear", path, {nn, 4}, true);
  body.node_von_mises = reader.numbers(group, "node_von_mises", path, {nt, nn}, true);
  if (reader.has(group, "surface")) body.surface = read_surface(reader, group, path, nn);
  const MatX color = reader.numbers(group, "color", path, {3}, true);
  for (const double part : color.reshaped()) {
    if (!(part >= 0.0 && part <= 1.0)) reader.fail(fmt::format("dataset '{}color'", path), "must hold three numbers from 0 to 1");
    body.color.push_back(part);
  }

  body.q = reader.rows(group, "q", path, {nt, Reader::any}, true);
  const auto n = static_cast<hsize_t>(body.q.cols());
  body.qd = reader.rows(group, "qd", path, {nt, n}, true);
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
    body.load_strain =
        reader.numbers(group, "load_strain", path, {nt, body.unstrained.size() * static_cast<hsize_t>(body.strain_stations.size())}, true);
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
  check_indices(reader, places, nn, path + "stress_nodes", "nodes");
  for (const double place : places.reshaped()) body.stress_nodes.push_back(static_cast<int>(place));
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
  // A place without its axes is no frame.
  if (reader.has(group, "position") || reader.has(group, "orientation"))
    joint.orientation = reader.numbers(group, "orientation", path, {nt, 4}, false);
  check_quaternions(reader, joint.orientation, path);
  joint.value = reader.numbers(group, "value", path, {nt, Reader::any}, true);
  joint.rate = reader.numbers(group, "rate", path, {nt, Reader::any}, true);
  return joint;
}

AccuracyStatement read_accuracy(const Reader& reader, hid_t group) {
  const std::string path = "/statistics/accuracy";
  AccuracyStatement a;
  const std::pair<const char*, double*> numbers[] = {{"asked", &a.asked},         {"time", &a.time},
                                                     {"space", &a.space},         {"effects", &a.effects},
                                                     {"half_cost", &a.half_cost}, {"search_cpu_seconds", &a.search_cpu}};
  for (const auto& [name, number] : numbers) *number = reader.number(group, name, path, 0.0);
  a.column = reader.text(group, "column", path, "");
  a.chosen = reader.texts(group, "chosen", path + "/");
  if (!reader.has(group, "picture")) return a;
  const Id picture = reader.group(group, "picture", path + "/picture");
  PictureShares p;
  p.asked = reader.text(picture, "asked", path + "/picture", "");
  p.unit = reader.text(picture, "unit", path + "/picture", "px");
  const std::pair<const char*, double*> shares[] = {{"allowed", &p.allowed}, {"total", &p.total},     {"time", &p.time},
                                                    {"space", &p.space},     {"effects", &p.effects}, {"map", &p.map},
                                                    {"samples", &p.samples}, {"raster", &p.raster}};
  for (const auto& [name, share] : shares) *share = reader.number(picture, name, path + "/picture", 0.0);
  p.body = reader.text(picture, "body", path + "/picture", "");
  p.doubt = reader.text(picture, "doubt", path + "/picture", "");
  a.picture = p;
  return a;
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

Results read_results(const std::filesystem::path& path) {
  H5dont_atexit();
  const Quiet quiet;
  const Reader reader(path, "a results file");
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
    if (reader.has(group, "accuracy")) s.accuracy = read_accuracy(reader, reader.group(group, "accuracy", "/statistics/accuracy"));
    s.notes.warn(reader.texts(group, "warnings", "/statistics/"));
    s.notes.tell(reader.texts(group, "notes", "/statistics/"));
  }
  return results;
}

}  // namespace flexframe::sim
