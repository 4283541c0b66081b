// Whole turns between two samples. A pose knows none: how far one frame has turned against another about an axis since the sample before
// is told by the joints between them, where these turn about that axis alone.
#pragma once

#include "sim/dynamics/work.h"
#include "sim/model/model.h"

#include <memory>
#include <vector>

namespace flexframe::sim {

class TurnPath {
 public:
  // From frame a (-1: the world) to frame b; axis in the axes of a, zero: that of the first joint between them that turns. Null where a
  // joint between them turns about another axis or about several, or where none turns.
  static std::shared_ptr<TurnPath> find(const Model& model, int a, int b, const Vec3& axis = Vec3::Zero());
  // In the axes of a.
  const Vec3& axis() const { return axis_; }
  // How far b has turned against a since the last call, rad; of the first call 0. Elastic bodies' share is left out.
  double since_last(const Model& model, const Work& work);

 private:
  struct Term {
    int part = 0, coordinate = 0;
    double sign = 1.0;
  };
  std::vector<Term> terms_;
  Vec3 axis_ = Vec3::Zero();
  double last_ = 0.0;
  bool begun_ = false;
};

}  // namespace flexframe::sim
