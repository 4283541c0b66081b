// Bodies that the tests of the kernel map share: made here or read from tests/unit/data/kernel_map.
#pragma once

#include "interp/map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

namespace flexframe::test {

using interp::Mat3;
using interp::Points;
using interp::Triangles;
using interp::Vec3;

struct Body {
  Points v;
  Triangles t;
  interp::MeshView view() const {
    return {Eigen::Map<const Points>(v.data(), v.rows(), 3), Eigen::Map<const Triangles>(t.data(), t.rows(), 3)};
  }
};

inline Body make_body(const std::vector<Vec3>& v, const std::vector<std::array<int, 3>>& t) {
  Body b;
  b.v.resize(static_cast<Eigen::Index>(v.size()), 3);
  for (size_t i = 0; i < v.size(); ++i) b.v.row(static_cast<Eigen::Index>(i)) = v[i].transpose();
  b.t.resize(static_cast<Eigen::Index>(t.size()), 3);
  for (size_t i = 0; i < t.size(); ++i) b.t.row(static_cast<Eigen::Index>(i)) << t[i][0], t[i][1], t[i][2];
  return b;
}

// Flat sheet 0..a x 0..b at height z.
inline Body make_sheet(double a, double b, int nx, int ny, double z = 0.0) {
  std::vector<Vec3> v;
  std::vector<std::array<int, 3>> t;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) v.emplace_back(a * i / (nx - 1), b * j / (ny - 1), z);
  for (int j = 0; j + 1 < ny; ++j)
    for (int i = 0; i + 1 < nx; ++i) {
      const int k = i + nx * j;
      t.push_back({k, k + 1, k + nx + 1});
      t.push_back({k, k + nx + 1, k + nx});
    }
  return make_body(v, t);
}

// Half a thin-walled tube of radius 0.2 along x, 2 long and open along its length.
inline Body half_tube() {
  std::vector<Vec3> v;
  std::vector<std::array<int, 3>> t;
  for (int i = 0; i < 41; ++i)
    for (int k = 0; k < 17; ++k)
      v.emplace_back(0.05 * i, 0.2 * std::cos(std::numbers::pi * k / 16), 0.2 * std::sin(std::numbers::pi * k / 16));
  for (int i = 0; i < 40; ++i)
    for (int k = 0; k < 16; ++k) {
      const int a = 17 * i + k;
      t.push_back({a, a + 17, a + 18});
      t.push_back({a, a + 18, a + 1});
    }
  return make_body(v, t);
}

// Surface of the occupied cells of a grid with the given lines.
template <typename Occupied>
Body make_blocks(const std::vector<double>& x, const std::vector<double>& y, const std::vector<double>& z, const Occupied& occupied) {
  const std::array<int, 3> n{static_cast<int>(x.size()) - 1, static_cast<int>(y.size()) - 1, static_cast<int>(z.size()) - 1};
  auto full = [&](std::array<int, 3> c) {
    for (size_t k = 0; k < 3; ++k)
      if (c[k] < 0 || c[k] >= n[k]) return false;
    return static_cast<bool>(occupied(c[0], c[1], c[2]));
  };
  std::vector<Vec3> v;
  std::vector<std::array<int, 3>> t;
  std::map<std::array<int, 3>, int> number;
  auto vertex = [&](const std::array<int, 3>& c) {
    const auto [it, fresh] = number.try_emplace(c, static_cast<int>(v.size()));
    if (fresh) v.emplace_back(x[static_cast<size_t>(c[0])], y[static_cast<size_t>(c[1])], z[static_cast<size_t>(c[2])]);
    return it->second;
  };
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        if (!full({i, j, k})) continue;
        for (size_t d = 0; d < 3; ++d)
          for (int side = 0; side < 2; ++side) {
            std::array<int, 3> beside{i, j, k};
            beside[d] += side == 0 ? -1 : 1;
            if (full(beside)) continue;
            std::array<int, 3> c{i, j, k};
            c[d] += side;
            const size_t e = (d + 1) % 3, f = (d + 2) % 3;
            std::array<int, 3> c1 = c, c2 = c, c3 = c;
            ++c1[e];
            ++c2[e];
            ++c2[f];
            ++c3[f];
            int a = vertex(c), b = vertex(c1), g = vertex(c2), h = vertex(c3);
            if (side == 0) std::swap(b, h);
            t.push_back({a, b, g});
            t.push_back({a, g, h});
          }
      }
  return make_body(v, t);
}

inline std::vector<double> lines(double from, double to, int cells) {
  std::vector<double> out;
  for (int k = 0; k <= cells; ++k) out.push_back(from + (to - from) * k / cells);
  return out;
}

// Round bar along x from 0 to length, rings of `around` vertices and end caps.
inline Body make_bar(double length, double radius, int rings, int around) {
  std::vector<Vec3> v;
  std::vector<std::array<int, 3>> t;
  for (int i = 0; i < rings; ++i)
    for (int k = 0; k < around; ++k) {
      const double a = 2.0 * std::numbers::pi * k / around;
      v.emplace_back(length * i / (rings - 1), radius * std::cos(a), radius * std::sin(a));
    }
  for (int i = 0; i + 1 < rings; ++i)
    for (int k = 0; k < around; ++k) {
      const int a = i * around + k, b = i * around + (k + 1) % around;
      t.push_back({a, b, b + around});
      t.push_back({a, b + around, a + around});
    }
  const int low = static_cast<int>(v.size()), high = low + 1;
  v.emplace_back(0.0, 0.0, 0.0);
  v.emplace_back(length, 0.0, 0.0);
  for (int k = 0; k < around; ++k) {
    t.push_back({low, (k + 1) % around, k});
    t.push_back({high, (rings - 1) * around + k, (rings - 1) * around + (k + 1) % around});
  }
  return make_body(v, t);
}

