// Words for a reduction. See reduce_request.h.
#include "sim/reduce/reduce_request.h"

#include "sim/base/plain_text.h"
#include "sim/base/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace flexframe::sim {
namespace {

std::string upper(std::string s) {
  for (char& c : s) c = plain_upper(c);
  return s;
}

// `count` numbers with commas between; nullopt for anything else.
std::optional<std::vector<double>> numbers_of(const std::string& text, int count) {
  std::vector<double> out;
  const char* at = text.c_str();
  for (int i = 0; i < count; ++i) {
    const char* end = nullptr;
    out.push_back(leading_number(at, &end));
    if (end == at || (i + 1 < count ? *end != ',' : *end != '\0') || !std::isfinite(out.back())) return std::nullopt;
    at = end + 1;
  }
  return out;
}

// A system of units by name, or its three factors to SI: length, mass, time.
FeUnits units_of(const std::string& text) {
  if (const auto known = units_named(text)) return *known;
  const auto factors = numbers_of(text, 3);
  if (!factors || *std::min_element(factors->begin(), factors->end()) <= 0.0)
    throw InputError(fmt::format(
        "units '{}': m, mm, mm-kg-s, mm-kg-ms, mm-g-ms, cm-g-s, in-lbf-s, or the factors LENGTH,MASS,TIME to SI are expected", text));
  return {(*factors)[0], (*factors)[1], (*factors)[2]};
}

ReduceMethod method_of(const std::string& word) {
  const std::vector<std::string> words{"auto", "eigen", "guyan", "craig-bampton", "response"};  // in the order of ReduceMethod
  const auto found = std::find(words.begin(), words.end(), word);
  if (found == words.end())
    throw InputError(fmt::format("method {} is unknown{}; allowed: {}", quote(word), did_you_mean(word, words), list_words(words)));
  return static_cast<ReduceMethod>(found - words.begin());
}

// "[NAME=]NUMBER,..." of `count` numbers; `form` says what they are.
std::pair<std::string, std::vector<double>> named_numbers(const char* what, const std::string& text, int count, const char* form) {
  const auto equals = text.rfind('=');
  const auto numbers = numbers_of(text.substr(equals == std::string::npos ? 0 : equals + 1), count);
  if (!numbers) throw InputError(fmt::format("{} '{}': {} in SI is expected", what, text, form));
  return {equals == std::string::npos ? "" : text.substr(0, equals), *numbers};
}

void complete_materials(FeModel& model, const ReduceRequest& request) {
  for (const std::string& text : request.materials) {
    const auto [set, numbers] = named_numbers("material", text, 3, "[SET=]YOUNGS_MODULUS,POISSON,DENSITY");
    FeMaterial m;
    m.name = set.empty() ? "--material" : upper(set);
    m.youngs_modulus = numbers[0];
    m.poisson = numbers[1];
    m.density = numbers[2];
    set_material(model, m, upper(set));
  }
  for (const std::string& text : request.densities) {
    const auto [name, numbers] = named_numbers("density", text, 1, "[MATERIAL=]DENSITY");
    complete_density(model, name, numbers[0]);
  }
  for (const std::string& text : request.elastics) {
    const auto [name, numbers] = named_numbers("elastic", text, 2, "[MATERIAL=]YOUNGS_MODULUS,POISSON");
    complete_elasticity(model, name, numbers[0], numbers[1]);
  }
  if (!(request.thickness > 0.0)) return;
  for (FeElement& e : model.elements)
    if (fe_is_shell(e.shape) && !(e.thickness > 0.0)) e.thickness = request.thickness;
}

int node_of(const FeModel& model, const std::string& text) {
  char* end = nullptr;
  const long id = std::strtol(text.c_str(), &end, 10);
  if (text.empty() || *end) throw InputError(fmt::format("{}: '{}' is neither a node number nor a spider", model.file, text));
  const auto at = std::find(model.node_ids.begin(), model.node_ids.end(), static_cast<int>(id));
  if (at == model.node_ids.end()) throw InputError(fmt::format("{}: node {} is not there", model.file, id));
  return static_cast<int>(at - model.node_ids.begin());
}

const std::vector<int>& set_of(const FeModel& model, const std::string& name) {
  const auto at = model.node_sets.find(upper(name));
  if (at != model.node_sets.end()) return at->second;
  std::string names;
  for (const auto& [set, members] : model.node_sets) names += (names.empty() ? "" : ", ") + set;
  throw InputError(fmt::format("{}: node set '{}' is not there; there are: {}", model.file, name, names.empty() ? "none" : names));
}

// The middle of the box about some nodes, m.
Vec3 middle(const FeModel& model, const std::vector<int>& nodes) {
  Vec3 lower = model.nodes[nodes[0]], higher = lower;
  for (int n : nodes) {
    lower = lower.cwiseMin(model.nodes[n]);
    higher = higher.cwiseMax(model.nodes[n]);
  }
  return 0.5 * (lower + higher);
}

// A place so many times the model's size away from the nodes that it moves is given in the model's units, as a rule.
constexpr double far_away = 10.0;
void warn_of_far_place(FeModel& model, const std::string& text, double distance) {
  Vec3 lower = model.nodes[0], higher = lower;
  for (const Vec3& p : model.nodes) lower = lower.cwiseMin(p), higher = higher.cwiseMax(p);
  const double diagonal = (higher - lower).norm();
  if (distance <= far_away * diagonal) return;
  model.warnings.push_back(
      fmt::format("interface '{}': its place is {:.3g} m from the nodes that it moves, {:.2g} times the size of the model "
                  "({:.3g} m); @x,y,z are in metres, whatever the units of the model",
                  text, distance, distance / diagonal, diagonal));
}

// "rigid:SET[@x,y,z]" or "average:SET[@x,y,z]": a new spider with a new reference node; its index.
int add_spider(FeModel& model, const std::string& name, const std::string& what, const std::string& text) {
  const auto colon = what.find(':'), place = what.find('@', colon);
  const std::string kind = what.substr(0, colon);
  if (kind != "rigid" && kind != "average") throw InputError(fmt::format("interface '{}': rigid:SET or average:SET is expected", text));
  const std::string set = what.substr(colon + 1, place == std::string::npos ? place : place - colon - 1);
  FeSpider spider;
  spider.name = name.empty() ? set : name;
  spider.rigid = kind == "rigid";
  spider.slaves = set_of(model, set);
  if (spider.slaves.empty()) throw InputError(fmt::format("{}: node set '{}' is empty", model.file, set));
  Vec3 centre = middle(model, spider.slaves);
  if (place != std::string::npos) {
    const auto given = numbers_of(what.substr(place + 1), 3);
    if (!given) throw InputError(fmt::format("interface '{}': @x,y,z in metres is expected", text));
    const Vec3 place_given((*given)[0], (*given)[1], (*given)[2]);
    warn_of_far_place(model, text, (place_given - centre).norm());
    centre = place_given;
  }
  spider.node = static_cast<int>(model.nodes.size());
  model.node_ids.push_back(*std::max_element(model.node_ids.begin(), model.node_ids.end()) + 1);
  model.nodes.push_back(centre);
  model.spiders.push_back(std::move(spider));
  return static_cast<int>(model.spiders.size()) - 1;
}

ReduceInterface interface_of(FeModel& model, const std::string& text) {
  ReduceInterface out;
  std::string what = text;
  if (const auto equals = text.find('='); equals != std::string::npos) {
    out.name = text.substr(0, equals);
    what = text.substr(equals + 1);
  }
  if (what.find(':') != std::string::npos) {
    out.spider = add_spider(model, out.name, what, text);
    return out;
  }
  const int spiders = static_cast<int>(model.spiders.size());
  for (int i = 0; i < spiders; ++i)
    if (model.spiders[i].name == upper(what)) out.spider = i;
  if (out.spider >= 0) return out;
  out.node = node_of(model, what);
  for (int i = 0; i < spiders; ++i)
    if (model.spiders[i].node == out.node) {
      out.spider = i;
      out.node = -1;
    }
  return out;
}

FeModel read_matrices(const ReduceRequest& request, const std::string& ending, const FeUnits& units) {
  std::filesystem::path mass = request.mass, dofs = request.dofs, nodes = request.node_table;
  if (ending == ".sti") {
    const auto beside = [&](const char* other) { return std::filesystem::path(request.model).replace_extension(other); };
    if (mass.empty()) mass = beside(".mas");
    if (dofs.empty()) dofs = beside(".dof");
    if (nodes.empty()) nodes = beside(".inp");
  }
  if (mass.empty() || nodes.empty())
    throw InputError(fmt::format("{}: a stiffness matrix needs a mass matrix (mass) and a table of nodes (node-table) beside it",
                                 request.model.string()));
  return read_fe_matrices(request.model, mass, nodes, dofs, units);
}

FeContact contact_of(const std::string& word) {
  if (word == "refuse") return FeContact::refuse;
  if (word == "tie") return FeContact::tie;
  if (word == "open") return FeContact::open;
  throw InputError(fmt::format("contact {} is unknown; allowed: refuse, tie, open", quote(word)));
}

// What to do with a model of another kind.
std::string way_from(const std::string& ending) {
  static const std::map<std::string, const char*> ways = {
      {".unv", "Of an I-DEAS file gmsh makes a mesh: gmsh -0 FILE.unv -format msh41 -o FILE.msh; materials come with --material"},
      {".vtk", "Save it as .vtu (ParaView, meshio); materials come with --material"},
      {".cdb", "Of an Ansys model save the mesh as .vtu (PyVista), or K and M as .mtx"},
      {".rad", "Of a Radioss or LS-DYNA deck write one of Abaqus or Nastran in the preprocessor"},
      {".k", "Of a Radioss or LS-DYNA deck write one of Abaqus or Nastran in the preprocessor"},
      {".key", "Of a Radioss or LS-DYNA deck write one of Abaqus or Nastran in the preprocessor"},
      {".fem", "A deck of OptiStruct is Nastran's where it has bulk data alone: name it .bdf"},
      {".pch", "Name bulk data .bdf"},
      {".mesh", "gmsh makes a .msh of it: gmsh -0 FILE.mesh -format msh41 -o FILE.msh"}};
  const auto way = ways.find(ending);
  return way == ways.end() ? "" : fmt::format(". {}", way->second);
}

FeModel read_model(const ReduceRequest& request, const FeUnits& units) {
  const std::string ending = plain_lower(request.model.extension().string());
  if (ending == ".inp") return read_inp(request.model, units, contact_of(request.contact));
  if (ending == ".msh") return read_msh(request.model, units);
  if (ending == ".bdf" || ending == ".nas" || ending == ".dat") return read_nastran(request.model, units);
  if (ending == ".sti" || ending == ".mtx") return read_matrices(request, ending, units);
  const std::vector<std::string>& further = request.further_endings;
  if (std::find(further.begin(), further.end(), ending) != further.end()) return request.further_reader(request.model, units);
  throw InputError(
      fmt::format("{}: '{}' is no known kind of model: .inp (Abaqus, CalculiX), .bdf .nas .dat (Nastran), .msh (gmsh), .sti "
                  "(CalculiX matrices), .mtx (Matrix Market) can be read, by the program 'flexframe reduce' .med and .vtu too{}",
                  request.model.string(), ending, way_from(ending)));
}

// The ranges of the numbers; the negation finds what is no number too.
void check_numbers(const ReduceRequest& request) {
  const ReduceOptions& o = request.options;
  const auto refuse = [](const char* name, double value, const char* allowed) {
    throw InputError(fmt::format("{} = {:g}: {} is expected", name, value, allowed));
  };
  if (o.modes < 0) refuse("modes", o.modes, "0 or more");
  if (o.node_count < 1) refuse("nodes", o.node_count, "1 or more");
  if (o.threads < 1 || o.threads > 1024) refuse("threads", o.threads, "1 to 1024");
  if (!(o.static_error >= 0.0 && o.static_error <= 1.0)) refuse("static error", o.static_error, "0 to 1");
  const std::pair<const char*, double> others[] = {{"highest", o.highest},           {"lowest", o.lowest},   {"cut-off", o.cut_off},
                                                   {"thickness", request.thickness}, {"damping", o.damping}, {"memory", o.memory_limit}};
  for (const auto& [name, value] : others)
    if (!(value >= 0.0) || !std::isfinite(value)) refuse(name, value, "a finite number, 0 or more,");
}

}  // namespace

