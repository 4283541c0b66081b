// Mesh files as they come: order and precision kept, every kind of face, and sentences for what cannot be used.
#include "render/picture/mesh.h"
#include "render/picture/shells.h"

#include "scratch.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <set>
#include <utility>

namespace flexframe::render::test_mesh {
namespace {

namespace fs = std::filesystem;

class RenderMesh : public ::testing::Test {
 protected:
  const Scratch scratch;
  const fs::path& folder = scratch.path();
  fs::path file(const std::string& name, const std::string& text) const { return scratch.put(name, text); }
  std::string complaint(const std::string& name, const std::string& text) const {
    try {
      read_mesh(file(name, text));
    } catch (const MeshError& e) {
      return e.what();
    }
    return "no complaint";
  }
};

const char* square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

double area(const Mesh& mesh) {
  double sum = 0.0;
  for (const glm::ivec3& t : mesh.triangles) {
    auto p = [&](int k) { return mesh.positions[static_cast<size_t>(t[k])]; };
    sum += 0.5 * glm::cross(p(1) - p(0), p(2) - p(0)).z;
  }
  return sum;
}

TEST_F(RenderMesh, MarksAreSkippedAndWhatIsNotDrawnIsTold) {
  EXPECT_EQ(read_mesh(file("mark.obj", "\xef\xbb\xbf" + std::string(square) + "f 1 2 3 4\n")).positions.size(), 4u);
  file("skin.mtl", "newmtl skin\nKd 0.8 0.1 0.05\nmap_Kd photo.png\n");
  const Mesh textured = read_mesh(file("skin.obj", "mtllib skin.mtl\n" + std::string(square) + "usemtl skin\nf 1 2 3 4\n"));
  ASSERT_EQ(textured.warnings.size(), 1u);
  EXPECT_NE(textured.warnings[0].find("skin.mtl: its textures are not drawn"), std::string::npos) << textured.warnings[0];
  const Mesh bare = read_mesh(file("bare.obj", "mtllib gone.mtl\n" + std::string(square) + "usemtl skin\nf 1 2 3 4\n"));
  ASSERT_EQ(bare.warnings.size(), 1u);
  EXPECT_NE(bare.warnings[0].find("gone.mtl is not there"), std::string::npos) << bare.warnings[0];
}

// Colours end at the border of two materials, whose faces share their normals all the same.
TEST_F(RenderMesh, PointsAreOfOneMaterial) {
  file("halves.mtl", "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n");
  const Mesh mesh =
      read_mesh(file("halves.obj", "mtllib halves.mtl\n" + std::string(square) + "usemtl red\nf 1 2 3\nusemtl blue\nf 1 3 4\n"));
  EXPECT_EQ(mesh.point_position.size(), 6u);
  EXPECT_EQ(mesh.normal_groups, 4);
  for (int k = 0; k < 3; ++k) EXPECT_NE(mesh.triangle_points[0][k], mesh.triangle_points[1][(k + 1) % 3]);
}

TEST_F(RenderMesh, MaterialsOfSeveralLibrariesAndOfNone) {
  file("one.mtl", "newmtl a\nKd 1 0 0\nd 1\nTr 1\n");
  file("two.mtl", "newmtl b\nKd 0 0 1\nTr 0.75\n");
  const std::string faces = std::string(square) + "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n";
  for (const char* libraries : {"mtllib one.mtl two.mtl\n", "mtllib .\\one.mtl\nmtllib two.mtl\n"}) {
    const Mesh mesh = read_mesh(file("several.obj", libraries + faces));
    EXPECT_TRUE(mesh.warnings.empty()) << mesh.warnings.front();
    const auto look = [&](size_t t) { return mesh.materials[static_cast<size_t>(mesh.triangle_material[t])]; };
    EXPECT_EQ(look(0).look.color, glm::vec3(1, 0, 0));
    EXPECT_EQ(look(1).look.color, glm::vec3(0, 0, 1));
    // 'Tr' beside 'd' is what some programs call opacity.
    EXPECT_EQ(look(0).opacity, 1.0f);
    EXPECT_EQ(look(1).opacity, 0.25f);
  }
  const Mesh bare = read_mesh(file("several.obj", "mtllib one.mtl\n" + faces));
  ASSERT_EQ(bare.warnings.size(), 1u);
  EXPECT_NE(bare.warnings[0].find("no material library has its material 'b'"), std::string::npos) << bare.warnings[0];
}

TEST_F(RenderMesh, ColoursOfVerticesMayBeBytes) {
  const Mesh mesh = read_mesh(file("bytes.obj", "v 0 0 0 255 0 0\nv 1 0 0 0 127.5 0\nv 0 1 0 0 0 0\nf 1 2 3\n"));
  EXPECT_EQ(mesh.colors[0], glm::vec3(1, 0, 0));
  EXPECT_EQ(mesh.colors[1], glm::vec3(0, 0.5f, 0));
  EXPECT_EQ(mesh.warnings.size(), 1u);
}

// What a picture of the file shows wrong.
TEST_F(RenderMesh, FaultsOfAFileAreSaid) {
  const auto fault = [&](const char* name, const std::string& text) {
    const Mesh mesh = read_mesh(file(name, text));
    return fmt::format("{}", fmt::join(mesh.faults, "; "));
  };
  EXPECT_EQ(fault("plain.obj", std::string(square) + "f 1 2 3 4\n"), "");
  EXPECT_NE(fault("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n").find("area"), std::string::npos);
  EXPECT_NE(fault("free.obj", std::string(square) + "f 1 2 3 4\ncstype bezier\ndeg 1 1\nsurf 0 1 0 1 1 2 4 3\nend\n").find("free-form"),
            std::string::npos);
  // 0.02 m, far from the origin: single precision leaves steps of 0.06 m there, and of 6e-6 m at 100 m.
  const auto stl = [&](double at) {
    return fmt::format(
        "solid s\nfacet normal 0 0 1\nouter loop\nvertex {0} {0} 0\nvertex {1} {0} 0\nvertex {0} {1} 0\nendloop\nendfacet\nendsolid s\n",
        at, at + 0.02);
  };
  EXPECT_NE(fault("far.stl", stl(1e6)).find("single precision"), std::string::npos);
  EXPECT_EQ(fault("near.stl", stl(100.0)), "");
}

// Colours of glTF are linear light: 0.2140 is half of white as an sRGB picture has it.
TEST_F(RenderMesh, ColoursOfGltfAreLinearLight) {
  const std::string document = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],
    "materials":[{"name":"grey","pbrMetallicRoughness":{"baseColorFactor":[0.21404114,0.0,1.0,0.25]}}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
    "bufferViews":[{"buffer":0,"byteLength":36}],
    "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";
  const Mesh mesh = read_mesh(file("grey.gltf", document));
  const MeshMaterial& grey = mesh.materials[static_cast<size_t>(mesh.triangle_material[0])];
  EXPECT_NEAR(grey.look.color.r, 0.5, 1e-4);
  EXPECT_EQ(grey.look.color.g, 0.0f);
  EXPECT_NEAR(grey.look.color.b, 1.0, 1e-6);
  EXPECT_EQ(grey.opacity, 1.0f);  // its alphaMode is OPAQUE, the default
}

// Volume of a closed mesh by its triangles, m^3.
double volume(const Mesh& mesh) {
  double sum = 0.0;
  for (const glm::ivec3& t : mesh.triangles)
    sum += glm::dot(mesh.positions[t.x], glm::cross(mesh.positions[t.y], mesh.positions[t.z])) / 6.0;
  return sum;
}

std::string box_lines(double middle, double half, bool inside_out, int before) {
  std::string text;
  for (int k = 0; k < 8; ++k)
    text += fmt::format("v {} {} {}\n", middle + (k & 1 ? half : -half), k & 2 ? half : -half, k & 4 ? half : -half);
  for (std::array<int, 4> f : {std::array{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
    if (inside_out) std::reverse(f.begin(), f.end());
    text += fmt::format("f {} {} {} {}\n", f[0] + 1 + before, f[1] + 1 + before, f[2] + 1 + before, f[3] + 1 + before);
  }
  return text;
}

// Parts that are inside out are turned, cavities are not.
TEST_F(RenderMesh, ShellsLookOutwards) {
  const auto turned = [&](const std::string& text, double wanted, int count, bool closed = true) {
    Mesh mesh = read_mesh(file("shells.obj", text));
    const Shells shells = turn_shells_outwards(mesh);
    EXPECT_EQ(shells.turned, count);
    EXPECT_EQ(shells.closed, closed);
    if (closed) {
      EXPECT_NEAR(volume(mesh), wanted, 1e-12) << text;
    }
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
      for (int k = 0; k < 3; ++k) EXPECT_EQ(mesh.point_position[static_cast<size_t>(mesh.triangle_points[t][k])], mesh.triangles[t][k]);
  };
  turned(box_lines(0, 1, false, 0), 8, 0);
  turned(box_lines(0, 1, true, 0), 8, 1);
  turned(box_lines(0, 1, false, 0) + box_lines(5, 1, true, 8), 16, 1);
  turned(box_lines(0, 1, false, 0) + box_lines(0, 0.5, true, 8), 7, 0);  // a cavity
  turned(box_lines(0, 1, false, 0) + box_lines(0, 0.5, true, 8) + box_lines(9, 1, true, 16), 15, 1);
  turned(box_lines(0, 1, false, 0) + "f 1 2 3\n", 0, 0, false);
  turned(std::string(square) + "f 1 2 3 4\n", 0, 0, false);
}

TEST_F(RenderMesh, KeepsTheOrderOfTheFile) {
  // Unused, repeated and out-of-order vertices, texture seams, several groups.
  const Mesh mesh = read_mesh(file("order.obj",
                                   "# a comment\nv 9 9 9\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 0 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0.5 0.5\n"
                                   "g one\nf 4/1 2/2 3/3\ng two\nv 0 1 0\nf 2/4 4/2 6/1\nv 7 7 7\n"));
  ASSERT_EQ(mesh.positions.size(), 7u);
  EXPECT_EQ(mesh.positions[0], glm::dvec3(9));
  EXPECT_EQ(mesh.positions[4], glm::dvec3(0));
  EXPECT_EQ(mesh.positions[6], glm::dvec3(7));
  ASSERT_EQ(mesh.triangles.size(), 2u);
  std::set<int> used;
  for (const auto& t : mesh.triangles) used.insert({t.x, t.y, t.z});
  EXPECT_EQ(used, (std::set<int>{1, 2, 3, 5}));
  EXPECT_NEAR(area(mesh), 1.0, 1e-15);
  // The box and what is drawn leave out what no face uses.
  EXPECT_EQ(compute_bounds(mesh).lower, glm::dvec3(0));
  EXPECT_EQ(compute_bounds(mesh).upper, glm::dvec3(1, 1, 0));
  Mesh drawn = mesh;
  drop_unused_positions(drawn);
  ASSERT_EQ(drawn.positions.size(), 4u);
  ASSERT_EQ(drawn.point_position.size(), mesh.point_position.size());
  for (size_t t = 0; t < 2; ++t)
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(drawn.positions[drawn.triangles[t][k]], mesh.positions[mesh.triangles[t][k]]);
      EXPECT_EQ(drawn.point_position[drawn.triangle_points[t][k]], drawn.triangles[t][k]);
    }
}

// The edges that cutting a face into triangles has made are told apart; a file of triangles has none.
TEST_F(RenderMesh, EdgesOfTheFacesOfTheFile) {
  const Mesh mesh =
      read_mesh(file("hexagon.obj", "v 0 0 0\nv 2 0 0\nv 3 1 0\nv 2 2 0\nv 0 2 0\nv -1 1 0\nv 1 -3 0\nf 1 2 3 4 5 6\nf 1 7 2\n"));
  ASSERT_EQ(mesh.triangles.size(), 5u);
  ASSERT_EQ(mesh.triangle_edges.size(), 5u);
  std::multiset<std::pair<int, int>> edges;
  for (size_t t = 0; t < 5; ++t)
    for (int k = 0; k < 3; ++k)
      if (mesh.triangle_edges[t] >> k & 1) edges.insert(std::minmax({mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]}));
  EXPECT_EQ(edges, (std::multiset<std::pair<int, int>>{{0, 1}, {0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 5}, {0, 5}, {0, 6}, {1, 6}}));
  EXPECT_TRUE(read_mesh(file("triangle.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n")).triangle_edges.empty());
}

TEST_F(RenderMesh, FacesOfEveryKind) {
  EXPECT_EQ(read_mesh(file("quad.obj", std::string(square) + "f 1 2 3 4\n")).triangles.size(), 2u);
  EXPECT_EQ(read_mesh(file("negative.obj", std::string(square) + "f -4 -3 -2 -1\n")).triangles.size(), 2u);
  EXPECT_NEAR(area(read_mesh(file("crlf.obj", "v 0 0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\nf 1 2 3 4\r\n"))), 1.0, 1e-15);
  EXPECT_NEAR(area(read_mesh(file("continued.obj", std::string(square) + "f 1 2 \\\n 3 4\n"))), 1.0, 1e-15);
  EXPECT_NEAR(area(read_mesh(file("comment.obj", std::string(square) + "f 1 2 3 4 # last\n"))), 1.0, 1e-15);
  // A concave arrow and a spiral n-gon keep their area.
  const Mesh arrow = read_mesh(file("arrow.obj", "v 0 0 0\nv 2 -1 0\nv 0.5 0 0\nv 2 1 0\nf 1 2 3 4\n"));
  EXPECT_NEAR(area(arrow), 0.5, 1e-14);
  const Mesh ell = read_mesh(file("ell.obj", "v 0 0 0\nv 3 0 0\nv 3 1 0\nv 1 1 0\nv 1 3 0\nv 0 3 0\nf 1 2 3 4 5 6\n"));
  EXPECT_NEAR(area(ell), 5.0, 1e-14);
  EXPECT_EQ(ell.triangles.size(), 4u);
  // A disc as one face of 5000 corners on one line.
  std::string text, face = "f";
  for (int k = 0; k < 5000; ++k) {
    const double a = 2.0 * 3.14159265358979 * k / 5000.0;
    text += fmt::format("v {:.17g} {:.17g} 0\n", std::cos(a), std::sin(a));
    face += fmt::format(" {}", k + 1);
  }
  EXPECT_NEAR(area(read_mesh(file("disc.obj", text + face + "\n"))), 3.14159, 1e-4);
  // Faces with repeated corners vanish with a word.
  const Mesh pinched = read_mesh(file("pinched.obj", std::string(square) + "f 1 1 2\nf 1 2 3\n"));
  EXPECT_EQ(pinched.triangles.size(), 1u);
  EXPECT_EQ(pinched.warnings.size(), 1u);
}

TEST_F(RenderMesh, FarFromTheOriginNothingIsLost) {
  const Mesh mesh = read_mesh(file("far.obj", "v 4500000.001 5300000 0\nv 4500000.002 5300000 0\nv 4500000.002 5300000.0015 0\nf 1 2 3\n"));
  EXPECT_EQ(mesh.positions[1].x - mesh.positions[0].x, 4500000.002 - 4500000.001);
  EXPECT_GT(area(mesh), 0.0);
}

TEST_F(RenderMesh, MaterialsAndColours) {
  file("two.mtl", "newmtl red\nKd 0.8 0.1 0.05\nd 0.5\nnewmtl steel\nKd 0.3 0.4 0.5\n");
  const Mesh mesh = read_mesh(file("two.obj", "mtllib two.mtl\n" + std::string(square) + "usemtl red\nf 1 2 3\nusemtl steel\nf 1 3 4\n"));
  ASSERT_EQ(mesh.triangles.size(), 2u);
  const MeshMaterial& first = mesh.materials[static_cast<size_t>(mesh.triangle_material[0])];
  EXPECT_EQ(first.name, "red");
  EXPECT_NEAR(first.look.color.r, 0.8, 1e-6);
  EXPECT_NEAR(first.opacity, 0.5, 1e-6);
  EXPECT_NEAR(mesh.materials[static_cast<size_t>(mesh.triangle_material[1])].look.color.b, 0.5, 1e-6);
  const Mesh colored = read_mesh(file("colored.obj", "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n"));
  ASSERT_EQ(colored.colors.size(), 3u);
  EXPECT_EQ(colored.colors[1], glm::vec3(0, 1, 0));
}

TEST_F(RenderMesh, NormalsSplitWhereTheFileOrTheAngleSays) {
  // A cube without normals has 24 shading points, a flat square 4.
  const std::string cube =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nf 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 "
      "1 5 8\n";
  EXPECT_EQ(read_mesh(file("cube.obj", cube)).normal_groups, 24);
  EXPECT_EQ(read_mesh(file("cube2.obj", cube), {.crease_angle = 100.0}).normal_groups, 8);
  EXPECT_EQ(read_mesh(file("flat.obj", std::string(square) + "f 1 2 3 4\n")).normal_groups, 4);
  // Normals of the file decide: two triangles folded flat, but with different normals.
  const Mesh seam = read_mesh(file("seam.obj", std::string(square) + "vn 0 0 1\nvn 0 1 0\nf 1//1 2//1 3//1\nf 1//2 3//2 4//2\n"));
  EXPECT_EQ(seam.normal_groups, 6);
  // Copies of a position share the normal group, not the position.
  const Mesh copies = read_mesh(file("copies.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 4 5 6\n"));
  EXPECT_EQ(copies.normal_groups, 4);
  EXPECT_EQ(copies.point_position.size(), 6u);
}

TEST_F(RenderMesh, OtherFormats) {
  const Mesh stl = read_mesh(file(
      "one.stl", "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n"));
  EXPECT_EQ(stl.triangles.size(), 1u);
  const Mesh ply =
      read_mesh(file("one.ply",
                     "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
                     "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"));
  ASSERT_EQ(ply.positions.size(), 4u);
  EXPECT_EQ(ply.positions[2], glm::dvec3(1, 1, 0));
  EXPECT_EQ(ply.triangles.size(), 2u);
}

// A number as a binary file has it.
template <class T>
std::string raw(T value, bool big) {
  std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
  if (big) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

// A pyramid over a square with more than its corners and faces, in both byte orders.
std::string binary_pyramid(bool big) {
  std::string out = fmt::format(
      "ply\r\nformat binary_{}_endian 1.0\r\ncomment made here\r\nelement vertex 5\r\nproperty double x\r\nproperty double y\r\n"
      "property double z\r\nproperty uchar red\r\nproperty uint8 green\r\nproperty uchar blue\r\nproperty list ushort short near\r\n"
      "element face 5\r\nproperty int flags\r\nproperty list uint uint vertex_index\r\nelement edge 1\r\nproperty float length\r\n"
      "end_header\r\n",
      big ? "big" : "little");
  const double corners[5][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 1e-9 + 1.0}};
  for (const auto& c : corners) {
    for (const double v : c) out += raw(v, big);
    for (const int v : {255, 51, 0}) out += static_cast<char>(v);
    out += raw(std::uint16_t{2}, big) + raw(std::int16_t{-1}, big) + raw(std::int16_t{7}, big);
  }
  for (const std::vector<std::uint32_t>& f :
       std::vector<std::vector<std::uint32_t>>{{3, 2, 1, 0}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}}) {
    out += raw(std::int32_t{-5}, big) + raw(static_cast<std::uint32_t>(f.size()), big);
    for (const std::uint32_t v : f) out += raw(v, big);
  }
  return out + raw(1.0f, big);
}

TEST_F(RenderMesh, PlyOfAllForms) {
  for (const bool big : {false, true}) {
    const std::string text = binary_pyramid(big);
    const Mesh mesh = read_mesh(file("a.ply", text));
    ASSERT_EQ(mesh.positions.size(), 5u);
    EXPECT_EQ(mesh.positions[4], glm::dvec3(0.5, 0.5, 1e-9 + 1.0));  // no digit is lost
    EXPECT_EQ(mesh.triangles.size(), 6u);
    ASSERT_EQ(mesh.colors.size(), 5u);
    EXPECT_NEAR(mesh.colors[2].g, 0.2f, 1e-6f);
    // Cut anywhere it is refused; assimp crashed. The last number is an edge's.
    for (std::size_t size = 1; size < text.size(); ++size) EXPECT_THROW(read_mesh(file("cut.ply", text.substr(0, size))), MeshError);
  }
  const std::string places = "property float x\nproperty float y\nproperty float z\n";
  const std::string header = "ply\nformat ascii 1.0\n", list = "property list uchar int vertex_indices\n";
  // Faces before the corners, numbers in other words, strips.
  const Mesh before = read_mesh(file("b.ply", header + "element face 1\n" + list + "element vertex 4\n" + places +
                                                  "end_header\n4 0 1 2 3\n+0 0. 0\n1 0 1e-400\n1.0e0 1 0\n0 1 0\n"));
  EXPECT_DOUBLE_EQ(area(before), 1.0);
  const Mesh strips = read_mesh(file("s.ply", header + "element vertex 4\n" + places + "element tristrips 1\n" + list +
                                                  "end_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n8 0 1 2 3 -1 0 1 2\n"));
  ASSERT_EQ(strips.triangles.size(), 3u);
  EXPECT_EQ(strips.triangles[1], glm::ivec3(1, 3, 2));
  const std::string four = header + "element vertex 4\n" + places + "element face 1\n" + list + "end_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n";
  for (const char* face : {"3 0 1 4\n", "3 0 1 -1\n", "3 0 1 0.5\n", "-3 0 1 2\n", "3 0 1\n", "3 0 1 x\n", "4000000000 0 1\n", ""})
    EXPECT_THROW(read_mesh(file("f.ply", four + face)), MeshError) << face;
  EXPECT_THROW(read_mesh(file("h.ply", "ply\nformat ascii 2.0\nelement vertex 99999999999999999999\nend_header\n")), MeshError);
}

TEST_F(RenderMesh, StlOfAllForms) {
  std::string text = "solid Part One\n", binary = std::string("solid by a program").append(62, ' ') + raw(std::uint32_t{2}, false);
  const float corners[2][9] = {{0, 0, 0, 1, 0, 0, 1, 1, 0}, {0, 0, 0, 1, 1, 0, 0, 1, 0}};
  for (const auto& c : corners) {
    text += "facet normal 0 0 1\nouter loop\n";
    for (int k = 0; k < 3; ++k) text += fmt::format("vertex {} {} {}\n", c[3 * k], c[3 * k + 1], c[3 * k + 2]);
    text += "endloop\nendfacet\n";
    for (int k = 0; k < 3; ++k) binary += raw(0.0f, false);
    for (const float v : c) binary += raw(v, false);
    binary += std::string(2, '\0');
  }
  std::string loud = text + "endsolid Part One\n";
  for (char& c : loud) c = static_cast<char>(std::toupper(c));
  for (const std::string& bytes : {text + "endsolid Part One\n", loud, "\n " + text + "endsolid", binary, binary + "tail"}) {
    const Mesh mesh = read_mesh(file("a.stl", bytes));
    EXPECT_DOUBLE_EQ(area(mesh), 1.0);
    EXPECT_TRUE(mesh.warnings.empty());
  }
  ASSERT_EQ(read_mesh(file("b.stl", text)).warnings.size(), 1u);  // no 'endsolid'
  for (const std::string& bytes : {binary.substr(0, 150), std::string(60, 'x'), std::string("a text of another kind\n")}) {
    try {
      read_mesh(file("c.stl", bytes));
      ADD_FAILURE() << bytes.size();
    } catch (const MeshError& e) {
      EXPECT_NE(std::string(e.what()).find("STL file"), std::string::npos) << e.what();
    }
  }
}

// assimp ends a line at a bare carriage return or a zero byte: a name that holds one made a vertex of its own of the rest, and the faces
// point beyond the end.
TEST_F(RenderMesh, ControlCharactersInNamesEndNoLine) {
  const std::string name = std::string("o part") + '\0' + "\rv 5 0 0\n";
  const Mesh mesh = read_mesh(file("odd.obj", name + square + "g a\rv 7 0 0\nusemtl b\fv 9 0 0\nf 1 2 3 4\n"));
  EXPECT_EQ(mesh.positions.size(), 4u);
  EXPECT_DOUBLE_EQ(area(mesh), 1.0);
}

TEST_F(RenderMesh, WrongFilesAreSaidInASentence) {
  EXPECT_NE(complaint("empty.obj", "").find("empty"), std::string::npos);
  EXPECT_NE(complaint("points.obj", square).find("no face"), std::string::npos);
  EXPECT_NE(complaint("text.obj", "hello\nworld\n").find("no vertices"), std::string::npos);
  EXPECT_NE(complaint("high.obj", std::string(square) + "f 1 2 9\n").find("high.obj:5: face refers to vertex 9, the file has 4"),
            std::string::npos);
  EXPECT_NE(complaint("zero.obj", std::string(square) + "f 0 1 2\n").find("indices start at 1"), std::string::npos);
  EXPECT_NE(complaint("low.obj", std::string(square) + "f -5 1 2\n").find("only 4"), std::string::npos);
  EXPECT_NE(complaint("nan.obj", "v 0 nan 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").find("nan.obj:1"), std::string::npos);
  EXPECT_NE(complaint("word.obj", "v 0 zero 0\n").find("'zero' is no number"), std::string::npos);
  EXPECT_NE(complaint("short.obj", "v 0 0\n").find("x y z"), std::string::npos);
  EXPECT_THROW(read_mesh(folder / "missing.obj"), MeshError);
  EXPECT_THROW(read_mesh(folder), MeshError);
  EXPECT_THROW(read_mesh(file("noise.stl", "\x01\x02\x03")), MeshError);
}

TEST_F(RenderMesh, WritesWhatItReads) {
  const Mesh mesh = read_mesh(file("in.obj", "v 0.1 0.2 0.3\nv 1e-9 1 0\nv 0 1 1\nv 5 5 5\nf 1 2 3\n"));
  write_obj(folder / "out.obj", mesh, mesh.positions);
  const Mesh again = read_mesh(folder / "out.obj");
  EXPECT_EQ(again.positions, mesh.positions);
  EXPECT_EQ(again.triangles, mesh.triangles);
}

}  // namespace
}  // namespace flexframe::render::test_mesh
