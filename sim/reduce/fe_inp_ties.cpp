// Ties, rigid bodies, equations and supports of an input file.
#include "sim/reduce/fe_inp_resolver.h"
#include "sim/reduce/fe_tie.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace flexframe::sim {

void InpResolver::add_transform(int space, const InpTransform& t) {
  const InpSpace& s = spaces[space];
  for (int node : nodes_named(space, t.set, t.place)) {
    Mat3 axes;
    if (!t.axes.at(s.turn.transpose() * (model.nodes[node] - s.shift), axes))
      fail(t.place, fmt::format("*TRANSFORM has no direction at node {}, which lies on its axis", model.node_ids[node]));
    transformed[node] = s.turn * axes;
  }
}

void InpResolver::mark_turning() {
  turning.assign(model.nodes.size(), false);
  for (const FeElement& e : model.elements) {
    const bool turns = fe_is_shell(e.shape) || (e.shape == FeShape::beam2 && e.section >= 0 && model.beam_sections[e.section].turns()) ||
                       (e.shape == FeShape::lumped && e.section >= 0 && model.lumps[e.section].turns);
    for (int k = 0; k < e.count && turns; ++k) turning[model.connectivity[e.first + k]] = true;
  }
}

std::map<int, double> InpResolver::weights_of_surface(int space, const std::string& name, const InpPlace& place) {
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
    // An edge of a shell has a length.
    const double area = face_area(model, face), length = (model.nodes[face[1]] - model.nodes[face[0]]).norm();
    const double share = (area > 1e-9 * length * length ? area : length) / static_cast<double>(face.size());
    for (int node : face) out[node] += share;
  }
  return out;
}

void InpResolver::add_tie(int space, const InpTie& t) {
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
    const std::vector<int> reference = nodes_of(*set);
    if (reference.empty()) return;  // its element is told of
    spider.node = reference[0];
  } else {
    if (nodes.empty()) fail(t.place, fmt::format("'{}' ties no nodes to its reference point", t.name));
    spider.node = t.reference.empty() ? add_reference(nodes) : one_node(space, t.reference, t.place);
  }
  if (t.radius >= 0.0)
    std::erase_if(nodes, [&](const auto& entry) { return (model.nodes[entry.first] - model.nodes[spider.node]).norm() > t.radius; });
  nodes.erase(spider.node);
  if (nodes.empty()) fail(t.place, fmt::format("'{}' ties no nodes to its reference point", t.name));
  if (!t.rotation_node.empty()) rotation_nodes[one_node(space, t.rotation_node, t.place)] = spider.node;
  for (const auto& [node, weight] : nodes) {
    spider.slaves.push_back(node);
    if (t.averaging) spider.weights.push_back(weight);
  }
  if (t.averaging && std::all_of(spider.weights.begin(), spider.weights.end(), [&](double w) { return w == spider.weights[0]; }))
    spider.weights.clear();
  if (!t.averaging && partly(space, t, spider)) return;
  if (t.averaging && partial_mean(space, t, spider)) return;
  model.spiders.push_back(std::move(spider));
}

bool InpResolver::partial_mean(int space, const InpTie& t, const FeSpider& spider) {
  std::set<int> dofs;
  for (const auto& [first, last] : t.dofs)
    for (int d = first; d <= last; ++d) dofs.insert(d);
  // Abaqus releases rotations alone.
  if (deck.abaqus && !dofs.empty()) dofs.insert({0, 1, 2});
  if (dofs.empty() || dofs.size() == 6) return false;
  PartialMean mean{spider, {dofs.begin(), dofs.end()}};
  if (!t.orientation.empty()) {
    int whose = 0;
    const InpAxes* given = axes_named(space, t.orientation, t.place, whose);
    const InpSpace& s = spaces[whose];
    if (!given->at(s.turn.transpose() * (model.nodes[spider.node] - s.shift), mean.axes))
      fail(t.place, fmt::format("orientation '{}' has no direction at the reference point, which lies on its axis", t.orientation));
    mean.axes = (s.turn * mean.axes).eval();
  }
  partial_means.push_back(std::move(mean));
  return true;
}

int InpResolver::add_reference(const std::map<int, double>& nodes) {
  Vec3 middle = Vec3::Zero();
  for (const auto& [node, weight] : nodes) middle += model.nodes[node] / static_cast<double>(nodes.size());
  model.nodes.push_back(middle);
  model.node_ids.push_back(*std::max_element(model.node_ids.begin(), model.node_ids.end()) + 1);
  turning.push_back(false);
  return static_cast<int>(model.nodes.size()) - 1;
}

