// One picture of a sweep: the scene at one time, at points over the design.
#pragma once

#include "render/draw/renderer.h"
#include "sim/sweep/sweep.h"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace flexframe::film {

struct SweepSheet {
  double time = 0.0;  // s, of every picture
  int most = 25;      // pictures; of a larger design as many, evenly spread
  render::Backend backend = render::Backend::osmesa;
  std::function<void(int done, int all)> progress = {};  // may throw to stop
};

// Simulates these points again and draws them by the scene's [render]: one colour range, one camera and one light for all, below each its
// keys. A grid of two keys is drawn as a matrix. A point that fails is an empty cell with its sentence. At most 1920 pixels wide. Written
// whole or not at all. Returns what is to be told. Throws FileError, DrawError.
std::vector<std::string> write_sweep_sheet(const sim::Sweep& sweep, const SweepSheet& sheet, const std::filesystem::path& path);

}  // namespace flexframe::film