// Clamped-free Euler-Bernoulli mode 1..3 of a beam of length 1 and its slope.
struct Cantilever {
  double beta, sigma;
  explicit Cantilever(int mode) {
    constexpr std::array<double, 3> roots{1.875104068711961, 4.694091132974175, 7.854757438237613};
    beta = roots[static_cast<size_t>(mode - 1)];
    sigma = (std::cosh(beta) + std::cos(beta)) / (std::sinh(beta) + std::sin(beta));
  }
  double value(double x) const { return std::cosh(beta * x) - std::cos(beta * x) - sigma * (std::sinh(beta * x) - std::sin(beta * x)); }
  double slope(double x) const {
    return beta * (std::sinh(beta * x) + std::sin(beta * x) - sigma * (std::cosh(beta * x) - std::cos(beta * x)));
  }
};

// Tuning fork: tines 1 long and 0.1 x 0.1 thick with a slit of 1.7 % of their length between them, on a solid base.
constexpr double slit = 0.017;
inline Body make_fork() {
  std::vector<double> x = lines(-0.4, 0.0, 8), z = lines(-0.1 - slit / 2, -slit / 2, 4);
  for (const double a : lines(0.05, 1.0, 19)) x.push_back(a);
  for (const double a : lines(slit / 2, slit / 2 + 0.1, 4)) z.push_back(a);
  return make_blocks(x, lines(0.0, 0.1, 4), z, [](int i, int, int k) { return i < 8 || k != 4; });
}
// Its first mode as beam theory gives it: the tines bend against each other, the base rests.
inline Points fork_mode(const Points& v) {
  const Cantilever mode(1);
  Points u = Points::Zero(v.rows(), 3);
  for (Eigen::Index i = 0; i < v.rows(); ++i) {
    if (v(i, 0) <= 0.0) continue;
    const double side = v(i, 2) > 0.0 ? 1.0 : -1.0, middle = side * (slit / 2 + 0.05);
    u(i, 2) = side * mode.value(v(i, 0));
    u(i, 0) = -side * mode.slope(v(i, 0)) * (v(i, 2) - middle);
  }
  return u;
}

// Nested farthest-point order from vertex 0.
inline std::vector<int> farthest_points(const Points& v, int count) {
  std::vector<int> out{0};
  Eigen::VectorXd distance = (v.rowwise() - v.row(0)).rowwise().norm();
  while (static_cast<int>(out.size()) < count) {
    Eigen::Index next = 0;
    distance.maxCoeff(&next);
    out.push_back(static_cast<int>(next));
    distance = distance.cwiseMin((v.rowwise() - v.row(next)).rowwise().norm());
  }
  return out;
}

inline interp::Nodes nodes_at(const Points& v, const std::vector<int>& pick, int count) {
  interp::Nodes nodes;
  nodes.positions.resize(count, 3);
  for (int i = 0; i < count; ++i) nodes.positions.row(i) = v.row(pick[static_cast<size_t>(i)]);
  return nodes;
}
inline Points rows_at(const Points& v, const std::vector<int>& pick, int count) { return nodes_at(v, pick, count).positions; }

// Relative L2 error at the vertices that are no nodes; several fields count together.
struct FieldError {
  double error2 = 0.0, truth2 = 0.0, worst = 0.0;
  void add(const Points& found, const Points& truth, const std::vector<int>& pick, int count) {
    std::vector<char> node(static_cast<size_t>(truth.rows()), 0);
    for (int i = 0; i < count; ++i) node[static_cast<size_t>(pick[static_cast<size_t>(i)])] = 1;
    const double largest = truth.rowwise().norm().maxCoeff();
    for (Eigen::Index v = 0; v < truth.rows(); ++v) {
      if (node[static_cast<size_t>(v)]) continue;
      const double e = (found.row(v) - truth.row(v)).norm();
      error2 += e * e;
      truth2 += truth.row(v).squaredNorm();
      worst = std::max(worst, e / largest);
    }
  }
  double relative() const { return std::sqrt(error2 / truth2); }
};

// A finite element body of tests/unit/data/kernel_map (make_bodies.py there): vertices, triangles, three true modes.
struct FeBody {
  Body body;
  std::array<Points, 3> mode;
};
inline FeBody read_fe_body(const std::string& name) {
  const std::string file = std::string(FLEXFRAME_SOURCE_DIR) + "/tests/unit/data/kernel_map/" + name + ".txt";
  std::ifstream in(file);
  Eigen::Index vertices = 0, triangles = 0;
  if (!(in >> vertices >> triangles)) throw std::runtime_error("missing: " + file);
  FeBody out;
  out.body.v.resize(vertices, 3);
  out.body.t.resize(triangles, 3);
  for (auto& m : out.mode) m.resize(vertices, 3);
  for (Eigen::Index i = 0; i < vertices; ++i) {
    for (int c = 0; c < 3; ++c) in >> out.body.v(i, c);
    for (auto& m : out.mode)
      for (int c = 0; c < 3; ++c) in >> m(i, c);
  }
  for (Eigen::Index t = 0; t < triangles; ++t)
    for (int c = 0; c < 3; ++c) in >> out.body.t(t, c);
  if (!in) throw std::runtime_error("short: " + file);
  return out;
}

// The con rod of assets/conrod as CalculiX sees it, with a nested farthest-point order: its first k vertices are the k nodes of a test.
struct ConRod : FeBody {
  std::vector<int> order;
};
inline ConRod read_conrod() {
  ConRod rod{read_fe_body("conrod"), {}};
  rod.order = farthest_points(rod.body.v, 1000);
  return rod;
}

}  // namespace flexframe::test
