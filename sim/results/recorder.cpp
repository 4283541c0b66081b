#include "sim/results/recorder.h"

#include "sim/bodies/beam_pieces.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/massless.h"
#include "sim/dynamics/plane_frames.h"
#include "sim/model/beam_strains.h"
#include "sim/model/bodies.h"
#include "sim/scene/joint_kinds.h"
#include "sim/time/sample_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

const char* kind_name(const BodyDef& body) {
  if (std::holds_alternative<RigidDef>(body.kind)) return "rigid";
  if (std::holds_alternative<BeamDef>(body.kind)) return "beam";
  if (std::holds_alternative<ModalDef>(body.kind)) return "modal";
  return "statespace";
}

// ResultBody::node_shear of the beam's sections at its nodes.
MatX node_shear(const Model& model, const BodyDef& def, const ResultBody& body) {
  const auto* beam = std::get_if<BeamDef>(&def.kind);
  const auto on = [&](const char* effect) {
    return std::any_of(model.effects.begin(), model.effects.end(),
                       [&](const EffectState& e) { return e.owner == def.name && e.effect == effect && e.on; });
  };
  if (!beam || beam->axis || !on("shear")) return {};
  const double y = on("bending_xy") ? 1.0 : 0.0, z = on("bending_xz") ? 1.0 : 0.0;
  MatX out(static_cast<Eigen::Index>(body.nodes.size()), 4);
  for (Eigen::Index k = 0; k < out.rows(); ++k) {
    const double s = std::clamp(body.nodes[k].origin.x() / beam->length, 0.0, 1.0);
    out.row(k) = shear_length2(*beam, s).cwiseProduct(Eigen::Vector4d(y, y * z, y * z, z)).transpose();
  }
  return out;
}

int first_piece(const Model& model, int body) { return model.pieces[body].front(); }

void write_quaternion(const Mat3& R, Eigen::MatrixX4d& out, Eigen::Index row) {
  Quat q(R);
  q.normalize();
  // Neighbouring samples stay on the same sheet.
  if (row > 0 && q.w() * out(row - 1, 0) + q.x() * out(row - 1, 1) + q.y() * out(row - 1, 2) + q.z() * out(row - 1, 3) < 0.0)
    q.coeffs() = -q.coeffs();
  out.row(row) << q.w(), q.x(), q.y(), q.z();
}

// Brings the work to a sample, with what the outputs need. Returns the energies of the system.
Energy bring(System& system, double t, const VecX& y, const SampleNeeds& needs, Reactions& reactions) {
  if (needs.in_plane) return place_plane_sample(system, t, y.data(), needs.frames, needs.moving);
  const Energy energy = place_space_sample(system, t, y.data(), needs.frames);
  if (needs.accelerations) {
    update_system_accelerations(system);
    update_massless_accelerations(system, t, y);
  }
  if (needs.reactions) compute_reactions(system.model, system.work, reactions);
  return energy;
}

// What the state in `work` shows of the sizes of the mechanism and its motion.
void raise_scales(const System& system, const Energy& e, bool reactions, const Reactions& forces, OutputScales& scales) {
  const Model& model = system.model;
  scales.length = model.size;
  scales.rests = stays_in_equilibrium(system);
  const double duration = model.settings.duration;
  scales.force = std::max({scales.force, model.mass * model.settings.gravity.norm(), model.mass * model.size / (duration * duration),
                           std::max(e.kinetic, e.strain) / model.size});
  if (model.mass > 0.0) scales.speed = std::max(scales.speed, std::sqrt(2.0 * std::max(e.kinetic, 0.0) / model.mass));
  if (!reactions) return;
  for (const auto* all : {&forces.part, &forces.loop})
    for (const Vec6& F : *all) scales.force = std::max({scales.force, F.head<3>().norm(), F.tail<3>().norm() / model.size});
}

// Shapes and stresses of the nodes, for renderers that map modes.
void set_node_shapes(const FlexibleBody& flex, const std::vector<int>& nodes, ResultBody& body) {
  body.node_phi.resize(3 * static_cast<Eigen::Index>(nodes.size()), flex.n);
  body.node_psi.resize(body.node_phi.rows(), flex.n);
  for (size_t i = 0; i < nodes.size(); ++i) {
    const FlexibleNode& node = flex.nodes[nodes[i]];
    const auto row = 3 * static_cast<Eigen::Index>(i);
    body.node_phi.middleRows<3>(row) = node.phi;
    body.node_psi.middleRows<3>(row) = node.psi;
    if (node.sigma.cols() != flex.n || flex.n == 0) continue;
    body.stress_nodes.push_back(static_cast<int>(i));
    body.node_stress.conservativeResize(6 * static_cast<Eigen::Index>(body.stress_nodes.size()), flex.n);
    body.node_stress.bottomRows<6>() = node.sigma;
  }
  body.labels = flex.labels;
}

