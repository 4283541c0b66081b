#include "render/film/animation.h"

#include "interp/hash.h"
#include "render/film/attachments.h"
#include "render/film/extremes.h"
#include "render/film/overlay.h"
#include "render/film/survey.h"
#include "render/frame/camera.h"

#include <algorithm>
#include <cmath>

namespace flexframe::film {
namespace {

constexpr float ghost_opacity = 0.38f, undeformed_opacity = 0.30f, trail_opacity = 0.22f;
const glm::vec3 pale{0.50f, 0.55f, 0.63f};

// Adds one body at one scale; its arrays live in the next free skin.
render::Surface& add_surface(const Animation& animation, PictureMemory& memory, size_t& skin, const BodyModel& model,
                             const glm::dmat4& pose) {
  PictureMemory::Skin& arrays = memory.skins[skin++];
  render::Surface surface;
  surface.positions = arrays.positions;
  surface.normals = arrays.normals;
  surface.triangles = model.triangles;
  surface.pose = pose;
  surface.material = model.material;
  surface.opacity = model.opacity;
  surface.two_sided = !model.closed;
  surface.edges = model.edges == EdgeLines::mesh;
  surface.edge_flags = model.edge_flags;
  surface.silhouette = animation.settings.silhouette;
  memory.picture.surfaces.push_back(surface);
  memory.drawn.push_back(static_cast<size_t>(&model - animation.bodies.data()));
  return memory.picture.surfaces.back();
}

// Fewer triangles of fine meshes, as far as nobody sees it.
void choose_levels(const Animation& animation, PictureMemory& memory) {
  const render::ScalarMap& map = memory.picture.scalar_map;
  // A hundredth of the colours; bands and lines of equal values must not leave their places.
  const double value = map.logarithmic ? 0.0 : (map.levels > 1 || map.isolines > 1 ? 0.001 : 0.01) * std::abs(map.upper - map.lower);
  for (size_t i = 0; i < memory.drawn.size(); ++i) {
    const BodyModel& model = animation.bodies[memory.drawn[i]];
    render::Surface& surface = memory.picture.surfaces[i];
    if (model.levels.empty() || surface.edges || surface.wires) continue;
    const double length = unseen_length(memory.picture, surface.pose, surface.positions);
    if (const DetailLevel* level = fitting_level(model.levels, surface.positions, model.flexible, length, surface.scalars, value))
      surface.triangles = level->triangles;
  }
}

// The axis of a thin beam: seen where its section is finer than a pixel or two, inside it elsewhere.
// ghost: a faint copy, in the ghost's colour if it has one.
render::Lines spine_line(const PictureMemory& picture, size_t b, const BodyModel& model, const glm::dmat4& pose, bool ghost) {
  const std::vector<float>& scalars = picture.vertex_scalars;
  const std::optional<glm::vec3> one_color = ghost ? model.ghost_color : std::nullopt;
  render::Lines line;
  line.pose = pose;
  line.width = 2.2f;
  const std::vector<float>& positions = model.flexible ? picture.bodies[b].positions : model.rest;
  for (const std::vector<int>& ring : model.spine) {
    glm::dvec3 sum(0.0);
    double value = 0.0;
    for (const int p : ring) {
      const float* const at = positions.data() + 3 * static_cast<std::ptrdiff_t>(p);
      sum += glm::dvec3(at[0], at[1], at[2]);
      value += scalars.empty() ? 0.0 : static_cast<double>(scalars[p]);
    }
    const double share = 1.0 / static_cast<double>(ring.size());
    line.points.emplace_back(share * sum);
    const glm::vec3 color = one_color         ? *one_color
                            : scalars.empty() ? model.material.color
                                              : render::scalar_color(picture.picture.scalar_map, share * value);
    line.colors.emplace_back(color, (ghost ? ghost_opacity : 1.0f) * model.opacity);
  }
  return line;
}

// Lines along the creases of a solid body: a dark shade of its own colour, ink on paper.
// values: what colours the shading points; empty: the body has one colour. map: null with print, whose lines are ink.
render::Lines crease_line(const BodyModel& model, const PictureMemory::Skin& skin, const std::vector<float>& values,
                          const render::ScalarMap* map, const glm::dmat4& pose) {
  render::Lines line;
  line.pose = pose;
  line.strip = false;
  line.cut = true;
  line.width = map ? 1.0f : 1.5f;
  line.color = glm::vec4(map ? 0.42f * model.material.color : glm::vec3(0.08f), 1.0f);
  const bool shaded = map && !values.empty();
  line.points.reserve(2 * model.creases.size());
  const auto normal = [&](int triangle) {
    const glm::uvec3 t = model.triangles[triangle];
    return glm::cross(skin.positions[t.y] - skin.positions[t.x], skin.positions[t.z] - skin.positions[t.x]);
  };
  for (const BodyModel::Crease& c : model.creases) {
    for (const int end : {c.a, c.b}) {
      line.points.push_back(skin.positions[end]);
      // A dark shade of the colour beside it: form without black nets over the values.
      if (shaded) line.colors.emplace_back(0.45f * render::scalar_color(*map, static_cast<double>(values[end])), 1.0f);
    }
    if (!model.closed) continue;
    line.faces.push_back(normal(c.triangle));
    line.faces.push_back(c.other < 0 ? line.faces.back() : normal(c.other));
  }
  return line;
}

void rest_surface(const BodyModel& model, std::vector<glm::vec3>& positions, std::vector<glm::vec3>& normals) {
  positions.resize(model.mesh.point_position.size());
  for (size_t p = 0; p < positions.size(); ++p) positions[p] = glm::vec3(model.mesh.positions[model.mesh.point_position[p]]);
  normals = model.rest_normals;
}

// Number of skins a picture needs at most: reserved at once, because surfaces point into them.
size_t skins_needed(const Animation& animation) {
  return animation.bodies.size() * (animation.scales.size() + 1 + animation.settings.trail);
}

// Nodes as markers, one set a scale.
void add_node_markers(const Animation& animation, size_t b, const SamplePlace& place, PictureMemory& memory) {
  const BodyModel& model = animation.bodies[b];
  const sim::ResultBody& body = animation.results->bodies[b];
  BodyMemory& moved = memory.bodies[b];
  node_motion(body, place, moved.node_displacement, moved.node_rotation);
  for (size_t s = 0; s < animation.scales.size(); ++s) {
    render::Markers markers;
    markers.pose = body_pose(body, place);
    if (s > 0) markers.color.a = ghost_opacity;
    if (model.mesh.triangles.empty()) markers.color = glm::vec4(model.material.color, markers.color.a);
    for (size_t n = 0; n < body.nodes.size(); ++n) {
      const sim::Vec3 p =
          body.nodes[n].origin + animation.scales[s] * moved.node_displacement.row(static_cast<Eigen::Index>(n)).transpose();
      markers.points.emplace_back(p.x(), p.y(), p.z());
    }
    memory.picture.markers.push_back(std::move(markers));
  }
}

// What a body is coloured by: a number a vertex and a point of its surface.
void update_colors(const Animation& animation, size_t b, double t, PictureMemory& memory) {
  const BodyModel& model = animation.bodies[b];
  std::vector<float>& scalars = memory.scalars[b];
  ScalarMemory work;
  work.wanted = model.by_length;
  if (animation.scalar_bar || animation.settings.color_range)
    update_scalars({model, *animation.results, b, animation.settings}, t, memory.bodies[b], work, memory.vertex_scalars);
  else memory.vertex_scalars.clear();
  scalars.clear();
  if (!memory.vertex_scalars.empty())
    for (int p : model.mesh.point_position) scalars.push_back(memory.vertex_scalars[p]);
  const size_t width = work.components.empty() ? 0 : work.components.size() / memory.vertex_scalars.size();
  const auto gather = [&](std::vector<glm::vec3>& out, size_t from) {
    out.clear();
    for (int p : model.mesh.point_position) {
      const float* const at = work.components.data() + width * p + from;
      out.emplace_back(at[0], at[1], at[2]);
    }
  };
  memory.vectors[b].clear();
  memory.shears[b].clear();
  if (width >= 3) gather(memory.vectors[b], 0);
  if (width == 6) gather(memory.shears[b], 3);
}

// What makes a scale's surface a ghost.
void make_ghost(const BodyModel& model, render::Surface& surface) {
  surface.opacity *= ghost_opacity;
  surface.casts_shadow = false;
  if (model.ghost_color) {
    surface.material.color = *model.ghost_color;
    surface.scalars = {};
    surface.vectors = surface.shears = {};
    surface.colors = {};
  }
  if (model.ghost == GhostStyle::mesh) {
    surface.wires = true;
    surface.edge_flags = model.mesh.triangle_edges;
    surface.edge_color = surface.material.color;
    surface.opacity = model.opacity;
  }
}

// One surface a scale: the first solid, the others ghosts.
void add_scales(const Animation& animation, size_t b, const glm::dmat4& pose, PictureMemory& memory, size_t& skin) {
  const BodyModel& model = animation.bodies[b];
  const size_t count = model.flexible && model.ghost != GhostStyle::none ? animation.scales.size() : 1;
  for (size_t s = 0; s < count; ++s) {
    PictureMemory::Skin& arrays = memory.skins[skin];
    if (model.flexible)
      update_surface(model, animation.scales[s], animation.settings.corotated, memory.bodies[b], arrays.positions, arrays.normals);
    else rest_surface(model, arrays.positions, arrays.normals);
    render::Surface& surface = add_surface(animation, memory, skin, model, pose);
    surface.scalars = memory.scalars[b];
    surface.vectors = memory.vectors[b];
    surface.shears = memory.shears[b];
    surface.colors = model.colors;
    if (s == 0 && surface.opacity >= 1.0f && !model.creases.empty()) {
      memory.picture.lines.push_back(crease_line(model, arrays, memory.scalars[b],
                                                 animation.settings.look == LookKind::print ? nullptr : &animation.scalar_map, pose));
      // A body that a section leaves whole keeps its lines.
      memory.picture.lines.back().cut = animation.cut.empty() || animation.cut[b];
    }
    if (!model.spine.empty() && (s == 0 || model.ghost == GhostStyle::body))
      memory.picture.lines.push_back(spine_line(memory, b, model, pose, s > 0));
    surface.cut = s == 0 && !animation.cut.empty() && animation.cut[b];
    surface.layer = static_cast<int>(b % 16);
    if (s == 0) memory.solid[b] = skin - 1;
    if (s > 0) make_ghost(model, surface);
  }
}

void make_pale(float opacity, render::Surface& surface) {
  surface.material.color = pale;
  surface.opacity = opacity;
  surface.behind = true;
  surface.casts_shadow = false;
}

// Past positions before picture k, a tenth of a second of playback apart, fading.
void add_trail(const Animation& animation, size_t b, int k, PictureMemory& memory, size_t& skin) {
  const BodyModel& model = animation.bodies[b];
  const sim::ResultBody& body = animation.results->bodies[b];
  const RenderSettings& settings = animation.settings;
  const int stride = std::max(1, static_cast<int>(std::lround(0.1 * settings.frame_rate)));
  for (int j = 1; j <= settings.trail && k - j * stride >= 0; ++j) {
    const SamplePlace past = find_sample(animation.results->times, picture_time(animation, k - j * stride));
    PictureMemory::Skin& arrays = memory.skins[skin];
    if (model.flexible) {
      update_displacement(model, body, past, memory.bodies[b]);
      update_surface(model, animation.scales[0], settings.corotated, memory.bodies[b], arrays.positions, arrays.normals);
    } else {
      rest_surface(model, arrays.positions, arrays.normals);
    }
    make_pale(trail_opacity * (1.0f - static_cast<float>(j - 1) / static_cast<float>(settings.trail)),
              add_surface(animation, memory, skin, model, body_pose(body, past)));
  }
}

void add_body(const Animation& animation, size_t b, int k, PictureMemory& memory, size_t& skin) {
  const BodyModel& model = animation.bodies[b];
  const sim::ResultBody& body = animation.results->bodies[b];
  const RenderSettings& settings = animation.settings;
  const double t = picture_time(animation, k);
  const SamplePlace place = find_sample(animation.results->times, t);
  const glm::dmat4 pose = body_pose(body, place);
  // Markers are asked for, or all there is.
  if (!body.nodes.empty() && (settings.nodes || model.mesh.triangles.empty())) add_node_markers(animation, b, place, memory);
  if (model.mesh.triangles.empty()) return;
  if (model.flexible) update_displacement(model, body, place, memory.bodies[b]);
  update_colors(animation, b, t, memory);
  add_scales(animation, b, pose, memory, skin);
  if (settings.undeformed && model.flexible) {
    rest_surface(model, memory.skins[skin].positions, memory.skins[skin].normals);
    make_pale(undeformed_opacity, add_surface(animation, memory, skin, model, pose));
  }
  add_trail(animation, b, k, memory, skin);
}

void add_symbols(const Animation& animation, const SamplePlace& place, render::Picture& picture) {
  for (const JointSymbol& symbol : animation.symbols) {
    render::Surface surface;
    surface.positions = symbol.positions;
    surface.normals = symbol.normals;
    surface.triangles = symbol.triangles;
    surface.pose = joint_pose(animation.results->joints[symbol.joint], symbol.fixed ? SamplePlace{} : place);
    surface.material = symbol_material(animation.settings);
    surface.two_sided = false;
    // A picture for show has no stains of what lies inside its bodies.
    surface.seen_through = animation.settings.look == LookKind::presentation ? 0.0f : 0.3f;
    picture.surfaces.push_back(surface);
  }
}

// A long sequence is surveyed at some of its pictures: a value of another one beyond the colours' ends is told in that picture.
void mark_beyond(const std::vector<std::vector<float>>& scalars, render::ScalarMap& map) {
  if (map.above && map.below) return;
  const double room = 0.01 * (map.upper - map.lower);
  double low = map.lower - (map.logarithmic ? 0.01 * map.lower : room), high = map.upper + room;
  bool above = false, below = false;
  for (const std::vector<float>& of_body : scalars)
    for (const float value : of_body) {
      if (static_cast<double>(value) > high) high = static_cast<double>(value), above = true;
      if (static_cast<double>(value) < low) low = static_cast<double>(value), below = true;
    }
  if (above && !map.above) map.above = high;
  if (below && !map.below) map.below = low;
}

}  // namespace

void aim_camera(const Animation& animation, int k, const render::Camera& first, render::Picture& picture) {
  const RenderSettings& settings = animation.settings;
  const double t = picture_time(animation, k);
  picture.camera = settings.camera.path.empty() ? first : render::camera_on_path(settings.camera.path, t);
  picture.views = animation.views;
  if (settings.camera.orbit != 0.0)
    picture.camera = render::orbit_camera(picture.camera, settings.camera.orbit * k / std::max(1, animation.count - 1));
  if (animation.follow < 0) return;
  const sim::ResultBody& body = animation.results->bodies[animation.follow];
  const glm::dvec3 way(body_pose(body, find_sample(animation.results->times, t))[3] - body_pose(body, {})[3]);
  picture.camera = render::shift_camera(picture.camera, way);
  for (render::View& view : picture.views) view.camera = render::shift_camera(view.camera, way);
}

void update_picture(const Animation& animation, int k, PictureMemory& memory) {
  const RenderSettings& settings = animation.settings;
  const double t = picture_time(animation, k);
  render::Picture& picture = memory.picture;
  picture.size = settings.size;
  picture.look = {.samples = settings.samples, .shadows = settings.shadows, .occlusion = settings.occlusion};
  picture.ground = animation.ground;
  picture.bounds = animation.bounds;
  picture.lighting.direction = animation.light;
  fill_overlay(animation, t, picture);
  picture.surfaces.clear();
  memory.drawn.clear();
  picture.markers.clear();
  picture.lines.clear();
  picture.labels.clear();
  memory.solid.resize(animation.bodies.size());
  memory.bodies.resize(animation.bodies.size());
  memory.scalars.resize(animation.bodies.size());
  memory.vectors.resize(animation.bodies.size());
  memory.shears.resize(animation.bodies.size());
  memory.skins.resize(skins_needed(animation));
  size_t skin = 0;
  for (size_t b = 0; b < animation.bodies.size(); ++b)
    if (animation.bodies[b].visible) add_body(animation, b, k, memory, skin);
  if (picture.overlay.scalar_bar) mark_beyond(memory.scalars, picture.scalar_map);
  add_symbols(animation, find_sample(animation.results->times, t), picture);
  update_attachments(animation, k, memory);
  if (settings.section) picture.cut = render::Cut{settings.section->point.value_or(animation.bounds.centre()), settings.section->normal};
  aim_camera(animation, k, animation.camera, picture);
  choose_levels(animation, memory);
  add_labels(animation, find_sample(animation.results->times, t), memory);
  if (settings.overlay.words) return;
  picture.labels.clear();
  for (render::Dimension& dimension : picture.dimensions) dimension.text.clear();
}

namespace {

// The hash of a picture, part by part.
class PictureHash {
 public:
  explicit PictureHash(const std::string& environment) { hash_.add_text(environment); }
  std::string hex() const { return hash_.hex(); }

