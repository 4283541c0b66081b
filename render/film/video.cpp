#include "render/film/video.h"

#include <fmt/format.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace flexframe::film {
namespace {

// The program in PATH, or empty.
std::string find_program(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::string candidate = (folder.empty() ? "." : folder) + "/" + name;
    if (::access(candidate.c_str(), X_OK) == 0) return candidate;
  }
  return {};
}

// A running program; killed when the scope is left early.
struct Process {
  pid_t pid = -1;
  int output = -1;
  Process() = default;
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process() {
    if (pid > 0) {
      ::kill(pid, SIGKILL);
      while (::waitpid(pid, nullptr, 0) < 0 && errno == EINTR) {}
    }
    if (output >= 0) ::close(output);
  }
};

// A file that is removed when it has not been given its final name.
struct Unfinished {
  std::filesystem::path path;
  ~Unfinished() {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
};

}  // namespace

VideoReport make_video(const std::filesystem::path& folder, int first, int count, double frame_rate, const std::filesystem::path& path,
                       const std::function<void()>& wait) {
  VideoReport report;
  const std::string program = find_program("ffmpeg");
  if (program.empty()) {
    report.note = "no video: the program ffmpeg is not installed";
    return report;
  }
  const bool gif = path.extension() == ".gif", apng = path.extension() == ".apng" || path.extension() == ".png";
  const Unfinished file{path.parent_path() / ("." + path.stem().string() + ".unfinished" + path.extension().string())};

  // No shell, no interaction; the picture's sides are made even for the codec, the file carries no dates.
  std::vector<std::string> words = {program, "-nostdin", "-hide_banner", "-loglevel", "error", "-y", "-framerate", fmt::format("{:.9g}", frame_rate),
                                    "-start_number", std::to_string(first), "-i", (folder / "frame_%05d.png").string(), "-frames:v", std::to_string(count)};
  if (gif) words.insert(words.end(), {"-vf", "split[a][b];[a]palettegen[p];[b][p]paletteuse"});
  else if (apng) words.insert(words.end(), {"-f", "apng", "-plays", "0", "-pred", "sub"});
  else words.insert(words.end(), {"-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", "libx264", "-preset", "fast", "-crf", "18", "-pix_fmt", "yuv420p", "-movflags", "+faststart"});
  words.insert(words.end(), {"-map_metadata", "-1", "-fflags", "+bitexact", "-flags:v", "+bitexact", file.path.string()});

  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) {
    report.note = fmt::format("no video: {}", std::strerror(errno));
    return report;
  }
  Process process;
  process.output = ends[0];
  process.pid = ::fork();
  if (process.pid == 0) {
    // The child owns a new group, so that the user's ctrl-C reaches it by way of us.
    ::setpgid(0, 0);
    const int null = ::open("/dev/null", O_RDWR);
    ::dup2(null, STDIN_FILENO);
    ::dup2(null, STDOUT_FILENO);
    ::dup2(ends[1], STDERR_FILENO);
    ::execv(program.c_str(), arguments.data());
    ::_exit(127);
  }
  ::close(ends[1]);
  if (process.pid < 0) {
    report.note = fmt::format("no video: cannot start ffmpeg: {}", std::strerror(errno));
    return report;
  }

  // Its complaints, until it closes them.
  std::string complaint;
  for (;;) {
    pollfd poll_end{.fd = process.output, .events = POLLIN, .revents = 0};
    const int ready = ::poll(&poll_end, 1, 200);
    if (wait) wait();
    if (ready <= 0) continue;
    char text[512];
    const ssize_t got = ::read(process.output, text, sizeof text);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    if (complaint.size() < 4096) complaint.append(text, static_cast<size_t>(got));
  }
  int status = 0;
  rusage usage{};
  while (::wait4(process.pid, &status, 0, &usage) < 0 && errno == EINTR) {}
  process.pid = -1;
  const auto seconds = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  report.cpu_seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  std::error_code error;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) std::filesystem::rename(file.path, path, error);
  else error = std::make_error_code(std::errc::io_error);
  if (error) {
    if (const size_t line = complaint.find('\n'); line != std::string::npos) complaint.resize(line);
    report.note = fmt::format("no video: ffmpeg failed: {}", complaint.empty() ? error.message() : complaint);
    return report;
  }
  report.made = true;
  return report;
}

}  // namespace flexframe::film
