// A simulation that is driven step by step: by a controller, another simulator, an optimiser, a game.
//
//   Simulation sim(read_scene("cart.toml"));        // [[input]] name = "push" stands in the value of a force
//   while (sim.time() < 5.0) {
//     sim.set_input("push", -k * sim.output("angle"));
//     sim.step(1e-3);
//   }
//   const Simulation::State s = sim.state();        // and back: sim.restore(s)
//
// Inputs are held over a step (zero-order hold). Every step begins its integration afresh from the state, so that what follows depends on
// the state alone: after restore() the same inputs give the same bits. One object is used by one thread at a time; several objects are
// independent.
#pragma once

#include "sim/base/notes.h"
#include "sim/scene/scene.h"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexframe::sim {

// A force of the user's on a frame: "body", or "body.frame".
struct UserForceOn {
  std::string frame;
  UserForce force;
};

struct DriveOptions {
  std::optional<double> tolerance;  // relative local error, 1e-13 .. 0.1; none: the scene's, else 1e-6
  // None or automatic: Runge-Kutta, explicit (erk) or diagonally implicit (dirk), as the scene suits: methods of several steps would begin
  // at first order in every step.
  std::optional<Method> method;
  std::vector<UserForceOn> forces;
  std::function<void(double time)> progress;  // now and then within a step, s; may throw to end the step
};

class Simulation {
 public:
  // Assembles the mechanism at t = 0 (static start where the scene asks for one, with its inputs' first values). Throws InputError for a
  // scene that makes no mechanism or a frame that it has not, SimulationError where it cannot be assembled.
  explicit Simulation(const Scene& scene, const DriveOptions& options = {});
  ~Simulation();
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;

  // An input of the scene, from the next step on. Throws ArgumentError for a name that the scene has not or a value that is not finite.
  void set_input(std::string_view name, double value);
  double input(std::string_view name) const;
  std::vector<std::string> inputs() const;  // their names

  // On by dt > 0, s; to a time later than now. May go beyond the scene's duration. Throws ArgumentError for another time, and
  // SimulationError where the integration cannot go on (or what `progress` or a user's force throws): the object is then as it was before.
  void step(double dt);
  void advance_to(double time);
  double time() const;  // s

  // Outputs of the scene at time(): columns as in the histories ("slider.x", "angle"), SI units. Accelerations and reactions are those
  // under the inputs of the last step. Throws ArgumentError for a name that it has not.
  double output(std::string_view column) const;
  const VecX& outputs() const;  // of all columns
  const std::vector<std::string>& columns() const;
  const std::vector<std::string>& units() const;

  // All that the future depends on. A value: copies share memory, nothing changes it.
  class State {
   public:
    double time() const;  // s

   private:
    friend class Simulation;
    struct Data;
    std::shared_ptr<const Data> data_;
  };
  State state() const;  // now
  // Of this simulation, or of another one of the same scene. Throws ArgumentError for that of another scene.
  void restore(const State& state);

  const Notes& notes() const;  // warnings and what was chosen, so far
  long evaluations() const;    // of the equations of motion, so far
  const char* method() const;  // "erk", "dirk", ...

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace flexframe::sim
