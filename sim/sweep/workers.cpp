#include "sim/sweep/workers.h"

#include "sim/base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <deque>
#include <map>
#include <vector>

#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

namespace flexframe::sim {
namespace {

// All of it, however often the system comes back early; false at the other end's close.
bool read_all(int file, void* into, std::size_t size) {
  auto* at = static_cast<char*>(into);
  while (size > 0) {
    const ssize_t got = ::read(file, at, size);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    at += got;
    size -= got;
  }
  return true;
}
bool write_all(int file, const void* from, std::size_t size) {
  const auto* at = static_cast<const char*>(from);
  while (size > 0) {
    const ssize_t put = ::send(file, at, size, MSG_NOSIGNAL);
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) return false;
    at += put;
    size -= put;
  }
  return true;
}

// The life of a worker: points as they are asked for, until its socket closes.
[[noreturn]] void live(const WorkersPlan& plan, int socket, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(1);
  std::signal(SIGINT, SIG_IGN);  // the parent decides; a ctrl-C reaches the whole group
  std::signal(SIGTERM, SIG_DFL);
  try {
    std::int64_t point = 0;
    while (read_all(socket, &point, sizeof point)) {
      const std::string result = plan.work(static_cast<long>(point));
      const std::uint64_t length = result.size();
      if (!write_all(socket, &length, sizeof length) || !write_all(socket, result.data(), result.size())) break;
    }
  } catch (...) {
    ::_exit(1);
  }
  // No clean-up: a fork shares its parent's handlers and buffers.
  ::_exit(0);
}

double cpu_of(pid_t process) {
  clockid_t clock;
  timespec time{};
  if (::clock_getcpuclockid(process, &clock) != 0 || ::clock_gettime(clock, &time) != 0) return 0.0;
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

std::string why_it_ended(int status) {
  if (WIFSIGNALED(status)) return fmt::format("signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)));
  return fmt::format("exit code {}", WEXITSTATUS(status));
}

class Pool {
 public:
  explicit Pool(const WorkersPlan& plan) : plan_(plan) {}
  ~Pool() {
    for (Worker& w : workers_) {
      if (w.socket >= 0) ::close(w.socket);
      if (w.process <= 0) continue;
      ::kill(w.process, SIGKILL);
      while (::waitpid(w.process, nullptr, 0) < 0 && errno == EINTR) {}
    }
  }
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;

  void run() {
    workers_.resize(std::max(1, plan_.workers));
    for (Worker& w : workers_) give(w);
    std::vector<pollfd> waits;
    for (;;) {
      waits.clear();
      for (const Worker& w : workers_)
        if (w.busy) waits.push_back({.fd = w.socket, .events = POLLIN, .revents = 0});
      if (waits.empty()) return;
      ::poll(waits.data(), waits.size(), 200);
      if (plan_.tick) plan_.tick();
      for (const pollfd& wait : waits)
        if (wait.revents) take(*std::find_if(workers_.begin(), workers_.end(), [&](const Worker& w) { return w.socket == wait.fd; }));
      if (plan_.longest > 0.0) stop_the_slow();
    }
  }

 private:
  struct Worker {
    pid_t process = -1;
    int socket = -1;
    bool busy = false;
    long point = 0;
    double cpu_before = 0.0;
  };

  void start(Worker& w) {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
      throw SimulationError(fmt::format("no socket to a worker: {}", std::strerror(errno)));
    const pid_t parent = ::getpid();
    w.process = ::fork();
    if (w.process == 0) {
      ::close(ends[0]);
      // Ends of the others' sockets that stayed open here would keep their workers waiting.
      for (const Worker& other : workers_)
        if (other.socket >= 0) ::close(other.socket);
      live(plan_, ends[1], parent);
    }
    const int reason = errno;
    ::close(ends[1]);
    w.socket = ends[0];
    if (w.process < 0) throw SimulationError(fmt::format("cannot start a worker: {}", std::strerror(reason)));
  }

  // The next point to a worker that has none; it is started if need be.
  void give(Worker& w) {
    w.busy = false;
    std::optional<long> point;
    if (!again_.empty()) {
      point = again_.front();
      again_.pop_front();
    } else {
      point = plan_.next();
    }
    if (!point) return;
    if (w.process <= 0) start(w);
    w.point = *point;
    w.busy = true;
    w.cpu_before = cpu_of(w.process);
    const std::int64_t number = *point;
    write_all(w.socket, &number, sizeof number);  // a worker that is dead shows when it is read from
  }

  void take(Worker& w) {
    std::uint64_t length = 0;
    std::string result;
    bool whole = read_all(w.socket, &length, sizeof length);
    if (whole) {
      result.resize(length);
      whole = read_all(w.socket, result.data(), length);
    }
    if (!whole) return replace(w);
    plan_.done(w.point, std::move(result));
    give(w);
  }

  void replace(Worker& w) {
    ::close(w.socket);
    int status = 0;
    while (::waitpid(w.process, &status, 0) < 0 && errno == EINTR) {}
    const long point = w.point;
    w = Worker{};
    int& ended = ended_[point];
    if (ended < 0) plan_.lost(point, "");
    else if (++ended < 2) again_.push_back(point);
    else plan_.lost(point, why_it_ended(status));
    give(w);
  }

  void stop_the_slow() {
    for (const Worker& w : workers_)
      if (w.busy && cpu_of(w.process) - w.cpu_before > plan_.longest) {
        ended_[w.point] = -1;  // once more would take as long
        ::kill(w.process, SIGKILL);
      }
  }

  const WorkersPlan& plan_;
  std::vector<Worker> workers_;
  std::deque<long> again_;
  std::map<long, int> ended_;
};

}  // namespace

int usable_cores() {
  cpu_set_t set;
  CPU_ZERO(&set);
  if (::sched_getaffinity(0, sizeof set, &set) != 0) return 1;
  return std::max(1, CPU_COUNT(&set));
}

void work_at_points(const WorkersPlan& plan) { Pool(plan).run(); }

}  // namespace flexframe::sim
