#include "render/image/image_compare.h"

#include "render/base/srgb.h"
#include "render/picture/colormap.h"
#include "sim/base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace flexframe::render {
namespace {

using Plane = std::vector<float>;
constexpr double pi = std::numbers::pi;

struct Kernel {
  int radius = 0;
  std::vector<double> weights;  // 2 radius + 1
};

template <class Function>
Kernel make_kernel(int radius, Function function) {
  Kernel k{radius, {}};
  for (int i = -radius; i <= radius; ++i) k.weights.push_back(function(i));
  return k;
}

// Rows then columns; the border repeats.
Plane convolve(const Plane& in, int width, int height, const Kernel& kx, const Kernel& ky) {
  Plane middle(in.size()), out(in.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      double sum = 0.0;
      for (int i = -kx.radius; i <= kx.radius; ++i)
        sum += kx.weights[i + kx.radius] * static_cast<double>(in[std::size_t(y) * width + std::clamp(x + i, 0, width - 1)]);
      middle[std::size_t(y) * width + x] = static_cast<float>(sum);
    }
  std::vector<double> row(width);
  for (int y = 0; y < height; ++y) {
    std::fill(row.begin(), row.end(), 0.0);
    for (int j = -ky.radius; j <= ky.radius; ++j) {
      const float* from = &middle[std::size_t(std::clamp(y + j, 0, height - 1)) * width];
      const double w = ky.weights[j + ky.radius];
      for (int x = 0; x < width; ++x) row[x] += w * static_cast<double>(from[x]);
    }
    for (int x = 0; x < width; ++x) out[std::size_t(y) * width + x] = static_cast<float>(row[x]);
  }
  return out;
}

// sRGB 0..1 over white.
glm::dvec3 color_at(const Image& image, std::size_t pixel) {
  const std::uint8_t* p = &image.pixels[pixel * image.channels];
  if (image.channels == 1) return glm::dvec3(p[0] / 255.0);
  const double a = image.channels == 4 ? p[3] / 255.0 : 1.0;
  return a * glm::dvec3(p[0], p[1], p[2]) / 255.0 + (1.0 - a);
}

Plane luma(const Image& image) {
  Plane plane(std::size_t(image.width) * image.height);
  for (std::size_t i = 0; i < plane.size(); ++i)
    plane[i] = static_cast<float>(255.0 * glm::dot(color_at(image, i), glm::dvec3(0.299, 0.587, 0.114)));
  return plane;
}

// D65.
const glm::dvec3 white(0.950428545, 1.0, 1.088900371);
const glm::dmat3 xyz_from_rgb(glm::dvec3(0.41238656, 0.21263682, 0.01933062), glm::dvec3(0.35759149, 0.71518298, 0.11919716),
                              glm::dvec3(0.18045049, 0.0721802, 0.95037259));

// YCxCz of Zhang and Wandell: L*a*b* without the cube root, additive under blurring.
glm::dvec3 ycxcz_of_xyz(const glm::dvec3& xyz) {
  const glm::dvec3 n = xyz / white;
  return {116.0 * n.y - 16.0, 500.0 * (n.x - n.y), 200.0 * (n.y - n.z)};
}

glm::dvec3 xyz_of_ycxcz(const glm::dvec3& c) {
  const double y = (c.x + 16.0) / 116.0;
  return glm::dvec3(c.y / 500.0 + y, y, y - c.z / 200.0) * white;
}

// L*a*b* with chroma scaled by lightness (Hunt effect).
glm::dvec3 hunt_lab(const glm::dvec3& rgb) {
  const glm::dvec3 n = xyz_from_rgb * rgb / white;
  const auto f = [](double t) { return t > 216.0 / 24389.0 ? std::cbrt(t) : (24389.0 / 27.0 * t + 16.0) / 116.0; };
  const double fx = f(n.x), fy = f(n.y), fz = f(n.z), lightness = 116.0 * fy - 16.0;
  return {lightness, 0.01 * lightness * 500.0 * (fx - fy), 0.01 * lightness * 200.0 * (fy - fz)};
}

double hyab(const glm::dvec3& a, const glm::dvec3& b) { return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z); }

