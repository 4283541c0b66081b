// Elastic bodies given as a linear time-invariant system (Chudnovsky et al. 2006 eq. 5, 6) on a rigid carrier.
#pragma once

#include "sim/bodies/flexible_body.h"
#include "sim/scene/scene.h"

namespace flexframe::sim {

// eta'' + 2 Gamma eta' + Omega eta = Sigma u, y = Theta eta, as M eta'' + 2 M Gamma eta' + M Omega eta = Theta^T u: a port's force works on
// the port's own motion, so that M Sigma = Theta^T for a symmetric positive M, with M Omega symmetric. M = 1 where Sigma = Theta^T; else M
// is found in the eigenvectors of Omega (mode by mode, since coordinates may be scaled as one likes). The carrier has the mass; the system
// has no share in it: the frame's acceleration does not excite eta (Ct = Cr = 0). carrier: mass, first moment and inertia, n = 0. Nodes:
// the frames of def.rigid, with the rows of Theta where they are ports. Throws InputError: no such M exists (the ports would create
// energy), Omega has complex or negative eigenvalues.
FlexibleBody make_state_space_body(const StateSpaceDef& def, const FlexibleBody& carrier);

}  // namespace flexframe::sim
