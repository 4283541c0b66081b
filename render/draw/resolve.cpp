#include "render/draw/resolve.h"

#include "render/base/srgb.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace flexframe::render {
namespace {

// The shells of one row of samples, composed: premultiplied linear colour (0..16383) and alpha. Row by row: a field of the whole picture
// would cost more to clear and to fetch than to fill.
class ShellRow {
 public:
  using Value = std::array<float, 4>;

  explicit ShellRow(const std::vector<GhostLayer>& layers) : layers_(layers) {
    for (const GhostLayer& l : layers) width_ = std::max(width_, l.x + l.width);
    values_.resize(static_cast<std::size_t>(width_));
  }

  // Composes row y of the samples.
  void compose(int y) {
    if (first_ <= last_) std::fill(values_.begin() + first_, values_.begin() + last_ + 1, Value{});
    first_ = width_;
    last_ = -1;
    in_row_.clear();
    int x0 = width_, x1 = 0;
    for (const GhostLayer& l : layers_)
      if (y >= l.y && y < l.y + l.height) {
        in_row_.push_back(&l);
        x0 = std::min(x0, l.x);
        x1 = std::max(x1, l.x + l.width);
      }
    for (int x = x0; x < x1; ++x) {
      entries_.clear();
      for (std::size_t i = 0; i < in_row_.size(); ++i) {
        const GhostLayer& l = *in_row_[i];
        const int lx = x - l.x;
        if (lx < 0 || lx >= l.width) continue;
        const std::size_t k = std::size_t(y - l.y) * l.width + lx;
        if (l.colors[4 * k + 3] == 0) continue;
        entries_.push_back({l.depth.empty() ? 0.0f : l.depth[k], static_cast<int>(i), &l.colors[4 * k]});
      }
      if (entries_.empty()) continue;
      first_ = std::min(first_, x);
      last_ = x;
      // Front first: reversed depth is greater in front.
      if (entries_.size() > 1)
        std::sort(entries_.begin(), entries_.end(),
                  [](const Entry& a, const Entry& b) { return a.depth != b.depth ? a.depth > b.depth : a.layer < b.layer; });
      Value& out = values_[static_cast<std::size_t>(x)];
      for (const Entry& e : entries_) {
        const float a = static_cast<float>(e.color[3]) / 255.0f * (1.0f - out[3]);
        for (int k = 0; k < 3; ++k) out[k] += a * static_cast<float>(root_[e.color[k]]);
        out[3] += a;
      }
    }
  }

  // Null: no shell at this sample of the row.
  const Value* at(int x) const {
    return x < first_ || x > last_ || values_[static_cast<std::size_t>(x)][3] <= 0.0f ? nullptr : &values_[static_cast<std::size_t>(x)];
  }
  bool empty() const { return first_ > last_; }

 private:
  struct Entry {
    float depth;
    int layer;
    const std::uint8_t* color;
  };
  const std::vector<GhostLayer>& layers_;
  const std::array<std::uint16_t, 256>& root_ = root_table();
  int width_ = 0, first_ = 0, last_ = -1;  // samples of the row that have shells lie in first..last
  std::vector<Value> values_;
  std::vector<Entry> entries_;
  std::vector<const GhostLayer*> in_row_;
};

}  // namespace

