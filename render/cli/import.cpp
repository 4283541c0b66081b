// flexframe import: result files of other programs to a results file.
#include "render/cli/commands.h"
#include "render/cli/guarded.h"
#include "render/cli/jobs.h"
#include "render/cli/json_text.h"
#include "render/cli/overwrite.h"
#include "render/cli/terminal.h"

#include "render/import/import.h"
#include "sim/base/words.h"
#include "sim/results/results_file.h"
#include "sim/scene/units.h"

#include <fmt/format.h>

#include <memory>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;

struct ImportWords {
  std::vector<std::string> files, meshes;
  std::string out, mapping, scene, mesh_unit, length_unit, angle_unit, stress_unit, title, up;
  std::optional<double> step;
  bool json = false;
};

// The SI value of a unit of this dimension; none where none is given.
std::optional<double> unit_of(const char* option, const std::string& text, const sim::Dimension& wanted, const char* like) {
  if (text.empty()) return std::nullopt;
  const auto unit = sim::parse_unit(text);
  if (!unit || unit->dimension != wanted) throw UsageError(fmt::format("{} {}: a unit like {} is needed", option, sim::quote(text), like));
  return unit->factor;
}

imports::Request request_of(const ImportWords& words) {
  imports::Request request;
  for (const std::string& file : words.files) request.files.emplace_back(file);
  request.mapping = words.mapping;
  request.scene = words.scene;
  request.step = words.step;
  request.title = words.title;
  request.up = words.up;
  for (const std::string& word : words.meshes) {
    const auto equals = word.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == word.size())
      throw UsageError(fmt::format("--mesh {}: BODY=FILE is needed", sim::quote(word)));
    request.meshes[word.substr(0, equals)] = word.substr(equals + 1);
  }
  const sim::Dimension length{.metre = 1}, stress{.metre = -1, .kilogram = 1, .second = -2};
  request.mesh_unit = unit_of("--mesh-unit", words.mesh_unit, length, "mm, in or m").value_or(1.0);
  request.length_unit = unit_of("--length-unit", words.length_unit, length, "mm, in or m");
  request.angle_unit = unit_of("--angle-unit", words.angle_unit, {.radian = 1}, "deg or rad");
  request.stress_unit = unit_of("--stress-unit", words.stress_unit, stress, "MPa or Pa");
  return request;
}

nlohmann::ordered_json to_json(const imports::Imported& imported, const std::string& out) {
  const sim::Results& r = imported.results;
  nlohmann::ordered_json json = {{"kind", imported.kind}, {"out", out}, {"samples", r.times.size()}, {"outputs", r.outputs.size()}};
  json["times"] = {r.times[0], r.times[r.times.size() - 1]};
  json["bodies"] = nlohmann::ordered_json::array();
  for (const sim::ResultBody& b : r.bodies)
    json["bodies"].push_back(
        {{"name", b.name}, {"kind", b.kind}, {"nodes", b.nodes.size()}, {"triangles", b.surface.triangles.rows()}, {"mesh", b.mesh}});
  json["warnings"] = r.statistics.notes.texts(sim::Severity::warning);
  json["notes"] = r.statistics.notes.texts(sim::Severity::note);
  return json;
}

void print_imported(const imports::Imported& imported, const std::string& out) {
  const sim::Results& r = imported.results;
  const sim::Notes& notes = r.statistics.notes;
  if (verbosity() != Verbosity::quiet) {
    fmt::print("results      {}, from {}: {} samples from {:g} to {:g} s, {} outputs\n", out, imported.kind, r.times.size(), r.times[0],
               r.times[r.times.size() - 1], r.outputs.size());
    for (const sim::ResultBody& b : r.bodies) {
      fmt::print("body         {}: {}", b.name, b.kind);
      if (!b.nodes.empty()) fmt::print(", {} nodes", b.nodes.size());
      if (b.surface.triangles.rows() > 0) fmt::print(", {} triangles", b.surface.triangles.rows());
      if (!b.mesh.empty()) fmt::print(", mesh {}", b.mesh);
      fmt::print("\n");
    }
    for (const std::string& note : notes.texts(sim::Severity::note)) fmt::print("note         {}\n", note);
  }
  for (const std::string& warning : notes.texts(sim::Severity::warning)) fmt::print(stderr, "WARNING      {}\n", warning);
}

}  // namespace

