#include "sim/start/static_problem.h"

#include "sim/base/eigen_solvers.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/kinematics.h"
#include "sim/scene/joint_kinds.h"

#include <algorithm>

namespace flexframe::sim {

bool starts_static(const BodyDef& body) {
  if (const auto* beam = std::get_if<BeamDef>(&body.kind)) return beam->initial.static_start;
  if (const auto* modal = std::get_if<ModalDef>(&body.kind)) return modal->initial.static_start;
  if (const auto* space = std::get_if<StateSpaceDef>(&body.kind)) return space->initial.static_start;
  return false;
}

Sought what_is_sought(const Model& model, const Scene& scene) {
  const size_t n = model.parts.size();
  Sought out{std::vector<char>(n, 0), std::vector<char>(n, 0), {}};
  // Trees that hang on ground, joined where a loop runs through them: what happens in one does not move another.
  std::vector<int> tree(n);
  for (const Cluster& c : model.clusters) {
    const int id = c.parent == ground ? c.parts.front() : tree[c.parent];
    for (int i : c.parts) tree[i] = id;
  }
  std::vector<char> touched(n, 0);
  for (size_t i = 0; i < n; ++i) {
    const Part& p = model.parts[i];
    out.elastic[i] = scene.simulation.static_start || (p.scene_body >= 0 && starts_static(scene.bodies[p.scene_body]));
    if (out.elastic[i]) touched[tree[i]] = 1;
  }
  for (size_t i = 0; i < n; ++i) {
    const Part& p = model.parts[i];
    const JointDef* def = p.joint.scene_joint >= 0 ? &scene.joints[p.joint.scene_joint] : nullptr;
    out.joint[i] = touched[tree[i]] && !(def && (def->initial.value || def->initial.rate));
  }
  return out;
}

// Held joints inside loops become closure conditions, so that no loop moves them.
void lock_held(const Model& model, const Sought& sought, Work& work) {
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    if (!has_closure(model.clusters[c])) continue;
    ClusterWork& cw = work.clusters[c];
    std::vector<double> value;
    for (int i : model.clusters[c].parts) {
      const Part& p = model.parts[i];
      if (sought.joint[i]) continue;
      for (int k = 0; k < p.joint.nv; ++k) {
        cw.locked.push_back(p.v0 - model.clusters[c].v0 + k);
        value.push_back(p.joint.nq == p.joint.nv ? work.q[p.q0 + k] : 0.0);
      }
    }
    if (cw.locked.empty()) continue;
    cw.lock_value = Eigen::Map<const VecX>(value.data(), static_cast<Eigen::Index>(value.size()));
    cw.partition = choose_partition(model, static_cast<int>(c), work, true);
    close_positions(model, static_cast<int>(c), work);
  }
}

void unlock(const Model& model, Work& work) {
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    ClusterWork& cw = work.clusters[c];
    if (cw.locked.empty()) continue;
    cw.locked.clear();
    cw.lock_value.resize(0);
    cw.partition = choose_partition(model, static_cast<int>(c), work, false);
  }
}

void load_at_rest(const Model& model, Work& work) {
  for (const Load& load : model.loads) {
    if (load.expression < 0) continue;
    TimeFunction at_zero = model.expressions[load.expression];
    at_zero.unfreeze();
    work.expression_value[load.expression] = at_zero.value(0.0);
  }
}

StaticProblem static_problem(const Model& model, Work& work) {
  return {model, model.settings.gravity, work.expression_value, work.motion, work, {}, {}, {}, false, {}, false};
}

void StaticProblem::load(double share) {
  model.settings.gravity = share * gravity;
  for (size_t i = 0; i < expression.size(); ++i) work.expression_value[i] = share * expression[i];
  for (size_t i = 0; i < motion.size(); ++i) work.motion[i] = {motion[i].value, share * motion[i].rate, share * motion[i].acceleration};
}

namespace {

// What acts on a body by its mass.
bool weighs(const Model& model) {
  return !model.settings.gravity.isZero(0.0) ||
         std::any_of(model.loads.begin(), model.loads.end(), [](const Load& l) { return l.def.kind == ForceKind::distributed; });
}

// update_positions, the masses of those parts alone that have deformed since: of a beam of many pieces one is moved at a time. idle: none
// is asked for.
void update_moved(const Model& model, bool elastic_masses, bool idle, std::vector<VecX>& weighed, Work& work) {
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    close_positions(model, static_cast<int>(c), work);
    update_cluster_world(model, static_cast<int>(c), work);
  }
  for (size_t i = 0; !idle && i < model.parts.size(); ++i) {
    PartWork& p = work.parts[i];
    if (weighed[i].size() > 0 && weighed[i] == p.q) continue;
    update_mass(kinetic_body(model, work, static_cast<int>(i)), p.q, p.terms, elastic_masses);
    weighed[i] = p.q;
  }
}

}  // namespace

