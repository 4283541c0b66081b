#include "sim/start/massless_modes.h"

#include "sim/base/eigen_solvers.h"
#include "sim/dynamics/massless.h"

#include <algorithm>

namespace flexframe::sim {
namespace {

// Columns of directions: with mass, and without it where springs alone act, and where dampers do.
struct Massless {
  MatX masses, stiff, damped;
};

// Directions that keep their rates, and those without mass, of which the ones that nothing acts on rest.
Massless split_directions(const std::vector<Direction>& all, const MasslessRates& massless, const MasslessWork& balance) {
  const Eigen::Index n = static_cast<Eigen::Index>(all.size());
  MatX Z(n, massless.moving);
  Massless out;
  out.masses = MatX::Zero(n, n - static_cast<Eigen::Index>(massless.rates.size()));
  for (Eigen::Index k = 0, at = 0; k < n; ++k) {
    const int v = all[k].v;
    Z.row(k) = massless.Z.row(v).leftCols(massless.moving);
    if (std::find(massless.rates.begin(), massless.rates.end(), v) == massless.rates.end()) out.masses(k, at++) = 1.0;
  }
  out.stiff = balance.stiff.empty() ? MatX(n, 0) : MatX(Z * balance.undamped);
  out.damped.resize(n, static_cast<Eigen::Index>(balance.damped.size()));
  for (size_t k = 0; k < balance.damped.size(); ++k) out.damped.col(static_cast<Eigen::Index>(k)) = Z.col(balance.damped[k]);
  return out;
}

}  // namespace

bool release_massless(Model& model, Work& work) {
  if (all_have_inertia(model)) return false;
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    ClusterWork& cw = work.clusters[c];
    if (cw.carried == 0) continue;
    cw.locked.clear();
    cw.carried = 0;
    cw.lock_value.resize(0);
    cw.lock_rate.resize(0);
    cw.partition = {};
    for (int k = 0; k < model.clusters[c].nv; ++k) cw.partition.ind.push_back(k);
  }
  model.massless = {};
  return true;
}

bool follow_massless(const System& given, const std::vector<Direction>& all, SecondOrder& s, MatX& N, std::vector<ComplexMode>& modes) {
  const Massless split = split_directions(all, given.model.massless, given.work.massless);
  MatX others(N.cols(), split.masses.cols() + split.damped.cols());
  others << split.masses, split.damped;
  if (split.stiff.cols() > 0)
    others -= (split.stiff * solve_square(split.stiff.transpose() * s.K * split.stiff, split.stiff.transpose() * s.K * others)).eval();
  const MatX M = others.transpose() * s.M * others, K = others.transpose() * s.K * others, D = others.transpose() * s.D * others,
             No = N * others;
  const MatX size = others.cwiseAbs();
  const MatX K_error = size.transpose() * s.K_error * size, D_error = size.transpose() * s.D_error * size;
  const Eigen::Index n = split.masses.cols(), f = split.damped.cols();
  s = {M.topLeftCorner(n, n), D.topLeftCorner(n, n), K.topLeftCorner(n, n), D_error.topLeftCorner(n, n), K_error.topLeftCorner(n, n)};
  N = No.leftCols(n);
  if (f == 0) return false;
  // z = [x; x'; coordinates of what is damped].
  MatX A = MatX::Zero(2 * n + f, 2 * n + f);
  A.block(0, n, n, n).setIdentity();
  MatX follow(f, 2 * n + f), pull(n, 2 * n + f);
  follow << K.bottomLeftCorner(f, n), D.bottomLeftCorner(f, n), K.bottomRightCorner(f, f);
  A.bottomRows(f) = -solve_square(D.bottomRightCorner(f, f), follow);
  pull << s.K, s.D, K.topRightCorner(n, f);
  if (n > 0) A.middleRows(n, n) = -Cholesky(s.M).solve(pull + D.topRightCorner(n, f) * A.bottomRows(f));
  modes = first_order_modes(A, A.cwiseAbs(), [&](const Eigen::VectorXcd& z) {
    Eigen::VectorXcd x(n + f);
    x << z.head(n), z.tail(f);
    return Eigen::VectorXcd(No * x);
  });
  return true;
}

}  // namespace flexframe::sim
