#include "render/film/rigid_mesh.h"

#include "render/film/shapes.h"
#include "render/picture/shapes.h"
#include "sim/base/spatial.h"
#include "sim/scene/joint_kinds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>

namespace flexframe::film {
namespace {

using std::numbers::pi;

glm::dvec3 to_glm(const sim::Vec3& v) { return {v.x(), v.y(), v.z()}; }

constexpr glm::dvec3 x_axis(1, 0, 0), y_axis(0, 1, 0), z_axis(0, 0, 1);

// A wheel with teeth of straight flanks, a module high above the pitch circle and 1.25 below it, half a pitch wide on it.
Loop gear_outline(double radius, int teeth) {
  const double module = 2.0 * radius / teeth, pitch = 2.0 * pi / teeth;
  const double root = radius - 1.25 * module, tip = radius + module;
  Loop loop;
  for (int k = 0; k < teeth; ++k)
    for (const auto& [share, r] : {std::pair{-0.36, root}, {-0.25, radius}, {-0.13, tip}, {0.13, tip}, {0.25, radius}, {0.36, root}})
      loop.emplace_back(r * std::cos((k + share) * pitch), r * std::sin((k + share) * pitch));
  return loop;
}

// Round ends about two points at -length/2 and length/2 of the second coordinate.
Loop link_outline(double length, double radius) {
  Loop loop;
  constexpr int steps = 24;
  for (int i = 0; i <= steps; ++i) loop.emplace_back(radius * std::cos(pi * i / steps), 0.5 * length + radius * std::sin(pi * i / steps));
  for (int i = 0; i <= steps; ++i) loop.emplace_back(-radius * std::cos(pi * i / steps), -0.5 * length - radius * std::sin(pi * i / steps));
  return loop;
}

std::vector<Loop> with_bore(Loop outline, double radius) {
  std::vector<Loop> loops{std::move(outline)};
  if (radius > 0.0) loops.push_back(circle(radius));
  return loops;
}

// z from eye to eye, x along their holes.
Build link(double length, double width, double thickness, double hole) {
  std::vector<Loop> loops{link_outline(length, 0.5 * width)};
  for (const double end : {-0.5 * length, 0.5 * length}) {
    if (!(hole > 0.0)) break;
    Loop eye = circle(0.5 * hole);
    for (Eigen::Vector2d& p : eye) p.y() += end;
    loops.push_back(std::move(eye));
  }
  return sweep(std::move(loops), {-0.5 * thickness, 0.5 * thickness}, glm::dvec3(0.0), x_axis, y_axis, z_axis);
}

Build from_shape(const render::Shape& shape) {
  Build build;
  for (const glm::vec3& p : shape.positions) build.positions.emplace_back(p);
  for (const glm::uvec3& t : shape.triangles) build.triangles.emplace_back(t);
  return build;
}

// In the shape's own frame.
Build solid(const sim::ShapeDef& s) {
  const std::vector<double> along{-0.5 * s.length, 0.5 * s.length};
  switch (s.kind) {
    case sim::ShapeKind::box:
    case sim::ShapeKind::plate:
      return box(glm::dvec3(0.0), 0.5 * to_glm(s.size));
    case sim::ShapeKind::cylinder:
    case sim::ShapeKind::disc:
      return sweep(with_bore(circle(s.radius), s.inner_radius), along, glm::dvec3(0.0), z_axis, x_axis, y_axis);
    case sim::ShapeKind::gear:
      return sweep(with_bore(gear_outline(s.radius, s.teeth), std::min(s.inner_radius, 0.95 * (s.radius - 2.5 * s.radius / s.teeth))),
                   along, glm::dvec3(0.0), z_axis, x_axis, y_axis);
    case sim::ShapeKind::capsule:
    case sim::ShapeKind::sphere:
      return capsule(glm::dvec3(0.0), s.radius, s.length);
    case sim::ShapeKind::link:
      return link(s.length, s.width, s.thickness, s.hole);
    case sim::ShapeKind::spring:
      return from_shape(render::make_spring({0, 0, -0.5 * s.length}, {0, 0, 0.5 * s.length}, s.radius, s.wire, s.turns));
  }
  return {};
}

void place(Build& build, const sim::Mat3& axes, const sim::Vec3& position) {
  for (glm::dvec3& p : build.positions) p = to_glm(axes * sim::Vec3(p.x, p.y, p.z) + position);
}

// Half edges of the homogeneous box of this mass and inertia: (half edge)^2 = 3/(2 m) (sum of the other two moments less its own).
glm::dvec3 inertia_box(const sim::RigidDef& body) {
  glm::dvec3 half(0.0);
  if (!(body.mass > 0.0)) return half;
  const glm::dvec3 moment(body.inertia[0], body.inertia[1], body.inertia[2]);
  const double sum = moment.x + moment.y + moment.z;
  for (int i = 0; i < 3; ++i) half[i] = std::sqrt(std::max(0.0, 1.5 / body.mass * (sum - 2.0 * moment[i])));
  return half;
}

// That box, visible whatever its sides, with bars to points outside it.
Build box_with_bars(const sim::RigidDef& body, std::span<const HoldingPlace> places, double size) {
  const glm::dvec3 centre = to_glm(body.centre_of_mass);
  glm::dvec3 half = inertia_box(body);
  const double largest = std::max({half.x, half.y, half.z});
  if (largest <= 0.0) half = glm::dvec3(size, 0.6 * size, 0.6 * size);
  // A rod's or plate's thin sides stay visible.
  for (int i = 0; i < 3; ++i) half[i] = std::max(half[i], std::max(0.04 * largest, 0.05 * size));

  Build build = box(centre, half);
  const double bar = std::min(0.3 * size, 0.35 * std::min({half.x, half.y, half.z}));
  const auto reach_out = [&](const glm::dvec3& end) {
    const glm::dvec3 way = end - centre;
    if (std::abs(way.x) <= half.x && std::abs(way.y) <= half.y && std::abs(way.z) <= half.z) return;
    build.add(cylinder(centre, end, std::max(bar, 0.02 * glm::length(way))));
  };
  for (const auto& frame : body.frames) reach_out(to_glm(frame.second));
  for (const HoldingPlace& holding : places)
    if (std::none_of(body.frames.begin(), body.frames.end(), [&](const auto& f) { return to_glm(f.second) == holding.at; }))
      reach_out(holding.at);
  return build;
}

// Pairs of points that join all of them by the shortest ways (Prim).
std::vector<std::pair<size_t, size_t>> shortest_tree(std::span<const glm::dvec3> points) {
  std::vector<std::pair<size_t, size_t>> edges;
  std::vector<double> way(points.size(), std::numeric_limits<double>::infinity());
  std::vector<size_t> from(points.size(), 0);
  std::vector<bool> in(points.size(), false);
  for (size_t count = 0, last = 0; count < points.size(); ++count) {
    in[last] = true;
    size_t next = points.size();
    for (size_t k = 0; k < points.size(); ++k) {
      if (in[k]) continue;
      if (const double d = glm::length(points[k] - points[last]); d < way[k]) way[k] = d, from[k] = last;
      if (next == points.size() || way[k] < way[next]) next = k;
    }
    if (next == points.size()) break;
    edges.emplace_back(from[next], next);
    last = next;
  }
  return edges;
}

// Pairs of points with no third one in or on the ball about both (Gabriel), among the nearest of each: no diagonals of a grid.
std::vector<std::pair<size_t, size_t>> open_neighbours(std::span<const glm::dvec3> points) {
  constexpr size_t most = 24;
  std::vector<std::pair<size_t, size_t>> edges;
  std::vector<size_t> order(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    std::iota(order.begin(), order.end(), size_t{0});
    const auto distance = [&](size_t k) { return glm::length(points[k] - points[i]); };
    const size_t count = std::min(points.size(), most + 1);
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end(),
                      [&](size_t a, size_t b) { return distance(a) < distance(b) || (distance(a) == distance(b) && a < b); });
    for (size_t n = 0; n < count; ++n) {
      const size_t k = order[n];
      const glm::dvec3 middle = 0.5 * (points[i] + points[k]);
      const double radius = 0.5 * distance(k);
      if (!(radius > 0.0)) continue;
      const auto inside = [&](size_t j) { return j != i && j != k && glm::length(points[j] - middle) < (1.0 + 1e-6) * radius; };
      if (std::none_of(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(n), inside)) edges.emplace_back(i, k);
    }
  }
  return edges;
}

// A flat bar with round ends about the pins at both, or a round one where their axis lies along it or there is none.
Build bar_between(const HoldingPlace& a, const HoldingPlace& b, double width, double thickness) {
  const glm::dvec3 way = b.at - a.at, along = glm::normalize(way);
  const glm::dvec3 axis = glm::length(a.axis) > 0.0 ? a.axis : b.axis;
  const glm::dvec3 across = axis - glm::dot(axis, along) * along;
  if (glm::length(across) < 0.5) return cylinder(a.at, b.at, 0.5 * thickness);
  const glm::dvec3 x = glm::normalize(across), y = glm::cross(along, x);
  Build build = link(glm::length(way), width, thickness, 0.0);
  for (glm::dvec3& p : build.positions) p = 0.5 * (a.at + b.at) + p.x * x + p.y * y + p.z * along;
  return build;
}

}  // namespace

