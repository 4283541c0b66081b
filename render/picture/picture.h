// A picture as plain data: what is to be seen, from where, in which light, with which words. render/draw/renderer.h draws it.
//
// Units: lengths in m, angles in degrees where named so, colours in sRGB (as a colour picker gives them, 0..1), straight alpha.
// Widths and sizes of lines, markers and text are in pixels of a picture 720 pixels high and scale with the picture.
// Spans are looked at only while Renderer::draw runs; whoever fills the picture keeps the arrays alive until then.
// Positions are floats in the frame of their surface, poses and cameras are doubles: a body far from the world's origin
// stays sharp if its vertices are given in its own frame.
#pragma once

#include "render/picture/colormap.h"

#include <glm/glm.hpp>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace flexframe::render {

struct Size {
  int width = 1280, height = 720;  // pixels, 16..16384 each
  bool operator==(const Size&) const = default;
};

// Axis-aligned box; empty while lower > upper.
struct Bounds {
  glm::dvec3 lower{1e300}, upper{-1e300};
  bool empty() const { return !(lower.x <= upper.x && lower.y <= upper.y && lower.z <= upper.z); }
  // Grows to hold the point, or the other box.
  void add(const glm::dvec3& p) {
    lower = glm::min(lower, p);
    upper = glm::max(upper, p);
  }
  // Empty ones change nothing.
  void add(const Bounds& b) {
    if (!b.empty()) {
      add(b.lower);
      add(b.upper);
    }
  }
  glm::dvec3 centre() const { return 0.5 * (lower + upper); }
  double radius() const { return empty() ? 0.0 : 0.5 * glm::length(upper - lower); }
};

// Bounds of posed vertices; vertices that are not finite are left out.
Bounds compute_bounds(std::span<const glm::vec3> positions, const glm::dmat4& pose = glm::dmat4(1.0));

enum class Projection { perspective, orthographic };

struct Camera {
  glm::dvec3 position{0.0, 0.0, 5.0};
  glm::dvec3 target{0.0};
  glm::dvec3 up{0.0, 1.0, 0.0};
  double fov = 35.0;    // degrees, vertical, perspective
  double height = 2.0;  // m, visible height in the target's plane, orthographic
  Projection projection = Projection::perspective;
};

struct Background {
  glm::vec3 top{0.80f, 0.85f, 0.91f}, bottom{0.97f, 0.975f, 0.98f};  // vertical gradient; both (1, 1, 1): white paper
  bool transparent = false;                                          // picture with alpha (RGBA), straight
};

// Key light with soft shadow, and light from above (sky) and below (ground) that stands for the surroundings.
struct Lighting {
  std::optional<glm::vec3> direction;  // towards the key light, world; default: default_light (camera.h)
  float key = 1.0f;                    // strength of the key light, 1: usual
  float ambient = 1.0f;                // strength of the surroundings
  bool studio = false;                 // surroundings of soft boxes and a dark floor: metals and paint show their form; false: a plain sky
};

// Plane with a thin grid that fades with the distance from the centre of the bounds; receives the shadows.
struct Ground {
  glm::dvec3 point{0.0};
  glm::dvec3 normal{0.0, 1.0, 0.0};
  double spacing = 0.0;  // m between grid lines; 0: 1-2-5 step that suits the bounds
  glm::vec3 line_color{0.55f, 0.60f, 0.66f};
  bool lines = true;  // false: a bare floor that only takes the shadows
};

struct Material {
  glm::vec3 color{0.66f, 0.69f, 0.73f};  // where neither scalars nor vertex colours are given
  float roughness = 0.45f;               // 0 mirror .. 1 chalk
  float metallic = 0.0f;                 // 0 paint, plastic .. 1 metal
};

