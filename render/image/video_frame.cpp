#include "render/image/video_frame.h"

#include "sim/base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string_view>

namespace flexframe::render {
namespace {

// Weights of BT.709 times 2^16; the differences B - Y and R - Y reach 0.9278 and 0.7874 of the range on either side.
constexpr int bits = 16, half = 1 << (bits - 1);
constexpr int red = 13933, green = 46871, blue = 4732;  // sum: 2^16
constexpr double blue_reach = 2.0 * (1.0 - 0.0722), red_reach = 2.0 * (1.0 - 0.2126);

// One row of pixels as three bytes each, over white, `width` of them; beyond the picture's last its colour again.
void take_row(const Image& image, int y, int width, std::uint8_t* out) {
  const std::uint8_t* in = &image.pixels[std::size_t(std::min(y, image.height - 1)) * image.width * image.channels];
  for (int x = 0; x < image.width; ++x, in += image.channels, out += 3) {
    if (image.channels == 1) std::fill_n(out, 3, in[0]);
    else if (image.channels == 3) std::copy_n(in, 3, out);
    else
      for (int k = 0; k < 3; ++k) out[k] = static_cast<std::uint8_t>((in[k] * in[3] + 255 * (255 - in[3]) + 127) / 255);
  }
  for (int x = image.width; x < width; ++x, out += 3) std::copy_n(out - 3, 3, out);
}

void put_luma(const std::uint8_t* rgb, int width, std::uint8_t* out) {
  for (int x = 0; x < width; ++x, rgb += 3)
    out[x] = static_cast<std::uint8_t>((red * rgb[0] + green * rgb[1] + blue * rgb[2] + half) >> bits);
}

std::uint8_t difference(int color, int luma, int factor) {
  return static_cast<std::uint8_t>(std::clamp(128 + ((factor * (color - luma) + (1 << 22)) >> 23), 0, 255));
}

// Two rows to one of each difference: a quarter, a half and a quarter of three columns around every second one.
void put_differences(const std::uint8_t* above, const std::uint8_t* below, int width, std::uint8_t* cb, std::uint8_t* cr) {
  // Sums of eight pixels' bytes times 2^20 / reach: 23 bits to take off.
  static const int to_blue = static_cast<int>(std::lround((1 << 20) / blue_reach)),
                   to_red = static_cast<int>(std::lround((1 << 20) / red_reach));
  for (int x = 0; x < width; x += 2) {
    int sum[3];
    for (int k = 0; k < 3; ++k) {
      const auto column = [&](int at) { return above[3 * at + k] + below[3 * at + k]; };
      sum[k] = column(std::max(0, x - 1)) + 2 * column(x) + column(x + 1);
    }
    const int luma = (red * sum[0] + green * sum[1] + blue * sum[2] + half) >> bits;
    *cb++ = difference(sum[2], luma, to_blue);
    *cr++ = difference(sum[0], luma, to_red);
  }
}

int even(int n) { return n + (n & 1); }

}  // namespace

std::string video_stream_head(int width, int height, double frame_rate) {
  if (width < 1 || height < 1 || !(frame_rate > 0.0) || frame_rate > 1000.0)
    throw ArgumentError(fmt::format("no video has {} x {} pixels at {:g} pictures a second", width, height, frame_rate));
  // To a millionth of a picture a second.
  const long millions = std::max(1L, std::lround(1e6 * frame_rate)), common = std::gcd(millions, 1000000L);
  return fmt::format("YUV4MPEG2 W{} H{} F{}:{} Ip A1:1 C420mpeg2 XCOLORRANGE=FULL\n", even(width), even(height), millions / common,
                     1000000L / common);
}

void append_video_frame(const Image& image, std::vector<std::uint8_t>& stream) {
  if (image.width < 1 || image.height < 1) throw ArgumentError("an empty picture is no picture of a video");
  const int width = even(image.width), height = even(image.height);
  constexpr std::string_view mark = "FRAME\n";
  stream.insert(stream.end(), mark.begin(), mark.end());
  const std::size_t start = stream.size(), pixels = std::size_t(width) * height;
  stream.resize(start + pixels + pixels / 2);
  std::uint8_t *luma = &stream[start], *cb = luma + pixels, *cr = cb + pixels / 4;
  std::vector<std::uint8_t> above(std::size_t(3) * width), below(above.size());
  for (int y = 0; y < height; y += 2) {
    take_row(image, y, width, above.data());
    take_row(image, y + 1, width, below.data());
    put_luma(above.data(), width, luma + std::size_t(y) * width);
    put_luma(below.data(), width, luma + std::size_t(y + 1) * width);
    put_differences(above.data(), below.data(), width, cb, cr);
    cb += width / 2;
    cr += width / 2;
  }
}

}  // namespace flexframe::render
