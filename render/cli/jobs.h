// What several subcommands do alike: simulate with progress, draw with progress, and tell about both.
#pragma once

#include "render/cli/command.h"

#include "render/film/animation.h"
#include "render/film/contact_sheet.h"
#include "render/film/filming.h"
#include "render/film/video.h"
#include "sim/accuracy/accuracy.h"
#include "sim/simulate.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <optional>
#include <string>

namespace flexframe::cli {

// --tolerance, --method, --no-error-estimate, --no-effect-check, --strict
struct SimulationWords {
  std::optional<double> tolerance, max_steps;
  std::string accuracy;  // a share, or a distance in the pictures
  std::string method;
  bool no_estimate = false, no_check = false, strict = false;
  bool fresh = false;  // of run and simulate
};
void add_simulation_words(Subcommand words, SimulationWords& values);
// --fresh
void add_fresh_word(Subcommand words, SimulationWords& values);

// --frames, --shard, --size, --scales, ...
struct RenderWords {
  std::string frames, shard, size, scales, color_by, look, renderer = "osmesa", video;
  std::string view, camera, target, fov, projection, background, colormap, color_range, frame_rate, speed, print_size,
      dpi;  // keys of [render], as text
  std::optional<int> samples;
  std::string cache;
  int workers = 0;
  bool resume = false, no_video = false, no_shadows = false, no_overlay = false, vector = false, pdf = false;
};
void add_render_words(Subcommand words, RenderWords& values);
// "none, displacement ... or map_error": what --color-by takes.
std::string color_by_help();

// A scene with its render settings, both read and checked, the meshes it names included. Throws sim::InputError, render::MeshError.
struct Job {
  sim::Scene scene;
  film::RenderSettings settings;
  std::vector<std::string> mesh_notes;  // what of the bodies' meshes was mended or is not drawn
};
// settings: those of --set (sim/scene/document.h). words: their keys of [render] count before the scene's.
Job read_job(const std::filesystem::path& scene_file, const std::vector<std::string>& settings = {}, const RenderWords* words = nullptr);

// The keys of [render] among the words as settings ("render.speed=0.5").
std::vector<std::string> render_settings(const RenderWords& words);

// --set, for commands that read a scene.
void add_scene_words(Subcommand words, std::vector<std::string>& settings);

// The options given take the place of the scene's words. Throws sim::InputError.
void apply_words(const RenderWords& words, film::RenderSettings& settings);

// What --accuracy asks for: a share of the outputs' ranges or a distance in the pictures, neither where the option is not given. Throws
// UsageError.
struct AskedAccuracy {
  std::optional<double> share;
  std::optional<sim::PictureAccuracy> pictures;
};
AskedAccuracy asked_accuracy(const SimulationWords& words);
// Whether these words and the scene ask for an accuracy.
bool asks_accuracy(const sim::Scene& scene, const SimulationWords& words);

// "auto", "adams", ... Throws UsageError.
sim::Method method_from_name(const std::string& name);

// Where the settings that a search for an accuracy finds are kept: beside the results, NAME.settings.toml.
sim::SettingsMemory settings_memory(const std::filesystem::path& scene_file, const std::vector<std::string>& settings,
                                    const SimulationWords& words, const std::filesystem::path& file);

// memory: null where nothing is kept. Throws std::runtime_error for warnings where they are to be errors.
sim::Results run_simulation(const Job& job, const SimulationWords& words, const sim::SettingsMemory* memory = nullptr);

// Pictures to folder/frames, the video beside them.
struct DrawingReport {
  film::FilmReport film;
  film::VideoReport video;
  std::filesystem::path frames, video_file;
  render::Size size;
  double cpu_setup = 0.0;  // maps, ranges, camera
  std::vector<std::string> notes, warnings;
};
DrawingReport run_drawing(const sim::Results& results, const film::RenderSettings& settings, const sim::Scene* scene,
                          const RenderWords& words, const std::filesystem::path& folder, const std::string& name);

// Fails now rather than after a long simulation: whether files could be made at `path` (a folder that may not exist yet).
void require_writable(const std::filesystem::path& path);
// The same for a file, which may be a stream. What else is said on stdout is not mixed with a file that goes there (/dev/stdout).
void require_writable_file(const std::filesystem::path& file);
void make_folder(const std::filesystem::path& path);

// On stderr, whatever is said besides.
void print_warnings(const std::vector<std::string>& warnings);

// What is said about them, as text or JSON.
void print_simulation(const sim::Results& results);
void print_drawing(const DrawingReport& report);
nlohmann::ordered_json simulation_json(const sim::Results& results);
nlohmann::ordered_json drawing_json(const DrawingReport& report);

}  // namespace flexframe::cli
