#include "sim/model/model_build.h"

#include "sim/base/words.h"
#include "sim/model/bodies.h"
#include "sim/model/joint_motion.h"
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
  for (std::size_t k = 0; k < facts.turns.size(); k += 2) rows.push_back({ClosureRow::angle, named(facts.turns[k]), named(facts.turns[k + 1]), 0.0});
  if (facts.distance) rows.push_back({ClosureRow::distance, Vec3::Zero(), Vec3::Zero(), length});
  return rows;
}

// An edge of the graph of parts.
struct Edge {
  int scene_joint = -1;   // -1: inner joint of a chain or free joint
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
  return p;
}

// What a loop joint cannot carry: everything that needs the joint's own coordinates. A spring on an angle or a slide, and their values, follow
// from the relative pose.
bool needs_coordinates(const Scene& scene, const JointDef& j) {
  const JointTraits& facts = traits(j.kind);
  if (facts.split) return j.spring || j.friction || j.stop;
  if (facts.rates.empty()) return false;
  if (!j.motion.empty() || j.motion_table || j.friction || j.stop || j.initial.value || j.initial.rate || !facts.closure) return true;
  for (const ForceDef& f : scene.forces)
    if (f.table && f.table_joint == j.name) return true;
  if (facts.read_off) return false;
  if (j.spring) return true;
  for (const OutputDef& o : scene.outputs)
    if (o.of.frame.empty() && o.of.body == j.name && (o.quantity == Quantity::value || o.quantity == Quantity::rate)) return true;
  return false;
}

