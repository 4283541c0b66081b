#include "sim/linearise.h"

#include "sim/directions.h"
#include "sim/dynamics.h"
#include "sim/eigen_solvers.h"
#include "sim/flexures.h"
#include "sim/joint_motion.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace flexframe::sim {
namespace {

VecX accelerations(System& system, const std::vector<Direction>& all) {
  update_positions(system.model, system.work);
  update_velocities(system.model, system.work);
  update_accelerations(system.model, system.work);
  VecX out(all.size());
  for (size_t k = 0; k < all.size(); ++k) out[static_cast<Eigen::Index>(k)] = system.work.wdot[all[k].v];
  return out;
}

// Velocity terms that the steady motion makes, -M d(accelerations)/d(rates); damping is left out. The terms are linear in the rates
// beside quadratic ones, which central differences cancel.
MatX gyroscopic_matrix(System& system, const std::vector<Direction>& all, const MatX& M) {
  Model& model = system.model;
  for (Part& p : model.parts) {
    p.body.De.resize(0, 0);
    if (p.joint.spring) p.joint.spring->damping = 0.0;
  }
  const Eigen::Index n = M.rows();
  MatX A(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto with = [&](double rate) {
      system.work.w.setZero();
      system.work.w[all[static_cast<size_t>(k)].v] = rate;
      return accelerations(system, all);
    };
    A.col(k) = 0.5 * (with(1.0) - with(-1.0));
  }
  system.work.w.setZero();
  return -M * A;
}

// Modes of M x'' + C x' + K x = 0 with any C, as a first-order system in coordinates in which M is 1.
void turning_modes(const MatX& M, const MatX& K, const MatX& C, const MatX& N, Linearisation& out) {
  const Eigen::Index n = M.rows();
  const Eigen::LLT<MatX> llt(M);
  if (llt.info() != Eigen::Success) throw SimulationError("the frequencies cannot be computed: the mass matrix is not positive definite");
  const auto congruent = [&](const MatX& A) {
    const MatX left = llt.matrixL().solve(A);
    return MatX(llt.matrixL().solve(left.transpose()).transpose());
  };
  MatX A = MatX::Zero(2 * n, 2 * n);
  A.topRightCorner(n, n).setIdentity();
  A.bottomLeftCorner(n, n) = -congruent(K);
  A.bottomRightCorner(n, n) = -congruent(C);
  const ComplexEigen eigen(A);
  if (eigen.info() != Eigen::Success) throw SimulationError("the frequencies of the turning mechanism cannot be computed");
  // Below the solver's rounding an eigenvalue is zero: a rigid mode, which comes as a pair.
  const double zero = 1e-10 * eigen.eigenvalues().cwiseAbs().maxCoeff();
  int rigid = 0;
  for (Eigen::Index k = 0; k < 2 * n; ++k) {
    const std::complex<double> lambda = eigen.eigenvalues()[k];
    LinearMode mode;
    if (std::abs(lambda) <= zero) {
      if (rigid++ % 2 == 1) continue;
    } else if (std::abs(lambda.imag()) <= zero) {
      if (lambda.real() <= 0.0) continue;
      mode.growth = lambda.real();
    } else {
      if (lambda.imag() < 0.0) continue;
      mode.frequency = std::abs(lambda) / (2.0 * std::numbers::pi);
      mode.damping = -lambda.real() / std::abs(lambda);
    }
    const Eigen::VectorXcd x = eigen.eigenvectors().col(k).head(n);
    Eigen::Index at = 0;
    x.cwiseAbs().maxCoeff(&at);
    const VecX shape = llt.matrixU().solve(VecX((x / x[at]).real()));
    mode.shape = N * shape;
    const double peak = mode.shape.cwiseAbs().maxCoeff();
    if (peak > 0.0) mode.shape /= peak;
    out.modes.push_back(mode);
  }
  std::sort(out.modes.begin(), out.modes.end(), [](const LinearMode& a, const LinearMode& b) {
    if ((a.growth > 0.0) != (b.growth > 0.0)) return a.growth > 0.0;
    return a.frequency < b.frequency;
  });
}

}  // namespace

