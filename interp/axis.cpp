#include "interp/axis.h"

#include "interp/dense_solvers.h"
#include "interp/lift.h"
#include "interp/rotation.h"

#include <numeric>

namespace flexframe::interp {
namespace {

// Slopes of the C2 cubic spline from the mean slopes of its intervals, dense n x (n-1). Ends: not-a-knot, or zero curvature.
Eigen::MatrixXd spline_slopes(std::span<const double> length, bool natural) {
  const auto m = static_cast<Eigen::Index>(length.size()), n = m + 1;
  if (m == 1) return Eigen::MatrixXd::Ones(2, 1);
  auto len = [&](Eigen::Index k) { return length[k]; };
  if (m == 2 && !natural) {
    // Parabola through three nodes.
    Eigen::MatrixXd s(3, 2);
    const double a = len(0), b = len(1), c = a + b;
    s << 1.0 + a / c, -a / c, b / c, a / c, -b / c, 1.0 + b / c;
    return s;
  }
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n), b = Eigen::MatrixXd::Zero(n, m);
  for (Eigen::Index i = 1; i + 1 < n; ++i) {
    const double l = 1.0 / len(i - 1), r = 1.0 / len(i);
    a(i, i - 1) = l;
    a(i, i) = 2.0 * (l + r);
    a(i, i + 1) = r;
    b(i, i - 1) = 3.0 * l;
    b(i, i) = 3.0 * r;
  }
  if (natural) {
    a(0, 0) = a(n - 1, n - 1) = 2.0;
    a(0, 1) = a(n - 1, n - 2) = 1.0;
    b(0, 0) = b(n - 1, m - 1) = 3.0;
  } else {
    // Equal third derivatives in the first two and in the last two intervals, times the square of the shorter length.
    auto not_a_knot = [&](Eigen::Index row, Eigen::Index k) {
      const double scale = std::min(len(k), len(k + 1)), p = std::pow(scale / len(k), 2), q = std::pow(scale / len(k + 1), 2);
      a(row, k) += p;
      a(row, k + 1) += p - q;
      a(row, k + 2) -= q;
      b(row, k) += 2.0 * p;
      b(row, k + 1) -= 2.0 * q;
    };
    not_a_knot(0, 0);
    not_a_knot(n - 1, m - 2);
  }
  return solve_by_full_pivots(a, b);
}

constexpr Eigen::Index window_rows = 32;  // the influence of a slope falls by 3.7 per interval: 1e-18 over a window's margin

Eigen::SparseMatrix<double, Eigen::RowMajor> make_slopes(const std::vector<double>& s, bool natural) {
  if (s.size() < 2) throw ArgumentError("an axis needs at least two nodes");
  const auto n = static_cast<Eigen::Index>(s.size());
  std::vector<double> length(s.size() - 1);
  for (size_t k = 0; k + 1 < s.size(); ++k) length[k] = s[k + 1] - s[k];
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index row = 0; row < n; row += window_rows) {
    const Eigen::Index last = std::min(n, row + window_rows);
    const Eigen::Index lo = std::max<Eigen::Index>(0, row - window_rows), hi = std::min(n, last + window_rows);
    const Eigen::MatrixXd local = spline_slopes(std::span(length).subspan(lo, hi - lo - 1), natural);
    for (Eigen::Index i = row; i < last; ++i)
      for (Eigen::Index k = 0; k < local.cols(); ++k)
        if (local(i - lo, k) != 0.0) entries.emplace_back(static_cast<int>(i), static_cast<int>(lo + k), local(i - lo, k));
  }
  Eigen::SparseMatrix<double, Eigen::RowMajor> slopes(n, n - 1);
  slopes.setFromTriplets(entries.begin(), entries.end());
  return slopes;
}

