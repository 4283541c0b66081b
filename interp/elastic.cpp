#include "interp/elastic.h"

#include "interp/rotation.h"

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

namespace flexframe::interp {
namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;

void add_block(Triplets& entries, int i, int j, const Mat3& block) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) entries.emplace_back(3 * i + r, 3 * j + c, block(r, c));
}

constexpr double poisson = 0.3;

// Angles below this (rad) are slivers: their stiffness would drown that of their neighbours.
constexpr double least_angle = 1e-3;

void add_membrane(Triplets& entries, const std::array<int, 3>& c, const std::array<Vec3, 3>& x, double thickness) {
  const Vec3 e1 = x[1] - x[0], e2 = x[2] - x[0];
  const Vec3 n = e1.cross(e2);
  const double longest = std::max({e1.norm(), e2.norm(), (x[2] - x[1]).norm()});
  const double area = 0.5 * n.norm();
  if (!(area > 0.5 * least_angle * longest * longest)) return;
  const Vec3 t1 = e1.normalized(), t2 = n.normalized().cross(t1);
  const double x1 = e1.dot(t1), x2 = e2.dot(t1), y2 = e2.dot(t2);
  // Gradients of the shape functions in the plane.
  Eigen::Matrix<double, 2, 3> g;
  g.col(1) = Eigen::Vector2d(y2, -x2) / (x1 * y2);
  g.col(2) = Eigen::Vector2d(0.0, 1.0 / y2);
  g.col(0) = -g.col(1) - g.col(2);
  const double factor = thickness * area / (1.0 - poisson * poisson);
  Eigen::Matrix<double, 3, 2> plane;
  plane << t1, t2;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      Eigen::Matrix2d k;
      const double shear = 0.5 * (1.0 - poisson);
      k(0, 0) = g(0, i) * g(0, j) + shear * g(1, i) * g(1, j);
      k(0, 1) = poisson * g(0, i) * g(1, j) + shear * g(1, i) * g(0, j);
      k(1, 0) = poisson * g(1, i) * g(0, j) + shear * g(0, i) * g(1, j);
      k(1, 1) = g(1, i) * g(1, j) + shear * g(0, i) * g(0, j);
      add_block(entries, c[i], c[j], factor * plane * k * plane.transpose());
    }
}

// Hinge of two triangles at the edge 0-1 with opposite vertices 2 and 3.
void add_hinge(Triplets& entries, const std::array<int, 4>& v, const std::array<Vec3, 4>& x, double rigidity) {
  const Vec3 e = x[1] - x[0];
  const double l = e.norm();
  const Vec3 n1 = e.cross(x[2] - x[0]), n2 = (x[3] - x[0]).cross(e);
  const double a1 = 0.5 * n1.norm(), a2 = 0.5 * n2.norm();
  if (!(a1 > least_angle * l * l) || !(a2 > least_angle * l * l)) return;
  const double h1 = 2.0 * a1 / l, h2 = 2.0 * a2 / l;
  const Vec3 u1 = n1 / (2.0 * a1) / h1, u2 = n2 / (2.0 * a2) / h2;
  const double t1 = (x[2] - x[0]).dot(e) / (l * l), t2 = (x[3] - x[0]).dot(e) / (l * l);
  const std::array<Vec3, 4> g{-(1.0 - t1) * u1 - (1.0 - t2) * u2, -t1 * u1 - t2 * u2, u1, u2};
  const double factor = rigidity * 3.0 * l * l / (a1 + a2);
  for (size_t i = 0; i < 4; ++i)
    for (size_t j = 0; j < 4; ++j) add_block(entries, v[i], v[j], factor * g[i] * g[j].transpose());
}

struct HalfEdge {
  int a, b, opposite;
};

}  // namespace

