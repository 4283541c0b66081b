#include "sim/model/model_build.h"

#include "sim/base/words.h"
#include "sim/model/bodies.h"
#include "sim/model/joint_motion.h"
#include "sim/model/state_functions.h"
#include "sim/scene/force_kinds.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <numeric>
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

// What a loop joint cannot carry: everything that needs the joint's own coordinates. A spring on an angle or a slide, and their values,
// follow from the relative pose.
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
  if (facts.read_off) return false;
  if (j.spring) return true;
  for (const OutputDef& o : scene.outputs)
    if (o.of.frame.empty() && o.of.body == j.name && (o.quantity == Quantity::value || o.quantity == Quantity::rate)) return true;
  return false;
}

// Sets of things that have come together: union-find.
class Groups {
 public:
  explicit Groups(int count) : of_(static_cast<size_t>(count)) { std::iota(of_.begin(), of_.end(), 0); }
  void add() { of_.push_back(static_cast<int>(of_.size())); }
  int find(int i) {
    while (of_[i] != i) i = of_[i] = of_[of_[i]];
    return i;
  }
  void join(int a, int b) { of_[find(a)] = find(b); }

 private:
  std::vector<int> of_;
};

// The graph of parts and the joints of it that make the spanning tree. Ground is node 0, part i node i + 1.
struct Graph {
  std::vector<Edge> edges;
  std::vector<char> in_tree;               // an edge each
  std::vector<std::vector<int>> adjacent;  // edges of the tree, a node each
  Groups connected;

