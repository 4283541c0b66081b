// Loads at the start of a run: springs that have no direction there, loads that end with the search for rest.
#include "mechanism_text.h"

#include <gtest/gtest.h>

namespace flexframe::sim::test_start_loads {
namespace {

// A spring with a rest length between points that stand at one place has no direction.
TEST(Springs, WithoutADirectionAreRefused) {
  const auto scene = [](const std::string& spring, double from) {
    return head(0.1, Vec3(0, 0, 0)) + "[[body]]\nname = \"block\"\nkind = \"rigid\"\nmass = 1\ninertia = [1, 1, 1]\n" +
           fmt::format(
               "[[joint]]\nname = \"free\"\nkind = \"free\"\nparent = \"ground\"\nchild = \"block\"\ninitial = {{ value = [{}, 0, 0, 0, 0, "
               "0] }}\n",
               from) +
           "[[force]]\nname = \"pull\"\nkind = \"spring-damper\"\non = \"block\"\n" + spring + output("x", "block", "position");
  };
  for (const char* spring : {"stiffness = 100\nrest = 0.1\n", "stiffness = 100\npreload = 3\n", "preload = 3\n"}) {
    EXPECT_THROW(run(scene(spring, 0), 1e-6), InputError) << spring;
    EXPECT_NO_THROW(run(scene(spring, 0.2), 1e-6)) << spring;
  }
  for (const char* spring : {"stiffness = 100\n", "damping = 5\nstiffness = 100\n"}) EXPECT_NO_THROW(run(scene(spring, 0), 1e-6)) << spring;
}

// A load that holds a static start and lets go: the search takes its value at t = 0, the run what follows.
TEST(Statics, TakesTheLoadAtTheStartItself) {
  for (const char* value : {"t <= 0 ? 5 : 0", "t > 0 ? 0 : 5"}) {
    const Results r = run(head(0.5, Vec3(0, 0, 0), 1000) +
                              "start = \"static\"\n[[body]]\nname = \"block\"\nkind = \"rigid\"\nmass = 1\ninertia = [1, 1, 1]\n" +
                              joint("slide", "prismatic", "ground", "block", "spring = { stiffness = 100 }") +
                              fmt::format("[[force]]\nkind = \"force\"\non = \"block\"\ndirection = [0, 0, 1]\nvalue = \"{}\"\n", value) +
                              output("x", "slide", "value"),
                          1e-8);
    for (Eigen::Index i = 0; i < r.times.size(); ++i) EXPECT_NEAR(column(r, "x")[i], 0.05 * std::cos(10 * r.times[i]), 1e-7) << value;
  }
}

}  // namespace
}  // namespace flexframe::sim::test_start_loads
