#include "render/picture/mesh.h"

#include "render/base/file.h"

#include <assimp/DefaultIOSystem.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <span>
#include <string_view>
#include <utility>

namespace flexframe::render {
namespace {

namespace fs = std::filesystem;

std::string read_text(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) throw MeshError(fmt::format("{}: no such mesh file", path.string()));
  if (fs::is_directory(path, error)) throw MeshError(fmt::format("{}: is a folder, a mesh file is needed", path.string()));
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw MeshError(fmt::format("{}: cannot be opened for reading", path.string()));
  const auto size = static_cast<std::streamoff>(file.tellg());
  std::string text(static_cast<size_t>(std::max<std::streamoff>(size, 0)), '\0');
  file.seekg(0);
  file.read(text.data(), size);
  if (!file) throw MeshError(fmt::format("{}: cannot be read to its end", path.string()));
  if (text.empty()) throw MeshError(fmt::format("{}: the file is empty", path.string()));
  return text;
}

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

// The vertex lines of an OBJ file, checked, and the same file for assimp with each vertex replaced by its own number: assimp
// keeps numbers below 2^20 exactly, so that its vertices tell which line they come from.
struct ObjScan {
  std::vector<glm::dvec3> positions;
  std::vector<glm::vec3> colors;
  std::string numbered;
  long faces = 0;
};

constexpr int number_bits = 20;

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

// Largest coordinate, m: a light month. Areas and squares of lengths stay far inside single precision, in which pictures are drawn.
constexpr double largest_coordinate = 1e15;

bool too_far(const glm::dvec3& p) { return !(std::abs(p.x) <= largest_coordinate && std::abs(p.y) <= largest_coordinate && std::abs(p.z) <= largest_coordinate); }

MeshError far_away(const std::string& vertex, const glm::dvec3& p) {
  return MeshError(fmt::format("{} ({:g}, {:g}, {:g}) lies beyond {:g}", vertex, p.x, p.y, p.z, largest_coordinate));
}

// Index of one corner "v/vt/vn": checks the part given against the count so far (negative) or at the end of the file.
void check_index(std::string_view part, long so_far, long in_all, const char* what, const std::string& file, long line) {
  if (part.empty()) return;
  if (part.front() == '+') part.remove_prefix(1);
  long index = 0;
  const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), index);
  if (error != std::errc{} || end != part.data() + part.size())
    throw MeshError(fmt::format("{}:{}: face corner '{}' is no index", file, line, shown(part)));
  if (index == 0) throw MeshError(fmt::format("{}:{}: face refers to {} 0, indices start at 1", file, line, what));
  if (index < 0 && -index > so_far)
    throw MeshError(fmt::format("{}:{}: face refers to {} {}, only {} lie before this line", file, line, what, index, so_far));
  if (index > in_all) throw MeshError(fmt::format("{}:{}: face refers to {} {}, the file has {}", file, line, what, index, in_all));
}

// Calls visit(keyword, rest, line number, raw text) for each logical line; a backslash at the end joins the next line.
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
        if (begin >= text.size()) { line = {}; break; }
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
    visit(keyword, rest, first, line);
  }
}

