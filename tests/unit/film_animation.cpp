#include "film_swing.h"

#include "render/film/animation.h"
#include "render/film/overlay.h"
#include "render/film/survey.h"
#include "render/frame/camera.h"
#include "render/picture/colormap.h"
#include "scratch.h"
#include "sim/scene/scene_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <string>

namespace test_animation {
namespace {

using namespace flexframe;

film::RenderSettings small_settings() {
  film::RenderSettings s;
  s.size = {160, 90};
  s.frame_rate = 20;
  s.speed = 1;
  s.scales = {1, 5};
  return s;
}

glm::dvec3 posed(const render::Surface& s, size_t i) { return glm::dvec3(s.pose * glm::dvec4(glm::dvec3(s.positions[i]), 1.0)); }

TEST(Motion, SamplesAreTakenBitForBitAndBetweenThemMotionIsEven) {
  const sim::Results r = test::swinging_beam();
  EXPECT_EQ(film::find_sample(r.times, r.times[7]).index, 7);
  EXPECT_EQ(film::find_sample(r.times, r.times[7]).share, 0.0);
  EXPECT_EQ(film::find_sample(r.times, r.times[7] + 1e-13).share, 0.0);
  EXPECT_EQ(film::find_sample(r.times, -1.0).index, 0);
  EXPECT_EQ(film::find_sample(r.times, 99.0).index, 200);
  const film::SamplePlace half = film::find_sample(r.times, 0.5 * (r.times[7] + r.times[8]));
  EXPECT_EQ(half.index, 7);
  EXPECT_NEAR(half.share, 0.5, 1e-9);
  // Poses between samples stay rotations and lie within h^2/8 of the motion.
  const glm::dmat4 pose = film::body_pose(r.bodies[0], half);
  EXPECT_NEAR(glm::determinant(glm::dmat3(pose)), 1.0, 1e-14);
  const double t = 0.5 * (r.times[7] + r.times[8]);
  EXPECT_NEAR(std::atan2(pose[0].y, pose[0].x), 0.8 * std::sin(2.0 * t), 0.8 * 4.0 * 0.005 * 0.005 / 8.0);
}

TEST(Motion, PicturesReachTheEndDespiteRounding) {
  sim::VecX times(2);
  times << 0.0, 1.6;
  EXPECT_EQ(film::picture_count(times, 30, 1.0), 49);
  EXPECT_EQ(film::picture_count(times, 10, 0.1), 161);
  EXPECT_EQ(film::picture_time(times, 30, 1.0, 48), 1.6);
  times << 0.0, 0.7;
  EXPECT_EQ(film::picture_count(times, 10, 1.0), 8);
  times.resize(1);
  times << 2.0;
  EXPECT_EQ(film::picture_count(times, 30, 1.0), 1);
}

// The one material of a file's faces decides finish and opacity, not the reader's own that no face has; of several the most opaque.
TEST(Animation, MaterialsOfAFileAreThoseOfItsFaces) {
  const Scratch scratch;
  scratch.put("m.mtl", "newmtl glass\nKd 0.2 0.6 0.4\nd 0.3\nPm 1\nnewmtl milk\nKd 1 1 1\nd 0.6\nnewmtl unused\nd 0.9\n");
  const std::string corners = "mtllib m.mtl\nv 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nusemtl glass\nf 1 3 2\nf 1 2 4\n";
  const auto drawn = [&](const std::string& rest) {
    sim::Results r = test::swinging_beam();
    r.bodies[1].mesh = scratch.put("m.obj", corners + rest).string();
    return film::make_animation(r, small_settings(), nullptr);
  };
  const film::Animation one = drawn("f 2 3 4\nf 3 1 4\n");
  EXPECT_NEAR(one.bodies[1].opacity, 0.3, 1e-6);
  EXPECT_NEAR(one.bodies[1].material.metallic, 1.0, 1e-6);
  EXPECT_TRUE(fmt::format("{}", fmt::join(one.notes, " ")).find("opacity") == std::string::npos);
  const film::Animation two = drawn("usemtl milk\nf 2 3 4\nf 3 1 4\n");
  EXPECT_NEAR(two.bodies[1].opacity, 0.6, 1e-6);
  EXPECT_TRUE(fmt::format("{}", fmt::join(two.notes, " ")).find("the largest, 0.6") != std::string::npos);
}

// What no body has is said: a grey picture looks as if all were zero.
TEST(Animation, AColouringThatNoBodyHasIsAWarning) {
  const sim::Results r = test::swinging_beam();
  film::RenderSettings s = small_settings();
  s.color_by = film::ColorBy::mode;
  s.mode = 3;
  const film::Animation animation = film::make_animation(r, s, nullptr);
  EXPECT_FALSE(animation.scalar_bar);
  EXPECT_TRUE(fmt::format("{}", fmt::join(animation.warnings, " ")).find("elastic coordinate 3") != std::string::npos);
}

TEST(Animation, OnlyTheElasticDisplacementIsScaled) {
  const sim::Results r = test::swinging_beam();
  film::RenderSettings s = small_settings();
  s.scales = {1, 5, 0};
  const film::Animation animation = film::make_animation(r, s, nullptr);
  film::PictureMemory memory;
  film::update_picture(animation, 13, memory);
  // Beam at three scales, then the block.
  ASSERT_EQ(memory.picture.surfaces.size(), 4u);
  const auto& solid = memory.picture.surfaces[0];
  const auto& ghost = memory.picture.surfaces[1];
  const auto& rest = memory.picture.surfaces[2];
  double largest = 0.0;
  for (size_t i = 0; i < solid.positions.size(); ++i) {
    const glm::vec3 u = solid.positions[i] - rest.positions[i];
    largest = std::max(largest, double(glm::length(u)));
    EXPECT_LT(glm::length(ghost.positions[i] - rest.positions[i] - 5.0f * u), 2e-6f);
  }
  EXPECT_GT(largest, 1e-3);
  EXPECT_EQ(solid.pose, ghost.pose);
  EXPECT_LT(ghost.opacity, 1.0f);
  EXPECT_EQ(solid.opacity, 1.0f);
}

// Each body says how its exaggerated copies look; in scale it stays what it is.
TEST(Animation, GhostsAsTheBodySays) {
  const sim::Results r = test::swinging_beam(0.05);
  film::RenderSettings s = small_settings();
  s.scales = {1, 5};
  sim::Scene scene = sim::parse_scene(test::swinging_scene, "s.toml");
  const auto drawn = [&](std::map<std::string, std::string> words) {
    scene.bodies[0].drawing = std::move(words);
    const film::Animation animation = film::make_animation(r, s, &scene);
    film::PictureMemory memory;
    film::update_picture(animation, 13, memory);
    struct {
      size_t beams = 0;
      bool wires = false, solid_wires = false, colored = false;
      float opacity = 0.0f;
      std::string note, short_note;
      glm::vec3 edge, color;
    } out;
    for (const render::Surface& one : memory.picture.surfaces) {
      if (one.triangles.data() != animation.bodies[0].triangles.data()) continue;
      if (out.beams == 0) out.solid_wires = one.wires || one.scalars.empty();
      if (out.beams == 1)
        out.wires = one.wires, out.colored = !one.scalars.empty(), out.opacity = one.opacity, out.edge = one.edge_color,
        out.color = one.material.color;
      ++out.beams;
    }
    out.note = memory.picture.overlay.note;
    out.short_note = memory.picture.overlay.short_note;
    return out;
  };
  const auto plain = drawn({});
  EXPECT_TRUE(plain.beams == 2 && !plain.wires && plain.colored && plain.opacity < 1.0f) << plain.beams;
  EXPECT_NE(plain.note.find("; ghost: elastic displacement × 5"), std::string::npos) << plain.note;
  EXPECT_EQ(plain.short_note, "ghost: × 5");
  const auto grey = drawn({{"ghost_color", "#808080"}});
  EXPECT_TRUE(grey.beams == 2 && !grey.wires && !grey.colored && !grey.solid_wires);
  EXPECT_LT(glm::length(grey.color - glm::vec3(128.0f / 255.0f)), 1e-6f);
  const auto mesh = drawn({{"ghost", "mesh"}, {"ghost_color", "#0000ff"}});
  EXPECT_TRUE(mesh.beams == 2 && mesh.wires && !mesh.solid_wires);
  EXPECT_EQ(mesh.edge, glm::vec3(0, 0, 1));
  EXPECT_NE(mesh.note.find("; mesh: elastic displacement × 5"), std::string::npos) << mesh.note;
  const auto none = drawn({{"ghost", "none"}});
  EXPECT_TRUE(none.beams == 1 && none.note.find("× 5") == std::string::npos) << none.note;
}

TEST(Animation, BeamFollowsItsNodes) {
  const sim::Results r = test::swinging_beam(0.05);
  const film::Animation animation = film::make_animation(r, small_settings(), nullptr);
  film::PictureMemory memory;
  for (int k : {0, 4, 9, 20}) {
    film::update_picture(animation, k, memory);
    const auto& beam = memory.picture.surfaces[0];
    // The centre of the end cap, from its rim.
    glm::dvec3 centre(0.0);
    int count = 0;
    const auto& mesh = animation.bodies[0].mesh;
    std::vector<bool> seen(mesh.positions.size(), false);
    for (size_t p = 0; p < beam.positions.size(); ++p) {
      const int v = mesh.point_position[p];
      if (mesh.positions[v].x < 1.0 - 1e-12 || seen[v]) continue;
      seen[v] = true;
      centre += posed(beam, p);
      ++count;
    }
    centre /= count;
    const film::SamplePlace place = film::find_sample(r.times, film::picture_time(animation, k));
    const glm::dvec3 tip(r.bodies[1].position(place.index, 0), r.bodies[1].position(place.index, 1), 0.0);
    EXPECT_LT(glm::length(centre - tip), 1e-6) << k;
  }
}

TEST(Animation, APictureDependsOnItsNumberAlone) {
  const sim::Results r = test::swinging_beam();
  film::RenderSettings s = small_settings();
  s.trail = 2;
  s.overlay.plot = {"tip.y"};
  for (film::ColorBy by :
       {film::ColorBy::displacement, film::ColorBy::strain, film::ColorBy::velocity, film::ColorBy::body, film::ColorBy::none}) {
    s.color_by = by;
    const film::Animation animation = film::make_animation(r, s, nullptr);
    film::PictureMemory used, fresh;
    for (int k : {20, 3, 11, 7}) film::update_picture(animation, k, used);
    film::update_picture(animation, 7, fresh);
    EXPECT_EQ(film::picture_hash(used.picture, "x"), film::picture_hash(fresh.picture, "x"));
    film::update_picture(animation, 8, fresh);
    EXPECT_NE(film::picture_hash(used.picture, "x"), film::picture_hash(fresh.picture, "x"));
    film::update_picture(animation, 7, fresh);
    EXPECT_NE(film::picture_hash(used.picture, "x"), film::picture_hash(fresh.picture, "another renderer"));
  }
}

TEST(Animation, NothingLeavesThePicture) {
  const sim::Results r = test::swinging_beam(0.02);
  for (bool orthographic : {false, true}) {
    film::RenderSettings s = small_settings();
    s.scales = {1, 20};
    s.camera.projection = orthographic ? render::Projection::orthographic : render::Projection::perspective;
    const film::Animation animation = film::make_animation(r, s, nullptr);
    const glm::dmat4 view = render::view_matrix(animation.camera);
    film::PictureMemory memory;
    double reach = 0.0;
    for (int k = 0; k < animation.count; ++k) {
      film::update_picture(animation, k, memory);
      for (const render::Surface& surface : memory.picture.surfaces)
        for (size_t i = 0; i < surface.positions.size(); ++i) {
          const glm::dvec3 p(view * glm::dvec4(posed(surface, i), 1.0));
          ASSERT_LT(p.z, 0.0);
          const double half = orthographic ? 0.5 * animation.camera.height : -p.z * std::tan(glm::radians(0.5 * animation.camera.fov));
          reach = std::max({reach, std::abs(p.y) / half, std::abs(p.x) / half * 90.0 / 160.0});
        }
    }
    EXPECT_LT(reach, 1.0);
    EXPECT_GT(reach, 0.6);
  }
}

TEST(Animation, UnitsAreThoseThatReadBest) {
  using Unit = std::pair<std::string, double>;
  EXPECT_EQ(film::readable_unit("m", 2.0), Unit("m", 1.0));
  EXPECT_EQ(film::readable_unit("m", 0.2), Unit("mm", 1e3));
  EXPECT_EQ(film::readable_unit("m", 3e-8), Unit("nm", 1e9));
  EXPECT_EQ(film::readable_unit("Pa", 1.5e8), Unit("MPa", 1e-6));
  EXPECT_EQ(film::readable_unit("N m", 9000.0), Unit("N m", 1.0));
  EXPECT_EQ(film::readable_unit("N", 12000.0), Unit("kN", 1e-3));
  EXPECT_EQ(film::readable_unit("rad/s", 1e7), Unit("rad/s", 1.0));
  EXPECT_EQ(film::readable_unit("N", 0.0), Unit("N", 1.0));
  EXPECT_EQ(film::readable_unit("N", 2e-12), Unit("pN", 1e12));
}

TEST(Animation, ColourRangeIsTheLargestOfTheWholeSequence) {
  const sim::Results r = test::swinging_beam(0.01);
  const film::Animation animation = film::make_animation(r, small_settings(), nullptr);
  // Of the pictures, at 1/20 s: a sin(9 t) at the axis, and the rim, 0.02 m away, turns by twice that as it is.
  double tip = 0.0;
  for (int k = 0; k < animation.count; ++k) tip = std::max(tip, std::abs(0.01 * std::sin(9.0 * k / 20.0)));
  EXPECT_NEAR(animation.scalar_map.upper, std::hypot(tip + 0.02 * (1.0 - std::cos(2.0 * tip)), 0.02 * std::sin(2.0 * tip)), 1e-6);
  ASSERT_TRUE(animation.scalar_bar.has_value());
  EXPECT_EQ(animation.scalar_bar->unit, "mm");
  film::PictureMemory memory;
  float largest = 0.0f;
  for (int k = 0; k < animation.count; ++k) {
    film::update_picture(animation, k, memory);
    for (float s : memory.picture.surfaces[0].scalars) largest = std::max(largest, s);
  }
  EXPECT_FLOAT_EQ(largest, static_cast<float>(animation.scalar_map.upper));
}

TEST(Animation, StrainOfBendingIsCurvatureTimesHeight) {
  // u_y = a x^2: curvature 2 a, surface strain 2 a r, and the equivalent of a uniaxial state (e, -nu e = 0 for rigid sections) is e.
  const sim::Results r = test::swinging_beam(0.001);
  film::RenderSettings s = small_settings();
  s.color_by = film::ColorBy::strain;
  const film::Animation animation = film::make_animation(r, s, nullptr);
  EXPECT_NEAR(animation.scalar_map.upper, 2.0 * 0.001 * 0.02, 0.1 * 2.0 * 0.001 * 0.02);
}

// Modes are linear however far they turn: what they lengthen on the way, half the square of the turn, is no strain.
TEST(Animation, StrainOfAModalBodyGoesWithItsCoordinates) {
  const Scratch scratch;
  std::string obj;
  constexpr int nx = 40;
  for (int i = 0; i <= nx; ++i)
    for (const auto& [y, z] : {std::pair(-0.02, -0.02), std::pair(0.02, -0.02), std::pair(0.02, 0.02), std::pair(-0.02, 0.02)})
      obj += fmt::format("v {} {} {}\n", i / double(nx), y, z);
  for (int i = 0; i < nx; ++i)
    for (int k = 0; k < 4; ++k)
      obj += fmt::format("f {} {} {} {}\n", 4 * i + k + 1, 4 * i + (k + 1) % 4 + 1, 4 * i + (k + 1) % 4 + 5, 4 * i + k + 5);
  const auto strain = [&](double amplitude) {
    sim::Results r = test::swinging_beam(amplitude);
    test::make_modal(r);
    r.bodies[0].kind = "modal";
    r.bodies[0].mesh = scratch.put("bar.obj", obj).string();
    film::RenderSettings s = small_settings();
    s.color_by = film::ColorBy::strain;
    return film::make_animation(r, s, nullptr).scalar_map.upper;
  };
  // 3.2 a curvature at the root; a vertex at an edge has the mean of the faces beside it.
  const double small = strain(1e-4);
  EXPECT_GT(small, 0.5 * 3.2 * 1e-4 * 0.02);
  EXPECT_LT(small, 1.05 * 3.2 * 1e-4 * 0.02);
  // The moments that are looked at go by the places of the block, which the deflection moves.
  EXPECT_NEAR(strain(0.3), 3000.0 * small, 0.05 * 3000.0 * small);
}

// The ends of the bar say where values lie beyond them, on either side.
TEST(Animation, RangesSayWhatLiesBeyondThem) {
  const sim::Results r = test::swinging_beam(0.01);
  film::RenderSettings s = small_settings();
  const auto beyond = [&](double low, double high) {
    s.color_range = {low, high};
    const render::ScalarMap map = film::make_animation(r, s, nullptr).scalar_map;
    return std::pair(map.below.has_value(), map.above.has_value());
  };
  EXPECT_EQ(beyond(0.0, 0.02), std::pair(false, false));
  EXPECT_EQ(beyond(0.001, 0.02), std::pair(true, false));
  EXPECT_EQ(beyond(0.0, 0.005), std::pair(false, true));
  EXPECT_EQ(beyond(0.001, 0.005), std::pair(true, true));
}

// What is not drawn has no say in colours and scales.
TEST(Animation, HiddenBodiesDecideOnNoColours) {
  sim::Results r = test::swinging_beam(0.001);
  sim::ResultBody other = test::swinging_beam(0.1).bodies[0];
  other.name = "other";
  r.bodies.push_back(other);
  film::RenderSettings s = small_settings();
  s.scales.clear();
  sim::Scene scene = sim::parse_scene(test::swinging_scene, "s.toml");
  scene.bodies.push_back(scene.bodies[0]);
  scene.bodies.back().name = "other";
  const film::Animation both = film::make_animation(r, s, &scene);
  scene.bodies.back().drawing = {{"visible", "false"}};
  const film::Animation one = film::make_animation(r, s, &scene);
  EXPECT_GT(both.scalar_map.upper, 0.09);
  EXPECT_LT(one.scalar_map.upper, 0.002);
  EXPECT_GT(one.scales.back(), 10.0 * both.scales.back());
}

// A bar whose nodes know the stress of bending and of a pull that grows along it, s_xx = c (y + x / 10), and of a shear besides, s_xz = t:
// von Mises sqrt(s_xx^2 + 3 s_xz^2) at every vertex.
TEST(Animation, StressOfAModalBodyIsVonMisesOfItsStressModes) {
  const Scratch scratch;
  std::string obj;
  const int nx = 20;
  for (int i = 0; i <= nx; ++i)
    for (const auto& [y, z] : {std::pair(-0.05, -0.05), std::pair(0.05, -0.05), std::pair(0.05, 0.05), std::pair(-0.05, 0.05)})
      obj += fmt::format("v {} {} {}\n", i / double(nx), y, z);
  for (int i = 0; i < nx; ++i)
    for (int k = 0; k < 4; ++k)
      obj += fmt::format("f {} {} {} {}\n", 4 * i + k + 1, 4 * i + (k + 1) % 4 + 1, 4 * i + (k + 1) % 4 + 5, 4 * i + k + 5);
  obj += fmt::format("f 4 3 2 1\nf {} {} {} {}\n", 4 * nx + 1, 4 * nx + 2, 4 * nx + 3, 4 * nx + 4);
  sim::Results r = test::swinging_beam(0.001);
  sim::ResultBody& bar = r.bodies[0];
  const Eigen::Index nt = r.times.size();
  bar.kind = "modal";
  bar.mesh = scratch.put("bar.obj", obj).string();
  bar.nodes.clear();
  constexpr double slope = 2e9, twist = 3e7;
  for (int i = 0; i <= 4; ++i)
    for (const double y : {-0.05, 0.05})
      for (const double z : {-0.05, 0.05}) bar.nodes.push_back({fmt::format("n{}", bar.nodes.size()), {i / 4.0, y, z}});
  bar.nodes.push_back({"inside", {0.5, 0.0, 0.0}});  // an interface in the middle has no stress
  const auto nn = static_cast<Eigen::Index>(bar.nodes.size());
  bar.q = sim::MatX::Zero(nt, 2);
  for (Eigen::Index t = 0; t < nt; ++t) bar.q(t, 0) = bar.q(t, 1) = std::sin(0.3 * static_cast<double>(t));
  bar.qd = sim::MatX::Zero(nt, 2);
  bar.node_phi = sim::MatX::Zero(3 * nn, 2);
  bar.node_psi = sim::MatX::Zero(3 * nn, 2);
  bar.node_stress = sim::MatX::Zero(6 * (nn - 1), 2);
  for (Eigen::Index k = 0; k < nn; ++k) {
    const sim::Vec3 x = bar.nodes[k].origin;
    bar.node_phi(3 * k + 1, 0) = 1e-3 * x.x() * x.x();
    if (k + 1 == nn) break;
    bar.stress_nodes.push_back(static_cast<int>(k));
    bar.node_stress(6 * k, 0) = slope * (x.y() + 0.1 * x.x());
    bar.node_stress(6 * k + 5, 1) = twist;
  }
  bar.displacement = bar.q * bar.node_phi.transpose();
  bar.rotation.resize(0, 0);
  film::RenderSettings s = small_settings();
  s.color_by = film::ColorBy::stress;
  const film::Animation animation = film::make_animation(r, s, nullptr);
  ASSERT_TRUE(animation.bodies[0].stress.has_value());
  film::PictureMemory memory;
  double largest = 0.0;
  for (const int picture : {3, 11}) {
    film::update_picture(animation, picture, memory);
    std::vector<double> coordinates;
    film::elastic_coordinates(bar, film::find_sample(r.times, film::picture_time(animation, picture)), coordinates);
    const double q = coordinates[0];
    ASSERT_GT(std::abs(q), 0.05);
    const render::Mesh& mesh = animation.bodies[0].mesh;
    ASSERT_EQ(memory.picture.surfaces[0].scalars.size(), mesh.point_position.size());
    for (size_t p = 0; p < mesh.point_position.size(); ++p) {
      const glm::dvec3 x = mesh.positions[mesh.point_position[p]];
      // Linear over the bar, which the map from nodes to vertices follows exactly.
      EXPECT_NEAR(memory.picture.surfaces[0].scalars[p], std::abs(q) * std::hypot(slope * (x.y + 0.1 * x.x), std::sqrt(3.0) * twist),
                  1e-5 * slope * 0.15)
          << x.x << " " << x.y;
      largest = std::max(largest, double(memory.picture.surfaces[0].scalars[p]));
    }
  }
  EXPECT_GE(animation.scalar_map.upper, 0.999 * largest);

  // Other numbers of the same stress: Mohr's circle of s_xx and s_xz. With a yield stress they are shares of it.
  const auto circle = [&](film::StressMeasure measure, double normal, double shear) {
    const double half = 0.5 * normal, radius = std::hypot(half, shear);
    return measure == film::StressMeasure::tresca          ? 2.0 * radius
           : measure == film::StressMeasure::max_principal ? half + radius
                                                           : half - radius;
  };
  for (const auto measure : {film::StressMeasure::tresca, film::StressMeasure::max_principal, film::StressMeasure::min_principal})
    for (const double yield : {0.0, 5e7}) {
      s.stress = measure;
      s.yield_stress = yield;
      const film::Animation other = film::make_animation(r, s, nullptr);
      film::update_picture(other, 3, memory);
      std::vector<double> coordinates;
      film::elastic_coordinates(bar, film::find_sample(r.times, film::picture_time(other, 3)), coordinates);
      const render::Mesh& mesh = other.bodies[0].mesh;
      for (size_t p = 0; p < mesh.point_position.size(); ++p) {
        const glm::dvec3 x = mesh.positions[mesh.point_position[p]];
        const double wanted = circle(measure, coordinates[0] * slope * (x.y + 0.1 * x.x), coordinates[0] * twist);
        EXPECT_NEAR(memory.picture.surfaces[0].scalars[p] * (yield > 0.0 ? yield : 1.0), wanted, 2e-5 * slope * 0.15) << x.x << " " << x.y;
      }
      EXPECT_EQ(other.scalar_map.lower < 0.0, measure != film::StressMeasure::tresca);
      ASSERT_TRUE(other.scalar_bar.has_value());
      EXPECT_EQ(other.scalar_bar->unit == "%", yield > 0.0);
      EXPECT_EQ(fmt::format("{}", fmt::join(other.warnings, " ")).find("safety factor") != std::string::npos, yield > 0.0);
    }
  s.stress = film::StressMeasure::von_mises;
  s.yield_stress = 0.0;

  // Without stress modes it is said, not guessed.
  r.bodies[0].stress_nodes.clear();
  r.bodies[0].node_stress.resize(0, 0);
  const film::Animation plain = film::make_animation(r, s, nullptr);
  EXPECT_NE(fmt::format("{}", fmt::join(plain.notes, " ")).find("stress modes"), std::string::npos);
}

// Where leaving nodes out tells nothing, that is told: a body of modes whose two nodes say nothing of the bend between them.
TEST(Animation, ModesOfTooFewNodesAreToldOf) {
  const Scratch scratch;
  sim::Results r = test::swinging_beam(0.001);
  sim::ResultBody& bar = r.bodies[0];
  const Eigen::Index nt = r.times.size();
  bar.kind = "modal";
  bar.mesh = scratch.put("plate.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n").string();
  bar.nodes.clear();
  bar.nodes.push_back({"a", {0.0, 0.0, 0.0}});
  bar.nodes.push_back({"b", {1.0, 1.0, 0.0}});
  bar.q = sim::MatX::Zero(nt, 1);
  for (Eigen::Index t = 0; t < nt; ++t) bar.q(t, 0) = std::sin(0.3 * static_cast<double>(t));
  bar.qd = sim::MatX::Zero(nt, 1);
  bar.node_phi = sim::MatX::Zero(6, 1);
  bar.node_phi(5, 0) = 0.01;
  bar.node_psi = sim::MatX::Zero(6, 1);
  bar.displacement = bar.q * bar.node_phi.transpose();
  bar.rotation.resize(0, 0);
  const auto told = [&] {
    const film::Animation animation = film::make_animation(r, small_settings(), nullptr);
    return fmt::format("{}", fmt::join(animation.warnings, " ")).find("2 nodes are too few to tell") != std::string::npos;
  };
  EXPECT_TRUE(told());
  bar.q.setZero();
  bar.displacement.setZero();
  EXPECT_FALSE(told()) << "of a body that does not deform";
}

TEST(Animation, VelocityOfTheTip) {
  const sim::Results r = test::swinging_beam(0.0);
  film::RenderSettings s = small_settings();
  s.color_by = film::ColorBy::velocity;
  const film::Animation animation = film::make_animation(r, s, nullptr);
  // Block: 1.6 rad/s at radius 1 m and half its size more.
  EXPECT_GT(animation.scalar_map.upper, 1.6);
  EXPECT_LT(animation.scalar_map.upper, 1.6 * 1.1);
}

// A point on a circle, seen w h of a turn apart: the chord between neighbours is too short by sin(wh)/(wh) at a sample, and that is told.
TEST(Animation, SpeedsBetweenFewSamplesAreToldOf) {
  film::RenderSettings s = small_settings();
  s.color_by = film::ColorBy::velocity;
  const auto turning = [](int samples) {
    sim::Results r = test::swinging_beam(0.0, samples);
    for (Eigen::Index i = 0; i < r.times.size(); ++i)
      for (sim::ResultBody& b : r.bodies) {
        const double angle = 2.0 * std::numbers::pi * r.times[i];
        b.orientation.row(i) << std::cos(0.5 * angle), 0.0, 0.0, std::sin(0.5 * angle);
        if (b.kind == "rigid") b.position.row(i) << std::cos(angle), std::sin(angle), 0.0;
      }
    return r;
  };
  const auto told = [&](int samples) {
    const sim::Results r = turning(samples);
    const film::Animation animation = film::make_animation(r, s, nullptr);
    return fmt::format("{}", fmt::join(animation.warnings, " "));
  };
  EXPECT_EQ(told(61).find("output_rate"), std::string::npos) << told(61);
  EXPECT_NE(told(13).find("may be off by"), std::string::npos);
}

// What speeds up evenly is fastest at the end: differences that look to one side only were half a spacing late there.
TEST(Animation, SpeedsAtTheEndsAreThoseOfTheEnds) {
  sim::Results r = test::swinging_beam(0.0, 13);
  const double last = r.times[r.times.size() - 1];
  for (Eigen::Index i = 0; i < r.times.size(); ++i)
    for (sim::ResultBody& b : r.bodies) {
      b.orientation.row(i) << 1.0, 0.0, 0.0, 0.0;
      if (b.kind == "rigid") b.position.row(i) << r.times[i] * r.times[i], 0.0, 0.0;
    }
  film::RenderSettings s = small_settings();
  s.color_by = film::ColorBy::velocity;
  const film::Animation animation = film::make_animation(r, s, nullptr);
  EXPECT_NEAR(animation.scalar_map.upper, 2.0 * last, 2e-3 * last);
}

// What stands still has no speeds to colour by, though the last bits of its positions change; what creeps under a large deflection is told.
TEST(Animation, RoundingOfPositionsIsNoSpeed) {
  sim::Results r = test::swinging_beam(0.1);
  for (sim::ResultBody& b : r.bodies)
    for (Eigen::Index i = 0; i < r.times.size(); ++i) {
      for (sim::RowsX* m : {&b.displacement, &b.rotation, &b.q})
        if (m->size() > 0) m->row(i) = m->row(40).eval();
      b.position.row(i) = b.position.row(40).eval();
      b.orientation.row(i) = b.orientation.row(40).eval();
    }
  sim::Results creeping = r;
  for (Eigen::Index i = 0; i < r.times.size(); ++i) r.bodies[1].position(i, 0) += i % 4 < 2 ? 2e-16 : 0.0;
  film::RenderSettings s = small_settings();
  s.color_by = film::ColorBy::velocity;
  const film::Animation still = film::make_animation(r, s, nullptr);
  EXPECT_FALSE(still.scalar_bar);
  EXPECT_NE(fmt::format("{}", fmt::join(still.notes, " ")).find("no colours: the largest speed"), std::string::npos);
  creeping.bodies[1].position.col(1) += 2e-5 * creeping.times;
  const film::Animation slow = film::make_animation(creeping, s, nullptr);
  ASSERT_TRUE(slow.scalar_bar);
  EXPECT_NEAR(slow.scalar_map.upper, 2e-5, 1e-8);
  EXPECT_NE(fmt::format("{}", fmt::join(slow.warnings, " ")).find("uncertain"), std::string::npos);
}

TEST(Animation, AutomaticScaleShowsSmallDeflectionsAndLeavesLargeOnesAlone) {
  film::RenderSettings s = small_settings();
  s.scales.clear();
  const sim::Results tiny = test::swinging_beam(1e-5), large = test::swinging_beam(0.3), none = test::swinging_beam(0.0);
  const film::Animation of_tiny = film::make_animation(tiny, s, nullptr);
  ASSERT_EQ(of_tiny.scales.size(), 2u);
  EXPECT_GE(of_tiny.scales[1], 1000.0);
  EXPECT_EQ(film::make_animation(large, s, nullptr).scales.size(), 1u);
  EXPECT_EQ(film::make_animation(none, s, nullptr).scales.size(), 1u);
}

TEST(Animation, EmptyResultsAreRefused) {
  sim::Results r = test::swinging_beam();
  r.bodies.clear();
  EXPECT_THROW(film::make_animation(r, small_settings(), nullptr), sim::InputError);
  r = test::swinging_beam();
  r.times.resize(0);
  EXPECT_THROW(film::make_animation(r, small_settings(), nullptr), sim::InputError);
}

TEST(Animation, ModalBodyWithLinearModesUsesColumns) {
  sim::Results r = test::swinging_beam();
  sim::ResultBody& beam = r.bodies[0];
  const Eigen::Index nt = r.times.size(), nn = static_cast<Eigen::Index>(beam.nodes.size());
  beam.kind = "modal";
  beam.q = beam.displacement.col(3 * nn - 2);
  beam.qd = sim::MatX::Zero(nt, 1);
  beam.node_phi = sim::MatX::Zero(3 * nn, 1);
  beam.node_psi = sim::MatX::Zero(3 * nn, 1);
  for (Eigen::Index k = 0; k < nn; ++k) {
    const double x = beam.nodes[k].origin.x();
    beam.node_phi(3 * k + 1, 0) = x * x;
    beam.node_psi(3 * k + 2, 0) = 2.0 * x;
  }
  beam.kind = "beam";  // drawn by its section; modal by its data
  const film::Animation modal = film::make_animation(r, small_settings(), nullptr);
  EXPECT_TRUE(modal.bodies[0].modes.has_value());
  // A folder for mapped modes, where one is given: read back to the bit, and made anew for another map.
  const Scratch scratch;
  film::RenderSettings cached = small_settings();
  cached.cache = scratch.path() / "modes";
  EXPECT_FALSE(film::make_animation(r, cached, nullptr).bodies[0].from_cache);
  const film::Animation again = film::make_animation(r, cached, nullptr);
  EXPECT_TRUE(again.bodies[0].from_cache);
  EXPECT_TRUE(std::ranges::equal(again.bodies[0].modes->tiles(), modal.bodies[0].modes->tiles()));
  cached.scheme = interp::Scheme::r3;
  EXPECT_FALSE(film::make_animation(r, cached, nullptr).bodies[0].from_cache);
  r.bodies[0].node_phi.resize(0, 0);
  const film::Animation nodal = film::make_animation(r, small_settings(), nullptr);
  EXPECT_FALSE(nodal.bodies[0].modes.has_value());
  // Small rotations: both agree to second order.
  film::PictureMemory a, b;
  film::update_picture(modal, 15, a);
  film::update_picture(nodal, 15, b);
  for (size_t i = 0; i < a.picture.surfaces[0].positions.size(); ++i)
    EXPECT_LT(glm::length(a.picture.surfaces[0].positions[i] - b.picture.surfaces[0].positions[i]), 0.02 * 0.02 * 0.02);
}

// One start transient of a hundredth of the run, twenty times as far as the rest: the colours are those of the rest, and a note says so.
TEST(Colours, AShortPeakDoesNotSetTheirRange) {
  sim::Results r = test::swinging_beam(0.001, 1001, 10.0);
  for (int i = 0; i < 10; ++i) r.bodies[0].displacement.row(i) += 20.0 * r.bodies[0].displacement.row(87);
  const auto upper = [&](const std::string& words, size_t* notes = nullptr) {
    const film::RenderSettings s = film::parse_render_settings("[render]\nscales = [1]\n" + words, "scene.toml");
    const film::Animation a = film::make_animation(r, s, nullptr);
    if (notes)
      *notes = static_cast<size_t>(
          std::count_if(a.notes.begin(), a.notes.end(), [](const std::string& n) { return n.find("colours end at") == 0; }));
    return a.scalar_map.upper;
  };
  size_t notes = 0;
  EXPECT_NEAR(upper("", &notes), 0.001, 1e-5);
  EXPECT_EQ(notes, 1u);
  EXPECT_GT(upper("color_range = \"full\"\n", &notes), 0.019);
  EXPECT_EQ(notes, 0u);
  EXPECT_NEAR(upper("color_range = { percentile = 50 }\n"), 0.001 * std::sin(0.25 * M_PI), 3e-5);
  EXPECT_NEAR(upper("color_range = { window = [1, 9] }\n"), 0.001, 1e-5);
  EXPECT_THROW(upper("color_range = { window = [11, 12] }\n"), sim::InputError);
}

// A pulse of two pictures among thousands, between those that are surveyed evenly: the bar ends above it.
TEST(Colours, ShortPeaksOfLongFilmsAreFound) {
  sim::Results r;
  constexpr int samples = 20001;
  r.times = sim::VecX::LinSpaced(samples, 0.0, 20.0);
  sim::ResultBody block = test::swinging_beam(0.0, samples, 20.0).bodies[1];
  for (const double start : {7.02, 7.04, 7.08, 7.11}) {
    double x = 0.0;
    for (int i = 0; i < samples; ++i) {
      block.position.row(i) << x, 0.0, 0.0;
      block.orientation.row(i) << 1.0, 0.0, 0.0, 0.0;
      x += 0.001 * (r.times[i] > start && r.times[i] < start + 0.04 ? 50.0 : 1.0);
    }
    r.bodies = {block};
    const film::RenderSettings s =
        film::parse_render_settings("[render]\nframe_rate = 60\ncolor_by = \"velocity\"\ncolor_range = \"full\"\n", "scene.toml");
    EXPECT_NEAR(film::make_animation(r, s, nullptr).scalar_map.upper, 50.0, 1e-3) << start;
  }
}

// What the survey did not see is told by the picture that shows it.
TEST(Colours, APictureBeyondTheSurveySaysSo) {
  const sim::Results r = test::swinging_beam(0.01);
  film::Animation a = film::make_animation(r, small_settings(), nullptr);
  a.scalar_map.upper *= 0.5;
  film::PictureMemory memory;
  bool beyond = false;
  for (int k = 0; k < a.count; ++k) {
    film::update_picture(a, k, memory);
    float largest = 0.0f;
    for (const auto& of_body : memory.scalars)
      for (const float v : of_body) largest = std::max(largest, v);
    EXPECT_EQ(memory.picture.scalar_map.above.has_value(), static_cast<double>(largest) > 1.01 * a.scalar_map.upper) << k;
    beyond = beyond || memory.picture.scalar_map.above;
  }
  EXPECT_TRUE(beyond);
}

// A window between two pictures is looked at too; one beyond the run is answered with where that lies.
TEST(Colours, WindowsMayLieBetweenPictures) {
  const sim::Results r = test::swinging_beam(0.001, 1001, 10.0);
  const auto upper = [&](const std::string& window) {
    const film::RenderSettings s =
        film::parse_render_settings("[render]\nscales = [1]\ncolor_range = { window = " + window + " }\n", "scene.toml");
    return film::make_animation(r, s, nullptr).scalar_map.upper;
  };
  EXPECT_NEAR(upper("[5.051, 5.052]"), std::abs(0.001 * std::sin(9.0 * 5.0515)), 3e-5);
  try {
    upper("[11, 12]");
    ADD_FAILURE();
  } catch (const sim::InputError& e) {
    EXPECT_NE(std::string(e.what()).find("from 0 to 10 s"), std::string::npos) << e.what();
  }
}

TEST(Colours, ARangeInPascalBesideAYieldStressIsWarnedOf) {
  const sim::Results r = test::swinging_beam(0.01);
  const auto warned = [&](const std::string& range) {
    const film::RenderSettings s =
        film::parse_render_settings("[render]\ncolor_by = \"stress\"\nyield_stress = 3e8\ncolor_range = " + range, "scene.toml");
    const std::vector<std::string> warnings = film::make_animation(r, s, nullptr).warnings;
    return std::any_of(warnings.begin(), warnings.end(), [](const std::string& w) { return w.find("shares of it") != w.npos; });
  };
  EXPECT_FALSE(warned("[0, 0.8]"));
  EXPECT_TRUE(warned("[0, 2.4e8]"));
}

sim::ResultOutput column(const std::string& name, const sim::VecX& values) { return {name, "m", values, ""}; }

// Two outputs that move alike but far from each other would be two flat lines in one panel.
TEST(Plots, CurvesFarApartHavePanelsOfTheirOwn) {
  sim::Results r = test::swinging_beam(0.01);
  const sim::VecX y = r.outputs[0].values;
  r.outputs = {column("a", y), column("b", (y.array() + 0.3).matrix()), column("far", (y.array() + 2000.0).matrix()),
               column("zero", 0.0 * y)};
  const film::Animation a = film::make_animation(
      r, film::parse_render_settings("[render]\noverlay = { plot = [\"a\", \"b\", \"far\", \"zero\"] }\n", "s"), nullptr);
  ASSERT_EQ(a.panels.size(), 3u);
  EXPECT_EQ(a.panels[0].series.size(), 2u);
  EXPECT_EQ(a.panels[1].series[0].label, "far");
  EXPECT_EQ(a.panels[1].y_label, "m");
  // Nothing is as good as 0 m: no nanometres.
  EXPECT_EQ(a.panels[2].y_label, "m");
}

// An output's name means all its columns, once each.
TEST(Plots, OutputsStandForTheirColumns) {
  sim::Results r = test::swinging_beam(0.01);
  const sim::VecX y = r.outputs[0].values;
  r.outputs = {column("tip.x", y), column("tip.y", 2.0 * y), column("tipping", y)};
  const film::RenderSettings s = film::parse_render_settings("[render]\noverlay = { plot = [\"tip.y\", \"tip\"] }\n", "s");
  film::check_render_settings(s, r, "s");
  const film::Animation a = film::make_animation(r, s, nullptr);
  ASSERT_EQ(a.panels.size(), 1u);
  ASSERT_EQ(a.panels[0].series.size(), 2u);
  EXPECT_EQ(a.panels[0].series[0].label, "tip.y");
  EXPECT_EQ(a.panels[0].series[1].label, "tip.x");
  const film::RenderSettings wrong = film::parse_render_settings("[render]\noverlay = { plot = [\"tip.z\"] }\n", "s");
  EXPECT_THROW(film::check_render_settings(wrong, r, "s"), sim::InputError);
}

// The dot of a curve of more samples than are drawn stands at the output's value at the picture's time.
TEST(Plots, DotsOfManySamplesStandAtTheirValues) {
  sim::Results r = test::swinging_beam(0.01, 20001, 1.0);
  sim::VecX fast(r.times.size());
  for (Eigen::Index i = 0; i < fast.size(); ++i) fast[i] = std::sin(2.0 * M_PI * 1700.0 * r.times[i]);
  r.outputs = {column("fast", fast)};
  const film::Animation a =
      film::make_animation(r, film::parse_render_settings("[render]\nspeed = 0.37\noverlay = { plot = [\"fast\"] }\n", "s"), nullptr);
  film::PictureMemory memory;
  EXPECT_EQ(a.panels[0].series[0].x.front(), r.times[0]);
  EXPECT_EQ(a.panels[0].series[0].x.back(), r.times[r.times.size() - 1]);
  for (int k = 0; k < a.count; k += 7) {
    film::update_picture(a, k, memory);
    const film::SamplePlace now = film::find_sample(r.times, film::picture_time(a, k));
    double value = fast[now.index];
    if (now.share > 0.0) value += now.share * (fast[now.index + 1] - value);
    ASSERT_TRUE(memory.picture.overlay.plots[0].series[0].now);
    EXPECT_DOUBLE_EQ(*memory.picture.overlay.plots[0].series[0].now, a.panels[0].factor * value);
  }
}

// Curves of runs that are drawn together have the colours of their runs, in whatever panel and whatever order.
TEST(Plots, CurvesOfRunsHaveTheirColours) {
  sim::Results r = test::swinging_beam(0.01);
  const sim::VecX y = r.outputs[0].values;
  r.outputs = {column("fine: y", y), column("coarse: y", 50.0 * y), column("coarse - fine: y", 49.0 * y)};
  film::RenderSettings s =
      film::parse_render_settings("[render]\noverlay = { plot = [\"fine: y\", \"coarse: y\", \"coarse - fine: y\"] }\n", "s");
  s.runs = {{"fine", glm::vec3(1, 0, 0)}, {"coarse", glm::vec3(0, 1, 0)}};
  const film::Animation a = film::make_animation(r, s, nullptr);
  film::PictureMemory memory;
  film::update_picture(a, 0, memory);
  int found = 0;
  for (const render::Plot& plot : memory.picture.overlay.plots)
    for (const render::Series& series : plot.series) {
      const bool difference = series.label.starts_with("coarse - ");
      EXPECT_EQ(series.color, difference ? render::category_color(2) : glm::vec3(series.label[0] == 'f', series.label[0] == 'c', 0))
          << series.label;
      ++found;
    }
  EXPECT_EQ(found, 3);
}

}  // namespace

}  // namespace test_animation
