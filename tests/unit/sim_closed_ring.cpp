// A ring of two curved beams, each half a circle, closes: their ends lie where the expressions say to within what a loop may stay open.
#include "sim/bodies/beam_pieces.h"
#include "sim/start/make_system.h"
#include "tests/unit/mechanism_text.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace flexframe::sim::test_closed_ring {

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

// Pieces of an even bend are equal, so that one body serves them all but those at the ends, where the curve's spline bends by rounding; and
// as long as the chords of the circle.
TEST(ClosedRing, PiecesOfAnEvenBendAreEqual) {
  const Scene scene = parse_scene(head(1, Vec3::Zero()) + half("one", "0.3*(1 - cos(u))"), "arc.toml");
  const BeamDef& beam = std::get<BeamDef>(scene.bodies.front().kind);
  std::set<double> lengths;
  for (int k = 0; k < 6; ++k) {
    lengths.insert(piece_of(beam, k, 0.0).length);
    EXPECT_NEAR(piece_of(beam, k, 0.0).length, 0.6 * std::sin(pi / 12), 1e-9);
  }
  EXPECT_LE(lengths.size(), 3u);
}

// A group's curve is made once for all places where it stands.
TEST(ClosedRing, EqualCurvesAreOne) {
  const std::string bead =
      "[[body]]\nname = \"b{0}\"\nkind = \"rigid\"\nmass = 1\ninertia = [1, 1, 1]\n[[joint]]\nname = \"j{0}\"\nkind = "
      "\"point-on-curve\"\nparent = \"ground\"\nchild = \"b{0}\"\ncurve = {{ x = \"{1}*u\", y = \"u^2\", to = 1 }}\n";
  const Scene scene = parse_scene(head(1, Vec3::Zero()) + fmt::format(fmt::runtime(bead), 1, 1) + fmt::format(fmt::runtime(bead), 2, 1) +
                                      fmt::format(fmt::runtime(bead), 3, 2),
                                  "beads.toml");
  EXPECT_EQ(scene.joints[0].curve, scene.joints[1].curve);
  EXPECT_NE(scene.joints[1].curve, scene.joints[2].curve);
}

}  // namespace flexframe::sim::test_closed_ring
