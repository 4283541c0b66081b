#include "sim/model/spanning_tree.h"

#include "sim/model/bodies.h"
#include "sim/model/groups.h"
#include "sim/model/joint_motion.h"
#include "sim/model/model_build.h"
#include "sim/model/state_functions.h"
#include "sim/scene/joint_kinds.h"
#include "sim/scene/motion_function.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

namespace flexframe::sim {
namespace {

std::string joint_where(const Scene& scene, const JointDef& j) {
  return fmt::format("{}:{}: joint '{}'", scene.file.string(), j.line, j.name);
}

// Closure rows of a joint kind about an axis in the parent frame: of every joint in space, those of plane loops are found redundant.
std::vector<ClosureRow> closure_rows(JointKind kind, const Vec3& axis, double length) {
  const ClosureFacts& facts = *traits(kind).closure;
  const JointAxes axes = joint_axes(axis);
  const auto named = [&](char letter) { return letter == 'x' ? axes.x : letter == 'y' ? axes.y : axes.z; };
  std::vector<ClosureRow> rows;
  for (char u : facts.places) rows.push_back({ClosureRow::translation, named(u), Vec3::Zero(), 0.0});
  for (std::size_t k = 0; k < facts.turns.size(); k += 2)
    rows.push_back({ClosureRow::angle, named(facts.turns[k]), named(facts.turns[k + 1]), 0.0});
  if (facts.distance) rows.push_back({ClosureRow::distance, Vec3::Zero(), Vec3::Zero(), length});
  return rows;
}

// An edge of the graph of parts.
struct Edge {
  int scene_joint = -1;        // -1: inner joint of a chain or free joint
  int a = ground, b = ground;  // parts
  int frame_a = 0, frame_b = 0;
  TreeJoint joint;
  int priority = 0;
};

// Joints whose coordinate somebody prescribes, drives or starts belong in the tree.
int tree_priority(const JointDef& j) {
  int p = 0;
  if (!j.motion.empty() || j.motion_table) p += 4;
  if (j.spring) p += 2;
  if (j.initial.guess) p += 1;  // it is heard only there
  return p;
}

// What a loop joint cannot carry: everything that needs the joint's own coordinates. A spring on a slide, a damper on a pin, and values of
// both, follow from the relative pose.
bool needs_coordinates(const Scene& scene, const JointDef& j) {
  const JointTraits& facts = traits(j.kind);
  if (facts.split) return facts.curve || j.spring || j.friction || j.stop;
  if (facts.rates.empty()) return false;
  if (!j.motion.empty() || j.motion_table || j.friction || j.stop || j.initial.value || j.initial.rate || !facts.closure) return true;
  for (const ForceDef& f : scene.forces)
    if (f.table && f.table_joint == j.name) return true;
  if (is_read(scene, j)) return true;
  for (const CouplingDef& c : scene.couplings)
    for (const CouplingTerm& term : c.terms)
      if (term.joint == j.name) return true;
  // A relative pose knows no whole turns, by which the spring of a pin may be wound.
  if (facts.read_off) return j.spring && j.spring->stiffness > 0.0 && !is_length(j.kind, 0);
  if (j.spring) return true;
  for (const OutputDef& o : scene.outputs)
    if (o.of.frame.empty() && o.of.body == j.name && (o.quantity == Quantity::value || o.quantity == Quantity::rate)) return true;
  return false;
}

// The graph of parts and the joints of it that make the spanning tree. Ground is node 0, part i node i + 1.
struct Graph {
  std::vector<Edge> edges;
  std::vector<char> in_tree;               // an edge each
  std::vector<std::vector<int>> adjacent;  // edges of the tree, a node each
  Groups connected;

