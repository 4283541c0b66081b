#include "interp/curve.h"

#include "interp/dense_solvers.h"
#include "interp/lift.h"
#include "interp/rotation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace flexframe::interp {
namespace {

constexpr int steps = 8;         // stations an interval between nodes
constexpr int fine = 2 * steps;  // points of the grid an interval: Simpson's rule from station to station

// Frames that move along the line with the least twist; those of a closed line meet at its end.
void set_frames(Chain& chain) {
  const Eigen::Index count = chain.centre.rows();
  chain.frame.resize(count);
  auto along = [&](Eigen::Index g) { return Vec3(chain.tangent.row(g).transpose().normalized()); };
  Mat3& first = chain.frame[0];
  first.col(0) = along(0);
  Eigen::Index least = 0;
  first.col(0).cwiseAbs().minCoeff(&least);
  first.col(1) = first.col(0).cross(Vec3(Vec3::Unit(least))).normalized();
  first.col(2) = first.col(0).cross(Vec3(first.col(1)));
  for (Eigen::Index g = 0; g + 1 < count; ++g) {
    // Reflected in the plane between the points, then in the one that brings the tangent over.
    const Vec3 v = (chain.centre.row(g + 1) - chain.centre.row(g)).transpose();
    auto reflect = [](const Vec3& a, const Vec3& n) { return n.squaredNorm() > 0.0 ? Vec3(a - 2.0 / n.squaredNorm() * n.dot(a) * n) : a; };
    const Vec3 t = reflect(chain.frame[g].col(0), v), e = reflect(chain.frame[g].col(1), v);
    Mat3& next = chain.frame[g + 1];
    next.col(0) = along(g + 1);
    next.col(1) = reflect(e, next.col(0) - t);
    next.col(1) = (next.col(1) - next.col(0) * next.col(0).dot(next.col(1))).normalized();
    next.col(2) = next.col(0).cross(Vec3(next.col(1)));
  }
  if (!chain.closed) return;
  const Mat3 gap = first.transpose() * chain.frame.back();
  const double twist = std::atan2(gap(2, 1), gap(1, 1));
  for (Eigen::Index g = 0; g < count; ++g)
    chain.frame[g] = chain.frame[g] * rotation_matrix(Vec3(-twist * chain.s[g] / chain.s.back(), 0.0, 0.0));
}

Chain make_chain(const Points& nodes, const NodeRow& row) {
  Chain chain;
  chain.closed = row.closed;
  chain.node = row.node;
  const auto count = static_cast<Eigen::Index>(chain.node.size());
  Points p(count, 3);
  for (Eigen::Index k = 0; k < count; ++k) p.row(k) = nodes.row(chain.node[k]);
  if (count == 1) {
    chain.stations = 1;
    chain.s = {0.0};
    chain.centre = p;
    return chain;
  }
  std::vector<double> at{0.0};
  const Eigen::Index intervals = chain.closed ? count : count - 1;
  for (Eigen::Index k = 0; k < intervals; ++k) {
    chain.span.push_back((p.row((k + 1) % count) - p.row(k)).norm());
    for (int j = 0; j < fine; ++j) chain.s.push_back(at.back() + chain.span.back() * j / fine);
    at.push_back(at.back() + chain.span.back());
  }
  chain.s.push_back(at.back());
  at.resize(count);
  chain.rows = spline_rows(at, chain.s, chain.closed ? chain.s.back() : 0.0);
  chain.centre = chain.rows.value * p;
  chain.tangent = chain.rows.slope * p;
  chain.stations = static_cast<int>(intervals) * steps + (chain.closed ? 0 : 1);
  set_frames(chain);
  return chain;
}

// Motion of a chain's nodes less a rigid one, and that rigid one: x -> turn (x - centre) + centre + shift beyond x.
struct Reduced {
  bool exact = false;
  Vec3 centre = Vec3::Zero(), shift = Vec3::Zero();
  Mat3 turn = Mat3::Zero();  // R - I, or the skew matrix of the linearised rotation
  Points u, theta;           // of the chain's nodes
};

Reduced take_rigid(const Points& positions, const Points& u, const Points& theta, bool exact) {
  Reduced r;
  r.exact = exact;
  const Eigen::Index n = u.rows();
  r.u.resize(n, 3);
  r.theta.resize(theta.rows(), 3);
  if (exact) {
    const RigidMotion rigid = best_rigid_motion(positions, u, theta);
    r.centre = rigid.centre;
    r.shift = rigid.translation;
    r.turn = rigid.rotation - Mat3::Identity();
    Vec3 before = Vec3::Zero();
    for (Eigen::Index k = 0; k < n; ++k) {
      const Vec3 moved = (positions.row(k) + u.row(k)).transpose();
      r.u.row(k) = (rigid.rotation.transpose() * (moved - rigid.centre - rigid.translation) + rigid.centre).transpose() - positions.row(k);
      if (theta.rows() == 0) continue;
      Vec3 v = rotation_vector(rigid.rotation.transpose() * rotation_matrix(theta.row(k).transpose()));
      // Of the vectors of one rotation the one nearest to that of the node before: turns beyond half a round.
      if (k > 0 && v.norm() > 1e-9) {
        const Vec3 axis = v.normalized();
        v += axis * (2.0 * std::numbers::pi * std::round((before - v).dot(axis) / (2.0 * std::numbers::pi)));
      }
      r.theta.row(k) = v.transpose();
      before = v;
    }
    return r;
  }
  r.centre = positions.colwise().mean().transpose();
  r.shift = u.colwise().mean().transpose();
  Mat3 inertia = Mat3::Zero();
  Vec3 moment = Vec3::Zero();
  const double arm2 = (positions.rowwise() - r.centre.transpose()).squaredNorm() / (3.0 * static_cast<double>(n));
  for (Eigen::Index k = 0; k < n; ++k) {
    const Vec3 x = positions.row(k).transpose() - r.centre;
    inertia += x.squaredNorm() * Mat3::Identity() - x * x.transpose();
    moment += x.cross(Vec3(u.row(k).transpose()) - r.shift);
    if (theta.rows() == 0) continue;
    inertia += arm2 * Mat3::Identity();
    moment += arm2 * theta.row(k).transpose();
  }
  const Vec3 omega = least_squares(inertia, moment);
  r.turn = skew(omega);
  for (Eigen::Index k = 0; k < n; ++k) {
    r.u.row(k) = u.row(k) - r.shift.transpose() - omega.cross(Vec3(positions.row(k).transpose() - r.centre)).transpose();
    if (theta.rows() > 0) r.theta.row(k) = theta.row(k) - omega.transpose();
  }
  return r;
}

// Turn W of a rotation vector: R - I, or its linearisation; and a turn followed by another one.
Mat3 turn_of(const Vec3& v, bool exact) { return exact ? Mat3(rotation_matrix(v) - Mat3::Identity()) : skew(v); }
Mat3 turn_on(const Mat3& w, const Vec3& v, bool exact) {
  return exact ? Mat3(rotation_matrix(v) * (Mat3::Identity() + w) - Mat3::Identity()) : Mat3(w + skew(v));
}

// One interval between nodes: its first point on the grid, the node at either end, its length.
struct Interval {
  Eigen::Index first;
  int from, to;
  double length;
};

// A chain as it moves: turns and displacements of the points of its grid.
struct Moved {
  const Chain& chain;
  const Reduced& motion;
  std::vector<Mat3> turn;
  Points u;

