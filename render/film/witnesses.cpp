#include "render/film/witnesses.h"

#include "render/film/body_points.h"
#include "render/film/vertex_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <variant>

namespace flexframe::film {
namespace {

// Pictures that are looked at: a camera on a path may be close for a short time.
constexpr int pictures_looked_at = 200;
// Points of a body that are looked at, and where none of these is seen: of a large mesh a close view shows few.
constexpr std::array<size_t, 2> points_looked_at{200, 5000};

// How many times largest a body's elastic displacement is drawn, and how many pixels a metre of it has, at most over the film.
struct BodySight {
  double scale = 1.0, per_metre = 0.0;
};

std::vector<BodySight> sights(const Animation& animation) {
  std::vector<BodySight> out(animation.bodies.size());
  const sim::Results& results = *animation.results;
  std::vector<std::pair<SamplePlace, PictureViews>> pictures;
  for (const int k : looked_at(animation, pictures_looked_at))
    pictures.emplace_back(find_sample(results.times, picture_time(animation, k)), PictureViews(animation, k));
  double nearest = 0.0;
  std::vector<glm::dvec3> at;
  for (size_t b = 0; b < out.size(); ++b) {
    out[b].scale = largest_scale(animation, animation.bodies[b]);
    if (!animation.bodies[b].visible) continue;
    for (const size_t most : points_looked_at) {
      if (out[b].per_metre > 0.0) break;
      const BodyPoints points(animation, b, most);
      for (const auto& [place, views] : pictures) {
        points.at(place, at);
        for (const glm::dvec3& p : at) out[b].per_metre = std::max(out[b].per_metre, views.pixels_per_metre(p));
      }
    }
    nearest = std::max(nearest, out[b].per_metre);
  }
  // Where the body is wrong that the camera follows, all that is seen is.
  if (animation.follow >= 0) out[static_cast<size_t>(animation.follow)].per_metre = nearest;
  return out;
}

// Corners of a rigid body's mesh farthest in three directions: with its origin they tell where it is.
std::vector<sim::Vec3> far_corners(const BodyModel& model) {
  std::vector<sim::Vec3> out;
  for (int axis = 0; axis < 3; ++axis) {
    const auto least = std::max_element(model.mesh.positions.begin(), model.mesh.positions.end(),
                                        [&](const glm::dvec3& a, const glm::dvec3& b) { return std::abs(a[axis]) < std::abs(b[axis]); });
    if (least != model.mesh.positions.end()) out.emplace_back(least->x, least->y, least->z);
  }
  return out;
}

// x/length of the node nearest to a beam's middle, so that a place there changes no elements.
double middle_of(const sim::BeamDef& beam) {
  const int pieces = beam.model == sim::BeamModel::mixed ? beam.volumes * beam.elements : beam.elements;
  const bool elements = beam.model == sim::BeamModel::finite_element || (beam.model == sim::BeamModel::mixed && beam.modes.empty());
  const int before = pieces / 2;
  return elements && pieces > 1 ? static_cast<double>(before) / pieces : 0.5;
}

// Names of places of the body, which it gets where it lacks them.
std::vector<std::string> places_of(sim::BodyDef& body, const sim::ResultBody& result, const BodyModel& model) {
  if (auto* rigid = std::get_if<sim::RigidDef>(&body.kind)) {
    std::vector<std::string> out{""};
    for (const sim::Vec3& corner : far_corners(model)) {
      out.push_back(fmt::format("corner {} of the picture", out.size()));
      rigid->frames[out.back()] = corner;
    }
    return out;
  }
  if (auto* beam = std::get_if<sim::BeamDef>(&body.kind)) {
    const double middle = middle_of(*beam);
    beam->frames["middle of the picture"] = middle;
    return {"root", "middle of the picture", "tip"};
  }
  // Nodes far from each other.
  std::vector<std::string> out{""};
  std::set<size_t> chosen;
  for (int axis = 0; axis < 3; ++axis) {
    size_t low = 0, high = 0;
    for (size_t n = 0; n < result.nodes.size(); ++n) {
      if (result.nodes[n].origin[axis] < result.nodes[low].origin[axis]) low = n;
      if (result.nodes[n].origin[axis] > result.nodes[high].origin[axis]) high = n;
    }
    if (!result.nodes.empty()) chosen.insert({low, high});
  }
  for (const size_t n : chosen) out.push_back(result.nodes[n].name);
  return out;
}

// How far what is drawn of a beam lies from its axis at most, m: along y and z of its sections, and in all.
struct Girth {
  glm::dvec2 along{0.0};
  double radius = 0.0;
};

Girth girth(const sim::BeamDef& beam, const sim::ResultBody& result, const BodyModel& model) {
  Girth out;
  out.radius = std::sqrt(std::max(0.0, result.section.area) / std::numbers::pi);
  out.along = glm::dvec2(out.radius);
  const auto widen = [&](double y, double z) {
    out.radius = std::max(out.radius, std::hypot(y, z));
    out.along = glm::max(out.along, glm::abs(glm::dvec2(y, z)));
  };
  if (!result.section.outline.empty()) out.along = glm::dvec2(0.0);
  for (const auto& loop : result.section.outline)
    for (const Eigen::Vector2d& corner : loop) widen(corner.x(), corner.y());
  if (beam.axis) out.along = glm::dvec2(out.radius);  // its sections have axes of their own
  else
    for (const glm::dvec3& v : model.mesh.positions) widen(v.y, v.z);
  return out;
}

// Twist moves what lies beside a beam's axis, which no place on the axis tells: rotations of the middle and the tip against the root.
// w: of the body; metres: what its vertices may be off.
void add_twist(std::vector<Witness>& out, Witness w, const Girth& beside, double metres) {
  if (!(beside.radius > 0.0)) return;
  const std::string body = w.output.of.body;
  for (const char* place : {"middle of the picture", "tip"}) {
    w.output.of.frame = w.place = place;
    w.output.quantity = sim::Quantity::rotation;
    w.output.relative_to = sim::FrameRef{body, "root"};
    w.output.name = fmt::format("{}twist of {}.{})", witness_prefix, body, place);
    w.allowed = metres / beside.radius;
    w.beside = beside.along;
    out.push_back(w);
  }
}

}  // namespace

std::vector<Witness> witnesses(sim::Scene& scene, const Animation& animation, bool pixels, double allowed) {
  std::vector<Witness> out;
  const sim::Results& results = *animation.results;
  const std::vector<BodySight> sight = sights(animation);
  for (size_t b = 0; b < results.bodies.size(); ++b) {
    const auto body =
        std::find_if(scene.bodies.begin(), scene.bodies.end(), [&](const sim::BodyDef& d) { return d.name == results.bodies[b].name; });
    const bool followed = pixels && animation.follow == static_cast<int>(b);
    if (body == scene.bodies.end() || !(animation.bodies[b].visible || followed)) continue;
    if (pixels && sight[b].per_metre <= 0.0) continue;  // never seen
    // Half for what the camera is off that follows a body.
    const double metres = pixels ? (animation.follow >= 0 ? 0.5 : 1.0) * allowed / sight[b].per_metre : allowed;
    const bool elastic = animation.bodies[b].flexible, exaggerated = elastic && sight[b].scale > 1.0;
    Witness w;
    w.output.of.body = body->name;
    w.output.line = body->line;
    w.body = b;
    for (const std::string& place : places_of(*body, results.bodies[b], animation.bodies[b])) {
      w.output.of.frame = w.place = place;
      w.output.quantity = sim::Quantity::position;
      w.output.name = fmt::format("{}{}{}{})", witness_prefix, body->name, place.empty() ? "" : ".", place);
      w.allowed = exaggerated ? 0.5 * metres : metres;
      w.drawn = 1.0;
      out.push_back(w);
      if (!exaggerated) continue;
      w.output.quantity = sim::Quantity::displacement;
      w.output.name = fmt::format("{}deflection of {}{}{})", witness_prefix, body->name, place.empty() ? "" : ".", place);
      w.drawn = sight[b].scale - 1.0;
      w.allowed = 0.5 * metres / w.drawn;
      out.push_back(w);
    }
    w.drawn = exaggerated ? sight[b].scale : 1.0;
    if (const auto* beam = std::get_if<sim::BeamDef>(&body->kind); beam && elastic)
      add_twist(out, w, girth(*beam, results.bodies[b], animation.bodies[b]), exaggerated ? 0.5 * metres / w.drawn : metres);
  }
  return out;
}

namespace {

// The witnesses of one place and where their columns begin.
struct Place {
  std::vector<std::pair<const Witness*, Eigen::Index>> read;
};

// An error of a place at a time along the axes of the world, m, no signs.
glm::dvec3 place_error(const Place& place, const sim::ErrorSizes& errors, Eigen::Index at, const glm::dmat4& pose) {
  glm::dvec3 out(0.0);
  for (const auto& [witness, column] : place.read) {
    glm::dvec3 e;
    for (int a = 0; a < 3; ++a) e[a] = witness->drawn * witness->output.size * errors.shares(column + a, at);
    if (witness->output.quantity == sim::Quantity::position) {
      out += e;
      continue;
    }
    const glm::dvec2 r = witness->beside;
    if (witness->output.quantity == sim::Quantity::rotation) e = {e.y * r.y + e.z * r.x, e.x * r.y, e.x * r.x};
    for (int row = 0; row < 3; ++row)
      for (int a = 0; a < 3; ++a) out[row] += std::abs(pose[a][row]) * e[a];
  }
  return out;
}

// The most that the places of a body are wrong by along the axes of the world, m: what a camera is that follows it.
glm::dvec3 camera_error(const std::map<std::string, Place>& of_body, const sim::ErrorSizes& errors, Eigen::Index at) {
  glm::dvec3 out(0.0);
  for (const auto& [name, place] : of_body)
    for (const auto& [witness, column] : place.read)
      if (witness->output.quantity == sim::Quantity::position)
        for (int a = 0; a < 3; ++a) out[a] = std::max(out[a], witness->drawn * witness->output.size * errors.shares(column + a, at));
  return out;
}

// Points of bodies that views see.
class SeenPoints {
 public:
  SeenPoints(const Animation& animation, size_t body) : animation_(animation), body_(body) {}
  // So many at most in a picture, evenly of what is seen there.
  std::vector<glm::dvec3> of(const PictureViews& views, const SamplePlace& place, size_t most) {
    std::vector<glm::dvec3> all, seen, out;
    for (size_t i = 0; i < points_looked_at.size() && seen.empty(); ++i) {
      if (i == points_.size()) points_.emplace_back(animation_, body_, points_looked_at[i]);
      points_[i].at(place, all);
      for (const glm::dvec3& p : all)
        if (views.pixels_per_metre(p) > 0.0) seen.push_back(p);
    }
    const size_t step = std::max<size_t>(1, (seen.size() + most - 1) / most);
    for (size_t i = 0; i < seen.size(); i += step) out.push_back(seen[i]);
    return out;
  }