ObjScan scan_obj(std::string_view text, const std::string& file) {
  // Counts first, since faces may refer to vertices further down.
  long in_all_v = 0, in_all_vt = 0, in_all_vn = 0;
  for_each_line(text, [&](std::string_view keyword, std::string_view, long, std::string_view) {
    in_all_v += keyword == "v";
    in_all_vt += keyword == "vt";
    in_all_vn += keyword == "vn";
  });
  if (in_all_v >= (1L << (2 * number_bits - 9))) throw MeshError(fmt::format("{}: {} vertices are too many", file, in_all_v));

  ObjScan scan;
  scan.positions.reserve(static_cast<size_t>(in_all_v));
  scan.numbered.reserve(text.size());
  long vt = 0, vn = 0;
  // A stray carriage return or zero byte in a name would end the line for assimp, and what follows be read as another.
  auto copy = [&](std::string_view line) {
    for (const char c : line) scan.numbered.push_back(static_cast<unsigned char>(c) < ' ' && c != '\t' ? '_' : c);
    scan.numbered.push_back('\n');
  };
  for_each_line(text, [&](std::string_view keyword, std::string_view rest, long line, std::string_view raw) {
    if (keyword == "v") {
      std::array<double, 7> value{};
      size_t count = 0;
      for (std::string_view word = next_word(rest); !word.empty() && word.front() != '#' && count < 7; word = next_word(rest))
        value[count++] = parse_number(word, file, line, "coordinate");
      if (count < 3) throw MeshError(fmt::format("{}:{}: a vertex needs x y z, this line has {} number(s)", file, line, count));
      glm::dvec3 p(value[0], value[1], value[2]);
      if (count == 4 && value[3] != 0.0) p /= value[3];
      if (too_far(p)) throw far_away(fmt::format("{}:{}: vertex", file, line), p);
      const auto index = static_cast<long>(scan.positions.size());
      scan.positions.push_back(p);
      if (count >= 6) {
        scan.colors.resize(static_cast<size_t>(index), glm::vec3(1.0f));
        const size_t at = count == 7 ? 4 : 3;
        scan.colors.emplace_back(value[at], value[at + 1], value[at + 2]);
      }
      fmt::format_to(std::back_inserter(scan.numbered), "v {} {} 0\n", index & ((1L << number_bits) - 1), index >> number_bits);
    } else if (keyword == "f" || keyword == "fo") {
      int corners = 0;
      scan.numbered.append("f");
      for (std::string_view word = next_word(rest); !word.empty() && word.front() != '#'; word = next_word(rest)) {
        const std::string_view whole = word;
        std::array<std::string_view, 3> part;
        for (size_t k = 0; k < 3; ++k) {
          const size_t slash = word.find('/');
          part[k] = word.substr(0, slash);
          word = slash == std::string_view::npos ? std::string_view{} : word.substr(slash + 1);
        }
        if (part[0].empty()) throw MeshError(fmt::format("{}:{}: face corner '{}' has no vertex", file, line, shown(whole)));
        check_index(part[0], static_cast<long>(scan.positions.size()), in_all_v, "vertex", file, line);
        check_index(part[1], vt, in_all_vt, "texture coordinate", file, line);
        check_index(part[2], vn, in_all_vn, "normal", file, line);
        scan.numbered.append(" ").append(part[0]);
        if (!part[2].empty()) scan.numbered.append("//").append(part[2]);
        ++corners;
      }
      scan.numbered.push_back('\n');
      scan.faces += corners >= 3;
    } else if (keyword == "vt") {
      ++vt;
    } else if (keyword == "vn") {
      ++vn;
      glm::dvec3 n(0.0);
      for (int k = 0; k < 3; ++k) {
        const std::string_view word = next_word(rest);
        if (word.empty()) throw MeshError(fmt::format("{}:{}: a normal needs x y z", file, line));
        n[k] = parse_number(word, file, line, "normal");
      }
      copy(raw);
    } else if (keyword == "g" || keyword == "o" || keyword == "usemtl" || keyword == "mtllib") {
      copy(raw);
    }
  });
  if (!scan.colors.empty()) scan.colors.resize(scan.positions.size(), glm::vec3(1.0f));
  return scan;
}

// Serves one file from memory and the rest (material libraries) from the disk.
class MemoryFirst : public Assimp::DefaultIOSystem {
public:
  MemoryFirst(std::string name, const std::string& text) : name_(std::move(name)), text_(text) {}
  bool Exists(const char* file) const override { return name_ == file || DefaultIOSystem::Exists(file); }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    if (name_ == file) return new Assimp::MemoryIOStream(reinterpret_cast<const uint8_t*>(text_.data()), text_.size());
    return DefaultIOSystem::Open(file, mode);
  }

private:
  std::string name_;
  const std::string& text_;
};

struct Polygons {
  std::vector<int> corner, begin{0}, material;  // corners of polygon k: begin[k]..begin[k+1]
  std::vector<glm::vec3> corner_normal;         // per corner, or empty
};

