// Sources of the formulas: shaders.cpp.
#include "render/draw/shading.h"

#include "render/draw/shaders.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>

namespace flexframe::render {
namespace {

constexpr int batch_size = 256;
using Lane = std::array<float, batch_size>;

// Points to be lit together: one after another in memory, so that the compiler lights several at once.
struct Batch {
  int count = 0;
  Lane nx, ny, nz;                                    // normal, camera frame
  Lane red, green, blue;                              // albedo, linear
  Lane x, y, distance;                                // samples of the target; m from the camera's plane
  Lane light;                                         // share of the key light that arrives, then times the cosine
  std::array<std::uint32_t, batch_size> pixel, mask;  // first sample of the pixel; bit j * n + i: its sample (i, j)
};

// What a surface needs to be shaded, worked out once.
struct Ready {
  const Surface* surface = nullptr;
  std::span<const Seen> seen;
  std::uint32_t first = 0;
  glm::mat3 turn{1.0f};  // of normals, to the camera's frame
  MaterialTerms material;
  ViewTerms view;
  bool matt = false, metal = false, flips = false;
  bool by_sample = false;  // bands of colour: no two samples are joined
  bool vectors = false, shears = false;
  int mark = 0;
  std::unique_ptr<Batch> batch = std::make_unique<Batch>();
};

struct Point {
  glm::vec3 normal{0.0f}, albedo{0.0f};
  float distance = 0.0f;
};

float clamped(float v, float low, float high) { return std::min(std::max(low, v), high); }
float smooth_step(float t) { return t * t * (3.0f - 2.0f * t); }
glm::vec3 to_linear(const glm::vec3& s) { return s * (s * (s * 0.305306011f + 0.682171111f) + 0.012522878f); }

class Shading {
 public:
  Shading(const Raster& raster, const Picture& picture, const ViewState& view, const ShadowMoments& moments, Samples& samples)
      : raster_(raster),
        view_(view),
        moments_(moments),
        samples_(samples),
        map_(picture.scalar_map),
        studio_(picture.lighting.studio),
        n_(samples.per_pixel) {
    for (const std::uint32_t c : view.colors) {
      const glm::vec3 root = glm::vec3(c & 1023u, c >> 10 & 1023u, c >> 20) * (1.0f / 1023.0f);
      colors_.push_back(root * root);
    }
    for (const Raster::Part& part : raster.parts()) add_part(part, picture);
    scale_ = scalar_scale(map_);
    far_ = static_cast<float>(view.frame->far);
    range_ = static_cast<float>(view.frame->far - view.frame->near);
    if (view.light) {
      const glm::dmat4 light_from_view = view.light->map_from_world * glm::inverse(view.frame->view);
      light_from_view_ = glm::mat4(light_from_view);
      light_turn_ = glm::mat3(glm::dmat3(light_from_view));
    }
    const double step = view.frame->pixel / view.per_pixel;
    place_ = glm::vec4(step, step, step * (view.x - 0.5 * static_cast<double>(view.samples.x)),
                       step * (view.y - 0.5 * static_cast<double>(view.samples.y)));
  }

  void run() {
    samples_.colors.assign(std::size_t(samples_.width) * samples_.height * 4, 0);
    const std::span<const std::uint32_t> ids = raster_.triangles();
    for (int y = 0; y + n_ <= samples_.height; y += n_)
      for (int x = 0; x + n_ <= samples_.width; x += n_) {
        const std::size_t at = std::size_t(y) * samples_.width + x;
        // Most pixels are empty or inside one triangle.
        const std::uint32_t first = ids[at];
        std::uint32_t any = 0, other = 0;
        for (int j = 0; j < n_; ++j)
          for (int i = 0; i < n_; ++i) {
            const std::uint32_t id = ids[at + std::size_t(j) * samples_.width + i];
            any |= id;
            other |= id ^ first;
          }
        if (any == 0) continue;
        if (Ready* const part = other == 0 ? &part_of(first) : nullptr; part && !part->by_sample) {
          const glm::vec2 centre = glm::vec2(x, y) + 0.5f * static_cast<float>(n_);
          put(*part, evaluate(*part, first, centre.x, centre.y), centre, at, (1u << (n_ * n_)) - 1u);
          continue;
        }
        pixel(x, y);
      }
    for (Ready& part : parts_) flush(part);
  }

