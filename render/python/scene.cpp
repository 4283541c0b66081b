// Scene and simulate.
#include "render/python/scene.h"

#include "render/film/picture_accuracy.h"
#include "render/python/bindings.h"
#include "sim/base/words.h"
#include "sim/results/results_file.h"
#include "sim/scene/picture_accuracy.h"
#include "sim/scene/scene_reader.h"
#include "sim/simulate.h"

#include <fmt/format.h>

#include <algorithm>
#include <variant>

namespace flexframe::python {

Scene read_scene(const std::filesystem::path& file, const std::vector<std::string>& settings) {
  Scene out{sim::read_document(file, settings), {}};
  out.scene = sim::make_scene(out.document);
  return out;
}

Scene parse_scene(const std::string& text, const std::string& name, const std::vector<std::string>& settings) {
  Scene out{sim::parse_document(text, name, settings), {}};
  out.scene = sim::make_scene(out.document);
  return out;
}

sim::Method method_of(const std::string& word) {
  const std::vector<std::string>& known = sim::method_words();
  const auto found = std::find(known.begin(), known.end(), word);
  if (found == known.end())
    throw ArgumentError(
        fmt::format("method {} is unknown{}; allowed: {}", sim::quote(word), sim::did_you_mean(word, known), sim::list_words(known)));
  return static_cast<sim::Method>(found - known.begin());
}

namespace {

// A distance or a share as text; throws ArgumentError.
void read_accuracy(const std::string& text, sim::Scene& scene, sim::SimulateOptions& options) {
  try {
    scene.simulation.picture_accuracy = sim::parse_picture_accuracy(text);
    if (!scene.simulation.picture_accuracy) options.accuracy = sim::parse_share_of_ranges(text);
  } catch (const sim::InputError& error) {
    throw ArgumentError(fmt::format("accuracy {}", error.what()));
  }
}

// Parameters: one a word of ff.simulate.
std::shared_ptr<sim::Results> simulate(const Scene& given, const std::variant<std::monostate, double, std::string>& accuracy,
                                       std::optional<double> tolerance, const std::optional<std::string>& method, bool estimate_error,
                                       bool check_effects, const py::object& progress) {
  const bool asked = !std::holds_alternative<std::monostate>(accuracy);
  if (asked && tolerance) throw ArgumentError("accuracy excludes tolerance: give the requested error of the outputs or the local error");
  sim::Scene scene = given.scene;
  if (asked || tolerance) scene.simulation.picture_accuracy.reset();
  sim::SimulateOptions options;
  if (const double* share = std::get_if<double>(&accuracy)) options.accuracy = *share;
  if (const std::string* distance = std::get_if<std::string>(&accuracy)) read_accuracy(*distance, scene, options);
  options.tolerance = tolerance;
  if (method) options.method = method_of(*method);
  options.estimate_error = estimate_error;
  options.check_effects = check_effects;
  Watcher watcher(progress);
  options.progress = [&](double time) { watcher.look(time / scene.simulation.duration); };
  const py::gil_scoped_release free;
  if (!scene.simulation.picture_accuracy) return std::make_shared<sim::Results>(sim::simulate(scene, options));
  const film::RenderSettings settings = film::read_render_settings(given.document);
  film::check_render_settings(settings, scene);
  return std::make_shared<sim::Results>(film::simulate_for_pictures(scene, settings, options));
}

std::vector<std::string> names(const auto& list) {
  std::vector<std::string> out;
  out.reserve(list.size());
  for (const auto& item : list) out.push_back(item.name);
  return out;
}

}  // namespace

void bind_scene(py::module_& m) {
  py::class_<Scene>(m, "Scene", R"(A scene: what a scene file says, read and checked (words: sim/SCENE.md).

Made by load() or scene(); constant.)")
      .def_property_readonly(
          "title", [](const Scene& s) { return s.scene.title; }, "Its title.")
      .def_property_readonly(
          "file", [](const Scene& s) { return s.scene.file; }, "Path of the scene file, or the name that stands for it.")
      .def_property_readonly(
          "text", [](const Scene& s) { return s.scene.text; }, "TOML text of the scene as it is run.")
      .def_property_readonly(
          "duration", [](const Scene& s) { return s.scene.simulation.duration; }, "Simulated time in s.")
      .def_property_readonly(
          "bodies", [](const Scene& s) { return names(s.scene.bodies); }, "Names of the bodies.")
      .def_property_readonly(
          "joints", [](const Scene& s) { return names(s.scene.joints); }, "Names of the joints.")
      .def_property_readonly(
          "outputs", [](const Scene& s) { return names(s.scene.outputs); }, "Names of the outputs.")
      .def_property_readonly(
          "inputs", [](const Scene& s) { return names(s.scene.inputs); }, "Names of the inputs ([[input]]).");

  m.def("_load", &read_scene, py::arg("file"), py::arg("settings"));
  m.def("_parse", &parse_scene, py::arg("text"), py::arg("name"), py::arg("settings"));
  m.def("_simulate", &simulate, py::arg("scene"), py::arg("accuracy"), py::arg("tolerance"), py::arg("method"), py::arg("estimate_error"),
        py::arg("check_effects"), py::arg("progress"));
}

}  // namespace flexframe::python