namespace {

// Edge of a triangle: its ends, the lower first; the triangle; whether it runs that way there.
struct Side {
  int a, b, triangle, way;
};

std::vector<Side> sorted_sides(const Triangles& triangles) {
  std::vector<Side> sides;
  sides.reserve(3 * triangles.rows());
  for (int t = 0; t < triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k) {
      const int a = triangles(t, k), b = triangles(t, (k + 1) % 3);
      sides.push_back({std::min(a, b), std::max(a, b), t, a < b ? 1 : -1});
    }
  std::sort(sides.begin(), sides.end(),
            [](const Side& p, const Side& q) { return std::tie(p.a, p.b, p.triangle) < std::tie(q.a, q.b, q.triangle); });
  return sides;
}

// Which way round each triangle is taken so that neighbours agree (1 or -1), and the piece of the surface that it belongs to.
struct Turned {
  std::vector<int> sign, piece;
  int pieces = 0;
};

Turned turn_alike(const std::vector<Side>& sides, Eigen::Index triangles) {
  std::vector<std::array<std::pair<int, int>, 3>> next(triangles, {std::pair(-1, 0), std::pair(-1, 0), std::pair(-1, 0)});
  const auto link = [&](int from, int to, int relation) {
    for (auto& n : next[from])
      if (n.first < 0) {
        n = {to, relation};
        return;
      }
  };
  for (size_t i = 0; i + 1 < sides.size(); ++i) {
    const Side &p = sides[i], &q = sides[i + 1];
    const bool pair = p.a == q.a && p.b == q.b && (i == 0 || sides[i - 1].a != p.a || sides[i - 1].b != p.b) &&
                      (i + 2 == sides.size() || sides[i + 2].a != p.a || sides[i + 2].b != p.b);
    if (!pair) continue;
    link(p.triangle, q.triangle, -p.way * q.way);
    link(q.triangle, p.triangle, -p.way * q.way);
  }
  Turned out{std::vector<int>(triangles, 0), std::vector<int>(triangles, -1), 0};
  std::vector<int> stack;
  for (int first = 0; first < triangles; ++first) {
    if (out.sign[first] != 0) continue;
    out.sign[first] = 1;
    stack.push_back(first);
    while (!stack.empty()) {
      const int t = stack.back();
      stack.pop_back();
      out.piece[t] = out.pieces;
      for (const auto& [n, relation] : next[t])
        if (n >= 0 && out.sign[n] == 0) {
          out.sign[n] = out.sign[t] * relation;
          stack.push_back(n);
        }
    }
    ++out.pieces;
  }
  return out;
}

}  // namespace

std::vector<int> outward_signs(const Points& vertices, const Triangles& triangles) {
  Turned turned = turn_alike(sorted_sides(triangles), triangles.rows());
  // A piece looks the way that most of it was meant to; all of them inward if the volume says so.
  std::vector<double> meant(turned.pieces, 0.0);
  double volume = 0.0;
  const Vec3 centre = vertices.colwise().mean().transpose();
  std::vector<double> piece(turned.pieces, 0.0);
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    Vec3 x[3];
    for (int k = 0; k < 3; ++k) x[k] = vertices.row(triangles(t, k)).transpose() - centre;
    meant[turned.piece[t]] += turned.sign[t] * (x[1] - x[0]).cross(x[2] - x[0]).norm();
    piece[turned.piece[t]] += turned.sign[t] * x[0].dot(x[1].cross(x[2]));
  }
  for (int p = 0; p < turned.pieces; ++p) volume += meant[p] < 0.0 ? -piece[p] : piece[p];
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    if ((meant[turned.piece[t]] < 0.0) != (volume < 0.0)) turned.sign[t] = -turned.sign[t];
  return turned.sign;
}

Solidity measure_solidity(const Points& vertices, const Triangles& triangles) {
  Solidity s;
  const std::vector<Side> sides = sorted_sides(triangles);
  const Turned turned = turn_alike(sides, triangles.rows());
  const Vec3 centre = vertices.colwise().mean().transpose();
  // Of each piece: volume, area, and area by the sign that it was turned with: the most of it looks the way it was meant.
  std::vector<Vec3> piece(turned.pieces, Vec3::Zero());
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    Vec3 x[3];
    for (int k = 0; k < 3; ++k) x[k] = vertices.row(triangles(t, k)).transpose() - centre;
    const double area = 0.5 * (x[1] - x[0]).cross(x[2] - x[0]).norm();
    piece[turned.piece[t]] += Vec3(turned.sign[t] * x[0].dot(x[1].cross(x[2])) / 6.0, area, turned.sign[t] * area);
    s.area += area;
  }
  for (const Vec3& p : piece) s.volume += p[2] < 0.0 ? -p[0] : p[0];
  // Closed: hardly an edge has one triangle only. Stray faces are few.
  double length = 0.0, open = 0.0;
  for (size_t i = 0; i < sides.size();) {
    size_t j = i;
    while (j < sides.size() && sides[j].a == sides[i].a && sides[j].b == sides[i].b) ++j;
    const double l = (vertices.row(sides[i].a) - vertices.row(sides[i].b)).norm();
    length += l;
    if (j - i == 1) open += l;
    i = j;
  }
  constexpr double stray = 0.01;
  s.closed = !sides.empty() && open <= stray * length;
  return s;
}

