#include "sim/bodies/normal_modes.h"

#include "sim/base/eigen_solvers.h"
#include "sim/base/spatial.h"
#include "sim/bodies/axis_mass.h"
#include "sim/scene/effect_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

namespace flexframe::sim {

namespace {

// Of what holds a body, scaled by mass: entries are of the order of one over the root of a mass.
constexpr double rank_threshold = 1e-9;

// Coordinates in which mass is 1 and stiffness diagonal: old ones = T new ones.
FlexibleBody in_basis(const FlexibleBody& body, const MatX& T) {
  const auto congruent = [&](const MatX& A) { return A.size() == 0 ? MatX() : MatX(T.transpose() * A * T); };
  FlexibleBody out = body;
  out.n = static_cast<int>(T.cols());
  out.md1 = body.md1 * T;
  out.J1 = body.J1 * T;
  out.Cr0 = body.Cr0 * T;
  for (size_t a = 0; a < 3; ++a) {
    out.md2[a] = congruent(body.md2[a]);
    out.Cr1[a] = congruent(body.Cr1[a]);
  }
  for (size_t a = 0; a < 6; ++a) out.J2[a] = congruent(body.J2[a]);
  out.stiffness = (T.transpose() * body.Ke * T).diagonal();
  out.Me = MatX::Identity(out.n, out.n);
  out.Ke = out.stiffness.asDiagonal();
  out.De = congruent(body.De);
  if (body.ksigma.size() > 0) out.ksigma = T.transpose() * body.ksigma;
  out.axis = in_coordinates(body.axis, T);
  // All nodes in one product: three rows at a time take several times as long.
  const auto nodes = static_cast<Eigen::Index>(out.nodes.size());
  MatX motions(6 * nodes, body.n);
  for (Eigen::Index i = 0; i < nodes; ++i) {
    motions.middleRows(6 * i, 3) = body.nodes[static_cast<size_t>(i)].phi;
    motions.middleRows(6 * i + 3, 3) = body.nodes[static_cast<size_t>(i)].psi;
  }
  motions = MatX(motions * T);
  for (Eigen::Index i = 0; i < nodes; ++i) {
    FlexibleNode& node = out.nodes[static_cast<size_t>(i)];
    node.phi = motions.middleRows(6 * i, 3);
    node.psi = motions.middleRows(6 * i + 3, 3);
    if (node.sigma.size() > 0) node.sigma = MatX(node.sigma * T);
    for (MatX& h : node.phi2) h = congruent(h);
  }
  return out;
}

// Coordinates in groups that neither mass nor stiffness couples, to rounding: the directions of a beam whose section is symmetric.
std::vector<std::vector<int>> uncoupled_groups(const MatX& K, const MatX& M) {
  constexpr double rounding = 1e-13;
  const int n = static_cast<int>(K.rows());
  const auto coupled = [&](const MatX& A, int i, int j) { return std::abs(A(i, j)) > rounding * std::sqrt(std::abs(A(i, i) * A(j, j))); };
  std::vector<int> group(n, -1);
  std::vector<std::vector<int>> out;
  for (int first = 0; first < n; ++first) {
    if (group[first] >= 0) continue;
    const int here = static_cast<int>(out.size());
    std::vector<int> members{first};
    group[first] = here;
    for (size_t at = 0; at < members.size(); ++at)
      for (int j = 0; j < n; ++j)
        if (group[j] < 0 && (coupled(K, members[at], j) || coupled(M, members[at], j))) group[j] = here, members.push_back(j);
    std::sort(members.begin(), members.end());
    out.push_back(std::move(members));
  }
  return out;
}

std::vector<std::vector<int>> all_together(Eigen::Index n) {
  std::vector<int> all(static_cast<size_t>(n));
  std::iota(all.begin(), all.end(), 0);
  return {all};
}

// Modes of the pencil, mass 1, stiffness upwards.
void solve_modes(const MatX& K, const MatX& M, bool by_direction, VecX& stiffness, MatX& V) {
  const Eigen::Index n = K.rows();
  VecX values(n);
  MatX vectors = MatX::Zero(n, n);
  Eigen::Index at = 0;
  for (const std::vector<int>& group : by_direction ? uncoupled_groups(K, M) : all_together(n)) {
    const GeneralizedEigen eigen(MatX(K(group, group)), MatX(M(group, group)));
    if (eigen.info() != Eigen::Success)
      throw SimulationError("the eigenmodes of an elastic body cannot be computed: its mass matrix is not positive definite");
    const Eigen::Index count = static_cast<Eigen::Index>(group.size());
    values.segment(at, count) = eigen.eigenvalues();
    for (Eigen::Index i = 0; i < count; ++i) vectors.row(group[static_cast<size_t>(i)]).segment(at, count) = eigen.eigenvectors().row(i);
    at += count;
  }
  std::vector<Eigen::Index> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) { return values[a] < values[b]; });
  stiffness = values(order);
  V = vectors(Eigen::all, order);
}

}  // namespace

