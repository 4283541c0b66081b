// Numbering, nodes and shape functions of a beam's finite elements. Private to the makers of beam_fe.cpp and beam_kept.cpp.
#pragma once

#include "sim/bodies/beam_terms.h"

#include <array>
#include <utility>
#include <vector>

namespace flexframe::sim::beam {

enum Kind { kU, kV, kVSlope, kW, kWSlope, kTheta, kKinds };

// Numbering of the full set of coordinates: node by node, only the kinds that exist.
struct Layout {
  int elements = 1;
  double h = 0.0;                       // m, of every element where `nodes` is empty
  std::vector<double> nodes;            // m, ascending from 0; empty: evenly
  std::array<int, kKinds> offset = {};  // within a node, -1 where the kind does not exist
  int per_node = 0;
  int full() const { return per_node * (elements + 1); }
  int index(int node, int kind) const { return node * per_node + offset[kind]; }
  bool has(int kind) const { return offset[kind] >= 0; }
  double length(int element) const { return nodes.empty() ? h : nodes[element + 1] - nodes[element]; }
  // x of a place in an element
  double at(int element, double xi) const {
    return nodes.empty() ? (element + xi) * h : xi == 0.0 ? nodes[element] : nodes[element] + xi * length(element);
  }
  // element, and how far along it
  std::pair<int, double> place(double x) const;
};

Layout layout_of(const BeamDef& def, const BeamEffects& effects);

// Shape functions of a deflection and its section slope on one element; local coordinates: value, slope, value, slope.
struct Deflection {
  Eigen::Vector4d value, derivative, slope, curvature;
};
// flexibility = 12 EI / (k G A h^2), 0 without shear.
Deflection deflection_shapes(double xi, double h, double flexibility);
// Both directions of bending, 0 along y and 1 along z: `of[a][b]` is what coordinates of the direction b move the direction a by. Zero for
// a != b unless `coupled`: with shear and a section whose principal axes are turned (EIyz) the static shapes of an element with the matrix
// Phi = 12/h^2 (kGA)^-1 EI are T N(phi_m) T^-1, phi_m and T its eigenvalues and eigenvectors. Only directions of `effects` are there.
struct Deflections {
  std::array<std::array<Deflection, 2>, 2> of;
  bool coupled = false;
};
// At xi of an element of length h, m.
Deflections deflections(const Properties& p, const BeamEffects& effects, double xi, double h);

// Rows at xi of an element, in the element's 2 per_node coordinates.
FieldRows element_rows(const Layout& layout, const Properties& p, const BeamEffects& effects, int element, double xi);

// highest degree: cubic times cubic, or the squared distance to the tip times slope times slope (6): 4 points are exact
inline constexpr int gauss_points = 4;

// Coordinates that the boundary leaves, as indices of the full set.
std::vector<int> free_coordinates(const Layout& layout, Boundary boundary);

// Rigid motions that the frame's mean axes take out of the deformation, as columns of full coordinates.
MatX rigid_columns(const Layout& layout, Boundary boundary);

// Deformations, given as full coordinates in any frame, as a frame sees them that the boundary places by its held coordinates.
MatX seen_from(const Layout& layout, Boundary boundary, const MatX& shapes);

}  // namespace flexframe::sim::beam
