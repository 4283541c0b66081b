// Places at which drawn bodies are looked at: some of their vertices, moved by the deformation of the nodes nearest to them. Cheap, for
// whether a body is seen and how large; what moves vertices in pictures is its map.
#pragma once

#include "render/film/animation.h"

#include <vector>

namespace flexframe::film {

// How many times largest a body's elastic displacement is drawn.
double largest_scale(const Animation& animation, const BodyModel& model);

class BodyPoints {
 public:
  // most: so many vertices at most, evenly of the mesh; of a body without one its nodes.
  BodyPoints(const Animation& animation, size_t body, size_t most);
  // In the world, at every scale that is drawn. Memory is reused.
  void at(const SamplePlace& place, std::vector<glm::dvec3>& out) const;
  bool empty() const { return rest_.empty(); }

 private:
  const sim::ResultBody& body_;
  std::vector<double> scales_;
  std::vector<glm::dvec3> rest_;
  std::vector<int> node_;  // a point each; empty: nothing deforms
};

}  // namespace flexframe::film
