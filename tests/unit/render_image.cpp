// Images and PNG files: what is written is read again, damage is noticed, failures leave nothing.
#include "render/image/image.h"
#include "render/image/image_compare.h"
#include "render/image/png.h"
#include "scratch.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

namespace flexframe::render::test_image {
namespace {

namespace fs = std::filesystem;

Image noise(int width, int height, int channels, unsigned seed = 1) {
  Image image = make_image(width, height, channels);
  std::mt19937 random(seed);
  for (auto& p : image.pixels) p = static_cast<std::uint8_t>(random());
  return image;
}

TEST(Png, ReadsWhatItWrote) {
  for (const int channels : {3, 4})
    for (const auto& [w, h] : {std::pair{1, 1}, {7, 3}, {640, 31}}) {
      const Image image = noise(w, h, channels);
      EXPECT_EQ(decode_png(encode_png(image), "memory"), image) << w << " x " << h << " x " << channels;
      EXPECT_EQ(encode_png(image), encode_png(image));
    }
}

TEST(Png, GreyAndSixteenBitsAreRightForAStranger) {
  // stb_image reads 16 bits as the upper byte.
  Image16 deep{5, 2, 1, {0, 256, 512, 65535, 4660, 1, 2, 3, 4, 5}};
  const Image read = decode_png(encode_png(deep), "memory");
  ASSERT_EQ(read.channels, 3);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(read.pixels[3 * i], deep.pixels[i] >> 8);
}

// Parts of the picture's data may be empty.
TEST(Png, EmptyPartsAreAllowed) {
  const Image image = noise(9, 5, 3);
  const auto bytes = encode_png(image);
  const std::vector<std::uint8_t> part = {0, 0, 0, 0, 'I', 'D', 'A', 'T', 0x35, 0xaf, 0x06, 0x1e};
  const auto data = std::search(bytes.begin(), bytes.end(), part.begin() + 4, part.begin() + 8) - bytes.begin() - 4;
  for (const auto at : {data, static_cast<std::ptrdiff_t>(bytes.size()) - 12}) {
    auto with = bytes;
    with.insert(with.begin() + at, part.begin(), part.end());
    EXPECT_EQ(decode_png(with, "memory"), image) << at;
  }
  const std::vector<std::uint8_t> header(bytes.begin(), bytes.begin() + 33), end(bytes.end() - 12, bytes.end());
  auto nothing = header;
  nothing.insert(nothing.end(), part.begin(), part.end());
  nothing.insert(nothing.end(), end.begin(), end.end());
  EXPECT_THROW(decode_png(nothing, "memory"), std::runtime_error);
}

TEST(Png, EveryFlippedBitAndEveryCutIsNoticed) {
  const auto bytes = encode_png(noise(9, 5, 3), {.level = 1, .text = {{"Renderer", "someone"}}});
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    auto damaged = bytes;
    damaged[i] ^= 0x10;
    EXPECT_THROW(decode_png(damaged, "memory"), std::runtime_error) << "byte " << i;
    EXPECT_THROW(decode_png(std::span(bytes).first(i), "memory"), std::runtime_error) << "cut at " << i;
  }
}

TEST(Png, FilesAppearWholeAndTextIsFound) {
  const Scratch folder;
  const fs::path file = folder.path() / "a.png";
  const Image first = noise(30, 20, 3), second = noise(30, 20, 3, 2);
  write_png(file, first, {.level = 1, .text = {{"Inputs", "abc"}, {"Renderer", "llvmpipe"}}});
  EXPECT_EQ(read_png(file), first);
  EXPECT_EQ(read_png_text(file, "Renderer"), "llvmpipe");
  EXPECT_EQ(read_png_text(file, "Render"), "");
  EXPECT_TRUE(is_whole_png(file));
  write_png(file, second);  // over an existing file
  EXPECT_EQ(read_png(file), second);
  int files = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder.path())) ++files;
  EXPECT_EQ(files, 1);
  fs::resize_file(file, fs::file_size(file) - 1);
  EXPECT_FALSE(is_whole_png(file));
}

