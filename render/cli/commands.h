// All subcommands of the program, one file each.
#pragma once

#include "render/cli/command.h"

namespace flexframe::cli {

Command add_run(Program& program);
Command add_simulate(Program& program);
Command add_render(Program& program);
Command add_check(Program& program);
Command add_info(Program& program);
Command add_reduce(Program& program);
Command add_modes(Program& program);
Command add_deform(Program& program);
Command add_compare(Program& program);
Command add_effects(Program& program);
Command add_study(Program& program);
Command add_new(Program& program);
Command add_response(Program& program);
Command add_load_path(Program& program);
Command add_spectrum(Program& program);
Command add_sweep(Program& program);
Command add_collect(Program& program);
Command add_import(Program& program);

}  // namespace flexframe::cli
