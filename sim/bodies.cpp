#include "sim/bodies.h"

#include "sim/beam.h"
#include "sim/effects.h"
#include "sim/joint_motion.h"
#include "sim/normal_modes.h"
#include "sim/sid.h"
#include "sim/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// Pieces of a beam along x: one for finite-element and modal beams, the volumes of a mixed one.
int piece_count(const BeamDef& beam) { return beam.model == BeamModel::mixed ? beam.volumes : 1; }

// Part of a body that carries x/L = s, and s within that part. At a seam the piece before it is meant.
std::pair<int, double> locate(const BeamDef& beam, double s) {
  const int pieces = piece_count(beam);
  const double at = s * pieces;
  const int k = std::clamp(static_cast<int>(std::ceil(at)) - 1, 0, pieces - 1);
  return {k, at - k};
}

int part_of(const Model& model, int body, int piece) {
  for (size_t i = 0; i < model.parts.size(); ++i)
    if (model.parts[i].scene_body == body && model.parts[i].piece == piece) return static_cast<int>(i);
  return -1;
}

std::string frame_list(const BodyDef& body) {
  std::vector<std::string> names;
  if (const auto* rigid = std::get_if<RigidDef>(&body.kind)) {
    for (const auto& [name, position] : rigid->frames) names.push_back(name);
    if (names.empty()) return "no frames but its own";
  } else if (const auto* beam = std::get_if<BeamDef>(&body.kind)) {
    names = {"root", "tip"};
    for (const auto& [name, s] : beam->frames) names.push_back(name);
  }
  return list_words(names);
}

// Definition of one piece: its share of the length, and the named frames that lie in it.
BeamDef piece_of(const BeamDef& beam, int k) {
  BeamDef out = beam;
  const int pieces = piece_count(beam);
  out.length = beam.length / pieces;
  out.model = beam.model == BeamModel::mixed ? (beam.modes.empty() ? BeamModel::finite_element : BeamModel::modal) : beam.model;
  out.frames.clear();
  for (const auto& [name, s] : beam.frames) {
    const auto [piece, local] = locate(beam, s);
    if (piece == k) out.frames[name] = local;
  }
  return out;
}

FlexibleBody rigid_body(const RigidDef& def) {
  FlexibleBody body;
  body.mass = def.mass;
  const Vec3& c = def.centre_of_mass;
  body.md0 = def.mass * c;
  body.J0 = def.inertia;
  const double cc = c.squaredNorm();
  body.J0[0] += def.mass * (cc - c.x() * c.x());
  body.J0[1] += def.mass * (cc - c.y() * c.y());
  body.J0[2] += def.mass * (cc - c.z() * c.z());
  body.J0[3] -= def.mass * c.x() * c.y();
  body.J0[4] -= def.mass * c.x() * c.z();
  body.J0[5] -= def.mass * c.y() * c.z();
  return body;
}

// A finite-element beam for the equations of motion: same elements, frame on the mean axes, eigenmodes as coordinates.
//
// Boundaries that only place the frame (clamped-free, supported-supported, supported-free, free-free) span the same deformations.
// On the mean axes frame and deformation are decoupled in the kinetic energy, which keeps the mass matrix of second order positive
// definite; in a frame clamped to the root of a hinged beam it is not, since the elements nearly contain the frame's rotation.
void make_fe_part(Model& model, const BeamDef& beam, const BeamEffects& effects, Part& part) {
  part.body = make_fe_beam(beam, effects);
  if (part.body.n == 0) return;
  const bool frame_only = beam.boundary == Boundary::clamped_free || beam.boundary == Boundary::supported_supported ||
                          beam.boundary == Boundary::supported_free || beam.boundary == Boundary::free_free;
  // The change of coordinates costs n^3 a node; a beam of more than 150 coordinates keeps its elements' ones.
  const bool modes = part.body.n <= 150;
  MatX V = MatX::Identity(part.body.n, part.body.n), P = V;
  if (frame_only && beam.boundary != Boundary::free_free) {
    BeamDef mean = beam;
    mean.boundary = Boundary::free_free;
    const FlexibleBody named = part.body;
    part.body = make_fe_beam(mean, effects);
    P = same_deformation(part.body, named);
    part.shown.differs = true;
  }
  if (modes) part.body = to_normal_modes(part.body, V);
  part.shown.boundary = beam.boundary;
  part.shown.coordinates = P.partialPivLu().solve(V);
  const int index = static_cast<int>(&part - model.parts.data());
  for (const char* end : {"root", "tip"}) {
    model.frames.push_back(FramePoint{index, -1, {}, end, part.name + "." + end});
    (end[0] == 'r' ? part.shown.root : part.shown.tip) = static_cast<int>(model.frames.size()) - 1;
  }
}

