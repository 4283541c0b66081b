// Compression by libdeflate: the same bytes for the same bytes, no name and no time inside.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace flexframe::render {

enum class Container { zlib, gzip };  // RFC 1950, RFC 1952

// level: libdeflate's, 1 (fast) .. 12. Throws std::bad_alloc.
std::vector<std::uint8_t> compress(std::span<const std::uint8_t> bytes, Container container, int level);

// Unpacks a zlib stream (RFC 1950) that fills `out`. False: it is damaged, or of another size.
bool decompress_zlib(std::span<const std::uint8_t> packed, std::span<std::uint8_t> out);

// CRC-32 of RFC 1952, as PNG's chunks carry it.
std::uint32_t crc32(std::span<const std::uint8_t> bytes);

}  // namespace flexframe::render
