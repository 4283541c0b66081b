// Keywords of Abaqus / CalculiX input files to tables. See fe_inp_tables.h.
#include "sim/reduce/fe_inp_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace flexframe::sim {
namespace {

using enum InpKind;
constexpr FeShape none = FeShape::point_mass;
constexpr FeFormulation full = FeFormulation::full;
constexpr InpType types[] = {{"C3D4", element, FeShape::tetrahedron4, full, 4},
                             {"C3D10", element, FeShape::tetrahedron10, full, 10},
                             {"C3D10M", element, FeShape::tetrahedron10, full, 10},
                             {"C3D10I", element, FeShape::tetrahedron10, full, 10},
                             {"C3D8", element, FeShape::hexahedron8, full, 8},
                             {"C3D8I", element, FeShape::hexahedron8, FeFormulation::incompatible, 8},
                             {"C3D8R", element, FeShape::hexahedron8, FeFormulation::incompatible, 8},
                             {"C3D20", element, FeShape::hexahedron20, full, 20},
                             {"C3D20R", element, FeShape::hexahedron20, FeFormulation::reduced, 20},
                             {"C3D6", element, FeShape::wedge6, full, 6},
                             {"C3D15", element, FeShape::wedge15, full, 15},
                             {"S3", element, FeShape::triangle3, full, 3},
                             {"S3R", element, FeShape::triangle3, full, 3},
                             {"STRI3", element, FeShape::triangle3, full, 3},
                             {"S4", element, FeShape::quadrangle4, full, 4},
                             {"S4R", element, FeShape::quadrangle4, full, 4},
                             {"S4R5", element, FeShape::quadrangle4, full, 4},
                             {"S6", element, FeShape::triangle6, full, 6},
                             {"STRI65", element, FeShape::triangle6, full, 6},
                             {"S8", element, FeShape::quadrangle8, full, 8},
                             {"S8R", element, FeShape::quadrangle8, full, 8},
                             {"S8R5", element, FeShape::quadrangle8, full, 8},
                             {"B31", beam, FeShape::beam2, full, 2},
                             {"B31R", beam, FeShape::beam2, full, 2},
                             {"B32", beam, FeShape::beam2, full, 3},
                             {"B32R", beam, FeShape::beam2, full, 3},
                             {"B33", beam, FeShape::beam2, full, 2},
                             {"T3D2", truss, FeShape::beam2, full, 2},
                             {"MASS", mass, none, full, 1},
                             {"ROTARYI", rotary, FeShape::lumped, full, 1},
                             {"SPRING1", spring_ground, FeShape::lumped, full, 1},
                             {"SPRING2", spring_dofs, FeShape::lumped, full, 2},
                             {"SPRINGA", spring_axial, FeShape::lumped, full, 2},
                             {"DASHPOT1", left_out, none, full, 1},
                             {"DASHPOT2", left_out, none, full, 2},
                             {"DASHPOTA", left_out, none, full, 2},
                             {"R3D3", rigid_shape, none, full, 3},
                             {"R3D4", rigid_shape, none, full, 4},
                             {"DCOUP3D", point, none, full, 1}};

const InpType* type_of(const std::string& name) {
  for (const InpType& t : types)
    if (name == t.name) return &t;
  return nullptr;
}

// What stands against an element type, and what to do instead.
std::string advice_for(const std::string& type) {
  const auto starts = [&](std::initializer_list<const char*> heads) {
    return std::any_of(heads.begin(), heads.end(), [&](const char* h) { return type.starts_with(h); });
  };
  if (starts({"CPS", "CPE", "CAX", "CGAX", "SAX"}))
    return "plane and axisymmetric elements make no body in space; mesh it with solids or shells";
  if (starts({"M3D"})) return "membranes have no bending stiffness; use shells (S3, S4, S6, S8)";
  if (starts({"F3D", "DC", "AC", "DS", "D"})) return "elements of heat or fluid carry no load; leave them out";
  if (starts({"GAP", "ITT"})) return "contact is no part of a linear body; put it into the scene";
  if (starts({"CONN"})) return "connectors belong into the scene: a joint or a bushing between interfaces";
  if (starts({"U"})) return "user elements cannot be read; export K and M as matrices (.sti, .mtx)";
  if (starts({"C3D5"})) return "pyramids are not there; mesh that part with tetrahedra, or C3D6";
  std::string names;
  for (const InpType& t : types) names += std::string(names.empty() ? "" : " ") + t.name;
  return "there are " + names;
}

// Words that change the structure and cannot be read, and what to do instead.
const std::map<std::string, const char*>& refused_words() {
  static const std::map<std::string, const char*> words = {
      {"CONTACT PAIR",
       "contact is no part of a linear body: tie the surfaces (*TIE), merge their nodes, or reduce the parts as bodies of "
       "their own and join them in the scene"},
      {"MEMBRANE SECTION", "membranes have no bending stiffness: use shells"},
      {"CYCLIC SYMMETRY MODEL", "a body is the whole structure: give the model all around"},
      {"PRE-TENSION SECTION", "a bolt's pre-load is no part of a linear body: take the section out"},
      {"USER ELEMENT", "export K and M as matrices (.sti, .mtx)"},
      {"MATRIX ASSEMBLE", "export K and M of the whole as matrices (.sti, .mtx)"},
      {"SUBSTRUCTURE PROPERTY", "export K and M of the whole as matrices (.sti, .mtx)"},
      {"EMBEDDED ELEMENT", "tie the parts by *TIE or common nodes"},
      {"SHELL TO SOLID COUPLING", "tie the parts by *TIE, or a *COUPLING"},
      {"NCOPY", "write the nodes out (most preprocessors export them)"},
      {"ELCOPY", "write the elements out (most preprocessors export them)"},
      {"SUBMODEL", "its supports come from another model's results: reduce the whole model"}};
  return words;
}

bool harmless(const std::string& k) {
  static const std::set<std::string> words = {"HEADING",
                                              "PREPRINT",
                                              "RESTART",
                                              "NODE PRINT",
                                              "NODE FILE",
                                              "NODE OUTPUT",
                                              "EL FILE",
                                              "EL PRINT",
                                              "ELEMENT OUTPUT",
                                              "OUTPUT",
                                              "AMPLITUDE",
                                              "EXPANSION",
                                              "CONDUCTIVITY",
                                              "SPECIFIC HEAT",
                                              "PHYSICAL CONSTANTS",
                                              "END STEP",
                                              "DASHPOT",
                                              "SURFACE INTERACTION",
                                              "FRICTION",
                                              "DAMPING",
                                              "TIME POINTS",
                                              "INITIAL CONDITIONS",
                                              "TRANSVERSE SHEAR STIFFNESS",
                                              "HOURGLASS STIFFNESS"};
  return words.contains(k);
}

std::vector<int> span_of(int first, int last) {
  std::vector<int> out;
  for (int d = first; d <= std::min(last, 6); ++d) out.push_back(d - 1);
  return out;
}

Mat3 turned_about(const Vec3& axis, double degrees) {
  return Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, axis.normalized()).toRotationMatrix();
}

