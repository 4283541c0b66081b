#include "sim/start/structural_matrices.h"

#include "sim/base/eigen_solvers.h"
#include "sim/bodies/body_terms.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/flexures.h"

namespace flexframe::sim {

StructuralMatrices structural_matrices(const Model& model, Work& work, const std::vector<Direction>& directions) {
  const Eigen::Index n = static_cast<Eigen::Index>(directions.size());
  StructuralMatrices out;
  out.N = MatX::Zero(model.nv, n);
  MatX& N = out.N;
  std::vector<MatX> twist(model.parts.size(), MatX::Zero(6, n));
  const std::vector<TimeJet> motion = work.motion;
  for (TimeJet& jet : work.motion) jet.rate = 0.0;
  update_positions(model, work);
  for (Eigen::Index k = 0; k < n; ++k) {
    work.w.setZero();
    work.w[directions[static_cast<size_t>(k)].v] = 1.0;
    update_velocities(model, work);
    N.col(k) = work.w;
    for (size_t i = 0; i < model.parts.size(); ++i) twist[i].col(k) = work.parts[i].V;
  }
  work.motion = motion;
  MatX &M = out.M, &D = out.D, &K = out.K;
  M = D = K = MatX::Zero(n, n);
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
  add_flexure_matrices(model, N, K, D);
  M = 0.5 * (M + M.transpose()).eval();
  return out;
}

StructuralVibrations structural_vibrations(const StructuralMatrices& matrices) {
  StructuralVibrations out;
  if (matrices.M.rows() == 0) return out;
  const GeneralizedEigen eigen(0.5 * (matrices.K + matrices.K.transpose()), matrices.M);
  if (eigen.info() != Eigen::Success) return out;
  out.frequencies = eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  out.shapes = eigen.eigenvectors();
  out.amounts = out.shapes.transpose() * matrices.M;
  return out;
}

}  // namespace flexframe::sim
