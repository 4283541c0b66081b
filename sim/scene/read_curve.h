// The key `curve` of joints and contacts, `axis` of beams.
#pragma once

#include "sim/scene/curve.h"
#include "sim/scene/toml_input.h"

#include <memory>
#include <string_view>

namespace flexframe::sim {

// { points = [[x, y, z], ...], closed = false } with rows of two numbers (z = 0) or three, m, or { x = "...", y = "...", z = "...",
// from = 0, to = 1, closed = false }, expressions of u. Throws InputError with file, line and key.
std::shared_ptr<const SpaceCurve> read_curve(const TableReader& reader, std::string_view key);

}  // namespace flexframe::sim
