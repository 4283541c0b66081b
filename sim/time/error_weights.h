// What a tolerance means: the size of every state, against which its error is weighed.
//
// The tolerance is one of positions relative to the size of the mechanism. Sizes go by group, so that a coordinate passing through zero is
// not resolved to nothing, and a small one beside large ones not to more than its share: joint coordinates one by one, elastic coordinates
// by the displacement they cause, against the largest elastic displacement in the same tree (all that hangs together from ground).
//
// An error in the rate of something of frequency f becomes one of rate / f in its position. Rates of fast vibration are asked for their
// position's accuracy only, else the integrator resolves vibrations that nobody can see; and so are the rates of joints on vibrating
// bodies, which shake along.
//
// Where a whole tree moves by less than a hundred-thousandth of the mechanism, such sizes would drown its motion: its share (`narrowed`)
// makes them as much smaller, and displacements are then measured from the start.
#pragma once

#include "sim/base/types.h"
#include "sim/scene/scene.h"

#include <vector>

namespace flexframe::sim {

struct Model;
struct System;
struct Partition;

class ErrorWeights {
 public:
  // Sizes of the groups anew from state y, for a method. Calls before a run and where it takes another method.
  void begin(const System& system, Method method, const VecX& y);
  // Raises the sizes to what state y shows.
  void update(const System& system, const VecX& y);
  // 1 / (tolerance x size of the component), one number a state.
  void write(double tolerance, double* weight) const;
  // Size of component i, against which a difference is small; not narrowed.
  double size(Eigen::Index i) const { return scale_[i] / share_of_[i]; }
  // The sizes in the state packed anew, of `states` components, after partitions or locks changed; before: the partitions of the old one.
  void repack(const System& system, const std::vector<Partition>& before, Eigen::Index old_states, Eigen::Index states);

  // Shares of the trees (by the part on ground, one number a part), set before a run; empty: the mechanism's size for all.
  std::vector<double> shares;
  // After a run: the shares that its motion calls for; empty where the ones it had will do.
  std::vector<double> narrowed(const System& system) const;

 private:
  void prepare(const System& system);
  void find_states(const System& system, Eigen::Index states);
  void elastic_sizes(const System& system, const VecX& y);
  void raise_elastic(const System& system, const VecX& y);
  void raise_joints(const System& system, const VecX& y);
  void raise_work(const System& system, const VecX& y);
  void follow_ranges(const VecX& y);
  double share(int tree) const { return shares.empty() ? 1.0 : shares[tree]; }
  double gone(const VecX& y, Eigen::Index i, int tree) const { return share(tree) < 1.0 ? y[i] - start_[i] : y[i]; }

  VecX scale_, share_of_;                      // of every state; the share of its tree
  VecX start_, low_, high_;                    // coordinates at the start, and between what they stayed
  std::vector<int> tree_;                      // of every part: the tree it belongs to, by one of its parts
  std::vector<VecX> reaches_;                  // of every part: displacement per elastic coordinate, m
  std::vector<double> part_size_;              // m
  std::vector<int> rate_of_;                   // state of every rate; -1: dependent
  std::vector<double> moved_, speed_, shake_;  // of every tree: largest elastic displacement (m), rate (m/s), rad/s of rigid bodies on it
  std::vector<char> timed_;                    // trees whose dry friction turns round or sticks
  double elastic_slack_ = 0.28;                // elastic displacements are asked for tolerance^(1 - slack) of their own range at least
  double strictness_ = 1.0;
  double least_share_ = 1.0;  // of all trees
};

}  // namespace flexframe::sim
