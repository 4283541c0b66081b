// Units that contradict each other. See unit_warnings in fe_model.h.
#include "sim/reduce/fe_model.h"

#include <fmt/format.h>

#include <cmath>

namespace flexframe::sim {
namespace {

// Solids that machines are made of, from foam to tungsten and from rubber to diamond: kg/m^3, Pa, and the speed of sound sqrt(E / rho),
// m/s. What lies outside is read in other units than it was written in.
bool plausible(double density, double young) {
  const double sound = std::sqrt(young / density);
  // As dense as metal or stone and yet as soft as rubber is none of them, nor as light as foam or honeycomb and stiffer than these.
  if ((density > 2500.0 && young < 1e9) || (density < 60.0 && sound > 4e3)) return false;
  return density > 5.0 && density < 3e4 && young > 1e3 && young < 2e12 && sound < 2e4;
}

struct UnitSystem {
  const char* words;
  FeUnits units;
};
constexpr UnitSystem systems[] = {
    {"m", {1.0, 1.0, 1.0}},          {"mm", {1e-3, 1e3, 1.0}},      {"mm-kg-s", {1e-3, 1.0, 1.0}},          {"mm-kg-ms", {1e-3, 1.0, 1e-3}},
    {"mm-g-ms", {1e-3, 1e-3, 1e-3}}, {"cm-g-s", {1e-2, 1e-3, 1.0}}, {"in-lbf-s", {0.0254, 175.126835, 1.0}}};

}  // namespace

std::optional<FeUnits> units_named(const std::string& name) {
  for (const UnitSystem& s : systems)
    if (name == s.words) return s.units;
  return std::nullopt;
}

std::vector<std::string> unit_warnings(const FeModel& model, const FeUnits& read_as) {
  std::vector<std::string> out;
  std::vector<bool> used(model.materials.size(), false);
  for (const FeElement& e : model.elements)
    if (e.material >= 0) used[e.material] = true;
  for (const FeLayup& l : model.layups)
    for (const FeLayer& layer : l.layers) used[layer.material] = true;
  double size = 0.0;
  if (!model.nodes.empty()) {
    Vec3 lower = model.nodes[0], upper = lower;
    for (const Vec3& x : model.nodes) {
      lower = lower.cwiseMin(x);
      upper = upper.cwiseMax(x);
    }
    size = (upper - lower).maxCoeff();
  }
  for (size_t i = 0; i < used.size(); ++i) {
    const FeMaterial& m = model.materials[i];
    if (!used[i] || !(m.density > 0.0) || !(m.youngs_modulus > 0.0) || plausible(m.density, m.youngs_modulus)) continue;
    // The units that would make a solid of it.
    std::string others;
    for (const UnitSystem& s : systems) {
      const double density = m.density / read_as.density() * s.units.density(),
                   young = m.youngs_modulus / read_as.stress() * s.units.stress();
      if (!plausible(density, young)) continue;
      others += fmt::format("{}--units {} makes it {:.4g} kg/m^3, {:.3g} Pa and the model {:.3g} m long", others.empty() ? "" : "; ",
                            s.words, density, young, size / read_as.length * s.units.length);
    }
    out.push_back(
        fmt::format("{}: material '{}' has {:.3g} kg/m^3 and Young's modulus {:.3g} Pa, which no solid has; the model is {:.3g} m long. {}",
                    model.file, m.name, m.density, m.youngs_modulus, size,
                    others.empty() ? "Its units contradict each other: give --material in SI, or --units with the factors of length, "
                                     "mass and time"
                                   : "The units it was read in seem wrong: " + others));
  }
  return out;
}

}  // namespace flexframe::sim