class Reader : public InpLines {
 public:
  explicit Reader(const FeUnits& u) : units(u) {
    deck.scopes.emplace_back();
    deck.length = u.length;
    deck.force_per_length = u.mass / (u.time * u.time);
  }

  InpDeck take(const std::filesystem::path& path) {
    read(path);
    deck.files = files;
    return std::move(deck);
  }

 protected:
  void keyword(const InpKeyword& given) override {
    k = given;
    lines = 0;
    numbers.clear();
    skip = false;
    if (step > 0) return in_step();
    if (!structure() && !set_word() && !material_word() && !section_word() && !tie_word()) other_word();
  }

  void data(std::string_view text) override {
    if (skip) return;
    line = text;
    f = inp_fields(text);
    if (k.name == "BOUNDARY") read_boundary();
    else if (step == 0) read_data();
    ++lines;
  }

  void finish_keyword() override {
    if (!pending.empty()) {
      const std::string text = fmt::format("the last element has {} nodes of {}", pending.size() - 1, type->nodes);
      pending.clear();
      fail(text);
    }
    if (k.name == "ELASTIC" && !skip && step == 0) finish_elastic();
    if (k.name == "EQUATION" && !terms.empty()) fail(fmt::format("*EQUATION: {} of {} terms", terms.size() / 3, wanted));
    k = {};
  }

 private:
  FeUnits units;
  InpDeck deck;
  InpKeyword k;
  std::string_view line;
  std::vector<std::string_view> f;
  size_t scope = 0;
  int step = 0;  // 0: before the first
  bool ended = false;
  int lines = 0;  // of data of the present keyword
  bool skip = false;
  const InpType* type = nullptr;
  std::vector<int> pending;  // numbers of an element that runs over lines
  std::vector<double> numbers;
  std::vector<std::string> terms;
  int wanted = 0;
  Mat3 system_axes = Mat3::Identity();  // *SYSTEM
  Vec3 system_origin = Vec3::Zero();
  std::vector<double> system_points;
  std::set<std::string> told;

  InpScope& s() { return deck.scopes[scope]; }
  std::string up(const char* key) const { return inp_upper(k.get(key)); }
  std::string need(const char* key) const {
    const std::string value = k.get(key);
    if (value.empty()) fail(fmt::format("*{} needs {}=...", k.name, key));
    return value;
  }
  void note(const std::string& text) {
    if (told.insert(text).second) deck.notes.push_back(text);
  }
  void refuse(const std::string& text) {
    skip = true;
    if (told.insert(text).second) deck.refusals.push_back(fmt::format("{}: {}", where(at), text));
  }
  double value(size_t i, const char* what, double otherwise) const { return i < f.size() && !f[i].empty() ? real(f[i], what) : otherwise; }

  // Steps: supports of the first are the model's.
  void in_step() {
    if (k.name == "STEP") ++step;
    if (k.name == "END STEP") ended = true;
    skip = k.name != "BOUNDARY";
    if (skip) return;
    if (step > 1 || ended) {
      skip = true;
      note(
          fmt::format("{}: *BOUNDARY of later steps is passed over: the supports are those of the model and of the first step", where(at)));
      return;
    }
    if (up("OP") == "NEW")
      for (InpScope& other : deck.scopes) std::erase_if(other.boundaries, [](const InpBoundary& b) { return !b.step; });
  }

  bool structure() {
    const std::string& w = k.name;
    if (w == "STEP") {
      ++step;
      skip = true;
    } else if (w == "NODE") {
      const std::string system = up("SYSTEM");
      if (!system.empty() && system != "R" && system != "C")
        refuse("*NODE, SYSTEM=S: only rectangular and cylindrical coordinates can be read");
    } else if (w == "ELEMENT") {
      begin_element();
    } else if (w == "SYSTEM") {
      system_points.clear();
      system_axes.setIdentity();
      system_origin.setZero();
    } else if (w == "PART") {
      deck.scopes.emplace_back();
      scope = deck.scopes.size() - 1;
      s().name = inp_upper(need("NAME"));
    } else if (w == "END PART" || w == "ASSEMBLY" || w == "END ASSEMBLY" || w == "END INSTANCE") {
      scope = 0;
    } else if (w == "INSTANCE") {
      InpInstance i;
      i.name = inp_upper(need("NAME"));
      const std::string part = up("PART");
      for (size_t n = 1; n < deck.scopes.size(); ++n)
        if (deck.scopes[n].name == part) i.scope = n;
      if (i.scope == 0) fail(fmt::format("*INSTANCE: part '{}' is not there", part));
      scope = i.scope;
      deck.instances.push_back(i);
    } else {
      return false;
    }
    return true;
  }

  void begin_element() {
    std::string name = inp_upper(need("TYPE"));
    type = type_of(name);
    // Variants for heat, hybrid pressure or enhanced hourglass control have the displacements of the plain element.
    for (const char* tail : {"T", "H", "HS", "E", "P", "S"})
      if (!type && name.ends_with(tail) && name.starts_with("C3D")) {
        type = type_of(name.substr(0, name.size() - std::string_view(tail).size()));
        if (type) note(fmt::format("{}: taken as {}", name, type->name));
      }
    if (!type && name.ends_with("RH") && name.starts_with("C3D")) type = type_of(name.substr(0, name.size() - 1));
    if (!type && name.ends_with("H") && name.starts_with("B3")) type = type_of(name.substr(0, name.size() - 1));
    if (!type && name == "S3RS") type = type_of("S3");
    if (!type && (name == "S4RS" || name == "S4RSW")) type = type_of("S4");
    if (!type) return refuse(fmt::format("element type '{}' is not known; {}", name, advice_for(name)));
    if (name == "C3D8R") note("C3D8R: integrated with incompatible modes like C3D8I (free of hourglass modes)");
    if (name == "C3D10M") note("C3D10M: taken as C3D10");
    if (type->kind == left_out)
      note(fmt::format("{}: {} is left out: damping comes with --damping, dampers in the scene", where(at), name));
  }

