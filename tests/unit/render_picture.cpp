// Camera, colours, words and their places: all that needs no drawing.
#include "render/base/srgb.h"
#include "render/frame/camera.h"
#include "render/frame/layout.h"
#include "render/frame/overlay.h"
#include "render/frame/view.h"
#include "render/image/text.h"
#include "render/picture/colormap.h"
#include "render/picture/edges.h"
#include "sim/base/error.h"
#include "tests/unit/render_solids.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace flexframe::render::test_picture {
namespace {

std::vector<glm::dvec3> cloud(unsigned seed, double scale, const glm::dvec3& offset) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::vector<glm::dvec3> points;
  for (int i = 0; i < 60; ++i) points.push_back(offset + scale * glm::dvec3(u(random), 0.3 * u(random), 0.6 * u(random)));
  return points;
}

TEST(Camera, FitTouchesTheFreeRectangleAndLosesNothing) {
  for (unsigned seed = 1; seed <= 40; ++seed)
    for (const Projection projection : {Projection::perspective, Projection::orthographic})
      for (const Size size : {Size{1280, 720}, Size{300, 900}}) {
        const double scale = std::pow(10.0, double(seed % 7) - 3.0);
        const auto points = cloud(seed, scale, scale * glm::dvec3(100.0, -40.0, 3.0));
        FitOptions options;
        options.projection = projection;
        options.direction = glm::dvec3(0.3 * (seed % 3) - 0.3, -0.4, -1.0);
        options.insets = {0.05, 0.12, 0.1, 0.07};
        options.margin = 0.0;
        const Camera camera = fit_camera(points, size, options);
        Bounds bounds;
        for (const auto& p : points) bounds.add(p);
        const ViewFrame frame = make_view(camera, {0, 0, size.width, size.height}, bounds);
        glm::dvec2 lower(1e9), upper(-1e9);
        for (const auto& p : points) {
          glm::dvec2 at;
          ASSERT_TRUE(project(frame, p, at));
          lower = glm::min(lower, at);
          upper = glm::max(upper, at);
          const double depth = -(frame.view * glm::dvec4(p, 1.0)).z;
          EXPECT_GE(depth, frame.near);
          EXPECT_LE(depth, frame.far);
        }
        const double l = 0.05 * size.width, r = 0.88 * size.width, t = 0.1 * size.height, b = 0.93 * size.height, e = 1e-6 * size.width;
        EXPECT_GE(lower.x, l - e);
        EXPECT_LE(upper.x, r + e);
        EXPECT_GE(lower.y, t - e);
        EXPECT_LE(upper.y, b + e);
        // As large as possible: one direction is full.
        EXPECT_TRUE((lower.x < l + e && upper.x > r - e) || (lower.y < t + e && upper.y > b - e)) << seed;
      }
}

// A point beside the bar's label, which is wider than the bar: below it or beside it, and hardly smaller.
TEST(Camera, FitKeepsClearOfTheBarsLabel) {
  Picture p;
  p.size = {1280, 720};
  p.overlay.scalar_bar = ScalarBar{"elastic displacement", "mm", 1000.0};
  p.scalar_map.upper = 0.01;
  const std::vector<glm::dvec3> points = {{-1, 0.25, 0}, {1, 0.25, 0}, {0, -0.1, 0}};
  for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
    FitOptions options;
    options.direction = {0, 0, -1};
    options.projection = projection;
    const Layout layout = make_layout(p);
    options.insets = layout.insets;
    const auto over = [&](const Camera& camera) {
      Bounds bounds;
      for (const auto& q : points) bounds.add(q);
      const ViewFrame frame = make_view(camera, {0, 0, 1280, 720}, bounds);
      const TextLine& label = layout.bar.words.front();
      bool any = false;
      for (const auto& q : points) {
        glm::dvec2 at;
        EXPECT_TRUE(project(frame, q, at));
        any = any || (at.x > label.x && at.y > label.y - cap_height(label.size) && at.y < label.y);
      }
      return any;
    };
    // Without the label's own room the point lies over it: found by moving the picture's height.
    bool was = false;
    for (double lift = 0.0; lift < 0.6; lift += 0.02) {
      std::vector<glm::dvec3> lifted = points;
      lifted.push_back({0, 0.25 - lift - 0.3, 0});
      const Camera plain = fit_camera(lifted, p.size, options), clear = fit_camera(p, lifted, options);
      was = was || over(plain);
      EXPECT_FALSE(over(clear)) << lift;
      EXPECT_LE(clear.height, 1.12 * plain.height + 1e-12);
    }
    EXPECT_TRUE(was);
  }
}

