#include "render/film/page.h"

#include "render/base/base64.h"
#include "render/base/deflate.h"
#include "render/base/house_page.h"
#include "render/base/html.h"
#include "render/film/overlay.h"
#include "render/film/page_colors.h"
#include "render/film/page_texts.h"
#include "render/film/picture_accuracy.h"
#include "render/film/shape_basis.h"
#include "render/frame/backdrop.h"
#include "render/frame/layout.h"
#include "sim/base/error.h"

#include <fmt/format.h>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::film {
namespace {

using Json = nlohmann::ordered_json;
constexpr int trace_points = 1500;  // of one trace, as in pictures

Json vector(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

// Poses of a frame at every picture: positions and unit quaternions x y z w.
template <class Pose>
void add_motion(PageBlock& block, int count, Pose&& pose, Json& body) {
  std::vector<float> positions, rotations;
  glm::dquat before(1, 0, 0, 0);
  for (int k = 0; k < count; ++k) {
    const glm::dmat4 m = pose(k);
    glm::dquat q = glm::normalize(glm::quat_cast(glm::dmat3(m)));
    if (glm::dot(before, q) < 0.0) q = -q;
    before = q;
    for (int i = 0; i < 3; ++i) positions.push_back(static_cast<float>(m[3][i]));
    for (const double v : {q.x, q.y, q.z, q.w}) rotations.push_back(static_cast<float>(v));
  }
  body["position"] = block.add(positions);
  body["rotation"] = block.add(rotations);
}

// Undeformed vertices: 16 bits of the box around them; normals as 16-bit directions.
void add_rest(PageBlock& block, const std::vector<glm::vec3>& points, const std::vector<glm::vec3>& normals,
              const std::vector<glm::uvec3>& triangles, Json& body, PageReport& report) {
  glm::vec3 low(std::numeric_limits<float>::max()), high(std::numeric_limits<float>::lowest());
  for (const glm::vec3& p : points) low = glm::min(low, p), high = glm::max(high, p);
  const glm::vec3 step = glm::max((high - low) / 65535.0f, glm::vec3(std::numeric_limits<float>::min()));
  std::vector<std::uint16_t> rest;
  std::vector<std::int16_t> directions;
  for (const glm::vec3& p : points)
    for (int i = 0; i < 3; ++i) rest.push_back(static_cast<std::uint16_t>(std::clamp(std::lround((p[i] - low[i]) / step[i]), 0L, 65535L)));
  for (const glm::vec3& n : normals)
    for (int i = 0; i < 3; ++i) directions.push_back(static_cast<std::int16_t>(std::lround(32767.0f * std::clamp(n[i], -1.0f, 1.0f))));
  std::vector<std::uint32_t> corners;
  for (const glm::uvec3& t : triangles)
    for (int i = 0; i < 3; ++i) corners.push_back(t[i]);
  body["points"] = points.size();
  body["rest"] = block.add(rest);
  body["rest_low"] = vector(low);
  body["rest_step"] = vector(step);
  body["normals"] = block.add(directions);
  body["triangles"] = block.add(corners);
  report.error = std::max(report.error, 0.5 * static_cast<double>(glm::length(step)));
  report.triangles += triangles.size();
}

void add_deformation(PageBlock& block, const BodyModel& model, const ShapeBasis& basis, Json& body, PageReport& report) {
  const int count = static_cast<int>(basis.shapes.cols());
  if (count == 0) return;
  BodyMemory memory;
  std::vector<glm::vec3> moved, normals;
  std::vector<std::int16_t> shapes;
  std::vector<std::int8_t> turns;
  std::vector<float> steps, turn_steps, values;
  double rounding = 0.0;
  for (int k = 0; k < count; ++k) {
    // Differences at the largest weight of the run: what normals do is not linear beyond.
    const float size = std::max(basis.weights.row(k).cwiseAbs().maxCoeff(), std::numeric_limits<float>::min());
    memory.displacement.assign(basis.shapes.col(k).data(), basis.shapes.col(k).data() + basis.shapes.rows());
    values.clear();
    for (const int p : model.mesh.point_position)
      for (int i = 0; i < 3; ++i) values.push_back(memory.displacement[3 * static_cast<size_t>(p) + static_cast<size_t>(i)]);
    steps.push_back(round_to(values, shapes));
    rounding += 0.9 * static_cast<double>(steps.back() * size);  // half a step along each axis
    update_surface(model, size, false, memory, moved, normals);
    values.clear();
    for (size_t p = 0; p < normals.size(); ++p)
      for (int i = 0; i < 3; ++i) values.push_back((normals[p][i] - model.rest_normals[p][i]) / size);
    turn_steps.push_back(round_to(values, turns));
  }
  body["shapes"] = count;
  body["shape_data"] = block.add(shapes);
  body["shape_step"] = steps;
  body["turn_data"] = block.add(turns);
  body["turn_step"] = turn_steps;
  body["weights"] = block.add(by_picture(basis.weights));
  report.error = std::max(report.error, basis.error + rounding);
}

void add_look(const render::Material& look, float opacity, Json& body) {
  body["color"] = vector(look.color);
  body["metallic"] = look.metallic;
  body["opacity"] = opacity;
}

void add_body(PageBlock& block, const Animation& animation, const PageColors& colors, int b, Json& bodies, PageReport& report) {
  const Animation& shown = colors.stressed ? *colors.stressed : animation;
  const BodyModel &model = shown.bodies[b], &look = animation.bodies[b];
  const sim::ResultBody& result = animation.results->bodies[b];
  if (model.mesh.triangles.empty()) {
    report.notes.push_back(fmt::format("body '{}' has no mesh and is left out of the page", result.name));
    return;
  }
  Json body = {{"name", result.name}, {"kind", "body"}, {"visible", look.visible}};
  add_look(look.material, look.opacity, body);
  add_motion(
      block, animation.count, [&](int k) { return body_pose(result, find_sample(animation.results->times, picture_time(animation, k))); },
      body);
  std::vector<glm::vec3> points;
  for (const int p : model.mesh.point_position) points.emplace_back(model.mesh.positions[p]);
  add_rest(block, points, model.rest_normals, model.triangles, body, report);
  if (!model.colors.empty() && !look.colors.empty()) {
    std::vector<std::uint8_t> own;
    for (const glm::vec3& c : model.colors)
      for (int i = 0; i < 3; ++i) own.push_back(static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(c[i], 0.0f, 1.0f))));
    body["colors"] = block.add(own);
    glm::vec3 mean(0.0f);  // for the list of bodies
    for (const glm::vec3& c : model.colors) mean += c / static_cast<float>(model.colors.size());
    body["color"] = vector(mean);
  }
  if (!model.creases.empty()) {
    std::vector<std::uint32_t> ends;
    for (const BodyModel::Crease& crease : model.creases)
      for (const int end : {crease.a, crease.b}) ends.push_back(static_cast<std::uint32_t>(end));
    body["creases"] = block.add(ends);
  }
  const ShapeBasis basis = model.flexible ? make_shape_basis(shown, b) : ShapeBasis();
  if (model.flexible) add_deformation(block, model, basis, body, report);
  report.value_error = std::max(report.value_error, add_body_colors(colors, shown, b, basis, block, body));
  ++report.bodies;
  bodies.push_back(std::move(body));
}