constexpr int flip_reach = 10;                 // px: the widest of its filters, `radius` and `reach` in perceive
constexpr double pixels_per_degree = 67.0206;  // a 0.7 m wide display of 3840 pixels seen from 0.7 m

struct Perceived {
  std::vector<glm::dvec3> lab;  // after the eye's filter
  Plane edge, point;            // strength of features
};

Perceived perceive(const Image& image) {
  const int w = image.width, h = image.height;
  const std::size_t n = std::size_t(w) * h;
  std::array<Plane, 3> opponent;
  Plane gray(n);
  for (Plane& p : opponent) p.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const glm::dvec3 s = color_at(image, i);
    const glm::dvec3 rgb(linear_from_srgb(static_cast<float>(s.x)), linear_from_srgb(static_cast<float>(s.y)),
                         linear_from_srgb(static_cast<float>(s.z)));
    const glm::dvec3 c = ycxcz_of_xyz(xyz_from_rgb * rgb);
    for (int k = 0; k < 3; ++k) opponent[k][i] = static_cast<float>(c[k]);
    gray[i] = static_cast<float>((c.x + 16.0) / 116.0);
  }

  // Contrast sensitivity: sums of Gaussians a sqrt(pi / b) exp(-pi^2 x^2 / b), x in degrees.
  struct Lobe {
    double a, b;
  };
  static const std::array<std::vector<Lobe>, 3> sensitivity = {{{{1.0, 0.0047}}, {{1.0, 0.0053}}, {{34.1, 0.04}, {13.5, 0.025}}}};
  const int radius = static_cast<int>(std::ceil(3.0 * std::sqrt(0.04 / (2.0 * pi * pi)) * pixels_per_degree));
  std::array<Plane, 3> filtered;
  for (int k = 0; k < 3; ++k) {
    filtered[k].assign(n, 0.0f);
    double total = 0.0;
    std::vector<std::pair<Kernel, double>> parts;
    for (const Lobe& lobe : sensitivity[k]) {
      Kernel g = make_kernel(radius, [&](int i) {
        const double x = i / pixels_per_degree;
        return std::exp(-pi * pi * x * x / lobe.b);
      });
      double sum = 0.0;
      for (const double v : g.weights) sum += v;
      const double scale = lobe.a * std::sqrt(pi / lobe.b);
      total += scale * sum * sum;
      parts.emplace_back(std::move(g), scale);
    }
    for (const auto& [g, scale] : parts) {
      const Plane blurred = convolve(opponent[k], w, h, g, g);
      for (std::size_t i = 0; i < n; ++i) filtered[k][i] += static_cast<float>(scale / total * static_cast<double>(blurred[i]));
    }
  }
  Perceived out;
  out.lab.resize(n);
  const glm::dmat3 rgb_from_xyz = glm::inverse(xyz_from_rgb);
  for (std::size_t i = 0; i < n; ++i) {
    const glm::dvec3 rgb = rgb_from_xyz * xyz_of_ycxcz(glm::dvec3(filtered[0][i], filtered[1][i], filtered[2][i]));
    out.lab[i] = hunt_lab(glm::clamp(rgb, 0.0, 1.0));
  }

  // Edges and points: first and second derivatives of a Gaussian as wide as the eye's feature detectors, 0.082 degrees;
  // positive and negative weights of each sum to one.
  const double sd = 0.5 * 0.082 * pixels_per_degree;
  const int reach = static_cast<int>(std::ceil(3.0 * sd));
  const auto gauss = [&](int i) { return std::exp(-0.5 * i * i / (sd * sd)); };
  Kernel smooth = make_kernel(reach, gauss), first = make_kernel(reach, [&](int i) { return -i * gauss(i); }),
         second = make_kernel(reach, [&](int i) { return (i * i / (sd * sd) - 1.0) * gauss(i); });
  const auto balance = [](Kernel& k) {
    double positive = 0.0, negative = 0.0;
    for (const double v : k.weights) (v > 0.0 ? positive : negative) += v;
    for (double& v : k.weights) v /= v > 0.0 ? positive : (negative != 0.0 ? -negative : 1.0);
  };
  balance(smooth);
  balance(first);
  balance(second);
  const Plane ex = convolve(gray, w, h, first, smooth), ey = convolve(gray, w, h, smooth, first);
  const Plane px = convolve(gray, w, h, second, smooth), py = convolve(gray, w, h, smooth, second);
  out.edge.resize(n);
  out.point.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    out.edge[i] = std::hypot(ex[i], ey[i]);
    out.point[i] = std::hypot(px[i], py[i]);
  }
  return out;
}

