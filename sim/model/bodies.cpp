#include "sim/model/bodies.h"

#include "sim/base/eigen_solvers.h"
#include "sim/base/plain_text.h"
#include "sim/base/small_matrices.h"
#include "sim/base/words.h"
#include "sim/bodies/axis_mass.h"
#include "sim/bodies/beam.h"
#include "sim/bodies/beam_boundary.h"
#include "sim/bodies/beam_kept.h"
#include "sim/bodies/beam_pieces.h"
#include "sim/bodies/beam_terms.h"
#include "sim/bodies/body_file.h"
#include "sim/bodies/normal_modes.h"
#include "sim/bodies/sid_lack.h"
#include "sim/bodies/state_space.h"
#include "sim/model/effects.h"
#include "sim/model/fe_body.h"
#include "sim/model/joint_motion.h"
#include "sim/model/mounted_modes.h"
#include "sim/scene/effect_names.h"
#include "sim/scene/force_kinds.h"
#include "sim/scene/joint_kinds.h"
#include "sim/scene/section.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace flexframe::sim {
namespace {

// Nodes that the scene turns are nodes of the body's file.
void require_turned_nodes(const Scene& scene, const BodyDef& def, const FlexibleBody& made) {
  std::vector<std::string> names;
  for (const FlexibleNode& node : made.nodes) names.push_back(node.name);
  for (const auto& entry : def.frame_axes) {
    if (std::find(names.begin(), names.end(), entry.first) != names.end()) continue;
    const std::string hint = did_you_mean(entry.first, names);
    throw InputError(fmt::format("{}:{}: body '{}': key 'frames' turns {}, which is no node of its file{}{} it has {}", scene.file.string(),
                                 def.line, def.name, quote(entry.first), hint, hint.empty() ? ";" : "", list_words(names, 12)));
  }
}

std::string frame_list(const BodyDef& body) {
  std::vector<std::string> names;
  if (const auto* rigid = std::get_if<RigidDef>(&body.kind)) {
    for (const auto& [name, position] : rigid->frames) names.push_back(name);
    if (names.empty()) return "no frames but its own";
  } else if (const auto* beam = std::get_if<BeamDef>(&body.kind)) {
    names = {"root", "tip"};
    for (const auto& [name, s] : beam->frames) names.push_back(name);
  } else if (const auto* space = std::get_if<StateSpaceDef>(&body.kind)) {
    for (const auto& [name, position] : space->rigid.frames) names.push_back(name);
  }
  return list_words(names);
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

// Where joints and loads take hold of a body. A hinge in a scene that moves in its plane passes on no moment unless its motion is
// prescribed, which clamps what it holds, or a spring, friction or a stop brakes it.
std::vector<HeldPoint> held_points(const Scene& scene, const std::string& body, bool planar) {
  std::vector<HeldPoint> out;
  const auto hold = [&](const FrameRef& f, bool force, bool moment, bool load) {
    if (f.body == body && (force || moment)) out.push_back({f.frame.empty() ? "root" : f.frame, force, moment, load});
  };
  for (const JointDef& j : scene.joints) {
    const bool moved = !j.motion.empty() || j.motion_table, braked = j.spring || j.friction || j.stop;
    const bool free_to_turn = !moved && (passes_no_moment(j.kind) || (planar && traits(j.kind).in_plane == InPlane::axis_normal));
    for (const FrameRef* f : {&j.parent, &j.child}) {
      hold(*f, true, !free_to_turn, false);
      hold(*f, false, braked && free_to_turn, true);
    }
  }
  const auto spread = [&](const ForceDef& f) { return f.kind == ForceKind::distributed && f.on.body == body; };
  if (!scene.simulation.gravity.isZero(0.0) || std::any_of(scene.forces.begin(), scene.forces.end(), spread))
    out.push_back({"", true, false, true});
  for (const ForceDef& f : scene.forces) {
    if (f.kind == ForceKind::distributed) continue;
    const ForceTraits facts = traits(f.kind);
    hold(f.on, facts.force, facts.moment, true);
    if (facts.between) hold(f.from, facts.force, facts.moment, true);
  }
  return out;
}

// Blocks of effects that a body goes without.
void leave_out(const std::vector<std::string>& without, FlexibleBody& body) {
  for (const std::string& effect : without) {
    if (effect == "gyroscopic") {
      // The angular momentum of coordinates that move while others are deflected couples rates: its part that is skew in the two is all of
      // the gyroscopic forces between them. The inertia keeps following the deformation (centrifugal forces, their stiffness), and so does
      // the part of second-order displacements, which is symmetric. All forces follow from the kinetic energy, so that energy is kept.
      body.axis = {};
      for (MatX& b : body.Cr1) {
        b = (0.5 * (b + b.transpose())).eval();
        if (b.isZero(0.0)) b.resize(0, 0);
      }
    } else if (effect == "stiffening") {
      body.axis = {};
      for (MatX& b : body.md2) b.resize(0, 0);
      for (MatX& b : body.J2) b.resize(0, 0);
      for (FlexibleNode& node : body.nodes)
        for (size_t a = 0; a < 3; ++a) {
          node.phi2[a].resize(0, 0);
          node.psi2[a].resize(0, 0);
        }
    } else if (effect == "damping") {
      body.De.resize(0, 0);
    }
  }
}

// Bodies and elastic coordinates behind the effects.
void complete_effects(Model& model, const Scene& scene) {
  for (EffectState& s : model.effects) {
    for (size_t b = 0; b < scene.bodies.size(); ++b)
      if (s.owner == scene.bodies[b].name) s.body = static_cast<int>(b);
    if (!std::holds_alternative<BeamDef>(scene.bodies[s.body].kind)) continue;
    for (const Part& p : model.parts)
      for (int k = 0; p.scene_body == s.body && k < p.body.n; ++k)
        s.coordinates += s.effect == direction_names()[coordinate_direction(p.body, k)];
  }
}

// The frames that the boundary's frame is found from.
void add_shown_frames(Model& model, Boundary boundary, Part& part) {
  part.shown.boundary = boundary;
  const int index = static_cast<int>(&part - model.parts.data());
  for (const char* end : {"root", "tip"}) {
    model.frames.push_back(FramePoint{index, -1, {}, end, part.name + "." + end});
    (end[0] == 'r' ? part.shown.root : part.shown.tip) = static_cast<int>(model.frames.size()) - 1;
  }
}

// Says that a beam is made of fewer elements than it is given. An element errs in a frequency by (k h)^4 / 1440 where it is cubic, by
// (k h)^2 / 24 where it is linear (k: wave number, here of the tenth mode, some 30 a length).
void note_fewer_elements(Model& model, const BeamDef& beam, const BeamEffects& effects, const std::string& name) {
  const int elements = beam::computed_elements(beam, effects);
  if (elements >= beam.elements) return;
  const double kh = 30.0 / elements, error = effects.axial || effects.torsion ? kh * kh / 24.0 : kh * kh * kh * kh / 1440.0;
  const std::string why =
      beam.keep_modes ? "as more of them lose digits" : "whose cost grows with the third power of their number (not with keep_modes)";
  model.notes.tell(fmt::format("body '{}'", name),
                   fmt::format("computed with {} of its {} elements, {}: its first ten frequencies are right to {:.0e}", elements,
                               beam.elements, why, error));
}

void make_fe_part(Model& model, const BeamDef& beam, const BeamEffects& effects, const std::vector<HeldPoint>& held, bool damped,
                  Part& part) {
  FeBody made = fe_body(beam, effects, held, damped);
  if (made.fewer) note_fewer_elements(model, beam, effects, part.name);
  part.body = std::move(made.body);
  part.shown = std::move(made.shown);
  if (part.body.n > 0) add_shown_frames(model, beam.boundary, part);
}

// A volume of a mixed beam with modes: on its mean axes too, in its eigenmodes.
void make_modal_volume_part(Model& model, const BeamDef& beam, const BeamEffects& effects, Part& part) {
  part.body = make_modal_volume(beam, effects);
  if (part.body.n == 0) return;
  MatX V;
  part.body = to_normal_modes(part.body, V);
  part.shown.differs = true;
  add_shown_frames(model, beam.boundary, part);
}

// Drops the second-order blocks that a motion in the plane with this normal (body axes, y or z) never sees: the body turns about the
// normal only and stays in the plane.
void keep_plane(const Vec3& normal, bool complete, FlexibleBody& body) {
  const int n = std::abs(normal.z()) > std::abs(normal.y()) ? 2 : 1;
  if (!complete) body.axis = {};
  for (int a = 0; a < 3; ++a) {
    if (a == n) body.md2[a].resize(0, 0);
    if (a != n) body.Cr1[a].resize(0, 0);
  }
  // Tensor elements xx yy zz xy xz yz: only the one about the normal.
  for (int s = 0; s < 6; ++s)
    if (s != n) body.J2[s].resize(0, 0);
  for (FlexibleNode& node : body.nodes) node.phi2[n].resize(0, 0);
}

// Whether the modes of a beam's boundary are those of the beam as its joints hold it.
bool boundary_fits(const BeamDef& beam, const std::vector<Support>& holds, bool planar) {
  const auto at = [](const Support& s, const char* end) {
    return s.frame.frame == end || (s.frame.frame.empty() && std::string_view(end) == "root");
  };
  const auto fixed = [](const Support& s) { return s.joint->kind == JointKind::weld || !s.joint->motion.empty() || s.joint->motion_table; };
  const auto pin = [&](const Support& s) { return planar && s.joint->kind == JointKind::revolute && s.joint->position.isZero(0.0); };
  if (beam.boundary == Boundary::free_free) return holds.empty();
  if (beam.boundary == Boundary::clamped_free) return holds.size() == 1 && fixed(holds[0]) && at(holds[0], "root");
  if (beam.boundary != Boundary::supported_supported || holds.size() != 2 || !pin(holds[0]) || !pin(holds[1])) return false;
  return (at(holds[0], "root") && at(holds[1], "tip")) || (at(holds[0], "tip") && at(holds[1], "root"));
}

// "held by 'clamp' and 'pin'", for notes.
std::string mounting_words(const std::vector<Support>& holds) {
  if (holds.empty()) return "flying freely";
  std::string text = "held by ";
  for (size_t k = 0; k < holds.size(); ++k)
    text += fmt::format("{}'{}'", k == 0 ? "" : k + 1 == holds.size() ? " and " : ", ", holds[k].joint->name);
  return text;
}

// Adds the damping of ratios, and of Rayleigh's mass, that are meant of the modes of the body as its joints hold it. The last ratio holds
// for all further modes. mass Me would damp the motion relative to the body frame, which of a body that its joints hold elsewhere is none
// of its own: a beam on a hinge in its clamped frame decayed 11 times as fast as asked.
void add_mounted_damping(Model& model, const Scene& scene, int body, const Damping& damping, std::span<const Mat3> orientation,
                         FlexibleBody& made) {
  if (made.n == 0 || (!has_ratio(damping) && damping.mass == 0.0)) return;
  const std::string owner = fmt::format("body '{}'", scene.bodies[body].name);
  const std::vector<Support> holds = mounting_of(scene, scene.bodies[body].name);
  const MountedModes modes = mounted_modes(made, held_rows(scene, body, made, holds, orientation));
  if (made.De.size() == 0) made.De = MatX::Zero(made.n, made.n);
  if (modes.omega.size() > 0) {
    std::vector<double> ratio(static_cast<size_t>(modes.omega.size()), 0.0);
    for (size_t k = 0; k < ratio.size(); ++k) {
      if (has_ratio(damping)) ratio[k] = damping.ratio[std::min(k, damping.ratio.size() - 1)];
      const double omega = modes.omega[static_cast<Eigen::Index>(k)];
      if (omega > 0.0) ratio[k] += damping.mass / (2.0 * omega);
    }
    made.De += mounted_damping(made, modes, ratio);
    if (!has_ratio(damping)) return;
    model.notes.tell(owner, fmt::format("damping ratios are those of its modes {}, the first at {:.4g} Hz", mounting_words(holds),
                                        modes.omega[0] / (2.0 * EIGEN_PI)));
    return;
  }
  made.De += beam::damping_matrix({.ratio = damping.ratio, .mass = damping.mass}, made.Me, made.Ke);
  model.notes.warn(owner,
                   fmt::format("it has no vibration modes {}: its damping is that of the modes of the free body", mounting_words(holds)));
}

// Kelvin-Voigt time constant of a chain, s: that of the first bending mode of the beam as its joints hold it (of the first mode where
// nothing bends).
double mounted_time_constant(Model& model, const Scene& scene, int body, BeamEffects effects, bool planar,
                             std::span<const Mat3> orientation) {
  const std::string& name = scene.bodies[body].name;
  const BeamDef& beam = std::get<BeamDef>(scene.bodies[body].kind);
  std::vector<Support> holds = mounting_of(scene, name);
  if (!has_ratio(beam.damping) || beam.damping.ratio[0] == 0.0 || beam.damping.mass != 0.0 || boundary_fits(beam, holds, planar))
    return chain_time_constant(beam, effects);
  BeamDef whole = beam;
  whole.model = BeamModel::finite_element;
  whole.boundary = Boundary::free_free;
  whole.elements = 16;
  whole.damping = {};
  whole.keep_modes.reset();
  effects.stiffening = effects.shear = false;
  const bool bends = effects.bending_xy || effects.bending_xz;
  if (bends) effects.axial = effects.torsion = false;
  else if (effects.torsion) effects.axial = false;
  for (size_t k = 0; k < holds.size(); ++k) {
    // The nodes of the chain are not those of these elements.
    std::string& frame = holds[k].frame.frame;
    if (!frame.starts_with("node[")) continue;
    const char* end = nullptr;
    const double share = leading_number(frame.c_str() + 5, &end) / (beam.elements * (beam.model == BeamModel::mixed ? beam.volumes : 1));
    frame = fmt::format("hold {}", k);
    whole.frames[frame] = std::min(1.0, share);
  }
  const FlexibleBody made = make_fe_beam(whole, effects);
  const MountedModes modes = mounted_modes(made, held_rows(scene, body, made, holds, orientation));
  if (modes.omega.size() == 0 || !(modes.omega[0] > 0.0)) return chain_time_constant(beam, effects);
  model.notes.tell(fmt::format("body '{}'", name), fmt::format("the damping ratio is that of its first mode {}, at {:.4g} Hz",
                                                               mounting_words(holds), modes.omega[0] / (2.0 * EIGEN_PI)));
  return beam.damping.stiffness + 2.0 * beam.damping.ratio[0] / modes.omega[0];
}

// Adds the scene's damping by stiffness to a modal body's own.
void add_stiffness_damping(const Damping& damping, FlexibleBody& body) {
  if (body.n == 0 || damping.stiffness == 0.0) return;
  if (body.De.size() == 0) body.De = MatX::Zero(body.n, body.n);
  body.De += damping.stiffness * body.Ke;
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

// Whether no beam of a scene that moves in the plane with this normal can bend or twist out of it, though something loads it so.
bool stays_in_plane(const Scene& scene, const std::vector<Mat3>& orientation, const Vec3& normal) {
  for (size_t b = 0; b < scene.bodies.size(); ++b) {
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind);
    if (!beam) continue;
    const BeamEffects e = decide_effects(scene.bodies[b], *beam, Vec3::Zero(), attachments_of(scene, scene.bodies[b].name)).effects;
    const bool in_xy = std::abs((orientation[b].transpose() * normal).z()) > 0.5;
    if (e.torsion || (in_xy ? e.bending_xz : e.bending_xy)) return false;
  }
  return true;
}

}  // namespace

std::vector<ChainJoint> make_parts(Model& model, const Scene& scene) {
  std::vector<ChainJoint> inner;
  model.pieces.resize(scene.bodies.size());
  for (size_t b = 0; b < scene.bodies.size(); ++b) {
    const BodyDef& def = scene.bodies[b];
    const auto* beam = std::get_if<BeamDef>(&def.kind);
    const int pieces = beam ? piece_count(*beam) : 1;
    const std::vector<Pose> poses = beam ? piece_poses(*beam) : std::vector<Pose>{};
    for (int k = 0; k < pieces; ++k) {
      Part part;
      part.name = pieces > 1 ? fmt::format("{}[{}]", def.name, k) : def.name;
      part.scene_body = static_cast<int>(b);
      part.piece = k;
      if (beam) part.rest_in_body = poses[k];
      if (const auto* rigid = std::get_if<RigidDef>(&def.kind)) part.body = rigid_body(*rigid);
      if (const auto* space = std::get_if<StateSpaceDef>(&def.kind)) {
        try {
          part.body = make_state_space_body(*space, rigid_body(space->rigid));
        } catch (const InputError& error) {
          throw InputError(fmt::format("{}:{}: body '{}': {}", scene.file.string(), def.line, def.name, error.what()));
        }
      }
      model.parts.push_back(part);
      const int here = static_cast<int>(model.parts.size()) - 1;
      model.pieces[b].push_back(here);
      if (k == 0) continue;
      ChainJoint j;
      model.frames.push_back(FramePoint{here - 1, -1, {}, "tip", model.parts[here - 1].name + ".tip"});
      if (beam->axis) {
        Pose end = model.parts[here - 1].rest_in_body;
        end.p += end.R.col(0) * piece_of(*beam, k - 1, 0.0).length;
        model.frames.back().offset = compose(inverse(end), model.parts[here].rest_in_body);
      }
      j.frame_a = static_cast<int>(model.frames.size()) - 1;
      model.frames.push_back(FramePoint{here, -1, {}, "root", part.name + ".root"});
      j.frame_b = static_cast<int>(model.frames.size()) - 1;
      j.joint.name = part.name + " (seam)";
      j.joint.kind = JointKind::weld;
      if (beam->model == BeamModel::lumped) j.joint.link = k - 1;
      inner.push_back(j);
    }
  }
  return inner;
}

FramePoint find_frame(const Model& model, const Scene& scene, int body, const std::string& frame, const std::string& where) {
  const BodyDef& def = scene.bodies[body];
  FramePoint f;
  f.part = model.pieces[body].front();
  f.name = frame.empty() ? def.name : def.name + "." + frame;
  const auto fail = [&]() {
    throw InputError(fmt::format("{}: '{}' is no frame of '{}'; it has {}", where, frame, def.name, frame_list(def)));
  };
  if (const auto* rigid = std::get_if<RigidDef>(&def.kind)) {
    if (frame.empty()) return f;
    const auto at = rigid->frames.find(frame);
    if (at == rigid->frames.end()) fail();
    f.offset = {frame_axes(def, frame), at->second};
    return f;
  }
  if (const auto* beam = std::get_if<BeamDef>(&def.kind)) {
    // Frames of a curved beam stand on it and look along its tangent, unless they are turned.
    const auto in_piece = [&](int k, const std::string& node, double s) {
      f.part = model.pieces[body][k];
      f.node_name = node;
      f.offset = {tangent_in_piece(*beam, k, s), beside_piece(*beam, k, s)};
      if (def.frame_axes.contains(frame)) f.offset.R = f.offset.R * frame_axes(def, frame);
      return f;
    };
    if (frame.empty() || frame == "root") return in_piece(0, "root", 0.0);
    if (frame == "tip") return in_piece(piece_count(*beam) - 1, "tip", 1.0);
    if (const auto at = beam->frames.find(frame); at != beam->frames.end())
      return in_piece(locate_piece(*beam, at->second).first, frame, at->second);
    if (frame.rfind("node[", 0) == 0 && frame.back() == ']') {
      const std::string digits = frame.substr(5, frame.size() - 6);
      const bool number =
          !digits.empty() && digits.size() < 7 && std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; });
      const int nodes = piece_count(*beam) * beam->elements;
      const int most = beam->model == BeamModel::lumped ? beam->elements : nodes;
      const bool has_nodes = beam->model != BeamModel::modal && (beam->model != BeamModel::mixed || beam->modes.empty());
      if (number && has_nodes && std::stoi(digits) <= most) {
        const int k = std::stoi(digits);
        if (beam->model == BeamModel::lumped) {
          f.part = model.pieces[body][k];
          f.node_name = "node[0]";
          return f;
        }
        const int piece = std::clamp((k + beam->elements - 1) / beam->elements - 1, 0, piece_count(*beam) - 1),
                  inside = k - piece * beam->elements;
        const double x = piece_start(*beam, piece) + piece_length(*beam, piece) * inside / beam->elements;
        return in_piece(piece, fmt::format("node[{}]", inside), x / beam->length);
      }
    }
    fail();
  }
  if (frame.empty()) return f;
  if (const auto* space = std::get_if<StateSpaceDef>(&def.kind); space && !space->rigid.frames.contains(frame)) fail();
  f.node_name = frame;
  f.offset.R = frame_axes(def, frame);
  return f;
}

