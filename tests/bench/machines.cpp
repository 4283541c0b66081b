// CPU of both machines of Schiavo et al. 2005 at tolerances 1e-3..1e-9 with the error of each against a tight run, and
// CPU per picture of each stage at 1280x720.
//
//   bench_machines EXAMPLES_FOLDER
#include "render/draw/renderer.h"
#include "render/film/animation.h"
#include "render/film/filming.h"
#include "sim/scene/scene_reader.h"
#include "sim/simulate.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

namespace {

using namespace flexframe;

// Largest difference of an output over the run, m.
double difference(const sim::Results& a, const sim::Results& b, const std::string& column) {
  double worst = 0.0;
  for (size_t i = 0; i < a.outputs.size(); ++i)
    if (a.outputs[i].column == column) worst = std::max(worst, (a.outputs[i].values - b.outputs[i].values).cwiseAbs().maxCoeff());
  return worst;
}

// The median of three runs.
double median_cpu(const sim::Scene& scene, const sim::SimulateOptions& options) {
  double cpu[3];
  for (double& c : cpu) c = sim::simulate(scene, options).statistics.cpu_seconds;
  std::sort(cpu, cpu + 3);
  return cpu[1];
}

void bench_simulation(const sim::Scene& scene, const std::vector<std::string>& columns) {
  sim::SimulateOptions options;
  options.estimate_error = false;
  options.tolerance = 1e-11;
  const sim::Results reference = sim::simulate(scene, options);
  fmt::print("{}\n  {:>9}  {:>8}  {:>6}  {:>11}", scene.title, "tolerance", "CPU ms", "steps", "evaluations");
  for (const std::string& column : columns) fmt::print("  {:>18}", "error of " + column);
  fmt::print("\n");
  for (double tolerance : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9}) {
    options.tolerance = tolerance;
    const sim::Results results = sim::simulate(scene, options);
    fmt::print("  {:>9.0e}  {:>8.2f}  {:>6}  {:>11}", tolerance, 1e3 * median_cpu(scene, options), results.statistics.steps,
               results.statistics.evaluations);
    for (const std::string& column : columns) fmt::print("  {:>16.2e} m", difference(results, reference, column));
    fmt::print("\n");
  }
}

void bench_pictures(const sim::Scene& scene) {
  sim::SimulateOptions options;
  options.estimate_error = false;
  const sim::Results results = sim::simulate(scene, options);
  film::RenderSettings settings = film::read_render_settings(scene.file);
  settings.size = {1280, 720};
  const film::Animation animation = film::make_animation(results, settings, &scene);
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / fmt::format("flexframe_bench_{}", ::getpid());
  film::FilmOptions film_options;
  film_options.folder = folder;
  film_options.workers = 1;
  film_options.end = std::min(animation.count, 60);
  const film::FilmReport report = film::film(animation, film_options);
  std::filesystem::remove_all(folder);
  const double per = 1e3 / report.drawn;
  const double all = report.cpu_deform + report.cpu_draw + report.cpu_encode;
  fmt::print("{}\n  CPU ms a picture at 1280x720: deform {:.1f}, draw {:.1f}, encode {:.1f}, in all {:.1f} (target 60); once: {:.1f} ms\n",
             scene.title, per * report.cpu_deform, per * report.cpu_draw, per * report.cpu_encode, per * all, 1e3 * animation.cpu_setup);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: bench_machines EXAMPLES_FOLDER\n");
    return 2;
  }
  render::tune_process();
  const std::filesystem::path examples = argv[1];
  const sim::Scene pendulum = sim::read_scene(examples / "pendulum.toml"), crank = sim::read_scene(examples / "slider_crank.toml");
  bench_simulation(pendulum, {"tip.x", "tip.y", "deflection.y"});
  bench_simulation(crank, {"slider.x", "rod_middle.y"});
  bench_pictures(pendulum);
  bench_pictures(crank);
  return 0;
}
