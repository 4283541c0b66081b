#include "sim/dynamics/reduced_mass.h"

#include "sim/base/four.h"
#include "sim/base/small_matrices.h"
#include "sim/base/wide.h"
#include "sim/bodies/axis_mass.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/kinematics.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace flexframe::sim {
namespace {

FLEXFRAME_INLINE double sum(const Four& s) { return (s[0] + s[1]) + (s[2] + s[3]); }

constexpr int most = 24;                          // equations
constexpr int most_parts = most / 3;              // each has three equations at least
constexpr int most_joint_rates = 3 * most_parts;  // of their joints
constexpr int most_joints = 8;                    // independent ones of these
constexpr int least_modes = 10;                   // below, the mass matrix is as cheap

// Rows of U^T over the modes of one body, and the equation that each belongs to (ascending).
struct RowsOf {
  int count = 0, modes = 0, first = 0;  // first: place of the first mode among the independent rates
  int equation[most];
  const double* values[most];
};

// Lower half of S += U^T U.
FLEXFRAME_WIDE
void add_squares(const RowsOf& rows, double (*S)[most]) {
  const int n = rows.modes;
  for (int i = 0; i < rows.count; ++i) {
    const double* const a = rows.values[i];
    double* const to = S[rows.equation[i]];
    int j = 0;
    for (; j + 2 <= i + 1; j += 2) {
      const double *const b = rows.values[j], *const c = rows.values[j + 1];
      Four s{}, t{};
      int k = 0;
      for (; k + 4 <= n; k += 4) s += four(a + k).v * four(b + k).v, t += four(a + k).v * four(c + k).v;
      double x = sum(s), y = sum(t);
      for (; k < n; ++k) x += a[k] * b[k], y += a[k] * c[k];
      to[rows.equation[j]] += x;
      to[rows.equation[j + 1]] += y;
    }
    if (j > i) continue;
    Four s{};
    int k = 0;
    for (; k + 4 <= n; k += 4) s += four(a + k).v * four(a + k).v;
    double x = sum(s);
    for (; k < n; ++k) x += a[k] * a[k];
    to[rows.equation[i]] += x;
  }
}

// g += U^T h.
FLEXFRAME_WIDE
void add_dots(const RowsOf& rows, const double* h, double* g) {
  for (int i = 0; i < rows.count; ++i) {
    const double* const a = rows.values[i];
    Four s{};
    int k = 0;
    for (; k + 4 <= rows.modes; k += 4) s += four(a + k).v * four(h + k).v;
    double x = sum(s);
    for (; k < rows.modes; ++k) x += a[k] * h[k];
    g[rows.equation[i]] += x;
  }
}

// h -= U s.
FLEXFRAME_WIDE
void subtract_rows(const RowsOf& rows, const double* s, double* h) {
  int k = 0;
  for (; k + 4 <= rows.modes; k += 4) {
    Four x = four(h + k).v;
    for (int i = 0; i < rows.count; ++i) x -= four(rows.values[i] + k).v * s[rows.equation[i]];
    four(h + k).v = x;
  }
  for (; k < rows.modes; ++k)
    for (int i = 0; i < rows.count; ++i) h[k] -= rows.values[i][k] * s[rows.equation[i]];
}

// y += a x.
FLEXFRAME_WIDE
void add_multiple(const double* x, double a, int n, double* y) {
  int k = 0;
  for (; k + 4 <= n; k += 4) four(y + k).v += four(x + k).v * a;
  for (; k < n; ++k) y[k] += x[k] * a;
}

// n twists seen from the pose, three rows each: out = or += to_child(a, in).
FLEXFRAME_WIDE
void turn_rows(const PlanePose& a, const double* in, int n, bool add, double* out) {
  const double c = a.c, s = a.s, px = a.p.x(), py = a.p.y();
  const double *const vx = in, *const vy = in + n, *const vw = in + 2 * static_cast<std::ptrdiff_t>(n);
  double *const x = out, *const y = out + n, *const w = out + 2 * static_cast<std::ptrdiff_t>(n);
  for (int k = 0; k < n; ++k) {
    const double u = vx[k] - vw[k] * py, v = vy[k] + vw[k] * px;
    const double to_x = c * u + s * v, to_y = c * v - s * u;
    x[k] = add ? x[k] + to_x : to_x;
    y[k] = add ? y[k] + to_y : to_y;
    w[k] = add ? w[k] + vw[k] : vw[k];
  }
}

// S = L diag(d) L^T in place, without pivoting: S is negative definite in the bodies' momenta and positive in the rest, which factorises in
// any order. Of the pivots the inverses are kept, zeros in their places. False where one has another sign.
bool factorise(double (*S)[most], double* inverse, const bool* negative, int r) {
  double scaled[most];
  for (int k = 0; k < r; ++k) {
    double pivot = S[k][k];
    for (int j = 0; j < k; ++j) {
      scaled[j] = S[k][j];
      S[k][j] = scaled[j] * inverse[j];
      pivot -= scaled[j] * S[k][j];
    }
    if (!(negative[k] ? pivot < 0.0 : pivot > 0.0)) return false;
    inverse[k] = 1.0 / pivot;
    S[k][k] = 0.0;
    for (int i = k + 1; i < r; ++i) {
      double x = S[i][k];
      for (int j = 0; j < k; ++j) x -= S[i][j] * S[k][j];
      S[i][k] = x;
    }
  }
  return true;
}
// Above the diagonal S is zero as far as fours reach.
FLEXFRAME_WIDE
void solve_factor(const double (*S)[most], const double* inverse, int r, double* x) {
  for (int i = 1; i < r; ++i)
    for (int j = 0; j < i; ++j) x[i] -= S[i][j] * x[j];
  for (int i = 0; i < r; ++i) x[i] *= inverse[i];
  for (int i = r; i-- > 1;) {
    const double a = x[i];
    for (int j = 0; j < i; j += 4) four(x + j).v -= four(S[i] + j).v * a;
  }
}

// I = R R^T; what is left of a diagonal by rounding counts as nothing.
Mat3 root_of(const Mat3& I) {
  Mat3 R = Mat3::Zero();
  for (int k = 0; k < 3; ++k) {
    const double left = I(k, k) - R.row(k).head(k).squaredNorm();
    if (!(left > 1e-14 * I(k, k))) continue;
    R(k, k) = std::sqrt(left);
    for (int i = k + 1; i < 3; ++i) R(i, k) = (I(i, k) - R.row(i).head(k).dot(R.row(k).head(k))) / R(k, k);
  }
  return R;
}

// Of a part: what its frame does per rate.
struct Reach {
  std::array<Vec3, most_joint_rates> joints;     // its twist per rate of the cluster's joints
  std::array<char, most_parts> moved_by;         // per part of the cluster
  std::array<const double*, most_parts> raw, U;  // per part: its twist per mode of that, three rows; with the dependent rates. Null: none
  bool follows = false;                          // a dependent rate moves it
  bool rigid = false, weightless = false, idle = false;  // idle: nothing acts on it nor hangs on it
  int first = -1;                                        // of its equations
  Mat3 root = Mat3::Zero();
  Vec3 carried = Vec3::Zero(), force = Vec3::Zero();
};
// The independent rates of joints: rows of U, S^-1 of these, and the factor of their inertia while the modes are free.
struct Joints {
  int count = 0;
  int place[most_joints];  // among the independent rates
  double U[most_joints][most], solved[most_joints][most], L[most_joints][most_joints], whole[most_joints];
};
struct Scratch {
  std::vector<Reach> reach;
  std::vector<RowsOf> rows;     // per part
  std::vector<int> joint_of;    // per part the first of its rates among those of joints
  std::vector<int> first_mode;  // and of its modes among the independent rates
  std::vector<int> dep;         // of the dependent rates the same
  std::vector<std::vector<double>> room;
  size_t taken = 0;
  double S[most][most], inverse[most];
  bool negative[most];
  Joints joints;
  double* take(int count) {
    if (room.size() == taken) room.emplace_back();
    std::vector<double>& block = room[taken++];
    if (block.size() < static_cast<size_t>(count)) block.resize(static_cast<size_t>(count));
    return block.data();
  }
};

struct Solver {
  const Model& model;
  const Cluster& c;
  ClusterWork& cw;
  PlaneWork& work;
  Scratch& s;
  int cluster;
  int equations = 0, joint_rates = 0;

