// Abaqus / CalculiX input files. See read_inp in fe_model.h.
#include "sim/reduce/fe_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <functional>
#include <set>
#include <unordered_map>
#include <utility>

namespace flexframe::sim {
namespace {

std::string upper(std::string_view s) {
  std::string out;
  for (char c : s) out += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return out;
}

std::string_view trim(std::string_view s) {
  while (!s.empty() && std::isspace(static_cast<unsigned char>(s.front()))) s.remove_prefix(1);
  while (!s.empty() && std::isspace(static_cast<unsigned char>(s.back()))) s.remove_suffix(1);
  return s;
}

std::vector<std::string_view> fields(std::string_view line) {
  std::vector<std::string_view> out;
  for (;;) {
    const size_t comma = line.find(',');
    out.push_back(trim(line.substr(0, comma)));
    if (comma == std::string_view::npos) break;
    line.remove_prefix(comma + 1);
  }
  while (!out.empty() && out.back().empty()) out.pop_back();
  return out;
}

struct ElementType {
  const char* name;
  FeShape shape;
  FeFormulation formulation;
};
constexpr ElementType element_types[] = {{"C3D4", FeShape::tetrahedron4, FeFormulation::full},
                                         {"C3D10", FeShape::tetrahedron10, FeFormulation::full},
                                         {"C3D10T", FeShape::tetrahedron10, FeFormulation::full},
                                         {"C3D10M", FeShape::tetrahedron10, FeFormulation::full},
                                         {"C3D10HS", FeShape::tetrahedron10, FeFormulation::full},
                                         {"C3D8", FeShape::hexahedron8, FeFormulation::full},
                                         {"C3D8I", FeShape::hexahedron8, FeFormulation::incompatible},
                                         {"C3D8R", FeShape::hexahedron8, FeFormulation::incompatible},
                                         {"C3D20", FeShape::hexahedron20, FeFormulation::full},
                                         {"C3D20R", FeShape::hexahedron20, FeFormulation::reduced},
                                         {"C3D6", FeShape::wedge6, FeFormulation::full},
                                         {"C3D15", FeShape::wedge15, FeFormulation::full},
                                         {"S3", FeShape::triangle3, FeFormulation::full},
                                         {"S3R", FeShape::triangle3, FeFormulation::full},
                                         {"STRI3", FeShape::triangle3, FeFormulation::full},
                                         {"S4", FeShape::quadrangle4, FeFormulation::full},
                                         {"S4R", FeShape::quadrangle4, FeFormulation::full},
                                         {"S4R5", FeShape::quadrangle4, FeFormulation::full},
                                         {"MASS", FeShape::point_mass, FeFormulation::full}};

struct Keyword {
  std::string name;                               // upper case, single blanks
  std::map<std::string, std::string> parameters;  // values as written
  int line = 0;
};

struct Section {
  std::string set, material;
  double thickness = 0.0;
  int line = 0;
  bool shell = false;
};
struct Tie {
  bool coupling = false, averaging = false;
  std::string name, set, surface, reference;
  int line = 0;
};
struct Boundary {
  std::string where;
  int first = 1, last = 1, line = 0;
};

class Reader {
 public:
  explicit Reader(const FeUnits& u) : units(u) {}

  FeModel read(const std::filesystem::path& path) {
    model.file = path.string();
    read_file(path, 0);
    finish_keyword();
    resolve();
    return std::move(model);
  }

 private:
  FeUnits units;
  FeModel model;
  std::string file;
  int number = 0;
  Keyword keyword;
  bool in_step = false;
  std::unordered_map<int, int> node_index, element_index;
  std::map<std::string, std::vector<int>> node_set_ids, element_set_ids;
  std::map<std::string, std::vector<std::string>> node_set_names, element_set_names;  // sets made of sets
  std::map<std::string, std::vector<std::pair<std::string, std::string>>> surfaces;   // name -> (set or id, face or empty)
  std::map<std::string, bool> surface_of_nodes;
  std::vector<Section> sections;
  std::vector<Tie> ties;
  std::vector<Boundary> boundaries;
  std::map<std::string, double> masses;  // element set -> kg
  std::vector<std::pair<int, int>> element_lines;
  std::vector<long> pending;  // ids of an element that runs over lines
  std::string_view data;
  int data_lines = 0;  // of the present keyword
  std::set<std::string> passed_over;
  int instances = 0;

