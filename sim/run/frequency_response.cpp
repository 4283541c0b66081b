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

#include <complex>
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
  const Followed wanted = followed(system.scene);
  FrequencyResponse out;
  out.force = force;
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

  if (has_contact_friction(system.model)) out.notes.push_back(free_by_friction);
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
  for (size_t o = 0; o < wanted.twice.size(); ++o)
    for (int k = 0; wanted.twice[o] && k < plans.outputs[o].count; ++k) out.units[plans.outputs[o].first + k] = "m/s^2";
  return out;
}

}  // namespace flexframe::sim
