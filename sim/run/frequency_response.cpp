#include "sim/run/frequency_response.h"

#include "sim/base/words.h"
#include "sim/dynamics/directions.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/inverse_dynamics.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/loads.h"
#include "sim/dynamics/massless.h"
#include "sim/results/outputs.h"
#include "sim/results/recorder.h"
#include "sim/scene/force_kinds.h"
#include "sim/start/linearise.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <complex>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

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
  // Rates of the blocks' states there, and forces on the directions.
  std::pair<VecX, VecX> rates_and_forces() {
    RestForces rest;
    rest_forces(system_.model, system_.work, nullptr, rest);
    VecX force(static_cast<Eigen::Index>(all_.size()));
    for (size_t k = 0; k < all_.size(); ++k) force[static_cast<Eigen::Index>(k)] = rest.force[all_[k].v];
    return {system_.work.signals.zdot, force};
  }
  VecX& block_states() { return system_.work.signals.z; }
  VecX outputs(const VecX& around) {
    rates_and_forces();  // values of forces that read the state
    VecX row = VecX::Zero(static_cast<Eigen::Index>(plans_.columns.size()));
    evaluate_outputs(system_.model, plans_, system_.work, reactions_,
                     {.previous = around.size() > 0 ? around.data() : nullptr, .columns = row.data()});
    return row;
  }

 private:
  System& system_;
  const OutputPlans& plans_;
  VecX start_;
  std::vector<Direction> all_;
  Reactions reactions_;
};

// States of blocks in small motions: z' = A z + B x + B' x', forces G z on the directions.
struct BlockStates {
  MatX A, B, B_rate, G;

  Eigen::MatrixXcd stiffness(double w) const {
    const Complex iw(0.0, w);
    const Eigen::MatrixXcd held = iw * Eigen::MatrixXcd::Identity(A.rows(), A.rows()) - A.cast<Complex>();
    return -G.cast<Complex>() * held.partialPivLu().solve(B.cast<Complex>() + iw * B_rate.cast<Complex>());
  }
};

BlockStates block_states(Beside& beside, const System& system, const MatX& rates, const VecX& still) {
  const Eigen::Index nz = system.model.nz, n = static_cast<Eigen::Index>(beside.directions().size());
  constexpr double step = 1e-6;
  BlockStates out{MatX(nz, nz), MatX(nz, n), MatX(nz, n), MatX(n, nz)};
  beside.put(-1, 0.0, still);
  const VecX start = beside.block_states();
  if (const VecX rate = beside.rates_and_forces().first; rate.norm() > 1e-9 * (1.0 + start.norm()))
    throw InputError(
        fmt::format("{}: the blocks are not at rest at the start: give them inputs that are 0 there", system.scene.file.string()));
  for (Eigen::Index j = 0; j < nz; ++j) {
    const double h = step * (1.0 + std::abs(start[j]));
    beside.block_states()[j] = start[j] + h;
    const auto [rate, force] = beside.rates_and_forces();
    beside.block_states()[j] = start[j] - h;
    const auto [rate_below, force_below] = beside.rates_and_forces();
    beside.block_states()[j] = start[j];
    out.A.col(j) = (rate - rate_below) / (2.0 * h);
    out.G.col(j) = (force - force_below) / (2.0 * h);
  }
  for (Eigen::Index k = 0; k < n; ++k) {
    const double h = step * system.model.size / beside.directions()[k].scale;
    const auto slope = [&](const auto& put) {
      put(h);
      const VecX rate = beside.rates_and_forces().first;
      put(-h);
      return VecX((rate - beside.rates_and_forces().first) / (2.0 * h));
    };
    out.B.col(k) = slope([&](double by) { beside.put(k, by, still); });
    out.B_rate.col(k) = slope([&](double by) { beside.put(-1, 0.0, by * rates.col(k)); });
  }
  return out;
}

