#include "render/draw/resolve.h"

#include "render/base/srgb.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace flexframe::render {
namespace {

// Shells of each sample in a rectangle, composed: premultiplied linear colour (0..16383) and alpha.
struct Shells {
  int x = 0, y = 0, width = 0, height = 0;
  std::vector<std::array<float, 4>> values;
  bool row(int sy) const { return sy >= y && sy < y + height; }
  const std::array<float, 4>* at(int sx, int sy) const {
    if (sx < x || sx >= x + width || sy < y || sy >= y + height) return nullptr;
    return &values[std::size_t(sy - y) * width + (sx - x)];
  }
};

Shells compose_shells(const std::vector<GhostLayer>& layers) {
  Shells s;
  if (layers.empty()) return s;
  int x1 = 0, y1 = 0;
  s.x = s.y = 1 << 30;
  for (const GhostLayer& l : layers) {
    s.x = std::min(s.x, l.x);
    s.y = std::min(s.y, l.y);
    x1 = std::max(x1, l.x + l.width);
    y1 = std::max(y1, l.y + l.height);
  }
  s.width = std::max(0, x1 - s.x);
  s.height = std::max(0, y1 - s.y);
  s.values.assign(std::size_t(s.width) * s.height, {0.0f, 0.0f, 0.0f, 0.0f});
  const auto& linear = linear_table();

  struct Entry {
    float depth;
    int layer;
    const std::uint8_t* color;
  };
  std::vector<Entry> entries;
  std::vector<const GhostLayer*> in_row;
  for (int y = 0; y < s.height; ++y) {
    in_row.clear();
    for (const GhostLayer& l : layers)
      if (s.y + y >= l.y && s.y + y < l.y + l.height) in_row.push_back(&l);
    if (in_row.empty()) continue;
    for (int x = 0; x < s.width; ++x) {
      entries.clear();
      for (std::size_t i = 0; i < in_row.size(); ++i) {
        const GhostLayer& l = *in_row[i];
        const int lx = s.x + x - l.x;
        if (lx < 0 || lx >= l.width) continue;
        const std::size_t k = std::size_t(s.y + y - l.y) * l.width + lx;
        if (l.colors[4 * k + 3] == 0) continue;
        entries.push_back({l.depth.empty() ? 0.0f : l.depth[k], static_cast<int>(i), &l.colors[4 * k]});
      }
      if (entries.empty()) continue;
      // Front first: reversed depth is greater in front.
      if (entries.size() > 1)
        std::sort(entries.begin(), entries.end(),
                  [](const Entry& a, const Entry& b) { return a.depth != b.depth ? a.depth > b.depth : a.layer < b.layer; });
      std::array<float, 4>& out = s.values[std::size_t(y) * s.width + x];
      for (const Entry& e : entries) {
        const float a = static_cast<float>(e.color[3]) / 255.0f * (1.0f - out[3]);
        for (int k = 0; k < 3; ++k) out[k] += a * static_cast<float>(linear[e.color[k]]);
        out[3] += a;
      }
    }
  }
  return s;
}

}  // namespace

