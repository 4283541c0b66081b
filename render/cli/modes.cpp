// flexframe modes: a mechanism or a SID body swinging in its modes, one film a mode; frequencies over a parameter.
#include "render/cli/commands.h"
#include "render/cli/jobs.h"

#include "render/cli/json_text.h"
#include "render/cli/terminal.h"
#include "render/film/diagram.h"
#include "render/film/overlay.h"
#include "sim/base/error.h"
#include "sim/base/file_output.h"
#include "sim/base/words.h"
#include "sim/bodies/body_file.h"
#include "sim/results/results_file.h"
#include "sim/run/frequency_check.h"
#include "sim/run/integrate_run.h"
#include "sim/run/mode_swing.h"
#include "sim/run/run_scene.h"
#include "sim/start/linearise.h"
#include "sim/start/make_system.h"
#include "sim/time/sample_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;

// "mode 3, 588.2 Hz" of a label as "Eigen Mode 3 : 588.227 Hz"; other labels as they are.
std::string mode_title(int k, const std::string& label) {
  const size_t colon = label.rfind(':');
  if (colon == std::string::npos || !label.ends_with("Hz")) return label;
  char* end = nullptr;
  const double frequency = std::strtod(label.c_str() + colon + 1, &end);
  return std::string(end) == " Hz" ? fmt::format("mode {}, {:.4g} Hz", k, frequency) : label;
}

// ", drawn with 27 mm" where the colours are values that a mode has only for an amplitude.
std::string amplitude_words(const film::RenderSettings& settings, double amplitude) {
  if (settings.color_by != film::ColorBy::stress && settings.color_by != film::ColorBy::strain) return "";
  const auto [unit, factor] = film::readable_unit("m", amplitude);
  return fmt::format(", drawn with {:.3g} {}", amplitude * factor, unit);
}

// Nodes and shapes of the body, for the kernel map. Returns the largest displacement of a node in mode k.
double set_nodes(const sim::FlexibleBody& body, int k, sim::ResultBody& b) {
  const int n = body.n, nodes = static_cast<int>(body.nodes.size());
  b.labels = body.labels;
  b.node_phi.resize(3 * static_cast<Eigen::Index>(nodes), n);
  b.node_psi.resize(3 * static_cast<Eigen::Index>(nodes), n);
  double largest = 0.0;
  for (int i = 0; i < nodes; ++i) {
    b.nodes.push_back({body.nodes[i].name, body.nodes[i].origin});
    const Eigen::Index row = 3 * static_cast<Eigen::Index>(i);
    b.node_phi.middleRows(row, 3) = body.nodes[i].phi;
    b.node_psi.middleRows(row, 3) = body.nodes[i].psi;
    if (body.nodes[i].sigma.cols() == n) {
      b.stress_nodes.push_back(i);
      b.node_stress.conservativeResize(6 * static_cast<Eigen::Index>(b.stress_nodes.size()), n);
      b.node_stress.bottomRows(6) = body.nodes[i].sigma;
    }
    largest = std::max(largest, body.nodes[i].phi.col(k).norm());
  }
  return largest;
}

// Every node of the finite elements' surface, which is then drawn as it is: no map stands between. Returns as set_nodes.
double set_surface(const sim::BodySurface& surface, int k, sim::ResultBody& b) {
  b.surface.points = surface.points;
  b.surface.triangles = sim::surface_triangles(surface);
  double largest = 0.0;
  for (Eigen::Index i = 0; i < surface.points.rows(); ++i) {
    b.nodes.push_back({fmt::format("node[{}]", i), surface.points.row(i).transpose()});
    b.surface.nodes.push_back(static_cast<int>(i));
    largest = std::max(largest, surface.phi.col(k).segment<3>(3 * i).norm());
  }
  return largest;
}

double von_mises(const sim::Vec6& s) {  // xx yy zz xy yz xz
  const sim::Vec3 apart(s[0] - s[1], s[1] - s[2], s[2] - s[0]);
  return std::sqrt(0.5 * apart.squaredNorm() + 3.0 * s.tail<3>().squaredNorm());
}