  [[noreturn]] void fail(const std::string& message) const { throw InputError(fmt::format("{}:{}: {}", file, number, message)); }

  void read_file(const std::filesystem::path& path, int depth) {
    if (depth > 8) fail("*INCLUDE is nested more than 8 deep");
    std::error_code error;
    std::ifstream in(path);
    if (!in || std::filesystem::is_directory(path, error)) {
      if (depth == 0) throw InputError(fmt::format("{}: cannot be opened", path.string()));
      fail(fmt::format("*INCLUDE: '{}' cannot be opened", path.string()));
    }
    const std::string outer_file = std::exchange(file, path.string());
    const int outer_number = std::exchange(number, 0);
    std::string line;
    while (std::getline(in, line)) {
      ++number;
      const std::string_view text = trim(line);
      if (text.empty() || text.starts_with("**")) continue;
      if (text.front() == '*') {
        finish_keyword();
        parse_keyword(in, text);
        if (keyword.name == "INCLUDE") {
          const std::string target = need("INPUT");
          keyword = {};
          read_file(path.parent_path() / target, depth + 1);
          continue;
        }
        begin_keyword();
      } else if (!in_step) {
        data = text;
        read_data();
        ++data_lines;
      }
    }
    if (depth == 0) finish_keyword();
    file = outer_file;
    number = outer_number;
  }

  void parse_keyword(std::istream& in, std::string_view text) {
    std::string joined(text);
    // A keyword line that ends with a comma goes on in the next line.
    while (joined.ends_with(',')) {
      std::string more;
      if (!std::getline(in, more)) break;
      ++number;
      joined += trim(more);
    }
    keyword = {};
    keyword.line = number;
    data_lines = 0;
    pending.clear();
    bool first = true;
    for (std::string_view part : fields(joined)) {
      if (first) {
        std::string name;
        for (char c : upper(part.substr(1)))
          if (!(c == ' ' && (name.empty() || name.back() == ' '))) name += c;
        keyword.name = name;
      } else if (!part.empty()) {
        const size_t equals = part.find('=');
        std::string_view value = equals == std::string_view::npos ? std::string_view{} : trim(part.substr(equals + 1));
        if (value.size() >= 2 && value.front() == '"' && value.back() == '"') value = value.substr(1, value.size() - 2);
        std::string key;
        for (char c : upper(part.substr(0, equals)))
          if (c != ' ') key += c;
        keyword.parameters[key] = std::string(value);
      }
      first = false;
    }
  }

  std::string parameter(const std::string& key) const {
    const auto it = keyword.parameters.find(key);
    return it == keyword.parameters.end() ? "" : it->second;
  }
  std::string need(const std::string& key) const {
    const auto it = keyword.parameters.find(key);
    if (it == keyword.parameters.end() || it->second.empty()) fail(fmt::format("*{} needs {}=...", keyword.name, key));
    return it->second;
  }

