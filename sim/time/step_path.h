// The way between the ends of an explicit method's steps.
#pragma once

#include "sim/base/types.h"

#include <array>
#include <functional>
#include <vector>

namespace flexframe::sim {

// Of y' = f the ends of the last steps with their values and rates, and the way within the last one: a polynomial of fifth degree through
// its ends' values and rates and the rates at two places within, which are evaluated where a polynomial through several ends expects them
// (seventh degree with those of three steps; Hermite). A method of sixth order asks for as much; ARKODE's own interpolant errs up to a
// hundred times as much between the ends of a step as the step does at them.
class StepPath {
 public:
  // Writes the rates f(time, y); false where they cannot be evaluated.
  using Rates = std::function<bool(double time, const VecX& y, VecX& rates)>;

  bool empty() const { return ends_.empty(); }
  void clear();  // what came before does not go on smoothly
  void add(double time, const VecX& y, const VecX& rates);
  // Writes what the method's own interpolant says: it foretells where there are fewer steps than two, or the last one is so much longer
  // than those before it that it would carry their errors far.
  using Own = std::function<void(double time, VecX& y)>;
  // The state at a time within the last step; two evaluations the first time of a step. False where rates cannot be evaluated.
  bool at(double time, const Rates& f, const Own& own, VecX& y);

 private:
  struct End {
    double time = 0.0;
    VecX y, rates;
  };
  bool foretell(double time, VecX& y) const;

  std::vector<End> ends_;  // oldest first
  std::array<VecX, 2> within_;
  bool known_ = false;  // within_ is of the last step
};

}  // namespace flexframe::sim
