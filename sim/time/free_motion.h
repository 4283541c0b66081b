// Vibrations that nothing drives, followed by amounts of modes (modes.h) over many of their radians at once: within a span every mode turns
// by itself in closed form, and what couples them (B, the change of A, what A is not diagonal) acts on the amounts that do not turn, by its
// integral over the span, again in closed form: Magnus' expansion to first order in the interaction picture. Its error is of second order
// in the coupling, not in the frequencies. Two runs, one with twice the spans, tell it. Iserles, Norsett, Phil. Trans. R. Soc. A 357 (1999)
// 983; Hochbruck, Lubich, SIAM J. Numer. Anal. 41 (2003) 945.
#pragma once

#include "sim/time/modes.h"

namespace flexframe::sim {

class FreeMotion {
 public:
  // From the amounts z = [p; w] at a time `tau` seconds after that of the modes, over `length` seconds.
  struct Way {
    const VecX& z;
    double tau, length;
  };
  struct Exchange;  // what modes do to each other
  struct Backlash;  // and by that to themselves
  FreeMotion() = default;
  // In equal spans.
  FreeMotion(const Exchange& exchange, const Backlash& back, const Way& way, int spans);
  bool empty() const { return before_.cols() == 0; }
  // [p; w] at s seconds after the beginning; not finite where the coupling is too strong for the spans.
  VecX at(double s) const;
  // The same added to n numbers each.
  void add(double s, double* p, double* w) const;

 private:
  double span_ = 0.0;
  Eigen::Index n_ = 0;
  VecX frequencies_;     // up to a multiple of four
  MatX before_, after_;  // what does not turn, referred to the middle of each span: before and after its coupling
};

// With an error that is told to be below `most` in weights at the end.
struct FreeAsked {
  FreeMotion::Way way;
  double most;
  int most_spans;
};

// Empty where it takes more spans than that. Begins with `spans` of them, which is left at what will do next time.
FreeMotion follow_free(const Modes& modes, const ModalWeights& weights, const FreeAsked& asked, int& spans);

}  // namespace flexframe::sim