 private:
  const Animation& animation_;
  size_t body_;
  std::vector<BodyPoints> points_;
};

}  // namespace

double seen_errors(const Animation& animation, const std::vector<Witness>& places, const sim::ErrorSizes& errors, bool pixels) {
  constexpr size_t points_in_all = 2000, least_points = 2, most_points = 16;
  const sim::Results& results = *animation.results;
  if (errors.shares.cols() == 0 || errors.shares.cols() != errors.times.size()) return -1.0;
  std::map<size_t, std::map<std::string, Place>> bodies;
  for (const Witness& w : places) {
    const auto column = std::find(errors.columns.begin(), errors.columns.end(), w.output.name + ".x");
    if (column == errors.columns.end() || errors.columns.end() - column < 3) return -1.0;
    bodies[w.body][w.place].read.emplace_back(&w, column - errors.columns.begin());
  }
  const size_t points = std::clamp(points_in_all / std::max<size_t>(1, bodies.size()), least_points, most_points);
  std::map<size_t, SeenPoints> drawn;
  for (const auto& [b, of_body] : bodies) drawn.emplace(b, SeenPoints(animation, b));
  const auto followed = animation.follow >= 0 && pixels ? bodies.find(static_cast<size_t>(animation.follow)) : bodies.end();
  double out = 0.0;
  for (const int k : looked_at(animation, pictures_looked_at)) {
    const PictureViews views(animation, k);
    const double t = picture_time(animation, k);
    const SamplePlace sample = find_sample(results.times, t), at = find_sample(errors.times, t);
    const Eigen::Index nearest = std::min(at.index + (at.share > 0.5 ? 1 : 0), errors.times.size() - 1);
    const glm::dvec3 camera = followed != bodies.end() ? camera_error(followed->second, errors, nearest) : glm::dvec3(0.0);
    for (const auto& [b, of_body] : bodies) {
      if (!animation.bodies[b].visible) continue;
      const glm::dmat4 pose = body_pose(results.bodies[b], sample);
      const std::vector<glm::dvec3> seen_from = pixels ? drawn.at(b).of(views, sample, points) : std::vector<glm::dvec3>{};
      for (const auto& [name, place] : of_body) {
        const glm::dvec3 error = place_error(place, errors, nearest, pose);
        if (!pixels) out = std::max(out, glm::length(error));
        else
          for (const glm::dvec3& p : seen_from) out = std::max(out, views.moved(p, error + camera));
      }
    }
  }
  return out;
}

}  // namespace flexframe::film
