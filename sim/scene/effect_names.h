// The names of the effects, in one order: four directions in which a beam deforms, three more that a beam can do without, two of every
// elastic body, and those of the whole scene.
#pragma once

#include <array>
#include <span>
#include <string>

namespace flexframe::sim {

inline std::span<const std::string> effect_names() {
  static const std::array<std::string, 12> names{"axial",         "bending_xy", "bending_xz", "torsion",  "stiffening", "shear",
                                                 "large_bending", "gyroscopic", "damping",    "friction", "gravity",    "stops"};
  return names;
}
inline std::span<const std::string> direction_names() { return effect_names().first(4); }
inline std::span<const std::string> beam_effect_names() { return effect_names().first(7); }
inline std::span<const std::string> body_effect_names() { return effect_names().first(9); }

}  // namespace flexframe::sim
