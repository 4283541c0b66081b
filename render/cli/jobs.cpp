#include "render/cli/jobs.h"

#include "render/cli/cache.h"

#include "render/cli/engine.h"
#include "render/cli/terminal.h"

#include "render/draw/context.h"
#include "render/film/picture_accuracy.h"
#include "render/film/rigid_mesh.h"
#include "render/picture/mesh.h"
#include "sim/base/file_output.h"
#include "sim/base/files_read.h"
#include "sim/base/words.h"
#include "sim/scene/fingerprint.h"
#include "sim/scene/picture_accuracy.h"
#include "sim/scene/scene_reader.h"

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <thread>

#include <unistd.h>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;

// "A:B" or "I/N": two whole numbers; either may be missing where `open`.
std::pair<std::optional<int>, std::optional<int>> parse_pair(const std::string& text, char between, const char* option, const char* form,
                                                             bool open) {
  const auto refuse = [&] { throw UsageError(fmt::format("{} {} must be {}", option, sim::quote(text), form)); };
  const size_t at = text.find(between);
  if (at == std::string::npos) refuse();
  const auto number = [&](std::string_view part) -> std::optional<int> {
    if (part.empty() && open) return std::nullopt;
    int value = 0;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    if (error != std::errc() || end != part.data() + part.size() || value < 0) refuse();
    return value;
  };
  const std::string_view all = text;
  return {number(all.substr(0, at)), number(all.substr(at + 1))};
}

}  // namespace

sim::Method method_from_name(const std::string& name) {
  const std::vector<std::string>& known = sim::method_words();
  if (const auto found = std::find(known.begin(), known.end(), name); found != known.end())
    return static_cast<sim::Method>(found - known.begin());
  throw UsageError(
      fmt::format("--method {} is unknown{}; allowed: {}", sim::quote(name), sim::did_you_mean(name, known), sim::list_words(known)));
}

AskedAccuracy asked_accuracy(const SimulationWords& words) {
  AskedAccuracy out;
  if (words.accuracy.empty()) return out;
  try {
    out.pictures = sim::parse_picture_accuracy(words.accuracy);
    if (!out.pictures) out.share = sim::parse_share_of_ranges(words.accuracy);
  } catch (const sim::InputError& error) {
    throw UsageError(fmt::format("--accuracy {}", error.what()));
  }
  return out;
}

bool asks_accuracy(const sim::Scene& scene, const SimulationWords& words) {
  const bool in_scene = scene.simulation.accuracy || scene.simulation.picture_accuracy;
  return !words.tolerance && (!words.accuracy.empty() || in_scene);
}

void add_simulation_words(Subcommand words, SimulationWords& values) {
  words.option("--tolerance", values.tolerance, "relative local error, in place of the scene's").range(1e-13, 1e-1);
  words
      .option("--accuracy", values.accuracy,
              "requested error: of the outputs relative to their ranges (1e-3), or of the pictures' vertices as a distance (\"0.5 px\", "
              "\"0.1 mm\"): the program chooses tolerance, modes or elements, and effects")
      .as("N|DISTANCE")
      .excludes("--tolerance");
  words.option("--method", values.method, "auto, adams, bdf, erk, dirk, ida or exponential, in place of the scene's").as("WORD");
  words
      .option("--max-steps", values.max_steps,
              "limit of steps: a run that needs more ends with the reason, in place of the scene's; default 5e6")
      .range(1.0, 1e12);
  words.flag("--no-error-estimate", values.no_estimate, "no error estimate: saves the second run, at another tolerance");
  words.flag("--no-effect-check", values.no_check, "no check of effects that are switched off: saves about a third of the CPU time");
  words.flag("--strict", values.strict, "warnings are errors: exit code 1, no files");
}

