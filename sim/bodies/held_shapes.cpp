#include "sim/bodies/held_shapes.h"

#include "sim/base/eigen_solvers.h"
#include "sim/base/error.h"

#include <Eigen/SparseCholesky>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

constexpr double independent = 1e-9;  // of what holds a body, in comparable units
constexpr double new_shape = 1e-6;    // what a shape has to have beside the others

// LDL^T of a band: in the order of the coordinates nothing fills in.
using BandFactor = Eigen::SimplicialLDLT<BandMatrix, Eigen::Lower, Eigen::NaturalOrdering<int>>;

// Static deflections of the body as it is held, from its flexibility as it is clamped: x = F (f - H mu) + R a with H^T x = 0 and all
// forces in balance.
class HeldStatics {
 public:
  HeldStatics(const LongBody& body, const MatX& holds);

  // Deflections under forces f that leave alone the motions that are free, orthogonal to these by mass.
  MatX deflection(const MatX& f) const;
  // The same, forces freed of what moves the body.
  MatX balanced(const MatX& f) const { return f - inertia_ * (free_.transpose() * f); }
  // Less the free rigid motions.
  MatX without_free(const MatX& x) const { return x - free_ * (inertia_.transpose() * x); }
  // Deflection of the clamped body.
  MatX clamped(const MatX& f) const;

  const MatX& holds() const { return holds_; }        // n x h, independent
  Eigen::Index free() const { return free_.cols(); }  // rigid motions that the holds leave
  const MatX& free_motions() const { return free_; }  // orthonormal by mass

 private:
  std::vector<int> kept_;  // the coordinates that the clamp leaves
  BandFactor factor_;
  MatX holds_, free_, inertia_, fixed_;  // fixed_: rigid motions that the holds prevent; inertia_ = M free_
  MatX by_holds_, system_;
  double unit_ = 1.0;
};

MatX HeldStatics::clamped(const MatX& f) const {
  MatX x = MatX::Zero(f.rows(), f.cols());
  x(kept_, Eigen::all) = factor_.solve(MatX(f(kept_, Eigen::all)));
  return x;
}

