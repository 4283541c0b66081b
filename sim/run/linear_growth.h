// How the errors of a linear body grow with the turn of its material: private to linear_limit and expected_turn.
#pragma once

#include "sim/base/types.h"
#include "sim/model/model.h"
#include "sim/scene/scene.h"

namespace flexframe::sim {

// Coefficients of the squares of the turn: of the deflection at rest, of the frequency (linear_limit.h).
struct LinearGrowth {
  double at_rest = 0.42, frequency = 0.22;
  bool second_order = false;  // of a beam whose displacement field is
};

LinearGrowth error_growth(const Scene& scene, const Model& model, int body);

// Angle between the undeformed and the deformed tangent of a beam along x; rotation: rotation vector, rad.
double tangent_turn(const Vec3& rotation);

}  // namespace flexframe::sim
