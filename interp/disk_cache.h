// A folder of files that save work: what is not used is removed, oldest first.
#pragma once

#include <cstdint>
#include <filesystem>

namespace flexframe::interp {

struct CacheLimits {
  std::uintmax_t bytes = 1'000'000'000;  // of all files
  std::size_t files = 2000;              // so many are looked through in a few ms
};

// Marks a file as used now. No error where that is refused.
void mark_used(const std::filesystem::path& file);

// Removes those files of the ending (".modes") that were not used for longest until the rest is within the limits. Only files of this
// folder itself; no error where it cannot be read or changed.
void bound_cache(const std::filesystem::path& folder, const std::filesystem::path& ending, const CacheLimits& limits = {});

}  // namespace flexframe::interp
