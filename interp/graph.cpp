#include "interp/graph.h"

#include "interp/elastic.h"
#include "interp/watch.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <queue>

namespace flexframe::interp {
namespace {

// Nearest point of a triangle (Ericson, Real-time collision detection, 2005, 5.1.5), returns the distance.
double triangle_distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return ap.norm();
  const Vec3 bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return bp.norm();
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3) return (ap - ab * (d1 / (d1 - d3))).norm();
  const Vec3 cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return cp.norm();
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && d2 > d6) return (ap - ac * (d2 / (d2 - d6))).norm();
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 && d4 - d3 + d5 - d6 > 0.0)
    return (bp - (c - b) * ((d4 - d3) / (d4 - d3 + d5 - d6))).norm();
  const Vec3 n = ab.cross(ac);
  const double area = n.norm();
  return area > 0.0 ? std::abs(n.dot(ap)) / area : ap.norm();
}

struct Forest {
  std::vector<int> parent;
  explicit Forest(int n) : parent(n) { std::iota(parent.begin(), parent.end(), 0); }
  int root(int a) {
    while (parent[a] != a) a = parent[a] = parent[parent[a]];
    return a;
  }
  bool join(int a, int b) {
    a = root(a);
    b = root(b);
    parent[std::max(a, b)] = std::min(a, b);
    return a != b;
  }
};

struct Edge {
  int a, b;
};

void compress(int rows, const std::vector<Edge>& pairs, std::vector<int>& begin, std::vector<int>& to) {
  begin.assign(rows + 1, 0);
  for (const Edge& e : pairs) ++begin[e.a + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  to.resize(pairs.size());
  std::vector<int> fill(begin.begin(), begin.end() - 1);
  for (const Edge& e : pairs) to[fill[e.a]++] = e.b;
}

// Where the nodes touch the mesh: the corners of the triangle they lie on, else all vertices about as near as the nearest.
// Of several parts only those touch a node whose surface is about as near as the nearest.
void attach_nodes(Graph& graph, const Weld& weld, const Points& nodes, const PointGrid& grid) {
  graph.node_begin.assign(1, 0);
  int parts = 0;
  const std::vector<int> part = part_of_vertices(weld, parts);
  std::map<int, double> to_part;
  std::vector<int> near;
  for (Eigen::Index i = 0; i < nodes.rows(); ++i) {
    look();
    const Vec3 x = nodes.row(i).transpose();
    const int first = grid.nearest(x);
    const double to_vertex = (weld.positions.row(first).transpose() - x).norm();
    double to_surface = to_vertex;
    int corner[3] = {first, -1, -1};
    if (to_vertex > 0.0) {
      grid.within(x, 1.5 * to_vertex, near);
      if (near.size() > 64) near.resize(64);
      to_part.clear();
      for (const int v : near) {
        double& nearest = to_part.try_emplace(part[v], std::numeric_limits<double>::infinity()).first->second;
        nearest = std::min(nearest, (weld.positions.row(v).transpose() - x).norm());
        for (int c = graph.corner_begin[v]; c < graph.corner_begin[v + 1]; ++c) {
          const size_t at = 2 * static_cast<size_t>(c);
          const int b = graph.corner[at], d = graph.corner[at + 1];
          const double distance =
              triangle_distance(x, weld.positions.row(v).transpose(), weld.positions.row(b).transpose(), weld.positions.row(d).transpose());
          nearest = std::min(nearest, distance);
          if (distance < to_surface) {
            to_surface = distance;
            corner[0] = v;
            corner[1] = b;
            corner[2] = d;
          }
        }
      }
      // Above the middle of a triangle by less than a tenth of its size: on the surface.
      if (to_surface < 0.1 * to_vertex) {
        near.assign(corner, corner + 3);
      } else {
        std::erase_if(near, [&](int v) {
          return (weld.positions.row(v).transpose() - x).norm() > 1.3 * to_vertex ||
                 to_part.at(part[v]) > 1.3 * to_surface + 1e-9 * to_vertex;
        });
      }
    } else {
      near.assign(1, first);
    }
    graph.off_mesh.push_back(to_surface);
    for (const int v : near) {
      graph.node_vertex.push_back(v);
      graph.node_length.push_back((weld.positions.row(v).transpose() - x).norm());
    }
    graph.node_begin.push_back(static_cast<int>(graph.node_vertex.size()));
  }
}

}  // namespace

