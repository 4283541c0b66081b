#include "sim/run/pressed_beams.h"

#include "sim/base/error.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// Looks at a run: a load that comes and goes within a tenth of it is seen three times.
constexpr size_t wanted_looks = 32;

// Turns below this are rounding of the search for equilibrium: a straight beam's have no shape.
constexpr double straight = 1e-6;

double pull_at(const PulledBeam& beam, double x) {
  const auto next = std::upper_bound(beam.x.begin() + 1, beam.x.end() - 1, x) - beam.x.begin();
  const auto k = static_cast<size_t>(next - 1);
  const double share = std::clamp((x - beam.x[k]) / (beam.x[k + 1] - beam.x[k]), 0.0, 1.0);
  return (1.0 - share) * beam.pulls[k][0] + share * beam.pulls[k][1];
}

// A beam at one sample: energy of its bending, J; work of the pull on what it shortens, J, negative where it is pressed; of that what the
// field of second order lacks where the beam stretches.
struct Loaded {
  double bending = 0.0, work = 0.0, lacking = 0.0;
  double turn = 0.0, strain = 0.0;  // the largest: rad; relative lengthening
  double pressed() const { return bending > 0.0 ? std::max(0.0, -work / bending) : 0.0; }
};

Loaded loaded_at(const PulledBeam& beam, const BeamDef& def, const ResultBody& body, Eigen::Index row) {
  std::vector<Eigen::Index> nodes(body.nodes.size());
  for (size_t k = 0; k < nodes.size(); ++k) nodes[k] = static_cast<Eigen::Index>(k);
  const auto x = [&](Eigen::Index k) { return body.nodes[static_cast<size_t>(k)].origin.x(); };
  std::stable_sort(nodes.begin(), nodes.end(), [&](Eigen::Index a, Eigen::Index b) { return x(a) < x(b); });
  const double EA = def.material.youngs_modulus * def.section.area;
  // The frame of finite elements moves on mean axes, whose slope is that of the straight line through the deflection: int theta 6 x (L - x)
  // / L^3 dx; that of eigenforms on the root's.
  Eigen::RowVector2d mean = Eigen::RowVector2d::Zero();
  double weights = 0.0;
  for (size_t i = 1; i < nodes.size() && def.model == BeamModel::finite_element; ++i) {
    const double dx = x(nodes[i]) - x(nodes[i - 1]), at = 0.5 * (x(nodes[i]) + x(nodes[i - 1])), weight = at * (body.length - at) * dx;
    mean += 0.5 * weight * (body.rotation.block<1, 2>(row, 3 * nodes[i - 1] + 1) + body.rotation.block<1, 2>(row, 3 * nodes[i] + 1));
    weights += weight;
  }
  if (weights > 0.0) mean /= weights;
  // Simpson's mean of the square of what is straight between the nodes.
  const auto square = [](const Eigen::RowVector2d& a, const Eigen::RowVector2d& b) {
    return (a.squaredNorm() + b.squaredNorm() + a.dot(b)) / 3.0;
  };
  Loaded out;
  for (size_t i = 1; i < nodes.size(); ++i) {
    const double dx = x(nodes[i]) - x(nodes[i - 1]);
    if (dx <= 1e-9 * body.length) continue;
    const Eigen::RowVector2d l = body.rotation.block<1, 2>(row, 3 * nodes[i - 1] + 1), r = body.rotation.block<1, 2>(row, 3 * nodes[i] + 1);
    const double pull = pull_at(beam, 0.5 * (x(nodes[i]) + x(nodes[i - 1])));
    const double v = (r[1] - l[1]) / dx, w = (l[0] - r[0]) / dx;  // v'', w'' by the turns -w', v'
    out.work += 0.5 * pull * dx * square(l, r);
    out.lacking += 0.5 * pull * dx * square(l - mean, r - mean) * pull / EA;
    out.bending +=
        0.5 * dx * def.material.youngs_modulus * (def.section.iz * v * v + def.section.iy * w * w + 2.0 * def.section.iyz * v * w);
    out.turn = std::max({out.turn, l.norm(), r.norm()});
    out.strain = std::max(out.strain, std::abs(pull / EA));
  }
  return out;
}