render::Mesh make_shapes_mesh(std::span<const sim::ShapeDef> shapes, std::span<const std::optional<glm::vec3>> colors,
                              const std::string& name) {
  Build all;
  std::vector<int> material;
  for (size_t i = 0; i < shapes.size(); ++i) {
    Build one = solid(shapes[i]);
    place(one, shapes[i].axes, shapes[i].position);
    all.add(one);
    material.resize(all.triangles.size(), static_cast<int>(i) + 1);
  }
  render::Mesh mesh = render::make_mesh(std::move(all.positions), std::move(all.triangles), name, flat_bevels);
  const render::MeshMaterial plain = mesh.materials.front();
  for (size_t i = 0; i < shapes.size(); ++i) {
    mesh.materials.push_back(plain);
    if (colors[i]) mesh.materials.back().look.color = *colors[i];
  }
  mesh.triangle_material = std::move(material);
  return mesh;
}

std::vector<HoldingPlace> holding_places(const sim::Scene& scene, const sim::BodyDef& body) {
  std::vector<HoldingPlace> places;
  const auto* rigid = std::get_if<sim::RigidDef>(&body.kind);
  if (!rigid) return places;
  const auto add = [&](const sim::FrameRef& ref, const sim::Vec3& offset, const sim::Vec3& axis) {
    if (ref.body != body.name) return;
    const auto frame = rigid->frames.find(ref.frame);
    places.push_back({to_glm((frame == rigid->frames.end() ? sim::Vec3(sim::Vec3::Zero()) : frame->second) + offset), to_glm(axis)});
  };
  for (const sim::JointDef& joint : scene.joints) {
    if (joint.kind == sim::JointKind::free || joint.kind == sim::JointKind::planar) continue;
    const bool pin = sim::traits(joint.kind).symbol == sim::JointSymbol::pin;
    const sim::Vec3 axis = pin ? joint.axis : sim::Vec3(sim::Vec3::Zero());
    const sim::Mat3 axes = sim::frame_axes(scene, joint.parent);
    add(joint.parent, axes * joint.position, axes * sim::rotation_exp(joint.rotation) * axis);
    add(joint.child, sim::Vec3::Zero(), sim::frame_axes(scene, joint.child) * axis);
  }
  for (const sim::ForceDef& force : scene.forces) {
    if (force.kind != sim::ForceKind::spring_damper && force.kind != sim::ForceKind::bushing) continue;
    add(force.on, sim::Vec3::Zero(), sim::Vec3::Zero());
    add(force.from, sim::Vec3::Zero(), sim::Vec3::Zero());
  }
  return places;
}