 private:
  struct Group {
    std::uint32_t triangle = 0, mask = 0;
    Ready* part = nullptr;
    glm::vec2 sum{0.0f};
    int count = 0;
    Point point;
  };

  void add_part(const Raster::Part& from, const Picture& picture) {
    const Surface& s = *from.surface;
    Ready part;
    part.surface = &s;
    part.seen = from.seen;
    part.first = from.first;
    part.mark = from.mark;
    const glm::dmat3 turn(view_.frame->view * s.pose);
    const double scale = std::cbrt(std::abs(glm::determinant(glm::dmat3(s.pose))));
    part.turn = glm::mat3(turn / (scale > 0.0 ? scale : 1.0));
    part.material = material_terms(s, picture.lighting, picture.scalar_map.colormap);
    part.view = view_terms(picture, s, view_);
    part.matt = is_matt(s, picture.lighting);
    part.metal = s.material.metallic > 0.0f && s.scalars.empty();
    part.flips = s.two_sided || s.normals.empty();
    part.by_sample = !s.scalars.empty() && picture.scalar_map.levels > 1;
    part.vectors = !s.scalars.empty() && !s.vectors.empty();
    part.shears = part.vectors && !s.shears.empty();
    parts_.push_back(std::move(part));
  }

  Ready& part_of(std::uint32_t id) {
    // Neighbours are mostly of one surface.
    const std::uint32_t triangle = id - 1;
    if (last_ && triangle >= last_->first && triangle - last_->first < last_->surface->triangles.size()) return *last_;
    last_ = &parts_[static_cast<std::size_t>(&raster_.part_of(triangle) - raster_.parts().data())];
    return *last_;
  }

  float scalar_at(const Ready& part, const glm::uvec3& t, const glm::vec3& share) const {
    const Surface& s = *part.surface;
    const auto mean = [&](std::span<const glm::vec3> of) { return share.x * of[t.x] + share.y * of[t.y] + share.z * of[t.z]; };
    float value;
    if (part.vectors) {
      const glm::vec3 v = mean(s.vectors);
      if (part.shears) {
        const glm::vec3 apart = v - glm::vec3(v.y, v.z, v.x), w = mean(s.shears);
        value = std::sqrt(0.5f * glm::dot(apart, apart) + 3.0f * glm::dot(w, w));
      } else {
        value = std::sqrt(glm::dot(v, v));
      }
    } else {
      value = share.x * s.scalars[t.x] + share.y * s.scalars[t.y] + share.z * s.scalars[t.z];
    }
    if (!(value == value)) return value;
    if (map_.logarithmic) value = std::log2(std::max(value, 1e-37f));
    return value * scale_.x + scale_.y;
  }

  glm::vec3 albedo_at(const Ready& part, const glm::uvec3& t, const glm::vec3& share) const {
    const Surface& s = *part.surface;
    if (!s.scalars.empty()) {
      const float value = scalar_at(part, t, share);
      if (!(value == value)) return colors_[color_steps];
      float at = clamped(value, 0.0f, 1.0f);
      if (map_.levels > 1) {
        const auto levels = static_cast<float>(map_.levels);
        at = (std::min(std::floor(at * levels), levels - 1.0f) + 0.5f) / levels;
      }
      // NOLINTNEXTLINE(bugprone-incorrect-roundings): at >= 0, and lround would be a call for every pixel
      return colors_[static_cast<std::size_t>(at * static_cast<float>(color_steps - 1) + 0.5f)];
    }
    if (!s.colors.empty()) return to_linear(share.x * s.colors[t.x] + share.y * s.colors[t.y] + share.z * s.colors[t.z]);
    return part.material.base;
  }

  // A triangle's numbers, kept while neighbours ask for the same.
  struct Plane {
    std::uint32_t id = 0;
    glm::uvec3 corners{0};
    float x = 0.0f, y = 0.0f, b_by_x = 0.0f, b_by_y = 0.0f, c_by_x = 0.0f, c_by_y = 0.0f;
    glm::vec3 inverse_w{1.0f}, z{0.0f}, flat{0.0f};
  };