// Drops the second-order blocks that a motion in the plane with this normal (body axes, y or z) never sees: the body turns about the
// normal only and stays in the plane.
void keep_plane(const Vec3& normal, FlexibleBody& body) {
  const int n = std::abs(normal.z()) > std::abs(normal.y()) ? 2 : 1;
  for (int a = 0; a < 3; ++a) {
    if (a == n) body.md2[a].resize(0, 0);
    if (a != n) body.Cr1[a].resize(0, 0);
  }
  // Tensor elements xx yy zz xy xz yz: only the one about the normal.
  for (int s = 0; s < 6; ++s)
    if (s != n) body.J2[s].resize(0, 0);
  for (FlexibleNode& node : body.nodes) node.phi2[n].resize(0, 0);
}

// Adds the scene's damping to a modal body's own: Rayleigh, and ratios of its eigenmodes (the last one holds for all further modes).
void add_modal_damping(const Damping& damping, FlexibleBody& body) {
  if (body.n == 0 || (damping.ratio.empty() && damping.mass == 0.0 && damping.stiffness == 0.0)) return;
  if (body.De.size() == 0) body.De = MatX::Zero(body.n, body.n);
  body.De += damping.mass * body.Me + damping.stiffness * body.Ke;
  if (damping.ratio.empty()) return;
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatX> eigen(body.Ke, body.Me);
  for (int k = 0; k < body.n; ++k) {
    const double zeta = damping.ratio[std::min<size_t>(k, damping.ratio.size() - 1)];
    const VecX p = body.Me * eigen.eigenvectors().col(k);
    body.De += 2.0 * zeta * std::sqrt(std::max(0.0, eigen.eigenvalues()[k])) * p * p.transpose();
  }
}

// Orientation of every body at the start, joints at their initial values.
std::vector<Mat3> start_orientation(const Model& model, const Scene& scene, const std::vector<int>& order) {
  std::vector<Mat3> part(model.parts.size(), Mat3::Identity()), body(scene.bodies.size(), Mat3::Identity());
  for (int i : order) {
    const Part& p = model.parts[i];
    std::vector<double> q(8, 0.0);
    zero_coordinates(p.joint.kind, q.data());
    if (p.joint.scene_joint >= 0 && position_count(p.joint.kind) == 1) {
      const JointDef& def = scene.joints[p.joint.scene_joint];
      if (def.initial.value && def.initial.value->size() == 1) q[0] = def.initial.value->front();
    }
    JointMotion motion;
    update_joint_position(p.joint, q.data(), motion);
    const Mat3 carrier = p.parent == ground ? Mat3(Mat3::Identity()) : part[p.parent];
    part[i] = carrier * model.frames[p.joint.inboard].offset.R * motion.pose.R * model.frames[p.joint.outboard].offset.R.transpose();
    if (p.scene_body >= 0) body[p.scene_body] = part[i];
  }
  return body;
}

}  // namespace

std::vector<ChainJoint> make_parts(Model& model, const Scene& scene) {
  std::vector<ChainJoint> inner;
  for (size_t b = 0; b < scene.bodies.size(); ++b) {
    const BodyDef& def = scene.bodies[b];
    const auto* beam = std::get_if<BeamDef>(&def.kind);
    const int pieces = beam ? piece_count(*beam) : 1;
    for (int k = 0; k < pieces; ++k) {
      Part part;
      part.name = pieces > 1 ? fmt::format("{}[{}]", def.name, k) : def.name;
      part.scene_body = static_cast<int>(b);
      part.piece = k;
      if (beam) part.rest_in_body.p.x() = k * beam->length / pieces;
      if (const auto* rigid = std::get_if<RigidDef>(&def.kind)) part.body = rigid_body(*rigid);
      model.parts.push_back(part);
      if (k == 0) continue;
      const int here = static_cast<int>(model.parts.size()) - 1;
      ChainJoint j;
      model.frames.push_back(FramePoint{here - 1, -1, {}, "tip", model.parts[here - 1].name + ".tip"});
      j.frame_a = static_cast<int>(model.frames.size()) - 1;
      model.frames.push_back(FramePoint{here, -1, {}, "root", part.name + ".root"});
      j.frame_b = static_cast<int>(model.frames.size()) - 1;
      j.joint.name = part.name + " (seam)";
      j.joint.kind = JointKind::weld;
      inner.push_back(j);
    }
  }
  return inner;
}

