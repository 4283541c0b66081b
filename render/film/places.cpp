#include "render/film/places.h"

#include "sim/bodies/beam_pieces.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace flexframe::film {
namespace {

// Undeformed origin of a frame that the scene's definition of the body names.
std::optional<glm::dvec3> defined_origin(const sim::BodyDef& body, const std::string& frame) {
  const auto of = [&](const std::map<std::string, sim::Vec3>& frames) -> std::optional<glm::dvec3> {
    const auto found = frames.find(frame);
    if (found == frames.end()) return std::nullopt;
    return glm::dvec3(found->second.x(), found->second.y(), found->second.z());
  };
  if (const auto* rigid = std::get_if<sim::RigidDef>(&body.kind)) return of(rigid->frames);
  if (const auto* state = std::get_if<sim::StateSpaceDef>(&body.kind)) return of(state->rigid.frames);
  if (const auto* beam = std::get_if<sim::BeamDef>(&body.kind)) {
    const auto on_axis = [&](double share) {
      const sim::Vec3 p = sim::place_on_axis(*beam, share);
      return glm::dvec3(p.x(), p.y(), p.z());
    };
    if (frame == "root") return on_axis(0.0);
    if (frame == "tip") return on_axis(1.0);
    if (const auto found = beam->frames.find(frame); found != beam->frames.end()) return on_axis(found->second);
    int number = 0;
    if (frame.starts_with("node[") && std::from_chars(frame.data() + 5, frame.data() + frame.size(), number).ec == std::errc()) {
      const int all = beam->elements * (beam->model == sim::BeamModel::mixed ? beam->volumes : 1);
      if (number >= 0 && number <= all) return on_axis(static_cast<double>(number) / all);
    }
  }
  return std::nullopt;
}

// Hangs a place of a body on its node `nearest`, or on the two nodes beside it along the beam's axis.
void carry(const sim::ResultBody& body, const glm::dvec3& origin, int nearest, FramePlace& place) {
  place.origin = origin;
  if (std::abs(origin.y) + std::abs(origin.z) > 1e-9 * body.length && body.kind == "beam" && nearest >= 0) {
    place.node = place.next = nearest;
    return;
  }
  if (body.nodes.empty()) return;

  // Carried by the nodes on both sides along the beam's axis.
  double below = -1e300, above = 1e300;
  for (size_t k = 0; k < body.nodes.size(); ++k) {
    const double x = body.nodes[k].origin.x();
    if (x <= place.origin.x + 1e-9 * body.length && x > below) below = x, place.node = static_cast<int>(k);
    if (x >= place.origin.x - 1e-9 * body.length && x < above) above = x, place.next = static_cast<int>(k);
  }
  if (place.node < 0) place.node = place.next;
  if (place.next < 0) place.next = place.node;
  place.share = above > below + 1e-9 * body.length && place.node != place.next ? (place.origin.x - below) / (above - below) : 0.0;
}

// The place without the frame's own axes.
std::optional<FramePlace> find_origin(const sim::Results& results, const sim::Scene* scene, const std::string& name) {
  FramePlace place;
  if (name == "ground") return place;
  if (name.starts_with("ground.")) {
    if (!scene) return std::nullopt;
    const auto at = scene->ground_frames.find(name.substr(7));
    if (at == scene->ground_frames.end()) return std::nullopt;
    place.origin = {at->second.x(), at->second.y(), at->second.z()};
    return place;
  }
  // Names of bodies and frames hold no dots.
  const size_t dot = name.find('.');
  const std::string body_name = name.substr(0, dot), frame = dot == std::string::npos ? "" : name.substr(dot + 1);
  for (size_t b = 0; b < results.bodies.size(); ++b)
    if (results.bodies[b].name == body_name) place.body = static_cast<int>(b);
  if (place.body < 0) return std::nullopt;
  const sim::ResultBody& body = results.bodies[place.body];
  if (frame.empty()) {
    // A body's own frame, of a beam its root, moves against the frame that it is shown from unless that is the same.
    place.held = body.held_position.rows() > 0;
    for (size_t k = 0; k < body.nodes.size() && body.kind == "beam"; ++k)
      if (body.nodes[k].name == "root") {
        place.node = place.next = static_cast<int>(k);
        const sim::Vec3& at = body.nodes[k].origin;
        place.origin = {at.x(), at.y(), at.z()};
      }
    return place;
  }

  std::optional<glm::dvec3> origin;
  if (scene)
    for (const sim::BodyDef& def : scene->bodies)
      if (def.name == body_name) origin = defined_origin(def, frame);
  // A node of this name, else the scene's frame; nodes of volumes have names of their own, the first one's "tip" among them. Where nodes do
  // not lie along x, the nearest carries the frame.
  int nearest = -1;
  double apart = 1e300;
  for (size_t k = 0; k < body.nodes.size(); ++k) {
    const glm::dvec3 at(body.nodes[k].origin.x(), body.nodes[k].origin.y(), body.nodes[k].origin.z());
    const double away = origin ? glm::length(at - *origin) : 0.0;
    if ((body.nodes[k].name == frame || "node[" + body.nodes[k].name + "]" == frame) &&
        away <= 1e-6 * (body.length > 0.0 ? body.length : 1.0)) {
      place.node = place.next = static_cast<int>(k);
      place.origin = at;
      return place;
    }
    if (away < apart) apart = away, nearest = static_cast<int>(k);
  }
  if (!origin) return std::nullopt;
  carry(body, *origin, nearest, place);
  return place;
}

}  // namespace

