// How much of a response each key of a sweep decides, from the table of a design made for it (design.h).
#pragma once

#include "sim/sweep/table.h"

#include <string>
#include <vector>

namespace flexframe::sim {

// Sobol's indices of one key: shares of the response's variance. An interval holds 95 % of 500 resamplings of the blocks.
struct SobolIndex {
  double first = 0.0, first_low = 0.0, first_high = 0.0;  // by this key alone (Saltelli et al. 2010, table 2 b)
  double total = 0.0, total_low = 0.0, total_high = 0.0;  // with all that it does together with others (Jansen 1999)
};

// Elementary effects of one key: the change of the response over the whole range of the key (unit: of the response).
struct MorrisEffect {
  double mean_size = 0.0;  // mu*: mean of the absolute values (Campolongo, Cariboni, Saltelli 2007)
  double mean = 0.0;       // mu
  double deviation = 0.0;  // sigma: of nonlinearity and of what the keys do together
};

struct Sensitivity {
  std::string response;
  std::vector<SobolIndex> sobol;     // one a key, of a design sobol:N
  std::vector<MorrisEffect> morris;  // one a key, of a design morris:N
  long used = 0, left_out = 0;       // blocks or paths, those without a point's response left out
  double variance = 0.0;             // sobol: of the response
};

// One entry a response; empty where the design is made for no indices. A response that does not vary, or has fewer than 8 whole blocks (two
// paths), has no indices.
std::vector<Sensitivity> sensitivities(const Sweep& sweep, const SweepTable& table);

}  // namespace flexframe::sim
