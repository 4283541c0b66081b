#include "render/image/pdf_sheet.h"

#include "render/base/deflate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace flexframe::render {
namespace {

std::string color_words(const glm::vec3& color, const char* operation) {
  const glm::vec3 c = glm::clamp(color, 0.0f, 1.0f);
  return fmt::format("{:.4g} {:.4g} {:.4g} {}\n", c.x, c.y, c.z, operation);
}

// Chooses an opacity; the page lists those that are used.
std::string opacity_words(PdfSheet& sheet, float opacity) {
  const int share = static_cast<int>(std::lround(1000.0f * std::clamp(opacity, 0.0f, 1.0f)));
  sheet.opacities.insert(share);
  return fmt::format("/A{} gs\n", share);
}

std::string point(const glm::dvec2& p) {
  // Far outside, numbers would only get long.
  const glm::dvec2 q = glm::clamp(p, glm::dvec2(-1e5), glm::dvec2(1e5));
  return fmt::format("{:.2f} {:.2f}", q.x, q.y);
}

void fill(PdfSheet& sheet, const std::string& path, const Paint& paint, bool even_odd = false) {
  if (path.empty()) return;
  sheet.body += opacity_words(sheet, paint.opacity) + color_words(paint.color, "rg") + path + (even_odd ? "f*\n" : "f\n");
}

// Corners as quarters of circles: cubic curves whose handles are this share of the radius are within 0.03 % of them.
constexpr double handle = 0.5522847498;

std::string rounded_path(const Box& b, double r) {
  const double x1 = b.x + b.width, y1 = b.y + b.height, h = r * (1.0 - handle);
  std::string path = fmt::format("{} m\n{} l\n", point({b.x + r, b.y}), point({x1 - r, b.y}));
  const auto curve = [&](const glm::dvec2& a, const glm::dvec2& c, const glm::dvec2& to) {
    path += fmt::format("{} {} {} c\n", point(a), point(c), point(to));
  };
  curve({x1 - h, b.y}, {x1, b.y + h}, {x1, b.y + r});
  path += point({x1, y1 - r}) + " l\n";
  curve({x1, y1 - h}, {x1 - h, y1}, {x1 - r, y1});
  path += point({b.x + r, y1}) + " l\n";
  curve({b.x + h, y1}, {b.x, y1 - h}, {b.x, y1 - r});
  path += point({b.x, b.y + r}) + " l\n";
  curve({b.x, b.y + h}, {b.x + h, b.y}, {b.x + r, b.y});
  return path + "h\n";
}

// The letters' outlines; turned: a quarter counterclockwise about the point.
std::string text_path(const glm::dvec2& at, std::string_view text, double size, Weight weight, bool turned) {
  const auto place = [&](const glm::dvec2& p) { return point(at + (turned ? glm::dvec2(p.y, -p.x) : p)); };
  std::string path;
  bool open = false;
  for (const OutlineStep& step : text_outline(text, size, weight)) {
    if (step.kind == OutlineStep::move && open) path += "h\n";
    if (step.kind == OutlineStep::move) path += place(step.to) + " m\n";
    else if (step.kind == OutlineStep::line) path += place(step.to) + " l\n";
    else path += fmt::format("{} {} {} c\n", place(step.first), place(step.second), place(step.to));
    open = true;
  }
  return open ? path + "h\n" : path;
}

}  // namespace

void fill_rectangle(PdfSheet& sheet, const Box& box, const Paint& paint, double corner) {
  if (!(box.width > 0.0 && box.height > 0.0)) return;
  const double r = std::min({corner, 0.5 * box.width, 0.5 * box.height});
  fill(sheet, r > 0.0 ? rounded_path(box, r) : fmt::format("{} {:.2f} {:.2f} re\n", point({box.x, box.y}), box.width, box.height), paint);
}

void draw_frame(PdfSheet& sheet, const Box& box, double line, const Paint& paint) {
  sheet.body += opacity_words(sheet, paint.opacity) + color_words(paint.color, "RG") +
                fmt::format("{:.2f} w 0 j [] 0 d\n{} {:.2f} {:.2f} re S\n", line, point({box.x + 0.5 * line, box.y + 0.5 * line}),
                            box.width - line, box.height - line);
}

void draw_polyline(PdfSheet& sheet, std::span<const glm::dvec2> points, double width, const Paint& paint, double dash,
                   const glm::dvec4* clip) {
  // Points that are not finite interrupt it; a piece of one point is a dot: a line of no length with round ends.
  std::string path;
  bool open = false, alone = false;
  glm::dvec2 last(0.0);
  const auto finish = [&] {
    if (open && alone) path += point(last) + " l\n";
    open = false;
  };
  for (const glm::dvec2& p : points) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) {
      finish();
      continue;
    }
    if (open && glm::length(p - last) < 0.05 && &p != &points.back()) continue;
    path += point(p) + (open ? " l\n" : " m\n");
    alone = !open;
    open = true;
    last = p;
  }
  finish();
  if (path.empty()) return;
  if (clip) sheet.body += fmt::format("q {} {:.2f} {:.2f} re W n\n", point({clip->x, clip->y}), clip->z, clip->w);
  sheet.body += opacity_words(sheet, paint.opacity) + color_words(paint.color, "RG") +
                fmt::format("{:.2f} w 1 J 1 j {} 0 d\n{}S\n", width, dash > 0.0 ? fmt::format("[{:.2f}]", dash) : "[]", path);
  if (clip) sheet.body += "Q\n";
}

