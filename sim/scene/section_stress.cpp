#include "sim/scene/section_stress.h"

#include "sim/scene/section.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace flexframe::sim {
namespace {

// A rectangle of the section, m from the centroid.
struct Strip {
  double y0, y1, z0, z1;
};

// Of a rectangle with the half sides a <= b, at (u, v) from its centre: derivative of Prandtl's function along v, and against u.
Eigen::Vector2d prandtl_slopes(double a, double b, double u, double v) {
  // At a corner the terms fall off with 1/n^2 only: what is left after n is 1/(2n) of the whole.
  constexpr int last = 999;
  const double k = 0.5 * std::numbers::pi / a;
  // Powers of these are cos(n k u), sin(n k u) and the parts of cosh(n k v) / cosh(n k b) and sinh(n k v) / cosh(n k b), without overflow.
  double c = std::cos(k * u), s = std::sin(k * u);
  double share = std::exp(k * (std::abs(v) - b)), near = std::exp(-2.0 * k * std::abs(v)), far = std::exp(-2.0 * k * b);
  const double c2 = c * c - s * s, s2 = 2.0 * c * s, share2 = share * share, near2 = near * near, far2 = far * far;
  double along = 0.0, against = 0.0, sign = 1.0;
  for (int n = 1; n <= last; n += 2, sign = -sign) {
    const double term = sign / (n * n) * share / (1.0 + far);
    along += term * (1.0 - near) * c;
    against += term * (1.0 + near) * s;
    share *= share2;
    if (share < 0.1 * std::numeric_limits<double>::epsilon()) break;
    const double turned = c * c2 - s * s2;
    s = s * c2 + c * s2, c = turned;
    near = near < 1e-30 ? 0.0 : near * near2;
    far = far < 1e-30 ? 0.0 : far * far2;
  }
  const double unit = 16.0 * a / (std::numbers::pi * std::numbers::pi);
  return {-unit * (v < 0.0 ? -along : along), 2.0 * u - unit * against};
}

Eigen::Vector2d strip_shear(const Strip& s, double y, double z) {
  const double a = 0.5 * (s.y1 - s.y0), b = 0.5 * (s.z1 - s.z0);
  const double u = std::clamp(y - 0.5 * (s.y0 + s.y1), -a, a), v = std::clamp(z - 0.5 * (s.z0 + s.z1), -b, b);
  if (a <= b) return prandtl_slopes(a, b, u, v);
  const Eigen::Vector2d turned = prandtl_slopes(b, a, v, u);  // y and z change places, and the sense of rotation with them
  return {-turned[1], -turned[0]};
}

double outside(const Strip& s, double y, double z) {
  return std::hypot(std::max({s.y0 - y, y - s.y1, 0.0}), std::max({s.z0 - z, z - s.z1, 0.0}));
}

// Strips of an open section as section.cpp puts it together, from the centroid.
std::vector<Strip> strips_of(const Section& section) {
  const auto size = [&](const char* name) { return section.size.at(name); };
  std::vector<Strip> out;
  if (section.shape == "rectangle") {
    const double y = section.size.contains("y") ? size("y") : size("height"), z = section.size.contains("z") ? size("z") : size("width");
    return {{-0.5 * y, 0.5 * y, -0.5 * z, 0.5 * z}};
  }
  const double h = size("height"), b = size("width");
  if (section.shape == "l") {
    const double t = size("thickness");
    out = {{0.0, h, 0.0, t}, {0.0, t, 0.0, b}};
  } else {
    const double web = size("web"), flange = size("flange");
    const bool tee = section.shape == "t", channel = section.shape == "u";
    const double z0 = channel ? 0.0 : -0.5 * b, w0 = channel ? 0.0 : -0.5 * web;
    out = {{tee ? 0.0 : flange, h - flange, w0, w0 + web}, {h - flange, h, z0, z0 + b}};
    if (!tee) out.push_back({0.0, flange, z0, z0 + b});
  }
  // The outline stands about the centroid: its lowest corner says where these are.
  double y0 = out.front().y0, z0 = out.front().z0;
  for (const Strip& s : out) y0 = std::min(y0, s.y0), z0 = std::min(z0, s.z0);
  double oy = section.outline.front().front().x(), oz = section.outline.front().front().y();
  for (const Eigen::Vector2d& p : section.outline.front()) oy = std::min(oy, p.x()), oz = std::min(oz, p.y());
  for (Strip& s : out) s = {s.y0 - y0 + oy, s.y1 - y0 + oy, s.z0 - z0 + oz, s.z1 - z0 + oz};
  return out;
}

// Height, width, thickness of webs and flanges of a box.
std::array<double, 4> box_sizes(const Section& section) {
  const auto size = [&](const char* name) { return section.size.at(name); };
  const bool even = section.size.contains("thickness");
  return {size("height"), size("width"), size(even ? "thickness" : "web"), size(even ? "thickness" : "flange")};
}

// Closed cell: T / (2 Am t), the same all through the wall.
Eigen::Vector2d box_shear(const Section& section, double y, double z) {
  const auto [h, b, web, flange] = box_sizes(section);
  const double flow = section.j / (2.0 * (h - flange) * (b - web));
  const double cy = std::clamp(y, -0.5 * h, 0.5 * h), cz = std::clamp(z, -0.5 * b, 0.5 * b), tiny = 1e-9 * (h + b);
  // Webs at the ends of z carry tau_xy, flanges at the ends of y tau_xz; at a corner the thinner one counts.
  const bool on_web = std::abs(cz) >= 0.5 * b - web - tiny, on_flange = std::abs(cy) >= 0.5 * h - flange - tiny;
  if (on_web && (!on_flange || web <= flange)) return {-std::copysign(flow / web, cz), 0.0};
  return on_flange ? Eigen::Vector2d(0.0, std::copysign(flow / flange, cy)) : Eigen::Vector2d(0.0, 0.0);
}

// int y dA and int z dA of a rectangle.
Eigen::Vector2d moments_of(const Strip& s) {
  const double area = std::max(0.0, s.y1 - s.y0) * std::max(0.0, s.z1 - s.z0);
  return {0.5 * (s.y0 + s.y1) * area, 0.5 * (s.z0 + s.z1) * area};
}

// Cut across a wall of thickness t: a row of force_shear from the moments of what lies beyond it, upwards of the cut or downwards.
Eigen::RowVector2d across_wall(const Eigen::Vector2d& beyond, double t, bool upwards) {
  return (upwards ? -1.0 : 1.0) / t * beyond.transpose();
}

// A web goes on at both ends in I and U and carries what lies above the cut; other walls end freely on the side that is cut off.
Eigen::Matrix2d open_wall_shear(const Section& section, double y, double z) {
  const std::vector<Strip> strips = strips_of(section);
  size_t at = 0;
  for (size_t i = 1; i < strips.size(); ++i)
    if (outside(strips[i], y, z) < outside(strips[at], y, z)) at = i;
  const Strip& s = strips[at];
  y = std::clamp(y, s.y0, s.y1), z = std::clamp(z, s.z0, s.z1);
  Eigen::Matrix2d out = Eigen::Matrix2d::Zero();
  if (section.shape == "rectangle") {
    out.row(0) = across_wall(moments_of({y, s.y1, s.z0, s.z1}), s.z1 - s.z0, true);
    out.row(1) = across_wall(moments_of({s.y0, s.y1, z, s.z1}), s.y1 - s.y0, true);
    return out;
  }
  if (at == 0) {  // the web: strips_of names it first
    const bool upwards = section.shape != "t";
    Eigen::Vector2d beyond = moments_of(upwards ? Strip{y, s.y1, s.z0, s.z1} : Strip{s.y0, y, s.z0, s.z1});
    if (section.shape == "i" || section.shape == "u") beyond += moments_of(strips[1]);
    out.row(0) = across_wall(beyond, s.z1 - s.z0, upwards);
    return out;
  }
  const Strip& web = strips.front();
  const bool upwards = section.shape == "u" || section.shape == "l" || z >= 0.5 * (web.z0 + web.z1);
  // Within the junction the flow turns into the web: that at its face.
  z = upwards ? std::max(z, web.z1) : std::min(z, web.z0);
  out.row(1) = across_wall(moments_of(upwards ? Strip{s.y0, s.y1, z, s.z1} : Strip{s.y0, s.y1, s.z0, z}), s.y1 - s.y0, upwards);
  return out;
}

// Half the height H and the width B of a box whose walls along the force are `side` thick and those across it `top`, at p along the force
// and r across it: what the walls there carry, along and across. The plane of the force parts the box in halves, where nothing flows.
Eigen::Vector2d half_box_shear(double H, double B, double side, double top, double p, double r) {
  const double tiny = 1e-9 * (H + B), inner = 0.5 * H - top, middle = 0.5 * (H - top);
  const bool on_side = std::abs(r) >= 0.5 * B - side - tiny, on_top = std::abs(p) >= inner - tiny;
  const double walls = std::abs(p) < inner ? side * (inner * inner - p * p) : 0.0;
  const double along = -0.5 * (B * top * middle + walls) / side, across = std::copysign(middle, p) * r;
  if (on_side && (!on_top || std::abs(along) >= std::abs(across))) return {along, 0.0};
  return on_top ? Eigen::Vector2d(0.0, across) : Eigen::Vector2d(0.0, 0.0);
}

Eigen::Matrix2d box_wall_shear(const Section& section, double y, double z) {
  const auto [h, b, web, flange] = box_sizes(section);
  y = std::clamp(y, -0.5 * h, 0.5 * h), z = std::clamp(z, -0.5 * b, 0.5 * b);
  Eigen::Matrix2d out;
  out.col(0) = half_box_shear(h, b, web, flange, y, z);
  out.col(1) = half_box_shear(b, h, flange, web, z, y).reverse();
  return out;
}

// Of the circle that a ring of the outline stands for: the polygon has its area.
double radius_of(const std::vector<Eigen::Vector2d>& ring) {
  double twice_area = 0.0;
  for (size_t k = 0; k < ring.size(); ++k) {
    const Eigen::Vector2d &p = ring[k], &q = ring[(k + 1) % ring.size()];
    twice_area += p.x() * q.y() - q.x() * p.y();
  }
  return std::sqrt(0.5 * std::abs(twice_area) / std::numbers::pi);
}

// Saint-Venant's flexure of a ring, exact: of a force along p, at p along it and r across it, tau along p is
//   -E v''' / (8 (1 + nu)) (a (R^2 + i^2 - p^2) - b r^2 + a R^2 i^2 (r^2 - p^2) / rho^4)
// and across it E v''' / (8 (1 + nu)) (c p r + 2 a R^2 i^2 p r / rho^4), with a = 3 + 2 nu, b = 1 - 2 nu, c = 2 + 4 nu and the hole's
// radius i. No stress leaves through either rim; divergence and curl are those of the solid circle (Love, Mathematical Theory of
// Elasticity, art. 231).
Eigen::Matrix2d round_shear(const Section& section, double y, double z, double poisson) {
  const auto [outer, inner] = section_radii(section);
  const double rho = std::hypot(y, z);
  if (rho == 0.0 && inner > 0.0) return Eigen::Matrix2d::Zero();
  // What lies beside the ring belongs to its rim.
  if (rho > 0.0) {
    const double to = std::clamp(rho, inner, outer) / rho;
    y *= to, z *= to;
  }
  const double a = 3.0 + 2.0 * poisson, b = 1.0 - 2.0 * poisson, c = 2.0 + 4.0 * poisson, R2 = outer * outer, i2 = inner * inner;
  const double r4 = std::pow(y * y + z * z, 2), hole = inner > 0.0 ? a * R2 * i2 / r4 : 0.0;
  const auto along = [&](double p, double r) { return a * (R2 + i2 - p * p) - b * r * r + hole * (r * r - p * p); };
  const double across = -(c + 2.0 * hole) * y * z;
  Eigen::Matrix2d out;
  out << along(y, z), across, across, along(z, y);
  return -out / (8.0 * (1.0 + poisson));
}

// Corners and sides of the polygon that draws a rim lie beside it: on the rim itself.
Eigen::Vector2d on_rim(const Section& section, const Eigen::Vector2d& p) {
  constexpr double rounding = 1e-6;  // of meshes in single precision
  const double rho = p.norm();
  for (const std::vector<Eigen::Vector2d>& ring : section.outline) {
    const double corner = ring.front().norm(), side = (0.5 * (ring[0] + ring[1])).norm();
    if (rho >= side * (1.0 - rounding) && rho <= corner * (1.0 + rounding)) return radius_of(ring) / rho * p;
  }
  return p;
}

}  // namespace

