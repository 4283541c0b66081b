#include "sim/time/free_motion.h"

#include "sim/base/sines_cosines.h"
#include "sim/base/small_matrices.h"
#include "sim/base/wide.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace flexframe::sim {
namespace {

// What does not vibrate turns by so little within a span, and the rest of it is coupling.
constexpr double hardly = 1e-3;
constexpr double weak = 1e-3;
// Radians that two modes turn apart up to which they count as close.
constexpr double close_turn = 3.0, far_turn = 30.0;

// Of x = z: sin(z) / z and (sin(z) / z - cos(z)) / z, from sine and cosine.
FLEXFRAME_INLINE void bessel(const Four& z, const Four& sin, const Four& cos, Four& zeroth, Four& first) {
  const Four square = z * z, one = square * 0.0 + 1.0, over = 1.0 / (square < 2.5e-3 ? one : z);
  const Four far_zeroth = sin * over, far_first = (far_zeroth - cos) * over;
  const Four near_zeroth = 1.0 - square * (1.0 / 6.0) * (1.0 - square * (1.0 / 20.0) * (1.0 - square * (1.0 / 42.0)));
  const Four near_first = z * (1.0 / 3.0) * (1.0 - square * (1.0 / 10.0) * (1.0 - square * (1.0 / 28.0)));
  zeroth = square < 2.5e-3 ? near_zeroth : far_zeroth;
  first = square < 2.5e-3 ? near_first : far_first;
}

// Frequencies, sines and cosines of half their turn within a span; n is a multiple of four.
struct Turns {
  const double *f, *sin, *cos;
  Eigen::Index n;
};

// Column j of the coupling's integrals, turned back and forth by the angles of modes i and j: p' = -S_i g, w' = c_i g with
// g = (a + b s) (c_j p + S_j w) + e (c_j w - f_j^2 S_j p). Odd parts vanish. What of it changes with the modes' time has a slope.
struct CouplingColumn {
  const double *a, *b, *e;  // of A and the frequencies' squares, of A1, of B
  double *p_of_p, *w_of_p, *p_of_w, *w_of_w, *w_of_p_slope, *p_of_w_slope;
};

FLEXFRAME_WIDE
void integrate(const Turns& turns, Eigen::Index j, double span, const CouplingColumn& out) {
  const double fj = turns.f[j], sj = turns.sin[j], cj = turns.cos[j], half = 0.5 * span, quarter = 0.25 * span * span;
  for (Eigen::Index i = 0; i < turns.n; i += 4) {
    const Four f = four(turns.f + i).v, sin = four(turns.sin + i).v, cos = four(turns.cos + i).v;
    Four sum0, sum1, difference0, difference1;
    bessel((f + fj) * half, sin * cj + cos * sj, cos * cj - sin * sj, sum0, sum1);
    bessel((f - fj) * half, sin * cj - cos * sj, cos * cj + sin * sj, difference0, difference1);
    // Integrals over a span, from -span/2 to span/2, c = cos(f s), S = sin(f s) / f.
    const Four over = 1.0 / f, SS = half * (difference0 - sum0) * over / fj, cc = half * (difference0 + sum0);
    const Four sSc = quarter * (sum1 + difference1) * over, scS = quarter * (sum1 - difference1) / fj;
    const Four a = four(out.a + i).v, b = four(out.b + i).v, e = four(out.e + i).v;
    four(out.p_of_p + i).v = fj * fj * e * SS - b * sSc;
    four(out.w_of_p + i).v = a * cc;
    four(out.p_of_w + i).v = -a * SS;
    four(out.w_of_w + i).v = b * scS + e * cc;
    four(out.w_of_p_slope + i).v = b * cc;
    four(out.p_of_w_slope + i).v = -b * SS;
  }
}

}  // namespace

