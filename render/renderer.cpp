// One picture: bounds, shadow map, opaque surfaces, translucent shells, read-back, occlusion, resolve, overlay.
#include "render/renderer.h"

#include "render/backdrop.h"
#include "render/camera.h"
#include "render/device.h"
#include "render/occlusion.h"
#include "render/overlay.h"
#include "render/resolve.h"
#include "render/shadow.h"
#include "render/shapes.h"
#include "render/srgb.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <numeric>
#include <stdexcept>

namespace flexframe::render {
namespace {

double cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

std::string cpu_features() {
  std::string text;
#if defined(__x86_64__) || defined(__i386__)
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512f")) text += " avx512f";
  if (__builtin_cpu_supports("avx2")) text += " avx2";
  if (__builtin_cpu_supports("fma")) text += " fma";
  if (__builtin_cpu_supports("avx")) text += " avx";
  if (__builtin_cpu_supports("sse4.1")) text += " sse4.1";
#endif
  return text.empty() ? "baseline" : text.substr(1);
}

bool all_finite(std::span<const glm::vec3> values) {
  // Zero times anything but a number is not zero.
  float sum = 0.0f;
  for (const glm::vec3& v : values) sum += v.x * 0.0f + v.y * 0.0f + v.z * 0.0f;
  return sum == 0.0f;
}

Bounds box_of(std::span<const glm::vec3> positions) {
  glm::vec3 lower(3e38f), upper(-3e38f);
  for (const glm::vec3& p : positions) {
    lower = glm::min(lower, p);
    upper = glm::max(upper, p);
  }
  Bounds b;
  if (!positions.empty()) b.add(glm::dvec3(lower)), b.add(glm::dvec3(upper));
  return b;
}

Bounds posed(const Bounds& b, const glm::dmat4& pose) {
  Bounds out;
  if (b.empty()) return out;
  for (int i = 0; i < 8; ++i)
    out.add(glm::dvec3(pose * glm::dvec4(i & 1 ? b.upper.x : b.lower.x, i & 2 ? b.upper.y : b.lower.y, i & 4 ? b.upper.z : b.lower.z, 1.0)));
  return out;
}

// What is drawn, arrows and triads turned into surfaces, with the bounds of each.
struct Drawn {
  std::vector<Surface> surfaces;
  std::vector<Bounds> bounds;      // world, one a surface
  std::vector<Shape> shapes;       // memory of arrows
  Bounds all;                      // with lines, markers and Picture::bounds
  Bounds casters;
};

void check_picture(const Picture& p) {
  const auto refuse = [](const std::string& what) { throw std::invalid_argument(what); };
  if (p.size.width < 16 || p.size.height < 16 || p.size.width > 16384 || p.size.height > 16384)
    refuse(fmt::format("picture of {} x {} pixels; 16 to 16384 are allowed", p.size.width, p.size.height));
  if (p.look.samples != 1 && p.look.samples != 4 && p.look.samples != 9 && p.look.samples != 16)
    refuse(fmt::format("{} antialiasing samples; 1, 4, 9 and 16 are allowed", p.look.samples));
  const int n = static_cast<int>(std::lround(std::sqrt(p.look.samples)));
  if (std::max(p.size.width, p.size.height) * n > 16384)
    refuse(fmt::format("picture of {} x {} pixels with {} samples; pixels times samples along a side must not exceed 16384", p.size.width, p.size.height, p.look.samples));
  const auto check_camera = [&](const Camera& c) {
    const double numbers[] = {c.position.x, c.position.y, c.position.z, c.target.x, c.target.y, c.target.z, c.up.x, c.up.y, c.up.z, c.fov, c.height};
    for (const double v : numbers)
      if (!std::isfinite(v)) refuse("camera with a number that is not finite");
    if (c.projection == Projection::perspective && !(c.fov > 0.0 && c.fov < 180.0)) refuse(fmt::format("camera with a field of view of {} degrees; it must lie between 0 and 180", c.fov));
    if (c.projection == Projection::orthographic && !(c.height > 0.0)) refuse(fmt::format("orthographic camera of height {} m; it must be positive", c.height));
    if (!(glm::length(c.target - c.position) > 0.0)) refuse("camera whose position and target coincide");
    if (!(glm::length(c.up) > 0.0)) refuse("camera whose up vector is zero");
  };
  if (p.views.empty()) check_camera(p.camera);
  for (const View& v : p.views) check_camera(v.camera);
  for (std::size_t i = 0; i < p.surfaces.size(); ++i) {
    const Surface& s = p.surfaces[i];
    const auto name = [&] { return fmt::format("surface {} of the picture: ", i); };
    const auto same = [&](std::size_t n_values, const char* what) {
      if (n_values != 0 && n_values != s.positions.size()) refuse(name() + fmt::format("{} {} for {} positions", n_values, what, s.positions.size()));
    };
    same(s.normals.size(), "normals");
    same(s.scalars.size(), "scalars");
    same(s.colors.size(), "colours");
    unsigned largest = 0;
    for (const glm::uvec3& t : s.triangles) largest = std::max({largest, t.x, t.y, t.z});
    if (!s.triangles.empty() && largest >= s.positions.size()) refuse(name() + fmt::format("triangle with position {} of {}", largest, s.positions.size()));
    if (!all_finite(s.positions)) {
      std::size_t k = 0;
      while (all_finite(s.positions.subspan(k, 1))) ++k;
      refuse(name() + fmt::format("position {} is not finite", k));
    }
    for (int c = 0; c < 4; ++c)
      for (int r = 0; r < 4; ++r)
        if (!std::isfinite(s.pose[c][r])) refuse(name() + "pose that is not finite");
  }
}

}  // namespace

Backend backend_from_name(const std::string& name) {
  if (name == "osmesa") return Backend::osmesa;
  if (name == "egl") return Backend::egl;
  throw std::invalid_argument("no renderer '" + name + "'; there are osmesa, egl");
}

void tune_process() {
  // Large buffers come from the heap and stay there: no fresh pages for each picture.
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  mallopt(M_TOP_PAD, 64 << 20);
}

struct Renderer::Impl {
  Device device;
  RendererInfo info;
  DrawTimes times;

