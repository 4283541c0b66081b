// How far a mesh leaves its frequencies from those of a fine one, estimated from the mesh's own modes.
//
// Solids and shells: the stress of a fine mesh goes on from element to element; what it jumps by at a node is the error (O. C. Zienkiewicz,
// J. Z. Zhu, A simple error estimator and adaptive procedure for practical engineering analysis, IJNME 24 (1987)): stress at the corners
// less its mean over the elements of one material and section there, as energy. Beams and rods: between their nodes the shapes are those of
// static loads at the ends; inertia along them bends and stretches them further, which a fine mesh would show.
// By Rayleigh's quotient a mode that a fine mesh gives the share e less of its energy u^T K u = omega^2 is 1 / sqrt(1 - e) too high.
// Flat shells with lumped mass may be as much too low. Measured: REDUCE.md.
#pragma once

#include "sim/reduce/fe_refine.h"
#include "sim/reduce/fe_solver.h"

#include <optional>

namespace flexframe::sim {

// Relative error of the frequency of each field of U (size of the system x m, M-orthonormal modes), whose squared frequencies are
// `eigenvalues` ((rad/s)^2): an estimate of its size. Infinite where solids or shells have hardly an inner corner. nullopt where nothing
// can be told (matrices, laminates or springs alone). Solids and shells of large models by a sample of their corners, so that it costs a
// second or less.
std::optional<VecX> mesh_error(const FeModel& model, const FeSystem& system, const MatX& U, const VecX& eigenvalues);

// How a model is divided: its supports, how often, and what SparseCholesky asks for.
struct FeDivision {
  std::vector<FeConstraint> held;
  int times = 1;
  FeFiner finer = FeFiner::divided;  // of the first time
  const FeSolver* coarse = nullptr;  // the model's own, factorised: then the finer modes are found by iteration (fe_two_level.h), times = 1
  int threads = 1;
  std::function<void()> ask;
};

// The same from the model with its elements divided (fe_refine.h), whose modes are compared with these: within a factor of two or so for
// all kinds of elements, at the price of a model eight times as large. modes: elastic ones, vectors of the reduced system (of the
// whole one: reduced.expand), M-orthonormal, of which the first `wanted` count. nullopt: the model cannot be divided, or the iteration does
// not end.
std::optional<VecX> divided_mesh_error(const FeModel& model, const FeSystem& system, const FeReduced& reduced, const FeModes& modes,
                                       int wanted, const FeDivision& division);

// Share of each mode's energy (as above) that holds hourglass motions of C3D20R and C3D6, which their points do not see: about 1e-3 in
// sound modes. Where it is larger the frequency is that of the hold, not of the body: loads or supports at single nodes of a single layer.
VecX hourglass_shares(const FeModel& model, const FeSystem& system, const MatX& U, const VecX& eigenvalues);

}  // namespace flexframe::sim
