// Wavefront OBJ files and their materials (MTL).
#include "render/picture/mesh_polygons.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

namespace flexframe::render {
namespace {

namespace fs = std::filesystem;

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

std::string_view next_word(std::string_view& rest) {
  size_t begin = 0;
  while (begin < rest.size() && is_blank(rest[begin])) ++begin;
  size_t end = begin;
  while (end < rest.size() && !is_blank(rest[end])) ++end;
  const std::string_view word = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return word;
}

std::string shown(std::string_view word) { return word.size() > 40 ? std::string(word.substr(0, 40)) + "..." : std::string(word); }

double parse_number(std::string_view word, const std::string& file, long line, const char* what) {
  std::string_view digits = word;
  if (!digits.empty() && digits.front() == '+') digits.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  const bool whole = error == std::errc{} && end == digits.data() + digits.size();
  // Magnitudes below the smallest double are zero for a mesh.
  if (error == std::errc::result_out_of_range && digits.find("e-") != std::string_view::npos) return 0.0;
  if (!whole) throw MeshError(fmt::format("{}:{}: {} '{}' is no number", file, line, what, shown(word)));
  if (!std::isfinite(value)) throw MeshError(fmt::format("{}:{}: {} is {}, coordinates must be finite", file, line, what, shown(word)));
  return value;
}

// Calls visit(keyword, rest, line number) for each logical line; a backslash at the end joins the next line.
template <typename Visit>
void for_each_line(std::string_view text, Visit visit) {
  long number = 0;
  std::string joined;
  size_t begin = 0;
  while (begin < text.size()) {
    const long first = ++number;
    size_t end = text.find('\n', begin);
    // Old Mac files end their lines by a bare carriage return.
    if (end == std::string_view::npos) end = text.size();
    std::string_view line = text.substr(begin, end - begin);
    begin = end + 1;
    while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
    if (!line.empty() && line.back() == '\\') {
      joined.clear();
      while (!line.empty() && line.back() == '\\') {
        joined.append(line.substr(0, line.size() - 1)).push_back(' ');
        if (begin >= text.size()) {
          line = {};
          break;
        }
        ++number;
        end = std::min(text.find('\n', begin), text.size());
        line = text.substr(begin, end - begin);
        begin = end + 1;
        while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
      }
      joined.append(line);
      line = joined;
    }
    std::string_view rest = line;
    const std::string_view keyword = next_word(rest);
    visit(keyword, rest, first);
  }
}

// The number of a corner's part "v", "vt" or "vn".
long corner_number(std::string_view part, const std::string& file, long line) {
  if (part.front() == '+') part.remove_prefix(1);
  long number = 0;
  const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), number);
  if (error != std::errc{} || end != part.data() + part.size())
    throw MeshError(fmt::format("{}:{}: face corner '{}' is no index", file, line, shown(part)));
  return number;
}

// Index, from 0, of a corner's vertex: checked against the count so far (negative) and the count in the file.
int vertex_index(std::string_view part, long so_far, long in_all, const std::string& file, long line) {
  const long index = corner_number(part, file, line);
  if (index == 0) throw MeshError(fmt::format("{}:{}: face refers to vertex 0, indices start at 1", file, line));
  if (index < 0 && -index > so_far)
    throw MeshError(fmt::format("{}:{}: face refers to vertex {}, only {} lie before this line", file, line, index, so_far));
  if (index > in_all) throw MeshError(fmt::format("{}:{}: face refers to vertex {}, the file has {}", file, line, index, in_all));
  return static_cast<int>(index < 0 ? so_far + index : index - 1);
}

std::string trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return std::string(text);
}

std::vector<float> numbers_of(std::string_view rest) {
  std::vector<float> out;
  for (std::string_view word = next_word(rest); !word.empty() && word.front() != '#'; word = next_word(rest)) {
    if (word.front() == '+') word.remove_prefix(1);
    float value = 0.0f;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc{} && end == word.data() + word.size() && std::isfinite(value)) out.push_back(value);
  }
  return out;
}