Weld weld_vertices(const MeshView& mesh, double distance) {
  Weld weld;
  const Eigen::Index count = mesh.vertices.rows();
  weld.row.assign(count, -1);
  // Cells of 16 times the distance: most balls of that radius touch one of them, and few vertices share one.
  const Vec3 lower = mesh.vertices.colwise().minCoeff().transpose();
  const double extent = (mesh.vertices.colwise().maxCoeff().transpose() - lower).maxCoeff();
  const double cell = std::max(16.0 * distance, extent > 0.0 ? 1e-9 * extent : 1.0);
  struct Key {
    std::int64_t x, y, z;
    bool operator==(const Key&) const = default;
  };
  // Kept vertices chained by the hash of their cell.
  std::vector<int> head(std::bit_ceil(static_cast<size_t>(2 * count + 1)), -1), next, kept;
  std::vector<Key> key;
  auto chain = [&](const Key& k) -> int& {
    auto h = static_cast<std::uint64_t>(k.x) * 0x9e3779b97f4a7c15ull;
    h = (h ^ (h >> 31) ^ static_cast<std::uint64_t>(k.y)) * 0xbf58476d1ce4e5b9ull;
    h = (h ^ (h >> 29) ^ static_cast<std::uint64_t>(k.z)) * 0x94d049bb133111ebull;
    return head[static_cast<size_t>(h ^ (h >> 32)) & (head.size() - 1)];
  };
  for (Eigen::Index v = 0; v < count; ++v) {
    if (v % 4096 == 0) look();
    const Vec3 x = mesh.vertices.row(v).transpose();
    const Vec3 grid = (x - lower) / cell;
    auto cell_at = [&](double shift) {
      const auto c = [&](double a) { return static_cast<std::int64_t>(std::floor(a + shift)); };
      return Key{c(grid.x()), c(grid.y()), c(grid.z())};
    };
    const double reach = distance / cell;
    const Key lo = cell_at(-reach), hi = cell_at(reach);
    int found = -1;
    for (std::int64_t i = lo.x; i <= hi.x && found < 0; ++i)
      for (std::int64_t j = lo.y; j <= hi.y && found < 0; ++j)
        for (std::int64_t k = lo.z; k <= hi.z && found < 0; ++k)
          for (int w = chain({i, j, k}); w >= 0; w = next[w])
            if ((found < 0 || w < found) && key[w] == Key{i, j, k} && (mesh.vertices.row(kept[w]).transpose() - x).norm() <= distance)
              found = w;
    if (found < 0) {
      found = static_cast<int>(kept.size());
      kept.push_back(static_cast<int>(v));
      key.push_back(cell_at(0.0));
      int& first = chain(key.back());
      next.push_back(first);
      first = found;
    }
    weld.row[v] = found;
  }
  weld.positions.resize(static_cast<Eigen::Index>(kept.size()), 3);
  for (size_t w = 0; w < kept.size(); ++w) weld.positions.row(static_cast<Eigen::Index>(w)) = mesh.vertices.row(kept[w]);
  std::vector<Eigen::Vector3i> triangles;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const Eigen::Vector3i c(weld.row[mesh.triangles(t, 0)], weld.row[mesh.triangles(t, 1)], weld.row[mesh.triangles(t, 2)]);
    if (c[0] != c[1] && c[1] != c[2] && c[2] != c[0]) triangles.push_back(c);
  }
  weld.triangles.resize(static_cast<Eigen::Index>(triangles.size()), 3);
  for (size_t t = 0; t < triangles.size(); ++t) weld.triangles.row(static_cast<Eigen::Index>(t)) = triangles[t].transpose();
  return weld;
}

std::vector<int> part_of_vertices(const Weld& weld, int& count) {
  const auto vertices = static_cast<int>(weld.positions.rows());
  Forest forest(vertices);
  for (Eigen::Index t = 0; t < weld.triangles.rows(); ++t)
    for (int c = 1; c < 3; ++c) forest.join(weld.triangles(t, 0), weld.triangles(t, c));
  // A root is the first vertex of its part.
  std::vector<int> part(vertices);
  count = 0;
  for (int v = 0; v < vertices; ++v) part[v] = forest.root(v) == v ? count++ : part[forest.root(v)];
  return part;
}

