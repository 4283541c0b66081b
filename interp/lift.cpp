#include "interp/lift.h"

#include "interp/dense_solvers.h"
#include "interp/rotation.h"

#include <cmath>

namespace flexframe::interp {
namespace {

// Whether data mean finite or linearised motion can be told where no rotations settle it: a finite turn leaves lengths alone
// (finite strain zero), a linearised one, such as a mode shape of any amplitude, leaves their first-order change zero.
// Share of the finite reading from the squares of the two residuals: 1 below a hundredth, 0 above a tenth, smooth between.
double finite_share(double finite2, double linear2) {
  if (!(finite2 < 0.1 * linear2)) return 0.0;
  if (finite2 <= 0.01 * linear2) return 1.0;
  const double t = std::log10(0.1 * linear2 / finite2);
  return t * t * (3.0 - 2.0 * t);
}

// Derivatives of the displacement along the tangents, as columns.
Mat3 slopes_along(const ArmLift::Estimate& e, const Points& displacement) {
  Mat3 slope = Mat3::Zero();
  for (int t = 0; t < e.tangents; ++t)
    for (size_t k = 0; k < e.node.size(); ++k)
      slope.col(t) += e.gradient(t, static_cast<Eigen::Index>(k)) * displacement.row(e.node[k]).transpose();
  return slope;
}

// Estimated rotation of a director node from the derivatives along its tangents.
Mat3 estimated_rotation(const ArmLift::Estimate& e, const Points& displacement) {
  if (e.tangents == 0) return Mat3::Identity();
  Mat3 moved = slopes_along(e, displacement);
  moved.leftCols(e.tangents) += e.frame.leftCols(e.tangents);
  if (e.tangents == 3) return nearest_rotation(moved * e.frame.inverse());
  if (e.tangents == 1) {
    const double length = moved.col(0).norm();
    return length > 0.0 ? shortest_rotation(e.frame.col(0).normalized(), moved.col(0) / length) : Mat3(Mat3::Identity());
  }
  // The normal of the moved tangents, and the best turn within their plane.
  const Vec3 cross = moved.col(0).cross(moved.col(1));
  const double area = cross.norm();
  if (!(area > 0.0)) return Mat3::Identity();
  moved.col(2) = cross / area;
  return nearest_rotation(moved * e.frame.inverse());
}

// Its linearisation: theta with theta x n = -sum_t (n . G t) t, and the mean turn within the plane.
Vec3 estimated_rotation_linear(const ArmLift::Estimate& e, const Points& displacement) {
  Mat3 slope = slopes_along(e, displacement);
  if (e.tangents == 0) return Vec3::Zero();
  if (e.tangents == 1) return e.frame.col(0).cross(Vec3(slope.col(0))) / e.frame.col(0).squaredNorm();
  const Mat3 inverse = e.frame.inverse();
  if (e.tangents == 2)
    for (int t = 0; t < 2; ++t) slope.col(2) -= e.frame.col(2).dot(slope.col(t)) * inverse.row(t).transpose();
  const Mat3 g = slope * inverse;
  return 0.5 * Vec3(g(2, 1) - g(1, 2), g(0, 2) - g(2, 0), g(1, 0) - g(0, 1));
}

// Directions of the node's frame after the motion less before, as columns for e_x e_y e_z.
Mat3 estimated_turn(const ArmLift::Estimate& e, const Points& displacement) {
  const Mat3 slope = slopes_along(e, displacement);
  double finite2 = 0.0, linear2 = 0.0;
  for (int a = 0; a < e.tangents; ++a)
    for (int b = 0; b < e.tangents; ++b) {
      const double linear = e.frame.col(a).dot(slope.col(b)) + e.frame.col(b).dot(slope.col(a));
      const double finite = linear + slope.col(a).dot(slope.col(b));
      linear2 += linear * linear;
      finite2 += finite * finite;
    }
  const double share = finite_share(finite2, linear2);
  Mat3 turn = Mat3::Zero();
  if (share > 0.0) turn += share * (estimated_rotation(e, displacement) - Mat3::Identity());
  if (share < 1.0) turn += (1.0 - share) * skew(estimated_rotation_linear(e, displacement));
  return turn;
}

Points lift_arms(const ArmLift& lift, const Points& displacement, const Points& rotation, bool exact) {
  Points out(lift.nodes + 3 * static_cast<Eigen::Index>(lift.director_node.size()), 3);
  out.topRows(lift.nodes) = displacement;
  const bool given = lift.given && rotation.rows() > 0;
  for (size_t k = 0; k < lift.director_node.size(); ++k) {
    const int node = lift.director_node[k];
    Mat3 turned;
    if (exact)
      turned = given        ? Mat3(rotation_matrix(rotation.row(node).transpose()) - Mat3::Identity())
               : lift.given ? Mat3(Mat3::Zero())
                            : estimated_turn(lift.estimate[k], displacement);
    else
      turned = skew(given        ? Vec3(rotation.row(node).transpose())
                    : lift.given ? Vec3(Vec3::Zero())
                                 : estimated_rotation_linear(lift.estimate[k], displacement));
    out.middleRows(lift.nodes + 3 * static_cast<Eigen::Index>(k), 3) = turned.transpose();
  }
  return out;
}

// Rows as one long vector x y z x y z.
Eigen::Map<const Eigen::VectorXd> flat(const Points& p) { return {p.data(), p.size()}; }

// Squares of what the best linearised rigid motion leaves of the displacements.
double linear_residual(const Points& positions, const Points& displacement) {
  const Vec3 centre = positions.colwise().mean().transpose(), mean = displacement.colwise().mean().transpose();
  Mat3 inertia = Mat3::Zero();
  Vec3 moment = Vec3::Zero();
  for (Eigen::Index i = 0; i < positions.rows(); ++i) {
    const Vec3 r = positions.row(i).transpose() - centre;
    inertia += r.squaredNorm() * Mat3::Identity() - r * r.transpose();
    moment += r.cross(Vec3(displacement.row(i).transpose()) - mean);
  }
  const Vec3 turn = least_squares(inertia, moment);
  double sum = 0.0;
  for (Eigen::Index i = 0; i < positions.rows(); ++i)
    sum += (Vec3(displacement.row(i).transpose()) - mean - turn.cross(Vec3(positions.row(i).transpose()) - centre)).squaredNorm();
  return sum;
}

Points lift_dense(const DenseLift& lift, const Points& displacement, const Points& rotation, bool exact) {
  const bool given = lift.rotation.size() > 0 && rotation.rows() > 0;
  Points out(lift.source_positions.rows(), 3);
  Eigen::Map<Eigen::VectorXd> flat_out(out.data(), out.size());
  if (!exact) {
    flat_out = lift.displacement * flat(displacement);
    if (given) flat_out += lift.rotation * flat(rotation);
    return out;
  }
  // Elastic part in the frame that follows the nodes best, rigid part exactly.
  const LocalMotion local = local_motion(lift.node_positions, displacement, given ? rotation : Points(0, 3));
  if (local.share == 0.0) return lift_dense(lift, displacement, rotation, false);
  flat_out = lift.displacement * flat(local.displacement);
  if (given) flat_out += lift.rotation * flat(local.rotation);
  for (Eigen::Index i = 0; i < out.rows(); ++i) {
    const Vec3 elastic = out.row(i).transpose();
    out.row(i) = (local.rigid.rotation * elastic + local.rigid.displacement(lift.source_positions.row(i).transpose())).transpose();
  }
  if (local.share < 1.0) out = local.share * out + (1.0 - local.share) * lift_dense(lift, displacement, rotation, false);
  return out;
}

Points lift_both(const BlendLift& lift, const Points& displacement, const Points& rotation, bool exact) {
  const Points arms = lift_arms(lift.arms, displacement, rotation, exact), dense = lift_dense(lift.dense, displacement, rotation, exact);
  Points out(arms.rows() + dense.rows(), 3);
  out << arms, dense;
  return out;
}

// Along a beam's axis: change of the lengths between the nodes, in full and to first order.
Points lift_axis(const AxisLift& axis, const Points& displacement, const Points& rotation) {
  if (axis.given && axis.finite) return lift_exact(axis, displacement, rotation);
  double finite2 = 0.0, linear2 = 0.0;
  for (size_t k = 0; k + 1 < axis.s.size(); ++k) {
    const Vec3 d = (displacement.row(axis.order[k + 1]) - displacement.row(axis.order[k])).transpose() / (axis.s[k + 1] - axis.s[k]);
    const Vec3 e = (axis.positions.row(static_cast<Eigen::Index>(k) + 1) - axis.positions.row(static_cast<Eigen::Index>(k))).transpose() /
                   (axis.s[k + 1] - axis.s[k]);
    const double linear = 2.0 * e.dot(d), finite = linear + d.squaredNorm();
    linear2 += linear * linear;
    finite2 += finite * finite;
  }
  // Given rotations are finite unless the lengths speak clearly against it; squares of 1e-12 are rounding.
  const double rounding = 1e-24 * static_cast<double>(axis.s.size());
  const double share = axis.given ? 1.0 - finite_share(linear2 + rounding, finite2) : finite_share(finite2, linear2);
  if (share == 0.0) return lift_linear(axis, displacement, rotation);
  if (share == 1.0) return lift_exact(axis, displacement, rotation);
  return share * lift_exact(axis, displacement, rotation) + (1.0 - share) * lift_linear(axis, displacement, rotation);
}

// Along curved lines: given rotations are finite; without them the lengths between the nodes tell.
Points lift_curves(const CurveLift& curves, const Points& displacement, const Points& rotation) {
  if (curves.given) return lift_exact(curves, displacement, rotation);
  double finite2 = 0.0, linear2 = 0.0;
  for (const Chain& chain : curves.chains)
    for (size_t k = 0; k < chain.span.size(); ++k) {
      const int a = chain.node[k], b = chain.node[(k + 1) % chain.node.size()];
      const Vec3 d = (displacement.row(b) - displacement.row(a)).transpose() / chain.span[k];
      const Vec3 e = (curves.positions.row(b) - curves.positions.row(a)).transpose() / chain.span[k];
      const double linear = 2.0 * e.dot(d), finite = linear + d.squaredNorm();
      linear2 += linear * linear;
      finite2 += finite * finite;
    }
  const double share = finite_share(finite2, linear2);
  if (share == 0.0) return lift_linear(curves, displacement, rotation);
  if (share == 1.0) return lift_exact(curves, displacement, rotation);
  return share * lift_exact(curves, displacement, rotation) + (1.0 - share) * lift_linear(curves, displacement, rotation);
}

template <class... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};
template <class... Ts>
Overloaded(Ts...) -> Overloaded<Ts...>;

}  // namespace

