#include "sim/time/exponential.h"

#include "sim/base/eigen_solvers.h"
#include "sim/time/power_series.h"

#include <algorithm>
#include <cmath>
#include <complex>
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
constexpr double turned = 4.0;
// What a correction in closed form may leave out, in weights; of what acts at the end so much does on the average.
constexpr double most_left_out = 0.1, mean_share = 0.3;
// Two thirds of the series of a step are lost where it is repeated: at 0.9 a third of the steps were.
constexpr double safety = 0.75, most_lengthened = 2.0, least_shrink = 0.2;

}  // namespace

ExponentialSolver::ExponentialSolver(const OdeProblem& problem, Evaluate evaluate) : problem_(problem), rates_of_(std::move(evaluate)) {}

void ExponentialSolver::restart(double t0, const VecX& y0) {
  time_ = previous_ = t0;
  state_ = begin_ = y0;
  span_ = 0.0;
  h_ = 0.0;
  restA_.resize(0, 0);
  rest_moves_ = false;
  if (!linearise(t0, y0, nullptr, model_)) throw SimulationError("the derivatives at the start cannot be evaluated");
  calm_ = y0;
  calm_rate_ = model_.rates;
  d_ = MatX::Zero(problem_.size, 3);
  d_.col(0).head(nq_) = driven_rates(model_);
  changed_.resize(0);
}

// What prescribed motions alone make of the coordinates' rates where the model stands: those that close loops follow them.
VecX ExponentialSolver::driven_rates(const LinearModel& m) const { return m.rates.head(nq_) - m.T * m.state.segment(nq_, nw_); }

// Closed parts at the state itself; what they leave out changes as slowly as the mechanism moves: it is followed linearly in time and
// differenced anew once the steps since have cost as much as that does.
bool ExponentialSolver::linearise(double t, const VecX& y, const LinearModel* before, LinearModel& model) {
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
    find_vibrations(jacobian_.A + restA_);
  }
  model.T = jacobian_.T.dense();
  model.P = jacobian_.P.dense();
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
  return true;
}

// What the rates at (t, y) exceed the linear model's by.
VecX ExponentialSolver::remainder(const LinearModel& m, double t, const VecX& y, const VecX& rates) const {
  VecX d = rates;
  d.head(nq_) -= m.T * y.segment(nq_, nw_);
  const VecX p = m.P * (y.head(nq_) - m.state.head(nq_));
  d.segment(nq_, nw_) -=
      m.rates.segment(nq_, nw_) + m.A * p + (t - m.time) * (m.A1 * p) + m.B * (y.segment(nq_, nw_) - m.state.segment(nq_, nw_));
  return d;
}

// Radians per second: root of the largest eigenvalue's size by a few powers of A, and the largest of B.
double ExponentialSolver::fastest(const LinearModel& m) const {
  if (nw_ == 0) return 0.0;
  if (probe_.size() != nw_) {
    probe_.resize(nw_);
    for (Eigen::Index i = 0; i < nw_; ++i) probe_[i] = 1.0 / static_cast<double>(i + 1);
  }
  double square = 0.0;
  for (int k = 0; k < 3; ++k) {
    const VecX next = m.A * probe_;
    const double size = next.norm();
    square = size / probe_.norm();
    if (!(size > 0.0) || !std::isfinite(square)) {
      probe_.resize(0);
      square = 0.0;
      break;
    }
    probe_ = next / size;
  }
  return std::sqrt(square) + m.B.diagonal().cwiseAbs().maxCoeff();
}

// Undamped vibrations w'' = A w: real negative eigenvalues; right eigenvectors are their shapes, left ones tell their share in a motion.
void ExponentialSolver::find_vibrations(const MatX& A) {
  const ComplexEigen eigen(A);
  std::vector<Eigen::Index> chosen;
  if (eigen.info() == Eigen::Success)
    for (Eigen::Index k = 0; k < A.rows(); ++k)
      if (const std::complex<double> value = eigen.eigenvalues()[k]; value.imag() == 0.0 && value.real() < 0.0) chosen.push_back(k);
  const auto n = static_cast<Eigen::Index>(chosen.size());
  shapes_.resize(A.rows(), n);
  gauges_.resize(n, A.rows());
  frequencies_.resize(n);
  if (n == 0) return;
  const Eigen::MatrixXcd left = eigen.left_eigenvectors();
  for (Eigen::Index k = 0; k < n; ++k) {
    shapes_.col(k) = eigen.eigenvectors().col(chosen[k]).real();
    gauges_.row(k) = left.row(chosen[k]).real();
    frequencies_[k] = std::sqrt(-eigen.eigenvalues()[chosen[k]].real());
  }
  if (!gauges_.allFinite()) frequencies_.resize(0);
}

