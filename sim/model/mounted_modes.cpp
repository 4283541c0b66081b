#include "sim/model/mounted_modes.h"

#include "sim/base/eigen_solvers.h"
#include "sim/base/spatial.h"
#include "sim/model/joint_motion.h"
#include "sim/scene/joint_kinds.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace flexframe::sim {
namespace {

// Rows scaled by mass are of the order of one over the root of a mass; what two joints hold alike differs by rounding.
constexpr double rank_threshold = 1e-9;
// Share of a unit direction along an axis that is none.
constexpr double along_axis = 1e-9;

// Directions, in the axes of the joint's parent frame, in which a joint holds translations and rotations.
struct HeldDirections {
  std::vector<Vec3> translations, rotations;
};

// Of the joint's motion at the origin of its coordinates; where it has none, of its closure conditions.
HeldDirections directions_of(const JointDef& j) {
  const JointAxes f = joint_axes(j.axis);
  const std::array<Vec3, 3> axes{f.x, f.y, f.z};
  if (!j.motion.empty() || j.motion_table) return {{f.x, f.y, f.z}, {f.x, f.y, f.z}};
  const JointTraits& facts = traits(j.kind);
  constexpr std::string_view letters = "xyz";
  std::array<bool, 3> moves{}, turns{};
  if (facts.place) {
    TreeJoint joint;
    joint.kind = j.kind;
    joint.axis = j.axis;
    joint.pitch = j.pitch;
    VecX q(position_count(j.kind));
    zero_coordinates(j.kind, q.data());
    JointMotion motion;
    update_joint_position(joint, q.data(), motion);
    // A rate that turns counts as a rotation, even if it slides along too (screw).
    for (int k = 0; k < rates_of(j.kind); ++k)
      for (int d = 0; d < 3; ++d)
        if (is_length(j.kind, k)) moves[d] = moves[d] || std::abs(motion.S.col(k).head<3>().dot(axes[d])) > along_axis;
        else turns[d] = turns[d] || std::abs(motion.S.col(k).tail<3>().dot(axes[d])) > along_axis;
  } else {
    const ClosureFacts closure = facts.closure.value_or(ClosureFacts{"", ""});
    moves = turns = {true, true, true};
    for (const char place : closure.places) moves[letters.find(place)] = false;
    // What keeps u normal to v holds the turn about the third axis.
    for (size_t k = 0; k < closure.turns.size(); k += 2)
      turns[3 - letters.find(closure.turns[k]) - letters.find(closure.turns[k + 1])] = false;
  }
  HeldDirections held;
  for (int d = 0; d < 3; ++d) {
    if (!moves[d]) held.translations.push_back(axes[d]);
    if (!turns[d]) held.rotations.push_back(axes[d]);
  }
  return held;
}

Mat3 orientation_of(const Scene& scene, const std::string& body, std::span<const Mat3> orientation) {
  for (size_t b = 0; b < scene.bodies.size() && b < orientation.size(); ++b)
    if (scene.bodies[b].name == body) return orientation[b];
  return Mat3::Identity();
}

// Mass matrix of the undeformed body over x.
MatX whole_mass(const FlexibleBody& body) {
  MatX M = MatX::Zero(6 + body.n, 6 + body.n);
  M.topLeftCorner<3, 3>() = body.mass * Mat3::Identity();
  M.block<3, 3>(0, 3) = -skew(body.md0);
  M.block<3, 3>(3, 0) = skew(body.md0);
  M.block<3, 3>(3, 3) << body.J0[0], body.J0[3], body.J0[4], body.J0[3], body.J0[1], body.J0[5], body.J0[4], body.J0[5], body.J0[2];
  M.topRightCorner(3, body.n) = body.md1;
  M.bottomLeftCorner(body.n, 3) = body.md1.transpose();
  M.block(3, 6, 3, body.n) = body.Cr0;
  M.block(6, 3, body.n, 3) = body.Cr0.transpose();
  M.bottomRightCorner(body.n, body.n) = body.Me;
  return M;
}

}  // namespace

std::vector<Support> mounting_of(const Scene& scene, const std::string& body) {
  std::vector<Support> all = supports_of(scene, body);
  const auto clamp = std::find_if(all.begin(), all.end(), [](const Support& s) { return s.clamp; });
  if (clamp == all.end()) return all;
  std::vector<Support> out{*clamp};
  for (const Support& s : all)
    if (s.on_ground && s.joint != clamp->joint) out.push_back(s);
  return out;
}

