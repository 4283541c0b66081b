// Shift-invert block Lanczos and deflated conjugate gradients. See fe_solver.h.
#include "sim/reduce/fe_solver.h"

#include "sim/base/eigen_solvers.h"
#include "sim/reduce/dense_products.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace flexframe::sim {
namespace {

// W becomes M-orthonormal, MW = M W with it; W_before = W B. Directions that vanish against `scale` are dropped.
MatX orthonormalise(MatX& W, MatX& MW, double scale) {
  MatX B = MatX::Identity(W.cols(), W.cols());
  for (int pass = 0; pass < 2 && W.cols() > 0; ++pass) {
    const MatX gram = product_tn(W, MW);
    SymmetricEigen eigen(0.5 * (gram + gram.transpose()));
    const VecX& d = eigen.eigenvalues();
    // Below the square root of rounding nothing but rounding is left of a direction.
    const double least = pass == 0 ? 1e-24 * scale * scale : 0.0;
    int keep = 0;
    for (int k = 0; k < d.size(); ++k) keep += d(k) > least && d(k) > 1e-13 * d(d.size() - 1);
    const MatX U = eigen.eigenvectors().rightCols(keep);
    const VecX root = d.tail(keep).cwiseSqrt();
    const MatX S = U * root.cwiseInverse().asDiagonal();
    MatX next = MatX::Zero(W.rows(), keep), next_M = MatX::Zero(W.rows(), keep);
    add_product(next, 1.0, W, S);
    add_product(next_M, 1.0, MW, S);
    W = std::move(next);
    MW = std::move(next_M);
    B = (root.asDiagonal() * U.transpose() * B).eval();
  }
  return B;
}

// The space of block Lanczos: M-orthonormal columns V, and T = V^T M OP V of the operator.
struct Krylov {
  MatX V, T;
  MatX MQ, coupling_before;  // M times the last block; the last block against the one before
  double scale = 0.0;        // length of OP Q

  // Makes the candidates Z M-orthogonal to V and extends T by what was taken off, V^T M Z; MZ becomes M Z.
  void orthogonalise(const SparseMatrix& M, Eigen::Index block, MatX& Z, MatX& MZ) {
    const Eigen::Index m = V.cols(), last = MQ.cols();
    MatX coupling = MatX::Zero(m, Z.cols());
    // The recurrence: against the last two blocks, whose products with M are known.
    if (m > 0) {
      coupling.bottomRows(last) = product_tn(MQ, Z);
      if (coupling_before.size() > 0)
        coupling.middleRows(m - last - coupling_before.cols(), coupling_before.cols()) = coupling_before.transpose();
      const Eigen::Index near = last + coupling_before.cols();
      add_product(Z, -1.0, V.rightCols(near), coupling.bottomRows(near));
    }
    // What rounding leaves of all before.
    MZ = symmetric_product(M, Z);
    // The length of OP Q, of the start alone in the first pass.
    const double length = std::sqrt(std::max(0.0, (Z.cwiseProduct(MZ).colwise().sum() + coupling.cwiseAbs2().colwise().sum()).maxCoeff()));
    scale = m <= block ? length : std::max(scale, length);
    for (int pass = 0; pass < 3 && m > 0; ++pass) {
      const MatX c = product_tn(V, MZ);
      add_product(Z, -1.0, V, c);
      coupling += c;
      // A correction this small against what is left of Z changes M Z by less than the orthogonality asked for.
      if (c.cwiseAbs().maxCoeff() <= 1e-11 * std::sqrt(std::max(0.0, Z.cwiseProduct(MZ).colwise().sum().minCoeff()))) break;
      MZ = symmetric_product(M, Z);
    }
    // The last block column of T: V^T M OP Q.
    if (m > 0) {
      T.conservativeResize(m, m);
      T.rightCols(last) = coupling;
      T.bottomRows(last) = coupling.transpose();
    }
  }

  // Takes the orthonormal block Q in, whose place in what it was made of is B (orthonormalise).
  void extend(const MatX& Q, MatX MQ_new, const MatX& B) {
    const Eigen::Index m = V.cols(), width = Q.cols();
    V.conservativeResize(Q.rows(), m + width);
    V.rightCols(width) = Q;
    T.conservativeResize(m + width, m + width);
    coupling_before = m > 0 ? B : MatX();
    MQ = std::move(MQ_new);
  }
};

double hertz(double eigenvalue) { return std::sqrt(std::max(eigenvalue, 0.0)) / (2.0 * std::numbers::pi); }

}  // namespace