  // Backdrop of the last picture: a sequence with a still camera paints it once.
  struct BackdropKey {
    Size size;
    glm::vec3 top{0.0f}, bottom{0.0f}, line{0.0f};
    bool transparent = false, ground = false;
    std::vector<PixelRect> areas;
    std::vector<glm::dmat3> homographies;
    double spacing = 0.0, fade = 0.0, unit = 0.0;
    bool operator==(const BackdropKey&) const = default;
  } backdrop_key;
  Image backdrop;

  explicit Impl(std::unique_ptr<Context> context) : device(std::move(context)) {}

  // Shared by all surfaces of one view.
  struct ViewState {
    const ViewFrame* frame = nullptr;
    int per_pixel = 1;
    glm::vec2 samples{0.0f};              // of the view
    int x = 0, y = 0;                     // first sample drawn, from the lower left of the view
    glm::vec3 to_light{0.0f}, up{0.0f};   // camera frame
    const LightFrame* light = nullptr;    // null: no shadow
    double shadow_reach = 0.0;            // m, half width of the shadow's filter
    GLuint shadow = 0, colors = 0;
    double unit = 1.0;                    // samples of one pixel at 720 lines
    bool ghost = false;
    bool scalar_output = false;
  };

  Drawn prepare(const Picture& p) {
    check_picture(p);
    Drawn d;
    d.surfaces = p.surfaces;
    for (const Surface& s : d.surfaces) d.bounds.push_back(posed(box_of(s.positions), s.pose));
    d.shapes.reserve(p.arrows.size() + 1);
    const auto add_shape = [&](const Shape& shape, const glm::dmat4& pose, const glm::vec3& color, float opacity) {
      Surface s;
      s.positions = shape.positions;
      s.normals = shape.normals;
      s.triangles = shape.triangles;
      s.pose = pose;
      s.material = {color, 0.5f, 0.0f};
      s.opacity = opacity;
      s.two_sided = false;
      d.surfaces.push_back(s);
      d.bounds.push_back(posed(box_of(shape.positions), pose));
    };
    // Along +x to the direction of the arrow.
    const auto turned = [](const glm::dvec3& from, const glm::dvec3& direction) {
      const glm::dvec3 x = glm::normalize(direction);
      const glm::dvec3 z = glm::normalize(glm::cross(x, std::abs(x.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1)));
      glm::dmat4 pose(1.0);
      pose[0] = glm::dvec4(x, 0.0);
      pose[1] = glm::dvec4(glm::cross(z, x), 0.0);
      pose[2] = glm::dvec4(z, 0.0);
      pose[3] = glm::dvec4(from, 1.0);
      return pose;
    };
    for (const Arrow& a : p.arrows) {
      const double length = glm::length(a.to - a.from);
      if (!(length > 0.0) || !std::isfinite(length)) continue;
      d.shapes.push_back(make_arrow(length, a.radius));
      add_shape(d.shapes.back(), turned(a.from, a.to - a.from), a.color, a.opacity);
    }
    if (!p.triads.empty()) d.shapes.push_back(make_arrow(1.0, 0.028));
    static const glm::vec3 axis_color[3] = {{0.82f, 0.20f, 0.17f}, {0.18f, 0.58f, 0.24f}, {0.16f, 0.37f, 0.80f}};
    for (const Triad& t : p.triads)
      for (int k = 0; k < 3; ++k) {
        glm::dvec3 e(0.0);
        e[k] = 1.0;
        glm::dmat4 scale(t.length);
        scale[3][3] = 1.0;
        add_shape(d.shapes.back(), t.pose * turned(glm::dvec3(0.0), e) * scale, axis_color[k], 1.0f);
      }

    for (std::size_t i = 0; i < d.surfaces.size(); ++i) {
      d.all.add(d.bounds[i]);
      if (d.surfaces[i].casts_shadow && d.surfaces[i].opacity >= 1.0f) d.casters.add(d.bounds[i]);
    }
    for (const Lines& l : p.lines) d.all.add(compute_bounds(l.points, l.pose));
    for (const Markers& m : p.markers) d.all.add(compute_bounds(m.points, m.pose));
    return d;
  }

  void attribute(GLuint index, GLint components, GLuint buffer, std::size_t offset = 0, GLuint divisor = 0) {
    const Gl& gl = device.gl();
    gl.BindBuffer(GL_ARRAY_BUFFER, buffer);
    gl.EnableVertexAttribArray(index);
    gl.VertexAttribPointer(index, components, GL_FLOAT, GL_FALSE, 0, reinterpret_cast<const void*>(offset));
    gl.VertexAttribDivisor(index, divisor);
  }
  void no_attributes() {
    for (GLuint i = 0; i < 5; ++i) {
      device.gl().DisableVertexAttribArray(i);
      device.gl().VertexAttribDivisor(i, 0);
    }
  }

