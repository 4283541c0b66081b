// A run that is made again where its first pass shows that the motion is far smaller than the sizes its errors were weighed against.
#pragma once

#include "sim/base/types.h"

#include <fmt/format.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace flexframe::sim {

// once(shares, wanted): a run whose trees have these shares of the mechanism's size (ErrorWeights::shares), which writes the shares that it
// calls for, empty where the ones it had will do; its result has `statistics`. At most `most_passes` runs; one that fails after the first
// leaves the one before, with a warning.
template <class Run>
auto with_narrowed_weights(std::vector<double> shares, Run&& once) {
  constexpr int most_passes = 3;
  std::vector<double> wanted;
  auto out = once(std::as_const(shares), wanted);
  for (int pass = 1; pass < most_passes && !wanted.empty(); ++pass) {
    shares = std::exchange(wanted, {});
    try {
      out = once(std::as_const(shares), wanted);
    } catch (const SimulationError& error) {
      out.statistics.notes.warn(
          "", fmt::format("the motion is too small for the tolerance, and the run that would resolve it failed: {}", error.what()));
      return out;
    }
  }
  return out;
}

}  // namespace flexframe::sim
