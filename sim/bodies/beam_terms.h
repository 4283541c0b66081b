// The integrals of a beam along its axis that make a FlexibleBody: one routine for every set of shape functions.
// Private to the beam makers.
#pragma once

#include "sim/bodies/beam.h"

#include <Eigen/SparseCore>

#include <functional>
#include <vector>

namespace flexframe::sim::beam {

// The section's numbers per length.
struct Properties {
  double length = 0.0;                                             // m
  double mass = 0.0;                                               // rho A, kg/m
  double inertia_y = 0.0, inertia_z = 0.0, inertia_yz = 0.0;       // rho Iy, rho Iz, rho Iyz, kg m
  double ea = 0.0, ei_y = 0.0, ei_z = 0.0, ei_yz = 0.0, gj = 0.0;  // N, N m^2
  double shear_y = 0.0, shear_z = 0.0, shear_yz = 0.0;             // k G A, N; only with shear
  double gyration2 = 0.0;                                          // (Iy + Iz) / A, m^2; only with torsion
};

// Checks the numbers the effects need and computes them. Throws InputError naming the quantity.
Properties properties(const BeamDef& def, const BeamEffects& effects);

// Rows of shape functions at one x: each has one number per coordinate, zero where the coordinate does not take part.
// phi_z and s are the section's slopes in xy and xz (v' and w' without shear): it turns by (theta, -s, phi_z).
struct FieldRows {
  explicit FieldRows(int n);
  VecX u, du, v, dv, phi_z, dphi_z, w, dw, s, ds, theta, dtheta;
};

// The same at many x: rows first, first + 1, ... of the coordinates, a column a place; other coordinates do not take part.
struct FieldBlock {
  Eigen::Index first = 0;
  MatX rows;
};
struct FieldBlocks {
  FieldBlock u, du, v, dv, phi_z, dphi_z, w, dw, s, ds, theta, dtheta;
};

// full coordinates = Z q.
using Basis = Eigen::SparseMatrix<double>;

// Integrals over the beam, for n coordinates; matrices as in FlexibleBody.
struct Integrals {
  explicit Integrals(int n);
  Mat3X md1;
  std::array<MatX, 3> md2;
  Mat6X J1;
  std::array<MatX, 6> J2;
  Mat3X Cr0;
  std::array<MatX, 3> Cr1;
  MatX Me, Ke;
};

// Adds the integrand at x times weight (a length, m).
void add_station(Integrals& sum, const Properties& p, const BeamEffects& effects, const FieldRows& row, double x, double weight);
// The same at many x, with a weight each.
void add_stations(Integrals& sum, const Properties& p, const BeamEffects& effects, const FieldBlocks& rows, const Eigen::ArrayXd& x,
                  const Eigen::ArrayXd& weight);

// The second-order field where the root turns: adds what a twist together with a slope of the root section makes (free_free).
void add_root_rotation(Integrals& sum, const Properties& p, const FieldRows& root);

// Running integrals from the root, from which the second-order displacement at any x follows.
struct SecondOrder {
  explicit SecondOrder(int n);
  std::array<MatX, 3> rate;    // int phi2' ds without the part below
  std::array<MatX, 3> curl;    // int (theta x curvature) ds, y and z
  std::array<MatX, 3> moment;  // int s (theta x curvature) ds
  std::array<MatX, 3> turn;    // int psi2' ds, where the beam twists
};
void add_second_order(SecondOrder& sum, const Properties& p, const BeamEffects& effects, const FieldRows& row, double x, double weight);
void add_second_order(SecondOrder& sum, const Properties& p, const BeamEffects& effects, const FieldBlocks& rows, const Eigen::ArrayXd& x,
                      const Eigen::ArrayXd& weight);
// phi2 of the point x; n x n each, empty where it vanishes identically; or with sums and root rows that are in q already.
std::array<MatX, 3> second_order_at(const SecondOrder& sum, const FieldRows& root, double x, const Basis& Z);
std::array<MatX, 3> second_order_at(const SecondOrder& sum, const FieldRows& root, double x);
// psi2 of the point up to which the sum runs, likewise.
std::array<MatX, 3> second_turns(const SecondOrder& sum, const Basis& Z);
std::array<MatX, 3> second_turns(const SecondOrder& sum);

// The series of nodes for drawing carries phi2 up to this many numbers in all (32 MB).
constexpr double kMaxSeriesNumbers = 4e6;

// Adds the sums of a part of the beam whose coordinates are at, at + 1, ... of the whole, or rows * those of the sum.
void add_part(SecondOrder& sum, const SecondOrder& part, int at);
void add_part(SecondOrder& sum, const SecondOrder& part, const MatX& rows);
// Rows of shape functions in coordinates q, those of the row = Z q.
FieldRows in_coordinates(const FieldRows& row, const MatX& Z);

// The sections' rotary inertia about the axes across the beam: xx yy zz xy xz yz, kg m^2. Without shear only in so far as it is unlike
// about them: that part turns what spins about its own axis (propeller moment) and is as large as the polar moment. What is alike slows
// bending by (r/L)^2 and is left out, in such a way that motions in the only plane in which a beam bends have none.
Vec6 rotary_inertia(const Properties& p, const BeamEffects& effects);
// Body from integrals in other coordinates: full = Z q. Fills everything but Me, Ke, De, labels, nodes and md2, J2, Cr1.
FlexibleBody linear_body(const Integrals& sum, const Properties& p, const BeamEffects& effects, const Basis& Z);
// Me or Ke: Z^T m Z.
MatX in_body(const MatX& m, const Basis& Z);
// md2, J2, Cr1. Blocks that vanish identically are left empty.
void set_second_order(FlexibleBody& body, const Integrals& sum, const Basis& Z);
void set_second_order(FlexibleBody& body, const Integrals& sum, const MatX& Z);

// Gauss points of an element, whose slopes are of second degree, for its axis as a rod.
constexpr int rod_points = 3;

// Where a beam's particles are: at the Gauss points of panels of equal length.
struct AxisPoints {
  int panels = 1, per_panel = 1;
  std::function<FieldRows(int panel, double xi)> rows;  // the fields there
  FieldRows root;
};

// Particles on the axis (AxisMass). Me, Cr0, J0 of the body are kept exactly, whatever the points leave of them. Does nothing unless
// second-order bending meets twist.
void set_axis_mass(FlexibleBody& body, const Properties& p, const BeamEffects& effects, const Basis& Z, const AxisPoints& particles);

// The axis as a rod that is followed to any turn (RodAxis) and the weights of its points for the nodes, which have to be there; after that
// they have no phi2. Does nothing unless large_bending is on.
void set_rod_axis(FlexibleBody& body, const Properties& p, const BeamEffects& effects, const Basis& Z, const AxisPoints& particles);

// De = Rayleigh + sum of 2 zeta omega M phi phi^T M over the eigenmodes in ascending frequency; several ratios: one a mode, the last
// one for all further modes.
MatX damping_matrix(const Damping& damping, const MatX& Me, const MatX& Ke);

// The places of a beam that carry a name: root, tip and the user's frames. Throws InputError for x/L outside [0, 1] and for a
// reserved name (root, tip, node[..], station[..]).
struct Station {
  std::string name;
  double x = 0.0;  // m
};
std::vector<Station> named_stations(const BeamDef& def);

// Elements that a finite-element beam is made of: BeamDef::elements, but no more than 300 coordinates need, or with keep_modes than 300 or
// three a mode, unless the scene gives coordinates one by one. Its nodes stay where BeamDef::elements puts them.
int computed_elements(const BeamDef& def, const BeamEffects& effects);

// Node at x, in the coordinates of the rows.
FlexibleNode make_node(const std::string& name, double x, const FieldRows& row);

// Gauss-Legendre points and weights on [0, 1].
struct GaussRule {
  std::vector<double> x, w;
};
GaussRule gauss_rule(int points);

}  // namespace flexframe::sim::beam
