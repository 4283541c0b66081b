// The series of the exponential method: the sums obey their differential equation, padding stays empty, what does not converge is told.
#include "sim/base/types.h"
#include "sim/time/power_series.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace flexframe::sim::test_power_series {
namespace {

constexpr int most = 64;

struct Problem {
  int n, rows;
  double length = 0.7;
  MatX A, A1, B, loads, matrix, terms;
  VecX weights;

  Problem(int n_, double fastest) : n(n_), rows((n_ + 7) / 8 * 8) {
    std::mt19937 random(7u + static_cast<unsigned>(n));
    std::uniform_real_distribution<double> any(-1.0, 1.0);
    const auto fill = [&](MatX& m, int r, int c) { m = MatX::NullaryExpr(r, c, [&]() { return any(random); }); };
    MatX V;
    fill(V, n, n);
    A = -fastest * fastest / n * V * V.transpose();
    fill(A1, n, n);
    fill(B, n, n);
    loads = MatX::Zero(2 * rows, 3);
    for (int c = 0; c < 3; ++c)
      for (int i = 0; i < n; ++i) loads(i, c) = any(random), loads(rows + i, c) = any(random);
    matrix = MatX::Zero(rows, 3 * n);
    matrix.topRows(n) << length * A1, B, A;
    terms = MatX::Constant(2 * rows, most + 2, std::numeric_limits<double>::quiet_NaN());
    terms.leftCols(2).setZero();
    for (int i = 0; i < n; ++i) terms(i, 1) = any(random), terms(rows + i, 1) = any(random);
    weights = VecX::Zero(rows);
    weights.head(n).setOnes();
  }
  PowerSeries series() const { return {n, rows, length, matrix.data(), loads.data(), weights.data(), 1e-13}; }
};

// All counts of rows that the kernel treats apart: 8, 16, 24 and what comes after.
TEST(PowerSeries, SumsObeyTheirEquation) {
  for (const int n : {1, 3, 8, 11, 16, 19, 24, 27, 40}) {
    Problem p(n, 6.0);
    const int count = expand(p.series(), most, p.terms.data());
    ASSERT_GT(count, 4) << n;
    ASSERT_LE(count, most + 1);
    EXPECT_TRUE(p.terms.leftCols(count + 1).allFinite()) << n;
    EXPECT_TRUE(p.terms.block(n, 0, p.rows - n, count + 1).isZero(0.0));
    EXPECT_TRUE(p.terms.block(p.rows + n, 0, p.rows - n, count + 1).isZero(0.0));
    MatX slopes = MatX::Zero(2 * p.rows, count);
    for (int k = 1; k < count; ++k) slopes.col(k - 1) = k * p.terms.col(k + 1);
    for (const double x : {0.0, 0.3, 1.0}) {
      VecX z(2 * p.rows), rate(2 * p.rows);
      evaluate_powers({p.terms.col(1).data(), 2 * p.rows, 2 * p.rows, count}, x, z.data());
      evaluate_powers({slopes.data(), 2 * p.rows, 2 * p.rows, count - 1}, x, rate.data());
      const VecX load = p.loads * Eigen::Vector3d(1.0, x, x * x);
      const VecX w = z.head(n), q = z.segment(p.rows, n);
      const VecX wd = p.A * q + p.length * x * (p.A1 * q) + p.B * w + load.head(n), qd = w + load.segment(p.rows, n);
      EXPECT_LT((rate.head(n) / p.length - wd).norm(), 1e-9 * wd.norm()) << n << " at " << x;
      EXPECT_LT((rate.segment(p.rows, n) / p.length - qd).norm(), 1e-9 * qd.norm()) << n << " at " << x;
    }
  }
}

// At four places at once the same operations in the same order.
TEST(PowerSeries, FourPlacesAtOnceAreThoseOneByOne) {
  for (const int n : {1, 8, 19}) {
    Problem p(n, 6.0);
    const int count = expand(p.series(), most, p.terms.data());
    ASSERT_GT(count, 4) << n;
    const Powers lower{p.terms.col(1).data() + p.rows, 2 * p.rows, p.rows, count};
    const double x[4] = {0.0, 0.3, 0.31, 1.0};
    MatX four(p.rows, 4);
    evaluate_powers_four(lower, x, four.data());
    for (int k = 0; k < 4; ++k) {
      VecX whole(2 * p.rows), half(p.rows);
      evaluate_powers({p.terms.col(1).data(), 2 * p.rows, 2 * p.rows, count}, x[k], whole.data());
      evaluate_powers(lower, x[k], half.data());
      EXPECT_EQ(half, whole.tail(p.rows)) << n;
      EXPECT_EQ(four.col(k), half) << n;
    }
  }
}

TEST(PowerSeries, TellsWhatDoesNotConverge) {
  Problem fast(5, 500.0);
  EXPECT_EQ(expand(fast.series(), most, fast.terms.data()), 0);
  for (const double wrong : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Problem broken(5, 6.0);
    broken.loads(2, 0) = wrong;
    const int count = expand(broken.series(), most, broken.terms.data());
    EXPECT_TRUE(count == 0 || !broken.terms.leftCols(count + 1).allFinite());
  }
}

}  // namespace
}  // namespace flexframe::sim::test_power_series
