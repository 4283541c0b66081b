// Lines of nodes, elements, sets and instances of an input file, and what generates them.
#include "sim/reduce/fe_inp_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace flexframe::sim {

void InpTableReader::read_node() {
  if (f.empty()) return;
  const int id = integer(f[0], "node number");
  Vec3 x = Vec3::Zero();
  for (size_t i = 1; i < f.size() && i < 4; ++i) x(static_cast<Eigen::Index>(i) - 1) = f[i].empty() ? 0.0 : real(f[i], "coordinate");
  if (up("SYSTEM") == "C") {
    const double angle = x.y() * std::numbers::pi / 180.0;
    x = Vec3(x.x() * std::cos(angle), x.x() * std::sin(angle), x.z());
  }
  x = system_origin + system_axes * x * units.length;
  for (size_t i = 4; i < f.size(); ++i)
    if (!f[i].empty() && real(f[i], "normal") != 0.0)
      warn_once("*NODE with normals",
                "*NODE: numbers behind the coordinates, in Abaqus normals of shells and beams, are passed over: each element has its own");
  const auto [place, fresh] = s().node_at.try_emplace(id, static_cast<int>(s().nodes.size()));
  if (!fresh) {
    if ((s().nodes[place->second] - x).norm() > 0.0) fail(fmt::format("node {} is defined twice, at two places", id));
  } else {
    s().node_ids.push_back(id);
    s().nodes.push_back(x);
  }
  if (const std::string set = up("NSET"); !set.empty()) add_member(s().node_sets[set], id);
}

void InpTableReader::add_member(InpSet& set, int id) {
  if (set.empty() || !set.back().instance.empty()) set.emplace_back();
  set.back().ids.push_back(id);
}

void InpTableReader::read_element() {
  if (refused_type) {
    // Sets and sections that name it find it; a line that goes on gives a number too many.
    if (f.empty() || !inp_is_integer(f[0]) || f[0].size() > 9) return;
    pending = {integer(f[0], "element")};
    if (s().element_at.contains(pending[0])) return pending.clear();
  } else
    for (std::string_view part : f)
      if (!part.empty()) pending.push_back(integer(part, "element"));
  const size_t wants = type->nodes + 1;
  if (pending.size() < wants) {
    // The next line goes on where this one ends with a comma, or has sixteen numbers, as many as a line may hold.
    if (!line.ends_with(',') && f.size() < 15) {
      const std::string text = fmt::format("element {} has {} nodes, {} are expected", pending.empty() ? 0 : pending[0],
                                           pending.empty() ? 0 : pending.size() - 1, wants - 1);
      pending.clear();
      fail(text);
    }
    return;
  }
  InpElement e;
  if (type->kind == InpKind::beam && pending.size() == wants + 1) e.direction = pending.back();
  else if (pending.size() > wants) note(fmt::format("numbers beyond the {} nodes of a {} are passed over", wants - 1, type->name));
  e.id = pending[0];
  e.type = type;
  e.first = static_cast<int>(s().connectivity.size());
  e.place = at;
  if (!s().element_at.try_emplace(e.id, static_cast<int>(s().elements.size())).second) {
    pending.clear();
    fail(fmt::format("element {} is defined twice", e.id));
  }
  s().connectivity.insert(s().connectivity.end(), pending.begin() + 1, pending.begin() + static_cast<long>(wants));
  s().elements.push_back(e);
  if (const std::string set = up("ELSET"); !set.empty()) add_member(s().element_sets[set], e.id);
  pending.clear();
}

void InpTableReader::read_set(InpSet& set, const std::unordered_map<int, int>& there) {
  InpMembers members;
  members.instance = up("INSTANCE");
  if (k.has("GENERATE")) {
    if (f.size() < 2) fail("GENERATE: 'first, last, step' is expected");
    const int first = integer(f[0], "first"), last = integer(f[1], "last"), by = f.size() > 2 && !f[2].empty() ? integer(f[2], "step") : 1;
    if (by <= 0 || last < first) fail(fmt::format("GENERATE: {} to {} by {} is no range", first, last, by));
    const std::unordered_map<int, int>* index = &there;
    for (const InpInstance& i : deck.instances)
      if (i.name == members.instance) index = &there == &s().node_at ? &deck.scopes[i.scope].node_at : &deck.scopes[i.scope].element_at;
    members.ranges.push_back({first, last, by});
    // Only numbers that exist are stored: a range may be larger than the model.
    if ((static_cast<long>(last) - first) / by > 4L * static_cast<long>(index->size()) + 16) {
      for (const auto& [id, i] : *index)
        if (id >= first && id <= last && (id - first) % by == 0) members.ids.push_back(id);
    } else {
      for (long id = first; id <= last; id += by)
        if (index->contains(static_cast<int>(id))) members.ids.push_back(static_cast<int>(id));
    }
  } else {
    for (std::string_view part : f) {
      if (part.empty()) continue;
      if (inp_is_integer(part)) members.ids.push_back(integer(part, "set member"));
      else members.names.push_back(inp_upper(part));
    }
  }
  set.push_back(std::move(members));
}