struct Hermite {
  double v0, v1, g0, g1;  // weights of the two values and of the two slopes (per unit length of the parameter)
};
Hermite hermite(double x, double length) {
  const double y = 1.0 - x;
  return {y * y * (1.0 + 2.0 * x), x * x * (3.0 - 2.0 * x), length * x * y * y, -length * x * x * y};
}
Hermite hermite_derivative(double x, double length) {
  const double y = 1.0 - x;
  return {-6.0 * x * y / length, 6.0 * x * y / length, y * (1.0 - 3.0 * x), x * (3.0 * x - 2.0)};
}

// What the axis leads the sections by in each interval. turned: how its middle is turned, Mat3(size_t interval).
template <class Turned>
std::vector<Vec3> interval_shear(const AxisLift& axis, const Points& p, const Points& slope, const Turned& turned) {
  std::vector<Vec3> out(axis.s.size() - 1, Vec3::Zero());
  for (size_t k = 0; k < axis.sheared.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const Vec3 apart = ((p.row(i + 1) - p.row(i)) / (axis.s[k + 1] - axis.s[k]) - 0.5 * (slope.row(i) + slope.row(i + 1))).transpose();
    const Mat3 middle = turned(k);
    out[k] = middle * axis.sheared[k] * (middle.transpose() * apart);
  }
  return out;
}

// The axis at x = 0..1 of interval k: its place, its tangent, and the tangent less the shear, to which the section is square. Between two
// intervals of other shear the tangent is their mean.
struct AxisPoint {
  Vec3 place, tangent, normal;
};
AxisPoint axis_point(const AxisLift& axis, const Points& p, const Points& slope, const std::vector<Vec3>& shear, Eigen::Index k, double x) {
  const double length = axis.s[k + 1] - axis.s[k];
  const Hermite h = hermite(x, length), d = hermite_derivative(x, length);
  AxisPoint out;
  out.place =
      (h.v0 * p.row(k) + h.v1 * p.row(k + 1) + h.g0 * slope.row(k) + h.g1 * slope.row(k + 1)).transpose() + (h.g0 + h.g1) * shear[k];
  out.tangent =
      (d.v0 * p.row(k) + d.v1 * p.row(k + 1) + d.g0 * slope.row(k) + d.g1 * slope.row(k + 1)).transpose() + (d.g0 + d.g1) * shear[k];
  out.normal = out.tangent - shear[k];
  if (x == 0.0 && k > 0) out.tangent += 0.5 * (shear[k - 1] - shear[k]);
  return out;
}

// Fills rows 6 k + 2 .. 6 k + 5 from the turned directions at the stations; derivatives by parabolas through neighbours.
void set_directions(const AxisLift& axis, const std::vector<Vec3>& turned2, const std::vector<Vec3>& turned3, Points& out) {
  const size_t n = axis.station.size();
  auto derivative = [&](const std::vector<Vec3>& f, size_t k) -> Vec3 {
    if (n < 3) return (f[1] - f[0]) / (axis.station[1] - axis.station[0]);
    const size_t c = std::clamp<size_t>(k, 1, n - 2);
    const double a = axis.station[c] - axis.station[c - 1], b = axis.station[c + 1] - axis.station[c];
    const Vec3 left = (f[c] - f[c - 1]) / a, right = (f[c + 1] - f[c]) / b;
    const Vec3 curve = (right - left) / (a + b);
    if (k < c) return left - a * curve;
    if (k > c) return right + b * curve;
    return left + a * curve;
  };
  for (size_t k = 0; k < n; ++k) {
    const auto row = static_cast<Eigen::Index>(6 * k);
    out.row(row + 2) = turned2[k].transpose();
    out.row(row + 3) = derivative(turned2, k).transpose();
    out.row(row + 4) = turned3[k].transpose();
    out.row(row + 5) = derivative(turned3, k).transpose();
  }
}

}  // namespace

