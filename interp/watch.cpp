#include "interp/watch.h"

#include <chrono>
#include <future>
#include <thread>
#include <utility>

namespace flexframe::interp {
namespace {

thread_local Watch* current = nullptr;

}  // namespace

Watch::Watch(std::function<void()> ask) : ask_(std::move(ask)), before_(std::exchange(current, this)) {}
Watch::~Watch() { current = before_; }

void look() {
  if (current) current->ask_();
}

void look_beside(std::function<void()> work) {
  if (!current) return work();
  std::packaged_task<void()> task(std::move(work));
  std::future<void> done = task.get_future();
  std::thread(std::move(task)).detach();
  while (done.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready) look();
  done.get();
}

}  // namespace flexframe::interp