  // Size, look, camera, light, views, bounds and ground.
  void add_frame(const render::Picture& picture) {
    number(picture.size.width, picture.size.height, picture.look.samples, picture.look.shadows, picture.look.occlusion);
    vector3(picture.background.top);
    vector3(picture.background.bottom);
    number(picture.background.transparent);
    add_camera(picture.camera);
    number(picture.lighting.direction.has_value(), picture.lighting.key, picture.lighting.ambient, picture.lighting.studio);
    if (picture.lighting.direction) vector3(*picture.lighting.direction);
    number(picture.views.size());
    for (const render::View& view : picture.views) {
      add_camera(view.camera);
      number(view.left, view.top, view.width, view.height);
      hash_.add_text(view.label);
    }
    for (const render::Inset& inset : picture.insets) {
      vector3(inset.point);
      number(inset.zoom, inset.size, static_cast<int>(inset.corner));
      hash_.add_text(inset.label);
    }
    vector3(picture.bounds.lower);
    vector3(picture.bounds.upper);
    number(picture.ground.has_value());
    if (picture.ground) {
      vector3(picture.ground->point);
      vector3(picture.ground->normal);
      number(picture.ground->spacing, picture.ground->lines);
      vector3(picture.ground->line_color);
    }
  }

  // Surfaces and markers.
  void add_surfaces(const render::Picture& picture) {
    for (const render::Surface& s : picture.surfaces) {
      hash_.add_bytes(s.positions.data(), s.positions.size_bytes());
      hash_.add_bytes(s.normals.data(), s.normals.size_bytes());
      hash_.add_bytes(s.triangles.data(), s.triangles.size_bytes());
      hash_.add_bytes(s.scalars.data(), s.scalars.size_bytes());
      hash_.add_bytes(s.vectors.data(), s.vectors.size_bytes());
      hash_.add_bytes(s.shears.data(), s.shears.size_bytes());
      hash_.add_bytes(s.colors.data(), s.colors.size_bytes());
      number(s.behind, s.seen_through, s.cut, s.layer);
      matrix(s.pose);
      vector3(s.material.color);
      number(s.material.roughness, s.material.metallic, s.opacity, s.two_sided, s.edges, s.wires, s.silhouette, s.casts_shadow,
             s.edge_width);
      vector3(s.edge_color);
      hash_.add_span(s.edge_flags);
    }
    for (const render::Markers& m : picture.markers) {
      hash_.add_bytes(m.points.data(), m.points.size() * sizeof(glm::vec3));
      number(static_cast<int>(m.shape), m.diameter, m.on_top, m.seen_through);
      color4(m.color);
      matrix(m.pose);
    }
  }

