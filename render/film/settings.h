// The [render] table of a scene, read and checked. Every key with its type, default and meaning: sim/SCENE.md, "[render]".
#pragma once

#include "interp/map.h"
#include "render/frame/camera.h"
#include "render/picture/picture.h"
#include "sim/results/results.h"
#include "sim/scene/document.h"
#include "sim/scene/scene.h"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexframe::film {

enum class ColorBy { none, displacement, strain, velocity, body, stress, mode, map_error };

// Words of color_by, in the order of the enumeration.
const std::vector<std::string>& color_by_words();
// Which number of a stress colours show; words in the order of the enumeration. Principal stresses have signs: tension is positive.
enum class StressMeasure { von_mises, tresca, max_principal, min_principal };
const std::vector<std::string>& stress_words();
// Lines on surfaces: none, along all edges of the mesh, or along creases and borders only.
enum class EdgeLines { none, mesh, creases };
enum class BackgroundKind { gradient, white, dark, transparent };

// Sets of words under one name: as drawn until version 2; lines and grid for engineers; light and floor for an audience; ink on paper.
enum class LookKind { plain, technical, presentation, print };
const std::vector<std::string>& look_words();

// Bodies cut open.
struct Section {
  std::optional<glm::dvec3> point;  // m, world; default: middle of the motion
  glm::dvec3 normal{0.0, 0.0, 1.0};
  std::vector<std::string> bodies;  // empty: all
  int line = 0;                     // in the scene file, for messages
};

// A distance between two frames, or an angle at a third.
struct DimensionSettings {
  std::string from, to, at;  // frames; at: vertex of an angle, empty: a distance
  int axis = -1;             // 0 x, 1 y, 2 z of the world; -1: straight
  glm::dvec3 offset{0.0};    // m, world: the line is drawn so far beside
  double radius = 0.0;       // m, of an angle's arc; 0: half of the shorter side
  std::string label;         // before the value
  int line = 0;              // in the scene file, for messages
};

// A frame's surroundings larger, in a corner of the picture.
struct InsetSettings {
  std::string at;         // frame
  render::Inset drawing;  // all but its point
  int line = 0;           // in the scene file, for messages
};

// Where the ends of the colour map lie if they are not given.
struct ColorRange {
  // Per cent of the time in which the largest value lies below the upper end; 100: the largest of all; none: 98 where a short peak would
  // take more than half of the map, else 100.
  std::optional<double> percentile;
  std::optional<std::pair<double, double>> window;  // s: only what is seen in between counts
  bool symmetric = false;                           // the lower end is minus the upper one
  bool logarithmic = false;                         // three decades
};

struct CameraSettings {
  bool fit = true;                             // false where a position is given
  std::optional<glm::dvec3> position, target;  // m, world
  std::optional<glm::dvec3> direction, up;     // of a fitted view; default: chosen by the motion
  double fov = 35.0;                           // degrees, vertical
  render::Projection projection = render::Projection::perspective;
  double height = 2.0;                              // m, orthographic without fit
  std::string preset;                               // of a fitted view: plane, front, side, top, iso; empty: chosen by the motion
  std::optional<std::pair<double, double>> window;  // s: a fitted view takes in what is seen in that time only
  std::vector<render::ViewKind> views;              // several in one picture; empty: one
  double orbit = 0.0;                               // degrees over the sequence
  std::vector<render::CameraKey> path;              // t in s of the motion; empty: none
  std::string follow;                               // body, empty: none
  int follow_line = 0;                              // in the scene file, for messages
};

// Whether a word of `plot` means this column of the history: the column, or the output whose component it is.
bool names_column(const std::string& word, const std::string& column);

struct OverlaySettings {
  bool title = true, time = true, scalar_bar = true, triad = true, legend = true, note = true;
  bool words = true;              // false: no text at all, neither values beside arrows, probes and dimensions
  std::vector<std::string> plot;  // columns of the history, or outputs
  int plot_line = 0;              // in the scene file, for messages
  render::PlotPlace plot_place = render::PlotPlace::below;
};