void add_symbol(PageBlock& block, const Animation& animation, const JointSymbol& symbol, Json& bodies, PageReport& report) {
  const sim::ResultJoint& joint = animation.results->joints[symbol.joint];
  Json body = {{"name", joint.name}, {"kind", "joint"}, {"visible", true}};
  add_look(symbol_material(animation.settings), 1.0f, body);
  add_motion(
      block, animation.count,
      [&](int k) {
        const double t = symbol.fixed ? animation.results->times[0] : picture_time(animation, k);
        return joint_pose(joint, find_sample(animation.results->times, t));
      },
      body);
  add_rest(block, symbol.positions, symbol.normals, symbol.triangles, body, report);
  bodies.push_back(std::move(body));
}

void push_point(std::vector<float>& out, const glm::dvec3& p) {
  for (int i = 0; i < 3; ++i) out.push_back(static_cast<float>(p[i]));
}

// Paths of frames and springs between frames, in scale.
void add_lines(PageBlock& block, const Animation& animation, Json& scene) {
  const sim::Results& results = *animation.results;
  const double first = results.times[0], last = results.times[results.times.size() - 1];
  const int points = static_cast<int>(std::min<Eigen::Index>(trace_points, std::max<Eigen::Index>(2, results.times.size())));
  scene["traces"] = Json::array();
  for (size_t k = 0; k < animation.traces.size(); ++k) {
    std::vector<float> path;
    for (int i = 0; i < points; ++i) {
      const double t = first + (last - first) * i / (points - 1);
      push_point(path, glm::dvec3(place_pose(results, animation.traces[k], find_sample(results.times, t), 1.0)[3]));
    }
    scene["traces"].push_back({{"points", block.add(path)},
                               {"step", std::max((last - first) / (points - 1), std::numeric_limits<double>::min())},
                               {"color", vector(render::category_color(static_cast<int>(k) + 1))}});
  }
  scene["springs"] = Json::array();
  for (const SpringSymbol& spring : animation.springs) {
    std::vector<float> ends;
    for (int k = 0; k < animation.count; ++k) {
      const SamplePlace at = find_sample(results.times, picture_time(animation, k));
      for (const FramePlace* const end : {&spring.from, &spring.to}) push_point(ends, glm::dvec3(place_pose(results, *end, at, 1.0)[3]));
    }
    scene["springs"].push_back({{"ends", block.add(ends)}, {"radius", spring.coil}});
  }
}

