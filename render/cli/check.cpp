// flexframe check: is the scene sound, and what would be simulated.
#include "render/cli/commands.h"
#include "render/cli/jobs.h"
#include "render/cli/json_text.h"

#include "sim/dynamics/directions.h"
#include "sim/model/mounted_modes.h"
#include "sim/results/outputs.h"
#include "sim/run/across_plane.h"
#include "sim/run/effect_report.h"
#include "sim/run/expected_turn.h"
#include "sim/run/frequency_check.h"
#include "sim/run/run_scene.h"
#include "sim/start/linearise.h"
#include "sim/start/make_system.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::cli {
namespace {

// A coordinate that moves in a mode: "joint 'pivot'", "'rod' bending_xy 2"; its amplitude in metres (rotations times the size of
// their loop or body), the largest 1, negative where it moves against that one; and by how many degrees it runs ahead of that (-90 .. 90).
struct Mover {
  std::string name;
  double part = 0.0, phase = 0.0;
};

// The label of an elastic coordinate without the frequency behind it, and with single blanks: "Eigen Mode 1".
std::string plain(const std::string& label) {
  std::string out;
  for (const char c : label.substr(0, label.find_first_of(":(")))
    if (c != ' ' || (!out.empty() && out.back() != ' ')) out += c;
  while (!out.empty() && out.back() == ' ') out.pop_back();
  return out;
}

// Those that move by a twentieth of the largest at least, largest first.
std::vector<Mover> movers(const sim::System& system, const sim::LinearMode& mode) {
  const sim::VecX sizes = sim::rate_sizes(system.model);
  Eigen::VectorXcd metres(sizes.size());
  metres.real() = mode.shape.cwiseProduct(sizes);
  metres.imag() = mode.quadrature.cwiseProduct(sizes);
  Eigen::Index top = 0;
  if (metres.size() == 0 || !(metres.cwiseAbs().maxCoeff(&top) > 0.0)) return {};
  std::vector<Mover> out;
  const auto add = [&](const std::string& name, std::complex<double> part) {
    if (std::abs(part) < 0.05) return;
    const double sign = part.real() < -1e-9 * std::abs(part) ? -1.0 : 1.0;
    const double phase = std::arg(sign * part) * 180.0 / std::numbers::pi;
    out.push_back({name, sign * std::abs(part), std::abs(phase) < 0.05 ? 0.0 : phase});
  };
  for (const sim::Part& p : system.model.parts) {
    for (int k = 0; k < p.joint.nv; ++k)
      add(fmt::format("joint '{}'{}", p.joint.name, p.joint.nv > 1 ? fmt::format(" ({})", k + 1) : ""), metres[p.v0 + k] / metres[top]);
    for (int k = 0; k < p.body.n; ++k) {
      const std::string label = k < static_cast<int>(p.body.labels.size()) ? plain(p.body.labels[k]) : fmt::format("coordinate {}", k + 1);
      add(fmt::format("'{}' {}", p.name, label), metres[p.ev0 + k] / metres[top]);
    }
  }
  std::stable_sort(out.begin(), out.end(), [](const Mover& a, const Mover& b) { return std::abs(a.part) > std::abs(b.part); });
  return out;
}

// The shape of a mode in a line: "joint 'a' 1, joint 'b' -0.41, joint 'c' 0.2 (90 degrees ahead), 3 more".
std::string describe(const std::vector<Mover>& all) {
  std::string text;
  constexpr size_t shown = 5;
  for (size_t k = 0; k < std::min(all.size(), shown); ++k) {
    text += fmt::format("{}{} {:.3g}", k > 0 ? ", " : "", all[k].name, all[k].part);
    if (std::abs(all[k].phase) >= 1.0)
      text += fmt::format(" ({:.0f} degrees {})", std::abs(all[k].phase), all[k].phase > 0.0 ? "ahead" : "behind");
  }
  if (all.size() > shown) text += fmt::format(", {} more", all.size() - shown);
  return text;
}

// A damped body's modes by themselves and as the scene's joints hold it.
struct BodyDamping {
  sim::VecX alone_hz, alone, mounted_hz, mounted;
};

std::optional<BodyDamping> damping_of(const sim::System& system, const sim::Part& part) {
  if (part.scene_body < 0 || part.body.De.size() == 0 || system.model.pieces[part.scene_body].size() != 1) return std::nullopt;
  const std::vector<sim::Support> holds = sim::mounting_of(system.scene, system.scene.bodies[part.scene_body].name);
  const sim::MountedModes alone = sim::mounted_modes(part.body, sim::MatX(0, 6 + part.body.n));
  const sim::MountedModes mounted = sim::mounted_modes(part.body, sim::held_rows(system.scene, part.scene_body, part.body, holds, {}));
  if (alone.omega.size() == 0 || mounted.omega.size() == 0) return std::nullopt;
  return BodyDamping{alone.omega / (2.0 * M_PI), sim::mounted_ratios(part.body, alone), mounted.omega / (2.0 * M_PI),
                     sim::mounted_ratios(part.body, mounted)};
}

// A mode in a line, without its shape.
std::string describe(const sim::LinearMode& mode) {
  const double re = mode.pole.real(), im = mode.pole.imag();
  switch (mode.kind) {
    case sim::LinearMode::unstable:
      if (im == 0.0) return fmt::format("unstable, pole {:.9g} 1/s", mode.growth);
      return fmt::format("unstable, {:.10g} Hz, damping {:.4g}, poles {:.9g} +- {:.9g}i 1/s", mode.frequency, mode.damping, re, im);
    case sim::LinearMode::rigid:
      return "0 Hz (rigid)";
    case sim::LinearMode::overdamped:
      return fmt::format("overdamped, pole {:.9g} 1/s (falls to 37 % in {:.3g} s)", re, -1.0 / re);
    default:
      return fmt::format("{:.10g} Hz, damping {:.4g}{}", mode.frequency, mode.damping,
                         re == 0.0 ? "" : fmt::format(", poles {:.6g} +- {:.9g}i 1/s", re, im));
  }
}

const char* kind_word(const sim::LinearMode& mode) {
  switch (mode.kind) {
    case sim::LinearMode::unstable:
      return "unstable";
    case sim::LinearMode::rigid:
      return "rigid";
    case sim::LinearMode::overdamped:
      return "overdamped";
    default:
      return "vibration";
  }
}

// What the linearisation is about.
std::string about(const sim::Linearisation& linear) {
  std::string text = linear.moving ? "about the start's steady motion" : "about the start";
  if (!linear.equilibrium) text += " (no equilibrium: the mechanism will leave it; start = \"static\" begins in one)";
  if (linear.turning_axes) text += "; frequencies as seen from the bodies that turn";
  return text;
}

void print_report(const std::string& scene, const sim::System& system, const sim::Linearisation& linear) {
  fmt::print("{}: sound\n", scene);
  int joints = 0, elastic = 0;
  for (const sim::Part& p : system.model.parts) {
    fmt::print("body       {}: {:.6g} kg, {} joint and {} elastic coordinates\n", p.name, p.body.mass, p.joint.nv, p.body.n);
    if (const auto d = damping_of(system, p))
      fmt::print("           damping of its first mode {:.4g} at {:.6g} Hz as its joints hold it, {:.4g} at {:.6g} Hz alone\n",
                 d->mounted[0], d->mounted_hz[0], d->alone[0], d->alone_hz[0]);
    joints += p.joint.nv;
    elastic += p.body.n;
  }
  size_t free = 0;
  for (const sim::ClusterWork& c : system.work.clusters) free += c.partition.ind.size();
  fmt::print("freedom    {} coordinates ({} of joints, {} elastic), {} closed by loops, {} degrees of freedom\n", joints + elastic, joints,
             elastic, static_cast<size_t>(joints + elastic) - free, free);
  for (const std::string& warning : system.notes.texts(sim::Severity::warning)) fmt::print("WARNING    {}\n", warning);
  for (const std::string& note : system.notes.texts(sim::Severity::note)) fmt::print("note       {}\n", note);
  for (const std::string& warning : linear.warnings) fmt::print("WARNING    {}\n", warning);
  fmt::print("linearised {}\n", about(linear));
  for (const std::string& note : linear.notes) fmt::print("note       {}\n", note);
  int k = 0;
  for (const sim::LinearMode& mode : linear.modes) {
    if (++k > 40) {
      fmt::print("           ... {} more\n", linear.modes.size() - 40);
      break;
    }
    fmt::print("mode {:>3}   {}, {}\n", k, describe(mode), describe(movers(system, mode)));
  }
}

void print_json(const sim::System& system, const sim::Linearisation& linear) {
  nlohmann::json out;
  for (const sim::Part& p : system.model.parts) {
    out["bodies"].push_back(
        {{"name", p.name}, {"mass", p.body.mass}, {"joint_coordinates", p.joint.nv}, {"elastic_coordinates", p.body.n}});
    const auto d = damping_of(system, p);
    if (!d) continue;
    const auto list = [](const sim::VecX& hz, const sim::VecX& ratio) {
      nlohmann::json modes = nlohmann::json::array();
      for (Eigen::Index k = 0; k < hz.size(); ++k) modes.push_back({{"frequency", hz[k]}, {"damping", ratio[k]}});
      return modes;
    };
    out["bodies"].back()["alone"] = list(d->alone_hz, d->alone);
    out["bodies"].back()["mounted"] = list(d->mounted_hz, d->mounted);
  }
  std::vector<std::string> warnings = system.notes.texts(sim::Severity::warning);
  warnings.insert(warnings.end(), linear.warnings.begin(), linear.warnings.end());
  out["warnings"] = warnings;
  out["notes"] = system.notes.texts(sim::Severity::note);
  out["equilibrium"] = linear.equilibrium;
  out["linearised"] = about(linear);
  out["linearisation_notes"] = linear.notes;
  out["modes"] = nlohmann::json::array();
  for (const sim::LinearMode& mode : linear.modes) {
    nlohmann::json shape = nlohmann::json::array();
    for (const Mover& m : movers(system, mode)) shape.push_back({{"coordinate", m.name}, {"part", m.part}, {"phase", m.phase}});
    out["modes"].push_back({{"kind", kind_word(mode)},
                            {"frequency", mode.frequency},
                            {"growth", mode.growth},
                            {"damping", mode.damping},
                            {"real", mode.pole.real()},
                            {"imaginary", mode.pole.imag()},
                            {"shape", shape}});
  }
  fmt::print("{}\n", json_text(out));
}

}  // namespace