  // Corners of all triangles one by one, with the distance coordinates that edges need.
  struct Exploded {
    std::vector<glm::vec3> positions, normals, colors, corners;
    std::vector<float> scalars;
  };
  static Exploded explode(const Surface& s) {
    Exploded e;
    const std::size_t n = 3 * s.triangles.size();
    e.positions.reserve(n);
    e.corners.reserve(n);
    for (const glm::uvec3& t : s.triangles)
      for (int k = 0; k < 3; ++k) {
        const unsigned v = t[k];
        e.positions.push_back(s.positions[v]);
        glm::vec3 corner(0.0f);
        corner[k] = 1.0f;
        e.corners.push_back(corner);
        if (!s.normals.empty()) e.normals.push_back(s.normals[v]);
        if (!s.scalars.empty()) e.scalars.push_back(s.scalars[v]);
        else if (!s.colors.empty()) e.colors.push_back(s.colors[v]);
      }
    if (!s.edge_flags.empty())
      for (std::size_t i = 0; i < s.triangles.size(); ++i)
        for (int edge = 0; edge < 3; ++edge)
          if (!(s.edge_flags[i] >> edge & 1))
            // Edge e runs from corner e to the next: its distance is the coordinate of the third corner.
            for (int k = 0; k < 3; ++k) e.corners[3 * i + k][(edge + 2) % 3] = 1.0f;
    return e;
  }

