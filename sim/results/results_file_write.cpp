// Results to a file of the layout of sim/RESULTS.md.
#include "sim/base/file_output.h"
#include "sim/base/hdf5_file.h"
#include "sim/base/words.h"
#include "sim/results/results_file.h"
#include "sim/results/results_format.h"

#include <fmt/format.h>

namespace flexframe::sim {

using namespace hdf5;

namespace {

void write_section(hid_t body, const Section& section) {
  const Id group = make_group(body, "section");
  write_attribute(group, "shape", section.shape);
  const std::pair<const char*, double> numbers[] = {
      {"area", section.area}, {"iy", section.iy},           {"iz", section.iz},           {"iyz", section.iyz},
      {"j", section.j},       {"shear_y", section.shear_y}, {"shear_z", section.shear_z}, {"shear_yz", section.shear_yz}};
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

void write_surface(hid_t body, const ResultSurface& surface) {
  const Id group = make_group(body, "surface");
  const auto points = static_cast<hsize_t>(surface.points.rows()), triangles = static_cast<hsize_t>(surface.triangles.rows());
  write_numbers(group, "points", surface.points, {points, 3}, "m", "corners of the surface in the body frame");
  write_numbers(group, "triangles", surface.triangles.cast<double>(), {triangles, 3}, "",
                "points of each triangle, counted from 0, counterclockwise seen from outside");
  write_numbers(group, "colors", surface.colors, {triangles, 3}, "", "of the triangles, sRGB 0..1");
  const VecX nodes = Eigen::Map<const Eigen::VectorXi>(surface.nodes.data(), std::ssize(surface.nodes)).cast<double>();
  write_numbers(group, "nodes", nodes, {points}, "", "node that each point is, counted from 0");
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
  if (body.surface.triangles.rows() > 0) write_surface(group, body.surface);
  if (!body.color.empty())
    write_numbers(group, "color", Eigen::Map<const VecX>(body.color.data(), 3), {3}, "", "sRGB 0..1, where the scene gives none");
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
  write_rows(group, "displacement", body.displacement, {nt, nn, 3}, "m", "of the nodes from their undeformed position, in the body frame");
  write_rows(group, "rotation", body.rotation, {nt, nn, 3}, "rad",
             "rotation vector of the nodes from their undeformed orientation, in the body frame");

  write_numbers(group, "node_shear", body.node_shear, {nn, 4}, "m^2", "of a beam that shears: (k G A)^-1 E I as yy yz zy zz");

  const auto n = static_cast<hsize_t>(body.q.cols());
  write_rows(group, "q", body.q, {nt, n}, "", "elastic coordinates");
  write_rows(group, "qd", body.qd, {nt, n}, "", "elastic rates");
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
  write_numbers(group, "load_strain", body.load_strain, {nt, static_cast<hsize_t>(body.load_strain.cols())}, "",
                "strains at the stations by what is carried without deformation, of each of 'unstrained'");
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
  write_numbers(group, "node_von_mises", body.node_von_mises, {nt, nn}, "Pa", "von Mises stress at the nodes");
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

void write_accuracy(hid_t statistics, const AccuracyStatement& a) {
  const Id group = make_group(statistics, "accuracy");
  write_attribute(group, "asked", a.asked);
  write_attribute(group, "time", a.time);
  write_attribute(group, "space", a.space);
  write_attribute(group, "effects", a.effects);
  write_attribute(group, "column", a.column);
  write_attribute(group, "half_cost", a.half_cost);
  write_attribute(group, "search_cpu_seconds", a.search_cpu);
  write_texts(group, "chosen", a.chosen);
  if (!a.picture) return;
  const PictureShares& p = *a.picture;
  const Id picture = make_group(group, "picture");
  write_attribute(picture, "asked", p.asked);
  write_attribute(picture, "unit", p.unit);
  const std::pair<const char*, double> shares[] = {{"allowed", p.allowed}, {"total", p.total},     {"time", p.time},
                                                   {"space", p.space},     {"effects", p.effects}, {"map", p.map},
                                                   {"samples", p.samples}, {"raster", p.raster}};
  for (const auto& [name, share] : shares) write_attribute(picture, name, share);
  write_attribute(picture, "body", p.body);
  write_attribute(picture, "doubt", p.doubt);
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
  if (values.size() > 0) {
    write_attribute(outputs, "values", "columns", columns);
    write_attribute(outputs, "values", "units", units);
    if (described) write_attribute(outputs, "values", "descriptions", descriptions);
  }

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
  if (s.accuracy) write_accuracy(statistics, *s.accuracy);
  write_texts(statistics, "notes", s.notes.texts(Severity::note));
  write_texts(statistics, "warnings", s.notes.texts(Severity::warning));
}

template <class Fail>
void check_surface(const ResultBody& body, const Fail& fail) {
  const ResultSurface& s = body.surface;
  const auto m = s.points.rows(), k = s.triangles.rows();
  const auto nn = std::ssize(body.nodes);
  const bool whole = s.points.allFinite() && (k == 0 || (s.triangles.minCoeff() >= 0 && s.triangles.maxCoeff() < m)) &&
                     (s.colors.rows() == 0 || (s.colors.rows() == k && s.colors.allFinite()));
  if (!whole) fail(fmt::format("{}: its surface of {} points and {} triangles contradicts itself", body.name, m, k));
  if (!s.nodes.empty() && std::ssize(s.nodes) != m) fail(fmt::format("{}: its surface names a node for some points only", body.name));
  for (const int node : s.nodes)
    if (node < 0 || node >= nn) fail(fmt::format("{}: its surface names node {} of {}", body.name, node, nn));
  if (!body.color.empty() && body.color.size() != 3) fail(fmt::format("{}: a colour has three numbers", body.name));
}

// Sizes and numbers of results, before a file is begun.
void check_results(const Results& results) {
  const auto fail = [](const std::string& message) { throw SimulationError("the results cannot be written: " + message); };
  const Eigen::Index nt = results.times.size();
  if (nt == 0) fail("they hold no times");
  const auto series = [&](const std::string& what, const auto& values, Eigen::Index cols, bool optional) {
    if (values.size() == 0 && (optional || cols == 0)) return;
    if (values.rows() != nt || values.cols() != cols)
      fail(fmt::format("{} is {} x {}, not {} x {}", what, values.rows(), values.cols(), nt, cols));
    // x - x is no number where x is none.
    if (!((values.array() - values.array()).sum() == 0.0)) fail(fmt::format("{} holds a value that is not finite", what));
  };
  const auto name = [&](const char* what, const std::string& text) {
    if (text.empty() || text == "." || text.find('/') != std::string::npos || text.find('\0') != std::string::npos)
      fail(fmt::format("{} is no name of a {}", quote(text), what));
  };
  series("times", results.times, 1, false);
  for (Eigen::Index i = 1; i < nt; ++i)
    if (!(results.times[i] > results.times[i - 1]))
      fail(fmt::format("times must rise, but number {} is {:g} after {:g}", i, results.times[i], results.times[i - 1]));
  const auto turns = [&](const std::string& what, const Eigen::MatrixX4d& q) {
    for (Eigen::Index i = 0; i < q.rows(); ++i)
      if (!(std::abs(q.row(i).norm() - 1.0) <= 1e-4))
        fail(fmt::format("{}: row {} of the orientation is no unit quaternion, its norm is {:g}", what, i, q.row(i).norm()));
  };
  for (const ResultBody& body : results.bodies) {
    name("body", body.name);
    const auto nn = static_cast<Eigen::Index>(body.nodes.size());
    series(body.name + ": position", body.position, 3, false);
    series(body.name + ": orientation", body.orientation, 4, false);
    turns(body.name, body.orientation);
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
    series(body.name + ": load_strain", body.load_strain, body.strain_stations.size() * std::ssize(body.unstrained), true);
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
    series(body.name + ": node_von_mises", body.node_von_mises, nn, true);
    check_surface(body, fail);
    for (int i : body.stress_nodes)
      if (i < 0 || i >= nn) fail(fmt::format("{}: node {} with stress is not there", body.name, i));
  }
  for (const ResultJoint& joint : results.joints) {
    name("joint", joint.name);
    series(joint.name + ": position", joint.position, 3, true);
    series(joint.name + ": orientation", joint.orientation, 4, true);
    turns(joint.name, joint.orientation);
    series(joint.name + ": value", joint.value, joint.value.cols(), true);
    series(joint.name + ": rate", joint.rate, joint.rate.cols(), true);
  }
  for (const ResultOutput& output : results.outputs) series("output " + output.column, output.values, 1, false);
  for (const VecX* energy : {&results.kinetic, &results.strain, &results.potential, &results.supplied, &results.dissipated})
    series("energy", *energy, 1, true);
}

}  // namespace

void write_results(const Results& results, const std::filesystem::path& path) {
  check_results(results);
  write_hdf5(path, [&](hid_t file) { write_all(file, results); });
}

}  // namespace flexframe::sim
