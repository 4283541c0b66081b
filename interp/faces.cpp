#include "interp/faces.h"

#include "interp/parallel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

namespace flexframe::interp {
namespace {

using Natural = Eigen::Vector2d;

int point_count(const FaceMesh& mesh, Eigen::Index face) { return static_cast<int>((mesh.faces.row(face).array() >= 0).count()); }
bool is_triangle(int count) { return count % 3 == 0; }

// Shape functions and their derivatives at natural coordinates: of triangles from 0 to 1 with the first corner at 0, of quadrangles from
// -1 to 1.
void shapes_at(int count, const Natural& at, FaceFoot& foot) {
  const double r = at[0], s = at[1];
  foot.count = count;
  const auto set = [&](size_t k, double value, double by_r, double by_s) {
    foot.value[k] = value;
    foot.slope[k] = {by_r, by_s};
  };
  if (is_triangle(count)) {
    const std::array<double, 3> l{1.0 - r - s, r, s};
    constexpr std::array<std::array<double, 2>, 3> d{{{-1.0, -1.0}, {1.0, 0.0}, {0.0, 1.0}}};
    for (size_t k = 0; k < 3; ++k) {
      const size_t j = (k + 1) % 3;
      if (count == 3) {
        set(k, l[k], d[k][0], d[k][1]);
        continue;
      }
      set(k, l[k] * (2.0 * l[k] - 1.0), d[k][0] * (4.0 * l[k] - 1.0), d[k][1] * (4.0 * l[k] - 1.0));
      set(3 + k, 4.0 * l[k] * l[j], 4.0 * (d[k][0] * l[j] + l[k] * d[j][0]), 4.0 * (d[k][1] * l[j] + l[k] * d[j][1]));
    }
    return;
  }
  constexpr std::array<std::array<double, 2>, 4> corner{{{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}}};
  for (size_t k = 0; k < 4; ++k) {
    const double a = corner[k][0], b = corner[k][1], p = 1.0 + a * r, q = 1.0 + b * s;
    if (count == 4) {
      set(k, 0.25 * p * q, 0.25 * a * q, 0.25 * p * b);
      continue;
    }
    const double rest = a * r + b * s - 1.0;
    set(k, 0.25 * p * q * rest, 0.25 * a * q * (rest + p), 0.25 * b * p * (rest + q));
    // The middle of the edge to the next corner: along r for the first and third, along s for the others.
    if (k % 2 == 0) set(4 + k, 0.5 * (1.0 - r * r) * q, -r * q, 0.5 * (1.0 - r * r) * b);
    else set(4 + k, 0.5 * (1.0 - s * s) * p, 0.5 * (1.0 - s * s) * a, -s * p);
  }
}

Natural into_face(int count, Natural at) {
  if (!is_triangle(count)) return at.cwiseMax(-1.0).cwiseMin(1.0);
  at = at.cwiseMax(0.0);
  const double over = at.sum() - 1.0;
  if (over > 0.0) {
    at -= Natural::Constant(0.5 * over);
    if (at[0] < 0.0) at = {0.0, 1.0};
    if (at[1] < 0.0) at = {1.0, 0.0};
  }
  return at;
}

// A flat piece of a face: its corners as places among the face's points.
struct Piece {
  int face;
  std::array<int, 3> place;
};

// Natural coordinates of a face's points.
Natural natural_of(int count, int place) {
  if (is_triangle(count)) {
    constexpr std::array<std::array<double, 2>, 6> at{{{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}, {0.5, 0.0}, {0.5, 0.5}, {0.0, 0.5}}};
    return {at[place][0], at[place][1]};
  }
  constexpr std::array<std::array<double, 2>, 8> at{
      {{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}, {0.0, -1.0}, {1.0, 0.0}, {0.0, 1.0}, {-1.0, 0.0}}};
  return {at[place][0], at[place][1]};
}

std::vector<Piece> flat_pieces(const FaceMesh& mesh) {
  std::vector<Piece> out;
  for (int f = 0; f < mesh.faces.rows(); ++f) {
    const auto add = [&](int a, int b, int c) { out.push_back({f, {a, b, c}}); };
    switch (point_count(mesh, f)) {
      case 3:
        add(0, 1, 2);
        break;
      case 4:
        add(0, 1, 2);
        add(0, 2, 3);
        break;
      case 6:
        add(0, 3, 5);
        add(3, 1, 4);
        add(5, 4, 2);
        add(3, 4, 5);
        break;
      default:
        add(0, 4, 7);
        add(4, 1, 5);
        add(5, 2, 6);
        add(6, 3, 7);
        add(4, 5, 6);
        add(4, 6, 7);
    }
  }
  return out;
}

// Barycentric coordinates of the point of a triangle nearest to p (Ericson, Real-time collision detection, 2005, 5.1.5).
Vec3 nearest_in_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return {1.0, 0.0, 0.0};
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return {0.0, 1.0, 0.0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3) return {1.0 - d1 / (d1 - d3), d1 / (d1 - d3), 0.0};
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return {0.0, 0.0, 1.0};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && d2 > d6) return {1.0 - d2 / (d2 - d6), 0.0, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4, rest = (d4 - d3) + (d5 - d6);
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 && rest > 0.0) return {0.0, 1.0 - (d4 - d3) / rest, (d4 - d3) / rest};
  const double all = va + vb + vc;
  if (!(all > 0.0)) return {1.0, 0.0, 0.0};
  return {va / all, vb / all, vc / all};
}