  void draw_depth_only(const Surface& s, const glm::mat4& clip_from_surface) {
    const Gl& gl = device.gl();
    Program& program = device.program(ShaderKind::surface, {"DEPTH_ONLY"});
    program.use();
    program.set("view_from_surface", glm::mat4(1.0f));
    program.set("clip_from_view", clip_from_surface);
    no_attributes();
    attribute(0, 3, device.buffer(GL_ARRAY_BUFFER, s.positions));
    device.buffer(GL_ELEMENT_ARRAY_BUFFER, s.triangles);
    gl.DrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * s.triangles.size()), GL_UNSIGNED_INT, nullptr);
  }

  void draw_surface(const Surface& s, const Picture& p, const ViewState& v, float mark) {
    if (s.triangles.empty()) return;
    const Gl& gl = device.gl();
    std::vector<const char*> switches;
    if (!s.normals.empty()) switches.push_back("NORMALS");
    if (!s.scalars.empty()) switches.push_back("SCALARS");
    else if (!s.colors.empty()) switches.push_back("COLORS");
    if (s.edges) switches.push_back("EDGES");
    if (v.light && !v.ghost) switches.push_back("SHADOW");
    if (v.ghost) switches.push_back("GHOST");
    if (s.two_sided || s.normals.empty()) switches.push_back("TWO_SIDED");
    if (v.scalar_output) switches.push_back("SCALAR_OUTPUT");
    Program& program = device.program(ShaderKind::surface, switches);
    program.use();
    const glm::dmat4 view_from_surface = v.frame->view * s.pose;
    program.set("view_from_surface", glm::mat4(view_from_surface));
    program.set("clip_from_view", glm::mat4(v.frame->clip));
    const double scale = std::cbrt(std::abs(glm::determinant(glm::dmat3(s.pose))));
    program.set("view_normal", glm::mat3(glm::dmat3(view_from_surface) / (scale > 0.0 ? scale : 1.0)));
    program.set("to_light", v.to_light);
    program.set("up", v.up);
    program.set("strength", glm::vec3(p.lighting.key, p.lighting.ambient, 0.0f));
    // Towards the viewer, from a sample: minus the ray through it, for a perspective camera.
    const double step = v.frame->orthographic ? 0.0 : v.frame->pixel / v.per_pixel;
    program.set("ray", glm::vec4(-step, -step, step * (0.5 * static_cast<double>(v.samples.x) - v.x), step * (0.5 * static_cast<double>(v.samples.y) - v.y)));
    program.set("base_color", linear_from_srgb(glm::clamp(s.material.color, 0.0f, 1.0f)));
    program.set("surface", glm::vec3(std::clamp(s.material.roughness, 0.08f, 1.0f), std::clamp(s.material.metallic, 0.0f, 1.0f), s.scalars.empty() ? 1.0f : 0.55f));
    program.set("mark", glm::vec2(mark, s.opacity));
    if (!s.scalars.empty()) {
      const double range = p.scalar_map.upper - p.scalar_map.lower, slope = range != 0.0 ? 1.0 / range : 0.0;
      program.set("scalar_scale", glm::vec2(static_cast<float>(slope), static_cast<float>(range != 0.0 ? -p.scalar_map.lower * slope : 0.5)));
      program.set("levels", static_cast<float>(p.scalar_map.levels));
      program.set("colors", 0);
      gl.ActiveTexture(GL_TEXTURE0);
      gl.BindTexture(GL_TEXTURE_2D, v.colors);
    }
    if (v.light && !v.ghost) {
      const glm::dmat4 light_from_view = v.light->map_from_world * glm::inverse(v.frame->view);
      program.set("light_from_view", glm::mat4(light_from_view));
      program.set("light_turn", glm::mat3(glm::dmat3(light_from_view)));
      program.set("shadow_reach", static_cast<float>(v.shadow_reach));
      program.set("shadow_warp", shadow_warp);
      program.set("shadow", 1);
      gl.ActiveTexture(GL_TEXTURE1);
      gl.BindTexture(GL_TEXTURE_2D, v.shadow);
    }
    if (s.edges) {
      program.set("edge_color", linear_from_srgb(s.edge_color));
      // Each triangle draws its half of the line.
      program.set("edge_width", static_cast<float>(std::max(0.6 * v.per_pixel, 0.6 * static_cast<double>(s.edge_width) * v.unit)));
    }
    // Closed meshes show only their front; a pose that mirrors turns it over.
    if (s.two_sided) {
      gl.Disable(GL_CULL_FACE);
    } else {
      gl.Enable(GL_CULL_FACE);
      gl.CullFace(GL_BACK);
      gl.FrontFace(glm::determinant(glm::dmat3(s.pose)) < 0.0 ? GL_CW : GL_CCW);
    }

    no_attributes();
    if (s.edges) {
      exploded.push_back(explode(s));
      const Exploded& e = exploded.back();
      attribute(0, 3, device.buffer(GL_ARRAY_BUFFER, std::span<const glm::vec3>(e.positions)));
      attribute(4, 3, device.buffer(GL_ARRAY_BUFFER, std::span<const glm::vec3>(e.corners)));
      if (!e.normals.empty()) attribute(1, 3, device.buffer(GL_ARRAY_BUFFER, std::span<const glm::vec3>(e.normals)));
      if (!e.scalars.empty()) attribute(2, 1, device.buffer(GL_ARRAY_BUFFER, std::span<const float>(e.scalars)));
      if (!e.colors.empty()) attribute(3, 3, device.buffer(GL_ARRAY_BUFFER, std::span<const glm::vec3>(e.colors)));
      gl.DrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(3 * s.triangles.size()));
      return;
    }
    attribute(0, 3, device.buffer(GL_ARRAY_BUFFER, s.positions));
    if (!s.normals.empty()) attribute(1, 3, device.buffer(GL_ARRAY_BUFFER, s.normals));
    if (!s.scalars.empty()) attribute(2, 1, device.buffer(GL_ARRAY_BUFFER, s.scalars));
    else if (!s.colors.empty()) attribute(3, 3, device.buffer(GL_ARRAY_BUFFER, s.colors));
    device.buffer(GL_ELEMENT_ARRAY_BUFFER, s.triangles);
    gl.DrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * s.triangles.size()), GL_UNSIGNED_INT, nullptr);
  }
  std::vector<Exploded> exploded;            // alive until the picture is done: buffers are known by their address
  std::vector<std::vector<glm::vec4>> line_colors;

  void draw_lines(const Lines& l, const ViewState& v) {
    if (l.points.size() < 2 || !all_finite(l.points)) return;
    const Gl& gl = device.gl();
    std::vector<const char*> switches;
    if (v.ghost) switches.push_back("GHOST");
    Program& program = device.program(ShaderKind::line, switches);
    program.use();
    program.set("view_from_surface", glm::mat4(v.frame->view * l.pose));
    program.set("clip_from_view", glm::mat4(v.frame->clip));
    program.set("viewport", v.samples);
    program.set("half_width", static_cast<float>(std::max(0.5 * v.per_pixel, 0.5 * static_cast<double>(l.width) * v.unit)));
    program.set("near", static_cast<float>(v.frame->orthographic ? -1e30 : v.frame->near));
    program.set("pull", static_cast<float>(v.frame->orthographic ? 1e-3 * (v.frame->far - v.frame->near) : 1e-3));
    program.set("orthographic", v.frame->orthographic ? 1.0f : 0.0f);
    program.set("origin", glm::vec2(-v.x, -v.y));
    program.set("mark", glm::vec2(1.0f, 1.0f));
    gl.Disable(GL_CULL_FACE);
    no_attributes();
    line_colors.emplace_back(l.colors.size() == l.points.size() ? l.colors : std::vector<glm::vec4>(l.points.size(), l.color));
    const GLuint points = device.buffer(GL_ARRAY_BUFFER, std::span<const glm::vec3>(l.points));
    const GLuint colors = device.buffer(GL_ARRAY_BUFFER, std::span<const glm::vec4>(line_colors.back()));
    if (l.strip) {
      attribute(0, 3, points, 0, 1);
      attribute(1, 3, points, sizeof(glm::vec3), 1);
      attribute(2, 4, colors, 0, 1);
      attribute(3, 4, colors, sizeof(glm::vec4), 1);
      gl.DrawArraysInstanced(GL_TRIANGLES, 0, 6, static_cast<GLsizei>(l.points.size() - 1));
    } else {
      const auto pair = [&](GLuint index, GLint components, GLuint buffer, std::size_t size, std::size_t offset) {
        gl.BindBuffer(GL_ARRAY_BUFFER, buffer);
        gl.EnableVertexAttribArray(index);
        gl.VertexAttribPointer(index, components, GL_FLOAT, GL_FALSE, static_cast<GLsizei>(2 * size), reinterpret_cast<const void*>(offset));
        gl.VertexAttribDivisor(index, 1);
      };
      pair(0, 3, points, sizeof(glm::vec3), 0);
      pair(1, 3, points, sizeof(glm::vec3), sizeof(glm::vec3));
      pair(2, 4, colors, sizeof(glm::vec4), 0);
      pair(3, 4, colors, sizeof(glm::vec4), sizeof(glm::vec4));
      gl.DrawArraysInstanced(GL_TRIANGLES, 0, 6, static_cast<GLsizei>(l.points.size() / 2));
    }
  }

  void draw_markers(const Markers& m, const ViewState& v) {
    if (m.points.empty() || !all_finite(m.points)) return;
    const Gl& gl = device.gl();
    std::vector<const char*> switches;
    if (v.ghost) switches.push_back("GHOST");
    Program& program = device.program(ShaderKind::marker, switches);
    program.use();
    program.set("view_from_surface", glm::mat4(v.frame->view * m.pose));
    program.set("clip_from_view", glm::mat4(v.frame->clip));
    program.set("viewport", v.samples);
    program.set("half_width", static_cast<float>(std::max(1.0 * v.per_pixel, 0.5 * static_cast<double>(m.diameter) * v.unit)));
    program.set("near", static_cast<float>(v.frame->near));
    program.set("pixel", static_cast<float>(v.frame->pixel / v.per_pixel));
    program.set("orthographic", v.frame->orthographic ? 1.0f : 0.0f);
    program.set("color", glm::vec4(linear_from_srgb(glm::vec3(m.color)), m.color.a));
    program.set("shape", static_cast<int>(m.shape));
    program.set("mark", glm::vec2(1.0f, 1.0f));
    gl.Disable(GL_CULL_FACE);
    no_attributes();
    attribute(0, 3, device.buffer(GL_ARRAY_BUFFER, std::span<const glm::vec3>(m.points)), 0, 1);
    gl.DrawArraysInstanced(GL_TRIANGLES, 0, 6, static_cast<GLsizei>(m.points.size()));
  }

  // Depth of all casters seen from the light.
  std::vector<float> draw_shadow_map(const Drawn& d, const LightFrame& light) {
    const Gl& gl = device.gl();
    device.target("shadow", shadow_size, shadow_size, false);
    gl.Viewport(0, 0, shadow_size, shadow_size);
    gl.Disable(GL_SCISSOR_TEST);
    gl.Disable(GL_CULL_FACE);
    gl.Disable(GL_BLEND);
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(GL_LESS);
    gl.DepthMask(GL_TRUE);
    gl.ClearDepth(1.0);
    gl.Clear(GL_DEPTH_BUFFER_BIT);
    glm::dmat4 clip_from_map(1.0);
    clip_from_map[0][0] = clip_from_map[1][1] = 2.0;
    clip_from_map[3] = glm::dvec4(-1.0, -1.0, 0.0, 1.0);
    for (const Surface& s : d.surfaces)
      if (s.casts_shadow && s.opacity >= 1.0f && !s.triangles.empty()) draw_depth_only(s, glm::mat4(clip_from_map * light.map_from_world * s.pose));
    std::vector<float> depth(std::size_t(shadow_size) * shadow_size);
    gl.ReadPixels(0, 0, shadow_size, shadow_size, GL_DEPTH_COMPONENT, GL_FLOAT, depth.data());
    return depth;
  }

  void begin_opaque(const ViewState& v) {
    const Gl& gl = device.gl();
    gl.Viewport(-v.x, -v.y, static_cast<GLsizei>(v.samples.x), static_cast<GLsizei>(v.samples.y));
    gl.Disable(GL_SCISSOR_TEST);
    gl.Disable(GL_BLEND);
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(GL_GREATER);
    gl.DepthMask(GL_TRUE);
    gl.ClearDepth(0.0);
    gl.ClearColor(0.0f, 0.0f, 0.0f, 0.0f);
    gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  }

  static float mark_of(std::size_t index) { return static_cast<float>(1 + index % 254) / 255.0f; }

  // Opaque surfaces, nearest first so that hidden fragments are not shaded.
  void draw_opaque(const Picture& p, const Drawn& d, const ViewState& v) {
    std::vector<std::size_t> order;
    std::vector<double> distance(d.surfaces.size(), 0.0);
    for (std::size_t i = 0; i < d.surfaces.size(); ++i)
      if (d.surfaces[i].opacity >= 1.0f && !d.bounds[i].empty()) {
        order.push_back(i);
        distance[i] = -(v.frame->view * glm::dvec4(d.bounds[i].centre(), 1.0)).z;
      }
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return distance[a] < distance[b]; });
    for (const std::size_t i : order) draw_surface(d.surfaces[i], p, v, mark_of(i));
  }

  void draw_symbols(const Picture& p, const ViewState& v) {
    const Gl& gl = device.gl();
    for (const bool on_top : {false, true}) {
      if (on_top) gl.Disable(GL_DEPTH_TEST);
      for (const Lines& l : p.lines)
        if (l.on_top == on_top && !translucent(l)) draw_lines(l, v);
      for (const Markers& m : p.markers)
        if (m.on_top == on_top && m.color.a >= 1.0f) draw_markers(m, v);
    }
    gl.Enable(GL_DEPTH_TEST);
  }

  static bool translucent(const Lines& l) {
    if (l.colors.size() != l.points.size()) return l.color.a < 1.0f;
    return std::any_of(l.colors.begin(), l.colors.end(), [](const glm::vec4& c) { return c.a < 1.0f; });
  }

  // Samples of the view that a box may cover, with a rim of `extra`; nothing if it is out of sight.
  static PixelRect covered(const Bounds& b, const ViewState& v, double extra) {
    PixelRect r;
    if (b.empty()) return r;
    const int width = static_cast<int>(v.samples.x), height = static_cast<int>(v.samples.y);
    glm::dvec2 lower(1e300), upper(-1e300);
    for (int i = 0; i < 8; ++i) {
      const glm::dvec4 q = v.frame->clip * (v.frame->view * glm::dvec4(i & 1 ? b.upper.x : b.lower.x, i & 2 ? b.upper.y : b.lower.y, i & 4 ? b.upper.z : b.lower.z, 1.0));
      if (q.w <= 0.0) return {0, 0, width, height};
      const glm::dvec2 s((0.5 + 0.5 * q.x / q.w) * width, (0.5 + 0.5 * q.y / q.w) * height);
      lower = glm::min(lower, s);
      upper = glm::max(upper, s);
    }
    const int x0 = static_cast<int>(std::clamp(std::floor(lower.x - extra), 0.0, double(width))), x1 = static_cast<int>(std::clamp(std::ceil(upper.x + extra), 0.0, double(width)));
    const int y0 = static_cast<int>(std::clamp(std::floor(lower.y - extra), 0.0, double(height))), y1 = static_cast<int>(std::clamp(std::ceil(upper.y + extra), 0.0, double(height)));
    return {x0, y0, x1 - x0, y1 - y0};
  }

  // Each translucent thing alone over the opaque depth: its nearest layer, shaded.
  std::vector<GhostLayer> draw_ghosts(const Picture& p, const Drawn& d, ViewState v, const Target& opaque) {
    const Gl& gl = device.gl();
    std::vector<std::size_t> shells;
    for (std::size_t i = 0; i < d.surfaces.size(); ++i)
      if (d.surfaces[i].opacity < 1.0f && d.surfaces[i].opacity > 0.0f && !d.surfaces[i].triangles.empty()) shells.push_back(i);
    std::vector<const Lines*> lines;
    for (const Lines& l : p.lines)
      if (translucent(l)) lines.push_back(&l);
    std::vector<const Markers*> markers;
    for (const Markers& m : p.markers)
      if (m.color.a < 1.0f) markers.push_back(&m);
    const std::size_t count = shells.size() + lines.size() + markers.size();
    std::vector<GhostLayer> layers;
    if (count == 0) return layers;

    v.ghost = true;
    Target& scratch = device.target("ghost", opaque.width, opaque.height, true);
    const auto layer = [&](const Bounds& bounds, double extra, bool on_top, auto&& draw) {
      PixelRect r = covered(bounds, v, extra + 2.0);
      r.width = std::min(r.x + r.width, v.x + scratch.width) - std::max(r.x, v.x);
      r.height = std::min(r.y + r.height, v.y + scratch.height) - std::max(r.y, v.y);
      r.x = std::max(r.x, v.x) - v.x;
      r.y = std::max(r.y, v.y) - v.y;
      if (r.width < 1 || r.height < 1) return;
      gl.BindFramebuffer(GL_READ_FRAMEBUFFER, opaque.framebuffer);
      gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, scratch.framebuffer);
      gl.Disable(GL_SCISSOR_TEST);
      if (!on_top) gl.BlitFramebuffer(r.x, r.y, r.x + r.width, r.y + r.height, r.x, r.y, r.x + r.width, r.y + r.height, GL_DEPTH_BUFFER_BIT, GL_NEAREST);
      gl.BindFramebuffer(GL_FRAMEBUFFER, scratch.framebuffer);
      gl.Viewport(-v.x, -v.y, static_cast<GLsizei>(v.samples.x), static_cast<GLsizei>(v.samples.y));
      gl.Enable(GL_SCISSOR_TEST);
      gl.Scissor(r.x, r.y, r.width, r.height);
      gl.ClearColor(0.0f, 0.0f, 0.0f, 0.0f);
      gl.ClearDepth(0.0);
      gl.Clear(GL_COLOR_BUFFER_BIT | (on_top ? GL_DEPTH_BUFFER_BIT : 0u));
      gl.Disable(GL_BLEND);
      gl.Enable(GL_DEPTH_TEST);
      gl.DepthFunc(GL_GREATER);
      draw();
      GhostLayer g{r.x, r.y, r.width, r.height, {}, {}};
      g.colors.resize(std::size_t(r.width) * r.height * 4);
      gl.ReadPixels(r.x, r.y, r.width, r.height, GL_RGBA, GL_UNSIGNED_BYTE, g.colors.data());
      if (count > 1) {
        g.depth.resize(std::size_t(r.width) * r.height);
        gl.ReadPixels(r.x, r.y, r.width, r.height, GL_DEPTH_COMPONENT, GL_FLOAT, g.depth.data());
      }
      gl.Disable(GL_SCISSOR_TEST);
      layers.push_back(std::move(g));
    };
    for (const std::size_t i : shells) layer(d.bounds[i], 0.0, false, [&] { draw_surface(d.surfaces[i], p, v, 0.0f); });
    for (const Lines* l : lines) layer(compute_bounds(l->points, l->pose), static_cast<double>(l->width) * v.unit, l->on_top, [&] { draw_lines(*l, v); });
    for (const Markers* m : markers) layer(compute_bounds(m->points, m->pose), static_cast<double>(m->diameter) * v.unit, m->on_top, [&] { draw_markers(*m, v); });
    return layers;
  }

  glm::dvec3 light_direction(const Picture& p, const Camera& camera) const {
    if (p.lighting.direction && glm::length(*p.lighting.direction) > 0.0f) return glm::normalize(glm::dvec3(*p.lighting.direction));
    // From above, left of the camera and a little behind it.
    const glm::dmat4 view = view_matrix(camera);
    const glm::dvec3 right(view[0][0], view[1][0], view[2][0]), back(view[0][2], view[1][2], view[2][2]);
    const glm::dvec3 up = p.ground ? glm::normalize(p.ground->normal) : glm::normalize(camera.up);
    glm::dvec3 level = back - glm::dot(back, up) * up;
    if (glm::length(level) < 0.1) level = glm::dvec3(view[0][1], view[1][1], view[2][1]) - glm::dot(glm::dvec3(view[0][1], view[1][1], view[2][1]), up) * up;
    return glm::normalize(1.0 * up - 0.42 * right + 0.5 * glm::normalize(level));
  }

  // The depth and colours a view needs for filtering; draws everything opaque.
  GLuint color_texture(const Picture& p) {
    const auto table = colormap_table(p.scalar_map.colormap);
    return device.texture_srgb("colormap", 256, 1, table[0].data());
  }
};

