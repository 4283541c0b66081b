#include "render/film/body_model.h"
#include "render/film/settings.h"

#include <gtest/gtest.h>

namespace test_settings {
namespace {

using namespace flexframe;

film::RenderSettings parse(const std::string& table) { return film::parse_render_settings("title = \"x\"\n" + table, "scene.toml"); }

TEST(RenderSettings, WithoutATableTheDefaultsHold) {
  const film::RenderSettings s = parse("");
  EXPECT_EQ(s.size, (render::Size{1280, 720}));
  EXPECT_EQ(s.frame_rate, 30.0);
  EXPECT_TRUE(s.scales.empty());
  EXPECT_TRUE(s.camera.fit);
}

TEST(RenderSettings, EveryWordOfTheContractIsRead) {
  const film::RenderSettings s = parse(R"([render]
size = [640, 360]
frame_rate = 25
speed = 0.5
samples = 9
scales = [1, 20]
color_by = "strain"
colormap = "turbo"
trail = 3
camera = { position = [1, 2, 3], target = [0, 0, 1], up = [0, 0, 2], fov = 40, projection = "orthographic" }
overlay = { title = false, time = false, scalar_bar = false, triad = false, plot = ["slider.x"] }
)");
  EXPECT_EQ(s.size, (render::Size{640, 360}));
  EXPECT_EQ(s.frame_rate, 25.0);
  EXPECT_EQ(s.speed, 0.5);
  EXPECT_EQ(s.samples, 9);
  EXPECT_EQ(s.scales, (std::vector<double>{1, 20}));
  EXPECT_EQ(s.color_by, film::ColorBy::strain);
  EXPECT_EQ(s.colormap, render::Colormap::turbo);
  EXPECT_EQ(s.trail, 3);
  EXPECT_FALSE(s.camera.fit);
  EXPECT_EQ(s.camera.position, glm::dvec3(1, 2, 3));
  EXPECT_EQ(s.camera.up, glm::dvec3(0, 0, 1));
  EXPECT_EQ(s.camera.projection, render::Projection::orthographic);
  EXPECT_FALSE(s.overlay.title || s.overlay.time || s.overlay.scalar_bar || s.overlay.triad);
  EXPECT_EQ(s.overlay.plot, std::vector<std::string>{"slider.x"});
}

TEST(RenderSettings, WrongWordsAreAnsweredWithLineKeyAndWhatIsAllowed) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> cases = {
      {"frame_rat = 30", {"scene.toml:3", "frame_rat", "did you mean 'frame_rate'"}},
      {"size = [1280]", {"scene.toml:3", "size", "[width, height]"}},
      {"size = [8, 720]", {"size", "16"}},
      {"frame_rate = 0", {"frame_rate", "> 0"}},
      {"speed = -1.0", {"speed", "> 0"}},
      {"samples = 3", {"samples", "1, 4, 9 or 16"}},
      {"scales = \"large\"", {"scales", "auto"}},
      {"scales = [1, 1]", {"scales", "twice"}},
      {"scales = [-1]", {"scales"}},
      {"exaggeration = 10", {"exaggeration", "linear", "scales = [1, 10]"}},
      {"color_by = \"strains\"", {"color_by", "strain"}},
      {"colormap = \"jet\"", {"colormap", "viridis"}},
      {"color_range = [1, 0]", {"color_range", "rise"}},
      {"color_range = \"ful\"", {"did you mean 'full'"}},
      {"color_range = { percentile = 101 }", {"percentile", "per cent"}},
      {"color_scale = \"log\"\ncolor_range = [0, 1]", {"color_range", "positive"}},
      {"look = \"presentaton\"", {"did you mean 'presentation'"}},
      {"camera = { fit = false }", {"position"}},
      {"camera = { position = [0, 0, 0], target = [0, 0, 0] }", {"position", "same point"}},
      {"camera = { fov = 0 }", {"fov", "170"}},
      {"camera = { zoom = 2 }", {"zoom"}},
      {"overlay = { tittle = true }", {"did you mean 'title'"}},
      {"trail = -1", {"trail"}},
  };
  for (const auto& [line, words] : cases) {
    try {
      parse("[render]\n" + line + "\n");
      ADD_FAILURE() << "accepted: " << line;
    } catch (const sim::InputError& e) {
      for (const std::string& word : words)
        EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << line << " -> " << e.what() << " lacks " << word;
    }
  }
}

TEST(RenderSettings, NamesAreCheckedAgainstTheScene) {
  sim::Scene scene;
  scene.file = "scene.toml";
  scene.simulation.duration = 1.0;
  scene.bodies.resize(1);
  scene.bodies[0].name = "rod";
  scene.outputs.resize(1);
  scene.outputs[0].name = "slider";
  film::RenderSettings s;
  s.camera.follow = "rod";
  s.overlay.plot = {"slider.x", "slider"};
  EXPECT_NO_THROW(film::check_render_settings(s, scene));
  s.camera.follow = "rad";
  EXPECT_THROW(film::check_render_settings(s, scene), sim::InputError);
  s.camera.follow = "";
  s.overlay.plot = {"slidr.x"};
  EXPECT_THROW(film::check_render_settings(s, scene), sim::InputError);
  s.overlay.plot.clear();
  s.frame_rate = 9000;
  scene.simulation.duration = 3.2e7;
  s.speed = 1.0;
  EXPECT_THROW(film::check_render_settings(s, scene), sim::InputError);
  // Without a speed a run of a year or a microsecond is played in about ten seconds.
  s.speed = 0.0;
  s.frame_rate = 30;
  EXPECT_NO_THROW(film::check_render_settings(s, scene));
  EXPECT_DOUBLE_EQ(film::playback_speed(s, 3.2e7), 5e6);
  EXPECT_DOUBLE_EQ(film::playback_speed(s, 1e-6), 1e-7);
  EXPECT_DOUBLE_EQ(film::playback_speed(s, 0.012), 2e-3);
  EXPECT_DOUBLE_EQ(film::playback_speed(s, 0.2), 0.1);
  EXPECT_DOUBLE_EQ(film::playback_speed(s, 0.6), 0.2);
  EXPECT_DOUBLE_EQ(film::playback_speed(s, 1.6), 0.5);
  for (const double usual : {0.0, 2.0, 4.0, 600.0}) EXPECT_EQ(film::playback_speed(s, usual), 1.0);
  // From a tenth of a second on: at least 60 pictures, at most 155.
  for (double duration = 0.1; duration < 2.0; duration *= 1.01) {
    const double pictures = duration * 30.0 / film::playback_speed(s, duration);
    EXPECT_TRUE(pictures > 59.99 && pictures < 155.0) << duration << ": " << pictures;
  }
  scene.simulation.duration = 1.0;
  scene.bodies[0].drawing["color"] = "[2, 0, 0]";
  EXPECT_THROW(film::check_render_settings(s, scene), sim::InputError);
}

TEST(RenderSettings, WordsOfABody) {
  sim::BodyDef body;
  body.name = "rod";
  body.kind = sim::BeamDef{};
  body.drawing = {{"color", "#ff0000"}, {"ghost", "mesh"},  {"ghost_color", "[0, 0, 1]"}, {"edges", "creases"},
                  {"diameter", "0.25"}, {"opacity", "0.5"}, {"visible", "false"}};
  const film::BodyLook look = film::read_body_look(body, "scene.toml");
  EXPECT_EQ(look.color, glm::vec3(1, 0, 0));
  EXPECT_EQ(look.ghost, film::GhostStyle::mesh);
  EXPECT_EQ(look.ghost_color, glm::vec3(0, 0, 1));
  EXPECT_EQ(look.edges, film::EdgeLines::creases);
  EXPECT_EQ(look.diameter, 0.25);
  EXPECT_EQ(look.opacity, 0.5f);
  EXPECT_FALSE(look.visible);
  // What is wrong is named, with what is allowed.
  for (const auto& [key, text, named] :
       {std::tuple("ghost", "wires", "mesh"), std::tuple("ghost_color", "blue", "#rrggbb"), std::tuple("edges", "some", "creases"),
        std::tuple("diameter", "0", "length > 0"), std::tuple("ghots", "mesh", "ghost")}) {
    body.drawing = {{key, text}};
    try {
      film::read_body_look(body, "scene.toml");
      ADD_FAILURE() << key;
    } catch (const sim::InputError& e) {
      EXPECT_NE(std::string(e.what()).find(named), std::string::npos) << e.what();
      EXPECT_NE(std::string(e.what()).find("rod"), std::string::npos) << e.what();
    }
  }
  body.kind = sim::RigidDef{};
  body.drawing = {{"diameter", "0.1"}};
  EXPECT_THROW(film::read_body_look(body, "scene.toml"), sim::InputError);
}

TEST(RenderSettings, EdgesAreAWordOrNot) {
  EXPECT_EQ(film::parse_render_settings("[render]\nedges = true\n", "s").edges, film::EdgeLines::mesh);
  EXPECT_EQ(film::parse_render_settings("[render]\nedges = \"creases\"\n", "s").edges, film::EdgeLines::creases);
  EXPECT_EQ(film::parse_render_settings("[render]\n", "s").edges, film::EdgeLines::creases);
  EXPECT_EQ(film::parse_render_settings("[render]\nedges = false\n", "s").edges, film::EdgeLines::none);
  EXPECT_EQ(film::parse_render_settings("[render]\nlook = \"plain\"\n", "s").edges, film::EdgeLines::none);
  EXPECT_THROW(film::parse_render_settings("[render]\nedges = \"all\"\n", "s"), sim::InputError);
  EXPECT_THROW(film::parse_render_settings("[render]\nedges = 3\n", "s"), sim::InputError);
}

TEST(RenderSettings, OptionsOfTheProgram) {
  EXPECT_EQ(film::parse_size("640x360"), (render::Size{640, 360}));
  for (const char* wrong : {"640", "640x", "x360", "0x360", "640.5x360", "1e9x360", "640x360x2", "nanx360"})
    EXPECT_THROW(film::parse_size(wrong), sim::InputError) << wrong;
  EXPECT_EQ(film::parse_scales("1,20"), (std::vector<double>{1, 20}));
  EXPECT_TRUE(film::parse_scales("auto").empty());
  for (const char* wrong : {"", "1,", "a", "-1", "1,1", "inf"}) EXPECT_THROW(film::parse_scales(wrong), sim::InputError) << wrong;
}

}  // namespace

}  // namespace test_settings
