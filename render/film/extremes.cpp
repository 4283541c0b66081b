#include "render/film/extremes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace flexframe::film {
namespace {

// How many decimals a value's label has: to a thousandth of the colours' range, below which it is rounding; -1: three digits, where
// colours are logarithmic.
int value_decimals(double value, const render::ScalarMap& map, double factor) {
  const double range = std::abs(map.upper - map.lower) * factor;
  if (map.logarithmic || !(range > 0.0) || std::abs(value * factor) > 1e3 * range) return -1;
  return std::clamp(2 - static_cast<int>(std::floor(std::log10(range) + 1e-9)), 0, 12);
}

std::string value_text(double value, const render::ScalarMap& map, double factor) {
  const int decimals = value_decimals(value, map, factor);
  const double size = std::abs(value * factor);
  if (decimals < 0) return size >= 999.5 && size < 1e6 ? fmt::format("{:.0f}", value * factor) : fmt::format("{:.3g}", value * factor);
  const std::string text = fmt::format("{:.{}f}", value * factor, decimals);
  return text[0] == '-' && text.find_first_not_of("-0.") == std::string::npos ? text.substr(1) : text;
}

// A point of a body's surface that has the largest or the smallest value.
struct Extreme {
  std::size_t body = 0;
  glm::vec3 point{0.0f};  // in the body's frame
  double value = 0.0, away = 0.0;
  bool faces = false, found = false;
};

class Extremes {
 public:
  Extremes(const Animation& animation, const SamplePlace& place, const PictureMemory& memory)
      : animation_(animation), place_(place), memory_(memory) {}

  // Of points that have the extreme value but for rounding, as its label says it, the one nearest to the viewer of those whose side he
  // sees: where one is seen, it is that.
  bool find(Extreme& low, Extreme& high) {
    bool found = false;
    double least = 0.0, most = 0.0;
    for_each_value([&](std::size_t, const glm::vec3&, const glm::vec3&, double value) {
      if (!found || value > most) most = value;
      if (!found || value < least) least = value;
      found = true;
    });
    if (!found) return false;
    const double near = 5e-4 * (most - least);
    const auto alike = [&](double value, double extreme) {
      if (std::abs(value - extreme) <= near) return true;
      const double factor = animation_.scalar_bar->factor;
      const int decimals = value_decimals(extreme, animation_.scalar_map, factor);
      const double last = factor * std::pow(10.0, decimals);
      return decimals >= 0 && std::nearbyint(last * value) == std::nearbyint(last * extreme);
    };
    for_each_value([&](std::size_t b, const glm::vec3& point, const glm::vec3& normal, double value) {
      if (alike(value, most)) offer(b, point, normal, most, high);
      if (alike(value, least)) offer(b, point, normal, least, low);
    });
    return true;
  }

 private:
  void offer(std::size_t b, const glm::vec3& point, const glm::vec3& normal, double value, Extreme& best) const {
    const glm::dmat4 pose = body_pose(animation_.results->bodies[b], place_);
    const glm::dvec3 way = memory_.picture.camera.position - glm::dvec3(pose * glm::dvec4(point, 1.0));
    const double away = glm::length(way);
    const bool faces = glm::dot(glm::dmat3(pose) * glm::dvec3(normal), way) > 0.05 * away;
    if (best.found && (best.faces > faces || (best.faces == faces && away >= best.away))) return;
    best = {b, point, value, away, faces, true};
  }

  // visit(body, point, normal, value) of all corners, and of the smallest values between them where faces are coarse: a turning disc stands
  // still at its middle, where it has no corner.
  template <class Visit>
  void for_each_value(Visit visit) const {
    for (std::size_t b = 0; b < memory_.scalars.size(); ++b) {
      if (memory_.scalars[b].empty()) continue;
      const PictureMemory::Skin& skin = memory_.skins[memory_.solid[b]];
      for (std::size_t p = 0; p < memory_.scalars[b].size(); ++p)
        if (const float value = memory_.scalars[b][p]; std::isfinite(value))
          visit(b, skin.positions[p], skin.normals[p], static_cast<double>(value));
      if (memory_.vectors[b].empty()) continue;
      for (const glm::uvec3& t : animation_.bodies[b].triangles) {
        const LeastWithin least = least_within({components(b, t.x), components(b, t.y), components(b, t.z)});
        if (!std::isfinite(least.length)) continue;
        const glm::vec3 shares(least.shares[0], least.shares[1], least.shares[2]);
        const auto between = [&](const std::vector<glm::vec3>& of) { return shares.x * of[t.x] + shares.y * of[t.y] + shares.z * of[t.z]; };
        visit(b, between(skin.positions), between(skin.normals), least.length);
      }
    }
  }

