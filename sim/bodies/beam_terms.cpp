// Integrals of a beam in its floating frame: kinetic energy of the centre line (and of the sections' spin) up to second order in the
// displacements, strain energy to second order. Derivation: sim/BEAMS.md sections 2 to 4.
#include "sim/bodies/beam_terms.h"

#include "sim/base/eigen_solvers.h"
#include "sim/base/spatial.h"
#include "sim/scene/section.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace flexframe::sim::beam {
namespace {

double positive(double value, const char* what, const char* unit) {
  if (!(value > 0.0) || !std::isfinite(value))
    throw InputError(fmt::format("{} of the beam must be a positive number{}{}, found {}", what, *unit ? " in " : "", unit, value));
  return value;
}

// The integrand of one station (rows and numbers) or of many (blocks and arrays): the same sums.

// m += f (a b^T + b a^T)
void add_symmetric(MatX& m, const VecX& a, const VecX& b, double f) {
  m.noalias() += (f * a) * b.transpose();
  m.noalias() += (f * b) * a.transpose();
}
MatX product(const FieldBlock& a, const FieldBlock& b, const VecX& f) { return (a.rows * f.asDiagonal()) * b.rows.transpose(); }
void add_symmetric(MatX& m, const FieldBlock& a, const FieldBlock& b, const VecX& f) {
  const MatX ab = product(a, b, f);
  m.block(a.first, b.first, ab.rows(), ab.cols()) += ab;
  m.block(b.first, a.first, ab.cols(), ab.rows()) += ab.transpose();
}

// m += f a a^T
void add_square(MatX& m, const VecX& a, double f) { m.noalias() += (f * a) * a.transpose(); }
void add_square(MatX& m, const FieldBlock& a, const VecX& f) {
  m.block(a.first, a.first, a.rows.rows(), a.rows.rows()) += product(a, a, f);
}

// m(j, k) += f (b_k a_j - a_k b_j), the component of phi_k x phi_j whose factors are a, b
void add_cross(MatX& m, const VecX& a, const VecX& b, double f) {
  m.noalias() += (f * a) * b.transpose();
  m.noalias() -= (f * b) * a.transpose();
}
void add_cross(MatX& m, const FieldBlock& a, const FieldBlock& b, const VecX& f) {
  const MatX ab = product(a, b, f);
  m.block(a.first, b.first, ab.rows(), ab.cols()) += ab;
  m.block(b.first, a.first, ab.cols(), ab.rows()) -= ab.transpose();
}

// row += f a
template <class Row>
void add_row(Row row, const VecX& a, double f) {
  row += f * a;
}
template <class Row>
void add_row(Row row, const FieldBlock& a, const VecX& f) {
  row.segment(a.first, a.rows.rows()) += (a.rows * f).transpose();
}

VecX minus(const VecX& a, const VecX& b) { return a - b; }
FieldBlock minus(const FieldBlock& a, const FieldBlock& b) { return {a.first, a.rows - b.rows}; }

// The derivative of the second-order field: q^T (...) q / 2 with slope terms (rate, times fr) and the part that integrates twice (curl,
// times fc).
template <class Rows, class Number>
void add_rates(std::array<MatX, 3>& rate, std::array<MatX, 3>& curl, const Properties& p, const BeamEffects& e, const Rows& r,
               const std::array<Number, 2>& f) {
  const auto& [fr, fc] = f;
  const bool xy = e.bending_xy, xz = e.bending_xz;
  // The fibres of a twisted section are helices: on the average it shortens by r^2 theta'^2 / 2.
  if (e.torsion) add_square(rate[0], r.dtheta, -fr * p.gyration2);
  if (xy) add_square(rate[0], r.phi_z, -fr);
  if (xz) add_square(rate[0], r.s, -fr);
  if (e.axial && xy) add_symmetric(rate[1], r.du, r.phi_z, fr);
  if (e.axial && xz) add_symmetric(rate[2], r.du, r.s, fr);
  if (e.torsion && xz) add_symmetric(curl[1], r.theta, r.ds, -fc);
  if (e.torsion && xy) add_symmetric(curl[2], r.theta, r.dphi_z, fc);
  if (!e.shear) return;
  // shear angles turn with the section
  if (xy) {
    const auto gamma = minus(r.dv, r.phi_z);
    add_symmetric(rate[0], r.phi_z, gamma, -fr);
    if (e.torsion) add_symmetric(rate[2], r.theta, gamma, fr);
  }
  if (xz) {
    const auto gamma = minus(r.dw, r.s);
    add_symmetric(rate[0], r.s, gamma, -fr);
    if (e.torsion) add_symmetric(rate[1], r.theta, gamma, -fr);
  }
}

// Z^T m Z, empty where m vanishes identically
MatX congruent(const MatX& m, const Basis& Z) {
  if ((m.array() == 0.0).all()) return {};
  const MatX left = Z.transpose() * m;
  return left * Z;
}
// Integrals over elements couple neighbours only.
MatX congruent(const MatX& m, const MatX& Z) {
  MatX right = MatX::Zero(m.rows(), Z.cols());
  bool any = false;
  for (Eigen::Index j = 0; j < m.cols(); ++j) {
    Eigen::Index first = 0, end = m.rows();
    while (first < end && m(first, j) == 0.0) ++first;
    while (end > first && m(end - 1, j) == 0.0) --end;
    if (first == end) continue;
    any = true;
    right.middleRows(first, end - first).noalias() += m.col(j).segment(first, end - first) * Z.row(j);
  }
  return any ? MatX(Z.transpose() * right) : MatX();
}

template <class Z>
void set_blocks(FlexibleBody& body, const Integrals& sum, const Z& z) {
  for (std::size_t a = 0; a < 3; ++a) body.md2[a] = congruent(sum.md2[a], z);
  for (std::size_t a = 0; a < 6; ++a) body.J2[a] = congruent(sum.J2[a], z);
  for (std::size_t a = 0; a < 3; ++a) body.Cr1[a] = congruent(sum.Cr1[a], z);
}

template <std::size_t N>
void set_zero(std::array<MatX, N>& blocks, int n) {
  for (MatX& m : blocks) m = MatX::Zero(n, n);
}

}  // namespace