// What turns by several radians within a step of h seconds is brought to where it would rest under the slow part of the load: polynomials
// through values of the remainder would take its oscillation for a slow load.
void ExponentialSolver::remove_oscillation(const LinearModel& m, const Parabola& remainder, double s, double h, VecX& y) const {
  if (frequencies_.size() == 0) return;
  const auto& [d, span] = remainder;
  const double theta = s / span;
  const auto rows = [&](const auto& v) { return v.segment(nq_, nw_); };
  const VecX w = rows(y), p = m.P * (y.head(nq_) - m.state.head(nq_));
  const VecX load = rows(m.rates) + m.B * (w - rows(m.state)) + rows(d.col(0)) + theta * (rows(d.col(1)) + theta * rows(d.col(2)));
  const VecX load_rate = (rows(d.col(1)) + 2.0 * theta * rows(d.col(2))) / span;
  VecX dp = gauges_ * p, dw = gauges_ * w;
  const VecX g = gauges_ * load, gr = gauges_ * load_rate;
  for (Eigen::Index k = 0; k < dp.size(); ++k) {
    const double f = frequencies_[k], x = h * f, share = 1.0 / (1.0 + std::pow(turned / x, 8));
    dp[k] = share * (dp[k] - g[k] / (f * f));
    dw[k] = share * (dw[k] - gr[k] / (f * f));
  }
  y.head(nq_) -= m.T * (shapes_ * dp);
  y.segment(nq_, nw_) -= shapes_ * dw;
}

