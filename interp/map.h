// The kernel map: displacements (and rotations) of N sparse simulation nodes -> displacements of M animation vertices.
//
//   Map map = make_map(nodes, mesh);                          once per body
//   apply(map, displacement, rotation, out);                  a frame of a nodal series, large rotations allowed
//   ModeColumns columns = map_modes(map, phi, psi);           once per modal body (interp/modes.h); a frame is then
//   apply_modes(columns, q, out);                             one product at the speed of memory
//
// The map is built in two stages. The lift takes the nodes' data to P source vectors (nodes, the turned directions of nodes
// with rigid arms, Bezier points of a beam's axis, points of an elastic solution); the weights take the sources to the
// vertices, a sparse scalar matrix W whose rows reproduce rigid motion. The lift is linear for modes (theta x arm) and exact
// for nodal series ((R(theta) - I) arm), so any common rotation of all nodes, however large, comes out exactly.
//
// Schemes and their sources: interp/README.md.
#pragma once

#include "interp/axis.h"
#include "interp/lift.h"
#include "interp/sparse.h"
#include "interp/types.h"

#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace flexframe::interp {

enum class Scheme {
  automatic,  // chosen by node count, layout and topology
  kernel,     // geodesic partition of unity of r^3 patches; cubic spline of the axis for nodes along a beam
  elastic,    // discrete Green's function of the surface: membrane and bending
  lattice,    // discrete Green's function of the solid: voxel elasticity
  r3,         // one global r^3 kernel, straight distance
  r,          // one global r kernel
  tps,        // one global r^2 log r kernel (thin plate)
};

// "auto", "kernel", ...; throws InputError that lists the names.
Scheme scheme_from_name(std::string_view name);
std::string_view scheme_name(Scheme scheme);

struct Nodes {
  Points positions;                // N x 3, in the frame of the mesh
  bool rotations = false;          // the data will bring rotation vectors too
  std::vector<std::string> names;  // for messages; empty: numbers from 0
  bool finite = false;             // the rotations are finite turns, as those of a run; false: nodes on a line tell by their lengths
  // Of a beam that shears: at each node its shear per third derivative of its deflection, (k G A)^-1 E I, m^2, in the frame of the mesh.
  // With it nodes on a line that bring rotations have their sections stand aslant to the axis; empty: square to it.
  std::vector<Mat3> shear;
};

struct Options {
  Scheme scheme = Scheme::automatic;
  int patch_nodes = 20;           // kernel: nodes of a patch, 8..60
  double lebesgue_warn = 10.0;    // above: repaired, and a warning
  double lebesgue_error = 100.0;  // above after repair: MapError
  double merge_distance = 1e-6;   // nodes closer than this times the size of the mesh are one node
  double thickness = 0.0;         // m, of an elastic surface's wall; 0: 2 V / A of a closed mesh, a hundredth of an open one's size
  bool precise = false;           // keep the weights in double too (apply_precise); twice the memory
  int threads = 0;                // 0: all cores; the result does not depend on it
};

struct Report {
  Scheme scheme = Scheme::kernel;  // used
  std::string reason;              // one sentence: why this scheme
  std::string layout;              // "point", "axis", "curve", "surface", "solid": how the nodes lie
  double lebesgue = 0.0;           // max over vertices of the sum over nodes of |weight|
  int lebesgue_vertex = -1;
  int patches = 0;
  int merged_nodes = 0;
  double setup_seconds = 0.0;  // wall time
  std::vector<std::string> warnings;
};

// A linear map for modes, exact for large rotations in series. Plain data; copy it freely.
struct Map {
  int nodes = 0;                // N as given
  int vertices = 0;             // M
  bool rotations = false;       // rotations of the data are used
  std::vector<int> node_of;     // N: index among the merged nodes
  std::vector<int> node_count;  // merged nodes: how many each stands for
  Points node_positions;        // merged nodes
  Lift lift;                    // merged nodes -> P sources
  SparseWeights weights;        // welded vertices x P
  std::vector<int> welded;      // M: row of weights; copies of a vertex along seams share one
  LeaveOneOut leave_one_out;    // rows that predict a node from the others
  Report report;
};

// Builds the map; a mesh without triangles is a cloud of points, neighbours stand for its edges. Throws InputError (no nodes, coordinates
// not finite, triangle indices out of range, nodes nowhere near the mesh, a scheme that needs triangles) and MapError (Lebesgue
// constant over the limit after repair).
Map make_map(const Nodes& nodes, const MeshView& mesh, const Options& options = {});

// Map::welded without the map: vertices at one place have one number.
std::vector<int> weld_rows(const MeshView& mesh, const Options& options = {});

// Displacement of the vertices, out M x 3 float32 (resized, memory reused). displacement N x 3; rotation N x 3 rotation
// vectors (they may be large) or 0 x 3. Throws InputError on wrong sizes or values that are not finite.
void apply(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation, PointsF& out);
// The same into foreign memory, 3 M floats x y z x y z ...
void apply(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation, std::span<float> out);
// The same in double; needs Options::precise.
Points apply_precise(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation);
// Linearised in displacement and rotation (what modes use), in double; needs Options::precise.
Points apply_linear(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation);

// Sources of one mode (P x 3): linear lift of a column of 3 N displacements and of 3 N rotations (or none).
Points mode_sources(const Map& map, const Eigen::VectorXd& phi, const Eigen::VectorXd& psi);

// Leave-one-out error of the data: each node is predicted from the others. Root mean square over the nodes relative to the
// root mean square displacement less its rigid part, and the worst node. An estimate from above of the error between the nodes.
struct LeaveOneOutError {
  double relative = 0.0;  // 0 if nothing deforms; NaN if the layout gives no estimate (one or two nodes)
  double maximum = 0.0;   // m
  int node = -1;          // that of the maximum
};
// displacement N x 3, m; rotation N x 3, rad, or 0 x 3. Throws InputError as apply does.
LeaveOneOutError leave_one_out(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation);

// Largest difference of data between nodes that were merged: m, and a sentence naming them, or empty.
std::string merged_nodes_differ(const Map& map, const Nodes& nodes, const Eigen::Ref<const Points>& displacement);

}  // namespace flexframe::interp
