// Bodies and joints by name: a scene that changes is searched as it is now; many take no longer each than few.
#include "sim/scene/named.h"
#include "tests/bench/cpu.h"

#include <gtest/gtest.h>

#include <algorithm>

#include <fmt/format.h>

namespace flexframe::sim::test_named {

namespace {

Scene links(int count) {
  Scene scene;
  for (int k = 0; k < count; ++k) {
    scene.bodies.emplace_back().name = fmt::format("link{}", k);
    scene.joints.emplace_back().name = fmt::format("joint{}", k);
  }
  return scene;
}

}  // namespace

TEST(Named, FindsWhatIsThere) {
  for (const int count : {3, 200}) {
    const Scene scene = links(count);
    for (int k = count - 1; k >= 0; --k) {
      EXPECT_EQ(body_number(scene, fmt::format("link{}", k)), k);
      EXPECT_EQ(joint_number(scene, fmt::format("joint{}", k)), k);
    }
    for (const char* none : {"ground", "", "link", "joint0", "link200"}) EXPECT_EQ(body_number(scene, none), -1) << none;
    EXPECT_EQ(joint_number(scene, "link0"), -1);
  }
}

// What is remembered of one scene must not pass for another's, nor for the same one's before it changed.
TEST(Named, FollowsTheScene) {
  Scene scene = links(200);
  ASSERT_EQ(body_number(scene, "link150"), 150);
  std::reverse(scene.bodies.begin(), scene.bodies.end());
  EXPECT_EQ(body_number(scene, "link150"), 49);
  scene.bodies[49].name = "other";
  EXPECT_EQ(body_number(scene, "link150"), -1);
  EXPECT_EQ(body_number(scene, "other"), 49);
  scene.bodies.resize(30);
  EXPECT_EQ(body_number(scene, "other"), -1);
  EXPECT_EQ(body_number(scene, "link199"), 0);
  const Scene next = links(100);
  EXPECT_EQ(body_number(next, "link99"), 99);
  EXPECT_EQ(body_number(next, "link199"), -1);
  EXPECT_EQ(body_number(scene, "link199"), 0);
}

// One after the other they take seconds.
TEST(Named, ManyTakeNoLongerEach) {
  constexpr int count = 30000;
  const Scene scene = links(count);
  const double start = flexframe::test::process_seconds();
  long sum = 0;
  for (int k = 0; k < count; ++k) sum += body_number(scene, scene.bodies[static_cast<size_t>((k * 7919L) % count)].name);
  EXPECT_EQ(sum, static_cast<long>(count) * (count - 1) / 2);
  EXPECT_LT(flexframe::test::process_seconds() - start, 0.5);
}

}  // namespace flexframe::sim::test_named
