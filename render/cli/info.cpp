// flexframe info: what a file holds, or what draws the pictures here.
#include "render/cli/commands.h"
#include "render/cli/guarded.h"
#include "render/cli/jobs.h"
#include "render/cli/json_text.h"

#include "render/draw/renderer.h"
#include "render/image/png.h"
#include "render/import/import.h"
#include "render/picture/mesh.h"
#include "sim/base/plain_text.h"
#include "sim/bodies/body_file.h"
#include "sim/bodies/sid.h"
#include "sim/bodies/sid_judge.h"
#include "sim/results/results_file.h"
#include "sim/scene/scene_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

namespace flexframe::cli {
namespace {

// Bodies, joints, outputs, solver, warnings and notes.
void print_content(const sim::Results& r) {
  const Eigen::Index n = r.times.size();
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

void print_results(const std::string& file) {
  const sim::Results r = sim::read_results(file);
  fmt::print("results: {}\n", r.title.empty() ? "(no title)" : r.title);
  print_content(r);
}

void print_foreign(const std::string& file) {
  const imports::Imported imported = imports::inspect_file(file);
  fmt::print("{}: {} (flexframe import makes results of it)\n", imported.kind, imported.results.title);
  print_content(imported.results);
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

// A body of either kind of file, as SID files say it, and what HDF5 files know beyond.
struct BodyContent {
  sim::SidReading reading;
  std::optional<sim::BodyFile> whole;
};
BodyContent read_body_content(const std::string& file) {
  BodyContent out;
  if (!sim::is_hdf5(file)) {
    out.reading = sim::read_sid(file);
    return out;
  }
  out.whole = sim::read_body(file, file);
  out.reading.file = sim::from_flexible_body(out.whole->body, out.whole->comment);
  out.reading.notes = out.whole->notes;
  return out;
}

void print_body(const std::string& file) {
  const BodyContent content = read_body_content(file);
  const sim::SidReading& reading = content.reading;
  const sim::SidFile& s = reading.file;
  fmt::print("{}: {}\n", content.whole ? "flexible body" : "SID body", s.name.empty() ? s.comment : s.name);
  if (content.whole) {
    for (const auto& [key, text] : content.whole->origin) fmt::print("{:8} {}\n", key, text);
    const sim::BodySurface& surface = content.whole->surface;
    if (surface.points.rows() > 0)
      fmt::print("surface  {} nodes, {} faces of the finite element model, shapes{} at all of them\n", surface.points.rows(),
                 surface.faces.rows(), surface.stress.size() > 0 ? " and stresses" : "");
  }
  fmt::print("mass     {:.9g} kg, {} elastic coordinates, {} nodes\n", s.mass, s.nelastq, s.nodes.size());
  const sim::SidJudgement judged = sim::judge_sid(s);
  fmt::print("centre   ({:.6g}, {:.6g}, {:.6g}) m, principal moments of inertia about it {:.6g}, {:.6g}, {:.6g} kg m^2\n",
             judged.centre.x(), judged.centre.y(), judged.centre.z(), judged.moments.x(), judged.moments.y(), judged.moments.z());
  for (const std::string& label : s.labels) fmt::print("mode     {}\n", label);
  for (Eigen::Index k = 0; k < judged.frequencies.size(); ++k)
    fmt::print("{} {:.6g} Hz by Ke and Me\n", k == 0 ? "freq.   " : "        ", judged.frequencies(k));
  for (const std::string& text : judged.contradicted) fmt::print("fault    {}\n", text);
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
  for (const std::string& fault : m.faults) fmt::print("warning  {}\n", fault);
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

using Json = nlohmann::ordered_json;

Json content_json(const sim::Results& r, const std::string& kind) {
  Json out = {{"kind", kind}, {"title", r.title}, {"scene", r.scene_file}, {"samples", r.times.size()}};
  if (r.times.size() > 0) out["times"] = {r.times[0], r.times[r.times.size() - 1]};
  out["bodies"] = out["joints"] = out["outputs"] = Json::array();
  for (const sim::ResultBody& b : r.bodies)
    out["bodies"].push_back({{"name", b.name}, {"kind", b.kind}, {"nodes", b.nodes.size()}, {"coordinates", b.q.cols()}, {"mesh", b.mesh}});
  for (const sim::ResultJoint& j : r.joints) out["joints"].push_back({{"name", j.name}, {"kind", j.kind}, {"coordinates", j.value.cols()}});
  for (const sim::ResultOutput& o : r.outputs)
    if (o.values.size() > 0)
      out["outputs"].push_back({{"column", o.column}, {"unit", o.unit}, {"range", {o.values.minCoeff(), o.values.maxCoeff()}}});
  out["simulation"] = simulation_json(r);
  return out;
}

Json results_json(const std::string& file) { return content_json(sim::read_results(file), "results"); }

Json foreign_json(const std::string& file) {
  const imports::Imported imported = imports::inspect_file(file);
  return content_json(imported.results, imported.kind);
}

Json scene_json(const std::string& file) {
  const sim::Scene s = sim::read_scene(file);
  Json out = {{"kind", "scene"}, {"title", s.title}, {"duration", s.simulation.duration}, {"output_rate", s.simulation.output_rate}};
  out["bodies"] = out["joints"] = out["forces"] = out["inputs"] = out["outputs"] = Json::array();
  for (const sim::BodyDef& b : s.bodies) out["bodies"].push_back({{"name", b.name}, {"kind", kind_of(b)}});
  for (const sim::JointDef& j : s.joints) out["joints"].push_back(j.name);
  for (const sim::ForceDef& f : s.forces) out["forces"].push_back({{"name", f.name}, {"on", f.on.body}, {"value", f.value}});
  for (const sim::InputDef& i : s.inputs) out["inputs"].push_back({{"name", i.name}, {"value", i.value}});
  for (const sim::OutputDef& o : s.outputs) out["outputs"].push_back(o.name);
  return out;
}

Json body_json(const std::string& file) {
  const BodyContent content = read_body_content(file);
  const sim::SidReading& reading = content.reading;
  Json out = {{"kind", content.whole ? "flexible body" : "SID body"},
              {"name", reading.file.name},
              {"mass", reading.file.mass},
              {"coordinates", reading.file.nelastq},
              {"nodes", reading.file.nodes.size()},
              {"labels", reading.file.labels},
              {"notes", reading.notes}};
  const sim::SidJudgement judged = sim::judge_sid(reading.file);
  out["frequencies"] = std::vector<double>(judged.frequencies.begin(), judged.frequencies.end());
  out["centre"] = std::vector<double>(judged.centre.begin(), judged.centre.end());
  out["principal_moments"] = std::vector<double>(judged.moments.begin(), judged.moments.end());
  out["faults"] = judged.contradicted;
  for (const sim::SidCheck& check : sim::check_sid(reading.file)) out["checks"][check.identity] = check.residual;
  if (content.whole) {
    for (const auto& [key, text] : content.whole->origin) out["origin"][key] = text;
    const sim::BodySurface& surface = content.whole->surface;
    out["surface"] = {{"nodes", surface.points.rows()}, {"faces", surface.faces.rows()}, {"stress", surface.stress.size() > 0}};
  }
  return out;
}

Json mesh_json(const std::string& file) {
  const render::Mesh m = render::read_mesh(file);
  const render::Bounds b = render::compute_bounds(m);
  return {{"kind", "mesh"},
          {"vertices", m.positions.size()},
          {"triangles", m.triangles.size()},
          {"materials", m.materials.size()},
          {"bounds", {{b.lower.x, b.lower.y, b.lower.z}, {b.upper.x, b.upper.y, b.upper.z}}},
          {"notes", m.warnings},
          {"warnings", m.faults}};
}

Json picture_json(const std::string& file) {
  const render::Image image = render::read_png(file);
  return {{"kind", "picture"}, {"size", {image.width, image.height}}, {"channels", image.channels}, {"whole", render::is_whole_png(file)}};
}

Json renderer_json(const std::string& name) {
  const render::RendererInfo info = render::Renderer(render::backend_from_name(name)).info();
  return {{"backend", info.backend}, {"renderer", info.renderer}, {"version", info.version}, {"cpu", info.cpu}};
}

// What is said about a file of these endings; none: any other is a mesh.
struct Kind {
  std::vector<std::string> endings;
  void (*print)(const std::string&);
  Json (*json)(const std::string&);
};
const Kind& kind_of_file(const std::string& file) {
  static const std::vector<Kind> kinds{{{".h5", ".hdf5"}, print_results, results_json},        {{".toml"}, print_scene, scene_json},
                                       {{".sid", ".sid_fem"}, print_body, body_json},          {{".png"}, print_picture, picture_json},
                                       {imports::file_endings(), print_foreign, foreign_json}, {{}, print_mesh, mesh_json}};
  std::string ending = std::filesystem::path(file).extension().string();
  ending = sim::plain_lower(ending);
  static const Kind body{{}, print_body, body_json};
  if (sim::is_body_file(file)) return body;
  for (const Kind& kind : kinds)
    if (std::find(kind.endings.begin(), kind.endings.end(), ending) != kind.endings.end()) return kind;
  return kinds.back();
}

}  // namespace

Command add_info(Program& program) {
  struct Words {
    std::string file, renderer;
    bool json = false;
  };
  const auto words = std::make_shared<Words>();
  Subcommand app = program.subcommand("info", "what a file holds: results, scene, flexible body, mesh, picture");
  app.option("FILE", words->file,
             "results (.h5), scene (.toml), flexible body (.h5, .sid, .SID_FEM), picture (.png), result file of another program, or mesh");
  app.option("--renderer", words->renderer, "show the renderer: osmesa or egl; default osmesa")
      .as("WORD")
      .value_or("osmesa")
      .excludes("FILE")
      .one_of({"osmesa", "egl"});

  app.flag("--json", words->json, "the same as JSON");
  app.example("crane.h5", "bodies, outputs with their ranges, solver, warnings");
  app.example("--renderer", "what draws the pictures here");

  return {app,
          [words, app] {
            if (app.given("--renderer")) {
              const std::string name = words->renderer.empty() ? "osmesa" : words->renderer;
              if (words->json) fmt::print("{}\n", json_text(renderer_json(name)));
              else print_renderer(name);
              return 0;
            }
            if (words->file.empty()) throw UsageError("info needs a FILE or --renderer");
            if (!std::filesystem::exists(words->file)) throw sim::InputError(fmt::format("{}: no such file", words->file));
            const Kind& kind = kind_of_file(words->file);
            const auto show = [&] {
              if (words->json) fmt::print("{}\n", json_text(kind.json(words->file)));
              else kind.print(words->file);
              return 0;
            };
            const std::vector<std::filesystem::path> files = {words->file};
            return kind.print == print_foreign ? guarded(files, show) : show();
          },
          true};
}

}  // namespace flexframe::cli