TEST(Png, FailuresNameThePathAndTheReason) {
  const Scratch folder;
  try {
    write_png(folder.path() / "no" / "a.png", noise(4, 4, 3));
    FAIL();
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("no/a.png"), std::string::npos);
    EXPECT_NE(std::string(e.what()).find("No such file"), std::string::npos);
  }
  fs::create_directory(folder.path() / "b.png");
  EXPECT_THROW(write_png(folder.path() / "b.png", noise(4, 4, 3)), std::runtime_error);
  int files = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder.path())) ++files;
  EXPECT_EQ(files, 1);
}

TEST(Image, ReductionKeepsLinearLight) {
  Image checker = make_image(4, 4, 3);
  for (int i = 0; i < 16; ++i)
    for (int k = 0; k < 3; ++k) checker.pixels[3 * i + k] = (i + i / 4) % 2 ? 255 : 0;
  const Image small = reduce_image(checker, 2, 2);
  ASSERT_EQ(small.width, 2);
  for (const auto p : small.pixels) EXPECT_EQ(p, 188);  // half the light of white
}

TEST(Image, ContactSheetPlacesEachPicture) {
  const Image a = make_image(8, 4, 3, 10), b = make_image(8, 4, 3, 20), c = make_image(8, 4, 3, 30);
  const Image sheet = contact_sheet({a, b, c}, 2, 2);
  EXPECT_EQ(sheet.width, 22);
  EXPECT_EQ(sheet.height, 14);
  const auto at = [&](int x, int y) { return sheet.pixels[(std::size_t(y) * sheet.width + x) * 3]; };
  EXPECT_EQ(at(0, 0), 255);
  EXPECT_EQ(at(2, 2), 10);
  EXPECT_EQ(at(12, 2), 20);
  EXPECT_EQ(at(9, 11), 30);
  EXPECT_EQ(at(12, 11), 255);
}

TEST(Compare, RuleCountsPixelsOverTwoLevels) {
  const Image a = make_image(200, 200, 3, 100);  // 40000 pixels: 0.005 % are two
  Image b = a;
  for (auto& p : b.pixels) p = 102;
  EXPECT_FALSE(compare_images(a, b).passes);  // every pixel by two levels: too much in the mean
  EXPECT_FALSE(compare_images(a, b).equal);
  EXPECT_FALSE(compare_images(a, b, {.exact = true}).passes);
  b = a;
  b.pixels[0] = b.pixels[300] = 103;
  EXPECT_TRUE(compare_images(a, b).passes);
  b.pixels[600] = 97;
  const ImageDifference d = compare_images(a, b);
  EXPECT_FALSE(d.passes);
  EXPECT_EQ(d.pixels_over, 3);
  EXPECT_EQ(d.largest, 3);
  EXPECT_NEAR(d.mean, 9.0 / 120000.0, 1e-12);
  EXPECT_FALSE(compare_images(a, make_image(200, 199, 3, 100)).same_size);
}

TEST(Compare, MeasuresAtTheirEnds) {
  const Image a = noise(64, 48, 3);
  EXPECT_DOUBLE_EQ(compute_ssim(a, a), 1.0);
  EXPECT_DOUBLE_EQ(compute_flip(a, a), 0.0);
  EXPECT_LT(compute_ssim(a, noise(64, 48, 3, 9)), 0.2);
  // FLIP's own ends: green against blue is the largest colour difference, black against white nearly.
  Image green = make_image(40, 40, 3), blue = green, black = green, white = make_image(40, 40, 3, 255);
  for (int i = 0; i < 1600; ++i) green.pixels[3 * i + 1] = blue.pixels[3 * i + 2] = 255;
  EXPECT_NEAR(compute_flip(green, blue), 1.0, 1e-6);
  EXPECT_NEAR(compute_flip(black, white), 0.97, 0.02);
  // A difference the eye would see more is measured greater, and the order of the pictures does not matter.
  Image near = black, far = black;
  for (auto& p : near.pixels) p = 10;
  for (auto& p : far.pixels) p = 60;
  EXPECT_LT(compute_flip(black, near), compute_flip(black, far));
  EXPECT_NEAR(compute_flip(black, far), compute_flip(far, black), 1e-12);
}

}  // namespace
}  // namespace flexframe::render::test_image
