// Element matrices: isotropic solids in three translations a node, flat shells in six motions a node.
//
// Solids: isoparametric, consistent mass. Quadrature (points for stiffness / mass): tetrahedron4 1 / 4, tetrahedron10 4 / 15,
// hexahedron8 8 / 8 (full or with incompatible modes), hexahedron20 27 / 27 (reduced: 8), wedge6 6 / 6, wedge15 9 / 21.
// Shells: quadrangle4 is MITC4 with a membrane of four incompatible modes, triangle3 a discrete Kirchhoff triangle with a constant strain
// membrane; rotation about the normal is held by a small stiffness against the membrane's own rotation.
//
// Sources: T. J. R. Hughes, The Finite Element Method, 2000; P. Keast, Moderate-degree tetrahedral quadrature formulas, CMAME 55 (1986);
// R. L. Taylor, P. J. Beresford, E. L. Wilson, A non-conforming element for stress analysis, IJNME 10 (1976); J. C. Simo, M. S. Rifai,
// IJNME 29 (1990); E. N. Dvorkin, K.-J. Bathe, A continuum mechanics based four-node shell element, Eng. Comput. 1 (1984); J.-L. Batoz,
// K.-J. Bathe, L.-W. Ho, A study of three-node triangular plate bending elements, IJNME 15 (1980).
#pragma once

#include "sim/reduce/fe_model.h"

#include <span>

namespace flexframe::sim {

// A quadrature point of an element in space: gradients n x 3 (of the shape functions, 1/m), values n, weight times Jacobian (m^3).
struct FePoint {
  VecX N;
  MatX dN;
  double volume = 0.0;
};

enum class FeRule { stiffness, mass };

// Quadrature points of a solid. X: 3 x n node positions. Throws InputError "element ID is inside out" where the Jacobian is not positive.
std::vector<FePoint> solid_points(FeShape shape, FeFormulation formulation, FeRule rule, const Mat3X& X, int id);

// Stiffness and consistent mass, 3n x 3n, node by node (x y z). M is also given as the n x n factor of the identity.
void solid_stiffness(FeShape shape, FeFormulation formulation, const Mat3X& X, const FeMaterial& material, int id, MatX& K);
void solid_mass(FeShape shape, const Mat3X& X, const FeMaterial& material, int id, MatX& M);

// Elasticity matrix 6 x 6 (xx yy zz xy yz xz, engineering shear strains).
Mat6 elasticity(const FeMaterial& material);

// Stress at the element's nodes from nodal displacements (3 x n), 6 x n (xx yy zz xy yz xz): values at the stiffness points, extrapolated
// by least squares (linear in tetrahedra, trilinear in hexahedra, linear times linear in wedges).
MatX solid_nodal_stress(FeShape shape, FeFormulation formulation, const Mat3X& X, const FeMaterial& material, const Mat3X& u, int id);

// Shell matrices, 6n x 6n, node by node (ux uy uz rx ry rz, global axes). M is n x n lumped by area: translation mass per node, and the
// rotary inertia rho t^3 / 12 A of the node.
void shell_matrices(FeShape shape, const Mat3X& X, double thickness, const FeMaterial& material, int id, MatX& K, MatX& M);

// Stress at the element's nodes on the face that the normal points to (half the thickness above the middle surface), 6 x n in space axes,
// from nodal motions (6 x n: ux uy uz rx ry rz): membrane and bending. Quadrangles: Gauss points, extrapolated bilinearly; triangles: at
// the corners.
MatX shell_nodal_stress(FeShape shape, const Mat3X& X, double thickness, const FeMaterial& material, const MatX& u, int id);

// Values and derivatives (n x 3) of the shape functions at xi; nodes in Abaqus' order.
void shape_functions(FeShape shape, const Vec3& xi, VecX& N, MatX& dN);
// Places of the nodes in the parent element, 3 x n.
Mat3X parent_nodes(FeShape shape);

}  // namespace flexframe::sim
