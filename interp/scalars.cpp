#include "interp/scalars.h"

#include "interp/graph.h"
#include "interp/parallel.h"
#include "interp/partition.h"

#include <fmt/format.h>

#include <cmath>

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

}  // namespace flexframe::interp
