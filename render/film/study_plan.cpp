#include "render/film/study_plan.h"

#include "sim/base/words.h"
#include "sim/bodies/resolution.h"
#include "sim/run/effect_report.h"
#include "sim/scene/effect_names.h"
#include "sim/simulate.h"
#include "sim/start/make_system.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

namespace flexframe::film {
namespace {

using sim::BeamDef;
using sim::BeamModel;
using sim::Scene;

const char* model_name(BeamModel model) {
  switch (model) {
    case BeamModel::finite_element:
      return "finite-element";
    case BeamModel::modal:
      return "modal";
    case BeamModel::mixed:
      return "mixed";
    default:
      return "lumped";
  }
}

double scene_tolerance(const Scene& scene) { return scene.simulation.tolerance.value_or(sim::default_tolerance); }

void set_tolerance(Scene& scene, double tolerance) {
  scene.simulation.tolerance = tolerance;
  scene.simulation.accuracy.reset();
  scene.simulation.picture_accuracy.reset();
}

bool any_beam(const Scene& scene, const std::function<bool(const BeamDef&)>& test) {
  return std::any_of(scene.bodies.begin(), scene.bodies.end(), [&](const sim::BodyDef& b) {
    const auto* beam = std::get_if<BeamDef>(&b.kind);
    return beam && test(*beam);
  });
}

void each_beam(Scene& scene, const std::function<void(BeamDef&)>& change) {
  for (sim::BodyDef& b : scene.bodies)
    if (auto* beam = std::get_if<BeamDef>(&b.kind)) change(*beam);
}

bool bends(const BeamDef& beam) { return beam.effects.automatic || !beam.effects.names.empty() || !beam.modes.empty(); }

bool frame_only(const BeamDef& beam) {
  return beam.boundary != sim::Boundary::clamped_clamped && beam.boundary != sim::Boundary::clamped_supported;
}

// Directions that a modal form of the beam needs: those of its modes, or of its effects.
std::vector<std::string> directions(const BeamDef& beam, const std::vector<sim::EffectState>& states, const std::string& body) {
  std::vector<std::string> out;
  for (const std::string& d : sim::direction_names()) {
    const bool listed = beam.modes.count(d) > 0;
    const bool on =
        std::any_of(states.begin(), states.end(), [&](const sim::EffectState& s) { return s.owner == body && s.effect == d && s.on; });
    if (beam.modes.empty() ? on : listed) out.push_back(d);
  }
  return out;
}

// The beams that bend in another form: n elements, modes 1..n, n volumes of two elements, n lumped elements.
void set_form(Scene& scene, const std::vector<sim::EffectState>& states, BeamModel model, int n) {
  for (sim::BodyDef& body : scene.bodies) {
    auto* beam = std::get_if<BeamDef>(&body.kind);
    if (!beam || !bends(*beam)) continue;
    const std::vector<std::string> along = directions(*beam, states, body.name);
    std::vector<std::string> effects;
    for (const sim::EffectState& s : states)
      if (s.owner == body.name && s.on && s.effect != "gyroscopic" && s.effect != "damping") effects.push_back(s.effect);
    beam->effects.automatic = false;
    beam->effects.names = effects;
    beam->model = model;
    beam->modes.clear();
    beam->keep_modes.reset();
    beam->keep_axial.reset();
    beam->keep_torsion.reset();
    beam->curvature_coupling = false;
    if (model == BeamModel::modal) {
      std::erase(beam->effects.names, "shear");
      for (const std::string& d : along) beam->modes[d] = sim::mode_numbers(d, n);
    } else if (model == BeamModel::mixed) {
      beam->volumes = n;
      beam->elements = 2;
    } else {
      beam->elements = n;
    }
  }
}

bool keeps(const BeamDef& beam) { return bends(beam) && beam.model == BeamModel::finite_element && frame_only(beam); }

// n modes of the softest beam and in the others those below the same frequency (which grows with the square of the number), at least one;
// two elements a mode. Returns the words for the scene.
std::string keep_below_one_frequency(Scene& scene, int n, bool statics) {
  const auto pitch = [](const BeamDef& b) {
    return std::sqrt(b.material.youngs_modulus * std::min(b.section.iy, b.section.iz) / (b.material.density * b.section.area)) /
           (b.length * b.length);
  };
  double softest = 0.0;
  each_beam(scene, [&](BeamDef& b) {
    if (keeps(b)) softest = softest == 0.0 ? pitch(b) : std::min(softest, pitch(b));
  });
  std::vector<std::string> words;
  for (sim::BodyDef& body : scene.bodies) {
    auto* beam = std::get_if<BeamDef>(&body.kind);
    if (!beam || !keeps(*beam)) continue;
    beam->keep_modes = std::max(1, static_cast<int>(std::lround(n * std::sqrt(softest / pitch(*beam)))));
    beam->keep_axial.reset();
    beam->keep_torsion.reset();
    beam->keep_static = statics;
    beam->elements = std::max(beam->elements, sim::elements_to_compare(*beam->keep_modes));
    words.push_back(fmt::format("{}: keep_modes = {}{}, elements = {}", body.name, *beam->keep_modes,
                                statics ? "" : ", keep_static = false", beam->elements));
  }
  return fmt::format("{}", fmt::join(words, "; "));
}

int scaled(int n, double factor) { return std::max(1, static_cast<int>(std::lround(n * factor))); }

// Frames such as rod.node[3] tie the number of elements.
bool names_nodes(const Scene& scene) {
  const auto node = [](const sim::FrameRef& f) { return f.frame.rfind("node[", 0) == 0 || f.frame.rfind("station[", 0) == 0; };
  return std::any_of(scene.joints.begin(), scene.joints.end(), [&](const sim::JointDef& j) { return node(j.parent) || node(j.child); }) ||
         std::any_of(scene.forces.begin(), scene.forces.end(), [&](const sim::ForceDef& f) { return node(f.on) || node(f.from); }) ||
         std::any_of(scene.outputs.begin(), scene.outputs.end(), [&](const sim::OutputDef& o) { return node(o.of); });
}

// Outputs or starts counted in elastic coordinates tie their number.
bool counts_coordinates(const Scene& scene) {
  return std::any_of(scene.outputs.begin(), scene.outputs.end(),
                     [](const sim::OutputDef& o) { return o.quantity == sim::Quantity::q || o.quantity == sim::Quantity::qd; }) ||
         any_beam(scene, [](const BeamDef& b) { return !b.initial.q.empty() || !b.initial.qd.empty(); });
}

std::vector<sim::EffectState> states_of(const Scene& scene) { return sim::effect_states(scene, sim::make_system(scene).model); }

}  // namespace

Scene refined(const Scene& scene, double factor, double tolerance, bool explicit_steps) {
  Scene out = scene;
  set_tolerance(out, tolerance);
  if (names_nodes(scene) || counts_coordinates(scene)) return out;
  each_beam(out, [&](BeamDef& beam) {
    if (!bends(beam)) return;
    if (beam.model == BeamModel::mixed) beam.volumes = scaled(beam.volumes, factor);
    else if (beam.model == BeamModel::modal) {
      for (auto& [direction, numbers] : beam.modes) {
        const int highest = std::min(scaled(*std::max_element(numbers.begin(), numbers.end()), factor), 60);
        numbers.clear();
        for (int k = 1; k <= highest; ++k) numbers.push_back(k);
      }
    } else {
      beam.elements = scaled(beam.elements, factor);
      beam.keep_modes.reset();
      beam.keep_axial.reset();
      beam.keep_torsion.reset();
      // The upper half of an element model's modes is wrong anyway and only makes the steps small.
      if (keeps(beam)) beam.keep_modes = std::max(2, beam.elements);
    }
  });
  // Explicit steps are as short as the stiffest shape asks for: twice the elements and modes are four times the steps.
  int most = 0;
  each_beam(out, [&](BeamDef& beam) {
    if (keeps(beam)) most = std::max(most, beam.elements);
  });
  if (explicit_steps && most > 0) keep_below_one_frequency(out, std::max(2, (most + 1) / 2), false);
  return out;
}

std::optional<Scene> with_elements(const Scene& scene, double factor) {
  std::map<std::string, std::map<std::string, int>> highest;  // of a body, in each direction
  bool others = false;
  for (const sim::BodyDef& b : scene.bodies) {
    const auto* beam = std::get_if<BeamDef>(&b.kind);
    if (!beam || !bends(*beam)) continue;
    others = others || beam->model != BeamModel::modal || !frame_only(*beam);
    for (const auto& [direction, numbers] : beam->modes)
      highest[b.name][direction] = std::max(1, scaled(*std::max_element(numbers.begin(), numbers.end()), factor));
  }
  if (others || highest.empty() || names_nodes(scene) || counts_coordinates(scene)) return std::nullopt;
  Scene out = scene;
  set_form(out, states_of(scene), BeamModel::finite_element, 1);
  for (sim::BodyDef& b : out.bodies) {
    auto* beam = std::get_if<BeamDef>(&b.kind);
    if (!beam || !highest.contains(b.name)) continue;
    const std::map<std::string, int>& of = highest.at(b.name);
    int most = 1;
    for (const auto& [direction, n] : of) most = std::max(most, n);
    beam->keep_modes = most;
    if (of.contains("axial")) beam->keep_axial = of.at("axial");
    if (of.contains("torsion")) beam->keep_torsion = of.at("torsion");
    beam->elements = sim::elements_to_compare(most);
  }
  return out;
}

bool has_axis(const Scene& scene, const std::string& axis) {
  if (axis == "tolerance" || axis == "method") return true;
  if (axis == "nodes" || axis == "scheme")
    return std::any_of(scene.bodies.begin(), scene.bodies.end(),
                       [](const sim::BodyDef& b) { return !std::holds_alternative<sim::RigidDef>(b.kind); });
  if (axis == "samples") return true;
  if (axis == "stiffening") return any_beam(scene, [](const BeamDef& b) { return bends(b) && b.model != BeamModel::lumped; });
  if (names_nodes(scene) || counts_coordinates(scene)) return false;
  if (axis == "kept") return any_beam(scene, keeps);
  if (axis == "elements")
    return any_beam(scene,
                    [](const BeamDef& b) { return bends(b) && (b.model == BeamModel::finite_element || b.model == BeamModel::lumped); });
  return any_beam(scene, bends);
}

namespace {

// The points of one axis of a study.
class AxisPlan {
 public:
  AxisPlan(const Scene& scene, const std::string& axis)
      : scene_(scene), axis_(axis), tolerance_(scene_tolerance(scene)), quiet_(std::max(0.1 * tolerance_, 1e-9)) {}

