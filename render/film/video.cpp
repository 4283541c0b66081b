#include "render/film/video.h"

#include "render/base/file.h"
#include "render/image/png.h"
#include "render/image/video_frame.h"
#include "sim/base/error.h"
#include "sim/base/plain_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <deque>
#include <mutex>
#include <optional>
#include <sstream>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
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
    std::string candidate = (folder.empty() ? "." : folder) + "/" + name;
    if (::access(candidate.c_str(), X_OK) == 0) return candidate;
  }
  return {};
}

std::string ending_of(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) c = sim::plain_lower(c);
  return ending;
}

// What ffmpeg is asked for: the film, or first the colours of one that has only 256 of them.
enum class Pass { film, palette };

void close_end(int& fd) {
  if (fd >= 0) ::close(fd);
  fd = -1;
}

}  // namespace

const std::vector<std::string>& video_endings() {
  static const std::vector<std::string> endings = {".mp4", ".gif", ".apng", ".png"};
  return endings;
}

bool is_video_name(const std::filesystem::path& path) {
  return std::find(video_endings().begin(), video_endings().end(), ending_of(path)) != video_endings().end();
}

struct VideoWriter::Impl {
  std::filesystem::path path, unfinished, palette;
  double frame_rate = 30.0;
  std::string note;                          // of the start
  std::vector<std::filesystem::path> again;  // pictures of a GIF, which are read twice
  pid_t pid = -1;
  int input = -1, complaints = -1;  // ends of ffmpeg's stdin and stderr

  // Shared with the thread that feeds.
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<std::filesystem::path> queue;
  bool ended = false, done = false;
  std::string complaint;     // of ffmpeg or about the pictures, once done
  bool broken = false;       // a picture could not be read, once done
  double fed_seconds = 0.0;  // CPU of the thread, once done
  std::thread thread;
  int width = 0, height = 0;  // px, of the first picture of a raw stream

  bool is_gif() const { return ending_of(path) == ".gif"; }
  // Pictures go over unpacked: to have ffmpeg read PNG files and turn them into luma and colours takes longer than to encode them.
  bool raw() const { return ending_of(path) == ".mp4"; }
  std::vector<std::uint8_t> bytes_of(const std::filesystem::path& picture);     // as ffmpeg gets them
  std::vector<std::string> words(const std::string& program, Pass pass) const;  // of ffmpeg's command
  void start(Pass pass);
  void feed();
  void run_feeder();
  bool wait_for_end(const std::function<void()>& wait, VideoReport& report);
  void remove_unfinished();
  void stop();
};

namespace {
std::filesystem::path unfinished_name(const std::filesystem::path& path) {
  return path.parent_path() / ("." + path.stem().string() + ".unfinished" + path.extension().string());
}
std::filesystem::path palette_name(const std::filesystem::path& path) {
  return path.parent_path() / ("." + path.stem().string() + ".palette.png");
}
}  // namespace

void remove_unfinished_video(const std::filesystem::path& path) {
  std::error_code ignored;
  std::filesystem::remove(unfinished_name(path), ignored);
  std::filesystem::remove(palette_name(path), ignored);
}

// No shell, no interaction, nothing but errors said; the file carries no dates.
std::vector<std::string> VideoWriter::Impl::words(const std::string& program, Pass pass) const {
  const std::string ending = ending_of(path), colors = std::filesystem::absolute(palette).string(),
                    file = pass == Pass::palette ? colors : std::filesystem::absolute(unfinished).string();
  std::vector<std::string> out = {program, "-nostdin", "-hide_banner", "-loglevel", "error", "-y"};
  const auto add = [&](std::initializer_list<std::string> more) { out.insert(out.end(), more); };
  if (raw()) add({"-f", "yuv4mpegpipe", "-i", "pipe:0"});
  else add({"-f", "image2pipe", "-c:v", "png", "-framerate", fmt::format("{:.9g}", frame_rate), "-i", "pipe:0"});
  // Players slow down pictures of a GIF that last less than two hundredths of a second.
  const std::string slow = frame_rate > 50.0 ? "fps=50," : "";
  if (pass == Pass::palette) add({"-vf", "palettegen", "-frames:v", "1", "-c:v", "png", "-f", "image2pipe"});
  else if (ending == ".gif")
    add({"-f", "png_pipe", "-i", colors, "-filter_complex", "[0:v]" + slow + "null[p];[p][1:v]paletteuse", "-f", "gif"});
  else if (ending == ".mp4") {
    // Colours go over as they are told to: by the matrix of ITU-R BT.709, which players assume of pictures of 720 rows and more, and with
    // all 256 levels, of which Chromium without a graphics card shows each within 1. Of the 220 that films of cinema have it shows blue up
    // to 10 levels off: its factor for blue would be 2.11 and is stored as 2.
    add({"-c:v", "libx264", "-preset", "fast", "-crf", "18", "-pix_fmt", "yuv420p"});
    add({"-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "pc", "-movflags", "+faststart", "-f",
         "mp4"});
  } else {
    add({"-f", "apng", "-plays", "0", "-pred", "sub"});
  }
  add({"-map_metadata", "-1", "-fflags", "+bitexact", "-flags:v", "+bitexact", file});
  return out;
}

