#include "sim/simulation.h"

#include "sim/base/words.h"
#include "sim/results/recorder.h"
#include "sim/run/histories_run.h"
#include "sim/run/integrate_run.h"
#include "sim/run/method_choice.h"
#include "sim/scene/parameters.h"
#include "sim/start/make_system.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// Methods of one step: what they need to know is the state.
Method one_step_method(const System& system, Method wanted) {
  if (wanted != Method::automatic) return wanted;
  double fastest = 0.0;
  const Method chosen = choose_method(system, fastest);
  return chosen == Method::adams || chosen == Method::erk ? Method::erk : Method::dirk;
}

// A force's expression between the names of inputs in it: texts[0], input[0], texts[1], ...
struct DrivenText {
  std::vector<std::string> texts;
  std::vector<size_t> inputs;

  DrivenText(const std::string& text, const std::vector<InputDef>& known) {
    size_t done = 0;
    for (const NameInText& name : names_in(text)) {
      const std::string word = text.substr(name.at, name.length);
      const auto found = std::find_if(known.begin(), known.end(), [&](const InputDef& i) { return i.name == word; });
      if (found == known.end()) continue;
      texts.push_back(text.substr(done, name.at - done));
      inputs.push_back(found - known.begin());
      done = name.at + name.length;
    }
    texts.push_back(text.substr(done));
  }
  std::string with(const std::vector<InputDef>& values) const {
    std::string out = texts[0];
    for (size_t k = 0; k < inputs.size(); ++k) out += fmt::format("({}){}", values[inputs[k]].value, texts[k + 1]);
    return out;
  }
};

Scene with_user_forces(Scene scene, const std::vector<UserForceOn>& forces) {
  for (const UserForceOn& f : forces) {
    if (!f.force) throw ArgumentError(fmt::format("the user's force on '{}' is no function", f.frame));
    ForceDef def;
    def.name = "user force on " + f.frame;
    def.kind = ForceKind::user;
    def.user = f.force;
    const size_t dot = f.frame.find('.');
    def.on = {f.frame.substr(0, dot), dot == std::string::npos ? "" : f.frame.substr(dot + 1)};
    if (def.on.body == "ground") throw InputError("a user's force acts on a body, not on ground, which does not move");
    scene.forces.push_back(std::move(def));
  }
  return scene;
}

}  // namespace

struct Simulation::State::Data {
  double time = 0.0;
  VecX y;
  Work work;
  FrictionState friction;
  ErrorWeights weights;
  std::vector<InputDef> inputs;
  VecX row;
};

struct Simulation::Impl {
  System system;
  DriveOptions options;
  Method method;
  CurrentOutputs outputs;
  std::vector<std::pair<size_t, DrivenText>> driven;         // loads
  std::vector<std::pair<size_t, DrivenText>> driven_inputs;  // functions that blocks read
  State::Data now, before;                                   // now: without what lives in `system`
  double most_steps;

  Impl(const Scene& scene, const DriveOptions& wanted)
      : system(make_system(with_user_forces(scene, wanted.forces))),
        options(wanted),
        method(one_step_method(system, wanted.method.value_or(scene.simulation.method))),
        outputs(system),
        most_steps(steps_allowed(scene, {})) {
    if (wanted.tolerance) {
      if (!(*wanted.tolerance >= 1e-13 && *wanted.tolerance <= 0.1))
        throw ArgumentError(fmt::format("the tolerance must be a number from 1e-13 to 0.1, found {}", *wanted.tolerance));
      system.tolerance = *wanted.tolerance;
    }
    for (size_t k = 0; k < system.model.loads.size(); ++k)
      if (const std::string& text = system.model.loads[k].def.driven; !text.empty()) driven.emplace_back(k, DrivenText(text, scene.inputs));
    for (const Block& block : system.model.blocks) {
      const std::vector<std::string>& texts = scene.blocks[block.scene_block].driven;
      for (size_t k = 0; k < texts.size(); ++k)
        if (!texts[k].empty()) driven_inputs.emplace_back(static_cast<size_t>(block.inputs[k]), DrivenText(texts[k], scene.inputs));
    }
    now.inputs = scene.inputs;
    RunSpan span;
    integrate(span);
  }

  void integrate(RunSpan& span) {
    int indefinite = -1;
    sim::integrate(
        system, method, span, {options.progress, most_steps, {}}, [](System&, double, const VecX&) {}, indefinite);
    now.time = span.to;
    now.y = std::move(span.state);
    outputs.evaluate(system, now.time, now.y, now.row);
  }

