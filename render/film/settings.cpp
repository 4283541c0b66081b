#include "render/film/settings.h"

#include "render/film/body_model.h"
#include "render/picture/colormap.h"
#include "sim/base/words.h"
#include "sim/scene/toml_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace flexframe::film {
namespace {

using sim::InputError;
using sim::TableReader;
using sim::TomlValue;

constexpr double most_pictures = 1e6;
// A scale beyond this leaves single precision nothing of the body; stability is asked for up to 1e6.
constexpr double largest_scale = 1e9;

glm::dvec3 glm_of(const sim::Vec3& v) { return {v.x(), v.y(), v.z()}; }

std::vector<std::string> to_strings(const std::vector<std::string_view>& words) { return {words.begin(), words.end()}; }

CameraSettings read_camera(const TableReader& reader) {
  reader.allow({"position", "target", "up", "fov", "projection", "height", "fit", "direction", "follow", "views", "orbit", "path", "preset",
                "window"});
  CameraSettings camera;
  if (reader.has("position")) camera.position = glm_of(reader.vector3("position", "m"));
  if (reader.has("target")) camera.target = glm_of(reader.vector3("target", "m"));
  if (reader.has("direction")) camera.direction = glm_of(reader.direction("direction", sim::Vec3::UnitZ()));
  if (reader.has("up")) camera.up = glm_of(reader.direction("up", sim::Vec3::UnitY()));
  camera.fov = reader.number("fov", camera.fov, {.low = 1.0, .high = 170.0, .what = "an angle from 1 to 170 degrees", .unit = "deg"});
  const std::vector<std::string> projections = {"perspective", "orthographic"};
  camera.projection = static_cast<render::Projection>(reader.word("projection", projections, 0));
  camera.height = reader.number("height", camera.height, sim::positive.in("m"));
  camera.fit = reader.boolean("fit", !camera.position);
  static const std::vector<std::string> kinds = {"front", "side", "top", "iso"};
  if (reader.has("views"))
    for (const std::string& word : reader.texts("views")) {
      const auto found = std::find(kinds.begin(), kinds.end(), word);
      if (found == kinds.end())
        reader.fail("views",
                    fmt::format("holds {}{}; allowed: {}", sim::quote(word), sim::did_you_mean(word, kinds), sim::list_words(kinds)));
      camera.views.push_back(static_cast<render::ViewKind>(found - kinds.begin()));
    }
  if (camera.views.size() > 4) reader.fail("views", fmt::format("must be one to four views, found {}", camera.views.size()));
  camera.orbit =
      reader.number("orbit", 0.0, {.low = -36000.0, .high = 36000.0, .what = "an angle from -36000 to 36000 degrees", .unit = "deg"});
  for (const TableReader& key : reader.tables("path")) {
    key.allow({"t", "position", "target", "up", "fov", "height"});
    render::CameraKey at;
    at.t = key.number("t", sim::any_number.in("s"));
    at.camera.position = glm_of(key.vector3("position", "m"));
    at.camera.target = glm_of(key.vector3("target", sim::Vec3::Zero(), "m"));
    at.camera.up = glm_of(key.direction("up", camera.up ? sim::Vec3(camera.up->x, camera.up->y, camera.up->z) : sim::Vec3::UnitY()));
    at.camera.fov = key.number("fov", camera.fov, {.low = 1.0, .high = 170.0, .what = "an angle from 1 to 170 degrees", .unit = "deg"});
    at.camera.height = key.number("height", camera.height, sim::positive.in("m"));
    at.camera.projection = camera.projection;
    if (glm::length(at.camera.position - at.camera.target) == 0.0) key.fail("position", "must not be the same point as 'target'");
    if (!camera.path.empty() && !(at.t > camera.path.back().t))
      key.fail("t", fmt::format("must rise from key to key, found {:g} after {:g}", at.t, camera.path.back().t));
    camera.path.push_back(at);
  }
  if (!camera.path.empty() && (camera.position || camera.direction)) reader.fail("path", "excludes 'position' and 'direction'");
  if (!camera.views.empty() && (!camera.path.empty() || camera.position || camera.direction || camera.orbit != 0.0))
    reader.fail("views", "excludes 'path', 'position', 'direction' and 'orbit'");
  if (reader.has("preset")) {
    static const std::vector<std::string> presets = {"plane", "front", "side", "top", "iso"};
    camera.preset = presets[reader.word("preset", presets, 0)];
    if (camera.position || camera.direction || !camera.path.empty() || !camera.views.empty())
      reader.fail("preset", "excludes 'position', 'direction', 'path' and 'views'");
  }
  if (reader.has("window")) {
    const std::vector<double> window = reader.numbers("window", 2, 2, sim::any_number.in("s"));
    if (!(window[0] <= window[1])) reader.fail("window", fmt::format("must rise, found [{:g}, {:g}]", window[0], window[1]));
    if (!camera.fit || !camera.path.empty()) reader.fail("window", "is for a camera that is fitted to the motion");
    camera.window = {window[0], window[1]};
  }
  camera.follow = reader.text("follow", "");
  camera.follow_line = reader.line("follow");

  if (!camera.fit && !camera.position && camera.path.empty()) reader.fail("fit = false needs 'position' (and 'target')");
  if (camera.target && !camera.position) reader.fail("'target' needs 'position' beside it");
  if (camera.direction && (camera.position || !camera.fit)) reader.fail("'direction' is for fit = true without 'position'");
  if (camera.position) {
    const glm::dvec3 target = camera.target.value_or(glm::dvec3(0.0));
    if (glm::length(*camera.position - target) == 0.0) reader.fail("position", "must not be the same point as 'target'");
  }
  return camera;
}

OverlaySettings read_overlay(const TableReader& reader) {
  reader.allow({"title", "time", "scalar_bar", "triad", "legend", "note", "plot", "plot_place"});
  OverlaySettings overlay;
  overlay.title = reader.boolean("title", true);
  overlay.time = reader.boolean("time", true);
  overlay.scalar_bar = reader.boolean("scalar_bar", true);
  overlay.triad = reader.boolean("triad", true);
  overlay.legend = reader.boolean("legend", true);
  overlay.note = reader.boolean("note", true);
  overlay.plot = reader.has("plot") ? reader.texts("plot") : std::vector<std::string>{};
  overlay.plot_line = reader.line("plot");
  const std::vector<std::string> places = {"below", "beside"};
  overlay.plot_place = static_cast<render::PlotPlace>(reader.word("plot_place", places, 0));
  return overlay;
}

// Ends of the colours: two numbers, a word, or how they are found.
void read_color_range(const TableReader& reader, RenderSettings& settings) {
  const TomlValue* given = reader.find("color_range");
  if (!given) return;
  if (given->type == TomlValue::Type::text) {
    const std::vector<std::string> words = {"auto", "full"};
    if (reader.word("color_range", words, 0) == 1) settings.range.percentile = 100.0;
  } else if (const auto table = given->type == TomlValue::Type::table ? reader.table("color_range") : std::nullopt) {
    table->allow({"percentile", "window", "symmetric"});
    if (table->has("percentile"))
      settings.range.percentile =
          table->number("percentile", 98.0, {.low = 1.0, .high = 100.0, .what = "a share of the time from 1 to 100 per cent"});
    if (table->has("window")) {
      const std::vector<double> window = table->numbers("window", 2, 2, sim::any_number.in("s"));
      if (!(window[0] < window[1])) table->fail("window", fmt::format("must rise, found [{}, {}]", window[0], window[1]));
      settings.range.window = {window[0], window[1]};
    }
    settings.range.symmetric = table->boolean("symmetric", false);
  } else {
    const std::vector<double> range = reader.numbers("color_range", 2, 2);
    if (!(range[0] < range[1])) reader.fail("color_range", fmt::format("must rise, found [{}, {}]", range[0], range[1]));
    settings.color_range = {range[0], range[1]};
  }
}

// Colour map, its range and how it is drawn.
void read_colors(const TableReader& reader, RenderSettings& settings) {
  settings.color_by = static_cast<ColorBy>(reader.word("color_by", color_by_words(), static_cast<size_t>(settings.color_by)));
  settings.mode = reader.integer("mode", 1, 1, 100000);
  settings.stress = static_cast<StressMeasure>(reader.word("stress", stress_words(), 0));
  if (reader.has("yield_stress")) settings.yield_stress = reader.number("yield_stress", 0.0, sim::positive.in("Pa"));
  const std::vector<std::string> maps = to_strings(render::colormap_names());
  settings.colormap = static_cast<render::Colormap>(reader.word("colormap", maps, 0));
  read_color_range(reader, settings);
  const std::vector<std::string> color_scales = {"linear", "log"};
  settings.range.logarithmic = reader.word("color_scale", color_scales, 0) == 1;
  if (settings.range.logarithmic && settings.color_range && !(settings.color_range->first > 0.0))
    reader.fail("color_range",
                fmt::format("must be positive with color_scale = \"log\", found a lower end of {:g}", settings.color_range->first));
  if (settings.range.logarithmic && settings.range.symmetric)
    reader.fail("color_scale", "\"log\" excludes color_range = { symmetric = true }");
  if (settings.range.logarithmic && is_signed(settings))
    reader.fail("color_scale", "\"log\" has no place for the negative values of principal stresses; take stress = \"von_mises\"");
  settings.bands = reader.integer("bands", 0, 0, 64);
  settings.isolines = reader.integer("isolines", 0, 0, 64);
}

const sim::Range resolution{.low = 10.0, .high = 2400.0, .what = "a number from 10 to 2400"};

// Millimetres on paper to pixels. Words that would be smaller than 7 points there are enlarged.
void read_print_size(const TableReader& reader, RenderSettings& settings) {
  const std::vector<double> paper =
      reader.numbers("print_size", 2, 2, {.low = 1.0, .high = 5000.0, .what = "a length from 1 to 5000 mm", .unit = "mm"});
  settings.dpi = reader.number("dpi", 300.0, resolution);
  const auto pixels = [&](double mm) { return static_cast<int>(std::lround(mm / 25.4 * settings.dpi)); };
  settings.size = {pixels(paper[0]), pixels(paper[1])};
  if (std::min(settings.size.width, settings.size.height) < 16 || std::max(settings.size.width, settings.size.height) > 16384)
    reader.fail("print_size", fmt::format("[{:g}, {:g}] mm at {:g} dpi are {} x {} pixels; allowed: 16 to 16384 each", paper[0], paper[1],
                                          settings.dpi, settings.size.width, settings.size.height));
  const double usual = 12.5 * std::min(paper[1] / 720.0, paper[0] / 960.0), smallest = 7.0 * 25.4 / 72.0;  // mm
  settings.text_scale = static_cast<float>(std::clamp(smallest / usual, 1.0, 3.0));
}

// Distances and angles that are drawn with their values.
std::vector<DimensionSettings> read_dimensions(const TableReader& reader) {
  std::vector<DimensionSettings> out;
  for (const TableReader& table : reader.tables("dimensions")) {
    table.allow({"from", "to", "at", "along", "offset", "radius", "label"});
    DimensionSettings d;
    d.from = table.text("from");
    d.to = table.text("to");
    d.at = table.text("at", "");
    if (d.from == d.to || d.from == d.at || d.to == d.at)
      table.fail(d.from == d.to ? "to" : "at", "must be another frame than the other ends of the dimension");
    if (table.has("along")) {
      d.axis = static_cast<int>(table.word("along", std::vector<std::string>{"x", "y", "z"}));
      if (!d.at.empty()) table.fail("along", "is for distances; with 'at' an angle is measured");
    }
    if (table.has("offset")) d.offset = glm_of(table.vector3("offset", "m"));
    if (table.has("radius")) {
      d.radius = table.number("radius", 0.0, sim::positive.in("m"));
      if (d.at.empty()) table.fail("radius", "is for angles, which have 'at'");
    }
    d.label = table.text("label", "");
    d.line = table.line("from");
    out.push_back(std::move(d));
  }
  return out;
}

std::vector<InsetSettings> read_insets(const TableReader& reader) {
  static const std::vector<std::string> corners = {"upper left", "upper right", "lower left", "lower right"};
  std::vector<InsetSettings> out;
  for (const TableReader& table : reader.tables("insets")) {
    table.allow({"at", "zoom", "size", "corner", "label"});
    InsetSettings inset;
    inset.at = table.text("at");
    inset.drawing.zoom =
        table.number("zoom", inset.drawing.zoom, {.low = 1.0, .high = 1000.0, .open_low = true, .what = "a number above 1, at most 1000"});
    inset.drawing.size =
        table.number("size", inset.drawing.size, {.low = 0.1, .high = 0.6, .what = "a share of the height from 0.1 to 0.6"});
    inset.drawing.corner = static_cast<render::InsetCorner>(table.word("corner", corners, 3));
    inset.drawing.label = table.text("label", "");
    inset.line = table.line("at");
    out.push_back(std::move(inset));
  }
  if (out.size() > 4) reader.fail("insets", fmt::format("must be at most four, found {}", out.size()));
  return out;
}

// Which files are written beside the pictures.
void read_channels(const TableReader& reader, RenderSettings& settings) {
  static const std::vector<std::string> channels = {"depth", "scalar", "linear", "vector", "pdf"};
  bool* const wanted[] = {&settings.depth_channel, &settings.scalar_channel, &settings.linear_channel, &settings.vector_channel,
                          &settings.pdf_channel};
  if (!reader.has("channels")) return;
  for (const std::string& word : reader.texts("channels")) {
    const auto found = std::find(channels.begin(), channels.end(), word);
    if (found == channels.end())
      reader.fail("channels",
                  fmt::format("holds {}{}; allowed: {}", sim::quote(word), sim::did_you_mean(word, channels), sim::list_words(channels)));
    *wanted[found - channels.begin()] = true;
  }
}

RenderSettings read_table(const TableReader& reader) {
  reader.allow({"size",        "frame_rate",   "speed",          "samples",       "scales",     "exaggeration", "color_by",   "color_range",
                "colormap",    "trail",        "undeformed",     "scheme",        "background", "ground",       "joints",     "nodes",
                "forces",      "traces",       "triads",         "contact_sheet", "channels",   "video",        "mode",       "shadows",
                "occlusion",   "edges",        "silhouette",     "camera",        "overlay",    "look",         "bands",      "isolines",
                "color_scale", "probes",       "extremes",       "section",       "print_size", "dpi",          "dimensions", "insets",
                "stress",      "yield_stress", "level_of_detail"});
  RenderSettings settings;
  apply_look(static_cast<LookKind>(reader.word("look", look_words(), static_cast<size_t>(settings.look))), settings);

  // Size, pace and quality.
  if (reader.has("dpi")) settings.dpi = reader.number("dpi", 300.0, resolution);
  if (reader.has("print_size")) {
    read_print_size(reader, settings);
  } else if (reader.has("size")) {
    const std::vector<int> size = reader.integers("size", 16, 16384);
    if (size.size() != 2) reader.fail("size", fmt::format("must be [width, height] in pixels, found {} numbers", size.size()));
    settings.size = {size[0], size[1]};
  }
  settings.frame_rate = reader.number("frame_rate", settings.frame_rate,
                                      {.low = 0.0, .high = 10000.0, .open_low = true, .what = "a number > 0, at most 10000"});
  if (reader.has("speed")) settings.speed = reader.number("speed", 1.0, sim::positive);
  settings.samples = reader.integer("samples", settings.samples, 1, 16);
  if (settings.samples != 1 && settings.samples != 4 && settings.samples != 9 && settings.samples != 16)
    reader.fail("samples", fmt::format("must be 1, 4, 9 or 16, found {}", settings.samples));

  // Deformation.
  if (const TomlValue* scales = reader.find("scales")) {
    if (scales->type == TomlValue::Type::text) {
      if (scales->text != "auto")
        reader.fail("scales", fmt::format("must be a list of numbers or \"auto\", found {}", sim::describe(*scales)));
    } else {
      settings.scales = reader.numbers("scales", 1, 8, {.low = 0.0, .high = largest_scale, .what = "a number from 0 to 1e9"});
      for (size_t i = 0; i < settings.scales.size(); ++i)
        if (std::count(settings.scales.begin(), settings.scales.end(), settings.scales[i]) > 1)
          reader.fail("scales", fmt::format("holds {} twice", settings.scales[i]));
    }
  }
  const std::vector<std::string> exaggerations = {"linear", "corotated"};
  using Type = sim::TomlValue::Type;
  // What one writes to see deformations ten times as large.
  if (const sim::TomlValue* given = reader.find("exaggeration"); given && (given->type == Type::integer || given->type == Type::real))
    reader.fail("exaggeration", fmt::format("must be \"linear\" or \"corotated\", the way to enlarge deformations, found {}; how much is "
                                            "key 'scales', such as scales = [1, 10]",
                                            sim::describe(*given)));
  settings.corotated = reader.word("exaggeration", exaggerations, 0) == 1;
  const std::vector<std::string> schemes = {"auto", "kernel", "elastic", "lattice", "r3", "r", "tps"};
  settings.scheme = interp::scheme_from_name(schemes[reader.word("scheme", schemes, 0)]);

  read_colors(reader, settings);
  const std::vector<std::string> backgrounds = {"gradient", "white", "dark", "transparent"};
  settings.background = static_cast<BackgroundKind>(reader.word("background", backgrounds, static_cast<size_t>(settings.background)));

  // What else is drawn.
  settings.trail = reader.integer("trail", 0, 0, 100);
  settings.undeformed = reader.boolean("undeformed", false);
  settings.ground = reader.boolean("ground", settings.ground);
  settings.joints = reader.boolean("joints", settings.joints);
  settings.nodes = reader.boolean("nodes", settings.nodes);
  settings.forces = reader.boolean("forces", settings.forces);
  if (reader.has("traces")) settings.traces = reader.texts("traces");
  if (reader.has("triads")) settings.triads = reader.texts("triads");
  if (reader.has("probes")) settings.probes = reader.texts("probes");
  settings.probes_line = reader.line("probes");
  settings.extremes = reader.boolean("extremes", false);
  settings.dimensions = read_dimensions(reader);
  settings.insets = read_insets(reader);
  if (const auto section = reader.table("section")) {
    section->allow({"point", "normal", "bodies"});
    settings.section.emplace();
    if (section->has("point")) settings.section->point = glm_of(section->vector3("point", "m"));
    settings.section->normal = glm_of(section->direction("normal", sim::Vec3::UnitZ()));
    if (section->has("bodies")) settings.section->bodies = section->texts("bodies");
    settings.section->line = section->line("bodies");
  }
  settings.traces_line = reader.line("traces");
  settings.triads_line = reader.line("triads");

  // What is written besides the pictures.
  settings.contact_sheet = reader.integer("contact_sheet", 0, 0, 100);
  read_channels(reader, settings);
  const std::vector<std::string> videos = {"mp4", "gif", "apng", "none"};
  settings.video = videos[reader.word("video", videos, 0)];
  settings.shadows = reader.boolean("shadows", settings.shadows);
  settings.occlusion = reader.boolean("occlusion", settings.occlusion);
  if (const TomlValue* edges = reader.find("edges"); edges && edges->type == TomlValue::Type::text) {
    reader.word("edges", std::vector<std::string>{"creases"});
    settings.edges = EdgeLines::creases;
  } else if (edges) {
    settings.edges = reader.boolean("edges", false) ? EdgeLines::mesh : EdgeLines::none;
  }
  settings.silhouette = reader.boolean("silhouette", settings.silhouette);
  settings.level_of_detail = reader.boolean("level_of_detail", settings.level_of_detail);
  if (const auto camera = reader.table("camera")) settings.camera = read_camera(*camera);
  if (const auto overlay = reader.table("overlay")) settings.overlay = read_overlay(*overlay);
  return settings;
}

// "did you mean" and the list of what there is.
[[noreturn]] void refuse(const std::string& file, int line, const char* key, const std::string& word, const char* what,
                         const std::vector<std::string>& known) {
  const std::string name = line > 0 ? fmt::format("{}:{}", file, line) : file;
  throw InputError(fmt::format("{}: [render]: key '{}' names {}, which is no {}{}; there is: {}", name, key, sim::quote(word), what,
                               sim::did_you_mean(word, known), known.empty() ? "none" : sim::list_words(known)));
}

void check_count(const RenderSettings& settings, double duration, const std::string& name) {
  const double speed = playback_speed(settings, duration), count = duration * settings.frame_rate / speed;
  if (count > most_pictures)
    throw InputError(
        fmt::format("{}: [render]: {:g} s at frame_rate {:g} and speed {:g} are {:.3g} pictures; at most {:g} are allowed: lower "
                    "'frame_rate' or raise 'speed'",
                    name, duration, settings.frame_rate, speed, count, most_pictures));
}

void check_section(const RenderSettings& settings, const std::vector<std::string>& bodies, const std::string& name) {
  if (!settings.section) return;
  for (const std::string& body : settings.section->bodies)
    if (std::find(bodies.begin(), bodies.end(), body) == bodies.end())
      refuse(name, settings.section->line, "section.bodies", body, "body", bodies);
}

void check_follow(const RenderSettings& settings, const std::vector<std::string>& bodies, const std::string& name) {
  const std::string& follow = settings.camera.follow;
  if (!follow.empty() && std::find(bodies.begin(), bodies.end(), follow) == bodies.end())
    refuse(name, settings.camera.follow_line, "camera.follow", follow, "body", bodies);
}

double parse_number(std::string_view text, const char* what, const std::string& whole) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    throw InputError(fmt::format("{} {}: {} is no number", what, sim::quote(whole), sim::quote(text)));
  return value;
}

}  // namespace