AxisLift make_axis(const Points& nodes, bool rotations_given) {
  AxisLift axis;
  axis.given = rotations_given;
  const Vec3 centre = nodes.colwise().mean().transpose();
  const Points local = nodes.rowwise() - centre.transpose();
  const PrincipalAxes principal = principal_axes(local.transpose() * local);
  Vec3 direction = principal.axes.col(2);
  // The sign that makes the largest component positive: independent of the eigensolver's choice.
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  if (direction[largest] < 0.0) direction = -direction;
  const Vec3 side = Vec3::Unit((largest + 1) % 3);
  axis.frame.col(0) = direction;
  axis.frame.col(1) = (side - direction * direction.dot(side)).normalized();
  axis.frame.col(2) = direction.cross(axis.frame.col(1));
  axis.origin = centre;

  axis.order.resize(nodes.rows());
  std::iota(axis.order.begin(), axis.order.end(), 0);
  const Eigen::VectorXd s = local * direction;
  std::stable_sort(axis.order.begin(), axis.order.end(), [&](int a, int b) { return s[a] < s[b]; });
  axis.positions.resize(nodes.rows(), 3);
  axis.offset.resize(nodes.rows(), 3);
  for (size_t k = 0; k < axis.order.size(); ++k) {
    const int i = axis.order[k];
    axis.s.push_back(s[i]);
    axis.positions.row(static_cast<Eigen::Index>(k)) = nodes.row(i);
    axis.offset.row(static_cast<Eigen::Index>(k)) = local.row(i) - s[i] * direction.transpose();
  }
  for (size_t k = 0; k + 1 < axis.s.size(); ++k)
    for (int j = 0; j < axis.subdivisions; ++j) axis.station.push_back(axis.s[k] + (axis.s[k + 1] - axis.s[k]) * j / axis.subdivisions);
  axis.station.push_back(axis.s.back());

  // Not-a-knot ends are of fourth order; uneven nodes can make them overshoot, then ends without curvature.
  axis.slopes = make_slopes(axis.s, false);
  if (axis.s.size() > 3 && axis_lebesgue(axis, axis.s.front(), axis.s.back()) > 4.0) axis.slopes = make_slopes(axis.s, true);
  return axis;
}

void set_shear(AxisLift& axis, const std::vector<Mat3>& shear) {
  axis.sheared.clear();
  for (size_t k = 0; k + 1 < axis.s.size(); ++k) {
    // Phi by the mean of both ends. It commutes with its inverse below.
    const Mat3 phi = 6.0 / std::pow(axis.s[k + 1] - axis.s[k], 2) * (shear[axis.order[k]] + shear[axis.order[k + 1]]);
    axis.sheared.push_back(phi * (Mat3::Identity() + phi).inverse());
  }
}

int source_count(const AxisLift& axis) { return 6 * static_cast<int>(axis.station.size()); }

