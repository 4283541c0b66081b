#include "sim/dynamics/few_rates.h"

#include "sim/base/eigen_solvers.h"
#include "sim/base/four.h"
#include "sim/base/padded_factor.h"
#include "sim/base/sized.h"
#include "sim/dynamics/closure.h"

#include <algorithm>

namespace flexframe::sim {
namespace {

constexpr int most_rates = 8, most_dependent = 24;

// Twists or momenta of up to 4 Fours rates: component by component.
template <class S, int Fours>
struct PerRate {
  static constexpr int components = S::linear + S::angular;
  Four of[components][Fours];
  double* row(int component) { return reinterpret_cast<double*>(of[component]); }
};

// Twists seen from the pose, as to_child does it.
template <int Fours>
FLEXFRAME_INLINE void set_to_child(const PlanePose& a, const PerRate<Plane, Fours>& V, PerRate<Plane, Fours>& out) {
  for (int f = 0; f < Fours; ++f) {
    const Four w = V.of[2][f], u = V.of[0][f] - w * a.p.y(), v = V.of[1][f] + w * a.p.x();
    out.of[0][f] = a.c * u + a.s * v;
    out.of[1][f] = a.c * v - a.s * u;
    out.of[2][f] = w;
  }
}
template <int Fours>
FLEXFRAME_INLINE void set_to_child(const Pose& a, const PerRate<Space, Fours>& V, PerRate<Space, Fours>& out) {
  for (int f = 0; f < Fours; ++f) {
    const Four x = V.of[3][f], y = V.of[4][f], z = V.of[5][f];
    const Four u = V.of[0][f] + (y * a.p.z() - z * a.p.y());
    const Four v = V.of[1][f] + (z * a.p.x() - x * a.p.z());
    const Four w = V.of[2][f] + (x * a.p.y() - y * a.p.x());
    for (int r = 0; r < 3; ++r) {
      out.of[r][f] = a.R(0, r) * u + a.R(1, r) * v + a.R(2, r) * w;
      out.of[3 + r][f] = a.R(0, r) * x + a.R(1, r) * y + a.R(2, r) * z;
    }
  }
}

// A part of the cluster: its twists per rate and, at zero independent accelerations, what dependent rates and the base make of its
// acceleration.
template <class S, int Fours>
struct Moved {
  PerRate<S, Fours> twists;
  typename S::Twist made;
  typename S::Twist driven;  // its twist while all independent rates rest and prescribed motions go on
  // How it adds to the matrix: not at all; as a rigid part that moves by independent rates of its own joint on ground alone (add_alone); as
  // one on ground that carries nothing and moves by one dependent rate (add_follower: pistons, sliders); as parts do (add_part).
  enum class By : char { rests, alone, follower, twists };
  By by = By::twists;
};

template <class W, int Fours>
struct FewRates {
  using S = typename W::In;
  using Twist = typename S::Twist;
  static constexpr int padded = 4 * Fours, components = PerRate<S, Fours>::components;

  const Model& model;
  const Cluster& c;
  ClusterWork& cw;
  W& work;
  int cluster, rates;
  double D[padded * padded + 4], h[padded + 4];
  // Per dependent rate its row of E.
  Four dependent[most_dependent][Fours];
  const int* place;   // PartitionPlan::place, up to date since the loops were closed
  bool thin = false;  // a rate may have no inertia but that of rounding
  // Of the power that prescribed motions feed in: what does not depend on the independent accelerations, and the factors of those.
  bool driven;
  double power = 0.0;
  Four per_rate[Fours] = {};

  FewRates(const Model& of_model, int of_cluster, int independent, W& at)
      : model(of_model),
        c(of_model.clusters[of_cluster]),
        cw(at.clusters[of_cluster]),
        work(at),
        cluster(of_cluster),
        rates(independent),
        place(cw.plan.place.data()),
        driven(at.carrying.driven) {}

  // Calls with(number of rates), a constant.
  template <class With>
  FLEXFRAME_INLINE void by_rates(const With& with) const {
    constexpr int before = 4 * (Fours - 1);
    switch (rates - before) {
      case 1:
        return with(std::integral_constant<int, before + 1>());
      case 2:
        return with(std::integral_constant<int, before + 2>());
      case 3:
        return with(std::integral_constant<int, before + 3>());
      default:
        return with(std::integral_constant<int, before + 4>());
    }
  }