glm::dvec3 newell_normal(const std::vector<glm::dvec3>& position, std::span<const int> corner) {
  glm::dvec3 n(0.0);
  const glm::dvec3 origin = position[static_cast<size_t>(corner[0])];
  for (size_t k = 0; k < corner.size(); ++k) {
    const glm::dvec3 a = position[static_cast<size_t>(corner[k])] - origin;
    const glm::dvec3 b = position[static_cast<size_t>(corner[(k + 1) % corner.size()])] - origin;
    n += glm::cross(a, b);
  }
  return n;
}

// Cuts a simple polygon into triangles by ears (Meisters 1975), quads by the better diagonal. Appends local corner triples.
void triangulate(const std::vector<glm::dvec3>& position, std::span<const int> corner, std::vector<std::array<int, 3>>& out) {
  const int n = static_cast<int>(corner.size());
  if (n == 3) { out.push_back({0, 1, 2}); return; }
  const glm::dvec3 normal = newell_normal(position, corner);
  auto at = [&](int k) { return position[static_cast<size_t>(corner[static_cast<size_t>(k)])]; };
  auto turn = [&](int a, int b, int c) { return glm::dot(normal, glm::cross(at(b) - at(a), at(c) - at(a))); };
  if (n == 4) {
    // A diagonal is inside if both its triangles turn the polygon's way; the shorter of two such.
    const double across02 = std::min(turn(0, 1, 2), turn(0, 2, 3)), across13 = std::min(turn(0, 1, 3), turn(1, 2, 3));
    const bool convex = across02 > 0.0 && across13 > 0.0;
    const bool cut02 = convex ? glm::length(at(0) - at(2)) <= glm::length(at(1) - at(3)) : across02 >= across13;
    if (cut02) { out.push_back({0, 1, 2}); out.push_back({0, 2, 3}); }
    else { out.push_back({0, 1, 3}); out.push_back({1, 2, 3}); }
    return;
  }
  std::vector<int> ring(static_cast<size_t>(n));
  for (int k = 0; k < n; ++k) ring[static_cast<size_t>(k)] = k;
  size_t start = 0;
  for (size_t m = ring.size(); m > 3; m = ring.size()) {
    size_t ear = m;
    for (size_t step = 0; step < m && ear == m; ++step) {
      const size_t k = (start + step) % m;
      const int a = ring[(k + m - 1) % m], b = ring[k], c = ring[(k + 1) % m];
      if (turn(a, b, c) <= 0.0) continue;
      bool empty = true;
      for (size_t j = 0; j < m && empty; ++j) {
        const int p = ring[j];
        if (p == a || p == b || p == c || at(p) == at(a) || at(p) == at(b) || at(p) == at(c)) continue;
        empty = !(turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0);
      }
      if (empty) ear = k;
    }
    // Self-crossing or flat polygons have no ear: any corner will do.
    if (ear == m) ear = start % m;
    out.push_back({ring[(ear + m - 1) % m], ring[ear], ring[(ear + 1) % m]});
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(ear));
    start = ear;
  }
  out.push_back({ring[0], ring[1], ring[2]});
}

void add_triangles(Mesh& mesh, const Polygons& polygons, std::vector<glm::vec3>& corner_normals) {
  const bool normals = !polygons.corner_normal.empty();
  std::vector<std::array<int, 3>> cut;
  std::vector<int> corner, source;
  long degenerate = 0;
  bool whole = true;
  for (size_t f = 0; f + 1 < polygons.begin.size(); ++f) {
    corner.clear();
    source.clear();
    // Repeated corners of a face carry no surface.
    for (int c = polygons.begin[f]; c < polygons.begin[f + 1]; ++c) {
      const int v = polygons.corner[static_cast<size_t>(c)];
      if (!corner.empty() && (corner.back() == v)) continue;
      corner.push_back(v);
      source.push_back(c);
    }
    while (corner.size() > 1 && corner.back() == corner.front()) { corner.pop_back(); source.pop_back(); }
    if (corner.size() < 3) { ++degenerate; continue; }
    cut.clear();
    triangulate(mesh.positions, corner, cut);
    for (const auto& t : cut) {
      const glm::ivec3 local(t[0], t[1], t[2]);
      glm::ivec3 triangle;
      for (int k = 0; k < 3; ++k) triangle[k] = corner[static_cast<size_t>(local[k])];
      if (triangle.x == triangle.y || triangle.y == triangle.z || triangle.z == triangle.x) continue;
      mesh.triangles.push_back(triangle);
      mesh.triangle_material.push_back(polygons.material[f]);
      // Corners that follow each other around the face.
      unsigned edges = 0;
      const int n = static_cast<int>(corner.size());
      for (int k = 0; k < 3; ++k) {
        const int step = std::abs(local[(k + 1) % 3] - local[k]);
        if (step == 1 || step == n - 1) edges |= 1u << k;
      }
      whole = whole && edges == 7u;
      mesh.triangle_edges.push_back(static_cast<std::uint8_t>(edges));
      if (normals)
        for (int k = 0; k < 3; ++k)
          corner_normals.push_back(polygons.corner_normal[static_cast<size_t>(source[static_cast<size_t>(local[k])])]);
    }
  }
  // A file of triangles needs no record.
  if (whole) mesh.triangle_edges.clear();
  if (degenerate > 0) mesh.warnings.push_back(fmt::format("{} face(s) with fewer than three different corners were left out", degenerate));
}

