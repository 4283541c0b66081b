// What the rotary inertia of sections, which comes with shear, does to a mechanism that turns with its beams.
#include "sim/run/left_out.h"

#include "sim/dynamics/directions.h"
#include "sim/scene/section.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {

namespace {

double torsion_stiffness(const BeamDef& beam) {
  return 0.5 * beam.material.youngs_modulus / (1.0 + beam.material.poisson) * beam.section.j;
}

}  // namespace

void LeftOut::follow_turning(const System& system, Item& item) const {
  if (item.effect != "shear") return;
  double energy = 0.0, spinning = 0.0;
  for (const CutBeam& beam : sections_.beams()) {
    if (std::find(item.bodies.begin(), item.bodies.end(), beam.body) == item.bodies.end()) continue;
    const BeamDef& def = std::get<BeamDef>(scene_.bodies[beam.body].kind);
    const Vec3 whole = def.material.density * mass_moments(def.section);  // y, z, yz; kg m
    const double lacks_y = whole[0] - beam.rotary(1, 1), lacks_z = whole[1] - beam.rotary(2, 2), lacks_yz = -whole[2] - beam.rotary(1, 2);
    const Vec3 w = system.work.parts[beam.part].V.tail<3>();
    spinning += (beam.x.back() - beam.x.front()) * 0.5 * beam.rotary(0, 0) * w.x() * w.x();
    energy += (beam.x.back() - beam.x.front()) * (0.5 * (lacks_y * w.y() * w.y() + lacks_z * w.z() * w.z()) + lacks_yz * w.y() * w.z());
  }
  item.turning.push_back(energy), item.spinning.push_back(spinning);
}

// Fibres beside the axis of a twisted beam are helices, which a force along it straightens: G J + N Ip/A in place of G J.
double LeftOut::untwist(const CutBeam& beam, std::vector<Strained>& out) const {
  const BeamDef& def = std::get<BeamDef>(scene_.bodies[beam.body].kind);
  const double stiffness = torsion_stiffness(def), gyration = (def.section.iy + def.section.iz) / def.section.area;
  double potential = 0.0;
  for (size_t k = 0; k < out.size(); ++k) {
    const Vec6& F = k % 2 == 0 ? beam.left[k / 2] : beam.right[k / 2];
    const double share = std::max(F[0] * gyration / stiffness, -0.9), lacks = -F[3] * share / (1.0 + share);
    out[k].force[3] += lacks, out[k].strain[3] += lacks / stiffness;
    potential += 0.25 * (beam.x[k / 2 + 1] - beam.x[k / 2]) * F[3] * F[3] / stiffness * share;
  }
  return potential;
}

namespace {

// How many times a body's rates of turning about y and z go through their range, at most; 0: it turns evenly, for which inertia is nothing.
double changes_of_turning(const ResultBody& body, const VecX& times) {
  constexpr double evenly = 0.1;
  const Eigen::Index n = body.orientation.rows() - 1;
  if (n < 2) return 0.0;
  const auto at = [&](Eigen::Index i) {
    return Quat(body.orientation(i, 0), body.orientation(i, 1), body.orientation(i, 2), body.orientation(i, 3)).normalized();
  };
  Eigen::MatrixX2d rates(n, 2);
  for (Eigen::Index i = 0; i < n; ++i)
    rates.row(i) = rotation_log(Mat3((at(i).conjugate() * at(i + 1)).toRotationMatrix())).tail<2>().transpose() / (times[i + 1] - times[i]);
  double most = 0.0;
  const double fastest = rates.cwiseAbs().maxCoeff();
  for (int axis = 0; axis < 2; ++axis) {
    const double range = rates.col(axis).maxCoeff() - rates.col(axis).minCoeff();
    if (!(range > evenly * fastest)) continue;
    most = std::max(most, (rates.col(axis).tail(n - 1) - rates.col(axis).head(n - 1)).cwiseAbs().sum() / range);
  }
  return most;
}

}  // namespace

// Inertia that lacks a share of all lets the mechanism turn faster: what falls is ahead by that share of its way, and what goes to and fro
// by as much each time. (Beam of 1.46 m and 0.07 m on a hinge, let go in space: 1.3e-3 of its range after 1 s, 2.1e-3 after 5 s, where
// 5.8e-4 of the inertia lacks.) Prescribed motions are kept whatever turns with them, but their drives take that share less.
double LeftOut::turned_share(const Item& item, const Results& results) const {
  constexpr double most_seen = 2.0;
  if (item.turning.empty() || item.turning.size() != kinetic_.size()) return 0.0;
  const double turning = *std::max_element(item.turning.begin(), item.turning.end());
  double all = *std::max_element(kinetic_.begin(), kinetic_.end());
  // What spins about its axis changes its other rates by the share that lacks of their inertia. Where that cannot be measured by another
  // run it would be told of wobbling that no output shows.
  if (free_ && item.possible) {
    double most = 0.0;
    for (size_t k = 0; k < kinetic_.size(); ++k) most = std::max(most, kinetic_[k] - item.spinning[k]);
    all = std::max(most, turning);
  }
  if (!(turning > 0.0) || !(all > 0.0)) return 0.0;
  if (!free_) {
    const bool driven = std::any_of(model_.parts.begin(), model_.parts.end(), [](const Part& p) { return p.joint.motion >= 0; });
    return driven && has_forces() ? std::min(1.0, turning / all) : 0.0;
  }
  double times = 0.0;
  for (const int b : item.bodies)
    for (const ResultBody& body : results.bodies)
      if (body.name == scene_.bodies[b].name) times = std::max(times, changes_of_turning(body, results.times));
  return std::min(1.0, most_seen * turning / all * times);
}

}  // namespace flexframe::sim
