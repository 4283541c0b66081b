// Nodes tied to faces. See fe_tie.h.
#include "sim/reduce/fe_tie.h"

#include "sim/base/spatial.h"
#include "sim/reduce/fe_elements.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

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

std::vector<FeEquation> averaging_equations(const FeModel& model, const FeSpider& spider, const std::vector<int>& motions, const Mat3& Q) {
  const auto weight = [&](size_t i) { return spider.weights.empty() ? 1.0 : spider.weights[i]; };
  double total = 0.0;
  Vec3 middle = Vec3::Zero();
  for (size_t i = 0; i < spider.slaves.size(); ++i) {
    total += weight(i);
    middle += weight(i) * model.nodes[spider.slaves[i]];
  }
  middle /= total;
  Mat3 spread = Mat3::Zero();
  for (size_t i = 0; i < spider.slaves.size(); ++i) {
    const Mat3 r = skew(Vec3(model.nodes[spider.slaves[i]] - middle));
    spread -= weight(i) * r * r;
  }
  const Vec3 size = spread.selfadjointView<Eigen::Lower>().eigenvalues();
  const bool turns = size.minCoeff() > 1e-10 * size.maxCoeff();
  const Mat3 inverse = turns ? Mat3(spread.inverse()) : Mat3(Mat3::Zero());
  const Vec3 arm = model.nodes[spider.node] - middle;
  std::vector<FeEquation> out;
  for (const int d : motions) {
    if (!turns && (d >= 3 || !arm.isZero(0.0)))
      throw InputError(
          fmt::format("{}:{}: '{}': the nodes lie on a line or at one place and fix no rotation", model.file, spider.line, spider.name));
    const Vec3 along = Q.col(d % 3);
    // The point moves by mean translation and rotation x arm; the mean rotation is spread^-1 times the moments of the displacements.
    const Vec3 turn = inverse * (d < 3 ? arm.cross(along) : along);
    FeEquation e;
    e.line = spider.line;
    Eigen::Index main = 0;
    along.cwiseAbs().maxCoeff(&main);
    for (int k = 0; k < 3; ++k)
      if (const int axis = (static_cast<int>(main) + k) % 3; along(axis) != 0.0)
        e.terms.push_back({spider.node, (d < 3 ? 0 : 3) + axis, -along(axis)});
    for (size_t i = 0; i < spider.slaves.size(); ++i) {
      const Vec3 r = model.nodes[spider.slaves[i]] - middle;
      const Vec3 share = weight(i) * ((d < 3 ? Vec3(along / total) : Vec3(Vec3::Zero())) + turn.cross(r));
      for (int k = 0; k < 3; ++k)
        if (share(k) != 0.0) e.terms.push_back({spider.slaves[i], k, share(k)});
    }
    out.push_back(std::move(e));
  }
  return out;
}

void add_partial_means(FeModel& model, std::vector<PartialMean> means, const std::vector<bool>& turning) {
  std::set<int> named;
  for (const FeEquation& e : model.equations)
    for (const FeEquation::Term& t : e.terms) named.insert(t.node);
  for (const FeConstraint& c : model.constraints) named.insert(c.node);
  for (const FeSpider& s : model.spiders) {
    if (s.rigid) named.insert(s.node);
    named.insert(s.slaves.begin(), s.slaves.end());
  }
  for (PartialMean& mean : means) {
    const int node = mean.spider.node;
    const std::set<int> given(mean.motions.begin(), mean.motions.end());
    if (!turning[node] && !named.contains(node) && given.contains(0) && given.contains(1) && given.contains(2)) {
      model.spiders.push_back(std::move(mean.spider));
      continue;
    }
    for (FeEquation& e : averaging_equations(model, mean.spider, mean.motions, mean.axes)) model.equations.push_back(std::move(e));
  }
}

}  // namespace flexframe::sim
