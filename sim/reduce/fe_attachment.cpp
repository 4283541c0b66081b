// Attachments and choice of nodes. See fe_attachment.h.
#include "sim/reduce/fe_attachment.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>
#include <unordered_map>

namespace flexframe::sim {
namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;

struct Weighted {
  const std::vector<int>& nodes;
  const std::vector<double>& weights;  // empty: equal
  const Vec3& centre;                  // where their motion is wanted
  const std::vector<double>& turns;    // of rotations; empty: none
};

// Adds the rows of the rigid motion at the centre that fits the translations of `nodes` best: (sum w B^T B)^-1 sum w B^T u, B = [1,
// -skew(r)]; where rotations of nodes count, theirs too. Rotations about a line on which all nodes lie cannot be seen by translations: they
// are the mean of the nodes' own, zero where these have none. rows: 0 all six, 3 rotations only. Returns the middle.
Vec3 fit(const FeModel& model, const FeSystem& system, const Weighted& of, int from_row, Triplets& out, FeAttachment* into = nullptr) {
  const std::vector<int>& nodes = of.nodes;
  const auto weight = [&](size_t i) { return of.weights.empty() ? 1.0 : of.weights[i]; };
  double size = 0.0, total = 0.0;
  Vec3 middle = Vec3::Zero();
  for (size_t i = 0; i < nodes.size(); ++i)
    if (moves(system.dof[nodes[i]])) {
      middle += weight(i) * model.nodes[nodes[i]];
      total += weight(i);
    }
  if (!(total > 0.0)) return of.centre;
  middle /= total;
  for (int n : nodes)
    if (moves(system.dof[n])) size = std::max(size, (model.nodes[n] - middle).norm());
  // About the middle the normal equations fall apart into translations and rotations.
  Mat3 inertia = Mat3::Zero();
  for (size_t i = 0; i < nodes.size(); ++i) {
    if (!moves(system.dof[nodes[i]])) continue;
    const Vec3 r = model.nodes[nodes[i]] - middle;
    inertia += weight(i) * (r.squaredNorm() * Mat3::Identity() - r * r.transpose());
  }
  const Mat3 spread = 0.5 * inertia.trace() * Mat3::Identity() - inertia;
  const auto turns = [&](size_t i) { return of.turns.empty() || system.dof[nodes[i]][3] < 0 ? 0.0 : of.turns[i]; };
  for (size_t i = 0; i < nodes.size(); ++i) inertia += turns(i) * Mat3::Identity();
  Eigen::SelfAdjointEigenSolver<Mat3> eigen(inertia);
  Vec3 inverse = Vec3::Zero();
  const double scale = of.weights.empty() ? 1.0 : total / static_cast<double>(nodes.size());
  for (int k = 0; k < 3; ++k)
    if (eigen.eigenvalues()(k) > 1e-10 * size * size * scale) inverse(k) = 1.0 / eigen.eigenvalues()(k);
  const Mat3 pseudo = eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
  if (into) {
    into->spread = spread;
    into->fitted = pseudo;
  }
  const Vec3 arm = of.centre - middle;
  const Mat3 unseen = eigen.eigenvectors() * inverse.unaryExpr([](double k) { return k == 0.0 ? 1.0 : 0.0; }).asDiagonal() *
                      eigen.eigenvectors().transpose();
  double turning = 0.0;
  for (size_t i = 0; i < nodes.size(); ++i) turning += system.dof[nodes[i]][3] >= 0 ? weight(i) : 0.0;
  for (size_t i = 0; i < nodes.size() && turning > 0.0 && !unseen.isZero(0.0); ++i)
    for (int d = 0; d < 3; ++d) {
      const int own = system.dof[nodes[i]][3 + d];
      if (own < 0) continue;
      const Vec3 turn = weight(i) / turning * unseen.col(d), move = turn.cross(arm);
      for (int k = 0; k < 3; ++k) {
        if (from_row == 0 && move(k) != 0.0) out.emplace_back(k, own, move(k));
        if (turn(k) != 0.0) out.emplace_back(3 + k, own, turn(k));
      }
    }
  for (size_t i = 0; i < nodes.size(); ++i) {
    const int n = nodes[i];
    if (!moves(system.dof[n])) continue;
    const Vec3 r = model.nodes[n] - middle;
    for (int d = 0; d < 3; ++d) {
      if (system.dof[n][d] < 0) continue;
      const Vec3 e = weight(i) * Vec3::Unit(d);
      const Vec3 turn = pseudo * r.cross(e);
      const Vec3 move = e / total + turn.cross(arm);
      for (int k = 0; k < 3; ++k) {
        if (from_row == 0 && move(k) != 0.0) out.emplace_back(k, system.dof[n][d], move(k));
        if (turn(k) != 0.0) out.emplace_back(3 + k, system.dof[n][d], turn(k));
      }
    }
    for (int d = 0; d < 3 && turns(i) > 0.0; ++d) {
      const Vec3 turn = turns(i) * pseudo.col(d), move = turn.cross(arm);
      for (int k = 0; k < 3 && system.dof[n][3 + d] >= 0; ++k) {
        if (from_row == 0 && move(k) != 0.0) out.emplace_back(k, system.dof[n][3 + d], move(k));
        if (turn(k) != 0.0) out.emplace_back(3 + k, system.dof[n][3 + d], turn(k));
      }
    }
  }
  return middle;
}

}  // namespace

