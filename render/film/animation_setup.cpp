// What is settled before the first picture: bodies and maps, scales, camera, ground, joint symbols, plots.
#include "render/film/animation_colors.h"
#include "render/film/attachments.h"
#include "render/film/dimensions.h"
#include "render/film/joint_symbols.h"
#include "render/film/overlay.h"
#include "render/film/survey.h"

#include "interp/watch.h"
#include "render/frame/camera.h"
#include "render/image/text.h"
#include "sim/base/cpu_clock.h"
#include "sim/base/eigen_solvers.h"
#include "sim/base/file_output.h"
#include "sim/base/notes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::film {
namespace {

const sim::BodyDef* find_body(const sim::Scene* scene, const std::string& name) {
  if (!scene) return nullptr;
  for (const sim::BodyDef& body : scene->bodies)
    if (body.name == name) return &body;
  return nullptr;
}

int body_index(const sim::Results& results, const std::string& name) {
  for (size_t b = 0; b < results.bodies.size(); ++b)
    if (results.bodies[b].name == name) return static_cast<int>(b);
  return -1;
}

// Columns of one unit share a panel unless one would be flat in it; lengths are shown in the unit that suits them.
void add_panels(Animation& animation) {
  constexpr double flat = 0.1;
  const sim::Results& results = *animation.results;
  struct Range {
    std::string unit;
    double low, high, least;  // of all, and the smallest of one
  };
  std::vector<Range> ranges;
  std::vector<std::vector<const sim::ResultOutput*>> chosen;
  std::vector<const sim::ResultOutput*> wanted;
  for (const std::string& word : animation.settings.overlay.plot)
    for (const sim::ResultOutput& output : results.outputs)
      if (names_column(word, output.column) && output.values.size() > 0 && std::find(wanted.begin(), wanted.end(), &output) == wanted.end())
        wanted.push_back(&output);
  for (const sim::ResultOutput* output : wanted) {
    const double low = output->values.minCoeff(), high = output->values.maxCoeff();
    const auto with = [&](const Range& r) {
      return Range{r.unit, std::min(r.low, low), std::max(r.high, high), std::min(r.least, high - low)};
    };
    size_t panel = 0;
    for (; panel < ranges.size(); ++panel)
      if (const Range all = with(ranges[panel]); all.unit == output->unit && all.least > flat * (all.high - all.low)) break;
    if (panel == ranges.size()) {
      ranges.push_back({output->unit, low, high, high - low});
      chosen.emplace_back();
    }
    ranges[panel] = with(ranges[panel]);
    chosen[panel].push_back(output);
  }
  for (size_t panel = 0; panel < chosen.size(); ++panel) {
    const auto [unit, factor] = readable_unit(ranges[panel].unit, std::max(std::abs(ranges[panel].low), std::abs(ranges[panel].high)));
    PlotPanel& made = animation.panels.emplace_back(PlotPanel{.y_label = unit, .factor = factor, .series = {}});
    for (const sim::ResultOutput* output : chosen[panel]) {
      made.series.push_back(thin_series(output->column, results.times, factor * output->values));
      PlotSeries& series = made.series.back();
      if (std::ssize(series.x) < output->values.size()) series.times = &results.times, series.values = &output->values;
    }
  }
}

void set_scales(Animation& animation, double size) {
  std::vector<double> scales = animation.settings.scales;
  if (scales.empty()) {
    scales = {1.0};
    const double scale = interp::auto_scale(animation.largest_displacement, size);
    if (scale >= 2.0) scales.push_back(scale);
  }
  // The solid body comes first: in scale where that is asked for.
  const auto one = std::find(scales.begin(), scales.end(), 1.0);
  if (one != scales.end()) std::rotate(scales.begin(), one, one + 1);
  animation.scales = scales;
}

// Words that no font here has.
void warn_of_letters(Animation& animation) {
  std::string words = animation.results->title;
  for (const DimensionSettings& d : animation.settings.dimensions) words += d.label;
  for (const InsetSettings& inset : animation.settings.insets) words += inset.drawing.label;
  for (const std::string& probe : animation.settings.probes) words += probe;
  for (const auto& [name, color] : animation.settings.runs) words += name;
  for (const BodyModel& body : animation.bodies) words += body.name;
  for (const std::string& column : animation.settings.overlay.plot) words += column;
  if (const std::string missing = render::missing_characters(words); !missing.empty())
    animation.warnings.push_back(fmt::format(
        "no font here has the characters {} of the title, names or labels: they are drawn as boxes; the Debian package "
        "fonts-droid-fallback has Chinese and Japanese, fonts-nanum Korean, or let FLEXFRAME_FONT_FALLBACK name a TrueType file",
        missing));
}

// The points turned about the vertical through the centre: what an orbiting camera must keep in sight.
std::vector<glm::dvec3> all_around(const std::vector<glm::dvec3>& points, const glm::dvec3& centre, const glm::dvec3& up) {
  // Of points at one height the farthest is enough; 64 heights and 24 ways round are within a hundredth of the circle.
  const glm::dvec3 axis = glm::normalize(up),
                   side = glm::normalize(glm::cross(axis, std::abs(axis.x) < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0))),
                   front = glm::cross(axis, side);
  double low = 0.0, high = 0.0;
  for (const glm::dvec3& p : points) {
    low = std::min(low, glm::dot(p - centre, axis));
    high = std::max(high, glm::dot(p - centre, axis));
  }
  constexpr int heights = 64, ways = 24;
  std::vector<double> reach(heights + 1, -1.0);
  const double step = high > low ? (high - low) / heights : 1.0;
  for (const glm::dvec3& p : points) {
    const double height = glm::dot(p - centre, axis);
    double& r = reach[std::clamp(std::lround((height - low) / step), 0L, long(heights))];
    r = std::max(r, 1.01 * glm::length(p - centre - height * axis));
  }
  std::vector<glm::dvec3> around;
  for (int h = 0; h <= heights; ++h)
    for (int k = 0; k < ways && reach[h] >= 0.0; ++k) {
      const double angle = 2.0 * M_PI * k / ways;
      around.push_back(centre + (low + h * step) * axis + reach[h] * (std::cos(angle) * side + std::sin(angle) * front));
    }
  return around;
}