// Boxes round the flat pieces, halved along their longest side until few are left in each.
class PieceTree {
 public:
  explicit PieceTree(const FaceMesh& mesh) : mesh_(mesh), pieces_(flat_pieces(mesh)) {
    order_.resize(pieces_.size());
    std::iota(order_.begin(), order_.end(), 0);
    middle_.reserve(pieces_.size());
    for (const Piece& p : pieces_) middle_.push_back((corner(p, 0) + corner(p, 1) + corner(p, 2)) / 3.0);
    build(0, static_cast<int>(order_.size()));
  }

  struct Hit {
    const Piece* piece = nullptr;
    Vec3 share = Vec3::Zero();
    double squared = std::numeric_limits<double>::infinity();
  };
  // Of all faces but those.
  Hit nearest(const Vec3& x, std::span<const int> without) const {
    Hit best;
    search(0, x, without, best);
    return best;
  }

 private:
  struct Box {
    Vec3 lower, upper;
    int first, last, right;  // right: the second half, the first one follows; 0: a leaf
  };

  Vec3 corner(const Piece& p, size_t k) const { return mesh_.points.row(mesh_.faces(p.face, p.place[k])).transpose(); }

  int build(int first, int last) {
    Box box{Vec3::Constant(std::numeric_limits<double>::infinity()), Vec3::Constant(-std::numeric_limits<double>::infinity()), first, last,
            0};
    for (int i = first; i < last; ++i)
      for (size_t k = 0; k < 3; ++k) {
        const Vec3 c = corner(pieces_[order_[i]], k);
        box.lower = box.lower.cwiseMin(c);
        box.upper = box.upper.cwiseMax(c);
      }
    const auto at = static_cast<int>(boxes_.size());
    boxes_.push_back(box);
    constexpr int few = 4;
    if (last - first <= few) return at;
    Eigen::Index axis = 0;
    (box.upper - box.lower).maxCoeff(&axis);
    const int half = (first + last) / 2;
    std::nth_element(order_.begin() + first, order_.begin() + half, order_.begin() + last, [&](int a, int b) {
      const double u = middle_[a][axis], v = middle_[b][axis];
      return u < v || (u == v && a < b);
    });
    build(first, half);
    const int right = build(half, last);
    boxes_[at].right = right;
    return at;
  }

  double squared_to(int box, const Vec3& x) const {
    const Box& b = boxes_[box];
    return (x - x.cwiseMax(b.lower).cwiseMin(b.upper)).squaredNorm();
  }

  void search(int box, const Vec3& x, std::span<const int> without, Hit& best) const {
    const Box& b = boxes_[box];
    if (b.right == 0) {
      for (int i = b.first; i < b.last; ++i) {
        const Piece& p = pieces_[order_[i]];
        if (std::find(without.begin(), without.end(), p.face) != without.end()) continue;
        const Vec3 u = corner(p, 0), v = corner(p, 1), w = corner(p, 2);
        const Vec3 share = nearest_in_triangle(x, u, v, w);
        const double squared = (x - share[0] * u - share[1] * v - share[2] * w).squaredNorm();
        if (squared < best.squared || (squared == best.squared && best.piece && &p < best.piece)) best = {&p, share, squared};
      }
      return;
    }
    const double left = squared_to(box + 1, x), right = squared_to(b.right, x);
    const std::array<std::pair<double, int>, 2> halves = left <= right ? std::array{std::pair(left, box + 1), std::pair(right, b.right)}
                                                                       : std::array{std::pair(right, b.right), std::pair(left, box + 1)};
    for (const auto& [squared, half] : halves)
      if (squared <= best.squared) search(half, x, without, best);
  }

  const FaceMesh& mesh_;
  std::vector<Piece> pieces_;
  std::vector<int> order_;
  std::vector<Vec3> middle_;
  std::vector<Box> boxes_;
};