void need_same_size(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height) throw ArgumentError("pictures of different size");
}

// The box of all pixels that differ, grown by `margin` on every side within the picture; the whole picture where it is not worth cutting.
PixelBox differing_part(const Image& a, const Image& b, int margin) {
  const PixelBox whole{0, 0, a.width, a.height};
  if (a.channels != b.channels) return whole;
  const std::size_t row = std::size_t(a.width) * a.channels;
  int left = a.width, right = -1, top = a.height, bottom = -1;
  for (int y = 0; y < a.height; ++y) {
    const auto p = a.pixels.begin() + static_cast<std::ptrdiff_t>(y * row), q = b.pixels.begin() + static_cast<std::ptrdiff_t>(y * row);
    if (std::equal(p, p + static_cast<std::ptrdiff_t>(row), q)) continue;
    top = std::min(top, y);
    bottom = y;
    for (std::size_t i = 0; i < row; ++i)
      if (p[static_cast<std::ptrdiff_t>(i)] != q[static_cast<std::ptrdiff_t>(i)]) {
        left = std::min(left, static_cast<int>(i) / a.channels);
        right = std::max(right, static_cast<int>(i) / a.channels);
      }
  }
  if (right < 0) return {};
  const int x = std::max(0, left - margin), y = std::max(0, top - margin);
  return {x, y, std::min(a.width, right + margin + 1) - x, std::min(a.height, bottom + margin + 1) - y};
}

}  // namespace

Image cut_out(const Image& image, const PixelBox& box) {
  if (box.x < 0 || box.y < 0 || box.width < 1 || box.height < 1 || box.x + box.width > image.width || box.y + box.height > image.height)
    throw ArgumentError("a part of a picture reaches beyond it");
  if (box == PixelBox{0, 0, image.width, image.height}) return image;
  Image out{box.width, box.height, image.channels, {}};
  const std::size_t row = std::size_t(image.width) * image.channels, part = std::size_t(box.width) * image.channels;
  out.pixels.reserve(part * box.height);
  for (int y = box.y; y < box.y + box.height; ++y) {
    const auto from = image.pixels.begin() + static_cast<std::ptrdiff_t>(y * row + std::size_t(box.x) * image.channels);
    out.pixels.insert(out.pixels.end(), from, from + static_cast<std::ptrdiff_t>(part));
  }
  return out;
}

// Both measures look at the part that differs and what its filters reach: beyond it SSIM is 1 and FLIP 0 exactly.
double compute_ssim(const Image& whole_a, const Image& whole_b) {
  need_same_size(whole_a, whole_b);
  const PixelBox part = differing_part(whole_a, whole_b, 10);
  if (part.width == 0) return 1.0;
  const Image a = cut_out(whole_a, part), b = cut_out(whole_b, part);
  const int w = a.width, h = a.height;
  Kernel g = make_kernel(5, [](int i) { return std::exp(-0.5 * i * i / 2.25); });
  double sum = 0.0;
  for (const double v : g.weights) sum += v;
  for (double& v : g.weights) v /= sum;
  const Plane x = luma(a), y = luma(b);
  Plane xx(x.size()), yy(x.size()), xy(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) xx[i] = x[i] * x[i], yy[i] = y[i] * y[i], xy[i] = x[i] * y[i];
  const Plane mx = convolve(x, w, h, g, g), my = convolve(y, w, h, g, g), mxx = convolve(xx, w, h, g, g), myy = convolve(yy, w, h, g, g),
              mxy = convolve(xy, w, h, g, g);
  const double c1 = 6.5025, c2 = 58.5225;  // (0.01 * 255)^2, (0.03 * 255)^2
  const double all = double(whole_a.width) * whole_a.height;
  double total = all - static_cast<double>(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double p = mx[i], q = my[i], vx = mxx[i] - p * p, vy = myy[i] - q * q, c = mxy[i] - p * q;
    total += (2.0 * p * q + c1) * (2.0 * c + c2) / ((p * p + q * q + c1) * (vx + vy + c2));
  }
  return total / all;
}