Properties properties(const BeamDef& def, const BeamEffects& effects) {
  const Section& s = def.section;
  const double rho = positive(def.material.density, "density", "kg/m^3");
  const double e = positive(def.material.youngs_modulus, "Young's modulus", "Pa");
  const double nu = def.material.poisson;
  if (!(nu > -1.0 && nu <= 0.5)) throw InputError(fmt::format("Poisson's ratio must lie in (-1, 0.5], found {}", nu));
  const double g = e / (2.0 * (1.0 + nu));
  Properties p;
  p.length = positive(def.length, "length", "m");
  p.mass = rho * positive(s.area, "area of the section", "m^2");
  if (effects.bending_xz) positive(s.iy, "second moment of area iy", "m^4");
  if (effects.bending_xy) positive(s.iz, "second moment of area iz", "m^4");
  if (effects.torsion) positive(s.j, "torsion constant j", "m^4");
  if (effects.torsion) positive(mass_moments(s)[0] + mass_moments(s)[1], "polar moment of area iy + iz", "m^4");
  if (effects.bending_xy && effects.bending_xz && !(s.iyz * s.iyz < s.iy * s.iz))
    throw InputError(fmt::format("product of area iyz must satisfy iyz^2 < iy iz, found iyz = {}, iy = {}, iz = {}", s.iyz, s.iy, s.iz));
  const Vec3 rotary = rho * mass_moments(s);
  p.inertia_y = rotary[0];
  p.inertia_z = rotary[1];
  p.inertia_yz = rotary[2];
  p.ea = e * s.area;
  p.ei_y = e * s.iy;
  p.ei_z = e * s.iz;
  p.ei_yz = e * s.iyz;
  p.gj = g * s.j;
  if (effects.torsion) p.gyration2 = (s.iy + s.iz) / s.area;
  if (effects.shear) {
    if (effects.bending_xy) p.shear_y = positive(s.shear_y, "shear correction factor shear_y", "") * g * s.area;
    if (effects.bending_xz) p.shear_z = positive(s.shear_z, "shear correction factor shear_z", "") * g * s.area;
    if (effects.bending_xy && effects.bending_xz && s.shear_yz != 0.0) {
      // The inverse of what forces along y and z slide along both.
      const double y = 1.0 / s.shear_y, z = 1.0 / s.shear_z, yz = s.shear_yz, scale = g * s.area / (y * z - yz * yz);
      p.shear_y = scale * z;
      p.shear_z = scale * y;
      p.shear_yz = -scale * yz;
    }
  }
  return p;
}

FieldRows::FieldRows(int n) : u(VecX::Zero(n)), du(u), v(u), dv(u), phi_z(u), dphi_z(u), w(u), dw(u), s(u), ds(u), theta(u), dtheta(u) {}

Integrals::Integrals(int n) : md1(Mat3X::Zero(3, n)), J1(Mat6X::Zero(6, n)), Cr0(Mat3X::Zero(3, n)), Me(MatX::Zero(n, n)), Ke(Me) {
  set_zero(md2, n);
  set_zero(J2, n);
  set_zero(Cr1, n);
}