  // Whose length the scalar is: a vector's, or of stress what von Mises makes of it.
  std::array<double, 6> components(std::size_t b, unsigned p) const {
    const glm::dvec3 v(memory_.vectors[b][p]);
    if (memory_.shears[b].empty()) return {v.x, v.y, v.z, 0.0, 0.0, 0.0};
    const glm::dvec3 apart = std::sqrt(0.5) * (v - glm::dvec3(v.y, v.z, v.x)), shear = std::sqrt(3.0) * glm::dvec3(memory_.shears[b][p]);
    return {apart.x, apart.y, apart.z, shear.x, shear.y, shear.z};
  }

  const Animation& animation_;
  const SamplePlace& place_;
  const PictureMemory& memory_;
};

}  // namespace

// The nearest point to zero (Ericson, Real-time collision detection, 2005, 5.1.5), which needs products of vectors only.
LeastWithin least_within(const std::array<std::array<double, 6>, 3>& corners) {
  const auto dot = [&](int i, int j) {
    double sum = 0.0;
    for (std::size_t k = 0; k < 6; ++k) sum += corners[static_cast<std::size_t>(i)][k] * corners[static_cast<std::size_t>(j)][k];
    return sum;
  };
  const double aa = dot(0, 0), bb = dot(1, 1), cc = dot(2, 2), ab = dot(0, 1), ac = dot(0, 2), bc = dot(1, 2);
  LeastWithin best;
  const auto offer = [&](double u, double v, double w) {
    const double square = u * u * aa + v * v * bb + w * w * cc + 2.0 * (u * v * ab + u * w * ac + v * w * bc);
    const double length = std::sqrt(std::max(0.0, square));
    if (best.shares == std::array{0.0, 0.0, 0.0} || length < best.length) best = {length, {u, v, w}};
  };
  offer(1.0, 0.0, 0.0);
  offer(0.0, 1.0, 0.0);
  offer(0.0, 0.0, 1.0);
  const auto along = [](double pp, double qq, double pq) {  // share of q on the side from p to q
    const double side = pp + qq - 2.0 * pq;
    return side > 0.0 ? std::clamp((pp - pq) / side, 0.0, 1.0) : 0.0;
  };
  const double on_ab = along(aa, bb, ab), on_ac = along(aa, cc, ac), on_bc = along(bb, cc, bc);
  offer(1.0 - on_ab, on_ab, 0.0);
  offer(1.0 - on_ac, 0.0, on_ac);
  offer(0.0, 1.0 - on_bc, on_bc);
  // Inside: where the sum is square to both sides that leave corner a.
  const double m11 = aa + bb - 2.0 * ab, m22 = aa + cc - 2.0 * ac, m12 = aa - ab - ac + bc, r1 = aa - ab, r2 = aa - ac;
  const double det = m11 * m22 - m12 * m12;
  if (det > 1e-12 * m11 * m22) {
    const double v = (r1 * m22 - r2 * m12) / det, w = (m11 * r2 - m12 * r1) / det;
    if (v >= 0.0 && w >= 0.0 && v + w <= 1.0) offer(1.0 - v - w, v, w);
  }
  return best;
}

void add_labels(const Animation& animation, const SamplePlace& place, PictureMemory& memory) {
  if (!animation.scalar_bar) return;
  const render::ScalarBar& bar = *animation.scalar_bar;
  const auto add = [&](const std::string& name, std::size_t b, const glm::vec3& point, double value) {
    const glm::dmat4 pose = body_pose(animation.results->bodies[b], place);
    render::Label label;
    label.point = glm::dvec3(pose * glm::dvec4(point, 1.0));
    label.text = fmt::format("{} {} {}", name, value_text(value, animation.scalar_map, bar.factor), bar.unit);
    label.leader = true;
    memory.picture.labels.push_back(std::move(label));
  };
  for (const Animation::Probe& probe : animation.probes)
    if (const std::vector<float>& scalars = memory.scalars[probe.body];
        !scalars.empty() && std::isfinite(scalars[static_cast<std::size_t>(probe.point)]))
      add(probe.name, probe.body, memory.skins[memory.solid[probe.body]].positions[static_cast<std::size_t>(probe.point)],
          static_cast<double>(scalars[static_cast<std::size_t>(probe.point)]));
  if (!animation.settings.extremes) return;
  Extreme low, high;
  if (!Extremes(animation, place, memory).find(low, high)) return;
  if (high.found) add("max", high.body, high.point, high.value);
  if (low.found) add("min", low.body, low.point, low.value);
}

}  // namespace flexframe::film