// Every output, thinned so that each bin keeps its extremes; the plots of the pictures are open at the start.
void add_outputs(PageBlock& block, const Animation& animation, Json& scene) {
  scene["outputs"] = scene["plots"] = Json::array();
  const auto& asked = animation.settings.overlay.plot;
  for (const sim::ResultOutput& output : animation.results->outputs) {
    if (output.values.size() == 0 || !output.values.allFinite()) continue;
    const PlotSeries series = thin_series(output.column, animation.results->times, output.values);
    const auto [unit, factor] = readable_unit(output.unit, output.values.cwiseAbs().maxCoeff());
    if (std::any_of(asked.begin(), asked.end(), [&](const std::string& word) { return names_column(word, output.column); }))
      scene["plots"].push_back(scene["outputs"].size());
    scene["outputs"].push_back({{"label", output.column},
                                {"unit", unit == "1" ? "" : unit},
                                {"factor", factor},
                                {"x", block.add(std::vector<float>(series.x.begin(), series.x.end()))},
                                {"y", block.add(std::vector<float>(series.y.begin(), series.y.end()))}});
  }
}

void add_view(const Animation& animation, Json& scene) {
  const render::Camera& camera = animation.views.empty() ? animation.camera : animation.views.front().camera;
  const glm::dvec3 up = glm::normalize(animation.ground ? animation.ground->normal : camera.up);
  const bool flat = camera.projection == render::Projection::orthographic;
  scene["camera"] = {{"position", vector(camera.position)},
                     {"target", vector(camera.target)},
                     {"up", vector(camera.up)},
                     {"fov", camera.fov},
                     {"height", flat ? camera.height : 0.0}};
  // Cameras belong to the part of the picture that plots leave.
  render::Picture picture;
  fill_overlay(animation, animation.results->times[0], picture);
  picture.size = animation.settings.size;
  const render::PixelRect area = render::make_layout(picture).scene;
  scene["shape"] = static_cast<double>(area.width) / std::max(area.height, 1);
  const render::Bounds& bounds = animation.bounds;
  const double radius = bounds.radius() > 0.0 ? bounds.radius() : 1.0;
  scene["centre"] = vector(bounds.empty() ? glm::dvec3(0.0) : bounds.centre());
  scene["radius"] = radius;
  scene["reach"] = 6.0 * radius;
  scene["low"] = vector(bounds.empty() ? glm::dvec3(-1.0) : bounds.lower);
  scene["high"] = vector(bounds.empty() ? glm::dvec3(1.0) : bounds.upper);
  scene["light"] = vector(glm::normalize(animation.light ? glm::dvec3(*animation.light) : render::default_light(camera, up)));
  if (animation.ground)
    scene["ground"] = {{"point", vector(animation.ground->point)},
                       {"normal", vector(up)},
                       {"spacing", render::grid_spacing(*animation.ground, bounds)},
                       {"reach", 4.0 * radius}};
}

