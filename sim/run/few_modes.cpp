#include "sim/run/few_modes.h"

#include "sim/base/eigen_solvers.h"
#include "sim/bodies/body_file.h"
#include "sim/run/effect_report.h"
#include "sim/run/second_run.h"
#include "sim/run/work_budget.h"
#include "sim/start/make_system.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

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
  out.max_steps.reset();  // that of a run that was made again is for its own steps
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

// Makes the last modes of all bodies of files weigh twice as much, but for those in `known`; their names.
std::string weigh_last_modes(const Scene& scene, const Results& results, const FurtherOfBodies& known, System& system) {
  std::string names;
  for (size_t p = 0; p < system.model.parts.size(); ++p) {
    Part& part = system.model.parts[p];
    if (!is_of_file(scene, part) || known.contains(part.name)) continue;
    const MovedModes modes = moved_modes(part.body, results.bodies[part.scene_body].qd);
    if (modes.shapes.size() == 0) continue;
    const MatX weighed = part.body.Me * modes.shapes(Eigen::all, last_modes(modes.each));
    part.body.Me += weighed * weighed.transpose();
    if (system.plane) system.plane->bodies[p].Me = part.body.Me;
    names += fmt::format("{}'{}'", names.empty() ? "" : ", ", part.name);
  }
  return names;
}

// What the last modes move of all that the modes of a body move, the largest of all bodies of files but for those in `known`.
double share_of_last_modes(const Scene& scene, const Model& model, const Results& results, const FurtherOfBodies& known) {
  double out = 0.0;
  for (const Part& part : model.parts) {
    if (!is_of_file(scene, part) || known.contains(part.name)) continue;
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

// Differences between neighbouring samples over the time between them.
MatX slopes(const MatX& of, double step) { return (of.bottomRows(of.rows() - 1) - of.topRows(of.rows() - 1)) / step; }

double root_mean_square(const MatX& of) { return of.norm() / std::sqrt(static_cast<double>(of.rows())); }

// About what each further shape changes in a body's rates, or their slopes, of all of them: the accelerations bend it by the mass c that it
// has in common with the coordinates, and so it pushes back with c (c rates'') / stiffness: at once, and where the motion rings in step
// with it, for as long as it lasts. Vibrations that the samples do not show are not in it.
VecX worth_of_shapes(const FurtherShapes& shapes, const MatX& rates, const VecX& times) {
  constexpr Eigen::Index slopes_taken = 4;
  const Eigen::Index samples = std::min(rates.rows(), times.size());
  VecX out = VecX::Zero(shapes.count());
  if (samples < slopes_taken + 2 || rates.cols() != shapes.coupling.rows()) return VecX::Constant(shapes.count(), 1.0);
  const double step = times[1] - times[0], duration = times[samples - 1] - times[0];
  MatX seen = rates.topRows(samples - 1);  // the end may lie closer
  for (int order = 0; order < 2; ++order, seen = slopes(seen, step)) {
    const double all = root_mean_square(seen);
    if (!(all > 0.0)) continue;
    const MatX second = slopes(slopes(seen, step), step), pushed = second * shapes.coupling, rise = slopes(pushed, step);
    for (Eigen::Index i = 0; i < shapes.count(); ++i) {
      const double push = root_mean_square(pushed.col(i)) + 0.5 * duration * root_mean_square(rise.col(i));
      out[i] = std::max(out[i], shapes.coupling.col(i).norm() / shapes.stiffness[i] * push / all);
    }
  }
  return out;
}

// Of the shapes those that are worth nearly all that all of them are. Of long runs only where that may be a share of what is asked: what
// samples do not show is looked for in short ones.
FurtherOfBodies those_that_count(const FurtherOfBodies& all, const Results& results, double asked) {
  const bool short_one = results.statistics.work <= least_check;
  FurtherOfBodies out;
  for (const ResultBody& body : results.bodies) {
    const auto found = all.find(body.name);
    if (found == all.end()) continue;
    const VecX worth = worth_of_shapes(found->second, body.qd, results.times);
    // The least ones go as long as they are worth little together.
    std::vector<int> order(static_cast<size_t>(worth.size()));
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](int a, int b) { return worth[a] > worth[b]; });
    const double little = std::max(short_one ? 0.0 : 0.03 * asked, 0.01 * worth.sum());
    for (double left = 0.0; !order.empty() && left + worth[order.back()] <= little; order.pop_back()) left += worth[order.back()];
    if (!order.empty()) out.emplace(body.name, some_of(found->second, order));
  }
  return out;
}

// Of a run whose bodies have further coordinates the columns of one without them; false: some are not there.
bool take_columns(const std::vector<std::string>& columns, Histories& from) {
  if (from.columns == columns) return true;
  std::vector<Eigen::Index> rows;
  for (const std::string& column : columns) {
    const auto at = std::find(from.columns.begin(), from.columns.end(), column);
    if (at == from.columns.end()) return false;
    rows.push_back(at - from.columns.begin());
  }
  std::vector<std::string> units;
  for (const Eigen::Index row : rows) units.push_back(from.units[static_cast<size_t>(row)]);
  from.columns = columns;
  from.units = std::move(units);
  from.values = MatX(from.values(rows, Eigen::all));
  if (from.sizes.size() > 0) from.sizes = VecX(from.sizes(rows));
  return true;
}

std::string names_of(const FurtherOfBodies& bodies) {
  std::string out;
  for (const auto& [name, shapes] : bodies) out += fmt::format("{}'{}'", out.empty() ? "" : ", ", name);
  return out;
}