namespace {

// Keys of [render] as options: what is given takes the place of the scene's word, read and refused as that is.
void add_view_words(Subcommand words, RenderWords& values) {
  words.option("--view", values.view, "front, side, top or iso; several in one picture as front,top")
      .as("LIST")
      .list([](const std::string& item) { return item == "front" || item == "side" || item == "top" || item == "iso"; });
  words.option("--camera", values.camera, "place of the camera, m; with --target, instead of fitting the motion")
      .as("X,Y,Z")
      .list(Option::is_number);
  words.option("--target", values.target, "where the camera looks, m").as("X,Y,Z").list(Option::is_number);
  words.option("--fov", values.fov, "vertical angle of view in degrees").as("N");
  words.option("--projection", values.projection, "perspective or orthographic").as("WORD");
  words.option("--background", values.background, "gradient, white, dark or transparent").as("WORD");
  words.option("--colormap", values.colormap, "viridis, cividis, inferno, turbo, coolwarm or greys").as("WORD");
  words.option("--color-range", values.color_range, "values of the map's ends in m, 1, Pa or m/s").as("LOW,HIGH").list(Option::is_number);
  words.option("--frame-rate", values.frame_rate, "pictures per second of playback").as("N");
  words
      .option("--print-size", values.print_size, "millimetres on paper, width x height, in place of --size; words become at least 7 points")
      .as("WxH")
      .excludes("--size");
  words.option("--dpi", values.dpi, "pixels an inch on paper, which the pictures say; 300 with --print-size").as("N");
  words.option("--speed", values.speed, "simulated seconds per second of playback").as("N");
}

}  // namespace

std::vector<std::string> render_settings(const RenderWords& words) {
  std::vector<std::string> out;
  const auto number = [&](const char* key, const std::string& value) {
    if (!value.empty()) out.push_back(fmt::format("render.{}={}", key, value));
  };
  const auto word = [&](const char* key, const std::string& value) {
    if (!value.empty()) out.push_back(fmt::format("render.{}=\"{}\"", key, value));
  };
  const auto list = [&](const char* key, const std::string& value) {
    if (!value.empty()) out.push_back(fmt::format("render.{}=[{}]", key, value));
  };
  if (!words.view.empty()) {
    std::string views;
    for (size_t at = 0; at <= words.view.size();) {
      const size_t comma = std::min(words.view.find(',', at), words.view.size());
      views += fmt::format("{}\"{}\"", views.empty() ? "" : ", ", words.view.substr(at, comma - at));
      at = comma + 1;
    }
    out.push_back(fmt::format("render.camera.views=[{}]", views));
  }
  list("camera.position", words.camera);
  list("camera.target", words.target);
  number("camera.fov", words.fov);
  word("camera.projection", words.projection);
  word("background", words.background);
  word("colormap", words.colormap);
  list("color_range", words.color_range);
  number("frame_rate", words.frame_rate);
  number("speed", words.speed);
  if (const size_t x = words.print_size.find('x'); !words.print_size.empty())
    out.push_back(fmt::format("render.print_size=[{}]", x == std::string::npos
                                                            ? words.print_size
                                                            : words.print_size.substr(0, x) + "," + words.print_size.substr(x + 1)));
  number("dpi", words.dpi);
  return out;
}

std::string color_by_help() {
  std::vector<std::string> words = film::color_by_words();
  const std::string last = words.back();
  words.pop_back();
  return fmt::format("{} or {}", fmt::join(words, ", "), last);
}

