#include "sim/run/load_path.h"

#include "sim/base/eigen_solvers.h"
#include "sim/base/words.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/massless.h"
#include "sim/results/outputs.h"
#include "sim/results/recorder.h"
#include "sim/run/load_path_check.h"
#include "sim/run/second_run.h"
#include "sim/start/make_system.h"
#include "sim/start/static_problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// Shares of the range of loads, along the curve: of the first step, the shortest before it gives up. The longest changes the load by so
// much of its range, or the mechanism by so much of its size.
constexpr double first_step = 0.01, longest_step = 0.04, shortest_step = 1e-7;
// Newton's corrections of a state: a step that needs more is made shorter, one that needs fewer longer.
constexpr int most_corrections = 8, usual_corrections = 4;

// A scene whose start is assembled only.
Scene without_static_start(Scene scene) {
  scene.simulation.static_start = false;
  for (BodyDef& body : scene.bodies) {
    if (auto* beam = std::get_if<BeamDef>(&body.kind)) beam->initial.static_start = false;
    if (auto* modal = std::get_if<ModalDef>(&body.kind)) modal->initial.static_start = false;
    if (auto* space = std::get_if<StateSpaceDef>(&body.kind)) space->initial.static_start = false;
  }
  return scene;
}

// Expressions of the loads that are varied; none: all loads.
std::vector<int> varied(const Model& model, const Scene& scene, const std::string& force) {
  std::vector<int> out;
  std::vector<std::string> known;
  for (const Load& load : model.loads) {
    const ForceKind kind = load.def.kind;
    const bool plain = kind == ForceKind::force || kind == ForceKind::torque || kind == ForceKind::distributed;
    if (!plain || load.function >= 0 || load.table || load.def.name.empty()) continue;
    if (load.def.name == force) out.push_back(load.expression);
    else if (known.empty() || known.back() != load.def.name) known.push_back(load.def.name);
  }
  if (!force.empty() && out.empty())
    throw InputError(fmt::format("{}: {} is no force, torque or distributed force with a name whose value depends on t alone{}; {}",
                                 scene.file.string(), quote(force), did_you_mean(force, known),
                                 known.empty() ? "the scene has none" : "there are " + list_words(known)));
  return out;
}

class Path {
 public:
  Path(System& system, const LoadPathOptions& options)
      : options_(options), system_(system), plans_(plan_outputs(system.model, system.scene)) {
    grow_work(system);
    update_expressions(system.model, 0.0, system.work);
    load_at_rest(system.model, system.work);
    system.work.w.setZero();
    problem_.emplace(static_problem(system.model, system.work));
    metres_ = rate_sizes(system.model);
    for (const TimeJet& jet : problem_->motion)
      if (jet.rate != 0.0)
        throw InputError(
            fmt::format("{}: a prescribed motion has a rate at t = 0; a load path is one of states at rest", system.scene.file.string()));
    varied_ = varied(system.model, system.scene, options.force);
    all_ = {std::vector<char>(system.model.parts.size(), 1), std::vector<char>(system.model.parts.size(), 1), {}};
    out_.columns = plans_.columns;
    out_.units = plans_.units;
  }

  FollowedPath follow() {
    go();
    std::vector<LinearLimit> limits = bent();
    return {std::move(out_), system_.model.effects, std::move(limits), problem_->sought.size(), problem_->model.size, largest_force_};
  }

 private:
  void go() {
    begin();
    const double range = std::abs(options_.to - options_.from);
    double step = first_step * range;
    while (static_cast<int>(out_.states.size()) < options_.most_states) {
      const State before = now_;
      int corrections = 0;
      if (!advance(step, corrections)) {
        now_ = before;
        restore(before);
        step *= 0.5;
        if (step >= shortest_step * range) continue;
        if (!by_size_ && close_loops_by_size()) {
          step = first_step * range;
          continue;
        }
        stop("no further state is found beside the last one");
        return;
      }
      if (before.tangent_load * now_.tangent_load < 0.0) locate_limit(before, step);
      const double sign = options_.to > options_.from ? 1.0 : -1.0;
      if (sign * (now_.load - options_.to) >= 0.0) {
        now_ = before;
        restore(before);
        if (!arrive()) stop("the state at the last load is not found");
        return;
      }
      if (sign * (now_.load - options_.from) < -10.0 * range) {
        stop("the load decreases without limit");
        return;
      }
      record(false);
      step = std::min(longest(range), step * std::clamp(static_cast<double>(usual_corrections) / std::max(corrections, 1), 0.5, 2.0));
    }
    stop(fmt::format("{} states were found", options_.most_states));
  }