  FLEXFRAME_INLINE void list_rates() {
    const Eigen::Index nd = static_cast<Eigen::Index>(cw.partition.dep.size());
    by_rates([&](auto n) __attribute__((always_inline)) {
      for (Eigen::Index d = 0; d < nd; ++d) {
        for (int f = 0; f < Fours; ++f) dependent[d][f] = Four{};
        double* const row = reinterpret_cast<double*>(dependent[d]);
        const double* e = cw.E.data() + d;
        for (int k = 0; k < n(); ++k, e += nd) row[k] = *e;
      }
    });
  }

  // Twists of part i; of what carries it they come first.
  FLEXFRAME_INLINE void move(int i, std::vector<Moved<S, Fours>>& moved) {
    const Part& part = model.parts[i];
    const auto& p = work.parts[i];
    Moved<S, Fours>& out = moved[i];
    if (work.carrying.inside[i]) {
      const Moved<S, Fours>& carrier = moved[part.parent];
      set_to_child(p.in_carrier, carrier.twists, out.twists);
      out.made = to_child(p.in_carrier, carrier.made);
      const auto& in = work.frames[part.joint.inboard];
      if (in.flexible) {
        PerRate<S, Fours> of_frame{}, seen;
        place_block(in.B, model.parts[part.parent], of_frame);
        set_to_child(p.step, of_frame, seen);
        for (int r = 0; r < components; ++r)
          for (int f = 0; f < Fours; ++f) out.twists.of[r][f] += seen.of[r][f];
      }
    } else {
      out.twists = {};
      if (c.parent == ground) out.made.setZero();
      else out.made = to_child(p.in_base, work.bases[cluster].A);
    }
    for (int k = 0; k < part.joint.nv; ++k) {
      const auto twist = column(p.Hj, k);
      const int at = place[part.v0 - c.v0 + k];
      if (at >= 0) {
        for (int r = 0; r < components; ++r) out.twists.row(r)[at] += twist[r];
        continue;
      }
      for (int r = 0; r < components; ++r)
        for (int f = 0; f < Fours; ++f) out.twists.of[r][f] += dependent[-1 - at][f] * twist[r];
      out.made += twist * cw.gamma[-1 - at];
    }
    if (part.body.n > 0 && work.frames[part.joint.outboard].flexible) place_block(p.C, part, out.twists);
    if (driven) drive(i, moved);
  }

  FLEXFRAME_INLINE void drive(int i, std::vector<Moved<S, Fours>>& moved) {
    const Part& part = model.parts[i];
    const auto& p = work.parts[i];
    Twist& V = moved[i].driven;
    if (work.carrying.inside[i]) V = to_child(p.in_carrier, moved[part.parent].driven);
    else if (c.parent == ground) V.setZero();
    else V = to_child(p.in_carrier, work.parts[c.parent].V);  // which no coordinate moves, else this cluster would weigh on it
    if (part.joint.motion >= 0) V += p.driven * work.motion[part.joint.motion].rate;
    for (int k = 0; k < part.joint.nv; ++k)
      if (const int d = -1 - place[part.v0 - c.v0 + k]; d >= 0) {
        V += column(p.Hj, k) * cw.e0[d];
        power -= p.tau[k] * cw.e0[d];
      }
  }

  // The wrench on a part works on its twist by prescribed motions; force: that at zero independent accelerations.
  FLEXFRAME_INLINE void feed(const Twist& V, const Twist& force, const PerRate<S, Fours>& momenta) {
    power += V.dot(force);
    for (int f = 0; f < Fours; ++f)
      for (int r = 0; r < components; ++r) per_rate[f] += momenta.of[r][f] * V[r];
  }

  // Adds one column a coordinate of the part's body.
  FLEXFRAME_INLINE void place_block(const typename S::Columns& A, const Part& part, PerRate<S, Fours>& out) {
    const int first = place[part.ev0 - c.v0];
    by_count(
        part.body.n, [&](auto count) __attribute__((always_inline)) {
          const int n = count() > 0 ? count() : part.body.n;
          for (int r = 0; r < components; ++r) {
            double* const row = out.row(r) + first;
            for (int k = 0; k < n; ++k) row[k] += column(A, k)[r];
          }
        });
  }

