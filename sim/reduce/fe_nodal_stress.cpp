// Stress at nodes. See fe_nodal_stress.h.
#include "sim/reduce/fe_nodal_stress.h"

#include "sim/reduce/fe_elements.h"
#include "sim/reduce/fe_integrals.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

namespace flexframe::sim {
namespace {

// Shells that meet at a smaller angle than 20 degrees are one plate.
constexpr double smooth = 0.93969262078590838405;

// Elements around a node that share a stress: solids, or the shells of a plate.
struct StressPart {
  const FeElement* first = nullptr;
  Vec3 normal = Vec3::Zero();  // of the first element, where it is a shell
  MatX face, other_face;       // sums; of solids the first alone
  int count = 0;
};

// Layers alike; their axes change from element to element of one curved plate.
bool same_layers(const FeLayup& a, const FeLayup& b) {
  return a.offset == b.offset && a.bending == b.bending && a.bending_material == b.bending_material && a.lower_face == b.lower_face &&
         a.upper_face == b.upper_face &&
         std::equal(a.layers.begin(), a.layers.end(), b.layers.begin(), b.layers.end(), [](const FeLayer& x, const FeLayer& y) {
           return x.material == y.material && x.thickness == y.thickness && x.angle == y.angle;
         });
}

bool same_plate(const FeModel& model, const FeElement& a, const FeElement& b) {
  constexpr double step = 0.05;  // of the thickness; less is a taper, whose elements have their means
  if (a.material != b.material || std::abs(a.thickness - b.thickness) > step * a.thickness) return false;
  return a.section == b.section || (a.section >= 0 && b.section >= 0 && same_layers(model.layups[a.section], model.layups[b.section]));
}

// The part that an element belongs to at a node, a new one where there is none.
StressPart& part_of(const FeModel& model, std::vector<StressPart>& parts, const FeElement& e, const Vec3& normal) {
  const bool shell = fe_is_shell(e.shape);
  for (StressPart& p : parts) {
    if (fe_is_shell(p.first->shape) != shell) continue;
    if (!shell || (same_plate(model, *p.first, e) && std::abs(p.normal.dot(normal)) > smooth)) return p;
  }
  // Solids come first.
  StressPart& made = *parts.insert(shell ? parts.end() : parts.begin(), StressPart());
  made.first = &e;
  made.normal = normal;
  return made;
}

void add_rows(const MatX& stress, Eigen::Index place, MatX& sum) {
  const auto rows = stress.middleRows(6 * place, 6);
  if (sum.size() == 0) sum = rows;
  else sum += rows;
}

// The normal of a shell at each of its nodes.
Mat3X normals_of(const FeModel& model, const FeElement& e) {
  Mat3X X(3, e.count);
  for (int k = 0; k < e.count; ++k) X.col(k) = model.nodes[model.connectivity[e.first + k]];
  if (e.shape == FeShape::triangle6 || e.shape == FeShape::quadrangle8) return curved_shell_normals(e.shape, X, e.id);
  double area = 0.0;
  return Vec3(shell_axes(e.shape, X, e.id, area).col(2)).replicate(1, e.count);
}

}  // namespace

std::vector<std::vector<MatX>> stresses_at_nodes(const FeModel& model, const FeSystem& system, const MatX& U,
                                                 const std::vector<int>& nodes) {
  std::unordered_map<int, size_t> place;
  for (size_t i = 0; i < nodes.size(); ++i) place.emplace(nodes[i], i);
  std::vector<std::vector<StressPart>> parts(nodes.size());
  for (const FeElement& e : model.elements) {
    const bool shell = fe_is_shell(e.shape);
    if (!shell && !fe_is_solid(e.shape)) continue;
    bool wanted = false;
    for (int i = 0; i < e.count; ++i) wanted = wanted || place.contains(model.connectivity[e.first + i]);
    if (!wanted) continue;
    const MatX face = element_stress(model, system, e, U), other = shell ? element_stress(model, system, e, U, true) : MatX();
    const Mat3X normals = shell ? normals_of(model, e) : Mat3X::Zero(3, e.count);
    for (Eigen::Index i = 0; i < e.count; ++i) {
      const auto it = place.find(model.connectivity[e.first + i]);
      if (it == place.end()) continue;
      StressPart& part = part_of(model, parts[it->second], e, normals.col(i));
      const bool turned = part.normal.dot(normals.col(i)) < 0.0;
      add_rows(turned ? other : face, i, part.face);
      if (shell) add_rows(turned ? face : other, i, part.other_face);
      ++part.count;
    }
  }
  std::vector<std::vector<MatX>> out(nodes.size());
  for (size_t i = 0; i < nodes.size(); ++i)
    for (StressPart& part : parts[i])
      for (MatX* sum : {&part.face, &part.other_face}) {
        if (sum->size() == 0) continue;
        *sum /= part.count;
        out[i].push_back(std::move(*sum));
      }
  return out;
}

std::vector<MatX> nodal_stress(const FeModel& model, const FeSystem& system, const MatX& U, const std::vector<int>& nodes) {
  std::vector<MatX> out;
  for (std::vector<MatX>& there : stresses_at_nodes(model, system, U, nodes))
    out.push_back(there.empty() ? MatX(6, 0) : std::move(there.front()));
  return out;
}

}  // namespace flexframe::sim
