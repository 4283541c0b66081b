// Beams and rods of Nastran bulk data: sections, offsets, released ends.
#include "sim/reduce/fe_nastran_reader.h"
#include "sim/reduce/fe_sections.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

bool station(const NastranDeck& deck, const NastranCard& p, size_t k) {
  return !deck.blank(p, k) && (p.fields[k] == "YES" || p.fields[k] == "YESA" || p.fields[k] == "NO");
}

// Blank fields from a card of defaults (BAROR, BEAMOR).
NastranCard with_defaults(const NastranDeck& deck, NastranCard c, const NastranCard* from) {
  if (from == nullptr) return c;
  c.fields.resize(std::max<size_t>(c.fields.size(), 8));
  if (deck.blank(c, 1) && !deck.blank(*from, 1)) c.fields[1] = from->fields[1];
  const bool direction = !deck.blank(c, 4) || !deck.blank(c, 5) || !deck.blank(c, 6);
  for (size_t k = 4; k < 7 && !direction; ++k)
    if (!deck.blank(*from, k)) c.fields[k] = from->fields[k];
  if (deck.blank(c, 7) && !deck.blank(*from, 7)) c.fields[7] = from->fields[7];
  return c;
}

}  // namespace

void NastranReader::add_beam(const NastranCard& given) {
  const NastranCard c = with_defaults(deck, given, given.name == "CBAR" ? bar_defaults : beam_defaults);
  const NastranCard& p = property(c, {"PBAR", "PBARL", "PBEAM", "PBEAML"});
  int a = node(c, 2), b = node(c, 3);
  // Directions: of the vector (global: those of the grid's displacements, or basic) and of the offsets.
  const std::string frame = deck.blank(c, 7) || c.fields[7].size() != 3 ? "GGG" : c.fields[7];
  Vec3 beside_a(deck.real(c, 10), deck.real(c, 11), deck.real(c, 12)), beside_b(deck.real(c, 13), deck.real(c, 14), deck.real(c, 15));
  if ((frame[1] != 'G' && !beside_a.isZero(0.0)) || (frame[2] != 'G' && !beside_b.isZero(0.0)))
    deck.fail(c,
              fmt::format("OFFT = {}: offsets in the beam's own directions cannot be read; give them in those of the grids (GGG)", frame));
  beside_a = directions(c, a) * beside_a * units.length;
  beside_b = directions(c, b) * beside_b * units.length;
  Eigen::Vector2d beside = Eigen::Vector2d::Zero();
  FeBeamSection s = section(p, beside);
  if (deck.is_integer(c, 4) && deck.blank(c, 5)) s.n1 = model.nodes[node(c, 4)] - model.nodes[a];
  else s.n1 = (frame[0] == 'B' ? Mat3::Identity() : directions(c, a)) * Vec3(deck.real(c, 4), deck.real(c, 5), deck.real(c, 6));
  if (!(s.n1.norm() > 0.0)) deck.fail(c, "the direction of plane 1 (X1, X2, X3 or G0) is missing");
  const Vec3 along = model.nodes[b] + beside_b - model.nodes[a] - beside_a, across = along.cross(s.n1);
  if (!(across.norm() > 1e-9 * along.norm() * s.n1.norm())) deck.fail(c, "the direction of plane 1 lies along the beam");
  Mat3 axes;
  axes << along.normalized(), across.cross(along).normalized(), across.normalized();
  const Vec3 off_axis = axes.rightCols<2>() * beside;
  a = end_beside(c, a, beside_a + off_axis);
  b = end_beside(c, b, beside_b + off_axis);
  a = released_end(c, a, deck.components(c, 8), axes);
  b = released_end(c, b, deck.components(c, 9), axes);
  FeElement& e = put(c, FeShape::beam2, {a, b});
  e.material = material(p, 1);
  model.beam_sections.push_back(s);
  e.section = static_cast<int>(model.beam_sections.size()) - 1;
}

int NastranReader::end_beside(const NastranCard& c, int grid, const Vec3& offset) {
  if (offset.isZero(0.0)) return grid;
  const auto [at, fresh] = arm_ends.try_emplace({grid, {offset.x(), offset.y(), offset.z()}}, static_cast<int>(model.nodes.size()));
  if (!fresh) return at->second;
  FeSpider arm;
  arm.name = fmt::format("OFFSET_{}", model.node_ids[grid]);
  arm.node = grid;
  arm.line = c.line;
  const auto same = std::find_if(model.spiders.begin(), model.spiders.end(), [&](const FeSpider& s) { return s.name == arm.name; });
  const int made = new_node(model.nodes[grid] + offset);
  if (same != model.spiders.end()) {
    same->slaves.push_back(made);
  } else {
    arm.slaves = {made};
    model.spiders.push_back(std::move(arm));
  }
  return made;
}

