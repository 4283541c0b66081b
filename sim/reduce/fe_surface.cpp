#include "sim/reduce/fe_surface.h"

#include <algorithm>
#include <set>

namespace flexframe::sim {

std::vector<std::vector<int>> whole_outer_faces(const FeModel& model) {
  std::set<std::vector<int>> outer;
  for (std::vector<int> face : outer_faces(model)) {
    std::sort(face.begin(), face.end());
    outer.insert(std::move(face));
  }
  std::vector<std::vector<int>> whole;
  for (const FeElement& e : model.elements)
    for (int k = 0; k < std::ssize(fe_faces(e.shape)); ++k) {
      std::vector<int> key;
      for (const int place : fe_faces(e.shape)[k]) key.push_back(model.connectivity[e.first + place]);
      std::sort(key.begin(), key.end());
      if (!outer.contains(key)) continue;
      if (!fe_is_shell(e.shape)) outer.erase(key);
      std::vector<int>& nodes = whole.emplace_back(fe_face_nodes(e.shape, k));
      for (int& node : nodes) node = model.connectivity[e.first + node];
    }
  return whole;
}

}  // namespace flexframe::sim
