// The arrays of a page as one block of bytes, and numbers rounded for it.
#pragma once

#include "sim/base/error.h"

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>
#include <vector>

namespace flexframe::film {

static_assert(std::endian::native == std::endian::little, "the arrays of a page are little-endian");

constexpr size_t most_page_bytes = size_t{1} << 30;

// All arrays, one after another; each begins at a multiple of four bytes.
struct PageBlock {
  std::vector<std::uint8_t> bytes;

  template <class T>
  nlohmann::ordered_json add(const std::vector<T>& values) {
    const char* type = std::is_same_v<T, float>           ? "f4"
                       : std::is_same_v<T, std::uint32_t> ? "u4"
                       : std::is_same_v<T, std::int16_t>  ? "i2"
                       : std::is_same_v<T, std::uint16_t> ? "u2"
                       : std::is_same_v<T, std::int8_t>   ? "i1"
                                                          : "u1";
    const size_t at = (bytes.size() + 3) / 4 * 4, size = values.size() * sizeof(T);
    if (at + size > most_page_bytes)
      throw FileError("the sequence needs more than 1 GiB, which browsers do not take: draw fewer pictures a second or coarser meshes");
    bytes.resize(at + size);
    if (size > 0) std::memcpy(bytes.data() + at, values.data(), size);
    return {{"o", at}, {"n", values.size()}, {"t", type}};
  }
};

// Values as whole multiples of the returned step, the largest with the type's largest number.
template <class T>
float round_to(const std::vector<float>& values, std::vector<T>& out) {
  float largest = 0.0f;
  for (const float v : values) largest = std::max(largest, std::abs(v));
  constexpr float most = static_cast<float>(std::numeric_limits<T>::max());
  const float step = largest > 0.0f ? largest / most : 1.0f;
  for (const float v : values) out.push_back(static_cast<T>(std::lround(v / step)));
  return step;
}

// Weights with all shapes of one picture beside each other.
inline std::vector<float> by_picture(const Eigen::MatrixXf& weights) { return {weights.data(), weights.data() + weights.size()}; }

}  // namespace flexframe::film
