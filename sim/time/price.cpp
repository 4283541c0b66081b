#include "sim/time/price.h"

#include "sim/bodies/axis_mass.h"

namespace flexframe::sim {

double evaluation_price(const System& system) {
  const Model& model = system.model;
  const auto parts = static_cast<double>(model.parts.size()), loops = static_cast<double>(model.loops.size());
  double coordinates = 0.0, particles = 0.0, points = 0.0;  // these times the coordinates
  for (const Part& p : model.parts) {
    coordinates += p.body.n;
    if (has_axis_mass(p.body)) particles += static_cast<double>(p.body.n * p.body.axis.x.size());
    if (p.body.rod) points += static_cast<double>(p.body.n * p.body.rod->x.size());
  }
  const double of_axes = 32e-9 * particles + 11e-9 * points;
  if (system.plane) return 0.5e-6 + 0.37e-6 * parts + 0.2e-6 * loops + 0.16e-6 * coordinates + of_axes;
  return 0.6e-6 + 0.4e-6 * parts + 1.3e-6 * loops + 0.16e-6 * coordinates + of_axes;
}

double newton_price(double n) { return 2.5e-9 * n * n * n; }
double linear_model_price(double n) { return 150e-9 * n * n + 2.5e-9 * n * n * n; }
double series_price(double terms, double n) { return 0.2e-9 * terms * (n + 8.0) * (n + 8.0); }

}  // namespace flexframe::sim