MeshMaterial convert_material(const aiMaterial& from) {
  MeshMaterial material;
  aiString name;
  if (from.Get(AI_MATKEY_NAME, name) == AI_SUCCESS) material.name = name.C_Str();
  aiColor3D color;
  const bool unnamed = material.name.empty() || material.name == AI_DEFAULT_MATERIAL_NAME || material.name == "DefaultMaterial";
  aiColor4D base;
  if (!unnamed && from.Get(AI_MATKEY_BASE_COLOR, base) == AI_SUCCESS)
    material.look.color = {base.r, base.g, base.b};
  else if (!unnamed && from.Get(AI_MATKEY_COLOR_DIFFUSE, color) == AI_SUCCESS)
    material.look.color = {color.r, color.g, color.b};
  for (int k = 0; k < 3; ++k)
    material.look.color[k] = std::isfinite(material.look.color[k]) ? std::clamp(material.look.color[k], 0.0f, 1.0f) : 0.7f;
  float value = 0.0f;
  if (from.Get(AI_MATKEY_OPACITY, value) == AI_SUCCESS && std::isfinite(value)) material.opacity = std::clamp(value, 0.0f, 1.0f);
  if (from.Get(AI_MATKEY_ROUGHNESS_FACTOR, value) == AI_SUCCESS && std::isfinite(value))
    material.look.roughness = std::clamp(value, 0.0f, 1.0f);
  // Blinn-Phong exponent to roughness: alpha^2 = 2 / (Ns + 2), alpha = roughness^2 (Walter et al. 2007). An exponent of 0 is no statement.
  else if (from.Get(AI_MATKEY_SHININESS, value) == AI_SUCCESS && std::isfinite(value) && value > 0.0f)
    material.look.roughness = std::clamp(std::pow(2.0f / (value + 2.0f), 0.25f), 0.05f, 1.0f);
  if (from.Get(AI_MATKEY_METALLIC_FACTOR, value) == AI_SUCCESS && std::isfinite(value)) material.look.metallic = std::clamp(value, 0.0f, 1.0f);
  return material;
}

std::vector<MeshMaterial> convert_materials(const aiScene& scene) {
  std::vector<MeshMaterial> materials;
  for (unsigned k = 0; k < scene.mNumMaterials; ++k) materials.push_back(convert_material(*scene.mMaterials[k]));
  if (materials.empty()) materials.emplace_back();
  return materials;
}

// One mesh of the scene below a node's transform.
struct Placed {
  const aiMesh* mesh;
  aiMatrix4x4 transform;
};

void collect(const aiScene& scene, const aiNode& node, const aiMatrix4x4& above, std::vector<Placed>& out) {
  const aiMatrix4x4 here = above * node.mTransformation;
  for (unsigned k = 0; k < node.mNumMeshes; ++k) out.push_back({scene.mMeshes[node.mMeshes[k]], here});
  for (unsigned k = 0; k < node.mNumChildren; ++k) collect(scene, *node.mChildren[k], here, out);
}

