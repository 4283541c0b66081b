// flexframe check: is the scene sound, and what would be simulated.
#include "render/cli/commands.h"
#include "render/cli/jobs.h"

#include "sim/linearise.h"
#include "sim/system.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <memory>

namespace flexframe::cli {
namespace {

// Which coordinate moves most in a mode: "joint 'pivot'", "elastic coordinate 2 of 'rod'".
std::string leader(const sim::System& system, const sim::VecX& shape) {
  Eigen::Index at = 0;
  if (shape.size() == 0) return "";
  shape.cwiseAbs().maxCoeff(&at);
  for (const sim::Part& p : system.model.parts) {
    if (at >= p.v0 && at < p.v0 + p.joint.nv) return fmt::format("joint '{}'", p.joint.name);
    if (at >= p.ev0 && at < p.ev0 + p.body.n) return fmt::format("bending of '{}'", p.name);
  }
  return "";
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
  for (const std::string& note : system.notes) fmt::print("note       {}\n", note);
  fmt::print("linearised about the start{}\n", linear.equilibrium ? "" : " (no equilibrium: the mechanism will leave it)");
  int k = 0;
  for (const sim::LinearMode& mode : linear.modes) {
    if (++k > 40) {
      fmt::print("           ... {} more\n", linear.modes.size() - 40);
      break;
    }
    if (mode.growth > 0.0) fmt::print("mode {:>3}   unstable, pole {:.9g} 1/s, {}\n", k, mode.growth, leader(system, mode.shape));
    else if (mode.frequency == 0.0) fmt::print("mode {:>3}   0 Hz (rigid), {}\n", k, leader(system, mode.shape));
    else fmt::print("mode {:>3}   {:.10g} Hz, damping {:.4g}, {}\n", k, mode.frequency, mode.damping, leader(system, mode.shape));
  }
}

void print_json(const sim::System& system, const sim::Linearisation& linear) {
  nlohmann::json out;
  for (const sim::Part& p : system.model.parts)
    out["bodies"].push_back({{"name", p.name}, {"mass", p.body.mass}, {"joint_coordinates", p.joint.nv}, {"elastic_coordinates", p.body.n}});
  out["notes"] = system.notes;
  out["equilibrium"] = linear.equilibrium;
  out["modes"] = nlohmann::json::array();
  for (const sim::LinearMode& mode : linear.modes)
    out["modes"].push_back({{"frequency", mode.frequency}, {"growth", mode.growth}, {"damping", mode.damping}, {"leader", leader(system, mode.shape)}});
  fmt::print("{}\n", out.dump(2));
}

}  // namespace

Command add_check(CLI::App& program) {
  struct Words {
    std::string scene;
    bool json = false;
  };
  const auto words = std::make_shared<Words>();
  CLI::App* app = program.add_subcommand("check", "validate a scene; bodies, degrees of freedom, effects, linearised frequencies");
  app->add_option("SCENE", words->scene, "scene file (TOML)")->required();
  app->add_flag("--json", words->json, "report as JSON");

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
