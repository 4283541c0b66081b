// Interpolant of one patch of nodes: polyharmonic kernel with an affine part over the directions that the nodes span.
//
//   u(x) = sum_i W_i(y) [u_i + (R_i - I) delta_i(x)],   y = T^T (x - origin),   delta_i = (I - T T^T) (x - c_i)
//
// T holds the principal directions of the nodes less the dropped ones: those in which the nodes extend less than 1e-3 of their largest
// extent or less than a third of the vertices' extent. Along dropped directions rigid arms delta_i turn with the nodes (rotations R_i
// given, or estimated from the gradient). W reproduces constants and linear functions of y, so that rigid motion is exact for every
// layout. Kernels r^3 (triharmonic in space: continuous normals), r, r^2 log r.
// Sources: Wendland, Scattered data approximation, 2005, ch. 8 (conditionally positive definite kernels), ch. 4 (least squares);
// Shepard, A two-dimensional interpolation function for irregularly-spaced data, 1968 (the repaired form); Rippa, An algorithm for
// selecting a good value for the parameter c, 1999, eq. 17 (leave-one-out).
#pragma once

#include "interp/types.h"

#include <span>
#include <vector>

namespace flexframe::interp {

enum class KernelType { cubic, linear, thin_plate };

// How far the interpolant is simplified because its Lebesgue constant was too large.
enum class Repair { none, fewer_directions, local_residual };

struct Patch {
  std::vector<int> node;  // indices of the merged nodes
  Vec3 origin = Vec3::Zero();
  double scale = 1.0;             // lengths are divided by it
  Mat3 frame = Mat3::Identity();  // columns: spanned directions first, then the dropped ones
  int directions = 3;             // how many are spanned
  bool flat = true;               // kernel distances within the spanned directions only
  KernelType kernel = KernelType::cubic;
  Repair repair = Repair::none;
  Eigen::Matrix3Xd y;                // spanned coordinates of the nodes, scaled; 0 in dropped rows
  Eigen::Matrix3Xd off;              // delta of the nodes: dropped part of c_i - origin, m
  Eigen::MatrixXd inverse;           // k x (k + 1 + directions): kernel and polynomial values -> weights
  Eigen::VectorXd inverse_diagonal;  // k: (A^-1)_ii
  double arm = 0.0;                  // largest |delta_i| over the vertices, m: 0 if no arm is needed
};

struct PatchKind {
  KernelType kernel = KernelType::cubic;
  Repair repair = Repair::none;
  bool sheet = false;  // two directions at most: the nodes are those of a curved wall, seen along the third
};

// nodes: all merged nodes; chosen: those of the patch; vertices: what the patch is evaluated at (decides extents).
Patch make_patch(const Points& nodes, std::span<const int> chosen, const Points& vertices, std::span<const int> evaluated,
                 const PatchKind& kind);

// Weights W_i at x, into k doubles; scratch is reused memory.
void patch_weights(const Patch& patch, const Vec3& x, Eigen::VectorXd& scratch, Eigen::Ref<Eigen::VectorXd> weights);

// Derivatives of the weights at x along the spanned directions, directions x k, 1/m.
Eigen::MatrixXd patch_gradient(const Patch& patch, const Vec3& x);

}  // namespace flexframe::interp
