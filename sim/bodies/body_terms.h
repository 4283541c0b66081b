// The generalised Newton-Euler equations of one flexible body (Schiavo et al. 2005 eq. 30, Heckmann et al. 2006 eq. 6), evaluated for a
// state:
//   M(q) [dv; dw; qdd] + c(V, q, qd) = external generalised forces,
// derived from the kinetic energy of flexible_body.h by Hamel's equations in body axes, so that whatever truncation the body carries,
// energy and momentum are kept exactly.
#pragma once

#include "sim/base/types.h"
#include "sim/bodies/flexible_body.h"
#include "sim/bodies/plane_body.h"

#include <array>
#include <memory>
#include <vector>

namespace flexframe::sim {

// Work space of axis_mass.h: of the particles, x of all, y of all, z of all; times the square root of their masses.
struct AxisScratch {                            // read by no one after the function that writes it
  std::array<VecX, AxisMass::fields> at, root;  // fields of the state
  std::array<MatX, AxisMass::fields> rate_row;  // fields of the rates, a row
  VecX rate, acceleration;
  MatX second, integrand, bilinear;
  VecX sum, slope;
  Eigen::MatrixX4d weight;
  std::array<Eigen::MatrixX4d, 3> moment;
};
struct AxisTerms {  // kept from update_mass for update_velocity_terms
  MatX J;           // n x 3 points (of an AxisSeries: dimensions): phi + d u2/d q
  VecX place;
  Vec6 turned = Vec6::Zero();  // J1 q + q^T J2 q / 2 of the sections
  MatX J2q;                    // n x 6, of the sections
  VecX q;                      // where they have Cr1
  std::shared_ptr<AxisScratch> scratch;
};

// A RodAxis in one state. What depends on q alone is kept for those who ask again at the same coordinates.
struct RodState {
  VecX q;
  VecX theta, sine, versed, stretch, shear;  // at the points: theta, sin theta - theta, cos theta - 1, u', gamma
  VecX along, across;                        // what r' has beyond first order
  MatX d_along, d_across;                    // points x n: its derivative by q
  VecX turn_rate, a_along, a_across;         // rate of theta; acceleration of r' at rest of the rates
  VecX X, Y;                                 // places of the particles, times root_mass
  MatX JX, JY;                               // points x n: their derivatives
  VecX rate_x, rate_y, acc_x, acc_y;         // scratch
};

// Results and work space; sized once by `reserve`. S: Space or Plane; component order of twists and wrenches: linear, angular.
template <class S>
struct TermsIn {
  typename S::Inertia Mrr = S::Inertia::Zero();  // rigid part of the mass matrix about the body frame, body axes
  typename S::Columns Mre;                       // per elastic coordinate a column of [Ct^T; Cr]
  typename S::Twist cr = S::Twist::Zero();       // velocity terms of the frame's equations, N and Nm
  VecX ce;                                       // n, velocity terms of the elastic equations (elastic and damping forces excluded)
  typename S::Linear md = S::Linear::Zero();     // first moment of mass, kg m
  std::array<VecX, S::tensor> J2q;               // J2 q, kept from update_mass for update_velocity_terms
  VecX work, work2;
  MatX Mee;  // n x n elastic part where it depends on q (axis_mass.h, rod_axis.h), else empty
  AxisTerms axis;
  std::vector<RodState> rod;  // one where the body has a RodAxis: kept apart, as long chains of parts without any want the cache
};
using BodyTerms = TermsIn<Space>;
using PlaneTerms = TermsIn<Plane>;
void reserve(const FlexibleBody& body, BodyTerms& out);
void reserve(const PlaneBody& body, PlaneTerms& out);

// Mass matrix at the elastic coordinates q (n). elastic: also its elastic part, where that depends on q; else TermsIn::Mee stays as it
// is, for those who only ask for forces while no elastic coordinate accelerates.
void update_mass(const FlexibleBody& body, const VecX& q, BodyTerms& out, bool elastic = true);
void update_mass(const PlaneBody& body, const VecX& q, PlaneTerms& out, bool elastic = true);

// Whether two bodies are equal to the last bit in all that update_mass, update_velocity_terms and the frames at their nodes read.
bool same_kinetics(const FlexibleBody& a, const FlexibleBody& b);

template <class A, class B>
bool same_values(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() && a == b;
}

// Elastic part of the mass matrix.
template <class Body, class Terms>
const MatX& elastic_mass(const Body& body, const Terms& terms) {
  return terms.Mee.size() > 0 ? terms.Mee : body.Me;
}

// Velocity terms at the twist V (body axes) and qd (n); update_mass goes first.
void update_velocity_terms(const FlexibleBody& body, const Vec6& V, const VecX& qd, BodyTerms& out);
void update_velocity_terms(const PlaneBody& body, const Vec3& V, const VecX& qd, PlaneTerms& out);

// Ke q + ksigma + De qd (n), to be subtracted from the elastic equations' right-hand side.
void elastic_force(const FlexibleBody& body, const VecX& q, const VecX& qd, VecX& out);
void elastic_force(const PlaneBody& body, const VecX& q, const VecX& qd, VecX& out);

// 1/2 q^T Ke q + ksigma^T q, J.
double strain_energy(const FlexibleBody& body, const VecX& q);

// 1/2 [V; qd]^T M [V; qd], J; update_mass goes first.
double kinetic_energy(const FlexibleBody& body, const BodyTerms& terms, const Vec6& V, const VecX& qd);
double kinetic_energy(const PlaneBody& body, const PlaneTerms& terms, const Vec3& V, const VecX& qd);

}  // namespace flexframe::sim
