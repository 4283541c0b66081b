#include "sim/dynamics/line_stiffness.h"

#include "sim/dynamics/kinematics.h"

#include <cmath>

namespace flexframe::sim {
namespace {

template <class W>
class Lines {
  using S = typename W::In;
  using Linear = typename S::Linear;

 public:
  Lines(const Model& model, const W& work) : model_(model), work_(work) {
    for (const ClusterWork& cw : work.clusters) {
      first_.push_back(rates_);
      rates_ += static_cast<Eigen::Index>(cw.partition.ind.size());
    }
  }

  void add(const Load& load) {
    const Spring& s = load.def.spring;
    const std::vector<int> path = load.path.empty() ? std::vector<int>{load.from, load.on} : load.path;
    std::vector<Stretch> stretches;
    double length = 0.0;
    for (size_t k = 1; k < path.size(); ++k) {
      stretches.push_back(stretch(path[k - 1], path[k], load.path.empty() ? height_between(work_, path[k - 1], path[k]) : 0.0));
      length += stretches.back().length;
    }
    const double rest = load.rest >= 0 ? model_.expressions[load.rest].jet(work_.time).value : s.rest;
    const double pull = load.def.cable ? work_.expression_value[load.expression] : s.preload + s.stiffness * (length - rest);
    if (load.def.cable && pull <= 0.0) return;
    VecX along = VecX::Zero(rates_);
    for (const Stretch& one : stretches) {
      if (one.length <= 0.0) return;  // no direction
      const VecX own = forces(one, one.direction);
      along += own;
      // The pull turns with the line: pull / length across it.
      const double across = pull / one.length;
      if (across == 0.0) continue;
      keep(own, -across, 0.0);
      for (Eigen::Index i = 0; i < Linear::SizeAtCompileTime; ++i) keep(forces(one, Linear::Unit(i)), across, 0.0);
    }
    keep(along, s.stiffness, s.damping);
  }

  // Along and about the axes of `from`, at the origin of `on`. What a rotation vector differs from the turn is left out.
  void add_bushing(const Load& load) {
    const Pose relative = compose(inverse(pose_in_space(model_, work_, load.from)), pose_in_space(model_, work_, load.on));
    for (int i = 0; i < 6; ++i) {
      const double k = load.def.bushing_stiffness[i], c = load.def.bushing_damping[i];
      if (k == 0.0 && c == 0.0) continue;
      const Vec6 f = Vec6::Unit(i);
      Vec6 back = -f;
      back.tail<3>() -= relative.p.cross(Vec3(f.head<3>()));
      VecX own = VecX::Zero(rates_);
      add_forces(load.on, within(work_, load.on, joined(turn_back(relative, linear(f)), turn_back(relative, angular(f)))), own);
      add_forces(load.from, within(work_, load.from, back), own);
      keep(own, k, c);
    }
  }

  LineStiffness result() const {
    const Eigen::Index n = static_cast<Eigen::Index>(stiffness_.size());
    LineStiffness out{MatX(rates_, n), VecX(n), VecX(n)};
    for (Eigen::Index k = 0; k < n; ++k) {
      out.forces.col(k) = forces_[static_cast<size_t>(k)];
      out.stiffness[k] = stiffness_[static_cast<size_t>(k)];
      out.damping[k] = damping_[static_cast<size_t>(k)];
    }
    return out;
  }

 private:
  struct Stretch {
    int from = 0, on = 0;
    Linear direction;
    double length = 0.0;
  };

  Stretch stretch(int from, int on, double height) const {
    const Linear d = frame_world(model_, work_, on).p - frame_world(model_, work_, from).p;
    const double length = std::hypot(d.norm(), height);
    return {from, on, length > 0.0 ? Linear(d / length) : Linear(Linear::Zero()), length};
  }

  void keep(const VecX& forces, double stiffness, double damping) {
    forces_.push_back(forces);
    stiffness_.push_back(stiffness);
    damping_.push_back(damping);
  }

  // Of a unit force along `direction` (world axes) on one end and against it on the other.
  VecX forces(const Stretch& of, const Linear& direction) {
    VecX out = VecX::Zero(rates_);
    for (const bool on : {true, false}) {
      const int frame = on ? of.on : of.from;
      const Linear force = on ? direction : Linear(-direction);
      add_forces(frame, joined(turn_back(frame_world(model_, work_, frame), force), S::no_turn()), out);
    }
    return out;
  }

  // Of a wrench on a frame, frame axes, through the cluster of its part and all that carry it.
  void add_forces(int frame, typename S::Twist F, VecX& out) {
    for (int part = model_.frames[frame].part; part != ground && work_.carrying.moves[part]; part = model_.frames[frame].part) {
      const int k = model_.parts[part].cluster;
      const Cluster& c = model_.clusters[k];
      const ClusterWork& cw = work_.clusters[k];
      const Partition& split = cw.partition;
      line_.setZero(c.nv);
      project_wrench(model_, work_, k, {frame, F}, true, line_);
      auto own = out.segment(first_[k], static_cast<Eigen::Index>(split.ind.size()));
      for (size_t i = 0; i < split.ind.size(); ++i) own[static_cast<Eigen::Index>(i)] += line_[split.ind[i]];
      for (size_t d = 0; d < split.dep.size(); ++d) own += cw.E.row(static_cast<Eigen::Index>(d)).transpose() * line_[split.dep[d]];
      if (c.parent == ground) return;
      F = wrench_to_parent(work_.parts[part].in_base, typename S::Twist(wrench_to_parent(work_.frames[frame].pose, F)));
      frame = c.base;
    }
  }

  const Model& model_;
  const W& work_;
  std::vector<Eigen::Index> first_;
  Eigen::Index rates_ = 0;
  std::vector<VecX> forces_;
  std::vector<double> stiffness_, damping_;
  VecX line_;
};

}  // namespace

bool is_line(const Load& load) {
  if (load.def.kind == ForceKind::bushing) return load.expression < 0 && load.function < 0;
  if (load.def.kind != ForceKind::spring_damper || load.table) return false;
  return load.def.cable || (load.expression < 0 && load.function < 0);
}

template <class W>
LineStiffness line_stiffness(const Model& model, const W& work) {
  Lines<W> lines(model, work);
  for (const Load& load : model.loads)
    if (load.def.kind == ForceKind::bushing && is_line(load)) lines.add_bushing(load);
    else if (is_line(load)) lines.add(load);
  return lines.result();
}

template LineStiffness line_stiffness(const Model&, const Work&);
template LineStiffness line_stiffness(const Model&, const PlaneWork&);

}  // namespace flexframe::sim
