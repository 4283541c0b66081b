// Dense kernels of sim/base/small_matrices against Eigen's, for every size at which their loops take another course.
#include "sim/base/columns.h"

#include <gtest/gtest.h>

#include <random>

namespace flexframe::sim::test_small_matrices {
namespace {

MatX random_matrix(std::mt19937& random, Eigen::Index rows, Eigen::Index columns) {
  std::normal_distribution<double> normal;
  MatX out(rows, columns);
  for (Eigen::Index i = 0; i < out.size(); ++i) out.data()[i] = normal(random);
  return out;
}

// One direction becomes the other by the angle between them; opposite ones too, exactly and to rounding.
TEST(SmallMatrices, ShortestTurnTurnsOneDirectionIntoTheOther) {
  std::mt19937 random(3);
  for (int k = 0; k < 300; ++k) {
    const Vec3 a = random_matrix(random, 3, 1), other = random_matrix(random, 3, 1);
    const Vec3 b = k < 100 ? other : Vec3(-2.0 * a + (k < 200 ? 0.0 : 1e-8) * other);
    const Quat q = shortest_turn(a, b);
    EXPECT_LT((q * a.normalized() - b.normalized()).norm(), 1e-12) << k;
    EXPECT_NEAR(q.norm(), 1.0, 1e-12) << k;
    EXPECT_NEAR(2.0 * std::atan2(q.vec().norm(), q.w()), std::atan2(a.cross(b).norm(), a.dot(b)), 1e-6) << k;
  }
}

// Symmetric, positive definite.
MatX definite(const MatX& A) { return A * A.transpose() + MatX::Identity(A.rows(), A.rows()); }

// Factorises the lower half of D, which is all that is read.
void expect_factor(const MatX& D, MatX& half, MatX& L) {
  half = D;
  half.triangularView<Eigen::StrictlyUpper>().setConstant(std::nan(""));
  ASSERT_TRUE(cholesky(half, L)) << D.rows();
  EXPECT_LT((L * L.transpose() - D).norm(), 1e-14 * static_cast<double>(D.rows()) * D.norm()) << D.rows();
  EXPECT_TRUE(L.isLowerTriangular(0.0)) << D.rows();
}

TEST(SmallMatrices, FactoriseAndSolveEverySize) {
  std::mt19937 random(1);
  for (Eigen::Index n = 1; n <= 45; ++n) {
    const MatX A = random_matrix(random, n, n), D = definite(A);
    MatX half, L;
    expect_factor(D, half, L);
    const MatX b = random_matrix(random, n, 1);
    VecX x = b;
    solve(L, x.data());
    EXPECT_LT((D * x - b).norm(), 1e-12 * D.norm() * x.norm()) << n;
    for (const Eigen::Index rows : {1, 3, 4, 7, 12, 21}) {
      MatX B = random_matrix(random, rows, n), X = B;
      B.leftCols(n / 2).setZero();
      X = B;
      solve_rows(L, X);
      EXPECT_LT((X * D - B).norm(), 1e-12 * D.norm() * (X.norm() + 1.0)) << n << " " << rows;
    }
    MatX inverse = A, factors = A;
    ASSERT_EQ(invert(inverse), A.determinant() > 0.0 ? 1 : -1) << n;
    EXPECT_LT((A * inverse - MatX::Identity(n, n)).norm(), 1e-11 * A.norm() * inverse.norm()) << n;
    std::vector<int> order;
    ASSERT_GT(factorise(factors, order), 0.0);
    VecX y(n);
    solve(factors, order, b.data(), y.data());
    EXPECT_LT((A * y - b).norm(), 1e-11 * A.norm() * y.norm()) << n;
  }
}

// Those that fill more than the fastest cache are factorised in a wider square.
TEST(SmallMatrices, FactoriseLargerOnes) {
  std::mt19937 random(5);
  for (const Eigen::Index n : {61, 64, 65, 66, 71, 96, 101, 128, 192, 200}) {
    const MatX D = definite(random_matrix(random, n, n));
    MatX half, L;
    expect_factor(D, half, L);
    half(n - 1, n - 1) = -1.0;
    EXPECT_FALSE(cholesky(half, L)) << n;
  }
}

TEST(SmallMatrices, RefuseWhatIsSingular) {
  for (Eigen::Index n = 1; n <= 9; ++n)
    for (Eigen::Index lost = 0; lost < n; ++lost) {
      MatX D = MatX::Identity(n, n), L;
      D(lost, lost) = 0.0;
      EXPECT_FALSE(cholesky(D, L)) << n << " " << lost;
      EXPECT_FALSE(invert(D)) << n << " " << lost;
      D(lost, lost) = std::nan("");
      EXPECT_FALSE(cholesky(D, L)) << n << " " << lost;
      // A pivot that is rounding of its diagonal.
      if (lost == 0) continue;
      D = MatX::Identity(n, n);
      D(lost, 0) = D(0, lost) = 1.0;
      EXPECT_FALSE(cholesky(D, L)) << n << " " << lost;
    }
}

TEST(SmallMatrices, ProductsOfEverySize) {
  std::mt19937 random(2);
  for (Eigen::Index n = 1; n <= 26; ++n) {
    for (const Eigen::Index m : {1, 2, 4, 5, 8, 11, 16, 22}) {
      const MatX A = random_matrix(random, m, n);
      const VecX x = random_matrix(random, n, 1);
      VecX y(m);
      multiply(A, x.data(), y.data());
      EXPECT_LT((y - A * x).norm(), 1e-13 * A.norm() * x.norm()) << m << " " << n;
    }
    const MatX3 A = random_matrix(random, n, 3), B = random_matrix(random, n, 3);
    const MatX start = random_matrix(random, n, n), T = random_matrix(random, n, 2), E = random_matrix(random, n, 2),
               F = random_matrix(random, n, 2);
    const auto lower = [&](const MatX& M) { return MatX(M.triangularView<Eigen::Lower>()); };
    MatX M = start;
    add_symmetric(A, B, M.data(), n);
    EXPECT_LT((lower(M) - lower(start + A * B.transpose() + B * A.transpose())).norm(), 1e-12) << n;
    M = start;
    add_products(T, E, F, M);
    EXPECT_LT((lower(M) - lower(start + E * T.transpose() + F * E.transpose())).norm(), 1e-12) << n;
    M = start;
    add_outer(A, n, B, M.data(), n);
    EXPECT_LT((M - start - A * B.transpose()).norm(), 1e-12) << n;
    set_outer(A, n, B, M.data(), n);
    EXPECT_LT((M - A * B.transpose()).norm(), 1e-12) << n;
    const Mat3 I = random_matrix(random, 3, 3);
    MatX3 momenta = B;
    set_momenta(I, A, momenta);
    EXPECT_LT((momenta - A * I.transpose()).norm(), 1e-12) << n;
  }
}

// I seen from the frame that carries it, against the product of matrices.
TEST(SmallMatrices, MoveInertiaToTheParent) {
  std::mt19937 random(3);
  for (int k = 0; k < 20; ++k) {
    const MatX a = random_matrix(random, 6, 6), p = random_matrix(random, 4, 1);
    const Mat6 I = a * a.transpose();
    const Pose at{Quat(p(0), p(1), p(2), p(3)).normalized().toRotationMatrix(), Vec3(p(1), p(3), p(0))};
    const Mat6 X = child_matrix(at);
    EXPECT_LT((inertia_at_parent(at, I) - X.transpose() * I * X).norm(), 1e-12 * I.norm() * X.squaredNorm());
    const Mat3 J = I.topLeftCorner<3, 3>();
    const PlanePose in_plane{std::cos(p(0)), std::sin(p(0)), Vec2(p(1), p(2))};
    const Mat3 Y = child_matrix(in_plane);
    EXPECT_LT((inertia_at_parent(in_plane, J) - Y.transpose() * J * Y).norm(), 1e-12 * J.norm() * Y.squaredNorm());
  }
}

// What a cluster's rates take from the inertia and the force at its base, and the products of twists and wrenches in space.
TEST(SmallMatrices, ReduceInertiaEverySize) {
  std::mt19937 random(4);
  for (Eigen::Index n = 1; n <= 21; ++n) {
    const MatX A = random_matrix(random, n, n), six = random_matrix(random, 6, n), other = random_matrix(random, 6, n);
    const MatX D = A * A.transpose() + MatX::Identity(n, n), inverse = D.inverse();
    const VecX h = random_matrix(random, n, 1);
    MatX L, work;
    ASSERT_TRUE(cholesky(D, L));
    const double size = 1e-12 * static_cast<double>(n);
    Mat6 I = Mat6::Identity();
    Vec6 p = Vec6::Ones();
    reduce_inertia(L, Mat6X(six), h, work, I, p);
    EXPECT_LT((I - Mat6::Identity() + six * inverse * six.transpose()).norm(), size * (1.0 + six.squaredNorm())) << n;
    EXPECT_LT((p - Vec6::Ones() - six * inverse * h).norm(), size * (1.0 + six.norm() * h.norm())) << n;
    const MatX3 three = six.topRows(3).transpose();
    Mat3 J = Mat3::Identity();
    Vec3 r = Vec3::Ones();
    reduce_inertia(L, three, h, work, J, r);
    EXPECT_LT((J - Mat3::Identity() + three.transpose() * inverse * three).norm(), size * (1.0 + six.squaredNorm())) << n;
    EXPECT_LT((r - Vec3::Ones() - three.transpose() * inverse * h).norm(), size * (1.0 + six.norm() * h.norm())) << n;
    MatX M = MatX::Zero(n + 2, n + 2);
    add_symmetric(Mat6X(six), Mat6X(other), M, 2);
    const MatX whole = six.transpose() * other + other.transpose() * six;
    EXPECT_LT(MatX((M.bottomRightCorner(n, n) - whole).triangularView<Eigen::Lower>()).norm(), size * (1.0 + whole.norm())) << n;
  }
}

}  // namespace
}  // namespace flexframe::sim::test_small_matrices
