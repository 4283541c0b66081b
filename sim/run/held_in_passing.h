// Beams whose length a loop holds in some place of its motion only: a parallelogram whose coupler bends passes its flat place only if the
// coupler is as long as the ground then, so that it has to lengthen by what bending shortens it.
#pragma once

#include "sim/base/error.h"
#include "sim/base/notes.h"
#include "sim/scene/scene.h"
#include "sim/time/system.h"

#include <string>
#include <utility>
#include <vector>

namespace flexframe::sim {

// Adds the effect axial to beams in loops for which the program chooses the effects: the scene is to be simulated anew. lost: why it could
// not be without. A note says so. Empty: there is no such beam; else their names.
std::vector<std::string> let_lengthen_in_passing(const std::string& lost, Scene& scene, Notes& notes);

// The mechanism is at the limit of its reach: nothing but a beam that is pulled apart would let it go on.
struct BeyondReach : Error {
  using Error::Error;
};

// How far these beams are lengthened along a run.
class LengthenedBeams {
 public:
  LengthenedBeams(const System& system, const std::vector<std::string>& names);
  // At a sample. Throws BeyondReach where one of them is lengthened farther than any material is that is made to move.
  void look(const System& system) const;

 private:
  struct Beam {
    int body = -1;
    std::vector<std::vector<std::pair<int, double>>> lengthening;  // a station: coordinate and what it lengthens, 1
  };
  std::vector<Beam> beams_;
};

}  // namespace flexframe::sim
