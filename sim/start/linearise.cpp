#include "sim/start/linearise.h"

#include "sim/base/eigen_solvers.h"
#include "sim/bodies/axis_mass.h"
#include "sim/dynamics/directions.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/flexures.h"
#include "sim/dynamics/inverse_dynamics.h"
#include "sim/dynamics/signals.h"
#include "sim/dynamics/stops.h"
#include "sim/model/joint_motion.h"
#include "sim/scene/joint_kinds.h"
#include "sim/start/complex_modes.h"
#include "sim/start/massless_modes.h"
#include "sim/start/structural_matrices.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>

namespace flexframe::sim {
namespace {

constexpr double double_eps = std::numeric_limits<double>::epsilon();

// A joint of rotations in space all of whose rates are independent. The bodies on it may be described in their own axes or in the joint's
// parent's.
struct SpaceJoint {
  int part = 0;
  Eigen::Index first = 0;  // of its rates among the directions
  bool free = false;       // velocity before angular velocity
  // A body without joints on ground moves along with its own flight: velocity u + displacement's, u and its rate in world axes.
  bool flies = false;
  Vec3 velocity = Vec3::Zero(), acceleration = Vec3::Zero();
};

Mat3 rotation_of(const Model& model, const Work& work, const SpaceJoint& j) {
  const double* q = work.q.data() + model.parts[j.part].q0 + (j.free ? 3 : 0);
  return Quat(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
}

// Which axes a space joint's translations and rotations are described in: those of the body that turns, or the joint's parent's.
struct Axes {
  bool space_translation = true, space_rotation = true;
};

// The mechanism about a state: positions q, independent rates w and accelerations a (w_all).
struct State {
  VecX q, w, a;
  std::vector<double> motion;  // values of the prescribed motions
};

// Coefficients of M x'' + D x' + K x = 0 in the making; everything in the units of the directions.
struct Coefficients {
  MatX N;  // w_all x n: rates that unit independent rates make
  SecondOrder system;
};

class Point {
 public:
  Point(System& system, bool with_rates);

  bool moves() const { return moves_; }
  bool steady(const Axes& axes);
  bool equilibrium() const { return equilibrium_; }
  // A cable that is neither tight nor slack; empty: none.
  const std::string& just_tight() const { return just_tight_; }
  const std::vector<Direction>& directions() const { return all_; }
  const Coefficients& coefficients() const { return made_; }
  FurtherStates block_states();
  SecondOrder described_in(const Axes& axes) const;
  bool turns() const;
  bool seen_turning(const Axes& axes);

 private:
  VecX force(const State& at, Eigen::Index moved, double step, Eigen::Index quickened, double rate, VecX* size = nullptr);
  void hold_pieces();
  void exact_matrices();
  void hold_elasticity();
  void accelerations();
  bool beside_equilibrium();
  bool beside_rest();
  void stiffness();
  void damping();
  bool has_damping() const;
  bool any_law_of_rates() const;
  double fastest_rate() const;
  std::vector<bool> touching() const;
  State later(double time) const;
  VecX along(const State& at, const Axes& axes, const VecX& r);
  MatX to_start(const State& at, const Axes& axes) const;
  double metres(Eigen::Index k) const { return all_[k].scale; }
  // What loads would accelerate the mechanism by, m/s^2: accelerations far below it are rounding.
  double acceleration_scale() const { return std::max(model_.settings.gravity.norm(), start_forces_ / std::max(model_.mass, 1e-300)); }

  Model& model_;
  Work& work_;
  std::vector<Direction> all_;
  std::vector<SpaceJoint> joints_;
  State start_;
  Coefficients made_;
  bool moves_ = false, equilibrium_ = false, drives_accelerate_ = false;
  std::string just_tight_;
  double rest_scale_ = 0.0, start_forces_ = 0.0;  // N: largest forces met so far, and at the start
};

Point::Point(System& system, bool with_rates)
    : model_(system.model), work_(system.work), all_(independent_directions(system.model, system.work)) {
  update_expressions(model_, work_.time, work_);
  for (TimeJet& jet : work_.motion) {
    moves_ = moves_ || jet.rate != 0.0;
    drives_accelerate_ = drives_accelerate_ || jet.acceleration != 0.0;
    jet.acceleration = 0.0;
    start_.motion.push_back(jet.value);
  }
  start_.q = work_.q;
  start_.w = VecX::Zero(model_.nv);
  start_.a = VecX::Zero(model_.nv);
  if (with_rates)
    for (const Direction& d : all_) {
      start_.w[d.v] = work_.w[d.v];
      moves_ = moves_ || start_.w[d.v] != 0.0;
    }
  for (size_t i = 0; i < model_.parts.size(); ++i) {
    const Part& p = model_.parts[i];
    if (p.joint.stop && p.joint.nv > 0) work_.joints[i].stop = find_stop_phase(*p.joint.stop, work_.q[p.q0], start_.w[p.v0]);
    if (!has_orientation(p.joint.kind)) continue;
    Eigen::Index first = -1, count = 0;
    for (size_t k = 0; k < all_.size(); ++k)
      if (all_[k].v >= p.v0 && all_[k].v < p.v0 + p.joint.nv && count++ == 0) first = static_cast<Eigen::Index>(k);
    if (count == p.joint.nv && count > 0)
      joints_.push_back({static_cast<int>(i), first, p.joint.kind == JointKind::free,
                         p.joint.kind == JointKind::free && p.parent == ground && !p.joint.reversed, Vec3::Zero(), Vec3::Zero()});
  }
  hold_pieces();
  exact_matrices();
  accelerations();
  hold_elasticity();
  stiffness();
  damping();
}

// What expressions choose at the start holds beside it, as stops do: a preloaded cable is a spring, however little it takes to slacken it.
void Point::hold_pieces() {
  if (model_.functions.empty()) return;
  force(start_, -1, 0.0, -1, 0.0);
  hold_switches(model_, work_);
  for (const Load& load : model_.loads) {
    if (!load.def.cable || load.function < 0) continue;
    const StateFunction& pull = model_.functions[load.function];
    const double margin = std::abs(first_margin(pull, work_.signals, work_.time));
    // Without a damper it is a pull, N, else a length.
    const double way = load.def.spring.damping == 0.0 ? margin / load.def.spring.stiffness : margin;
    if (way <= 1e-9 * model_.size) just_tight_ = pull.owner;
  }
}

// Forces on the directions beside a state: one coordinate moved, one rate changed.
VecX Point::force(const State& at, Eigen::Index moved, double step, Eigen::Index quickened, double rate, VecX* size) {
  work_.q = at.q;
  work_.w = at.w;
  for (size_t i = 0; i < at.motion.size(); ++i) work_.motion[i].value = at.motion[i];
  if (moved >= 0) move_along(model_, all_[moved], step, work_);
  if (quickened >= 0) work_.w[all_[quickened].v] += rate;
  VecX a = at.a;
  for (const SpaceJoint& j : joints_) {
    if (!j.flies) continue;
    const int v = model_.parts[j.part].v0;
    const Mat3 R = rotation_of(model_, work_, j);
    const Vec3 u = R.transpose() * j.velocity;
    work_.w.segment<3>(v) += u;
    a.segment<3>(v) += R.transpose() * j.acceleration - Vec3(work_.w.segment<3>(v + 3)).cross(u);
  }
  update_positions(model_, work_, moves_ || !equilibrium_ || quickened >= 0);
  update_velocities(model_, work_);
  RestForces rest;
  rest_forces(model_, work_, nullptr, rest, &a);
  rest_scale_ = std::max(rest_scale_, rest.scale);
  VecX out(static_cast<Eigen::Index>(all_.size()));
  if (size) size->resize(out.size());
  for (size_t k = 0; k < all_.size(); ++k) {
    out[static_cast<Eigen::Index>(k)] = rest.force[all_[k].v];
    if (size) (*size)[static_cast<Eigen::Index>(k)] = rest.size[all_[k].v];
  }
  return out;
}

void Point::exact_matrices() {
  const StructuralMatrices exact = structural_matrices(model_, work_, all_);
  const Eigen::Index n = exact.M.rows();
  made_.N = exact.N;
  made_.system.M = exact.M;
  made_.system.D = exact.D;
  made_.system.K = exact.K;
  made_.system.D_error = made_.system.K_error = MatX::Zero(n, n);
  // From here on forces alone are wanted.
  for (PartWork& part : work_.parts) part.terms.Mee.resize(0, 0);
}

// Whether the start lies within a billionth of the mechanism's size of an equilibrium. Springs at their rest lengths without other loads
// have forces that are nothing but rounding of places, and no load to compare them with.
bool Point::beside_equilibrium() {
  constexpr Eigen::Index most = 400;  // of directions; each takes an evaluation
  const auto n = static_cast<Eigen::Index>(all_.size());
  if (n == 0 || n > most || moves_) return false;
  // What flies is held by springs or finds no way to rest.
  std::vector<Vec3> falls;
  for (SpaceJoint& j : joints_) falls.push_back(std::exchange(j.acceleration, Vec3::Zero()));
  const bool beside = beside_rest();
  for (size_t i = 0; i < joints_.size(); ++i) joints_[i].acceleration = falls[i];
  return beside;
}

bool Point::beside_rest() {
  constexpr double near = 1e-9;
  const auto n = static_cast<Eigen::Index>(all_.size());
  State still = start_;
  still.a.setZero();
  const double largest = rest_scale_;
  VecX row(n);
  for (Eigen::Index k = 0; k < n; ++k) row[k] = 1.0 / metres(k);
  const VecX f = row.cwiseProduct(force(still, -1, 0.0, -1, 0.0));
  MatX slope(n, n);  // N by shares of the size
  for (Eigen::Index k = 0; k < n; ++k) {
    const double size = model_.clusters[model_.parts[all_[k].part].cluster].size;
    slope.col(k) = (row.cwiseProduct(force(still, k, near * size / metres(k), -1, 0.0)) - f) / near;
  }
  rest_scale_ = largest;
  // Differences over so short a way have seven digits.
  const VecX way = least_squares(slope, f, 1e-6);
  if (!way.allFinite() || way.cwiseAbs().maxCoeff() > near) return false;
  // What is left of a row: what soft directions next to stiff ones do not resolve, or what rounding of the places makes.
  const VecX left = (slope * way - f).cwiseAbs(), rounded = 8.0 * double_eps * slope.cwiseAbs().rowwise().sum();
  return left.norm() <= 1e-6 * f.norm() || (left - rounded).maxCoeff() <= 0.0;
}

// Accelerations of the start, and with them which bodies fly.
void Point::accelerations() {
  const Eigen::Index n = static_cast<Eigen::Index>(all_.size());
  const VecX f = force(start_, -1, 0.0, -1, 0.0);
  start_forces_ = rest_scale_;
  VecX unit(n);
  for (Eigen::Index k = 0; k < n; ++k) unit[k] = 1.0 / metres(k);
  // What has no inertia takes part by the least accelerations, if at all.
  const VecX a = unit.cwiseProduct(
      VecX(least_squares(MatX(unit.asDiagonal() * made_.system.M * unit.asDiagonal()), MatX(unit.cwiseProduct(f)), 1e-13)));
  for (Eigen::Index k = 0; k < n; ++k) start_.a[all_[k].v] = a[k];
  double fastest = 0.0;
  for (SpaceJoint& j : joints_) {
    if (!j.flies) continue;
    const int v = model_.parts[j.part].v0;
    work_.q = start_.q;
    const Mat3 R = rotation_of(model_, work_, j);
    const Vec3 velocity = start_.w.segment<3>(v), turning = start_.w.segment<3>(v + 3);
    j.velocity = R * velocity;
    j.acceleration = R * (start_.a.segment<3>(v) + turning.cross(velocity));
    start_.w.segment<3>(v).setZero();
    start_.a.segment<3>(v).setZero();
    fastest = std::max(fastest, j.acceleration.norm());
  }
  // What turns on springs without a load has forces that are nothing but rounding of places: compared with some of what turning takes.
  start_forces_ = std::max(start_forces_, 1e-4 * model_.mass * model_.size * std::pow(fastest_rate(), 2));
  for (const Direction& d : all_) fastest = std::max(fastest, std::abs(start_.a[d.v]) * d.scale);
  // Flight at an even speed is rest.
  equilibrium_ = !drives_accelerate_ && (fastest <= 1e-9 * acceleration_scale() || beside_equilibrium());
  // What is left of them at rest is rounding.
  if (equilibrium_ && !moves_) start_.a.setZero();
}

// The elastic forces of the state stay as constants, so that stiff bodies do not drown the differences and an equilibrium stays one.
void Point::hold_elasticity() {
  work_.q = start_.q;
  update_positions(model_, work_);
  hold_flexures(model_, work_);
  for (size_t i = 0; i < model_.parts.size(); ++i) {
    Part& p = model_.parts[i];
    if (p.body.n == 0) continue;
    VecX force = p.body.Ke * work_.parts[i].q;
    if (p.body.ksigma.size() > 0) force += p.body.ksigma;
    p.body.ksigma = force;
    p.body.Ke.setZero();
    p.body.stiffness.resize(0);
    p.body.De.resize(0, 0);
  }
}

// Contacts that press, at the state of the last forces.
std::vector<bool> Point::touching() const {
  std::vector<bool> out;
  for (const ContactWork& c : work_.signals.contacts) out.push_back(c.depth > 0.0);
  return out;
}

// K -= dF/dx.
void Point::stiffness() {
  force(start_, -1, 0.0, -1, 0.0);
  const std::vector<bool> touched = touching();
  const Eigen::Index n = static_cast<Eigen::Index>(all_.size());
  VecX row(n);
  for (Eigen::Index k = 0; k < n; ++k) row[k] = 1.0 / metres(k);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Direction& d = all_[k];
    const Part& part = model_.parts[d.part];
    const double size = model_.clusters[part.cluster].size;
    // A unit step turns a joint by a radian, moves it by the mechanism's size, or bends a body so that no node does more than that.
    double unit = size / d.scale, turn = 0.0;
    if (d.rate < 0)
      for (const FlexibleNode& node : part.body.nodes) turn = std::max(turn, node.psi.col(-1 - d.rate).norm());
    if (turn > 0.0) unit = std::min(unit, 1.0 / turn);
    VecX best, best_error;
    double least = std::numeric_limits<double>::infinity();
    // Two thousandths: differences of sixth order err by 1e-17 there, of fourth by 5e-13, roundings by 1e-13. Shorter where the forces
    // change within that.
    constexpr double shortest = 2e-10;
    double share = 2e-3;
    for (int tenths = 0; tenths < 8; ++tenths, share *= 0.1) {
      // Below 1e-7 only to stay on one side of where something touches or parts.
      if (share < 1e-7 && best.size() > 0) break;
      const double h = share * unit;
      VecX size_of, pairs[3];
      bool parted = false;
      const auto beside = [&](double step) {
        VecX out = force(start_, k, step, -1, 0.0, &size_of);
        parted = parted || touching() != touched;
        return out;
      };
      const auto pair = [&](int i) { return VecX(beside(i * h) - beside(-i * h)); };
      VecX slope, error, rounding;
      const auto judge = [&](const VecX& better, const VecX& worse) {
        slope = better;
        rounding = 4.0 * double_eps / h * size_of;
        error = (better - worse).cwiseAbs().cwiseMax(rounding);
        return row.cwiseProduct(error).maxCoeff();
      };
      const auto good = [&](double off) {
        return off <= 1e-10 * row.cwiseProduct(slope).cwiseAbs().maxCoeff() || off <= 4.0 * row.cwiseProduct(rounding).maxCoeff();
      };
      double off = 0.0;
      try {
        pairs[0] = pair(1);
        pairs[1] = pair(2);
        off = judge((8.0 * pairs[0] - pairs[1]) / (12.0 * h), pairs[0] / (2.0 * h));
        // Polynomials of low order, as elastic displacements make them, need no more.
        if (!good(off)) {
          pairs[2] = pair(3);
          off = judge((45.0 * pairs[0] - 9.0 * pairs[1] + pairs[2]) / (60.0 * h), VecX(slope));
        }
      } catch (const SimulationError&) {
        continue;
      }
      if (parted && share > 1.5 * shortest) continue;
      // A shorter step that is no better only adds rounding.
      if (off >= least) break;
      least = off;
      best = slope;
      best_error = error;
      if (good(off)) break;
    }
    if (best.size() == 0)
      throw SimulationError(
          "the frequencies cannot be computed: the loops of the mechanism cannot be closed beside the start (a change point or a dead "
          "centre)");
    made_.system.K.col(k) -= best;
    made_.system.K_error.col(k) = best_error;
  }
}

bool Point::has_damping() const {
  if (moves_) return true;
  const auto damped = [](const Spring& s) { return s.damping != 0.0; };
  for (const Part& p : model_.parts)
    if ((p.joint.spring && damped(*p.joint.spring)) || (p.joint.stop && p.joint.stop->damping != 0.0)) return true;
  for (const LoopJoint& l : model_.loops)
    if (l.spring && damped(*l.spring)) return true;
  for (const Load& l : model_.loads)
    if (damped(l.def.spring) || !l.def.bushing_damping.isZero(0.0) || l.function >= 0 || l.def.kind == ForceKind::drag || l.contact >= 0)
      return true;
  return false;
}

// Drag, contacts and expressions that read rates follow any law, the others are polynomials of second order in the rates.
bool Point::any_law_of_rates() const {
  return std::any_of(model_.loads.begin(), model_.loads.end(),
                     [](const Load& l) { return l.function >= 0 || l.def.kind == ForceKind::drag || l.contact >= 0; });
}

// D -= dF/dw. Of polynomials of second order central differences are exact for any step; other laws are differenced close by.
void Point::damping() {
  if (!has_damping()) return;
  const double closeness = any_law_of_rates() ? 1e-6 : 1.0;
  const Eigen::Index n = static_cast<Eigen::Index>(all_.size());
  double fastest = std::max(fastest_rate(), 1.0 / model_.settings.duration);
  for (Eigen::Index k = 0; k < n; ++k) {
    const double step = closeness * fastest * model_.clusters[model_.parts[all_[k].part].cluster].size / metres(k);
    VecX size;
    const VecX slope = (force(start_, -1, 0.0, k, step, &size) - force(start_, -1, 0.0, k, -step)) / (2.0 * step);
    made_.system.D.col(k) -= slope;
    made_.system.D_error.col(k) = 4.0 * double_eps / step * size;
  }
}

// Which states of blocks drive a force or a state that does.
std::vector<Eigen::Index> driving(const MatX& A, const MatX& G) {
  std::vector<Eigen::Index> out;
  std::vector<char> known(A.rows(), 0);
  for (bool found = true; found;) {
    found = false;
    for (Eigen::Index j = 0; j < A.rows(); ++j) {
      bool drives = !G.col(j).isZero(0.0);
      for (const Eigen::Index i : out) drives = drives || A(i, j) != 0.0;
      if (known[j] || !drives) continue;
      known[j] = 1, found = true;
      out.push_back(j);
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

// States of continuous blocks beside the start, by central differences: blocks are linear, what they read mostly is.
FurtherStates Point::block_states() {
  std::vector<Eigen::Index> rows;
  for (const Block& b : model_.blocks)
    if (b.sample == 0.0)
      for (Eigen::Index k = 0; k < b.A.rows(); ++k) rows.push_back(b.z0 + k);
  const Eigen::Index n = static_cast<Eigen::Index>(all_.size()), nz = static_cast<Eigen::Index>(rows.size());
  FurtherStates out{MatX::Zero(nz, nz), MatX::Zero(nz, n), MatX::Zero(nz, n), MatX::Zero(n, nz)};
  if (nz == 0) return out;
  constexpr double share = 1e-5;
  const auto rates = [&] { return VecX(work_.signals.zdot(rows)); };
  VecX& z = work_.signals.z;
  for (Eigen::Index j = 0; j < nz; ++j) {
    const double start = z[rows[j]], h = share * (1.0 + std::abs(start));
    z[rows[j]] = start + h;
    const VecX force_above = force(start_, -1, 0.0, -1, 0.0), above = rates();
    z[rows[j]] = start - h;
    const VecX force_below = force(start_, -1, 0.0, -1, 0.0), below = rates();
    z[rows[j]] = start;
    out.G.col(j) = (force_above - force_below) / (2.0 * h);
    out.A.col(j) = (above - below) / (2.0 * h);
  }
  for (Eigen::Index k = 0; k < n; ++k) {
    const double h = share * model_.clusters[model_.parts[all_[k].part].cluster].size / metres(k);
    const auto slope = [&](const auto& put) {
      put(h);
      const VecX above = rates();
      put(-h);
      return VecX((above - rates()) / (2.0 * h));
    };
    out.B.col(k) = slope([&](double by) { force(start_, k, by, -1, 0.0); });
    out.B_rate.col(k) = slope([&](double by) { force(start_, -1, 0.0, k, by); });
  }
  const std::vector<Eigen::Index> kept = driving(out.A, out.G);
  return {out.A(kept, kept), out.B(kept, Eigen::all), out.B_rate(kept, Eigen::all), out.G(Eigen::all, kept)};
}

bool Point::turns() const {
  for (const SpaceJoint& j : joints_)
    if (!start_.w.segment<3>(model_.parts[j.part].v0 + (j.free ? 3 : 0)).isZero(0.0)) return true;
  return false;
}

// Whether coordinates are measured on bodies that turn.
bool Point::seen_turning(const Axes& axes) {
  if (!moves_) return false;
  force(start_, -1, 0.0, -1, 0.0);
  for (const Direction& d : all_) {
    const int on = d.rate < 0 ? d.part : model_.parts[d.part].parent;
    if (on != ground && !work_.parts[on].V.tail<3>().isZero(0.0)) return true;
  }
  return turns() && !(axes.space_translation && axes.space_rotation);
}

// x' = w - G x where rates are those of axes that turn; axes that do not add S x to both x' and w': w = x' + H x, H = G - S.
SecondOrder Point::described_in(const Axes& axes) const {
  const Eigen::Index n = static_cast<Eigen::Index>(all_.size());
  MatX G = MatX::Zero(n, n), S = G;
  VecX ind(n);
  for (Eigen::Index k = 0; k < n; ++k) ind[k] = start_.w[all_[k].v];
  for (size_t i = 0; i < model_.parts.size(); ++i) {
    const Part& p = model_.parts[i];
    if (!has_orientation(p.joint.kind)) continue;
    const int at = traits(p.joint.kind).quaternion;  // rates before it are a velocity
    const VecX w = made_.N.middleRows(p.v0, p.joint.nv) * ind;
    if (w.isZero(0.0)) continue;
    MatX ad = MatX::Zero(p.joint.nv, p.joint.nv);
    const Mat3 turning = skew(w.segment<3>(at));
    ad.bottomRightCorner<3, 3>() = turning;
    if (at > 0) {
      ad.topLeftCorner<3, 3>() = turning;
      ad.topRightCorner<3, 3>() = skew(w.head<3>());
    }
    for (Eigen::Index k = 0; k < n; ++k) {
      const int row = all_[k].v - p.v0;
      if (row >= 0 && row < p.joint.nv) G.row(k) = ad.row(row) * made_.N.middleRows(p.v0, p.joint.nv);
    }
    for (const SpaceJoint& j : joints_) {
      if (j.part != static_cast<int>(i)) continue;
      if (j.free && axes.space_translation) S.block<3, 3>(j.first, j.first) = turning;
      if (axes.space_rotation) S.block<3, 3>(j.first + at, j.first + at) = turning;
    }
  }
  SecondOrder out = made_.system;
  if (G.isZero(0.0) && S.isZero(0.0)) return out;
  const MatX H = G - S, MS = out.M * S;
  const MatX rounding = 4.0 * double_eps * (out.D.cwiseAbs() * H.cwiseAbs() + MS.cwiseAbs() * H.cwiseAbs());
  out.K += out.D * H - MS * H;
  out.K_error += out.D_error * H.cwiseAbs() + rounding;
  out.D_error += 4.0 * double_eps * (out.M.cwiseAbs() * H.cwiseAbs() + MS.cwiseAbs());
  out.D += out.M * H - MS;
  return out;
}

// Where a steady motion has come after some time.
State Point::later(double time) const {
  State out = start_;
  Work& work = work_;
  work.q = start_.q;
  for (size_t i = 0; i < out.motion.size(); ++i) out.motion[i] += time * work.motion[i].rate;
  VecX ind(static_cast<Eigen::Index>(all_.size()));
  for (size_t k = 0; k < all_.size(); ++k) ind[static_cast<Eigen::Index>(k)] = start_.w[all_[k].v];
  const VecX w = made_.N * ind;
  for (const Part& p : model_.parts) {
    if (p.joint.nq > 0) {
      const VecX step = time * w.segment(p.v0, p.joint.nv);
      move_coordinates(p.joint.kind, work.q.data() + p.q0, step.data());
    }
    work.q.segment(p.eq0, p.body.n) += time * w.segment(p.ev0, p.body.n);
  }
  for (const SpaceJoint& j : joints_)
    if (j.flies) work.q.segment<3>(model_.parts[j.part].q0) += time * j.velocity + 0.5 * time * time * j.acceleration;
  out.q = work.q;
  return out;
}

// Turns directions from the axes at a later state to those at the start.
MatX Point::to_start(const State& at, const Axes& axes) const {
  const Eigen::Index n = static_cast<Eigen::Index>(all_.size());
  MatX out = MatX::Identity(n, n);
  for (const SpaceJoint& j : joints_) {
    work_.q = start_.q;
    const Mat3 before = rotation_of(model_, work_, j);
    work_.q = at.q;
    const Mat3 R = before.transpose() * rotation_of(model_, work_, j);
    if (j.free && axes.space_translation) out.block<3, 3>(j.first, j.first) = R;
    const Eigen::Index rotation = j.first + (j.free ? 3 : 0);
    if (axes.space_rotation) out.block<3, 3>(rotation, rotation) = R;
  }
  return out;
}

// Forces' derivative along a direction r of positions, rates and accelerations at once, in the start's axes.
VecX Point::along(const State& at, const Axes& axes, const VecX& r) {
  const MatX T = to_start(at, axes);
  const VecX x = T.transpose() * r;
  const auto beside = [&](double h) {
    State s = at;
    work_.q = at.q;
    for (size_t k = 0; k < all_.size(); ++k) {
      const Eigen::Index i = static_cast<Eigen::Index>(k);
      move_along(model_, all_[k], h * x[i], work_);
      s.w[all_[k].v] += h * x[i];
      s.a[all_[k].v] += h * x[i];
    }
    s.q = work_.q;
    return force(s, -1, 0.0, -1, 0.0);
  };
  const double h = 1e-4 * model_.size;
  return T * (beside(h) - beside(-h)) / (2.0 * h);
}

// Of the start's rates and drives, rad/s or of the mechanism's size.
double Point::fastest_rate() const {
  double fastest = 0.0;
  for (const Direction& d : all_) fastest = std::max(fastest, std::abs(start_.w[d.v]) * d.scale / model_.size);
  for (const Part& p : model_.parts)
    if (p.joint.motion >= 0)
      fastest = std::max(fastest, std::abs(work_.motion[p.joint.motion].rate) / (is_length(p.joint.kind, 0) ? model_.size : 1.0));
  return fastest;
}

// Whether the motion goes on as it starts and the coefficients stay the same: after most of a radian, which is no part of a symmetry.
bool Point::steady(const Axes& axes) {
  if (!moves_) return true;
  // Nothing accelerates beside what flies.
  for (const Direction& d : all_)
    if (std::abs(start_.a[d.v]) * d.scale > 1e-7 * acceleration_scale()) return false;
  const double fastest = fastest_rate();
  if (!(fastest > 0.0)) return true;
  const State then = later(0.7 / fastest);
  const Eigen::Index n = static_cast<Eigen::Index>(all_.size());
  VecX r(n);
  for (Eigen::Index k = 0; k < n; ++k) r[k] = std::sin(1.0 + 2.3 * static_cast<double>(k)) / metres(k);
  try {
    const VecX left = force(then, -1, 0.0, -1, 0.0);
    VecX row(n);
    for (Eigen::Index k = 0; k < n; ++k) row[k] = 1.0 / metres(k);
    if (row.cwiseProduct(left).cwiseAbs().maxCoeff() > 1e-7 * start_forces_) return false;
    const VecX now = along(start_, axes, r), changed = along(then, axes, r);
    return row.cwiseProduct(changed - now).norm() <= 1e-6 * row.cwiseProduct(now).norm();
  } catch (const SimulationError&) {
    return false;
  }
}

// What turns without inertia and without a moment is a rigid mode, with any inertia.
void give_idle_inertia(const std::vector<Direction>& all, MatX& M) {
  const Eigen::Index n = M.rows();
  VecX metres(n);
  for (Eigen::Index k = 0; k < n; ++k) metres[k] = all[k].scale;
  const VecX unit = metres.cwiseInverse();
  const SymmetricEigen inertia(MatX(unit.asDiagonal() * M * unit.asDiagonal()));
  const double most = inertia.eigenvalues()[n - 1];
  for (Eigen::Index k = 0; k < n && inertia.eigenvalues()[k] <= 1e-14 * most; ++k) {
    const VecX u = metres.cwiseProduct(inertia.eigenvectors().col(k));
    M += (most > 0.0 ? most : 1.0) * u * u.transpose();
  }
}

LinearMode to_mode(const ComplexMode& m, const VecX& sizes) {
  LinearMode out;
  // No zero with a sign.
  out.pole = {m.lambda.real() + 0.0, m.lambda.imag() + 0.0};
  out.frequency = std::abs(m.lambda.imag()) / (2.0 * std::numbers::pi);
  const double size = std::abs(m.lambda);
  if (size > 0.0) out.damping = 0.0 - m.lambda.real() / size;
  if (m.lambda.real() > 0.0) {
    out.kind = LinearMode::unstable;
    out.growth = m.lambda.real();
  } else {
    out.kind = size == 0.0 ? LinearMode::rigid : m.lambda.imag() == 0.0 ? LinearMode::overdamped : LinearMode::vibration;
  }
  // The coordinate that moves farthest, in metres, is 1.
  Eigen::Index at = 0;
  Eigen::VectorXcd x = m.x;
  if (x.size() > 0 && x.cwiseProduct(sizes.cast<std::complex<double>>()).cwiseAbs().maxCoeff(&at) > 0.0) x /= x[at];
  out.shape = x.real();
  out.quadrature = x.imag();
  const double peak = x.cwiseAbs().maxCoeff();
  if (peak > 0.0) {
    out.shape /= peak;
    out.quadrature /= peak;
  }
  return out;
}

// The order of LinearMode::kind; then by frequency, decays by their rate.
bool before(const LinearMode& a, const LinearMode& b) {
  if (a.kind != b.kind) return a.kind < b.kind;
  if (a.kind == LinearMode::unstable) return a.growth > b.growth;
  return a.kind == LinearMode::overdamped ? a.pole.real() > b.pole.real() : a.frequency < b.frequency;
}

bool has_rates(const System& system) {
  for (const Direction& d : independent_directions(system.model, system.work))
    if (system.work.w[d.v] != 0.0) return true;
  return false;
}

// The axes in which the coefficients are constant, best first; none: false.
bool constant_axes(Point& point, Axes& axes) {
  for (const Axes& tried : {Axes{true, true}, Axes{true, false}, Axes{false, false}}) {
    axes = tried;
    if (point.steady(axes)) return true;
    if (!point.turns()) return false;
  }
  return false;
}

// Blocks whose outputs stay as they are at the start.
void say_what_is_held(const Model& model, bool states_move, Linearisation& out) {
  const auto held = [&](const Signal& s) {
    return s.block >= 0 && (model.blocks[s.block].sample > 0.0 || (!states_move && model.blocks[s.block].A.rows() > 0));
  };
  if (std::any_of(model.signals.begin(), model.signals.end(), held))
    out.warnings.push_back(
        "the linearised equations hold the outputs of sampled blocks, and on a mechanism that turns or has parts without mass the states "
        "of "
        "all blocks, as they are at the start: frequencies, damping and stability are without what they do");
  if (has_contact_friction(model)) out.notes.push_back(free_by_friction);
  if (std::any_of(model.parts.begin(), model.parts.end(), [](const Part& p) { return p.joint.friction.has_value(); }))
    out.notes.emplace_back("friction of joints holds nothing in small motions: what rests by it alone counts as free");
}

}  // namespace

bool has_contact_friction(const Model& model) {
  return std::any_of(model.contacts.begin(), model.contacts.end(), [](const Contact& c) { return c.z0 >= 0; });
}

bool surely_stable(const System& given) {
  System system = given;
  if (!system.model.blocks.empty() || has_rates(system) || release_massless(system.model, system.work)) return false;
  update_accelerations(system.model, system.work);
  if (system.work.idle || independent_directions(system.model, system.work).empty()) return false;
  const Point point(system, false);
  if (point.moves()) return false;
  const SecondOrder& s = point.coefficients().system;
  const VecX diagonal = s.K.diagonal();
  if (!(diagonal.minCoeff() > 0.0)) return false;
  // Every coordinate in units of its own stiffness: soft ones count like stiff ones.
  const VecX unit = diagonal.cwiseSqrt().cwiseInverse();
  const auto scaled = [&](const MatX& A) { return MatX(unit.asDiagonal() * A * unit.asDiagonal()); };
  const MatX K = scaled(s.K), K_open = scaled(s.K_error), D = scaled(s.D), D_open = scaled(s.D_error);
  constexpr double rounding = 1e-12;
  // A skew part may make it flutter, by less than its share in the softest motion.
  constexpr double little = 1e-4;
  const double open = K_open.norm() + rounding * K.norm(), skew = (K - K.transpose()).norm();
  const MatX one = MatX::Identity(K.rows(), K.cols());
  const MatX least = 0.5 * (K + K.transpose()) - (4.0 * open + skew / little) * one;
  const MatX brakes = 0.5 * (D + D.transpose()) + (2.0 * D_open.norm() + rounding * D.norm()) * one;
  const bool damped = !s.D.isZero(0.0);
  return Cholesky(least).info() == Eigen::Success && (!damped || Cholesky(brakes).info() == Eigen::Success);
}

Linearisation linearise(const System& given) {
  System system = given;
  Linearisation out;
  bool with_rates = has_rates(system);
  const bool massless = release_massless(system.model, system.work);
  if (massless) with_rates = with_rates && has_rates(system);
  // Names what moves without inertia though a force drives it; what nothing drives is idle.
  if (!massless) update_accelerations(system.model, system.work);
  const bool idle = system.work.idle;
  const System released = system;
  if (independent_directions(system.model, system.work).empty()) return out;
  auto point = std::make_unique<Point>(system, with_rates);
  Axes axes;
  bool steady = constant_axes(*point, axes);
  if (!steady && with_rates) {
    out.notes.push_back("the initial rates are not a steady motion: linearised about the initial positions at rest");
    system = released;
    point = std::make_unique<Point>(system, false);
    steady = constant_axes(*point, axes);
  }
  out.constant = steady;
  if (!steady) out.notes.emplace_back(equations_change);
  if (!point->just_tight().empty())
    out.warnings.push_back(fmt::format("{} is just as long as its rest, tight or slack by rounding: the modes count it as one of the two",
                                       point->just_tight()));
  out.moving = point->moves();
  out.equilibrium = point->equilibrium();
  out.turning_axes = point->seen_turning(axes);

  SecondOrder s = point->described_in(axes);
  MatX N = point->coefficients().N;
  if (idle) give_idle_inertia(point->directions(), s.M);
  std::vector<ComplexMode> modes;
  bool found = false;
  if (massless) found = follow_massless(given, point->directions(), s, N, modes);
  // Of a motion described in axes that turn the states' equations would change too.
  const bool states_move = !massless && s.K == point->coefficients().system.K;
  say_what_is_held(given.model, states_move, out);
  if (!found) {
    const FurtherStates states = states_move ? point->block_states() : FurtherStates{};
    modes = states.A.rows() > 0 ? complex_modes(s, states) : complex_modes(s);
    for (ComplexMode& m : modes) m.x = N * m.x;
  }
  out.equations = s;
  out.rates = N;
  const VecX sizes = rate_sizes(system.model);
  for (const ComplexMode& m : modes) out.modes.push_back(to_mode(m, sizes));
  std::stable_sort(out.modes.begin(), out.modes.end(), before);
  return out;
}

}  // namespace flexframe::sim
