#include "render/draw/painter.h"

#include "render/base/srgb.h"
#include "render/draw/shaders.h"

#include <glm/gtc/matrix_transform.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace flexframe::render {
namespace {

// Surfaces that can be lit after all are drawn: their marks tell them apart, and no lines are drawn into them.
constexpr std::size_t most_kept = 254;
// Triangles of a picture from which on that is cheaper (bench_render: 20 % at 100 000, nothing at 5000).
constexpr std::size_t kept_from = 20000;

// How much of a mapped colour's strength light may change: none where strength alone is the value, little where hues are alike.
float light_share(Colormap map) { return map == Colormap::greys ? 0.0f : map == Colormap::cividis ? 0.09f : 0.42f; }

// Numbers of a material as the shader takes them.
void set_material(Program& program, const MaterialTerms& m) {
  program.set("boxes", m.boxes);
  program.set("box_strength", m.box_strength);
  program.set("base_color", m.base);
  program.set("diffuse_terms", m.diffuse);
  program.set("gloss", m.gloss);
  program.set("mirror_terms", m.mirror);
}

// From values to the share of the map's range; where the fragment takes a length or a logarithm, there and not at the vertex.
void set_scalars(Program& program, const ScalarMap& map, bool vectors, std::span<const std::uint32_t> colors, const ViewState& v) {
  const glm::vec2 scale = scalar_scale(map);
  const bool late = vectors || map.logarithmic;
  program.set("scalar_scale", late ? glm::vec2(1.0f, 0.0f) : scale);
  program.set("value_scale", scale);
  program.set("levels", static_cast<float>(map.levels));
  program.set("isolines", static_cast<float>(map.isolines));
  program.set("line_half", static_cast<float>(std::max(0.5 * v.per_pixel, 0.75 * v.unit)));
  program.set("colors", colors);
}

// The plane in the frame of a pose (rigid or with uniform scale): positive where things are left out.
glm::vec4 cut_plane(const Cut& cut, const glm::dmat4& pose) {
  const glm::dvec3 normal = glm::normalize(cut.normal);
  return glm::vec4(glm::transpose(pose) * glm::dvec4(normal, -glm::dot(normal, cut.point)));
}

}  // namespace

// In the studio colours of values get no gloss at all: what would be multiplied by zero is left out of the shader.
bool is_matt(const Surface& s, const Lighting& lighting) { return lighting.studio && !s.scalars.empty(); }

// Light only modulates colour-mapped surfaces: the colours stay those of the scalar bar.
MaterialTerms material_terms(const Surface& s, const Lighting& lighting, Colormap map) {
  const bool mapped = !s.scalars.empty();
  const float roughness = std::clamp(s.material.roughness, 0.08f, 1.0f),
              metallic = mapped ? 0.0f : std::clamp(s.material.metallic, 0.0f, 1.0f);
  // In the studio colours of values get less light and no gloss, so that they can be read back; other things more contrast.
  const bool studio = lighting.studio;
  const float share = !mapped  ? 1.0f
                      : studio ? light_share(map)
                               : 0.55f,
              shine = !mapped  ? 1.0f
                      : studio ? 0.0f
                               : 0.35f,
              alpha = roughness * roughness;
  const glm::vec4 light = studio && !mapped ? glm::vec4(0.27f, 0.15f, 0.20f, 0.84f) : glm::vec4(0.46f, 0.16f, 0.16f, 0.62f);
  const glm::vec4 diffuse(1.0f - share + share * light.x * lighting.ambient, share * light.y * lighting.ambient,
                          share * light.z * lighting.ambient, share * light.w * lighting.key);
  MaterialTerms m;
  if (studio) {
    // A soft box around the key light and a strip beside it: as wide and as faint as the surface is rough.
    const float blur = glm::mix(0.12f, 1.0f, roughness);
    m.boxes = glm::vec4(0.84f - 0.55f * blur, 1.0f / blur, 0.80f - 0.45f * blur, 1.0f / (0.7f * blur));
    m.box_strength = glm::mix(1.9f, 0.5f, roughness) * lighting.key;
  }
  m.base = linear_from_srgb(glm::clamp(s.material.color, 0.0f, 1.0f));
  m.diffuse = (1.0f - metallic) * diffuse;
  m.gloss = glm::vec4(alpha, 0.5f / std::numbers::pi_v<float> * alpha * alpha, 0.9f * lighting.key * shine, lighting.ambient * shine);
  m.mirror = glm::vec3(0.5f / glm::mix(0.08f, 1.0f, roughness), std::max(1.0f - roughness, 0.04f), metallic);
  return m;
}

