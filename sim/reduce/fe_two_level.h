// The lowest modes of a finer mesh from those of the coarse one, without a factorisation of it: Knyazev's block iteration (A. V. Knyazev,
// Toward the optimal preconditioned eigensolver: LOBPCG, SIAM J. Sci. Comput. 23 (2001)), preconditioned on two levels: the coarse mesh's
// factor for what it can show, symmetric Gauss-Seidel for the rest (W. Hackbusch, Multi-Grid Methods and Applications, 1985).
#pragma once

#include "sim/reduce/fe_solver.h"

#include <optional>

namespace flexframe::sim {

struct FeFine {
  const FeReduced& reduced;  // the finer mesh
  const MatX& rigid;         // its rigid motions, any basis, free x k
  SparseMatrix from_coarse;  // motions of the finer system by those of the coarse one
};

// coarse: factorised. start: coarse modes, free x m, of which the first `wanted` are followed until each squared frequency is known to a
// tenth of its distance from `before` (or 1e-3 of itself). m modes of the finer mesh, ascending. nullopt: not within 24 steps.
// ask: called every step; may throw.
std::optional<FeModes> two_level_modes(const FeSolver& coarse, const FeFine& fine, const FeModes& start, int wanted,
                                       const std::function<void()>& ask);

}  // namespace flexframe::sim
