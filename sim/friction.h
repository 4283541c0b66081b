// Coulomb friction in joints with exact stick and slip, and its regularised version.
//
// Slipping, a rate feels -sign(rate) mu N r (r: 1 for translations, the law's radius for rotations); sticking, it is held by one more
// closure condition (ClusterWork::locked) whose multiplier must stay within mu_s N r. Changes are events (events.h): a rate that
// comes to zero, a multiplier that reaches its bound. Where several rates rest together the one whose bound is exceeded most is let go first,
// until none is exceeded (an active-set solution of the complementarity conditions; Pfeiffer and Glocker, Multibody Dynamics with
// Unilateral Contacts, 1996, ch. 5). A lock that the others already hold carries nothing; that sharing is not determined by rigid bodies.
//
// Normal force "reaction": the joint's own reaction across the direction of motion (prismatic, cylindrical: the force normal to the
// axis; planar: along the normal; others: the whole force; moments of a guide make no friction). It depends linearly on the friction
// forces themselves and is solved for by Newton's method.
//
// Regularised: -(mu + (mu_s - mu) exp(-(s/5v)^2)) N r tanh(s/v) w/s with the law's velocity scale v and the speed of slip s; nothing ever sticks.
// Rates that slip on one surface share s, so that friction opposes the slip whatever its direction: x and y of a planar joint, the three rates of
// a ball, distance and radius times angle of a cylindrical joint. Exact sticking knows slip along one coordinate at a time (the reader asks for
// `regularised` in planar, spherical and free joints; a cylindrical joint's coordinates stick each for itself).
#pragma once

#include "sim/reactions.h"
#include "sim/work.h"

#include <string>
#include <vector>

namespace flexframe::sim {

enum class FrictionPhase { regularised, stick, forward, backward };

struct FrictionPoint {
  int part = 0, rate = 0;         // rate of the part's joint
  int cluster = 0, local = 0;     // the same rate within its cluster
  Friction law;
  double arm = 1.0;               // m (rotations) or 1
  int first = 0, count = 1;       // points that share its speed of slip (regularised)
  double weight = 1.0;            // of the rate in that speed
  FrictionPhase phase = FrictionPhase::forward;
  double normal = 0.0;            // N, as last found
  double hold = 0.0;              // N or Nm: what the lock exerts on the rate (stick)
};

struct FrictionState {
  std::vector<FrictionPoint> points;
  bool reactions = false;         // any normal force is a reaction
  double fastest = 0.0;           // m/s, largest rate of a point so far: what "at rest" is measured against
  Reactions scratch;
};

// The points of a model, one a rate of every joint with friction; sizes PartWork::friction.
FrictionState make_friction(const Model& model, Work& work);

// Accelerations with friction: sets PartWork::friction, calls update_accelerations, finds normal forces and the forces that hold.
// Positions and velocities come first. Throws SimulationError where no friction force is consistent with its reaction (jamming).
void update_friction_accelerations(const Model& model, FrictionState& friction, Work& work);

// Finds the phases of what rests at the present state: the points in `resting` and those that stick. Renews locks, partitions,
// positions and velocities of the clusters concerned. Names of joints that changed are added to `changes` ("joint 'guide' sticks").
void settle_friction(const Model& model, FrictionState& friction, const std::vector<int>& resting, Work& work, std::vector<std::string>& changes);

// Positive while a point's phase holds, zero at its end: rate in the direction of slip (m/s or rad/s), or bound minus force (stick).
// Needs velocities, for sticking points accelerations.
double friction_margin(const FrictionPoint& point, const Model& model, const Work& work);

}  // namespace flexframe::sim
