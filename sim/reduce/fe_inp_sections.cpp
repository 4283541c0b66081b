// Sections, materials, masses and springs of an input file.
#include "sim/reduce/fe_inp_resolver.h"
#include "sim/reduce/fe_sections.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::sim {
namespace {

// Whether a section has a thickness, or dimensions, of its own.
bool has_size(const InpSection& s) {
  return !s.layers.empty() || std::any_of(s.numbers.begin(), s.numbers.end(), [](double x) { return x != 0.0; });
}

}  // namespace

// Abaqus takes the axis of the additional rotation for the normal of a shell and projects the one behind it, 1, 2, 3 in turn, as the
// material's first; without a second line the axes are taken as they stand, unless the first one is the normal.
int InpResolver::leading_axis(const InpAxes& axes, const Mat3& made, const std::string& name, const InpPlace& place, const FeElement& e) {
  if (!fe_is_shell(e.shape) || axes.about == 3) return 0;
  Mat3X X(3, e.count);
  for (int k = 0; k < e.count; ++k) X.col(k) = model.nodes[model.connectivity[e.first + k]];
  double area = 0.0;
  const Vec3 normal = shell_axes(e.shape, X, e.id, area).col(2);
  const int about = axes.about > 0 ? axes.about : 1;
  const double along = std::abs(normal.dot(made.col(about - 1)));
  // Lying in the surface, the axis cannot be the normal: Abaqus refuses it.
  if (along < (axes.about > 0 ? 0.1 : 0.9)) return 0;
  bool directed = e.material >= 0 && model.materials[e.material].elasticity;
  for (const FeLayer& l : e.section >= 0 ? model.layups[e.section].layers : std::vector<FeLayer>())
    directed = directed || model.materials[l.material].elasticity;
  if (directed && !(deck.abaqus && axes.about > 0))
    add_once(model.warnings,
             fmt::format("{}: orientation '{}' on shells: its axis {} is taken for the normal, and the material's first direction is the "
                         "projection of axis {}, as in Abaqus; in CalculiX the material has the axes as they stand. Give axis 3 along "
                         "the normal (second line: 3, angle)",
                         deck.where(place), name, about, about % 3 + 1));
  return about % 3;
}

int InpResolver::axes_for(int space, const std::string& name, const InpPlace& place, const FeElement& e) {
  int whose = 0;
  const InpAxes* axes = axes_named(space, name, place, whose);
  const InpSpace& s = spaces[whose];
  Vec3 middle = Vec3::Zero();
  for (int k = 0; k < e.count; ++k) middle += model.nodes[model.connectivity[e.first + k]] / e.count;
  Mat3 made;
  if (!axes->at(s.turn.transpose() * (middle - s.shift), made))
    fail(place, fmt::format("orientation '{}' has no direction at element {}, which lies on its axis", name, e.id));
  made = (s.turn * made).eval();
  const int lead = leading_axis(*axes, made, name, place, e);
  if (!axes->cylindrical)
    if (const auto it = rectangular.find({whose, name, lead}); it != rectangular.end()) return it->second;
  Mat3 in_turn;
  for (int k = 0; k < 3; ++k) in_turn.col(k) = made.col((lead + k) % 3);
  model.axes.push_back(in_turn);
  if (!axes->cylindrical) rectangular[{whose, name, lead}] = static_cast<int>(model.axes.size()) - 1;
  return static_cast<int>(model.axes.size()) - 1;
}

void InpResolver::warn_of_section(int element, const InpSection& s) {
  const InpSection*& before = sectioned[element];
  const auto alike = [](const InpSection& a, const InpSection& b) {
    return inp_upper(a.material) == inp_upper(b.material) && a.orientation == b.orientation && a.numbers == b.numbers &&
           a.offset == b.offset && a.shape == b.shape && a.n1 == b.n1 && a.layers.empty() && b.layers.empty() && !a.own_constants &&
           !b.own_constants;
  };
  if (before != nullptr && before != &s && !alike(*before, s) && told_sections.insert({before, &s}).second)
    model.warnings.push_back(fmt::format("{}: element {} has a section already ({}): this one counts, as in CalculiX; Abaqus refuses it",
                                         deck.where(s.place), model.elements[element].id, deck.where(before->place)));
  before = &s;
}