Renderer::Renderer(Backend backend) {
  impl_ = std::make_unique<Impl>(backend == Backend::osmesa ? create_osmesa_context() : create_egl_context());
  const Gl& gl = impl_->device.gl();
  const auto text = [&](GLenum name) { return std::string(reinterpret_cast<const char*>(gl.GetString(name))); };
  impl_->info = {backend == Backend::osmesa ? "osmesa" : "egl", text(GL_RENDERER), text(GL_VERSION), cpu_features()};
}

Renderer::~Renderer() {
  if (impl_) impl_->device.make_current();
}

const RendererInfo& Renderer::info() const { return impl_->info; }
const DrawTimes& Renderer::times() const { return impl_->times; }

Image Renderer::draw(const Picture& p) {
  Impl& r = *impl_;
  r.device.make_current();
  const Gl& gl = r.device.gl();
  r.times = {};
  double start = cpu_seconds();
  const auto lap = [&](double& slot) {
    const double now = cpu_seconds();
    slot += now - start;
    start = now;
  };

  const Drawn d = r.prepare(p);
  const Layout layout = make_layout(p);
  Bounds bounds = d.all;
  bounds.add(p.bounds);
  const Bounds still = p.bounds.empty() ? d.all : p.bounds;  // what ground and occlusion are measured by
  const double radius = still.empty() ? 1.0 : std::max(still.radius(), 1e-12);
  const int n = static_cast<int>(std::lround(std::sqrt(p.look.samples)));

  std::vector<ViewFrame> frames;
  std::vector<GroundFrame> grounds;
  for (std::size_t i = 0; i < layout.views.size(); ++i) {
    frames.push_back(make_view(p.views.empty() ? p.camera : p.views[i].camera, layout.views[i], bounds));
    grounds.push_back(p.ground ? make_ground(*p.ground, frames.back(), still) : GroundFrame{});
  }

  // Backdrop, kept from the last picture if nothing about it has changed.
  Impl::BackdropKey key{p.size, p.background.top, p.background.bottom, {}, p.background.transparent, p.ground.has_value(), {}, {}, 0.0, 0.0, layout.unit};
  if (p.ground) {
    key.line = p.ground->line_color;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      key.areas.push_back(frames[i].area);
      key.homographies.push_back(grounds[i].visible ? grounds[i].pixel_to_ground : glm::dmat3(0.0));
      key.spacing = grounds[i].spacing;
      key.fade = grounds[i].fade_radius;
    }
  }
  if (r.backdrop.pixels.empty() || !(key == r.backdrop_key)) {
    r.backdrop = paint_background(p);
    if (p.ground)
      for (std::size_t i = 0; i < frames.size(); ++i) paint_grid(r.backdrop, grounds[i], frames[i], *p.ground, layout.unit);
    r.backdrop_key = key;
  }
  Image image = r.backdrop;

  const GLuint colors = r.color_texture(p);
  const bool symbols = !p.lines.empty() || !p.markers.empty();
  std::vector<bool> outlined(256, false);
  bool outlines = false;
  for (std::size_t i = 0; i < d.surfaces.size(); ++i)
    if (d.surfaces[i].silhouette && d.surfaces[i].opacity >= 1.0f) outlined[1 + i % 254] = outlines = true;

  for (std::size_t i = 0; i < frames.size(); ++i) {
    const ViewFrame& frame = frames[i];
    const Camera& camera = p.views.empty() ? p.camera : p.views[i].camera;
    const glm::dvec3 to_light = r.light_direction(p, camera);

    // Shadows: one map of everything that throws one.
    Impl::ViewState v;
    LightFrame light;
    std::vector<std::uint8_t> shade;
    if (p.look.shadows && !d.casters.empty()) {
      Bounds lit = d.casters;
      lit.add(p.bounds);
      light = make_light(to_light, lit);
      const std::vector<float> depth = r.draw_shadow_map(d, light);
      const double softness = 0.018 * lit.radius();
      const std::vector<float> moments = filter_shadow(depth, light, softness);
      v.shadow = r.device.texture_rg32f("shadow", filtered_size, filtered_size, moments.data());
      v.light = &light;
      v.shadow_reach = std::max(softness, 4.0 * light.texel);
      if (grounds[i].visible) shade = ground_shadow(depth, light, grounds[i], frame, softness);
    }

    v.frame = &frame;
    v.per_pixel = n;
    v.samples = glm::vec2(frame.area.width * n, frame.area.height * n);
    v.to_light = glm::vec3(glm::dmat3(frame.view) * to_light);
    v.up = glm::vec3(glm::dmat3(frame.view) * (p.ground ? glm::normalize(p.ground->normal) : glm::normalize(camera.up)));
    v.colors = colors;
    v.unit = layout.unit * n;

    // Only the part of the view where the bounds lie is cleared, drawn, read and filtered.
    double rim = 2.0;
    for (const Lines& l : p.lines) rim = std::max(rim, std::max(static_cast<double>(n), static_cast<double>(l.width) * v.unit) + 2.0);
    for (const Markers& m : p.markers) rim = std::max(rim, std::max(2.0 * n, static_cast<double>(m.diameter) * v.unit) + 2.0);
    PixelRect used = r.covered(bounds, v, rim);
    if (used.width < 1 || used.height < 1) {
      darken_backdrop(image, frame.area, shade, {});
      continue;
    }
    const int x0 = used.x / n, y0 = used.y / n, x1 = (used.x + used.width + n - 1) / n, y1 = (used.y + used.height + n - 1) / n;
    v.x = x0 * n;
    v.y = y0 * n;
    const int width = (x1 - x0) * n, height = (y1 - y0) * n;
    const Target opaque = r.device.target("main", width, height, true);
    r.begin_opaque(v);
    r.draw_opaque(p, d, v);
    if (symbols) r.draw_symbols(p, v);
    Samples samples{{x0, frame.area.height - y1, x1 - x0, y1 - y0}, width, height, n, {}, {}};
    samples.colors.resize(std::size_t(width) * height * 4);
    gl.Finish();
    lap(r.times.draw);

    gl.BindFramebuffer(GL_FRAMEBUFFER, opaque.framebuffer);
    gl.ReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, samples.colors.data());
    lap(r.times.filter);
    std::vector<std::uint8_t> occlusion;
    if (p.look.occlusion || outlines) {
      samples.depth.resize(std::size_t(width) * height);
      gl.ReadPixels(0, 0, width, height, GL_DEPTH_COMPONENT, GL_FLOAT, samples.depth.data());
    }
    if (p.look.occlusion) occlusion = compute_occlusion(samples, frame, grounds[i].visible ? &grounds[i] : nullptr, 0.10 * radius);
    if (outlines) draw_silhouettes(samples, outlined, std::max(1, static_cast<int>(std::lround(1.1 * v.unit))));
    const std::vector<GhostLayer> ghosts = r.draw_ghosts(p, d, v, opaque);
    lap(r.times.draw);

    darken_backdrop(image, frame.area, shade, grounds[i].visible ? occlusion : std::vector<std::uint8_t>{});
    resolve(image, frame.area, samples, ghosts, occlusion);
    lap(r.times.filter);
  }
  r.device.check("a picture");
  r.device.forget_buffers();
  r.exploded.clear();
  r.line_colors.clear();

  draw_overlay(image, p, layout, frames);
  lap(r.times.overlay);
  return image;
}

