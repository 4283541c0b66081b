#include "sim/run/few_modes.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::sim {
namespace {

// With so many more of them it is seen what the others leave out: bending shapes of a beam whose ends are alike move its middle by turns
// only.
constexpr int more_modes = 2;
constexpr int most_eigenforms = 60;  // of a direction, as scenes may give them

bool keeps_coordinates(const Scene& scene, const std::string& body) {
  return std::any_of(scene.outputs.begin(), scene.outputs.end(),
                     [&](const OutputDef& o) { return o.of.body == body && (o.quantity == Quantity::q || o.quantity == Quantity::qd); });
}

// True where the beam got more modes.
bool add_modes(BeamDef& beam) {
  if (!beam.initial.q.empty() || !beam.initial.qd.empty()) return false;
  if (beam.keep_modes) {
    beam.keep_modes = *beam.keep_modes + more_modes;
    return true;
  }
  if (beam.model != BeamModel::modal) return false;
  bool more = false;
  for (auto& [direction, numbers] : beam.modes)
    for (int k = 0; k < more_modes && !numbers.empty(); ++k) {
      const int next = *std::max_element(numbers.begin(), numbers.end()) + 1;
      if (next > most_eigenforms) break;
      numbers.push_back(next);
      more = true;
    }
  return more;
}

}  // namespace

void warn_of_few_modes(const Scene& scene, const SimulateOptions& options, const Histories& reference, double asked,
                       SolverStatistics& statistics) {
  Scene richer = scene;
  std::string names;
  for (BodyDef& body : richer.bodies) {
    auto* beam = std::get_if<BeamDef>(&body.kind);
    if (!beam || keeps_coordinates(scene, body.name) || !add_modes(*beam)) continue;
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
  const Difference difference = compare_histories(reference, other, output_ranges(other));
  // Either run has its error of time.
  const double noise = 2.0 * std::max(0.0, statistics.error_estimate);
  if (difference.column < 0 || difference.largest <= asked + noise) return;
  statistics.notes.warn("body " + names,
                        fmt::format("too few modes: with {} more in each direction {} changes by {:.2g} of its range; give more "
                                    "(keep_modes, modes), or leave their number out (elements)",
                                    more_modes, reference.columns[difference.column], difference.largest));
}

}  // namespace flexframe::sim