namespace {

// Joints inside a lumped beam: rotation vectors about the axes in which it bends and twists.
void set_link_joints(Model& model, int body, const BeamLinks& links) {
  const int free = links.free[0] + links.free[1] + links.free[2];
  for (Part& part : model.parts) {
    TreeJoint& j = part.joint;
    if (part.scene_body != body || j.link < 0) continue;
    j.kind = free == 3 ? JointKind::flexure : free == 2 ? JointKind::flexure_pair : free == 1 ? JointKind::revolute : JointKind::weld;
    for (int a = 0; a < 3; ++a)
      if (free < 3 && links.free[a] == (free == 1)) j.axis = Vec3::Unit(a);
    j.nq = position_count(j.kind);
    j.nv = rate_count(j.kind);
  }
}

// The springs of a lumped beam; parts keep their order until the clusters are numbered.
void add_flexure(Model& model, int body, const BeamDef& beam, const BeamLinks& links) {
  if (!links.free[0] && !links.free[1] && !links.free[2]) return;
  Flexure f;
  f.scene_body = body;
  f.links = links;
  f.parts.assign(beam.elements, -1);
  for (size_t i = 0; i < model.parts.size(); ++i)
    if (model.parts[i].scene_body == body && model.parts[i].joint.link >= 0) f.parts[model.parts[i].joint.link] = static_cast<int>(i);
  f.length = beam.length;
  f.mass_per_length = beam.material.density * beam.section.area;
  f.polar_inertia = beam.material.density * mass_moments(beam.section).head<2>().sum();
  model.flexures.push_back(std::move(f));
}

// Transverse forces are taken through the centroid, as if that were the shear centre.
void warn_of_shear_centre(Model& model, const std::string& owner, const Section& section, const BeamEffects& effects) {
  const Eigen::Vector2d c = shear_centre(section);
  const double beside = std::max(effects.bending_xy ? std::abs(c.y()) : 0.0, effects.bending_xz ? std::abs(c.x()) : 0.0);
  if (beside <= 1e-3 * std::sqrt(section.area)) return;
  model.notes.warn(
      owner, fmt::format("its section '{}' has its shear centre {:.3g} m beside the centroid: the twist by transverse forces that act "
                         "elsewhere than through the shear centre is not computed, nor the stiffness by held warping",
                         section.shape, beside));
}

// Shear areas in m^2 where shares of the area are asked for: the beam would shear a thousand times too far. Shares so small are those of
// sandwiches with areas of square metres at the least.
void warn_of_shear_areas(Model& model, const std::string& owner, const Section& section) {
  if (section.shape != "general") return;
  for (const auto& [key, share] : {std::pair("shear_y", section.shear_y), std::pair("shear_z", section.shear_z)})
    if (share > 0.0 && share <= std::min(1.2 * section.area, 0.02))
      model.notes.warn(owner,
                       fmt::format("its section's {0} is the share of the area that carries shear, 5/6 of a rectangle, found {1:.3g}, "
                                   "no more than its area in m^2; if it is a shear area, write {0} = {2:.3g}",
                                   key, share, share / section.area));
}

// Interfaces that the scene loads and whose static deflection the modes of a reduced body do not have.
void warn_of_lacking_modes(Model& model, const Scene& scene, const std::string& owner, const std::string& body,
                           const std::string& comment) {
  if (!knows_lacks(comment))
    model.notes.tell(owner,
                     "its file does not say how much of the static deflection at its frames its modes lack under loads there: if they "
                     "lack some, what is held or pushed there is too stiff, and no estimated error contains that");
  for (const InterfaceLack& lack : lacks_of_comment(comment)) {
    const auto here = [&](const FrameRef& f) { return f.body == body && f.frame == lack.interface; };
    const bool loaded =
        std::any_of(scene.joints.begin(), scene.joints.end(), [&](const JointDef& j) { return here(j.parent) || here(j.child); }) ||
        std::any_of(scene.forces.begin(), scene.forces.end(), [&](const ForceDef& f) { return here(f.on) || here(f.from); });
    if (loaded)
      model.notes.warn(owner,
                       fmt::format("its modes lack {:.2g} of the static deflection at '{}' under loads there, and what is held there "
                                   "is too stiff: reduce it with more modes or with --method craig-bampton",
                                   lack.share, lack.interface));
  }
}

// Nodes of a reduced body that the scene holds or pushes though they are none of its interfaces.
void warn_of_plain_nodes(Model& model, const Scene& scene, const std::string& owner, const std::string& body, const std::string& comment) {
  const auto interfaces = interfaces_of_comment(comment);
  if (!interfaces) return;
  std::vector<std::string> plain;
  const auto look = [&](const FrameRef& f) {
    if (f.body == body && !f.frame.empty() && std::find(interfaces->begin(), interfaces->end(), f.frame) == interfaces->end() &&
        std::find(plain.begin(), plain.end(), f.frame) == plain.end())
      plain.push_back(f.frame);
  };
  for (const JointDef& j : scene.joints) look(j.parent), look(j.child);
  for (const ForceDef& f : scene.forces) look(f.on), look(f.from);
  if (!plain.empty())
    model.notes.warn(owner, fmt::format("is held or pushed at {}, which the reduction was not told of: its modes may lack much of the "
                                        "deflection there, and it is too stiff by that: reduce it with --interface there",
                                        list_words(plain, 5)));
}

// Whether the scene asks a frame of a body to turn with it: for a moment there, or for how it turns.
bool asks_for_turns(const Scene& scene, const std::string& body, const std::string& frame, bool outputs) {
  const auto here = [&](const FrameRef& f) { return f.body == body && f.frame == frame; };
  return std::any_of(scene.joints.begin(), scene.joints.end(),
                     [&](const JointDef& j) { return (here(j.parent) || here(j.child)) && !passes_no_moment(j.kind); }) ||
         std::any_of(scene.forces.begin(), scene.forces.end(),
                     [&](const ForceDef& f) {
                       return (here(f.on) || here(f.from)) && (f.kind == ForceKind::torque || !f.bushing_stiffness.tail<3>().isZero(0.0));
                     }) ||
         (outputs && std::any_of(scene.outputs.begin(), scene.outputs.end(), [&](const OutputDef& o) {
            const bool turns =
                o.quantity == Quantity::rotation || o.quantity == Quantity::angular_velocity || o.quantity == Quantity::angle;
            return (here(o.of) && turns) || (o.relative_to && here(*o.relative_to));
          }));
}

// What a body's file does not say, and what its interfaces do not resist, where the scene asks for it.
void warn_of_lacks(Model& model, const Scene& scene, const std::string& owner, const std::string& body, const BodyFile& file) {
  for (const std::string& text : file.lacks.all) model.notes.warn(owner, text);
  for (const std::string& node : file.lacks.unturned)
    if (asks_for_turns(scene, body, node, true))
      model.notes.warn(owner,
                       fmt::format("its file does not say how '{}' turns as the body deforms (neither psi nor a first order of AP): it "
                                   "turns with the body's frame, and moments there do not deform the body",
                                   node));
  for (const std::string& interface : turning_of_comment(file.comment))
    if (asks_for_turns(scene, body, interface, false))
      model.notes.warn(owner,
                       fmt::format("the nodes of its interface '{}' lie on a line or at one point: the finite element model resists no "
                                   "turn about it, and here moments hold the body there all the same; reduce it with nodes that "
                                   "span a plane, or take a joint that passes on no moment about it",
                                   interface));
}

}  // namespace