// One triangle mesh in one pose.
struct Surface {
  std::span<const glm::vec3> positions;   // in the frame of the surface
  std::span<const glm::vec3> normals;     // unit, one per position; empty: flat shading
  std::span<const glm::uvec3> triangles;  // indices of positions, counterclockwise seen from outside
  std::span<const float> scalars;         // one per position, coloured through Picture::scalar_map; empty: none. NaN is drawn grey
  // Vectors whose length is the scalar, one per position, beside scalars: the length is taken where it is seen, not at the corners of a
  // face (a turning disc stands still at its centre). With `shears` too: stress, xx yy zz and xy yz xz, whose von Mises value is the
  // scalar.
  std::span<const glm::vec3> vectors, shears;
  std::span<const glm::vec3> colors;  // one per position, used where scalars is empty; empty: material.color
  glm::dmat4 pose{1.0};               // world from surface, rigid or with uniform scale
  Material material;
  float opacity = 1.0f;                      // < 1: ghost: one translucent shell, inner faces do not show through
  bool two_sided = true;                     // false: closed mesh, back faces are not drawn (much faster)
  bool edges = false;                        // lines along the edges of the triangles
  bool wires = false;                        // only those lines, the hidden ones left out; opacity is theirs
  std::span<const std::uint8_t> edge_flags;  // one per triangle: bit k: the edge from its corner k to the next is drawn; empty: all
  bool silhouette = false;                   // dark outline against whatever lies behind
  bool cut = false;                          // Picture::cut applies; the mesh should be closed, or its caps are gaps
  int layer = 0;              // 0..15: of surfaces in one plane the one of the higher layer is seen, all over: they do not flicker
  bool behind = false;        // a ghost that is seen beside solid surfaces only, never over them
  float seen_through = 0.0f;  // opacity of what other solid surfaces hide of it; 0: hidden
  bool casts_shadow = true;
  glm::vec3 edge_color{0.12f, 0.14f, 0.17f};
  float edge_width = 1.0f;
};

// A plane that cuts things open: what lies on the side its normal points to is left out, solids show their inside as a flat, hatched cap.
struct Cut {
  glm::dvec3 point{0.0}, normal{0.0, 0.0, 1.0};  // world
};

// Straight segments between points, always facing the viewer.
struct Lines {
  std::vector<glm::vec3> points;  // world unless pose says otherwise
  std::vector<glm::vec4> colors;  // one per point (fading traces); empty: color
  bool strip = true;              // true: one polyline; false: pairs
  // Of pairs: the normals, of any length, of the two faces that meet in each, of a closed body. A line is left out where both look away
  // from the viewer: it lies behind the body, or inside the cap of a cut. Empty: all are drawn.
  std::vector<glm::vec3> faces;
  glm::vec4 color{0.15f, 0.17f, 0.20f, 1.0f};
  float width = 1.5f;
  glm::dmat4 pose{1.0};
  bool on_top = false;        // not hidden by surfaces
  bool cut = false;           // Picture::cut applies
  float seen_through = 0.0f;  // opacity of what surfaces hide of it
};

enum class MarkerShape { sphere, disc, ring, square, cross };

// Symbols of constant size on the picture: simulation nodes, joints, traced points.
struct Markers {
  std::vector<glm::vec3> points;
  MarkerShape shape = MarkerShape::sphere;
  glm::vec4 color{0.85f, 0.33f, 0.10f, 1.0f};
  float diameter = 7.0f;
  glm::dmat4 pose{1.0};
  bool on_top = false;
  float seen_through = 0.0f;
};

// Solid arrow, for forces and axes.
struct Arrow {
  glm::dvec3 from{0.0}, to{1.0, 0.0, 0.0};  // world
  glm::vec3 color{0.80f, 0.20f, 0.15f};
  double radius = 0.0;  // m, of the shaft; 0: 2.5 % of the length
  float opacity = 1.0f;
  float seen_through = 0.0f;
};

// Body frame: three arrows x red, y green, z blue.
struct Triad {
  glm::dmat4 pose{1.0};
  double length = 0.1;  // m
  float seen_through = 0.0f;
};

// Words at a point of the scene.
struct Label {
  glm::dvec3 point{0.0};
  std::string text;
  float size = 13.0f;
  glm::vec3 color{0.13f, 0.15f, 0.18f};
  bool leader = false;  // stands off, joined to a dot at its point by a line
};

// A distance or an angle: a thin line with a head at each end and its value in the middle, over everything.
struct Dimension {
  std::vector<glm::dvec3> line;                      // world: two points, or an arc of many
  std::vector<std::array<glm::dvec3, 2>> helpers{};  // thinner, from what is measured to the line
  std::string text{};
};

// How scalars become colours; the scalar bar shows the same.
struct ScalarMap {
  Colormap colormap = Colormap::viridis;
  double lower = 0.0, upper = 1.0;  // values of the two ends; outside: clamped
  int levels = 0;                   // > 1: that many flat bands
  int isolines = 0;                 // > 1: dark lines at the borders of that many bands
  bool lightened = false;           // dark ends lifted, so that the light on a solid still shows; the bar shows the same colours
  bool logarithmic = false;         // colours by the logarithm; both ends must be positive
  // Largest and smallest value where the range leaves them out: stand at the ends of the bar.
  std::optional<double> above{}, below{};
};

