// flexframe info: what a file holds, or what draws the pictures here.
#include "render/cli/commands.h"

#include "render/draw/renderer.h"
#include "render/image/png.h"
#include "render/picture/mesh.h"
#include "sim/bodies/sid.h"
#include "sim/results/results_file.h"
#include "sim/scene/scene_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace flexframe::cli {
namespace {

void print_results(const std::string& file) {
  const sim::Results r = sim::read_results(file);
  const Eigen::Index n = r.times.size();
  fmt::print("results: {}\n", r.title.empty() ? "(no title)" : r.title);
  if (!r.scene_file.empty()) fmt::print("scene    {}\n", r.scene_file);
  if (n > 0) fmt::print("times    {} samples from {:g} to {:g} s\n", n, r.times[0], r.times[n - 1]);
  for (const sim::ResultBody& b : r.bodies) {
    fmt::print("body     {} ({}): {} nodes, {} elastic coordinates", b.name, b.kind, b.nodes.size(), b.q.cols());
    if (b.displacement.size() > 0) fmt::print(", node displacement up to {:.4g} m per axis", b.displacement.cwiseAbs().maxCoeff());
    fmt::print("{}\n", b.mesh.empty() ? "" : ", mesh " + b.mesh);
  }
  for (const sim::ResultJoint& j : r.joints) fmt::print("joint    {} ({}): {} coordinates\n", j.name, j.kind, j.value.cols());
  for (const sim::ResultOutput& o : r.outputs) {
    if (o.values.size() == 0) continue;
    fmt::print("output   {} [{}]: {:.6g} .. {:.6g}\n", o.column, o.unit, o.values.minCoeff(), o.values.maxCoeff());
  }
  const sim::SolverStatistics& s = r.statistics;
  if (!s.method.empty())
    fmt::print("solver   {}, tolerance {:g}, {} steps, {} evaluations, {:.4f} CPU s\n", s.method, s.tolerance, s.steps, s.evaluations,
               s.cpu_seconds);
  if (s.error_estimate >= 0.0) fmt::print("error    {:.1e} of the range of {}, estimated\n", s.error_estimate, s.error_column);
  for (const std::string& warning : s.notes.texts(sim::Severity::warning)) fmt::print("WARNING  {}\n", warning);
  for (const std::string& note : s.notes.texts(sim::Severity::note)) fmt::print("note     {}\n", note);
}

const char* kind_of(const sim::BodyDef& body) {
  if (std::holds_alternative<sim::RigidDef>(body.kind)) return "rigid";
  if (std::holds_alternative<sim::BeamDef>(body.kind)) return "beam";
  if (std::holds_alternative<sim::ModalDef>(body.kind)) return "modal";
  return "statespace";
}

void print_scene(const std::string& file) {
  const sim::Scene s = sim::read_scene(file);
  const auto end = [](const sim::FrameRef& ref) { return ref.frame.empty() ? ref.body : ref.body + "." + ref.frame; };
  fmt::print("scene: {}\n", s.title.empty() ? "(no title)" : s.title);
  fmt::print("duration {:g} s, {:g} samples per second\n", s.simulation.duration, s.simulation.output_rate);
  for (const sim::BodyDef& b : s.bodies) fmt::print("body     {} ({})\n", b.name, kind_of(b));
  for (const sim::JointDef& j : s.joints) fmt::print("joint    {}: {} to {}\n", j.name, end(j.parent), end(j.child));
  for (const sim::ForceDef& f : s.forces) fmt::print("force    on {}: {}\n", end(f.on), f.value);
  for (const sim::OutputDef& o : s.outputs) fmt::print("output   {} of {}\n", o.name, end(o.of));
}

void print_sid(const std::string& file) {
  const sim::SidReading reading = sim::read_sid(file);
  const sim::SidFile& s = reading.file;
  fmt::print("SID body: {}\n", s.name.empty() ? s.comment : s.name);
  fmt::print("mass     {:.9g} kg, {} elastic coordinates, {} nodes\n", s.mass, s.nelastq, s.nodes.size());
  for (const std::string& label : s.labels) fmt::print("mode     {}\n", label);
  for (const sim::SidCheck& check : sim::check_sid(s)) fmt::print("check    {}: {:.2e}\n", check.identity, check.residual);
  for (const std::vector<std::string>* all : {&reading.dialect, &reading.notes})
    for (const std::string& note : *all) fmt::print("note     {}\n", note);
}

void print_mesh(const std::string& file) {
  const render::Mesh m = render::read_mesh(file);
  const render::Bounds b = render::compute_bounds(m);
  fmt::print("mesh: {}\n", m.name);
  fmt::print("size     {} vertices, {} triangles, {} materials\n", m.positions.size(), m.triangles.size(), m.materials.size());
  fmt::print("bounds   ({:.6g}, {:.6g}, {:.6g}) .. ({:.6g}, {:.6g}, {:.6g})\n", b.lower.x, b.lower.y, b.lower.z, b.upper.x, b.upper.y,
             b.upper.z);
  for (const std::string& warning : m.warnings) fmt::print("note     {}\n", warning);
}

void print_picture(const std::string& file) {
  const render::Image image = render::read_png(file);
  fmt::print("picture: {}x{}, {} channels, {}\n", image.width, image.height, image.channels,
             render::is_whole_png(file) ? "whole" : "damaged");
  if (const std::string inputs = render::read_png_text(file, "flexframe-inputs"); !inputs.empty()) fmt::print("inputs   {}\n", inputs);
}

void print_renderer(const std::string& name) {
  const render::Renderer renderer(render::backend_from_name(name));
  const render::RendererInfo& info = renderer.info();
  fmt::print("backend  {}\nrenderer {}\nversion  {}\ncpu      {}\n", info.backend, info.renderer, info.version, info.cpu);
}

}  // namespace

Command add_info(Program& program) {
  struct Words {
    std::string file, renderer;
  };
  const auto words = std::make_shared<Words>();
  Subcommand app = program.subcommand("info", "what a file holds: results, scene, SID body, mesh, picture");
  app.option("FILE", words->file, "results (.h5), scene (.toml), SID body (.sid, .SID_FEM), picture (.png) or mesh");
  app.option("--renderer", words->renderer, "show the renderer: osmesa or egl; default osmesa")
      .value_or("osmesa")
      .excludes("FILE")
      .one_of({"osmesa", "egl"});

  return {app, [words, app] {
            if (app.given("--renderer")) {
              print_renderer(words->renderer.empty() ? "osmesa" : words->renderer);
              return 0;
            }
            if (words->file.empty()) throw UsageError("info needs a FILE or --renderer");
            if (!std::filesystem::exists(words->file)) throw sim::InputError(fmt::format("{}: no such file", words->file));
            std::string ending = std::filesystem::path(words->file).extension().string();
            std::transform(ending.begin(), ending.end(), ending.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
            if (ending == ".h5" || ending == ".hdf5") print_results(words->file);
            else if (ending == ".toml") print_scene(words->file);
            else if (ending == ".sid" || ending == ".sid_fem") print_sid(words->file);
            else if (ending == ".png") print_picture(words->file);
            else print_mesh(words->file);
            return 0;
          }};
}

}  // namespace flexframe::cli
