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
  SparseMatrix lumped_K;  // of lumped elements alone (they may be tied to the ground), lower triangle; empty without any
};

// A node of matrices may lack some of its motions: those that were held when they were written.
inline bool moves(const std::array<int, 6>& dof) { return dof[0] >= 0 || dof[1] >= 0 || dof[2] >= 0; }

// A node that a rigid spider carries: as the reference point turns, its arm keeps its length, in second order u = theta x (theta x r) / 2.
struct FeArm {
  int node = -1, reference = -1;  // indices
  Vec3 arm = Vec3::Zero();        // from the reference point, m
};

// What is left to solve for: u = T q. Where nothing is tied or held T is the identity, not stored, and the matrices are the system's own,
// which must outlive this.
struct FeReduced {
  bool identity = true;
  SparseMatrix T;        // size x free
  std::vector<int> own;  // per column of T: the motion of the system it is
  const FeSystem* system = nullptr;
  SparseMatrix small_K, small_M;  // T^T K T, T^T M T, lower triangle; empty with T = 1
  std::vector<int> idle;          // nodes with a motion that has neither stiffness nor mass: it is held
  using Terms = std::vector<std::pair<int, double>>;
  std::vector<std::pair<Terms, Terms>> idle_motions;  // of each that motion, and the sum that is held: it is one in that motion
  std::vector<FeArm> arms;                            // of the nodes of rigid spiders
  SparseMatrix arm_K;                                 // size x translations of the arms' ends, arm by arm: the columns of K
  const SparseMatrix& K() const { return identity ? system->K : small_K; }
  const SparseMatrix& M() const { return identity ? system->M : small_M; }
  int size() const { return static_cast<int>(K().rows()); }
  MatX expand(const MatX& q) const { return identity ? q : MatX(T * q); }
  MatX restrict(const MatX& p) const { return identity ? p : MatX(T.transpose() * p); }  // generalised forces
};

// Numbering and assembly. Throws InputError for elements that are inside out.
FeSystem assemble(const FeModel& model);

// Spiders, equations of the model and held motions taken out: dependent motions are replaced by others one equation after the other, what
// follows from those before is dropped. Motions of nodes with rotations, of reference points and of nodes in equations that have neither
// stiffness nor mass (the twist of a rod) are held: they do nothing. Throws InputError where an equation names a motion that its node does
// not have.
FeReduced eliminate(const FeModel& model, const FeSystem& system, const std::vector<FeConstraint>& held);

// y = A x for a symmetric matrix whose lower triangle is stored; x: size x k.
MatX symmetric_product(const SparseMatrix& lower, const MatX& x);

// Rigid motions of all nodes about the origin, size x 6: translations x y z, rotations x y z.
MatX rigid_motions(const FeModel& model, const FeSystem& system);

// Residuals (rows, each of the order of one) of supports and equations in the six rigid motions with rotations divided by `size`, and the
// energy of springs to the ground likewise. Both vanish for the rigid motions that the system is free to do.
MatX rigid_residuals(const FeModel& model, const FeSystem& system, const std::vector<FeConstraint>& held, double size);

// Whether springs hold the model to the ground.
bool has_ground_springs(const FeModel& model, const FeSystem& system);

// Rigid motions that the reduced system is free to do: combinations of the six that vanish at held motions, free x k.
MatX free_rigid_motions(const FeModel& model, const FeSystem& system, const FeReduced& reduced, const std::vector<FeConstraint>& held);

// Groups of nodes that nothing connects, by elements, spiders and equations; one part is what a body should be. Of each the count of its
// nodes and the index of its first; the largest first.
std::vector<std::pair<int, int>> unconnected_parts(const FeModel& model, const FeSystem& system);

}  // namespace flexframe::sim
