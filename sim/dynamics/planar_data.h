// What planar.h's equations work on: motion in the plane, arrays per body, frame and cluster. Private to the planar files.
#pragma once

#include "sim/base/small_matrices.h"
#include "sim/dynamics/planar.h"

#include <cmath>

namespace flexframe::sim {
namespace planar {

using Vec2 = Eigen::Vector2d;

struct Pose2 {
  double c = 1.0, s = 0.0;
  Vec2 p = Vec2::Zero();
};

inline Vec2 turn(const Pose2& a, const Vec2& v) { return {a.c * v.x() - a.s * v.y(), a.s * v.x() + a.c * v.y()}; }
inline Vec2 turn_back(const Pose2& a, const Vec2& v) { return {a.c * v.x() + a.s * v.y(), a.c * v.y() - a.s * v.x()}; }
// w x v.
inline Vec2 cross(double w, const Vec2& v) { return {-w * v.y(), w * v.x()}; }
inline double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

inline Pose2 compose(const Pose2& a, const Pose2& b) { return {a.c * b.c - a.s * b.s, a.s * b.c + a.c * b.s, a.p + turn(a, b.p)}; }
inline Pose2 inverse(const Pose2& a) { return {a.c, -a.s, -turn_back(a, a.p)}; }

inline Vec3 to_child(const Pose2& a, const Vec3& V) {
  const double w = V.z();
  const Vec2 v = turn_back(a, {V.x() - w * a.p.y(), V.y() + w * a.p.x()});
  return {v.x(), v.y(), w};
}
inline Vec3 to_parent(const Pose2& a, const Vec3& V) {
  const double w = V.z();
  const Vec2 v = turn(a, {V.x(), V.y()});
  return {v.x() + w * a.p.y(), v.y() - w * a.p.x(), w};
}
inline Vec3 wrench_to_parent(const Pose2& a, const Vec3& F) {
  const Vec2 f = turn(a, {F.x(), F.y()});
  return {f.x(), f.y(), F.z() + a.p.x() * f.y() - a.p.y() * f.x()};
}
inline Vec3 wrench_to_child(const Pose2& a, const Vec3& F) {
  const Vec2 f = turn_back(a, {F.x(), F.y()});
  return {f.x(), f.y(), F.z() - (a.p.x() * F.y() - a.p.y() * F.x())};
}
inline Vec3 bracket(const Vec3& W, const Vec3& V) { return {-W.z() * V.y() + W.y() * V.z(), W.z() * V.x() - W.x() * V.z(), 0.0}; }
// Matrix of to_child.
inline Mat3 child_matrix(const Pose2& a) {
  Mat3 X;
  X << a.c, a.s, -a.c * a.p.y() + a.s * a.p.x(), -a.s, a.c, a.s * a.p.y() + a.c * a.p.x(), 0.0, 0.0, 1.0;
  return X;
}

// Column by column over n x 3 arrays: out_k += a_k . f.
inline void add_dots(const MatX3& A, const Vec3& f, double* out) {
  Eigen::Map<VecX>(out, A.rows()) += A.col(0) * f[0] + A.col(1) * f[1] + A.col(2) * f[2];
}
inline Vec3 dots(const MatX3& A, const VecX& x) { return {A.col(0).dot(x), A.col(1).dot(x), A.col(2).dot(x)}; }

struct Frame {
  int part = ground;
  bool flexible = false;
  Pose2 pose;  // in the part
  // Constants of a flexible frame: undeformed node, constant offset from it, columns of the displacement and rotation.
  Vec2 origin, offset, arm;
  double node_angle = 0.0, offset_angle = 0.0;
  VecX phi_x, phi_y, psi;
  MatX phi2_x, phi2_y;  // empty: none
  // Of the state.
  VecX h_x, h_y, scratch;  // phi2 q
  MatX3 B;                 // n x 3
  Vec3 W = Vec3::Zero(), V = Vec3::Zero(), bias = Vec3::Zero();
};

struct Body {
  int n = 0;
  double mass = 0.0, J0 = 0.0;
  Vec2 md0 = Vec2::Zero();
  VecX md1_x, md1_y, J1, Cr0, ksigma, stiffness;
  MatX md2_x, md2_y, J2, Cr1, Cr1_difference, Me, Ke, De;  // Cr1_difference = Cr1 - Cr1^T
  // Of the state.
  Mat3 Mrr;
  MatX3 Mre;  // n x 3
  VecX J2q, work;
  Vec3 cr;
  VecX ce;
};

struct Joint {
  JointKind kind = JointKind::weld;
  double sense = 1.0;                                         // of the axis against the normal
  Pose2 zero;                                                 // planar axes of B in those of A at the coordinates' origin
  Vec2 direction = Vec2::Zero(), direction_y = Vec2::Zero();  // of translations, planar axes of A
  int nv = 0;
  // Of the state.
  Pose2 pose;
  Mat3 S = Mat3::Zero();
  Vec3 W, bias;
};

struct PlanarPart {
  Body body;
  Joint joint;
  Pose2 step, in_base, world;
  VecX q, qd, qdd, elastic, load_e, fe, tau;
  Vec3 V, A0, A, load, fr;
  Mat3 Mrr;
  MatX3 Mre, C, Fe, scratch;
  MatX Mee;
  Mat3 Hj, Fj;
  MatX3 F;  // columns are coordinates: (nv + n) x 3
};

struct Row {
  ClosureRow::Kind kind;
  int loop = -1;  // index into Data::loop_frames, -1: a locked rate
  int lock = 0;
  Vec2 u = Vec2::Zero(), b = Vec2::Zero();
  double constant = 0.0, out_of_plane2 = 0.0, length = 0.0;
};

struct PlanarCluster {
  std::vector<Pose2> entry;
  std::vector<Row> rows;  // all of the loops, in closure.h's order
  Mat3 Ibb;
  MatX3 Ib, U, DinvUt;
  std::vector<std::pair<int, int>> runs;  // of independent rates: first, count
  Vec3 pb, base_V, base_A;
};

}  // namespace planar

struct PlanarDynamics::Data {
  using Frame = planar::Frame;
  using Pose2 = planar::Pose2;
  Vec3 gravity = Vec3::Zero();  // planar world axes
  Mat3 world_axes;              // columns: planar axes in the world
  std::vector<Frame> frames;
  std::vector<planar::PlanarPart> parts;
  std::vector<planar::PlanarCluster> clusters;
  std::vector<Vec3> load_direction;  // planar world or frame axes
  double applied = 0.0;
  struct Builder;