  const Part& part(size_t at) const { return model.parts[c.parts[at]]; }
  PartMotion<Plane>& motion(size_t at) const { return work.parts[c.parts[at]]; }
  size_t place(int of) const { return static_cast<size_t>(std::find(c.parts.begin(), c.parts.end(), of) - c.parts.begin()); }
  // Of its modes, among the independent rates.
  int first_independent(size_t at) const { return s.first_mode[at]; }

  void list_joints() {
    s.joint_of.clear();
    s.first_mode.clear();
    joint_rates = 0;
    const std::vector<int>& ind = cw.partition.ind;
    for (size_t at = 0; at < c.parts.size(); ++at) {
      s.joint_of.push_back(joint_rates), joint_rates += part(at).joint.nv;
      s.first_mode.push_back(static_cast<int>(std::lower_bound(ind.begin(), ind.end(), part(at).ev0 - c.v0) - ind.begin()));
    }
    s.dep.clear();
    for (const int rate : cw.partition.dep)
      for (size_t at = 0; at < c.parts.size(); ++at)
        if (const int k = c.v0 + rate - part(at).v0; k >= 0 && k < part(at).joint.nv) s.dep.push_back(s.joint_of[at] + k);
  }

  void reach(size_t at) {
    Reach& r = s.reach[at];
    const PartMotion<Plane>& p = motion(at);
    const size_t np = c.parts.size();
    std::fill_n(r.joints.begin(), joint_rates, Vec3::Zero());
    std::fill_n(r.moved_by.begin(), np, 0);
    std::fill_n(r.raw.begin(), np, nullptr);
    std::fill_n(r.U.begin(), np, nullptr);
    r.moved_by[at] = 1;
    r.idle = is_idle(at);
    const bool inside = hangs_inside(model, c.parts[at]);
    if (inside) {
      const size_t up = place(part(at).parent);
      const auto& in = work.frames[part(at).joint.inboard];
      const PlanePose& step = p.in_carrier;
      for (size_t a = 0; a < at; ++a) {
        if (!s.reach[up].moved_by[a]) continue;
        r.moved_by[a] = 1;
        for (int k = s.joint_of[a]; k < s.joint_of[a] + part(a).joint.nv; ++k)
          r.joints[static_cast<size_t>(k)] = to_child(step, s.reach[up].joints[static_cast<size_t>(k)]);
        const int n = part(a).body.n;
        const bool bends = a == up && in.flexible;
        if (n == 0 || r.idle || (!s.reach[up].raw[a] && !bends)) continue;
        double* const out = s.take(3 * n);
        if (s.reach[up].raw[a]) turn_rows(step, s.reach[up].raw[a], n, false, out);
        if (bends) turn_rows(p.step, in.B.data(), n, s.reach[up].raw[a] != nullptr, out);
        r.raw[a] = out;
      }
      if (c.parent != ground) r.carried = to_child(step, s.reach[up].carried);
    } else if (c.parent != ground) {
      r.carried = to_child(p.in_base, work.bases[cluster].A);
    }
    for (int k = 0; k < part(at).joint.nv; ++k) r.joints[static_cast<size_t>(s.joint_of[at]) + k] = column(p.Hj, k);
    if (part(at).body.n > 0 && work.frames[part(at).joint.outboard].flexible) r.raw[at] = p.C.data();
    r.follows = false;
    for (const int d : s.dep) r.follows = r.follows || !r.joints[static_cast<size_t>(d)].isZero(0.0);
  }

