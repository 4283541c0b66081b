// The equations of motion of a scene that moves in one plane, with three components where space has six: what cannot occur is not
// computed. The same recursion over the same clusters as dynamics.h, about five times cheaper; a scene that this file does not cover
// (spatial, friction, a joint or force of another kind) is integrated by dynamics.h.
//
// Twist [vx, vy, w], wrench [fx, fy, m], pose (cos, sin, x, y), each in planar axes of its frame whose third axis is the plane's
// normal. Per body only the sums that its in-plane motion meets are kept: md x and y, J zz, Cr z.
#pragma once

#include "sim/dynamics/work.h"

#include <memory>

namespace flexframe::sim {

class PlanarDynamics {
 public:
  // From the assembled start in `work`. Null where the scene does not move in a plane or has a part that is not covered;
  // `why_not` then says which.
  static std::unique_ptr<PlanarDynamics> make(const Model& model, const Work& work, std::string& why_not);
  ~PlanarDynamics();

  // From work.q, the independent rates in work.w, expressions and motions: closes the loops in work.q, completes work.w and fills
  // work.wdot. Throws SimulationError as dynamics.h does.
  void evaluate(const Model& model, Work& work);
  // Whether the rates of an unchanged state follow the loads by `load_responses`: no prescribed motion, no body on another's cluster.
  bool follows_loads(const Model& model) const;
  // Of the state evaluated last, load by load: change of the independent accelerations and of the power per unit of its value; n + 1
  // numbers each. Springs and uniform loads, which have none here: NaN.
  void load_responses(const Model& model, Work& work, VecX& out);
  // Of the state evaluated last, W.
  double applied_power() const;
  double dissipated_power(const Model& model, const Work& work) const;

 private:
  struct Data;
  explicit PlanarDynamics(std::unique_ptr<Data> data);
  std::unique_ptr<Data> data_;
};

}  // namespace flexframe::sim