  explicit Graph(std::vector<Edge> from, int parts)
      : edges(std::move(from)), in_tree(edges.size(), 0), adjacent(static_cast<size_t>(parts) + 1), connected(parts + 1) {}
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

int add_own_frame(Model& model, int part, const std::string& name) {
  model.frames.push_back(FramePoint{part, -1, {}, "", name});
  return static_cast<int>(model.frames.size()) - 1;
}

// The expression or table that a joint follows, as an index of the model's; -1: none.
int add_motion(Model& model, const JointDef& j, const std::string& where) {
  const int index = static_cast<int>(model.expressions.size());
  if (j.motion_table) {
    model.expressions.emplace_back(std::make_shared<const CubicTable>(j.motion_table->x, j.motion_table->y, j.motion_table->period));
    return index;
  }
  if (j.motion.empty()) return -1;
  if (rate_count(j.kind) != 1)
    throw InputError(fmt::format("{}: 'motion' needs a joint with one coordinate ({})", where, joint_words(has_one_coordinate)));
  try {
    model.expressions.emplace_back(Expression(j.motion));
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
    model.notes.tell(fmt::format("body '{}'", name), "is not joined to ground: it moves freely");
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

void add_loops(Model& model, const Scene& scene, const Graph& graph) {
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
    model.loops.push_back(loop);
  }
}

// What the scene's start makes of a coupling's coordinate.
double coordinate_at_start(const Model& model, const Scene& scene, const CouplingRow::Term& term) {
  const TreeJoint& joint = model.parts[term.part].joint;
  if (joint.motion >= 0) return model.expressions[joint.motion].value(0.0);
  const JointInitial& initial = scene.joints[joint.scene_joint].initial;
  const auto& given = initial.value ? initial.value : initial.guess;
  return given ? (*given)[term.rate] : 0.0;
}

// Rows by parts; factors such that the largest is one, of lengths where there are any.
void add_couplings(Model& model, const Scene& scene) {
  for (size_t i = 0; i < scene.couplings.size(); ++i) {
    const CouplingDef& def = scene.couplings[i];
    CouplingRow row;
    row.name = def.name;
    row.scene_coupling = static_cast<int>(i);
    double lengths = 0.0, angles = 0.0;
    for (const CouplingTerm& t : def.terms) {
      CouplingRow::Term term{-1, t.coordinate, t.factor, t.of};
      for (size_t k = 0; k < scene.joints.size(); ++k)
        if (scene.joints[k].name == t.joint) term.part = joint_part(model, static_cast<int>(k));
      if (term.part < 0)
        throw InputError(
            fmt::format("{}:{}: coupling '{}': joint '{}' has no coordinate", scene.file.string(), def.line, def.name, t.joint));
      double& largest = is_length(model.parts[term.part].joint.kind, t.coordinate) ? lengths : angles;
      largest = std::max(largest, std::abs(t.factor));
      if (!def.value) row.value += t.factor * coordinate_at_start(model, scene, term);
      row.terms.push_back(std::move(term));
    }
    const std::string where = fmt::format("{}:{}: coupling '{}'", scene.file.string(), def.line, def.name);
    for (const FrameRef& frame : def.through) row.frames.push_back(add_frame(model, scene, frame, where));
    if (!row.frames.empty()) lengths = 1.0;
    row.length = lengths > 0.0;
    const double scale = row.length ? lengths : angles;
    row.value = def.value.value_or(row.value) / scale;
    row.scale = scale;
    for (CouplingRow::Term& term : row.terms) term.factor /= scale;
    const auto moved = [&](const CouplingRow::Term& t) { return model.parts[t.part].joint.motion >= 0; };
    if (row.frames.empty() && std::all_of(row.terms.begin(), row.terms.end(), moved))
      throw InputError(fmt::format("{}: all its joints have a prescribed motion; leave one of them free", where));
    model.couplings.push_back(std::move(row));
  }
}

std::vector<int> path_to_ground(const Model& model, int part) {
  std::vector<int> path;
  for (int i = part; i != ground; i = model.parts[i].parent) path.push_back(i);
  return path;
}

// The parts on a loop. A flexible part at which its branches meet belongs to it.
std::vector<int> loop_members(const Model& model, const LoopJoint& loop) {
  std::vector<int> pa = path_to_ground(model, model.frames[loop.a].part), pb = path_to_ground(model, model.frames[loop.b].part);
  int meet = ground;
  while (!pa.empty() && !pb.empty() && pa.back() == pb.back()) {
    meet = pa.back();
    pa.pop_back();
    pb.pop_back();
  }
  pa.insert(pa.end(), pb.begin(), pb.end());
  if (meet != ground && (model.parts[meet].body.n > 0 || pa.empty())) pa.push_back(meet);
  if (pa.empty()) throw InputError(fmt::format("joint '{}' joins ground to ground", loop.name));
  return pa;
}

// The parts on the ways between the frames of a rope; with joints in its sum, all ways to ground.
std::vector<int> rope_members(const Model& model, const CouplingRow& rope, const std::vector<std::vector<int>>& joints) {
  std::vector<std::vector<int>> paths;
  for (const int frame : rope.frames) paths.push_back(path_to_ground(model, model.frames[frame].part));
  int meet = ground;
  const auto shared = [&]() {
    for (const auto& path : paths)
      if (path.empty() || path.back() != paths.front().back()) return false;
    return joints.empty();
  };
  while (shared()) {
    meet = paths.front().back();
    for (auto& path : paths) path.pop_back();
  }
  std::vector<int> members;
  paths.insert(paths.end(), joints.begin(), joints.end());
  for (const auto& path : paths) members.insert(members.end(), path.begin(), path.end());
  if (meet != ground && (model.parts[meet].body.n > 0 || members.empty())) members.push_back(meet);
  if (members.empty()) throw InputError(fmt::format("coupling '{}': its rope lies on the ground alone", rope.name));
  return members;
}

// The parts on the ways between the joints of a coupling, theirs included. A flexible part at which the ways meet belongs to them.
std::vector<int> coupled_members(const Model& model, const CouplingRow& coupling) {
  std::vector<std::vector<int>> paths;
  for (const CouplingRow::Term& term : coupling.terms) paths.push_back(path_to_ground(model, term.part));
  if (!coupling.frames.empty()) return rope_members(model, coupling, paths);
  int meet = ground;
  const auto shared = [&]() {
    // A part whose own joint is coupled is no mere carrier.
    for (const auto& path : paths)
      if (path.size() <= 1 || path.back() != paths.front().back()) return false;
    return true;
  };
  while (shared()) {
    meet = paths.front().back();
    for (auto& path : paths) path.pop_back();
  }
  std::vector<int> members;
  for (const auto& path : paths) members.insert(members.end(), path.begin(), path.end());
  if (meet != ground && model.parts[meet].body.n > 0) members.push_back(meet);
  return members;
}

// Clusters of the parts that share loops, carriers before what they carry; their parts in the given order. loops, coupled: one part of each
// loop and coupling.
std::vector<Cluster> make_clusters(const Model& model, const std::vector<int>& order, std::vector<int>& loops, std::vector<int>& coupled) {
  Groups together(static_cast<int>(model.parts.size()));
  for (const LoopJoint& loop : model.loops) {
    const std::vector<int> members = loop_members(model, loop);
    for (int i : members) together.join(i, members.front());
    loops.push_back(members.front());
  }
  for (const CouplingRow& coupling : model.couplings) {
    const std::vector<int> members = coupled_members(model, coupling);
    coupled.push_back(coupling.terms.empty() ? members.front() : coupling.terms.front().part);
    for (int i : members) together.join(i, coupled.back());
  }
  std::vector<Cluster> met;
  std::vector<int> of(model.parts.size(), -1);  // a group's representative -> index
  for (int i : order) {
    const int r = together.find(i);
    if (of[r] < 0) {
      of[r] = static_cast<int>(met.size());
      met.emplace_back();
    }
    met[of[r]].parts.push_back(i);
  }
  // A cluster is met before its carrier's only where the carrier is met later on a loop: carriers first.
  std::vector<Cluster> clusters;
  std::vector<char> done(met.size(), 0);
  const std::function<void(int)> place = [&](int k) {
    if (done[k]) return;
    done[k] = 1;
    for (int i : met[k].parts) {
      const int p = model.parts[i].parent;
      if (p != ground && of[together.find(p)] != k) place(of[together.find(p)]);
    }
    clusters.push_back(met[k]);
  };
  for (size_t k = 0; k < met.size(); ++k) place(static_cast<int>(k));
  return clusters;
}

// Parts in the order of their clusters; everything that points at them follows.
void renumber_parts(Model& model, const Scene& scene, const std::vector<int>& loops, const std::vector<int>& coupled) {
  std::vector<int> number(model.parts.size(), -1);
  std::vector<Part> parts;
  parts.reserve(model.parts.size());
  for (Cluster& c : model.clusters)
    for (int& i : c.parts) {
      const int before = i;
      i = number[before] = static_cast<int>(parts.size());
      parts.push_back(std::move(model.parts[before]));
      parts.back().cluster = static_cast<int>(&c - model.clusters.data());
    }
  model.parts = std::move(parts);
  for (Part& p : model.parts)
    if (p.parent != ground) p.parent = number[p.parent];
  for (FramePoint& f : model.frames)
    if (f.part != ground) f.part = number[f.part];
  for (Flexure& f : model.flexures)
    for (int& i : f.parts) i = number[i];
  for (CouplingRow& coupling : model.couplings)
    for (CouplingRow::Term& term : coupling.terms) term.part = number[term.part];
  for (size_t k = 0; k < model.couplings.size(); ++k)
    model.clusters[model.parts[number[coupled[k]]].cluster].couplings.push_back(static_cast<int>(k));
  for (size_t l = 0; l < loops.size(); ++l) model.clusters[model.parts[number[loops[l]]].cluster].loops.push_back(static_cast<int>(l));
  model.pieces.resize(scene.bodies.size());
  for (size_t i = 0; i < model.parts.size(); ++i) {
    if (model.parts[i].scene_body < 0) continue;
    std::vector<int>& pieces = model.pieces[model.parts[i].scene_body];
    pieces.resize(std::max(pieces.size(), static_cast<size_t>(model.parts[i].piece) + 1));
    pieces[model.parts[i].piece] = static_cast<int>(i);
  }
}

// Coordinates, carrier, entries, frames and size of a cluster.
void complete_cluster(Model& model, int k) {
  Cluster& c = model.clusters[k];
  c.q0 = model.nq;
  c.v0 = model.nv;
  Pose base;
  double reach = 0.0;
  for (int i : c.parts) {
    Part& p = model.parts[i];
    p.q0 = model.nq;
    p.v0 = model.nv;
    model.nq += p.joint.nq;
    model.nv += p.joint.nv;
    p.eq0 = model.nq;
    p.ev0 = model.nv;
    model.nq += p.body.n;
    model.nv += p.body.n;
    reach += part_size(model, i);
    if (p.parent != ground && model.parts[p.parent].cluster == k) continue;
    if (c.entry.empty()) {
      c.parent = p.parent;
      c.base = p.joint.inboard;
      base = rest_pose(model, p.joint.inboard);
      c.entry.push_back(Pose{});
    } else {
      c.entry.push_back(compose(inverse(base), rest_pose(model, p.joint.inboard)));
    }
  }
  c.nq = model.nq - c.q0;
  c.nv = model.nv - c.v0;
  c.size = reach > 0.0 ? reach : 1.0;
  const auto add_cluster_frame = [&](int f) {
    const int part = model.frames[f].part;
    if (part == ground || model.parts[part].cluster != k || model.parts[part].body.n == 0) return;
    if (std::find(c.frames.begin(), c.frames.end(), f) == c.frames.end()) c.frames.push_back(f);
  };
  for (int i : c.parts) {
    add_cluster_frame(model.parts[i].joint.outboard);
    add_cluster_frame(model.parts[i].joint.inboard);
  }
  for (int l : c.loops) {
    add_cluster_frame(model.loops[l].a);
    add_cluster_frame(model.loops[l].b);
  }
  for (const int coupling : c.couplings)
    for (const int f : model.couplings[coupling].frames) add_cluster_frame(f);
  model.size = std::max(k == 0 ? 0.0 : model.size, c.size);
}

// What a force's value follows: an expression or table of time, a table of a joint's coordinate, or an expression that reads the state.
void add_value(Model& model, const Scene& scene, const std::string& where, Load& load) {
  const ForceDef& def = load.def;
  if (!def.reads.empty()) {
    load.expression = static_cast<int>(model.expressions.size());
    model.expressions.emplace_back();
    load.function = add_function(model, scene, where, {def.value, def.reads, load.on, load.from, load.path});
    return;
  }
  load.expression = static_cast<int>(model.expressions.size());
  if (!def.table) {
    try {
      model.expressions.emplace_back(Expression(def.value));
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}: key 'value': {}", where, error.what()));
    }
    return;
  }
  const auto table = std::make_shared<const CubicTable>(def.table->x, def.table->y, def.table->period);
  if (def.table_joint.empty()) {
    model.expressions.emplace_back(table);
    return;
  }
  model.expressions.emplace_back();
  load.table = table;
  for (size_t k = 0; k < scene.joints.size(); ++k)
    if (scene.joints[k].name == def.table_joint) load.table_part = joint_part(model, static_cast<int>(k));
}

// A load along a chain acts on every part of it.
void spread_along_beam(Model& model, const Scene& scene, const std::string& where, Load load) {
  const ForceDef& def = load.def;
  const int body = model.frames[load.on].part == ground ? -1 : model.parts[model.frames[load.on].part].scene_body;
  if (body < 0 || !std::holds_alternative<BeamDef>(scene.bodies[body].kind))
    throw InputError(fmt::format("{}: a distributed load needs a beam, '{}' is none", where, def.on.body));
  for (size_t i = 0; i < model.parts.size(); ++i) {
    if (model.parts[i].scene_body != body) continue;
    load.on = load.from = add_own_frame(model, static_cast<int>(i), def.on.body);
    model.loads.push_back(load);
  }
}

// A cylinder with a width touches at both its ends.
void add_contact(Model& model, const ForceDef& def, Load& load) {
  load.contact = static_cast<int>(model.contacts.size());
  std::vector<int> sides{0};
  if (def.contact->cylinder && def.contact->width > 0.0) sides = {-1, 1};
  for (const int side : sides) {
    Contact contact{static_cast<int>(model.loads.size()), side, -1};
    if (def.contact->static_friction > 0.0) {
      contact.z0 = model.nz;
      model.nz += 3;
    }
    model.contacts.push_back(contact);
  }
}

// Blocks in an order in which each that passes its input on comes after what it reads.
void add_blocks(Model& model, const Scene& scene) {
  const auto waits_for = [&](const BlockDef& def) {
    std::vector<int> out;
    if (def.D.isZero(0.0) || def.sample > 0.0) return out;
    for (const auto& reads : def.reads)
      for (const Reading& r : reads)
        if (r.kind == Reading::block) out.push_back(r.index);
    return out;
  };
  std::vector<int> order;
  std::vector<char> state(scene.blocks.size(), 0);  // 1: being placed, 2: placed
  const std::function<void(int)> place = [&](int k) {
    const BlockDef& def = scene.blocks[k];
    if (state[k] == 2) return;
    if (state[k] == 1)
      throw InputError(
          fmt::format("{}:{}: [[block]] '{}': its output waits for itself (an algebraic loop): it passes its input on at once and "
                      "reads, by way of other blocks, its own output; put a delay into the loop (a transfer function whose "
                      "denominator is of higher order, or a sampled block)",
                      scene.file.string(), def.line, def.name));
    state[k] = 1;
    for (const int other : waits_for(def)) place(other);
    state[k] = 2;
    order.push_back(k);
  };
  for (size_t k = 0; k < scene.blocks.size(); ++k) place(static_cast<int>(k));
  for (const int k : order) {
    const BlockDef& def = scene.blocks[k];
    Block block{k, {}, def.A, def.B, def.C, def.D, def.initial, def.sample, -1};
    if (def.sample == 0.0) {
      block.z0 = model.nz;
      model.nz += static_cast<int>(def.A.rows());
    }
    model.blocks.push_back(std::move(block));
  }
  for (Block& block : model.blocks) {
    const BlockDef& def = scene.blocks[block.scene_block];
    for (size_t k = 0; k < def.inputs.size(); ++k)
      block.inputs.push_back(add_function(model, scene, fmt::format("{}:{}: [[block]] '{}'", scene.file.string(), def.line, def.name),
                                          {def.inputs[k], def.reads[k]}));
  }
}

// Works of forces that outputs ask for: a further state each.
void add_works(Model& model, const Scene& scene) {
  for (const OutputDef& output : scene.outputs) {
    const std::string& name = output.of.body;
    const auto known = [&](const ForceWork& w) { return w.force == name; };
    if (output.quantity != Quantity::work || std::any_of(model.works.begin(), model.works.end(), known)) continue;
    ForceWork work{name, {}, model.nz++};
    for (size_t i = 0; i < model.loads.size(); ++i)
      if (model.loads[i].def.name == name) work.loads.push_back(static_cast<int>(i));
    model.works.push_back(std::move(work));
  }
}

void add_loads(Model& model, const Scene& scene) {
  for (const ForceDef& def : scene.forces) {
    const std::string where = fmt::format("{}:{}: force '{}'", scene.file.string(), def.line, def.name);
    Load load;
    load.def = def;
    load.on = load.from = add_frame(model, scene, def.on, where);
    if (traits(def.kind).between) load.from = add_frame(model, scene, def.from, where);
    if (!def.through.empty()) {
      load.path = {load.from};
      for (const FrameRef& frame : def.through) load.path.push_back(add_frame(model, scene, frame, where));
      load.path.push_back(load.on);
    }
    if (traits(def.kind).value || (def.kind == ForceKind::spring_damper && (!def.reads.empty() || def.value != "0")))
      add_value(model, scene, where, load);
    if (def.kind == ForceKind::contact) add_contact(model, def, load);
    if (!def.rest.empty()) {
      load.rest = static_cast<int>(model.expressions.size());
      model.expressions.emplace_back(Expression(def.rest));
    }
    if (def.kind == ForceKind::distributed) spread_along_beam(model, scene, where, load);
    else model.loads.push_back(load);
  }
}

}  // namespace