// Runs beside that of a scene, of what its files' bodies leave out.
struct RunsBeside {
  const Scene& scene;
  const SimulateOptions& options;
  const Histories& reference;
  double asked, allowed;
  Results& results;

  // From another start, at a tolerance; nullopt: why it gives nothing.
  std::optional<Histories> run(const System& from, double tolerance, std::string& why) const {
    SimulateOptions again = beside_run(options, results.statistics);
    again.tolerance = tolerance;
    again.progress = give_up_when_late(allowed, scene.simulation.duration);
    try {
      Histories out = simulate_histories_from(from, scene, again);
      if (take_columns(reference.columns, out)) return out;
    } catch (const SimulationError& error) {
      why = fmt::format("the run that measures it failed ({})", error.what());
    } catch (const BudgetSpent&) {
      why = "that takes longer than the run";
    }
    return std::nullopt;
  }

  Difference compare(const Histories& one, const Histories& other) const {
    double deflection = 0.0;
    for (const ResultBody& body : results.bodies)
      if (body.displacement.size() > 0) deflection = std::max(deflection, body.displacement.cwiseAbs().maxCoeff());
    VecX ranges = common_ranges(other, one, deflection);
    pass_over_amplitudes(scene, reference.columns, ranges);
    return compare_histories(one, other, ranges);
  }

  // By what a run from another start than the scene's own changes the outputs; nullopt: not measured, or by no more than is asked and
  // `times` the error of time. What takes too long is seen of two looser runs, whose errors of time the run itself tells.
  std::optional<Difference> changes(const std::string& names, const System& own, const System& other, double times) const {
    SolverStatistics& statistics = results.statistics;
    std::string why;
    std::optional<Difference> difference;
    double noise = times * std::max(0.0, statistics.error_estimate);
    if (const auto changed = run(other, statistics.tolerance, why)) {
      difference = compare(reference, *changed);
    } else if (statistics.work <= short_run) {
      const double looser = std::min(100.0 * statistics.tolerance, 1e-4);
      std::string again;
      const auto plain = run(own, looser, again), loose = plain ? run(other, looser, again) : std::nullopt;
      if (loose) {
        const Difference seen = compare(*plain, *loose);
        noise = of_two_runs * compare(reference, *plain).largest;
        if (seen.column >= 0 && seen.largest > asked + noise) difference = seen;
      }
    }
    if (!difference && !why.empty())
      statistics.notes.tell("body " + names,
                            fmt::format("whether the modes of its file reach the frequencies of this motion was not measured, as {}", why));
    if (!difference || difference->column < 0 || difference->largest <= asked + noise) return std::nullopt;
    return difference;
  }
};

// Bodies whose files say what their coordinates leave out move with it.
void warn_of_further_shapes(RunsBeside beside, const System& start, const FurtherOfBodies& known) {
  // Their own vibrations are faster than those of the run.
  if (beside.results.statistics.work <= short_run) beside.allowed *= 2.0;
  const FurtherOfBodies further = those_that_count(known, beside.results, beside.asked);
  if (further.empty()) return;
  System richer;
  try {
    richer = make_system(beside.scene, {}, further);
  } catch (const InputError&) {
    return;
  } catch (const SimulationError&) {
    return;
  }
  const std::string names = names_of(further);
  // Their own vibrations change how the runs step.
  if (const auto difference = beside.changes(names, start, richer, of_two_runs))
    beside.results.statistics.notes.warn(
        "body " + names,
        fmt::format("the modes of its file may not reach the frequencies of this motion: {} changes by {:.2g} of its range where the "
                    "body has further shapes of its finite element model, which the file keeps to measure this; reduce the model with "
                    "more modes, or let loads rise and fall more slowly",
                    beside.reference.columns[difference->column], difference->largest));
}

}  // namespace

FurtherOfBodies further_of_files(const Scene& scene, const Model& model) {
  FurtherOfBodies out;
  for (const Part& part : model.parts) {
    if (!is_of_file(scene, part)) continue;
    FurtherShapes shapes = read_further_shapes(std::get<ModalDef>(scene.bodies[part.scene_body].kind).file);
    if (shapes.count() > 0 && is_sound(shapes, part.body.n, std::ssize(part.body.nodes))) out.emplace(part.name, std::move(shapes));
  }
  return out;
}

void warn_of_last_modes(const System& start, const Scene& scene, const SimulateOptions& options, const Histories& reference, double asked,
                        double allowed, Results& results) {
  const RunsBeside beside{scene, options, reference, asked, allowed, results};
  const FurtherOfBodies known = further_of_files(scene, start.model);
  if (!known.empty()) warn_of_further_shapes(beside, start, known);
  // Longer runs are made again only where these modes move at all: a tenth of what is asked, as forces follow their accelerations.
  if (results.statistics.work > least_check && share_of_last_modes(scene, start.model, results, known) < 0.1 * asked) return;
  System heavier = copy_start(start);
  const std::string names = weigh_last_modes(scene, results, known, heavier);
  if (names.empty()) return;
  // Both runs step alike.
  if (const auto difference = beside.changes(names, start, heavier, 1.0))
    results.statistics.notes.warn(
        "body " + names,
        fmt::format(
            "the modes of its file may not reach the frequencies of this motion: {} changes by {:.2g} of its range where the highest "
            "third of them weighs twice as much, and what the file leaves out may be worth as much; reduce the model with more modes, "
            "or let loads rise and fall more slowly",
            reference.columns[difference->column], difference->largest));
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
