#include "sim/run/coarse_beams.h"

#include "sim/results/histories.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::sim {
namespace {

// How a beam's largest deflection goes to and fro.
struct Swing {
  double range = 0.0, cycles = 0.0, omega = 0.0;  // m; cycles in the run; rad/s
};

Swing swing_of(const ResultBody& body, double duration) {
  Swing out;
  Eigen::Index most = -1;
  for (Eigen::Index c = 0; c < body.displacement.cols(); ++c)
    if (const double r = body.displacement.col(c).maxCoeff() - body.displacement.col(c).minCoeff(); r > out.range) out.range = r, most = c;
  if (most < 0 || !(duration > 0.0)) return out;
  const auto column = body.displacement.col(most);
  out.cycles = 0.5 * (column.tail(column.size() - 1) - column.head(column.size() - 1)).cwiseAbs().sum() / out.range;
  out.omega = 2.0 * std::numbers::pi * out.cycles / duration;
  return out;
}

// The smallest stiffness with which the beam may bend, N m^2; 0: it does not bend.
double bending_stiffness(const BeamDef& beam, const std::string& owner, const std::vector<EffectState>& effects) {
  double least = 0.0;
  for (const EffectState& s : effects) {
    if (s.owner != owner || !s.on || (s.effect != "bending_xy" && s.effect != "bending_xz")) continue;
    const double ei = beam.material.youngs_modulus * (s.effect == "bending_xy" ? beam.section.iz : beam.section.iy);
    least = least == 0.0 ? ei : std::min(least, ei);
  }
  return least;
}

// What the lost phase of its vibrations moves the deflection by, relative to its range: of a cantilever let go at its tip, whose mode k has
// the share 12 / lambda_k^4 of the deflection.
double lost_phase(const BeamDef& beam, double elements, double wave, double cycles) {
  constexpr double lambda[] = {1.8751, 4.6941, 7.8548, 10.9955};
  const std::vector<double>& ratio = beam.damping.ratio;
  double sum = 0.0;
  for (std::size_t k = 0; k < std::size(lambda); ++k) {
    const double faster = lambda[k] / lambda[0], kh = wave * faster / elements;
    double passed = 2.0 * std::numbers::pi * cycles * faster * faster;
    // A damped vibration has died before it has lost more.
    if (const double zeta = ratio.empty() ? 0.0 : ratio[std::min(k, ratio.size() - 1)]; zeta > 0.0) passed = std::min(passed, 1.0 / zeta);
    const double slip =
        beam.model == BeamModel::lumped ? kh * kh / (beam.curvature_coupling ? 45.0 : 15.0) : std::min(0.1, std::pow(kh, 4) / 2880.0);
    sum += 12.0 / std::pow(lambda[k], 4) * std::min(1.0, 0.5 * slip * passed);
  }
  return sum;
}

// Whether an output is of this body, or of a joint or force on it.
bool belongs_to(const Scene& scene, const OutputDef& output, const std::string& body) {
  if (output.of.body == body) return true;
  for (const JointDef& j : scene.joints)
    if (j.name == output.of.body) return j.parent.body == body || j.child.body == body;
  return false;
}

const OutputDef* output_of(const Scene& scene, const std::string& column) {
  const OutputDef* found = nullptr;
  for (const OutputDef& output : scene.outputs)
    if ((column == output.name || column.starts_with(output.name + ".")) && (!found || output.name.size() > found->name.size()))
      found = &output;
  return found;
}

// By how much of its range a column moves where the deflection errs by `error`, m.
double moved_share(const std::string& unit, const Swing& swing, double length, double error, double range) {
  if (unit.starts_with("N") || unit == "Pa") return error / swing.range;
  double size = error;
  if (unit.starts_with("rad")) size /= length;
  else if (!unit.starts_with("m")) return 0.0;
  if (unit.ends_with("/s")) size *= swing.omega;
  if (unit.ends_with("/s^2") || unit.ends_with("/s2")) size *= swing.omega * swing.omega;
  return std::min(1.0, size / range);
}

}  // namespace

std::vector<CoarseBeam> coarse_beams(const Scene& scene, const std::vector<EffectState>& effects, const Results& results) {
  std::vector<CoarseBeam> out;
  if (results.times.size() < 3) return out;
  const Histories run = to_histories(results);
  const VecX ranges = output_ranges(run);
  for (const BodyDef& def : scene.bodies) {
    const auto* beam = std::get_if<BeamDef>(&def.kind);
    if (!beam || beam->model == BeamModel::modal || beam->keep_modes || !beam->modes.empty()) continue;
    const auto body = std::find_if(results.bodies.begin(), results.bodies.end(), [&](const ResultBody& b) { return b.name == def.name; });
    const double ei = bending_stiffness(*beam, def.name, effects);
    if (body == results.bodies.end() || !(ei > 0.0)) continue;
    const Swing swing = swing_of(*body, results.times[results.times.size() - 1]);
    if (!(swing.range > 0.0)) continue;
    const bool lumped = beam->model == BeamModel::lumped;
    const int elements = beam->elements * (beam->model == BeamModel::mixed ? beam->volumes : 1);
    const double n = elements,
                 wave = beam->length * std::pow(beam->material.density * beam->section.area * swing.omega * swing.omega / ei, 0.25);
    double error = lumped && !beam->curvature_coupling ? 0.5 / (n * n) : 0.0;
    // Slower than the lowest vibration of a cantilever with a heavy tip: the deflection follows its loads and keeps their phase.
    constexpr double slowest = 0.9;
    if (wave >= slowest) error += lost_phase(*beam, n, wave, swing.cycles);
    error *= swing.range;
    CoarseBeam worst{def.name, "", 0.0, swing.omega / (2.0 * std::numbers::pi), elements, 0};
    for (size_t c = 0; c < run.columns.size(); ++c) {
      const OutputDef* output = output_of(scene, run.columns[c]);
      const double range = ranges[static_cast<Eigen::Index>(c)];
      if (!output || !(range > 0.0) || !belongs_to(scene, *output, def.name)) continue;
      const double share = moved_share(run.units[c], swing, beam->length, error, range);
      if (share > worst.share) worst.share = share, worst.column = run.columns[c];
    }
    if (worst.share <= 0.0) continue;
    // Half a per cent.
    worst.wanted = static_cast<int>(std::ceil(n * std::pow(worst.share / 0.005, lumped ? 0.5 : 0.25)));
    out.push_back(worst);
  }
  return out;
}

void warn_of_coarse_beams(const std::vector<CoarseBeam>& beams, double asked, Notes& notes) {
  for (const CoarseBeam& b : beams)
    if (b.share > asked)
      notes.warn(fmt::format("body '{}'", b.body),
                 fmt::format("its {} element{} too few for how it moves ({:.3g} cycles a second): about {:.2g} of the range of {}; take "
                             "{} or more (of a mixed beam in all volumes together)",
                             b.elements, b.elements == 1 ? " is" : "s are", b.frequency, b.share, b.column, b.wanted));
}

}  // namespace flexframe::sim