Linearisation linearise(System system) {
  Model& model = system.model;
  Work& work = system.work;
  const std::vector<Direction> all = independent_directions(model, work);
  const Eigen::Index n = static_cast<Eigen::Index>(all.size());
  Linearisation out;
  if (n == 0) return out;
  update_expressions(model, 0.0, work);
  bool rotating = false;
  for (TimeJet& jet : work.motion) {
    rotating = rotating || jet.rate != 0.0;
    jet.acceleration = 0.0;
  }
  work.w.setZero();
  const VecX start = accelerations(system, all);
  std::vector<double> steady;
  for (TimeJet& jet : work.motion) {
    steady.push_back(jet.rate);
    jet.rate = 0.0;
  }
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
  for (size_t i = 0; i < steady.size(); ++i) work.motion[i].rate = steady[i];
  MatX M = MatX::Zero(n, n), K = M, D = M;
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& p = model.parts[i];
    const BodyTerms& t = work.parts[i].terms;
    M += twist[i].transpose() * t.Mrr * twist[i];
    for (int k = 0; k < p.joint.nv; ++k) {
      const double d = p.joint.spring ? p.joint.spring->damping : 0.0;
      D += d * N.row(p.v0 + k).transpose() * N.row(p.v0 + k);
    }
    if (p.body.n == 0) continue;
    const MatX e = N.middleRows(p.ev0, p.body.n);
    const MatX coupling = twist[i].transpose() * t.Mre * e;
    M += coupling + coupling.transpose() + e.transpose() * elastic_mass(p.body, t) * e;
    K += e.transpose() * p.body.Ke * e;
    if (p.body.De.size() > 0) D += e.transpose() * p.body.De * e;
  }

  add_flexure_matrices(model, N, K, D);
  // What turns without inertia and without a moment is a rigid mode, with any inertia.
  if (work.idle) {
    VecX metres(n);
    for (Eigen::Index k = 0; k < n; ++k) metres[k] = all[static_cast<size_t>(k)].scale;
    const VecX unit = metres.cwiseInverse();
    const SymmetricEigen inertia(MatX(unit.asDiagonal() * M * unit.asDiagonal()));
    const double most = inertia.eigenvalues()[n - 1];
    for (Eigen::Index k = 0; k < n && inertia.eigenvalues()[k] <= 1e-14 * most; ++k) {
      const VecX u = metres.cwiseProduct(inertia.eigenvectors().col(k));
      M += most * u * u.transpose();
    }
  }

  // Everything else by differences, with the elastic stiffness taken out so that it cannot drown the rest: the elastic forces of the
  // state stay as constants, which keeps an equilibrium one.
  hold_flexures(model, work);
  for (size_t i = 0; i < model.parts.size(); ++i) {
    Part& p = model.parts[i];
    if (p.body.n == 0) continue;
    VecX force = p.body.Ke * work.parts[i].q;
    if (p.body.ksigma.size() > 0) force += p.body.ksigma;
    p.body.ksigma = force;
    p.body.Ke.setZero();
    p.body.stiffness.resize(0);
  }
  const VecX rest = work.q;
  MatX A(n, n);
  double largest = 0.0;
  for (Eigen::Index k = 0; k < n; ++k) {
    const Direction& d = all[static_cast<size_t>(k)];
    // 1e-5 of a radian, or of the mechanism: the truncation of central differences (1e-10) balances their rounding.
    const double step = 1e-5 * model.clusters[model.parts[d.part].cluster].size / d.scale;
    move_along(model, d, step, work);
    const VecX up = accelerations(system, all);
    work.q = rest;
    move_along(model, d, -step, work);
    const VecX down = accelerations(system, all);
    work.q = rest;
    A.col(k) = (up - down) / (2.0 * step);
    largest = std::max({largest, up.cwiseAbs().maxCoeff(), down.cwiseAbs().maxCoeff()});
  }
  if (largest > 0.0) {
    const MatX S = M * A;
    K -= 0.5 * (S + S.transpose());
  }

  const double free_fall = 1e-9 * std::max(1.0, model.settings.gravity.norm());
  out.equilibrium = start.cwiseAbs().maxCoeff() <= free_fall;
  if (rotating) {
    turning_modes(M, K, D + gyroscopic_matrix(system, all, M), N, out);
    return out;
  }

  // Scaled to a unit diagonal of M, whose entries may differ by many orders.
  const VecX scale = M.diagonal().cwiseSqrt().cwiseInverse();
  const MatX Ms = scale.asDiagonal() * M * scale.asDiagonal(), Ks = scale.asDiagonal() * K * scale.asDiagonal();
  const GeneralizedEigen eigen(Ks, Ms);
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
  return out;
}

}  // namespace flexframe::sim
