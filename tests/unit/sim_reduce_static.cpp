// What the reduced body keeps of the full model with default options: static deflection at the interfaces, frequencies once it is attached,
// geometric stiffening.
#include "sim/base/eigen_solvers.h"
#include "sim/bodies/sid.h"
#include "sim/bodies/sid_lack.h"
#include "sim/reduce/fe_attachment.h"
#include "sim/reduce/fe_solver.h"
#include "sim/reduce/reduce.h"
#include "sim/scene/scene_reader.h"
#include "sim/start/make_system.h"

#include "scratch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace flexframe::sim::test_reduce_static {
namespace {

namespace fs = std::filesystem;

// The con rod with averaging spiders in both bores.
FeModel rod() {
  const fs::path file = fs::path(FLEXFRAME_SOURCE_DIR) / "tests/unit/data/kernel_map/conrod.inp";
  if (!fs::exists(file)) throw std::runtime_error(file.string() + " is missing");
  FeModel model = read_inp(file);
  for (const auto& [x, radius, name] : {std::tuple(0.0, 0.029, "big"), std::tuple(0.15, 0.013, "small")}) {
    FeSpider s;
    s.name = name;
    s.rigid = false;
    s.node = static_cast<int>(model.nodes.size());
    for (size_t i = 0; i < model.nodes.size(); ++i)
      if (std::abs(std::hypot(model.nodes[i].x() - x, model.nodes[i].y()) - radius) < 1e-4) s.slaves.push_back(static_cast<int>(i));
    model.nodes.emplace_back(x, 0, 0);
    model.node_ids.push_back(100000 + s.node);
    model.spiders.push_back(s);
  }
  return model;
}

ReduceOptions both_ends() {
  ReduceOptions o;
  o.interfaces = {{-1, 0, "big"}, {-1, 1, "small"}};
  return o;
}

// The full model, solved apart from the reducer: elastic deflection of a free body (inertia relief) under unit forces and moments at both
// interfaces.
struct Full {
  FeModel model = rod();
  FeSystem system = assemble(model);
  FeReduced reduced = eliminate(model, system, {});
  FeSolver solver{reduced, rigid_motions(model, system), estimate_modes(model, system)};
  MatX loads{system.size, 12};
  Full() {
    solver.factorise();
    for (int i = 0; i < 2; ++i) loads.middleCols(6 * i, 6) = MatX(spider_attachment(model, system, model.spiders[i]).motion.transpose());
  }
};

// 12 x n: translations and rotations of both interfaces.
MatX interface_motion(const FlexibleBody& body) {
  MatX motion(12, body.n);
  for (int i = 0; i < 2; ++i) motion.middleRows(6 * i, 3) = body.nodes[i].phi, motion.middleRows(6 * i + 3, 3) = body.nodes[i].psi;
  return motion;
}

TEST(ReduceStatic, DeflectionAtInterfacesWithDefaultOptions) {
  const Full full;
  const MatX exact = full.loads.transpose() * full.solver.respond(full.loads);
  ReduceOptions options[3] = {both_ends(), both_ends(), both_ends()};
  options[1].method = ReduceMethod::response;
  options[1].highest = 3000.0;
  options[2].highest = 2000.0;
  for (const ReduceOptions& o : options) {
    const Reduction r = reduce(full.model, o);
    const MatX motion = interface_motion(r.body);
    const MatX small = motion * r.body.Ke.diagonal().cwiseInverse().asDiagonal() * motion.transpose();
    for (int k = 0; k < 12; ++k) EXPECT_NEAR(small(k, k), exact(k, k), 1e-2 * exact(k, k)) << "load " << k;
    EXPECT_LT(r.report.compliance_error, 1e-2);
  }
  // The cut-off alone, as the option says, costs more: what makes the rule above needed.
  ReduceOptions strict = options[1];
  strict.static_error = 0.0;
  EXPECT_GT(reduce(full.model, strict).report.compliance_error, 0.05);
}

// Nodes of a solid on a line, or one, resist no turn about it: the reduction says so, its file, and a scene that welds something there, but
// not one that hangs it on a ball.
TEST(ReduceStatic, InterfacesThatTurnAreTold) {
  FeModel model = rod();
  std::vector<int>& small = model.spiders[1].slaves;
  const Vec3 first = model.nodes[small.front()];
  const auto beside = [&](int n) { return (model.nodes[n] - first).head<2>().norm() > 1e-6; };
  for (const bool one : {false, true}) {
    if (one) small.resize(1);
    else std::erase_if(small, beside);
    ASSERT_EQ(small.size() > 1, !one);
    ReduceOptions o = both_ends();
    o.modes = 4;
    const Reduction r = reduce(model, o);
    EXPECT_FALSE(r.report.lacks[0].turns);
    EXPECT_TRUE(r.report.lacks[1].turns);
    const auto& warnings = r.report.warnings;
    EXPECT_TRUE(std::any_of(warnings.begin(), warnings.end(), [](const std::string& w) { return w.find("resists no turn") != w.npos; }));
    const std::string comment = reduced_comment("rod.inp", r.report.lacks);
    EXPECT_EQ(turning_of_comment(comment), std::vector<std::string>{"small"}) << comment;
    EXPECT_TRUE(turning_of_comment(reduced_comment("rod.inp", {{"big", 0.5}})).empty());
    EXPECT_EQ(lacks_of_comment(reduced_comment("rod.inp", {{"big", 0.5, true}, {"small", 0.2, true}})).size(), 2u);
    const Scratch folder;
    write_sid(from_flexible_body(r.body, comment), folder.path() / "rod.sid");
    for (const char* kind : {"weld", "spherical"}) {
      const std::string text =
          std::string("[simulation]\nduration = 0.001\n[[body]]\nname = \"rod\"\nkind = \"modal\"\nfile = \"rod.sid\"\n") +
          "[[joint]]\nname = \"wall\"\nkind = \"" + kind + "\"\nparent = \"ground\"\nchild = \"rod.small\"\n";
      const Scene scene = parse_scene(text, (folder.path() / "scene.toml").string());
      const std::vector<std::string> told = make_system(scene).notes.texts(Severity::warning);
      const bool warned = std::any_of(told.begin(), told.end(), [](const std::string& w) { return w.find("resists no turn") != w.npos; });
      EXPECT_EQ(warned, kind[0] == 'w') << one;
    }
  }
}

// Free modes alone give way too little where they are held. The body says by how much, its file too, and so does a scene that loads it.
TEST(ReduceStatic, LackingModesAreTold) {
  const FeModel model = rod();
  ReduceOptions few = both_ends();
  few.method = ReduceMethod::eigenmodes;
  few.modes = 8;
  const Reduction lacking = reduce(model, few), whole = reduce(model, both_ends());
  ASSERT_EQ(lacking.report.lacks.size(), 2u);
  ASSERT_EQ(whole.report.lacks.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_GT(lacking.report.lacks[i].share, 0.01) << i;
    EXPECT_LT(whole.report.lacks[i].share, 0.01) << i;
  }
  EXPECT_EQ(reduced_comment("rod.inp", whole.report.lacks), "made by flexframe reduce from rod.inp; interfaces 'big', 'small'");
  const std::string comment = reduced_comment("rod.inp", lacking.report.lacks);
  const std::vector<InterfaceLack> read = lacks_of_comment(comment);
  ASSERT_EQ(read.size(), 2u) << comment;
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(read[i].interface, lacking.report.lacks[i].interface);
    EXPECT_NEAR(read[i].share, lacking.report.lacks[i].share, 0.06 * read[i].share);
  }
  EXPECT_TRUE(lacks_of_comment("made by another program").empty());

