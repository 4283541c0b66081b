#include "sim/linearise.h"

#include "sim/dynamics.h"
#include "sim/joint_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::sim {
namespace {

// Independent rates of all clusters: index in w_all, owner, and the step that makes a difference of it.
struct Direction {
  int v = 0, part = 0, rate = -1;  // rate >= 0: of the part's joint, else elastic coordinate -1 - rate
  double step = 0.0;
};

std::vector<Direction> directions(const System& system) {
  const Model& model = system.model;
  std::vector<Direction> out;
  for (size_t c = 0; c < model.clusters.size(); ++c)
    for (int k : system.work.clusters[c].partition.ind) {
      const int v = model.clusters[c].v0 + k;
      for (size_t i = 0; i < model.parts.size(); ++i) {
        const Part& p = model.parts[i];
        if (v >= p.v0 && v < p.v0 + p.joint.nv) out.push_back({v, static_cast<int>(i), v - p.v0, 0.0});
        if (v >= p.ev0 && v < p.ev0 + p.body.n) out.push_back({v, static_cast<int>(i), -1 - (v - p.ev0), 0.0});
      }
    }
  // 1e-5 of a radian, or of the mechanism: the truncation of central differences (1e-10) balances their rounding.
  for (Direction& d : out) {
    const Part& p = model.parts[d.part];
    const double size = model.clusters[p.cluster].size;
    d.step = 1e-5;
    if (d.rate >= 0) {
      if (p.joint.kind == JointKind::prismatic) d.step *= size;
    } else {
      double reach = 0.0;
      for (const FlexibleNode& node : p.body.nodes) reach = std::max(reach, node.phi.col(-1 - d.rate).norm());
      d.step *= size / std::max(reach, 1e-300);
      if (reach == 0.0) d.step = 1e-5;
    }
  }
  return out;
}

void move(System& system, const Direction& d, double step) {
  const Part& p = system.model.parts[d.part];
  if (d.rate >= 0) {
    double dw[6] = {};
    dw[d.rate] = step;
    move_coordinates(p.joint.kind, system.work.q.data() + p.q0, dw);
  } else {
    system.work.q[p.eq0 - 1 - d.rate] += step;
  }
}

VecX accelerations(System& system, const std::vector<Direction>& all) {
  update_positions(system.model, system.work);
  update_velocities(system.model, system.work);
  update_accelerations(system.model, system.work);
  VecX out(all.size());
  for (size_t k = 0; k < all.size(); ++k) out[static_cast<Eigen::Index>(k)] = system.work.wdot[all[k].v];
  return out;
}

}  // namespace

Linearisation linearise(System system) {
  Model& model = system.model;
  Work& work = system.work;
  const std::vector<Direction> all = directions(system);
  const Eigen::Index n = static_cast<Eigen::Index>(all.size());
  Linearisation out;
  if (n == 0) return out;
  update_expressions(model, 0.0, work);
  for (TimeJet& jet : work.motion) jet.rate = jet.acceleration = 0.0;
  work.w.setZero();

  const VecX start = accelerations(system, all);
  // Mass and damping matrix from the rates that unit independent rates make; elastic stiffness likewise.
  MatX N = MatX::Zero(model.nv, n);
  std::vector<MatX> twist(model.parts.size(), MatX::Zero(6, n));
  for (Eigen::Index k = 0; k < n; ++k) {
    work.w.setZero();
    work.w[all[static_cast<size_t>(k)].v] = 1.0;
    update_velocities(model, work);
    N.col(k) = work.w;
    for (size_t i = 0; i < model.parts.size(); ++i) twist[i].col(k) = work.parts[i].V;
  }
  work.w.setZero();
  MatX M = MatX::Zero(n, n), K = M, D = M;
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& p = model.parts[i];
    const BodyTerms& t = work.parts[i].terms;
    M += twist[i].transpose() * t.Mrr * twist[i];
    for (int k = 0; k < p.joint.nv; ++k) {
      double d = p.joint.spring ? p.joint.spring->damping : 0.0;
      if (p.joint.bending_damping.size() > k) d += p.joint.bending_damping[k];
      D += d * N.row(p.v0 + k).transpose() * N.row(p.v0 + k);
    }
    if (p.body.n == 0) continue;
    const MatX e = N.middleRows(p.ev0, p.body.n);
    const MatX coupling = twist[i].transpose() * t.Mre * e;
    M += coupling + coupling.transpose() + e.transpose() * p.body.Me * e;
    K += e.transpose() * p.body.Ke * e;
    if (p.body.De.size() > 0) D += e.transpose() * p.body.De * e;
  }

  // Everything else by differences, with the elastic stiffness taken out so that it cannot drown the rest.
  for (Part& p : model.parts) {
    p.body.Ke.setZero();
    p.body.stiffness.resize(0);
  }
  const VecX rest = work.q;
  MatX A(n, n);
  double largest = 0.0;
  for (Eigen::Index k = 0; k < n; ++k) {
    const Direction& d = all[static_cast<size_t>(k)];
    move(system, d, d.step);
    const VecX up = accelerations(system, all);
    work.q = rest;
    move(system, d, -d.step);
    const VecX down = accelerations(system, all);
    work.q = rest;
    A.col(k) = (up - down) / (2.0 * d.step);
    largest = std::max({largest, up.cwiseAbs().maxCoeff(), down.cwiseAbs().maxCoeff()});
  }
  if (largest > 0.0) {
    const MatX S = M * A;
    K -= 0.5 * (S + S.transpose());
  }

  // Scaled to a unit diagonal of M, whose entries may differ by many orders.
  const VecX scale = M.diagonal().cwiseSqrt().cwiseInverse();
  const MatX Ms = scale.asDiagonal() * M * scale.asDiagonal(), Ks = scale.asDiagonal() * K * scale.asDiagonal();
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatX> eigen(Ks, Ms);
  if (eigen.info() != Eigen::Success) throw SimulationError("the frequencies cannot be computed: the mass matrix is not positive definite");
  const double top = eigen.eigenvalues().cwiseAbs().maxCoeff();
  for (Eigen::Index k = 0; k < n; ++k) {
    LinearMode mode;
    const double lambda = eigen.eigenvalues()[k];
    const VecX x = scale.asDiagonal() * eigen.eigenvectors().col(k);
    // Below the solver's rounding an eigenvalue is zero: a rigid mode.
    const double zero = 1e-14 * static_cast<double>(n) * top;
    if (lambda > zero) mode.frequency = std::sqrt(lambda) / (2.0 * std::numbers::pi);
    else if (lambda < -zero) mode.growth = std::sqrt(-lambda);
    if (lambda > zero) mode.damping = x.dot(D * x) / (2.0 * std::sqrt(lambda) * x.dot(M * x));
    mode.shape = N * x;
    const double peak = mode.shape.cwiseAbs().maxCoeff();
    if (peak > 0.0) mode.shape /= peak;
    out.modes.push_back(mode);
  }
  out.equilibrium = start.cwiseAbs().maxCoeff() <= 1e-9 * std::max(1.0, model.settings.gravity.norm());
  return out;
}

}  // namespace flexframe::sim
