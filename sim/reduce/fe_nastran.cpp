// Nastran bulk data to a model. See read_nastran in fe_model.h.
#include "sim/reduce/fe_elements.h"
#include "sim/reduce/fe_nastran_cards.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <unordered_map>

namespace flexframe::sim {
namespace {

// Coordinates: origin and axes in space; cylindrical and spherical ones have angles in degrees.
struct Coordinates {
  char kind = 'R';
  Vec3 origin = Vec3::Zero();
  Mat3 axes = Mat3::Identity();

  Vec3 place(const Vec3& x) const {
    constexpr double degree = std::numbers::pi / 180.0;
    Vec3 local = x;
    if (kind == 'C') local = Vec3(x.x() * std::cos(degree * x.y()), x.x() * std::sin(degree * x.y()), x.z());
    if (kind == 'S')
      local = x.x() * Vec3(std::sin(degree * x.y()) * std::cos(degree * x.z()), std::sin(degree * x.y()) * std::sin(degree * x.z()),
                           std::cos(degree * x.y()));
    return origin + axes * local;
  }

  // Directions at a place.
  Mat3 directions(const Vec3& at) const {
    if (kind == 'R') return axes;
    const Vec3 r = axes.transpose() * (at - origin);
    const double phi = std::atan2(r.y(), r.x());
    Mat3 local;
    local.col(0) = Vec3(std::cos(phi), std::sin(phi), 0.0);
    local.col(1) = Vec3(-std::sin(phi), std::cos(phi), 0.0);
    local.col(2) = Vec3::UnitZ();
    if (kind == 'S') {
      const double theta = std::atan2(std::hypot(r.x(), r.y()), r.z());
      const Vec3 out = local.col(0), around = local.col(1);
      local.col(0) = std::sin(theta) * out + std::cos(theta) * Vec3::UnitZ();
      local.col(1) = std::cos(theta) * out - std::sin(theta) * Vec3::UnitZ();
      local.col(2) = around;
    }
    return axes * local;
  }
};

struct ElementCard {
  const char* name;
  FeShape shape;
  int corners;
  std::vector<int> order;  // place in the card of our node i; more nodes than corners: the quadratic one
  FeShape quadratic;
};

const std::vector<ElementCard>& element_cards() {
  static const std::vector<ElementCard> cards = {
      {"CTETRA", FeShape::tetrahedron4, 4, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9}, FeShape::tetrahedron10},
      {"CHEXA", FeShape::hexahedron8, 8, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15}, FeShape::hexahedron20},
      {"CPENTA", FeShape::wedge6, 6, {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14, 9, 10, 11}, FeShape::wedge15},
      {"CQUAD4", FeShape::quadrangle4, 4, {0, 1, 2, 3}, FeShape::quadrangle4},
      {"CQUADR", FeShape::quadrangle4, 4, {0, 1, 2, 3}, FeShape::quadrangle4},
      {"CTRIA3", FeShape::triangle3, 3, {0, 1, 2}, FeShape::triangle3},
      {"CTRIAR", FeShape::triangle3, 3, {0, 1, 2}, FeShape::triangle3},
      {"CQUAD8", FeShape::quadrangle8, 8, {0, 1, 2, 3, 4, 5, 6, 7}, FeShape::quadrangle8},
      {"CTRIA6", FeShape::triangle6, 6, {0, 1, 2, 3, 4, 5}, FeShape::triangle6}};
  return cards;
}

// Cards about loads, solutions, output and checks, which are no part of the structure.
bool harmless(const std::string& name) {
  static const std::set<std::string> words = {
      "PARAM",   "EIGRL",   "EIGR",    "EIGB",    "EIGC",    "FORCE",   "FORCE1",  "FORCE2", "MOMENT",  "MOMENT1", "PLOAD",
      "PLOAD1",  "PLOAD2",  "PLOAD4",  "GRAV",    "LOAD",    "TEMP",    "TEMPD",   "TEMPP1", "TABLED1", "TABLEM1", "TABDMP1",
      "FREQ",    "FREQ1",   "RFORCE",  "SPCD",    "DAREA",   "RLOAD1",  "TLOAD1",  "SUPORT", "SUPORT1", "ASET",    "ASET1",
      "OMIT",    "OMIT1",   "DLOAD",   "SET1",    "SET3",    "PLOTEL",  "DESVAR",  "DRESP1", "DVPREL1", "DCONSTR", "NLPARM",
      "TSTEP",   "TSTEPNL", "DOPTPRM", "MDLPRM",  "NXSTRAT", "USET",    "USET1",   "MAT4",   "MAT5",    "RFORCE1", "PLOADX1",
      "ACCEL",   "ACCEL1",  "TSTEP1",  "SESET",   "QSET1",   "CSET1",   "BSET1",   "FREQ2",  "FREQ3",   "FREQ4",   "RANDPS",
      "TABRND1", "AERO",    "AEROS",   "FLUTTER", "FLFACT",  "MKAERO1", "MKAERO2", "GRDSET", "CORD2R",  "CORD2C",  "CORD2S",
      "CORD1R",  "CORD1C",  "CORD1S",  "ECHOON",  "ECHOOFF", "SEUSET",  "PVISC",   "PDAMP",  "CDAMP1",  "CDAMP2",  "CVISC"};
  return words.contains(name);
}

class NastranReader {
 public:
  NastranReader(NastranDeck d, const FeUnits& u, const std::string& file) : deck(std::move(d)), units(u) { model.file = file; }

  FeModel run() {
    for (const NastranCard& c : deck.cards) sort_card(c);
    for (const auto& [id, c] : grids) add_grid(*c);
    for (const auto& entry : materials) guarded([&] { add_material(entry.first, *entry.second); });
    for (const NastranCard* c : elements) guarded([&] { add_element(*c); });
    for (const NastranCard* c : ties) guarded([&] { add_tie(*c); });
    add_conditions();
    if (model.elements.empty() && refusals.empty()) throw InputError(fmt::format("{}: no elements that can be used", model.file));
    if (!refusals.empty()) {
      constexpr size_t most = 30;
      std::vector<std::string> shown(refusals.begin(), refusals.begin() + static_cast<long>(std::min(most, refusals.size())));
      if (refusals.size() > most) shown.push_back(fmt::format("{}: and {} more", model.file, refusals.size() - most));
      throw InputError(fmt::format("{}", fmt::join(shown, "\n")));
    }
    return std::move(model);
  }

