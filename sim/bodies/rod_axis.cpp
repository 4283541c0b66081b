#include "sim/bodies/rod_axis.h"

#include "sim/base/four.h"
#include "sim/base/plane.h"
#include "sim/base/spatial.h"

#include <cmath>

namespace flexframe::sim {
namespace {

// sin t - t and cos t - 1 to the last digit by their series up to here: points by fours, where a library takes one after the other.
constexpr double series_to = 1.0;
constexpr int terms = 9;

// Coefficients of t^2k in sin t / t and cos t.
struct Series {
  double sine[terms + 1], cosine[terms + 1];
};
constexpr Series series = [] {
  Series out{};
  out.sine[0] = out.cosine[0] = 1.0;
  for (int k = 1; k <= terms; ++k) {
    out.sine[k] = -out.sine[k - 1] / (2.0 * k * (2.0 * k + 1.0));
    out.cosine[k] = -out.cosine[k - 1] / (2.0 * k * (2.0 * k - 1.0));
  }
  return out;
}();

FLEXFRAME_WIDE
void sines(const double* t, Eigen::Index n, double* sine, double* versed) {
  for (Eigen::Index i = 0; i < n; i += 4) {
    const Four x = four(t + i).v, x2 = x * x;
    Four s = {}, c = {};
    for (int k = terms; k >= 1; --k) {
      s = (s + series.sine[k]) * x2;
      c = (c + series.cosine[k]) * x2;
    }
    four(sine + i).v = s * x;
    four(versed + i).v = c;
  }
}

// Rows r .. r + 4 fours of J = phi + A D; of A the columns before `last` are not zero there.
template <int fours>
FLEXFRAME_INLINE void carry_rows(const MatX& phi, const MatX& A, const MatX& D, Eigen::Index r, Eigen::Index last, MatX& J) {
  const Eigen::Index points = A.rows(), n = D.cols();
  for (Eigen::Index k = 0; k < n; ++k) {
    const double *const d = D.data() + k * points, *a = A.data() + r;
    const double* const p = phi.data() + k * points + r;
    Four sum[fours];
    for (int f = 0; f < fours; ++f) sum[f] = four(p + 4 * f).v;
    for (Eigen::Index i = 0; i < last; ++i, a += points)
      for (int f = 0; f < fours; ++f) sum[f] += four(a + 4 * f).v * d[i];
    for (int f = 0; f < fours; ++f) four(J.data() + k * points + r + 4 * f).v = sum[f];
  }
}

// The columns of A that the rows r .. r + count - 1 reach: of several panels a particle has nothing of those beyond its own.
Eigen::Index reach(const MatX& A, Eigen::Index r, Eigen::Index count) {
  Eigen::Index last = A.cols();
  while (last > 0 && A.col(last - 1).segment(r, count).isZero(0.0)) --last;
  return last;
}

// J = phi + A D: points x points times points x n.
FLEXFRAME_WIDE
void carry(const MatX& phi, const MatX& A, const MatX& D, MatX& J) {
  const Eigen::Index points = A.rows();
  Eigen::Index r = 0;
  for (; r + 16 <= points; r += 16) carry_rows<4>(phi, A, D, r, reach(A, r, 16), J);
  if (r + 8 <= points) carry_rows<2>(phi, A, D, r, reach(A, r, 8), J), r += 8;
  if (r < points) carry_rows<1>(phi, A, D, r, reach(A, r, 4), J);
}

// M = rest + JX^T JX + JY^T JY.
FLEXFRAME_WIDE
void squares(const MatX& rest, const MatX& JX, const MatX& JY, MatX& M) {
  const Eigen::Index points = JX.rows(), n = JX.cols();
  for (Eigen::Index k = 0; k < n; ++k) {
    const double *const xk = JX.data() + k * points, *const yk = JY.data() + k * points;
    for (Eigen::Index j = 0; j <= k; ++j) {
      const double *const xj = JX.data() + j * points, *const yj = JY.data() + j * points;
      Four x = {}, y = {};
      for (Eigen::Index i = 0; i < points; i += 4) {
        x += four(xk + i).v * four(xj + i).v;
        y += four(yk + i).v * four(yj + i).v;
      }
      x += y;
      M(j, k) = M(k, j) = rest(j, k) + ((x[0] + x[1]) + (x[2] + x[3]));
    }
  }
}

// out(k) = a . A_k + b . B_k for all columns k.
FLEXFRAME_WIDE
void columns(const MatX& A, const double* a, const MatX& B, const double* b, double* out) {
  const Eigen::Index points = A.rows(), n = A.cols();
  for (Eigen::Index k = 0; k < n; ++k) {
    const double *const p = A.data() + k * points, *const r = B.data() + k * points;
    Four x = {}, y = {};
    for (Eigen::Index i = 0; i < points; i += 4) {
      x += four(a + i).v * four(p + i).v;
      y += four(b + i).v * four(r + i).v;
    }
    x += y;
    out[k] = (x[0] + x[1]) + (x[2] + x[3]);
  }
}
FLEXFRAME_WIDE
void columns(const MatX& A, const double* a, double* out) {
  const Eigen::Index points = A.rows(), n = A.cols();
  for (Eigen::Index k = 0; k < n; ++k) {
    const double* const p = A.data() + k * points;
    Four x = {};
    for (Eigen::Index i = 0; i < points; i += 4) x += four(a + i).v * four(p + i).v;
    out[k] = (x[0] + x[1]) + (x[2] + x[3]);
  }
}

double dot(const VecX& a, const VecX& b) { return a.dot(b); }

bool moves_linearly(const RodAxis& rod) { return rod.stretch.size() + rod.shear.size() > 0; }

// Places of the particles and their derivatives.
void update_particles(const RodAxis& rod, const VecX& q, RodState& s) {
  update_rod_fields(rod, q, s);
  carry(rod.phi_x, rod.along, s.d_along, s.JX);
  carry(rod.phi_v, rod.along, s.d_across, s.JY);
  multiply(rod.along, s.along.data(), s.X.data());
  multiply(rod.along, s.across.data(), s.Y.data());
  s.X += rod.x.cwiseProduct(rod.root_mass);
  if (!rod.phi_x.isZero(0.0) || moves_linearly(rod)) {
    multiply(rod.phi_x, q.data(), s.rate_x.data());
    s.X += s.rate_x;
  }
  multiply(rod.phi_v, q.data(), s.rate_y.data());
  s.Y += s.rate_y;
}

// Columns of the momenta by elastic rates: linear along and across, angular about x cross across.
struct Momenta {
  VecX along, across, angular;
};
void momenta(const RodAxis& rod, RodState& s, Momenta& out) {
  const Eigen::Index n = s.JX.cols();
  out.along.resize(n), out.across.resize(n), out.angular.resize(n);
  columns(s.JX, rod.root_mass.data(), out.along.data());
  columns(s.JY, rod.root_mass.data(), out.across.data());
  s.acc_x = -s.Y;
  columns(s.JX, s.acc_x.data(), s.JY, s.X.data(), out.angular.data());
}
Momenta& of_thread() {
  static thread_local Momenta momenta;
  return momenta;
}

void reserve_state(const RodAxis& rod, RodState& s) {
  const Eigen::Index points = rod.x.size(), n = rod.turn.cols();
  s.q.resize(0);
  for (VecX* v : {&s.theta, &s.sine, &s.versed, &s.along, &s.across, &s.turn_rate, &s.a_along, &s.a_across, &s.X, &s.Y, &s.rate_x,
                  &s.rate_y, &s.acc_x, &s.acc_y})
    *v = VecX::Zero(points);
  s.stretch = VecX::Zero(rod.stretch.rows());
  s.shear = VecX::Zero(rod.shear.rows());
  for (MatX* m : {&s.d_along, &s.d_across, &s.JX, &s.JY}) *m = MatX::Zero(points, n);
}

// The rod's axes x, across, x cross across in the body's.
Mat3 axes_of(const RodAxis& rod) {
  Mat3 R = Mat3::Identity();
  if (rod.towards == 2) R.col(1) = Vec3::UnitZ(), R.col(2) = -Vec3::UnitY();
  return R;
}

Mat3 tensor(const Vec6& I) {
  Mat3 out;
  out << I[0], I[3], I[4], I[3], I[1], I[5], I[4], I[5], I[2];
  return out;
}

// The inertia of the sections, turned by theta, and its derivative by q.
Vec6 section_inertia(const RodAxis& rod, const VecX& q, const RodState& s) {
  Vec6 I = rod.J0;
  if (rod.J1.size() > 0) I += rod.J1 * q;
  if (rod.tilt.size() == 0) return I;
  const VecX sine = s.sine + s.theta, cosine = s.versed.array() + 1.0;
  const double square = rod.tilt.dot(sine.cwiseAbs2());
  I[0] -= square, I[rod.towards] += square;
  I[rod.towards + 2] += rod.tilt.dot(sine.cwiseProduct(cosine));
  return I;
}
Mat6X section_inertia_change(const RodAxis& rod, const RodState& s) {
  Mat6X out = rod.J1;
  if (rod.tilt.size() == 0) return out;
  const VecX sine = s.sine + s.theta, cosine = s.versed.array() + 1.0;
  const VecX by_square = rod.turn.transpose() * (2.0 * rod.tilt.cwiseProduct(sine.cwiseProduct(cosine)));
  out.row(0) -= by_square.transpose();
  out.row(rod.towards) += by_square.transpose();
  out.row(rod.towards + 2) += (rod.turn.transpose() * rod.tilt.cwiseProduct(VecX(1.0 - 2.0 * sine.array().square()))).transpose();
  return out;
}

}  // namespace

void update_rod_fields(const RodAxis& rod, const VecX& q, RodState& s) {
  if (s.theta.size() != rod.x.size()) reserve_state(rod, s);
  if (s.q.size() == q.size() && s.q == q) return;
  s.q = q;
  const Eigen::Index points = rod.x.size(), n = q.size();
  multiply(rod.turn, q.data(), s.theta.data());
  double most = 0.0;
  for (Eigen::Index i = 0; i < points; ++i) most = std::max(most, std::abs(s.theta[i]));
  if (most <= series_to) {
    sines(s.theta.data(), points, s.sine.data(), s.versed.data());
  } else {
    for (Eigen::Index i = 0; i < points; ++i) {
      const double half = std::sin(0.5 * s.theta[i]);
      s.sine[i] = std::sin(s.theta[i]) - s.theta[i];
      s.versed[i] = -2.0 * half * half;
    }
  }
  if (!moves_linearly(rod)) {
    s.along = s.versed;
    s.across = s.sine;
    for (Eigen::Index k = 0; k < n; ++k) {
      s.d_along.col(k) = -(s.sine + s.theta).cwiseProduct(rod.turn.col(k));
      s.d_across.col(k) = s.versed.cwiseProduct(rod.turn.col(k));
    }
    return;
  }
  const VecX sin = s.sine + s.theta;
  s.along = s.versed;
  s.across = s.sine;
  VecX by_turn_x = -sin, by_turn_y = s.versed;
  if (rod.stretch.size() > 0) {
    multiply(rod.stretch, q.data(), s.stretch.data());
    s.along += s.stretch.cwiseProduct(s.versed);
    s.across += s.stretch.cwiseProduct(sin);
    by_turn_x -= s.stretch.cwiseProduct(sin);
    by_turn_y += s.stretch.cwiseProduct(VecX(s.versed.array() + 1.0));
  }
  if (rod.shear.size() > 0) {
    multiply(rod.shear, q.data(), s.shear.data());
    s.along -= s.shear.cwiseProduct(sin);
    s.across += s.shear.cwiseProduct(s.versed);
    by_turn_x -= s.shear.cwiseProduct(VecX(s.versed.array() + 1.0));
    by_turn_y -= s.shear.cwiseProduct(sin);
  }
  s.d_along = by_turn_x.asDiagonal() * rod.turn;
  s.d_across = by_turn_y.asDiagonal() * rod.turn;
  if (rod.stretch.size() > 0) {
    s.d_along += s.versed.asDiagonal() * rod.stretch;
    s.d_across += sin.asDiagonal() * rod.stretch;
  }
  if (rod.shear.size() > 0) {
    s.d_along -= sin.asDiagonal() * rod.shear;
    s.d_across += s.versed.asDiagonal() * rod.shear;
  }
}

void update_rod_rates(const RodAxis& rod, const VecX& qd, RodState& s) {
  multiply(rod.turn, qd.data(), s.turn_rate.data());
  // With t = (cos, sin) and n = (-sin, cos): r'' = (2 u't theta_t - gamma theta_t^2) n - ((1 + u') theta_t^2 + 2 gamma_t theta_t) t.
  VecX& normal = s.rate_x;
  VecX& tangent = s.rate_y;
  tangent = s.turn_rate.cwiseAbs2();
  normal.setZero(tangent.size());
  if (rod.shear.size() > 0) normal = -s.shear.cwiseProduct(tangent);
  if (rod.stretch.size() > 0) {
    multiply(rod.stretch, qd.data(), s.acc_x.data());
    normal += 2.0 * s.acc_x.cwiseProduct(s.turn_rate);
    tangent += s.stretch.cwiseProduct(tangent).eval();
  }
  if (rod.shear.size() > 0) {
    multiply(rod.shear, qd.data(), s.acc_x.data());
    tangent += 2.0 * s.acc_x.cwiseProduct(s.turn_rate);
  }
  for (Eigen::Index i = 0; i < tangent.size(); ++i) {
    const double c = 1.0 + s.versed[i], sin = s.sine[i] + s.theta[i];
    s.a_along[i] = -sin * normal[i] - c * tangent[i];
    s.a_across[i] = c * normal[i] - sin * tangent[i];
  }
}

Eigen::Vector2d rod_displacement(const VecX& weights, const RodState& s) { return {dot(weights, s.along), dot(weights, s.across)}; }
Eigen::Vector2d rod_acceleration(const VecX& weights, const RodState& s) { return {dot(weights, s.a_along), dot(weights, s.a_across)}; }
void rod_jacobian(const VecX& weights, const RodState& s, double* along, double* across) {
  columns(s.d_along, weights.data(), along);
  columns(s.d_across, weights.data(), across);
}

void reserve_rod(const FlexibleBody& body, BodyTerms& out) {
  out.rod.resize(1);
  reserve_state(*body.rod, out.rod.front());
  out.ce = out.work = out.work2 = VecX::Zero(body.n);
  out.Mee = body.Me;
}
void reserve_rod(const PlaneBody& body, PlaneTerms& out) {
  out.rod.resize(1);
  reserve_state(*body.rod, out.rod.front());
  out.ce = out.work = out.work2 = VecX::Zero(body.n);
  out.Mee = body.Me;
}

void update_rod_mass(const FlexibleBody& body, const VecX& q, BodyTerms& out, bool elastic) {
  const RodAxis& rod = *body.rod;
  RodState& s = out.rod.front();
  update_particles(rod, q, s);
  const Mat3 R = axes_of(rod);
  out.md = R * Vec3(dot(rod.root_mass, s.X), dot(rod.root_mass, s.Y), 0.0);
  const double xx = dot(s.X, s.X), yy = dot(s.Y, s.Y), xy = dot(s.X, s.Y);
  Mat3 I;
  I << yy, -xy, 0.0, -xy, xx, 0.0, 0.0, 0.0, xx + yy;
  I = (R * I * R.transpose() + tensor(section_inertia(rod, q, s))).eval();
  const Mat3 S = skew(out.md);
  out.Mrr.topLeftCorner<3, 3>() = body.mass * Mat3::Identity();
  out.Mrr.topRightCorner<3, 3>() = -S;
  out.Mrr.bottomLeftCorner<3, 3>() = S;
  out.Mrr.bottomRightCorner<3, 3>() = I;
  Momenta& p = of_thread();
  momenta(rod, s, p);
  out.Mre.topRows<3>() = R.col(0) * p.along.transpose() + R.col(1) * p.across.transpose();
  out.Mre.bottomRows<3>() = rod.Cr0 + R.col(2) * p.angular.transpose();
  if (elastic && out.Mee.size() > 0) squares(rod.Me, s.JX, s.JY, out.Mee);
}

void update_rod_mass(const PlaneBody& body, const VecX& q, PlaneTerms& out, bool elastic) {
  const RodAxis& rod = *body.rod;
  RodState& s = out.rod.front();
  update_particles(rod, q, s);
  const Eigen::Matrix2d& A = body.rod_axes;
  out.md = A * Vec2(dot(rod.root_mass, s.X), dot(rod.root_mass, s.Y));
  const double J = body.rod_J0 + dot(s.X, s.X) + dot(s.Y, s.Y);
  out.Mrr << body.mass, 0.0, -out.md.y(), 0.0, body.mass, out.md.x(), -out.md.y(), out.md.x(), J;
  Momenta& p = of_thread();
  momenta(rod, s, p);
  out.Mre.col(0) = A(0, 0) * p.along + A(0, 1) * p.across;
  out.Mre.col(1) = A(1, 0) * p.along + A(1, 1) * p.across;
  out.Mre.col(2) = body.rod_Cr0 + body.rod_sense * p.angular;
  if (elastic && out.Mee.size() > 0) squares(rod.Me, s.JX, s.JY, out.Mee);
}

namespace {

// Rates of the particles and the accelerations that those bring at rest of the rates, times root_mass: rate_x .. acc_y.
void update_motion(const RodAxis& rod, const VecX& qd, RodState& s) {
  update_rod_rates(rod, qd, s);
  multiply(rod.along, s.a_along.data(), s.acc_x.data());
  multiply(rod.along, s.a_across.data(), s.acc_y.data());
  multiply(s.JX, qd.data(), s.rate_x.data());
  multiply(s.JY, qd.data(), s.rate_y.data());
}

}  // namespace

void update_rod_velocity_terms(const PlaneBody& body, const Vec3& V, const VecX& qd, PlaneTerms& out) {
  const RodAxis& rod = *body.rod;
  RodState& s = out.rod.front();
  update_motion(rod, qd, s);
  const Vec2 v = body.rod_axes.transpose() * V.head<2>();
  const double w = body.rod_sense * V.z(), w2 = w * w;
  const Vec2 base = cross(w, v);
  s.acc_x += base.x() * rod.root_mass - w2 * s.X - (2.0 * w) * s.rate_y;
  s.acc_y += base.y() * rod.root_mass - w2 * s.Y + (2.0 * w) * s.rate_x;
  const Vec2 force(dot(rod.root_mass, s.acc_x), dot(rod.root_mass, s.acc_y));
  out.cr = joined(Vec2(body.rod_axes * force), body.rod_sense * (dot(s.X, s.acc_y) - dot(s.Y, s.acc_x)));
  columns(s.JX, s.acc_x.data(), s.JY, s.acc_y.data(), out.ce.data());
}

void update_rod_velocity_terms(const FlexibleBody& body, const Vec6& V, const VecX& qd, BodyTerms& out) {
  const RodAxis& rod = *body.rod;
  RodState& s = out.rod.front();
  update_motion(rod, qd, s);
  const Mat3 R = axes_of(rod);
  const Vec3 v = R.transpose() * V.head<3>(), w = R.transpose() * V.tail<3>(), base = w.cross(v);
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
  for (Eigen::Index i = 0; i < rod.x.size(); ++i) {
    const Vec3 r(s.X[i], s.Y[i], 0.0), rate(s.rate_x[i], s.rate_y[i], 0.0);
    const Vec3 a = rod.root_mass[i] * base + w.cross(Vec3(w.cross(r) + 2.0 * rate)) + Vec3(s.acc_x[i], s.acc_y[i], 0.0);
    force += rod.root_mass[i] * a;
    moment += r.cross(a);
    s.acc_x[i] = a.x();
    s.acc_y[i] = a.y();
  }
  columns(s.JX, s.acc_x.data(), s.JY, s.acc_y.data(), out.ce.data());
  // The sections' inertia.
  const Vec3 turn = V.tail<3>();
  const Mat3 I = tensor(section_inertia(rod, s.q, s));
  Mat3 rate = Mat3::Zero();
  if (rod.J1.size() > 0) {
    const Mat6X change = section_inertia_change(rod, s);
    rate = tensor(change * qd);
    Vec6 share;
    share << 0.5 * turn.x() * turn.x(), 0.5 * turn.y() * turn.y(), 0.5 * turn.z() * turn.z(), turn.x() * turn.y(), turn.x() * turn.z(),
        turn.y() * turn.z();
    out.ce.noalias() -= change.transpose() * share;
  }
  const Vec3 spin = I * turn + rod.Cr0 * qd;
  out.cr.head<3>() = R * force;
  out.cr.tail<3>() = R * moment + turn.cross(spin) + rate * turn;
}

VecX rod_inertia(const RodAxis& rod, const RodState& s, const VecX& qdd) {
  const VecX x = s.JX * qdd, y = s.JY * qdd;
  VecX out = rod.Me * qdd;
  out.noalias() += s.JX.transpose() * x + s.JY.transpose() * y;
  return out;
}

std::shared_ptr<const RodAxis> in_coordinates(const std::shared_ptr<const RodAxis>& rod, const MatX& T) {
  if (!rod) return nullptr;
  auto out = std::make_shared<RodAxis>(*rod);
  for (MatX* m : {&out->phi_x, &out->phi_v, &out->turn, &out->stretch, &out->shear})
    if (m->size() > 0) *m = MatX(*m * T);
  if (out->J1.size() > 0) out->J1 = Mat6X(out->J1 * T);
  out->Cr0 = Mat3X(out->Cr0 * T);
  out->Me = MatX(T.transpose() * out->Me * T);
  return out;
}

bool same_rod(const std::shared_ptr<const RodAxis>& a, const std::shared_ptr<const RodAxis>& b) {
  if (!a || !b || a == b) return a == b;
  return a->towards == b->towards && same_values(a->x, b->x) && same_values(a->root_mass, b->root_mass) &&
         same_values(a->phi_x, b->phi_x) && same_values(a->phi_v, b->phi_v) && same_values(a->turn, b->turn) &&
         same_values(a->stretch, b->stretch) && same_values(a->shear, b->shear) && same_values(a->along, b->along) &&
         same_values(a->tilt, b->tilt) && a->J0 == b->J0 && same_values(a->J1, b->J1) && same_values(a->Cr0, b->Cr0) &&
         same_values(a->Me, b->Me);
}

}  // namespace flexframe::sim
