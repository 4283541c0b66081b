// flexframe reduce: a finite element model becomes a flexible body (SID) with its surface mesh and a report.
#include "render/cli/reduce.h"

#include "render/cli/commands.h"
#include "render/cli/terminal.h"

#include "sim/base/file_output.h"
#include "sim/bodies/sid.h"
#include "sim/reduce/reduce.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <memory>

namespace flexframe::cli {
namespace {

struct Words {
  std::string model, output, mesh, report, mass, nodes_file, dofs, method = "auto", units = "m";
  std::vector<std::string> materials, densities, elastics, interfaces, node_sets;
  std::vector<int> nodes;
  std::string hold = "auto";
  double thickness = 0.0;
  bool no_stiffening = false, force_stiffening = false, no_cut_off = false, json = false, silent = false;
  double memory = 0.0;
  sim::ReduceOptions options;
};

std::string upper(std::string s) {
  for (char& c : s) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return s;
}

// A system of units by name, or its three factors to SI: length, mass, time.
sim::FeUnits units_of(const std::string& text) {
  if (const auto known = sim::units_named(text)) return *known;
  sim::FeUnits u;
  double* const factors[] = {&u.length, &u.mass, &u.time};
  const char* at = text.c_str();
  for (int i = 0; i < 3; ++i) {
    char* end = nullptr;
    *factors[i] = std::strtod(at, &end);
    if (end == at || (i < 2 ? *end != ',' : *end != '\0') || !(*factors[i] > 0.0) || !std::isfinite(*factors[i]))
      throw UsageError(
          fmt::format("--units '{}': m, mm, mm-kg-s, mm-kg-ms, mm-g-ms, cm-g-s, in-lbf-s, or the factors LENGTH,MASS,TIME to SI are "
                      "expected",
                      text));
    at = end + 1;
  }
  return u;
}

// "[NAME=]NUMBER,..." of `count` numbers.
std::pair<std::string, std::vector<double>> named_numbers(const std::string& option, const std::string& text, int count) {
  const size_t equals = text.rfind('=');
  std::vector<double> out;
  const std::string numbers = text.substr(equals == std::string::npos ? 0 : equals + 1);
  const char* at = numbers.c_str();
  for (int i = 0; i < count; ++i) {
    char* end = nullptr;
    out.push_back(std::strtod(at, &end));
    if (end == at || (i + 1 < count ? *end != ',' : *end != '\0') || !std::isfinite(out.back()))
      throw UsageError(fmt::format("{} '{}': [MATERIAL=]{} is expected", option, text, count == 1 ? "DENSITY" : "YOUNGS_MODULUS,POISSON"));
    at = end + 1;
  }
  return {equals == std::string::npos ? "" : text.substr(0, equals), out};
}

// "E,nu,rho" or "SET=E,nu,rho", in SI.
void apply_material(sim::FeModel& model, const std::string& text) {
  const size_t equals = text.find('=');
  const std::string set = equals == std::string::npos ? "" : upper(text.substr(0, equals));
  sim::FeMaterial m;
  m.name = set.empty() ? "--material" : set;
  double* const values[] = {&m.youngs_modulus, &m.poisson, &m.density};
  const std::string numbers = text.substr(equals == std::string::npos ? 0 : equals + 1);
  const char* at = numbers.c_str();
  for (int i = 0; i < 3; ++i) {
    char* end = nullptr;
    *values[i] = std::strtod(at, &end);
    if (end == at || (i < 2 ? *end != ',' : *end != '\0'))
      throw UsageError(fmt::format("--material '{}': [SET=]YOUNGS_MODULUS,POISSON,DENSITY in SI is expected", text));
    at = end + 1;
  }
  sim::set_material(model, m, set);
}

int node_of(const sim::FeModel& model, const std::string& text) {
  char* end = nullptr;
  const long id = std::strtol(text.c_str(), &end, 10);
  if (text.empty() || *end) throw UsageError(fmt::format("'{}' is not a node number", text));
  const auto at = std::find(model.node_ids.begin(), model.node_ids.end(), static_cast<int>(id));
  if (at == model.node_ids.end()) throw sim::InputError(fmt::format("{}: node {} is not there", model.file, id));
  return static_cast<int>(at - model.node_ids.begin());
}

const std::vector<int>& set_of(const sim::FeModel& model, const std::string& name) {
  const auto at = model.node_sets.find(upper(name));
  if (at != model.node_sets.end()) return at->second;
  std::string names;
  for (const auto& [set, members] : model.node_sets) names += (names.empty() ? "" : ", ") + set;
  throw sim::InputError(fmt::format("{}: node set '{}' is not there; there are: {}", model.file, name, names.empty() ? "none" : names));
}

// "[NAME=]NODE", "[NAME=]SPIDER" or "[NAME=]rigid:SET[@x,y,z]", "[NAME=]average:SET[@x,y,z]".
sim::ReduceInterface interface_of(sim::FeModel& model, const std::string& text) {
  sim::ReduceInterface out;
  std::string what = text;
  if (const size_t equals = text.find('='); equals != std::string::npos) {
    out.name = text.substr(0, equals);
    what = text.substr(equals + 1);
  }
  const size_t colon = what.find(':');
  if (colon != std::string::npos) {
    const std::string kind = what.substr(0, colon);
    if (kind != "rigid" && kind != "average") throw UsageError(fmt::format("--interface '{}': rigid:SET or average:SET is expected", text));
    const size_t place = what.find('@', colon);
    const std::string set = what.substr(colon + 1, place == std::string::npos ? place : place - colon - 1);
    sim::FeSpider spider;
    spider.name = out.name.empty() ? set : out.name;
    spider.rigid = kind == "rigid";
    spider.slaves = set_of(model, set);
    if (spider.slaves.empty()) throw sim::InputError(fmt::format("{}: node set '{}' is empty", model.file, set));
    sim::Vec3 centre = sim::Vec3::Zero();
    if (place == std::string::npos) {
      sim::Vec3 lower = model.nodes[spider.slaves[0]], upper_corner = lower;
      for (int n : spider.slaves) {
        lower = lower.cwiseMin(model.nodes[n]);
        upper_corner = upper_corner.cwiseMax(model.nodes[n]);
      }
      centre = 0.5 * (lower + upper_corner);
    } else {
      const char* at = what.c_str() + place + 1;
      for (int d = 0; d < 3; ++d) {
        char* end = nullptr;
        centre(d) = std::strtod(at, &end);
        if (end == at || (d < 2 ? *end != ',' : *end != '\0'))
          throw UsageError(fmt::format("--interface '{}': @x,y,z in metres is expected", text));
        at = end + 1;
      }
    }
    spider.node = static_cast<int>(model.nodes.size());
    model.node_ids.push_back(*std::max_element(model.node_ids.begin(), model.node_ids.end()) + 1);
    model.nodes.push_back(centre);
    out.spider = static_cast<int>(model.spiders.size());
    model.spiders.push_back(std::move(spider));
    return out;
  }
  for (size_t i = 0; i < model.spiders.size(); ++i)
    if (model.spiders[i].name == upper(what)) out.spider = static_cast<int>(i);
  if (out.spider >= 0) return out;
  out.node = node_of(model, what);
  for (size_t i = 0; i < model.spiders.size(); ++i)
    if (model.spiders[i].node == out.node) {
      out.spider = static_cast<int>(i);
      out.node = -1;
    }
  return out;
}

sim::FeModel read_model(const Words& w) {
  const sim::FeUnits units = units_of(w.units);
  std::filesystem::path path = w.model;
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (ending == ".inp") return sim::read_inp(path, units);
  if (ending == ".msh") return sim::read_msh(path, units);
  if (ending == ".bdf" || ending == ".nas" || ending == ".dat") return sim::read_nastran(path, units);
  if (ending == ".sti" || ending == ".mtx") {
    std::filesystem::path mass = w.mass, dofs = w.dofs, nodes = w.nodes_file;
    if (ending == ".sti") {
      if (mass.empty()) mass = std::filesystem::path(path).replace_extension(".mas");
      if (dofs.empty()) dofs = std::filesystem::path(path).replace_extension(".dof");
      if (nodes.empty()) nodes = std::filesystem::path(path).replace_extension(".inp");
    }
    if (mass.empty() || nodes.empty()) throw UsageError("a stiffness matrix needs --mass M.mtx and --node-table FILE");
    return sim::read_fe_matrices(path, mass, nodes, dofs, units);
  }
  throw sim::InputError(
      fmt::format("{}: '{}' is no known kind of model: .inp (Abaqus, CalculiX), .bdf .nas .dat (Nastran), .msh (gmsh), .sti (CalculiX "
                  "matrices), .mtx (Matrix "
                  "Market) can be read",
                  w.model, ending));
}

std::string report_text(const Words& w, const sim::Reduction& r) {
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
  t += "| coordinate | frequency, Hz |\n|---|---|\n";
  for (int k = 0; k < p.frequencies.size(); ++k) t += fmt::format("| {} | {:.3f} |\n", k + 1, p.frequencies(k));
  if (p.compliance_error >= 0.0)
    t += fmt::format("\nStatic deflection at the interfaces under unit loads there: largest error against the full model {:.3g} %\n",
                     100.0 * p.compliance_error);
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

int run(Words& w) {
  sim::FeModel model = read_model(w);
  for (const std::string& m : w.materials) apply_material(model, m);
  for (const std::string& d : w.densities) {
    const auto [name, numbers] = named_numbers("--density", d, 1);
    sim::complete_density(model, name, numbers[0]);
  }
  for (const std::string& e : w.elastics) {
    const auto [name, numbers] = named_numbers("--elastic", e, 2);
    sim::complete_elasticity(model, name, numbers[0], numbers[1]);
  }
  for (std::string& text : sim::unit_warnings(model, units_of(w.units))) model.warnings.push_back(std::move(text));
  if (w.thickness > 0.0)
    for (sim::FeElement& e : model.elements)
      if (sim::fe_is_shell(e.shape) && !(e.thickness > 0.0)) e.thickness = w.thickness;
  sim::ReduceOptions& o = w.options;
  o.method = w.method == "auto"            ? sim::ReduceMethod::automatic
             : w.method == "guyan"         ? sim::ReduceMethod::guyan
             : w.method == "craig-bampton" ? sim::ReduceMethod::craig_bampton
             : w.method == "response"      ? sim::ReduceMethod::response
                                           : sim::ReduceMethod::eigenmodes;
  for (const std::string& i : w.interfaces) o.interfaces.push_back(interface_of(model, i));
  for (int id : w.nodes) o.nodes.push_back(node_of(model, fmt::format("{}", id)));
  for (const std::string& s : w.node_sets)
    for (int n : set_of(model, s)) o.nodes.push_back(n);
  std::string held_note;
  if (w.hold == "auto" || w.hold == "model") {
    o.held = model.constraints;
    if (!o.held.empty())
      held_note = fmt::format("held by the model's *BOUNDARY ({} motions); --hold none leaves the body free", o.held.size());
  } else if (w.hold != "none") {
    for (int n : set_of(model, w.hold))
      for (int d = 0; d < 6; ++d) o.held.push_back({n, d});
  }
  o.stiffening = !w.no_stiffening;
  o.stiffening_forced = w.force_stiffening;
  if (w.no_cut_off) o.cut_off = 0.0;
  o.memory_limit = 1e9 * w.memory;
  const auto progress = [&](const std::string& text) {
    if (!w.silent && verbosity() != Verbosity::quiet) fmt::print(stderr, "{}\n", text);
  };
  sim::Reduction r = sim::reduce(model, o, progress);
  if (!held_note.empty()) r.report.notes.insert(r.report.notes.begin(), held_note);
  for (const std::string& n : r.report.warnings) fmt::print(stderr, "warning: {}\n", n);
  for (const std::string& n : r.report.notes) progress("note: " + n);
  sim::write_sid(
      sim::from_flexible_body(r.body, fmt::format("made by flexframe reduce from {}", std::filesystem::path(w.model).filename().string())),
      w.output);
  const std::filesystem::path base = w.output;
  const std::string mesh = w.mesh.empty() ? std::filesystem::path(base).replace_extension(".obj").string() : w.mesh;
  const std::string report = w.report.empty() ? std::filesystem::path(base).replace_extension(".md").string() : w.report;
  if (const std::string surface = sim::surface_obj(model); surface.find("\nf ") != std::string::npos) sim::write_whole_file(mesh, surface);
  sim::write_whole_file(report, report_text(w, r));
  if (w.silent) return 0;
  if (w.json) {
    nlohmann::json j;
    j["body"] = w.output;
    j["mass"] = r.body.mass;
    j["degrees_of_freedom"] = r.report.degrees_of_freedom;
    j["rigid_motions"] = r.report.rigid_motions;
    j["frequencies"] = std::vector<double>(r.report.frequencies.begin(), r.report.frequencies.end());
    j["nodes"] = r.body.nodes.size();
    if (r.report.compliance_error >= 0.0) j["static_error"] = r.report.compliance_error;
    for (const auto& s : r.report.stages) j["cpu_seconds"][s.name] = s.cpu;
    j["notes"] = r.report.notes;
    j["warnings"] = r.report.warnings;
    fmt::print("{}\n", j.dump(2));
  } else if (verbosity() != Verbosity::quiet) {
    fmt::print("{}", report_text(w, r));
  }
  return 0;
}

}  // namespace

void reduce_model(const std::string& model, const std::string& sid, const std::vector<std::string>& interfaces, int modes, double damping) {
  Words w;
  w.model = model;
  w.output = sid;
  w.interfaces = interfaces;
  w.options.modes = modes;
  w.options.damping = damping;
  w.silent = true;
  run(w);
}

Command add_reduce(Program& program) {
  const auto w = std::make_shared<Words>();
  Subcommand app = program.subcommand("reduce", "make a flexible body (SID) from a finite element model");
  app.option(
         "MODEL", w->model,
         "Abaqus or CalculiX .inp, Nastran .bdf .nas .dat, gmsh .msh, CalculiX .sti (with .mas .dof .inp beside it), Matrix Market .mtx")
      .required();
  app.option("-o,--output", w->output, "the body, BODY.sid; BODY.obj and BODY.md come with it").as("FILE").required();
  app.option("--mesh", w->mesh, "name of the surface mesh").as("FILE");
  app.option("--report", w->report, "name of the report").as("FILE");
  app.option("--method", w->method, "auto (craig-bampton with interfaces, else eigen), eigen, guyan, craig-bampton or response")
      .one_of({"auto", "eigen", "guyan", "craig-bampton", "response"})
      .show_default();
  app.option("--modes", w->options.modes, "number of modes (with interfaces held for craig-bampton)").not_negative().show_default();
  app.option("--highest", w->options.highest, "highest frequency of interest, Hz: all modes up to it").positive();
  app.option("--lowest", w->options.lowest, "lowest frequency of interest, Hz (response: loads act at half of it)").positive();
  app.option("--cut-off", w->options.cut_off,
             "drop modes of the reduced model above this factor times --highest, except those needed for the static deflection at the "
             "interfaces")
      .positive()
      .show_default();
  app.flag("--no-cut-off", w->no_cut_off, "drop none");
  app.option("--static-error", w->options.static_error,
             "largest error of the static deflection at the interfaces that the cut-off may cause; 1: no limit")
      .range(0.0, 1.0)
      .show_default();
  app.option("--interface", w->interfaces,
             "[NAME=]NODE, a spider's name, [NAME=]rigid:SET[@x,y,z] or [NAME=]average:SET[@x,y,z]; may be repeated");
  app.option("--hold", w->hold, "'model' (*BOUNDARY), 'none', or a node set; default: the model's if it has any").show_default();
  app.option("--nodes", w->options.node_count, "number of kept nodes, distributed over the surface, interfaces included")
      .range(1, 1000000)
      .show_default();
  app.option("--node", w->nodes, "keep these nodes instead").as("LIST").list(Option::is_number).separated_by(',');
  app.option("--node-set", w->node_sets, "keep the nodes of this set instead; may be repeated");
  app.option("--material", w->materials, "[SET=]YOUNGS_MODULUS,POISSON,DENSITY in SI, for elements without one; may be repeated");
  app.option("--thickness", w->thickness, "thickness of shells without one, m").positive();
  app.option("--density", w->densities, "[MATERIAL=]DENSITY in kg/m^3, for materials without one; may be repeated");
  app.option("--elastic", w->elastics, "[MATERIAL=]YOUNGS_MODULUS,POISSON in SI, for materials without elasticity; may be repeated");
  app.option("--units", w->units,
             "units of the model: m (m kg s), mm (mm t s, MPa), mm-kg-s, mm-kg-ms, mm-g-ms, cm-g-s, in-lbf-s, or factors LENGTH,MASS,TIME "
             "to SI")
      .show_default();
  app.option("--damping", w->options.damping, "ratio of critical damping of every mode").not_negative();
  app.flag("--no-stiffening", w->no_stiffening, "no second-order displacements (geometric stiffening)");
  app.flag("--force-stiffening", w->force_stiffening, "second-order displacements at all nodes, however many modes there are");
  app.flag("--stress", w->options.stress, "also compute the stress of each mode at the kept nodes");
  app.option("--mass", w->mass, "mass matrix (.mtx) beside a stiffness matrix").as("FILE");
  app.option("--node-table", w->nodes_file, "nodes of a model given as matrices: 'id x y z' per line, or an .inp").as("FILE");
  app.option("--dofs", w->dofs, "degrees of freedom of a model given as matrices: 'node.dof' per line").as("FILE");
  app.option("--threads", w->options.threads, "threads of the dense matrix routines: more take less time, but more CPU time in all")
      .range(1, 1024)
      .show_default();
  app.option("--memory", w->memory, "memory limit in GB; default: the free memory").positive();
  app.flag("--json", w->json, "print a machine-readable summary");
  app.example("part.inp -o part.sid --modes 20 --interface pin=1001 --interface eye=rigid:HOLE", "a body with two interfaces");
  app.example("part.msh --material 2.1e11,0.3,7850 --units mm -o part.sid", "a mesh without material, in millimetres");
  return {app, [w] { return run(*w); }};
}

}  // namespace flexframe::cli