void make_bodies(Model& model, const Scene& scene, const std::vector<int>& order, const FurtherOfBodies& further) {
  const std::vector<Mat3> orientation = start_orientation(model, scene, order);
  const Vec3 moves_in = plane_normal(scene, orientation);
  // Beams that are loaded beside the plane in which they move may leave it, if they have the effects for it.
  const Vec3 flat = moves_in.isZero(0.0) || flat_about(scene, orientation, moves_in) ? moves_in : Vec3(Vec3::Zero());
  const Vec3 normal = flat == moves_in || stays_in_plane(scene, orientation, moves_in) ? moves_in : flat;
  EffectDecision decision;
  BeamChain lumped;
  double time_constant = 0.0;
  for (Part& part : model.parts) {
    if (part.scene_body < 0) continue;  // a massless link of a loop
    const BodyDef& def = scene.bodies[part.scene_body];
    const int k = part.piece;
    const std::string owner = fmt::format("body '{}'", def.name);
    if (const auto* beam = std::get_if<BeamDef>(&def.kind)) {
      try {
        if (k == 0) {
          decision = decide_effects(def, *beam, orientation[part.scene_body].transpose() * flat, attachments_of(scene, def.name));
          decision.effects.complete = beam->chosen.complete_inertia;
          for (const std::string& why : decision.why) model.notes.tell(owner, why);
          model.effects.insert(model.effects.end(), decision.states.begin(), decision.states.end());
          const bool chain = beam->model == BeamModel::mixed || beam->model == BeamModel::lumped;
          if (chain && beam->damping.ratio.size() > 1)
            model.notes.warn(owner, "a mixed or lumped beam has one damping ratio, that of its first mode; the others are ignored");
          if (const std::string note = beam_validity_note(*beam, decision.effects); !note.empty()) model.notes.tell(owner, note);
          warn_of_shear_centre(model, owner, beam->section, decision.effects);
          warn_of_shear_areas(model, owner, beam->section);
          time_constant =
              chain ? mounted_time_constant(model, scene, part.scene_body, decision.effects, !normal.isZero(0.0), orientation) : 0.0;
          if (beam->model == BeamModel::lumped) {
            BeamDef damped = *beam;
            damped.damping = {.ratio = {}, .mass = 0.0, .stiffness = time_constant};
            lumped = make_lumped_beam(damped, decision.effects);
            set_link_joints(model, part.scene_body, lumped.links);
            add_flexure(model, part.scene_body, *beam, lumped.links);
          }
        }
        if (beam->model == BeamModel::lumped) {
          part.body = std::move(lumped.pieces[k].body);
        } else {
          BeamDef one = piece_of(*beam, k, time_constant);
          const bool of_modes = has_ratio(one.damping) || one.damping.mass != 0.0;
          const bool mounted = of_modes && !boundary_fits(*beam, mounting_of(scene, def.name), !normal.isZero(0.0));
          if (mounted) one.damping.ratio.clear(), one.damping.mass = 0.0;
          if (one.model == BeamModel::modal && beam->model == BeamModel::mixed) make_modal_volume_part(model, one, decision.effects, part);
          else if (one.model == BeamModel::modal) part.body = make_modal_beam(one, decision.effects), multiply_out(part.body.axis);
          else make_fe_part(model, one, decision.effects, held_points(scene, def.name, !normal.isZero(0.0)), mounted, part);
          if (mounted) add_mounted_damping(model, scene, part.scene_body, beam->damping, orientation, part.body);
        }
      } catch (const InputError& error) {
        throw InputError(fmt::format("{}:{}: body '{}': {}", scene.file.string(), def.line, def.name, error.what()));
      }
      if (!normal.isZero(0.0)) keep_plane(orientation[part.scene_body].transpose() * normal, beam->chosen.complete_inertia, part.body);
      leave_out(beam->effects.without, part.body);
      part.load_factor = piece_length(*beam, k) / part.body.mass;
      if (beam->model == BeamModel::lumped) part.load_factor = 1.0 / (beam->material.density * beam->section.area);
    } else if (const auto* modal = std::get_if<ModalDef>(&def.kind)) {
      BodyFile file = read_body(modal->file, modal->file.string());
      part.body = std::move(file.body);
      if (const auto more = further.find(def.name); more != further.end()) add_shapes(more->second, part.body);
      require_turned_nodes(scene, def, part.body);
      for (const std::string& note : file.notes) model.notes.tell(owner, note);
      warn_of_lacks(model, scene, owner, def.name, file);
      warn_of_lacking_modes(model, scene, owner, def.name, file.comment);
      warn_of_plain_nodes(model, scene, owner, def.name, file.comment);
      add_stiffness_damping(modal->damping, part.body);
      add_mounted_damping(model, scene, part.scene_body, modal->damping, orientation, part.body);
      const std::vector<EffectState> states = modal_effects(def, *modal, part.body);
      leave_out(modal->effects.without, part.body);
      model.effects.insert(model.effects.end(), states.begin(), states.end());
    }
  }
  complete_effects(model, scene);
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
  names.reserve(nodes.size());
  for (const FlexibleNode& node : nodes) names.push_back(node.name);
  throw InputError(
      fmt::format("{}: '{}' is no frame of '{}'; it has {}", where, f.node_name, model.parts[f.part].name, list_words(names, 12)));
}