 private:
  NastranDeck deck;
  FeUnits units;
  FeModel model;
  std::vector<std::string> refusals;
  std::map<int, const NastranCard*> grids, materials, properties, coordinate_cards, springs;
  std::map<int, Coordinates> known_coordinates;
  std::vector<const NastranCard*> elements, ties, supports, equations;
  std::map<int, std::set<int>> unions;  // SPCADD, MPCADD
  std::unordered_map<int, int> node_at;
  std::map<int, int> displacement;  // node -> coordinates of its motions
  std::map<int, int> material_at, shell_layup, beam_section;
  std::set<int> element_ids;
  std::vector<bool> turning_nodes;
  double weight_to_mass = 1.0;

  template <class Work>
  void guarded(const Work& work) {
    try {
      work();
    } catch (const InputError& e) {
      if (std::find(refusals.begin(), refusals.end(), e.what()) == refusals.end()) refusals.emplace_back(e.what());
    }
  }
  void note(const std::string& text) {
    if (std::find(model.notes.begin(), model.notes.end(), text) == model.notes.end()) model.notes.push_back(text);
  }
  void once(std::map<int, const NastranCard*>& table, const NastranCard& c) {
    const int id = deck.integer(c, 0);
    const auto [at, fresh] = table.try_emplace(id, &c);
    if (!fresh && at->second->fields != c.fields)
      deck.fail(c, fmt::format("number {} is there twice (also in line {})", id, at->second->line));
  }

  void sort_card(const NastranCard& c) {
    const std::string& n = c.name;
    static const std::set<std::string> element_names = {"CBAR", "CBEAM", "CROD", "CONROD", "CTUBE", "CELAS1", "CELAS2", "CONM2", "CBUSH"};
    static const std::set<std::string> property_names = {"PSOLID", "PSHELL", "PCOMP", "PBAR",  "PBARL",
                                                         "PBEAM",  "PBEAML", "PROD",  "PELAS", "PBUSH"};
    if (n == "GRID") once(grids, c);
    else if (n == "MAT1" || n == "MAT8" || n == "MAT9" || n == "MAT2") once(materials, c);
    else if (n.starts_with("CORD")) {
      once(coordinate_cards, c);
      // Two systems by grids fit on one card.
      if (n.starts_with("CORD1") && !deck.blank(c, 4)) deck.fail(c, "give the second system on a card of its own");
    } else if (property_names.contains(n)) once(n == "PELAS" ? springs : properties, c);
    else if (element_names.contains(n) ||
             std::any_of(element_cards().begin(), element_cards().end(), [&](const ElementCard& e) { return n == e.name; }))
      elements.push_back(&c);
    else if (n == "RBE2" || n == "RBE3" || n == "RBAR") ties.push_back(&c);
    else if (n == "SPC" || n == "SPC1") supports.push_back(&c);
    else if (n == "MPC") equations.push_back(&c);
    else if (n == "SPCADD" || n == "MPCADD") {
      for (size_t k = 1; k < c.fields.size(); ++k)
        if (!deck.blank(c, k)) unions[(n[0] == 'S' ? 1 : -1) * deck.integer(c, 0)].insert(deck.integer(c, k));
    } else if (n == "PARAM" && c.fields[0] == "WTMASS") weight_to_mass = deck.real(c, 1, 1.0);
    else if (n.starts_with("CDAMP") || n == "CVISC")
      note(fmt::format("{}: {} is left out: damping comes with --damping, dampers in the scene", deck.where(c), n));
    else if (n.starts_with("BCT") || n.starts_with("BSURF") || n.starts_with("BCONT") || n == "BGSET")
      refuse(c,
             "contact is no part of a linear body: merge the nodes, or reduce the parts as bodies of their own and join them in the scene");
    else if (n == "DMIG" || n == "K2GG" || n == "GENEL") refuse(c, "give K and M of the whole as matrices (.mtx)");
    else if ((n[0] == 'C' && n.size() > 1 && std::isupper(static_cast<unsigned char>(n[1])) && !harmless(n) && n != "CEND") ||
             n == "RBE1" || n == "RROD" || n == "RTRPLT" || n == "SPOINT" || n == "CMASS2")
      refuse(c,
             "cannot be read; there are CTETRA CHEXA CPENTA CQUAD4 CQUAD8 CTRIA3 CTRIA6 CBAR CBEAM CROD CELAS1 CELAS2 CBUSH CONM2 RBE2 "
             "RBE3 RBAR MPC");
  }

  void refuse(const NastranCard& c, const std::string& text) {
    const std::string head = fmt::format(": {}: {}", c.name, text);
    // The first of each kind.
    if (std::none_of(refusals.begin(), refusals.end(), [&](const std::string& r) { return r.ends_with(head); }))
      refusals.push_back(deck.where(c) + head);
  }

  // ---- Places and directions -----------------------------------------------------------------------------------------------------------