  void frame_pose(Frame& f, const VecX& q);
  void frame_jacobian(Frame& f);
  void frame_velocity(Frame& f);
  void cluster_frames(const Model& model, int k, Work& work);
  void cluster_chain(const Model& model, int k, const Work& work);
  Pose2 in_base(const Model& model, int cluster, int frame) const;
  void closure_line(const Model& model, int cluster, const planar::Row& row, bool elastic, VecX& line);
  void project(const Model& model, int cluster, int frame, const Vec3& F, bool elastic, VecX& out);
  double row_residual(const Model& model, int cluster, const planar::Row& row, const Work& work) const;
  void close_positions(const Model& model, int cluster, Work& work);
  void cluster_velocities(const Model& model, int cluster, const Work& work);
  void close_velocities(const Model& model, int cluster, Work& work);
  void body_mass(planar::PlanarPart& p);
  void body_velocity_terms(planar::PlanarPart& p);
  void loads(const Model& model, const Work& work);
  void assemble(const Model& model, int cluster, Work& work);
  void reduce(const Model& model, int cluster, Work& work);
  void start_composites(const Model& model, const Work& work);
  void add_to_carrier(const Model& model, int cluster, const Work& work);
  void solve_cluster(const Model& model, int cluster, Work& work);
  void part_accelerations(const Model& model, int cluster, const Work& work);
  void accelerations(const Model& model, Work& work);
};

}  // namespace flexframe::sim
