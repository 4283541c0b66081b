#include "sim/run/pressed_beams.h"

#include "sim/base/error.h"
#include "sim/dynamics/section_forces.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// Turns below this are rounding of the search for equilibrium: a straight beam's have no shape.
constexpr double straight = 1e-6;

double pull_at(const PulledBeam& beam, double x) {
  const auto next = std::upper_bound(beam.x.begin() + 1, beam.x.end() - 1, x) - beam.x.begin();
  const auto k = static_cast<size_t>(next - 1);
  const double share = std::clamp((x - beam.x[k]) / (beam.x[k + 1] - beam.x[k]), 0.0, 1.0);
  return (1.0 - share) * beam.pulls[k][0] + share * beam.pulls[k][1];
}

double share_of_buckling(const PulledBeam& beam, const BeamDef& def, const ResultBody& body) {
  std::vector<Eigen::Index> nodes(body.nodes.size());
  for (size_t k = 0; k < nodes.size(); ++k) nodes[k] = static_cast<Eigen::Index>(k);
  const auto x = [&](Eigen::Index k) { return body.nodes[static_cast<size_t>(k)].origin.x(); };
  std::stable_sort(nodes.begin(), nodes.end(), [&](Eigen::Index a, Eigen::Index b) { return x(a) < x(b); });
  double work = 0.0, bending = 0.0, turn = 0.0;
  for (size_t i = 1; i < nodes.size(); ++i) {
    const double dx = x(nodes[i]) - x(nodes[i - 1]);
    if (dx <= 1e-9 * body.length) continue;
    const Vec3 l = body.rotation.block<1, 3>(0, 3 * nodes[i - 1]), r = body.rotation.block<1, 3>(0, 3 * nodes[i]);  // theta, -w', v'
    const double pull = pull_at(beam, 0.5 * (x(nodes[i]) + x(nodes[i - 1])));
    // Simpson's mean of the square of a turn that is straight between the nodes.
    work -= pull * dx / 6.0 * (l.tail<2>().squaredNorm() + r.tail<2>().squaredNorm() + l.tail<2>().dot(r.tail<2>()));
    const double v = (r.z() - l.z()) / dx, w = (l.y() - r.y()) / dx;  // v'', w''
    bending += 0.5 * dx * def.material.youngs_modulus * (def.section.iz * v * v + def.section.iy * w * w + 2.0 * def.section.iyz * v * w);
    turn = std::max({turn, l.tail<2>().norm(), r.tail<2>().norm()});
  }
  return turn > straight && bending > 0.0 ? std::max(0.0, work / bending) : 0.0;
}

}  // namespace

std::vector<PulledBeam> pulled_beams(System& system, double t, const VecX& y) {
  Reactions reactions;
  try {
    update_system_accelerations(system);
    update_massless_accelerations(system, t, y);
    compute_reactions(system.model, system.work, reactions);
  } catch (const SimulationError&) {
    return {};
  }
  SectionForces sections(system.model, system.scene);
  sections.evaluate(system.model, system.work, reactions);
  std::vector<PulledBeam> out;
  for (const CutBeam& beam : sections.beams()) {
    if (system.model.pieces[static_cast<size_t>(beam.body)].size() > 1 || system.model.parts[beam.part].body.n == 0) continue;
    out.push_back({beam.body, beam.x, {}});
    for (size_t k = 0; k + 1 < beam.x.size(); ++k) out.back().pulls.push_back({beam.left[k][0], beam.right[k][0]});
  }
  return out;
}

void give_way(const Scene& scene, const std::vector<PulledBeam>& pulled, const Results& results, std::vector<LinearLimit>& limits) {
  for (LinearLimit& limit : limits) {
    const auto b = static_cast<size_t>(limit.body);
    const auto beam = std::find_if(pulled.begin(), pulled.end(), [&](const PulledBeam& p) { return p.body == limit.body; });
    if (beam == pulled.end() || results.bodies[b].rotation.rows() == 0) continue;
    const double share = share_of_buckling(*beam, std::get<BeamDef>(scene.bodies[b].kind), results.bodies[b]);
    if (share > 0.0) limit.at_rest /= std::min(1.0, std::max(1.0 - share, 0.25 * limit.turn * limit.turn));
  }
}

}  // namespace flexframe::sim
