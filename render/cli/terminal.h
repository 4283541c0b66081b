// What the program shows while it works: progress on stderr, interruption by the user.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>

namespace flexframe::cli {

// How much the program says: quiet, warnings and errors only (stderr); verbose, every stage with its time. It writes no colours, so that
// there is nothing for NO_COLOR to switch off.
enum class Verbosity { quiet, usual, verbose };
void set_verbosity(Verbosity verbosity);
Verbosity verbosity();

// From now on only warnings of what is printed on stdout are seen, on stderr: lines that begin with WARNING.
void silence_stdout();

// One stage of work. On a terminal one line that is rewritten, with the remaining time; otherwise a plain line every ten percent.
class Progress {
 public:
  explicit Progress(std::string what);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // fraction 0..1 of the work done so far. Throws Interrupted once the user has asked to stop.
  void show(double fraction);
  // A line of its own about the work.
  void say(const std::string& words);

 private:
  void clear();

  std::string what_;
  bool terminal_;
  bool line_open_ = false;
  int tenths_ = 0;
  std::chrono::steady_clock::time_point start_, last_;
};

// Says on stderr that a stage has begun which cannot tell how far it is: after 5 s, then at twice the time so far, until it is over.
class LongStart {
 public:
  explicit LongStart(std::string words);
  ~LongStart();
  LongStart(const LongStart&) = delete;
  LongStart& operator=(const LongStart&) = delete;
  void over();

 private:
  void tell();

  std::string words_;
  bool over_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::thread thread_;
};

// The user's ctrl-C (or SIGTERM): work in progress is dropped, nothing half-written stays, exit code 130.
struct Interrupted : std::runtime_error {
  Interrupted() : std::runtime_error("interrupted") {}
};

// At the start: makes streams that were closed safe (nothing is written into files that are opened later), and a stderr that takes nothing
// no reason to end.
void secure_streams();

// From here on SIGINT and SIGTERM are noted instead of ending the process at once.
void watch_interrupts();
bool interrupted();
void throw_if_interrupted();

// "1 min 20 s", "3.4 s".
std::string duration_text(double seconds);

}  // namespace flexframe::cli
