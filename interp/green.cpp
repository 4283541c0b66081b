#include "interp/green.h"

#include "interp/dense_solvers.h"
#include "interp/parallel.h"
#include "interp/rotation.h"
#include "interp/watch.h"

#include <Eigen/SparseCholesky>

#include <algorithm>
#include <memory>
#include <vector>

namespace flexframe::interp {

Green solve_green(const Eigen::SparseMatrix<double>& stiffness, const Eigen::SparseMatrix<double>& constraints,
                  const Eigen::SparseMatrix<double>& wanted, int nodes, const std::vector<int>& turned, int threads) {
  const double beta = stiffness.diagonal().mean();
  const Eigen::SparseMatrix<double> transposed = constraints.transpose();
  struct Factored {
    Eigen::SparseMatrix<double> matrix;
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver;
  };
  const auto factored = std::make_shared<Factored>();
  factored->matrix = stiffness + beta * (transposed * constraints);
  look_beside([factored] { factored->solver.compute(factored->matrix); });
  factored->matrix.resize(0, 0);
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>& solver = factored->solver;
  if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 0.0))
    throw MapError("the elastic system of the mesh cannot be factorised: the mesh is too degenerate; use the scheme kernel");

  const Eigen::Index rows = constraints.rows();
  Eigen::MatrixXd at_wanted(wanted.rows(), rows), gram(rows, rows);
  parallel_chunks(static_cast<int>(rows), 16, threads, [&](int first, int last) {
    const Eigen::MatrixXd right = transposed.middleCols(first, last - first);
    const Eigen::MatrixXd x = solver.solve(right);
    at_wanted.middleCols(first, last - first) = wanted * x;
    gram.middleCols(first, last - first) = constraints * x;
  });
  const Eigen::MatrixXd inverse = inverse_by_row_pivots(gram);
  if (!inverse.allFinite())
    throw MapError("two simulation nodes prescribe the displacement of the same part of the mesh: the elastic system is singular");
  const Eigen::MatrixXd whole = at_wanted * inverse;
  Green green;
  const Eigen::Index n = 3 * static_cast<Eigen::Index>(nodes);
  green.displacement = whole.leftCols(n);
  if (!turned.empty()) {
    green.rotation = Eigen::MatrixXd::Zero(whole.rows(), n);
    for (size_t k = 0; k < turned.size(); ++k)
      green.rotation.middleCols(3 * static_cast<Eigen::Index>(turned[k]), 3) = whole.middleCols(n + 3 * static_cast<Eigen::Index>(k), 3);
  }
  // A node that is left out takes its turn with it: rows of both, of which the displacements are kept.
  const Eigen::MatrixXd nodal = inverse - beta * Eigen::MatrixXd::Identity(rows, rows);
  std::vector<Eigen::Index> turn_of(nodes, -1);
  for (size_t k = 0; k < turned.size(); ++k) turn_of[turned[k]] = n + 3 * static_cast<Eigen::Index>(k);
  green.leave_one_out.resize(n, n);
  if (!turned.empty()) green.leave_one_out_turn = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < nodes; ++i) {
    std::vector<Eigen::Index> own{3 * i, 3 * i + 1, 3 * i + 2};
    if (turn_of[i] >= 0) own.insert(own.end(), {turn_of[i], turn_of[i] + 1, turn_of[i] + 2});
    const Eigen::MatrixXd residual = nodal(own, own).partialPivLu().solve(nodal(own, Eigen::all)).topRows(3);
    green.leave_one_out.middleRows(3 * i, 3) = residual.leftCols(n);
    for (size_t k = 0; k < turned.size(); ++k)
      green.leave_one_out_turn.block<3, 3>(3 * i, 3 * static_cast<Eigen::Index>(turned[k])) =
          residual.middleCols<3>(n + 3 * static_cast<Eigen::Index>(k));
  }
  // The nodes' stiffness is the inverse less beta. Its softest six are rigid.
  constexpr Eigen::Index rigid = 6, softest = 6;
  if (turned.empty() && n > rigid) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(0.5 * (inverse + inverse.transpose()));
    green.soft = modes.eigenvectors().middleCols(rigid, std::min(softest, n - rigid));
  }
  return green;
}

void restore_rigid_motion(Green& green, const Points& nodes, const Points& points) {
  const Vec3 centre = nodes.colwise().mean().transpose();
  const double size = std::max((nodes.rowwise() - centre.transpose()).rowwise().norm().maxCoeff(), 1e-300);
  auto rigid = [&](const Points& p) {
    Eigen::MatrixXd r(3 * p.rows(), 6);
    for (Eigen::Index i = 0; i < p.rows(); ++i) {
      r.block<3, 3>(3 * i, 0).setIdentity();
      r.block<3, 3>(3 * i, 3) = -skew((p.row(i).transpose() - centre) / size);
    }
    return r;
  };
  const Eigen::MatrixXd at_points = rigid(points);
  Eigen::MatrixXd at_nodes = rigid(nodes);
  if (green.rotation.size() > 0) {
    // Rigid motion of displacements and rotations together.
    Eigen::MatrixXd turn = Eigen::MatrixXd::Zero(3 * nodes.rows(), 6);
    for (Eigen::Index i = 0; i < nodes.rows(); ++i) turn.block<3, 3>(3 * i, 3) = Mat3::Identity() / size;
    Eigen::MatrixXd both(6 * nodes.rows(), 6);
    both << at_nodes, turn * size;
    const Eigen::MatrixXd fit = pseudo_inverse(both);
    const Eigen::MatrixXd error = at_points - green.displacement * at_nodes - green.rotation * turn;
    green.displacement += error * fit.leftCols(3 * nodes.rows());
    green.rotation += error * fit.rightCols(3 * nodes.rows()) * size;
    return;
  }
  // Turns that the nodes do not see (about their line) stay out.
  const Eigen::MatrixXd fit = pseudo_inverse(at_nodes, 1e-9);
  // Only rigid motions that the nodes determine: fit * at_nodes projects onto them.
  green.displacement += (at_points * (fit * at_nodes) - green.displacement * at_nodes) * fit;
}

}  // namespace flexframe::interp
