// Golden pictures of what [render] asks for, on a beam that swings and bends by a formula.
#include "film_swing.h"
#include "golden.h"
#include "scratch.h"

#include "render/film/animation.h"
#include "render/film/contact_sheet.h"
#include "render/image/png.h"
#include "sim/scene/scene_reader.h"

#include <fmt/format.h>

#include <functional>
#include <ostream>

namespace test_golden {
namespace {

using namespace flexframe;

const char* forces_and_outputs = R"toml(
[[force]]
kind = "force"
on = "beam.node[4]"
direction = [0, 1, 0]
value = "10*cos(6*t)"
[[force]]
kind = "torque"
direction = [0, 0, 1]
on = "beam.root"
value = "1"
[[output]]
name = "tip"
of = "block"
quantity = "position"
)toml";

render::Image draw(const std::string& words, int picture, render::RendererInfo& info, const sim::Results& results = test::swinging_beam(),
                   const std::function<void(std::string&)>& change = {}) {
  static render::Renderer renderer;
  info = renderer.info();
  std::string text = std::string(test::swinging_scene) + forces_and_outputs +
                     "[render]\nframe_rate = 12\nspeed = 1\nshadows = false\nocclusion = false\n" +
                     (std::string(words).find("size =") == std::string::npos ? "size = [200, 140]\n" : "") + words;
  if (change) change(text);
  const sim::Scene scene = sim::parse_scene(text, "golden.toml");
  const film::RenderSettings settings = film::parse_render_settings(text, "golden.toml");
  const film::Animation animation = film::make_animation(results, settings, &scene);
  film::PictureMemory memory;
  film::update_picture(animation, picture, memory);
  return renderer.draw(memory.picture);
}

struct Case {
  const char* name;
  const char* words;
};
void PrintTo(const Case& one, std::ostream* out) { *out << one.name; }

class GoldenWords : public testing::TestWithParam<Case> {};

TEST_P(GoldenWords, LooksAsItDid) {
  render::RendererInfo info;
  const render::Image image = draw(GetParam().words, 2, info);
  test::expect_golden(image, info, std::string("film_") + GetParam().name);
}

INSTANTIATE_TEST_SUITE_P(
    GoldenFilm, GoldenWords,
    testing::Values(
        Case{"scales", "scales = [1, 10]\n"}, Case{"trail", "trail = 4\nscales = [1]\nundeformed = true\n"},
        Case{"nodes", "nodes = true\nscales = [10]\n"},
        Case{"traces", "traces = [\"beam.tip\"]\ntriads = [\"beam\", \"beam.tip\"]\nscales = [1]\n"},
        Case{"forces", "forces = true\nscales = [1]\n"}, Case{"strain", "color_by = \"strain\"\ncolormap = \"turbo\"\nscales = [1]\n"},
        Case{"stress", "color_by = \"stress\"\nscales = [1]\n"},
        Case{"velocity", "color_by = \"velocity\"\nscales = [1]\ncolor_range = [0, 2]\n"},
        Case{"body", "color_by = \"body\"\nscales = [1]\nedges = true\n"},
        Case{"views", "camera = { views = [\"front\", \"iso\"] }\nscales = [1]\n"},
        Case{"path", "camera = { path = [{ t = 0, position = [0.5, 0, 3] }, { t = 1, position = [3, 1, 0.5] }] }\nscales = [1]\n"},
        Case{"follow", "camera = { follow = \"block\", orbit = 90 }\nscales = [1]\nbackground = \"dark\"\n"},
        Case{"plot", "overlay = { plot = [\"tip.y\"], plot_place = \"beside\" }\nscales = [1]\nsize = [320, 180]\n"},
        Case{"white", "background = \"white\"\nsilhouette = true\nground = false\nscales = [1]\n"},
        Case{"corotated", "exaggeration = \"corotated\"\nscales = [1, 40]\n"},
        Case{"orbit", "camera = { orbit = 360, projection = \"orthographic\" }\nscales = [1]\n"},
        Case{"legend", "color_by = \"body\"\nbackground = \"white\"\nscales = [1, 10]\nsize = [320, 180]\n"},
        Case{"undeformed", "undeformed = true\nscales = [20]\ncolor_by = \"none\"\n"},
        Case{"trail_exaggerated", "trail = 6\nscales = [1, 20]\nground = false\n"},
        Case{"orthographic", "camera = { projection = \"orthographic\" }\nscales = [1, 10]\n"},
        Case{"clear", "background = \"transparent\"\nscales = [1, 10]\ntrail = 2\nnodes = true\ntraces = [\"beam.tip\"]\n"},
        Case{"creases", "edges = \"creases\"\nscales = [1]\nnodes = true\n"},
        Case{"plain", "look = \"plain\"\nscales = [1]\nundeformed = true\n"},
        Case{"presentation", "look = \"presentation\"\nscales = [1]\nsize = [320, 180]\n"},
        Case{"print", "look = \"print\"\nscales = [1]\nbands = 8\nsize = [320, 180]\n"},
        Case{"isolines", "isolines = 10\ncolor_scale = \"log\"\nscales = [1]\nsize = [320, 180]\n"},
        Case{"section", "section = { normal = [0, 0, 1] }\nprobes = [\"beam.tip\"]\nextremes = true\nscales = [1]\nsize = [320, 180]\n"},
        Case{"plane", "camera = { preset = \"plane\" }\nscales = [1, 10]\n"},
        Case{"range", "color_range = [0, 0.005]\ncolormap = \"coolwarm\"\nscales = [1]\n"}),
    [](const auto& one) { return std::string(one.param.name); });

// A beam of a thousandth of its length, and a block from a file with materials.
TEST(GoldenFilm, ThinBeamAndMaterialsOfAFile) {
  const Scratch scratch;
  scratch.put("block.mtl", "newmtl red\nKd 0.8 0.15 0.1\nnewmtl blue\nKd 0.1 0.3 0.8\n");
  sim::Results results = test::swinging_beam(0.03);
  results.bodies[0].section = sim::make_section("circle", {{"diameter", 0.001}});
  results.bodies[1].mesh = scratch
                               .put("block.obj",
                                    "mtllib block.mtl\nv -0.1 -0.1 -0.1\nv 0.1 -0.1 -0.1\nv 0.1 0.1 -0.1\nv -0.1 0.1 -0.1\nv 0 0 0.15\n"
                                    "usemtl red\nf 1 4 3 2\nf 1 2 5\nf 2 3 5\nusemtl blue\nf 3 4 5\nf 4 1 5\n")
                               .string();
  render::RendererInfo info;
  const render::Image image = draw("scales = [1, 5]\n", 2, info, results);
  test::expect_golden(image, info, "film_thin");
}

// Two forms of a modal body, one of them shown: the second bends the other way.
TEST(GoldenFilm, ColourByMode) {
  sim::Results results = test::swinging_beam(0.03);
  test::make_modal(results);
  render::RendererInfo info;
  const render::Image image = draw("color_by = \"mode\"\nmode = 2\nscales = [1, 4]\n", 2, info, results);
  test::expect_golden(image, info, "film_mode");
}

// A force per length as a row of arrows.
TEST(GoldenFilm, RowOfArrows) {
  render::RendererInfo info;
  const auto add = [](std::string& text) {
    text.insert(text.find("[render]"),
                "[[force]]\nname = \"wind\"\nkind = \"distributed\"\non = \"beam\"\ndirection = [0, -1, 0]\nvalue = \"20\"\n");
  };
  const render::Image image = draw("forces = true\nscales = [1]\nsize = [320, 180]\n", 2, info, test::swinging_beam(), add);
  test::expect_golden(image, info, "film_rows");
}

// The exaggerated beam as the lines of its mesh, dark blue, over a red solid.
TEST(GoldenFilm, MeshOverTheBody) {
  render::RendererInfo info;
  const render::Image image = draw("color_by = \"none\"\nscales = [1, 20]\n", 2, info, test::swinging_beam(), [](std::string& scene) {
    scene.insert(scene.find("length = 1.0"), "color = \"#8c1a1a\"\ndrawing = { ghost = \"mesh\", ghost_color = \"#2255cc\" }\n");
  });
  test::expect_golden(image, info, "film_mesh");
}

TEST(GoldenFilm, ContactSheet) {
  const Scratch scratch;
  render::Renderer renderer;
  const sim::Results results = test::swinging_beam();
  const film::RenderSettings settings =
      film::parse_render_settings("title = \"x\"\n[render]\nscales = [1]\nframe_rate = 12\nspeed = 1\nsize = [200, 140]\n", "golden.toml");
  const film::Animation animation = film::make_animation(results, settings, nullptr);
  film::write_contact_sheet(animation, {0, animation.count, 6}, renderer, scratch.path() / "sheet.png");
  const render::Image sheet = render::read_png(scratch.path() / "sheet.png");
  // Cells of the film's shape, drawn for it: as large as the film's own pictures at most.
  EXPECT_GE(sheet.width, 3 * 160);
  EXPECT_LE(sheet.width, 1920);
  test::expect_golden(sheet, renderer.info(), "film_sheet");
}

}  // namespace

}  // namespace test_golden
