#include "sim/start/held_lengths.h"

#include "sim/dynamics/closure.h"
#include "sim/dynamics/kinematics.h"
#include "sim/model/bodies.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::sim {
namespace {

// Whether a beam does not lengthen.
bool stiff_along(const Model& model, const Scene& scene, int body) {
  const auto* beam = std::get_if<BeamDef>(&scene.bodies[body].kind);
  if (!beam) return false;
  if (beam->model == BeamModel::lumped) return true;
  return std::any_of(model.effects.begin(), model.effects.end(),
                     [&](const EffectState& s) { return s.owner == scene.bodies[body].name && s.effect == "axial" && !s.on; });
}

// Place of a frame along its beam, m from the root.
double place_along(const Model& model, int frame) {
  return compose(model.parts[model.frames[frame].part].rest_in_body, rest_pose(model, frame)).p.x();
}

// Displacement of a frame, in the axes of the cluster's base, when a beam that carries it or is its body lengthens by its own length
// (strain 1).
Vec3 lengthened(const Model& model, const Work& work, int cluster, int body, int frame) {
  int on = frame, first = -1, last = -1;
  for (int i = model.frames[frame].part; i != ground && model.parts[i].cluster == cluster; i = model.parts[i].parent) {
    const Part& part = model.parts[i];
    if (part.scene_body == body) {
      if (first < 0) first = on;
      last = part.joint.outboard;
    }
    on = part.joint.inboard;
  }
  if (first < 0) return Vec3::Zero();
  const int part = model.frames[first].part;
  const Vec3 axis = work.parts[part].in_base.R * model.parts[part].rest_in_body.R.transpose() * Vec3::UnitX();
  return (place_along(model, first) - place_along(model, last)) * axis;
}

// Work of multipliers (one a closure row) on the lengthening of a beam by its own length.
double work_of(const Model& model, const Work& work, int cluster, int body, const VecX& multipliers) {
  double sum = 0.0;
  Eigen::Index row = 0;
  for (int l : model.clusters[cluster].loops) {
    const LoopJoint& loop = model.loops[l];
    const auto count = static_cast<Eigen::Index>(loop.rows.size());
    const auto [on_a, on_b] = closure_wrench(model, work, cluster, l, multipliers.segment(row, count));
    sum += (frame_in_base(model, work, cluster, loop.a).R * on_a.head<3>()).dot(lengthened(model, work, cluster, body, loop.a));
    sum += (frame_in_base(model, work, cluster, loop.b).R * on_b.head<3>()).dot(lengthened(model, work, cluster, body, loop.b));
    row += count;
  }
  return sum;
}

}  // namespace

std::vector<HeldLength> held_lengths(const Model& model, const Scene& scene, Work& work) {
  std::vector<HeldLength> out;
  for (size_t k = 0; k < model.clusters.size(); ++k) {
    const int cluster = static_cast<int>(k);
    const Cluster& c = model.clusters[k];
    ClusterWork& cw = work.clusters[k];
    const Partition& chosen = cw.partition;
    const int rows = closure_row_count(model, work, cluster);
    std::vector<int> beams;
    for (int i : c.parts)
      if (const int b = model.parts[i].scene_body;
          b >= 0 && stiff_along(model, scene, b) && std::find(beams.begin(), beams.end(), b) == beams.end())
        beams.push_back(b);
    if (beams.empty() || rows <= static_cast<int>(chosen.rows.size())) continue;

    const VecX scale = closure_row_scales(model, work, cluster);
    update_closure_matrix(model, cluster, work);
    const auto nd = static_cast<Eigen::Index>(chosen.dep.size());
    const MatX dependent = cw.G(chosen.rows, chosen.dep).transpose();
    const Eigen::PartialPivLU<MatX> lu(dependent);
    for (int r = 0; r < rows; ++r) {
      if (std::find(chosen.rows.begin(), chosen.rows.end(), r) != chosen.rows.end()) continue;
      VecX multipliers = VecX::Zero(rows);
      multipliers[r] = scale[r];
      if (nd > 0) {
        const VecX balance = lu.solve(VecX(scale[r] * cw.G(r, chosen.dep).transpose()));
        for (Eigen::Index i = 0; i < nd; ++i) multipliers[chosen.rows[i]] = -balance[i];
      }
      for (int b : beams) {
        const bool known = std::any_of(out.begin(), out.end(), [&](const HeldLength& h) { return h.body == b; });
        if (!known && std::abs(work_of(model, work, cluster, b, multipliers)) > 0.02 * std::get<BeamDef>(scene.bodies[b].kind).length)
          out.push_back({b, closure_row_name(model, work.clusters[cluster], cluster, r)});
      }
    }
  }
  return out;
}

bool let_lengthen(const std::vector<HeldLength>& held, Scene& scene, Notes& notes) {
  bool anew = false;
  for (const HeldLength& h : held) {
    BodyDef& body = scene.bodies[h.body];
    BeamDef& beam = std::get<BeamDef>(body.kind);
    const bool modes_listed = beam.model == BeamModel::modal && !beam.modes.empty();
    const bool left_out = std::find(beam.effects.without.begin(), beam.effects.without.end(), "axial") != beam.effects.without.end();
    if (beam.effects.automatic && beam.chosen.held_by.empty() && !modes_listed && !left_out) {
      beam.chosen.held_by = h.joint;
      anew = true;
      continue;
    }
    notes.warn(
        fmt::format("body '{}'", body.name),
        fmt::format("the loop of joint '{}' holds its length, and axial is off: the loop opens by the amount that bending shortens the "
                    "beam",
                    h.joint));
  }
  return anew;
}

}  // namespace flexframe::sim
