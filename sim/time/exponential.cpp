#include "sim/time/exponential.h"

#include "sim/base/four.h"
#include "sim/base/small_matrices.h"
#include "sim/base/work_clock.h"
#include "sim/time/power_series.h"
#include "sim/time/price.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace flexframe::sim {
namespace {

// Radians x of the fastest vibration that a series covers: the terms grow to e^x before they fall, and of the sixteen digits as many are
// lost. A hundredth of the tolerance has to be left.
double radians_of_series(double tolerance) { return std::clamp(std::log(1e14 * tolerance), 6.0, 20.0); }
constexpr int most_terms = 64;
// Terms of a series below this share of the tolerance are left out; where it only finds a place to linearise about.
constexpr double negligible = 1e-4, negligible_ahead = 1e-1;
// Radians within a step from which on a vibration is taken out of the remainder, gradually.
constexpr double turned = 4.0, least_turned = 0.1;
// Tolerances below which what oscillates is sampled: looser ones are asked of outputs whose vibrations are off by more than that. What a
// parabola does not follow is taken out then; of a place in that many radians of the fastest vibration more places tell no more. What less
// of the tolerance does than `unseen` is not looked at.
constexpr double sampled_below = 2e-7, turned_sampled = 1.0, radians_of_place = 0.4, unseen = 0.1;
constexpr Eigen::Index least_places = 8, most_places = 2048;
constexpr double sampled_well = 1.0, sampled_too_well = 0.05;  // of the tolerance: what half the places leave out
// Of what the vibrations are shaken by beside the parabola, by the modes of the middle, so much is an error.
constexpr double shaken_share = 0.2, span_growth = 1.05;
// What decays by more than that share of its frequency (twice the damping ratio) is not shaken: the closed form has no damping.
constexpr double least_damped = 0.2;
// Where more than that share of the radians is left nothing is followed apart; nor where a span of what is would be that short.
constexpr double worth_apart = 0.7, radians_of_span = 5.0;
// Beyond that modes are not those of the matrix any more.
constexpr double most_mixing = 0.003;
constexpr int models_between = 3;  // where nothing is followed apart
constexpr double changing = 0.2;   // share of a frequency's square
constexpr double digits_share = 0.01;
constexpr double aimed_at = 0.4, least_longer = 1.3, most_longer = 3.0;  // of what may be off its place; by how much more radians then
// Of the radians of a series, those that the rest makes at least: one piece.
constexpr double least_share = 0.9;
// What followed apart does to the rest may be left out so far, in weights a step.
constexpr double apart_leaves = 0.1, unrest_share = 2.0;
// What a correction in closed form may leave out, in weights; of what acts at the end so much does on the average.
constexpr double most_left_out = 0.1, mean_share = 0.3;
// Rounding of the rates is looked at after so many steps that failed, where a third of all did; errors of so many times what it does are
// none, from so much of the tolerance on.
constexpr long failures_looked_at = 20;
constexpr double rounding_units = 10.0, least_rounding = 1e-3;
// Two thirds of the series of a step are lost where it is repeated: at 0.9 a third of the steps were.
constexpr double safety = 0.75, least_shrink = 0.2;
// Vibrations and what they do to the motion grow faster with a step than its cube tells: twice as long ones failed in one of three, and a
// step that fails costs as much as three.
constexpr double most_lengthened = 1.5;
// A step whose correction in closed form says that it fails by that much is not solved anew.
constexpr double fails = 1.5;

}  // namespace

ExponentialSolver::ExponentialSolver(const OdeProblem& problem, Evaluate evaluate) : problem_(problem), rates_of_(std::move(evaluate)) {}

void ExponentialSolver::restart(double t0, const VecX& y0) {
  time_ = previous_ = t0;
  state_ = begin_ = y0;
  span_ = 0.0;
  h_ = 0.0;
  restA_.resize(0, 0);
  rest_moves_ = false;
  full_.resize(0);
  shaken_ = {};
  places_ = 0;
  turning_ = 0.0;
  rounding_.resize(0);
  looked_at_ = failures + failures_looked_at;
  model_.modes.shapes.resize(0, 0);  // coordinates may be others
  if (!linearise(t0, y0, nullptr, 0.0, model_)) throw SimulationError("the derivatives at the start cannot be evaluated");
  calm_ = y0;
  calm_rate_ = model_.rates;
  d_ = MatX::Zero(problem_.size, 3);
  d_.col(0).head(nq_) = driven_rates(model_);
  changed_.resize(0);
}

// What prescribed motions alone make of the coordinates' rates where the model stands: those that close loops follow them.
VecX ExponentialSolver::driven_rates(const LinearModel& m) const { return m.rates.head(nq_) - m.coordinates(m.state.segment(nq_, nw_)); }

