// Memory for arrays that are swept from end to end: starts on a cache line, and blocks of megabytes lie on huge pages where the
// system gives them (Linux), so that address translation does not bound the sweep.
#pragma once

#include <cstdlib>
#include <limits>
#include <new>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace flexframe::interp {

template <typename T>
struct LargeAllocator {
  using value_type = T;
  LargeAllocator() = default;
  // Of another type: allocators have no state.
  template <typename U>
  LargeAllocator(const LargeAllocator<U>& /*other*/) {}

  // Memory for n objects; throws std::bad_alloc.
  T* allocate(std::size_t n) {
    constexpr std::size_t line = 64, huge_page = std::size_t{1} << 21;
    if (n > std::numeric_limits<std::size_t>::max() / sizeof(T) - huge_page) throw std::bad_alloc();
    const std::size_t bytes = n * sizeof(T), unit = bytes >= huge_page ? huge_page : line;
    void* memory = std::aligned_alloc(unit, (bytes + unit - 1) / unit * unit);
    if (!memory) throw std::bad_alloc();
#if defined(__linux__)
    if (unit == huge_page) madvise(memory, bytes, MADV_HUGEPAGE);  // a wish: refused, it is plain memory
#endif
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t /*n*/) { std::free(memory); }
  bool operator==(const LargeAllocator& /*other*/) const { return true; }
};

template <typename T>
using LargeVector = std::vector<T, LargeAllocator<T>>;

}  // namespace flexframe::interp