void InpResolver::add_section(int space, const InpSection& s) {
  const std::vector<int> elements = elements_named(space, s.set, s.place, "section");
  if (s.beam) return add_beam_section(space, s, elements);
  const int material = s.layers.empty() ? material_named(s.material, s.place) : -1;
  int layup = -1, truss = -1;
  if (s.shell && (!s.layers.empty() || s.offset != 0.0)) {
    FeLayup made;
    made.offset = s.offset;
    for (const InpLayer& l : s.layers) {
      if (!(l.thickness > 0.0)) fail(s.place, fmt::format("*SHELL SECTION: a layer's thickness must be > 0, found {:g}", l.thickness));
      made.layers.push_back({l.thickness, material_named(l.material, s.place), -1, l.angle});
    }
    model.layups.push_back(made);
    layup = static_cast<int>(model.layups.size()) - 1;
  }
  for (int index : elements) {
    warn_of_section(index, s);
    FeElement& e = model.elements[index];
    e.material = material;
    if (e.shape == FeShape::beam2) {
      // A truss; its section is its area.
      if (truss < 0) {
        FeBeamSection made;
        made.area = s.numbers.empty() ? 0.0 : s.numbers[0];
        made.truss = true;
        if (!(made.area > 0.0)) fail(s.place, fmt::format("*SOLID SECTION of a truss: an area > 0 is expected, found {:g}", made.area));
        model.beam_sections.push_back(made);
        truss = static_cast<int>(model.beam_sections.size()) - 1;
      }
      e.section = truss;
      continue;
    }
    if (s.shell != fe_is_shell(e.shape) && (fe_is_shell(e.shape) || fe_is_solid(e.shape)))
      fail(s.place, fmt::format("*{} SECTION for element {}, a {}", s.shell ? "SHELL" : "SOLID", e.id, fe_name(e.shape)));
    if (s.shell) e.section = layup;
    if (!s.orientation.empty()) e.axes = axes_for(space, s.orientation, s.place, e);
    if (!s.shell) continue;
    e.thickness = s.numbers.empty() ? 0.0 : s.numbers[0];
    if (!s.layers.empty()) {
      e.thickness = 0.0;
      for (const InpLayer& l : s.layers) e.thickness += l.thickness;
      set_layer_axes(space, s, e);
    }
  }
}

void InpResolver::set_layer_axes(int space, const InpSection& s, FeElement& e) {
  FeLayup made = model.layups[e.section];
  bool own = false, differs = false;
  for (size_t k = 0; k < s.layers.size(); ++k) {
    if (s.layers[k].orientation.empty()) continue;
    own = true;
    const int axes = axes_for(space, s.layers[k].orientation, s.place, e);
    differs = differs || made.layers[k].axes != axes;
    made.layers[k].axes = axes;
  }
  if (!own || !differs) return;
  model.layups.push_back(made);
  e.section = static_cast<int>(model.layups.size()) - 1;
}

std::optional<FeBeamSection> InpResolver::circle(const InpSection& s) {
  // Two numbers are CalculiX' diameters along n1 and n2; one is Abaqus' radius and CalculiX' diameter.
  if (s.numbers.size() > 1 && s.numbers[1] > 0.0)
    return beam_shape(s.numbers[0] == s.numbers[1] ? "CIRC" : "ELLIPSE",
                      {s.numbers[0] == s.numbers[1] ? 0.5 * s.numbers[0] : s.numbers[0], s.numbers[1]});
  const double r = s.numbers.empty() ? 0.0 : s.numbers[0];
  if (!deck.abaqus)
    add_once(
        model.warnings,
        fmt::format("{}: *BEAM SECTION, SECTION=CIRC: one number is the radius, as in Abaqus: {:g} m; CalculiX takes it for the diameter: "
                    "give two numbers, which are the diameters",
                    deck.where(s.place), r));
  return beam_shape("CIRC", {r});
}

