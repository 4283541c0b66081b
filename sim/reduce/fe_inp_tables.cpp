// Keywords of Abaqus / CalculiX input files to tables: which are read, passed over, refused. See fe_inp_tables.h.
#include "sim/reduce/fe_inp_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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
    return "plane and axisymmetric elements make no body in space; mesh it with solids or shells (surfaces that gmsh writes so beside "
           "solids: take the .msh, or leave these lines out; sets of their nodes stay)";
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
      {"CONTACT",
       "general contact is no part of a linear body: take it out, and tie what touches (*TIE), or reduce the parts as bodies of their own "
       "and join them in the scene"},
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

// Words of the model that a linear body has no use for: told as a note. Others that nobody knows may change the structure: a warning.
bool keyword_beyond_linear(const std::string& k) {
  static const std::set<std::string> words = {"PLASTIC",          "CREEP",
                                              "CYCLIC HARDENING", "DEFORMATION PLASTICITY",
                                              "VISCOELASTIC",     "VISCO",
                                              "DEPVAR",           "USER MATERIAL",
                                              "MOHR COULOMB",     "DRUCKER PRAGER",
                                              "RATE DEPENDENT",   "DAMAGE INITIATION",
                                              "DAMAGE EVOLUTION", "MULLINS EFFECT",
                                              "CONTROLS",         "SECTION CONTROLS",
                                              "FILM PROPERTY",    "RADIATE",
                                              "GAP CONDUCTANCE",  "GAP HEAT GENERATION",
                                              "CLEARANCE",        "CHANGE FRICTION",
                                              "CONTACT DAMPING",  "CONTACT INITIALIZATION DATA",
                                              "HYPERFOAM",        "PARAMETER",
                                              "FLUID CONSTANTS",  "SPECIFIC GAS CONSTANT",
                                              "RESISTIVITY",      "FILTER",
                                              "CORRELATION",      "SENSITIVITY",
                                              "CONSTRAINT",       "DESIGNVARIABLES",
                                              "OBJECTIVE",        "DESIGN RESPONSE",
                                              "SURFACE PROPERTY", "BASE MOTION",
                                              "DISTRIBUTION",     "DISTRIBUTION TABLE",
                                              "MODAL DAMPING",    "VALUES AT INFINITY",
                                              "CREATE FEM",       "NODE RESPONSE"};
  return words.contains(k);
}

