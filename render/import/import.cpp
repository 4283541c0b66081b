#include "render/import/import.h"

#include "render/import/arrays.h"
#include "render/import/assemble.h"
#include "render/import/calculix.h"
#include "render/import/mbdyn.h"
#include "render/import/scene_shapes.h"
#include "render/import/surfaces.h"
#include "render/import/urdf.h"
#include "render/import/vtk_series.h"
#include "sim/base/plain_text.h"
#include "sim/base/words.h"
#include "sim/scene/scene_reader.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::imports {
namespace {

namespace fs = std::filesystem;

std::string ending_of(const fs::path& file) {
  std::string ending = file.extension().string();
  ending = sim::plain_lower(ending);
  return ending;
}

Table read_table(const fs::path& file, const TableFormat& format) {
  return ending_of(file) == ".mat" ? read_modelica(file) : read_text_table(file, format);
}

Imported import_tables(const Request& request) {
  std::optional<Mapping> mapping;
  if (!request.mapping.empty()) mapping = read_mapping(request.mapping);
  TableFormat format = mapping ? mapping->format : TableFormat{};
  if (request.step) format.step = request.step;
  std::vector<Table> tables;
  for (const fs::path& file : request.files) tables.push_back(read_table(file, format));
  const Table table = join_tables(std::move(tables));
  if (!mapping) {
    mapping = mapping_by_names(table);
    mapping->length_unit = request.length_unit.value_or(1.0);
    mapping->angle_unit = request.angle_unit.value_or(1.0);
    mapping->units_given = request.length_unit && request.angle_unit;
  } else if (request.length_unit || request.angle_unit) {
    throw InputError(
        fmt::format("{}: units stand in the mapping file's [units]: leave out --length-unit and --angle-unit", request.mapping.string()));
  }
  Imported out{.results = assemble(table, *mapping), .kind = table.kind};
  for (size_t b = 0; b < mapping->bodies.size(); ++b)
    if (mapping->bodies[b].mesh_unit != 1.0) embed_mesh(mapping->bodies[b].mesh_unit, out.results.bodies[b]);
  return out;
}

// The one file of a request; kind completes "one ... is read at a time".
const fs::path& only_file(const Request& request, const char* kind) {
  if (request.files.size() > 1) throw InputError(fmt::format("{}: one {} is read at a time", request.files[1].string(), kind));
  return request.files.front();
}

// One body of moving nodes, named after the file.
Imported import_series(NodalSeries series, const Request& request) {
  Imported out;
  out.kind = series.kind;
  const std::string name = request.files.front().stem().string();
  out.results.title = name;
  out.results.times = series.times;
  out.results.bodies.push_back(to_body(series, name));
  sim::Notes& notes = out.results.statistics.notes;
  notes.tell(series.notes);
  if (!request.length_unit)
    notes.tell("", fmt::format("{} says no unit of length: metres are taken; --length-unit mm says another", series.file));
  if (series.von_mises.size() > 0 && !request.stress_unit)
    notes.tell("", fmt::format("{} says no unit of stress: Pa is taken; --stress-unit MPa says another", series.file));
  return out;
}

Imported import_frd(const Request& request) {
  return import_series(read_frd(only_file(request, ".frd file"), request.length_unit.value_or(1.0), request.stress_unit.value_or(1.0)),
                       request);
}

VtkRequest vtk_request(const Request& request) {
  return {.unit = request.length_unit.value_or(1.0), .stress = request.stress_unit.value_or(1.0), .step = request.step};
}

Imported import_vtk(const Request& request) { return import_series(read_vtk_xml(request.files, vtk_request(request)), request); }

Imported import_vtkhdf(const Request& request) {
  return import_series(read_vtkhdf(only_file(request, ".vtkhdf file"), vtk_request(request)), request);
}

Imported import_npz(const Request& request) {
  const fs::path& file = only_file(request, "NumPy archive");
  return {.results = results_of_arrays(read_npz(file), file.string(), request.length_unit.value_or(1.0)), .kind = "NumPy archive"};
}

constexpr const char* mov_kind = "MBDyn .mov";
Imported import_mov(const Request& request) {
  return {.results = read_mbdyn_mov(only_file(request, ".mov file"), request.step, true), .kind = mov_kind};
}

Imported import_netcdf(const Request& request) {
  return {.results = read_mbdyn_netcdf(only_file(request, "NetCDF file")), .kind = "MBDyn NetCDF"};
}

constexpr const char* urdf_kind = "URDF robot";
Imported import_urdf(const Request& request) {
  if (request.files.size() != 2)
    throw InputError(fmt::format("{}: a robot needs one table of its joints' motion beside it: flexframe import ROBOT.urdf JOINTS.csv",
                                 request.files[0].string()));
  TableFormat format;
  format.step = request.step;
  const Table table = read_text_table(request.files[1], format);
  return {.results = read_urdf(request.files[0], table, request.length_unit.value_or(1.0), request.angle_unit.value_or(1.0)),
          .kind = urdf_kind};
}

// A kind of file that is no table.
struct Kind {
  std::vector<std::string> endings;
  Imported (*read)(const Request& request);
};
const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all{{{".frd"}, import_frd},
                                     {{".vtu", ".vtp", ".pvd"}, import_vtk},
                                     {{".vtkhdf", ".hdf"}, import_vtkhdf},
                                     {{".npz"}, import_npz},
                                     {{".mov"}, import_mov},
                                     {{".nc"}, import_netcdf},
                                     {{".urdf"}, import_urdf}};
  return all;
}

