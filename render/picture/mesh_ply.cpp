// PLY files (Turk 1994): text and both binary forms. Read here because assimp crashes on cut ones.
#include "render/picture/mesh_polygons.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string_view>
#include <utility>

namespace flexframe::render {
namespace {

namespace fs = std::filesystem;

struct Type {
  std::array<std::string_view, 2> names;
  int bytes;
  double largest;  // of colours; floating point: 1
  bool real, sign;
};

constexpr std::array<Type, 8> types = {{{{"char", "int8"}, 1, 127.0, false, true},
                                        {{"uchar", "uint8"}, 1, 255.0, false, false},
                                        {{"short", "int16"}, 2, 32767.0, false, true},
                                        {{"ushort", "uint16"}, 2, 65535.0, false, false},
                                        {{"int", "int32"}, 4, 2147483647.0, false, true},
                                        {{"uint", "uint32"}, 4, 4294967295.0, false, false},
                                        {{"float", "float32"}, 4, 1.0, true, true},
                                        {{"double", "float64"}, 8, 1.0, true, true}}};

struct Property {
  std::string name;
  const Type* type = nullptr;
  const Type* count = nullptr;  // of a list
};

struct Element {
  std::string name;
  long count = 0;
  std::vector<Property> properties;
};

enum class Form { text, little, big };

bool is_white(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\v' || c == '\f'; }

class PlyReader {
 public:
  PlyReader(std::string file, std::string_view text, Mesh& mesh, Polygons& polygons)
      : file_(std::move(file)), text_(text), mesh_(mesh), polygons_(polygons) {}

  void read() {
    read_header();
    for (const Element& element : elements_) {
      element_ = &element;
      for (row_ = 0; row_ < element.count; ++row_) {
        if (element.name == "vertex") read_vertex(element);
        else read_row(element);
      }
    }
    check_corners();
  }

  // Whether coordinates were cut to single precision.
  bool single() const {
    return form_ != Form::text && std::any_of(elements_.begin(), elements_.end(), [](const Element& e) {
             return e.name == "vertex" && std::any_of(e.properties.begin(), e.properties.end(),
                                                      [](const Property& p) { return p.name == "x" && p.type->bytes < 8; });
           });
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw MeshError(fmt::format("{}: {}", file_, what)); }

  std::string_view header_line() {
    const std::size_t end = text_.find_first_of("\r\n", at_);
    if (end == std::string_view::npos) fail("is no whole PLY file: its header must begin with 'ply' and end with a line 'end_header'");
    const std::string_view line = text_.substr(at_, end - at_);
    at_ = end + (text_.substr(end).starts_with("\r\n") ? 2 : 1);
    return line;
  }

  static std::vector<std::string_view> words_of(std::string_view line) {
    std::vector<std::string_view> words;
    for (std::size_t at = 0; at < line.size();) {
      while (at < line.size() && is_white(line[at])) ++at;
      const std::size_t begin = at;
      while (at < line.size() && !is_white(line[at])) ++at;
      if (at > begin) words.push_back(line.substr(begin, at - begin));
    }
    return words;
  }

  const Type* type_of(std::string_view word) const {
    for (const Type& t : types)
      if (t.names[0] == word || t.names[1] == word) return &t;
    fail(fmt::format("its header has a property of a type that is not known, '{}'", word.substr(0, 40)));
  }

  void read_header() {
    if (words_of(header_line()) != std::vector<std::string_view>{"ply"})
      fail("is no whole PLY file: its header must begin with 'ply' and end with a line 'end_header'");
    bool formed = false;
    for (;;) {
      const std::vector<std::string_view> w = words_of(header_line());
      if (w.empty() || w[0] == "comment" || w[0] == "obj_info") continue;
      if (w[0] == "end_header") break;
      if (w[0] == "format" && w.size() >= 2) {
        if (w[1] != "ascii" && w[1] != "binary_little_endian" && w[1] != "binary_big_endian")
          fail(fmt::format("its format '{}' is not known: ascii, binary_little_endian or binary_big_endian", w[1].substr(0, 40)));
        form_ = w[1] == "ascii" ? Form::text : w[1] == "binary_little_endian" ? Form::little : Form::big;
        formed = true;
      } else if (w[0] == "element" && w.size() == 3) {
        Element e;
        e.name = w[1];
        const auto [end, error] = std::from_chars(w[2].data(), w[2].data() + w[2].size(), e.count);
        if (error != std::errc() || end != w[2].data() + w[2].size() || e.count < 0)
          fail(fmt::format("its header has '{}' elements '{}'", w[2].substr(0, 40), w[1].substr(0, 40)));
        elements_.push_back(std::move(e));
      } else if (w[0] == "property" && !elements_.empty() && w.size() == 5 && w[1] == "list") {
        elements_.back().properties.push_back({std::string(w[4]), type_of(w[3]), type_of(w[2])});
      } else if (w[0] == "property" && !elements_.empty() && w.size() == 3) {
        elements_.back().properties.push_back({std::string(w[2]), type_of(w[1]), nullptr});
      } else if (w[0] == "format" || w[0] == "element" || w[0] == "property") {
        fail(fmt::format("its header has a line that is not known, beginning with '{}'", w[0].substr(0, 40)));
      } else {
        // Some programs write remarks without 'comment'.
        mesh_.warnings.push_back(
            fmt::format("its header has a line that is not known, beginning with '{}': passed over", w[0].substr(0, 40)));
      }
    }
    if (!formed) fail("its header has no line 'format'");
    for (const Element& e : elements_)
      if (e.properties.empty() && e.count > 0) fail(fmt::format("its elements '{}' have no properties", e.name));
  }

  [[noreturn]] void fail_cut() const {
    fail(fmt::format("is cut off: {} of {} elements '{}' are there", row_, element_->count, element_->name));
  }

  double number(const Type& type) {
    if (form_ == Form::text) {
      while (at_ < text_.size() && is_white(text_[at_])) ++at_;
      if (at_ == text_.size()) fail_cut();
      const char *begin = text_.data() + at_ + (text_[at_] == '+' ? 1 : 0), *last = text_.data() + text_.size();
      double value = 0.0;
      const auto [end, error] = std::from_chars(begin, last, value);
      std::size_t next = at_;
      while (next < text_.size() && !is_white(text_[next])) ++next;
      const std::string_view word = text_.substr(at_, next - at_);
      const bool tiny = error == std::errc::result_out_of_range && word.find("e-") != std::string_view::npos;
      if ((error != std::errc() && !tiny) || end != text_.data() + next)
        fail(fmt::format("element {} of '{}': '{}' is no number", row_ + 1, element_->name, word.substr(0, 40)));
      at_ = next;
      return tiny ? 0.0 : value;
    }
    if (text_.size() - at_ < static_cast<std::size_t>(type.bytes)) fail_cut();
    std::array<char, 8> raw{};
    std::copy_n(text_.data() + at_, type.bytes, raw.begin());
    at_ += static_cast<std::size_t>(type.bytes);
    if ((form_ == Form::little) != (std::endian::native == std::endian::little)) std::reverse(raw.begin(), raw.begin() + type.bytes);
    const auto as = [&]<class T>(T value) {
      std::memcpy(&value, raw.data(), sizeof value);
      return static_cast<double>(value);
    };
    if (type.real) return type.bytes == 4 ? as(float{}) : as(double{});
    switch (type.bytes) {
      case 1:
        return type.sign ? as(std::int8_t{}) : as(std::uint8_t{});
      case 2:
        return type.sign ? as(std::int16_t{}) : as(std::uint16_t{});
      default:
        return type.sign ? as(std::int32_t{}) : as(std::uint32_t{});
    }
  }

  long length(const Property& p) {
    const double count = number(*p.count);
    if (!(count >= 0.0) || count != std::floor(count) || count > static_cast<double>(text_.size()))
      fail(fmt::format("element {} of '{}': a list of {:g} numbers", row_ + 1, element_->name, count));
    return static_cast<long>(count);
  }

  void skip(const Property& p) {
    for (long n = p.count ? length(p) : 1; n > 0; --n) number(*p.type);
  }

  void read_vertex(const Element& element) {
    glm::dvec3 place(NAN);
    glm::vec3 color(NAN), normal(0.0f);
    static constexpr std::array<std::array<std::string_view, 3>, 3> names = {
        {{"x", "nx", "red"}, {"y", "ny", "green"}, {"z", "nz", "blue"}}};
    for (const Property& p : element.properties) {
      if (p.count) {
        skip(p);
        continue;
      }
      const double value = number(*p.type);
      for (int k = 0; k < 3; ++k) {
        if (p.name == names[k][0]) place[k] = value;
        else if (p.name == names[k][1]) normal[k] = static_cast<float>(value);
        else if (p.name == names[k][2] || p.name == "diffuse_" + std::string(names[k][2]))
          color[k] = static_cast<float>(std::clamp(value / p.type->largest, 0.0, 1.0));
      }
    }
    if (!std::isfinite(place.x) || !std::isfinite(place.y) || !std::isfinite(place.z))
      fail(fmt::format("vertex {} has a coordinate that is not finite", row_ + 1));
    if (too_far(place)) throw far_away(fmt::format("{}: vertex {}", file_, row_ + 1), place);
    mesh_.positions.push_back(place);
    if (color == color) mesh_.colors.push_back(color);
    const float size = glm::length(normal);
    normals_.push_back(std::isfinite(size) && size > 1e-20f ? normal / size : glm::vec3(0.0f));
  }

  // Faces, strips of triangles (-1 ends one) and whatever else is between them.
  void read_row(const Element& element) {
    for (const Property& p : element.properties) {
      if (!p.count || (p.name != "vertex_indices" && p.name != "vertex_index") || (element.name != "face" && element.name != "tristrips")) {
        skip(p);
        continue;
      }
      const long count = length(p);
      corners_.clear();
      for (long k = 0; k < count; ++k) {
        const double v = number(*p.type);
        if (v != std::floor(v) || std::abs(v) > 2147483647.0) fail(fmt::format("{} {} refers to vertex {:g}", element.name, row_ + 1, v));
        corners_.push_back(static_cast<int>(v));
      }
      if (element.name == "face") {
        if (count >= 3) add_face(corners_);
        else ++small_;
      } else {
        add_strips();
      }
    }
  }

  void add_face(const std::vector<int>& corners) {
    polygons_.corner.insert(polygons_.corner.end(), corners.begin(), corners.end());
    polygons_.begin.push_back(static_cast<int>(polygons_.corner.size()));
    polygons_.material.push_back(0);
  }

  void add_strips() {
    std::size_t first = 0;
    for (std::size_t k = 0; k < corners_.size(); ++k) {
      if (corners_[k] < 0) {
        first = k + 1;
      } else if (k >= first + 2) {
        const bool odd = (k - first) % 2 == 1;
        add_face({corners_[k - 2], corners_[odd ? k : k - 1], corners_[odd ? k - 1 : k]});
      }
    }
  }

  // Behind all elements: faces may stand before the vertices.
  void check_corners() {
    const auto count = static_cast<int>(mesh_.positions.size());
    if (count == 0) fail("the file holds no vertices");
    for (std::size_t f = 0; f + 1 < polygons_.begin.size(); ++f)
      for (int c = polygons_.begin[f]; c < polygons_.begin[f + 1]; ++c)
        if (polygons_.corner[c] < 0 || polygons_.corner[c] >= count)
          fail(fmt::format("face {} refers to vertex {} (counted from 0), the file has {}", f + 1, polygons_.corner[c], count));
    if (mesh_.colors.size() != mesh_.positions.size()) mesh_.colors.clear();
    if (std::any_of(normals_.begin(), normals_.end(), [](const glm::vec3& n) { return n != glm::vec3(0.0f); }))
      for (const int v : polygons_.corner) polygons_.corner_normal.push_back(normals_[v]);
    if (small_ > 0) mesh_.warnings.push_back(fmt::format("{} face(s) with fewer than three corners were left out", small_));
  }

  const std::string file_;
  std::string_view text_;
  Mesh& mesh_;
  Polygons& polygons_;
  std::size_t at_ = 0;
  Form form_ = Form::text;
  std::vector<Element> elements_;
  const Element* element_ = nullptr;  // that is read
  long row_ = 0, small_ = 0;
  std::vector<glm::vec3> normals_;
  std::vector<int> corners_;
};

}  // namespace

Mesh read_ply(const fs::path& path, const MeshOptions& options) {
  Mesh mesh;
  mesh.name = path.filename().string();
  mesh.materials.emplace_back();
  Polygons polygons;
  const std::string text = read_text(path);
  PlyReader reader(path.string(), text, mesh, polygons);
  reader.read();
  finish_mesh(std::move(polygons), options, mesh, fmt::format("{}: no face with three different corners", path.string()));
  if (reader.single()) tell_of_steps(mesh);
  return mesh;
}

}  // namespace flexframe::render