  const Coordinates& coordinates(const NastranCard& from, int id, int depth = 0) {
    static const Coordinates basic;
    if (id == 0) return basic;
    if (const auto known = known_coordinates.find(id); known != known_coordinates.end()) return known->second;
    const auto card = coordinate_cards.find(id);
    if (card == coordinate_cards.end()) deck.fail(from, fmt::format("coordinate system {} is not there", id));
    if (depth > 100) deck.fail(from, fmt::format("coordinate system {} is defined by itself", id));
    const NastranCard& c = *card->second;
    if (c.name.size() < 6) deck.fail(c, "CORD1R, CORD1C, CORD1S, CORD2R, CORD2C and CORD2S can be read");
    Coordinates made;
    made.kind = c.name[5];
    Vec3 a, b, d;
    if (c.name[4] == '2') {
      const Coordinates& base = coordinates(c, deck.integer(c, 1), depth + 1);
      const auto point = [&](size_t k) {
        return base.place(scaled(base.kind, Vec3(deck.real(c, k), deck.real(c, k + 1), deck.real(c, k + 2))));
      };
      a = point(2);
      b = point(5);
      d = point(8);
    } else {
      const auto point = [&](size_t k) { return grid_place(c, deck.integer(c, k), depth + 1); };
      a = point(1);
      b = point(2);
      d = point(3);
    }
    made.origin = a;
    const Vec3 z = b - a, y = z.cross(d - a);
    if (!(y.norm() > 0.0)) deck.fail(c, "the three points give no directions");
    made.axes.col(2) = z.normalized();
    made.axes.col(1) = y.normalized();
    made.axes.col(0) = made.axes.col(1).cross(Vec3(made.axes.col(2)));
    return known_coordinates.emplace(id, made).first->second;
  }

  // Lengths in SI, angles left.
  Vec3 scaled(char kind, const Vec3& x) const {
    const double l = units.length;
    return kind == 'R' ? Vec3(l * x) : kind == 'C' ? Vec3(l * x.x(), x.y(), l * x.z()) : Vec3(l * x.x(), x.y(), x.z());
  }

  Vec3 grid_place(const NastranCard& from, int id, int depth = 0) {
    const auto it = grids.find(id);
    if (it == grids.end()) deck.fail(from, fmt::format("grid {} is not there", id));
    if (depth > 100) deck.fail(from, fmt::format("grid {} is placed by itself", id));
    const NastranCard& c = *it->second;
    const Coordinates& system = coordinates(c, deck.integer(c, 1), depth + 1);
    return system.place(scaled(system.kind, Vec3(deck.real(c, 2), deck.real(c, 3), deck.real(c, 4))));
  }

  void add_grid(const NastranCard& c) {
    const int id = deck.integer(c, 0);
    if (id <= 0) deck.fail(c, fmt::format("a number > 0 is expected, found {}", id));
    const int node = static_cast<int>(model.nodes.size());
    model.nodes.push_back(grid_place(c, id));
    model.node_ids.push_back(id);
    node_at[id] = node;
    if (const int cd = deck.integer(c, 5); cd > 0) displacement[node] = cd;
    for (int d : deck.components(c, 6)) hold(c, node, d);
  }

  int node(const NastranCard& c, size_t field) {
    const int id = deck.integer(c, field);
    const auto it = node_at.find(id);
    if (it == node_at.end()) deck.fail(c, fmt::format("grid {} is not there", id));
    return it->second;
  }

  Mat3 directions(const NastranCard& c, int node) {
    const auto it = displacement.find(node);
    return it == displacement.end() ? Mat3::Identity() : coordinates(c, it->second).directions(model.nodes[static_cast<size_t>(node)]);
  }

  void hold(const NastranCard& c, int node, int dof) {
    FeConstraint made;
    made.node = node;
    made.dof = dof;
    if (displacement.contains(node)) made.direction = directions(c, node).col(dof % 3);
    model.constraints.push_back(made);
  }

  // ---- Materials and properties
  // ----------------------------------------------------------------------------------------------------------

  void add_material(int id, const NastranCard& c) {
    FeMaterial m;
    m.name = fmt::format("{}", id);
    const double stress = units.stress(), density = units.density() * weight_to_mass;
    if (c.name == "MAT1") {
      double E = deck.real(c, 1), G = deck.real(c, 2), nu = deck.real(c, 3);
      if (deck.blank(c, 3) && E > 0.0 && G > 0.0) nu = E / (2 * G) - 1.0;
      else if (deck.blank(c, 1)) E = 2 * G * (1 + nu);
      else if (!deck.blank(c, 2) && !deck.blank(c, 3) && std::abs(G - E / (2 * (1 + nu))) > 0.02 * G)
        model.warnings.push_back(
            fmt::format("{}: MAT1 {}: G = {:g} is not E / (2 (1 + nu)) = {:g}; E and nu count", deck.where(c), id, G, E / (2 * (1 + nu))));
      m.youngs_modulus = E * stress;
      m.poisson = nu;
      m.density = deck.real(c, 4) * density;
    } else if (c.name == "MAT8") {
      const double E1 = deck.real(c, 1), E2 = deck.real(c, 2), nu = deck.real(c, 3), G = deck.real(c, 4), G1 = deck.real(c, 5, G),
                   G2 = deck.real(c, 6, G);
      if (!(E1 > 0.0 && E2 > 0.0 && G > 0.0)) deck.fail(c, "E1, E2 and G12 must be > 0");
      Mat6 S = Mat6::Zero();
      S.diagonal() << 1 / E1, 1 / E2, 1 / E2, 1 / G, 1 / (G2 > 0 ? G2 : G), 1 / (G1 > 0 ? G1 : G);
      S(0, 1) = S(1, 0) = -nu / E1;
      m.elasticity = S.inverse() * stress;
      m.youngs_modulus = E1 * stress;
      m.density = deck.real(c, 7) * density;
    } else if (c.name == "MAT9") {
      Mat6 C;
      size_t k = 1;
      for (int a = 0; a < 6; ++a)
        for (int b = a; b < 6; ++b) C(a, b) = C(b, a) = deck.real(c, k++);
      m.elasticity = C * stress;
      m.youngs_modulus = C(0, 0) * stress;
      m.density = deck.real(c, 22) * density;
    } else {
      deck.fail(c, "MAT1, MAT8 and MAT9 can be read");
    }
    material_at[id] = static_cast<int>(model.materials.size());
    model.materials.push_back(m);
  }

  int material(const NastranCard& c, size_t field) {
    const int id = deck.integer(c, field);
    const auto it = material_at.find(id);
    if (it == material_at.end()) deck.fail(c, fmt::format("material {} is not there", id));
    return it->second;
  }

