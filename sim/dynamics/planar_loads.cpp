#include "sim/dynamics/planar_data.h"

#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/loads.h"

#include <limits>

namespace flexframe::sim {

using namespace planar;

void PlanarDynamics::Data::loads(const Model& model, const Work& work) {
  applied = 0.0;
  for (PlanarPart& p : parts) {
    p.load.setZero();
    if (p.body.n > 0) p.load_e.setZero();
  }
  const auto apply = [&](int frame, const Vec3& F) {
    const Frame& f = frames[frame];
    if (f.part == ground) return;
    PlanarPart& p = parts[f.part];
    p.load += wrench_to_parent(f.pose, F);
    if (f.flexible) add_dots(f.B, F, p.load_e.data());
  };
  const auto world = [&](int frame) {
    const Frame& f = frames[frame];
    return f.part == ground ? f.pose : compose(parts[f.part].world, f.pose);
  };
  for (size_t i = 0; i < model.loads.size(); ++i) {
    const Load& load = model.loads[i];
    Frame& on = frames[load.on];
    for (int at : {load.on, load.from}) {
      Frame& f = frames[at];
      if (f.flexible) {
        frame_pose(f, parts[f.part].q);
        frame_jacobian(f);
      }
      frame_velocity(f);
      if (load.from == load.on) break;
    }
    if (load.def.kind == ForceKind::spring_damper) {
      Frame& from = frames[load.from];
      const Pose2 a = world(load.from), b = world(load.on);
      const Vec2 d = b.p - a.p;
      const double length = d.norm();
      const Vec2 u = length > 0.0 ? Vec2(d / length) : Vec2(Vec2::Zero());
      const double rate = u.dot(turn(b, on.V.head<2>()) - turn(a, from.V.head<2>()));
      const Spring& s = load.def.spring;
      const Vec2 force = (-s.preload - s.stiffness * (length - s.rest) - s.damping * rate) * u;
      const Vec2 at_on = turn_back(b, force), at_from = turn_back(a, force);
      apply(load.on, {at_on.x(), at_on.y(), 0.0});
      apply(load.from, {-at_from.x(), -at_from.y(), 0.0});
      continue;
    }
    const double value = work.expression_value[load.expression];
    Vec3 d = load_direction[i] * value;
    if (load.def.kind == ForceKind::distributed) {
      PlanarPart& p = parts[on.part];
      d *= model.parts[on.part].load_factor;
      Vec2 a = d.head<2>();
      if (!load.def.follower) a = turn_back(p.world, a);
      const Vec2 md(p.body.Mrr(1, 2), -p.body.Mrr(0, 2));
      const Vec3 F(p.body.mass * a.x(), p.body.mass * a.y(), cross(md, a));
      p.load += F;
      applied += F.dot(p.V);
      if (p.body.n > 0) {
        p.load_e += p.body.Mre.col(0) * a.x() + p.body.Mre.col(1) * a.y();
        applied += a.x() * p.body.Mre.col(0).dot(p.qd) + a.y() * p.body.Mre.col(1).dot(p.qd);
      }
      continue;
    }
    if (load.def.kind == ForceKind::force && !load.def.follower) {
      const Vec2 f = turn_back(world(load.on), d.head<2>());
      d.head<2>() = f;
    }
    apply(load.on, d);
    applied += d.dot(on.V);
  }
}

bool PlanarDynamics::follows_loads(const Model& model) const {
  for (const Part& p : model.parts)
    if (p.joint.motion >= 0) return false;
  for (const Cluster& c : model.clusters)
    if (c.parent != ground) return false;
  return true;
}

void PlanarDynamics::load_responses(const Model& model, Work& work, VecX& out) {
  Data& d = *data_;
  Eigen::Index n = 0;
  for (const ClusterWork& cw : work.clusters) n += static_cast<Eigen::Index>(cw.partition.ind.size());
  out.setZero(static_cast<Eigen::Index>(model.loads.size()) * (n + 1));
  for (size_t i = 0; i < model.loads.size(); ++i) {
    const Load& load = model.loads[i];
    auto column = out.segment(static_cast<Eigen::Index>(i) * (n + 1), n + 1);
    if (load.def.kind != ForceKind::force && load.def.kind != ForceKind::torque) {
      column.setConstant(std::numeric_limits<double>::quiet_NaN());
      continue;
    }
    const Frame& f = d.frames[load.on];
    if (f.part == ground) continue;
    Vec3 wrench = d.load_direction[i];
    if (load.def.kind == ForceKind::force && !load.def.follower) {
      const Vec2 direction = turn_back(compose(d.parts[f.part].world, f.pose), wrench.head<2>());
      wrench.head<2>() = direction;
    }
    const int k = model.parts[f.part].cluster;
    Eigen::Index first = 0;
    for (int c = 0; c < k; ++c) first += static_cast<Eigen::Index>(work.clusters[c].partition.ind.size());
    ClusterWork& cw = work.clusters[k];
    cw.line.setZero(model.clusters[k].nv);
    d.project(model, k, load.on, wrench, true, cw.line);
    const Eigen::Index ni = static_cast<Eigen::Index>(cw.partition.ind.size());
    for (Eigen::Index a = 0; a < ni; ++a) column[first + a] = cw.line[cw.partition.ind[static_cast<size_t>(a)]];
    for (size_t e = 0; e < cw.partition.dep.size(); ++e)
      column.segment(first, ni) += cw.Et.col(static_cast<Eigen::Index>(e)) * cw.line[cw.partition.dep[e]];
    solve(cw.D, &column[first]);
    column[n] = wrench.dot(f.V);
  }
}

double PlanarDynamics::applied_power() const { return data_->applied; }

double PlanarDynamics::dissipated_power(const Model& model, const Work& work) const {
  double power = joint_dissipated_power(model, work);
  for (const PlanarPart& p : data_->parts)
    if (p.body.De.size() > 0) power += p.qd.dot(p.body.De * p.qd);
  for (const Load& load : model.loads) {
    if (load.def.kind != ForceKind::spring_damper || load.def.spring.damping == 0.0) continue;
    const Frame& a = data_->frames[load.from];
    const Frame& b = data_->frames[load.on];
    const auto world = [&](const Frame& f) { return f.part == ground ? f.pose : compose(data_->parts[f.part].world, f.pose); };
    const Pose2 A = world(a), B = world(b);
    const Vec2 line = B.p - A.p;
    const double length = line.norm();
    if (length == 0.0) continue;
    const double rate = (line / length).dot(turn(B, b.V.head<2>()) - turn(A, a.V.head<2>()));
    power += load.def.spring.damping * rate * rate;
  }
  return power;
}

}  // namespace flexframe::sim
