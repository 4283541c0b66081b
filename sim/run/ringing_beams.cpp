#include "sim/run/ringing_beams.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace flexframe::sim {
namespace {

// Times at which a series turns, each turn followed by a way back of more than `least`.
std::vector<double> turns(const VecX& times, const Eigen::Ref<const Eigen::RowVectorXd>& values, double least) {
  std::vector<double> out;
  Eigen::Index high = 0, low = 0;
  int way = 0;  // 1: up, -1: down, 0: not known yet
  for (Eigen::Index i = 1; i < values.size(); ++i) {
    if (values[i] > values[high]) high = i;
    if (values[i] < values[low]) low = i;
    const bool down = way >= 0 && values[high] - values[i] > least, up = way <= 0 && values[i] - values[low] > least;
    if (!down && !up) continue;
    out.push_back(times[down ? high : low]);
    way = down ? -1 : 1;
    high = low = i;
  }
  return out;
}

bool is_on(const std::vector<EffectState>& effects, const std::string& owner, std::string_view effect) {
  return std::any_of(effects.begin(), effects.end(), [&](const EffectState& s) { return s.owner == owner && s.effect == effect && s.on; });
}

// Radians a second up to which a beam's elements carry its waves.
double carried(const BeamDef& beam, const std::string& owner, const std::vector<EffectState>& effects) {
  const double of_bending = beam.model == BeamModel::lumped ? 0.2 : 0.5, of_lines = 0.2;
  const double h = beam.length / (beam.elements * (beam.model == BeamModel::mixed ? beam.volumes : 1));
  const double E = beam.material.youngs_modulus, G = E / (2.0 * (1.0 + beam.material.poisson)), rho = beam.material.density;
  const Section& s = beam.section;
  double out = std::numeric_limits<double>::infinity();
  const auto line = [&](double modulus) { out = std::min(out, of_lines / h * std::sqrt(modulus / rho)); };
  for (const bool xy : {true, false}) {
    if (!is_on(effects, owner, xy ? "bending_xy" : "bending_xz")) continue;
    out = std::min(out, std::pow(of_bending / h, 2) * std::sqrt(E * (xy ? s.iz : s.iy) / (rho * s.area)));
    if (const double k = xy ? s.shear_y : s.shear_z; k > 0.0 && is_on(effects, owner, "shear")) line(k * G);
  }
  if (is_on(effects, owner, "axial")) line(E);
  if (is_on(effects, owner, "torsion")) line(G * s.j / (s.iy + s.iz));
  return out;
}

}  // namespace

double fastest_vibration(const Histories& run, double share) {
  constexpr size_t swings = 4;  // of two cycles
  double shortest = std::numeric_limits<double>::infinity();
  const VecX ranges = output_ranges(run);
  for (Eigen::Index c = 0; c < run.values.rows(); ++c) {
    if (!(ranges[c] > 0.0)) continue;
    const std::vector<double> at = turns(run.times, run.values.row(c), share * ranges[c]);
    for (size_t i = swings; i < at.size(); ++i) shortest = std::min(shortest, at[i] - at[i - swings]);
  }
  return std::isfinite(shortest) && shortest > 0.0 ? 4.0 * std::numbers::pi / shortest : 0.0;
}

std::vector<size_t> beams_that_ring(const Scene& scene, const std::vector<EffectState>& effects, const Histories& run, double asked) {
  std::vector<size_t> out;
  if (run.times.size() < 3) return out;
  const double shown = fastest_vibration(run, 0.5 * asked);
  // At a turn every second sample what is shown may be anything faster.
  const double sampled = std::numbers::pi * static_cast<double>(run.times.size() - 1) / (run.times[run.times.size() - 1] - run.times[0]);
  const double fastest = shown >= 0.5 * sampled ? std::numeric_limits<double>::max() : shown;
  for (size_t b = 0; b < scene.bodies.size(); ++b) {
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind);
    const bool of_elements = beam && beam->model != BeamModel::modal && beam->modes.empty();
    if (of_elements && fastest > carried(*beam, scene.bodies[b].name, effects)) out.push_back(b);
  }
  return out;
}

}  // namespace flexframe::sim
