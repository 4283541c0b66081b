#include "sim/results/node_motion.h"

#include "sim/base/small_matrices.h"
#include "sim/bodies/rod_axis.h"

#include <cmath>

namespace flexframe::sim {
namespace {

// The rotation vector of one turn about z after another.
double turned_about_z(const Quat& one, const Quat& other) {
  const double w = one.w() * other.w() - one.z() * other.z(), z = one.w() * other.z() + one.z() * other.w();
  const double size = std::abs(z), sign = w < 0.0 ? -1.0 : 1.0;
  return size < 1e-12 ? 2.0 * sign * z : 2.0 * std::atan2(size, sign * w) / size * (sign * z);
}

}  // namespace

NodePaths::NodePaths(const Part& part, const std::vector<int>& nodes) {
  const Eigen::Index n = part.body.n, count = static_cast<Eigen::Index>(nodes.size());
  MatX linear = MatX::Zero(6 * count, n);
  std::vector<const MatX*> seconds;
  for (const int k : nodes) {
    const FlexibleNode& node = part.body.nodes[k];
    const auto i = static_cast<Eigen::Index>(origins_.size());
    origins_.push_back(node.origin);
    rests_.push_back(part.rest_in_body.R * node.origin + part.rest_in_body.p);
    if (n == 0) continue;
    linear.middleRows<3>(3 * i) = node.phi;
    linear.middleRows<3>(3 * (count + i)) = node.psi;
    const auto add_second = [&](Eigen::Index at, const MatX& h) {
      if (h.size() == 0) return;
      seconds_of_.push_back(at);
      seconds.push_back(&h);
    };
    for (Eigen::Index a = 0; a < 3; ++a) {
      add_second(3 * i + a, node.phi2[a]);
      add_second(3 * (count + i) + a, node.psi2[a]);
    }
  }
  quadratic_.resize(static_cast<Eigen::Index>(seconds.size()), seconds_of_.empty() ? 0 : n * (n + 1) / 2);
  for (Eigen::Index c = 0; c < quadratic_.rows(); ++c) {
    const MatX& h = *seconds[c];
    Eigen::Index at = 0;
    for (Eigen::Index j = 0; j < n; ++j)
      for (Eigen::Index k = 0; k <= j; ++k) quadratic_(c, at++) = j == k ? 0.5 * h(j, j) : 0.5 * (h(j, k) + h(k, j));
  }
  if (part.body.rod && n > 0) {
    rod_ = part.body.rod;
    weights_ = MatX::Zero(count, rod_->x.size());
    for (Eigen::Index i = 0; i < count; ++i)
      if (const VecX& w = part.body.nodes[nodes[static_cast<size_t>(i)]].along; w.size() > 0) weights_.row(i) = w;
  }
  rest_turn_ = Quat(part.rest_in_body.R).conjugate();
  // Of what bends in a plane half.
  for (Eigen::Index row = 0; row < linear.rows(); ++row)
    if (!linear.row(row).isZero(0.0)) rows_.push_back(row);
  linear_ = linear(rows_, Eigen::all);
  moved_.resize(linear_.rows());
  values_.resize(linear.rows());
  products_.resize(quadratic_.cols());
  seconds_.resize(quadratic_.rows());
}

void NodePaths::evaluate(const VecX& q, const Pose& shown, double* translation, double* rotation) {
  values_.setZero();
  multiply(linear_, q.data(), moved_.data());
  for (size_t k = 0; k < rows_.size(); ++k) values_[rows_[k]] = moved_[static_cast<Eigen::Index>(k)];
  if (!seconds_of_.empty()) {
    Eigen::Index at = 0;
    for (Eigen::Index j = 0; j < q.size(); ++j)
      for (Eigen::Index k = 0; k <= j; ++k) products_[at++] = q[j] * q[k];
    multiply(quadratic_, products_.data(), seconds_.data());
    for (size_t c = 0; c < seconds_of_.size(); ++c) values_[seconds_of_[c]] += seconds_[static_cast<Eigen::Index>(c)];
  }
  if (rod_) {
    update_rod_fields(*rod_, q, bent_);
    const VecX along = weights_ * bent_.along, across = weights_ * bent_.across;
    for (Eigen::Index i = 0; i < along.size(); ++i) values_[3 * i] += along[i], values_[3 * i + rod_->towards] += across[i];
  }
  const Quat turn(shown.R);
  const bool flat = turn.x() == 0.0 && turn.y() == 0.0 && rest_turn_.w() == 1.0;
  const auto n = static_cast<Eigen::Index>(count());
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vec3 at = origins_[i] + values_.segment<3>(3 * i);
    const Vec3 moved = shown.R * at + shown.p - rests_[i];
    // exp(theta) as a quaternion, by half the angle.
    const Vec3 theta = values_.segment<3>(3 * (n + i));
    const double half2 = 0.25 * theta.squaredNorm();
    const RotationSeries series(half2);
    Quat own;
    own.w() = 1.0 - half2 * series.b;
    own.vec() = 0.5 * series.s * theta;
    const bool about_z = flat && theta.x() == 0.0 && theta.y() == 0.0;
    const Vec3 turned = about_z ? Vec3(0.0, 0.0, turned_about_z(turn, own)) : rotation_log(Quat(turn * own * rest_turn_));
    for (Eigen::Index a = 0; a < 3; ++a) translation[3 * i + a] = moved[a], rotation[3 * i + a] = turned[a];
  }
}

}  // namespace flexframe::sim
