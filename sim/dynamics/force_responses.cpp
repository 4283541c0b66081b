#include "sim/dynamics/force_responses.h"

#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/reduced_mass.h"

namespace flexframe::sim {
namespace {

// Of a cluster that is carried by one which moves.
struct Carried {
  bool moved = false;
  MatX U;      // six (in a plane three) x its independent rates: wrench at its base frame per force on a rate that rests
  MatX J;      // the carrying cluster's independent rates x six: forces on them per wrench at the base frame
  MatX shift;  // six x six: the same wrench at the base frame of the carrying cluster
};

template <class W>
Carried carried(const Model& model, W& work, int cluster) {
  using S = typename W::In;
  constexpr Eigen::Index size = S::linear + S::angular;
  const Cluster& c = model.clusters[static_cast<size_t>(cluster)];
  Carried out;
  if (c.parent == ground || !work.carrying.moves[c.parent]) return out;
  out.moved = true;
  const ClusterWork& cw = work.clusters[static_cast<size_t>(cluster)];
  const Eigen::Index n = static_cast<Eigen::Index>(cw.partition.ind.size());
  out.U.resize(size, n);
  const int first = c.parts.front();
  const auto& base = work.bases[static_cast<size_t>(cluster)];
  // A link has its momentum in the axes of its part.
  const bool link = work.carrying.link[cluster] && n == 1;
  for (Eigen::Index k = 0; k < n; ++k)
    out.U.col(k) = link ? typename S::Twist(wrench_to_parent(work.parts[first].in_base, typename S::Twist(column(work.parts[first].Fj, 0))))
                        : typename S::Twist(column(base.U, k));
  const int under = model.parts[c.parent].cluster;
  const Partition& split = work.clusters[static_cast<size_t>(under)].partition;
  const MatX& E = work.clusters[static_cast<size_t>(under)].E;
  out.J.resize(static_cast<Eigen::Index>(split.ind.size()), size);
  out.shift.resize(size, size);
  VecX line(model.clusters[static_cast<size_t>(under)].nv);
  for (Eigen::Index i = 0; i < size; ++i) {
    const typename S::Twist unit = S::Twist::Unit(i);
    line.setZero();
    project_wrench(model, work, under, {c.base, unit}, true, line);
    for (size_t k = 0; k < split.ind.size(); ++k) out.J(static_cast<Eigen::Index>(k), i) = line[split.ind[k]];
    for (size_t d = 0; d < split.dep.size(); ++d) out.J.col(i) += E.row(static_cast<Eigen::Index>(d)).transpose() * line[split.dep[d]];
    out.shift.col(i) = wrench_to_parent(work.parts[c.parent].in_base, typename S::Twist(wrench_to_parent(work.frames[c.base].pose, unit)));
  }
  return out;
}

}  // namespace

template <class W>
void force_responses(const Model& model, W& work, MatX& X) {
  const size_t clusters = model.clusters.size();
  std::vector<Carried> links(clusters);
  std::vector<Eigen::Index> first(clusters + 1, 0);
  for (size_t k = 0; k < clusters; ++k) {
    links[k] = carried(model, work, static_cast<int>(k));
    first[k + 1] = first[k] + static_cast<Eigen::Index>(work.clusters[k].partition.ind.size());
  }
  const auto rows = [&](size_t k) { return X.middleRows(first[k], first[k + 1] - first[k]); };
  const auto under = [&](size_t k) { return static_cast<size_t>(model.parts[static_cast<size_t>(model.clusters[k].parent)].cluster); };
  const auto solved = [&](size_t k, const MatX& forces) {
    MatX out = forces;
    if (out.rows() > 0) solve_mass(model, static_cast<int>(k), work, out);
    return out;
  };
  // Down: accelerations while the base rests, and the wrench which the base feels of it.
  std::vector<MatX> felt(clusters);
  for (size_t k = clusters; k-- > 0;) {
    const MatX alone = solved(k, rows(k));
    rows(k) = alone;
    if (!links[k].moved) continue;
    MatX wrench = links[k].U * alone;
    if (felt[k].size() > 0) wrench += felt[k];
    const size_t carrier = under(k);
    rows(carrier) -= links[k].J * wrench;
    const MatX below = links[k].shift * wrench;
    if (felt[carrier].size() == 0) felt[carrier] = below;
    else felt[carrier] += below;
  }
  // Up again, with the accelerations of the bases.
  std::vector<MatX> moved(clusters);
  for (size_t k = 0; k < clusters; ++k) {
    if (!links[k].moved) continue;
    const size_t carrier = under(k);
    moved[k] = links[k].J.transpose() * rows(carrier);
    if (moved[carrier].size() > 0) moved[k] += links[k].shift.transpose() * moved[carrier];
    rows(k) -= solved(k, links[k].U.transpose() * moved[k]);
  }
}

template void force_responses(const Model&, Work&, MatX&);
template void force_responses(const Model&, PlaneWork&, MatX&);

}  // namespace flexframe::sim
