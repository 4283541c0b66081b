#include "sim/run/linear_limit.h"

#include "sim/run/linear_growth.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::sim {

LinearGrowth error_growth(const Scene& scene, const Model& model, int body) {
  const auto* beam = std::get_if<BeamDef>(&scene.bodies[body].kind);
  if (!beam || beam->model == BeamModel::modal) return {};
  for (const FlexibleNode& node : model.parts[model.pieces[body].front()].body.nodes)
    for (const MatX& h : node.phi2)
      if (h.size() > 0) return {0.025, 0.11};
  return {0.15, 0.18};
}

double tangent_turn(const Vec3& rotation) {
  const double angle = rotation.norm();
  if (angle == 0.0) return 0.0;
  const double across2 = rotation.tail<2>().squaredNorm() / (angle * angle), half = std::sin(0.5 * angle);
  return 2.0 * std::asin(std::min(1.0, std::sqrt(across2) * std::abs(half)));
}

namespace {

// Nodes of each volume of a beam, of a whole body otherwise.
std::vector<std::vector<Eigen::Index>> nodes_by_piece(const ResultBody& body, int pieces) {
  std::vector<std::vector<Eigen::Index>> out(pieces);
  const double l = body.length / pieces;
  for (size_t k = 0; k < body.nodes.size(); ++k)
    for (int i = 0; i < pieces; ++i) {
      const double x = body.nodes[k].origin.x();
      if (pieces == 1 || (x >= (i - 1e-9) * l && x <= (i + 1 + 1e-9) * l)) out[i].push_back(static_cast<Eigen::Index>(k));
    }
  return out;
}

// Radians swung by a history that goes to and fro: half a turn from one end of its range to the other. What moves by less than a millionth
// stands still.
double radians_swung(const VecX& history) {
  const double range = history.maxCoeff() - history.minCoeff();
  if (!(range > 1e-6 * history.cwiseAbs().maxCoeff())) return 0.0;
  return std::numbers::pi * (history.tail(history.size() - 1) - history.head(history.size() - 1)).cwiseAbs().sum() / range;
}

// Turn of the node that turns farthest at some time, signed by its larger component, so that a swing through zero counts once.
VecX signed_turn(const ResultBody& body) {
  Eigen::Index node = 0, row = 0;
  double largest = 0.0;
  for (Eigen::Index k = 0; k + 2 < body.rotation.cols(); k += 3)
    if (const double turn = body.rotation.middleCols<3>(k).rowwise().norm().maxCoeff(&row); turn > largest) largest = turn, node = k;
  VecX out = body.rotation.middleCols<3>(node).rowwise().norm();
  Eigen::Index axis = 0;
  body.rotation.middleCols<3>(node).cwiseAbs().colwise().maxCoeff().maxCoeff(&axis);
  for (Eigen::Index i = 0; i < out.size(); ++i) out[i] = std::copysign(out[i], body.rotation(i, node + axis));
  return out;
}

}  // namespace

std::vector<LinearLimit> linear_limits(const Scene& scene, const Model& model, const Results& results) {
  std::vector<LinearLimit> out;
  for (size_t b = 0; b < results.bodies.size(); ++b) {
    const ResultBody& body = results.bodies[b];
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind);
    if ((beam && beam->model == BeamModel::lumped) || model.parts[model.pieces[b].front()].body.n == 0 || body.rotation.cols() == 0)
      continue;
    const int pieces = static_cast<int>(model.pieces[b].size());
    const LinearGrowth growth = error_growth(scene, model, static_cast<int>(b));
    LinearLimit limit;
    limit.body = static_cast<int>(b);
    limit.pieces = pieces;
    // A volume's share in the error of the frequency goes with its share in the deformation, whose energy goes with the square of the turn
    // as well.
    double squares = 0.0, fourths = 0.0;
    const Eigen::Index rows = body.rotation.rows();
    for (const std::vector<Eigen::Index>& nodes : nodes_by_piece(body, pieces)) {
      if (nodes.empty()) continue;
      VecX turn = VecX::Zero(rows);
      for (Eigen::Index row = 0; row < rows; ++row) {
        // A volume's frame turns with it: what counts is how far it bends.
        const double from = pieces > 1 ? tangent_turn(body.rotation.block<1, 3>(row, 3 * nodes.front()).transpose()) : 0.0;
        for (const Eigen::Index k : nodes) {
          const Vec3 rotation = body.rotation.block<1, 3>(row, 3 * k).transpose();
          turn[row] = std::max(turn[row], beam ? std::abs(tangent_turn(rotation) - from) : rotation.norm());
        }
      }
      Eigen::Index at = 0;
      const double largest = turn.maxCoeff(&at), mean_square = turn.squaredNorm() / static_cast<double>(rows);
      if (largest > limit.turn) limit.turn = largest, limit.when = results.times[at];
      squares += mean_square, fourths += mean_square * mean_square;
    }
    limit.at_rest = growth.at_rest * limit.turn * limit.turn;
    if (squares > 0.0) limit.phase = growth.frequency * fourths / squares * radians_swung(signed_turn(body));
    out.push_back(limit);
  }
  return out;
}

void warn_of_linear_limits(const Scene& scene, const std::vector<LinearLimit>& limits, double tolerated, Notes& into) {
  for (const LinearLimit& limit : limits) {
    const double error = limit.error();
    if (error <= tolerated) continue;
    const BodyDef& body = scene.bodies[limit.body];
    const bool beam = std::holds_alternative<BeamDef>(body.kind);
    into.warn(fmt::format("body '{}'", body.name),
              fmt::format("bends by up to {:.2g} degrees within its own frame (t = {:.4g} s), where linear displacements are {}: {}",
                          limit.turn * 180.0 / std::numbers::pi, limit.when,
                          error < 0.5 ? fmt::format("wrong by about {:.2g} % of the deflection", 100.0 * error) : "wrong",
                          beam ? limit.pieces > 1 ? "take more volumes" : "take model = \"mixed\" with several volumes"
                               : "divide it into several bodies"));
  }
}

}  // namespace flexframe::sim
