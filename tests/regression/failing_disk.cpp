// Loaded before a program (LD_PRELOAD): FLEXFRAME_FAILING=NAME:BYTES makes reading of the files of that name fail behind so many bytes, as
// on a disk with bad blocks or a net that is gone.
#include <dlfcn.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <string>

extern "C" ssize_t read(int file, void* into, size_t bytes) {
  using Read = ssize_t (*)(int, void*, size_t);
  static const auto real = reinterpret_cast<Read>(dlsym(RTLD_NEXT, "read"));
  static const std::string asked = std::getenv("FLEXFRAME_FAILING") ? std::getenv("FLEXFRAME_FAILING") : "";
  const size_t colon = asked.rfind(':');
  char path[4096];
  const ssize_t length = readlink(("/proc/self/fd/" + std::to_string(file)).c_str(), path, sizeof path);
  const off_t at = lseek(file, 0, SEEK_CUR);
  if (colon == std::string::npos || length < 0 || at < 0) return real(file, into, bytes);
  if (!std::string(path, static_cast<size_t>(length)).ends_with("/" + asked.substr(0, colon))) return real(file, into, bytes);
  const off_t left = std::strtol(asked.c_str() + colon + 1, nullptr, 10) - at;
  if (left > 0) return real(file, into, std::min(bytes, static_cast<size_t>(left)));
  errno = EIO;
  return -1;
}