ViewTerms view_terms(const Picture& p, const Surface& s, const ViewState& v) {
  ViewTerms terms;
  if (p.lighting.studio) {
    // Across the key light, level.
    const glm::vec3 side = glm::cross(v.up, v.to_light);
    terms.side = glm::length(side) > 1e-3f ? glm::normalize(side) : glm::vec3(1.0f, 0.0f, 0.0f);
    // A quarter more light where the view ends on the lamp's side; none of it where colours are values.
    const glm::dvec2 samples(v.samples), lamp(v.to_light);
    const double way = glm::length(lamp), strength = s.scalars.empty() && way > 1e-3 ? 0.25 : 0.0;
    const glm::dvec2 slope = way > 1e-3 ? strength / (0.5 * std::max(samples.x, samples.y) * way) * lamp : glm::dvec2(0.0);
    terms.falloff = glm::vec3(slope, 1.0 + glm::dot(slope, glm::dvec2(v.x, v.y) - 0.5 * samples));
  }
  // Towards the viewer, from a sample: minus the ray through it, for a perspective camera.
  const double step = v.frame->orthographic ? 0.0 : v.frame->pixel / v.per_pixel;
  terms.ray =
      glm::vec4(-step, -step, step * (0.5 * static_cast<double>(v.samples.x) - v.x), step * (0.5 * static_cast<double>(v.samples.y) - v.y));
  return terms;
}

glm::vec2 scalar_scale(const ScalarMap& map) {
  const double lower = map.logarithmic ? std::log2(map.lower) : map.lower, upper = map.logarithmic ? std::log2(map.upper) : map.upper;
  const double range = upper - lower, slope = range != 0.0 ? 1.0 / range : 0.0;
  return {static_cast<float>(slope), static_cast<float>(range != 0.0 ? -lower * slope : 0.5)};
}

glm::dmat4 clip_from_surface(const Surface& s, const ViewState& v) {
  // A ghost that hardly leaves its body stays behind it, wires lie on top: both without a fight for the nearer depth.
  glm::dmat4 place = v.frame->view * s.pose;
  // A layer is a fiftieth of a millimetre at a metre: beyond what depths are rounded by, far below a pixel. What is seen through solids is
  // not hidden by itself, whoever worked out its depth.
  const double pull = (v.hidden ? 1e-5 : !v.ghost ? 0.0 : s.wires ? 1e-3 : -2e-4) + 2e-5 * s.layer;
  if (v.frame->orthographic) place[3].z += pull * (v.frame->far - v.frame->near);
  else place = glm::scale(glm::dmat4(1.0), glm::dvec3(1.0 - pull)) * place;
  return v.frame->clip * place;
}

Facing facing_of(const Surface& s) {
  if (s.two_sided) return Facing::any;
  return glm::determinant(glm::dmat3(s.pose)) < 0.0 ? Facing::clockwise : Facing::counterclockwise;
}

int mark_of(std::size_t index) { return static_cast<int>(1 + index % 254); }

// An offset into the bound buffer, which OpenGL takes as a pointer.
const void* offset_pointer(std::size_t offset) {
  return reinterpret_cast<const void*>(offset);  // NOLINT(performance-no-int-to-ptr): never followed
}

std::vector<std::uint32_t> color_steps_of(const ScalarMap& asked, int bits) {
  ScalarMap map = asked;
  map.levels = 0;  // flat bands are the shader's
  const auto packed = [bits](const glm::vec3& linear) {
    const glm::uvec3 root(glm::round(static_cast<float>((1 << bits) - 1) * glm::sqrt(linear)));
    return root.x | root.y << bits | root.z << 2 * bits;
  };
  std::vector<std::uint32_t> steps;
  steps.reserve(color_steps + 1);
  for (int i = 0; i < color_steps; ++i) steps.push_back(packed(linear_from_srgb(map_color(map, i / (color_steps - 1.0)))));
  steps.push_back(packed(glm::vec3(0.21f)));
  return steps;
}

