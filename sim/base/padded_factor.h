// The factor of a small matrix that fills up a multiple of four rows: what small_matrices.h does without its copies.
#pragma once

namespace flexframe::sim {

// D = L L^T in place. D: lower half of the first n rows and columns of a square of `stride` ones, a multiple of four, a unit matrix in
// the others; entries above the diagonal are spoilt. False where a pivot is not positive or has lost all digits of its diagonal.
bool factorise_filled(double* D, int n, int stride);

// x = (L L^T)^-1 x by that factor; x: `stride` values and room for three more, zeros behind the first n.
void solve_filled(const double* L, int stride, double* x);

}  // namespace flexframe::sim