// Names of bodies are names of HDF5 groups: robots and others write "arm/upper".
void replace_slashes(sim::Results& results) {
  for (sim::ResultBody& body : results.bodies) {
    if (body.name.find('/') == std::string::npos) continue;
    std::string name = body.name;
    std::replace(name.begin(), name.end(), '/', '.');
    if (std::any_of(results.bodies.begin(), results.bodies.end(), [&](const sim::ResultBody& other) { return other.name == name; }))
      throw InputError(fmt::format("body {} cannot have a name with '/', and {} is there too", sim::quote(body.name), sim::quote(name)));
    results.statistics.notes.tell(
        "", fmt::format("body {} is called {} here: names of bodies have no '/'", sim::quote(body.name), sim::quote(name)));
    body.name = name;
  }
}

// What points up in pictures where no scene says it. Robots of URDF stand along z (REP 103).
void set_up(const Request& request, const std::string& kind, sim::Results& results) {
  const std::string up = request.up.empty() && kind == urdf_kind ? "z" : request.up;
  if (up.empty() || !results.scene_text.empty()) return;
  results.scene_text = fmt::format("[render]\ncamera = {{ up = [{}] }}\n", up == "x" ? "1, 0, 0" : up == "y" ? "0, 1, 0" : "0, 0, 1");
}

void add_meshes(const Request& request, sim::Results& results) {
  std::vector<std::string> names;
  for (const sim::ResultBody& body : results.bodies) names.push_back(body.name);
  for (const auto& [name, file] : request.meshes) {
    const auto at = std::find(names.begin(), names.end(), name);
    if (at == names.end())
      throw InputError(fmt::format("--mesh names body {}, which the files do not have{}; bodies: {}", sim::quote(name),
                                   sim::did_you_mean(name, names), sim::list_words(names)));
    sim::ResultBody& body = results.bodies[at - names.begin()];
    body.mesh = fs::absolute(file).lexically_normal().string();
    body.surface = {};
    if (request.mesh_unit != 1.0) embed_mesh(request.mesh_unit, body);
    else check_mesh(body.mesh);
  }
}

}  // namespace

Imported import_files(const Request& request) {
  if (request.files.empty()) throw InputError("no file to import");
  if (!request.scene.empty() && !request.up.empty())
    throw InputError(fmt::format("{}: the scene says how it is looked at: leave out --up", request.scene.string()));
  for (const fs::path& file : request.files)
    if (!fs::exists(file)) throw InputError(fmt::format("{}: no such file", file.string()));
  Imported (*read)(const Request&) = import_tables;
  for (const Kind& kind : kinds())
    if (std::find(kind.endings.begin(), kind.endings.end(), ending_of(request.files.front())) != kind.endings.end()) read = kind.read;
  if (read != import_tables && !request.mapping.empty())
    throw InputError(fmt::format("{}: a mapping file is for tables; this file says itself what moves", request.files[0].string()));
  Imported out = read(request);
  replace_slashes(out.results);
  add_meshes(request, out.results);
  if (!request.scene.empty()) dress_by_scene(sim::read_scene(request.scene), out.results);
  set_up(request, out.kind, out.results);
  if (!request.title.empty()) out.results.title = request.title;
  sim::SolverStatistics& statistics = out.results.statistics;
  if (statistics.method.empty()) statistics.method = "another program";
  return out;
}

Imported inspect_file(const std::filesystem::path& file) {
  if (!fs::exists(file)) throw InputError(fmt::format("{}: no such file", file.string()));
  const std::string ending = ending_of(file);
  Request request;
  request.files = {file};
  if (ending == ".vtu" || ending == ".vtp") request.step = 1.0;
  if (ending == ".mov") return {.results = read_mbdyn_mov(file, std::nullopt, false), .kind = mov_kind};
  for (const Kind& kind : kinds())
    if (std::find(kind.endings.begin(), kind.endings.end(), ending) != kind.endings.end() && ending != ".urdf") return kind.read(request);
  Imported out;
  if (ending == ".urdf") {
    // As it stands, every joint at 0.
    Table still;
    still.file = file.string();
    still.times = sim::VecX::Zero(1);
    out.results = read_urdf(file, still, 1.0, 1.0);
    out.kind = urdf_kind;
    return out;
  }
  TableFormat format;
  const Table table = read_table(file, format);
  out.kind = table.kind;
  out.results.title = file.stem().string();
  out.results.times = table.times;
  out.results.statistics.notes.tell(table.notes);
  for (const Column& column : table.columns) {
    const sim::VecX values = column.index < 0 ? sim::VecX::Constant(table.times.size(), column.factor)
                                              : sim::VecX(column.factor * table.values.col(column.index));
    out.results.outputs.push_back({column.name, column.unit, values, column.description});
  }
  return out;
}

std::vector<std::string> file_endings() {
  std::vector<std::string> endings = {".csv", ".txt", ".tab", ".tsv", ".mat"};
  for (const Kind& kind : kinds()) endings.insert(endings.end(), kind.endings.begin(), kind.endings.end());
  std::erase(endings, ".hdf");  // also what others call HDF5
  return endings;
}

}  // namespace flexframe::imports