  const NastranCard& property(const NastranCard& c, std::initializer_list<const char*> names) {
    const int id = deck.integer(c, 1);
    const auto it = properties.find(id);
    if (it == properties.end()) deck.fail(c, fmt::format("property {} is not there", id));
    if (std::none_of(names.begin(), names.end(), [&](const char* n) { return it->second->name == n; }))
      deck.fail(c, fmt::format("property {} is a {}; {} can be read", id, it->second->name, fmt::join(names, ", ")));
    return *it->second;
  }

  // A material with more density: non-structural mass.
  int heavier(int material, double more) {
    if (more == 0.0) return material;
    FeMaterial m = model.materials[static_cast<size_t>(material)];
    m.density += more;
    for (size_t k = 0; k < model.materials.size(); ++k)
      if (model.materials[k].name == m.name && model.materials[k].density == m.density) return static_cast<int>(k);
    model.materials.push_back(m);
    return static_cast<int>(model.materials.size()) - 1;
  }

  double area_mass() const { return units.mass * weight_to_mass / (units.length * units.length); }

  // ---- Elements
  // --------------------------------------------------------------------------------------------------------------------------

  FeElement& put(const NastranCard& c, FeShape shape, const std::vector<int>& nodes) {
    FeElement e;
    e.id = deck.integer(c, 0);
    if (!element_ids.insert(e.id).second) deck.fail(c, fmt::format("element {} is defined twice", e.id));
    e.shape = shape;
    e.first = static_cast<int>(model.connectivity.size());
    e.count = static_cast<int>(nodes.size());
    e.line = c.file == 0 ? c.line : 0;
    model.connectivity.insert(model.connectivity.end(), nodes.begin(), nodes.end());
    model.elements.push_back(e);
    return model.elements.back();
  }

  void add_element(const NastranCard& c) {
    if (c.name == "CELAS1" || c.name == "CELAS2") return add_spring(c);
    if (c.name == "CONM2") return add_mass(c);
    if (c.name == "CBUSH") return add_bush(c);
    if (c.name == "CBAR" || c.name == "CBEAM") return add_beam(c);
    if (c.name == "CROD" || c.name == "CONROD" || c.name == "CTUBE") return add_rod(c);
    const ElementCard& kind =
        *std::find_if(element_cards().begin(), element_cards().end(), [&](const ElementCard& e) { return c.name == e.name; });
    const bool shell = fe_is_shell(kind.shape);
    const size_t all = kind.order.size();
    size_t there = 0;
    for (size_t k = 0; k < all; ++k) there += deck.blank(c, 2 + k) || (shell && k >= static_cast<size_t>(kind.corners)) ? 0 : 1;
    if (there != static_cast<size_t>(kind.corners) && there != all)
      deck.fail(c, fmt::format("{} or {} grids are expected, found {}; elements with some of their middle grids cannot be read",
                               kind.corners, all, there));
    std::vector<int> nodes;
    for (size_t k = 0; k < there; ++k) nodes.push_back(node(c, 2 + static_cast<size_t>(kind.order[k])));
    const NastranCard& p = shell ? property(c, {"PSHELL", "PCOMP"}) : property(c, {"PSOLID"});
    FeElement& e = put(c, there == all ? kind.quadratic : kind.shape, nodes);
    if (e.shape == FeShape::hexahedron8) e.formulation = FeFormulation::incompatible;
    model.element_sets[fmt::format("PID_{}", deck.integer(p, 0))].push_back(static_cast<int>(model.elements.size()) - 1);
    auto& set = model.node_sets[fmt::format("PID_{}", deck.integer(p, 0))];
    set.insert(set.end(), nodes.begin(), nodes.end());
    if (shell) return finish_shell(c, p, kind.corners + 2, e);
    e.material = material(p, 1);
    if (!model.materials[static_cast<size_t>(e.material)].elasticity) return;
    const int cord = deck.integer(p, 2);
    if (cord < 0) deck.fail(p, "CORDM = -1 (axes of the element) cannot be read; give a coordinate system");
    Vec3 middle = Vec3::Zero();
    for (int n : nodes) middle += model.nodes[static_cast<size_t>(n)] / static_cast<double>(nodes.size());
    model.axes.push_back(coordinates(p, cord).directions(middle));
    e.axes = static_cast<int>(model.axes.size()) - 1;
  }

  void finish_shell(const NastranCard& c, const NastranCard& p, int theta, FeElement& e) {
    // CQUAD8 and CTRIA6 have T1 to T4 and T1 to T3 before the angle; CQUAD4 and CTRIA3 after it.
    size_t angle = static_cast<size_t>(theta);
    if (e.shape == FeShape::quadrangle8) angle = 14;
    double offset = deck.real(c, angle + 1) * units.length;
    if (e.shape == FeShape::quadrangle8) offset = deck.real(c, 15) * units.length;
    if (p.name == "PSHELL") {
      e.thickness = deck.real(p, 2) * units.length;
      if (!deck.blank(p, 3) && deck.integer(p, 3) != deck.integer(p, 1)) deck.fail(p, "MID2 other than MID1 cannot be read; use PCOMP");
      if (deck.blank(p, 3)) deck.fail(p, "without MID2 the shell has no bending stiffness; give MID2 = MID1");
      if (deck.real(p, 4, 1.0) != 1.0)
        deck.fail(p, fmt::format("12 I / T^3 other than 1 cannot be read, found {:g}; use PCOMP", deck.real(p, 4, 1.0)));
      e.material = heavier(material(p, 1), e.thickness > 0.0 ? deck.real(p, 7) * area_mass() / e.thickness : 0.0);
      if (offset != 0.0 && e.thickness > 0.0) {
        FeLayup layup;
        layup.offset = -offset / e.thickness;
        e.section = find_layup(layup);
      }
      if (!model.materials[static_cast<size_t>(e.material)].elasticity) return;
    } else {
      e.section = composite(p, offset, e.thickness);
    }
    // The first material axis: along the first edge turned by the angle, or of a coordinate system.
    Vec3 middle = Vec3::Zero();
    Mat3X X(3, e.count);
    for (int k = 0; k < e.count; ++k) X.col(k) = model.nodes[static_cast<size_t>(model.connectivity[static_cast<size_t>(e.first + k)])];
    middle = X.rowwise().mean();
    if (deck.is_integer(c, angle)) {
      model.axes.push_back(coordinates(c, deck.integer(c, angle)).directions(middle));
    } else {
      double area = 0.0;
      const Mat3 Q = shell_axes(e.shape, X, e.id, area);
      model.axes.push_back(Eigen::AngleAxisd(deck.real(c, angle) * std::numbers::pi / 180.0, Q.col(2)).toRotationMatrix() * Q);
    }
    e.axes = static_cast<int>(model.axes.size()) - 1;
  }