std::optional<FeBeamSection> InpResolver::i_section(const InpSection& s) const {
  // Height of the axis, height, widths and thicknesses of the lower and upper flange, web; the height lies along the second direction.
  if (s.numbers.size() < 7) return std::nullopt;
  const std::vector<double>& d = s.numbers;
  std::optional<FeBeamSection> made = open_section("I", {d[1], d[2], d[3], d[6], d[4], d[5]});
  if (!made) return made;
  std::swap(made->I11, made->I22);
  std::swap(made->shear1, made->shear2);
  const double lower = d[2] * d[4], upper = d[3] * d[5], web = (d[1] - d[4] - d[5]) * d[6];
  const double middle = (0.5 * lower * d[4] + upper * (d[1] - 0.5 * d[5]) + 0.5 * web * (d[1] + d[4] - d[5])) / made->area;
  if (std::abs(middle - d[0]) > 1e-3 * d[1])
    fail(s.place,
         fmt::format("*BEAM SECTION, SECTION=I: the axis at height {:g} m lies beside the centroid at {:g} m; put the nodes there and "
                     "give its height",
                     d[0], middle));
  return made;
}

void InpResolver::add_beam_section(int space, const InpSection& s, const std::vector<int>& elements) {
  std::optional<FeBeamSection> made;
  if (s.shape == "I") made = i_section(s);
  else if (s.numbers.empty() && !scope(space).nodal_thickness.empty()) made = beam_shape(s.shape, {1.0, 1.0});
  else if (s.shape == "CIRC") made = circle(s);
  else if (s.shape == "RECT" && s.numbers.size() == 1) made = beam_shape(s.shape, {s.numbers[0], s.numbers[0]});
  else made = beam_shape(s.shape, s.numbers);
  if (!made)
    fail(s.place,
         fmt::format("*BEAM SECTION, SECTION={}: RECT, CIRC, PIPE, BOX, I and GENERAL with dimensions > 0 can be read; give others as "
                     "GENERAL (area, I11, I12, I22, J)",
                     s.shape));
  if (const auto& d = s.numbers; s.shape == "BOX" && d.size() >= 6 && (d[2] != d[4] || d[3] != d[5]))
    model.warnings.push_back(
        fmt::format("{}: *BEAM SECTION, SECTION=BOX whose walls differ: its centroid lies at the nodes here, in Abaqus the middle of the "
                    "box; where that matters move the nodes, or give the beam as GENERAL",
                    deck.where(s.place)));
  made->n1 = spaces[space].turn * s.n1;
  model.beam_sections.push_back(*made);
  const int shared = static_cast<int>(model.beam_sections.size()) - 1;
  if (s.shape == "RECT" || s.shape == "CIRC") rectangles[shared] = s.shape == "RECT";
  int material = -1;
  if (s.own_constants) {
    FeMaterial own;
    own.name = s.set;
    own.youngs_modulus = s.young;
    own.poisson = s.shear > 0.0 ? s.young / (2 * s.shear) - 1.0 : 0.0;
    own.density = s.density;
    model.materials.push_back(own);
    material = static_cast<int>(model.materials.size()) - 1;
  } else {
    material = material_named(s.material, s.place);
  }
  if (model.materials[material].elasticity) fail(s.place, "*BEAM SECTION: beams need an isotropic material");
  for (int index : elements) {
    FeElement& e = model.elements[index];
    if (e.shape != FeShape::beam2) fail(s.place, fmt::format("*BEAM SECTION for element {}, a {}", e.id, fe_name(e.shape)));
    warn_of_section(index, s);
    e.section = shared;
    e.material = material;
    const auto direction = beam_directions.find(index);
    if (direction == beam_directions.end()) continue;
    // From the first node of the element to one beside it, instead of the section's.
    FeBeamSection own = *made;
    own.n1 = model.nodes[direction->second] - model.nodes[model.connectivity[e.first]];
    if (!(own.n1.norm() > 0.0)) fail(s.place, fmt::format("beam {}: the node of its direction is its first one", e.id));
    model.beam_sections.push_back(own);
    e.section = static_cast<int>(model.beam_sections.size()) - 1;
    if (const auto shape = rectangles.find(shared); shape != rectangles.end()) rectangles[e.section] = shape->second;
  }
}

