// Bodies whose finite elements are known: every vertex of a mesh follows the point of the elements' surface nearest to it, by the shape
// functions of the face there. At the nodes that is the model's own motion, between them what the elements say; a vertex beside the
// surface hangs on it by a rigid arm that turns with it, in first order, so that rigid motion is exact wherever vertices lie.
//
// Faces: 3 or 4 corners, or 6 or 8 points (corners, then the middles of their edges), with the shape functions of Zienkiewicz and Taylor,
// The finite element method, vol. 1, 2000, ch. 8. The nearest point of a curved face is found by Gauss and Newton's method from the
// nearest of its flat pieces.
#pragma once

#include "interp/modes.h"
#include "interp/types.h"

#include <array>
#include <vector>

namespace flexframe::interp {

struct FaceMesh {
  Points points;                                                 // P x 3, m
  Eigen::Matrix<int, Eigen::Dynamic, 8, Eigen::RowMajor> faces;  // k x 8 points, -1 behind the last; the first three or four are corners
};

// Where a vertex hangs: sum over k of value[k] (and its derivatives along the face) times what the point point[k] does.
struct FaceFoot {
  int count = 0;
  std::array<int, 8> point{};
  std::array<double, 8> value{};
  std::array<std::array<double, 2>, 8> slope{};  // by the face's two natural coordinates
  Vec3 arm = Vec3::Zero();                       // from the foot to the vertex, m
};

// The nearest feet of all vertices. Throws InputError where there are no faces or an index is out of range. threads 0: all cores.
std::vector<FaceFoot> find_feet(const FaceMesh& faces, const Eigen::Ref<const Points>& vertices, int threads = 0);

// Largest and root mean square length of the arms, m.
struct FaceGap {
  double largest = 0.0, mean = 0.0;
};
FaceGap measure_gap(const std::vector<FaceFoot>& feet);

// Displacement of the vertices per coordinate (3 M x n) from that of the points (phi: 3 P x n).
ModeColumns map_displacement(const FaceMesh& faces, const std::vector<FaceFoot>& feet, const Eigen::Ref<const Eigen::MatrixXd>& phi);

// Components of a field per coordinate at the vertices' feet (width M x n) from those at the points (width P x n), such as stresses.
ModeColumns map_field(const std::vector<FaceFoot>& feet, int width, const Eigen::Ref<const Eigen::MatrixXd>& field);

// Error bars of map_displacement: 3 M x n, per vertex the strains e11, e22, 2 e12 of the face at its foot times the length of its arm. What
// the arm, taken as rigid, leaves out is of the size of their norm. Zero on the surface.
ModeColumns map_doubt(const FaceMesh& faces, const std::vector<FaceFoot>& feet, const Eigen::Ref<const Eigen::MatrixXd>& phi);

}  // namespace flexframe::interp
