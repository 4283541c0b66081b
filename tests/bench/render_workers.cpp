// Prints the wall time of 60 pictures (1280 x 720, 2 x 2 samples, full look) drawn by one and by two workers, for a flexible pendulum whose
// mesh is a tube of 5k, 100k and 1M triangles: start of the workers, shaders, deformation, drawing and PNG files, as `flexframe render`
// does it. Usage: bench_workers PENDULUM_SCENE [runs = 3] One and two workers take turns; what is printed is the median of the runs.
#include "render/draw/context.h"
#include "render/draw/renderer.h"
#include "render/film/animation.h"
#include "render/film/filming.h"
#include "render/picture/shapes.h"
#include "sim/scene/scene_reader.h"
#include "sim/simulate.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

using namespace flexframe;

namespace {

// A closed tube along the beam, as a Wavefront file.
void write_tube(const std::filesystem::path& file, double length, int triangles) {
  const int sides = static_cast<int>(std::lround(std::sqrt(triangles / 2.0 / 5.0))), rings = triangles / 2 / sides;
  std::vector<glm::dvec3> path;
  for (int i = 0; i <= rings; ++i) path.emplace_back(length * i / rings, 0.0, 0.0);
  const render::Shape tube = render::make_tube(path, 0.05 * length, sides);
  std::ofstream out(file);
  for (const glm::vec3& p : tube.positions) out << fmt::format("v {} {} {}\n", p.x, p.y, p.z);
  for (const glm::uvec3& t : tube.triangles) out << fmt::format("f {} {} {}\n", t.x + 1, t.y + 1, t.z + 1);
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: bench_workers PENDULUM_SCENE [RUNS]\n");
    return 2;
  }
  render::tune_process();
  render::open_osmesa();  // as the program does it: before the workers are forked
  const int runs = argc > 2 ? std::max(1, std::atoi(argv[2])) : 3;
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / fmt::format("flexframe_bench_{}", ::getpid());
  std::filesystem::create_directories(folder);
  sim::Scene scene = sim::read_scene(argv[1]);
  film::RenderSettings settings = film::read_render_settings(argv[1]);
  settings.size = {1280, 720};
  fmt::print("{:>10} {:>12} {:>12} {:>8}\n", "triangles", "1 worker s", "2 workers s", "ratio");
  for (const int triangles : {5000, 100000, 1000000}) {
    scene.bodies.front().mesh = folder / "tube.obj";
    write_tube(*scene.bodies.front().mesh, std::get<sim::BeamDef>(scene.bodies.front().kind).length, triangles);
    sim::SimulateOptions options;
    options.estimate_error = false;
    const sim::Results results = sim::simulate(scene, options);
    const film::Animation animation = film::make_animation(results, settings, &scene);
    film::FilmOptions film_options;
    film_options.folder = folder / "frames";
    film_options.end = std::min(animation.count, 60);
    std::vector<double> one, two;
    for (int run = 0; run < runs; ++run) {
      film_options.workers = 1;
      one.push_back(film::film(animation, film_options).wall_seconds);
      film_options.workers = 2;
      two.push_back(film::film(animation, film_options).wall_seconds);
    }
    fmt::print("{:>10} {:>12.2f} {:>12.2f} {:>8.2f}\n", triangles, median(one), median(two), median(two) / median(one));
    std::fflush(stdout);
  }
  std::filesystem::remove_all(folder);
  return 0;
}