  bool stands_alone(int i) const {
    const Part& part = model.parts[i];
    if (part.parent != ground || part.body.n > 0 || part.joint.motion >= 0) return false;
    for (int k = 0; k < part.joint.nv; ++k)
      if (place[part.v0 - c.v0 + k] < 0) return false;
    return true;
  }
  // add_part of such a one: no other rate has a twist of it.
  FLEXFRAME_INLINE void add_alone(int i) {
    const Part& part = model.parts[i];
    const auto& p = work.parts[i];
    const int* const on = place + (part.v0 - c.v0);
    for (int k = 0; k < part.joint.nv; ++k) {
      const Twist twist = column(p.Hj, k), momentum = p.Mrr.lazyProduct(twist);
      h[on[k]] += p.tau[k] - twist.dot(p.fr);
      for (int l = k; l < part.joint.nv; ++l) D[std::min(on[k], on[l]) * padded + std::max(on[k], on[l])] += momentum.dot(column(p.Hj, l));
    }
  }

  void mark_parts(std::vector<Moved<S, Fours>>& moved) const {
    using By = typename Moved<S, Fours>::By;
    for (int i : c.parts) {
      const Part& part = model.parts[i];
      const bool inside = hangs_inside(model, i);
      if (inside && moved[part.parent].by == By::follower) moved[part.parent].by = By::twists;
      const bool follows =
          part.parent == ground && part.joint.nv == 1 && part.body.n == 0 && part.joint.motion < 0 && place[part.v0 - c.v0] < 0;
      moved[i].by = !work.carrying.moves[i] ? By::rests : stands_alone(i) ? By::alone : follows ? By::follower : By::twists;
    }
  }
  // move, add_part and feed of such a one: its inertia and its force along that rate are numbers.
  FLEXFRAME_INLINE void add_follower(int i) {
    const auto& p = work.parts[i];
    const int d = -1 - place[model.parts[i].v0 - c.v0];
    const Twist twist = column(p.Hj, 0), momentum = p.Mrr.lazyProduct(twist);
    const double inertia = momentum.dot(twist), force = twist.dot(p.fr) + inertia * cw.gamma[d] - p.tau[0];
    const Four* const e = dependent[d];
    for (int f = 0; f < Fours; ++f) four(h + 4 * f).v -= e[f] * force;
    by_rates([&](auto n) __attribute__((always_inline)) {
      for (int j = 0; j < n(); ++j) {
        const double factor = inertia * reinterpret_cast<const double*>(e)[j];
        for (int f = j / 4; f < Fours; ++f) four(D + j * padded + 4 * f).v += e[f] * factor;
      }
    });
    if (!driven) return;
    power += cw.e0[d] * force;
    for (int f = 0; f < Fours; ++f) per_rate[f] += e[f] * (inertia * cw.e0[d]);
  }

  // T^T M T and -T^T f of a part.
  FLEXFRAME_INLINE void add_part(int i, const Moved<S, Fours>& at) {
    const Part& part = model.parts[i];
    const auto& p = work.parts[i];
    const PerRate<S, Fours>& T = at.twists;
    const Twist force = p.fr + p.Mrr.lazyProduct(at.made);
    PerRate<S, Fours> momenta;
    for (int f = 0; f < Fours; ++f) {
      Four on_rates = four(h + 4 * f).v;
      for (int r = 0; r < components; ++r) {
        Four sum = T.of[0][f] * p.Mrr(r, 0);
        for (int s = 1; s < components; ++s) sum += T.of[s][f] * p.Mrr(r, s);
        momenta.of[r][f] = sum;
        on_rates -= T.of[r][f] * force[r];
      }
      four(h + 4 * f).v = on_rates;
    }
    if (part.body.n > 0)
      by_count(
          part.body.n, [&](auto count) __attribute__((always_inline)) { add_elastic<count()>(i, at, momenta); });
    if (driven) feed(at.driven, force, momenta);
    by_rates([&](auto n) __attribute__((always_inline)) {
      for (int j = 0; j < n(); ++j)
        for (int f = j / 4; f < Fours; ++f) {
          Four sum = four(D + j * padded + 4 * f).v;
          for (int r = 0; r < components; ++r) sum += momenta.of[r][f] * (reinterpret_cast<const double*>(T.of[r])[j]);
          four(D + j * padded + 4 * f).v = sum;
        }
    });
    for (int k = 0; k < part.joint.nv; ++k) {
      const int on = place[part.v0 - c.v0 + k];
      if (on >= 0) h[on] += p.tau[k];
      else
        for (int f = 0; f < Fours; ++f) four(h + 4 * f).v += dependent[-1 - on][f] * p.tau[k];
    }
  }