Image16 Renderer::draw_depth(const Picture& p, double* near_plane, double* far_plane) {
  Impl& r = *impl_;
  r.device.make_current();
  const Drawn d = r.prepare(p);
  const Layout layout = make_layout(p);
  Bounds bounds = d.all;
  bounds.add(p.bounds);
  const PixelRect area = layout.scene;
  const ViewFrame frame = make_view(p.camera, area, bounds);
  Impl::ViewState v;
  v.frame = &frame;
  v.samples = glm::vec2(area.width, area.height);
  v.to_light = v.up = glm::vec3(0, 1, 0);
  v.colors = r.color_texture(p);
  r.device.target("depth", area.width, area.height, true);
  r.begin_opaque(v);
  r.draw_opaque(p, d, v);
  std::vector<float> depth(std::size_t(area.width) * area.height);
  r.device.gl().ReadPixels(0, 0, area.width, area.height, GL_DEPTH_COMPONENT, GL_FLOAT, depth.data());
  r.device.check("depth");
  r.device.forget_buffers();
  r.exploded.clear();

  Image16 image{p.size.width, p.size.height, 1, std::vector<std::uint16_t>(std::size_t(p.size.width) * p.size.height, 65535)};
  for (int y = 0; y < area.height; ++y)
    for (int x = 0; x < area.width; ++x) {
      const float z = depth[std::size_t(area.height - 1 - y) * area.width + x];
      if (z <= 0.0f) continue;
      const double share = (frame.distance(static_cast<double>(z)) - frame.near) / (frame.far - frame.near);
      image.pixels[std::size_t(y) * image.width + x] = static_cast<std::uint16_t>(std::lround(65534.0 * std::clamp(share, 0.0, 1.0)));
    }
  if (near_plane) *near_plane = frame.near;
  if (far_plane) *far_plane = frame.far;
  return image;
}

