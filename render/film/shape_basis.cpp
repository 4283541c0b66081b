#include "render/film/shape_basis.h"

#include "sim/base/eigen_solvers.h"

#include <algorithm>
#include <cmath>

namespace flexframe::film {
namespace {

constexpr int most_snapshots = 64;

Eigen::Map<const Eigen::VectorXf> displacement_at(const Animation& animation, int body, int picture, BodyMemory& memory) {
  const sim::Results& results = *animation.results;
  update_displacement(animation.bodies[body], results.bodies[body], find_sample(results.times, picture_time(animation, picture)), memory);
  return {memory.displacement.data(), static_cast<Eigen::Index>(memory.displacement.size())};
}

}  // namespace

ShapeBasis make_shape_basis(const Animation& animation, int body, double relative) {
  ShapeBasis basis;
  BodyMemory memory;
  const Eigen::Index rows = static_cast<Eigen::Index>(animation.bodies[body].rest.size());

  // Snapshots, evenly over the sequence.
  const int count = std::min(animation.count, most_snapshots);
  Eigen::MatrixXf snapshots(rows, count);
  for (int k = 0; k < count; ++k) {
    const int picture = count > 1 ? static_cast<int>(static_cast<long>(k) * (animation.count - 1) / (count - 1)) : 0;
    snapshots.col(k) = displacement_at(animation, body, picture, memory);
  }
  const double largest = snapshots.cwiseAbs().maxCoeff();

  // Their singular vectors by the eigenvectors of the small Gram matrix, in double.
  Eigen::MatrixXd gram(count, count);
  for (int i = 0; i < count; ++i)
    for (int j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (Eigen::Index r = 0; r < rows; ++r) sum += static_cast<double>(snapshots(r, i)) * snapshots(r, j);
      gram(i, j) = gram(j, i) = sum;
    }
  const sim::SymmetricEigen eigen(gram);
  const Eigen::VectorXd energy = eigen.eigenvalues().reverse().cwiseMax(0.0);
  // Single precision leaves nothing below 1e-12 of the largest eigenvalue.
  const double allowed = std::max(relative * relative * largest * largest * static_cast<double>(rows) / 3.0 * count, 1e-12 * energy[0]);
  int n = 0;
  for (double left = energy.sum(); n < count && left > allowed && energy[n] > 1e-12 * energy[0]; ++n) left -= energy[n];
  Eigen::MatrixXf shapes(rows, n);
  for (int k = 0; k < n; ++k) {
    shapes.col(k) = snapshots * (eigen.eigenvectors().col(count - 1 - k) / std::sqrt(energy[k])).cast<float>();
    for (int j = 0; j < k; ++j) shapes.col(k) -= shapes.col(j) * shapes.col(j).dot(shapes.col(k));
    shapes.col(k).normalize();
  }
  snapshots.resize(0, 0);

  // Weights of every picture, and what they miss.
  basis.weights.resize(n, animation.count);
  for (int k = 0; k < animation.count; ++k) {
    const Eigen::VectorXf u = displacement_at(animation, body, k, memory);
    basis.weights.col(k) = shapes.transpose() * u;
    const Eigen::VectorXf missed = u - shapes * basis.weights.col(k);
    for (Eigen::Index v = 0; v + 2 < rows; v += 3) {
      basis.largest = std::max(basis.largest, static_cast<double>(u.segment<3>(v).norm()));
      basis.error = std::max(basis.error, static_cast<double>(missed.segment<3>(v).norm()));
    }
  }
  // Shapes of size 1: weights are then metres at the point that moves most.
  for (int k = 0; k < n; ++k) {
    const float size = shapes.col(k).cwiseAbs().maxCoeff();
    shapes.col(k) /= size;
    basis.weights.row(k) *= size;
  }
  basis.shapes = std::move(shapes);
  return basis;
}

}  // namespace flexframe::film
