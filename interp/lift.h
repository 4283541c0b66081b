// First stage of the map: data of the nodes -> source vectors.
//
//   ArmLift     sources are the displacements of the nodes and, for nodes whose surroundings leave their plane or line, the
//               turned directions (R - I) e_x, (R - I) e_y, (R - I) e_z that carry rigid arms. R is given or estimated from the
//               gradient of the interpolant: with two tangents the normal turns with the surface, with one the shortest rotation.
//   AxisLift    Hermite points of a beam's axis and its section's directions (interp/axis.h)
//   CurveLift   stations along curved lines of nodes and their sections' directions (interp/curve.h)
//   DenseLift   points of an elastic body: a small dense matrix in the frame that best follows the nodes
//   BlendLift   ArmLift and DenseLift, each as above
// Linear: for modes and small motion. Exact: rotation vectors of any size; a common rotation of all nodes is reproduced exactly.
#pragma once

#include "interp/axis.h"
#include "interp/curve.h"
#include "interp/sparse.h"
#include "interp/types.h"

#include <variant>
#include <vector>

namespace flexframe::interp {

struct ArmLift {
  // How a node's rotation is estimated: derivative of the displacement along each tangent = sum over entries of weight * u.
  struct Estimate {
    Mat3 frame = Mat3::Identity();  // columns: tangents first, then the dropped axes
    int tangents = 0;               // 0, 1 or 2; 3: full gradient
    std::vector<int> node;          // nodes of the patch
    Eigen::MatrixXd gradient;       // tangents x nodes of the patch
  };
  int nodes = 0;                   // merged nodes
  bool given = false;              // rotations come with the data
  std::vector<int> director_node;  // sources nodes + 3 k .. nodes + 3 k + 2 are the directions of this node
  std::vector<Estimate> estimate;  // one per director node, unless given
};

struct DenseLift {
  Points node_positions;         // N x 3
  Points source_positions;       // P x 3
  Eigen::MatrixXd displacement;  // 3 P x 3 N
  Eigen::MatrixXd rotation;      // 3 P x 3 N or empty
};

// Two maps of one body side by side: sources of the first, then of the second. Their weights (sparse.h, join_weights) hold the shares.
struct BlendLift {
  ArmLift arms;
  DenseLift dense;
  double share = 0.0;  // of the second, 0..1
};

using Lift = std::variant<ArmLift, AxisLift, CurveLift, DenseLift, BlendLift>;

// Number of source vectors.
int source_count(const Lift& lift);

// Sources P x 3 of one picture; displacement and rotation of the merged nodes (N x 3; rotation 0 x 3: none given).
Points lift_exact(const Lift& lift, const Points& displacement, const Points& rotation);
Points lift_linear(const Lift& lift, const Points& displacement, const Points& rotation);

// Best rigid motion of the nodes (Kabsch 1976): x -> rotation (x - centre) + centre + translation. Two or more nodes on a line leave the
// turn about it open; then the shortest rotation. Given rotations settle what positions leave open.
struct RigidMotion {
  Mat3 rotation = Mat3::Identity();
  Vec3 centre = Vec3::Zero(), translation = Vec3::Zero();
  Vec3 displacement(const Vec3& x) const { return rotation * (x - centre) + centre + translation - x; }
};
// positions, displacement: N x 3, m; rotation: N x 3 rotation vectors, rad, or 0 x 3.
RigidMotion best_rigid_motion(const Points& positions, const Points& displacement, const Points& rotation);

// The nodes' motion as seen from the frame that follows them best, as far as the data are finite turns (share, 0..1) rather than a mode
// shape (share 0: rest and turns are the data themselves).
struct LocalMotion {
  RigidMotion rigid;
  double share = 0.0;
  Points displacement, rotation;  // rotation: no rows where none are given
};
// positions, displacement: N x 3, m; rotation: N x 3 rotation vectors, rad, or 0 x 3.
LocalMotion local_motion(const Points& positions, const Points& displacement, const Points& rotation);

// Leave-one-out rows: residual of node i = sum of weights times sources (sparse), or times node displacements (dense).
struct LeaveOneOut {
  SparseWeights rows;     // N x P, precise; 0 rows: none
  Eigen::MatrixXd dense;  // 3 N x 3 N or empty
  Eigen::MatrixXd turn;   // 3 N x 3 N, against the nodes' rotations, or empty
};

}  // namespace flexframe::interp