int source_count(const Lift& lift) {
  const auto of_arms = [](const ArmLift& l) { return l.nodes + 3 * static_cast<int>(l.director_node.size()); };
  const auto of_points = [](const DenseLift& l) { return static_cast<int>(l.source_positions.rows()); };
  return std::visit(
      Overloaded{of_arms, [](const AxisLift& l) { return source_count(l); }, [](const CurveLift& l) { return source_count(l); }, of_points,
                 [&](const BlendLift& l) { return of_arms(l.arms) + of_points(l.dense); }},
      lift);
}

Points lift_exact(const Lift& lift, const Points& displacement, const Points& rotation) {
  return std::visit(Overloaded{[&](const ArmLift& l) { return lift_arms(l, displacement, rotation, true); },
                               [&](const AxisLift& l) { return lift_axis(l, displacement, rotation); },
                               [&](const CurveLift& l) { return lift_curves(l, displacement, rotation); },
                               [&](const DenseLift& l) { return lift_dense(l, displacement, rotation, true); },
                               [&](const BlendLift& l) { return lift_both(l, displacement, rotation, true); }},
                    lift);
}

Points lift_linear(const Lift& lift, const Points& displacement, const Points& rotation) {
  return std::visit(Overloaded{[&](const ArmLift& l) { return lift_arms(l, displacement, rotation, false); },
                               [&](const AxisLift& l) { return lift_linear(l, displacement, rotation); },
                               [&](const CurveLift& l) { return lift_linear(l, displacement, rotation); },
                               [&](const DenseLift& l) { return lift_dense(l, displacement, rotation, false); },
                               [&](const BlendLift& l) { return lift_both(l, displacement, rotation, false); }},
                    lift);
}

