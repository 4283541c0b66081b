#include "sim/effects.h"

#include "sim/joint_motion.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::sim {
namespace {

// Directions count as parallel or normal to rounding of what a person types (1e-9).
constexpr double aligned = 1e-9;
bool parallel(const Vec3& a, const Vec3& b) { return a.cross(b).norm() <= aligned * std::max(1.0, a.norm()); }
bool normal(const Vec3& a, const Vec3& b) { return std::abs(a.dot(b)) <= aligned * std::max(1.0, a.norm()); }

int body_index(const Scene& scene, const std::string& name) {
  for (size_t i = 0; i < scene.bodies.size(); ++i)
    if (scene.bodies[i].name == name) return static_cast<int>(i);
  return -1;
}

bool planar_about(const Scene& scene, const std::vector<Mat3>& orientation, const Vec3& n) {
  if (!normal(scene.simulation.gravity, n)) return false;
  const auto frame_axes = [&](const FrameRef& ref) {
    const int b = body_index(scene, ref.body);
    return b < 0 ? Mat3(Mat3::Identity()) : orientation[b];
  };
  std::vector<char> held(scene.bodies.size(), 0);
  for (const JointDef& j : scene.joints) {
    const Vec3 a = frame_axes(j.parent) * rotation_exp(j.rotation) * j.axis;
    switch (j.kind) {
      case JointKind::weld: break;
      case JointKind::revolute: case JointKind::planar:
        if (!parallel(a, n)) return false;
        break;
      case JointKind::prismatic: case JointKind::point_on_line: case JointKind::point_on_plane:
        if (j.kind == JointKind::point_on_plane ? !normal(a, n) : !normal(a, n)) return false;
        break;
      case JointKind::distance: break;
      default: return false;
    }
    if (is_tree_kind(j.kind)) {
      const int b = body_index(scene, j.child.body);
      if (b >= 0) held[b] = 1;
      const int p = body_index(scene, j.parent.body);
      if (p >= 0 && j.child.body == "ground") held[p] = 1;
    }
  }
  // A body without a joint is free to leave the plane.
  if (std::find(held.begin(), held.end(), 0) != held.end()) return false;
  for (const ForceDef& f : scene.forces) {
    if (f.kind == ForceKind::bushing || f.kind == ForceKind::spring_damper) return false;
    const Vec3 d = f.follower ? Vec3(frame_axes(f.on) * f.direction) : f.direction;
    if (f.kind == ForceKind::torque ? !parallel(d, n) : !normal(d, n)) return false;
  }
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[i].kind);
    if (!beam) continue;
    const Vec3 local = orientation[i].transpose() * n;
    if (!parallel(local, Vec3::UnitZ()) && !parallel(local, Vec3::UnitY())) return false;
    if (std::abs(beam->section.iyz) > 1e-12 * (beam->section.iy + beam->section.iz)) return false;
    for (double q : beam->initial.q)
      if (q != 0.0) return false;
    for (double q : beam->initial.qd)
      if (q != 0.0) return false;
  }
  return true;
}

}  // namespace

Vec3 plane_normal(const Scene& scene, const std::vector<Mat3>& orientation) {
  // Candidates: the axes that hinges have, then the world's.
  std::vector<Vec3> candidates;
  for (const JointDef& j : scene.joints)
    if (j.kind == JointKind::revolute || j.kind == JointKind::planar) {
      const int b = body_index(scene, j.parent.body);
      candidates.push_back((b < 0 ? Mat3(Mat3::Identity()) : orientation[b]) * rotation_exp(j.rotation) * j.axis);
      break;
    }
  for (const Vec3& e : {Vec3(Vec3::UnitZ()), Vec3(Vec3::UnitY()), Vec3(Vec3::UnitX())}) candidates.push_back(e);
  for (const Vec3& n : candidates)
    if (planar_about(scene, orientation, n)) return n;
  return Vec3::Zero();
}

int attachment_count(const Scene& scene, const std::string& body) {
  int count = 0;
  for (const JointDef& j : scene.joints) count += (j.parent.body == body) + (j.child.body == body);
  for (const ForceDef& f : scene.forces)
    if (f.kind != ForceKind::distributed) count += (f.on.body == body) + (f.from.body == body);
  return count;
}

EffectDecision decide_effects(const BodyDef& body, const BeamDef& beam, const Vec3& normal_in_body, int attachments) {
  EffectDecision out;
  BeamEffects& e = out.effects;
  const auto say = [&](const std::string& text) { out.why.push_back(fmt::format("body '{}': {}", body.name, text)); };
  if (!beam.effects.automatic) {
    for (const std::string& name : beam.effects.names) {
      if (name == "axial") e.axial = true;
      if (name == "bending_xy") e.bending_xy = true;
      if (name == "bending_xz") e.bending_xz = true;
      if (name == "torsion") e.torsion = true;
      if (name == "stiffening") e.stiffening = true;
      if (name == "shear") e.shear = true;
    }
    say(beam.effects.names.empty() ? "rigid: the scene lists no effect" : fmt::format("effects as the scene lists them: {}", fmt::join(beam.effects.names, ", ")));
  } else {
    const bool planar = !normal_in_body.isZero(0.0);
    if (planar) {
      e.bending_xy = parallel(normal_in_body, Vec3::UnitZ());
      e.bending_xz = !e.bending_xy;
      say(fmt::format("{} on, {} and torsion off: the scene moves in a plane, they cannot occur", e.bending_xy ? "bending_xy" : "bending_xz",
                      e.bending_xy ? "bending_xz" : "bending_xy"));
    } else {
      e.bending_xy = e.bending_xz = true;
      e.torsion = attachments > 1;
      say("bending_xy and bending_xz on: the scene is spatial");
      say(e.torsion ? "torsion on: what is attached may twist it" : "torsion off: it is held in one place only, nothing twists it");
    }
    e.stiffening = true;
    say("stiffening on: axial forces may be carried");
    say("axial off: a slender beam bends long before it stretches");
  }
  if (beam.model == BeamModel::modal && !beam.modes.empty()) {
    // The modes that a scene names are the coordinates it wants.
    e.axial = beam.modes.count("axial") > 0;
    e.bending_xy = beam.modes.count("bending_xy") > 0;
    e.bending_xz = beam.modes.count("bending_xz") > 0;
    e.torsion = beam.modes.count("torsion") > 0;
    say("elastic coordinates as the scene's modes list them");
  }
  return out;
}

}  // namespace flexframe::sim
