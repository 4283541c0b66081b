#include "render/image/canvas.h"

#include "render/base/srgb.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace flexframe::render {

void blend_pixel(Image& image, int x, int y, const glm::vec3& color, float opacity) {
  if (x < 0 || y < 0 || x >= image.width || y >= image.height || opacity <= 0.0f) return;
  std::uint8_t* p = &image.pixels[(std::size_t(y) * image.width + x) * image.channels];
  opacity = std::min(opacity, 1.0f);
  if (image.channels == 4) {
    const float below = static_cast<float>(p[3]) / 255.0f, a = opacity + below * (1.0f - opacity);
    for (int k = 0; k < 3; ++k) {
      const float c = (255.0f * color[k] * opacity + static_cast<float>(p[k]) * below * (1.0f - opacity)) / a;
      p[k] = static_cast<std::uint8_t>(std::clamp(c + 0.5f, 0.0f, 255.0f));
    }
    p[3] = static_cast<std::uint8_t>(rounded(255.0f * a));
  } else {
    for (int k = 0; k < std::min(3, image.channels); ++k) {
      const float c = static_cast<float>(p[k]) + (255.0f * color[k] - static_cast<float>(p[k])) * opacity;
      p[k] = static_cast<std::uint8_t>(std::clamp(c + 0.5f, 0.0f, 255.0f));
    }
  }
}

void fill_rectangle(Image& image, const Box& box, const Paint& paint, double corner) {
  const auto& [x, y, width, height] = box;
  const auto& [color, opacity] = paint;
  if (!(width > 0.0 && height > 0.0)) return;
  corner = std::min({corner, 0.5 * width, 0.5 * height});
  const int x0 = std::max(0, static_cast<int>(std::floor(x))), x1 = std::min(image.width, static_cast<int>(std::ceil(x + width)));
  const int y0 = std::max(0, static_cast<int>(std::floor(y))), y1 = std::min(image.height, static_cast<int>(std::ceil(y + height)));
  // Whole pixels of large plain rectangles: what each byte becomes is looked up.
  const bool plain = corner <= 0.0 && image.channels == 3 && std::size_t(x1 - x0) * std::max(0, y1 - y0) > 4096 && x1 > x0;
  std::array<std::array<std::uint8_t, 256>, 3> becomes;
  if (plain)
    for (int v = 0; v < 256; ++v) {
      Image one{1, 1, 3, std::vector<std::uint8_t>(3, static_cast<std::uint8_t>(v))};
      blend_pixel(one, 0, 0, color, opacity);
      for (int k = 0; k < 3; ++k) becomes[k][v] = one.pixels[k];
    }
  for (int j = y0; j < y1; ++j)
    for (int i = x0; i < x1; ++i) {
      if (plain && i >= x && j >= y && i + 1.0 <= x + width && j + 1.0 <= y + height) {
        std::uint8_t* p = &image.pixels[(std::size_t(j) * image.width + i) * 3];
        for (int k = 0; k < 3; ++k) p[k] = becomes[k][p[k]];
        continue;
      }
      // Overlap of the pixel with the rectangle; at rounded corners the distance from the corner's circle.
      const double cx = std::clamp(std::min(x + width, i + 1.0) - std::max<double>(x, i), 0.0, 1.0);
      const double cy = std::clamp(std::min(y + height, j + 1.0) - std::max<double>(y, j), 0.0, 1.0);
      double cover = cx * cy;
      if (corner > 0.0) {
        const double dx = std::max({x + corner - (i + 0.5), (i + 0.5) - (x + width - corner), 0.0});
        const double dy = std::max({y + corner - (j + 0.5), (j + 0.5) - (y + height - corner), 0.0});
        if (dx > 0.0 && dy > 0.0) cover *= std::clamp(corner + 0.5 - std::hypot(dx, dy), 0.0, 1.0);
      }
      blend_pixel(image, i, j, color, opacity * static_cast<float>(cover));
    }
}

