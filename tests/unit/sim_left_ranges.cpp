// Springs on rotation vectors that are turned too far.
#include "sim/run/run_scene.h"
#include "sim/scene/scene_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace flexframe::sim::test_left_ranges {

TEST(LeftRanges, SpringsOfBallsBeyondHalfATurnAreTold) {
  for (const std::string kind : {"spherical", "free"})
    for (const double rate : {2.0, 4.0}) {  // rad/s for a second, a spring that hardly brakes
      const std::string text =
          fmt::format(R"toml(
[simulation]
duration = 1
[[body]]
name = "wheel"
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
[[joint]]
name = "ball"
kind = "{}"
parent = "ground"
child = "wheel"
spring = {{ stiffness = 0.01 }}
initial = {{ rate = {} }}
[[output]]
name = "w"
of = "wheel"
quantity = "angular_velocity"
)toml",
                      kind, kind == "free" ? fmt::format("[0, 0, 0, 0, 0, {}]", rate) : fmt::format("[0, 0, {}]", rate));
      const Results made = run_scene(parse_scene(text, "ball.toml"), SimulateOptions{});
      const std::vector<std::string> said = made.statistics.notes.texts(Severity::warning);
      const bool told =
          std::any_of(said.begin(), said.end(), [](const std::string& s) { return s.find("half a turn") != std::string::npos; });
      EXPECT_EQ(told, rate > 3.2) << kind << " " << rate;
    }
}

}  // namespace flexframe::sim::test_left_ranges