bool InpResolver::partly(int space, const InpTie& t, const FeSpider& spider) {
  std::set<int> dofs;
  for (const auto& [first, last] : t.dofs)
    for (int d = first; d <= last; ++d) dofs.insert(d);
  if (dofs.empty()) return false;
  const bool translations = dofs.contains(0) && dofs.contains(1) && dofs.contains(2),
             rotations = dofs.contains(3) && dofs.contains(4) && dofs.contains(5);
  const bool any_turning = std::any_of(spider.slaves.begin(), spider.slaves.end(), [&](int n) { return turning[n]; });
  if (translations && (rotations || !any_turning)) return false;
  int whose = 0;
  const InpAxes* given = t.orientation.empty() ? nullptr : axes_named(space, t.orientation, t.place, whose);
  if (given && given->cylindrical && !deck.abaqus)
    add_once(model.warnings,
             fmt::format("{}: *COUPLING in directions of a cylinder follows the reference point as a rigid body, as in Abaqus; CalculiX "
                         "takes the reference point's own motions for the radial, tangential and axial ones of all nodes",
                         deck.where(t.place)));
  for (int node : spider.slaves) {
    const Vec3 r = model.nodes[node] - model.nodes[spider.node];
    Mat3 axes = Mat3::Identity();
    if (given) {
      if (!given->at(spaces[whose].turn.transpose() * (model.nodes[node] - spaces[whose].shift), axes))
        fail(t.place,
             fmt::format("orientation '{}' has no direction at node {}, which lies on its axis", t.orientation, model.node_ids[node]));
      axes = (spaces[whose].turn * axes).eval();
    }
    for (int d : dofs) {
      if (d >= 3 && !turning[node]) continue;
      FeEquation e;
      e.line = t.place.line;
      const int base = d < 3 ? 0 : 3;
      // Along a: a . u = a . (u_m + theta x r) = a . u_m + (r x a) . theta; the largest part of the node's own motion first.
      const Vec3 along = axes.col(d % 3), arm = r.cross(along);
      Eigen::Index main = 0;
      along.cwiseAbs().maxCoeff(&main);
      for (int k = 0; k < 3; ++k)
        if (const int axis = (static_cast<int>(main) + k) % 3; along(axis) != 0.0) e.terms.push_back({node, base + axis, -along(axis)});
      for (int k = 0; k < 3; ++k)
        if (along(k) != 0.0) e.terms.push_back({spider.node, base + k, along(k)});
      for (int k = 0; k < 3 && d < 3; ++k)
        if (arm(k) != 0.0) e.terms.push_back({spider.node, 3 + k, arm(k)});
      model.equations.push_back(std::move(e));
    }
  }
  return true;
}

void InpResolver::add_surface_tie(int space, const InpTie& t) {
  const std::vector<std::vector<int>> master = faces_of(space, t.master, t.place, false);
  std::vector<int> slaves;
  for (const auto& [node, weight] : weights_of_surface(space, t.surface, t.place)) slaves.push_back(node);
  TieResult made = tie_nodes(model, slaves, master, t.tolerance, t.adjust);
  if (made.tied == 0)
    fail(t.place,
         fmt::format("*TIE: no node of '{}' lies on '{}'; the nearest is {:.3g} m away (POSITION TOLERANCE says how far it may be)",
                     t.surface, t.master, made.nearest));
  bool free_rotations = false;
  for (FeEquation& e : made.equations) {
    e.line = t.place.line;
    // Rotations of shells on shells follow likewise.
    const bool turns = turning[e.terms[0].node],
               all = std::all_of(e.terms.begin(), e.terms.end(), [&](const FeEquation::Term&term) { return turning[term.node]; });
    free_rotations = free_rotations || (turns && t.rotations && !all);
    if (t.rotations && all) {
      FeEquation turn = e;
      for (FeEquation::Term& term : turn.terms) term.dof += 3;
      model.equations.push_back(std::move(turn));
    }
    model.equations.push_back(std::move(e));
  }
  if (free_rotations)
    model.warnings.push_back(fmt::format(
        "{}: *TIE ties translations of '{}' to faces whose nodes have no rotations: the shells turn freely there, as on a hinge",
        deck.where(t.place), t.surface));
  if (made.left > 0)
    model.warnings.push_back(fmt::format("{}: *TIE: {} of {} nodes of '{}' are farther than {:.3g} m from '{}' and stay free",
                                         deck.where(t.place), made.left, made.left + made.tied, t.surface, made.tolerance, t.master));
  if (made.moved > 0.0)
    add_once(model.notes, fmt::format("{}: *TIE: nodes of '{}' are moved onto '{}' by up to {:.3g} m", deck.where(t.place), t.surface,
                                      t.master, made.moved));
}