void Painter::begin_opaque(const ViewState& v) {
  continue_opaque(v);
  const Gl& gl = device_.gl();
  gl.ClearDepth(0.0);
  gl.ClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

void Painter::continue_opaque(const ViewState& v) {
  const Gl& gl = device_.gl();
  gl.Viewport(-v.x, -v.y, static_cast<GLsizei>(v.samples.x), static_cast<GLsizei>(v.samples.y));
  gl.Disable(GL_SCISSOR_TEST);
  gl.Disable(GL_BLEND);
  gl.Enable(GL_DEPTH_TEST);
  gl.DepthFunc(GL_GREATER);
  gl.DepthMask(GL_TRUE);
}

PaintOrder order_opaque(const Picture& p, const Content& d, const ViewFrame& frame) {
  PaintOrder order;
  std::vector<double> distance(d.surfaces.size(), 0.0);
  for (std::size_t i = 0; i < d.surfaces.size(); ++i)
    if (d.surfaces[i].opacity >= 1.0f && !d.boxes[i].empty()) {
      order.all.push_back(i);
      distance[i] = -(frame.view * d.surfaces[i].pose * glm::dvec4(d.boxes[i].centre(), 1.0)).z;
    }
  std::stable_sort(order.all.begin(), order.all.end(), [&](std::size_t a, std::size_t b) { return distance[a] < distance[b]; });
  for (const std::size_t i : order.all) {
    const Surface& s = d.surfaces[i];
    const bool lined = s.edges || (p.cut && s.cut) || (p.scalar_map.isolines > 1 && !s.scalars.empty());
    (lined ? order.lined : order.plain).push_back(i);
  }
  return order;
}

void Painter::draw_opaque(const Picture& p, const Content& d, const ViewState& v) {
  const PaintOrder order = order_opaque(p, d, *v.frame);
  std::size_t triangles = 0;
  for (const std::size_t i : order.plain) triangles += d.surfaces[i].triangles.size();
  if (!v.target || triangles < kept_from || d.surfaces.size() > most_kept) {
    draw_surfaces(p, d, order.all, v);
    return;
  }
  const Gl& gl = device_.gl();
  device_.add_store(*v.target);
  gl.BindFramebuffer(GL_FRAMEBUFFER, v.target->store_framebuffer);
  for (const std::size_t i : order.plain) draw_surface(d.surfaces[i], p, v, mark_of(i), true);
  gl.BindFramebuffer(GL_FRAMEBUFFER, v.target->framebuffer);
  light_kept(p, d, order.plain, v);
  draw_surfaces(p, d, order.lined, v);
}

void Painter::draw_surfaces(const Picture& p, const Content& d, const std::vector<std::size_t>& which, const ViewState& v) {
  for (const std::size_t i : which) draw_surface(d.surfaces[i], p, v, mark_of(i));
}

// One pass a material, over the rectangle of its surfaces; samples where nothing is drawn fail the depth test.
void Painter::light_kept(const Picture& p, const Content& d, const std::vector<std::size_t>& kept, const ViewState& v) {
  struct Group {
    const Surface* first = nullptr;
    PixelRect part;
    std::array<std::uint32_t, 8> members{};
  };
  const auto alike = [](const Surface& a, const Surface& b) {
    return a.material.roughness == b.material.roughness && a.material.metallic == b.material.metallic &&
           a.scalars.empty() == b.scalars.empty();
  };
  std::vector<Group> groups;
  for (const std::size_t i : kept) {
    const Surface& s = d.surfaces[i];
    auto group = std::find_if(groups.begin(), groups.end(), [&](const Group& g) { return alike(*g.first, s); });
    if (group == groups.end()) group = groups.insert(group, Group{&s, {}, {}});
    group->part = joined(group->part, covered(d.boxes[i], s.pose, *v.frame, v.per_pixel, 2.0));
    const auto mark = static_cast<std::uint32_t>(mark_of(i));
    group->members[mark >> 5] |= 1u << (mark & 31u);
  }
  const Gl& gl = device_.gl();
  gl.DepthFunc(GL_LESS);
  gl.DepthMask(GL_FALSE);
  gl.Disable(GL_CULL_FACE);
  gl.Enable(GL_SCISSOR_TEST);
  gl.Viewport(0, 0, v.target->width, v.target->height);
  no_attributes();
  for (const Group& g : groups) {
    std::vector<const char*> switches = {"STORED"};
    if (p.lighting.studio) switches.push_back("STUDIO");
    if (is_matt(*g.first, p.lighting)) switches.push_back("MATT");
    if (g.first->material.metallic > 0.0f && g.first->scalars.empty()) switches.push_back("METAL");
    if (v.light) switches.push_back("SHADOW");
    if (groups.size() > 1) switches.push_back("MEMBERS");
    Program& program = device_.program(ShaderKind::cover, switches);
    program.use();
    set_view(program, p, *g.first, v);
    program.set("members", std::span<const std::uint32_t>(g.members));
    program.set("geometry", 1);
    program.set("depths", 2);
    const double near = v.frame->near, far = v.frame->far, step = v.frame->pixel / v.per_pixel;
    const bool flat = v.frame->orthographic;
    program.set("planes", flat ? glm::vec4(far, near - far, 0.0, 1.0) : glm::vec4(near * far, 0.0, far - near, near));
    program.set("place", glm::vec4(step, step, step * (v.x - 0.5 * static_cast<double>(v.samples.x)),
                                   step * (v.y - 0.5 * static_cast<double>(v.samples.y))));
    program.set("orthographic", flat ? 1.0f : 0.0f);
    gl.ActiveTexture(GL_TEXTURE1);
    gl.BindTexture(GL_TEXTURE_2D, v.target->store);
    gl.ActiveTexture(GL_TEXTURE2);
    gl.BindTexture(GL_TEXTURE_2D, v.target->depth);
    gl.ActiveTexture(GL_TEXTURE0);
    gl.Scissor(g.part.x - v.x, g.part.y - v.y, g.part.width, g.part.height);
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
  }
  gl.Disable(GL_SCISSOR_TEST);
  gl.DepthFunc(GL_GREATER);
  gl.DepthMask(GL_TRUE);
  gl.Viewport(-v.x, -v.y, static_cast<GLsizei>(v.samples.x), static_cast<GLsizei>(v.samples.y));
}

// What lighting needs to know of the view and of the material.
void Painter::set_view(Program& program, const Picture& p, const Surface& s, const ViewState& v) {
  const Gl& gl = device_.gl();
  program.set("to_light", v.to_light);
  program.set("up", v.up);
  const ViewTerms terms = view_terms(p, s, v);
  program.set("side", terms.side);
  program.set("falloff", terms.falloff);
  program.set("ray", terms.ray);
  set_material(program, material_terms(s, p.lighting, p.scalar_map.colormap));
  if (!v.light || v.ghost) return;
  const glm::dmat4 light_from_view = v.light->map_from_world * glm::inverse(v.frame->view);
  program.set("light_from_view", glm::mat4(light_from_view));
  program.set("light_turn", glm::mat3(glm::dmat3(light_from_view)));
  program.set("shadow_reach", static_cast<float>(v.shadow_reach));
  program.set("shadow_warp", shadow_warp);
  program.set("shadow_part", v.shadow_part);
  program.set("shadow", 0);
  gl.ActiveTexture(GL_TEXTURE0);
  gl.BindTexture(GL_TEXTURE_2D, v.shadow);
}

void Painter::draw_hidden(const Picture& p, const Content& d, const ViewState& view) {
  const Gl& gl = device_.gl();
  ViewState v = view;
  v.hidden = true;
  v.light = nullptr;  // a shadow there would be one of what hides it
  const auto opacity = [&](float share) { gl.BlendColor(0.0f, 0.0f, 0.0f, share); };
  gl.DepthFunc(GL_LESS);
  gl.DepthMask(GL_FALSE);
  gl.Enable(GL_BLEND);
  // The mark of what hides it stays: light and outlines are those of that surface.
  gl.BlendFuncSeparate(GL_CONSTANT_ALPHA, GL_ONE_MINUS_CONSTANT_ALPHA, GL_ZERO, GL_ONE);
  for (std::size_t i = 0; i < d.surfaces.size(); ++i)
    if (const Surface& s = d.surfaces[i]; s.seen_through > 0.0f && s.opacity >= 1.0f && !d.boxes[i].empty()) {
      opacity(s.seen_through);
      draw_surface(s, p, v, mark_of(i));
    }
  for (const Lines& l : p.lines)
    if (l.seen_through > 0.0f && !l.on_top && !translucent(l)) {
      opacity(l.seen_through);
      draw_lines(l, v);
    }
  for (const Markers& m : p.markers)
    if (m.seen_through > 0.0f && !m.on_top && m.color.a >= 1.0f) {
      opacity(m.seen_through);
      draw_markers(m, v);
    }
  gl.Disable(GL_BLEND);
  gl.DepthMask(GL_TRUE);
  gl.DepthFunc(GL_GREATER);
}

void Painter::draw_symbols(const Picture& p, const ViewState& v) {
  const Gl& gl = device_.gl();
  for (const bool on_top : {false, true}) {
    if (on_top) gl.Disable(GL_DEPTH_TEST);
    for (const Lines& l : p.lines)
      if (l.on_top == on_top && !translucent(l)) draw_lines(l, v);
    for (const Markers& m : p.markers)
      if (m.on_top == on_top && m.color.a >= 1.0f) draw_markers(m, v);
  }
  gl.Enable(GL_DEPTH_TEST);
}

void Painter::attribute(GLuint index, GLint components, GLuint buffer, std::size_t offset, GLuint divisor) {
  const Gl& gl = device_.gl();
  gl.BindBuffer(GL_ARRAY_BUFFER, buffer);
  gl.EnableVertexAttribArray(index);
  gl.VertexAttribPointer(index, components, GL_FLOAT, GL_FALSE, 0, offset_pointer(offset));
  gl.VertexAttribDivisor(index, divisor);
}
void Painter::no_attributes() {
  for (GLuint i = 0; i < 7; ++i) {
    device_.gl().DisableVertexAttribArray(i);
    device_.gl().VertexAttribDivisor(i, 0);
  }
}

// The choice of triangles changes from view to view: nothing to keep.
void Painter::draw_triangles(std::span<const glm::uvec3> triangles) {
  const Gl& gl = device_.gl();
  device_.stream(GL_ELEMENT_ARRAY_BUFFER, triangles.data(), triangles.size_bytes());
  gl.DrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * triangles.size()), GL_UNSIGNED_INT, nullptr);
}

