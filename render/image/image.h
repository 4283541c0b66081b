// Pictures in memory: rows from the top, channels interleaved, 8 bit sRGB or 16 bit linear.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace flexframe::render {

struct Image {
  int width = 0, height = 0;
  int channels = 3;                  // 1 grey, 3 RGB, 4 RGBA (straight alpha)
  std::vector<std::uint8_t> pixels;  // width * height * channels
  bool operator==(const Image&) const = default;
};

// 16 bit: depth or scalar pictures.
struct Image16 {
  int width = 0, height = 0;
  int channels = 1;
  std::vector<std::uint16_t> pixels;
  bool operator==(const Image16&) const = default;
};

// Empty image of one colour (all channels `value`). Throws ArgumentError for a size or channel count that is none.
Image make_image(int width, int height, int channels, std::uint8_t value = 0);

// Box-filtered reduction by whole pixels in linear light to at most width x height, keeping the aspect.
Image reduce_image(const Image& image, int width, int height);

// Pictures of equal size in a grid, `columns` wide (0: near square as a whole), with a gap of `gap` pixels of white.
Image contact_sheet(const std::vector<Image>& images, int columns = 0, int gap = 4);

}  // namespace flexframe::render