  // What its own coordinates add: to the matrix in their columns, to the momenta, and the forces on them.
  template <int N>
  FLEXFRAME_INLINE void add_elastic(int i, const Moved<S, Fours>& at, PerRate<S, Fours>& momenta) {
    const Part& part = model.parts[i];
    const auto& p = work.parts[i];
    const MatX& Mee = work.carrying.elastic[i] ? p.Mee : elastic_mass(kinetic_body(model, work, i), p.terms);
    const int n = N > 0 ? N : part.body.n, first = place[part.ev0 - c.v0];
    for (int k = 0; k < n; ++k) {
      const auto m = column(p.Mre, k);
      double* const d = D + std::ptrdiff_t{padded} * (first + k);
      for (std::ptrdiff_t f = Fours > 1 ? (first + k) / 4 : 0; f < Fours; ++f) {
        Four sum = four(d + 4 * f).v;
        for (int r = 0; r < components; ++r) sum += at.twists.of[r][f] * m[r];
        four(d + 4 * f).v = sum;
      }
      // Above the diagonal nobody reads.
      const double* const own = &Mee(0, k);
      int l = 0;
      for (; l + 4 <= n; l += 4) four(d + first + l).v += four(own + l).v;
      for (; l < n; ++l) d[first + l] += own[l];
      double force = p.fe[k];
      for (int r = 0; r < components; ++r) {
        momenta.row(r)[first + k] += m[r];
        force += m[r] * at.made[r];
      }
      h[first + k] -= force;
    }
  }

  FLEXFRAME_INLINE bool factorise() {
    if (cw.inertia.size() != rates) cw.inertia.resize(rates);
    double* const inertia = cw.inertia.data();
    by_rates([&](auto n) __attribute__((always_inline)) {
      for (int k = 0; k < n(); ++k) inertia[k] = D[k * (padded + 1)];
    });
    if (thin && idle_mass(model, cluster, cw) > 0.0) return false;
    for (int k = rates; k < padded; ++k) {
      std::fill_n(D + k * padded, padded, 0.0);
      D[k * (padded + 1)] = 1.0;
      h[k] = 0.0;
    }
    if (!factorise_columns(D, padded, padded)) return false;
    if (cw.L.rows() != rates) cw.L.resize(rates, rates);
    double* const L = cw.L.data();
    by_rates([&](auto n) __attribute__((always_inline)) {
      for (int k = 0; k < n(); ++k) copy_fours(D + k * padded, n(), L + k * n());
    });
    return true;
  }

