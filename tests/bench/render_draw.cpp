// Prints CPU milliseconds a picture of each stage for meshes of 5k, 100k and 1M triangles at 1280 x 720, 2 x 2 samples:
// a waving tube, deformed anew for every picture, with normals and colours by displacement; plain and full look
// (shadows, occlusion, floor, words, light of the studio).
// Usage: bench_render [pictures = 60] [osmesa|egl] [plain|full|both] [triangles ...]
// Each stage is its median over the pictures: what else runs on the machine spoils some of them.
#include "render/draw/renderer.h"
#include "render/frame/camera.h"
#include "render/image/png.h"
#include "tests/bench/cpu.h"
#include "tests/unit/render_solids.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

using namespace flexframe::render;

namespace {

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
  tune_process();
  // As the program's workers draw: in the calling thread.
  setenv("LP_NUM_THREADS", "0", 1);
  const int pictures = argc > 1 ? std::max(1, std::atoi(argv[1])) : 60;
  Renderer renderer(backend_from_name(argc > 2 ? argv[2] : "osmesa"));
  fmt::print("{}, {}\n", renderer.info().renderer, renderer.info().cpu);
  fmt::print("{:>10} {:>6} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}\n", "triangles", "look", "deform", "draw", "filter", "overlay", "png",
             "all");
  const std::string looks = argc > 3 ? argv[3] : "both";
  std::vector<int> targets;
  for (int i = 4; i < argc; ++i) targets.push_back(std::max(100, std::atoi(argv[i])));
  if (targets.empty()) targets = {5000, 100000, 1000000};
  for (const int target : targets) {
    const int sides = static_cast<int>(std::lround(std::sqrt(target / 2.0 / 5.0))), rings = target / 2 / sides;
    std::vector<glm::dvec3> path;
    for (int i = 0; i <= rings; ++i) path.emplace_back(2.0 * i / rings, 0.0, 0.0);
    const Shape tube = make_tube(path, 0.1, sides);
    std::vector<glm::vec3> positions = tube.positions, normals;
    std::vector<float> displacement(positions.size());
    for (const bool full : {false, true}) {
      if (looks == (full ? "plain" : "full")) continue;
      Picture p;
      Surface s;
      s.triangles = tube.triangles;
      s.two_sided = false;
      p.look = full ? Look{} : plain_look();
      // As the command draws by itself: light of the studio, colours lightened for it.
      p.lighting.studio = p.scalar_map.lightened = full;
      p.bounds.add(glm::dvec3(-0.1, -0.3, -0.1));
      p.bounds.add(glm::dvec3(2.1, 0.3, 0.1));
      std::vector<glm::dvec3> corners;
      append_corners(corners, p.bounds);
      p.scalar_map.upper = 0.2;
      if (full) {
        p.ground = default_ground(corners, glm::dvec3(0, 1, 0));
        p.overlay.title = "Waving tube";
        p.overlay.time = "t = 0.500 s";
        p.overlay.note = "in scale";
        p.overlay.scalar_bar = ScalarBar{"displacement", "mm", 1000.0};
        p.overlay.triad = true;
      }
      p.camera = fit_camera(p, corners, default_view(corners, glm::dvec3(0.0)));
      std::vector<double> deform, draw, filter, overlay, png, all;
      for (int k = -1; k < pictures; ++k) {
        const double start = 1e3 * flexframe::test::process_seconds();
        const float amplitude = 0.2f * std::sin(0.3f * static_cast<float>(k));
        for (std::size_t i = 0; i < positions.size(); ++i) {
          displacement[i] = amplitude * std::sin(3.1f * tube.positions[i].x);
          positions[i] = tube.positions[i] + glm::vec3(0.0f, displacement[i], 0.0f);
          displacement[i] = std::abs(displacement[i]);
        }
        update_normals(positions, tube.triangles, normals);
        s.positions = positions;
        s.normals = normals;
        s.scalars = displacement;
        p.surfaces = {s};
        const double deformed = 1e3 * flexframe::test::process_seconds();
        const Image image = renderer.draw(p);
        const double drawn = 1e3 * flexframe::test::process_seconds();
        const auto bytes = encode_png(image);
        const double end = 1e3 * flexframe::test::process_seconds();
        if (k < 0) continue;  // shaders are compiled with the first picture
        deform.push_back(deformed - start);
        draw.push_back(1e3 * renderer.times().draw);
        filter.push_back(1e3 * renderer.times().filter);
        overlay.push_back(1e3 * renderer.times().overlay);
        png.push_back(end - drawn);
        all.push_back(end - start);
      }
      fmt::print("{:>10} {:>6} {:>8.1f} {:>8.1f} {:>8.1f} {:>8.1f} {:>8.1f} {:>8.1f}\n", tube.triangles.size(), full ? "full" : "plain",
                 median(deform), median(draw), median(filter), median(overlay), median(png), median(all));
    }
  }
}
