#include "sim/time/free_motion.h"

#include "sim/base/sine_cosine.h"
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
FLEXFRAME_INLINE void bessel(double z, double sin, double cos, double& zeroth, double& first) {
  const double square = z * z, over = 1.0 / (square < 2.5e-3 ? 1.0 : z);
  const double far_zeroth = sin * over, far_first = (far_zeroth - cos) * over;
  const double near_zeroth = 1.0 - square * (1.0 / 6.0) * (1.0 - square * (1.0 / 20.0) * (1.0 - square * (1.0 / 42.0)));
  const double near_first = z * (1.0 / 3.0) * (1.0 - square * (1.0 / 10.0) * (1.0 - square * (1.0 / 28.0)));
  zeroth = square < 2.5e-3 ? near_zeroth : far_zeroth;
  first = square < 2.5e-3 ? near_first : far_first;
}

// Integrals over a span, from -span/2 to span/2, for one mode j and modes i = 0 to n - 1, c = cos(f s), S = sin(f s) / f.
struct Integrals {
  double *SS, *cc, *sSc, *scS;  // S_i S_j, c_i c_j, s S_i c_j, s c_i S_j
};

// Frequencies, sines and cosines of half their turn within a span.
struct Turns {
  const double *f, *sin, *cos;
  int n;
};

FLEXFRAME_WIDE
void integrate(const Turns& turns, int j, double span, const Integrals& out) {
  const double *const f = turns.f, *const sin = turns.sin, *const cos = turns.cos;
  const double fj = f[j], sj = sin[j], cj = cos[j], half = 0.5 * span, quarter = 0.25 * span * span;
  for (int i = 0; i < turns.n; ++i) {
    double sum0, sum1, difference0, difference1;
    bessel((f[i] + fj) * half, sin[i] * cj + cos[i] * sj, cos[i] * cj - sin[i] * sj, sum0, sum1);
    bessel((f[i] - fj) * half, sin[i] * cj - cos[i] * sj, cos[i] * cj + sin[i] * sj, difference0, difference1);
    out.SS[i] = half * (difference0 - sum0) / (f[i] * fj);
    out.cc[i] = half * (difference0 + sum0);
    out.sSc[i] = quarter * (sum1 + difference1) / f[i];
    out.scS[i] = quarter * (sum1 - difference1) / fj;
  }
}

// What other modes, shaking along, do back to a mode: a load bend[0] + tau bend[1] + tau^2 bend[2] times its p. It grows with time and not
// with the spans, so that more of them do not show it. share: the largest share of another mode in what shakes along, tau up to `most`.
struct Backlash {
  double bend[3] = {0.0, 0.0, 0.0}, share = 0.0;
  double at(double tau) const { return bend[0] + tau * (bend[1] + tau * bend[2]); }
};

// u_l'' + f_l^2 u_l = a u + e v has, for u'' = -f^2 u, the solution (a u + e v) / (f_l^2 - f^2). Of a mode that turns as fast within a span
// first order has the effect already.
Backlash backlash(const Modes& m, const VecX& roots, Eigen::Index k, double span, double most) {
  Backlash out;
  const double f = m.frequencies[k], square = f * f;
  out.bend[0] = 0.25 * m.B(k, k) * m.B(k, k);
  for (Eigen::Index l = 0; l < m.A.rows(); ++l) {
    if (l == k) continue;
    const double apart = -m.A(l, l) - square, turn = std::abs(roots[l] - f) * span;
    if (turn < 1e-3) continue;
    const double over = (turn < far_turn ? 1.0 - std::sin(turn) / turn : 1.0) / apart;
    const double a = m.A(k, l) * m.A(l, k), b = m.A1(k, l) * m.A1(l, k), e = m.B(k, l) * m.B(l, k) * square;
    out.bend[0] += (a - e) * over;
    out.bend[1] += (m.A(k, l) * m.A1(l, k) + m.A1(k, l) * m.A(l, k)) * over;
    out.bend[2] += b * over;
    out.share = std::max(out.share, std::sqrt(std::abs(a) + most * most * std::abs(b) + std::abs(e)) * std::abs(over));
  }
  return out;
}

VecX roots_of(const Modes& m) { return (-m.A.diagonal()).cwiseMax(0.0).cwiseSqrt(); }

// The integral of the coupling, [p; w] x [p; w]: constant + tau slope, tau the middle of the span, and the backlash on what begins with z.
struct Coupling {
  MatX constant, slope;
  std::vector<Backlash> back;
  VecX back_p, back_w;  // integrals of -S S and c c
  Coupling(const Modes& m, const VecX& f, double span, const VecX& z);
  void write(double tau, MatX& K) const {
    const Eigen::Index n = back_p.size();
    K.noalias() = constant + tau * slope;
    for (Eigen::Index k = 0; k < n; ++k) {
      const double by = back[k].at(tau);
      K(k, n + k) += by * back_p[k];
      K(n + k, k) += by * back_w[k];
    }
  }
};

