#include "sim/run/expected_turn.h"

#include "sim/base/eigen_solvers.h"
#include "sim/dynamics/directions.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/inverse_dynamics.h"
#include "sim/dynamics/massless.h"
#include "sim/run/linear_growth.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

namespace flexframe::sim {
namespace {

// Instants at which the loads are looked at.
constexpr int looks = 20;

// The mechanism in its start position, at rest, under the loads of an instant.
class HeldStart {
 public:
  explicit HeldStart(const System& system) : system_(system), model_(system_.model), work_(system_.work) {
    system_.plane.reset();
    update_expressions(model_, 0.0, work_);
    for (TimeJet& jet : work_.motion) jet.rate = jet.acceleration = 0.0;
    motion_ = work_.motion;
    work_.w.setZero();
    update_positions(model_, work_);
    update_velocities(model_, work_);
    for (const Direction& d : independent_directions(model_, work_))
      if (d.rate >= 0) joints_.push_back(d);
    let_joints_go();
  }

  // Generalised forces on all rates that are left when the joints have taken up their accelerations.
  VecX forces(double t) {
    update_expressions(model_, t, work_);
    work_.motion = motion_;
    VecX accelerations = VecX::Zero(model_.nv);
    VecX free = at(accelerations);
    if (joints_.empty()) return free;
    const VecX relief = least_squares(mass_, VecX(of_joints(free)));
    for (size_t k = 0; k < joints_.size(); ++k) accelerations[joints_[k].v] = relief[static_cast<Eigen::Index>(k)];
    return at(accelerations);
  }

 private:
  VecX at(const VecX& accelerations) {
    RestForces rest;
    rest_forces(model_, work_, nullptr, rest, &accelerations);
    return rest.force;
  }

  VecX of_joints(const VecX& force) const {
    VecX out(static_cast<Eigen::Index>(joints_.size()));
    for (size_t k = 0; k < joints_.size(); ++k) out[static_cast<Eigen::Index>(k)] = force[joints_[k].v];
    return out;
  }

  // Mass matrix of the joints' rates, by what unit accelerations take.
  void let_joints_go() {
    const Eigen::Index n = static_cast<Eigen::Index>(joints_.size());
    mass_ = MatX::Zero(n, n);
    if (n == 0) return;
    const VecX rest = of_joints(at(VecX::Zero(model_.nv)));
    for (Eigen::Index k = 0; k < n; ++k) {
      VecX unit = VecX::Zero(model_.nv);
      unit[joints_[k].v] = 1.0;
      mass_.col(k) = rest - of_joints(at(unit));
    }
  }

  System system_;
  Model& model_;
  Work& work_;
  std::vector<TimeJet> motion_;
  std::vector<Direction> joints_;
  MatX mass_;
};

// The farthest that a part's nodes turn against its root (against its frame, where that is no end's), rad.
double turn_of(const Part& part, const VecX& q, bool beam, bool from_root) {
  Vec3 root = Vec3::Zero();
  if (from_root)
    for (const FlexibleNode& node : part.body.nodes)
      if (node.name == "root") root = node.psi * q;
  double most = 0.0;
  for (const FlexibleNode& node : part.body.nodes) {
    const Vec3 rotation = node.psi * q - root;
    most = std::max(most, beam ? tangent_turn(rotation) : rotation.norm());
  }
  return most;
}

bool starts_in_equilibrium(const Scene& scene, size_t body) {
  const auto* beam = std::get_if<BeamDef>(&scene.bodies[body].kind);
  return scene.simulation.static_start || (beam && beam->initial.static_start);
}

}  // namespace

Notes expected_turns(const System& system, double tolerated) {
  Notes out;
  const Scene& scene = system.scene;
  std::vector<double> turns(scene.bodies.size(), 0.0);
  const auto counts = [&](const Part& part) {
    if (part.scene_body < 0 || part.body.n == 0) return false;
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[part.scene_body].kind);
    return !beam || beam->model != BeamModel::lumped;
  };
  if (!all_have_inertia(system.model) || std::none_of(system.model.parts.begin(), system.model.parts.end(), counts)) return out;
  HeldStart start(system);
  const double duration = system.model.settings.duration;
  for (int look = 0; look <= looks; ++look) {
    const VecX force = start.forces(duration * look / looks);
    for (const Part& part : system.model.parts) {
      if (!counts(part)) continue;
      const size_t body = part.scene_body;
      const auto* beam = std::get_if<BeamDef>(&scene.bodies[body].kind);
      // What a coordinate without stiffness does is no deflection.
      const VecX q =
          system.work.q.segment(part.eq0, part.body.n) + least_squares(part.body.Ke, VecX(force.segment(part.ev0, part.body.n)), 1e-12);
      const bool from_root = beam && (system.model.pieces[body].size() > 1 || beam->boundary == Boundary::clamped_free);
      const double swing = look == 0 && !starts_in_equilibrium(scene, body) ? 2.0 : 1.0;
      turns[body] = std::max(turns[body], swing * turn_of(part, q, beam != nullptr, from_root));
    }
  }
  for (size_t b = 0; b < turns.size(); ++b) {
    const double error = error_growth(scene, system.model, static_cast<int>(b)).at_rest * turns[b] * turns[b];
    if (error <= tolerated) continue;
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind);
    const bool chain = system.model.pieces[b].size() > 1;
    const char* instead = !beam ? "cut it into several bodies" : chain ? "take more volumes" : "take model = \"mixed\"";
    out.tell(fmt::format("body '{}'", scene.bodies[b].name),
             fmt::format("its loads may bend it by {:.2g} degrees in its frame (linear statics), where its displacements are {}: {}",
                         turns[b] * 180.0 / std::numbers::pi, error < 0.5 ? fmt::format("off by some {:.0f} %", 100.0 * error) : "wrong",
                         instead));
  }
  return out;
}

}  // namespace flexframe::sim
