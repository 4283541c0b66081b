// Tables of an Abaqus / CalculiX input file to a model: instances are placed, names looked up, sections and ties made. See read_inp in
// fe_model.h.
#include "sim/reduce/fe_elements.h"
#include "sim/reduce/fe_inp_tables.h"
#include "sim/reduce/fe_tie.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>

namespace flexframe::sim {
namespace {

// A scope where it stands: the deck outside of parts, or an instance of a part.
struct Space {
  std::string name;
  size_t scope = 0;
  Mat3 turn = Mat3::Identity();
  Vec3 shift = Vec3::Zero();
  int first_node = 0;             // of the model
  std::vector<int> first, count;  // of the model's elements, per element of the scope
};

struct ElementRef {
  int space = 0, local = 0;
  auto operator<=>(const ElementRef&) const = default;
};

class Resolver {
 public:
  Resolver(InpDeck d, const std::string& file) : deck(std::move(d)) { model.file = file; }

  FeModel run() {
    model.notes = deck.notes;
    model.warnings = deck.warnings;
    model.materials = deck.materials;
    refusals = deck.refusals;
    place_spaces();
    for (int i = 0; i < static_cast<int>(spaces.size()); ++i) add_elements(i);
    // What follows would only name the elements that are missing.
    if (!refusals.empty()) refuse_all();
    name_sets();
    for (int i = 0; i < static_cast<int>(spaces.size()); ++i) {
      for (const InpSection& s : scope(i).sections) guarded([&] { add_section(i, s); });
      add_thickness(i);
      add_masses(i);
      for (const InpTransform& t : scope(i).transforms) guarded([&] { add_transform(i, t); });
    }
    for (int i = 0; i < static_cast<int>(spaces.size()); ++i)
      for (const InpValue& v : scope(i).springs) guarded([&] { add_springs(i, v); });
    mark_turning();
    for (int i = 0; i < static_cast<int>(spaces.size()); ++i) {
      for (const InpTie& t : scope(i).ties) guarded([&] { add_tie(i, t); });
      for (const InpMpc& m : scope(i).mpcs) guarded([&] { add_mpc(i, m); });
    }
    for (int i = 0; i < static_cast<int>(spaces.size()); ++i) {
      for (const InpEquation& e : scope(i).equations) guarded([&] { add_equation(i, e); });
      for (const InpBoundary& b : scope(i).boundaries) guarded([&] { add_boundary(i, b); });
    }
    need_properties();
    if (!refusals.empty()) refuse_all();
    return std::move(model);
  }

 private:
  InpDeck deck;
  FeModel model;
  std::vector<std::string> refusals;
  std::vector<Space> spaces;
  std::map<int, Mat3> transformed;                         // node -> its axes
  std::map<int, InpKind> kinds;                            // of lumped elements
  std::map<int, int> rotation_nodes;                       // node that stands for the rotations of another
  std::vector<bool> turning;                               // nodes that have rotations of their own
  std::map<std::pair<int, std::string>, int> rectangular;  // space and orientation -> axes

  InpScope& scope(int space) { return deck.scopes[spaces[static_cast<size_t>(space)].scope]; }

  [[noreturn]] void fail(const InpPlace& place, const std::string& text) const {
    throw InputError(fmt::format("{}: {}", deck.where(place), text));
  }
  [[noreturn]] void refuse_all() const {
    constexpr size_t most = 30;
    std::vector<std::string> shown(refusals.begin(), refusals.begin() + static_cast<long>(std::min(most, refusals.size())));
    if (refusals.size() > most) shown.push_back(fmt::format("{}: and {} more", model.file, refusals.size() - most));
    throw InputError(fmt::format("{}", fmt::join(shown, "\n")));
  }
  // Every complaint is collected, so that all are told at once.
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

  void place_spaces() {
    spaces.push_back({});
    if (deck.instances.empty())
      for (size_t n = 1; n < deck.scopes.size(); ++n) deck.instances.push_back({deck.scopes[n].name, n});
    for (const InpInstance& i : deck.instances) {
      Space s;
      s.name = i.name;
      s.scope = i.scope;
      s.turn = i.turn;
      s.shift = i.shift;
      spaces.push_back(std::move(s));
    }
    // Numbers of a later instance are moved where they are taken.
    int highest = 0, offset = 0;
    for (size_t n = 0; n < spaces.size(); ++n) {
      Space& s = spaces[n];
      const InpScope& from = deck.scopes[s.scope];
      s.first_node = static_cast<int>(model.nodes.size());
      int top = 0;
      for (int id : from.node_ids) top = std::max(top, id);
      for (const InpElement& e : from.elements) top = std::max(top, e.id);
      offset = 0;
      if (highest > 0 && top > 0) {
        offset = 1;
        while (offset <= std::max(highest, top) && offset < 1000000000) offset *= 10;
        offset *= std::max(1, (highest + offset - 1) / offset);
        if (offset > 2000000000 - top)
          throw InputError(fmt::format("{}: the numbers of the instances do not fit side by side", model.file));
        note(fmt::format("nodes and elements of instance {} have their numbers + {}", s.name, offset));
      }
      highest = std::max(highest, top + offset);
      for (size_t k = 0; k < from.nodes.size(); ++k) {
        model.node_ids.push_back(from.node_ids[k] + offset);
        model.nodes.push_back(s.turn * from.nodes[k] + s.shift);
      }
      offsets.push_back(offset);
    }
  }
  std::vector<int> offsets;