FeSolver::FeSolver(const FeReduced& s, const MatX& rigid, const FeEstimate& guess, int threads, std::function<void()> ask,
                   const std::string& scratch)
    : system(s), R(rigid), estimate(guess.eigenvalue) {
  start.resize(system.size(), guess.fields.cols());
  for (int c = 0; c < system.size(); ++c) start.row(c) = guess.fields.row(system.identity ? c : system.own[c]);
  if (R.cols() > 0) {
    MR = symmetric_product(system.M(), R);
    // Columns of equal weight first: translations and rotations have different units.
    for (int k = 0; k < R.cols(); ++k) {
      const double norm = std::sqrt(R.col(k).dot(MR.col(k)));
      if (!(norm > 0.0)) throw InputError("the model has no mass in one of its rigid motions");
      R.col(k) /= norm;
      MR.col(k) /= norm;
    }
    const Eigen::Index before = R.cols();
    orthonormalise(R, MR, 1.0);
    if (R.cols() != before) throw InputError("the model's rigid motions are not independent: all its nodes lie on one line");
    // A thousandth of the lowest elastic eigenvalue: K + s M is far from singular, and the elastic spectrum is inverted nearly as by K
    // itself.
    shift = 1e-3 * estimate;
  }
  SparseMatrix A = system.K();
  if (shift > 0.0) A += shift * system.M();
  cholesky = std::make_unique<SparseCholesky>(std::move(A), threads, std::move(ask), scratch);
}

void FeSolver::factorise() {
  cholesky->factorise();
  if (shift > 0.0) return;
  // A singular matrix may have a pivot that is rounding instead of zero: then a solution solves nothing. Sound models leave 1e-13 to 1e-5
  // (a beam of 4000 elements), mechanisms more than the whole. Motions without mass may be left: they move nothing.
  constexpr double unsolved = 1e-2, soft = 1e-3;
  MatX b(system.size(), 1);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (double& v : b.reshaped()) v = uniform(random);
  b = symmetric_product(system.M(), b);
  MatX z = b;
  cholesky->solve(z);
  const MatX Kz = symmetric_product(system.K(), z);
  if ((Kz - b).norm() <= unsolved * b.norm()) return;
  const double mass = z.col(0).dot(symmetric_product(system.M(), z).col(0));
  if (!(std::abs(z.col(0).dot(Kz.col(0))) >= soft * estimate * mass))
    throw InputError(
        "the model has a motion without stiffness though its supports hold it: parts that are not connected, shells or beams that turn "
        "on a hinge, or a mechanism");
}

MatX FeSolver::start_block(int width, const std::function<void(MatX&)>& apply, const std::function<void(MatX&)>& project) const {
  MatX Z(system.size(), width);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (double& v : Z.reshaped()) v = uniform(random);
  Z = symmetric_product(system.M(), Z);
  apply(Z);
  for (int k = 0; k < std::min<int>(width, static_cast<int>(start.cols())); ++k) {
    const double length = start.col(k).norm();
    if (!(length > 0.0)) continue;  // a field that is zero wherever the model can move is no guess
    Z.col(k) = Z.col(k) * (0.1 * length / Z.col(k).norm()) + start.col(k);
  }
  Z.colwise().normalize();
  project(Z);
  return Z;
}

void FeSolver::refuse_mechanism(const FeModes& found) const {
  int loose = 0;
  while (loose < found.eigenvalues.size() && found.eigenvalues(loose) < 1e-6 * estimate) ++loose;
  if (loose > 0)
    throw InputError(
        fmt::format("the model has {} motion{} without stiffness besides its {} rigid ones (frequency {:.3g} Hz): parts that are not "
                    "connected, or a mechanism",
                    loose, loose == 1 ? "" : "s", rigid(), hertz(found.eigenvalues(0))));
}

