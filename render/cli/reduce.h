// A finite element model to a flexible body, as `flexframe reduce` does it.
#pragma once

#include <string>
#include <vector>

namespace flexframe::cli {

// Writes the body (SID file), its surface (.obj) and the report (.md) beside it, and prints nothing but warnings. interfaces: as
// --interface says them. Throws as sim::reduce does.
void reduce_model(const std::string& model, const std::string& sid, const std::vector<std::string>& interfaces, int modes, double damping);

}  // namespace flexframe::cli
