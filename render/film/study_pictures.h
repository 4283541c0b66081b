// The part of a study that concerns pictures: kernel map and antialiasing. Private to study.cpp.
#pragma once

#include "render/film/study.h"

namespace flexframe::film {

// Adds the axes nodes, scheme and samples, those that were asked for.
void study_pictures(const sim::Scene& scene, const StudyOptions& options, Study& study);

}  // namespace flexframe::film