  const Plane& plane_of(const Ready& part, std::uint32_t id) {
    if (plane_.id == id) return plane_;
    const Surface& s = *part.surface;
    const glm::uvec3 t = s.triangles[id - 1 - part.first];
    const Seen &a = part.seen[t.x], &b = part.seen[t.y], &c = part.seen[t.z];
    const float bx = b.x - a.x, by = b.y - a.y, cx = c.x - a.x, cy = c.y - a.y, area = bx * cy - cx * by,
                unit = area != 0.0f ? 1.0f / area : 0.0f;
    plane_ = {id, t, a.x, a.y, cy * unit, -cx * unit, -by * unit, bx * unit, {a.inverse_w, b.inverse_w, c.inverse_w}, {a.z, b.z, c.z}, {}};
    if (s.normals.empty()) plane_.flat = part.turn * glm::cross(s.positions[t.y] - s.positions[t.x], s.positions[t.z] - s.positions[t.x]);
    return plane_;
  }

  // Of a triangle at a place of the target; never beyond its corners. The normal is of any length.
  Point evaluate(const Ready& part, std::uint32_t id, float x, float y) {
    const Surface& s = *part.surface;
    const Plane& plane = plane_of(part, id);
    const glm::uvec3 t = plane.corners;
    const float px = x - plane.x, py = y - plane.y, b = px * plane.b_by_x + py * plane.b_by_y, c = px * plane.c_by_x + py * plane.c_by_y;
    const glm::vec3 inside(std::max(0.0f, 1.0f - b - c), std::max(0.0f, b), std::max(0.0f, c));
    const float all = inside.x + inside.y + inside.z;
    const glm::vec3 weight = inside * plane.inverse_w;
    const float per_sum = 1.0f / (weight.x + weight.y + weight.z);
    const glm::vec3 share = weight * per_sum;
    Point point;
    if (view_.frame->orthographic) point.distance = far_ - glm::dot(inside, plane.z) / all * range_;
    else point.distance = all * per_sum;
    if (s.normals.empty()) point.normal = plane.flat;
    else point.normal = part.turn * (share.x * s.normals[t.x] + share.y * s.normals[t.y] + share.z * s.normals[t.z]);
    point.albedo = albedo_at(part, t, share);
    return point;
  }

  // Of length 1, to the side that is seen where both are drawn.
  static glm::vec3 shown(const Ready& part, const glm::vec3& n, float x, float y) {
    const glm::vec4& ray = part.view.ray;
    const float share = 1.0f / std::sqrt(std::max(glm::dot(n, n), 1e-37f)),
                towards = n.x * (ray.x * x + ray.z) + n.y * (ray.y * y + ray.w) + n.z;
    return n * (part.flips && towards < 0.0f ? -share : share);
  }

