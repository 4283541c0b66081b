#include "sim/scene/motion_function.h"

#include "sim/scene/expression.h"

#include <memory>

namespace flexframe::sim {

TimeFunction motion_function(const JointDef& joint) {
  if (const auto& table = joint.motion_table) return TimeFunction(std::make_shared<const CubicTable>(table->x, table->y, table->period));
  return TimeFunction(Expression(joint.motion));
}

}  // namespace flexframe::sim