std::optional<FramePlace> find_place(const sim::Results& results, const sim::Scene* scene, const std::string& name) {
  std::optional<FramePlace> place = find_origin(results, scene, name);
  const size_t dot = name.find('.');
  if (!place || !scene || dot == std::string::npos) return place;
  const sim::Mat3 axes = sim::frame_axes(*scene, {name.substr(0, dot), name.substr(dot + 1)});
  for (int c = 0; c < 3; ++c) place->axes[c] = glm::dvec3(axes(0, c), axes(1, c), axes(2, c));
  return place;
}

std::optional<FramePlace> place_along(const sim::Results& results, const sim::Scene& scene, const std::string& beam, double share) {
  const auto def = std::find_if(scene.bodies.begin(), scene.bodies.end(), [&](const sim::BodyDef& b) { return b.name == beam; });
  const auto* const kind = def == scene.bodies.end() ? nullptr : std::get_if<sim::BeamDef>(&def->kind);
  FramePlace place;
  for (size_t b = 0; b < results.bodies.size(); ++b)
    if (results.bodies[b].name == beam) place.body = static_cast<int>(b);
  if (!kind || place.body < 0) return std::nullopt;
  const sim::ResultBody& body = results.bodies[place.body];
  const sim::Vec3 at = sim::place_on_axis(*kind, share);
  int nearest = -1;
  double apart = 1e300;
  for (size_t k = 0; k < body.nodes.size(); ++k)
    if (const double away = (body.nodes[k].origin - at).norm(); away < apart) apart = away, nearest = static_cast<int>(k);
  carry(body, {at.x(), at.y(), at.z()}, nearest, place);
  return place;
}

glm::dmat4 place_pose(const sim::Results& results, const FramePlace& frame, const SamplePlace& at, double scale) {
  glm::dmat4 local(frame.axes);
  local[3] = glm::dvec4(frame.origin, 1.0);
  if (frame.body < 0) return local;
  const sim::ResultBody& body = results.bodies[frame.body];
  const glm::dmat4 pose = body_pose(body, at);
  if (frame.held) {
    const sim::Pose held = held_pose(body, at);
    glm::dmat3 turned(1.0);
    for (int c = 0; c < 3; ++c) turned[c] = glm::dvec3(held.R(0, c), held.R(1, c), held.R(2, c));
    local = glm::dmat4(turned * frame.axes);
    local[3] = glm::dvec4(scale * glm::dvec3(held.p.x(), held.p.y(), held.p.z()), 1.0);
    return pose * local;
  }
  if (frame.node < 0 || body.displacement.size() == 0) return pose * local;
  const auto value = [&](const sim::RowsX& series, int node, int c) {
    const double now = series(at.index, 3 * node + c);
    return at.share > 0.0 ? now + at.share * (series(at.index + 1, 3 * node + c) - now) : now;
  };
  glm::dvec3 u(0.0), turn(0.0);
  for (int c = 0; c < 3; ++c) {
    u[c] = (1.0 - frame.share) * value(body.displacement, frame.node, c) + frame.share * value(body.displacement, frame.next, c);
    if (body.rotation.size() > 0)
      turn[c] = (1.0 - frame.share) * value(body.rotation, frame.node, c) + frame.share * value(body.rotation, frame.next, c);
  }
  local[3] = glm::dvec4(frame.origin + scale * u, 1.0);
  // Rotation by the vector (Rodrigues).
  const double angle = glm::length(turn);
  if (angle > 0.0) {
    const glm::dvec3 e = turn / angle;
    const glm::dmat3 cross(glm::dvec3(0, e.z, -e.y), glm::dvec3(-e.z, 0, e.x), glm::dvec3(e.y, -e.x, 0));
    const glm::dmat3 r = glm::dmat3(1.0) + std::sin(angle) * cross + (1.0 - std::cos(angle)) * (cross * cross);
    for (int c = 0; c < 3; ++c) local[c] = glm::dvec4(r * frame.axes[c], 0.0);
  }
  return pose * local;
}

}  // namespace flexframe::film
