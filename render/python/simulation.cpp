// Simulation: a simulation that is driven step by step.
#include "sim/simulation.h"

#include "render/python/bindings.h"
#include "render/python/scene.h"

#include <fmt/format.h>
#include <pybind11/eigen.h>

#include <atomic>

namespace flexframe::python {
namespace {

// A force or torque out of what a user's function gave back.
sim::Vec3 three_numbers(const py::handle& given, const std::string& frame) {
  const py::array_t<double, py::array::c_style | py::array::forcecast> a =
      py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(given);
  if (!a || a.ndim() != 1 || a.size() != 3) {
    PyErr_Clear();
    throw ArgumentError(fmt::format("the force on '{}' must give back three numbers, or (force, torque) of three each; found {}", frame,
                                    py::repr(given).cast<std::string>()));
  }
  return {a.at(0), a.at(1), a.at(2)};
}

// Python's function as a user's force; takes the GIL. The simulation copies and drops it in calls that run without: the function is held
// by a pointer whose end takes the GIL too.
sim::UserForce user_force(const std::string& frame, py::function given) {
  const std::shared_ptr<py::function> function(new py::function(std::move(given)), [](py::function* f) {
    const py::gil_scoped_acquire gil;
    delete f;
  });
  return [frame, function](const sim::FrameMoment& f) {
    const py::gil_scoped_acquire gil;
    const py::object answer = (*function)(f.t, f.position, f.rotation, f.velocity, f.angular_velocity);
    if (!py::isinstance<py::tuple>(answer) || py::len(answer) != 2) return sim::UserWrench{three_numbers(answer, frame), sim::Vec3::Zero()};
    const auto pair = py::reinterpret_borrow<py::tuple>(answer);
    return sim::UserWrench{three_numbers(pair[0], frame), three_numbers(pair[1], frame)};
  };
}

// One thread at a time, and no call from within a step (a force that steps its own simulation): both would read what is half changed.
class Turn {
 public:
  explicit Turn(std::atomic<bool>& busy) : busy_(busy) {
    if (busy_.exchange(true))
      throw ArgumentError("this simulation is in a step: another thread, or a force of its own, must not use it meanwhile");
  }
  ~Turn() { busy_ = false; }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  std::atomic<bool>& busy_;
};

struct Driven {
  std::shared_ptr<Watcher> watcher;
  std::unique_ptr<sim::Simulation> simulation;
  std::unique_ptr<std::atomic<bool>> busy = std::make_unique<std::atomic<bool>>(false);
};

// A call of the simulation's, in its turn.
template <class Call>
auto in_turn(const Driven& s, const Call& call) {
  const Turn turn(*s.busy);
  return call(*s.simulation);
}

Driven make(const py::object& given, std::optional<double> tolerance, const std::optional<std::string>& method, const py::dict& forces) {
  // As simulate(): a dict or a file name will do.
  const py::object kept = py::isinstance<Scene>(given) ? given : py::module_::import("flexframe").attr("_scene")(given);
  const auto& scene = kept.cast<const Scene&>();
  Driven out;
  out.watcher = std::make_shared<Watcher>(py::none());
  sim::DriveOptions options;
  options.tolerance = tolerance;
  if (method) options.method = method_of(*method);
  for (const auto& [key, function] : forces) {
    const auto frame = key.cast<std::string>();
    if (!py::isinstance<py::function>(function) && PyCallable_Check(function.ptr()) == 0)
      throw ArgumentError(fmt::format("forces: '{}' must be a function, found {}", frame, py::repr(function).cast<std::string>()));
    options.forces.push_back({frame, user_force(frame, py::reinterpret_borrow<py::function>(function))});
  }
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
  scene      a Scene, a dict or a file name
  tolerance  relative local error, 1e-13 .. 0.1; None: the scene's, else 1e-6
  method     None: explicit or implicit Runge-Kutta, as the scene suits
  forces     {"body.frame": f}: f(t, position, rotation, velocity, angular_velocity) -> force, or (force, torque);
             world axes, shapes (3,) and (3, 3), N and Nm; called in every evaluation of the equations of motion

Inputs are declared in the scene ([[input]]) and held over a step. Every step begins its integration afresh from the state: after
restore() the same inputs give the same bits. One thread at a time: others, and a force that calls its own simulation, get an
ArgumentError. There is no copy: state() of one and restore() of another of the same scene is one. Raises InputError, SimulationError.)")
      .def(py::init(&make), py::arg("scene"), py::arg("tolerance") = py::none(), py::arg("method") = py::none(),
           py::arg("forces") = py::dict())
      .def(
          "set_input",
          [](Driven& s, std::string_view name, double value) { in_turn(s, [&](sim::Simulation& d) { d.set_input(name, value); }); },
          py::arg("name"), py::arg("value"),
          "Sets an input from the next step on. Raises ArgumentError for an unknown name or a value that is not finite.")
      .def(
          "input", [](const Driven& s, std::string_view name) { return in_turn(s, [&](sim::Simulation& d) { return d.input(name); }); },
          py::arg("name"), "The value of an input.")
      .def(
          "step", [](Driven& s, double dt) { in_turn(s, [&](sim::Simulation& d) { d.step(dt); }); }, py::arg("dt"),
          py::call_guard<py::gil_scoped_release>(),
          "Goes on by dt > 0 (s). Raises SimulationError where that is impossible; the simulation is then as it was before.")
      .def(
          "advance_to", [](Driven& s, double time) { in_turn(s, [&](sim::Simulation& d) { d.advance_to(time); }); }, py::arg("time"),
          py::call_guard<py::gil_scoped_release>(), "Goes on to a time later than now (s). Raises as step does.")
      .def_property_readonly(
          "time", [](const Driven& s) { return in_turn(s, [](sim::Simulation& d) { return d.time(); }); }, "s")
      .def(
          "output",
          [](const Driven& s, std::string_view column) { return in_turn(s, [&](sim::Simulation& d) { return d.output(column); }); },
          py::arg("column"), "An output's column now (\"slider.x\"), SI units. Raises ArgumentError for an unknown name.")
      .def_property_readonly(
          "outputs", [](const Driven& s) { return in_turn(s, [](sim::Simulation& d) { return sim::VecX(d.outputs()); }); },
          "All columns now, in the order of `columns`.")
      .def_property_readonly(
          "columns", [](const Driven& s) { return s.simulation->columns(); }, "Names of the outputs' columns.")
      .def_property_readonly(
          "units", [](const Driven& s) { return s.simulation->units(); }, "Their units.")
      .def_property_readonly(
          "inputs", [](const Driven& s) { return s.simulation->inputs(); }, "Names of the inputs.")
      .def(
          "state", [](const Driven& s) { return in_turn(s, [](sim::Simulation& d) { return d.state(); }); },
          "The state now, to come back to.")
      .def(
          "restore", [](Driven& s, const State& state) { in_turn(s, [&](sim::Simulation& d) { d.restore(state); }); }, py::arg("state"),
          "Goes back to a state of this simulation or of another one of the same scene. Raises ArgumentError for that of another scene.")
      .def_property_readonly(
          "evaluations", [](const Driven& s) { return in_turn(s, [](sim::Simulation& d) { return d.evaluations(); }); },
          "Evaluations of the equations of motion so far.")
      .def_property_readonly(
          "warnings",
          [](const Driven& s) { return in_turn(s, [](sim::Simulation& d) { return d.notes().texts(sim::Severity::warning); }); },
          "What may be wrong by more than was asked so far, one sentence each.")
      .def_property_readonly(
          "notes", [](const Driven& s) { return in_turn(s, [](sim::Simulation& d) { return d.notes().texts(sim::Severity::note); }); },
          "What was chosen and why.")
      .def_property_readonly(
          "method", [](const Driven& s) { return s.simulation->method(); }, "The integration method.");
}

}  // namespace flexframe::python