void darken_backdrop(Image& image, const PixelRect& area, const Mask& shadow, const Mask& occlusion) {
  const PixelRect part = joined(shadow.part, occlusion.part);
  const auto& linear = linear_table();
  const auto& srgb = srgb_table();
  for (int y = part.y; y < part.y + part.height; ++y) {
    const std::uint8_t *dark = shadow.row(y), *dim = occlusion.row(y);
    if (!dark && !dim) continue;
    // Eight values of a mask's row at once; `whole` is taken back where its rim lies among them.
    bool whole = true;
    const auto eight = [&whole](const std::uint8_t* row, const PixelRect& r, int x, std::uint64_t outside) {
      if (!row || x + 8 <= r.x || x >= r.x + r.width) return outside;
      if (x < r.x || x + 8 > r.x + r.width) whole = false;
      else std::memcpy(&outside, row + (x - r.x), 8);
      return outside;
    };
    for (int x = part.x; x < part.x + part.width; ++x) {
      // Most pixels keep their light.
      if (x + 8 <= part.x + part.width) {
        whole = true;
        const std::uint64_t taken8 = eight(dark, shadow.part, x, 0), left8 = eight(dim, occlusion.part, x, ~std::uint64_t(0));
        if (whole && taken8 == 0 && left8 == ~std::uint64_t(0)) {
          x += 7;
          continue;
        }
      }
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

// What a pixel is made of, and where it goes.
struct PixelOut {
  const Image* image;
  std::uint8_t* out;
  int count;     // samples
  float scale;   // from a sum over samples of linear light to an index of srgb_table
  float darken;  // share of the light that occlusion leaves to surfaces
};

// A pixel of surfaces and backdrop without shells. Occlusion takes the light of the surroundings, not that of the key light, and none
// of lines and markers.
template <int per_pixel>
void average_surfaces(const PixelOut& to, const std::uint8_t* first, std::size_t stride, int n, int covered) {
  const auto &linear = linear_table(), &root = root_table();
  const auto& srgb = srgb_table();
  if (per_pixel > 0) n = per_pixel;
  if (per_pixel == 2 && covered == 4 && to.image->channels == 3) {
    // Four samples of surfaces: their sum is the index, times what occlusion leaves.
    const std::uint8_t *a = first, *b = first + stride;
    if (a[3] != 255 && a[7] != 255 && b[3] != 255 && b[7] != 255) {
      for (int k = 0; k < 3; ++k) {
        const unsigned sum = static_cast<unsigned>(root[a[k]]) + root[a[k + 4]] + root[b[k]] + root[b[k + 4]];
        to.out[k] = srgb[static_cast<std::size_t>(to.darken < 1.0f ? rounded(to.darken * static_cast<float>(sum)) : static_cast<int>(sum))];
      }
      return;
    }
  }
  unsigned lit[3] = {}, full[3] = {};  // of surfaces; of lines and markers
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const std::uint8_t* p = first + j * stride + std::size_t(i) * 4;
      if (p[3] == 0) continue;
      unsigned* sum = p[3] == 255 ? full : lit;
      for (int k = 0; k < 3; ++k) sum[k] += root[p[k]];
    }
  const bool has_alpha = to.image->channels == 4;
  const float rest = static_cast<float>(to.count - covered),
              behind = has_alpha && covered < to.count ? static_cast<float>(to.out[3]) / 255.0f : 1.0f;
  const float alpha = (static_cast<float>(covered) + rest * behind) / static_cast<float>(to.count);
  const float unit = has_alpha ? (alpha > 0.0f ? to.scale / alpha : 0.0f) : to.scale;
  for (int k = 0; k < 3; ++k) {
    float sum = static_cast<float>(full[k]) + to.darken * static_cast<float>(lit[k]);
    if (covered < to.count) sum += rest * behind * static_cast<float>(linear[to.out[k]]);
    to.out[k] = srgb[static_cast<std::size_t>(std::min(rounded(sum * unit), 65535))];
  }
  if (has_alpha) to.out[3] = static_cast<std::uint8_t>(rounded(255.0f * std::min(alpha, 1.0f)));
}

// A pixel over whose samples shells lie.
void average_shells(const PixelOut& to, const std::uint8_t* first, std::size_t stride, int n, const std::vector<ShellRow>& shells, int sx) {
  const auto &linear = linear_table(), &root = root_table();
  const auto& srgb = srgb_table();
  const bool has_alpha = to.image->channels == 4;
  // Backdrop in linear light, premultiplied.
  float back[4] = {};
  back[3] = has_alpha ? static_cast<float>(to.out[3]) / 255.0f : 1.0f;
  for (int k = 0; k < 3; ++k) back[k] = static_cast<float>(linear[to.out[k]]) * back[3];
  float sum[4] = {};
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const std::uint8_t* p = first + j * stride + std::size_t(i) * 4;
      float c[4];
      if (p[3] == 0) {
        std::copy_n(back, 4, c);
      } else {
        const float light = p[3] == 255 ? 1.0f : to.darken;
        for (int k = 0; k < 3; ++k) c[k] = static_cast<float>(root[p[k]]) * light;
        c[3] = 1.0f;
      }
      if (const ShellRow::Value* g = shells[static_cast<std::size_t>(j)].at(sx + i))
        for (int k = 0; k < 4; ++k) c[k] = (*g)[k] + (1.0f - (*g)[3]) * c[k];
      for (int k = 0; k < 4; ++k) sum[k] += c[k];
    }
  const float alpha = sum[3] / static_cast<float>(to.count);
  const float unit = has_alpha ? (alpha > 0.0f ? to.scale / alpha : 0.0f) : to.scale;
  for (int k = 0; k < 3; ++k) to.out[k] = srgb[static_cast<std::size_t>(std::min(rounded(sum[k] * unit), 65535))];
  if (has_alpha) to.out[3] = static_cast<std::uint8_t>(rounded(255.0f * std::min(alpha, 1.0f)));
}

// per_pixel: samples along a pixel's side, known when compiled where it is the usual one; 0: any.
template <int per_pixel>
void average(Image& image, const PixelRect& area, const Samples& samples, const std::vector<GhostLayer>& ghosts, const Mask& occlusion) {
  const int n = per_pixel > 0 ? per_pixel : samples.per_pixel, count = n * n;
  std::vector<ShellRow> shells(ghosts.empty() ? 0u : static_cast<std::size_t>(n), ShellRow(ghosts));
  PixelOut to{&image, nullptr, count, 65532.0f / 16383.0f / static_cast<float>(count), 1.0f};
  const std::size_t stride = std::size_t(samples.width) * 4;
  const PixelRect& part = samples.part;
  const auto& srgb_of_root = srgb_of_root_table();

  for (int y = 0; y < part.height; ++y) {
    std::uint8_t* out_row = &image.pixels[(std::size_t(area.y + part.y + y) * image.width + area.x + part.x) * image.channels];
    // Samples are stored from the bottom.
    const int sy0 = (part.height - 1 - y) * n;
    const std::uint8_t* row = &samples.colors[sy0 * stride];
    bool shell_row = false;
    for (std::size_t j = 0; j < shells.size(); ++j) {
      shells[j].compose(sy0 + static_cast<int>(j));
      shell_row = shell_row || !shells[j].empty();
    }
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
      to.out = out_row + std::size_t(x) * image.channels;

      // Share of surface samples, and whether all samples are one colour.
      int covered = 0;
      bool uniform = true, shell = false;
      std::uint32_t word = 0;
      std::memcpy(&word, first, 4);
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const std::uint8_t* p = first + j * stride + std::size_t(i) * 4;
          std::uint32_t w = 0;
          std::memcpy(&w, p, 4);
          uniform = uniform && w == word;
          covered += p[3] != 0;
          shell = shell || (shell_row && shells[static_cast<std::size_t>(j)].at(sx0 + i));
        }
      if (covered == 0 && !shell) continue;
      const unsigned left = occlusion.at(part.x + x, part.y + y, 255);
      to.darken = left == 255 ? 1.0f : 0.25f + 0.75f * static_cast<float>(left) / 255.0f;
      if (shell) {
        average_shells(to, first, stride, n, shells, sx0);
      } else if (uniform && (left == 255 || first[3] == 255)) {
        // One colour as it is.
        for (int k = 0; k < 3; ++k) to.out[k] = srgb_of_root[first[k]];
        if (image.channels == 4) to.out[3] = 255;
      } else {
        average_surfaces<per_pixel>(to, first, stride, n, covered);
      }
    }
  }
}

}  // namespace

