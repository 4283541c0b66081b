#include "sim/dynamics/loop_descent.h"

#include "sim/base/eigen_solvers.h"
#include "sim/dynamics/closure.h"
#include "sim/model/joint_motion.h"

namespace flexframe::sim {

MatX scaled_columns(const Model& model, const Work& work, int cluster, const std::vector<int>& columns, const VecX& row_scale) {
  const ClusterWork& cw = work.clusters[cluster];
  MatX A(cw.G.rows(), columns.size());
  for (size_t k = 0; k < columns.size(); ++k)
    A.col(k) = row_scale.cwiseProduct(cw.G.col(columns[k])) / rate_scale(model, cluster, columns[k]);
  return A;
}

void move_rates(const Model& model, const Cluster& c, const std::vector<int>& columns, const VecX& step, Work& work) {
  for (int i : c.parts) {
    const Part& p = model.parts[i];
    double dw[6] = {};
    bool moved = false;
    for (size_t k = 0; k < columns.size(); ++k) {
      const int v = c.v0 + columns[k];
      if (v >= p.v0 && v < p.v0 + p.joint.nv) dw[v - p.v0] = step[k], moved = true;
    }
    if (moved) move_coordinates(p.joint.kind, work.q.data() + p.q0, dw);
  }
}

double descend(const Model& model, int cluster, const std::vector<int>& columns, Work& work) {
  const Cluster& c = model.clusters[cluster];
  const VecX rows = closure_row_scales(model, work, cluster);
  const auto evaluate = [&]() {
    update_cluster_positions(model, cluster, work);
    update_closure_residual(model, cluster, work);
    return VecX(rows.cwiseProduct(work.clusters[cluster].residual));
  };
  VecX r = evaluate();
  // Every coordinate of the loop is given or driven: nothing can move.
  if (columns.empty()) return r.size() > 0 ? r.cwiseAbs().maxCoeff() : 0.0;
  double damping = 0.0;
  for (int iteration = 0; !columns.empty() && iteration < 200 && r.cwiseAbs().maxCoeff() > 1e-14 * c.size; ++iteration) {
    update_closure_matrix(model, cluster, work);
    const MatX A = scaled_columns(model, work, cluster, columns, rows);
    const ThinSvd svd(A);
    const VecX& s = svd.singularValues();
    const VecX b = svd.matrixU().transpose() * r;
    const VecX before = work.q;
    bool better = false;
    for (int attempt = 0; attempt < 12 && !better; ++attempt) {
      VecX y = VecX::Zero(s.size());
      for (int k = 0; k < s.size(); ++k)
        if (s[k] > 1e-10 * std::max(1.0, s[0])) y[k] = -s[k] * b[k] / (s[k] * s[k] + damping);
      VecX step = svd.matrixV() * y;
      // No step beyond half a radian or half the size: the branch nearest to the start is wanted.
      const double longest = step.size() > 0 ? step.cwiseAbs().maxCoeff() : 0.0;
      if (longest > 0.5 * c.size) step *= 0.5 * c.size / longest;
      for (size_t k = 0; k < columns.size(); ++k) step[k] /= rate_scale(model, cluster, columns[k]);
      move_rates(model, c, columns, step, work);
      const VecX next = evaluate();
      if (next.norm() < r.norm()) {
        better = true;
        r = next;
        damping = damping < 1e-12 ? 0.0 : 0.1 * damping;
      } else {
        work.q = before;
        damping = damping == 0.0 ? 1e-6 : 10.0 * damping;
      }
    }
    if (!better) break;
  }
  evaluate();
  return r.cwiseAbs().maxCoeff();
}

}  // namespace flexframe::sim
