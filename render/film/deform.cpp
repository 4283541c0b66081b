#include "render/film/deform.h"

#include "interp/exaggerate.h"
#include "render/file.h"
#include "render/mesh.h"
#include "sim/types.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <span>
#include <string_view>

namespace flexframe::film {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 9> column_names{"x", "y", "z", "ux", "uy", "uz", "rx", "ry", "rz"};

// "U_x [mm]" -> "ux": letters and digits before any bracket, lower case.
std::string plain_name(std::string_view text) {
  std::string name;
  for (const char c : text) {
    if (c == '[' || c == '(') break;
    if (std::isalnum(static_cast<unsigned char>(c))) name.push_back(static_cast<char>(std::tolower(static_cast<unsigned char>(c))));
  }
  return name;
}

// Index into column_names, or -1.
int known_column(const std::string& name) {
  if (name.empty()) return -1;
  const char last = name.back();
  int axis = last >= 'x' && last <= 'z' ? last - 'x' : last >= '1' && last <= '3' ? last - '1' : -1;
  if (axis < 0) return -1;
  const std::string stem = name.substr(0, name.size() - 1);
  auto one_of = [&](std::initializer_list<std::string_view> words) { return std::find(words.begin(), words.end(), stem) != words.end(); };
  if (last >= 'x' && one_of({"", "pos", "position", "coord", "coordinate", "node", "p", "c"})) return axis;
  if (last < 'x' && one_of({"x", "coord", "coor"})) return axis;
  if (one_of({"u", "d", "disp", "displacement", "t", "def"})) return 3 + axis;
  if (one_of({"r", "rot", "rotation", "theta", "phi", "ur"})) return 6 + axis;
  return -1;
}

std::string_view trim(std::string_view s) {
  while (!s.empty() && (std::isspace(static_cast<unsigned char>(s.front())) || s.front() == '"')) s.remove_prefix(1);
  while (!s.empty() && (std::isspace(static_cast<unsigned char>(s.back())) || s.back() == '"')) s.remove_suffix(1);
  return s;
}

// separator 0: runs of blanks.
std::vector<std::string_view> split(std::string_view line, char separator) {
  std::vector<std::string_view> out;
  if (separator == 0) {
    size_t at = 0;
    while (at < line.size()) {
      while (at < line.size() && std::isspace(static_cast<unsigned char>(line[at]))) ++at;
      const size_t begin = at;
      while (at < line.size() && !std::isspace(static_cast<unsigned char>(line[at]))) ++at;
      if (at > begin) out.push_back(trim(line.substr(begin, at - begin)));
    }
    return out;
  }
  while (true) {
    const size_t end = line.find(separator);
    out.push_back(trim(line.substr(0, end)));
    if (end == std::string_view::npos) return out;
    line.remove_prefix(end + 1);
  }
}

char find_separator(std::string_view header) {
  for (const char c : {';', '\t', ','})
    if (header.find(c) != std::string_view::npos) return c;
  return 0;
}

bool parse_double(std::string_view text, double& value) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size();
}

// Rotations that are zero everywhere while the nodes move against each other come from elements without rotations.
bool rotations_missing(const NodeTable& table) {
  if (table.rotation.rows() < 3 || table.rotation.cwiseAbs().maxCoeff() > 0.0) return false;
  const interp::Points relative = table.displacement.rowwise() - table.displacement.row(0);
  return relative.cwiseAbs().maxCoeff() > 0.0;
}

std::string lower_extension(const fs::path& path) {
  std::string e = path.extension().string();
  std::transform(e.begin(), e.end(), e.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return e;
}

}  // namespace

NodeTable read_node_table(const fs::path& path) {
  const std::string file = path.string();
  std::error_code error;
  if (!fs::is_regular_file(path, error)) throw sim::InputError(fmt::format("{}: no such file of simulation nodes", file));
  const std::vector<std::uint8_t> bytes = render::read_file(path);
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);  // byte order mark

  std::array<int, 9> place;  // column of each quantity, -1: none
  place.fill(-1);
  bool header = false, rotations = false;
  char separator = ',';
  size_t width = 0;
  std::vector<double> values;
  long line_number = 0;
  while (!text.empty()) {
    ++line_number;
    const size_t end = text.find('\n');
    const std::string_view line = trim(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.empty() || line.front() == '#' || line.front() == '%') continue;
    if (!header) {
      header = true;
      separator = find_separator(line);
      const auto words = split(line, separator);
      width = words.size();
      for (size_t c = 0; c < words.size(); ++c) {
        const int k = known_column(plain_name(words[c]));
        if (k < 0) continue;
        if (place[static_cast<size_t>(k)] >= 0) throw sim::InputError(fmt::format("{}:{}: column '{}' is there twice", file, line_number, words[c]));
        place[static_cast<size_t>(k)] = static_cast<int>(c);
      }
      for (size_t k = 0; k < 6; ++k)
        if (place[k] < 0) {
          double value = 0.0;
          const bool numbers = parse_double(words[0], value);
          throw sim::InputError(fmt::format("{}:{}: {}; needed is a header line x,y,z,ux,uy,uz[,rx,ry,rz]", file, line_number,
                                            numbers ? std::string("the first line holds numbers, not the names of the columns") : fmt::format("no column '{}'", column_names[k])));
        }
      const int given = (place[6] >= 0) + (place[7] >= 0) + (place[8] >= 0);
      if (given == 1 || given == 2) throw sim::InputError(fmt::format("{}:{}: rotations need all of rx, ry, rz", file, line_number));
      rotations = given == 3;
      continue;
    }
    const auto words = split(line, separator);
    if (words.size() < width) throw sim::InputError(fmt::format("{}:{}: {} values, the header has {} columns", file, line_number, words.size(), width));
    for (size_t k = 0; k < (rotations ? 9u : 6u); ++k) {
      std::string word(words[static_cast<size_t>(place[k])]);
      if (separator == ';') std::replace(word.begin(), word.end(), ',', '.');
      double value = 0.0;
      if (!parse_double(word, value)) throw sim::InputError(fmt::format("{}:{}: {} is '{}', a number is needed", file, line_number, column_names[k], word.substr(0, 40)));
      if (!std::isfinite(value)) throw sim::InputError(fmt::format("{}:{}: {} is {}, it must be finite", file, line_number, column_names[k], word));
      values.push_back(value);
    }
  }
  if (!header) throw sim::InputError(fmt::format("{}: empty, a header line x,y,z,ux,uy,uz[,rx,ry,rz] and one line a node are needed", file));
  const size_t stride = rotations ? 9 : 6;
  const auto count = static_cast<Eigen::Index>(values.size() / stride);
  if (count == 0) throw sim::InputError(fmt::format("{}: no nodes below the header line, at least one is needed", file));
  NodeTable table;
  table.nodes.positions.resize(count, 3);
  table.displacement.resize(count, 3);
  table.rotation.resize(rotations ? count : 0, 3);
  table.nodes.rotations = rotations;
  for (Eigen::Index i = 0; i < count; ++i)
    for (int c = 0; c < 3; ++c) {
      const double* row = values.data() + static_cast<size_t>(i) * stride;
      table.nodes.positions(i, c) = row[c];
      table.displacement(i, c) = row[3 + c];
      if (rotations) table.rotation(i, c) = row[6 + c];
    }
  return table;
}