int drop_fins(Weld& weld) {
  // Sides of the triangles by their lower end: the other end, and the triangle.
  std::vector<int> begin(weld.positions.rows() + 1, 0), used(weld.positions.rows(), 0);
  for (Eigen::Index t = 0; t < weld.triangles.rows(); ++t)
    for (int c = 0; c < 3; ++c) {
      ++begin[std::min(weld.triangles(t, c), weld.triangles(t, (c + 1) % 3)) + 1];
      ++used[weld.triangles(t, c)];
    }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<Edge> sides(begin.back());
  std::vector<int> fill(begin.begin(), begin.end() - 1);
  for (int t = 0; t < weld.triangles.rows(); ++t)
    for (int c = 0; c < 3; ++c) {
      const int a = weld.triangles(t, c), b = weld.triangles(t, (c + 1) % 3);
      sides[fill[std::min(a, b)]++] = {std::max(a, b), t};
    }
  std::vector<char> single(weld.triangles.rows(), 0);
  for (Eigen::Index v = 0; v < weld.positions.rows(); ++v)
    for (int i = begin[v]; i < begin[v + 1]; ++i) {
      bool alone = true;
      for (int j = begin[v]; j < begin[v + 1] && alone; ++j) alone = j == i || sides[j].a != sides[i].a;
      if (alone) ++single[sides[i].b];
    }
  Eigen::Index kept = 0;
  for (Eigen::Index t = 0; t < weld.triangles.rows(); ++t) {
    const auto shared = [&](int c) { return used[weld.triangles(t, c)] > 1; };
    if (single[t] >= 2 && shared(0) && shared(1) && shared(2)) {
      for (int c = 0; c < 3; ++c) --used[weld.triangles(t, c)];
      continue;
    }
    weld.triangles.row(kept++) = weld.triangles.row(t);
  }
  const auto dropped = static_cast<int>(weld.triangles.rows() - kept);
  weld.triangles.conservativeResize(kept, 3);
  return dropped;
}

Points points_without_strays(const Weld& weld) {
  if (weld.triangles.rows() == 0) return weld.positions;
  int parts = 0;
  const std::vector<int> part = part_of_vertices(weld, parts);
  std::vector<int> faces(parts, 0);
  for (Eigen::Index t = 0; t < weld.triangles.rows(); ++t) ++faces[part[weld.triangles(t, 0)]];
  constexpr int few = 4, many = 100;
  const int most = *std::max_element(faces.begin(), faces.end());
  Points out(weld.positions.rows(), 3);
  Eigen::Index count = 0;
  for (Eigen::Index v = 0; v < weld.positions.rows(); ++v)
    if (const int f = faces[part[v]]; f > few || (f > 0 && f * many > most)) out.row(count++) = weld.positions.row(v);
  out.conservativeResize(count, 3);
  return out;
}

PointGrid::PointGrid(const Points& points) : points_(points) {
  const Eigen::Index n = points.rows();
  if (n == 0) {
    begin_.assign(2, 0);
    return;
  }
  lower_ = points.colwise().minCoeff().transpose();
  const Vec3 extent = points.colwise().maxCoeff().transpose() - lower_;
  // About two points a cell of a surface or volume; the number of cells is bounded by four times the points.
  const double largest = extent.maxCoeff();
  cell_ = largest > 0.0 ? largest / std::max(1.0, std::sqrt(static_cast<double>(n) / 2.0)) : 1.0;
  auto cells = [&](double cell) { return ((extent / cell).array().floor() + 1.0).prod(); };
  while (cells(cell_) > 4.0 * static_cast<double>(n) + 64.0) cell_ *= 1.3;
  size_ = (extent / cell_).array().floor().cast<int>() + 1;
  std::vector<Edge> pairs;
  pairs.reserve(n);
  for (Eigen::Index i = 0; i < n; ++i) pairs.push_back({static_cast<int>(slot(cell_of(points.row(i).transpose()))), static_cast<int>(i)});
  compress(size_.prod(), pairs, begin_, item_);
}

Eigen::Array3i PointGrid::cell_of(const Vec3& x) const {
  const Eigen::Array3d c = ((x - lower_) / cell_).array().floor();
  return c.max(0.0).min((size_ - 1).cast<double>()).cast<int>();
}
Eigen::Index PointGrid::slot(const Eigen::Array3i& c) const { return grid_slot(c, size_); }

int PointGrid::nearest(const Vec3& x) const {
  if (points_.rows() == 0) return -1;
  const Eigen::Array3i home = cell_of(x);
  int best = -1;
  double best2 = std::numeric_limits<double>::infinity();
  const int rings = size_.maxCoeff();
  // Rings of cells outward until no nearer point can lie in the next one.
  const Vec3 inside = x.cwiseMax(lower_).cwiseMin(lower_ + cell_ * size_.matrix().cast<double>());
  const double outside2 = (x - inside).squaredNorm();
  for (int ring = 0; ring <= rings; ++ring) {
    const double clear = std::max(0, ring - 1) * cell_;
    if (best >= 0 && outside2 + clear * clear > best2) break;
    const Eigen::Array3i lo = (home - ring).max(0), hi = (home + ring).min(size_ - 1);
    for (int k = lo[2]; k <= hi[2]; ++k)
      for (int j = lo[1]; j <= hi[1]; ++j)
        for (int i = lo[0]; i <= hi[0]; ++i) {
          if (std::max({std::abs(i - home[0]), std::abs(j - home[1]), std::abs(k - home[2])}) != ring) continue;
          const size_t s = slot({i, j, k});
          for (int p = begin_[s]; p < begin_[s + 1]; ++p) {
            const int index = item_[p];
            const double d2 = (points_.row(index).transpose() - x).squaredNorm();
            if (d2 < best2 || (d2 == best2 && index < best)) {
              best2 = d2;
              best = index;
            }
          }
        }
  }
  return best;
}

