#include "sim/dynamics/closure.h"

#include "sim/base/small_matrices.h"
#include "sim/dynamics/kinematics.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>

namespace flexframe::sim {
namespace {

// Relative kinematics of frame b in the axes of frame a.
struct Relative {
  Mat3 R;
  Vec3 p;
};

Relative relative_pose(const Model& model, const Work& work, int cluster, const LoopJoint& loop) {
  const Pose a = frame_in_base(model, work, cluster, loop.a), b = frame_in_base(model, work, cluster, loop.b);
  const Pose r = compose(inverse(a), b);
  return {r.R, r.p};
}

double row_residual(const ClosureRow& row, const Relative& r) {
  switch (row.kind) {
    case ClosureRow::translation:
      return row.u.dot(r.p);
    case ClosureRow::angle:
      return row.u.dot(r.R * row.b);
    default:
      return (r.p.squaredNorm() - row.length * row.length) / (2.0 * row.length);
  }
}

// Coefficients of the row on the relative velocity (lv) and angular velocity (lw), in the axes of a.
void row_direction(const ClosureRow& row, const Relative& r, Vec3& lv, Vec3& lw) {
  lv.setZero();
  lw.setZero();
  if (row.kind == ClosureRow::translation) lv = row.u;
  if (row.kind == ClosureRow::distance) lv = r.p / row.length;
  if (row.kind == ClosureRow::angle) lw = Vec3(r.R * row.b).cross(row.u);
}

// A force and moment on b (axes of a, about b's origin) and their reaction on a, each in its frame's axes.
void row_wrench(const Relative& r, const Vec3& force, const Vec3& moment, Vec6& on_a, Vec6& on_b) {
  on_b.head<3>() = r.R.transpose() * force;
  on_b.tail<3>() = r.R.transpose() * moment;
  on_a.head<3>() = -force;
  on_a.tail<3>() = -(moment + r.p.cross(force));
}

// Calls on_loop(row, loop joint, closure row, relative pose) and on_lock(row, index of the locked rate).
template <class OnLoop, class OnLock>
void for_rows(const Model& model, const Work& work, int cluster, bool all, OnLoop&& on_loop, OnLock&& on_lock) {
  const Cluster& c = model.clusters[cluster];
  const ClusterWork& cw = work.clusters[cluster];
  // Kept between calls: this runs several times an evaluation.
  static thread_local std::vector<char> wanted;
  wanted.assign(closure_row_count(model, work, cluster), all);
  if (!all)
    for (int r : cw.partition.rows) wanted[r] = 1;
  int row = 0;
  for (int l : c.loops) {
    const LoopJoint& loop = model.loops[l];
    Relative rel{};
    bool have = false;
    for (const ClosureRow& closure : loop.rows) {
      if (wanted[row]) {
        if (!have) rel = relative_pose(model, work, cluster, loop);
        have = true;
        on_loop(row, loop, closure, rel);
      }
      ++row;
    }
  }
  for (size_t k = 0; k < cw.locked.size(); ++k, ++row)
    if (wanted[row]) on_lock(row, k);
}

// The part and joint rate behind rate k of a cluster; elastic rates give rate -1.
std::pair<int, int> rate_owner(const Model& model, int cluster, int k) {
  const Cluster& c = model.clusters[cluster];
  for (int i : c.parts) {
    const Part& p = model.parts[i];
    const int v = c.v0 + k;
    if (v >= p.v0 && v < p.v0 + p.joint.nv) return {i, v - p.v0};
    if (v >= p.ev0 && v < p.ev0 + p.body.n) return {i, -1};
  }
  return {-1, -1};
}

// Largest displacement of a node per unit of an elastic coordinate, rotations counted with `size`; m per unit.
double elastic_reach(const Part& part, int k, double size) {
  double reach = 0.0;
  for (const FlexibleNode& node : part.body.nodes) reach = std::max({reach, node.phi.col(k).norm(), size * node.psi.col(k).norm()});
  return reach;
}

int depth(const Model& model, int part) {
  int d = 0;
  for (int i = model.parts[part].parent; i != ground; i = model.parts[i].parent) ++d;
  return d;
}

}  // namespace

int closure_row_count(const Model& model, const Work& work, int cluster) {
  size_t rows = work.clusters[cluster].locked.size();
  for (int l : model.clusters[cluster].loops) rows += model.loops[l].rows.size();
  return static_cast<int>(rows);
}

namespace {

struct RowOwner {
  std::string joint;
  const char* unit;  // of its residual
};

RowOwner closure_row_owner(const Model& model, const Work& work, int cluster, int row) {
  for (int l : model.clusters[cluster].loops) {
    const LoopJoint& loop = model.loops[l];
    const int n = static_cast<int>(loop.rows.size());
    if (row < n) return {loop.name, loop.rows[row].kind == ClosureRow::angle ? "rad" : "m"};
    row -= n;
  }
  const auto [part, rate] = rate_owner(model, cluster, work.clusters[cluster].locked[row]);
  const TreeJoint& joint = model.parts[part].joint;
  return {joint.name, is_length(joint.kind, rate) ? "m" : "rad"};
}

}  // namespace

std::string closure_row_name(const Model& model, const Work& work, int cluster, int row) {
  return closure_row_owner(model, work, cluster, row).joint;
}

VecX closure_row_scales(const Model& model, const Work& work, int cluster) {
  const Cluster& c = model.clusters[cluster];
  VecX s = VecX::Ones(closure_row_count(model, work, cluster));
  Eigen::Index row = 0;
  for (int l : c.loops)
    for (const ClosureRow& r : model.loops[l].rows) s[row++] = r.kind == ClosureRow::angle ? c.size : 1.0;
  return s;
}

bool deformation_closes(const Model& model, const Work& work, int cluster) {
  const std::vector<int>& dep = work.clusters[cluster].partition.dep;
  return std::any_of(dep.begin(), dep.end(), [&](int k) { return rate_scale(model, cluster, k) == 0.0; });
}

double rate_scale(const Model& model, int cluster, int rate) {
  const auto [part, k] = rate_owner(model, cluster, rate);
  if (k < 0) return 0.0;
  return is_length(model.parts[part].joint.kind, k) ? 1.0 : model.clusters[cluster].size;
}

void update_closure_residual(const Model& model, int cluster, Work& work, bool all) {
  ClusterWork& cw = work.clusters[cluster];
  const int total = closure_row_count(model, work, cluster);
  if (cw.residual.size() != total) cw.residual = VecX::Zero(total);
  for_rows(
      model, work, cluster, all,
      [&](int row, const LoopJoint&, const ClosureRow& closure, const Relative& rel) { cw.residual[row] = row_residual(closure, rel); },
      [&](int row, size_t lock) {
        const auto [part, k] = rate_owner(model, cluster, cw.locked[lock]);
        // An orientation has no coordinate of its own for a rate: it stays because its rate does.
        // What is carried along stands where its coordinates say.
        const TreeJoint& joint = model.parts[part].joint;
        cw.residual[row] = joint.nq == joint.nv && lock >= static_cast<size_t>(cw.carried)
                               ? work.q[model.parts[part].q0 + k] - cw.lock_value[static_cast<Eigen::Index>(lock)]
                               : 0.0;
      });
}

void update_closure_matrix(const Model& model, int cluster, Work& work, bool all, bool elastic) {
  ClusterWork& cw = work.clusters[cluster];
  const int total = closure_row_count(model, work, cluster);
  const int nv = model.clusters[cluster].nv;
  if (cw.G.rows() != total || cw.G.cols() != nv) cw.G = MatX::Zero(total, nv);
  cw.line.resize(nv);
  for_rows(
      model, work, cluster, all,
      [&](int row, const LoopJoint& loop, const ClosureRow& closure, const Relative& rel) {
        Vec3 lv, lw;
        row_direction(closure, rel, lv, lw);
        Vec6 on_a, on_b;
        row_wrench(rel, lv, lw, on_a, on_b);
        cw.line.setZero();
        project_wrench(model, work, cluster, loop.b, on_b, elastic, cw.line);
        project_wrench(model, work, cluster, loop.a, on_a, elastic, cw.line);
        cw.G.row(row) = cw.line.transpose();
      },
      [&](int row, size_t lock) {
        cw.G.row(row).setZero();
        cw.G(row, cw.locked[lock]) = 1.0;
      });
}

void update_closure_rates(const Model& model, int cluster, Work& work) {
  ClusterWork& cw = work.clusters[cluster];
  const Cluster& c = model.clusters[cluster];
  const int total = closure_row_count(model, work, cluster);
  if (cw.rate.size() != total) cw.rate = cw.bias = VecX::Zero(total);
  // Twist and acceleration at zero coordinate accelerations of a frame, also where it is fixed to what carries the cluster.
  const auto motion = [&](int frame, Vec6& V, Vec6& A) {
    const FramePoint& f = model.frames[frame];
    if (f.part != ground && model.parts[f.part].cluster == cluster) {
      update_frame_velocity(model, frame, work);
      V = work.frames[frame].V;
      A = to_child(work.frames[frame].pose, work.parts[f.part].A0) + work.frames[frame].bias;
    } else {
      V = to_child(compose(inverse(work.frames[c.base].pose), work.frames[frame].pose), cw.base_V);
      A.setZero();
    }
  };
  for_rows(
      model, work, cluster, false,
      [&](int row, const LoopJoint& loop, const ClosureRow& closure, const Relative& rel) {
        Vec6 Va, Aa, Vb, Ab;
        motion(loop.a, Va, Aa);
        motion(loop.b, Vb, Ab);
        const Vec3 wa = Va.tail<3>(), vb = rel.R * Vb.head<3>(), wb = rel.R * Vb.tail<3>();
        const Vec3 pd = vb - Va.head<3>() - wa.cross(rel.p), w = wb - wa;
        const Vec3 wad = Aa.tail<3>();
        const Vec3 pdd = rel.R * Ab.head<3>() + w.cross(vb) - Aa.head<3>() - wad.cross(rel.p) - wa.cross(pd);
        const Vec3 wd = rel.R * Ab.tail<3>() + w.cross(wb) - wad;
        Vec3 lv, lw;
        row_direction(closure, rel, lv, lw);
        cw.rate[row] = lv.dot(pd) + lw.dot(w);
        cw.bias[row] = lv.dot(pdd) + lw.dot(wd);
        if (closure.kind == ClosureRow::angle) cw.bias[row] += w.dot(Vec3(w.cross(Vec3(rel.R * closure.b))).cross(closure.u));
        if (closure.kind == ClosureRow::distance) cw.bias[row] += pd.squaredNorm() / closure.length;
      },
      [&](int row, size_t lock) {
        cw.rate[row] = work.w[c.v0 + cw.locked[lock]];
        cw.bias[row] = 0.0;
      });
}

Partition choose_partition(const Model& model, int cluster, Work& work, bool strict) {
  const Cluster& c = model.clusters[cluster];
  update_closure_matrix(model, cluster, work, true);
  const ClusterWork& cw = work.clusters[cluster];
  const int rows = static_cast<int>(cw.G.rows());

  // Everything in metres: angle rows and rotary columns scaled by the cluster's size, elastic columns by the displacement they cause.
  MatX scaled = closure_row_scales(model, work, cluster).asDiagonal() * cw.G;
  std::vector<int> joint_columns, elastic_columns, preference(c.nv, 0);
  for (int k = 0; k < c.nv; ++k) {
    const auto [part, rate] = rate_owner(model, cluster, k);
    if (rate < 0) {
      const double reach = elastic_reach(model.parts[part], c.v0 + k - model.parts[part].ev0, c.size);
      if (reach > 0.0) scaled.col(k) /= reach;
      elastic_columns.push_back(k);
    } else {
      const TreeJoint& j = model.parts[part].joint;
      scaled.col(k) /= is_length(j.kind, rate) ? 1.0 : c.size;
      joint_columns.push_back(k);
      preference[k] = depth(model, part);
    }
  }
  for (int k : cw.locked) preference[k] = std::numeric_limits<int>::max();

  // Complete pivoting of the given rows over joint columns first; what they cannot close is closed by deformation, unless that does less
  // than `least`. A joint's pivot below 1e-7 of the entries' size is rounding or a singular position, not a way to close the loop.
  const auto eliminate = [&](const std::vector<int>& from, double least) {
    Partition out;
    MatX A = scaled;
    std::vector<char> row_used(rows, 1), column_used(c.nv, 0);
    for (int r : from) row_used[r] = 0;
    for (const std::vector<int>* columns : {&joint_columns, &elastic_columns}) {
      const double floor = columns == &elastic_columns ? least : 1e-7;
      while (true) {
        double largest = 0.0;
        for (int k : *columns)
          if (!column_used[k])
            for (int r = 0; r < rows; ++r)
              if (!row_used[r] && std::abs(A(r, k)) > floor) largest = std::max(largest, std::abs(A(r, k)));
        if (largest == 0.0) break;
        // A sound pivot (a fifth of the largest at least) of the deepest joint.
        int best_row = -1, best = -1;
        for (int k : *columns) {
          if (column_used[k]) continue;
          for (int r = 0; r < rows; ++r) {
            if (row_used[r]) continue;
            const double a = std::abs(A(r, k));
            if (a <= floor || a < (strict ? 1.0 : 0.2) * largest) continue;
            if (best < 0 || preference[k] > preference[best] || (preference[k] == preference[best] && a > std::abs(A(best_row, best))))
              best_row = r, best = k;
          }
        }
        row_used[best_row] = column_used[best] = 1;
        out.rows.push_back(best_row);
        out.dep.push_back(best);
        for (int r = 0; r < rows; ++r)
          if (!row_used[r] && A(r, best) != 0.0) A.row(r) -= (A(r, best) / A(best_row, best)) * A.row(best_row);
      }
    }
    for (int k = 0; k < c.nv; ++k)
      if (!column_used[k]) out.ind.push_back(k);
    return out;
  };
  // Deformation that does less than a fiftieth is the asymmetry of a mesh: a planar loop of a body that bends in the plane leaves it a
  // little, and closing its redundant conditions by that would lock the body.
  std::vector<int> loop_rows(static_cast<size_t>(rows) - cw.locked.size());
  std::iota(loop_rows.begin(), loop_rows.end(), 0);
  Partition out = eliminate(loop_rows, 0.02);
  if (cw.locked.empty()) return out;
  // What is locked (a joint that sticks) is not redundant, and takes away a way to close the loop: the conditions that hold without locks
  // are to hold with them, by deformation however little it does. A slider that sticks beside its dead centre leaves nothing else. A lock
  // that takes away the last way to close a condition (a slider exactly in its dead centre, which holds it already) gives way to it.
  const size_t loops = out.rows.size();
  std::vector<int> needed = out.rows;
  for (int r = static_cast<int>(loop_rows.size()); r < rows; ++r) needed.push_back(r);
  const auto closes = [&](const Partition& p) {
    return static_cast<size_t>(
               std::count_if(p.rows.begin(), p.rows.end(), [&](int r) { return r < static_cast<int>(loop_rows.size()); })) == loops;
  };
  Partition all = eliminate(needed, 1e-7);
  for (size_t lock = loops; !closes(all) && lock < needed.size();) {
    // One lock at a time, each only if everything before it still holds.
    std::vector<int> with(needed.begin(), needed.begin() + static_cast<std::ptrdiff_t>(lock) + 1);
    if (closes(eliminate(with, 1e-7))) ++lock;
    else needed.erase(needed.begin() + static_cast<std::ptrdiff_t>(lock));
    all = eliminate(needed, 1e-7);
  }
  return all;
}

void close_positions(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  update_cluster_frames(model, cluster, work);
  update_cluster_chain(model, cluster, work);
  const Partition& part = cw.partition;
  const int nd = static_cast<int>(part.dep.size()), ni = static_cast<int>(part.ind.size());
  const auto update_jacobians = [&]() {
    for (int f : c.frames) update_frame_jacobian(model, f, work);
  };
  if (nd == 0) {
    update_jacobians();
    return;
  }
  // Deformations that close a loop move the frames in their bodies as well.
  const bool elastic = deformation_closes(model, work, cluster);
  cw.res.resize(nd);
  const auto residual = [&]() {
    update_closure_residual(model, cluster, work, false);
    for (int i = 0; i < nd; ++i) cw.res[i] = cw.residual[part.rows[i]];
  };
  const auto factorise = [&](bool all_columns) {
    update_closure_matrix(model, cluster, work, false, all_columns);
    cw.Gd.resize(nd, nd);
    for (int i = 0; i < nd; ++i)
      for (int k = 0; k < nd; ++k) cw.Gd(i, k) = cw.G(part.rows[i], part.dep[k]);
    cw.lu.compute(cw.Gd);
  };
  double last = std::numeric_limits<double>::infinity();
  bool fresh = false;
  for (int iteration = 0;; ++iteration) {
    residual();
    if (!fresh) {
      if (elastic) update_jacobians();
      factorise(elastic);
      fresh = true;
    }
    cw.step = cw.lu.solve(cw.res);
    ++work.closure_iterations;
    // Size of the step in metres; elastic coordinates count by the closure error they mend.
    double size = cw.res.cwiseAbs().maxCoeff();
    for (int k = 0; k < nd; ++k) size = std::max(size, std::abs(cw.step[k]) * rate_scale(model, cluster, part.dep[k]));
    // 3e-13 of the size is a few hundred roundings of the poses: closed. A step that no longer shrinks at 1e-10 is rounding too.
    // A deformation that closes the loop is a force: one rounding off is as good as it gets.
    if (size <= (elastic ? 2e-16 : 3e-13) * c.size || (size <= 1e-10 * c.size && size > 0.25 * last)) break;
    if (!std::isfinite(size) || iteration == 40 || (iteration > 4 && size > c.size)) {
      int worst = 0;
      cw.res.cwiseAbs().maxCoeff(&worst);
      const RowOwner open = closure_row_owner(model, work, cluster, part.rows[worst]);
      throw SimulationError(
          fmt::format("joint '{}' cannot be closed at t = {:.6g} s: its loop stays open by {:.3g} {}; the mechanism is at or beyond the "
                      "limit of its reach",
                      open.joint, work.time, std::abs(cw.res[worst]), open.unit));
    }
    // Move the dependent coordinates, joint by joint.
    for (int i : c.parts) {
      const Part& p = model.parts[i];
      double dw[6] = {};
      bool moved = false;
      for (int k = 0; k < nd; ++k) {
        const int v = c.v0 + part.dep[k];
        if (v >= p.v0 && v < p.v0 + p.joint.nv) dw[v - p.v0] = -cw.step[k], moved = true;
        if (v >= p.ev0 && v < p.ev0 + p.body.n) work.q[p.eq0 + v - p.ev0] -= cw.step[k];
      }
      if (moved) move_coordinates(p.joint.kind, work.q.data() + p.q0, dw);
    }
    if (elastic) update_cluster_frames(model, cluster, work);
    update_cluster_chain(model, cluster, work);
    // With the matrix of the start the error shrinks by about its own size over the mechanism's each time: what two steps have shown
    // tells whether a third is needed, and whether the matrix still serves.
    if (std::isfinite(last) ? size <= 1e-3 * last && size * size / last <= 1e-15 * c.size : size <= 1e-10 * c.size) break;
    if (size > 1e-3 * std::min(last, c.size)) fresh = false;
    last = size;
  }
  update_jacobians();
  factorise(true);
  cw.Gi.resize(nd, ni);
  for (int k = 0; k < ni; ++k)
    for (int i = 0; i < nd; ++i) cw.Gi(i, k) = -cw.G(part.rows[i], part.ind[k]);
  solve(cw.lu, cw.Gi, cw.E);
}

void require_closed(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  const int total = closure_row_count(model, work, cluster);
  if (static_cast<int>(cw.partition.rows.size()) == total) return;
  update_closure_residual(model, cluster, work, true);
  double worst = 0.0;
  int open = 0;
  const VecX scale = closure_row_scales(model, work, cluster);
  for (int row = 0; row < total - static_cast<int>(cw.locked.size()); ++row)
    if (const double e = std::abs(cw.residual[row]) * scale[row]; e > worst) worst = e, open = row;
  // A ten-thousandth of the size: far above what rounding or an assembly to 1e-9 grows to near a singular position, below what a picture
  // shows. Elastic bodies add what a slightly unsymmetric mesh lets conditions open that deformation is not asked to close
  // (choose_partition).
  double allowed = 1e-4 * c.size;
  if (worst <= allowed) return;
  for (int i : c.parts) {
    const Part& p = model.parts[i];
    for (const FlexibleNode& node : p.body.nodes) {
      const auto q = work.q.segment(p.eq0, p.body.n);
      allowed = std::max(allowed, 0.1 * ((node.phi * q).norm() + c.size * (node.psi * q).norm()));
    }
  }
  if (worst <= allowed) return;
  std::string motions;
  int driven = 0;
  bool bends = false;
  for (int i : c.parts) bends = bends || model.parts[i].body.n > 0 || model.parts[i].joint.link >= 0;
  for (int i : c.parts)
    if (model.parts[i].joint.motion >= 0) motions += fmt::format("{}'{}'", driven++ ? ", " : "", model.parts[i].joint.name);
  if (driven > 1)
    throw SimulationError(fmt::format(
        "joint '{}' opens by {:.3g} m at t = {:.6g} s: the motions of the joints {} contradict one another in its loop; remove one motion",
        closure_row_name(model, work, cluster, open), work.time, worst, motions));
  throw SimulationError(
      fmt::format("joint '{}' opens by {:.3g} m at t = {:.6g} s: closure conditions of its loop that were redundant at the start no longer "
                  "are. The mechanism starts in a change point, from which it can move in more than one way: start it away from that "
                  "position, or give initial rates for one of the ways{}",
                  closure_row_name(model, work, cluster, open), work.time, worst,
                  bends ? "; or the loop prevents a bending beam from shortening: switch its effect axial on (a lumped beam has none: take "
                          "finite elements)"
                        : ""));
}

void close_velocities(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  const Partition& part = cw.partition;
  const int nd = static_cast<int>(part.dep.size()), ni = static_cast<int>(part.ind.size());
  if (nd == 0) {
    update_cluster_velocities(model, cluster, work);
    return;
  }
  VecX& rhs = cw.res;
  rhs.resize(nd);
  cw.ind_rate.resize(ni);
  for (int k = 0; k < ni; ++k) cw.ind_rate[k] = work.w[c.v0 + part.ind[k]];
  const VecX& ind = cw.ind_rate;
  cw.step.noalias() = cw.E * ind;
  VecX& dep = cw.step;
  bool prescribed = cw.carried > 0;
  for (int i : c.parts) prescribed = prescribed || model.parts[i].joint.motion >= 0;
  cw.e0.setZero(nd);
  if (prescribed) {
    for (int k = 0; k < c.nv; ++k) work.w[c.v0 + k] = 0.0;
    update_cluster_velocities(model, cluster, work);
    update_closure_rates(model, cluster, work);
    const int loop_rows = closure_row_count(model, work, cluster) - static_cast<int>(cw.locked.size());
    for (int i = 0; i < nd; ++i) {
      const int lock = part.rows[i] - loop_rows;
      rhs[i] = (lock >= 0 && lock < cw.carried ? cw.lock_rate[lock] : 0.0) - cw.rate[part.rows[i]];
    }
    cw.e0 = cw.lu.solve(rhs);
    dep += cw.e0;
  }
  for (int k = 0; k < ni; ++k) work.w[c.v0 + part.ind[k]] = ind[k];
  for (int k = 0; k < nd; ++k) work.w[c.v0 + part.dep[k]] = dep[k];
  update_cluster_velocities(model, cluster, work);
  update_closure_rates(model, cluster, work);
  for (int i = 0; i < nd; ++i) rhs[i] = -cw.bias[part.rows[i]];
  cw.gamma = cw.lu.solve(rhs);
}

void closure_wrench(const Model& model, const Work& work, int cluster, int loop, const VecX& lambda, Vec6& on_a, Vec6& on_b) {
  const LoopJoint& joint = model.loops[loop];
  const Relative rel = relative_pose(model, work, cluster, joint);
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
  for (size_t r = 0; r < joint.rows.size(); ++r) {
    Vec3 lv, lw;
    row_direction(joint.rows[r], rel, lv, lw);
    force += lambda[r] * lv;
    moment += lambda[r] * lw;
  }
  row_wrench(rel, force, moment, on_a, on_b);
}

double partition_growth(const Model& model, int cluster, const Work& work) {
  const Cluster& c = model.clusters[cluster];
  const ClusterWork& cw = work.clusters[cluster];
  const auto elastic_scale = [&](int rate) {
    const auto [part, k] = rate_owner(model, cluster, rate);
    return k < 0 ? elastic_reach(model.parts[part], c.v0 + rate - model.parts[part].ev0, c.size) : 0.0;
  };
  double growth = 0.0;
  for (size_t d = 0; d < cw.partition.dep.size(); ++d) {
    double sd = rate_scale(model, cluster, cw.partition.dep[d]);
    // A deformation that closes the loop is measured against the others that could.
    const bool deforms = sd == 0.0;
    if (deforms) sd = elastic_scale(cw.partition.dep[d]);
    for (size_t i = 0; i < cw.partition.ind.size(); ++i) {
      const double si = deforms ? elastic_scale(cw.partition.ind[i]) : rate_scale(model, cluster, cw.partition.ind[i]);
      if (si > 0.0) growth = std::max(growth, std::abs(cw.E(d, i)) * sd / si);
    }
  }
  return growth;
}

}  // namespace flexframe::sim
