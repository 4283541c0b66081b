#include "render/base/srgb.h"

#include <algorithm>
#include <cmath>

namespace flexframe::render {

float linear_from_srgb(float s) { return s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f); }

float srgb_from_linear(float l) { return l <= 0.0031308f ? 12.92f * l : 1.055f * std::pow(l, 1.0f / 2.4f) - 0.055f; }

glm::vec3 linear_from_srgb(const glm::vec3& s) { return {linear_from_srgb(s.x), linear_from_srgb(s.y), linear_from_srgb(s.z)}; }
glm::vec3 srgb_from_linear(const glm::vec3& l) { return {srgb_from_linear(l.x), srgb_from_linear(l.y), srgb_from_linear(l.z)}; }

const std::array<std::uint16_t, 256>& linear_table() {
  static const auto table = [] {
    std::array<std::uint16_t, 256> t{};
    for (int i = 0; i < 256; ++i)
      t[i] = static_cast<std::uint16_t>(std::lround(linear_from_srgb(static_cast<float>(i) / 255.0f) * 16383.0f));
    return t;
  }();
  return table;
}

const std::array<std::uint16_t, 256>& root_table() {
  static const auto table = [] {
    std::array<std::uint16_t, 256> t{};
    for (int i = 0; i < 256; ++i) t[i] = static_cast<std::uint16_t>(std::lround(i * i * (16383.0 / (255.0 * 255.0))));
    return t;
  }();
  return table;
}

const std::array<std::uint8_t, 256>& srgb_of_root_table() {
  static const auto table = [] {
    std::array<std::uint8_t, 256> t{};
    for (int i = 0; i < 256; ++i) {
      const float root = static_cast<float>(i) / 255.0f;
      t[i] = static_cast<std::uint8_t>(std::lround(srgb_from_linear(root * root) * 255.0f));
    }
    return t;
  }();
  return table;
}

const std::array<std::uint8_t, 65536>& srgb_table() {
  static const auto table = [] {
    std::array<std::uint8_t, 65536> t{};
    for (int i = 0; i < 65536; ++i) {
      const float linear = std::min(1.0f, static_cast<float>(i) / 65532.0f);
      t[i] = static_cast<std::uint8_t>(std::lround(srgb_from_linear(linear) * 255.0f));
    }
    return t;
  }();
  return table;
}

}  // namespace flexframe::render
