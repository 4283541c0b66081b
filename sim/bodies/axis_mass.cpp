#include "sim/bodies/axis_mass.h"

#include "sim/base/eigen_solvers.h"
#include "sim/base/four.h"
#include "sim/base/small_matrices.h"
#include "sim/base/spatial.h"
#include "sim/base/wide.h"
#include "sim/bodies/rod_axis.h"

#include <cstring>

namespace flexframe::sim {
namespace {

using Axis = AxisMass;
using Values = std::array<VecX, Axis::fields>;
using Rows = std::array<MatX, Axis::fields>;

// to += s from, n numbers.
FLEXFRAME_INLINE void add(double* __restrict to, double s, const double* __restrict from, Eigen::Index n) {
  for (Eigen::Index i = 0; i < n; ++i) to[i] += s * from[i];
}

// to = (first + s1 from1) + s2 from2 ..., n numbers, of `count` columns that lie one after the other: one pass, as what is summed up on the
// way stays in registers.
FLEXFRAME_INLINE void add_columns(double* to, const double* first, Eigen::Index count, const double* s, const double* from,
                                  Eigen::Index n) {
  Eigen::Index i = 0;
  for (; i + 4 <= n; i += 4) {
    Four sum = four(first + i).v;
    for (Eigen::Index l = 0; l < count; ++l) sum += s[l] * four(from + l * n + i).v;
    four(to + i).v = sum;
  }
  for (; i < n; ++i) {
    double sum = first[i];
    for (Eigen::Index l = 0; l < count; ++l) sum += s[l] * from[l * n + i];
    to[i] = sum;
  }
}

// to(point) += sign (a_i b_k + a_k b_i)
FLEXFRAME_INLINE void add_pair(const Values& a, const Rows& b, int i, int k, double sign, MatX& to) {
  const Eigen::Index n = to.rows();
  for (Eigen::Index p = 0; p < to.cols(); ++p) {
    double* __restrict const at = to.col(p).data();
    const double* __restrict const one = b[k].col(p).data();
    const double* __restrict const other = b[i].col(p).data();
    const double s = sign * a[i][p], t = sign * a[k][p];
    for (Eigen::Index r = 0; r < n; ++r) at[r] = (at[r] + s * one[r]) + t * other[r];
  }
}

// out(point) += running integral of f from the root; out: as many columns as f has.
FLEXFRAME_INLINE void add_integral(const Axis& mass, const MatX& f, VecX& sum, double* out) {
  const Eigen::Index k = mass.per_panel, n = f.rows();
  sum.setZero(n);
  for (Eigen::Index at = 0; at < f.cols(); at += k) {
    const double* const panel = f.col(at).data();
    for (Eigen::Index p = 0; p < k; ++p) {
      double* const to = out + (at + p) * n;
      for (Eigen::Index i = 0; i < n; ++i) to[i] += sum[i];
      add_columns(to, to, k, mass.once.col(p).data(), panel, n);
    }
    add_columns(sum.data(), sum.data(), k, mass.once.col(k).data(), panel, n);
  }
}

// out(point) += running integral of the running integral of f.
FLEXFRAME_INLINE void add_double_integral(const Axis& mass, const MatX& f, VecX& sum, VecX& slope, double* out) {
  const Eigen::Index k = mass.per_panel, n = f.rows();
  sum.setZero(n);
  slope.setZero(n);
  for (Eigen::Index at = 0, panel = 0; at < f.cols(); at += k, ++panel) {
    const double start = static_cast<double>(panel) * mass.panel;
    for (Eigen::Index p = 0; p < k; ++p) {
      double* const to = out + (at + p) * n;
      const double beyond = mass.x[at + p] - start;
      for (Eigen::Index i = 0; i < n; ++i) to[i] += sum[i] + beyond * slope[i];
      add_columns(to, to, k, mass.twice.col(p).data(), f.col(at).data(), n);
    }
    add(sum.data(), mass.panel, slope.data(), n);
    add_columns(sum.data(), sum.data(), k, mass.twice.col(k).data(), f.col(at).data(), n);
    add_columns(slope.data(), slope.data(), k, mass.once.col(k).data(), f.col(at).data(), n);
  }
}

// The bilinear form H(a, b) of the second-order displacement u2 = H(q, q)/2 at every particle, times root_mass: the fields of a state
// that `work` holds (a number a point) against rows `b` (a column a point); out has the rows of b and all points for x, then y, then z.
FLEXFRAME_WIDE
void second_order(const Axis& mass, const Rows& b, const Values& b_root, AxisScratch& work, MatX& out) {
  const Values &a = work.at, &a_root = work.root;
  const auto have = [&](int i, int k) { return mass.row[i].size() > 0 && mass.row[k].size() > 0; };
  const Eigen::Index points = mass.x.size();
  const Eigen::Index n = out.rows();
  out.setZero();
  MatX& f = work.integrand;
  f.resize(n, points);

  f.setZero();
  for (const bool y : {true, false}) {
    const int slope = y ? Axis::slope_y : Axis::slope_z, shear = y ? Axis::shear_y : Axis::shear_z;
    if (mass.row[slope].size() == 0) continue;
    for (Eigen::Index p = 0; p < points; ++p) add(f.col(p).data(), -a[slope][p], b[slope].col(p).data(), n);
    if (mass.row[shear].size() > 0) add_pair(a, b, slope, shear, -1.0, f);
  }
  // The fibres of a twisted section are helices.
  if (mass.row[Axis::helix].size() > 0)
    for (Eigen::Index p = 0; p < points; ++p) add(f.col(p).data(), -a[Axis::helix][p], b[Axis::helix].col(p).data(), n);
  add_integral(mass, f, work.sum, out.data());

  for (const int component : {1, 2}) {
    const bool y = component == 1;
    const int slope = y ? Axis::slope_y : Axis::slope_z, bend = y ? Axis::bend_z : Axis::bend_y, shear = y ? Axis::shear_z : Axis::shear_y;
    const double sense = y ? -1.0 : 1.0;
    double* const to = out.col(component * points).data();
    if (have(Axis::stretch, slope) || have(Axis::twist, shear)) {
      f.setZero();
      if (have(Axis::stretch, slope)) add_pair(a, b, Axis::stretch, slope, 1.0, f);
      if (have(Axis::twist, shear)) add_pair(a, b, Axis::twist, shear, sense, f);
      add_integral(mass, f, work.sum, to);
    }
    if (have(Axis::twist, bend)) {
      f.setZero();
      add_pair(a, b, Axis::twist, bend, sense, f);
      add_double_integral(mass, f, work.sum, work.slope, to);
    }
    const int tilt = y ? Axis::slope_z : Axis::slope_y;
    if (mass.root[Axis::twist].size() > 0 && mass.root[tilt].size() > 0) {
      const VecX turn = (0.5 * sense) * (a_root[Axis::twist][0] * b_root[tilt] + a_root[tilt][0] * b_root[Axis::twist]);
      for (Eigen::Index p = 0; p < points; ++p) add(to + p * n, mass.x[p], turn.data(), n);
    }
  }
  for (int component = 0; component < 3; ++component)
    for (Eigen::Index p = 0; p < points; ++p) {
      double* const to = out.col(component * points + p).data();
      for (Eigen::Index i = 0; i < n; ++i) to[i] *= mass.root_mass[p];
    }
}

using Eight [[gnu::vector_size(64)]] = double;

// D = A + J J^T where it is not above the diagonal; J: n x columns, n eight or more. Blocks of eight rows and four columns stay in
// registers, the last ones overlap those before. Left to the compiler as loops over an array they took five to eight times as long, with
// shuffles between the registers.
FLEXFRAME_WIDEST
void add_square(const MatX& A, const MatX& J, MatX& D) {
  constexpr int rows = 8, columns = 4;
  const Eigen::Index n = J.rows(), terms = J.cols();
  const double* const numbers = J.data();
  for (Eigen::Index next = 0; next < n; next += columns) {
    const Eigen::Index j = std::min(next, n - columns);
    for (Eigen::Index row = j; row < n; row += rows) {
      const Eigen::Index i = std::min(row, n - rows);
      Eight sum[columns] = {};
      for (Eigen::Index p = 0; p < terms; ++p) {
        const double* const of = numbers + p * n;
        Eight block;
        std::memcpy(&block, of + i, sizeof block);
        for (int c = 0; c < columns; ++c) sum[c] += block * of[j + c];
      }
      for (int c = 0; c < columns; ++c)
        for (int r = 0; r < rows; ++r) D(i + r, j + c) = A(i + r, j + c) + sum[c][r];
    }
  }
}

// The fields of a state.
void evaluate_fields(const Axis& mass, const VecX& q, Values& at, Values& root) {
  for (size_t i = 0; i < Axis::fields; ++i) {
    if (mass.row[i].size() > 0) at[i].noalias() = mass.row[i].transpose() * q;
    if (mass.root[i].size() > 0) root[i] = VecX::Constant(1, mass.root[i].dot(q));
  }
}

// Orthonormal columns that span these vectors, each of them to its own last digits.
MatX span_of(const std::vector<VecX>& vectors) {
  MatX V(vectors.front().size(), static_cast<Eigen::Index>(vectors.size()));
  for (Eigen::Index k = 0; k < V.cols(); ++k) V.col(k) = vectors[static_cast<size_t>(k)].normalized();
  return orthonormal_columns(V, 1e-15 * static_cast<double>(V.rows()));
}

// What a state needs of the particles, or of the dimensions that stand for them.
const MatX& shapes_of(const Axis& mass) { return mass.series ? mass.series->phi : mass.phi; }
const VecX& root_mass_of(const Axis& mass) { return mass.series ? mass.series->root_mass : mass.root_mass; }

// Numbers of an AxisSeries' products beyond which they leave the cache and integrals along the axis are as cheap.
constexpr Eigen::Index most_products = 30000;

}  // namespace

void multiply_out(AxisMass& mass) {
  const Eigen::Index n = mass.phi.rows(), points = mass.x.size();
  mass.series = nullptr;
  // Bending, twist and what they make of each other: n coordinates leave 2 n dimensions or more, as a rule.
  if (n == 0 || points == 0 || 3 * n * n * std::min(2 * n, points) > most_products) return;
  AxisScratch work;
  std::vector<MatX> second(static_cast<size_t>(n), MatX(n, 3 * points));
  for (Eigen::Index k = 0; k < n; ++k) {
    evaluate_fields(mass, VecX::Unit(n, k), work.at, work.root);
    second_order(mass, mass.row, mass.root, work, second[static_cast<size_t>(k)]);
  }
  std::vector<VecX> moved{mass.root_mass, mass.x.cwiseProduct(mass.root_mass)};
  const auto add = [&](const VecX& of_one) {
    for (int component = 0; component < 3; ++component)
      if (const VecX part = of_one.segment(component * points, points); !part.isZero(0.0)) moved.push_back(part);
  };
  for (Eigen::Index k = 0; k < n; ++k) {
    add(mass.phi.row(k));
    for (Eigen::Index l = 0; l <= k; ++l) add(second[static_cast<size_t>(k)].row(l));
  }
  const MatX Q = span_of(moved);
  const Eigen::Index d = Q.cols();
  if (3 * n * n * d > most_products) return;
  auto out = std::make_shared<AxisSeries>();
  out->root_mass = Q.transpose() * mass.root_mass;
  out->along = Q.transpose() * mass.x.cwiseProduct(mass.root_mass);
  out->phi.resize(n, 3 * d);
  out->second.resize(3 * n * d, n);
  for (int component = 0; component < 3; ++component) {
    out->phi.middleCols(component * d, d) = mass.phi.middleCols(component * points, points) * Q;
    for (Eigen::Index k = 0; k < n; ++k)
      Eigen::Map<MatX>(out->second.col(k).data() + component * n * d, n, d) =
          second[static_cast<size_t>(k)].middleCols(component * points, points) * Q;
  }
  mass.series = std::move(out);
}

void reserve_axis_mass(const FlexibleBody& body, BodyTerms& out) {
  const Eigen::Index columns = shapes_of(body.axis).cols();
  out.axis.J = MatX::Zero(body.n, columns);
  out.axis.J2q = MatX::Zero(body.n, 6);
  out.axis.scratch = std::make_shared<AxisScratch>();
  out.axis.scratch->second = MatX::Zero(1, columns);
  out.axis.scratch->bilinear = MatX::Zero(body.n, columns);
  out.axis.scratch->acceleration = VecX::Zero(columns);
  out.Mee = body.Me;
}

void update_axis_mass(const FlexibleBody& body, const VecX& q, BodyTerms& out, bool elastic) {
  const Axis& mass = body.axis;
  AxisTerms& kept = out.axis;
  AxisScratch& work = *kept.scratch;
  const MatX& phi = shapes_of(mass);
  const VecX& m = root_mass_of(mass);
  const Eigen::Index points = m.size();
  MatX& J = kept.J;
  if (mass.series) {
    multiply(mass.series->second, q.data(), J.data());
  } else {
    evaluate_fields(mass, q, work.at, work.root);
    second_order(mass, mass.row, mass.root, work, J);
  }
  // r = c + phi q + G q / 2 before phi joins G
  kept.place.noalias() = 0.5 * J.transpose() * q;
  J += phi;
  kept.place.noalias() += phi.transpose() * q;
  if (mass.series) kept.place.head(points) += mass.series->along;
  else kept.place.head(points) += mass.x.cwiseProduct(mass.root_mass);

  const auto X = kept.place.head(points), Y = kept.place.segment(points, points), Z = kept.place.tail(points);
  const auto Jx = J.leftCols(points), Jy = J.middleCols(points, points), Jz = J.rightCols(points);
  out.md = Vec3(m.dot(X), m.dot(Y), m.dot(Z));
  Vec6 I = mass.J0;
  kept.turned.setZero();
  if (mass.J1.size() > 0) kept.turned.noalias() = mass.J1 * q;
  for (size_t a = 0; a < mass.J2.size(); ++a) {
    if (mass.J2[a].size() == 0) continue;
    const auto at = static_cast<Eigen::Index>(a);
    kept.J2q.col(at).noalias() = mass.J2[a] * q;
    kept.turned[at] += 0.5 * q.dot(kept.J2q.col(at));
  }
  I += kept.turned;
  const double xx = X.squaredNorm(), yy = Y.squaredNorm(), zz = Z.squaredNorm();
  I += (Vec6() << yy + zz, xx + zz, xx + yy, -X.dot(Y), -X.dot(Z), -Y.dot(Z)).finished();
  const Mat3 S = skew(out.md);
  out.Mrr.topLeftCorner<3, 3>() = body.mass * Mat3::Identity();
  out.Mrr.topRightCorner<3, 3>() = -S;
  out.Mrr.bottomLeftCorner<3, 3>() = S;
  out.Mrr.bottomRightCorner<3, 3>() << I[0], I[3], I[4], I[3], I[1], I[5], I[4], I[5], I[2];

  // Columns of J^T [m, X, Y, Z]: linear and angular momentum of the elastic rates.
  Eigen::MatrixX4d& weight = work.weight;
  weight.resize(points, 4);
  weight << m, X, Y, Z;
  Eigen::MatrixX4d &x = work.moment[0], &y = work.moment[1], &z = work.moment[2];
  x.noalias() = Jx * weight;
  y.noalias() = Jy * weight;
  z.noalias() = Jz * weight;
  out.Mre.row(0) = x.col(0).transpose();
  out.Mre.row(1) = y.col(0).transpose();
  out.Mre.row(2) = z.col(0).transpose();
  out.Mre.row(3) = mass.Cr0.row(0) + (z.col(2) - y.col(3)).transpose();
  out.Mre.row(4) = mass.Cr0.row(1) + (x.col(3) - z.col(1)).transpose();
  out.Mre.row(5) = mass.Cr0.row(2) + (y.col(1) - x.col(2)).transpose();
  for (int a = 0; a < 3; ++a) {
    if (mass.Cr1[a].size() == 0) continue;
    kept.q = q;
    out.work.noalias() = mass.Cr1[a] * q;
    out.Mre.row(3 + a) += out.work.transpose();
  }
  if (!elastic || out.Mee.size() == 0) return;
  if (body.n >= 8) {
    add_square(mass.Me, J, out.Mee);
  } else {
    out.Mee = mass.Me;
    out.Mee.selfadjointView<Eigen::Lower>().rankUpdate(J);
  }
  out.Mee.triangularView<Eigen::StrictlyUpper>() = out.Mee.transpose();
}

void update_axis_velocity_terms(const FlexibleBody& body, const Vec6& V, const VecX& qd, BodyTerms& out) {
  const Axis& mass = body.axis;
  const AxisTerms& kept = out.axis;
  AxisScratch& work = *kept.scratch;
  const VecX& m = root_mass_of(mass);
  const Eigen::Index points = m.size();
  const Vec3 v = V.head<3>(), w = V.tail<3>();
  if (V.isZero(0.0) && qd.isZero(0.0)) {
    out.cr.setZero();
    out.ce.setZero();
    return;
  }
  // d/dt (d u2/d q) qd = H(qd, qd)
  if (mass.series) {
    multiply(mass.series->second, qd.data(), work.bilinear.data());
    work.second.noalias() = qd.transpose() * work.bilinear;
  } else {
    evaluate_fields(mass, qd, work.at, work.root);
    for (size_t i = 0; i < Axis::fields; ++i)
      if (mass.row[i].size() > 0) work.rate_row[i] = work.at[i].transpose();
    second_order(mass, work.rate_row, work.root, work, work.second);
  }
  work.rate.noalias() = kept.J.transpose() * qd;

  // The particles' accelerations at zero accelerations of frame and coordinates.
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
  const Vec3 base = w.cross(v);
  for (Eigen::Index p = 0; p < points; ++p) {
    const Eigen::Index y = points + p, z = 2 * points + p;
    const Vec3 r(kept.place[p], kept.place[y], kept.place[z]), rate(work.rate[p], work.rate[y], work.rate[z]);
    const Vec3 a = m[p] * base + w.cross(Vec3(w.cross(r) + 2.0 * rate)) + Vec3(work.second(0, p), work.second(0, y), work.second(0, z));
    force += m[p] * a;
    moment += r.cross(a);
    work.acceleration[p] = a.x();
    work.acceleration[y] = a.y();
    work.acceleration[z] = a.z();
  }
  out.ce.noalias() = kept.J * work.acceleration;

  // The sections' inertia.
  const Vec6 I = mass.J0 + kept.turned;
  Vec6 Jdot = Vec6::Zero(), share;
  share << 0.5 * w.x() * w.x(), 0.5 * w.y() * w.y(), 0.5 * w.z() * w.z(), w.x() * w.y(), w.x() * w.z(), w.y() * w.z();
  if (mass.J1.size() > 0) {
    Jdot.noalias() = mass.J1 * qd;
    out.ce.noalias() -= mass.J1.transpose() * share;
  }
  for (size_t a = 0; a < mass.J2.size(); ++a) {
    if (mass.J2[a].size() == 0) continue;
    const auto at = static_cast<Eigen::Index>(a);
    Jdot[at] += kept.J2q.col(at).dot(qd);
    out.ce.noalias() -= share[at] * kept.J2q.col(at);
  }
  const auto times = [&](const Vec6& t) {
    return Vec3(t[0] * w[0] + t[3] * w[1] + t[4] * w[2], t[3] * w[0] + t[1] * w[1] + t[5] * w[2], t[4] * w[0] + t[5] * w[1] + t[2] * w[2]);
  };
  Vec3 spin = times(I) + mass.Cr0 * qd, growing = times(Jdot);
  for (int a = 0; a < 3; ++a) {
    if (mass.Cr1[a].size() == 0) continue;
    out.work.noalias() = mass.Cr1[a] * qd;
    out.work2.noalias() = mass.Cr1[a].transpose() * qd;
    growing[a] += qd.dot(out.work);
    spin[a] += kept.q.dot(out.work2);
    out.ce.noalias() += w[a] * (out.work - out.work2);
  }
  out.cr.head<3>() = force;
  out.cr.tail<3>() = moment + w.cross(spin) + growing;
}

VecX elastic_inertia(const FlexibleBody& body, const BodyTerms& terms, const VecX& qdd) {
  if (body.rod && terms.Mee.size() == 0) return rod_inertia(*body.rod, terms.rod.front(), qdd);
  if (!has_axis_mass(body) || terms.Mee.size() > 0) return elastic_mass(body, terms) * qdd;
  const VecX along = terms.axis.J.transpose() * qdd;
  VecX out = body.axis.Me * qdd;
  out.noalias() += terms.axis.J * along;
  return out;
}

AxisMass in_coordinates(const AxisMass& mass, const MatX& T) {
  AxisMass out = mass;
  out.series = nullptr;
  if (mass.root_mass.size() == 0) return out;
  out.phi = T.transpose() * mass.phi;
  for (size_t i = 0; i < Axis::fields; ++i) {
    if (mass.row[i].size() > 0) out.row[i] = T.transpose() * mass.row[i];
    if (mass.root[i].size() > 0) out.root[i] = T.transpose() * mass.root[i];
  }
  if (mass.J1.size() > 0) out.J1 = mass.J1 * T;
  for (size_t a = 0; a < mass.J2.size(); ++a)
    if (mass.J2[a].size() > 0) out.J2[a] = T.transpose() * mass.J2[a] * T;
  for (size_t a = 0; a < mass.Cr1.size(); ++a)
    if (mass.Cr1[a].size() > 0) out.Cr1[a] = T.transpose() * mass.Cr1[a] * T;
  out.Cr0 = mass.Cr0 * T;
  out.Me = T.transpose() * mass.Me * T;
  return out;
}

bool same_axis_mass(const AxisMass& a, const AxisMass& b) {
  bool same = !a.series == !b.series && a.per_panel == b.per_panel && a.panel == b.panel && same_values(a.root_mass, b.root_mass) &&
              same_values(a.x, b.x) && same_values(a.phi, b.phi) && same_values(a.once, b.once) && same_values(a.twice, b.twice) &&
              a.J0 == b.J0 && same_values(a.J1, b.J1) && same_values(a.Cr0, b.Cr0) && same_values(a.Me, b.Me);
  for (size_t i = 0; i < a.J2.size(); ++i) same = same && same_values(a.J2[i], b.J2[i]);
  for (size_t i = 0; i < a.Cr1.size(); ++i) same = same && same_values(a.Cr1[i], b.Cr1[i]);
  for (size_t i = 0; i < Axis::fields; ++i) same = same && same_values(a.row[i], b.row[i]) && same_values(a.root[i], b.root[i]);
  return same;
}

}  // namespace flexframe::sim