// Von Mises stress of the surface's nodes in each picture, Pa: the largest that a node has.
sim::MatX surface_von_mises(const sim::BodySurface& surface, int k, const sim::VecX& q) {
  sim::VecX unit(surface.points.rows());
  for (Eigen::Index i = 0; i < unit.size(); ++i) unit[i] = von_mises(surface.stress.col(k).segment<6>(6 * i));
  for (size_t i = 0; i < surface.other_points.size(); ++i) {
    double& there = unit[surface.other_points[i]];
    there = std::max(there, von_mises(surface.other_stress.col(k).segment<6>(6 * static_cast<Eigen::Index>(i))));
  }
  return q.cwiseAbs() * unit.transpose();
}

// One swing of mode k, in equal steps, so that the film loops. amplitude: largest node displacement, m. Shown on the finite elements' own
// surface where `drawn` is true.
sim::Results swing(const sim::BodyFile& file, bool drawn, int k, double amplitude, int pictures, double frame_rate) {
  sim::Results r;
  const int n = file.body.n;
  sim::ResultBody b;
  b.name = "body";
  b.kind = "modal";
  const double largest = drawn ? set_surface(file.surface, k, b) : set_nodes(file.body, k, b);
  if (!(largest > 0.0)) throw sim::InputError(fmt::format("mode {} does not move any node of the body", k + 1));
  r.times = sim::VecX::LinSpaced(pictures, 0.0, (pictures - 1) / frame_rate);
  b.position = Eigen::MatrixX3d::Zero(pictures, 3);
  b.orientation = Eigen::MatrixX4d::Zero(pictures, 4);
  b.orientation.col(0).setOnes();
  sim::VecX q(pictures);
  for (int i = 0; i < pictures; ++i) q[i] = amplitude / largest * std::sin(2.0 * std::numbers::pi * i / pictures);
  if (drawn) {
    b.displacement = q * file.surface.phi.col(k).transpose();
    if (file.surface.stress.size() > 0) b.node_von_mises = surface_von_mises(file.surface, k, q);
  } else {
    b.q = sim::MatX::Zero(pictures, n);
    b.qd = sim::MatX::Zero(pictures, n);
    b.q.col(k) = q;
    b.displacement = b.q * b.node_phi.transpose();
    b.rotation = b.q * b.node_psi.transpose();
  }
  r.bodies.push_back(std::move(b));
  r.kinetic = r.strain = r.potential = r.supplied = r.dissipated = sim::VecX::Zero(pictures);
  return r;
}

struct ModesWords {
  std::string body, mesh, out, over;
  std::vector<std::string> at;
  std::vector<std::string> settings;
  std::vector<int> modes;
  double amplitude = 0.0;
  int pictures = 40;
  bool no_pictures = false, json = false;
  RenderWords render;
};

// Of a film of one mode.
film::RenderSettings swing_settings(film::RenderSettings settings, const RenderWords& words) {
  settings.scales = {1.0};
  settings.speed = 1.0;  // the swing is made for the playback, however short
  settings.undeformed = true;
  settings.inertia = false;  // a mode has no weight, and the times of its pictures are no times of its motion
  apply_words(words, settings);
  return settings;
}

void animate_body(const ModesWords* w) {
  const sim::BodyFile file = sim::read_body(w->body, w->body);
  const sim::FlexibleBody& body = file.body;
  if (body.n == 0) throw sim::InputError(fmt::format("{}: a rigid body has no modes", w->body));
  const bool drawn = w->mesh.empty() && file.surface.faces.rows() > 0;
  if (body.nodes.empty() && !drawn) throw sim::InputError(fmt::format("{}: the body has no nodes", w->body));
  std::vector<int> modes = w->modes;
  if (modes.empty())
    for (int k = 1; k <= body.n; ++k) modes.push_back(k);
  for (int k : modes)
    if (k < 1 || k > body.n) throw sim::InputError(fmt::format("{}: mode {}: there are 1 to {}", w->body, k, body.n));
  fs::path mesh = w->mesh;
  if (mesh.empty() && !drawn) {
    const fs::path beside = fs::path(w->body).replace_extension(".obj");
    if (fs::exists(beside)) mesh = beside;
  } else if (!drawn && !fs::exists(mesh)) {
    throw sim::InputError(fmt::format("{}: no such file", mesh.string()));
  }
  Eigen::AlignedBox3d box;
  for (const sim::FlexibleNode& node : body.nodes) box.extend(node.origin);
  for (Eigen::Index i = 0; i < file.surface.points.rows(); ++i) box.extend(sim::Vec3(file.surface.points.row(i).transpose()));
  const double amplitude = w->amplitude > 0.0 ? w->amplitude : 0.05 * box.diagonal().norm();
  const std::string name = fs::path(w->body).stem().string();
  const fs::path out = w->out.empty() ? fs::path(name + "-modes") : fs::path(w->out);
  require_writable(out);
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (int k : modes) {
    film::RenderSettings settings;
    settings.ground = false;
    settings = swing_settings(settings, w->render);
    const std::string label = body.labels.empty() ? fmt::format("mode {}", k) : body.labels[k - 1];
    sim::Results results = swing(file, drawn, k - 1, amplitude, w->pictures, settings.frame_rate);
    results.title = fmt::format("{}: {}{}", name, mode_title(k, label), amplitude_words(settings, amplitude));
    if (!mesh.empty()) results.bodies[0].mesh = fs::absolute(mesh).string();
    const std::string part = modes.size() == 1 ? name : fmt::format("mode_{:03}", k);
    const DrawingReport report = run_drawing(results, settings, nullptr, w->render, modes.size() == 1 ? out : out / part, part);
    if (!w->json) print_drawing(report);
    json.push_back({{"mode", k}, {"label", label}, {"drawing", drawing_json(report)}});
  }
  if (w->json) fmt::print("{}\n", json_text(json));
}