// Closed parts at the state itself; what they leave out changes as slowly as the mechanism moves: it is followed linearly in time and
// differenced anew once the steps since have cost as much as that does.
bool ExponentialSolver::linearise(double t, const VecX& y, const LinearModel* before, double h, LinearModel& model) {
  model.time = t;
  model.state = y;
  model.rates.resize(problem_.size);
  if (!rates_of_(t, y.data(), model.rates.data())) return false;
  const double since = evaluations_ - renewed_, price = 2.0 * static_cast<double>(nw_);
  const bool anew = restA_.rows() == 0 || since > (rest_moves_ ? price : 0.0);
  problem_.closed_derivatives(t, y.data(), jacobian_);
  ++jacobians;
  nw_ = jacobian_.A.rows();
  nq_ = jacobian_.T.rows;
  evaluations_ += 3.0;  // the closed form costs about two of them
  if (anew) {
    MatX A, B;
    problem_.all_derivatives(t, y.data(), A, B);
    A -= jacobian_.A;
    B -= jacobian_.B;
    rest_moves_ = restA_.rows() == nw_ && t > rest_time_;
    if (rest_moves_) {
      restA1_ = (A - restA_) / (t - rest_time_);
      restB1_ = (B - restB_) / (t - rest_time_);
    } else {
      restA1_ = restB1_ = MatX::Zero(nw_, nw_);
    }
    std::swap(restA_, A);
    std::swap(restB_, B);
    rest_time_ = t;
    renewed_ = evaluations_;
  }
  model.T = jacobian_.T;
  model.P = jacobian_.P;
  model.closed = jacobian_.A;
  model.A = jacobian_.A + restA_ + (t - rest_time_) * restA1_;
  model.B = jacobian_.B + restB_ + (t - rest_time_) * restB1_;
  model.A1 = restA1_;
  model.slope.resize(0, 0);
  if (before && t > before->time) {
    model.apart = t - before->time;
    model.slope = (model.closed - before->closed) / model.apart;
    model.A1 += model.slope;
    if (before->slope.size() > 0) model.A1 += (model.apart / (model.apart + before->apart)) * (model.slope - before->slope);
  }
  set_modes(model, h);
  return true;
}

// What the rates at (t, y) exceed the linear model's by.
VecX ExponentialSolver::remainder(const LinearModel& m, double t, const VecX& y, const VecX& rates) const {
  static thread_local VecX q, p, w, by_A, by_A1, by_B;  // room
  VecX d = rates;
  m.coordinates_into(y.data() + nq_, q);
  d.head(nq_) -= q;
  q = y.head(nq_) - m.state.head(nq_);
  m.directions_into(q.data(), p);
  w = y.segment(nq_, nw_) - m.state.segment(nq_, nw_);
  times_into(m.A, p, by_A);
  times_into(m.A1, p, by_A1);
  times_into(m.B, w, by_B);
  d.segment(nq_, nw_) -= m.rates.segment(nq_, nw_) + by_A + (t - m.time) * by_A1 + by_B;
  return d;
}

// Radians per second: root of the largest eigenvalue's size by a few powers of A, and the largest of B. They may have rows of zeros below.
double ExponentialSolver::fastest(const MatX& A, const MatX& B) const {
  if (nw_ == 0) return 0.0;
  if (probe_.size() != nw_) {
    probe_.resize(nw_);
    for (Eigen::Index i = 0; i < nw_; ++i) probe_[i] = 1.0 / static_cast<double>(i + 1);
  }
  double square = 0.0;
  for (int k = 0; k < 3; ++k) {
    static thread_local VecX all;
    times_into(A, probe_, all);
    const auto next = all.head(nw_);
    const double size = next.norm();
    square = size / probe_.norm();
    if (!(size > 0.0) || !std::isfinite(square)) {
      probe_.resize(0);
      square = 0.0;
      break;
    }
    probe_ = next / size;
  }
  return std::max(std::sqrt(square), std::sqrt(A.diagonal().cwiseAbs().maxCoeff())) + B.diagonal().cwiseAbs().maxCoeff();
}

void ExponentialSolver::LinearModel::directions_into(const double* q, VecX& out) const {
  out.setZero(P.rows);
  P.add_product(1.0, q, out.data());
}

void ExponentialSolver::LinearModel::coordinates_into(const double* p, VecX& out) const {
  out.setZero(T.rows);
  T.add_product(1.0, p, out.data());
}

VecX ExponentialSolver::LinearModel::directions(const Eigen::Ref<const VecX>& q) const {
  VecX out;
  directions_into(q.data(), out);
  return out;
}

VecX ExponentialSolver::LinearModel::coordinates(const Eigen::Ref<const VecX>& p) const {
  VecX out;
  coordinates_into(p.data(), out);
  return out;
}

void ExponentialSolver::LinearModel::write_amounts(const double* w, double* out) const {
  if (plain) std::copy_n(w, P.rows, out);
  else multiply(modes.gauges, w, out);
}

void ExponentialSolver::LinearModel::of_amounts_into(const double* amounts, VecX& out) const {
  out.resize(P.rows);
  if (plain) std::copy_n(amounts, P.rows, out.data());
  else multiply(modes.shapes, amounts, out.data());
}

