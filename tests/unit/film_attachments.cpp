// Frames, traces, arrows, springs, cameras and channels of the [render] words.
#include "film_swing.h"
#include "scratch.h"

#include "render/film/attachments.h"
#include "render/film/filming.h"
#include "render/image/png.h"
#include "sim/scene/scene_reader.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace test_attachments {
namespace {

using namespace flexframe;

film::RenderSettings words(const std::string& table) {
  return film::parse_render_settings("title = \"x\"\n[render]\n" + table, "scene.toml");
}

TEST(Places, FramesFollowTheirNodes) {
  const sim::Results results = test::swinging_beam();
  const film::SamplePlace at{120, 0.0};
  const auto tip = film::find_place(results, nullptr, "beam.node8"), body = film::find_place(results, nullptr, "block"),
             ground = film::find_place(results, nullptr, "ground");
  ASSERT_TRUE(tip && body && ground);
  EXPECT_FALSE(film::find_place(results, nullptr, "beam.middle"));
  EXPECT_FALSE(film::find_place(results, nullptr, "beem"));
  // The block sits on the tip.
  const glm::dvec3 a(film::place_pose(results, *tip, at, 1.0)[3]), b(film::place_pose(results, *body, at, 1.0)[3]);
  EXPECT_LT(glm::length(a - b), 1e-12);
  // Ten times the deflection, across the undeformed beam.
  const double t = results.times[120], angle = 0.8 * std::sin(2.0 * t), deflection = 0.01 * std::sin(9.0 * t);
  const glm::dvec3 ten(film::place_pose(results, *tip, at, 10.0)[3]);
  EXPECT_LT(glm::length(ten - glm::dvec3(std::cos(angle) - 10 * deflection * std::sin(angle),
                                         std::sin(angle) + 10 * deflection * std::cos(angle), 0.0)),
            1e-12);
  EXPECT_EQ(film::place_pose(results, *ground, at, 1.0), glm::dmat4(1.0));
}

// A beam alone is its root, wherever the deformation is shown from.
TEST(Places, ABeamAloneIsItsRoot) {
  sim::Results results = test::swinging_beam();
  sim::ResultBody& beam = results.bodies[0];
  beam.nodes[0].name = "root";
  beam.displacement.col(1).setConstant(0.02);  // as seen from mean axes
  const film::SamplePlace at{120, 0.0};
  for (const double scale : {1.0, 10.0}) {
    const glm::dmat4 alone = film::place_pose(results, film::find_place(results, nullptr, "beam").value(), at, scale),
                     root = film::place_pose(results, film::find_place(results, nullptr, "beam.root").value(), at, scale);
    EXPECT_EQ(alone, root);
    EXPECT_NEAR(glm::length(glm::dvec3(alone[3])), scale * 0.02, 1e-12);
  }
}

// The own frame of a modal body that is shown from elsewhere is that of its coordinates.
TEST(Places, AModalBodyAloneIsTheFrameOfItsCoordinates) {
  sim::Results results = test::swinging_beam();
  test::make_modal(results);
  sim::ResultBody& beam = results.bodies[0];
  beam.kind = "modal";
  beam.held_position = Eigen::MatrixX3d::Zero(results.times.size(), 3);
  beam.held_rotation = beam.held_position;
  beam.held_position.col(1).setConstant(0.03);
  beam.held_rotation.col(2).setConstant(0.5 * M_PI);
  beam.shown_columns = sim::MatX::Zero(6, 2);
  const film::SamplePlace at{120, 0.5};
  const film::FramePlace place = film::find_place(results, nullptr, "beam").value();
  for (const double scale : {1.0, 10.0}) {
    const glm::dmat4 pose = film::place_pose(results, place, at, scale), body = film::body_pose(beam, at);
    EXPECT_LT(glm::length(glm::dvec3(pose[3] - body[3]) - scale * 0.03 * glm::dvec3(body[1])), 1e-12);
    EXPECT_LT(glm::length(glm::dvec3(pose[0] - body[1])), 1e-12);
  }
}

// A point that goes round five hundred times: its trace is the circle, not a star through every sixth sample.
TEST(Attachments, TracesOfManySamplesKeepTheirShape) {
  constexpr int samples = 10001;
  sim::Results results = test::swinging_beam(0.0, samples, 10.0);
  results.bodies.erase(results.bodies.begin());
  for (int i = 0; i < samples; ++i) {
    const double angle = 2.0 * M_PI * 50.0 * results.times[i];
    results.bodies[0].position.row(i) << std::cos(angle), std::sin(angle), 0.0;
  }
  const film::Animation animation = film::make_animation(results, words("traces = [\"block\"]\n"), nullptr);
  film::PictureMemory memory;
  film::update_picture(animation, animation.count - 1, memory);
  const auto line = std::find_if(memory.picture.lines.begin(), memory.picture.lines.end(), [](const render::Lines& l) { return l.strip; });
  ASSERT_NE(line, memory.picture.lines.end());
  double least = 1.0;
  for (size_t k = 1; k < line->points.size(); ++k)
    least = std::min(least, static_cast<double>(glm::length(0.5f * (line->points[k - 1] + line->points[k]))));
  EXPECT_GT(least, 0.98);
}

// legend = false takes that of arrows along, and --no-overlay every word.
TEST(Attachments, WordsThatAreNotWantedAreNotThere) {
  const sim::Results results = test::swinging_beam();
  const std::string text =
      std::string(test::swinging_scene) +
      "[[force]]\nkind = \"force\"\non = \"block\"\ndirection = [0, 1, 0]\nvalue = 8\n[render]\nforces = true\nextremes = true\n"
      "dimensions = [{ from = \"ground\", to = \"block\" }]\n";
  const sim::Scene scene = sim::parse_scene(text, "s.toml");
  film::RenderSettings s = film::parse_render_settings(text, "s.toml");
  film::PictureMemory memory;
  const auto draw = [&] { film::update_picture(film::make_animation(results, s, &scene), 5, memory); };
  draw();
  EXPECT_EQ(memory.picture.overlay.legend.size(), 1u);
  EXPECT_EQ(memory.picture.labels.size(), 3u);
  EXPECT_FALSE(memory.picture.dimensions.at(0).text.empty());
  s.overlay.legend = false;
  draw();
  EXPECT_TRUE(memory.picture.overlay.legend.empty());
  s.overlay.words = false;
  draw();
  EXPECT_TRUE(memory.picture.labels.empty());
  EXPECT_TRUE(memory.picture.dimensions.at(0).text.empty());
  EXPECT_FALSE(memory.picture.overlay.grid_note);
}

TEST(Attachments, ProbesWithoutAValueAreToldOf) {
  const sim::Results results = test::swinging_beam();
  const auto probe = [&](const std::string& table) {
    const film::Animation a = film::make_animation(results, words(table), nullptr);
    film::PictureMemory memory;
    film::update_picture(a, 3, memory);
    const bool told = std::any_of(a.warnings.begin(), a.warnings.end(), [](const std::string& w) { return w.starts_with("probe "); });
    return std::pair(told, memory.picture.labels.size());
  };
  EXPECT_EQ(probe("probes = [\"beam.node8\"]\n"), std::pair(false, size_t{1}));
  EXPECT_EQ(probe("probes = [\"block\"]\n"), std::pair(true, size_t{0}));  // rigid: no displacement
  EXPECT_EQ(probe("probes = [\"block\"]\ncolor_by = \"velocity\"\n"), std::pair(false, size_t{1}));
}

TEST(Attachments, TracesGrowAndEndAtTheirPoint) {
  const sim::Results results = test::swinging_beam();
  film::RenderSettings s = words("edges = false\ntraces = [\"block\"]\ntriads = [\"beam\"]\nscales = [1]\n");
  const film::Animation animation = film::make_animation(results, s, nullptr);
  film::PictureMemory memory;
  size_t before = 0;
  for (const int k : {0, 10, 25}) {
    film::update_picture(animation, k, memory);
    ASSERT_EQ(memory.picture.lines.size(), 1u);
    const auto& points = memory.picture.lines[0].points;
    EXPECT_GT(points.size(), before);
    before = points.size();
    const film::SamplePlace now = film::find_sample(results.times, film::picture_time(animation, k));
    const glm::dvec3 here(film::body_pose(results.bodies[1], now)[3]);
    EXPECT_LT(glm::length(glm::dvec3(points.back()) - here), 1e-6);
    EXPECT_EQ(memory.picture.triads.size(), 1u);
  }
  s.traces = {"blok"};
  try {
    film::make_animation(results, s, nullptr);
    ADD_FAILURE();
  } catch (const sim::InputError& e) {
    EXPECT_NE(std::string(e.what()).find("did you mean 'block'"), std::string::npos) << e.what();
  }
}

TEST(Attachments, ArrowsAreAsLongAsTheirForces) {
  const sim::Results results = test::swinging_beam();
  const std::string text = std::string(test::swinging_scene) + R"(
[[force]]
kind = "force"
on = "block"
direction = [0, 3, 0]
value = "t < 0.5 ? 8 : 2"
[render]
speed = 1
forces = true
scales = [1]
)";
  const sim::Scene scene = sim::parse_scene(text, "scene.toml");
  const film::Animation animation = film::make_animation(results, film::parse_render_settings(text, "scene.toml"), &scene);
  film::PictureMemory memory;
  const auto arrow = [&](int k) {
    film::update_picture(animation, k, memory);
    EXPECT_EQ(memory.picture.arrows.size(), 1u);
    EXPECT_EQ(memory.springs.size(), 2u);  // and the plate by which the ground holds it
    return memory.picture.arrows.at(0);
  };
  const render::Arrow early = arrow(5), late = arrow(25);
  EXPECT_NEAR((early.to.y - early.from.y) / (late.to.y - late.from.y), 4.0, 1e-9);
  EXPECT_EQ(early.to.x, early.from.x);
  // The spring reaches from the ground's origin to the block.
  const render::Bounds spring = render::compute_bounds(memory.springs[0].positions);
  EXPECT_NEAR(spring.upper.x, memory.picture.arrows[0].from.x, 0.05);
  // The plate stands at the ground's end, square to the spring at the start (along x), on its far side, wider than the coil.
  const render::Bounds plate = render::compute_bounds(memory.springs[1].positions);
  EXPECT_NEAR(plate.upper.x, 0.0, 1e-6);
  EXPECT_LT(plate.lower.x, -1e-3);
  EXPECT_NEAR(plate.centre().y, 0.0, 1e-6);
  EXPECT_GT(plate.upper.z, 1.4 * animation.springs[0].coil);
  EXPECT_LT(plate.upper.z, 1.6 * animation.springs[0].coil);
}