  bool set_word() {
    const std::string& w = k.name;
    if (w == "NSET") s().node_sets[inp_upper(need("NSET"))];
    else if (w == "ELSET") s().element_sets[inp_upper(need("ELSET"))];
    else if (w == "SURFACE") {
      const std::string kind = up("TYPE");
      if (!kind.empty() && kind != "NODE" && kind != "ELEMENT") {
        skip = true;  // where it is used it will be missing
        note(fmt::format("{}: *SURFACE, TYPE={} is passed over; NODE and ELEMENT can be read", where(at), kind));
        return true;
      }
      InpSurface& made = s().surfaces[inp_upper(need("NAME"))];
      made.nodes = kind == "NODE";
      made.place = at;
    } else if (w == "NGEN" || w == "NFILL" || w == "ELGEN") {
      // Data lines do the work.
    } else {
      return false;
    }
    return true;
  }

  FeMaterial& material() {
    if (deck.materials.empty()) fail(fmt::format("*{} before any *MATERIAL", k.name));
    return deck.materials.back();
  }

  bool material_word() {
    const std::string& w = k.name;
    if (w == "MATERIAL") {
      deck.materials.push_back({need("NAME")});
    } else if (w == "ELASTIC") {
      material();
      const std::string kind = up("TYPE");
      static const std::set<std::string> kinds = {"",      "ISO",         "ISOTROPIC", "ENGINEERINGCONSTANTS", "ENGINEERING CONSTANTS",
                                                  "ORTHO", "ORTHOTROPIC", "ANISO",     "ANISOTROPIC",          "LAMINA"};
      if (!kinds.contains(kind))
        refuse(fmt::format("*ELASTIC, TYPE={}: ISO, ENGINEERING CONSTANTS, ORTHOTROPIC, ANISOTROPIC or LAMINA can be read", kind));
    } else if (w == "DENSITY") {
      material();
    } else if (w == "ORIENTATION") {
      InpAxes axes;
      const std::string system = up("SYSTEM");
      axes.cylindrical = system.starts_with("C");
      if (!system.empty() && !axes.cylindrical && !system.starts_with("R"))
        return refuse(fmt::format("*ORIENTATION, SYSTEM={}: RECTANGULAR or CYLINDRICAL can be read", system)), true;
      s().orientations[inp_upper(need("NAME"))] = axes;
    } else {
      return false;
    }
    return true;
  }

  bool section_word() {
    const std::string& w = k.name;
    if (w == "SOLID SECTION" || w == "SHELL SECTION" || w == "SHELL GENERAL SECTION" || w == "BEAM SECTION" ||
        w == "BEAM GENERAL SECTION") {
      if (w == "SHELL GENERAL SECTION") return refuse("*SHELL GENERAL SECTION: give *SHELL SECTION with thickness and material"), true;
      begin_section();
    } else if (w == "NODAL THICKNESS") {
      // Data lines do the work.
    } else if (w == "MASS" || w == "ROTARY INERTIA" || w == "SPRING" || w == "NONSTRUCTURAL MASS") {
      InpValue v;
      v.set = inp_upper(need("ELSET"));
      v.unit = up("UNITS");
      v.orientation = up("ORIENTATION");
      v.place = at;
      if (w == "SPRING" && k.has("NONLINEAR"))
        return refuse("*SPRING, NONLINEAR: a linear body has linear springs; put it into the scene"), true;
      (w == "MASS" ? s().masses : w == "SPRING" ? s().springs : w == "ROTARY INERTIA" ? s().rotaries : s().added_masses).push_back(v);
    } else {
      return false;
    }
    return true;
  }

  void begin_section() {
    InpSection made;
    made.set = inp_upper(need("ELSET"));
    made.material = k.get("MATERIAL");
    made.orientation = up("ORIENTATION");
    made.shell = k.name == "SHELL SECTION";
    made.beam = k.name.starts_with("BEAM");
    made.own_constants = k.name == "BEAM GENERAL SECTION";
    made.shape = up("SECTION");
    made.nodal_thickness = k.has("NODALTHICKNESS");
    made.place = at;
    if (const std::string offset = up("OFFSET"); !offset.empty())
      made.offset = offset == "SPOS" ? 0.5 : offset == "SNEG" ? -0.5 : real(offset, "OFFSET");
    if (made.beam)
      for (const char* key : {"OFFSET1", "OFFSET2"})
        if (k.has(key) && real(k.get(key), key) != 0.0)
          return refuse(fmt::format("*BEAM SECTION, {}: beams beside their nodes cannot be read; put the nodes on the axis", key));
    if (made.own_constants && k.has("DENSITY")) made.density = real(k.get("DENSITY"), "DENSITY") * units.density();
    if (made.own_constants && made.shape.empty()) made.shape = "GENERAL";
    const bool layered = k.has("COMPOSITE");
    if (layered && !made.shell) return refuse("*SOLID SECTION, COMPOSITE: give each layer elements of its own, or use shells");
    if (made.material.empty() && !layered && !made.own_constants) fail(fmt::format("*{} needs MATERIAL=...", k.name));
    s().sections.push_back(made);
  }