  void begin_keyword() {
    const std::string& k = keyword.name;
    if (in_step) {
      if (k == "END STEP") in_step = false;
      return;
    }
    if (k == "STEP") {
      in_step = true;
    } else if (k == "ELEMENT") {
      const std::string type = upper(need("TYPE"));
      const auto* found =
          std::find_if(std::begin(element_types), std::end(element_types), [&](const ElementType& t) { return type == t.name; });
      if (found == std::end(element_types)) {
        std::string names;
        for (const ElementType& t : element_types) names += std::string(names.empty() ? "" : " ") + t.name;
        fail(fmt::format("element type '{}' is not known; there are {}", type, names));
      }
      element_type = found;
      if (type == "C3D8R") note_once("C3D8R: integrated with incompatible modes like C3D8I (free of hourglass modes)");
      if (type == "C3D10M") note_once("C3D10M: taken as C3D10");
    } else if (k == "MATERIAL") {
      model.materials.push_back({need("NAME")});
    } else if (k == "ELASTIC") {
      const std::string type = upper(parameter("TYPE"));
      if (!type.empty() && type != "ISO" && type != "ISOTROPIC")
        fail(fmt::format("*ELASTIC, TYPE={}: only isotropic elasticity (TYPE=ISO) can be read", type));
      need_material();
    } else if (k == "DENSITY") {
      need_material();
    } else if (k == "SOLID SECTION" || k == "SHELL SECTION") {
      sections.push_back({upper(need("ELSET")), parameter("MATERIAL"), 0.0, number, k == "SHELL SECTION"});
      if (sections.back().material.empty()) fail(fmt::format("*{} needs MATERIAL=... (composites cannot be read)", k));
    } else if (k == "RIGID BODY") {
      Tie tie;
      tie.set =
          upper(parameter("NSET").empty() ? parameter("TIENSET").empty() ? parameter("PINNSET") : parameter("TIENSET") : parameter("NSET"));
      if (tie.set.empty()) fail("*RIGID BODY needs NSET=... (an element set cannot be made rigid)");
      tie.reference = need("REFNODE");
      tie.name = tie.set;
      tie.line = number;
      ties.push_back(tie);
    } else if (k == "COUPLING") {
      Tie tie;
      tie.coupling = true;
      tie.surface = upper(need("SURFACE"));
      tie.reference = need("REFNODE");
      tie.name = parameter("CONSTRAINTNAME").empty() ? tie.surface : upper(parameter("CONSTRAINTNAME"));
      tie.line = number;
      ties.push_back(tie);
    } else if (k == "KINEMATIC" || k == "DISTRIBUTING") {
      if (ties.empty() || !ties.back().coupling) fail(fmt::format("*{} without *COUPLING before it", k));
      ties.back().averaging = k == "DISTRIBUTING";
    } else if (k == "SURFACE") {
      const std::string type = upper(parameter("TYPE"));
      if (!type.empty() && type != "NODE" && type != "ELEMENT") fail(fmt::format("*SURFACE, TYPE={}: NODE or ELEMENT are allowed", type));
      surface_of_nodes[upper(need("NAME"))] = type == "NODE";
      surfaces[upper(need("NAME"))];
    } else if (k == "INSTANCE") {
      if (++instances > 1) fail("a second *INSTANCE: only flat files (or one instance) can be read");
    } else if (k == "NODE" || k == "NSET" || k == "ELSET" || k == "BOUNDARY" || k == "MASS") {
      if (k == "NODE" && !parameter("SYSTEM").empty() && upper(parameter("SYSTEM")) != "R")
        fail("*NODE, SYSTEM: only rectangular coordinates can be read");
    } else if (refused(k)) {
      fail(fmt::format("*{} changes the structure and cannot be read; take it out of the model, or export K and M as matrices", k));
    } else if (!harmless(k) && passed_over.insert(k).second) {
      model.notes.push_back(fmt::format("{}:{}: *{} is ignored", file, number, k));
    }
  }

  static bool harmless(const std::string& k) {
    static const std::set<std::string> words = {"HEADING",     "PREPRINT",     "RESTART",      "PART",           "END PART",
                                                "ASSEMBLY",    "END ASSEMBLY", "END INSTANCE", "NODE PRINT",     "NODE FILE",
                                                "NODE OUTPUT", "EL FILE",      "EL PRINT",     "ELEMENT OUTPUT", "OUTPUT",
                                                "AMPLITUDE",   "EXPANSION",    "SYSTEM",       "ORIENTATION"};
    return words.contains(k);
  }
  static bool refused(const std::string& k) {
    static const std::set<std::string> words = {"EQUATION",
                                                "MPC",
                                                "TIE",
                                                "CONTACT PAIR",
                                                "SPRING",
                                                "DASHPOT",
                                                "BEAM SECTION",
                                                "BEAM GENERAL SECTION",
                                                "MEMBRANE SECTION",
                                                "NODAL THICKNESS",
                                                "TRANSFORM",
                                                "CYCLIC SYMMETRY MODEL",
                                                "USER ELEMENT",
                                                "MATRIX ASSEMBLE",
                                                "ROTARY INERTIA",
                                                "SUBMODEL",
                                                "NGEN",
                                                "NFILL",
                                                "NCOPY",
                                                "ELGEN",
                                                "ELCOPY"};
    return words.contains(k);
  }

  void note_once(const std::string& text) {
    if (std::find(model.notes.begin(), model.notes.end(), text) == model.notes.end()) model.notes.push_back(text);
  }

  void need_material() {
    if (model.materials.empty()) fail(fmt::format("*{} before any *MATERIAL", keyword.name));
  }

  void finish_keyword() {
    if (!pending.empty()) fail(fmt::format("the last element has {} nodes of {}", pending.size() - 1, fe_node_count(element_type->shape)));
    keyword = {};
  }

  const ElementType* element_type = nullptr;

