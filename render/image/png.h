// PNG files, written whole or not at all, the same bytes for the same pixels.
//
// Writing: no filter (16 bits: SUB) on every row, libdeflate, an sRGB chunk; no time stamps. The file is written under a temporary name
// in its folder and renamed when complete, so a reader never sees half a file under the final name; on failure the
// temporary file is removed. Reading: any PNG (and only PNG), with 8 bits, or 16 where the file has them.
// Errors are FileError with the path and the system's reason.
// Source: Portable Network Graphics Specification, Third Edition, W3C 2023.
#pragma once

#include "render/base/file.h"
#include "render/image/image.h"

#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace flexframe::render {

struct PngOptions {
  int level = 1;                                          // libdeflate level 1 (fast) .. 12
  bool linear = false;                                    // 16 bits: linear light (gAMA 1), else numbers without a meaning for the eye
  double dpi = 0.0;                                       // pixels an inch, for print (pHYs); 0: not said
  std::vector<std::pair<std::string, std::string>> text;  // tEXt chunks: keyword (1..79 Latin-1 characters), text
};

// The bytes of a PNG file.
std::vector<std::uint8_t> encode_png(const Image& image, const PngOptions& options = {});
std::vector<std::uint8_t> encode_png(const Image16& image, const PngOptions& options = {});

// The same into a file, whole or not at all. Throws FileError.
void write_png(const std::filesystem::path& path, const Image& image, const PngOptions& options = {});
void write_png(const std::filesystem::path& path, const Image16& image, const PngOptions& options = {});

// Pixels with 3 or 4 channels (grey becomes RGB). Sizes above 1 gigapixel are refused.
Image read_png(const std::filesystem::path& path);
Image decode_png(std::span<const std::uint8_t> bytes, const std::string& name);
// With the channels of the file (grey 1) or as many as asked for, 16 bits each; pictures of 8 bits are widened (255 becomes 65535).
Image16 decode_png16(std::span<const std::uint8_t> bytes, const std::string& name, int channels = 0);
// Bits a channel that the header names, 0 if there is none.
int png_depth(std::span<const std::uint8_t> bytes);

// True if the file is a complete PNG: signature, every chunk with its right checksum, IEND at the very end.
bool is_whole_png(const std::filesystem::path& path);

// The tEXt chunk of this keyword, empty if there is none.
std::string read_png_text(const std::filesystem::path& path, const std::string& keyword);
std::string find_png_text(std::span<const std::uint8_t> bytes, const std::string& keyword);

}  // namespace flexframe::render