  bool tie_word() {
    const std::string& w = k.name;
    InpTie tie;
    tie.place = at;
    if (w == "RIGID BODY") {
      tie.set = inp_upper(k.has("NSET") ? k.get("NSET") : k.has("TIENSET") ? k.get("TIENSET") : k.get("PINNSET"));
      tie.element_set = up("ELSET");
      if (tie.set.empty() && tie.element_set.empty()) fail("*RIGID BODY needs NSET=... or ELSET=...");
      tie.reference = inp_upper(k.get("REFNODE"));
      tie.rotation_node = inp_upper(k.get("ROTNODE"));
      tie.name = tie.set.empty() ? tie.element_set : tie.set;
    } else if (w == "COUPLING") {
      tie.kind = InpTie::Kind::coupling;
      tie.surface = inp_upper(need("SURFACE"));
      tie.reference = inp_upper(need("REFNODE"));
      tie.name = k.get("CONSTRAINTNAME").empty() ? tie.surface : up("CONSTRAINTNAME");
      if (k.has("ORIENTATION")) note(fmt::format("{}: *COUPLING, ORIENTATION counts only where some directions are left free", where(at)));
    } else if (w == "KINEMATIC" || w == "DISTRIBUTING") {
      if (s().ties.empty() || s().ties.back().kind != InpTie::Kind::coupling) fail(fmt::format("*{} without *COUPLING before it", w));
      s().ties.back().averaging = w == "DISTRIBUTING";
      return true;
    } else if (w == "KINEMATIC COUPLING") {
      tie.kind = InpTie::Kind::kinematic;
      tie.reference = tie.name = inp_upper(need("REFNODE"));
    } else if (w == "DISTRIBUTING COUPLING") {
      tie.kind = InpTie::Kind::weights;
      tie.averaging = true;
      tie.element_set = tie.name = inp_upper(need("ELSET"));
    } else if (w == "TIE") {
      tie.kind = InpTie::Kind::surfaces;
      tie.adjust = up("ADJUST") != "NO";
      if (k.has("POSITIONTOLERANCE")) tie.tolerance = real(k.get("POSITIONTOLERANCE"), "POSITION TOLERANCE") * units.length;
      if (k.has("CYCLICSYMMETRY") || k.has("MULTISTAGE"))
        return refuse("*TIE, CYCLIC SYMMETRY: a body is the whole structure: give the model all around"), true;
    } else if (w == "TRANSFORM") {
      InpTransform t;
      t.set = inp_upper(need("NSET"));
      t.axes.cylindrical = up("TYPE") == "C";
      t.place = at;
      if (up("TYPE") == "S") return refuse("*TRANSFORM, TYPE=S: R and C can be read"), true;
      s().transforms.push_back(t);
      return true;
    } else if (w == "EQUATION" || w == "MPC" || w == "BOUNDARY") {
      terms.clear();
      return true;
    } else {
      return false;
    }
    s().ties.push_back(tie);
    return true;
  }

  void other_word() {
    const auto refusal = refused_words().find(k.name);
    if (refusal != refused_words().end()) return refuse(fmt::format("*{} cannot be read: {}", k.name, refusal->second));
    skip = true;
    if (!harmless(k.name) && told.insert("*" + k.name).second) deck.notes.push_back(fmt::format("{}: *{} is ignored", where(at), k.name));
  }

  void read_data() {
    const std::string& w = k.name;
    if (w == "NODE") read_node();
    else if (w == "ELEMENT") read_element();
    else if (w == "NSET") read_set(s().node_sets[inp_upper(k.get("NSET"))], s().node_at);
    else if (w == "ELSET") read_set(s().element_sets[inp_upper(k.get("ELSET"))], s().element_at);
    else if (w == "SURFACE")
      s().surfaces[inp_upper(k.get("NAME"))].parts.emplace_back(f.empty() ? "" : inp_upper(f[0]), f.size() > 1 ? inp_upper(f[1]) : "");
    else if (w == "NGEN") read_ngen();
    else if (w == "NFILL") read_nfill();
    else if (w == "ELGEN") read_elgen();
    else if (w == "ELASTIC") read_elastic();
    else if (w == "DENSITY") {
      if (lines == 0) material().density = value(0, "density", 0.0) * units.density();
      else note("temperature dependent density: the first line is used");
    } else if (w == "SOLID SECTION" || w == "SHELL SECTION" || w.starts_with("BEAM")) read_section();
    else if (w == "NODAL THICKNESS")
      s().nodal_thickness[integer(f.empty() ? "" : f[0], "node number")] = value(1, "thickness", 0.0) * units.length;
    else if (w == "MASS") s().masses.back().numbers.push_back(value(0, "mass", 0.0) * units.mass);
    else if (w == "ROTARY INERTIA") read_rotary();
    else if (w == "SPRING") read_spring();
    else if (w == "NONSTRUCTURAL MASS") read_added_mass();
    else if (w == "ORIENTATION") read_orientation();
    else if (w == "TRANSFORM") read_axes(s().transforms.back().axes);
    else if (w == "KINEMATIC" || w == "KINEMATIC COUPLING" || w == "DISTRIBUTING COUPLING" || w == "TIE") read_tie();
    else if (w == "EQUATION") read_equation();
    else if (w == "MPC") read_mpc();
    else if (w == "SYSTEM") read_system();
    else if (w == "INSTANCE") read_instance();
  }

  void read_node() {
    if (f.empty()) return;
    const int id = integer(f[0], "node number");
    Vec3 x = Vec3::Zero();
    for (size_t i = 1; i < f.size() && i < 4; ++i) x(static_cast<Eigen::Index>(i) - 1) = f[i].empty() ? 0.0 : real(f[i], "coordinate");
    if (up("SYSTEM") == "C") {
      const double angle = x.y() * std::numbers::pi / 180.0;
      x = Vec3(x.x() * std::cos(angle), x.x() * std::sin(angle), x.z());
    }
    x = system_origin + system_axes * x * units.length;
    const auto [place, fresh] = s().node_at.try_emplace(id, static_cast<int>(s().nodes.size()));
    if (!fresh) {
      if ((s().nodes[static_cast<size_t>(place->second)] - x).norm() > 0.0)
        fail(fmt::format("node {} is defined twice, at two places", id));
    } else {
      s().node_ids.push_back(id);
      s().nodes.push_back(x);
    }
    if (const std::string set = up("NSET"); !set.empty()) add_member(s().node_sets[set], id);
  }

  static void add_member(InpSet& set, int id) {
    if (set.empty() || !set.back().instance.empty()) set.emplace_back();
    set.back().ids.push_back(id);
  }