  const Scratch folder;
  for (const auto& [r, warned] : {std::pair(&lacking, true), std::pair(&whole, false)}) {
    write_sid(from_flexible_body(r->body, reduced_comment("rod.inp", r->report.lacks)), folder.path() / "rod.sid");
    const std::string text = R"(
[simulation]
duration = 0.001
[[body]]
name = "rod"
kind = "modal"
file = "rod.sid"
[[joint]]
name = "wall"
kind = "weld"
parent = "ground"
child = "rod.big"
)";
    const Scene scene = parse_scene(text, (folder.path() / "scene.toml").string());
    const std::vector<std::string> said = make_system(scene).notes.texts(Severity::warning);
    const auto at = [&](const char* name) {
      return std::any_of(said.begin(), said.end(),
                         [&](const std::string& s) { return s.find(std::string("static deflection at '") + name) != std::string::npos; });
    };
    EXPECT_EQ(at("big"), warned);
    EXPECT_FALSE(at("small"));  // nothing holds or loads it
    // Held at a node that is no interface.
    const auto strange = [&](std::string held) {
      std::string other = text;
      other.replace(other.find("rod.big"), 7, "rod." + held);
      const std::vector<std::string> told =
          make_system(parse_scene(other, (folder.path() / "scene.toml").string())).notes.texts(Severity::warning);
      return std::any_of(told.begin(), told.end(), [&](const std::string& w) { return w.find("at " + held + ", which") != w.npos; });
    };
    EXPECT_TRUE(strange(r->body.nodes[5].name));
    EXPECT_FALSE(strange("big"));
  }
  EXPECT_EQ(interfaces_of_comment(reduced_comment("rod.inp", {})), std::vector<std::string>{});
  EXPECT_EQ(interfaces_of_comment(comment), (std::vector<std::string>{"big", "small"}));
  EXPECT_FALSE(interfaces_of_comment("made by another program"));
}

