// Mass properties of the solids that a scene draws a rigid body with, in closed form.
#pragma once

#include "sim/scene/scene.h"

#include <span>

namespace flexframe::sim {

// Mass, first and second moments about the origin of the body frame, in its axes: int dm, int r dm, int r r^T dm. kg, kg m, kg m^2.
struct MassMoments {
  double mass = 0.0;
  Vec3 first = Vec3::Zero();
  Mat3 second = Mat3::Zero();
};

// Of one solid of density `density` (kg/m^3). Box, plate, cylinder, disc, capsule, sphere: exact. Link: a flat bar with round ends about
// its two holes, exact. Gear wheel: the disc of its pitch circle, less its bore. Spring: its wire, spread evenly over its coils.
MassMoments shape_moments(const ShapeDef& shape, double density);

// Sum over solids, each with its own density.
MassMoments sum_of_shapes(std::span<const ShapeDef> shapes);

// xx yy zz xy xz yz about the centre of mass, kg m^2 (tensor elements, as RigidDef::inertia).
Vec6 central_inertia(const MassMoments& moments);

}  // namespace flexframe::sim