void VideoWriter::Impl::start(Pass pass) {
  const std::string program = find_program("ffmpeg");
  if (program.empty()) {
    note = "no video: the program ffmpeg is not installed (Debian package ffmpeg)";
    return;
  }
  std::vector<std::string> command = words(program, pass);
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (std::string& word : command) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  int in[2] = {-1, -1}, out[2] = {-1, -1};
  if (::pipe2(in, O_CLOEXEC) != 0 || ::pipe2(out, O_CLOEXEC) != 0) {
    note = fmt::format("no video: {}", std::strerror(errno));
    close_end(in[0]);
    close_end(in[1]);
    return;
  }
  const pid_t parent = ::getpid();
  pid = ::fork();
  if (pid == 0) {
    // A new group, so that the user's ctrl-C reaches ffmpeg by way of us; without us it has nothing to do.
    ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(1);
    const int null = ::open("/dev/null", O_RDWR);
    ::dup2(in[0], STDIN_FILENO);
    ::dup2(null, STDOUT_FILENO);
    ::dup2(out[1], STDERR_FILENO);
    ::execv(program.c_str(), arguments.data());
    ::_exit(127);
  }
  const int reason = errno;
  ::close(in[0]);
  ::close(out[1]);
  input = in[1];
  complaints = out[0];
  if (pid < 0) note = fmt::format("no video: cannot start ffmpeg: {}", std::strerror(reason));
  else ::fcntl(input, F_SETFL, O_NONBLOCK);
}

std::vector<std::uint8_t> VideoWriter::Impl::bytes_of(const std::filesystem::path& picture) {
  if (!raw()) return render::read_file(picture);
  const render::Image image = render::read_png(picture);
  std::string head;
  if (width == 0) {
    width = image.width;
    height = image.height;
    head = render::video_stream_head(width, height, frame_rate);
  }
  if (image.width != width || image.height != height)
    throw FileError(
        fmt::format("{} has {} x {} pixels, the pictures before {} x {}", picture.string(), image.width, image.height, width, height));
  std::vector<std::uint8_t> bytes(head.begin(), head.end());
  render::append_video_frame(image, bytes);
  return bytes;
}

// The life of the thread: pictures to ffmpeg, its complaints from it, until it has closed its end.
void VideoWriter::Impl::feed() {
  // An ffmpeg that is gone is an error of writing.
  sigset_t pipe_signal;
  sigemptyset(&pipe_signal);
  sigaddset(&pipe_signal, SIGPIPE);
  ::pthread_sigmask(SIG_BLOCK, &pipe_signal, nullptr);

  std::vector<std::uint8_t> bytes;
  std::size_t written = 0;
  std::string said;
  bool unread = false;
  for (;;) {
    if (written == bytes.size() && input >= 0) {
      std::optional<std::filesystem::path> next;
      {
        std::unique_lock lock(mutex);
        changed.wait_for(lock, std::chrono::milliseconds(100), [&] { return !queue.empty() || ended; });
        if (!queue.empty()) {
          next = std::move(queue.front());
          queue.pop_front();
        } else if (ended) {
          close_end(input);
        }
      }
      written = 0;
      bytes.clear();
      try {
        if (next) bytes = bytes_of(*next);
      } catch (const std::exception& e) {
        said = e.what();
        unread = true;
        close_end(input);
      }
    }
    pollfd ends[2] = {{.fd = complaints, .events = POLLIN, .revents = 0},
                      {.fd = written < bytes.size() ? input : -1, .events = POLLOUT, .revents = 0}};
    // While there is nothing to write, only a look.
    if (::poll(ends, 2, written < bytes.size() || input < 0 ? -1 : 0) < 0 && errno != EINTR) break;
    if (ends[1].revents != 0) {
      const ssize_t n = ::write(input, bytes.data() + written, bytes.size() - written);
      if (n > 0) written += n;
      else if (errno != EINTR && errno != EAGAIN) {
        close_end(input);
        written = bytes.size();
      }
    }
    if (ends[0].revents != 0) {
      char text[512];
      const ssize_t got = ::read(complaints, text, sizeof text);
      if (got == 0 || (got < 0 && errno != EINTR && errno != EAGAIN)) break;
      if (got > 0 && said.size() < 4096) said.append(text, static_cast<std::size_t>(got));
    }
  }
  close_end(input);
  timespec spent{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &spent);
  const std::lock_guard lock(mutex);
  fed_seconds = static_cast<double>(spent.tv_sec) + 1e-9 * static_cast<double>(spent.tv_nsec);
  complaint = said;
  broken = unread;
  done = true;
  changed.notify_all();
}

