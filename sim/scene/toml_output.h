// TOML text of a document that was read (toml_input.h).
#pragma once

#include "sim/scene/toml_input.h"

#include <string>

namespace flexframe::sim {

// Reads back to the same values, bit for bit. Keys of the root become tables [a] and [[a]]; all below is written inline. Dates are left
// out: the words of scene files have none.
std::string write_toml(const TomlValue& root);

}  // namespace flexframe::sim
