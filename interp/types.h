// Vocabulary of the kernel map: sparse simulation nodes (its source) move dense animation vertices (its target).
// All arrays of points are row-major, one point a row (x y z), so that they lie over arrays of vec3. SI units, radians.
#pragma once

#include "sim/base/error.h"

#include <Eigen/Dense>

namespace flexframe::interp {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using PointsF = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Triangles = Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>;

// Bad input: NaN, no nodes, no faces, index out of range.
using flexframe::ArgumentError;
using flexframe::InputError;
using flexframe::MapError;

// Triangles over vertices. Views: the arrays must outlive the call, not the map.
// From plain arrays: MeshView{Eigen::Map<const Points>(&positions[0].x, M, 3), Eigen::Map<const Triangles>(&triangles[0].x, K, 3)}.
struct MeshView {
  Eigen::Map<const Points> vertices;      // M x 3, m
  Eigen::Map<const Triangles> triangles;  // K x 3, indices of vertices; K = 0: a cloud of points
};

}  // namespace flexframe::interp