namespace {

// Visits a body's coordinates in the scene's order: (part, first coordinate in q_all or w_all, how many there, how many the scene
// counts: more where only some modes are kept).
template <class Visit>
void visit_coordinates(const Model& model, int body, bool rates, const Visit& visit) {
  const Flexure* flexure = nullptr;
  for (const Flexure& f : model.flexures)
    if (f.scene_body == body) flexure = &f;
  const std::vector<int>& pieces = model.pieces[body];
  for (size_t k = 0; k < pieces.size(); ++k) {
    if (flexure && k > 0) {
      const Part& link = model.parts[flexure->parts[k - 1]];
      visit(link, rates ? link.v0 : link.q0, link.joint.nv, link.joint.nv, false);
    }
    const Part& part = model.parts[pieces[k]];
    const int counted = part.shown.coordinates.size() > 0 ? static_cast<int>(part.shown.coordinates.rows()) : part.body.n;
    if (part.body.n > 0) visit(part, rates ? part.ev0 : part.eq0, part.body.n, counted, part.shown.coordinates.size() > 0);
  }
}

}  // namespace

int coordinate_count(const Model& model, int body) {
  int n = 0;
  visit_coordinates(model, body, false, [&](const Part&, int, int, int counted, bool) { n += counted; });
  return n;
}