  // Index in the model of a node by its number; -1: not there. A number outside of parts may be meant for the only instance.
  int node_by_id(int space, int id) {
    const auto& at = scope(space).node_at;
    if (const auto it = at.find(id); it != at.end()) return spaces[static_cast<size_t>(space)].first_node + it->second;
    if (space == 0 && spaces.size() == 2) return node_by_id(1, id);
    return -1;
  }

  void add_elements(int space) {
    Space& s = spaces[static_cast<size_t>(space)];
    const InpScope& from = scope(space);
    for (const InpElement& e : from.elements) {
      const InpType& type = *e.type;
      std::vector<int> nodes;
      for (int k = 0; k < type.nodes; ++k) {
        const int id = from.connectivity[static_cast<size_t>(e.first + k)], node = node_by_id(space, id);
        if (node < 0) fail(e.place, fmt::format("element {}: node {} is not there", e.id, id));
        nodes.push_back(node);
      }
      s.first.push_back(static_cast<int>(model.elements.size()));
      const auto add = [&](std::vector<int> some) {
        FeElement made;
        made.id = e.id + offsets[static_cast<size_t>(space)];
        made.shape = type.shape;
        made.formulation = type.formulation;
        made.first = static_cast<int>(model.connectivity.size());
        made.count = static_cast<int>(some.size());
        made.line = e.place.file == 0 ? e.place.line : 0;
        model.connectivity.insert(model.connectivity.end(), some.begin(), some.end());
        if (type.shape == FeShape::lumped) kinds[static_cast<int>(model.elements.size())] = type.kind;
        model.elements.push_back(made);
      };
      if (type.kind == InpKind::beam && type.nodes == 3) {
        add({nodes[0], nodes[1]});
        add({nodes[1], nodes[2]});
      } else if (type.kind != InpKind::rigid_shape && type.kind != InpKind::left_out && type.kind != InpKind::point) {
        add(nodes);
      }
      s.count.push_back(static_cast<int>(model.elements.size()) - s.first.back());
    }
  }

  // ---- Names -------------------------------------------------------------------------------------------------------------------------

  int space_by_name(const std::string& name) const {
    for (size_t i = 1; i < spaces.size(); ++i)
      if (spaces[i].name == name) return static_cast<int>(i);
    return -1;
  }

  // The space and own name that a name means, seen from `space`: its own, INSTANCE.NAME, one outside of parts, one of the only instance.
  template <class Has>
  std::optional<std::pair<int, std::string>> find(int space, const std::string& name, const Has& has) {
    if (has(space, name)) return std::pair(space, name);
    if (const size_t dot = name.find('.'); dot != std::string::npos) {
      const int other = space_by_name(name.substr(0, dot));
      if (other >= 0 && has(other, name.substr(dot + 1))) return std::pair(other, name.substr(dot + 1));
    }
    if (space != 0 && has(0, name)) return std::pair(0, name);
    if (space == 0 && spaces.size() == 2 && has(1, name)) return std::pair(1, name);
    return std::nullopt;
  }

  std::optional<std::vector<int>> node_set(int space, const std::string& name) {
    const auto found = find(space, name, [&](int s, const std::string& n) { return scope(s).node_sets.contains(n); });
    if (!found) return std::nullopt;
    std::set<int> out;
    std::set<std::pair<int, std::string>> visited;
    add_node_set(found->first, found->second, out, visited);
    return std::vector<int>(out.begin(), out.end());
  }

  void add_node_set(int space, const std::string& name, std::set<int>& out, std::set<std::pair<int, std::string>>& visited) {
    if (!visited.emplace(space, name).second) return;
    for (const InpMembers& m : scope(space).node_sets.at(name)) {
      const int whose = instance_of(space, m.instance);
      for (int id : m.ids) {
        const int node = node_by_id(whose, id);
        if (node < 0) throw InputError(fmt::format("{}: node set '{}' has node {}, which is not there", model.file, name, id));
        out.insert(node);
      }
      for (const std::string& other : m.names) {
        if (const int node = dotted_node(other); node >= 0) {
          out.insert(node);
          continue;
        }
        const auto found = find(whose, other, [&](int s, const std::string& n) { return scope(s).node_sets.contains(n); });
        if (found) {
          add_node_set(found->first, found->second, out, visited);
          continue;
        }
        // The nodes of an element set, as *NSET, ELSET has them.
        const auto elements = element_set(whose, other);
        if (!elements) throw InputError(fmt::format("{}: node set '{}' refers to '{}', which is not there", model.file, name, other));
        for (int node : nodes_of(*elements)) out.insert(node);
      }
    }
  }

