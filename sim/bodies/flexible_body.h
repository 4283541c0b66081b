// The one elastic body of flexframe: the Standard Input Data (SID) of the floating frame of reference
// (Wallrapp 1994; Heckmann et al. 2006 eq. 6). Many makers (FE beam, modal beam, SID file, reduced FE model), one consumer (dynamics).
// A rigid body is the same with no modes.
//
// A particle at c in the body frame moves to c + u, u = phi q + 1/2 q^T phi2 q (Heckmann et al. 2006 eq. 4). The dynamics derives every
// term of the equations of motion from the kinetic energy
//   T = 1/2 [v w qd] M(q) [v w qd]^T,   v, w: velocity and angular velocity of the body frame, in the body frame,
//   M(q) = [ m I,  -skew(md(q)),  Ct(q)^T ;  .,  J(q),  Cr(q)^T ;  .,  .,  Me ],   Ct_ja = d md_a / d q_j,
// so that any truncation of md, J and Cr keeps energy and momentum exactly. Gr, Ge and Oe of the SID follow from them:
// sym(Gr_j) = J1_j, Ge_j(k,:) = 2 Cr1(k,j,:), Oe = -J1/2 (and -J2/2 for the first-order part).
//
// Convention for optional second-order blocks: an empty matrix means zero and is never evaluated.
#pragma once