void darken_backdrop(Image& image, const PixelRect& area, const Mask& shadow, const Mask& occlusion) {
  const PixelRect part = joined(shadow.part, occlusion.part);
  const auto& linear = linear_table();
  const auto& srgb = srgb_table();
  for (int y = part.y; y < part.y + part.height; ++y) {
    const std::uint8_t *dark = shadow.row(y), *dim = occlusion.row(y);
    for (int x = part.x; x < part.x + part.width; ++x) {
      const unsigned taken = dark && x >= shadow.part.x && x < shadow.part.x + shadow.part.width ? dark[x - shadow.part.x] : 0u;
      const unsigned left = dim && x >= occlusion.part.x && x < occlusion.part.x + occlusion.part.width ? dim[x - occlusion.part.x] : 255u;
      if (taken == 0 && left == 255) continue;
      const float open = (1.0f - 0.42f * static_cast<float>(taken) / 255.0f) * (0.35f + 0.65f * static_cast<float>(left) / 255.0f);
      std::uint8_t* p = &image.pixels[(std::size_t(area.y + y) * image.width + area.x + x) * image.channels];
      if (image.channels == 4) {
        // Black over whatever will lie behind, in the proportion of the light taken.
        const float a = static_cast<float>(p[3]) / 255.0f, alpha = 1.0f - open * (1.0f - a);
        for (int k = 0; k < 3; ++k)
          p[k] = alpha > 0.0f ? srgb[static_cast<std::size_t>(rounded(4.0f * static_cast<float>(linear[p[k]]) * a * open / alpha))] : 0;
        p[3] = static_cast<std::uint8_t>(rounded(255.0f * alpha));
      } else {
        for (int k = 0; k < 3; ++k) p[k] = srgb[static_cast<std::size_t>(rounded(4.0f * static_cast<float>(linear[p[k]]) * open))];
      }
    }
  }
}

namespace {

// per_pixel: samples along a pixel's side, known when compiled where it is the usual one; 0: any.
// Long: one pass over the pixels, whose cases share the samples' rows and colours in registers.
template <int per_pixel>
void average(Image& image, const PixelRect& area, const Samples& samples, const std::vector<GhostLayer>& ghosts, const Mask& occlusion) {
  const int n = per_pixel > 0 ? per_pixel : samples.per_pixel, count = n * n;
  const auto& linear = linear_table();
  const auto& srgb = srgb_table();
  const Shells shells = compose_shells(ghosts);
  const bool has_alpha = image.channels == 4;
  const float scale = 65532.0f / 16383.0f / static_cast<float>(count);
  const std::size_t stride = std::size_t(samples.width) * 4;
  const PixelRect& part = samples.part;

  for (int y = 0; y < part.height; ++y) {
    std::uint8_t* out_row = &image.pixels[(std::size_t(area.y + part.y + y) * image.width + area.x + part.x) * image.channels];
    // Samples are stored from the bottom.
    const int sy0 = (part.height - 1 - y) * n;
    const std::uint8_t* row = &samples.colors[sy0 * stride];
    bool shell_row = false;
    for (int j = 0; j < n; ++j) shell_row = shell_row || shells.row(sy0 + j);
    for (int x = 0; x < part.width; ++x) {
      const int sx0 = x * n;
      const std::uint8_t* first = row + std::size_t(sx0) * 4;
      // Most pixels are backdrop: four empty samples are two zero words.
      if (n == 2 && !shell_row) {
        std::uint64_t lower = 0, upper = 0;
        std::memcpy(&lower, first, 8);
        std::memcpy(&upper, first + stride, 8);
        if ((lower | upper) == 0) continue;
      }
      std::uint8_t* out = out_row + std::size_t(x) * image.channels;

      // Share of surface samples, and whether all samples are one colour.
      int covered = 0;
      bool uniform = true;
      std::uint32_t word = 0;
      std::memcpy(&word, first, 4);
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const std::uint8_t* p = first + j * stride + std::size_t(i) * 4;
          std::uint32_t w = 0;
          std::memcpy(&w, p, 4);
          uniform = uniform && w == word;
          covered += p[3] != 0;
        }
      bool shell = false;
      if (shell_row)
        for (int j = 0; j < n && !shell; ++j)
          for (int i = 0; i < n && !shell; ++i) {
            const auto* g = shells.at(sx0 + i, sy0 + j);
            shell = g && (*g)[3] > 0.0f;
          }
      const unsigned left = occlusion.at(part.x + x, part.y + y, 255);

      // Plain cases: nothing but backdrop, or one surface colour as it is.
      if (covered == 0 && !shell) continue;
      if (covered == count && !shell && left == 255) {
        if (uniform) {
          std::memcpy(out, first, 3);
        } else {
          // With 2 x 2 samples the sum of one table's values is an index of the other.
          for (int k = 0; k < 3; ++k) {
            unsigned sum = 0;
            for (int j = 0; j < n; ++j)
              for (int i = 0; i < n; ++i) sum += linear[first[j * stride + std::size_t(i) * 4 + k]];
            out[k] = srgb[n == 2 ? sum : static_cast<std::size_t>(rounded(static_cast<float>(sum) * scale))];
          }
        }
        if (has_alpha) out[3] = 255;
        continue;
      }

      // Backdrop in linear light, premultiplied.
      float back[4] = {};
      if (covered < count || shell) {
        back[3] = has_alpha ? static_cast<float>(out[3]) / 255.0f : 1.0f;
        for (int k = 0; k < 3; ++k) back[k] = static_cast<float>(linear[out[k]]) * back[3];
      }
      // Occlusion takes the light of the surroundings, not that of the key light.
      const float darken = 0.25f + 0.75f * static_cast<float>(left) / 255.0f;
      float sum[4] = {};
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const std::uint8_t* p = first + j * stride + std::size_t(i) * 4;
          float c[4];
          if (p[3] == 0) {
            std::copy_n(back, 4, c);
          } else {
            const float light = p[3] == 255 ? 1.0f : darken;
            for (int k = 0; k < 3; ++k) c[k] = static_cast<float>(linear[p[k]]) * light;
            c[3] = 1.0f;
          }
          if (shell)
            if (const auto* g = shells.at(sx0 + i, sy0 + j))
              for (int k = 0; k < 4; ++k) c[k] = (*g)[k] + (1.0f - (*g)[3]) * c[k];
          for (int k = 0; k < 4; ++k) sum[k] += c[k];
        }
      const float alpha = sum[3] / static_cast<float>(count);
      const float unit = has_alpha ? (alpha > 0.0f ? scale / alpha : 0.0f) : scale;
      for (int k = 0; k < 3; ++k) out[k] = srgb[static_cast<std::size_t>(std::min(rounded(sum[k] * unit), 65535))];
      if (has_alpha) out[3] = static_cast<std::uint8_t>(rounded(255.0f * std::min(alpha, 1.0f)));
    }
  }
}

}  // namespace