FlexibleBody to_normal_modes(const FlexibleBody& body, MatX& V, bool by_direction) {
  VecX stiffness;
  solve_modes(body.Ke, body.Me, by_direction, stiffness, V);
  // A sign that does not depend on the eigensolver: the largest entry positive.
  for (Eigen::Index k = 0; k < V.cols(); ++k) {
    Eigen::Index at = 0;
    V.col(k).cwiseAbs().maxCoeff(&at);
    if (V(at, k) < 0.0) V.col(k) = -V.col(k);
  }
  FlexibleBody out = in_basis(body, V);
  out.Ke = stiffness.asDiagonal();
  out.stiffness = stiffness;
  out.labels.clear();
  for (Eigen::Index k = 0; k < body.n; ++k)
    out.labels.push_back(fmt::format("eigenmode {} ({:.6g} Hz)", k + 1, std::sqrt(std::max(0.0, stiffness[k])) / (2.0 * EIGEN_PI)));
  return out;
}

namespace {

// The coordinates of a body that move it in one direction, with the rigid motions of that direction before them: where the body is held,
// both must work together. Mean axes: neither acts on the other by inertia.
struct Direction {
  std::vector<int> coordinates;
  int slide = -1, turn = -1;  // axes of the rigid translation and rotation, -1: none
  VecX mass, stiffness;       // of the rigid motions and the coordinates
  int rigid() const { return (slide >= 0) + (turn >= 0); }
};

Direction one_direction(const FlexibleBody& body, const Vec3& centre, int which) {
  Direction d;
  for (int k = 0; k < body.n; ++k)
    if (coordinate_direction(body, k) == which) d.coordinates.push_back(k);
  d.slide = which == 3 ? -1 : which;
  d.turn = which == 0 ? -1 : which == 1 ? 2 : which == 2 ? 1 : 0;
  const Eigen::Index n = d.rigid() + static_cast<Eigen::Index>(d.coordinates.size());
  d.mass = VecX::Ones(n);
  d.stiffness = VecX::Zero(n);
  Eigen::Index at = 0;
  if (d.slide >= 0) d.mass[at++] = body.mass;
  if (d.turn >= 0) d.mass[at++] = body.J0[d.turn] - body.mass * (centre.squaredNorm() - centre[d.turn] * centre[d.turn]);
  for (const int k : d.coordinates) d.stiffness[at++] = body.stiffness[k];
  return d;
}

// How a node moves in that direction: its translation along the direction, or its rotation about it.
Eigen::RowVectorXd motion_of(const FlexibleNode& node, const Vec3& centre, const Direction& d, bool rotation) {
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(d.mass.size());
  Eigen::Index at = 0;
  if (d.slide >= 0) row[at++] = rotation ? 0.0 : 1.0;
  if (d.turn >= 0) row[at++] = rotation ? 1.0 : d.slide < 0 ? 0.0 : Vec3(Vec3::Unit(d.turn)).cross(Vec3(node.origin - centre))[d.slide];
  for (const int k : d.coordinates) row[at++] = rotation ? node.psi(d.turn, k) : node.phi(d.slide, k);
  return row;
}

void append(MatX& columns, const VecX& column) {
  columns.conservativeResize(column.size(), columns.cols() + 1);
  columns.col(columns.cols() - 1) = column;
}

// Shapes of one direction, columns over its coordinates: the lowest modes as the joints hold the body, what joints and loads deform beside
// them.
MatX held_shapes(const FlexibleBody& body, const Vec3& centre, const Direction& d, int count, const std::vector<HeldPoint>& held) {
  const Eigen::Index r = d.rigid(), n = static_cast<Eigen::Index>(d.coordinates.size());
  MatX held_by(r + n, 0), loads(r + n, 0);
  // Rotations are measured in metres at the body's size, beside translations: what is dependent is judged by both.
  double size = 0.0;
  for (const FlexibleNode& node : body.nodes) size = std::max(size, (node.origin - centre).norm());
  for (const HeldPoint& h : held) {
    // On mean axes what acts on every part by its mass works on the slide alone; what holds the body bends it.
    if (h.node.empty() && h.load && h.force && d.slide >= 0) append(loads, body.mass * VecX::Unit(r + n, 0));
    for (const FlexibleNode& node : body.nodes) {
      if (node.name != h.node) continue;
      if (h.force && d.slide >= 0) append(h.load ? loads : held_by, motion_of(node, centre, d, false).transpose());
      if (h.moment && d.turn >= 0) append(h.load ? loads : held_by, size * motion_of(node, centre, d, true).transpose());
    }
  }

  // Motions that the joints allow, orthonormal with respect to mass, and how many of them are rigid.
  const VecX root = d.mass.cwiseSqrt().cwiseInverse();
  const MatX free = root.asDiagonal() * orthogonal_complement(MatX(root.asDiagonal() * held_by), rank_threshold);
  const Eigen::Index first = orthogonal_complement(MatX(root.head(r).asDiagonal() * held_by.topRows(r)), rank_threshold).cols();
  const SymmetricEigen eigen(MatX(free.transpose() * d.stiffness.asDiagonal() * free));
  const MatX modes = free * eigen.eigenvectors();
  const Eigen::Index end = std::min<Eigen::Index>(modes.cols(), first + count);
  MatX shapes(n, 0);
  for (Eigen::Index k = first; k < end; ++k) append(shapes, modes.col(k).tail(n));

  // What loads deform beside these, statically.
  const auto add_static = [&](const VecX& shape, double whole) {
    if (shape.norm() > 1e-12 * whole && whole > 0.0) append(shapes, shape.normalized());
  };
  for (Eigen::Index l = 0; l < loads.cols(); ++l) {
    VecX shape = VecX::Zero(n);
    double whole = 0.0;
    for (Eigen::Index k = first; k < modes.cols(); ++k) {
      const VecX part = modes.col(k).tail(n) * (modes.col(k).dot(loads.col(l)) / eigen.eigenvalues()[k]);
      whole = std::max(whole, part.norm());
      if (k >= end) shape += part;
    }
    add_static(shape, whole);
  }
  // What joints deform when they move against each other, by forces in balance.
  const MatX balanced = orthogonal_complement(MatX(held_by.topRows(r).transpose() * root.head(r).asDiagonal()), rank_threshold);
  const MatX moved = d.stiffness.tail(n).cwiseInverse().asDiagonal() * held_by.bottomRows(n) * balanced;
  for (Eigen::Index k = 0; k < moved.cols(); ++k) add_static(moved.col(k), moved.norm());
  return shapes;
}

}  // namespace