// One scale for all: arrows of forces and reactions compare as their values do, which stand beside them and in the legend.
TEST(Attachments, ReactionsThatAreOutputsHaveArrowsOnTheScaleOfForces) {
  sim::Results results = test::swinging_beam();
  const auto column = [&](const std::string& name, double value) {
    results.outputs.push_back({name, "N", sim::VecX::Constant(results.times.size(), value)});
  };
  column("held.x", -3.0);
  column("held.y", 4.0);
  column("held.z", 0.0);
  const std::string text = std::string(test::swinging_scene) + R"(
[[force]]
name = "push"
kind = "force"
on = "block"
direction = [0, 1, 0]
value = "10"
[[force]]
name = "read"
kind = "force"
on = "block"
direction = [0, 1, 0]
value = "10*away"
[[output]]
name = "away"
of = "block"
quantity = "distance"
relative_to = "ground"
[[output]]
name = "held"
of = "hinge"
quantity = "reaction"
[render]
forces = true
scales = [1]
)";
  const sim::Scene scene = sim::parse_scene(text, "scene.toml");
  const film::Animation animation = film::make_animation(results, film::parse_render_settings(text, "scene.toml"), &scene);
  film::PictureMemory memory;
  film::update_picture(animation, 5, memory);
  ASSERT_EQ(memory.picture.arrows.size(), 2u);
  const render::Arrow push = memory.picture.arrows[0], held = memory.picture.arrows[1];
  EXPECT_NEAR(glm::length(held.to - held.from) / glm::length(push.to - push.from), 0.5, 1e-9);
  EXPECT_NEAR((held.to.x - held.from.x) / (held.to.y - held.from.y), -0.75, 1e-9);
  ASSERT_EQ(memory.picture.labels.size(), 2u);
  EXPECT_EQ(memory.picture.labels[0].text, "10 N");
  EXPECT_EQ(memory.picture.labels[1].text, "5 N");
  ASSERT_EQ(memory.picture.overlay.legend.size(), 2u);
  EXPECT_EQ(memory.picture.overlay.legend[1].text, "reaction, at most 5 N");
  const auto told = [](const std::string& note) { return note.find("'read' has no arrow") != std::string::npos; };
  EXPECT_TRUE(std::any_of(animation.notes.begin(), animation.notes.end(), told));
}

