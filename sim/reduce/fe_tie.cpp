// Nodes tied to faces. See fe_tie.h.
#include "sim/reduce/fe_tie.h"

#include "sim/reduce/fe_elements.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::sim {
namespace {

using Vec2 = Eigen::Vector2d;

FeShape shape_of(size_t nodes) {
  return nodes == 3 ? FeShape::triangle3 : nodes == 4 ? FeShape::quadrangle4 : nodes == 6 ? FeShape::triangle6 : FeShape::quadrangle8;
}
bool usable(const std::vector<int>& face) { return face.size() == 3 || face.size() == 4 || face.size() == 6 || face.size() == 8; }

Mat3X places(const FeModel& model, const std::vector<int>& face) {
  Mat3X X(3, face.size());
  for (size_t k = 0; k < face.size(); ++k) X.col(static_cast<Eigen::Index>(k)) = model.nodes[face[k]];
  return X;
}

Vec2 inside(Vec2 q, bool triangle) {
  if (!triangle) return q.cwiseMax(-1.0).cwiseMin(1.0);
  q = q.cwiseMax(0.0);
  if (q.sum() > 1.0) {
    // Onto the long edge.
    const double a = std::clamp(0.5 * (1.0 + q.x() - q.y()), 0.0, 1.0);
    q = {a, 1.0 - a};
  }
  return q;
}

// The nearest place on a face to x: shape functions there. Newton's method of the distance, kept inside of the face.
VecX nearest_place(FeShape shape, const Mat3X& X, const Vec3& x, double& distance) {
  const bool triangle = shape == FeShape::triangle3 || shape == FeShape::triangle6;
  Vec2 q = triangle ? Vec2(1.0 / 3, 1.0 / 3) : Vec2(0, 0);
  VecX N;
  MatX dN;
  for (int i = 0; i < 20; ++i) {
    surface_functions(shape, q, N, dN);
    const Eigen::Matrix<double, 3, 2> J = X * dN;
    const Eigen::Matrix2d normal = J.transpose() * J;
    if (!(std::abs(normal.determinant()) > 0.0)) break;
    const Vec2 next = inside(q + normal.inverse() * (J.transpose() * (x - X * N)), triangle);
    const double step = (next - q).norm();
    q = next;
    if (step < 1e-12) break;
  }
  surface_functions(shape, q, N, dN);
  distance = (x - X * N).norm();
  return N;
}

}  // namespace

double face_area(const FeModel& model, const std::vector<int>& face) {
  if (!usable(face)) return 0.0;
  double sum = 0.0;
  try {
    for (const FeShellPoint& p : shell_points(shape_of(face.size()), places(model, face), 0)) sum += p.area;
  } catch (const InputError&) {
    return 0.0;  // a face without area; the element itself will be complained of
  }
  return sum;
}

TieResult tie_nodes(FeModel& model, const std::vector<int>& slaves, const std::vector<std::vector<int>>& faces, double tolerance,
                    bool adjust) {
  TieResult out;
  std::vector<Mat3X> X;
  std::vector<std::pair<Vec3, double>> balls;  // around each face
  double edges = 0.0;
  for (const auto& face : faces) {
    X.push_back(places(model, face));
    const Vec3 middle = X.back().rowwise().mean();
    balls.emplace_back(middle, (X.back().colwise() - middle).colwise().norm().maxCoeff());
    edges += (X.back().col(1) - X.back().col(0)).norm();
  }
  out.tolerance = tolerance >= 0.0 ? tolerance : faces.empty() ? 0.0 : 0.05 * edges / static_cast<double>(faces.size());
  out.nearest = std::numeric_limits<double>::max();
  for (int node : slaves) {
    const Vec3 x = model.nodes[node];
    double best = std::numeric_limits<double>::max();
    VecX N;
    size_t at = 0;
    bool own = false;
    for (size_t k = 0; k < faces.size() && !own; ++k) {
      if (!usable(faces[k]) || (x - balls[k].first).norm() - balls[k].second >= best) continue;
      own = std::find(faces[k].begin(), faces[k].end(), node) != faces[k].end();
      if (own) break;
      double distance = 0.0;
      VecX found = nearest_place(shape_of(faces[k].size()), X[k], x, distance);
      if (distance < best) {
        best = distance;
        N = std::move(found);
        at = k;
      }
    }
    if (own) {
      ++out.tied;
      continue;
    }
    out.nearest = std::min(out.nearest, best);
    if (N.size() == 0 || best > out.tolerance) {
      ++out.left;
      continue;
    }
    ++out.tied;
    if (adjust) {
      model.nodes[node] = X[at] * N;
      out.moved = std::max(out.moved, best);
    }
    for (int d = 0; d < 3; ++d) {
      FeEquation e;
      e.terms.push_back({node, d, -1.0});
      for (size_t k = 0; k < faces[at].size(); ++k)
        if (const double c = N(static_cast<Eigen::Index>(k)); std::abs(c) > 1e-12) e.terms.push_back({faces[at][k], d, c});
      out.equations.push_back(std::move(e));
    }
  }
  return out;
}

}  // namespace flexframe::sim