FlexibleBody keep_lowest(const FlexibleBody& body, const std::array<int, 4>& count, const std::vector<HeldPoint>& held, MatX& V) {
  const Vec3 centre = body.mass > 0.0 ? Vec3(body.md0 / body.mass) : Vec3(Vec3::Zero());
  MatX T(body.n, 0);
  std::vector<std::string> labels;
  for (int which = 0; which < 4; ++which) {
    const int wanted = count[which];
    if (wanted == 0) continue;
    const Direction d = one_direction(body, centre, which);
    if (d.coordinates.empty()) continue;
    const MatX shapes = held_shapes(body, centre, d, wanted, held);
    if (shapes.cols() == 0) continue;
    // An orthonormal basis of them (the mass matrix is 1), then its own modes.
    const MatX Q = orthonormal_columns(shapes, 1e-6);
    const SymmetricEigen own(MatX(Q.transpose() * d.stiffness.tail(Q.rows()).asDiagonal() * Q));
    const MatX combined = Q * own.eigenvectors();
    const Eigen::Index before = T.cols();
    T.conservativeResize(Eigen::NoChange, before + Q.cols());
    T.rightCols(Q.cols()).setZero();
    for (size_t i = 0; i < d.coordinates.size(); ++i) T.row(d.coordinates[i]).tail(Q.cols()) = combined.row(static_cast<Eigen::Index>(i));
    for (Eigen::Index k = 0; k < Q.cols(); ++k)
      labels.push_back(
          fmt::format("{} shape {} ({:.6g} Hz)", direction_names()[which], k + 1, std::sqrt(own.eigenvalues()[k]) / (2.0 * EIGEN_PI)));
  }
  FlexibleBody out = in_basis(body, T);
  out.labels = labels;
  V = MatX(V * T);
  return out;
}

int coordinate_direction(const FlexibleBody& body, int k) {
  double size = 0.0;
  Eigen::Vector4d moved = Eigen::Vector4d::Zero();
  for (const FlexibleNode& node : body.nodes) size = std::max(size, node.origin.norm());
  for (const FlexibleNode& node : body.nodes) {
    for (int a = 0; a < 3; ++a) moved[a] = std::max(moved[a], std::abs(node.phi(a, k)));
    // A twist moves what lies beside the axis only: it counts where nothing else does.
    moved[3] = std::max(moved[3], 1e-3 * size * std::abs(node.psi(0, k)));
  }
  Eigen::Index at = 0;
  moved.maxCoeff(&at);
  return static_cast<int>(at);
}

MatX same_deformation(const FlexibleBody& target, const FlexibleBody& source) {
  const Eigen::Index rows = 6 * static_cast<Eigen::Index>(target.nodes.size());
  double length = 0.0;
  for (const FlexibleNode& node : target.nodes) length = std::max(length, node.origin.norm());
  MatX A(rows, target.n + 6), B(rows, source.n);
  for (size_t i = 0; i < target.nodes.size(); ++i) {
    const Eigen::Index r = 6 * static_cast<Eigen::Index>(i);
    A.block(r, 0, 3, target.n) = target.nodes[i].phi;
    A.block(r + 3, 0, 3, target.n) = length * target.nodes[i].psi;
    A.block(r, target.n, 3, 3).setIdentity();
    A.block(r, target.n + 3, 3, 3) = -skew(target.nodes[i].origin) / length;
    A.block(r + 3, target.n, 3, 3).setZero();
    A.block(r + 3, target.n + 3, 3, 3).setIdentity();
    B.block(r, 0, 3, source.n) = source.nodes[i].phi;
    B.block(r + 3, 0, 3, source.n) = length * source.nodes[i].psi;
  }
  return least_squares(A, B).topRows(target.n);
}

}  // namespace flexframe::sim