void resolve(Image& image, const PixelRect& area, const Samples& samples, const std::vector<GhostLayer>& ghosts, const Mask& occlusion) {
  if (samples.per_pixel == 2) average<2>(image, area, samples, ghosts, occlusion);
  else average<0>(image, area, samples, ghosts, occlusion);
}

namespace {

// Premultiplied linear light 0..1 of a backdrop's pixel.
glm::vec4 light_of(const std::uint8_t* p) {
  const float a = static_cast<float>(p[3]) / 255.0f, share = a / 16383.0f;
  const auto& linear = linear_table();
  return {share * static_cast<float>(linear[p[0]]), share * static_cast<float>(linear[p[1]]), share * static_cast<float>(linear[p[2]]), a};
}

void put_light(const glm::vec4& light, std::uint16_t* out) {
  const float unit = light.w > 0.0f ? 1.0f / light.w : 0.0f;
  for (int k = 0; k < 3; ++k) out[k] = static_cast<std::uint16_t>(rounded(65535.0f * std::min(light[k] * unit, 1.0f)));
  out[3] = static_cast<std::uint16_t>(rounded(65535.0f * std::min(light.w, 1.0f)));
}

}  // namespace

Image16 linear_backdrop(const Image& backdrop) {
  Image16 image{backdrop.width, backdrop.height, 4, std::vector<std::uint16_t>(backdrop.pixels.size())};
  for (std::size_t i = 0; i + 3 < backdrop.pixels.size(); i += 4) put_light(light_of(&backdrop.pixels[i]), &image.pixels[i]);
  return image;
}