bool names_column(const std::string& word, const std::string& column) { return column == word || column.starts_with(word + "."); }

double playback_speed(const RenderSettings& settings, double duration) {
  if (settings.speed > 0.0) return settings.speed;
  if (!(duration > 0.0) || (duration >= 2.0 && duration <= 600.0)) return 1.0;
  // Two seconds of playback are the least that can be followed; very short and very long runs get six.
  const double longest = duration / (duration >= 0.1 && duration < 2.0 ? 2.0 : 6.0);
  const double power = std::pow(10.0, std::floor(std::log10(longest) + 1e-9));  // a rounded 0.1 counts as 0.1
  for (const double step : {5.0, 2.0})
    if (step * power <= longest * (1.0 + 1e-9)) return step * power;
  return power;
}

bool is_signed(const RenderSettings& settings) {
  return settings.color_by == ColorBy::stress &&
         (settings.stress == StressMeasure::max_principal || settings.stress == StressMeasure::min_principal);
}

const std::vector<std::string>& color_by_words() {
  static const std::vector<std::string> words = {"none", "displacement", "strain", "velocity", "body", "stress", "mode", "map_error"};
  return words;
}

const std::vector<std::string>& stress_words() {
  static const std::vector<std::string> words = {"von_mises", "tresca", "max_principal", "min_principal"};
  return words;
}