// What modes do to each other, and by that to themselves, with rows of zeros up to a multiple of four; angular velocities and squares of
// all modes, whether they vibrate or not.
struct FreeMotion::Exchange {
  MatX A, B, A1;
  MatX back_A, back_mixed, back_A1, back_B;  // A_kl A_lk, A_kl A1_lk + A1_kl A_lk, A1_kl A1_lk, B_kl B_lk
  VecX squares, roots, frequencies;
  explicit Exchange(const Modes& m);
};

FreeMotion::Exchange::Exchange(const Modes& m)
    : squares(-m.A.diagonal()), roots(squares.cwiseMax(0.0).cwiseSqrt()), frequencies(VecX::Zero((m.A.rows() + 3) / 4 * 4)) {
  const Eigen::Index n = m.A.rows(), rows = frequencies.size();
  frequencies.head(n) = m.frequencies;
  for (MatX* matrix : {&A, &B, &A1, &back_A, &back_mixed, &back_A1, &back_B}) {
    matrix->resize(rows, n);
    for (Eigen::Index j = 0; j < n; ++j)
      for (Eigen::Index i = n; i < rows; ++i) (*matrix)(i, j) = 0.0;
  }
  for (Eigen::Index j = 0; j < n; ++j) {
    copy_fours(m.A.col(j).data(), n, A.col(j).data());
    copy_fours(m.B.col(j).data(), n, B.col(j).data());
    copy_fours(m.A1.col(j).data(), n, A1.col(j).data());
    for (Eigen::Index i = 0; i <= j; ++i) {
      const double a = m.A(i, j), a1 = m.A1(i, j), back_a = m.A(j, i), back_a1 = m.A1(j, i);
      back_A(i, j) = back_A(j, i) = a * back_a;
      back_mixed(i, j) = back_mixed(j, i) = a * back_a1 + a1 * back_a;
      back_A1(i, j) = back_A1(j, i) = a1 * back_a1;
      back_B(i, j) = back_B(j, i) = m.B(i, j) * m.B(j, i);
    }
  }
}

// What other modes, shaking along, do back to each mode: a load bend0 + tau bend1 + tau^2 bend2 times its p. It grows with time and not
// with the spans, so that more of them do not show it. share: the square of the largest share of another mode in what shakes along, tau up
// to `most`. Meaningless of what does not vibrate.
struct FreeMotion::Backlash {
  VecX bend0, bend1, bend2, share;
  Backlash(const Exchange& exchange, double span, double most);
  double at(Eigen::Index k, double tau) const { return bend0[k] + tau * (bend1[k] + tau * bend2[k]); }
};

namespace {

using Exchange = FreeMotion::Exchange;
using Backlash = FreeMotion::Backlash;

// Of mode l on all modes k. u_l'' + f_l^2 u_l = a u + e v has, for u'' = -f^2 u, the solution (a u + e v) / (f_l^2 - f^2). Of a mode that
// turns as fast within a span first order has the effect already.
struct ShakenAlong {
  const double *frequencies, *A, *mixed, *A1, *B;  // columns l of the exchange
  double square, root, span, most;
  Eigen::Index l, n;
};

FLEXFRAME_WIDE
void add_backlash(const ShakenAlong& by, double* bend0, double* bend1, double* bend2, double* share) {
  const Four none{};
  for (Eigen::Index k = 0; k < by.n; k += 4) {
    const Four f = four(by.frequencies + k).v, away = (by.root - f) * by.span, turn = away < 0.0 ? -away : away;
    const Four near = turn < far_turn ? turn : none + far_turn;
    Four sin, cos;
    sine_cosine(near, sin, cos);
    const Four over_near = 1.0 / (near < 1e-3 ? none + 1.0 : near), part = turn < far_turn ? 1.0 - sin * over_near : none + 1.0;
    const Four apart = by.square - f * f;
    Four over = turn < 1e-3 ? none : part / apart;
    if (by.l - k >= 0 && by.l - k < 4) over[by.l - k] = 0.0;
    const Four a = four(by.A + k).v, b = four(by.A1 + k).v, e = four(by.B + k).v * (f * f);
    four(bend0 + k).v += (a - e) * over;
    four(bend1 + k).v += four(by.mixed + k).v * over;
    four(bend2 + k).v += b * over;
    const Four along = ((a < 0.0 ? -a : a) + by.most * by.most * (b < 0.0 ? -b : b) + (e < 0.0 ? -e : e)) * (over * over);
    const Four before = four(share + k).v;
    four(share + k).v = along > before ? along : before;
  }
}

}  // namespace