  struct State {
    VecX q;
    double load = 0.0;
    VecX tangent;               // in the directions, m
    double tangent_load = 1.0;  // of the load
    VecX way;                   // of all coordinates, in reference_; with tangent_load of unit length
    std::vector<Partition> split;
    bool stable = false;
  };

  // Loops are closed by joints first; where bars come into line, by whatever moves most, so that angles may pass it.
  bool close_loops_by_size() {
    by_size_ = true;
    renew_partitions(problem_->model, by_size_, system_.work);
    VecX f;
    return forces(now_.load, f) && find_tangent(now_.way, now_.tangent_load);
  }

  double longest(double range) const {
    const double moved = reference_ * now_.way.cwiseAbs().maxCoeff();
    return longest_step * std::min(range / std::max(std::abs(now_.tangent_load), 1e-300), problem_->model.size / std::max(moved, 1e-300));
  }

  void set_load(double load) {
    if (options_.force.empty()) {
      problem_->load(load);
      return;
    }
    problem_->load(1.0);
    for (const int e : varied_) system_.work.expression_value[e] = load * problem_->expression[e];
  }

  void restore(const State& state) {
    system_.work.q = state.q;
    for (size_t c = 0; c < state.split.size(); ++c) system_.work.clusters[c].partition = state.split[c];
    set_load(state.load);
    VecX f;
    problem_->evaluate(nullptr, f);
  }

  bool forces(double load, VecX& f) {
    set_load(load);
    return problem_->evaluate(nullptr, f);
  }

  void move(const VecX& x, double share) {
    for (size_t k = 0; k < problem_->sought.size(); ++k)
      move_along(problem_->model, problem_->sought[k],
                 share * x[static_cast<Eigen::Index>(k)] / problem_->scale[static_cast<Eigen::Index>(k)], system_.work);
  }

  // Stiffness and forces per unit of the load at the present state.
  bool linear(double load, MatX& K, VecX& by_load) {
    problem_->find_directions(all_);
    VecX f, ahead;
    if (!forces(load + 1.0, ahead) || !forces(load, f)) return false;
    by_load = ahead - f;
    return problem_->stiffness(K) && K.allFinite();
  }

  // What all coordinates do, dependent ones too, in metres, where those that are sought do x.
  VecX motion(const VecX& x) const {
    const Model& model = problem_->model;
    VecX w = VecX::Zero(model.nv);
    for (size_t k = 0; k < problem_->sought.size(); ++k) {
      const Direction& d = problem_->sought[k];
      w[d.v] += x[static_cast<Eigen::Index>(k)] / d.scale;
    }
    for (size_t c = 0; c < model.clusters.size(); ++c) {
      const ClusterWork& cw = system_.work.clusters[c];
      const int v0 = model.clusters[c].v0;
      for (size_t r = 0; r < cw.partition.dep.size(); ++r)
        for (size_t i = 0; i < cw.partition.ind.size(); ++i) w[v0 + cw.partition.dep[r]] += cw.E(r, i) * w[v0 + cw.partition.ind[i]];
    }
    return w.cwiseProduct(metres_);
  }