void add_render_words(Subcommand words, RenderWords& values) {
  words.option("--frames", values.frames, "pictures A to B-1 (as a slice; A: and :B too)").as("A:B");
  words.option("--shard", values.shard, "every N-th picture from the I-th on: N machines draw a sequence together").as("I/N");
  words.flag("--resume", values.resume, "keep complete pictures that were made from the same inputs");
  words.option("--size", values.size, "pixels, width x height").as("WxH");
  words.option("--scales", values.scales, "auto, or a list as 1,20: in scale and exaggerated").as("LIST").list([](const std::string& item) {
    return item == "auto" || Option::is_number(item);
  });
  words.option("--color-by", values.color_by, color_by_help()).as("WORD");
  words.option("--look", values.look, "plain, technical, presentation or print, with all that it stands for, in place of the scene's words")
      .as("WORD");
  add_view_words(words, values);
  words.option("--samples", values.samples, "antialiasing samples per pixel: 1, 4, 9 or 16").one_of({1, 4, 9, 16});
  words.flag("--no-shadows", values.no_shadows, "no shadows and no ambient occlusion: faster");
  words.flag("--vector", values.vector, "each picture as vector/frame_00000.svg too: words, bars, plots as elements over the pixels");
  words.flag("--pdf", values.pdf, "each picture as pdf/frame_00000.pdf too, as --vector, for LaTeX and others that take PDF");
  words.flag("--no-overlay", values.no_overlay, "no text, colour bars and plots");
  words.option("--cache", values.cache, cache_help).as("DIR").environment("FLEXFRAME_CACHE");
  words.option("--workers", values.workers, "number of drawing processes; default: one per core").range(1, 1024);
  words.option("--renderer", values.renderer, "osmesa or egl").as("WORD").one_of({"osmesa", "egl"}).show_default();
  words
      .option("--video", values.video,
              "the video's file (.mp4, .gif, or .apng and .png for an animated PNG); default: NAME.mp4 beside the pictures")
      .as("FILE");
  words.flag("--no-video", values.no_video, "pictures only");
}

void add_scene_words(Subcommand words, std::vector<std::string>& settings) {
  words
      .option(
          "--set", settings,
          "a parameter or key of the scene in place of its own, as often as wanted: L=0.4, body.rod.elements=12, simulation.tolerance=1e-8")
      .as("KEY=VALUE")
      .one_word();
}

namespace {

// How far a body reaches by what the scene says of it: a beam's length, the way between what holds a rigid body; 0: unknown.
double reach_of(const sim::Scene& scene, const sim::BodyDef& body) {
  if (const auto* beam = std::get_if<sim::BeamDef>(&body.kind)) return beam->length;
  const auto* rigid = std::get_if<sim::RigidDef>(&body.kind);
  if (!rigid) return 0.0;
  render::Bounds bounds;
  for (const film::HoldingPlace& place : film::holding_places(scene, body)) bounds.add(place.at);
  for (const auto& [name, at] : rigid->frames) bounds.add({at.x(), at.y(), at.z()});
  return bounds.empty() ? 0.0 : glm::length(bounds.upper - bounds.lower);
}

// A mesh in millimetres on a body in metres is a file without its unit.
void check_mesh_size(const sim::Scene& scene, const sim::BodyDef& body, const render::Mesh& mesh) {
  const double reach = reach_of(scene, body);
  const render::Bounds bounds = render::compute_bounds(mesh);
  const double size = body.mesh_placement.scale * glm::length(bounds.upper - bounds.lower);
  if (!(reach > 0.0) || !(size > 0.0) || (size < 100.0 * reach && reach < 100.0 * size)) return;
  fmt::print(stderr,
             "WARNING: {}:{}: [[body]] '{}': its mesh spans {:.3g} m, the body itself {:.3g} m; if the file has another unit, write mesh = "
             "{{ file = "
             "{}, unit = \"mm\" }}\n",
             scene.file.string(), body.line, body.name, size, reach, sim::quote(body.mesh->filename().string()));
}

}  // namespace

Job read_job(const fs::path& scene_file, const std::vector<std::string>& settings, const RenderWords* words) {
  Job job;
  std::vector<std::string> all = settings;
  if (words)
    for (std::string& setting : render_settings(*words)) all.push_back(std::move(setting));
  const sim::SceneDocument document = sim::read_document(scene_file, all);
  job.scene = sim::make_scene(document);
  job.settings = film::read_render_settings(document);
  film::check_render_settings(job.settings, job.scene);
  for (const sim::BodyDef& body : job.scene.bodies)
    if (body.mesh) {
      sim::note_file_read(*body.mesh);
      const render::Mesh mesh = render::read_mesh(*body.mesh);
      check_mesh_size(job.scene, body, mesh);
      for (const auto* texts : {&mesh.warnings, &mesh.faults})
        for (const std::string& text : *texts) job.mesh_notes.push_back(fmt::format("{}: {}", body.name, text));
    }
  return job;
}