const std::vector<std::string>& look_words() {
  static const std::vector<std::string> words = {"plain", "technical", "presentation", "print"};
  return words;
}

void apply_look(LookKind look, RenderSettings& settings) {
  settings.look = look;
  settings.studio = look != LookKind::plain;
  settings.grid = look != LookKind::presentation;
  settings.edges = look == LookKind::plain ? EdgeLines::none : EdgeLines::creases;
  settings.silhouette = look == LookKind::print;
  settings.ground = look != LookKind::print;
  settings.shadows = look != LookKind::print;
  settings.occlusion = true;
  settings.background = look == LookKind::print ? BackgroundKind::white : BackgroundKind::gradient;
}

RenderSettings parse_render_settings(std::string_view text, const std::string& name) {
  // Results of another simulator carry no scene.
  if (text.empty()) return {};
  return read_render_settings(sim::parse_document(text, name));
}

RenderSettings read_render_settings(const sim::SceneDocument& document) {
  TableReader root(document.root, document.file.string(), "");
  root.set_parameters(document.parameters);
  auto table = root.table("render");
  if (!table) return {};
  table->set_label("[render]");
  return read_table(*table);
}

RenderSettings read_render_settings(const std::filesystem::path& file) { return read_render_settings(sim::read_document(file)); }