// The face's point at a foot, and its tangents.
struct Local {
  Vec3 point = Vec3::Zero();
  Eigen::Matrix<double, 3, 2> tangents = Eigen::Matrix<double, 3, 2>::Zero();
};
Local local_at(const FaceMesh& mesh, const FaceFoot& foot) {
  Local l;
  for (int k = 0; k < foot.count; ++k) {
    const Vec3 x = mesh.points.row(foot.point[k]).transpose();
    l.point += foot.value[k] * x;
    for (int c = 0; c < 2; ++c) l.tangents.col(c) += foot.slope[k][c] * x;
  }
  return l;
}

// The nearest point of one face, sought from a point of one of its flat pieces; whether it lies on the face's rim.
std::pair<FaceFoot, bool> foot_on_face(const FaceMesh& mesh, const PieceTree::Hit& hit, const Vec3& x) {
  const int face = hit.piece->face, count = point_count(mesh, face);
  FaceFoot foot;
  for (int k = 0; k < count; ++k) foot.point[k] = mesh.faces(face, k);
  Natural at = Natural::Zero();
  for (size_t k = 0; k < 3; ++k) at += hit.share[static_cast<Eigen::Index>(k)] * natural_of(count, hit.piece->place[k]);
  shapes_at(count, at, foot);
  foot.arm = x - local_at(mesh, foot).point;
  // Flat triangles are done; a step that does not come nearer ends the search on the others.
  constexpr int most_steps = 20;
  for (int step = 0; step < most_steps && count > 3; ++step) {
    const Local l = local_at(mesh, foot);
    const Eigen::Matrix2d metric = l.tangents.transpose() * l.tangents;
    const double determinant = metric.determinant();
    if (!(determinant > 1e-12 * metric.trace() * metric.trace())) break;
    const Natural next = into_face(count, at + metric.inverse() * (l.tangents.transpose() * foot.arm));
    FaceFoot nearer = foot;
    shapes_at(count, next, nearer);
    nearer.arm = x - local_at(mesh, nearer).point;
    if (!(nearer.arm.squaredNorm() < foot.arm.squaredNorm())) break;
    const bool settled = (next - at).norm() < 1e-12;
    foot = nearer;
    at = next;
    if (settled) break;
  }
  constexpr double near = 1e-9;
  const bool rim = is_triangle(count) ? at.minCoeff() < near || at.sum() > 1.0 - near : at.cwiseAbs().maxCoeff() > 1.0 - near;
  return {foot, rim && count > 3};
}

FaceFoot foot_of(const FaceMesh& mesh, const PieceTree& tree, const Vec3& x) {
  // Near an edge the flat pieces of one face may lie nearer and the bent face beside it all the same: where the foot is on a rim, its
  // neighbours are asked too.
  constexpr size_t most_faces = 6;
  std::vector<int> tried;
  FaceFoot best;
  while (tried.size() < most_faces) {
    const PieceTree::Hit hit = tree.nearest(x, tried);
    if (!hit.piece) break;
    const auto [foot, rim] = foot_on_face(mesh, hit, x);
    if (tried.empty() || foot.arm.squaredNorm() < best.arm.squaredNorm()) best = foot;
    if (!rim || best.arm.isZero(0.0)) break;
    tried.push_back(hit.piece->face);
  }
  return best;
}

// Contravariant tangents and the normal; zero on a face without area.
struct Frame {
  Eigen::Matrix<double, 3, 2> tangents, dual = Eigen::Matrix<double, 3, 2>::Zero();
  Vec3 normal = Vec3::Zero();
};
Frame frame_at(const FaceMesh& mesh, const FaceFoot& foot) {
  Frame f;
  f.tangents = local_at(mesh, foot).tangents;
  const Eigen::Matrix2d metric = f.tangents.transpose() * f.tangents;
  if (!(metric.determinant() > 1e-12 * metric.trace() * metric.trace())) return f;
  f.dual = f.tangents * metric.inverse();
  f.normal = Vec3(f.tangents.col(0)).cross(Vec3(f.tangents.col(1))).normalized();
  return f;
}

constexpr int grain = 512;

}  // namespace

std::vector<FaceFoot> find_feet(const FaceMesh& faces, const Eigen::Ref<const Points>& vertices, int threads) {
  if (faces.faces.rows() == 0) throw InputError("a surface of finite elements without faces moves no mesh");
  for (Eigen::Index f = 0; f < faces.faces.rows(); ++f) {
    const int count = point_count(faces, f);
    const bool usual = count == 3 || count == 4 || count == 6 || count == 8;
    if (!usual || faces.faces.row(f).maxCoeff() >= faces.points.rows() || (faces.faces.row(f).head(count).array() < 0).any())
      throw InputError(fmt::format("face {} of a surface must have 3, 4, 6 or 8 points of its {}", f, faces.points.rows()));
  }
  const PieceTree tree(faces);
  std::vector<FaceFoot> feet(vertices.rows());
  parallel_chunks(static_cast<int>(vertices.rows()), grain, thread_count(threads), [&](int first, int last) {
    for (int v = first; v < last; ++v) feet[v] = foot_of(faces, tree, vertices.row(v).transpose());
  });
  return feet;
}