  bool is_idle(size_t at) const {
    const PartMotion<Plane>& p = motion(at);
    if (part(at).body.n > 0 || !p.Mrr.isZero(0.0) || !p.fr.isZero(0.0)) return false;
    return std::none_of(c.parts.begin(), c.parts.end(), [&](int other) { return model.parts[other].parent == c.parts[at]; });
  }

  // Its equations, and the force on it while no independent rate accelerates.
  void take_equations(size_t at) {
    Reach& r = s.reach[at];
    const PartMotion<Plane>& p = motion(at);
    r.rigid = part(at).body.n == 0;
    r.weightless = r.rigid && p.Mrr.isZero(0.0);
    r.first = r.weightless ? -1 : equations;
    if (!r.weightless) equations += r.rigid ? 3 : 6;
    r.force = p.fr;
    Vec3 A = Vec3::Zero();
    if (c.parent != ground) A = r.carried;
    for (size_t d = 0; d < s.dep.size(); ++d) A += r.joints[static_cast<size_t>(s.dep[d])] * cw.gamma[static_cast<Eigen::Index>(d)];
    const bool moves = c.parent != ground || r.follows;
    if (moves) r.force += p.Mrr * A;
    if (r.rigid) {
      if (!r.weightless) r.root = root_of(p.Mrr);
      return;
    }
    double* const h = cw.a.data() + first_independent(at);
    for (int k = 0; k < part(at).body.n; ++k) h[k] = -p.fe[k];
    if (moves) subtract_dots(p.Mre, A, h);
    for (size_t d = 0; d < s.dep.size(); ++d)
      add_multiple(&cw.Et(first_independent(at), static_cast<Eigen::Index>(d)), joint_force(s.dep[d]), part(at).body.n, h);
  }