TEST(Camera, FitOfNothingAndOfOnePointIsAView) {
  for (const std::vector<glm::dvec3>& points : {std::vector<glm::dvec3>{}, {glm::dvec3(3.0)}, {glm::dvec3(3.0), glm::dvec3(NAN)}}) {
    const Camera c = fit_camera(points, {640, 480}, {});
    EXPECT_TRUE(std::isfinite(c.position.x + c.target.y + c.up.z));
    EXPECT_GT(glm::length(c.position - c.target), 0.5);
  }
}

TEST(Camera, PathGoesThroughItsKeysSmoothly) {
  std::vector<CameraKey> keys(3);
  for (int i = 0; i < 3; ++i) {
    keys[i].t = i * i + 1.0;
    keys[i].camera.position = {double(i), i * 2.0, 5.0 - i};
  }
  for (const CameraKey& k : keys) EXPECT_LT(glm::length(camera_on_path(keys, k.t).position - k.camera.position), 1e-12);
  EXPECT_EQ(camera_on_path(keys, -5.0).position, keys[0].camera.position);
  const double h = 1e-6;
  const glm::dvec3 before = (camera_on_path(keys, 2.0).position - camera_on_path(keys, 2.0 - h).position) / h;
  const glm::dvec3 after = (camera_on_path(keys, 2.0 + h).position - camera_on_path(keys, 2.0).position) / h;
  EXPECT_LT(glm::length(before - after), 1e-4);
  keys[2].t = keys[1].t;
  EXPECT_THROW(camera_on_path(keys, 0.0), flexframe::ArgumentError);
  EXPECT_THROW(camera_on_path({}, 0.0), flexframe::ArgumentError);
}

TEST(Camera, OrbitKeepsDistanceAndHeight) {
  Camera c;
  c.position = {3, 2, 1};
  const Camera turned = orbit_camera(c, 90.0);
  EXPECT_NEAR(glm::length(turned.position - turned.target), glm::length(c.position - c.target), 1e-12);
  EXPECT_NEAR(turned.position.y, 2.0, 1e-12);
  EXPECT_LT(glm::length(orbit_camera(turned, 270.0).position - c.position), 1e-12);
}

TEST(Camera, PlanarMotionIsSeenOntoItsPlane) {
  std::vector<glm::dvec3> points;
  append_corners(points, {glm::dvec3(-1, -1, -0.02), glm::dvec3(1, 1, 0.02)});
  const FitOptions view = default_view(points, glm::dvec3(0, -9.81, 0));
  EXPECT_GT(-view.direction.z, 0.8);
  EXPECT_EQ(view.up, glm::dvec3(0, 1, 0));
  EXPECT_EQ(default_view(points, glm::dvec3(0)).up, glm::dvec3(0, 1, 0));
  const Ground ground = default_ground(points, view.up);
  EXPECT_LT(ground.point.y, -1.0);
}

TEST(Colormap, LightnessRisesWhereItShould) {
  const auto lightness = [](const glm::vec3& c) { return glm::dot(linear_from_srgb(c), glm::vec3(0.2126f, 0.7152f, 0.0722f)); };
  for (const Colormap map : {Colormap::viridis, Colormap::cividis, Colormap::inferno, Colormap::greys})
    for (int i = 1; i < 256; ++i)
      EXPECT_GT(lightness(colormap_color(map, i / 255.0)), lightness(colormap_color(map, (i - 1) / 255.0)) - 1e-4f)
          << colormap_names()[static_cast<std::size_t>(map)] << " " << i;
  // Diverging: lightest in the middle.
  for (int i = 1; i <= 120; ++i) {
    EXPECT_GE(lightness(colormap_color(Colormap::coolwarm, 0.5)), lightness(colormap_color(Colormap::coolwarm, 0.5 + i / 255.0)));
    EXPECT_GE(lightness(colormap_color(Colormap::coolwarm, 0.5)), lightness(colormap_color(Colormap::coolwarm, 0.5 - i / 255.0)));
  }
  // Published ends of viridis.
  const auto bytes = [](double t) { return glm::ivec3(glm::round(255.0f * colormap_color(Colormap::viridis, t))); };
  EXPECT_EQ(bytes(0.0), glm::ivec3(68, 1, 84));
  EXPECT_EQ(bytes(1.0), glm::ivec3(253, 231, 37));
}

