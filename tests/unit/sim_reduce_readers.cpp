// Readers of finite element models: every element kind of gmsh and Abaqus, materials, sets, spiders, units, matrices of CalculiX and Matrix
// Market.
#include "scratch.h"
#include "sim/base/eigen_solvers.h"
#include "sim/reduce/fe_elements.h"
#include "sim/reduce/reduce.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <filesystem>
#include <numbers>

namespace flexframe::sim::test_reduce_readers {
namespace {

namespace fs = std::filesystem;

// gmsh's own numbering as its manual draws it: corners, then for quadratic elements the corners between which each further node lies.
struct GmshKind {
  int type;
  FeShape shape;
  std::vector<Vec3> corners;  // of the parent element
  std::vector<std::array<int, 2>> edges;
};

std::vector<GmshKind> gmsh_kinds() {
  const std::vector<Vec3> tetrahedron = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::vector<Vec3> hexahedron = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}};
  const std::vector<Vec3> wedge = {{0, 0, -1}, {1, 0, -1}, {0, 1, -1}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
  return {{4, FeShape::tetrahedron4, tetrahedron, {}},
          {5, FeShape::hexahedron8, hexahedron, {}},
          {6, FeShape::wedge6, wedge, {}},
          {11, FeShape::tetrahedron10, tetrahedron, {{0, 1}, {1, 2}, {2, 0}, {3, 0}, {2, 3}, {1, 3}}},
          {17,
           FeShape::hexahedron20,
           hexahedron,
           {{0, 1}, {0, 3}, {0, 4}, {1, 2}, {1, 5}, {2, 3}, {2, 6}, {3, 7}, {4, 5}, {4, 7}, {5, 6}, {6, 7}}},
          {18, FeShape::wedge15, wedge, {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 4}, {2, 5}, {3, 4}, {3, 5}, {4, 5}}},
          {2, FeShape::triangle3, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}},
          {3, FeShape::quadrangle4, {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, {}}};
}

// A text or its binary form: numbers as they come.
struct MeshText {
  bool binary = false;
  std::string text;
  void word(const std::string& s) { text += s; }
  template <class T>
  void put(T v) {
    if (binary) text.append(reinterpret_cast<const char*>(&v), sizeof v);
    else text += fmt::format("{} ", v);
  }
  void line() {
    if (!binary) text += "\n";
  }
};

// One element of the kind, its nodes numbered 11, 12, ..., in physical group 7 "Part"; format 2.2 or 4.1, that one cut into partitions too.
std::string gmsh_mesh(const GmshKind& kind, bool four, bool binary, bool parted, const Mat3& A) {
  std::vector<Vec3> nodes;
  for (const Vec3& c : kind.corners) nodes.emplace_back(A * c);
  for (const auto& [a, b] : kind.edges) nodes.emplace_back(0.5 * (nodes[a] + nodes[b]));
  const bool shell = fe_is_shell(kind.shape);
  const int dimension = shell ? 2 : 3, count = static_cast<int>(nodes.size());
  MeshText m;
  m.binary = binary;
  m.word(fmt::format("$MeshFormat\n{} {} 8\n", four ? "4.1" : "2.2", binary ? 1 : 0));
  if (binary) m.put(1), m.word("\n");
  m.word(fmt::format("$EndMeshFormat\n$PhysicalNames\n1\n{} 7 \"Part\"\n$EndPhysicalNames\n", dimension));
  using Size = std::uint64_t;
  if (four) {
    m.word("$Entities\n");
    for (int d = 0; d < 4; ++d) m.put(static_cast<Size>(d == dimension));
    m.line();
    m.put(3);
    for (double x : {-9.0, -9.0, -9.0, 9.0, 9.0, 9.0}) m.put(x);
    m.put(Size{1}), m.put(7), m.put(Size{0});
    m.word("\n$EndEntities\n");
    if (parted) {
      // Entity 9 is a part of entity 3, in partition 2; no ghosts.
      m.word("$PartitionedEntities\n");
      m.put(Size{2}), m.put(Size{0});
      for (int d = 0; d < 4; ++d) m.put(static_cast<Size>(d == dimension));
      m.line();
      m.put(9), m.put(dimension), m.put(3), m.put(Size{1}), m.put(2);
      for (double x : {-9.0, -9.0, -9.0, 9.0, 9.0, 9.0}) m.put(x);
      m.put(Size{0}), m.put(Size{0});
      m.word("\n$EndPartitionedEntities\n");
    }
    const int entity = parted ? 9 : 3;
    m.word("$Nodes\n");
    m.put(Size{1}), m.put(static_cast<Size>(count)), m.put(Size{11}), m.put(static_cast<Size>(10 + count)), m.line();
    m.put(dimension), m.put(entity), m.put(0), m.put(static_cast<Size>(count)), m.line();
    for (int i = 0; i < count; ++i) m.put(static_cast<Size>(11 + i)), m.line();
    for (const Vec3& x : nodes) m.put(x.x()), m.put(x.y()), m.put(x.z()), m.line();
    m.word("\n$EndNodes\n$Elements\n");
    m.put(Size{1}), m.put(Size{1}), m.put(Size{5}), m.put(Size{5}), m.line();
    m.put(dimension), m.put(entity), m.put(kind.type), m.put(Size{1}), m.line();
    m.put(Size{5});
    for (int i = 0; i < count; ++i) m.put(static_cast<Size>(11 + i));
  } else {
    m.word(fmt::format("$Nodes\n{}\n", count));
    for (int i = 0; i < count; ++i) m.put(11 + i), m.put(nodes[i].x()), m.put(nodes[i].y()), m.put(nodes[i].z()), m.line();
    m.word("\n$EndNodes\n$Elements\n1\n");
    if (binary) m.put(kind.type), m.put(1), m.put(2), m.put(5);
    else m.put(5), m.put(kind.type), m.put(2);
    m.put(7), m.put(3);
    for (int i = 0; i < count; ++i) m.put(11 + i);
  }
  m.word("\n$EndElements\n");
  return m.text;
}

