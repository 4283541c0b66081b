// What elements are made of: materials turned into space, the resultants of layered shells, beams.
//
// Sources: R. M. Jones, Mechanics of Composite Materials, 1999 (plane stress, turned layers, resultants A B D); J. S. Przemieniecki, Theory
// of Matrix Structural Analysis, 1968, and Z. Friedman, J. B. Kosmatka, An improved two-node Timoshenko beam finite element, Computers &
// Structures 47 (1993) (shape functions of the beam).
#pragma once

#include "sim/reduce/fe_model.h"

namespace flexframe::sim {

// Matrix that turns engineering strains of material axes Q (columns, in space) into those of space: strain_space = T strain_material is
// its inverse transpose's partner, so that C_space = T C_material T^T for stresses sigma_space = T sigma_material. 6 x 6.
Mat6 stress_turn(const Mat3& Q);

// The element's material with its elasticity in space axes; an isotropic one is returned as it is.
FeMaterial material_in_space(const FeModel& model, const FeElement& element);

// A layer in plane stress, in the axes of a shell.
struct FePly {
  double lower = 0.0, upper = 0.0;                  // m along the normal, from the nodes
  double density = 0.0;                             // kg/m^3
  Mat3 membrane = Mat3::Zero();                     // Pa: xx yy xy
  Eigen::Matrix2d shear = Eigen::Matrix2d::Zero();  // Pa: xz yz, without the correction 5/6; of several layers the plate's mean
  Eigen::Matrix2d alone = Eigen::Matrix2d::Zero();  // Pa: the material's own
};

// Where the stress of a shell is told: `membrane` times the strain of the nodes' surface and `bending` times the curvature.
struct FeFace {
  Mat3 membrane = Mat3::Zero(), bending = Mat3::Zero();  // Pa, Pa m: xx yy xy
  double height = 0.0;                                   // m along the normal, from the nodes
};

// Resultants of all layers about the nodes' surface.
struct FeShellLaw {
  std::vector<FePly> plies;
  FeFace upper, lower;                                        // the one that the normal points to, and the other
  Mat3 A = Mat3::Zero(), B = Mat3::Zero(), D = Mat3::Zero();  // N/m, N, N m
  Eigen::Matrix2d S = Eigen::Matrix2d::Zero();                // N/m, with the correction 5/6
  double twist = 0.0;                   // N/m, shear modulus times thickness: scale of what holds the turning about the normal
  double m0 = 0.0, m1 = 0.0, m2 = 0.0;  // kg/m^2, kg/m, kg: int rho z^k dz
  bool coupled() const { return m1 != 0.0; }
};

// Q: columns the shell's axes, the third its normal.
FeShellLaw shell_law(const FeModel& model, const FeElement& element, const Mat3& Q);
// The same at a place of a shell whose thickness changes (FeModel::node_thickness); N: shape functions there.
FeShellLaw shell_law_at(const FeModel& model, const FeElement& element, const Mat3& Q, const VecX& N);
// One isotropic material, nodes in the middle.
FeShellLaw shell_law(const FeMaterial& material, double thickness);

// What a normal that stays straight leaves out of several layers (fe_layer_error.h): the bending energy of the displacements beside it that
// shear makes in a bending wave, by the plate's own at the same curvature, where the plate's shear angle changes as its rotation does. The
// largest of some directions; about 0.01 of layers alike, a twentieth of soft cores.
double layer_warping(const FeShellLaw& law);

// Section of a shape by Abaqus' names and dimensions: RECT a b, CIRC r, ELLIPSE a b (diameters), PIPE r t, BOX a b t1 t2 t3 t4 (m), GENERAL
// A I11 I12 I22 J (m^2, m^4). nullopt: another name, or dimensions that give no section.
std::optional<FeBeamSection> beam_shape(const std::string& shape, std::vector<double> dimensions);

// Open sections of flat walls by Nastran's names and dimensions (m), y along n1 and z along n2: I (height, widths of the lower and upper
// flange, web, lower and upper flange thickness), T (flange width, height, flange and web thickness, flange on top), L (width, height,
// lower and standing wall), CHAN (flange width, height, web and flange thickness), I1 and CHAN1 (what the flanges stand out, web, height
// between the flanges, height), Z (the same, its upper flange towards -z), CHAN2 (side walls, floor, height, width), T1 (flange height, web
// length, flange and web thickness), T2 (as T, flange below), CROSS and H (horizontal length beside or between the upright walls, their
// thickness in all, their height, horizontal thickness), HAT (height, thickness, width of the top, brims). About the centroid; torsion is
// the sum of the walls' own (Saint-Venant, without warping), shear is carried by the walls that lie along it. nullopt: another name, or
// walls that do not fit.
std::optional<FeBeamSection> open_section(const std::string& kind, const std::vector<double>& dimensions);

// Matrices of a beam between two points, 12 x 12, node by node (ux uy uz rx ry rz): Timoshenko beam with the shape functions of its static
// solution, consistent mass with rotary inertia. Throws InputError for a beam without length or with n1 along it.
void beam_matrices(const FeBeamSection& section, const FeMaterial& material, const Mat3X& X, int id, MatX& K, MatX& M);

// A beam at a place, in its principal axes, from the 12 motions of its nodes in space: derivatives of the displacement, rotations, and
// their derivatives along it (3 rows each); forces N Qy Qz and moments T My Mz.
struct FeBeamPoint {
  Eigen::Matrix<double, 9, 12> fields;
  Eigen::Matrix<double, 6, 12> forces;
  double weight = 0.0;  // m
  double spread = 0.0;  // m^2, polar moment over area: fibres of a twisted beam are longer
};
std::vector<FeBeamPoint> beam_points(const FeBeamSection& section, const FeMaterial& material, const Mat3X& X, int id);

}  // namespace flexframe::sim