int add_frame(Model& model, const Scene& scene, const FrameRef& ref, const std::string& where) {
  FramePoint f;
  f.name = ref.frame.empty() ? ref.body : ref.body + "." + ref.frame;
  if (ref.body != "ground") {
    int body = -1;
    std::vector<std::string> names{"ground"};
    for (size_t i = 0; i < scene.bodies.size(); ++i) {
      names.push_back(scene.bodies[i].name);
      if (scene.bodies[i].name == ref.body) body = static_cast<int>(i);
    }
    if (body < 0) throw InputError(fmt::format("{}: '{}' is no body{}", where, ref.body, did_you_mean(ref.body, names)));
    f = find_frame(model, scene, body, ref.frame, where);
  } else if (!ref.frame.empty()) {
    const auto at = scene.ground_frames.find(ref.frame);
    if (at == scene.ground_frames.end()) throw InputError(fmt::format("{}: 'ground' has no frame '{}'", where, ref.frame));
    f.offset.p = at->second;
  }
  model.frames.push_back(f);
  const int index = static_cast<int>(model.frames.size()) - 1;
  if (f.part != ground && !model.parts[f.part].body.nodes.empty()) resolve_node(model, where, index);
  return index;
}

int joint_part(const Model& model, int scene_joint) {
  for (size_t i = 0; i < model.parts.size(); ++i)
    if (model.parts[i].joint.scene_joint == scene_joint) return static_cast<int>(i);
  return -1;
}

