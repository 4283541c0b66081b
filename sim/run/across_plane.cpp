#include "sim/run/across_plane.h"

#include "sim/base/eigen_solvers.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/kinematics.h"
#include "sim/start/linearise.h"
#include "sim/start/make_system.h"
#include "sim/start/static_problem.h"
#include "sim/start/statics.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::sim {
namespace {

// Elastic coordinates of the scene in space, more of which would take longer than most runs.
constexpr int most_coordinates = 250;

// The beams that the scene's plane leaves without deformations, with all of them.
std::vector<std::string> let_out_of_plane(const std::vector<EffectState>& effects, Scene& scene) {
  std::vector<std::string> beams;
  for (BodyDef& body : scene.bodies) {
    auto* beam = std::get_if<BeamDef>(&body.kind);
    if (!beam || !beam->effects.automatic || !beam->modes.empty()) continue;
    std::vector<std::string> names;
    bool held = false;
    for (const EffectState& s : effects) {
      if (s.owner != body.name) continue;
      if (s.on) names.push_back(s.effect);
      held = held || (!s.on && s.by == "symmetry" && s.effect.starts_with("bending"));
    }
    if (!held) continue;
    for (const char* name : {"bending_xy", "bending_xz", "torsion", "stiffening"}) {
      const auto& without = beam->effects.without;
      if (std::find(without.begin(), without.end(), name) != without.end()) continue;
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
    beam->effects.automatic = false;
    beam->effects.names = names;
    beams.push_back(body.name);
  }
  return beams;
}

int unstable_modes(const Linearisation& linear) {
  return static_cast<int>(
      std::count_if(linear.modes.begin(), linear.modes.end(), [](const LinearMode& m) { return m.kind == LinearMode::unstable; }));
}

// The normal of the plane in which a beam of the scene bends, world axes.
Vec3 normal_of(const System& flat, const std::vector<EffectState>& effects, const std::string& beam) {
  const bool in_xy = std::any_of(effects.begin(), effects.end(),
                                 [&](const EffectState& s) { return s.owner == beam && s.effect == "bending_xz" && !s.on; });
  for (size_t i = 0; i < flat.model.parts.size(); ++i) {
    const int body = flat.model.parts[i].scene_body;
    if (body >= 0 && flat.scene.bodies[body].name == beam) return flat.work.parts[i].world.R.col(in_xy ? 2 : 1);
  }
  return Vec3::UnitZ();
}

// Far above rounding, far below any direction that leads out of the plane.
constexpr double within_plane = 1e-6;

// Coordinates of beams as stiff one way as the other bend them in any direction: partly within the plane, partly out of it.
enum Way : char { within = 0, partly_out, all_out };

// How far a unit of one coordinate moves points of a mechanism, m, and how much of that stays within the plane and leads out of it.
struct Leads {
  double all = 0.0, in = 0.0, out = 0.0;
  void count(const Vec3& move, const Vec3& turn, const Vec3& normal, double size) {
    all = std::max({all, move.norm(), size * turn.norm()});
    in = std::max({in, move.cross(normal).norm(), size * std::abs(turn.dot(normal))});
    out = std::max({out, std::abs(move.dot(normal)), size * turn.cross(normal).norm()});
  }
  Way way() const { return out <= within_plane * all ? within : in <= within_plane * all ? all_out : partly_out; }
};

// Coordinates that move something out of the plane or turn it about an axis within, a mark (Way) a rate of w_all.
std::vector<char> leading_out(const Model& model, const Work& work, const Vec3& normal) {
  std::vector<char> out(model.nv, 0);
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& p = model.parts[i];
    const Vec3 in_part = work.parts[i].world.R.transpose() * normal;
    const Vec3 in_joint = frame_world(model, work, p.joint.outboard).R.transpose() * normal;
    for (int k = 0; k < p.joint.nv + p.body.n; ++k) {
      Leads leads;
      if (k < p.joint.nv) {
        const Vec6 S = work.parts[i].joint.S.col(k);
        leads.count(S.head<3>(), S.tail<3>(), in_joint, model.size);
      } else {
        for (const FlexibleNode& node : p.body.nodes)
          leads.count(node.phi.col(k - p.joint.nv), node.psi.col(k - p.joint.nv), in_part, model.size);
      }
      out[k < p.joint.nv ? p.v0 + k : p.ev0 + k - p.joint.nv] = leads.way();
    }
  }
  return out;
}

// Moves the mechanism in space to where the one in the plane rests, as far as their coordinates are the same: joints of the same kind, and
// deformations within the plane by the displacements and rotations of the nodes. The search mends what is left.
void put_where_it_rests(const System& flat, const Model& model, const std::vector<char>& out, Work& work) {
  if (flat.model.parts.size() != model.parts.size()) return;
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part &from = flat.model.parts[i], &to = model.parts[i];
    if (from.name != to.name || from.joint.kind != to.joint.kind || from.body.nodes.size() != to.body.nodes.size()) return;
    work.q.segment(to.q0, to.joint.nq) = flat.work.q.segment(from.q0, from.joint.nq);
    std::vector<int> bend;
    for (int k = 0; k < to.body.n; ++k)
      if (out[to.ev0 + k] != all_out) bend.push_back(k);
    if (bend.empty()) continue;
    const VecX q = flat.work.q.segment(from.eq0, from.body.n);
    const Eigen::Index nodes = static_cast<Eigen::Index>(to.body.nodes.size());
    MatX A(6 * nodes, static_cast<Eigen::Index>(bend.size()));
    VecX b(6 * nodes);
    for (Eigen::Index k = 0; k < nodes; ++k) {
      const FlexibleNode &there = from.body.nodes[k], &here = to.body.nodes[k];
      A.middleRows<3>(6 * k) = here.phi(Eigen::all, bend) / model.size;
      A.middleRows<3>(6 * k + 3) = here.psi(Eigen::all, bend);
      b.segment<3>(6 * k) = there.phi * q / model.size;
      b.segment<3>(6 * k + 3) = there.psi * q;
    }
    work.q(Eigen::seqN(to.eq0, to.body.n)).setZero();
    const VecX x = least_squares(A, b);
    for (size_t k = 0; k < bend.size(); ++k) work.q[to.eq0 + bend[k]] = x[static_cast<Eigen::Index>(k)];
  }
  update_positions(model, work);
  renew_partitions(model, false, work);
  update_positions(model, work);
}

}  // namespace