void check_render_settings(const RenderSettings& settings, const sim::Scene& scene) {
  const std::string name = scene.file.string();
  check_count(settings, scene.simulation.duration, name);
  std::vector<std::string> bodies;
  for (const sim::BodyDef& body : scene.bodies) bodies.push_back(body.name);
  check_follow(settings, bodies, name);
  check_section(settings, bodies, name);
  for (const sim::BodyDef& body : scene.bodies) read_body_look(body, name);

  // A column is an output's name, or that and a component; which components there are is known with the results.
  std::vector<std::string> outputs;
  for (const sim::OutputDef& output : scene.outputs) outputs.push_back(output.name);
  for (const std::string& column : settings.overlay.plot) {
    const std::string stem = column.substr(0, column.rfind('.'));
    const auto known = [&](const std::string& word) { return std::find(outputs.begin(), outputs.end(), word) != outputs.end(); };
    if (!known(column) && !known(stem))
      refuse(name, settings.overlay.plot_line, "overlay.plot", column, "column of an [[output]]", outputs);
  }
}

void check_render_settings(const RenderSettings& settings, const sim::Results& results, const std::string& name) {
  if (results.times.size() > 0) check_count(settings, results.times[results.times.size() - 1] - results.times[0], name);
  std::vector<std::string> bodies, columns;
  for (const sim::ResultBody& body : results.bodies) bodies.push_back(body.name);
  for (const sim::ResultOutput& output : results.outputs) columns.push_back(output.column);
  check_follow(settings, bodies, name);
  check_section(settings, bodies, name);
  for (const std::string& column : settings.overlay.plot)
    if (std::none_of(columns.begin(), columns.end(), [&](const std::string& c) { return names_column(column, c); }))
      refuse(name, settings.overlay.plot_line, "overlay.plot", column, "column of the history", columns);
}

