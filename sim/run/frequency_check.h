// How right the frequencies of small motions are: the scene linearised again with richer models of its beams.
//
// A mode of a model with fewer shapes, or without shear and rotary inertia, is too fast; so what a richer model changes in the i-th
// undamped frequency is its error (Courant, Fischer: frequencies of a richer space lie below, one by one). Richer are: twice the elements,
// volumes or links, finite elements for eigenforms and kept modes; shear and rotary inertia where they are off; stiffening where it is off
// (either way); lengthening and twist where they are off; what bodies of files leave out of their models, where the files say it. These
// bring vibrations of their own, which are not looked at: each frequency is compared with the nearest.
#pragma once

#include "sim/base/notes.h"
#include "sim/run/frequency_response.h"
#include "sim/start/linearise.h"
#include "sim/time/system.h"

#include <string>
#include <vector>

namespace flexframe::sim {

// The scene with a richer model of some of its beams.
struct RicherBeams {
  // bending: large, of static starts; of_files: bodies of files have the further shapes of their files
  enum class By { shapes, shear, stiffening, bending, further, of_files };
  By by = By::shapes;
  std::vector<std::string> bodies;
  bool few_shapes = false;  // of each beam only the lowest ones, which tell where they are slower, no more
  System system;
};

// Those that apply; none where they have more than 200 directions, which a note says, or the beams' coordinates are given one by one.
std::vector<RicherBeams> richer_beams(const System& system, Notes& notes);

// Tells of the vibrations that a richer model moves by more than `asked`, relative: a warning for each kind of model that moves one up to
// `highest` Hz, else a note. linear: of the system.
void tell_of_frequencies(const System& system, const Linearisation& linear, const std::vector<RicherBeams>& richer, double asked,
                         double highest, Notes& notes);

// Tells, as a note or a warning, of vibrations up to `highest` Hz that the model does not have because deformations of its beams are off:
// across the plane of a scene in a plane, by twist, by lengthening. linear: of the system.
void tell_of_left_vibrations(const System& system, const Linearisation& linear, double highest, Severity severity, Notes& notes);

// Warns of richer models that move an output's response to the force: at the lowest of its frequencies by more than `asked` of it
// (statics, which frequencies do not show), at others of the range by two and a half times as much of what the richer model has within
// `asked` of that frequency. response: of the system to that force; linear: of the system.
void tell_of_response(const System& system, const Linearisation& linear, const FrequencyResponse& response,
                      const std::vector<RicherBeams>& richer, double asked, Notes& notes);

// Warns of bodies from files whose own modes end below `highest`, Hz: what lies above is without them.
void tell_of_last_modes(const System& system, double highest, Notes& notes);

// The sixth vibration's undamped frequency, Hz, or the last one's where there are fewer: how far frequencies are looked at without being
// asked for.
double sixth_frequency(const Linearisation& linear);

// Undamped frequencies, Hz, ascending; 0 for what moves freely or is unstable.
VecX undamped_frequencies(const Linearisation& linear);

}  // namespace flexframe::sim
