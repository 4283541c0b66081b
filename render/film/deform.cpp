#include "render/film/deform.h"

#include "interp/error_bar.h"
#include "interp/exaggerate.h"
#include "interp/known.h"
#include "render/base/file.h"
#include "render/picture/mesh.h"
#include "sim/base/error.h"
#include "sim/base/file_output.h"
#include "sim/base/plain_text.h"
#include "sim/base/types.h"

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
    if (std::isalnum(static_cast<unsigned char>(c))) name.push_back(sim::plain_lower(c));
  }
  return name;
}

// "U_x [mm]" -> "mm", lower case; empty where no bracket tells a unit.
std::string unit_name(std::string_view text) {
  const size_t open = text.find_first_of("[("), close = text.find_first_of("])", open == std::string_view::npos ? 0 : open);
  if (open == std::string_view::npos || close == std::string_view::npos) return {};
  std::string unit;
  for (const char c : text.substr(open + 1, close - open - 1))
    if (!std::isspace(static_cast<unsigned char>(c))) unit.push_back(sim::plain_lower(c));
  return unit;
}

// Metres or radians in one of a unit; 0: unknown.
double size_of_unit(const std::string& unit) {
  static constexpr std::pair<std::string_view, double> known[] = {{"m", 1.0},
                                                                  {"cm", 1e-2},
                                                                  {"mm", 1e-3},
                                                                  {"um", 1e-6},
                                                                  {"\xc2\xb5m", 1e-6},
                                                                  {"in", 0.0254},
                                                                  {"inch", 0.0254},
                                                                  {"ft", 0.3048},
                                                                  {"rad", 1.0},
                                                                  {"mrad", 1e-3},
                                                                  {"deg", M_PI / 180.0},
                                                                  {"\xc2\xb0", M_PI / 180.0},
                                                                  {"degrees", M_PI / 180.0}};
  for (const auto& [name, size] : known)
    if (name == unit) return size;
  return 0.0;
}

// Index into column_names, or -1. first: what the numbered columns begin with, 0 (ParaView's "Points:0") or 1.
int known_column(const std::string& name, int first) {
  if (name.empty()) return -1;
  const char last = name.back();
  const bool letter = last >= 'x' && last <= 'z';
  const int axis = letter ? last - 'x' : last >= '0' + first && last <= '2' + first ? last - '0' - first : -1;
  auto one_of = [](std::string_view stem, std::initializer_list<std::string_view> words) {
    return std::find(words.begin(), words.end(), stem) != words.end();
  };
  // Words after the axis: "X Location", "x_coordinate".
  for (const std::string_view tail : {"location", "coordinate", "coord", "position", "displacement", "deformation", "rotation"})
    if (name.size() == tail.size() + 1 && name.ends_with(tail) && name[0] >= 'x' && name[0] <= 'z')
      return (one_of(tail, {"displacement", "deformation"}) ? 3 : tail == "rotation" ? 6 : 0) + name[0] - 'x';
  if (name == "u" || name == "v" || name == "w") return 3 + name[0] - 'u';
  if (axis < 0) return -1;
  const std::string stem = name.substr(0, name.size() - 1);
  if (letter && one_of(stem, {"", "pos", "position", "coord", "coordinate", "coordinates", "node", "p", "c", "point", "points"}))
    return axis;
  if (!letter && one_of(stem, {"x", "coord", "coor", "coordinates", "point", "points"})) return axis;
  if (one_of(stem, {"u", "uu", "d", "disp", "displ", "displacement", "displacements", "t", "def", "deformation"})) return 3 + axis;
  if (one_of(stem, {"r", "rot", "rotation", "rotations", "theta", "phi", "ur", "urur"})) return 6 + axis;
  return -1;
}

std::string_view trim(std::string_view s) {
  while (!s.empty() && (std::isspace(static_cast<unsigned char>(s.front())) || s.front() == '"')) s.remove_prefix(1);
  while (!s.empty() && (std::isspace(static_cast<unsigned char>(s.back())) || s.back() == '"')) s.remove_suffix(1);
  return s;
}