  std::vector<PlannedPoint> make() {
    if (axis_ == "tolerance") plan_tolerances();
    else if (axis_ == "method") plan_methods();
    else if (axis_ == "elements") plan_elements();
    else if (axis_ == "kept") plan_kept_modes();
    else if (axis_ == "modes") plan_ladder(BeamModel::modal, {8, 6, 4, 3, 2, 1}, "modes");
    else if (axis_ == "volumes") plan_ladder(BeamModel::mixed, {8, 4, 2, 1}, "volumes");
    else if (axis_ == "model") plan_forms();
    else if (axis_ == "stiffening") plan_stiffening();
    return std::move(out_);
  }

 private:
  struct Form {
    const char* name;
    BeamModel model;
    bool kept;
    std::vector<int> counts;
    const char* word;
  };

  void add(const std::string& series, const std::string& label, double knob, const std::string& setting, Scene s) {
    out_.push_back({axis_, series, label, setting, knob, std::move(s)});
  }
  Scene at(double t) const {
    Scene s = scene_;
    set_tolerance(s, t);
    return s;
  }

  void plan_tolerances() {
    for (double t : {1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2})
      add("method as the scene has it", fmt::format("tolerance {:g}", t), t, fmt::format("tolerance = {:g}", t), at(t));
  }