  // Samples of different triangles: those of one surface are lit as one where direction and colour hardly differ.
  void pixel(int x, int y) {
    std::array<Group, 16>& groups = groups_;
    int count = 0;
    const std::size_t at = std::size_t(y) * samples_.width + x;
    for (int j = 0; j < n_; ++j)
      for (int i = 0; i < n_; ++i) {
        const std::uint32_t id = raster_.triangles()[at + std::size_t(j) * samples_.width + i];
        if (id == 0) continue;
        int g = 0;
        Ready& part = part_of(id);
        while (g < count && (groups[g].triangle != id || part.by_sample)) ++g;
        if (g == count) {
          groups[g] = Group{id, 0u, &part, glm::vec2(0.0f), 0, {}};
          ++count;
        }
        groups[g].mask |= 1u << (j * n_ + i);
        groups[g].sum += glm::vec2(x + i, y + j) + 0.5f;
        ++groups[g].count;
      }
    for (int g = 0; g < count; ++g) {
      groups[g].sum /= static_cast<float>(groups[g].count);
      Point& point = groups[g].point;
      point = evaluate(*groups[g].part, groups[g].triangle, groups[g].sum.x, groups[g].sum.y);
      point.normal = shown(*groups[g].part, point.normal, groups[g].sum.x, groups[g].sum.y);
    }
    for (int g = 0; g < count; ++g) {
      Group& to = groups[g];
      if (!to.part) continue;
      glm::vec3 normal = static_cast<float>(to.count) * to.point.normal, albedo = static_cast<float>(to.count) * to.point.albedo;
      glm::vec2 place = static_cast<float>(to.count) * to.sum;
      float distance = static_cast<float>(to.count) * to.point.distance;
      int joined = to.count;
      for (int k = g + 1; k < count && !to.part->by_sample; ++k) {
        const Group& other = groups[k];
        const glm::vec3 apart = glm::abs(other.point.albedo - to.point.albedo);
        if (other.part != to.part || glm::dot(other.point.normal, to.point.normal) < 0.997f ||
            std::max({apart.x, apart.y, apart.z}) > 0.02f)
          continue;
        const auto weight = static_cast<float>(other.count);
        normal += weight * other.point.normal;
        albedo += weight * other.point.albedo;
        place += weight * other.sum;
        distance += weight * other.point.distance;
        joined += other.count;
        to.mask |= other.mask;
        groups[k].part = nullptr;
      }
      const float share = 1.0f / static_cast<float>(joined);
      put(*to.part, {normal, share * albedo, share * distance}, share * place, at, to.mask);
    }
  }

  void put(Ready& part, const Point& p, const glm::vec2& place, std::size_t pixel, std::uint32_t mask) {
    Batch& b = *part.batch;
    const auto k = static_cast<std::size_t>(b.count);
    b.nx[k] = p.normal.x;
    b.ny[k] = p.normal.y;
    b.nz[k] = p.normal.z;
    b.red[k] = p.albedo.x;
    b.green[k] = p.albedo.y;
    b.blue[k] = p.albedo.z;
    b.x[k] = place.x;
    b.y[k] = place.y;
    b.distance[k] = p.distance;
    b.pixel[k] = static_cast<std::uint32_t>(pixel);
    b.mask[k] = mask;
    if (++b.count == batch_size) flush(part);
  }

  void flush(Ready& part) {
    Batch& b = *part.batch;
    if (b.count == 0) return;
    for (int k = 0; k < b.count; ++k) {
      const glm::vec3 n = shown(part, glm::vec3(b.nx[k], b.ny[k], b.nz[k]), b.x[k], b.y[k]);
      b.nx[k] = n.x;
      b.ny[k] = n.y;
      b.nz[k] = n.z;
    }
    take_light(part, b);
    if (part.matt) color<true, false>(part, b);
    else if (part.metal) color<false, true>(part, b);
    else color<false, false>(part, b);
    write(part, b);
    b.count = 0;
  }

  // Cosine of the key light times what of it the shadow lets through.
  void take_light(const Ready& part, Batch& b) const {
    const glm::vec3 l = view_.to_light;
    for (int k = 0; k < b.count; ++k) b.light[k] = std::max(b.nx[k] * l.x + b.ny[k] * l.y + b.nz[k] * l.z, 0.0f);
    if (!view_.light) return;
    const float reach = static_cast<float>(view_.shadow_reach), middle_x = static_cast<float>(moments_.x) + 0.5f,
                middle_y = static_cast<float>(moments_.y) + 0.5f;
    const glm::vec4& ray = part.view.ray;
    for (int k = 0; k < b.count; ++k) {
      if (b.light[k] <= 0.0f) continue;
      const glm::vec3 n(b.nx[k], b.ny[k], b.nz[k]);
      const float cosine = b.light[k], d = b.distance[k];
      const glm::vec3 p = view_.frame->orthographic ? glm::vec3(place_.x * b.x[k] + place_.z, place_.y * b.y[k] + place_.w, -d)
                                                    : -d * glm::vec3(ray.x * b.x[k] + ray.z, ray.y * b.y[k] + ray.w, 1.0f);
      // Looked up off the surface by the filter's reach, the more the more the light grazes: no surface shadows itself.
      const glm::vec3 seen = glm::vec3(light_from_view_ * glm::vec4(p, 1.0f)) +
                             light_turn_ * (n * (reach * std::sqrt(std::max(1.0f - cosine * cosine, 0.0f))));
      const glm::vec2 moments = moments_at(seen.x * filtered_size - middle_x, seen.y * filtered_size - middle_y);
      const float warped = std::exp(shadow_warp * (clamped(seen.z, 0.0f, 1.0f) - 0.5f));
      const float off = warped - moments.x;
      if (off <= 0.0f) continue;
      const float variance = std::max(moments.y - moments.x * moments.x, 1e-5f * warped * warped);
      b.light[k] *= clamped((variance / (variance + off * off) - 0.25f) / 0.75f, 0.0f, 1.0f);
    }
  }

