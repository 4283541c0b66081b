#include "render/base/deflate.h"

#include <libdeflate.h>

#include <algorithm>
#include <memory>
#include <new>

namespace flexframe::render {

std::vector<std::uint8_t> compress(std::span<const std::uint8_t> bytes, Container container, int level) {
  const bool zlib = container == Container::zlib;
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(std::clamp(level, 1, 12)), &libdeflate_free_compressor);
  if (!compressor) throw std::bad_alloc();
  const std::size_t bound = (zlib ? libdeflate_zlib_compress_bound : libdeflate_gzip_compress_bound)(compressor.get(), bytes.size());
  std::vector<std::uint8_t> packed(bound);
  const auto pack = zlib ? libdeflate_zlib_compress : libdeflate_gzip_compress;
  packed.resize(pack(compressor.get(), bytes.data(), bytes.size(), packed.data(), packed.size()));
  return packed;
}

bool decompress_zlib(std::span<const std::uint8_t> packed, std::span<std::uint8_t> out) {
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> decompressor(libdeflate_alloc_decompressor(),
                                                                                                       &libdeflate_free_decompressor);
  if (!decompressor) throw std::bad_alloc();
  return libdeflate_zlib_decompress(decompressor.get(), packed.data(), packed.size(), out.data(), out.size(), nullptr) ==
         LIBDEFLATE_SUCCESS;
}

std::uint32_t crc32(std::span<const std::uint8_t> bytes) { return libdeflate_crc32(0, bytes.data(), bytes.size()); }

}  // namespace flexframe::render
