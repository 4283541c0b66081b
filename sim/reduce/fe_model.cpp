// Queries on the finite element model. See fe_model.h.
#include "sim/reduce/fe_model.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <set>
#include <unordered_map>
#include <utility>

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
    case FeShape::triangle6:
      return 6;
    case FeShape::wedge15:
      return 15;
    case FeShape::triangle3:
      return 3;
    case FeShape::quadrangle8:
      return 8;
    case FeShape::beam2:
      return 2;
    case FeShape::point_mass:
      return 1;
    case FeShape::lumped:  // as many as it has
      break;
  }
  return 0;
}

bool fe_is_shell(FeShape shape) {
  return shape == FeShape::triangle3 || shape == FeShape::quadrangle4 || shape == FeShape::triangle6 || shape == FeShape::quadrangle8;
}
bool fe_is_solid(FeShape shape) { return shape <= FeShape::wedge15; }

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
    case FeShape::triangle6:
      return "6-node shell";
    case FeShape::quadrangle8:
      return "8-node shell";
    case FeShape::beam2:
      return "beam";
    case FeShape::lumped:
      return "spring or mass";
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
    case FeShape::triangle6:
      return triangle;
    case FeShape::quadrangle4:
    case FeShape::quadrangle8:
      return quadrangle;
    default:
      return none;
  }
}

int fe_middle(FeShape shape, int a, int b) {
  // Lower corner, higher corner, the node between them.
  static constexpr int tetrahedron[6][3] = {{0, 1, 4}, {1, 2, 5}, {0, 2, 6}, {0, 3, 7}, {1, 3, 8}, {2, 3, 9}};
  static constexpr int hexahedron[12][3] = {{0, 1, 8},  {1, 2, 9},  {2, 3, 10}, {0, 3, 11}, {4, 5, 12}, {5, 6, 13},
                                            {6, 7, 14}, {4, 7, 15}, {0, 4, 16}, {1, 5, 17}, {2, 6, 18}, {3, 7, 19}};
  static constexpr int wedge[9][3] = {{0, 1, 6},  {1, 2, 7},  {0, 2, 8},  {3, 4, 9}, {4, 5, 10},
                                      {3, 5, 11}, {0, 3, 12}, {1, 4, 13}, {2, 5, 14}};
  static constexpr int triangle[3][3] = {{0, 1, 3}, {1, 2, 4}, {0, 2, 5}};
  static constexpr int quadrangle[4][3] = {{0, 1, 4}, {1, 2, 5}, {2, 3, 6}, {0, 3, 7}};
  const auto search = [&](const auto& table) {
    for (const auto& edge : table)
      if (edge[0] == std::min(a, b) && edge[1] == std::max(a, b)) return edge[2];
    return -1;
  };
  switch (shape) {
    case FeShape::tetrahedron10:
      return search(tetrahedron);
    case FeShape::hexahedron20:
      return search(hexahedron);
    case FeShape::wedge15:
      return search(wedge);
    case FeShape::triangle6:
      return search(triangle);
    case FeShape::quadrangle8:
      return search(quadrangle);
    default:
      return -1;
  }
}