  // Between four texels, from the centre of the first; the rim goes on for ever.
  glm::vec2 moments_at(float x, float y) const {
    const float cx = clamped(x, 0.0f, static_cast<float>(moments_.width - 1)),
                cy = clamped(y, 0.0f, static_cast<float>(moments_.height - 1));
    const int ix = std::min(static_cast<int>(cx), moments_.width - 2), iy = std::min(static_cast<int>(cy), moments_.height - 2);
    const float ax = cx - static_cast<float>(ix), ay = cy - static_cast<float>(iy);
    const float *low = &moments_.values[2 * (std::size_t(iy) * moments_.width + ix)], *high = low + 2 * std::size_t(moments_.width);
    const auto between = [&](int i) {
      const float a = low[i] + (low[i + 2] - low[i]) * ax, c = high[i] + (high[i + 2] - high[i]) * ax;
      return a + (c - a) * ay;
    };
    return {between(0), between(1)};
  }

  template <bool matt, bool metal>
  void color(const Ready& part, Batch& b) const {
    if (studio_) color<matt, metal, true>(part, b);
    else color<matt, metal, false>(part, b);
  }

  // Albedo becomes light on its way to the viewer.
  template <bool matt, bool metal, bool studio>
  void color(const Ready& part, Batch& batch) const {
    const MaterialTerms m = part.material;
    const ViewTerms view = part.view;
    const glm::vec3 to_light = view_.to_light, up = view_.up;
    Batch& b = batch;
    for (int k = 0; k < b.count; ++k) {
      const float nx = b.nx[k], ny = b.ny[k], nz = b.nz[k], light = b.light[k];
      const float rx = view.ray.x * b.x[k] + view.ray.z, ry = view.ray.y * b.y[k] + view.ray.w;
      const float length = 1.0f / std::sqrt(rx * rx + ry * ry + 1.0f), vx = rx * length, vy = ry * length, vz = length;
      const float n_v = nx * vx + ny * vy + nz * vz, n_l = nx * to_light.x + ny * to_light.y + nz * to_light.z,
                  n_up = nx * up.x + ny * up.y + nz * up.z;
      const float nv = std::max(n_v, 1e-3f), nl = std::max(n_l, 0.0f);
      float diffuse = m.diffuse.x + m.diffuse.y * n_up + m.diffuse.z * nv + m.diffuse.w * light;
      const float nearness = studio ? view.falloff.x * b.x[k] + view.falloff.y * b.y[k] + view.falloff.z : 1.0f;
      if (studio) diffuse *= nearness;
      float lobe = 0.0f, g5 = 0.0f, mirrored = 0.0f, r5 = 0.0f;
      if (!matt) {
        const float v_l = vx * to_light.x + vy * to_light.y + vz * to_light.z, v_up = vx * up.x + vy * up.y + vz * up.z;
        const float inverse = 1.0f / std::sqrt(std::max(2.0f + 2.0f * v_l, 1e-6f));
        const float nh = std::max((n_l + n_v) * inverse, 0.0f), vh = (1.0f + v_l) * inverse;
        const float d = nh * nh * (m.gloss.x * m.gloss.x - 1.0f) + 1.0f;
        const float product = 2.0f * nl * nv;
        lobe = std::min(m.gloss.y / (d * d * std::max(product + (nl + nv - product) * m.gloss.x, 1e-3f)), 4.0f) * light * m.gloss.z;
        const float grazing = std::max(1.0f - vh, 0.0f), g2 = grazing * grazing;
        g5 = g2 * g2 * grazing;
        const float horizon = clamped(0.5f + (2.0f * n_v * n_up - v_up) * m.mirror.x, 0.0f, 1.0f);
        if (studio) {
          lobe *= nearness;
          const float box = clamped((2.0f * n_v * n_l - v_l - m.boxes.x) * m.boxes.y, 0.0f, 1.0f);
          const float across = 2.0f * n_v * (nx * view.side.x + ny * view.side.y + nz * view.side.z) -
                               (vx * view.side.x + vy * view.side.y + vz * view.side.z);
          const float strip = clamped((std::max(across, -0.9f * across) - m.boxes.z) * m.boxes.w, 0.0f, 1.0f);
          mirrored = (0.30f + 0.45f * smooth_step(horizon) + m.box_strength * (smooth_step(box) + 0.45f * smooth_step(strip))) * m.gloss.w *
                     nearness;
        } else {
          mirrored = (0.42f + 0.58f * smooth_step(horizon)) * m.gloss.w;
        }
        const float rim = 1.0f - nv, r2 = rim * rim;
        r5 = r2 * r2 * rim;
      }
      const auto lit = [&](float albedo) {
        float c = albedo * diffuse;
        if (!matt) {
          const float f0 = metal ? 0.04f + (albedo - 0.04f) * m.mirror.z : 0.04f;
          c += (f0 + (1.0f - f0) * g5) * lobe + (f0 + ((metal ? std::max(m.mirror.y, f0) : m.mirror.y) - f0) * r5) * mirrored;
        }
        // Soft shoulder above 0.8 only.
        const float over = clamped(c - 0.8f, 0.0f, 0.4f);
        c = std::min(c, 0.8f) + over * (1.0f - 1.25f * over);
        return 255.0f * std::sqrt(clamped(c, 0.0f, 1.0f)) + 0.5f;
      };
      b.red[k] = lit(b.red[k]);
      b.green[k] = lit(b.green[k]);
      b.blue[k] = lit(b.blue[k]);
    }
  }

