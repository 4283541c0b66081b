#include "render/picture/mesh.h"

#include "render/base/file.h"
#include "render/base/srgb.h"
#include "render/picture/ears.h"
#include "render/picture/mesh_polygons.h"

#include <assimp/GltfMaterial.h>
#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <span>
#include <string_view>
#include <utility>

namespace flexframe::render {
namespace {

namespace fs = std::filesystem;

// Corner normals help only if every corner has one.
void drop_partial_normals(Polygons& polygons) {
  for (const glm::vec3& n : polygons.corner_normal)
    if (n == glm::vec3(0.0f)) {
      polygons.corner_normal.clear();
      return;
    }
}

glm::dvec3 newell_normal(const std::vector<glm::dvec3>& position, std::span<const int> corner) {
  glm::dvec3 n(0.0);
  const glm::dvec3 origin = position[corner[0]];
  for (size_t k = 0; k < corner.size(); ++k) {
    const glm::dvec3 a = position[corner[k]] - origin;
    const glm::dvec3 b = position[corner[(k + 1) % corner.size()]] - origin;
    n += glm::cross(a, b);
  }
  return n;
}

// Cuts a simple polygon into triangles by ears, quads by the better diagonal. Appends local corner triples.
void triangulate(const std::vector<glm::dvec3>& position, std::span<const int> corner, std::vector<std::array<int, 3>>& out) {
  const int n = static_cast<int>(corner.size());
  if (n == 3) {
    out.push_back({0, 1, 2});
    return;
  }
  const glm::dvec3 normal = newell_normal(position, corner);
  auto at = [&](int k) { return position[corner[k]]; };
  auto turn = [&](int a, int b, int c) { return glm::dot(normal, glm::cross(at(b) - at(a), at(c) - at(a))); };
  if (n == 4) {
    // A diagonal is inside if both its triangles turn the polygon's way; the shorter of two such.
    const double across02 = std::min(turn(0, 1, 2), turn(0, 2, 3)), across13 = std::min(turn(0, 1, 3), turn(1, 2, 3));
    const bool convex = across02 > 0.0 && across13 > 0.0;
    const bool cut02 = convex ? glm::length(at(0) - at(2)) <= glm::length(at(1) - at(3)) : across02 >= across13;
    if (cut02) {
      out.push_back({0, 1, 2});
      out.push_back({0, 2, 3});
    } else {
      out.push_back({0, 1, 3});
      out.push_back({1, 2, 3});
    }
    return;
  }
  std::vector<int> ring(n);
  for (int k = 0; k < n; ++k) ring[k] = k;
  const auto same = [&](int a, int b) { return at(a) == at(b); };
  const auto any_ear = [](int, int, int, double area) { return area > 0.0 ? 1.0 : -1.0; };
  size_t start = 0;
  for (size_t m = ring.size(); m > 3; m = ring.size()) {
    size_t ear = find_ear(ring, start, turn, same, any_ear);
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
      const int v = polygons.corner[c];
      if (!corner.empty() && (corner.back() == v)) continue;
      corner.push_back(v);
      source.push_back(c);
    }
    while (corner.size() > 1 && corner.back() == corner.front()) {
      corner.pop_back();
      source.pop_back();
    }
    if (corner.size() < 3) {
      ++degenerate;
      continue;
    }
    cut.clear();
    triangulate(mesh.positions, corner, cut);
    for (const auto& t : cut) {
      const glm::ivec3 local(t[0], t[1], t[2]);
      glm::ivec3 triangle;
      for (int k = 0; k < 3; ++k) triangle[k] = corner[local[k]];
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
        for (int k = 0; k < 3; ++k) corner_normals.push_back(polygons.corner_normal[source[local[k]]]);
    }
  }
  // A file of triangles needs no record.
  if (whole) mesh.triangle_edges.clear();
  if (degenerate > 0) mesh.warnings.push_back(fmt::format("{} face(s) with fewer than three different corners were left out", degenerate));
}

// Colours of glTF are linear light.
MeshMaterial convert_material(const aiMaterial& from, bool linear) {
  MeshMaterial material;
  aiString name;
  if (from.Get(AI_MATKEY_NAME, name) == AI_SUCCESS) material.name = name.C_Str();
  aiColor3D color;
  const bool unnamed = material.name.empty() || material.name == AI_DEFAULT_MATERIAL_NAME || material.name == "DefaultMaterial";
  aiColor4D base;
  if (!unnamed && from.Get(AI_MATKEY_BASE_COLOR, base) == AI_SUCCESS) material.look.color = {base.r, base.g, base.b};
  else if (!unnamed && from.Get(AI_MATKEY_COLOR_DIFFUSE, color) == AI_SUCCESS) material.look.color = {color.r, color.g, color.b};
  for (int k = 0; k < 3; ++k)
    material.look.color[k] = std::isfinite(material.look.color[k]) ? std::clamp(material.look.color[k], 0.0f, 1.0f) : 0.7f;
  if (linear && !unnamed) material.look.color = srgb_from_linear(material.look.color);
  float value = 0.0f;
  if (from.Get(AI_MATKEY_OPACITY, value) == AI_SUCCESS && std::isfinite(value)) material.opacity = std::clamp(value, 0.0f, 1.0f);
  if (from.Get(AI_MATKEY_ROUGHNESS_FACTOR, value) == AI_SUCCESS && std::isfinite(value))
    material.look.roughness = std::clamp(value, 0.0f, 1.0f);
  // An exponent of 0 is no statement.
  else if (from.Get(AI_MATKEY_SHININESS, value) == AI_SUCCESS && std::isfinite(value) && value > 0.0f)
    material.look.roughness = roughness_of_exponent(value);
  if (from.Get(AI_MATKEY_METALLIC_FACTOR, value) == AI_SUCCESS && std::isfinite(value))
    material.look.metallic = std::clamp(value, 0.0f, 1.0f);
  aiString alpha;
  if (from.Get(AI_MATKEY_GLTF_ALPHAMODE, alpha) == AI_SUCCESS && alpha == aiString("OPAQUE")) material.opacity = 1.0f;
  return material;
}

std::vector<MeshMaterial> convert_materials(const aiScene& scene, bool linear) {
  std::vector<MeshMaterial> materials;
  for (unsigned k = 0; k < scene.mNumMaterials; ++k) materials.push_back(convert_material(*scene.mMaterials[k], linear));
  if (materials.empty()) materials.emplace_back();
  return materials;
}

// Textures are not drawn; of what they are made of an average would be a guess.
void warn_of_textures(const aiScene& scene, Mesh& mesh) {
  for (unsigned k = 0; k < scene.mNumMaterials; ++k)
    for (const aiTextureType type : {aiTextureType_DIFFUSE, aiTextureType_BASE_COLOR, aiTextureType_NORMALS, aiTextureType_HEIGHT,
                                     aiTextureType_METALNESS, aiTextureType_DIFFUSE_ROUGHNESS, aiTextureType_OPACITY})
      if (scene.mMaterials[k]->GetTextureCount(type) > 0) {
        mesh.warnings.emplace_back("its textures are not drawn; its materials show their plain colour");
        return;
      }
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

}  // namespace

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

MeshError far_away(const std::string& vertex, const glm::dvec3& p) {
  return MeshError(fmt::format("{} ({:g}, {:g}, {:g}) lies beyond {:g}", vertex, p.x, p.y, p.z, largest_coordinate));
}

namespace {

// Not where all corners of each lie on a line or on each other.
bool has_area(const Mesh& mesh) {
  return std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const glm::ivec3& t) {
    const glm::dvec3 a = mesh.positions[t.x];
    return glm::cross(mesh.positions[t.y] - a, mesh.positions[t.z] - a) != glm::dvec3(0.0);
  });
}

}  // namespace