  void save(State::Data& into) const {
    into = now;
    into.work = system.work;
    into.friction = system.friction;
    into.weights = system.weights;
  }
  void load(const State::Data& from) {
    system.work = from.work;
    system.friction = from.friction;
    system.weights = from.weights;
    now.time = from.time;
    now.y = from.y;
    now.row = from.row;
    const bool same = std::equal(from.inputs.begin(), from.inputs.end(), now.inputs.begin(),
                                 [](const InputDef& a, const InputDef& b) { return a.value == b.value; });
    now.inputs = from.inputs;
    if (!same) apply_inputs();
  }

  void apply_inputs() {
    const auto read = [&](size_t function, const std::string& text) {
      Expression& reading = system.model.functions[function].expression;
      reading = Expression(text, std::vector<std::string>(reading.variables()));
    };
    for (const auto& [function, text] : driven_inputs) read(function, text.with(now.inputs));
    for (const auto& [k, text] : driven) {
      Load& load = system.model.loads[k];
      load.def.value = text.with(now.inputs);
      if (load.function >= 0) {
        read(load.function, load.def.value);
      } else {
        system.model.expressions[load.expression] = TimeFunction(Expression(load.def.value));
      }
    }
  }

  size_t find_input(std::string_view name) const {
    std::vector<std::string> known;
    for (size_t k = 0; k < now.inputs.size(); ++k) {
      if (now.inputs[k].name == name) return k;
      known.push_back(now.inputs[k].name);
    }
    throw ArgumentError(fmt::format("the scene has no input {}{}{}", quote(std::string(name)), did_you_mean(name, known),
                                    known.empty() ? "; it has none ([[input]])" : "; there are " + list_words(known)));
  }

  void advance(double to) {
    if (!std::isfinite(to) || !(to > now.time))
      throw ArgumentError(fmt::format("a step must lead to a time later than now, {:.9g} s, found {:.9g} s", now.time, to));
    save(before);
    RunSpan span{{}, now.time, to, true, now.y};
    try {
      integrate(span);
    } catch (...) {
      load(before);
      throw;
    }
  }
};

Simulation::Simulation(const Scene& scene, const DriveOptions& options) : impl_(std::make_unique<Impl>(scene, options)) {}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

void Simulation::set_input(std::string_view name, double value) {
  InputDef& input = impl_->now.inputs[impl_->find_input(name)];
  if (!std::isfinite(value)) throw ArgumentError(fmt::format("the input {} must be a finite number", quote(input.name)));
  if (input.value == value) return;
  input.value = value;
  impl_->apply_inputs();
}

double Simulation::input(std::string_view name) const { return impl_->now.inputs[impl_->find_input(name)].value; }

std::vector<std::string> Simulation::inputs() const {
  std::vector<std::string> names;
  for (const InputDef& input : impl_->now.inputs) names.push_back(input.name);
  return names;
}

void Simulation::step(double dt) { impl_->advance(impl_->now.time + dt); }
void Simulation::advance_to(double time) { impl_->advance(time); }
double Simulation::time() const { return impl_->now.time; }

double Simulation::output(std::string_view column) const {
  const std::vector<std::string>& known = columns();
  const auto found = std::find(known.begin(), known.end(), column);
  if (found == known.end())
    throw ArgumentError(fmt::format("the scene has no output {}{}; there are {}", quote(std::string(column)), did_you_mean(column, known),
                                    list_words(known)));
  return impl_->now.row[found - known.begin()];
}

const VecX& Simulation::outputs() const { return impl_->now.row; }
const std::vector<std::string>& Simulation::columns() const { return impl_->outputs.columns(); }
const std::vector<std::string>& Simulation::units() const { return impl_->outputs.units(); }

double Simulation::State::time() const { return data_ ? data_->time : 0.0; }

Simulation::State Simulation::state() const {
  const auto data = std::make_shared<State::Data>();
  impl_->save(*data);
  State out;
  out.data_ = data;
  return out;
}

void Simulation::restore(const State& state) {
  const State::Data* data = state.data_.get();
  const Model& model = impl_->system.model;
  if (!data || data->work.q.size() != model.nq || data->work.w.size() != model.nv || data->row.size() != impl_->now.row.size() ||
      data->inputs.size() != impl_->now.inputs.size() || data->work.parts.size() != model.parts.size())
    throw ArgumentError("the state is none of this scene's simulations");
  impl_->load(*data);
}

const Notes& Simulation::notes() const { return impl_->system.notes; }
long Simulation::evaluations() const { return impl_->system.evaluations; }
const char* Simulation::method() const { return method_name(impl_->method); }

}  // namespace flexframe::sim