void resolve_linear(Image16& image, const Image& backdrop, const PixelRect& area, const Samples& samples,
                    const std::vector<GhostLayer>& ghosts, const Mask& occlusion) {
  const int n = samples.per_pixel;
  std::vector<ShellRow> shells(ghosts.empty() ? 0u : static_cast<std::size_t>(n), ShellRow(ghosts));
  const PixelRect& part = samples.part;
  for (int y = 0; y < area.height; ++y)
    for (int x = 0; x < area.width; ++x) {
      const std::size_t at = 4 * (std::size_t(area.y + y) * image.width + area.x + x);
      put_light(light_of(&backdrop.pixels[at]), &image.pixels[at]);
    }
  for (int y = 0; y < part.height; ++y) {
    const int bottom = (part.height - 1 - y) * n;  // samples are stored from the bottom
    for (std::size_t j = 0; j < shells.size(); ++j) shells[j].compose(bottom + static_cast<int>(j));
    for (int x = 0; x < part.width; ++x) {
      const std::size_t at = 4 * (std::size_t(area.y + part.y + y) * image.width + area.x + part.x + x);
      const glm::vec4 behind = light_of(&backdrop.pixels[at]);
      const float left = static_cast<float>(occlusion.at(part.x + x, part.y + y, 255)) / 255.0f;
      glm::vec4 sum(0.0f);
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const std::size_t k = 4 * (std::size_t(bottom + j) * samples.width + std::size_t(x) * n + i);
          const std::uint8_t mark = samples.colors[k + 3];
          glm::vec4 c = behind;
          if (mark != 0) {
            const float light = mark == 255 || left == 1.0f ? 1.0f : 0.25f + 0.75f * left;
            for (int q = 0; q < 3; ++q) {
              const float root = static_cast<float>(samples.fine[k + static_cast<std::size_t>(q)]) / 65535.0f;
              c[q] = root * root * light;
            }
            c.w = 1.0f;
          }
          if (const ShellRow::Value* g = shells.empty() ? nullptr : shells[static_cast<std::size_t>(j)].at(x * n + i))
            c = glm::vec4((*g)[0], (*g)[1], (*g)[2], 16383.0f * (*g)[3]) / 16383.0f + (1.0f - (*g)[3]) * c;
          sum += c;
        }
      put_light(sum / static_cast<float>(n * n), &image.pixels[at]);
    }
  }
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
    for (std::size_t c = 0; c < 3; ++c) {
      samples.colors[4 * k + c] = static_cast<std::uint8_t>(24 + 3 * c);
      if (samples.fine.size() == samples.colors.size()) samples.fine[4 * k + c] = static_cast<std::uint16_t>(257 * (24 + 3 * c));
    }
}

}  // namespace flexframe::render
