#include "render/image/png.h"

#include "render/base/deflate.h"

#include "sim/base/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STBI_NO_STDIO
#define STBI_NO_HDR
#define STBI_NO_LINEAR
#define STBI_MAX_DIMENSIONS 65536
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wpedantic"
#include <stb_image.h>
#pragma GCC diagnostic pop

namespace flexframe::render {
namespace {

constexpr std::array<std::uint8_t, 8> signature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr std::size_t largest_picture = 1'000'000'000;  // pixels

void put32(std::vector<std::uint8_t>& out, std::uint32_t v) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<std::uint8_t>(v >> shift));
}

std::uint32_t get32(const std::uint8_t* p) {
  return std::uint32_t(p[0]) << 24 | std::uint32_t(p[1]) << 16 | std::uint32_t(p[2]) << 8 | p[3];
}

void put_chunk(std::vector<std::uint8_t>& out, const char* type, std::span<const std::uint8_t> data) {
  put32(out, static_cast<std::uint32_t>(data.size()));
  const std::size_t start = out.size();
  out.insert(out.end(), type, type + 4);
  out.insert(out.end(), data.begin(), data.end());
  put32(out, crc32({out.data() + start, data.size() + 4}));
}

// rows: bytes of the picture, big endian, top row first; step: bytes a pixel.
std::vector<std::uint8_t> encode(int width, int height, int channels, int depth, std::span<const std::uint8_t> rows,
                                 const PngOptions& options) {
  const std::size_t step = std::size_t(channels) * depth / 8, row = width * step;
  if (width < 1 || height < 1 || rows.size() != row * height)
    throw ArgumentError("an image to be written as PNG has " + std::to_string(rows.size()) + " bytes where " + std::to_string(width) +
                        " x " + std::to_string(height) + " needs " + std::to_string(row * height));
  // Pictures as they are: flat parts and noise of shading repeat byte by byte. Over the golden pictures and those of the examples SUB is
  // 11 % slower and 7 % larger, the best of SUB and UP for each row half as slow again. Numbers of 16 bits rise smoothly: SUB, each byte
  // less the one a pixel to the left.
  const bool subtract = depth == 16;
  std::vector<std::uint8_t> filtered((row + 1) * height);
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* in = &rows[y * row];
    std::uint8_t* out = &filtered[y * (row + 1)];
    *out++ = subtract ? 1 : 0;
    std::copy_n(in, subtract ? step : row, out);
    if (subtract)
      for (std::size_t i = step; i < row; ++i) out[i] = static_cast<std::uint8_t>(in[i] - in[i - step]);
  }

  std::vector<std::uint8_t> out(signature.begin(), signature.end());
  std::vector<std::uint8_t> header;
  put32(header, static_cast<std::uint32_t>(width));
  put32(header, static_cast<std::uint32_t>(height));
  const std::uint8_t color_type = channels == 1 ? 0 : channels == 3 ? 2 : 6;
  for (const std::uint8_t b : {static_cast<std::uint8_t>(depth), color_type, std::uint8_t(0), std::uint8_t(0), std::uint8_t(0)})
    header.push_back(b);
  put_chunk(out, "IHDR", header);
  if (depth == 8) put_chunk(out, "sRGB", std::array<std::uint8_t, 1>{0});
  // Gamma times 100000, big endian.
  if (options.linear) put_chunk(out, "gAMA", std::array<std::uint8_t, 4>{0x00, 0x01, 0x86, 0xa0});
  if (options.dpi > 0.0) {
    std::vector<std::uint8_t> physical;
    for (int k = 0; k < 2; ++k) put32(physical, static_cast<std::uint32_t>(std::lround(options.dpi / 0.0254)));  // a metre
    physical.push_back(1);
    put_chunk(out, "pHYs", physical);
  }
  for (const auto& [keyword, words] : options.text) {
    std::vector<std::uint8_t> text(keyword.begin(), keyword.end());
    text.push_back(0);
    text.insert(text.end(), words.begin(), words.end());
    put_chunk(out, "tEXt", text);
  }

  const std::vector<std::uint8_t> packed = compress(filtered, Container::zlib, options.level);
  // A chunk is at most 2^31 - 1 bytes long.
  constexpr std::size_t chunk = std::size_t(1) << 30;
  for (std::size_t at = 0; at < packed.size(); at += chunk)
    put_chunk(out, "IDAT", std::span(packed).subspan(at, std::min(chunk, packed.size() - at)));
  put_chunk(out, "IEND", {});
  return out;
}

// Calls visit(type, data) for every chunk; false if the bytes are not one whole PNG.
template <class Visit>
bool walk_chunks(std::span<const std::uint8_t> bytes, Visit visit) {
  if (bytes.size() < 8 || !std::equal(signature.begin(), signature.end(), bytes.begin())) return false;
  std::size_t at = 8;
  while (at + 12 <= bytes.size()) {
    const std::size_t length = get32(&bytes[at]);
    if (length > bytes.size() - at - 12) return false;
    if (crc32(bytes.subspan(at + 4, length + 4)) != get32(&bytes[at + 8 + length])) return false;
    const std::string type(reinterpret_cast<const char*>(&bytes[at + 4]), 4);
    visit(type, bytes.subspan(at + 8, length));
    at += 12 + length;
    if (type == "IEND") return at == bytes.size();
  }
  return false;
}

}  // namespace