FramePoint find_frame(const Model& model, const Scene& scene, int body, const std::string& frame, const std::string& where) {
  const BodyDef& def = scene.bodies[body];
  FramePoint f;
  f.part = part_of(model, body, 0);
  f.name = frame.empty() ? def.name : def.name + "." + frame;
  const auto fail = [&]() {
    throw InputError(fmt::format("{}: '{}' is no frame of '{}'; it has {}", where, frame, def.name, frame_list(def)));
  };
  if (const auto* rigid = std::get_if<RigidDef>(&def.kind)) {
    if (frame.empty()) return f;
    const auto at = rigid->frames.find(frame);
    if (at == rigid->frames.end()) fail();
    f.offset.p = at->second;
    return f;
  }
  if (const auto* beam = std::get_if<BeamDef>(&def.kind)) {
    if (frame.empty() || frame == "root") {
      f.node_name = "root";
      return f;
    }
    if (frame == "tip") {
      f.part = part_of(model, body, piece_count(*beam) - 1);
      f.node_name = "tip";
      return f;
    }
    if (const auto at = beam->frames.find(frame); at != beam->frames.end()) {
      f.part = part_of(model, body, locate(*beam, at->second).first);
      f.node_name = frame;
      return f;
    }
    if (frame.rfind("node[", 0) == 0 && frame.back() == ']') {
      const std::string digits = frame.substr(5, frame.size() - 6);
      const bool number = !digits.empty() && digits.size() < 7 && std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; });
      const int nodes = piece_count(*beam) * beam->elements;
      if (number && beam->model != BeamModel::modal && std::stoi(digits) <= nodes) {
        const int k = std::stoi(digits);
        const int piece = std::clamp((k + beam->elements - 1) / beam->elements - 1, 0, piece_count(*beam) - 1);
        f.part = part_of(model, body, piece);
        f.node_name = fmt::format("node[{}]", k - piece * beam->elements);
        return f;
      }
    }
    fail();
  }
  if (frame.empty()) return f;
  f.node_name = frame;
  return f;
}

void make_bodies(Model& model, const Scene& scene, const std::vector<int>& order) {
  const std::vector<Mat3> orientation = start_orientation(model, scene, order);
  const Vec3 normal = plane_normal(scene, orientation);
  for (Part& part : model.parts) {
    const BodyDef& def = scene.bodies[part.scene_body];
    const int k = part.piece;
    if (const auto* beam = std::get_if<BeamDef>(&def.kind)) {
      const EffectDecision decision = decide_effects(def, *beam, orientation[part.scene_body].transpose() * normal, attachment_count(scene, def.name));
      if (k == 0) model.notes.insert(model.notes.end(), decision.why.begin(), decision.why.end());
      const BeamDef one = piece_of(*beam, k);
      if (one.model == BeamModel::modal) part.body = make_modal_beam(one, decision.effects);
      else make_fe_part(model, one, decision.effects, part);
      if (!normal.isZero(0.0)) keep_plane(orientation[part.scene_body].transpose() * normal, part.body);
      part.load_factor = one.length / part.body.mass;
    } else if (const auto* modal = std::get_if<ModalDef>(&def.kind)) {
      const SidReading sid = read_sid(modal->file);
      model.notes.insert(model.notes.end(), sid.notes.begin(), sid.notes.end());
      part.body = to_flexible_body(sid.file, modal->file.string(), &model.notes);
      add_modal_damping(modal->damping, part.body);
    }
  }
  for (size_t f = 0; f < model.frames.size(); ++f) resolve_node(model, scene.file.string(), static_cast<int>(f));
}

void resolve_node(Model& model, const std::string& where, int frame) {
  FramePoint& f = model.frames[frame];
  if (f.part == ground || f.node_name.empty()) return;
  const std::vector<FlexibleNode>& nodes = model.parts[f.part].body.nodes;
  for (size_t i = 0; i < nodes.size(); ++i)
    if (nodes[i].name == f.node_name) f.node = static_cast<int>(i);
  if (f.node >= 0) return;
  std::vector<std::string> names;
  for (const FlexibleNode& node : nodes) names.push_back(node.name);
  throw InputError(fmt::format("{}: '{}' is no frame of '{}'; it has {}", where, f.node_name, model.parts[f.part].name, list_words(names, 12)));
}

double part_size(const Model& model, int part) {
  const FlexibleBody& body = model.parts[part].body;
  double size = 0.0;
  if (!body.nodes.empty()) {
    Eigen::AlignedBox3d box;
    for (const FlexibleNode& node : body.nodes) box.extend(node.origin);
    size = box.diagonal().norm();
  }
  for (const FramePoint& f : model.frames)
    if (f.part == part) size = std::max(size, f.offset.p.norm());
  return size;
}

Pose rest_pose(const Model& model, int frame) {
  const FramePoint& f = model.frames[frame];
  if (f.part == ground || f.node < 0) return f.offset;
  const FlexibleNode& node = model.parts[f.part].body.nodes[f.node];
  return compose({node.rotation, node.origin}, f.offset);
}

}  // namespace flexframe::sim
