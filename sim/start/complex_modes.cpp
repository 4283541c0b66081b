#include "sim/start/complex_modes.h"

#include "sim/base/eigen_solvers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

namespace flexframe::sim {
namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();
// First-order bounds are estimates, and half of what splits a double eigenvalue: what is within so many of them is not told from zero.
constexpr double margin = 16.0;
// Real parts that are not known to this share are looked at again, where what is unknown matters: that costs a factorisation a root, half
// of the time of large mechanisms, and a damping ratio of a thousandth of a millionth is none.
constexpr double hidden = 1e-3, no_damping = 1e-9;

// Undamped modes: Phi^T M Phi = 1, Phi^T K Phi = diag(square).
struct UndampedModes {
  MatX Phi;
  VecX square;
};

// Solves for the modes that the columns of B span.
UndampedModes solve_within(const MatX& M, const MatX& K, const MatX& B) {
  MatX m = B.transpose() * M * B, k = B.transpose() * K * B;
  // Unit diagonal of the mass matrix, whose entries may differ by many orders.
  const VecX unit = m.diagonal().cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt().cwiseInverse();
  m = unit.asDiagonal() * m * unit.asDiagonal();
  k = unit.asDiagonal() * k * unit.asDiagonal();
  const GeneralizedEigen eigen(0.5 * (k + k.transpose()), 0.5 * (m + m.transpose()));
  if (eigen.info() != Eigen::Success) throw SimulationError("the frequencies cannot be computed: the mass matrix is not positive definite");
  return {B * unit.asDiagonal() * eigen.eigenvectors(), eigen.eigenvalues()};
}

// A symmetric solver knows eigenvalues to eps times the largest. Those far below it are found again in the space of their own vectors, from
// which the first order of the others is taken out.
UndampedModes undamped_modes(const MatX& M, const MatX& K) {
  const Eigen::Index n = M.rows();
  UndampedModes all = solve_within(M, K, MatX::Identity(n, n));
  std::vector<Eigen::Index> low(n);
  std::iota(low.begin(), low.end(), 0);
  for (int level = 0; level < 8; ++level) {
    double top = 0.0;
    for (const Eigen::Index k : low) top = std::max(top, std::abs(all.square[k]));
    std::vector<Eigen::Index> high, next;
    for (const Eigen::Index k : low) (std::abs(all.square[k]) > 1e-8 * top ? high : next).push_back(k);
    if (next.empty() || high.empty()) break;
    const MatX H = all.Phi(Eigen::all, high), L = all.Phi(Eigen::all, next);
    const VecX squares = all.square(high);
    const MatX B = L - H * (squares.cwiseInverse().asDiagonal() * (H.transpose() * K * L));
    const UndampedModes again = solve_within(M, K, B);
    for (size_t i = 0; i < next.size(); ++i) {
      all.Phi.col(next[i]) = again.Phi.col(static_cast<Eigen::Index>(i));
      all.square[next[i]] = again.square[static_cast<Eigen::Index>(i)];
    }
    low = next;
  }
  return all;
}

Eigen::VectorXcd unit_peak(const Eigen::VectorXcd& x) {
  Eigen::Index at = 0;
  if (x.size() == 0 || !(x.cwiseAbs().maxCoeff(&at) > 0.0)) return x;
  return x / x[at];
}

// x'' + d x' + k x = 0.
void add_single(double d, double k, double d_error, double k_error, const VecX& shape, std::vector<ComplexMode>& out) {
  if (std::abs(d) <= margin * d_error) d = 0.0;
  if (std::abs(k) <= margin * k_error) k = 0.0;
  const Eigen::VectorXcd x = unit_peak(shape.cast<std::complex<double>>());
  if (k == 0.0) {
    out.push_back({0.0, std::sqrt(k_error), x});
    if (d != 0.0) out.push_back({-d, d_error + k_error / std::abs(d), x});
    return;
  }
  const double disc = 0.25 * d * d - k;
  if (disc < 0.0) {
    const double im = std::sqrt(-disc);
    out.push_back({{-0.5 * d, im}, 0.5 * d_error + 0.5 * k_error / im, x});
    return;
  }
  // Without damping the growing motion stands for the pair.
  if (d == 0.0) {
    out.push_back({std::sqrt(-k), 0.5 * k_error / std::sqrt(-k), x});
    return;
  }
  const double far = -(0.5 * d + std::copysign(std::sqrt(disc), d)), near = k / far;
  const double gap = std::max(std::abs(far - near), std::sqrt(k_error + std::abs(far) * d_error));
  for (const double lambda : {near, far}) out.push_back({lambda, gap > 0.0 ? (k_error + std::abs(lambda) * d_error) / gap : 0.0, x});
}

// From a vector of a first-order system to its displacements, in coordinates whose units are alike.
using Displacements = std::function<Eigen::VectorXcd(const Eigen::VectorXcd&)>;

// An eigenvalue and its displacements, and those found again from the equations of second order (empty: it does not converge).
struct Root {
  std::complex<double> lambda;
  double error = 0.0;
  Eigen::VectorXcd x;
};
using Refine = std::function<std::optional<Root>(const Root&)>;

// Whether it is one of these: the same eigenvalue with the same displacements.
bool again(const Root& root, const std::vector<Root>& found) {
  return std::any_of(found.begin(), found.end(), [&](const Root& other) {
    return std::abs(root.lambda - other.lambda) <= margin * (root.error + other.error) &&
           std::abs(root.x.dot(other.x)) > 0.99 * root.x.norm() * other.x.norm();
  });
}

// Eigenvalues of A, known to E entry by entry. Shapes: basis times the displacements.
void add_general(const MatX& A, const MatX& E, const Displacements& displacements, const MatX& basis, std::vector<ComplexMode>& out,
                 const Refine& refine = {}) {
  const ComplexEigen eigen(A);
  if (eigen.info() != Eigen::Success)
    throw SimulationError("the frequencies of the damped or turning mechanism cannot be computed: the eigenvalue solver does not converge");
  const Eigen::MatrixXcd& R = eigen.eigenvectors();
  const Eigen::MatrixXcd L = eigen.left_eigenvectors();
  // Backward error of the solver (Golub and Van Loan, Matrix Computations, sec. 7.5: a small multiple of n eps |A|).
  const double size = A.norm(), solver = 4.0 * eps * static_cast<double>(A.rows()) * size;
  // The zero eigenvalues' displacements: of a double one both vectors are the same.
  std::vector<Eigen::VectorXcd> still;
  std::vector<Root> refined_roots;
  double still_error = 0.0;
  for (Eigen::Index k = 0; k < A.cols(); ++k) {
    std::complex<double> lambda = eigen.eigenvalues()[k];
    const VecX right = R.col(k).cwiseAbs(), left = L.row(k).cwiseAbs().transpose();
    double error = left.allFinite() ? left.dot(E * right) + solver * left.norm() * right.norm() : 0.0;
    // Where the vectors have run together the bound is that of a double eigenvalue.
    const double split = std::sqrt(size * (solver + E.norm()));
    error = left.allFinite() ? std::min(error, split) : split;
    if (std::abs(lambda) <= margin * error) {
      still.push_back(displacements(R.col(k)));
      still_error = std::max(still_error, error);
      continue;
    }
    if (lambda.imag() < -margin * error) continue;
    Root root{lambda, error, displacements(R.col(k))};
    // The solver errs by its rounding of the largest entry, which may hide the damping of a slow mode.
    if (refine && margin * error > std::max(hidden * std::abs(lambda.real()), no_damping * std::abs(lambda)))
      if (const std::optional<Root> better = refine(root); better && better->error < error && !again(*better, refined_roots)) {
        root = *better;
        refined_roots.push_back(root);
      }
    if (std::abs(root.lambda.imag()) <= margin * root.error) root.lambda.imag(0.0);
    if (std::abs(root.lambda.real()) <= margin * root.error) root.lambda.real(0.0);
    if (root.lambda.imag() < 0.0) continue;
    out.push_back({root.lambda, root.error, unit_peak(basis * root.x)});
  }
  if (still.empty()) return;
  MatX motions(still[0].size(), 2 * static_cast<Eigen::Index>(still.size()));
  for (size_t k = 0; k < still.size(); ++k) {
    const double peak = still[k].cwiseAbs().maxCoeff();
    const Eigen::VectorXcd x = peak > 0.0 ? Eigen::VectorXcd(still[k] / peak) : still[k];
    motions.col(2 * static_cast<Eigen::Index>(k)) = x.real();
    motions.col(2 * static_cast<Eigen::Index>(k) + 1) = x.imag();
  }
  // Vectors of a double eigenvalue agree to about its split, those of different motions differ by much more; half as many motions as
  // eigenvalues there are at least, position and velocity of each.
  const MatX ordered = independent_columns(motions, eps);
  const Eigen::Index found = static_cast<Eigen::Index>(still.size()), least = (found + 1) / 2;
  const Eigen::Index count = std::min(ordered.cols(), std::clamp(independent_columns(motions, 1e-5).cols(), least, found));
  for (Eigen::Index k = 0; k < count; ++k)
    out.push_back({0.0, still_error, unit_peak(Eigen::VectorXcd((basis * ordered.col(k)).cast<std::complex<double>>()))});
}

// Groups of modes that D and the skew part of K couple.
std::vector<std::vector<Eigen::Index>> coupled_groups(const MatX& coupled) {
  const Eigen::Index n = coupled.rows();
  std::vector<std::vector<Eigen::Index>> out;
  std::vector<char> seen(n, 0);
  for (Eigen::Index start = 0; start < n; ++start) {
    if (seen[start]) continue;
    std::vector<Eigen::Index> group{start};
    seen[start] = 1;
    for (size_t at = 0; at < group.size(); ++at)
      for (Eigen::Index k = 0; k < n; ++k)
        if (!seen[k] && (coupled(group[at], k) != 0.0 || coupled(k, group[at]) != 0.0)) {
          seen[k] = 1;
          group.push_back(k);
        }
    out.push_back(group);
  }
  return out;
}

// A root of x'' + D x' + K x = 0 from a near one, by Newton's method on [Q(lambda) x; x_p - 1] with Q = lambda^2 + lambda D + K, rows and
// columns in units of the coordinates' own rates W or the root's (Ruhe, SIAM J. Numer. Anal. 10, 1973, sec. 3). Known to |y| (|lambda|
// D_error + K_error) |x| with y^T Q = 0, y^T Q' x = 1. Empty where it goes to another root.
std::optional<Root> refined(const MatX& D, const MatX& K, const MatX& D_error, const MatX& K_error, const VecX& W, const Root& near) {
  const Eigen::Index m = D.rows();
  const VecX unit = W.cwiseMax(std::abs(near.lambda)).cwiseInverse();
  const MatX one = unit.cwiseAbs2().asDiagonal(), d = unit.asDiagonal() * D * unit.asDiagonal(),
             k = unit.asDiagonal() * K * unit.asDiagonal();
  Eigen::VectorXcd z = near.x.cwiseQuotient(unit.cast<std::complex<double>>());
  Eigen::Index peak = 0;
  if (!(z.cwiseAbs().maxCoeff(&peak) > 0.0)) return std::nullopt;
  z /= z[peak];
  std::complex<double> lambda = near.lambda;
  constexpr int most_rounds = 5;
  constexpr double converged = 1e-6;  // of the real part: the next step would be its square
  for (int round = 0; round < most_rounds; ++round) {
    Eigen::MatrixXcd B = Eigen::MatrixXcd::Zero(m + 1, m + 1);
    const Eigen::MatrixXcd Q = lambda * lambda * one + lambda * d + k;
    B.topLeftCorner(m, m) = Q;
    B.topRightCorner(m, 1) = (2.0 * lambda * one + d) * z;
    B(m, peak) = 1.0;
    const Eigen::PartialPivLU<Eigen::MatrixXcd> lu(B);
    Eigen::VectorXcd rest = Eigen::VectorXcd::Zero(m + 1);
    rest.head(m) = -(Q * z);
    const Eigen::VectorXcd step = lu.solve(rest);
    if (!step.allFinite()) return std::nullopt;
    z += step.head(m);
    lambda += step[m];
    if (std::abs(lambda - near.lambda) > margin * near.error) return std::nullopt;
    if (std::abs(step[m]) > std::max(4.0 * eps * std::abs(lambda), converged * std::abs(lambda.real()))) continue;
    const Eigen::VectorXcd y = lu.transpose().solve(Eigen::VectorXcd(Eigen::VectorXcd::Unit(m + 1, m)));
    const double size = std::abs(lambda);
    const MatX entries = size * unit.asDiagonal() * D_error * unit.asDiagonal() + MatX(unit.asDiagonal() * K_error * unit.asDiagonal()) +
                         4.0 * eps * (size * size * one + size * d.cwiseAbs() + k.cwiseAbs());
    const double error = y.head(m).cwiseAbs().dot(entries * z.cwiseAbs());
    if (!std::isfinite(error)) return std::nullopt;
    return Root{lambda, error, z.cwiseProduct(unit.cast<std::complex<double>>())};
  }
  return std::nullopt;
}

// Modes of a coupled group, in undamped modes Phi (n x m): x'' + D x' + K x = 0.
void add_group(const MatX& D, const MatX& K, const MatX& D_error, const MatX& K_error, const MatX& Phi, std::vector<ComplexMode>& out) {
  const Eigen::Index m = D.rows();
  // [W x; x']: by their own frequencies, or by the slowest rate that the group has where they have none.
  VecX W(m);
  double slowest = std::numeric_limits<double>::infinity();
  for (Eigen::Index k = 0; k < m; ++k) {
    W[k] = std::abs(K(k, k)) > margin * K_error(k, k) ? std::sqrt(std::abs(K(k, k)))
                                                      : std::max(D.row(k).cwiseAbs().maxCoeff(), D.col(k).cwiseAbs().maxCoeff());
    if (W[k] > 0.0) slowest = std::min(slowest, W[k]);
  }
  for (Eigen::Index k = 0; k < m; ++k)
    if (!(W[k] > 0.0)) W[k] = slowest;
  MatX A = MatX::Zero(2 * m, 2 * m), E = A;
  A.topRightCorner(m, m) = W.asDiagonal();
  A.bottomLeftCorner(m, m) = -K * W.cwiseInverse().asDiagonal();
  A.bottomRightCorner(m, m) = -D;
  E.bottomLeftCorner(m, m) = K_error * W.cwiseInverse().asDiagonal();
  E.bottomRightCorner(m, m) = D_error;
  add_general(
      A, E, [&](const Eigen::VectorXcd& z) { return Eigen::VectorXcd(z.head(m).cwiseQuotient(W.cast<std::complex<double>>())); }, Phi, out,
      [&](const Root& near) { return refined(D, K, D_error, K_error, W, near); });
}

// Units of the states, powers of two, in which rows and columns of A are alike: the solver errs by its rounding of the largest entry, and
// places stand beside rates (Parlett and Reinsch 1969).
VecX balancing(const MatX& A) {
  VecX unit = VecX::Ones(A.rows());
  MatX left = A.cwiseAbs();
  left.diagonal().setZero();
  // A row and its column are in balance when no power of two brings their sum down by a twentieth.
  constexpr double worth = 0.95;
  for (bool changed = true; changed;) {
    changed = false;
    for (Eigen::Index k = 0; k < A.rows(); ++k) {
      const double column = left.col(k).norm(), row = left.row(k).norm();
      if (column == 0.0 || row == 0.0) continue;
      const double f = std::exp2(std::round(0.5 * std::log2(row / column)));
      if (!(f * column + row / f < worth * (column + row))) continue;
      unit[k] *= f;
      left.col(k) *= f;
      left.row(k) /= f;
      changed = true;
    }
  }
  return unit;
}

}  // namespace