void Painter::draw_surface(const Surface& s, const Picture& p, const ViewState& v, int mark, bool keep) {
  const glm::dmat4 view_from_surface = v.frame->view * s.pose;
  const Facing facing = facing_of(s);
  const std::span<const glm::uvec3> triangles = visible_.select(s.positions, s.triangles, v.frame->clip * view_from_surface,
                                                                static_cast<int>(v.samples.x), static_cast<int>(v.samples.y), facing);
  if (triangles.empty()) return;
  const Gl& gl = device_.gl();
  std::vector<const char*> switches;
  if (!s.normals.empty()) switches.push_back("NORMALS");
  if (!s.scalars.empty()) switches.push_back("SCALARS");
  else if (!s.colors.empty()) switches.push_back("COLORS");
  const bool vectors = !s.scalars.empty() && !s.vectors.empty();
  if (!s.scalars.empty()) {
    if (p.scalar_map.levels > 1) switches.push_back("LEVELS");
    if (p.scalar_map.isolines > 1) switches.push_back("ISOLINES");
    if (p.scalar_map.logarithmic) switches.push_back("LOGARITHM");
    if (vectors) switches.push_back("VECTORS");
    if (vectors && !s.shears.empty()) switches.push_back("SHEARS");
  }
  if (s.material.metallic > 0.0f && s.scalars.empty()) switches.push_back("METAL");
  if (s.edges) switches.push_back("EDGES");
  const bool cut = p.cut && s.cut;
  if (cut) switches.push_back("CUT");
  if (p.lighting.studio && !keep) switches.push_back("STUDIO");
  if (is_matt(s, p.lighting) && !keep) switches.push_back("MATT");
  if (keep) switches.push_back("STORE");
  else if (v.light && !v.ghost) switches.push_back("SHADOW");
  if (v.ghost) switches.push_back("GHOST");
  if (v.ghost && s.wires) switches.push_back("WIRES");
  if (s.two_sided || s.normals.empty()) switches.push_back("TWO_SIDED");
  if (v.scalar_output) switches.push_back("SCALAR_OUTPUT");
  Program& program = device_.program(ShaderKind::surface, switches);
  program.use();
  program.set("view_from_surface", glm::mat4(view_from_surface));
  program.set("clip_from_surface", glm::mat4(clip_from_surface(s, v)));
  const double scale = std::cbrt(std::abs(glm::determinant(glm::dmat3(s.pose))));
  program.set("view_normal", glm::mat3(glm::dmat3(view_from_surface) / (scale > 0.0 ? scale : 1.0)));
  set_view(program, p, s, v);
  program.set("mark", glm::vec2(static_cast<float>(mark) / 255.0f, s.opacity));
  program.set("mark_bits", static_cast<std::uint32_t>(mark) << 24);
  if (!s.scalars.empty()) set_scalars(program, p.scalar_map, vectors, keep ? v.colors_kept : v.colors, v);
  if (s.edges) {
    program.set("edge_color", linear_from_srgb(s.edge_color));
    // Each triangle draws its half of the line.
    program.set("edge_width", static_cast<float>(std::max(0.6 * v.per_pixel, 0.6 * static_cast<double>(s.edge_width) * v.unit)));
  }
  if (cut) {
    program.set("cut_plane", cut_plane(*p.cut, s.pose));
    program.set("cut_normal", glm::vec3(glm::dmat3(v.frame->view) * glm::normalize(p.cut->normal)));
    // Where colours are values the cap has none.
    program.set("cap_color", linear_from_srgb(s.scalars.empty() && s.colors.empty() ? s.material.color : glm::vec3(0.80f)));
    program.set("hatch", static_cast<float>(1.0 / (9.0 * v.unit)));
    gl.Enable(GL_CLIP_DISTANCE0);
    gl.FrontFace(glm::determinant(glm::dmat3(s.pose)) < 0.0 ? GL_CW : GL_CCW);
  }
  // Closed meshes show only their front.
  if (facing == Facing::any) {
    gl.Disable(GL_CULL_FACE);
  } else {
    gl.Enable(GL_CULL_FACE);
    gl.CullFace(GL_BACK);
    gl.FrontFace(facing == Facing::clockwise ? GL_CW : GL_CCW);
  }

  no_attributes();
  if (s.edges) {
    exploded_.push_back(explode(s, visible_.indices()));
    const Exploded& e = exploded_.back();
    attribute(0, 3, device_.buffer(GL_ARRAY_BUFFER, std::span<const glm::vec3>(e.positions)));
    attribute(4, 3, device_.buffer(GL_ARRAY_BUFFER, std::span<const glm::vec3>(e.corners)));
    if (!e.normals.empty()) attribute(1, 3, device_.buffer(GL_ARRAY_BUFFER, std::span<const glm::vec3>(e.normals)));
    if (!e.scalars.empty()) attribute(2, 1, device_.buffer(GL_ARRAY_BUFFER, std::span<const float>(e.scalars)));
    if (!e.vectors.empty()) attribute(5, 3, device_.buffer(GL_ARRAY_BUFFER, std::span<const glm::vec3>(e.vectors)));
    if (!e.shears.empty()) attribute(6, 3, device_.buffer(GL_ARRAY_BUFFER, std::span<const glm::vec3>(e.shears)));
    if (!e.colors.empty()) attribute(3, 3, device_.buffer(GL_ARRAY_BUFFER, std::span<const glm::vec3>(e.colors)));
    gl.DrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(3 * triangles.size()));
    if (cut) gl.Disable(GL_CLIP_DISTANCE0);
    return;
  }
  attribute(0, 3, device_.buffer(GL_ARRAY_BUFFER, s.positions));
  if (!s.normals.empty()) attribute(1, 3, device_.buffer(GL_ARRAY_BUFFER, s.normals));
  if (!s.scalars.empty()) attribute(2, 1, device_.buffer(GL_ARRAY_BUFFER, s.scalars));
  else if (!s.colors.empty()) attribute(3, 3, device_.buffer(GL_ARRAY_BUFFER, s.colors));
  if (vectors) attribute(5, 3, device_.buffer(GL_ARRAY_BUFFER, s.vectors));
  if (vectors && !s.shears.empty()) attribute(6, 3, device_.buffer(GL_ARRAY_BUFFER, s.shears));
  draw_triangles(triangles);
  if (cut) gl.Disable(GL_CLIP_DISTANCE0);
}