  double real(std::string_view s, const char* what) const {
    double value = 0.0;
    std::string text(s);
    for (char& c : text)
      if (c == 'D' || c == 'd') c = 'e';
    const char* begin = text.c_str() + (text.starts_with('+') ? 1 : 0);
    const auto [end, error] = std::from_chars(begin, text.c_str() + text.size(), value);
    if (error != std::errc() || end != text.c_str() + text.size() || !std::isfinite(value))
      fail(fmt::format("{}: a number is expected, found '{}'", what, s.substr(0, 40)));
    return value;
  }
  int integer(std::string_view s, const char* what) const {
    int value = 0;
    const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
    if (error != std::errc() || end != s.data() + s.size())
      fail(fmt::format("{}: an integer is expected, found '{}'", what, s.substr(0, 40)));
    return value;
  }
  static bool is_integer(std::string_view s) {
    return !s.empty() && std::all_of(s.begin(), s.end(), [](char c) { return c >= '0' && c <= '9'; });
  }

  void read_data() {
    const std::string& k = keyword.name;
    if (k == "NODE") read_node();
    else if (k == "ELEMENT") read_element();
    else if (k == "NSET") read_set(upper(need("NSET")), node_set_ids, node_set_names);
    else if (k == "ELSET") read_set(upper(need("ELSET")), element_set_ids, element_set_names);
    else if (k == "ELASTIC") read_elastic();
    else if (k == "DENSITY") {
      if (data_lines == 0) model.materials.back().density = real(fields(data)[0], "density") * units.density();
      else note_once("temperature dependent density: the first line is used");
    } else if (k == "SHELL SECTION") {
      if (data_lines == 0) sections.back().thickness = real(fields(data)[0], "thickness") * units.length;
    } else if (k == "MASS") {
      masses[upper(need("ELSET"))] = real(fields(data)[0], "mass") * units.mass;
    } else if (k == "BOUNDARY") {
      read_boundary();
    } else if (k == "SURFACE") {
      const auto f = fields(data);
      surfaces[upper(need("NAME"))].emplace_back(upper(f[0]), f.size() > 1 ? upper(f[1]) : "");
    } else if (k == "INSTANCE") {
      fail("*INSTANCE with a translation or rotation cannot be read; only flat files");
    }
  }

  void read_node() {
    const auto f = fields(data);
    if (f.size() < 2) fail("*NODE: 'number, x, y, z' is expected");
    const int id = integer(f[0], "node number");
    Vec3 x = Vec3::Zero();
    for (size_t i = 1; i < f.size() && i < 4; ++i)
      x(static_cast<int>(i) - 1) = f[i].empty() ? 0.0 : real(f[i], "coordinate") * units.length;
    const auto [at, fresh] = node_index.try_emplace(id, static_cast<int>(model.nodes.size()));
    if (!fresh) fail(fmt::format("node {} is defined twice", id));
    model.node_ids.push_back(id);
    model.nodes.push_back(x);
    if (const std::string set = parameter("NSET"); !set.empty()) node_set_ids[upper(set)].push_back(id);
  }

  void read_element() {
    for (std::string_view f : fields(data)) {
      if (!f.empty()) pending.push_back(integer(f, "element"));
    }
    const int count = fe_node_count(element_type->shape);
    if (static_cast<int>(pending.size()) < count + 1) {
      if (!data.ends_with(','))
        fail(fmt::format("element {} has {} nodes, {} are expected", pending.empty() ? 0 : pending[0], pending.size() - 1, count));
      return;
    }
    if (static_cast<int>(pending.size()) > count + 1)
      fail(fmt::format("element {} has {} nodes, {} are expected", pending[0], pending.size() - 1, count));
    FeElement e;
    e.id = static_cast<int>(pending[0]);
    e.shape = element_type->shape;
    e.formulation = element_type->formulation;
    e.first = static_cast<int>(model.connectivity.size());
    e.count = count;
    e.line = file == model.file ? number : 0;
    if (!element_index.try_emplace(e.id, static_cast<int>(model.elements.size())).second)
      fail(fmt::format("element {} is defined twice", e.id));
    for (int i = 1; i <= count; ++i) model.connectivity.push_back(static_cast<int>(pending[i]));
    element_lines.emplace_back(number, 0);
    model.elements.push_back(e);
    if (const std::string set = parameter("ELSET"); !set.empty()) element_set_ids[upper(set)].push_back(e.id);
    pending.clear();
  }