// For steps of h seconds: from those of the model before where they are close, else anew; none where there is no whole set of them.
void ExponentialSolver::set_modes(LinearModel& m, double h) {
  // Where motions drive all there is, nothing vibrates.
  m.plain = true;
  if (nw_ == 0) return;
  const Modes& before = model_.modes;
  const bool known = before.shapes.rows() == nw_;
  const auto n = static_cast<double>(nw_);
  const double radians = known ? before.frequencies.maxCoeff() * h : 0.0;
  // In pieces of a series: on the way to the middle and to the end they are followed to; what follows some of them apart costs.
  const bool few = 1.5 * radians / radians_of_series(problem_.tolerance) < 4.0 + 0.06 * n;
  // The digits that the slow modes' stiffness loses beside that of the fast ones in amounts, as a share of what it does within the step.
  const bool lost = radians * radians * n * std::numeric_limits<double>::epsilon() > digits_share * problem_.tolerance;
  m.plain = known && (few || lost);
  if (&m != &model_) {
    m.modes.shapes = before.shapes;
    m.modes.gauges = before.gauges;
    if (m.plain) m.modes.frequencies = before.frequencies;
  }
  const bool renew = !m.plain || ++models_since_ >= models_between;
  if (renew) {
    models_since_ = 0;
    if (!known && !find_modes(m.A, m.modes)) m.modes.shapes = m.modes.gauges = MatX::Identity(nw_, nw_);
    express_matrix(m.A, m.modes);
    if (known && mixing(m.modes) > most_mixing) {
      if (!renew_modes(m.modes) && !find_modes(m.A, m.modes)) m.modes.shapes = m.modes.gauges = MatX::Identity(nw_, nw_);
      express_matrix(m.A, m.modes);
    }
    express_others(m.B, m.A1, m.modes);
  }
  if (m.plain) {
    m.modes.A = m.A;
    m.modes.B = m.B;
    m.modes.A1 = m.A1;
    m.moves = m.T.dense();
    return;
  }
  m.moves = MatX::Zero(nq_, nw_);
  for (const SparseEntries::Entry& e : m.T.entries) m.moves.row(e.row) += e.value * m.modes.shapes.row(e.column);
}

// The time, s, in which what turns is taken out of a step of h seconds: the step itself. Sampled steps that become shorter bring vibrations
// back by little a step: with all of them at once the next would have to be short for their sake alone.
double ExponentialSolver::turning_span(double h) const {
  return problem_.tolerance < sampled_below ? std::max(h, turning_ / span_growth) : h;
}

// What turns by several radians within a step of h seconds is brought to where it would rest under the slow part of the load: polynomials
// through values of the remainder would take its oscillation for a slow load.
void ExponentialSolver::remove_oscillation(const LinearModel& m, const Parabola& remainder, double s, double h, VecX& y) const {
  const double within = turning_span(h);
  if (nw_ == 0 || m.modes.frequencies.maxCoeff() * within < least_turned) return;
  const auto& [d, span] = remainder;
  const double theta = s / span, most = problem_.tolerance < sampled_below ? turned_sampled : turned;
  const auto rows = [&](const auto& v) { return v.segment(nq_, nw_); };
  static thread_local VecX q, w, p, load, load_rate, by_B, dp, dw, g, gr;  // room
  q = y.head(nq_) - m.state.head(nq_);
  m.directions_into(q.data(), p);
  w = rows(y) - rows(m.state);
  times_into(m.B, w, by_B);
  load = rows(m.rates) + by_B + rows(d.col(0)) + theta * (rows(d.col(1)) + theta * rows(d.col(2)));
  load_rate = (rows(d.col(1)) + 2.0 * theta * rows(d.col(2))) / span;
  w = rows(y);
  times_into(m.modes.gauges, p, dp);
  times_into(m.modes.gauges, w, dw);
  times_into(m.modes.gauges, load, g);
  times_into(m.modes.gauges, load_rate, gr);
  for (Eigen::Index k = 0; k < dp.size(); ++k) {
    const double f = m.modes.frequencies[k], x = within * f;
    if (x < least_turned) {
      dp[k] = dw[k] = 0.0;
      continue;
    }
    const double square = (most / x) * (most / x), fourth = square * square, share = 1.0 / (1.0 + fourth * fourth);
    dp[k] = share * (dp[k] - g[k] / (f * f));
    dw[k] = share * (dw[k] - gr[k] / (f * f));
  }
  times_into(m.modes.shapes, dp, p);
  times_into(m.modes.shapes, dw, w);
  m.coordinates_into(p.data(), q);
  y.head(nq_) -= q;
  y.segment(nq_, nw_) -= w;
}

// In room that the next one takes.
const ModalState& ExponentialSolver::Amounts::state(const VecX& at, double s) const {
  static thread_local ModalState out;
  const double x = s / span;
  const Eigen::Index n = weights.w.size();
  const auto part = [&](Eigen::Index first, VecX& now, VecX& load, VecX& rate) {
    const auto a = loads.col(0).segment(first, n), b = loads.col(1).segment(first, n), c = loads.col(2).segment(first, n);
    now = at.segment(first, n);
    load = a + x * (b + x * c);
    rate = (b + 2.0 * x * c) / span;
  };
  out.tau = tau + s;
  part(0, out.w, out.load_w, out.rate_w);
  part(rows, out.p, out.load_p, out.rate_p);
  return out;
}