// "12.3 Hz, damping 0.01", "unstable, growth 3 1/s", "moves freely".
std::string mode_text(const sim::LinearMode& mode) {
  switch (mode.kind) {
    case sim::LinearMode::unstable:
      return fmt::format("unstable, {:.5g} Hz, grows by {:.4g} 1/s", mode.frequency, mode.growth);
    case sim::LinearMode::rigid:
      return "moves freely";
    case sim::LinearMode::overdamped:
      return fmt::format("overdamped, {:.4g} 1/s", mode.pole.real());
    default:
      return fmt::format("{:.5g} Hz, damping {:.4g}", mode.frequency, mode.damping);
  }
}

// What is known about a state and its modes, so that they are not read as what they are not: `modes` is where they are read.
sim::Notes about_modes(const sim::System& system, const sim::Linearisation& linear) {
  sim::Notes told = system.notes;
  told.warn(linear.warnings);
  // Where the start leaves its place because it is no equilibrium the equations change for that reason alone.
  const bool change_anyway = linear.equilibrium && !linear.constant;
  for (const std::string& note : linear.notes) {
    if (change_anyway && note == sim::equations_change) told.warn("", note);
    else told.tell("", note);
  }
  if (!linear.equilibrium)
    told.warn("", linear.moving
                      ? "the start is no steady motion, what can give way is not where that motion holds it: frequencies and damping "
                        "are those about another state; start = \"static\" begins in it"
                      : "the start is no equilibrium: frequencies and damping are those about places that the mechanism leaves; "
                        "start = \"static\" begins in one");
  if (linear.turning_axes)
    told.tell("", "frequencies are those seen from the bodies that turn: seen from outside they differ by multiples of the turning rate");
  return told;
}

// How right the frequencies are, and vibrations that the model does not have.
void tell_how_right(const sim::System& system, const sim::Linearisation& linear, sim::Notes& told) {
  const double highest = sim::sixth_frequency(linear);
  sim::tell_of_frequencies(system, linear, sim::richer_beams(system, told), sim::unasked_accuracy, highest, told);
  sim::tell_of_left_vibrations(system, linear, highest, sim::Severity::warning, told);
}

std::vector<int> chosen_modes(const ModesWords& w, size_t count) {
  std::vector<int> modes = w.modes;
  // Of many the first are what one wants to see.
  if (modes.empty())
    for (int k = 1; k <= static_cast<int>(std::min<size_t>(count, 10)); ++k) modes.push_back(k);
  for (const int k : modes)
    if (k < 1 || k > static_cast<int>(count)) throw sim::InputError(fmt::format("{}: mode {}: there are 1 to {}", w.body, k, count));
  return modes;
}

