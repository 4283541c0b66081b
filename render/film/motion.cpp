#include "render/film/motion.h"

#include <algorithm>
#include <cmath>

namespace flexframe::film {
namespace {

glm::dmat4 pose_of(const Eigen::MatrixX3d& position, const Eigen::MatrixX4d& orientation, Eigen::Index from, Eigen::Index to,
                   double share) {
  sim::Vec3 p = position.row(from).transpose();
  sim::Quat q(orientation(from, 0), orientation(from, 1), orientation(from, 2), orientation(from, 3));
  if (share > 0.0) {
    p += share * (position.row(to).transpose() - p);
    const sim::Quat next(orientation(to, 0), orientation(to, 1), orientation(to, 2), orientation(to, 3));
    q = q.slerp(share, next);
  }
  q.normalize();
  const sim::Mat3 r = q.toRotationMatrix();
  glm::dmat4 pose(1.0);
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) pose[column][row] = r(row, column);
  pose[3] = glm::dvec4(p.x(), p.y(), p.z(), 1.0);
  return pose;
}

}  // namespace

SamplePlace find_sample(const sim::VecX& times, double t) {
  const Eigen::Index n = times.size();
  if (n < 2 || t <= times[0]) return {0, 0.0};
  if (t >= times[n - 1]) return {n - 1, 0.0};
  const Eigen::Index after = std::upper_bound(times.begin(), times.end(), t) - times.begin();
  const double share = (t - times[after - 1]) / (times[after] - times[after - 1]);
  // k / frame_rate and k / output_rate differ by rounding; the nearest sample is meant.
  if (share < 1e-9) return {after - 1, 0.0};
  if (share > 1.0 - 1e-9) return {after, 0.0};
  return {after - 1, share};
}

glm::dmat4 body_pose(const sim::ResultBody& body, const SamplePlace& place) {
  return pose_of(body.position, body.orientation, place.index, place.index + 1, place.share);
}

glm::dmat4 pose_between(const sim::ResultBody& body, Eigen::Index from, Eigen::Index to, double share) {
  return pose_of(body.position, body.orientation, from, to, share);
}

glm::dmat4 joint_pose(const sim::ResultJoint& joint, const SamplePlace& place) {
  return pose_of(joint.position, joint.orientation, place.index, place.index + 1, place.share);
}

void node_motion(const sim::ResultBody& body, const SamplePlace& place, interp::Points& displacement, interp::Points& rotation) {
  const Eigen::Index nn = static_cast<Eigen::Index>(body.nodes.size()), i = place.index;
  displacement.resize(nn, 3);
  rotation.resize(body.rotation.size() > 0 ? nn : 0, 3);
  for (Eigen::Index k = 0; k < nn; ++k) {
    displacement.row(k) = body.displacement.block<1, 3>(i, 3 * k);
    if (rotation.rows() > 0) rotation.row(k) = body.rotation.block<1, 3>(i, 3 * k);
    if (place.share <= 0.0) continue;
    displacement.row(k) += place.share * (body.displacement.block<1, 3>(i + 1, 3 * k) - displacement.row(k));
    if (rotation.rows() == 0) continue;
    const Eigen::RowVector3d step = body.rotation.block<1, 3>(i + 1, 3 * k) - rotation.row(k);
    // A jump by a whole turn is another name of the same rotation: then the nearer sample speaks.
    if (step.norm() < 3.0) rotation.row(k) += place.share * step;
    else if (place.share > 0.5) rotation.row(k) += step;
  }
}

sim::Pose held_pose(const sim::ResultBody& body, const SamplePlace& place) {
  sim::Pose pose;
  if (body.held_position.rows() == 0) return pose;
  const Eigen::Index i = place.index;
  pose.p = body.held_position.row(i).transpose();
  sim::Vec3 turn = body.held_rotation.row(i).transpose();
  if (place.share > 0.0) {
    pose.p += place.share * (body.held_position.row(i + 1).transpose() - pose.p);
    turn += place.share * (body.held_rotation.row(i + 1).transpose() - turn);
  }
  pose.R = sim::rotation_exp(turn);
  return pose;
}