namespace {

Mat3 section_tensor(const Properties& p) {
  Mat3 out;
  out << p.inertia_y + p.inertia_z, 0.0, 0.0, 0.0, p.inertia_y, -p.inertia_yz, 0.0, -p.inertia_yz, p.inertia_z;
  return out;
}

// Of a tensor S that exp(theta) turns, to second order (theta^2 S + S theta^2) / 2 - theta S theta: the derivative by turns about two axes.
std::array<double, 6> tilted_tensor(const Mat3& S, const Vec3& about_a, const Vec3& about_b) {
  const Mat3 A = skew(about_a), B = skew(about_b), both = A * B + B * A;
  const Mat3 d = 0.5 * (both * S + S * both) - A * S * B - B * S * A;
  return {d(0, 0), d(1, 1), d(2, 2), d(0, 1), d(0, 2), d(1, 2)};
}

// Angular momentum of a section of the tensor S, tilted about a, whose tilt about b grows: per angle and rate.
Vec3 tilted_momentum(const Mat3& S, const Vec3& about_a, const Vec3& about_b) {
  const Mat3 A = skew(about_a);
  return (A * S - S * A) * about_b + 0.5 * S * (A * about_b);
}

// Rotary inertia of the sections, whose tensor turns with them: with their twist, and with shear with their slopes too.
template <class Rows, class Number>
void add_rotary_inertia(Integrals& sum, const Properties& p, const BeamEffects& effects, const Rows& r, const Number& weight) {
  const Mat3 section = section_tensor(p);
  const auto turned = [&](const auto& angle, const Vec3& axis) {
    const Mat3 turn = skew(axis), d = turn * section - section * turn;
    const std::array<double, 6> each = {d(0, 0), d(1, 1), d(2, 2), d(0, 1), d(0, 2), d(1, 2)};
    for (Eigen::Index a = 0; a < 6; ++a)
      if (each[static_cast<size_t>(a)] != 0.0) add_row(sum.J1.row(a), angle, each[static_cast<size_t>(a)] * weight);
  };
  // And to second order: what a shaft that spins about its own axis has of its sections' spin.
  const auto tilted = [&](const auto& a, const Vec3& about_a, const auto& b, const Vec3& about_b, bool same) {
    const std::array<double, 6> each = tilted_tensor(section, about_a, about_b);
    for (size_t k = 0; k < 6; ++k) {
      if (each[k] == 0.0) continue;
      if (same) add_square(sum.J2[k], a, each[k] * weight);
      else add_symmetric(sum.J2[k], a, b, each[k] * weight);
    }
    const Vec3 ab = tilted_momentum(section, about_a, about_b), ba = tilted_momentum(section, about_b, about_a);
    for (size_t k = 0; k < 3; ++k) {
      const double even = same ? ab[k] : 0.5 * (ab[k] + ba[k]), odd = 0.5 * (ba[k] - ab[k]);
      if (even != 0.0 && same) add_square(sum.Cr1[k], a, even * weight);
      else if (even != 0.0) add_symmetric(sum.Cr1[k], a, b, even * weight);
      if (odd != 0.0 && !same) add_cross(sum.Cr1[k], a, b, odd * weight);
    }
  };
  if (effects.torsion) {
    turned(r.theta, Vec3::UnitX());
    tilted(r.theta, Vec3::UnitX(), r.theta, Vec3::UnitX(), true);
  }
  if (!effects.shear) return;

  const bool xy = effects.bending_xy, xz = effects.bending_xz, to = effects.torsion;
  const double iy = p.inertia_y, iz = p.inertia_z, iyz = p.inertia_yz;
  if (xy) add_square(sum.Me, r.phi_z, iz * weight);
  if (xz) add_square(sum.Me, r.s, iy * weight);
  if (xy && xz && iyz != 0.0) add_symmetric(sum.Me, r.phi_z, r.s, iyz * weight);
  add_row(sum.Cr0.row(1), r.s, -iy * weight);
  add_row(sum.Cr0.row(1), r.phi_z, -iyz * weight);
  add_row(sum.Cr0.row(2), r.phi_z, iz * weight);
  add_row(sum.Cr0.row(2), r.s, iyz * weight);
  turned(r.s, -Vec3::UnitY());
  turned(r.phi_z, Vec3::UnitZ());
  if (xy) tilted(r.phi_z, Vec3::UnitZ(), r.phi_z, Vec3::UnitZ(), true);
  if (xz) tilted(r.s, -Vec3::UnitY(), r.s, -Vec3::UnitY(), true);
  if (xy && xz) tilted(r.s, -Vec3::UnitY(), r.phi_z, Vec3::UnitZ(), false);
  if (to && xy) tilted(r.theta, Vec3::UnitX(), r.phi_z, Vec3::UnitZ(), false);
  if (to && xz) tilted(r.theta, Vec3::UnitX(), r.s, -Vec3::UnitY(), false);
}

// x, weight: m, a number or one a station.
template <class Rows, class Number>
void add_stations_of(Integrals& sum, const Properties& p, const BeamEffects& effects, const Rows& r, const Number& x,
                     const Number& weight) {
  const Number dm = p.mass * weight, dmx = dm * x;
  const bool ax = effects.axial, xy = effects.bending_xy, xz = effects.bending_xz, to = effects.torsion;

  // first moment and inertia tensor, first order
  add_row(sum.md1.row(0), r.u, dm);
  add_row(sum.md1.row(1), r.v, dm);
  add_row(sum.md1.row(2), r.w, dm);
  add_row(sum.J1.row(1), r.u, 2.0 * dmx);
  add_row(sum.J1.row(2), r.u, 2.0 * dmx);
  add_row(sum.J1.row(3), r.v, -dmx);
  add_row(sum.J1.row(4), r.w, -dmx);

  // angular momentum of the elastic rates: c x phi, and the sections' spin
  add_row(sum.Cr0.row(0), r.theta, (p.inertia_y + p.inertia_z) * weight);
  add_row(sum.Cr0.row(1), r.w, -dmx);
  add_row(sum.Cr0.row(2), r.v, dmx);

  // structural mass and stiffness
  if (ax) add_square(sum.Me, r.u, dm), add_square(sum.Ke, r.du, p.ea * weight);
  if (xy) add_square(sum.Me, r.v, dm), add_square(sum.Ke, r.dphi_z, p.ei_z * weight);
  if (xz) add_square(sum.Me, r.w, dm), add_square(sum.Ke, r.ds, p.ei_y * weight);
  if (xy && xz && p.ei_yz != 0.0) add_symmetric(sum.Ke, r.dphi_z, r.ds, p.ei_yz * weight);
  if (to) add_square(sum.Me, r.theta, (p.inertia_y + p.inertia_z) * weight), add_square(sum.Ke, r.dtheta, p.gj * weight);
  if (effects.shear && xy) add_square(sum.Ke, minus(r.dv, r.phi_z), p.shear_y * weight);
  if (effects.shear && xz) add_square(sum.Ke, minus(r.dw, r.s), p.shear_z * weight);
  if (p.shear_yz != 0.0) add_symmetric(sum.Ke, minus(r.dv, r.phi_z), minus(r.dw, r.s), p.shear_yz * weight);

  // inertia tensor, second order of the linear field: phi_i . phi_j I - phi_i phi_j^T
  const Number dm2 = 2.0 * dm, minus_dm = -dm;
  if (xy) add_square(sum.J2[0], r.v, dm2), add_square(sum.J2[2], r.v, dm2);
  if (xz) add_square(sum.J2[0], r.w, dm2), add_square(sum.J2[1], r.w, dm2);
  if (ax) add_square(sum.J2[1], r.u, dm2), add_square(sum.J2[2], r.u, dm2);
  if (ax && xy) add_symmetric(sum.J2[3], r.u, r.v, minus_dm);
  if (ax && xz) add_symmetric(sum.J2[4], r.u, r.w, minus_dm);
  if (xy && xz) add_symmetric(sum.J2[5], r.v, r.w, minus_dm);

  // angular momentum, first order: phi_k x phi_j
  if (xy && xz) add_cross(sum.Cr1[0], r.w, r.v, dm);
  if (ax && xz) add_cross(sum.Cr1[1], r.u, r.w, dm);
  if (ax && xy) add_cross(sum.Cr1[2], r.v, r.u, dm);

  // the second-order field: int f(x) int_0^x g ds dx = int g(s) int_s^L f dx ds with f = 1 and f = x
  if (effects.stiffening) {
    const double L = p.length;
    const Number left = L - x, left_x = 0.5 * left * (L + x), twice = 0.5 * left * left, twice_x = left * left * (2.0 * L + x) / 6.0;
    add_rates(sum.md2, sum.md2, p, effects, r, std::array<Number, 2>{dm * left, dm * twice});
    std::array<MatX, 3> c;
    set_zero(c, static_cast<int>(sum.Me.rows()));
    add_rates(c, c, p, effects, r, std::array<Number, 2>{dm * left_x, dm * twice_x});
    sum.J2[1] += 2.0 * c[0];
    sum.J2[2] += 2.0 * c[0];
    sum.J2[3] -= c[1];
    sum.J2[4] -= c[2];
    sum.Cr1[1] -= c[2];
    sum.Cr1[2] += c[1];
  }

  if (effects.shear || to) add_rotary_inertia(sum, p, effects, r, weight);
}

template <class Rows, class Number>
void add_second_order_of(SecondOrder& sum, const Properties& p, const BeamEffects& effects, const Rows& row, const Number& x,
                         const Number& weight) {
  add_rates(sum.rate, sum.curl, p, effects, row, std::array<Number, 2>{weight, weight});
  if (!effects.torsion) return;
  const Number wx = weight * x;
  if (effects.bending_xz) add_symmetric(sum.moment[1], row.theta, row.ds, -wx);
  if (effects.bending_xy) add_symmetric(sum.moment[2], row.theta, row.dphi_z, wx);
  // psi2' = psi x psi' / 2
  const Number half = 0.5 * weight, less = -0.5 * weight;
  if (effects.bending_xz && effects.bending_xy) {
    add_symmetric(sum.turn[0], row.phi_z, row.ds, half);
    add_symmetric(sum.turn[0], row.s, row.dphi_z, less);
  }
  if (effects.bending_xy) {
    add_symmetric(sum.turn[1], row.phi_z, row.dtheta, half);
    add_symmetric(sum.turn[1], row.theta, row.dphi_z, less);
  }
  if (effects.bending_xz) {
    add_symmetric(sum.turn[2], row.s, row.dtheta, half);
    add_symmetric(sum.turn[2], row.theta, row.ds, less);
  }
}

}  // namespace

