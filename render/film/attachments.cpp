#include "render/film/attachments.h"

#include "render/film/dimensions.h"
#include "render/film/survey.h"
#include "render/picture/colormap.h"
#include "sim/base/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace flexframe::film {
namespace {

constexpr float hidden_share = 0.45f;  // opacity of what bodies hide of traces, triads and forces
constexpr int trace_points = 1500;     // of one trace, where these are all samples: three a pixel column of a path across the picture
constexpr int trace_looks = 200000;    // samples that are looked at for a trace

std::string text_of(const sim::FrameRef& frame) { return frame.frame.empty() ? frame.body : frame.body + "." + frame.frame; }

const glm::vec3 force_color{0.80f, 0.20f, 0.15f}, torque_color{0.55f, 0.25f, 0.68f}, reaction_color{0.05f, 0.50f, 0.45f};

// N or Nm, world; from: where it acts.
glm::dvec3 load_of(const Animation& animation, const ForceArrow& force, double t, const SamplePlace& at, glm::dvec3& from) {
  const sim::Results& results = *animation.results;
  const glm::dmat4 pose = place_pose(results, force.place, at, animation.scales[0]);
  from = glm::dvec3(pose[3]);
  if (!force.reaction()) return force.value.value(t) * (force.follower ? glm::dmat3(pose) * force.direction : force.direction);
  glm::dvec3 load(0.0);
  for (int k = 0; k < 3; ++k) {
    const sim::VecX& values = results.outputs[force.columns[k]].values;
    load[k] = values[at.index];
    if (at.share > 0.0) load[k] += at.share * (values[at.index + 1] - values[at.index]);
  }
  return load;
}

// The samples that a path is drawn through: all, or of many those without which it would lie elsewhere, by a four-thousandth of its extent.
// Every n-th alone would make stars of what turns fast.
std::vector<Eigen::Index> samples_of_trace(const Animation& animation, const FramePlace& place) {
  const sim::Results& results = *animation.results;
  const Eigen::Index n = results.times.size(), step = std::max<Eigen::Index>(1, n / trace_looks);
  std::vector<Eigen::Index> all;
  for (Eigen::Index i = 0; i < n; i += step) all.push_back(i);
  if (n <= trace_points) return all;
  std::vector<glm::dvec3> path;
  render::Bounds bounds;
  for (const Eigen::Index i : all) {
    path.emplace_back(place_pose(results, place, {i, 0.0}, animation.scales[0])[3]);
    bounds.add(path.back());
  }
  const double off = bounds.radius() / 2000.0;
  std::vector<Eigen::Index> kept{all[0]};
  constexpr size_t longest = 64;  // samples along one straight line
  for (size_t first = 0, end = 1; end < path.size(); ++end) {
    const glm::dvec3 way = path[end] - path[first];
    const double length = glm::length(way);
    bool straight = end - first <= longest;
    for (size_t k = first + 1; straight && k < end; ++k) {
      const glm::dvec3 aside = path[k] - path[first];
      const double along = length > 0.0 ? std::clamp(glm::dot(aside, way) / (length * length), 0.0, 1.0) : 0.0;
      straight = glm::length(aside - along * way) <= off;
    }
    if (straight) continue;
    first = end - 1;
    kept.push_back(all[first]);
  }
  return kept;
}

double length_of(const Animation& animation, const ForceArrow& force) {
  if (force.per_length()) return animation.line_length;
  return force.torque ? animation.torque_length : animation.force_length;
}

// Joints whose reaction is an output in world axes.
void add_reactions(Animation& animation, const sim::Scene& scene) {
  const sim::Results& results = *animation.results;
  const auto column = [&](const std::string& name) {
    for (size_t i = 0; i < results.outputs.size(); ++i)
      if (results.outputs[i].column == name) return static_cast<int>(i);
    return -1;
  };
  for (const sim::OutputDef& output : scene.outputs) {
    if (output.quantity != sim::Quantity::reaction || output.frame != sim::ReactionFrame::world) continue;
    const auto joint =
        std::find_if(scene.joints.begin(), scene.joints.end(), [&](const sim::JointDef& j) { return j.name == output.of.body; });
    if (joint == scene.joints.end()) continue;
    const std::optional<FramePlace> place = find_place(results, &scene, text_of(joint->child));
    if (!place) continue;
    for (const bool torque : {false, true}) {
      const std::string stem = output.name + (torque ? ".m" : ".");
      ForceArrow arrow;
      arrow.place = *place;
      arrow.torque = torque;
      arrow.columns = {column(stem + "x"), column(stem + "y"), column(stem + "z")};
      if (*std::min_element(arrow.columns.begin(), arrow.columns.end()) >= 0) animation.forces.push_back(arrow);
    }
  }
}

// One scale for all forces, one for all torques: lengths can be compared.
void set_arrow_scales(Animation& animation, double size) {
  const sim::VecX& times = animation.results->times;
  for (const ForceArrow& force : animation.forces) {
    double& largest = force.per_length() ? animation.largest_line
                                         : (force.torque ? animation.largest_torque : animation.largest_force)[force.reaction() ? 1 : 0];
    for (Eigen::Index i = 0; i < times.size(); ++i) {
      glm::dvec3 from;
      largest = std::max(largest, glm::length(load_of(animation, force, times[i], {i, 0.0}, from)));
    }
  }
  // The moment of a hinge about its axis is zero up to rounding: no arrow for what is that far below force times size.
  constexpr double rounding = 1e-9;
  double &moment = animation.largest_torque[1], &held = animation.largest_force[1];
  if (moment < rounding * held * size) moment = 0.0;
  if (held * size < rounding * moment) held = 0.0;
  const double force = std::max(animation.largest_force[0], animation.largest_force[1]),
               torque = std::max(animation.largest_torque[0], animation.largest_torque[1]);
  if (force > 0.0) animation.force_length = size / 6.0 / force;
  if (torque > 0.0) animation.torque_length = size / 6.0 / torque;
  if (animation.largest_line > 0.0) animation.line_length = size / 10.0 / animation.largest_line;
}

// "12.3 kN": three digits. unit: "N", "N m", "N/m".
std::string load_text(double value, const char* unit) {
  static constexpr std::pair<double, const char*> powers[] = {{1e9, "G"},  {1e6, "M"},  {1e3, "k"},  {1.0, ""},
                                                              {1e-3, "m"}, {1e-6, "µ"}, {1e-9, "n"}, {1e-12, "p"}};
  const auto last = std::end(powers) - 1;
  // 999.7 N is 1 kN in three digits.
  const auto fits = std::find_if(std::begin(powers), last, [&](const auto& p) { return value >= 0.9995 * p.first; });
  return fmt::format("{:.3g} {}{}", value / fits->first, fits->second, unit);
}

// How far a beam's section reaches from its axis along a direction of the body, m.
double section_reach(const sim::ResultBody& body, const glm::dvec3& direction) {
  if (body.kind != "beam") return 0.0;
  double reach = 0.0;
  if (body.section.outline.empty()) return std::sqrt(std::max(body.section.area, 0.0) / M_PI) * std::hypot(direction.y, direction.z);
  for (const Eigen::Vector2d& p : body.section.outline.front()) reach = std::max(reach, direction.y * p.x() + direction.z * p.y());
  return reach;
}

// From a beam's axis to its surface against an arrow's way, m, world.
glm::dvec3 to_surface(const sim::ResultBody& body, const glm::dvec3& way, const SamplePlace& at) {
  if (!(glm::length(way) > 0.0)) return glm::dvec3(0.0);
  const glm::dvec3 back = -glm::normalize(way);
  return section_reach(body, glm::transpose(glm::dmat3(body_pose(body, at))) * back) * back;
}

// A force per length: arrows that end where the beam's surface begins, their tails joined by a line, one value in the middle.
void add_row(const Animation& animation, const ForceArrow& force, double t, const SamplePlace& now, render::Picture& p) {
  glm::dvec3 from;
  const glm::dvec3 load = load_of(animation, force, t, now, from), way = animation.line_length * load;
  const double length = glm::length(way);
  if (!(length >= 1e-3 * animation.triad_length)) return;
  const sim::ResultBody& body = animation.results->bodies[force.place.body];
  const glm::dvec3 out = to_surface(body, way, now);
  render::Lines tails;
  tails.color = glm::vec4(force_color, 1.0f);
  tails.width = 1.5f;
  tails.seen_through = hidden_share;
  for (const FramePlace& place : force.row) {
    const glm::dvec3 to = glm::dvec3(place_pose(*animation.results, place, now, animation.scales[0])[3]) + out;
    p.arrows.push_back({to - way, to, force_color, 0.022 * animation.triad_length, 1.0f, hidden_share});
    tails.points.emplace_back(to - way);
  }
  if (length >= 0.25 * animation.triad_length) {
    render::Label label;
    label.point = glm::dvec3(tails.points[tails.points.size() / 2]);
    label.text = load_text(glm::length(load), "N/m");
    label.color = 0.75f * force_color;
    p.labels.push_back(std::move(label));
  }
  p.lines.push_back(std::move(tails));
}

// Arrows with their values, and what their lengths mean.
void add_arrows(const Animation& animation, double t, const SamplePlace& now, render::Picture& p) {
  p.arrows.clear();
  const double radius = 0.05 * animation.triad_length;
  bool seen[3] = {};
  for (const ForceArrow& force : animation.forces) {
    if (force.per_length()) {
      add_row(animation, force, t, now, p);
      continue;
    }
    glm::dvec3 from;
    const glm::dvec3 load = load_of(animation, force, t, now, from), way = length_of(animation, force) * load;
    const auto& largest = force.torque ? animation.largest_torque : animation.largest_force;
    if (largest[force.reaction() ? 1 : 0] <= 0.0) continue;
    const int kind = force.reaction() ? 2 : force.torque ? 1 : 0;
    const glm::vec3 color = kind == 2 ? reaction_color : kind == 1 ? torque_color : force_color;
    seen[kind] = true;
    // Nothing to show of a force that is off.
    if (!(glm::length(way) >= 1e-3 * animation.triad_length)) continue;
    p.arrows.push_back({from, from + way, color, radius, 1.0f, hidden_share});
    // A second head tells a moment from a force.
    if (force.torque) p.arrows.push_back({from, from + 0.86 * way, color, radius, 1.0f, hidden_share});
    // Of what is too short to be read off there is no number either.
    if (glm::length(way) < 0.25 * animation.triad_length) continue;
    render::Label label;
    label.point = from + way;
    label.text = load_text(glm::length(load), force.torque ? "N m" : "N");
    label.color = 0.75f * color;
    p.labels.push_back(std::move(label));
  }
  if (!animation.settings.overlay.legend) return;
  if (animation.largest_line > 0.0)
    p.overlay.legend.push_back({.text = fmt::format("force per length, at most {}", load_text(animation.largest_line, "N/m")),
                                .color = force_color,
                                .opacity = 1.0f});
  const char* const words[3] = {"force", "torque", "reaction"};
  const glm::vec3 colors[3] = {force_color, torque_color, reaction_color};
  for (int kind = 0; kind < 3; ++kind) {
    if (!seen[kind]) continue;
    const size_t of = kind == 2 ? 1 : 0;
    std::string text = words[kind];
    if (kind != 1 && animation.largest_force[of] > 0.0) text += fmt::format(", at most {}", load_text(animation.largest_force[of], "N"));
    if (kind == 2 && animation.largest_force[1] > 0.0 && animation.largest_torque[1] > 0.0)
      text += fmt::format(" and {}", load_text(animation.largest_torque[1], "N m"));
    else if (kind != 0 && animation.largest_torque[of] > 0.0)
      text += fmt::format(", at most {}", load_text(animation.largest_torque[of], "N m"));
    p.overlay.legend.push_back({.text = text, .color = colors[kind], .opacity = 1.0f});
  }
}

// A plate across the end of a coil that the ground holds, square to where the coil lay at the start: fixed as the ground is. Empty where
// the ground holds none or a joint is drawn there already.
render::Shape make_mount(const sim::Results& results, const SpringSymbol& spring) {
  if (!(spring.coil > 0.0) || (spring.from.body >= 0) == (spring.to.body >= 0)) return {};
  const bool first = spring.from.body < 0;
  const glm::dvec3 at(place_pose(results, first ? spring.from : spring.to, {0, 0.0}, 1.0)[3]),
      other(place_pose(results, first ? spring.to : spring.from, {0, 0.0}, 1.0)[3]);
  if (!(glm::length(at - other) > 4.0 * spring.wire)) return {};
  for (const sim::ResultJoint& joint : results.joints)
    if (joint.position.rows() > 0 && glm::length(glm::dvec3(joint_pose(joint, {0, 0.0})[3]) - at) < spring.coil) return {};
  const double radius = 1.5 * spring.coil;
  return render::make_tube(std::array{at, at + 0.45 * radius * glm::normalize(at - other)}, radius, 24);
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

void add_attachments(Animation& animation, const sim::Scene* scene, double size) {
  add_dimensions(animation, scene);
  const RenderSettings& settings = animation.settings;
  const sim::Results& results = *animation.results;
  for (const std::string& name : settings.traces) {
    animation.traces.push_back(require_place(animation, scene, name, "traces", settings.traces_line));
    animation.trace_samples.push_back(samples_of_trace(animation, animation.traces.back()));
  }
  for (const std::string& name : settings.triads)
    animation.triads.push_back(require_place(animation, scene, name, "triads", settings.triads_line));
  for (const InsetSettings& inset : settings.insets)
    animation.insets.push_back({require_place(animation, scene, inset.at, "insets", inset.line), inset.drawing});
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
    BodyMemory moved;
    ScalarMemory work;
    std::vector<float> values;
    const double start = results.times[0];
    if (model.flexible) update_displacement(model, results.bodies[b], find_sample(results.times, start), moved);
    update_scalars({model, results, b, settings}, start, moved, work, values);
    const size_t vertex = static_cast<size_t>(model.mesh.point_position[static_cast<size_t>(probe.point)]);
    if (values.empty() || !std::isfinite(values[vertex])) {
      animation.warnings.push_back(fmt::format("probe '{}' has no value: its body has none of what colours show", name));
      continue;
    }
    animation.probes.push_back(probe);
  }
  if (!scene) return;

  if (settings.joints) add_springs(animation, *scene, size);
  for (const sim::ForceDef& def : scene->forces) {
    const std::optional<FramePlace> on = find_place(results, scene, text_of(def.on));
    if (!on) continue;
    if (settings.forces && def.kind != sim::ForceKind::spring_damper) {
      // What follows from time alone can be drawn from the scene.
      const bool plain = def.kind == sim::ForceKind::force || def.kind == sim::ForceKind::torque;
      const bool spread = def.kind == sim::ForceKind::distributed;
      if ((plain || spread) && def.reads.empty() && !def.table) {
        ForceArrow arrow{.place = *on,
                         .direction = glm::dvec3(def.direction.x(), def.direction.y(), def.direction.z()),
                         .follower = def.follower,
                         .torque = def.kind == sim::ForceKind::torque,
                         .value = sim::Expression(def.value)};
        constexpr int arrows = 11;
        for (int k = 0; spread && k < arrows; ++k)
          if (const std::optional<FramePlace> place = place_along(results, *scene, def.on.body, k / (arrows - 1.0)))
            arrow.row.push_back(*place);
        if (!spread || !arrow.row.empty()) animation.forces.push_back(std::move(arrow));
      } else {
        animation.notes.push_back(fmt::format("force '{}' has no arrow: only forces and torques by an expression of t have one", def.name));
      }
    }
  }
  if (settings.forces) add_reactions(animation, *scene);
  set_arrow_scales(animation, size);
}

void append_ends(const Animation& animation, std::vector<glm::dvec3>& points, const std::pair<double, double>* window) {
  if (animation.forces.empty() && animation.springs.empty()) return;
  const sim::VecX& times = animation.results->times;
  Eigen::Index begin = 0, past = times.size();
  if (window) {
    begin = find_sample(times, window->first).index;
    past = std::max(begin, find_sample(times, window->second).index) + 1;
  }
  const Eigen::Index step = std::max<Eigen::Index>(1, (past - begin) / 200);
  for (Eigen::Index i = begin; i < past; i += step) {
    // A camera that follows a body need not see where springs are held.
    glm::dvec3 way(0.0);
    if (animation.follow >= 0) {
      const sim::ResultBody& body = animation.results->bodies[animation.follow];
      way = glm::dvec3(body_pose(body, {i, 0.0})[3] - body_pose(body, {})[3]);
    }
    for (const SpringSymbol& spring : animation.follow < 0 ? animation.springs : std::vector<SpringSymbol>{})
      for (const FramePlace& end : {spring.from, spring.to})
        points.emplace_back(place_pose(*animation.results, end, {i, 0.0}, animation.scales[0])[3]);
    for (const ForceArrow& force : animation.forces) {
      glm::dvec3 from;
      const glm::dvec3 load = load_of(animation, force, times[i], {i, 0.0}, from);
      const glm::dvec3 arrow = length_of(animation, force) * load;
      if (!force.per_length()) points.push_back(from + arrow - way);
      for (const FramePlace& place : force.row)
        points.push_back(glm::dvec3(place_pose(*animation.results, place, {i, 0.0}, animation.scales[0])[3]) +
                         to_surface(animation.results->bodies[place.body], arrow, {i, 0.0}) - arrow - way);
    }
  }
}

void update_attachments(const Animation& animation, int picture, PictureMemory& memory) {
  const sim::Results& results = *animation.results;
  const double t = picture_time(animation, picture);
  const SamplePlace now = find_sample(results.times, t);
  render::Picture& p = memory.picture;
  add_arrows(animation, t, now, p);
  update_dimensions(animation, now, p);
  p.insets.clear();
  for (const InsetPlace& inset : animation.insets) {
    p.insets.push_back(inset.inset);
    p.insets.back().point = glm::dvec3(place_pose(results, inset.place, now, animation.scales[0])[3]);
  }
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
    for (const Eigen::Index i : animation.trace_samples[k]) {
      if (i >= now.index) break;
      add({i, 0.0});
    }
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
  const auto add_steel = [&p](const render::Shape& shape) {
    render::Surface surface;
    surface.positions = shape.positions;
    surface.normals = shape.normals;
    surface.triangles = shape.triangles;
    surface.material = {.color = {0.30f, 0.33f, 0.38f}, .roughness = 0.3f, .metallic = 0.6f};
    surface.two_sided = false;
    p.surfaces.push_back(surface);
  };
  memory.springs.resize(animation.springs.size());
  memory.springs.reserve(2 * animation.springs.size());  // and their mounts
  for (size_t k = 0; k < animation.springs.size(); ++k) {
    const SpringSymbol& spring = animation.springs[k];
    const glm::dvec3 a(place_pose(results, spring.from, now, animation.scales[0])[3]),
        b(place_pose(results, spring.to, now, animation.scales[0])[3]);
    // A coil without length has no shape.
    if (!(glm::length(b - a) > 4.0 * spring.wire)) continue;
    memory.springs[k] =
        spring.coil > 0.0 ? render::make_spring(a, b, spring.coil, spring.wire) : render::make_tube(std::array{a, b}, spring.wire, 16);
    add_steel(memory.springs[k]);
    if (render::Shape mount = make_mount(results, spring); !mount.triangles.empty())
      add_steel(memory.springs.emplace_back(std::move(mount)));
  }
}

}  // namespace flexframe::film