bool is_round(const Section& section) { return section.shape == "circle" || section.shape == "tube"; }

SectionRadii section_radii(const Section& section) {
  return {radius_of(section.outline.front()), section.outline.size() > 1 ? radius_of(section.outline[1]) : 0.0};
}

bool has_stress(const Section& section) { return !section.outline.empty() && section.shape != "general"; }

Eigen::Vector2d torsion_shear(const Section& section, double y, double z) {
  if (is_round(section)) return {-z, y};
  if (section.shape == "box") return box_shear(section, y, z);
  const std::vector<Strip> strips = strips_of(section);
  double nearest = outside(strips.front(), y, z);
  for (const Strip& s : strips) nearest = std::min(nearest, outside(s, y, z));
  Eigen::Vector2d best = Eigen::Vector2d::Zero();
  const double tiny = 1e-9 * std::sqrt(section.area);
  for (const Strip& s : strips) {
    if (outside(s, y, z) > nearest + tiny) continue;
    const Eigen::Vector2d shear = strip_shear(s, y, z);
    if (shear.norm() > best.norm()) best = shear;
  }
  return best;
}

Eigen::Matrix2d force_shear(const Section& section, double y, double z, double poisson) {
  if (is_round(section)) return round_shear(section, y, z, poisson);
  return section.shape == "box" ? box_wall_shear(section, y, z) : open_wall_shear(section, y, z);
}