Model build_model(const Scene& scene) {
  Model model;
  model.title = scene.title;
  model.settings = scene.simulation;
  if (scene.bodies.empty()) throw InputError(fmt::format("{}: there is no [[body]], nothing to simulate", scene.file.string()));

  std::vector<Edge> edges = make_edges(model, scene);
  Graph graph(std::move(edges), static_cast<int>(model.parts.size()));
  for (size_t k = 0; k < graph.edges.size(); ++k)
    if (graph.edges[k].priority >= 0 && graph.joins(graph.edges[k])) graph.keep(k);
  add_links(model, scene, graph);
  free_the_rest(model, graph);
  const std::vector<int> order = orient(model, graph);

  // Bodies' elastic coordinates depend on how the scene moves; now the tree is known.
  make_bodies(model, scene, order);

  add_loops(model, scene, graph);
  add_couplings(model, scene);
  std::vector<int> loops, coupled;
  model.clusters = make_clusters(model, order, loops, coupled);
  renumber_parts(model, scene, loops, coupled);
  for (size_t k = 0; k < model.clusters.size(); ++k) complete_cluster(model, static_cast<int>(k));
  for (const Part& p : model.parts) model.mass += p.body.mass;
  add_blocks(model, scene);
  add_loads(model, scene);
  add_works(model, scene);
  return model;
}

}  // namespace flexframe::sim