  // "INSTANCE.12"; -1: none.
  int dotted_node(const std::string& name) {
    const size_t dot = name.find('.');
    if (dot == std::string::npos || !inp_is_integer(name.substr(dot + 1)) || name.size() - dot > 10) return -1;
    const int space = space_by_name(name.substr(0, dot));
    return space < 0 ? -1 : node_by_id(space, std::stoi(name.substr(dot + 1)));
  }

  int instance_of(int space, const std::string& name) const {
    if (name.empty()) return space;
    const int found = space_by_name(name);
    if (found < 0) throw InputError(fmt::format("{}: instance '{}' is not there", model.file, name));
    return found;
  }

  std::optional<std::vector<ElementRef>> element_set(int space, const std::string& name) {
    const auto found = find(space, name, [&](int s, const std::string& n) { return scope(s).element_sets.contains(n); });
    if (!found) return std::nullopt;
    std::set<ElementRef> out;
    std::set<std::pair<int, std::string>> visited;
    add_element_set(found->first, found->second, out, visited);
    return std::vector<ElementRef>(out.begin(), out.end());
  }

  std::optional<ElementRef> element_by_id(int space, int id) {
    const auto& at = scope(space).element_at;
    if (const auto it = at.find(id); it != at.end()) return ElementRef{space, it->second};
    if (space == 0 && spaces.size() == 2) return element_by_id(1, id);
    return std::nullopt;
  }

  void add_element_set(int space, const std::string& name, std::set<ElementRef>& out, std::set<std::pair<int, std::string>>& visited) {
    if (!visited.emplace(space, name).second) return;
    for (const InpMembers& m : scope(space).element_sets.at(name)) {
      const int whose = instance_of(space, m.instance);
      for (int id : m.ids) {
        const auto e = element_by_id(whose, id);
        if (!e) throw InputError(fmt::format("{}: element set '{}' has element {}, which is not there", model.file, name, id));
        out.insert(*e);
      }
      for (const std::string& other : m.names) {
        const auto found = find(whose, other, [&](int s, const std::string& n) { return scope(s).element_sets.contains(n); });
        if (!found) throw InputError(fmt::format("{}: element set '{}' refers to '{}', which is not there", model.file, name, other));
        add_element_set(found->first, found->second, out, visited);
      }
    }
  }

  std::vector<int> nodes_of(const std::vector<ElementRef>& elements) {
    std::set<int> out;
    for (const ElementRef& r : elements) {
      const InpElement& e = scope(r.space).elements[static_cast<size_t>(r.local)];
      for (int k = 0; k < e.type->nodes; ++k)
        out.insert(node_by_id(r.space, scope(r.space).connectivity[static_cast<size_t>(e.first + k)]));
    }
    return {out.begin(), out.end()};
  }

  std::vector<int> model_elements(const std::vector<ElementRef>& elements) {
    std::vector<int> out;
    for (const ElementRef& r : elements) {
      const Space& s = spaces[static_cast<size_t>(r.space)];
      for (int k = 0; k < s.count[static_cast<size_t>(r.local)]; ++k) out.push_back(s.first[static_cast<size_t>(r.local)] + k);
    }
    return out;
  }

  // Nodes by a number, INSTANCE.NUMBER or a set.
  std::vector<int> nodes_named(int space, const std::string& where, const InpPlace& place) {
    if (inp_is_integer(where) && where.size() < 10) {
      const int node = node_by_id(space, std::stoi(where));
      if (node < 0) fail(place, fmt::format("node {} is not there", where));
      return {node};
    }
    if (const int node = dotted_node(where); node >= 0) return {node};
    const auto set = node_set(space, where);
    if (!set) fail(place, fmt::format("node set '{}' is not there", where));
    return *set;
  }

  int one_node(int space, const std::string& where, const InpPlace& place) {
    const std::vector<int> nodes = nodes_named(space, where, place);
    if (nodes.size() != 1) fail(place, fmt::format("the reference '{}' must be one node", where));
    return nodes[0];
  }

  std::vector<int> elements_named(int space, const std::string& set, const InpPlace& place, const char* what) {
    const auto found = element_set(space, set);
    if (!found) fail(place, fmt::format("{}: element set '{}' is not there", what, set));
    return model_elements(*found);
  }

  // Sets of instances have the instance's name before theirs where there are several, or where the plain name is taken.
  void name_sets() {
    for (int i = 0; i < static_cast<int>(spaces.size()); ++i) {
      const bool plain = i == 0 || spaces.size() == 2;
      const std::string& instance = spaces[static_cast<size_t>(i)].name;
      const auto shown = [&](const auto& taken, const std::string& name) {
        return plain && !taken.contains(name) ? name : instance + "." + name;
      };
      // Entries, not structured bindings: clang 14 lets no lambda capture those.
      for (const auto& entry : scope(i).node_sets)
        guarded([&] { model.node_sets[shown(model.node_sets, entry.first)] = *node_set(i, entry.first); });
      for (const auto& entry : scope(i).element_sets)
        guarded([&] { model.element_sets[shown(model.element_sets, entry.first)] = model_elements(*element_set(i, entry.first)); });
    }
  }

  // ---- Sections ----------------------------------------------------------------------------------------------------------------------

