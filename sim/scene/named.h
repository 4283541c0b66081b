// Bodies and joints of a scene by name. Of many, where they stand is remembered by the thread and looked at again: a scene that has
// changed since is searched anew.
#pragma once

#include "sim/scene/scene.h"

#include <string_view>

namespace flexframe::sim {

// Index of the first of that name; -1: there is none.
int body_number(const Scene& scene, std::string_view name);
int joint_number(const Scene& scene, std::string_view name);

}  // namespace flexframe::sim
