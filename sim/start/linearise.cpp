#include "sim/start/linearise.h"

#include "sim/base/eigen_solvers.h"
#include "sim/dynamics/directions.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/flexures.h"
#include "sim/dynamics/inverse_dynamics.h"
#include "sim/model/joint_motion.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace flexframe::sim {
namespace {

// What the state's forces do along the independent directions: accelerations, or, where something has no mass (forces), the forces themselves.
VecX response(System& system, const std::vector<Direction>& all, bool forces) {
  update_positions(system.model, system.work);
  update_velocities(system.model, system.work);
  RestForces rest;
  if (forces) rest_forces(system.model, system.work, nullptr, rest);
  else update_accelerations(system.model, system.work);
  VecX out(all.size());
  for (size_t k = 0; k < all.size(); ++k) out[static_cast<Eigen::Index>(k)] = (forces ? rest.force : system.work.wdot)[all[k].v];
  return out;
}

// Damping of joints, of springs and bushings between frames, of stops and loops: forces against the rates N that unit rates make.
MatX damping_matrix(System& system, const std::vector<Direction>& all, const MatX& N) {
  Work& work = system.work;
  MatX D(N.cols(), N.cols());
  RestForces rest;
  for (Eigen::Index k = 0; k < N.cols(); ++k) {
    const auto with = [&](double rate) {
      work.w.setZero();
      work.w[all[static_cast<size_t>(k)].v] = rate;
      update_velocities(system.model, work);
      applied_forces(system.model, work, rest);
      return VecX(N.transpose() * rest.force);
    };
    D.col(k) = 0.5 * (with(-1.0) - with(1.0));
  }
  work.w.setZero();
  return 0.5 * (D + D.transpose());
}

// Velocity terms that the steady motion makes, -M d(accelerations)/d(rates); damping is left out. The terms are linear in the rates
// beside quadratic ones, which central differences cancel.
MatX gyroscopic_matrix(System& system, const std::vector<Direction>& all, const MatX& M, bool forces) {
  Model& model = system.model;
  for (Part& p : model.parts) {
    p.body.De.resize(0, 0);
    if (p.joint.spring) p.joint.spring->damping = 0.0;
  }
  for (LoopJoint& loop : model.loops)
    if (loop.spring) loop.spring->damping = 0.0;
  for (Load& load : model.loads) {
    load.def.spring.damping = 0.0;
    load.def.bushing_damping.setZero();
  }
  const Eigen::Index n = M.rows();
  MatX A(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto with = [&](double rate) {
      system.work.w.setZero();
      system.work.w[all[static_cast<size_t>(k)].v] = rate;
      return response(system, all, forces);
    };
    A.col(k) = 0.5 * (with(1.0) - with(-1.0));
  }
  system.work.w.setZero();
  return forces ? MatX(-A) : MatX(-M * A);
}

// Vibrations and unstable poles of z' = A z; shape(z): rates of w_all. What only decays is no mode of vibration.
template <class Shape>
void add_modes(const MatX& A, Shape&& shape, Linearisation& out) {
  const ComplexEigen eigen(A);
  if (eigen.info() != Eigen::Success) throw SimulationError("the frequencies of the damped or turning mechanism cannot be computed");
  // Below the solver's rounding an eigenvalue is zero: a rigid mode, which comes as a pair.
  const double zero = 1e-10 * eigen.eigenvalues().cwiseAbs().maxCoeff();
  int rigid = 0;
  for (Eigen::Index k = 0; k < A.cols(); ++k) {
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
    mode.shape = shape(Eigen::VectorXcd(eigen.eigenvectors().col(k)));
    const double peak = mode.shape.cwiseAbs().maxCoeff();
    if (peak > 0.0) mode.shape /= peak;
    out.modes.push_back(mode);
  }
  std::sort(out.modes.begin(), out.modes.end(), [](const LinearMode& a, const LinearMode& b) {
    if ((a.growth > 0.0) != (b.growth > 0.0)) return a.growth > 0.0;
    return a.frequency < b.frequency;
  });
}

// Real part of a complex shape whose largest entry is real.
VecX real_shape(const Eigen::VectorXcd& x) {
  Eigen::Index at = 0;
  x.cwiseAbs().maxCoeff(&at);
  return (x / x[at]).real();
}

// What has no mass follows the rest: by springs alone (columns `stiff` of directions) as their stiffness lets it, which leaves M, K, D and N of the
// others; where dampers act (columns `damped`) in first order, and the modes are found here. True if they were.
bool follow_massless(const MatX& masses, const MatX& stiff, const MatX& damped, MatX& M, MatX& K, MatX& D, MatX& N, Linearisation& out) {
  MatX others(N.cols(), masses.cols() + damped.cols());
  others << masses, damped;
  if (stiff.cols() > 0) others -= (stiff * solve_square(stiff.transpose() * K * stiff, stiff.transpose() * K * others)).eval();
  const MatX Mo = others.transpose() * M * others, Ko = others.transpose() * K * others, Do = others.transpose() * D * others, No = N * others;
  const Eigen::Index n = masses.cols(), f = damped.cols();
  M = Mo.topLeftCorner(n, n);
  K = Ko.topLeftCorner(n, n);
  D = Do.topLeftCorner(n, n);
  N = No.leftCols(n);
  if (f == 0) return false;
  // z = [x; x'; coordinates of what is damped].
  MatX A = MatX::Zero(2 * n + f, 2 * n + f);
  A.block(0, n, n, n).setIdentity();
  MatX follow(f, 2 * n + f), pull(n, 2 * n + f);
  follow << Ko.bottomLeftCorner(f, n), Do.bottomLeftCorner(f, n), Ko.bottomRightCorner(f, f);
  A.bottomRows(f) = -solve_square(Do.bottomRightCorner(f, f), follow);
  pull << K, D, Ko.topRightCorner(n, f);
  if (n > 0) A.middleRows(n, n) = -Cholesky(M).solve(pull + Do.topRightCorner(n, f) * A.bottomRows(f));
  add_modes(A, [&](const Eigen::VectorXcd& z) {
    Eigen::VectorXcd x(n + f);
    x << z.head(n), z.tail(f);
    return VecX(No * real_shape(x));
  }, out);
  return true;
}

// Modes of M x'' + C x' + K x = 0 with any C, as a first-order system in coordinates in which M is 1.
void turning_modes(const MatX& M, const MatX& K, const MatX& C, const MatX& N, Linearisation& out) {
  const Eigen::Index n = M.rows();
  const Cholesky mass(M);
  if (mass.info() != Eigen::Success) throw SimulationError("the frequencies cannot be computed: the mass matrix is not positive definite");
  const auto congruent = [&](const MatX& A) {
    const MatX left = mass.solve_lower(A);
    return MatX(mass.solve_lower(left.transpose()).transpose());
  };
  MatX A = MatX::Zero(2 * n, 2 * n);
  A.topRightCorner(n, n).setIdentity();
  A.bottomLeftCorner(n, n) = -congruent(K);
  A.bottomRightCorner(n, n) = -congruent(C);
  add_modes(A, [&](const Eigen::VectorXcd& z) { return VecX(N * mass.solve_lower_transposed(real_shape(z.head(n)))); }, out);
}

// What massless.h locks stands among the independent rates again.
void release(Model& model, Work& work) {
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    ClusterWork& cw = work.clusters[c];
    if (cw.carried == 0) continue;
    cw.locked.clear();
    cw.carried = 0;
    cw.lock_value.resize(0);
    cw.lock_rate.resize(0);
    cw.residual.resize(0);
    cw.G.resize(0, 0);
    cw.partition = {};
    for (int k = 0; k < model.clusters[c].nv; ++k) cw.partition.ind.push_back(k);
  }
  model.massless = {};
}

}  // namespace

