// What deformations left out do to the vibrations that the mechanism has: each of its modes, at some looks, with the section forces that it
// makes and the energy of the strains that these would make.
#include "sim/run/left_out.h"

#include "sim/dynamics/directions.h"
#include "sim/dynamics/dynamics.h"
#include "sim/start/structural_matrices.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::sim {
namespace {

// The modes of more directions than these take longer than the looks may.
constexpr size_t most_directions = 200;
// Step along a mode, of the mechanism's size: loops close to 1e-11 of it, and what is of second order in it stays below 1e-6 of the rest.
constexpr double small_step = 1e-6;
// A mode that moves no point by more than that share of the farthest vibration, in place, velocity or acceleration as the outputs ask, is
// not looked at: outputs that move a thousandth of that still have it to a hundredth of their range.
constexpr double hardly_moves = 1e-5;

}  // namespace

// Energy of the item's strains under changes of the section forces, J.
double LeftOut::energy_without(const Item& item, const std::vector<BothEnds>& changes) const {
  double energy = 0.0;
  std::vector<Strained> at;
  for (size_t b = 0; b < changes.size(); ++b) {
    const CutBeam& beam = sections_.beams()[b];
    if (std::find(item.bodies.begin(), item.bodies.end(), beam.body) == item.bodies.end()) continue;
    strains_of_first_order(beam.body, changes[b], item, at);
    for (size_t k = 0; k + 1 < beam.x.size(); ++k) energy += energy_between(at[2 * k], at[2 * k + 1], beam.x[k + 1] - beam.x[k]);
  }
  return energy;
}

// A mode of energy U whose section forces would strain the beams by the energy V as well is softer by U / (U + V): the forces of a
// vibration are those of its inertia, with or without what is left out.
void LeftOut::look_at_vibrations(System& system, double t, const VecX& y, const VecX& rest) {
  const bool wanted = std::any_of(items_.begin(), items_.end(), [](const Item& item) { return !is_of_second_order(item.effect); });
  int highest = -1;  // how many times what is evaluated is differentiated
  for (const Column& column : columns_)
    if (column.row >= 0) highest = std::max(highest, column.order);
  if (!wanted || highest < 0) return;
  const std::vector<Direction> directions = independent_directions(system.model, system.work);
  if (directions.empty() || directions.size() > most_directions) return;
  const VecX q = system.work.q, w = system.work.w;
  const auto n = static_cast<Eigen::Index>(directions.size());
  VecX rate(n), acceleration(n), reach(n);
  double size = 0.0;
  for (Eigen::Index k = 0; k < n; ++k) {
    const Direction& d = directions[static_cast<size_t>(k)];
    rate[k] = w[d.v];
    acceleration[k] = system.work.wdot[d.v];
    reach[k] = d.scale;
    size = std::max(size, system.model.clusters[system.model.parts[d.part].cluster].size);
  }
  try {
    const StructuralMatrices matrices = structural_matrices(system.model, system.work, directions);
    const StructuralVibrations modes = structural_vibrations(matrices);
    std::vector<BothEnds> before;
    for (const CutBeam& beam : sections_.beams()) before.push_back({beam.left, beam.right});
    std::vector<BothEnds> changes = before;
    Vibrations found;
    found.frequencies = modes.frequencies;
    found.decays = 0.5 * modes.shapes.cwiseProduct(matrices.D * modes.shapes).colwise().sum().transpose();
    found.by_rate = modes.amounts * rate;
    found.by_acceleration = modes.amounts * acceleration;
    found.reach = MatX::Zero(rest.size(), modes.frequencies.size());
    found.slowed = MatX::Constant(static_cast<Eigen::Index>(items_.size()), modes.frequencies.size(), -1.0);
    // Metres of the point that a mode moves farthest.
    MatX moved = MatX::Zero(highest + 1, modes.frequencies.size());
    for (Eigen::Index j = 0; j < modes.frequencies.size(); ++j) {
      const double omega = modes.frequencies[j];
      // What is too slow to come to a tenth of a radian loses no phase.
      if (!(omega * scene_.simulation.duration > 0.1)) continue;
      found.by_rate[j] /= omega;
      found.by_acceleration[j] /= omega * omega;
      const double amount = std::max(std::abs(found.by_rate[j]), std::abs(found.by_acceleration[j]));
      moved(0, j) = amount * modes.shapes.col(j).cwiseProduct(reach).cwiseAbs().maxCoeff();
      for (Eigen::Index order = 1; order <= highest; ++order) moved(order, j) = moved(order - 1, j) * omega;
    }
    farthest_.head(highest + 1) = farthest_.head(highest + 1).cwiseMax(moved.rowwise().maxCoeff());
    for (Eigen::Index j = 0; j < modes.frequencies.size(); ++j) {
      const double omega = modes.frequencies[j];
      if (!(moved.col(j).array() > hardly_moves * farthest_.head(highest + 1).array()).any()) continue;
      const double step = small_step * size / modes.shapes.col(j).cwiseProduct(reach).cwiseAbs().maxCoeff();
      system.work.q = q;
      system.work.w = w;
      for (Eigen::Index k = 0; k < n; ++k)
        move_along(system.model, directions[static_cast<size_t>(k)], step * modes.shapes(k, j), system.work);
      update_positions(system.model, system.work, false);  // the deformation's inertia changes by as little
      update_velocities(system.model, system.work);
      update_system_accelerations(system);
      compute_reactions(system.model, system.work, reactions_);
      sections_.evaluate(system.model, system.work, reactions_);
      for (size_t b = 0; b < before.size(); ++b)
        for (size_t k = 0; k < before[b][0].size(); ++k) {
          changes[b][0][k] = sections_.beams()[b].left[k] - before[b][0][k];
          changes[b][1][k] = sections_.beams()[b].right[k] - before[b][1][k];
        }
      const double stored = 0.5 * step * step * omega * omega;
      for (size_t i = 0; i < items_.size(); ++i)
        if (!is_of_second_order(items_[i].effect))
          found.slowed(static_cast<Eigen::Index>(i), j) = 1.0 - 1.0 / std::sqrt(1.0 + energy_without(items_[i], changes) / stored);
      if (assemble(system)) found.reach.col(j) = (outputs(rest.data()) - rest) / step;
    }
    vibrations_.push_back(std::move(found));
  } catch (const SimulationError&) {  // a look less
  }
  set_state(system, t, y.data(), false);
}