FreeMotion::Backlash::Backlash(const Exchange& x, double span, double most)
    : bend0(VecX::Zero(x.A.rows())), bend1(bend0), bend2(bend0), share(bend0) {
  const Eigen::Index n = x.A.cols();
  bend0.head(n) = 0.25 * x.B.diagonal().cwiseAbs2();
  for (Eigen::Index l = 0; l < n; ++l)
    add_backlash({x.frequencies.data(), x.back_A.col(l).data(), x.back_mixed.col(l).data(), x.back_A1.col(l).data(), x.back_B.col(l).data(),
                  x.squares[l], x.roots[l], span, most, l, x.A.rows()},
                 bend0.data(), bend1.data(), bend2.data(), share.data());
}

namespace {

FLEXFRAME_WIDE
void blend(const double* constant, const double* slope, double by, double* out, Eigen::Index n) {
  for (Eigen::Index i = 0; i < n; i += 4) four(out + i).v = four(constant + i).v + by * four(slope + i).v;
}

// The integral of the coupling over a span, [p; w] x [p; w], with rows and columns of what is padded: of p on p and of w on w the same in
// all spans, the others with a slope over the time of the span's middle, and with the backlash on what begins with anything.
struct Coupling {
  MatX K;                                           // as last written
  MatX w_of_p, p_of_w, w_of_p_slope, p_of_w_slope;  // rows x n
  VecX back_p, back_w;                              // integrals of -S S and c c, of what begins with anything
  VecX sin, cos, a;                                 // room
  void begin(const Exchange& exchange, const VecX& f, double span, const VecX& z);
  void write(const Backlash& back, double tau) {
    const Eigen::Index rows = back_p.size(), n = w_of_p.cols();
    for (Eigen::Index k = 0; k < n; ++k) {
      blend(w_of_p.col(k).data(), w_of_p_slope.col(k).data(), tau, K.col(k).data() + rows, rows);
      blend(p_of_w.col(k).data(), p_of_w_slope.col(k).data(), tau, K.col(rows + k).data(), rows);
      if (back_w[k] == 0.0) continue;
      const double by = back.at(k, tau);
      K(k, rows + k) += by * back_p[k];
      K(rows + k, k) += by * back_w[k];
    }
  }
};

void Coupling::begin(const Exchange& x, const VecX& f, double span, const VecX& z) {
  const Eigen::Index rows = f.size(), n = x.A.cols();
  K.resize(2 * rows, 2 * rows);
  for (MatX* matrix : {&w_of_p, &p_of_w, &w_of_p_slope, &p_of_w_slope}) matrix->resize(rows, n);
  back_p.setZero(rows);
  back_w.setZero(rows);
  sin = 0.5 * span * f;
  cos.resize(rows);
  a.resize(rows);
  sines_cosines(sin.data(), static_cast<int>(rows), sin.data(), cos.data());
  for (Eigen::Index j = 0; j < n; ++j) {
    copy_fours(x.A.col(j).data(), rows, a.data());
    a[j] += f[j] * f[j];
    integrate({f.data(), sin.data(), cos.data(), rows}, j, span,
              {a.data(), x.A1.col(j).data(), x.B.col(j).data(), K.col(j).data(), w_of_p.col(j).data(), p_of_w.col(j).data(),
               K.col(rows + j).data() + rows, w_of_p_slope.col(j).data(), p_of_w_slope.col(j).data()});
    if (x.frequencies[j] == 0.0 || (z[j] == 0.0 && z[rows + j] == 0.0)) continue;
    const double even = 0.5 * span, odd = sin[j] * cos[j] / f[j];
    back_p[j] = -(even - odd) / (f[j] * f[j]);
    back_w[j] = even + odd;
  }
  K.middleCols(n, rows - n).setZero();
  K.rightCols(rows - n).setZero();
}

// Turns [p; w] of modes that nothing couples for s seconds.
class Turn {
 public:
  Turn(const VecX& frequencies, double s) : cos_(frequencies.size()), p_(s * frequencies), w_(frequencies.size()) {
    sines_cosines(p_.data(), static_cast<int>(p_.size()), p_.data(), cos_.data());
    w_ = frequencies.cwiseProduct(p_);
    p_ = p_.cwiseQuotient(frequencies);
  }
  void apply(VecX& z) const {
    const Eigen::Index n = cos_.size();
    for (Eigen::Index k = 0; k < n; ++k) {
      const double p = z[k], w = z[n + k];
      z[k] = cos_[k] * p + p_[k] * w;
      z[n + k] = cos_[k] * w - w_[k] * p;
    }
  }

