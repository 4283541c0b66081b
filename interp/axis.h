// Nodes along a line: the one-dimensional member of the kernel family. The fundamental solution of the beam operator d4/ds4 is
// |s|^3 / 12, so that the r^3 interpolant of the axis is the cubic spline: with given rotations of Hermite type (the exact
// shape of an unloaded Euler-Bernoulli beam between its nodes), without them the twice continuously differentiable one, whose slopes are
// the estimated rotations. Sections stay rigid and turn with the axis; the twist is a spline of its own. Where a beam shears, its sections
// keep the turns of Timoshenko's element, chord - mean turn = g (1 + 1/Phi), and the axis leads by the shear g of each interval.
//
// Sources per station k of the axis (nodes and subdivisions between them): 6 vectors
//   position displacement, its derivative times 1 m, (R - I) e2, derivative, (R - I) e3, derivative
// and every vertex at (s, d2, d3) takes 12 of them by cubic Hermite weights: smooth along the axis, no crease at a node.
// Sources: de Boor, A practical guide to splines, 1978, ch. IV (not-a-knot); Hermite elements: Schiavo, Ferretti, Vigano 2005, eq. 30;
// shear: Friedman, Kosmatka, An improved two-node Timoshenko beam finite element, 1993, eq. 12-17.
#pragma once

#include "interp/sparse.h"
#include "interp/types.h"

#include <Eigen/Sparse>

#include <vector>

namespace flexframe::interp {

struct AxisLift {
  bool given = false;                                   // rotations come with the data
  bool finite = false;                                  // and are finite turns, whatever the lengths say
  Vec3 origin = Vec3::Zero();                           // on the axis
  Mat3 frame = Mat3::Identity();                        // columns: direction of the axis, e2, e3
  std::vector<int> order;                               // nodes from one end to the other
  std::vector<double> s;                                // their parameter, increasing
  Points offset;                                        // ordered nodes: from the axis to the node, m
  std::vector<double> station;                          // parameters of the stations, the nodes among them
  int subdivisions = 8;                                 // stations per interval
  Points positions;                                     // ordered nodes
  std::vector<Mat3> sheared;                            // n-1: shear per (chord - mean turn), frame of the mesh; empty: no shear
  Eigen::SparseMatrix<double, Eigen::RowMajor> slopes;  // n x (n-1): slopes at the nodes from the mean slopes of the intervals (spline)
};

// The axis through nodes whose extent across it is small: principal axis. At least two nodes with distinct parameters.
AxisLift make_axis(const Points& nodes, bool rotations_given);

// Gives it the shear of its intervals (AxisLift::sheared) from that of its nodes (N as in Nodes::shear, in the order of make_axis' nodes).
void set_shear(AxisLift& axis, const std::vector<Mat3>& shear);

// Number P of the sources, six a station. lift_exact and lift_linear: the sources (P x 3, m) of nodes that are displaced (N x 3, m) and
// turned (N x 3 rotation vectors, rad; 0 x 3: none); exact for large rotations, and linear for modes.
int source_count(const AxisLift& axis);
Points lift_exact(const AxisLift& axis, const Points& displacement, const Points& rotation);
Points lift_linear(const AxisLift& axis, const Points& displacement, const Points& rotation);

// Weights of the vertices; beyond the ends the end section carries them rigidly.
SparseWeights axis_weights(const AxisLift& axis, const Points& vertices, bool precise);

// Lebesgue constant along lower..upper of the axis parameter: sum of |weight| of the transverse node displacements.
double axis_lebesgue(const AxisLift& axis, double lower, double upper);

}  // namespace flexframe::interp
