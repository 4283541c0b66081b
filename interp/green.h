// Discrete Green's functions: the shape of least elastic energy that takes given displacements at the nodes.
//
//   min 1/2 a^T K a  subject to  B a = g        a = X G^-1 g,   X = (K + beta B^T B)^-1 B^T,   G = B X
//
// (augmented Lagrangian: the term in beta vanishes at the solution and makes the matrix definite as soon as the nodes hold the body).
// One sparse Cholesky factorisation, one solve per row of B. Source: Bathe, Finite element procedures, 1996, 3.4 (constraints by Lagrange
// multipliers). The nodes' stiffness is S = G^-1 - beta. Leave-one-out: node i left out, its force vanishes: residual S_ii^-1 (S g)_i.
#pragma once

#include "interp/types.h"

#include <Eigen/Sparse>

namespace flexframe::interp {

struct Green {
  Eigen::MatrixXd displacement;        // 3 P x 3 N: wanted points against the nodes' displacements
  Eigen::MatrixXd rotation;            // 3 P x 3 N: against the nodes' rotations, or empty
  Eigen::MatrixXd leave_one_out;       // 3 N x 3 N
  Eigen::MatrixXd leave_one_out_turn;  // 3 N x 3 N: against the nodes' rotations, or empty
  Eigen::MatrixXd soft;  // 3 N x at most 6: motions of the nodes that cost the least energy beside rigid ones; none with rotations
};

// K n x n symmetric, positive semidefinite; B rows x n: first 3 N rows displacements of the nodes, then rows of rotations for the nodes in
// `turned` (three each); wanted 3 P x n. Throws MapError if the matrix cannot be factorised.
Green solve_green(const Eigen::SparseMatrix<double>& stiffness, const Eigen::SparseMatrix<double>& constraints,
                  const Eigen::SparseMatrix<double>& wanted, int nodes, const std::vector<int>& turned, int threads);

// Makes linearised rigid motion exact: the part of the nodes' motion that is rigid moves the points rigidly.
void restore_rigid_motion(Green& green, const Points& nodes, const Points& points);

}  // namespace flexframe::interp