Points lift_exact(const AxisLift& axis, const Points& displacement, const Points& rotation) {
  const auto n = static_cast<Eigen::Index>(axis.s.size());
  const Vec3 t = axis.frame.col(0);
  const bool given = axis.given && rotation.rows() > 0;
  Points u(n, 3), theta(given ? n : 0, 3);
  for (Eigen::Index k = 0; k < n; ++k) {
    u.row(k) = displacement.row(axis.order[k]);
    if (given) theta.row(k) = rotation.row(axis.order[k]);
  }
  // In the frame that follows the nodes best, so that a common motion leaves exactly nothing behind.
  const RigidMotion rigid = best_rigid_motion(axis.positions, u, theta);
  std::vector<Mat3> turn(n, Mat3::Identity());
  Points node(n, 3);  // nodes as moved, in that frame
  for (Eigen::Index k = 0; k < n; ++k) {
    const Vec3 moved = (axis.positions.row(k) + u.row(k)).transpose();
    node.row(k) = (rigid.rotation.transpose() * (moved - rigid.centre - rigid.translation) + rigid.centre).transpose();
    if (given) turn[k] = rigid.rotation.transpose() * rotation_matrix(theta.row(k).transpose());
  }

  // Points of the axis below the nodes, and slopes of the axis there.
  Points p(n, 3), slope(n, 3);
  auto settle = [&] {
    for (Eigen::Index k = 0; k < n; ++k) p.row(k) = node.row(k) - (turn[k] * axis.offset.row(k).transpose()).transpose();
  };
  Points chord(n - 1, 3);
  auto spline = [&] {
    for (Eigen::Index k = 0; k + 1 < n; ++k) chord.row(k) = (p.row(k + 1) - p.row(k)) / (axis.s[k + 1] - axis.s[k]);
    slope = axis.slopes * chord;
  };
  settle();
  if (given) {
    // Direction from the node's rotation; stretch from the arc that spans the chord between the two directions.
    Eigen::VectorXd strain(n - 1);
    for (Eigen::Index k = 0; k + 1 < n; ++k) {
      const Vec3 a = turn[k] * t, b = turn[k + 1] * t;
      const double half = 0.5 * std::atan2(a.cross(b).norm(), a.dot(b));
      const double arc = half > 1e-4 ? half / std::sin(half) : 1.0 + half * half / 6.0;
      strain[k] = (p.row(k + 1) - p.row(k)).norm() * arc / (axis.s[k + 1] - axis.s[k]) - 1.0;
    }
    const Eigen::VectorXd stretch = axis.slopes * strain;
    for (Eigen::Index k = 0; k < n; ++k) slope.row(k) = (1.0 + std::max(stretch[k], -0.9)) * (turn[k] * t).transpose();
  } else {
    // Twist-free frames along the spline; offsets of the nodes turn with it, which moves the spline a little: twice.
    for (int pass = 0; pass < 2; ++pass) {
      if (pass > 0) settle();
      spline();
      for (Eigen::Index k = 0; k < n; ++k) {
        const double length = slope.row(k).norm();
        const Vec3 along = length > 0.0 ? Vec3(slope.row(k).transpose() / length) : t;
        const Mat3 before = k > 0 ? turn[k - 1] : Mat3(Mat3::Identity());
        turn[k] = shortest_rotation(before * t, along) * before;
      }
    }
  }

  // Twist of each interval about the axis, as a spline.
  Eigen::VectorXd twist = Eigen::VectorXd::Zero(n - 1), rate = twist;
  std::vector<Vec3> relative(n - 1);
  for (Eigen::Index k = 0; k + 1 < n; ++k) {
    relative[k] = rotation_vector(turn[k].transpose() * turn[k + 1]);
    twist[k] = relative[k].dot(t);
    rate[k] = twist[k] / (axis.s[k + 1] - axis.s[k]);
  }
  const Eigen::VectorXd twist_slope = axis.slopes * rate;

  const std::vector<Vec3> shear =
      given ? interval_shear(axis, p, slope, [&](size_t k) { return Mat3(turn[k] * rotation_matrix(0.5 * relative[k])); })
            : std::vector<Vec3>(n - 1, Vec3::Zero());

  // Stations: Hermite point and slope; the interpolated frame turned shortest onto the slope less the shear, and about it by the twist's
  // smooth part.
  const size_t count = axis.station.size();
  Points out(source_count(axis), 3);
  std::vector<Vec3> turned2(count), turned3(count);
  const Vec3 e2 = axis.frame.col(1), e3 = axis.frame.col(2);
  for (size_t j = 0; j < count; ++j) {
    const auto k = std::min(static_cast<Eigen::Index>(j) / axis.subdivisions, n - 2);
    const double length = axis.s[k + 1] - axis.s[k], x = (axis.station[j] - axis.s[k]) / length;
    const Hermite h = hermite(x, length);
    const AxisPoint at = axis_point(axis, p, slope, shear, k, x);
    Mat3 frame = turn[k] * rotation_matrix(x * relative[k]);
    const double speed = at.normal.norm();
    if (speed > 0.0) {
      const Vec3 along = at.normal / speed;
      frame = shortest_rotation(frame * t, along) * frame;
      const double smooth = h.v1 * twist[k] + h.g0 * twist_slope[k] + h.g1 * twist_slope[k + 1];
      frame = rotation_matrix((smooth - x * twist[k]) * along) * frame;
    }
    // Back to the frame of the mesh, as displacements.
    const Mat3 whole = rigid.rotation * frame;
    const Vec3 rest = axis.origin + axis.station[j] * t;
    out.row(static_cast<Eigen::Index>(6 * j)) =
        (rigid.rotation * (at.place - rigid.centre) + rigid.centre + rigid.translation - rest).transpose();
    out.row(static_cast<Eigen::Index>(6 * j + 1)) = (rigid.rotation * at.tangent - t).transpose();
    turned2[j] = whole * e2 - e2;
    turned3[j] = whole * e3 - e3;
  }
  set_directions(axis, turned2, turned3, out);
  return out;
}