std::vector<ComplexMode> complex_modes(const SecondOrder& s) {
  const Eigen::Index n = s.M.rows();
  std::vector<ComplexMode> out;
  if (n == 0) return out;
  const UndampedModes modes = undamped_modes(s.M, 0.5 * (s.K + s.K.transpose()));
  const MatX& Phi = modes.Phi;
  const MatX size = Phi.cwiseAbs();
  // What the entries are known to, and the rounding of the products.
  const MatX K_error = size.transpose() * (s.K_error + eps * s.K.cwiseAbs()) * size;
  const MatX D_error = size.transpose() * (s.D_error + eps * s.D.cwiseAbs()) * size;
  MatX D = Phi.transpose() * s.D * Phi, K = Phi.transpose() * (0.5 * (s.K - s.K.transpose())) * Phi;
  for (Eigen::Index j = 0; j < n; ++j)
    for (Eigen::Index i = 0; i < n; ++i) {
      if (std::abs(D(i, j)) <= margin * D_error(i, j)) D(i, j) = 0.0;
      if (std::abs(K(i, j)) <= margin * K_error(i, j)) K(i, j) = 0.0;
    }
  MatX coupled = D.cwiseAbs() + K.cwiseAbs();
  coupled.diagonal().setZero();
  K.diagonal() = modes.square;
  // Vectors are known to eps, so that what is left of a rigid mode's square is eps^2 of the largest.
  const double rest = eps * eps * modes.square.cwiseAbs().maxCoeff();
  for (Eigen::Index k = 0; k < n; ++k)
    if (std::abs(modes.square[k]) <= rest) K(k, k) = 0.0;
  for (const std::vector<Eigen::Index>& g : coupled_groups(coupled)) {
    if (g.size() == 1) add_single(D(g[0], g[0]), K(g[0], g[0]), D_error(g[0], g[0]), K_error(g[0], g[0]), Phi.col(g[0]), out);
    else add_group(D(g, g), K(g, g), D_error(g, g), K_error(g, g), Phi(Eigen::all, g), out);
  }
  return out;
}