  void plan_methods() {
    for (sim::Method m : {sim::Method::adams, sim::Method::bdf, sim::Method::erk, sim::Method::dirk, sim::Method::exponential})
      for (double t : {1e-7, 1e-5, 1e-3}) {
        Scene s = at(t);
        s.simulation.method = m;
        add(sim::method_name(m), fmt::format("{} {:g}", sim::method_name(m), t), t,
            fmt::format("method = \"{}\", tolerance = {:g}", sim::method_name(m), t), s);
      }
  }

  void plan_elements() {
    for (double f : {4.0, 2.0, 1.0, 0.5, 0.25}) {
      Scene s = at(quiet_);
      std::vector<std::string> words;
      int most = 0;
      for (sim::BodyDef& b : s.bodies) {
        auto* beam = std::get_if<BeamDef>(&b.kind);
        if (!beam || !bends(*beam) || (beam->model != BeamModel::finite_element && beam->model != BeamModel::lumped)) continue;
        beam->elements = scaled(beam->elements, f);
        beam->keep_modes.reset();
        beam->keep_axial.reset();
        beam->keep_torsion.reset();
        words.push_back(fmt::format("{}: elements = {}", b.name, beam->elements));
        most = std::max(most, beam->elements);
      }
      add("finite elements", fmt::format("{} elements", most), most, fmt::format("{}; tolerance = {:g}", fmt::join(words, ", "), quiet_),
          s);
    }
  }

