// Displacements of many nodes at once against those of one node after another.
#include "sim/bodies/beam.h"
#include "sim/results/node_motion.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <numeric>

namespace flexframe::sim::test_node_motion {
namespace {

BeamDef beam_def() {
  BeamDef def;
  def.length = 1.3;
  def.section.area = 2.1e-4;
  def.section.iy = 3.0e-9;
  def.section.iz = 5.0e-9;
  def.section.j = 4.0e-9;
  def.material = {2700.0, 7e10, 0.3};
  def.boundary = Boundary::free_free;
  def.elements = 4;
  return def;
}

FlexibleBody beam() {
  return make_fe_beam(beam_def(), {.axial = true, .bending_xy = true, .bending_xz = true, .torsion = true, .stiffening = true});
}

Mat3 turned(double angle, const Vec3& axis) { return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix(); }

// Of these nodes of a part, by sizes of its coordinates.
void expect_exact(const Part& part, const Pose& shown, const std::vector<int>& nodes) {
  NodePaths motion(part, nodes);
  ASSERT_EQ(motion.count(), nodes.size());
  for (const double size : {0.0, 1e-9, 0.02, 0.4}) {
    VecX q(part.body.n);
    for (Eigen::Index k = 0; k < q.size(); ++k) q[k] = size * std::sin(1.0 + 3.0 * static_cast<double>(k));
    VecX translation(3 * static_cast<Eigen::Index>(nodes.size())), rotation(translation.size());
    motion.evaluate(q, shown, translation.data(), rotation.data());
    double largest = 0.0;
    for (size_t i = 0; i < nodes.size(); ++i) {
      const FlexibleNode& node = part.body.nodes[static_cast<size_t>(nodes[i])];
      Vec3 at = node.origin + node.phi * q;
      for (Eigen::Index a = 0; a < 3; ++a) at[a] += 0.5 * q.dot(node.phi2[static_cast<size_t>(a)] * q);
      Vec3 theta = node.psi * q;
      for (Eigen::Index a = 0; a < 3; ++a)
        if (const MatX& h = node.psi2[static_cast<size_t>(a)]; h.size() > 0) theta[a] += 0.5 * q.dot(h * q);
      const Mat3 R = shown.R * (theta.norm() > 0.0 ? turned(theta.norm(), theta) : Mat3(Mat3::Identity())) * node.rotation;
      const Mat3 rest = part.rest_in_body.R * node.rotation;
      const Vec3 moved = shown.R * at + shown.p - (part.rest_in_body.R * node.origin + part.rest_in_body.p);
      const Eigen::AngleAxisd relative(R * rest.transpose());
      largest = std::max(largest, theta.norm());
      const auto k = 3 * static_cast<Eigen::Index>(i);
      EXPECT_LT((translation.segment<3>(k) - moved).norm(), 1e-14 * 10.0) << size << " node " << i;
      EXPECT_LT((rotation.segment<3>(k) - relative.angle() * relative.axis()).norm(), 1e-13) << size << " node " << i;
    }
    EXPECT_GE(largest, 0.7 * size);
  }
}

// Turned nodes, a part that lies askew in its body, large rotations, a shown frame of its own.
TEST(NodeMotion, EqualsTheExactKinematicsOfEveryNode) {
  Part part;
  part.body = beam();
  for (size_t i = 0; i < part.body.nodes.size(); ++i) part.body.nodes[i].rotation = turned(0.3 * static_cast<double>(i), {1.0, 0.2, -0.4});
  for (MatX& h : part.body.nodes.back().psi2) h = 0.1 * MatX::Identity(part.body.n, part.body.n);
  part.rest_in_body = {turned(0.8, {0.3, -1.0, 0.5}), Vec3(0.4, -2.0, 0.1)};
  const Pose shown{turned(-1.1, {1.0, 1.0, 0.2}), Vec3(1.0, 0.3, -0.7)};
  std::vector<int> nodes;
  for (int k = static_cast<int>(part.body.nodes.size()) - 1; k >= 0; k -= 2) nodes.push_back(k);
  expect_exact(part, shown, nodes);
}

// What bends in a plane and is turned about its normal, up to half a turn and beyond.
TEST(NodeMotion, EqualsThemInAPlane) {
  BeamDef def = beam_def();
  Part part;
  part.body = make_fe_beam(def, {.axial = true, .bending_xy = true, .stiffening = true});
  std::vector<int> nodes(part.body.nodes.size());
  std::iota(nodes.begin(), nodes.end(), 0);
  for (const double angle : {0.0, 1e-13, 0.7, -1.3, 2.9, -3.1, 3.6})
    expect_exact(part, {turned(angle, Vec3::UnitZ()), Vec3(1.0, 0.3, 0.0)}, nodes);
}

TEST(NodeMotion, RigidPartsMoveAsTheyAreShown) {
  Part part;
  part.body.nodes.resize(2);
  part.body.nodes[1].origin = Vec3(1.0, 2.0, 3.0);
  NodePaths motion(part, {0, 1});
  VecX translation(6), rotation(6);
  motion.evaluate(VecX(), {turned(0.2, Vec3::UnitZ()), Vec3(0.0, 0.0, 1.0)}, translation.data(), rotation.data());
  EXPECT_LT((translation.head<3>() - Vec3::UnitZ()).norm(), 1e-15);
  EXPECT_LT((rotation.tail<3>() - 0.2 * Vec3::UnitZ()).norm(), 1e-15);
}

}  // namespace
}  // namespace flexframe::sim::test_node_motion