FeModes FeSolver::modes(int count, double eigenvalue_limit, const MatX& hold, const FeProgress& progress) const {
  const int n = system.size();
  const bool free_motion = hold.cols() == 0;
  const int available = n - (free_motion ? rigid() : static_cast<int>(hold.cols()));
  if (count > available)
    throw InputError(fmt::format("{} modes are requested, the model has {}: ask for no more (--modes {})", count, available, available));
  const auto wanted = [&](const VecX& lambda) {
    if (count > 0) return count;
    int below = 0;
    while (below < lambda.size() && lambda(below) <= eigenvalue_limit) ++below;
    return std::min(below + 1, available);
  };

  // Points held: x = A^-1 (b - H S^-1 H^T A^-1 b), A = K + s M, S = H^T A^-1 H.
  MatX flexible_hold;
  Eigen::LDLT<MatX> schur;
  if (!free_motion) {
    flexible_hold = hold;
    cholesky->solve(flexible_hold);
    schur.compute(product_tn(hold, flexible_hold));
  }
  const auto apply = [&](MatX& b) {
    cholesky->solve(b);
    if (free_motion) add_product(b, -1.0, R, product_tn(MR, b));
    else add_product(b, -1.0, flexible_hold, schur.solve(product_tn(hold, b)));
  };

  const auto project = [&](MatX& b) {
    if (free_motion && rigid() > 0) add_product(b, -1.0, R, product_tn(MR, b));
    else if (!free_motion) add_product(b, -1.0, flexible_hold, schur.solve(product_tn(hold, b)));
  };

  const int block = std::max(1, std::min(8, available / 4));
  MatX Z = start_block(block, apply, project);

  Krylov space;
  space.V.resize(n, 0);
  FeModes result;
  for (;;) {
    const int m = static_cast<int>(space.V.cols()), last = static_cast<int>(space.MQ.cols());
    MatX MZ;
    space.orthogonalise(system.M(), block, Z, MZ);
    const MatX B = orthonormalise(Z, MZ, space.scale);
    const bool exhausted = Z.cols() == 0 || m + Z.cols() > available;
    if (m == 0 && Z.cols() == 0)
      throw SimulationError("no elastic mode stands out from rounding errors: the model's mass or stiffness is not positive");

    // Ritz values and their residuals.
    if (m > 0) {
      SymmetricEigen eigen(0.5 * (space.T + space.T.transpose()));
      const VecX theta = eigen.eigenvalues().reverse();
      const MatX S = eigen.eigenvectors().rowwise().reverse();
      const VecX lambda = theta.cwiseMax(1e-300).cwiseInverse().array() - shift;
      const int need = std::min(wanted(lambda), m);
      int converged = 0;
      const bool enough = m >= wanted(lambda);
      for (; converged < need; ++converged) {
        const double residual = exhausted ? 0.0 : (B * S.col(converged).tail(last)).norm();
        // The eigenvalue's relative error is the square of this (1e-12), the vector's this over the relative gap to the next.
        if (residual > 1e-6 * theta(converged)) break;
      }
      if (progress) progress(fmt::format("modes: block {}, {} of {} converged", result.iterations, converged, wanted(lambda)));
      if (exhausted && !enough)
        throw SimulationError(
            fmt::format("only {} of {} modes stand out from rounding errors: ask for no more (--modes {})", m, wanted(lambda), m));
      if ((enough && converged >= need) || exhausted) {
        result.eigenvalues = lambda.head(need);
        result.vectors = MatX::Zero(n, need);
        add_product(result.vectors, 1.0, space.V, S.leftCols(need));
        break;
      }
      if (m > 40 * (need + 10))
        throw SimulationError(fmt::format("the modes do not converge: {} of {} after {} blocks", converged, need, result.iterations));
    }
    MatX next = MZ;
    space.extend(Z, std::move(MZ), B);
    Z = std::move(next);
    apply(Z);
    ++result.iterations;
  }
  if (free_motion && shift > 0.0) refuse_mechanism(result);
  return result;
}

MatX FeSolver::respond(const MatX& p, double eigenvalue, const FeModes* known, double tolerance) const {
  const int k = static_cast<int>(p.cols());
  MatX x = MatX::Zero(p.rows(), k), r = p;
  if (k == 0) return x;
  add_product(r, -1.0, MR, product_tn(R, p));
  const VecX goal = tolerance * r.colwise().norm().transpose();
  if (known && known->vectors.cols() > 0) {
    const MatX share = (known->eigenvalues.array() - eigenvalue).inverse().matrix().asDiagonal() * product_tn(known->vectors, r);
    add_product(x, 1.0, known->vectors, share);
    r -= symmetric_product(system.K(), x);
    if (eigenvalue != 0.0) r += eigenvalue * symmetric_product(system.M(), x);
    add_product(r, -1.0, MR, product_tn(R, r));
  }
  MatX d, z;
  VecX rz(k);
  for (int iteration = 0;; ++iteration) {
    if (((r.colwise().norm().transpose().array()) <= goal.array()).all()) return x;
    if (iteration == 200) {
      // Rounding sets a floor: the residual in the forces, against which displacements are far more exact, may stop above the goal.
      if (((r.colwise().norm().transpose().array()) <= 1e-6 / tolerance * goal.array()).all()) return x;
      throw SimulationError(
          "a static or harmonic response does not converge: the frequency is not below the lowest elastic one, or the model is nearly a "
          "mechanism");
    }
    z = r;
    cholesky->solve(z);
    add_product(z, -1.0, R, product_tn(MR, z));
    const VecX next = (r.cwiseProduct(z)).colwise().sum();
    if (iteration == 0) d = z;
    else
      for (int j = 0; j < k; ++j) d.col(j) = z.col(j) + (rz(j) != 0.0 ? next(j) / rz(j) : 0.0) * d.col(j);
    rz = next;
    MatX q = symmetric_product(system.K(), d);
    if (eigenvalue != 0.0) q -= eigenvalue * symmetric_product(system.M(), d);
    for (int j = 0; j < k; ++j) {
      const double curvature = d.col(j).dot(q.col(j));
      if (!(curvature > 0.0)) continue;  // a zero right-hand side
      const double step = rz(j) / curvature;
      x.col(j) += step * d.col(j);
      r.col(j) -= step * q.col(j);
    }
    add_product(r, -1.0, MR, product_tn(R, r));
  }
}

