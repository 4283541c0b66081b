// A ring of two curved beams, each half a circle, closes: their ends lie where the expressions say to within what a loop may stay open.
#include "sim/start/make_system.h"
#include "tests/unit/mechanism_text.h"

#include <gtest/gtest.h>

#include <string>

using namespace flexframe::sim;

namespace {

std::string half(const std::string& name, const std::string& y) {
  return fmt::format(
      "[[body]]\nname = \"{}\"\nkind = \"beam\"\naxis = {{ x = \"0.3*sin(u)\", y = \"{}\", to = \"pi\" }}\nvolumes = 6\nsection = {{ shape "
      "= "
      "\"circle\", diameter = 0.012 }}\nmaterial = {{ density = 7850, youngs_modulus = 2.1e11 }}\n",
      name, y);
}

}  // namespace

TEST(ClosedRing, TwoHalvesOfACircleClose) {
  const std::string turned = "rotation = [0, 0, \"pi\"]";
  const std::string scene = head(1, Vec3::Zero()) + half("one", "0.3*(1 - cos(u))") + half("two", "-0.3*(1 - cos(u))") +
                            joint("wall", "weld", "ground", "one", "") + joint("start", "weld", "ground", "two", turned) +
                            joint("end", "weld", "one.tip", "two.tip", turned);
  // It stayed open by 1.7e-7 rad.
  EXPECT_NO_THROW(make_system(parse_scene(scene, "ring.toml")));
}