  // Tangent of the curve at the present state, on along the way so far; of unit length with `reference_` metres as long as the whole load.
  bool find_tangent(const VecX& before, double load_before) {
    MatX K;
    VecX by_load;
    if (!linear(now_.load, K, by_load)) return false;
    const VecX per_load = solve_square(K, by_load);
    if (!per_load.allFinite()) return false;
    const VecX moved = motion(per_load);
    if (reference_ == 0.0) reference_ = std::max(moved.norm(), 1e-12 * problem_->model.size);
    double length = std::hypot(moved.norm() / reference_, 1.0);
    if (before.size() > 0 && moved.dot(before) / reference_ + load_before < 0.0) length = -length;
    now_.tangent = per_load / length;
    now_.tangent_load = 1.0 / length;
    now_.way = moved / (length * reference_);
    now_.split.clear();
    for (const ClusterWork& cw : system_.work.clusters) now_.split.push_back(cw.partition);
    const MatX S = 0.5 * (K + K.transpose());
    const VecX unit = S.diagonal().cwiseAbs().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    now_.stable = Cholesky(unit.asDiagonal() * S * unit.asDiagonal()).info() == Eigen::Success;
    return true;
  }

  // Newton's method on the forces and the length along the tangent (none: at a fixed load) from the present state.
  bool correct(const VecX& tangent, double tangent_load, int& corrections) {
    double last = 0.0;
    for (corrections = 1; corrections <= most_corrections; ++corrections) {
      MatX K;
      VecX by_load, f;
      if (!linear(now_.load, K, by_load) || !forces(now_.load, f)) return false;
      const Eigen::Index n = f.size();
      MatX whole(n + 1, n + 1);
      whole.topLeftCorner(n, n) = K;
      whole.topRightCorner(n, 1) = -by_load;
      whole.bottomLeftCorner(1, n) = tangent.size() == n ? MatX(tangent.transpose() / (reference_ * reference_)) : MatX(MatX::Zero(1, n));
      whole(n, n) = tangent.size() == n ? tangent_load : 1.0;
      VecX rhs(n + 1);
      rhs << f, 0.0;
      const VecX d = solve_square(whole, rhs);
      if (!d.allFinite()) return false;
      const double size = std::max(d.head(n).cwiseAbs().maxCoeff() / problem_->model.size, std::abs(d[n]));
      if (size > 0.5) return false;
      move(d.head(n), 1.0);
      now_.load += d[n];
      if (!forces(now_.load, f)) return false;
      // Converged; or what is left, by the rate so far, is no more; or as near as the digits allow.
      const double rate = last > 0.0 ? size / last : 1.0;
      if (size <= 1e-11 || (rate < 0.5 && rate * size <= 1e-11) || (size <= 1e-8 && last > 0.0 && rate >= 0.1)) {
        now_.q = system_.work.q;
        return true;
      }
      last = size;
    }
    return false;
  }

  bool advance(double step, int& corrections) {
    const VecX along = now_.tangent, way = now_.way;
    const double load = now_.tangent_load;
    const VecX q = system_.work.q;
    problem_->find_directions(all_);
    if (along.size() != static_cast<Eigen::Index>(problem_->sought.size())) return false;
    move(along, step);
    now_.load += step * load;
    if (!correct(along, load, corrections) || leapt(*problem_, q)) return false;
    renew_partitions(problem_->model, by_size_, system_.work);
    if (!find_tangent(way, load)) return false;
    // A step round a sharp bend might take another branch.
    return now_.way.dot(way) + now_.tangent_load * load > 0.9;
  }

  // Between `before` and the present state the load turns: the place where it does, by bisection of the step and the tangent's sign.
  void locate_limit(const State& before, double step) {
    const State after = now_;
    now_ = before;
    restore(before);
    double low = 0.0, high = step;
    bool found = false;
    for (int k = 0; k < 60 && high - low > 1e-12 * step; ++k) {
      const double middle = 0.5 * (low + high);
      now_ = before;
      restore(before);
      int corrections = 0;
      if (!advance(middle, corrections)) break;
      found = true;
      (now_.tangent_load * before.tangent_load > 0.0 ? low : high) = middle;
    }
    if (found) record(true);
    now_ = after;
    restore(after);
  }

  // To the last load itself, from the state before it.
  bool arrive() {
    const double full = options_.to - now_.load;
    for (int parts = 1; parts <= 64; parts *= 4) {
      const State start = now_;
      bool there = true;
      for (int k = 1; k <= parts && there; ++k) {
        now_.load = start.load + full * k / parts;
        int corrections = 0;
        there = correct({}, 0.0, corrections) && find_tangent(now_.way, now_.tangent_load);
      }
      if (there) {
        record(false);
        return true;
      }
      now_ = start;
      restore(start);
    }
    return false;
  }