Points lift_linear(const AxisLift& axis, const Points& displacement, const Points& rotation) {
  const auto n = static_cast<Eigen::Index>(axis.s.size());
  const Vec3 t = axis.frame.col(0);
  const bool given = axis.given && rotation.rows() > 0;
  Points u(n, 3), theta = Points::Zero(n, 3), slope(n, 3);
  for (Eigen::Index k = 0; k < n; ++k) {
    u.row(k) = displacement.row(axis.order[k]);
    if (given) theta.row(k) = rotation.row(axis.order[k]);
  }
  auto arm = [&](Eigen::Index k) { return Vec3(theta.row(k).transpose()).cross(Vec3(axis.offset.row(k).transpose())); };
  auto length = [&](Eigen::Index k) { return axis.s[k + 1] - axis.s[k]; };
  Points chord(n - 1, 3);
  Points p = u;
  auto spline = [&] {
    for (Eigen::Index k = 0; k + 1 < n; ++k) chord.row(k) = (p.row(k + 1) - p.row(k)) / length(k);
    slope = axis.slopes * chord;
  };
  if (given) {
    for (Eigen::Index k = 0; k < n; ++k) p.row(k) -= arm(k).transpose();
    spline();
    // Across the axis the slope is the rotation's, along it that of the spline of the axial displacement.
    for (Eigen::Index k = 0; k < n; ++k)
      slope.row(k) = (t * t.dot(slope.row(k).transpose()) + Vec3(theta.row(k).transpose()).cross(t)).transpose();
  } else {
    // Nodes beside the axis: their arms turn with the spline; a few passes settle it, rigid motion is exact at their limit.
    const bool straight = axis.offset.cwiseAbs().maxCoeff() <= 1e-14 * (axis.s.back() - axis.s.front());
    for (int pass = 0; pass < (straight ? 1 : 40); ++pass) {
      spline();
      for (Eigen::Index k = 0; k < n; ++k) theta.row(k) = t.cross(Vec3(slope.row(k).transpose())).transpose();
      if (straight) break;
      for (Eigen::Index k = 0; k < n; ++k) p.row(k) = u.row(k) - arm(k).transpose();
    }
    if (!straight) spline();
  }
  Eigen::VectorXd twist = theta * t, rate(n - 1);
  if (!given) twist.setZero();
  for (Eigen::Index k = 0; k + 1 < n; ++k) rate[k] = (twist[k + 1] - twist[k]) / length(k);
  const Eigen::VectorXd twist_slope = axis.slopes * rate;
  const std::vector<Vec3> shear =
      given ? interval_shear(axis, p, slope, [](size_t) { return Mat3(Mat3::Identity()); }) : std::vector<Vec3>(n - 1, Vec3::Zero());

  const size_t count = axis.station.size();
  Points out(source_count(axis), 3);
  std::vector<Vec3> turned2(count), turned3(count);
  for (size_t j = 0; j < count; ++j) {
    const auto k = std::min(static_cast<Eigen::Index>(j) / axis.subdivisions, n - 2);
    const double x = (axis.station[j] - axis.s[k]) / length(k);
    const Hermite h = hermite(x, length(k));
    const AxisPoint at = axis_point(axis, p, slope, shear, k, x);
    const double about = h.v0 * twist[k] + h.v1 * twist[k + 1] + h.g0 * twist_slope[k] + h.g1 * twist_slope[k + 1];
    const Vec3 turn = t.cross(at.normal) + about * t;
    out.row(static_cast<Eigen::Index>(6 * j)) = at.place.transpose();
    out.row(static_cast<Eigen::Index>(6 * j + 1)) = at.tangent.transpose();
    turned2[j] = turn.cross(Vec3(axis.frame.col(1)));
    turned3[j] = turn.cross(Vec3(axis.frame.col(2)));
  }
  set_directions(axis, turned2, turned3, out);
  return out;
}

