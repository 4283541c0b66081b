// A finite element model becomes a body, swings on a pin and is drawn: part MODEL.inp PICTURE.png, of a model with node sets ROOT and TIP
// (assets/beam/make_beam.py writes one). part.sid and part.obj are left in the current folder.
#include <flexframe/film.h>
#include <flexframe/render.h>
#include <flexframe/sim.h>

#include <cstdio>
#include <fstream>

using namespace flexframe;

namespace {

const char* const scene_text = R"(
title = "Reduced part"
[simulation]
duration = 0.5
gravity = [0, -9.81, 0]
[[body]]
name = "part"
kind = "modal"
file = "part.sid"
mesh = "part.obj"
[[joint]]
name = "pin"
kind = "revolute"
parent = "ground"
child = "part.root"
axis = [0, 0, 1]
[[output]]
name = "angle"
of = "pin"
quantity = "value"
)";

int run(const char* model_file, const char* picture_file) {
  sim::ReduceRequest request;
  request.model = model_file;
  request.interfaces = {"root=average:ROOT", "tip=average:TIP"};
  request.options.modes = 6;
  const auto [model, reduction] = sim::reduce(request);
  sim::SidFile file = sim::from_flexible_body(reduction.body, "made by part.cpp");
  file.further = reduction.further;  // by which runs tell what the modes leave out
  sim::write_sid(file, "part.sid");
  std::ofstream("part.obj") << sim::surface_obj(model);

  const sim::Scene scene = sim::parse_scene(scene_text, "part.toml");
  const sim::Results results = sim::simulate(scene);
  for (const std::string& text : results.statistics.notes.texts(sim::Severity::warning)) std::printf("warning: %s\n", text.c_str());

  film::RenderSettings settings;
  settings.size = {640, 360};
  const film::Animation animation = film::make_animation(results, settings, &scene);
  film::PictureMemory memory;
  film::update_picture(animation, animation.count / 2, memory);
  render::Renderer renderer;
  render::write_png(picture_file, renderer.draw(memory.picture));
  std::printf("%d coordinates, first frequency %.3f Hz, angle at the end %.6f rad\n", reduction.body.n, reduction.report.frequencies[0],
              results.outputs[0].values[results.times.size() - 1]);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::printf("usage: part MODEL.inp PICTURE.png\n");
    return 2;
  }
  try {
    return run(argv[1], argv[2]);
  } catch (const Error& error) {
    std::printf("%s\n", error.what());
    return 1;
  }
}
