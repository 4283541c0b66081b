// Outputs that are computed from others (key `expression`), between the samples.
#pragma once

#include "sim/results/results.h"

#include <string>
#include <vector>

namespace flexframe::sim {

struct UnseenOutput {
  std::string column;
  double share = 0.0;    // of its swing, root mean squares
  double samples = 0.0;  // a second
};

// Outputs by expressions of which samples `first` to `first + count` miss more than a twentieth of the swing: a product of two vibrations
// has the sum of their frequencies, an expression of time any. Each is computed between the samples, from what it reads there and the time,
// and compared with what its own samples say of these places (both by Lanczos' kernel over twelve samples to either side, linear in them:
// sums and multiples of outputs never count). None where the scene's text is missing, and of samples whose steps differ or that are fewer
// than 48.
std::vector<UnseenOutput> computed_beyond_samples(const Results& results, Eigen::Index first, Eigen::Index count);

}  // namespace flexframe::sim
