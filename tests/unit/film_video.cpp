// Colours of a video, decoded again by ffmpeg: what a player shows is what was drawn.
#include "render/film/video.h"
#include "render/image/png.h"
#include "scratch.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <string>
#include <vector>

namespace flexframe {
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

TEST(Video, ColoursAreThoseOfThePictures) {
  const Scratch folder;
  const fs::path picture = folder.path() / "frame.png", video = folder.path() / "v.mp4", back = folder.path() / "back.png";
  render::write_png(picture, patches());
  film::VideoWriter writer(video, 25.0);
  for (int i = 0; i < 5; ++i) writer.add(picture);
  ASSERT_TRUE(writer.finish({}).made) << "ffmpeg is needed (package list, [build])";
  // As a player does: by the matrix that the stream names.
  const std::string command = "ffmpeg -nostdin -v error -y -i '" + video.string() +
                              "' -vf scale=flags=accurate_rnd+full_chroma_int -frames:v 1 '" + back.string() + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const render::Image shown = render::read_png(back);
  ASSERT_EQ(shown.width, columns * side);
  for (int c = 0; c < columns * rows; ++c)
    for (int v = side / 2 - 8; v < side / 2 + 8; ++v)
      for (int u = side / 2 - 8; u < side / 2 + 8; ++u)
        for (int k = 0; k < 3; ++k) {
          const std::size_t at = (std::size_t(c / columns * side + v) * shown.width + c % columns * side + u) * 3 + k;
          ASSERT_NEAR(int(shown.pixels[at]), int(colours[c][k]), 3) << "colour " << c << ", channel " << k;
        }
}

}  // namespace
}  // namespace flexframe