std::vector<ComplexMode> complex_modes(const SecondOrder& s, const FurtherStates& states) {
  const Eigen::Index n = s.M.rows(), nz = states.A.rows(), at = 2 * n;
  const UndampedModes modes = undamped_modes(s.M, 0.5 * (s.K + s.K.transpose()));
  const MatX& Phi = modes.Phi;
  const MatX size = Phi.cwiseAbs();
  const MatX K_error = size.transpose() * (s.K_error + eps * s.K.cwiseAbs()) * size;
  const MatX D_error = size.transpose() * (s.D_error + eps * s.D.cwiseAbs()) * size;
  MatX K = Phi.transpose() * (0.5 * (s.K - s.K.transpose())) * Phi;
  K.diagonal() += modes.square;
  const MatX D = Phi.transpose() * s.D * Phi;
  MatX B = states.B * Phi, B_rate = states.B_rate * Phi, G = Phi.transpose() * states.G;
  // [W x; x'; z]: places by their own frequencies, or 1/s; states so that they drive as much as they are driven.
  VecX W(n);
  for (Eigen::Index k = 0; k < n; ++k)
    W[k] = std::abs(modes.square[k]) > margin * K_error(k, k) ? std::sqrt(std::abs(modes.square[k])) : 1.0;
  B = B * W.cwiseInverse().asDiagonal();
  VecX unit = VecX::Ones(nz);
  for (Eigen::Index j = 0; j < nz; ++j) {
    const double drives = G.col(j).norm(), driven = B.row(j).norm() + B_rate.row(j).norm();
    if (drives > 0.0 && driven > 0.0) unit[j] = std::sqrt(driven / drives);
  }
  const auto in_units = [&](MatX& m) { m = unit.cwiseInverse().asDiagonal() * m; };
  in_units(B), in_units(B_rate);
  G = G * unit.asDiagonal();
  constexpr double known = 1e-9;
  MatX A = MatX::Zero(at + nz, at + nz), E = A;
  A.block(0, n, n, n) = W.asDiagonal();
  A.block(n, 0, n, n) = -K * W.cwiseInverse().asDiagonal();
  A.block(n, n, n, n) = -D;
  A.block(n, at, n, nz) = G;
  A.block(at, 0, nz, n) = B;
  A.block(at, n, nz, n) = B_rate;
  A.block(at, at, nz, nz) = unit.cwiseInverse().asDiagonal() * states.A * unit.asDiagonal();
  E.block(n, 0, n, n) = K_error * W.cwiseInverse().asDiagonal();
  E.block(n, n, n, n) = D_error;
  E.rightCols(nz) = known * A.rightCols(nz).cwiseAbs();
  E.bottomRows(nz) = known * A.bottomRows(nz).cwiseAbs();
  std::vector<ComplexMode> out;
  add_general(
      A, E, [&](const Eigen::VectorXcd& z) { return Eigen::VectorXcd(z.head(n).cwiseQuotient(W.cast<std::complex<double>>())); }, Phi, out);
  return out;
}

std::vector<ComplexMode> first_order_modes(const MatX& A, const MatX& A_size,
                                           const std::function<Eigen::VectorXcd(const Eigen::VectorXcd&)>& shape) {
  std::vector<ComplexMode> out;
  if (A.rows() == 0) return out;
  const VecX unit = balancing(A);
  const auto in_units = [&](const MatX& m) { return MatX(unit.cwiseInverse().asDiagonal() * m * unit.asDiagonal()); };
  MatX basis(shape(Eigen::VectorXcd::Zero(A.rows())).size(), A.rows());
  for (Eigen::Index k = 0; k < A.rows(); ++k) basis.col(k) = unit[k] * shape(Eigen::VectorXcd::Unit(A.rows(), k)).real();
  add_general(
      in_units(A), 1e-13 * in_units(A_size), [](const Eigen::VectorXcd& z) { return z; }, basis, out);
  return out;
}

}  // namespace flexframe::sim
