#include "render/film/attachments.h"

#include "render/picture/colormap.h"
#include "sim/base/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace flexframe::film {
namespace {

constexpr float hidden_share = 0.45f;  // opacity of what bodies hide of traces, triads and forces
constexpr int trace_points = 1500;     // of one trace: three a pixel column of a path across the picture

std::string text_of(const sim::FrameRef& frame) { return frame.frame.empty() ? frame.body : frame.body + "." + frame.frame; }

FramePlace require_place(const Animation& animation, const sim::Scene* scene, const std::string& name, const char* key, int line) {
  const std::optional<FramePlace> place = find_place(*animation.results, scene, name);
  if (place) return *place;
  const std::string where = scene && line > 0 ? fmt::format("{}:{}", scene->file.string(), line) : scene ? scene->file.string() : "results";
  std::vector<std::string> bodies;
  for (const sim::ResultBody& body : animation.results->bodies) bodies.push_back(body.name);
  throw sim::InputError(fmt::format("{}: [render]: key '{}' names {}, which is no frame{}; allowed: BODY or BODY.FRAME of the bodies {}",
                                    where, key, sim::quote(name), sim::did_you_mean(name.substr(0, name.find('.')), bodies),
                                    sim::list_words(bodies)));
}

glm::dvec3 arrow_of(const Animation& animation, const ForceArrow& force, double t, const SamplePlace& at, glm::dvec3& from) {
  const glm::dmat4 pose = place_pose(*animation.results, force.place, at, animation.scales[0]);
  from = glm::dvec3(pose[3]);
  const glm::dvec3 direction = force.follower ? glm::dmat3(pose) * force.direction : force.direction;
  return force.value.value(t) * force.length_per_unit * direction;
}

// From frame to frame: a coil, or with no radius of one a straight wire. radii, m.
void add_springs(Animation& animation, const sim::Scene& scene, const std::vector<sim::FrameRef>& frames, double coil, double wire) {
  std::vector<FramePlace> places;
  for (const sim::FrameRef& frame : frames) {
    const std::optional<FramePlace> place = find_place(*animation.results, &scene, text_of(frame));
    if (!place) return;
    places.push_back(*place);
  }
  for (size_t k = 1; k < places.size(); ++k) animation.springs.push_back({places[k - 1], places[k], coil, wire});
}

// A spring-damper is drawn as a coil, one without stiffness as a rod; cables and ropes as wires.
void add_springs(Animation& animation, const sim::Scene& scene, double size) {
  const double wire = 0.0025 * size;
  for (const sim::ForceDef& def : scene.forces) {
    if (def.kind != sim::ForceKind::spring_damper) continue;
    std::vector<sim::FrameRef> frames{def.from};
    frames.insert(frames.end(), def.through.begin(), def.through.end());
    frames.push_back(def.on);
    const bool rod = def.spring.stiffness == 0.0 && def.spring.damping > 0.0;
    add_springs(animation, scene, frames, def.cable || rod ? 0.0 : 0.012 * size, rod ? 2.0 * wire : wire);
  }
  for (const sim::CouplingDef& def : scene.couplings) add_springs(animation, scene, def.through, 0.0, wire);
}

}  // namespace

void add_attachments(Animation& animation, const sim::Scene* scene, double size) {
  const RenderSettings& settings = animation.settings;
  const sim::Results& results = *animation.results;
  for (const std::string& name : settings.traces)
    animation.traces.push_back(require_place(animation, scene, name, "traces", settings.traces_line));
  for (const std::string& name : settings.triads)
    animation.triads.push_back(require_place(animation, scene, name, "triads", settings.triads_line));
  animation.triad_length = 0.08 * size;
  for (const std::string& name : settings.probes) {
    const FramePlace place = require_place(animation, scene, name, "probes", settings.probes_line);
    const size_t b = std::max(place.body, 0);
    const BodyModel& model = animation.bodies[b];
    if (place.body < 0 || model.mesh.triangles.empty() || !model.visible || !animation.scalar_bar) {
      animation.warnings.push_back(fmt::format("probe '{}' has no value: nothing there is coloured", name));
      continue;
    }
    Animation::Probe probe{name, b, 0};
    double best = 1e300;
    for (size_t p = 0; p < model.mesh.point_position.size(); ++p) {
      const double away = glm::length(model.mesh.positions[model.mesh.point_position[p]] - place.origin);
      if (away < best) best = away, probe.point = static_cast<int>(p);
    }
    animation.probes.push_back(probe);
  }
  if (!scene) return;

  if (settings.joints) add_springs(animation, *scene, size);
  for (const sim::ForceDef& def : scene->forces) {
    const std::optional<FramePlace> on = find_place(results, scene, text_of(def.on));
    if (!on) continue;
    if (settings.forces && def.reads.empty() && (def.kind == sim::ForceKind::force || def.kind == sim::ForceKind::torque)) {
      // The largest of its values is an arrow of a sixth of the machine.
      ForceArrow force{*on,
                       glm::dvec3(def.direction.x(), def.direction.y(), def.direction.z()),
                       def.follower,
                       def.kind == sim::ForceKind::torque,
                       sim::Expression(def.value),
                       0.0};
      double largest = 0.0;
      for (Eigen::Index i = 0; i < results.times.size(); ++i) largest = std::max(largest, std::abs(force.value.value(results.times[i])));
      if (largest > 0.0) force.length_per_unit = size / 6.0 / largest;
      animation.forces.push_back(std::move(force));
    }
  }
}