  explicit Graph(std::vector<Edge> from, int parts)
      : edges(std::move(from)), in_tree(edges.size(), 0), adjacent(parts + 1), connected(parts + 1) {}
  bool joins(const Edge& e) { return connected.find(e.a + 1) != connected.find(e.b + 1); }
  void keep(size_t k) {
    in_tree[k] = 1;
    connected.join(edges[k].a + 1, edges[k].b + 1);
    for (int part : {edges[k].a, edges[k].b}) adjacent[part + 1].push_back(static_cast<int>(k));
  }
  void add(const Edge& e) {
    edges.push_back(e);
    in_tree.push_back(0);
  }
  void add_part() {
    connected.add();
    adjacent.emplace_back();
  }
};

// The expression or table that a joint follows, as an index of the model's; -1: none.
int add_motion(Model& model, const JointDef& j, const std::string& where) {
  const int index = static_cast<int>(model.expressions.size());
  if (!follows_motion(j)) return -1;
  if (j.motion_table) {
    model.expressions.push_back(motion_function(j));
    return index;
  }
  if (rate_count(j.kind) != 1)
    throw InputError(fmt::format("{}: 'motion' needs a joint with one coordinate ({})", where, joint_words(has_one_coordinate)));
  try {
    model.expressions.push_back(motion_function(j));
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: key 'motion': {}", where, error.what()));
  }
  return index;
}

Edge scene_edge(Model& model, const Scene& scene, int index) {
  const JointDef& j = scene.joints[index];
  const std::string where = joint_where(scene, j);
  Edge e;
  e.scene_joint = index;
  e.frame_a = add_frame(model, scene, j.parent, where);
  Pose offset;
  offset.R = rotation_exp(j.rotation);
  offset.p = j.position;
  model.frames[e.frame_a].offset = compose(model.frames[e.frame_a].offset, offset);
  e.frame_b = add_frame(model, scene, j.child, where);
  e.a = model.frames[e.frame_a].part;
  e.b = model.frames[e.frame_b].part;
  if (e.a == e.b) throw InputError(fmt::format("{}: parent '{}' and child '{}' are the same body", where, j.parent.body, j.child.body));
  TreeJoint& t = e.joint;
  t.name = j.name;
  t.scene_joint = index;
  t.kind = j.kind;
  t.axis = j.axis;
  t.pitch = j.pitch;
  t.curve = j.curve;
  t.spring = j.spring;
  t.friction = j.friction;
  t.stop = j.stop;
  t.motion = add_motion(model, j, where);
  e.priority = is_tree_kind(j.kind) ? tree_priority(j) + (needs_coordinates(scene, j) ? 4 : 0) : -1;
  return e;
}

// Parts of every body, the joints inside chains, those of the scene; what matters most in the tree first, else in the file's order.
std::vector<Edge> make_edges(Model& model, const Scene& scene) {
  std::vector<Edge> edges;
  for (const ChainJoint& inner : make_parts(model, scene)) {
    Edge e;
    e.a = model.frames[inner.frame_a].part;
    e.b = model.frames[inner.frame_b].part;
    e.frame_a = inner.frame_a;
    e.frame_b = inner.frame_b;
    e.joint = inner.joint;
    e.priority = 100;
    edges.push_back(e);
  }
  for (size_t k = 0; k < scene.joints.size(); ++k) edges.push_back(scene_edge(model, scene, static_cast<int>(k)));
  std::stable_sort(edges.begin(), edges.end(), [](const Edge& x, const Edge& y) { return x.priority > y.priority; });
  return edges;
}

bool is_point_mass(const Scene& scene, const FrameRef& frame) {
  for (const BodyDef& body : scene.bodies)
    if (const auto* rigid = std::get_if<RigidDef>(&body.kind); rigid && body.name == frame.body)
      return frame.frame.empty() && rigid->inertia.isZero(0.0) && rigid->centre_of_mass.isZero(0.0);
  return false;
}

// Whether a joint on the way through the tree between the ends of an edge has a guess.
bool is_guessed_around(const Scene& scene, const Graph& graph, const Edge& e) {
  std::vector<int> from(graph.adjacent.size(), -2), open{e.a + 1};  // the edge by which a node was reached
  from[open.front()] = -1;
  for (size_t i = 0; i < open.size() && from[e.b + 1] == -2; ++i)
    for (const int k : graph.adjacent[open[i]]) {
      const Edge& way = graph.edges[k];
      const int next = way.a + 1 == open[i] ? way.b + 1 : way.a + 1;
      if (from[next] == -2) from[next] = k, open.push_back(next);
    }
  for (int node = e.b + 1; from[node] >= 0;) {
    const Edge& way = graph.edges[from[node]];
    if (way.scene_joint >= 0 && scene.joints[way.scene_joint].initial.guess) return true;
    node = way.a + 1 == node ? way.b + 1 : way.a + 1;
  }
  return false;
}

// A joint that would close a loop and needs coordinates stands in the tree all the same: it carries a massless link, and the link's weld
// to the child closes the loop.
void add_links(Model& model, const Scene& scene, Graph& graph) {
  for (size_t k = 0, given = graph.edges.size(); k < given; ++k) {
    Edge& e = graph.edges[k];
    if (graph.in_tree[k]) continue;
    // The only guess of a loop chooses the way to close it: it has to be heard.
    const JointDef& j = scene.joints[e.scene_joint];
    if (!needs_coordinates(scene, j) && !(j.initial.guess && traits(j.kind).closure && !is_guessed_around(scene, graph, e))) continue;
    Part link;
    link.name = e.joint.name;
    const int at = static_cast<int>(model.parts.size());
    model.parts.push_back(link);
    const int frame = add_own_frame(model, at, link.name);
    Edge weld;
    weld.a = at;
    weld.frame_a = frame;
    weld.b = e.b;
    weld.frame_b = e.frame_b;
    weld.joint.name = link.name;
    weld.joint.kind = JointKind::weld;
    const JointTraits& facts = traits(e.joint.kind);
    // What acts along a line acts on a slide, which carries the point.
    if (const auto& split = facts.split) std::tie(e.joint.kind, weld.joint.kind) = *split;
    e.b = at;
    e.frame_b = frame;
    if (!facts.curve)
      model.notes.tell(fmt::format("joint '{}'", link.name),
                       fmt::format("closes a loop and keeps its coordinate: an auxiliary massless link was inserted between it and '{}'",
                                   scene.joints[e.scene_joint].child.body));
    graph.add_part();
    graph.keep(k);
    graph.add(weld);
    // A bead on a wire closes no loop: it hangs on the link; a mere point mass has no use for turns.
    if (facts.curve && graph.joins(weld)) {
      if (is_point_mass(scene, scene.joints[graph.edges[k].scene_joint].child)) graph.edges.back().joint.kind = JointKind::weld;
      graph.keep(graph.edges.size() - 1);
    }
  }
}

// What nothing joins to ground flies.
void free_the_rest(Model& model, Graph& graph) {
  for (size_t i = 0; i < model.parts.size(); ++i) {
    Edge e;
    e.b = static_cast<int>(i);
    if (!graph.joins(e)) continue;
    const std::string& name = model.parts[i].name;
    e.joint.kind = JointKind::free;
    e.joint.name = name + " (free)";
    e.frame_a = add_own_frame(model, ground, "ground");
    e.frame_b = add_own_frame(model, e.b, name);
    graph.add(e);
    graph.keep(graph.edges.size() - 1);
    model.notes.tell(fmt::format("body '{}'", name),
                     "is not joined to ground: it moves freely, and begins at the world's origin and at rest, where its joints do "
                     "not say else; a joint of kind \"free\" gives it another place, turn and rates");
  }
}

// Directs the tree away from ground: joints and parents of all parts. Returns the parts, parents first.
std::vector<int> orient(Model& model, const Graph& graph) {
  std::vector<int> order, queue{ground};
  std::vector<char> seen(model.parts.size() + 1, 0);
  seen[0] = 1;
  for (size_t at = 0; at < queue.size(); ++at) {
    for (int k : graph.adjacent[queue[at] + 1]) {
      const Edge& e = graph.edges[k];
      const bool forward = e.a == queue[at];
      const int child = forward ? e.b : e.a;
      if (seen[child + 1]) continue;
      seen[child + 1] = 1;
      Part& part = model.parts[child];
      part.joint = e.joint;
      part.parent = queue[at];
      part.joint.reversed = !forward;
      part.joint.inboard = forward ? e.frame_a : e.frame_b;
      part.joint.outboard = forward ? e.frame_b : e.frame_a;
      if (part.joint.motion < 0) {
        part.joint.nq = position_count(part.joint.kind);
        part.joint.nv = rate_count(part.joint.kind);
      }
      order.push_back(child);
      queue.push_back(child);
    }
  }
  return order;
}

// Joints that are not in the tree close loops.
std::vector<LoopJoint> cut_loops(const Scene& scene, const Graph& graph) {
  std::vector<LoopJoint> loops;
  for (size_t k = 0; k < graph.edges.size(); ++k) {
    if (graph.in_tree[k]) continue;
    const Edge& e = graph.edges[k];
    LoopJoint loop;
    loop.name = e.joint.name;
    loop.scene_joint = e.scene_joint;
    loop.kind = e.joint.kind;
    loop.a = e.frame_a;
    loop.b = e.frame_b;
    loop.axis = e.joint.axis;
    loop.rows = closure_rows(loop.kind, loop.axis, e.scene_joint >= 0 ? scene.joints[e.scene_joint].length : 0.0);
    loop.spring = e.joint.spring;
    loops.push_back(loop);
  }
  return loops;
}

}  // namespace

SpanningTree make_spanning_tree(Model& model, const Scene& scene) {
  std::vector<Edge> edges = make_edges(model, scene);
  Graph graph(std::move(edges), static_cast<int>(model.parts.size()));
  for (size_t k = 0; k < graph.edges.size(); ++k)
    if (graph.edges[k].priority >= 0 && graph.joins(graph.edges[k])) graph.keep(k);
  add_links(model, scene, graph);
  free_the_rest(model, graph);
  return {orient(model, graph), cut_loops(scene, graph)};
}

}  // namespace flexframe::sim