void ExponentialSolver::find_amounts(const LinearModel& m, const VecX& y, double t, const Parabola& remainder, Amounts& a) const {
  const auto& [d, span] = remainder;
  const Eigen::Index n = nw_, rows = (n + 7) / 8 * 8;
  a.tau = t - m.time;
  a.span = span;
  a.rows = rows;
  a.z.setZero(2 * rows);
  m.write_amounts(y.data() + nq_, a.z.data());
  static thread_local VecX q, p, state, by_B, weight;  // room
  static thread_local MatX w;
  q = y.head(nq_) - m.state.head(nq_);
  m.directions_into(q.data(), p);
  m.write_amounts(p.data(), a.z.data() + rows);
  w = d.middleRows(nq_, n);
  state = m.state.segment(nq_, n);
  times_into(m.B, state, by_B);
  w.col(0) += m.rates.segment(nq_, n) - by_B;
  a.loads.setZero(2 * rows, 3);
  for (int k = 0; k < 3; ++k) {
    double* const loads = a.loads.col(k).data();
    m.write_amounts(w.col(k).data(), loads);
    m.directions_into(d.col(k).data(), p);
    m.write_amounts(p.data(), loads + rows);
  }
  weight.resize(problem_.size);
  problem_.weights(y.data(), weight.data());
  a.weights.size = static_cast<double>(problem_.size);
  if (m.plain) a.weights.w = weight.segment(nq_, n);
  else a.weights.w = (weight.segment(nq_, n).asDiagonal() * m.modes.shapes).colwise().norm();
  a.weights.p = (weight.head(nq_).asDiagonal() * m.moves).colwise().norm();
}

// Free parts [p; w] of the modes faster than `limit`, which are marked in fast.
void ExponentialSolver::split(const Modes& modes, const Amounts& amounts, double limit, VecX& fast, VecX& free) const {
  const Eigen::Index n = nw_;
  fast = (modes.frequencies.array() > limit).cast<double>();
  static thread_local VecX u, v;
  const ModalState& begin = amounts.state(amounts.z, 0.0);
  held_at(modes, fast, begin, u, v);
  free.resize(2 * n);
  free << fast.cwiseProduct(begin.p) - u, fast.cwiseProduct(begin.w) - v;
}

// How far what should rest is off its place after s seconds, weighted: what rests at the beginning does so later too, or another frequency
// than its own counts.
double ExponentialSolver::unrest(const Modes& modes, const Amounts& rest, const VecX& share, const Solution& solution, double s) const {
  const Piece& last = solution.pieces[solution.used - 1];
  static thread_local VecX z, u, v, wrong, fast;
  z.resize(2 * rest.rows);
  evaluate_powers(powers_of(last), 1.0, z.data());
  const ModalState& end = rest.state(z, s);
  // With nearly its own frequency, nearly nothing.
  wrong = VecX::Ones(nw_) - share;
  fast = (wrong.array() > 0.0).cast<double>();
  held_at(modes, fast, end, u, v);
  return std::sqrt((wrong.cwiseProduct(end.p - u).cwiseProduct(rest.weights.p).squaredNorm() +
                    wrong.cwiseProduct(end.w - v).cwiseProduct(rest.weights.w).squaredNorm()) /
                   rest.weights.size);
}

// From (t, y) on.
bool ExponentialSolver::solve(const LinearModel& m, const VecX& y, double t, const Parabola& remainder, const Reach& reach,
                              Solution& out) const {
  const Eigen::Index n = nw_;
  out.used = 0;
  out.free = {};
  if (n == 0) return true;
  static thread_local Amounts amounts, rest;
  static thread_local VecX fast, share, free;
  find_amounts(m, y, t, remainder, amounts);
  out.begin = amounts.z;
  Splitting& last = *reach.splitting;
  const double least = least_share * radians_of_series(problem_.tolerance),
               all = m.plain ? 0.0 : reach.length * m.modes.frequencies.maxCoeff();
  const int most_spans = static_cast<int>(std::min(all / radians_of_span, 1000.0));
  // Wider as long as what is followed apart leaves too much.
  last.radians = std::max(least, last.radians);
  while (last.radians < worth_apart * all) {
    const double radians = last.radians;
    rest = amounts;
    const double limit = radians / reach.length;
    split(m.modes, amounts, limit, fast, free);
    // A frequency that changes that much within the step has no place to rest at.
    const double away = std::max(std::abs(amounts.tau), std::abs(amounts.tau + reach.length));
    if (!((away * fast.array() * m.modes.A1.diagonal().array().abs() <= changing * m.modes.frequencies.array().square()).all())) break;
    // A state to linearise about is freed from them anyway. However small they are: their energy is not.
    if (reach.left_out > 0.0) {
      out.free = follow_free(m.modes, amounts.weights, {{free, amounts.tau, reach.length}, reach.left_out, most_spans}, last.spans);
      if (out.free.empty()) {
        last.radians = most_longer * radians;
        last.spans = std::max(1, most_spans / 8);
        continue;
      }
    }
    rest.z.head(n) -= free.tail(n);
    rest.z.segment(rest.rows, n) -= free.head(n);
    share.setOnes(n);
    for (Eigen::Index k = 0; k < n; ++k)
      if (fast[k] > 0.0) share[k] = std::pow(limit / m.modes.frequencies[k], 2);
    if (!march(m.modes, rest, share, reach, out)) break;
    if (reach.left_out <= 0.0) return true;
    const double off = unrest(m.modes, rest, share, out, reach.length);
    // It falls with the square of the radians.
    const double most = unrest_share * reach.left_out, factor = std::sqrt(off / (aimed_at * most));
    last.radians = radians * std::clamp(factor, off > most ? least_longer : 0.7, most_longer);
    if (off <= most) return true;
  }
  out.free = {};
  last.radians = std::min(last.radians, 0.5 * all);
  last.spans = std::max(1, std::min(last.spans / 2, most_spans / 4));
  share.setOnes(n);
  return march(m.modes, amounts, share, reach, out);
}