void InpResolver::add_thickness(int space) {
  const InpScope& from = scope(space);
  if (from.nodal_thickness.empty()) return;
  std::map<int, std::pair<double, double>> given;
  double steepest = 1.0;
  bool used = false, passed_over = false;
  for (const InpThickness& t : from.nodal_thickness)
    for (int node : nodes_named(space, t.where, t.place)) given[node] = {t.first, t.second};
  for (size_t k = 0; k < spaces[space].first.size(); ++k)
    for (int index = spaces[space].first[k]; index < spaces[space].first[k] + spaces[space].count[k]; ++index) {
      FeElement& e = model.elements[index];
      const bool beam = e.shape == FeShape::beam2 && e.section >= 0 && rectangles.contains(e.section);
      if (!fe_is_shell(e.shape) && !beam) continue;
      // Only sections that ask for them have the nodes' thicknesses, and those that have none of their own.
      if (const auto s = sectioned.find(index); s != sectioned.end() && !s->second->nodal_thickness && has_size(*s->second)) {
        passed_over = true;
        continue;
      }
      VecX all_first(e.count);
      double first = 0.0, second = 0.0, least = std::numeric_limits<double>::max(), most = 0.0;
      bool all = true;
      for (int i = 0; i < e.count && all; ++i) {
        const auto at = given.find(model.connectivity[e.first + i]);
        all = at != given.end();
        if (!all) break;
        all_first(i) = at->second.first;
        first += at->second.first / e.count;
        second += at->second.second / e.count;
        least = std::min(least, at->second.first);
        most = std::max(most, at->second.first);
      }
      if (!all) continue;
      used = true;
      const bool curved = e.shape == FeShape::triangle6 || e.shape == FeShape::quadrangle8;
      if (curved && most > least && least > 0.0) model.node_thickness[index] = all_first;
      if (!curved) steepest = std::max(steepest, most / least);
      if (!beam) {
        e.thickness = first;
        continue;
      }
      std::optional<FeBeamSection> made =
          beam_shape(rectangles.at(e.section) ? "RECT" : "CIRC", {rectangles.at(e.section) ? first : 0.5 * first, second});
      if (!made) fail(from.nodal_thickness[0].place, fmt::format("*NODAL THICKNESS of beam {}: thicknesses > 0 are expected", e.id));
      made->n1 = model.beam_sections[e.section].n1;
      model.beam_sections.push_back(*made);
      e.section = static_cast<int>(model.beam_sections.size()) - 1;
    }
  if (used) add_once(model.notes, "*NODAL THICKNESS: beams and shells of 3 and 4 nodes have the mean of their nodes");
  if (passed_over)
    model.warnings.push_back(
        fmt::format("{}: *NODAL THICKNESS counts only where the section has the parameter NODAL THICKNESS, as in Abaqus and CalculiX: the "
                    "others keep their own thickness",
                    deck.where(from.nodal_thickness[0].place)));
  if (steepest > 1.2)
    model.warnings.push_back(fmt::format(
        "{}: *NODAL THICKNESS changes by a factor of up to {:.2g} within an element, which has the mean: use smaller elements there",
        deck.where(from.nodal_thickness[0].place), steepest));
}