// What keywords that are read may say, without blanks; what changes a linear body is read or refused where the keyword is.
const std::map<std::string, std::set<std::string>>& known_parameters() {
  static const std::map<std::string, std::set<std::string>> words = {
      {"NODE", {"NSET", "SYSTEM"}},
      {"ELEMENT", {"TYPE", "ELSET", "SOLIDELEMENTNUMBERING"}},
      {"NSET", {"NSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED", "ELSET"}},
      {"ELSET", {"ELSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED"}},
      {"SURFACE", {"NAME", "TYPE", "INTERNAL", "TRIM", "MAXRATIO", "DEFINITION"}},
      {"NGEN", {"NSET", "LINE"}},
      {"NFILL", {"NSET"}},
      {"ELGEN", {"ELSET"}},
      {"SYSTEM", {}},
      {"PART", {"NAME"}},
      {"INSTANCE", {"NAME", "PART"}},
      {"MATERIAL", {"NAME", "DESCRIPTION", "RTOL", "SRATEFACTOR", "STRAINRATEREGULARIZATION"}},
      {"ELASTIC", {"TYPE", "DEPENDENCIES", "MODULI"}},
      {"DENSITY", {"DEPENDENCIES"}},
      {"ORIENTATION", {"NAME", "SYSTEM", "DEFINITION"}},
      {"SOLID SECTION", {"ELSET", "MATERIAL", "ORIENTATION", "CONTROLS"}},
      {"SHELL SECTION",
       {"ELSET", "MATERIAL", "ORIENTATION", "OFFSET", "COMPOSITE", "SYMMETRIC", "NODALTHICKNESS", "SECTIONINTEGRATION", "POISSON",
        "CONTROLS", "THICKNESSMODULUS", "TEMPERATURE", "LAYUP"}},
      {"SHELL GENERAL SECTION",
       {"ELSET", "MATERIAL", "ORIENTATION", "OFFSET", "COMPOSITE", "SYMMETRIC", "NODALTHICKNESS", "POISSON", "CONTROLS", "THICKNESSMODULUS",
        "LAYUP"}},
      {"BEAM SECTION",
       {"ELSET", "MATERIAL", "SECTION", "ORIENTATION", "TEMPERATURE", "POISSON", "OFFSET1", "OFFSET2", "NODALTHICKNESS", "LUMPED",
        "ROTARYINERTIA", "CONTROLS"}},
      {"BEAM GENERAL SECTION",
       {"ELSET", "SECTION", "DENSITY", "POISSON", "ZERO", "LUMPED", "ROTARYINERTIA", "OFFSET1", "OFFSET2", "DEPENDENCIES"}},
      {"NODAL THICKNESS", {}},
      {"MASS", {"ELSET", "ALPHA", "COMPOSITE", "TYPE"}},
      {"ROTARY INERTIA", {"ELSET", "ORIENTATION", "ALPHA", "COMPOSITE"}},
      {"SPRING", {"ELSET", "ORIENTATION", "DEPENDENCIES", "RTOL"}},
      {"NONSTRUCTURAL MASS", {"ELSET", "UNITS"}},
      {"RIGID BODY", {"NSET", "ELSET", "TIENSET", "PINNSET", "REFNODE", "ROTNODE", "ISOTHERMAL"}},
      {"COUPLING", {"CONSTRAINTNAME", "SURFACE", "REFNODE", "ORIENTATION", "INFLUENCERADIUS"}},
      {"KINEMATIC", {}},
      {"DISTRIBUTING", {"COUPLING"}},
      {"KINEMATIC COUPLING", {"REFNODE", "ORIENTATION"}},
      {"DISTRIBUTING COUPLING", {"ELSET"}},
      {"TIE", {"NAME", "ADJUST", "POSITIONTOLERANCE", "TYPE", "NOROTATION", "CONSTRAINTRATIO"}},
      {"TRANSFORM", {"NSET", "TYPE"}},
      {"EQUATION", {}},
      {"MPC", {}},
      {"BOUNDARY", {"AMPLITUDE", "OP", "TYPE", "LOADCASE", "FIXED", "REGIONTYPE", "TIMEDELAY"}}};
  return words;
}

bool harmless_keyword(const std::string& k) {
  static const std::set<std::string> words = {"HEADING",     "PREPRINT",  "RESTART",      "NODE PRINT",     "NODE FILE",
                                              "NODE OUTPUT", "EL FILE",   "EL PRINT",     "ELEMENT OUTPUT", "OUTPUT",
                                              "AMPLITUDE",   "EXPANSION", "CONDUCTIVITY", "SPECIFIC HEAT",  "PHYSICAL CONSTANTS",
                                              "END STEP",    "DASHPOT",   "FRICTION",     "TIME POINTS",    "HOURGLASS STIFFNESS"};
  return words.contains(k);
}

}  // namespace

void InpTableReader::keyword(const InpKeyword& given) {
  k = given;
  if (k.name == "PART" || k.name == "ASSEMBLY" || k.name == "OUTPUT" || k.name == "BEAM GENERAL SECTION") deck.abaqus = true;
  if (k.name == "EXPANSION") expands = true;
  lines = 0;
  numbers.clear();
  skip = false;
  if (step > 0) in_step();
  else if (!structure() && !set_word() && !material_word() && !section_word() && !tie_word()) other_word();
  if (!skip) tell_unknown_parameters();
}