void PointGrid::within(const Vec3& x, double radius, std::vector<int>& out) const {
  out.clear();
  if (points_.rows() == 0) return;
  const Eigen::Array3i lo = cell_of(x - Vec3::Constant(radius)), hi = cell_of(x + Vec3::Constant(radius));
  for (int k = lo[2]; k <= hi[2]; ++k)
    for (int j = lo[1]; j <= hi[1]; ++j)
      for (int i = lo[0]; i <= hi[0]; ++i) {
        const size_t s = slot({i, j, k});
        for (int p = begin_[s]; p < begin_[s + 1]; ++p)
          if ((points_.row(item_[p]).transpose() - x).norm() <= radius) out.push_back(item_[p]);
      }
  std::sort(out.begin(), out.end());
}

namespace {

// Corners of the triangles by vertex.
void index_corners(Graph& graph, const Weld& weld) {
  graph.corner_begin.assign(graph.vertices + 1, 0);
  for (Eigen::Index t = 0; t < weld.triangles.rows(); ++t)
    for (int c = 0; c < 3; ++c) ++graph.corner_begin[weld.triangles(t, c) + 1];
  std::partial_sum(graph.corner_begin.begin(), graph.corner_begin.end(), graph.corner_begin.begin());
  graph.corner.resize(6 * weld.triangles.rows());
  std::vector<int> fill(graph.corner_begin.begin(), graph.corner_begin.end() - 1);
  for (Eigen::Index t = 0; t < weld.triangles.rows(); ++t)
    for (int c = 0; c < 3; ++c) {
      const size_t at = fill[weld.triangles(t, c)]++;
      graph.corner[2 * at] = weld.triangles(t, (c + 1) % 3);
      graph.corner[2 * at + 1] = weld.triangles(t, (c + 2) % 3);
    }
}

// In both directions.
std::vector<Edge> triangle_edges(const Weld& weld) {
  std::vector<Edge> edges;
  for (Eigen::Index t = 0; t < weld.triangles.rows(); ++t)
    for (int c = 0; c < 3; ++c) {
      edges.push_back({weld.triangles(t, c), weld.triangles(t, (c + 1) % 3)});
      edges.push_back({weld.triangles(t, (c + 1) % 3), weld.triangles(t, c)});
    }
  return edges;
}

// A cloud of points has no edges of its own: each point is joined to the nearest others, about as many as a vertex of a mesh has.
std::vector<Edge> cloud_edges(const Weld& weld, const PointGrid& grid) {
  constexpr size_t around = 8;
  const size_t count = weld.positions.rows();
  const size_t wanted = std::min(around, count - 1);
  std::vector<Edge> edges;
  std::vector<int> near;
  std::vector<std::pair<double, int>> nearest;
  double radius =
      (weld.positions.colwise().maxCoeff() - weld.positions.colwise().minCoeff()).norm() / std::sqrt(static_cast<double>(count));
  for (int v = 0; v < static_cast<int>(count); ++v) {
    if (v % 1024 == 0) look();
    const Vec3 x = weld.positions.row(v).transpose();
    for (grid.within(x, radius, near); near.size() <= wanted; grid.within(x, radius, near)) radius *= 1.5;
    nearest.clear();
    for (const int w : near)
      if (w != v) nearest.push_back({(weld.positions.row(w).transpose() - x).squaredNorm(), w});
    std::partial_sort(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(wanted), nearest.end());
    for (size_t k = 0; k < wanted; ++k) {
      edges.push_back({v, nearest[k].second});
      edges.push_back({nearest[k].second, v});
    }
    // Where points lie closer the next search is shorter.
    if (near.size() > 4 * around) radius /= 1.5;
  }
  return edges;
}

// Parts farther from all others than this share of the mesh's extent are no pieces of one body cut by a careless seam.
constexpr double apart = 1e-4;

// The nodes of a mesh's parts: where they are, and whether each has a rotation.
struct Held {
  const Points& nodes;
  bool rotations;
};

// Bridges between the parts of a mesh, smallest parts first: each group of parts that holds too few nodes is joined to the nearest vertex
// outside it, until it holds enough.
class Bridges {
 public:
  // part_of: a representative vertex of each vertex's part. grid: of the welded positions.
  Bridges(Graph& graph, const Weld& weld, const PointGrid& grid, std::vector<int> part_of, const Held& held)
      : graph_(graph),
        weld_(weld),
        grid_(grid),
        nodes_(held),
        part_of_(std::move(part_of)),
        group_(graph.vertices),
        members_(graph.vertices),
        held_(graph.vertices) {
    for (int v = 0; v < graph.vertices; ++v) members_[part_of_[v]].push_back(v);
    for (int i = 0; i < graph.nodes; ++i) {
      // Each part that a node touches.
      for (int a = graph.node_begin[i]; a < graph.node_begin[i + 1]; ++a)
        if (std::vector<int>& own = held_[part_of_[graph.node_vertex[a]]]; own.empty() || own.back() != i) own.push_back(i);
    }
    for (int v = 0; v < graph.vertices; ++v)
      if (part_of_[v] == v) parts_.push_back(v);
    std::stable_sort(parts_.begin(), parts_.end(), [&](int a, int b) { return members_[a].size() < members_[b].size(); });
    extent_ = (weld.positions.colwise().maxCoeff() - weld.positions.colwise().minCoeff()).norm();
  }