TEST(Colormap, NoNumberIsGrey) { EXPECT_EQ(colormap_color(Colormap::turbo, NAN), glm::vec3(0.5f)); }

TEST(Ticks, AreRoundFewAndWithin) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  for (int i = 0; i < 2000; ++i) {
    const double scale = std::pow(10.0, 12.0 * u(random)), low = scale * u(random), high = low + scale * (1e-3 + std::abs(u(random)));
    const int most = 2 + i % 10;
    const Ticks t = make_ticks(low, high, most);
    EXPECT_LE(static_cast<int>(t.values.size()), most) << low << " " << high;
    const double factor = std::pow(10.0, t.exponent);
    for (const Tick& tick : t.values) {
      EXPECT_GE(tick.value * factor, low - 1e-9 * (high - low) - 1e-12 * scale);
      EXPECT_LE(tick.value * factor, high + 1e-9 * (high - low) + 1e-12 * scale);
      const double lead = t.step / std::pow(10.0, std::floor(std::log10(t.step) + 1e-9));
      EXPECT_TRUE(std::abs(lead - 1.0) < 1e-6 || std::abs(lead - 2.0) < 1e-6 || std::abs(lead - 5.0) < 1e-6) << lead;
    }
  }
  const Ticks simple = make_ticks(0.0, 1.1, 6);
  ASSERT_FALSE(simple.values.empty());
  EXPECT_EQ(simple.values.front().text, "0.0");
  EXPECT_EQ(make_ticks(-1.0, 1.0, 3).values.front().text, "−1");
  EXPECT_TRUE(make_ticks(1.0, 1.0, 5).values.empty());
  EXPECT_TRUE(make_ticks(0.0, NAN, 5).values.empty());
}

TEST(Text, MeasuresAddUpAndFitFits) {
  EXPECT_NEAR(text_width("aa", 20.0), 2.0 * text_width("a", 20.0), 1.0);
  EXPECT_NEAR(text_width("Flexframe", 40.0), 2.0 * text_width("Flexframe", 20.0), 1e-9);
  EXPECT_EQ(fit_text("short", 12.0, 500.0), "short");
  const std::string cut = fit_text("a title much too long for this", 12.0, 80.0);
  EXPECT_LE(text_width(cut, 12.0), 80.0);
  EXPECT_NE(cut.find("…"), std::string::npos);
  // Broken UTF-8 is drawn, not read past its end.
  EXPECT_GT(text_width("\xff\xc3", 12.0), 0.0);
}

TEST(Text, TimesHaveTheDecimalsThatTellPicturesApart) {
  EXPECT_EQ(time_text(0.4, 0.1, 1.6), "t = 0.4 s");
  EXPECT_EQ(time_text(0.4, 1.0 / 30.0, 1.6), "t = 0.400 s");
  EXPECT_EQ(time_text(2.0 / 30.0, 1.0 / 30.0, 1.6), "t = 0.067 s");
  EXPECT_EQ(time_text(0.0004, 1e-5, 0.002), "t = 0.40 ms");
  EXPECT_EQ(time_text(-1e-9, 0.1, 1.0), "t = 0.0 s");
  // The time of the sample, not a rounded one: eighths have three decimals, all pictures of the sequence alike.
  EXPECT_EQ(time_text(0.625, 0.125, 1.0), "t = 0.625 s");
  EXPECT_EQ(time_text(0.5, 0.125, 1.0), "t = 0.500 s");
  EXPECT_EQ(time_text(0.625, 1.0 / 24.0, 1.0), "t = 0.625 s");
  EXPECT_EQ(time_text(0.0125, 0.0025, 0.05), "t = 12.5 ms");
  EXPECT_EQ(scale_text(20.0), "× 20");
  // No time of a sequence is shown further off than a fortieth of its step.
  for (const double step : {1.0 / 24, 1.0 / 25, 1.0 / 30, 1.0 / 60, 0.2 / 30, 7e-5, 0.37})
    for (int k = 0; k < 50; ++k) {
      const std::string text = time_text(k * step, step, 1.0);
      EXPECT_NEAR(std::stod(text.substr(4)), k * step, 0.0251 * step) << text << " of " << k * step;
    }
}