void InpTableReader::read_ngen() {
  if (f.size() < 2 || (k.has("LINE") && !up("LINE").empty()))
    return refuse("*NGEN: only nodes on a straight line, 'first, last, step', can be made");
  const int first = integer(f[0], "first"), last = integer(f[1], "last"), by = f.size() > 2 && !f[2].empty() ? integer(f[2], "step") : 1;
  const auto a = s().node_at.find(first), b = s().node_at.find(last);
  if (a == s().node_at.end() || b == s().node_at.end() || by <= 0 || last <= first || (last - first) / by > 10000000)
    fail(fmt::format("*NGEN: {} to {} by {}: both ends must be there, and the step lead from one to the other", first, last, by));
  const Vec3 from = s().nodes[a->second], to = s().nodes[b->second];
  for (long id = first; id <= last; id += by)
    make_node(static_cast<int>(id), from + (to - from) * (static_cast<double>(id - first) / static_cast<double>(last - first)));
}

void InpTableReader::make_node(int id, const Vec3& x) {
  if (s().node_at.try_emplace(id, static_cast<int>(s().nodes.size())).second) {
    s().node_ids.push_back(id);
    s().nodes.push_back(x);
  }
  if (const std::string set = up("NSET"); !set.empty()) add_member(s().node_sets[set], id);
}

std::vector<int> InpTableReader::bounding_nodes(std::string_view name) {
  const auto found = s().node_sets.find(inp_upper(name));
  if (found == s().node_sets.end()) fail(fmt::format("*NFILL: node set '{}' is not there", name));
  std::set<int> ids;
  for (const InpMembers& members : found->second) {
    if (!members.names.empty()) fail(fmt::format("*NFILL: node set '{}' must hold numbers, not other sets", name));
    ids.insert(members.ids.begin(), members.ids.end());
  }
  return {ids.begin(), ids.end()};
}

void InpTableReader::read_nfill() {
  if (k.has("BIAS") || k.has("SINGULAR") || k.has("TWOSTEP") || f.size() < 3)
    return refuse("*NFILL: only nodes at equal distances, 'set, set, intervals, step', can be made");
  const std::vector<int> from = bounding_nodes(f[0]), to = bounding_nodes(f[1]);
  const int intervals = integer(f[2], "number of intervals"), by = f.size() > 3 && !f[3].empty() ? integer(f[3], "step") : 1;
  if (from.size() != to.size() || from.empty() || intervals < 1 || intervals > 1000000 || by <= 0)
    fail(fmt::format("*NFILL: the sets have {} and {} nodes, {} intervals by {}: as many nodes in both, and positive numbers, are wanted",
                     from.size(), to.size(), intervals, by));
  for (size_t i = 0; i < from.size(); ++i) {
    const auto a = s().node_at.find(from[i]), b = s().node_at.find(to[i]);
    if (a == s().node_at.end() || b == s().node_at.end()) fail(fmt::format("*NFILL: node {} or {} is not there", from[i], to[i]));
    const Vec3 start = s().nodes[a->second], end = s().nodes[b->second];
    for (int j = 0; j <= intervals; ++j) {
      if ((j == 0 || j == intervals) && up("NSET").empty()) continue;
      const long id = from[i] + static_cast<long>(j) * by;
      if (id > std::numeric_limits<int>::max()) fail(fmt::format("*NFILL: node number {} is too large", id));
      if (j == intervals && id != to[i]) {
        add_member(s().node_sets[up("NSET")], to[i]);
        continue;
      }
      make_node(static_cast<int>(id), start + (end - start) * (static_cast<double>(j) / intervals));
    }
  }
}

