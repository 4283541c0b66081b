#include "sim/run/few_modes.h"

#include "sim/base/eigen_solvers.h"
#include "sim/run/effect_report.h"
#include "sim/run/second_run.h"
#include "sim/run/work_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace flexframe::sim {
namespace {

// With so many more of them it is seen what the others leave out: bending shapes of a beam whose ends are alike move its middle by turns
// only.
constexpr int more_modes = 2;
// A run with more modes may take so many times the CPU time of one that is short, CPU s, else check_price.
constexpr double longer = 3.0, short_run = 4.0 * least_check;
// Two runs are apart by their errors of time alone by no more than this, in estimated errors.
constexpr double of_two_runs = 2.0;

bool keeps_coordinates(const Scene& scene, const std::string& body) {
  return std::any_of(scene.outputs.begin(), scene.outputs.end(),
                     [&](const OutputDef& o) { return o.of.body == body && (o.quantity == Quantity::q || o.quantity == Quantity::qd); });
}

// A run beside one, at its tolerance, of which nothing is said.
SimulateOptions beside_run(const SimulateOptions& options, const SolverStatistics& run) {
  SimulateOptions out = options;
  out.tolerance = run.tolerance;
  out.weight_shares.clear();
  out.progress = {};
  out.tell = {};
  return out;
}

// The highest third of `count` modes, one at least.
Eigen::Index last_of(Eigen::Index count) { return (count + 2) / 3; }

// Of modes in the order of their frequencies those that stand for what lies beyond: the highest third, and the highest third of those that
// move. Loads in one direction move few: a body that has the deflections of one interface alone (Guyan) has two of each bending, and
// stretching and twist above them.
std::vector<Eigen::Index> last_modes(const MatX& each) {
  const Eigen::Index n = each.cols();
  const VecX most = each.cwiseAbs().colwise().maxCoeff();
  constexpr double still = 1e-3;  // of the largest
  std::vector<Eigen::Index> moving, out;
  for (Eigen::Index k = n; k-- > 0;)
    if (most(k) > still * most.maxCoeff()) moving.push_back(k);
  moving.resize(static_cast<size_t>(last_of(static_cast<Eigen::Index>(moving.size()))));
  for (Eigen::Index k = 0; k < n; ++k)
    if (k >= n - last_of(n) || std::find(moving.begin(), moving.end(), k) != moving.end()) out.push_back(k);
  return out;
}

// Modes of a body and their rates at the samples (samples x modes, root mean squares over its mass).
struct MovedModes {
  MatX shapes, each;  // empty: there are none
};

MovedModes moved_modes(const FlexibleBody& body, const MatX& rates) {
  const GeneralizedEigen modes(body.Ke, body.Me);
  if (modes.info() != Eigen::Success) return {};
  MovedModes out{modes.eigenvectors(), MatX::Zero(1, body.n)};
  if (rates.cols() == body.n && rates.rows() > 0) out.each = rates * (body.Me * out.shapes);
  return out;
}

// A body of a file whose modes the loads move: a scene that gives their start means just these.
bool is_of_file(const Scene& scene, const Part& part) {
  if (part.scene_body < 0 || part.body.n == 0) return false;
  const auto* modal = std::get_if<ModalDef>(&scene.bodies[part.scene_body].kind);
  return modal && modal->initial.q.empty() && modal->initial.qd.empty();
}

// Makes the last modes of all bodies of files weigh twice as much; their names.
std::string weigh_last_modes(const Scene& scene, const Results& results, System& system) {
  std::string names;
  for (size_t p = 0; p < system.model.parts.size(); ++p) {
    Part& part = system.model.parts[p];
    if (!is_of_file(scene, part)) continue;
    const MovedModes modes = moved_modes(part.body, results.bodies[part.scene_body].qd);
    if (modes.shapes.size() == 0) continue;
    const MatX weighed = part.body.Me * modes.shapes(Eigen::all, last_modes(modes.each));
    part.body.Me += weighed * weighed.transpose();
    if (system.plane) system.plane->bodies[p].Me = part.body.Me;
    names += fmt::format("{}'{}'", names.empty() ? "" : ", ", part.name);
  }
  return names;
}

// What the last modes move of all that the modes of a body move, the largest of all bodies of files.
double share_of_last_modes(const Scene& scene, const Model& model, const Results& results) {
  double out = 0.0;
  for (const Part& part : model.parts) {
    if (!is_of_file(scene, part)) continue;
    const MovedModes modes = moved_modes(part.body, results.bodies[part.scene_body].qd);
    if (modes.shapes.size() == 0) continue;
    const double all = modes.each.rowwise().norm().maxCoeff();
    if (all > 0.0) out = std::max(out, modes.each(Eigen::all, last_modes(modes.each)).rowwise().norm().maxCoeff() / all);
  }
  return out;
}

// The amplitudes of the modes themselves are what they are: those of the heavier ones say nothing of modes that are not there.
void pass_over_amplitudes(const Scene& scene, const std::vector<std::string>& columns, VecX& ranges) {
  for (const OutputDef& o : scene.outputs) {
    if (o.quantity != Quantity::q && o.quantity != Quantity::qd) continue;
    for (size_t k = 0; k < columns.size(); ++k)
      if (columns[k] == o.name || columns[k].starts_with(o.name + "."))
        ranges[static_cast<Eigen::Index>(k)] = std::numeric_limits<double>::infinity();
  }
}

}  // namespace