TEST(Text, TimesOfARunThatBeginsAnywhere) {
  for (const double start : {0.0, 0.034327725876, -1.69153e-6, 12.5, 3.0001})
    for (const double step : {1.0 / 30, 0.0041, 0.2})
      for (int k = 0; k < 5; ++k) {
        const double t = start + k * step;
        std::string text = time_text(t, step, start + 10.0, start);
        if (const size_t minus = text.find("−"); minus != std::string::npos) text.replace(minus, 3, "-");
        EXPECT_NEAR(std::stod(text.substr(4)), t, 0.0251 * step) << text << " of " << t;
      }
}

TEST(Text, EndsOfLinesAreSpaces) {
  EXPECT_DOUBLE_EQ(text_width("a\nb\tc", 20.0), text_width("a b c", 20.0));
  SvgSheet sheet;
  draw_text(sheet, {0.0, 10.0},
            "a\nb\x01"
            "c",
            12.0, glm::vec3(0.0f));
  EXPECT_NE(sheet.body.find(">a b c<"), std::string::npos) << sheet.body;
}

TEST(Text, CharactersThatNoFontHasAreNamed) {
  EXPECT_EQ(missing_characters("Flexframe × µ² −"), "");
  // A private character: no font has it, fallback or not.
  EXPECT_EQ(missing_characters("a\uf8f0b"), "\uf8f0");
  const std::string kanji = missing_characters("\u6a5f");
  EXPECT_TRUE(kanji.empty() || kanji == "\u6a5f");
  EXPECT_GT(text_width("\u6a5f", 20.0), 8.0);
}

Picture full_overlay(Size size) {
  Picture p;
  p.size = size;
  p.bounds.add(glm::dvec3(-1.0));
  p.bounds.add(glm::dvec3(1.0));
  p.ground = Ground{};
  p.overlay.title = "A four-bar linkage with an elastic coupler and a long title";
  p.overlay.time = "t = 12.345 s";
  p.overlay.note = "solid: in scale, ghost: exaggerated × 20";
  p.overlay.scalar_bar = ScalarBar{"displacement magnitude", "mm", 1000.0};
  p.overlay.triad = true;
  p.overlay.legend = {{"in scale", {}, 1.0f}, {"exaggerated × 20", {}, 0.4f}, {"undeformed", {}, 0.3f}};
  p.scalar_map.upper = 0.0123;
  return p;
}

TEST(Layout, NothingIsClippedOrLiesOverSomethingElse) {
  static const std::vector<double> x = {0.0, 1.0, 2.0}, y = {-0.1, 0.3, 0.2};
  for (const Size size : {Size{320, 240}, Size{640, 480}, Size{1280, 720}, Size{1920, 1080}, Size{640, 360}, Size{3840, 2160},
                          Size{720, 1280}, Size{240, 320}, Size{160, 120}, Size{160, 90}, Size{200, 140}, Size{120, 90}})
    for (const int plots : {0, 1, 2})
      for (const PlotPlace place : {PlotPlace::below, PlotPlace::beside}) {
        Picture p = full_overlay(size);
        p.overlay.plot_place = place;
        for (int i = 0; i < plots; ++i)
          p.overlay.plots.push_back(
              {"t [s]", i == 0 ? "rod_middle.y [mm]" : "slider x [m]", {{"slider.x", x, y}, {"rod.middle", x, y}}, 0.5, {}, {}});
        const Layout layout = make_layout(p);
        struct Box {
          std::string name;
          double x0, y0, x1, y1;
        };
        std::vector<Box> boxes;
        const auto add = [&](const TextLine& t) {
          if (t.text.empty()) return;
          const double w = text_width(t.text, t.size, t.bold ? Weight::bold : Weight::regular);
          boxes.push_back({t.text, t.x, t.y - cap_height(t.size), t.x + w, t.y});
          EXPECT_GE(t.size, 9.0);
        };
        for (const TextLine& t : layout.words) add(t);
        if (layout.has_bar) {
          for (const TextLine& t : layout.bar.words) add(t);
          const PixelRect& b = layout.bar.bar;
          boxes.push_back({"bar", double(b.x), double(b.y), double(b.x + b.width), double(b.y + b.height)});
        }
        if (layout.has_legend)
          for (const TextLine& t : layout.legend.words) add(t);
        for (const glm::dvec2& c : layout.triads)
          boxes.push_back(
              {"triad", c.x - layout.triad_radius, c.y - layout.triad_radius, c.x + layout.triad_radius, c.y + layout.triad_radius});
        for (const PlotLayout& plot : layout.plots) {
          for (const TextLine& t : plot.words) add(t);
          for (const TextLine& t : plot.series) add(t);
          if (const TextLine& t = plot.y_label; !t.text.empty()) {
            const double w = text_width(t.text, t.size);
            boxes.push_back({t.text, t.x - cap_height(t.size), t.y - w, t.x, t.y});
            EXPECT_GE(t.y - w, plot.panel.y) << t.text << " " << size.width << " x " << size.height;
            EXPECT_LE(t.y, plot.panel.y + plot.panel.height) << t.text;
          }
          const PixelRect& a = plot.axes;
          boxes.push_back({"axes", double(a.x), double(a.y), double(a.x + a.width), double(a.y + a.height)});
        }
        for (std::size_t i = 0; i < boxes.size(); ++i) {
          const Box& a = boxes[i];
          EXPECT_GE(a.x0, -0.5) << a.name << " " << size.width;
          EXPECT_GE(a.y0, -0.5) << a.name << " " << size.width;
          EXPECT_LE(a.x1, size.width + 0.5) << a.name << " " << size.width;
          EXPECT_LE(a.y1, size.height + 0.5) << a.name << " " << size.width;
          for (std::size_t j = i + 1; j < boxes.size(); ++j) {
            const Box& b = boxes[j];
            const double over_x = std::min(a.x1, b.x1) - std::max(a.x0, b.x0), over_y = std::min(a.y1, b.y1) - std::max(a.y0, b.y0);
            EXPECT_FALSE(over_x > 0.5 && over_y > 0.5)
                << "'" << a.name << "' over '" << b.name << "' at " << size.width << " x " << size.height << ", plots " << plots;
          }
        }
        // The insets leave room for the scene.
        EXPECT_LT(layout.insets.left + layout.insets.right, 0.75) << size.width;
        EXPECT_LT(layout.insets.top + layout.insets.bottom, 0.75) << size.width;
      }
}

