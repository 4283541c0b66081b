// Beams that bend in one plane as exact rods (rod_axis.h): places and energies against the integrated tangent, the equations of motion
// against Lagrange's and against the conservation laws, plane against space, and whole scenes against the elastica and chains of rigid
// links.
#include "sim/base/eigen_solvers.h"
#include "sim/base/spatial.h"
#include "sim/bodies/beam.h"
#include "sim/bodies/beam_kept.h"
#include "sim/bodies/normal_modes.h"
#include "sim/bodies/rod_axis.h"
#include "sim/scene/scene_reader.h"
#include "sim/simulate.h"

#include <gtest/gtest.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <random>

namespace flexframe::sim::test_rod_axis {
namespace {

constexpr int intervals = 240;

BeamDef slender(Boundary boundary) {
  BeamDef def;
  def.length = 1.3;
  def.section.area = 2.1e-4;
  def.section.iy = 1.2e-9;
  def.section.iz = 2.0e-9;
  def.section.j = 1.5e-9;
  def.section.shear_y = 0.8;
  def.section.shear_z = 0.7;
  def.material = {2700.0, 7e10, 0.3};
  def.boundary = boundary;
  def.elements = 6;
  def.all_elements = true;  // frames move no nodes
  def.modes = {{"axial", {1}}, {"bending_xy", {1, 2, 3}}, {"bending_xz", {1, 2, 3}}};
  for (int i = 1; i < intervals; ++i) def.frames[fmt::format("p{}", i)] = static_cast<double>(i) / intervals;
  return def;
}

struct Case {
  std::string name;
  FlexibleBody body;
  bool xy = true;
};

std::vector<Case> cases() {
  std::vector<Case> out;
  for (const bool xy : {true, false})
    for (const Boundary boundary : {Boundary::clamped_free, Boundary::free_free, Boundary::supported_supported, Boundary::supported_free}) {
      const BeamDef def = slender(boundary);
      const std::string where = fmt::format(", {}, boundary {}", xy ? "xy" : "xz", static_cast<int>(boundary));
      const BeamEffects bends{.bending_xy = xy, .bending_xz = !xy, .stiffening = true, .large_bending = true};
      BeamEffects all = bends;
      all.axial = true;
      out.push_back({"elements" + where, make_fe_beam(def, bends), xy});
      out.push_back({"eigenforms that stretch" + where, make_modal_beam(def, all), xy});
      all.shear = true;
      out.push_back({"elements that shear and stretch" + where, make_fe_beam(def, all), xy});
      MatX modes;
      out.push_back({"eigenmodes" + where, to_normal_modes(make_fe_beam(def, bends), modes), xy});
      if (boundary == Boundary::free_free) out.push_back({"kept modes" + where, make_kept_beam(def, bends, {2, 4, 4, 2}, {}).body, xy});
    }
  return out;
}

// Of the first modes; the largest rotation of a node is `size`.
VecX slopes(const FlexibleBody& body, unsigned seed, double size) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  const GeneralizedEigen eigen(body.Ke, body.Me);
  VecX q = VecX::Zero(body.n);
  for (Eigen::Index i = 0; i < std::min<Eigen::Index>(3, q.size()); ++i)
    q += number(generator) / std::pow(static_cast<double>(i + 1), 3) * eigen.eigenvectors().col(i);
  double largest = 0.0;
  for (const FlexibleNode& node : body.nodes) largest = std::max(largest, (node.psi * q).cwiseAbs().maxCoeff());
  return (size / largest) * q;
}

const FlexibleNode& node_at(const FlexibleBody& body, int i) {
  const std::string name = i == 0 ? "root" : i == intervals ? "tip" : fmt::format("p{}", i);
  return *std::find_if(body.nodes.begin(), body.nodes.end(), [&](const FlexibleNode& n) { return n.name == name; });
}

Vec3 place(const FlexibleBody& body, const FlexibleNode& node, const VecX& q) {
  Vec3 at = node.origin + node.phi * q;
  if (node.along.size() == 0) return at;
  RodState state;
  update_rod_fields(*body.rod, q, state);
  const Eigen::Vector2d beyond = rod_displacement(node.along, state);
  at[0] += beyond[0];
  at[body.rod->towards] += beyond[1];
  return at;
}

// Of a beam that only bends: the tangent integrated from the root by Simpson's rule, with the nodes' own rotations.
std::vector<Vec3> integrated(const FlexibleBody& body, const VecX& q, bool xy) {
  std::vector<Vec3> out{node_at(body, 0).phi * q};
  const double h = 2.0 * node_at(body, intervals).origin.x() / intervals;
  const auto tangent = [&](int i) {
    const Vec3 turned = node_at(body, i).psi * q;
    const double theta = xy ? turned.z() : -turned.y();
    return xy ? Vec3(std::cos(theta), std::sin(theta), 0.0) : Vec3(std::cos(theta), 0.0, std::sin(theta));
  };
  for (int i = 0; i + 2 <= intervals; i += 2) out.push_back(out.back() + h / 6.0 * (tangent(i) + 4.0 * tangent(i + 1) + tangent(i + 2)));
  return out;
}

MatX whole(const FlexibleBody& body, const BodyTerms& t) {
  MatX M(6 + body.n, 6 + body.n);
  M << t.Mrr, t.Mre, t.Mre.transpose(), elastic_mass(body, t);
  return M;
}
BodyTerms terms_at(const FlexibleBody& body, const VecX& q) {
  BodyTerms t;
  reserve(body, t);
  update_mass(body, q, t);
  return t;
}

TEST(RodAxis, PlacesFollowTheTurnedTangent) {
  for (const auto& [name, body, xy] : cases()) {
    ASSERT_TRUE(body.rod) << name;
    if (body.rod->stretch.size() + body.rod->shear.size() > 0) continue;
    for (const double size : {0.3, 1.2}) {
      const VecX q = slopes(body, 3, size);
      const std::vector<Vec3> exact = integrated(body, q, xy);
      double worst = 0.0;
      for (size_t i = 0; i < exact.size(); ++i)
        worst = std::max(worst, (place(body, node_at(body, 2 * static_cast<int>(i)), q) - exact[i]).norm());
      EXPECT_LT(worst, (size < 1.0 ? 2e-5 : 3e-4) * 1.3) << name << " at " << size;
    }
  }
}

TEST(RodAxis, KineticEnergyIsThatOfTheMovingAxis) {
  for (const auto& [name, one, xy] : cases()) {
    const FlexibleBody& body = one;
    if (body.rod->stretch.size() + body.rod->shear.size() > 0) continue;
    const VecX q = slopes(body, 5, 0.6), qd = slopes(body, 6, 2.0);
    Vec6 V;
    V << 0.3, -0.7, 0.5, 1.1, 0.4, -0.6;
    const double dt = 1e-5, h = 2.0 * 1.3 / intervals, mass = 2700.0 * 2.1e-4;
    const std::vector<Vec3> at = integrated(body, q, xy), before = integrated(body, q - dt * qd, xy),
                            after = integrated(body, q + dt * qd, xy);
    double exact = 0.0;
    for (size_t i = 0; i < at.size(); ++i) {
      const double weight = i == 0 || i + 1 == at.size() ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
      const Vec3 v = V.head<3>() + V.tail<3>().cross(at[i]) + (after[i] - before[i]) / (2.0 * dt);
      exact += weight * h / 3.0 * 0.5 * mass * v.squaredNorm();
    }
    // the sections' spin about the axis
    exact += 0.5 * 2700.0 * 3.2e-9 * 1.3 * V[3] * V[3];
    EXPECT_NEAR(kinetic_energy(body, terms_at(body, q), V, qd), exact, 5e-4 * exact) << name;
  }
}

TEST(RodAxis, AgreesWithTheSecondOrderFieldToItsOrder) {
  for (const auto& [boundary, shear] :
       {std::pair(Boundary::clamped_free, false), {Boundary::free_free, false}, {Boundary::free_free, true}}) {
    BeamDef def = slender(boundary);
    BeamEffects second{.axial = true, .bending_xy = true, .stiffening = true};
    second.shear = shear;
    if (shear) def.section.iy *= 1e4, def.section.iz *= 1e4;  // so that tilted sections count
    BeamEffects far = second;
    far.large_bending = true;
    const FlexibleBody series = make_fe_beam(def, second), rod = make_fe_beam(def, far);
    EXPECT_EQ(series.Ke, rod.Ke);
    const VecX q = slopes(rod, 3, 1.0), rest = VecX::Zero(rod.n);
    EXPECT_LT((whole(rod, terms_at(rod, rest)) - whole(series, terms_at(series, rest))).cwiseAbs().maxCoeff(), 1e-12 * rod.mass);
    const auto left = [&](double size) {
      const MatX d = whole(rod, terms_at(rod, size * q)) - whole(series, terms_at(series, size * q));
      return Eigen::Vector2d(d.topLeftCorner(6, 6).norm(), d.topRightCorner(6, rod.n).norm());
    };
    const Eigen::Vector2d ratio = left(0.02).cwiseQuotient(left(0.01));
    EXPECT_NEAR(ratio[0], 8.0, 0.5);
    EXPECT_NEAR(ratio[1], 4.0, 0.3);
  }
}

// Lagrange's equations of the elastic coordinates and Euler's of the frame, by differences of the kinetic energy alone.
TEST(RodAxis, VelocityTermsAreThoseOfTheKineticEnergy) {
  for (const auto& [name, one, xy] : cases()) {
    const FlexibleBody& body = one;
    const VecX q = slopes(body, 21, 0.5), qd = slopes(body, 22, 3.0);
    Vec6 V;
    V << 0.3, -0.7, 0.5, 1.1, 0.4, -0.6;
    BodyTerms t = terms_at(body, q);
    update_velocity_terms(body, V, qd, t);
    const auto momenta = [&](const VecX& at) {
      const BodyTerms s = terms_at(body, at);
      VecX out(6 + body.n);
      out << s.Mrr * V + s.Mre * qd, s.Mre.transpose() * V + elastic_mass(body, s) * qd;
      return out;
    };
    VecX size = VecX::Zero(body.n);  // rotation, or displacement per length, of a coordinate
    for (const FlexibleNode& node : body.nodes)
      size = size.cwiseMax(node.psi.colwise().norm().transpose()).cwiseMax(node.phi.colwise().norm().transpose());
    const double dt = 1e-5;
    VecX expected = (momenta(q + dt * qd) - momenta(q - dt * qd)) / (2.0 * dt);
    for (int k = 0; k < body.n; ++k) {
      VecX step = VecX::Zero(body.n);
      step[k] = 1e-5 / size[k];
      expected[6 + k] -=
          (kinetic_energy(body, terms_at(body, q + step), V, qd) - kinetic_energy(body, terms_at(body, q - step), V, qd)) / (2.0 * step[k]);
    }
    const VecX P = momenta(q);
    const Vec3 v = V.head<3>(), w = V.tail<3>(), p = P.head<3>(), L = P.segment<3>(3);
    expected.head<3>() += w.cross(p);
    expected.segment<3>(3) += w.cross(L) + v.cross(p);
    EXPECT_LT((t.cr - expected.head<6>()).norm(), 1e-6 * expected.head<6>().norm()) << name;
    EXPECT_LT((t.ce - expected.tail(body.n)).norm(), 1e-5 * expected.tail(body.n).norm()) << name;
  }
}

TEST(RodAxis, MotionInThePlaneIsThatInSpace) {
  for (const auto& [name, body, xy] : cases()) {
    // planar axes that are turned within the plane, and of either sense
    for (const double side : {1.0, -1.0}) {
      const Vec3 normal = side * (xy ? Vec3(Vec3::UnitZ()) : Vec3(Vec3::UnitY()));
      const Mat3 Q = rotation_exp(0.4 * normal) * axes_about(normal);
      const PlaneBody plane = in_plane(body, Q);
      PlaneTerms a;
      reserve(plane, a);
      const VecX q = slopes(body, 31, 0.7), qd = slopes(body, 32, 2.0);
      const Vec3 V(0.4, -0.9, 1.3);
      update_mass(plane, q, a);
      update_velocity_terms(plane, V, qd, a);
      BodyTerms b = terms_at(body, q);
      Vec6 twist;
      twist << V.x() * Q.col(0) + V.y() * Q.col(1), V.z() * Q.col(2);
      update_velocity_terms(body, twist, qd, b);
      const auto within = [&](const Vec6& F) {
        return Vec3(Q.col(0).dot(F.head<3>()), Q.col(1).dot(F.head<3>()), Q.col(2).dot(F.tail<3>()));
      };
      EXPECT_LT((a.cr - within(b.cr)).norm(), 1e-11 * b.cr.norm()) << name;
      EXPECT_LT((a.ce - b.ce).norm(), 1e-11 * b.ce.norm()) << name;
      EXPECT_LT((a.Mee - b.Mee).norm(), 1e-12 * b.Mee.norm()) << name;
      for (int k = 0; k < body.n; ++k) EXPECT_LT((a.Mre.row(k).transpose() - within(b.Mre.col(k))).norm(), 1e-11 * b.Mre.norm()) << name;
      EXPECT_NEAR(kinetic_energy(plane, a, V, qd), kinetic_energy(body, b, twist, qd), 1e-11 * kinetic_energy(body, b, twist, qd)) << name;
    }
  }
}

// EI = 1, 1 kg/m.
std::string rod(const std::string& mount, const std::string& model, double duration, const std::string& more, double g = 0.0) {
  return "[simulation]\noutput_rate = 20\ntolerance = 1e-7\n" + fmt::format("duration = {}\ngravity = [0, {}, 0]\n", duration, -g) + more +
         "[[body]]\nname = \"b\"\nkind = \"beam\"\nlength = 1.0\nsection = { shape = \"general\", area = 1e-4, iy = 1e-9, iz = 1e-9, j = "
         "2e-9 }\nmaterial = { density = 1e4, youngs_modulus = 1e9 }\neffects = [\"bending_xy\", \"stiffening\", \"large_bending\"]\n" +
         model + "[[joint]]\nname = \"p\"\nparent = \"ground\"\nchild = \"b.root\"\n" + mount +
         "[[output]]\nname = \"tip\"\nof = \"b.tip\"\nquantity = \"position\"\n"
         "[[output]]\nname = \"energy\"\nof = \"system\"\nquantity = \"energy\"\n";
}
constexpr const char* clamp = "kind = \"weld\"\n";

VecX history(const Results& r, const std::string& name) {
  return std::find_if(r.outputs.begin(), r.outputs.end(), [&](const ResultOutput& o) { return o.column == name; })->values;
}
Results simulated(const std::string& text) {
  SimulateOptions o;
  o.estimate_error = o.check_effects = false;
  return simulate(parse_scene(text, "rod.toml"), o);
}

// Elastica (Mattiasson 1981) under a dead load across its end.
TEST(RodAxis, StaticsAreTheElasticaInOneFrame) {
  for (const auto& [load, w, u] :
       {std::tuple{1.0, .3017207738, .0564332363}, std::tuple{2.0, .4934574804, .1606417208}, std::tuple{10.0, .8106090249, .5549955978}})
    for (const auto& [model, error] : {std::pair{"elements = 10\n", 4e-6}, std::pair{"elements = 24\nkeep_modes = 4\n", 4e-5},
                                       std::pair{"model = \"modal\"\nmodes = { bending_xy = [1, 2, 3, 4, 5] }\n", 1e-4}}) {
      const Results r = simulated(rod(clamp, model, 0.01, "start = \"static\"\n") +
                                  fmt::format("[[force]]\nkind = \"force\"\non = \"b.tip\"\ndirection = [0, 1, 0]\nvalue = {}\n", load));
      EXPECT_NEAR(history(r, "tip.y")[0], w, error) << model;
      EXPECT_NEAR(history(r, "tip.x")[0], 1.0 - u, error) << model;
    }
}

// A moment at the end bends the rod to an arc of its angle: its work is that of the true turn.
TEST(RodAxis, AMomentBendsToAnArc) {
  for (const double moment : {0.5, 2.0}) {
    const Results r = simulated(rod(clamp, "elements = 6\n", 0.01, "start = \"static\"\n") +
                                fmt::format("[[force]]\nkind = \"torque\"\non = \"b.tip\"\ndirection = [0, 0, 1]\nvalue = {}\n", moment));
    EXPECT_NEAR(history(r, "tip.x")[0], std::sin(moment) / moment, 1e-6);
    EXPECT_NEAR(history(r, "tip.y")[0], (1.0 - std::cos(moment)) / moment, 1e-6);
  }
}

// A plane scene does not show that a narrow strip, let go under a weight that bends it by more than a right angle, tips over sideways; one
// that bends its easy way does not.
TEST(RodAxis, NarrowBeamsThatMayTipOverAreTold) {
  for (const bool narrow : {true, false}) {
    const std::string scene = fmt::format(
        "[simulation]\nduration = 0.01\noutput_rate = 19000\ngravity = [0, {}, 0]\n[[body]]\nname = \"strip\"\nkind = \"beam\"\n"
        "length = 0.1\nsection = {{ shape = \"rectangle\", height = 0.0014, width = {} }}\n"
        "material = {{ density = 2700, youngs_modulus = 7e10 }}\n[[joint]]\nname = \"clamp\"\nkind = \"weld\"\nparent = \"ground\"\n"
        "child = \"strip\"\n[[output]]\nname = \"tip\"\nof = \"strip.tip\"\nquantity = \"position\"\n",
        -36800, narrow ? 0.0009 : 0.009);
    const Results r = simulate(parse_scene(scene, "strip.toml"), {});
    const std::vector<std::string> warnings = r.statistics.notes.texts(Severity::warning);
    const bool told = std::any_of(warnings.begin(), warnings.end(),
                                  [](const std::string& w) { return w.find("tip over sideways") != std::string::npos; });
    EXPECT_EQ(told, narrow) << fmt::format("{}", fmt::join(warnings, "; "));
  }
}

}  // namespace
}  // namespace flexframe::sim::test_rod_axis