RequestedReduction reduce(const ReduceRequest& request, const std::function<void(const std::string&)>& progress,
                          const std::function<void()>& ask) {
  check_numbers(request);
  ReduceOptions options = request.options;
  options.method = method_of(request.method);
  const FeUnits units = units_of(request.units);
  FeModel model = read_model(request, units);
  complete_materials(model, request);
  for (std::string& text : unit_warnings(model, units)) model.warnings.push_back(std::move(text));
  for (std::string& text : doubled_solids(model)) model.warnings.push_back(std::move(text));
  for (const std::string& text : request.interfaces) options.interfaces.push_back(interface_of(model, text));
  for (int id : request.nodes) options.nodes.push_back(node_of(model, fmt::format("{}", id)));
  for (const std::string& set : request.node_sets)
    for (int n : set_of(model, set)) options.nodes.push_back(n);
  std::string held_note;
  if (request.hold == "auto" || request.hold == "model") {
    options.held = model.constraints;
    if (!options.held.empty())
      held_note = fmt::format("held by the model's *BOUNDARY ({} motions); --hold none leaves the body free", options.held.size());
  } else if (request.hold != "none") {
    for (int n : set_of(model, request.hold))
      for (int d = 0; d < 6; ++d) options.held.push_back({n, d});
  }
  Reduction reduction = reduce(model, options, progress, ask);
  if (!held_note.empty()) reduction.report.notes.insert(reduction.report.notes.begin(), held_note);
  return {std::move(model), std::move(reduction)};
}

}  // namespace flexframe::sim