  // Lines, arrows and triads.
  void add_lines(const render::Picture& picture) {
    number(picture.lines.size(), picture.arrows.size(), picture.triads.size());
    for (const render::Lines& l : picture.lines) {
      hash_.add_bytes(l.points.data(), l.points.size() * sizeof(glm::vec3));
      color4(l.color);
      hash_.add_bytes(l.colors.data(), l.colors.size() * sizeof(glm::vec4));
      hash_.add_bytes(l.faces.data(), l.faces.size() * sizeof(glm::vec3));
      number(l.width, l.strip, l.on_top, l.seen_through, l.cut);
      matrix(l.pose);
    }
    for (const render::Arrow& a : picture.arrows) {
      vector3(a.from);
      vector3(a.to);
      vector3(a.color);
      number(a.radius, a.opacity, a.seen_through);
    }
    for (const render::Label& label : picture.labels) {
      hash_.add_text(label.text);
      vector3(label.point);
      vector3(label.color);
      number(label.size, label.leader);
    }
    for (const render::Dimension& d : picture.dimensions) {
      hash_.add_text(d.text);
      for (const glm::dvec3& p : d.line) vector3(p);
      for (const auto& helper : d.helpers)
        for (const glm::dvec3& p : helper) vector3(p);
    }
    if (picture.cut) {
      vector3(picture.cut->point);
      vector3(picture.cut->normal);
    }
    for (const render::Triad& a : picture.triads) {
      matrix(a.pose);
      number(a.length, a.seen_through);
    }
  }