TEST(ReduceReaders, EveryGmshKindInBothFormatsTextAndBinary) {
  const Scratch scratch;
  Mat3 A;
  A << 1.3, 0.2, -0.1, 0.15, 0.9, 0.25, -0.2, 0.1, 1.1;
  for (const GmshKind& kind : gmsh_kinds())
    for (const auto& [four, parted] : {std::pair(false, false), std::pair(true, false), std::pair(true, true)})
      for (bool binary : {false, true}) {
        const std::string what = fmt::format("{}, format {}, {}{}", fe_name(kind.shape), four ? "4.1" : "2.2", binary ? "binary" : "text",
                                             parted ? ", partitions" : "");
        FeUnits units;
        units.length = 1e-3;
        const FeModel m = read_msh(scratch.put("kind.msh", gmsh_mesh(kind, four, binary, parted, A)), units);
        ASSERT_EQ(m.elements.size(), 1u) << what;
        const FeElement& e = m.elements[0];
        EXPECT_EQ(e.shape, kind.shape) << what;
        EXPECT_EQ(e.id, 5) << what;
        EXPECT_EQ(m.node_ids[0], 11) << what;
        ASSERT_EQ(m.element_sets.count("PART"), 1u) << what;
        EXPECT_EQ(m.element_sets.at("PART").size(), 1u) << what;
        EXPECT_EQ(m.node_sets.at("PART").size(), m.nodes.size()) << what;
        ASSERT_EQ(e.count, fe_node_count(kind.shape)) << what;
        if (fe_is_shell(kind.shape)) {
          for (int i = 0; i < e.count; ++i)
            EXPECT_LT((1e3 * m.nodes[m.connectivity[e.first + i]] - A * kind.corners[i]).norm(), 1e-12) << what;
          continue;
        }
        // In our order the nodes are the image of the parent element's.
        const Mat3X parent = parent_nodes(kind.shape);
        for (int i = 0; i < e.count; ++i)
          EXPECT_LT((1e3 * m.nodes[m.connectivity[e.first + i]] - A * parent.col(i)).norm(), 1e-12) << what << " node " << i;
      }
}