  int material_named(const std::string& name, const InpPlace& place) const {
    for (size_t i = 0; i < model.materials.size(); ++i)
      if (inp_upper(model.materials[i].name) == inp_upper(name)) return static_cast<int>(i);
    fail(place, fmt::format("section: material '{}' is not there", name));
  }

  const InpAxes* axes_named(int space, const std::string& name, const InpPlace& place, int& whose) {
    const auto found = find(space, name, [&](int s, const std::string& n) { return scope(s).orientations.contains(n); });
    if (!found) fail(place, fmt::format("orientation '{}' is not there", name));
    whose = found->first;
    return &scope(found->first).orientations.at(found->second);
  }

  // Index of the axes of an orientation for an element: one for all where it is rectangular.
  int axes_for(int space, const std::string& name, const InpPlace& place, const FeElement& e) {
    int whose = 0;
    const InpAxes* axes = axes_named(space, name, place, whose);
    const Space& s = spaces[static_cast<size_t>(whose)];
    if (!axes->cylindrical)
      if (const auto it = rectangular.find({whose, name}); it != rectangular.end()) return it->second;
    Vec3 middle = Vec3::Zero();
    for (int k = 0; k < e.count; ++k)
      middle += model.nodes[static_cast<size_t>(model.connectivity[static_cast<size_t>(e.first + k)])] / e.count;
    Mat3 made;
    if (!axes->at(s.turn.transpose() * (middle - s.shift), made))
      fail(place, fmt::format("orientation '{}' has no direction at element {}, which lies on its axis", name, e.id));
    model.axes.push_back(s.turn * made);
    if (!axes->cylindrical) rectangular[{whose, name}] = static_cast<int>(model.axes.size()) - 1;
    return static_cast<int>(model.axes.size()) - 1;
  }

  void add_section(int space, const InpSection& s) {
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
      FeElement& e = model.elements[static_cast<size_t>(index)];
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
      if (!s.orientation.empty()) e.axes = axes_for(space, s.orientation, s.place, e);
      if (!s.shell) continue;
      e.section = layup;
      e.thickness = s.numbers.empty() ? 0.0 : s.numbers[0];
      if (!s.layers.empty()) {
        e.thickness = 0.0;
        for (const InpLayer& l : s.layers) e.thickness += l.thickness;
        set_layer_axes(space, s, e);
      }
    }
  }