std::optional<RestInSpace> rest_in_space(const Scene& scene, const std::vector<EffectState>& effects) {
  if (!wants_statics(scene)) return {};
  Scene other = scene;
  other.outputs.clear();
  RestInSpace out;
  out.beams = let_out_of_plane(effects, other);
  if (out.beams.empty()) return {};
  out.flat = make_system(scene);
  const Vec3 normal = normal_of(out.flat, effects, out.beams.front());
  out.wide = make_system(other, [&](const Model& model, Work& work) {
    std::vector<char> left = leading_out(model, work, normal);
    put_where_it_rests(out.flat, model, left, work);
    return left;
  });
  return out;
}

void warn_of_leaving_plane(const Scene& scene, const std::vector<EffectState>& effects, Notes& notes) {
  try {
    const std::optional<RestInSpace> rest = rest_in_space(scene, effects);
    if (!rest || rest->wide.model.nv > most_coordinates) return;
    if (surely_stable(rest->wide)) return;
    if (unstable_modes(linearise(rest->wide)) <= unstable_modes(linearise(rest->flat))) return;
    const bool many = rest->beams.size() > 1;
    notes.warn("", fmt::format("static equilibrium: it holds in the plane only: '{}' buckle{} or tip{} over across it; effects = "
                               "[\"auto\", \"bending_xy\", \"bending_xz\", \"torsion\"] shows that",
                               fmt::join(rest->beams, "', '"), many ? "" : "s", many ? "" : "s"));
  } catch (const SimulationError&) {
    // What has no equilibrium in space, or none that is found, is not judged.
  }
}

}  // namespace flexframe::sim
