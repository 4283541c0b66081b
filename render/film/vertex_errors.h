// How far the drawn vertices of a film are from where they belong: between two runs, and what the way from samples and nodes to vertices
// adds. Distances in pixels of the picture and in metres of the drawn body (exaggerated as drawn).
#pragma once

#include "render/film/animation.h"
#include "render/frame/view.h"

#include <string>
#include <vector>

namespace flexframe::film {

// The views of one picture of a film, to tell pixels from metres.
class PictureViews {
 public:
  PictureViews(const Animation& animation, int picture);

  // Pixels that a metre across the line of sight has at a world point, the most of all views; 0 where it is far outside all of them.
  double pixels_per_metre(const glm::dvec3& world) const;
  // Pixels that a world point moves by up to, if it moves along each axis of the world by up to so much to either side (m, small), the most
  // of the views that see it.
  double moved(const glm::dvec3& world, const glm::dvec3& by) const;
  // The largest distance in pixels of two world points over the views that see the first.
  double apart(const glm::dvec3& a, const glm::dvec3& b) const;
  // Where a world point is seen in the first view, from the upper left of the picture; the view's middle for one that is behind it.
  glm::dvec2 pixel(const glm::dvec3& world) const;

 private:
  std::vector<render::ViewFrame> views_;
};

// A distance and where it is.
struct VertexDistance {
  double pixels = 0.0, metres = 0.0;
  int picture = -1;
  size_t body = 0;
  glm::dvec3 world{0.0};  // the vertex, where it is told
  int left_out = 0;       // pictures that the other run has no sample for
  void widen(double px, double m, int at, size_t of, const glm::dvec3& where = glm::dvec3(0.0)) {
    if (px > pixels || (picture < 0 && px >= pixels)) picture = at, body = of, world = where;
    pixels = std::max(pixels, px);
    metres = std::max(metres, m);
  }
};

// Pictures at which errors are looked at: all, or so many evenly over the film with the first and the last.
std::vector<int> looked_at(const Animation& animation, int most);

// The other run of the same scene on the meshes, at the times, scales and cameras of `animation`: the largest distance of any vertex that
// is drawn, in the pictures of which both runs know the time. other: bodies parallel to the animation's results, nodes may be others.
// most: pictures looked at. Throws what make_body_model throws, and InputError where the runs have no picture or no body in common.
VertexDistance vertices_apart(const Animation& animation, const sim::Results& other, const sim::Scene* scene, int most);

// What the samples' spacing takes from the motion between them: runs are drawn along straight lines between samples.
// every: as if the run had every so manyth sample only. Pixels are those that a camera sees which follows its body.
VertexDistance sample_errors(const Animation& animation, int most, int every = 1);

// The same told by a run of more samples, of which the other runs have every `every`-th: sees what moves between those alone. In all
// pictures, at a few points of every body.
VertexDistance thinned_errors(const Animation& animation, int every);

// What the map from nodes to vertices is wrong by. Beams that are drawn by their section: against their elements' own shape functions
// (cubic Hermite, sections stay plane), and what curved ones lack of shear, by which sections stand aslant. Bodies whose finite elements
// are known: against these. Others: what leaving out a node makes of the map, or another kernel where the map is an elastic surface or
// solid, which are estimates. unknown: bodies of which nothing is known, by name.
struct MapErrors {
  VertexDistance largest;
  std::vector<std::string> estimated, unknown;
  bool by_shear = false;  // most of the largest is what a curved beam shears
};
MapErrors map_errors(const Animation& animation, const sim::Scene* scene, int most);

// Single precision of vertices, and the 256 places that a pixel is divided into when triangles are filled.
VertexDistance raster_errors(const Animation& animation, int most);

}  // namespace flexframe::film
