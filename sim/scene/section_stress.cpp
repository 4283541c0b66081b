#include "sim/scene/section_stress.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace flexframe::sim {
namespace {

// A rectangle of the section, m from the centroid.
struct Strip {
  double y0, y1, z0, z1;
};

// cosh(a) / cosh(b) and sinh(a) / cosh(b) for |a| <= b without overflow.
double cosh_ratio(double a, double b) {
  return std::exp(std::abs(a) - b) * (1.0 + std::exp(-2.0 * std::abs(a))) / (1.0 + std::exp(-2.0 * b));
}
double sinh_ratio(double a, double b) {
  return std::copysign(std::exp(std::abs(a) - b) * (1.0 - std::exp(-2.0 * std::abs(a))) / (1.0 + std::exp(-2.0 * b)), a);
}

// Of a rectangle with the half sides a <= b, at (u, v) from its centre: derivative of Prandtl's function along v, and against u.
Eigen::Vector2d prandtl_slopes(double a, double b, double u, double v) {
  // At a corner the terms fall off with 1/n^2 only: what is left after n is 1/(2n) of the whole.
  constexpr int last = 999;
  const double k = 0.5 * std::numbers::pi / a;
  double along = 0.0, against = 0.0, sign = 1.0;
  for (int n = 1; n <= last; n += 2, sign = -sign) {
    along += sign / (n * n) * sinh_ratio(n * k * v, n * k * b) * std::cos(n * k * u);
    against += sign / (n * n) * cosh_ratio(n * k * v, n * k * b) * std::sin(n * k * u);
  }
  const double c = 16.0 * a / (std::numbers::pi * std::numbers::pi);
  return {-c * along, 2.0 * u - c * against};
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

// Closed cell: T / (2 Am t), the same all through the wall.
Eigen::Vector2d box_shear(const Section& section, double y, double z) {
  const auto size = [&](const char* name) { return section.size.at(name); };
  const bool even = section.size.contains("thickness");
  const double h = size("height"), b = size("width"), web = even ? size("thickness") : size("web"),
               flange = even ? size("thickness") : size("flange");
  const double flow = section.j / (2.0 * (h - flange) * (b - web));
  const double cy = std::clamp(y, -0.5 * h, 0.5 * h), cz = std::clamp(z, -0.5 * b, 0.5 * b), tiny = 1e-9 * (h + b);
  // Webs at the ends of z carry tau_xy, flanges at the ends of y tau_xz; at a corner the thinner one counts.
  const bool on_web = std::abs(cz) >= 0.5 * b - web - tiny, on_flange = std::abs(cy) >= 0.5 * h - flange - tiny;
  if (on_web && (!on_flange || web <= flange)) return {-std::copysign(flow / web, cz), 0.0};
  return on_flange ? Eigen::Vector2d(0.0, std::copysign(flow / flange, cy)) : Eigen::Vector2d(0.0, 0.0);
}

}  // namespace

bool has_stress(const Section& section) { return !section.outline.empty() && section.shape != "general"; }

Eigen::Vector2d torsion_shear(const Section& section, double y, double z) {
  if (section.shape == "circle" || section.shape == "tube") return {-z, y};
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

double section_von_mises(const SectionStrains& e, double youngs_modulus, double shear_modulus, double y, double z, double s) {
  const double sigma = youngs_modulus * (e[0] - y * e[1] - z * e[2]), tau = shear_modulus * e[3] * s;
  return std::sqrt(sigma * sigma + 3.0 * tau * tau);
}

}  // namespace flexframe::sim
