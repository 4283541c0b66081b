#include "render/film/joint_symbols.h"

#include "render/film/shapes.h"
#include "sim/scene/joint_kinds.h"

#include <algorithm>
#include <cmath>

namespace flexframe::film {
namespace {

int body_index(const sim::Results& results, const std::string& name) {
  for (size_t b = 0; b < results.bodies.size(); ++b)
    if (results.bodies[b].name == name) return static_cast<int>(b);
  return -1;
}

// Half extents of a beam's section along a direction of the body and across it, m; zero for other bodies.
struct Extent {
  double along = 0.0, across = 0.0;
};
Extent section_extent(const sim::ResultBody& body, const glm::dvec3& direction) {
  Extent out;
  const sim::Section& section = body.section;
  if (body.kind != "beam") return out;
  if (section.outline.empty()) {
    out.along = out.across = std::sqrt(std::max(section.area, 0.0) / M_PI);
    return out;
  }
  for (const Eigen::Vector2d& p : section.outline.front()) {
    out.along = std::max(out.along, std::abs(direction.y * p.x() + direction.z * p.y()));
    out.across = std::max(out.across, std::abs(direction.y * p.y() - direction.z * p.x()));
  }
  return out;
}

JointSymbol make_symbol(int joint, bool fixed, render::Mesh mesh) {
  JointSymbol symbol{.joint = joint, .fixed = fixed, .mesh = std::move(mesh), .triangles = {}, .positions = {}, .normals = {}};
  for (const glm::ivec3& t : symbol.mesh.triangle_points) symbol.triangles.emplace_back(t);
  for (int p : symbol.mesh.point_position) symbol.positions.emplace_back(symbol.mesh.positions[p]);
  symbol.normals.assign(symbol.positions.size(), glm::vec3(0.0f));
  for (size_t k = 0; k < symbol.triangles.size(); ++k) {
    const glm::uvec3 t = symbol.triangles[k];
    const glm::vec3 n = glm::cross(symbol.positions[t.y] - symbol.positions[t.x], symbol.positions[t.z] - symbol.positions[t.x]);
    for (int c = 0; c < 3; ++c) symbol.normals[t[c]] += n;
  }
  for (glm::vec3& n : symbol.normals) n = glm::length(n) > 0.0f ? glm::normalize(n) : glm::vec3(0, 0, 1);
  return symbol;
}

void add_part(Animation& animation, int joint, bool fixed, const Build& part, const std::string& name) {
  animation.symbols.push_back(make_symbol(joint, fixed, render::make_mesh(part.positions, part.triangles, name, flat_bevels)));
}

// What a weld's symbol belongs to.
struct Weld {
  int joint = 0;      // index in Results::joints
  double size = 0.0;  // m, of the machine
};

// A frame's place on a beam; none on other bodies.
std::optional<FramePlace> place_on_beam(const sim::Results& results, const sim::Scene& scene, const sim::FrameRef& frame) {
  std::optional<FramePlace> place = find_place(results, &scene, frame.frame.empty() ? frame.body : frame.body + "." + frame.frame);
  if (!place || place->body < 0 || results.bodies[place->body].kind != "beam") return std::nullopt;
  return place;
}

// The body's axes in the joint's frame at the start.
glm::dmat3 axes_in_joint(const sim::Results& results, int joint, const sim::ResultBody& body) {
  return glm::transpose(glm::dmat3(joint_pose(results.joints[joint], {0, 0.0}))) * glm::dmat3(body_pose(body, {0, 0.0}));
}

// Across a beam's end: as of a clamp on the ground, a plate that begins at the end; else a sleeve around the end, of a tenth more.
void add_around_beam(Animation& animation, const FramePlace& place, const Weld& weld, bool ground, const std::string& name) {
  const sim::ResultBody& body = animation.results->bodies[place.body];
  const double y = section_extent(body, {0, 1, 0}).along, z = section_extent(body, {0, 0, 1}).along, thick = 0.6 * std::max(y, z);
  const glm::dmat3 axes = axes_in_joint(*animation.results, weld.joint, body);
  const bool first = place.origin.x <= 0.5 * body.length;
  if (!ground) {
    const double wide = 1.1 * y + 0.05 * std::max(y, z), high = 1.1 * z + 0.05 * std::max(y, z);
    const Loop outline = body.section.outline.empty() ? circle(1.15 * y) : Loop{{-wide, -high}, {wide, -high}, {wide, high}, {-wide, high}};
    add_part(animation, weld.joint, false, sweep({outline}, {-0.5 * thick, 0.5 * thick}, glm::dvec3(0.0), axes[0], axes[1], axes[2]), name);
    return;
  }
  // Outwards from the end that is nearer.
  const double from = first ? -thick : 0.0, wide = y + 0.8 * std::max(y, z), high = z + 0.8 * std::max(y, z);
  const Loop outline = {{-wide, -high}, {wide, -high}, {wide, high}, {-wide, high}};
  add_part(animation, weld.joint, true, sweep({outline}, {from, from + thick}, glm::dvec3(0.0), axes[0], axes[1], axes[2]), name);
}

// Of a body that the ground holds by a face of its mesh: a plate below that face. False where the joint lies inside the body.
bool add_foot(Animation& animation, int b, const Weld& weld, const std::string& name) {
  const std::vector<glm::dvec3>& positions = animation.bodies[b].mesh.positions;
  if (positions.empty()) return false;
  const sim::Results& results = *animation.results;
  const glm::dmat4 to_joint = glm::inverse(joint_pose(results.joints[weld.joint], {0, 0.0})) * body_pose(results.bodies[b], {0, 0.0});
  std::vector<glm::dvec3> points;
  render::Bounds all;
  for (const glm::dvec3& p : positions) {
    points.emplace_back(to_joint * glm::dvec4(p, 1.0));
    all.add(points.back());
  }
  const glm::dvec3 centre = all.centre(), half = 0.5 * (all.upper - all.lower);
  int k = 0;
  double farthest = 0.0;
  for (int c = 0; c < 3; ++c)
    if (const double share = std::abs(centre[c]) / std::max(half[c], 1e-12); share > farthest) farthest = share, k = c;
  // On a face, or as far outside that the plate is still at the body.
  constexpr double least = 0.8, most = 1.25;
  if (farthest < least || farthest > most) return false;
  const int u = (k + 1) % 3, v = (k + 2) % 3;
  const double outward = centre[k] > 0.0 ? -1.0 : 1.0, face = centre[k] + outward * half[k];
  // As wide as the body is there.
  glm::dvec2 low(1e300), high(-1e300);
  for (const glm::dvec3& p : points)
    if (std::abs(p[k] - face) <= 0.1 * half[k]) {
      low = glm::min(low, glm::dvec2(p[u], p[v]));
      high = glm::max(high, glm::dvec2(p[u], p[v]));
    }
  const double rim = 0.2 * std::max({high.x - low.x, high.y - low.y, 0.02 * weld.size}), thick = 0.6 * rim;
  const Loop outline = {{low.x - rim, low.y - rim}, {high.x + rim, low.y - rim}, {high.x + rim, high.y + rim}, {low.x - rim, high.y + rim}};
  glm::dmat3 axes(0.0);
  axes[0][k] = axes[1][u] = axes[2][v] = 1.0;
  glm::dvec3 origin(0.0);
  origin[k] = face;
  const double from = outward > 0.0 ? 0.0 : -thick;
  add_part(animation, weld.joint, true, sweep({outline}, {from, from + thick}, origin, axes[0], axes[1], axes[2]), name);
  return true;
}

// Whether a weld only goes on with a beam: its end on the next one's, in line.
bool goes_on(const sim::Results& results, const FramePlace& a, const FramePlace& b) {
  const auto at_end = [&](const FramePlace& p) {
    const double length = results.bodies[p.body].length;
    return std::min(p.origin.x, length - p.origin.x) < 1e-6 * length;
  };
  const auto along = [&](const FramePlace& p) { return glm::dvec3(body_pose(results.bodies[p.body], {0, 0.0})[0]); };
  return at_end(a) && at_end(b) && std::abs(glm::dot(along(a), along(b))) > 0.97;
}

void add_weld(Animation& animation, const sim::Scene& scene, const sim::JointDef& def, const Weld& weld) {
  const sim::Results& results = *animation.results;
  const std::optional<FramePlace> child = place_on_beam(results, scene, def.child), parent = place_on_beam(results, scene, def.parent);
  const bool ground = def.parent.body == "ground" || def.child.body == "ground";
  if (child && parent && goes_on(results, *child, *parent)) return;
  if (child || parent) {
    add_around_beam(animation, child ? *child : *parent, weld, ground, def.name);
    return;
  }
  const int b = body_index(results, def.child.body == "ground" ? def.parent.body : def.child.body);
  if (b < 0 || !animation.bodies[b].visible) return;
  if (ground && add_foot(animation, b, weld, def.name)) return;
  const double half = 0.012 * weld.size;
  const Build block = box(glm::dvec3(0.0), glm::dvec3(half));
  add_part(animation, weld.joint, ground, block, def.name);
}

}  // namespace

// Sizes follow the beams that meet in the joint.
void add_joint_symbols(Animation& animation, const sim::Scene& scene, double size) {
  const sim::Results& results = *animation.results;
  for (size_t j = 0; j < results.joints.size(); ++j) {
    const sim::ResultJoint& joint = results.joints[j];
    const auto def = std::find_if(scene.joints.begin(), scene.joints.end(), [&](const sim::JointDef& d) { return d.name == joint.name; });
    if (def == scene.joints.end() || joint.position.rows() == 0) continue;
    const glm::dvec3 axis(def->axis.x(), def->axis.y(), def->axis.z());

    Extent extent{0.006 * size, 0.006 * size};
    for (const sim::FrameRef& end : {def->parent, def->child}) {
      const int b = body_index(results, end.body);
      if (b < 0) continue;
      // The axis in the body's frame at the start.
      const glm::dmat3 turn = glm::transpose(glm::dmat3(body_pose(results.bodies[b], {0, 0.0}))) * glm::dmat3(joint_pose(joint, {0, 0.0}));
      const Extent one = section_extent(results.bodies[b], turn * axis);
      extent.along = std::max(extent.along, one.along);
      extent.across = std::max(extent.across, one.across);
    }

    const int index = static_cast<int>(j);
    switch (sim::traits(def->kind).symbol) {
      case sim::JointSymbol::pin: {
        const double half = 1.12 * extent.along + 0.004 * size, radius = std::max(0.75 * extent.across, 0.005 * size);
        animation.symbols.push_back(make_symbol(index, false, make_cylinder(-half * axis, half * axis, radius, joint.name)));
        break;
      }
      case sim::JointSymbol::ball:
        animation.symbols.push_back(
            make_symbol(index, false, make_sphere(glm::dvec3(0.0), 1.25 * std::max(extent.across, extent.along), joint.name)));
        break;
      case sim::JointSymbol::rail: {
        if (def->parent.body != "ground") break;
        // The rail reaches as far as the child ever goes.
        const int b = body_index(results, def->child.body);
        if (b < 0) break;
        const glm::dmat4 from_world = glm::inverse(joint_pose(joint, {0, 0.0}));
        double low = 1e300, high = -1e300;
        for (Eigen::Index i = 0; i < results.times.size(); ++i) {
          const double along = glm::dot(glm::dvec3(from_world * body_pose(results.bodies[b], {i, 0.0})[3]), axis);
          low = std::min(low, along);
          high = std::max(high, along);
        }
        const double end = 0.06 * size;
        animation.symbols.push_back(
            make_symbol(index, true, make_cylinder((low - end) * axis, (high + end) * axis, 0.004 * size, joint.name)));
        break;
      }
      case sim::JointSymbol::none:
        if (def->kind == sim::JointKind::weld) add_weld(animation, scene, *def, {index, size});
        break;
    }
  }
}

}  // namespace flexframe::film