void animate_mechanism(const ModesWords& w) {
  const Job job = read_job(w.body, w.settings);
  const sim::System system = sim::make_system(job.scene);
  const sim::Linearisation linear = sim::linearise(system);
  if (linear.modes.empty()) throw sim::InputError(fmt::format("{}: the mechanism has no degree of freedom", w.body));
  sim::Notes told = about_modes(system, linear);
  tell_how_right(system, linear, told);
  const std::vector<std::string> warnings = told.texts(sim::Severity::warning), notes = told.texts(sim::Severity::note);
  const std::vector<int> modes = chosen_modes(w, linear.modes.size());
  nlohmann::ordered_json json = {{"warnings", warnings}, {"notes", notes}, {"modes", nlohmann::ordered_json::array()}};
  for (const sim::LinearMode& mode : linear.modes)
    json["modes"].push_back({{"frequency", mode.frequency},
                             {"damping", mode.damping},
                             {"pole", {mode.pole.real(), mode.pole.imag()}},
                             {"what", mode_text(mode)}});
  if (!w.json) {
    for (const std::string& warning : warnings) fmt::print("WARNING    {}\n", warning);
    for (const std::string& note : notes) fmt::print("note       {}\n", note);
    for (size_t k = 0; k < linear.modes.size() && k < 40; ++k) fmt::print("mode {:>3}   {}\n", k + 1, mode_text(linear.modes[k]));
  }
  if (w.no_pictures) {
    if (w.json) fmt::print("{}\n", json_text(json));
    return;
  }
  const std::string name = fs::path(w.body).stem().string();
  const fs::path out = w.out.empty() ? fs::path(name + "-modes") : fs::path(w.out);
  require_writable(out);
  const double amplitude = w.amplitude > 0.0 ? w.amplitude : 0.05 * system.model.size;
  for (const int k : modes) {
    const sim::LinearMode& mode = linear.modes[k - 1];
    const film::RenderSettings settings = swing_settings(job.settings, w.render);
    sim::Results results = sim::swing_in_mode(system, mode, amplitude, w.pictures, w.pictures / settings.frame_rate);
    results.title = fmt::format("{}: mode {}, {}{}", job.scene.title, k, mode_text(mode), amplitude_words(settings, amplitude));
    const std::string part = modes.size() == 1 ? name : fmt::format("mode_{:03}", k);
    const DrawingReport report = run_drawing(results, settings, &job.scene, w.render, modes.size() == 1 ? out : out / part, part);
    if (!w.json) print_drawing(report);
    json["modes"][k - 1]["drawing"] = drawing_json(report);
  }
  if (w.json) fmt::print("{}\n", json_text(json));
}

// "w=0:100:21": a parameter or key, from, to, how many.
struct Sweep {
  std::string name;
  double from = 0.0, to = 0.0;
  int count = 0;
};
Sweep parse_sweep(const std::string& text) {
  Sweep sweep;
  const size_t equals = text.find('=');
  const auto refuse = [&]() -> UsageError {
    return UsageError(
        fmt::format("--over {}: NAME=FROM:TO:COUNT is expected, a parameter or key of the scene, two numbers and how many values "
                    "(2 to 10000)",
                    sim::quote(text)));
  };
  if (equals == std::string::npos || equals == 0) throw refuse();
  sweep.name = text.substr(0, equals);
  char* end = nullptr;
  sweep.from = std::strtod(text.c_str() + equals + 1, &end);
  if (*end != ':') throw refuse();
  sweep.to = std::strtod(end + 1, &end);
  if (*end != ':') throw refuse();
  sweep.count = static_cast<int>(std::strtol(end + 1, &end, 10));
  if (*end != '\0' || sweep.count < 2 || sweep.count > 10000) throw refuse();
  return sweep;
}