namespace {

// A row of a series, straight between samples.
template <class Series>
void row_at(const Series& series, const SamplePlace& place, std::vector<double>& out) {
  out.resize(static_cast<size_t>(series.cols()));
  for (Eigen::Index k = 0; k < series.cols(); ++k) {
    double value = series(place.index, k);
    if (place.share > 0.0) value += place.share * (series(place.index + 1, k) - value);
    out[static_cast<size_t>(k)] = value;
  }
}

}  // namespace

namespace {

sim::Pose frame_of_coordinates(const sim::ResultBody& body, Eigen::Index i) {
  const sim::Pose held = held_pose(body, {i, 0.0});
  const sim::Quat q(body.orientation(i, 0), body.orientation(i, 1), body.orientation(i, 2), body.orientation(i, 3));
  sim::Pose pose;
  pose.R = q.normalized().toRotationMatrix() * held.R;
  pose.p = body.position.row(i).transpose() + q.normalized() * held.p;
  return pose;
}

sim::Vec3 turned(const sim::Pose& from, const sim::Pose& to) { return sim::rotation_log(sim::Mat3(from.R.transpose() * to.R)); }

sim::InertiaLoads loads_at(const sim::ResultBody& body, const sim::VecX& times, Eigen::Index i, const sim::Vec3& gravity,
                           Eigen::Index apart) {
  const Eigen::Index n = times.size();
  apart = std::min(apart, (n - 1) / 2);
  sim::Vec3 acceleration = sim::Vec3::Zero(), omega = sim::Vec3::Zero(), alpha = sim::Vec3::Zero();
  if (apart > 0) {
    const Eigen::Index middle = std::clamp<Eigen::Index>(i, apart, n - 1 - apart);
    const double h0 = times[middle] - times[middle - apart], h1 = times[middle + apart] - times[middle];
    const sim::Pose a = frame_of_coordinates(body, middle - apart), b = frame_of_coordinates(body, middle),
                    c = frame_of_coordinates(body, middle + apart);
    acceleration = 2.0 / (h0 + h1) * ((c.p - b.p) / h1 - (b.p - a.p) / h0);
    const sim::Vec3 before = turned(a, b) / h0, after = turned(b, c) / h1;
    alpha = 2.0 / (h0 + h1) * (after - before);
    omega = (h1 * before + h0 * after) / (h0 + h1) + (times[i] - times[middle]) * alpha;
  }
  sim::InertiaLoads loads;
  loads << frame_of_coordinates(body, i).R.transpose() * (gravity - acceleration), -alpha, 0.5 * omega.cwiseAbs2(), omega.x() * omega.y(),
      omega.x() * omega.z(), omega.y() * omega.z();
  return loads;
}

}  // namespace

sim::InertiaLoads inertia_loads(const sim::ResultBody& body, const sim::VecX& times, const SamplePlace& place, const sim::Vec3& gravity,
                                Eigen::Index apart) {
  sim::InertiaLoads loads = loads_at(body, times, place.index, gravity, apart);
  if (place.share > 0.0) loads += place.share * (loads_at(body, times, place.index + 1, gravity, apart) - loads);
  return loads;
}

double turn_between_samples(const sim::ResultBody& body) {
  double largest = 0.0;
  for (Eigen::Index i = 0; i + 1 < body.orientation.rows(); ++i) {
    // The cosine of half the turn.
    const double half = std::min(1.0, std::abs(body.orientation.row(i).dot(body.orientation.row(i + 1))));
    largest = std::max(largest, 2.0 * std::acos(half));
  }
  return largest;
}

void elastic_coordinates(const sim::ResultBody& body, const SamplePlace& place, std::vector<double>& q) { row_at(body.q, place, q); }

void load_strains(const sim::ResultBody& body, const SamplePlace& place, std::vector<double>& out) { row_at(body.load_strain, place, out); }

int picture_count(const sim::VecX& times, double frame_rate, double speed) {
  if (times.size() == 0) return 0;
  const double span = times[times.size() - 1] - times[0];
  // The end counts as reached within rounding of the division.
  return 1 + static_cast<int>(std::floor(span * frame_rate / speed * (1.0 + 1e-12) + 1e-9));
}

double picture_time(const sim::VecX& times, double frame_rate, double speed, int picture) {
  return std::min(times[0] + picture * speed / frame_rate, times[times.size() - 1]);
}

}  // namespace flexframe::film