  Interval interval(size_t k) const {
    return {static_cast<Eigen::Index>(k) * fine, static_cast<int>(k), static_cast<int>((k + 1) % chain.node.size()), chain.span[k]};
  }
  // Integral of a rate over the j-th double step of an interval, by Simpson's rule.
  template <typename Rate>
  Vec3 over(const Interval& i, Eigen::Index j, const Rate& rate) const {
    const Eigen::Index g = i.first + 2 * j;
    return i.length / (6.0 * steps) * (rate(g) + 4.0 * rate(g + 1) + rate(g + 2));
  }
  Vec3 line_rate(Eigen::Index g) const { return turn[g] * chain.tangent.row(g).transpose(); }
  // What the line's integral leaves open at the end of an interval.
  Vec3 defect(const Interval& i) const {
    Vec3 d = (motion.u.row(i.to) - motion.u.row(i.from)).transpose();
    for (int j = 0; j < steps; ++j) d -= over(i, j, [&](Eigen::Index g) { return line_rate(g); });
    return d;
  }
  void turn_sections();
  void close_by_bending();
  void integrate();
};

// Rotations of the nodes by the spline, in frames that move along the line.
void Moved::turn_sections() {
  const auto n = static_cast<Eigen::Index>(chain.node.size());
  Points local(n, 3);
  for (Eigen::Index k = 0; k < n; ++k) local.row(k) = motion.theta.row(k) * chain.frame[k * fine];
  const Points between = chain.rows.value * local;
  for (Eigen::Index g = 0; g < between.rows(); ++g) turn[g] = turn_of(chain.frame[g] * between.row(g).transpose(), motion.exact);
}

// Across the line by rotations that vanish at both ends, as an unloaded beam bends; twice, as the line itself is curved.
void Moved::close_by_bending() {
  for (size_t k = 0; k < chain.span.size(); ++k) {
    const Interval i = interval(k);
    for (int pass = 0; pass < 2; ++pass) {
      const Eigen::Index middle = i.first + fine / 2;
      Vec3 t = chain.tangent.row(middle).transpose().normalized();
      if (motion.exact) t += turn[middle] * t;
      const Vec3 bend = 6.0 / i.length * t.cross(defect(i));
      for (int g = 0; g <= fine; ++g) {
        const double x = static_cast<double>(g) / fine;
        turn[i.first + g] = turn_on(turn[i.first + g], x * (1.0 - x) * bend, motion.exact);
      }
    }
  }
}

// Displacement of the line: what the turns make of it, a stretch that varies smoothly from node to node, and what little is then left.
void Moved::integrate() {
  const auto n = static_cast<Eigen::Index>(chain.node.size());
  auto frame_at = [&](Eigen::Index g) -> Mat3 {
    return motion.exact ? Mat3((Mat3::Identity() + turn[g]) * chain.frame[g]) : chain.frame[g];
  };
  Points sum = Points::Zero(n + 1, 3);
  for (size_t k = 0; k < chain.span.size(); ++k) {
    const Interval i = interval(k);
    const auto row = static_cast<Eigen::Index>(k);
    sum.row(row + 1) = sum.row(row) + (frame_at(i.first + fine / 2).transpose() * defect(i)).transpose();
  }
  // Of a closed line the sum over a round is an even stretch.
  Eigen::RowVector3d even = Eigen::RowVector3d::Zero();
  if (chain.closed) {
    even = sum.row(n) / chain.s.back();
    for (Eigen::Index k = 0; k < n; ++k) sum.row(k) -= even * chain.s[k * fine];
  }
  const Points stretch = (chain.rows.slope * sum.topRows(n)).rowwise() + even;
  auto rate = [&](Eigen::Index g) -> Vec3 { return line_rate(g) + frame_at(g) * stretch.row(g).transpose(); };
  for (size_t k = 0; k < chain.span.size(); ++k) {
    const Interval i = interval(k);
    Vec3 at = motion.u.row(i.from).transpose();
    u.row(i.first) = at.transpose();
    for (Eigen::Index j = 0; j < steps; ++j) u.row(i.first + 2 * j + 2) = (at += over(i, j, rate)).transpose();
    const Vec3 rest = motion.u.row(i.to).transpose() - at;
    for (Eigen::Index j = 1; j <= steps; ++j) u.row(i.first + 2 * j) += (static_cast<double>(j) / steps * rest).transpose();
  }
}

// Rotations of the nodes from the slopes of the line, without twist.
void estimate_rotations(const Chain& chain, Reduced& motion) {
  const auto n = static_cast<Eigen::Index>(chain.node.size());
  const Points slope = chain.rows.slope * motion.u;
  motion.theta.resize(n, 3);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Vec3 t = chain.tangent.row(k * fine).transpose(), d = slope.row(k * fine).transpose();
    Vec3 turn = t.cross(d) / t.squaredNorm();
    if (motion.exact && (t + d).norm() > 0.0) turn = rotation_vector(shortest_rotation(t.normalized(), (t + d).normalized()));
    motion.theta.row(k) = turn.transpose();
  }
}