std::vector<std::vector<int>> node_neighbours(const FeModel& model, const std::vector<int>& nodes) {
  std::unordered_map<int, int> place;
  for (size_t i = 0; i < nodes.size(); ++i) place.emplace(nodes[i], static_cast<int>(i));
  std::vector<std::set<int>> sets(nodes.size());
  for (const FeElement& e : model.elements)
    for (int i = 0; i < e.count; ++i)
      if (const auto it = place.find(model.connectivity[e.first + i]); it != place.end())
        for (int j = 0; j < e.count; ++j) sets[it->second].insert(model.connectivity[e.first + j]);
  std::vector<std::vector<int>> out;
  for (const int node : nodes) {
    // The same node may be asked for twice.
    const auto& set = sets[place.at(node)];
    out.emplace_back(set.begin(), set.end());
  }
  return out;
}

FeAttachment node_attachment(const FeModel& model, const FeSystem& system, const std::vector<std::vector<int>>& neighbours, int node) {
  FeAttachment a;
  a.id = fmt::format("{}", model.node_ids[node]);
  a.position = model.nodes[node];
  if (!moves(system.dof[node]))
    throw InputError(fmt::format("{}: node {} belongs to no element, or is held", model.file, model.node_ids[node]));
  Triplets t;
  for (int d = 0; d < 6; ++d)
    if (system.dof[node][d] >= 0) t.emplace_back(d, system.dof[node][d], 1.0);
  if (system.dof[node][3] < 0) {
    a.own_rotation = false;
    const std::vector<double> equal;
    for (const auto& list : neighbours) fit(model, system, {list, equal, a.position, equal}, 3, t);
  }
  a.motion.resize(6, system.size);
  a.motion.setFromTriplets(t.begin(), t.end());
  return a;
}

FeAttachment averaging_attachment(const FeModel& model, const FeSystem& system, const FeSpider& spider) {
  FeAttachment a;
  a.id = spider.name.empty() ? fmt::format("{}", model.node_ids[spider.node]) : spider.name;
  a.position = model.nodes[spider.node];
  Triplets t;
  a.arm = a.position - fit(model, system, {spider.slaves, spider.weights, a.position, spider.turns}, 0, t, &a);
  if (t.empty()) throw InputError(fmt::format("{}: spider '{}' reaches no node of an element", model.file, spider.name));
  a.motion.resize(6, system.size);
  a.motion.setFromTriplets(t.begin(), t.end());
  return a;
}

FeAttachment spider_attachment(const FeModel& model, const FeSystem& system, const FeSpider& spider) {
  if (!spider.rigid) return averaging_attachment(model, system, spider);
  FeAttachment a;
  a.id = spider.name.empty() ? fmt::format("{}", model.node_ids[spider.node]) : spider.name;
  a.position = model.nodes[spider.node];
  Triplets t;
  for (int d = 0; d < 6; ++d) t.emplace_back(d, system.dof[spider.node][d], 1.0);
  a.motion.resize(6, system.size);
  a.motion.setFromTriplets(t.begin(), t.end());
  return a;
}

std::vector<int> spread_nodes(const FeModel& model, const std::vector<int>& candidates, const std::vector<Vec3>& chosen, int count) {
  std::vector<int> out;
  if (candidates.empty()) return out;
  std::vector<double> distance(candidates.size(), std::numeric_limits<double>::max());
  const auto take = [&](const Vec3& p) {
    for (size_t i = 0; i < candidates.size(); ++i) distance[i] = std::min(distance[i], (model.nodes[candidates[i]] - p).squaredNorm());
  };
  if (chosen.empty()) {
    Vec3 middle = Vec3::Zero();
    for (int c : candidates) middle += model.nodes[c];
    middle /= static_cast<double>(candidates.size());
    for (size_t i = 0; i < candidates.size(); ++i) distance[i] = (model.nodes[candidates[i]] - middle).squaredNorm();
    const size_t far = std::max_element(distance.begin(), distance.end()) - distance.begin();
    std::fill(distance.begin(), distance.end(), std::numeric_limits<double>::max());
    if (count > 0) {
      out.push_back(candidates[far]);
      take(model.nodes[candidates[far]]);
    }
  }
  for (const Vec3& p : chosen) take(p);
  while (static_cast<int>(out.size()) < count) {
    const size_t far = std::max_element(distance.begin(), distance.end()) - distance.begin();
    if (!(distance[far] > 0.0)) break;
    out.push_back(candidates[far]);
    take(model.nodes[candidates[far]]);
  }
  return out;
}

}  // namespace flexframe::sim