// Directions of view that have a name. "plane": square on to the plane in which things move most.
void set_preset(const std::string& preset, const std::vector<glm::dvec3>& points, render::FitOptions& fit) {
  const glm::dvec3 front = std::abs(fit.up.z) > 0.5 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, -1), side(-1, 0, 0);
  const glm::dvec3 before = fit.direction;
  if (preset == "front") fit.direction = front;
  else if (preset == "side") fit.direction = side;
  else if (preset == "top") fit.direction = -fit.up;
  else if (preset == "iso") fit.direction = glm::normalize(0.8 * front + 0.55 * side - 0.5 * fit.up);
  if (preset == "top") fit.up = front;
  if (preset != "plane" || points.empty()) return;
  glm::dvec3 mean(0.0);
  for (const glm::dvec3& p : points) mean += p / static_cast<double>(points.size());
  sim::MatX spread = sim::MatX::Zero(3, 3);
  for (const glm::dvec3& p : points) {
    const sim::Vec3 d(p.x - mean.x, p.y - mean.y, p.z - mean.z);
    spread += d * d.transpose();
  }
  const sim::SymmetricEigen axes(spread);
  glm::dvec3 normal(axes.eigenvectors()(0, 0), axes.eigenvectors()(1, 0), axes.eigenvectors()(2, 0));
  // Exactly along an axis of the world where it is nearly one.
  for (int k = 0; k < 3; ++k)
    if (std::abs(normal[k]) > 0.995) {
      normal = glm::dvec3(0.0);
      normal[k] = 1.0;
    }
  fit.direction = glm::dot(normal, before) > 0.0 ? normal : -normal;
  fit.projection = render::Projection::orthographic;
}

// Where rails begin and end: a fitted camera sees them whole.
void append_rails(const Animation& animation, std::vector<glm::dvec3>& points) {
  for (const JointSymbol& symbol : animation.symbols)
    if (symbol.fixed) {
      const glm::dmat4 pose = joint_pose(animation.results->joints[symbol.joint], {0, 0.0});
      for (const glm::vec3& p : symbol.positions) points.emplace_back(pose * glm::dvec4(p, 1.0));
    }
}

// The fitted camera, a little further off where that takes in the shadows on the ground too.
render::Camera fit_with_shadows(const render::Picture& picture, const std::vector<glm::dvec3>& points, const render::FitOptions& fit) {
  constexpr double most = 1.12;  // a shadow is worth that much of the size of what throws it
  const render::Camera camera = render::fit_camera(picture, points, fit);
  if (!picture.ground || !picture.look.shadows) return camera;
  const render::Ground& ground = *picture.ground;
  const glm::dvec3 light =
      picture.lighting.direction ? glm::normalize(glm::dvec3(*picture.lighting.direction)) : render::default_light(camera, ground.normal);
  const double steep = glm::dot(light, ground.normal);
  if (steep < 0.05) return camera;
  // Of the way to the shadows as much as is allowed.
  for (int quarters = 4; quarters > 0; --quarters) {
    std::vector<glm::dvec3> all = points;
    for (const glm::dvec3& p : points) all.push_back(p - light * (0.25 * quarters * glm::dot(p - ground.point, ground.normal) / steep));
    const render::Camera wider = render::fit_camera(picture, all, fit);
    if (wider.height <= most * camera.height) return wider;
  }
  return camera;
}