void append_arrow_tips(const Animation& animation, std::vector<glm::dvec3>& points) {
  if (animation.forces.empty()) return;
  const sim::VecX& times = animation.results->times;
  const Eigen::Index step = std::max<Eigen::Index>(1, times.size() / 200);
  for (Eigen::Index i = 0; i < times.size(); i += step)
    for (const ForceArrow& force : animation.forces) {
      glm::dvec3 from;
      const glm::dvec3 way = arrow_of(animation, force, times[i], {i, 0.0}, from);
      points.push_back(from + way);
    }
}

void update_attachments(const Animation& animation, int picture, PictureMemory& memory) {
  const sim::Results& results = *animation.results;
  const double t = picture_time(animation, picture);
  const SamplePlace now = find_sample(results.times, t);
  render::Picture& p = memory.picture;
  p.arrows.clear();
  p.triads.clear();

  // Paths up to now, through the samples.
  for (size_t k = 0; k < animation.traces.size(); ++k) {
    render::Lines line;
    const glm::vec3 color = render::category_color(static_cast<int>(k) + 1);
    line.color = glm::vec4(color, 1.0f);
    line.width = 2.0f;
    const auto add = [&](const SamplePlace& at) {
      line.points.emplace_back(glm::vec3(glm::dvec3(place_pose(results, animation.traces[k], at, animation.scales[0])[3])));
    };
    const Eigen::Index step = std::max<Eigen::Index>(1, results.times.size() / trace_points);
    for (Eigen::Index i = 0; i < now.index; i += step) add({i, 0.0});
    add({now.index, 0.0});
    add(now);
    render::Markers dot;
    dot.points.push_back(line.points.back());
    dot.color = line.color;
    dot.diameter = 6.0f;
    line.seen_through = dot.seen_through = hidden_share;
    p.markers.push_back(std::move(dot));
    p.lines.push_back(std::move(line));
  }
  for (const FramePlace& triad : animation.triads)
    p.triads.push_back({place_pose(results, triad, now, animation.scales[0]), animation.triad_length, hidden_share});
  for (const ForceArrow& force : animation.forces) {
    glm::dvec3 from;
    const glm::dvec3 way = arrow_of(animation, force, t, now, from);
    // Nothing to show of a force that is off.
    if (glm::length(way) < 1e-3 * animation.triad_length) continue;
    const double radius = 0.05 * animation.triad_length;
    p.arrows.push_back(
        {from, from + way, force.torque ? glm::vec3(0.55f, 0.25f, 0.68f) : glm::vec3(0.80f, 0.20f, 0.15f), radius, 1.0f, hidden_share});
    // A second head tells a moment from a force.
    if (force.torque) p.arrows.push_back({from, from + 0.86 * way, glm::vec3(0.55f, 0.25f, 0.68f), radius, 1.0f, hidden_share});
  }

  memory.springs.resize(animation.springs.size());
  for (size_t k = 0; k < animation.springs.size(); ++k) {
    const SpringSymbol& spring = animation.springs[k];
    const glm::dvec3 a(place_pose(results, spring.from, now, animation.scales[0])[3]),
        b(place_pose(results, spring.to, now, animation.scales[0])[3]);
    // A coil without length has no shape.
    if (!(glm::length(b - a) > 4.0 * spring.wire)) continue;
    memory.springs[k] =
        spring.coil > 0.0 ? render::make_spring(a, b, spring.coil, spring.wire) : render::make_tube(std::array{a, b}, spring.wire, 16);
    render::Surface surface;
    surface.positions = memory.springs[k].positions;
    surface.normals = memory.springs[k].normals;
    surface.triangles = memory.springs[k].triangles;
    surface.material = {.color = {0.30f, 0.33f, 0.38f}, .roughness = 0.3f, .metallic = 0.6f};
    surface.two_sided = false;
    p.surfaces.push_back(surface);
  }
}

}  // namespace flexframe::film
