#include "sim/model/supports.h"

#include "sim/scene/joint_kinds.h"

#include <set>

namespace flexframe::sim {
namespace {

// Whether the joint holds every rotation.
bool never_turns(const JointTraits& t) { return t.place && t.rates.find('r') == std::string_view::npos; }

// Names of the bodies (and "ground") that joints tie to `from`, without passing `barred`.
std::set<std::string> tied_to(const Scene& scene, const std::string& from, const std::string& barred) {
  std::set<std::string> seen{from};
  std::vector<std::string> queue{from};
  while (!queue.empty()) {
    const std::string here = queue.back();
    queue.pop_back();
    if (here == "ground") continue;  // everything that stands on the ground is tied to it, not to one another
    for (const JointDef& j : scene.joints) {
      if (j.kind == JointKind::free || (j.parent.body != here && j.child.body != here)) continue;
      const std::string& other = j.parent.body == here ? j.child.body : j.parent.body;
      if (other != barred && seen.insert(other).second) queue.push_back(other);
    }
  }
  return seen;
}

}  // namespace

std::vector<Support> supports_of(const Scene& scene, const std::string& body) {
  std::vector<Support> all, grounded, carried;
  // The heaviest rigid body of those that are tied to this one.
  std::string base;
  double heaviest = 0.0;
  const std::set<std::string> tied = tied_to(scene, body, "");
  for (const BodyDef& b : scene.bodies)
    if (const auto* rigid = std::get_if<RigidDef>(&b.kind); rigid && tied.contains(b.name) && rigid->mass > heaviest) {
      heaviest = rigid->mass;
      base = b.name;
    }
  for (const JointDef& j : scene.joints) {
    if (j.kind == JointKind::free || (j.parent.body != body && j.child.body != body)) continue;
    Support s;
    s.joint = &j;
    s.parent = j.parent.body == body;
    s.frame = s.parent ? j.parent : j.child;
    s.on_ground = (s.parent ? j.child.body : j.parent.body) == "ground";
    s.clamp = never_turns(traits(j.kind)) || !j.motion.empty() || j.motion_table;
    const std::set<std::string> way = tied_to(scene, s.parent ? j.child.body : j.parent.body, body);
    all.push_back(s);
    if (way.contains("ground")) grounded.push_back(s);
    if (way.contains(base)) carried.push_back(s);
  }
  if (!grounded.empty()) return grounded;
  return carried.empty() ? all : carried;
}

}  // namespace flexframe::sim