  double joint_force(int rate) const {
    size_t at = 0;
    while (rate >= s.joint_of[at] + part(at).joint.nv) ++at;
    return motion(at).tau[rate - s.joint_of[at]];
  }

  // Twist of a part per mode of another, with what the dependent rates add. Takes its force from the modes' equations.
  void combine_modes(size_t at, size_t a) {
    Reach& r = s.reach[at];
    const int n = part(a).body.n, first = first_independent(a);
    if (n == 0 || r.idle || (!r.raw[a] && !r.follows)) return;
    const double* U = r.raw[a];
    const bool copies = r.follows || (r.rigid && !r.weightless);
    if (copies) {
      double* const out = s.take(3 * n);
      if (U) std::copy_n(U, 3 * n, out);
      else std::fill_n(out, 3 * n, 0.0);
      for (size_t d = 0; d < s.dep.size(); ++d)
        for (int row = 0; row < 3; ++row)
          if (const double x = r.joints[static_cast<size_t>(s.dep[d])][row]; x != 0.0)
            add_multiple(&cw.Et(first, static_cast<Eigen::Index>(d)), x, n, out + Eigen::Index{row} * n);
      U = out;
    }
    for (int row = 0; row < 3; ++row)
      if (r.force[row] != 0.0) add_multiple(U + Eigen::Index{row} * n, -r.force[row], n, cw.a.data() + first);
    if (r.weightless) return;
    r.U[a] = U;
    if (!r.rigid) return;
    double* const out = const_cast<double*>(U);
    for (int k = 0; k < n; ++k) {
      const Vec3 t = r.root.transpose() * Vec3(out[k], out[n + k], out[2 * n + k]);
      out[k] = t.x(), out[n + k] = t.y(), out[2 * n + k] = t.z();
    }
  }

  void list_rows(size_t a) {
    RowsOf& out = s.rows[a];
    const int n = out.modes = part(a).body.n;
    out.count = 0;
    out.first = n > 0 ? first_independent(a) : 0;
    if (n == 0) return;
    for (size_t at = 0; at < c.parts.size(); ++at) {
      const Reach& r = s.reach[at];
      if (r.first < 0) continue;
      if (at == a)
        for (int row = 0; row < 3; ++row) out.equation[out.count] = r.first + row, out.values[out.count++] = &motion(a).Mre(0, row);
      if (!r.U[a]) continue;
      for (int row = 0; row < 3; ++row) {
        out.equation[out.count] = r.first + row + (r.rigid ? 0 : 3);
        out.values[out.count++] = r.U[a] + static_cast<std::ptrdiff_t>(row) * n;
      }
    }
  }

