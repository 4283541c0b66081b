// An accuracy asked for, as text: of pictures "0.5 px", "0.1 mm", of outputs "1e-3", "1 %".
#pragma once

#include "sim/scene/scene.h"

#include <optional>
#include <string_view>

namespace flexframe::sim {

// A number and "px" (or "pixel", "pixels"), or a number and a unit of length. None for a text that has no unit at its end: that is a
// number, or what stands for one. Throws InputError that continues "... must be": another unit, a number that is not above 0.
std::optional<PictureAccuracy> parse_picture_accuracy(std::string_view text);

// The share of the outputs' ranges, 1e-12 .. 0.5, that a text without a distance says. Throws InputError that continues "... must be".
double parse_share_of_ranges(std::string_view text);

}  // namespace flexframe::sim