// An axis that points at the viewer is a dot, one that points away a cross in a ring: less of its colour.
TEST(Triad, AxesAlongTheLineOfSightSayWhichWay) {
  Picture p;
  p.size = {200, 150};
  p.bounds.add(glm::dvec3(-1.0));
  p.bounds.add(glm::dvec3(1.0));
  p.overlay.triad = true;
  const auto blue = [&](double z) {
    const Layout layout = make_layout(p);
    const std::vector<ViewFrame> frames = {make_view({.position = {0, 0, z}, .target = {0, 0, 0}}, layout.scene, p.bounds)};
    Image image = make_image(200, 150, 3, 255);
    PlotCache cache;
    draw_overlay(image, p, layout, {.frames = frames}, cache);
    int count = 0;
    for (size_t i = 0; i < image.pixels.size(); i += 3) count += image.pixels[i + 2] > image.pixels[i] + 80;
    return count;
  };
  const int dot = blue(5.0), cross = blue(-5.0);
  EXPECT_GT(cross, 5);
  EXPECT_GT(dot, 1.2 * cross) << dot << " and " << cross;
}

// Where there is no room for the whole caption, the short one stands in its place.
TEST(Layout, CaptionsWithoutRoomAreShort) {
  for (const int width : {160, 640}) {
    Picture p = full_overlay({width, 3 * width / 4});
    p.overlay.short_note = "ghost: × 20";
    const Layout layout = make_layout(p);
    const auto found = std::find_if(layout.words.begin(), layout.words.end(), [](const TextLine& w) { return w.text.ends_with("× 20"); });
    ASSERT_TRUE(found != layout.words.end()) << width;
    EXPECT_EQ(found->text, width == 160 ? p.overlay.short_note : p.overlay.note);
  }
}

// Both ends of the bar, where values lie beyond them.
TEST(Layout, EndsOfTheBarSayWhatLiesBeyond) {
  Picture p = full_overlay({640, 480});
  p.scalar_map.above = 1.0;
  p.scalar_map.below = -1.0;
  const Layout layout = make_layout(p);
  for (const char* sign : {"≥ ", "≤ "})
    EXPECT_TRUE(std::any_of(layout.bar.words.begin(), layout.bar.words.end(), [&](const TextLine& w) { return w.text.starts_with(sign); }))
        << sign;
}

