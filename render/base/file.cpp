#include "render/base/file.h"

#include "sim/base/error.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <string>

namespace flexframe::render {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const char* what, int reason) {
  throw FileError(path.string() + ": " + what + ": " + std::strerror(reason));
}

struct Descriptor {
  int fd = -1;
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
};

// 0 or the errno of the failure.
int write_all(int fd, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno;
    bytes = bytes.subspan(n);
  }
  return 0;
}

}  // namespace

void write_file(const std::filesystem::path& path, std::span<const std::uint8_t> bytes) {
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  static std::atomic<unsigned> counter{0};
  std::filesystem::path temporary =
      folder / ("." + path.filename().string() + "." + std::to_string(::getpid()) + "-" + std::to_string(counter++) + ".part");

  Descriptor file;
  bool named = false;
  file.fd = ::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
  if (file.fd < 0) {
    file.fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file.fd < 0) fail(path, "cannot write", errno);
    named = true;
  }
  if (const int reason = write_all(file.fd, bytes)) {
    if (named) ::unlink(temporary.c_str());
    fail(path, "cannot write", reason);
  }
  if (!named) {
    // A fresh name is linked directly; an existing one is replaced by way of a temporary link. That has one name for all
    // processes, so that the next writer of this file takes away what a kill between the calls leaves; should one writer
    // take away another's, that one links its own again.
    const std::string source = "/proc/self/fd/" + std::to_string(file.fd);
    if (::linkat(AT_FDCWD, source.c_str(), AT_FDCWD, path.c_str(), AT_SYMLINK_FOLLOW) == 0) return;
    if (errno != EEXIST) fail(path, "cannot write", errno);
    temporary = folder / ("." + path.filename().string() + ".part");
    for (int tries = 0;; ++tries) {
      ::unlink(temporary.c_str());
      if (::linkat(AT_FDCWD, source.c_str(), AT_FDCWD, temporary.c_str(), AT_SYMLINK_FOLLOW) == 0 &&
          ::rename(temporary.c_str(), path.c_str()) == 0)
        return;
      const int reason = errno;
      if ((reason == EEXIST || reason == ENOENT) && tries < 100) continue;
      ::unlink(temporary.c_str());
      fail(path, "cannot write", reason);
    }
  }
  // Some file systems report a full disk only on closing.
  const int closed = ::close(file.fd);
  file.fd = -1;
  if (closed != 0 || ::rename(temporary.c_str(), path.c_str()) != 0) {
    const int reason = errno;
    ::unlink(temporary.c_str());
    fail(path, "cannot write", reason);
  }
}

void remove_parts(const std::filesystem::path& folder, std::string_view start) {
  for (const std::filesystem::directory_entry& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("." + std::string(start)) || !name.ends_with(".part")) continue;
    // ".NAME.part" or ".NAME.PROCESS-COUNT.part"; what a living process (another shard) writes stays.
    const std::size_t dash = name.rfind('-'), dot = name.rfind('.', dash);
    pid_t process = 0;
    if (dash != std::string::npos && dot != std::string::npos &&
        std::from_chars(name.data() + dot + 1, name.data() + dash, process).ptr == name.data() + dash && process > 0 &&
        (::kill(process, 0) == 0 || errno == EPERM))
      continue;
    std::error_code gone;
    std::filesystem::remove(entry.path(), gone);
  }
}

std::vector<std::uint8_t> read_file(const std::filesystem::path& path) {
  Descriptor file;
  file.fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file.fd < 0) fail(path, "cannot read", errno);
  struct stat status {};
  if (::fstat(file.fd, &status) != 0) fail(path, "cannot read", errno);
  if (!S_ISREG(status.st_mode)) fail(path, "cannot read", S_ISDIR(status.st_mode) ? EISDIR : EINVAL);
  std::vector<std::uint8_t> bytes(status.st_size);
  std::size_t have = 0;
  while (have < bytes.size()) {
    const ssize_t n = ::read(file.fd, bytes.data() + have, bytes.size() - have);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(path, "cannot read", errno);
    if (n == 0) break;
    have += n;
  }
  bytes.resize(have);
  return bytes;
}

}  // namespace flexframe::render