  void write(const Ready& part, const Batch& b) {
    for (int k = 0; k < b.count; ++k) {
      const std::uint8_t color[4] = {static_cast<std::uint8_t>(b.red[k]), static_cast<std::uint8_t>(b.green[k]),
                                     static_cast<std::uint8_t>(b.blue[k]), static_cast<std::uint8_t>(part.mark)};
      std::uint32_t mask = b.mask[k];
      std::uint8_t* const first = &samples_.colors[4 * std::size_t(b.pixel[k])];
      if (n_ == 2 && mask == 15u) {
        std::uint8_t* const second = first + 4 * std::size_t(samples_.width);
        for (std::uint8_t* const to : {first, first + 4, second, second + 4}) std::memcpy(to, color, 4);
        continue;
      }
      for (int j = 0; mask != 0; ++j)
        for (int i = 0; i < n_; ++i, mask >>= 1)
          if (mask & 1u) std::memcpy(first + 4 * (std::size_t(j) * samples_.width + i), color, 4);
    }
  }

  const Raster& raster_;
  const ViewState& view_;
  const ShadowMoments& moments_;
  Samples& samples_;
  const ScalarMap& map_;
  const bool studio_;
  const int n_;
  std::vector<glm::vec3> colors_;
  std::vector<Ready> parts_;
  Ready* last_ = nullptr;
  glm::vec2 scale_{0.0f};
  glm::mat4 light_from_view_{1.0f};
  glm::mat3 light_turn_{1.0f};
  glm::vec4 place_{0.0f};
  float far_ = 0.0f, range_ = 0.0f;
  Plane plane_;
  std::array<Group, 16> groups_;  // of the pixel being looked at
};

}  // namespace

void shade(const Raster& raster, const Picture& picture, const ViewState& view, const ShadowMoments& moments, Samples& samples) {
  Shading(raster, picture, view, moments, samples).run();
}

}  // namespace flexframe::render
