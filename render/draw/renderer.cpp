// One picture: bounds, shadow map, opaque surfaces, translucent shells, read-back, occlusion, resolve, overlay.
#include "render/draw/renderer.h"

#include "render/draw/occlusion.h"
#include "render/draw/painter.h"
#include "render/draw/resolve.h"
#include "render/draw/shading.h"
#include "render/frame/backdrop.h"
#include "render/frame/camera.h"
#include "render/frame/overlay.h"
#include "render/image/pdf_sheet.h"
#include "render/image/svg_sheet.h"
#include "sim/base/error.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <ctime>

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

// The process that started the drawing library's threads; 0: none did. A fork has none of them and would wait for them for ever.
std::atomic<pid_t> threads_of{0};

void refuse_fork() {
  const pid_t owner = threads_of.load();
  if (owner != 0 && owner != ::getpid())
    throw DrawError(
        "a process forked after its parent had made a Renderer cannot draw: the drawing library's threads do not live in it; fork before "
        "the first Renderer, or set LP_NUM_THREADS=0 before it");
}

void note_threads() {
  const char* const threads = std::getenv("LP_NUM_THREADS");
  if (!threads || std::string(threads) != "0") threads_of.store(::getpid());
}

}  // namespace

Backend backend_from_name(const std::string& name) {
  if (name == "osmesa") return Backend::osmesa;
  if (name == "egl") return Backend::egl;
  throw ArgumentError("no renderer '" + name + "'; there are osmesa, egl");
}

void tune_process() {
  // Large buffers come from the heap and stay there: no fresh pages for each picture.
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  mallopt(M_TOP_PAD, 64 << 20);
}

struct Renderer::Impl {
  Device device;
  Painter painter{device};
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
  bool grid_seen = false;     // its lines: what they are apart is told only then
  Samples samples;            // memory of the last picture's: to fill it with zeros for each would cost as much as to read them back
  CasterDepth casters;        // likewise
  Raster raster;              // likewise
  ShadowMoments moments;      // of the view that is drawn
  bool on_processor = false;  // Solids::fastest, and OpenGL is software
  PlotCache plots;

  // Colour map last used.
  std::optional<std::pair<Colormap, bool>> colormap;
  std::vector<std::uint32_t> color_steps, color_steps_kept;

  explicit Impl(std::unique_ptr<Context> context) : device(std::move(context)) {}

  // Depth of all casters seen from the light, where they are.
  ShadowMap draw_shadow_map(const Content& d, const LightFrame& light) {
    ShadowMap map = shadow_part(d.surfaces, d.boxes, light);
    if (map.width < 1 || map.height < 1) return map;
    casters.start(map);
    for (const Surface& s : d.surfaces)
      if (casts(s)) casters.add(s, light);
    casters.reduce(map);
    return map;
  }