double compute_flip(const Image& whole_reference, const Image& whole_test, Image* heat) {
  need_same_size(whole_reference, whole_test);
  const int width = whole_reference.width;
  if (heat) {
    *heat = make_image(width, whole_reference.height, 3);
    const glm::vec3 none = 255.0f * colormap_color(Colormap::inferno, 0.0);
    for (std::size_t i = 0; i < heat->pixels.size(); ++i) heat->pixels[i] = static_cast<std::uint8_t>(rounded(none[int(i % 3)]));
  }
  const PixelBox part = differing_part(whole_reference, whole_test, 2 * flip_reach);
  if (part.width == 0) return 0.0;
  const Image reference = cut_out(whole_reference, part), test = cut_out(whole_test, part);
  const Perceived a = perceive(reference), b = perceive(test);
  const double largest = std::pow(hyab(hunt_lab({0, 1, 0}), hunt_lab({0, 0, 1})), 0.7), knee = 0.4 * largest;
  double total = 0.0;
  for (std::size_t i = 0; i < a.lab.size(); ++i) {
    const double e = std::pow(hyab(a.lab[i], b.lab[i]), 0.7);
    const double color = e < knee ? 0.95 / knee * e : std::min(1.0, 0.95 + (e - knee) / (largest - knee) * 0.05);
    const double feature =
        std::sqrt(std::max(std::abs(static_cast<double>(a.edge[i] - b.edge[i])), std::abs(static_cast<double>(a.point[i] - b.point[i]))) /
                  std::numbers::sqrt2);
    const double flip = std::pow(color, 1.0 - std::min(feature, 1.0));
    total += flip;
    if (heat) {
      const glm::vec3 c = 255.0f * colormap_color(Colormap::inferno, flip);
      const std::size_t n = std::size_t(part.width), to = (part.y + i / n) * width + part.x + i % n;
      for (int k = 0; k < 3; ++k) heat->pixels[3 * to + k] = static_cast<std::uint8_t>(rounded(c[k]));
    }
  }
  return total / (double(width) * whole_reference.height);
}

namespace {

// The most pixels that touch one another, by sides or corners, and differ by more than `levels`, and the largest sum of such a group.
struct Groups {
  long count = 0, weight = 0;
};
Groups largest_groups(const std::vector<int>& differences, int levels, int width) {
  Groups most;
  const int height = static_cast<int>(differences.size()) / width;
  std::vector<std::uint8_t> marked(differences.size());
  for (std::size_t i = 0; i < differences.size(); ++i) marked[i] = differences[i] > levels;
  std::vector<std::size_t> open;
  for (std::size_t start = 0; start < marked.size(); ++start) {
    if (!marked[start]) continue;
    Groups group;
    marked[start] = 0;
    open.assign(1, start);
    while (!open.empty()) {
      const std::size_t at = open.back();
      open.pop_back();
      ++group.count;
      group.weight += differences[at];
      const int x = static_cast<int>(at % static_cast<std::size_t>(width)), y = static_cast<int>(at / static_cast<std::size_t>(width));
      for (int v = std::max(0, y - 1); v <= std::min(height - 1, y + 1); ++v)
        for (int u = std::max(0, x - 1); u <= std::min(width - 1, x + 1); ++u) {
          const std::size_t k = std::size_t(v) * width + u;
          if (!marked[k]) continue;
          marked[k] = 0;
          open.push_back(k);
        }
    }
    most = {std::max(most.count, group.count), std::max(most.weight, group.weight)};
  }
  return most;
}

// The sums of signed differences over fields of 64 x 64 pixels; those at the right and lower rim are larger by what is left.
class Fields {
 public:
  Fields(int width, int height) : columns_(std::max(1, width / side)), rows_(std::max(1, height / side)) {
    sums_.resize(std::size_t(columns_) * rows_);
  }
  void add(int x, int y, int channel, int difference) { field(x, y).sum[static_cast<std::size_t>(channel)] += difference; }
  void count(int x, int y) { ++field(x, y).pixels; }
  // The largest mean of a field; of less than a quarter of one single pixels would be too much of it.
  double largest() const {
    double most = 0.0;
    for (const Field& f : sums_)
      for (const long sum : f.sum)
        if (4 * f.pixels >= long{side} * side) most = std::max(most, std::abs(static_cast<double>(sum)) / static_cast<double>(f.pixels));
    return most;
  }

