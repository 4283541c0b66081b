// Results and settings -> pictures as plain data: the one place where simulation, kernel map and renderer meet.
//
//   const Animation animation = make_animation(results, settings, &scene);     once: meshes, maps, colour range, camera
//   PictureMemory memory;
//   update_picture(animation, k, memory);                                      memory.picture is picture k of animation.count
//
// Everything that must keep still over the sequence is settled by make_animation from the whole motion: colour range, exaggeration
// "auto", camera, light, ground. A picture depends on nothing but the animation and k, so any process may draw any picture.
// Only the elastic displacement is scaled, in the body's own frame; joints and rigid bodies are shown in scale.
#pragma once

#include "render/film/body_model.h"
#include "render/film/places.h"
#include "render/film/settings.h"
#include "render/picture/picture.h"
#include "render/picture/shapes.h"
#include "sim/results/results.h"
#include "sim/scene/expression.h"
#include "sim/scene/scene.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::film {

// A solid that goes with a joint's frame.
struct JointSymbol {
  int joint = 0;       // index in Results::joints
  bool fixed = false;  // stays where the joint's frame is at the start (a rail on ground)
  render::Mesh mesh;
  std::vector<glm::uvec3> triangles;
  std::vector<glm::vec3> positions, normals;  // per shading point
};

// One panel of histories, thinned to what a picture can show.
struct PlotSeries {
  std::string label;
  std::vector<double> x, y;
  const sim::VecX *times = nullptr, *values = nullptr;  // all samples, in the output's unit, where the points are fewer
};
struct PlotPanel {
  std::string y_label;
  double factor = 1.0;
  std::vector<PlotSeries> series;
};  // shown value = factor * value

// A force or torque as an arrow at its frame: of a force of the scene, or what a joint does to its child, from an output. A force per
// length as a row of arrows that end at the beam.
struct ForceArrow {
  FramePlace place;
  glm::dvec3 direction{0.0};  // unit; world, or of the frame for a follower
  bool follower = false, torque = false;
  sim::Expression value;                   // N, Nm or N/m
  std::array<int, 3> columns{-1, -1, -1};  // of a reaction: Results::outputs with its components, N or Nm, world
  std::vector<FramePlace> row{};           // of a force per length: along the beam, from end to end
  bool reaction() const { return columns[0] >= 0; }
  bool per_length() const { return !row.empty(); }
};

// A distance or angle of [render] dimensions: found frames, and how its value is written.
struct DimensionLine {
  FramePlace from, to;
  std::optional<FramePlace> at;  // vertex of an angle
  int axis = -1;                 // of the world, along which it is measured; -1: straight
  glm::dvec3 offset{0.0};        // m, world
  double radius = 0.0;           // m, of an angle's arc; 0: half of its shorter side
  std::string label, unit;
  double factor = 1.0;  // shown number = value * factor
  int decimals = 0;
};

// A frame whose surroundings are seen larger; the inset's point is filled in for each picture.
struct InsetPlace {
  FramePlace place;
  render::Inset inset;
};

struct SpringSymbol {
  FramePlace from, to;
  double coil = 0.0, wire = 0.0;
};  // radii, m

struct Animation {
  const sim::Results* results = nullptr;  // outlives the animation
  RenderSettings settings;
  std::vector<double> scales;     // solid one first
  std::vector<BodyModel> bodies;  // parallel to Results::bodies
  std::vector<JointSymbol> symbols;
  std::vector<FramePlace> traces, triads;
  std::vector<std::vector<Eigen::Index>> trace_samples;  // a trace each: the samples that it runs through
  // The vertex of a coloured body that is nearest to a probe's frame.
  struct Probe {
    std::string name;
    size_t body = 0;
    int point = 0;  // shading point
  };
  std::vector<Probe> probes;
  std::vector<DimensionLine> dimensions;
  std::vector<InsetPlace> insets;
  double triad_length = 0.0;  // m
  std::vector<ForceArrow> forces;
  double force_length = 0.0, torque_length = 0.0;  // m of arrow a N, a Nm: the same for all, the longest a sixth of the machine
  double line_length = 0.0, largest_line = 0.0;    // the same of forces per length: m of arrow an N/m, N/m
  // N, Nm, over the run: of forces and torques, then of reactions.
  std::array<double, 2> largest_force{}, largest_torque{};
  std::vector<SpringSymbol> springs;
  std::vector<PlotPanel> panels;
  render::ScalarMap scalar_map;
  std::optional<render::ScalarBar> scalar_bar;
  std::vector<bool> cut;                  // a body each: settings.section applies
  double largest_displacement = 0.0;      // m, elastic, of all vertices over the sequence
  std::vector<glm::dvec3> points;         // world; what a fitted camera sees: everything drawn, over the whole motion
  std::optional<render::FitOptions> fit;  // of a camera that is fitted
  render::Camera camera;                  // at the first picture
  std::optional<glm::vec3> light;         // where the camera turns: the key light stays where it was at the first picture
  std::vector<render::View> views;        // not empty: these instead
  std::optional<render::Ground> ground;
  render::Bounds bounds;              // of the whole motion with all its scales
  int follow = -1;                    // body, -1: none
  int count = 0;                      // pictures
  double step = 0.0;                  // s between pictures
  std::vector<std::string> notes;     // choices and what was mended, one sentence each
  std::vector<std::string> warnings;  // what may be wrong with the pictures
  double cpu_setup = 0.0;             // CPU seconds of maps and ranges
};

// scene: what the results were made from, for shapes and axes that the results do not hold; null where unknown.
// Throws what make_body_model throws.
Animation make_animation(const sim::Results& results, const RenderSettings& settings, const sim::Scene* scene);

// Map of values to colours and its bar, with the settings that they belong to.
struct Colors {
  RenderSettings settings;
  render::ScalarMap map;
  render::ScalarBar bar;
};
// The map and the bar of the pictures, were their bodies coloured by something else (and its range left to the program); the animation is
// as before. Of words that need other body models (stress, strain, map_error) an animation of their own is wanted. None: no body has it.
std::optional<Colors> colors_by(Animation& animation, ColorBy by);

// Simulated time of a picture (0 .. count - 1), s.
double picture_time(const Animation& animation, int picture);

// What joints' symbols are made of.
render::Material symbol_material(const RenderSettings& settings);

// The camera of picture k, from that of the first: on its path, around, along with a body.
void aim_camera(const Animation& animation, int picture, const render::Camera& first, render::Picture& out);

// A picture and the arrays it looks at.
struct PictureMemory {
  render::Picture picture;
  std::vector<BodyMemory> bodies;
  struct Skin {
    std::vector<glm::vec3> positions, normals;
  };
  std::vector<size_t> solid;                            // a body each: the skin of its solid surface
  std::vector<size_t> drawn;                            // the bodies whose surfaces the picture begins with
  std::vector<Skin> skins;                              // one a drawn surface
  std::vector<std::vector<float>> scalars;              // one a body, per shading point
  std::vector<std::vector<glm::vec3>> vectors, shears;  // likewise, of bodies coloured by_length
  std::vector<render::Shape> springs;
  std::vector<float> vertex_scalars;  // per vertex
  std::vector<float> components;      // per vertex, of ScalarMemory
};

// Throws interp::InputError if the results hold values that are not finite.
void update_picture(const Animation& animation, int picture, PictureMemory& memory);

// 128 bits over everything that decides the picture's pixels, as 32 hexadecimal digits; `environment` names what else does (renderer, CPU).
std::string picture_hash(const render::Picture& picture, const std::string& environment);

}  // namespace flexframe::film