  void read_element() {
    for (std::string_view part : f)
      if (!part.empty()) pending.push_back(integer(part, "element"));
    const size_t wants = static_cast<size_t>(type->nodes) + 1;
    if (pending.size() < wants) {
      // The next line goes on where this one ends with a comma, or has sixteen numbers, as many as a line may hold.
      if (!line.ends_with(',') && f.size() < 15) {
        const std::string text = fmt::format("element {} has {} nodes, {} are expected", pending.empty() ? 0 : pending[0],
                                             pending.empty() ? 0 : pending.size() - 1, wants - 1);
        pending.clear();
        fail(text);
      }
      return;
    }
    if (pending.size() > wants)
      note(fmt::format("{}: numbers beyond the {} nodes of a {} are passed over", where(at), wants - 1, type->name));
    InpElement e;
    e.id = pending[0];
    e.type = type;
    e.first = static_cast<int>(s().connectivity.size());
    e.place = at;
    if (!s().element_at.try_emplace(e.id, static_cast<int>(s().elements.size())).second) {
      pending.clear();
      fail(fmt::format("element {} is defined twice", e.id));
    }
    s().connectivity.insert(s().connectivity.end(), pending.begin() + 1, pending.begin() + static_cast<long>(wants));
    s().elements.push_back(e);
    if (const std::string set = up("ELSET"); !set.empty()) add_member(s().element_sets[set], e.id);
    pending.clear();
  }

  void read_set(InpSet& set, const std::unordered_map<int, int>& there) {
    InpMembers members;
    members.instance = up("INSTANCE");
    if (k.has("GENERATE")) {
      if (f.size() < 2) fail("GENERATE: 'first, last, step' is expected");
      const int first = integer(f[0], "first"), last = integer(f[1], "last"),
                by = f.size() > 2 && !f[2].empty() ? integer(f[2], "step") : 1;
      if (by <= 0 || last < first) fail(fmt::format("GENERATE: {} to {} by {} is no range", first, last, by));
      const std::unordered_map<int, int>* index = &there;
      for (const InpInstance& i : deck.instances)
        if (i.name == members.instance) index = &there == &s().node_at ? &deck.scopes[i.scope].node_at : &deck.scopes[i.scope].element_at;
      // Only numbers that exist are stored: a range may be larger than the model.
      if ((static_cast<long>(last) - first) / by > 4L * static_cast<long>(index->size()) + 16) {
        for (const auto& [id, i] : *index)
          if (id >= first && id <= last && (id - first) % by == 0) members.ids.push_back(id);
      } else {
        for (long id = first; id <= last; id += by)
          if (index->contains(static_cast<int>(id))) members.ids.push_back(static_cast<int>(id));
      }
    } else {
      for (std::string_view part : f) {
        if (part.empty()) continue;
        if (inp_is_integer(part)) members.ids.push_back(integer(part, "set member"));
        else members.names.push_back(inp_upper(part));
      }
    }
    set.push_back(std::move(members));
  }

  void read_ngen() {
    if (f.size() < 2 || (k.has("LINE") && up("LINE") != ""))
      return refuse("*NGEN: only nodes on a straight line, 'first, last, step', can be made");
    const int first = integer(f[0], "first"), last = integer(f[1], "last"), by = f.size() > 2 && !f[2].empty() ? integer(f[2], "step") : 1;
    const auto a = s().node_at.find(first), b = s().node_at.find(last);
    if (a == s().node_at.end() || b == s().node_at.end() || by <= 0 || last <= first || (last - first) / by > 10000000)
      fail(fmt::format("*NGEN: {} to {} by {}: both ends must be there, and the step lead from one to the other", first, last, by));
    const Vec3 from = s().nodes[a->second], to = s().nodes[b->second];
    for (long id = first; id <= last; id += by)
      make_node(static_cast<int>(id), from + (to - from) * (static_cast<double>(id - first) / static_cast<double>(last - first)));
  }

  // A node that a keyword makes, where none has its number, and its place in the keyword's NSET.
  void make_node(int id, const Vec3& x) {
    if (s().node_at.try_emplace(id, static_cast<int>(s().nodes.size())).second) {
      s().node_ids.push_back(id);
      s().nodes.push_back(x);
    }
    if (const std::string set = up("NSET"); !set.empty()) add_member(s().node_sets[set], id);
  }

  // Numbers of the nodes in a set, ascending, as the sets of decks are unless they say otherwise.
  std::vector<int> bounding_nodes(std::string_view name) {
    const auto found = s().node_sets.find(inp_upper(name));
    if (found == s().node_sets.end()) fail(fmt::format("*NFILL: node set '{}' is not there", name));
    std::set<int> ids;
    for (const InpMembers& members : found->second) {
      if (!members.names.empty()) fail(fmt::format("*NFILL: node set '{}' must hold numbers, not other sets", name));
      ids.insert(members.ids.begin(), members.ids.end());
    }
    return {ids.begin(), ids.end()};
  }

  // Nodes on straight lines from those of one set to those of another: 'set, set, intervals, step of the numbers'. The keyword's NSET has
  // the two sets' nodes too.
  void read_nfill() {
    if (k.has("BIAS") || k.has("SINGULAR") || k.has("TWOSTEP") || f.size() < 3)
      return refuse("*NFILL: only nodes at equal distances, 'set, set, intervals, step', can be made");
    const std::vector<int> from = bounding_nodes(f[0]), to = bounding_nodes(f[1]);
    const int intervals = integer(f[2], "number of intervals"), by = f.size() > 3 && !f[3].empty() ? integer(f[3], "step") : 1;
    if (from.size() != to.size() || from.empty() || intervals < 1 || intervals > 1000000 || by <= 0)
      fail(fmt::format("*NFILL: the sets have {} and {} nodes, {} intervals by {}: as many nodes in both, and positive numbers, are wanted",
                       from.size(), to.size(), intervals, by));
    for (size_t i = 0; i < from.size(); ++i) {
      const auto a = s().node_at.find(from[i]), b = s().node_at.find(to[i]);
      if (a == s().node_at.end() || b == s().node_at.end()) fail(fmt::format("*NFILL: node {} or {} is not there", from[i], to[i]));
      const Vec3 start = s().nodes[a->second], end = s().nodes[b->second];
      for (int j = 0; j <= intervals; ++j) {
        if ((j == 0 || j == intervals) && up("NSET").empty()) continue;
        const long id = from[i] + static_cast<long>(j) * by;
        if (id > std::numeric_limits<int>::max()) fail(fmt::format("*NFILL: node number {} is too large", id));
        if (j == intervals && id != to[i]) {
          add_member(s().node_sets[up("NSET")], to[i]);
          continue;
        }
        make_node(static_cast<int>(id), start + (end - start) * (static_cast<double>(j) / intervals));
      }
    }
  }