// Three digits without an exponent, whatever the size of the machine.
TEST(Attachments, ValuesOfForcesAreReadable) {
  const std::vector<std::pair<std::string, std::string>> wanted = {
      {"2e9", "2 GN"}, {"999.7", "1 kN"}, {"999.4", "999 N"}, {"2.5e6", "2.5 MN"}, {"3e-7", "300 nN"}};
  for (const auto& [value, words] : wanted) {
    const std::string text = std::string(test::swinging_scene) + R"(
[[force]]
kind = "force"
on = "block"
direction = [0, 1, 0]
value = ")" + value + R"("
[render]
forces = true
scales = [1]
)";
    const sim::Results results = test::swinging_beam();
    const sim::Scene scene = sim::parse_scene(text, "scene.toml");
    const film::Animation animation = film::make_animation(results, film::parse_render_settings(text, "scene.toml"), &scene);
    film::PictureMemory memory;
    film::update_picture(animation, 5, memory);
    ASSERT_EQ(memory.picture.labels.size(), 1u) << value;
    EXPECT_EQ(memory.picture.labels[0].text, words) << value;
  }
}

// A force per length: arrows of one length along the beam as it is bent, each from outside to the beam's surface, with the value in N/m.
TEST(Attachments, AForcePerLengthIsARowOfArrowsThatEndAtTheBeam) {
  const sim::Results results = test::swinging_beam();
  const std::string text = std::string(test::swinging_scene) + R"(
[[force]]
name = "wind"
kind = "distributed"
on = "beam"
direction = [0, 0, -2]
value = "300*t"
[render]
speed = 1
frame_rate = 10
forces = true
scales = [1]
)";
  const sim::Scene scene = sim::parse_scene(text, "scene.toml");
  const film::Animation animation = film::make_animation(results, film::parse_render_settings(text, "scene.toml"), &scene);
  film::PictureMemory memory;
  film::update_picture(animation, 5, memory);  // t = 0.5 s: 150 N/m of at most 300
  const std::vector<render::Arrow>& arrows = memory.picture.arrows;
  ASSERT_EQ(arrows.size(), 11u);
  const double angle = 0.8 * std::sin(1.0), a = 0.01 * std::sin(4.5);
  for (int k = 0; k < 11; ++k) {
    // u_y = a x^2, of the beam's nodes every eighth, in between along straight lines: at most a / 256 off.
    const double x = k / 10.0, y = a * x * x;
    const glm::dvec3 tip = arrows[static_cast<size_t>(k)].to, way = tip - arrows[static_cast<size_t>(k)].from;
    EXPECT_NEAR(tip.x, x * std::cos(angle) - y * std::sin(angle), 1e-4) << k;
    EXPECT_NEAR(tip.y, x * std::sin(angle) + y * std::cos(angle), 1e-4) << k;
    EXPECT_NEAR(tip.z, 0.02, 3e-5) << k;  // half the section's 40 mm; the drawn circle is a polygon
    EXPECT_LT(glm::length(glm::dvec2(way)), 1e-12) << k;
    EXPECT_NEAR(way.z, -150.0 * animation.line_length, 1e-12) << k;
  }
  EXPECT_GT(300.0 * animation.line_length, 0.08);  // a tenth of the machine, which is a good metre large
  ASSERT_EQ(memory.picture.labels.size(), 1u);
  EXPECT_EQ(memory.picture.labels[0].text, "150 N/m");
  ASSERT_EQ(memory.picture.overlay.legend.size(), 1u);
  EXPECT_EQ(memory.picture.overlay.legend[0].text, "force per length, at most 300 N/m");
  // The fitted camera sees the row at its longest.
  EXPECT_GT(animation.bounds.upper.z, 0.02 + 0.99 * 300.0 * animation.line_length);
}

