#include "sim/scene/meant_units.h"

#include <cmath>
#include <numbers>

namespace flexframe::sim {
namespace {

// Metals, ceramics, glass, wood and plastics: density in kg/m^3, Young's modulus in Pa. Narrow, as the question is what is meant.
bool structural(double density, double youngs_modulus) {
  return density >= 300.0 && density <= 2.3e4 && youngs_modulus >= 1e9 && youngs_modulus <= 4.5e11;
}

struct MaterialUnit {
  const char* word;
  double size;  // in SI
};
constexpr MaterialUnit densities[] = {{"", 1.0}, {"g/cm^3", 1e3}, {"kg/mm^3", 1e9}, {"t/mm^3", 1e12}};
constexpr MaterialUnit moduli[] = {{"", 1.0}, {"MPa", 1e6}, {"GPa", 1e9}};

}  // namespace

bool looks_like_degrees(double angle) {
  // Radians beyond a turn are seldom written, and then seldom as such numbers.
  return std::abs(angle) > 2.0 * std::numbers::pi && 2.0 * angle == std::rint(2.0 * angle);
}

bool looks_like_millimetres(double gravity) { return gravity > 9.7e3 && gravity < 9.9e3; }

std::string meant_material_units(double density, double youngs_modulus) {
  // Papers make bodies softer by decades to show how they bend, so only what sound would hardly or far too fast run through is doubted. A
  // density of 1 stands for equations without units.
  const double sound = std::sqrt(youngs_modulus / density);
  const bool solid = density > 5.0 && density < 3e4 && sound > 20.0 && sound < 2e4;
  if (solid || density == 1.0) return {};
  for (const MaterialUnit& d : densities)
    for (const MaterialUnit& e : moduli)
      if (structural(density * d.size, youngs_modulus * e.size)) return std::string(d.word) + (*d.word && *e.word ? " and " : "") + e.word;
  return {};
}

}  // namespace flexframe::sim