Image16 Renderer::draw_scalar(const Picture& p) {
  Impl& r = *impl_;
  r.device.make_current();
  const Drawn d = r.prepare(p);
  const Layout layout = make_layout(p);
  Bounds bounds = d.all;
  bounds.add(p.bounds);
  const PixelRect area = layout.scene;
  const ViewFrame frame = make_view(p.camera, area, bounds);
  Impl::ViewState v;
  v.frame = &frame;
  v.samples = glm::vec2(area.width, area.height);
  v.to_light = v.up = glm::vec3(0, 1, 0);
  v.colors = r.color_texture(p);
  v.scalar_output = true;
  r.device.target("scalar", area.width, area.height, true, true);
  r.begin_opaque(v);
  const Gl& gl = r.device.gl();
  gl.ClearColor(2.0f, 0.0f, 0.0f, 0.0f);
  gl.Clear(GL_COLOR_BUFFER_BIT);
  r.draw_opaque(p, d, v);
  std::vector<float> values(std::size_t(area.width) * area.height);
  gl.ReadPixels(0, 0, area.width, area.height, GL_RED, GL_FLOAT, values.data());
  r.device.check("scalars");
  r.device.forget_buffers();
  r.exploded.clear();

  Image16 image{p.size.width, p.size.height, 1, std::vector<std::uint16_t>(std::size_t(p.size.width) * p.size.height, 65535)};
  for (int y = 0; y < area.height; ++y)
    for (int x = 0; x < area.width; ++x) {
      const float s = values[std::size_t(area.height - 1 - y) * area.width + x];
      if (s >= 0.0f && s <= 1.0f) image.pixels[std::size_t(y) * image.width + x] = static_cast<std::uint16_t>(std::lround(65534.0f * s));
    }
  return image;
}

}  // namespace flexframe::render
