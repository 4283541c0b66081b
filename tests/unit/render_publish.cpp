// What papers ask for: PDF pages, pictures in linear light, insets, leaders to what is hidden.
#include "render/base/deflate.h"
#include "render/base/srgb.h"
#include "render/draw/renderer.h"
#include "render/frame/camera.h"
#include "render/image/pdf_sheet.h"
#include "render/image/png.h"
#include "tests/unit/render_front.h"
#include "tests/unit/render_solids.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>
#include <string>
#include <vector>

namespace flexframe::render::test_publish {
namespace {

// Objects of a PDF by their number, found by its table as a reader does.
std::vector<std::string> objects_of(const std::string& pdf) {
  std::vector<std::string> objects;
  const std::size_t start = pdf.rfind("startxref\n");
  if (start == std::string::npos) return objects;
  std::size_t at = std::stoul(pdf.substr(start + 10));
  EXPECT_EQ(pdf.substr(at, 7), "xref\n0 ");
  const int count = std::stoi(pdf.substr(at + 7));
  at = pdf.find('\n', at + 6) + 1;
  for (int k = 0; k < count; ++k, at += 20) {
    EXPECT_EQ(pdf[at + 19], '\n') << "entries of the table are 20 bytes long";
    if (k == 0) continue;
    const std::size_t begin = std::stoul(pdf.substr(at, 10));
    EXPECT_EQ(pdf.substr(begin, 7), std::to_string(k) + " 0 obj") << "object " << k;
    objects.push_back(pdf.substr(begin, pdf.find("\nendobj", begin) - begin));
  }
  return objects;
}

std::string unpacked(const std::string& object, std::size_t size) {
  const std::size_t begin = object.find("stream\n") + 7, length = std::stoul(object.substr(object.find("/Length ") + 8));
  EXPECT_EQ(object.substr(begin + length), "\nendstream");
  std::string out(size, '\0');
  const bool whole = decompress_zlib({reinterpret_cast<const std::uint8_t*>(&object[begin]), length},
                                     {reinterpret_cast<std::uint8_t*>(out.data()), out.size()});
  EXPECT_TRUE(whole);
  return out;
}

TEST(Pdf, ATableOfObjectsAPageInPointsAndThePixelsBelow) {
  Image below = make_image(30, 20, 4, 200);
  below.pixels[3] = 7;
  PdfSheet sheet{30, 20, {}, {}};
  fill_rectangle(sheet, {1, 2, 3, 4}, {{1, 0, 0}, 0.5f});
  draw_text(sheet, {2, 15}, "A", 12.0, glm::vec3(0.0f));
  const std::string pdf = pdf_text(sheet, {&below, 300.0, "made of 1234"});
  EXPECT_EQ(pdf.substr(0, 24), "%PDF-1.4\n% made of 1234\n");
  EXPECT_TRUE(pdf.ends_with("%%EOF\n"));
  const std::vector<std::string> objects = objects_of(pdf);
  ASSERT_EQ(objects.size(), 6u);
  // 30 x 20 pixels at 300 an inch.
  EXPECT_NE(objects[2].find("/MediaBox [0 0 7.2000 4.8000]"), std::string::npos) << objects[2];
  EXPECT_NE(objects[2].find("/A500 << /ca 0.500"), std::string::npos) << objects[2];
  const std::string color = unpacked(objects[4], 30 * 20 * 3), alpha = unpacked(objects[5], 30 * 20);
  EXPECT_EQ(static_cast<unsigned char>(color[0]), 200);
  EXPECT_EQ(static_cast<unsigned char>(alpha[0]), 7);
  EXPECT_EQ(static_cast<unsigned char>(alpha[1]), 200);
}

TEST(Pdf, WordsAreOutlinesWithinTheirMeasure) {
  // An A 12 pixels high: a shape with a hole, from the baseline up to the height of capitals.
  const std::vector<OutlineStep> steps = text_outline("A", 100.0);
  int shapes = 0;
  double low = 1e9, high = -1e9, right = 0.0;
  for (const OutlineStep& step : steps) {
    shapes += step.kind == OutlineStep::move;
    low = std::min(low, step.to.y);
    high = std::max(high, step.to.y);
    right = std::max(right, step.to.x);
  }
  EXPECT_EQ(shapes, 2);
  EXPECT_NEAR(high, 0.0, 1.0);
  EXPECT_NEAR(-low, cap_height(100.0), 1.0);
  EXPECT_LE(right, text_width("A", 100.0) + 1.0);
  EXPECT_TRUE(text_outline(" ", 100.0).empty());
}

TEST(Linear, FinerThanBytesAndTheSameLight) {
  const Shape ball = make_ball(1.0, 48);
  Picture p = front_view();
  p.background.transparent = true;
  p.look.samples = 4;
  p.lighting.studio = true;
  p.surfaces = {surface_of(ball)};
  // Linear light is OpenGL's; what draws bytes otherwise lights a pixel once, which on a rim is another light.
  Renderer opengl(Backend::osmesa, Solids::opengl);
  const Image image = opengl.draw(p);
  const Image16 light = opengl.draw_linear(p);
  ASSERT_EQ(light.channels, 4);
  ASSERT_EQ(light.pixels.size(), image.pixels.size());
  std::set<std::uint16_t> levels;
  int apart = 0;
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    EXPECT_NEAR(image.pixels[i + 3] * 257, light.pixels[i + 3], 129);
    if (image.pixels[i + 3] != 255) continue;
    levels.insert(light.pixels[i + 1]);
    const float srgb = 255.0f * srgb_from_linear(static_cast<float>(light.pixels[i + 1]) / 65535.0f);
    // Bytes of roots and bytes of sRGB: a level each.
    apart += std::abs(srgb - static_cast<float>(image.pixels[i + 1])) > 2.0f;
  }
  EXPECT_EQ(apart, 0);
  EXPECT_GT(levels.size(), 1000u) << "as many as bytes have says that nothing was gained";
  // A stranger's reader must be told that it is light, not sRGB: gAMA 1.
  const std::vector<std::uint8_t> png = encode_png(light, {.linear = true, .text = {}});
  const std::string words(png.begin(), png.end());
  EXPECT_NE(words.find(std::string("gAMA\x00\x01\x86\xa0", 8)), std::string::npos);
  EXPECT_EQ(decode_png16(png, "light").pixels, light.pixels);
}

TEST(Inset, ShowsItsPointSoManyTimesLarger) {
  const Shape ball = make_ball(0.1, 32);
  for (const Projection projection : {Projection::orthographic, Projection::perspective}) {
    Picture p = front_view();
    p.camera.projection = projection;
    p.camera.fov = 33.4;
    Surface s = surface_of(ball);
    s.material.color = {0.8f, 0.1f, 0.1f};
    s.pose[3] = glm::dvec4(-0.9, 0.6, 0.0, 1.0);
    p.surfaces = {s};
    const auto red = [](const Image& image, bool left) {
      int count = 0;
      for (int y = 0; y < image.height; ++y)
        for (int x = left ? 0 : image.width / 2; x < (left ? image.width / 2 : image.width); ++x) {
          const glm::ivec3 c = at(image, x, y);
          count += c.x > c.y + 60;
        }
      return count;
    };
    p.insets.push_back({.point = {-0.9, 0.6, 0.0}, .zoom = 3.0, .size = 0.4, .corner = InsetCorner::lower_right, .label = "ball"});
    const Image image = renderer().draw(p);
    const int small = red(image, true), large = red(image, false);
    EXPECT_GT(small, 200);
    // The frame and the two lines cross some of it.
    EXPECT_NEAR(large, 9.0 * small, 0.08 * 9.0 * small) << (projection == Projection::perspective ? "perspective" : "orthographic");
  }
  Picture p = front_view();
  p.insets.push_back({.point = {0, 0, 0}, .zoom = 0.0, .label = {}});
  EXPECT_THROW(renderer().draw(p), std::exception);
}

TEST(Labels, LeaderToWhatIsHiddenEndsInARing) {
  const Shape box = make_box({1, 1, 1});
  Picture p = front_view();
  p.surfaces = {surface_of(box)};
  p.labels.push_back({.point = {0, 0, 0.5}, .text = "5 mm", .leader = true});
  // In the middle of the front face: a dark dot. Behind it: a ring, light within.
  EXPECT_LT(at(renderer().draw(p), 200, 150).x, 90);
  p.labels[0].point.z = -0.5;
  EXPECT_GT(at(renderer().draw(p), 200, 150).x, 200);
  // Through a ghost it is seen.
  p.surfaces[0].opacity = 0.4f;
  EXPECT_LT(at(renderer().draw(p), 200, 150).x, 90);
}

}  // namespace
}  // namespace flexframe::render::test_publish