  // Each translucent thing alone over the opaque depth: its nearest layer, shaded.
  std::vector<GhostLayer> draw_ghosts(const Picture& p, const Content& d, ViewState v, const Target& opaque) {
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
    Target& scratch = device.target("ghost", opaque.width, opaque.height, ColorFormat::bytes);
    const auto layer = [&](const Bounds& box, const glm::dmat4& pose, double extra, bool on_top, auto&& draw, bool behind = false) {
      PixelRect r = covered(box, pose, *v.frame, v.per_pixel, extra + 2.0);
      r.width = std::min(r.x + r.width, v.x + scratch.width) - std::max(r.x, v.x);
      r.height = std::min(r.y + r.height, v.y + scratch.height) - std::max(r.y, v.y);
      r.x = std::max(r.x, v.x) - v.x;
      r.y = std::max(r.y, v.y) - v.y;
      if (r.width < 1 || r.height < 1) return;
      gl.BindFramebuffer(GL_READ_FRAMEBUFFER, opaque.framebuffer);
      gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, scratch.framebuffer);
      gl.Disable(GL_SCISSOR_TEST);
      if (!on_top)
        gl.BlitFramebuffer(r.x, r.y, r.x + r.width, r.y + r.height, r.x, r.y, r.x + r.width, r.y + r.height, GL_DEPTH_BUFFER_BIT,
                           GL_NEAREST);
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
      if (behind)
        for (int y = 0; y < r.height; ++y)
          for (int x = 0; x < r.width; ++x)
            if (samples.colors[4 * (std::size_t(r.y + y) * samples.width + r.x + x) + 3] != 0)
              g.colors[4 * (std::size_t(y) * r.width + x) + 3] = 0;
      layers.push_back(std::move(g));
    };
    for (const std::size_t i : shells)
      layer(
          d.boxes[i], d.surfaces[i].pose, 0.0, false, [&] { painter.draw_surface(d.surfaces[i], p, v, 0); }, d.surfaces[i].behind);
    for (const Lines* l : lines)
      layer(compute_bounds(l->points), l->pose, static_cast<double>(l->width) * v.unit, l->on_top, [&] { painter.draw_lines(*l, v); });
    for (const Markers* m : markers)
      layer(compute_bounds(m->points), m->pose, static_cast<double>(m->diameter) * v.unit, m->on_top, [&] { painter.draw_markers(*m, v); });
    return layers;
  }

  static glm::dvec3 light_direction(const Picture& p, const Camera& camera) {
    if (p.lighting.direction && glm::length(*p.lighting.direction) > 0.0f) return glm::normalize(glm::dvec3(*p.lighting.direction));
    return default_light(camera, p.ground ? p.ground->normal : camera.up);
  }

  void set_colors(ViewState& v, const ScalarMap& map) {
    if (colormap != std::pair(map.colormap, map.lightened)) {
      colormap = {map.colormap, map.lightened};
      color_steps = color_steps_of(map, 10);
      color_steps_kept = color_steps_of(map, 8);
    }
    v.colors = color_steps;
    v.colors_kept = color_steps_kept;
  }

  // What one picture is drawn from.
  struct Drawing {
    const Picture& picture;
    const Content& content;
    const Layout& layout;
    double radius;                    // m, what occlusion reaches by
    int per_pixel;                    // samples along a pixel's side
    std::vector<ViewFrame> frames{};  // one a view, then one an inset
    std::vector<Camera> cameras{};    // likewise
    Image16* linear = nullptr;        // where the picture goes in linear light; null: into bytes of sRGB
    std::vector<GroundFrame> grounds{};
    std::vector<bool> outlined = std::vector<bool>(256, false);  // by the number that a surface's samples carry
    bool outlines = false;
    std::vector<std::vector<bool>> hidden{};  // by view: labels with a leader whose point a surface hides; empty: none is
  };

  double lap_start = 0.0;
  void lap(double& slot) {
    const double now = cpu_seconds();
    slot += now - lap_start;
    lap_start = now;
  }

  // Painted anew only where something about it has changed.
  void update_backdrop(const Drawing& drawing) {
    const Picture& p = drawing.picture;
    BackdropKey key{p.size, p.background.top,   p.background.bottom, {}, p.background.transparent, p.ground && p.ground->lines, {}, {}, 0.0,
                    0.0,    drawing.layout.unit};
    if (p.ground) {
      key.line = p.ground->line_color;
      for (std::size_t i = 0; i < drawing.layout.views.size(); ++i) {
        const GroundFrame& ground = drawing.grounds[i];
        key.areas.push_back(drawing.frames[i].area);
        key.homographies.push_back(ground.visible ? ground.pixel_to_ground : glm::dmat3(0.0));
        key.spacing = ground.spacing;
        key.fade = ground.fade_radius;
      }
    }
    if (!backdrop.pixels.empty() && key == backdrop_key) return;
    backdrop = paint_background(p);
    grid_seen = false;
    if (p.ground && p.ground->lines)
      for (std::size_t i = 0; i < drawing.layout.views.size(); ++i)
        grid_seen |= paint_grid(backdrop, drawing.grounds[i], drawing.frames[i], *p.ground, drawing.layout.unit);
    backdrop_key = key;
  }

  // One map of everything that throws a shadow; light outlives v. Returns the shadow on the ground.
  Mask cast_shadows(const Drawing& drawing, std::size_t i, const glm::dvec3& to_light, LightFrame& light, ViewState& v) {
    const Content& d = drawing.content;
    Mask shade;
    if (!drawing.picture.look.shadows || d.casters.empty()) return shade;
    Bounds lit = d.casters;
    lit.add(drawing.picture.bounds);
    light = make_light(to_light, lit);
    const ShadowMap map = draw_shadow_map(d, light);
    const double softness = 0.018 * lit.radius();
    moments = filter_shadow(map, light, softness);
    v.shadow_part = glm::vec4(double(filtered_size) / moments.width, double(filtered_size) / moments.height,
                              -double(moments.x) / moments.width, -double(moments.y) / moments.height);
    v.light = &light;
    v.shadow_reach = std::max(softness, 4.0 * light.texel);
    if (drawing.grounds[i].visible) shade = ground_shadow(map, light, drawing.grounds[i], drawing.frames[i], softness);
    return shade;
  }

  // Colours, and depths where they are needed, of the opaque things in the used part of a view (samples of it).
  void draw_samples(const Drawing& drawing, const ViewFrame& frame, const PixelRect& used, ViewState& v) {
    const int n = drawing.per_pixel;
    const int x0 = used.x / n, y0 = used.y / n, x1 = (used.x + used.width + n - 1) / n, y1 = (used.y + used.height + n - 1) / n;
    v.x = x0 * n;
    v.y = y0 * n;
    samples.part = {x0, frame.area.height - y1, x1 - x0, y1 - y0};
    samples.width = (x1 - x0) * n;
    samples.height = (y1 - y0) * n;
    samples.per_pixel = n;
    samples.fine.clear();
    if (on_processor && !drawing.linear) draw_on_processor(drawing, v);
    else draw_by_opengl(drawing, v);
  }

  void upload_shadow(ViewState& v) {
    if (v.light) v.shadow = device.texture_rg32f("shadow", moments.width, moments.height, moments.values.data());
  }

  // Solid surfaces here; what has lines in it, lines, markers and shells by OpenGL, in the part of the view where they are.
  void draw_on_processor(const Drawing& drawing, ViewState& v) {
    const Picture& p = drawing.picture;
    const Content& d = drawing.content;
    PaintOrder order = order_opaque(p, d, *v.frame);
    raster.start(samples, v.x, v.y, static_cast<int>(v.samples.x), static_cast<int>(v.samples.y));
    for (const std::size_t i : order.plain)
      if (!raster.add(d.surfaces[i], mark_of(i), clip_from_surface(d.surfaces[i], v), facing_of(d.surfaces[i]))) order.lined.push_back(i);
    shade(raster, p, v, moments, samples);
    lap(times.draw);

    std::vector<bool> rest(d.surfaces.size(), false);
    bool solid = !p.lines.empty() || !p.markers.empty() || !order.lined.empty(), any = solid;
    for (const std::size_t i : order.lined) rest[i] = true;
    for (std::size_t i = 0; i < d.surfaces.size(); ++i) {
      const bool shell = d.surfaces[i].opacity < 1.0f && d.surfaces[i].opacity > 0.0f, through = d.surfaces[i].seen_through > 0.0f;
      if (shell || through) rest[i] = any = true;
      solid = solid || (through && !shell);
    }
    if (!any) return;
    PixelRect part = covered(d, p, *v.frame, drawing.per_pixel, v.unit, rest);
    const int right = std::min(part.x + part.width - v.x, samples.width), top = std::min(part.y + part.height - v.y, samples.height);
    part.x = std::max(part.x - v.x, 0);
    part.y = std::max(part.y - v.y, 0);
    part.width = right - part.x;
    part.height = top - part.y;
    if (part.width < 1 || part.height < 1) return;
    v.target = &device.target("main", samples.width, samples.height, ColorFormat::bytes);
    device.upload(*v.target, part, samples.width, solid ? samples.colors.data() : nullptr, samples.depth.data());
    if (!solid) return;
    if (!order.lined.empty()) upload_shadow(v);
    painter.continue_opaque(v);
    painter.draw_surfaces(p, d, order.lined, v);
    if (!p.lines.empty() || !p.markers.empty()) painter.draw_symbols(p, v);
    painter.draw_hidden(p, d, v);
    device.gl().Finish();
    lap(times.draw);
    device.gl().BindFramebuffer(GL_FRAMEBUFFER, v.target->framebuffer);
    device.download(part, samples.width, samples.colors.data(), samples.depth.data());
    lap(times.filter);
  }

  void draw_by_opengl(const Drawing& drawing, ViewState& v) {
    const Picture& p = drawing.picture;
    const Gl& gl = device.gl();
    Target& opaque = drawing.linear ? device.target("linear", samples.width, samples.height, ColorFormat::words)
                                    : device.target("main", samples.width, samples.height, ColorFormat::bytes);
    v.target = &opaque;
    upload_shadow(v);
    gl.BindFramebuffer(GL_FRAMEBUFFER, opaque.framebuffer);
    painter.begin_opaque(v);
    painter.draw_opaque(p, drawing.content, v);
    if (!p.lines.empty() || !p.markers.empty()) painter.draw_symbols(p, v);
    painter.draw_hidden(p, drawing.content, v);
    samples.colors.resize(std::size_t(samples.width) * samples.height * 4);
    gl.Finish();
    lap(times.draw);
    gl.BindFramebuffer(GL_FRAMEBUFFER, opaque.framebuffer);
    if (drawing.linear) {
      samples.fine.resize(samples.colors.size());
      gl.ReadPixels(0, 0, samples.width, samples.height, GL_RGBA, GL_UNSIGNED_SHORT, samples.fine.data());
      // Marks, and what outlines are drawn by.
      for (std::size_t k = 0; k < samples.fine.size(); ++k) samples.colors[k] = static_cast<std::uint8_t>(samples.fine[k] / 257);
    } else {
      gl.ReadPixels(0, 0, samples.width, samples.height, GL_RGBA, GL_UNSIGNED_BYTE, samples.colors.data());
    }
    lap(times.filter);
    const bool pointed = std::any_of(p.labels.begin(), p.labels.end(), [](const Label& l) { return l.leader; });
    if (!p.look.occlusion && !drawing.outlines && !pointed) return;
    samples.depth.resize(std::size_t(samples.width) * samples.height);
    gl.ReadPixels(0, 0, samples.width, samples.height, GL_DEPTH_COMPONENT, GL_FLOAT, samples.depth.data());
  }

  // Which labels with a leader point at something behind a surface: all samples of the 3 x 3 pixels around the point are nearer than it is.
  std::vector<bool> find_hidden_labels(const Drawing& drawing, const ViewFrame& frame, const ViewState& v) {
    const Picture& p = drawing.picture;
    const int n = drawing.per_pixel, side = 3 * n;
    std::vector<bool> hidden(p.labels.size(), false);
    for (std::size_t i = 0; i < p.labels.size(); ++i) {
      glm::dvec2 at;
      if (!p.labels[i].leader || !project(frame, p.labels[i].point, at)) continue;
      const double away = -(frame.view * glm::dvec4(p.labels[i].point, 1.0)).z;
      const int x = static_cast<int>(std::floor(at.x) - frame.area.x - 1) * n - v.x,
                y = (frame.area.height - static_cast<int>(std::floor(at.y) - frame.area.y) - 2) * n - v.y;
      if (x < 0 || y < 0 || x + side > samples.width || y + side > samples.height) continue;
      // A hundredth of the scene: a point on a rim, or a face seen at a slant, does not hide itself.
      const double before = away - 0.01 * drawing.radius;
      hidden[i] = true;
      for (int j = 0; j < side; ++j)
        for (int k = 0; k < side; ++k) {
          const float z = samples.depth[std::size_t(y + j) * samples.width + x + k];
          hidden[i] = hidden[i] && z > 0.0f && frame.distance(static_cast<double>(z)) < before;
        }
    }
    return hidden;
  }

  void draw_view(Drawing& drawing, std::size_t i, Image& image) {
    const Picture& p = drawing.picture;
    const ViewFrame& frame = drawing.frames[i];
    const GroundFrame& ground = drawing.grounds[i];
    // Insets show what the first view does, in the same light.
    const Camera& camera = drawing.cameras[i < drawing.layout.views.size() ? i : 0];
    const glm::dvec3 to_light = light_direction(p, camera);
    const int n = drawing.per_pixel;
    ViewState v;
    LightFrame light;
    const Mask shade = cast_shadows(drawing, i, to_light, light, v);
    v.frame = &frame;
    v.per_pixel = n;
    v.samples = glm::vec2(frame.area.width * n, frame.area.height * n);
    v.to_light = glm::vec3(glm::dmat3(frame.view) * to_light);
    v.up = glm::vec3(glm::dmat3(frame.view) * (p.ground ? glm::normalize(p.ground->normal) : glm::normalize(camera.up)));
    set_colors(v, p.scalar_map);
    v.unit = drawing.layout.unit * n;
    v.cut = p.cut ? &*p.cut : nullptr;

    // Only the part of the view where something is gets cleared, drawn, read and filtered.
    const PixelRect used = covered(drawing.content, p, frame, n, v.unit);
    if (used.width < 1 || used.height < 1) {
      darken_backdrop(image, frame.area, shade, {});
      drawing.hidden.emplace_back();
      return;
    }
    draw_samples(drawing, frame, used, v);
    drawing.hidden.push_back(find_hidden_labels(drawing, frame, v));
    Mask occlusion;
    if (p.look.occlusion)
      occlusion =
          compute_occlusion(samples, frame, ground.visible ? &ground : nullptr, 0.10 * drawing.radius, p.lighting.studio ? 3.2 : 2.2);
    if (drawing.outlines) draw_silhouettes(samples, drawing.outlined, std::max(1, static_cast<int>(std::lround(1.1 * v.unit))));
    std::vector<GhostLayer> ghosts;
    if (v.target) ghosts = draw_ghosts(p, drawing.content, v, *v.target);
    lap(times.draw);

    darken_backdrop(image, frame.area, shade, ground.visible ? occlusion : Mask{});
    if (drawing.linear) resolve_linear(*drawing.linear, image, frame.area, samples, ghosts, occlusion);
    else resolve(image, frame.area, samples, ghosts, occlusion);
    lap(times.filter);
  }

  // Over the views: each on a backdrop of its own.
  void draw_insets(Drawing& drawing, Image& image) {
    const Picture& p = drawing.picture;
    const Image fresh = paint_background(p);
    for (std::size_t i = drawing.layout.views.size(); i < drawing.frames.size(); ++i) {
      const PixelRect& area = drawing.frames[i].area;
      for (int y = area.y; y < area.y + area.height; ++y) {
        const auto at = static_cast<std::ptrdiff_t>((std::size_t(y) * image.width + area.x) * image.channels);
        std::copy_n(fresh.pixels.begin() + at, std::size_t(area.width) * image.channels, image.pixels.begin() + at);
      }
      if (p.ground && p.ground->lines) paint_grid(image, drawing.grounds[i], drawing.frames[i], *p.ground, drawing.layout.unit);
      draw_view(drawing, i, image);
    }
  }

  // asked: in its own lengths. vector: null, or gets the files. linear: null, or gets the scene in linear light, without words.
  Image draw_picture(const Picture& asked, VectorFile* vector, Image16* linear = nullptr) {
    times = {};
    lap_start = cpu_seconds();

    // Words are laid out in the picture's own lengths, everything else is drawn in lengths near 1.
    const Layout layout = make_layout(asked);
    std::optional<Picture> scaled;
    Content d = gather_content(asked);
    if (const double scale = unit_scale(d, asked.bounds); scale != 1.0) {
      scaled = scaled_picture(asked, scale, asked.bounds.empty() ? d.all : asked.bounds);
      d = gather_content(*scaled);
    }
    const Picture& p = scaled ? *scaled : asked;
    Bounds bounds = d.all;
    bounds.add(p.bounds);
    const Bounds still = p.bounds.empty() ? d.all : p.bounds;  // what ground and occlusion are measured by
    Drawing drawing{p, d, layout, still.empty() ? 1.0 : std::max(still.radius(), 1e-12),
                    static_cast<int>(std::lround(std::sqrt(p.look.samples)))};
    for (std::size_t i = 0; i < layout.views.size(); ++i) {
      drawing.cameras.push_back(p.views.empty() ? p.camera : p.views[i].camera);
      drawing.frames.push_back(make_view(drawing.cameras.back(), layout.views[i], bounds));
      drawing.grounds.push_back(p.ground ? make_ground(*p.ground, drawing.frames.back(), still) : GroundFrame{});
    }
    for (std::size_t i = 0; i < layout.magnified.size(); ++i) {
      drawing.cameras.push_back(inset_camera(drawing.cameras.front(), drawing.frames.front(), p.insets[i], layout.magnified[i]));
      drawing.frames.push_back(make_view(drawing.cameras.back(), layout.magnified[i], bounds));
      drawing.grounds.push_back(p.ground ? make_ground(*p.ground, drawing.frames.back(), still) : GroundFrame{});
    }
    for (std::size_t i = 0; i < d.surfaces.size(); ++i)
      if (d.surfaces[i].silhouette && d.surfaces[i].opacity >= 1.0f) drawing.outlined[1 + i % 254] = drawing.outlines = true;

    update_backdrop(drawing);
    Image image = backdrop;
    drawing.linear = linear;
    if (linear) *linear = linear_backdrop(image);
    for (std::size_t i = 0; i < layout.views.size(); ++i) draw_view(drawing, i, image);
    if (!layout.magnified.empty()) draw_insets(drawing, image);
    device.check("a picture");
    painter.forget();

    if (linear) return image;
    const SceneBelow below{drawing.frames, grid_seen, drawing.hidden};
    if (vector && vector->svg) {
      SvgSheet sheet{image.width, image.height, {}};
      draw_overlay(sheet, p, layout, below);
      vector->svg_file = svg_text(sheet, {&image, vector->dpi, vector->note});
    }
    if (vector && vector->pdf) {
      PdfSheet sheet{image.width, image.height, {}, {}};
      draw_overlay(sheet, p, layout, below);
      vector->pdf_file = pdf_text(sheet, {&image, vector->dpi, vector->note});
    }
    draw_overlay(image, p, layout, below, plots);
    lap(times.overlay);
    return image;
  }

  // One number a pixel of the nearest opaque surface, one sample a pixel, taken to 16 bits by `code`: depth buffer or scalar.
  template <class Code>
  Image16 draw_numbers(const Picture& asked, bool scalars, ViewFrame& frame, Code code) {
    refuse_fork();
    device.make_current();
    std::optional<Picture> scaled;
    Content d = gather_content(asked);
    const double scale = unit_scale(d, asked.bounds);
    if (scale != 1.0) {
      scaled = scaled_picture(asked, scale, d.all);
      d = gather_content(*scaled);
    }
    const Picture& p = scaled ? *scaled : asked;
    Bounds bounds = d.all;
    bounds.add(p.bounds);
    const PixelRect area = make_layout(asked).scene;
    frame = make_view(p.camera, area, bounds);
    ViewState v;
    v.frame = &frame;
    v.samples = glm::vec2(area.width, area.height);
    v.to_light = v.up = glm::vec3(0, 1, 0);
    set_colors(v, p.scalar_map);
    v.scalar_output = scalars;
    const Gl& gl = device.gl();
    device.target(scalars ? "scalar" : "depth", area.width, area.height, scalars ? ColorFormat::red_float : ColorFormat::bytes);
    painter.begin_opaque(v);
    if (scalars) {
      // Beyond the map's range: nothing.
      gl.ClearColor(2.0f, 0.0f, 0.0f, 0.0f);
      gl.Clear(GL_COLOR_BUFFER_BIT);
    }
    painter.draw_opaque(p, d, v);
    std::vector<float> values(std::size_t(area.width) * area.height);
    gl.ReadPixels(0, 0, area.width, area.height, scalars ? GL_RED : GL_DEPTH_COMPONENT, GL_FLOAT, values.data());
    device.check("numbers");
    painter.forget();

    Image16 image{p.size.width, p.size.height, 1, std::vector<std::uint16_t>(std::size_t(p.size.width) * p.size.height, 65535)};
    for (int y = 0; y < area.height; ++y)
      for (int x = 0; x < area.width; ++x)
        image.pixels[std::size_t(area.y + y) * image.width + area.x + x] = code(values[std::size_t(area.height - 1 - y) * area.width + x]);
    // What is told of it is in the picture's own lengths.
    frame.near /= scale;
    frame.far /= scale;
    return image;
  }
};