void apply_words(const RenderWords& words, film::RenderSettings& settings) {
  if (!words.size.empty()) {
    settings.size = film::parse_size(words.size);
    settings.text_scale = 1.0f;
    if (words.dpi.empty()) settings.dpi = 0.0;
  }
  if (!words.scales.empty()) settings.scales = film::parse_scales(words.scales);
  if (!words.video.empty() && !film::is_video_name(words.video))
    throw UsageError(
        fmt::format("--video {}: a video's name must end in {}", sim::quote(words.video), sim::list_words(film::video_endings())));
  if (!words.look.empty()) {
    const std::vector<std::string>& known = film::look_words();
    const auto found = std::find(known.begin(), known.end(), words.look);
    if (found == known.end())
      throw UsageError(fmt::format("--look {} is unknown{}; allowed: {}", sim::quote(words.look), sim::did_you_mean(words.look, known),
                                   sim::list_words(known)));
    // A background that was asked for beside the look stays.
    const film::BackgroundKind background = settings.background;
    film::apply_look(static_cast<film::LookKind>(found - known.begin()), settings);
    if (!words.background.empty()) settings.background = background;
  }
  if (words.vector) settings.vector_channel = true;
  if (words.pdf) settings.pdf_channel = true;
  if (words.samples) settings.samples = *words.samples;
  settings.cache = cache_folder(words.cache);
  if (words.no_shadows) settings.shadows = settings.occlusion = false;
  if (words.no_overlay)
    settings.overlay = {.title = false,
                        .time = false,
                        .scalar_bar = false,
                        .triad = false,
                        .legend = false,
                        .note = false,
                        .words = false,
                        .plot = {},
                        .plot_line = 0};
  if (!words.color_by.empty()) {
    const std::vector<std::string>& known = film::color_by_words();
    const auto found = std::find(known.begin(), known.end(), words.color_by);
    if (found == known.end())
      throw UsageError(fmt::format("--color-by {} is unknown{}; allowed: {}", sim::quote(words.color_by),
                                   sim::did_you_mean(words.color_by, known), sim::list_words(known)));
    settings.color_by = static_cast<film::ColorBy>(found - known.begin());
  }
}

void add_fresh_word(Subcommand words, SimulationWords& values) {
  words.flag("--fresh", values.fresh,
             "search anew for an asked accuracy's settings, which are kept beside the results (NAME.settings.toml)");
}

sim::SettingsMemory settings_memory(const fs::path& scene_file, const std::vector<std::string>& settings, const SimulationWords& words,
                                    const fs::path& file) {
  const std::string options = fmt::format("{} {} {} {}", words.accuracy, words.method, words.no_check, words.max_steps.value_or(0.0));
  // --strict leaves no files.
  if (words.strict) return {};
  const std::string inputs = sim::inputs_fingerprint(sim::read_document(scene_file, settings));
  return {file, sim::sha256(fmt::format("{}\n{}\n{}", program_fingerprint(), inputs, options)), words.fresh};
}

