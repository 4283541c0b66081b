// A model with every solid and shell divided once in each direction and every beam halved: what tells how good a mesh is.
#pragma once

#include "sim/reduce/fe_model.h"

#include <map>

namespace flexframe::sim {

// quadratic: linear solids keep their size and get nodes in the middles of their edges (and full integration) instead: better than divided
// once, and for bricks half as large.
enum class FeFiner { divided, quadratic };

// The nodes of the model keep their indices; new ones follow. Middles lie where the elements' own shape functions have them, of flat shells
// on the smooth surface through their corners (fe_facets.h), where middle nodes that are not on it move to. A new node
// between nodes that are all held, or all tied to one spider, is so too; an averaging spider's weight there is the mean of theirs.
struct FeRefined {
  FeModel model;
  std::vector<FeConstraint> held;
  bool raised = false;  // solids have become quadratic
  // Of each new node: nodes of the element it lies in, and their shape functions there.
  std::map<int, std::vector<std::pair<int, double>>> shares;
};

// nullopt: equations tie nodes of solids or shells (what follows for new nodes between them is not known), a model of matrices, or nothing
// to divide. Trusses stay whole: halved they would be mechanisms.
std::optional<FeRefined> refine(const FeModel& model, const std::vector<FeConstraint>& held, FeFiner finer = FeFiner::divided);

// How many nodes the divided model has about, times those of `model`, by its elements: 8 where solids are most, 4 shells, 2 beams.
double refined_growth(const FeModel& model, FeFiner finer = FeFiner::divided);

}  // namespace flexframe::sim
