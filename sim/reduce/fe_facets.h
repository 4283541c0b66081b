// Where the smooth surface lies that the flat facets of shells stand for: facets have their corners on it and leave out what it rises
// between them. A cylinder of facets that meet at an angle a has (a / 2) / sin(a / 2) times their mass.
//
// Of each facet the corners around it give the curvature, by a parabola through them (B. Hamann, Curvature approximation for triangulated
// surfaces, Computing Supplementum 8 (1993)), and that the rise of its edges' middles; edges of the mesh may be curved in its plane too
// (the rim of a disc, a hole). Facets that meet at more than 62 degrees are plates with a fold between them, and so are those at whose
// other sides the surface goes on flat.
#pragma once

#include "sim/reduce/fe_model.h"

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace flexframe::sim {

class FacetRises {
 public:
  explicit FacetRises(const FeModel& model);

  // From the middle of the straight line between two corners of a shell to the surface, m; 0 where it is flat, where the edge has a middle
  // node beside that line, and for nodes that no shell joins.
  Vec3 of(int a, int b) const;
  // From the middle of a quadrangle of straight edges to the surface. corners: four.
  Vec3 of_middle(const int* corners) const;

 private:
  std::map<std::pair<int, int>, Vec3> rises;
};

// Of all shells: mass and int r r^T dm, as their own elements have it (spread over their surface) and as the smooth surface does.
struct FacetMoments {
  double mass = 0.0, smooth_mass = 0.0;                      // kg
  Mat3 second = Mat3::Zero(), smooth_second = Mat3::Zero();  // about `centre`, kg m^2
};
FacetMoments facet_moments(const FeModel& model, const Vec3& centre);

// Warnings of shells that lie on the same nodes as others of the same kind, and of neighbours that look opposite ways though their wall or
// their layers are not the same from both sides.
std::vector<std::string> shells_in_doubt(const FeModel& model);

}  // namespace flexframe::sim
