// Damped modes whose frequencies lie far apart.
#include "sim/start/complex_modes.h"

#include <gtest/gtest.h>

#include <complex>

namespace flexframe::sim::test_complex_modes {
namespace {

using Long = std::complex<long double>;

// x'' + D x' + K x = 0 of two coordinates: the root of its determinant near `at`, with eighteen digits.
Long root_near(Long at, const Eigen::Matrix2d& D, const Eigen::Vector2d& K) {
  const auto f = [&](Long l) {
    const Long a = l * l + l * Long(D(0, 0)) + Long(K[0]), b = l * l + l * Long(D(1, 1)) + Long(K[1]);
    return a - l * l * Long(D(0, 1)) * Long(D(1, 0)) / b;
  };
  for (int i = 0; i < 50; ++i) {
    const Long h = at * Long(1e-7L), slope = (f(at + h) - f(at - h)) / (Long(2) * h);
    at -= f(at) / slope;
  }
  return at;
}

// A slow vibration beside one that is up to 10^7 times as fast and coupled to it by the damping only: its own damping is 1 % whatever is
// beside it, and neither more nor less.
TEST(ComplexModes, SlowVibrationsKeepTheirDampingBesideFastOnes) {
  for (const double fast : {1e2, 1e4, 1e6, 1e7})
    for (const double skew : {0.0, 0.3}) {
      const double beta = 0.02;
      SecondOrder s;
      s.M = MatX::Identity(2, 2);
      s.K = MatX::Zero(2, 2);
      s.K.diagonal() << 1.0, fast * fast;
      s.D = beta * s.K;
      s.D(0, 1) = beta * fast * 0.5, s.D(1, 0) = beta * fast * (0.5 + skew);
      s.D_error = s.K_error = MatX::Zero(2, 2);
      const Long wanted = root_near({-0.01L, 1.0L}, s.D, s.K.diagonal());
      int found = 0;
      for (const ComplexMode& m : complex_modes(s)) {
        if (std::abs(m.lambda) > 2.0 || std::abs(m.lambda.imag()) < 0.5) continue;
        ++found;
        EXPECT_NEAR(m.lambda.real() / static_cast<double>(wanted.real()), 1.0, 1e-6) << fast << " " << skew;
        EXPECT_NEAR(m.lambda.imag() / static_cast<double>(wanted.imag()), 1.0, 1e-9) << fast << " " << skew;
        EXPECT_LT(m.error, 1e-6) << fast;
      }
      EXPECT_EQ(found, 1) << fast;
    }
}

}  // namespace
}  // namespace flexframe::sim::test_complex_modes