// What lines and markers share; width on the picture, at least `least` pixels.
Program& Painter::symbol_program(ShaderKind kind, const glm::dmat4& pose, double least, double width, const ViewState& v, bool cut) {
  std::vector<const char*> switches;
  if (v.ghost) switches.push_back("GHOST");
  if (v.hidden && kind == ShaderKind::line) switches.push_back("BUTT");
  if (cut) switches.push_back("CUT");
  Program& program = device_.program(kind, switches);
  program.use();
  program.set("view_from_surface", glm::mat4(v.frame->view * pose));
  program.set("clip_from_view", glm::mat4(v.frame->clip));
  program.set("viewport", v.samples);
  program.set("half_width", static_cast<float>(0.5 * std::max(least * v.per_pixel, width * v.unit)));
  program.set("orthographic", v.frame->orthographic ? 1.0f : 0.0f);
  program.set("mark", glm::vec2(1.0f, 1.0f));
  device_.gl().Disable(GL_CULL_FACE);
  no_attributes();
  return program;
}

std::vector<glm::vec3> Painter::facing_pairs(const Lines& l, const ViewFrame& frame, std::vector<glm::vec4>& colors) {
  const glm::dmat4 from_view = glm::inverse(frame.view * l.pose);
  const glm::vec3 eye(from_view * glm::dvec4(0.0, 0.0, 0.0, 1.0)), back(from_view * glm::dvec4(0.0, 0.0, 1.0, 0.0));
  std::vector<glm::vec3> points;
  for (std::size_t i = 0; i + 1 < l.points.size(); i += 2) {
    const glm::vec3 to_viewer = frame.orthographic ? back : eye - l.points[i];
    if (glm::dot(l.faces[i], to_viewer) < 0.0f && glm::dot(l.faces[i + 1], to_viewer) < 0.0f) continue;
    for (const std::size_t k : {i, i + 1}) {
      points.push_back(l.points[k]);
      colors.push_back(l.colors.size() == l.points.size() ? l.colors[k] : l.color);
    }
  }
  return points;
}

