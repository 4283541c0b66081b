#include "sim/time/step_guard.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::sim {

void StepGuard::begin(const System& system, double from, double to) {
  scans_.clear();
  names_.clear();
  places_.clear();
  const Model& model = system.model;
  for (const Load& load : model.loads) {
    if (load.rest >= 0 && !model.expressions[load.rest].constant()) add(load.def.name, FunctionScan(load.def.rest, 0, from, to));
    if (load.expression < 0 || load.function >= 0) continue;
    // The ends of a table over a coordinate are kinks, not pulses; a periodic one repeats.
    if (load.table) places_.push_back({FunctionScan(*load.def.table, 0, load.table->front(), load.table->back()), load.table_part});
    else if (load.def.table) add(load.def.name, FunctionScan(*load.def.table, 0, from, to));
    else if (!model.expressions[load.expression].constant()) add(load.def.name, FunctionScan(load.def.value, 0, from, to));
  }
  for (const Part& part : model.parts) {
    if (part.joint.motion < 0 || model.expressions[part.joint.motion].constant()) continue;
    const JointDef& def = system.scene.joints[part.joint.scene_joint];
    if (def.motion_table) add(def.name, FunctionScan(*def.motion_table, 2, from, to));
    else add(def.name, FunctionScan(def.motion, 2, from, to));
  }
}

void StepGuard::add(const std::string& name, FunctionScan&& scan) {
  scans_.push_back(std::move(scan));
  names_.push_back(name);
}

double StepGuard::limit(const System& system, double t, const VecX& y, double step, double farthest) {
  double out = std::numeric_limits<double>::infinity();
  for (FunctionScan& scan : scans_) out = std::min(out, scan.limit(t, step, farthest));
  for (Place& place : places_) {
    const Part& part = system.model.parts[place.part];
    const int motion = part.joint.motion;
    const auto driven = [&](double time) { return system.model.expressions[motion].value(time); };
    const double at = motion >= 0 ? driven(t) : y[part.q0];
    // Half as far again as it goes at the speed of the last step.
    const double rate = place.seen && t > place.t ? 1.5 * (at - place.at) / (t - place.t) : 0.0;
    double span = std::min(out, farthest) - t;
    for (int halved = 0; halved < 40; ++halved, span *= 0.5) {
      const double there = motion >= 0 ? driven(t + span) : at + rate * span;
      if (place.scan.shows(std::min(at, there), std::max(at, there))) break;
    }
    if (t + span < farthest) out = std::min(out, t + span);
    place.t = t;
    place.at = at;
    place.seen = true;
  }
  return out;
}

std::vector<std::string> StepGuard::complaints() const {
  std::vector<std::string> out;
  for (size_t i = 0; i < scans_.size(); ++i)
    if (scans_[i].gave_up())
      out.push_back(
          fmt::format("the function of time of {} varies so fast that it limited the length of 100000 steps; from then on pulses in it may "
                      "be missed: give it as a table, or shorten the run",
                      names_[i].empty() ? "a force" : fmt::format("'{}'", names_[i])));
  return out;
}

}  // namespace flexframe::sim