MatX FeSolver::approximate(MatX p) const {
  cholesky->solve(p);
  if (R.cols() > 0) add_product(p, -1.0, R, product_tn(MR, p));
  return p;
}

FeEstimate estimate_modes(const FeModel& model, const FeSystem& system) {
  Vec3 lower = Vec3::Constant(1e300), upper = Vec3::Constant(-1e300);
  for (size_t i = 0; i < model.nodes.size(); ++i)
    if (moves(system.dof[i])) {
      lower = lower.cwiseMin(model.nodes[i]);
      upper = upper.cwiseMax(model.nodes[i]);
    }
  const Vec3 centre = 0.5 * (lower + upper);
  const double size = std::max(1e-300, 0.5 * (upper - lower).maxCoeff());
  // Monomials 1 x y z xx yy zz xy yz xz in each direction; rotations are half the curl.
  MatX U = MatX::Zero(system.size, 30);
  for (size_t i = 0; i < model.nodes.size(); ++i) {
    if (!moves(system.dof[i])) continue;
    const Vec3 x = (model.nodes[i] - centre) / size;
    const double f[10] = {1, x.x(), x.y(), x.z(), x.x() * x.x(), x.y() * x.y(), x.z() * x.z(), x.x() * x.y(), x.y() * x.z(), x.x() * x.z()};
    const Vec3 g[10] = {Vec3::Zero(),          Vec3::UnitX(),         Vec3::UnitY(),         Vec3::UnitZ(),         Vec3(2 * x.x(), 0, 0),
                        Vec3(0, 2 * x.y(), 0), Vec3(0, 0, 2 * x.z()), Vec3(x.y(), x.x(), 0), Vec3(0, x.z(), x.y()), Vec3(x.z(), 0, x.x())};
    for (int k = 0; k < 10; ++k)
      for (int d = 0; d < 3; ++d) {
        if (system.dof[i][d] >= 0) U(system.dof[i][d], 3 * k + d) = f[k];
        const Vec3 turn = 0.5 / size * g[k].cross(Vec3::Unit(d));
        for (int r = 0; r < 3; ++r)
          if (system.dof[i][3 + r] >= 0) U(system.dof[i][3 + r], 3 * k + d) = turn(r);
      }
  }
  const MatX K = product_tn(U, symmetric_product(system.K, U)), M = product_tn(U, symmetric_product(system.M, U));
  if (!K.allFinite() || !M.allFinite())
    throw InputError(fmt::format("{}: its numbers are too large or too small to compute with; check the units", model.file));
  // Fields that vanish on flat or straight models are left out.
  SymmetricEigen mass(0.5 * (M + M.transpose()));
  const double most = mass.eigenvalues()(29);
  int keep = 0;
  for (int k = 0; k < 30; ++k) keep += mass.eigenvalues()(k) > 1e-9 * most;
  if (keep == 0 || !(most > 0.0)) throw InputError(fmt::format("{}: the model has no mass", model.file));
  const MatX S = mass.eigenvectors().rightCols(keep) * mass.eigenvalues().tail(keep).cwiseSqrt().cwiseInverse().asDiagonal();
  SymmetricEigen ritz(S.transpose() * (0.5 * (K + K.transpose())) * S);
  const VecX& values = ritz.eigenvalues();
  FeEstimate out;
  int first = std::min(6, keep - 1);
  while (first < keep - 1 && !(values(first) > 1e-9 * values(keep - 1))) ++first;
  out.eigenvalue = values(first) > 1e-9 * values(keep - 1) ? values(first) : std::max(values(keep - 1), 1.0);
  const int count = std::min(8, keep - first);
  out.fields = MatX::Zero(system.size, count);
  add_product(out.fields, 1.0, U, S * ritz.eigenvectors().middleCols(first, count));
  return out;
}

}  // namespace flexframe::sim