void Painter::draw_lines(const Lines& l, const ViewState& v) {
  if (l.points.size() < 2 || !all_finite(l.points)) return;
  const bool chosen = !l.strip && l.faces.size() == l.points.size();
  line_colors_.emplace_back();
  if (chosen) line_points_.push_back(facing_pairs(l, *v.frame, line_colors_.back()));
  const std::vector<glm::vec3>& all = chosen ? line_points_.back() : l.points;
  if (all.size() < 2) return;
  const Gl& gl = device_.gl();
  Program& program = symbol_program(ShaderKind::line, l.pose, 1.0, static_cast<double>(l.width), v, l.cut && v.cut);
  if (l.cut && v.cut) program.set("cut_plane", cut_plane(*v.cut, l.pose));
  program.set("near", static_cast<float>(v.frame->orthographic ? -1e30 : v.frame->near));
  program.set("pull", static_cast<float>(v.frame->orthographic ? 1e-3 * (v.frame->far - v.frame->near) : 1e-3));
  program.set("origin", glm::vec2(-v.x, -v.y));
  if (!chosen) line_colors_.back() = l.colors.size() == all.size() ? l.colors : std::vector<glm::vec4>(all.size(), l.color);
  const GLuint points = device_.buffer(GL_ARRAY_BUFFER, std::span<const glm::vec3>(all));
  const GLuint colors = device_.buffer(GL_ARRAY_BUFFER, std::span<const glm::vec4>(line_colors_.back()));
  if (l.strip) {
    attribute(0, 3, points, 0, 1);
    attribute(1, 3, points, sizeof(glm::vec3), 1);
    attribute(2, 4, colors, 0, 1);
    attribute(3, 4, colors, sizeof(glm::vec4), 1);
    gl.DrawArraysInstanced(GL_TRIANGLES, 0, 6, static_cast<GLsizei>(all.size() - 1));
  } else {
    const auto pair = [&](GLuint index, GLint components, GLuint buffer, std::size_t size, std::size_t offset) {
      gl.BindBuffer(GL_ARRAY_BUFFER, buffer);
      gl.EnableVertexAttribArray(index);
      gl.VertexAttribPointer(index, components, GL_FLOAT, GL_FALSE, static_cast<GLsizei>(2 * size), offset_pointer(offset));
      gl.VertexAttribDivisor(index, 1);
    };
    pair(0, 3, points, sizeof(glm::vec3), 0);
    pair(1, 3, points, sizeof(glm::vec3), sizeof(glm::vec3));
    pair(2, 4, colors, sizeof(glm::vec4), 0);
    pair(3, 4, colors, sizeof(glm::vec4), sizeof(glm::vec4));
    gl.DrawArraysInstanced(GL_TRIANGLES, 0, 6, static_cast<GLsizei>(all.size() / 2));
  }
}