namespace {

// Columns of n numbers, each row times its share, with zeros up to a multiple of eight rows.
FLEXFRAME_WIDE
void share_rows(const double* matrix, const double* share, Eigen::Index n, double* out) {
  const Eigen::Index rows = (n + 7) / 8 * 8;
  for (Eigen::Index j = 0; j < n; ++j, matrix += n, out += rows) {
    Eigen::Index i = 0;
    for (; i + 4 <= n; i += 4) four(out + i).v = four(share + i).v * four(matrix + i).v;
    for (; i < n; ++i) out[i] = share[i] * matrix[i];
    for (; i < rows; ++i) out[i] = 0.0;
  }
}

// out = by x and base + by x, `size` numbers each, a multiple of four.
FLEXFRAME_WIDE
void set_multiple(double by, const double* x, Eigen::Index size, double* out) {
  for (Eigen::Index i = 0; i < size; i += 4) four(out + i).v = by * four(x + i).v;
}
FLEXFRAME_WIDE
void set_sum(const double* base, double by, const double* x, Eigen::Index size, double* out) {
  for (Eigen::Index i = 0; i < size; i += 4) four(out + i).v = four(base + i).v + by * four(x + i).v;
}

}  // namespace

// The series of a solution, with the rows of w of every mode times its share.
bool ExponentialSolver::march(const Modes& modes, const Amounts& amounts, const VecX& share, const Reach& reach, Solution& out) const {
  const double length = reach.length, span = amounts.span;
  const Eigen::Index n = nw_, rows = amounts.rows;
  static thread_local MatX A, A1, B, g, loads, L;  // of rows as power_series.h has them
  static thread_local VecX z, weights;
  for (auto [matrix, from] : {std::pair{&A, &modes.A}, {&A1, &modes.A1}, {&B, &modes.B}}) {
    matrix->resize(rows, n);
    share_rows(from->data(), share.data(), n, matrix->data());
  }
  g = amounts.loads;
  g.topRows(n) = share.asDiagonal() * amounts.loads.topRows(n);
  loads.resize(2 * rows, 3);
  z = amounts.z;
  weights.setZero(rows);
  weights.head(n) = amounts.weights.w;
  const Eigen::Index block = rows * n;
  L.resize(rows, 3 * n);
  std::copy_n(B.data(), block, L.data() + block);
  double piece_length = std::min(length, radians_of_series(problem_.tolerance) / std::max(fastest(A, B), 1e-300));
  // A step of more pieces than that is not worth its memory: what decays at once is for other methods.
  const double most = std::clamp(4e6 / (2.0 * static_cast<double>(n + 1) * most_terms), 8.0, 500.0);
  if (length > most * piece_length) return false;
  piece_length = length / std::ceil(length / piece_length * (1.0 - 1e-12));
  PowerSeries series;
  series.n = static_cast<int>(n);
  series.rows = static_cast<int>(rows);
  series.matrix = L.data();
  series.loads = loads.data();
  series.weights = weights.data();
  series.negligible = reach.negligible;
  int halved = 0;
  out.used = 0;
  for (double s = 0.0; s < length * (1.0 - 1e-12);) {
    if (out.pieces.size() == out.used) out.pieces.emplace_back();
    Piece& piece = out.pieces[out.used];
    const double part = std::min(piece_length, length - s), a = s / span, b = part / span;
    piece.start = s;
    piece.length = series.length = part;
    if (piece.terms.rows() != 2 * rows) piece.terms.resize(2 * rows, most_terms + 2);
    set_multiple(part, A1.data(), block, L.data());
    set_sum(A.data(), amounts.tau + s, A1.data(), block, L.data() + 2 * block);
    loads.col(0) = g.col(0) + a * (g.col(1) + a * g.col(2));
    loads.col(1) = b * (g.col(1) + 2.0 * a * g.col(2));
    loads.col(2) = b * b * g.col(2);
    piece.terms.col(0).setZero();
    piece.terms.col(1) = z;
    piece.count = expand(series, most_terms, piece.terms.data());
    count_work(series_price(piece.count > 0 ? piece.count : most_terms, static_cast<double>(rows)));
    if (piece.count == 0) {
      // Faster than the estimate said.
      if (++halved > 10) return false;
      piece_length *= 0.5;
      continue;
    }
    evaluate_powers(powers_of(piece), 1.0, z.data());
    ++out.used;
    s += part;
  }
  return true;
}

void ExponentialSolver::evaluate_solution(const LinearModel& m, const VecX& y, const Parabola& remainder, const Solution& solution,
                                          double s, VecX& out) const {
  const auto& [d, span] = remainder;
  const Eigen::Index n = nw_;
  size_t k = 0;
  while (k + 1 < solution.used && s > solution.pieces[k].start + solution.pieces[k].length) ++k;
  out.resize(problem_.size);
  const double theta = s / span;
  static thread_local VecX done, z, q, p, dp;  // room
  done = span * theta * (d.col(0) + theta * (d.col(1) / 2.0 + theta * d.col(2) / 3.0));
  out.head(nq_) = y.head(nq_) + done.head(nq_);
  out.tail(problem_.size - nq_ - n) = y.tail(problem_.size - nq_ - n) + done.tail(problem_.size - nq_ - n);
  if (n == 0) return;
  const Piece& piece = solution.pieces[k];
  const double x = (s - piece.start) / piece.length;
  z.resize(piece.terms.rows());
  const Eigen::Index rows = z.size() / 2;
  evaluate_powers(powers_of(piece), x, z.data());
  if (!solution.free.empty()) {
    const VecX free = solution.free.at(s);
    z.segment(rows, n) += free.head(n);
    z.head(n) += free.tail(n);
  }
  z -= solution.begin;
  m.of_amounts_into(z.data(), p);
  out.segment(nq_, n) = y.segment(nq_, n) + p;
  m.of_amounts_into(z.data() + rows, p);
  m.directions_into(done.data(), dp);
  p -= dp;
  m.coordinates_into(p.data(), q);
  out.head(nq_) += q;
}

