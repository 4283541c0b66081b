// What a picture needs of a deformed surface beside its positions: normals, and scalars to colour by.
#pragma once

#include "interp/types.h"

#include <span>
#include <vector>

namespace flexframe::interp {

// Normals per frame: each corner adds its triangle's normal weighted by area and corner angle (Thuermer and Wuethrich 1998 weigh
// by the angle; the area damps slivers) to its normal group. Corners of a smooth surface share a group, those across a crease or
// a normal seam do not; copies of a position along a texture seam do.
struct NormalLayout {
  std::vector<int> corner_position;  // 3 K: position of each corner
  std::vector<int> corner_group;     // 3 K: normal group of each corner, 0..groups-1
  int groups = 0;
  // Corners sorted by group, filled by make_normal_layout: what lets groups be summed in a fixed order by several threads.
  std::vector<int> group_begin, group_corner;
};
// From the arrays of the struct above; sorts the corners by group.
NormalLayout make_normal_layout(std::vector<int> corner_position, std::vector<int> corner_group, int groups);

// Unit normals, groups x 3; (0, 0, 1) where all triangles of a group are degenerate. positions: 3 M floats.
void compute_normals(const NormalLayout& layout, std::span<const float> positions, PointsF& normals, int threads = 1);

// |u| per vertex; displacement 3 M floats.
void compute_magnitude(std::span<const float> displacement, std::span<float> out);

// Equivalent surface strain per vertex: von Mises norm sqrt(e1^2 - e1 e2 + e2^2) of the principal Green-Lagrange strains of each
// triangle, averaged over the triangles of a vertex by area. Exact for rigid motion (zero), large rotations allowed.
// welded: row of each vertex among the welded ones (Map::welded), so that seams show no jump; empty: none.
// linear: of a displacement that is linear in its coordinates, as a mode's: the strain that is so too. It turns edges by making them
// longer, which is no strain (half the square of the turn).
void compute_strain(const MeshView& mesh, std::span<const int> welded, std::span<const float> displacement, std::span<float> out,
                    bool linear = false);

}  // namespace flexframe::interp