  // Words, scales and plots over the picture.
  void add_words(const render::Picture& picture) {
    const render::Overlay& overlay = picture.overlay;
    for (const std::string* text : {&overlay.title, &overlay.time, &overlay.note}) hash_.add_text(*text);
    number(overlay.triad, overlay.scalar_bar.has_value(), overlay.text_scale, overlay.dark, overlay.plot_share,
           static_cast<int>(overlay.plot_place));
    if (overlay.scalar_bar) {
      hash_.add_text(overlay.scalar_bar->label);
      hash_.add_text(overlay.scalar_bar->unit);
      number(overlay.scalar_bar->factor);
    }
    number(static_cast<int>(picture.scalar_map.colormap), picture.scalar_map.lower, picture.scalar_map.upper, picture.scalar_map.levels,
           picture.scalar_map.isolines, picture.scalar_map.lightened, picture.scalar_map.logarithmic,
           picture.scalar_map.above.value_or(-1.0), picture.scalar_map.below.value_or(-1.0));
    for (const render::LegendEntry& entry : overlay.legend) {
      hash_.add_text(entry.text);
      vector3(entry.color);
      number(entry.opacity);
    }
    for (const render::Plot& plot : overlay.plots) {
      hash_.add_text(plot.x_label);
      hash_.add_text(plot.y_label);
      number(plot.mark);
      for (const render::Series& series : plot.series) {
        hash_.add_text(series.label);
        hash_.add_bytes(series.x.data(), series.x.size_bytes());
        hash_.add_bytes(series.y.data(), series.y.size_bytes());
      }
    }
  }