  int find_layup(const FeLayup& layup) {
    for (size_t k = 0; k < model.layups.size(); ++k)
      if (model.layups[k].layers.empty() && layup.layers.empty() && model.layups[k].offset == layup.offset) return static_cast<int>(k);
    model.layups.push_back(layup);
    return static_cast<int>(model.layups.size()) - 1;
  }

  // PCOMP; thickness comes back.
  int composite(const NastranCard& p, double offset, double& thickness) {
    FeLayup layup;
    const std::string lam = deck.blank(p, 7) ? "" : p.fields[7];
    if (!lam.empty() && lam != "SYM") deck.fail(p, fmt::format("LAM = {}: only SYM or blank can be read", lam));
    for (size_t k = 8; k + 2 < p.fields.size() + 2; k += 4) {
      if (deck.blank(p, k) && deck.blank(p, k + 1)) continue;
      FeLayer layer;
      layer.thickness = deck.real(p, k + 1) * units.length;
      layer.angle = deck.real(p, k + 2) * std::numbers::pi / 180.0;
      if (deck.blank(p, k)) {
        if (layup.layers.empty()) deck.fail(p, "the first layer has no material");
        layer.material = layup.layers.back().material;
      } else {
        layer.material = material(p, k);
      }
      if (layer.thickness == 0.0 && !layup.layers.empty()) layer.thickness = layup.layers.back().thickness;
      if (!(layer.thickness > 0.0)) deck.fail(p, fmt::format("a layer's thickness must be > 0, found {:g}", layer.thickness));
      layup.layers.push_back(layer);
    }
    if (layup.layers.empty()) deck.fail(p, "no layers");
    if (lam == "SYM")
      for (size_t k = layup.layers.size(); k-- > 0;) layup.layers.push_back(FeLayer(layup.layers[k]));
    thickness = 0.0;
    for (const FeLayer& l : layup.layers) thickness += l.thickness;
    if (const double more = deck.real(p, 2) * area_mass(); more != 0.0)
      for (FeLayer& l : layup.layers) l.material = heavier(l.material, more / thickness);
    const double bottom = deck.blank(p, 1) ? -0.5 * thickness : deck.real(p, 1) * units.length;
    layup.offset = -(bottom + offset) / thickness - 0.5;
    const int id = deck.integer(p, 0);
    if (offset == 0.0) {
      if (const auto it = shell_layup.find(id); it != shell_layup.end()) return it->second;
      shell_layup[id] = static_cast<int>(model.layups.size());
    }
    model.layups.push_back(layup);
    return static_cast<int>(model.layups.size()) - 1;
  }

  void add_beam(const NastranCard& c) {
    const NastranCard& p = property(c, {"PBAR", "PBARL", "PBEAM", "PBEAML"});
    const int a = node(c, 2), b = node(c, 3);
    for (size_t k : {size_t{8}, size_t{9}})
      if (!deck.components(c, k).empty())
        deck.fail(c, "ends that are released (PA, PB) cannot be read; split the node and tie it by an MPC");
    for (size_t k = 10; k < 16; ++k)
      if (deck.real(c, k) != 0.0) deck.fail(c, "ends beside the grids (WA, WB) cannot be read; put the grids on the axis, or use an RBAR");
    FeBeamSection s = section(p);
    if (deck.is_integer(c, 4) && deck.blank(c, 5)) {
      s.n1 = model.nodes[static_cast<size_t>(node(c, 4))] - model.nodes[static_cast<size_t>(a)];
    } else {
      s.n1 = directions(c, a) * Vec3(deck.real(c, 4), deck.real(c, 5), deck.real(c, 6));
    }
    if (!(s.n1.norm() > 0.0)) deck.fail(c, "the direction of plane 1 (X1, X2, X3 or G0) is missing");
    FeElement& e = put(c, FeShape::beam2, {a, b});
    e.material = material(p, 1);
    model.beam_sections.push_back(s);
    e.section = static_cast<int>(model.beam_sections.size()) - 1;
  }