  void build(int enough, std::vector<Edge>& edges) {
    for (int round = 0; round < 40; ++round) {
      bool changed = false;
      for (const int part : parts_) {
        look();
        const int g = group_.root(part);
        if (static_cast<int>(held_[g].size()) >= std::min(enough, graph_.nodes) || static_cast<int>(members_[g].size()) == graph_.vertices)
          continue;
        if (g != part && round == 0) continue;
        changed = bridge(g, edges) || changed;
      }
      if (!changed && round > 0) break;
    }
    std::stable_sort(graph_.bridged.begin(), graph_.bridged.end(), [](const auto& a, const auto& b) { return a.vertices > b.vertices; });
    graph_.pieces = 0;
    for (const int part : parts_) graph_.pieces += group_.root(part) == part && !held_[part].empty();
  }

 private:
  struct Link {
    double length;
    int from, to;
  };

  // From (at most 2000 of) a group's vertices to the nearest ones outside it, within a ball of growing radius.
  std::vector<Link> links_from(int g) {
    const std::vector<int>& mine = members_[g];
    const size_t step = std::max<size_t>(1, mine.size() / 2000);
    std::vector<Link> links;
    for (double radius = 1e-3 * extent_; links.empty() && radius < 4.0 * extent_; radius *= 2.0)
      for (size_t m = 0; m < mine.size(); m += step) {
        look();
        const Vec3 x = weld_.positions.row(mine[m]).transpose();
        grid_.within(x, radius, near_);
        double best = std::numeric_limits<double>::infinity();
        int to = -1;
        for (const int w : near_)
          if (group_.root(part_of_[w]) != g) {
            const double d = (weld_.positions.row(w).transpose() - x).norm();
            if (d < best) best = d, to = w;
          }
        if (to >= 0) links.push_back({best, mine[m], to});
      }
    std::stable_sort(links.begin(), links.end(), [](const Link& a, const Link& b) { return a.length < b.length; });
    return links;
  }

  // Nodes that tell how a part moves, at least as a rigid one.
  bool is_held(const std::vector<int>& own) const {
    if (nodes_.rotations) return !own.empty();
    if (own.size() < 3) return false;
    double longest2 = 0.0, widest = 0.0;
    const auto from_first = [&](int i) { return Vec3((nodes_.nodes.row(i) - nodes_.nodes.row(own[0])).transpose()); };
    Vec3 along = Vec3::Zero();
    for (const int i : own)
      if (const Vec3 d = from_first(i); d.squaredNorm() > longest2) longest2 = d.squaredNorm(), along = d;
    for (const int i : own) widest = std::max(widest, along.cross(from_first(i)).norm());
    return widest > 0.05 * longest2;
  }

  // A seam of links about as short as the shortest, so that the parts hang together along it; all to one part. False: nothing is near.
  bool bridge(int g, std::vector<Edge>& edges) {
    const std::vector<Link> links = links_from(g);
    if (links.empty()) return false;
    if (links[0].length > apart * extent_ && is_held(held_[g])) return false;
    const int target = part_of_[links[0].to];
    const double limit = 1.5 * links[0].length + 1e-3 * extent_;
    // Single faces that float about hang by one vertex: they are to join nothing.
    const auto size = static_cast<int>(members_[g].size());
    const int most = held_[g].empty() && size <= 12 && 100 * size < graph_.vertices ? 1 : 256;
    int made = 0;
    for (const Link& l : links) {
      if (l.length > limit || made >= most) break;
      if (part_of_[l.to] != target) continue;
      edges.push_back({l.from, l.to});
      edges.push_back({l.to, l.from});
      ++made;
    }
    Graph::Bridged told{static_cast<int>(members_[g].size()), static_cast<int>(held_[g].size()), Vec3::Zero()};
    for (const int v : members_[g]) told.middle += weld_.positions.row(v).transpose() / static_cast<double>(told.vertices);
    graph_.bridged.push_back(told);
    join(g, group_.root(target));
    return true;
  }