TEST(Layout, LabelsOfPlotsKeepTheirUnit) {
  static const std::vector<double> x = {0.0, 1e-6, 2e-6}, y = {-1e-7, 3e-7, 2e-7};
  struct Case {
    std::string label, wanted;
  };
  for (const Case& c : {Case{"amplitude.3", "amplitude.3 [10⁻⁹]"}, Case{"tip.y [mm]", "tip.y [10⁻⁹ mm]"}, Case{"[rad/s]", "[10⁻⁹ rad/s]"},
                        Case{"", "[10⁻⁹]"}}) {
    Picture p;
    p.size = {1280, 720};
    p.overlay.plots.push_back({"t [s]", c.label, {{"one", x, y}}, 0.0, {}, {}});
    const Layout layout = make_layout(p);
    EXPECT_EQ(layout.plots[0].y_label.text, c.wanted);
    EXPECT_EQ(layout.plots[0].words.back().text, "t [10⁻⁶ s]");
  }
  // Any length in any panel: shortened, never without its unit, never out of the panel.
  for (const Size size : {Size{320, 240}, Size{640, 360}, Size{1280, 720}, Size{3840, 2160}})
    for (const std::string& name : {std::string("crank_speed"), std::string("angular velocity of the crank about its bearing"),
                                    std::string("Drehmoment_ÄÖÜ_µ_Welle_") + std::string(200, 'W')}) {
      Picture p;
      p.size = size;
      p.overlay.plots.push_back({"t [s]", name + " [rad/s]", {{name, x, y}}, 0.0, {}, {}});
      const PlotLayout plot = make_layout(p).plots[0];
      if (plot.y_label.text.empty()) continue;
      EXPECT_TRUE(plot.y_label.text.ends_with("[10⁻⁹ rad/s]")) << plot.y_label.text;
      EXPECT_LE(text_width(plot.y_label.text, plot.y_label.size), plot.panel.height);
    }
}

// Numbers without their power of ten are other numbers: it and the unit stand somewhere however small the panels are.
TEST(Layout, NumbersOfNarrowPlotsKeepPowerAndUnit) {
  static const std::vector<double> x = {0.0, 1e-6, 2e-6}, y = {-1e-7, 3e-7, 2e-7};
  for (const Size size : {Size{320, 240}, Size{200, 150}, Size{640, 360}, Size{1280, 720}})
    for (const PlotPlace place : {PlotPlace::below, PlotPlace::beside})
      for (const int series : {1, 2}) {
        Picture p;
        p.size = size;
        p.overlay.plot_place = place;
        for (int k = 0; k < 3; ++k) {
          Plot plot{"t [s]", "[mm]", {}, 0.0, {}, {}};
          for (int i = 0; i < series; ++i) plot.series.push_back({.label = "tip.y", .x = x, .y = y});
          p.overlay.plots.push_back(plot);
        }
        for (const PlotLayout& plot : make_layout(p).plots) {
          // Words that are cut say nothing; numbers without room for their power are left out.
          bool x_numbers = false, y_numbers = false;
          std::string all = plot.y_label.text;
          for (const TextLine& w : plot.words) {
            all += "|" + w.text;
            const bool number = w.text.find_first_not_of("−0123456789.") == std::string::npos;
            (w.x < plot.axes.x && w.y < plot.axes.y + plot.axes.height + 1 ? y_numbers : x_numbers) |= number;
          }
          EXPECT_EQ(all.find("…"), std::string::npos) << all;
          for (const TextLine& w : plot.series) all += "|" + w.text;
          if (y_numbers) EXPECT_NE(all.find("[10⁻⁹ mm]"), std::string::npos) << all << " " << size.width;
          if (x_numbers) EXPECT_NE(all.find("10⁻⁶ s]"), std::string::npos) << all << " " << size.width;
          EXPECT_TRUE(size.width < 320 || y_numbers) << all << " " << size.width;
        }
      }
}

// One long name leaves the others room, and what tells two outputs apart stays.
TEST(Layout, NamesOfCurvesShareTheirRoom) {
  static const std::vector<double> x = {0.0, 1.0, 2.0}, y = {-0.1, 0.3, 0.2};
  Picture p;
  p.size = {640, 480};
  const std::string name = "force of the long named spring at the left end of the machine and its mount on the wall of the hall";
  p.overlay.plots.push_back({"t [s]", "[m]", {{name + ".x", x, y}, {"tip.y", x, y}, {name + ".y", x, y}}, 0.5, {}, {}});
  const PlotLayout plot = make_layout(p).plots[0];
  EXPECT_TRUE(plot.series[0].text.starts_with("force of the") && plot.series[0].text.ends_with("….x")) << plot.series[0].text;
  EXPECT_EQ(plot.series[1].text, "tip.y");
  EXPECT_TRUE(plot.series[2].text.ends_with("….y")) << plot.series[2].text;
  // In a narrow panel they move together before one is left out.
  p.size = {400, 300};
  p.overlay.plots = {{"t [s]", "[m]", {{"tip.x", x, y}, {"tip.y", x, y}}, 0.5, {}, {}}};
  p.overlay.plot_place = PlotPlace::beside;
  const PlotLayout narrow = make_layout(p).plots[0];
  EXPECT_FALSE(narrow.series[0].text.empty() || narrow.series[1].text.empty());
}