Renderer::Renderer(Backend backend, Solids solids) {
  refuse_fork();
  note_threads();
  impl_ = std::make_unique<Impl>(backend == Backend::osmesa ? create_osmesa_context() : create_egl_context());
  const Gl& gl = impl_->device.gl();
  const auto text = [&](GLenum name) { return std::string(reinterpret_cast<const char*>(gl.GetString(name))); };
  impl_->on_processor = solids == Solids::fastest && text(GL_RENDERER).starts_with("llvmpipe");
  impl_->info = {backend == Backend::osmesa ? "osmesa" : "egl", text(GL_RENDERER), text(GL_VERSION), cpu_features()};
}

Renderer::~Renderer() {
  const pid_t owner = threads_of.load();
  // To clean up in a fork would wait for threads that are not there.
  if (owner != 0 && owner != ::getpid()) static_cast<void>(impl_.release());
  else if (impl_) impl_->device.make_current();
}

const RendererInfo& Renderer::info() const { return impl_->info; }
const DrawTimes& Renderer::times() const { return impl_->times; }

Image Renderer::draw(const Picture& asked, VectorFile* vector) {
  refuse_fork();
  impl_->device.make_current();
  return impl_->draw_picture(asked, vector);
}

Image16 Renderer::draw_linear(const Picture& asked) {
  refuse_fork();
  impl_->device.make_current();
  Picture clear = asked;
  clear.background.transparent = true;
  Image16 image;
  impl_->draw_picture(clear, nullptr, &image);
  return image;
}

Image16 Renderer::draw_depth(const Picture& p, double* near_plane, double* far_plane) {
  ViewFrame frame;
  Image16 image = impl_->draw_numbers(p, false, frame, [&](float z) {
    if (z <= 0.0f) return std::uint16_t(65535);
    const double share = (frame.distance(static_cast<double>(z)) - frame.near) / (frame.far - frame.near);
    return static_cast<std::uint16_t>(std::lround(65534.0 * std::clamp(share, 0.0, 1.0)));
  });
  if (near_plane) *near_plane = frame.near;
  if (far_plane) *far_plane = frame.far;
  return image;
}

Image16 Renderer::draw_scalar(const Picture& p) {
  ViewFrame frame;
  return impl_->draw_numbers(p, true, frame, [](float s) {
    return s >= 0.0f && s <= 1.0f ? static_cast<std::uint16_t>(std::lround(65534.0f * s)) : std::uint16_t(65535);
  });
}

}  // namespace flexframe::render