bool StaticProblem::evaluate(const std::vector<VecX>* elastic, VecX& f) {
  // Where nothing moves, no elastic coordinate accelerates either.
  const bool moves =
      std::any_of(work.motion.begin(), work.motion.end(), [](const TimeJet& jet) { return jet.rate != 0.0 || jet.acceleration != 0.0; });
  const bool idle = !moves && work.w.isZero(0.0) && !weighs(model);
  try {
    if (weighed.empty() && !idle) update_positions(model, work, moves);
    else update_moved(model, moves, idle, weighed, work);
    if (moves || !stands) update_velocities(model, work);
    rest_forces(model, work, elastic, rest);
  } catch (const SimulationError&) {
    return false;
  }
  f.resize(static_cast<Eigen::Index>(sought.size()));
  for (size_t k = 0; k < sought.size(); ++k)
    f[static_cast<Eigen::Index>(k)] = rest.force[sought[k].v] / scale[static_cast<Eigen::Index>(k)];
  return f.allFinite();
}

void StaticProblem::find_directions(const Sought& what) {
  sought.clear();
  for (const Direction& d : independent_directions(model, work))
    if ((d.rate >= 0 ? what.joint[d.part] : what.elastic[d.part]) && (what.left.empty() || !what.left[d.v])) sought.push_back(d);
  scale.resize(static_cast<Eigen::Index>(sought.size()));
  for (size_t k = 0; k < sought.size(); ++k) scale[static_cast<Eigen::Index>(k)] = sought[k].scale;
}

bool StaticProblem::stiffness(MatX& K) {
  weighed.assign(model.parts.size(), {});
  const bool made = difference(K);
  weighed.clear();
  stands = false;
  return made;
}

bool StaticProblem::difference(MatX& K) {
  const Eigen::Index n = static_cast<Eigen::Index>(sought.size());
  VecX base, f;
  std::vector<VecX> elastic(model.parts.size());
  if (!evaluate(nullptr, base)) return false;
  stands = work.w.isZero(0.0);
  for (size_t i = 0; i < model.parts.size(); ++i) elastic[i] = work.parts[i].elastic;
  // Rates that a unit rate of each direction makes, for the elastic stiffness.
  const VecX q = work.q, w = work.w;
  K = MatX::Zero(n, n);
  MatX N = MatX::Zero(model.nv, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Direction& d = sought[k];
    const size_t cluster = model.parts[d.part].cluster;
    const ClusterWork& cw = work.clusters[cluster];
    const int v0 = model.clusters[cluster].v0;
    N(d.v, k) = 1.0 / d.scale;
    for (size_t i = 0; i < cw.partition.ind.size(); ++i)
      if (v0 + cw.partition.ind[i] == d.v)
        for (size_t r = 0; r < cw.partition.dep.size(); ++r) N(v0 + cw.partition.dep[r], k) = cw.E(r, i) / d.scale;
  }
  for (const Part& p : model.parts) {
    if (p.body.n == 0) continue;
    const auto e = N.middleRows(p.ev0, p.body.n);
    std::vector<Eigen::Index> moving;
    for (Eigen::Index k = 0; k < n; ++k)
      if (!e.col(k).isZero(0.0)) moving.push_back(k);
    for (Eigen::Index k : moving) {
      const VecX force = p.body.Ke * e.col(k);
      for (Eigen::Index i : moving) K(i, k) += e.col(i).dot(force);
    }
  }
  // Two evaluations for each coordinate of the part that has most, and three for the loads; else one for every coordinate.
  std::vector<Eigen::Index> own(model.parts.size(), 0);
  for (const Direction& d : sought) ++own[d.part];
  if (by_parts && n > 0 && 2 * *std::max_element(own.begin(), own.end()) + 3 < n && stands_as_tree())
    return difference_by_parts(base, elastic, K);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Direction& d = sought[k];
    // 1e-6 of the size: the truncation (1e-6 relative) costs Newton one digit a step, rounding stays at 1e-10.
    const double step = 1e-6 * model.size;
    move_along(model, d, step / d.scale, work);
    if (!evaluate(&elastic, f)) return false;
    K.col(k) -= (f - base) / step;
    work.q = q;
    work.w = w;
  }
  return evaluate(nullptr, base);
}

