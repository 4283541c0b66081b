#include "render/image/text.h"

#include "render/base/file.h"
#include "render/base/utf8.h"
#include "render/image/canvas.h"
#include "sim/base/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#define STB_TRUETYPE_IMPLEMENTATION
#define STBTT_STATIC
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wcast-qual"
#include <stb_truetype.h>
#pragma GCC diagnostic pop

namespace flexframe::render {
namespace {

constexpr std::array<const char*, 2> file_names = {"DejaVuSans.ttf", "DejaVuSans-Bold.ttf"};

std::filesystem::path find_font(Weight weight) {
  const char* name = file_names[static_cast<std::size_t>(weight)];
  std::string tried;
  const auto there = [&](const std::filesystem::path& path) {
    std::error_code none;
    if (std::filesystem::is_regular_file(path, none)) return true;
    tried += "\n  " + path.string();
    return false;
  };
  if (const char* chosen = std::getenv("FLEXFRAME_FONT"); chosen && *chosen) {
    std::error_code none;
    std::filesystem::path path =
        std::filesystem::is_directory(chosen, none) ? std::filesystem::path(chosen) / name : std::filesystem::path(chosen);
    if (there(path)) return path;
  }
  for (const char* folder : {"/usr/share/fonts/truetype/dejavu", "/usr/share/fonts/dejavu-sans-fonts", "/usr/share/fonts/dejavu",
                             "/usr/share/fonts/TTF", "/usr/local/share/fonts", "/usr/share/fonts/truetype/ttf-dejavu"})
    if (there(std::filesystem::path(folder) / name)) return std::filesystem::path(folder) / name;
  throw FileError(std::string("no font for the words in pictures: ") + name + " is in none of these places:" + tried +
                  "\n(Debian package fonts-dejavu-core; or set FLEXFRAME_FONT to a TrueType file or its folder)");
}

struct Glyph {
  int x = 0, y = 0, width = 0, height = 0;  // of the bitmap relative to the pen, y down
  std::vector<unsigned char> cover;
};

struct Font {
  std::vector<std::uint8_t> bytes;
  stbtt_fontinfo info{};
  double unit = 1.0;  // em in font units
  double cap = 0.73;  // of the em
  double down = 0.24;
  std::map<std::tuple<int, int, int>, Glyph> glyphs;  // glyph, size in 1/64 px, quarter of a pixel

  explicit Font(const std::filesystem::path& path) {
    bytes = read_file(path);
    const int offset = bytes.empty() ? -1 : stbtt_GetFontOffsetForIndex(bytes.data(), 0);
    if (offset < 0 || !stbtt_InitFont(&info, bytes.data(), offset)) throw FileError(path.string() + ": not a TrueType font");
    unit = 1.0 / static_cast<double>(stbtt_ScaleForMappingEmToPixels(&info, 1.0f));
    int d = 0, x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    stbtt_GetFontVMetrics(&info, nullptr, &d, nullptr);
    if (stbtt_GetCodepointBox(&info, 'H', &x0, &y0, &x1, &y1)) cap = y1 / unit;
    down = -d / unit;
  }

