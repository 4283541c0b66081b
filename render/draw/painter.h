// Private to the drawing: surfaces, lines and markers through OpenGL into whatever target is bound.
#pragma once

#include "render/draw/content.h"
#include "render/draw/device.h"
#include "render/draw/shadow.h"
#include "render/draw/visible.h"

#include <list>
#include <vector>

namespace flexframe::render {

// Shared by all surfaces of one view.
struct ViewState {
  const ViewFrame* frame = nullptr;
  int per_pixel = 1;
  glm::vec2 samples{0.0f};                             // of the view
  int x = 0, y = 0;                                    // first sample drawn, from the lower left of the view
  glm::vec3 to_light{0.0f}, up{0.0f};                  // camera frame
  const LightFrame* light = nullptr;                   // null: no shadow
  double shadow_reach = 0.0;                           // m, half width of the shadow's filter
  GLuint shadow = 0;                                   // moments of the filtered map
  glm::vec4 shadow_part{1.0f, 1.0f, 0.0f, 0.0f};       // texture coordinates from those of the light: scale, offset
  std::span<const std::uint32_t> colors, colors_kept;  // color_steps_of the map, 10 and 8 bits a channel
  Target* target = nullptr;                            // bound for opaque things; null: every sample is lit as it is drawn
  double unit = 1.0;                                   // samples of one pixel at 720 lines
  bool ghost = false;
  const Cut* cut = nullptr;  // null: none
  bool hidden = false;       // what is drawn lies behind something
  bool scalar_output = false;
};

// The colour map as the shader looks it up, color_steps entries and one for what is no number.
std::vector<std::uint32_t> color_steps_of(const ScalarMap& map, int bits);

// What the light on a surface follows from, the same for all its fragments: see the uniforms of these names in shaders.cpp.
struct MaterialTerms {
  glm::vec3 base{0.0f};  // linear
  glm::vec4 diffuse{0.0f}, gloss{0.0f};
  glm::vec3 mirror{0.0f};
  glm::vec4 boxes{0.0f};  // these two of the studio only
  float box_strength = 0.0f;
};
struct ViewTerms {
  glm::vec3 side{0.0f}, falloff{0.0f};  // of the studio only
  glm::vec4 ray{0.0f};
};
MaterialTerms material_terms(const Surface& surface, const Lighting& lighting, Colormap map);
ViewTerms view_terms(const Picture& picture, const Surface& surface, const ViewState& view);
bool is_matt(const Surface& surface, const Lighting& lighting);
// Slope and offset from values, or their logarithms, to shares of the map's range.
glm::vec2 scalar_scale(const ScalarMap& map);
glm::dmat4 clip_from_surface(const Surface& surface, const ViewState& view);
// How the triangles to be seen wind: a pose that mirrors turns them over.
Facing facing_of(const Surface& surface);
int mark_of(std::size_t index);

// Indices of opaque surfaces, nearest first: all, those with lines, caps or isolines in them, the others.
struct PaintOrder {
  std::vector<std::size_t> all, lined, plain;
};
PaintOrder order_opaque(const Picture& picture, const Content& content, const ViewFrame& frame);

class Painter {
 public:
  explicit Painter(Device& device) : device_(device) {}

  // Depth test and clearing for opaque things; the target must be bound.
  void begin_opaque(const ViewState& view);
  // The same without clearing: something is there already.
  void continue_opaque(const ViewState& view);

  // Opaque surfaces, nearest first so that hidden fragments are not shaded; the alpha byte carries mark_of(index).
  // Of fine meshes only what is seen gets lit: many small triangles touch a block of samples that OpenGL then shades anew for each.
  void draw_opaque(const Picture& picture, const Content& content, const ViewState& view);
  void draw_surfaces(const Picture& picture, const Content& content, const std::vector<std::size_t>& which, const ViewState& view);
  // What solid surfaces hide of surfaces, lines and markers that are seen through them, blended over what hides it.
  void draw_hidden(const Picture& picture, const Content& content, const ViewState& view);
  // Opaque lines and markers.
  void draw_symbols(const Picture& picture, const ViewState& view);

  // keep: normal, colour and mark of its samples go to the target's store, to be lit later.
  void draw_surface(const Surface& surface, const Picture& picture, const ViewState& view, int mark, bool keep = false);
  void draw_lines(const Lines& lines, const ViewState& view);
  void draw_markers(const Markers& markers, const ViewState& view);

  // At the end of a picture: its arrays are forgotten.
  void forget();

 private:
  // Corners of all triangles one by one, with the distance coordinates that edges need.
  struct Exploded {
    std::vector<glm::vec3> positions, normals, colors, corners, vectors, shears;
    std::vector<float> scalars;
  };
  static Exploded explode(const Surface& surface, std::span<const std::uint32_t> triangles);
  void set_view(Program& program, const Picture& picture, const Surface& material, const ViewState& view);
  void light_kept(const Picture& picture, const Content& content, const std::vector<std::size_t>& kept, const ViewState& view);
  // Ends of the pairs of which a face looks at the viewer.
  static std::vector<glm::vec3> facing_pairs(const Lines& lines, const ViewFrame& frame, std::vector<glm::vec4>& colors);
  Program& symbol_program(ShaderKind kind, const glm::dmat4& pose, double least, double width, const ViewState& view, bool cut);
  void draw_triangles(std::span<const glm::uvec3> triangles);
  void attribute(GLuint index, GLint components, GLuint buffer, std::size_t offset = 0, GLuint divisor = 0);
  void no_attributes();

  Device& device_;
  VisibleTriangles visible_;
  // Alive until the picture is done: buffers are known by their address.
  std::list<Exploded> exploded_;
  std::list<std::vector<glm::vec4>> line_colors_;
  std::list<std::vector<glm::vec3>> line_points_;
};

}  // namespace flexframe::render
