// The constants of a flexible body that its motion within a plane meets (flexible_body.h has all of them), component by component in
// planar axes: x and y in the plane, z its normal. Blocks that are zero stay empty.
#pragma once

#include "sim/base/plane.h"
#include "sim/bodies/flexible_body.h"

#include <array>

namespace flexframe::sim {

struct PlaneBody {
  int n = 0;
  double mass = 0.0;
  Vec2 md0 = Vec2::Zero();
  Eigen::MatrixX2d md1;  // n x 2
  std::array<MatX, 2> md2;
  Eigen::Matrix<double, 1, 1> J0 = Eigen::Matrix<double, 1, 1>::Zero();  // about the normal
  VecX J1;
  std::array<MatX, 1> J2;
  VecX Cr0;
  std::array<MatX, 1> Cr1;
  MatX Cr1_difference;  // Cr1 - Cr1^T
  MatX Me, Ke, De;
  VecX stiffness, ksigma;
  // Of a RodAxis: its axes in the planar ones, +-1 as it turns, and what its particles lack.
  std::shared_ptr<const RodAxis> rod;
  Eigen::Matrix2d rod_axes = Eigen::Matrix2d::Identity();
  double rod_sense = 1.0, rod_J0 = 0.0;
  VecX rod_Cr0;
};

// A node: displacement n x 2, rotation n.
struct PlaneNode {
  Vec2 origin = Vec2::Zero();
  double angle = 0.0;
  Eigen::MatrixX2d phi;
  VecX psi;
  std::array<MatX, 2> phi2;
  VecX along;  // FlexibleNode's, with the rod's axes in the planar ones
  Eigen::Matrix2d rod_axes = Eigen::Matrix2d::Identity();
};

// Q: planar axes, a column each, in the body's. The node's own axes become the planar ones `node_axes`. towards: of the body's RodAxis.
PlaneBody in_plane(const FlexibleBody& body, const Mat3& Q);
PlaneNode in_plane(const FlexibleNode& node, const Mat3& Q, const Mat3& node_axes, int towards = 1);
// Whether the node's deformation leaves the plane by more than rounding.
bool leaves_plane(const FlexibleNode& node, const Mat3& Q);

}  // namespace flexframe::sim