TEST(Layout, LogarithmicBarsHavePlainNumbers) {
  Picture p = full_overlay({640, 480});
  p.overlay.scalar_bar = ScalarBar{"speed", "m/s", 1.0};
  p.scalar_map.lower = 3.0;
  p.scalar_map.upper = 3000.0;
  p.scalar_map.logarithmic = true;
  const Layout layout = make_layout(p);
  std::string all;
  for (const TextLine& w : layout.bar.words) all += w.text + "|";
  EXPECT_NE(all.find("3000|"), std::string::npos) << all;
  EXPECT_NE(all.find("1000|"), std::string::npos) << all;
  EXPECT_EQ(all.find("e+"), std::string::npos) << all;
}

// A time without its last digits is another time.
TEST(Layout, TheTimeIsWholeOrNotThere) {
  for (const int width : {60, 90, 120, 320}) {
    Picture p = full_overlay({width, 90});
    for (const TextLine& w : make_layout(p).words)
      if (w.text.starts_with("t =")) EXPECT_EQ(w.text, p.overlay.time);
  }
}

// Whatever is asked for and however small the picture, views and insets lie within it; in one large enough insets lie beside each other.
TEST(Layout, InsetsLieWithinThePicture) {
  const InsetCorner corners[] = {InsetCorner::upper_left, InsetCorner::upper_right, InsetCorner::lower_left, InsetCorner::lower_right};
  for (const Size size : {Size{640, 480}, Size{1280, 720}, Size{320, 240}, Size{33, 21}, Size{16, 16}, Size{100, 30}})
    for (int choice = 0; choice < 256; ++choice)
      for (const int views : {0, 4}) {
        Picture p = full_overlay(size);
        for (int i = 0, c = choice; i < 4; ++i, c /= 4) {
          Inset inset;
          inset.size = 0.6;
          inset.corner = corners[c % 4];
          p.insets.push_back(inset);
        }
        for (int i = 0; i < views; ++i) {
          View view;
          view.left = 0.5 * (i % 2);
          view.top = 0.5 * (i / 2);
          view.width = view.height = 0.5;
          p.views.push_back(view);
        }
        const Layout layout = make_layout(p);
        std::vector<PixelRect> all = layout.views;
        all.insert(all.end(), layout.magnified.begin(), layout.magnified.end());
        for (const PixelRect& r : all)
          ASSERT_TRUE(r.x >= 0 && r.y >= 0 && r.width > 0 && r.height > 0 && r.x + r.width <= size.width && r.y + r.height <= size.height)
              << r.x << " " << r.y << " " << r.width << " " << r.height << " of " << size.width;
        if (size.width < 640 || views > 0) continue;
        for (std::size_t i = 0; i < 4; ++i)
          for (std::size_t j = 0; j < i; ++j) {
            const PixelRect &a = layout.magnified[i], &b = layout.magnified[j];
            ASSERT_FALSE(a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height)
                << "choice " << choice << ": " << a.y << "+" << a.height << " over " << b.y << "+" << b.height;
          }
        // The grid's note stays clear.
        ASSERT_GE(layout.grid_word, 0);
        const TextLine& note = layout.words[static_cast<std::size_t>(layout.grid_word)];
        for (const PixelRect& r : layout.magnified)
          ASSERT_FALSE(r.x + r.width > note.x && r.y + r.height > note.y - cap_height(note.size)) << choice;
      }
}

