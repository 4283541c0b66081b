#include "sim/model/motion_jumps.h"

#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace flexframe::sim {

namespace {

// Numbers of a few digits meet within rounding of what they are made of.
constexpr double rounding = 1e-9;

// Curves through evenly spaced points leave the range of their values by up to 0.49 of it, whatever the values (5 to 150, by chance).
// What leaves it by more was not meant to be smooth there, or lacks points.
constexpr double swing = 0.5;

// Values of a cubic where it turns, from values and slopes (per length of the piece) at its ends.
std::array<double, 2> turning_values(double y0, double y1, double d0, double d1) {
  const double c = 3.0 * (y1 - y0) - 2.0 * d0 - d1, d = d0 + d1 - 2.0 * (y1 - y0);
  const auto value = [&](double s) { return s > 0.0 && s < 1.0 ? y0 + s * (d0 + s * (c + s * d)) : y0; };
  // d0 + 2 c s + 3 d s^2 = 0, without cancellation.
  const double under = c * c - 3.0 * d * d0;
  if (!(under > 0.0)) return {y0, y0};
  const double sum = -(c + std::copysign(std::sqrt(under), c));
  return {value(d != 0.0 ? sum / (3.0 * d) : -1.0), value(sum != 0.0 ? d0 / sum : -1.0)};
}

// Tells where the curve through a table runs far beyond the values that the table has.
void check_table(const std::string& owner, const TableDef& def, Notes& notes) {
  const CubicTable table(def.x, def.y, def.period);
  const auto [low, high] = std::minmax_element(def.y.begin(), def.y.end());
  double worst = 0.0, from = 0.0, to = 0.0, extreme = 0.0;
  for (size_t i = 0; i < def.x.size(); ++i) {
    const bool last = i + 1 == def.x.size();
    if (last && !table.periodic()) break;
    const double a = def.x[i], b = last ? def.x.front() + *def.period : def.x[i + 1];
    if (!(b > a)) break;
    const TimeJet left = table.jet(a), right = table.jet(b);
    for (const double v : turning_values(left.value, right.value, left.rate * (b - a), right.rate * (b - a))) {
      const double beyond = std::max(*low - v, v - *high);
      if (beyond > worst) worst = beyond, from = a, to = b, extreme = v;
    }
  }
  if (worst > swing * (*high - *low))
    notes.warn(owner, fmt::format("the smooth curve through the points of its table reaches {:.4g} between {:.6g} and {:.6g}, though its "
                                  "values lie between {:.4g} and {:.4g}: space the points more evenly, or write steps and corners as an "
                                  "expression (t < 0.5 ? 0 : 1)",
                                  extreme, from, to, *low, *high));
}

}  // namespace

void check_tables(const Scene& scene, Notes& notes) {
  for (const JointDef& j : scene.joints)
    if (j.motion_table) check_table(fmt::format("joint '{}'", j.name), *j.motion_table, notes);
  for (const ForceDef& f : scene.forces)
    if (f.table)
      check_table(f.name.empty() ? fmt::format("the force of line {}", f.line) : fmt::format("force '{}'", f.name), *f.table, notes);
}

void check_motions(Model& model, const Scene& scene, Notes& notes) {
  for (const Part& part : model.parts) {
    const TreeJoint& j = part.joint;
    if (j.motion < 0) continue;
    const JointDef& def = scene.joints[j.scene_joint];
    const std::string idle = j.stop ? "stop" : j.friction ? "friction" : j.spring ? "spring" : "";
    if (!idle.empty())
      notes.warn(fmt::format("joint '{}'", j.name),
                 fmt::format("its motion is prescribed: its {} has no effect and is not counted in the work of the drive", idle));

    TimeFunction f = model.expressions[j.motion];
    const std::vector<double> times = f.switch_times(0.0, scene.simulation.duration);
    // What a jump is measured against: the largest value and rate of all pieces, at places where no symmetry makes them zero.
    double value = 0.0, rate = 0.0;
    const auto look = [&](double from, double to) {
      f.freeze(0.5 * (from + to));
      for (const double share : {0.0, 0.13, 0.29, 0.46, 0.59, 0.74, 0.91, 1.0}) {
        const TimeJet jet = f.jet(from + share * (to - from));
        value = std::max(value, std::abs(jet.value)), rate = std::max(rate, std::abs(jet.rate));
      }
    };
    for (size_t k = 0; k <= times.size(); ++k) look(k > 0 ? times[k - 1] : 0.0, k < times.size() ? times[k] : scene.simulation.duration);
    bool struck = false;
    for (size_t k = 0; k < times.size() && !struck; ++k) {
      // Both pieces at the place where they meet.
      const double t = times[k], before = k > 0 ? times[k - 1] : 0.0,
                   after = k + 1 < times.size() ? times[k + 1] : scene.simulation.duration;
      f.freeze(0.5 * (before + t));
      const TimeJet a = f.jet(t);
      f.freeze(0.5 * (t + after));
      const TimeJet b = f.jet(t);
      const bool length = is_length(j.kind, 0);
      if (std::abs(b.value - a.value) > rounding * value)
        throw InputError(
            fmt::format("{}:{}: joint '{}': key 'motion' jumps by {:.4g} {} at t = {:.6g} s, from {:.6g} to {:.6g}: make it continuous",
                        scene.file.string(), def.line, def.name, b.value - a.value, length ? "m" : "rad", t, a.value, b.value));
      if (std::abs(b.rate - a.rate) > rounding * rate) {
        struck = true;
        notes.warn(fmt::format("joint '{}'", j.name), fmt::format("the rate of its motion jumps by {:.4g} {} at t = {:.6g} s; the impact "
                                                                  "on other bodies is neglected: smooth the motion there",
                                                                  b.rate - a.rate, length ? "m/s" : "rad/s", t));
      }
    }
  }
}

}  // namespace flexframe::sim