void resolve(Image& image, const PixelRect& area, const Samples& samples, const std::vector<GhostLayer>& ghosts, const Mask& occlusion) {
  if (samples.per_pixel == 2) average<2>(image, area, samples, ghosts, occlusion);
  else average<0>(image, area, samples, ghosts, occlusion);
}

void draw_silhouettes(Samples& samples, const std::vector<bool>& outlined, int radius) {
  std::vector<std::array<int, 2>> disc;
  for (int j = -radius; j <= radius; ++j)
    for (int i = -radius; i <= radius; ++i)
      if ((i || j) && i * i + j * j <= radius * radius) disc.push_back({i, j});
  std::vector<std::size_t> dark;
  for (int y = 0; y < samples.height; ++y)
    for (int x = 0; x < samples.width; ++x) {
      const std::size_t k = std::size_t(y) * samples.width + x;
      const std::uint8_t mark = samples.colors[4 * k + 3];
      if (mark == 0 || !outlined[mark]) continue;
      for (const auto& d : disc) {
        const int qx = x + d[0], qy = y + d[1];
        if (qx < 0 || qy < 0 || qx >= samples.width || qy >= samples.height) continue;
        const std::size_t q = std::size_t(qy) * samples.width + qx;
        const std::uint8_t other = samples.colors[4 * q + 3];
        if (other == mark || other == 255 || (other != 0 && samples.depth[q] >= samples.depth[k])) continue;
        dark.push_back(k);
        break;
      }
    }
  for (const std::size_t k : dark)
    for (int c = 0; c < 3; ++c) samples.colors[4 * k + c] = static_cast<std::uint8_t>(24 + 3 * c);
}

}  // namespace flexframe::render
