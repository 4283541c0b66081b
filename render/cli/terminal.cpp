#include "render/cli/terminal.h"

#include <fmt/format.h>

#include <fcntl.h>
#include <unistd.h>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <string_view>

namespace flexframe::cli {
namespace {

volatile std::sig_atomic_t asked_to_stop = 0;
Verbosity how_much = Verbosity::usual;

// Work that looks at the request leaves no unfinished files behind; a long equilibrium or factorisation may not look for minutes, and who
// asked (timeout, a queue) does not ask twice. Queues kill 30 s after they asked.
constexpr unsigned patience = 10;  // s

void note_signal(int) {
  asked_to_stop = 1;
  ::alarm(patience);
}

void stop_at_once(int) {
  constexpr std::string_view told = "flexframe: interrupted\n";
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, told.data(), told.size());
  ::_exit(130);
}

// What goes to a stderr that takes nothing (closed, its disk full) is lost; the work goes on.
ssize_t say_if_possible(void*, const char* text, std::size_t size) {
  for (std::size_t done = 0; done < size;) {
    const ssize_t written = ::write(STDERR_FILENO, text + done, size - done);
    if (written > 0) done += static_cast<std::size_t>(written);
    else if (written == 0 || errno != EINTR) break;
  }
  return static_cast<ssize_t>(size);
}

// Lines that begin with WARNING go to stderr, others nowhere.
ssize_t keep_warnings(void*, const char* text, std::size_t size) {
  static std::string line;
  for (const char c : std::string_view(text, size)) {
    line += c;
    if (c != '\n') continue;
    if (line.starts_with("WARNING")) fmt::print(stderr, "{}", line);
    line.clear();
  }
  return static_cast<ssize_t>(size);
}

}  // namespace

void silence_stdout() {
  std::fflush(stdout);
  cookie_io_functions_t functions{};
  functions.write = keep_warnings;
  if (FILE* silent = ::fopencookie(nullptr, "w", functions)) stdout = silent;
}

void set_verbosity(Verbosity verbosity) { how_much = verbosity; }
Verbosity verbosity() { return how_much; }

void secure_streams() {
  // A file that is opened must not get the number of a stream that was closed: messages would be written into it. Reading only: what is
  // written to a closed stdout stays an error.
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(stream, F_GETFD) < 0 && errno == EBADF) ::open("/dev/null", O_RDONLY);
  cookie_io_functions_t functions{};
  functions.write = say_if_possible;
  if (FILE* patient = ::fopencookie(nullptr, "w", functions)) {
    std::setvbuf(patient, nullptr, _IONBF, 0);
    stderr = patient;
  }
}

void watch_interrupts() {
  struct sigaction action {};
  action.sa_handler = note_signal;
  // A second signal ends the process at once: no run can be so stuck that it ignores the user.
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  std::signal(SIGALRM, stop_at_once);
  // A reader that went away (| head) is an error of the write, not the end of the process.
  std::signal(SIGPIPE, SIG_IGN);
}

bool interrupted() { return asked_to_stop != 0; }

void throw_if_interrupted() {
  if (interrupted()) throw Interrupted();
}

std::string duration_text(double seconds) {
  if (seconds < 9.95) return fmt::format("{:.1f} s", seconds);
  const long whole = std::lround(seconds);
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
  return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
}

Progress::Progress(std::string what)
    : what_(std::move(what)), terminal_(isatty(STDERR_FILENO) == 1), start_(std::chrono::steady_clock::now()), last_(start_) {}

Progress::~Progress() {
  clear();
  if (how_much == Verbosity::verbose)
    fmt::print(stderr, "{} took {}\n", what_,
               duration_text(std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count()));
}

void Progress::clear() {
  if (line_open_) fmt::print(stderr, "\r\033[K");
  line_open_ = false;
}

void Progress::show(double fraction) {
  throw_if_interrupted();
  if (how_much == Verbosity::quiet) return;
  fraction = std::isfinite(fraction) ? std::fmin(std::fmax(fraction, 0.0), 1.0) : 0.0;
  const auto now = std::chrono::steady_clock::now();
  const double spent = std::chrono::duration<double>(now - start_).count();
  // An estimate from less than a hundredth of the work or the first moments would only flicker.
  const bool known = fraction > 0.01 && spent > 0.5;
  const std::string left = known ? fmt::format(", {} left", duration_text(spent * (1.0 - fraction) / fraction)) : "";
  if (terminal_) {
    if (line_open_ && now - last_ < std::chrono::milliseconds(80)) return;
    last_ = now;
    line_open_ = true;
    fmt::print(stderr, "\r{} {:3.0f} %{}\033[K", what_, 100.0 * fraction, left);
    std::fflush(stderr);
    return;
  }
  const int tenths = static_cast<int>(10.0 * fraction + 1e-9);
  if (tenths <= tenths_) return;
  tenths_ = tenths;
  fmt::print(stderr, "{} {} %{}\n", what_, 10 * tenths, tenths < 10 ? left : "");
}

LongStart::LongStart(std::string words) : words_(std::move(words)) {
  if (how_much == Verbosity::quiet) return;
  thread_ = std::thread([this] { tell(); });
}

LongStart::~LongStart() {
  over();
  if (thread_.joinable()) thread_.join();
}

void LongStart::over() {
  const std::scoped_lock lock(mutex_);
  if (over_) return;
  over_ = true;
  changed_.notify_all();
}

void LongStart::tell() {
  const auto start = std::chrono::steady_clock::now();
  std::unique_lock lock(mutex_);
  for (int seconds = 5;; seconds *= 2) {
    if (changed_.wait_until(lock, start + std::chrono::seconds(seconds), [this] { return over_; })) return;
    fmt::print(stderr, "{}, {} so far\n", words_, duration_text(seconds));
  }
}

void Progress::say(const std::string& words) {
  if (how_much == Verbosity::quiet) return;
  clear();
  fmt::print(stderr, "{}: {}\n", what_, words);
}

}  // namespace flexframe::cli
