// flexframe check: is the scene sound, and what would be simulated.
#include "render/cli/commands.h"
#include "render/cli/jobs.h"

#include "sim/dynamics/directions.h"
#include "sim/start/linearise.h"
#include "sim/start/make_system.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace flexframe::cli {
namespace {

// A coordinate that moves in a mode: "joint 'pivot'", "'rod' bending_xy 2"; its part of the mode in metres (rotations times the size of
// their loop or body), the largest 1.
struct Mover {
  std::string name;
  double part = 0.0;
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
std::vector<Mover> movers(const sim::System& system, const sim::VecX& shape) {
  const sim::VecX metres = shape.cwiseProduct(sim::rate_sizes(system.model));
  Eigen::Index top = 0;
  if (metres.size() == 0 || !(metres.cwiseAbs().maxCoeff(&top) > 0.0)) return {};
  std::vector<Mover> out;
  const auto add = [&](const std::string& name, double part) {
    if (std::abs(part) >= 0.05) out.push_back({name, part});
  };
  for (const sim::Part& p : system.model.parts) {
    for (int k = 0; k < p.joint.nv; ++k)
      add(fmt::format("joint '{}'{}", p.joint.name, p.joint.nv > 1 ? fmt::format(" ({})", k + 1) : ""), metres[p.v0 + k] / metres[top]);
    for (int k = 0; k < p.body.n; ++k) {
      const std::string label = k < static_cast<int>(p.body.labels.size()) ? plain(p.body.labels[static_cast<size_t>(k)]) : fmt::format("coordinate {}", k + 1);
      add(fmt::format("'{}' {}", p.name, label), metres[p.ev0 + k] / metres[top]);
    }
  }
  std::stable_sort(out.begin(), out.end(), [](const Mover& a, const Mover& b) { return std::abs(a.part) > std::abs(b.part); });
  return out;
}

// The shape of a mode in a line: "joint 'a' 1, joint 'b' -0.41, 3 more".
std::string describe(const std::vector<Mover>& all) {
  std::string text;
  constexpr size_t shown = 5;
  for (size_t k = 0; k < std::min(all.size(), shown); ++k) text += fmt::format("{}{} {:.3g}", k > 0 ? ", " : "", all[k].name, all[k].part);
  if (all.size() > shown) text += fmt::format(", {} more", all.size() - shown);
  return text;
}

void print_report(const std::string& scene, const sim::System& system, const sim::Linearisation& linear) {
  fmt::print("{}: sound\n", scene);
  int joints = 0, elastic = 0;
  for (const sim::Part& p : system.model.parts) {
    fmt::print("body       {}: {:.6g} kg, {} joint and {} elastic coordinates\n", p.name, p.body.mass, p.joint.nv, p.body.n);
    joints += p.joint.nv;
    elastic += p.body.n;
  }
  size_t free = 0;
  for (const sim::ClusterWork& c : system.work.clusters) free += c.partition.ind.size();
  fmt::print("freedom    {} coordinates ({} of joints, {} elastic), {} closed by loops, {} degrees of freedom\n", joints + elastic, joints, elastic,
             static_cast<size_t>(joints + elastic) - free, free);
  for (const std::string& warning : system.notes.texts(sim::Severity::warning)) fmt::print("WARNING    {}\n", warning);
  for (const std::string& note : system.notes.texts(sim::Severity::note)) fmt::print("note       {}\n", note);
  fmt::print("linearised about the start{}\n", linear.equilibrium ? "" : " (no equilibrium: the mechanism will leave it)");
  int k = 0;
  for (const sim::LinearMode& mode : linear.modes) {
    if (++k > 40) {
      fmt::print("           ... {} more\n", linear.modes.size() - 40);
      break;
    }
    if (mode.growth > 0.0) fmt::print("mode {:>3}   unstable, pole {:.9g} 1/s, {}\n", k, mode.growth, describe(movers(system, mode.shape)));
    else if (mode.frequency == 0.0) fmt::print("mode {:>3}   0 Hz (rigid), {}\n", k, describe(movers(system, mode.shape)));
    else fmt::print("mode {:>3}   {:.10g} Hz, damping {:.4g}, {}\n", k, mode.frequency, mode.damping, describe(movers(system, mode.shape)));
  }
}

void print_json(const sim::System& system, const sim::Linearisation& linear) {
  nlohmann::json out;
  for (const sim::Part& p : system.model.parts)
    out["bodies"].push_back({{"name", p.name}, {"mass", p.body.mass}, {"joint_coordinates", p.joint.nv}, {"elastic_coordinates", p.body.n}});
  out["warnings"] = system.notes.texts(sim::Severity::warning);
  out["notes"] = system.notes.texts(sim::Severity::note);
  out["equilibrium"] = linear.equilibrium;
  out["modes"] = nlohmann::json::array();
  for (const sim::LinearMode& mode : linear.modes) {
    nlohmann::json shape = nlohmann::json::array();
    for (const Mover& m : movers(system, mode.shape)) shape.push_back({{"coordinate", m.name}, {"part", m.part}});
    out["modes"].push_back({{"frequency", mode.frequency}, {"growth", mode.growth}, {"damping", mode.damping}, {"shape", shape}});
  }
  fmt::print("{}\n", out.dump(2));
}

}  // namespace

Command add_check(Program& program) {
  struct Words {
    std::string scene;
    bool json = false;
  };
  const auto words = std::make_shared<Words>();
  Subcommand app = program.subcommand("check", "validate a scene; bodies, degrees of freedom, effects, linearised frequencies");
  app.option("SCENE", words->scene, "scene file (TOML)").required();
  app.flag("--json", words->json, "report as JSON");

  return {app, [words] {
            const Job job = read_job(words->scene);
            const sim::System system = sim::make_system(job.scene);
            const sim::Linearisation linear = sim::linearise(system);
            if (words->json) {
              print_json(system, linear);
              return 0;
            }
            print_report(words->scene, system, linear);
            return 0;
          }};
}

}  // namespace flexframe::cli
