#include "interp/disk_cache.h"

#include <algorithm>
#include <vector>

namespace flexframe::interp {

namespace fs = std::filesystem;

void mark_used(const fs::path& file) {
  std::error_code error;
  fs::last_write_time(file, fs::file_time_type::clock::now(), error);
}

void bound_cache(const fs::path& folder, const fs::path& ending, const CacheLimits& limits) {
  struct Entry {
    fs::file_time_type used;
    std::uintmax_t bytes;
    fs::path path;
  };
  std::vector<Entry> entries;
  std::uintmax_t bytes = 0;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (at->path().extension() != ending) continue;
    std::error_code gone;
    const Entry entry{fs::last_write_time(at->path(), gone), fs::file_size(at->path(), gone), at->path()};
    if (gone) continue;
    bytes += entry.bytes;
    entries.push_back(entry);
  }
  if (bytes <= limits.bytes && entries.size() <= limits.files) return;
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.used < b.used; });
  std::size_t left = entries.size();
  for (const Entry& entry : entries) {
    if (bytes <= limits.bytes && left <= limits.files) return;
    if (fs::remove(entry.path, error)) {
      bytes -= entry.bytes;
      --left;
    }
  }
}

}  // namespace flexframe::interp
