#include "sim/model/clusters.h"

#include "sim/model/bodies.h"
#include "sim/model/groups.h"
#include "sim/scene/curve.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace flexframe::sim {
namespace {

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

// Coordinates, carrier, entries, frames and size of a cluster; spans: of the parts, m.
void complete_cluster(Model& model, const std::vector<double>& spans, int k) {
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
    reach += spans[i];
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
  c.size = reach;
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
}

// Shortest length that a scene of points tells, m: of frames from their bodies' origins (those of springs too, which no joint names), of
// places on the ground from their middle, of where joints begin; else of wires and of what touches. 0: none.
double shortest_length(const Scene& scene) {
  double shortest = std::numeric_limits<double>::infinity();
  const auto take = [&](double length) {
    if (length > 0.0) shortest = std::min(shortest, length);
  };
  for (const BodyDef& body : scene.bodies)
    if (const auto* rigid = std::get_if<RigidDef>(&body.kind))
      for (const auto& [name, place] : rigid->frames)
        if (!name.ends_with(" of the picture")) take(place.norm());  // render/film/picture_accuracy looks there, which tells no length
  Eigen::AlignedBox3d standing;
  for (const auto& [name, place] : scene.ground_frames) standing.extend(place);
  for (const JointDef& j : scene.joints) {
    if (j.parent.body == "ground" && j.parent.frame.empty()) standing.extend(j.position);
    const std::vector<double> begins = j.initial.value.value_or(std::vector<double>{});
    for (int k = 0; k < static_cast<int>(begins.size()); ++k)
      if (is_length(j.kind, k)) take(std::abs(begins[static_cast<size_t>(k)]));
  }
  if (!standing.isEmpty()) take(0.5 * standing.diagonal().norm());
  if (std::isfinite(shortest)) return shortest;
  for (const JointDef& j : scene.joints)
    if (j.curve) take(j.curve->length());
  for (const ForceDef& f : scene.forces) {
    if (!f.contact) continue;
    take(f.contact->radius);
    take(f.contact->from_radius);
    if (f.contact->curve) take(f.contact->curve->length());
  }
  return std::isfinite(shortest) ? shortest : 0.0;
}

// The mechanism's size is that of its largest cluster; where none has an extent, the scene's lengths tell; 1 m only where nothing does.
// A cluster without extent (a body that is one point) is as large as the mechanism: it moves among the others.
void give_sizes(Model& model, const Scene& scene) {
  model.size = 0.0;
  for (const Cluster& c : model.clusters) model.size = std::max(model.size, c.size);
  if (model.size == 0.0) model.size = shortest_length(scene);
  if (model.size == 0.0) model.size = 1.0;
  for (Cluster& c : model.clusters)
    if (c.size == 0.0) c.size = model.size;
}

// Asked after every step: what its rates move where the cluster has its size.
void give_reaches(const Model& model, Cluster& c) {
  c.joint_reach.assign(static_cast<size_t>(c.nv), 0.0);
  c.elastic_reach = c.joint_reach;
  for (const int i : c.parts) {
    const Part& p = model.parts[i];
    for (int k = 0; k < p.joint.nv; ++k) c.joint_reach[static_cast<size_t>(p.v0 - c.v0 + k)] = is_length(p.joint.kind, k) ? 1.0 : c.size;
    for (int k = 0; k < p.body.n; ++k) {
      double& reach = c.elastic_reach[static_cast<size_t>(p.ev0 - c.v0 + k)];
      for (const FlexibleNode& node : p.body.nodes) reach = std::max({reach, node.phi.col(k).norm(), c.size * node.psi.col(k).norm()});
    }
  }
}

}  // namespace

void form_clusters(Model& model, const Scene& scene, const std::vector<int>& order) {
  std::vector<int> loops, coupled;
  model.clusters = make_clusters(model, order, loops, coupled);
  renumber_parts(model, scene, loops, coupled);
  const std::vector<double> spans = part_sizes(model);
  for (size_t k = 0; k < model.clusters.size(); ++k) complete_cluster(model, spans, static_cast<int>(k));
  give_sizes(model, scene);
  for (Cluster& c : model.clusters) give_reaches(model, c);
}

}  // namespace flexframe::sim