DeformReport deform(const fs::path& nodes, const fs::path& mesh_file, const fs::path& output, const DeformOptions& options) {
  const std::string extension = lower_extension(output);
  if (extension != ".obj" && extension != ".csv") throw sim::InputError(fmt::format("{}: the output must end in .obj or .csv", output.string()));
  NodeTable table = read_node_table(nodes);
  const render::Mesh mesh = render::read_mesh(mesh_file);
  DeformReport report;
  report.warnings = mesh.warnings;
  if (rotations_missing(table)) {
    report.warnings.push_back("all rotations are zero although the nodes move against each other: they are estimated instead");
    table.rotation.resize(0, 3);
    table.nodes.rotations = false;
  }
  const interp::MeshView view{Eigen::Map<const interp::Points>(&mesh.positions[0].x, static_cast<Eigen::Index>(mesh.positions.size()), 3),
                              Eigen::Map<const interp::Triangles>(&mesh.triangles[0].x, static_cast<Eigen::Index>(mesh.triangles.size()), 3)};
  interp::Options how;
  how.scheme = options.scheme;
  how.precise = true;
  interp::Map map;
  try {
    map = interp::make_map(table.nodes, view, how);
  } catch (const interp::InputError& e) {
    throw interp::InputError(fmt::format("{} and {}: {}", nodes.string(), mesh_file.string(), e.what()));
  }
  interp::Points u = interp::apply_precise(map, table.displacement, table.rotation);
  report.map = map.report;
  report.warnings.insert(report.warnings.end(), map.report.warnings.begin(), map.report.warnings.end());
  if (const std::string differ = interp::merged_nodes_differ(map, table.nodes, table.displacement); !differ.empty()) report.warnings.push_back(differ);
  report.leave_one_out = interp::leave_one_out(map, table.displacement, table.rotation);
  report.nodes = map.nodes;
  report.vertices = map.vertices;
  report.largest = u.rowwise().norm().maxCoeff();

  const render::Bounds bounds = render::compute_bounds(mesh);
  report.scale = options.scale ? *options.scale : interp::auto_scale(report.largest, 2.0 * bounds.radius());
  if (options.corotated || report.scale > 1.0) {
    const interp::PointsF single = u.cast<float>();
    const std::span<const float> flat(single.data(), static_cast<size_t>(single.size()));
    if (options.corotated) {
      interp::PointsF turned(single.rows(), 3);
      interp::Corotated(view).apply(flat, report.scale, std::span<float>(turned.data(), static_cast<size_t>(turned.size())));
      u = turned.cast<double>();
    } else if (const std::string warning = interp::exaggeration_warning(interp::largest_rotation(view, flat), report.scale); !warning.empty()) {
      report.warnings.push_back(warning);
    }
  }
  if (!options.corotated) u *= report.scale;
  if (!u.allFinite()) throw std::runtime_error("the displacements of the mesh are not finite: the nodes' displacements or the scale are too large");

  if (extension == ".obj") {
    std::vector<glm::dvec3> moved = mesh.positions;
    for (size_t v = 0; v < moved.size(); ++v) {
      const auto row = static_cast<Eigen::Index>(v);
      moved[v] += glm::dvec3(u(row, 0), u(row, 1), u(row, 2));
    }
    render::write_obj(output, mesh, moved);
    return report;
  }
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text), "ux,uy,uz\n");
  for (Eigen::Index v = 0; v < u.rows(); ++v) fmt::format_to(std::back_inserter(text), "{},{},{}\n", u(v, 0), u(v, 1), u(v, 2));
  render::write_file(output, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
  return report;
}

}  // namespace flexframe::film