// Without the blanks around a line; a leading tab may stand for an empty column.
std::string_view trim_line(std::string_view s) {
  while (!s.empty() && s.front() == ' ') s.remove_prefix(1);
  while (!s.empty() && std::isspace(static_cast<unsigned char>(s.back()))) s.remove_suffix(1);
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
  // A separator between quotes is none.
  while (true) {
    size_t end = 0;
    for (bool quoted = false; end < line.size() && (quoted || line[end] != separator); ++end) quoted ^= line[end] == '"';
    out.push_back(trim(line.substr(0, end)));
    if (end == line.size()) return out;
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

// Where each quantity stands in a line of the table.
struct Columns {
  std::array<int, 9> place;      // -1: not there
  std::array<double, 9> factor;  // to the unit of the positions, and to radians
  size_t width = 0;
  char separator = ',';
  bool rotations = false;
  std::string note;
};

Columns read_header(std::string_view line, const std::string& at) {
  Columns out;
  out.place.fill(-1);
  out.factor.fill(1.0);
  out.separator = find_separator(line);
  const auto words = split(line, out.separator);
  out.width = words.size();
  // Numbered from 0 where a displacement or a point is.
  int first = 1;
  for (const std::string_view word : words)
    if (const std::string name = plain_name(word); name.size() > 1 && name.back() == '0' && known_column(name, 0) >= 0) first = 0;
  // u v w are displacements where nothing else is.
  const bool named = std::any_of(words.begin(), words.end(), [&](std::string_view w) {
    const std::string name = plain_name(w);
    const int k = name.size() > 1 ? known_column(name, first) : -1;
    return k >= 3 && k < 6;
  });
  std::array<std::string, 9> unit;
  for (size_t c = 0; c < words.size(); ++c) {
    const int k = known_column(plain_name(words[c]), first);
    if (k < 0 || (named && k >= 3 && plain_name(words[c]).size() == 1)) continue;
    const size_t i = k;
    if (out.place[i] >= 0)
      throw sim::InputError(
          fmt::format("{}: column '{}' is there twice ('{}' and '{}')", at, column_names[i], words[out.place[i]], words[c]));
    out.place[i] = static_cast<int>(c);
    unit[i] = unit_name(words[c]);
  }
  for (size_t k = 0; k < 6; ++k)
    if (out.place[k] < 0) {
      double value = 0.0;
      throw sim::InputError(fmt::format("{}: {}; needed is a header line x,y,z,ux,uy,uz[,rx,ry,rz]", at,
                                        parse_double(words[0], value)
                                            ? std::string("the first line holds numbers, not the names of the columns")
                                            : fmt::format("no column '{}'", column_names[k])));
    }
  const int given = (out.place[6] >= 0) + (out.place[7] >= 0) + (out.place[8] >= 0);
  if (given == 1 || given == 2) throw sim::InputError(fmt::format("{}: rotations need all of rx, ry, rz", at));
  out.rotations = given == 3;
  // Units in brackets: displacements are taken to the unit of the positions where both are told.
  for (size_t group = 0; group < 9; group += 3)
    for (size_t k = group; k < group + 3 && (group < 6 || out.rotations); ++k)
      if (unit[k] != unit[group])
        throw sim::InputError(fmt::format("{}: '{}' is in '{}' and '{}' in '{}': one unit is needed", at, column_names[group], unit[group],
                                          column_names[k], unit[k]));
  const double lengths = size_of_unit(unit[0]), displacements = size_of_unit(unit[3]), angles = out.rotations ? size_of_unit(unit[6]) : 0.0;
  if (lengths > 0.0 && displacements > 0.0 && lengths != displacements) {
    for (size_t k = 3; k < 6; ++k) out.factor[k] = displacements / lengths;
    out.note = fmt::format("displacements are in {}, positions in {}: displacements multiplied by {:g}", unit[3], unit[0],
                           displacements / lengths);
  }
  if (angles > 0.0 && angles != 1.0) {
    for (size_t k = 6; k < 9; ++k) out.factor[k] = angles;
    out.note += fmt::format("{}rotations are in {}: taken as radians", out.note.empty() ? "" : "; ", unit[6]);
  }
  return out;
}

// Some programs write the names behind the sign of a comment.
bool names_columns(std::string_view comment) {
  try {
    read_header(comment, "");
    return true;
  } catch (const sim::InputError&) {
    return false;
  }
}

// Rotations that are zero everywhere while the nodes move against each other come from elements without rotations.
bool rotations_missing(const NodeTable& table) {
  if (table.rotation.rows() < 3 || table.rotation.cwiseAbs().maxCoeff() > 0.0) return false;
  const interp::Points relative = table.displacement.rowwise() - table.displacement.row(0);
  return relative.cwiseAbs().maxCoeff() > 0.0;
}

std::string lower_extension(const fs::path& path) {
  std::string e = path.extension().string();
  e = sim::plain_lower(e);
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

  Columns columns;
  bool header = false;
  std::vector<double> values;
  long line_number = 0;
  while (!text.empty()) {
    ++line_number;
    const size_t end = text.find('\n');
    std::string_view line = trim_line(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    const bool comment = !line.empty() && (line.front() == '#' || line.front() == '%');
    while (comment && !line.empty() && (line.front() == '#' || line.front() == '%' || line.front() == ' ')) line.remove_prefix(1);
    if (line.empty() || (comment && (header || !names_columns(line)))) continue;
    const std::string at = fmt::format("{}:{}", file, line_number);
    if (!header) {
      header = true;
      columns = read_header(line, at);
      continue;
    }
    auto words = split(line, columns.separator);
    while (words.size() > columns.width && words.back().empty()) words.pop_back();
    if (words.size() < columns.width)
      throw sim::InputError(fmt::format("{}: {} values, the header has {} columns", at, words.size(), columns.width));
    if (words.size() > columns.width && columns.separator == ',')
      throw sim::InputError(
          fmt::format("{}: {} values, the header has {} columns; numbers with a decimal comma need ';' or a tab between them", at,
                      words.size(), columns.width));
    for (size_t k = 0; k < (columns.rotations ? 9u : 6u); ++k) {
      std::string word(words[columns.place[k]]);
      if (word.find('.') == std::string::npos) std::replace(word.begin(), word.end(), ',', '.');
      double value = 0.0;
      if (!parse_double(word, value))
        throw sim::InputError(fmt::format("{}: {} is '{}', a number is needed", at, column_names[k], word.substr(0, 40)));
      if (!std::isfinite(value)) throw sim::InputError(fmt::format("{}: {} is {}, it must be finite", at, column_names[k], word));
      values.push_back(columns.factor[k] * value);
    }
  }
  if (!header)
    throw sim::InputError(fmt::format("{}: empty, a header line x,y,z,ux,uy,uz[,rx,ry,rz] and one line a node are needed", file));
  const bool rotations = columns.rotations;
  const size_t stride = rotations ? 9 : 6;
  const auto count = static_cast<Eigen::Index>(values.size() / stride);
  if (count == 0) throw sim::InputError(fmt::format("{}: no nodes below the header line, at least one is needed", file));
  NodeTable table;
  table.nodes.positions.resize(count, 3);
  table.displacement.resize(count, 3);
  table.rotation.resize(rotations ? count : 0, 3);
  table.nodes.rotations = rotations;
  table.note = columns.note;
  for (Eigen::Index i = 0; i < count; ++i)
    for (int c = 0; c < 3; ++c) {
      const double* row = values.data() + static_cast<size_t>(i) * stride;
      table.nodes.positions(i, c) = row[c];
      table.displacement(i, c) = row[3 + c];
      if (rotations) table.rotation(i, c) = row[6 + c];
    }
  return table;
}

namespace {

// Warning that the mesh may be off by more than a twentieth of what the nodes move against each other; empty: it is not, or nothing tells.
std::string doubtful_map(const interp::Map& map, const interp::MeshView& mesh, const NodeTable& table) {
  constexpr double limit = 0.05, unseen = 1e-3;
  const interp::MeanError mean(map, mesh);
  if (!mean.known()) return {};
  const double error = mean.evaluate(map, table.displacement, table.rotation), count = map.nodes;
  const interp::RigidMotion rigid = interp::best_rigid_motion(table.nodes.positions, table.displacement, table.rotation);
  double bent = 0.0;
  for (Eigen::Index i = 0; i < table.displacement.rows(); ++i)
    bent += (table.displacement.row(i).transpose() - rigid.displacement(table.nodes.positions.row(i).transpose())).squaredNorm() / count;
  if (!(error > limit * std::sqrt(bent)) || !(error > unseen * std::sqrt(table.displacement.squaredNorm() / count))) return {};
  return fmt::format(
      "between the nodes the mesh may be off by about {:.2g} % of what they move against each other (each predicted from the others): "
      "more nodes where it bends, or nodes with rotations, tell more",
      std::min(100.0, 100.0 * error / std::sqrt(bent)));
}

}  // namespace

DeformReport deform(const fs::path& nodes, const fs::path& mesh_file, const fs::path& output, const DeformOptions& options) {
  const std::string extension = lower_extension(output);
  if (extension != ".obj" && extension != ".csv")
    throw sim::InputError(fmt::format("{}: the output must end in .obj or .csv", output.string()));
  NodeTable table = read_node_table(nodes);
  const render::Mesh mesh = render::read_mesh(mesh_file);
  DeformReport report;
  report.warnings = mesh.warnings;
  report.warnings.insert(report.warnings.end(), mesh.faults.begin(), mesh.faults.end());
  if (!table.note.empty()) report.warnings.push_back(table.note);
  if (rotations_missing(table)) {
    report.warnings.push_back("all rotations are zero although the nodes move relative to each other: rotations are estimated instead");
    table.rotation.resize(0, 3);
    table.nodes.rotations = false;
  }
  const interp::MeshView view{
      Eigen::Map<const interp::Points>(&mesh.positions[0].x, static_cast<Eigen::Index>(mesh.positions.size()), 3),
      Eigen::Map<const interp::Triangles>(&mesh.triangles[0].x, static_cast<Eigen::Index>(mesh.triangles.size()), 3)};
  interp::Options how;
  how.scheme = options.scheme;
  how.precise = true;
  interp::Map map;
  try {
    const auto column = [](const interp::Points& rows) { return Eigen::MatrixXd(rows.reshaped<Eigen::RowMajor>(3 * rows.rows(), 1)); };
    map = interp::make_map_for(table.nodes, view, how,
                               {column(table.displacement), table.rotation.rows() > 0 ? column(table.rotation) : Eigen::MatrixXd(), false});
  } catch (const interp::InputError& e) {
    throw interp::InputError(fmt::format("{} and {}: {}", nodes.string(), mesh_file.string(), e.what()));
  }
  interp::Points u = interp::apply_precise(map, table.displacement, table.rotation);
  report.map = map.report;
  report.warnings.insert(report.warnings.end(), map.report.warnings.begin(), map.report.warnings.end());
  if (const std::string differ = interp::merged_nodes_differ(map, table.nodes, table.displacement); !differ.empty())
    report.warnings.push_back(differ);
  report.leave_one_out = interp::leave_one_out(map, table.displacement, table.rotation);
  if (std::string doubtful = doubtful_map(map, view, table); !doubtful.empty()) report.warnings.push_back(std::move(doubtful));
  report.nodes = map.nodes;
  report.vertices = map.vertices;
  report.largest = u.rowwise().norm().maxCoeff();

  const render::Bounds bounds = render::compute_bounds(mesh);
  report.scale = options.scale ? *options.scale : interp::auto_scale(report.largest, 2.0 * bounds.radius());
  if (options.corotated || report.scale > 1.0) {
    const interp::PointsF single = u.cast<float>();
    const std::span<const float> flat(single.data(), single.size());
    if (options.corotated) {
      interp::PointsF turned(single.rows(), 3);
      interp::Corotated(view).apply(flat, report.scale, std::span<float>(turned.data(), turned.size()));
      u = turned.cast<double>();
    } else if (const std::string warning = interp::exaggeration_warning(interp::largest_rotation(view, flat), report.scale);
               !warning.empty()) {
      report.warnings.push_back(warning);
    }
  }
  if (!options.corotated) u *= report.scale;
  if (!u.allFinite()) throw MapError("the displacements of the mesh are not finite: the nodes' displacements or the scale are too large");

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
  sim::write_whole_file(output, {text.data(), text.size()});
  return report;
}

}  // namespace flexframe::film