// Outputs that turn by a corner where the mechanism starts: ahead and back along a direction they change by what is even in the step, at
// half the step by half of it (of a curve a quarter).
std::vector<bool> corners(Beside& beside, const OutputPlans& plans, const VecX& steps, const VecX& still, const VecX& rest) {
  const Eigen::Index columns = rest.size();
  MatX whole(columns, steps.size()), half(columns, steps.size());
  VecX changed = VecX::Zero(columns);
  for (Eigen::Index k = 0; k < steps.size(); ++k)
    for (const double share : {1.0, 0.5}) {
      beside.put(k, share * steps[k], still);
      const VecX ahead = beside.outputs(rest) - rest;
      beside.put(k, -share * steps[k], still);
      const VecX back = beside.outputs(rest) - rest;
      (share == 1.0 ? whole : half).col(k) = 0.5 * (ahead + back);
      changed = changed.cwiseMax(ahead.cwiseAbs());
    }
  constexpr double eps = std::numeric_limits<double>::epsilon();
  constexpr double between = 0.35;  // a quarter and a half
  constexpr double counts = 1e-6;   // of what anything of its unit changes by
  std::vector<bool> out(plans.outputs.size(), false);
  for (size_t o = 0; o < plans.outputs.size(); ++o)
    for (int i = plans.outputs[o].first; i < plans.outputs[o].first + plans.outputs[o].count; ++i) {
      double most = 0.0;
      for (Eigen::Index c = 0; c < columns; ++c)
        if (plans.units[c] == plans.units[i]) most = std::max(most, changed[c]);
      const double least = std::max(counts * most, 1e4 * eps * std::abs(rest[i]));
      for (Eigen::Index k = 0; k < steps.size(); ++k)
        if (std::abs(whole(i, k)) > least && std::abs(half(i, k)) > between * std::abs(whole(i, k))) out[o] = true;
    }
  return out;
}

// What rests by friction of a joint is free in these equations.
void warn_of_friction(const System& system, std::vector<std::string>& warnings) {
  std::vector<std::string> rubbing;
  for (const JointDef& j : system.scene.joints)
    if (j.friction) rubbing.push_back(quote(j.name));
  if (!rubbing.empty())
    warnings.push_back(
        fmt::format("friction of joint {} is left out: where it rests, it holds what small forces would move", fmt::join(rubbing, ", ")));
  if (has_contact_friction(system.model)) warnings.emplace_back(free_by_friction);
}

void require_rest(const System& system, const Linearisation& linear, Eigen::Index directions) {
  const std::string file = system.scene.file.string();
  if (linear.moving)
    throw InputError(fmt::format("{}: the start moves; a frequency response is about a start at rest: leave out rates and motions", file));
  if (!linear.equilibrium)
    throw InputError(fmt::format("{}: the start is no equilibrium; write start = \"static\" into [simulation]", file));
  for (const Signal& s : system.model.signals)
    if (s.block >= 0 && system.model.blocks[s.block].sample > 0.0)
      throw InputError(
          fmt::format("{}: the sampled block {} has no frequency response: leave out its 'sample', or excite it in a run and "
                      "take its spectrum",
                      file, quote(system.scene.blocks[system.model.blocks[s.block].scene_block].name)));
  if (!all_have_inertia(system.model) || linear.equations.M.rows() != directions)
    throw InputError(fmt::format("{}: something without mass is held by springs; give it a mass", file));
}

}  // namespace

