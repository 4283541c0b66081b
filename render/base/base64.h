// Bytes as text (RFC 4648, section 4), for files that hold other files.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace flexframe::render {

std::string base64(std::span<const std::uint8_t> bytes);

}  // namespace flexframe::render