int NastranReader::released_end(const NastranCard& c, int end, const std::vector<int>& dofs, const Mat3& axes) {
  if (dofs.empty()) return end;
  const int made = new_node(model.nodes[end]);
  for (int d = 0; d < 6; ++d) {
    if (std::find(dofs.begin(), dofs.end(), d) != dofs.end()) continue;
    const Vec3 along = axes.col(d % 3);
    const int base = d < 3 ? 0 : 3;
    Eigen::Index main = 0;
    along.cwiseAbs().maxCoeff(&main);
    FeEquation e;
    e.line = c.line;
    for (const int node : {made, end})
      for (int k = 0; k < 3; ++k) {
        const int axis = (static_cast<int>(main) + k) % 3;
        if (along(axis) != 0.0) e.terms.push_back({node, base + axis, (node == made ? 1.0 : -1.0) * along(axis)});
      }
    model.equations.push_back(std::move(e));
  }
  return made;
}

FeBeamSection NastranReader::section(const NastranCard& p, Eigen::Vector2d& beside) {
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
    if (bar) {
      s.shear1 = deck.real(p, 16, 0.0) * s.area;
      s.shear2 = deck.real(p, 17, 0.0) * s.area;
    } else {
      tapered(p, s, beside);
    }
  } else {
    s = section_by_shape(p);
  }
  // Some bars stretch or bend one way only.
  if (s.area < 0.0 || s.I11 < 0.0 || s.I22 < 0.0 || !(s.area + s.I11 + s.I22 > 0.0))
    deck.fail(p, "area, I1 and I2 must not be negative, nor all zero");
  if (s.torsion < 0.0) deck.fail(p, "J must not be negative");
  return s;
}

// What follows the section at end A of a PBEAM: stations with lines of places for stresses between them, shear factors, and offsets of the
// neutral axis. The beam has the mean of its ends.
void NastranReader::tapered(const NastranCard& p, FeBeamSection& s, Eigen::Vector2d& beside) {
  const double l2 = units.length * units.length, l4 = l2 * l2, line_mass = units.mass * weight_to_mass / units.length;
  const auto is_station = [&](size_t k) { return station(deck, p, k); };
  size_t k = is_station(8) ? 8 : 16;
  bool differs = false;
  for (; is_station(k); k += p.fields[k] == "YES" && !is_station(k + 8) ? 16 : 8) {
    const double place = deck.real(p, k + 1, 1.0);
    const auto mean = [&](double& own, size_t field, double factor) {
      if (deck.blank(p, field)) return;
      const double there = deck.real(p, field) * factor;
      differs = differs || std::abs(there - own) > 1e-3 * std::abs(own);
      if (place == 1.0) own = 0.5 * (own + there);
    };
    mean(s.area, k + 2, l2);
    mean(s.I22, k + 3, l4);
    mean(s.I11, k + 4, l4);
    mean(s.I12, k + 5, l4);
    mean(s.torsion, k + 6, l4);
    mean(s.mass_per_length, k + 7, line_mass);
  }
  if (differs)
    model.warnings.push_back(
        fmt::format("{}: PBEAM {}: the section changes along the beam; each element has the mean of its ends: use "
                    "more elements where it changes much",
                    deck.where(p), deck.integer(p, 0)));
  s.shear1 = deck.real(p, k, 1.0) * s.area;
  s.shear2 = deck.real(p, k + 1, 1.0) * s.area;
  for (size_t warp : {k + 6, k + 7})
    if (deck.real(p, warp) != 0.0) add_once(model.notes, fmt::format("{}: PBEAM: stiffness against warping is left out", deck.where(p)));
  for (size_t inertia : {k + 4, k + 5})
    if (deck.real(p, inertia) != 0.0)
      add_once(model.warnings, fmt::format("{}: PBEAM: the inertia of non-structural mass about the axis (NSI) is left out; give it as "
                                           "CONM2 at the grids",
                                           deck.where(p)));
  for (size_t mass = k + 8; mass < k + 12; ++mass)
    if (deck.real(p, mass) != 0.0)
      add_once(model.warnings, fmt::format("{}: PBEAM: non-structural mass beside the axis (M1, M2) counts on the axis", deck.where(p)));
  const Eigen::Vector2d at_a(deck.real(p, k + 12), deck.real(p, k + 13)),
      at_b(deck.real(p, k + 14, at_a.x()), deck.real(p, k + 15, at_a.y()));
  beside = 0.5 * (at_a + at_b) * units.length;
  if (!beside.isZero(0.0))
    add_once(model.warnings,
             fmt::format("{}: PBEAM: the neutral axis lies beside the shear centre (N1, N2); the beam twists about the neutral axis here",
                         deck.where(p)));
}