Eigen::SparseMatrix<double> surface_stiffness(const Weld& weld, const Graph& graph, double thickness) {
  const int count = graph.vertices;
  Triplets entries;
  entries.reserve(300 * weld.triangles.rows());
  auto at = [&](int v) { return Vec3(weld.positions.row(v).transpose()); };
  std::vector<HalfEdge> edges;
  for (Eigen::Index t = 0; t < weld.triangles.rows(); ++t) {
    const std::array<int, 3> c{weld.triangles(t, 0), weld.triangles(t, 1), weld.triangles(t, 2)};
    add_membrane(entries, c, {at(c[0]), at(c[1]), at(c[2])}, thickness);
    for (size_t k = 0; k < 3; ++k) {
      const int a = c[k], b = c[(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), c[(k + 2) % 3]});
    }
  }
  std::sort(edges.begin(), edges.end(),
            [](const HalfEdge& p, const HalfEdge& q) { return std::tie(p.a, p.b, p.opposite) < std::tie(q.a, q.b, q.opposite); });
  const double rigidity = thickness * thickness * thickness / (12.0 * (1.0 - poisson * poisson));
  for (size_t i = 0; i < edges.size();) {
    size_t j = i;
    while (j < edges.size() && edges[j].a == edges[i].a && edges[j].b == edges[i].b) ++j;
    // Where more than two triangles meet, each hinges with the next.
    for (size_t k = i; k + 1 < j; ++k)
      if (edges[k].opposite != edges[k + 1].opposite) {
        const std::array<int, 4> v{edges[k].a, edges[k].b, edges[k].opposite, edges[k + 1].opposite};
        add_hinge(entries, v, {at(v[0]), at(v[1]), at(v[2]), at(v[3])}, rigidity);
      }
    i = j;
  }
  double diagonal = 0.0;
  for (const auto& e : entries)
    if (e.row() == e.col()) diagonal += e.value();
  diagonal /= 3.0 * count;
  // Bridges hold parts together, and both faces of a wall (where it is none, what joins faces is for the kernel's patches alone); a trace
  // of Laplacian moves what nothing else holds (slivers, loose vertices) with its neighbours.
  int parts = 0;
  const std::vector<int> part = part_of_vertices(weld, parts);
  const double trace = 1e-9 * diagonal;
  auto spring = [&](int a, int b, double k) {
    for (int c = 0; c < 3; ++c) {
      entries.emplace_back(3 * a + c, 3 * a + c, k);
      entries.emplace_back(3 * b + c, 3 * b + c, k);
      entries.emplace_back(3 * a + c, 3 * b + c, -k);
      entries.emplace_back(3 * b + c, 3 * a + c, -k);
    }
  };
  auto bar = [&](int a, int b, double k) {
    const Vec3 axis = (at(b) - at(a)).normalized();
    const Mat3 block = k * axis * axis.transpose();
    for (int c = 0; c < 3; ++c)
      for (int d = 0; d < 3; ++d) {
        entries.emplace_back(3 * a + c, 3 * a + d, block(c, d));
        entries.emplace_back(3 * b + c, 3 * b + d, block(c, d));
        entries.emplace_back(3 * a + c, 3 * b + d, -block(c, d));
        entries.emplace_back(3 * b + c, 3 * a + d, -block(c, d));
      }
  };
  for (int v = 0; v < count; ++v) {
    const int first = graph.begin[v], last = graph.begin[v + 1];
    for (int e = first; e < last; ++e) {
      const int w = graph.neighbour[e];
      if (w <= v) continue;
      const bool mesh_edge = std::binary_search(edges.begin(), edges.end(), HalfEdge{v, w, 0}, [](const HalfEdge& p, const HalfEdge& q) {
        return std::tie(p.a, p.b) < std::tie(q.a, q.b);
      });
      const Vec3 d = at(w) - at(v);
      const bool across = graph.beside.rows() > 0 && (d + 2.0 * graph.beside.row(v).transpose()).squaredNorm() < 0.5 * d.squaredNorm();
      if (!mesh_edge && across) bar(v, w, diagonal);
      spring(v, w, mesh_edge || across || part[v] == part[w] ? trace : diagonal);
    }
    for (int c = 0; c < 3; ++c) entries.emplace_back(3 * v + c, 3 * v + c, first == last ? diagonal : 1e-3 * trace);
  }
  const Eigen::Index size = 3 * static_cast<Eigen::Index>(count);
  Eigen::SparseMatrix<double> stiffness(size, size);
  stiffness.setFromTriplets(entries.begin(), entries.end());
  return stiffness;
}