void InpResolver::add_masses(int space) {
  for (const InpValue& v : scope(space).masses)
    complaints.guarded([&] {
      for (int e : elements_named(space, v.set, v.place, "*MASS")) {
        FeElement& element = model.elements[e];
        if (element.shape != FeShape::point_mass)
          fail(v.place, fmt::format("*MASS for element {}, a {}", element.id, fe_name(element.shape)));
        element.thickness = v.numbers.empty() ? 0.0 : v.numbers[0];
      }
    });
  for (const InpValue& v : scope(space).rotaries)
    complaints.guarded([&] {
      if (v.numbers.size() < 6) fail(v.place, "*ROTARY INERTIA: six moments of inertia are expected");
      for (int e : elements_named(space, v.set, v.place, "*ROTARY INERTIA")) {
        Mat3 axes = spaces[space].turn;
        FeElement& element = model.elements[e];
        if (element.shape != FeShape::lumped)
          fail(v.place, fmt::format("*ROTARY INERTIA for element {}, a {}", element.id, fe_name(element.shape)));
        if (!v.orientation.empty()) axes = model.axes[axes_for(space, v.orientation, v.place, element)];
        Mat3 J;
        J << v.numbers[0], v.numbers[3], v.numbers[4], v.numbers[3], v.numbers[1], v.numbers[5], v.numbers[4], v.numbers[5], v.numbers[2];
        FeLump lump;
        lump.turns = true;
        lump.K = lump.M = MatX::Zero(6, 6);
        lump.M.bottomRightCorner<3, 3>() = axes * J * axes.transpose();
        give_lump(element, lump);
      }
    });
  for (const InpValue& v : scope(space).added_masses) complaints.guarded([&] { add_distributed_mass(space, v); });
}

void InpResolver::give_lump(FeElement& e, const FeLump& lump) {
  model.lumps.push_back(lump);
  e.section = static_cast<int>(model.lumps.size()) - 1;
}

double InpResolver::extent(const FeElement& e) const {
  Mat3X X(3, e.count);
  for (int k = 0; k < e.count; ++k) X.col(k) = model.nodes[model.connectivity[e.first + k]];
  double sum = 0.0;
  if (fe_is_solid(e.shape))
    for (const FePoint& p : solid_points(e.shape, e.formulation, FeRule::mass, X, e.id)) sum += p.volume;
  else if (fe_is_shell(e.shape))
    for (const FeShellPoint& p : shell_points(e.shape, X, e.id)) sum += p.area;
  else if (e.shape == FeShape::beam2) sum = (X.col(1) - X.col(0)).norm();
  return sum;
}

void InpResolver::add_distributed_mass(int space, const InpValue& v) {
  const std::vector<int> elements = elements_named(space, v.set, v.place, "*NONSTRUCTURAL MASS");
  double mass = 0.0;
  for (double m : v.numbers) mass += m;
  // What a unit of volume, area or length gets.
  const bool total = v.unit == "TOTAL MASS" || v.unit.empty();
  double whole = 0.0;
  const auto own = [&](const FeElement& e) {
    if (e.shape == FeShape::point_mass || e.shape == FeShape::lumped || e.material < 0)
      fail(v.place,
           fmt::format("*NONSTRUCTURAL MASS on element {}, a {} without a material of its own, cannot be read", e.id, fe_name(e.shape)));
    const double section = fe_is_shell(e.shape) ? e.thickness : e.shape == FeShape::beam2 ? model.beam_sections[e.section].area : 1.0;
    return std::pair(extent(e) * section * model.materials[e.material].density, section);
  };
  for (int index : elements) whole += own(model.elements[index]).first;
  if (total && !(whole > 0.0)) fail(v.place, "*NONSTRUCTURAL MASS, UNITS=TOTAL MASS is shared by mass: the elements have no density");
  std::map<std::pair<int, double>, int> made;
  for (int index : elements) {
    FeElement& e = model.elements[index];
    const FeMaterial& m = model.materials[e.material];
    const double section = own(e).second;
    const double density = total ? m.density * (1.0 + mass / whole) : m.density + (v.unit == "MASS PER VOLUME" ? mass : mass / section);
    const auto [at, fresh] = made.try_emplace({e.material, density}, static_cast<int>(model.materials.size()));
    if (fresh) {
      FeMaterial heavier = m;
      heavier.density = density;
      model.materials.push_back(heavier);
    }
    e.material = at->second;
  }
}