// One material's lines: colour Kd, opacity d, else 1 - Tr, roughness Pr or from the exponent Ns, metallic Pm. What cannot be read is left
// as it is: a picture does not fail for a colour.
struct MaterialLines {
  glm::vec3 color{0.6f};
  std::optional<float> opacity, transparency;
  std::optional<float> roughness, exponent, metallic;
  bool textured = false;

  void read(std::string_view keyword, std::string_view rest) {
    textured = textured || keyword.starts_with("map_") || keyword == "bump" || keyword == "norm" || keyword == "disp" || keyword == "decal";
    const std::vector<float> v = numbers_of(rest);
    if (v.empty()) return;
    if (keyword == "Kd") color = v.size() >= 3 ? glm::vec3(v[0], v[1], v[2]) : glm::vec3(v[0]);
    else if (keyword == "d") opacity = v.back();
    else if (keyword == "Tr") transparency = v[0];
    else if (keyword == "Ns") exponent = v[0];
    else if (keyword == "Pr") roughness = v[0];
    else if (keyword == "Pm") metallic = v[0];
  }

  MeshMaterial material(const std::string& name) const {
    MeshMaterial out;
    out.name = name;
    out.look.color = glm::clamp(color, 0.0f, 1.0f);
    // Some programs write the opacity as 'Tr' too: beside a 'd' it says nothing.
    out.opacity = std::clamp(opacity ? *opacity : 1.0f - transparency.value_or(0.0f), 0.0f, 1.0f);
    if (roughness) out.look.roughness = std::clamp(*roughness, 0.0f, 1.0f);
    else if (exponent && *exponent > 0.0f) out.look.roughness = roughness_of_exponent(*exponent);
    if (metallic) out.look.metallic = std::clamp(*metallic, 0.0f, 1.0f);
    return out;
  }
};

// Reads the lines of an OBJ file into a mesh and its polygons.
class ObjReader {
 public:
  ObjReader(const fs::path& path, Mesh& mesh, Polygons& polygons) : path_(path), file_(path.string()), mesh_(mesh), polygons_(polygons) {
    mesh_.materials.emplace_back();
    mesh_.materials.back().name = "DefaultMaterial";
  }

  void read(std::string_view text) {
    // Counts first, since faces may refer to vertices further down.
    for_each_line(text, [&](std::string_view keyword, std::string_view, long) {
      vertices_ += keyword == "v";
      normals_ += keyword == "vn";
    });
    if (vertices_ >= most_vertices) throw MeshError(fmt::format("{}: {} vertices are too many", file_, vertices_));
    mesh_.positions.reserve(vertices_);
    for_each_line(text, [&](std::string_view keyword, std::string_view rest, long line) {
      if (keyword == "v") read_vertex(rest, line);
      else if (keyword == "f" || keyword == "fo") read_face(rest, line);
      else if (keyword == "vn") read_normal(rest, line);
      else if (keyword == "usemtl") material_ = material_index(trimmed(rest));
      else if (keyword == "mtllib") read_materials(trimmed(rest));
      else if (keyword == "surf" || keyword == "curv" || keyword == "curv2") ++free_forms_;
    });
    if (mesh_.positions.empty()) throw MeshError(fmt::format("{}: no vertices ('v' lines) found, this is no Wavefront mesh", file_));
    if (polygons_.material.empty())
      throw MeshError(fmt::format("{}: {} vertices but no face with three corners or more ('f' lines)", file_, mesh_.positions.size()));
    if (free_forms_ > 0)
      mesh_.faults.push_back(
          fmt::format("its {} free-form curves and surfaces ('curv', 'surf') are left out: faces alone are drawn", free_forms_));
    if (weighted_) mesh_.faults.emplace_back("the fourth numbers of its vertices ('v x y z w') are passed over: faces have no weights");
    tell_of_unknown_materials();
    scale_colors();
    if (!mesh_.colors.empty()) mesh_.colors.resize(mesh_.positions.size(), glm::vec3(1.0f));
    for (const int n : corner_normal_) {
      polygons_.corner_normal.push_back(n < 0 ? glm::vec3(0.0f) : normal_[n]);
      missing_normals_ += n >= 0 && normal_[n] == glm::vec3(0.0f);
    }
    if (missing_normals_ > 0)
      mesh_.warnings.push_back(
          fmt::format("{} corners of its faces name normals ('vn') that are not there or have no direction: all normals are made from the "
                      "faces",
                      missing_normals_));
  }