// Frequencies and damping over a value, CSV and SVG.
class ModeTable {
 public:
  ModeTable(const ModesWords& w, const std::string& over, const std::string& label)
      : name_(fs::path(w.body).stem().string()),
        over_(over),
        out_(w.out.empty() ? fs::path(name_ + "-modes") : fs::path(w.out)),
        csv_(over + ",mode,kind,frequency,damping,real,imaginary\n"),
        diagram_{.title = name_ + ": modes over " + over, .x_label = label, .y_label = "frequency, Hz", .note = {}, .series = {}},
        stable_{.label = "stable", .points = {}, .line = false},
        unstable_{.label = "unstable", .points = {}, .line = false} {
    diagram_.linear_x = diagram_.linear_y = true;
    make_folder(out_);
  }
  void add(double value, const std::vector<sim::LinearMode>& modes) {
    int number = 0;
    ++values_;
    for (const sim::LinearMode& mode : modes) {
      constexpr const char* kinds[]{"unstable", "rigid", "vibration", "overdamped"};
      csv_ += fmt::format("{},{},{},{},{},{},{}\n", value, ++number, kinds[mode.kind], mode.frequency, mode.damping, mode.pole.real(),
                          mode.pole.imag());
      if (mode.frequency > 0.0)
        (mode.kind == sim::LinearMode::unstable ? unstable_ : stable_).points.push_back({value, mode.frequency, false, {}});
    }
  }
  // What holds of the modes at a value. A sentence that comes at several is told once, with the numbers of the first.
  void tell(double value, const sim::Notes& notes) {
    for (const sim::Severity severity : {sim::Severity::warning, sim::Severity::note})
      for (const std::string& text : notes.texts(severity)) {
        const auto same = std::find_if(told_.begin(), told_.end(), [&](const Told& t) {
          return t.severity == severity && without_numbers(t.text) == without_numbers(text);
        });
        if (same == told_.end()) told_.push_back({severity, text, value, 1});
        else ++same->count;
      }
  }
  int values() const { return values_; }
  void write() {
    diagram_.series.push_back(std::move(stable_));
    if (!unstable_.points.empty()) diagram_.series.push_back(std::move(unstable_));
    sim::write_whole_file(out_ / (name_ + ".csv"), csv_);
    sim::write_whole_file(out_ / (name_ + ".svg"), film::diagram_svg(diagram_));
    for (const sim::Severity severity : {sim::Severity::warning, sim::Severity::note})
      for (const Told& t : told_) {
        if (t.severity != severity) continue;
        const std::string also = t.count > 1 && t.count < values_ ? fmt::format(" and at {} more", t.count - 1) : "";
        const std::string where = t.count == values_ ? "" : fmt::format("at {} = {:.6g}{}: ", over_, t.value, also);
        fmt::print("{} {}{}\n", severity == sim::Severity::warning ? "WARNING   " : "note      ", where, t.text);
      }
    fmt::print("modes      {}\ndiagram    {}\n", (out_ / (name_ + ".csv")).string(), (out_ / (name_ + ".svg")).string());
  }

 private:
  struct Told {
    sim::Severity severity;
    std::string text;
    double value;
    int count;
  };
  static std::string without_numbers(std::string text) {
    std::erase_if(text, [](char c) { return (c >= '0' && c <= '9') || c == '.' || c == '-' || c == '+'; });
    return text;
  }

  std::string name_, over_;
  fs::path out_;
  std::string csv_;
  film::Diagram diagram_;
  film::DiagramSeries stable_, unstable_;
  std::vector<Told> told_;
  int values_ = 0;
};