  // Layers with orientations of their own; cylindrical ones differ from element to element, and so does then the layup.
  void set_layer_axes(int space, const InpSection& s, FeElement& e) {
    FeLayup made = model.layups[static_cast<size_t>(e.section)];
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

  void add_beam_section(int space, const InpSection& s, const std::vector<int>& elements) {
    std::optional<FeBeamSection> made = beam_shape(s.shape, s.numbers);
    if (!made)
      fail(s.place,
           fmt::format("*BEAM SECTION, SECTION={}: RECT, CIRC, PIPE, BOX and GENERAL with dimensions > 0 can be read; give others as "
                       "GENERAL (area, I11, I12, I22, J)",
                       s.shape));
    made->n1 = spaces[static_cast<size_t>(space)].turn * s.n1;
    model.beam_sections.push_back(*made);
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
    if (model.materials[static_cast<size_t>(material)].elasticity) fail(s.place, "*BEAM SECTION: beams need an isotropic material");
    for (int index : elements) {
      FeElement& e = model.elements[static_cast<size_t>(index)];
      if (e.shape != FeShape::beam2) fail(s.place, fmt::format("*BEAM SECTION for element {}, a {}", e.id, fe_name(e.shape)));
      e.section = static_cast<int>(model.beam_sections.size()) - 1;
      e.material = material;
    }
  }

  // Mean of the nodes' thicknesses.
  void add_thickness(int space) {
    const InpScope& from = scope(space);
    if (from.nodal_thickness.empty()) return;
    note("*NODAL THICKNESS: each shell has the mean of its nodes");
    for (int index : spaces[static_cast<size_t>(space)].first) {
      if (index >= static_cast<int>(model.elements.size())) continue;
      FeElement& e = model.elements[static_cast<size_t>(index)];
      if (!fe_is_shell(e.shape)) continue;
      double sum = 0.0;
      int there = 0;
      for (int k = 0; k < e.count; ++k) {
        const int node = model.connectivity[static_cast<size_t>(e.first + k)] - spaces[static_cast<size_t>(space)].first_node;
        if (node < 0 || node >= static_cast<int>(from.node_ids.size())) continue;
        if (const auto it = from.nodal_thickness.find(from.node_ids[static_cast<size_t>(node)]); it != from.nodal_thickness.end()) {
          sum += it->second;
          ++there;
        }
      }
      if (there == e.count) e.thickness = sum / there;
    }
  }

  // ---- Masses and springs --------------------------------------------------------------------------------------------------------------

  void add_masses(int space) {
    for (const InpValue& v : scope(space).masses)
      guarded([&] {
        for (int e : elements_named(space, v.set, v.place, "*MASS"))
          model.elements[static_cast<size_t>(e)].thickness = v.numbers.empty() ? 0.0 : v.numbers[0];
      });
    for (const InpValue& v : scope(space).rotaries)
      guarded([&] {
        if (v.numbers.size() < 6) fail(v.place, "*ROTARY INERTIA: six moments of inertia are expected");
        for (int e : elements_named(space, v.set, v.place, "*ROTARY INERTIA")) {
          Mat3 axes = spaces[static_cast<size_t>(space)].turn;
          FeElement& element = model.elements[static_cast<size_t>(e)];
          if (element.shape != FeShape::lumped)
            fail(v.place, fmt::format("*ROTARY INERTIA for element {}, a {}", element.id, fe_name(element.shape)));
          if (!v.orientation.empty()) axes = model.axes[static_cast<size_t>(axes_for(space, v.orientation, v.place, element))];
          Mat3 J;
          J << v.numbers[0], v.numbers[3], v.numbers[4], v.numbers[3], v.numbers[1], v.numbers[5], v.numbers[4], v.numbers[5], v.numbers[2];
          FeLump lump;
          lump.turns = true;
          lump.K = lump.M = MatX::Zero(6, 6);
          lump.M.bottomRightCorner<3, 3>() = axes * J * axes.transpose();
          give_lump(element, lump);
        }
      });
    for (const InpValue& v : scope(space).added_masses) guarded([&] { add_distributed_mass(space, v); });
  }

  void give_lump(FeElement& e, const FeLump& lump) {
    model.lumps.push_back(lump);
    e.section = static_cast<int>(model.lumps.size()) - 1;
  }

  // Volume, or of shells their area, or of beams their length; and whether it is there.
  double extent(const FeElement& e) const {
    Mat3X X(3, e.count);
    for (int k = 0; k < e.count; ++k) X.col(k) = model.nodes[static_cast<size_t>(model.connectivity[static_cast<size_t>(e.first + k)])];
    double sum = 0.0;
    if (fe_is_solid(e.shape))
      for (const FePoint& p : solid_points(e.shape, e.formulation, FeRule::mass, X, e.id)) sum += p.volume;
    else if (fe_is_shell(e.shape))
      for (const FeShellPoint& p : shell_points(e.shape, X, e.id)) sum += p.area;
    else if (e.shape == FeShape::beam2) sum = (X.col(1) - X.col(0)).norm();
    return sum;
  }

  // *NONSTRUCTURAL MASS as more density: a material of its own for each material of the set.
  void add_distributed_mass(int space, const InpValue& v) {
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
      const double section = fe_is_shell(e.shape)        ? e.thickness
                             : e.shape == FeShape::beam2 ? model.beam_sections[static_cast<size_t>(e.section)].area
                                                         : 1.0;
      return std::pair(extent(e) * section * model.materials[static_cast<size_t>(e.material)].density, section);
    };
    for (int index : elements) whole += own(model.elements[static_cast<size_t>(index)]).first;
    if (total && !(whole > 0.0)) fail(v.place, "*NONSTRUCTURAL MASS, UNITS=TOTAL MASS is shared by mass: the elements have no density");
    std::map<std::pair<int, double>, int> made;
    for (int index : elements) {
      FeElement& e = model.elements[static_cast<size_t>(index)];
      const FeMaterial& m = model.materials[static_cast<size_t>(e.material)];
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

  // Direction of motion d at a node: translations for d < 3, rotations else.
  Vec3 direction(int node, int d) const {
    const auto it = transformed.find(node);
    return it == transformed.end() ? Vec3(Vec3::Unit(d % 3)) : Vec3(it->second.col(d % 3));
  }

  void add_springs(int space, const InpValue& v) {
    for (int index : elements_named(space, v.set, v.place, "*SPRING")) {
      FeElement& e = model.elements[static_cast<size_t>(index)];
      if (e.shape != FeShape::lumped) fail(v.place, fmt::format("*SPRING for element {}, a {}", e.id, fe_name(e.shape)));
      if (!v.orientation.empty()) fail(v.place, "*SPRING, ORIENTATION cannot be read; use a SPRINGA between two nodes in that direction");
      const bool axial = kinds.at(index) == InpKind::spring_axial;
      const auto& lines = v.lines;
      if (lines.size() < (axial ? 1 : 2) || lines[axial ? 0 : 1].empty())
        fail(v.place, axial ? "*SPRING: a stiffness is expected"
                            : "*SPRING: directions in the first line and a stiffness in the second are expected");
      double stiffness = lines[axial ? 0 : 1][0] * deck.force_per_length;
      const int* nodes = &model.connectivity[static_cast<size_t>(e.first)];
      FeLump lump;
      VecX b = VecX::Zero(6 * e.count);
      if (axial) {
        const Vec3 axis = model.nodes[static_cast<size_t>(nodes[1])] - model.nodes[static_cast<size_t>(nodes[0])];
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
      lump.M = MatX::Zero(6 * e.count, 6 * e.count);
      give_lump(e, lump);
    }
  }

  void need_properties() {
    for (const FeElement& e : model.elements)
      if ((e.shape == FeShape::lumped || e.shape == FeShape::beam2) && e.section < 0)
        return refusals.push_back(
            fmt::format("{}: element {} ({}) has no section: give *SPRING, *ROTARY INERTIA, *BEAM SECTION or (trusses) *SOLID "
                        "SECTION",
                        place_of(model, e), e.id, fe_name(e.shape)));
  }

  // ---- Ties --------------------------------------------------------------------------------------------------------------------------

  void add_transform(int space, const InpTransform& t) {
    const Space& s = spaces[static_cast<size_t>(space)];
    for (int node : nodes_named(space, t.set, t.place)) {
      Mat3 axes;
      if (!t.axes.at(s.turn.transpose() * (model.nodes[static_cast<size_t>(node)] - s.shift), axes))
        fail(t.place,
             fmt::format("*TRANSFORM has no direction at node {}, which lies on its axis", model.node_ids[static_cast<size_t>(node)]));
      transformed[node] = s.turn * axes;
    }
  }

  void mark_turning() {
    turning.assign(model.nodes.size(), false);
    for (const FeElement& e : model.elements) {
      const bool turns = fe_is_shell(e.shape) ||
                         (e.shape == FeShape::beam2 && e.section >= 0 && !model.beam_sections[static_cast<size_t>(e.section)].truss);
      for (int k = 0; k < e.count && turns; ++k) turning[static_cast<size_t>(model.connectivity[static_cast<size_t>(e.first + k)])] = true;
    }
  }

  // Faces of a surface of elements, as nodes of the model; a shell's face is all of it, an edge of it its nodes.
  std::vector<std::vector<int>> faces_of(int space, const std::string& name, const InpPlace& place) {
    const auto found = find(space, name, [&](int s, const std::string& n) { return scope(s).surfaces.contains(n); });
    if (!found) fail(place, fmt::format("surface '{}' is not there", name));
    const InpSurface& surface = scope(found->first).surfaces.at(found->second);
    std::vector<std::vector<int>> out;
    for (const auto& [where, face] : surface.parts) {
      std::vector<int> elements;
      if (inp_is_integer(where) && where.size() < 10) {
        const auto e = element_by_id(found->first, std::stoi(where));
        if (!e) fail(place, fmt::format("surface '{}': element {} is not there", name, where));
        elements = model_elements({*e});
      } else {
        const auto set = element_set(found->first, where);
        if (!set) fail(place, fmt::format("surface '{}': element set '{}' is not there", name, where));
        elements = model_elements(*set);
      }
      if (face.empty()) add_free_faces(elements, out);
      else
        for (int e : elements) out.push_back(face_of(model.elements[static_cast<size_t>(e)], name, face, place));
    }
    return out;
  }

  std::vector<int> in_model(const FeElement& e, const std::vector<int>& places) const {
    std::vector<int> out;
    for (int k : places) out.push_back(model.connectivity[static_cast<size_t>(e.first + k)]);
    return out;
  }

  std::vector<int> face_of(const FeElement& e, const std::string& name, const std::string& face, const InpPlace& place) const {
    const auto& faces = fe_faces(e.shape);
    const int k = face.size() == 2 && (face[0] == 'S' || face[0] == 'E') ? face[1] - '1' : -1;
    if (fe_is_shell(e.shape)) {
      const int corners = static_cast<int>(faces[0].size());
      // E1, E2, ... are edges; in CalculiX S3, S4, ... are, too, and S1 and S2 the two sides.
      const int edge = face[0] == 'E' ? k : k - 2;
      if (face.size() == 2 && (face[0] == 'E' || k >= 2) && edge >= 0 && edge < corners) {
        std::vector<int> nodes = {edge, (edge + 1) % corners};
        if (const int middle = fe_middle(e.shape, nodes[0], nodes[1]); middle >= 0) nodes.push_back(middle);
        return in_model(e, nodes);
      }
      return in_model(e, fe_face_nodes(e.shape, 0));
    }
    if (k < 0 || k >= static_cast<int>(faces.size()) || face[0] != 'S')
      fail(place, fmt::format("surface '{}': face '{}' of a {}: S1 to S{} are allowed", name, face, fe_name(e.shape), faces.size()));
    return in_model(e, fe_face_nodes(e.shape, k));
  }

  void add_free_faces(const std::vector<int>& elements, std::vector<std::vector<int>>& out) const {
    std::map<std::vector<int>, std::pair<int, std::vector<int>>> seen;
    for (int index : elements) {
      const FeElement& e = model.elements[static_cast<size_t>(index)];
      for (int k = 0; k < static_cast<int>(fe_faces(e.shape).size()); ++k) {
        std::vector<int> key = in_model(e, fe_faces(e.shape)[static_cast<size_t>(k)]);
        std::sort(key.begin(), key.end());
        auto& entry = seen[key];
        if (entry.first++ == 0) entry.second = in_model(e, fe_face_nodes(e.shape, k));
      }
    }
    for (const auto& [key, entry] : seen)
      if (entry.first == 1) out.push_back(entry.second);
  }

  // Nodes of a surface, and each one's share of its area (for element faces; 1 else).
  std::map<int, double> weights_of_surface(int space, const std::string& name, const InpPlace& place) {
    const auto found = find(space, name, [&](int s, const std::string& n) { return scope(s).surfaces.contains(n); });
    if (!found) fail(place, fmt::format("surface '{}' is not there", name));
    const InpSurface& surface = scope(found->first).surfaces.at(found->second);
    std::map<int, double> out;
    if (surface.nodes) {
      for (const auto& part : surface.parts)
        for (int node : nodes_named(found->first, part.first, place)) out[node] = 1.0;
      return out;
    }
    for (const std::vector<int>& face : faces_of(space, name, place)) {
      const double share = face_area(model, face) / static_cast<double>(face.size());
      for (int node : face) out[node] += share;
    }
    return out;
  }

  void add_tie(int space, const InpTie& t) {
    if (t.kind == InpTie::Kind::surfaces) return add_surface_tie(space, t);
    FeSpider spider;
    spider.name = t.name;
    spider.rigid = !t.averaging;
    spider.line = t.place.line;
    std::map<int, double> nodes;
    if (t.kind == InpTie::Kind::coupling) {
      nodes = weights_of_surface(space, t.surface, t.place);
    } else if (t.kind == InpTie::Kind::rigid) {
      if (!t.set.empty())
        for (int n : nodes_named(space, t.set, t.place)) nodes[n] = 1.0;
      if (!t.element_set.empty()) {
        const auto set = element_set(space, t.element_set);
        if (!set) fail(t.place, fmt::format("*RIGID BODY: element set '{}' is not there", t.element_set));
        for (int n : nodes_of(*set)) nodes[n] = 1.0;
      }
    } else {
      for (const auto& [where, weight] : t.members)
        for (int n : nodes_named(space, where, t.place)) nodes[n] += weight;
    }
    if (t.kind == InpTie::Kind::weights) {
      const auto set = element_set(space, t.element_set);
      if (!set || set->size() != 1)
        fail(t.place, fmt::format("*DISTRIBUTING COUPLING: element set '{}' must have one DCOUP3D element", t.element_set));
      spider.node = nodes_of(*set)[0];
    } else {
      spider.node = t.reference.empty() ? add_reference(nodes) : one_node(space, t.reference, t.place);
    }
    nodes.erase(spider.node);
    if (nodes.empty()) fail(t.place, fmt::format("'{}' ties no nodes to its reference point", t.name));
    if (!t.rotation_node.empty()) rotation_nodes[one_node(space, t.rotation_node, t.place)] = spider.node;
    for (const auto& [node, weight] : nodes) {
      spider.slaves.push_back(node);
      if (t.averaging) spider.weights.push_back(weight);
    }
    if (t.averaging && std::all_of(spider.weights.begin(), spider.weights.end(), [&](double w) { return w == spider.weights[0]; }))
      spider.weights.clear();
    if (!t.averaging && partly(t, spider)) return;
    model.spiders.push_back(std::move(spider));
  }

  int add_reference(const std::map<int, double>& nodes) {
    Vec3 middle = Vec3::Zero();
    for (const auto& [node, weight] : nodes) middle += model.nodes[static_cast<size_t>(node)] / static_cast<double>(nodes.size());
    model.nodes.push_back(middle);
    model.node_ids.push_back(*std::max_element(model.node_ids.begin(), model.node_ids.end()) + 1);
    turning.push_back(false);
    return static_cast<int>(model.nodes.size()) - 1;
  }

  // A kinematic coupling of some directions only: an equation for each. true: made.
  bool partly(const InpTie& t, const FeSpider& spider) {
    std::set<int> dofs;
    for (const auto& [first, last] : t.dofs)
      for (int d = first; d <= last; ++d) dofs.insert(d);
    if (dofs.empty()) return false;
    const bool translations = dofs.contains(0) && dofs.contains(1) && dofs.contains(2),
               rotations = dofs.contains(3) && dofs.contains(4) && dofs.contains(5);
    const bool any_turning =
        std::any_of(spider.slaves.begin(), spider.slaves.end(), [&](int n) { return turning[static_cast<size_t>(n)]; });
    if (translations && (rotations || !any_turning)) return false;
    for (int node : spider.slaves) {
      const Vec3 r = model.nodes[static_cast<size_t>(node)] - model.nodes[static_cast<size_t>(spider.node)];
      for (int d : dofs) {
        if (d >= 3 && !turning[static_cast<size_t>(node)]) continue;
        FeEquation e;
        e.line = t.place.line;
        e.terms = {{node, d, -1.0}, {spider.node, d, 1.0}};
        // u_d = u_m,d + (theta x r)_d.
        const Vec3 arm = r.cross(Vec3(Vec3::Unit(d % 3)));
        for (int k = 0; k < 3 && d < 3; ++k)
          if (arm(k) != 0.0) e.terms.push_back({spider.node, 3 + k, arm(k)});
        model.equations.push_back(std::move(e));
      }
    }
    return true;
  }

  void add_surface_tie(int space, const InpTie& t) {
    const std::vector<std::vector<int>> master = faces_of(space, t.master, t.place);
    std::vector<int> slaves;
    for (const auto& [node, weight] : weights_of_surface(space, t.surface, t.place)) slaves.push_back(node);
    TieResult made = tie_nodes(model, slaves, master, t.tolerance, t.adjust);
    if (made.tied == 0)
      fail(t.place,
           fmt::format("*TIE: no node of '{}' lies on '{}'; the nearest is {:.3g} m away (POSITION TOLERANCE says how far it may be)",
                       t.surface, t.master, made.nearest));
    for (FeEquation& e : made.equations) {
      e.line = t.place.line;
      model.equations.push_back(std::move(e));
    }
    if (made.left > 0)
      model.warnings.push_back(fmt::format("{}: *TIE: {} of {} nodes of '{}' are farther than {:.3g} m from '{}' and stay free",
                                           deck.where(t.place), made.left, made.left + made.tied, t.surface, made.tolerance, t.master));
    if (made.moved > 0.0)
      note(fmt::format("{}: *TIE: nodes of '{}' are moved onto '{}' by up to {:.3g} m", deck.where(t.place), t.surface, t.master,
                       made.moved));
    if (std::any_of(slaves.begin(), slaves.end(), [&](int n) { return turning[static_cast<size_t>(n)]; }))
      note(fmt::format("{}: *TIE ties translations; rotations of shells stay free at '{}'", deck.where(t.place), t.surface));
  }

  void add_mpc(int space, const InpMpc& m) {
    std::vector<std::vector<int>> lists;
    for (const std::string& where : m.nodes) lists.push_back(nodes_named(space, where, m.place));
    if (lists.size() < 2) fail(m.place, fmt::format("*MPC, {}: two nodes are expected", m.type));
    const size_t pairs = lists[0].size();
    if (lists[1].size() != pairs && lists[1].size() != 1) fail(m.place, fmt::format("*MPC, {}: both sets must have as many nodes", m.type));
    for (size_t k = 0; k < pairs; ++k) {
      const int slave = lists[0][k], master = lists[1].size() == 1 ? lists[1][0] : lists[1][k];
      if (slave == master) continue;
      if (m.type == "BEAM") {
        FeSpider spider;
        spider.node = master;
        spider.slaves = {slave};
        spider.line = m.place.line;
        const auto same =
            std::find_if(model.spiders.begin(), model.spiders.end(), [&](const FeSpider& s) { return s.rigid && s.node == master; });
        if (same != model.spiders.end()) same->slaves.push_back(slave);
        else model.spiders.push_back(spider);
        continue;
      }
      const bool rotations = m.type == "TIE" && turning[static_cast<size_t>(slave)] && turning[static_cast<size_t>(master)];
      for (int d = 0; d < (rotations ? 6 : 3); ++d) model.equations.push_back({{{slave, d, 1.0}, {master, d, -1.0}}, m.place.line});
    }
  }

  // A term in the node's own directions as terms in space.
  void add_term(int node, int dof, double coefficient, FeEquation& out) const {
    if (const auto it = rotation_nodes.find(node); it != rotation_nodes.end() && dof < 3) {
      out.terms.push_back({it->second, 3 + dof, coefficient});
      return;
    }
    if (!transformed.contains(node)) {
      out.terms.push_back({node, dof, coefficient});
      return;
    }
    const Vec3 along = direction(node, dof);
    std::array<int, 3> order = {0, 1, 2};
    // The largest part first: it is the one taken out.
    std::sort(order.begin(), order.end(), [&](int a, int b) { return std::abs(along(a)) > std::abs(along(b)); });
    for (int d : order)
      if (along(d) != 0.0) out.terms.push_back({node, (dof < 3 ? 0 : 3) + d, coefficient * along(d)});
  }

  void add_equation(int space, const InpEquation& given) {
    std::vector<std::vector<int>> nodes;
    size_t count = 1;
    for (const InpEquation::Term& t : given.terms) {
      nodes.push_back(nodes_named(space, t.node, given.place));
      if (nodes.back().size() > 1) count = nodes.back().size();
    }
    for (const auto& list : nodes)
      if (list.size() != 1 && list.size() != count) fail(given.place, "*EQUATION: its node sets must have as many nodes");
    for (size_t k = 0; k < count; ++k) {
      FeEquation e;
      e.line = given.place.line;
      for (size_t i = 0; i < given.terms.size(); ++i)
        add_term(nodes[i].size() == 1 ? nodes[i][0] : nodes[i][k], given.terms[i].dof, given.terms[i].coefficient, e);
      model.equations.push_back(std::move(e));
    }
  }

  void add_boundary(int space, const InpBoundary& b) {
    for (int node : nodes_named(space, b.where, b.place))
      for (int dof : b.dofs) {
        FeConstraint c;
        c.node = node;
        c.dof = dof;
        if (const auto it = rotation_nodes.find(node); it != rotation_nodes.end()) {
          if (dof >= 3) continue;
          c.node = it->second;
          c.dof = 3 + dof;
        } else if (transformed.contains(node)) {
          c.direction = direction(node, dof);
        }
        model.constraints.push_back(c);
      }
  }
};

}  // namespace

FeModel resolve_inp(InpDeck deck, const std::string& file) { return Resolver(std::move(deck), file).run(); }

FeModel read_inp(const std::filesystem::path& path, const FeUnits& units) {
  return resolve_inp(read_inp_tables(path, units), path.string());
}

}  // namespace flexframe::sim