void add_times(const Animation& animation, Json& scene) {
  const double first = picture_time(animation, 0);
  const int digits = std::clamp(static_cast<int>(std::ceil(-std::log10(std::max(animation.step, 1e-12)))) + 1, 0, 12);
  scene["times"] = {{"first", first}, {"step", animation.step}, {"count", animation.count}, {"digits", digits}};
  scene["speed"] = animation.settings.speed;
  const bool ghost = animation.scales.size() > 1;
  scene["scale"] = ghost ? animation.scales[1] : animation.scales[0];
  scene["ghost"] = ghost;
  scene["follow"] = animation.follow;
}

// The shares of an accuracy of pictures as one bar with its legend; a full bar is what is allowed.
std::string shares_html(const sim::PictureShares& p) {
  const std::pair<double, const char*> shares[] = {{p.time, "time integration"},    {p.space, "elements or modes"},
                                                   {p.effects, "effects left out"}, {p.map, "map to vertices"},
                                                   {p.samples, "samples"},          {p.raster, "raster"}};
  double sum = 0.0;
  for (const auto& [value, words] : shares) sum += value;
  const double full = std::max({p.allowed, sum, 1e-300});
  std::string bar, legend;
  int k = 0;
  for (const auto& [value, words] : shares) {
    const std::string distance = distance_words(value, p.unit);
    bar += fmt::format("<i class=\"share{}\" style=\"width:{:.2f}%\" title=\"{}: {}\"></i>", k, 100.0 * value / full, words, distance);
    if (value > 0.0) legend += fmt::format("<span><i class=\"share{}\"></i>{} {}</span> ", k, distance, words);
    ++k;
  }
  return fmt::format(
      "<dt>accuracy of the pictures</dt><dd>{} of {} allowed{}<div class=\"shares\">{}<b style=\"left:{:.2f}%\"></b></div>"
      "<div class=\"shares-legend\">{}</div></dd>\n",
      distance_words(p.total, p.unit), render::escape_html(p.asked),
      p.body.empty() ? "" : render::escape_html(fmt::format(", largest at '{}'", p.body)), bar, 100.0 * p.allowed / full, legend);
}

// What the run says of itself, as the program prints it.
std::string summary(const Animation& animation, const PageReport& report) {
  const sim::SolverStatistics& s = animation.results->statistics;
  std::string text = "<dl id=\"run\">\n";
  const auto add = [&](const char* name, const std::string& value, const char* kind = "") {
    text += fmt::format("<dt>{}</dt><dd{}>{}</dd>\n", name, *kind ? fmt::format(" class=\"{}\"", kind) : "", render::escape_html(value));
  };
  const sim::VecX& times = animation.results->times;
  add("duration", fmt::format("{:g} s, {} samples", times[times.size() - 1] - times[0], times.size()));
  if (!s.method.empty())
    add("simulation", fmt::format("{}, tolerance {:g}, {} steps, {:.3g} CPU s", s.method, s.tolerance, s.steps, s.cpu_seconds));
  if (s.accuracy && s.accuracy->picture) text += shares_html(*s.accuracy->picture);
  else if (s.accuracy)
    add("accuracy", fmt::format("{:g} asked: {:.1e} time integration, {:.1e} elements or modes, {:.1e} effects left out", s.accuracy->asked,
                                s.accuracy->time, s.accuracy->space, s.accuracy->effects));
  if (s.error_estimate >= 0.0 && !(s.accuracy && s.accuracy->picture))
    add("estimated error",
        s.error_estimate < 1e-13 ? "negligible" : fmt::format("{:.1e} of the range of {}", s.error_estimate, s.error_column));
  if (report.error > 0.0 || report.value_error > 0.0)
    add("this page", fmt::format("vertices within {:.2g} m of the pictures, colours within {:.2g} % of their range", report.error,
                                 100.0 * report.value_error));
  for (const std::string& warning : s.notes.texts(sim::Severity::warning)) add("warning", warning, "warning");
  for (const std::string& warning : animation.warnings) add("warning", warning, "warning");
  for (const std::string& note : s.notes.texts(sim::Severity::note)) add("note", note);
  for (const std::string& note : animation.notes) add("note", note);
  for (const std::string& note : report.notes) add("note", note);
  return text + "</dl>";
}