// points: of the whole motion, which decides the view; seen: what a fitted camera takes in, and what the ground lies below.
void set_camera(Animation& animation, const std::vector<glm::dvec3>& points, const std::vector<glm::dvec3>& seen,
                const glm::dvec3& gravity) {
  const CameraSettings& asked = animation.settings.camera;
  // Where nothing falls, what is asked to be up decides what it is looked at from.
  const bool weightless = glm::length(gravity) == 0.0;
  render::FitOptions fit = render::default_view(points, weightless && asked.up ? -*asked.up : gravity);
  fit.fov = asked.fov;
  fit.projection = asked.projection;
  if (asked.up) fit.up = *asked.up;
  const glm::dvec3 vertical = fit.up;  // of the ground too, however the view is turned
  if (!asked.preset.empty()) set_preset(asked.preset, points, fit);
  if (asked.direction) fit.direction = *asked.direction;
  if (asked.position) fit.direction = asked.target.value_or(animation.bounds.centre()) - *asked.position;
  // Looking along the vertical leaves none: any other direction serves as up.
  if (glm::length(glm::cross(glm::normalize(fit.direction), fit.up)) < 1e-6)
    fit.up = std::abs(fit.up.x) < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);

  if (animation.settings.ground && animation.settings.background != BackgroundKind::transparent)
    animation.ground = render::default_ground(seen, vertical);
  if (animation.ground) {
    animation.ground->lines = animation.settings.grid;
    // As far from the dark backdrop as the lines of the others are from theirs (contrast 2.1), below what is drawn in front of them.
    if (animation.settings.background == BackgroundKind::dark) animation.ground->line_color = glm::vec3(0.29f, 0.32f, 0.36f);
  }
  render::Picture picture;
  picture.size = animation.settings.size;
  fill_overlay(animation, 0.0, picture);
  if (!asked.views.empty()) {
    picture.ground = animation.ground;
    picture.bounds = animation.bounds;
    animation.views = render::make_views(picture, seen, fit.up, asked.views);
    animation.camera = animation.views.front().camera;
  } else if (asked.fit && asked.path.empty()) {
    picture.ground = animation.ground;
    picture.bounds = animation.bounds;
    animation.fit = fit;
    animation.points = asked.orbit != 0.0 ? all_around(seen, animation.bounds.centre(), fit.up) : seen;
    picture.look.shadows = animation.settings.shadows;
    animation.camera = fit_with_shadows(picture, animation.points, fit);
  } else {
    animation.camera = !asked.path.empty() ? asked.path.front().camera
                                           : render::Camera{.position = *asked.position,
                                                            .target = asked.target.value_or(animation.bounds.centre()),
                                                            .up = fit.up,
                                                            .fov = asked.fov,
                                                            .height = asked.height,
                                                            .projection = asked.projection};
  }
}

// What is seen in the camera's window: bodies, springs, arrows, and rails whole.
std::vector<glm::dvec3> points_of_window(const Animation& animation, const Survey& survey, const std::vector<double>& scales) {
  const std::pair<double, double>& window = *animation.settings.camera.window;
  const sim::VecX& times = animation.results->times;
  std::vector<glm::dvec3> points = motion_points(survey, scales, animation.follow, &window);
  if (points.empty())
    throw sim::InputError(fmt::format("[render] camera.window [{:g}, {:g}] holds no moment of the run, which lasts from {:g} to {:g} s",
                                      window.first, window.second, times[0], times[times.size() - 1]));
  append_ends(animation, points, &window);
  if (animation.follow < 0) append_rails(animation, points);
  return points;
}

// Bodies of many triangles are drawn with fewer where they are finer than the pixels.
void add_levels(Animation& animation) {
  size_t all = 0;
  for (const BodyModel& model : animation.bodies) all += model.visible ? model.triangles.size() : 0;
  if (!animation.settings.level_of_detail || all < detail_from) return;
  for (BodyModel& model : animation.bodies) {
    if (!model.visible || 10 * model.triangles.size() < all) continue;
    std::vector<glm::vec3> rest;
    rest.reserve(model.mesh.point_position.size());
    for (const int p : model.mesh.point_position) rest.emplace_back(model.mesh.positions[static_cast<size_t>(p)]);
    model.levels = make_levels(rest, model.triangles);
    if (model.levels.empty()) continue;
    animation.notes.push_back(
        fmt::format("{}: of its {} triangles no more are drawn than half a pixel and a hundredth of the colours take, {} at least; "
                    "[render] level_of_detail = false draws all",
                    model.name, model.triangles.size(), model.levels.front().triangles.size()));
  }
}