void Painter::draw_markers(const Markers& m, const ViewState& v) {
  if (m.points.empty() || !all_finite(m.points)) return;
  const Gl& gl = device_.gl();
  Program& program = symbol_program(ShaderKind::marker, m.pose, 2.0, static_cast<double>(m.diameter), v, false);
  program.set("near", static_cast<float>(v.frame->near));
  program.set("pixel", static_cast<float>(v.frame->pixel / v.per_pixel));
  program.set("color", glm::vec4(linear_from_srgb(glm::vec3(m.color)), m.color.a));
  program.set("shape", static_cast<int>(m.shape));
  attribute(0, 3, device_.buffer(GL_ARRAY_BUFFER, std::span<const glm::vec3>(m.points)), 0, 1);
  gl.DrawArraysInstanced(GL_TRIANGLES, 0, 6, static_cast<GLsizei>(m.points.size()));
}

Painter::Exploded Painter::explode(const Surface& s, std::span<const std::uint32_t> triangles) {
  Exploded e;
  const std::size_t n = 3 * triangles.size();
  e.positions.reserve(n);
  e.corners.reserve(n);
  for (const std::uint32_t i : triangles)
    for (int k = 0; k < 3; ++k) {
      const unsigned v = s.triangles[i][k];
      e.positions.push_back(s.positions[v]);
      glm::vec3 corner(0.0f);
      corner[k] = 1.0f;
      e.corners.push_back(corner);
      if (!s.normals.empty()) e.normals.push_back(s.normals[v]);
      if (!s.scalars.empty()) e.scalars.push_back(s.scalars[v]);
      else if (!s.colors.empty()) e.colors.push_back(s.colors[v]);
      if (!s.scalars.empty() && !s.vectors.empty()) e.vectors.push_back(s.vectors[v]);
      if (!s.scalars.empty() && !s.vectors.empty() && !s.shears.empty()) e.shears.push_back(s.shears[v]);
    }
  if (!s.edge_flags.empty())
    for (std::size_t i = 0; i < triangles.size(); ++i)
      for (int edge = 0; edge < 3; ++edge)
        if (!(s.edge_flags[triangles[i]] >> edge & 1))
          // Edge e runs from corner e to the next: its distance is the coordinate of the third corner.
          for (int k = 0; k < 3; ++k) e.corners[3 * i + k][(edge + 2) % 3] = 1.0f;
  return e;
}

void Painter::forget() {
  device_.forget_buffers();
  exploded_.clear();
  line_colors_.clear();
  line_points_.clear();
}

}  // namespace flexframe::render