std::vector<std::uint8_t> encode_png(const Image& image, const PngOptions& options) {
  return encode(image.width, image.height, image.channels, 8, image.pixels, options);
}

std::vector<std::uint8_t> encode_png(const Image16& image, const PngOptions& options) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(image.pixels.size() * 2);
  for (const std::uint16_t v : image.pixels) {
    bytes.push_back(static_cast<std::uint8_t>(v >> 8));
    bytes.push_back(static_cast<std::uint8_t>(v & 0xff));
  }
  return encode(image.width, image.height, image.channels, 16, bytes, options);
}

void write_png(const std::filesystem::path& path, const Image& image, const PngOptions& options) {
  write_file(path, encode_png(image, options));
}

void write_png(const std::filesystem::path& path, const Image16& image, const PngOptions& options) {
  write_file(path, encode_png(image, options));
}

namespace {

// The decoder's reason may quote bytes of the file.
std::string decoder_reason() {
  std::string reason = stbi_failure_reason();
  for (char& c : reason)
    if (c < ' ' || c > '~') c = '?';
  return reason;
}

}  // namespace

namespace {

// Throws for what is no whole, plausible PNG file. Returns the bytes to decode: the file's, or `filled` without empty parts.
std::span<const std::uint8_t> checked_png(std::span<const std::uint8_t> bytes, const std::string& name, std::vector<std::uint8_t>& filled) {
  const auto fail = [&](const std::string& what) { throw FileError(name + ": " + what); };
  if (bytes.size() < 8 || !std::equal(signature.begin(), signature.end(), bytes.begin())) fail("not a PNG file");
  // Checksums first: stb_image does not look at them, and a damaged picture must not pass for a different one.
  std::size_t pixels = 0, packed = 0;
  bool header_first = true, have_header = false, empty_parts = false;
  const bool whole = walk_chunks(bytes, [&](const std::string& type, std::span<const std::uint8_t> data) {
    if (!have_header && type != "IHDR") header_first = false;
    if (type == "IHDR" && data.size() == 13) {
      have_header = true;
      pixels = std::size_t(get32(&data[0])) * get32(&data[4]);
    }
    if (type == "IDAT") packed += data.size(), empty_parts = empty_parts || data.empty();
  });
  if (!whole) fail("damaged PNG file: cut off, or a checksum does not match");
  if (!have_header || !header_first) fail("damaged PNG file: no header");
  // Deflate packs at most 1032 to 1, so what is smaller than that cannot hold the picture (at 1 bit a pixel).
  if (pixels > largest_picture || pixels / 8 > packed * 1032 + 1024) fail("PNG file of an implausible size");
  if (bytes.size() > std::size_t(std::numeric_limits<int>::max())) fail("PNG file of more than 2 GB");

  // An empty IDAT is allowed and says nothing; stb_image copies it to a null pointer.
  if (empty_parts) {
    filled.assign(signature.begin(), signature.end());
    walk_chunks(bytes, [&](const std::string& type, std::span<const std::uint8_t> data) {
      if (type != "IDAT" || !data.empty()) filled.insert(filled.end(), data.data() - 8, data.data() + data.size() + 4);
    });
    bytes = filled;
  }
  return bytes;
}

}  // namespace

