// A beam that bends in one plane as a geometrically exact rod in its floating frame (RodAxis, flexible_body.h): the fields of the linear
// beam are read as its strains, so that the strain energy stays quadratic and the nodes' rotations linear in q, and places follow by
// integration of the turned tangent. Energy and momentum are those of the particles, at any turn (sim/BEAMS.md, "Large bending").
#pragma once

#include "sim/bodies/body_terms.h"

namespace flexframe::sim {

// The parts of body_terms.h's functions of like names for a body that has one.
void reserve_rod(const FlexibleBody& body, BodyTerms& out);
void reserve_rod(const PlaneBody& body, PlaneTerms& out);
void update_rod_mass(const FlexibleBody& body, const VecX& q, BodyTerms& out, bool elastic);
void update_rod_mass(const PlaneBody& body, const VecX& q, PlaneTerms& out, bool elastic);
void update_rod_velocity_terms(const FlexibleBody& body, const Vec6& V, const VecX& qd, BodyTerms& out);
void update_rod_velocity_terms(const PlaneBody& body, const Vec3& V, const VecX& qd, PlaneTerms& out);

// The fields at q: RodState down to d_across; nothing is done where it has them.
void update_rod_fields(const RodAxis& rod, const VecX& q, RodState& state);
// turn_rate, a_along and a_across at the rates qd; the fields are there.
void update_rod_rates(const RodAxis& rod, const VecX& qd, RodState& state);

// The product of the elastic mass with accelerations qdd (n), from the particles of the last update_rod_mass.
VecX rod_inertia(const RodAxis& rod, const RodState& state, const VecX& qdd);

// Of a node with these weights, along x and across: displacement beyond the linear one, m; its derivative by q, n numbers each; its
// acceleration at rest of the rates.
Eigen::Vector2d rod_displacement(const VecX& weights, const RodState& state);
void rod_jacobian(const VecX& weights, const RodState& state, double* along, double* across);
Eigen::Vector2d rod_acceleration(const VecX& weights, const RodState& state);

// The same rod in other coordinates, old = T new.
std::shared_ptr<const RodAxis> in_coordinates(const std::shared_ptr<const RodAxis>& rod, const MatX& T);

// Whether all constants are equal to the last bit.
bool same_rod(const std::shared_ptr<const RodAxis>& a, const std::shared_ptr<const RodAxis>& b);

}  // namespace flexframe::sim
