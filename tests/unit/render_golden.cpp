// Golden pictures of what the renderer draws, one a feature.
#include "golden.h"

#include "render/frame/camera.h"
#include "render/picture/edges.h"
#include "tests/unit/render_solids.h"

#include <glm/gtc/matrix_transform.hpp>

namespace flexframe::render::test_golden {
namespace {

Renderer& renderer() {
  static Renderer r;
  return r;
}

// A box, a ball and a bent tube on a ground, seen from three quarters.
struct Still {
  Shape box = make_box({1.0, 0.6, 0.8}), ball = make_ball(0.4, 24), tube;
  std::vector<float> scalars;
  Picture picture;
  Still() {
    const std::vector<glm::dvec3> path = {{-1.3, 0.0, 0.5}, {-0.6, 0.35, 0.6}, {0.4, 0.45, 0.7}, {1.3, 0.1, 0.5}};
    tube = make_tube(path, 0.1, 24);
    for (const glm::vec3& p : tube.positions) scalars.push_back(p.x);
    picture.size = {200, 140};
    picture.look = plain_look();
    picture.surfaces = {solid(box, {-0.5, 0.0, -0.3}), solid(ball, {0.7, -0.05, -0.2}), solid(tube, {0, 0, 0})};
    picture.surfaces[2].scalars = scalars;
    picture.surfaces[1].material.color = {0.85f, 0.45f, 0.2f};
    picture.scalar_map = {Colormap::viridis, -1.3, 1.3, 0};
    frame();
  }
  static Surface solid(const Shape& shape, const glm::dvec3& at) {
    Surface s;
    s.positions = shape.positions;
    s.normals = shape.normals;
    s.triangles = shape.triangles;
    s.two_sided = false;
    s.pose[3] = glm::dvec4(at, 1.0);
    return s;
  }
  std::vector<glm::dvec3> corners() const {
    std::vector<glm::dvec3> points;
    append_corners(points, {glm::dvec3(-1.4, -0.45, -0.7), glm::dvec3(1.4, 0.6, 0.8)});
    return points;
  }
  void frame() {
    FitOptions fit = default_view(corners(), glm::dvec3(0, -1, 0));
    fit.direction = glm::normalize(glm::dvec3(-0.35, -0.5, -0.8));
    picture.camera = fit_camera(picture, corners(), fit);
  }
  void expect(const std::string& name) const { test::expect_golden(renderer().draw(picture), renderer().info(), name); }
};

TEST(Golden, Plain) { Still().expect("plain"); }

TEST(Golden, FlatShading) {
  Still s;
  for (Surface& surface : s.picture.surfaces) surface.normals = {};
  s.expect("flat");
}

TEST(Golden, GroundAndShadows) {
  Still s;
  s.picture.ground = default_ground(s.corners(), {0, 1, 0});
  s.picture.look.shadows = true;
  s.expect("shadows");
}

TEST(Golden, Occlusion) {
  Still s;
  s.picture.ground = default_ground(s.corners(), {0, 1, 0});
  s.picture.look.occlusion = true;
  s.expect("occlusion");
}

// More than 20 000 triangles are lit after all is drawn.
TEST(Golden, FineMeshesWithShadows) {
  Still s;
  s.ball = make_ball(0.4, 120);
  s.picture.surfaces[1].positions = s.ball.positions;
  s.picture.surfaces[1].normals = s.ball.normals;
  s.picture.surfaces[1].triangles = s.ball.triangles;
  s.picture.surfaces[1].material.roughness = 0.15f;
  s.picture.surfaces[0].material.metallic = 1.0f;
  s.picture.ground = default_ground(s.corners(), {0, 1, 0});
  s.picture.look = {};
  s.expect("fine");
}

// 16 bits as two bytes: red the upper, green the lower.
TEST(Golden, DepthAndScalarNumbers) {
  Still s;
  for (const bool depth : {true, false}) {
    const Image16 numbers = depth ? renderer().draw_depth(s.picture) : renderer().draw_scalar(s.picture);
    Image image = make_image(numbers.width, numbers.height, 3);
    for (std::size_t i = 0; i < numbers.pixels.size(); ++i) {
      image.pixels[3 * i] = static_cast<std::uint8_t>(numbers.pixels[i] >> 8);
      image.pixels[3 * i + 1] = static_cast<std::uint8_t>(numbers.pixels[i] & 255);
    }
    test::expect_golden(image, renderer().info(), depth ? "numbers_depth" : "numbers_scalar");
  }
}

TEST(Golden, GhostsThatIntersect) {
  Still s;
  s.picture.surfaces[0].opacity = 0.4f;
  s.picture.surfaces[1].opacity = 0.5f;
  s.picture.surfaces[1].pose[3] = glm::dvec4(-0.1, 0.1, 0.1, 1.0);
  s.expect("ghosts");
}

TEST(Golden, EdgesAndSilhouettes) {
  Still s;
  s.picture.surfaces[0].edges = true;
  s.picture.surfaces[1].silhouette = s.picture.surfaces[2].silhouette = true;
  s.expect("edges");
}

// The displaced box and ball as wire meshes over the solids; creases of the box alone.
TEST(Golden, WiresOverSolids) {
  Still s;
  s.picture.surfaces[0].edges = true;
  const auto creases = compute_feature_edges(s.box.positions, s.box.triangles);
  s.picture.surfaces[0].edge_flags = creases;
  for (const std::size_t k : {0, 1}) {
    Surface wires = s.picture.surfaces[k];
    wires.wires = true;
    wires.edge_flags = {};
    wires.edge_color = {0.13f, 0.33f, 0.8f};
    wires.pose[3] += glm::dvec4(0.1, 0.15, 0.1, 0.0);
    s.picture.surfaces.push_back(wires);
  }
  s.expect("wires");
}

TEST(Golden, Orthographic) {
  Still s;
  FitOptions fit = default_view(s.corners(), glm::dvec3(0, -1, 0));
  fit.direction = glm::normalize(glm::dvec3(-0.35, -0.5, -0.8));
  fit.projection = Projection::orthographic;
  s.picture.ground = default_ground(s.corners(), glm::dvec3(0, 1, 0));
  s.picture.look = {};
  s.picture.camera = fit_camera(s.picture, s.corners(), fit);
  s.expect("orthographic");
}

TEST(Golden, Colormaps) {
  const std::vector<std::string_view> names = colormap_names();
  for (std::size_t k = 0; k < names.size(); ++k) {
    Still s;
    s.picture.size = {100, 70};
    s.frame();
    s.picture.scalar_map.colormap = static_cast<Colormap>(k);
    s.expect("colormap_" + std::string(names[k]));
  }
}

TEST(Golden, BandsAndVertexColours) {
  Still s;
  s.picture.scalar_map.levels = 6;
  std::vector<glm::vec3> colors;
  for (const glm::vec3& p : s.ball.positions) colors.push_back(glm::vec3(0.5f) + p);
  s.picture.surfaces[1].colors = colors;
  s.expect("bands");
}

TEST(Golden, Materials) {
  Still s;
  s.picture.surfaces[0].material = {{0.9f, 0.75f, 0.35f}, 0.25f, 1.0f};
  s.picture.surfaces[1].material = {{0.2f, 0.4f, 0.8f}, 0.1f, 0.0f};
  s.expect("materials");
}

TEST(Golden, SymbolsArrowsTriads) {
  Still s;
  s.picture.lines.push_back({.points = {{-1.2, 0.5, 0.7}, {0, 0.7, 0.7}, {1.2, 0.3, 0.7}}, .colors = {}, .faces = {}, .width = 4.0f});
  int at = 0;
  for (const MarkerShape shape : {MarkerShape::sphere, MarkerShape::disc, MarkerShape::ring, MarkerShape::square, MarkerShape::cross})
    s.picture.markers.push_back({.points = {{-1.0f + 0.5f * static_cast<float>(at++), -0.3f, 0.8f}}, .shape = shape, .diameter = 60.0f});
  s.picture.arrows.push_back({{-0.5, 0.3, -0.3}, {-0.5, 0.9, -0.3}});
  s.picture.triads.push_back({glm::translate(glm::dmat4(1.0), glm::dvec3(0.7, 0.4, 0.0)), 0.4});
  s.picture.labels.push_back({{0.7, 0.35, 0.0}, "ball"});
  s.expect("symbols");
}

TEST(Golden, OrthographicOnTransparency) {
  Still s;
  s.picture.background.transparent = true;
  FitOptions fit;
  fit.projection = Projection::orthographic;
  s.picture.camera = fit_camera(s.picture, s.corners(), fit);
  s.expect("transparent");
}

TEST(Golden, FourViews) {
  Still s;
  s.picture.ground = default_ground(s.corners(), {0, 1, 0});
  s.picture.overlay.triad = true;
  static constexpr ViewKind all[] = {ViewKind::front, ViewKind::side, ViewKind::top, ViewKind::iso};
  s.picture.views = make_views(s.picture, s.corners(), {0, 1, 0}, all);
  s.expect("views");
}

TEST(Golden, OverlayBelowAndBesideLightAndDark) {
  static const std::vector<double> x = {0, 0.25, 0.5, 0.75, 1}, y = {0, 0.8, -0.2, 0.5, 0.1};
  for (const bool dark : {false, true}) {
    Still s;
    s.picture.size = {400, 280};
    Overlay& o = s.picture.overlay;
    o.title = "Still life";
    o.time = "t = 0.400 s";
    o.note = "solid: in scale; ghost: elastic displacement × 20";
    o.scalar_bar = ScalarBar{"x", "mm", 1000.0};
    o.triad = true;
    o.legend = {{"box", {0.66f, 0.69f, 0.73f}, 1.0f}, {"ball", {0.85f, 0.45f, 0.2f}, 0.4f}};
    o.plots.push_back({"t [s]", "tip.y [mm]", {{"tip.y", x, y, glm::vec3(-1.0f)}}, 0.4, {}, {}});
    o.plot_place = dark ? PlotPlace::beside : PlotPlace::below;
    o.dark = dark;
    if (dark) s.picture.background = {{0.13f, 0.15f, 0.19f}, {0.05f, 0.06f, 0.08f}, false};
    s.picture.ground = default_ground(s.corners(), {0, 1, 0});
    s.frame();
    s.expect(dark ? "overlay_dark" : "overlay");
    // The panel kept from the first picture is that of a fresh one.
    s.picture.overlay.plots[0].mark = 0.7;
    Renderer fresh;
    EXPECT_EQ(renderer().draw(s.picture), fresh.draw(s.picture));
  }
}

}  // namespace
}  // namespace flexframe::render::test_golden
