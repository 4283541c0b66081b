#include "render/film/body_points.h"

#include <algorithm>
#include <cmath>

namespace flexframe::film {

double largest_scale(const Animation& animation, const BodyModel& model) {
  if (animation.scales.empty()) return 1.0;
  if (model.ghost == GhostStyle::none) return std::abs(animation.scales.front());
  double out = 0.0;
  for (const double s : animation.scales) out = std::max(out, std::abs(s));
  return out;
}

BodyPoints::BodyPoints(const Animation& animation, size_t body, size_t most) : body_(animation.results->bodies[body]) {
  const BodyModel& model = animation.bodies[body];
  const auto origin = [&](const sim::ResultNode& node) { return glm::dvec3(node.origin.x(), node.origin.y(), node.origin.z()); };
  const size_t n = model.mesh.positions.empty() ? body_.nodes.size() : model.mesh.positions.size();
  const size_t step = std::max<size_t>(1, (n + most - 1) / std::max<size_t>(1, most));
  for (size_t i = 0; i < n; i += step) rest_.push_back(model.mesh.positions.empty() ? origin(body_.nodes[i]) : model.mesh.positions[i]);
  scales_ = {0.0};
  if (!model.flexible || body_.nodes.empty() || body_.displacement.cols() < static_cast<Eigen::Index>(3 * body_.nodes.size())) return;
  if (!animation.scales.empty()) scales_ = animation.scales;
  if (model.ghost == GhostStyle::none) scales_.resize(1);
  for (const glm::dvec3& p : rest_) {
    const auto apart = [&](const sim::ResultNode& node) { return glm::length(origin(node) - p); };
    const auto nearest = std::min_element(body_.nodes.begin(), body_.nodes.end(),
                                          [&](const sim::ResultNode& a, const sim::ResultNode& b) { return apart(a) < apart(b); });
    node_.push_back(static_cast<int>(nearest - body_.nodes.begin()));
  }
}

void BodyPoints::at(const SamplePlace& place, std::vector<glm::dvec3>& out) const {
  const glm::dmat4 pose = body_pose(body_, place);
  out.clear();
  for (size_t i = 0; i < rest_.size(); ++i) {
    glm::dvec3 moved(0.0);
    if (!node_.empty())
      for (int a = 0; a < 3; ++a) moved[a] = body_.displacement(place.index, static_cast<Eigen::Index>(3 * node_[i]) + a);
    for (const double scale : scales_) out.emplace_back(pose * glm::dvec4(rest_[i] + scale * moved, 1.0));
  }
}

}  // namespace flexframe::film