void InpTableReader::tell_unknown_parameters() {
  const auto known = known_parameters().find(k.name);
  if (known == known_parameters().end()) return;
  for (const auto& [key, value] : k.parameters)
    if (!known->second.contains(key) && key != "INPUT" && told.insert("*" + k.name + ", " + key).second)
      deck.warnings.push_back(
          fmt::format("{}: *{}, {} is not known and passed over: what it says is not in the body", where(at), k.name, key));
}

void InpTableReader::data(std::string_view text) {
  if (skip) return;
  line = text;
  f = inp_fields(text);
  if (k.name == "BOUNDARY") read_boundary();
  else if (step == 0) read_data();
  ++lines;
}

void InpTableReader::finish_keyword() {
  if (!pending.empty()) {
    const std::string text = fmt::format("the last element has {} nodes of {}", pending.size() - 1, type->nodes);
    pending.clear();
    fail(text);
  }
  if (k.name == "ELASTIC" && !skip && step == 0) finish_elastic();
  if (k.name.starts_with("SHELL") && k.has("SYMMETRIC") && !skip && step == 0 && !s().sections.empty()) {
    // Given are the layers up to the middle.
    std::vector<InpLayer>& layers = s().sections.back().layers;
    const std::vector<InpLayer> half(layers.rbegin(), layers.rend());
    layers.insert(layers.end(), half.begin(), half.end());
  }
  if (k.name == "EQUATION" && !terms.empty()) fail(fmt::format("*EQUATION: {} of {} terms", terms.size() / 3, wanted));
  k = {};
}

std::string InpTableReader::need(const char* key) const {
  std::string value = k.get(key);
  if (value.empty()) fail(fmt::format("*{} needs {}=...", k.name, key));
  return value;
}

void InpTableReader::warn_once(const char* word, const std::string& text) {
  if (told.insert(word).second) deck.warnings.push_back(fmt::format("{}: {}", where(at), text));
}

void InpTableReader::begin_step() {
  ++step;
  perturbs = k.has("PERTURBATION");
  if (perturbs && preloads)
    warn_once("*STEP, PERTURBATION",
              "*STEP, PERTURBATION: the loads of the steps before it are passed over, so the body is as stiff as without them, and has "
              "other frequencies than this step; forces of the scene stiffen it");
}

// Loads are the scene's to have, but what is told of a deck's structure once they act is not that of the body.
void InpTableReader::tell_of_load() {
  const bool heats = k.name == "TEMPERATURE";
  const bool softens = std::any_of(elastics.begin(), elastics.end(), [](const InpElastic& e) { return e.rows.size() > 1; });
  if (heats && softens)
    warn_once("*TEMPERATURE of elasticity",
              "*TEMPERATURE of a step is passed over, though elasticity depends on it: constants are those at the initial temperature; "
              "give *INITIAL CONDITIONS, TYPE=TEMPERATURE the one that counts");
  if (heats && expands)
    warn_once("*TEMPERATURE",
              "*TEMPERATURE of a step is passed over: the body does not expand by it, and where it is held it is as stiff as without the "
              "stress that follows");
  static const std::set<std::string> loads = {"CLOAD", "DLOAD", "DSLOAD"};
  if (!perturbs && (loads.contains(k.name) || (heats && expands))) preloads = true;
}

void InpTableReader::in_step() {
  if (k.name == "STEP") begin_step();
  if (k.name == "END STEP") ended = true;
  tell_of_load();
  if (k.name == "MODEL CHANGE" && k.has("REMOVE") && !up("TYPE").starts_with("CONTACT"))
    warn_once("*MODEL CHANGE",
              "*MODEL CHANGE, REMOVE of a step is passed over: the body has all elements; take those out of the deck that are not to be "
              "in it");
  skip = k.name != "BOUNDARY";
  if (skip) return;
  if (step > 1 || ended) {
    skip = true;
    note(fmt::format("{}: *BOUNDARY of later steps is passed over: the supports are those of the model and of the first step", where(at)));
    return;
  }
  if (up("OP") == "NEW")
    for (InpScope& other : deck.scopes) std::erase_if(other.boundaries, [](const InpBoundary& b) { return !b.step; });
}

