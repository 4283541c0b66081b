#include "interp/exaggerate.h"

#include "interp/rotation.h"

#include <fmt/format.h>
#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>

#include <cmath>
#include <numbers>
#include <numeric>

namespace flexframe::interp {
namespace {

// Frame of a triangle: columns edge 1, edge 2, unit normal.
Mat3 triangle_frame(const Vec3& a, const Vec3& b, const Vec3& c) {
  Mat3 f;
  f.col(0) = b - a;
  f.col(1) = c - a;
  const Vec3 n = f.col(0).cross(f.col(1));
  const double area = n.norm();
  f.col(2) = area > 0.0 ? Vec3(n / area) : Vec3(Vec3::Zero());
  return f;
}

bool is_sliver(const Mat3& frame) {
  // Rounding of float32 positions turns triangles thinner than this at will.
  return !(frame.col(0).cross(Vec3(frame.col(1))).norm() > 1e-6 * frame.col(0).squaredNorm() + 1e-6 * frame.col(1).squaredNorm());
}

Vec3 vertex(std::span<const float> p, int v) {
  const size_t i = 3 * static_cast<size_t>(v);
  return {static_cast<double>(p[i]), static_cast<double>(p[i + 1]), static_cast<double>(p[i + 2])};
}

// Rotation and symmetric stretch of the gradient of a triangle, the normal kept at length one.
void split(const MeshView& mesh, std::span<const float> displacement, Eigen::Index t, Mat3& rest, Mat3& rotation, Mat3& stretch) {
  const Eigen::Vector3i c = mesh.triangles.row(t).transpose();
  Vec3 x[3], y[3];
  for (int k = 0; k < 3; ++k) {
    x[k] = mesh.vertices.row(c[k]).transpose();
    y[k] = x[k] + vertex(displacement, c[k]);
  }
  rest = triangle_frame(x[0], x[1], x[2]);
  const Mat3 now = triangle_frame(y[0], y[1], y[2]);
  rotation.setIdentity();
  stretch.setIdentity();
  if (is_sliver(rest) || is_sliver(now)) return;
  const Mat3 gradient = now * rest.inverse();
  rotation = nearest_rotation(gradient);
  stretch = rotation.transpose() * gradient;
}

}  // namespace

// A displacement below this share of the size is the rounding of what it came from (and, of a metre, smaller than any atom).
constexpr double rounding = 1e-12;

double auto_scale(double maximum, double size) {
  if (!(maximum > 0.0) || !(size > 0.0) || !std::isfinite(maximum) || !std::isfinite(size)) return 1.0;
  if (maximum < rounding * size) return 1.0;
  const double wanted = 0.1 * size / maximum;
  if (wanted <= 1.0) return 1.0;
  const double decade = std::pow(10.0, std::floor(std::log10(wanted)));
  // A ratio a rounding error below 2 or 5 still counts as it.
  const double lead = wanted / decade * (1.0 + 1e-9);
  return decade * (lead >= 10.0 ? 10.0 : lead >= 5.0 ? 5.0 : lead >= 2.0 ? 2.0 : 1.0);
}

double largest_rotation(const MeshView& mesh, std::span<const float> displacement) {
  std::vector<std::pair<double, double>> turned;  // angle, area
  double total = 0.0;
  Mat3 rest, rotation, stretch;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    split(mesh, displacement, t, rest, rotation, stretch);
    const double area = rest.col(0).cross(Vec3(rest.col(1))).norm();
    turned.emplace_back(rotation_vector(rotation).norm(), area);
    total += area;
  }
  std::sort(turned.begin(), turned.end());
  double above = 0.0;
  for (size_t i = turned.size(); i-- > 0;) {
    above += turned[i].second;
    if (above > 1e-3 * total) return turned[i].first;
  }
  return turned.empty() ? 0.0 : turned.back().first;
}

std::string exaggeration_warning(double rotation, double scale) {
  const double degrees = rotation * scale * 180.0 / std::numbers::pi;
  if (!(degrees > 15.0)) return {};
  const double angle = rotation * scale;
  return fmt::format(
      "exaggerated {:g} times, parts of the body rotate by {:.0f} degrees; linear exaggeration enlarges cross-sections there by {:.0f} %: "
      "use a smaller scale or corotated exaggeration",
      scale, degrees, 100.0 * (std::sqrt(1.0 + angle * angle) - 1.0));
}

struct Corotated::Impl {
  Points vertices;
  Triangles triangles;
  std::vector<Eigen::Vector3d> cotangent;  // half cotangents opposite edges 12, 20, 01 of each triangle
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver;
  std::vector<int> part;     // connected part of each vertex
  std::vector<int> anchor;   // one vertex of each part is held, the part's mean is restored afterwards
  std::vector<double> mass;  // vertex areas
};