  // Copies of an element along up to three directions: 'element, then for rows, columns and layers: number, step of the nodes, step of the
  // elements'.
  void read_elgen() {
    const auto master = s().element_at.find(integer(f.empty() ? "" : f[0], "element number"));
    if (master == s().element_at.end()) fail(fmt::format("*ELGEN: element {} is not there", f[0]));
    long count[3] = {1, 1, 1}, node_step[3] = {1, 0, 0}, element_step[3] = {1, 0, 0};
    for (size_t d = 0; d < 3; ++d) {
      const auto number = [&](size_t i, long otherwise) -> long {
        return f.size() > i && !f[i].empty() ? integer(f[i], "number") : otherwise;
      };
      count[d] = number(1 + 3 * d, 1);
      node_step[d] = number(2 + 3 * d, 1);
      element_step[d] = number(3 + 3 * d, 1);
      if (count[d] < 1 || count[d] > 10000000) fail(fmt::format("*ELGEN: a number of elements is expected, found {}", count[d]));
    }
    if (count[0] * count[1] * count[2] > 50000000)
      fail(fmt::format("*ELGEN: {} x {} x {} elements are too many", count[0], count[1], count[2]));
    const InpElement first = s().elements[master->second];
    const std::string set = up("ELSET");
    bool listed = false;
    if (const auto there = s().element_sets.find(set); there != s().element_sets.end())
      for (const InpMembers& members : there->second)
        listed = listed || std::find(members.ids.begin(), members.ids.end(), first.id) != members.ids.end();
    for (long c = 0; c < count[2]; ++c)
      for (long b = 0; b < count[1]; ++b)
        for (long a = 0; a < count[0]; ++a) {
          const long id = first.id + a * element_step[0] + b * element_step[1] + c * element_step[2];
          if (a + b + c > 0) copy_element(first, id, a * node_step[0] + b * node_step[1] + c * node_step[2]);
          if (a + b + c > 0 || !listed) {
            if (!set.empty()) add_member(s().element_sets[set], static_cast<int>(id));
          }
        }
  }

  void copy_element(const InpElement& from, long id, long shift) {
    InpElement e = from;
    e.id = static_cast<int>(id);
    e.first = static_cast<int>(s().connectivity.size());
    e.place = at;
    if (id < 1 || id > std::numeric_limits<int>::max() || !s().element_at.try_emplace(e.id, static_cast<int>(s().elements.size())).second)
      fail(fmt::format("*ELGEN: element {} is there already, or has no number that an element may have", id));
    for (int i = 0; i < from.type->nodes; ++i) {
      const long node = s().connectivity[from.first + i] + shift;
      if (node < 1 || node > std::numeric_limits<int>::max()) fail(fmt::format("*ELGEN: element {} needs node {}", id, node));
      s().connectivity.push_back(static_cast<int>(node));
    }
    s().elements.push_back(e);
  }

  size_t constants() const {
    const std::string kind = up("TYPE");
    if (kind.starts_with("ENG") || kind.starts_with("ORTHO")) return 9;
    if (kind.starts_with("ANISO")) return 21;
    return kind == "LAMINA" ? 6 : 2;
  }

  void read_elastic() {
    if (numbers.size() >= constants()) return note("temperature dependent elasticity: the first line is used");
    const size_t room = constants() - numbers.size();
    for (size_t i = 0; i < f.size() && i < std::min<size_t>(room, 8); ++i)
      numbers.push_back(f[i].empty() ? 0.0 : real(f[i], "elastic constant"));
  }

  void finish_elastic() {
    const size_t n = constants();
    if (numbers.size() < n) {
      if (n == 2) fail("*ELASTIC: 'Young's modulus, Poisson's ratio' is expected");
      fail(fmt::format("*ELASTIC, TYPE={}: {} constants are expected, found {}", k.get("TYPE"), n, numbers.size()));
    }
    FeMaterial& m = material();
    const std::vector<double>& c = numbers;
    if (n == 2) {
      m.youngs_modulus = c[0] * units.stress();
      m.poisson = c[1];
      return;
    }
    // In the order xx yy zz xy yz xz of this program.
    Mat6 C = Mat6::Zero();
    if (n == 21) {
      // D1111 D1122 D2222 D1133 D2233 D3333, then the rows 12, 13, 23 of the triangle.
      constexpr int order[6] = {0, 1, 2, 3, 5, 4};
      size_t next = 0;
      for (int b = 0; b < 6; ++b)
        for (int a = 0; a <= b; ++a) C(order[a], order[b]) = C(order[b], order[a]) = c[next++];
    } else if (k.get("TYPE").starts_with('O') || k.get("TYPE").starts_with('o')) {
      C.topLeftCorner<3, 3>() << c[0], c[1], c[3], c[1], c[2], c[4], c[3], c[4], c[5];
      C(3, 3) = c[6];
      C(5, 5) = c[7];
      C(4, 4) = c[8];
    } else {
      // Moduli, Poisson's ratios, shear moduli; a lamina's third direction is like its second, without Poisson's effect.
      const double E1 = c[0], E2 = c[1], E3 = n == 6 ? c[1] : c[2], n12 = n == 6 ? c[2] : c[3], n13 = n == 6 ? 0.0 : c[4],
                   n23 = n == 6 ? 0.0 : c[5], G12 = n == 6 ? c[3] : c[6], G13 = n == 6 ? c[4] : c[7], G23 = n == 6 ? c[5] : c[8];
      Mat6 S = Mat6::Zero();
      for (const double modulus : {E1, E2, E3, G12, G13, G23})
        if (!(modulus > 0.0)) fail(fmt::format("*ELASTIC, TYPE={}: moduli must be > 0, found {:g}", k.get("TYPE"), modulus));
      S.topLeftCorner<3, 3>() << 1 / E1, -n12 / E1, -n13 / E1, -n12 / E1, 1 / E2, -n23 / E2, -n13 / E1, -n23 / E2, 1 / E3;
      S(3, 3) = 1 / G12;
      S(4, 4) = 1 / G23;
      S(5, 5) = 1 / G13;
      C = S.inverse();
    }
    m.elasticity = C * units.stress();
    m.youngs_modulus = C(0, 0) * units.stress();
  }

