#include "interp/surface.h"

#include "interp/parallel.h"

#include <Eigen/Eigenvalues>

#include <cmath>
#include <numeric>

namespace flexframe::interp {
namespace {

// Angle from its cosine, within 7e-5 (Abramowitz and Stegun 1964, 4.4.45).
inline float angle_of(float cosine) {
  const float x = std::min(std::abs(cosine), 1.0f);
  const float a = std::sqrt(1.0f - x) * (1.5707288f + x * (-0.2121144f + x * (0.0742610f - 0.0187293f * x)));
  return cosine < 0.0f ? 3.14159265f - a : a;
}

}  // namespace

NormalLayout make_normal_layout(std::vector<int> corner_position, std::vector<int> corner_group, int groups) {
  NormalLayout layout;
  layout.groups = groups;
  layout.group_begin.assign(groups + 1, 0);
  for (const int g : corner_group) ++layout.group_begin[g + 1];
  std::partial_sum(layout.group_begin.begin(), layout.group_begin.end(), layout.group_begin.begin());
  layout.group_corner.resize(corner_group.size());
  std::vector<int> fill(layout.group_begin.begin(), layout.group_begin.end() - 1);
  for (size_t c = 0; c < corner_group.size(); ++c) layout.group_corner[fill[corner_group[c]]++] = static_cast<int>(c);
  layout.corner_position = std::move(corner_position);
  layout.corner_group = std::move(corner_group);
  return layout;
}

void compute_normals(const NormalLayout& layout, std::span<const float> positions, PointsF& normals, int threads) {
  const int corners = static_cast<int>(layout.corner_position.size());
  // Normal times twice the area of each triangle, and the angles of its corners.
  thread_local std::vector<float> face_memory, angle_memory;
  std::vector<float>& face = face_memory;
  std::vector<float>& angle = angle_memory;
  face.resize(corners);
  angle.resize(corners);
  parallel_chunks(corners / 3, 16384, threads, [&](int first, int last) {
    for (int t = first; t < last; ++t) {
      const size_t c = 3 * static_cast<size_t>(t);
      const float* a = positions.data() + 3 * static_cast<std::ptrdiff_t>(layout.corner_position[c]);
      const float* b = positions.data() + 3 * static_cast<std::ptrdiff_t>(layout.corner_position[c + 1]);
      const float* d = positions.data() + 3 * static_cast<std::ptrdiff_t>(layout.corner_position[c + 2]);
      const float ux = b[0] - a[0], uy = b[1] - a[1], uz = b[2] - a[2];
      const float vx = d[0] - a[0], vy = d[1] - a[1], vz = d[2] - a[2];
      const float wx = vx - ux, wy = vy - uy, wz = vz - uz;
      face[c] = uy * vz - uz * vy;
      face[c + 1] = uz * vx - ux * vz;
      face[c + 2] = ux * vy - uy * vx;
      const float uu = ux * ux + uy * uy + uz * uz, vv = vx * vx + vy * vy + vz * vz, ww = wx * wx + wy * wy + wz * wz;
      const float uv = ux * vx + uy * vy + uz * vz, uw = ux * wx + uy * wy + uz * wz;
      const float first_angle = angle_of(uv / std::sqrt(std::max(uu * vv, 1e-36f)));
      const float second_angle = angle_of(-uw / std::sqrt(std::max(uu * ww, 1e-36f)));
      angle[c] = first_angle;
      angle[c + 1] = second_angle;
      angle[c + 2] = std::max(0.0f, 3.14159265f - first_angle - second_angle);
    }
  });
  normals.resize(layout.groups, 3);
  parallel_chunks(layout.groups, 16384, threads, [&](int first, int last) {
    for (int g = first; g < last; ++g) {
      float x = 0.0f, y = 0.0f, z = 0.0f;
      for (int k = layout.group_begin[g]; k < layout.group_begin[g + 1]; ++k) {
        const size_t c = layout.group_corner[k], t = c - c % 3;
        x += angle[c] * face[t];
        y += angle[c] * face[t + 1];
        z += angle[c] * face[t + 2];
      }
      // Scaled before it is squared: small meshes have areas whose squares a float cannot hold.
      const float largest = std::max({std::abs(x), std::abs(y), std::abs(z)});
      float* n = normals.data() + 3 * static_cast<std::ptrdiff_t>(g);
      if (!(largest > 0.0f) || !std::isfinite(largest)) {
        n[0] = n[1] = 0.0f;
        n[2] = 1.0f;
        continue;
      }
      x /= largest;
      y /= largest;
      z /= largest;
      const float scale = 1.0f / std::sqrt(x * x + y * y + z * z);
      n[0] = x * scale;
      n[1] = y * scale;
      n[2] = z * scale;
    }
  });
}

void compute_magnitude(std::span<const float> displacement, std::span<float> out) {
  for (size_t v = 0; v < out.size(); ++v) {
    const float* u = displacement.data() + 3 * v;
    out[v] = std::sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
  }
}

void compute_strain(const MeshView& mesh, std::span<const int> welded, std::span<const float> displacement, std::span<float> out,
                    bool linear) {
  const double squares = linear ? 0.0 : 1.0;
  const size_t count = mesh.vertices.rows();
  std::vector<double> sum(count, 0.0), weight(count, 0.0);
  auto row = [&](int v) { return static_cast<size_t>(welded.empty() ? v : welded[v]); };
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const Eigen::Vector3i c = mesh.triangles.row(t).transpose();
    const Vec3 e1 = (mesh.vertices.row(c[1]) - mesh.vertices.row(c[0])).transpose(),
               e2 = (mesh.vertices.row(c[2]) - mesh.vertices.row(c[0])).transpose();
    const double l1 = e1.norm(), area = e1.cross(e2).norm();
    if (!(area > 1e-12 * l1 * e2.norm())) continue;
    // Edges in the triangle's plane before and their dot products after: F^T F needs no more.
    auto moved = [&](int v) {
      return Eigen::Map<const Eigen::Vector3f>(displacement.data() + 3 * static_cast<std::ptrdiff_t>(v)).cast<double>().eval();
    };
    const Vec3 d1 = moved(c[1]) - moved(c[0]), d2 = moved(c[2]) - moved(c[0]);
    Eigen::Matrix2d rest;
    rest << l1, e1.dot(e2) / l1, 0.0, area / l1;
    // Change of the edges' dot products, written without cancellation.
    Eigen::Matrix2d change;
    change(0, 0) = 2.0 * e1.dot(d1) + squares * d1.squaredNorm();
    change(0, 1) = change(1, 0) = e1.dot(d2) + e2.dot(d1) + squares * d1.dot(d2);
    change(1, 1) = 2.0 * e2.dot(d2) + squares * d2.squaredNorm();
    const Eigen::Matrix2d inverse = rest.inverse();
    const Eigen::Matrix2d strain = 0.5 * inverse.transpose() * change * inverse;
    const double mean = 0.5 * strain.trace(), radius = std::hypot(0.5 * (strain(0, 0) - strain(1, 1)), strain(0, 1));
    const double a = mean + radius, b = mean - radius, equivalent = std::sqrt(std::max(0.0, a * a - a * b + b * b));
    for (int k = 0; k < 3; ++k) {
      sum[row(c[k])] += area * equivalent;
      weight[row(c[k])] += area;
    }
  }
  for (size_t v = 0; v < count; ++v) {
    const size_t r = row(static_cast<int>(v));
    out[v] = weight[r] > 0.0 ? static_cast<float>(sum[r] / weight[r]) : 0.0f;
  }
}

}  // namespace flexframe::interp