  FeBeamSection section(const NastranCard& p) {
    FeBeamSection s;
    const double l2 = units.length * units.length, l4 = l2 * l2, line_mass = units.mass * weight_to_mass / units.length;
    if (p.name == "PBAR" || p.name == "PBEAM") {
      const bool bar = p.name == "PBAR";
      s.area = deck.real(p, 2) * l2;
      s.I22 = deck.real(p, 3) * l4;  // bending in plane 1, whose direction is n1
      s.I11 = deck.real(p, 4) * l4;
      s.I12 = deck.real(p, bar ? 18 : 5) * l4;
      s.torsion = deck.real(p, bar ? 5 : 6) * l4;
      s.mass_per_length = deck.real(p, bar ? 6 : 7) * line_mass;
      s.shear1 = deck.real(p, 16, 0.0) * s.area;
      s.shear2 = deck.real(p, 17, 0.0) * s.area;
      if (!bar) {
        s.shear1 = s.shear2 = s.area;
        if (p.fields.size() > 16 && !deck.blank(p, 16))
          model.warnings.push_back(fmt::format("{}: PBEAM: the section of end A counts for the whole beam", deck.where(p)));
      }
    } else {
      const std::string kind = deck.blank(p, 3) ? "" : p.fields[3];
      std::vector<double> d;
      for (size_t k = 8; k < p.fields.size() && !deck.blank(p, k); ++k) d.push_back(deck.real(p, k) * units.length);
      const size_t wants = kind == "ROD" ? 1 : kind == "TUBE" || kind == "BAR" ? 2 : kind == "BOX" ? 4 : 0;
      if (wants == 0) deck.fail(p, fmt::format("section {}: ROD, TUBE, BAR and BOX can be read; give others as PBAR", kind));
      if (d.size() < wants) deck.fail(p, fmt::format("section {}: {} dimensions are expected, found {}", kind, wants, d.size()));
      // Width lies along the element's z, height along its y, which is n1.
      std::optional<FeBeamSection> made = kind == "ROD"    ? beam_shape("CIRC", {d[0]})
                                          : kind == "TUBE" ? beam_shape("PIPE", {d[0], d[0] - d[1]})
                                          : kind == "BAR"  ? beam_shape("RECT", {d[1], d[0]})
                                                           : beam_shape("BOX", {d[1], d[0], d[2], d[3], d[2], d[3]});
      if (!made) deck.fail(p, fmt::format("section {}: dimensions > 0 are expected", kind));
      s = *made;
      if (d.size() > wants) s.mass_per_length = d[wants] / units.length * line_mass;
    }
    if (!(s.area > 0.0 && s.I11 > 0.0 && s.I22 > 0.0)) deck.fail(p, "area, I1 and I2 must be > 0");
    if (!(s.torsion > 0.0)) deck.fail(p, "J must be > 0: without it the beam turns about its axis freely");
    return s;
  }

  void add_rod(const NastranCard& c) {
    FeBeamSection s;
    s.truss = true;
    int a = 0, b = 0, mat = 0;
    if (c.name == "CONROD") {
      a = node(c, 1);
      b = node(c, 2);
      mat = material(c, 3);
      s.area = deck.real(c, 4) * units.length * units.length;
    } else {
      const NastranCard& p = property(c, {"PROD"});
      a = node(c, 2);
      b = node(c, 3);
      mat = material(p, 1);
      s.area = deck.real(p, 2) * units.length * units.length;
      if (deck.real(p, 3) != 0.0) note(fmt::format("{}: PROD: the torsion of rods is left out", deck.where(p)));
    }
    if (!(s.area > 0.0)) deck.fail(c, "a section area > 0 is expected");
    FeElement& e = put(c, FeShape::beam2, {a, b});
    e.material = mat;
    model.beam_sections.push_back(s);
    e.section = static_cast<int>(model.beam_sections.size()) - 1;
  }

  void lump(const NastranCard& c, const std::vector<int>& nodes, MatX K, MatX M, bool turns) {
    FeElement& e = put(c, FeShape::lumped, nodes);
    model.lumps.push_back({std::move(K), std::move(M), turns});
    e.section = static_cast<int>(model.lumps.size()) - 1;
  }

  void add_spring(const NastranCard& c) {
    double k = 0.0;
    if (c.name == "CELAS2") {
      k = deck.real(c, 1);
    } else {
      const auto p = springs.find(deck.integer(c, 1));
      if (p == springs.end()) deck.fail(c, fmt::format("property {} is not there", deck.integer(c, 1)));
      k = deck.real(*p->second, 1);
    }
    std::vector<int> nodes;
    std::vector<std::pair<int, int>> ends;
    for (size_t at : {size_t{2}, size_t{4}}) {
      if (deck.blank(c, at) || deck.integer(c, at) == 0) continue;
      const std::vector<int> dofs = deck.components(c, at + 1);
      if (dofs.size() != 1) deck.fail(c, "one motion, 1 to 6, is expected at each grid");
      ends.emplace_back(node(c, at), dofs[0]);
    }
    if (ends.empty()) deck.fail(c, "no grid");
    VecX b = VecX::Zero(6 * static_cast<Eigen::Index>(ends.size()));
    bool turns = false;
    double sign = 1.0;
    for (size_t i = 0; i < ends.size(); ++i) {
      nodes.push_back(ends[i].first);
      const int d = ends[i].second;
      turns = turns || d >= 3;
      b.segment<3>(6 * static_cast<Eigen::Index>(i) + (d < 3 ? 0 : 3)) = sign * directions(c, ends[i].first).col(d % 3);
      sign = -1.0;
    }
    // Force over length, moment over angle.
    const double unit = units.mass / (units.time * units.time) * (ends[0].second >= 3 ? units.length * units.length : 1.0);
    lump(c, nodes, k * unit * b * b.transpose(), MatX::Zero(b.size(), b.size()), turns);
  }

