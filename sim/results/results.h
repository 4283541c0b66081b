// What a simulation leaves behind, as plain data; results_file.h writes it to HDF5 and CSV and reads it back.
// Anybody may fill one from another simulator and render it. SI units; row i of every series belongs to times[i].
#pragma once

#include "sim/base/notes.h"
#include "sim/base/types.h"
#include "sim/scene/scene.h"

#include <optional>
#include <string>
#include <vector>

namespace flexframe::sim {

struct ResultNode {
  std::string name;            // frame name or node number
  Vec3 origin = Vec3::Zero();  // undeformed position in the body frame, m
};

// A surface that comes with the results, where no mesh file shows the body: what other programs compute on or draw.
struct ResultSurface {
  Eigen::MatrixX3d points;     // m x 3, m, body frame
  Eigen::MatrixX3i triangles;  // k x 3 points (from 0), counterclockwise seen from outside
  Eigen::MatrixX3d colors;     // k x 3 of the triangles, sRGB 0..1; empty: one colour
  std::vector<int> nodes;      // m: the node that each point is; empty: the kernel map carries the nodes' motion to the points
};

// A body of the scene (a mixed or lumped beam is one body). Node displacements and rotations are relative to the undeformed
// body, in the body frame; rotations are rotation vectors of the exact relative rotation and may be large.
struct ResultBody {
  std::string name;
  std::string kind;               // rigid, beam, modal, statespace
  double length = 0.0;            // beams: m
  Section section;                // beams: what to draw
  std::string mesh;               // Wavefront file, absolute, or empty
  std::string mesh_sha256;        // of that file when the results were written; empty: unknown
  std::vector<double> color;      // sRGB 0..1 where the scene gives the body none; empty: by kind
  ResultSurface surface;          // instead of a mesh file
  Eigen::MatrixX3d position;      // nt x 3, origin of the body frame in world axes, m
  Eigen::MatrixX4d orientation;   // nt x 4, unit quaternion w x y z, body to world
  std::vector<ResultNode> nodes;  // nn simulation nodes; empty for a rigid body
  RowsX displacement;             // nt x 3 nn: ux uy uz of node 0, of node 1, ...; m
  RowsX rotation;                 // nt x 3 nn, rad; empty: unknown
  // Straight beams that shear: at each node (k G A)^-1 E I, m^2, as yy yz zy zz in the axes of the body; empty: sections are square to the
  // axis.
  MatX node_shear;  // nn x 4
  RowsX q, qd;      // nt x n elastic coordinates and rates (all parts, in order)
  // Modal bodies only: displacement of the nodes per elastic coordinate, so that a renderer can map modes once.
  MatX node_phi;  // 3 nn x n or empty
  MatX node_psi;  // 3 nn x n or empty
  // Of such bodies that are shown from another frame than that of q and node_phi (joint frames, mean axes): pose of the latter in the
  // former, and small translation and rotation of the shown frame per elastic coordinate.
  Eigen::MatrixX3d held_position;  // nt x 3, m, or empty: the frames are one
  Eigen::MatrixX3d held_rotation;  // nt x 3, rotation vector, rad
  Mat6X shown_columns;             // 6 x n
  // Where the body knows stresses: the nodes that have them and their stress per elastic coordinate (xx yy zz xy yz xz below each other),
  // Pa.
  std::vector<int> stress_nodes;    // ns indices of nodes, ascending
  MatX node_stress;                 // 6 ns x n or empty
  MatX node_von_mises;              // nt x nn, Pa, von Mises stress that another program computed; empty: unknown
  std::vector<std::string> labels;  // n
  // Beams: strains of the section at stations along x (ascending; twice where one piece ends and the next begins) per elastic coordinate,
  // as triplets: row 4 station + field, coordinate, value. Fields: lengthening u' (1), curvatures v'' and w'' (1/m), twist theta' (1/m).
  VecX strain_stations;  // ns, m; empty: unknown
  MatX section_strain;   // k x 3
  // Ways in which the beam carries loads without deforming ("axial", "torsion"), so that `section_strain` knows nothing of them.
  std::vector<std::string> unstrained;
  MatX load_strain;  // nt x (ns of each of them): u' (1) and theta' (1/m) that their forces and torques cause; empty: unknown
};

struct ResultJoint {
  std::string name, kind;
  Eigen::MatrixX3d position;     // nt x 3, of the joint's parent frame, world
  Eigen::MatrixX4d orientation;  // nt x 4
  MatX value, rate;              // nt x nq, nt x nv
};

struct ResultOutput {
  std::string column;  // "slider.x", "energy"
  std::string unit;    // "m", "rad/s", "J"
  VecX values;         // nt
  std::string description = {};
  double size = 0.0;  // what its errors are measured against (OutputDef); 0: its range
};

// What keeps the vertices of a film from where they belong, each the largest over pictures and bodies, in `unit`. They add up to `total`,
// those of space and effects as squares.
struct PictureShares {
  std::string asked;     // "0.5 px"
  std::string unit;      // "px" or "m"
  double allowed = 0.0;  // in it
  double total = 0.0;
  double time = 0.0, space = 0.0, effects = 0.0;  // of the simulation
  double map = 0.0;                               // from nodes to vertices
  double samples = 0.0;                           // between the samples of the results
  double raster = 0.0;                            // single precision and the places that a pixel distinguishes
  std::string body;                               // where the largest are
  std::string doubt;                              // a part that nothing tells, in words; empty: none
};

// How an asked accuracy was met.
struct AccuracyStatement {
  double asked = 0.0;
  double time = 0.0, space = 0.0, effects = 0.0;  // estimated errors, relative to the range of the output; the latter two add as squares
  std::string column;                             // the output that is furthest off
  double half_cost = 1.0;                         // half the error would cost so many times the CPU time
  double search_cpu = 0.0;                        // s, of the runs that found the setting
  std::vector<std::string> chosen;                // "tolerance 1e-05", "'rod' 3 modes of 9 elements"
  std::optional<PictureShares> picture;           // where it was asked of the pictures
};

struct SolverStatistics {
  std::string method;
  double tolerance = 0.0;
  long steps = 0, evaluations = 0, jacobians = 0, events = 0, restarts = 0;
  double cpu_seconds = 0.0;                   // of the time integration, the model's making excluded
  double work = 0.0;                          // the same as it is counted (base/work_clock.h), s: what decides
  double error_estimate = -1.0;               // relative to each output's range, the worst output; negative: not estimated
  std::string error_column;                   // that output
  std::optional<AccuracyStatement> accuracy;  // where one was asked for
  Notes notes;                                // what was chosen, neglected, warned of
};

// Sizes of a mechanism and its motion, to tell an output that stands still but for rounding. 0: unknown.
struct OutputScales {
  double length = 0.0;  // m, size of the mechanism
  double force = 0.0;   // N, largest force in a joint, weight
  double speed = 0.0;   // m/s, of its mass on the average, at its fastest
  bool rests = false;   // it stays in static equilibrium: what moves is rounding
};

struct Results {
  std::string title;
  std::string scene_file;  // as given
  std::string scene_text;  // the file's text, so that results describe themselves
  VecX times;              // nt, s
  std::vector<ResultBody> bodies;
  std::vector<ResultJoint> joints;
  std::vector<ResultOutput> outputs;
  VecX kinetic, strain, potential, supplied, dissipated;  // nt each, J; system totals (supplied, dissipated: work since the start)
  OutputScales scales;                                    // of the run; not in results files
  SolverStatistics statistics;
};

}  // namespace flexframe::sim