namespace {

// Of a, b and c that nearest to a + b - c (the specification's section 9.4).
std::uint8_t paeth(int a, int b, int c) {
  const int pa = std::abs(b - c), pb = std::abs(a - c), pc = std::abs(a + b - 2 * c);
  return static_cast<std::uint8_t>(pa <= pb && pa <= pc ? a : pb <= pc ? b : c);
}

// Takes the filter off a row; above: the row before, zeros for the first. False: no such filter.
bool unfilter(int filter, std::span<std::uint8_t> row, std::span<const std::uint8_t> above, std::size_t step) {
  if (filter > 4) return false;
  for (std::size_t i = 0; filter != 0 && i < row.size(); ++i) {
    const int left = i < step ? 0 : row[i - step], up = above[i], corner = i < step ? 0 : above[i - step];
    const int guess = filter == 1 ? left : filter == 2 ? up : filter == 3 ? (left + up) / 2 : paeth(left, up, corner);
    row[i] = static_cast<std::uint8_t>(row[i] + guess);
  }
  return true;
}

// Pictures as this program writes them (8 bits, RGB or RGBA, not interlaced); none for others and for damaged ones, of which the other
// reader tells. Why: libdeflate unpacks faster; `flexframe compare` of 8 pairs of 1280 x 720 takes 0.09 instead of 0.12 CPU s.
std::optional<Image> decode_plain(std::span<const std::uint8_t> bytes) {
  std::array<std::uint8_t, 13> header{};
  std::vector<std::uint8_t> packed;
  bool plain = true;
  walk_chunks(bytes, [&](const std::string& type, std::span<const std::uint8_t> data) {
    if (type == "IHDR" && data.size() == header.size()) std::copy(data.begin(), data.end(), header.begin());
    else if (type == "IDAT") packed.insert(packed.end(), data.begin(), data.end());
    else if (type == "tRNS") plain = false;
  });
  const std::uint32_t width = get32(header.data()), height = get32(&header[4]);
  const int channels = header[9] == 2 ? 3 : header[9] == 6 ? 4 : 0;
  if (!plain || channels == 0 || header[8] != 8 || header[10] != 0 || header[11] != 0 || header[12] != 0) return {};
  if (width < 1 || height < 1 || width > 65536 || height > 65536) return {};
  const std::size_t step = channels;
  const std::size_t row = width * step;
  std::vector<std::uint8_t> rows((row + 1) * height);
  if (!decompress_zlib(packed, rows)) return {};
  Image image{static_cast<int>(width), static_cast<int>(height), channels, std::vector<std::uint8_t>(row * height)};
  const std::vector<std::uint8_t> zeros(row, 0);
  for (std::size_t y = 0; y < height; ++y) {
    const std::uint8_t* in = &rows[y * (row + 1)];
    const std::span<std::uint8_t> out(&image.pixels[y * row], row);
    std::copy_n(in + 1, row, out.begin());
    const std::span<const std::uint8_t> above(y > 0 ? &image.pixels[(y - 1) * row] : zeros.data(), row);
    if (!unfilter(*in, out, above, step)) return {};
  }
  return image;
}

}  // namespace

Image decode_png(std::span<const std::uint8_t> bytes, const std::string& name) {
  std::vector<std::uint8_t> filled;
  bytes = checked_png(bytes, name, filled);
  if (std::optional<Image> image = decode_plain(bytes)) return *std::move(image);
  int width = 0, height = 0, channels = 0;
  const int size = static_cast<int>(bytes.size());
  if (!stbi_info_from_memory(bytes.data(), size, &width, &height, &channels))
    throw FileError(name + ": damaged PNG file: " + decoder_reason());
  // A colour that counts as transparent is no channel of the header.
  bool clear = channels == 2 || channels == 4;
  walk_chunks(bytes, [&](const std::string& type, std::span<const std::uint8_t>) { clear = clear || type == "tRNS"; });
  const int wanted = clear ? 4 : 3;
  const std::unique_ptr<stbi_uc, decltype(&stbi_image_free)> decoded(
      stbi_load_from_memory(bytes.data(), size, &width, &height, &channels, wanted), &stbi_image_free);
  if (!decoded) throw FileError(name + ": damaged PNG file: " + decoder_reason());
  Image image = make_image(width, height, wanted);
  std::copy_n(decoded.get(), image.pixels.size(), image.pixels.begin());
  return image;
}

Image16 decode_png16(std::span<const std::uint8_t> bytes, const std::string& name, int wanted) {
  std::vector<std::uint8_t> filled;
  bytes = checked_png(bytes, name, filled);
  int width = 0, height = 0, channels = 0;
  const std::unique_ptr<stbi_us, decltype(&stbi_image_free)> decoded(
      stbi_load_16_from_memory(bytes.data(), static_cast<int>(bytes.size()), &width, &height, &channels, wanted), &stbi_image_free);
  if (!decoded) throw FileError(name + ": damaged PNG file: " + decoder_reason());
  if (wanted > 0) channels = wanted;
  Image16 image{width, height, channels, {}};
  image.pixels.assign(decoded.get(), decoded.get() + std::size_t(width) * std::size_t(height) * std::size_t(channels));
  return image;
}

// The header is the first chunk: 8 bytes of signature, length and name, then width, height, depth.
int png_depth(std::span<const std::uint8_t> bytes) { return bytes.size() > 24 ? bytes[24] : 0; }

Image read_png(const std::filesystem::path& path) { return decode_png(read_file(path), path.string()); }

bool is_whole_png(const std::filesystem::path& path) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) return false;
  return walk_chunks(read_file(path), [](const std::string&, std::span<const std::uint8_t>) {});
}

std::string read_png_text(const std::filesystem::path& path, const std::string& keyword) { return find_png_text(read_file(path), keyword); }

std::string find_png_text(std::span<const std::uint8_t> bytes, const std::string& keyword) {
  std::string found;
  walk_chunks(bytes, [&](const std::string& type, std::span<const std::uint8_t> data) {
    if (type != "tEXt" || data.size() <= keyword.size() || data[keyword.size()] != 0) return;
    if (std::memcmp(data.data(), keyword.data(), keyword.size()) == 0)
      found.assign(data.begin() + static_cast<std::ptrdiff_t>(keyword.size()) + 1, data.end());
  });
  return found;
}

}  // namespace flexframe::render