SparseWeights axis_weights(const AxisLift& axis, const Points& vertices, bool precise) {
  SparseWeights w;
  w.rows = static_cast<int>(vertices.rows());
  w.cols = source_count(axis);
  auto add = [&](size_t column, double value) {
    if (value == 0.0) return;
    w.column.push_back(static_cast<int>(column));
    w.single.push_back(static_cast<float>(value));
    if (precise) w.precise.push_back(value);
  };
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) {
    const Vec3 local = axis.frame.transpose() * (vertices.row(v).transpose() - axis.origin);
    const double s = local[0];
    if (s <= axis.station.front() || s >= axis.station.back()) {
      // Beyond an end: straight on, with the end's section.
      const bool low = s <= axis.station.front();
      const size_t base = low ? 0 : 6 * (axis.station.size() - 1);
      add(base, 1.0);
      add(base + 1, s - (low ? axis.station.front() : axis.station.back()));
      add(base + 2, local[1]);
      add(base + 4, local[2]);
    } else {
      const auto right = std::upper_bound(axis.station.begin(), axis.station.end(), s);
      const size_t j = right - axis.station.begin() - 1;
      const double length = axis.station[j + 1] - axis.station[j];
      const Hermite h = hermite((s - axis.station[j]) / length, length);
      for (size_t part = 0; part < 3; ++part) {
        const double d = part == 0 ? 1.0 : local[static_cast<Eigen::Index>(part)];
        add(6 * j + 2 * part, d * h.v0);
        add(6 * j + 2 * part + 1, d * h.g0);
        add(6 * j + 6 + 2 * part, d * h.v1);
        add(6 * j + 6 + 2 * part + 1, d * h.g1);
      }
    }
    w.begin.push_back(static_cast<std::int64_t>(w.column.size()));
  }
  return w;
}

double axis_lebesgue(const AxisLift& axis, double lower, double upper) {
  if (axis.given) return 1.0;  // Hermite values are positive and sum to one
  const auto n = static_cast<Eigen::Index>(axis.s.size());
  // Node weights of a slope row: mean slopes written out in node values.
  std::vector<double> sum(n, 0.0);
  std::vector<Eigen::Index> touched;
  auto add = [&](Eigen::Index i, double value) {
    if (sum[i] == 0.0) touched.push_back(i);
    sum[i] += value;
  };
  auto add_slope = [&](Eigen::Index i, double factor) {
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(axis.slopes, i); it; ++it) {
      const double value = factor * it.value() / (axis.s[it.col() + 1] - axis.s[it.col()]);
      add(it.col() + 1, value);
      add(it.col(), -value);
    }
  };
  double worst = 0.0;
  auto finish = [&] {
    double total = 0.0;
    for (const Eigen::Index i : touched) {
      total += std::abs(sum[i]);
      sum[i] = 0.0;
    }
    touched.clear();
    worst = std::max(worst, total);
  };
  for (Eigen::Index k = 0; k + 1 < n; ++k)
    for (int j = 0; j <= axis.subdivisions; ++j) {
      const double length = axis.s[k + 1] - axis.s[k];
      const Hermite h = hermite(static_cast<double>(j) / axis.subdivisions, length);
      add(k, h.v0);
      add(k + 1, h.v1);
      add_slope(k, h.g0);
      add_slope(k + 1, h.g1);
      finish();
    }
  // Straight on beyond the ends.
  if (lower < axis.s.front()) {
    add(0, 1.0);
    add_slope(0, lower - axis.s.front());
    finish();
  }
  if (upper > axis.s.back()) {
    add(n - 1, 1.0);
    add_slope(n - 1, upper - axis.s.back());
    finish();
  }
  return worst;
}

}  // namespace flexframe::interp
