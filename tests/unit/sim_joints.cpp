// Every kind of joint: its derivatives against finite differences, the same joint as a hinge of the tree and as the one that closes a loop,
// momentum.
#include "mechanism_text.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/kinematics.h"
#include "sim/model/joint_motion.h"
#include "sim/scene/joint_kinds.h"
#include "sim/start/make_system.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace flexframe::sim::test_joints {
namespace {

// Every kind of which coordinates describe the motion and which a scene may name, as the table of kinds lists them.
std::vector<JointTraits> tree_kinds() {
  std::vector<JointTraits> out;
  for (const JointTraits& t : joint_kinds())
    if (t.place && !t.word.empty()) out.push_back(t);
  return out;
}

bool holds_nothing(const JointTraits& kind) { return kind.rates.size() == 6; }

class EveryJoint : public testing::TestWithParam<JointTraits> {};

std::string pitch(const JointTraits& kind) { return kind.pitch ? "pitch = 0.15\n" : ""; }

// A rate for each coordinate as a scene writes them.
std::string rates(const JointTraits& kind) {
  const double lengths[] = {0.4, -0.6, 0.3}, angles[] = {0.9, -1.2, 0.7};
  size_t m = 0, r = 0;
  std::string out;
  for (char unit : kind.rates) out += fmt::format("{}{}", out.empty() ? "" : ", ", unit == 'm' ? lengths[m++] : angles[r++]);
  return kind.rates.size() == 1 ? out : "[" + out + "]";
}

// Twist between two poses a step apart, in the axes of the middle one.
Vec6 difference(const Pose& from, const Pose& middle, const Pose& to, double step) {
  Vec6 out;
  out << middle.R.transpose() * (to.p - from.p), rotation_log(from.R.transpose() * to.R);
  return out / step;
}

// S w is the rate of the pose, the bias that of S w.
TEST_P(EveryJoint, SubspaceAndBiasAreDerivatives) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (const bool reversed : {false, true})
    for (const double far : {0.0, 1e-9, 0.4, 2.0}) {
      TreeJoint joint;
      joint.kind = GetParam().kind;
      joint.axis = Vec3(0.6, 0.0, 0.8);
      joint.pitch = 0.15;
      joint.reversed = reversed;
      const int nq = position_count(joint.kind), nv = rate_count(joint.kind);
      VecX q = VecX::Zero(8), w = VecX::Zero(8), turn = VecX::Zero(8);
      zero_coordinates(joint.kind, q.data());
      for (int k = 0; k < nv; ++k) w[k] = normal(random), turn[k] = far * normal(random);
      move_coordinates(joint.kind, q.data(), turn.data());
      const double h = 1e-5;
      JointMotion at, before, after;
      const auto evaluate = [&](double t, JointMotion& out) {
        // Along w, with the rates held: second order in t.
        VecX p = q, qd = VecX::Zero(8), mid = q;
        coordinate_rates(joint.kind, q.data(), w.data(), qd.data());
        mid.head(nq) += 0.5 * t * qd.head(nq);
        coordinate_rates(joint.kind, mid.data(), w.data(), qd.data());
        p.head(nq) += t * qd.head(nq);
        update_joint_position(joint, p.data(), out);
        update_joint_velocity(joint, p.data(), w.data(), out);
      };
      evaluate(0.0, at), evaluate(-h, before), evaluate(h, after);
      const Vec6 W = at.S.leftCols(nv) * w.head(nv);
      EXPECT_LT((W - at.W).cwiseAbs().maxCoeff(), 1e-12);
      EXPECT_LT((difference(before.pose, at.pose, after.pose, 2 * h) - W).cwiseAbs().maxCoeff(), 1e-7) << far << reversed;
      EXPECT_LT(((after.W - before.W) / (2 * h) - at.bias).cwiseAbs().maxCoeff(), 1e-7) << far << reversed;
      JointMotion alone;
      update_joint_pose(joint, q.data(), alone);
      // To the bit: what effects left out would move is told from a place that was made the other way.
      EXPECT_EQ(alone.pose.R, at.pose.R) << far << reversed;
      EXPECT_EQ(alone.pose.p, at.pose.p) << far << reversed;
    }
}

const char* body_a =
    "[[body]]\nname = \"a\"\nkind = \"rigid\"\nmass = 1.5\ninertia = [0.02, 0.03, 0.04]\ncentre_of_mass = [0.2, 0.05, 0]\nframes = { tip = "
    "[0.5, 0.1, 0], c = [0.2, 0.05, 0] }\n";