  void read_set(const std::string& name, std::map<std::string, std::vector<int>>& ids,
                std::map<std::string, std::vector<std::string>>& names) {
    const auto f = fields(data);
    std::vector<int>& set = ids[name];
    if (keyword.parameters.contains("GENERATE")) {
      if (f.size() < 2) fail("GENERATE: 'first, last, step' is expected");
      const int first = integer(f[0], "first"), last = integer(f[1], "last"), step = f.size() > 2 ? integer(f[2], "step") : 1;
      if (step <= 0 || last < first) fail(fmt::format("GENERATE: {} to {} by {} is no range", first, last, step));
      // Only numbers that exist are stored: a range may be larger than the model.
      const auto& index = &ids == &node_set_ids ? node_index : element_index;
      if ((static_cast<long>(last) - first) / step > 4L * static_cast<long>(index.size()) + 16) {
        for (const auto& [id, i] : index)
          if (id >= first && id <= last && (id - first) % step == 0) set.push_back(id);
      } else {
        for (long id = first; id <= last; id += step)
          if (index.contains(static_cast<int>(id))) set.push_back(static_cast<int>(id));
      }
      return;
    }
    for (std::string_view part : f) {
      if (part.empty()) continue;
      if (is_integer(part)) set.push_back(integer(part, "set member"));
      else names[name].push_back(upper(part));
    }
  }

  void read_elastic() {
    if (data_lines > 0) return note_once("temperature dependent elasticity: the first line is used");
    const auto f = fields(data);
    if (f.size() < 2) fail("*ELASTIC: 'Young's modulus, Poisson's ratio' is expected");
    model.materials.back().youngs_modulus = real(f[0], "Young's modulus") * units.stress();
    model.materials.back().poisson = real(f[1], "Poisson's ratio");
  }

  void read_boundary() {
    const auto f = fields(data);
    Boundary b;
    b.where = upper(f[0]);
    b.line = number;
    if (f.size() < 2) fail("*BOUNDARY: 'node or set, first dof, last dof' is expected");
    const std::string type = upper(f[1]);
    if (type == "ENCASTRE") b.last = 6;
    else if (type == "PINNED") b.last = 3;
    else {
      b.first = integer(f[1], "degree of freedom");
      b.last = f.size() > 2 && !f[2].empty() ? integer(f[2], "degree of freedom") : b.first;
    }
    if (b.first < 1 || b.last > 6 || b.last < b.first)
      fail(fmt::format("*BOUNDARY: degrees of freedom 1 to 6 are allowed, found {} to {}", b.first, b.last));
    if (f.size() > 3 && real(f[3], "value") != 0.0) note_once("*BOUNDARY with a value: fixed at zero");
    boundaries.push_back(b);
  }

  // Sets by name, with sets of sets resolved; ids to indices.
  void resolve_sets(const std::map<std::string, std::vector<int>>& ids, const std::map<std::string, std::vector<std::string>>& names,
                    const std::unordered_map<int, int>& index, std::map<std::string, std::vector<int>>& out, const char* what) {
    std::set<std::string> all;
    for (const auto& [name, members] : ids) all.insert(name);
    for (const auto& [name, members] : names) all.insert(name);
    for (const std::string& name : all) {
      std::set<std::string> visited;
      std::vector<int> members;
      const std::function<void(const std::string&)> add = [&](const std::string& set) {
        if (!visited.insert(set).second) return;
        if (!all.contains(set))
          throw InputError(fmt::format("{}: {} set '{}' refers to '{}', which is not there", model.file, what, name, set));
        if (const auto it = ids.find(set); it != ids.end())
          for (int id : it->second) {
            const auto found = index.find(id);
            if (found == index.end())
              throw InputError(fmt::format("{}: {} set '{}' has {} {}, which is not there", model.file, what, set, what, id));
            members.push_back(found->second);
          }
        if (const auto it = names.find(set); it != names.end())
          for (const std::string& other : it->second) add(other);
      };
      add(name);
      std::sort(members.begin(), members.end());
      members.erase(std::unique(members.begin(), members.end()), members.end());
      out[name] = std::move(members);
    }
  }

  std::vector<int> nodes_of(const std::string& where, int line) {
    if (is_integer(where)) {
      number = line;
      const auto it = node_index.find(integer(where, "node"));
      if (it == node_index.end()) fail(fmt::format("node {} is not there", where));
      return {it->second};
    }
    const auto it = model.node_sets.find(where);
    if (it == model.node_sets.end()) {
      number = line;
      fail(fmt::format("node set '{}' is not there", where));
    }
    return it->second;
  }

