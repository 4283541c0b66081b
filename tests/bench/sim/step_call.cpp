// CPU time of a step of a driven simulation from C++: step_call SCENE INPUT OUTPUT STEPS DT. Prints microseconds a step, the least of nine
// goes over the same steps: of step() alone, and of set_input(), step() and output() together. step_call.py compares Python's with it.
#include <flexframe/sim/scene/scene_reader.h>
#include <flexframe/sim/simulation.h>

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <functional>

namespace {

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double least(int steps, flexframe::sim::Simulation& sim, const std::function<void()>& turn) {
  const auto start = sim.state();
  double best = 1e9;
  for (int go = 0; go < 9; ++go) {
    sim.restore(start);
    const double begin = cpu_seconds();
    for (int k = 0; k < steps; ++k) turn();
    best = std::min(best, cpu_seconds() - begin);
  }
  sim.restore(start);
  return 1e6 * best / steps;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6) {
    fmt::print("usage: step_call SCENE INPUT OUTPUT STEPS DT\n");
    return 2;
  }
  const char *input = argv[2], *output = argv[3];
  const int steps = std::atoi(argv[4]);
  const double dt = std::atof(argv[5]);
  flexframe::sim::Simulation sim(flexframe::sim::read_scene(argv[1]));
  double sum = 0.0;
  const double step = least(steps, sim, [&] { sim.step(dt); });
  const double all = least(steps, sim, [&] {
    sim.set_input(input, 1e-3 * sum);
    sim.step(dt);
    sum = sim.output(output);
  });
  fmt::print("{:.4f} {:.4f}\n", step, all);
  return 0;
}