void draw_frame(Image& image, const Box& box, double line, const Paint& paint) {
  const auto& [x, y, width, height] = box;
  fill_rectangle(image, {x, y, width, line}, paint);
  fill_rectangle(image, {x, y + height - line, width, line}, paint);
  fill_rectangle(image, {x, y + line, line, height - 2.0 * line}, paint);
  fill_rectangle(image, {x + width - line, y + line, line, height - 2.0 * line}, paint);
}

LineCover cover_polyline(int image_width, int image_height, std::span<const glm::dvec2> points, double width, double dash,
                         const glm::dvec4* clip) {
  // The maximum over the segments, in the bounding box of the line.
  LineCover out;
  const double half = 0.5 * width;
  glm::dvec2 lower(1e300), upper(-1e300);
  for (const glm::dvec2& p : points)
    if (std::isfinite(p.x) && std::isfinite(p.y)) {
      lower = glm::min(lower, p);
      upper = glm::max(upper, p);
    }
  const glm::dvec4 limit = clip ? *clip : glm::dvec4(0, 0, image_width, image_height);
  if (!(lower.x <= upper.x)) return out;
  const auto pixel = [](double v, double low, double high) { return static_cast<int>(std::clamp(v, low, high)); };
  const int x0 = pixel(std::floor(std::max(lower.x - half - 1.0, limit.x)), 0, image_width),
            x1 = pixel(std::ceil(std::min(upper.x + half + 1.0, limit.x + limit.z)), 0, image_width);
  const int y0 = pixel(std::floor(std::max(lower.y - half - 1.0, limit.y)), 0, image_height),
            y1 = pixel(std::ceil(std::min(upper.y + half + 1.0, limit.y + limit.w)), 0, image_height);
  if (x1 <= x0 || y1 <= y0) return out;
  const int w = x1 - x0;
  out = {x0, y0, w, y1 - y0, std::vector<float>(std::size_t(w) * (y1 - y0), 0.0f)};
  std::vector<float>& cover = out.values;
  double travelled = 0.0;
  const auto segment = [&](glm::dvec2 a, glm::dvec2 b) {
    // Far outside: cut to a box around the picture, so that loops stay short.
    const glm::dvec2 d = b - a;
    double t0 = 0.0, t1 = 1.0;
    const double low[2] = {x0 - half - 2.0, y0 - half - 2.0}, high[2] = {x1 + half + 2.0, y1 + half + 2.0};
    for (int k = 0; k < 2; ++k) {
      if (d[k] == 0.0) {
        if (a[k] < low[k] || a[k] > high[k]) return;
        continue;
      }
      const double u = (low[k] - a[k]) / d[k], v = (high[k] - a[k]) / d[k];
      t0 = std::max(t0, std::min(u, v));
      t1 = std::min(t1, std::max(u, v));
    }
    if (t0 > t1) return;
    b = a + d * t1;
    a = a + d * t0;
    const glm::dvec2 e = b - a;
    const double square = glm::dot(e, e);
    // Row by row along the segment: columns within reach only.
    const int j0 = std::max(y0, static_cast<int>(std::floor(std::min(a.y, b.y) - half - 1.0))),
              j1 = std::min(y1, static_cast<int>(std::ceil(std::max(a.y, b.y) + half + 1.0)));
    for (int j = j0; j < j1; ++j) {
      double xa = std::min(a.x, b.x), xb = std::max(a.x, b.x);
      if (std::abs(e.y) > 1e-9) {
        const double u = std::clamp((j - half - 1.0 - a.y) / e.y, 0.0, 1.0), v = std::clamp((j + 2.0 + half - a.y) / e.y, 0.0, 1.0);
        xa = std::min(a.x + u * e.x, a.x + v * e.x);
        xb = std::max(a.x + u * e.x, a.x + v * e.x);
      }
      const int i0 = std::max(x0, static_cast<int>(std::floor(xa - half - 1.0))),
                i1 = std::min(x1, static_cast<int>(std::ceil(xb + half + 1.0)));
      for (int i = i0; i < i1; ++i) {
        const glm::dvec2 p(i + 0.5 - a.x, j + 0.5 - a.y);
        const double t = square > 0.0 ? std::clamp(glm::dot(p, e) / square, 0.0, 1.0) : 0.0;
        float c = static_cast<float>(std::clamp(half + 0.5 - glm::length(p - t * e), 0.0, 1.0) * std::min(1.0, width));
        if (dash > 0.0 && std::fmod(travelled + t * std::sqrt(square), 2.0 * dash) > dash) c = 0.0f;
        float& value = cover[std::size_t(j - y0) * w + (i - x0)];
        value = std::max(value, c);
      }
    }
  };
  for (std::size_t k = 0; k + 1 < points.size(); ++k) {
    const glm::dvec2 a = points[k], b = points[k + 1];
    if (!(std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(b.x) && std::isfinite(b.y))) continue;
    segment(a, b);
    travelled += glm::length(b - a);
  }
  return out;
}

