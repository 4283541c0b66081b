// Products with blocks of few coordinates, whose number the compiler knows, against those of any number, and a body's elastic forces.
#include "sim/base/sized.h"
#include "sim/bodies/body_terms.h"

#include <gtest/gtest.h>

namespace flexframe::sim::test_sized {
namespace {

TEST(Sized, ProductsAreThoseOfAnyNumber) {
  for (Eigen::Index count = 1; count <= 13; ++count) {
    const MatX A = MatX::Random(count, count);
    const VecX x = VecX::Random(count);
    const Mat6X space = Mat6X::Random(6, count);
    const MatX3 plane = MatX3::Random(count, 3);
    const Vec6 f = Vec6::Random();
    const Vec3 g = Vec3::Random();
    VecX y(count), of_space(count), of_plane(count), third(count), copy(count);
    Vec6 V;
    by_larger_count(count, [&](auto n) {
      multiply_sized<n()>(A, x.data(), y.data());
      V = combine_sized<n()>(space, x);
      sized<n()>(of_space) = dots_sized<n()>(space, f);
      sized<n()>(of_plane) = dots_sized<n()>(plane, g);
      sized<n()>(third) = component_of<n()>(plane, 2);
    });
    copy_few(x.data(), count, copy.data());
    EXPECT_LT((y - A * x).norm(), 1e-14) << count;
    EXPECT_LT((V - space * x).norm(), 1e-14) << count;
    EXPECT_LT((combine_few(space, x) - space * x).norm(), 1e-14) << count;
    EXPECT_LT((combine_few(plane, x) - plane.transpose() * x).norm(), 1e-14) << count;
    EXPECT_LT((of_space - space.transpose() * f).norm(), 1e-14) << count;
    EXPECT_LT((of_plane - plane * g).norm(), 1e-14) << count;
    EXPECT_EQ(third, plane.col(2)) << count;
    EXPECT_EQ(copy, x) << count;
  }
}

TEST(Sized, ElasticForcesHaveStiffnessAndDamping) {
  for (int count = 1; count <= 13; ++count) {
    FlexibleBody body;
    body.n = count;
    body.Ke = MatX::Random(count, count);
    body.De = MatX::Random(count, count);
    body.ksigma = VecX::Random(count);
    PlaneBody plane;
    plane.n = count;
    plane.Ke = body.Ke;
    plane.De = body.De;
    plane.ksigma = body.ksigma;
    const VecX q = VecX::Random(count), qd = VecX::Random(count), force = body.Ke * q + body.ksigma + body.De * qd;
    VecX out(count);
    elastic_force(body, q, qd, out);
    EXPECT_LT((out - force).norm(), 1e-14) << count;
    elastic_force(plane, q, qd, out);
    EXPECT_LT((out - force).norm(), 1e-14) << count;
    body.stiffness = plane.stiffness = VecX::Random(count);
    elastic_force(body, q, qd, out);
    EXPECT_LT((out - (body.stiffness.cwiseProduct(q) + body.ksigma + body.De * qd)).norm(), 1e-14) << count;
  }
}

}  // namespace
}  // namespace flexframe::sim::test_sized