void lift_chain(const CurveLift& curves, const Chain& chain, const Points& displacement, const Points& rotation, bool exact, Points& out) {
  const auto n = static_cast<Eigen::Index>(chain.node.size());
  const bool given = curves.given && rotation.rows() > 0;
  Points p(n, 3), u(n, 3), theta(given ? n : 0, 3);
  for (Eigen::Index k = 0; k < n; ++k) {
    p.row(k) = curves.positions.row(chain.node[k]);
    u.row(k) = displacement.row(chain.node[k]);
    if (given) theta.row(k) = rotation.row(chain.node[k]);
  }
  auto put = [&](int station, const Vec3& shift, const Mat3& turn) {
    const Eigen::Index row = chain.first_source + 4 * static_cast<Eigen::Index>(station);
    out.row(row) = shift.transpose();
    out.middleRows(row + 1, 3) = turn.transpose();
  };
  if (n == 1) {
    put(0, u.row(0).transpose(), given ? turn_of(theta.row(0).transpose(), exact) : Mat3(Mat3::Zero()));
    return;
  }
  Reduced motion = take_rigid(p, u, theta, exact);
  if (!given) estimate_rotations(chain, motion);
  Moved moved{chain, motion, std::vector<Mat3>(chain.s.size()), Points::Zero(chain.centre.rows(), 3)};
  moved.turn_sections();
  moved.close_by_bending();
  moved.integrate();
  const Mat3 whole = Mat3::Identity() + motion.turn;
  for (int j = 0; j < chain.stations; ++j) {
    const Eigen::Index g = 2 * static_cast<Eigen::Index>(j);
    const Vec3 x = chain.centre.row(g).transpose(), own = moved.u.row(g).transpose();
    const Vec3 rigid = motion.shift + motion.turn * (x - motion.centre);
    if (exact) put(j, rigid + whole * own, motion.turn + whole * moved.turn[g]);
    else put(j, rigid + own, motion.turn + moved.turn[g]);
  }
}