  void begin() {
    now_.load = options_.from;
    now_.q = system_.work.q;
    int corrections = 0;
    bool rests = correct({}, 0.0, corrections);
    for (int more = 0; !rests && more < 5; ++more) rests = correct({}, 0.0, corrections);
    if (!rests || !find_tangent({}, 1.0))
      throw InputError(
          fmt::format("{}: there is no equilibrium at the load factor {} beside the assembled start; choose --from so that the "
                      "start is near one, and hold what would move freely",
                      system_.scene.file.string(), options_.from));
    if (now_.way.isZero(0.0))
      out_.warnings.emplace_back(
          "nothing moves with the load: its value at t = 0, of which the curve shows factors, is zero, or it is held");
    if (options_.to < options_.from) {
      now_.tangent = -now_.tangent;
      now_.way = -now_.way;
      now_.tangent_load = -now_.tangent_load;
    }
    record(false);
  }

  void record(bool limit) {
    restore(now_);
    // Nothing accelerates: a far deformed beam's truncated kinetic energy may not be positive, which matters to no state at rest.
    for (size_t k = 0; k < problem_->model.clusters.size(); ++k) {
      const Cluster& c = problem_->model.clusters[k];
      ClusterWork& cw = system_.work.clusters[k];
      cw.M.setZero(c.nv, c.nv);
      cw.r = -problem_->rest.unclosed.segment(c.v0, c.nv);
    }
    if (plans_.reactions) compute_reactions(problem_->model, system_.work, reactions_);
    largest_force_ = std::max(largest_force_, problem_->rest.scale);
    LoadPathState state{now_.load, now_.stable, limit, VecX::Zero(static_cast<Eigen::Index>(plans_.columns.size()))};
    const double* last = out_.states.empty() ? nullptr : out_.states.back().outputs.data();
    evaluate_outputs(problem_->model, plans_, system_.work, reactions_, {.previous = last, .columns = state.outputs.data()});
    out_.states.push_back(std::move(state));
    places_.push_back(now_.q);
  }

  // How far the bodies bend within their frames; `when` is the load.
  std::vector<LinearLimit> bent() {
    System shown = copy_start(system_);
    shown.scene.outputs.clear();
    shown.work.w.setZero();
    std::vector<double> loads;
    for (const LoadPathState& state : out_.states) loads.push_back(state.load);
    Recorder recorder(shown, loads);
    for (const VecX& q : places_) {
      shown.work.q = q;
      recorder.record(shown, 0.0, pack_state(shown, Eigen::Vector2d::Zero()));
    }
    std::vector<LinearLimit> limits = linear_limits(shown.scene, shown.model, recorder.finish(shown));
    for (LinearLimit& limit : limits) limit.phase = 0.0;  // nothing vibrates
    return limits;
  }

  void stop(const std::string& why) {
    out_.complete = false;
    out_.ended = why;
  }

  const LoadPathOptions& options_;
  System& system_;
  OutputPlans plans_;
  std::optional<StaticProblem> problem_;
  std::vector<int> varied_;
  Sought all_;
  State now_;
  bool by_size_ = false;
  VecX metres_;                 // per unit of each rate
  double reference_ = 0.0;      // m
  double largest_force_ = 0.0;  // N
  Reactions reactions_;
  LoadPath out_;
  std::vector<VecX> places_;  // of its states
};

}  // namespace

LoadPath load_path(const Scene& scene, const LoadPathOptions& options) {
  const auto follow = [&](const Scene& s) {
    System system = make_system(s);
    if (system.scene.outputs.empty())
      throw InputError(fmt::format("{}: there is no [[output]]; a load path is one of outputs over the load", s.file.string()));
    if (!all_have_inertia(system.model))
      throw InputError(fmt::format("{}: something without mass is held by springs; give it a mass", s.file.string()));
    return Path(system, options).follow();
  };
  return judged_load_path(without_static_start(scene), options, follow);
}

}  // namespace flexframe::sim