void warn_of_last_modes(const System& start, const Scene& scene, const SimulateOptions& options, const Histories& reference, double asked,
                        double allowed, Results& results) {
  SolverStatistics& statistics = results.statistics;
  // Longer runs are made again only where these modes move at all: a tenth of what is asked, as forces follow their accelerations.
  if (statistics.work > least_check && share_of_last_modes(scene, start.model, results) < 0.1 * asked) return;
  System heavier = copy_start(start);
  const std::string names = weigh_last_modes(scene, results, heavier);
  if (names.empty()) return;
  SimulateOptions again = beside_run(options, statistics);
  again.progress = give_up_after(allowed);
  Histories other;
  try {
    other = simulate_histories_from(heavier, scene, again);
  } catch (const SimulationError&) {
    return;
  } catch (const BudgetSpent&) {
    statistics.notes.tell("body " + names,
                          "whether the modes of its file reach the frequencies of this motion was not measured, as that "
                          "takes longer than the run");
    return;
  }
  double deflection = 0.0;
  for (const ResultBody& body : results.bodies)
    if (body.displacement.size() > 0) deflection = std::max(deflection, body.displacement.cwiseAbs().maxCoeff());
  VecX ranges = common_ranges(other, reference, deflection);
  pass_over_amplitudes(scene, reference.columns, ranges);
  const Difference difference = compare_histories(reference, other, ranges);
  // Both runs step alike.
  const double noise = std::max(0.0, statistics.error_estimate);
  if (difference.column < 0 || difference.largest <= asked + noise) return;
  statistics.notes.warn(
      "body " + names,
      fmt::format(
          "the modes of its file may not reach the frequencies of this motion: {} changes by {:.2g} of its range where the highest "
          "third of them weighs twice as much, and what the file leaves out may be worth as much; reduce the model with more modes, "
          "or let loads rise and fall more slowly",
          reference.columns[difference.column], difference.largest));
}

void warn_of_few_modes(const Scene& scene, const SimulateOptions& options, const ComparedRun& run, double asked,
                       SolverStatistics& statistics) {
  Scene richer = scene;
  std::string names;
  for (BodyDef& body : richer.bodies) {
    auto* beam = std::get_if<BeamDef>(&body.kind);
    if (!beam || !beam->keep_modes || !beam->initial.q.empty() || !beam->initial.qd.empty() || keeps_coordinates(scene, body.name))
      continue;
    for (std::optional<int>* kept : {&beam->keep_modes, &beam->keep_axial, &beam->keep_torsion})
      if (*kept) *kept = **kept + more_modes;
    names += fmt::format("{}'{}'", names.empty() ? "" : ", ", body.name);
  }
  if (names.empty()) return;
  const auto not_measured = [&](const std::string& why) {
    statistics.notes.tell("body " + names, fmt::format("whether the modes that are kept are enough was not measured{}; to measure it, "
                                                       "simulate with two more and compare, or ask for an accuracy",
                                                       why));
  };
  SimulateOptions again = beside_run(options, statistics);
  again.tolerance = run.tolerance;
  again.samples = run.samples;
  const double price = statistics.work <= short_run ? longer : check_price;
  again.progress = give_up_after(std::max(2.0 * least_check, price * statistics.work));
  Histories other;
  try {
    other = simulate_histories(richer, again);
  } catch (const SimulationError&) {
    return not_measured("");
  } catch (const BudgetSpent&) {
    return not_measured(", as that takes longer than the run");
  }
  const Difference difference = compare_histories(run.histories, other, common_ranges(other, run.histories, run.deflection));
  const double noise = of_two_runs * run.error;
  if (difference.column < 0 || difference.largest <= asked) return;
  if (difference.largest <= noise) return not_measured(": the error of the time integration hides it");
  const bool clear = noise < 0.3 * difference.largest;
  statistics.notes.warn(
      "body " + names,
      fmt::format("too few modes are kept: with {} more in each direction {} changes by {:.2g} of its range{}; take a larger "
                  "keep_modes, or leave it out",
                  more_modes, run.histories.columns[difference.column], difference.largest,
                  clear ? "" : fmt::format(", of which up to {:.2g} may be error of the time integration", noise)));
}

}  // namespace flexframe::sim
