// What a scene's runs depend on, as one number.
#pragma once

#include "sim/scene/document.h"

#include <string>

namespace flexframe::sim {

// SHA-256 of the document's text, with settings and included files in it, and of all files that it names (keys `file` and `mesh`).
std::string inputs_fingerprint(const SceneDocument& document);

}  // namespace flexframe::sim
