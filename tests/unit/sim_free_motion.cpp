// Vibrations followed by amounts of modes: against products of matrix exponentials of short pieces, for populations of couplings, changes
// in time, damping and radians; modes of matrices that change; linear equations by the exponential method against closed forms.
#include "sim/base/error.h"
#include "sim/time/exponential.h"
#include "sim/time/free_motion.h"

#include <gtest/gtest.h>
#include <unsupported/Eigen/MatrixFunctions>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <random>

namespace flexframe::sim::test_free_motion {
namespace {

struct Random {
  std::mt19937 engine;
  double operator()(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine); }
  double decades(double low, double high) { return std::pow(10.0, (*this)(low, high)); }
  MatX matrix(Eigen::Index n) {
    return MatX::NullaryExpr(n, n, [&]() { return (*this)(-1.0, 1.0); });
  }
};

// Frequencies (rad/s) that rise like those of bending, here and there two as good as the same; the first may be zero.
VecX spectrum(Random& random, Eigen::Index n, double top) {
  VecX f(n);
  for (Eigen::Index k = 0; k < n; ++k) f[k] = top * std::pow((static_cast<double>(k) + random(0.5, 1.0)) / static_cast<double>(n), 2);
  if (n > 2 && random(0.0, 1.0) < 0.5) f[n - 1] = f[n - 2] * 1.0001;
  if (n > 1 && random(0.0, 1.0) < 0.5) f[0] = 0.0;
  return f;
}

// [p; w] after `length`, A + t A1, by exponentials over pieces of a twentieth of a radian at most, to fourth order.
VecX reference(const Modes& m, double tau, double length, VecX z) {
  const Eigen::Index n = m.A.rows();
  const double top = std::sqrt(m.A.cwiseAbs().maxCoeff());
  const int pieces = std::max(8, static_cast<int>(std::ceil(length * top / 0.25)));
  const double h = length / pieces;
  for (int k = 0; k < pieces; ++k) {
    MatX L = MatX::Zero(2 * n, 2 * n), slope = MatX::Zero(2 * n, 2 * n);
    L.topRightCorner(n, n).setIdentity();
    L.bottomLeftCorner(n, n) = m.A + (tau + (k + 0.5) * h) * m.A1;
    L.bottomRightCorner(n, n) = m.B;
    slope.bottomLeftCorner(n, n) = m.A1;
    const MatX exponent = h * L - h * h * h / 12.0 * (L * slope - slope * L);
    z = (exponent.exp() * z).eval();
  }
  return z;
}

TEST(FreeMotion, KeepsItsErrorOverAPopulation) {
  Random random{std::mt19937(5)};
  int followed = 0;
  for (int sample = 0; sample < 60; ++sample) {
    const Eigen::Index n = std::array<Eigen::Index, 5>{1, 2, 3, 6, 12}[sample % 5];
    const double radians = random.decades(-1.0, n > 6 ? 2.0 : 2.7), length = random.decades(-3.0, 0.0), top = radians / length;
    Modes m;
    m.frequencies = spectrum(random, n, top);
    m.A = -m.frequencies.cwiseAbs2().asDiagonal().toDenseMatrix();
    // Turning as fast as a tenth of a radian, damping of up to a tenth, stiffness that changes by some hundredths.
    const MatX any = random.matrix(n);
    m.B = random.decades(-4.0, -1.0) / length * (any - any.transpose());
    for (Eigen::Index k = 0; k < n; ++k)
      m.B(k, k) -= random.decades(-4.0, -1.0) * std::max(m.frequencies[k], 1.0 / length) * (sample % 3 == 0);
    m.A1 = m.frequencies.asDiagonal() * (random.decades(-5.0, -2.0) / length * random.matrix(n)) * m.frequencies.asDiagonal();
    m.A += 1e-3 * m.frequencies.asDiagonal() * random.matrix(n) * m.frequencies.asDiagonal();
    VecX z(2 * n);
    for (Eigen::Index k = 0; k < n; ++k) {
      z[k] = random(-1.0, 1.0);
      z[n + k] = random(-1.0, 1.0) * std::max(m.frequencies[k], 1.0 / length);
    }
    const ModalWeights weights{m.frequencies.cwiseMax(1.0 / length).cwiseInverse(), VecX::Ones(n), static_cast<double>(2 * n)};
    const double tau = random(-1.0, 0.0) * length, most = random.decades(-4.0, -1.0);
    int spans = 1;
    const FreeMotion motion = follow_free(m, weights, {{z, tau, length}, most, 4096}, spans);
    if (motion.empty()) continue;
    ++followed;
    for (const double share : {0.37, 1.0}) {
      const VecX wanted = reference(m, tau, share * length, z), off = motion.at(share * length) - wanted;
      const double error =
          std::sqrt((off.head(n).cwiseProduct(weights.p).squaredNorm() + off.tail(n).cwiseProduct(weights.w).squaredNorm()) / weights.size);
      // Within a span amounts are interpolated.
      EXPECT_LT(error, share == 1.0 ? 2.0 * most : 10.0 * most + 2e-2) << sample << " n " << n << " radians " << radians << " at " << share;
    }
  }
  EXPECT_GT(followed, 50);
}

TEST(FreeMotion, LeavesWhatIsTooMuch) {
  Modes m;
  m.frequencies = VecX::Constant(2, 10.0);
  m.A = -100.0 * MatX::Identity(2, 2);
  m.B = MatX::Constant(2, 2, 1e6);
  m.A1 = MatX::Zero(2, 2);
  const ModalWeights weights{VecX::Ones(2), VecX::Ones(2), 4.0};
  const VecX z = VecX::Ones(4);
  int spans = 1;
  EXPECT_TRUE(follow_free(m, weights, {{z, 0.0, 1.0}, 1e-3, 64}, spans).empty());
  m.B.setConstant(std::numeric_limits<double>::quiet_NaN());
  spans = 1;
  EXPECT_TRUE(follow_free(m, weights, {{z, 0.0, 1.0}, 1e-3, 64}, spans).empty());
}

// Shapes of a matrix that changes are followed to second order, gauges stay their inverse.
TEST(Modes, FollowAMatrixThatChanges) {
  Random random{std::mt19937(7)};
  for (const Eigen::Index n : {1, 3, 9, 31, 64}) {
    const VecX f = spectrum(random, n, 1e3).array() + 1e3;
    const MatX S = MatX::Identity(n, n) + 0.3 / std::sqrt(static_cast<double>(n)) * random.matrix(n), Z = MatX::Zero(n, n);
    MatX A = -S * f.cwiseAbs2().asDiagonal() * S.inverse();
    Modes m;
    ASSERT_TRUE(find_modes(A, m)) << n;
    const MatX change = 1e-3 * random.matrix(n) / std::sqrt(static_cast<double>(n));
    for (int k = 0; k < 20; ++k) {
      A = (MatX::Identity(n, n) + change) * A * (MatX::Identity(n, n) + change).inverse();
      express_matrix(A, m);
      ASSERT_TRUE(renew_modes(m)) << n;
      express_matrix(A, m);
      EXPECT_LE(mixing(m), 1e-4) << n << " step " << k;
      EXPECT_LT((m.gauges * m.shapes - MatX::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-8);
    }
  }
}

// w' = A p + B w + load of n coordinates p = q, q' = w, as a problem for the solver.
struct Linear {
  MatX A, B;
  VecX load;
  OdeProblem problem;

  Linear(MatX a, MatX b, VecX l, double tolerance) : A(std::move(a)), B(std::move(b)), load(std::move(l)) {
    const Eigen::Index n = A.rows();
    problem.size = static_cast<int>(2 * n);
    problem.tolerance = tolerance;
    problem.closed_derivatives = [this, n](double, const double*, MechanicalJacobian& out) {
      out.A = A;
      out.B = B;
      out.T = {n, n, {}};
      for (int k = 0; k < n; ++k) out.T.entries.push_back({k, k, 1.0});
      out.P = out.T;
    };
    problem.all_derivatives = [this](double, const double*, MatX& a_all, MatX& b_all) {
      a_all = A;
      b_all = B;
    };
  }
  bool rates(const double* y, double* dy) const {
    const Eigen::Index n = A.rows();
    const Eigen::Map<const VecX> p(y, n), w(y + n, n);
    Eigen::Map<VecX>(dy, n) = w;
    Eigen::Map<VecX>(dy + n, n) = A * p + B * w + load;
    return true;
  }
};

// u'' = -f^2 u - 2 d u' + g.
void closed_form(double f, double d, double g, double t, double& u, double& v) {
  using Complex = std::complex<double>;
  if (f == 0.0 && d == 0.0) {
    u += t * (v + 0.5 * g * t);
    v += g * t;
    return;
  }
  const double rest = g / (f * f);
  const Complex root = std::sqrt(Complex(d * d - f * f, 0.0)), a = -d + root, b = -d - root;
  const Complex first = (v - b * (u - rest)) / (a - b), second = (u - rest) - first;
  u = rest + (first * std::exp(a * t) + second * std::exp(b * t)).real();
  v = (first * a * std::exp(a * t) + second * b * std::exp(b * t)).real();
}

TEST(Exponential, SolvesLinearEquationsOverAPopulation) {
  Random random{std::mt19937(11)};
  int refused = 0;
  for (int sample = 0; sample < 45; ++sample) {
    const Eigen::Index n = std::array<Eigen::Index, 9>{1, 2, 5, 8, 13, 22, 40, 64, 150}[sample % 9];
    const double radians = random.decades(-1.0, 3.7), top = radians, tolerance = random.decades(-8.0, -3.0);
    const VecX f = spectrum(random, n, top);
    // None, in proportion to mass, to stiffness.
    VecX d = VecX::Zero(n);
    if (sample % 3 == 1) d.setConstant(random.decades(-2.0, 1.0));
    if (sample % 3 == 2) d = random.decades(-6.0, 0.5) / top * f.cwiseAbs2();
    for (Eigen::Index k = 0; k < n; ++k)
      if (f[k] == 0.0) d[k] = 0.0;
    const MatX S = MatX::Identity(n, n) + 0.3 / std::sqrt(static_cast<double>(n)) * random.matrix(n), G = S.inverse();
    const VecX load = S * VecX::NullaryExpr(n, [&]() { return random(-1.0, 1.0); });
    Linear linear(-S * f.cwiseAbs2().asDiagonal() * G, -2.0 * S * d.asDiagonal() * G, load, tolerance);
    linear.problem.weights = [n, &f, tolerance](const double*, double* w) {
      for (Eigen::Index k = 0; k < n; ++k) w[k] = 1.0 / tolerance, w[n + k] = 1.0 / (tolerance * std::max(1.0, f.maxCoeff()));
    };
    VecX y(2 * n), wanted(2 * n);
    const VecX u0 = VecX::NullaryExpr(n, [&]() { return random(-1.0, 1.0); });
    const VecX v0 = VecX::NullaryExpr(n, [&]() { return random(-1.0, 1.0); }).cwiseProduct(f.cwiseMax(1.0));
    VecX weight(2 * n);
    linear.problem.weights(y.data(), weight.data());
    const auto off = [&](const VecX& state, double at) {
      VecX u = u0, v = v0;
      for (Eigen::Index k = 0; k < n; ++k) closed_form(f[k], d[k], (G * load)[k], at, u[k], v[k]);
      wanted << S * u, S * v;
      return std::sqrt((state - wanted).cwiseProduct(weight).squaredNorm() / static_cast<double>(2 * n));
    };
    y << S * u0, S * v0;
    ExponentialSolver solver(linear.problem, [&](double, const double* at, double* dy) { return linear.rates(at, dy); });
    solver.restart(0.0, y);
    double t = 0.0;
    try {
      while (t < 1.0) {
        const double before = t;
        t = solver.step(1.0, y);
        VecX inside;
        const double middle = 0.5 * (before + t);
        solver.interpolate(middle, inside);
        EXPECT_LT(off(inside, middle), 0.1 * static_cast<double>(solver.steps) + 1e-10 / tolerance) << sample << " at " << middle;
      }
    } catch (const SimulationError&) {
      ++refused;
      continue;
    }
    const double error = off(y, 1.0);
    // Free vibrations followed apart are told to be right to a twentieth a step; digits are lost at the tightest.
    EXPECT_LT(error, 0.1 * static_cast<double>(solver.steps) + 1e-10 / tolerance)
        << sample << " n " << n << " radians " << radians << " tolerance " << tolerance << " steps " << solver.steps;
  }
  EXPECT_LT(refused, 8);
}

// Springs that harden, so that every step has a remainder and what it changes at the end: states within it begin and end where it does.
TEST(Exponential, StatesWithinAStepJoinItsEnds) {
  Random random{std::mt19937(5)};
  for (const double radians : {0.5, 5.0, 50.0, 500.0}) {
    for (const double tolerance : {1e-2, 1e-4, 1e-6, 1e-8}) {
      constexpr Eigen::Index n = 5;
      const VecX f = spectrum(random, n, radians).cwiseMax(0.3 * radians);
      Linear linear(-MatX(f.cwiseAbs2().asDiagonal()), MatX::Zero(n, n), VecX::Constant(n, 0.1 * radians * radians), tolerance);
      const double hardening = 0.05 * radians * radians;
      linear.problem.weights = [radians, tolerance](const double*, double* w) {
        std::fill_n(w, n, 1.0 / tolerance);
        std::fill_n(w + n, n, 1.0 / (tolerance * radians));
      };
      const auto rates = [&](double, const double* at, double* dy) {
        linear.rates(at, dy);
        for (Eigen::Index k = 0; k < n; ++k) dy[n + k] -= hardening * at[k] * at[k] * at[(k + 1) % n];
        return true;
      };
      linear.problem.all_derivatives = [&](double, const double* at, MatX& A, MatX& B) {
        A = linear.A;
        B = linear.B;
        for (Eigen::Index k = 0; k < n; ++k) {
          A(k, k) -= 2.0 * hardening * at[k] * at[(k + 1) % n];
          A(k, (k + 1) % n) -= hardening * at[k] * at[k];
        }
      };
      ExponentialSolver solver(linear.problem, rates);
      VecX y = VecX::NullaryExpr(2 * n, [&]() { return random(-1.0, 1.0); }), inside;
      y.tail(n) *= radians;
      solver.restart(0.0, y);
      for (double t = 0.0; t < 1.0 && solver.steps < 200;) {
        const VecX begin = y;
        const double before = t;
        t = solver.step(1.0, y);
        const auto apart = [&](const VecX& state) {
          const VecX d = inside - state;
          return std::max(d.head(n).cwiseAbs().maxCoeff(), d.tail(n).cwiseAbs().maxCoeff() / radians);
        };
        // Digits that the series lose: e^x of the radians x that their tolerance lets them cover.
        const double digits = std::max(1e-9, 1e-3 * tolerance);
        solver.interpolate(t, inside);
        EXPECT_LT(apart(y), digits) << radians << " radians, tolerance " << tolerance << ", end of step " << solver.steps;
        solver.interpolate(before, inside);
        EXPECT_LT(apart(begin), digits) << radians << " radians, tolerance " << tolerance << ", beginning of step " << solver.steps;
      }
      EXPECT_GT(solver.steps, 1);
    }
  }
}

}  // namespace
}  // namespace flexframe::sim::test_free_motion
