#include "sim/time/step_guard.h"

#include "sim/dynamics/signals.h"
#include "sim/time/events.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::sim {
namespace {

// Steps that expressions which read outputs may shorten.
constexpr long most_shortened = 100'000;

}  // namespace

void StepGuard::begin(const System& system, double from, double to) {
  scans_.clear();
  names_.clear();
  places_.clear();
  readers_.clear();
  known_until_ = before_ = from;
  y_before_.resize(0);
  const Model& model = system.model;
  for (size_t f = 0; f < model.functions.size(); ++f) {
    const Expression& e = model.functions[f].expression;
    if (PathScan scan(e.text(), e.variables()); scan.may_peak()) readers_.push_back({std::move(scan), static_cast<int>(f), 0.0, {}});
  }
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

double StepGuard::limit(System& system, double t, const VecX& y, double step, double farthest, bool& moved) {
  double out = std::numeric_limits<double>::infinity();
  for (FunctionScan& scan : scans_) out = std::min(out, scan.limit(t, step, farthest));
  if (!places_.empty()) out = std::min(out, limit_of_places(system, t, y, std::min(out, farthest)));
  if (!readers_.empty()) out = std::min(out, limit_of_readings(system, t, y, step, std::min(out, farthest), moved));
  return out;
}

double StepGuard::limit_of_places(const System& system, double t, const VecX& y, double farthest) {
  double out = std::numeric_limits<double>::infinity();
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

// Where the signals are at t + ahead if the state goes on as in the last step; false where the mechanism cannot get there.
bool StepGuard::look_ahead(System& system, double t, double ahead, const VecX& y, Look& into) const {
  into.t = t + ahead;
  VecX there = y;
  if (t > before_) there += ahead / (t - before_) * (y - y_before_);
  try {
    set_state(system, into.t, there.data(), false);
    update_signals(system.model, system.work);
  } catch (const SimulationError&) {
    return false;
  }
  into.values = system.work.signals.value;
  return std::all_of(into.values.begin(), into.values.end(), [](double v) { return std::isfinite(v); });
}

bool StepGuard::all_shown(const System& system, const Look& now, const Look& half, const Look& end) {
  // How much farther than foretold a value may go, and how much faster; one that goes straight on does not come back.
  constexpr double beyond = 0.25, behind = 0.02, uncertain = 0.25, straight = 0.1;
  const double width = end.t - now.t;
  std::vector<PathBounds> paths;
  for (Reader& reader : readers_) {
    const StateFunction& function = system.model.functions[reader.function];
    paths.clear();
    for (const int signal : function.signals) {
      const size_t k = signal;
      const double a = now.values[k], b = half.values[k], c = end.values[k], range = std::max({a, b, c}) - std::min({a, b, c});
      const double first = (b - a) / (half.t - now.t), second = (c - b) / (end.t - half.t), bend = (second - first) / (0.5 * width);
      const double faster = uncertain * std::max(std::abs(first), std::abs(second));
      PathBounds p;
      // A distance turns round sharply where it is least: between two looks it may go half as far and back as it goes elsewhere.
      const bool bends = std::abs(second - first) > straight * std::max(std::abs(first), std::abs(second));
      const double aside = bends ? 0.6 * std::max(std::abs(b - a), std::abs(c - b)) : 0.0;
      p.least = std::min({a, b, c}) - std::max(aside, (a <= c ? behind : beyond) * range);
      p.most = std::max({a, b, c}) + std::max(aside, (a <= c ? beyond : behind) * range);
      p.slowest = std::min(first, second) - faster;
      p.fastest = std::max(first, second) + faster;
      p.bend_least = bend - uncertain * std::abs(bend);
      p.bend_most = bend + uncertain * std::abs(bend);
      paths.push_back(p);
    }
    const FunctionBounds bounds = reader.scan.bounds(now.t, end.t, paths);
    // Less than that share of its largest size is nothing.
    constexpr double nothing = 1e-9;
    if (!is_shown(bounds, width, nothing * reader.peak)) return false;
    if (std::isfinite(bounds.size)) reader.peak = std::max(reader.peak, bounds.size);
  }
  return true;
}

double StepGuard::limit_of_readings(System& system, double t, const VecX& y, double step, double farthest, bool& moved) {
  // Steps may grow by that much until they are looked after again; as long as they do not, every third is.
  constexpr double growth = 4.0;
  if (shortened_ > most_shortened) return farthest;
  if (known_until_ >= std::min(farthest, t + 1.5 * step) && step > 0.0) {
    y_before_ = y;
    before_ = t;
    return known_until_;
  }
  moved = true;
  Look now, half, end;
  if (y_before_.size() != y.size()) before_ = t;
  look_ahead(system, t, 0.0, y, now);
  for (Reader& reader : readers_) {
    const StateFunction& function = system.model.functions[reader.function];
    reader.at.clear();
    for (const int signal : function.signals) reader.at.push_back(now.values[signal]);
    reader.scan.choose(t, reader.at.data());
    if (y_before_.size() == y.size()) continue;
    // The first look: how large it is within any reach.
    std::vector<PathBounds> anywhere;
    for (const double value : reader.at) {
      const double reach = 1e3 * std::max(std::abs(value), system.model.size);
      anywhere.push_back({value - reach, value + reach, 0.0, 0.0, 0.0, 0.0});
    }
    if (const double size = reader.scan.bounds(t, farthest, anywhere).size; std::isfinite(size)) reader.peak = size;
  }
  if (y_before_.size() != y.size()) {  // as the rates are
    VecX rates(y.size());
    state_rate(system, t, y.data(), rates.data());
    const double little = 1e-9 * (farthest - t);
    before_ = t - little;
    y_before_ = y - little * rates;
  }
  // What turns is seen a few times a radian.
  constexpr double angle = 1.0;
  const double turning = watched_turning(system);
  double span = farthest - t;
  if (step > 0.0) span = std::min(span, growth * step);
  if (turning > 0.0) span = std::min(span, angle / turning);
  const double least = 1e-13 * (farthest - t);
  while (span > least &&
         !(look_ahead(system, t, 0.5 * span, y, half) && look_ahead(system, t, span, y, end) && all_shown(system, now, half, end)))
    span *= 0.5;
  if (span < step) ++shortened_;
  y_before_ = y;
  before_ = t;
  known_until_ = t + std::max(span, least);
  set_state(system, t, y.data(), false);
  return known_until_;
}

std::vector<std::string> StepGuard::complaints() const {
  std::vector<std::string> out;
  for (size_t i = 0; i < scans_.size(); ++i)
    if (scans_[i].gave_up())
      out.push_back(
          fmt::format("the function of time of {} varies so fast that it limited the length of 100000 steps; from then on pulses in it may "
                      "be missed: give it as a table, or shorten the run",
                      names_[i].empty() ? "a force" : fmt::format("'{}'", names_[i])));
  if (shortened_ > most_shortened)
    out.push_back(
        "expressions that read outputs vary so fast that they limited the length of 100000 steps; from then on narrow peaks in them may be "
        "missed: shorten the run");
  return out;
}

}  // namespace flexframe::sim
