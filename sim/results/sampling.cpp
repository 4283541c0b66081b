#include "sim/results/sampling.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::sim {
namespace {

// What swings by less than that share of its value cannot be seen in it; nor can what is fast by a smaller share of the whole swing.
constexpr double missed_way = 0.5, small_share = 0.05, still_swing = 1e-6, unseen_fast = 0.02;

struct Miss {
  double share = 0.0;      // of the way, root mean squares
  double frequency = 0.0;  // Hz
  double fast = 0.0;       // share of the swing
};

// Of values x and rates v at times t; none where nothing moves to speak of.
Miss missed(const VecX& t, const VecX& x, const VecX& v) {
  const Eigen::Index n = t.size() - 1;
  const VecX h = t.tail(n) - t.head(n), way = x.tail(n) - x.head(n), expected = 0.5 * h.cwiseProduct(v.tail(n) + v.head(n));
  // A vibration of just the samples' rate stands still in the way, one of half of it in the mean of two rates.
  const double moved = std::max(way.norm(), expected.norm());
  // What remains beside a steady motion.
  const double span = t[n] - t[0], drift = (x[n] - x[0]) / span;
  const VecX swing = x - drift * (t.array() - t[0]).matrix();
  const double value = (swing.array() - swing.mean()).matrix().norm();
  if (!(value > still_swing * x.norm()) || !(moved > 0.0)) return {};
  // Against the mean of their neighbours values and rates of a vibration lose the same factor, also one that stands at a lower frequency.
  const auto fast = [n](const VecX& y) { return (y.segment(1, n - 1) - 0.5 * (y.head(n - 1) + y.tail(n - 1))).norm(); };
  if (!(fast(x) > unseen_fast * value)) return {};
  return {(way - expected).norm() / moved, fast(v) / fast(x) / (2.0 * std::numbers::pi), std::min(1.0, fast(x) / value)};
}

}  // namespace

std::optional<FastMotion> faster_than_samples(const Results& results, Eigen::Index first, Eigen::Index count) {
  // Fewer tell nothing of a vibration.
  if (count < 16) return {};
  const VecX t = results.times.segment(first, count);
  std::optional<FastMotion> out;
  double worst = missed_way;
  const auto look = [&](const std::string& owner, const MatX& value, const MatX& rate) {
    if (value.cols() != rate.cols() || value.cols() == 0) return;
    double fastest = 0.0;
    for (Eigen::Index k = 0; k < rate.cols(); ++k) fastest = std::max(fastest, rate.col(k).segment(first, count).norm());
    for (Eigen::Index k = 0; k < rate.cols(); ++k) {
      const VecX v = rate.col(k).segment(first, count);
      if (v.norm() < small_share * fastest) continue;
      const Miss miss = missed(t, value.col(k).segment(first, count), v);
      if (miss.share < worst) continue;
      worst = miss.share;
      out = {owner, miss.frequency, static_cast<double>(count - 1) / (t[count - 1] - t[0])};
    }
  };
  // Elsewhere rates are no derivatives of the values.
  for (const ResultJoint& joint : results.joints)
    if (joint.kind != "spherical" && joint.kind != "free" && joint.kind != "constant-velocity")
      look("joint '" + joint.name + "'", joint.value, joint.rate);
  // Bodies that hardly deform beside another are not looked at for their vibrations.
  double most = 0.0;
  for (const ResultBody& body : results.bodies)
    if (body.displacement.size() > 0) most = std::max(most, body.displacement.cwiseAbs().maxCoeff());
  for (const ResultBody& body : results.bodies)
    if (body.displacement.size() == 0 || body.displacement.cwiseAbs().maxCoeff() >= small_share * most)
      look("body '" + body.name + "'", body.q, body.qd);
  return out;
}

std::optional<FastMotion> faster_than_samples(const Results& results) { return faster_than_samples(results, 0, results.times.size()); }

std::string fast_motion_text(const FastMotion& fast) {
  const double enough = 10.0 * fast.frequency, digits = std::pow(10.0, std::floor(std::log10(enough)) - 1.0);
  return fmt::format("vibrates at about {:.3g} Hz, too fast for {:.4g} samples a second; output_rate = {} shows it", fast.frequency,
                     fast.samples, digits * std::ceil(enough / digits));
}

std::optional<UnseenSwing> unseen_swing(const Results& results, const ResultBody& body, Eigen::Index least) {
  if (results.times.size() < least || body.q.cols() == 0 || body.qd.cols() != body.q.cols()) return {};
  const double fastest = body.qd.colwise().norm().maxCoeff(), duration = results.times[results.times.size() - 1] - results.times[0];
  std::optional<UnseenSwing> out;
  double worst = missed_way;
  for (Eigen::Index k = 0; k < body.q.cols(); ++k) {
    if (body.qd.col(k).norm() < small_share * fastest) continue;
    const Miss miss = missed(results.times, body.q.col(k), body.qd.col(k));
    if (miss.share < worst) continue;
    worst = miss.share;
    out = {2.0 * std::numbers::pi * miss.frequency * duration, miss.fast};
  }
  return out;
}

}  // namespace flexframe::sim