// *MPC, PLANE and STRAIGHT: nodes that stay in the plane, or on the line, that they are in; linear about where they are. Within it they
// move freely. Which of them define it does not matter then: those farthest apart do.
void InpResolver::add_flat(const InpMpc& m, const std::vector<int>& nodes) {
  const bool line = m.type == "STRAIGHT";
  const auto place = [&](int node) { return Vec3(model.nodes[node]); };
  const auto farthest = [&](const auto& distance) {
    return *std::max_element(nodes.begin(), nodes.end(), [&](int i, int j) { return distance(i) < distance(j); });
  };
  const int a = nodes.front(), b = farthest([&](int i) { return (place(i) - place(a)).norm(); });
  const Vec3 along = place(b) - place(a);
  const double extent = along.norm();
  const auto beside = [&](int i) { return extent > 0.0 ? along.cross(place(i) - place(a)).norm() / extent : 0.0; };
  const int c = farthest(beside);
  constexpr double off = 1e-3;  // of the extent
  if (!(extent > 0.0) || (!line && !(beside(c) > off * extent)))
    fail(m.place, fmt::format("*MPC, {}: its nodes {}", m.type, line || !(extent > 0.0) ? "are at one place" : "are on a line"));
  const Vec3 normal = line ? Vec3(Vec3::Zero()) : Vec3(along.cross(place(c) - place(a)).normalized());
  add_once(model.notes,
           fmt::format("{}: *MPC, {}: its nodes stay on their {}, linear about where they are; CalculiX makes such nodes stand "
                       "still in a linear step (the same as *EQUATION agrees)",
                       deck.where(m.place), m.type, line ? "line" : "plane"));
  Eigen::Index main = 0;
  (line ? along : normal).cwiseAbs().maxCoeff(&main);
  for (int node : nodes) {
    if (node == a || node == b || (!line && node == c)) continue;
    const Vec3 r = place(node) - place(a);
    if ((line ? beside(node) : std::abs(r.dot(normal))) > off * extent)
      fail(m.place,
           fmt::format("*MPC, {}: node {} lies beside the {} of the others", m.type, model.node_ids[node], line ? "line" : "plane"));
    // Shares of the nodes that define it; the first is what is left to one.
    double s = r.dot(along) / (extent * extent), t = 0.0;
    if (!line) {
      const Vec3 second = place(c) - place(a), across = second - along * (second.dot(along) / (extent * extent));
      t = r.dot(across) / across.squaredNorm();
      s -= t * second.dot(along) / (extent * extent);
    }
    const std::array<std::pair<int, double>, 4> shares = {{{node, 1.0}, {a, s + t - 1.0}, {b, -s}, {c, -t}}};
    for (int d = 0; d < 3; ++d) {
      // Directions that stay zero: across the line, the axis with the largest part along it taken out; or the plane's normal once.
      if (line ? d == main : d > 0) continue;
      Vec3 zero = normal;
      if (line) {
        zero = Vec3::Unit(d);
        zero(main) = -along(d) / along(main);
      }
      FeEquation e;
      e.line = m.place.line;
      const int first = line ? d : static_cast<int>(main);
      for (const auto& [whose, share] : shares)
        for (int k = 0; k < 3; ++k)
          if (const int axis = (first + k) % 3; share != 0.0 && zero(axis) != 0.0) e.terms.push_back({whose, axis, share * zero(axis)});
      model.equations.push_back(std::move(e));
    }
  }
}

// *MPC, MEANROT: the mean turn of nodes about an axis through their middle is the first motion of the last node, whose coordinates are the
// axis; linear about where they are. That motion is the node's rotation about the axis here, so that it turns with the body.
void InpResolver::add_mean_rotation(const InpMpc& m, const std::vector<int>& nodes, int pilot) {
  Vec3 middle = Vec3::Zero();
  for (int n : nodes) middle += model.nodes[n] / static_cast<double>(nodes.size());
  const double length = model.nodes[pilot].norm();
  if (!(length > 0.0))
    fail(m.place, fmt::format("*MPC, MEANROT: the coordinates of node {} are the axis, and are zero", model.node_ids[pilot]));
  const Vec3 axis = model.nodes[pilot] / length;
  std::vector<Vec3> shares;  // the turn is their sum over the nodes, each times its displacement
  Vec3 mean = Vec3::Zero();
  for (int n : nodes) {
    const Vec3 r = model.nodes[n] - middle, across = r - axis.dot(r) * axis;
    if (!(across.norm() > 1e-9 * r.norm()))
      fail(m.place, fmt::format("*MPC, MEANROT: node {} lies on the axis through the middle of the others", model.node_ids[n]));
    shares.emplace_back(axis.cross(across) / (across.squaredNorm() * static_cast<double>(nodes.size())));
    mean += shares.back() / static_cast<double>(nodes.size());
  }
  FeEquation e;
  e.line = m.place.line;
  Eigen::Index main = 0;
  axis.cwiseAbs().maxCoeff(&main);
  for (int k = 0; k < 3; ++k)
    if (const int d = (static_cast<int>(main) + k) % 3; axis(d) != 0.0) e.terms.push_back({pilot, 3 + d, -axis(d)});
  for (size_t i = 0; i < nodes.size(); ++i)
    for (int d = 0; d < 3; ++d)
      if (const double share = shares[i](d) - mean(d); share != 0.0) e.terms.push_back({nodes[i], d, share});
  model.equations.push_back(std::move(e));
  pilots[pilot] = axis;
}