void add_station(Integrals& sum, const Properties& p, const BeamEffects& effects, const FieldRows& row, double x, double weight) {
  add_stations_of(sum, p, effects, row, x, weight);
}
void add_stations(Integrals& sum, const Properties& p, const BeamEffects& effects, const FieldBlocks& rows, const Eigen::ArrayXd& x,
                  const Eigen::ArrayXd& weight) {
  add_stations_of(sum, p, effects, rows, x, weight);
}

void add_root_rotation(Integrals& sum, const Properties& p, const FieldRows& root) {
  // the root turns by exp: its tangent gains (0, -theta s, theta phi_z)/2, the points x times that
  const double L = p.length, first = 0.5 * p.mass * L * L, second = p.mass * L * L * L / 3.0;
  const auto n = root.u.size();
  MatX y = MatX::Zero(n, n), z = y;
  add_symmetric(y, root.theta, root.s, -0.5);
  add_symmetric(z, root.theta, root.phi_z, 0.5);
  sum.md2[1] += first * y;
  sum.md2[2] += first * z;
  sum.J2[3] -= second * y;
  sum.J2[4] -= second * z;
  sum.Cr1[1] -= second * z;
  sum.Cr1[2] += second * y;
}

SecondOrder::SecondOrder(int n) {
  set_zero(rate, n);
  set_zero(curl, n);
  set_zero(moment, n);
  set_zero(turn, n);
}

void add_second_order(SecondOrder& sum, const Properties& p, const BeamEffects& effects, const FieldRows& row, double x, double weight) {
  add_second_order_of(sum, p, effects, row, x, weight);
}
void add_second_order(SecondOrder& sum, const Properties& p, const BeamEffects& effects, const FieldBlocks& rows, const Eigen::ArrayXd& x,
                      const Eigen::ArrayXd& weight) {
  add_second_order_of(sum, p, effects, rows, x, weight);
}