Points lift_curves(const CurveLift& curves, const Points& displacement, const Points& rotation, bool exact) {
  Points out = Points::Zero(source_count(curves), 3);
  for (const Chain& chain : curves.chains) lift_chain(curves, chain, displacement, rotation, exact, out);
  return out;
}

}  // namespace

CurveLift make_curves(const Points& nodes, const std::vector<NodeRow>& rows, bool rotations_given) {
  CurveLift curves;
  curves.positions = nodes;
  curves.given = rotations_given;
  int sources = 0;
  for (const NodeRow& row : rows) {
    Chain& chain = curves.chains.emplace_back(make_chain(nodes, row));
    chain.first_source = sources;
    sources += 4 * chain.stations;
  }
  return curves;
}

int source_count(const CurveLift& curves) {
  return curves.chains.empty() ? 0 : curves.chains.back().first_source + 4 * curves.chains.back().stations;
}

Points lift_exact(const CurveLift& curves, const Points& displacement, const Points& rotation) {
  return lift_curves(curves, displacement, rotation, true);
}
Points lift_linear(const CurveLift& curves, const Points& displacement, const Points& rotation) {
  return lift_curves(curves, displacement, rotation, false);
}

Foot find_foot(const CurveLift& curves, int chain_index, int first, int last, const Vec3& x) {
  const Chain& chain = curves.chains[chain_index];
  Foot foot{chain_index, 0, 0.0, (chain.centre.row(0).transpose() - x).norm()};
  if (chain.node.size() == 1) return foot;
  const int wrap = chain.closed ? chain.stations : std::numeric_limits<int>::max();
  const auto at = [&](int j) { return 2 * static_cast<Eigen::Index>(j % wrap); };
  double best2 = std::numeric_limits<double>::infinity();
  int nearest = first * steps;
  for (int j = first * steps; j <= last * steps; ++j)
    if (const double d2 = (chain.centre.row(at(j)).transpose() - x).squaredNorm(); d2 < best2) best2 = d2, nearest = j;
  // Where the vertex lies in the plane across the line, between the nearest station and the next on its side.
  const auto ahead = [&](int j) {
    return (x - chain.centre.row(at(j)).transpose()).dot(chain.tangent.row(at(j)).transpose()) / chain.tangent.row(at(j)).norm();
  };
  const double here = ahead(nearest);
  int from = here >= 0.0 ? nearest : nearest - 1;
  const bool over_end = !chain.closed && (from < 0 || from + 1 >= chain.stations);
  if (over_end) from = std::clamp(from, 0, chain.stations - 2);
  foot.share = over_end ? (here >= 0.0 ? 1.0 : 0.0) : 0.0;
  if (from < 0) from += chain.stations;
  if (!over_end) {
    const double a = ahead(from), b = ahead(from + 1);
    foot.share = a - b > 0.0 ? std::clamp(a / (a - b), 0.0, 1.0) : 0.0;
  }
  foot.station = chain.closed ? from % chain.stations : from;
  const Eigen::RowVector3d c = (1.0 - foot.share) * chain.centre.row(at(from)) + foot.share * chain.centre.row(at(from + 1));
  foot.distance = (c.transpose() - x).norm();
  return foot;
}