struct RenderSettings {
  render::Size size;
  double frame_rate = 30.0;
  double speed = 0.0;  // 0: left out, see playback_speed
  int samples = 4;
  std::vector<double> scales;  // empty: "auto"
  bool corotated = false;
  std::filesystem::path cache;  // folder of mapped modes (interp/modes.h); empty: none. Not of the scene: it changes no picture
  ColorBy color_by = ColorBy::displacement;
  int mode = 1;         // 1-based, color_by mode
  bool inertia = true;  // color_by stress counts what modes leave out of inertia and weight; not in pictures of a mode
  StressMeasure stress = StressMeasure::von_mises;
  double yield_stress = 0.0;  // Pa: colours by stress are shares of it, or of the body's own; 0: of the body's own only, else Pa
  std::optional<std::pair<double, double>> color_range;
  ColorRange range;
  int bands = 0, isolines = 0;  // 0: none
  LookKind look = LookKind::technical;
  render::Colormap colormap = render::Colormap::viridis;
  int trail = 0;
  bool undeformed = false;
  interp::Scheme scheme = interp::Scheme::automatic;
  BackgroundKind background = BackgroundKind::gradient;
  bool ground = true, joints = true, nodes = false;
  bool forces = false;
  std::vector<std::string> traces, triads;  // frames
  std::vector<DimensionSettings> dimensions;
  std::vector<InsetSettings> insets;
  std::vector<std::string> probes;  // frames whose value of the colours is written beside them
  bool extremes = false;            // largest and smallest value of the colours
  std::optional<Section> section;
  int probes_line = 0;
  int traces_line = 0, triads_line = 0;  // in the scene file, for messages
  int contact_sheet = 0;
  bool depth_channel = false, scalar_channel = false, linear_channel = false;
  bool vector_channel = false, pdf_channel = false;
  double dpi = 0.0;  // pixels an inch on paper; 0: not said
  float text_scale = 1.0f;
  std::string video = "mp4";
  bool shadows = true, occlusion = true, silhouette = false;
  bool level_of_detail = true;  // fewer triangles of meshes finer than pixels (detail.h)
  EdgeLines edges = EdgeLines::creases;
  bool studio = true, grid = true;  // light of the look, and lines on its ground
  CameraSettings camera;
  OverlaySettings overlay;
  std::vector<std::pair<std::string, glm::vec3>> runs;  // names and colours of runs in one picture (runs.h); not of the scene
};

// Whether what the bodies are coloured by has values below zero.
bool is_signed(const RenderSettings& settings);

// The words that a look stands for.
void apply_look(LookKind look, RenderSettings& settings);

// Reads the [render] table of a scene's text; a text without one gives the defaults. `name` stands for the file in messages.
// Throws sim::InputError as sim/scene/scene_reader.h does: unknown and misspelt keys, wrong types, values out of range.
RenderSettings parse_render_settings(std::string_view text, const std::string& name);

// The same of a file.
RenderSettings read_render_settings(const std::filesystem::path& file);
RenderSettings read_render_settings(const sim::SceneDocument& document);

// Refuses bodies and columns that the scene does not have, and more than a million pictures. Throws sim::InputError.
void check_render_settings(const RenderSettings& settings, const sim::Scene& scene);

// Likewise against results, which may come from another simulator.
void check_render_settings(const RenderSettings& settings, const sim::Results& results, const std::string& name);

// Simulated seconds per second of playback: what is asked for, else what suits a run of `duration` s.
double playback_speed(const RenderSettings& settings, double duration);

// "1280x720" to a size, "1,20" or "auto" to scales: the program's options. Throw sim::InputError.
render::Size parse_size(const std::string& text);
std::vector<double> parse_scales(const std::string& text);

}  // namespace flexframe::film