  const Glyph& glyph(int index, double size, int quarter) {
    const auto key = std::make_tuple(index, static_cast<int>(std::lround(size * 64.0)), quarter);
    const auto found = glyphs.find(key);
    if (found != glyphs.end()) return found->second;
    if (glyphs.size() > 4096) glyphs.clear();
    Glyph& g = glyphs[key];
    const float scale = static_cast<float>(size / unit), shift = 0.25f * static_cast<float>(quarter);
    int x1 = 0, y1 = 0;
    stbtt_GetGlyphBitmapBoxSubpixel(&info, index, scale, scale, shift, 0.0f, &g.x, &g.y, &x1, &y1);
    g.width = x1 - g.x;
    g.height = y1 - g.y;
    if (g.width > 0 && g.height > 0) {
      g.cover.resize(std::size_t(g.width) * g.height);
      stbtt_MakeGlyphBitmapSubpixel(&info, g.cover.data(), g.width, g.height, g.width, scale, scale, shift, 0.0f, index);
    }
    return g;
  }
};

// One font a weight and process, read when first needed; the lock guards the glyphs' cache.
std::mutex lock;
Font& font(Weight weight) {
  static std::array<std::unique_ptr<Font>, 2> fonts;
  auto& f = fonts[static_cast<std::size_t>(weight)];
  if (!f) f = std::make_unique<Font>(find_font(weight));
  return *f;
}

// Fonts for what DejaVu Sans lacks (Chinese, Japanese, Korean), where one is installed; read when first needed.
std::vector<std::unique_ptr<Font>>& fallback_fonts() {
  static std::vector<std::unique_ptr<Font>> fonts;
  static bool looked = false;
  if (looked) return fonts;
  looked = true;
  std::vector<std::string> files;
  if (const char* chosen = std::getenv("FLEXFRAME_FONT_FALLBACK"); chosen && *chosen) files.emplace_back(chosen);
  const std::string folder = "/usr/share/fonts/";
  for (const char* name : {"truetype/droid/DroidSansFallbackFull.ttf", "truetype/droid/DroidSansFallback.ttf",
                           "truetype/nanum/NanumGothic.ttf", "truetype/wqy/wqy-microhei.ttc", "truetype/wqy/wqy-zenhei.ttc",
                           "opentype/noto/NotoSansCJK-Regular.ttc", "truetype/arphic/uming.ttc", "truetype/unifont/unifont.ttf"})
    files.push_back(folder + name);
  for (const std::string& file : files) {
    std::error_code none;
    if (!std::filesystem::is_regular_file(file, none)) continue;
    try {
      fonts.push_back(std::make_unique<Font>(file));
    } catch (const std::runtime_error&) {
      // One that cannot be read is none.
    }
  }
  return fonts;
}

// The font that has a character, and its glyph there; the font asked for, with its box, where none has.
std::pair<Font*, int> find_glyph(Font& asked, int code) {
  const int index = stbtt_FindGlyphIndex(&asked.info, code);
  if (index != 0) return {&asked, index};
  for (const auto& other : fallback_fonts())
    if (const int found = stbtt_FindGlyphIndex(&other->info, code); found != 0) return {other.get(), found};
  return {&asked, 0};
}

// Calls visit(font, glyph index, pen position in pixels) and returns the advance.
template <class Visit>
double walk(Font& asked, std::string_view text, double size, Visit visit) {
  double pen = 0.0;
  int previous = 0;
  const Font* last = nullptr;
  while (!text.empty()) {
    const int code = next_character(text);
    // A line's end is a space here.
    const auto [f, index] = find_glyph(asked, code < 32 ? ' ' : code);
    if (previous && f == last) pen += stbtt_GetGlyphKernAdvance(&f->info, previous, index) * size / f->unit;
    visit(*f, index, pen);
    int advance = 0, bearing = 0;
    stbtt_GetGlyphHMetrics(&f->info, index, &advance, &bearing);
    pen += advance * size / f->unit;
    previous = index;
    last = f;
  }
  return pen;
}

}  // namespace

double text_width(std::string_view text, double size, Weight weight) {
  const std::scoped_lock guard(lock);
  return walk(font(weight), text, size, [](Font&, int, double) {});
}

double cap_height(double size) {
  const std::scoped_lock guard(lock);
  return font(Weight::regular).cap * size;
}

double descent(double size) {
  const std::scoped_lock guard(lock);
  return font(Weight::regular).down * size;
}

std::string fit_text(std::string_view text, double size, double width, Weight weight) {
  if (text_width(text, size, weight) <= width) return std::string(text);
  std::string best;
  std::string_view rest = text;
  while (!rest.empty()) {
    next_character(rest);
    const std::string candidate = std::string(text.substr(0, text.size() - rest.size())) + "…";
    if (text_width(candidate, size, weight) > width) break;
    best = candidate;
  }
  return best;
}

namespace {

// put(along, across, cover): pixels that the letters cover, cover of 255, from the start of the line and from its baseline downwards.
template <class Put>
void cover_letters(std::string_view text, double size, Weight weight, double start, const Put& put) {
  const std::scoped_lock guard(lock);
  walk(font(weight), text, size, [&](Font& f, int index, double pen) {
    // Whole pixels and quarters: letters keep their distances without blurring.
    const double at = std::round((start + pen) * 4.0) / 4.0, whole = std::floor(at);
    const Glyph& g = f.glyph(index, size, static_cast<int>((at - whole) * 4.0));
    for (int j = 0; j < g.height; ++j)
      for (int i = 0; i < g.width; ++i)
        if (const unsigned char c = g.cover[std::size_t(j) * g.width + i])
          put(static_cast<int>(whole) + g.x + i, g.y + j, static_cast<float>(c));
  });
}

}  // namespace

void draw_text(Image& image, const glm::dvec2& place, std::string_view text, double size, const Paint& paint, Weight weight) {
  const int baseline = static_cast<int>(std::lround(place.y));
  cover_letters(text, size, weight, place.x, [&](int along, int across, float cover) {
    blend_pixel(image, along, baseline + across, paint.color, paint.opacity * cover / 255.0f);
  });
}

void draw_text_upwards(Image& image, const glm::dvec2& place, std::string_view text, double size, const Paint& paint, Weight weight) {
  const int baseline = static_cast<int>(std::lround(place.x));
  cover_letters(text, size, weight, -place.y, [&](int along, int across, float cover) {
    blend_pixel(image, baseline + across, -along - 1, paint.color, paint.opacity * cover / 255.0f);
  });
}

void draw_text_rim(Image& image, const glm::dvec2& at, std::string_view text, double size, const glm::vec3& color, Weight weight) {
  const double reach = std::max(1.0, size / 9.0);
  for (int k = 0; k < 12; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / 12.0;
    draw_text(image, at + reach * glm::dvec2(std::cos(angle), std::sin(angle)), text, size, {color, 0.6f}, weight);
  }
}

std::vector<OutlineStep> text_outline(std::string_view text, double size, Weight weight) {
  const std::scoped_lock guard(lock);
  std::vector<OutlineStep> out;
  walk(font(weight), text, size, [&](Font& f, int index, double pen) {
    stbtt_vertex* shape = nullptr;
    const int count = stbtt_GetGlyphShape(&f.info, index, &shape);
    const double scale = size / f.unit;
    const auto place = [&](int x, int y) { return glm::dvec2(pen + scale * x, -scale * y); };
    glm::dvec2 last(0.0);
    for (int k = 0; k < count; ++k) {
      const stbtt_vertex& v = shape[k];
      const glm::dvec2 to = place(v.x, v.y), handle = place(v.cx, v.cy);
      if (v.type == STBTT_vmove) out.push_back({OutlineStep::move, to});
      else if (v.type == STBTT_vline) out.push_back({OutlineStep::line, to});
      // A quadratic curve is a cubic one whose handles lie two thirds of the way to its own.
      else if (v.type == STBTT_vcurve) out.push_back({OutlineStep::curve, to, last + (handle - last) / 1.5, to + (handle - to) / 1.5});
      else out.push_back({OutlineStep::curve, to, handle, place(v.cx1, v.cy1)});
      last = to;
    }
    stbtt_FreeShape(&f.info, shape);
  });
  return out;
}

std::string missing_characters(std::string_view text) {
  const std::scoped_lock guard(lock);
  Font& f = font(Weight::regular);
  std::string missing;
  while (!text.empty()) {
    const std::string_view before = text;
    const int code = next_character(text);
    const std::string_view character = before.substr(0, before.size() - text.size());
    if (code >= 32 && find_glyph(f, code).second == 0 && missing.find(character) == std::string::npos) missing += character;
  }
  return missing;
}

}  // namespace flexframe::render
