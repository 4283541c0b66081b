// Velocity terms of a rigid body, as a part of functions that are compiled for wider registers (wide.h).
#pragma once

#include "sim/base/wide.h"
#include "sim/bodies/body_terms.h"

namespace flexframe::sim {

// update_velocity_terms (body_terms.h) of a body without elastic coordinates.
template <class S>
FLEXFRAME_INLINE void rigid_velocity_terms(const typename S::Twist& V, TermsIn<S>& out) {
  const typename S::Twist P = out.Mrr.lazyProduct(V);
  out.cr = joined(cross(angular(V), linear(P)), cross(angular(V), angular(P)) + cross(linear(V), linear(P)));
}

}  // namespace flexframe::sim
