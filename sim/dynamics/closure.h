// Loop closure inside a cluster: independent coordinates are integrated, the others follow from the loops.
//
// At the position level the dependent coordinates solve the closure equations by Newton's method from a given guess; at the velocity
// and acceleration level they follow linearly (coordinate partitioning, Wehage and Haug 1982; local constraint embedding, Jain 2012).
// W: Work or PlaneWork.
// Redundant rows (a planar loop of spatial revolutes) are found by elimination with complete pivoting and left out.
#pragma once

#include "sim/dynamics/kinematics.h"

namespace flexframe::sim {

// Number of closure rows of a cluster: those of its loops, then one a coupling, then one a locked rate.
template <class W>
int closure_row_count(const Model& model, const W& work, int cluster) {
  size_t rows = work.clusters[cluster].locked.size();
  for (int l : model.clusters[cluster].loops) rows += model.loops[l].rows.size();
  rows += model.clusters[cluster].couplings.size();
  return static_cast<int>(rows);
}
// Name of the joint to which a row belongs, for messages.
std::string closure_row_name(const Model& model, const ClusterWork& work, int cluster, int row);

// Per row what makes a residual one in metres: the cluster's size for angles, 1 else.
template <class W>
VecX closure_row_scales(const Model& model, const W& work, int cluster);
// Whether a deformation is among what closes a cluster's loops: a beam held at both ends, a framework of beams.
bool deformation_closes(const Model& model, const Partition& partition, int cluster);

// What evaluations read of a cluster's partition, made anew where that has changed. One that takes part in an evaluation has it up to date
// once its positions are closed.
void make_plan(const Model& model, int cluster, ClusterWork& cw);
inline const PartitionPlan& plan_of(const Model& model, int cluster, ClusterWork& cw) {
  if (cw.partition.plan == 0 || cw.partition.plan != cw.plan.made) make_plan(model, cluster, cw);
  return cw.plan;
}

// Residuals (m, rad) of all rows at the current poses into ClusterWork::residual.
template <class W>
void update_closure_residual(const Model& model, int cluster, W& work);
// G of all rows.
template <class W>
void update_closure_matrix(const Model& model, int cluster, W& work);
// Of the partition's rows, in its order: rates at the current twists into ClusterWork::rate, accelerations at zero coordinate accelerations
// into ::bias.
template <class W>
void update_closure_rates(const Model& model, int cluster, W& work);

// Whether a cluster's loops, where they were closed last, are beyond a singular position of its partition: in another assembly than the one
// for which it was chosen, unless they have passed a change point since.
inline bool crossed(const ClusterWork& cw) { return cw.partition.side * cw.side < 0; }

// Chooses independent rows and dependent rates from G at the current poses. `strict`: by size alone; otherwise sound pivots that
// keep shallow joints independent are preferred. Conditions that are independent without locked rates are never left out in favour of
// those.
Partition choose_partition(const Model& model, int cluster, Work& work, bool strict);

// Solves the closure for the dependent coordinates, starting from work.q, and leaves positions, Gd and E up to date.
// Throws SimulationError naming the open joint when it cannot be closed.
template <class W>
void close_positions(const Model& model, int cluster, W& work);
// The partition leaves out conditions that followed from the others where it was chosen. Throws SimulationError naming the joint if one of
// them no longer does and the loop comes open: a mechanism that starts in a change point. Positions are up to date.
template <class W>
void require_closed(const Model& model, int cluster, W& work);
// Dependent rates from the independent ones in work.w (positions closed); leaves twists up to date.
template <class W>
void close_velocities(const Model& model, int cluster, W& work);

// Wrenches on the frames a and b of a loop joint, each in its own axes.
template <class W>
struct LoopWrenches {
  typename W::In::Twist on_a, on_b;
};
// Those of unit multipliers weighted by lambda (one a row).
template <class W>
LoopWrenches<W> closure_wrench(const Model& model, const W& work, int cluster, int loop, const VecX& lambda);

// What a rope does to its frames with the multiplier lambda (N; negative where it pulls). Other couplings act on coordinates alone: none.
template <class W>
std::vector<WrenchAt<W>> coupling_wrenches(const Model& model, const W& work, int cluster, const CouplingRow& coupling, double lambda);
// Force or moment on the coordinate of a coupling's term per unit of its multiplier.
template <class W>
double coupling_factor(const Model& model, const W& work, const CouplingRow::Term& term);

// Largest |dw_dep/dw_ind| among joint rates and among elastic rates, each in metres per metre: how far the partition is from singular (1 is
// good). Joints that follow a deformation count a fifth of that. Beyond largest_growth dependent coordinates amplify the error of the
// independent ones: others are to be taken.
inline constexpr double largest_growth = 10.0;
double partition_growth(const Model& model, int cluster, const Work& work);

// Characteristic scale of a rate of a cluster: 1 for a translation, the cluster's size for a rotation, 0 for an elastic rate.
double rate_scale(const Model& model, int cluster, int rate);

}  // namespace flexframe::sim