// Strains of a beam's sections, for renderers that colour by stress.
void set_section_strains(const Model& model, const Scene& scene, int b, ResultBody& body) {
  const std::vector<StrainStation> stations = strain_stations(model, scene, b, body.unstrained);
  std::vector<Vec3> entries;
  body.strain_stations.resize(static_cast<Eigen::Index>(stations.size()));
  for (size_t i = 0; i < stations.size(); ++i) {
    body.strain_stations[static_cast<Eigen::Index>(i)] = stations[i].x;
    for (size_t f = 0; f < 4; ++f)
      for (const auto& [k, value] : stations[i].row[f]) entries.emplace_back(static_cast<double>(4 * i + f), k, value);
  }
  body.section_strain.resize(static_cast<Eigen::Index>(entries.size()), 3);
  for (size_t i = 0; i < entries.size(); ++i) body.section_strain.row(static_cast<Eigen::Index>(i)) = entries[i].transpose();
}

}  // namespace

void grow_work(System& system) {
  Work work = make_work(system.model);
  work.q = system.work.q;
  work.w = system.work.w;
  work.clusters = system.work.clusters;
  keep_balance(system.work, work);
  work.joints = system.work.joints;
  for (size_t i = 0; i < work.parts.size(); ++i) work.parts[i].world = system.work.parts[i].world;
  system.work = std::move(work);
  if (system.plane) grow_plane(system.model, system.work, *system.plane);
}

SampleNeeds::SampleNeeds(const System& system, const OutputPlans& plans, bool forces)
    : in_plane(plans.in_plane && !forces && has_plane_samples(system)),
      accelerations(plans.accelerations || forces),
      reactions(plans.reactions || forces),
      moving(plans.moving || !system.model.couplings.empty()),  // ropes are looked at (left_ranges.h)
      frames(plans.frames) {}