 private:
  VecX cos_, p_, w_;
};

// States of modes, `turning` seconds after the middle of a span, which what couples them has changed in part.
struct TurnedStates {
  const double *f, *before, *after;
  Eigen::Index rows, n;
  double turning, into;
};

FLEXFRAME_WIDE
void add_turned(const TurnedStates& of, double* p, double* w) {
  for (Eigen::Index k = 0; k < of.n; k += 4) {
    const Four f = four(of.f + k).v, angle = f * of.turning;
    Four sin, cos;
    sine_cosine(angle, sin, cos);
    const Four p0 = four(of.before + k).v, w0 = four(of.before + of.rows + k).v;
    const Four zp = p0 + of.into * (four(of.after + k).v - p0), zw = w0 + of.into * (four(of.after + of.rows + k).v - w0);
    const Four moved = cos * zp + sin / f * zw, moving = cos * zw - f * sin * zp;
    if (k + 4 <= of.n) {
      four(p + k).v += moved;
      four(w + k).v += moving;
    } else {
      for (Eigen::Index i = 0; k + i < of.n; ++i) p[k + i] += moved[i], w[k + i] += moving[i];
    }
  }
}

}  // namespace

FreeMotion::FreeMotion(const Exchange& exchange, const Backlash& back, const Way& way, int spans) {
  n_ = exchange.A.cols();
  const Eigen::Index rows = exchange.A.rows();
  span_ = way.length / spans;
  frequencies_ = exchange.frequencies.cwiseMax(hardly / span_);
  static thread_local VecX now, first, second, third;
  now.setZero(2 * rows);
  for (VecX* term : {&first, &second, &third}) term->resize(2 * rows);
  now.head(n_) = way.z.head(n_);
  now.segment(rows, n_) = way.z.tail(n_);
  static thread_local Coupling coupling;
  coupling.begin(exchange, frequencies_, span_, now);
  before_.resize(2 * rows, spans);
  after_.resize(2 * rows, spans);
  Turn(frequencies_, 0.5 * span_).apply(now);
  const Turn over(frequencies_, span_);
  for (int k = 0; k < spans; ++k) {
    if (k > 0) over.apply(now);
    before_.col(k) = now;
    coupling.write(back, way.tau + (k + 0.5) * span_);
    multiply(coupling.K, now.data(), first.data());
    multiply(coupling.K, first.data(), second.data());
    now += first + 0.5 * second;
    // The next term counts a sixth of that at most where the coupling is weak.
    if (!(second.squaredNorm() < weak * weak * first.squaredNorm())) {
      multiply(coupling.K, second.data(), third.data());
      now += third / 6.0;
    }
    after_.col(k) = now;
  }
}

