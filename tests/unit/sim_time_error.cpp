// The share of the difference between two runs that counts as the error of the tighter one.
#include "sim/run/time_error.h"

#include <gtest/gtest.h>

#include <string>

namespace flexframe::sim {
namespace {

// A history from 0 to 1, and one that is off by `apart` at its end.
Histories history(const std::string& unit, double apart = 0.0) {
  Histories h;
  h.times = VecX::LinSpaced(3, 0.0, 1.0);
  h.columns = {"x"};
  h.units = {unit};
  h.values = MatX(1, 3);
  h.values << 0.0, 0.5, 1.0 + apart;
  return h;
}

double told(const std::string& unit, const std::string& method, long events = 0, double apart = 1e-3) {
  SolverStatistics s;
  s.method = method;
  s.tolerance = 1e-6;
  s.events = events;
  estimate_time_error(history(unit, apart), history(unit), s);
  return s.error_estimate;
}

// Medians of true errors over differences and what is told stay within a factor of five: see the decision in sim/DECISIONS.md.
TEST(TimeError, SharesByMethodAndUnit) {
  EXPECT_NEAR(told("m", "dirk"), 1e-3 / 3.0, 1e-12);
  EXPECT_NEAR(told("N", "bdf"), 0.5e-3, 1e-12);
  EXPECT_NEAR(told("N", "adams"), 0.2e-3, 1e-12);
  EXPECT_NEAR(told("m", "adams"), 0.2e-3, 1e-12);
}

// Two runs may share what an event's place is off by: 1e-7 was told of blows of which 3e-6 was true.
TEST(TimeError, RunsWithEventsAreNotBetterThanTheirTolerance) {
  EXPECT_NEAR(told("m", "adams", 3, 1e-8), 0.8e-6, 1e-15);
  EXPECT_NEAR(told("m", "adams", 0, 1e-8), 0.2e-8, 1e-15);
  EXPECT_NEAR(told("m", "adams", 3), 0.2e-3, 1e-12);
}

}  // namespace
}  // namespace flexframe::sim