// Turned back and forth by the angles of modes i and j: p' = -S_i g, w' = c_i g with g = (a + b s) (c_j p + S_j w) + e (c_j w - f_j^2 S_j
// p). Odd parts vanish.
Coupling::Coupling(const Modes& m, const VecX& f, double span, const VecX& z)
    : constant(2 * f.size(), 2 * f.size()), slope(MatX::Zero(2 * f.size(), 2 * f.size())), back(f.size()) {
  const Eigen::Index n = f.size();
  const VecX roots = roots_of(m), sin = (0.5 * span * f).array().sin(), cos = (0.5 * span * f).array().cos();
  VecX SS(n), cc(n), sSc(n), scS(n), a(n);
  back_p.resize(n);
  back_w.resize(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    integrate({f.data(), sin.data(), cos.data(), static_cast<int>(n)}, static_cast<int>(j), span,
              {SS.data(), cc.data(), sSc.data(), scS.data()});
    a = m.A.col(j);
    a[j] += f[j] * f[j];
    const auto b = m.A1.col(j), e = m.B.col(j);
    constant.col(j).head(n) = f[j] * f[j] * e.cwiseProduct(SS) - b.cwiseProduct(sSc);
    constant.col(n + j).tail(n) = b.cwiseProduct(scS) + e.cwiseProduct(cc);
    constant.col(n + j).head(n) = -a.cwiseProduct(SS);
    constant.col(j).tail(n) = a.cwiseProduct(cc);
    slope.col(n + j).head(n) = -b.cwiseProduct(SS);
    slope.col(j).tail(n) = b.cwiseProduct(cc);
    if (m.frequencies[j] > 0.0 && (z[j] != 0.0 || z[n + j] != 0.0)) back[j] = backlash(m, roots, j, span, 0.0);
    back_p[j] = -SS[j];
    back_w[j] = cc[j];
  }
}

// Turns [p; w] of modes that nothing couples for s seconds.
class Turn {
 public:
  Turn(const VecX& frequencies, double s) : cos_(frequencies.size()), p_(frequencies.size()), w_(frequencies.size()) {
    for (Eigen::Index k = 0; k < frequencies.size(); ++k) {
      double sin = 0.0;
      sine_cosine(frequencies[k] * s, sin, cos_[k]);
      p_[k] = sin / frequencies[k];
      w_[k] = frequencies[k] * sin;
    }
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

}  // namespace

FreeMotion::FreeMotion(const Modes& m, double tau, double length, int spans, const VecX& z) {
  const Eigen::Index n = m.frequencies.size();
  span_ = length / spans;
  frequencies_ = m.frequencies.cwiseMax(hardly / span_);
  const Coupling coupling(m, frequencies_, span_, z);
  before_.resize(2 * n, spans);
  after_.resize(2 * n, spans);
  VecX now = z, first(2 * n), second(2 * n), third(2 * n);
  Turn(frequencies_, 0.5 * span_).apply(now);
  const Turn over(frequencies_, span_);
  MatX K(2 * n, 2 * n);
  for (int k = 0; k < spans; ++k) {
    if (k > 0) over.apply(now);
    before_.col(k) = now;
    coupling.write(tau + (k + 0.5) * span_, K);
    multiply(K, now.data(), first.data());
    multiply(K, first.data(), second.data());
    now += first + 0.5 * second;
    // The next term counts a sixth of that at most where the coupling is weak.
    if (!(second.squaredNorm() < weak * weak * first.squaredNorm())) {
      multiply(K, second.data(), third.data());
      now += third / 6.0;
    }
    after_.col(k) = now;
  }
}

void FreeMotion::add(double s, double* p, double* w) const {
  const auto at = std::clamp(static_cast<Eigen::Index>(s / span_), Eigen::Index{0}, before_.cols() - 1);
  const double into = std::clamp(s / span_ - static_cast<double>(at), 0.0, 1.0), turning = (into - 0.5) * span_;
  const Eigen::Index n = frequencies_.size();
  const double *const before = before_.col(at).data(), *const after = after_.col(at).data();
  for (Eigen::Index k = 0; k < n; ++k) {
    const double f = frequencies_[k], zp = before[k] + into * (after[k] - before[k]),
                 zw = before[n + k] + into * (after[n + k] - before[n + k]);
    double sin = 0.0, cos = 0.0;
    sine_cosine(f * turning, sin, cos);
    p[k] += cos * zp + sin / f * zw;
    w[k] += cos * zw - f * sin * zp;
  }
}

VecX FreeMotion::at(double s) const {
  VecX out = VecX::Zero(before_.rows());
  add(s, out.data(), out.data() + frequencies_.size());
  return out;
}

namespace {

// What no number of spans shows: the backlash's own backlash, and what modes of close frequencies do to each other by way of others;
// weighted.
double unseen(const Modes& m, const ModalWeights& weights, double tau, double length, const VecX& z) {
  const Eigen::Index n = m.frequencies.size();
  const double most = std::max(std::abs(tau), std::abs(tau + length));
  const VecX roots = roots_of(m);
  VecX p = VecX::Zero(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const double f = m.frequencies[k];
    if (f == 0.0) continue;
    const double amplitude = std::hypot(z[k], z[n + k] / f);
    if (amplitude == 0.0) continue;
    const Backlash back = backlash(m, roots, k, length, most);
    const double force = std::max(std::abs(back.at(tau)), std::abs(back.at(tau + length)));
    p[k] += amplitude * force * length / (2.0 * f) * std::min(1.0, back.share + 1.0 / far_turn);
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
  const auto& [z, tau, length, most, most_spans] = asked;
  const Eigen::Index n = modes.frequencies.size();
  spans = std::max(1, spans);
  if (2 * spans > most_spans || !(unseen(modes, weights, tau, length, z) <= most)) return {};
  FreeMotion coarse(modes, tau, length, spans, z);
  for (VecX end = coarse.at(length);; spans *= 2) {
    if (2 * spans > most_spans) return {};
    FreeMotion fine(modes, tau, length, 2 * spans, z);
    const VecX fine_end = fine.at(length), off = fine_end - end;
    // Of second order: the finer one is off by a third of what they differ by.
    const double error =
        std::sqrt((off.head(n).cwiseProduct(weights.p).squaredNorm() + off.tail(n).cwiseProduct(weights.w).squaredNorm()) / weights.size) /
        3.0;
    if (error <= most) {
      if (error < 0.1 * most) spans = std::max(1, spans / 2);
      return fine;
    }
    end = fine_end;
  }
}

}  // namespace flexframe::sim