FeBeamSection NastranReader::section_by_shape(const NastranCard& p) {
  const double line_mass = units.mass * weight_to_mass / units.length;
  const std::string kind = deck.blank(p, 3) ? "" : p.fields[3];
  static const std::map<std::string, size_t> wanted = {
      {"ROD", 1},   {"TUBE", 2}, {"BAR", 2},   {"BOX", 4}, {"I", 6},  {"T", 4}, {"L", 4},     {"CHAN", 4}, {"TUBE2", 2}, {"I1", 4},
      {"CHAN1", 4}, {"Z", 4},    {"CHAN2", 4}, {"T1", 4},  {"T2", 4}, {"H", 4}, {"CROSS", 4}, {"HAT", 4},  {"BOX1", 6}};
  const auto known = wanted.find(kind);
  if (known == wanted.end()) {
    std::vector<std::string> names;
    for (const auto& entry : wanted) names.push_back(entry.first);
    deck.fail(
        p, fmt::format("section {}: {} can be read; give others as {}", kind, fmt::join(names, " "), p.name.substr(0, p.name.size() - 1)));
  }
  std::vector<double> d;
  for (size_t k = 8; k < p.fields.size() && !deck.blank(p, k) && d.size() <= known->second; ++k) {
    // Of a beam the stations follow.
    if (station(deck, p, k)) break;
    d.push_back(deck.real(p, k) * units.length);
  }
  if (d.size() < known->second)
    deck.fail(p, fmt::format("section {}: {} dimensions are expected, found {}", kind, known->second, d.size()));
  for (size_t k = 8; k < p.fields.size() && p.name == "PBEAML"; ++k)
    if (station(deck, p, k))
      add_once(model.warnings, fmt::format("{}: PBEAML: the section of end A counts for the whole beam", deck.where(p)));
  // Width lies along the element's z, height along its y, which is n1.
  std::optional<FeBeamSection> made;
  if (kind == "ROD") made = beam_shape("CIRC", {d[0]});
  else if (kind == "TUBE") made = beam_shape("PIPE", {d[0], d[0] - d[1]});
  else if (kind == "TUBE2") made = beam_shape("PIPE", {d[0], d[1]});
  else if (kind == "BAR") made = beam_shape("RECT", {d[1], d[0]});
  else if (kind == "BOX") made = beam_shape("BOX", {d[1], d[0], d[2], d[3], d[2], d[3]});
  else if (kind == "BOX1") made = beam_shape("BOX", {d[1], d[0], d[2], d[4], d[3], d[5]});
  else made = open_section(kind, d);
  const bool symmetric = kind == "I" ? d[1] == d[2] && d[4] == d[5] : kind == "BOX1" ? d[2] == d[3] && d[4] == d[5] : true;
  static const std::set<std::string> lopsided = {"T", "L", "CHAN", "CHAN1", "CHAN2", "T1", "T2", "HAT"};
  if (p.name == "PBEAML" && (lopsided.contains(kind) || !symmetric))
    add_once(model.warnings, fmt::format("{}: PBEAML, section {}: its centroid lies in the line of the grids here; Nastran has the shear "
                                         "centre there and the centroid beside it",
                                         deck.where(p), kind));
  if (kind == "Z")
    add_once(model.warnings,
             fmt::format("{}: {}, section Z: its upper flange points against the element's z; where the mirrored section is meant, give "
                         "it as {} with I12",
                         deck.where(p), p.name, p.name.substr(0, p.name.size() - 1)));
  if (!made) deck.fail(p, fmt::format("section {}: dimensions > 0 that leave a section are expected", kind));
  if (d.size() > known->second) made->mass_per_length = d[known->second] / units.length * line_mass;
  return *made;
}

void NastranReader::finish_rod(const NastranCard& c, int a, int b, int material, const FeBeamSection& s) {
  if (!(s.area > 0.0)) deck.fail(c, "a section area > 0 is expected");
  FeElement& e = put(c, FeShape::beam2, {a, b});
  e.material = material;
  model.beam_sections.push_back(s);
  e.section = static_cast<int>(model.beam_sections.size()) - 1;
}

void NastranReader::add_rod(const NastranCard& c) {
  const double l2 = units.length * units.length, line_mass = units.mass * weight_to_mass / units.length;
  FeBeamSection s;
  s.truss = true;
  if (c.name == "CONROD") {
    s.area = deck.real(c, 4) * l2;
    s.torsion = deck.real(c, 5) * l2 * l2;
    s.mass_per_length = deck.real(c, 7) * line_mass;
    return finish_rod(c, node(c, 1), node(c, 2), material(c, 3), s);
  }
  const NastranCard& p = c.name == "CTUBE" ? property(c, {"PTUBE"}) : property(c, {"PROD"});
  if (p.name == "PTUBE") {
    const double outer = 0.5 * deck.real(p, 2) * units.length, wall = deck.real(p, 3) * units.length;
    if (!deck.blank(p, 5) && deck.real(p, 5) != deck.real(p, 2)) deck.fail(p, "tubes whose diameter changes (OD2) cannot be read");
    const auto tube = beam_shape("PIPE", {outer, wall > 0.0 ? wall : outer});
    if (!tube) deck.fail(p, "an outer diameter and a thickness of at most half of it are expected");
    s.area = tube->area;
    s.torsion = tube->torsion;
    s.mass_per_length = deck.real(p, 4) * line_mass;
  } else {
    s.area = deck.real(p, 2) * l2;
    s.torsion = deck.real(p, 3) * l2 * l2;
    s.mass_per_length = deck.real(p, 5) * line_mass;
  }
  finish_rod(c, node(c, 2), node(c, 3), material(p, 1), s);
}

}  // namespace flexframe::sim
