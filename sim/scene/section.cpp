#include "sim/scene/section.h"

#include "sim/base/words.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <Eigen/Geometry>

namespace flexframe::sim {

namespace {

using Loop = std::vector<Eigen::Vector2d>;
using Sizes = std::map<std::string, double>;

// One way to give a shape's sizes.
struct Alternative {
  std::string shape;
  std::vector<std::string> required, optional;
};

const std::vector<Alternative>& alternatives() {
  static const std::vector<Alternative> all{
      {"circle", {"diameter"}, {}},
      {"circle", {"radius"}, {}},
      {"tube", {"outer_diameter", "thickness"}, {}},
      {"tube", {"outer_diameter", "inner_diameter"}, {}},
      {"tube", {"diameter", "thickness"}, {}},
      {"tube", {"diameter", "inner_diameter"}, {}},
      {"rectangle", {"width", "height"}, {}},
      {"rectangle", {"y", "z"}, {}},
      {"box", {"width", "height", "thickness"}, {}},
      {"box", {"width", "height", "web", "flange"}, {}},
      {"i", {"width", "height", "web", "flange"}, {}},
      {"u", {"width", "height", "web", "flange"}, {}},
      {"t", {"width", "height", "web", "flange"}, {}},
      {"l", {"width", "height", "thickness"}, {}},
      {"general", {"area", "iy", "iz", "j"}, {"iyz", "shear_y", "shear_z", "rotary_iy", "rotary_iz"}},
  };
  return all;
}

constexpr int circle_sides = 64;

// An n-gon of the circle's own area, so that drawing and numbers agree.
Loop circle_outline(double radius) {
  const double step = 2.0 * M_PI / circle_sides;
  const double r = radius * std::sqrt(step / std::sin(step));
  Loop loop;
  for (int i = 0; i < circle_sides; ++i) loop.emplace_back(r * std::cos(i * step), r * std::sin(i * step));
  return loop;
}

// y from y0 to y1, z from z0 to z1, counter-clockwise seen from +x.
struct Rectangle {
  double y0, y1, z0, z1;
  double area() const { return (y1 - y0) * (z1 - z0); }
};

// Area, moments and product of a union of rectangles that do not overlap, moved to the common centroid; returns the centroid.
Eigen::Vector2d add_rectangles(Section& section, const std::vector<Rectangle>& parts) {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  for (const Rectangle& r : parts) {
    section.area += r.area();
    centre += r.area() * Eigen::Vector2d(0.5 * (r.y0 + r.y1), 0.5 * (r.z0 + r.z1));
  }
  centre /= section.area;
  for (const Rectangle& r : parts) {
    const double b = r.y1 - r.y0, h = r.z1 - r.z0;
    const double y = 0.5 * (r.y0 + r.y1) - centre.x(), z = 0.5 * (r.z0 + r.z1) - centre.y();
    section.iy += r.area() * (h * h / 12.0 + z * z);
    section.iz += r.area() * (b * b / 12.0 + y * y);
    section.iyz += r.area() * y * z;
  }
  return centre;
}

void set_outline(Section& section, std::vector<Loop> loops, const Eigen::Vector2d& centre) {
  for (Loop& loop : loops)
    for (Eigen::Vector2d& point : loop) point -= centre;
  section.outline = std::move(loops);
}

Loop rectangle_loop(double y0, double y1, double z0, double z1) { return {{y0, z0}, {y1, z0}, {y1, z1}, {y0, z1}}; }

void need(bool fits, const char* what, double wall, double limit) {
  if (!fits) throw InputError(fmt::format("'{}' {:g} is too large for the section: it must be smaller than {:g}", what, wall, limit));
}

Section circle(const Sizes& size) {
  Section section;
  const double r = size.contains("radius") ? size.at("radius") : 0.5 * size.at("diameter");
  section.area = M_PI * r * r;
  section.iy = section.iz = 0.25 * section.area * r * r;
  section.j = 2.0 * section.iy;
  section.shear_y = section.shear_z = 6.0 / 7.0;
  section.outline = {circle_outline(r)};
  return section;
}

Section tube(const Sizes& size) {
  Section section;
  const double outer = 0.5 * (size.contains("diameter") ? size.at("diameter") : size.at("outer_diameter"));
  const bool by_wall = size.contains("thickness");
  if (by_wall) need(size.at("thickness") <= outer, "thickness", size.at("thickness"), outer);
  else need(size.at("inner_diameter") < 2.0 * outer, "inner_diameter", size.at("inner_diameter"), 2.0 * outer);
  const double inner = by_wall ? outer - size.at("thickness") : 0.5 * size.at("inner_diameter");
  const double wall = outer - inner;
  // products instead of differences of powers: thin walls keep their digits
  section.area = M_PI * wall * (outer + inner);
  section.iy = section.iz = 0.25 * section.area * (outer * outer + inner * inner);
  section.j = 2.0 * section.iy;
  // Cowper 1966, hollow circle, poisson 0
  const double m = inner / outer, n = (1.0 + m * m) * (1.0 + m * m);
  section.shear_y = section.shear_z = 6.0 * n / (7.0 * n + 20.0 * m * m);
  section.outline = {circle_outline(outer)};
  if (inner > 0.0) section.outline.push_back(circle_outline(inner));
  return section;
}

Section rectangle(const Sizes& size) {
  Section section;
  const double y = size.contains("y") ? size.at("y") : size.at("height"), z = size.contains("z") ? size.at("z") : size.at("width");
  add_rectangles(section, {{-0.5 * y, 0.5 * y, -0.5 * z, 0.5 * z}});
  section.j = rectangle_torsion_constant(y, z);
  section.shear_y = section.shear_z = 5.0 / 6.0;
  section.outline = {rectangle_loop(-0.5 * y, 0.5 * y, -0.5 * z, 0.5 * z)};
  return section;
}

// Webs stand along y at the z ends, flanges lie along z at the y ends.
Section box(const Sizes& size) {
  Section section;
  const double h = size.at("height"), b = size.at("width");
  const bool even = size.contains("thickness");
  const double web = even ? size.at("thickness") : size.at("web"), flange = even ? size.at("thickness") : size.at("flange");
  need(2.0 * web < b, even ? "thickness" : "web", web, 0.5 * b);
  need(2.0 * flange < h, even ? "thickness" : "flange", flange, 0.5 * h);
  const double yo = 0.5 * h, zo = 0.5 * b, yi = yo - flange, zi = zo - web;
  add_rectangles(section, {{-yo, -yi, -zo, zo}, {yi, yo, -zo, zo}, {-yi, yi, -zo, -zi}, {-yi, yi, zi, zo}});
  // Bredt on the walls' middle line, and the walls' own torsion as open strips
  const double hm = h - flange, bm = b - web;
  const double closed = 4.0 * hm * hm * bm * bm / (2.0 * hm / web + 2.0 * bm / flange);
  section.j = closed + 2.0 * (hm * web * web * web + bm * flange * flange * flange) / 3.0;
  section.shear_y = std::min(1.0, 2.0 * web * h / section.area);
  section.shear_z = std::min(1.0, 2.0 * flange * b / section.area);
  section.outline = {rectangle_loop(-yo, yo, -zo, zo), rectangle_loop(-yi, yi, -zi, zi)};
  return section;
}

// Strips without the overlap at the corners.
double open_torsion(const std::vector<Rectangle>& parts) {
  double j = 0.0;
  for (const Rectangle& r : parts) j += rectangle_torsion_constant(r.y1 - r.y0, r.z1 - r.z0);
  return j;
}

// I: the web at z = 0, flanges at both y ends. U: the web at the z = 0 end, flanges towards +z. T: the flange at the upper y end.
Section flanged(const std::string& shape, const Sizes& size) {
  Section section;
  const double h = size.at("height"), b = size.at("width"), web = size.at("web"), flange = size.at("flange");
  const bool tee = shape == "t", channel = shape == "u";
  need(web < b, "web", web, b);
  need((tee ? 1.0 : 2.0) * flange < h, "flange", flange, tee ? h : 0.5 * h);
  const double z0 = channel ? 0.0 : -0.5 * b, z1 = z0 + b;
  const double w0 = channel ? 0.0 : -0.5 * web, w1 = w0 + web;
  const double bottom = tee ? 0.0 : flange, top = h - flange;
  std::vector<Rectangle> parts{{bottom, top, w0, w1}, {top, h, z0, z1}};
  if (!tee) parts.push_back({0.0, flange, z0, z1});
  const Eigen::Vector2d centre = add_rectangles(section, parts);
  section.j = open_torsion(parts);
  section.shear_y = web * h / section.area;
  section.shear_z = (tee ? 1.0 : 2.0) * flange * b / section.area * 5.0 / 6.0;
  Loop loop;
  if (channel) loop = {{0, 0}, {h, 0}, {h, b}, {top, b}, {top, web}, {flange, web}, {flange, b}, {0, b}};
  else if (tee) loop = {{0, w0}, {top, w0}, {top, z0}, {h, z0}, {h, z1}, {top, z1}, {top, w1}, {0, w1}};
  else
    loop = {{0, z0}, {flange, z0}, {flange, w0}, {top, w0},    {top, z0},    {h, z0},
            {h, z1}, {top, z1},    {top, w1},    {flange, w1}, {flange, z1}, {0, z1}};
  set_outline(section, {loop}, centre);
  return section;
}

// One leg along y at the z = 0 end (height), one along z at the y = 0 end (width).
Section angle(const Sizes& size) {
  Section section;
  const double h = size.at("height"), b = size.at("width"), t = size.at("thickness");
  need(t < std::min(h, b), "thickness", t, std::min(h, b));
  const std::vector<Rectangle> parts{{t, h, 0.0, t}, {0.0, t, 0.0, b}};
  const Eigen::Vector2d centre = add_rectangles(section, parts);
  section.j = open_torsion(parts);
  section.shear_y = t * h / section.area * 5.0 / 6.0;
  section.shear_z = t * b / section.area * 5.0 / 6.0;
  set_outline(section, {{{0, 0}, {h, 0}, {h, t}, {t, t}, {t, b}, {0, b}}}, centre);
  return section;
}

Section general(const Sizes& size) {
  Section section;
  section.area = size.at("area");
  section.iy = size.at("iy");
  section.iz = size.at("iz");
  section.j = size.at("j");
  if (size.contains("iyz")) section.iyz = size.at("iyz");
  if (size.contains("shear_y")) section.shear_y = size.at("shear_y");
  if (size.contains("shear_z")) section.shear_z = size.at("shear_z");
  if ((size.contains("rotary_iy") || size.contains("rotary_iz")) && !(section.shear_y > 0.0 && section.shear_z > 0.0))
    throw InputError("'rotary_iy' and 'rotary_iz' need 'shear_y' and 'shear_z': rotary inertia comes with the effect shear");
  if (section.iyz * section.iyz > section.iy * section.iz)
    throw InputError(fmt::format("'iyz' {:g} is larger than any area with iy {:g} and iz {:g} has: iyz^2 <= iy iz", section.iyz, section.iy,
                                 section.iz));
  // the polar moment is the largest torsion constant (Saint-Venant); a hair more is rounding of given numbers
  if (section.j > (section.iy + section.iz) * 1.001)
    throw InputError(fmt::format("'j' {:g} is larger than the polar moment iy + iz = {:g}, which no section exceeds", section.j,
                                 section.iy + section.iz));
  return section;
}

// iy, iz, iyz of axes turned about x by an angle of this cosine and sine, y' = c y - s z, z' = s y + c z, in place.
void turn_moments(double& iy, double& iz, double& iyz, double c, double s) {
  const double y = iy, z = iz, yz = iyz;
  iy = s * s * z + 2.0 * s * c * yz + c * c * y;
  iz = c * c * z - 2.0 * s * c * yz + s * s * y;
  iyz = s * c * (z - y) + (c * c - s * s) * yz;
}

// Turned about x, from y towards z.
void turn_section(Section& section, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  turn_moments(section.iy, section.iz, section.iyz, c, s);
  if (section.shear_y > 0.0 && section.shear_z > 0.0) {
    const double fy = 1.0 / section.shear_y, fz = 1.0 / section.shear_z;
    section.shear_y = 1.0 / (c * c * fy + s * s * fz);
    section.shear_z = 1.0 / (s * s * fy + c * c * fz);
    section.shear_yz = s * c * (fy - fz);
    if (std::abs(section.shear_yz) < 1e-12 * (fy + fz)) section.shear_yz = 0.0;
  }
  for (Loop& loop : section.outline)
    for (Eigen::Vector2d& p : loop) p = Eigen::Vector2d(c * p.x() - s * p.y(), s * p.x() + c * p.y());
}

bool fits(const Alternative& alternative, const Sizes& sizes) {
  for (const std::string& name : alternative.required)
    if (!sizes.contains(name)) return false;
  for (const auto& entry : sizes)
    if (entry.first != section_angle &&
        std::find(alternative.required.begin(), alternative.required.end(), entry.first) == alternative.required.end() &&
        std::find(alternative.optional.begin(), alternative.optional.end(), entry.first) == alternative.optional.end())
      return false;
  return true;
}

std::string allowed_sizes(const std::string& shape) {
  std::string text;
  for (const Alternative& alternative : alternatives())
    if (alternative.shape == shape) text += (text.empty() ? "" : " or ") + fmt::format("{{{}}}", list_words(alternative.required));
  return text;
}

}  // namespace

std::span<const std::string> section_shapes() {
  static const std::array<std::string, 9> shapes{"circle", "tube", "rectangle", "box", "i", "u", "t", "l", "general"};
  return shapes;
}

std::vector<std::string> section_sizes(const std::string& shape) {
  std::vector<std::string> names;
  for (const Alternative& alternative : alternatives())
    if (alternative.shape == shape)
      for (const auto& list : {alternative.required, alternative.optional})
        for (const std::string& name : list)
          if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  return names;
}

Section make_section(const std::string& shape, const Sizes& sizes) {
  const auto shapes = section_shapes();
  if (std::find(shapes.begin(), shapes.end(), shape) == shapes.end())
    throw InputError(fmt::format("the shape {} is unknown{}; allowed: {}", quote(shape),
                                 did_you_mean(shape, std::vector(shapes.begin(), shapes.end())),
                                 list_words(std::vector(shapes.begin(), shapes.end()))));
  for (const auto& [name, size] : sizes)
    if (!std::isfinite(size) || (name != "iyz" && name != section_angle && !(size > 0.0)))
      throw InputError(fmt::format("{} must be a number > 0, found {}", quote(name), size));
  const auto& all = alternatives();
  if (std::none_of(all.begin(), all.end(), [&](const Alternative& a) { return a.shape == shape && fits(a, sizes); })) {
    std::vector<std::string> given;
    for (const auto& entry : sizes) given.push_back(entry.first);
    throw InputError(fmt::format("a section of shape '{}' needs {}; found {{{}}}", shape, allowed_sizes(shape), list_words(given)));
  }

  Section section = shape == "circle"      ? circle(sizes)
                    : shape == "tube"      ? tube(sizes)
                    : shape == "rectangle" ? rectangle(sizes)
                    : shape == "box"       ? box(sizes)
                    : shape == "l"         ? angle(sizes)
                    : shape == "general"   ? general(sizes)
                                           : flanged(shape, sizes);
  section.shape = shape;
  section.size = sizes;
  // extreme sizes overflow or vanish in the fourth power
  for (const double number : {section.area, section.iy, section.iz, section.j})
    if (!(number > 0.0) || !std::isfinite(number))
      throw InputError("the section's sizes are too large or too small for its moments to be numbers");
  if (const auto angle = sizes.find(section_angle); angle != sizes.end()) turn_section(section, angle->second);
  return section;
}

bool has_rotary(const Section& section) { return section.size.contains("rotary_iy") || section.size.contains("rotary_iz"); }

Vec3 mass_moments(const Section& section) {
  Vec3 out(section.iy, section.iz, section.iyz);
  if (!has_rotary(section)) return out;
  const auto size = [&](const char* name, const char* instead) { return section.size.at(section.size.contains(name) ? name : instead); };
  // With moments of its own the mass has its principal axes along those of the section as it is given.
  out = Vec3(size("rotary_iy", "iy"), size("rotary_iz", "iz"), 0.0);
  if (const auto angle = section.size.find(section_angle); angle != section.size.end())
    turn_moments(out[0], out[1], out[2], std::cos(angle->second), std::sin(angle->second));
  return out;
}

Eigen::Vector2d shear_centre(const Section& section) {
  Eigen::Vector2d out = Eigen::Vector2d::Zero();
  if (section.shape != "u" && section.shape != "t" && section.shape != "l") return out;
  const auto size = [&](const char* name) { return section.size.at(name); };
  const double h = size("height"), b = size("width");
  // From the corner at y = z = 0 (T: from the web's foot, in its middle), as the sections are put together.
  std::vector<Rectangle> parts;
  if (section.shape == "l") {
    const double t = size("thickness");
    parts = {{t, h, 0.0, t}, {0.0, t, 0.0, b}};
    out = {0.5 * t, 0.5 * t};
  } else if (section.shape == "t") {
    const double web = size("web"), flange = size("flange");
    parts = {{0.0, h - flange, -0.5 * web, 0.5 * web}, {h - flange, h, -0.5 * b, 0.5 * b}};
    out = {h - 0.5 * flange, 0.0};
  } else {
    const double web = size("web"), flange = size("flange"), wide = b - 0.5 * web, high = h - flange;
    parts = {{flange, h - flange, 0.0, web}, {h - flange, h, 0.0, b}, {0.0, flange, 0.0, b}};
    out = {0.5 * h, 0.5 * web - 3.0 * wide * wide * flange / (6.0 * wide * flange + high * web)};
  }
  Section whole;
  out -= add_rectangles(whole, parts);
  const auto angle = section.size.find(section_angle);
  return angle == section.size.end() ? out : Eigen::Vector2d(Eigen::Rotation2Dd(angle->second) * out);
}

double rectangle_torsion_constant(double a, double b) {
  const double wide = std::max(a, b), thin = std::min(a, b);
  // Timoshenko, Goodier art. 109: J = a b^3 (1/3 - 64/pi^5 b/a sum tanh(n pi a / 2b) / n^5, n odd); what tanh lacks to 1 falls off
  // exponentially, and the sum of 1/n^5 over odd n is 31/32 zeta(5)
  constexpr double zeta5 = 1.0369277551433699263;
  double sum = 31.0 / 32.0 * zeta5;
  for (int n = 1; n < 40; n += 2) {
    const double x = std::exp(-n * M_PI * wide / thin);
    const double lacking = 2.0 * x / (1.0 + x);
    if (lacking == 0.0) break;
    sum -= lacking / std::pow(n, 5);
  }
  return wide * thin * thin * thin * (1.0 / 3.0 - 64.0 / std::pow(M_PI, 5) * thin / wide * sum);
}

}  // namespace flexframe::sim
