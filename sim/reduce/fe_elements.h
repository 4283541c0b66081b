// Element matrices: solids in three translations a node, shells in six motions a node.
//
// Solids: isoparametric, consistent mass. Quadrature (points for stiffness / mass): tetrahedron4 1 / 4, tetrahedron10 4 / 15,
// hexahedron8 8 / 8 (full or with incompatible modes), hexahedron20 27 / 27 (reduced: 8 / 8, as in
// CalculiX: what no point sees has no mass either, and a thousandth of the full stiffness), wedge6 2 / 6 (one point in the triangle: with
// three it locks in bending), wedge15 9 / 21.
// Shells: quadrangle4 is MITC4 with a membrane of four incompatible modes, triangle3 a discrete Kirchhoff-Mindlin triangle with a constant
// strain membrane, quadrangle8 and triangle6 are degenerated solids with reduced integration (2 x 2 and 3 points); rotation about the
// normal is held by a small stiffness against the membrane's own rotation.
//
// Sources: T. J. R. Hughes, The Finite Element Method, 2000; P. Keast, Moderate-degree tetrahedral quadrature formulas, CMAME 55 (1986);
// R. L. Taylor, P. J. Beresford, E. L. Wilson, A non-conforming element for stress analysis, IJNME 10 (1976); J. C. Simo, M. S. Rifai,
// IJNME 29 (1990); E. N. Dvorkin, K.-J. Bathe, A continuum mechanics based four-node shell element, Eng. Comput. 1 (1984); J.-L. Batoz,
// K.-J. Bathe, L.-W. Ho, A study of three-node triangular plate bending elements, IJNME 15 (1980); I. Katili, A new discrete
// Kirchhoff-Mindlin element based on Mindlin-Reissner plate theory and assumed shear strain fields, part I, IJNME 36 (1993); S. Ahmad, B.
// M. Irons, O. C. Zienkiewicz, Analysis of thick and thin shell structures by curved finite elements, IJNME 2 (1970).
#pragma once

#include "sim/reduce/fe_sections.h"

#include <functional>
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
void solid_mass(FeShape shape, FeFormulation formulation, const Mat3X& X, const FeMaterial& material, int id, MatX& M);

// Whether a share of the full element's stiffness holds motions that none of its points sees (hourglass motions): C3D20R, C3D6.
bool fe_is_held_by_share(FeShape shape, FeFormulation formulation);

// Twice the energy, J, of that share in each column of nodal displacements u (3n x m, node by node).
VecX hourglass_energy(FeShape shape, const Mat3X& X, const FeMaterial& material, int id, const MatX& u);

// Elasticity matrix 6 x 6 (xx yy zz xy yz xz, engineering shear strains).
Mat6 elasticity(const FeMaterial& material);

// Stress at the element's nodes from nodal displacements (3 x n), 6 x n (xx yy zz xy yz xz): values at the stiffness points (those of
// incompatible modes too), extrapolated by least squares (linear in tetrahedra, trilinear in hexahedra, linear times linear in wedges).
// The matrix: 6n x 3n, node by node, for many displacements of one element.
MatX solid_stress_matrix(FeShape shape, FeFormulation formulation, const Mat3X& X, const FeMaterial& material, int id);
MatX solid_nodal_stress(FeShape shape, FeFormulation formulation, const Mat3X& X, const FeMaterial& material, const Mat3X& u, int id);

// Columns: axes of a shell in the plane of its corners, the first along its first edge, the third along the normal; and its area, m^2.
// Throws InputError for a shell without area.
Mat3 shell_axes(FeShape shape, const Mat3X& X, int id, double& area);

// Flat shells (triangle3, quadrangle4), 6n x 6n, node by node (ux uy uz rx ry rz, global axes). law: in shell_axes. M is lumped by area:
// translation mass per node, its rotary inertia, and what couples both where the mass lies beside the nodes.
void shell_matrices(FeShape shape, const Mat3X& X, const FeShellLaw& law, int id, MatX& K, MatX& M);

// Share of the membrane's shear stiffness that ties a shell's turning about its normal to its surface's own; square: of the element's size,
// m^2, the area of a quadrangle and twice that of a triangle.
double drilling_share(const FeShellLaw& law, double square);

// Stress at the element's nodes on the face that the normal points to, or the other one, 6 x n in space axes, from nodal motions (6 x n: ux
// uy uz rx ry rz): membrane and bending. Quadrangles: Gauss points, extrapolated bilinearly; triangles: at the corners.
MatX shell_nodal_stress(FeShape shape, const Mat3X& X, const FeShellLaw& law, const MatX& u, int id, bool other_face = false);

// Curved shells (triangle6, quadrangle8): matrices and stress as above with consistent mass. law_at gives the law in axes Q at the
// place where the shape functions have the values N.
using FeLawAt = std::function<FeShellLaw(const Mat3& Q, const VecX& N)>;
void curved_shell_matrices(FeShape shape, const Mat3X& X, const FeLawAt& law_at, int id, MatX& K, MatX& M);
// On the face that the normal points to, or the other one.
MatX curved_shell_nodal_stress(FeShape shape, const Mat3X& X, const FeLawAt& law_at, const MatX& u, int id, bool other_face = false);

// Points of a shell's surface: shape functions, their derivatives (n x 2) along axes(:, 0) and axes(:, 1), area (m^2) and axes; quadrangles
// 2 x 2, triangle3 one, triangle6 three points.
struct FeShellPoint {
  VecX N;
  MatX dN;
  Mat3 axes;
  double area = 0.0;
};
std::vector<FeShellPoint> shell_points(FeShape shape, const Mat3X& X, int id);
// Normals of a curved shell at its nodes.
Mat3X curved_shell_normals(FeShape shape, const Mat3X& X, int id);

// Values and derivatives (n x 2) of a shell's shape functions: quadrangles on [-1, 1]^2, triangles on the unit triangle; corners, then
// middles.
void surface_functions(FeShape shape, const Eigen::Vector2d& q, VecX& N, MatX& dN);

// Values and derivatives (n x 3) of the shape functions at xi; nodes in Abaqus' order.
void shape_functions(FeShape shape, const Vec3& xi, VecX& N, MatX& dN);
// Places of the nodes in the parent element, 3 x n.
Mat3X parent_nodes(FeShape shape);

}  // namespace flexframe::sim