std::vector<int> fe_face_nodes(FeShape shape, int k) {
  std::vector<int> out = fe_faces(shape)[k];
  const size_t corners = out.size();
  for (size_t i = 0; i < corners; ++i)
    if (const int middle = fe_middle(shape, out[i], out[(i + 1) % corners]); middle >= 0) out.push_back(middle);
  return out;
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

namespace {

// The materials of a name, or all.
template <class Give>
void complete(FeModel& model, const std::string& name, const char* option, const Give& give) {
  bool found = false;
  std::string names;
  for (FeMaterial& m : model.materials) {
    names += (names.empty() ? "" : ", ") + m.name;
    if (!name.empty() && m.name != name) continue;
    found = true;
    give(m);
  }
  if (!found && !(name.empty() && model.materials.empty()))
    throw InputError(fmt::format("{}: {} for material '{}', which is not there; there are: {}", model.file, option, name,
                                 names.empty() ? "none" : names));
}

}  // namespace

void complete_density(FeModel& model, const std::string& name, double density) {
  complete(model, name, "--density", [&](FeMaterial& m) {
    if (m.density > 0.0) return;
    m.density = density;
    m.massless = false;
  });
}

void complete_elasticity(FeModel& model, const std::string& name, double youngs_modulus, double poisson) {
  complete(model, name, "--elastic", [&](FeMaterial& m) {
    if (m.elasticity || m.youngs_modulus > 0.0) return;
    m.youngs_modulus = youngs_modulus;
    m.poisson = poisson;
  });
}

std::string place_of(const FeModel& model, const FeElement& element) {
  return element.line > 0 ? fmt::format("{}:{}", model.file, element.line) : model.file;
}

namespace {

// Elements that lack the same thing are one complaint: the first, and how many more.
struct Lacking {
  std::string first;
  int count = 0;
  void add(const std::string& text) {
    if (count++ == 0) first = text;
  }
  std::string text() const { return count > 1 ? fmt::format("{} (and {} more elements)", first, count - 1) : first; }
};

bool is_inp(const FeModel& model) {
  const std::string ending = std::filesystem::path(model.file).extension().string();
  return ending == ".inp" || ending == ".INP";
}

// spread: whether solids or shells are made of it, not beams alone.
void check_material(const FeModel& model, const FeMaterial& m, bool spread, std::vector<std::string>& faults) {
  const auto fault = [&](const std::string& text) { faults.push_back(fmt::format("{}: material '{}': {}", model.file, m.name, text)); };
  const bool deck = is_inp(model);
  if (m.elasticity) {
    const Eigen::LLT<Mat6> factor(*m.elasticity);
    if (!m.elasticity->allFinite() || factor.info() != Eigen::Success)
      fault("its elastic constants are no stable material: the matrix must be positive definite");
  } else {
    if (!(m.youngs_modulus > 0.0))
      fault(fmt::format("Young's modulus must be > 0, found {}; give {} in the model, or --elastic {}=YOUNGS_MODULUS,POISSON in SI",
                        m.youngs_modulus, deck ? "*ELASTIC" : "E of its card", m.name));
    if ((spread || !(m.shear_modulus > 0.0)) && !(m.poisson > -1.0 && m.poisson < 0.5))
      fault(fmt::format("Poisson's ratio must be in (-1, 0.5), found {}", m.poisson));
  }
  if (!(m.density > 0.0) && !m.massless)
    fault(fmt::format("density must be > 0, found {}; give {} in the model, or --density {}=DENSITY in kg/m^3", m.density,
                      deck ? "*DENSITY" : "RHO of its card", m.name));
}

}  // namespace

void check_model(const FeModel& model) {
  if (model.matrices) return;
  if (model.elements.empty()) throw InputError(fmt::format("{}: no elements that can be used", model.file));
  std::vector<bool> used(model.materials.size(), false), spread = used;
  Lacking material, thickness;
  for (const FeElement& e : model.elements) {
    if (e.shape == FeShape::point_mass || e.shape == FeShape::lumped) continue;
    const bool layered = fe_is_shell(e.shape) && e.section >= 0 && !model.layups[e.section].layers.empty();
    if (layered) {
      for (const FeLayer& l : model.layups[e.section].layers) used[l.material] = spread[l.material] = true;
      continue;
    }
    if (fe_is_shell(e.shape) && e.section >= 0)
      for (const int m : {model.layups[e.section].bending_material, model.layups[e.section].shear_material})
        if (m >= 0) used[m] = true;
    if (e.material >= 0) {
      used[e.material] = true;
      spread[e.material] = spread[e.material] || e.shape != FeShape::beam2;
    } else {
      material.add(fmt::format("{}: element {} has no material: give a section in the model, or --material YOUNGS_MODULUS,POISSON,DENSITY",
                               place_of(model, e), e.id));
    }
    if (fe_is_shell(e.shape) && !(e.thickness > 0.0))
      thickness.add(fmt::format("{}: shell element {} has no thickness: give {}--thickness", place_of(model, e), e.id,
                                is_inp(model)             ? "a *SHELL SECTION, or "
                                : model.materials.empty() ? ""
                                                          : "T of its PSHELL, or "));
  }
  std::vector<std::string> faults;
  for (const Lacking* l : {&material, &thickness})
    if (l->count > 0) faults.push_back(l->text());
  for (size_t i = 0; i < used.size(); ++i)
    if (used[i]) check_material(model, model.materials[i], spread[i], faults);
  if (!faults.empty()) throw InputError(fmt::format("{}", fmt::join(faults, "\n")));
}

std::vector<std::string> doubled_solids(const FeModel& model) {
  std::vector<std::pair<std::array<int, 4>, int>> corners;  // four nodes tell solids apart that a mesh can have
  for (size_t k = 0; k < model.elements.size(); ++k) {
    const FeElement& e = model.elements[k];
    if (!fe_is_solid(e.shape)) continue;
    std::vector<int> nodes(model.connectivity.begin() + e.first, model.connectivity.begin() + e.first + e.count);
    std::sort(nodes.begin(), nodes.end());
    corners.push_back({{nodes[0], nodes[1], nodes[2], nodes.back()}, static_cast<int>(k)});
  }
  std::sort(corners.begin(), corners.end());
  const auto nodes_of = [&](int k) {
    const FeElement& e = model.elements[k];
    return std::set<int>(model.connectivity.begin() + e.first, model.connectivity.begin() + e.first + e.count);
  };
  int count = 0, first = -1, second = -1;
  for (size_t k = 1; k < corners.size(); ++k) {
    if (corners[k].first != corners[k - 1].first || nodes_of(corners[k].second) != nodes_of(corners[k - 1].second)) continue;
    if (count++ == 0) first = corners[k - 1].second, second = corners[k].second;
  }
  if (count == 0) return {};
  return {
      fmt::format("{}: {} solids lie on the same nodes as others (element {} on those of element {}): their mass and stiffness count "
                  "twice; take them out if they were written twice",
                  model.file, count, model.elements[second].id, model.elements[first].id)};
}

void warn_of_loose_cells(FeModel& model, const std::vector<std::vector<int>>& others) {
  std::vector<bool> used(model.nodes.size(), false);
  for (const int n : model.connectivity) used[n] = true;
  const auto loose = std::count_if(others.begin(), others.end(), [&](const std::vector<int>& nodes) {
    return std::any_of(nodes.begin(), nodes.end(), [&](int n) { return !used[n]; });
  });
  if (loose == 0) return;
  const bool solids = fe_is_solid(model.elements.front().shape);
  model.warnings.push_back(
      fmt::format("{}: {} {} are left out, which are no border of the {}: elements are made of the cells of most dimensions only; a deck "
                  "(.inp, .bdf) can have both",
                  model.file, loose, solids ? "surface and line cells" : "line cells", solids ? "solids" : "shells"));
}

std::vector<std::vector<int>> outer_faces(const FeModel& model) {
  struct Key {
    std::array<int, 4> nodes;
    bool operator==(const Key&) const = default;
  };
  struct Hash {
    size_t operator()(const Key& k) const {
      size_t h = 1469598103934665603ULL;
      for (int n : k.nodes) h = (h ^ n) * 1099511628211ULL;
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