double diagonal(const render::Mesh& mesh) {
  if (mesh.positions.empty()) return 0.0;
  const render::Bounds box = render::compute_bounds(mesh);
  return glm::length(box.upper - box.lower);
}

// A mesh of a file that dwarfs all else whose size is known (beams, bodies of files, other meshes) and the way that bodies go: most likely
// in millimetres.
std::string mistaken_unit(const sim::Results& results, const std::vector<BodyModel>& bodies, size_t which) {
  constexpr double dwarfs = 300.0;
  if (results.bodies[which].mesh.empty()) return {};
  double rest = 0.0;
  for (size_t b = 0; b < results.bodies.size(); ++b)
    if (b != which && (!results.bodies[b].mesh.empty() || !results.bodies[b].nodes.empty()))
      rest = std::max(rest, diagonal(bodies[b].mesh));
  if (rest == 0.0) return {};
  Eigen::RowVector3d lower = results.bodies[which].position.row(0), upper = lower;
  for (const sim::ResultBody& body : results.bodies) {
    lower = lower.cwiseMin(body.position.colwise().minCoeff());
    upper = upper.cwiseMax(body.position.colwise().maxCoeff());
  }
  rest = std::max(rest, (upper - lower).norm());
  const double size = diagonal(bodies[which].mesh);
  if (!(size > dwarfs * rest)) return {};
  return fmt::format(
      "its mesh is {:.3g} m large, {:.0f} times all else: if the file is in millimetres, say mesh = {{ file = ..., unit = \"mm\" }}", size,
      size / rest);
}

// What bodies look like for want of something, equal words once.
void tell_of_bodies(Animation& animation, const sim::Scene* scene) {
  const sim::Results& results = *animation.results;
  const bool shares = animation.settings.color_by == ColorBy::stress && shares_of_yield(animation.bodies);
  sim::Notes notes;
  for (size_t b = 0; b < results.bodies.size(); ++b) {
    const sim::ResultBody& body = results.bodies[b];
    BodyModel& model = animation.bodies[b];
    const std::string owner = fmt::format("body '{}'", body.name);
    if (!body.mesh.empty() && !body.mesh_sha256.empty() && sim::sha256_of_file(body.mesh) != body.mesh_sha256)
      notes.warn(owner, fmt::format("the mesh {} has changed since the results were made", body.mesh));
    for (const std::string& refused : model.refused) notes.warn(owner, refused);
    if (const std::string unit = mistaken_unit(results, animation.bodies, b); !unit.empty()) notes.warn(owner, unit);
    // Nodes that are joined for want of a mesh have no shape between them.
    const sim::BodyDef* def = find_body(scene, body.name);
    const bool shaped = !body.mesh.empty() || body.surface.triangles.rows() > 0 || (def && !def->shapes.empty());
    if (const std::string doubtful = shaped ? doubtful_map(model, results, body) : ""; !doubtful.empty()) notes.warn(owner, doubtful);
    for (const std::string& warning : model.warnings) notes.tell(owner, warning);
    if (!shares) continue;
    model.shares_of_yield = true;
    if (!(model.yield_stress > 0.0) && (model.stress || model.beam_stress || !model.vertex_nodes.empty()))
      notes.warn(owner, "has no yield_stress and is grey: give it one in its 'drawing' or for all in [render]");
  }
  for (std::string& text : notes.texts(sim::Severity::warning)) animation.warnings.push_back(std::move(text));
  for (std::string& text : notes.texts(sim::Severity::note)) animation.notes.push_back(std::move(text));
}

}  // namespace

