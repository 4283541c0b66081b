// sRGB and linear light (IEC 61966-2-1), and tables that make the way back and forth fast.
#pragma once

#include <glm/glm.hpp>

#include <array>
#include <cstdint>

namespace flexframe::render {

float linear_from_srgb(float s);
float srgb_from_linear(float l);
glm::vec3 linear_from_srgb(const glm::vec3& s);
glm::vec3 srgb_from_linear(const glm::vec3& l);

// Linear light of each sRGB byte, scaled to 0..16383: the sum of four fits 16 bits.
const std::array<std::uint16_t, 256>& linear_table();

// The same of bytes that are square roots of linear light, and these bytes as sRGB: as the drawing stores its samples.
const std::array<std::uint16_t, 256>& root_table();
const std::array<std::uint8_t, 256>& srgb_of_root_table();

// sRGB byte of a linear value 0..65535 (four entries of linear_table summed: 65532 is white).
const std::array<std::uint8_t, 65536>& srgb_table();

// Nearest whole number of 0 <= x <= 2^22, halves up: an entry of a table, a byte. std::lround is a call of a function for every pixel.
template <class T>
constexpr int rounded(T x) {
  return static_cast<int>(2 * x + 1) >> 1;
}

}  // namespace flexframe::render
