// Work over ranges on several threads; an exception in a thread is thrown again in the caller. Between chunks the caller's watch is asked.
#pragma once

#include "interp/watch.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <thread>
#include <vector>

namespace flexframe::interp {

// asked 0: as many as the machine has.
inline int thread_count(int asked) {
  if (asked > 0) return std::min(asked, 64);
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

// Cuts 0..count into chunks of `grain` and calls work(begin, end) for each, chunks in any order, on `threads` threads.
template <typename Work>
void parallel_chunks(int count, int grain, int threads, const Work& work) {
  grain = std::max(1, grain);
  const int chunks = (count + grain - 1) / grain;
  threads = std::min(threads, chunks);
  if (threads <= 1) {
    for (int c = 0; c < chunks; ++c) {
      look();
      work(c * grain, std::min(count, (c + 1) * grain));
    }
    return;
  }
  std::atomic<int> next{0};
  std::atomic<bool> given_up{false};
  struct GivenUp {};
  std::vector<std::exception_ptr> failure(threads);
  auto run = [&](size_t me) {
    try {
      for (int c = next++; c < chunks; c = next++) {
        look();
        work(c * grain, std::min(count, (c + 1) * grain));
      }
    } catch (...) {
      failure[me] = std::current_exception();
      next = chunks;
      if (me == 0) given_up = true;
    }
  };
  // The others learn from the caller's thread that it gave up, also within a long chunk.
  auto run_beside = [&](size_t me) {
    const Watch follow([&] {
      if (given_up) throw GivenUp{};
    });
    run(me);
  };
  std::vector<std::jthread> crew;
  for (int k = 1; k < threads; ++k) crew.emplace_back(run_beside, static_cast<size_t>(k));
  run(0);
  crew.clear();
  for (const auto& f : failure)
    if (f) std::rethrow_exception(f);
}

}  // namespace flexframe::interp
