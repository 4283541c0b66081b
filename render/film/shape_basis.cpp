#include "render/film/shape_basis.h"

#include "render/film/survey.h"
#include "sim/base/eigen_solvers.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace flexframe::film {
namespace {

constexpr int most_snapshots = 64;

Eigen::Map<const Eigen::VectorXf> displacement_at(const Animation& animation, int body, int picture, BodyMemory& memory) {
  const sim::Results& results = *animation.results;
  update_displacement(animation.bodies[body], results.bodies[body], find_sample(results.times, picture_time(animation, picture)), memory);
  return {memory.displacement.data(), static_cast<Eigen::Index>(memory.displacement.size())};
}

// A field over the sequence: `width` numbers a point, whose length counts; at(picture) gives it.
struct Field {
  Eigen::Index rows = 0;
  int width = 1, pictures = 0;
  std::function<Eigen::Map<const Eigen::VectorXf>(int picture)> at;
};

ShapeBasis make_basis(const Field& field, double relative) {
  ShapeBasis basis;
  const Eigen::Index rows = field.rows;

  // Snapshots, evenly over the sequence.
  const int count = std::min(field.pictures, most_snapshots);
  Eigen::MatrixXf snapshots(rows, count);
  for (int k = 0; k < count; ++k) {
    const int picture = count > 1 ? static_cast<int>(static_cast<long>(k) * (field.pictures - 1) / (count - 1)) : 0;
    snapshots.col(k) = field.at(picture);
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
  const double allowed =
      std::max(relative * relative * largest * largest * static_cast<double>(rows) / field.width * count, 1e-12 * energy[0]);
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
  basis.weights.resize(n, field.pictures);
  for (int k = 0; k < field.pictures; ++k) {
    const Eigen::VectorXf u = field.at(k);
    basis.weights.col(k) = shapes.transpose() * u;
    const Eigen::VectorXf missed = u - shapes * basis.weights.col(k);
    for (Eigen::Index v = 0; v + field.width <= rows; v += field.width) {
      basis.largest = std::max(basis.largest, static_cast<double>(u.segment(v, field.width).norm()));
      basis.error = std::max(basis.error, static_cast<double>(missed.segment(v, field.width).norm()));
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

}  // namespace

ShapeBasis make_shape_basis(const Animation& animation, int body, double relative) {
  BodyMemory memory;
  return make_basis({.rows = static_cast<Eigen::Index>(animation.bodies[body].rest.size()),
                     .width = 3,
                     .pictures = animation.count,
                     .at = [&](int picture) { return displacement_at(animation, body, picture, memory); }},
                    relative);
}

VectorBasis make_stress_basis(const Animation& animation, const RenderSettings& settings, int body, double relative) {
  const BodyModel& model = animation.bodies[body];
  ScalarMemory work;
  std::vector<float> vertices, values;
  VectorBasis out;
  const auto update = [&](int picture) {
    out.width = update_stress_vectors({model, *animation.results, static_cast<size_t>(body), settings}, picture_time(animation, picture),
                                      work, vertices);
    values.clear();
    if (out.width == 0) return;
    for (const int p : model.mesh.point_position) {
      const auto at = vertices.begin() + static_cast<std::ptrdiff_t>(p) * out.width;
      values.insert(values.end(), at, at + out.width);
    }
  };
  update(0);
  if (out.width == 0) return out;
  out.basis = make_basis({.rows = static_cast<Eigen::Index>(values.size()),
                          .width = out.width,
                          .pictures = animation.count,
                          .at =
                              [&](int picture) {
                                update(picture);
                                return Eigen::Map<const Eigen::VectorXf>(values.data(), static_cast<Eigen::Index>(values.size()));
                              }},
                         relative);
  return out;
}

Eigen::VectorXf shape_weights(const ShapeBasis& basis, std::span<const float> displacement) {
  const Eigen::Map<const Eigen::VectorXf> u(displacement.data(), static_cast<Eigen::Index>(displacement.size()));
  // They are at right angles to each other.
  return (basis.shapes.transpose() * u).cwiseQuotient(basis.shapes.colwise().squaredNorm().transpose());
}

ShapeBasis make_value_basis(const Animation& animation, const RenderSettings& settings, int body, double relative) {
  const BodyModel& model = animation.bodies[body];
  BodyMemory memory;
  ScalarMemory work;
  std::vector<float> vertex_values, values;
  const auto update = [&](int picture) {
    if (model.flexible) displacement_at(animation, body, picture, memory);
    update_scalars({model, *animation.results, static_cast<size_t>(body), settings}, picture_time(animation, picture), memory, work,
                   vertex_values);
    values.clear();
    if (vertex_values.empty()) return;
    // Not a number where nothing is known: no shape can hold that.
    for (const int p : model.mesh.point_position) values.push_back(std::isfinite(vertex_values[p]) ? vertex_values[p] : 0.0f);
  };
  update(0);
  if (std::none_of(vertex_values.begin(), vertex_values.end(), [](float v) { return std::isfinite(v); })) {
    ShapeBasis none;
    none.largest = -1.0;
    return none;
  }
  return make_basis({.rows = static_cast<Eigen::Index>(values.size()),
                     .pictures = animation.count,
                     .at =
                         [&](int picture) {
                           update(picture);
                           return Eigen::Map<const Eigen::VectorXf>(values.data(), static_cast<Eigen::Index>(values.size()));
                         }},
                    relative);
}

}  // namespace flexframe::film