sim::Results run_simulation(const Job& job, const SimulationWords& words, const sim::SettingsMemory* memory) {
  const AskedAccuracy asked = asked_accuracy(words);
  sim::Scene scene = job.scene;
  if (asked.pictures) scene.simulation.picture_accuracy = asked.pictures;
  else if (asked.share || words.tolerance) scene.simulation.picture_accuracy.reset();
  sim::SimulateOptions options;
  options.tolerance = words.tolerance;
  options.accuracy = asked.share;
  if (!words.method.empty()) options.method = method_from_name(words.method);
  options.estimate_error = !words.no_estimate;
  options.max_steps = words.max_steps;
  options.check_effects = !words.no_check;
  if (words.strict && (words.no_check || words.no_estimate))
    throw UsageError("--strict needs the error estimate and the check of effects: it excludes --no-effect-check and --no-error-estimate");
  Progress progress("simulating");
  LongStart start("simulating: at its bodies, start and first steps");
  options.progress = [&](double time) {
    start.over();
    progress.show(time / scene.simulation.duration);
  };
  options.tell = [&](const std::string& sentence) { progress.say(sentence); };
  sim::Results results = scene.simulation.picture_accuracy ? film::simulate_for_pictures(scene, job.settings, options, memory)
                                                           : sim::simulate_as_asked(scene, options, memory);
  if (words.strict && results.statistics.notes.has(sim::Severity::warning))
    throw std::runtime_error(
        fmt::format("{}: {}", scene.file.string(), fmt::join(results.statistics.notes.texts(sim::Severity::warning), "; ")));
  return results;
}

DrawingReport run_drawing(const sim::Results& results, const film::RenderSettings& settings, const sim::Scene* scene,
                          const RenderWords& words, const fs::path& folder, const std::string& name) {
  film::FilmOptions options;
  if (!words.frames.empty()) {
    const auto [first, end] = parse_pair(words.frames, ':', "--frames", "A:B with whole numbers, pictures A to B-1", true);
    options.first = first.value_or(0);
    options.end = end.value_or(-1);
  }
  if (!words.shard.empty()) {
    const auto [shard, shards] = parse_pair(words.shard, '/', "--shard", "I/N with whole numbers, 1 <= I <= N", false);
    options.shard = *shard;
    options.shards = *shards;
  }
  options.backend = render::backend_from_name(words.renderer);
  const film::Animation animation = [&] {
    // The drawing library is opened meanwhile; the thread is gone before the workers are forked.
    const std::jthread opening([&] {
      if (options.backend == render::Backend::osmesa) render::open_osmesa();
    });
    return film::make_animation(results, settings, scene);
  }();

  DrawingReport report;
  report.frames = folder / "frames";
  report.size = settings.size;
  report.cpu_setup = animation.cpu_setup;
  report.notes = animation.notes;
  report.warnings = animation.warnings;
  options.folder = report.frames;
  options.resume = words.resume;
  options.workers = words.workers;

  // The video of the whole range, while the pictures come; a shard alone has gaps.
  std::optional<film::VideoWriter> video;
  if (options.shards == 1)
    for (const std::string& ending : film::video_endings()) film::remove_unfinished_video(folder / (name + ending));
  if (options.shards == 1 && !words.no_video && (settings.video != "none" || !words.video.empty())) {
    report.video_file = words.video.empty() ? folder / (name + "." + settings.video) : fs::path(words.video);
    make_folder(fs::absolute(report.video_file).parent_path());
    video.emplace(report.video_file, settings.frame_rate);
    options.finished = [&](const fs::path& picture) { video->add(picture); };
  }
  {
    Progress progress("drawing");
    options.progress = [&](int done, int all) { progress.show(double(done) / all); };
    report.film = film::film(animation, options);
  }

  if (options.shards == 1 && settings.contact_sheet > 0) {
    render::Renderer renderer(options.backend);
    film::write_contact_sheet(animation, {options.first, report.film.pictures, settings.contact_sheet}, renderer,
                              folder / (name + "_sheet.png"));
  }
  if (video) report.video = video->finish(throw_if_interrupted);
  return report;
}

void require_writable(const fs::path& path) {
  // Only making the folder shows whether it can be made; what was made for the trial goes again, so that a run that fails leaves nothing.
  const fs::path wanted = fs::absolute(path).lexically_normal();
  std::error_code error;
  fs::path made = wanted;
  while (!fs::exists(made.parent_path(), error) && made.has_relative_path()) made = made.parent_path();
  const bool fresh = !fs::exists(wanted, error);
  make_folder(wanted.has_filename() ? wanted : wanted.parent_path());
  const bool writable = ::access(wanted.c_str(), W_OK | X_OK) == 0;
  const int why = errno;
  if (fresh)
    for (fs::path at = wanted; at != made.parent_path() && fs::remove(at, error); at = at.parent_path()) {}
  if (!writable) throw std::runtime_error(fmt::format("{}: cannot write there: {}", path.string(), std::strerror(why)));
}

