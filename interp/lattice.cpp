#include "interp/lattice.h"

#include "interp/elastic.h"
#include "interp/graph.h"
#include "interp/watch.h"

#include <algorithm>
#include <cmath>

namespace flexframe::interp {
namespace {

constexpr double poisson = 0.3;

// Stiffness of a unit cube, 24 x 24; corner c at ((c & 1), (c >> 1 & 1), (c >> 2 & 1)); scales with the edge.
Eigen::Matrix<double, 24, 24> cube_stiffness() {
  Eigen::Matrix<double, 6, 6> d = Eigen::Matrix<double, 6, 6>::Zero();
  const double f = 1.0 / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
  d.topLeftCorner<3, 3>().setConstant(f * poisson);
  for (int i = 0; i < 3; ++i) {
    d(i, i) = f * (1.0 - poisson);
    d(3 + i, 3 + i) = f * 0.5 * (1.0 - 2.0 * poisson);
  }
  Eigen::Matrix<double, 24, 24> k = Eigen::Matrix<double, 24, 24>::Zero();
  const double a = 0.5 / std::sqrt(3.0);
  for (int p = 0; p < 8; ++p) {
    const double x[3] = {0.5 + ((p & 1) != 0 ? a : -a), 0.5 + ((p & 2) != 0 ? a : -a), 0.5 + ((p & 4) != 0 ? a : -a)};
    Eigen::Matrix<double, 6, 24> b = Eigen::Matrix<double, 6, 24>::Zero();
    for (int c = 0; c < 8; ++c) {
      double g[3];
      for (int r = 0; r < 3; ++r) {
        g[r] = (c >> r & 1) != 0 ? 1.0 : -1.0;
        for (int o = 0; o < 3; ++o)
          if (o != r) g[r] *= (c >> o & 1) != 0 ? x[o] : 1.0 - x[o];
      }
      const Eigen::Index x0 = 3 * static_cast<Eigen::Index>(c), x1 = x0 + 1, x2 = x0 + 2;
      b(0, x0) = b(3, x1) = b(5, x2) = g[0];
      b(1, x1) = b(3, x0) = b(4, x2) = g[1];
      b(2, x2) = b(4, x1) = b(5, x0) = g[2];
    }
    k += 0.125 * b.transpose() * d * b;
  }
  return k;
}

}  // namespace

std::vector<float> inside_shares(const Weld& weld, const Vec3& lower, double size, const Eigen::Array3i& cells, int samples) {
  const int ny = cells[1] * samples, nz = cells[2] * samples, nx = cells[0] * samples;
  const double step = size / samples;
  // Sample rays sit a little off the middle, so that they miss the vertices of meshes made on a grid.
  const double shift_y = 0.5 + 1.234e-4, shift_z = 0.5 + 0.789e-4;
  std::vector<std::vector<float>> crossings(Eigen::Index{ny} * nz);
  for (Eigen::Index t = 0; t < weld.triangles.rows(); ++t) {
    look();
    Vec3 p[3];
    for (int k = 0; k < 3; ++k) p[k] = (weld.positions.row(weld.triangles(t, k)).transpose() - lower) / step;
    const double area = (p[1].y() - p[0].y()) * (p[2].z() - p[0].z()) - (p[2].y() - p[0].y()) * (p[1].z() - p[0].z());
    if (area == 0.0) continue;
    auto range = [](double lo, double hi, double shift, int n) {
      return std::pair(std::max(0, static_cast<int>(std::ceil(lo - shift))), std::min(n - 1, static_cast<int>(std::floor(hi - shift))));
    };
    const auto [j0, j1] = range(std::min({p[0].y(), p[1].y(), p[2].y()}), std::max({p[0].y(), p[1].y(), p[2].y()}), shift_y, ny);
    const auto [k0, k1] = range(std::min({p[0].z(), p[1].z(), p[2].z()}), std::max({p[0].z(), p[1].z(), p[2].z()}), shift_z, nz);
    for (int k = k0; k <= k1; ++k)
      for (int j = j0; j <= j1; ++j) {
        const double y = j + shift_y, z = k + shift_z;
        // Half-open edges: a ray on a shared edge meets exactly one of its two triangles.
        double w[3];
        bool in = true;
        for (int e = 0; e < 3 && in; ++e) {
          const Vec3 &a = p[(e + 1) % 3], &b = p[(e + 2) % 3];
          w[e] = ((a.y() - y) * (b.z() - z) - (b.y() - y) * (a.z() - z)) / area;
          in = w[e] > 0.0 || (w[e] == 0.0 && (a.z() < b.z() || (a.z() == b.z() && a.y() < b.y())));
        }
        if (in) crossings[j + Eigen::Index{ny} * k].push_back(static_cast<float>(w[0] * p[0].x() + w[1] * p[1].x() + w[2] * p[2].x()));
      }
  }
  std::vector<float> share(cells.prod(), 0.0f);
  const float part = 1.0f / static_cast<float>(samples * samples * samples);
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j) {
      auto& x = crossings[j + Eigen::Index{ny} * k];
      std::sort(x.begin(), x.end());
      for (size_t c = 0; c + 1 < x.size(); c += 2) {
        const int i0 = std::max(0, static_cast<int>(std::ceil(x[c] - 0.5f))),
                  i1 = std::min(nx - 1, static_cast<int>(std::floor(x[c + 1] - 0.5f)));
        for (int i = i0; i <= i1; ++i) share[grid_slot({i / samples, j / samples, k / samples}, cells)] += part;
      }
    }
  return share;
}

