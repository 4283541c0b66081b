#include "sim/bodies/body_file.h"

#include "sim/base/error.h"
#include "sim/base/hdf5_file.h"
#include "sim/base/hdf5_reader.h"
#include "sim/bodies/sid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <span>

namespace flexframe::sim {

using namespace hdf5;

namespace {

constexpr const char* body_format = "flexframe body";
constexpr int body_version = 1;

// Blocks n x n, or none where all are empty: k x n n.
MatX stacked(std::span<const MatX> blocks, Eigen::Index n) {
  if (std::all_of(blocks.begin(), blocks.end(), [](const MatX& m) { return m.size() == 0; })) return {};
  MatX rows = MatX::Zero(static_cast<Eigen::Index>(blocks.size()), n * n);
  for (size_t a = 0; a < blocks.size(); ++a)
    if (blocks[a].size() > 0) rows.row(static_cast<Eigen::Index>(a)) = MatX(blocks[a].transpose()).reshaped().transpose();
  return rows;
}

// Back; a block of zeros is none.
void unstack(const Eigen::Ref<const MatX>& rows, Eigen::Index n, std::span<MatX> blocks) {
  for (size_t a = 0; a < blocks.size() && rows.size() > 0; ++a) {
    const VecX row = rows.row(static_cast<Eigen::Index>(a)).transpose();
    if (!row.isZero(0.0)) blocks[a] = row.reshaped(n, n).transpose();
  }
}

void check_body(const BodyFile& file, const std::string& path) {
  const FlexibleBody& b = file.body;
  const auto fail = [&](const std::string& what) { throw InputError(fmt::format("{}: cannot be written: {}", path, what)); };
  const auto matrix = [&](const char* name, const Eigen::Ref<const MatX>& m, Eigen::Index rows, Eigen::Index cols) {
    if (m.size() == 0) return;
    if (m.rows() != rows || m.cols() != cols) fail(fmt::format("'{}' is {} x {}, {} x {} is needed", name, m.rows(), m.cols(), rows, cols));
    if (!m.allFinite()) fail(fmt::format("'{}' holds a value that is not finite", name));
  };
  const Eigen::Index n = b.n, m = file.surface.points.rows();
  if (b.axis.root_mass.size() > 0 || b.rod) fail("mass along an axis has no place in a body file");
  if (!std::isfinite(b.mass)) fail("the mass is not finite");
  matrix("md0", b.md0, 3, 1);
  matrix("J0", b.J0, 6, 1);
  matrix("md1", b.md1, 3, n);
  matrix("J1", b.J1, 6, n);
  matrix("Cr0", b.Cr0, 3, n);
  for (const MatX& x : b.md2) matrix("md2", x, n, n);
  for (const MatX& x : b.J2) matrix("J2", x, n, n);
  for (const MatX& x : b.Cr1) matrix("Cr1", x, n, n);
  matrix("Me", b.Me, n, n);
  matrix("Ke", b.Ke, n, n);
  matrix("De", b.De, n, n);
  matrix("ksigma", b.ksigma, n, 1);
  for (const FlexibleNode& node : b.nodes) {
    matrix("phi", node.phi, 3, n);
    matrix("psi", node.psi, 3, n);
    matrix("sigma", node.sigma, 6, n);
    for (const MatX& x : node.phi2) matrix("phi2", x, n, n);
    for (const MatX& x : node.psi2) matrix("psi2", x, n, n);
    if (!node.origin.allFinite()) fail(fmt::format("the place of node '{}' is not finite", node.name));
  }
  if (file.further.count() > 0 && !is_sound(file.further, n, std::ssize(b.nodes))) fail("the further shapes do not fit the body");
  if (!file.surface.points.allFinite()) fail("a point of the surface is not finite");
  matrix("surface/phi", file.surface.phi, 3 * m, n);
  matrix("surface/stress", file.surface.stress, 6 * m, n);
  matrix("surface/load_stress", file.surface.load_stress, 6 * m, 12);
  const Eigen::Index others = 6 * std::ssize(file.surface.other_points);
  matrix("surface/other_stress", file.surface.other_stress, others, n);
  matrix("surface/other_load_stress", file.surface.other_load_stress, others, 12);
}

void write_matrices(hid_t file, const FlexibleBody& b) {
  const auto n = static_cast<hsize_t>(b.n);
  const auto blocks = [&](const char* name, std::span<const MatX> list, const char* unit, const char* meaning) {
    write_numbers(file, name, stacked(list, b.n), {list.size(), n, n}, unit, meaning);
  };
  write_numbers(file, "md0", b.md0, {3}, "kg m", "first moment of mass about the body frame's origin");
  write_numbers(file, "md1", b.md1, {3, n}, "kg m", "first moment per elastic coordinate");
  blocks("md2", b.md2, "kg m", "second derivatives of the first moment by two elastic coordinates");
  write_numbers(file, "J0", b.J0, {6}, "kg m^2", "inertia tensor xx yy zz xy xz yz about the origin");
  write_numbers(file, "J1", b.J1, {6, n}, "kg m^2", "inertia tensor per elastic coordinate");
  blocks("J2", b.J2, "kg m^2", "second derivatives of the inertia tensor by two elastic coordinates");
  write_numbers(file, "Cr0", b.Cr0, {3, n}, "kg m^2", "angular momentum per elastic rate");
  blocks("Cr1", b.Cr1, "kg m^2", "Cr(a, j) = Cr0(a, j) + sum over k of Cr1(a, j, k) q_k");
  write_numbers(file, "Me", b.Me, {n, n}, "", "mass of the elastic coordinates");
  write_numbers(file, "Ke", b.Ke, {n, n}, "", "their stiffness");
  write_numbers(file, "De", b.De, {n, n}, "", "their damping");
  write_numbers(file, "ksigma", b.ksigma, {n}, "", "generalised force of a pre-stress");
  write_texts(file, "labels", b.labels);
}

void write_nodes(hid_t file, const FlexibleBody& b) {
  const Id group = make_group(file, "nodes");
  const auto nn = static_cast<hsize_t>(b.nodes.size()), n = static_cast<hsize_t>(b.n);
  const auto rows = static_cast<Eigen::Index>(nn), cols = static_cast<Eigen::Index>(n);
  std::vector<std::string> names;
  MatX origin(rows, 3), axes(rows, 9), phi = MatX::Zero(rows, 3 * cols), psi = phi;
  std::vector<double> second_nodes, turned_nodes, stress_nodes;
  const auto any = [](const std::array<MatX, 3>& second) {
    return std::any_of(second.begin(), second.end(), [](const MatX& m) { return m.size() > 0; });
  };
  bool turned = false;
  for (Eigen::Index i = 0; i < rows; ++i) {
    const FlexibleNode& node = b.nodes[i];
    names.push_back(node.name);
    origin.row(i) = node.origin.transpose();
    axes.row(i) = Mat3(node.rotation.transpose()).reshaped().transpose();
    turned = turned || node.rotation != Mat3::Identity();
    for (Eigen::Index a = 0; a < 3; ++a) {
      if (node.phi.size() > 0) phi.row(i).segment(a * cols, cols) = node.phi.row(a);
      if (node.psi.size() > 0) psi.row(i).segment(a * cols, cols) = node.psi.row(a);
    }
    if (any(node.phi2)) second_nodes.push_back(static_cast<double>(i));
    if (any(node.psi2)) turned_nodes.push_back(static_cast<double>(i));
    if (node.sigma.size() > 0) stress_nodes.push_back(static_cast<double>(i));
  }
  write_texts(group, "names", names);
  write_numbers(group, "origin", origin, {nn, 3}, "m", "undeformed place in the body frame");
  if (turned) write_numbers(group, "axes", axes, {nn, 3, 3}, "", "undeformed axes of the node in the body frame, as columns");
  write_numbers(group, "phi", phi, {nn, 3, n}, "", "displacement per elastic coordinate");
  write_numbers(group, "psi", psi, {nn, 3, n}, "", "rotation per elastic coordinate");
  const auto indices = [&](const char* name, const std::vector<double>& list, const char* meaning) {
    write_numbers(group, name, Eigen::Map<const VecX>(list.data(), std::ssize(list)), {list.size()}, "", meaning);
  };
  const auto second = [&](const std::vector<double>& list, std::array<MatX, 3> FlexibleNode::*of) {
    MatX out(std::ssize(list), 3 * cols * cols);
    for (Eigen::Index k = 0; k < out.rows(); ++k)
      out.row(k) = MatX(stacked(b.nodes[static_cast<size_t>(list[static_cast<size_t>(k)])].*of, cols).transpose()).reshaped().transpose();
    return out;
  };
  if (!second_nodes.empty()) {
    indices("second_nodes", second_nodes, "nodes of 'phi2', from 0");
    write_numbers(group, "phi2", second(second_nodes, &FlexibleNode::phi2), {second_nodes.size(), 3, n, n}, "",
                  "second derivatives of the displacement by two elastic coordinates");
  }
  if (!turned_nodes.empty()) {
    indices("turned_nodes", turned_nodes, "nodes of 'psi2', from 0");
    write_numbers(group, "psi2", second(turned_nodes, &FlexibleNode::psi2), {turned_nodes.size(), 3, n, n}, "",
                  "second derivatives of the rotation vector by two elastic coordinates");
  }
  if (!stress_nodes.empty()) {
    MatX stress(std::ssize(stress_nodes), 6 * cols);
    for (Eigen::Index k = 0; k < stress.rows(); ++k)
      stress.row(k) = node_rows(b.nodes[static_cast<size_t>(stress_nodes[static_cast<size_t>(k)])].sigma, 6);
    indices("stress_nodes", stress_nodes, "nodes of 'stress', from 0");
    write_numbers(group, "stress", stress, {stress_nodes.size(), 6, n}, "Pa", "stress xx yy zz xy yz xz per elastic coordinate");
  }
}

void write_body_surface(hid_t file, const BodySurface& s, hsize_t n) {
  const Id group = make_group(file, "surface");
  const auto m = static_cast<hsize_t>(s.points.rows()), k = static_cast<hsize_t>(s.faces.rows());
  const VecX ids = Eigen::Map<const Eigen::VectorXi>(s.ids.data(), std::ssize(s.ids)).cast<double>();
  write_numbers(group, "ids", ids, {m}, "", "numbers of the nodes in the finite element model");
  write_numbers(group, "points", s.points, {m, 3}, "m", "places of the nodes in the body frame");
  write_numbers(group, "faces", s.faces.cast<double>(), {k, 8}, "",
                "points of each face from 0: corners, counterclockwise seen from outside, then the middles of its edges; -1: none");
  write_numbers(group, "phi", node_rows(s.phi), {m, 3, n}, "", "displacement per elastic coordinate");
  write_numbers(group, "stress", node_rows(s.stress, 6), {m, 6, n}, "Pa", "stress xx yy zz xy yz xz per elastic coordinate");
  if (s.load_stress.size() > 0)
    write_numbers(
        group, "load_stress", node_rows(s.load_stress, 6), {m, 6, 12}, "Pa",
        "static stress that the coordinates leave out, per m/s^2 of weight less acceleration (3), rad/s^2 of angular acceleration "
        "with the other sign (3), rad^2/s^2 of angular velocity: half of xx yy zz, xy xz yz (6)");
  if (s.other_points.empty()) return;
  const VecX others = Eigen::Map<const Eigen::VectorXi>(s.other_points.data(), std::ssize(s.other_points)).cast<double>();
  const auto o = static_cast<hsize_t>(others.size());
  write_numbers(group, "other_points", others, {o}, "", "points of 'other_stress', from 0");
  write_numbers(group, "other_stress", node_rows(s.other_stress, 6), {o, 6, n}, "Pa",
                "as 'stress': what is there besides, on a shell's other face and in other plates that meet there");
  if (s.other_load_stress.size() > 0)
    write_numbers(group, "other_load_stress", node_rows(s.other_load_stress, 6), {o, 6, 12}, "Pa", "as 'load_stress'");
}

void write_further(hid_t file, const FurtherShapes& s) {
  const Id group = make_group(file, "further");
  const auto m = static_cast<hsize_t>(s.count()), n = static_cast<hsize_t>(s.coupling.rows()),
             nodes = static_cast<hsize_t>(s.motion.rows() / 6);
  write_numbers(
      group, "stiffness", s.stiffness, {m}, "rad^2/s^2",
      "of shapes of the finite element model beyond the coordinates, by which it is judged what these leave out; their mass is 1");
  write_numbers(group, "coupling", s.coupling, {n, m}, "", "mass that the coordinates have in common with them");
  write_numbers(group, "md", s.md, {3, m}, "kg m", "first moment of mass per shape");
  write_numbers(group, "J", s.J, {6, m}, "kg m^2", "inertia tensor per shape");
  write_numbers(group, "Cr", s.Cr, {3, m}, "kg m^2", "angular momentum per rate of a shape");
  write_numbers(group, "motion", node_rows(s.motion, 6), {nodes, 6, m}, "", "displacement and rotation of each node per shape");
}

// nodes: of the body, where they are read.
FurtherShapes read_further(const Reader& reader, hid_t file, int coordinates, std::optional<size_t> nodes) {
  FurtherShapes s;
  if (!reader.has(file, "further")) return s;
  const std::string path = "/further/";
  const Id group = reader.group(file, "further", "/further");
  s.stiffness = reader.numbers(group, "stiffness", path, {Reader::any}, false).reshaped();
  const auto m = static_cast<hsize_t>(s.count()), n = static_cast<hsize_t>(coordinates);
  s.coupling = reader.numbers(group, "coupling", path, {n, m}, false);
  s.md = reader.numbers(group, "md", path, {3, m}, false);
  s.J = reader.numbers(group, "J", path, {6, m}, false);
  s.Cr = reader.numbers(group, "Cr", path, {3, m}, false);
  s.motion = node_columns(reader.numbers(group, "motion", path, {nodes.value_or(Reader::any), 6, m}, nodes == 0), 6);
  if (!is_sound(s, coordinates, s.motion.rows() / 6)) reader.fail("group '/further'", "must hold finite numbers and stiffnesses > 0");
  return s;
}

// The head of the file, and its number of coordinates.
int read_head(const Reader& reader, hid_t file, const std::string& path) {
  const std::string format = H5Aexists(file, "format") > 0 ? reader.text(file, "format", "/", "") : "";
  if (format != body_format)
    throw InputError(fmt::format("{}: is {}, not a flexible body: the attribute 'format' must be \"{}\"", path,
                                 format.empty() ? "an HDF5 file of another kind" : fmt::format("a file of '{}'", format), body_format));
  const double version = reader.number(file, "format_version", "/", std::nullopt);
  if (version != body_version)
    throw InputError(fmt::format("{}: has the format version {}; this program reads version {}", path, version, body_version));
  const double n = reader.number(file, "coordinates", "/", std::nullopt);
  // As many as a dense matrix of them has room for.
  if (!(n >= 0.0 && n <= 20000.0) || n != std::floor(n)) reader.fail("attribute 'coordinates' of '/'", "must be a count up to 20000");
  return static_cast<int>(n);
}

std::vector<int> read_indices(const Reader& reader, hid_t group, const std::string& name, const std::string& path, size_t below) {
  const MatX values = reader.numbers(group, name, path, {Reader::any}, true);
  std::vector<int> out;
  for (const double v : values.reshaped()) {
    if (!(v >= 0.0 && v < static_cast<double>(below)) || v != std::floor(v))
      reader.fail(fmt::format("dataset '{}{}'", path, name), fmt::format("holds {}, there are {} nodes from 0", v, below));
    out.push_back(static_cast<int>(v));
  }
  return out;
}

void read_matrices(const Reader& reader, hid_t file, FlexibleBody& b) {
  const auto n = static_cast<hsize_t>(b.n);
  const auto get = [&](const char* name, const std::vector<hsize_t>& shape, bool optional) {
    return reader.numbers(file, name, "/", shape, optional);
  };
  const auto or_zero = [&](const char* name, hsize_t rows) {
    MatX m = get(name, {rows, n}, true);
    if (m.size() == 0) m.setZero(static_cast<Eigen::Index>(rows), b.n);
    return m;
  };
  const auto blocks = [&](const char* name, std::span<MatX> list) {
    const MatX rows = get(name, {list.size(), n, n}, true);
    unstack(rows, b.n, list);
  };
  b.mass = reader.number(file, "mass", "/", std::nullopt);
  b.md0 = get("md0", {3}, false);
  b.md1 = or_zero("md1", 3);
  blocks("md2", b.md2);
  b.J0 = get("J0", {6}, false);
  b.J1 = or_zero("J1", 6);
  blocks("J2", b.J2);
  b.Cr0 = or_zero("Cr0", 3);
  blocks("Cr1", b.Cr1);
  b.Me = get("Me", {n, n}, n == 0);
  b.Ke = get("Ke", {n, n}, n == 0);
  b.De = get("De", {n, n}, true);
  if (const MatX ksigma = get("ksigma", {n}, true); ksigma.size() > 0) b.ksigma = ksigma;
  if (b.n == 0) b.Me = b.Ke = MatX(0, 0);
  b.labels = reader.texts(file, "labels", "/");
  if (!b.labels.empty() && std::ssize(b.labels) != b.n)
    reader.fail("dataset '/labels'", fmt::format("must name {} elastic coordinates, found {}", b.n, b.labels.size()));
}

void read_nodes(const Reader& reader, hid_t file, FlexibleBody& b) {
  if (!reader.has(file, "nodes")) return;
  const std::string path = "/nodes/";
  const Id group = reader.group(file, "nodes", "/nodes");
  const auto n = static_cast<hsize_t>(b.n);
  const MatX origin = reader.numbers(group, "origin", path, {Reader::any, 3}, true);
  const auto nn = static_cast<hsize_t>(origin.rows());
  const std::vector<std::string> names = reader.texts(group, "names", path);
  if (names.size() != nn)
    reader.fail("dataset '/nodes/names'", fmt::format("must name {} nodes like 'origin', found {}", nn, names.size()));
  const MatX axes = reader.numbers(group, "axes", path, {nn, 3, 3}, true);
  const MatX phi = reader.numbers(group, "phi", path, {nn, 3, n}, n == 0), psi = reader.numbers(group, "psi", path, {nn, 3, n}, true);
  for (Eigen::Index i = 0; i < origin.rows(); ++i) {
    FlexibleNode node;
    node.name = names[i];
    if (std::find(names.begin(), names.begin() + i, node.name) != names.begin() + i)
      reader.fail("dataset '/nodes/names'", fmt::format("names '{}' twice", node.name));
    node.origin = origin.row(i).transpose();
    if (axes.size() > 0) {
      const VecX row = axes.row(i).transpose();
      node.rotation = row.reshaped(3, 3).transpose();
    }
    if (!((node.rotation.transpose() * node.rotation - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-9))
      reader.fail("dataset '/nodes/axes'", fmt::format("row {} is no rotation", i));
    node.phi = node.psi = Mat3X::Zero(3, b.n);
    if (phi.size() > 0) node.phi = node_columns(phi.row(i));
    if (psi.size() > 0) node.psi = node_columns(psi.row(i));
    b.nodes.push_back(std::move(node));
  }
  const auto read_second = [&](const char* list, const char* name, std::array<MatX, 3> FlexibleNode::*of) {
    const std::vector<int> nodes = read_indices(reader, group, list, path, nn);
    if (nodes.empty()) return;
    const MatX second = reader.numbers(group, name, path, {nodes.size(), 3, n, n}, false);
    for (size_t k = 0; k < nodes.size(); ++k) {
      const VecX row = second.row(static_cast<Eigen::Index>(k)).transpose();
      unstack(MatX(row.reshaped(static_cast<Eigen::Index>(n * n), 3).transpose()), b.n, b.nodes[static_cast<size_t>(nodes[k])].*of);
    }
  };
  read_second("second_nodes", "phi2", &FlexibleNode::phi2);
  read_second("turned_nodes", "psi2", &FlexibleNode::psi2);
  const std::vector<int> stress_nodes = read_indices(reader, group, "stress_nodes", path, nn);
  if (!stress_nodes.empty()) {
    const MatX stress = reader.numbers(group, "stress", path, {stress_nodes.size(), 6, n}, false);
    for (size_t k = 0; k < stress_nodes.size(); ++k)
      b.nodes[static_cast<size_t>(stress_nodes[k])].sigma = node_columns(stress.row(static_cast<Eigen::Index>(k)), 6);
  }
}

BodySurface read_surface_group(const Reader& reader, hid_t file, int coordinates) {
  BodySurface s;
  if (!reader.has(file, "surface")) return s;
  const std::string path = "/surface/";
  const Id group = reader.group(file, "surface", "/surface");
  const auto n = static_cast<hsize_t>(coordinates);
  s.points = reader.numbers(group, "points", path, {Reader::any, 3}, false);
  const auto m = static_cast<hsize_t>(s.points.rows());
  const MatX ids = reader.numbers(group, "ids", path, {m}, true);
  for (const double id : ids.reshaped()) {
    if (!(std::abs(id) < 2e9)) reader.fail("dataset '/surface/ids'", fmt::format("holds {}, which is no number of a node", id));
    s.ids.push_back(static_cast<int>(id));
  }
  const MatX faces = reader.numbers(group, "faces", path, {Reader::any, 8}, false);
  if (faces.size() > 0 && !(faces.minCoeff() >= -1.0 && faces.maxCoeff() < static_cast<double>(m)))
    reader.fail("dataset '/surface/faces'", fmt::format("names a point that is not among the {}", m));
  s.faces = faces.cast<int>();
  for (Eigen::Index f = 0; f < s.faces.rows(); ++f) {
    const Eigen::Index known = (s.faces.row(f).array() >= 0).count();
    const bool usual = known == 3 || known == 4 || known == 6 || known == 8;
    if (!usual || (s.faces.row(f).head(known).array() < 0).any())
      reader.fail("dataset '/surface/faces'", fmt::format("row {} must begin with 3, 4, 6 or 8 points", f));
  }
  s.phi = node_columns(reader.numbers(group, "phi", path, {m, 3, n}, n == 0));
  s.stress = node_columns(reader.numbers(group, "stress", path, {m, 6, n}, true), 6);
  s.load_stress = node_columns(reader.numbers(group, "load_stress", path, {m, 6, 12}, true), 6);
  s.other_points = read_indices(reader, group, "other_points", path, static_cast<size_t>(m));
  if (s.other_points.empty()) return s;
  if (!std::is_sorted(s.other_points.begin(), s.other_points.end())) reader.fail("dataset '/surface/other_points'", "must be ascending");
  const auto others = static_cast<hsize_t>(s.other_points.size());
  s.other_stress = node_columns(reader.numbers(group, "other_stress", path, {others, 6, n}, false), 6);
  s.other_load_stress = node_columns(reader.numbers(group, "other_load_stress", path, {others, 6, 12}, true), 6);
  return s;
}

}  // namespace

bool is_hdf5(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;
  std::ifstream in(path, std::ios::binary);
  char start[8] = {};
  in.read(start, sizeof start);
  return in.gcount() == sizeof start && std::memcmp(start, "\x89HDF\r\n\x1a\n", sizeof start) == 0;
}

bool is_body_file(const std::filesystem::path& path) {
  if (!is_hdf5(path)) return false;
  H5dont_atexit();
  const Quiet quiet;
  try {
    const Reader reader(path, "a flexible body (BODY.h5)");
    const Id file = reader.open_file();
    return H5Aexists(file, "format") > 0 && reader.text(file, "format", "/", "") == body_format;
  } catch (const InputError&) {
    return false;
  }
}

Eigen::MatrixX3i surface_triangles(const BodySurface& surface) {
  std::vector<Eigen::Vector3i> out;
  for (Eigen::Index f = 0; f < surface.faces.rows(); ++f) {
    const Eigen::Index count = (surface.faces.row(f).array() >= 0).count(), n = count < 6 ? count : count / 2;
    const auto at = [&](Eigen::Index k) { return surface.faces(f, k); };
    if (count >= 6)
      for (Eigen::Index k = 0; k < n; ++k) out.emplace_back(at(k), at(n + k), at(n + (k + n - 1) % n));
    const Eigen::Index first = count < 6 ? 0 : n;
    out.emplace_back(at(first), at(first + 1), at(first + 2));
    if (n == 4) out.emplace_back(at(first), at(first + 2), at(first + 3));
  }
  Eigen::MatrixX3i triangles(std::ssize(out), 3);
  for (size_t t = 0; t < out.size(); ++t) triangles.row(static_cast<Eigen::Index>(t)) = out[t].transpose();
  return triangles;
}

BodyFile read_body(const std::filesystem::path& path, const std::string& name) {
  BodyFile out;
  if (!is_hdf5(path)) {
    const SidReading sid = read_sid(path);
    out.notes = sid.notes;
    out.comment = sid.file.comment;
    out.body = to_flexible_body(sid.file, name, &out.notes, &out.lacks);
    out.further = sid.file.further;
    return out;
  }
  H5dont_atexit();
  const Quiet quiet;
  const Reader reader(path, "a flexible body (BODY.h5)");
  const Id file = reader.open_file();
  out.body.n = read_head(reader, file, path.string());
  out.comment = reader.text(file, "comment", "/", "");
  read_matrices(reader, file, out.body);
  read_nodes(reader, file, out.body);
  out.surface = read_surface_group(reader, file, out.body.n);
  out.further = read_further(reader, file, out.body.n, out.body.nodes.size());
  for (const char* key : {"model", "model_sha256", "program", "request"})
    if (const std::string text = reader.text(file, key, "/", ""); !text.empty()) out.origin.emplace_back(key, text);
  // Its matrices are held to what those of a SID file are.
  FlexibleBody bare = out.body;
  bare.nodes.clear();
  to_flexible_body(from_flexible_body(bare, out.comment), name, &out.notes);
  return out;
}

BodySurface read_body_surface(const std::filesystem::path& path) {
  H5dont_atexit();
  const Quiet quiet;
  const Reader reader(path, "a flexible body (BODY.h5)");
  const Id file = reader.open_file();
  return read_surface_group(reader, file, read_head(reader, file, path.string()));
}

FurtherShapes read_further_shapes(const std::filesystem::path& path) {
  if (!is_hdf5(path)) return read_sid(path).file.further;
  H5dont_atexit();
  const Quiet quiet;
  const Reader reader(path, "a flexible body (BODY.h5)");
  const Id file = reader.open_file();
  return read_further(reader, file, read_head(reader, file, path.string()), std::nullopt);
}

void write_body(const BodyFile& file, const std::filesystem::path& path) {
  check_body(file, path.string());
  write_hdf5(path, [&](hid_t h5) {
    write_attribute(h5, "format", std::string(body_format));
    write_attribute(h5, "format_version", static_cast<long>(body_version));
    write_attribute(h5, "units", std::string("SI: m, kg, s, rad, N, Pa"));
    write_attribute(h5, "coordinates", static_cast<long>(file.body.n));
    write_attribute(h5, "mass", file.body.mass);
    if (!file.comment.empty()) write_attribute(h5, "comment", file.comment);
    for (const auto& [key, text] : file.origin) write_attribute(h5, key, text);
    write_matrices(h5, file.body);
    if (!file.body.nodes.empty()) write_nodes(h5, file.body);
    if (file.further.count() > 0) write_further(h5, file.further);
    if (file.surface.points.rows() > 0) write_body_surface(h5, file.surface, static_cast<hsize_t>(file.body.n));
  });
}

}  // namespace flexframe::sim