render::Mesh make_rigid_mesh(const sim::RigidDef& body, std::span<const HoldingPlace> places, double size, int index,
                             const std::string& name) {
  const double block = 0.035 * size;
  std::vector<HoldingPlace> apart;
  double reach = 0.0;
  for (const HoldingPlace& one : places) reach = std::max(reach, glm::length(one.at - places.front().at));
  for (const HoldingPlace& one : places) {
    const auto same =
        std::find_if(apart.begin(), apart.end(), [&](const HoldingPlace& o) { return glm::length(o.at - one.at) <= 1e-3 * reach; });
    if (same == apart.end()) apart.push_back(one);
    else if (glm::length(same->axis) == 0.0) same->axis = one.axis;
  }
  const glm::dvec3 half = inertia_box(body);
  const double middle = std::max(std::min(half.x, half.y), std::min(std::max(half.x, half.y), half.z));
  const bool solid_box = apart.size() > 2 && middle > 0.1 * reach;
  Build build;
  if (apart.size() < 2 || solid_box) {
    build = box_with_bars(body, apart, block);
  } else {
    std::vector<glm::dvec3> points;
    points.reserve(apart.size());
    for (const HoldingPlace& one : apart) points.push_back(one.at);
    // Wide enough for the pins of the picture, never so wide that a short link is a disc.
    const double width = std::min(0.04 * size, 0.25 * reach), thickness = 0.3 * width * (1.0 + 0.12 * (index % 4));
    for (const auto& [a, b] : shortest_tree(points)) build.add(bar_between(apart[a], apart[b], width, thickness));
    // The mass where it lies well beside them.
    const glm::dvec3 centre = to_glm(body.centre_of_mass);
    double beside = std::numeric_limits<double>::infinity();
    size_t nearest = 0;
    for (const auto& [a, b] : shortest_tree(points)) {
      const glm::dvec3 way = points[b] - points[a];
      const double share = std::clamp(glm::dot(centre - points[a], way) / glm::dot(way, way), 0.0, 1.0);
      if (const double d = glm::length(centre - points[a] - share * way); d < beside) beside = d, nearest = share < 0.5 ? a : b;
    }
    if (body.mass > 0.0 && beside > 0.2 * reach) {
      build.add(cylinder(points[nearest], centre, 0.25 * width));
      const double edge = std::clamp(std::max({half.x, half.y, half.z}), 0.6 * width, 0.5 * beside);
      build.add(box(centre, glm::dvec3(edge)));
    }
  }
  return render::make_mesh(std::move(build.positions), std::move(build.triangles), name, flat_bevels);
}