// Two bricks of different material and a plate of shells, by sections on element sets; sets by range and of sets; included file; kg from
// the masses' densities.
TEST(ReduceReaders, AbaqusMaterialsSetsAndShells) {
  const Scratch scratch;
  scratch.put("nodes.inc",
              "*Node, nset=Everything\n1, 0, 0, 0\n2, 1, 0, 0\n3, 1, 1, 0\n4, 0, 1, 0\n5, 0, 0, 1\n6, 1, 0, 1\n7, 1, 1, 1\n8, 0, 1, 1\n"
              "9, 2, 0, 0\n10, 2, 1, 0\n11, 2, 0, 1\n12, 2, 1, 1\n13, 3., 0., 1.\n14, 3.D0, 1.0E0, 1\n");
  const std::string text =
      "** a comment\n*Heading\nanything, goes = here\n*Include, input=nodes.inc\n"
      "*Element, type=C3D8I, elset=Steel\n1, 1, 2, 3, 4,\n 5, 6, 7, 8\n*ELEMENT,TYPE=C3D8R,ELSET=Light\n2, "
      "2,9,10,3,6,11,12,7\n*ELEMENT,TYPE=S4,ELSET=PLATE\n3, 11, 13, 14, 12\n"
      "*Nset, nset=Left, generate\n1, 4, 1\n*NSET,NSET=LEFT\n5, 8\n*Nset, nset=Both\nLeft, 13\n14\n*Elset, elset=Solids\nSteel, Light\n"
      "*Material, name=Steel\n*Elastic\n2.1e5, 0.3\n*Density\n7.85e-9,\n*Material, name=Aluminium\n*Elastic, type=ISO\n7e4, "
      "0.33\n*Density\n2.7e-9\n"
      "*Solid Section, elset=Steel, material=STEEL\n*Solid Section, elset=Light, material=Aluminium\n*Shell Section, elset=Plate, "
      "material=Steel\n0.1\n"
      "*Boundary\nLeft, 1, 3\n*Step\n*Frequency\n10\n*Element, type=nonsense\n*End Step\n";
  FeUnits units;
  units.length = 1e-3;
  units.mass = 1e3;
  const FeModel m = read_inp(scratch.put("mixed.inp", text), units);
  ASSERT_EQ(m.elements.size(), 3u);
  EXPECT_EQ(m.nodes.size(), 14u);
  EXPECT_NEAR(m.nodes[13].x(), 3e-3, 1e-15);
  EXPECT_EQ(m.node_sets.at("LEFT").size(), 6u);
  EXPECT_EQ(m.node_sets.at("BOTH").size(), 8u);
  EXPECT_EQ(m.node_sets.at("EVERYTHING").size(), 14u);
  EXPECT_EQ(m.element_sets.at("SOLIDS").size(), 2u);
  EXPECT_EQ(m.materials[m.elements[0].material].name, "Steel");
  EXPECT_EQ(m.materials[m.elements[1].material].name, "Aluminium");
  EXPECT_NEAR(m.materials[m.elements[1].material].youngs_modulus, 7e10, 1.0);
  EXPECT_NEAR(m.materials[m.elements[1].material].density, 2700.0, 1e-9);
  EXPECT_NEAR(m.elements[2].thickness, 1e-4, 1e-18);
  EXPECT_EQ(m.constraints.size(), 18u);
  // The shell hangs on the bricks by the nodes they share, as on a hinge; its far end is held.
  ReduceOptions o;
  o.modes = 2;
  o.held = m.constraints;
  o.stiffening = false;
  EXPECT_THROW(reduce(m, o), InputError);
  o.held.push_back({12, 2});
  const Reduction r = reduce(m, o);
  EXPECT_NEAR(r.body.mass, 1e-9 * (7850.0 + 2700.0 + 0.1 * 7850.0), 1e-15);
  EXPECT_EQ(r.report.rigid_motions, 0);
}

// Spiders of the file: a rigid body, a distributing coupling on a surface of element faces, a kinematic one on a surface of nodes.
TEST(ReduceReaders, AbaqusSpiders) {
  const Scratch scratch;
  const std::string text =
      "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n9,2,0,0\n10,2,1,0\n11,2,0,1\n12,2,1,1\n100,-1,.5,."
      "5\n101,3,.5,.5\n102,.5,2,.5\n"
      "*ELEMENT,TYPE=C3D8,ELSET=E\n1,1,2,3,4,5,6,7,8\n2,2,9,10,3,6,11,12,7\n*NSET,NSET=LEFT\n1,4,5,8\n*SURFACE,NAME=RIGHT,TYPE=ELEMENT\n2,"
      "S4\n*SURFACE,NAME=TOP,TYPE=NODE\n4\n3\n7\n8\n"
      "*MATERIAL,NAME=S\n*ELASTIC\n2e11,.3\n*DENSITY\n7800\n*SOLID SECTION,ELSET=E,MATERIAL=S\n"
      "*RIGID BODY,NSET=LEFT,REF NODE=100\n*COUPLING,CONSTRAINT NAME=PULL,REF NODE=101,SURFACE=RIGHT\n*DISTRIBUTING\n1,6\n";
  const FeModel m = read_inp(scratch.put("spiders.inp", text));
  ASSERT_EQ(m.spiders.size(), 2u);
  EXPECT_TRUE(m.spiders[0].rigid);
  EXPECT_EQ(m.spiders[0].slaves.size(), 4u);
  EXPECT_FALSE(m.spiders[1].rigid);
  EXPECT_EQ(m.spiders[1].name, "PULL");
  std::vector<int> ids;
  for (int s : m.spiders[1].slaves) ids.push_back(m.node_ids[s]);
  EXPECT_EQ(ids, (std::vector<int>{9, 10, 11, 12}));
  ReduceOptions o;
  o.interfaces = {{-1, 0, "left"}, {-1, 1, "right"}};
  o.modes = 2;
  const Reduction r = reduce(m, o);
  EXPECT_LT(r.report.compliance_error, 1e-6);
  EXPECT_NEAR(r.body.mass, 2 * 7800.0, 1e-8);
  EXPECT_NEAR(r.body.nodes[0].origin.x(), -1.0, 0.0);
}

