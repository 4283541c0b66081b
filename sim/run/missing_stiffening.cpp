#include "sim/run/missing_stiffening.h"

#include "sim/bodies/body_file.h"
#include "sim/model/mounted_modes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::sim {
namespace {

// rad/s, the fastest from one sample to the next.
double fastest_turn(const ResultBody& body, const VecX& times) {
  double out = 0.0;
  for (Eigen::Index k = 1; k < body.orientation.rows() && k < times.size(); ++k) {
    const double step = times[k] - times[k - 1], cosine = std::abs(body.orientation.row(k).dot(body.orientation.row(k - 1)));
    if (step > 0.0) out = std::max(out, 2.0 * std::acos(std::min(1.0, cosine)) / step);
  }
  return out;
}

template <size_t n>
bool any(const std::array<MatX, n>& blocks) {
  return std::any_of(blocks.begin(), blocks.end(), [](const MatX& b) { return b.size() > 0; });
}

bool stiffens(const FlexibleBody& body) {
  return any(body.md2) || std::any_of(body.nodes.begin(), body.nodes.end(), [&](const FlexibleNode& n) { return any(n.phi2); });
}

// Do the centrifugal forces follow the deformation? Every mass that an elastic coordinate moves makes them do so.
bool follows(const FlexibleBody& body) { return any(body.J2); }

bool lacks(const FlexibleBody& body) { return body.n > 0 && !(stiffens(body) && follows(body)); }

}  // namespace

std::vector<int> without_second_order(const Model& model, const Scene& scene) {
  std::vector<int> out;
  for (size_t b = 0; b < scene.bodies.size() && b < model.pieces.size(); ++b)
    if (std::holds_alternative<ModalDef>(scene.bodies[b].kind) && lacks(model.parts[model.pieces[b].front()].body))
      out.push_back(static_cast<int>(b));
  return out;
}

void warn_of_missing_stiffening(const Scene& scene, const std::vector<int>& bodies, const Results& results, double asked, Notes& notes) {
  std::vector<Mat3> orientation;
  for (const ResultBody& body : results.bodies) {
    if (body.orientation.rows() == 0) return;
    const Eigen::RowVector4d q = body.orientation.row(0);
    orientation.push_back(Quat(q[0], q[1], q[2], q[3]).toRotationMatrix());
  }
  for (const int index : bodies) {
    const auto b = static_cast<size_t>(index);
    const auto& modal = std::get<ModalDef>(scene.bodies[b].kind);
    const double turn = fastest_turn(results.bodies[b], results.times);
    if (turn == 0.0) continue;
    const std::vector<std::string>& without = modal.effects.without;
    const bool unwanted = std::find(without.begin(), without.end(), "stiffening") != without.end();
    const FlexibleBody body = read_body(modal.file, modal.file.string()).body;
    if (!lacks(body) || (unwanted && follows(body))) continue;
    const bool centrifugal = !follows(body) && (unwanted || stiffens(body));
    const MountedModes modes = mounted_modes(body, held_rows(scene, index, body, mounting_of(scene, scene.bodies[b].name), orientation));
    if (modes.omega.size() == 0) continue;
    const double share = std::pow(turn / modes.omega[0], 2);
    if (share > asked)
      notes.warn(fmt::format("body '{}'", scene.bodies[b].name),
                 fmt::format("turns at up to {:.3g} rad/s, and its file has no {}: its lowest vibration, {:.4g} Hz as it is mounted, and "
                             "what it bends are off by a share of the order of {:.2g} of the stiffness; export it with {}, as flexframe "
                             "reduce does",
                             turn, centrifugal ? "centrifugal forces of the deformation (Oe.M1)" : "geometric stiffening (phi.M1)",
                             modes.omega[0] / (2.0 * std::numbers::pi), share, centrifugal ? "them" : "geometric stiffening"));
  }
}

}  // namespace flexframe::sim