// Linearises about the middle of a step of h seconds, to which the model and the remainder of the step before lead.
bool ExponentialSolver::find_middle(double h) {
  MatX ahead = d_;
  if (span_ > 0.0) {
    // About this step's beginning, as a polynomial of s / h.
    const double r = h / span_;
    ahead.col(0) = d_.col(0) + d_.col(1) + d_.col(2);
    ahead.col(1) = r * (d_.col(1) + 2.0 * d_.col(2));
    ahead.col(2) = r * r * d_.col(2);
  }
  if (!solve(model_, state_, time_, {ahead, h}, {0.5 * h, negligible_ahead, 0.0, &splitting_ahead_}, work_)) return false;
  VecX middle;
  evaluate_solution(model_, state_, {ahead, h}, work_, 0.5 * h, middle);
  remove_oscillation(model_, {ahead, h}, 0.5 * h, h, middle);
  return middle.allFinite() && linearise(time_ + 0.5 * h, middle, &model_, h, trial_model_);
}

// The end of a step whose remainder is centre + x slope + x^2 bend, x from -1 at its beginning to 1 at its end.
bool ExponentialSolver::find_end(const VecX& centre, const VecX& slope, const VecX& bend, double h, VecX& end) {
  trial_d_.resize(problem_.size, 3);
  trial_d_.col(0) = centre + bend - slope;
  trial_d_.col(1) = 2.0 * slope - 4.0 * bend;
  trial_d_.col(2) = 4.0 * bend;
  if (!solve(trial_model_, state_, time_, {trial_d_, h}, {h, negligible, apart_leaves, &splitting_}, work_)) return false;
  evaluate_solution(trial_model_, state_, {trial_d_, h}, work_, h, end);
  return end.allFinite();
}

// The end with what its remainder, `change` more than predicted, makes of it; false where the closed form leaves out what counts: how the
// rates' matrix acts on it, and that of the deflections as far as it is none of the vibrations'.
bool ExponentialSolver::correct_end(const VecX& change, double h, const VecX& weight, VecX& end) const {
  const LinearModel& m = trial_model_;
  end = predicted_;
  if (m.modes.frequencies.isZero(0.0)) return false;
  add_correction(m, correction_by(m, change), h, 1.0, end);
  if (!end.allFinite()) return false;
  const VecX w = end.segment(nq_, nw_) - predicted_.segment(nq_, nw_), p = m.directions(end.head(nq_) - predicted_.head(nq_));
  static thread_local VecX left_out, by_B, by_A, amounts, by_shapes;
  times_into(m.B, w, by_B);
  times_into(m.A, p, by_A);
  times_into(m.modes.gauges, p, amounts);
  amounts = m.modes.frequencies.cwiseAbs2().cwiseProduct(amounts);
  times_into(m.modes.shapes, amounts, by_shapes);
  left_out.setZero(problem_.size);
  left_out.segment(nq_, nw_) = mean_share * h * (by_B + by_A + by_shapes);
  left_out.head(nq_) = mean_share * h * m.coordinates(left_out.segment(nq_, nw_));
  return left_out.cwiseProduct(weight).squaredNorm() <= most_left_out * most_left_out * static_cast<double>(problem_.size);
}

bool ExponentialSolver::attempt(double h) {
  const Eigen::Index size = problem_.size;
  if (!find_middle(h)) return false;
  // Rates: zero in the middle. Coordinates: what is not T w. Quadratures have no model: their rates themselves.
  VecX centre = VecX::Zero(size);
  centre.head(nq_) = driven_rates(trial_model_);
  centre.tail(size - nq_ - nw_) = trial_model_.rates.tail(size - nq_ - nw_);
  const VecX d0 = remainder(trial_model_, time_, calm_, calm_rate_);
  // Its bend from where the step before began: every model leaves another remainder, so that the last one's tells nothing.
  VecX bend = VecX::Zero(size);
  if (span_ > 0.0) {
    const VecX dp = remainder(trial_model_, previous_, before_, before_rate_) - centre;
    const double a = 1.0 + 2.0 * span_ / h;
    bend = (dp - a * (d0 - centre)) / (a * a - a);
  }
  if (!find_end(centre, bend - (d0 - centre), bend, h, predicted_)) return false;
  // The same with the remainder at the end found.
  calm_end_ = predicted_;
  remove_oscillation(trial_model_, {trial_d_, h}, h, h, calm_end_);
  calm_end_rate_.resize(size);
  if (!calm_end_.allFinite() || !rates_of_(time_ + h, calm_end_.data(), calm_end_rate_.data())) return false;
  evaluations_ += 1.0;
  const VecX d1 = remainder(trial_model_, time_ + h, calm_end_, calm_end_rate_);
  VecX weight(size);
  problem_.weights(state_.data(), weight.data());
  const auto moved = [&] { return std::sqrt((end_ - predicted_).cwiseProduct(weight).squaredNorm() / static_cast<double>(size)); };
  trial_changed_ = d1 - (trial_d_.col(0) + trial_d_.col(1) + trial_d_.col(2));
  if (correct_end(trial_changed_, h, weight, end_)) {
    trial_d_.col(1) -= trial_changed_;
    trial_d_.col(2) += 2.0 * trial_changed_;
  } else {
    trial_changed_.resize(0);
    const bool failed = end_.allFinite() && moved() > fails;
    if (!failed && !find_end(centre, 0.5 * (d1 - d0), 0.5 * (d0 + d1) - centre, h, end_)) return false;
  }
  error_ = moved();
  trial_shaken_ = {};
  if (error_ > 1.0) error_ -= rounding_of(trial_model_, h, weight);
  return error_ > 1.0 || problem_.tolerance >= sampled_below || follow_oscillation(h, weight);
}

