// The products of the mode columns: every size that takes another way through the kernels.
#include "interp/modes.h"

#include <gtest/gtest.h>

namespace flexframe::test_products {
namespace {

using namespace interp;

Eigen::MatrixXf columns_of(int vertices, int modes) {
  Eigen::MatrixXf out(3 * vertices, modes);
  std::uint32_t state = 12345;
  for (Eigen::Index k = 0; k < out.size(); ++k) {
    state = state * 1664525u + 1013904223u;
    out.data()[k] = static_cast<float>(static_cast<double>(state) / 4294967296.0 - 0.5);
  }
  return out;
}

// A frame is the same bits whether it comes alone, in a batch of any size, or on several threads: the sum over the columns in their order.
TEST(InterpProducts, BatchHasTheBitsOfTheSingleProduct) {
  for (const int vertices : {1, 5, 16, 333, 5000})
    for (const int modes : {0, 1, 2, 3, 4, 7, 8, 9, 20, 24, 25, 100}) {
      const ModeColumns columns(columns_of(vertices, modes));
      for (const int frames : {1, 2, 4, 5, 8, 13}) {
        const Eigen::MatrixXd q = Eigen::MatrixXd::Random(modes, frames);
        Eigen::MatrixXf batch, threaded;
        apply_modes_batch(columns, q, batch, 1);
        apply_modes_batch(columns, q, threaded, 2);
        ASSERT_EQ(batch, threaded);
        std::vector<float> one(3 * vertices);
        for (int f = 0; f < frames; ++f) {
          const std::vector<double> factor(q.col(f).data(), q.col(f).data() + modes);
          apply_modes(columns, factor, one, 1);
          ASSERT_EQ(batch.col(f), Eigen::Map<const Eigen::VectorXf>(one.data(), 3 * vertices))
              << vertices << " vertices, " << modes << " modes, frame " << f << " of " << frames;
        }
      }
    }
}

// Against a sum in double: n products and sums in float32 round by at most n eps of the sum of their sizes.
TEST(InterpProducts, SumsAreThoseOfDouble) {
  const Eigen::MatrixXf plain = columns_of(1000, 100);
  const ModeColumns columns(plain);
  const Eigen::MatrixXd q = Eigen::MatrixXd::Random(100, 9);
  Eigen::MatrixXf batch;
  apply_modes_batch(columns, q, batch, 1);
  const Eigen::MatrixXd truth = plain.cast<double>() * q, size = plain.cast<double>().cwiseAbs() * q.cwiseAbs();
  EXPECT_LE(((batch.cast<double>() - truth).array() / size.array()).abs().maxCoeff(), 101 * 6e-8);
}

}  // namespace
}  // namespace flexframe::test_products
