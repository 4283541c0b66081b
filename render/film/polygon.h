// Triangles of a polygon with holes: what closes the ends of a swept section.
//
// Holes are joined to the outer loop by their shortest free bridges, then ears are clipped (Meisters, Polygons have ears, 1975;
// Eberly, Triangulation by ear clipping, 2008). Quadratic in the number of corners: sections have tens of them.
#pragma once

#include <Eigen/Dense>

#include <array>
#include <vector>

namespace flexframe::film {

using Loop = std::vector<Eigen::Vector2d>;

// Twice the signed area, > 0 for counterclockwise loops.
double signed_area(const Loop& loop);

// loops: the outer one first, holes after, in any sense of rotation, each without repeated or crossing edges.
// Indices count the corners of all loops in order; triangles run counterclockwise.
// Throws ArgumentError for loops of less than three corners or that cross.
std::vector<std::array<int, 3>> triangulate_polygon(const std::vector<Loop>& loops);

}  // namespace flexframe::film
