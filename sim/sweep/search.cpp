#include "sim/sweep/search.h"

#include "sim/base/error.h"

#include <fmt/format.h>
#ifdef FLEXFRAME_NLOPT
#include <nlopt.h>
#endif

#include <algorithm>
#include <cmath>
#include <exception>
#include <memory>

namespace flexframe::sim {

#ifdef FLEXFRAME_NLOPT
namespace {

struct OutOfRuns {};

double largest_excess(const Judged& j) {
  double most = 0.0;
  for (const double x : j.excess) most = std::max(most, x);
  return most;
}

class Search {
 public:
  explicit Search(const SearchPlan& plan) : plan_(plan) {}

  SearchEnd run() {
    constexpr int attempts = 8, rounds = 10;
    // The first region: a fifth of each range; a repetition looks nearer.
    constexpr double first_step = 0.2, next_step = 0.05;
    std::vector<double> at;
    try {
      for (int k = 0; k < attempts && at.empty(); ++k) {
        std::vector<double> place = plan_.start(k);
        if (value(place)) at = std::move(place);
      }
      if (at.empty()) return SearchEnd::no_start;
      scale_ = scale_of(*runs_[best()].judged);
      for (int round = 0; round < rounds; ++round) {
        local(at, round == 0 ? first_step : next_step);
        const std::vector<double> found = runs_[best()].place;
        double moved = 0.0;
        for (std::size_t k = 0; k < at.size(); ++k) moved = std::max(moved, std::abs(found[k] - at[k]));
        at = found;
        if (round > 0 && moved <= 4.0 * plan_.precision) break;
      }
    } catch (const OutOfRuns&) {
      return at.empty() ? SearchEnd::no_start : SearchEnd::out_of_runs;
    }
    return SearchEnd::settled;
  }

 private:
  struct Run {
    std::vector<double> place;
    std::optional<Judged> judged;
  };

  // Goal and limits in numbers of the order of one, so that a stress in Pa weighs no more than a way in m.
  static Judged scale_of(const Judged& first) {
    Judged out = first;
    const auto size = [](double& x) { x = std::abs(x) > 1e-300 ? std::abs(x) : 1.0; };
    size(out.goal);
    for (double& x : out.excess) size(x);
    return out;
  }

  const std::optional<Judged>& value(const std::vector<double>& place) {
    for (const Run& run : runs_)
      if (run.place == place) return run.judged;
    if (static_cast<int>(runs_.size()) >= plan_.runs) throw OutOfRuns{};
    std::optional<Judged> judged = plan_.judge(place);
    return runs_.emplace_back(Run{place, std::move(judged)}).judged;
  }

  // Where a run fails the function is a wall: worse than everything seen by the whole difference that was seen.
  Judged walled(const std::vector<double>& place) {
    if (const std::optional<Judged>& judged = value(place)) return *judged;
    Judged wall{0.0, std::vector<double>(plan_.limits, 0.0)};
    double low = 0.0, high = 0.0;
    bool any = false;
    for (const Run& run : runs_) {
      if (!run.judged) continue;
      low = any ? std::min(low, run.judged->goal) : run.judged->goal;
      high = any ? std::max(high, run.judged->goal) : run.judged->goal;
      any = true;
      for (std::size_t k = 0; k < plan_.limits; ++k) wall.excess[k] = std::max(wall.excess[k], run.judged->excess[k]);
    }
    wall.goal = high + std::max(high - low, 0.1 * scale_.goal);
    return wall;
  }

  // Smallest goal of the runs that keep all limits; without such the run that is least beyond them.
  std::size_t best() const {
    std::size_t found = runs_.size();
    for (std::size_t k = 0; k < runs_.size(); ++k) {
      if (!runs_[k].judged) continue;
      if (found == runs_.size()) {
        found = k;
        continue;
      }
      const Judged &a = *runs_[k].judged, &b = *runs_[found].judged;
      const double beyond_a = largest_excess(a), beyond_b = largest_excess(b);
      if (beyond_a > 0.0 || beyond_b > 0.0 ? beyond_a < beyond_b : a.goal < b.goal) found = k;
    }
    return found;
  }

  // Exceptions do not pass through C: they are kept and thrown behind it.
  template <class F>
  void guarded(F&& f) {
    try {
      f();
    } catch (...) {
      problem_ = std::current_exception();
      nlopt_force_stop(method_.get());
    }
  }
  std::vector<double> inside(unsigned n, const double* x) const {
    std::vector<double> out(x, x + n);
    for (double& u : out) u = std::clamp(u, 0.0, 1.0);
    return out;
  }
  static double goal_of(unsigned n, const double* x, double*, void* data) {
    auto& self = *static_cast<Search*>(data);
    double out = 0.0;
    self.guarded([&] { out = self.walled(self.inside(n, x)).goal / self.scale_.goal; });
    return out;
  }
  static void excess_of(unsigned m, double* out, unsigned n, const double* x, double*, void* data) {
    auto& self = *static_cast<Search*>(data);
    std::fill(out, out + m, 0.0);
    self.guarded([&] {
      const Judged j = self.walled(self.inside(n, x));
      for (unsigned k = 0; k < m; ++k) out[k] = j.excess[k] / self.scale_.excess[k];
    });
  }

  void local(std::vector<double> at, double step) {
    const bool models = plan_.limits == 0 && plan_.keys > 1;
    method_.reset(nlopt_create(models ? NLOPT_LN_BOBYQA : NLOPT_LN_COBYLA, static_cast<unsigned>(plan_.keys)));
    if (!method_) throw std::bad_alloc();
    nlopt_set_min_objective(method_.get(), goal_of, this);
    nlopt_set_lower_bounds1(method_.get(), 0.0);
    nlopt_set_upper_bounds1(method_.get(), 1.0);
    if (plan_.limits > 0) nlopt_add_inequality_mconstraint(method_.get(), static_cast<unsigned>(plan_.limits), excess_of, this, nullptr);
    nlopt_set_initial_step1(method_.get(), step);
    nlopt_set_xtol_abs1(method_.get(), plan_.precision);
    double value = 0.0;
    problem_ = nullptr;
    // How it ended does not matter: what counts are the runs, and whether the next round stays at the best of them.
    nlopt_optimize(method_.get(), at.data(), &value);
    if (problem_) std::rethrow_exception(problem_);
  }

  const SearchPlan& plan_;
  std::vector<Run> runs_;
  Judged scale_{1.0, {}};
  std::exception_ptr problem_;
  struct Free {
    void operator()(nlopt_opt method) const { nlopt_destroy(method); }
  };
  std::unique_ptr<nlopt_opt_s, Free> method_;
};

}  // namespace

SearchEnd search_minimum(const SearchPlan& plan) { return Search(plan).run(); }

std::string minimiser_version() {
  int major = 0, minor = 0, bugfix = 0;
  nlopt_version(&major, &minor, &bugfix);
  return fmt::format("NLopt {}.{}.{}", major, minor, bugfix);
}
#else
SearchEnd search_minimum(const SearchPlan&) {
  throw InputError("--minimise and --maximise need NLopt (Debian: libnlopt-dev), which was not there when this program was built");
}

std::string minimiser_version() { return {}; }
#endif

}  // namespace flexframe::sim
