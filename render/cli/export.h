// flexframe export: results for other programs.
#pragma once

#include "render/cli/command.h"

namespace flexframe::cli {

Command add_export(Program& program);

}  // namespace flexframe::cli