// Whether it is a tree at rest whose loads keep their directions, whatever moves; springs are those of joints.
bool StaticProblem::stands_as_tree() const {
  return stands && model.loops.empty() && model.flexures.empty() && model.blocks.empty() &&
         std::all_of(work.motion.begin(), work.motion.end(),
                     [](const TimeJet& jet) { return jet.rate == 0.0 && jet.acceleration == 0.0; }) &&
         std::all_of(work.clusters.begin(), work.clusters.end(),
                     [](const ClusterWork& c) { return c.partition.dep.empty() && c.locked.empty(); }) &&
         std::all_of(model.loads.begin(), model.loads.end(), [](const Load& l) {
           return !l.table && l.function < 0 && l.contact < 0 && !l.def.follower &&
                  (l.def.kind == ForceKind::force || l.def.kind == ForceKind::distributed);
         });
}

namespace {

// The sought directions of every part, and 3 x those of its parent: how fast a unit of each of these (in metres) turns it in the world.
struct Turning {
  std::vector<std::vector<Eigen::Index>> of;
  std::vector<Mat3X> by_parent;
  size_t most = 0;  // directions of a part
};

// Every second generation is moved at once: between a part's parent and its child then stands what the part itself does.
Turning turning_of(const Model& model, const std::vector<Direction>& sought, Work& work) {
  const size_t n = model.parts.size();
  Turning out{std::vector<std::vector<Eigen::Index>>(n), std::vector<Mat3X>(n), 0};
  for (size_t k = 0; k < sought.size(); ++k) out.of[sought[k].part].push_back(static_cast<Eigen::Index>(k));
  std::vector<bool> odd(n, false);
  for (size_t i = 0; i < n; ++i) {
    const int parent = model.parts[i].parent;
    out.most = std::max(out.most, out.of[i].size());
    if (parent == ground) continue;
    odd[i] = !odd[parent];
    out.by_parent[i] = Mat3X::Zero(3, static_cast<Eigen::Index>(out.of[parent].size()));
  }
  const auto turns = [&](int part) {
    return part == ground ? Vec3(Vec3::Zero()) : Vec3(work.parts[part].world.R * work.parts[part].V.tail<3>());
  };
  for (size_t j = 0; j < out.most; ++j)
    for (const bool generation : {false, true}) {
      work.w.setZero();
      bool any = false;
      for (size_t i = 0; i < n; ++i) {
        if (odd[i] != generation || j >= out.of[i].size()) continue;
        const Direction& d = sought[out.of[i][j]];
        work.w[d.v] = 1.0 / d.scale;
        any = true;
      }
      if (!any) continue;
      update_velocities(model, work);
      for (size_t i = 0; i < n; ++i) {
        const int parent = model.parts[i].parent;
        if (parent == ground || odd[parent] != generation || j >= out.of[parent].size()) continue;
        out.by_parent[i].col(static_cast<Eigen::Index>(j)) = turns(static_cast<int>(i)) - turns(model.parts[parent].parent);
      }
    }
  work.w.setZero();
  update_velocities(model, work);
  return out;
}

}  // namespace