  void join(int g, int other) {
    std::vector<int> held;
    std::set_union(held_[g].begin(), held_[g].end(), held_[other].begin(), held_[other].end(), std::back_inserter(held));
    std::vector<int> all = std::move(members_[g]), more = std::move(members_[other]);
    if (all.size() < more.size()) std::swap(all, more);
    all.insert(all.end(), more.begin(), more.end());
    group_.join(g, other);
    held_[group_.root(g)] = std::move(held);
    members_[group_.root(g)] = std::move(all);
  }

  Graph& graph_;
  const Weld& weld_;
  const PointGrid& grid_;
  const Held nodes_;
  const std::vector<int> part_of_;
  Forest group_;
  std::vector<std::vector<int>> members_;  // of a group's root
  std::vector<std::vector<int>> held_;     // nodes, of a group's root
  std::vector<int> parts_, near_;
  double extent_ = 0.0;
};

// Counts the parts of the mesh and bridges those that hold too few nodes.
void bridge_parts(Graph& graph, const Weld& weld, const PointGrid& grid, int enough, const Held& held, std::vector<Edge>& edges) {
  Forest forest(graph.vertices);
  for (const Edge& e : edges) forest.join(e.a, e.b);
  std::vector<int> part_of(graph.vertices);
  for (int v = 0; v < graph.vertices; ++v) {
    part_of[v] = forest.root(v);
    graph.parts += part_of[v] == v;
  }
  graph.pieces = 1;
  if (graph.parts > 1) Bridges(graph, weld, grid, std::move(part_of), held).build(enough, edges);
}

// What lies beside the middle of a wall.
void set_middle(Graph& graph, const Weld& weld, const Points& nodes, const Points& beside) {
  Points at = Points::Zero(graph.nodes, 3), across = at;
  for (int i = 0; i < graph.nodes; ++i) {
    const auto first = graph.node_length.begin() + graph.node_begin[i], last = graph.node_length.begin() + graph.node_begin[i + 1];
    const int v = graph.node_vertex[static_cast<size_t>(std::min_element(first, last) - graph.node_length.begin())];
    const Vec3 half = beside.row(v).transpose(), x = (nodes.row(i) - weld.positions.row(v)).transpose() + half;
    const double thick2 = half.squaredNorm(), share = thick2 > 0.0 ? x.dot(half) / thick2 : 0.0;
    constexpr double outside = 1.5;
    if (std::abs(share) < outside) at.row(i) = share * half.transpose();
    if (thick2 > 0.0) across.row(i) = half.transpose() / std::sqrt(thick2);
  }
  // Nodes of both faces that stand as near each other as the wall is thick tell how it turns: these stay where they are.
  constexpr double near_height = 4.0;
  const Points middle = nodes - at, height = at;
  const PointGrid grid(middle);
  std::vector<int> near;
  for (int i = 0; i < graph.nodes; ++i) {
    grid.within(middle.row(i).transpose(), near_height * height.row(i).norm(), near);
    if (std::any_of(near.begin(), near.end(), [&](int j) { return height.row(i).dot(height.row(j)) < 0.0; })) at.row(i).setZero();
  }
  graph.beside = beside;
  graph.node_beside = at;
  graph.node_normal = across;
}

// Thin walls: both faces are joined through the material, or a face would follow nodes round the rim, or the few nodes that it has itself.
// Of each vertex the nearest one that looks the other way and lies inward of it.
void join_faces(Graph& graph, const Weld& weld, const Points& nodes, const PointGrid& grid, std::vector<Edge>& edges) {
  constexpr int most_vertices = 300000;
  constexpr double most_walls = 0.6;  // of the vertices: the body is one
  if (weld.triangles.rows() == 0 || graph.vertices > most_vertices || graph.nodes < 3) return;
  const Solidity solidity = measure_solidity(weld.positions, weld.triangles);
  const double thickness = 2.0 * std::abs(solidity.volume) / solidity.area;
  const double spacing = std::sqrt(solidity.area / static_cast<double>(graph.nodes));
  if (!solidity.closed || !(thickness > 0.0) || thickness > 0.3 * spacing) return;
  const std::vector<int> sign = outward_signs(weld.positions, weld.triangles);
  Points normal = Points::Zero(graph.vertices, 3);
  Eigen::VectorXd edge = Eigen::VectorXd::Zero(graph.vertices), area = edge;
  for (Eigen::Index t = 0; t < weld.triangles.rows(); ++t) {
    const Eigen::Vector3i c = weld.triangles.row(t).transpose();
    const Vec3 a = (weld.positions.row(c[1]) - weld.positions.row(c[0])).transpose(),
               b = (weld.positions.row(c[2]) - weld.positions.row(c[0])).transpose();
    for (int k = 0; k < 3; ++k) {
      normal.row(c[k]) += sign[t] * a.cross(b).transpose();
      area[c[k]] += a.cross(b).norm();
      edge[c[k]] = std::max(edge[c[k]], std::max(a.norm(), b.norm()));
    }
  }
  // Vertices where faces meet at an angle, as on a rim, have no normal; what lies across the wall is known beside them.
  constexpr double creased = 0.95;
  Points beside = Points::Zero(graph.vertices, 3);
  int walls = 0, smooth = 0;
  std::vector<int> near;
  for (int v = 0; v < graph.vertices; ++v) {
    if (!(normal.row(v).norm() > creased * area[v])) continue;
    ++smooth;
    const Vec3 x = weld.positions.row(v).transpose(), n = normal.row(v).transpose().normalized();
    double best = std::numeric_limits<double>::infinity(), deep = 0.0;
    int opposite = -1;
    grid.within(x, std::max(1.5 * thickness, std::min(edge[v], 0.5 * spacing) + thickness), near);
    for (const int w : near) {
      const Vec3 d = weld.positions.row(w).transpose() - x;
      const double depth = -d.dot(n);
      if (depth < 0.1 * thickness || depth > 3.0 * thickness || d.norm() >= best || normal.row(w).dot(n) > -0.5 * normal.row(w).norm())
        continue;
      best = d.norm();
      deep = depth;
      opposite = w;
    }
    if (opposite < 0) continue;
    ++walls;
    beside.row(v) = 0.5 * deep * n.transpose();
    edges.push_back({v, opposite});
    edges.push_back({opposite, v});
  }
  // Creases as the nearest of their neighbours that are of a wall.
  const auto was_smooth = [&](int v) { return normal.row(v).norm() > creased * area[v]; };
  for (int pass = 0; pass < 2; ++pass) {  // a corner has only creases beside it
    const Points known = beside;
    Eigen::VectorXd nearest = Eigen::VectorXd::Constant(graph.vertices, std::numeric_limits<double>::infinity());
    for (Eigen::Index t = 0; t < weld.triangles.rows(); ++t)
      for (int k = 0; k < 3; ++k) {
        const int v = weld.triangles(t, k), w = weld.triangles(t, (k + 1) % 3);
        for (const auto& [to, from] : {std::pair(v, w), std::pair(w, v)}) {
          const Vec3 d = (weld.positions.row(to) - weld.positions.row(from)).transpose(), half = known.row(from).transpose();
          const double length = d.norm();
          // One on the other face, across the rim, looks the other way.
          if (d.dot(half) < -half.squaredNorm()) continue;
          if (was_smooth(to) || known.row(to).squaredNorm() > 0.0 || !(known.row(from).squaredNorm() > 0.0) || length >= nearest[to])
            continue;
          nearest[to] = length;
          beside.row(to) = known.row(from);
        }
      }
  }
  if (walls > most_walls * smooth) set_middle(graph, weld, nodes, beside);
}

void set_neighbours(Graph& graph, const Weld& weld, std::vector<Edge>& edges) {
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) { return a.a != b.a ? a.a < b.a : a.b < b.b; });
  edges.erase(std::unique(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) { return a.a == b.a && a.b == b.b; }), edges.end());
  compress(graph.vertices, edges, graph.begin, graph.neighbour);
  graph.length.resize(graph.neighbour.size());
  for (int v = 0; v < graph.vertices; ++v)
    for (int e = graph.begin[v]; e < graph.begin[v + 1]; ++e)
      graph.length[e] = static_cast<float>((weld.positions.row(v) - weld.positions.row(graph.neighbour[e])).norm());
}

