// What the rotary inertia of sections, which comes with shear, does to a mechanism that turns with its beams.
#include "sim/run/left_out.h"

#include "sim/dynamics/directions.h"
#include "sim/scene/section.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {

void LeftOut::follow_turning(const System& system, Item& item) const {
  if (item.effect != "shear") return;
  double energy = 0.0;
  for (const CutBeam& beam : sections_.beams()) {
    if (std::find(item.bodies.begin(), item.bodies.end(), beam.body) == item.bodies.end()) continue;
    const BeamDef& def = std::get<BeamDef>(scene_.bodies[beam.body].kind);
    const Vec3 inertia = def.material.density * (beam.x.back() - beam.x.front()) * mass_moments(def.section);  // y, z, yz; kg m^2
    const Vec3 w = system.work.parts[beam.part].V.tail<3>();
    energy += 0.5 * (inertia[0] * w.y() * w.y() + inertia[1] * w.z() * w.z()) - inertia[2] * w.y() * w.z();
  }
  item.turning.push_back(energy);
}

// The moment on a section's twist (propeller moment) is d/dtheta of w^T S(theta) w / 2, of which a beam without shear has what is linear in
// theta only (beam_terms.cpp): all of it where its frame stays at its root, a part of it where the frame turns with the twist.
void LeftOut::twist_of_turning(const System& system, const CutBeam& beam, Item& item, std::vector<Strained>& out) const {
  const BeamDef& def = std::get<BeamDef>(scene_.bodies[beam.body].kind);
  const std::string& name = scene_.bodies[beam.body].name;
  const auto twists = [&](const EffectState& s) { return s.on && s.owner == name && s.effect == "torsion"; };
  if (std::none_of(model_.effects.begin(), model_.effects.end(), twists)) return;
  const Vec3 moments = def.material.density * mass_moments(def.section);
  const Vec3 w = system.work.parts[beam.part].V.tail<3>();
  const double stiffness = 0.5 * def.material.youngs_modulus / (1.0 + def.material.poisson) * def.section.j;
  if (moments[0] == moments[1] || w.tail<2>().isZero(0.0)) return;
  const auto lacks = [&](size_t k) {
    const double theta = beam.turn(k, 0).x(), c = std::cos(theta), s = std::sin(theta);
    const double whole = (w.y() * c + w.z() * s) * (w.z() * c - w.y() * s);
    return (moments[0] - moments[1]) * (whole - (w.z() * w.z() - w.y() * w.y()) * theta);
  };
  double torque = 0.0, potential = 0.0;
  for (size_t k = beam.x.size() - 1; k > 0; --k) {
    const double dx = beam.x[k] - beam.x[k - 1], left = lacks(k - 1), right = lacks(k);
    out[2 * k - 1].force[3] = torque, out[2 * k - 1].strain[3] = torque / stiffness;
    torque += 0.5 * dx * (left + right);
    out[2 * k - 2].force[3] = torque, out[2 * k - 2].strain[3] = torque / stiffness;
    potential += 0.25 * dx * (left * beam.turn(k - 1, 0).x() + right * beam.turn(k, 0).x());
  }
  item.slowing.back() += std::abs(potential);
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
// 5.8e-4 of the inertia lacks.) Prescribed motions are kept whatever turns with them.
double LeftOut::turned_share(const Item& item, const Results& results) const {
  constexpr double most_seen = 2.0;
  if (item.turning.empty() || !free_ || results.kinetic.size() == 0) return 0.0;
  const double turning = *std::max_element(item.turning.begin(), item.turning.end()), all = results.kinetic.maxCoeff();
  if (!(turning > 0.0) || !(all > 0.0)) return 0.0;
  double times = 0.0;
  for (const int b : item.bodies)
    for (const ResultBody& body : results.bodies)
      if (body.name == scene_.bodies[b].name) times = std::max(times, changes_of_turning(body, results.times));
  return std::min(1.0, most_seen * turning / all * times);
}

}  // namespace flexframe::sim