void VideoWriter::Impl::run_feeder() {
  thread = std::thread([this] { feed(); });
}

// Waits for the feeding thread and its ffmpeg; false, with the report's note, if it failed.
bool VideoWriter::Impl::wait_for_end(const std::function<void()>& wait, VideoReport& report) {
  {
    std::unique_lock lock(mutex);
    ended = true;
    changed.notify_all();
    while (!changed.wait_for(lock, std::chrono::milliseconds(200), [&] { return done; }))
      if (wait) {
        lock.unlock();
        wait();
        lock.lock();
      }
  }
  thread.join();
  int status = 0;
  rusage usage{};
  while (::wait4(pid, &status, 0, &usage) < 0 && errno == EINTR) {}
  pid = -1;
  close_end(complaints);
  const auto seconds = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  report.cpu_seconds += seconds(usage.ru_utime) + seconds(usage.ru_stime) + fed_seconds;
  // ffmpeg ends well on whatever it was given; without all the pictures it is no video of them.
  if (!broken && WIFEXITED(status) && WEXITSTATUS(status) == 0) return true;
  if (const std::size_t line = complaint.find('\n'); line != std::string::npos) complaint.resize(line);
  const std::string why = !complaint.empty()    ? complaint
                          : WIFSIGNALED(status) ? fmt::format("ended by signal {}", WTERMSIG(status))
                                                : fmt::format("exit code {}", WEXITSTATUS(status));
  report.note = fmt::format("no video: ffmpeg failed: {}", why);
  return false;
}

void VideoWriter::Impl::remove_unfinished() { remove_unfinished_video(path); }

void VideoWriter::Impl::stop() {
  if (pid > 0) ::kill(pid, SIGKILL);
  {
    const std::lock_guard lock(mutex);
    ended = true;
    queue.clear();
  }
  changed.notify_all();
  if (thread.joinable()) thread.join();
  if (pid > 0)
    while (::waitpid(pid, nullptr, 0) < 0 && errno == EINTR) {}
  pid = -1;
  close_end(input);
  close_end(complaints);
  remove_unfinished();
}

VideoWriter::VideoWriter(const std::filesystem::path& path, double frame_rate) : impl_(std::make_unique<Impl>()) {
  impl_->path = path;
  impl_->frame_rate = frame_rate;
  impl_->unfinished = unfinished_name(path);
  impl_->palette = palette_name(path);
  impl_->remove_unfinished();  // of a run that was killed, or a link that would lead the writing elsewhere
  impl_->start(impl_->is_gif() ? Pass::palette : Pass::film);
}

VideoWriter::~VideoWriter() { impl_->stop(); }

void VideoWriter::add(const std::filesystem::path& picture) {
  if (!impl_->note.empty()) return;
  // Not before: whoever draws forks, and a fork should find one thread only.
  if (!impl_->thread.joinable()) impl_->run_feeder();
  if (impl_->is_gif()) impl_->again.push_back(picture);
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->queue.push_back(picture);
  }
  impl_->changed.notify_all();
}

VideoReport VideoWriter::finish(const std::function<void()>& wait) {
  Impl& v = *impl_;
  VideoReport report;
  report.note = v.note;
  if (!v.note.empty()) return report;
  if (!v.thread.joinable()) {
    report.note = "no video: no pictures";
    return report;
  }
  bool good = v.wait_for_end(wait, report);
  if (good && v.is_gif()) {
    // Its 256 colours are known now; with one palette for all pictures what stands still costs nothing.
    v.queue.assign(v.again.begin(), v.again.end());
    v.done = false;
    v.start(Pass::film);
    report.note = v.note;
    if (!v.note.empty()) return report;
    v.run_feeder();
    good = v.wait_for_end(wait, report);
  }
  std::error_code error;
  if (good) std::filesystem::rename(v.unfinished, v.path, error);
  if (error) report.note = fmt::format("no video: {}: {}", v.path.string(), error.message());
  report.made = good && !error;
  v.remove_unfinished();
  return report;
}

}  // namespace flexframe::film