void add_part(SecondOrder& sum, const SecondOrder& part, int at) {
  const auto n = part.rate[0].rows();
  for (std::size_t a = 0; a < 3; ++a) {
    sum.rate[a].block(at, at, n, n) += part.rate[a];
    sum.curl[a].block(at, at, n, n) += part.curl[a];
    sum.moment[a].block(at, at, n, n) += part.moment[a];
    sum.turn[a].block(at, at, n, n) += part.turn[a];
  }
}

void add_part(SecondOrder& sum, const SecondOrder& part, const MatX& rows) {
  const auto add = [&](const std::array<MatX, 3>& from, std::array<MatX, 3>& to) {
    for (std::size_t a = 0; a < 3; ++a)
      if ((from[a].array() != 0.0).any()) to[a].noalias() += rows.transpose() * MatX(from[a] * rows);
  };
  add(part.rate, sum.rate), add(part.curl, sum.curl), add(part.moment, sum.moment), add(part.turn, sum.turn);
}

std::array<MatX, 3> second_order_at(const SecondOrder& sum, const FieldRows& root, double x, const Basis& Z) {
  std::array<MatX, 3> phi2;
  for (std::size_t a = 0; a < 3; ++a) {
    phi2[a] = sum.rate[a] + x * sum.curl[a] - sum.moment[a];
    if (a == 1) add_symmetric(phi2[a], root.theta, root.s, -0.5 * x);
    if (a == 2) add_symmetric(phi2[a], root.theta, root.phi_z, 0.5 * x);
    phi2[a] = congruent(phi2[a], Z);
  }
  return phi2;
}
std::array<MatX, 3> second_order_at(const SecondOrder& sum, const FieldRows& root, double x) {
  std::array<MatX, 3> phi2;
  const bool twists = !root.theta.isZero(0.0);
  for (std::size_t a = 0; a < 3; ++a) {
    if (sum.rate[a].isZero(0.0) && sum.curl[a].isZero(0.0) && !(a > 0 && twists)) continue;
    phi2[a] = sum.rate[a] + x * sum.curl[a] - sum.moment[a];
    if (a == 1 && twists) add_symmetric(phi2[a], root.theta, root.s, -0.5 * x);
    if (a == 2 && twists) add_symmetric(phi2[a], root.theta, root.phi_z, 0.5 * x);
    if (phi2[a].isZero(0.0)) phi2[a].resize(0, 0);
  }
  return phi2;
}
std::array<MatX, 3> second_turns(const SecondOrder& sum, const Basis& Z) {
  std::array<MatX, 3> psi2;
  for (std::size_t a = 0; a < 3; ++a)
    if (!sum.turn[a].isZero(0.0)) psi2[a] = congruent(sum.turn[a], Z);
  return psi2;
}
std::array<MatX, 3> second_turns(const SecondOrder& sum) {
  std::array<MatX, 3> psi2;
  for (std::size_t a = 0; a < 3; ++a)
    if (!sum.turn[a].isZero(0.0)) psi2[a] = sum.turn[a];
  return psi2;
}
FieldRows in_coordinates(const FieldRows& row, const MatX& Z) {
  FieldRows out(static_cast<int>(Z.cols()));
  const auto take = [&](const VecX& from, VecX& to) {
    if (from.squaredNorm() > 0.0) to = Z.transpose() * from;
  };
  take(row.u, out.u), take(row.du, out.du), take(row.v, out.v), take(row.dv, out.dv), take(row.phi_z, out.phi_z);
  take(row.dphi_z, out.dphi_z), take(row.w, out.w), take(row.dw, out.dw), take(row.s, out.s), take(row.ds, out.ds);
  take(row.theta, out.theta), take(row.dtheta, out.dtheta);
  return out;
}
void set_second_order(FlexibleBody& body, const Integrals& sum, const Basis& Z) { set_blocks(body, sum, Z); }
void set_second_order(FlexibleBody& body, const Integrals& sum, const MatX& Z) { set_blocks(body, sum, Z); }

MatX in_body(const MatX& m, const Basis& Z) { return congruent(m, Z); }

Vec6 rotary_inertia(const Properties& p, const BeamEffects& effects) {
  const double L = p.length;
  Vec3 across(p.inertia_y, p.inertia_z, -p.inertia_yz);  // yy, zz, yz, kg m
  if (!effects.shear) {
    const double half = 0.5 * (across[0] - across[1]), smaller = 0.5 * (across[0] + across[1]) - std::hypot(half, across[2]);
    const bool xy = effects.bending_xy && !effects.torsion, xz = effects.bending_xz && !effects.torsion;
    across.head<2>().array() -= xy == xz ? smaller : xy ? across[1] : across[0];
    // Not where a piece is hardly longer than deep.
    across.head<2>() = across.head<2>().cwiseMax(-p.mass * L * L / 24.0);
  }
  return L * (Vec6() << 0.0, across[0], across[1], 0.0, 0.0, across[2]).finished();
}