const char* body_b =
    "[[body]]\nname = \"b\"\nkind = \"rigid\"\nmass = 0.8\ninertia = [0.01, 0.02, 0.025]\ncentre_of_mass = [0.1, -0.1, 0.2]\nframes = { "
    "eye = [0.3, 0.2, 0.1], c = [0.1, -0.1, 0.2] }\n";

// Body b hangs on a by the joint; with `loose`, the words of a free joint's start, it is free as well, and the joint is what closes the
// loop.
std::string hung(const JointTraits& kind, const std::string& loose = "") {
  return head(0.4, Vec3(2.0, -9.0, 3.0)) + body_a + body_b +
         joint("base", "revolute", "ground", "a", "axis = [0, 0, 1]\ninitial = { value = 0.3, rate = 2 }\nspring = { stiffness = 5 }") +
         (loose.empty() ? "" : joint("loose", "free", "ground", "b", loose)) +
         joint("x", std::string(kind.word), "a.tip", "b", "axis = [0.6, 0, 0.8]\nrotation = [0.3, -0.2, 0.5]\n" + pitch(kind)) +
         output("eye", "b.eye", "position") + output("force", "x", "reaction") + output("v", "b", "velocity") +
         output("w", "b", "angular_velocity");
}

TEST_P(EveryJoint, ClosesALoopAsItHoldsATree) {
  if (holds_nothing(GetParam())) return;
  const Results tree = run(hung(GetParam()), 1e-10);
  const auto o = tree.bodies[1].orientation.row(0);
  const Vec3 p = tree.bodies[1].position.row(0).transpose(), turn = rotation_log(Quat(o[0], o[1], o[2], o[3]).toRotationMatrix()),
             v = positions(tree, "v").row(0).transpose(), w = positions(tree, "w").row(0).transpose();
  const Results loop =
      run(hung(GetParam(), fmt::format("initial = {{ value = [{:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}], rate = [{:.17g}, "
                                       "{:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}] }}",
                                       p.x(), p.y(), p.z(), turn.x(), turn.y(), turn.z(), v.x(), v.y(), v.z(), w.x(), w.y(), w.z())),
          1e-10);
  EXPECT_LT((positions(tree, "eye") - positions(loop, "eye")).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_LT((positions(tree, "force") - positions(loop, "force")).cwiseAbs().maxCoeff(), 1e-5);
  for (const Results* r : {&tree, &loop}) EXPECT_LT(energy_gap(*r), 1e-7 * (1.0 + r->kinetic.maxCoeff()));
}

// Rows, their matrix and the acceleration of the closure against differences, away from closed positions too; rigid and elastic bodies.
TEST_P(EveryJoint, ClosureIsDifferentiated) {
  if (!GetParam().closure || holds_nothing(GetParam())) return;  // no rows of their own
  for (const bool elastic : {false, true}) {
    const std::string beam =
        "[[body]]\nname = \"a\"\nkind = \"beam\"\nlength = 0.5\nsection = { shape = \"rectangle\", width = 0.02, height = 0.01 }\nmaterial "
        "= { density = 2700.0, youngs_modulus = 7e9 }\nmodel = \"modal\"\n"
        "modes = { bending_xy = [1, 2], bending_xz = [1], torsion = [1] }\neffects = [\"bending_xy\", \"bending_xz\", \"torsion\", "
        "\"stiffening\"]\n";
    System system = make_system(parse_scene(
        head(1, Vec3::Zero()) + (elastic ? beam : std::string(body_a)) + body_b + joint("base", "universal", "ground", "a", "") +
            joint("loose", "free", "ground", "b",
                  elastic ? "initial = { value = [0.5, 0, 0, 0, 0, 0] }" : "initial = { value = [0.5, 0.1, 0, 0, 0, 0] }") +
            joint("x", std::string(GetParam().word), "a.tip", "b", "axis = [0.6, 0, 0.8]"),
        "joints.toml"));
    const Model& model = system.model;
    Work& work = system.work;
    const int cluster = model.parts[0].cluster;
    const Cluster& c = model.clusters[cluster];
    ASSERT_EQ(c.loops.size(), 1u);
    std::mt19937 random(11);
    std::normal_distribution<double> normal;
    const auto move = [&](const VecX& dw) {
      for (int i : c.parts) {
        const Part& p = model.parts[i];
        move_coordinates(p.joint.kind, work.q.data() + p.q0, dw.data() + p.v0);
        for (int k = 0; k < p.body.n; ++k) work.q[p.eq0 + k] += dw[p.ev0 + k];
      }
    };
    const auto residual = [&]() {
      update_cluster_positions(model, cluster, work);
      update_closure_residual(model, cluster, work);
      return VecX(work.clusters[cluster].residual);
    };
    VecX offset(model.nv);
    for (const Part& p : model.parts) {
      for (int k = 0; k < p.joint.nv; ++k) offset[p.v0 + k] = 0.2 * normal(random);
      for (int k = 0; k < p.body.n; ++k) offset[p.ev0 + k] = 0.01 * normal(random);
    }
    move(offset);
    residual();
    update_closure_matrix(model, cluster, work);
    const MatX G = work.clusters[cluster].G;
    const VecX q = work.q;
    const double h = 1e-6;
    for (int k = 0; k < model.nv; ++k) {
      VecX step = VecX::Zero(model.nv);
      step[k] = h;
      move(step);
      const VecX plus = residual();
      work.q = q;
      move(-step);
      const VecX minus = residual();
      work.q = q;
      EXPECT_LT(((plus - minus) / (2 * h) - G.col(k)).cwiseAbs().maxCoeff(), 1e-7) << k << elastic;
    }
    // d/dt (G w) with the rates held is the bias.
    for (int k = 0; k < model.nv; ++k) work.w[k] = normal(random) * (elastic ? 0.1 : 1.0);
    const VecX w = work.w;
    work.clusters[cluster].partition.rows.clear();
    for (int r = 0; r < G.rows(); ++r) work.clusters[cluster].partition.rows.push_back(r);
    residual();
    update_cluster_velocities(model, cluster, work);
    update_closure_rates(model, cluster, work);
    const VecX bias = work.clusters[cluster].bias, rate = work.clusters[cluster].rate;
    EXPECT_LT((rate - G * w).cwiseAbs().maxCoeff(), 1e-10);
    const auto rows_along = [&](double t) {
      // Second order in t: halfway and on.
      move(VecX(t * w));
      residual();
      update_closure_matrix(model, cluster, work);
      const VecX out = work.clusters[cluster].G * w;
      work.q = q;
      return out;
    };
    const double step = 1e-5;
    EXPECT_LT(((rows_along(step) - rows_along(-step)) / (2 * step) - bias).cwiseAbs().maxCoeff(), 1e-5 * (1.0 + bias.cwiseAbs().maxCoeff()))
        << elastic;
  }
}

// Two bodies that fly with the joint between them: momentum, its moment about the origin, and energy stay.
TEST_P(EveryJoint, FlyingPairKeepsMomentum) {
  const JointTraits& kind = GetParam();
  if (holds_nothing(kind)) return;
  const std::string start =
      kind.rates.empty() ? "" : fmt::format("initial = {{ rate = {} }}\nspring = {{ stiffness = 3, damping = 0.1 }}", rates(kind));
  const Results r = run(head(0.6, Vec3::Zero()) + body_a + body_b +
                            joint("fly", "free", "ground", "a", "initial = { rate = [0.3, -0.2, 0.5, 1.0, -2.0, 0.7] }") +
                            joint("x", std::string(kind.word), "a.tip", "b", "axis = [0.6, 0, 0.8]\n" + pitch(kind) + start) +
                            output("pa", "a.c", "position") + output("pb", "b.c", "position") + output("va", "a.c", "velocity") +
                            output("vb", "b.c", "velocity") + output("wa", "a", "angular_velocity") + output("wb", "b", "angular_velocity"),
                        1e-10);
  const Vec3 Ja(0.02, 0.03, 0.04), Jb(0.01, 0.02, 0.025);
  Vec6 first = Vec6::Zero();
  double drift = 0.0;
  for (Eigen::Index i = 0; i < r.times.size(); ++i) {
    const auto at = [&](const char* name) { return Vec3(positions(r, name).row(i).transpose()); };
    const auto spin = [&](size_t body, const Vec3& J, const Vec3& w) {
      const auto o = r.bodies[body].orientation.row(i);
      const Mat3 R = Quat(o[0], o[1], o[2], o[3]).toRotationMatrix();
      return Vec3(R * J.cwiseProduct(R.transpose() * w));
    };
    Vec6 momentum;
    momentum << 1.5 * at("va") + 0.8 * at("vb"),
        1.5 * at("pa").cross(at("va")) + 0.8 * at("pb").cross(at("vb")) + spin(0, Ja, at("wa")) + spin(1, Jb, at("wb"));
    if (i == 0) first = momentum;
    drift = std::max(drift, (momentum - first).norm());
  }
  // A damper between turned axes of a planar joint is one on coordinates, whose forces are opposite all the same.
  EXPECT_LT(drift, 1e-7 * first.norm());
  EXPECT_LT(energy_gap(r), 1e-7 * r.kinetic[0]);
}

// The error goes down with the tolerance, nearly in proportion, whatever the integrator.
TEST_P(EveryJoint, ErrorFollowsTheTolerance) {
  for (const Method method : {Method::adams, Method::dirk}) {
    const std::string scene = hung(GetParam());
    const Eigen::MatrixX3d exact = positions(run(scene, 1e-12, Method::adams), "eye");
    const auto error = [&](double tolerance) { return (positions(run(scene, tolerance, method), "eye") - exact).cwiseAbs().maxCoeff(); };
    const double loose = error(1e-4), tight = error(1e-7);
    EXPECT_LT(loose, 3e-3);
    EXPECT_LT(tight, std::max(loose / 100.0, 1e-9)) << method_name(method) << loose;
  }
}

// A shaft turned at 3 rad/s, and one at an angle of half a radian to it. Joined by a constant-velocity joint they turn alike; joined by a
// cross (axes x and y of the shaft) the second turns at 3 cos(beta) / (1 - sin^2(beta) cos^2(turn)): between 3 cos(beta) and 3 / cos(beta).
TEST(ConstantVelocity, TurnsShaftsAlike) {
  const double beta = 0.5;
  const auto driven = [&](const std::string& kind, const std::string& axis) {
    return run(head(2.5, Vec3::Zero()) + body_a + body_b + joint("drive", "revolute", "ground", "a", "motion = \"3*t\"") +
                   joint("coupling", kind, "a", "b", axis) +
                   joint("bearing", "revolute", "ground", "b", fmt::format("rotation = [{}, 0, 0]", beta)) +
                   output("out", "bearing", "value") + output("rate", "bearing", "rate") + output("torque", "drive", "reaction"),
               1e-9);
  };
  const Results alike = driven("constant-velocity", "axis = [0, 0, 1]");
  EXPECT_LT((column(alike, "out") - 3.0 * alike.times).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_LT((column(alike, "rate").array() - 3.0).abs().maxCoeff(), 1e-8);
  const Results cross = driven("universal", "axis = [1, 0, 0]");
  EXPECT_NEAR(column(cross, "rate").maxCoeff(), 3.0 / std::cos(beta), 1e-3);
  EXPECT_NEAR(column(cross, "rate").minCoeff(), 3.0 * std::cos(beta), 1e-3);
}

// A crank's pin in the slot of a yoke, which is guided across its slot: x = r cos(angle), and the pin runs along the slot by r sin(angle),
// whichever body has the slot as parent (the slot's x is normal to the guide).
TEST(PinSlot, ScotchYoke) {
  const Results r = run(head(2.0, Vec3(0.0, -9.81, 0.0)) + body_a + body_b + joint("drive", "revolute", "ground", "a", "motion = \"5*t\"") +
                            joint("guide", "prismatic", "ground", "b", "axis = [1, 0, 0]\ninitial = { guess = 0.5 }") +
                            joint("pin", "pin-slot", "b", "a.tip", "rotation = [0, 0, \"90 deg\"]") + output("x", "guide", "value") +
                            output("pin", "a.tip", "position") + output("force", "guide", "reaction"),
                        1e-10);
  const Eigen::ArrayXd angle = 5.0 * r.times.array();
  EXPECT_LT((column(r, "x").array() - (0.5 * angle.cos() - 0.1 * angle.sin())).abs().maxCoeff(), 1e-9);
  EXPECT_LT((column(r, "pin.y").array() - (0.5 * angle.sin() + 0.1 * angle.cos())).abs().maxCoeff(), 1e-9);
  // The slot passes on no force along itself: the guide carries the yoke's weight alone.
  EXPECT_LT((column(r, "force.y").array() - 0.8 * 9.81).abs().maxCoeff(), 1e-6);
}

std::string name_of(const testing::TestParamInfo<JointTraits>& p) {
  std::string out(p.param.word);
  std::replace(out.begin(), out.end(), '-', '_');
  return out;
}

INSTANTIATE_TEST_SUITE_P(Kinds, EveryJoint, testing::ValuesIn(tree_kinds()), name_of);

}  // namespace
}  // namespace flexframe::sim::test_joints