  void add_bush(const NastranCard& c) {
    const NastranCard& p = property(c, {"PBUSH"});
    if (deck.blank(p, 1) || p.fields[1] != "K") deck.fail(p, "K with six stiffnesses is expected first");
    const int a = node(c, 2);
    std::vector<int> nodes = {a};
    if (!deck.blank(c, 3)) nodes.push_back(node(c, 3));
    Mat3 Q = Mat3::Identity();
    const Vec3 axis =
        nodes.size() == 2 ? Vec3(model.nodes[static_cast<size_t>(nodes[1])] - model.nodes[static_cast<size_t>(a)]) : Vec3::Zero();
    if (!deck.blank(c, 7)) {
      Q = coordinates(c, deck.integer(c, 7)).directions(model.nodes[static_cast<size_t>(a)]);
      if (axis.norm() > 0.0) note(fmt::format("{}: CBUSH acts between its grids without the moments of their distance", deck.where(c)));
    } else {
      Vec3 v(deck.real(c, 4), deck.real(c, 5), deck.real(c, 6));
      if (deck.is_integer(c, 4) && deck.blank(c, 5)) v = model.nodes[static_cast<size_t>(node(c, 4))] - model.nodes[static_cast<size_t>(a)];
      if (!(axis.norm() > 0.0) || !(axis.cross(v).norm() > 0.0))
        deck.fail(c, "its directions are not given: a coordinate system (CID) is needed");
      Q.col(0) = axis.normalized();
      Q.col(2) = axis.cross(v).normalized();
      Q.col(1) = Q.col(2).cross(Vec3(Q.col(0)));
    }
    MatX k = MatX::Zero(6, 6);
    const double unit = units.mass / (units.time * units.time);
    Vec6 diagonal;
    bool turns = false;
    for (int d = 0; d < 6; ++d) {
      diagonal(d) = deck.real(p, static_cast<size_t>(2 + d)) * unit * (d >= 3 ? units.length * units.length : 1.0);
      turns = turns || (d >= 3 && diagonal(d) != 0.0);
    }
    k.topLeftCorner<3, 3>() = Q * diagonal.head<3>().asDiagonal() * Q.transpose();
    k.bottomRightCorner<3, 3>() = Q * diagonal.tail<3>().asDiagonal() * Q.transpose();
    const Eigen::Index n = 6 * static_cast<Eigen::Index>(nodes.size());
    MatX K = MatX::Zero(n, n);
    for (Eigen::Index i = 0; i < n; i += 6)
      for (Eigen::Index j = 0; j < n; j += 6) K.block<6, 6>(i, j) = i == j ? k : MatX(-k);
    lump(c, nodes, K, MatX::Zero(n, n), turns);
  }

  void add_mass(const NastranCard& c) {
    const int at = node(c, 1), cid = deck.integer(c, 2);
    const double m = deck.real(c, 3) * units.mass * weight_to_mass, unit = units.mass * weight_to_mass * units.length * units.length;
    Vec3 r = Vec3(deck.real(c, 4), deck.real(c, 5), deck.real(c, 6)) * units.length;
    Mat3 Q = Mat3::Identity();
    if (cid < 0) r -= model.nodes[static_cast<size_t>(at)];
    else {
      Q = coordinates(c, cid).directions(model.nodes[static_cast<size_t>(at)]);
      r = Q * r;
    }
    Mat3 J;
    const double xx = deck.real(c, 8), xy = -deck.real(c, 9), yy = deck.real(c, 10), xz = -deck.real(c, 11), yz = -deck.real(c, 12),
                 zz = deck.real(c, 13);
    J << xx, xy, xz, xy, yy, yz, xz, yz, zz;
    MatX M = MatX::Zero(6, 6);
    Mat3 lever;
    lever << 0, r.z(), -r.y(), -r.z(), 0, r.x(), r.y(), -r.x(), 0;  // velocity of the mass: v + w x r = v + lever w
    M.topLeftCorner<3, 3>() = m * Mat3::Identity();
    M.topRightCorner<3, 3>() = m * lever;
    M.bottomLeftCorner<3, 3>() = m * lever.transpose();
    M.bottomRightCorner<3, 3>() = m * lever.transpose() * lever + Q * (J * unit) * Q.transpose();
    if (!r.isZero(0.0) || !J.isZero(0.0)) return lump(c, {at}, MatX::Zero(6, 6), M, true);
    put(c, FeShape::point_mass, {at}).thickness = m;
  }

  // ---- Ties and supports
  // -------------------------------------------------------------------------------------------------------------------

  // Whether a node has rotations of its own; asked once all elements are there.
  bool turning(int node) {
    if (turning_nodes.empty()) {
      turning_nodes.assign(model.nodes.size(), false);
      for (const FeElement& e : model.elements) {
        const bool turns =
            fe_is_shell(e.shape) || (e.shape == FeShape::beam2 && !model.beam_sections[static_cast<size_t>(e.section)].truss);
        for (int k = 0; k < e.count && turns; ++k)
          turning_nodes[static_cast<size_t>(model.connectivity[static_cast<size_t>(e.first + k)])] = true;
      }
    }
    return turning_nodes[static_cast<size_t>(node)];
  }

  // Grids from a field on, with THRU.
  std::vector<int> grids_from(const NastranCard& c, size_t field) {
    std::vector<int> out;
    for (size_t k = field; k < c.fields.size(); ++k) {
      if (deck.blank(c, k)) continue;
      if (c.fields[k] == "THRU" && !out.empty() && k + 1 < c.fields.size()) {
        const int last = deck.integer(c, k + 1), first = model.node_ids[static_cast<size_t>(out.back())];
        if (last < first) deck.fail(c, fmt::format("{} THRU {} is no range", first, last));
        for (const auto& [id, card] : grids)
          if (id > first && id <= last) out.push_back(node_at.at(id));
        ++k;
      } else {
        out.push_back(node(c, k));
      }
    }
    return out;
  }

  void add_tie(const NastranCard& c) {
    FeSpider s;
    s.name = fmt::format("{}_{}", c.name, deck.integer(c, 0));
    s.line = c.line;
    if (c.name == "RBE3") return add_rbe3(c, s);
    std::vector<int> dofs = {0, 1, 2, 3, 4, 5};
    if (c.name == "RBE2") {
      s.node = node(c, 1);
      dofs = deck.components(c, 2);
      size_t last = c.fields.size();
      // A thermal expansion at the end is a number with a point.
      while (last > 3 && (deck.blank(c, last - 1) || (c.fields[last - 1].find('.') != std::string::npos))) --last;
      NastranCard cut = c;
      cut.fields.resize(last);
      s.slaves = grids_from(cut, 3);
    } else {
      const bool first = deck.components(c, 3).size() == 6, second = deck.components(c, 4).size() == 6;
      if (!first && !second) deck.fail(c, "all six independent motions at one end (CNA or CNB = 123456) are expected");
      s.node = node(c, first ? 1 : 2);
      s.slaves = {node(c, first ? 2 : 1)};
      if (const std::vector<int> given = deck.components(c, first ? 6 : 5); !given.empty()) dofs = given;
    }
    std::erase(s.slaves, s.node);
    if (s.slaves.empty()) deck.fail(c, "no dependent grids");
    const std::set<int> set(dofs.begin(), dofs.end());
    const bool translations = set.contains(0) && set.contains(1) && set.contains(2),
               rotations = set.contains(3) && set.contains(4) && set.contains(5);
    if (translations && (rotations || std::none_of(s.slaves.begin(), s.slaves.end(), [&](int n) { return turning(n); }))) {
      model.spiders.push_back(s);
      return;
    }
    for (int slave : s.slaves) partly(c, s.node, slave, set);
  }

