// Amplitude spectra of histories, over frequency or over the order of a turning shaft.
#pragma once

#include "sim/base/types.h"

#include <string>

namespace flexframe::sim {

struct Spectrum {
  VecX at;                // Hz, or orders (periods a turn)
  VecX amplitude;         // of a sine at that frequency, in the unit of the values; of the mean over x at 0
  double coarsest = 0.0;  // largest step between samples, s or turns
  bool even = true;       // all steps are the same: nothing lies between samples
};

// x: times (s) or turns, ascending; values at each. They are brought to even steps by a cubic through four neighbours, weighted by Hann's
// window, and transformed: a sine between two lines shows at least 85 % of its amplitude. Lines end where the widest step holds half a
// period. Throws InputError for fewer than 16 samples or an x that does not ascend.
Spectrum amplitude_spectrum(const VecX& x, const VecX& values);

struct SpectralLine {
  double at = 0.0, amplitude = 0.0;
};

// The largest line but the mean. Where it and its neighbours are those of one sine between two lines (main lobe of Hann's window), the
// sine's frequency and amplitude; else the line itself.
SpectralLine largest_line(const Spectrum& spectrum);

// Why the largest line may not be that of a sine, as the end of a sentence about it; empty where it is: fewer than three of its periods in
// the samples (a drift, the shaft's own angle), or, of uneven samples, fewer than eight in one of its periods.
std::string doubt_of(const Spectrum& spectrum, const SpectralLine& largest);

}  // namespace flexframe::sim
