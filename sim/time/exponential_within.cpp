// States within a step of the exponential method: what runs are sampled at. Everything that does not depend on the time is made once a
// step.
#include "sim/base/four.h"
#include "sim/base/sine_cosine.h"
#include "sim/base/sines_cosines.h"
#include "sim/base/small_matrices.h"
#include "sim/time/exponential.h"
#include "sim/time/power_series.h"

#include <algorithm>

namespace flexframe::sim {

namespace {

// u'' + f^2 u = g (2 x^2 - x) + gq (4 x - 1) / h over x = t / h, u = 0 and u' = v + gq (2 x^2 - x), v = 0 at 0: u and v at x. T: one
// number, or four.
template <class T>
struct Driven {
  T u, v;
};

// From so many radians within a step on the closed form keeps its digits.
constexpr double once_round = 1.0;

ExponentialSolver::ClosedForm closed_form(double f, double h, double g, double gq) {
  const double f2 = f * f, c = 2.0 * g / f2, b = (4.0 * gq / h - g) / f2, a = -(gq / h + 2.0 * c / (h * h)) / f2, sine = -b / (h * f);
  return {a, b, c, sine};
}

template <class T>
struct Turned {
  T sin, cos;
};

// turned: by f h x.
template <class T>
FLEXFRAME_INLINE Driven<T> at(const ExponentialSolver::ClosedForm& form, double f, double h, double gq, const T& x,
                              const Turned<T>& turned) {
  const auto [a, b, c, sine] = form;
  const auto [sin, cos] = turned;
  return {a + b * x + c * x * x - a * cos + sine * sin, (b + 2.0 * c * x) / h + f * (a * sin + sine * cos) - gq * (2.0 * x * x - x)};
}

template <class T>
FLEXFRAME_INLINE Driven<T> driven(double f, double h, double g, double gq, const T& x) {
  if (f * h >= once_round) {
    Turned<T> turned;
    sine_cosine(f * h * x, turned.sin, turned.cos);
    return at(closed_form(f, h, g, gq), f, h, gq, x, turned);
  }
  // A series: where little turns, the closed form loses its digits.
  const double square = f * f * h * h, loads[3] = {-gq * h, 4.0 * gq * h - g * h * h, 2.0 * g * h * h};
  double c[14] = {0.0, 0.0};
  for (int k = 0; k + 2 < 14; ++k) c[k + 2] = ((k < 3 ? loads[k] : 0.0) - square * c[k]) / ((k + 1.0) * (k + 2.0));
  T u = 0.0 * x, du = u, power = u + 1.0;
  for (int k = 1; k < 14; ++k) {
    du += k * c[k] * power;
    power *= x;
    u += c[k] * power;
  }
  return {u, du / h - gq * (2.0 * x * x - x)};
}

// How a correction drives what has this frequency: a vibration, or what is carried along (0).
template <class T>
FLEXFRAME_INLINE Driven<T> corrected(double f, double h, double w, double p, const T& x) {
  const T once = h * x * x * (2.0 * x / 3.0 - 0.5);
  Driven<T> out{h * h * x * x * x * (x - 1.0) / 6.0 * w + once * p, once * w};
  if (f > 0.0) out = driven(f, h, w, p, x);
  // p moves by what its coordinates' own remainder moves already.
  out.u -= once * p;
  return out;
}

}  // namespace

// What a remainder that is `change` (2 theta^2 - theta) more makes of the state, from a step's beginning on.
ExponentialSolver::Correction ExponentialSolver::correction_by(const LinearModel& m, const VecX& change) const {
  return {change, times(m.modes.gauges, change.segment(nq_, nw_)), times(m.modes.gauges, m.directions(change.head(nq_)))};
}

void ExponentialSolver::add_correction(const LinearModel& m, const Correction& by, double h, double theta, VecX& y) const {
  const auto& [change, w, p] = by;
  const Eigen::Index tail = problem_.size - nq_ - nw_;
  const double once = h * theta * theta * (2.0 * theta / 3.0 - 0.5);
  y.head(nq_) += once * change.head(nq_);
  y.tail(tail) += once * change.tail(tail);
  static thread_local VecX u, v, moved, q;  // room
  u.resize(nw_);
  v.resize(nw_);
  for (Eigen::Index k = 0; k < nw_; ++k) {
    const auto d = corrected(m.modes.frequencies[k], h, w[k], p[k], theta);
    u[k] = d.u, v[k] = d.v;
  }
  times_into(m.modes.shapes, v, moved);
  y.segment(nq_, nw_) += moved;
  times_into(m.modes.shapes, u, moved);
  m.coordinates_into(moved.data(), q);
  y.head(nq_) += q;
}

// The correction changes the polynomials by h x^2 (2 x / 3 - 1/2) of what it adds to coordinates and quadratures themselves.
void ExponentialSolver::begin_within() const {
  const LinearModel& m = model_;
  Within& w = within_;
  const MatX& d = changed_.size() > 0 ? solved_ : d_;
  w.made = true;
  w.powers.resize(problem_.size, 4);
  w.powers.col(0) = begin_;
  for (int k = 0; k < 3; ++k) {
    static thread_local VecX part, p, q;
    part = span_ / (k + 1.0) * d.col(k);
    if (nw_ > 0) {
      m.directions_into(part.data(), p);
      m.coordinates_into(p.data(), q);
    }
    if (changed_.size() > 0 && k > 0) part += (k == 1 ? -0.5 : 2.0 / 3.0) * span_ * changed_;
    w.powers.col(k + 1) = part;
    // The directions' own part of that is among the amounts.
    w.powers.col(k + 1).segment(nq_, nw_).setZero();
    if (nw_ > 0) w.powers.col(k + 1).head(nq_) -= q;
  }
  w.piece = 0;
  if (nw_ == 0) return;
  w.rows = solution_.begin.size() / 2;
  if (!m.plain) w.shapes = m.modes.shapes;
  w.moves = m.moves;
  w.z.resize(2 * w.rows);
  w.out.resize(problem_.size);
  if (changed_.size() == 0) return;
  w.corrected.resize(2 * nw_);
  w.slow.clear();
  w.fast.clear();
  for (Eigen::Index k = 0; k < nw_; ++k)
    if (const double f = m.modes.frequencies[k]; f * span_ < once_round) w.slow.push_back(k);
    else w.fast.push_back({k, f, closed_form(f, span_, correction_.w[k], correction_.p[k])});
  w.sines.resize(w.fast.size());
  w.cosines.resize(w.fast.size());
  if (m.plain) w.correction_moves = m.T.dense() * m.modes.shapes;
}

// Amounts of the correction: those of w, then those of p beyond what its coordinates' own remainder moves.
void ExponentialSolver::correct_within(double theta) const {
  Within& in = within_;
  const double h = span_, once = h * theta * theta * (2.0 * theta / 3.0 - 0.5);
  double *const v = in.corrected.data(), *const u = v + nw_;
  for (const Eigen::Index k : in.slow) {
    const auto d = corrected(model_.modes.frequencies[k], h, correction_.w[k], correction_.p[k], theta);
    v[k] = d.v, u[k] = d.u;
  }
  const size_t turning = in.fast.size();
  for (size_t i = 0; i < turning; ++i) in.sines[i] = in.fast[i].frequency * h * theta;
  sines_cosines(in.sines.data(), static_cast<int>(turning), in.sines.data(), in.cosines.data());
  for (size_t i = 0; i < turning; ++i) {
    const Within::Fast& mode = in.fast[i];
    const double p = correction_.p[mode.at];
    const auto d = at<double>(mode.form, mode.frequency, h, p, theta, {in.sines[i], in.cosines[i]});
    v[mode.at] = d.v, u[mode.at] = d.u - once * p;
  }
}

// Where s seconds after the step's beginning lie.
const ExponentialSolver::Piece& ExponentialSolver::piece_within(double s) const {
  Within& in = within_;
  const auto ends_before = [&](const Piece& piece) { return s > piece.start + piece.length; };
  if (s < solution_.pieces[in.piece].start) in.piece = 0;
  while (in.piece + 1 < solution_.used && ends_before(solution_.pieces[in.piece])) ++in.piece;
  return solution_.pieces[in.piece];
}

void ExponentialSolver::interpolate(double t, VecX& y) const {
  Within& in = within_;
  if (!in.made) begin_within();
  const double s = t - previous_, theta = s / span_;
  y = in.powers.col(0) + theta * (in.powers.col(1) + theta * (in.powers.col(2) + theta * in.powers.col(3)));
  if (nw_ == 0) return;
  const LinearModel& m = model_;
  double *const w = in.z.data(), *const p = w + in.rows;
  const Piece& piece = piece_within(s);
  evaluate_powers(powers_of(piece), (s - piece.start) / piece.length, w);
  in.z -= solution_.begin;
  if (!solution_.free.empty()) solution_.free.add(s, p, w);
  const auto add = [&](const MatX& matrix, const double* amounts, Eigen::Index first) {
    multiply(matrix, amounts, in.out.data());
    y.segment(first, matrix.rows()) += in.out.head(matrix.rows());
  };
  if (changed_.size() > 0) {
    correct_within(theta);
    if (m.plain) {
      add(m.modes.shapes, in.corrected.data(), nq_);
      add(in.correction_moves, in.corrected.data() + nw_, 0);
    } else {
      in.z.head(nw_) += in.corrected.head(nw_);
      in.z.segment(in.rows, nw_) += in.corrected.tail(nw_);
    }
  }
  if (m.plain) y.segment(nq_, nw_) += in.z.head(nw_);
  else add(in.shapes, w, nq_);
  add(in.moves, p, 0);
  if (changed_.size() == 0) add_shaken(m, shaken_, s, y);
}

// ---- Coordinates of four states at once: numbers of theirs lie together
// ------------------------------------------------------------------

namespace {

// The polynomials of the first n numbers of the columns of `powers`, at four shares of the step.
FLEXFRAME_WIDE void set_polynomials(const MatX& powers, Eigen::Index n, const double* shares, double* out) {
  const Four x = four(shares).v;
  const double *const a = powers.data(), *const b = a + powers.rows(), *const c = b + powers.rows(), *const d = c + powers.rows();
  for (Eigen::Index k = 0; k < n; ++k) four(out + 4 * k).v = a[k] + x * (b[k] + x * (c[k] + x * d[k]));
}

// out += A x.
FLEXFRAME_WIDE void add_product(const MatX& A, const double* x, double* out) {
  const Eigen::Index rows = A.rows(), columns = A.cols();
  const double* const a = A.data();
  for (Eigen::Index r = 0; r < rows; ++r) {
    Four sum = a[r] * four(x).v;
    for (Eigen::Index k = 1; k < columns; ++k) sum += a[k * rows + r] * four(x + 4 * k).v;
    four(out + 4 * r).v += sum;
  }
}

// What a correction makes of the deflection of one mode.
struct Drive {
  double frequency, h, w, p;
  const double* shares;  // four, of the step of h seconds
};

FLEXFRAME_WIDE void drive_slow(const Drive& by, double* u) {
  const Four x = four(by.shares).v;
  four(u).v = corrected(by.frequency, by.h, by.w, by.p, x).u;
}

FLEXFRAME_WIDE void drive_fast(const Drive& by, const ExponentialSolver::ClosedForm& form, double* u) {
  const Four x = four(by.shares).v, once = by.h * x * x * (2.0 * x / 3.0 - 0.5), angle = by.frequency * by.h * x;
  Turned<Four> turned;
  sine_cosine(angle, turned.sin, turned.cos);
  four(u).v = at(form, by.frequency, by.h, by.p, x, turned).u - once * by.p;
}

}  // namespace

// Into the first nw_ numbers of Within::four.
void ExponentialSolver::correct_four(const double* shares) const {
  Within& in = within_;
  const auto drive = [&](Eigen::Index k) -> Drive {
    return {model_.modes.frequencies[k], span_, correction_.w[k], correction_.p[k], shares};
  };
  double* const u = in.four.data();
  for (const Eigen::Index k : in.slow) drive_slow(drive(k), u + 4 * k);
  for (const Within::Fast& mode : in.fast) drive_fast(drive(mode.at), mode.form, u + 4 * mode.at);
}

// Amounts of p after four times since the step's beginning, s, less those there: a column each into Within::apart.
void ExponentialSolver::series_four(const double* since) const {
  Within& in = within_;
  in.apart.resize(in.rows, 4);
  const Piece* pieces[4];
  double x[4];
  for (int k = 0; k < 4; ++k) {
    pieces[k] = &piece_within(since[k]);
    x[k] = (since[k] - pieces[k]->start) / pieces[k]->length;
  }
  const auto powers = [&](const Piece& piece) -> Powers {
    const Powers all = powers_of(piece);
    return {all.terms + in.rows, all.stride, static_cast<int>(in.rows), all.count};
  };
  if (pieces[0] == pieces[3]) evaluate_powers_four(powers(*pieces[0]), x, in.apart.data());
  else
    for (int k = 0; k < 4; ++k) evaluate_powers(powers(*pieces[k]), x[k], in.apart.col(k).data());
  for (int k = 0; k < 4; ++k) {
    in.apart.col(k) -= solution_.begin.tail(in.rows);
    if (!solution_.free.empty()) solution_.free.add(since[k], in.apart.col(k).data(), in.z.data());
  }
}

void ExponentialSolver::interpolate_four(const double* times, MatX& states) const {
  Within& in = within_;
  if (!in.made) begin_within();
  double since[4], shares[4];
  for (int k = 0; k < 4; ++k) {
    since[k] = times[k] - previous_;
    shares[k] = since[k] / span_;
  }
  double* const q = states.data();
  set_polynomials(in.powers, nq_, shares, q);
  if (nw_ == 0) return;
  series_four(since);
  in.four.resize(4, nw_);
  if (changed_.size() > 0) {
    correct_four(shares);
    if (model_.plain) add_product(in.correction_moves, in.four.data(), q);
    else in.apart.topRows(nw_) += in.four.transpose();
  }
  in.four = in.apart.topRows(nw_).transpose();
  add_product(in.moves, in.four.data(), q);
  if (changed_.size() > 0 || shaken_.empty()) return;
  VecX y = VecX::Zero(problem_.size);
  for (int k = 0; k < 4; ++k) {
    y.head(nq_) = states.row(k).head(nq_).transpose();
    add_shaken(model_, shaken_, since[k], y);
    states.row(k).head(nq_) = y.head(nq_).transpose();
  }
}

}  // namespace flexframe::sim
