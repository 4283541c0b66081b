#include "interp/skeleton.h"

#include "interp/dense_solvers.h"
#include "interp/parallel.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <queue>
#include <set>

namespace flexframe::interp {
namespace {

constexpr int most_nodes = 5000;
constexpr size_t around = 12;  // nodes near a node among which its neighbours are

using Neighbours = std::vector<std::set<int>>;

// How often a closed part of the mesh winds round a point (van Oosterom and Strackee, The solid angle of a plane triangle, 1983, eq. 8):
// 1 inside, 0 outside, whichever way its faces look.
double winding(const Weld& weld, const std::vector<int>& triangles, const Vec3& x) {
  double sum = 0.0;
  for (const int t : triangles) {
    const auto corner = [&](int c) { return Vec3(weld.positions.row(weld.triangles(t, c)).transpose() - x); };
    const Vec3 a = corner(0), b = corner(1), c = corner(2);
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    const double volume = a.dot(b.cross(c));
    // A face in whose plane the point lies is seen from its edge; one that it lies on counts half.
    if (std::abs(volume) > 1e-9 * la * lb * lc)
      sum += 2.0 * std::atan2(volume, la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return std::abs(sum) / (4.0 * std::numbers::pi);
}

// Parts of the mesh, and to which of them each node belongs: those that it lies in, else those that it touches. In pipes that run into each
// other a node may lie nearer to the skin of a neighbour than to that of its own.
struct Parts {
  int count = 0;
  std::vector<int> of_vertex;
  std::vector<std::set<int>> touched, of_node;  // by each node
};

Parts find_parts(const Weld& weld, const Graph& graph, const Points& nodes) {
  Parts parts;
  parts.of_vertex = part_of_vertices(weld, parts.count);
  parts.touched.resize(nodes.rows());
  for (int i = 0; i < graph.nodes; ++i)
    for (int a = graph.node_begin[i]; a < graph.node_begin[i + 1]; ++a) parts.touched[i].insert(parts.of_vertex[graph.node_vertex[a]]);
  parts.of_node = parts.touched;
  constexpr double most_work = 5e7;
  if (parts.count < 2 || parts.count > 1000 || static_cast<double>(nodes.rows()) * static_cast<double>(weld.triangles.rows()) > most_work)
    return parts;
  std::vector<std::vector<int>> triangles(parts.count);
  for (int t = 0; t < weld.triangles.rows(); ++t) triangles[parts.of_vertex[weld.triangles(t, 0)]].push_back(t);
  std::vector<Eigen::AlignedBox3d> box(parts.count);
  for (Eigen::Index v = 0; v < weld.positions.rows(); ++v) box[parts.of_vertex[v]].extend(weld.positions.row(v).transpose());
  for (Eigen::Index i = 0; i < nodes.rows(); ++i) {
    const Vec3 x = nodes.row(i).transpose();
    std::set<int> inside;
    // A node at the middle of an end has half of the part round it.
    for (int p = 0; p < parts.count; ++p)
      if (box[p].exteriorDistance(x) <= 1e-3 * box[p].diagonal().norm() && winding(weld, triangles[p], x) > 0.2) inside.insert(p);
    if (!inside.empty()) parts.of_node[i] = std::move(inside);
  }
  return parts;
}

// Other nodes near each, with the length of the way: along the surface, less what the nodes lie off it; straight between nodes in a part
// that one of them does not touch (the middle of a joint of pipes).
std::vector<std::vector<std::pair<double, int>>> near_nodes(const Weld& weld, const Graph& graph, const Points& nodes, const Parts& parts) {
  std::vector<std::vector<std::pair<double, int>>> near(graph.nodes);
  const auto common = [](const std::set<int>& a, const std::set<int>& b) {
    return std::any_of(a.begin(), a.end(), [&](int p) { return b.contains(p); });
  };
  Search search;
  for (int i = 0; i < graph.nodes; ++i) {
    grow(graph, weld.positions, graph.vertices + i, static_cast<int>(around) + 1, search);
    std::set<int> along;
    const auto joined = [&](int j) {
      return j != i && common(parts.of_node[i], parts.of_node[j]) && common(parts.touched[i], parts.touched[j]);
    };
    for (size_t k = 0; k < search.node.size(); ++k)
      if (const int j = search.node[k]; joined(j)) {
        const double straight = (nodes.row(i) - nodes.row(j)).norm();
        near[i].emplace_back(std::max(straight, search.node_distance[k] - graph.off_mesh[i] - graph.off_mesh[j]), j);
        along.insert(j);
      }
    for (int j = 0; j < graph.nodes && parts.count > 1; ++j)
      if (j != i && !along.contains(j) && common(parts.of_node[i], parts.of_node[j]))
        near[i].emplace_back((nodes.row(i) - nodes.row(j)).norm(), j);
    std::sort(near[i].begin(), near[i].end());
    near[i].resize(std::min(near[i].size(), 2 * around));
  }
  return near;
}

// Two nodes follow one another if no third one, of a part that both belong to, lies in the ball over the way between them.
Neighbours gabriel_neighbours(const std::vector<std::vector<std::pair<double, int>>>& near, const Parts& parts) {
  Neighbours out(near.size());
  const auto distance = [&](int a, int b) {
    const auto at = std::find_if(near[a].begin(), near[a].end(), [&](const auto& n) { return n.second == b; });
    return at != near[a].end() ? at->first : std::numeric_limits<double>::infinity();
  };
  const auto in_common = [&](int i, int j, int m) {
    return std::any_of(parts.of_node[i].begin(), parts.of_node[i].end(),
                       [&](int p) { return parts.of_node[j].contains(p) && parts.of_node[m].contains(p); });
  };
  for (int i = 0; i < static_cast<int>(near.size()); ++i)
    for (const auto& [d, j] : near[i]) {
      const double least2 = (1.0 - 1e-6) * d * d;
      const auto between = [&, j = j](const auto& m) {
        if (m.second == j || m.first * m.first >= least2 || !in_common(i, j, m.second)) return false;
        const double rest = std::min(distance(m.second, j), distance(j, m.second));
        return m.first * m.first + rest * rest < least2;
      };
      if (std::any_of(near[i].begin(), near[i].end(), between)) continue;
      out[i].insert(j);
      out[j].insert(i);
    }
  return out;
}

// A look at some of many nodes: whether they have three neighbours and more, as nodes all over a surface do.
bool is_spread(const Weld& weld, const Graph& graph, const Points& nodes) {
  constexpr int enough = 100, looked = 24;
  if (graph.nodes < enough) return false;
  Search search;
  int neighbours = 0;
  for (int k = 0; k < looked; ++k) {
    const int i = static_cast<int>(static_cast<long>(k) * graph.nodes / looked);
    grow(graph, weld.positions, graph.vertices + i, static_cast<int>(around) + 1, search);
    const auto gap2 = [&](int a, int b) { return (nodes.row(a) - nodes.row(b)).squaredNorm(); };
    for (const int j : search.node)
      neighbours += j != i && std::none_of(search.node.begin(), search.node.end(),
                                           [&](int m) { return m != i && m != j && gap2(i, m) + gap2(m, j) < (1.0 - 1e-6) * gap2(i, j); });
  }
  return neighbours > 3 * looked;
}

// How sharply the line turns at a node with two neighbours: angle, and angle by length.
struct Bend {
  double angle = 0.0, curvature = 0.0;
};
Bend bend_at(const Points& nodes, const Neighbours& neighbours, int i) {
  const Vec3 a = (nodes.row(i) - nodes.row(*neighbours[i].begin())).transpose(),
             b = (nodes.row(*neighbours[i].rbegin()) - nodes.row(i)).transpose();
  const double angle = std::atan2(a.cross(b).norm(), a.dot(b));
  return {angle, 2.0 * angle / (a.norm() + b.norm())};
}

// A corner turns by more than 25 degrees and 2.5 times as sharply as the line beside it.
bool is_corner(const Points& nodes, const Neighbours& neighbours, int i) {
  const Bend own = bend_at(nodes, neighbours, i);
  if (own.angle < 25.0 / 180.0 * std::numbers::pi) return false;
  double beside = 0.0;
  int known = 0;
  for (const int j : neighbours[i])
    if (neighbours[j].size() == 2) {
      beside = std::max(beside, bend_at(nodes, neighbours, j).curvature);
      ++known;
    }
  return known > 0 ? own.curvature > 2.5 * beside : own.angle > 60.0 / 180.0 * std::numbers::pi;
}

std::vector<NodeRow> find_chains(const Points& nodes, const Neighbours& neighbours, int& branches) {
  const auto count = static_cast<int>(neighbours.size());
  std::vector<char> stop(count);
  branches = 0;
  for (int i = 0; i < count; ++i) {
    stop[i] = neighbours[i].size() != 2 || is_corner(nodes, neighbours, i);
    branches += neighbours[i].size() > 2;
  }
  std::set<std::pair<int, int>> used;
  std::vector<NodeRow> chains;
  auto follow = [&](int from, int to) {
    NodeRow row{{from}, false};
    for (int a = from, b = to;;) {
      used.insert({a, b});
      used.insert({b, a});
      row.closed = b == from && !stop[b];
      if (!row.closed) row.node.push_back(b);
      if (stop[b] || row.closed) break;
      const int next = *neighbours[b].begin() == a ? *neighbours[b].rbegin() : *neighbours[b].begin();
      a = b;
      b = next;
    }
    chains.push_back(std::move(row));
  };
  for (int i = 0; i < count; ++i) {
    if (neighbours[i].empty()) chains.push_back({{i}, false});
    if (!stop[i]) continue;
    for (const int j : neighbours[i])
      if (!used.contains({i, j})) follow(i, j);
  }
  for (int i = 0; i < count; ++i)
    if (!stop[i] && !used.contains({i, *neighbours[i].begin()})) follow(i, *neighbours[i].begin());
  return chains;
}

// Nearest node along the surface, for every vertex.
std::vector<int> label_vertices(const Graph& graph) {
  std::vector<int> label(graph.vertices, -1);
  std::vector<double> distance(graph.vertices, std::numeric_limits<double>::infinity());
  using Entry = std::tuple<double, int, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;
  for (int i = 0; i < graph.nodes; ++i)
    for (int a = graph.node_begin[i]; a < graph.node_begin[i + 1]; ++a) front.emplace(graph.node_length[a], graph.node_vertex[a], i);
  while (!front.empty()) {
    const auto [d, v, i] = front.top();
    front.pop();
    if (d >= distance[v]) continue;
    distance[v] = d;
    label[v] = i;
    for (int e = graph.begin[v]; e < graph.begin[v + 1]; ++e)
      if (const double to = d + static_cast<double>(graph.length[e]); to < distance[graph.neighbour[e]])
        front.emplace(to, graph.neighbour[e], i);
  }
  return label;
}

// Intervals of the chains within two neighbours of each node.
std::vector<std::vector<int>> intervals_beside(const CurveLift& curves, const Neighbours& neighbours) {
  std::vector<std::vector<int>> own(neighbours.size()), out(neighbours.size());
  for (int c = 0; c < static_cast<int>(curves.chains.size()); ++c) {
    const Chain& chain = curves.chains[c];
    const auto n = static_cast<int>(chain.node.size());
    for (int k = 0; k < std::max<int>(1, static_cast<int>(chain.span.size())); ++k)
      for (const int node : {chain.node[k], chain.node[(k + 1) % n]}) {
        own[node].push_back(c);
        own[node].push_back(k);
      }
  }
  for (size_t i = 0; i < neighbours.size(); ++i) {
    std::set<std::pair<int, int>> all;
    auto take = [&](int node) {
      for (size_t k = 0; k < own[node].size(); k += 2) all.insert({own[node][k], own[node][k + 1]});
    };
    take(static_cast<int>(i));
    for (const int j : neighbours[i]) take(j);
    for (const auto& [c, k] : all) {
      out[i].push_back(c);
      out[i].push_back(k);
    }
  }
  return out;
}

// An interval runs inside the parts that both its nodes belong to.
void set_owners(const Parts& parts, Skeleton& skeleton) {
  skeleton.part = parts.of_vertex;
  for (const Chain& chain : skeleton.curves.chains) {
    auto& owners = skeleton.owners.emplace_back();
    for (size_t k = 0; k < std::max<size_t>(1, chain.span.size()); ++k) {
      const std::set<int>&a = parts.of_node[chain.node[k]], &b = parts.of_node[chain.node[(k + 1) % chain.node.size()]];
      std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(owners.emplace_back()));
    }
  }
}

// Feet of a vertex: of each chain the nearest, those so much farther than the nearest of all that they have no share left out.
void feet_of(const Skeleton& skeleton, int vertex, const Vec3& x, std::vector<Foot>& feet) {
  feet.clear();
  auto offer = [&](const Foot& foot) {
    for (Foot& known : feet)
      if (known.chain == foot.chain) {
        if (foot.distance < known.distance) known = foot;
        return;
      }
    feet.push_back(foot);
  };
  // A part of the mesh follows the lines inside it, if there are any.
  const auto owns = [&](int chain, int interval) {
    if (skeleton.part.empty()) return true;
    const std::vector<int>& owners = skeleton.owners[chain][interval];
    return std::find(owners.begin(), owners.end(), skeleton.part[vertex]) != owners.end();
  };
  const auto nearest_of = [&] {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Foot& f : feet) nearest = std::min(nearest, f.distance);
    return nearest;
  };
  if (const int label = skeleton.label[vertex]; label >= 0) {
    const std::vector<int>& beside = skeleton.beside[label];
    for (size_t k = 0; k < beside.size(); k += 2)
      if (owns(beside[k], beside[k + 1])) offer(find_foot(skeleton.curves, beside[k], beside[k + 1], beside[k + 1] + 1, x));
  }
  // Far from the lines near its node along the surface: the outer skin of a thick pipe. Then whatever line is nearest.
  for (const bool any : {false, true}) {
    if (any ? !feet.empty() : nearest_of() <= skeleton.reach) break;
    feet.clear();
    for (int c = 0; c < static_cast<int>(skeleton.curves.chains.size()); ++c)
      for (int k = 0; k < std::max<int>(1, static_cast<int>(skeleton.curves.chains[c].span.size())); ++k)
        if (any || owns(c, k)) offer(find_foot(skeleton.curves, c, k, k + 1, x));
  }
  const double nearest = nearest_of();
  std::erase_if(feet, [&](const Foot& f) { return f.distance > 1.4 * nearest; });
}

double middle_of(std::vector<double> values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[at];
}

// Slender: nearly all vertices lie about as far from the lines as the nodes from the surface, or much nearer than the nodes to each other.
bool is_slender(const Skeleton& skeleton, const Weld& weld, const Graph& graph, bool rotations_given) {
  std::vector<double> distance, span;
  std::vector<Foot> feet;
  const Eigen::Index step = std::max<Eigen::Index>(1, weld.positions.rows() / 2000);
  for (Eigen::Index v = 0; v < weld.positions.rows(); v += step) {
    feet_of(skeleton, static_cast<int>(v), weld.positions.row(v).transpose(), feet);
    double nearest = std::numeric_limits<double>::infinity();
    for (const Foot& f : feet) nearest = std::min(nearest, f.distance);
    distance.push_back(nearest);
  }
  for (const Chain& chain : skeleton.curves.chains) span.insert(span.end(), chain.span.begin(), chain.span.end());
  if (span.empty()) return false;
  const double section = middle_of(graph.off_mesh, 0.5), most = middle_of(distance, 0.95);
  if (!rotations_given) return section > 0.0 && most <= 1.6 * section && most <= middle_of(span, 0.5);
  return (section > 0.0 && most <= 3.0 * section) || most <= 0.35 * middle_of(span, 0.5);
}

}  // namespace

std::optional<Skeleton> find_skeleton(const Weld& weld, const Graph& graph, const Points& nodes, bool rotations_given) {
  if (graph.nodes < 3 || graph.nodes > most_nodes || weld.triangles.rows() == 0) return std::nullopt;
  const double off = middle_of(graph.off_mesh, 0.5);
  // A flat sheet has its own kernel, and lines across it are no lines along it.
  const Vec3 centre = weld.positions.colwise().mean().transpose();
  const Points local = weld.positions.rowwise() - centre.transpose();
  const PrincipalAxes principal = principal_axes(local.transpose() * local);
  if (principal.values[0] < 1e-10 * principal.values[2]) return std::nullopt;
  // Nodes on the surface without rotations tell nothing of sections.
  if (!rotations_given && !(off > 0.0)) return std::nullopt;
  if (is_spread(weld, graph, nodes)) return std::nullopt;
  const Parts parts = find_parts(weld, graph, nodes);
  const Neighbours neighbours = gabriel_neighbours(near_nodes(weld, graph, nodes, parts), parts);
  size_t ends = 0;
  for (const auto& n : neighbours) ends += n.size();
  // A surface of nodes has more than two and a half neighbours each. So may a small frame of bars, but not more than four (an octahedron).
  if (static_cast<double>(ends) > (graph.nodes > 24 ? 2.5 : 4.0) * graph.nodes) return std::nullopt;
  Skeleton skeleton;
  skeleton.label = label_vertices(graph);
  skeleton.reach = off > 0.0 ? 2.5 * off : std::numeric_limits<double>::infinity();
  skeleton.curves = make_curves(nodes, find_chains(nodes, neighbours, skeleton.branches), rotations_given);
  skeleton.beside = intervals_beside(skeleton.curves, neighbours);
  if (parts.count > 1) set_owners(parts, skeleton);
  if (!is_slender(skeleton, weld, graph, rotations_given)) return std::nullopt;
  return skeleton;
}

SparseWeights skeleton_weights(const Skeleton& skeleton, const Weld& weld, bool precise, int threads) {
  constexpr int grain = 4096;
  const auto count = static_cast<int>(weld.positions.rows());
  struct Rows {
    std::vector<int> count, column;
    std::vector<double> value;
  };
  std::vector<Rows> rows((count + grain - 1) / grain);
  parallel_chunks(count, grain, threads, [&](int first, int last) {
    Rows& out = rows[first / grain];
    std::vector<Foot> feet;
    std::vector<std::pair<int, double>> entries;
    for (int v = first; v < last; ++v) {
      const Vec3 x = weld.positions.row(v).transpose();
      feet_of(skeleton, v, x, feet);
      double nearest = std::numeric_limits<double>::infinity(), total = 0.0;
      for (const Foot& f : feet) nearest = std::min(nearest, f.distance);
      const auto share = [&](const Foot& f) {
        const double t = nearest > 0.0 ? (f.distance / nearest - 1.0) / 0.4 : (f.distance > 0.0 ? 1.0 : 0.0);
        return t < 1.0 ? (1.0 - t) * (1.0 - t) : 0.0;
      };
      for (const Foot& f : feet) total += share(f);
      entries.clear();
      for (const Foot& f : feet) add_foot(skeleton.curves, f, share(f) / total, x, entries);
      std::stable_sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
      const size_t begin = out.column.size();
      for (const auto& [source, weight] : entries) {
        if (out.column.size() > begin && out.column.back() == source) {
          out.value.back() += weight;
        } else if (weight != 0.0) {
          out.column.push_back(source);
          out.value.push_back(weight);
        }
      }
      out.count.push_back(static_cast<int>(out.column.size() - begin));
    }
  });
  SparseWeights w;
  w.rows = count;
  w.cols = source_count(skeleton.curves);
  for (const Rows& r : rows) {
    for (const int c : r.count) w.begin.push_back(w.begin.back() + c);
    w.column.insert(w.column.end(), r.column.begin(), r.column.end());
    for (const double value : r.value) w.single.push_back(static_cast<float>(value));
    if (precise) w.precise.insert(w.precise.end(), r.value.begin(), r.value.end());
  }
  return w;
}

std::optional<CurveLift> without_node(const CurveLift& curves, int chain_index, int place) {
  const Chain& chain = curves.chains[chain_index];
  const auto n = static_cast<int>(chain.node.size());
  if (n < 4 || (!chain.closed && (place == 0 || place == n - 1))) return std::nullopt;
  NodeRow row{{}, chain.closed};
  for (int k = 0; k < n; ++k)
    if (k != place) row.node.push_back(chain.node[k]);
  return make_curves(curves.positions, {row}, curves.given);
}

}  // namespace flexframe::interp