FlexibleBody linear_body(const Integrals& sum, const Properties& p, const BeamEffects& effects, const Basis& Z) {
  const double L = p.length, m = p.mass * L;
  FlexibleBody body;
  body.n = static_cast<int>(Z.cols());
  body.mass = m;
  body.md0 = Vec3(0.5 * m * L, 0.0, 0.0);
  body.J0 << (p.inertia_y + p.inertia_z) * L, m * L * L / 3.0, m * L * L / 3.0, 0.0, 0.0, 0.0;
  body.J0 += rotary_inertia(p, effects);
  body.md1 = sum.md1 * Z;
  body.J1 = sum.J1 * Z;
  body.Cr0 = sum.Cr0 * Z;
  return body;
}

namespace {

// Lagrange polynomial l of the rule's points.
double lagrange(const GaussRule& rule, std::size_t l, double x) {
  double value = 1.0;
  for (std::size_t i = 0; i < rule.x.size(); ++i)
    if (i != l) value *= (x - rule.x[i]) / (rule.x[l] - rule.x[i]);
  return value;
}

// What the sections' inertia has of first and second order; the particles are there already. c: their places times root_mass.
void set_section_inertia(const FlexibleBody& body, const Properties& p, const BeamEffects& effects, const VecX& c, AxisMass& out) {
  const Eigen::Index n = body.n, count = c.size();
  const VecX weight = out.root_mass.cwiseAbs2() / p.mass;
  if (!effects.shear && !effects.torsion) return;
  out.J1 = body.J1;
  const VecX cx = 2.0 * (out.phi.leftCols(count) * c);
  out.J1.row(1) -= cx.transpose(), out.J1.row(2) -= cx.transpose();
  out.J1.row(3) += (out.phi.middleCols(count, count) * c).transpose();
  out.J1.row(4) += (out.phi.rightCols(count) * c).transpose();
  const Mat3 section = section_tensor(p);
  const auto tilted = [&](const MatX& a, const Vec3& about_a, const MatX& b, const Vec3& about_b) {
    if (a.size() == 0 || b.size() == 0) return;
    const bool same = &a == &b;
    const MatX product = a * weight.asDiagonal() * b.transpose();
    const auto add = [&](MatX& to, double one, double other) {
      if (one == 0.0 && other == 0.0) return;
      if (to.size() == 0) to = MatX::Zero(n, n);
      to += one * product;
      if (!same) to += other * product.transpose();
    };
    const std::array<double, 6> each = tilted_tensor(section, about_a, about_b);
    for (size_t i = 0; i < each.size(); ++i) add(out.J2[i], each[i], each[i]);
    const Vec3 ab = tilted_momentum(section, about_a, about_b), ba = tilted_momentum(section, about_b, about_a);
    for (size_t i = 0; i < 3; ++i) add(out.Cr1[i], ba[static_cast<Eigen::Index>(i)], ab[static_cast<Eigen::Index>(i)]);
  };
  const MatX &in_xy = out.row[AxisMass::slope_y], &in_xz = out.row[AxisMass::slope_z], &twist = out.row[AxisMass::twist];
  tilted(twist, Vec3::UnitX(), twist, Vec3::UnitX());
  if (!effects.shear) return;
  tilted(in_xy, Vec3::UnitZ(), in_xy, Vec3::UnitZ());
  tilted(in_xz, -Vec3::UnitY(), in_xz, -Vec3::UnitY());
  tilted(in_xz, -Vec3::UnitY(), in_xy, Vec3::UnitZ());
  tilted(twist, Vec3::UnitX(), in_xy, Vec3::UnitZ());
  tilted(twist, Vec3::UnitX(), in_xz, -Vec3::UnitY());
}

}  // namespace