RigidMotion best_rigid_motion(const Points& positions, const Points& displacement, const Points& rotation) {
  RigidMotion motion;
  const Eigen::Index n = positions.rows();
  motion.centre = positions.colwise().mean().transpose();
  motion.translation = displacement.colwise().mean().transpose();
  if (displacement.cwiseAbs().maxCoeff() == 0.0 && (rotation.rows() == 0 || rotation.cwiseAbs().maxCoeff() == 0.0)) return motion;
  const Points rest = positions.rowwise() - motion.centre.transpose();
  const Points moved = rest + (displacement.rowwise() - motion.translation.transpose());
  Mat3 spread = moved.transpose() * rest;
  const double size = rest.squaredNorm();
  if (rotation.rows() == n) {
    // The nodes' own rotations count like unit arms of the nodes' mean distance.
    const double weight = size > 0.0 ? size / static_cast<double>(n) / 3.0 : 1.0;
    for (Eigen::Index i = 0; i < n; ++i) spread += weight * rotation_matrix(rotation.row(i).transpose());
    motion.rotation = nearest_rotation(spread);
    return motion;
  }
  if (size == 0.0) return motion;
  const PrincipalAxes principal = principal_axes(rest.transpose() * rest);
  // On a line (second extent below 1e-6 of the first, where rounding decides the plane): shortest rotation.
  if (principal.values[1] <= 1e-12 * principal.values[2]) {
    const Vec3 along = principal.axes.col(2);
    const Vec3 now = spread * along;
    if (now.norm() > 0.0) motion.rotation = shortest_rotation(along, now.normalized());
    return motion;
  }
  motion.rotation = nearest_rotation(spread);
  return motion;
}

LocalMotion local_motion(const Points& positions, const Points& displacement, const Points& rotation) {
  LocalMotion local;
  local.rigid = best_rigid_motion(positions, displacement, rotation);
  const RigidMotion& rigid = local.rigid;
  double finite2 = 0.0;
  for (Eigen::Index i = 0; i < displacement.rows(); ++i)
    finite2 += (Vec3(displacement.row(i).transpose()) - rigid.displacement(positions.row(i).transpose())).squaredNorm();
  local.share = finite_share(finite2, linear_residual(positions, displacement));
  local.displacement = displacement;
  local.rotation = rotation;
  if (local.share == 0.0) return local;
  for (Eigen::Index i = 0; i < displacement.rows(); ++i) {
    const Vec3 moved = (positions.row(i) + displacement.row(i)).transpose();
    local.displacement.row(i) =
        (rigid.rotation.transpose() * (moved - rigid.centre - rigid.translation) + rigid.centre).transpose() - positions.row(i);
    if (rotation.rows() > 0)
      local.rotation.row(i) = rotation_vector(rigid.rotation.transpose() * rotation_matrix(rotation.row(i).transpose())).transpose();
  }
  return local;
}

}  // namespace flexframe::interp