// Attachments from the vertices' side.
void index_attachments(Graph& graph) {
  std::vector<Edge> pairs;
  std::vector<int> owner(graph.node_vertex.size());
  for (int i = 0; i < graph.nodes; ++i)
    for (int a = graph.node_begin[i]; a < graph.node_begin[i + 1]; ++a) {
      pairs.push_back({graph.node_vertex[a], a});
      owner[a] = i;
    }
  compress(graph.vertices, pairs, graph.vertex_begin, graph.vertex_node);
  graph.vertex_length.resize(graph.vertex_node.size());
  for (size_t k = 0; k < graph.vertex_node.size(); ++k) {
    graph.vertex_length[k] = graph.node_length[graph.vertex_node[k]];
    graph.vertex_node[k] = owner[graph.vertex_node[k]];
  }
}

}  // namespace

Graph make_graph(const Weld& weld, const Points& nodes, int enough, bool rotations) {
  Graph graph;
  graph.vertices = static_cast<int>(weld.positions.rows());
  graph.nodes = static_cast<int>(nodes.rows());
  index_corners(graph, weld);
  const PointGrid grid(weld.positions);
  std::vector<Edge> edges = weld.triangles.rows() > 0 ? triangle_edges(weld) : cloud_edges(weld, grid);
  attach_nodes(graph, weld, nodes, grid);
  join_faces(graph, weld, nodes, grid, edges);
  bridge_parts(graph, weld, grid, enough, {nodes, rotations}, edges);
  set_neighbours(graph, weld, edges);
  index_attachments(graph);
  return graph;
}