bool StaticProblem::difference_by_parts(const VecX& base, const std::vector<VecX>& elastic, MatX& K) {
  const Eigen::Index n = static_cast<Eigen::Index>(sought.size());
  // Forces on the directions if all loads turn about an axis of the world: they are linear in the loads.
  Eigen::Matrix<double, Eigen::Dynamic, 3> turned(n, 3);
  VecX f, before;
  for (int a = 0; a < 3; ++a) {
    const Vec3 axis = Vec3::Unit(a), weight = model.settings.gravity;
    std::vector<Vec3> direction;
    for (Load& l : model.loads) {
      direction.push_back(l.def.direction);
      l.def.direction += axis.cross(l.def.direction);
    }
    model.settings.gravity += axis.cross(weight);
    const bool good = evaluate(&elastic, f);
    model.settings.gravity = weight;
    for (size_t i = 0; i < direction.size(); ++i) model.loads[i].def.direction = direction[i];
    if (!good) return false;
    turned.col(a) = f - base;
  }
  const Turning turning = turning_of(model, sought, work);
  // What turns a part turns it against the loads; the loads have a potential, so that the matrix is symmetric.
  MatX others = MatX::Zero(n, n);
  for (size_t i = 0; i < model.parts.size(); ++i)
    for (int child = static_cast<int>(i), part = model.parts[i].parent; part != ground; child = part, part = model.parts[part].parent)
      for (size_t j = 0; j < turning.of[part].size(); ++j) {
        const Vec3 turn = turning.by_parent[child].col(static_cast<Eigen::Index>(j));
        const Eigen::Index k = turning.of[part][j];
        for (Eigen::Index r : turning.of[i]) others(r, k) = others(k, r) = turned.row(r).dot(turn);
      }
  K += others;
  // What is left stands within the parts: the same coordinate of every part is moved at once. Central differences, as the steps add up.
  const VecX q = work.q;
  const double step = 1e-6 * model.size;
  for (size_t j = 0; j < turning.most; ++j) {
    const auto beside = [&](double by, VecX& out) {
      for (const auto& own : turning.of)
        if (j < own.size()) move_along(model, sought[own[j]], by / sought[own[j]].scale, work);
      const bool good = evaluate(&elastic, out);
      work.q = q;
      return good;
    };
    if (!beside(step, f) || !beside(-step, before)) return false;
    VecX slope = (before - f) / (2.0 * step);
    for (const auto& own : turning.of)
      if (j < own.size()) slope -= others.col(own[j]);
    for (const auto& own : turning.of)
      if (j < own.size())
        for (Eigen::Index r : own) K(r, own[j]) += slope[r];
  }
  return evaluate(nullptr, f);
}

namespace {

// Closes a cluster's conditions by whatever moves most, joints and deformations alike: two elastic bars in line are closed by their
// lengths, not by their angles, so that the angles may pass the line. Complete pivoting of the rows in use, in metres.
Partition close_by_size(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  Partition out;
  out.rows = cw.partition.rows;
  update_closure_matrix(model, cluster, work);
  const VecX per_metre = rate_sizes(model).segment(c.v0, c.nv).cwiseInverse();
  MatX A = (closure_row_scales(model, work, cluster).asDiagonal() * cw.G * per_metre.asDiagonal())(out.rows, Eigen::all);
  std::vector<char> used(c.nv, 0);
  for (Eigen::Index step = 0; step < A.rows(); ++step) {
    Eigen::Index row = 0, column = 0;
    if (!(A.bottomRows(A.rows() - step).cwiseAbs().maxCoeff(&row, &column) > 0.0)) return cw.partition;
    row += step;
    A.row(step).swap(A.row(row));
    std::swap(out.rows[step], out.rows[row]);
    used[column] = 1;
    out.dep.push_back(static_cast<int>(column));
    for (Eigen::Index r = step + 1; r < A.rows(); ++r) A.row(r) -= (A(r, column) / A(step, column)) * A.row(step);
  }
  for (int k = 0; k < c.nv; ++k)
    if (!used[k]) out.ind.push_back(k);
  return out;
}

}  // namespace

bool leapt(const StaticProblem& p, const VecX& q) {
  bool leapt = false;
  for (size_t c = 0; c < p.model.clusters.size(); ++c) {
    ClusterWork& cw = p.work.clusters[c];
    if (cw.partition.dep.empty() || !crossed(cw)) continue;
    const Cluster& cluster = p.model.clusters[c];
    double farthest = 0.0;
    for (const int i : cluster.parts) {
      const Part& part = p.model.parts[i];
      for (int k = 0; k < part.joint.nq; ++k) {
        const double metres = is_length(part.joint.kind, k) ? 1.0 : cluster.size;
        farthest = std::max(farthest, std::abs(p.work.q[part.q0 + k] - q[part.q0 + k]) * metres);
      }
    }
    if (farthest > 1e-6 * cluster.size) leapt = true;
    else cw.partition.side = cw.side;
  }
  return leapt;
}

void renew_partitions(const Model& model, bool by_size, Work& work) {
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    const int cluster = static_cast<int>(c);
    ClusterWork& cw = work.clusters[c];
    if (cw.partition.dep.empty()) continue;
    if (by_size) cw.partition = close_by_size(model, cluster, work);
    else if (partition_growth(model, cluster, work) >= largest_growth) cw.partition = choose_partition(model, cluster, work, true);
  }
}

}  // namespace flexframe::sim
