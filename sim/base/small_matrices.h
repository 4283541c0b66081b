// Dense kernels for matrices of ten to forty rows, where a general library's set-up costs more than the work.
// Compiled for wider registers too and chosen when the program starts; every entry is computed by the same operations in the same
// order, so that results do not depend on the machine.
#pragma once

#include "sim/base/types.h"

#include <vector>

namespace flexframe::sim {

using MatX3 = Eigen::Matrix<double, Eigen::Dynamic, 3>;

// Lower half of the n x n block M (column stride) += A B^T + B A^T; A, B: n x 3. Entries above the diagonal are spoilt.
void add_symmetric(const MatX3& A, const MatX3& B, double* M, Eigen::Index stride);

// n x m block at M (column stride) = or += F G^T; F: n x 3, first n rows, G: m x 3.
void set_outer(const MatX3& F, Eigen::Index n, const MatX3& G, double* M, Eigen::Index stride);
void add_outer(const MatX3& F, Eigen::Index n, const MatX3& G, double* M, Eigen::Index stride);

// out += F A^T; F, out: n x 3, not the same.
void add_rows(const MatX3& F, const Mat3& A, MatX3& out);

// y = A x, A: m x n, y: m values that are neither A nor x.
void multiply(const MatX& A, const double* x, double* y);

// Lower half of D += sum over the columns d of E_d T_d^T + F_d E_d^T; T, E, F: n x m, D: n x n. Entries above the diagonal are spoilt.
void add_products(const MatX& T, const MatX& E, const MatX& F, MatX& D);

// D = L L^T from the lower half of D; L: n x n, zeros above. False where a pivot is not positive or has lost all digits of its diagonal.
bool cholesky(const MatX& D, MatX& L);

// x = (L L^T)^-1 x.
void solve(const MatX& L, double* x);

// Xt = Xt (L L^T)^-1: every row is a right-hand side; m x n.
void solve_rows(const MatX& L, MatX& Xt);

// A = A^-1 with row exchanges: for the few conditions that close a loop, where the inverse serves several times and from either side.
// Returns the sign of A's determinant, 1 or -1 (of no rows: 1), 0 where A is singular.
int invert(MatX& A);

// A = P^-1 L U with row exchanges, in place; order: row i of the result was row order[i]. The smallest pivot's size, 0 where A is singular
// (of no rows: infinite).
double factorise(MatX& A, std::vector<int>& order);
// x = A^-1 b from the above; b and x: n values, not the same.
void solve(const MatX& LU, const std::vector<int>& order, const double* b, double* x);

}  // namespace flexframe::sim
