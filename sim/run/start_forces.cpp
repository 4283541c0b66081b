#include "sim/run/start_forces.h"

#include "sim/run/richer_beams.h"
#include "sim/run/second_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// The start is all that is wanted: of the duration; CPU s.
constexpr double instant = 1e-6, longest = 1.0;
// Lengths are at least halved; what the next elements add is 3 % of that (mast of a stacker crane).
constexpr double of_the_change = 2.25;

// Forces and accelerations that are more than `asked` of their ranges at t = 0.
std::vector<Eigen::Index> held_at_once(const Histories& run, const VecX& ranges, double asked) {
  std::vector<Eigen::Index> out;
  for (Eigen::Index c = 0; c < ranges.size(); ++c)
    if (ranges[c] > 0.0 && converges_slowly(run.units[static_cast<size_t>(c)]) && std::abs(run.values(c, 0)) > asked * ranges[c])
      out.push_back(c);
  return out;
}

}  // namespace

bool converges_slowly(const std::string& unit) {
  return unit == "N" || unit == "N m" || unit == "Pa" || unit == "m/s^2" || unit == "rad/s^2";
}

bool halve_first_elements(BeamDef& beam, double sets_length) {
  double root = 1.0, tip = 1.0;  // x/L from there to the nearest place
  for (const auto& [name, share] : beam.frames) {
    if (share > 0.0) root = std::min(root, share);
    if (share < 1.0) tip = std::min(tip, 1.0 - share);
  }
  const auto half_of = [&](double near) { return 0.5 * std::min(near, 1.0 / beam.elements); };
  const bool of_root = beam.elements * root < sets_length, of_tip = beam.elements * tip < sets_length;
  if (of_root) beam.frames["half of the first element"] = half_of(root);
  if (of_tip) beam.frames["half of the last element"] = 1.0 - half_of(tip);
  return of_root || of_tip;
}

void warn_of_start_forces(const Scene& scene, const std::vector<EffectState>& effects, const Histories& run, double asked, Notes& notes) {
  if (scene.simulation.static_start || run.times.size() < 2) return;
  const VecX ranges = output_ranges(run);
  const std::vector<Eigen::Index> columns = held_at_once(run, ranges, asked);
  if (columns.empty()) return;
  Scene shorter = scene;
  std::string names;
  for (size_t b = 0; b < scene.bodies.size(); ++b) {
    auto* beam = std::get_if<BeamDef>(&shorter.bodies[b].kind);
    if (!beam || beam->model != BeamModel::finite_element || beam->keep_modes || beam->initial.static_start || !beam->initial.q.empty() ||
        !beam->initial.qd.empty())
      continue;
    list_effects(effects, scene.bodies[b].name, *beam);
    if (halve_first_elements(*beam)) names += fmt::format("{}'{}'", names.empty() ? "" : ", ", scene.bodies[b].name);
  }
  if (names.empty()) return;
  shorter.simulation.duration *= instant;
  shorter.simulation.output_rate = 1.0 / shorter.simulation.duration;
  double spent = 0.0;
  std::optional<Histories> start;
  try {
    start = simulated_within(shorter, {}, longest, spent);
  } catch (const std::runtime_error&) {}
  if (!start || start->columns != run.columns) return;
  double worst = 0.0;
  std::string column;
  for (const Eigen::Index c : columns) {
    const double lacks = of_the_change * std::abs(start->values(c, 0) - run.values(c, 0)) / ranges[c];
    if (lacks > worst) worst = lacks, column = run.columns[static_cast<size_t>(c)];
  }
  if (!(worst > asked)) return;
  notes.warn(names.find(',') == std::string::npos ? "body " + names : "bodies " + names,
             fmt::format("at t = 0, before anything is strained, a joint still holds what a beam's element beside it weighs: {} is off by "
                         "{:.2g} of its range there; take more elements, or let the loads come gradually",
                         column, worst));
}

}  // namespace flexframe::sim