// Where next to nothing moves, and little is asked to be seen, rates are rounding: as loads they leave errors that no shorter step makes
// less. How far the rates at the present state change with its last digits.
void ExponentialSolver::look_at_rounding() {
  VecX y = state_, rates(problem_.size);
  for (Eigen::Index i = 0; i < y.size(); ++i) y[i] *= 1.0 + static_cast<double>(i % 3 - 1) * 2.0 * std::numeric_limits<double>::epsilon();
  rounding_ = VecX::Zero(nw_);
  VecX here(problem_.size);
  if (!rates_of_(time_, y.data(), rates.data()) || !rates_of_(time_, state_.data(), here.data())) return;
  rounding_ = (rates - here).segment(nq_, nw_).cwiseAbs();
}

// What of a step's estimated error, in weights, is rounding.
double ExponentialSolver::rounding_of(const LinearModel& m, double h, const VecX& weight) const {
  if (rounding_.size() != nw_ || nw_ == 0) return 0.0;
  MatX load = MatX::Zero(problem_.size, 3);
  load.col(0).segment(nq_, nw_) = rounding_;
  const double effect = effect_of(m, load, h, weight);
  return effect < least_rounding ? 0.0 : rounding_units * effect;
}

// What a load of so much (1, x, x^2, x from -1 to 1 over a step) makes of coordinates and rates, in weights: what vibrates is moved by it
// once, all else as long as the step lasts.
double ExponentialSolver::effect_of(const LinearModel& m, const MatX& load, double h, const VecX& weight) const {
  VecX most = (m.modes.gauges * load.middleRows(nq_, nw_)).cwiseAbs() * Eigen::Vector3d(1.0, 1.0 / 3.0, 1.0 / 3.0), p = most;
  for (Eigen::Index k = 0; k < nw_; ++k) {
    const double f = std::max(m.modes.frequencies[k], 1.0 / h);
    p[k] /= f * f;
    most[k] /= f;
  }
  VecX state(nq_ + nw_);
  state.head(nq_) = m.coordinates(times(m.modes.shapes, p));
  state.tail(nw_) = times(m.modes.shapes, most);
  return std::sqrt(state.cwiseProduct(weight.head(nq_ + nw_)).squaredNorm() / static_cast<double>(problem_.size));
}

// Columns first, first + every, ...: what the remainder along the trial step's solution, oscillations and all, exceeds its parabola by.
bool ExponentialSolver::sample(double h, Eigen::Index first, Eigen::Index every, MatX& values) {
  const LinearModel& m = trial_model_;
  MatX solved = trial_d_;
  if (trial_changed_.size() > 0) {
    solved.col(1) += trial_changed_;
    solved.col(2) -= 2.0 * trial_changed_;
  }
  const Eigen::Index last = values.cols() - 1;
  VecX y, rates(problem_.size);
  for (Eigen::Index i = first; i <= last; i += every) {
    const double theta = static_cast<double>(i) / static_cast<double>(last), t = time_ + theta * h;
    if (i == 0 && full_.size() == problem_.size) {
      y = full_;
      rates = full_rate_;
    } else {
      evaluate_solution(m, state_, {solved, h}, work_, theta * h, y);
      if (trial_changed_.size() > 0) add_correction(m, correction_by(m, trial_changed_), h, theta, y);
      if (!y.allFinite() || !rates_of_(t, y.data(), rates.data())) return false;
      evaluations_ += 1.0;
    }
    values.col(i) = remainder(m, t, y, rates) - (trial_d_.col(0) + theta * (trial_d_.col(1) + theta * trial_d_.col(2)));
    if (i < last) continue;
    full_end_ = y;
    full_end_rate_ = rates;
  }
  return true;
}