  FLEXFRAME_INLINE bool run() {
    static thread_local std::vector<Moved<S, Fours>> moved;
    if (moved.size() < model.parts.size()) moved.resize(model.parts.size());
    list_rates();
    std::fill_n(D, padded * padded, 0.0);
    std::fill_n(h, padded, 0.0);
    static thread_local int marked = 0;
    static thread_local bool has_thin = false;
    if (marked != cw.plan.made) {
      mark_parts(moved);
      has_thin = !cw.partition.dep.empty() && has_thin_body(model, cluster);
    }
    marked = cw.plan.made;
    thin = has_thin;
    using By = typename Moved<S, Fours>::By;
    for (int i : c.parts)
      if (moved[i].by != By::follower) move(i, moved);
    for (int i : c.parts) {
      if (moved[i].by == By::twists) add_part(i, moved[i]);
      else if (moved[i].by == By::follower) add_follower(i);
      else if (moved[i].by == By::alone) add_alone(i);
      else if (driven) {
        const auto& p = work.parts[i];
        power += moved[i].driven.dot(p.fr + p.Mrr.lazyProduct(moved[i].made));
      }
    }
    if (!factorise()) return false;
    solve_columns(D, padded, h);
    cw.whole = false;
    if (driven) {
      for (int f = 0; f < Fours; ++f) {
        const Four s = per_rate[f] * four(h + 4 * f).v;
        power += (s[0] + s[1]) + (s[2] + s[3]);
      }
      cw.fed = power;
      cw.fed_known = true;
    }
    double* const wdot = work.wdot.data() + c.v0;
    const int* const ind = cw.partition.ind.data();
    by_rates([&](auto n) __attribute__((always_inline)) {
      for (int k = 0; k < n(); ++k) wdot[ind[k]] = h[k];
    });
    for (size_t d = 0; d < cw.partition.dep.size(); ++d) {
      double a = cw.gamma[static_cast<Eigen::Index>(d)];
      for (int f = 0; f < Fours; ++f) {
        const Four s = dependent[d][f] * four(h + 4 * f).v;
        a += (s[0] + s[1]) + (s[2] + s[3]);
      }
      wdot[cw.partition.dep[d]] = a;
    }
    return true;
  }
};

template <class W>
FLEXFRAME_INLINE bool solve(const Model& model, int cluster, W& work) {
  const int rates = static_cast<int>(work.clusters[cluster].partition.ind.size());
  return rates <= 4 ? FewRates<W, 1>(model, cluster, rates, work).run() : FewRates<W, 2>(model, cluster, rates, work).run();
}
FLEXFRAME_WIDE bool wide_solve(const Model& model, int cluster, Work& work) { return solve(model, cluster, work); }
FLEXFRAME_WIDE bool wide_solve(const Model& model, int cluster, PlaneWork& work) { return solve(model, cluster, work); }

}  // namespace

bool has_thin_body(const Model& model, int cluster) {
  for (const int i : model.clusters[cluster].parts) {
    const FlexibleBody& body = model.parts[i].body;
    if (body.n > 0 || !(body.mass > 0.0)) continue;
    const Vec3 c = body.md0 / body.mass;
    const Vec6& J = body.J0;
    Mat3 I;
    I << J[0], J[3], J[4], J[3], J[1], J[5], J[4], J[5], J[2];
    const double size = I.trace();
    I -= body.mass * (c.squaredNorm() * Mat3::Identity() - c * c.transpose());
    // Rounding of what was moved to the frame's origin and back.
    if (SymmetricEigen(I, Eigen::EigenvaluesOnly).eigenvalues()[0] <= 1e-12 * size) return true;
  }
  return false;
}

double idle_mass(const Model& model, int cluster, const ClusterWork& cw) {
  double mass = 0.0;
  for (const int i : model.clusters[cluster].parts) mass += model.parts[i].body.mass;
  bool found = false;
  for (Eigen::Index k = 0; k < cw.inertia.size(); ++k) {
    const double scale = rate_scale(model, cluster, cw.partition.ind[static_cast<size_t>(k)]);
    if (scale == 0.0) return 0.0;  // a deformation
    found = found || cw.inertia[k] <= idle_share * mass * scale * scale;
  }
  return found ? mass : 0.0;
}

template <class W>
bool has_few_rates(int cluster, const W& work) {
  const ClusterWork& cw = work.clusters[cluster];
  const size_t rates = cw.partition.ind.size();
  if (rates == 0 || rates > most_rates || cw.partition.dep.size() > most_dependent || cw.carried > 0) return false;
  return !cw.plan.deforms;
}

template <class W>
bool solve_few(const Model& model, int cluster, W& work) {
  return wide_solve(model, cluster, work);
}

#define FLEXFRAME_FOR(W)                      \
  template bool has_few_rates(int, const W&); \
  template bool solve_few(const Model&, int, W&);
FLEXFRAME_FOR(Work)
FLEXFRAME_FOR(PlaneWork)
#undef FLEXFRAME_FOR

}  // namespace flexframe::sim
