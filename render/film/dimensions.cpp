#include "render/film/dimensions.h"

#include "render/film/attachments.h"
#include "render/film/overlay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::film {
namespace {

constexpr int most_samples = 400;  // of the run that are looked at for the largest value and for the camera

// The points that a dimension lies between, m, world: from, to, and the vertex of an angle.
struct Ends {
  glm::dvec3 from, to, at;
};

Ends ends_of(const Animation& animation, const DimensionLine& d, const SamplePlace& now, double scale) {
  const auto origin = [&](const FramePlace& place) { return glm::dvec3(place_pose(*animation.results, place, now, scale)[3]); };
  return {origin(d.from), origin(d.to), d.at ? origin(*d.at) : glm::dvec3(0.0)};
}

// m or degrees; not a number where an angle has no sides.
double value_of(const DimensionLine& d, const Ends& e) {
  if (!d.at) return d.axis < 0 ? glm::length(e.to - e.from) : std::abs(e.to[d.axis] - e.from[d.axis]);
  const glm::dvec3 a = e.from - e.at, b = e.to - e.at;
  if (!(glm::length(a) > 0.0 && glm::length(b) > 0.0)) return std::nan("");
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) * 180.0 / std::numbers::pi;
}

// From one side of the angle to the other, about its vertex.
std::vector<glm::dvec3> arc(const DimensionLine& d, const Ends& e, double radius) {
  const glm::dvec3 a = glm::normalize(e.from - e.at), b = e.to - e.at;
  glm::dvec3 across = b - glm::dot(b, a) * a;
  const double angle = std::atan2(glm::length(across), glm::dot(b, a));
  // Sides that lie on one line have no plane of their own: any will do.
  if (!(glm::length(across) > 1e-9 * glm::length(b)))
    across = glm::cross(std::abs(a.z) < 0.9 ? glm::dvec3(0.0, 0.0, 1.0) : glm::dvec3(1.0, 0.0, 0.0), a);
  across = glm::normalize(across);
  std::vector<glm::dvec3> points;
  const int pieces = std::max(2, static_cast<int>(std::ceil(angle / 0.05)));
  for (int k = 0; k <= pieces; ++k)
    points.push_back(e.at + d.offset + radius * (std::cos(angle * k / pieces) * a + std::sin(angle * k / pieces) * across));
  return points;
}

// Line and helpers between the points as drawn; empty where there is nothing to see.
render::Dimension draw_line(const DimensionLine& d, const Ends& e) {
  render::Dimension out;
  if (d.at) {
    const double a = glm::length(e.from - e.at), b = glm::length(e.to - e.at);
    if (!(a > 0.0 && b > 0.0)) return out;
    const double radius = d.radius > 0.0 ? d.radius : 0.5 * std::min(a, b);
    out.line = arc(d, e, radius);
    out.helpers = {{e.at + d.offset, e.at + d.offset + (e.from - e.at) * std::max(1.0, 1.1 * radius / a)},
                   {e.at + d.offset, e.at + d.offset + (e.to - e.at) * std::max(1.0, 1.1 * radius / b)}};
    return out;
  }
  glm::dvec3 way = e.to - e.from;
  if (d.axis >= 0)
    for (int k = 0; k < 3; ++k)
      if (k != d.axis) way[k] = 0.0;
  const glm::dvec3 first = e.from + d.offset, last = first + way;
  if (!(glm::length(way) > 0.0)) return out;
  out.line = {first, last};
  if (glm::length(d.offset) > 0.0) out.helpers.push_back({e.from, first});
  if (glm::length(last - e.to) > 1e-9 * glm::length(way)) out.helpers.push_back({e.to, last});
  return out;
}

template <class Visit>
void for_each_sample(const Animation& animation, Visit visit) {
  const Eigen::Index count = animation.results->times.size(), step = std::max<Eigen::Index>(1, count / most_samples);
  for (Eigen::Index i = 0; i < count; i += step) visit(SamplePlace{i, 0.0});
}

}  // namespace

void add_dimensions(Animation& animation, const sim::Scene* scene) {
  for (const DimensionSettings& asked : animation.settings.dimensions) {
    const auto place = [&](const std::string& name) { return require_place(animation, scene, name, "dimensions", asked.line); };
    DimensionLine d;
    d.from = place(asked.from);
    d.to = place(asked.to);
    if (!asked.at.empty()) d.at = place(asked.at);
    d.axis = asked.axis;
    d.offset = asked.offset;
    d.radius = asked.radius;
    d.label = asked.label;
    // One unit and one number of decimals for the run: four digits of the largest value, tenths of a degree.
    double largest = 0.0;
    for_each_sample(animation, [&](const SamplePlace& now) {
      if (const double value = value_of(d, ends_of(animation, d, now, 1.0)); std::isfinite(value)) largest = std::max(largest, value);
    });
    if (d.at) {
      d.unit = "°";
      d.decimals = 1;
    } else {
      const auto [unit, factor] = readable_unit("m", largest);
      d.unit = "\u202f" + unit;
      d.factor = factor;
      const double shown = largest * factor;
      d.decimals = shown > 1e-3 ? std::clamp(3 - static_cast<int>(std::floor(std::log10(shown))), 0, 6) : 3;
    }
    animation.dimensions.push_back(std::move(d));
  }
  if (!animation.dimensions.empty() && animation.scales[0] != 1.0 && animation.largest_displacement > 0.0)
    animation.notes.push_back(fmt::format("dimensions tell the true lengths and angles; bodies are drawn with elastic displacement {}",
                                          render::scale_text(animation.scales[0])));
}

void append_dimensions(const Animation& animation, std::vector<glm::dvec3>& points) {
  // A camera that follows a body has its own surroundings.
  if (animation.follow >= 0) return;
  for (const DimensionLine& d : animation.dimensions)
    for_each_sample(animation, [&](const SamplePlace& now) {
      const render::Dimension drawn = draw_line(d, ends_of(animation, d, now, animation.scales[0]));
      points.insert(points.end(), drawn.line.begin(), drawn.line.end());
    });
}

void update_dimensions(const Animation& animation, const SamplePlace& now, render::Picture& picture) {
  picture.dimensions.clear();
  for (const DimensionLine& d : animation.dimensions) {
    const double value = value_of(d, ends_of(animation, d, now, 1.0));
    render::Dimension drawn = draw_line(d, ends_of(animation, d, now, animation.scales[0]));
    if (drawn.line.empty() || !std::isfinite(value)) continue;
    drawn.text = fmt::format("{}{}{:.{}f}{}", d.label, d.label.empty() ? "" : " ", value * d.factor, d.decimals, d.unit);
    picture.dimensions.push_back(std::move(drawn));
  }
}

}  // namespace flexframe::film
