#include "sim/run/frequency_response.h"

#include "sim/base/words.h"
#include "sim/dynamics/directions.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/loads.h"
#include "sim/results/outputs.h"
#include "sim/results/recorder.h"
#include "sim/scene/force_kinds.h"
#include "sim/start/linearise.h"

#include <fmt/format.h>

#include <complex>
#include <numbers>

namespace flexframe::sim {
namespace {

using Complex = std::complex<double>;

std::vector<int> loads_of(const System& system, const std::string& force) {
  std::vector<int> loads;
  std::vector<std::string> known;
  for (size_t i = 0; i < system.model.loads.size(); ++i) {
    const ForceDef& def = system.model.loads[i].def;
    if (!traits(def.kind).value || def.name.empty()) continue;
    if (def.name == force) loads.push_back(static_cast<int>(i));
    else if (known.empty() || known.back() != def.name) known.push_back(def.name);
  }
  if (loads.empty())
    throw InputError(fmt::format("{}: {} is no force, torque or distributed force with a name{}; {}", system.scene.file.string(),
                                 quote(force), did_you_mean(force, known),
                                 known.empty() ? "the scene has none" : "there are " + list_words(known)));
  return loads;
}

// Outputs that follow small motions in proportion; an acceleration is what its place does, differentiated twice.
struct Followed {
  std::vector<OutputDef> outputs;
  std::vector<bool> twice;  // an output
  std::vector<std::string> left_out;
};
Followed followed(const Scene& scene) {
  Followed out;
  for (OutputDef def : scene.outputs) {
    const OutputFamily family = family_of(def.quantity);
    const bool power = def.quantity == Quantity::power || def.quantity == Quantity::work;
    const bool made = family == OutputFamily::block || family == OutputFamily::combination;  // of other quantities
    if (made || family == OutputFamily::energy || family == OutputFamily::section || def.quantity == Quantity::reaction || power ||
        def.quantity == Quantity::friction_force) {
      out.left_out.push_back(def.name);
      continue;
    }
    out.twice.push_back(def.quantity == Quantity::acceleration);
    if (out.twice.back()) def.quantity = Quantity::position;
    out.outputs.push_back(def);
  }
  return out;
}

// The mechanism beside its start.
class Beside {
 public:
  Beside(System& system, const OutputPlans& plans)
      : system_(system), plans_(plans), start_(system.work.q), all_(independent_directions(system.model, system.work)) {}

  const std::vector<Direction>& directions() const { return all_; }

  // Moved along one direction, with these rates.
  void put(Eigen::Index moved, double step, const VecX& rates) {
    Work& work = system_.work;
    work.q = start_;
    work.w = rates;
    if (moved >= 0) move_along(system_.model, all_[moved], step, work);
    update_positions(system_.model, work);
    update_velocities(system_.model, work);
  }
  VecX outputs(const VecX& around) {
    VecX row = VecX::Zero(static_cast<Eigen::Index>(plans_.columns.size()));
    evaluate_outputs(system_.model, system_.scene, plans_, system_.work, reactions_, around.size() > 0 ? around.data() : nullptr,
                     row.data());
    return row;
  }

 private:
  System& system_;
  const OutputPlans& plans_;
  VecX start_;
  std::vector<Direction> all_;
  Reactions reactions_;
};

void require_rest(const System& system, const Linearisation& linear, Eigen::Index directions) {
  const std::string file = system.scene.file.string();
  if (linear.moving)
    throw InputError(fmt::format("{}: the start moves; a frequency response is about a start at rest: leave out rates and motions", file));
  if (!linear.equilibrium)
    throw InputError(fmt::format("{}: the start is no equilibrium; write start = \"static\" into [simulation]", file));
  if (!system.model.massless.rates.empty() || linear.equations.M.rows() != directions)
    throw InputError(fmt::format("{}: something without mass is held by springs; give it a mass", file));
}

}  // namespace

FrequencyResponse frequency_response(const System& given, const std::string& force, const VecX& frequencies) {
  System system = given;
  const Followed wanted = followed(system.scene);
  FrequencyResponse out;
  out.left_out = wanted.left_out;
  system.scene.outputs = wanted.outputs;
  if (wanted.outputs.empty())
    throw InputError(
        fmt::format("{}: no output follows a force in proportion; add an [[output]] of a frame or joint", system.scene.file.string()));
  const std::vector<int> loads = loads_of(system, force);
  const Linearisation linear = linearise(system);
  const OutputPlans plans = plan_outputs(system.model, system.scene);
  grow_work(system);
  Beside beside(system, plans);
  const Eigen::Index n = static_cast<Eigen::Index>(beside.directions().size()), columns = static_cast<Eigen::Index>(plans.columns.size());
  require_rest(system, linear, n);
  for (const LinearMode& mode : linear.modes)
    if (mode.frequency > 0.0) out.modes.push_back(mode.frequency);
  std::sort(out.modes.begin(), out.modes.end());

  const VecX still = VecX::Zero(system.model.nv);
  VecX push(n);
  MatX by_place(columns, n), by_rate(columns, n);
  beside.put(-1, 0.0, still);
  const VecX rest = beside.outputs({});
  for (Eigen::Index k = 0; k < n; ++k) {
    const double h = 1e-5 * system.model.size / beside.directions()[k].scale;
    beside.put(k, h, still);
    const VecX ahead = beside.outputs(rest);
    beside.put(k, -h, still);
    by_place.col(k) = (ahead - beside.outputs(rest)) / (2.0 * h);
    beside.put(-1, 0.0, linear.rates.col(k));
    by_rate.col(k) = beside.outputs(rest) - rest;
    for (const int load : loads) system.work.expression_value[system.model.loads[load].expression] = 1.0;
    push[k] = load_state(system.model, system.work, loads).power;
  }

  out.columns = plans.columns;
  out.units = plans.units;
  out.values.resize(columns, frequencies.size());
  const SecondOrder& s = linear.equations;
  for (Eigen::Index f = 0; f < frequencies.size(); ++f) {
    const double w = 2.0 * std::numbers::pi * frequencies[f];
    const Eigen::MatrixXcd dynamic = (s.K - w * w * s.M).cast<Complex>() + Complex(0.0, w) * s.D.cast<Complex>();
    const Eigen::VectorXcd x = dynamic.partialPivLu().solve(push.cast<Complex>());
    out.values.col(f) = by_place.cast<Complex>() * x + Complex(0.0, w) * (by_rate.cast<Complex>() * x);
    for (size_t o = 0; o < wanted.twice.size(); ++o) {
      if (!wanted.twice[o]) continue;
      const OutputPlan& plan = plans.outputs[o];
      out.values.block(plan.first, f, plan.count, 1) *= -w * w;
    }
  }
  for (size_t o = 0; o < wanted.twice.size(); ++o)
    for (int k = 0; wanted.twice[o] && k < plans.outputs[o].count; ++k) out.units[plans.outputs[o].first + k] = "m/s^2";
  return out;
}

}  // namespace flexframe::sim
