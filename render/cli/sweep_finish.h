// What stands at the end of every sweep, run here or collected: table, plots, summary.
#pragma once

#include "sim/sweep/table.h"

#include "render/cli/command.h"

#include <optional>
#include <string>

namespace flexframe::cli {

struct FinishWords {
  bool no_plots = false, json = false;
  std::optional<double> sheet;  // s: time of a contact sheet over the design
  int sheet_points = 25;
};

// --no-plots, --sheet, --sheet-points, --json
void add_finish_words(Subcommand words, FinishWords& values);

// Writes NAME of sweep.folder: table.csv, table.h5 and the plots of what is there, and prints the summary. Returns the exit code: 1 where
// points are missing, which are named with the command that runs just them, or where no point has a response (of a search: keeps all
// limits). Of a search sweep.design has the places afterwards.
int finish_sweep(sim::Sweep& sweep, const FinishWords& words);

}  // namespace flexframe::cli
