// The fitted camera: what it takes in, and how much of the frame that fills.
#include "film_swing.h"

#include "render/film/animation.h"
#include "render/film/settings.h"
#include "render/frame/layout.h"
#include "render/frame/view.h"
#include "sim/base/error.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace test_camera {
namespace {

using namespace flexframe;

film::RenderSettings parse(const std::string& table) { return film::parse_render_settings("title = \"x\"\n" + table, "scene.toml"); }

film::RenderSettings small_settings() {
  film::RenderSettings s;
  s.size = {640, 360};
  s.frame_rate = 20;
  s.speed = 1;
  s.scales = {1};
  return s;
}

// The box of all surfaces' vertices on the picture, pixels.
struct Seen {
  glm::dvec2 lower{1e9}, upper{-1e9};
};
Seen seen_at(const film::Animation& animation, int picture) {
  film::PictureMemory memory;
  film::update_picture(animation, picture, memory);
  const render::Picture& p = memory.picture;
  const render::ViewFrame frame = render::make_view(p.camera, render::make_layout(p).scene, animation.bounds);
  Seen seen;
  for (const render::Surface& s : p.surfaces)
    for (const glm::vec3& v : s.positions) {
      glm::dvec2 pixel;
      EXPECT_TRUE(render::project(frame, glm::dvec3(s.pose * glm::dvec4(v, 1.0)), pixel));
      seen.lower = glm::min(seen.lower, pixel);
      seen.upper = glm::max(seen.upper, pixel);
    }
  return seen;
}

TEST(Camera, AWindowFillsTheFrameWithWhatIsSeenInIt) {
  const sim::Results r = test::swinging_beam();
  film::RenderSettings settings = small_settings();
  settings.shadows = false;  // for which the camera steps back
  const film::Animation all = film::make_animation(r, settings, nullptr);
  settings.camera.window = {0.25, 0.25};
  const film::Animation one = film::make_animation(r, settings, nullptr);
  // The light is that of the whole motion; the camera comes nearer.
  EXPECT_EQ(all.bounds.lower, one.bounds.lower);
  EXPECT_LT(one.camera.height, 0.95 * all.camera.height);
  // Of what words leave free, 85 % are filled in one direction, and nothing is cut off.
  film::PictureMemory memory;
  film::update_picture(one, 5, memory);
  const render::Layout layout = render::make_layout(memory.picture);
  const Seen seen = seen_at(one, 5);
  const glm::dvec2 size = seen.upper - seen.lower;
  const double wide = layout.scene.width * (1.0 - layout.insets.left - layout.insets.right),
               high = layout.scene.height * (1.0 - layout.insets.top - layout.insets.bottom);
  EXPECT_GT(std::max(size.x / wide, size.y / high), 0.85);
  EXPECT_GE(seen.lower.x, 0.0);
  EXPECT_GE(seen.lower.y, 0.0);
  EXPECT_LE(seen.upper.x, 640.0);
  EXPECT_LE(seen.upper.y, 360.0);

  settings.camera.window = {5.0, 6.0};
  try {
    film::make_animation(r, settings, nullptr);
    FAIL() << "a window after the run was taken";
  } catch (const sim::InputError& e) {
    EXPECT_NE(std::string(e.what()).find("camera.window [5, 6] holds no moment"), std::string::npos) << e.what();
  }
}

// The ground lies below, also where the view is straight down on it.
TEST(Camera, TheGroundStaysBelow) {
  const sim::Results r = test::swinging_beam();
  const auto normal = [&](const std::string& words) {
    film::RenderSettings s = parse(words);
    s.speed = 1;
    return film::make_animation(r, s, nullptr).ground.value().normal;
  };
  const glm::dvec3 up = normal("[render]\n");
  for (const char* words : {"[render]\ncamera = { preset = \"top\" }\n", "[render]\ncamera = { direction = [0, -1, 0] }\n",
                            "[render]\ncamera = { position = [0.3, 4, 0], target = [0.3, 0, 0] }\n"})
    EXPECT_EQ(normal(words), up) << words;
}

TEST(Camera, InsetsFollowTheirFrames) {
  const sim::Results r = test::swinging_beam();
  film::RenderSettings settings = small_settings();
  settings.insets.push_back({.at = "block", .drawing = {.zoom = 6.0, .label = "tip"}, .line = 0});
  const film::Animation animation = film::make_animation(r, settings, nullptr);
  film::PictureMemory memory;
  film::update_picture(animation, 10, memory);
  ASSERT_EQ(memory.picture.insets.size(), 1u);
  const double t = film::picture_time(animation, 10);
  const film::SamplePlace place = film::find_sample(r.times, t);
  const glm::dvec3 tip(film::body_pose(r.bodies[1], place)[3]);
  EXPECT_LT(glm::length(memory.picture.insets[0].point - tip), 1e-12);
  const std::string before = film::picture_hash(memory.picture, "");
  memory.picture.insets[0].zoom = 7.0;
  EXPECT_NE(film::picture_hash(memory.picture, ""), before) << "a picture of another zoom would pass for drawn";

  settings.insets[0].at = "nobody";
  EXPECT_THROW(film::make_animation(r, settings, nullptr), sim::InputError);
}

TEST(Camera, WordsAreReadAndRefusedWithTheirReason) {
  const film::RenderSettings s = parse(R"([render]
camera = { window = [0.5, 0.75] }
channels = ["linear", "pdf"]
insets = [{ at = "rod.middle", zoom = 5, size = 0.25, corner = "upper left", label = "middle" }]
)");
  EXPECT_EQ(s.camera.window, (std::pair{0.5, 0.75}));
  EXPECT_TRUE(s.linear_channel && s.pdf_channel && !s.vector_channel && !s.depth_channel);
  ASSERT_EQ(s.insets.size(), 1u);
  EXPECT_EQ(s.insets[0].at, "rod.middle");
  EXPECT_EQ(s.insets[0].drawing.corner, render::InsetCorner::upper_left);
  const struct {
    const char *table, *said;
  } wrong[] = {{"camera = { window = [2, 1] }", "must rise"},
               {"camera = { position = [0, 0, 1], window = [0, 1] }", "fitted"},
               {"channels = [\"pfd\"]", "pdf"},
               {"insets = [{ zoom = 3 }]", "at"},
               {"insets = [{ at = \"a\", zoom = 0.5 }]", "above 1"},
               {"insets = [{ at = \"a\", corner = \"left\" }]", "upper left"}};
  for (const auto& w : wrong) try {
      parse(std::string("[render]\n") + w.table + "\n");
      FAIL() << w.table;
    } catch (const sim::InputError& e) {
      EXPECT_NE(std::string(e.what()).find(w.said), std::string::npos) << e.what();
    }
}

}  // namespace

}  // namespace test_camera