// Formats that are read in single precision: far from the origin corners move, a pixel of a picture that the mesh fills or more.
void tell_of_steps(Mesh& mesh) {
  const Bounds box = compute_bounds(mesh);
  const double far = std::max(glm::length(box.lower), glm::length(box.upper)), size = glm::length(box.upper - box.lower);
  if (!(single_precision * far > 1e-3 * size)) return;
  mesh.faults.push_back(
      fmt::format("its corners, up to {:.3g} from the origin, are read in single precision, in steps of {:.2g}, and it is {:.3g} large: a "
                  "Wavefront file (.obj) keeps all digits, or move it to the origin before it is written",
                  far, single_precision * far, size));
}

void finish_mesh(Polygons polygons, const MeshOptions& options, Mesh& mesh, const std::string& nothing_left) {
  drop_partial_normals(polygons);
  std::vector<glm::vec3> corner_normals;
  add_triangles(mesh, polygons, corner_normals);
  if (mesh.triangles.empty()) throw MeshError(nothing_left);
  if (!has_area(mesh)) mesh.faults.emplace_back("none of its triangles has an area: nothing of it is seen");
  compute_shading_points(mesh, corner_normals, options.crease_angle);
}

namespace {

// Directions of facets that are no numbers as C writes them (1.#QNAN, -nan(ind)), of text in small letters: zeros in their place, which
// nobody uses.
void mend_directions(std::string& text) {
  constexpr std::string_view word = "facet normal", zeros = " 0 0 0";
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at)) {
    at += word.size();
    const std::size_t end = std::min(text.find_first_of("\r\n", at), text.size());
    const std::string_view rest = std::string_view(text).substr(at, end - at);
    if (rest.size() < zeros.size() || rest.find_first_of("#(") == std::string_view::npos) continue;
    text.replace(at, end - at, std::string(zeros).append(rest.size() - zeros.size(), ' '));
  }
}