Corotated::Corotated(const MeshView& mesh) : impl_(std::make_unique<Impl>()) {
  Impl& m = *impl_;
  m.vertices = mesh.vertices;
  m.triangles = mesh.triangles;
  const auto n = static_cast<int>(m.vertices.rows());
  std::vector<int> parent(n);
  std::iota(parent.begin(), parent.end(), 0);
  auto root = [&](int a) {
    while (parent[a] != a) a = parent[a] = parent[parent[a]];
    return a;
  };
  m.mass.assign(n, 0.0);
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index t = 0; t < m.triangles.rows(); ++t) {
    const Eigen::Vector3i c = m.triangles.row(t).transpose();
    Vec3 weight;
    for (int k = 0; k < 3; ++k) {
      const Vec3 a = m.vertices.row(c[k]).transpose(), p = m.vertices.row(c[(k + 1) % 3]).transpose() - a,
                 q = m.vertices.row(c[(k + 2) % 3]).transpose() - a;
      const double area = p.cross(q).norm();
      // Cotangents of slivers run to infinity; beyond 100 (half a degree) they only spoil the solve. Positive weights keep it definite.
      weight[k] = 0.5 * std::clamp(area > 0.0 ? p.dot(q) / area : 0.0, 1e-3, 100.0);
      m.mass[c[k]] += area;
      parent[std::max(root(c[k]), root(c[(k + 1) % 3]))] = std::min(root(c[k]), root(c[(k + 1) % 3]));
    }
    m.cotangent.push_back(weight);
    for (int k = 0; k < 3; ++k) {
      const int i = c[(k + 1) % 3], j = c[(k + 2) % 3];
      entries.emplace_back(i, i, weight[k]);
      entries.emplace_back(j, j, weight[k]);
      entries.emplace_back(i, j, -weight[k]);
      entries.emplace_back(j, i, -weight[k]);
    }
  }
  m.part.resize(n);
  for (int v = 0; v < n; ++v) {
    m.part[v] = root(v);
    if (root(v) == v) {
      m.anchor.push_back(v);
      entries.emplace_back(v, v, 1.0);
    }
  }
  Eigen::SparseMatrix<double> laplacian(n, n);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  m.solver.compute(laplacian);
  if (m.solver.info() != Eigen::Success)
    throw MapError("the mesh is too degenerate for corotated exaggeration: its Laplacian cannot be factorised");
}

Corotated::~Corotated() = default;
Corotated::Corotated(Corotated&&) noexcept = default;
Corotated& Corotated::operator=(Corotated&&) noexcept = default;

void Corotated::apply(std::span<const float> displacement, double scale, std::span<float> out) const {
  const Impl& m = *impl_;
  const Eigen::Index n = m.vertices.rows();
  const MeshView mesh{Eigen::Map<const Points>(m.vertices.data(), n, 3),
                      Eigen::Map<const Triangles>(m.triangles.data(), m.triangles.rows(), 3)};
  // Gradient that each triangle should have; edges it asks for, weighted by cotangents.
  Points right = Points::Zero(n, 3);
  Mat3 rest, rotation, stretch;
  for (Eigen::Index t = 0; t < m.triangles.rows(); ++t) {
    split(mesh, displacement, t, rest, rotation, stretch);
    Mat3 wanted_stretch = Mat3::Identity() + scale * (stretch - Mat3::Identity());
    const Mat3 wanted = rotation_matrix(scale * rotation_vector(rotation)) * wanted_stretch;
    const Eigen::Vector3i c = m.triangles.row(t).transpose();
    for (int k = 0; k < 3; ++k) {
      const int i = c[(k + 1) % 3], j = c[(k + 2) % 3];
      const Vec3 edge = m.cotangent[t][k] * (wanted * (m.vertices.row(i) - m.vertices.row(j)).transpose());
      right.row(i) += edge.transpose();
      right.row(j) -= edge.transpose();
    }
  }
  const Points solved = m.solver.solve(Eigen::MatrixXd(right));
  // Each part's mean moves by the scaled mean displacement, area-weighted.
  std::vector<Vec3> shift(n, Vec3::Zero());
  std::vector<double> weight(n, 0.0);
  for (Eigen::Index v = 0; v < n; ++v) {
    const size_t p = m.part[v];
    const double w = m.mass[v];
    shift[p] += w * (m.vertices.row(v).transpose() + scale * vertex(displacement, static_cast<int>(v)) - solved.row(v).transpose());
    weight[p] += w;
  }
  for (Eigen::Index v = 0; v < n; ++v) {
    const size_t p = m.part[v];
    Vec3 u = scale * vertex(displacement, static_cast<int>(v));
    if (weight[p] > 0.0) u = solved.row(v).transpose() + shift[p] / weight[p] - m.vertices.row(v).transpose();
    for (int k = 0; k < 3; ++k) out[3 * v + k] = static_cast<float>(u[k]);
  }
}

}  // namespace flexframe::interp