  void read_section() {
    if (s().sections.empty()) return;
    InpSection& made = s().sections.back();
    if (made.beam) {
      if (lines == 0) {
        for (std::string_view part : f) made.numbers.push_back(part.empty() ? 0.0 : real(part, "section"));
      } else if (lines == 1) {
        if (f.size() >= 3) made.n1 = Vec3(value(0, "n1", 0), value(1, "n1", 0), value(2, "n1", 0));
      } else if (lines == 2 && made.own_constants) {
        made.young = value(0, "Young's modulus", 0.0) * units.stress();
        made.shear = value(1, "shear modulus", 0.0) * units.stress();
      }
      if (lines == 0) {
        // Lengths; areas and moments of area of a general section.
        for (size_t i = 0; i < made.numbers.size(); ++i)
          made.numbers[i] *= made.shape != "GENERAL" ? units.length : i == 0 ? std::pow(units.length, 2) : std::pow(units.length, 4);
      }
      return;
    }
    if (made.shell && k.has("COMPOSITE")) {
      InpLayer layer;
      layer.thickness = value(0, "thickness of a layer", 0.0) * units.length;
      if (f.size() < 3 || f[2].empty()) fail("*SHELL SECTION, COMPOSITE: 'thickness, , material, orientation' is expected");
      layer.material = std::string(f[2]);
      if (f.size() > 3 && !f[3].empty()) {
        const char head = f[3][0];
        if ((head >= '0' && head <= '9') || head == '-' || head == '+' || head == '.')
          layer.angle = real(f[3], "angle") * std::numbers::pi / 180.0;
        else layer.orientation = inp_upper(f[3]);
      }
      made.layers.push_back(layer);
    } else if (lines == 0) {
      const double factor = made.shell ? units.length : units.length * units.length;
      made.numbers.push_back(value(0, "thickness", 0.0) * factor);
    }
  }

  void read_rotary() {
    InpValue& v = s().rotaries.back();
    for (size_t i = 0; i < 6; ++i) v.numbers.push_back(value(i, "moment of inertia", 0.0) * units.mass * units.length * units.length);
  }

  // Directions (SPRING1, SPRING2; a blank line for SPRINGA), then the stiffness.
  void read_spring() {
    std::vector<double>& row = s().springs.back().lines.emplace_back();
    for (std::string_view part : f) row.push_back(part.empty() ? 0.0 : real(part, "spring"));
  }

  void read_added_mass() {
    InpValue& v = s().added_masses.back();
    double factor = units.mass;
    if (v.unit == "MASS PER VOLUME") factor = units.density();
    else if (v.unit == "MASS PER AREA") factor = units.mass / (units.length * units.length);
    else if (v.unit == "MASS PER LENGTH") factor = units.mass / units.length;
    v.numbers.push_back(value(0, "mass", 0.0) * factor);
  }

  void read_axes(InpAxes& axes) {
    if (f.size() < 6) fail(fmt::format("*{}: two points, six numbers, are expected", k.name));
    for (size_t i = 0; i < 3; ++i) {
      axes.a(static_cast<Eigen::Index>(i)) = real(f[i], "coordinate") * units.length;
      axes.b(static_cast<Eigen::Index>(i)) = real(f[i + 3], "coordinate") * units.length;
    }
    Mat3 test;
    if (!axes.cylindrical && !axes.at(Vec3::Zero(), test)) fail(fmt::format("*{}: the two points give no directions", k.name));
    if (axes.cylindrical && !((axes.b - axes.a).norm() > 0.0)) fail(fmt::format("*{}: the two points give no axis", k.name));
  }

  void read_orientation() {
    InpAxes& axes = s().orientations[inp_upper(k.get("NAME"))];
    if (lines == 0) {
      if (!f.empty() && !f[0].empty() && std::isalpha(static_cast<unsigned char>(f[0][0])))
        return refuse("*ORIENTATION from a distribution cannot be read; give one of directions");
      return read_axes(axes);
    }
    if (lines == 1 && !f.empty()) {
      axes.about = integer(f[0], "axis");
      axes.angle = value(1, "angle", 0.0);
      if (axes.about < 1 || axes.about > 3) fail("*ORIENTATION: the axis of the rotation is 1, 2 or 3");
    }
  }

  void read_tie() {
    if (s().ties.empty() || f.empty()) return;
    InpTie& tie = s().ties.back();
    if (k.name == "TIE") {
      if (f.size() < 2) fail("*TIE: 'slave surface, master surface' is expected");
      if (!tie.surface.empty()) s().ties.push_back(tie);
      s().ties.back().surface = inp_upper(f[0]);
      s().ties.back().master = inp_upper(f[1]);
    } else if (k.name == "DISTRIBUTING COUPLING") {
      tie.members.emplace_back(inp_upper(f[0]), value(1, "weight", 1.0));
    } else {
      size_t from = 0;
      if (k.name == "KINEMATIC COUPLING") {
        tie.members.emplace_back(inp_upper(f[0]), 1.0);
        from = 1;
      }
      if (f.size() > from && !f[from].empty()) {
        const int first = integer(f[from], "direction"),
                  last = f.size() > from + 1 && !f[from + 1].empty() ? integer(f[from + 1], "direction") : first;
        if (first < 1 || last > 6 || last < first)
          fail(fmt::format("*{}: directions 1 to 6 are allowed, found {} to {}", k.name, first, last));
        tie.dofs.emplace_back(first - 1, last - 1);
      }
    }
  }

