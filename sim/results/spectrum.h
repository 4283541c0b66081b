// Amplitude spectra of histories, over frequency or over the order of a turning shaft.
#pragma once

#include "sim/base/types.h"

namespace flexframe::sim {

struct Spectrum {
  VecX at;         // Hz, or orders (periods a turn)
  VecX amplitude;  // of a sine at that frequency, in the unit of the values; of the mean at 0
};

// x: times (s) or turns, ascending; values at each. They are brought to even steps by a cubic through four neighbours, weighted by Hann's
// window, and transformed: a sine between two lines shows at least 85 % of its amplitude. Throws InputError for fewer than 16 samples or an
// x that does not ascend.
Spectrum amplitude_spectrum(const VecX& x, const VecX& values);

}  // namespace flexframe::sim