// Welds: a sleeve around a beam that carries a body, a foot below a body's face on the ground, a block where a body is held inside.
TEST(Attachments, WeldsHaveSymbols) {
  sim::Results results = test::swinging_beam();
  const auto add_joint = [&](const std::string& name, const glm::dvec3& at) {
    sim::ResultJoint joint;
    joint.name = name;
    joint.position = sim::MatX::Zero(results.times.size(), 3);
    joint.orientation = sim::MatX::Zero(results.times.size(), 4);
    joint.orientation.col(0).setOnes();
    for (int c = 0; c < 3; ++c) joint.position.col(c).setConstant(at[c]);
    results.joints.push_back(joint);
  };
  add_joint("clamp", {1, 0, 0});  // at t = 0 the beam lies along x
  add_joint("foot", {1, -0.3, 0});
  // The block is a box of 0.4 x 0.6 x 0.2 around its origin.
  std::string text = test::swinging_scene;
  const std::string inertia = "inertia = [0.01, 0.01, 0.01]\n";
  text.insert(text.find(inertia) + inertia.size(), "shapes = [{ shape = \"box\", size = [0.4, 0.6, 0.2] }]\n");
  text += "[[joint]]\nname = \"foot\"\nkind = \"weld\"\nparent = \"ground\"\nchild = \"block\"\n";
  const sim::Scene scene = sim::parse_scene(text, "scene.toml");
  const film::RenderSettings settings = film::parse_render_settings(text, "scene.toml");
  const film::Animation animation = film::make_animation(results, settings, &scene);
  ASSERT_EQ(animation.symbols.size(), 2u);
  const auto bounds = [&](size_t k) { return render::compute_bounds(animation.symbols[k].positions); };
  // Around the beam's 40 mm, and moves along.
  EXPECT_FALSE(animation.symbols[0].fixed);
  EXPECT_NEAR(bounds(0).upper.y, 0.023, 1e-4);
  EXPECT_LT(bounds(0).upper.x, 0.02);
  // Below the box's lower face, wider than it, and fixed; in the joint's frame.
  EXPECT_TRUE(animation.symbols[1].fixed);
  EXPECT_NEAR(bounds(1).upper.y, 0.0, 1e-6);
  EXPECT_LT(bounds(1).lower.y, -0.02);
  EXPECT_GT(bounds(1).upper.x, 0.22);
  EXPECT_GT(bounds(1).upper.z, 0.12);

  // Held in its middle: a small block.
  results.joints[1].position.col(1).setZero();
  const film::Animation inside = film::make_animation(results, settings, &scene);
  ASSERT_EQ(inside.symbols.size(), 2u);
  const render::Bounds block = render::compute_bounds(inside.symbols[1].positions);
  EXPECT_NEAR(block.upper.y, -block.lower.y, 1e-9);
  EXPECT_LT(block.upper.y, 0.05);
}