Command add_import(Program& program) {
  const auto words = std::make_shared<ImportWords>();
  Subcommand app = program.subcommand("import", "results of another program: tables, Modelica, finite elements, robots");
  app.footer(R"(csv, txt   a table with times: NAME.x NAME.y NAME.z NAME.qw NAME.qx NAME.qy NAME.qz ..., or any columns with --map
mat        Modelica result of Dymola or OpenModelica
frd        CalculiX: displacements and stress of the nodes, on the skin of the elements
npz        NumPy arrays: NAME.position, NAME.orientation, NAME.displacement ...
mov, nc    MBDyn, text and NetCDF
urdf csv   a robot and the motion of its joints
vtu, vtp, pvd, vtkhdf   VTK: points that move, or point data "displacement"
Layouts, units and conventions of each, and the mapping file: render/import/README.md.)");
  app.option("FILES", words->files, "result files; several tables of the same times are read as one").as("FILE").required();
  app.option("-o,--out", words->out, "results file (HDF5); default: the name of the first file with .h5").as("FILE");
  app.option("--map", words->mapping, "mapping file (TOML): columns, units and conventions of every body").as("FILE");
  app.option("--scene", words->scene, "scene that describes the mechanism: its beams, shapes, joints and [render] table are drawn")
      .as("FILE");
  app.option("--mesh", words->meshes, "mesh of a body (STL, PLY, OBJ, glTF); may be given for each").as("BODY=FILE").one_word();
  app.option("--mesh-unit", words->mesh_unit, "unit of the lengths in these meshes; default m").as("UNIT");
  app.option("--length-unit", words->length_unit, "unit of lengths in files that do not say it; default m").as("UNIT");
  app.option("--angle-unit", words->angle_unit, "likewise of angles; default rad").as("UNIT");
  app.option("--stress-unit", words->stress_unit, "likewise of stresses; default Pa").as("UNIT");
  app.option("--step", words->step, "time between samples, s, for files that hold no times").positive();
  app.option("--title", words->title, "title of the pictures; default: the name of the file").as("TEXT");
  app.option("--up", words->up, "x, y or z: what points up in pictures; default y or z, the longer in the motion, of robots z")
      .as("AXIS")
      .one_of({"x", "y", "z"});
  app.flag("--json", words->json, "summary as JSON");
  app.example("robot.csv --mesh arm=arm.stl --mesh-unit mm -o robot.h5", "poses of a table, then: flexframe render robot.h5");
  app.example("adams.tab --map adams.toml", "columns, units and Euler angles as the mapping file says");
  app.example("robot.urdf joints.csv --angle-unit deg", "a robot by the angles of its joints");
  app.example("CraneModel_res.mat --mesh jib=jib.stl", "a Modelica result: every component with a mass");

  return {app, [words] {
            const imports::Request request = request_of(*words);
            const fs::path out =
                words->out.empty() ? fs::path(words->files.front()).filename().replace_extension(".h5") : fs::path(words->out);
            require_not_read({out}, request.files);
            require_writable_file(out);
            return guarded(request.files, [&] {
              const imports::Imported imported = imports::import_files(request);
              require_not_read({out});  // meshes and what else these files name
              make_folder(fs::absolute(out).parent_path());
              sim::write_results(imported.results, out);
              if (words->json) fmt::print("{}\n", json_text(to_json(imported, out.string())));
              else print_imported(imported, out.string());
              return 0;
            });
          }};
}

}  // namespace flexframe::cli