void require_writable_file(const fs::path& file) {
  const sim::OutputFile output = sim::output_file(file);
  if (output.descriptor == STDOUT_FILENO) silence_stdout();
  if (!output.stream) require_writable(fs::absolute(file).parent_path());
}

void make_folder(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error) throw std::runtime_error(fmt::format("{}: cannot create the folder: {}", path.string(), error.message()));
}

// Estimates below this are sums of rounding, about a thousand of them: no number to state.
constexpr double rounding = 1e-13;

// All that is said where little is wanted.
void print_warnings(const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) fmt::print(stderr, "WARNING      {}\n", warning);
}

namespace {

void print_shares(const sim::PictureShares& p, double half_cost) {
  constexpr int width = 40;
  fmt::print("error        {} of {} allowed{}, estimated; halving it would cost about {:.1f} times the CPU time\n",
             film::distance_words(p.total, p.unit), film::distance_words(p.allowed, p.unit),
             p.body.empty() ? "" : fmt::format(", largest at '{}'", p.body), half_cost);
  fmt::print("shares       {} {}\n", film::shares_bar(p, width), fmt::join(film::shares_words(p), ", "));
}

nlohmann::ordered_json shares_json(const sim::PictureShares& p) {
  return {{"asked", p.asked},     {"unit", p.unit}, {"allowed", p.allowed}, {"total", p.total},   {"time", p.time}, {"space", p.space},
          {"effects", p.effects}, {"map", p.map},   {"samples", p.samples}, {"raster", p.raster}, {"body", p.body}, {"doubt", p.doubt}};
}

}  // namespace

void print_simulation(const sim::Results& results) {
  const sim::SolverStatistics& s = results.statistics;
  if (verbosity() == Verbosity::quiet) return print_warnings(s.notes.texts(sim::Severity::warning));
  const double duration = results.times.size() > 0 ? results.times[results.times.size() - 1] : 0.0;
  fmt::print("simulation   {:g} s in {:.4f} CPU s: {}, tolerance {:g}, {} steps, {} evaluations, {} events, {} samples\n", duration,
             s.cpu_seconds, s.method, s.tolerance, s.steps, s.evaluations, s.events, results.times.size());
  if (verbosity() == Verbosity::verbose && s.steps > 0)
    fmt::print("solver       {} Jacobians, {} restarts, {:.2f} evaluations and {:.2e} s a step, {:.2f} us an evaluation\n", s.jacobians,
               s.restarts, static_cast<double>(s.evaluations) / static_cast<double>(s.steps), duration / static_cast<double>(s.steps),
               1e6 * s.cpu_seconds / static_cast<double>(std::max(1L, s.evaluations)));
  if (s.accuracy) {
    const sim::AccuracyStatement& a = *s.accuracy;
    fmt::print("accuracy     {} requested: {}; chosen in {:.4f} CPU s\n", a.picture ? a.picture->asked : fmt::format("{:g}", a.asked),
               fmt::join(a.chosen, ", "), a.search_cpu);
    if (a.picture) print_shares(*a.picture, a.half_cost);
    else
      fmt::print(
          "error        {:.1e} of the range of {}, estimated: {:.1e} time integration, {:.1e} elements or modes, {:.1e} effects left out; "
          "halving the error would cost about {:.1f} times the CPU time\n",
          s.error_estimate, s.error_column, a.time, a.space, a.effects, a.half_cost);
  } else if (s.error_estimate >= 0.0 && s.error_estimate < rounding) {
    fmt::print("error        time error negligible\n");
  } else if (s.error_estimate >= 0.0) {
    fmt::print("error        {:.1e} of the range of {}, estimated for the time integration\n", s.error_estimate, s.error_column);
  }
  for (const std::string& warning : s.notes.texts(sim::Severity::warning)) fmt::print("WARNING      {}\n", warning);
  for (const std::string& note : s.notes.texts(sim::Severity::note)) fmt::print("note         {}\n", note);
}