Command add_check(Program& program) {
  struct Words {
    std::string scene;
    std::vector<std::string> settings;
    bool json = false;
  };
  const auto words = std::make_shared<Words>();
  Subcommand app = program.subcommand("check", "validate a scene; bodies, degrees of freedom, effects, linearised frequencies");
  app.option("SCENE", words->scene, "scene file (TOML)").required();
  add_scene_words(app, words->settings);
  app.flag("--json", words->json, "report as JSON");
  app.example("crane.toml", "is it valid; degrees of freedom, effects and why, frequencies");

  return {app, [words] {
            const Job job = read_job(words->scene, words->settings);
            sim::System system = sim::make_system(job.scene);
            sim::Model with_outputs = system.model;
            sim::plan_outputs(with_outputs, system.scene);  // places that outputs name and that nothing has
            system.notes.tell(job.mesh_notes);
            system.notes.append(sim::expected_turns(system, sim::unasked_accuracy));
            sim::warn_of_leaving_plane(job.scene, sim::effect_states(job.scene, system.model), system.notes);
            const sim::Linearisation linear = sim::linearise(system);
            sim::tell_of_frequencies(system, linear, sim::richer_beams(system, system.notes), sim::unasked_accuracy,
                                     sim::sixth_frequency(linear), system.notes);
            sim::tell_of_left_vibrations(system, linear, sim::sixth_frequency(linear), sim::Severity::note, system.notes);
            if (words->json) {
              print_json(system, linear);
              return 0;
            }
            print_report(words->scene, system, linear);
            return 0;
          }};
}

}  // namespace flexframe::cli