TEST(CameraWords, PathsOrbitsAndViews) {
  const sim::Results results = test::swinging_beam();
  film::RenderSettings s = words("camera = { path = [{ t = 0, position = [0, 0, 3] }, { t = 1, position = [3, 0, 0] }] }\n");
  film::Animation animation = film::make_animation(results, s, nullptr);
  film::PictureMemory memory;
  film::update_picture(animation, 0, memory);
  EXPECT_EQ(memory.picture.camera.position, glm::dvec3(0, 0, 3));
  film::update_picture(animation, animation.count - 1, memory);
  EXPECT_EQ(memory.picture.camera.position, glm::dvec3(3, 0, 0));

  s = words("camera = { orbit = 180 }\n");
  animation = film::make_animation(results, s, nullptr);
  film::update_picture(animation, animation.count - 1, memory);
  const glm::dvec3 first = animation.camera.position - animation.camera.target,
                   last = memory.picture.camera.position - memory.picture.camera.target;
  EXPECT_NEAR(glm::length(first), glm::length(last), 1e-12);
  EXPECT_NEAR(first.x + last.x, 0.0, 1e-9);

  s = words("camera = { views = [\"top\", \"front\", \"iso\"] }\n");
  animation = film::make_animation(results, s, nullptr);
  film::update_picture(animation, 3, memory);
  ASSERT_EQ(memory.picture.views.size(), 3u);
  EXPECT_EQ(memory.picture.views[0].label, "top");
  EXPECT_EQ(memory.picture.views[2].width, 1.0);
  EXPECT_EQ(memory.picture.views[2].label, "iso");
}