MatX held_rows(const Scene& scene, int body, const FlexibleBody& made, const std::vector<Support>& holds,
               std::span<const Mat3> orientation) {
  double size = 0.0;
  for (const FlexibleNode& node : made.nodes) size = std::max(size, node.origin.norm());
  if (!(size > 0.0)) size = 1.0;
  std::vector<VecX> rows;
  for (const Support& s : holds) {
    const bool beam = std::holds_alternative<BeamDef>(scene.bodies[body].kind);
    const std::string name = s.frame.frame.empty() && beam ? "root" : s.frame.frame;
    const auto node = std::find_if(made.nodes.begin(), made.nodes.end(), [&](const FlexibleNode& n) { return n.name == name; });
    if (node == made.nodes.end() && !name.empty()) continue;
    FlexibleNode at;  // without a name: the body frame itself
    at.phi = at.psi = Mat3X::Zero(3, made.n);
    if (node != made.nodes.end()) at = *node;
    Mat3 axes = at.rotation * frame_axes(scene.bodies[body], s.frame.frame);
    Vec3 p = at.origin;
    if (s.parent) {
      p += axes * s.joint->position;
      axes = axes * rotation_exp(s.joint->rotation);
    } else if (holds_along_parent(s.joint->kind)) {
      axes = orientation_of(scene, scene.bodies[body].name, orientation).transpose() *
             orientation_of(scene, s.joint->parent.body, orientation) * frame_axes(scene, s.joint->parent) *
             rotation_exp(s.joint->rotation);
    }
    const Mat3X rotation = at.psi, translation = at.phi - skew(p - at.origin) * at.psi;
    const HeldDirections held = directions_of(*s.joint);
    for (const Vec3& d : held.translations) {
      const Vec3 u = axes * d;
      VecX row(6 + made.n);
      row << u, p.cross(u), translation.transpose() * u;
      rows.push_back(row);
    }
    for (const Vec3& d : held.rotations) {
      const Vec3 u = size * (axes * d);
      VecX row(6 + made.n);
      row << Vec3::Zero(), u, rotation.transpose() * u;
      rows.push_back(row);
    }
  }
  MatX H(static_cast<Eigen::Index>(rows.size()), 6 + made.n);
  for (size_t i = 0; i < rows.size(); ++i) H.row(static_cast<Eigen::Index>(i)) = rows[i].transpose();
  return H;
}

MountedModes mounted_modes(const FlexibleBody& body, const MatX& held) {
  MountedModes out;
  if (body.n == 0) return out;
  const Cholesky chol(whole_mass(body));
  if (chol.info() != Eigen::Success) return out;
  // Coordinates y with x = L^-T y in which the mass is 1: K becomes L^-1 K L^-T, a row h becomes L^-1 h^T.
  MatX K = MatX::Zero(6 + body.n, 6 + body.n);
  K.bottomRightCorner(body.n, body.n) = body.Ke;
  const MatX half = chol.solve_lower(K);
  const MatX Ky = chol.solve_lower(half.transpose());
  const MatX N = orthogonal_complement(chol.solve_lower(held.transpose()), rank_threshold);
  // Rigid motions that nothing holds come first, without stiffness.
  const MatX mass = whole_mass(body).topLeftCorner(6, 6);
  const Cholesky rigid(mass);
  if (rigid.info() != Eigen::Success) return out;
  const Eigen::Index free = orthogonal_complement(rigid.solve_lower(held.leftCols(6).transpose()), rank_threshold).cols();
  const SymmetricEigen eigen(MatX(N.transpose() * Ky * N));
  const Eigen::Index count = N.cols() - free;
  if (count <= 0) return out;
  out.omega = eigen.eigenvalues().tail(count).cwiseMax(0.0).cwiseSqrt();
  const MatX y = N * eigen.eigenvectors().rightCols(count);
  out.q.resize(body.n, count);
  for (Eigen::Index k = 0; k < count; ++k) out.q.col(k) = chol.solve_lower_transposed(y.col(k)).tail(body.n);
  return out;
}

MatX mounted_damping(const FlexibleBody& body, const MountedModes& modes, const std::vector<double>& ratio) {
  VecX factor(modes.omega.size());
  for (Eigen::Index k = 0; k < factor.size(); ++k)
    factor[k] = modes.omega[k] > 0.0
                    ? 2.0 * ratio[std::min(static_cast<size_t>(k), ratio.size() - 1)] / (modes.omega[k] * modes.omega[k] * modes.omega[k])
                    : 0.0;
  const MatX kq = body.Ke * modes.q;
  return kq * factor.asDiagonal() * kq.transpose();
}

VecX mounted_ratios(const FlexibleBody& body, const MountedModes& modes) {
  VecX out = VecX::Zero(modes.omega.size());
  for (Eigen::Index k = 0; k < out.size() && body.De.size() > 0; ++k)
    if (modes.omega[k] > 0.0) out[k] = modes.q.col(k).dot(body.De * modes.q.col(k)) / (2.0 * modes.omega[k]);
  return out;
}

}  // namespace flexframe::sim