// The share of buckling that lasts: a blow presses a beam for less time than it takes to give way.
double lasting(const std::vector<Loaded>& run, size_t k, bool at_rest) {
  const double here = run[k].pressed();
  if (at_rest && k == 0) return here;
  std::vector<double> beside{here};
  if (k > 0) beside.push_back(run[k - 1].pressed());
  if (k + 1 < run.size()) beside.push_back(run[k + 1].pressed());
  std::sort(beside.begin(), beside.end());
  return beside[(beside.size() - 1) / 2];
}

// Share of a beam's own stiffness that is left.
double stiffness_left(double pressed, double turn) { return std::clamp(1.0 - pressed, 0.25 * turn * turn, 1.0); }

// What the run of a beam does to its errors.
void count_loads(const std::vector<Loaded>& run, bool at_rest, bool stretches, LinearLimit& limit) {
  double most = 0.0, bending = 0.0, work = 0.0, lacking = 0.0, turn = 0.0, strain = 0.0;
  for (size_t k = 0; k < run.size(); ++k) {
    const Loaded& now = run[k];
    if (now.turn <= straight || !(limit.turn > 0.0)) continue;
    const double pressed = lasting(run, k, at_rest);
    // Of the largest deflection, which is what errors are told of.
    most = std::max(most, std::pow(now.turn / limit.turn, 3) / stiffness_left(pressed, now.turn));
    limit.pressed = std::max(limit.pressed, pressed);
    bending += now.bending, work += now.work, lacking += now.lacking;
    turn = std::max(turn, now.turn), strain = std::max(strain, now.strain);
  }
  if (!(bending > 0.0)) return;
  limit.at_rest *= std::max(1.0, most);
  limit.phase /= stiffness_left(-work / bending, turn);
  if (!stretches) return;
  // A pull adds to the stiffness, too.
  limit.stretched = strain;
  limit.stretching = lacking / std::max(bending + work, bending * 0.25 * turn * turn);
}

}  // namespace

PulledBeams::PulledBeams(const System& system, size_t samples)
    : samples_(samples), stride_(std::max<size_t>(1, samples / wanted_looks)), bodies_(system.scene.bodies.size()) {
  for (size_t b = 0; b < system.scene.bodies.size(); ++b) {
    if (!std::holds_alternative<BeamDef>(system.scene.bodies[b].kind) || system.model.pieces[b].size() > 1) continue;
    const FlexibleBody& body = system.model.parts[static_cast<size_t>(system.model.pieces[b].front())].body;
    bodies_[b].shortens = body.n > 0 && !body.rod && !body.nodes.empty() && body.nodes.back().phi2[0].size() > 0;
    bodies_[b].stretches = std::any_of(system.model.effects.begin(), system.model.effects.end(),
                                       [&](const EffectState& s) { return s.body == static_cast<int>(b) && s.effect == "axial" && s.on; });
  }
  if (std::any_of(bodies_.begin(), bodies_.end(), [](const Body& b) { return b.shortens; })) sections_.emplace(system.model, system.scene);
}

void PulledBeams::look(System& system, double t, const VecX& y, size_t sample) {
  try {
    update_system_accelerations(system);
    update_massless_accelerations(system, t, y);
    compute_reactions(system.model, system.work, reactions_);
  } catch (const SimulationError&) {
    return;
  }
  sections_->evaluate(system.model, system.work, reactions_);
  Seen now{sample, {}};
  for (const CutBeam& beam : sections_->beams()) {
    if (!bodies_[static_cast<size_t>(beam.body)].shortens) continue;
    now.beams.push_back({beam.body, beam.x, {}});
    for (size_t k = 0; k + 1 < beam.x.size(); ++k) now.beams.back().pulls.push_back({beam.left[k][0], beam.right[k][0]});
  }
  seen_.push_back(std::move(now));
}

void PulledBeams::count(const Scene& scene, const Results& results, bool at_rest, std::vector<LinearLimit>& limits) const {
  for (LinearLimit& limit : limits) {
    const auto b = static_cast<size_t>(limit.body);
    if (results.bodies[b].rotation.rows() == 0 || !bodies_[b].shortens) continue;
    std::vector<Loaded> run;
    for (const Seen& seen : seen_)
      for (const PulledBeam& beam : seen.beams)
        if (beam.body == limit.body)
          run.push_back(
              loaded_at(beam, std::get<BeamDef>(scene.bodies[b].kind), results.bodies[b], static_cast<Eigen::Index>(seen.sample)));
    count_loads(run, at_rest, bodies_[b].stretches, limit);
  }
}

}  // namespace flexframe::sim
