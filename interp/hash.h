// A 128-bit fingerprint of bytes, to tell whether inputs have changed; not for secrets.
// Two lanes of multiply-xorshift mixing (constants of Steele, Lea, Flood: Fast splittable pseudorandom number generators, 2014).
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace flexframe::interp {

class Hash {
 public:
  void add_bytes(const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    add_word(size);
    for (; size >= 8; bytes += 8, size -= 8) {
      std::uint64_t word;
      std::memcpy(&word, bytes, 8);
      add_word(word);
    }
    std::uint64_t rest = 0;
    // An empty span may have no address.
    if (size > 0) std::memcpy(&rest, bytes, size);
    add_word(rest);
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

  std::array<std::uint64_t, 2> words() const { return {mix(a_), mix(b_ ^ a_)}; }
  std::string hex() const {
    constexpr const char* digits = "0123456789abcdef";
    std::string out;
    for (const std::uint64_t lane : words())
      for (int shift = 60; shift >= 0; shift -= 4) out += digits[(lane >> shift) & 15];
    return out;
  }

 private:
  static std::uint64_t mix(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
  }
  void add_word(std::uint64_t word) {
    a_ = (a_ ^ word) * 0xbf58476d1ce4e5b9u;
    a_ ^= a_ >> 32;
    b_ = (b_ + word) * 0x94d049bb133111ebu;
    b_ ^= b_ >> 29;
  }
  std::uint64_t a_ = 0x9e3779b97f4a7c15u, b_ = 0xd1b54a32d192ed03u;
};

}  // namespace flexframe::interp