Green lattice_green(const Weld& weld, const Points& nodes, const std::vector<int>& wanted, int threads) {
  const Solidity solidity = measure_solidity(weld.positions, weld.triangles);
  const double volume = std::abs(solidity.volume);
  if (!(volume > 0.0)) throw MapError("the mesh encloses no volume: the scheme lattice needs a solid, use elastic");
  const Vec3 lowest = weld.positions.colwise().minCoeff().transpose(), highest = weld.positions.colwise().maxCoeff().transpose();
  // Edge of the cubes: 1500 of them in the volume, or a third of the wall where that is finer, 2500 at most: the factorisation grows
  // with the square of their number.
  const double wall = 2.0 * volume / solidity.area;
  const double size = std::max(std::min(std::cbrt(volume / 1500.0), wall / 3.0), std::cbrt(volume / 2500.0));
  const Vec3 lower = lowest - Vec3::Constant(0.51 * size);
  const Eigen::Array3i cells = ((highest - lower) / size).array().ceil().cast<int>() + 1;
  if (cells.cast<double>().prod() > 3e7) throw MapError("the mesh is too thin for a lattice: use the scheme elastic");
  std::vector<float> share = inside_shares(weld, lower, size, cells, 3);
  auto slot = [&](const Eigen::Array3i& c) { return grid_slot(c, cells); };
  auto cell_of = [&](const Vec3& x) { return Eigen::Array3i(((x - lower) / size).array().floor().cast<int>().max(0).min(cells - 1)); };
  // Cells of the surface take part even if no sample lies inside, with the least share that keeps the system well conditioned.
  constexpr float least = 0.02f;
  for (Eigen::Index v = 0; v < weld.positions.rows(); ++v)
    share[slot(cell_of(weld.positions.row(v).transpose()))] = std::max(share[slot(cell_of(weld.positions.row(v).transpose()))], least);
  for (Eigen::Index i = 0; i < nodes.rows(); ++i)
    share[slot(cell_of(nodes.row(i).transpose()))] = std::max(share[slot(cell_of(nodes.row(i).transpose()))], least);

  // Corners in use, numbered in order of the grid.
  auto corner_slot = [&](const Eigen::Array3i& c) { return grid_slot(c, cells + 1); };
  std::vector<int> number((cells + 1).prod(), -1);
  auto corner = [](const Eigen::Array3i& cell, int c) { return Eigen::Array3i(cell + Eigen::Array3i(c & 1, c >> 1 & 1, c >> 2 & 1)); };
  std::vector<Eigen::Array3i> used;
  for (int k = 0; k < cells[2]; ++k)
    for (int j = 0; j < cells[1]; ++j)
      for (int i = 0; i < cells[0]; ++i)
        if (share[slot({i, j, k})] > 0.0f) used.emplace_back(i, j, k);
  int corners = 0;
  for (const auto& cell : used)
    for (int c = 0; c < 8; ++c)
      if (int& n = number[corner_slot(corner(cell, c))]; n < 0) n = corners++;

  const Eigen::Matrix<double, 24, 24> cube = cube_stiffness();
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(used.size() * 576);
  for (const auto& cell : used) {
    const double filled = std::max(static_cast<double>(share[slot(cell)]), static_cast<double>(least));
    for (int a = 0; a < 8; ++a)
      for (int b = 0; b < 8; ++b) {
        const int i = number[corner_slot(corner(cell, a))], j = number[corner_slot(corner(cell, b))];
        for (int r = 0; r < 3; ++r)
          for (int s = 0; s < 3; ++s) entries.emplace_back(3 * i + r, 3 * j + s, filled * cube(3 * a + r, 3 * b + s));
      }
  }
  // Separate parts that no node holds stay where they are rather than make the system singular.
  const double trace = 1e-9 * cube.diagonal().mean();
  for (int i = 0; i < 3 * corners; ++i) entries.emplace_back(i, i, trace);
  Eigen::SparseMatrix<double> stiffness(3 * static_cast<Eigen::Index>(corners), 3 * static_cast<Eigen::Index>(corners));
  stiffness.setFromTriplets(entries.begin(), entries.end());

  auto interpolation = [&](const Points& points) {
    std::vector<Eigen::Triplet<double>> rows;
    for (Eigen::Index p = 0; p < points.rows(); ++p) {
      const Vec3 x = points.row(p).transpose();
      const Eigen::Array3i cell = cell_of(x);
      const Eigen::Array3d f = (((x - lower) / size).array() - cell.cast<double>()).max(0.0).min(1.0);
      for (int c = 0; c < 8; ++c) {
        double w = 1.0;
        for (int r = 0; r < 3; ++r) w *= (c >> r & 1) != 0 ? f[r] : 1.0 - f[r];
        const int n = number[corner_slot(corner(cell, c))];
        if (w != 0.0 && n >= 0)
          for (int r = 0; r < 3; ++r) rows.emplace_back(3 * static_cast<int>(p) + r, 3 * n + r, w);
      }
    }
    Eigen::SparseMatrix<double> matrix(3 * points.rows(), 3 * static_cast<Eigen::Index>(corners));
    matrix.setFromTriplets(rows.begin(), rows.end());
    return matrix;
  };
  Points points(static_cast<Eigen::Index>(wanted.size()), 3);
  for (size_t k = 0; k < wanted.size(); ++k) points.row(static_cast<Eigen::Index>(k)) = weld.positions.row(wanted[k]);
  Green green = solve_green(stiffness, interpolation(nodes), interpolation(points), static_cast<int>(nodes.rows()), {}, threads);
  restore_rigid_motion(green, nodes, points);
  return green;
}

}  // namespace flexframe::interp