  // The bodies' own part of the equations: momenta first, then twists.
  void start_equations() {
    for (int i = 0; i < equations; ++i) std::fill_n(s.S[i], (i + 4) & ~3, 0.0), s.negative[i] = false;
    for (size_t at = 0; at < c.parts.size(); ++at) {
      const Reach& r = s.reach[at];
      if (r.first < 0) continue;
      for (int i = 0; i < 3; ++i) {
        if (r.rigid) {
          s.S[r.first + i][r.first + i] = 1.0;
          continue;
        }
        for (int j = 0; j <= i; ++j) s.S[r.first + i][r.first + j] = -motion(at).Mrr(i, j);
        s.S[r.first + 3 + i][r.first + i] = 1.0;
        s.negative[r.first + i] = true;
      }
    }
  }

  // Of one independent rate of a joint: its row of U, and the force on it.
  void take_joint(size_t at, int k, Eigen::Index index) {
    Joints& all = s.joints;
    const size_t rate = static_cast<size_t>(s.joint_of[at]) + k;
    double h = joint_force(static_cast<int>(rate)), inertia = 0.0;
    for (size_t d = 0; d < s.dep.size(); ++d) h += cw.Et(index, static_cast<Eigen::Index>(d)) * joint_force(s.dep[d]);
    double* const u = all.U[all.count];
    std::fill_n(u, equations, 0.0);
    for (size_t b = 0; b < c.parts.size(); ++b) {
      const Reach& r = s.reach[b];
      if (r.idle) continue;
      Vec3 t = r.joints[rate];
      if (r.follows)
        for (size_t d = 0; d < s.dep.size(); ++d) t += r.joints[static_cast<size_t>(s.dep[d])] * cw.Et(index, static_cast<Eigen::Index>(d));
      h -= t.dot(r.force);
      if (r.first < 0) continue;
      inertia += t.dot(motion(b).Mrr * t);
      if (r.rigid) t = r.root.transpose() * t;
      std::copy_n(t.data(), 3, u + r.first + (r.rigid ? 0 : 3));
    }
    std::copy_n(u, equations, all.solved[all.count]);
    solve_factor(s.S, s.inverse, equations, all.solved[all.count]);
    cw.a[index] = h;
    all.whole[all.count] = inertia;
    all.place[all.count++] = static_cast<int>(index);
  }

  // False where one has no inertia.
  bool factorise_joints() {
    Joints& all = s.joints;
    all.count = 0;
    Eigen::Index index = 0;
    for (size_t at = 0; at < c.parts.size(); ++at)
      for (int k = 0; k < part(at).joint.nv; ++k) {
        const int rate = part(at).v0 - c.v0 + k;
        while (index < cw.a.size() && cw.partition.ind[static_cast<size_t>(index)] < rate) ++index;
        if (index < cw.a.size() && cw.partition.ind[static_cast<size_t>(index)] == rate) take_joint(at, k, index);
      }
    for (int i = 0; i < all.count; ++i)
      for (int j = 0; j <= i; ++j) {
        double v = 0.0;
        for (int e = 0; e < equations; ++e) v += all.U[i][e] * all.solved[j][e];
        for (int k = 0; k < j; ++k) v -= all.L[i][k] * all.L[j][k];
        if (i == j && !(v > 1e-14 * all.whole[i])) return false;
        all.L[i][j] = i == j ? std::sqrt(v) : v / all.L[j][j];
      }
    return true;
  }