#include "sim/base/types.h"

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace flexframe::sim {

// A node or named frame of a flexible body. All matrices in the body frame; n = number of elastic coordinates.
struct FlexibleNode {
  std::string name;                  // "root", "tip", "middle", "node[17]"
  Vec3 origin = Vec3::Zero();        // undeformed position, m
  Mat3 rotation = Mat3::Identity();  // undeformed axes of the node in the body frame
  Mat3X phi;                         // 3 x n, displacement per elastic coordinate
  Mat3X psi;                         // 3 x n, small rotation per elastic coordinate (the node turns by exp(skew(psi q)))
  std::array<MatX, 3> phi2;          // n x n symmetric each or empty: u_a += 1/2 q^T phi2[a] q
  std::array<MatX, 3> psi2;          // the same of its rotation vector, psi q + 1/2 q^T psi2 q; not followed in the plane
  MatX sigma;                        // 6 x n stress per elastic coordinate, or empty (Pa: xx yy zz xy yz xz)
  VecX along;                        // weights of a RodAxis's points: their values to their integral from the root to here; else empty
};

// Mass along the axis of a beam as particles, for the complete kinetic energy of the second-order field (axis_mass.h).
//
// The series above is a truncation: it has the coupling that the second-order field makes and not its square. Where a beam is bent and
// twisted the field swings its outboard part sideways (u2 = -int int theta w'' dx dx), an inertia of m w^2 beside which the twist's own is
// m r^2, r the section's radius: the truncated matrix is indefinite as soon as the deflection passes the radius. Particles that move with
//   v + w x r + (phi + d u2/d q) qd,   r = c + phi q + u2
// make the energy a sum of squares. Their u2 is integrated from rows of linear fields, so that an evaluation costs O(points) and
// the products M = sum J^T m J.
//
// Where coordinates are few, u2 is multiplied out (AxisSeries): the particles' places and velocities then lie in a space of far fewer
// dimensions than there are particles, and one product tells d u2/d q.
struct AxisSeries {
  VecX root_mass, along;  // of the space's d dimensions: the particles' root_mass and x times it
  MatX phi;               // n x 3 d, as AxisMass::phi
  MatX second;            // 3 n d x n: column k is the derivative of d u2/d q (n x 3 d, times root_mass) by q_k
};
struct AxisMass {
  enum Field { stretch, slope_y, slope_z, bend_y, bend_z, twist, helix, shear_y, shear_z, fields };
  VecX root_mass;                 // square root of each particle's mass, kg^1/2; empty: the body has no such form
  VecX x;                         // undeformed place along x, m
  MatX phi;                       // n x 3 points, displacement times root_mass: all of x, of y, of z
  std::array<MatX, fields> row;   // n x points each or empty: u', section's slope in xy and in xz, their derivatives, theta, theta' times
                                  // the section's radius of gyration, shear angles
  std::array<VecX, fields> root;  // twist and slopes of the section x = 0 where it turns, else empty
  int per_panel = 0;              // points lie panel by panel from the root
  double panel = 0.0;             // length of one, m
  MatX once, twice;               // per_panel x (per_panel + 1): a field's points to its integrals from the panel's start to each point
                                  // and to its end, and to those of the integral, m and m^2
  Vec6 J0 = Vec6::Zero();         // inertia of the sections about their centres and what the particles lack of the body's constants
  Mat6X J1;                       // 6 x n or empty
  std::array<MatX, 6> J2;         // n x n symmetric each or empty: what turned sections have of the second order
  std::array<MatX, 3> Cr1;        // n x n each or empty: the same of their angular momentum
  Mat3X Cr0;                      // 3 x n
  MatX Me;                        // n x n
  std::shared_ptr<const AxisSeries> series;  // null: integrated anew for every state
};

// A beam that bends in one plane, followed exactly however far it turns (rod_axis.h): a section is turned by theta, linear in q, and
//   r' = (1 + u') (cos theta, sin theta) + gamma (-sin theta, cos theta)
// from the root on, r(0) = phi(0) q. Fields are rows at the points of a quadrature along the axis, where the particles are too; their
// number is a multiple of four, the last ones may weigh nothing.
struct RodAxis {
  int towards = 1;      // theta turns x towards this component of the body frame: 1 (y), 2 (z)
  VecX x;               // undeformed place of a point, m
  VecX root_mass;       // square root of its particle's mass, kg^1/2
  MatX phi_x, phi_v;    // points x n: displacement along x and across, times root_mass
  MatX turn;            // points x n: theta
  MatX stretch, shear;  // points x n each or empty: u', gamma
  MatX along;           // points x points: values at the points to their integrals from the root to each particle, times root_mass
  VecX tilt;            // empty, or what each point has of rho (I about x - I across), kg m^2: the sections' tensor turns with theta
  // Inertia of the sections about their centres and what the particles lack of the body's constants, as in AxisMass.
  Vec6 J0 = Vec6::Zero();
  Mat6X J1;
  Mat3X Cr0;
  MatX Me;
};

// Symmetric tensors are stored as 6 rows: xx yy zz xy xz yz, as tensor elements (the product of inertia xy is -int x y dm).
struct FlexibleBody {
  int n = 0;                           // number of elastic coordinates
  double mass = 0.0;                   // kg
  Vec3 md0 = Vec3::Zero();             // first moment of mass, kg m:  md(q) = md0 + md1 q + 1/2 q^T md2 q
  Mat3X md1;                           // 3 x n
  std::array<MatX, 3> md2;             // n x n symmetric each or empty
  Vec6 J0 = Vec6::Zero();              // inertia tensor about the body frame's origin: J(q) = J0 + J1 q + 1/2 q^T J2 q
  Mat6X J1;                            // 6 x n
  std::array<MatX, 6> J2;              // n x n symmetric each or empty
  Mat3X Cr0;                           // 3 x n: angular momentum per elastic velocity, column j is int c x phi_j dm
  std::array<MatX, 3> Cr1;             // n x n each or empty: Cr(q)(a, j) = Cr0(a, j) + sum_k Cr1[a](j, k) q_k
  MatX Me;                             // n x n structural mass
  MatX Ke;                             // n x n structural stiffness
  VecX stiffness;                      // the diagonal of Ke where Ke is diagonal (eigenmodes), else empty
  MatX De;                             // n x n structural damping (empty: none)
  VecX ksigma;                         // n, generalised force of a pre-stress (empty: none): elastic force = -(Ke q + De qd + ksigma)
  AxisMass axis;                       // where present, the kinetic energy is its instead of that of the blocks md .. Me
  std::shared_ptr<const RodAxis> rod;  // where present, nodes lie and energies are as it says, and neither phi2 nor md .. Me count
  std::vector<std::string> labels;     // n, what each elastic coordinate is ("element 3 v", "Eigen Mode 1 : 809 Hz"); may be empty
  std::vector<FlexibleNode> nodes;     // frames first or last as the maker likes; names unique
};

}  // namespace flexframe::sim
