// Beams whose length a loop holds: clamped or hinged at both ends, or members of a framework that is rigid without them.
//
// Such a loop can carry a force without any load on it, a state of self-stress, and where that pulls along a beam the beam resists bending
// by its lengthening. Without the effect axial the condition that holds the ends apart follows from the others at the start, is left
// out, and the ends come open by what the beam shortens as it bends.
#pragma once

#include "sim/dynamics/work.h"

#include <string>
#include <vector>

namespace flexframe::sim {

struct HeldLength {
  int body = -1;      // of the scene: a beam without the effect axial, or a lumped one, whose links never lengthen
  std::string joint;  // of the loop that holds it
};

// Self-stress of every condition that the partitions leave out (a multiplier of 1 on it, balanced by the partition's rows), and the work
// that it does on a uniform lengthening of each beam: held where that closes at least a fiftieth of what it lengthens (closure.h: what a
// partition asks of deformation). Positions are up to date and the partitions chosen; their G is made anew.
std::vector<HeldLength> held_lengths(const Model& model, const Scene& scene, Work& work);

// Where the program chooses a beam's effects, axial is one of them from now on (ProgramChoice::held_by), and the model has to be built
// anew: true. Of the others a note says what is left out.
bool let_lengthen(const std::vector<HeldLength>& held, Scene& scene, Notes& notes);

}  // namespace flexframe::sim
