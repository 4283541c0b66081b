// flexframe reduce: a finite element model becomes a flexible body (SID or HDF5) with its surface mesh and a report.
#include "render/cli/reduce.h"
#include "render/cli/overwrite.h"

#include "render/cli/cache.h"
#include "render/cli/commands.h"
#include "render/cli/engine.h"
#include "render/cli/jobs.h"
#include "render/cli/json_text.h"
#include "render/cli/terminal.h"
#include "render/import/fe_mesh.h"

#include "sim/base/file_output.h"
#include "sim/base/files_read.h"
#include "sim/base/plain_text.h"
#include "sim/bodies/body_file.h"
#include "sim/bodies/sid.h"
#include "sim/bodies/sid_lack.h"
#include "sim/reduce/reduce_request.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

namespace flexframe::cli {
namespace {

struct ReduceWords {
  sim::ReduceRequest request;
  std::string model, output, mesh, report, mass, node_table, dofs, cache, scratch;
  bool no_stiffening = false, no_cut_off = false, json = false, silent = false, fresh = false;
  double memory = 0.0;
};

std::string report_text(const ReduceWords& w, const sim::Reduction& r) {
  const sim::ReduceReport& p = r.report;
  std::string t = fmt::format(
      "# Reduction of {}\n\n{} nodes, {} elements, {} degrees of freedom, {} rigid motions; factorised matrix of {:.3g} million "
      "entries.\n\n",
      w.model, p.nodes, p.elements, p.degrees_of_freedom, p.rigid_motions, p.factor_entries / 1e6);
  const sim::FlexibleBody& b = r.body;
  const sim::Vec3 centre = b.md0 / b.mass;
  t += fmt::format(
      "mass {:.9g} kg, centre of mass ({:.6g}, {:.6g}, {:.6g}) m, inertia about the origin xx {:.6g} yy {:.6g} zz {:.6g} xy {:.6g} xz "
      "{:.6g} yz {:.6g} kg m^2\n\n",
      b.mass, centre.x(), centre.y(), centre.z(), b.J0(0), b.J0(1), b.J0(2), b.J0(3), b.J0(4), b.J0(5));
  t += fmt::format("{} elastic coordinates, {} nodes, geometric stiffening {}\n\n", b.n, b.nodes.size(),
                   !b.nodes.empty() && b.nodes[0].phi2[0].size() > 0 ? "on" : "off");
  t += "| coordinate | frequency, Hz | error of the mesh, estimated |\n|---|---|---|\n";
  for (int k = 0; k < p.frequencies.size(); ++k)
    t += fmt::format("| {} | {:.3f} | {} |\n", k + 1, p.frequencies(k),
                     k < p.mesh_errors.size() ? fmt::format("{:.2g} %", 100.0 * p.mesh_errors(k)) : "");
  if (p.compliance_error >= 0.0)
    t += fmt::format("\nStatic deflection at the interfaces under unit loads there: largest error against the full model {:.3g} %\n",
                     100.0 * p.compliance_error);
  if (p.right_up_to > 0.0)
    t += fmt::format("\nFree, the body has the full model's frequencies within 0.1 % up to {:.4g} Hz\n", p.right_up_to);
  t += "\n| stage | CPU s |\n|---|---|\n";
  double total = 0.0;
  for (const auto& s : p.stages) {
    t += fmt::format("| {} | {:.2f} |\n", s.name, s.cpu);
    total += s.cpu;
  }
  t += fmt::format("| all | {:.2f} |\n", total);
  for (const std::string& n : p.warnings) t += fmt::format("\nWarning: {}\n", n);
  for (const std::string& n : p.notes) t += fmt::format("\nNote: {}\n", n);
  return t;
}

nlohmann::json summary(const sim::Reduction& r) {
  nlohmann::json j;
  j["mass"] = r.body.mass;
  j["degrees_of_freedom"] = r.report.degrees_of_freedom;
  j["rigid_motions"] = r.report.rigid_motions;
  j["frequencies"] = std::vector<double>(r.report.frequencies.begin(), r.report.frequencies.end());
  j["nodes"] = r.body.nodes.size();
  if (r.report.mesh_errors.size() > 0) j["mesh_errors"] = std::vector<double>(r.report.mesh_errors.begin(), r.report.mesh_errors.end());
  if (r.report.compliance_error >= 0.0) j["static_error"] = r.report.compliance_error;
  for (const auto& s : r.report.stages) j["cpu_seconds"][s.name] = s.cpu;
  j["notes"] = r.report.notes;
  j["warnings"] = r.report.warnings;
  return j;
}

// Whether the body is asked for as HDF5 (else as SID text).
bool as_hdf5(const std::string& output) {
  const std::string ending = sim::plain_lower(std::filesystem::path(output).extension().string());
  return ending == ".h5" || ending == ".hdf5";
}

// All words that decide the body, by name.
nlohmann::ordered_json words_of(const ReduceWords& w) {
  const sim::ReduceRequest& q = w.request;
  const sim::ReduceOptions& o = q.options;
  return {{"mass", w.mass},
          {"node_table", w.node_table},
          {"dofs", w.dofs},
          {"units", q.units},
          {"method", q.method},
          {"hold", q.hold},
          {"interfaces", q.interfaces},
          {"materials", q.materials},
          {"densities", q.densities},
          {"elastics", q.elastics},
          {"nodes", q.nodes},
          {"node_sets", q.node_sets},
          {"contact", q.contact},
          {"thickness", q.thickness},
          {"modes", o.modes},
          {"highest", o.highest},
          {"lowest", o.lowest},
          {"cut_off", o.cut_off},
          {"static_error", o.static_error},
          {"node_count", o.node_count},
          {"stiffening", o.stiffening},
          {"stiffening_forced", o.stiffening_forced},
          {"stress", o.stress},
          {"surface", o.surface},
          {"damping", o.damping},
          {"threads", o.threads},
          {"memory", o.memory_limit}};
}

// Those words, and the program that makes the body. The model's files are looked at when the answer is used.
std::string question_text(const ReduceWords& w) {
  std::error_code error;
  const nlohmann::ordered_json all = {program_fingerprint(), w.model, std::filesystem::current_path(error).string(), words_of(w)};
  const std::vector<std::uint8_t> bytes = nlohmann::ordered_json::to_cbor(all);  // names of files need not be UTF-8
  return {bytes.begin(), bytes.end()};
}

// The body's file as bytes, by way of a file of its own: HDF5 writes to nothing else that is whole or not there.
std::string hdf5_text(const ReduceWords& w, const sim::Reduction& r, const std::string& comment) {
  const std::string words = words_of(w).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  const sim::BodyFile file{.body = r.body,
                           .comment = comment,
                           .surface = r.surface,
                           .origin = {{"model", std::filesystem::path(w.model).filename().string()},
                                      {"model_sha256", sim::sha256_of_file(w.model)},
                                      {"program", program_fingerprint()},
                                      {"request", words}},
                           .notes = {},
                           .further = r.further};
  const std::filesystem::path own = w.output + ".whole";
  sim::write_body(file, own);
  std::ifstream in(own, std::ios::binary);
  std::string bytes = sim::read_rest(in, own);
  in.close();
  std::filesystem::remove(own);
  return bytes;
}

std::string sid_text(const sim::Reduction& r, const std::string& comment) {
  sim::SidFile sid = sim::from_flexible_body(r.body, comment);
  sid.further = r.further;
  return sim::write_sid_text(sid);
}

std::filesystem::path mesh_of(const ReduceWords& w) {
  return w.mesh.empty() ? std::filesystem::path(w.output).replace_extension(".obj") : std::filesystem::path(w.mesh);
}

std::filesystem::path report_of(const ReduceWords& w) {
  return w.report.empty() ? std::filesystem::path(w.output).replace_extension(".md") : std::filesystem::path(w.report);
}

std::vector<std::filesystem::path> folders_of(const ReduceWords& w) {
  std::vector<std::filesystem::path> out;
  for (const std::filesystem::path& file : {std::filesystem::path(w.output), mesh_of(w), report_of(w)})
    out.push_back(std::filesystem::absolute(file).parent_path());
  return out;
}

// Reduces, and keeps what took longer than looking it up.
KeptTexts make(const ReduceWords& w, const KeptWork& work, const std::function<void(const std::string&)>& progress) {
  constexpr double worth = 0.2;  // CPU s
  const sim::FilesRead files;
  const auto [model, r] = sim::reduce(w.request, progress, throw_if_interrupted);
  KeptTexts texts;
  const std::string comment = sim::reduced_comment(std::filesystem::path(w.model).filename().string(), r.report.lacks);
  texts["body"] = as_hdf5(w.output) ? hdf5_text(w, r, comment) : sid_text(r, comment);
  texts["obj"] = sim::surface_obj(model);
  texts["report"] = report_text(w, r);
  texts["json"] = summary(r).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  double cpu = 0.0;
  for (const auto& stage : r.report.stages) cpu += stage.cpu;
  if (cpu > worth || !w.cache.empty()) work.keep(texts, files.files());
  return texts;
}

int run(ReduceWords& w) {
  sim::ReduceRequest& request = w.request;
  request.model = w.model;
  request.mass = w.mass;
  request.node_table = w.node_table;
  request.dofs = w.dofs;
  request.options.stiffening = !w.no_stiffening;
  if (w.no_cut_off) request.options.cut_off = 0.0;
  request.options.memory_limit = 1e9 * w.memory;
  request.options.scratch = w.scratch;
  request.options.surface = as_hdf5(w.output);
  request.further_reader = imports::read_fe_mesh;
  request.further_endings = {".med", ".vtu"};
  const auto progress = [&](const std::string& text) {
    if (!w.silent && verbosity() != Verbosity::quiet) fmt::print(stderr, "{}\n", text);
  };
  for (const std::filesystem::path& folder : folders_of(w)) require_writable(folder);
  require_not_read({w.output, mesh_of(w), report_of(w)}, {w.model, w.mass, w.node_table, w.dofs});
  const KeptWork work(w.silent ? std::filesystem::path() : cache_folder(w.cache), "body", question_text(w));
  std::optional<KeptTexts> made = w.fresh ? std::nullopt : work.read();
  const bool found = made.has_value();
  if (found) progress(fmt::format("note: this reduction was made before and is kept in {}; --fresh makes it anew", work.file().string()));
  else made = make(w, work, progress);
  KeptTexts& texts = *made;
  nlohmann::json j = nlohmann::json::parse(texts["json"]);
  for (const std::string& n : j["warnings"].get<std::vector<std::string>>()) fmt::print(stderr, "warning: {}\n", n);
  for (const std::string& n : j["notes"].get<std::vector<std::string>>()) progress("note: " + n);
  require_not_read({w.output, mesh_of(w), report_of(w)});  // what the model includes
  for (const std::filesystem::path& folder : folders_of(w)) make_folder(folder);
  sim::write_whole_file(w.output, texts["body"]);
  if (texts["obj"].find("\nf ") != std::string::npos) sim::write_whole_file(mesh_of(w), texts["obj"]);
  sim::write_whole_file(report_of(w), texts["report"]);
  if (w.silent) return 0;
  if (w.json) {
    j["body"] = w.output;
    j["kept"] = found;
    fmt::print("{}\n", json_text(j));
  } else if (verbosity() != Verbosity::quiet) {
    fmt::print("{}", texts["report"]);
  }
  return 0;
}

}  // namespace

void reduce_model(const std::string& model, const std::string& sid, const std::vector<std::string>& interfaces, int modes, double damping) {
  ReduceWords w;
  w.model = model;
  w.output = sid;
  w.request.interfaces = interfaces;
  w.request.options.modes = modes;
  w.request.options.damping = damping;
  w.silent = true;
  run(w);
}

Command add_reduce(Program& program) {
  const auto w = std::make_shared<ReduceWords>();
  Subcommand app = program.subcommand("reduce", "make a flexible body (SID) from a finite element model");
  app.option("MODEL", w->model,
             "Abaqus or CalculiX .inp, Nastran .bdf .nas .dat, gmsh .msh, Salome .med, VTK .vtu, CalculiX .sti (with .mas .dof .inp beside "
             "it), "
             "Matrix Market .mtx")
      .required();
  app.option("-o,--out,--output", w->output,
             "the body, BODY.sid, or BODY.h5 with its shapes at all nodes of the surface; BODY.obj and BODY.md come with it")
      .as("FILE")
      .required();
  app.option("--mesh", w->mesh, "name of the surface mesh").as("FILE");
  app.option("--report", w->report, "name of the report").as("FILE");
  app.option("--method", w->request.method, "auto (craig-bampton with interfaces, else eigen), eigen, guyan, craig-bampton or response")
      .as("WORD")
      .one_of({"auto", "eigen", "guyan", "craig-bampton", "response"})
      .show_default();
  app.option("--modes", w->request.options.modes, "number of modes (with interfaces held for craig-bampton)").not_negative().show_default();
  app.option("--highest", w->request.options.highest, "highest frequency of interest, Hz: all modes up to it").positive();
  app.option("--lowest", w->request.options.lowest, "lowest frequency of interest, Hz (response: loads act at half of it)").positive();
  app.option("--cut-off", w->request.options.cut_off,
             "drop modes of the reduced model above this factor times --highest, except those needed for the static deflection at the "
             "interfaces")
      .positive()
      .show_default();
  app.flag("--no-cut-off", w->no_cut_off, "drop none");
  app.option("--static-error", w->request.options.static_error,
             "largest error of the static deflection at the interfaces that the cut-off may cause; 1: no limit")
      .range(0.0, 1.0)
      .show_default();
  app.option("--interface", w->request.interfaces,
             "[NAME=]NODE, a spider's name, [NAME=]rigid:SET[@x,y,z] or [NAME=]average:SET[@x,y,z], x y z in m; may be repeated")
      .as("WHERE");
  app.option("--hold", w->request.hold, "'model' (*BOUNDARY), 'none', or a node set; default: the model's if it has any")
      .as("NAME")
      .show_default();
  app.option("--nodes", w->request.options.node_count, "number of kept nodes, distributed over the surface, interfaces included")
      .range(1, 1000000)
      .show_default();
  app.option("--node", w->request.nodes, "keep these nodes instead").as("LIST").list(Option::is_number).separated_by(',');
  app.option("--node-set", w->request.node_sets, "keep the nodes of this set instead; may be repeated").as("NAME");
  app.option("--material", w->request.materials, "[SET=]YOUNGS_MODULUS,POISSON,DENSITY in SI, for elements without one; may be repeated")
      .as("VALUES");
  app.option("--thickness", w->request.thickness, "thickness of shells without one, m").positive();
  app.option("--contact", w->request.contact,
             "contact pairs of an .inp, which no linear body has: 'tie' their surfaces, leave them 'open', or 'refuse' the deck")
      .as("WORD")
      .show_default();
  app.option("--density", w->request.densities, "[MATERIAL=]DENSITY in kg/m^3, for materials without one; may be repeated").as("VALUE");
  app.option("--elastic", w->request.elastics, "[MATERIAL=]YOUNGS_MODULUS,POISSON in SI, for materials without elasticity; may be repeated")
      .as("VALUES");
  app.option("--units", w->request.units,
             "units of the model: m (m kg s), mm (mm t s, MPa), mm-kg-s, mm-kg-ms, mm-g-ms, cm-g-s, in-lbf-s, or factors LENGTH,MASS,TIME "
             "to SI")
      .as("UNITS")
      .show_default();
  app.option("--damping", w->request.options.damping, "ratio of critical damping of every mode").not_negative();
  app.flag("--no-stiffening", w->no_stiffening, "no second-order displacements (geometric stiffening)");
  app.flag("--force-stiffening", w->request.options.stiffening_forced,
           "second-order displacements at all nodes, however many modes there are");
  app.flag("--stress", w->request.options.stress, "also compute the stress of each mode at the kept nodes");
  app.option("--mass", w->mass, "mass matrix (.mtx) beside a stiffness matrix").as("FILE");
  app.option("--node-table", w->node_table, "nodes of a model given as matrices: 'id x y z' per line, or an .inp").as("FILE");
  app.option("--dofs", w->dofs, "degrees of freedom of a model given as matrices: 'node.dof' per line").as("FILE");
  app.option("--threads", w->request.options.threads, "threads of the dense matrix routines: more take less time, but more CPU time in all")
      .range(1, 1024)
      .show_default();
  app.option("--memory", w->memory, "memory limit in GB; default: the free memory").positive();
  app.option("--scratch", w->scratch, "folder that keeps the factor of the stiffness matrix, for models beyond the memory").as("DIR");
  app.option("--cache", w->cache, cache_help).as("DIR").environment("FLEXFRAME_CACHE");
  app.flag("--fresh", w->fresh, "make it anew, though it was made before and is kept in the cache");
  app.flag("--json", w->json, "print a machine-readable summary");
  app.example("part.inp -o part.sid --modes 20 --interface pin=1001 --interface eye=rigid:HOLE", "a body with two interfaces");
  app.example("part.inp -o part.h5 --stress", "the same as one binary file, for pictures that show the elements' own motion and stress");
  app.example("part.msh --material 2.1e11,0.3,7850 --units mm -o part.sid", "a mesh without material, in millimetres");
  return {app, [w] { return run(*w); }};
}

}  // namespace flexframe::cli