// A script's end inside a text would end the script that holds it.
std::string in_script(std::string text) {
  for (size_t at = text.find("</"); at != std::string::npos; at = text.find("</", at + 3)) text.replace(at, 2, "<\\/");
  for (size_t at = text.find("<!--"); at != std::string::npos; at = text.find("<!--", at + 5)) text.replace(at, 4, "<\\u0021--");
  return text;
}

// Replaces each @NAME@ of the page once, from left to right; what is put in is not searched again.
std::string fill(const std::string& page, const std::map<std::string, std::string>& words) {
  std::string out;
  size_t from = 0;
  for (size_t at = page.find('@'); at != std::string::npos; at = page.find('@', from)) {
    const size_t end = page.find('@', at + 1);
    const auto word = end == std::string::npos ? words.end() : words.find(page.substr(at + 1, end - at - 1));
    out += page.substr(from, at - from);
    if (word == words.end()) {
      out += '@';
      from = at + 1;
    } else {
      out += word->second;
      from = end + 1;
    }
  }
  return out + page.substr(from);
}

}  // namespace

std::string make_page(Animation& animation, const sim::Scene* source, std::span<const std::uint8_t> png, PageReport& report) {
  PageBlock block;
  Json scene, bodies = Json::array();
  add_times(animation, scene);
  add_view(animation, scene);
  const PageColors colors = find_page_colors(animation, source);
  scene["colours"] = colors_json(colors, block);
  scene["coloured"] = colors.own ? 0 : -1;
  for (const Json& c : scene["colours"]) report.colors.push_back(c["word"]);
  // What is said of stress alone.
  if (colors.stressed)
    for (const auto* said : {&colors.stressed->warnings, &colors.stressed->notes})
      for (const std::string& text : *said) {
        const bool known = std::count(animation.warnings.begin(), animation.warnings.end(), text) > 0 ||
                           std::count(animation.notes.begin(), animation.notes.end(), text) > 0;
        if (!known) report.notes.push_back("coloured by stress: " + text);
      }
  for (size_t b = 0; b < animation.bodies.size(); ++b) add_body(block, animation, colors, static_cast<int>(b), bodies, report);
  for (const JointSymbol& symbol : animation.symbols) add_symbol(block, animation, symbol, bodies, report);
  scene["bodies"] = std::move(bodies);
  add_lines(block, animation, scene);
  add_outputs(block, animation, scene);
  report.pictures = animation.count;

  const auto& texts = page_texts();
  const std::string title = animation.results->title.empty() ? "flexframe" : animation.results->title;
  const std::string picture =
      png.empty() ? "" : fmt::format("<img alt=\"A picture of the run\" src=\"data:image/png;base64,{}\">", render::base64(png));
  return fill(texts.at("page.html"), {{"TITLE", render::escape_html(title)},
                                      {"STYLE", render::house_colours() + texts.at("style.css")},
                                      {"PICTURE", picture},
                                      {"SUMMARY", summary(animation, report)},
                                      {"SCENE", in_script(scene.dump(-1, ' ', false, Json::error_handler_t::replace))},
                                      {"DATA", render::base64(render::compress(block.bytes, render::Container::gzip, 9))},
                                      {"SCRIPT", texts.at("data.js") + texts.at("draw.js") + texts.at("panel.js")}});
}

}  // namespace flexframe::film
