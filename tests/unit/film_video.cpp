// Colours of a video, decoded again by ffmpeg: what a player shows is what was drawn.
#include "render/film/video.h"
#include "render/image/png.h"
#include "scratch.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

namespace flexframe::test_video {
namespace {

namespace fs = std::filesystem;

constexpr int side = 64, columns = 4, rows = 3;
constexpr std::array<std::array<std::uint8_t, 3>, columns * rows> colours{{{82, 197, 105},
                                                                           {255, 0, 0},
                                                                           {0, 255, 0},
                                                                           {0, 0, 255},
                                                                           {255, 255, 0},
                                                                           {0, 255, 255},
                                                                           {255, 0, 255},
                                                                           {255, 255, 255},
                                                                           {0, 0, 0},
                                                                           {68, 1, 84},
                                                                           {253, 231, 37},
                                                                           {128, 128, 128}}};

render::Image patches() {
  render::Image image = render::make_image(columns * side, rows * side, 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int k = 0; k < 3; ++k) image.pixels[(std::size_t(y) * image.width + x) * 3 + k] = colours[y / side * columns + x / side][k];
  return image;
}

// A film of five times this picture, its first picture decoded by the matrix and range that the stream names, as a player does.
render::Image filmed(const render::Image& image) {
  const Scratch folder;
  const fs::path picture = folder.path() / "frame.png", video = folder.path() / "v.mp4", back = folder.path() / "back.png";
  render::write_png(picture, image);
  film::VideoWriter writer(video, 25.0);
  for (int i = 0; i < 5; ++i) writer.add(picture);
  EXPECT_TRUE(writer.finish({}).made) << "ffmpeg is needed (package list, [build])";
  const std::string command = "ffmpeg -nostdin -v error -y -i '" + video.string() +
                              "' -vf scale=flags=accurate_rnd+full_chroma_int -frames:v 1 '" + back.string() + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);
  return render::read_png(back);
}

// Rounding of luma and of each difference to whole levels is 1 of a colour; the codec adds another.
constexpr int rounding = 2;

TEST(Video, ColoursAreThoseOfThePictures) {
  const render::Image shown = filmed(patches());
  ASSERT_EQ(shown.width, columns * side);
  for (int c = 0; c < columns * rows; ++c)
    for (int v = side / 2 - 8; v < side / 2 + 8; ++v)
      for (int u = side / 2 - 8; u < side / 2 + 8; ++u)
        for (int k = 0; k < 3; ++k) {
          const std::size_t at = (std::size_t(c / columns * side + v) * shown.width + c % columns * side + u) * 3 + k;
          ASSERT_NEAR(int(shown.pixels[at]), int(colours[c][k]), rounding) << "colour " << c << ", channel " << k;
        }
}

// A half transparent colour lies on white; the codec's sides are even, a last odd row and column are there twice.
TEST(Video, TransparentPicturesOfOddSize) {
  render::Image image = render::make_image(65, 33, 4);
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    image.pixels[i] = 200;
    image.pixels[i + 1] = 40;
    image.pixels[i + 2] = 90;
    image.pixels[i + 3] = i % (65 * 4) < 32 * 4 ? 255 : 128;
  }
  const render::Image shown = filmed(image);
  ASSERT_EQ(shown.width, 66);
  ASSERT_EQ(shown.height, 34);
  const auto over_white = [](int c, double a) { return static_cast<int>(std::lround(a * c + 255.0 * (1.0 - a))); };
  for (const int y : {2, 16, 33})
    for (const int x : {4, 20, 50, 65})
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(int(shown.pixels[(std::size_t(y) * 66 + x) * 3 + k]),
                    over_white(image.pixels[static_cast<std::size_t>(k)], x < 32 ? 1.0 : 128.0 / 255.0), rounding)
            << x << ' ' << y << ' ' << k;
}

}  // namespace
}  // namespace flexframe::test_video
