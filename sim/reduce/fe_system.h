// Global matrices of a finite element model, and their elimination of rigid spiders and supports.
#pragma once

#include "sim/reduce/fe_model.h"

#include <array>

namespace flexframe::sim {

using SparseMatrix = Eigen::SparseMatrix<double>;

// Every node with its own motions; symmetric matrices, lower triangle only.
struct FeSystem {
  int size = 0;
  std::vector<std::array<int, 6>> dof;  // per node: index of ux uy uz rx ry rz, -1: the node has no such motion
  SparseMatrix K, M;
};

// A node of matrices may lack some of its motions: those that were held when they were written.
inline bool moves(const std::array<int, 6>& dof) { return dof[0] >= 0 || dof[1] >= 0 || dof[2] >= 0; }

// What is left to solve for: u = T q. Where nothing is tied or held T is the identity, not stored, and the matrices are the system's own,
// which must outlive this.
struct FeReduced {
  bool identity = true;
  SparseMatrix T;        // size x free
  std::vector<int> own;  // per column of T: the motion of the system it is
  const FeSystem* system = nullptr;
  SparseMatrix small_K, small_M;  // T^T K T, T^T M T, lower triangle; empty with T = 1
  const SparseMatrix& K() const { return identity ? system->K : small_K; }
  const SparseMatrix& M() const { return identity ? system->M : small_M; }
  int size() const { return static_cast<int>(K().rows()); }
  MatX expand(const MatX& q) const { return identity ? q : MatX(T * q); }
  MatX restrict(const MatX& p) const { return identity ? p : MatX(T.transpose() * p); }  // generalised forces
};

// Numbering and assembly. Throws InputError for elements that are inside out.
FeSystem assemble(const FeModel& model);

// Rigid spiders of the model and held motions taken out. Throws InputError where a node is tied twice or tied and held.
FeReduced eliminate(const FeModel& model, const FeSystem& system, const std::vector<FeConstraint>& held);

// y = A x for a symmetric matrix whose lower triangle is stored; x: size x k.
MatX symmetric_product(const SparseMatrix& lower, const MatX& x);

// Rigid motions of all nodes about the origin, size x 6: translations x y z, rotations x y z.
MatX rigid_motions(const FeModel& model, const FeSystem& system);

// Groups of nodes that nothing connects, by elements and rigid spiders; one part is what a body should be.
int count_parts(const FeModel& model, const FeSystem& system);

}  // namespace flexframe::sim
