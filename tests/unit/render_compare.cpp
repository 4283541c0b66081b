// The gate of image comparison, made from pairs: what another processor or renderer changes has to pass, what a person would fail has to
// fail.
#include "render/image/image_compare.h"
#include "render/image/png.h"
#include "sim/base/error.h"

#include <gtest/gtest.h>

#include <functional>
#include <numeric>
#include <random>
#include <string>
#include <vector>

namespace flexframe::render::test_compare {
namespace {

constexpr int width = 640, height = 360;  // 230400 pixels: 0.005 % are eleven

// A picture as the program makes them: gradient, a shaded disc, an edge, words of thin dark strokes.
Image scene() {
  Image image = make_image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      std::uint8_t* p = &image.pixels[(std::size_t(y) * width + x) * 3];
      for (int k = 0; k < 3; ++k) p[k] = static_cast<std::uint8_t>(235 - y / 6 - 5 * k);
      const double dx = x - 300.0, dy = y - 180.0, r = dx * dx + dy * dy;
      if (r < 8100.0)
        for (int k = 0; k < 3; ++k) p[k] = static_cast<std::uint8_t>(60 + 40 * k + (dx - dy) / 3.0);
      if (y >= 20 && y < 30 && x >= 20 && x < 120 && (x / 2 + y / 5) % 3 == 0) p[0] = p[1] = p[2] = 40;
      if (y == 340 && x % 60 >= 20 && x % 60 < 26) p[0] = p[1] = p[2] = 60;  // minus signs of tick labels, 6 x 1
    }
  return image;
}

std::uint8_t& at(Image& image, int x, int y, int k) { return image.pixels[(std::size_t(y) * image.width + x) * 3 + k]; }

void add(Image& image, int x, int y, int levels) {
  for (int k = 0; k < 3; ++k) at(image, x, y, k) = static_cast<std::uint8_t>(std::clamp(at(image, x, y, k) + levels, 0, 255));
}

void patch(Image& image, int x, int y, int w, int h, int levels) {
  for (int v = y; v < y + h; ++v)
    for (int u = x; u < x + w; ++u) add(image, u, v, levels);
}

// Single pixels, no two of which touch.
void sprinkle(Image& image, int count, int levels, unsigned seed) {
  std::vector<int> places(90 * 50);
  std::iota(places.begin(), places.end(), 0);
  std::mt19937 random(seed);
  for (int i = 0; i < count; ++i) {
    std::swap(places[static_cast<std::size_t>(i)],
              places[static_cast<std::size_t>(i) + random() % (places.size() - static_cast<std::size_t>(i))]);
    const int at = places[static_cast<std::size_t>(i)];
    add(image, 3 + 7 * (at % 90), 3 + 7 * (at / 90), random() % 2 ? levels : -levels);
  }
}

void everywhere(Image& image, int levels) {
  for (std::uint8_t& p : image.pixels) p = static_cast<std::uint8_t>(std::clamp(p + levels, 0, 255));
}

void shift(Image& image, int dx, int dy, int x0, int y0, int w, int h) {
  const Image before = image;
  for (int y = y0; y < y0 + h; ++y)
    for (int x = x0; x < x0 + w; ++x)
      for (int k = 0; k < 3; ++k)
        at(image, x, y, k) =
            before.pixels[(std::size_t(std::clamp(y - dy, 0, height - 1)) * width + std::clamp(x - dx, 0, width - 1)) * 3 + k];
}

const CompareOptions quick = [] {
  CompareOptions o;
  o.measures = false;
  return o;
}();

struct Pair {
  std::string what;
  bool benign;
  std::function<void(Image&)> change;
};

std::vector<Pair> pairs() {
  std::vector<Pair> out;
  const auto benign = [&](std::string what, std::function<void(Image&)> change) {
    out.push_back({std::move(what), true, std::move(change)});
  };
  const auto faulty = [&](std::string what, std::function<void(Image&)> change) {
    out.push_back({std::move(what), false, std::move(change)});
  };
  benign("nothing", [](Image&) {});
  for (const int levels : {1, 2, 3, 5, 7})
    for (const int count : {1, 5, 10})
      benign(std::to_string(count) + " single pixels by " + std::to_string(levels), [=](Image& i) { sprinkle(i, count, levels, 1); });
  benign("a thousand single pixels by one level", [](Image& i) { sprinkle(i, 1000, 1, 2); });
  benign("a thousand single pixels by two levels", [](Image& i) { sprinkle(i, 1000, 2, 3); });
  benign("a row of rounding: 40 neighbours by one level", [](Image& i) { patch(i, 100, 100, 40, 1, 1); });
  benign("three neighbours by 40 levels, an edge that falls the other way", [](Image& i) { patch(i, 210, 180, 1, 3, 40); });
  benign("the disc's rim by one level", [](Image& i) { patch(i, 205, 90, 190, 2, 1); });
  benign("rounding all over a field: every third pixel up or down by one", [](Image& i) {
    for (int y = 100; y < 180; ++y)
      for (int x = 100; x < 200; x += 3) add(i, x, y, (x / 3 + y) % 2 ? 1 : -1);
  });
  benign("seven touching pixels by 12 levels", [](Image& i) { patch(i, 400, 300, 7, 1, 12); });
  benign("one sample of a dark rim that falls the other way", [](Image& i) { add(i, 300, 40, -137); });

  faulty("a decimal point gone: two pixels by 90", [](Image& i) { patch(i, 400, 300, 1, 2, -90); });
  faulty("a decimal point gone: one pixel by 180", [](Image& i) { add(i, 400, 100, -180); });
  faulty("a pale line of ten pixels by 12 levels", [](Image& i) { patch(i, 400, 300, 10, 1, 12); });
  faulty("a field of 130 x 130 pixels by one level", [](Image& i) { patch(i, 60, 60, 130, 130, 1); });
  faulty("red by one level over 130 x 130 pixels", [](Image& i) {
    for (int y = 60; y < 190; ++y)
      for (int x = 60; x < 190; ++x) ++at(i, x, y, 0);
  });
  faulty("two levels over the disc's middle", [](Image& i) { patch(i, 250, 120, 128, 128, 2); });
  faulty("minus signs gone", [](Image& i) {
    for (int x = 0; x < width; ++x)
      if (x % 60 >= 20 && x % 60 < 26)
        for (int k = 0; k < 3; ++k) at(i, x, 340, k) = at(i, 0, 340, k);
  });
  faulty("one minus sign gone", [](Image& i) {
    for (int x = 20; x < 26; ++x)
      for (int k = 0; k < 3; ++k) at(i, x, 340, k) = at(i, 0, 340, k);
  });
  faulty("a block of 42 magenta pixels", [](Image& i) {
    for (int y = 50; y < 56; ++y)
      for (int x = 50; x < 57; ++x) at(i, x, y, 0) = 255, at(i, x, y, 1) = 0, at(i, x, y, 2) = 255;
  });
  faulty("four magenta pixels", [](Image& i) {
    for (int y = 50; y < 52; ++y)
      for (int x = 50; x < 52; ++x) at(i, x, y, 0) = 255, at(i, x, y, 1) = 0, at(i, x, y, 2) = 255;
  });
  for (const int levels : {-2, -1, 1, 2}) faulty("every pixel by " + std::to_string(levels), [=](Image& i) { everywhere(i, levels); });
  faulty("the upper quarter by one level", [](Image& i) { patch(i, 0, 0, width, height / 4, 1); });
  faulty("the disc one pixel to the right", [](Image& i) { shift(i, 1, 0, 205, 85, 192, 192); });
  faulty("the disc one pixel down", [](Image& i) { shift(i, 0, 1, 205, 85, 192, 192); });
  faulty("the whole picture by one pixel", [](Image& i) { shift(i, 1, 0, 0, 0, width, height); });
  faulty("words one pixel to the right", [](Image& i) { shift(i, 1, 0, 18, 18, 104, 14); });
  faulty("words gone", [](Image& i) { shift(i, 0, 12, 18, 18, 104, 14); });
  for (const int levels : {17, 60, 120})
    faulty("2 x 2 pixels by " + std::to_string(levels), [=](Image& i) { patch(i, 400, 300, 2, 2, -levels); });
  faulty("a diagonal of four pixels by 30", [](Image& i) {
    for (int k = 0; k < 4; ++k) add(i, 400 + k, 300 + k, -30);
  });
  faulty("a hairline of 200 pixels by 20", [](Image& i) { patch(i, 100, 250, 200, 1, -20); });
  faulty("12 single pixels by 3 levels, more than the share", [](Image& i) {
    for (int k = 0; k < 12; ++k) add(i, 20 + 40 * k, 320, 3);
  });
  faulty("100 single pixels by 100", [](Image& i) { sprinkle(i, 100, 100, 5); });
  faulty("red and blue exchanged in the disc", [](Image& i) {
    for (int y = 100; y < 260; ++y)
      for (int x = 240; x < 360; ++x) std::swap(at(i, x, y, 0), at(i, x, y, 2));
  });
  faulty("black", [](Image& i) { std::fill(i.pixels.begin(), i.pixels.end(), std::uint8_t(0)); });
  return out;
}

TEST(CompareGate, TableOfPairs) {
  const Image before = scene();
  int benign = 0, faulty = 0;
  for (const Pair& pair : pairs()) {
    Image after = before;
    pair.change(after);
    const ImageDifference d = compare_images(before, after, quick);
    EXPECT_EQ(d.passes, pair.benign) << pair.what << ": " << d.pixels_over << " over, " << d.cluster << " together, mean " << d.mean;
    EXPECT_EQ(compare_images(after, before, quick).passes, pair.benign) << pair.what << ", exchanged";
    ++(pair.benign ? benign : faulty);
  }
  EXPECT_GE(benign, 20);
  EXPECT_GE(faulty, 20);
}

// What nobody sees is no difference, but where equal pixels are asked for.
TEST(CompareGate, ColoursOfTransparentPixelsDoNotCount) {
  Image before = make_image(64, 64, 4, 0), after = before;
  for (std::size_t i = 0; i < after.pixels.size(); i += 4) after.pixels[i] = 200;
  EXPECT_TRUE(compare_images(before, after, quick).passes);
  EXPECT_FALSE(compare_images(before, after, quick).equal);
  CompareOptions exact = quick;
  exact.exact = true;
  EXPECT_FALSE(compare_images(before, after, exact).passes);
  for (int k = 0; k < 3; ++k) before.pixels[4 * (64 * 10 + 10 + k) + 3] = after.pixels[4 * (64 * 10 + 10 + k) + 3] = 90;
  EXPECT_FALSE(compare_images(before, after, quick).passes) << "seen: three pixels by 200 levels";
}

// A failure names the limit that it breaks.
TEST(CompareGate, NamesTheLimit) {
  const Image before = scene();
  const std::vector<std::pair<std::string, std::function<void(Image&)>>> cases = {
      {"touching pixels off by 180 in all", [](Image& i) { add(i, 400, 100, -180); }},
      {"10 touching pixels off by more than 7", [](Image& i) { patch(i, 400, 300, 10, 1, 12); }},
      {"4 touching pixels off by more than 16", [](Image& i) { patch(i, 400, 300, 2, 2, 20); }},
      {"a field of 64 x 64 pixels off by 1 in the mean", [](Image& i) { patch(i, 60, 60, 130, 130, 1); }}};
  for (const auto& [what, change] : cases) {
    Image after = before;
    change(after);
    EXPECT_EQ(compare_images(before, after, quick).broken, what);
  }
  EXPECT_EQ(compare_images(before, before, quick).broken, "");
}

TEST(CompareGate, SixteenBitsAreComparedAsSuch) {
  Image16 before{200, 100, 1, std::vector<std::uint16_t>(20000)};
  for (std::size_t i = 0; i < before.pixels.size(); ++i) before.pixels[i] = static_cast<std::uint16_t>(i % 200 < 40 ? 65535 : 20000 + i);
  const auto passes = [&](const std::function<void(Image16&)>& change) {
    Image16 after = before;
    change(after);
    return compare_images(before, after, quick).passes;
  };
  EXPECT_TRUE(passes([](Image16&) {}));
  EXPECT_TRUE(passes([](Image16& i) {
    for (auto& p : i.pixels) p = static_cast<std::uint16_t>(p ^ 1);
  }));                                                              // rounding of the last bit
  EXPECT_TRUE(passes([](Image16& i) { i.pixels[5050] = 65535; }));  // one pixel of a silhouette
  EXPECT_FALSE(passes([](Image16& i) {
    for (auto& p : i.pixels) p = static_cast<std::uint16_t>(p < 65335 ? p + 200 : p);
  }));
  EXPECT_FALSE(passes([](Image16& i) {
    for (std::size_t k = 5000; k < 5400; ++k) i.pixels[k] = static_cast<std::uint16_t>(i.pixels[k] > 65335 ? 65535 : i.pixels[k] + 200);
  }));
  EXPECT_FALSE(passes([](Image16& i) {
    for (int k = 0; k < 4; ++k) i.pixels[5050 + k] += 300;
  }));
  EXPECT_FALSE(passes([](Image16& i) {
    for (auto& p : i.pixels) p = static_cast<std::uint16_t>(p < 65500 ? p + 12 : p);
  }));  // the whole depth a little further away

  // Through a file, with all 16 bits.
  const std::vector<std::uint8_t> bytes = encode_png(before);
  EXPECT_EQ(png_depth(bytes), 16);
  EXPECT_EQ(decode_png16(bytes, "depth.png"), before);
}

TEST(CompareGate, ClustersTouchByCorners) {
  const Image before = make_image(64, 64, 3, 100);
  Image after = before;
  for (int k = 0; k < 3; ++k) after.pixels[(std::size_t(10 + k) * 64 + 10 + k) * 3] = 130;
  EXPECT_EQ(compare_images(before, after, quick).cluster, 3);
  after.pixels[(std::size_t(40) * 64 + 40) * 3] = 130;
  EXPECT_EQ(compare_images(before, after, quick).cluster, 3);
  after.pixels[(std::size_t(13) * 64 + 12) * 3] = 130;
  EXPECT_EQ(compare_images(before, after, quick).cluster, 4);
}

// Measures look at the part that differs only; an alpha channel on one side makes them look at everything.
TEST(Compare, MeasuresOfTheDifferingPartAreThoseOfTheWhole) {
  const Image before = scene();
  for (const auto& [x, y, w, h] : {PixelBox{300, 180, 12, 9}, PixelBox{0, 0, 3, 3}, PixelBox{600, 350, 40, 10}, PixelBox{5, 100, 1, 200}}) {
    Image after = before;
    patch(after, x, y, w, h, -40);
    Image with_alpha = make_image(width, height, 4, 255);
    for (std::size_t i = 0; i < after.pixels.size(); ++i) with_alpha.pixels[i / 3 * 4 + i % 3] = after.pixels[i];
    Image part_heat, whole_heat;
    const double part = compute_flip(before, after, &part_heat), whole = compute_flip(before, with_alpha, &whole_heat);
    EXPECT_GT(part, 0.0);
    EXPECT_NEAR(part, whole, 1e-12 * whole);
    EXPECT_EQ(part_heat, whole_heat);
    EXPECT_NEAR(compute_ssim(before, after), compute_ssim(before, with_alpha), 1e-12);
  }
}

TEST(Compare, IgnoredPixelsCountNowhere) {
  const Image before = scene();
  Image after = before;
  patch(after, 100, 100, 20, 10, 50);
  patch(after, 400, 300, 2, 1, 30);
  std::vector<std::uint8_t> ignored(std::size_t(width) * height, 0);
  for (int y = 100; y < 110; ++y) std::fill_n(ignored.begin() + y * width + 100, 20, std::uint8_t(1));
  CompareOptions options;
  options.ignored = ignored;
  const ImageDifference d = compare_images(before, after, options);
  EXPECT_TRUE(d.passes);
  EXPECT_EQ(d.ignored, 200);
  EXPECT_EQ(d.pixels_over, 2);
  EXPECT_EQ(d.box, (PixelBox{400, 300, 2, 1}));
  EXPECT_NEAR(d.mean, 60.0 / (width * height - 200), 1e-12);
  // SSIM and FLIP are those of a picture in which the ignored part is the baseline's.
  Image rest = before;
  patch(rest, 400, 300, 2, 1, 30);
  EXPECT_EQ(d.flip, compute_flip(before, rest));
  EXPECT_EQ(d.ssim, compute_ssim(before, rest));

  ignored[std::size_t(300) * width + 400] = ignored[std::size_t(300) * width + 401] = 1;
  options.ignored = ignored;
  EXPECT_TRUE(compare_images(before, after, options).equal);
  options.exact = true;
  EXPECT_TRUE(compare_images(before, after, options).passes);
  ignored.pop_back();
  options.ignored = ignored;
  EXPECT_THROW(compare_images(before, after, options), ArgumentError);
  ignored.assign(std::size_t(width) * height, 1);
  options.ignored = ignored;
  EXPECT_THROW(compare_images(before, after, options), ArgumentError);
}

}  // namespace
}  // namespace flexframe::render::test_compare
