// Expressions that read the state: from their names in the scene to the model's signals.
#pragma once

#include "sim/model/model.h"

namespace flexframe::sim {

struct FunctionSource {
  const std::string& text;
  const std::vector<Reading>& reads;
  int on = -1, from = -1;      // frames between which `length` and `rate` are read
  std::vector<int> path = {};  // of a cable, instead of these two
};

// Adds what it reads to Model::signals and the function to Model::functions; its index. Parts, frames and blocks come first. owner: as
// messages name it. Throws InputError.
int add_function(Model& model, const Scene& scene, const std::string& owner, const FunctionSource& source);

// Whether an expression of the scene reads the value or rate of a joint, which then keeps its coordinate.
bool is_read(const Scene& scene, const JointDef& joint);

}  // namespace flexframe::sim
