#include "render/import/scene_shapes.h"

#include "render/film/places.h"
#include "sim/base/spatial.h"
#include "sim/base/words.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::imports {
namespace {

// Kind, length, section and mesh.
void dress_body(const sim::BodyDef& def, sim::ResultBody& body) {
  if (const auto* beam = std::get_if<sim::BeamDef>(&def.kind)) {
    body.kind = "beam";
    body.length = beam->length;
    body.section = beam->section;
  } else if (std::holds_alternative<sim::RigidDef>(def.kind)) {
    body.kind = "rigid";
  }
  if (def.mesh && body.mesh.empty() && body.surface.triangles.rows() == 0) body.mesh = def.mesh->string();
}

// The joint's parent frame at every sample; none where the results do not have its body.
void add_joint(const sim::JointDef& def, sim::Results& results, const sim::Scene& scene) {
  const std::string parent = def.parent.frame.empty() ? def.parent.body : def.parent.body + "." + def.parent.frame;
  const std::optional<film::FramePlace> place = film::find_place(results, &scene, parent);
  if (!place) return;
  const Eigen::Index nt = results.times.size();
  sim::ResultJoint joint;
  joint.name = def.name;
  joint.kind = sim::traits(def.kind).word;
  joint.position.resize(nt, 3);
  joint.orientation.resize(nt, 4);
  for (Eigen::Index i = 0; i < nt; ++i) {
    const glm::dmat4 pose = film::place_pose(results, *place, {i, 0.0}, 1.0);
    sim::Mat3 axes;
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r) axes(r, c) = pose[c][r];
    joint.position.row(i) = (sim::Vec3(pose[3].x, pose[3].y, pose[3].z) + axes * def.position).transpose();
    const sim::Quat q = sim::Quat(axes * sim::rotation_exp(def.rotation)).normalized();
    joint.orientation.row(i) << q.w(), q.x(), q.y(), q.z();
  }
  results.joints.push_back(std::move(joint));
}

}  // namespace

void dress_by_scene(const sim::Scene& scene, sim::Results& results) {
  std::vector<std::string> names, unknown;
  for (const sim::BodyDef& def : scene.bodies) names.push_back(def.name);
  for (sim::ResultBody& body : results.bodies) {
    const auto at = std::find(names.begin(), names.end(), body.name);
    if (at == names.end()) unknown.push_back(body.name);
    else dress_body(scene.bodies[at - names.begin()], body);
  }
  if (unknown.size() == results.bodies.size())
    throw sim::InputError(fmt::format("{}: describes none of the bodies {}; its bodies: {}", scene.file.string(), sim::list_words(unknown),
                                      sim::list_words(names)));
  if (!unknown.empty()) results.statistics.notes.tell("", fmt::format("the scene does not describe: {}", sim::list_words(unknown)));
  // In the scene's order, on which colours and shapes of bodies side by side depend.
  const auto rank = [&](const sim::ResultBody& body) { return std::find(names.begin(), names.end(), body.name); };
  std::stable_sort(results.bodies.begin(), results.bodies.end(), [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
  for (const sim::JointDef& def : scene.joints) add_joint(def, results, scene);
  results.scene_file = scene.file.string();
  results.scene_text = scene.text;
  if (!scene.title.empty()) results.title = scene.title;
}

}  // namespace flexframe::imports