TEST(Shapes, AreClosedAndFaceOutwards) {
  const std::vector<glm::dvec3> path = {{0, 0, 0}, {1, 0.2, 0}, {2, 0.2, 0.5}, {2, 0.2, 0.5}, {3, 0, 0}};
  const std::pair<const char*, Shape> shapes[] = {{"arrow", make_arrow(2.0)},     {"ball", make_ball(0.7)},
                                                  {"box", make_box({1, 2, 3})},   {"cylinder", make_cylinder(0.5, 2.0)},
                                                  {"tube", make_tube(path, 0.1)}, {"spring", make_spring({0, 0, 0}, {1, 1, 0}, 0.1, 0.01)}};
  for (const auto& [name, shape] : shapes) {
    ASSERT_EQ(shape.positions.size(), shape.normals.size()) << name;
    double volume = 0.0;
    for (const glm::uvec3& t : shape.triangles) {
      const glm::dvec3 a(shape.positions[t.x]), b(shape.positions[t.y]), c(shape.positions[t.z]);
      volume += glm::dot(a, glm::cross(b, c)) / 6.0;
      const glm::dvec3 n = glm::cross(b - a, c - a);
      if (glm::length(n) < 1e-9) continue;
      EXPECT_GT(glm::dot(glm::normalize(n), glm::dvec3(shape.normals[t.x] + shape.normals[t.y] + shape.normals[t.z])), 0.0) << name;
    }
    EXPECT_GT(volume, 0.0) << name;
  }
  double ball = 0.0;
  for (const glm::uvec3& t : shapes[1].second.triangles)
    ball += glm::dot(glm::dvec3(shapes[1].second.positions[t.x]),
                     glm::cross(glm::dvec3(shapes[1].second.positions[t.y]), glm::dvec3(shapes[1].second.positions[t.z]))) /
            6.0;
  EXPECT_NEAR(ball, 4.0 / 3.0 * M_PI * 0.343, 0.03);
}

TEST(Edges, OfABoxAreItsTwelveAndNoDiagonal) {
  const Shape box = make_box({1, 1, 1});
  const auto flags = compute_feature_edges(box.positions, box.triangles);
  int drawn = 0;
  for (const auto f : flags) drawn += (f & 1) + (f >> 1 & 1) + (f >> 2 & 1);
  EXPECT_EQ(drawn, 24);  // each from both sides
  const Shape ball = make_ball(1.0, 24);
  const auto smooth = compute_feature_edges(ball.positions, ball.triangles);
  int sharp = 0;
  for (const auto f : smooth) sharp += f != 0;
  EXPECT_EQ(sharp, 0);
}

// Distance in CIELAB (D65) between any two of the first `count` colours, as the eye sees them whose cones `sight` (linear RGB) has.
double least_distance(int count, const glm::mat3& sight) {
  const auto lab = [&](const glm::vec3& srgb) {
    const glm::vec3 l = glm::clamp(sight * linear_from_srgb(srgb), 0.0f, 1.0f);
    const glm::vec3 f = glm::pow(glm::vec3(0.4124f * l.r + 0.3576f * l.g + 0.1805f * l.b, 0.2126f * l.r + 0.7152f * l.g + 0.0722f * l.b,
                                           0.0193f * l.r + 0.1192f * l.g + 0.9505f * l.b) /
                                     glm::vec3(0.9505f, 1.0f, 1.089f),
                                 glm::vec3(1.0f / 3.0f));
    return glm::vec3(116.0f * f.y, 500.0f * (f.x - f.y), 200.0f * (f.y - f.z));
  };
  double least = 1e9;
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < i; ++j) least = std::min(least, static_cast<double>(glm::length(lab(category_color(i)) - lab(category_color(j)))));
  return least;
}

// Matrices of Machado, Oliveira, Fernandes 2009 for no red, no green and no blue cones, columns first.
TEST(Colors, CategoriesCanBeToldApartByEveryEye) {
  const glm::mat3 sights[] = {glm::mat3(1.0f),
                              {0.152286f, 0.114503f, -0.003882f, 1.052583f, 0.786281f, -0.048116f, -0.204868f, 0.099216f, 1.051998f},
                              {0.367322f, 0.280085f, -0.011820f, 0.860646f, 0.672501f, 0.042940f, -0.227968f, 0.047413f, 0.968881f},
                              {1.255528f, -0.078411f, 0.004733f, -0.076749f, 0.930809f, 0.691367f, -0.178779f, 0.147602f, 0.303900f}};
  for (const glm::mat3& sight : sights) {
    EXPECT_GT(least_distance(10, sight), 23.0);
    EXPECT_GT(least_distance(4, sight), 31.0);
    EXPECT_GT(least_distance(30, sight), &sight == sights ? 14.0 : 0.5);
  }
}

}  // namespace
}  // namespace flexframe::render::test_picture
