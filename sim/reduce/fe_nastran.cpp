// Nastran bulk data to a model: cards, coordinate systems, grids, materials. See read_nastran in fe_model.h.
#include "sim/reduce/fe_nastran_reader.h"

#include <charconv>
#include <cmath>

namespace flexframe::sim {
namespace {

// Cards about loads, solutions, output and checks, which are no part of the structure.
bool harmless_card(const std::string& name) {
  static const std::set<std::string> words = {
      "PARAM",   "EIGRL",   "EIGR",   "EIGB",    "EIGC",   "FORCE",   "FORCE1",  "FORCE2",  "MOMENT",  "MOMENT1", "PLOAD",   "PLOAD1",
      "PLOAD2",  "PLOAD4",  "GRAV",   "LOAD",    "TEMP",   "TEMPD",   "TEMPP1",  "TABLED1", "TABLEM1", "TABDMP1", "FREQ",    "FREQ1",
      "RFORCE",  "SPCD",    "DAREA",  "RLOAD1",  "TLOAD1", "SUPORT",  "SUPORT1", "ASET",    "ASET1",   "OMIT",    "OMIT1",   "DLOAD",
      "SET1",    "SET3",    "PLOTEL", "DESVAR",  "DRESP1", "DVPREL1", "DCONSTR", "NLPARM",  "TSTEP",   "TSTEPNL", "DOPTPRM", "MDLPRM",
      "NXSTRAT", "USET",    "USET1",  "MAT4",    "MAT5",   "RFORCE1", "PLOADX1", "ACCEL",   "ACCEL1",  "TEMPRB",  "TABLED2", "TABLED3",
      "TABLEM2", "TABLES1", "RLOAD2", "TLOAD2",  "DELAY",  "DPHASE",  "TSTEP1",  "SESET",   "QSET1",   "CSET1",   "BSET1",   "FREQ2",
      "FREQ3",   "FREQ4",   "RANDPS", "TABRND1", "AERO",   "AEROS",   "FLUTTER", "FLFACT",  "MKAERO1", "MKAERO2", "CSSCHD",  "CBARAO",
      "CONV",    "CONVM",   "RADBC",  "AEFACT",  "AELIST", "AESURF",  "AESTAT",  "AELINK",  "SPLINE1", "SPLINE2", "SPLINE4", "SPLINE5",
      "TRIM",    "TRIMOPT", "GUST",   "DIVERG",  "DMI",    "TIC",     "SPCOFF",  "TOPVAR",  "EIGP",    "DTI",     "ECHOON",  "ECHOOFF",
      "SEUSET",  "PVISC",   "PDAMP",  "CDAMP1",  "CDAMP2", "CVISC"};
  return words.contains(name);
}

// Of heat, flutter, optimisation, large strains and non-structural mass that is not chosen: no part of a linear body.
bool card_beyond_linear(const std::string& name) {
  static constexpr std::array beginnings = {"MAT",    "NSM",   "DEFORM", "DV",    "DRESP",  "DCON", "DLINK", "DSCREEN",
                                            "DTABLE", "DOPT",  "DESV",   "CHBDY", "RAD",    "VIEW", "QBDY",  "QHBDY",
                                            "QVOL",   "QVECT", "TABLE",  "TABD",  "MONPNT", "AE"};
  return std::any_of(beginnings.begin(), beginnings.end(), [&](const char* b) { return name.starts_with(b); });
}

}  // namespace

FeModel NastranReader::run() {
  complaints.texts = deck.complaints;
  for (const NastranCard& c : deck.cards) complaints.guarded([&] { sort_card(c); });
  // What follows would only name what is missing with the file.
  if (deck.incomplete) complaints.raise(model.file);
  for (const auto& entry : grids) attempt([&] { add_grid(*entry.second); });
  if (grids.empty()) {
    complaints.texts.push_back(fmt::format("{}: no grids", model.file));
    complaints.raise(model.file);
  }
  for (const auto& entry : materials) attempt([&] { add_material(entry.first, *entry.second); });
  // Springs on arms ask which grids turn.
  for (const bool bushes : {false, true})
    for (const NastranCard* c : elements)
      if ((c->name == "CBUSH") == bushes) attempt([&] { add_element(*c); });
  turning_nodes.clear();
  for (const NastranCard* c : ties) attempt([&] { add_tie(*c); });
  add_conditions();
  if (!partial_means.empty())
    attempt([&] {
      turning(0);
      add_partial_means(model, std::move(partial_means), turning_nodes);
    });
  complaints.raise(model.file);
  if (model.elements.empty()) throw InputError(fmt::format("{}: no elements that can be used", model.file));
  allow_massless();
  const bool coupled_mass = std::any_of(deck.cards.begin(), deck.cards.end(), [&](const NastranCard& c) {
    return c.name == "PARAM" && c.fields.size() > 1 && c.fields[0] == "COUPMASS" && deck.integer(c, 1, -1) > 0;
  });
  if (!coupled_mass && std::any_of(model.elements.begin(), model.elements.end(),
                                   [](const FeElement& e) { return fe_is_solid(e.shape) || e.shape == FeShape::beam2; }))
    model.notes.emplace_back(
        "the mass of solids, beams and rods is spread as their shapes say; Nastran lumps it at the grids unless PARAM,COUPMASS,1 says "
        "otherwise: a coarse deck has lower frequencies there");
  return std::move(model);
}

void NastranReader::once(std::map<int, const NastranCard*>& table, const NastranCard& c) {
  const int id = deck.integer(c, 0);
  const auto [at, fresh] = table.try_emplace(id, &c);
  if (!fresh && at->second->fields != c.fields)
    deck.fail(c, fmt::format("number {} is there twice (also in line {})", id, at->second->line));
}

void NastranReader::sort_card(const NastranCard& c) {
  const std::string& n = c.name;
  static const std::set<std::string> element_names = {"CBAR",   "CBEAM", "CROD",  "CONROD", "CTUBE",  "CELAS1",
                                                      "CELAS2", "CONM2", "CBUSH", "CONM1",  "CMASS1", "CMASS2"};
  static const std::set<std::string> property_names = {"PSOLID", "PSHELL", "PCOMP", "PCOMPG", "PBAR", "PBARL",
                                                       "PBEAM",  "PBEAML", "PROD",  "PTUBE",  "PBUSH"};
  if (n == "GRID") once(grids, c);
  else if (n == "GRDSET") grid_defaults = &c;
  else if (n == "BAROR") bar_defaults = &c;
  else if (n == "BEAMOR") beam_defaults = &c;
  else if (n == "MAT1" || n == "MAT8" || n == "MAT9" || n == "MAT2" || n == "MAT11") once(materials, c);
  else if (n.starts_with("CORD")) {
    once(coordinate_cards, c);
    // Two systems by grids fit on one card.
    if (n.starts_with("CORD1") && !deck.blank(c, 4)) deck.fail(c, "give the second system on a card of its own");
  } else if (property_names.contains(n)) once(properties, c);
  else if (n == "PELAS") scalar_properties(springs, c, 4);
  else if (n == "PMASS") scalar_properties(scalar_masses, c, 2);
  else if (element_names.contains(n) || std::any_of(nastran_element_cards().begin(), nastran_element_cards().end(),
                                                    [&](const NastranElementCard& e) { return n == e.name; }))
    elements.push_back(&c);
  else if (n == "RBE2" || n == "RBE3" || n == "RBAR" || n == "RBE1" || n == "RROD" || n == "RTRPLT") ties.push_back(&c);
  else if (n == "SPC" || n == "SPC1") supports.push_back(&c);
  else if (n == "MPC") equations.push_back(&c);
  else if (n == "SPCADD" || n == "MPCADD") {
    for (size_t k = 1; k < c.fields.size(); ++k)
      if (!deck.blank(c, k)) unions[(n[0] == 'S' ? 1 : -1) * deck.integer(c, 0)].insert(deck.integer(c, k));
  } else if (n == "PARAM" && c.fields[0] == "WTMASS") weight_to_mass = deck.real(c, 1, 1.0);
  else if (n.starts_with("CDAMP") || n == "CVISC")
    add_once(model.notes, fmt::format("{}: {} is left out: damping comes with --damping, dampers in the scene", deck.where(c), n));
  else if (!refused_card(c) && !harmless_card(n)) note_other(c);
}

bool NastranReader::refused_card(const NastranCard& c) {
  const std::string& n = c.name;
  const bool mass = n == "NSM" || n == "NSM1" || n == "NSML" || n == "NSML1" || n == "NSMADD";
  if (n.starts_with("BCT") || n.starts_with("BSURF") || n.starts_with("BCONT") || n == "BGSET")
    refuse(c,
           "contact is no part of a linear body: merge the nodes, or reduce the parts as bodies of their own and join them in the scene");
  else if (n == "DMIG" || n == "K2GG" || n == "GENEL") refuse(c, "give K and M of the whole as matrices (.mtx)");
  else if (n == "SPOINT" || n == "EPOINT" || n == "CELAS3" || n == "CELAS4" || n == "CMASS3" || n == "CMASS4")
    refuse(c, "scalar points have no place in space, and so no place in a body that moves there");
  else if (n[0] == '=') refuse(c, "cards that repeat the one before with a step cannot be read: write them out");
  else if (mass && deck.chosen.contains("NSM")) refuse(c, "give the mass as NSM of PSHELL, PBAR, PBEAM or as CONM2");
  else if (n == "CSHEAR") refuse(c, "shear panels cannot be read; use CQUAD4 with a thin PSHELL and rods at its edges");
  else if ((n[0] == 'C' && n.size() > 1 && std::isupper(static_cast<unsigned char>(n[1])) && !harmless_card(n) && n != "CEND" &&
            !n.starts_with("CAERO") && !n.starts_with("CHBDY")) ||
           n == "RSPLINE" || n == "RSSCON" || n == "RJOINT" || n == "RTRPLT1")
    refuse(c,
           "cannot be read; there are CTETRA CHEXA CPENTA CQUAD4 CQUAD8 CTRIA3 CTRIA6 CBAR CBEAM CROD CTUBE CELAS1 CELAS2 CBUSH CMASS1 "
           "CMASS2 CONM1 CONM2 RBE1 RBE2 RBE3 RBAR RROD RTRPLT MPC");
  else return false;
  return true;
}

void NastranReader::scalar_properties(std::map<int, std::pair<const NastranCard*, size_t>>& table, const NastranCard& c, size_t step) {
  for (size_t k = 0; k < c.fields.size(); k += step) {
    if (deck.blank(c, k)) continue;
    const int id = deck.integer(c, k);
    const auto [at, fresh] = table.try_emplace(id, &c, k);
    if (!fresh && deck.real(*at->second.first, at->second.second + 1) != deck.real(c, k + 1))
      deck.fail(c, fmt::format("number {} is there twice (also in line {})", id, at->second.first->line));
  }
}

void NastranReader::note_other(const NastranCard& c) {
  const bool property = c.name[0] == 'P' && deck.is_integer(c, 0);
  if (property) other_properties.try_emplace(deck.integer(c, 0), c.name);
  const bool aero = c.name.starts_with("CAERO") || c.name.starts_with("PAERO") || c.name.starts_with("PAN");
  if (property || aero || !told.insert(c.name).second) return;
  if (card_beyond_linear(c.name)) add_once(model.notes, fmt::format("{}: {} is ignored", deck.where(c), c.name));
  else model.warnings.push_back(fmt::format("{}: {} is not known and passed over: what it says is not in the body", deck.where(c), c.name));
}

void NastranReader::allow_massless() {
  std::vector<bool> used(model.materials.size(), false);
  bool mass = false;
  for (const FeElement& e : model.elements) {
    if (e.shape == FeShape::point_mass) mass = mass || e.thickness > 0.0;
    else if (e.shape == FeShape::lumped) mass = mass || !model.lumps[e.section].M.isZero(0.0);
    else if (e.shape == FeShape::beam2) mass = mass || model.beam_sections[e.section].mass_per_length > 0.0;
    if (e.material >= 0) used[e.material] = true;
    if (!fe_is_shell(e.shape) || e.section < 0) continue;
    const FeLayup& layup = model.layups[e.section];
    for (const FeLayer& l : layup.layers) used[l.material] = true;
    // What only bends or shears gives no mass.
    for (const int m : {layup.bending_material, layup.shear_material})
      if (m >= 0) model.materials[m].massless = true;
  }
  for (size_t i = 0; i < used.size(); ++i) mass = mass || (used[i] && model.materials[i].density > 0.0);
  for (size_t i = 0; i < used.size() && mass; ++i) {
    FeMaterial& m = model.materials[i];
    if (!used[i] || m.density != 0.0) continue;
    m.massless = true;
    model.warnings.push_back(
        fmt::format("{}: material {} has no density (RHO): what is made of it has no mass; --density {}=... in kg/m^3 gives it one",
                    model.file, m.name, m.name));
  }
}

void NastranReader::refuse(const NastranCard& c, const std::string& text) {
  const std::string head = fmt::format(": {}: {}", c.name, text);
  // The first of each kind, and the lines of a few more.
  std::vector<std::string>& texts = complaints.texts;
  const auto same = std::find_if(texts.begin(), texts.end(), [&](const std::string& r) { return r.find(head) != std::string::npos; });
  if (same == texts.end()) return texts.push_back(deck.where(c) + head);
  constexpr size_t most = 8;
  const int count = ++refused_more[head];
  if (count < static_cast<int>(most)) *same += fmt::format("{}{}", count == 1 ? "; also in line " : ", ", c.line);
  else if (count == static_cast<int>(most)) *same += ", ...";
}

const NastranCoordinates& NastranReader::coordinates(const NastranCard& from, int id, int depth) {
  static const NastranCoordinates basic;
  if (id == 0) return basic;
  if (const auto known = known_coordinates.find(id); known != known_coordinates.end()) return known->second;
  const auto card = coordinate_cards.find(id);
  if (card == coordinate_cards.end()) deck.fail(from, fmt::format("coordinate system {} is not there", id));
  if (depth > 100) deck.fail(from, fmt::format("coordinate system {} is defined by itself", id));
  const NastranCard& c = *card->second;
  if (c.name.size() < 6) deck.fail(c, "CORD1R, CORD1C, CORD1S, CORD2R, CORD2C and CORD2S can be read");
  NastranCoordinates made;
  made.kind = c.name[5];
  Vec3 a, b, d;
  if (c.name[4] == '2') {
    const NastranCoordinates& base = coordinates(c, deck.integer(c, 1), depth + 1);
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

Vec3 NastranReader::scaled(char kind, const Vec3& x) const {
  const double l = units.length;
  return kind == 'R' ? Vec3(l * x) : kind == 'C' ? Vec3(l * x.x(), x.y(), l * x.z()) : Vec3(l * x.x(), x.y(), x.z());
}

Vec3 NastranReader::grid_place(const NastranCard& from, int id, int depth) {
  const auto it = grids.find(id);
  if (it == grids.end()) deck.fail(from, fmt::format("grid {} is not there", id));
  if (bad_grids.contains(id)) throw NastranMissingGrid();
  if (depth > 100) deck.fail(from, fmt::format("grid {} is placed by itself", id));
  const NastranCard& c = *it->second;
  const int cp = deck.integer(c, 1, grid_defaults ? deck.integer(*grid_defaults, 1) : 0);
  const NastranCoordinates& system = coordinates(c, cp, depth + 1);
  return system.place(scaled(system.kind, Vec3(deck.real(c, 2), deck.real(c, 3), deck.real(c, 4))));
}

void NastranReader::add_grid(const NastranCard& c) {
  const int id = deck.integer(c, 0);
  bad_grids.insert(id);
  if (id <= 0) deck.fail(c, fmt::format("a number > 0 is expected, found {}", id));
  bad_grids.erase(id);
  const int node = static_cast<int>(model.nodes.size());
  Vec3 place;
  try {
    place = grid_place(c, id);
  } catch (...) {
    bad_grids.insert(id);
    throw;
  }
  model.nodes.push_back(place);
  model.node_ids.push_back(id);
  node_at[id] = node;
  if (const int cd = deck.integer(c, 5, grid_defaults ? deck.integer(*grid_defaults, 5) : 0); cd > 0) displacement[node] = cd;
  for (int d : deck.blank(c, 6) && grid_defaults ? deck.components(*grid_defaults, 6) : deck.components(c, 6)) hold(c, node, d);
}

int NastranReader::node(const NastranCard& c, size_t field) { return node_of(c, deck.integer(c, field)); }

int NastranReader::node_of(const NastranCard& c, int id) {
  const auto it = node_at.find(id);
  if (it == node_at.end() && grids.contains(id)) throw NastranMissingGrid();
  if (it == node_at.end()) deck.fail(c, fmt::format("grid {} is not there", id));
  return it->second;
}

int NastranReader::node_if(const std::string& id) const {
  int number = 0;
  const auto [end, error] = std::from_chars(id.data(), id.data() + id.size(), number);
  const auto it = error == std::errc() ? node_at.find(number) : node_at.end();
  return it == node_at.end() ? -1 : it->second;
}

Mat3 NastranReader::directions(const NastranCard& c, int node) {
  const auto it = displacement.find(node);
  return it == displacement.end() ? Mat3::Identity() : coordinates(c, it->second).directions(model.nodes[node]);
}

void NastranReader::hold(const NastranCard& c, int node, int dof) {
  FeConstraint made;
  made.node = node;
  made.dof = dof;
  if (displacement.contains(node)) made.direction = directions(c, node).col(dof % 3);
  model.constraints.push_back(made);
}

void NastranReader::add_material(int id, const NastranCard& c) {
  FeMaterial m;
  m.name = fmt::format("{}", id);
  const double stress = units.stress(), density = units.density() * weight_to_mass;
  if (c.name == "MAT1") {
    double E = deck.real(c, 1), G = deck.real(c, 2), nu = deck.real(c, 3);
    if (deck.blank(c, 3) && E > 0.0 && G > 0.0) nu = E / (2 * G) - 1.0;
    else if (deck.blank(c, 1)) E = 2 * G * (1 + nu);
    else if (!deck.blank(c, 2) && !deck.blank(c, 3) && std::abs(G - E / (2 * (1 + nu))) > 0.02 * G)
      model.warnings.push_back(
          fmt::format("{}: MAT1 {}: G = {:g} is not E / (2 (1 + nu)) = {:g}: beams and rods have G, solids and shells E and nu",
                      deck.where(c), id, G, E / (2 * (1 + nu))));
    m.youngs_modulus = E * stress;
    m.shear_modulus = G * stress;
    m.poisson = nu;
    m.density = deck.real(c, 4) * density;
  } else if (c.name == "MAT8") {
    const double E1 = deck.real(c, 1), E2 = deck.real(c, 2), nu = deck.real(c, 3), G = deck.real(c, 4);
    if (!(E1 > 0.0 && E2 > 0.0 && G > 0.0)) deck.fail(c, "E1, E2 and G12 must be > 0");
    Mat6 S = Mat6::Zero();
    S.diagonal() << 1 / E1, 1 / E2, 1 / E2, 1 / G, 1 / across(c, 6), 1 / across(c, 5);
    S(0, 1) = S(1, 0) = -nu / E1;
    m.elasticity = S.inverse() * stress;
    m.youngs_modulus = E1 * stress;
    m.density = deck.real(c, 7) * density;
  } else if (c.name == "MAT11") {
    // E1 E2 E3 NU12 NU13 NU23 G12, then G13 G23 RHO.
    const double E1 = deck.real(c, 1), E2 = deck.real(c, 2), E3 = deck.real(c, 3), G12 = deck.real(c, 7), G13 = deck.real(c, 8),
                 G23 = deck.real(c, 9);
    if (!(E1 > 0.0 && E2 > 0.0 && E3 > 0.0 && G12 > 0.0 && G13 > 0.0 && G23 > 0.0)) deck.fail(c, "E1, E2, E3, G12, G13, G23 must be > 0");
    Mat6 S = Mat6::Zero();
    S.diagonal() << 1 / E1, 1 / E2, 1 / E3, 1 / G12, 1 / G23, 1 / G13;
    S(0, 1) = S(1, 0) = -deck.real(c, 4) / E1;
    S(0, 2) = S(2, 0) = -deck.real(c, 5) / E1;
    S(1, 2) = S(2, 1) = -deck.real(c, 6) / E2;
    m.elasticity = S.inverse() * stress;
    m.youngs_modulus = E1 * stress;
    m.density = deck.real(c, 10) * density;
  } else if (c.name == "MAT9") {
    Mat6 C;
    size_t k = 1;
    for (int a = 0; a < 6; ++a)
      for (int b = a; b < 6; ++b) C(a, b) = C(b, a) = deck.real(c, k++);
    m.elasticity = C * stress;
    m.youngs_modulus = C(0, 0) * stress;
    m.density = deck.real(c, 22) * density;
  } else {
    // Plane stress of a shell: 11 12 13 22 23 33; what lies across it is not coupled.
    Mat6 C = Mat6::Zero();
    const double shear = deck.real(c, 6);
    C(0, 0) = deck.real(c, 1);
    C(0, 1) = C(1, 0) = deck.real(c, 2);
    C(0, 3) = C(3, 0) = deck.real(c, 3);
    C(1, 1) = deck.real(c, 4);
    C(1, 3) = C(3, 1) = deck.real(c, 5);
    C(2, 2) = C(0, 0);
    C(3, 3) = C(4, 4) = C(5, 5) = shear;
    m.elasticity = C * stress;
    m.youngs_modulus = C(0, 0) * stress;
    m.density = deck.real(c, 7) * density;
  }
  material_at[id] = static_cast<int>(model.materials.size());
  model.materials.push_back(m);
}

// G1Z or G2Z of MAT8. Blank or zero is rigid: ten times the stiffest modulus beside it, or any metal's where all of them are a soft core's.
double NastranReader::across(const NastranCard& c, size_t field) {
  if (const double given = deck.real(c, field); given > 0.0) return given;
  constexpr double metal = 2e11;  // Pa
  if (!deck.blank(c, field) && deck.real(c, field) < 0.0) deck.fail(c, "G1Z and G2Z must be > 0, or blank: rigid against transverse shear");
  add_once(model.notes, fmt::format("{}: MAT8 without {} is rigid against transverse shear that way, as Nastran has it; give thick layers "
                                    "and cores their own",
                                    deck.where(c), field == 5 ? "G1Z" : "G2Z"));
  return 10.0 * std::max({deck.real(c, 1), deck.real(c, 2), deck.real(c, 4), metal / units.stress()});
}

int NastranReader::material(const NastranCard& c, size_t field) {
  const int id = deck.integer(c, field);
  const auto it = material_at.find(id);
  if (it == material_at.end()) deck.fail(c, fmt::format("material {} is not there", id));
  return it->second;
}

const NastranCard& NastranReader::property(const NastranCard& c, std::initializer_list<const char*> names) {
  const int id = deck.integer(c, 1, deck.integer(c, 0));
  const auto it = properties.find(id);
  if (const auto other = other_properties.find(id); it == properties.end() && other != other_properties.end())
    deck.fail(c, fmt::format("property {} is a {}; {} can be read", id, other->second, fmt::join(names, ", ")));
  // Once for all its elements, at the first of them.
  if (it == properties.end())
    deck.fail(*missing_properties.try_emplace(id, &c).first->second,
              fmt::format("property {} is not there: give its card ({})", id, fmt::join(names, ", ")));
  if (std::none_of(names.begin(), names.end(), [&](const char* n) { return it->second->name == n; }))
    deck.fail(c, fmt::format("property {} is a {}; {} can be read", id, it->second->name, fmt::join(names, ", ")));
  return *it->second;
}

int NastranReader::heavier(int material, double more) {
  if (more == 0.0) return material;
  FeMaterial m = model.materials[material];
  m.density += more;
  for (size_t k = 0; k < model.materials.size(); ++k)
    if (model.materials[k].name == m.name && model.materials[k].density == m.density) return static_cast<int>(k);
  model.materials.push_back(m);
  return static_cast<int>(model.materials.size()) - 1;
}

FeModel read_nastran(const std::filesystem::path& path, const FeUnits& units) {
  return NastranReader(read_nastran_cards(path), units, path.string()).run();
}

}  // namespace flexframe::sim