void set_axis_mass(FlexibleBody& body, const Properties& p, const BeamEffects& effects, const Basis& Z, const AxisPoints& particles) {
  const int panels = particles.panels, points = particles.per_panel;
  const FieldRows& root = particles.root;
  if (!effects.stiffening || effects.large_bending || !(effects.torsion || effects.complete) || !(effects.bending_xy || effects.bending_xz))
    return;
  AxisMass& out = body.axis;
  const GaussRule gauss = gauss_rule(points);
  const Eigen::Index n = body.n, k = points, count = panels * k;
  out.per_panel = points;
  out.panel = p.length / panels;
  out.x.resize(count);
  out.root_mass.resize(count);
  const double h = out.panel;

  // The interpolating polynomials' integrals, exact with the rule's own points.
  out.once = MatX::Zero(k, k + 1);
  out.twice = MatX::Zero(k, k + 1);
  for (Eigen::Index end = 0; end <= k; ++end) {
    const double to = end < k ? gauss.x[end] : 1.0;
    for (std::size_t g = 0; g < gauss.x.size(); ++g)
      for (std::size_t l = 0; l < gauss.x.size(); ++l) {
        const double at = to * gauss.x[g], f = h * to * gauss.w[g] * lagrange(gauss, l, at);
        out.once(static_cast<Eigen::Index>(l), end) += f;
        out.twice(static_cast<Eigen::Index>(l), end) += f * h * (to - at);
      }
  }

  std::array<MatX, AxisMass::fields> full;
  MatX u, v, w;
  for (MatX* m : {&u, &v, &w}) *m = MatX::Zero(Z.rows(), count);
  for (MatX& m : full) m = MatX::Zero(Z.rows(), count);
  const auto spread = [](const FieldRows& r, const auto& set) {
    set(AxisMass::stretch, r.du), set(AxisMass::slope_y, r.phi_z), set(AxisMass::slope_z, r.s), set(AxisMass::bend_y, r.dphi_z);
    set(AxisMass::bend_z, r.ds), set(AxisMass::twist, r.theta);
  };
  const double gyration = std::sqrt(p.gyration2);
  for (int e = 0; e < panels; ++e)
    for (std::size_t g = 0; g < gauss.x.size(); ++g) {
      const Eigen::Index at = e * k + static_cast<Eigen::Index>(g);
      out.x[at] = (e + gauss.x[g]) * h;
      out.root_mass[at] = std::sqrt(p.mass * gauss.w[g] * h);
      const FieldRows r = particles.rows(e, gauss.x[g]);
      u.col(at) = out.root_mass[at] * r.u, v.col(at) = out.root_mass[at] * r.v, w.col(at) = out.root_mass[at] * r.w;
      spread(r, [&](int field, const VecX& row) { full[field].col(at) = row; });
      full[AxisMass::helix].col(at) = gyration * r.dtheta;
      if (effects.shear) full[AxisMass::shear_y].col(at) = r.dv - r.phi_z, full[AxisMass::shear_z].col(at) = r.dw - r.s;
    }
  out.phi.resize(n, 3 * count);
  out.phi << Z.transpose() * u, Z.transpose() * v, Z.transpose() * w;
  for (std::size_t i = 0; i < full.size(); ++i)
    if (!full[i].isZero(0.0)) out.row[i] = Z.transpose() * full[i];
  spread(root, [&](int field, const VecX& row) {
    const size_t i = field;
    if (!root.theta.isZero(0.0) && !row.isZero(0.0) && (i == AxisMass::twist || i == AxisMass::slope_y || i == AxisMass::slope_z))
      out.root[i] = Z.transpose() * row;
  });

  // What particles at rest have is taken from the body's own constants.
  const VecX c = out.x.cwiseProduct(out.root_mass);
  out.J0 = body.J0;
  out.J0[1] -= c.squaredNorm(), out.J0[2] -= c.squaredNorm();
  out.Cr0 = body.Cr0;
  out.Cr0.row(1) += (out.phi.rightCols(count) * c).transpose();
  out.Cr0.row(2) -= (out.phi.middleCols(count, count) * c).transpose();
  out.Me = body.Me - out.phi * out.phi.transpose();
  set_section_inertia(body, p, effects, c, out);
}

namespace {

// The integrals of the interpolating polynomials of the rule's points from 0 to `to`. A polynomial's numerator is the product of the
// factors before and after its own point, so that all of them cost no more than one.
VecX integrals_to(const GaussRule& rule, double to) {
  const std::size_t n = rule.x.size();
  VecX out = VecX::Zero(static_cast<Eigen::Index>(n));
  std::vector<double> after(n + 1, 1.0);
  for (std::size_t g = 0; g < n; ++g) {
    const double x = to * rule.x[g], weight = to * rule.w[g];
    for (std::size_t l = n; l-- > 0;) after[l] = after[l + 1] * (x - rule.x[l]);
    double before = weight;
    for (std::size_t l = 0; l < n; ++l) {
      out[static_cast<Eigen::Index>(l)] += before * after[l + 1];
      before *= x - rule.x[l];
    }
  }
  for (std::size_t l = 0; l < n; ++l) {
    double own = 1.0;
    for (std::size_t i = 0; i < n; ++i)
      if (i != l) own *= rule.x[l] - rule.x[i];
    out[static_cast<Eigen::Index>(l)] /= own;
  }
  return out;
}

}  // namespace

void set_rod_axis(FlexibleBody& body, const Properties& p, const BeamEffects& effects, const Basis& Z, const AxisPoints& particles) {
  if (!effects.large_bending || body.n == 0) return;
  auto made = std::make_shared<RodAxis>();
  RodAxis& out = *made;
  const GaussRule gauss = gauss_rule(particles.per_panel);
  const Eigen::Index k = particles.per_panel, count = (particles.panels * k + 3) / 4 * 4;
  const double h = p.length / particles.panels;
  out.towards = effects.bending_xy ? 1 : 2;
  out.x = VecX::Constant(count, p.length);
  out.root_mass = VecX::Zero(count);
  MatX u = MatX::Zero(Z.rows(), count), v = u, turn = u, stretch = u, shear = u;
  for (int e = 0; e < particles.panels; ++e)
    for (std::size_t g = 0; g < gauss.x.size(); ++g) {
      const Eigen::Index at = e * k + static_cast<Eigen::Index>(g);
      const FieldRows r = particles.rows(e, gauss.x[g]);
      const double root = std::sqrt(p.mass * gauss.w[g] * h);
      out.x[at] = (e + gauss.x[g]) * h;
      out.root_mass[at] = root;
      u.col(at) = root * r.u, v.col(at) = root * (out.towards == 1 ? r.v : r.w);
      turn.col(at) = out.towards == 1 ? r.phi_z : r.s;
      stretch.col(at) = r.du;
      if (effects.shear) shear.col(at) = out.towards == 1 ? VecX(r.dv - r.phi_z) : VecX(r.dw - r.s);
    }
  const auto rows = [&](const MatX& full) { return MatX(full.transpose() * Z); };
  out.phi_x = rows(u), out.phi_v = rows(v), out.turn = rows(turn);
  if (!stretch.isZero(0.0)) out.stretch = rows(stretch);
  if (effects.shear) out.shear = rows(shear);

  // From the root to x: whole panels, and a part of one.
  const VecX whole = h * integrals_to(gauss, 1.0);
  const auto weights = [&](double x) {
    VecX to = VecX::Zero(count);
    const int panel = std::clamp(static_cast<int>(x / h), 0, particles.panels - 1);
    for (int e = 0; e < panel; ++e) to.segment(e * k, k) = whole;
    to.segment(panel * k, k) = h * integrals_to(gauss, x / h - panel);
    return to;
  };
  out.along = MatX::Zero(count, count);
  for (Eigen::Index i = 0; i < particles.panels * k; ++i) out.along.row(i) = out.root_mass[i] * weights(out.x[i]).transpose();
  for (FlexibleNode& node : body.nodes) {
    for (MatX& second : node.phi2) second.resize(0, 0);
    if (const double x = node.origin.x(); x > 0.0) node.along = weights(x);
  }

  // What particles at rest have is taken from the body's own constants.
  const VecX c = out.x.cwiseProduct(out.root_mass);
  const bool y = out.towards == 1;
  out.J0 = body.J0;
  out.J0[1] -= c.squaredNorm(), out.J0[2] -= c.squaredNorm();
  out.Cr0 = body.Cr0;
  out.Cr0.row(y ? 2 : 1) += (y ? -1.0 : 1.0) * (out.phi_v.transpose() * c).transpose();
  out.Me = body.Me - out.phi_x.transpose() * out.phi_x - out.phi_v.transpose() * out.phi_v;
  if (effects.shear) {
    out.J1 = body.J1;
    const VecX cx = 2.0 * (out.phi_x.transpose() * c);
    out.J1.row(1) -= cx.transpose(), out.J1.row(2) -= cx.transpose();
    out.J1.row(y ? 3 : 4) += (out.phi_v.transpose() * c).transpose();
    out.tilt = ((y ? p.inertia_z : p.inertia_y) / p.mass) * out.root_mass.cwiseAbs2();
    out.J1.row(y ? 3 : 4) -= (out.turn.transpose() * out.tilt).transpose();
  }
  body.rod = std::move(made);
}

