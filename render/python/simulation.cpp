// Simulation: a simulation that is driven step by step.
#include "sim/simulation.h"

#include "render/python/bindings.h"
#include "render/python/scene.h"

#include <pybind11/eigen.h>

namespace flexframe::python {
namespace {

// Python's function as a user's force; takes the GIL.
sim::UserForce user_force(py::function function) {
  return [function = std::move(function)](const sim::FrameMoment& f) {
    const py::gil_scoped_acquire gil;
    const py::object answer = function(f.t, f.position, f.rotation, f.velocity, f.angular_velocity);
    sim::UserWrench out;
    if (py::isinstance<py::tuple>(answer)) {
      const auto [force, torque] = answer.cast<std::pair<sim::Vec3, sim::Vec3>>();
      out.force = force;
      out.torque = torque;
    } else {
      out.force = answer.cast<sim::Vec3>();
    }
    return out;
  };
}

struct Driven {
  std::shared_ptr<Watcher> watcher;
  std::unique_ptr<sim::Simulation> simulation;
};

Driven make(const Scene& scene, std::optional<double> tolerance, const std::optional<std::string>& method, const py::dict& forces) {
  Driven out;
  out.watcher = std::make_shared<Watcher>(py::none());
  sim::DriveOptions options;
  options.tolerance = tolerance;
  if (method) options.method = method_of(*method);
  for (const auto& [frame, function] : forces)
    options.forces.push_back({frame.cast<std::string>(), user_force(py::reinterpret_borrow<py::function>(function))});
  options.progress = [watcher = out.watcher](double) { watcher->look(); };
  const py::gil_scoped_release free;
  out.simulation = std::make_unique<sim::Simulation>(scene.scene, options);
  return out;
}

}  // namespace

void bind_simulation(py::module_& m) {
  using State = sim::Simulation::State;
  py::class_<State>(m, "State", "All that the future of a Simulation depends on; constant.")
      .def_property_readonly("time", &State::time, "s");

  py::class_<Driven>(m, "Simulation", R"(A simulation that is driven step by step.

Simulation(scene, tolerance=None, method=None, forces={})
  scene      a Scene
  tolerance  relative local error, 1e-13 .. 0.1; None: the scene's, else 1e-6
  method     None: explicit or implicit Runge-Kutta, as the scene suits
  forces     {"body.frame": f}: f(t, position, rotation, velocity, angular_velocity) -> force, or (force, torque);
             world axes, shapes (3,) and (3, 3), N and Nm; called in every evaluation of the equations of motion

Inputs are declared in the scene ([[input]]) and held over a step. Every step begins its integration afresh from the state: after
restore() the same inputs give the same bits. Raises InputError, SimulationError.)")
      .def(py::init(&make), py::arg("scene"), py::arg("tolerance") = py::none(), py::arg("method") = py::none(),
           py::arg("forces") = py::dict())
      .def(
          "set_input", [](Driven& s, std::string_view name, double value) { s.simulation->set_input(name, value); }, py::arg("name"),
          py::arg("value"), "Sets an input from the next step on. Raises ArgumentError for an unknown name or a value that is not finite.")
      .def(
          "input", [](const Driven& s, std::string_view name) { return s.simulation->input(name); }, py::arg("name"),
          "The value of an input.")
      .def(
          "step", [](Driven& s, double dt) { s.simulation->step(dt); }, py::arg("dt"), py::call_guard<py::gil_scoped_release>(),
          "Goes on by dt > 0 (s). Raises SimulationError where that is impossible; the simulation is then as it was before.")
      .def(
          "advance_to", [](Driven& s, double time) { s.simulation->advance_to(time); }, py::arg("time"),
          py::call_guard<py::gil_scoped_release>(), "Goes on to a time later than now (s). Raises as step does.")
      .def_property_readonly(
          "time", [](const Driven& s) { return s.simulation->time(); }, "s")
      .def(
          "output", [](const Driven& s, std::string_view column) { return s.simulation->output(column); }, py::arg("column"),
          "An output's column now (\"slider.x\"), SI units. Raises ArgumentError for an unknown name.")
      .def_property_readonly(
          "outputs", [](const Driven& s) { return sim::VecX(s.simulation->outputs()); }, "All columns now, in the order of `columns`.")
      .def_property_readonly(
          "columns", [](const Driven& s) { return s.simulation->columns(); }, "Names of the outputs' columns.")
      .def_property_readonly(
          "units", [](const Driven& s) { return s.simulation->units(); }, "Their units.")
      .def_property_readonly(
          "inputs", [](const Driven& s) { return s.simulation->inputs(); }, "Names of the inputs.")
      .def(
          "state", [](const Driven& s) { return s.simulation->state(); }, "The state now, to come back to.")
      .def(
          "restore", [](Driven& s, const State& state) { s.simulation->restore(state); }, py::arg("state"),
          "Goes back to a state of this simulation or of another one of the same scene. Raises ArgumentError for that of another scene.")
      .def_property_readonly(
          "evaluations", [](const Driven& s) { return s.simulation->evaluations(); }, "Evaluations of the equations of motion so far.")
      .def_property_readonly(
          "method", [](const Driven& s) { return s.simulation->method(); }, "The integration method.");
}

}  // namespace flexframe::python
