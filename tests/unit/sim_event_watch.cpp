// Ends of phases inside a step (event_watch.h) where the ends of the step show nothing: a body that falls on its stop and comes back within
// one step, on paths that are polynomials given here. A watch that calls such a step calm, and leaves out its looks inside, misses it.
#include "sim/time/event_watch.h"

#include "sim/scene/scene_reader.h"
#include "sim/start/make_system.h"
#include "sim/time/events.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace flexframe::sim::test_event_watch {

namespace {

// A block on a rail over its stop at zero.
System block_over_stop() {
  return make_system(parse_scene(
      "[simulation]\nduration = 1\noutput_rate = 10\ngravity = [0, 0, 0]\n[[body]]\nname = \"block\"\nkind = \"rigid\"\nmass = 1\n"
      "[[joint]]\nname = \"rail\"\nkind = \"prismatic\"\nparent = \"ground\"\nchild = \"block\"\naxis = [1, 0, 0]\n"
      "initial = { value = 2 }\nstop = { lower = 0, stiffness = 1e6 }\n",
      "stop.toml"));
}

// A piece of the block's path from `from` on: height + rise (3 s^2 - 2 s^3) - dip 16 s^2 (1 - s)^2, s the share of `length` that has gone.
// Neither end moves; the dip is deepest in the middle.
struct Piece {
  double from = 0.0, length = 1.0, height = 2.0, rise = 0.0, dip = 0.0;
  double rate(double t) const {
    const double s = (t - from) / length;
    return (rise * 6.0 * s * (1.0 - s) - dip * 32.0 * s * (1.0 - s) * (1.0 - 2.0 * s)) / length;
  }
};

struct Looked {
  bool found = false;
  double time = 0.0;    // of the end of the phase, else of the step
  double looked = 0.0;  // the time of the last look
};

// The block follows the pieces, which begin at 0, each in one step of an integrator that has no error of them, and is watched from the
// piece `first` on. Looked is of the last piece.
Looked follow(const std::vector<Piece>& pieces, size_t first) {
  System system = block_over_stop();
  size_t now = 0;
  bool moves = false;
  OdeProblem problem;
  problem.size = state_size(system);
  problem.rhs = [&](double t, const double*, double* dy) {
    std::fill_n(dy, problem.size, 0.0);
    if (moves) dy[0] = pieces[now].rate(t);
  };
  problem.weights = [&](const double*, double* w) { std::fill_n(w, problem.size, 1e-6); };
  VecX y = pack_state(system, Eigen::Vector2d::Zero());
  std::vector<std::string> changes;
  start_phases(system, 0.0, y, true, changes);
  // Rests before, until the integrator's steps have grown.
  Integrator integrator(problem, Method::erk, -20.0, y);
  for (double end = -19.0; end <= 0.0; ++end)
    while (integrator.time() < end) integrator.step(end);
  moves = true;
  EventWatch watch;
  if (first == 0) watch.begin(system, 0.0, y);
  Looked out;
  for (now = 0; now < pieces.size(); ++now) {
    const double end = pieces[now].from + pieces[now].length;
    integrator.step(end);
    EXPECT_EQ(integrator.time(), end) << "more than one step for piece " << now;
    if (now + 1 == first) watch.begin(system, end, integrator.state());
    if (now < first) continue;
    double t = integrator.time();
    y = integrator.state();
    out.found = watch.look(system, integrator, t, y);
    out.time = t;
    out.looked = system.work.time;
    if (now + 1 < pieces.size()) {
      EXPECT_FALSE(out.found) << "piece " << now;
    }
  }
  return out;
}

// Where the dip of a piece that starts and ends at 2 and is 3 deep comes to zero: 16 s^2 (1 - s)^2 = 2/3.
double meets(const Piece& p) { return p.from + p.length * 0.5 * (1.0 - std::sqrt(1.0 - std::sqrt(2.0 / 3.0))); }

}  // namespace

// Two quiet steps: the second is looked at at its end alone, since its ends and the step before show that nothing changes.
TEST(EventWatch, QuietStepsAreLookedAtAtTheirEnds) {
  const Looked looked = follow({{0.0, 1.0}, {1.0, 1.0}, {2.0, 1.0, 2.0, 0.1}}, 0);
  EXPECT_FALSE(looked.found);
  EXPECT_EQ(looked.looked, 3.0);
}

// The first step of a phase has none before it that would tell.
TEST(EventWatch, TheFirstStepIsLookedIntoThoughItsEndsAreAlike) {
  for (const size_t first : {size_t{0}, size_t{1}}) {
    std::vector<Piece> pieces(first, Piece{});
    pieces.push_back({static_cast<double>(first), 1.0, 2.0, 0.0, 3.0});
    const Looked looked = follow(pieces, first);
    EXPECT_TRUE(looked.found);
    EXPECT_NEAR(looked.time, meets(pieces.back()), 1e-12);
  }
}

// The step before changed the margin by half of itself: this one may do so too, though its ends are alike.
TEST(EventWatch, AStepAfterAChangeIsLookedInto) {
  const std::vector<Piece> pieces = {{0.0, 1.0, 2.0, -1.0}, {1.0, 1.0, 1.0, 1.0}, {2.0, 1.0, 2.0, 0.0, 3.0}};
  const Looked looked = follow(pieces, 0);
  EXPECT_TRUE(looked.found);
  EXPECT_NEAR(looked.time, meets(pieces.back()), 1e-12);
}

// The step before changed it little, but this one is four times as long.
TEST(EventWatch, TheChangeOfTheStepBeforeCountsByItsLength) {
  const std::vector<Piece> pieces = {{0.0, 1.0}, {1.0, 1.0, 1.8, 0.2}, {2.0, 4.0, 2.0, 0.0, 3.0}};
  std::vector<Piece> start = pieces;
  start[0] = {0.0, 1.0, 2.0, -0.2};
  const Looked looked = follow(start, 0);
  EXPECT_TRUE(looked.found);
  EXPECT_NEAR(looked.time, meets(start.back()), 4e-12);
}

// A margin that falls to a good part less within the step is looked into as well: its least value may lie inside.
TEST(EventWatch, AStepThatEndsLowIsLookedInto) {
  // From 2 to 1, below zero on the way.
  const std::vector<Piece> pieces = {{0.0, 1.0}, {1.0, 1.0}, {2.0, 1.0, 2.0, -1.0, 3.0}};
  EXPECT_TRUE(follow(pieces, 0).found);
}

}  // namespace flexframe::sim::test_event_watch