void print_drawing(const DrawingReport& report) {
  const film::FilmReport& f = report.film;
  if (verbosity() == Verbosity::quiet) return print_warnings(report.warnings);
  fmt::print("pictures     {} of {}x{} in {}", f.pictures, report.size.width, report.size.height, report.frames.string());
  if (f.kept > 0) fmt::print(" ({} drawn, {} kept)", f.drawn, f.kept);
  fmt::print("\n");
  fmt::print("CPU          {:.2f} s setting up, {:.2f} s deformation, {:.2f} s drawing, {:.2f} s encoding", report.cpu_setup, f.cpu_deform,
             f.cpu_draw, f.cpu_encode);
  if (f.drawn > 0) fmt::print(": {:.1f} ms a picture", 1e3 * (f.cpu_deform + f.cpu_draw + f.cpu_encode) / f.drawn);
  fmt::print("; {} processes, {:.1f} s\n", f.workers, f.wall_seconds);
  if (report.video.made) fmt::print("video        {} ({:.2f} CPU s)\n", report.video_file.string(), report.video.cpu_seconds);
  else if (!report.video.note.empty()) fmt::print("note         {}\n", report.video.note);
  for (const std::string& warning : report.warnings) fmt::print("WARNING      {}\n", warning);
  for (const std::string& note : report.notes) fmt::print("note         {}\n", note);
}

nlohmann::ordered_json simulation_json(const sim::Results& results) {
  const sim::SolverStatistics& s = results.statistics;
  nlohmann::ordered_json json = {{"method", s.method},           {"tolerance", s.tolerance},     {"steps", s.steps},
                                 {"evaluations", s.evaluations}, {"jacobians", s.jacobians},     {"events", s.events},
                                 {"restarts", s.restarts},       {"cpu_seconds", s.cpu_seconds}, {"samples", results.times.size()}};
  if (s.error_estimate >= 0.0) json["error_estimate"] = {{"relative", s.error_estimate}, {"column", s.error_column}};
  if (s.accuracy) {
    const sim::AccuracyStatement& a = *s.accuracy;
    json["accuracy"] = {
        {"asked", a.asked},     {"error", s.error_estimate}, {"time", a.time},           {"space", a.space},
        {"effects", a.effects}, {"column", a.column},        {"half_cost", a.half_cost}, {"search_cpu_seconds", a.search_cpu},
        {"chosen", a.chosen}};
    if (a.picture) json["accuracy"]["picture"] = shares_json(*a.picture);
  }
  json["warnings"] = s.notes.texts(sim::Severity::warning);
  json["notes"] = s.notes.texts(sim::Severity::note);
  return json;
}

nlohmann::ordered_json drawing_json(const DrawingReport& report) {
  const film::FilmReport& f = report.film;
  nlohmann::ordered_json json = {{"folder", report.frames.string()},
                                 {"pictures", f.pictures},
                                 {"drawn", f.drawn},
                                 {"kept", f.kept},
                                 {"size", {report.size.width, report.size.height}},
                                 {"cpu_seconds",
                                  {{"setup", report.cpu_setup},
                                   {"deformation", f.cpu_deform},
                                   {"drawing", f.cpu_draw},
                                   {"encoding", f.cpu_encode},
                                   {"video", report.video.cpu_seconds}}},
                                 {"processes", f.workers},
                                 {"wall_seconds", f.wall_seconds}};
  json["video"] = report.video.made ? nlohmann::ordered_json(report.video_file.string()) : nlohmann::ordered_json(nullptr);
  json["warnings"] = report.warnings;
  json["notes"] = report.notes;
  if (!report.video.note.empty()) json["notes"].push_back(report.video.note);
  return json;
}

}  // namespace flexframe::cli
