#include "sim/accuracy/accuracy_straight.h"
#include "sim/base/work_clock.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

namespace flexframe::sim {
namespace {

// Of what a finer run tells of space.
constexpr double finer_margin = 2.0;

// What a finer run changes, and what lies beyond it: twice the elements, or half as many modes more beside the shapes of forces at rest,
// bring more than half of what lacks in places, half in rates, a third in forces.
constexpr ByKind by_finer{1.5, 2.0, 3.0};

}  // namespace

// Ranges of the outputs; what stands still counts against its size if that is more than rounding (moments of a hinge about its own axis:
// two runs were never alike in these), places against the largest deflection of a body.
VecX Straight::sizes_of(const Histories& h) const {
  double deflection = 0.0;
  for (const ResultBody& body : run_.results.bodies)
    if (body.displacement.size() > 0) deflection = std::max(deflection, body.displacement.cwiseAbs().maxCoeff());
  VecX out = output_ranges(h, fine_);
  const VecX rounding = rounding_of_outputs(h);
  for (Eigen::Index c = 0; c < out.size(); ++c) {
    if (out[c] > 0.0) continue;
    const double size = h.values.row(c).cwiseAbs().maxCoeff();
    out[c] = h.units[c] == "m" ? deflection : size > rounding[c] ? size : 0.0;
  }
  // A component of a vector that stands still counts against the whole vector.
  for (Eigen::Index c = 0; c < out.size(); ++c) {
    const std::string vector = h.columns[c].substr(0, h.columns[c].rfind('.'));
    for (Eigen::Index k = 0; k < out.size(); ++k)
      if (h.units[k] == h.units[c] && h.columns[k].substr(0, h.columns[k].rfind('.')) == vector) out[c] = std::max(out[c], out[k]);
  }
  return out;
}

// What this run lacks by another one, `other` of it in places, rates and forces each.
bool Straight::space_by(const Scene& other, const ByKind& shares) {
  const Histories thinned = at_times(fine_, looser_.times);
  // One with more modes takes a multiple of the run where bodies touch, and no search of pictures does with less.
  constexpr double dearer_with_modes = 4.0, longest_judge = 8.0;  // CPU s
  const double work = run_.results.statistics.work;
  const bool richer = few_ > 0 && t_.search.pictures && t_.search.touches;
  if (richer) t_.search.until = until_ = std::max(until_, work_seconds() + std::min(dearer_with_modes * work, longest_judge));
  for (const double at : {10.0 * tolerance_, tolerance_}) {
    Scene scene = other;
    scene.simulation.tolerance = at;
    const std::optional<Histories> run = richer ? t_.search.run_within(scene, dearer_with_modes * work) : loose_run(other, at);
    const Histories& against = at > tolerance_ ? looser_ : thinned;
    if (!run || run->columns != against.columns || run->times.size() != against.times.size()) return false;
    space_ = run->values - against.values;
    const VecX sizes = sizes_of(against);
    for (Eigen::Index c = 0; c < space_.rows(); ++c) {
      space_.row(c) *= sizes[c] > 0.0 ? of_kind(fine_.units[c], shares) / sizes[c] : 0.0;
    }
    const bool small = largest(space_) <= share_of_space * t_.accuracy;
    other_ = std::move(*run), other_at_ = at;
    if (small) return true;
  }
  return false;
}

// Whether the margins of an estimate ask for tighter steps, whatever space takes, and these cost little enough (judge_time).
bool Straight::lacks_margin_of_time() const {
  return t_.search.elastic && t_.search.has_levels() && elastic_margin * largest(time_) > t_.accuracy &&
         next_work() <= std::max(dear_step, dearer_step * run_.results.statistics.work);
}

bool Straight::judge_space() {
  space_ = MatX::Zero(time_.rows(), time_.cols());
  space_margin_ = elastic_margin;
  other_.reset();
  if (!t_.search.has_levels()) return true;
  if (few_ > 0) {
    space_margin_ = finer_margin;
    return space_by(t_.search.with_modes(more_than_few(), least_more + 2 * few_stiff_), by_finer);
  }
  const int fewest = t_.search.fewest();
  const std::optional<Scene> half = t_.search.coarser();
  if (fewest < 2 || !half) return false;
  return space_by(*half, by_half(fewest));
}

// How fast half the elements brought it down from a quarter of them: they go on by no less. Of an order p, 1 / (2^p - 1) of the last change
// lacks; more than three times a step are not reckoned with, as few elements fall steeply at first. A run that costs a tenth of one with
// twice the elements.
bool Straight::judge_by_quarter() {
  constexpr int enough = 8;
  constexpr double slowest = 1.5, steepest = 3.0;
  if (few_ > 0 || space_.size() == 0 || !other_ || t_.search.fewest() < enough) return false;
  const std::optional<Scene> quarter = t_.search.coarser(4);
  const std::optional<Histories> run = quarter ? loose_run(*quarter, other_at_) : std::nullopt;
  const Histories fine = other_at_ > tolerance_ ? looser_ : at_times(fine_, looser_.times);
  if (!run || run->columns != fine.columns || run->times.size() != fine.times.size()) return false;
  const MatX first = run->values - other_->values, second = other_->values - fine.values;
  const VecX sizes = sizes_of(fine);
  for (Eigen::Index c = 0; c < space_.rows(); ++c) {
    const double last = largest(second.row(c)), falls = std::min(steepest, largest(first.row(c)) / std::max(last, 1e-300));
    if (falls < slowest || sizes[c] <= 0.0) continue;
    space_.row(c) = second.row(c) / ((falls - 1.0) * sizes[c]);
  }
  space_margin_ = finer_margin;
  return largest(space_) <= share_of_space * t_.accuracy;
}

// Where half the elements promise it, twice as many tell how far these are off: a run where a search makes fifty.
bool Straight::judge_by_doubled() {
  constexpr double promising = 2.0;
  if (few_ > 0 || space_.size() == 0 || largest(space_) > promising * t_.accuracy || run_.results.statistics.work > dear_run) return false;
  const std::optional<Scene> twice = t_.search.doubled();
  if (!twice) return false;
  space_margin_ = finer_margin;
  return space_by(*twice, by_finer);
}

// More modes where these are what keeps a run from the accuracy, or what its margins ask for; false where there are enough of them. More of
// bending, or of stretching and twist where the others did not bring it down (rod that falls on a stop: 5 to 10 of bending 1.5e-3 each).
bool Straight::refine_few() {
  constexpr int most_refinements = 4;
  constexpr double brings = 0.7;
  const double lacks = largest(space_);
  if (few_ == 0 || lacks <= largest(time_) || ++refined_ > most_refinements) return false;
  const bool stretches = std::any_of(t_.search.states.begin(), t_.search.states.end(),
                                     [](const EffectState& s) { return s.on && (s.effect == "axial" || s.effect == "torsion"); });
  if (refined_ > 1 && lacks > brings * lacked_) refined_stiff_ = !refined_stiff_ && stretches;
  if (refined_stiff_) few_stiff_ += least_more + few_stiff_;
  else few_ = more_than_few();
  lacked_ = lacks;
  has_looser_ = false, before_ = 0.0;
  return true;
}

}  // namespace flexframe::sim
