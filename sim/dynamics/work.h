// Everything that changes during an evaluation of the equations of motion: poses, twists, inertias, sized once for a model.
//
// What is counted by coordinates and rates (Rates) is the same wherever the mechanism moves; what is counted by twists and wrenches
// (Motion) has six components in space and three in a plane. The recursions are templates over the work they are given: Work is motion in
// space, PlaneWork (plane_work.h) the rates of a Work with motion in a plane.
#pragma once

#include "sim/base/columns.h"
#include "sim/bodies/body_terms.h"
#include "sim/model/joint_motion.h"
#include "sim/model/model.h"

namespace flexframe::sim {

// Which smooth piece of a stop's force holds: while integrating it is held between located events, else found from the state.
enum class StopPhase { live, free, lower, lower_parting, upper, upper_parting };

// Of a part's tree joint.
struct JointWork {
  VecX friction;  // friction forces on the joint's rates (friction.h), empty where the joint has none
  StopPhase stop = StopPhase::live;
};

// Which coordinates of a cluster are free and which follow from closure.
struct Partition {
  std::vector<int> rows;      // closure rows that are independent
  std::vector<int> ind, dep;  // rates, counted within the cluster
  int plan = 0;               // PartitionPlan::made of its plan; 0: none yet, as whoever changes one in place has to leave it
  // Sign of the determinant of its rows' columns dep where it was chosen. Where that changes the loops close in another way: another
  // assembly of the mechanism begins (closure.h: crossed). 0: not known, either is allowed.
  int side = 0;
};

// What every evaluation reads of a partition (closure.h: plan_of).
struct PartitionPlan {
  int made = 0;            // its number among all: what was made with it holds as long as this stays; 0: not made yet
  bool deforms = false;    // a deformation is among what closes the loops
  size_t first = 0;        // of the cluster's parts the first that a dependent rate moves; those before it stay while loops are closed
  std::vector<int> place;  // per rate of the cluster: its place among the independent ones, or -1 - that among the dependent ones
  std::vector<std::pair<int, int>> runs;  // of independent rates that follow one another: first, count
};

struct ClusterWork {
  Partition partition;
  PartitionPlan plan;
  std::vector<int> locked;  // rates of the cluster held at rest (stiction), each one more closure row after the loops' rows
  int carried = 0;          // the first so many of them have no inertia and go at lock_rate (massless.h)
  int side = 0;             // sign of the determinant of those columns of G whose inverse is Gd, as last made
  VecX lock_value, lock_rate;
  MatX G;                          // all rows x nv (update_closure_matrix)
  VecX residual;                   // per row: closure error
  VecX rate, bias;                 // per row of the partition: velocity, acceleration at zero coordinate accelerations
  MatX Gd;                         // of the partition's rows of G the inverse of their columns dep
  VecX line, res, step, ind_rate;  // scratch
  MatX E;                          // dep x ind: w_dep = E w_ind + e0
  VecX e0, gamma;                  // dep: from prescribed motions; acceleration at zero independent accelerations
  MatX M;                          // nv x nv, lower half
  VecX r;                          // nv bias minus applied forces
  bool whole = true;               // M and r are of the accelerations found last, not only L (few_rates.h)
  MatX L;                          // ind x ind: reduced mass matrix = L L^T, lower half
  VecX inertia;                    // its diagonal
  MatX DinvUt;                     // scratch of reduce_inertia
  MatX Mid, Et, T;                 // ind x dep: of M, E^T, scratch of the projection
  VecX h, a;                       // reduced forces, independent accelerations
  bool fed_known = false;          // the accelerations found last left `fed` (few_rates.h)
  double fed = 0.0;                // power that prescribed motions feed into the cluster, W
};

// How the balance of what has no inertia splits at present (massless.h): indices into MasslessRates::rates.
struct MasslessWork {
  std::vector<int> damped, stiff;
  MatX undamped;   // moving x stiff: directions in which no damper acts, identity on `stiff`
  MatX stiffness;  // stiff x stiff, N/m: Newton's matrix, as last made
};

// What holds between two events: pressed and damped, pressed where damping would pull, apart. pushed: ever faster than it was met.
enum class ContactPhase { live, apart, pressed, pushed, parting };
enum class ContactSlip { none, sticks, slips };

struct ContactWork {
  ContactPhase phase = ContactPhase::live;
  ContactSlip slip = ContactSlip::none;
  double impact = 0.0;  // m/s: the speed that its restitution counts from
  // Of the present state: how deep, its rate, the normal force; velocity of the surfaces against each other, and friction, axes of `from`.
  double depth = 0.0, rate = 0.0, force = 0.0;
  Vec3 slide = Vec3::Zero(), friction = Vec3::Zero();
};

// What expressions read, and what blocks make of it.
struct SignalWork {
  std::vector<double> value;        // of Model::signals
  std::vector<double> size;         // the largest so far of the vectors that they are components of
  std::vector<VecX> state, output;  // per block; state: of a sampled one
  VecX z, zdot;                     // further states (blocks, contacts) and their rates
  std::vector<ContactWork> contacts;
  double fastest = 0.0;  // of the bodies so far, m/s, where there are contacts
};

// What a model says of its parts and clusters that every evaluation asks; made once (make_work).
struct Carrying {
  std::vector<char> elastic;  // per part: something hangs on it that adds to its elastic mass
  std::vector<char> moves;    // per part: a coordinate moves it (its own, its joint's or one before: else it rests or follows motions)
  std::vector<char> link;     // per cluster: one rigid part on a joint of one rate, as the links of chains are
  // Per part: its joint's twists, S, Hj and `driven`, are constants (set_fixed_twists); at_body: and its outboard frame is the body frame.
  enum Fixed : char { moving, constant, at_body };
  std::vector<Fixed> fixed;
  std::vector<char> inside;   // per part: hangs_inside
  std::vector<char> follows;  // per cluster: one of its joints follows a prescribed motion
  bool driven = false;        // some joint does
  bool loaded = false;        // something makes loads on the parts (loads.h), or is read where they are made
  // Parts whose bodies deform, whose joints follow motions, and whose joints or bodies may take out energy.
  std::vector<int> deforming, following, resisting, damped;
  std::vector<std::vector<int>> bent;  // per cluster: those of its frames that move within their parts
};

struct Rates {
  Carrying carrying;
  std::vector<JointWork> joints;  // per part
  std::vector<ClusterWork> clusters;
  VecX q, w, wdot;  // q_all, w_all, accelerations of w_all
  double time = 0.0;
  std::vector<double> expression_value;
  std::vector<double> expression_rate;  // where MasslessRates are
  MasslessWork massless;
  std::vector<TimeJet> motion;  // jets of prescribed motions, by expression
  double applied = 0.0;         // power of the loads that were last updated, W: forces, torques and uniform loads
  long evaluations = 0, closure_iterations = 0;
  int indefinite = -1;  // part whose kinetic energy was last found not to be positive
  bool idle = false;    // something turns without inertia and without a moment (dynamics.cpp)
  SignalWork signals;
};

// Kept from a frame's pose for B and for the bias.
template <class S>
struct NodeMotion;
template <>
struct NodeMotion<Space> {
  Vec3 theta = Vec3::Zero();  // rotation vector psi q + 1/2 q psi2 q and its series
  RotationSeries series{0.0};
  Eigen::MatrixX3d phi2q, psi2q;      // n x 3 each (where there is any)
  Mat3 rest_axes = Mat3::Identity();  // body axes to the undeformed frame's
};
template <>
struct NodeMotion<Plane> {
  Eigen::MatrixX2d phi2q;  // n x 2
};

template <class S>
struct FrameMotion : NodeMotion<S> {
  bool flexible = false;                      // the frame moves within its part
  typename S::Pose pose;                      // in the part's body frame
  typename S::Columns B;                      // twist relative to the body frame per elastic rate, frame axes (flexible frames only)
  typename S::Twist W = S::Twist::Zero();     // B qd
  typename S::Twist V = S::Twist::Zero();     // twist, frame axes
  typename S::Twist bias = S::Twist::Zero();  // dV/dt = to_child(pose, dV_part/dt) + B qdd + bias
  VecX scratch;
};
using FrameWork = FrameMotion<Space>;

template <class S>
struct PartMotion {
  JointMotionIn<S> joint;
  typename S::Pose step;        // body frame in the inboard frame
  typename S::Pose in_base;     // body frame in the cluster's base frame
  typename S::Pose in_carrier;  // body frame in that of the part which carries it (in the world on ground)
  typename S::Pose world;
  VecX q, qd, qdd;                           // elastic
  VecX elastic;                              // K q + D qd + ksigma
  typename S::Twist V = S::Twist::Zero();    // twist, body axes
  typename S::Twist A0 = S::Twist::Zero();   // dV/dt when all coordinate accelerations and the base's vanish
  typename S::Twist own = S::Twist::Zero();  // of A0 what the joint and the part's outboard frame make
  typename S::Twist A = S::Twist::Zero();    // dV/dt
  TermsIn<S> terms;
  typename S::Twist load = S::Twist::Zero();  // applied wrench about the body frame, body axes
  VecX load_e;                                // applied generalised elastic forces
  // Composite inertia of the part with what hangs on it, in the extended velocity [V; qd], and composite bias force.
  typename S::Inertia Mrr = S::Inertia::Zero();
  typename S::Columns Mre;
  MatX Mee;
  typename S::Twist fr = S::Twist::Zero();
  VecX fe;
  typename S::Columns C;                        // twist of the body frame per elastic rate, joint held (flexible outboard frames only)
  typename S::Columns Hj;                       // twist of the body frame per joint rate
  typename S::Twist driven = S::Twist::Zero();  // the same of a prescribed motion
  typename S::Columns Fj, Fe;                   // composite momentum per joint rate and per elastic rate
  typename S::Columns F, scratch;               // of nv + n, of n
  VecX tau;                                     // applied joint forces
  int like = 0;  // the part whose constants are read instead of its own, which are equal: a long chain then fits in the cache
};
using PartWork = PartMotion<Space>;

// Of what carries a cluster.
template <class S>
struct BaseMotion {
  typename S::Inertia Ibb = S::Inertia::Zero();  // inertia and bias of the cluster about its base frame
  typename S::Twist pb = S::Twist::Zero();
  typename S::Columns Ib;  // of nv: coupling to the base twist
  typename S::Columns U;   // of ind
  // Of the base frame, where the cluster is carried: V where it closes loops, A where it is not a link.
  typename S::Twist V = S::Twist::Zero(), A = S::Twist::Zero();
};

// A loop joint's frames in the base frame of its cluster, and b in a.
template <class S>
struct LoopPose {
  typename S::Pose a, b, relative;
};

// ClosureRow in a plane, with what the heights of its frames leave of it.
struct PlaneRow {
  ClosureRow::Kind kind = ClosureRow::translation;
  Vec2 u = Vec2::Zero(), b = Vec2::Zero();
  double constant = 0.0, height2 = 0.0, length = 0.0;
};
template <class S>
struct RowConstants;
template <>
struct RowConstants<Space> {
  using Row = ClosureRow;
};
template <>
struct RowConstants<Plane> {
  using Row = PlaneRow;
};

// A row of a loop among those of the partition: its coefficients on the relative velocity (lv) and angular velocity (lw) in the axes of a,
// and what its unit multiplier does to b, about the base frame's origin in its axes. On a it acts the other way.
template <class S>
struct LoopRow {
  int row, loop, at;  // of the partition; which of the cluster's loops, and which of that one's rows
  typename RowConstants<S>::Row closure;
  typename S::Linear lv;
  typename S::Angular lw;
  typename S::Twist on_b;
};
// Of the place where a cluster's loops were closed last: what rates need there.
template <class S>
struct LoopMotion {
  std::vector<LoopPose<S>> poses;  // in the order of the cluster's loops
  std::vector<LoopRow<S>> rows;
  // Rows of one loop that follow one another: they go their way together.
  struct Run {
    int loop, from, count;
  };
  std::vector<Run> runs;
  int listed = 0;  // PartitionPlan::made of the rows
};

template <class S>
struct Motion {
  std::vector<FrameMotion<S>> frames;
  std::vector<PartMotion<S>> parts;
  std::vector<BaseMotion<S>> bases;  // per cluster
  std::vector<LoopMotion<S>> loops;  // per cluster
};

struct Work : Rates, Motion<Space> {
  using In = Space;
};

Work make_work(const Model& model);
// Room for a part's blocks.
template <class S>
void size_part(const Part& part, PartMotion<S>& out);
// Its joint's twists, Hj or `driven`, where they are constants (Carrying::fixed). outboard: pose of the joint's outboard frame in the
// part's body frame; Joint: TreeJoint or PlaneJoint. What the joint's motion has beside, W and bias, stays zero.
template <class S, class Joint>
void set_fixed_twists(const Part& part, const Joint& joint, const typename S::Pose& outboard, PartMotion<S>& out) {
  double q[7] = {};
  zero_coordinates(part.joint.kind, q);
  update_joint_position(joint, q, out.joint);
  for (int k = 0; k < part.joint.nv; ++k) column(out.Hj, k) = to_parent(outboard, typename S::Twist(out.joint.S.col(k)));
  if (part.joint.motion >= 0) out.driven = to_parent(outboard, typename S::Twist(out.joint.S.col(0)));
}

// Constants of a part for update_mass, update_velocity_terms and the frames at its nodes.
inline const FlexibleBody& kinetics(const Model& model, const Work& work, int part) { return model.parts[work.parts[part].like].body; }

}  // namespace flexframe::sim
