// How fine beams are made where the program chooses.
#pragma once

#include <algorithm>
#include <numeric>
#include <string_view>
#include <vector>

namespace flexframe::sim {

// Finite elements of a beam that keeps so many modes of a direction: with three a mode the frequency of the highest bending mode is 0.1 %
// too high, with two 0.4 % (hinged, clamped and free ends, 2 to 12 modes), which is enough where forms of beams are compared.
inline int elements_for_modes(int modes) { return 3 * modes; }
// So many where modes are few and their vibrations are followed through many radians: behind few modes elements cost next to nothing.
inline int elements_behind_modes(int modes) { return 12 * modes; }
inline int elements_to_compare(int modes) { return 2 * modes; }

// Numbers of the eigenforms of a direction where bending has 1 .. `bending` of them: lengthening and twist vibrate so much faster that a
// third does.
inline std::vector<int> mode_numbers(std::string_view direction, int bending) {
  std::vector<int> out(direction == "axial" || direction == "torsion" ? std::max(1, bending / 3) : bending);
  std::iota(out.begin(), out.end(), 1);
  return out;
}

}  // namespace flexframe::sim