  // Some motions only, in the dependent grid's directions.
  void partly(const NastranCard& c, int reference, int slave, const std::set<int>& dofs) {
    const Vec3 r = model.nodes[static_cast<size_t>(slave)] - model.nodes[static_cast<size_t>(reference)];
    const Mat3 Q = directions(c, slave);
    for (int d : dofs) {
      if (d >= 3 && !turning(slave)) continue;
      FeEquation e;
      e.line = c.line;
      const Vec3 along = Q.col(d % 3), arm = r.cross(along);
      Eigen::Index main = 0;
      along.cwiseAbs().maxCoeff(&main);
      const int base = d < 3 ? 0 : 3;
      for (int k = 0; k < 3; ++k) {
        const int axis = (static_cast<int>(main) + k) % 3;
        if (along(axis) != 0.0) e.terms.push_back({slave, base + axis, -along(axis)});
      }
      for (int k = 0; k < 3; ++k) {
        if (along(k) != 0.0) e.terms.push_back({reference, base + k, along(k)});
        if (d < 3 && arm(k) != 0.0) e.terms.push_back({reference, 3 + k, arm(k)});
      }
      model.equations.push_back(std::move(e));
    }
  }

  void add_rbe3(const NastranCard& c, FeSpider s) {
    s.rigid = false;
    s.node = node(c, 2);
    double weight = 0.0;
    bool open = false;
    size_t k = 4;
    // Groups: weight, motions, grids; a weight has a point.
    for (; k < c.fields.size(); ++k) {
      if (deck.blank(c, k)) continue;
      if (c.fields[k] == "UM" || c.fields[k] == "ALPHA") break;
      if (c.fields[k].find('.') != std::string::npos) {
        weight = deck.real(c, k);
        const std::vector<int> dofs = deck.components(c, ++k);
        const std::set<int> set(dofs.begin(), dofs.end());
        if (!set.contains(0) || !set.contains(1) || !set.contains(2))
          deck.fail(c, "grids that count with some of their translations only cannot be read; give 123");
        if (set.size() > 3) note(fmt::format("{}: RBE3 takes translations of its grids; their rotations are left out", deck.where(c)));
        open = true;
        continue;
      }
      if (!open) deck.fail(c, "a weight with a decimal point is expected before the grids");
      s.slaves.push_back(node(c, k));
      s.weights.push_back(weight);
    }
    if (s.slaves.empty()) deck.fail(c, "no grids");
    if (std::any_of(s.weights.begin(), s.weights.end(), [](double w) { return !(w > 0.0); })) deck.fail(c, "weights must be > 0");
    model.spiders.push_back(std::move(s));
  }

  // Whether a set of supports or equations is asked for; without case control, every one.
  bool asked(const char* what, int sign, int set) const {
    const auto chosen = deck.chosen.find(what);
    if (chosen == deck.chosen.end()) return true;
    if (chosen->second == set) return true;
    const auto both = unions.find(sign * chosen->second);
    return both != unions.end() && both->second.contains(set);
  }

  void add_conditions() {
    std::set<int> sets;
    for (const NastranCard* c : supports)
      guarded([&] {
        const int set = deck.integer(*c, 0);
        if (!asked("SPC", 1, set)) return;
        sets.insert(set);
        if (c->name == "SPC1") {
          for (int n : grids_from(*c, 2))
            for (int d : deck.components(*c, 1)) hold(*c, n, d);
          return;
        }
        for (size_t k = 1; k < c->fields.size(); k += 3) {
          if (deck.blank(*c, k)) continue;
          if (deck.real(*c, k + 2) != 0.0) note(fmt::format("{}: SPC with a value: fixed at zero", deck.where(*c)));
          for (int d : deck.components(*c, k + 1)) hold(*c, node(*c, k), d);
        }
      });
    if (sets.size() > 1 && !deck.chosen.contains("SPC"))
      model.warnings.push_back(fmt::format(
          "{}: {} sets of supports (SPC) and no case control that chooses: all of them hold the model (--hold none leaves it free)",
          model.file, sets.size()));
    for (const NastranCard* c : equations)
      guarded([&] {
        if (!asked("MPC", -1, deck.integer(*c, 0))) return;
        FeEquation e;
        e.line = c->line;
        // Two terms a line, the first field of a continuation is blank.
        for (size_t k = 1; k + 2 < c->fields.size(); k += k % 8 == 4 ? 5 : 3) {
          if (deck.blank(*c, k)) continue;
          const int n = node(*c, k);
          const std::vector<int> dofs = deck.components(*c, k + 1);
          if (dofs.size() != 1) deck.fail(*c, "one motion, 1 to 6, is expected at each grid");
          const Vec3 along = directions(*c, n).col(dofs[0] % 3);
          for (int d = 0; d < 3; ++d)
            if (along(d) != 0.0) e.terms.push_back({n, (dofs[0] < 3 ? 0 : 3) + d, deck.real(*c, k + 2) * along(d)});
        }
        if (e.terms.empty()) deck.fail(*c, "no terms");
        model.equations.push_back(std::move(e));
      });
    for (auto& [name, set] : model.node_sets) {
      std::sort(set.begin(), set.end());
      set.erase(std::unique(set.begin(), set.end()), set.end());
    }
  }
};

}  // namespace

FeModel read_nastran(const std::filesystem::path& path, const FeUnits& units) {
  return NastranReader(read_nastran_cards(path), units, path.string()).run();
}

}  // namespace flexframe::sim
