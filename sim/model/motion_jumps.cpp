#include "sim/model/motion_jumps.h"

#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {

// Numbers of a few digits meet within rounding of what they are made of.
constexpr double rounding = 1e-9;

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
