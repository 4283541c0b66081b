// Elements of Nastran bulk data: solids, shells, springs, masses. Beams and rods: fe_nastran_beams.cpp.
#include "sim/base/spatial.h"
#include "sim/reduce/fe_nastran_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

namespace flexframe::sim {

const std::vector<NastranElementCard>& nastran_element_cards() {
  static const std::vector<NastranElementCard> cards = {
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

FeElement& NastranReader::put(const NastranCard& c, FeShape shape, const std::vector<int>& nodes) {
  FeElement e;
  e.id = deck.integer(c, 0);
  // Masses are numbered by themselves.
  if (!(c.name.starts_with("CONM") || c.name.starts_with("CMASS") ? mass_ids : element_ids).insert(e.id).second)
    deck.fail(c, fmt::format("element {} is defined twice", e.id));
  e.shape = shape;
  e.first = static_cast<int>(model.connectivity.size());
  e.count = static_cast<int>(nodes.size());
  e.line = c.file == 0 ? c.line : 0;
  model.connectivity.insert(model.connectivity.end(), nodes.begin(), nodes.end());
  model.elements.push_back(e);
  return model.elements.back();
}

void NastranReader::add_element(const NastranCard& c) {
  if (c.name == "CELAS1" || c.name == "CELAS2") return add_spring(c);
  if (c.name == "CONM2") return add_mass(c);
  if (c.name == "CONM1") return add_mass_matrix(c);
  if (c.name == "CMASS1" || c.name == "CMASS2") return add_scalar_mass(c);
  if (c.name == "CBUSH") return add_bush(c);
  if (c.name == "CBAR" || c.name == "CBEAM") return add_beam(c);
  if (c.name == "CROD" || c.name == "CONROD" || c.name == "CTUBE") return add_rod(c);
  const NastranElementCard& kind = *std::find_if(nastran_element_cards().begin(), nastran_element_cards().end(),
                                                 [&](const NastranElementCard& e) { return c.name == e.name; });
  const bool shell = fe_is_shell(kind.shape);
  const size_t all = kind.order.size();
  size_t there = 0;
  for (size_t k = 0; k < all; ++k) there += deck.blank(c, 2 + k) ? 0 : 1;
  const size_t corners = shell ? fe_faces(kind.shape)[0].size() : static_cast<size_t>(kind.corners);
  for (size_t k = 0; k < corners; ++k)
    if (deck.blank(c, 2 + k)) deck.fail(c, fmt::format("{} corner grids are expected", corners));
  if (there != static_cast<size_t>(kind.corners)) there = all;
  std::vector<int> nodes;
  for (size_t k = 0; k < there; ++k) {
    const size_t field = 2 + kind.order[k];
    nodes.push_back(deck.blank(c, field)
                        ? middle_node(c, kind.quadratic, static_cast<int>(k), {nodes.begin(), nodes.begin() + static_cast<long>(corners)})
                        : node(c, field));
  }
  const NastranCard& p = shell ? property(c, {"PSHELL", "PCOMP", "PCOMPG"}) : property(c, {"PSOLID"});
  if (!shell) turn_outward(there == all ? kind.quadratic : kind.shape, nodes);
  FeElement& e = put(c, there == all ? kind.quadratic : kind.shape, nodes);
  if (e.shape == FeShape::hexahedron8) e.formulation = FeFormulation::incompatible;
  model.element_sets[fmt::format("PID_{}", deck.integer(p, 0))].push_back(static_cast<int>(model.elements.size()) - 1);
  auto& set = model.node_sets[fmt::format("PID_{}", deck.integer(p, 0))];
  set.insert(set.end(), nodes.begin(), nodes.end());
  if (shell) return finish_shell(c, p, kind.corners + 2, e);
  e.material = material(p, 1);
  if (!model.materials[e.material].elasticity) return;
  const int cord = deck.integer(p, 2);
  if (cord < 0) deck.fail(p, "CORDM = -1 (axes of the element) cannot be read; give a coordinate system");
  Vec3 middle = Vec3::Zero();
  for (int n : nodes) middle += model.nodes[n] / static_cast<double>(nodes.size());
  model.axes.push_back(coordinates(p, cord).directions(middle));
  e.axes = static_cast<int>(model.axes.size()) - 1;
}

// Nastran takes the grids of a solid either way round.
void NastranReader::turn_outward(FeShape shape, std::vector<int>& nodes) {
  const bool hexahedron = shape == FeShape::hexahedron8 || shape == FeShape::hexahedron20,
             wedge = shape == FeShape::wedge6 || shape == FeShape::wedge15;
  const std::vector<int> turned = hexahedron ? std::vector<int>{0, 3, 2, 1, 4, 7, 6, 5}
                                  : wedge    ? std::vector<int>{0, 2, 1, 3, 5, 4}
                                             : std::vector<int>{0, 2, 1, 3};
  const auto place = [&](int k) { return Vec3(model.nodes[nodes[k]]); };
  const std::vector<int>& face = fe_faces(shape)[0];
  Vec3 middle = Vec3::Zero(), of_face = Vec3::Zero(), normal = Vec3::Zero();
  for (size_t k = 0; k < turned.size(); ++k) middle += place(static_cast<int>(k)) / static_cast<double>(turned.size());
  for (const int k : face) of_face += place(k) / static_cast<double>(face.size());
  for (size_t k = 0; k < face.size(); ++k) normal += (place(face[k]) - of_face).cross(place(face[(k + 1) % face.size()]) - of_face);
  if (normal.dot(of_face - middle) >= 0.0) return;
  const std::vector<int> given = nodes;
  for (size_t a = 0; a < turned.size(); ++a) {
    nodes[a] = given[turned[a]];
    for (size_t b = 0; b < a; ++b)
      if (const int at = fe_middle(shape, static_cast<int>(b), static_cast<int>(a)); at >= 0)
        nodes[at] = given[fe_middle(shape, turned[b], turned[a])];
  }
}

int NastranReader::middle_node(const NastranCard& c, FeShape shape, int place, const std::vector<int>& corners) {
  int a = -1, b = -1;
  const int count = static_cast<int>(corners.size());
  for (int i = 0; i < count && a < 0; ++i)
    for (int j = i + 1; j < count; ++j)
      if (fe_middle(shape, i, j) == place) {
        a = corners[i];
        b = corners[j];
      }
  const auto [at, fresh] = middles.try_emplace(std::pair(std::min(a, b), std::max(a, b)), static_cast<int>(model.nodes.size()));
  if (!fresh) return at->second;
  const int made = new_node(0.5 * (model.nodes[a] + model.nodes[b]));
  for (int d = 0; d < (fe_is_shell(shape) ? 6 : 3); ++d) model.equations.push_back({{{made, d, 1.0}, {a, d, -0.5}, {b, d, -0.5}}, c.line});
  return made;
}

int NastranReader::new_node(const Vec3& x) {
  const int highest = grids.empty() ? 0 : grids.rbegin()->first;
  model.nodes.push_back(x);
  model.node_ids.push_back(std::max(highest, *std::max_element(model.node_ids.begin(), model.node_ids.end())) + 1);
  return static_cast<int>(model.nodes.size()) - 1;
}

void NastranReader::finish_shell(const NastranCard& c, const NastranCard& p, int theta, FeElement& e) {
  // CQUAD8 and CTRIA6 have T1 to T4 and T1 to T3 before the angle; CQUAD4 and CTRIA3 after it.
  size_t angle = theta;
  if (e.shape == FeShape::quadrangle8) angle = 14;
  double offset = deck.real(c, angle + 1) * units.length;
  if (e.shape == FeShape::quadrangle8) offset = deck.real(c, 15) * units.length;
  if (p.name == "PSHELL") {
    e.thickness = thickness_of(c, e.shape, deck.real(p, 2) * units.length);
    if (deck.blank(p, 1)) deck.fail(p, "without MID1 the shell has no membrane stiffness; give MID1 = MID2");
    if (!deck.blank(p, 10)) deck.fail(p, "MID4 (bending that couples with stretching) cannot be read; use PCOMP");
    for (size_t k = 11; k < p.fields.size(); ++k)
      if (!deck.blank(p, k))
        deck.fail(p, "what stands behind MID4 cannot be read; give angles and offsets (THETA, MCID, ZOFFS) with the elements");
    FeLayup layup;
    layup.bending = deck.blank(p, 3) ? 0.0 : deck.real(p, 4, 1.0);
    layup.shear = 0.0;
    if (!deck.blank(p, 3)) {
      if (deck.integer(p, 3) == -1) deck.fail(p, "MID2 = -1 (plane strain) cannot be read; a blank one is a membrane");
      if (!(layup.bending > 0.0)) deck.fail(p, fmt::format("12 I / T^3 must be > 0, found {:g}; blank: 1", layup.bending));
      set_shear(p, layup);
      set_faces(p, layup);
    }
    if (!deck.blank(p, 3) && deck.integer(p, 3) != deck.integer(p, 1)) layup.bending_material = material(p, 3);
    const bool plate = layup.bending == 1.0 && layup.bending_material < 0;
    if (!plate && (e.shape == FeShape::quadrangle8 || e.shape == FeShape::triangle6))
      deck.fail(p, "MID2 other than MID1, or 12 I / T^3 other than 1, cannot be read on CQUAD8 and CTRIA6; use PCOMP");
    e.material = heavier(material(p, 1), e.thickness > 0.0 ? deck.real(p, 7) * area_mass() / e.thickness : 0.0);
    if (offset != 0.0 && e.thickness > 0.0) layup.offset = -offset / e.thickness;
    const bool same_shear = std::abs(layup.shear - 1.0) < 1e-3;  // 0.833333 is 5/6
    if (same_shear) layup.shear = 1.0;
    if (layup != FeLayup()) e.section = find_layup(layup);
    const auto has_axes = [&](int m) { return m >= 0 && model.materials[m].elasticity.has_value(); };
    const bool turned = has_axes(layup.bending_material) || has_axes(layup.shear_material);
    if (!model.materials[e.material].elasticity && !turned) return;
  } else {
    e.section = composite(p, offset, e.thickness);
  }
  // The first material axis: along the first edge turned by the angle, or of a coordinate system.
  Vec3 middle = Vec3::Zero();
  Mat3X X(3, e.count);
  for (int k = 0; k < e.count; ++k) X.col(k) = model.nodes[model.connectivity[e.first + k]];
  middle = X.rowwise().mean();
  if (deck.is_integer(c, angle)) {
    model.axes.push_back(coordinates(c, deck.integer(c, angle)).directions(middle));
  } else {
    double area = 0.0;
    Mat3 Q;
    try {
      Q = shell_axes(e.shape, X, e.id, area);
    } catch (const InputError& error) {
      deck.fail(c, error.what());
    }
    model.axes.push_back(Eigen::AngleAxisd(deck.real(c, angle) * std::numbers::pi / 180.0, Q.col(2)).toRotationMatrix() * Q);
  }
  e.axes = static_cast<int>(model.axes.size()) - 1;
}

// Stiffness against transverse shear (MID3, TS/T) by that of a solid plate of MID1. Without MID3 there is no such strain.
void NastranReader::set_shear(const NastranCard& p, FeLayup& layup) {
  constexpr double rigid = 1e3;
  if (deck.blank(p, 5)) {
    add_once(model.notes, fmt::format("{}: PSHELL without MID3 is rigid against transverse shear, as Nastran has it; MID3 = MID1 gives a "
                                      "thick plate its own",
                                      deck.where(p)));
    layup.shear = rigid;
    return;
  }
  layup.shear = deck.real(p, 6, 5.0 / 6.0) / (5.0 / 6.0);
  if (!(layup.shear > 0.0)) deck.fail(p, fmt::format("TS/T must be > 0, found {:g}; blank: 0.833333", deck.real(p, 6)));
  const int id = deck.integer(p, 5);
  const FeMaterial own = model.materials[material(p, 1)], shears = model.materials[material(p, 5)];
  const bool resultants = materials.at(id)->name == "MAT2";
  if (resultants && (*shears.elasticity)(3, 3) != 0.0) {
    add_once(
        model.warnings,
        fmt::format("{}: PSHELL: its MID3 is a MAT2 with G33, which has G33 for transverse shear both ways here; Nastran has G11, G12, "
                    "G22 and wants G13, G23, G33 blank: give such a MAT2, a MAT1 or a MAT8",
                    deck.where(p)));
    if (id != deck.integer(p, 1)) layup.shear_material = material(p, 5);
  } else if (resultants || (id != deck.integer(p, 1) && (own.elasticity || shears.elasticity))) {
    layup.shear_material = shear_material(id, shears);
  } else if (id != deck.integer(p, 1)) {
    const double G = shears.shear_modulus > 0.0 ? shears.shear_modulus : shears.youngs_modulus / (2 * (1 + shears.poisson));
    layup.shear *= G * 2 * (1 + own.poisson) / own.youngs_modulus;
  }
}

// A material that shears across shells alone as MID3 does: MAT1 by its G, MAT2 by G11, G12 and G22 for xz and yz.
int NastranReader::shear_material(int id, const FeMaterial& given) {
  FeMaterial made = given;
  if (materials.at(id)->name == "MAT2") {
    const Mat6& C = *given.elasticity;
    Mat6 turned = C(0, 0) * Mat6::Identity();
    turned(5, 5) = C(0, 0);
    turned(4, 4) = C(1, 1);
    turned(4, 5) = turned(5, 4) = C(0, 1);
    made.elasticity = turned;
  } else if (!given.elasticity) {
    made.youngs_modulus = given.shear_modulus > 0.0 ? 2.0 * given.shear_modulus : given.youngs_modulus / (1 + given.poisson);
    made.poisson = 0.0;
  } else {
    return material_at.at(id);
  }
  if (const auto known = shear_materials.find(id); known != shear_materials.end()) return known->second;
  model.materials.push_back(made);
  return shear_materials[id] = static_cast<int>(model.materials.size()) - 1;
}

// Heights of stress (Z1, Z2) where they are not the faces of T.
void NastranReader::set_faces(const NastranCard& p, FeLayup& layup) {
  const double half = 0.5 * deck.real(p, 2) * units.length;
  for (const auto& [field, face, own] : {std::tuple(8, &layup.lower_face, -half), std::tuple(9, &layup.upper_face, half)}) {
    if (deck.blank(p, field)) continue;
    const double height = deck.real(p, field) * units.length;
    if (std::abs(height - own) > 1e-3 * half) *face = height;
  }
}

double NastranReader::thickness_of(const NastranCard& c, FeShape shape, double otherwise) {
  // T1, T2 ... of CQUAD4 and CTRIA3 stand behind TFLAG in the second line, of CQUAD8 behind the grids, of CTRIA6 behind the offset.
  const size_t count = shape == FeShape::quadrangle4 || shape == FeShape::quadrangle8 ? 4 : 3;
  const bool linear = shape == FeShape::quadrangle4 || shape == FeShape::triangle3;
  const size_t flag = linear ? 9 : shape == FeShape::quadrangle8 ? 16 : 13;
  const bool relative = deck.blank(c, flag) ? false : deck.integer(c, flag) == 1;
  double sum = 0.0, least = std::numeric_limits<double>::infinity(), most = 0.0;
  bool any = false;
  for (size_t k = 0; k < count; ++k) {
    const size_t field = 10 + k;
    any = any || !deck.blank(c, field);
    const double t = deck.blank(c, field) ? otherwise : deck.real(c, field) * (relative ? otherwise : units.length);
    sum += t;
    least = std::min(least, t);
    most = std::max(most, t);
  }
  if (!any) return otherwise;
  const double mean = sum / static_cast<double>(count);
  if (most - least > 0.05 * mean)
    add_once(model.warnings, fmt::format("{}: {}: thicknesses at the grids differ by more than 5 %; each element has their mean: use more "
                                         "elements where they change much",
                                         deck.where(c), c.name));
  return mean;
}

int NastranReader::find_layup(const FeLayup& layup) {
  for (size_t k = 0; k < model.layups.size(); ++k)
    if (model.layups[k] == layup) return static_cast<int>(k);
  model.layups.push_back(layup);
  return static_cast<int>(model.layups.size()) - 1;
}

int NastranReader::composite(const NastranCard& p, double offset, double& thickness) {
  FeLayup layup;
  const std::string lam = deck.blank(p, 7) ? "" : p.fields[7];
  if (!lam.empty() && lam != "SYM") deck.fail(p, fmt::format("LAM = {}: only SYM or blank can be read", lam));
  // PCOMP: material, thickness, angle, output; PCOMPG: a number before them, a line each.
  const size_t first = p.name == "PCOMPG" ? 9 : 8, step = p.name == "PCOMPG" ? 8 : 4;
  for (size_t k = first; k < p.fields.size(); k += step) {
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

void NastranReader::lump(const NastranCard& c, const std::vector<int>& nodes, MatX K, MatX M, bool turns) {
  FeElement& e = put(c, FeShape::lumped, nodes);
  model.lumps.push_back({std::move(K), std::move(M), turns});
  e.section = static_cast<int>(model.lumps.size()) - 1;
}

std::vector<std::pair<int, int>> NastranReader::scalar_ends(const NastranCard& c) {
  std::vector<std::pair<int, int>> ends;
  for (size_t at : {size_t{2}, size_t{4}}) {
    if (deck.blank(c, at) || deck.integer(c, at) == 0) continue;
    const std::vector<int> dofs = deck.components(c, at + 1);
    if (dofs.size() != 1) deck.fail(c, "one motion, 1 to 6, is expected at each grid; scalar points have no place in space");
    ends.emplace_back(node(c, at), dofs[0]);
  }
  if (ends.empty()) deck.fail(c, "no grid");
  return ends;
}

VecX NastranReader::between(const NastranCard& c, const std::vector<std::pair<int, int>>& ends, std::vector<int>& nodes, bool& turns) {
  VecX b = VecX::Zero(6 * static_cast<Eigen::Index>(ends.size()));
  double sign = 1.0;
  for (size_t i = 0; i < ends.size(); ++i) {
    nodes.push_back(ends[i].first);
    const int d = ends[i].second;
    turns = turns || d >= 3;
    b.segment<3>(6 * static_cast<Eigen::Index>(i) + (d < 3 ? 0 : 3)) = sign * directions(c, ends[i].first).col(d % 3);
    sign = -1.0;
  }
  return b;
}

void NastranReader::add_spring(const NastranCard& c) {
  double k = 0.0;
  if (c.name == "CELAS2") {
    k = deck.real(c, 1);
  } else {
    const auto p = springs.find(deck.integer(c, 1));
    if (p == springs.end()) deck.fail(c, fmt::format("property {} is not there", deck.integer(c, 1)));
    k = deck.real(*p->second.first, p->second.second + 1);
  }
  const std::vector<std::pair<int, int>> ends = scalar_ends(c);
  std::vector<int> nodes;
  bool turns = false;
  const VecX b = between(c, ends, nodes, turns);
  // Force over length, moment over angle.
  const double unit = units.mass / (units.time * units.time) * (ends[0].second >= 3 ? units.length * units.length : 1.0);
  lump(c, nodes, k * unit * b * b.transpose(), MatX::Zero(b.size(), b.size()), turns);
}

bool NastranReader::arms_turn(int grid) {
  if (!tied_grids) {
    tied_grids.emplace();
    for (const NastranCard* c : ties)
      for (size_t k = 1; k < c->fields.size(); ++k)
        if (const int n = deck.is_integer(*c, k) ? node_if(c->fields[k]) : -1; n >= 0) tied_grids->insert(n);
    for (const FeElement& e : model.elements)
      for (int k = 0; k < e.count && fe_is_solid(e.shape); ++k) solid_grids.insert(model.connectivity[e.first + k]);
  }
  return !solid_grids.contains(grid) || turning(grid) || tied_grids->contains(grid);
}

// Its first field; lines of damping (B, GE) and of factors for stresses (RCV) may stand before and behind it.
size_t NastranReader::bush_stiffness(const NastranCard& p) {
  size_t found = 0;
  for (size_t k = 1; k < p.fields.size(); k += 8) {
    if (p.fields[k] == "K") found = k + 1;
    if (p.fields[k] == "M" && deck.real(p, k + 1) != 0.0)
      add_once(model.warnings, fmt::format("{}: PBUSH: its mass (M) is left out; give it as CONM2", deck.where(p)));
  }
  if (found == 0) deck.fail(p, "K with six stiffnesses is expected");
  return found;
}

// Where the spring lies: S of the way from GA to GB, or S1 S2 S3 from the origin of OCID.
Vec3 NastranReader::bush_place(const NastranCard& c, const std::vector<int>& nodes) {
  const Vec3 a = model.nodes[nodes[0]];
  if (const int system = deck.integer(c, 9, -1); system >= 0) {
    const NastranCoordinates& from = coordinates(c, system);
    return from.place(scaled(from.kind, Vec3(deck.real(c, 10), deck.real(c, 11), deck.real(c, 12))));
  }
  if (nodes.size() < 2) return a;
  return a + deck.real(c, 8, 0.5) * (model.nodes[nodes[1]] - a);
}

void NastranReader::add_bush(const NastranCard& c) {
  const NastranCard& p = property(c, {"PBUSH"});
  const size_t stiffness = bush_stiffness(p);
  const int a = node(c, 2);
  std::vector<int> nodes = {a};
  if (!deck.blank(c, 3)) nodes.push_back(node(c, 3));
  Mat3 Q = Mat3::Identity();
  const Vec3 axis = nodes.size() == 2 ? Vec3(model.nodes[nodes[1]] - model.nodes[a]) : Vec3::Zero();
  if (!deck.blank(c, 7)) {
    Q = coordinates(c, deck.integer(c, 7)).directions(model.nodes[a]);
  } else {
    Vec3 v(deck.real(c, 4), deck.real(c, 5), deck.real(c, 6));
    if (deck.is_integer(c, 4) && deck.blank(c, 5)) v = model.nodes[node(c, 4)] - model.nodes[a];
    if (!(axis.norm() > 0.0) || !(axis.cross(v).norm() > 0.0))
      deck.fail(c, "its directions are not given: a coordinate system (CID) is needed");
    Q.col(0) = axis.normalized();
    Q.col(2) = axis.cross(v).normalized();
    Q.col(1) = Q.col(2).cross(Vec3(Q.col(0)));
  }
  Mat6 k = Mat6::Zero();
  const double unit = units.mass / (units.time * units.time);
  Vec6 diagonal;
  bool turns = false;
  for (int d = 0; d < 6; ++d) {
    diagonal(d) = deck.real(p, stiffness + d) * unit * (d >= 3 ? units.length * units.length : 1.0);
    turns = turns || (d >= 3 && diagonal(d) != 0.0);
  }
  k.topLeftCorner<3, 3>() = Q * diagonal.head<3>().asDiagonal() * Q.transpose();
  k.bottomRightCorner<3, 3>() = Q * diagonal.tail<3>().asDiagonal() * Q.transpose();
  // Rigid arms from the grids to the spring; those of solids, which have no rotations, carry none.
  const Vec3 place = bush_place(c, nodes);
  std::vector<Mat6> ends;
  for (const int n : nodes) {
    Mat6 end = Mat6::Identity();
    if (const Vec3 arm = place - model.nodes[n]; !arm.isZero(0.0)) {
      if (arms_turn(n)) {
        end.topRightCorner<3, 3>() = -skew(arm);
        turns = true;
      } else {
        add_once(model.notes, fmt::format("{}: CBUSH acts on the grids of solids without the moments of their distance", deck.where(c)));
      }
    }
    ends.push_back(end);
  }
  const auto n = static_cast<Eigen::Index>(nodes.size());
  MatX K = MatX::Zero(6 * n, 6 * n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) K.block<6, 6>(6 * i, 6 * j) = (i == j ? 1.0 : -1.0) * ends[i].transpose() * k * ends[j];
  lump(c, nodes, K, MatX::Zero(6 * n, 6 * n), turns);
}

void NastranReader::add_mass(const NastranCard& c) {
  const int at = node(c, 1), cid = deck.integer(c, 2);
  const double m = deck.real(c, 3) * units.mass * weight_to_mass, unit = units.mass * weight_to_mass * units.length * units.length;
  Vec3 r = Vec3(deck.real(c, 4), deck.real(c, 5), deck.real(c, 6)) * units.length;
  Mat3 Q = Mat3::Identity();
  if (cid < 0) r -= model.nodes[at];
  else {
    Q = coordinates(c, cid).directions(model.nodes[at]);
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

}  // namespace flexframe::sim