// Amounts of sampled values of w' that shake the modes over a step of h seconds: without those of what is damped strongly. What does not
// turn within the step is one space, whose shapes may be nearly parallel (a rigid motion and its rate's own change): their amounts are
// large and mean something together only, so that all of them go or none.
MatX ExponentialSolver::shaking_loads(const MatX& values, double h) const {
  const Modes& modes = trial_model_.modes;
  MatX loads = modes.gauges * values.middleRows(nq_, nw_);
  const VecX decay = -(modes.gauges * trial_model_.B).cwiseProduct(modes.shapes.transpose()).rowwise().sum();
  const auto slow = [&](Eigen::Index k) { return modes.frequencies[k] * h < 1.0; };
  bool damped = false;
  for (Eigen::Index k = 0; k < nw_; ++k) {
    if (slow(k)) damped = damped || decay[k] * h > least_damped;
    else if (decay[k] > least_damped * modes.frequencies[k]) loads.row(k).setZero();
  }
  for (Eigen::Index k = 0; damped && k < nw_; ++k)
    if (slow(k)) loads.row(k).setZero();
  return loads;
}

// The end with what oscillates within the step in its remainder.
bool ExponentialSolver::follow_oscillation(double h, const VecX& weight) {
  const Eigen::Index size = problem_.size;
  if (nw_ == 0) return true;
  const double shaken = std::sqrt((predicted_ - calm_end_).cwiseProduct(weight).squaredNorm() / static_cast<double>(size));
  if (shaken <= unseen) {
    full_end_ = calm_end_;
    full_end_rate_ = calm_end_rate_;
    return true;
  }
  const double radians = h * trial_model_.modes.frequencies.maxCoeff();
  MatX values(size, std::max(places_, least_places) + 1), parabola;
  if (!sample(h, 0, 1, values)) return false;
  for (;;) {
    const auto places = values.cols() - 1;
    parabola = closest_parabola(values);
    const double off = effect_of(trial_model_, parabola - closest_parabola(values, 2), h, weight);
    places_ = off < sampled_too_well ? places / 2 : places;
    if (off <= sampled_well || static_cast<double>(places) * radians_of_place > radians || places >= most_places) break;
    values = spread(values);
    if (!sample(h, 1, 2, values)) return false;
  }
  const VecX bend = 0.25 * trial_d_.col(2), slope = 0.5 * (trial_d_.col(1) + trial_d_.col(2)),
             centre = trial_d_.col(0) + 0.5 * trial_d_.col(1) + bend;
  trial_changed_.resize(0);
  if (!find_end(centre + parabola.col(0), slope + parabola.col(1), bend + parabola.col(2), h, end_)) return false;
  const Eigen::Index last = values.cols() - 1;
  for (Eigen::Index i = 0; i <= last; ++i) {
    const double x = 2.0 * static_cast<double>(i) / static_cast<double>(last) - 1.0;
    values.col(i) -= parabola * Eigen::Vector3d(1.0, x, x * x);
  }
  trial_shaken_ = shake(trial_model_.modes.frequencies, h, shaking_loads(values, h));
  const VecX steady = end_;
  add_shaken(trial_model_, trial_shaken_, h, end_);
  error_ = std::max(error_, shaken_share * std::sqrt((end_ - steady).cwiseProduct(weight).squaredNorm() / static_cast<double>(size)));
  return end_.allFinite();
}

void ExponentialSolver::add_shaken(const LinearModel& m, const Shaken& shaken, double s, VecX& y) const {
  if (shaken.empty()) return;
  const VecX amounts = shaken.at(s);
  y.head(nq_) += m.coordinates(times(m.modes.shapes, amounts.head(nw_)));
  y.segment(nq_, nw_) += times(m.modes.shapes, amounts.tail(nw_));
}

double ExponentialSolver::step(double t_stop, VecX& y) {
  const double room = t_stop - time_;
  if (h_ <= 0.0) h_ = 0.01 * room;
  for (;;) {
    double h = h_;
    if (h > 0.999 * room) h = room;
    else if (h > 0.5 * room) h = 0.5 * room;
    if (h <= 1e-14 * std::max(std::abs(time_), room) && h < room) throw SimulationError("the steps became too small");
    const bool whole = attempt(h);
    const double factor = whole ? std::clamp(safety * std::cbrt(1.0 / std::max(error_, 1e-6)), least_shrink, most_lengthened) : 0.25;
    if (whole && error_ <= 1.0) {
      previous_ = time_;
      time_ = h == room ? t_stop : time_ + h;
      std::swap(begin_, state_);
      state_ = end_;
      std::swap(before_, calm_);
      std::swap(before_rate_, calm_rate_);
      std::swap(calm_, calm_end_);
      std::swap(calm_rate_, calm_end_rate_);
      std::swap(full_, full_end_);
      std::swap(full_rate_, full_end_rate_);
      std::swap(model_, trial_model_);
      std::swap(d_, trial_d_);
      std::swap(changed_, trial_changed_);
      if (changed_.size() > 0) {
        correction_ = correction_by(model_, changed_);
        solved_ = d_;
        solved_.col(1) += changed_;
        solved_.col(2) -= 2.0 * changed_;
      }
      std::swap(shaken_, trial_shaken_);
      std::swap(solution_, work_);
      within_.made = false;
      turning_ = turning_span(h);
      span_ = last_step = h;
      if (h >= h_ || factor < 1.0) h_ = h * factor;  // a step cut short by the end says little about longer ones
      ++steps;
      y = state_;
      return time_;
    }
    if (++failures >= looked_at_ && 3 * failures > steps && rounding_.size() == 0) look_at_rounding();
    h_ = h * std::min(factor, 0.9);
  }
}

}  // namespace flexframe::sim
