// Everything that changes during an evaluation of the equations of motion: poses, twists, inertias, sized once for a model.
#pragma once

#include "sim/base/spatial.h"
#include "sim/bodies/body_terms.h"
#include "sim/model/joint_motion.h"
#include "sim/model/model.h"

namespace flexframe::sim {

struct FrameWork {
  bool flexible = false;     // the frame moves within its part
  Pose pose;                 // in the part's body frame
  Mat6X B;                   // 6 x n, twist relative to the body frame per elastic rate, frame axes (flexible frames only)
  Vec6 W = Vec6::Zero();     // B qd
  Vec6 V = Vec6::Zero();     // twist, frame axes
  Vec6 bias = Vec6::Zero();  // dV/dt = to_child(pose, dV_part/dt) + B qdd + bias
  // Kept from the pose for B and for the bias: rotation vector psi q, its series, phi2 q (n x 3, where there is any).
  Vec3 theta = Vec3::Zero();
  RotationSeries series{0.0};
  Eigen::MatrixX3d phi2q;
  Mat3 rest_axes = Mat3::Identity();  // body axes to the undeformed frame's
  VecX scratch;
};

// Which smooth piece of a stop's force holds: while integrating it is held between located events, else found from the state.
enum class StopPhase { live, free, lower, lower_parting, upper, upper_parting };

struct PartWork {
  JointMotion joint;
  Pose step;     // body frame in the inboard frame
  Pose in_base;  // body frame in the cluster's base frame
  Pose world;
  VecX q, qd, qdd;         // elastic
  VecX elastic;            // K q + D qd + ksigma
  Vec6 V = Vec6::Zero();   // twist, body axes
  Vec6 A0 = Vec6::Zero();  // dV/dt when all coordinate accelerations and the base's vanish
  Vec6 A = Vec6::Zero();   // dV/dt
  BodyTerms terms;
  Vec6 load = Vec6::Zero();  // applied wrench about the body frame, body axes
  VecX load_e;               // applied generalised elastic forces
  // Composite inertia of the part with what hangs on it, in the extended velocity [V; qd], and composite bias force.
  Mat6 Mrr;
  Mat6X Mre;
  MatX Mee;
  Vec6 fr = Vec6::Zero();
  VecX fe;
  Mat6X C;           // 6 x n: twist of the body frame per elastic rate, joint held (flexible outboard frames only)
  Mat6X Hj;          // 6 x nv: twist of the body frame per joint rate
  Mat6X Fj, Fe;      // composite momentum per joint rate and per elastic rate
  Mat6X F, scratch;  // 6 x (nv + n), 6 x n
  VecX tau;          // applied joint forces
  VecX friction;     // friction forces on the joint's rates (friction.h), empty where the joint has none
  StopPhase stop = StopPhase::live;
  int like = 0;  // the part whose constants are read instead of its own, which are equal: a long chain then fits in the cache
};

// Which coordinates of a cluster are free and which follow from closure.
struct Partition {
  std::vector<int> rows;      // closure rows that are independent
  std::vector<int> ind, dep;  // rates, counted within the cluster
};

struct ClusterWork {
  Partition partition;
  std::vector<int> locked;  // rates of the cluster held at rest (stiction), each one more closure row after the loops' rows
  int carried = 0;          // the first so many of them have no inertia and go at lock_rate (massless.h)
  VecX lock_value, lock_rate;
  MatX G;                        // rows x nv, all closure rows
  VecX residual, rate, bias;     // per row: closure error, velocity from prescribed motions, acceleration at zero coordinate accelerations
  Eigen::PartialPivLU<MatX> lu;  // of G(rows, dep)
  MatX Gd, Gi;                   // G(rows, dep), -G(rows, ind)
  VecX line, res, step, ind_rate;  // scratch
  MatX E;                          // dep x ind: w_dep = E w_ind + e0
  VecX e0, gamma;                  // dep: from prescribed motions; acceleration at zero independent accelerations
  MatX M;                          // nv x nv
  Mat6X Ib;                        // 6 x nv coupling to the base twist
  Mat6 Ibb = Mat6::Zero();
  VecX r;  // nv bias minus applied forces
  Vec6 pb = Vec6::Zero();
  MatX D;   // ind x ind
  Mat6X U;  // 6 x ind
  Eigen::LLT<MatX> llt;
  MatX DinvUt;      // ind x 6
  MatX Mid, Et, T;  // ind x dep of M, E^T, dep x ind: scratch of the projection
  VecX h, wdot;     // reduced forces; nv accelerations
  VecX a;           // independent accelerations
  Vec6 base_V = Vec6::Zero(), base_A = Vec6::Zero();
  Pose base_world;
  MatX scratch;
};

// How the balance of what has no inertia splits at present (massless.h): indices into MasslessRates::rates.
struct MasslessWork {
  std::vector<int> damped, stiff;
  MatX undamped;   // moving x stiff: directions in which no damper acts, identity on `stiff`
  MatX stiffness;  // stiff x stiff, N/m: Newton's matrix, as last made
};

struct Work {
  std::vector<FrameWork> frames;
  std::vector<PartWork> parts;
  std::vector<ClusterWork> clusters;
  VecX q, w, wdot;  // q_all, w_all, accelerations of w_all
  double time = 0.0;
  std::vector<double> expression_value;
  std::vector<double> expression_rate;  // where MasslessRates are
  MasslessWork massless;
  std::vector<TimeJet> motion;  // jets of prescribed motions, by expression
  long evaluations = 0, closure_iterations = 0;
  int indefinite = -1;  // part whose kinetic energy was last found not to be positive
  bool idle = false;    // something turns without inertia and without a moment (dynamics.cpp)
};

Work make_work(const Model& model);

// Constants of a part for update_mass, update_velocity_terms and the frames at its nodes.
inline const FlexibleBody& kinetics(const Model& model, const Work& work, int part) { return model.parts[work.parts[part].like].body; }

}  // namespace flexframe::sim