// From (t, y) on.
bool ExponentialSolver::solve(const LinearModel& m, const VecX& y, double t, const Parabola& remainder, const Reach& reach,
                              Solution& out) const {
  const auto& [d, span] = remainder;
  const double length = reach.length;
  const Eigen::Index n = nw_, rows = (n + 7) / 8 * 8;
  out.used = 0;
  if (n == 0) return true;
  VecX z = VecX::Zero(2 * rows), weight(problem_.size), weights = VecX::Zero(rows);
  problem_.weights(y.data(), weight.data());
  weights.head(n) = weight.segment(nq_, n);
  z.head(n) = y.segment(nq_, n);
  z.segment(rows, n) = m.P * (y.head(nq_) - m.state.head(nq_));
  MatX g = MatX::Zero(2 * rows, 3), loads(2 * rows, 3);
  g.topRows(n) = d.middleRows(nq_, n);
  g.middleRows(rows, n) = m.P * d.topRows(nq_);
  g.col(0).head(n) += m.rates.segment(nq_, n) - m.B * m.state.segment(nq_, n);
  double piece_length = std::min(length, radians_of_series(problem_.tolerance) / std::max(fastest(m), 1e-300));
  // A step of more pieces than that is not worth its memory: what decays at once is for other methods.
  const double most = std::clamp(4e6 / (2.0 * static_cast<double>(n + 1) * most_terms), 8.0, 500.0);
  if (length > most * piece_length) return false;
  piece_length = length / std::ceil(length / piece_length * (1.0 - 1e-12));
  MatX L = MatX::Zero(rows, 3 * n);
  L.block(0, n, n, n) = m.B;
  PowerSeries series;
  series.n = static_cast<int>(n);
  series.rows = static_cast<int>(rows);
  series.matrix = L.data();
  series.loads = loads.data();
  series.weights = weights.data();
  series.negligible = reach.negligible;
  int halved = 0;
  for (double s = 0.0; s < length * (1.0 - 1e-12);) {
    if (out.pieces.size() == out.used) out.pieces.emplace_back();
    Piece& piece = out.pieces[out.used];
    const double part = std::min(piece_length, length - s), a = s / span, b = part / span;
    piece.start = s;
    piece.length = series.length = part;
    if (piece.terms.rows() != 2 * rows) piece.terms.resize(2 * rows, most_terms + 2);
    L.topLeftCorner(n, n) = part * m.A1;
    L.topRightCorner(n, n) = m.A + (t + s - m.time) * m.A1;
    loads.col(0) = g.col(0) + a * (g.col(1) + a * g.col(2));
    loads.col(1) = b * (g.col(1) + 2.0 * a * g.col(2));
    loads.col(2) = b * b * g.col(2);
    piece.terms.col(0).setZero();
    piece.terms.col(1) = z;
    piece.count = expand(series, most_terms, piece.terms.data());
    if (piece.count == 0) {
      // Faster than the estimate said.
      if (++halved > 10) return false;
      piece_length *= 0.5;
      continue;
    }
    evaluate_powers(piece.terms.col(1).data(), static_cast<int>(2 * rows), piece.count, 1.0, z.data());
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
  const VecX done = span * theta * (d.col(0) + theta * (d.col(1) / 2.0 + theta * d.col(2) / 3.0));
  out.head(nq_) = y.head(nq_) + done.head(nq_);
  out.tail(problem_.size - nq_ - n) = y.tail(problem_.size - nq_ - n) + done.tail(problem_.size - nq_ - n);
  if (n == 0) return;
  const Piece& piece = solution.pieces[k];
  const double x = (s - piece.start) / piece.length;
  VecX z(piece.terms.rows());
  evaluate_powers(piece.terms.col(1).data(), static_cast<int>(z.size()), piece.count, x, z.data());
  out.segment(nq_, n) = z.head(n);
  const VecX moved = z.segment(z.size() / 2, n) - m.P * (y.head(nq_) - m.state.head(nq_)) - m.P * done.head(nq_);
  out.head(nq_) += m.T * moved;
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
  if (!solve(model_, state_, time_, {ahead, h}, {0.5 * h, negligible_ahead}, work_)) return false;
  VecX middle;
  evaluate_solution(model_, state_, {ahead, h}, work_, 0.5 * h, middle);
  remove_oscillation(model_, {ahead, h}, 0.5 * h, h, middle);
  return middle.allFinite() && linearise(time_ + 0.5 * h, middle, &model_, trial_model_);
}

// The end of a step whose remainder is centre + x slope + x^2 bend, x from -1 at its beginning to 1 at its end.
bool ExponentialSolver::find_end(const VecX& centre, const VecX& slope, const VecX& bend, double h, VecX& end) {
  trial_d_.resize(problem_.size, 3);
  trial_d_.col(0) = centre + bend - slope;
  trial_d_.col(1) = 2.0 * slope - 4.0 * bend;
  trial_d_.col(2) = 4.0 * bend;
  if (!solve(trial_model_, state_, time_, {trial_d_, h}, {h, negligible}, work_)) return false;
  evaluate_solution(trial_model_, state_, {trial_d_, h}, work_, h, end);
  return end.allFinite();
}

namespace {

// u'' + f^2 u = g (2 x^2 - x) + gq (4 x - 1) / h over x = t / h, u = 0 and u' = v + gq (2 x^2 - x), v = 0 at 0: u and v at x.
struct Driven {
  double u, v;
};

Driven driven(double f, double h, double g, double gq, double x) {
  const double ramp = 2.0 * x * x - x;
  if (f * h < 1.0) {
    // A series: where little turns, the closed form loses its digits.
    const double square = f * f * h * h, loads[3] = {-gq * h, 4.0 * gq * h - g * h * h, 2.0 * g * h * h};
    double c[14] = {0.0, 0.0}, u = 0.0, du = 0.0, power = 1.0;
    for (int k = 0; k + 2 < 14; ++k) c[k + 2] = ((k < 3 ? loads[k] : 0.0) - square * c[k]) / ((k + 1.0) * (k + 2.0));
    for (int k = 1; k < 14; ++k) {
      du += k * c[k] * power;
      power *= x;
      u += c[k] * power;
    }
    return {u, du / h - gq * ramp};
  }
  const double f2 = f * f, c = 2.0 * g / f2, b = (4.0 * gq / h - g) / f2, a = -(gq / h + 2.0 * c / (h * h)) / f2, sine = -b / (h * f);
  const double cos = std::cos(f * h * x), sin = std::sin(f * h * x);
  return {a + b * x + c * x * x - a * cos + sine * sin, (b + 2.0 * c * x) / h + f * (a * sin + sine * cos) - gq * ramp};
}

}  // namespace

// What a remainder that is `change` (2 theta^2 - theta) more makes of the state, from a step's beginning on.
void ExponentialSolver::add_correction(const LinearModel& m, const VecX& change, double h, double theta, VecX& y) const {
  const Eigen::Index tail = problem_.size - nq_ - nw_;
  const double once = h * theta * theta * (2.0 * theta / 3.0 - 0.5), twice = h * h * theta * theta * theta * (theta - 1.0) / 6.0;
  y.head(nq_) += once * change.head(nq_);
  y.tail(tail) += once * change.tail(tail);
  const VecX w = change.segment(nq_, nw_), p = m.P * change.head(nq_), gw = gauges_ * w, gp = gauges_ * p;
  // What is no vibration is carried along.
  const VecX rest_w = w - shapes_ * gw, rest_p = p - shapes_ * gp;
  VecX u(gw.size()), v(gw.size());
  for (Eigen::Index k = 0; k < gw.size(); ++k) {
    const Driven d = driven(frequencies_[k], h, gw[k], gp[k], theta);
    u[k] = d.u, v[k] = d.v;
  }
  y.segment(nq_, nw_) += shapes_ * v + once * rest_w;
  // p moves by what its coordinates' own remainder moves already.
  y.head(nq_) += m.T * VecX(shapes_ * u + twice * rest_w + once * rest_p - once * p);
}

// The end with what its remainder, `change` more than predicted, makes of it; false where the closed form leaves out what counts: how the
// rates' matrix acts on it, and that of the deflections as far as it is none of the vibrations'.
bool ExponentialSolver::correct_end(const VecX& change, double h, const VecX& weight, VecX& end) const {
  if (frequencies_.size() == 0 || shapes_.rows() != nw_) return false;
  const LinearModel& m = trial_model_;
  end = predicted_;
  add_correction(m, change, h, 1.0, end);
  if (!end.allFinite()) return false;
  const VecX w = end.segment(nq_, nw_) - predicted_.segment(nq_, nw_), p = m.P * (end.head(nq_) - predicted_.head(nq_));
  VecX left_out(problem_.size);
  left_out.setZero();
  left_out.segment(nq_, nw_) =
      mean_share * h * (m.B * w + m.A * p + shapes_ * VecX(frequencies_.cwiseAbs2().cwiseProduct(VecX(gauges_ * p))));
  left_out.head(nq_) = mean_share * h * (m.T * left_out.segment(nq_, nw_));
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
  trial_changed_ = d1 - (trial_d_.col(0) + trial_d_.col(1) + trial_d_.col(2));
  if (correct_end(trial_changed_, h, weight, end_)) {
    trial_d_.col(1) -= trial_changed_;
    trial_d_.col(2) += 2.0 * trial_changed_;
  } else {
    trial_changed_.resize(0);
    if (!find_end(centre, 0.5 * (d1 - d0), 0.5 * (d0 + d1) - centre, h, end_)) return false;
  }
  const VecX change = end_ - predicted_;
  error_ = std::sqrt(change.cwiseProduct(weight).squaredNorm() / static_cast<double>(size));
  return true;
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
      std::swap(model_, trial_model_);
      std::swap(d_, trial_d_);
      std::swap(changed_, trial_changed_);
      std::swap(solution_, work_);
      span_ = last_step = h;
      if (h >= h_ || factor < 1.0) h_ = h * factor;  // a step cut short by the end says little about longer ones
      ++steps;
      y = state_;
      return time_;
    }
    ++failures;
    h_ = h * std::min(factor, 0.9);
  }
}

void ExponentialSolver::interpolate(double t, VecX& y) const {
  if (changed_.size() == 0) {
    evaluate_solution(model_, begin_, {d_, span_}, solution_, t - previous_, y);
    return;
  }
  MatX before = d_;
  before.col(1) += changed_;
  before.col(2) -= 2.0 * changed_;
  evaluate_solution(model_, begin_, {before, span_}, solution_, t - previous_, y);
  add_correction(model_, changed_, span_, (t - previous_) / span_, y);
}

}  // namespace flexframe::sim
