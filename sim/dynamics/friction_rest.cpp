#include "sim/dynamics/friction_rest.h"

#include "sim/dynamics/closure.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// A point and the direction of its slip have only just been found; it counts with its static friction until it moves.
struct Trial {
  FrictionPoint* point;
  FrictionPhase before;
  Friction law;
};

// Whether the points of `trials`, in their present phases, all accelerate the way they are to slip; `largest`: of their accelerations so
// far, a point each.
bool slips_on(const Model& model, FrictionState& friction, const std::vector<Trial>& trials, Work& work, VecX& largest) {
  try {
    update_friction_accelerations(model, friction, work);
  } catch (const SimulationError&) {
    return false;  // it jams that way
  }
  bool all = true;
  for (size_t k = 0; k < trials.size(); ++k) {
    const FrictionPoint& p = *trials[k].point;
    const double a = work.wdot[model.parts[p.part].v0 + p.rate];
    double& size = largest[static_cast<Eigen::Index>(k)];
    size = std::max(size, std::abs(a));
    all = all && a * direction(p) > 1e-9 * size;
  }
  return all;
}

}  // namespace

bool turn_round(const Model& model, FrictionState& friction, const std::vector<int>& resting, Work& work) {
  if (resting.empty() || resting.size() > 4) return false;
  std::vector<Trial> trials;
  for (int k : resting) {
    FrictionPoint& p = friction.points[k];
    if (p.phase != FrictionPhase::forward && p.phase != FrictionPhase::backward) return false;
    trials.push_back({&p, p.phase, p.law});
  }
  for (FrictionPoint& p : friction.points) {
    // What comes to rest with them (rates in proportion to one another) takes part.
    if ((p.phase != FrictionPhase::forward && p.phase != FrictionPhase::backward) ||
        std::abs(rate_of(p, model, work.w)) > at_rest / no_speed * friction_rounding(p, friction, model))
      continue;
    if (std::none_of(trials.begin(), trials.end(), [&](const Trial& t) { return t.point == &p; })) trials.push_back({&p, p.phase, p.law});
  }
  if (trials.size() > 4) return false;
  for (Trial& t : trials) t.point->law.coefficient = static_coefficient(t.law);
  VecX largest = VecX::Zero(static_cast<Eigen::Index>(trials.size()));
  unsigned chosen = 0;
  int ways = 0;
  // Twice: the largest accelerations of all ways are what a small one is measured against.
  for (int pass = 0; pass < 2; ++pass) {
    ways = 0;
    for (unsigned way = 0; way < 1u << trials.size(); ++way) {
      for (size_t k = 0; k < trials.size(); ++k) trials[k].point->phase = way >> k & 1u ? FrictionPhase::backward : FrictionPhase::forward;
      if (slips_on(model, friction, trials, work, largest)) chosen = way, ++ways;
    }
  }
  for (size_t k = 0; k < trials.size(); ++k) {
    trials[k].point->law = trials[k].law;
    trials[k].point->phase = ways != 1 ? trials[k].before : chosen >> k & 1u ? FrictionPhase::backward : FrictionPhase::forward;
  }
  return ways == 1;
}

void follow_fastest(const Model& model, FrictionState& friction, const Work& work) {
  for (const FrictionPoint& p : friction.points)
    friction.fastest = std::max(friction.fastest, std::abs(rate_of(p, model, work.w)) * rate_scale(model, p.cluster, p.local));
}

double friction_rounding(const FrictionPoint& p, const FrictionState& friction, const Model& model) {
  return p.phase == FrictionPhase::stick ? 0.0 : no_speed * friction.fastest / rate_scale(model, p.cluster, p.local);
}

bool any_sticks(const FrictionState& friction) {
  return std::any_of(friction.points.begin(), friction.points.end(),
                     [](const FrictionPoint& p) { return p.phase == FrictionPhase::stick; });
}

}  // namespace flexframe::sim