 private:
  static constexpr int side = 64;
  struct Field {
    std::array<long, 4> sum{};
    long pixels = 0;
  };
  Field& field(int x, int y) {
    return sums_[std::size_t(std::min(y / side, rows_ - 1)) * static_cast<std::size_t>(columns_) + std::min(x / side, columns_ - 1)];
  }
  int columns_, rows_;
  std::vector<Field> sums_;
};

// The first of the limits that a difference breaks; empty: none.
std::string broken_limit(const ImageDifference& d, const Groups& strong, const Groups& faint, double local, const Gate& gate) {
  if (d.share_over > gate.share) return fmt::format("{} pixels off by more than {}", d.pixels_over, gate.levels);
  if (strong.count >= gate.cluster) return fmt::format("{} touching pixels off by more than {}", strong.count, gate.cluster_levels);
  if (strong.weight > gate.weight) return fmt::format("touching pixels off by {} in all", strong.weight);
  if (faint.count >= gate.faint) return fmt::format("{} touching pixels off by more than {}", faint.count, gate.faint_levels);
  if (d.mean > gate.mean) return fmt::format("mean {:.4g}", d.mean);
  if (local > gate.local) return fmt::format("a field of 64 x 64 pixels off by {:.3g} in the mean", local);
  return {};
}

// What is looked at: an empty span is everything. Throws if it does not fit.
long count_ignored(std::span<const std::uint8_t> ignored, std::size_t pixels) {
  if (ignored.empty()) return 0;
  if (ignored.size() != pixels)
    throw ArgumentError(fmt::format("{} pixels are marked as ignored or not, the pictures have {}", ignored.size(), pixels));
  const auto looked_at = std::count(ignored.begin(), ignored.end(), std::uint8_t{0});
  if (looked_at == 0) throw ArgumentError("all pixels of a picture are ignored: nothing is compared");
  return static_cast<long>(pixels) - static_cast<long>(looked_at);
}

// The smallest box with all pixels that differ by more than `levels`.
PixelBox box_over(const std::vector<int>& differences, int width, int levels) {
  int left = width, right = -1, top = -1, bottom = -1;
  for (std::size_t i = 0; i < differences.size(); ++i) {
    if (differences[i] <= levels) continue;
    const int x = static_cast<int>(i % static_cast<std::size_t>(width)), y = static_cast<int>(i / static_cast<std::size_t>(width));
    left = std::min(left, x);
    right = std::max(right, x);
    if (top < 0) top = y;
    bottom = y;
  }
  return right < 0 ? PixelBox{} : PixelBox{left, top, right - left + 1, bottom - top + 1};
}

// Over the channels of all pixels that are looked at; the largest of a field.
struct Means {
  double all = 0.0, field = 0.0;
};

// The gate on the difference of every pixel (its largest channel), row by row, 0 where it is ignored.
void judge(ImageDifference& d, const std::vector<int>& differences, int width, const Means& means, const Gate& gate, bool exact) {
  for (const int difference : differences) {
    d.largest = std::max(d.largest, difference);
    d.pixels_over += difference > gate.levels;
  }
  Groups strong, faint;
  if (d.largest > gate.cluster_levels) strong = largest_groups(differences, gate.cluster_levels, width);
  if (d.largest > gate.faint_levels) faint = largest_groups(differences, gate.faint_levels, width);
  d.cluster = strong.count;
  d.equal = d.largest == 0;
  d.mean = means.all;
  d.box = box_over(differences, width, d.pixels_over > 0 ? gate.levels : 0);
  d.share_over = static_cast<double>(d.pixels_over) / static_cast<double>(static_cast<long>(differences.size()) - d.ignored);
  if (d.equal) d.broken.clear();
  else if (exact) d.broken = "pixels that are not equal";
  else d.broken = broken_limit(d, strong, faint, means.field, gate);
  d.passes = d.broken.empty();
}

// The candidate with the baseline's pixels where it is ignored.
Image with_ignored(const Image& baseline, const Image& candidate, std::span<const std::uint8_t> ignored) {
  Image out = candidate;
  for (std::size_t i = 0; i < ignored.size(); ++i) {
    if (!ignored[i]) continue;
    for (int k = 0; k < out.channels; ++k)
      out.pixels[i * out.channels + k] = k < baseline.channels ? baseline.pixels[i * baseline.channels + k] : 255;
  }
  return out;
}

}  // namespace