void fill_disc(PdfSheet& sheet, double x, double y, double radius, const glm::vec3& color, float opacity) {
  if (radius > 0.0) fill(sheet, rounded_path({x - radius, y - radius, 2.0 * radius, 2.0 * radius}, radius), {color, opacity});
}

void fill_polygon(PdfSheet& sheet, std::span<const glm::dvec2> points, const glm::vec3& color, float opacity) {
  std::string path;
  for (const glm::dvec2& p : points) path += point(p) + (path.empty() ? " m\n" : " l\n");
  if (!path.empty()) fill(sheet, path + "h\n", {color, opacity}, true);
}

void draw_text(PdfSheet& sheet, const glm::dvec2& at, std::string_view text, double size, const Paint& paint, Weight weight) {
  fill(sheet, text_path(at, text, size, weight, false), paint);
}

void draw_text_rim(PdfSheet& sheet, const glm::dvec2& at, std::string_view text, double size, const glm::vec3& color, Weight weight) {
  const std::string path = text_path(at, text, size, weight, false);
  if (path.empty()) return;
  sheet.body += opacity_words(sheet, 1.0f) + color_words(color, "RG") + color_words(color, "rg") +
                fmt::format("{:.2f} w 1 j [] 0 d\n{}B\n", size / 4.5, path);
}

void draw_text_upwards(PdfSheet& sheet, const glm::dvec2& at, std::string_view text, double size, const Paint& paint, Weight weight) {
  fill(sheet, text_path(at, text, size, weight, true), paint);
}

namespace {

// The file, object by object, and where each begins.
class PdfFile {
 public:
  explicit PdfFile(const std::string& note) {
    text_ = "%PDF-1.4\n";
    if (!note.empty()) text_ += "% " + note + "\n";
    text_ += "%\xe2\xe3\xcf\xd3\n";  // bytes beyond ASCII: no program takes it for text
  }
  void add(const std::string& object) {
    begins_.push_back(text_.size());
    text_ += fmt::format("{} 0 obj\n{}\nendobj\n", begins_.size(), object);
  }
  void add_stream(const std::string& words, std::span<const std::uint8_t> bytes) {
    const std::vector<std::uint8_t> packed = compress(bytes, Container::zlib, 6);
    std::string object = fmt::format("<< {} /Filter /FlateDecode /Length {} >>\nstream\n", words, packed.size());
    object.append(packed.begin(), packed.end());
    add(object + "\nendstream");
  }
  std::string finish() {
    const std::size_t table = text_.size();
    text_ += fmt::format("xref\n0 {}\n0000000000 65535 f \n", begins_.size() + 1);
    for (const std::size_t at : begins_) text_ += fmt::format("{:010} 00000 n \n", at);
    text_ += fmt::format("trailer\n<< /Size {} /Root 1 0 R >>\nstartxref\n{}\n%%EOF\n", begins_.size() + 1, table);
    return std::move(text_);
  }

 private:
  std::string text_;
  std::vector<std::size_t> begins_;
};

std::string image_words(const Image& image, const char* space) {
  return fmt::format("/Type /XObject /Subtype /Image /Width {} /Height {} /ColorSpace /{} /BitsPerComponent 8", image.width, image.height,
                     space);
}

}  // namespace

std::string pdf_text(const PdfSheet& sheet, const PdfPage& page) {
  // A point is a 72nd of an inch.
  const double unit = 72.0 / (page.dpi > 0.0 ? page.dpi : 96.0);
  std::string states;
  for (const int share : sheet.opacities) states += fmt::format("/A{0} << /ca {1:.3f} /CA {1:.3f} >> ", share, share / 1000.0);
  PdfFile file(page.note);
  file.add("<< /Type /Catalog /Pages 2 0 R >>");
  file.add("<< /Type /Pages /Kids [3 0 R] /Count 1 >>");
  file.add(
      fmt::format("<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {:.4f} {:.4f}] /Contents 4 0 R /Resources << /ExtGState << {}>>{} >> >>",
                  unit * sheet.width, unit * sheet.height, states, page.below ? " /XObject << /Scene 5 0 R >>" : ""));

  // From pixels with y down to the page's points with y up.
  std::string content = fmt::format("{:.6f} 0 0 {:.6f} 0 {:.4f} cm\n", unit, -unit, unit * sheet.height);
  if (page.below) content += fmt::format("q {} 0 0 {} 0 {} cm /Scene Do Q\n", sheet.width, -sheet.height, sheet.height);
  content += sheet.body;
  file.add_stream("", {reinterpret_cast<const std::uint8_t*>(content.data()), content.size()});

  if (page.below) {
    const Image& image = *page.below;
    if (image.channels == 3) {
      file.add_stream(image_words(image, "DeviceRGB"), image.pixels);
    } else {
      std::vector<std::uint8_t> color, alpha;
      for (std::size_t i = 0; i + 3 < image.pixels.size(); i += 4) {
        color.insert(color.end(), {image.pixels[i], image.pixels[i + 1], image.pixels[i + 2]});
        alpha.push_back(image.pixels[i + 3]);
      }
      file.add_stream(image_words(image, "DeviceRGB") + " /SMask 6 0 R", color);
      file.add_stream(image_words(image, "DeviceGray"), alpha);
    }
  }
  return file.finish();
}

}  // namespace flexframe::render