void body_coordinates(const Model& model, int body, const VecX& all, bool rates, double* out) {
  visit_coordinates(model, body, rates, [&](const Part& part, int first, int count, int counted, bool mapped) {
    if (mapped) multiply(part.shown.coordinates, all.data() + first, out);
    else std::copy_n(all.data() + first, count, out);
    out += counted;
  });
}

VecX body_coordinates(const Model& model, int body, const VecX& all, bool rates) {
  VecX out(coordinate_count(model, body));
  body_coordinates(model, body, all, rates, out.data());
  return out;
}

void set_body_coordinates(const Model& model, int body, const VecX& given, VecX& all, bool rates) {
  Eigen::Index at = 0;
  visit_coordinates(model, body, rates, [&](const Part& part, int first, int count, int counted, bool mapped) {
    // Fewer modes than coordinates: the nearest shape that they can make.
    if (mapped) all.segment(first, count) = least_squares(part.shown.coordinates, VecX(given.segment(at, counted)));
    else all.segment(first, count) = given.segment(at, count);
    at += counted;
  });
}

namespace {

// That the nodes span.
double node_span(const FlexibleBody& body) {
  if (body.nodes.empty()) return 0.0;
  Eigen::AlignedBox3d box;
  for (const FlexibleNode& node : body.nodes) box.extend(node.origin);
  return box.diagonal().norm();
}

}  // namespace

double part_size(const Model& model, int part) {
  double size = node_span(model.parts[part].body);
  for (const FramePoint& f : model.frames)
    if (f.part == part) size = std::max(size, f.offset.p.norm());
  return size;
}

std::vector<double> part_sizes(const Model& model) {
  std::vector<double> sizes;
  for (const Part& part : model.parts) sizes.push_back(node_span(part.body));
  for (const FramePoint& f : model.frames)
    if (f.part != ground) sizes[f.part] = std::max(sizes[f.part], f.offset.p.norm());
  return sizes;
}

Pose rest_pose(const Model& model, int frame) {
  const FramePoint& f = model.frames[frame];
  if (f.part == ground || f.node < 0) return f.offset;
  const FlexibleNode& node = model.parts[f.part].body.nodes[f.node];
  return compose({node.rotation, node.origin}, f.offset);
}

}  // namespace flexframe::sim