std::vector<int> path_to_ground(const Model& model, int part) {
  std::vector<int> path;
  for (int i = part; i != ground; i = model.parts[i].parent) path.push_back(i);
  return path;
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
    throw InputError(fmt::format("{}: 'ground' has no frame '{}'; give position and rotation instead", where, ref.frame));
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


  // Parts of every body, and the joints inside chains.
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

  // Joints of the scene.
  for (size_t k = 0; k < scene.joints.size(); ++k) {
    const JointDef& j = scene.joints[k];
    const std::string where = joint_where(scene, j);
    Edge e;
    e.scene_joint = static_cast<int>(k);
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
    t.scene_joint = e.scene_joint;
    t.kind = j.kind;
    t.axis = j.axis;
    t.pitch = j.pitch;
    t.spring = j.spring;
    t.friction = j.friction;
    t.stop = j.stop;
    if (j.motion_table) {
      t.motion = static_cast<int>(model.expressions.size());
      model.expressions.emplace_back(std::make_shared<const CubicTable>(j.motion_table->x, j.motion_table->y, j.motion_table->period));
    }
    if (!j.motion.empty()) {
      if (rate_count(j.kind) != 1)
        throw InputError(fmt::format("{}: 'motion' needs a joint with one coordinate ({})", where, joint_words(has_one_coordinate)));
      t.motion = static_cast<int>(model.expressions.size());
      try {
        model.expressions.emplace_back(Expression(j.motion));
      } catch (const InputError& error) {
        throw InputError(fmt::format("{}: key 'motion': {}", where, error.what()));
      }
    }
    e.priority = is_tree_kind(j.kind) ? tree_priority(j) + (needs_coordinates(scene, j) ? 4 : 0) : -1;
    edges.push_back(e);
  }

  // Spanning tree: the edges that matter most first, else in the file's order.
  std::stable_sort(edges.begin(), edges.end(), [](const Edge& x, const Edge& y) { return x.priority > y.priority; });
  int n = static_cast<int>(model.parts.size());
  std::vector<int> group(n + 1);
  std::iota(group.begin(), group.end(), 0);
  const std::function<int(int)> find = [&](int i) { return group[i] == i ? i : group[i] = find(group[i]); };
  std::vector<std::vector<int>> adjacent(n + 1);
  std::vector<char> in_tree(edges.size(), 0);
  const auto keep = [&](int k) {
    in_tree[k] = 1;
    group[find(edges[k].a + 1)] = find(edges[k].b + 1);
    adjacent[edges[k].a + 1].push_back(k);
    adjacent[edges[k].b + 1].push_back(k);
  };
  for (size_t k = 0; k < edges.size(); ++k)
    if (edges[k].priority >= 0 && find(edges[k].a + 1) != find(edges[k].b + 1)) keep(static_cast<int>(k));
  // A joint that would close a loop and needs coordinates stands in the tree all the same: it carries a massless link, and the link's
  // weld to the child closes the loop.
  for (size_t k = 0, given = edges.size(); k < given; ++k) {
    if (in_tree[k] || !needs_coordinates(scene, scene.joints[edges[k].scene_joint])) continue;
    Part link;
    link.name = edges[k].joint.name;
    const int at = n++;
    model.parts.push_back(link);
    model.frames.push_back(FramePoint{at, -1, {}, "", link.name});
    const int frame = static_cast<int>(model.frames.size()) - 1;
    Edge weld;
    weld.a = at;
    weld.frame_a = frame;
    weld.b = edges[k].b;
    weld.frame_b = edges[k].frame_b;
    weld.joint.name = link.name;
    weld.joint.kind = JointKind::weld;
    // What acts along a line acts on a slide, which carries the point.
    if (const auto& split = traits(edges[k].joint.kind).split) std::tie(edges[k].joint.kind, weld.joint.kind) = *split;
    edges[k].b = at;
    edges[k].frame_b = frame;
    group.push_back(n);
    adjacent.emplace_back();
    keep(static_cast<int>(k));
    edges.push_back(weld);
    in_tree.push_back(0);
    model.notes.tell(fmt::format("joint '{}'", link.name), fmt::format("closes a loop and keeps its coordinate: an auxiliary massless link was inserted between it and '{}'", scene.joints[edges[k].scene_joint].child.body));
  }
  for (int i = 0; i < n; ++i) {
    if (find(i + 1) == find(0)) continue;
    const Part& part = model.parts[i];
    Edge e;
    e.b = i;
    e.joint.kind = JointKind::free;
    e.joint.name = part.name + " (free)";
    model.frames.push_back(FramePoint{ground, -1, {}, "", "ground"});
    e.frame_a = static_cast<int>(model.frames.size()) - 1;
    model.frames.push_back(FramePoint{i, -1, {}, "", part.name});
    e.frame_b = static_cast<int>(model.frames.size()) - 1;
    edges.push_back(e);
    in_tree.push_back(0);
    keep(static_cast<int>(edges.size()) - 1);
    model.notes.tell(fmt::format("body '{}'", part.name), "has no joint towards ground: it moves freely");
  }

  // Orient the tree from ground.
  std::vector<int> order;
  std::vector<char> seen(n + 1, 0);
  seen[0] = 1;
  std::vector<int> queue{ground};
  for (size_t at = 0; at < queue.size(); ++at) {
    for (int k : adjacent[queue[at] + 1]) {
      const Edge& e = edges[k];
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

  // Bodies' elastic coordinates depend on how the scene moves; now the tree is known.
  make_bodies(model, scene, order);

  // Loops.
  for (size_t k = 0; k < edges.size(); ++k) {
    if (in_tree[k]) continue;
    const Edge& e = edges[k];
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

  // Clusters: parts on a common loop. A flexible part at which a loop's branches meet joins them.
  std::vector<int> cluster_of(n);
  std::iota(cluster_of.begin(), cluster_of.end(), 0);
  const std::function<int(int)> root = [&](int i) { return cluster_of[i] == i ? i : cluster_of[i] = root(cluster_of[i]); };
  std::vector<std::vector<int>> members(model.loops.size());
  for (size_t l = 0; l < model.loops.size(); ++l) {
    std::vector<int> pa = path_to_ground(model, model.frames[model.loops[l].a].part);
    std::vector<int> pb = path_to_ground(model, model.frames[model.loops[l].b].part);
    int meet = ground;
    while (!pa.empty() && !pb.empty() && pa.back() == pb.back()) {
      meet = pa.back();
      pa.pop_back();
      pb.pop_back();
    }
    pa.insert(pa.end(), pb.begin(), pb.end());
    if (meet != ground && (model.parts[meet].body.n > 0 || pa.empty())) pa.push_back(meet);
    if (pa.empty())
      throw InputError(fmt::format("joint '{}' joins ground to ground", model.loops[l].name));
    members[l] = pa;
    for (int i : pa) cluster_of[root(i)] = root(pa.front());
  }

  // Number clusters so that parents come first, and the parts cluster by cluster.
  std::vector<int> cluster_index(n, -1);
  for (int i : order) {
    const int r = root(i);
    if (cluster_index[r] < 0) {
      cluster_index[r] = static_cast<int>(model.clusters.size());
      model.clusters.emplace_back();
    }
    model.clusters[cluster_index[r]].parts.push_back(i);
  }
  // Breadth-first order may start a cluster before its carrier's cluster is met only if the carrier is inside; sort by depth of entry.
  std::vector<int> sequence, number(n, -1);
  std::vector<Cluster> clusters;
  std::vector<char> done(model.clusters.size(), 0);
  const std::function<void(int)> place = [&](int k) {
    if (done[k]) return;
    done[k] = 1;
    for (int i : model.clusters[k].parts) {
      const int p = model.parts[i].parent;
      if (p != ground && cluster_index[root(p)] != k) place(cluster_index[root(p)]);
    }
    clusters.push_back(model.clusters[k]);
  };
  for (size_t k = 0; k < model.clusters.size(); ++k) place(static_cast<int>(k));
  model.clusters = clusters;
  for (const Cluster& c : model.clusters)
    for (int i : c.parts) {
      number[i] = static_cast<int>(sequence.size());
      sequence.push_back(i);
    }

  // Renumber parts.
  std::vector<Part> parts;
  parts.reserve(n);
  for (int i : sequence) parts.push_back(std::move(model.parts[i]));
  model.parts = std::move(parts);
  for (Part& p : model.parts)
    if (p.parent != ground) p.parent = number[p.parent];
  for (FramePoint& f : model.frames)
    if (f.part != ground) f.part = number[f.part];
  for (Flexure& f : model.flexures)
    for (int& i : f.parts) i = number[i];
  model.pieces.resize(scene.bodies.size());
  for (size_t i = 0; i < model.parts.size(); ++i) {
    if (model.parts[i].scene_body < 0) continue;
    std::vector<int>& pieces = model.pieces[model.parts[i].scene_body];
    pieces.resize(std::max(pieces.size(), static_cast<size_t>(model.parts[i].piece) + 1));
    pieces[model.parts[i].piece] = static_cast<int>(i);
  }
  for (size_t k = 0; k < model.clusters.size(); ++k) {
    Cluster& c = model.clusters[k];
    for (int& i : c.parts) {
      i = number[i];
      model.parts[i].cluster = static_cast<int>(k);
    }
  }
  for (size_t l = 0; l < model.loops.size(); ++l)
    model.clusters[model.parts[number[members[l].front()]].cluster].loops.push_back(static_cast<int>(l));

  // Base frames, coordinates, sizes.
  for (Cluster& c : model.clusters) {
    const int k = static_cast<int>(&c - model.clusters.data());
    c.q0 = model.nq;
    c.v0 = model.nv;
    bool first = true;
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
      if (first) {
        c.parent = p.parent;
        c.base = p.joint.inboard;
        base = rest_pose(model, p.joint.inboard);
        c.entry.push_back(Pose{});
        first = false;
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
    model.size = std::max(k == 0 ? 0.0 : model.size, c.size);
  }
  for (const Part& p : model.parts) model.mass += p.body.mass;

  // Forces.
  for (const ForceDef& def : scene.forces) {
    const std::string where = fmt::format("{}:{}: force '{}'", scene.file.string(), def.line, def.name);
    Load load;
    load.def = def;
    load.on = add_frame(model, scene, def.on, where);
    if (def.kind == ForceKind::spring_damper || def.kind == ForceKind::bushing) {
      load.from = add_frame(model, scene, def.from, where);
    } else {
      load.from = load.on;
      load.expression = static_cast<int>(model.expressions.size());
      if (def.table) {
        const auto table = std::make_shared<const CubicTable>(def.table->x, def.table->y, def.table->period);
        if (def.table_joint.empty()) {
          model.expressions.emplace_back(table);
        } else {
          model.expressions.emplace_back();
          load.table = table;
          for (size_t k = 0; k < scene.joints.size(); ++k)
            if (scene.joints[k].name == def.table_joint) load.table_part = joint_part(model, static_cast<int>(k));
        }
      } else try {
        model.expressions.emplace_back(Expression(def.value));
      } catch (const InputError& error) {
        throw InputError(fmt::format("{}: key 'value': {}", where, error.what()));
      }
    }
    if (def.kind == ForceKind::distributed) {
      // A load along a chain acts on every part of it.
      const int body = model.frames[load.on].part == ground ? -1 : model.parts[model.frames[load.on].part].scene_body;
      if (body < 0 || !std::holds_alternative<BeamDef>(scene.bodies[body].kind))
        throw InputError(fmt::format("{}: a distributed load needs a beam, '{}' is none", where, def.on.body));
      for (size_t i = 0; i < model.parts.size(); ++i) {
        if (model.parts[i].scene_body != body) continue;
        model.frames.push_back(FramePoint{static_cast<int>(i), -1, {}, "", def.on.body});
        load.on = load.from = static_cast<int>(model.frames.size()) - 1;
        model.loads.push_back(load);
      }
      continue;
    }
    model.loads.push_back(load);
  }
  return model;
}

}  // namespace flexframe::sim
