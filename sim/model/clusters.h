// Parts that loops and couplings bind are solved together: a cluster. A part that nothing binds is a cluster of its own.
#pragma once

#include "sim/model/model.h"

namespace flexframe::sim {

// Groups the parts by the model's loops and couplings, numbers parts and coordinates by their clusters, carriers first, and completes each
// cluster with what it needs: carrier, entries, frames, size (m). `order`: the parts, parents before children.
void form_clusters(Model& model, const Scene& scene, const std::vector<int>& order);

}  // namespace flexframe::sim
