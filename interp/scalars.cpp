#include "interp/scalars.h"

#include "interp/graph.h"
#include "interp/parallel.h"
#include "interp/partition.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace flexframe::interp {

Eigen::MatrixXf map_scalars(const Points& nodes, const MeshView& mesh, int parts, const Eigen::Ref<const Eigen::MatrixXd>& values) {
  if (nodes.rows() == 0) throw InputError("no nodes that know the field");
  if (mesh.triangles.rows() == 0) throw InputError("the mesh has no faces");
  if (parts < 1 || values.rows() != parts * nodes.rows())
    throw InputError(fmt::format("a field of {} rows given, {} nodes need {}", values.rows(), nodes.rows(), parts * nodes.rows()));
  if (!nodes.allFinite() || !mesh.vertices.allFinite() || !values.allFinite())
    throw InputError("the field, its nodes or the mesh hold numbers that are not finite");
  const Eigen::Index fields = values.cols();

  // One node a place.
  const double size = (mesh.vertices.colwise().maxCoeff() - mesh.vertices.colwise().minCoeff()).norm();
  const PointGrid grid(nodes);
  std::vector<int> place(nodes.rows(), -1), near;
  std::vector<double> count;
  std::vector<int> first;
  for (int i = 0; i < nodes.rows(); ++i) {
    if (place[i] >= 0) continue;
    grid.within(nodes.row(i).transpose(), 1e-6 * size, near);
    count.push_back(0.0);
    for (const int j : near)
      if (place[j] < 0) {
        place[j] = static_cast<int>(first.size());
        count.back() += 1.0;
      }
    first.push_back(i);
  }
  Points centres(static_cast<Eigen::Index>(first.size()), 3);
  for (size_t k = 0; k < first.size(); ++k) centres.row(static_cast<Eigen::Index>(k)) = nodes.row(first[k]);
  // A row a node, the components of all fields side by side.
  RowsF sources = RowsF::Zero(centres.rows(), parts * fields);
  for (Eigen::Index i = 0; i < nodes.rows(); ++i) {
    const int k = place[i];
    for (int c = 0; c < parts; ++c) sources.row(k).segment(c * fields, fields) += (values.row(parts * i + c) / count[k]).cast<float>();
  }

  const Weld weld = weld_vertices(mesh, 1e-7 * size);
  PartitionOptions how;
  how.kernel = KernelType::linear;
  how.arms = false;
  how.threads = thread_count(0);
  const Partition part = make_partition(weld, make_graph(weld, centres, 8, true), centres, how);
  RowsF rows;
  multiply_rows(part.weights, sources, rows, thread_count(0));
  Eigen::MatrixXf out(parts * mesh.vertices.rows(), fields);
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v)
    for (int c = 0; c < parts; ++c) out.row(parts * v + c) = rows.row(weld.row[v]).segment(c * fields, fields);
  return out;
}

void compute_von_mises(std::span<const float> stress, std::span<float> out) {
  for (size_t v = 0; v < out.size(); ++v) {
    const float* s = stress.data() + 6 * v;
    const float a = s[0] - s[1], b = s[1] - s[2], c = s[2] - s[0];
    out[v] = std::sqrt(0.5f * (a * a + b * b + c * c) + 3.0f * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
  }
}

namespace {

// Largest, middle and smallest principal stress.
std::array<double, 3> principal_stresses(const float* s) {
  const double mean = (double(s[0]) + s[1] + s[2]) / 3.0, xx = s[0] - mean, yy = s[1] - mean, zz = s[2] - mean;
  const double xy = s[3], yz = s[4], xz = s[5];
  const double p = std::sqrt((xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + xz * xz)) / 6.0);
  if (p == 0.0) return {mean, mean, mean};
  const double determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
  const double angle = std::acos(std::clamp(determinant / (2.0 * p * p * p), -1.0, 1.0)) / 3.0;  // 0 .. 60 degrees
  const double largest = 2.0 * p * std::cos(angle), smallest = 2.0 * p * std::cos(angle + 2.0 * std::numbers::pi / 3.0);
  return {mean + largest, mean - largest - smallest, mean + smallest};
}

}  // namespace

void compute_principal(std::span<const float> stress, int which, std::span<float> out) {
  const size_t row = 2 - static_cast<size_t>(std::clamp(which, 0, 2));
  for (size_t v = 0; v < out.size(); ++v) out[v] = static_cast<float>(principal_stresses(stress.data() + 6 * v)[row]);
}

void compute_tresca(std::span<const float> stress, std::span<float> out) {
  for (size_t v = 0; v < out.size(); ++v) {
    const std::array<double, 3> s = principal_stresses(stress.data() + 6 * v);
    out[v] = static_cast<float>(s[0] - s[2]);
  }
}

}  // namespace flexframe::interp