  void resolve() {
    file = model.file;
    for (size_t e = 0; e < model.elements.size(); ++e)
      for (int i = 0; i < model.elements[e].count; ++i) {
        int& node = model.connectivity[model.elements[e].first + i];
        const auto it = node_index.find(node);
        if (it == node_index.end()) {
          number = element_lines[e].first;
          fail(fmt::format("element {}: node {} is not there", model.elements[e].id, node));
        }
        node = it->second;
      }
    resolve_sets(node_set_ids, node_set_names, node_index, model.node_sets, "node");
    resolve_sets(element_set_ids, element_set_names, element_index, model.element_sets, "element");
    for (const Section& s : sections) {
      number = s.line;
      const auto set = model.element_sets.find(s.set);
      if (set == model.element_sets.end()) fail(fmt::format("section: element set '{}' is not there", s.set));
      int material = -1;
      for (size_t i = 0; i < model.materials.size(); ++i)
        if (upper(model.materials[i].name) == upper(s.material)) material = static_cast<int>(i);
      if (material < 0) fail(fmt::format("section: material '{}' is not there", s.material));
      for (int e : set->second) {
        model.elements[e].material = material;
        if (s.shell) model.elements[e].thickness = s.thickness;
      }
    }
    for (const auto& [set, mass] : masses) {
      const auto it = model.element_sets.find(set);
      if (it == model.element_sets.end()) throw InputError(fmt::format("{}: *MASS: element set '{}' is not there", model.file, set));
      for (int e : it->second) model.elements[e].thickness = mass;
    }
    for (const Boundary& b : boundaries)
      for (int node : nodes_of(b.where, b.line))
        for (int dof = b.first; dof <= b.last; ++dof) model.constraints.push_back({node, dof - 1});
    for (const Tie& t : ties) {
      FeSpider spider;
      spider.name = t.name;
      spider.rigid = !t.averaging;
      spider.line = t.line;
      const std::vector<int> reference = nodes_of(upper(t.reference), t.line);
      number = t.line;
      if (reference.size() != 1) fail(fmt::format("the reference '{}' must be one node", t.reference));
      spider.node = reference[0];
      spider.slaves = t.coupling ? nodes_of_surface(t.surface, t.line) : nodes_of(t.set, t.line);
      std::erase(spider.slaves, spider.node);
      model.spiders.push_back(std::move(spider));
    }
  }

  std::vector<int> nodes_of_surface(const std::string& name, int line) {
    number = line;
    const auto surface = surfaces.find(name);
    if (surface == surfaces.end()) fail(fmt::format("surface '{}' is not there", name));
    std::set<int> nodes;
    for (const auto& [where, face] : surface->second) {
      if (surface_of_nodes[name]) {
        for (int node : nodes_of(where, line)) nodes.insert(node);
        continue;
      }
      std::vector<int> elements;
      if (is_integer(where)) {
        const auto it = element_index.find(integer(where, "element"));
        if (it == element_index.end()) fail(fmt::format("surface '{}': element {} is not there", name, where));
        elements = {it->second};
      } else {
        const auto it = model.element_sets.find(where);
        if (it == model.element_sets.end()) fail(fmt::format("surface '{}': element set '{}' is not there", name, where));
        elements = it->second;
      }
      for (int e : elements) {
        const FeElement& element = model.elements[e];
        const auto& faces = fe_faces(element.shape);
        if (fe_is_shell(element.shape)) {
          for (int i = 0; i < element.count; ++i) nodes.insert(model.connectivity[element.first + i]);
          continue;
        }
        const int k = face.size() == 2 && face[0] == 'S' ? face[1] - '1' : -1;
        if (k < 0 || k >= static_cast<int>(faces.size()))
          fail(fmt::format("surface '{}': face '{}' of a {}: S1 to S{} are allowed", name, face, fe_name(element.shape), faces.size()));
        for (int corner : faces[k]) nodes.insert(model.connectivity[element.first + corner]);
      }
    }
    return {nodes.begin(), nodes.end()};
  }
};

}  // namespace

FeModel read_inp(const std::filesystem::path& path, const FeUnits& units) { return Reader(units).read(path); }

}  // namespace flexframe::sim
