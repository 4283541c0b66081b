// The planar equations of motion and the structured Newton matrix against the equations in space, state by state.
#include "sim/dynamics/force_responses.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/line_stiffness.h"
#include "sim/dynamics/reduced_mass.h"
#include "sim/scene/scene_reader.h"
#include "sim/start/make_system.h"
#include "sim/time/newton_matrix.h"
#include "sim/time/sample_state.h"
#include "sim/time/unpack.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

namespace flexframe::sim::test_planar {
namespace {

System system_of(const std::string& text) { return make_system(parse_scene(text, "test.toml")); }

// States about the start: coordinates a hundredth, rates a tenth of a unit away, elastic ones a thousandth of that, and less by this power
// of their number.
VecX random_state(const System& system, std::mt19937& random, double falls = 0.0) {
  std::normal_distribution<double> normal;
  VecX y = pack_state(system, Eigen::Vector2d::Zero());
  int rate = system.model.nq;
  for (const Part& p : system.model.parts) {
    for (int k = 0; k < p.joint.nq; ++k) y[p.q0 + k] += 1e-2 * normal(random);
    for (int k = 0; k < p.body.n; ++k) y[p.eq0 + k] += 1e-5 * std::pow(k + 1.0, -falls) * normal(random);
  }
  for (size_t c = 0; c < system.model.clusters.size(); ++c)
    for (int k : system.work.clusters[c].partition.ind) {
      const int v = system.model.clusters[c].v0 + k;
      bool elastic = false;
      for (const Part& p : system.model.parts) elastic = elastic || (v >= p.ev0 && v < p.ev0 + p.body.n);
      y[rate++] += (elastic ? 1e-3 : 1e-1) * normal(random);
    }
  return y;
}

// A sample by the plane against the same by the equations in space.
void compare_samples(System& planar, System& spatial, const VecX& y) {
  if (!has_plane_samples(planar)) return;
  const Energy a = place_plane_sample(planar, 0.3, y.data()), b = place_space_sample(spatial, 0.3, y.data());
  const double size = 1e-10 * (1.0 + b.kinetic + b.strain + std::abs(b.potential));
  EXPECT_NEAR(a.kinetic, b.kinetic, size);
  EXPECT_NEAR(a.strain, b.strain, size);
  EXPECT_NEAR(a.potential, b.potential, size);
  const double speed = spatial.work.w.cwiseAbs().maxCoeff();
  EXPECT_LE((planar.work.q - spatial.work.q).cwiseAbs().maxCoeff(), 1e-11 * planar.model.size);
  EXPECT_LE((planar.work.w - spatial.work.w).cwiseAbs().maxCoeff(), 1e-10 * speed);
  for (size_t i = 0; i < planar.model.parts.size(); ++i) {
    const PartWork &p = planar.work.parts[i], &s = spatial.work.parts[i];
    EXPECT_LE((p.world.p - s.world.p).norm(), 1e-11 * planar.model.size) << planar.model.parts[i].name;
    EXPECT_LE((p.world.R - s.world.R).norm(), 1e-11) << planar.model.parts[i].name;
    EXPECT_LE((p.V - s.V).norm(), 1e-10 * speed * (1.0 + planar.model.size)) << planar.model.parts[i].name;
  }
  for (const Cluster& c : planar.model.clusters)
    for (const int f : c.frames) {
      const Pose a_frame = frame_world(planar.model, planar.work, f), b_frame = frame_world(spatial.model, spatial.work, f);
      EXPECT_LE((a_frame.p - b_frame.p).norm(), 1e-11 * planar.model.size) << planar.model.frames[f].name;
      EXPECT_LE((a_frame.R - b_frame.R).norm(), 1e-11) << planar.model.frames[f].name;
    }
}

// Four samples at once against the same by the plane's equations one by one; whether they could be placed.
bool compare_four(const std::string& text, double falls) {
  System together = system_of(text), single = system_of(text);
  std::vector<int> frames(together.model.frames.size());
  std::iota(frames.begin(), frames.end(), 0);
  if (!has_plane_samples(together) || !FourPlaces::fit(together.model, *together.plane, frames)) return false;
  FourPlaces places(together.model, together.work, *together.plane, frames);
  std::mt19937 random(11);
  const std::vector<double> times{0.03, 0.01, 0.02, 0.05};
  MatX states(4, state_size(together));
  const VecX start = pack_state(together, Eigen::Vector2d::Zero());
  for (int k = 0; k < 4; ++k) states.row(k) = (start + 0.2 * (random_state(together, random, falls) - start)).transpose();
  if (!place_four_samples(together, times.data(), states, places)) return false;
  const double size = together.model.size;
  for (const int k : {2, 0, 1, 3}) {
    SCOPED_TRACE(k);
    const auto at = static_cast<size_t>(k);
    const VecX y = states.row(k).transpose();
    place_plane_sample(single, times[at], y.data(), frames, false);
    bring_sample(together, times[at], places, k);
    EXPECT_EQ(together.work.time, times[at]);
    EXPECT_LE((together.work.q - single.work.q).cwiseAbs().maxCoeff(), 1e-12 * (1.0 + size));
    for (size_t i = 0; i < together.model.parts.size(); ++i) {
      const PartWork &a = together.work.parts[i], &b = single.work.parts[i];
      EXPECT_LE((a.world.p - b.world.p).norm(), 1e-12 * (1.0 + size)) << together.model.parts[i].name;
      EXPECT_LE((a.world.R - b.world.R).norm(), 1e-12 * (1.0 + size)) << together.model.parts[i].name;
      EXPECT_LE((a.q - b.q).cwiseAbs().sum(), 1e-12) << together.model.parts[i].name;
    }
    for (const int f : frames) {
      const Pose &a = together.work.frames[f].pose, &b = single.work.frames[f].pose;
      EXPECT_LE((a.p - b.p).norm() + (a.R - b.R).norm(), 1e-12) << together.model.frames[f].name;
    }
    for (const int i : together.work.carrying.following) {
      const int motion = together.model.parts[i].joint.motion;
      EXPECT_EQ(together.work.motion[motion].value, single.work.motion[motion].value);
    }
  }
  return true;
}

enum class Four { fits, does_not };

void compare(const std::string& text, double falls = 0.0, Four four = Four::fits) {
  EXPECT_EQ(compare_four(text, falls), four == Four::fits) << text;
  System planar = system_of(text), spatial = system_of(text);
  ASSERT_NE(planar.plane, nullptr);
  spatial.plane.reset();
  std::mt19937 random(7);
  for (int trial = 0; trial < 4; ++trial) {
    const VecX y = random_state(planar, random, falls);
    VecX a(y.size()), b(y.size());
    state_rate(planar, 0.3, y.data(), a.data());
    state_rate(spatial, 0.3, y.data(), b.data());
    // Elastic accelerations are of the size of frequency squared times the deflection: compared with the largest.
    const int rates = planar.model.nq;
    EXPECT_LE((a - b).head(rates).cwiseAbs().maxCoeff(), 1e-9 * (1.0 + b.head(rates).cwiseAbs().maxCoeff()));
    EXPECT_LE((a - b).tail(y.size() - rates).cwiseAbs().maxCoeff(), 1e-8 * (1.0 + b.tail(y.size() - rates).cwiseAbs().maxCoeff()));
    EXPECT_GT(b.tail(y.size() - rates).cwiseAbs().maxCoeff(), 1e-3);
    compare_samples(planar, spatial, y);
  }
}

std::string simulation(const std::string& gravity) { return "[simulation]\nduration = 1\ngravity = " + gravity + "\n"; }

std::string beam(const std::string& name, double length, int elements, const std::string& more = "") {
  return fmt::format(
      "[[body]]\nname = \"{}\"\nkind = \"beam\"\nlength = {}\nsection = {{ shape = \"circle\", diameter = 0.01 }}\n"
      "material = {{ density = 2700.0, youngs_modulus = 7e10 }}\nelements = {}\nframes = {{ middle = 0.5 }}\n{}\n",
      name, length, elements, more);
}

std::string block(const std::string& name, const std::string& more = "") {
  return fmt::format(
      "[[body]]\nname = \"{}\"\nkind = \"rigid\"\nmass = 0.3\ninertia = [1e-4, 2e-4, 3e-4]\ncentre_of_mass = [0.02, 0.01, 0.03]\n"
      "frames = {{ a = [0, 0.05, 0], b = [0.1, 0, 0.02] }}\n{}\n",
      name, more);
}

// A body with its mass in the plane of its joints.
std::string flat(const std::string& name, const std::string& centre) {
  return fmt::format(
      "[[body]]\nname = \"{}\"\nkind = \"rigid\"\nmass = 0.3\ninertia = [1e-4, 2e-4, 3e-4]\ncentre_of_mass = {}\n"
      "frames = {{ b = [0.1, 0, 0] }}\n",
      name, centre);
}

std::string joint(const std::string& name, const std::string& kind, const std::string& parent, const std::string& child,
                  const std::string& more = "") {
  return fmt::format("[[joint]]\nname = \"{}\"\nkind = \"{}\"\nparent = \"{}\"\nchild = \"{}\"\n{}\n", name, kind, parent, child, more);
}

std::string torque(const std::string& on, const std::string& axis) {
  return fmt::format("[[force]]\nkind = \"torque\"\non = \"{}\"\ndirection = {}\nvalue = \"0.3*cos(2*t)\"\n", on, axis);
}

TEST(Planar, BeamsInATreeWithLoads) {
  compare(
      simulation("[1, -9.81, 0]") + beam("one", 0.4, 4, "damping = { ratio = 0.02 }") + beam("two", 0.3, 3) +
      joint("base", "revolute", "ground", "one.root", "spring = { stiffness = 3, damping = 0.1, rest = 0.1 }\ninitial = { value = 0.4 }") +
      joint("elbow", "revolute", "one.tip", "two.root", "initial = { value = -0.7 }") + torque("two.middle", "[0, 0, 1]") +
      "[[force]]\nkind = \"force\"\non = \"two.tip\"\ndirection = [0, 1, 0]\nframe = \"body\"\nvalue = \"2\"\n"
      "[[force]]\nkind = \"force\"\non = \"one.middle\"\ndirection = [1, 0, 0]\nvalue = \"t\"\n"
      "[[force]]\nkind = \"distributed\"\non = \"one\"\ndirection = [0, -1, 0]\nvalue = \"5\"\n");
}

// Where bodies move in many modes of their own no mass matrix is made (reduced_mass.h): still the equations in space, and what loads
// change.
void compare_reduced(const std::string& text, bool loaded) {
  SCOPED_TRACE(text);
  compare(text, 2.0);
  System system = system_of(text);
  std::mt19937 random(3);
  const VecX y = random_state(system, random, 2.0);
  VecX a(y.size()), b(y.size()), kept;
  state_rate(system, 0.3, y.data(), a.data());
  bool reduced = false;
  for (const ClusterWork& cw : system.work.clusters) reduced = reduced || (!cw.partition.ind.empty() && cw.L.size() == 0);
  EXPECT_TRUE(reduced);
  if (!loaded) return;
  // Equations that another state has gone through meanwhile do not stand in for these.
  System other = system_of(text);
  const VecX elsewhere = random_state(other, random, 2.0);
  state_rate(other, 0.1, elsewhere.data(), b.data());
  keep_load_responses(system, kept);
  ASSERT_TRUE(follow_loads(system, 0.3, 0.9, kept, a.data()));
  System spatial = system_of(text);
  spatial.plane.reset();
  state_rate(spatial, 0.3, y.data(), b.data());
  keep_load_responses(spatial, kept);
  ASSERT_TRUE(follow_loads(spatial, 0.3, 0.9, kept, b.data()));
  EXPECT_LE((a - b).cwiseAbs().maxCoeff(), 1e-8 * b.cwiseAbs().maxCoeff());
  state_rate(system, 0.9, y.data(), b.data());
  EXPECT_LE((a - b).cwiseAbs().maxCoeff(), 1e-10 * b.cwiseAbs().maxCoeff());
  state_rate(system, 0.3, y.data(), b.data());
  EXPECT_GT((a - b).cwiseAbs().maxCoeff(), 1e-8 * b.cwiseAbs().maxCoeff());
}

TEST(Planar, ModesWithoutAMassMatrix) {
  const std::string in_plane = "effects = [\"bending_xy\", \"stiffening\"]", push = torque("rod.middle", "[0, 0, 1]");
  const auto rod = [&](int elements) { return beam("rod", 0.3, elements, in_plane); };
  compare_reduced(
      simulation("[1, -9.81, 0]") + rod(8) + push + joint("base", "revolute", "ground", "rod.root", "initial = { value = 0.4 }"), true);
  compare_reduced(simulation("[1, -9.81, 0]") + rod(8) + push +
                      joint("base", "planar", "ground", "rod.middle", "initial = { value = [0.1, 0.2, 0.3] }"),
                  true);
  // On what turns as prescribed.
  compare_reduced(simulation("[0, -9.81, 0]") + block("hub") + rod(8) +
                      joint("drive", "revolute", "ground", "hub", "motion = \"0.3 + 2*t + t^2\"") +
                      joint("hinge", "revolute", "hub.b", "rod.root", "initial = { value = 0.4 }"),
                  false);
  // Loops: with a block, with a point mass, with none, and two beams that pull each other.
  for (const std::string& slider :
       {flat("slider", "[0.02, 0.01, 0]"), std::string("[[body]]\nname = \"slider\"\nkind = \"rigid\"\nmass = 0.2\ninertia = [0, 0, 0]\n"),
        std::string("[[body]]\nname = \"slider\"\nkind = \"rigid\"\nmass = 0\ninertia = [0, 0, 0]\n")})
    compare_reduced(simulation("[1, -9.81, 0]") + beam("crank", 0.152, 4, in_plane) + rod(9) + slider + push +
                        joint("shaft", "revolute", "ground", "crank.root", "initial = { value = 0.5, rate = 3 }") +
                        joint("pin", "revolute", "crank.tip", "rod.root") + joint("wrist", "revolute", "rod.tip", "slider") +
                        joint("guide", "prismatic", "ground", "slider", "axis = [1, 0, 0]") +
                        "[[force]]\nkind = \"force\"\non = \"slider\"\ndirection = [1, 0, 0]\nvalue = \"3*t\"\n",
                    true);
  compare_reduced(simulation("[0, -9.81, 0]") + flat("left", "[0.05, 0, 0]") + rod(9) + flat("right", "[0.05, 0, 0]") + push +
                      joint("one", "revolute", "ground", "left", "initial = { value = 1.2 }") +
                      joint("two", "revolute", "left.b", "rod.root") + joint("three", "revolute", "rod.tip", "right.b") +
                      joint("four", "revolute", "ground", "right", "position = [0.3, 0, 0]"),
                  true);
}

TEST(Planar, RigidBodiesWithSlidersAndPlanarJoints) {
  compare(simulation("[0, -9.81, 0]") + block("cart") + block("arm") + block("puck") +
          joint("rail", "prismatic", "ground", "cart.a", "axis = [0.6, 0.8, 0]\nspring = { stiffness = 100, damping = 2, rest = 0 }") +
          joint("hinge", "revolute", "cart.b", "arm.a") +
          joint("table", "planar", "arm.b", "puck.b", "initial = { value = [0.1, 0.2, 0.3] }") + torque("arm.b", "[0, 0, 1]"));
}

TEST(Planar, AxesAgainstThePlaneAndReversedJoints) {
  // Axes the other way round; the slider's tree runs from its child to its parent.
  compare(simulation("[0, -9.81, 0]") + block("one") + block("end") + joint("base", "revolute", "ground", "one", "axis = [0, 0, -1]") +
          joint("slide", "prismatic", "end.a", "one.b", "axis = [0, 1, 0]"));
  compare(simulation("[0, -9.81, 0]") + block("arm") + block("end") + joint("base", "revolute", "ground", "arm", "axis = [0, 0, -1]") +
          joint("disc", "planar", "end.b", "arm.b", "axis = [0, 0, -1]\ninitial = { value = [0.1, 0.1, 0.2] }"));
}

TEST(Planar, LoopsThroughElasticBodies) {
  // The blocks' masses lie beside the plane: beams that could would twist out of it.
  const std::string in_plane = "effects = [\"bending_xy\", \"stiffening\"]";
  compare(simulation("[0, 0, 0]") + beam("crank", 0.152, 3, in_plane) + beam("rod", 0.304, 4, in_plane) + block("slider") +
          joint("shaft", "revolute", "ground", "crank.root", "initial = { value = 0.5, rate = 3 }") +
          joint("pin", "revolute", "crank.tip", "rod.root") + joint("wrist", "revolute", "rod.tip", "slider") +
          joint("guide", "prismatic", "ground", "slider", "axis = [1, 0, 0]") + torque("crank.tip", "[0, 0, 1]"));
  // Driven four-bar with a flexible coupler, closed at the coupler's tip.
  compare(simulation("[0, -9.81, 0]") + block("left") + beam("coupler", 0.3, 4, in_plane) + block("right") +
          joint("drive", "revolute", "ground", "left", "motion = \"0.3 + 2*t\"") +
          joint("p1", "revolute", "left.b", "coupler.root", "initial = { value = 0.4 }") +
          joint("g2", "revolute", "ground", "right", "position = [0.35, 0, 0.02]") +
          "[[joint]]\nname = \"p2\"\nkind = \"point-on-line\"\nparent = \"right\"\nchild = \"coupler.tip\"\naxis = [1, 0, 0]\n");
}

TEST(Planar, AnyPlaneInTheWorld) {
  // The pendulum about an axis that is none of the world's, beam rolled about itself so that it bends in the plane.
  const Vec3 n = Vec3(1.0, 2.0, -0.5).normalized();
  const Vec3 along = n.cross(Vec3::UnitX()).normalized();
  Mat3 R;
  R << along, n.cross(along), n;
  const Vec3 turn = rotation_log(R), g = R * Vec3(0.0, -9.81, 0.0);
  compare(simulation(fmt::format("[{:.17g}, {:.17g}, {:.17g}]", g.x(), g.y(), g.z())) + beam("rod", 0.4, 5) +
          joint("pivot", "revolute", "ground", "rod.root",
                fmt::format("axis = [0, 0, 1]\nrotation = [{:.17g}, {:.17g}, {:.17g}]", turn.x(), turn.y(), turn.z())));
}

TEST(Planar, SpringDamperBetweenFrames) {
  compare(simulation("[0, -9.81, 0]") + block("one") + block("two") + joint("j1", "revolute", "ground", "one") +
          joint("j2", "revolute", "ground", "two", "position = [0.3, 0, 0]") +
          "[[force]]\nkind = \"spring-damper\"\non = \"two.a\"\nfrom = \"one.a\"\nstiffness = 50\ndamping = 3\nrest = 0.1\n");
}

TEST(Planar, MotionsFeedInTheSamePower) {
  // A driven shaft with a beam on it; a driven slide.
  const std::string within = "effects = [\"bending_xy\", \"stiffening\"]";
  compare(simulation("[0, -9.81, 0]") + beam("arm", 0.4, 3, within) + block("end") +
          joint("shaft", "revolute", "ground", "arm.root", "motion = \"0.4 + 2*t + sin(3*t)\"") +
          joint("wrist", "revolute", "arm.tip", "end.a", "initial = { value = 0.3 }") + torque("end.b", "[0, 0, 1]"));
  compare(simulation("[0, -9.81, 0]") + block("cart") + block("arm") +
          joint("rail", "prismatic", "ground", "cart", "axis = [1, 0, 0]\nmotion = \"0.1*sin(5*t)\"") +
          joint("hinge", "revolute", "cart.b", "arm.a", "spring = { stiffness = 2, damping = 0.1, rest = 0 }"));
}

TEST(Planar, FrictionWithGivenAndOwnReactions) {
  const std::string given = "friction = { coefficient = 0.3, normal_force = 5, radius = 0.02 }";
  const std::string own = "friction = { coefficient = 0.2, normal_force = \"reaction\", radius = 0.02 }";
  const std::string smooth = "friction = { coefficient = 0.2, normal_force = \"reaction\", regularised = 0.1 }";
  compare(simulation("[0, -9.81, 0]") + block("one") + beam("two", 0.3, 3, "effects = [\"bending_xy\"]") +
          joint("base", "revolute", "ground", "one", given + "\ninitial = { rate = 1 }") +
          joint("elbow", "revolute", "one.b", "two.root", own + "\ninitial = { rate = -1 }"));
  // A loop whose slider rubs on its guide, by the guide's own force where all lies in one plane.
  const std::string crank = flat("crank", "[0.02, 0.01, 0]") + flat("rod", "[0.05, 0, 0]") + flat("slider", "[0, 0.01, 0]") +
                            joint("shaft", "revolute", "ground", "crank", "initial = { value = 0.5, rate = 3 }") +
                            joint("pin", "revolute", "crank.b", "rod") + joint("wrist", "revolute", "rod.b", "slider");
  compare(simulation("[0, -9.81, 0]") + crank + joint("guide", "prismatic", "ground", "slider", "axis = [1, 0, 0]\n" + given));
  compare(simulation("[0, -9.81, 0]") + crank + joint("guide", "prismatic", "ground", "slider", "axis = [1, 0, 0]\n" + own));
  compare(simulation("[0, -9.81, 0]") + crank + joint("guide", "prismatic", "ground", "slider", "axis = [1, 0, 0]\n" + smooth));
}

TEST(Planar, TablesBushingsAndSpringsThatLeaveThePlane) {
  compare(simulation("[0, -9.81, 0]") + block("one") + block("two") + joint("j1", "revolute", "ground", "one") +
          joint("j2", "revolute", "one.b", "two.a") +
          "[[force]]\nkind = \"torque\"\non = \"one.b\"\ndirection = [0, 0, 1]\n"
          "value = { table = [[-1, 0.2], [0, 0.5], [1, -0.3], [2, 0.1]], of = \"j1\" }\n" +
          "[[force]]\nkind = \"force\"\non = \"two.b\"\ndirection = [0.3, 1, 2]\nvalue = \"0.2 + t\"\n" +
          "[[force]]\nkind = \"bushing\"\non = \"two.b\"\nfrom = \"one.a\"\nstiffness = [10, 20, 30, 1, 2, 3]\n"
          "damping = [0.1, 0.2, 0.3, 0.01, 0.02, 0.03]\n" +
          "[[force]]\nkind = \"spring-damper\"\non = \"two.b\"\nfrom = \"one.a\"\nstiffness = 50\ndamping = 3\nrest = 0.1\n");
}

TEST(Planar, LumpedBeamsAndSpringsAcrossALoop) {
  compare(simulation("[0, -9.81, 0]") +
          beam("chain", 0.4, 5, "model = \"lumped\"\neffects = [\"bending_xy\"]\ndamping = { ratio = 0.02 }") +
          joint("base", "revolute", "ground", "chain.root", "initial = { value = 0.4 }"));
  compare(simulation("[0, -9.81, 0]") + flat("left", "[0.02, 0.01, 0]") + flat("coupler", "[0.05, 0, 0]") + flat("right", "[0.03, 0, 0]") +
          joint("g1", "revolute", "ground", "left", "initial = { value = 1.2, rate = 1 }") + joint("p1", "revolute", "left.b", "coupler") +
          joint("p2", "revolute", "coupler.b", "right.b", "spring = { stiffness = 3, damping = 0.1, rest = 0.2 }") +
          joint("g2", "revolute", "ground", "right", "position = [0.12, 0, 0]"));
}

TEST(Planar, FrictionAgainstForcesAcrossThePlaneIsComputedInSpace) {
  const std::string own = "friction = { coefficient = 0.2, normal_force = \"reaction\", radius = 0.02 }";
  const auto plane = [&](const std::string& gravity, const std::string& centre) {
    return system_of(simulation(gravity) +
                     "[[body]]\nname = \"one\"\nkind = \"rigid\"\nmass = 0.3\ninertia = [1e-4, 2e-4, 3e-4]\ncentre_of_mass = " + centre +
                     "\n" + joint("j", "revolute", "ground", "one", own))
        .plane;
  };
  EXPECT_NE(plane("[0, -9.81, 0]", "[0.1, 0, 0.05]"), nullptr);
  EXPECT_EQ(plane("[0, -9.81, 1]", "[0.1, 0, 0]"), nullptr);
}

TEST(Planar, SpatialScenesAreLeftAlone) {
  EXPECT_EQ(system_of(simulation("[0, 0, 0]") + block("one") + joint("ball", "spherical", "ground", "one")).plane, nullptr);
  EXPECT_EQ(system_of(simulation("[0, 0, 0]") + block("one") + block("two") + joint("z", "revolute", "ground", "one") +
                      joint("x", "revolute", "one.b", "two", "axis = [1, 0, 0]"))
                .plane,
            nullptr);
}

// Derivative of the accelerations along a change of the states from `first` on, by central differences. For scenes without blocks.
VecX slope_along(System& system, const VecX& y, Eigen::Index first, const VecX& change, double step) {
  VecX at = y, plus(y.size()), minus(y.size());
  at.segment(first, change.size()) += step * change;
  state_rate(system, 0.0, at.data(), plus.data());
  at.segment(first, change.size()) -= 2.0 * step * change;
  state_rate(system, 0.0, at.data(), minus.data());
  return (plus - minus).segment(system.model.nq, y.size() - system.model.nq - (system.quadrature ? 2 : 0)) / (2.0 * step);
}

// All columns for the exponential method: those of the rates are made where the places are, about rates that may be known.
TEST(NewtonMatrix, AllColumnsAreDifferencesOfTheRates) {
  // Few modes: with stiff ones the differences are of the rates' last digits.
  const std::string in_plane = "effects = [\"bending_xy\", \"stiffening\"]\nkeep_modes = 2\nkeep_static = false";
  System system = system_of(simulation("[1, -9.81, 0]") + beam("crank", 0.152, 3, in_plane) + beam("rod", 0.304, 4, in_plane) +
                            block("slider") + joint("shaft", "revolute", "ground", "crank.root", "initial = { value = 0.5, rate = 3 }") +
                            joint("pin", "revolute", "crank.tip", "rod.root") + joint("wrist", "revolute", "rod.tip", "slider") +
                            joint("guide", "prismatic", "ground", "slider", "axis = [1, 0, 0]") + torque("crank.tip", "[0, 0, 1]"));
  std::mt19937 random(5);
  const VecX y = random_state(system, random);
  VecX rates(y.size()), other(y.size());
  state_rate(system, 0.2, y.data(), rates.data());
  system.weights.begin(system, Method::exponential, y);
  MatX A, B, A_again, B_again;
  difference_rates(system, 0.2, y.data(), nullptr, A, B);
  state_rate(system, 0.2, y.data(), rates.data());
  const long before = system.evaluations;
  difference_rates(system, 0.2, y.data(), rates.data(), A_again, B_again);
  EXPECT_EQ(A, A_again);
  EXPECT_EQ(B, B_again);
  EXPECT_EQ(system.evaluations - before, 2 * A.rows());
  const int nq = system.model.nq, nw = static_cast<int>(B.rows());
  const double size = B.cwiseAbs().maxCoeff();
  ASSERT_GT(size, 1.0);
  for (int k = 0; k < nw; ++k) {
    const double step = 1e-4 * std::max(1e-2, std::abs(y[nq + k]));
    VecX at = y, plus(y.size()), minus(y.size());
    at[nq + k] += step;
    state_rate(system, 0.2, at.data(), plus.data());
    at[nq + k] -= 2.0 * step;
    state_rate(system, 0.2, at.data(), minus.data());
    EXPECT_LE(((plus - minus).segment(nq, nw) / (2.0 * step) - B.col(k)).cwiseAbs().maxCoeff(), 1e-3 * size) << k;
  }
}

// A and B against central differences of the rates along T, where everything is differenced and where the stiffness is known in
// closed form (then only what stiffness gives is there: the elastic columns to a few percent).
TEST(NewtonMatrix, IsTheDerivative) {
  const std::string rigid = simulation("[0, -9.81, 0]") + block("one") + block("two") +
                            joint("base", "spherical", "ground", "one", "rate = 0\n") + joint("hinge", "universal", "one.b", "two");
  std::string spherical = rigid;
  spherical.erase(spherical.find("rate = 0\n"), 9);
  const std::string elastic =
      simulation("[0, 0, 0]") + beam("rod", 0.4, 3, "damping = { ratio = 0.1 }") + joint("pivot", "revolute", "ground", "rod.root");
  for (const std::string& text : {spherical, elastic}) {
    System system = system_of(text);
    std::mt19937 random(3);
    VecX y = random_state(system, random);
    VecX rate(y.size()), plus(y.size());
    system.weights.begin(system, Method::dirk, y);
    state_rate(system, 0.0, y.data(), rate.data());
    MechanicalJacobian j;
    update_newton_matrix(system, 0.0, y.data(), nullptr, {}, j);
    const int nq = system.model.nq, nw = static_cast<int>(j.A.rows());
    const MatX P = j.P.dense(), T = j.T.dense();
    // What pieces of mass and stiffness stand for: columns of A are -M^-1 K, of B -M^-1 D.
    EXPECT_EQ(j.pieces.empty(), text == spherical);
    std::vector<char> by_pieces(static_cast<size_t>(nw), j.pieces.empty() ? 0 : 1);
    for (const int k : j.beside) by_pieces[static_cast<size_t>(k)] = 0;
    for (const MechanicalJacobian::Piece& piece : j.pieces) {
      const Eigen::Index n = piece.mass.rows();
      EXPECT_EQ((piece.mass - piece.mass.transpose()).cwiseAbs().maxCoeff(), 0.0);
      const MatX K = piece.stiffness.size() > 0 ? piece.stiffness : MatX(piece.diagonal.asDiagonal());
      const MatX A = -piece.mass.ldlt().solve(K);
      for (Eigen::Index k = 0; k < n; ++k)
        if (by_pieces[static_cast<size_t>(piece.first + k)]) j.A.col(piece.first + k).segment(piece.first, n) = A.col(k);
    }
    EXPECT_LE((P * T - MatX::Identity(nw, nw)).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LE((T * y.segment(nq, nw) - rate.head(nq)).cwiseAbs().maxCoeff(), 1e-12 * (1.0 + rate.head(nq).cwiseAbs().maxCoeff()));
    const double largest = j.A.cwiseAbs().maxCoeff();
    for (int k = 0; k < nw; ++k) {
      const VecX column = slope_along(system, y, 0, T.col(k), 1e-6);
      EXPECT_LE((column - j.A.col(k)).cwiseAbs().maxCoeff(), 1e-4 * largest) << k;
    }
    // Joints' columns of B, and what they are made by: accelerations beside a state whose positions stay.
    for (const int k : j.beside) {
      const VecX column = slope_along(system, y, nq + k, VecX::Ones(1), 1e-4);
      EXPECT_LE((column - j.B.col(k)).cwiseAbs().maxCoeff(), 1e-4 * (1.0 + column.cwiseAbs().maxCoeff())) << k;
    }
    VecX faster = y, beside(nw);
    faster.segment(nq, nw) *= 1.3;
    state_rate(system, 0.0, faster.data(), plus.data());
    for (const bool masses : {false, true}) {
      state_rate(system, 0.0, y.data(), rate.data());
      accelerate_beside(system, faster.data(), masses, beside.data());
      EXPECT_LE((beside - plus.segment(nq, nw)).cwiseAbs().maxCoeff(), 1e-9 * plus.segment(nq, nw).cwiseAbs().maxCoeff()) << masses;
    }
  }
}

// From forces on the independent rates, at the state evaluated last, to accelerations.
void respond(System& system, MatX& X) {
  if (system.plane) {
    PlaneWork work(system.work, *system.plane);
    complete_mass_matrices(system.model, work);
    force_responses(system.model, work, X);
  } else {
    complete_mass_matrices(system.model, system.work);
    force_responses(system.model, system.work, X);
  }
}

// Bodies that hang on flexible ones: what stiffness and damping of each make of all accelerations, at rest, in a plane and in space,
// through links, loops that are carried, and parts that a motion drives.
TEST(NewtonMatrix, OfBodiesThatFlexibleOnesCarry) {
  const std::string damped = "damping = { ratio = 0.1 }", in_plane = damped + "\neffects = [\"bending_xy\", \"axial\"]";
  const std::string all = damped + "\neffects = [\"bending_xy\", \"bending_xz\", \"torsion\", \"axial\"]";
  const std::string rods = beam("rod", 0.4, 3, in_plane) + joint("pivot", "revolute", "ground", "rod.root") +
                           beam("arm", 0.3, 2, in_plane) + joint("elbow", "revolute", "rod.tip", "arm.root", "initial = { value = 0.7 }");
  const std::string centre = "[0.02, 0.01, 0]";
  const std::string link = flat("one", centre) + joint("wrist", "revolute", "arm.tip", "one", "initial = { value = -0.4 }") +
                           flat("two", centre) + joint("finger", "revolute", "one.b", "two");
  const std::string loop = flat("base", centre) + joint("h", "revolute", "arm.tip", "base") + flat("crank", centre) +
                           joint("a", "revolute", "base", "crank", "initial = { value = 1.0 }") + beam("coupler", 0.1, 2, in_plane) +
                           joint("b", "revolute", "crank.b", "coupler.root") + flat("rocker", centre) +
                           joint("c", "revolute", "base.b", "rocker", "initial = { value = 1.0 }") +
                           joint("d", "revolute", "rocker.b", "coupler.tip");
  const std::string driven = beam("hand", 0.2, 2, in_plane) + joint("turns", "revolute", "arm.tip", "hand.root", "motion = \"0.3\"");
  const std::string space = beam("mast", 0.5, 3, all) + joint("foot", "weld", "ground", "mast.root") + beam("boom", 0.4, 3, all) +
                            joint("slew", "revolute", "mast.tip", "boom.root", "axis = [0, 1, 0]\nrotation = [0, 0, 1]") + block("load") +
                            joint("rope", "spherical", "boom.tip", "load");
  for (const std::string& text : {rods, rods + link, rods + loop, rods + driven, space}) {
    System system = system_of(simulation("[0, 0, 0]") + text);
    EXPECT_EQ(system.plane == nullptr, text == space);
    const VecX y = pack_state(system, Eigen::Vector2d::Zero());
    VecX rate(y.size());
    state_rate(system, 0.0, y.data(), rate.data());
    // Forces of the elastic coordinates' stiffness, of which every one is an independent rate.
    const Model& model = system.model;
    const int nq = model.nq;
    std::vector<std::pair<int, int>> elastic;  // part, coordinate; -1: a joint's rate
    for (size_t c = 0; c < model.clusters.size(); ++c)
      for (const int k : system.work.clusters[c].partition.ind) {
        const int v = model.clusters[c].v0 + k;
        elastic.emplace_back(-1, 0);
        for (int i : model.clusters[c].parts)
          if (const Part& p = model.parts[i]; v >= p.ev0 && v < p.ev0 + p.body.n) elastic.back() = {i, v - p.ev0};
      }
    const Eigen::Index nw = std::ssize(elastic);
    MatX X = MatX::Zero(nw, nw);
    for (Eigen::Index r = 0; r < nw; ++r)
      for (Eigen::Index c = 0; c < nw; ++c)
        if (const auto& a = elastic[r], &b = elastic[c]; a.first >= 0 && a.first == b.first)
          X(r, c) = -model.parts[a.first].body.Ke(a.second, b.second);
    respond(system, X);
    system.weights.begin(system, Method::dirk, y);
    MechanicalJacobian j;
    update_newton_matrix(system, 0.0, y.data(), nullptr, {}, j);
    const MatX T = j.T.dense();
    ASSERT_EQ(j.A.rows(), nw);
    int seen = 0;
    for (Eigen::Index k = 0; k < nw; ++k) {
      const VecX column = slope_along(system, y, 0, T.col(k), 1e-6), faster = slope_along(system, y, nq + k, VecX::Ones(1), 1e-4);
      EXPECT_LE((column - j.A.col(k)).cwiseAbs().maxCoeff(), 1e-6 * j.A.cwiseAbs().maxCoeff()) << k << text;
      EXPECT_LE((faster - j.B.col(k)).cwiseAbs().maxCoeff(), 1e-6 * j.B.cwiseAbs().maxCoeff()) << k << text;
      if (elastic[k].first < 0) continue;
      EXPECT_LE((column - X.col(k)).cwiseAbs().maxCoeff(), 1e-6 * X.cwiseAbs().maxCoeff()) << k << text;
      ++seen;
    }
    EXPECT_GE(seen, 8);
    if (text != space) continue;
    // In space the matrix itself goes by them.
    state_rate(system, 0.0, y.data(), rate.data());
    update_closed_matrix(system, y.data(), j);
    EXPECT_EQ((j.A.colwise().squaredNorm().array() > 0.0).count(), seen);
  }
}

// Springs, dampers, cables and bushings between frames, of bodies that flexible ones carry: what they make of all accelerations, without
// pull and, where levers turn by less than a thousandth, with one.
TEST(NewtonMatrix, OfSpringsBetweenFrames) {
  const std::string plane = "effects = [\"bending_xy\", \"axial\"]";
  const std::string space = "effects = [\"bending_xy\", \"bending_xz\", \"torsion\", \"axial\"]";
  const auto arms = [](const std::string& effects, const std::string& axis) {
    return beam("mast", 0.5, 4, effects) + joint("foot", "revolute", "ground", "mast.root", axis) + beam("boom", 0.4, 4, effects) +
           joint("slew", "revolute", "mast.tip", "boom.root", axis + "\ninitial = { value = 0.8 }") + flat("load", "[0.02, 0.01, 0]") +
           joint("hangs", "revolute", "boom.tip", "load", axis + "\ninitial = { value = 0.3 }");
  };
  const std::string spring =
      "[[force]]\nname = \"s\"\nkind = \"spring-damper\"\non = \"load.b\"\nfrom = \"mast.middle\"\nstiffness = 2e4\ndamping = 30\n";
  const std::string cable =
      "[[force]]\nname = \"s\"\nkind = \"cable\"\non = \"load.b\"\nthrough = [\"boom.middle\", \"mast.tip\"]\nfrom = \"ground\"\n"
      "stiffness = 2e4\n";
  const std::string bushing =
      "[[force]]\nname = \"s\"\nkind = \"bushing\"\non = \"load.b\"\nfrom = \"ground.held\"\nstiffness = [2e4, 3e4, 0, 0, 0, 50]\n"
      "damping = [30, 20, 0, 0, 0, 0.1]\n";
  // The ground's frame where the bushing is at rest.
  const auto held_at = [](const Pose& at) {
    std::string rows;
    for (int i = 0; i < 3; ++i) rows += fmt::format("[{:.17g}, {:.17g}, {:.17g}],", at.R(i, 0), at.R(i, 1), at.R(i, 2));
    return fmt::format("[ground]\nframes = {{ held = {{ position = [{:.17g}, {:.17g}, {:.17g}], rotation = {{ matrix = [{}] }} }} }}\n",
                       at.p.x(), at.p.y(), at.p.z(), rows);
  };
  const auto length_of = [](const System& system) {
    const Load& load = system.model.loads.front();
    const std::vector<int> path = load.path.empty() ? std::vector<int>{load.from, load.on} : load.path;
    double length = 0.0;
    for (size_t k = 1; k < path.size(); ++k)
      length += (frame_world(system.model, system.work, path[k]).p - frame_world(system.model, system.work, path[k - 1]).p).norm();
    return length;
  };
  struct Case {
    std::string bodies, line;
    double stretch, within;  // of the rest; of the largest entry
  };
  for (const Case& c : {Case{arms(plane, ""), spring, 0.0, 1e-6}, Case{arms(space, "axis = [0, 0.6, 0.8]"), spring, 0.0, 1e-6},
                        Case{arms(plane, ""), cable, 1e-6, 1e-4}, Case{arms(space, "axis = [0, 0.6, 0.8]"), cable, 1e-6, 1e-4},
                        Case{arms(space, "axis = [0, 0.6, 0.8]"), spring, 1e-6, 1e-4}, Case{arms(plane, ""), bushing, 0.0, 1e-6},
                        Case{arms(space, "axis = [0, 0.6, 0.8]"), bushing, 0.0, 1e-6}}) {
    std::string text = simulation("[0, 0, 0]") + c.bodies;
    if (c.line == bushing) {
      const System there = system_of(text + held_at({}) + c.line);
      text += held_at(pose_in_space(there.model, there.work, there.model.loads.front().on)) + c.line;
    } else {
      const double length = length_of(system_of(text + c.line + "rest = 9.0\n"));
      text += c.line + fmt::format("rest = {:.17g}\n", length * (1.0 - c.stretch));
    }
    System system = system_of(text);
    const Model& model = system.model;
    const VecX y = pack_state(system, Eigen::Vector2d::Zero());
    VecX rate(y.size());
    state_rate(system, 0.0, y.data(), rate.data());
    const auto lines_of = [&](System& of) {
      return of.plane ? line_stiffness(model, PlaneWork(of.work, *of.plane)) : line_stiffness(model, of.work);
    };
    const LineStiffness lines = lines_of(system);
    MatX K = -lines.forces * lines.stiffness.asDiagonal() * lines.forces.transpose();
    MatX D = -lines.forces * lines.damping.asDiagonal() * lines.forces.transpose();
    std::vector<char> elastic;
    std::vector<int> at;
    for (size_t k = 0; k < model.clusters.size(); ++k)
      for (const int i : system.work.clusters[k].partition.ind) {
        const int v = model.clusters[k].v0 + i;
        elastic.push_back(0);
        at.push_back(-1);
        for (const int part : model.clusters[k].parts)
          if (const Part& p = model.parts[part]; v >= p.ev0 && v < p.ev0 + p.body.n) elastic.back() = 1, at.back() = p.eq0 + v - p.ev0;
      }
    // The bodies' own, by the scene without the line.
    System bare = system_of(simulation("[0, 0, 0]") + c.bodies);
    const VecX bare_y = pack_state(bare, Eigen::Vector2d::Zero());
    respond(system, K);
    respond(system, D);
    int seen = 0;
    for (size_t k = 0; k < elastic.size(); ++k) {
      if (!elastic[k]) continue;
      const Eigen::Index column = static_cast<Eigen::Index>(k);
      const VecX all = slope_along(system, y, at[k], VecX::Ones(1), 1e-9) - slope_along(bare, bare_y, at[k], VecX::Ones(1), 1e-9);
      const VecX faster = slope_along(system, y, model.nq + column, VecX::Ones(1), 1e-4);
      EXPECT_LE((all - K.col(column)).cwiseAbs().maxCoeff(), c.within * K.cwiseAbs().maxCoeff()) << k << text;
      EXPECT_LE((faster - D.col(column)).cwiseAbs().maxCoeff(), c.within * D.cwiseAbs().maxCoeff() + 1e-9) << k << text;
      ++seen;
    }
    EXPECT_GE(seen, 16);
    EXPECT_GT(K.cwiseAbs().maxCoeff(), 0.0);
  }
}

// Where a deformation closes the loop the stiffness goes through it: a slider-crank whose rod is free to spin about its axis only.
TEST(NewtonMatrix, ThroughLoopsThatDeformationsClose) {
  System system =
      system_of(simulation("[0, 0, 0]") +
                beam("rod", 0.4, 3, "damping = { ratio = 0.1 }\neffects = [\"axial\", \"bending_xy\", \"bending_xz\", \"torsion\"]") +
                joint("spins", "revolute", "ground", "rod.root", "axis = [1, 0, 0]") +
                joint("end", "spherical", "ground", "rod.tip", "position = [0.4, 0, 0]"));
  const VecX y = pack_state(system, Eigen::Vector2d::Zero());
  system.weights.begin(system, Method::dirk, y);
  // Fresh once; then only what is known in closed form is renewed, which brings back columns that were lost.
  MechanicalJacobian j;
  update_newton_matrix(system, 0.0, y.data(), nullptr, {}, j);
  const int nq = system.model.nq, nw = static_cast<int>(j.A.rows());
  const Part& rod = system.model.parts.back();
  ASSERT_LT(nw, rod.body.n + 1);
  const MatX T = j.T.dense(), A = j.A, B = j.B;
  const double largest = A.cwiseAbs().maxCoeff();
  j.A.setZero();
  update_newton_matrix(system, 0.0, y.data(), nullptr, {.fresh = false}, j);
  int known = 0;
  for (int k = 0; k < nw; ++k) {
    const VecX column = slope_along(system, y, 0, T.col(k), 1e-6);
    EXPECT_LE((column - A.col(k)).cwiseAbs().maxCoeff(), 1e-4 * largest) << k;
    if (j.A.col(k).isZero(0.0)) continue;
    ++known;
    EXPECT_LE((column - j.A.col(k)).cwiseAbs().maxCoeff(), 1e-4 * largest) << k;
    const VecX faster = slope_along(system, y, nq + k, VecX::Ones(1), 1e-4);
    EXPECT_LE((faster - B.col(k)).cwiseAbs().maxCoeff(), 1e-4 * B.cwiseAbs().maxCoeff()) << k;
  }
  EXPECT_GE(known, nw - 1);
}

// The mass of a beam that bends far, of eight rates, against differences of its rates: damping alone makes B = -M^-1 D, whatever
// the rates are. A factor may have anything above its diagonal; once that counted, and implicit methods
// took ten thousand steps for a hundred.
TEST(NewtonMatrix, OfABeamThatBendsFar) {
  for (const int elements : {3, 4, 5}) {
    System system =
        system_of(simulation("[0, 0, 0]") +
                  beam("rod", 0.4, elements, "damping = { ratio = 1 }\neffects = [\"bending_xy\", \"stiffening\", \"large_bending\"]") +
                  joint("clamp", "weld", "ground", "rod.root"));
    VecX y = pack_state(system, Eigen::Vector2d::Zero());
    const Part& rod = system.model.parts.back();
    ASSERT_NE(rod.body.rod, nullptr);
    const Eigen::Index n = rod.body.n;
    // Bent as by a force at its tip, by some 20 degrees.
    for (const FlexibleNode& node : rod.body.nodes)
      if (node.name == "tip") y.segment(rod.eq0, n) = rod.body.Ke.ldlt().solve(node.phi.row(1).transpose());
    y.segment(rod.eq0, n) *= 0.1 / std::abs(rod.body.nodes.back().phi.row(1).dot(y.segment(rod.eq0, n)));
    system.weights.begin(system, Method::dirk, y);
    MechanicalJacobian j;
    update_newton_matrix(system, 0.0, y.data(), nullptr, {}, j);
    ASSERT_EQ(j.pieces.size(), 1u);
    const MatX B = -j.pieces[0].mass.ldlt().solve(j.pieces[0].damping);
    const int nq = system.model.nq;
    for (Eigen::Index k = 0; k < n; ++k) {
      const VecX column = slope_along(system, y, nq + k, VecX::Ones(1), 1e-4).head(n);
      EXPECT_LE((column - B.col(k)).cwiseAbs().maxCoeff(), 1e-6 * B.cwiseAbs().maxCoeff()) << elements << " elements, " << k;
    }
  }
}

}  // namespace
}  // namespace flexframe::sim::test_planar