void add_faces(const aiMesh& from, const std::vector<int>& index, const aiMatrix3x3* turn, Polygons& polygons) {
  for (unsigned f = 0; f < from.mNumFaces; ++f) {
    const aiFace& face = from.mFaces[f];
    if (face.mNumIndices < 3) continue;  // points and lines
    for (unsigned k = 0; k < face.mNumIndices; ++k) {
      const unsigned v = face.mIndices[k];
      polygons.corner.push_back(index[v]);
      glm::vec3 n(0.0f);
      if (from.mNormals != nullptr) {
        aiVector3D normal = from.mNormals[v];
        if (turn != nullptr) normal = *turn * normal;
        const float length = normal.Length();
        if (std::isfinite(length) && length > 1e-20f) n = glm::vec3(normal.x, normal.y, normal.z) / length;
      }
      polygons.corner_normal.push_back(n);
    }
    polygons.begin.push_back(static_cast<int>(polygons.corner.size()));
    polygons.material.push_back(static_cast<int>(from.mMaterialIndex));
  }
}

// Corner normals help only if every corner has one.
void drop_partial_normals(Polygons& polygons) {
  for (const glm::vec3& n : polygons.corner_normal)
    if (n == glm::vec3(0.0f)) { polygons.corner_normal.clear(); return; }
}

Mesh read_obj(const fs::path& path, const MeshOptions& options) {
  const std::string file = path.string();
  Mesh mesh;
  mesh.name = path.filename().string();
  Polygons polygons;
  {
    std::string text = read_text(path);
    // Old Mac files: bare carriage returns end the lines.
    if (text.find('\n') == std::string::npos) std::replace(text.begin(), text.end(), '\r', '\n');
    ObjScan scan = scan_obj(text, file);
    text = {};
    if (scan.positions.empty()) throw MeshError(fmt::format("{}: no vertices ('v' lines) found, this is no Wavefront mesh", file));
    if (scan.faces == 0)
      throw MeshError(fmt::format("{}: {} vertices but no face with three corners or more ('f' lines)", file, scan.positions.size()));
    mesh.positions = std::move(scan.positions);
    mesh.colors = std::move(scan.colors);

    Assimp::Importer importer;
    importer.SetIOHandler(new MemoryFirst(file, scan.numbered));
    const aiScene* scene = importer.ReadFile(file, 0);
    if (scene == nullptr) throw MeshError(fmt::format("{}: {}", file, importer.GetErrorString()));
    mesh.materials = convert_materials(*scene);
    std::vector<int> index;
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
      const aiMesh& from = *scene->mMeshes[m];
      index.resize(from.mNumVertices);
      for (unsigned v = 0; v < from.mNumVertices; ++v)
        index[v] = static_cast<int>(from.mVertices[v].x) + (static_cast<int>(from.mVertices[v].y) << number_bits);
      for (const int v : index)
        if (v < 0 || static_cast<size_t>(v) >= mesh.positions.size()) throw MeshError(fmt::format("{}: its lines are read differently than they stand there; control characters?", file));
      add_faces(from, index, nullptr, polygons);
    }
  }
  drop_partial_normals(polygons);
  std::vector<glm::vec3> corner_normals;
  add_triangles(mesh, polygons, corner_normals);
  if (mesh.triangles.empty()) throw MeshError(fmt::format("{}: every face is degenerate, no triangle is left", file));
  compute_shading_points(mesh, corner_normals, options.crease_angle);
  return mesh;
}