render::Size parse_size(const std::string& text) {
  const size_t cross = text.find_first_of("xX");
  if (cross == std::string::npos) throw InputError(fmt::format("size {} must be WIDTHxHEIGHT, for example 1280x720", sim::quote(text)));
  const std::string_view all = text;
  const double width = parse_number(all.substr(0, cross), "size", text), height = parse_number(all.substr(cross + 1), "size", text);
  for (double side : {width, height})
    if (side < 16.0 || side > 16384.0 || side != std::floor(side))
      throw InputError(fmt::format("size {}: {:g} must be a whole number of pixels from 16 to 16384", sim::quote(text), side));
  return {static_cast<int>(width), static_cast<int>(height)};
}

std::vector<double> parse_scales(const std::string& text) {
  if (text == "auto") return {};
  std::vector<double> scales;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    const double scale = parse_number(std::string_view(text).substr(begin, end - begin), "scales", text);
    if (scale < 0.0 || scale > largest_scale)
      throw InputError(fmt::format("scales {}: {:g} must be from 0 to 1e9", sim::quote(text), scale));
    if (std::find(scales.begin(), scales.end(), scale) != scales.end())
      throw InputError(fmt::format("scales {}: {:g} is given twice", sim::quote(text), scale));
    scales.push_back(scale);
    begin = end + 1;
  }
  return scales;
}

}  // namespace flexframe::film