FaceGap measure_gap(const std::vector<FaceFoot>& feet) {
  FaceGap gap;
  for (const FaceFoot& foot : feet) {
    gap.largest = std::max(gap.largest, foot.arm.norm());
    gap.mean += foot.arm.squaredNorm() / static_cast<double>(feet.size());
  }
  gap.mean = std::sqrt(gap.mean);
  return gap;
}

ModeColumns map_displacement(const FaceMesh& faces, const std::vector<FaceFoot>& feet, const Eigen::Ref<const Eigen::MatrixXd>& phi) {
  ModeColumns out(3 * std::ssize(feet), phi.cols());
  parallel_chunks(static_cast<int>(feet.size()), grain, thread_count(0), [&](int first, int last) {
    for (int v = first; v < last; ++v) {
      const FaceFoot& foot = feet[v];
      const Frame frame = frame_at(faces, foot);
      const double off = foot.arm.dot(frame.normal);
      const Eigen::Vector2d beside = frame.dual.transpose() * foot.arm;
      // u + r^a u_a - r_n a^a (n . u_a): the arm's part in the face goes on straight, its normal part turns with the face.
      std::array<Mat3, 8> block;
      for (int k = 0; k < foot.count; ++k) {
        const Eigen::Vector2d slope(foot.slope[k][0], foot.slope[k][1]);
        block[k] = (foot.value[k] + beside.dot(slope)) * Mat3::Identity() - off * (frame.dual * slope) * frame.normal.transpose();
      }
      for (Eigen::Index m = 0; m < phi.cols(); ++m) {
        Vec3 u = Vec3::Zero();
        for (int k = 0; k < foot.count; ++k) u += block[k] * phi.col(m).segment<3>(3 * static_cast<Eigen::Index>(foot.point[k]));
        for (Eigen::Index c = 0; c < 3; ++c) out(3 * static_cast<Eigen::Index>(v) + c, m) = static_cast<float>(u[c]);
      }
    }
  });
  return out;
}

ModeColumns map_field(const std::vector<FaceFoot>& feet, int width, const Eigen::Ref<const Eigen::MatrixXd>& field) {
  ModeColumns out(width * std::ssize(feet), field.cols());
  parallel_chunks(static_cast<int>(feet.size()), grain, thread_count(0), [&](int first, int last) {
    for (int v = first; v < last; ++v) {
      const FaceFoot& foot = feet[v];
      for (Eigen::Index m = 0; m < field.cols(); ++m)
        for (int c = 0; c < width; ++c) {
          double value = 0.0;
          for (int k = 0; k < foot.count; ++k) value += foot.value[k] * field(width * static_cast<Eigen::Index>(foot.point[k]) + c, m);
          out(width * static_cast<Eigen::Index>(v) + c, m) = static_cast<float>(value);
        }
    }
  });
  return out;
}

ModeColumns map_doubt(const FaceMesh& faces, const std::vector<FaceFoot>& feet, const Eigen::Ref<const Eigen::MatrixXd>& phi) {
  ModeColumns out(3 * std::ssize(feet), phi.cols());
  parallel_chunks(static_cast<int>(feet.size()), grain, thread_count(0), [&](int first, int last) {
    for (int v = first; v < last; ++v) {
      const FaceFoot& foot = feet[v];
      const Frame frame = frame_at(faces, foot);
      const Vec3 e1 = frame.tangents.col(0).normalized(), e2 = frame.normal.cross(e1);
      const double arm = foot.arm.norm();
      for (Eigen::Index m = 0; m < phi.cols(); ++m) {
        Mat3 gradient = Mat3::Zero();  // du_a / dx_b along the face
        for (int k = 0; k < foot.count; ++k)
          gradient += phi.col(m).segment<3>(3 * static_cast<Eigen::Index>(foot.point[k])) *
                      (frame.dual * Eigen::Vector2d(foot.slope[k][0], foot.slope[k][1])).transpose();
        const std::array<double, 3> strain{e1.dot(gradient * e1), e2.dot(gradient * e2), e1.dot(gradient * e2) + e2.dot(gradient * e1)};
        for (size_t c = 0; c < 3; ++c)
          out(3 * static_cast<Eigen::Index>(v) + static_cast<Eigen::Index>(c), m) = static_cast<float>(arm * strain[c]);
      }
    }
  });
  return out;
}

}  // namespace flexframe::interp