// The free reduced rod, taken hold of at the big end, vibrates as the full model held there does.
TEST(ReduceStatic, FrequenciesOfTheAssembledSystem) {
  const Full full;
  const FeModes held = full.solver.modes(5, 0.0, full.loads.leftCols(6), {});
  const Reduction r = reduce(full.model, both_ends());
  const FlexibleBody& b = r.body;
  // Rigid motions follow from the elastic ones: the interface, at the origin, stays; mean axes leave M = diag(rigid, 1).
  const MatX follow = -interface_motion(b).topRows(6);
  Mat6 M = Mat6::Zero();
  const auto cross = [](const Vec3& a) {
    Mat3 s;
    s << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
    return s;
  };
  M.topLeftCorner<3, 3>() = b.mass * Mat3::Identity();
  M.topRightCorner<3, 3>() = -cross(b.md0);
  M.bottomLeftCorner<3, 3>() = cross(b.md0);
  M.bottomRightCorner<3, 3>() << b.J0(0), b.J0(3), b.J0(4), b.J0(3), b.J0(1), b.J0(5), b.J0(4), b.J0(5), b.J0(2);
  const MatX mass = b.Me + follow.transpose() * M * follow;
  const VecX squares = GeneralizedEigen(b.Ke, mass).eigenvalues();
  for (int k = 0; k < 5; ++k)
    EXPECT_NEAR(std::sqrt(squares(k)), std::sqrt(held.eigenvalues(k)), 1e-2 * std::sqrt(held.eigenvalues(k))) << "mode " << k + 1;
}

// Geometric stiffening from second-order displacements of all pairs, and from the static displacements of the loads: one and the same.
TEST(ReduceStatic, BothWaysToStiffeningAgree) {
  const FeModel model = rod();
  for (bool held : {false, true}) {
    ReduceOptions o = both_ends();
    o.method = ReduceMethod::eigenmodes;
    o.modes = 4;
    o.node_count = 2;
    if (held)
      for (int n : model.spiders[0].slaves)
        for (int d = 0; d < 3; ++d) o.held.push_back({n, d});
    const Reduction pairs = reduce(model, o);
    o.stiffening_limit = 0;
    const Reduction loads = reduce(model, o);
    const auto same = [](const MatX& a, const MatX& b, const std::string& what) {
      ASSERT_EQ(a.size(), b.size()) << what;
      if (a.size() == 0) return;
      EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-4 * b.cwiseAbs().maxCoeff()) << what;
    };
    for (int a = 0; a < 3; ++a) {
      same(loads.body.nodes[1].phi2[a], pairs.body.nodes[1].phi2[a], "phi2");
      same(loads.body.nodes[1].psi2[a], pairs.body.nodes[1].psi2[a], "psi2");
      same(loads.body.md2[a], pairs.body.md2[a], "md2");
      same(loads.body.Cr1[a], pairs.body.Cr1[a], "Cr1");
    }
    for (int k = 0; k < 6; ++k) same(loads.body.J2[k], pairs.body.J2[k], "J2");
    EXPECT_GT(pairs.body.nodes[1].phi2[0].cwiseAbs().maxCoeff(), 0.0);
  }
}

// Beyond the limit of pairs a body without interfaces has what inertia stiffens, the same as by pairs.
TEST(ReduceStatic, StiffeningByInertiaWithoutInterfaces) {
  const FeModel model = rod();
  ReduceOptions o;
  o.modes = 4;
  o.node_count = 2;
  const Reduction pairs = reduce(model, o);
  o.stiffening_limit = 0;
  const Reduction loads = reduce(model, o);
  for (int k = 0; k < 6; ++k)
    EXPECT_LT((loads.body.J2[k] - pairs.body.J2[k]).cwiseAbs().maxCoeff(), 1e-4 * pairs.body.J2[k].cwiseAbs().maxCoeff()) << k;
  o.stiffening = false;
  EXPECT_GT((loads.body.J2[0] - reduce(model, o).body.J2[0]).cwiseAbs().maxCoeff(), 1e-2 * loads.body.J2[0].cwiseAbs().maxCoeff());
}

}  // namespace
}  // namespace flexframe::sim::test_reduce_static