SectionPoint section_point(const Section& section, double y, double z, double poisson) {
  if (const auto angle = section.size.find(section_angle); angle != section.size.end()) {
    // In the section's own axes, turned back.
    std::map<std::string, double> sizes = section.size;
    sizes.erase(section_angle);
    const Eigen::Vector2d own = Eigen::Rotation2Dd(-angle->second) * Eigen::Vector2d(y, z);
    return turned(section_point(make_section(section.shape, sizes), own.x(), own.y(), poisson), angle->second);
  }
  if (is_round(section)) {
    const Eigen::Vector2d rim = on_rim(section, {y, z});
    y = rim.x(), z = rim.y();
  }
  return {y, z, torsion_shear(section, y, z), force_shear(section, y, z, poisson)};
}

SectionPoint turned(const SectionPoint& point, double angle) {
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(angle).toRotationMatrix();
  const Eigen::Vector2d place = turn * Eigen::Vector2d(point.y, point.z);
  return {place.x(), place.y(), turn * point.torsion, turn * point.force * turn.transpose()};
}

SectionStress stress_at(const SectionStrains& e, const Eigen::Vector2d& bend_rates, double youngs_modulus, double shear_modulus,
                        const SectionPoint& at) {
  const Eigen::Vector2d tau = shear_modulus * e[3] * at.torsion + youngs_modulus * (at.force * bend_rates);
  return {youngs_modulus * (e[0] - at.y * e[1] - at.z * e[2]), tau.norm()};
}

double section_von_mises(const SectionStrains& e, const Eigen::Vector2d& bend_rates, double youngs_modulus, double shear_modulus,
                         const SectionPoint& at) {
  const SectionStress s = stress_at(e, bend_rates, youngs_modulus, shear_modulus, at);
  return std::sqrt(s.normal * s.normal + 3.0 * s.shear * s.shear);
}

}  // namespace flexframe::sim
