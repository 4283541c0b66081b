// The equations of statics: what is sought, the forces on it under a share of the loads, their stiffness. Used by the search for an
// equilibrium (statics.h) and by curves of equilibria (load_path.h).
#pragma once

#include "sim/dynamics/directions.h"
#include "sim/dynamics/inverse_dynamics.h"
#include "sim/dynamics/work.h"

#include <vector>

namespace flexframe::sim {

// Per part: whether its elastic coordinates are sought, and whether its joint may move. Per rate of w_all: whether the search leaves its
// coordinate where it is all the same (empty: none).
struct Sought {
  std::vector<char> elastic, joint, left;
};
// Whether a body says of itself that it starts from equilibrium.
bool starts_static(const BodyDef& body);
Sought what_is_sought(const Model& model, const Scene& scene);

// Held joints inside loops become closure conditions, so that no loop moves them; and no longer.
void lock_held(const Model& model, const Sought& sought, Work& work);
void unlock(const Model& model, Work& work);

// The loads at t = 0 itself, whatever piece of them begins there: "t <= 0 ? F : 0" holds a static start by F and lets go.
void load_at_rest(const Model& model, Work& work);

// A mechanism under a share of its loads: gravity, forces and the inertia of prescribed motions.
struct StaticProblem {
  Model model;  // a copy: the share is applied to it
  Vec3 gravity;
  std::vector<double> expression;  // full values
  std::vector<TimeJet> motion;
  Work& work;
  std::vector<Direction> sought;
  VecX scale;  // metres per unit
  RestForces rest;
  bool by_size = false;  // loops are closed by whatever moves most (close_by_size), not by joints first
  // Within stiffness: per part the elastic coordinates whose mass was made last. Elsewhere empty: all are made anew, where
  // bodies weigh or something moves; else none is asked for.
  std::vector<VecX> weighed;
  bool stands = false;  // and whether no rate moves anything: twists are zero then, wherever it stands

  // That share of all loads.
  void load(double share);
  // Forces on what is sought; false where a loop cannot be closed or something is not finite.
  bool evaluate(const std::vector<VecX>* elastic, VecX& f);
  void find_directions(const Sought& what);
  // -df/dx in metres: the elastic stiffness exactly, the rest by differences. In trees that stand under weight and forces of constant
  // direction what a coordinate changes at those of other parts is exact too (it turns them against the loads), and one difference serves
  // all parts at once: 2 evaluations a coordinate of a part and not one for every coordinate of the tree.
  bool stiffness(MatX& K);
  bool by_parts = true;  // false: all by differences, to compare with

 private:
  bool difference(MatX& K);
  bool stands_as_tree() const;
  bool difference_by_parts(const VecX& base, const std::vector<VecX>& elastic, MatX& K);
};
StaticProblem static_problem(const Model& model, Work& work);

// Whether a step from q has led a loop over into another assembly, in which it closes beyond a singular position. A change point, which
// leads there without a gap, is passed by steps so short that what they leave is the root of what closing leaves (assembly_gap.h).
bool leapt(const StaticProblem& p, const VecX& q);

// Loops may have come near a singular position of their dependent coordinates.
void renew_partitions(const Model& model, bool by_size, Work& work);

}  // namespace flexframe::sim
