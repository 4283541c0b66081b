#include "sim/results/turn_path.h"

#include "sim/model/bodies.h"
#include "sim/scene/joint_kinds.h"

#include <algorithm>
#include <optional>
#include <string_view>

namespace flexframe::sim {
namespace {

// Axes are the same within rounding of what they are made of.
constexpr double same_axis = 1e-9;

std::vector<int> carriers(const Model& model, int part) {
  std::vector<int> out;
  for (; part != ground; part = model.parts[part].parent) out.push_back(part);
  return out;
}

// The coordinate of a joint that turns about its axis; -1: it does not turn. None: it turns about other axes.
std::optional<int> turning_coordinate(const TreeJoint& joint) {
  const std::string_view rates = traits(joint.kind).rates;
  const auto turns = std::count(rates.begin(), rates.end(), 'r');
  if (turns > 1 || has_orientation(joint.kind) || joint.curve) return std::nullopt;
  return turns == 0 ? -1 : static_cast<int>(rates.find('r'));
}

}  // namespace

std::shared_ptr<TurnPath> TurnPath::find(const Model& model, int a, int b, const Vec3& axis) {
  auto out = std::make_shared<TurnPath>();
  std::vector<int> from = carriers(model, a < 0 ? ground : model.frames[a].part), to = carriers(model, model.frames[b].part);
  while (!from.empty() && !to.empty() && from.back() == to.back()) from.pop_back(), to.pop_back();
  Vec3 along = Vec3::Zero();  // in the axes of what carries both
  const auto follow = [&](const std::vector<int>& parts, double sign, Mat3& R) {
    for (auto at = parts.rbegin(); at != parts.rend(); ++at) {
      const TreeJoint& joint = model.parts[*at].joint;
      const std::optional<int> k = turning_coordinate(joint);
      if (!k) return false;
      R *= rest_pose(model, joint.inboard).R;
      if (*k >= 0) {
        const Vec3 about = R * joint.axis;
        if (along.isZero(0.0)) along = about;
        if (about.cross(along).norm() > same_axis) return false;
        out->terms_.push_back({*at, *k, (joint.reversed ? -sign : sign) * (about.dot(along) > 0.0 ? 1.0 : -1.0)});
      }
      R *= rest_pose(model, joint.outboard).R.transpose();
    }
    return true;
  };
  Mat3 R_a = Mat3::Identity(), R_b = Mat3::Identity();
  if (!axis.isZero(0.0)) {
    // The axis stands in the axes of a, to which only joints about it may lead.
    for (auto at = from.rbegin(); at != from.rend(); ++at) {
      const TreeJoint& joint = model.parts[*at].joint;
      R_a *= rest_pose(model, joint.inboard).R * rest_pose(model, joint.outboard).R.transpose();
    }
    along = (R_a * (a < 0 ? axis : Vec3(rest_pose(model, a).R * axis))).normalized();
    R_a.setIdentity();
  }
  if (!follow(from, -1.0, R_a) || !follow(to, 1.0, R_b) || out->terms_.empty()) return nullptr;
  if (a >= 0) R_a *= rest_pose(model, a).R;
  out->axis_ = R_a.transpose() * along;
  return out;
}

double TurnPath::since_last(const Model& model, const Work& work) {
  double sum = 0.0;
  for (const Term& term : terms_) {
    const Part& part = model.parts[term.part];
    sum += term.sign * (part.joint.motion >= 0 ? work.motion[part.joint.motion].value : work.q[part.q0 + term.coordinate]);
  }
  const double since = begun_ ? sum - last_ : 0.0;
  last_ = sum, begun_ = true;
  return since;
}

}  // namespace flexframe::sim