const fs::path corpus = fs::path(FLEXFRAME_SOURCE_DIR) / "tests/fuzz/corpus/fe";

// Matrices that CalculiX 2.20 wrote for two C3D8 bricks; the frequencies are those of scipy.linalg.eigh for the same two files.
TEST(ReduceReaders, MatricesOfCalculix) {
  const FeModel m = read_fe_matrices(corpus / "bricks.sti", corpus / "bricks.mas", corpus / "bricks.inp", corpus / "bricks.dof");
  ASSERT_TRUE(m.matrices.has_value());
  EXPECT_EQ(m.matrices->K.rows(), 36);
  ReduceOptions o;
  o.modes = 6;
  const Reduction r = reduce(m, o);
  EXPECT_EQ(r.report.rigid_motions, 6);
  const double wanted[6] = {7068.79701, 8914.08675, 9079.50314, 14249.8373, 15102.3850, 29677.3101};
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(r.report.frequencies(k), wanted[k], 1e-6 * wanted[k]);
  EXPECT_NEAR(r.body.mass, 7850.0 * 0.2 * 0.02 * 0.01, 1e-9);
  EXPECT_EQ(r.body.nodes.size(), 12u);
  EXPECT_NE(surface_obj(m).find("\nf "), std::string::npos);  // the mesh beside the matrices gives the surface
  // A rigid interface on matrices is the one on elements.
  FeModel tied = m;
  FeModel elements = read_inp(corpus / "bricks.inp");
  Reduction both[2];
  for (FeModel* model : {&tied, &elements}) {
    FeSpider spider;
    spider.name = "END";
    spider.node = static_cast<int>(model->nodes.size());
    for (size_t i = 0; i < model->nodes.size(); ++i)
      if (model->nodes[i].x() == 0.0) spider.slaves.push_back(static_cast<int>(i));
    model->nodes.emplace_back(-0.1, 0.0, 0.0);
    model->node_ids.push_back(500);
    model->spiders.push_back(spider);
    o.interfaces = {{-1, 0, "end"}};
    o.method = ReduceMethod::eigenmodes;
    both[model == &elements] = reduce(*model, o);
  }
  EXPECT_EQ(both[0].body.nodes[0].name, "end");
  EXPECT_NEAR(both[0].report.frequencies(0), both[1].report.frequencies(0), 1e-2 * both[1].report.frequencies(0));
}

// Matrices of a supported model lack the motions that were held, here all of one end face but one motion of one node: no rigid motion, and
// no other mistake.
TEST(ReduceReaders, MatricesOfASupportedModel) {
  const Scratch scratch;
  const FeModel given = read_fe_matrices(corpus / "bricks.sti", corpus / "bricks.mas", corpus / "bricks.inp", corpus / "bricks.dof");
  std::vector<int> kept;
  std::string dofs;
  for (int i = 0; i < 36; ++i)
    if (given.nodes[given.matrices->node[i]].x() > 0.0 || (given.matrices->node[i] == 0 && given.matrices->dof[i] == 1)) {
      kept.push_back(i);
      dofs += fmt::format("{}.{}\n", given.node_ids[given.matrices->node[i]], given.matrices->dof[i] + 1);
    }
  scratch.put("held.dof", dofs);
  const auto upper = [&](const Eigen::SparseMatrix<double>& A) {
    const MatX dense = A;
    std::string text;
    for (size_t c = 0; c < kept.size(); ++c)
      for (size_t r = 0; r <= c; ++r) text += fmt::format("{} {} {:.17g}\n", r + 1, c + 1, dense(kept[r], kept[c]));
    return text;
  };
  const FeModel m = read_fe_matrices(scratch.put("held.sti", upper(given.matrices->K)), scratch.put("held.mas", upper(given.matrices->M)),
                                     corpus / "bricks.inp", scratch.path() / "held.dof");
  ReduceOptions o;
  o.modes = 1;
  const Reduction r = reduce(m, o);
  EXPECT_EQ(r.report.rigid_motions, 0);
  const MatX K = MatX(given.matrices->K)(kept, kept), M = MatX(given.matrices->M)(kept, kept);
  const double wanted = std::sqrt(GeneralizedEigen(K, M).eigenvalues()(0)) / (2 * std::numbers::pi);
  EXPECT_NEAR(r.report.frequencies(0), wanted, 1e-6 * wanted);
  // The same motion named twice.
  scratch.put("held.dof", dofs + dofs.substr(0, dofs.find('\n') + 1));
  EXPECT_THROW(
      read_fe_matrices(scratch.path() / "held.sti", scratch.path() / "held.mas", corpus / "bricks.inp", scratch.path() / "held.dof"),
      InputError);
}

