// Work at many points by forked processes, one point a time each. A process that dies takes its point with it and no other: it is replaced,
// the point tried once more, then given up.
#pragma once

#include <functional>
#include <optional>
#include <string>

namespace flexframe::sim {

struct WorkersPlan {
  int workers = 1;
  // The next point to work at; none: no more.
  std::function<std::optional<long>()> next;
  // In a worker: what comes of the point. Whatever it throws ends the worker.
  std::function<std::string(long point)> work;
  // In this process, for each point that was done, in the order in which they are done.
  std::function<void(long point, std::string&& result)> done;
  // In this process, for a point whose process ended twice; why: "signal 11 (Segmentation fault)", empty where it took longer than
  // `longest`.
  std::function<void(long point, const std::string& why)> lost;
  double longest = 0.0;        // CPU s after which the process of a point is killed, for work that looks at no limit itself; 0: none
  std::function<void()> tick;  // now and then; may throw to stop: all workers are ended
};

// Returns when every point is done or lost. Workers end with this process, whatever ends it. Throws SimulationError where no process can
// be started.
void work_at_points(const WorkersPlan& plan);

// Cores that this process may use.
int usable_cores();

}  // namespace flexframe::sim