void blend_cover(Image& image, const LineCover& cover, const glm::vec3& color, float opacity, int x_end) {
  const int x1 = std::min(cover.x + cover.width, x_end);
  for (int j = 0; j < cover.height; ++j) {
    const float* row = &cover.values[std::size_t(j) * cover.width];
    for (int i = cover.x; i < x1; ++i)
      if (const float c = row[i - cover.x]; c > 0.0f) blend_pixel(image, i, cover.y + j, color, opacity * c);
  }
}

void draw_polyline(Image& image, std::span<const glm::dvec2> points, double width, const Paint& paint, double dash,
                   const glm::dvec4* clip) {
  blend_cover(image, cover_polyline(image.width, image.height, points, width, dash, clip), paint.color, paint.opacity, image.width);
}

void fill_disc(Image& image, double x, double y, double radius, const glm::vec3& color, float opacity) {
  if (!std::isfinite(x) || !std::isfinite(y)) return;
  const int x0 = static_cast<int>(std::clamp(std::floor(x - radius - 1.0), 0.0, double(image.width))),
            x1 = static_cast<int>(std::clamp(std::ceil(x + radius + 1.0), 0.0, double(image.width)));
  const int y0 = static_cast<int>(std::clamp(std::floor(y - radius - 1.0), 0.0, double(image.height))),
            y1 = static_cast<int>(std::clamp(std::ceil(y + radius + 1.0), 0.0, double(image.height)));
  for (int j = y0; j < y1; ++j)
    for (int i = x0; i < x1; ++i)
      blend_pixel(image, i, j, color,
                  opacity * static_cast<float>(std::clamp(radius + 0.5 - std::hypot(i + 0.5 - x, j + 0.5 - y), 0.0, 1.0)));
}

void fill_polygon(Image& image, std::span<const glm::dvec2> points, const glm::vec3& color, float opacity) {
  if (points.size() < 3) return;
  glm::dvec2 lower(1e300), upper(-1e300);
  for (const glm::dvec2& p : points) {
    lower = glm::min(lower, p);
    upper = glm::max(upper, p);
  }
  const auto inside = [&](double x, double y) {
    bool in = false;
    for (std::size_t i = 0, j = points.size() - 1; i < points.size(); j = i++)
      if ((points[i].y > y) != (points[j].y > y) &&
          x < (points[j].x - points[i].x) * (y - points[i].y) / (points[j].y - points[i].y) + points[i].x)
        in = !in;
    return in;
  };
  const int x0 = std::max(0, static_cast<int>(std::floor(lower.x))), x1 = std::min(image.width, static_cast<int>(std::ceil(upper.x)));
  const int y0 = std::max(0, static_cast<int>(std::floor(lower.y))), y1 = std::min(image.height, static_cast<int>(std::ceil(upper.y)));
  for (int j = y0; j < y1; ++j)
    for (int i = x0; i < x1; ++i) {
      int hits = 0;
      for (int s = 0; s < 16; ++s) hits += inside(i + 0.125 + 0.25 * (s & 3), j + 0.125 + 0.25 * (s >> 2));
      if (hits) blend_pixel(image, i, j, color, opacity * static_cast<float>(hits) / 16.0f);
    }
}

}  // namespace flexframe::render