MatX damping_matrix(const Damping& damping, const MatX& Me, const MatX& Ke) {
  MatX de;
  const auto n = Me.rows();
  if (n == 0) return de;
  if (damping.mass != 0.0 || damping.stiffness != 0.0) de = damping.mass * Me + damping.stiffness * Ke;
  bool any = false;
  for (const double zeta : damping.ratio) {
    if (!(zeta >= 0.0) || !std::isfinite(zeta)) throw InputError(fmt::format("damping ratio must be 0 or more, found {}", zeta));
    any = any || zeta > 0.0;
  }
  if (!any) return de;
  const GeneralizedEigen eigen(Ke, Me);
  if (eigen.info() != Eigen::Success) throw SimulationError("modal damping: the eigenvalues of the beam could not be computed");
  VecX factor(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = std::min<std::size_t>(static_cast<std::size_t>(i), damping.ratio.size() - 1);
    factor[i] = 2.0 * damping.ratio[k] * std::sqrt(std::max(0.0, eigen.eigenvalues()[i]));
  }
  const MatX mp = Me * eigen.eigenvectors();
  if (de.size() == 0) de = MatX::Zero(n, n);
  de.noalias() += mp * factor.asDiagonal() * mp.transpose();
  return de;
}

std::vector<Station> named_stations(const BeamDef& def) {
  std::vector<Station> stations = {{"root", 0.0}, {"tip", def.length}};
  for (const auto& [name, share] : def.frames) {
    if (name == "root" || name == "tip" || name.starts_with("node[") || name.starts_with("station["))
      throw InputError(fmt::format("frame name '{}' is reserved for the beam's own nodes", name));
    if (!(share >= 0.0 && share <= 1.0)) throw InputError(fmt::format("frame '{}' must lie at x/L in [0, 1], found {}", name, share));
    stations.push_back({name, share * def.length});
  }
  return stations;
}

FlexibleNode make_node(const std::string& name, double x, const FieldRows& row) {
  FlexibleNode node;
  node.name = name;
  node.origin = Vec3(x, 0.0, 0.0);
  Mat3X full(3, row.u.size());
  full.row(0) = row.u;
  full.row(1) = row.v;
  full.row(2) = row.w;
  node.phi = full;
  full.row(0) = row.theta;
  full.row(1) = -row.s;
  full.row(2) = row.phi_z;
  node.psi = full;
  return node;
}

GaussRule gauss_rule(int points) {
  GaussRule rule;
  rule.x.resize(points);
  rule.w.resize(rule.x.size());
  for (int i = 0; i < points; ++i) {
    // Newton's iteration on the Legendre polynomial, from Tricomi's estimate of its root
    double z = std::cos(std::numbers::pi * (i + 0.75) / (points + 0.5)), slope = 1.0;
    for (int step = 0; step < 20; ++step) {
      double p0 = 1.0, p1 = z;
      for (int k = 2; k <= points; ++k) {
        const double p2 = ((2.0 * k - 1.0) * z * p1 - (k - 1.0) * p0) / k;
        p0 = p1;
        p1 = p2;
      }
      slope = points * (z * p1 - p0) / (z * z - 1.0);
      const double dz = p1 / slope;
      z -= dz;
      if (std::abs(dz) < 1e-15) break;
    }
    const size_t at = points - 1 - i;
    rule.x[at] = 0.5 * (1.0 + z);
    rule.w[at] = 1.0 / ((1.0 - z * z) * slope * slope);
  }
  return rule;
}

}  // namespace flexframe::sim::beam
