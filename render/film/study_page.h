// A study as one HTML page that opens from disk.
#pragma once

#include "render/film/study.h"

#include <string>

namespace flexframe::film {

// What study.md says, its diagrams inside, with tables that are sorted by a click (study.html).
std::string study_page(const Study& study);

}  // namespace flexframe::film
