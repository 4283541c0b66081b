// Queries on the finite element model. See fe_model.h.
#include "sim/reduce/fe_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <unordered_map>

namespace flexframe::sim {

int fe_node_count(FeShape shape) {
  switch (shape) {
    case FeShape::tetrahedron4:
    case FeShape::quadrangle4:
      return 4;
    case FeShape::tetrahedron10:
      return 10;
    case FeShape::hexahedron8:
      return 8;
    case FeShape::hexahedron20:
      return 20;
    case FeShape::wedge6:
      return 6;
    case FeShape::wedge15:
      return 15;
    case FeShape::triangle3:
      return 3;
    case FeShape::point_mass:
      return 1;
  }
  return 0;
}

bool fe_is_shell(FeShape shape) { return shape == FeShape::triangle3 || shape == FeShape::quadrangle4; }
bool fe_is_solid(FeShape shape) { return !fe_is_shell(shape) && shape != FeShape::point_mass; }

const char* fe_name(FeShape shape) {
  switch (shape) {
    case FeShape::tetrahedron4:
      return "4-node tetrahedron";
    case FeShape::tetrahedron10:
      return "10-node tetrahedron";
    case FeShape::hexahedron8:
      return "8-node hexahedron";
    case FeShape::hexahedron20:
      return "20-node hexahedron";
    case FeShape::wedge6:
      return "6-node wedge";
    case FeShape::wedge15:
      return "15-node wedge";
    case FeShape::triangle3:
      return "3-node shell";
    case FeShape::quadrangle4:
      return "4-node shell";
    case FeShape::point_mass:
      return "point mass";
  }
  return "";
}

const std::vector<std::vector<int>>& fe_faces(FeShape shape) {
  // Abaqus' face numbers S1, S2, ...
  static const std::vector<std::vector<int>> tetrahedron = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  static const std::vector<std::vector<int>> hexahedron = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                                           {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
  static const std::vector<std::vector<int>> wedge = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}};
  static const std::vector<std::vector<int>> triangle = {{0, 1, 2}}, quadrangle = {{0, 1, 2, 3}}, none;
  switch (shape) {
    case FeShape::tetrahedron4:
    case FeShape::tetrahedron10:
      return tetrahedron;
    case FeShape::hexahedron8:
    case FeShape::hexahedron20:
      return hexahedron;
    case FeShape::wedge6:
    case FeShape::wedge15:
      return wedge;
    case FeShape::triangle3:
      return triangle;
    case FeShape::quadrangle4:
      return quadrangle;
    case FeShape::point_mass:
      break;
  }
  return none;
}

void set_material(FeModel& model, const FeMaterial& material, const std::string& element_set) {
  const int index = static_cast<int>(model.materials.size());
  model.materials.push_back(material);
  if (element_set.empty()) {
    for (FeElement& e : model.elements)
      if (e.material < 0) e.material = index;
    return;
  }
  const auto set = model.element_sets.find(element_set);
  if (set == model.element_sets.end()) {
    std::string names;
    for (const auto& [name, members] : model.element_sets) names += (names.empty() ? "" : ", ") + name;
    throw InputError(fmt::format("{}: material for element set '{}', which is not there; there are: {}", model.file, element_set,
                                 names.empty() ? "none" : names));
  }
  for (int e : set->second) model.elements[e].material = index;
}

std::string place_of(const FeModel& model, const FeElement& element) {
  return element.line > 0 ? fmt::format("{}:{}", model.file, element.line) : model.file;
}

void check_model(const FeModel& model) {
  if (model.matrices) return;
  if (model.elements.empty()) throw InputError(fmt::format("{}: no elements that can be used", model.file));
  std::vector<bool> used(model.materials.size(), false);
  for (const FeElement& e : model.elements) {
    if (e.shape == FeShape::point_mass) continue;
    if (e.material < 0)
      throw InputError(
          fmt::format("{}: element {} has no material: give a section in the model, or --material YOUNGS_MODULUS,POISSON,DENSITY",
                      place_of(model, e), e.id));
    used[e.material] = true;
    if (fe_is_shell(e.shape) && !(e.thickness > 0.0))
      throw InputError(
          fmt::format("{}: shell element {} has no thickness: give a *SHELL SECTION, or --thickness", place_of(model, e), e.id));
  }
  for (size_t i = 0; i < used.size(); ++i) {
    const FeMaterial& m = model.materials[i];
    if (!used[i]) continue;
    if (!(m.youngs_modulus > 0.0))
      throw InputError(fmt::format("{}: material '{}': Young's modulus must be > 0, found {}", model.file, m.name, m.youngs_modulus));
    if (!(m.poisson > -1.0 && m.poisson < 0.5))
      throw InputError(fmt::format("{}: material '{}': Poisson's ratio must be in (-1, 0.5), found {}", model.file, m.name, m.poisson));
    if (!(m.density > 0.0))
      throw InputError(fmt::format("{}: material '{}': density must be > 0, found {}", model.file, m.name, m.density));
  }
}

std::vector<std::vector<int>> outer_faces(const FeModel& model) {
  struct Key {
    std::array<int, 4> nodes;
    bool operator==(const Key&) const = default;
  };
  struct Hash {
    size_t operator()(const Key& k) const {
      size_t h = 1469598103934665603ULL;
      for (int n : k.nodes) h = (h ^ static_cast<size_t>(n)) * 1099511628211ULL;
      return h;
    }
  };
  std::unordered_map<Key, std::pair<int, size_t>, Hash> seen;  // key -> times, index in all
  std::vector<std::vector<int>> all;
  std::vector<bool> shell;
  for (const FeElement& e : model.elements)
    for (const std::vector<int>& face : fe_faces(e.shape)) {
      std::vector<int> nodes;
      nodes.reserve(face.size());
      for (int k : face) nodes.push_back(model.connectivity[e.first + k]);
      Key key{{-1, -1, -1, -1}};
      std::copy(nodes.begin(), nodes.end(), key.nodes.begin());
      std::sort(key.nodes.begin(), key.nodes.end());
      const bool is_shell = fe_is_shell(e.shape);
      if (!is_shell) {
        const auto [at, fresh] = seen.try_emplace(key, 0, all.size());
        ++at->second.first;
        if (!fresh) continue;
      }
      all.push_back(std::move(nodes));
      shell.push_back(is_shell);
    }
  std::vector<bool> inner(all.size(), false);
  for (const auto& [key, entry] : seen)
    if (entry.first > 1) inner[entry.second] = true;
  std::vector<std::vector<int>> outer;
  for (size_t i = 0; i < all.size(); ++i)
    if (!inner[i]) outer.push_back(std::move(all[i]));
  return outer;
}

}  // namespace flexframe::sim
