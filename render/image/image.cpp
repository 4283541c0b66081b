#include "render/image/image.h"

#include "render/base/srgb.h"
#include "sim/base/error.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace flexframe::render {

Image make_image(int width, int height, int channels, std::uint8_t value) {
  if (width < 1 || height < 1 || (channels != 1 && channels != 3 && channels != 4))
    throw ArgumentError("an image of " + std::to_string(width) + " x " + std::to_string(height) + " with " + std::to_string(channels) +
                        " channels; sizes from 1 and 1, 3 or 4 channels are allowed");
  return {width, height, channels, std::vector<std::uint8_t>(std::size_t(width) * height * channels, value)};
}

Image reduce_image(const Image& image, int width, int height) {
  const double scale = std::min({1.0, double(width) / image.width, double(height) / image.height});
  const int w = std::max(1, static_cast<int>(std::lround(image.width * scale)));
  const int h = std::max(1, static_cast<int>(std::lround(image.height * scale)));
  if (w == image.width && h == image.height) return image;
  Image out = make_image(w, h, image.channels);
  const auto& linear = linear_table();
  const auto& srgb = srgb_table();
  const int alpha = image.channels == 4 ? 3 : -1;
  for (int y = 0; y < h; ++y) {
    // Rows and columns of the source that fall on this pixel, with the shares of the outer ones.
    const double y0 = double(y) * image.height / h, y1 = double(y + 1) * image.height / h;
    for (int x = 0; x < w; ++x) {
      const double x0 = double(x) * image.width / w, x1 = double(x + 1) * image.width / w;
      double sum[4] = {}, weight = 0.0, cover = 0.0;
      for (int j = static_cast<int>(y0); j < std::min<double>(image.height, std::ceil(y1)); ++j) {
        const double wy = std::min<double>(y1, j + 1) - std::max<double>(y0, j);
        for (int i = static_cast<int>(x0); i < std::min<double>(image.width, std::ceil(x1)); ++i) {
          const double share = wy * (std::min<double>(x1, i + 1) - std::max<double>(x0, i));
          const std::uint8_t* p = &image.pixels[(std::size_t(j) * image.width + i) * image.channels];
          const double a = alpha >= 0 ? p[alpha] / 255.0 : 1.0;
          for (int k = 0; k < std::min(3, image.channels); ++k) sum[k] += share * a * linear[p[k]];
          cover += share * a;
          weight += share;
        }
      }
      std::uint8_t* q = &out.pixels[(std::size_t(y) * w + x) * out.channels];
      for (int k = 0; k < std::min(3, image.channels); ++k) q[k] = cover > 0.0 ? srgb[std::min(65535, rounded(4.0 * sum[k] / cover))] : 0;
      if (alpha >= 0) q[alpha] = static_cast<std::uint8_t>(rounded(255.0 * cover / weight));
    }
  }
  return out;
}

Image contact_sheet(const std::vector<Image>& images, int columns, int gap) {
  if (images.empty()) throw ArgumentError("a contact sheet of no pictures");
  const Image& first = images.front();
  for (const Image& image : images)
    if (image.width != first.width || image.height != first.height || image.channels != first.channels)
      throw ArgumentError("a contact sheet needs pictures of one size");
  const int n = static_cast<int>(images.size());
  // Near square as a whole: columns * width about rows * height.
  if (columns <= 0) columns = std::max(1, static_cast<int>(std::lround(std::sqrt(double(n) * first.height / first.width))));
  columns = std::min(columns, n);
  const int rows = (n + columns - 1) / columns;
  Image sheet = make_image(columns * (first.width + gap) + gap, rows * (first.height + gap) + gap, first.channels, 255);
  for (int i = 0; i < n; ++i) {
    const int x0 = gap + (i % columns) * (first.width + gap), y0 = gap + (i / columns) * (first.height + gap);
    const std::size_t row = std::size_t(first.width) * first.channels;
    for (int y = 0; y < first.height; ++y)
      std::copy_n(&images[i].pixels[y * row], row, &sheet.pixels[(std::size_t(y0 + y) * sheet.width + x0) * sheet.channels]);
  }
  return sheet;
}

}  // namespace flexframe::render