Mesh read_other(const fs::path& path, const MeshOptions& options) {
  const std::string file = path.string();
  read_text(path);
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(file, 0);
  if (scene == nullptr || scene->mRootNode == nullptr) throw MeshError(fmt::format("{}: {}", file, importer.GetErrorString()));
  Mesh mesh;
  mesh.name = path.filename().string();
  mesh.materials = convert_materials(*scene);
  std::vector<Placed> placed;
  collect(*scene, *scene->mRootNode, aiMatrix4x4(), placed);
  Polygons polygons;
  std::vector<int> index;
  for (const Placed& part : placed) {
    const aiMesh& from = *part.mesh;
    index.resize(from.mNumVertices);
    const size_t first = mesh.positions.size();
    for (unsigned v = 0; v < from.mNumVertices; ++v) {
      const aiVector3D p = part.transform * from.mVertices[v];
      if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
        throw MeshError(fmt::format("{}: vertex {} has a coordinate that is not finite", file, mesh.positions.size() + 1));
      index[v] = static_cast<int>(mesh.positions.size());
      mesh.positions.emplace_back(p.x, p.y, p.z);
      if (too_far(mesh.positions.back())) throw far_away(fmt::format("{}: vertex {}", file, mesh.positions.size()), mesh.positions.back());
    }
    if (from.HasVertexColors(0)) {
      mesh.colors.resize(first, glm::vec3(1.0f));
      for (unsigned v = 0; v < from.mNumVertices; ++v) mesh.colors.emplace_back(from.mColors[0][v].r, from.mColors[0][v].g, from.mColors[0][v].b);
    }
    aiMatrix3x3 turn = aiMatrix3x3(part.transform);
    const bool mirrored = turn.Determinant() < 0.0f;
    turn.Inverse().Transpose();
    const size_t begin = polygons.corner.size();
    add_faces(from, index, &turn, polygons);
    // A mirroring transform turns the faces inside out.
    if (mirrored)
      for (size_t f = 0; f + 1 < polygons.begin.size(); ++f)
        if (static_cast<size_t>(polygons.begin[f]) >= begin) {
          std::reverse(polygons.corner.begin() + polygons.begin[f], polygons.corner.begin() + polygons.begin[f + 1]);
          std::reverse(polygons.corner_normal.begin() + polygons.begin[f], polygons.corner_normal.begin() + polygons.begin[f + 1]);
        }
  }
  if (!mesh.colors.empty()) mesh.colors.resize(mesh.positions.size(), glm::vec3(1.0f));
  if (mesh.positions.empty()) throw MeshError(fmt::format("{}: the file holds no vertices", file));
  // STL gives every facet its flat normal, which says nothing about creases.
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".stl") polygons.corner_normal.clear();
  drop_partial_normals(polygons);
  std::vector<glm::vec3> corner_normals;
  add_triangles(mesh, polygons, corner_normals);
  if (mesh.triangles.empty()) throw MeshError(fmt::format("{}: no face with three different corners", file));
  compute_shading_points(mesh, corner_normals, options.crease_angle);
  return mesh;
}

}  // namespace

Mesh read_mesh(const fs::path& path, const MeshOptions& options) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".obj" ? read_obj(path, options) : read_other(path, options);
}

Mesh make_mesh(std::vector<glm::dvec3> positions, std::vector<glm::ivec3> triangles, const std::string& name, const MeshOptions& options) {
  Mesh mesh;
  mesh.name = name;
  const int count = static_cast<int>(positions.size());
  if (count == 0) throw MeshError(fmt::format("{}: no vertices", name));
  if (triangles.empty()) throw MeshError(fmt::format("{}: no triangles", name));
  for (size_t v = 0; v < positions.size(); ++v)
    for (int k = 0; k < 3; ++k)
      if (!std::isfinite(positions[v][k])) throw MeshError(fmt::format("{}: vertex {} has a coordinate that is not finite", name, v));
  for (size_t t = 0; t < triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      if (triangles[t][k] < 0 || triangles[t][k] >= count)
        throw MeshError(fmt::format("{}: triangle {} refers to vertex {}, there are {}", name, t, triangles[t][k], count));
  mesh.positions = std::move(positions);
  mesh.triangles = std::move(triangles);
  mesh.triangle_material.assign(mesh.triangles.size(), 0);
  mesh.materials.emplace_back();
  compute_shading_points(mesh, {}, options.crease_angle);
  return mesh;
}

Bounds compute_bounds(const Mesh& mesh) {
  Bounds bounds;
  for (const glm::dvec3& p : mesh.positions) bounds.add(p);
  return bounds;
}

void write_obj(const fs::path& path, const Mesh& mesh, const std::vector<glm::dvec3>& positions) {
  fmt::memory_buffer text;
  for (const glm::dvec3& p : positions) fmt::format_to(std::back_inserter(text), "v {:.17g} {:.17g} {:.17g}\n", p.x, p.y, p.z);
  for (const glm::ivec3& t : mesh.triangles) fmt::format_to(std::back_inserter(text), "f {} {} {}\n", t.x + 1, t.y + 1, t.z + 1);
  write_file(path, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

}  // namespace flexframe::render
