// How far one load path lies from another: curves whose distance is known.
#include "sim/run/load_path_check.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flexframe::sim::test_load_path_check {
namespace {

// Load = sin(s) over a place that goes from 0 to 4 m, moved by so many metres and times so much load; a force without any size.
LoadPath wave(int states, double moved, double times) {
  LoadPath out;
  out.columns = {"tip.x", "tip.y", "foot.x"};
  out.units = {"m", "m", "N"};
  for (int k = 0; k < states; ++k) {
    const double s = 4.0 * k / (states - 1);
    LoadPathState state;
    state.load = times * std::sin(s);
    state.outputs = Vec3(s + moved, 0.0, 1e-12 * (k % 2));
    out.states.push_back(state);
  }
  return out;
}

TEST(LoadPathCheck, TheSameCurveWithOtherStatesIsNotOff) {
  const OffCurve off = off_curve(wave(67, 0.0, 1.0), wave(401, 0.0, 1.0), 2.0, 4.0, 10.0);
  EXPECT_LT(off.share, 1e-5);
}

TEST(LoadPathCheck, APathBesideAnotherIsOffByItsDistance) {
  // At the ends, where the other curve does not go on, its whole way counts: 0.2 of 4 m.
  const OffCurve off = off_curve(wave(67, 0.2, 1.0), wave(401, 0.0, 1.0), 2.0, 4.0, 10.0);
  EXPECT_NEAR(off.share, 0.05, 0.01);
  EXPECT_EQ(off.column, "tip");
  // A maximum a tenth higher: 0.1 of the range of loads, which is 2.
  const OffCurve higher = off_curve(wave(401, 0.0, 1.1), wave(401, 0.0, 1.0), 2.0, 4.0, 10.0);
  EXPECT_NEAR(higher.share, 0.05, 0.01);
}

TEST(LoadPathCheck, StatesBeyondAnEarlyEndAreNotCompared) {
  LoadPath shorter = wave(401, 0.0, 1.0);
  shorter.states.resize(200);
  shorter.complete = false;
  EXPECT_LT(off_curve(wave(67, 0.0, 1.0), shorter, 2.0, 4.0, 10.0).share, 0.01);
  // The other way round the path is the one that jams.
  const OffCurve jammed = off_curve(shorter, wave(401, 0.0, 1.0), 2.0, 4.0, 10.0);
  EXPECT_EQ(jammed.share, 1.0);
  EXPECT_TRUE(jammed.column.empty());
}

}  // namespace
}  // namespace flexframe::sim::test_load_path_check