// At times of a run: of the mechanism as it stands there.
void modes_at_times(const ModesWords& w) {
  const Job job = read_job(w.body, w.settings);
  std::vector<double> times;
  for (const std::string& text : w.at) {
    char* end = nullptr;
    const double t = std::strtod(text.c_str(), &end);
    if (text.empty() || *end != '\0' || !(t >= 0.0 && t <= job.scene.simulation.duration))
      throw UsageError(fmt::format("--at {}: times from 0 to the scene's duration, {} s, are expected", sim::quote(text),
                                   job.scene.simulation.duration));
    times.push_back(t);
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  ModeTable table(w, "t", "time, s");
  sim::System system = sim::make_system(job.scene);
  sim::RunSpan span = sim::whole_run(job.scene.simulation, times);
  int indefinite = -1;
  sim::integrate(
      system, job.scene.simulation.method, span, {},
      [&](sim::System& s, double t, const sim::VecX& y) {
        sim::set_state(s, t, y.data(), false);
        sim::require_sample_closed(s, false);
        const sim::Linearisation linear = sim::linearise(s);
        table.add(t, linear.modes);
        // That they are those of one time is what was asked for.
        sim::Notes told;
        told.warn(linear.warnings);
        for (const std::string& note : linear.notes)
          if (note != sim::equations_change) told.tell("", note);
        table.tell(t, told);
        fmt::print("t = {:.6g} s{}\n", t, linear.equilibrium ? "" : ": about the positions there, which the mechanism leaves");
        for (size_t k = 0; k < linear.modes.size() && k < 10; ++k) fmt::print("mode {:>3}   {}\n", k + 1, mode_text(linear.modes[k]));
      },
      indefinite);
  table.write();
}

// Over a parameter, over a speed the Campbell diagram.
void sweep_modes(const ModesWords& w) {
  const Sweep sweep = parse_sweep(w.over);
  ModeTable table(w, sweep.name, sweep.name);
  Progress progress("modes");
  for (int i = 0; i < sweep.count; ++i) {
    const double value = sweep.from + (sweep.to - sweep.from) * i / (sweep.count - 1);
    std::vector<std::string> settings = w.settings;
    settings.push_back(fmt::format("{}={}", sweep.name, value));
    // A column beyond its critical load ends a sweep no more than it ends a table by hand.
    const Job job = read_job(w.body, settings);
    try {
      const sim::System system = sim::make_system(job.scene);
      const sim::Linearisation linear = sim::linearise(system);
      table.add(value, linear.modes);
      sim::Notes told = about_modes(system, linear);
      // How right they are costs several times as much as the modes: told at both ends.
      if (i == 0 || i == sweep.count - 1) tell_how_right(system, linear, told);
      table.tell(value, told);
    } catch (const Error& e) {
      const bool known = dynamic_cast<const sim::InputError*>(&e) || dynamic_cast<const sim::SimulationError*>(&e);
      if (!known || (i == sweep.count - 1 && table.values() == 0)) throw;
      sim::Notes told;
      told.warn("", fmt::format("no modes: {}", e.what()));
      table.tell(value, told);
    }
    progress.show((i + 1.0) / sweep.count);
  }
  table.write();
}

}  // namespace

Command add_modes(Program& program) {
  const auto w = std::make_shared<ModesWords>();
  Subcommand app =
      program.subcommand("modes", "modes of a mechanism about its start or of a flexible body: films, frequencies over a parameter");
  app.option("FILE", w->body, "scene file (.toml), or flexible body (.sid, .SID_FEM, .h5)").required();
  app.option("--mesh", w->mesh, "Wavefront mesh of the undeformed body; default: BODY.obj beside it").as("FILE");
  app.option("-o,--out", w->out, "output folder; default: the name of the body").as("DIR");
  app.option("--mode", w->modes, "which modes, from 1; default: all, of a scene the first ten")
      .as("LIST")
      .list(Option::is_number)
      .separated_by(',');
  app.option("--amplitude", w->amplitude, "largest displacement drawn, m; default: 5 % of the size").positive();
  app.option("--pictures", w->pictures, "number of pictures of one period").range(2, 10000).show_default();
  app.option("--over", w->over, "of a scene: frequencies and damping over a parameter or key (Campbell diagram), CSV and SVG")
      .as("NAME=FROM:TO:COUNT");
  app.option("--at", w->at, "of a scene: frequencies and damping at these times of its run, s, as 0.1,0.5; CSV and SVG")
      .as("LIST")
      .list(Option::is_number)
      .separated_by(',');
  app.flag("--no-pictures", w->no_pictures, "of a scene: the table alone");
  app.flag("--json", w->json, "summary as JSON: one entry a mode");
  add_scene_words(app, w->settings);
  add_render_words(app, w->render);
  app.example("part.sid", "every mode of part.sid on part.obj: part-modes/mode_001/...");
  app.example("part.sid --mode 1,2 --size 640x360 -o swing", "the first two");
  app.example("crank.toml --no-pictures", "the table of the mechanism's modes");
  return {app, [w] {
            if (fs::path(w->body).extension() != ".toml") {
              if (!w->over.empty() || !w->at.empty() || !w->settings.empty() || w->no_pictures)
                throw UsageError("--over, --at, --set and --no-pictures belong to scenes (SCENE.toml)");
              animate_body(w.get());
            } else if (!w->mesh.empty()) {
              throw UsageError("--mesh belongs to SID bodies; a scene names its meshes");
            } else if (!w->over.empty() && !w->at.empty()) {
              throw UsageError("--over and --at exclude each other: modes over a parameter, or over time");
            } else if (!w->over.empty()) {
              sweep_modes(*w);
            } else if (!w->at.empty()) {
              modes_at_times(*w);
            } else {
              animate_mechanism(*w);
            }
            return 0;
          }};
}

}  // namespace flexframe::cli