ImageDifference compare_images(const Image& baseline, const Image& candidate, const CompareOptions& options) {
  ImageDifference d;
  d.same_size = baseline.width == candidate.width && baseline.height == candidate.height;
  if (!d.same_size) return d;
  const std::size_t n = std::size_t(baseline.width) * baseline.height;
  d.ignored = count_ignored(options.ignored, n);
  d.equal = baseline == candidate;
  if (d.equal) {
    d.passes = true;
    return d;
  }
  // Channels that only one of the two has: opaque.
  const int channels = std::max(baseline.channels, candidate.channels);
  const auto value = [](const Image& image, std::size_t i, int k) -> int {
    if (k < image.channels) return image.pixels[i * image.channels + k];
    return k == 3 ? 255 : image.pixels[i * image.channels];
  };
  double sum = 0.0;
  std::vector<int> differences(n, 0);
  bool colours_unseen = false;
  Fields fields(baseline.width, baseline.height);
  for (std::size_t i = 0; i < n; ++i) {
    if (!options.ignored.empty() && options.ignored[i]) continue;
    const int x = static_cast<int>(i) % baseline.width, y = static_cast<int>(i) / baseline.width;
    fields.count(x, y);
    // What is transparent in both has no colour.
    const bool unseen = channels == 4 && value(baseline, i, 3) == 0 && value(candidate, i, 3) == 0 && !options.exact;
    for (int k = 0; k < channels; ++k) {
      const int difference = value(candidate, i, k) - value(baseline, i, k);
      if (difference == 0) continue;
      if (unseen) {
        colours_unseen = true;
        continue;
      }
      differences[i] = std::max(differences[i], std::abs(difference));
      sum += std::abs(difference);
      fields.add(x, y, k, difference);
    }
  }
  const double values = static_cast<double>(static_cast<long>(n) - d.ignored) * channels;
  judge(d, differences, baseline.width, {sum / values, fields.largest()}, options.gate, options.exact);
  d.equal = d.equal && !colours_unseen;
  if (options.measures && !d.equal) {
    const Image looked_at = with_ignored(baseline, candidate, options.ignored);
    d.ssim = compute_ssim(baseline, looked_at);
    d.flip = compute_flip(baseline, looked_at, &d.heat);
    d.measured = true;
  }
  return d;
}

ImageDifference compare_images(const Image16& baseline, const Image16& candidate, const CompareOptions& options) {
  ImageDifference d;
  d.full = 65535;
  d.same_size = baseline.width == candidate.width && baseline.height == candidate.height && baseline.channels == candidate.channels;
  if (!d.same_size) return d;
  std::vector<int> differences(std::size_t(baseline.width) * baseline.height, 0);
  d.ignored = count_ignored(options.ignored, differences.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < baseline.pixels.size(); ++i) {
    const std::size_t at = i / baseline.channels;
    if (!options.ignored.empty() && options.ignored[at]) continue;
    const int difference = std::abs(int(baseline.pixels[i]) - int(candidate.pixels[i]));
    int& pixel = differences[at];
    pixel = std::max(pixel, difference);
    sum += difference;
  }
  const long looked_at = static_cast<long>(differences.size()) - d.ignored;
  judge(d, differences, baseline.width, {sum / (static_cast<double>(looked_at) * baseline.channels), 0.0}, options.deep, options.exact);
  if (!options.measures || d.equal) return d;
  d.heat = make_image(baseline.width, baseline.height, 3);
  for (std::size_t i = 0; i < differences.size(); ++i) {
    const glm::vec3 c = 255.0f * colormap_color(Colormap::inferno, double(differences[i]) / d.largest);
    for (int k = 0; k < 3; ++k) d.heat.pixels[3 * i + k] = static_cast<std::uint8_t>(rounded(c[k]));
  }
  return d;
}

}  // namespace flexframe::render
