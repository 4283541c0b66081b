// What the floating frame needs from a finite element model: integrals of displacement fields over the mass, second-order fields, stresses.
#pragma once

#include "sim/reduce/fe_system.h"

namespace flexframe::sim {

// Mass, first moment and inertia about the origin (xx yy zz xy xz yz as tensor elements) with the model's own mass matrix.
struct RigidMass {
  double mass = 0.0;
  Vec3 md = Vec3::Zero();
  Vec6 J = Vec6::Zero();
  Vec3 directions = Vec3::Zero();  // kg, the mass that moves along each axis; alike in any free body
};
RigidMass rigid_mass(const FeModel& model, const FeSystem& system);

// First order in each of the fields U (size x n): int u dm (3 x n), int c x u dm (3 x n), and the derivative of the inertia (6 x n).
struct LinearMass {
  Mat3X md, Cr;
  Mat6X J;
};
LinearMass linear_mass(const FeModel& model, const FeSystem& system, const MatX& U);

// Second order in the fields: J2 (xx yy zz xy xz yz) of int 2 (u_j . u_k) 1 - u_j u_k^T - u_k u_j^T dm, and Cr1[a](j, k) = int (u_k x
// u_j)_a dm; what turns with a node (fe_turning_mass) besides, whose mass moves in second order where it lies beside the node (md2, else
// empty).
struct QuadraticMass {
  std::array<MatX, 3> md2;
  std::array<MatX, 6> J2;
  std::array<MatX, 3> Cr1;
};
QuadraticMass quadratic_mass(const FeModel& model, const FeSystem& system, const MatX& U);

// Generalised forces (size x pairs) of the quadratic part of Green's strain: g_jk = int B^T C sym(grad u_j^T grad u_k) dV for the pairs (j
// <= k, ordered (0,0) (0,1) (1,1) (0,2) ...). K u2_jk = -g_jk gives the second-order displacement that leaves the strain energy quadratic;
// for any load f with K u_f = f, -f . u2_jk = int sigma(u_f) : grad u_j^T grad u_k dV is the geometric stiffness of that load (the same
// numbers as unit load cases give, for all loads at once). Shells by their membrane forces. `first`, `count`: which of the pairs.
MatX second_order_loads(const FeModel& model, const FeSystem& system, const MatX& U, int first, int count);

// g_jk . w_l for all pairs and the fields W (size x l) without forming the g: pairs x l. With w_l the static displacement under unit load l
// this is its geometric stiffness.
MatX second_order_work(const FeModel& model, const FeSystem& system, const MatX& U, const MatX& W);

// Loads whose work on a field is its md (3), Cr (3) and J (6) as in linear_mass: size x 12.
MatX linear_mass_loads(const FeModel& model, const FeSystem& system);

// Stress per field at the nodes of a solid or shell, 6 rows a node (xx yy zz xy yz xz) x n, in space axes; of shells on the face that
// their normals point to, or on the other one.
MatX element_stress(const FeModel& model, const FeSystem& system, const FeElement& e, const MatX& U, bool other_face = false);

}  // namespace flexframe::sim
