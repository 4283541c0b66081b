// Histories of a scene's outputs and how far two of them are apart: the measure of accuracy everywhere in the program.
//
// An error is the largest difference over time, relative to the range of the output. A vector is one output: a component counts
// against the range of the whole vector (the largest of its components' ranges), so that a component which hardly moves asks for no more
// digits than the one beside it. Components are the columns NAME.* of one unit. An output may be given a size of its own instead (sizes).
#pragma once

#include "sim/results/results.h"

#include <string>
#include <vector>

namespace flexframe::sim {

struct Histories {
  VecX times;  // nt, s
  std::vector<std::string> columns, units;
  MatX values;  // columns x nt
  // What the columns' errors are measured against; 0: their ranges; -1: the energy of the system if that is more; empty: all 0.
  VecX sizes;
  double energy_scale = 0.0;  // J, largest kinetic or strain energy: what energies are measured against; 0: unknown
  OutputScales scales;
  SolverStatistics statistics;  // of the run they come from
};

// The outputs of results, with the scales that their errors are measured against.
Histories to_histories(const Results& results);

// What each column may be by nothing but rounding: of lengths, angles and rates 1e-11 of the largest of their unit (what closing loops
// leaves), of forces and accelerations 1e-6 (what the equations of motion leave of them where they are zero), and of all the rounding
// (1e-12) of what they come from. Of a mechanism that stays in static equilibrium a thousandth of what the output is.
VecX rounding_of_outputs(const Histories& histories);
// Range of the output that each column belongs to, one number a column. 0 where the output does not move by more than rounding; energies
// are measured against the energy scale at least, as a conserved one does not move. A size that is given counts instead.
VecX output_ranges(const Histories& histories);
// The same of `run`, and of outputs that move by less than that, but down to 6e-13 of the largest length, in the same way (to three tenths)
// in `other`, a run of the same scene with the same columns: rounding does not come twice, a motion of a picometre does. The times of one
// must be among the other's.
VecX output_ranges(const Histories& run, const Histories& other);

// The largest range of an output, of those that have a size, over that size; 1 where none has, and at most. What is a share of what an
// output moves by is a share of its size by that factor.
double outputs_over_sizes(const Histories& histories);

struct Difference {
  VecX columns;  // relative, per column; 0 where the output does not move
  double largest = 0.0;
  int column = -1;  // of the largest; -1: no output moves
};

// Largest difference over the samples of a and reference, both with the same columns. The times of one must be among the other's
// (1e-9 of the duration). ranges: of the reference. Throws ArgumentError for histories that cannot be compared.
Difference compare_histories(const Histories& a, const Histories& reference, const VecX& ranges);

// The same histories at the samples whose time is among `times`.
Histories at_times(const Histories& histories, const VecX& times);

}  // namespace flexframe::sim
