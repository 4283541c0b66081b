// Elastic solid: the inside of a closed mesh filled with cubes of trilinear displacement, moved by the nodes.
//
// Cubes that the body fills partly count with their share (finite cell method: Parvizian, Duester, Rank, 2007), so that the surface need
// not follow the cubes. Eight points of integration; Young's modulus 1, Poisson ratio 0.3. About 1500 cubes, or as many as their size being
// a third of the wall 2 V / A asks, up to 2500. Gaps narrower than a cube are filled: bodies with slits belong to the elastic surface.
#pragma once

#include "interp/graph.h"
#include "interp/green.h"

namespace flexframe::interp {

// Green's function of the solid at the wanted welded vertices. Throws MapError if the mesh encloses nothing.
Green lattice_green(const Weld& weld, const Points& nodes, const std::vector<int>& wanted, int threads);

// Share of each cell of a grid that lies inside a closed mesh, by rays along x through samples^2 points a cell face (odd crossings are
// inside). Cells x fastest; cell (i, j, k) starts at lower + size * (i, j, k).
std::vector<float> inside_shares(const Weld& weld, const Vec3& lower, double size, const Eigen::Array3i& cells, int samples);

}  // namespace flexframe::interp