void FreeMotion::add(double s, double* p, double* w) const {
  const auto at = std::clamp(static_cast<Eigen::Index>(s / span_), Eigen::Index{0}, before_.cols() - 1);
  const double into = std::clamp(s / span_ - static_cast<double>(at), 0.0, 1.0);
  add_turned({frequencies_.data(), before_.col(at).data(), after_.col(at).data(), frequencies_.size(), n_, (into - 0.5) * span_, into}, p,
             w);
}

VecX FreeMotion::at(double s) const {
  VecX out = VecX::Zero(2 * n_);
  add(s, out.data(), out.data() + n_);
  return out;
}

namespace {

// What no number of spans shows: the backlash's own backlash, and what modes of close frequencies do to each other by way of others;
// weighted.
double way_unseen(const Modes& m, const Backlash& back, const ModalWeights& weights, const FreeMotion::Way& followed) {
  const auto& [z, tau, length] = followed;
  const Eigen::Index n = m.frequencies.size();
  const double most = std::max(std::abs(tau), std::abs(tau + length));
  VecX p = VecX::Zero(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const double f = m.frequencies[k];
    if (f == 0.0) continue;
    const double amplitude = std::hypot(z[k], z[n + k] / f);
    if (amplitude == 0.0) continue;
    const double force = std::max(std::abs(back.at(k, tau)), std::abs(back.at(k, tau + length)));
    p[k] += amplitude * force * length / (2.0 * f) * std::min(1.0, std::sqrt(back.share[k]) + 1.0 / far_turn);
    for (Eigen::Index i = 0; i < n; ++i) {
      if (i == k || std::abs(m.frequencies[i] - f) * length > close_turn) continue;
      double way = 0.0;
      for (Eigen::Index l = 0; l < n; ++l) {
        const double apart = std::abs(-m.A(l, l) - f * f);
        if (l == k || l == i || apart * length < 2.0 * f) continue;
        way += ((std::abs(m.A(i, l)) + most * std::abs(m.A1(i, l))) * (std::abs(m.A(l, k)) + most * std::abs(m.A1(l, k))) +
                std::abs(m.B(i, l) * m.B(l, k)) * f * f) /
               apart;
      }
      p[i] += amplitude * way * length / (2.0 * f);
    }
  }
  return std::sqrt((p.cwiseProduct(weights.p).squaredNorm() + p.cwiseProduct(m.frequencies).cwiseProduct(weights.w).squaredNorm()) /
                   weights.size);
}

}  // namespace

FreeMotion follow_free(const Modes& modes, const ModalWeights& weights, const FreeAsked& asked, int& spans) {
  const FreeMotion::Way& way = asked.way;
  const Eigen::Index n = modes.frequencies.size();
  spans = std::max(1, spans);
  if (2 * spans > asked.most_spans) return {};
  const Exchange exchange(modes);
  const Backlash whole(exchange, way.length, std::max(std::abs(way.tau), std::abs(way.tau + way.length)));
  if (!(way_unseen(modes, whole, weights, way) <= asked.most)) return {};
  const auto follow = [&](int count) -> FreeMotion {
    if (count == 1) return {exchange, whole, way, count};
    return {exchange, Backlash(exchange, way.length / count, 0.0), way, count};
  };
  for (VecX end = follow(spans).at(way.length);; spans *= 2) {
    if (2 * spans > asked.most_spans) return {};
    FreeMotion fine = follow(2 * spans);
    const VecX fine_end = fine.at(way.length), off = fine_end - end;
    // Of second order: the finer one is off by a third of what they differ by.
    const double error =
        std::sqrt((off.head(n).cwiseProduct(weights.p).squaredNorm() + off.tail(n).cwiseProduct(weights.w).squaredNorm()) / weights.size) /
        3.0;
    if (error <= asked.most) {
      if (error < 0.1 * asked.most) spans = std::max(1, spans / 2);
      return fine;
    }
    end = fine_end;
  }
}

}  // namespace flexframe::sim
