// libFuzzer entry: any bytes as a PNG file (render/image/png.h). Build and run: tests/fuzz/fuzz.sh png
#include "render/image/png.h"
#include "tests/fuzz/scratch.h"

#include <span>
#include <vector>

namespace {

std::uint32_t word(const std::uint8_t* p) {
  return std::uint32_t(p[0]) << 24 | std::uint32_t(p[1]) << 16 | std::uint32_t(p[2]) << 8 | p[3];
}

std::uint32_t checksum(const std::uint8_t* p, std::size_t n) {
  std::uint32_t c = 0xFFFFFFFFu;
  while (n-- > 0) {
    c ^= *p++;
    for (int k = 0; k < 8; ++k) c = c >> 1 ^ (c & 1u ? 0xEDB88320u : 0u);
  }
  return ~c;
}

// Mends the checksum of every chunk, so that mutations get past them.
std::vector<std::uint8_t> mended(const std::uint8_t* data, std::size_t size) {
  std::vector<std::uint8_t> out(data, data + size);
  for (std::size_t at = 8; at + 12 <= size;) {
    const std::size_t length = word(&out[at]);
    if (length > size - at - 12) break;
    const std::uint32_t c = checksum(&out[at + 4], length + 4);
    for (std::size_t k = 0; k < 4; ++k) out[at + 8 + length + k] = static_cast<std::uint8_t>(c >> (24 - 8 * k));
    at += 12 + length;
  }
  return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flexframe::render;
  try {
    const Image image = decode_png(mended(data, size), "fuzz.png");
    // What was read can be written and read again, pixel by pixel.
    if (image.width < 1 || image.height < 1 ||
        image.pixels.size() != std::size_t(image.width) * std::size_t(image.height) * std::size_t(image.channels))
      std::abort();
    if (image.pixels.size() < 1 << 20) {
      const Image again = decode_png(encode_png(image), "again.png");
      if (again.pixels != image.pixels) std::abort();
    }
  } catch (const std::runtime_error& e) {
    fuzz::require_answer(e.what(), "fuzz.png");
  }
  return 0;
}