// Rows and columns of a sparse matrix; rows ascending.
BandMatrix part_of(const BandMatrix& A, const std::vector<int>& rows) {
  std::vector<int> at(static_cast<size_t>(A.rows()), -1);
  for (size_t i = 0; i < rows.size(); ++i) at[static_cast<size_t>(rows[i])] = static_cast<int>(i);
  std::vector<Eigen::Triplet<double>> entries;
  for (int j = 0; j < A.outerSize(); ++j)
    for (BandMatrix::InnerIterator it(A, j); it; ++it)
      if (at[static_cast<size_t>(it.row())] >= 0 && at[static_cast<size_t>(j)] >= 0)
        entries.emplace_back(at[static_cast<size_t>(it.row())], at[static_cast<size_t>(j)], it.value());
  BandMatrix out(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(rows.size()));
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

HeldStatics::HeldStatics(const LongBody& body, const MatX& holds) {
  const Eigen::Index n = body.K.rows(), r = body.rigid.cols();
  for (int i = 0; i < n; ++i)
    if (std::find(body.clamp.begin(), body.clamp.end(), i) == body.clamp.end()) kept_.push_back(i);
  factor_.compute(part_of(body.K, kept_));
  if (factor_.info() != Eigen::Success || !(factor_.vectorD().minCoeff() > 0.0))
    throw SimulationError("the eigenmodes of an elastic body cannot be computed: its stiffness matrix is not positive definite");

  holds_ = MatX(n, 0);
  if (holds.cols() > 0) holds_ = body.scale.cwiseInverse().asDiagonal() * orthonormal_columns(body.scale.asDiagonal() * holds, independent);
  const MatX work = holds_.transpose() * body.rigid;  // h x r
  const MatX left = orthogonal_complement(MatX(work.transpose()), independent);
  free_ = body.rigid * left;
  if (free_.cols() > 0) {
    const MatX mass = free_.transpose() * (body.M * free_);
    free_ = Cholesky(mass).solve_lower(MatX(free_.transpose())).transpose();
  }
  inertia_ = body.M * free_;
  fixed_ = work.cols() > 0 && work.rows() > 0 ? MatX(body.rigid * orthonormal_columns(MatX(work.transpose()), independent)) : MatX(n, 0);
  if (left.cols() == r) fixed_ = MatX(n, 0);

  by_holds_ = clamped(holds_);
  const MatX S = holds_.transpose() * by_holds_, B = holds_.transpose() * fixed_;
  const Eigen::Index h = holds_.cols(), m = fixed_.cols();
  unit_ = S.size() > 0 ? S.cwiseAbs().maxCoeff() : 1.0;
  if (!(unit_ > 0.0)) unit_ = 1.0;
  system_ = MatX::Zero(h + m, h + m);
  system_.topLeftCorner(h, h) = S / unit_;
  system_.topRightCorner(h, m) = -B;
  system_.bottomLeftCorner(m, h) = B.transpose();
}

MatX HeldStatics::deflection(const MatX& f) const {
  MatX x = clamped(f);
  const Eigen::Index h = holds_.cols(), m = fixed_.cols();
  if (h > 0) {
    MatX rest(h + m, f.cols());
    rest.topRows(h) = holds_.transpose() * x;
    rest.bottomRows(m) = unit_ * (fixed_.transpose() * f);
    const MatX found = solve_square(system_, rest);
    x -= by_holds_ * (found.topRows(h) / unit_);
    x += fixed_ * found.bottomRows(m);
  }
  return without_free(x);
}

// The same numbers wherever it runs.
MatX scattered(Eigen::Index rows, Eigen::Index cols) {
  unsigned state = 12345u;
  return MatX::NullaryExpr(rows, cols, [&](Eigen::Index, Eigen::Index) {
    state = state * 1664525u + 1013904223u;
    return static_cast<double>(state >> 8) / 8388608.0 - 1.0;
  });
}

// Columns orthonormal by mass.
struct ByMass {
  MatX shapes, inertia;  // inertia = M shapes
  Eigen::Index count = 0;

  ByMass(Eigen::Index rows, Eigen::Index most) : shapes(rows, most), inertia(rows, most) {}
  auto all() const { return shapes.leftCols(count); }
  auto last(Eigen::Index n) const { return shapes.middleCols(count - n, n); }

  // Adds what x has beside them; false where that is no more than `threshold` of x.
  bool add(const BandMatrix& M, VecX x, double threshold) {
    VecX Mx = M * x;
    const double whole = std::sqrt(std::max(0.0, x.dot(Mx)));
    double size = whole;
    for (int pass = 0; pass < 3; ++pass) {
      if (count == 0) break;
      const VecX share = inertia.leftCols(count).transpose() * x;
      x.noalias() -= all() * share;
      Mx.noalias() = M * x;
      const double before = size;
      size = std::sqrt(std::max(0.0, x.dot(Mx)));
      if (!(size > threshold * whole)) return false;
      if (pass > 0 && size > 0.5 * before) break;
    }
    if (!(size > 0.0)) return false;
    shapes.col(count) = x / size;
    inertia.col(count++) = Mx / size;
    return true;
  }
};

// All vibrations, by dense matrices.
MatX solve_whole(const LongBody& body, const HeldStatics& statics, VecX& stiffness) {
  MatX prevented(body.K.rows(), statics.holds().cols() + statics.free());
  prevented << body.scale.asDiagonal() * statics.holds(), body.scale.asDiagonal() * (body.M * statics.free_motions());
  const MatX allowed = body.scale.asDiagonal() * orthogonal_complement(prevented, independent);
  const GeneralizedEigen eigen(MatX(allowed.transpose() * (body.K * allowed)), MatX(allowed.transpose() * (body.M * allowed)));
  if (eigen.info() != Eigen::Success)
    throw SimulationError("the eigenmodes of an elastic body cannot be computed: its mass matrix is not positive definite");
  stiffness = eigen.eigenvalues();
  return allowed * eigen.eigenvectors();
}

// How many vibrations and free rigid motions lie below a value: negative pivots of K - value M bordered by what is held.
Eigen::Index count_below(const LongBody& body, const HeldStatics& statics, double value) {
  const BandMatrix A = body.K - value * body.M;
  BandFactor factor(A);
  if (factor.info() != Eigen::Success) return -1;
  Eigen::Index negative = (factor.vectorD().array() < 0.0).count();
  const MatX& H = statics.holds();
  if (H.cols() == 0) return negative;
  const MatX C = -(H.transpose() * MatX(factor.solve(H)));
  negative += (SymmetricEigen(MatX(0.5 * (C + C.transpose())), Eigen::EigenvaluesOnly).eigenvalues().array() < 0.0).count();
  return negative - H.cols();
}

MatX vibrations(const LongBody& body, const HeldStatics& statics, int places, Eigen::Index count, VecX& stiffness) {
  const Eigen::Index all = body.K.rows() - statics.holds().cols() - statics.free();
  count = std::min(count, all);
  if (count <= 0) {
    stiffness.resize(0);
    return MatX(body.K.rows(), 0);
  }
  const Eigen::Index block = places + 1;  // as many vibrations may have the same frequency
  Eigen::Index target = 2 * count + 2 * block + 2;
  if (target < all) {
    // T = static response to inertia; basis: a Krylov space of it, with T of it beside.
    const Eigen::Index most = std::min(all, 2 * target);
    ByMass basis(body.K.rows(), most);
    MatX answer(body.K.rows(), most);
    MatX next = statics.deflection(statics.balanced(scattered(body.K.rows(), block)));
    while (basis.count + next.cols() <= most) {
      const Eigen::Index from = basis.count;
      for (Eigen::Index k = 0; k < next.cols(); ++k) basis.add(body.M, next.col(k), 1e-12);
      const Eigen::Index added = basis.count - from;
      if (added == 0) break;
      next = statics.deflection(statics.balanced(basis.inertia.middleCols(from, added)));
      answer.middleCols(from, added) = next;
      if (basis.count < target) continue;
      target = basis.count + std::max<Eigen::Index>(block, count / 4);
      const MatX G = basis.inertia.leftCols(basis.count).transpose() * answer.leftCols(basis.count);
      const SymmetricEigen eigen(MatX(-0.5 * (G + G.transpose())));  // descending
      const MatX chosen = eigen.eigenvectors().leftCols(count);
      const VecX value = -eigen.eigenvalues().head(count);
      const MatX residual = answer.leftCols(basis.count) * chosen - basis.all() * (G * chosen);
      bool converged = value[count - 1] > 0.0;
      for (Eigen::Index k = 0; k < count && converged; ++k) {
        const double size = std::sqrt(std::max(0.0, residual.col(k).dot(body.M * residual.col(k))));
        converged = size <= 1e-12 * value[k] + 1e-15 * value[0];
      }
      if (!converged) continue;
      stiffness = value.cwiseInverse();
      // Just below the highest: those that equal it need not all be there.
      const double below = stiffness[count - 1] * (1.0 - 1e-6);
      if (count_below(body, statics, below) != statics.free() + (stiffness.array() < below).count()) break;
      return basis.all() * chosen;
    }
  }
  MatX modes = solve_whole(body, statics, stiffness);
  stiffness.conservativeResize(count);
  return modes.leftCols(count);
}

// On the mean axes.
MatX without_rigid(const LongBody& body, const MatX& x) {
  const MatX inertia = body.M * body.rigid;
  return x - body.rigid * solve_symmetric(body.rigid.transpose() * inertia, inertia.transpose() * x);
}

}  // namespace