 private:
  static constexpr long most_vertices = 1L << 31;

  void read_vertex(std::string_view rest, long line) {
    std::array<double, 7> value{};
    size_t count = 0;
    for (std::string_view word = next_word(rest); !word.empty() && word.front() != '#' && count < 7; word = next_word(rest))
      value[count++] = parse_number(word, file_, line, "coordinate");
    if (count < 3) throw MeshError(fmt::format("{}:{}: a vertex needs x y z, this line has {} number(s)", file_, line, count));
    const glm::dvec3 p(value[0], value[1], value[2]);
    // A weight, of curves and surfaces alone.
    weighted_ = weighted_ || (count == 4 && value[3] != 0.0 && value[3] != 1.0);
    if (too_far(p)) throw far_away(fmt::format("{}:{}: vertex", file_, line), p);
    if (count >= 6) {
      mesh_.colors.resize(mesh_.positions.size(), glm::vec3(1.0f));
      const size_t at = count == 7 ? 4 : 3;
      mesh_.colors.emplace_back(value[at], value[at + 1], value[at + 2]);
    }
    mesh_.positions.push_back(p);
  }

  // What is no direction is none: light does not decide whether a mesh can be used (programs write nan where a face has no area).
  void read_normal(std::string_view rest, long line) {
    glm::dvec3 n(0.0);
    for (int k = 0; k < 3; ++k) {
      std::string_view word = next_word(rest);
      if (word.empty()) throw MeshError(fmt::format("{}:{}: a normal needs x y z", file_, line));
      if (word.front() == '+') word.remove_prefix(1);
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), n[k]);
      if (error != std::errc{} || end != word.data() + word.size()) n[k] = NAN;
    }
    const double length = glm::length(n);
    normal_.push_back(std::isfinite(length) && length > 1e-20 ? glm::vec3(n / length) : glm::vec3(0.0f));
  }

  // Of a corner, from 0; -1: not given, or not there.
  int normal_index(std::string_view part, long line) {
    if (part.empty()) return -1;
    const long index = corner_number(part, file_, line), so_far = static_cast<long>(normal_.size());
    const long at = index < 0 ? so_far + index : index - 1;
    if (at >= 0 && at < normals_) return static_cast<int>(at);
    ++missing_normals_;
    return -1;
  }

  void read_face(std::string_view rest, long line) {
    const size_t before = polygons_.corner.size();
    for (std::string_view word = next_word(rest); !word.empty() && word.front() != '#'; word = next_word(rest)) {
      const std::string_view whole = word;
      std::array<std::string_view, 3> part;
      for (size_t k = 0; k < 3; ++k) {
        const size_t slash = word.find('/');
        part[k] = word.substr(0, slash);
        word = slash == std::string_view::npos ? std::string_view{} : word.substr(slash + 1);
      }
      if (part[0].empty()) throw MeshError(fmt::format("{}:{}: face corner '{}' has no vertex", file_, line, shown(whole)));
      polygons_.corner.push_back(vertex_index(part[0], static_cast<long>(mesh_.positions.size()), vertices_, file_, line));
      if (!part[1].empty()) corner_number(part[1], file_, line);  // textures are not drawn
      corner_normal_.push_back(normal_index(part[2], line));
    }
    if (polygons_.corner.size() < before + 3) {  // points and lines
      polygons_.corner.resize(before);
      corner_normal_.resize(before);
      return;
    }
    polygons_.begin.push_back(static_cast<int>(polygons_.corner.size()));
    polygons_.material.push_back(material_);
  }

  // A name that no library has: a material of the default look.
  int material_index(const std::string& name) {
    const auto [at, fresh] = by_name_.emplace(name, static_cast<int>(mesh_.materials.size()));
    if (fresh) mesh_.materials.push_back(MaterialLines{}.material(name));
    return at->second;
  }

  // Names with spaces are one file where that is there, else several.
  std::vector<fs::path> libraries_of(std::string name) const {
    std::replace(name.begin(), name.end(), '\\', '/');
    const auto there = [](const fs::path& library) {
      std::error_code error;
      return fs::is_regular_file(library, error) && fs::file_size(library, error) > 0;
    };
    const fs::path folder = path_.parent_path();
    if (there(folder / name)) return {folder / name};
    std::vector<fs::path> several;
    std::string_view rest = name;
    for (std::string_view word = next_word(rest); !word.empty(); word = next_word(rest))
      if (there(folder / word)) several.push_back(folder / word);
    if (!several.empty()) return several;
    const fs::path own = fs::path(path_).replace_extension(".mtl");
    return there(own) ? std::vector{own} : std::vector<fs::path>();
  }

  // The libraries beside the file, or one of the file's own name; without either the materials keep the default look.
  void read_materials(const std::string& name) {
    const std::vector<fs::path> libraries = libraries_of(name);
    for (const fs::path& library : libraries) read_library(library);
    if (!libraries.empty()) return;
    library_missing_ = true;
    mesh_.warnings.push_back(
        fmt::format("its material library {} is not there, nor one of the mesh's own name: drawn in a plain grey", shown(name)));
  }

  void read_library(const fs::path& library) {
    const std::string text = with_line_feeds(read_text(library));
    bool textured = false;
    MaterialLines lines;
    int index = -1;
    const auto finish = [&] {
      if (index >= 0) mesh_.materials[index] = lines.material(mesh_.materials[index].name);
      textured = textured || lines.textured;
    };
    for_each_line(text, [&](std::string_view keyword, std::string_view rest, long) {
      if (keyword == "newmtl") {
        finish();
        lines = {};
        index = material_index(trimmed(rest));
        known_.insert(index);
      } else if (index >= 0) {
        lines.read(keyword, rest);
      }
    });
    finish();
    if (textured)
      mesh_.warnings.push_back(
          fmt::format("{}: its textures are not drawn; its materials show their plain colour (Kd)", library.filename().string()));
  }

  void tell_of_unknown_materials() {
    const std::set<int> used(polygons_.material.begin(), polygons_.material.end());
    std::string names;
    for (const int m : used)
      if (m > 0 && !known_.contains(m)) names += (names.empty() ? "'" : ", '") + shown(mesh_.materials[m].name) + "'";
    if (!names.empty() && !library_missing_)
      mesh_.warnings.push_back(fmt::format("no material library has its material {}: drawn in a plain grey", names));
  }

  // Bytes, as some programs write colours.
  void scale_colors() {
    float largest = 1.0f;
    for (const glm::vec3& c : mesh_.colors) largest = std::max({largest, c.r, c.g, c.b});
    if (!(largest > 2.0f)) return;  // a little above 1 is light
    for (glm::vec3& c : mesh_.colors) c = glm::clamp(c / 255.0f, 0.0f, 1.0f);
    mesh_.warnings.emplace_back("the colours of its vertices go beyond 1 and are taken as bytes, 0 to 255");
  }

 public:
  // Text as the lines' reader wants it: of old Mac files bare carriage returns end the lines.
  static std::string with_line_feeds(std::string text) {
    // A byte-order mark is no part of the first word.
    if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);
    if (text.find('\n') == std::string::npos) std::replace(text.begin(), text.end(), '\r', '\n');
    return text;
  }

 private:
  const fs::path& path_;
  const std::string file_;
  Mesh& mesh_;
  Polygons& polygons_;
  long vertices_ = 0, normals_ = 0;  // in the file
  long missing_normals_ = 0;         // that corners name, or without a direction
  std::vector<glm::vec3> normal_;
  std::vector<int> corner_normal_;
  std::map<std::string, int> by_name_;
  std::set<int> known_;  // materials that a library has
  bool library_missing_ = false;
  long free_forms_ = 0;
  bool weighted_ = false;
  int material_ = 0;
};

}  // namespace

Mesh read_obj(const fs::path& path, const MeshOptions& options) {
  Mesh mesh;
  mesh.name = path.filename().string();
  Polygons polygons;
  ObjReader(path, mesh, polygons).read(ObjReader::with_line_feeds(read_text(path)));
  finish_mesh(std::move(polygons), options, mesh, fmt::format("{}: every face is degenerate, no triangle is left", path.string()));
  return mesh;
}

}  // namespace flexframe::render