Animation make_animation(const sim::Results& results, const RenderSettings& asked, const sim::Scene* scene) {
  if (results.times.size() == 0) throw sim::InputError("the results hold no samples: nothing to draw");
  if (results.bodies.empty()) throw sim::InputError("the results hold no bodies: nothing to draw");
  const double start = sim::process_cpu_seconds();
  Animation animation;
  animation.results = &results;
  animation.settings = asked;
  const double speed = playback_speed(asked, results.times[results.times.size() - 1] - results.times[0]);
  animation.settings.speed = speed;
  if (asked.speed == 0.0 && speed != 1.0)
    animation.notes.push_back(fmt::format("played at {:g} simulated seconds per second, because [render] speed is not given", speed));
  const RenderSettings& settings = animation.settings;
  animation.count = picture_count(results.times, settings.frame_rate, speed);
  animation.step = speed / settings.frame_rate;

  // Bodies without measures of their own are made as large as suits those that have some.
  animation.bodies.resize(results.bodies.size());
  const double nodes = machine_size(results, {});  // what exaggeration is measured by: origins and nodes
  double size = nodes;
  for (const bool measured : {true, false}) {
    for (size_t b = 0; b < results.bodies.size(); ++b)
      if (const sim::BodyDef* def = find_body(scene, results.bodies[b].name);
          measured == (!results.bodies[b].mesh.empty() || (def && !def->shapes.empty()))) {
        interp::look();
        BodyDrawing drawing{.def = def, .size = size, .places = {}};
        if (scene) drawing.gravity = scene->simulation.gravity;
        if (def) drawing.places = holding_places(*scene, *def);
        animation.bodies[b] = make_body_model(results.bodies[b], drawing, settings, static_cast<int>(b));
      }
    if (measured) size = machine_size(results, animation.bodies);
  }
  size = machine_size(results, animation.bodies);
  tell_of_bodies(animation, scene);
  add_levels(animation);
  const Survey survey = survey_motion(results, animation.bodies, settings);
  animation.largest_displacement = survey.largest_displacement;
  set_scales(animation, nodes);
  set_colors(animation, survey);
  mark_coarse(animation, survey);
  warn_of_letters(animation);
  if (!settings.corotated)
    for (double scale : animation.scales)
      if (const std::string warning = scale > 1.0 ? interp::exaggeration_warning(survey.largest_turn, scale) : ""; !warning.empty())
        animation.notes.push_back(warning);

  animation.follow = settings.camera.follow.empty() ? -1 : body_index(results, settings.camera.follow);
  std::vector<double> drawn = animation.scales;
  if (settings.undeformed) drawn.push_back(0.0);
  std::vector<glm::dvec3> points = motion_points(survey, drawn, animation.follow);
  if (settings.section)
    for (const sim::ResultBody& body : results.bodies) {
      const std::vector<std::string>& chosen = settings.section->bodies;
      animation.cut.push_back(chosen.empty() || std::find(chosen.begin(), chosen.end(), body.name) != chosen.end());
      const size_t b = animation.cut.size() - 1;
      if (animation.cut[b] && !animation.bodies[b].mesh.triangles.empty() && !animation.bodies[b].closed)
        animation.warnings.push_back(
            fmt::format("body '{}': its mesh is not closed: where [render] section cuts it there is no cap", body.name));
    }
  add_attachments(animation, scene, size);
  append_ends(animation, points);
  if (settings.joints && scene) add_joint_symbols(animation, *scene, size);
  if (animation.follow < 0) append_rails(animation, points);
  for (const glm::dvec3& p : points) animation.bounds.add(p);
  append_dimensions(animation, points);  // seen, but nothing that stands on the ground or throws a shadow
  add_panels(animation);
  const sim::Vec3 g = scene ? scene->simulation.gravity : sim::Vec3::Zero();
  const std::vector<glm::dvec3> seen = settings.camera.window ? points_of_window(animation, survey, drawn) : points;
  set_camera(animation, points, seen, {g.x(), g.y(), g.z()});
  const CameraSettings& camera = animation.settings.camera;
  if (camera.orbit != 0.0 || !camera.path.empty())
    animation.light = glm::vec3(render::default_light(animation.camera, animation.ground ? animation.ground->normal : animation.camera.up));
  animation.cpu_setup = sim::process_cpu_seconds() - start;
  return animation;
}

std::optional<Colors> colors_by(Animation& animation, ColorBy by) {
  // Ranges and bars look at the models, which may be large: lent, not copied.
  Animation other;
  other.results = animation.results;
  other.settings = animation.settings;
  other.settings.color_by = by;
  other.settings.color_range.reset();
  other.bodies.swap(animation.bodies);
  try {
    set_colors(other, survey_motion(*other.results, other.bodies, other.settings));
  } catch (...) {
    other.bodies.swap(animation.bodies);
    throw;
  }
  other.bodies.swap(animation.bodies);
  if (!other.scalar_bar) return std::nullopt;
  return Colors{.settings = other.settings, .map = other.scalar_map, .bar = *other.scalar_bar};
}

double picture_time(const Animation& animation, int picture) {
  return picture_time(animation.results->times, animation.settings.frame_rate, animation.settings.speed, picture);
}

}  // namespace flexframe::film
