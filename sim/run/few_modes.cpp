#include "sim/run/few_modes.h"

#include "sim/run/effect_report.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::sim {
namespace {

// With so many more of them it is seen what the others leave out: bending shapes of a beam whose ends are alike move its middle by turns
// only.
constexpr int more_modes = 2;
// What the estimated error of time may be short of (tests/trust).
constexpr double estimates = 5.0;

bool keeps_coordinates(const Scene& scene, const std::string& body) {
  return std::any_of(scene.outputs.begin(), scene.outputs.end(),
                     [&](const OutputDef& o) { return o.of.body == body && (o.quantity == Quantity::q || o.quantity == Quantity::qd); });
}

}  // namespace

void warn_of_few_modes(const Scene& scene, const SimulateOptions& options, const Histories& reference, double deflection, double asked,
                       SolverStatistics& statistics) {
  Scene richer = scene;
  std::string names;
  for (BodyDef& body : richer.bodies) {
    auto* beam = std::get_if<BeamDef>(&body.kind);
    if (!beam || !beam->keep_modes || !beam->initial.q.empty() || !beam->initial.qd.empty() || keeps_coordinates(scene, body.name))
      continue;
    for (std::optional<int>* kept : {&beam->keep_modes, &beam->keep_axial, &beam->keep_torsion})
      if (*kept) *kept = **kept + more_modes;
    names += fmt::format("{}'{}'", names.empty() ? "" : ", ", body.name);
  }
  if (names.empty()) return;
  SimulateOptions again = options;
  again.tolerance = statistics.tolerance;
  again.weight_shares.clear();
  again.progress = {};
  again.tell = {};
  Histories other;
  try {
    other = simulate_histories(richer, again);
  } catch (const SimulationError&) {
    return;
  }
  const Difference difference = compare_histories(reference, other, common_ranges(other, reference, deflection));
  const double noise = estimates * std::max(0.0, statistics.error_estimate);
  if (difference.column < 0 || difference.largest <= asked + noise) return;
  statistics.notes.warn(
      "body " + names,
      fmt::format("too few modes are kept: with {} more in each direction {} changes by {:.2g} of its range; take a larger "
                  "keep_modes, or leave it out",
                  more_modes, reference.columns[difference.column], difference.largest));
}

}  // namespace flexframe::sim
