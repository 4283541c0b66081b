// What the loads along beams do to the errors of one frame's displacement field.
//
// The field errs by a share of the elastic forces (linear_limit.h). A beam that is pressed gives way to such an error as to a load, by
// 1 / (1 - P/Pcr); beyond buckling the elastica stiffens with its bend only, P/Pcr = 1 + turn^2 / 8, so that the stiffness left is turn^2
// / 4 of the beam's own.
//
// A beam that stretches by e shortens by (1 + e) theta^2 / 2 where it bends, of which the field of second order has theta^2 / 2 (BEAMS.md,
// 2): the work of the pull N on what it lacks, 1/2 int N e theta^2 dx, is a share of the stiffness. (A blade whose root is stretched
// by 3.5e-3 at 445 m/s at its tip: 2.3e-3 of its flapping, 9e-4, 3e-4 and 1e-4 in two, four and eight volumes.)
#pragma once

#include "sim/dynamics/section_forces.h"
#include "sim/run/linear_limit.h"
#include "sim/time/system.h"

#include <array>
#include <optional>
#include <vector>

namespace flexframe::sim {

// The pull along a beam of one frame.
struct PulledBeam {
  int body = -1;                             // of the scene
  std::vector<double> x;                     // m from the root, ascending
  std::vector<std::array<double, 2>> pulls;  // N at both ends of every interval
};

// The pulls along a run, at some of its samples.
class PulledBeams {
 public:
  // Nothing is looked at where no beam of one frame bends and shortens by it.
  PulledBeams(const System& system, size_t samples);

  bool wants(size_t sample) const { return sections_ && (sample % stride_ == 0 || sample + 1 == samples_); }
  // At a sample, `system` being at (t, y). Nothing is seen where it has no accelerations.
  void look(System& system, double t, const VecX& y, size_t sample);

  // What this does to the errors of beams. results: of the run. at_rest: it starts from equilibrium.
  void count(const Scene& scene, const Results& results, bool at_rest, std::vector<LinearLimit>& limits) const;

 private:
  struct Seen {
    size_t sample = 0;
    std::vector<PulledBeam> beams;
  };
  size_t samples_, stride_;
  std::optional<SectionForces> sections_;
  Reactions reactions_;
  struct Body {
    bool shortens = false;   // a beam of one frame that does where it bends
    bool stretches = false;  // the effect axial is on
  };
  std::vector<Body> bodies_;  // of the scene
  std::vector<Seen> seen_;
};

}  // namespace flexframe::sim