FrequencyResponse frequency_response(const System& given, const std::string& force, const VecX& frequencies) {
  System system = given;
  Followed wanted = followed(system.scene);
  FrequencyResponse out;
  out.force = force;
  const std::vector<int> loads = loads_of(system, force);
  const Linearisation linear = linearise(system);
  const VecX still = VecX::Zero(system.model.nv);
  OutputPlans plans;
  const auto make_plans = [&] {
    if (wanted.outputs.empty())
      throw InputError(
          fmt::format("{}: no output follows a force in proportion; add an [[output]] of a frame or joint", system.scene.file.string()));
    system.scene.outputs = wanted.outputs;
    plans = plan_outputs(system.model, system.scene);
    grow_work(system);
  };
  make_plans();
  Beside beside(system, plans);
  const Eigen::Index n = static_cast<Eigen::Index>(beside.directions().size());
  require_rest(system, linear, n);
  VecX steps(n);
  for (Eigen::Index k = 0; k < n; ++k) steps[k] = 1e-5 * system.model.size / beside.directions()[k].scale;
  beside.put(-1, 0.0, still);
  const std::vector<bool> turned = corners(beside, plans, steps, still, beside.outputs({}));
  for (size_t o = wanted.outputs.size(); o-- > 0;) {
    if (!turned[o]) continue;
    wanted.left_out.push_back(wanted.outputs[o].name);
    wanted.outputs.erase(wanted.outputs.begin() + static_cast<std::ptrdiff_t>(o));
    wanted.twice.erase(wanted.twice.begin() + static_cast<std::ptrdiff_t>(o));
  }
  if (wanted.outputs.size() < turned.size()) make_plans();
  out.left_out = wanted.left_out;
  std::vector<std::pair<double, double>> vibrations;
  for (const LinearMode& mode : linear.modes)
    if (mode.frequency > 0.0) vibrations.emplace_back(mode.frequency, mode.damping);
  std::sort(vibrations.begin(), vibrations.end());
  for (const auto& [hertz, damping] : vibrations) out.modes.push_back(hertz), out.damping.push_back(damping);

  const Eigen::Index columns = static_cast<Eigen::Index>(plans.columns.size());
  VecX push(n);
  MatX by_place(columns, n), by_rate(columns, n);
  beside.put(-1, 0.0, still);
  const VecX rest = beside.outputs({});
  for (Eigen::Index k = 0; k < n; ++k) {
    beside.put(k, steps[k], still);
    const VecX ahead = beside.outputs(rest);
    beside.put(k, -steps[k], still);
    by_place.col(k) = (ahead - beside.outputs(rest)) / (2.0 * steps[k]);
    // Small rates: a force may follow them by any law.
    const double h = 0.1 * steps[k];
    beside.put(-1, 0.0, h * linear.rates.col(k));
    const VecX faster = beside.outputs(rest);
    beside.put(-1, 0.0, -h * linear.rates.col(k));
    by_rate.col(k) = (faster - beside.outputs(rest)) / (2.0 * h);
    beside.put(-1, 0.0, linear.rates.col(k));
    for (const int load : loads) system.work.expression_value[system.model.loads[load].expression] = 1.0;
    push[k] = load_state(system.model, system.work, loads).power;
  }

  warn_of_friction(system, out.warnings);
  std::optional<BlockStates> blocks;
  if (system.model.nz > 0) blocks = block_states(beside, system, linear.rates, still);

  out.columns = plans.columns;
  out.units = plans.units;
  out.frequencies = frequencies;
  out.values.resize(columns, frequencies.size());
  const SecondOrder& s = linear.equations;
  for (Eigen::Index f = 0; f < frequencies.size(); ++f) {
    const double w = 2.0 * std::numbers::pi * frequencies[f];
    Eigen::MatrixXcd dynamic = (s.K - w * w * s.M).cast<Complex>() + Complex(0.0, w) * s.D.cast<Complex>();
    if (blocks) dynamic += blocks->stiffness(w);
    const Eigen::VectorXcd x = dynamic.partialPivLu().solve(push.cast<Complex>());
    out.values.col(f) = by_place.cast<Complex>() * x + Complex(0.0, w) * (by_rate.cast<Complex>() * x);
    for (size_t o = 0; o < wanted.twice.size(); ++o) {
      if (!wanted.twice[o]) continue;
      const OutputPlan& plan = plans.outputs[o];
      out.values.block(plan.first, f, plan.count, 1) *= -w * w;
    }
  }
  for (const OutputPlan& plan : plans.outputs) {
    const bool own = plan.def.quantity == Quantity::force && std::any_of(plan.loads.begin(), plan.loads.end(), [&](int l) {
                       return std::find(loads.begin(), loads.end(), l) != loads.end();
                     });
    if (own) out.values.middleRows(plan.first, plan.count).array() += 1.0;
  }
  for (size_t o = 0; o < wanted.twice.size(); ++o)
    for (int k = 0; wanted.twice[o] && k < plans.outputs[o].count; ++k) out.units[plans.outputs[o].first + k] = "m/s^2";
  return out;
}

}  // namespace flexframe::sim
