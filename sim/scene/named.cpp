#include "sim/scene/named.h"

#include <string>
#include <unordered_map>
#include <vector>

namespace flexframe::sim {
namespace {

struct Hash {
  using is_transparent = void;
  size_t operator()(std::string_view name) const { return std::hash<std::string_view>{}(name); }
};
using Numbers = std::unordered_map<std::string, size_t, Hash, std::equal_to<>>;

// Fewer are looked through sooner than a table is asked.
constexpr size_t few = 16;

// known: of the list looked through last, which may be another or an older one. Names are there once, or a scene is refused.
template <class Def>
int number_of(const std::vector<Def>& list, std::string_view name, Numbers& known) {
  if (list.size() > few)
    if (const auto at = known.find(name); at != known.end() && at->second < list.size() && list[at->second].name == name)
      return static_cast<int>(at->second);
  size_t found = 0;
  while (found < list.size() && list[found].name != name) ++found;
  if (found == list.size()) return -1;
  if (list.size() > few) {
    known.clear();
    for (size_t k = 0; k < list.size(); ++k) known.emplace(list[k].name, k);
  }
  return static_cast<int>(found);
}

}  // namespace

int body_number(const Scene& scene, std::string_view name) {
  if (name == "ground") return -1;  // met as often as a body, and none
  static thread_local Numbers known;
  return number_of(scene.bodies, name, known);
}

int joint_number(const Scene& scene, std::string_view name) {
  static thread_local Numbers known;
  return number_of(scene.joints, name, known);
}

}  // namespace flexframe::sim