Recorder::Recorder(System& system, const std::vector<double>& times) {
  Model& model = system.model;
  const Eigen::Index nt = static_cast<Eigen::Index>(times.size());
  plans_ = plan_outputs(model, system.scene, true);
  results_.title = system.scene.title;
  results_.scene_file = system.scene.file.string();
  results_.scene_text = system.scene.text;
  results_.times = Eigen::Map<const VecX>(times.data(), nt);
  for (size_t b = 0; b < system.scene.bodies.size(); ++b) {
    const BodyDef& def = system.scene.bodies[b];
    ResultBody body;
    body.name = def.name;
    body.kind = kind_name(def);
    if (const auto* beam = std::get_if<BeamDef>(&def.kind)) {
      body.length = beam->length;
      body.section = beam->section;
    }
    if (def.mesh) body.mesh = def.mesh->string();
    body.position = Eigen::MatrixX3d::Zero(nt, 3);
    body.orientation = Eigen::MatrixX4d::Zero(nt, 4);
    // Simulation nodes: the series' nodes of every piece (root and tip where a body has no series); seams once.
    const int n = coordinate_count(model, static_cast<int>(b));
    double reach = 0.0;
    for (const int at : model.pieces[b])
      for (const FlexibleNode& node : model.parts[at].body.nodes)
        reach = std::max(reach, (model.parts[at].rest_in_body.R * node.origin + model.parts[at].rest_in_body.p).norm());
    size_t before = 0;  // first node of the piece before: nodes at a seam are those of two neighbours
    for (size_t piece = 0; piece < model.pieces[b].size(); ++piece) {
      const int at = model.pieces[b][piece];
      const Part& part = model.parts[at];
      const size_t here = body.nodes.size();
      std::vector<int> chosen;
      for (size_t k = 0; k < part.body.nodes.size(); ++k) {
        const FlexibleNode& node = part.body.nodes[k];
        const Vec3 origin = part.rest_in_body.R * node.origin + part.rest_in_body.p;
        bool known = false;
        for (size_t other = before; other < body.nodes.size() && !known; ++other)
          known = (body.nodes[other].origin - origin).norm() <= 1e-9 * reach;
        if (known) continue;
        body.nodes.push_back({piece == 0 ? node.name : fmt::format("{}:{}", piece, node.name), origin});
        chosen.push_back(static_cast<int>(k));
      }
      if (!chosen.empty()) pieces_.push_back({static_cast<int>(b), at, 3 * static_cast<Eigen::Index>(here), NodePaths(part, chosen)});
      if (const auto* modal = std::get_if<ModalDef>(&def.kind); modal && !chosen.empty()) set_node_shapes(part.body, chosen, body);
      before = here;
    }
    body.node_shear = node_shear(model, def, body);
    body.displacement = RowsX::Zero(nt, 3 * static_cast<Eigen::Index>(body.nodes.size()));
    body.rotation = RowsX::Zero(nt, 3 * static_cast<Eigen::Index>(body.nodes.size()));
    body.q = body.qd = RowsX::Zero(nt, n);
    results_.bodies.push_back(std::move(body));
    first_parts_.push_back(first_piece(model, static_cast<int>(b)));
    ResultBody& added = results_.bodies.back();
    set_section_strains(model, system.scene, static_cast<int>(b), added);
    if (added.node_phi.size() > 0 && plans_.shown[b].kind != ShownFrom::body && plans_.shown[b].kind != ShownFrom::boundary) {
      added.held_position = added.held_rotation = Eigen::MatrixX3d::Zero(nt, 3);
      added.shown_columns = shown_columns(model, static_cast<int>(b), plans_.shown[b]);
    }
  }
  // Of the scene's joints: the part behind each in the tree, or the loop that it closes.
  std::vector<const Part*> in_tree(system.scene.joints.size());
  std::vector<const LoopJoint*> in_loops(system.scene.joints.size());
  for (const Part& p : model.parts)
    if (p.joint.scene_joint >= 0) in_tree[static_cast<size_t>(p.joint.scene_joint)] = &p;
  for (const LoopJoint& l : model.loops)
    if (l.scene_joint >= 0) in_loops[static_cast<size_t>(l.scene_joint)] = &l;
  for (size_t k = 0; k < system.scene.joints.size(); ++k) {
    const JointDef& def = system.scene.joints[k];
    ResultJoint joint;
    joint.name = def.name;
    joint.kind = traits(def.kind).word;
    joint.position = Eigen::MatrixX3d::Zero(nt, 3);
    joint.orientation = Eigen::MatrixX4d::Zero(nt, 4);
    const Part* const part = in_tree[k];
    int frame = -1;
    if (part) frame = part->joint.reversed ? part->joint.outboard : part->joint.inboard;
    if (in_loops[k]) frame = in_loops[k]->a;
    joint_frames_.push_back(frame);
    joint.value = MatX::Zero(nt, part ? part->joint.nq : 0);
    joint.rate = MatX::Zero(nt, part ? part->joint.nv : 0);
    results_.joints.push_back(std::move(joint));
  }
  if (system.scene.colored_by_stress) {
    loads_.emplace(model, system.scene, results_.bodies);
    if (loads_->empty()) loads_.reset();
    else loads_->size(nt, results_.bodies);
  }
  needs_ = SampleNeeds(system, plans_, loads_.has_value());
  needs_.moving = true;  // energies and rates are kept
  results_.kinetic = results_.strain = results_.potential = results_.supplied = results_.dissipated = VecX::Zero(nt);
  table_ = MatX::Zero(static_cast<Eigen::Index>(plans_.columns.size()), nt);

  translation_.resize(results_.bodies.size());
  rotation_.resize(results_.bodies.size());
  shown_.resize(results_.bodies.size());
  world_.resize(results_.bodies.size());
  grow_work(system);
}

void Recorder::record(System& system, double t, const VecX& y) {
  const Model& model = system.model;
  Work& work = system.work;
  const Energy e = bring(system, t, y, needs_, reactions_);
  const Eigen::Index row = row_++;
  if (loads_) loads_->record(model, work, reactions_, row, results_.bodies);
  for (size_t b = 0; b < results_.bodies.size(); ++b) {
    ResultBody& body = results_.bodies[b];
    const int first = first_parts_[b];
    shown_[b] = shown_pose(model, static_cast<int>(b), plans_.shown[b], work, true);
    world_[b] = compose(work.parts[first].world, shown_[b]);
    if (body.held_position.size() > 0) {
      const Pose held = inverse(shown_[b]);
      body.held_position.row(row) = held.p.transpose();
      body.held_rotation.row(row) = rotation_log(held.R).transpose();
    }
    body.position.row(row) = world_[b].p.transpose();
    write_quaternion(world_[b].R, body.orientation, row);
    translation_[b] = body.displacement.row(row).data();
    rotation_[b] = body.rotation.row(row).data();
    body_coordinates(model, static_cast<int>(b), work.q, false, body.q.row(row).data());
    body_coordinates(model, static_cast<int>(b), work.w, true, body.qd.row(row).data());
  }
  for (Piece& piece : pieces_) {
    const size_t b = piece.body;
    // Without a chain everything stays in the part, so that small displacements keep their digits far from the origin.
    const bool alone = model.parts[piece.part].piece == 0;
    const Pose shown = alone ? inverse(shown_[b]) : compose(inverse(world_[b]), work.parts[piece.part].world);
    piece.nodes.evaluate(work.parts[piece.part].q, shown, translation_[b] + piece.first, rotation_[b] + piece.first);
  }
  for (size_t k = 0; k < results_.joints.size(); ++k) {
    ResultJoint& joint = results_.joints[k];
    if (joint_frames_[k] < 0) continue;
    const Pose pose = frame_world(model, work, joint_frames_[k]);
    joint.position.row(row) = pose.p.transpose();
    write_quaternion(pose.R, joint.orientation, row);
  }
  for (const Part& p : model.parts) {
    if (p.joint.scene_joint < 0) continue;
    ResultJoint& joint = results_.joints[p.joint.scene_joint];
    joint.value.row(row) = work.q.segment(p.q0, p.joint.nq).transpose();
    joint.rate.row(row) = work.w.segment(p.v0, p.joint.nv).transpose();
  }
  raise_scales(system, e, plans_.reactions, reactions_, results_.scales);
  results_.kinetic[row] = e.kinetic;
  results_.strain[row] = e.strain;
  results_.potential[row] = e.potential;
  if (system.quadrature) {
    results_.supplied[row] = y[y.size() - 2];
    results_.dissipated[row] = y[y.size() - 1];
  }
  evaluate_outputs(
      model, plans_, work, reactions_,
      {.previous = row > 0 ? table_.col(row - 1).data() : nullptr, .columns = table_.col(row).data(), .energy = &e, .placed = true});
}

