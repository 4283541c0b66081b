#include "sim/results/sampling.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::sim {
namespace {

// What swings by less than that share of its value cannot be seen in it; nor can what is fast by a smaller share of the whole swing. What
// swings by less than `rounding` of all values beside it stands still.
constexpr double missed_way = 0.5, small_share = 0.05, still_swing = 1e-6, unseen_fast = 0.02, rounding = 1e-9;

struct Miss {
  double share = 0.0;      // of the way, root mean squares
  double frequency = 0.0;  // Hz
  double fast = 0.0;       // share of the swing
  double swing = 0.0;      // beside a steady motion, root of the sum of squares
};

// What a sample differs by from the mean of its neighbours, n of them; a steady motion does not.
double fast_part(const VecX& y, Eigen::Index n) { return (y.segment(1, n - 1) - 0.5 * (y.head(n - 1) + y.tail(n - 1))).norm(); }

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
  const auto fast = [n](const VecX& y) { return fast_part(y, n); };
  if (!(fast(x) > unseen_fast * value)) return {0.0, 0.0, 0.0, value};
  return {(way - expected).norm() / moved, fast(v) / fast(x) / (2.0 * std::numbers::pi), std::min(1.0, fast(x) / value), value};
}

// Whether a node of the body moves fast by more than a thousandth of what the farthest one swings by: coordinates that hardly move it may
// run as fast as they like. Less than what can be seen, as accelerations show more of it.
bool nodes_run_fast(const ResultBody& body, Eigen::Index first, Eigen::Index count) {
  const auto ways = body.displacement.middleRows(first, count);
  const Eigen::RowVectorXd mean = ways.colwise().sum() / static_cast<double>(count);
  Eigen::RowVectorXd fast = Eigen::RowVectorXd::Zero(ways.cols()), far = fast;
  for (Eigen::Index i = 0; i < count; ++i) {
    far += (ways.row(i) - mean).cwiseAbs2();
    if (i > 0 && i + 1 < count) fast += (ways.row(i) - 0.5 * (ways.row(i - 1) + ways.row(i + 1))).cwiseAbs2();
  }
  const double fastest = std::sqrt(fast.maxCoeff()), farthest = std::sqrt(far.maxCoeff());
  constexpr double hardly_moves = 1e-3;
  return fastest > hardly_moves * farthest;
}

}  // namespace

std::optional<FastMotion> faster_than_samples(const Results& results, Eigen::Index first, Eigen::Index count) {
  // Fewer tell nothing of a vibration.
  if (count < 16) return {};
  const VecX t = results.times.segment(first, count);
  std::optional<FastMotion> out;
  double worst = missed_way;
  const auto look = [&](const std::string& owner, const auto& value, const auto& rate) {
    if (value.cols() != rate.cols() || value.cols() == 0) return;
    const Eigen::RowVectorXd rates = rate.middleRows(first, count).colwise().norm();
    const double fastest = rates.maxCoeff(), largest = value.middleRows(first, count).colwise().norm().maxCoeff();
    for (Eigen::Index k = 0; k < rate.cols(); ++k) {
      if (rates[k] < small_share * fastest) continue;
      const VecX v = rate.col(k).segment(first, count);
      const Miss miss = missed(t, value.col(k).segment(first, count), v);
      if (miss.share < worst || miss.swing < rounding * largest) continue;
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
    if (body.displacement.size() == 0 ||
        (body.displacement.cwiseAbs().maxCoeff() >= small_share * most && nodes_run_fast(body, first, count)))
      look("body '" + body.name + "'", body.q, body.qd);
  return out;
}

std::optional<FastMotion> faster_than_samples(const Results& results) { return faster_than_samples(results, 0, results.times.size()); }

std::string fast_motion_text(const FastMotion& fast) {
  const double enough = 10.0 * fast.frequency, digits = std::pow(10.0, std::floor(std::log10(enough)) - 1.0);
  return fmt::format("vibrates at about {:.3g} Hz, too fast for {:.4g} samples a second; output_rate = {} shows it", fast.frequency,
                     fast.samples, digits * std::ceil(enough / digits));
}

namespace {

// Thinned: more tell nothing of how a body bends.
constexpr Eigen::Index most_nodes = 48;

// Rows: displacements (kind 0) or small rotations (kind 1) of a part's nodes per coordinate, without those that nothing moves: of a beam
// that bends in one plane a third is left. n columns.
MatX shapes_of(const FlexibleBody& body, int kind) {
  const auto count = static_cast<Eigen::Index>(body.nodes.size()), taken = std::min(count, most_nodes);
  MatX out(3 * taken, body.n);
  Eigen::Index rows = 0;
  for (Eigen::Index i = 0; i < taken; ++i) {
    const FlexibleNode& node = body.nodes[static_cast<size_t>(taken > 1 ? i * (count - 1) / (taken - 1) : 0)];
    for (Eigen::Index k = 0; k < 3; ++k) {
      out.row(rows) = (kind == 0 ? node.phi : node.psi).row(k);
      if (!out.row(rows).isZero(0.0)) ++rows;
    }
  }
  out.conservativeResize(rows, Eigen::NoChange);
  return out;
}

}  // namespace

std::optional<UnseenSwing> unseen_swing(const Model& model, int body, const Results& results, Eigen::Index least) {
  const ResultBody& deformed = results.bodies[static_cast<size_t>(body)];
  if (results.times.size() < least || deformed.q.cols() == 0 || deformed.qd.cols() != deformed.q.cols()) return {};
  const double duration = results.times[results.times.size() - 1] - results.times[0];
  std::optional<UnseenSwing> out;
  for (const int kind : {0, 1}) {
    std::vector<Miss> missing;
    double farthest = 0.0;
    Eigen::Index first = 0;
    for (const int part : model.pieces[static_cast<size_t>(body)]) {
      const FlexibleBody& piece = model.parts[static_cast<size_t>(part)].body;
      const MatX shapes = shapes_of(piece, kind), moved = deformed.q.middleCols(first, piece.n) * shapes.transpose(),
                 rates = deformed.qd.middleCols(first, piece.n) * shapes.transpose();
      first += piece.n;
      for (Eigen::Index k = 0; k < moved.cols(); ++k) {
        missing.push_back(missed(results.times, moved.col(k), rates.col(k)));
        farthest = std::max(farthest, missing.back().swing);
      }
    }
    for (const Miss& miss : missing) {
      if (miss.share < missed_way) continue;
      const UnseenSwing found{2.0 * std::numbers::pi * miss.frequency * duration, miss.fast * miss.swing / farthest};
      if (!out || found.radians * found.share > out->radians * out->share) out = found;
    }
  }
  return out;
}

}  // namespace flexframe::sim
