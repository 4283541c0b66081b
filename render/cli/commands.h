// All subcommands of the program, one file each.
#pragma once

#include "render/cli/command.h"

namespace flexframe::cli {

Command add_run(CLI::App& program);
Command add_simulate(CLI::App& program);
Command add_render(CLI::App& program);
Command add_check(CLI::App& program);
Command add_info(CLI::App& program);
Command add_reduce(CLI::App& program);
Command add_modes(CLI::App& program);
Command add_deform(CLI::App& program);
Command add_compare(CLI::App& program);
Command add_effects(CLI::App& program);
Command add_study(CLI::App& program);

}  // namespace flexframe::cli