MatX held_vibrations(const LongBody& body, const Holds& holds, int count, VecX& stiffness) {
  const HeldStatics statics(body, holds.holds);
  return vibrations(body, statics, holds.places, count, stiffness);
}

MatX held_shapes(const LongBody& body, const Holds& holds, int count) {
  const HeldStatics statics(body, holds.holds);
  VecX stiffness;
  const MatX modes = vibrations(body, statics, holds.places, count, stiffness);
  const auto by_mass = [&](const VecX& x) { return std::sqrt(std::max(0.0, x.dot(body.M * x))); };
  MatX shapes = without_rigid(body, modes);
  const auto append = [&](const VecX& shape, double whole) {
    const double size = by_mass(shape);
    if (!(whole > 0.0) || !(size > 1e-9 * whole)) return;
    shapes.conservativeResize(Eigen::NoChange, shapes.cols() + 1);
    shapes.rightCols(1) = shape / size;
  };
  // What joints deform when they move against each other, by forces in balance.
  const MatX& H = statics.holds();
  MatX moved(body.K.rows(), 0);
  if (H.cols() > 0) {
    const MatX balanced = orthogonal_complement(MatX(H.transpose() * body.rigid), independent);
    moved = without_rigid(body, statics.clamped(H * balanced));
  }
  MatX loads = holds.loads;
  if (holds.inertia) {
    loads.conservativeResize(body.K.rows(), loads.cols() + body.rigid.cols() + moved.cols());
    loads.rightCols(body.rigid.cols() + moved.cols()) << MatX(body.M * body.rigid), MatX(body.M * moved);
  }
  // What loads deform beside the modes, statically: loads less the modes' share in them.
  if (loads.cols() > 0) {
    const MatX load = statics.balanced(loads);
    const MatX share = modes.transpose() * load;
    MatX rest = statics.deflection(load - body.M * (modes * share));
    rest -= modes * (modes.transpose() * (body.M * rest));
    rest = without_rigid(body, rest);
    // Measured at what they deform where nothing holds the body and where it is clamped: loads on a place that is held leave rounding.
    const MatX work = body.rigid.transpose() * loads, inertia = body.M * body.rigid;
    const MatX in_balance = loads - inertia * solve_symmetric(body.rigid.transpose() * inertia, work);
    const MatX free = without_rigid(body, statics.clamped(in_balance)), clamped = statics.clamped(loads);
    for (Eigen::Index k = 0; k < rest.cols(); ++k) append(rest.col(k), std::max(by_mass(free.col(k)), by_mass(clamped.col(k))));
  }
  for (Eigen::Index k = 0; k < moved.cols(); ++k) append(moved.col(k), moved.norm() > 0.0 ? by_mass(moved.col(k)) : 0.0);
  // A basis of them, always that which has most beside the ones before: by pivots of their products.
  MatX left = shapes.transpose() * (body.M * shapes);
  ByMass out(body.K.rows(), shapes.cols());
  double largest = 0.0;
  for (Eigen::Index k = 0; k < shapes.cols(); ++k) {
    Eigen::Index at = 0;
    const double square = left.diagonal().maxCoeff(&at);
    largest = std::max(largest, square);
    if (!(square > new_shape * new_shape * largest) || !out.add(body.M, shapes.col(at), new_shape)) break;
    left -= MatX(left.col(at) * left.row(at)) / square;
    left.row(at).setZero();
    left.col(at).setZero();
  }
  return without_rigid(body, out.all());
}

}  // namespace flexframe::sim
