#include "sim/results/driven_coordinates.h"

#include "sim/scene/motion_function.h"
#include "sim/scene/scene_reader.h"

#include <algorithm>

namespace flexframe::sim {

void add_driven_coordinates(Results& results) {
  std::vector<JointDef> joints;
  try {
    if (!results.scene_text.empty()) joints = parse_scene(results.scene_text, results.scene_file).joints;
  } catch (const InputError&) {
    return;
  }
  for (const JointDef& def : joints) {
    if (!follows_motion(def)) continue;
    const auto found = std::find_if(results.joints.begin(), results.joints.end(), [&](const ResultJoint& j) { return j.name == def.name; });
    if (found == results.joints.end() || found->value.cols() > 0) continue;
    const TimeFunction motion = motion_function(def);
    found->value.resize(results.times.size(), 1);
    found->rate.resize(results.times.size(), 1);
    for (Eigen::Index i = 0; i < results.times.size(); ++i) {
      const TimeJet jet = motion.jet(results.times[i]);
      found->value(i, 0) = jet.value;
      found->rate(i, 0) = jet.rate;
    }
  }
}

}  // namespace flexframe::sim