Linearisation linearise(System system) {
  Model& model = system.model;
  Work& work = system.work;
  const MasslessRates massless = model.massless;
  const bool forces = !massless.rates.empty();
  if (forces) release(model, work);
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
  const VecX start = response(system, all, forces);
  std::vector<double> steady;
  steady.reserve(work.motion.size());
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
    if (p.body.n == 0) continue;
    const MatX e = N.middleRows(p.ev0, p.body.n);
    const MatX coupling = twist[i].transpose() * t.Mre * e;
    M += coupling + coupling.transpose() + e.transpose() * elastic_mass(p.body, t) * e;
    K += e.transpose() * p.body.Ke * e;
    if (p.body.De.size() > 0) D += e.transpose() * p.body.De * e;
  }

  D += damping_matrix(system, all, N);
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
    const VecX up = response(system, all, forces);
    work.q = rest;
    move_along(model, d, -step, work);
    const VecX down = response(system, all, forces);
    work.q = rest;
    A.col(k) = (up - down) / (2.0 * step);
    largest = std::max({largest, up.cwiseAbs().maxCoeff(), down.cwiseAbs().maxCoeff()});
  }
  if (largest > 0.0) {
    const MatX S = forces ? A : MatX(M * A);
    K -= 0.5 * (S + S.transpose());
  }

  const double free_fall = 1e-9 * std::max(1.0, model.settings.gravity.norm());
  out.equilibrium = start.cwiseAbs().maxCoeff() <= free_fall * (forces ? model.mass : 1.0);
  if (rotating) D += gyroscopic_matrix(system, all, M, forces);
  if (forces) {
    // Directions: those that keep their rates, and those without mass, of which the ones that nothing acts on rest.
    MatX Z(n, massless.moving), masses = MatX::Zero(n, n - static_cast<Eigen::Index>(massless.rates.size()));
    for (Eigen::Index k = 0, at = 0; k < n; ++k) {
      const int v = all[static_cast<size_t>(k)].v;
      Z.row(k) = massless.Z.row(v).leftCols(massless.moving);
      if (std::find(massless.rates.begin(), massless.rates.end(), v) == massless.rates.end()) masses(k, at++) = 1.0;
    }
    const MasslessWork& split = work.massless;
    MatX damped(n, static_cast<Eigen::Index>(split.damped.size()));
    for (size_t k = 0; k < split.damped.size(); ++k) damped.col(static_cast<Eigen::Index>(k)) = Z.col(split.damped[k]);
    if (follow_massless(masses, split.stiff.empty() ? MatX(n, 0) : MatX(Z * split.undamped), damped, M, K, D, N, out)) return out;
    if (M.rows() == 0) return out;
  }
  if (rotating) {
    turning_modes(M, K, D, N, out);
    return out;
  }

  // Scaled to a unit diagonal of M, whose entries may differ by many orders.
  const VecX scale = M.diagonal().cwiseSqrt().cwiseInverse();
  const MatX Ms = scale.asDiagonal() * M * scale.asDiagonal(), Ks = scale.asDiagonal() * K * scale.asDiagonal();
  const GeneralizedEigen eigen(Ks, Ms);
  if (eigen.info() != Eigen::Success) throw SimulationError("the frequencies cannot be computed: the mass matrix is not positive definite");
  const double top = eigen.eigenvalues().cwiseAbs().maxCoeff();
  for (Eigen::Index k = 0; k < M.rows(); ++k) {
    LinearMode mode;
    const double lambda = eigen.eigenvalues()[k];
    const VecX x = scale.asDiagonal() * eigen.eigenvectors().col(k);
    // Below the solver's rounding an eigenvalue is zero: a rigid mode.
    const double zero = 1e-14 * static_cast<double>(M.rows()) * top;
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