void InpTableReader::read_elgen() {
  const auto master = s().element_at.find(integer(f.empty() ? "" : f[0], "element number"));
  if (master == s().element_at.end()) fail(fmt::format("*ELGEN: element {} is not there", f[0]));
  long count[3] = {1, 1, 1}, node_step[3] = {1, 0, 0}, element_step[3] = {1, 0, 0};
  for (size_t d = 0; d < 3; ++d) {
    const auto number = [&](size_t i, long otherwise) -> long {
      return f.size() > i && !f[i].empty() ? integer(f[i], "number") : otherwise;
    };
    count[d] = number(1 + 3 * d, 1);
    node_step[d] = number(2 + 3 * d, 1);
    element_step[d] = number(3 + 3 * d, 1);
    if (count[d] < 1 || count[d] > 10000000) fail(fmt::format("*ELGEN: a number of elements is expected, found {}", count[d]));
  }
  if (count[0] * count[1] * count[2] > 50000000)
    fail(fmt::format("*ELGEN: {} x {} x {} elements are too many", count[0], count[1], count[2]));
  const InpElement first = s().elements[master->second];
  const std::string set = up("ELSET");
  bool listed = false;
  if (const auto there = s().element_sets.find(set); there != s().element_sets.end())
    for (const InpMembers& members : there->second)
      listed = listed || std::find(members.ids.begin(), members.ids.end(), first.id) != members.ids.end();
  for (long c = 0; c < count[2]; ++c)
    for (long b = 0; b < count[1]; ++b)
      for (long a = 0; a < count[0]; ++a) {
        const long id = first.id + a * element_step[0] + b * element_step[1] + c * element_step[2];
        if (a + b + c > 0) copy_element(first, id, a * node_step[0] + b * node_step[1] + c * node_step[2]);
        if (a + b + c > 0 || !listed) {
          if (!set.empty()) add_member(s().element_sets[set], static_cast<int>(id));
        }
      }
}

void InpTableReader::copy_element(const InpElement& from, long id, long shift) {
  InpElement e = from;
  e.id = static_cast<int>(id);
  e.first = static_cast<int>(s().connectivity.size());
  e.place = at;
  if (id < 1 || id > std::numeric_limits<int>::max() || !s().element_at.try_emplace(e.id, static_cast<int>(s().elements.size())).second)
    fail(fmt::format("*ELGEN: element {} is there already, or has no number that an element may have", id));
  for (int i = 0; i < from.type->nodes; ++i) {
    const long node = s().connectivity[from.first + i] + shift;
    if (node < 1 || node > std::numeric_limits<int>::max()) fail(fmt::format("*ELGEN: element {} needs node {}", id, node));
    s().connectivity.push_back(static_cast<int>(node));
  }
  if (e.direction > 0) e.direction += static_cast<int>(shift);
  s().elements.push_back(e);
}

void InpTableReader::read_system() {
  for (std::string_view part : f) system_points.push_back((part.empty() ? 0.0 : real(part, "coordinate")) * units.length);
  std::vector<double> p = system_points;
  p.resize(9, 0.0);
  const Vec3 a(p[0], p[1], p[2]), b(p[3], p[4], p[5]), c(p[6], p[7], p[8]);
  system_origin = a;
  if (system_points.size() < 6) return;
  Vec3 x = (b - a), y;
  if (system_points.size() < 9) {
    // Two points: x in the global xy plane, z stays.
    x.z() = 0.0;
    y = Vec3(-x.y(), x.x(), 0.0);
  } else {
    y = c - a;
  }
  if (!(x.norm() > 0.0) || !(x.cross(y).norm() > 1e-9 * x.norm() * y.norm())) fail("*SYSTEM: the points give no directions");
  system_axes.col(0) = x.normalized();
  system_axes.col(2) = x.cross(y).normalized();
  system_axes.col(1) = system_axes.col(2).cross(Vec3(system_axes.col(0)));
}

void InpTableReader::read_instance() {
  InpInstance& i = deck.instances.back();
  if (lines == 0) {
    i.shift = Vec3(value(0, "shift", 0), value(1, "shift", 0), value(2, "shift", 0)) * units.length;
  } else if (lines == 1) {
    if (f.size() < 7) fail("*INSTANCE: two points of the axis and an angle, seven numbers, are expected");
    const Vec3 a = Vec3(value(0, "point", 0), value(1, "point", 0), value(2, "point", 0)) * units.length,
               b = Vec3(value(3, "point", 0), value(4, "point", 0), value(5, "point", 0)) * units.length;
    if (!((b - a).norm() > 0.0)) fail("*INSTANCE: the two points give no axis");
    // Shifted first, then turned about the line through both points.
    i.turn = turned_about(b - a, value(6, "angle", 0));
    i.shift = i.turn * (i.shift - a) + a;
  }
}

}  // namespace flexframe::sim
