// CalculiX result files (.frd).
#pragma once

#include "render/import/nodal_series.h"

#include <filesystem>

namespace flexframe::imports {

// Text .frd of static and transient steps: nodes, elements, DISP and STRESS of every time (*NODE FILE, *EL FILE). unit: m of a length in
// the file, stress: Pa of a stress in it. Layout: CalculiX GraphiX manual, "Result format". Throws sim::InputError "FILE:LINE: ...".
NodalSeries read_frd(const std::filesystem::path& path, double unit, double stress);

}  // namespace flexframe::imports
