// Elastic surface: the mesh as a thin-walled body with membrane and bending stiffness, moved by the nodes.
//
// Membrane: constant-strain triangles, plane stress (Zienkiewicz and Taylor, The finite element method, vol. 1, 2000, ch. 4).
// Bending: hinges, 3 |e|^2 / (A1 + A2) times the square of the change of the angle at each edge (Grinspun et al., Discrete shells, 2003;
// the linearised angle: Bridson et al., Simulation of clothing with folds and wrinkles, 2003). Poisson ratio 0.3, Young's modulus 1.
// Thickness: as asked for; else 2 V / A if the mesh is closed (a solid's wall that has its volume), else a hundredth of its size.
#pragma once

#include "interp/graph.h"
#include "interp/green.h"

#include <Eigen/Sparse>

namespace flexframe::interp {

// Volume and area of a mesh, and whether it is closed: edges with one triangle make up at most a hundredth of all lengths. Faces that look
// the wrong way are turned as their neighbours are; the volume is negative where most faces look inward.
struct Solidity {
  double volume = 0.0, area = 0.0;
  bool closed = false;
};
Solidity measure_solidity(const Points& vertices, const Triangles& triangles);

// For each triangle 1 or -1: by which its normal looks out of the material, if the mesh is closed.
std::vector<int> outward_signs(const Points& vertices, const Triangles& triangles);

// Stiffness 3 V x 3 V of the welded mesh; bridges of the graph are springs.
Eigen::SparseMatrix<double> surface_stiffness(const Weld& weld, const Graph& graph, double thickness);

// Green's function of the surface at the wanted welded vertices. rotations: given with the data, nodes off the surface turn the vertices
// that they hold.
struct ElasticOptions {
  double thickness = 0.0;  // m; 0: as above
  bool rotations = false;
  int threads = 1;
};
Green elastic_green(const Weld& weld, const Graph& graph, const Points& nodes, const std::vector<int>& wanted,
                    const ElasticOptions& options);

}  // namespace flexframe::interp