void InpResolver::add_mpc(int space, const InpMpc& m) {
  std::vector<std::vector<int>> lists;
  for (const std::string& where : m.nodes) lists.push_back(nodes_named(space, where, m.place));
  if (m.type == "MEANROT") {
    // Each node is there three times, once for each motion.
    std::vector<int> nodes;
    for (size_t k = 0; k + 1 < lists.size(); ++k)
      for (int node : lists[k])
        if (std::find(nodes.begin(), nodes.end(), node) == nodes.end()) nodes.push_back(node);
    if (nodes.size() < 2 || lists.back().size() != 1)
      fail(m.place, "*MPC, MEANROT: nodes and the one whose motion is their turn are expected");
    return add_mean_rotation(m, nodes, lists.back()[0]);
  }
  if (m.type == "PLANE" || m.type == "STRAIGHT") {
    std::vector<int> all;
    for (const auto& list : lists)
      for (int node : list)
        if (std::find(all.begin(), all.end(), node) == all.end()) all.push_back(node);
    if (all.empty()) fail(m.place, fmt::format("*MPC, {}: nodes are expected", m.type));
    return add_flat(m, all);
  }
  if (lists.size() < 2) fail(m.place, fmt::format("*MPC, {}: two nodes are expected", m.type));
  const size_t pairs = lists[0].size();
  if (lists[1].size() != pairs && lists[1].size() != 1) fail(m.place, fmt::format("*MPC, {}: both sets must have as many nodes", m.type));
  for (size_t k = 0; k < pairs; ++k) {
    const int slave = lists[0][k], master = lists[1].size() == 1 ? lists[1][0] : lists[1][k];
    if (slave == master) continue;
    if (m.type == "BEAM") {
      if (!turning[slave] && !turning[master])
        add_once(model.warnings,
                 fmt::format("{}: *MPC, BEAM between nodes {} and {}, which have no rotations (solids alone): they keep their distance and "
                             "nothing else; CalculiX holds them otherwise: tie more nodes by *RIGID BODY or *COUPLING",
                             deck.where(m.place), model.node_ids[slave], model.node_ids[master]));
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
    const bool rotations = m.type == "TIE" && turning[slave] && turning[master];
    for (int d = 0; d < (rotations ? 6 : 3); ++d) model.equations.push_back({{{slave, d, 1.0}, {master, d, -1.0}}, m.place.line});
  }
}

void InpResolver::add_term(int node, int dof, double coefficient, FeEquation& out) const {
  if (const auto it = pilots.find(node); it != pilots.end()) {
    for (int d = 0; d < 3 && dof == 0; ++d)
      if (it->second(d) != 0.0) out.terms.push_back({node, 3 + d, coefficient * it->second(d)});
    return;
  }
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

void InpResolver::add_equation(int space, const InpEquation& given) {
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

void InpResolver::add_boundary(int space, const InpBoundary& b) {
  for (int node : nodes_named(space, b.where, b.place))
    for (int dof : b.dofs) {
      FeConstraint c;
      c.node = node;
      c.dof = dof;
      if (const auto pilot = pilots.find(node); pilot != pilots.end()) {
        if (dof > 0) continue;
        c.dof = 3;
        c.direction = pilot->second;
      } else if (const auto it = rotation_nodes.find(node); it != rotation_nodes.end()) {
        if (dof >= 3) continue;
        c.node = it->second;
        c.dof = 3 + dof;
      } else if (transformed.contains(node)) {
        c.direction = direction(node, dof);
      }
      model.constraints.push_back(c);
    }
}

}  // namespace flexframe::sim