Vec3 InpResolver::direction(int node, int d) const {
  const auto it = transformed.find(node);
  return it == transformed.end() ? Vec3(Vec3::Unit(d % 3)) : Vec3(it->second.col(d % 3));
}

void InpResolver::add_springs(int space, const InpValue& v) {
  for (int index : elements_named(space, v.set, v.place, "*SPRING")) {
    FeElement& e = model.elements[index];
    if (e.shape != FeShape::lumped) fail(v.place, fmt::format("*SPRING for element {}, a {}", e.id, fe_name(e.shape)));
    if (!v.orientation.empty()) fail(v.place, "*SPRING, ORIENTATION cannot be read; use a SPRINGA between two nodes in that direction");
    const bool axial = kinds.at(index) == InpKind::spring_axial;
    const auto& lines = v.lines;
    if (lines.size() < (axial ? 1 : 2) || lines[axial ? 0 : 1].empty())
      fail(v.place,
           axial ? "*SPRING: a stiffness is expected" : "*SPRING: directions in the first line and a stiffness in the second are expected");
    double stiffness = lines[axial ? 0 : 1][0] * deck.force_per_length;
    const int* nodes = &model.connectivity[e.first];
    FeLump lump;
    const Eigen::Index directions = 6 * Eigen::Index{e.count};
    VecX b = VecX::Zero(directions);
    if (axial) {
      const Vec3 axis = model.nodes[nodes[1]] - model.nodes[nodes[0]];
      if (!(axis.norm() > 0.0)) fail(v.place, fmt::format("spring {} has no length, so no direction", e.id));
      b.segment<3>(0) = -axis.normalized();
      b.segment<3>(6) = axis.normalized();
    } else {
      const auto motion = [&](size_t k) {
        const double given = k < lines[0].size() ? lines[0][k] : lines[0].empty() ? 0.0 : lines[0][0];
        if (!(given >= 1.0 && given <= 6.0) || given != std::floor(given))
          fail(v.place, fmt::format("*SPRING: directions 1 to 6 are allowed, found {:g}", given));
        return static_cast<int>(given) - 1;
      };
      const int d = motion(0);
      lump.turns = d >= 3;
      if (d >= 3) stiffness *= deck.length * deck.length;  // moment over angle
      b.segment<3>(d < 3 ? 0 : 3) = direction(nodes[0], d);
      if (e.count == 2) {
        const int other = motion(1);
        lump.turns = lump.turns || other >= 3;
        b.segment<3>(other < 3 ? 6 : 9) = -direction(nodes[1], other);
      }
    }
    lump.K = stiffness * b * b.transpose();
    lump.M = MatX::Zero(directions, directions);
    give_lump(e, lump);
  }
}

void InpResolver::need_properties() {
  const auto massless = [](const FeElement& e) { return e.shape == FeShape::point_mass && e.thickness == 0.0; };
  if (const auto first = std::find_if(model.elements.begin(), model.elements.end(), massless); first != model.elements.end())
    model.warnings.push_back(fmt::format("{}: {} elements of TYPE=MASS (element {} first) have no mass: *MASS gives it",
                                         place_of(model, *first), std::count_if(model.elements.begin(), model.elements.end(), massless),
                                         first->id));
  for (const FeElement& e : model.elements)
    if ((e.shape == FeShape::lumped || e.shape == FeShape::beam2) && e.section < 0)
      return complaints.texts.push_back(
          fmt::format("{}: element {} ({}) has no section: give *SPRING, *ROTARY INERTIA, *BEAM SECTION or (trusses) *SOLID "
                      "SECTION",
                      place_of(model, e), e.id, fe_name(e.shape)));
}

}  // namespace flexframe::sim