render::Mesh make_lattice_mesh(std::span<const glm::dvec3> points, double radius, const std::string& name) {
  std::vector<std::pair<size_t, size_t>> edges = shortest_tree(points);
  for (const auto& edge : open_neighbours(points)) edges.push_back(edge);
  for (auto& [a, b] : edges)
    if (a > b) std::swap(a, b);
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  Build build;
  for (const auto& [a, b] : edges) {
    if (!(glm::length(points[a] - points[b]) > 0.0)) continue;
    const glm::dvec3 way = points[b] - points[a], along = glm::normalize(way);
    const glm::dvec3 other = std::abs(along.x) < 0.9 ? x_axis : y_axis;
    const glm::dvec3 u = glm::normalize(glm::cross(other, along)), v = glm::cross(along, u);
    Loop ring;
    for (int k = 0; k < 12; ++k) ring.emplace_back(radius * std::cos(2.0 * pi * k / 12), radius * std::sin(2.0 * pi * k / 12));
    std::vector<double> stations;
    for (int k = 0; k <= 6; ++k) stations.push_back(glm::length(way) * k / 6.0);
    Build tube = sweep({ring}, stations, points[a], along, u, v);
    // Ends as fans about the points themselves, by which the map knows that the tubes are one body.
    tube.triangles.resize(tube.triangles.size() - 2 * (ring.size() - 2));
    const int sides = static_cast<int>(ring.size()), last = static_cast<int>(tube.positions.size()) - sides, first = last + sides;
    tube.positions.insert(tube.positions.end(), {points[a], points[b]});
    for (int k = 0; k < sides; ++k) {
      tube.triangles.push_back({(k + 1) % sides, k, first});
      tube.triangles.push_back({last + k, last + (k + 1) % sides, first + 1});
    }
    build.add(tube);
  }
  return render::make_mesh(std::move(build.positions), std::move(build.triangles), name);
}

}  // namespace flexframe::film