Results Recorder::finish(const System&) {
  for (size_t k = 0; k < plans_.columns.size(); ++k)
    results_.outputs.push_back({plans_.columns[k], plans_.units[k], table_.row(static_cast<Eigen::Index>(k)).transpose(),
                                plans_.descriptions[k], plans_.sizes[k]});
  return std::move(results_);
}

HistoryRecorder::HistoryRecorder(System& system, const std::vector<double>& times, const std::vector<bool>& read)
    : plans_(plan_outputs(system.model, system.scene, false, read)) {
  histories_.times = Eigen::Map<const VecX>(times.data(), static_cast<Eigen::Index>(times.size()));
  histories_.columns = plans_.columns;
  histories_.units = plans_.units;
  if (std::any_of(plans_.sizes.begin(), plans_.sizes.end(), [](double size) { return size != 0.0; }))
    histories_.sizes = Eigen::Map<const VecX>(plans_.sizes.data(), static_cast<Eigen::Index>(plans_.sizes.size()));
  histories_.values = MatX::Zero(static_cast<Eigen::Index>(plans_.columns.size()), histories_.times.size());
  needs_ = SampleNeeds(system, plans_);
  grow_work(system);
  if (!needs_.in_plane || needs_.moving) return;
  std::vector<int> frames = plans_.places;
  for (const Load& load : system.model.loads)  // bushings are looked at beside (left_ranges.h)
    if (load.def.kind == ForceKind::bushing) frames.insert(frames.end(), {load.on, load.from});
  if (FourPlaces::fit(system.model, *system.plane, frames))
    places_ = std::make_unique<FourPlaces>(system.model, system.work, *system.plane, frames);
}

void HistoryRecorder::record(System& system, double t, const VecX& y) { write_row(system, bring(system, t, y, needs_, reactions_)); }

bool HistoryRecorder::place_four(System& system, const double* times, const MatX& states) {
  return place_four_samples(system, times, states, *places_);
}

void HistoryRecorder::record_lane(System& system, double t, int lane) {
  bring_sample(system, t, *places_, lane);
  write_row(system, {});
}

void HistoryRecorder::write_row(System& system, const Energy& e) {
  const Eigen::Index row = row_++;
  MatX& table = histories_.values;
  evaluate_outputs(
      system.model, plans_, system.work, reactions_,
      {.previous = row > 0 ? table.col(row - 1).data() : nullptr, .columns = table.col(row).data(), .energy = &e, .placed = true});
  histories_.energy_scale = std::max({histories_.energy_scale, e.kinetic, e.strain});
  raise_scales(system, e, plans_.reactions, reactions_, histories_.scales);
}

CurrentOutputs::CurrentOutputs(System& system) : plans_(plan_outputs(system.model, system.scene)), needs_(system, plans_) {
  grow_work(system);
}

void CurrentOutputs::evaluate(System& system, double t, const VecX& y, VecX& row) {
  if (plans_.columns.empty()) return;
  const Energy e = bring(system, t, y, needs_, reactions_);
  const VecX before = row;
  row.resize(static_cast<Eigen::Index>(plans_.columns.size()));
  evaluate_outputs(system.model, plans_, system.work, reactions_,
                   {.previous = before.size() > 0 ? before.data() : nullptr, .columns = row.data(), .energy = &e, .placed = true});
}

}  // namespace flexframe::sim