namespace {

// Distance at the third corner from distances at two, by unfolding the triangle: the source that explains both lies in the
// plane beyond the edge; used only if the straight line to it crosses the edge.
double unfolded(double da, double db, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a;
  const double l = ab.norm();
  if (!(l > 0.0) || std::abs(da - db) >= l || da + db <= l) return std::numeric_limits<double>::infinity();
  const double sx = (da * da - db * db + l * l) / (2.0 * l), sy2 = da * da - sx * sx;
  if (sy2 <= 0.0) return std::numeric_limits<double>::infinity();
  const double cx = ac.dot(ab) / l, cy = std::sqrt(std::max(0.0, ac.squaredNorm() - cx * cx)), sy = -std::sqrt(sy2);
  if (!(cy > 0.0)) return std::numeric_limits<double>::infinity();
  const double crossing = sx + (cx - sx) * (-sy) / (cy - sy);
  if (crossing < 0.0 || crossing > l) return std::numeric_limits<double>::infinity();
  return std::hypot(cx - sx, cy - sy);
}

}  // namespace

double grow(const Graph& graph, const Points& positions, int start, int count, Search& search) {
  const int total = graph.vertices + graph.nodes;
  if (static_cast<int>(search.distance.size()) != total) {
    search.distance.assign(total, 0.0);
    search.stamp.assign(total, 0);
    search.state.assign(total, 0);
    search.now = 0;
  }
  ++search.now;
  search.reached.clear();
  search.node.clear();
  search.node_distance.clear();
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;
  auto offer = [&](int v, double d) {
    if (!(d < std::numeric_limits<double>::infinity())) return;
    const size_t i = v;
    if (search.stamp[i] == search.now && search.distance[i] <= d) return;
    if (search.stamp[i] != search.now) {
      search.stamp[i] = search.now;
      search.state[i] = 0;
    }
    if (search.state[i] != 0) return;
    search.distance[i] = d;
    front.emplace(d, v);
  };
  if (start >= graph.vertices) {
    const size_t node = start - graph.vertices;
    for (int a = graph.node_begin[node]; a < graph.node_begin[node + 1]; ++a) offer(graph.node_vertex[a], graph.node_length[a]);
    offer(start, 0.0);
  } else {
    offer(start, 0.0);
  }
  double limit = std::numeric_limits<double>::infinity();
  while (!front.empty()) {
    const double d = front.top().first;
    const int v = front.top().second;
    front.pop();
    const size_t i = v;
    if (search.state[i] != 0 || d > search.distance[i]) continue;
    if (d > limit) break;
    search.state[i] = 1;
    if (v >= graph.vertices) {
      search.node.push_back(v - graph.vertices);
      search.node_distance.push_back(d);
      if (static_cast<int>(search.node.size()) == count) limit = d;
      continue;
    }
    search.reached.push_back(v);
    for (int e = graph.begin[i]; e < graph.begin[i + 1]; ++e) offer(graph.neighbour[e], d + static_cast<double>(graph.length[e]));
    // Across triangles whose second corner is settled too.
    for (int c = graph.corner_begin[i]; c < graph.corner_begin[i + 1]; ++c) {
      const size_t at = 2 * static_cast<size_t>(c);
      const int p = graph.corner[at], q = graph.corner[at + 1];
      auto settled = [&](int w) { return search.stamp[w] == search.now && search.state[w] == 1; };
      auto across = [&](int known, int third) {
        offer(third, unfolded(d, search.distance[known], positions.row(v).transpose(), positions.row(known).transpose(),
                              positions.row(third).transpose()));
      };
      if (settled(p) && !settled(q)) across(p, q);
      if (settled(q) && !settled(p)) across(q, p);
    }
    for (int k = graph.vertex_begin[i]; k < graph.vertex_begin[i + 1]; ++k)
      offer(graph.vertices + graph.vertex_node[k], d + graph.vertex_length[k]);
  }
  return limit;
}

}  // namespace flexframe::interp