// Place of a value on the bar, 0..1 and beyond for what lies outside; not a number stays one.
double scalar_share(const ScalarMap& map, double value);

// The colour at a share 0..1 of the map, as bar and surfaces show it.
glm::vec3 map_color(const ScalarMap& map, double share);

// The colour of a value as surfaces show it, without light; grey for what is no number.
glm::vec3 scalar_color(const ScalarMap& map, double value);

struct ScalarBar {
  std::string label;    // "displacement"
  std::string unit;     // "mm"
  double factor = 1.0;  // shown number = value * factor (1000 for m shown in mm)
};

struct Series {
  std::string label;
  std::span<const double> x, y;  // of equal length; NaN interrupts the line
  glm::vec3 color{-1.0f};        // negative: next of the standard colours
  std::optional<double> now{};   // the value at the plot's mark, where the points are too few to tell it
};

// Diagram of histories; the part up to the mark is drawn strong, what is to come faint, with a dot on each series.
struct Plot {
  std::string x_label = "t [s]", y_label;
  std::vector<Series> series;
  double mark = 0.0;                           // x of the running mark (time)
  std::optional<glm::dvec2> x_range, y_range;  // default: of the data
};

struct LegendEntry {
  std::string text;
  glm::vec3 color{0.5f};
  float opacity = 1.0f;  // < 1: drawn as a ghost
};

enum class PlotPlace { below, beside };

// All words and diagrams over the picture. Whatever is empty is not drawn and takes no room.
struct Overlay {
  std::string title;         // upper left
  std::string time;          // upper right, "t = 0.400 s" (time_text)
  std::string note;          // below the title: "solid: in scale, ghost: exaggerated × 20"
  std::string short_note{};  // in its place where that has no room: "ghost: × 20"
  std::optional<ScalarBar> scalar_bar;
  bool triad = false;  // directions of the world's axes, lower left corner
  std::vector<LegendEntry> legend;
  std::vector<Plot> plots;  // one panel of plots below or beside the scene
  PlotPlace plot_place = PlotPlace::below;
  double plot_share = 0.28;  // of the picture's height (below) or width (beside)
  bool grid_note = true;     // with a ground: "grid 0.1 m", lower right
  float text_scale = 1.0f;
  bool dark = false;  // light text for dark backgrounds
};

// One of several views in a picture: its part of the scene's area, in fractions from the upper left corner.
struct View {
  Camera camera;
  double left = 0.0, top = 0.0, width = 1.0, height = 1.0;
  std::string label;
};

enum class InsetCorner { upper_left, upper_right, lower_left, lower_right };

// A part of the scene larger, in a corner of the picture over the first view, which shows by a frame what part that is.
struct Inset {
  glm::dvec3 point{0.0};  // world: its middle
  double zoom = 4.0;      // how many times larger than in the first view
  double size = 0.3;      // its height, of the scene's area
  InsetCorner corner = InsetCorner::lower_right;
  std::string label;
};

// What is dear and may be left out; what is off costs nothing.
struct Look {
  int samples = 4;        // antialiasing samples a pixel: 1, 4, 9 or 16
  bool shadows = true;    // soft shadow of the key light on bodies and ground
  bool occlusion = true;  // ambient occlusion in corners and contacts
};

// All off but antialiasing.
inline Look plain_look() { return {.samples = 4, .shadows = false, .occlusion = false}; }

struct Picture {
  Size size;
  Background background;
  Camera camera;
  std::vector<View> views;  // not empty: these instead of camera
  std::vector<Inset> insets;
  Lighting lighting;
  std::optional<Ground> ground;
  std::vector<Surface> surfaces;
  std::vector<Lines> lines;
  std::vector<Markers> markers;
  std::vector<Arrow> arrows;
  std::vector<Triad> triads;
  std::vector<Label> labels;
  std::vector<Dimension> dimensions;
  std::optional<Cut> cut;
  ScalarMap scalar_map;
  Overlay overlay;
  Look look;
  Bounds bounds;  // of the whole motion: light, shadow and ground keep still over a sequence; empty: of this picture
};

// "t = 0.400 s" with as many decimals as tell pictures `step` seconds apart from `start` on, in s, ms or µs by the duration.
std::string time_text(double t, double step, double duration, double start = 0.0);

// "× 20", "× 1.5": a scale as the note and the legend write it.
std::string scale_text(double scale);

}  // namespace flexframe::render