// The bytes of an STL file as assimp takes them: text in small letters, a binary file without what is behind its triangles. Throws
// MeshError for what is neither.
std::string stl_bytes(const std::string& file, std::string text) {
  constexpr std::size_t head = 84, triangle = 50;
  if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);
  std::uint32_t count = 0;
  if (text.size() >= head)
    for (int k = 3; k >= 0; --k) count = count << 8 | static_cast<unsigned char>(text[80 + static_cast<std::size_t>(k)]);
  const std::size_t wanted = head + triangle * count;
  // Some programs begin binary files with "solid" too; a count below 16 million has a byte of zero.
  const bool binary = text.find('\0') < 1000;
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (!binary && begin != std::string::npos) {
    text.erase(0, begin);
    for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    mend_directions(text);
    if (text.starts_with("solid")) return text;
  }
  if (text.size() >= head && text.size() >= wanted && count > 0) return text.substr(0, wanted);
  if (binary && text.size() >= head)
    throw MeshError(
        fmt::format("{}: is no whole STL file: it does not begin with 'solid', and as a binary file of {} triangles it would have {} "
                    "bytes; it has {}",
                    file, count, wanted, text.size()));
  throw MeshError(fmt::format("{}: is no STL file: text that begins with 'solid', or 84 bytes and 50 a triangle, are expected", file));
}

// Formats that say their unit, of which the numbers alone are read (glTF is in metres, Collada's unit is counted, STL has none).
void tell_of_units(const std::string& ending, Mesh& mesh) {
  for (const char* known : {".stl", ".gltf", ".glb", ".dae"})
    if (ending == known) return;
  mesh.faults.push_back(
      fmt::format("files of {} may say their unit{} and which way is up, neither of which is read: its numbers count as metres, or in the "
                  "unit that the scene gives",
                  ending, ending == ".3mf" ? " (millimetres where they name none)" : ""));
}

// Objects in files of their own within a 3MF file (its production extension) are not followed, and assimp crashes on some of them.
void refuse_scattered(const std::string& file, std::string_view zip) {
  constexpr std::string_view entry = "PK\1\2";  // of the table of contents: the length of the name stands at 28, the name at 46
  int models = 0;
  for (std::size_t at = zip.find(entry); at != std::string_view::npos; at = zip.find(entry, at + entry.size())) {
    if (zip.size() - at < 46) break;
    const auto length = static_cast<std::size_t>(static_cast<unsigned char>(zip[at + 28]) + 256 * static_cast<unsigned char>(zip[at + 29]));
    models += zip.substr(at + 46, length).ends_with(".model");
  }
  if (models > 1)
    throw MeshError(
        fmt::format("{}: its objects lie in {} files of their own (the production extension of 3MF), which are not followed: "
                    "save it as STL or OBJ",
                    file, models - 1));
}

// Extensions of glTF that a file needs to be read as it means and that assimp passes over: its vertices would lie anywhere.
void refuse_extensions(const std::string& file, std::string_view text) {
  const std::size_t required = text.find("\"extensionsRequired\"");
  if (required == std::string_view::npos) return;
  const std::string_view names = text.substr(required, text.find(']', required) - required);
  for (const char* name : {"KHR_mesh_quantization", "EXT_meshopt_compression", "EXT_mesh_gpu_instancing"})
    if (names.find(name) != std::string_view::npos)
      throw MeshError(fmt::format("{}: needs the glTF extension {}, which is not read: save it without", file, name));
}

