#include "sim/run/linear_limit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::sim {
namespace {

constexpr double tolerated = 0.03;

// Error of the deflection, relative, over the square of the turn: measured with a clamped beam under an end load against the elastica
// (P L^2/EI = 0.5, 1, 2). Finite elements move on mean axes, from which both ends turn by half as much.
double error_growth(const Scene& scene, const Model& model, int body) {
  const auto* beam = std::get_if<BeamDef>(&scene.bodies[body].kind);
  if (!beam || beam->model != BeamModel::finite_element) return 0.42;
  for (const FlexibleNode& node : model.parts[model.pieces[body].front()].body.nodes)
    for (const MatX& h : node.phi2)
      if (h.size() > 0) return 0.025;
  return 0.15;
}

// Angle between the undeformed and the deformed tangent of a beam along x.
double tangent_turn(const Vec3& rotation) {
  const double angle = rotation.norm();
  if (angle == 0.0) return 0.0;
  const double across2 = rotation.tail<2>().squaredNorm() / (angle * angle), half = std::sin(0.5 * angle);
  return 2.0 * std::asin(std::min(1.0, std::sqrt(across2) * std::abs(half)));
}

}  // namespace

std::vector<std::string> linear_limit_warnings(const Scene& scene, const Model& model, const Results& results) {
  std::vector<std::string> out;
  for (size_t b = 0; b < results.bodies.size(); ++b) {
    const ResultBody& body = results.bodies[b];
    if (model.pieces[b].size() != 1 || model.parts[model.pieces[b].front()].body.n == 0) continue;
    double largest = 0.0, when = 0.0;
    for (Eigen::Index row = 0; row < body.rotation.rows(); ++row)
      for (Eigen::Index k = 0; k + 2 < body.rotation.cols(); k += 3) {
        const Vec3 rotation = body.rotation.block<1, 3>(row, k).transpose();
        const double turn = body.kind == "beam" ? tangent_turn(rotation) : rotation.norm();
        if (turn > largest) largest = turn, when = results.times[row];
      }
    const double error = error_growth(scene, model, static_cast<int>(b)) * largest * largest;
    if (error <= tolerated) continue;
    out.push_back(fmt::format("body '{}' bends by up to {:.0f} degrees in its frame (t = {:.4g} s), where a linear body is {}: {}", body.name, largest * 180.0 / std::numbers::pi, when,
                              error < 0.5 ? fmt::format("off by about {:.0f} % of its deflection", 100.0 * error) : "wrong",
                              body.kind == "beam" ? "take model = \"mixed\" with several volumes" : "cut it into several bodies"));
  }
  return out;
}

}  // namespace flexframe::sim
