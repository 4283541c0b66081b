// Coulomb friction in joints with exact stick and slip, and its regularised version.
//
// Slipping, a rate feels -sign(rate) mu N r (r: 1 for translations, the law's radius for rotations); sticking, it is held by one more
// closure condition (ClusterWork::locked) whose multiplier must stay within mu_s N r. Changes are events (events.h): a rate that
// comes to zero, a multiplier that reaches its bound. Where several rates rest together the one whose bound is exceeded most is let go
// first, until none is exceeded (an active-set solution of the complementarity conditions; Pfeiffer and Glocker, Multibody Dynamics with
// Unilateral Contacts, 1996, ch. 5). A lock that the others already hold carries nothing; that sharing is not determined by rigid bodies.
//
// Normal force "reaction": the joint's own reaction across the direction of motion (prismatic, cylindrical: the force normal to the
// axis; planar: along the normal; others: the whole force; moments of a guide make no friction). It depends linearly on the friction
// forces themselves and is solved for by Newton's method.
//
// Rates that slip on one surface are a group with one speed of slip s, and friction opposes the slip whatever its direction (Coulomb's
// disc): x and y of a planar joint, the three rates of a ball, distance and radius times angle of a cylindrical joint, the velocities and
// the angular velocities of a free one. They stick together, within |force| <= mu_s N, and slip together: -mu N r w/s. Where the slip comes
// to rest its direction is not defined beyond: there that of the last step is kept (`along`), so that the equations are smooth through the
// event and its root along that direction is located; near it a turn is a turn, and at rest (tolerance of the speeds so far) the group
// sticks. Let go, it slips along the direction d in which it then accelerates: (1 lambda + mu N A) d = A F, |d| = 1, with the mobility A of
// the slip and the force F that was held.
//
// Regularised: -(mu + (mu_s - mu) exp(-(s/5v)^2)) N r tanh(s/v) w/s with the law's velocity scale v and the speed s; nothing ever sticks.
#pragma once

#include "sim/dynamics/reactions.h"
#include "sim/dynamics/work.h"

#include <string>
#include <vector>

namespace flexframe::sim {

enum class FrictionPhase { regularised, stick, forward, backward, slip };  // slip: of a group, in any direction

struct FrictionPoint {
  int part = 0, rate = 0;      // rate of the part's joint
  int cluster = 0, local = 0;  // the same rate within its cluster
  Friction law;
  double arm = 1.0;          // m (rotations) or 1
  int first = 0, count = 1;  // points that share its speed of slip
  double weight = 1.0;       // of the rate in that speed
  double along = 0.0;        // of a group: its part in the direction of slip at the last step
  FrictionPhase phase = FrictionPhase::forward;
  double normal = 0.0;  // N, as last found
  double hold = 0.0;    // N or Nm: what the lock exerts on the rate (stick)
};

struct FrictionState {
  std::vector<FrictionPoint> points;
  bool reactions = false;   // any normal force is a reaction
  double fastest = 0.0;     // m/s, largest rate of a point so far: what "at rest" is measured against
  double tolerance = 1e-6;  // of the run: a group slower than this share of `fastest` rests
  Reactions scratch;
};

// The points of a model, one a rate of every joint with friction; sizes JointWork::friction.
FrictionState make_friction(const Model& model, Work& work);

// Accelerations with friction: sets JointWork::friction, calls update_accelerations, finds normal forces and the forces that hold.
// W: Work or PlaneWork. Positions and velocities come first. Throws SimulationError where no friction force is consistent with its reaction
// (jamming). rates_alone: update_accelerations_alone (reduced_mass.h) where no reaction is asked for.
template <class W>
void update_friction_accelerations(const Model& model, FrictionState& friction, W& work, bool rates_alone = false);

// Finds the phases of what rests at the present state: the points in `resting` and those that stick. Renews locks, partitions,
// positions and velocities of the clusters concerned. Names of joints that changed are added to `changes` ("joint 'guide' sticks").
void settle_friction(const Model& model, FrictionState& friction, const std::vector<int>& resting, Work& work,
                     std::vector<std::string>& changes);

// The directions of slip of groups as they are at the present velocities: after every step, and (turn) where the slip has turned off the
// last one.
void follow_slip(const Model& model, FrictionState& friction, const Work& work, bool turn = false);
// Whether the slip of a point's group has come to rest.
bool slip_rests(const FrictionPoint& point, const FrictionState& friction, const Model& model, const Work& work);

// Positive while a point's phase holds, zero at its end: rate in the direction of slip (m/s or rad/s), or bound minus force (stick); of a
// group its first point's, the others' stay positive.
// Needs velocities, for sticking points accelerations.
double friction_margin(const FrictionPoint& point, const FrictionState& friction, const Model& model, const Work& work);

}  // namespace flexframe::sim
