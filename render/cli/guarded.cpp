#include "render/cli/guarded.h"

#include "sim/base/error.h"

#include <fmt/format.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace flexframe::cli {

int guarded(std::span<const std::filesystem::path> files, const std::function<int()>& work) {
  double megabytes = 0.0;
  for (const std::filesystem::path& file : files) {
    std::error_code error;
    const auto size = std::filesystem::file_size(file, error);
    if (!error) megabytes += 1e-6 * static_cast<double>(size);
  }
  const auto seconds = static_cast<rlim_t>(20.0 + megabytes);
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error(fmt::format("cannot start a process: {}", std::strerror(errno)));
  if (child == 0) {
    const rlimit limit{.rlim_cur = seconds, .rlim_max = seconds + 5};
    ::setrlimit(RLIMIT_CPU, &limit);
    return work();
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0)
    if (errno != EINTR) throw std::runtime_error(fmt::format("cannot wait for a process: {}", std::strerror(errno)));
  if (WIFEXITED(status)) return WEXITSTATUS(status);
  const int signal = WTERMSIG(status);
  const std::string file = files.empty() ? "" : files.front().string();
  if (signal == SIGXCPU) throw InputError(fmt::format("{}: reading it took more than {} s and was given up: damaged?", file, seconds));
  throw InputError(fmt::format("{}: is damaged: the library that reads it failed ({})", file, ::strsignal(signal)));
}

}  // namespace flexframe::cli
