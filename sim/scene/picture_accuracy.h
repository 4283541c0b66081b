// An accuracy asked of pictures, as text: "0.5 px", "0.1 mm".
#pragma once

#include "sim/scene/scene.h"

#include <optional>
#include <string_view>

namespace flexframe::sim {

// A number and "px" (or "pixel", "pixels"), or a number and a unit of length. None for a text that has no unit at its end: that is a
// number, or what stands for one. Throws InputError that continues "... must be": another unit, a number that is not above 0.
std::optional<PictureAccuracy> parse_picture_accuracy(std::string_view text);

}  // namespace flexframe::sim