// What moves vertices in the file beside the places of its parts: figures of animation, seldom parts of machines.
void tell_of_movers(const std::vector<Placed>& placed, Mesh& mesh) {
  const auto any = [&](const auto& does) { return std::any_of(placed.begin(), placed.end(), does); };
  if (any([](const Placed& p) { return p.mesh->HasBones(); }))
    mesh.faults.emplace_back("it hangs on a skeleton (a skin), which is not applied: its vertices lie where they were before that");
  if (any([](const Placed& p) {
        return std::any_of(p.mesh->mAnimMeshes, p.mesh->mAnimMeshes + p.mesh->mNumAnimMeshes,
                           [](const aiAnimMesh* m) { return m->mWeight != 0.0f; });
      }))
    mesh.faults.emplace_back("it has shapes to blend with (morph targets), which are not applied");
}

Mesh read_other(const fs::path& path, const MeshOptions& options) {
  const std::string file = path.string();
  const std::string text = read_text(path);
  std::string ending = path.extension().string();
  for (char& c : ending) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  Assimp::Importer importer;
  // Places in the body frame are those of the file: assimp turns Collada's scenes so that y points up.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  // Of scenes without meshes it would make one of their nodes.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
  if (ending == ".3mf") refuse_scattered(file, text);
  if (ending == ".gltf" || ending == ".glb") refuse_extensions(file, text);
  const std::string stl = ending == ".stl" ? stl_bytes(file, text) : "";
  const aiScene* scene = stl.empty() ? importer.ReadFile(file, 0) : importer.ReadFileFromMemory(stl.data(), stl.size(), 0, "stl");
  if (scene == nullptr || scene->mRootNode == nullptr) throw MeshError(fmt::format("{}: {}", file, importer.GetErrorString()));
  Mesh mesh;
  mesh.name = path.filename().string();
  const bool linear = ending == ".gltf" || ending == ".glb";
  mesh.materials = convert_materials(*scene, linear);
  warn_of_textures(*scene, mesh);
  if (stl.starts_with("solid") && stl.find('\0') >= 1000 && stl.find("endsolid") == std::string::npos)
    mesh.warnings.emplace_back("its text has no 'endsolid': it may be cut off");
  std::vector<Placed> placed;
  collect(*scene, *scene->mRootNode, aiMatrix4x4(), placed);
  tell_of_movers(placed, mesh);
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
      for (unsigned v = 0; v < from.mNumVertices; ++v) {
        const glm::vec3 color(from.mColors[0][v].r, from.mColors[0][v].g, from.mColors[0][v].b);
        mesh.colors.push_back(linear ? srgb_from_linear(color) : color);
      }
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
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;  // in any locale
  if (extension == ".stl") polygons.corner_normal.clear();
  finish_mesh(std::move(polygons), options, mesh, fmt::format("{}: no face with three different corners", file));
  tell_of_steps(mesh);
  tell_of_units(ending, mesh);
  return mesh;
}

}  // namespace

Mesh read_mesh(const fs::path& path, const MeshOptions& options) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;  // in any locale
  return extension == ".obj" ? read_obj(path, options) : extension == ".ply" ? read_ply(path, options) : read_other(path, options);
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

void drop_unused_positions(Mesh& mesh) {
  std::vector<int> place(mesh.positions.size(), -1);
  for (const glm::ivec3& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) place[t[k]] = 0;
  int count = 0;
  for (size_t i = 0; i < place.size(); ++i) {
    if (place[i] < 0) continue;
    place[i] = count;
    mesh.positions[count] = mesh.positions[i];
    if (!mesh.colors.empty()) mesh.colors[count] = mesh.colors[i];
    ++count;
  }
  mesh.positions.resize(count);
  if (!mesh.colors.empty()) mesh.colors.resize(count);
  for (glm::ivec3& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) t[k] = place[t[k]];
  for (int& at : mesh.point_position) at = place[at];
}

Bounds compute_bounds(const Mesh& mesh) {
  Bounds bounds;
  for (const glm::ivec3& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) bounds.add(mesh.positions[t[k]]);
  return bounds;
}

void write_obj(const fs::path& path, const Mesh& mesh, const std::vector<glm::dvec3>& positions) {
  fmt::memory_buffer text;
  for (const glm::dvec3& p : positions) fmt::format_to(std::back_inserter(text), "v {:.17g} {:.17g} {:.17g}\n", p.x, p.y, p.z);
  for (const glm::ivec3& t : mesh.triangles) fmt::format_to(std::back_inserter(text), "f {} {} {}\n", t.x + 1, t.y + 1, t.z + 1);
  write_file(path, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

}  // namespace flexframe::render
