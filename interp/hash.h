// A 128-bit fingerprint of bytes (XXH3, of the xxHash library), to tell whether inputs have changed; not for secrets.
#pragma once

// Only its functions are taken from the header: nothing to link.
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace flexframe::interp {

class Hash {
 public:
  Hash() { XXH3_128bits_reset(&state_); }

  // The size counts too: two texts of 3 and 2 bytes are not those of 2 and 3.
  void add_bytes(const void* data, std::size_t size) {
    const std::uint64_t length = size;
    XXH3_128bits_update(&state_, &length, sizeof length);
    // An empty span may have no address.
    if (size > 0) XXH3_128bits_update(&state_, data, size);
  }
  // Numbers, and structures without padding.
  template <class T>
  void add(const T& value) {
    static_assert(std::has_unique_object_representations_v<T> || std::is_floating_point_v<T>);
    add_bytes(&value, sizeof(T));
  }
  template <class T>
  void add_span(std::span<const T> values) {
    add_bytes(values.data(), values.size_bytes());
  }
  void add_text(std::string_view text) { add_bytes(text.data(), text.size()); }

  std::array<std::uint64_t, 2> words() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(&state_);
    return {hash.high64, hash.low64};
  }
  std::string hex() const {
    constexpr const char* digits = "0123456789abcdef";
    std::string out;
    for (const std::uint64_t word : words())
      for (int shift = 60; shift >= 0; shift -= 4) out += digits[(word >> shift) & 15];
    return out;
  }

 private:
  XXH3_state_t state_;
};

}  // namespace flexframe::interp
