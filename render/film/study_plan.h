// The points of a study: which scenes are run. Private to study.cpp.
#pragma once

#include "sim/scene/scene.h"

#include <optional>
#include <string>
#include <vector>

namespace flexframe::film {

struct PlannedPoint {
  std::string axis, series, label, setting;
  double knob = 0.0;
  sim::Scene scene;  // tolerance and method in its settings
};

// So many times as fine in space (elements, volumes, modes, kept modes) and with the given tolerance. explicit_steps: undamped elements
// keep the modes below one frequency and no static shapes, half as many as elements, so that explicit steps stay long.
sim::Scene refined(const sim::Scene& scene, double factor, double tolerance, bool explicit_steps);

// The scene with finite elements in place of eigenforms: `factor` times as many of their lowest modes as it has eigenforms, and the static
// deflections, which converge where a force or a support at the beam's end is none that its eigenforms have. None where not all that
// bends are eigenforms, or outputs or starts count their coordinates.
std::optional<sim::Scene> with_elements(const sim::Scene& scene, double factor);

// Whether the scene has anything that the axis varies.
bool has_axis(const sim::Scene& scene, const std::string& axis);

std::vector<PlannedPoint> plan_axis(const sim::Scene& scene, const std::string& axis);

}  // namespace flexframe::film
