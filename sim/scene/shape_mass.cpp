#include "sim/scene/shape_mass.h"

#include <cmath>
#include <numbers>

namespace flexframe::sim {
namespace {

using std::numbers::pi;

// Mass and int x^2, y^2, z^2 dm about the solid's own centre and axes.
struct Own {
  double mass = 0.0;
  Vec3 squares = Vec3::Zero();
};

Own box(const Vec3& size, double density) {
  const double m = density * size.prod();
  return {m, m / 12.0 * size.cwiseAbs2()};
}

Own cylinder(double radius, double length, double density) {
  const double m = density * pi * radius * radius * length;
  return {m, m * Vec3(radius * radius / 4.0, radius * radius / 4.0, length * length / 12.0)};
}

Own without(const Own& outer, const Own& inner) { return {outer.mass - inner.mass, outer.squares - inner.squares}; }

Own capsule(double r, double length, double density) {
  Own out = cylinder(r, length, density);
  // Two half balls on its ends; the centre of mass of each 3/8 r beyond.
  const double m = density * 4.0 / 3.0 * pi * r * r * r, half = 0.5 * length;
  out.mass += m;
  out.squares += m * Vec3(r * r / 5.0, r * r / 5.0, r * r / 5.0 + half * half + 0.75 * half * r);
  return out;
}

// A rectangle between the centres of the eyes, a half disc beyond each, less the holes; z from eye to eye, x along the holes.
Own link(const ShapeDef& s, double density) {
  const double r = 0.5 * s.width, h = 0.5 * s.hole, l = s.length, half = 0.5 * l;
  const double disc = pi * r * r, bore = pi * h * h;
  const double area = l * s.width + disc - 2.0 * bore;
  const double yy = l * std::pow(s.width, 3) / 12.0 + disc * r * r / 4.0 - 2.0 * bore * h * h / 4.0;
  const double zz = s.width * std::pow(l, 3) / 12.0 + disc * (half * half + 2.0 * half * 4.0 * r / (3.0 * pi) + r * r / 4.0) -
                    2.0 * bore * (half * half + h * h / 4.0);
  const double per_area = density * s.thickness;
  return {per_area * area, per_area * Vec3(area * s.thickness * s.thickness / 12.0, yy, zz)};
}

Own spring(const ShapeDef& s, double density) {
  const double m = density * pi * s.wire * s.wire * std::hypot(2.0 * pi * s.radius * s.turns, s.length);
  return {m, m * Vec3(s.radius * s.radius / 2.0, s.radius * s.radius / 2.0, s.length * s.length / 12.0)};
}

Own own_moments(const ShapeDef& s, double density) {
  switch (s.kind) {
    case ShapeKind::box:
    case ShapeKind::plate:
      return box(s.size, density);
    case ShapeKind::cylinder:
    case ShapeKind::disc:
    case ShapeKind::gear:
      return without(cylinder(s.radius, s.length, density), cylinder(s.inner_radius, s.length, density));
    case ShapeKind::capsule:
      return capsule(s.radius, s.length, density);
    case ShapeKind::sphere:
      return capsule(s.radius, 0.0, density);
    case ShapeKind::link:
      return link(s, density);
    case ShapeKind::spring:
      return spring(s, density);
  }
  return {};
}

}  // namespace

MassMoments shape_moments(const ShapeDef& shape, double density) {
  const Own own = own_moments(shape, density);
  MassMoments out;
  out.mass = own.mass;
  out.first = own.mass * shape.position;
  out.second = shape.axes * own.squares.asDiagonal() * shape.axes.transpose() + own.mass * shape.position * shape.position.transpose();
  return out;
}

MassMoments sum_of_shapes(std::span<const ShapeDef> shapes) {
  MassMoments sum;
  for (const ShapeDef& shape : shapes) {
    const MassMoments one = shape_moments(shape, shape.density);
    sum.mass += one.mass;
    sum.first += one.first;
    sum.second += one.second;
  }
  return sum;
}

Vec6 central_inertia(const MassMoments& moments) {
  Mat3 s = moments.second;
  if (moments.mass > 0.0) s -= moments.first * moments.first.transpose() / moments.mass;
  Vec6 out;
  out << s(1, 1) + s(2, 2), s(0, 0) + s(2, 2), s(0, 0) + s(1, 1), -s(0, 1), -s(0, 2), -s(1, 2);
  return out;
}

}  // namespace flexframe::sim
