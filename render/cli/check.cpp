// flexframe check: is the scene sound, and what would be simulated.
#include "render/cli/commands.h"
#include "render/cli/jobs.h"

#include "sim/system.h"

#include <fmt/format.h>

#include <memory>

namespace flexframe::cli {

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
            fmt::print("{}: sound\n", words->scene);
            for (const sim::Part& part : system.model.parts) fmt::print("body         {}: {} joint coordinates, {} elastic\n", part.name, part.joint.nq, part.body.n);
            for (const std::string& note : system.notes) fmt::print("note         {}\n", note);
            return 0;
          }};
}

}  // namespace flexframe::cli