  void plan_kept_modes() {
    for (double t : {std::max(0.01 * tolerance_, 1e-10), tolerance_, std::min(100.0 * tolerance_, 1e-2)})
      for (int keep : {12, 8, 6, 4, 3, 2, 1}) {
        Scene s = at(t);
        const std::string words = keep_below_one_frequency(s, keep, true);
        add(fmt::format("kept modes at {:g}", t), fmt::format("{} kept", keep), keep, fmt::format("{}; tolerance = {:g}", words, t), s);
      }
    for (const sim::Method method : {sim::Method::exponential, sim::Method::erk})
      for (double t : {tolerance_, std::min(10.0 * tolerance_, 1e-2)})
        for (int keep : {24, 16, 14, 12, 10, 8, 6, 4, 3, 2}) {
          Scene s = at(t);
          s.simulation.method = method;
          const std::string words = keep_below_one_frequency(s, keep, false), name = sim::method_name(method);
          add(fmt::format("kept, {} at {:g}", name, t), fmt::format("{} kept, {}", keep, name), keep,
              fmt::format("{}; method = \"{}\", tolerance = {:g}", words, name, t), s);
        }
  }

  void plan_ladder(BeamModel model, std::initializer_list<int> counts, const char* word) {
    const std::vector<sim::EffectState> states = states_of(scene_);
    for (int n : counts) {
      Scene s = at(quiet_);
      set_form(s, states, model, n);
      add(model_name(model), sim::how_many(n, word), n,
          fmt::format("model = \"{}\", {}; tolerance = {:g}", model_name(model), sim::how_many(n, word), quiet_), s);
    }
  }

  // A form at one size with the method that the program takes (automatic) or one that follows vibrations.
  void add_form(const Form& form, int n, sim::Method method, const std::vector<sim::EffectState>& states) {
    const bool follows = method != sim::Method::automatic;
    for (double t : {follows ? 10.0 * tolerance_ : tolerance_, follows ? tolerance_ : 0.1 * tolerance_}) {
      Scene s = at(t);
      set_form(s, states, form.model, n);
      if (form.kept) keep_below_one_frequency(s, n, !follows);
      if (follows) s.simulation.method = method;
      const std::string name = follows ? sim::method_name(method) : "", words = follows ? fmt::format("method = \"{}\", ", name) : "";
      add(form.name, fmt::format("{}, {}{}{:g}", sim::how_many(n, form.word), name, follows ? " " : "", t), n,
          fmt::format("model = \"{}\", {}{}; {}tolerance = {:g}", model_name(form.model), sim::how_many(n, form.word),
                      form.kept && follows ? ", keep_static = false" : "", words, t),
          s);
    }
  }

  // What is cheap for one method is dear for another: each form with all of them.
  void plan_forms() {
    const std::vector<sim::EffectState> states = states_of(scene_);
    const Form forms[] = {{"elements", BeamModel::finite_element, false, {16, 8, 4, 2}, "elements"},
                          {"elements, modes kept", BeamModel::finite_element, true, {16, 8, 4, 2, 1}, "modes"},
                          {"eigenforms (modal)", BeamModel::modal, false, {16, 8, 4, 2, 1}, "modes"},
                          {"mixed", BeamModel::mixed, false, {8, 4, 2, 1}, "volumes"},
                          {"lumped", BeamModel::lumped, false, {32, 16, 8, 4}, "lumps"}};
    for (const Form& form : forms) {
      if (form.kept && !any_beam(scene_, [](const BeamDef& b) { return bends(b) && frame_only(b); })) continue;
      for (int n : form.counts)
        for (const sim::Method method : {sim::Method::automatic, sim::Method::erk, sim::Method::exponential})
          add_form(form, n, method, states);
    }
  }

  void plan_stiffening() {
    const std::vector<sim::EffectState> states = states_of(scene_);
    for (bool on : {true, false}) {
      Scene s = at(tolerance_);
      for (const sim::EffectState& e : states)
        if (e.effect == "stiffening" && e.possible && e.on != on) s = sim::with_effect(s, states, e.owner, "stiffening", on);
      add(on ? "with stiffening" : "without stiffening", on ? "stiffening" : "no stiffening", 0.0,
          on ? "stiffening among the effects" : "no stiffening", s);
    }
  }

  const Scene& scene_;
  const std::string& axis_;
  const double tolerance_, quiet_;  // a ladder in space is climbed with the error of time a tenth of the scene's
  std::vector<PlannedPoint> out_;
};

}  // namespace

std::vector<PlannedPoint> plan_axis(const Scene& scene, const std::string& axis) { return AxisPlan(scene, axis).make(); }

}  // namespace flexframe::film