Green elastic_green(const Weld& weld, const Graph& graph, const Points& nodes, const std::vector<int>& wanted,
                    const ElasticOptions& options) {
  const Solidity solidity = measure_solidity(weld.positions, weld.triangles);
  const double size = weld.size > 0.0 ? weld.size : (weld.positions.colwise().maxCoeff() - weld.positions.colwise().minCoeff()).norm();
  double thickness = 0.01 * size;
  if (solidity.closed && std::abs(solidity.volume) > 0.0)
    thickness = std::clamp(2.0 * std::abs(solidity.volume) / solidity.area, 1e-4 * size, 0.2 * size);
  if (options.thickness > 0.0) thickness = options.thickness;
  const Eigen::SparseMatrix<double> stiffness = surface_stiffness(weld, graph, thickness);

  // What each node holds: a vertex, the point of a triangle, or the mean (and mean turn) of the vertices around it.
  const int n = static_cast<int>(nodes.rows());
  Triplets rows;
  std::vector<int> turned;
  for (int i = 0; i < n; ++i) {
    const int first = graph.node_begin[i], last = graph.node_begin[i + 1];
    const Vec3 x = nodes.row(i).transpose();
    std::vector<double> weight(last - first, 1.0 / (last - first));
    if (last - first == 3 && graph.off_mesh[i] < 0.2 * graph.node_length[first]) {
      // Barycentric coordinates, clamped to the triangle.
      Vec3 p[3];
      for (int k = 0; k < 3; ++k) p[k] = weld.positions.row(graph.node_vertex[first + k]).transpose();
      const Vec3 normal = (p[1] - p[0]).cross(p[2] - p[0]);
      double total = 0.0;
      for (int k = 0; k < 3; ++k) {
        weight[k] = std::max(0.0, normal.dot((p[(k + 1) % 3] - x).cross(p[(k + 2) % 3] - x)));
        total += weight[k];
      }
      for (double& w : weight) w = total > 0.0 ? w / total : 1.0 / 3.0;
    }
    for (int k = first; k < last; ++k)
      for (int c = 0; c < 3; ++c)
        if (weight[k - first] != 0.0) rows.emplace_back(3 * i + c, 3 * graph.node_vertex[k] + c, weight[k - first]);
    if (!options.rotations || last - first < 3) continue;
    // Mean turn of the held vertices: J^-1 sum r x u.
    Vec3 mean = Vec3::Zero();
    for (int k = first; k < last; ++k) mean += weld.positions.row(graph.node_vertex[k]).transpose() / (last - first);
    Mat3 inertia = Mat3::Zero();
    for (int k = first; k < last; ++k) {
      const Vec3 r = weld.positions.row(graph.node_vertex[k]).transpose() - mean;
      inertia += r.squaredNorm() * Mat3::Identity() - r * r.transpose();
    }
    if (inertia.fullPivLu().rcond() < 1e-3) continue;
    const int base = 3 * n + 3 * static_cast<int>(turned.size());
    for (int k = first; k < last; ++k) {
      const Vec3 r = weld.positions.row(graph.node_vertex[k]).transpose() - mean;
      const Mat3 block = inertia.inverse() * skew(r);
      for (int a = 0; a < 3; ++a)
        for (int c = 0; c < 3; ++c) rows.emplace_back(base + a, 3 * graph.node_vertex[k] + c, block(a, c) * size);
    }
    turned.push_back(i);
  }
  Eigen::SparseMatrix<double> constraints(3 * (static_cast<Eigen::Index>(n) + static_cast<Eigen::Index>(turned.size())), stiffness.rows());
  constraints.setFromTriplets(rows.begin(), rows.end());

  Triplets picks;
  for (size_t k = 0; k < wanted.size(); ++k)
    for (int c = 0; c < 3; ++c) picks.emplace_back(3 * static_cast<int>(k) + c, 3 * wanted[k] + c, 1.0);
  Eigen::SparseMatrix<double> pick(3 * static_cast<Eigen::Index>(wanted.size()), stiffness.rows());
  pick.setFromTriplets(picks.begin(), picks.end());
  Green green = solve_green(stiffness, constraints, pick, n, turned, options.threads);
  // Rotation rows were scaled by the size, so that they weigh like displacements.
  if (green.rotation.size() > 0) {
    green.rotation *= size;
    green.leave_one_out_turn *= size;
  }
  Points points(static_cast<Eigen::Index>(wanted.size()), 3);
  for (size_t k = 0; k < wanted.size(); ++k) points.row(static_cast<Eigen::Index>(k)) = weld.positions.row(wanted[k]);
  restore_rigid_motion(green, nodes, points);
  return green;
}

}  // namespace flexframe::interp
