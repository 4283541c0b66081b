// Sets, surfaces, instances and numbers of an input file: what a name stands for.
#include "sim/reduce/fe_inp_resolver.h"

#include <algorithm>

namespace flexframe::sim {

int InpResolver::node_by_id(int space, int id) {
  const auto& at = scope(space).node_at;
  if (const auto it = at.find(id); it != at.end()) return spaces[space].first_node + it->second;
  if (space == 0 && spaces.size() == 2) return node_by_id(1, id);
  return -1;
}

int InpResolver::space_by_name(const std::string& name) const {
  for (size_t i = 1; i < spaces.size(); ++i)
    if (spaces[i].name == name) return static_cast<int>(i);
  return -1;
}

std::optional<std::vector<int>> InpResolver::node_set(int space, const std::string& name) {
  const auto found = find(space, name, [&](int s, const std::string& n) { return scope(s).node_sets.contains(n); });
  if (!found) return std::nullopt;
  std::set<int> out;
  std::set<std::pair<int, std::string>> visited;
  add_node_set(found->first, found->second, out, visited);
  return std::vector<int>(out.begin(), out.end());
}

namespace {

// Numbers of the range that the index has. A range may be larger than the model.
std::vector<int> numbers_in(const std::array<int, 3>& range, const std::unordered_map<int, int>& index) {
  const auto [first, last, by] = range;
  std::vector<int> out;
  if ((static_cast<long>(last) - first) / by > static_cast<long>(index.size())) {
    for (const auto& [id, i] : index)
      if (id >= first && id <= last && (id - first) % by == 0) out.push_back(id);
  } else {
    for (long id = first; id <= last; id += by)
      if (index.contains(static_cast<int>(id))) out.push_back(static_cast<int>(id));
  }
  return out;
}

}  // namespace

void InpResolver::add_node_set(int space, const std::string& name, std::set<int>& out, std::set<std::pair<int, std::string>>& visited) {
  if (!visited.emplace(space, name).second) return;
  for (const InpMembers& m : scope(space).node_sets.at(name)) {
    const int whose = instance_of(space, m.instance);
    for (int id : m.ids) {
      const int node = node_by_id(whose, id);
      if (node < 0) throw InputError(fmt::format("{}: node set '{}' has node {}, which is not there", model.file, name, id));
      out.insert(node);
    }
    for (const auto& range : m.ranges) {
      std::vector<int> ids = numbers_in(range, scope(whose).node_at);
      if (ids.empty() && whose == 0 && spaces.size() == 2) ids = numbers_in(range, scope(1).node_at);
      for (int id : ids) out.insert(node_by_id(whose, id));
    }
    for (const std::string& of : m.elements_of) {
      const auto elements = element_set(whose, of);
      if (!elements) throw InputError(fmt::format("{}: node set '{}': element set '{}' is not there", model.file, name, of));
      for (int node : nodes_of(*elements)) out.insert(node);
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

int InpResolver::dotted_node(const std::string& name) {
  const size_t dot = name.find('.');
  if (dot == std::string::npos || !inp_is_integer(name.substr(dot + 1)) || name.size() - dot > 10) return -1;
  const int space = space_by_name(name.substr(0, dot));
  return space < 0 ? -1 : node_by_id(space, std::stoi(name.substr(dot + 1)));
}

int InpResolver::instance_of(int space, const std::string& name) const {
  if (name.empty()) return space;
  const int found = space_by_name(name);
  if (found < 0) throw InputError(fmt::format("{}: instance '{}' is not there", model.file, name));
  return found;
}

std::optional<std::vector<InpElementRef>> InpResolver::element_set(int space, const std::string& name) {
  const auto found = find(space, name, [&](int s, const std::string& n) { return scope(s).element_sets.contains(n); });
  if (!found) return std::nullopt;
  std::set<InpElementRef> out;
  std::set<std::pair<int, std::string>> visited;
  add_element_set(found->first, found->second, out, visited);
  return std::vector<InpElementRef>(out.begin(), out.end());
}

std::optional<InpElementRef> InpResolver::element_by_id(int space, int id) {
  const auto& at = scope(space).element_at;
  if (const auto it = at.find(id); it != at.end()) return InpElementRef{space, it->second};
  if (space == 0 && spaces.size() == 2) return element_by_id(1, id);
  return std::nullopt;
}

void InpResolver::add_element_set(int space, const std::string& name, std::set<InpElementRef>& out,
                                  std::set<std::pair<int, std::string>>& visited) {
  if (!visited.emplace(space, name).second) return;
  for (const InpMembers& m : scope(space).element_sets.at(name)) {
    const int whose = instance_of(space, m.instance);
    for (int id : m.ids) {
      const auto e = element_by_id(whose, id);
      if (!e) throw InputError(fmt::format("{}: element set '{}' has element {}, which is not there", model.file, name, id));
      out.insert(*e);
    }
    for (const auto& range : m.ranges) {
      std::vector<int> ids = numbers_in(range, scope(whose).element_at);
      if (ids.empty() && whose == 0 && spaces.size() == 2) ids = numbers_in(range, scope(1).element_at);
      for (int id : ids) out.insert(*element_by_id(whose, id));
    }
    for (const std::string& other : m.names) {
      const auto found = find(whose, other, [&](int s, const std::string& n) { return scope(s).element_sets.contains(n); });
      if (!found) throw InputError(fmt::format("{}: element set '{}' refers to '{}', which is not there", model.file, name, other));
      add_element_set(found->first, found->second, out, visited);
    }
  }
}

std::vector<int> InpResolver::nodes_of(const std::vector<InpElementRef>& elements) {
  std::set<int> out;
  for (const InpElementRef& r : elements) {
    const InpElement& e = scope(r.space).elements[r.local];
    for (int k = 0; k < e.type->nodes; ++k)
      if (const int node = node_by_id(r.space, scope(r.space).connectivity[e.first + k]); node >= 0) out.insert(node);
  }
  return {out.begin(), out.end()};
}

std::vector<int> InpResolver::model_elements(const std::vector<InpElementRef>& elements) {
  std::vector<int> out;
  for (const InpElementRef& r : elements) {
    const InpSpace& s = spaces[r.space];
    for (int k = 0; k < s.count[r.local]; ++k) out.push_back(s.first[r.local] + k);
  }
  return out;
}

std::vector<int> InpResolver::nodes_named(int space, const std::string& where, const InpPlace& place) {
  if (inp_is_integer(where) && where.size() < 10) {
    const int node = node_by_id(space, std::stoi(where));
    if (node < 0) fail(place, fmt::format("node {} is not there", where));
    return {node};
  }
  if (const int node = dotted_node(where); node >= 0) return {node};
  const auto set = node_set(space, where);
  if (!set) fail(place, fmt::format("node set '{}' is not there", where));
  if (set->empty())
    model.warnings.push_back(fmt::format("{}: node set '{}' has no nodes: what is said of it does nothing", deck.where(place), where));
  return *set;
}

int InpResolver::one_node(int space, const std::string& where, const InpPlace& place) {
  const std::vector<int> nodes = nodes_named(space, where, place);
  if (nodes.size() != 1) fail(place, fmt::format("the reference '{}' must be one node", where));
  return nodes[0];
}

std::vector<int> InpResolver::elements_named(int space, const std::string& set, const InpPlace& place, const char* what) {
  const auto found = element_set(space, set);
  if (!found) fail(place, fmt::format("{}: element set '{}' is not there", what, set));
  return model_elements(*found);
}

void InpResolver::name_sets() {
  for (int i = 0; i < static_cast<int>(spaces.size()); ++i) {
    const bool plain = i == 0 || spaces.size() == 2;
    const std::string& instance = spaces[i].name;
    const auto shown = [&](const auto& taken, const std::string& name) {
      return plain && !taken.contains(name) ? name : instance + "." + name;
    };
    // Entries, not structured bindings: clang 14 lets no lambda capture those.
    for (const auto& entry : scope(i).node_sets)
      complaints.guarded([&] { model.node_sets[shown(model.node_sets, entry.first)] = *node_set(i, entry.first); });
    for (const auto& entry : scope(i).element_sets)
      complaints.guarded(
          [&] { model.element_sets[shown(model.element_sets, entry.first)] = model_elements(*element_set(i, entry.first)); });
  }
}

int InpResolver::material_named(const std::string& name, const InpPlace& place) const {
  for (size_t i = 0; i < model.materials.size(); ++i)
    if (inp_upper(model.materials[i].name) == inp_upper(name)) return static_cast<int>(i);
  fail(place, fmt::format("section: material '{}' is not there", name));
}

const InpAxes* InpResolver::axes_named(int space, const std::string& name, const InpPlace& place, int& whose) {
  const auto found = find(space, name, [&](int s, const std::string& n) { return scope(s).orientations.contains(n); });
  if (!found) fail(place, fmt::format("orientation '{}' is not there", name));
  whose = found->first;
  return &scope(found->first).orientations.at(found->second);
}

std::vector<std::vector<int>> InpResolver::faces_of(int space, const std::string& name, const InpPlace& place, bool edges) {
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
      for (int e : elements) out.push_back(face_of(model.elements[e], name, face, place, edges));
  }
  return out;
}

std::vector<int> InpResolver::in_model(const FeElement& e, const std::vector<int>& places) const {
  std::vector<int> out;
  out.reserve(places.size());
  for (int k : places) out.push_back(model.connectivity[e.first + k]);
  return out;
}

std::vector<int> InpResolver::face_of(const FeElement& e, const std::string& name, const std::string& face, const InpPlace& place,
                                      bool edges) const {
  const auto& faces = fe_faces(e.shape);
  const int k = face.size() == 2 && (face[0] == 'S' || face[0] == 'E') ? face[1] - '1' : -1;
  if (fe_is_shell(e.shape)) {
    const int corners = static_cast<int>(faces[0].size());
    // E1, E2, ... are edges; in CalculiX S3, S4, ... are, too, and S1 and S2 the two sides.
    const int edge = face[0] == 'E' ? k : k - 2;
    if (edges && face.size() == 2 && (face[0] == 'E' || k >= 2) && edge >= 0 && edge < corners) {
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

void InpResolver::add_free_faces(const std::vector<int>& elements, std::vector<std::vector<int>>& out) const {
  std::map<std::vector<int>, std::pair<int, std::vector<int>>> seen;
  for (int index : elements) {
    const FeElement& e = model.elements[index];
    for (int k = 0; k < static_cast<int>(fe_faces(e.shape).size()); ++k) {
      std::vector<int> key = in_model(e, fe_faces(e.shape)[k]);
      std::sort(key.begin(), key.end());
      auto& entry = seen[key];
      if (entry.first++ == 0) entry.second = in_model(e, fe_face_nodes(e.shape, k));
    }
  }
  for (const auto& [key, entry] : seen)
    if (entry.first == 1) out.push_back(entry.second);
}

}  // namespace flexframe::sim
