// Drawn pictures: known pixels, known depths, bits that do not depend on anything they should not.
#include "render/draw/renderer.h"
#include "render/frame/camera.h"
#include "render/image/image_compare.h"
#include "render/image/png.h"
#include "sim/base/error.h"
#include "tests/unit/render_front.h"
#include "tests/unit/render_solids.h"

#include <glm/gtc/matrix_transform.hpp>

#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

namespace flexframe::render::test_draw {
namespace {

// The scene of the determinism tests: everything at once.
struct Zoo {
  Shape ball = make_ball(0.5, 24), box = make_box({1, 0.6, 0.8}), tube;
  std::vector<float> scalars;
  Picture picture;
  Zoo() {
    const std::vector<glm::dvec3> path = {{-1.2, -0.4, 0.3}, {0, 0.2, 0.5}, {1.2, -0.3, 0.2}};
    tube = make_tube(path, 0.12, 24);
    for (const glm::vec3& q : tube.positions) scalars.push_back(q.x);
    picture.size = {320, 240};
    Surface a = surface_of(ball), b = surface_of(box), c = surface_of(tube), ghost = surface_of(box), second = surface_of(ball);
    b.edges = true;
    b.pose[3] = glm::dvec4(0.9, 0.1, -0.6, 1.0);
    c.scalars = scalars;
    ghost.opacity = 0.4f;
    second.opacity = 0.3f;
    second.pose[3] = glm::dvec4(0.4, 0.1, 0.2, 1.0);
    second.material.color = {0.2f, 0.4f, 0.9f};
    a.silhouette = true;
    picture.surfaces = {a, b, c, ghost, second};
    picture.scalar_map = {Colormap::viridis, -1.2, 1.2, 0};
    picture.lines.push_back(
        {.points = {{-1, -1, 0}, {1, 1, 0.5}, {1, -1, 0}}, .colors = {}, .faces = {}, .color = {0.8f, 0.2f, 0.1f, 0.6f}, .width = 4.0f});
    picture.markers.push_back({.points = {{0, 0, 1}, {0.5, 0.5, 1}}});
    picture.arrows.push_back({{0, 0.6, 0}, {0, 1.2, 0}});
    std::vector<glm::dvec3> corners;
    append_corners(corners, {glm::dvec3(-1.5, -1, -1), glm::dvec3(1.5, 1.2, 1)});
    picture.overlay.title = "Zoo";
    picture.overlay.scalar_bar = ScalarBar{"x", "m"};
    picture.overlay.triad = true;
    picture.ground = default_ground(corners, glm::dvec3(0, 1, 0));
    picture.camera = fit_camera(picture, corners, default_view(corners, glm::dvec3(0)));
  }
};

TEST(Draw, SquareCoversExactlyItsPixels) {
  const std::vector<glm::vec3> positions = {{-0.5, -0.5, 0}, {0.5, -0.5, 0}, {0.5, 0.5, 0}, {-0.5, 0.5, 0}};
  const std::vector<glm::uvec3> triangles = {{0, 1, 2}, {0, 2, 3}};
  Picture p = front_view();
  Surface s;
  s.positions = positions;
  s.triangles = triangles;
  p.surfaces = {s};
  const Image image = renderer().draw(p);
  for (int y = 0; y < 300; ++y)
    for (int x = 0; x < 400; ++x) {
      const bool inside = x >= 150 && x < 250 && y >= 100 && y < 200;
      ASSERT_EQ(at(image, x, y) != glm::ivec3(255), inside) << x << " " << y;
    }
  // Half a pixel further: half the light on the edge, in linear light.
  p.surfaces[0].pose[3] = glm::dvec4(0.005, 0, 0, 1);
  p.background.top = p.background.bottom = glm::vec3(0.0f);
  const Image shifted = renderer().draw(p);
  const int full = at(shifted, 200, 150).g, half = at(shifted, 150, 150).g;
  const double expected = 255.0 * std::pow(0.5 * std::pow((full / 255.0 + 0.055) / 1.055, 2.4), 1.0 / 2.4) * 1.055 - 0.055 * 255.0;
  EXPECT_NEAR(half, expected, 1.5);
}

// A disc of few faces that turns: its middle stands still although all corners move.
TEST(Draw, LengthsAreTakenWhereTheyAreSeen) {
  const std::vector<glm::vec3> positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  const std::vector<glm::uvec3> triangles = {{0, 1, 2}, {0, 2, 3}};
  std::vector<glm::vec3> velocity, normal, shear;
  std::vector<float> speed, mises;
  for (const glm::vec3& p : positions) {
    velocity.emplace_back(-p.y, p.x, 0.0f);
    speed.push_back(glm::length(velocity.back()));
    // Bending about both axes: xx = 2 y, yy = x, xy = 0.5 x, in units of 1e8 Pa.
    normal.emplace_back(2e8f * p.y, 1e8f * p.x, 0.0f);
    shear.emplace_back(0.5e8f * p.x, 0.0f, 0.0f);
    mises.push_back(1.0f);
  }
  Picture p = front_view();
  p.camera.height = 2.0;
  Surface s;
  s.positions = positions;
  s.triangles = triangles;
  s.scalars = speed;
  s.vectors = velocity;
  p.surfaces = {s};
  p.scalar_map = {Colormap::viridis, 0.0, 1.5};
  const auto value = [&](const Image16& image, int x, int y) {
    return image.pixels[std::size_t(y) * 400 + x] / 65534.0 * p.scalar_map.upper;
  };
  Image16 image = renderer().draw_scalar(p);
  EXPECT_LT(value(image, 200, 150), 0.01);
  for (int x = 70; x < 330; x += 13) {
    const double u = (x + 0.5 - 200) / 150, v = (150 - 40.5) / 150;
    EXPECT_NEAR(value(image, x, 40), std::hypot(u, v), 1e-3);
  }
  p.surfaces[0].scalars = mises;
  p.surfaces[0].vectors = normal;
  p.surfaces[0].shears = shear;
  p.scalar_map.upper = 3e8;
  image = renderer().draw_scalar(p);
  for (int x = 70; x < 330; x += 13) {
    const double u = (x + 0.5 - 200) / 150, v = (150 - 90.5) / 150, xx = 2e8 * v, yy = 1e8 * u, xy = 0.5e8 * u;
    EXPECT_NEAR(value(image, x, 90), std::sqrt(xx * xx - xx * yy + yy * yy + 3.0 * xy * xy), 3e5);
  }
  // Logarithmic colours: the place on the bar is that of the logarithm, of lengths too.
  p.surfaces[0].shears = {};
  p.surfaces[0].scalars = speed;
  p.surfaces[0].vectors = velocity;
  p.scalar_map = {Colormap::viridis, 0.01, 1.0};
  p.scalar_map.logarithmic = true;
  image = renderer().draw_scalar(p);
  const double u = 0.5 / 150, v = (150 - 130.5) / 150;
  EXPECT_NEAR(image.pixels[std::size_t(130) * 400 + 200] / 65534.0, std::log10(std::hypot(u, v) / 0.01) / 2.0, 2e-3);
}

// A body of a nanometre is drawn as one of a metre.
TEST(Draw, SizesDownToANanometre) {
  Zoo zoo;
  zoo.picture.overlay = {};
  zoo.picture.lines.clear();  // their width is no length of the scene, their points would need copies
  Picture small = zoo.picture;
  const double factor = std::exp2(-30);
  for (Surface& s : small.surfaces)
    for (int c = 0; c < 4; ++c) s.pose[c] = glm::dvec4(factor * glm::dvec3(s.pose[c]), s.pose[c].w);
  for (Markers& m : small.markers)
    for (glm::vec3& point : m.points) point *= static_cast<float>(factor);
  for (Arrow& a : small.arrows) a.from *= factor, a.to *= factor;
  small.ground->point *= factor;
  small.ground->spacing = 0.2 * factor;
  zoo.picture.ground->spacing = 0.2;  // round steps are those of metres
  small.camera.position *= factor;
  small.camera.target *= factor;
  small.camera.height *= factor;
  const Image metre = renderer().draw(zoo.picture), nanometre = renderer().draw(small);
  int seen = 0, different = 0;
  for (std::size_t i = 0; i < metre.pixels.size(); ++i) {
    seen += metre.pixels[i] < 100;
    different += std::abs(int(metre.pixels[i]) - int(nanometre.pixels[i])) > 2;
  }
  EXPECT_GT(seen, 2000);
  EXPECT_LT(different, static_cast<int>(metre.pixels.size()) / 100);  // edges and shadows by rounding
}

TEST(Draw, SymbolsShowThroughAndGhostsKeepOff) {
  const Shape box = make_box({1, 1, 1}), inner = make_ball(0.2, 16), large = make_box({2, 1.2, 0.5});
  Picture p = front_view();
  Surface body = surface_of(box), symbol = surface_of(inner);
  symbol.material.color = {0.9f, 0.1f, 0.1f};
  p.surfaces = {body, symbol};
  const Image hidden = renderer().draw(p);
  p.surfaces[1].seen_through = 0.4f;
  const Image through = renderer().draw(p);
  const glm::ivec3 before = at(hidden, 200, 150), after = at(through, 200, 150);
  EXPECT_GT(after.r - after.g, before.r - before.g + 30) << "the red ball does not show";
  EXPECT_GT(after.g, 30) << "the body in front of it must be seen too";
  EXPECT_EQ(at(hidden, 165, 150), at(through, 165, 150));
  p.surfaces[1].pose[3] = glm::dvec4(0, 0, 0.8, 1);  // before the body: nothing is blended
  const Image before_it = renderer().draw(p);
  p.surfaces[1].seen_through = 0.0f;
  EXPECT_EQ(before_it.pixels, renderer().draw(p).pixels);

  // Lines too, each point once.
  p.surfaces = {body};
  p.lines = {{.points = {{-1, 0, 0}, {0, 0, 0}, {1, 0, 0}},
              .colors = {},
              .faces = {},
              .color = {0.1f, 0.1f, 0.9f, 1.0f},
              .width = 12.0f,
              .seen_through = 0.4f}};
  const Image line = renderer().draw(p);
  EXPECT_GT(at(line, 180, 150).b - at(line, 180, 150).r, at(hidden, 180, 150).b - at(hidden, 180, 150).r + 20);
  EXPECT_NEAR(at(line, 180, 150).b, at(line, 200, 150).b, 3);
  p.lines.clear();

  // A ghost in front of a coloured body spoils nothing of it, and is seen beside it.
  Surface ghost = surface_of(large);
  ghost.pose[3] = glm::dvec4(0, 0, 1, 1);
  ghost.opacity = 0.4f;
  ghost.behind = true;
  p.surfaces = {body, ghost};
  const Image beside = renderer().draw(p);
  for (int x = 155; x < 245; x += 10) EXPECT_EQ(at(beside, x, 150), at(hidden, x, 150));
  EXPECT_LT(at(beside, 120, 150).r, 250);
}

// A hollow box cut through its middle: the near wall is gone, walls are capped, the cavity is open.
TEST(Draw, CutsOpenSolids) {
  Shape box = make_box({1, 1, 1});
  const Shape hollow = make_box({0.6, 0.6, 0.6});
  // The cavity's walls face inwards.
  Shape cavity = hollow;
  for (glm::uvec3& t : cavity.triangles) std::swap(t.y, t.z);
  for (glm::vec3& n : cavity.normals) n = -n;
  box.append(cavity);
  Picture p = front_view();
  Surface s = surface_of(box);
  s.cut = true;
  s.material.color = {0.8f, 0.3f, 0.2f};
  p.surfaces = {s};
  const Image whole = renderer().draw(p);
  p.cut = Cut{{0, 0, 0}, {0, 0, 1}};
  const Image cut = renderer().draw(p);
  EXPECT_EQ(at(whole, 155, 150), at(whole, 200, 150));
  // Wall: a cap with stripes; cavity: its far side, as lit as the front was.
  int dark = 0, light = 0;
  int brightest = 0;
  for (int y = 110; y < 190; ++y) brightest = std::max(brightest, at(cut, 156, y).r);
  for (int y = 110; y < 190; ++y) (at(cut, 156, y).r < brightest - 25 ? dark : light) += 1;
  EXPECT_GT(dark, 8);
  EXPECT_GT(light, 40);
  EXPECT_NEAR(at(cut, 200, 150).r, at(whole, 200, 150).r, 3);
  // Things that are not to be cut stay whole, and half of a box is half as deep.
  p.surfaces[0].cut = false;
  EXPECT_EQ(renderer().draw(p).pixels, whole.pixels);
  p.surfaces[0].cut = true;
  p.cut->normal = {1, 0, 0};
  const Image half = renderer().draw(p);
  EXPECT_EQ(at(half, 230, 150), glm::ivec3(255));
  EXPECT_NE(at(half, 170, 150), glm::ivec3(255));
}

// Values read back from the colours of a lit ball, by the place on the map of the nearest colour at any strength of light.
TEST(Draw, ColoursCanBeReadBackFromALitBody) {
  const Shape ball = make_ball(1.0, 96);
  std::vector<float> scalars;
  for (const glm::vec3& q : ball.positions) scalars.push_back(0.5f + 0.5f * std::sin(2.5f * q.x + 1.5f * q.y));
  Picture p = front_view();
  p.lighting.studio = true;
  p.camera.height = 2.2;
  p.look.shadows = true;
  Surface s = surface_of(ball);
  s.scalars = scalars;
  s.material.metallic = 0.65f;  // of no account where values are shown
  p.surfaces = {s};
  const auto linear = [](double byte) {
    const double v = byte / 255.0;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  for (const Colormap map :
       {Colormap::viridis, Colormap::cividis, Colormap::inferno, Colormap::turbo, Colormap::coolwarm, Colormap::greys}) {
    p.scalar_map = {map, 0.0, 1.0};
    p.scalar_map.lightened = true;
    const Image image = renderer().draw(p);
    const Image16 values = renderer().draw_scalar(p);
    std::vector<glm::dvec3> table;
    for (int i = 0; i <= 500; ++i) {
      const glm::vec3 c = map_color(p.scalar_map, i / 500.0);
      table.emplace_back(linear(255.0 * double(c.r)), linear(255.0 * double(c.g)), linear(255.0 * double(c.b)));
    }
    double worst = 0.0;
    int seen = 0, beyond = 0;
    for (int y = 5; y < 295; y += 3)
      for (int x = 5; x < 395; x += 3) {
        if (std::hypot(x - 199.5, y - 149.5) > 130.0) continue;
        const glm::ivec3 c = at(image, x, y);
        const glm::dvec3 shown(linear(c.r), linear(c.g), linear(c.b));
        double best = 1e300;
        int found = 0;
        for (int i = 0; i <= 500; ++i) {
          // Greys have no hue: their lightness is the value, and they are drawn without light; those of cividis are alike, and get little.
          const double share = map == Colormap::greys ? 0.0 : map == Colormap::cividis ? 0.09 : 0.42;
          const double strength =
              std::clamp(glm::dot(shown, table[i]) / glm::dot(table[i], table[i]), 1.0 - 0.54 * share, 1.0 + 0.40 * share);
          const glm::dvec3 off = (shown - strength * table[i]) / (strength * glm::length(table[i]));
          if (glm::dot(off, off) < best) best = glm::dot(off, off), found = i;
        }
        const double error = std::abs(found / 500.0 - values.pixels[std::size_t(y) * 400 + x] / 65534.0);
        worst = std::max(worst, error);
        ++seen;
        beyond += error > 0.03;
      }
    EXPECT_GT(seen, 4000);
    EXPECT_EQ(beyond, 0) << colormap_names()[static_cast<std::size_t>(map)] << ": off by up to " << worst;
  }
}

TEST(Draw, DepthAndScalarPicturesAreNumbers) {
  const std::vector<glm::vec3> positions = {{-1, -1, -1}, {1, -1, -1}, {1, 1, 1}, {-1, 1, 1}};
  const std::vector<glm::uvec3> triangles = {{0, 1, 2}, {0, 2, 3}};
  const std::vector<float> scalars = {0.0f, 1.0f, 1.0f, 0.0f};
  for (const Projection projection : {Projection::orthographic, Projection::perspective}) {
    Picture p = front_view();
    p.camera.projection = projection;
    Surface s;
    s.positions = positions;
    s.triangles = triangles;
    s.scalars = scalars;
    p.surfaces = {s};
    p.scalar_map.upper = 2.0;
    double near = 0.0, far = 0.0;
    const Image16 depth = renderer().draw_depth(p, &near, &far), scalar = renderer().draw_scalar(p);
    // The middle pixel looks at the origin, 5 m away, half a pixel off.
    const std::size_t middle = std::size_t(150) * 400 + 200;
    const double distance = near + (far - near) * depth.pixels[middle] / 65534.0;
    EXPECT_NEAR(distance, 5.0, 0.02);
    EXPECT_NEAR(scalar.pixels[middle] / 65534.0 * 2.0, 0.5, 0.01);
    EXPECT_EQ(depth.pixels[0], 65535);
    EXPECT_EQ(scalar.pixels[0], 65535);
    // Nearer at the top, where the square leans towards the camera.
    EXPECT_LT(depth.pixels[std::size_t(90) * 400 + 200], depth.pixels[std::size_t(210) * 400 + 200]);
  }
}

TEST(Draw, ColoursOfScalarsAreThoseOfTheBar) {
  Picture p = front_view();
  const Shape ball = make_ball(1.0, 48);
  for (const double t : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const std::vector<float> scalars(ball.positions.size(), static_cast<float>(t));
    Surface s = surface_of(ball);
    s.scalars = scalars;
    p.surfaces = {s};
    const Image image = renderer().draw(p);
    const glm::vec3 expected = 255.0f * colormap_color(p.scalar_map.colormap, t);
    const glm::vec3 drawn(at(image, 200, 150));
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(drawn[k], expected[k], 36.0f) << t << " channel " << k;
  }
}

TEST(Draw, GhostIsOneShellInAnyOrder) {
  // Two intersecting ghosts and a solid between, in both orders: the same pixels; and the far side of a ghost adds nothing.
  const Shape ball = make_ball(0.6, 32), box = make_box({1.4, 0.3, 0.9});
  Picture p = front_view();
  Surface a = surface_of(ball), b = surface_of(box), solid = surface_of(make_box({0, 0, 0}));
  const Shape rod = make_cylinder(0.1, 2.0);
  solid = surface_of(rod);
  a.opacity = 0.5f;
  b.opacity = 0.3f;
  b.material.color = {0.9f, 0.2f, 0.1f};
  p.surfaces = {solid, a, b};
  const Image first = renderer().draw(p);
  p.surfaces = {b, solid, a};
  const Image second = renderer().draw(p);
  EXPECT_TRUE(compare_images(first, second, {.exact = true}).passes);

  Picture q = front_view();
  q.surfaces = {a};
  q.surfaces[0].two_sided = true;
  const Image both_sides = renderer().draw(q);
  q.surfaces[0].two_sided = false;
  EXPECT_EQ(both_sides, renderer().draw(q));
  // Clearly there, clearly not solid.
  const int ghost = at(both_sides, 200, 150).g;
  q.surfaces[0].opacity = 1.0f;
  const int opaque = at(renderer().draw(q), 200, 150).g;
  EXPECT_GT(ghost, opaque + 15);
  EXPECT_LT(ghost, 245);
}

TEST(Draw, TransparentBackgroundHasAlphaOnlyWhereSomethingIs) {
  Picture p = front_view();
  const Shape ball = make_ball(0.6, 32);
  p.surfaces = {surface_of(ball)};
  p.background.transparent = true;
  const Image image = renderer().draw(p);
  ASSERT_EQ(image.channels, 4);
  EXPECT_EQ(image.pixels[3], 0);
  EXPECT_EQ(image.pixels[(std::size_t(150) * 400 + 200) * 4 + 3], 255);
  // Over white it is what the white background gives.
  p.background.transparent = false;
  const Image white = renderer().draw(p);
  EXPECT_EQ(at(image, 200, 150), at(white, 200, 150));
}

TEST(Draw, FarFromTheOriginNothingTrembles) {
  const Shape box = make_box({1, 1, 1});
  Picture p = front_view();
  p.surfaces = {surface_of(box)};
  const Image here = renderer().draw(p);
  const glm::dvec3 far(1e6, -2e6, 3e6);
  p.surfaces[0].pose[3] = glm::dvec4(far, 1.0);
  p.camera.position += far;
  p.camera.target += far;
  const Image there = renderer().draw(p);
  EXPECT_TRUE(compare_images(here, there, {.measures = false}).passes);
}

TEST(Draw, ShadowsFallOnGroundAndBodies) {
  Picture p;
  p.size = {320, 240};
  const Shape ball = make_ball(0.3, 32), plate = make_box({2, 0.1, 2});
  Surface low = surface_of(plate);
  low.pose[3] = glm::dvec4(0, -0.6, 0, 1);
  p.surfaces = {surface_of(ball), low};
  p.camera.position = {0, 2.5, 4};
  p.lighting.direction = glm::vec3(0, 1, 0.001f);
  p.look = {.samples = 4, .shadows = false, .occlusion = false};
  const Image without = renderer().draw(p);
  p.look.shadows = true;
  const Image with = renderer().draw(p);
  int darker = 0, brighter = 0;
  for (std::size_t i = 0; i < with.pixels.size(); i += 3) {
    darker += with.pixels[i] + 15 < without.pixels[i];
    brighter += with.pixels[i] > without.pixels[i] + 2;
  }
  EXPECT_GT(darker, 300);
  EXPECT_EQ(brighter, 0);
}

// Fine meshes are lit after all is drawn, others as they are drawn: the same picture but for the roundings of what is kept.
TEST(Draw, LitLaterOrAtOnceLooksTheSame) {
  for (const bool orthographic : {false, true}) {
    Zoo zoo;
    Picture& p = zoo.picture;
    std::vector<glm::vec3> colors(zoo.ball.positions.size(), glm::vec3(0.2f, 0.5f, 0.3f));
    p.surfaces.push_back(p.surfaces[0]);
    p.surfaces[5].colors = colors;
    p.surfaces[5].material = {{1, 1, 1}, 0.2f, 0.7f};
    p.surfaces[5].pose[3] = glm::dvec4(-1.0, 0.5, -0.4, 1.0);
    p.surfaces.push_back(p.surfaces[1]);
    p.surfaces[6].edges = false;
    p.surfaces[6].normals = {};
    p.surfaces[6].two_sided = true;
    p.surfaces[6].material.color = {0.9f, 0.8f, 0.2f};
    p.surfaces[6].pose[3] = glm::dvec4(-0.9, -0.2, -0.9, 1.0);
    p.scalar_map.levels = 5;
    if (orthographic) {
      p.camera.projection = Projection::orthographic;
      p.camera.height = 3.0;
    }
    p.bounds.add(glm::dvec3(-1.5, -1, -1));
    p.bounds.add(glm::dvec3(1.5, 1.2, 1));
    Renderer opengl(Backend::osmesa, Solids::opengl);
    const Image at_once = opengl.draw(p);
    // A fine mesh inside the first ball.
    const Shape fine = make_ball(0.1, 120);
    ASSERT_GT(fine.triangles.size(), 20000u);
    Surface hidden = surface_of(fine);
    hidden.casts_shadow = false;
    p.surfaces.push_back(hidden);
    const ImageDifference difference = compare_images(at_once, opengl.draw(p), {.measures = false});
    EXPECT_LE(difference.largest, 3);
    EXPECT_LT(difference.mean, 0.2);
    EXPECT_GT(difference.mean, 0.0);
  }
}

TEST(Draw, SameBitsAgainAndForAnotherContext) {
  const Zoo zoo;
  const Image first = renderer().draw(zoo.picture);
  renderer().draw(front_view());  // something else in between
  EXPECT_EQ(renderer().draw(zoo.picture), first);
  Renderer other;
  EXPECT_EQ(other.draw(zoo.picture), first);
}

TEST(Draw, SameBitsForAnyNumberOfThreads) {
  const Zoo zoo;
  const Image here = renderer().draw(zoo.picture);
  const auto file = std::filesystem::temp_directory_path() / ("flexframe_threads_" + std::to_string(::getpid()) + ".png");
  // Threads are chosen when the driver is first used, so each count needs a fresh program: this one, started again.
  for (const char* threads : {"0", "1", "2", "5"}) {
    const std::string command = std::string("LP_NUM_THREADS=") + threads + " FLEXFRAME_TEST_PICTURE=" + file.string() + " /proc/" +
                                std::to_string(::getpid()) + "/exe --gtest_filter=Draw.WritesThePictureAskedFor >/dev/null 2>&1";
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
    EXPECT_EQ(read_png(file), here) << threads << " threads";
    std::filesystem::remove(file);
  }
}

// The other half of the test above; alone it draws the zoo and finds it not empty.
TEST(Draw, WritesThePictureAskedFor) {
  const Zoo zoo;
  const Image image = renderer().draw(zoo.picture);
  EXPECT_NE(*std::max_element(image.pixels.begin(), image.pixels.end()), *std::min_element(image.pixels.begin(), image.pixels.end()));
  if (const char* file = std::getenv("FLEXFRAME_TEST_PICTURE")) write_png(file, image);
}

TEST(Draw, OsMesaAndEglDrawTheSameBits) {
  // EGL is optional: a machine without it, or with a GPU behind it, has no second software renderer to compare with. tests/run.sh
  // counts the skip as a failure, so that it cannot pass unseen.
  std::unique_ptr<Renderer> egl;
  try {
    egl = std::make_unique<Renderer>(Backend::egl);
  } catch (const std::runtime_error& e) {
    GTEST_SKIP() << "no EGL here: " << e.what();
  }
  const Zoo zoo;
  if (egl->info().renderer != renderer().info().renderer) GTEST_SKIP() << "EGL is another renderer: " << egl->info().renderer;
  EXPECT_EQ(egl->draw(zoo.picture), renderer().draw(zoo.picture));
}

TEST(Draw, WrongPicturesAreRefusedWithTheirReason) {
  const Shape ball = make_ball(0.5, 8);
  const auto message = [&](auto&& change) {
    Picture p = front_view();
    p.surfaces = {surface_of(ball)};
    change(p);
    try {
      renderer().draw(p);
    } catch (const flexframe::ArgumentError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const auto has = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  EXPECT_EQ(message([](Picture&) {}), "");
  EXPECT_TRUE(has(message([](Picture& p) { p.size.width = 8; }), "16 to 16384"));
  EXPECT_TRUE(has(message([](Picture& p) { p.look.samples = 3; }), "1, 4, 9 and 16"));
  const std::vector<glm::uvec3> wrong = {{0, 1, 100000}};
  EXPECT_TRUE(has(message([&](Picture& p) { p.surfaces[0].triangles = wrong; }), "100000"));
  std::vector<glm::vec3> broken = ball.positions;
  broken[7].y = NAN;
  EXPECT_TRUE(has(message([&](Picture& p) { p.surfaces[0].positions = broken; }), "position 7"));
  const std::vector<float> few(3, 0.0f);
  EXPECT_TRUE(has(message([&](Picture& p) { p.surfaces[0].scalars = few; }), "3 scalars"));
  EXPECT_TRUE(has(message([](Picture& p) { p.camera.target = p.camera.position; }), "coincide"));
  EXPECT_TRUE(has(message([](Picture& p) { p.camera.height = 0.0; }), "positive"));
}

TEST(Draw, BackendsHaveNames) {
  EXPECT_THROW(backend_from_name("vulkan"), flexframe::ArgumentError);
  EXPECT_EQ(backend_from_name("egl"), Backend::egl);
}

// Two squares in one plane, turned a little against each other and against the picture: without layers rounding decides.
TEST(Draw, LayersKeepSurfacesInOnePlaneFromFlickering) {
  const Shape plate = make_box({1.6, 1.6, 0.1});
  for (int turn = 0; turn < 6; ++turn) {
    Picture p = front_view();
    p.camera.projection = Projection::perspective;
    p.camera.position = {0.7, 0.9, 4.0};
    Surface under = surface_of(plate), over = surface_of(plate);
    under.material.color = {0.9f, 0.1f, 0.1f};
    over.material.color = {0.1f, 0.1f, 0.9f};
    over.layer = 1;
    over.pose = glm::rotate(glm::dmat4(1.0), 0.1 + 0.07 * turn, glm::dvec3(0, 0, 1));
    // Drawn in either order.
    p.surfaces = turn % 2 ? std::vector<Surface>{under, over} : std::vector<Surface>{over, under};
    const Image image = renderer().draw(p);
    int red = 0;
    for (int y = 120; y < 180; ++y)
      for (int x = 160; x < 240; ++x) red += at(image, x, y).r > at(image, x, y).b;
    EXPECT_EQ(red, 0) << "turn " << turn;
  }
}

TEST(Draw, LinesOfFacesThatLookAwayAreLeftOut) {
  Picture p = front_view();
  Lines line{.points = {{-1, 0.5, 0}, {1, 0.5, 0}, {-1, -0.5, 0}, {1, -0.5, 0}}, .colors = {}, .faces = {}};
  line.strip = false;
  line.color = {0, 0, 0, 1};
  line.width = 6.0f;
  line.faces = {{0, 0.1, -1}, {0, 0, -1}, {0, 0, -1}, {0, 1, 0.1}};
  p.lines = {line};
  const Image image = renderer().draw(p);
  EXPECT_GT(at(image, 200, 100).r, 250);  // both faces look away
  EXPECT_LT(at(image, 200, 200).r, 20);   // one is seen
}

// The drawing library's threads do not live in a fork: an error at once, where it used to wait for them.
TEST(Draw, AForkAfterTheFirstRendererSaysSo) {
  renderer();
  ASSERT_EQ(std::getenv("LP_NUM_THREADS"), nullptr);
  for (const bool fresh : {false, true}) {
    const pid_t child = ::fork();
    if (child == 0) {
      ::alarm(20);
      try {
        if (fresh) Renderer().draw(front_view());
        else renderer().draw(front_view());
      } catch (const DrawError& e) {
        ::_exit(std::string(e.what()).find("fork") != std::string::npos ? 7 : 1);
      }
      ::_exit(2);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 7);
  }
}

}  // namespace
}  // namespace flexframe::render::test_draw