// The same matrices as Matrix Market, symmetric and general, with a node table; rows in the table's order, three a node.
TEST(ReduceReaders, MatrixMarketWithNodeTable) {
  const Scratch scratch;
  const FeModel given = read_fe_matrices(corpus / "bricks.sti", corpus / "bricks.mas", corpus / "bricks.inp", corpus / "bricks.dof");
  std::string table = "# id x y z\n";
  for (size_t i = 0; i < given.nodes.size(); ++i)
    table +=
        fmt::format("{} {:.17g} {:.17g} {:.17g}\n", given.node_ids[i] + 100, given.nodes[i].x(), given.nodes[i].y(), given.nodes[i].z());
  scratch.put("nodes.txt", table);
  // Rows as the table wants them.
  std::vector<int> row(36);
  for (int i = 0; i < 36; ++i) row[i] = 3 * given.matrices->node[i] + given.matrices->dof[i];
  const auto market = [&](const Eigen::SparseMatrix<double>& A, bool symmetric) {
    std::string entries;
    int count = 0;
    for (int c = 0; c < A.outerSize(); ++c)
      for (Eigen::SparseMatrix<double>::InnerIterator it(A, c); it; ++it)
        if (!symmetric || row[it.row()] >= row[it.col()]) {
          entries += fmt::format("{} {} {:.17g}\n", row[it.row()] + 1, row[it.col()] + 1, it.value());
          ++count;
        }
    return fmt::format("%%MatrixMarket matrix coordinate real {}\n% made by a test\n36 36 {}\n", symmetric ? "symmetric" : "general",
                       count) +
           entries;
  };
  for (bool symmetric : {true, false}) {
    const FeModel m = read_fe_matrices(scratch.put("K.mtx", market(given.matrices->K, symmetric)),
                                       scratch.put("M.mtx", market(given.matrices->M, symmetric)), scratch.path() / "nodes.txt", {});
    ReduceOptions o;
    o.modes = 3;
    const Reduction r = reduce(m, o);
    EXPECT_NEAR(r.report.frequencies(0), 7068.79701, 1e-2);
    EXPECT_EQ(r.body.nodes.front().name.substr(0, 7), "node[10");
  }
}

// Every refusal names the file, and the line where there is one.
TEST(ReduceReaders, MatrixRefusals) {
  const Scratch scratch;
  const auto refusal = [&](const std::string& K, const std::string& table) {
    try {
      const fs::path file = scratch.put("K.mtx", K);
      read_fe_matrices(file, file, scratch.put("nodes.txt", table), {});
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  const std::string head = "%%MatrixMarket matrix coordinate real symmetric\n3 3 3\n", good = head + "1 1 1\n2 2 1\n3 3 1\n",
                    node = "1 0 0 0\n";
  EXPECT_EQ(refusal(good, node), "accepted");
  EXPECT_NE(refusal(head + "1 1 1\n4 1 1\n", node).find("K.mtx:4: entry (4, 1)"), std::string::npos);
  EXPECT_NE(refusal(head + "1 1 x\n", node).find("K.mtx:3: 'row column value'"), std::string::npos);
  EXPECT_NE(refusal(head + "1 1 1\n2 2 1\n", node).find("K.mtx: 3 entries are announced, 2 are there"), std::string::npos);
  EXPECT_NE(refusal("%%MatrixMarket matrix array real general\n", node).find("coordinate real"), std::string::npos);
  EXPECT_NE(refusal(good, node + "2 1 0 0\n").find("3 rows, 6 degrees"), std::string::npos);
  EXPECT_NE(refusal(good, "1 0 0\n").find("nodes.txt:1: 'id x y z'"), std::string::npos);
  EXPECT_NE(refusal("%%MatrixMarket matrix coordinate real general\n3 3 2\n1 2 1\n2 1 2\n", node).find("not symmetric"), std::string::npos);
}

}  // namespace
}  // namespace flexframe::sim::test_reduce_readers