  // S g = g + U_j^T v and U_j g = v: from right-hand sides to the frames' unknowns g and the joints' accelerations v.
  void solve_equations(double* g, double* v) const {
    const Joints& all = s.joints;
    solve_factor(s.S, s.inverse, equations, g);
    for (int i = 0; i < all.count; ++i) {
      for (int e = 0; e < equations; ++e) v[i] -= all.U[i][e] * g[e];
      for (int k = 0; k < i; ++k) v[i] -= all.L[i][k] * v[k];
      v[i] /= all.L[i][i];
    }
    for (int i = all.count; i-- > 0;) {
      for (int k = i + 1; k < all.count; ++k) v[i] -= all.L[k][i] * v[k];
      v[i] /= all.L[i][i];
      for (int e = 0; e < equations; ++e) g[e] += all.solved[i][e] * v[i];
    }
  }

  // What the unknowns g and v leave of the equations, the modes' accelerations being x; of the joints' forces h.
  void residual(const double* x, const double* g, const double* v, const double* h, double* left, double* of_joints) const {
    const Joints& all = s.joints;
    std::fill_n(left, most, 0.0);
    for (size_t a = 0; a < c.parts.size(); ++a) add_dots(s.rows[a], x + s.rows[a].first, left);
    for (int i = 0; i < all.count; ++i) {
      of_joints[i] = h[i];
      for (int e = 0; e < equations; ++e) left[e] += all.U[i][e] * v[i], of_joints[i] -= all.U[i][e] * g[e];
    }
    for (size_t at = 0; at < c.parts.size(); ++at) {
      const Reach& r = s.reach[at];
      if (r.first < 0) continue;
      using Three = Eigen::Map<const Vec3>;
      Eigen::Map<Vec3> first(left + r.first);
      first -= r.rigid ? Vec3(Three(g + r.first)) : Vec3(Three(g + r.first + 3) - motion(at).Mrr * Three(g + r.first));
      if (!r.rigid) Eigen::Map<Vec3>(left + r.first + 3) -= Three(g + r.first);
    }
  }

  // x = D^-1 x of the independent rates. What the frames' motions cancel of the modes' forces would leave its rounding: the equations are
  // solved once more for what is left of them.
  void solve_for(double* x) const {
    const Joints& all = s.joints;
    double g[most] = {}, left[most], v[most_joints], h[most_joints], more[most_joints];
    for (size_t a = 0; a < c.parts.size(); ++a) add_dots(s.rows[a], x + s.rows[a].first, g);
    for (int i = 0; i < all.count; ++i) v[i] = h[i] = x[all.place[i]];
    solve_equations(g, v);
    for (size_t a = 0; a < c.parts.size(); ++a) subtract_rows(s.rows[a], g, x + s.rows[a].first);
    residual(x, g, v, h, left, more);
    solve_equations(left, more);
    for (size_t a = 0; a < c.parts.size(); ++a) subtract_rows(s.rows[a], left, x + s.rows[a].first);
    for (int i = 0; i < all.count; ++i) x[all.place[i]] = v[i] + more[i];
  }

  // The independent accelerations that the forces on the rates make, in cw.a.
  bool run() {
    if (!make_equations()) return false;
    solve_for(cw.a.data());
    const std::vector<int>&ind = cw.partition.ind, &dep = cw.partition.dep;
    double* const wdot = work.wdot.data() + c.v0;
    if (dep.empty()) std::copy_n(cw.a.data(), cw.a.size(), wdot);
    else
      for (size_t k = 0; k < ind.size(); ++k) wdot[ind[k]] = cw.a[static_cast<Eigen::Index>(k)];
    for (size_t d = 0; d < dep.size(); ++d) {
      const Eigen::Index at = static_cast<Eigen::Index>(d);
      work.wdot[c.v0 + dep[d]] = cw.gamma[at] + cw.Et.col(at).dot(cw.a);
    }
    return true;
  }

  // For other forces.
  bool run(MatX& X) {
    if (!make_equations()) return false;
    for (Eigen::Index k = 0; k < X.cols(); ++k) solve_for(X.data() + k * X.rows());
    return true;
  }