 private:
  template <class... Values>
  void number(Values... values) {
    (hash_.add(static_cast<double>(values)), ...);
  }
  template <class V>
  void vector3(const V& v) {
    number(v.x, v.y, v.z);
  }
  void color4(const glm::vec4& v) { number(v.x, v.y, v.z, v.w); }
  void matrix(const glm::dmat4& m) {
    for (int c = 0; c < 4; ++c) number(m[c].x, m[c].y, m[c].z, m[c].w);
  }
  void add_camera(const render::Camera& camera) {
    vector3(camera.position);
    vector3(camera.target);
    vector3(camera.up);
    number(camera.fov, camera.height, static_cast<int>(camera.projection));
  }

  interp::Hash hash_;
};

}  // namespace

render::Material symbol_material(const RenderSettings& settings) {
  // Blue, so that what is seen of them through a body is no stain of it.
  if (settings.studio) return {.color = {0.16f, 0.30f, 0.50f}, .roughness = 0.35f, .metallic = 0.2f};
  return {.color = {0.24f, 0.26f, 0.30f}, .roughness = 0.35f, .metallic = 0.4f};
}

std::string picture_hash(const render::Picture& picture, const std::string& environment) {
  PictureHash hash(environment);
  hash.add_frame(picture);
  hash.add_surfaces(picture);
  hash.add_lines(picture);
  hash.add_words(picture);
  return hash.hex();
}

}  // namespace flexframe::film
