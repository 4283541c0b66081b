// Kinetic energy of a beam that bends and twists as a sum of squares: the particles of AxisMass (flexible_body.h) with the complete
// velocity of the second-order displacement field, and the sections' inertia beside them. The mass matrix is positive definite however
// far the beam is deformed, and the velocity terms are the particles' own accelerations, so that energy and momentum are kept.
#pragma once

#include "sim/bodies/body_terms.h"

namespace flexframe::sim {

// A body that keeps no coordinate moves as a rigid one, whose mass never changes (reserve).
inline bool has_axis_mass(const FlexibleBody& body) { return body.n > 0 && body.axis.root_mass.size() > 0; }

// The parts of body_terms.h's functions of the same names for a body that has one.
void reserve_axis_mass(const FlexibleBody& body, BodyTerms& out);
void update_axis_mass(const FlexibleBody& body, const VecX& q, BodyTerms& out, bool elastic);
void update_axis_velocity_terms(const FlexibleBody& body, const Vec6& V, const VecX& qd, BodyTerms& out);

// Who needs no more than products with the elastic part of the mass matrix empties BodyTerms::Mee, which saves n^2 points of work a state.
// The product with accelerations qdd (n), of any body.
VecX elastic_inertia(const FlexibleBody& body, const BodyTerms& terms, const VecX& qdd);

// Multiplies u2 out where that is cheaper than to integrate it for every state: for a body that has its final coordinates. Energy,
// momentum and velocity terms are the same but for rounding.
void multiply_out(AxisMass& mass);

// Whether all constants are equal to the last bit.
bool same_axis_mass(const AxisMass& a, const AxisMass& b);

// The same mass in other coordinates, old = T new.
AxisMass in_coordinates(const AxisMass& mass, const MatX& T);

}  // namespace flexframe::sim
