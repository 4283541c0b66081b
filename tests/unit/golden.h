// Small pictures of every feature against those in tests/golden: byte-equal pixels where renderer and processor (its model, not only its
// instructions: estimates of reciprocals and roots differ between models) are those that made the golden picture, elsewhere by the gate of
// flexframe compare.
//
// Each test writes its picture to golden_new/ in the working folder. Pictures that differ, or are missing:
//   flexframe compare tests/golden golden_new --report differences.html
// and, where the new ones are right, with  --update "reason".
#pragma once

#include "render/draw/renderer.h"
#include "render/image/image_compare.h"
#include "render/image/png.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace flexframe::test {

// "GenuineIntel 6 143 8", or empty where the system does not say.
inline std::string processor_model() {
  std::ifstream info("/proc/cpuinfo");
  std::string out;
  for (std::string line; std::getline(info, line) && !line.empty();)
    for (const char* key : {"vendor_id\t", "cpu family\t", "model\t", "stepping\t"})
      if (line.rfind(key, 0) == 0) out += (out.empty() ? "" : " ") + line.substr(line.find(": ") + 2);
  return out;
}

inline void expect_golden(const render::Image& image, const render::RendererInfo& info, const std::string& name) {
  namespace fs = std::filesystem;
  const std::string key = "flexframe-environment", here = info.renderer + ", " + info.cpu + ", " + processor_model();
  const fs::path golden = fs::path(FLEXFRAME_SOURCE_DIR) / "tests/golden" / (name + ".png"),
                 fresh = fs::path("golden_new") / (name + ".png");
  fs::create_directories(fresh.parent_path());
  render::write_png(fresh, image, {.level = 6, .text = {{key, here}}});
  ASSERT_TRUE(fs::exists(golden)) << "no golden picture " << golden << "; the new one is " << fs::absolute(fresh);
  const render::ImageDifference difference =
      render::compare_images(render::read_png(golden), image, {.exact = render::read_png_text(golden, key) == here, .measures = false});
  EXPECT_TRUE(difference.passes) << name << ": " << difference.pixels_over << " pixels differ by more than 2 levels, at most by "
                                 << difference.largest << "; the new one is " << fs::absolute(fresh);
}

}  // namespace flexframe::test