  // Factorised, the forces on the rates in cw.a.
  bool make_equations() {
    const std::vector<int>&ind = cw.partition.ind, &dep = cw.partition.dep;
    const Eigen::Index ni = static_cast<Eigen::Index>(ind.size()), nd = static_cast<Eigen::Index>(dep.size());
    const size_t np = c.parts.size();
    cw.a.resize(ni);
    cw.Et.resize(ni, nd);
    for (Eigen::Index d = 0; d < nd; ++d)
      for (Eigen::Index k = 0; k < ni; ++k) cw.Et(k, d) = cw.E(d, k);
    if (s.reach.size() < np) s.reach.resize(np), s.rows.resize(np);
    s.taken = 0;
    list_joints();
    for (size_t at = 0; at < np; ++at) reach(at);
    for (size_t at = 0; at < np; ++at) take_equations(at);
    for (size_t at = 0; at < np; ++at)
      for (size_t a = 0; a < np; ++a) combine_modes(at, a);
    start_equations();
    for (size_t a = 0; a < np; ++a) {
      list_rows(a);
      add_squares(s.rows[a], s.S);
    }
    cw.L.resize(0, 0);
    return factorise(s.S, s.inverse, s.negative, equations) && factorise_joints();
  }
};

}  // namespace

bool prefers_reduced(const Model& model, int cluster, const PlaneWork& work) {
  const Cluster& c = model.clusters[cluster];
  const ClusterWork& cw = work.clusters[cluster];
  int equations = 0, modes = 0;
  for (int i : c.parts) modes += model.parts[i].body.n;
  if (modes < least_modes || !cw.locked.empty()) return false;
  for (int i : c.parts) {
    const FlexibleBody& body = model.parts[i].body;
    if (body.n > 0 && (body.stiffness.size() == 0 || has_axis_mass(body) || body.rod)) return false;
    equations += body.n > 0 ? 6 : 3;
  }
  const int joints = static_cast<int>(cw.partition.ind.size()) - modes;
  if (equations > most || joints < 0 || joints > most_joints || 3 * equations > 2 * modes + 12) return false;
  for (const Cluster& other : model.clusters)
    if (other.parent != ground && model.parts[other.parent].cluster == cluster && model.parts[other.parent].body.n > 0) return false;
  return !cw.plan.deforms;
}

namespace {

// Room of a thread: what it holds is made anew by everyone who takes it.
Scratch& scratch_of_thread() {
  static thread_local Scratch scratch;
  return scratch;
}

}  // namespace

bool solve_reduced(const Model& model, int cluster, PlaneWork& work) {
  return Solver{model, model.clusters[cluster], work.clusters[cluster], work, scratch_of_thread(), cluster}.run();
}

void solve_mass(const Model&, int cluster, Work& work, MatX& X) {
  for (Eigen::Index k = 0; k < X.cols(); ++k) solve(work.clusters[cluster].L, X.data() + k * X.rows());
}

void solve_mass(const Model& model, int cluster, PlaneWork& work, MatX& X) {
  ClusterWork& cw = work.clusters[cluster];
  if (cw.L.rows() != X.rows()) {
    // Which has been possible for the accelerations.
    Solver{model, model.clusters[cluster], cw, work, scratch_of_thread(), cluster}.run(X);
    return;
  }
  for (Eigen::Index k = 0; k < X.cols(); ++k) solve(cw.L, X.data() + k * X.rows());
}

template <class W>
void complete_mass_matrices(const Model& model, W& work) {
  const bool complete = std::all_of(work.clusters.begin(), work.clusters.end(), [](const ClusterWork& cw) {
    return cw.partition.ind.empty() || cw.L.rows() == static_cast<Eigen::Index>(cw.partition.ind.size());
  });
  if (!complete) update_accelerations(model, work);
}

#define FLEXFRAME_FOR(W) template void complete_mass_matrices(const Model&, W&);
FLEXFRAME_FOR(Work)
FLEXFRAME_FOR(PlaneWork)
#undef FLEXFRAME_FOR

}  // namespace flexframe::sim