// The amounts of a vibration are as large by its rates as by its accelerations, and their squares' sum is its amplitude's at any time; what
// follows the loads slowly is larger by its rates.
VecX LeftOut::slowed_vibrations(size_t item, double duration) const {
  VecX squares = VecX::Zero(static_cast<Eigen::Index>(columns_.size()));
  if (vibrations_.empty()) return squares;
  Eigen::Index modes = vibrations_.front().frequencies.size();
  for (const Vibrations& v : vibrations_) modes = std::min(modes, v.frequencies.size());
  for (Eigen::Index j = 0; j < modes; ++j) {
    // Over the looks at which the mode was looked at.
    double slower = 0.0, decay = 0.0, looks = 0.0;
    for (const Vibrations& v : vibrations_)
      if (const double share = v.slowed(static_cast<Eigen::Index>(item), j); share >= 0.0)
        slower += v.frequencies[j] * share, decay += v.decays[j], ++looks;
    // What dies away is gone before it is farther out of phase, and what a load keeps going is by no more (a frequency that is off by d of
    // it changes a resonance of the damping ratio z by d / z).
    const double lasts = looks > 0.0 && decay > 0.0 ? std::min(duration, looks / decay) : duration;
    const double phase = looks > 0.0 ? lasts * slower / looks : 0.0;
    // Half a turn out of phase is twice the amplitude.
    const double apart = std::min(2.0, phase);
    for (size_t c = 0; c < columns_.size(); ++c) {
      const Column& column = columns_[c];
      if (column.row < 0) continue;
      double by_rate = 0.0, by_acceleration = 0.0, most = 0.0;
      for (const Vibrations& v : vibrations_) {
        const double reach = v.reach(column.row, j) * std::pow(v.frequencies[j], column.order);
        const double r = std::pow(reach * v.by_rate[j], 2), a = std::pow(reach * v.by_acceleration[j], 2);
        by_rate += r, by_acceleration += a;
        most = std::max(most, r + a);
      }
      if (most == 0.0) continue;
      const double free = 2.0 * std::min(by_rate, by_acceleration) / (by_rate + by_acceleration);
      squares[static_cast<Eigen::Index>(c)] += most * free * apart * apart;
    }
  }
  return squares.cwiseSqrt();
}

double LeftOut::lasting_phase() const {
  double most = 0.0;
  for (const Vibrations& v : vibrations_)
    for (Eigen::Index j = 0; j < v.frequencies.size(); ++j) {
      if (v.slowed.size() == 0 || !(v.slowed.col(j).array() >= 0.0).any()) continue;
      if (!(v.decays[j] > 0.0)) return std::numeric_limits<double>::infinity();
      most = std::max(most, v.frequencies[j] / v.decays[j]);
    }
  return most > 0.0 ? most : std::numeric_limits<double>::infinity();
}

}  // namespace flexframe::sim
