// What stands at the end of every sweep, run here or collected: table, plots, summary.
#pragma once

#include "sim/sweep/table.h"

#include <string>

namespace flexframe::cli {

struct FinishWords {
  bool no_plots = false, json = false;
};

// Writes NAME of sweep.folder: table.csv, table.h5 and the plots of what is there, and prints the summary. Returns the exit code: 1 where
// points are missing, which are named with the command that runs just them, or where no point has a response.
int finish_sweep(const sim::Sweep& sweep, const FinishWords& words);

}  // namespace flexframe::cli