  void read_boundary() {
    static const std::map<std::string, std::vector<int>> kinds = {{"ENCASTRE", {0, 1, 2, 3, 4, 5}},
                                                                  {"PINNED", {0, 1, 2}},
                                                                  {"XSYMM", {0, 4, 5}},
                                                                  {"YSYMM", {1, 3, 5}},
                                                                  {"ZSYMM", {2, 3, 4}},
                                                                  {"XASYMM", {1, 2, 3}},
                                                                  {"YASYMM", {0, 2, 4}},
                                                                  {"ZASYMM", {0, 1, 5}},
                                                                  {"NOWARP", {}},
                                                                  {"NOOVAL", {}}};
    if (f.empty()) return;
    InpBoundary b;
    b.where = inp_upper(f[0]);
    b.step = step > 0;
    b.place = at;
    if (f.size() < 2) fail("*BOUNDARY: 'node or set, first dof, last dof' is expected");
    if (const auto kind = kinds.find(inp_upper(f[1])); kind != kinds.end()) {
      b.dofs = kind->second;
    } else {
      const int first = integer(f[1], "degree of freedom"),
                last = f.size() > 2 && !f[2].empty() ? integer(f[2], "degree of freedom") : first;
      if (first < 0 || last < first) fail(fmt::format("*BOUNDARY: degrees of freedom 1 to 6 are allowed, found {} to {}", first, last));
      if (first == 0 || first > 6) note("*BOUNDARY: degrees of freedom 0 and above 6 (temperature, pressure) are passed over");
      if (first > 6 || last == 0) return;
      b.dofs = span_of(std::max(first, 1), last);
      if (f.size() > 3 && value(3, "value", 0.0) != 0.0) note("*BOUNDARY with a value: fixed at zero");
    }
    if (b.step) note(fmt::format("{}: *BOUNDARY of the first step holds the model; --hold none leaves it free", where(at)));
    s().boundaries.push_back(b);
  }

  void read_equation() {
    if (wanted == 0 || terms.empty()) {
      if (terms.empty() && wanted == 0) {
        wanted = integer(f.empty() ? "" : f[0], "number of terms");
        if (wanted < 1 || wanted > 1000000) fail(fmt::format("*EQUATION: a number of terms is expected, found {}", wanted));
        return;
      }
    }
    for (std::string_view part : f) terms.emplace_back(part);
    if (static_cast<int>(terms.size()) < 3 * wanted) return;
    InpEquation made;
    made.place = at;
    for (size_t i = 0; i + 2 < static_cast<size_t>(3 * wanted); i += 3) {
      InpEquation::Term t;
      t.node = inp_upper(terms[i]);
      t.dof = integer(terms[i + 1], "degree of freedom") - 1;
      t.coefficient = real(terms[i + 2], "coefficient");
      if (t.dof < 0 || t.dof > 5) {
        terms.clear();
        wanted = 0;
        return refuse(fmt::format("*EQUATION: degrees of freedom 1 to 6 are allowed, found {}", t.dof + 1));
      }
      made.terms.push_back(t);
    }
    s().equations.push_back(made);
    terms.clear();
    wanted = 0;
  }

  void read_mpc() {
    if (f.empty()) return;
    InpMpc m;
    m.type = inp_upper(f[0]);
    m.place = at;
    for (size_t i = 1; i < f.size(); ++i)
      if (!f[i].empty()) m.nodes.push_back(inp_upper(f[i]));
    if (m.type != "BEAM" && m.type != "TIE" && m.type != "PIN")
      return refuse(fmt::format("*MPC of type {}: BEAM, TIE and PIN can be read; give others as *EQUATION", m.type));
    s().mpcs.push_back(m);
  }

  void read_system() {
    for (std::string_view part : f) system_points.push_back((part.empty() ? 0.0 : real(part, "coordinate")) * units.length);
    std::vector<double> p = system_points;
    p.resize(9, 0.0);
    const Vec3 a(p[0], p[1], p[2]), b(p[3], p[4], p[5]), c(p[6], p[7], p[8]);
    system_origin = a;
    if (system_points.size() < 6) return;
    Vec3 x = (b - a), y;
    if (system_points.size() < 9) {
      // Two points: x in the global xy plane, z stays.
      x.z() = 0.0;
      y = Vec3(-x.y(), x.x(), 0.0);
    } else {
      y = c - a;
    }
    if (!(x.norm() > 0.0) || !(x.cross(y).norm() > 1e-9 * x.norm() * y.norm())) fail("*SYSTEM: the points give no directions");
    system_axes.col(0) = x.normalized();
    system_axes.col(2) = x.cross(y).normalized();
    system_axes.col(1) = system_axes.col(2).cross(Vec3(system_axes.col(0)));
  }

  void read_instance() {
    InpInstance& i = deck.instances.back();
    if (lines == 0) {
      i.shift = Vec3(value(0, "shift", 0), value(1, "shift", 0), value(2, "shift", 0)) * units.length;
    } else if (lines == 1) {
      if (f.size() < 7) fail("*INSTANCE: two points of the axis and an angle, seven numbers, are expected");
      const Vec3 a = Vec3(value(0, "point", 0), value(1, "point", 0), value(2, "point", 0)) * units.length,
                 b = Vec3(value(3, "point", 0), value(4, "point", 0), value(5, "point", 0)) * units.length;
      if (!((b - a).norm() > 0.0)) fail("*INSTANCE: the two points give no axis");
      // Shifted first, then turned about the line through both points.
      i.turn = turned_about(b - a, value(6, "angle", 0));
      i.shift = i.turn * (i.shift - a) + a;
    }
  }
};

}  // namespace

bool InpAxes::at(const Vec3& place, Mat3& axes) const {
  if (cylindrical) {
    const Vec3 z = (b - a).normalized();
    const Vec3 r = (place - a) - z.dot(place - a) * z;
    if (!(r.norm() > 0.0)) return false;
    axes.col(0) = r.normalized();
    axes.col(1) = z.cross(Vec3(axes.col(0)));
    axes.col(2) = z;
  } else {
    const Vec3 z = a.cross(b);
    if (!(a.norm() > 0.0) || !(z.norm() > 1e-9 * a.norm() * b.norm())) return false;
    axes.col(0) = a.normalized();
    axes.col(2) = z.normalized();
    axes.col(1) = axes.col(2).cross(Vec3(axes.col(0)));
  }
  if (about > 0) axes = (turned_about(axes.col(about - 1), angle) * axes).eval();
  return true;
}

std::string InpDeck::where(const InpPlace& place) const {
  if (files.empty()) return "";
  const std::string& file = files[static_cast<size_t>(place.file)];
  return place.line > 0 ? fmt::format("{}:{}", file, place.line) : file;
}

InpDeck read_inp_tables(const std::filesystem::path& path, const FeUnits& units) { return Reader(units).take(path); }

}  // namespace flexframe::sim