TEST(CameraWords, WrongOnesAreAnswered) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"camera = { views = [\"font\"] }", "did you mean 'front'"},
      {"camera = { views = [\"front\"], orbit = 3 }", "excludes"},
      {"camera = { path = [{ t = 0 }] }", "position"},
      {"camera = { path = [{ t = 1, position = [0, 0, 3] }, { t = 1, position = [0, 0, 2] }] }", "rise"},
      {"camera = { path = [{ t = 1, position = [0, 0, 3], zoom = 2 }] }", "zoom"},
      {"channels = [\"dept\"]", "did you mean 'depth'"},
      {"video = \"avi\"", "mp4"},
      {"contact_sheet = 101", "contact_sheet"},
      {"mode = 0", "mode"},
      {"traces = 3", "traces"},
  };
  for (const auto& [line, word] : cases) {
    try {
      words(line + "\n");
      ADD_FAILURE() << "accepted: " << line;
    } catch (const sim::InputError& e) {
      EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << line << " -> " << e.what();
    }
  }
}

TEST(Channels, SixteenBitsBesideThePictures) {
  namespace fs = std::filesystem;
  const sim::Results results = test::swinging_beam();
  film::RenderSettings s = words("channels = [\"depth\", \"scalar\"]\nsize = [160, 90]\nframe_rate = 6\nsamples = 1\n");
  const film::Animation animation = film::make_animation(results, s, nullptr);
  const Scratch scratch;
  const fs::path& folder = scratch.path();
  film::film(animation, {.folder = folder / "frames", .workers = 1});
  for (const char* channel : {"depth", "scalar"}) {
    EXPECT_EQ(std::distance(fs::directory_iterator(folder / channel), {}), animation.count);
    EXPECT_TRUE(render::is_whole_png(folder / channel / "frame_00003.png"));
    EXPECT_FALSE(render::read_png_text(folder / channel / "frame_00003.png", "flexframe-range").empty());
  }
  // A missing channel is drawn again with its picture, the others are kept.
  fs::remove(folder / "depth/frame_00002.png");
  const film::FilmReport report = film::film(animation, {.folder = folder / "frames", .resume = true, .workers = 1});
  EXPECT_EQ(report.drawn, 1);
  EXPECT_TRUE(fs::exists(folder / "depth/frame_00002.png"));
  // Numbers that go by the logarithm say so, and only they.
  EXPECT_TRUE(render::read_png_text(folder / "scalar/frame_00003.png", "flexframe-scale").empty());
  s.range.logarithmic = true;
  film::film(film::make_animation(results, s, nullptr), {.folder = folder / "log", .first = 3, .end = 4, .workers = 1});
  EXPECT_EQ(render::read_png_text(folder / "scalar/frame_00003.png", "flexframe-scale"), "log");
  EXPECT_TRUE(render::read_png_text(folder / "depth/frame_00003.png", "flexframe-scale").empty());
}

}  // namespace

}  // namespace test_attachments
