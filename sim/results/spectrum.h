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

struct SpectralLine {
  double at = 0.0, amplitude = 0.0;
};

// The largest line but the mean. Where it and its neighbours are those of one sine between two lines (main lobe of Hann's window), the
// sine's frequency and amplitude; else the line itself.
SpectralLine largest_line(const Spectrum& spectrum);

}  // namespace flexframe::sim