void add_foot(const CurveLift& curves, const Foot& foot, double share, const Vec3& x, std::vector<std::pair<int, double>>& out) {
  const Chain& chain = curves.chains[foot.chain];
  const auto add_rigid = [&](int source, double weight, const Vec3& arm) {
    out.emplace_back(source, weight);
    for (int c = 0; c < 3; ++c) out.emplace_back(source + 1 + c, arm[c]);
  };
  const auto centre = [&](int j) { return Vec3(chain.centre.row(2 * static_cast<Eigen::Index>(j)).transpose()); };
  if (chain.node.size() == 1) return add_rigid(chain.first_source, share, share * (x - centre(0)));
  const auto station = [&](int j) { return chain.closed ? (j + chain.stations) % chain.stations : std::clamp(j, 0, chain.stations - 1); };
  const int here = foot.station, next = station(here + 1);
  // The line's point by Hermite's cubic of two rigid motions: v0 and v1 of what they make of it, and 2 X^2 (1 - X)^2 times what the
  // difference of their turns makes of the step between them.
  const double a = foot.share, b = 1.0 - a, v0 = b * b * (1.0 + 2.0 * a), v1 = a * a * (3.0 - 2.0 * a);
  const Vec3 step = centre(next) - centre(here), beside = x - centre(here) - a * step, bent = 2.0 * a * a * b * b * step;
  add_rigid(chain.first_source + 4 * here, share * v0, share * (v0 * a * step - bent));
  add_rigid(chain.first_source + 4 * next, share * v1, share * (bent - v1 * b * step));
  // What lies beside it turns by Hermite's cubic of the turns, their slopes by differences.
  const auto turn = [&](int j, double weight) {
    for (int c = 0; c < 3; ++c) out.emplace_back(chain.first_source + 4 * station(j) + 1 + c, share * weight * beside[c]);
  };
  const double g0 = a * b * b, g1 = -a * a * b;
  turn(here, v0);
  turn(next, v1);
  const auto slope = [&](int j, double g) {
    if (chain.closed || (j > 0 && j + 1 < chain.stations)) {
      turn(j + 1, 0.5 * g);
      turn(j - 1, -0.5 * g);
    } else {
      const int inward = j == 0 ? 1 : -1;
      turn(j, -1.5 * inward * g);
      turn(j + inward, 2.0 * inward * g);
      turn(j + 2 * inward, -0.5 * inward * g);
    }
  };
  slope(here, g0);
  slope(here + 1, g1);
}

double curve_lebesgue(const CurveLift& curves) {
  double worst = 1.0;
  for (const Chain& chain : curves.chains) worst = std::max(worst, chain.rows.lebesgue);
  return worst;
}

}  // namespace flexframe::interp