bool InpTableReader::structure() {
  const std::string& w = k.name;
  if (w == "STEP") {
    begin_step();
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

void InpTableReader::begin_element() {
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
  refused_type = type == nullptr;
  if (refused_type) {
    static const InpType unknown = {"", left_out, none, full, 0};
    type = &unknown;
    deck.elements_refused = true;
    if (const std::string text = fmt::format("element type '{}' is not known; {}", name, advice_for(name)); told.insert(text).second)
      deck.refusals.push_back(fmt::format("{}: {}", where(at), text));
    return;
  }
  if (name == "C3D8R") note("C3D8R: integrated with incompatible modes like C3D8I (free of hourglass modes)");
  if (name == "C3D10M") note("C3D10M: taken as C3D10");
  if (type->kind == left_out) note(fmt::format("{}: {} is left out: damping comes with --damping, dampers in the scene", where(at), name));
}

bool InpTableReader::set_word() {
  const std::string& w = k.name;
  if (w == "NSET") {
    InpSet& set = s().node_sets[inp_upper(need("NSET"))];
    if (k.has("ELSET")) set.emplace_back().elements_of.push_back(up("ELSET"));
  } else if (w == "ELSET") s().element_sets[inp_upper(need("ELSET"))];
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

FeMaterial& InpTableReader::material() {
  if (deck.materials.empty()) fail(fmt::format("*{} before any *MATERIAL", k.name));
  return deck.materials.back();
}

void InpTableReader::warn_again() {
  deck.warnings.push_back(fmt::format("{}: material '{}' has *{} a second time: the last one counts", where(at), material().name, k.name));
}

bool InpTableReader::material_word() {
  const std::string& w = k.name;
  if (w == "MATERIAL") {
    deck.materials.push_back({need("NAME")});
    deck.material_places.push_back(at);
  } else if (w == "ELASTIC") {
    material();
    const std::string kind = up("TYPE");
    static const std::set<std::string> kinds = {"",      "ISO",         "ISOTROPIC", "ENGINEERINGCONSTANTS", "ENGINEERING CONSTANTS",
                                                "ORTHO", "ORTHOTROPIC", "ANISO",     "ANISOTROPIC",          "LAMINA"};
    if (!kinds.contains(kind))
      refuse(fmt::format("*ELASTIC, TYPE={}: ISO, ENGINEERING CONSTANTS, ORTHOTROPIC, ANISOTROPIC or LAMINA can be read", kind));
    const bool again =
        std::any_of(elastics.begin(), elastics.end(), [&](const InpElastic& e) { return e.material + 1 == deck.materials.size(); });
    if (again && !skip) warn_again();
    if (!skip) elastics.push_back({deck.materials.size() - 1, kind.empty() ? "ISO" : kind, {}, at});
  } else if (w == "DENSITY" || w == "HYPERELASTIC") {
    if (w == "DENSITY" && material().density != 0.0) warn_again();
    material();
  } else if (w == "INITIAL CONDITIONS") {
    skip = up("TYPE") != "TEMPERATURE";
    if (up("TYPE") == "STRESS")
      deck.warnings.push_back(fmt::format(
          "{}: *INITIAL CONDITIONS, TYPE=STRESS is passed over: the body is stiff as without that stress; forces of the scene stiffen it",
          where(at)));
  } else if (w == "SURFACE INTERACTION") {
    interaction = up("NAME");
    skip = true;
  } else if (w == "SURFACE BEHAVIOR") {
    if (up("PRESSURE-OVERCLOSURE") == "TIED") tying_interactions.insert(interaction);
    skip = true;
  } else if (w == "ORIENTATION") {
    InpAxes axes;
    const std::string system = up("SYSTEM");
    axes.cylindrical = system.starts_with("C");
    if (!system.empty() && !axes.cylindrical && !system.starts_with("R"))
      return refuse(fmt::format("*ORIENTATION, SYSTEM={}: RECTANGULAR or CYLINDRICAL can be read", system)), true;
    if (const std::string by = up("DEFINITION"); !by.empty() && by != "COORDINATES")
      return refuse(fmt::format("*ORIENTATION, DEFINITION={}: COORDINATES can be read", by)), true;
    s().orientations[inp_upper(need("NAME"))] = axes;
  } else {
    return false;
  }
  return true;
}

bool InpTableReader::section_word() {
  const std::string& w = k.name;
  if (w == "SOLID SECTION" || w == "SHELL SECTION" || w == "SHELL GENERAL SECTION" || w == "BEAM SECTION" || w == "BEAM GENERAL SECTION") {
    if (w == "SHELL GENERAL SECTION" && !k.has("MATERIAL") && !k.has("COMPOSITE"))
      return refuse("*SHELL GENERAL SECTION with a stiffness of its own cannot be read: give MATERIAL=... and a thickness, or COMPOSITE"),
             true;
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
    if (w == "MASS" && !up("TYPE").empty() && !up("TYPE").starts_with("ISO"))
      return refuse(fmt::format("*MASS, TYPE={}: one mass for all directions can be read", up("TYPE"))), true;
    (w == "MASS" ? s().masses : w == "SPRING" ? s().springs : w == "ROTARY INERTIA" ? s().rotaries : s().added_masses).push_back(v);
  } else {
    return false;
  }
  return true;
}

void InpTableReader::begin_section() {
  InpSection made;
  made.set = inp_upper(need("ELSET"));
  made.material = k.get("MATERIAL");
  made.orientation = up("ORIENTATION");
  made.shell = k.name.starts_with("SHELL");
  made.beam = k.name.starts_with("BEAM");
  made.own_constants = k.name == "BEAM GENERAL SECTION";
  made.shape = up("SECTION");
  if (made.shape == "RECTANGULAR") made.shape = "RECT";
  if (made.shape == "CIRCULAR") made.shape = "CIRC";
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

bool InpTableReader::tie_word() {
  const std::string& w = k.name;
  InpTie tie;
  tie.place = at;
  if (w == "RIGID BODY") {
    const std::string pins = up("PINNSET");
    tie.set = inp_upper(k.has("NSET") ? k.get("NSET") : k.get("TIENSET"));
    tie.element_set = up("ELSET");
    if (tie.set.empty() && tie.element_set.empty() && pins.empty()) fail("*RIGID BODY needs NSET=... or ELSET=...");
    tie.reference = inp_upper(k.get("REFNODE"));
    tie.rotation_node = inp_upper(k.get("ROTNODE"));
    tie.name = !tie.set.empty() ? tie.set : !tie.element_set.empty() ? tie.element_set : pins;
    if (!pins.empty()) {
      // Nodes whose translations alone follow.
      InpTie pinned = tie;
      pinned.set = pins;
      pinned.element_set.clear();
      pinned.dofs = {{0, 2}};
      if (tie.set.empty() && tie.element_set.empty()) return s().ties.push_back(pinned), true;
      if (tie.reference.empty()) fail("*RIGID BODY with PIN NSET and others needs REF NODE=...");
      pinned.rotation_node.clear();
      s().ties.push_back(pinned);
    }
  } else if (w == "COUPLING") {
    tie.kind = InpTie::Kind::coupling;
    tie.surface = inp_upper(need("SURFACE"));
    tie.reference = inp_upper(need("REFNODE"));
    tie.name = k.get("CONSTRAINTNAME").empty() ? tie.surface : up("CONSTRAINTNAME");
    tie.orientation = up("ORIENTATION");
    if (k.has("INFLUENCERADIUS")) tie.radius = real(k.get("INFLUENCERADIUS"), "INFLUENCE RADIUS") * units.length;
  } else if (w == "KINEMATIC" || w == "DISTRIBUTING") {
    if (s().ties.empty() || s().ties.back().kind != InpTie::Kind::coupling) fail(fmt::format("*{} without *COUPLING before it", w));
    s().ties.back().averaging = w == "DISTRIBUTING";
    return true;
  } else if (w == "KINEMATIC COUPLING") {
    tie.kind = InpTie::Kind::kinematic;
    tie.reference = tie.name = inp_upper(need("REFNODE"));
    tie.orientation = up("ORIENTATION");
  } else if (w == "DISTRIBUTING COUPLING") {
    tie.kind = InpTie::Kind::weights;
    tie.averaging = true;
    tie.element_set = tie.name = inp_upper(need("ELSET"));
  } else if (w == "TIE") {
    tie.kind = InpTie::Kind::surfaces;
    tie.adjust = up("ADJUST") != "NO";
    tie.rotations = !k.has("NOROTATION");
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
  } else if (w == "CONTACT PAIR") {
    return contact_pair(), true;
  } else if (w == "EQUATION" || w == "MPC" || w == "BOUNDARY") {
    terms.clear();
    return true;
  } else {
    return false;
  }
  s().ties.push_back(tie);
  return true;
}

void InpTableReader::other_word() {
  const auto refusal = refused_words().find(k.name);
  if (refusal != refused_words().end()) return refuse(fmt::format("*{} cannot be read: {}", k.name, refusal->second));
  skip = true;
  if (harmless_keyword(k.name) || !told.insert("*" + k.name).second) return;
  if (k.name == "DAMPING")
    return deck.notes.push_back(fmt::format("{}: *DAMPING is left out: damping comes with --damping, or from the scene", where(at)));
  if (keyword_beyond_linear(k.name)) return deck.notes.push_back(fmt::format("{}: *{} is ignored", where(at), k.name));
  if (k.name == "NORMAL")
    return deck.warnings.push_back(
        fmt::format("{}: *NORMAL is not read: shells and beams have the normals of their elements; where they meet at an angle, or their "
                    "nodes lie beside the middle, the deck's own differ",
                    where(at)));
  deck.warnings.push_back(fmt::format("{}: *{} is not known and passed over: what it says is not in the body", where(at), k.name));
}

void InpTableReader::read_data() {
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
  else if (w == "HYPERELASTIC") read_hyperelastic();
  else if (w == "INITIAL CONDITIONS") temperatures.push_back(value(1, "temperature", 0.0));
  else if (w == "DENSITY") {
    if (lines == 0) material().density = value(0, "density", 0.0) * units.density();
    else note("temperature dependent density: the first line is used");
  } else if (w == "SOLID SECTION" || w.starts_with("SHELL") || w.starts_with("BEAM")) read_section();
  else if (w == "NODAL THICKNESS") read_thickness();
  else if (w == "MASS") s().masses.back().numbers.push_back(value(0, "mass", 0.0) * units.mass);
  else if (w == "ROTARY INERTIA") read_rotary();
  else if (w == "SPRING") read_spring();
  else if (w == "NONSTRUCTURAL MASS") read_added_mass();
  else if (w == "ORIENTATION") read_orientation();
  else if (w == "TRANSFORM") read_axes(s().transforms.back().axes);
  else if (w == "KINEMATIC" || w == "DISTRIBUTING" || w == "KINEMATIC COUPLING" || w == "DISTRIBUTING COUPLING" || w == "TIE" ||
           w == "CONTACT PAIR")
    read_tie();
  else if (w == "EQUATION") read_equation();
  else if (w == "MPC") read_mpc();
  else if (w == "SYSTEM") read_system();
  else if (w == "INSTANCE") read_instance();
}

std::string InpDeck::where(const InpPlace& place) const {
  if (files.empty()) return "";
  const std::string& file = files[place.file];
  return place.line > 0 ? fmt::format("{}:{}", file, place.line) : file;
}

InpDeck read_inp_tables(const std::filesystem::path& path, const FeUnits& units, FeContact contact) {
  return InpTableReader(units, contact).take(path);
}

}  // namespace flexframe::sim
