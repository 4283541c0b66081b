#include "sim/run/left_out.h"

#include "sim/bodies/normal_modes.h"
#include "sim/dynamics/contacts.h"
#include "sim/dynamics/directions.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/kinematics.h"
#include "sim/model/bodies.h"
#include "sim/results/histories.h"
#include "sim/results/series.h"
#include "sim/scene/force_kinds.h"
#include "sim/start/statics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace flexframe::sim {
namespace {

// More effects than these of single beams are weighed together, an effect of all of them.
constexpr size_t weighed_alone = 16;
// Looks at a run: a harmonic of a tenth of it is seen ten times.
constexpr size_t wanted_looks = 100;
// Looks at the mechanism's vibrations are dearer: one in so many.
constexpr size_t looks_a_vibration_look = 10;
// A Timoshenko factor where the section gives none: that of a rectangle.
constexpr double usual_shear_factor = 5.0 / 6.0;

const BeamDef& beam_of(const Scene& scene, int body) { return std::get<BeamDef>(scene.bodies[body].kind); }

// Strains [e gy gz kx ky kz] that the section forces [N Vy Vz T My Mz] make and a beam without the effect lacks; a bending direction that
// the beam has too is coupled to the other by Iyz.
Vec6 missing_strain(const BeamDef& beam, std::string_view effect, bool other_bends, const Vec6& F) {
  const Section& s = beam.section;
  const double E = beam.material.youngs_modulus, G = 0.5 * E / (1.0 + beam.material.poisson);
  Vec6 out = Vec6::Zero();
  if (effect == "axial") {
    out[0] = F[0] / (E * s.area);
  } else if (effect == "shear") {
    const double across = other_bends ? s.shear_yz / (G * s.area) : 0.0;
    out[1] = F[1] / ((s.shear_y > 0.0 ? s.shear_y : usual_shear_factor) * G * s.area) + across * F[2];
    out[2] = F[2] / ((s.shear_z > 0.0 ? s.shear_z : usual_shear_factor) * G * s.area) + across * F[1];
  } else if (effect == "torsion") {
    out[3] = F[3] / (G * s.j);
  } else {
    const bool xy = effect == "bending_xy";
    // Mz = E (Iz kz - Iyz ky), My = E (Iy ky - Iyz kz).
    const double det = s.iy * s.iz - s.iyz * s.iyz;
    const double ky = other_bends || !xy ? (other_bends ? (s.iz * F[4] + s.iyz * F[5]) / (E * det) : F[4] / (E * s.iy)) : 0.0;
    const double kz = other_bends || xy ? (other_bends ? (s.iy * F[5] + s.iyz * F[4]) / (E * det) : F[5] / (E * s.iz)) : 0.0;
    out[4] = ky - (other_bends && xy ? F[4] / (E * s.iy) : 0.0);
    out[5] = kz - (other_bends && !xy ? F[5] / (E * s.iz) : 0.0);
  }
  return out;
}

// Which of [N Vy Vz T My Mz] makes the effect's strain.
std::vector<int> makers(std::string_view effect) {
  if (effect == "axial") return {0};
  if (effect == "shear") return {1, 2};
  if (effect == "torsion") return {3};
  if (is_of_second_order(effect)) return {4, 5};
  return {effect == "bending_xy" ? 5 : 4};
}

// What is evaluated for an output, and how many times that is differentiated.
Quantity place_of(Quantity q, int& order) {
  order = 0;
  switch (q) {
    case Quantity::velocity:
      order = 1;
      return Quantity::position;
    case Quantity::acceleration:
      order = 2;
      return Quantity::position;
    case Quantity::angular_velocity:
      order = 1;
      return Quantity::rotation;
    case Quantity::rate:
      order = 1;
      return Quantity::value;
    case Quantity::distance_rate:
      order = 1;
      return Quantity::distance;
    default:
      return q;
  }
}

bool evaluated(Quantity q) {
  return q == Quantity::position || q == Quantity::rotation || q == Quantity::displacement || q == Quantity::value ||
         q == Quantity::distance;
}

// A load that comes with more than that share of its largest value strikes.
constexpr double at_once = 0.05;

// Whether a load jumps by more than `least` at one of its switches.
bool jumps(const TimeFunction& expression, const std::vector<double>& switches, double least) {
  TimeFunction f = expression;
  f.unfreeze();
  constexpr size_t most_looked_at = 100;
  for (size_t k = 0; k < switches.size() && k < most_looked_at; ++k) {
    const double beside = 1e-9 * std::max(switches[k], 1e-300);
    try {
      if (std::abs(f.jet(switches[k] + beside).value - f.jet(switches[k] - beside).value) > least) return true;
    } catch (const SimulationError&) {
      return false;  // what is no number is the run's affair
    }
  }
  return false;
}

// What the springs of joints' stops store, J.
double stop_energy(const System& system) {
  double e = 0.0;
  for (const int i : system.stops) {
    const Part& part = system.model.parts[i];
    const Stop& s = *part.joint.stop;
    const double q = system.work.q[part.q0];
    const double depth = std::max({0.0, s.lower ? *s.lower - q : 0.0, s.upper ? q - *s.upper : 0.0});
    e += 0.5 * s.stiffness * depth * depth;
  }
  return e;
}

bool on(const std::vector<EffectState>& states, const std::string& owner, std::string_view effect) {
  return std::any_of(states.begin(), states.end(), [&](const EffectState& s) { return s.owner == owner && s.effect == effect && s.on; });
}

}  // namespace

LeftOut::LeftOut(const System& system, const std::vector<EffectState>& states, bool pictures)
    : pictures_(pictures), softened_(system.softened), scene_(system.scene), model_(), sections_(Model{}, Scene{}) {
  for (const EffectState& s : states) {
    if (s.on || s.body < 0 || !std::holds_alternative<BeamDef>(scene_.bodies[s.body].kind)) continue;
    const bool shear = s.effect == "shear", bends = on(states, s.owner, "bending_xy") || on(states, s.owner, "bending_xz");
    if (s.effect == "damping" || s.effect == "large_bending") continue;  // the latter: linear_limit.h
    if (!shear && !s.possible) continue;
    Item item;
    item.effect = s.effect;
    item.bodies = {s.body};
    item.possible = s.possible;
    item.only_turning = shear && !bends;
    items_.push_back(item);
  }
  if (items_.size() > weighed_alone) {
    std::vector<Item> together;
    for (const Item& item : items_) {
      const auto at = std::find_if(together.begin(), together.end(), [&](const Item& t) {
        return t.effect == item.effect && t.possible == item.possible && t.only_turning == item.only_turning;
      });
      if (at == together.end()) together.push_back(item);
      else at->bodies.push_back(item.bodies.front());
    }
    items_ = together;
  }
  if (items_.empty()) return;

  model_ = system.model;
  std::vector<OutputDef> outputs;
  const OutputPlans real = plan_outputs(model_, scene_);
  columns_.resize(real.columns.size());
  int row = 0;
  for (const OutputPlan& plan : real.outputs) {
    int order = 0;
    OutputDef def = plan.def;
    def.quantity = place_of(def.quantity, order);
    for (int k = 0; k < plan.count; ++k)
      columns_[plan.first + k] = {plan.def.quantity, evaluated(def.quantity) ? row + k : -1, order, plan.body};
    if (!evaluated(def.quantity)) continue;
    outputs.push_back(def);
    row += plan.count;
  }
  scene_.outputs = outputs;
  plans_ = plan_outputs(model_, scene_);
  work_ = make_work(model_);
  work_.carrying.fixed.assign(model_.parts.size(), Carrying::moving);  // frames of sections are displaced
  sections_ = SectionForces(model_, scene_);
}

std::vector<size_t> LeftOut::looks(const System& system, const std::vector<double>& times) {
  std::vector<size_t> out;
  const size_t n = times.size(), stride = std::max<size_t>(1, n / wanted_looks);
  for (size_t i = 0; i < n; i += stride) out.push_back(i);
  out.push_back(n - 1);
  // Where a load or a motion is largest, and on both sides of its switches.
  for (size_t e = 0; e < system.model.expressions.size(); ++e) {
    const TimeFunction& expression = system.model.expressions[e];
    const bool motion = std::any_of(system.model.parts.begin(), system.model.parts.end(),
                                    [&](const Part& p) { return p.joint.motion == static_cast<int>(e); });
    TimeFunction f = expression;
    f.unfreeze();
    double most = -1.0, first = 0.0;
    size_t at = 0;
    for (size_t i = 0; i < n; i += std::max<size_t>(1, n / 2000)) {
      try {
        const TimeJet jet = f.jet(times[i]);
        const double size = motion ? std::abs(jet.acceleration) : std::abs(jet.value);
        if (size > most) most = size, at = i;
        if (i == 0) first = size;
      } catch (const SimulationError&) {
        break;  // what is no number is the run's affair
      }
    }
    out.push_back(at);
    const std::vector<double> switches = expression.switch_times(0.0, system.model.settings.duration);
    struck_ = struck_ || (!motion && most > 0.0 &&
                          ((first > at_once * most && !wants_statics(system.scene)) || jumps(expression, switches, at_once * most)));
    switches_.insert(switches_.end(), switches.begin(), switches.end());
    for (size_t k = 0; k < switches.size() && k < wanted_looks; ++k) {
      const size_t after = std::upper_bound(times.begin(), times.end(), switches[k]) - times.begin();
      for (size_t i = after > 0 ? after - 1 : 0; i <= after && i < n; ++i) out.push_back(i);
    }
  }
  std::sort(switches_.begin(), switches_.end());
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

namespace {

// Forces that a beam without the effect does not know, of second order: what acts along it beside its deflected axis (stiffening), or its
// inertia forces as the deformation moves and turns them (gyroscopic); [N My Mz] at every section, of what acts outboard of it.
struct Unknown {
  std::vector<Vec3> force;  // N My Mz
  double potential = 0.0;   // 1/2 of their work on the deflection, J; positive where they bend the beam further
};

Unknown forces_beside_axis(const CutBeam& beam) {
  Unknown out;
  const size_t n = beam.x.size();
  out.force.assign(n, Vec3::Zero());
  for (size_t k = n - 1; k > 0; --k) {
    const Vec3 l = beam.turn(k - 1, 0), r = beam.turn(k, 0);  // theta, -w', v'
    const double dx = beam.x[k] - beam.x[k - 1], N0 = beam.left[k - 1][0], N1 = beam.right[k - 1][0];
    out.force[k - 1] = out.force[k];
    out.force[k - 1][1] -= 0.5 * dx * (l.y() * N0 + r.y() * N1);
    out.force[k - 1][2] -= 0.5 * dx * (l.z() * N0 + r.z() * N1);
    out.potential -= 0.25 * dx * (N0 * l.tail<2>().squaredNorm() + N1 * r.tail<2>().squaredNorm());
  }
  return out;
}

// Centrifugal and Coriolis forces and those of turning, which work on the coordinates where the inertia follows the deformation.
Unknown inertia_of_deformation(const CutBeam& beam, const PartWork& part) {
  Unknown out;
  const size_t n = beam.x.size();
  out.force.assign(n, Vec3::Zero());
  const Vec3 w = part.V.tail<3>(), turning = part.A.tail<3>();
  const auto along = [&](size_t k) {
    const Vec3 d = beam.place[k] - Vec3(beam.x[k], 0.0, 0.0);
    return Vec3(-beam.mass_per_length * (w.cross(Vec3(w.cross(beam.place[k]))) + 2.0 * w.cross(beam.shift(k, 1)) + turning.cross(d)));
  };
  Vec3 f = Vec3::Zero(), m = Vec3::Zero(), right = along(n - 1);
  for (size_t k = n - 1; k > 0; --k) {
    const double dx = beam.x[k] - beam.x[k - 1];
    const Vec3 arm = beam.place[k] - beam.place[k - 1], left = along(k - 1);
    m += arm.cross(f) + arm.cross(Vec3(dx * (left / 6.0 + right / 3.0)));
    f += 0.5 * dx * (left + right);
    out.force[k - 1] = {f.x(), m.y(), m.z()};
    out.potential += 0.25 * dx * (left.tail<2>().dot(beam.shift(k - 1, 0).tail<2>()) + right.tail<2>().dot(beam.shift(k, 0).tail<2>()));
    right = left;
  }
  return out;
}

}  // namespace

// At both ends of every interval of a beam, what the item's effect would strain it by.
void LeftOut::strains_of_second_order(const System& system, const CutBeam& beam, Item& item, std::vector<Strained>& out) const {
  const PartWork& part = system.work.parts[beam.part];
  const BeamDef& def = beam_of(scene_, beam.body);
  const std::string& name = scene_.bodies[beam.body].name;
  const bool stiffening = item.effect == "stiffening";
  out.assign(2 * (beam.x.size() - 1), {});
  if (part.q.size() == 0) return;
  const Unknown unknown = stiffening ? forces_beside_axis(beam) : inertia_of_deformation(beam, part);
  // What is bent further is loaded further: the linear answer over 1 - P/Pcr.
  const double stored = strain_energy(model_.parts[beam.part].body, part.q);
  const double share = stored > 0.0 ? unknown.potential / stored : 0.0, further = 1.0 / (1.0 - std::min(share, 0.9));
  item.slowing.back() += std::abs(unknown.potential);
  const double E = def.material.youngs_modulus;
  const bool xy = on(model_.effects, name, "bending_xy"), xz = on(model_.effects, name, "bending_xz"),
             along = !stiffening && on(model_.effects, name, "axial");
  for (size_t k = 0; k < out.size(); ++k) {
    const size_t at = (k + 1) / 2;
    const Vec3 F = further * unknown.force[at];
    out[k].force << (along ? F[0] : 0.0), 0.0, 0.0, 0.0, (xz ? F[1] : 0.0), (xy ? F[2] : 0.0);
    out[k].strain << out[k].force[0] / (E * def.section.area), 0.0, 0.0, 0.0, out[k].force[4] / (E * def.section.iy),
        out[k].force[5] / (E * def.section.iz);
    // What the deflection shortens.
    if (stiffening) out[k].strain[0] -= 0.5 * beam.turn(at, 0).tail<2>().squaredNorm();
  }
  if (stiffening && on(model_.effects, name, "torsion")) item.slowing.back() += std::abs(untwist(beam, out));
}

// Energy of strains and forces that are straight between the ends of an interval, J.
double LeftOut::energy_between(const Strained& left, const Strained& right, double dx) {
  return dx / 6.0 *
         (left.strain.dot(left.force) + right.strain.dot(right.force) +
          0.5 * (left.strain.dot(right.force) + right.strain.dot(left.force)));
}

// Strains of first order at both ends of every interval of a beam that lacks them, by the forces there.
void LeftOut::strains_of_first_order(int body, const BothEnds& forces, const Item& item, std::vector<Strained>& out) const {
  const char* other = item.effect == "bending_xy" ? "bending_xz" : item.effect == "bending_xz" ? "bending_xy" : "";
  const bool other_bends = on(model_.effects, scene_.bodies[body].name, other);
  const BeamDef& def = beam_of(scene_, body);
  out.clear();
  for (size_t k = 0; k < forces[0].size(); ++k)
    for (const Vec6& F : {forces[0][k], forces[1][k]})
      out.push_back({item.only_turning ? Vec6(Vec6::Zero()) : missing_strain(def, item.effect, other_bends, F), F});
}

LeftOut::Moved LeftOut::strained(const System& system, Item& item) const {
  Moved out(sections_.beams().size());
  double energy = 0.0, pull = 0.0;
  const bool second_order = is_of_second_order(item.effect);
  const std::vector<int> forces = makers(item.effect);
  std::vector<Strained> at;
  item.slowing.push_back(0.0);
  for (size_t b = 0; b < out.size(); ++b) {
    const CutBeam& beam = sections_.beams()[b];
    if (std::find(item.bodies.begin(), item.bodies.end(), beam.body) == item.bodies.end()) continue;
    if (second_order) strains_of_second_order(system, beam, item, at);
    else strains_of_first_order(beam.body, {beam.left, beam.right}, item, at);
    if (item.effect == "shear" && !item.only_turning && beam_of(scene_, beam.body).model == BeamModel::lumped)
      item.slowing.back() += std::abs(untwist(beam, at));
    std::vector<Vec6>& moved = out[b];
    moved.assign(beam.x.size(), Vec6::Zero());
    for (size_t k = 0; k + 1 < beam.x.size(); ++k) {
      const double dx = beam.x[k + 1] - beam.x[k];
      const Strained &left = at[2 * k], &right = at[2 * k + 1];
      const Vec6 mean = 0.5 * dx * (left.strain + right.strain);
      energy += energy_between(left, right, dx);
      const Vec3 arm = beam.place[k + 1] - beam.place[k], turn = beam.axes[k] * mean.tail<3>(), before = moved[k].tail<3>();
      moved[k + 1].head<3>() = moved[k].head<3>() + before.cross(arm) + beam.axes[k] * mean.head<3>() + 0.5 * turn.cross(arm);
      moved[k + 1].tail<3>() = before + turn;
      item.reach = std::max(item.reach, moved[k + 1].head<3>().norm());
      for (const int f : forces) {
        const double size = std::max(std::abs(left.force[f]), std::abs(right.force[f]));
        pull += 0.5 * dx * (left.force[f] + right.force[f]);
        if (f < 3) item.force = std::max(item.force, size);
        else item.moment = std::max(item.moment, size);
        // What goes with it: Mz with Vy, My with Vz.
        if (f >= 4) item.force = std::max({item.force, std::abs(beam.left[k][6 - f]), std::abs(beam.right[k][6 - f])});
        if (f == 1 || f == 2) item.moment = std::max({item.moment, std::abs(beam.left[k][6 - f]), std::abs(beam.right[k][6 - f])});
      }
    }
  }
  item.energy.push_back(energy);
  item.pull.push_back(pull);
  return out;
}

void LeftOut::set_offset(int frame, const Pose& offset) {
  FramePoint& f = model_.frames[frame];
  f.offset = offset;
  if (f.node >= 0) work_.frames[frame].rest_axes = (model_.parts[f.part].body.nodes[f.node].rotation * offset.R).transpose();
}

void LeftOut::displace_frames(const Moved& moved) {
  for (size_t f = 0; f < model_.frames.size(); ++f) {
    const auto [b, k] = sections_.at(static_cast<int>(f));
    if (b < 0 || moved[b].empty()) continue;
    const Vec6& d = moved[b][k];
    const Pose node = compose(pose_[f], inverse(offset_[f]));
    const Mat3 turn = rotation_exp(d.tail<3>());
    const Pose now{turn * pose_[f].R, node.p + d.head<3>() + turn * (pose_[f].p - node.p)};
    set_offset(static_cast<int>(f), compose(inverse(node), now));
    work_.frames[f].pose = now;
  }
}

void LeftOut::restore_frames() {
  for (size_t f = 0; f < model_.frames.size(); ++f) {
    if (sections_.at(static_cast<int>(f))[0] < 0) continue;
    set_offset(static_cast<int>(f), offset_[f]);
    if (!work_.frames[f].flexible) work_.frames[f].pose = pose_[f];
  }
}

bool LeftOut::assemble(const System& system) {
  work_.q = system.work.q;
  work_.w = system.work.w;
  work_.motion = system.work.motion;
  work_.time = system.work.time;
  work_.expression_value = system.work.expression_value;
  work_.signals = system.work.signals;
  work_.clusters = system.work.clusters;
  try {
    update_positions(model_, work_, false);
  } catch (const SimulationError&) {
    return false;
  }
  return true;
}

VecX LeftOut::outputs(const double* previous) {
  VecX row = VecX::Zero(static_cast<Eigen::Index>(plans_.columns.size()));
  evaluate_outputs(model_, plans_, work_, reactions_, {.previous = previous, .columns = row.data()});
  // Deflections are told from the undeformed body, to which what the frame has moved within it belongs now.
  for (const OutputPlan& plan : plans_.outputs) {
    if (plan.def.quantity != Quantity::displacement || sections_.at(plan.frame)[0] < 0) continue;
    const FramePoint& f = model_.frames[plan.frame];
    const Part& part = model_.parts[f.part];
    const Mat3 axes = f.node < 0 ? Mat3(Mat3::Identity()) : part.body.nodes[f.node].rotation;
    row.segment<3>(plan.first) += part.rest_in_body.R * axes * (f.offset.p - offset_[plan.frame].p);
  }
  return row;
}

double LeftOut::moved_mass(const System& system, const Item* item, const Moved& moved) const {
  double sum = 0.0;
  for (size_t i = 0; i < model_.parts.size(); ++i) {
    const Pose rel = compose(inverse(system.work.parts[i].world), work_.parts[i].world);
    Vec6 d;
    d << rel.p, rotation_log(rel.R);
    const CutBeam* beam = nullptr;
    const std::vector<Vec6>* places = nullptr;
    for (size_t b = 0; item && b < moved.size(); ++b)
      if (sections_.beams()[b].part == static_cast<int>(i) && !moved[b].empty()) beam = &sections_.beams()[b], places = &moved[b];
    if (!beam) {
      sum += d.dot(system.work.parts[i].terms.Mrr * d);
      continue;
    }
    const auto square = [&](size_t k) {
      const Vec6& m = (*places)[k];
      const Vec3 at = d.head<3>() + d.tail<3>().cross(beam->place[k]) + m.head<3>();
      const double turn = d[3] + m[3];
      return beam->mass_per_length * at.squaredNorm() + beam->rotary(0, 0) * turn * turn;
    };
    for (size_t k = 0; k + 1 < beam->x.size(); ++k) sum += 0.5 * (beam->x[k + 1] - beam->x[k]) * (square(k) + square(k + 1));
  }
  return sum;
}

void LeftOut::follow(const System& system, Item& item, const VecX& rest) {
  const Moved moved = strained(system, item);
  displace_frames(moved);
  VecX change = VecX::Zero(rest.size());
  double mass = 0.0;
  if (assemble(system)) {
    change = outputs(rest.data()) - rest;
    mass = moved_mass(system, &item, moved);
  } else {
    item.failed = true;
  }
  item.change.push_back(change);
  item.mass.push_back(mass);
  restore_frames();
}

void LeftOut::follow_axis(const System& system, Item& item) const {
  if (!item.effect.starts_with("bending")) return;
  for (const CutBeam& beam : sections_.beams()) {
    const BeamDef& def = beam_of(scene_, beam.body);
    const double first = def.chosen.first_bending;
    if (!(first > 0.0) || std::find(item.bodies.begin(), item.bodies.end(), beam.body) == item.bodies.end()) continue;
    double pressed = 0.0, twisted = 0.0;
    for (size_t k = 0; k + 1 < beam.x.size(); ++k)
      for (const Vec6& F : {beam.left[k], beam.right[k]}) pressed = std::max(pressed, -F[0]), twisted = std::max(twisted, std::abs(F[3]));
    const Section& s = def.section;
    const double EI = def.material.youngs_modulus * std::min(s.iy, s.iz), length = model_.size;
    const double spin = system.work.parts[static_cast<size_t>(beam.part)].V.tail<3>().norm();
    item.critical =
        std::max(item.critical, std::pow(spin / first, 2) + 4.0 * pressed * length * length / (std::pow(std::numbers::pi, 2) * EI) +
                                    twisted * length / (std::numbers::pi * EI));
  }
}

// What the deformation of the motion moves: the mechanism without it, its joints as they are.
void LeftOut::follow_deformation(const System& system) {
  const Energy energy = compute_energy(system.model, system.work);
  strain_.push_back(energy.strain);
  kinetic_.push_back(energy.kinetic);
  bent_mass_.push_back(0.0);
  // Nothing has coordinates of its own: what is left would be rounding.
  if (work_.carrying.deforming.empty()) return;
  work_.q = system.work.q;
  for (const Part& p : model_.parts) work_.q.segment(p.eq0, p.body.n).setZero();
  work_.clusters = system.work.clusters;
  double mass = 0.0;
  try {
    update_positions(model_, work_, false);
    mass = moved_mass(system, nullptr, {});
    for (size_t i = 0; i < model_.parts.size(); ++i)
      if (const VecX& q = system.work.parts[i].q; q.size() > 0) mass += q.dot(model_.parts[i].body.Me * q);
  } catch (const SimulationError&) {}
  bent_mass_.back() = mass;
}

void LeftOut::look(System& system, double t, const VecX& y) {
  if (items_.empty()) return;
  try {
    update_system_accelerations(system);
    update_massless_accelerations(system, t, y);
    compute_reactions(system.model, system.work, reactions_);
  } catch (const SimulationError&) {
    return;
  }
  sections_.evaluate(system.model, system.work, reactions_);
  if (!assemble(system)) return;
  // On which side of a switch of the loads the look before was.
  const auto before = [&](double at) { return std::lower_bound(switches_.begin(), switches_.end(), at) - switches_.begin(); };
  sudden_.push_back(!times_.empty() && before(t) != before(times_.back()));
  times_.push_back(t);
  pressed_.push_back(contact_energy(system.model, system.work) + stop_energy(system));
  offset_.resize(model_.frames.size());
  pose_.resize(model_.frames.size());
  for (size_t f = 0; f < model_.frames.size(); ++f) {
    update_frame_pose(model_, static_cast<int>(f), work_);
    offset_[f] = model_.frames[f].offset;
    pose_[f] = work_.frames[f].pose;
  }
  const VecX rest = outputs(nullptr);
  if (times_.size() == 1) {
    const std::vector<Direction> free = independent_directions(system.model, system.work);
    free_ = std::any_of(free.begin(), free.end(), [](const Direction& d) { return d.rate >= 0; }) &&
            std::none_of(model_.parts.begin(), model_.parts.end(), [](const Part& p) { return p.joint.motion >= 0; });
  }
  for (Item& item : items_) follow(system, item, rest), follow_turning(system, item), follow_axis(system, item);
  follow_deformation(system);
  if (times_.size() % looks_a_vibration_look == 1) look_at_vibrations(system, t, y, rest);
}

double LeftOut::taken_of_blows(const Item& item) const {
  if (pressed_.empty() || is_of_second_order(item.effect) || item.energy.size() != pressed_.size()) return 0.0;
  const double most = *std::max_element(pressed_.begin(), pressed_.end());
  constexpr double beginning = 0.1;
  double before = std::numeric_limits<double>::infinity(), out = 0.0;
  // What strains the beams beside blows is no part of them.
  for (size_t k = 0; k < pressed_.size(); ++k)
    if (pressed_[k] == 0.0) before = before < item.energy[k] || !std::isfinite(before) ? item.energy[k] : before;
  for (size_t k = 0; k < pressed_.size(); ++k)
    if (most > 0.0 && pressed_[k] > beginning * most && item.energy[k] > before)
      out = std::max(out, (item.energy[k] - before) / (item.energy[k] - before + pressed_[k]));
  return out;
}

LeftOut::Response LeftOut::response(const Item& item, const std::vector<double>& s, bool from_rest) const {
  Response out;
  size_t top = 0;
  for (size_t k = 0; k < item.energy.size(); ++k)
    if (item.energy[k] > item.energy[top]) top = k;
  double most = 0.0;
  for (const double value : s) most = std::max(most, std::abs(value));
  out.size = most;
  // What moves no mass follows at once.
  if (most == 0.0 || !(item.mass[top] > 0.0)) return out;
  const double omega = std::sqrt(2.0 * item.energy[top] / item.mass[top]);
  // e = z - s vibrates; within an interval s is straight, or jumps at its end.
  double e = from_rest ? 0.0 : -s.front(), rate = 0.0;
  double over = std::abs(e);
  for (size_t k = 0; k + 1 < s.size(); ++k) {
    const double h = times_[k + 1] - times_[k], slope = sudden_[k + 1] || h <= 0.0 ? 0.0 : (s[k + 1] - s[k]) / h;
    const double e0 = e, f0 = (rate - slope) / omega, c = std::cos(omega * h), n = std::sin(omega * h), amplitude = std::hypot(e0, f0);
    e = e0 * c + f0 * n;
    rate = slope + omega * (f0 * c - e0 * n);
    if (sudden_[k + 1]) e -= s[k + 1] - s[k];
    const double after = std::hypot(e, (rate - slope) / omega);
    over = std::max({over, amplitude, after});
    out.size = std::max({out.size, std::max(std::abs(s[k]), std::abs(s[k + 1])) + std::max(amplitude, after)});
    out.rate = std::max(out.rate, std::abs(slope) + omega * std::max(amplitude, after));
  }
  out.acceleration = omega * omega * over;
  out.over = over / most;
  return out;
}

namespace {

// Share of the variance of b that goes with a: the square of their correlation.
double common_variance(const std::vector<double>& a, const std::vector<double>& b) {
  const auto n = static_cast<Eigen::Index>(a.size());
  const Eigen::ArrayXd x = Eigen::Map<const Eigen::ArrayXd>(a.data(), n), y = Eigen::Map<const Eigen::ArrayXd>(b.data(), n);
  const Eigen::ArrayXd dx = x - x.mean(), dy = y - y.mean();
  const double xx = dx.square().sum(), yy = dy.square().sum(), xy = (dx * dy).sum();
  return xx > 0.0 && yy > 0.0 ? xy * xy / (xx * yy) : 0.0;
}

// The same of what vibrates alone: in windows, without what goes slowly in each. A mechanism that turns carries a vibration along and
// across its bodies by turns, with either sign.
double common_vibration(const std::vector<double>& a, const std::vector<double>& b) {
  constexpr Eigen::Index window = 12, slow = 3;
  const auto n = static_cast<Eigen::Index>(a.size());
  // A constant, a slope and a curvature, orthonormal over the window.
  Eigen::Matrix<double, window, slow> Q;
  for (Eigen::Index k = 0; k < window; ++k) {
    const double u = static_cast<double>(k) - 0.5 * (window - 1);
    Q.row(k) << 1.0, u, u * u - (window * window - 1) / 12.0;
  }
  Q.colwise().normalize();
  double common = 0.0;
  for (Eigen::Index k = 0; k + window <= n; k += window) {
    Eigen::Matrix<double, window, 1> x = Eigen::Map<const Eigen::Matrix<double, window, 1>>(a.data() + k),
                                     y = Eigen::Map<const Eigen::Matrix<double, window, 1>>(b.data() + k);
    x -= Q * (Q.transpose() * x);
    y -= Q * (Q.transpose() * y);
    const double xx = x.squaredNorm(), yy = y.squaredNorm(), xy = x.dot(y);
    // Less what so few numbers have in common by chance.
    if (xx > 0.0 && yy > 0.0) common += std::max(0.0, xy * xy / yy - xx / static_cast<double>(window - slow));
  }
  const Eigen::ArrayXd all = Eigen::Map<const Eigen::ArrayXd>(a.data(), n);
  const double variance = (all - all.mean()).square().sum();
  return variance > 0.0 ? common / variance : 0.0;
}

// Largest |d - q| of d'' + omega^2 d = omega^2 q, d = q at first and its rate zero: by how much a deflection that were softer by as much as
// it is large would differ from the one that takes its place at once. Frequencies around omega, which is an estimate: the largest of all.
double lag(const VecX& times, const Eigen::Ref<const VecX>& q, double omega) {
  double most = 0.0;
  for (const double factor : {0.7, 0.85, 1.0, 1.2, 1.4}) {
    const double w = factor * omega;
    double e = 0.0, rate = 0.0, h = -1.0, c = 1.0, n = 0.0;
    if (!(w > 0.0)) break;
    for (Eigen::Index k = 0; k + 1 < times.size(); ++k) {
      if (const double step = times[k + 1] - times[k]; std::abs(step - h) > 1e-9 * step) h = step, c = std::cos(w * h), n = std::sin(w * h);
      if (h <= 0.0) continue;
      // q is straight within an interval.
      const double slope = (q[k + 1] - q[k]) / h, e0 = e, f0 = (rate - slope) / w;
      e = e0 * c + f0 * n;
      rate = slope + w * (f0 * c - e0 * n);
      most = std::max(most, std::abs(e));
    }
  }
  return most;
}

}  // namespace

LeftOut::Drifts LeftOut::drifts(const Item& item, const Results& results, Unseen& known) const {
  double left_out = 0.0, stored = 0.0, mean = 0.0, squares = 0.0;
  size_t top = 0;
  const bool second_order = is_of_second_order(item.effect);
  for (size_t k = 0; k < strain_.size(); ++k) {
    left_out += item.slowing[k] + (second_order ? 0.0 : item.energy[k]);
    stored += strain_[k];
    mean += item.pull[k], squares += item.pull[k] * item.pull[k];
    if (strain_[k] > strain_[top]) top = k;
  }
  Drifts out;
  if (!(stored > 0.0)) return out;
  // Shear and what is of second order go with bending; what else is left out slows a vibration down as far as its section forces change and
  // come from it. A hundred looks at random leave a tenth at most.
  const bool bends = item.effect == "shear" || second_order;
  const double changing = bends || squares == 0.0 ? 1.0 : 1.0 - mean * mean / (squares * static_cast<double>(strain_.size()));
  const double duration = results.times[results.times.size() - 1];
  const double omega = bent_mass_[top] > 0.0 ? std::sqrt(2.0 * strain_[top] / bent_mass_[top]) : 0.0, least = 0.4 * omega * duration;
  // Vibrations that die away are gone before they are farther out of phase.
  const double lasting = lasting_phase();
  std::vector<double> bent(times_.size(), 0.0);
  for (size_t b = 0; b < results.bodies.size(); ++b) {
    const ResultBody& body = results.bodies[b];
    Eigen::Index most = -1;
    double range = 0.0;
    const VecX ranges = column_ranges(body.displacement);
    for (Eigen::Index c = 0; c < ranges.size(); ++c)
      if (ranges[c] > range) range = ranges[c], most = c;
    if (most < 0) continue;
    const auto column = body.displacement.col(most);
    for (size_t k = 0, i = 0; k < times_.size(); ++k) {
      while (static_cast<Eigen::Index>(i) + 1 < results.times.size() && results.times[static_cast<Eigen::Index>(i)] < times_[k]) ++i;
      bent[k] = column[static_cast<Eigen::Index>(i)];
    }
    const double together = bends ? 1.0 : std::max(common_variance(item.pull, bent), common_vibration(item.pull, bent));
    if (together <= 0.1) continue;
    const double cycles = 0.5 * (column.tail(column.size() - 1) - column.head(column.size() - 1)).cwiseAbs().sum() / range,
                 passed = 2.0 * std::numbers::pi * cycles;
    // Deformation that follows its loads slowly keeps their phase; one that starts with them lags behind; what is too fast for the samples
    // goes through more than they show.
    if (!known.contains(b)) known[b] = unseen_swing(model_, static_cast<int>(b), results);
    const std::optional<UnseenSwing>& unseen = known[b];
    const double lost = std::max(passed < least ? 0.0 : 0.5 * std::min(passed, lasting), 2.0 * lag(results.times, column, omega) / range),
                 slowed = changing * together * left_out / stored, frequency = duration > 0.0 ? std::max(passed / duration, omega) : 0.0;
    const bool higher = struck_ && item.effect == "shear";
    const auto with_forms = [&](double first) { return std::min(1.0, first * (higher ? with_higher_forms(item, first) : 1.0)); };
    const double seen = with_forms(slowed * lost),
                 beyond = unseen ? with_forms(slowed * 0.5 * unseen->share * std::min(unseen->radians, lasting)) : 0.0;
    for (size_t order = 0; order < out.size(); ++order) {
      // Out of phase altogether, a vibration moves places by its share of the swing and no more, rates and accelerations by what its own
      // frequency makes of that: implicit steps leave fast ones behind that are nothing but 1e-4 of a swing through 1e5 radians.
      const double most_unseen = unseen && frequency > 0.0
                                     ? 2.0 * unseen->share * std::pow(unseen->radians / duration / frequency, static_cast<double>(order))
                                     : 1.0;
      const double here = std::max(seen, std::min(beyond, most_unseen));
      if (here * range > out[order].phase * out[order].deflection) out[order] = {here, range, frequency};
    }
  }
  return out;
}

// What comes at once excites all forms, the n-th by (w1/wn)^2 of the first, and shear slows them in proportion to their frequency: each of
// them is moved as far as the first, until it is out of phase altogether. Where the body is damped they die away before that.
double LeftOut::with_higher_forms(const Item& item, double phase) const {
  double most = 1.0;
  for (const Part& p : model_.parts) {
    if (std::find(item.bodies.begin(), item.bodies.end(), p.scene_body) == item.bodies.end() || p.body.n == 0 || p.body.De.size() > 0)
      continue;
    std::map<int, std::vector<double>> squares;  // of the frequencies in one direction, ascending
    for (int k = 0; k < p.body.n; ++k)
      if (const int direction = coordinate_direction(p.body, k); direction == 1 || direction == 2)
        squares[direction].push_back(p.body.Ke(k, k) / p.body.Me(k, k));
    for (auto& [direction, list] : squares) {
      std::sort(list.begin(), list.end());
      double sum = 0.0;
      for (const double square : list)
        if (list.front() > 0.0) sum += std::min(1.0, 2.0 * list.front() / (square * std::max(phase, 1e-12)));
      most = std::max(most, sum);
    }
  }
  return most;
}

double LeftOut::out_of_phase(const Drifts& drifts, const Column& column, const std::string& unit, double range) const {
  // The sum of all energies knows no phase; of strain and motion half of what the deformation stores goes from one to the other.
  if (column.quantity == Quantity::energy && column.body < 0) return 0.0;
  const bool angle = unit.starts_with("rad"), moves = angle || unit.starts_with("m");
  if (!moves) {
    // Forces and coordinates follow the vibration itself.
    const double share = unit == "J" ? std::min(0.5, 0.5 * *std::max_element(strain_.begin(), strain_.end()) / range) : 0.5;
    return drifts.back().phase * share;
  }
  double length = 1.0;
  if (angle) {
    length = std::numeric_limits<double>::infinity();
    for (const CutBeam& beam : sections_.beams()) length = std::min(length, beam_of(scene_, beam.body).length);
  }
  const Drift& drift = drifts[std::min(static_cast<size_t>(column.order), drifts.size() - 1)];
  return drift.phase * std::min(1.0, 0.5 * drift.deflection / length * std::pow(drift.frequency, column.order) / range);
}

bool LeftOut::has_unjudged_forces() const {
  // Reactions of a tree without springs, stops or contacts balance its loads, whatever gives way.
  const bool shared = !model_.loops.empty() || std::any_of(scene_.forces.begin(), scene_.forces.end(), [](const ForceDef& f) {
    return traits(f.kind).between || f.kind == ForceKind::user;
  }) || std::any_of(scene_.joints.begin(), scene_.joints.end(), [](const JointDef& j) { return j.stop.has_value(); });
  return std::any_of(columns_.begin(), columns_.end(), [&](const Column& column) {
    switch (column.quantity) {
      case Quantity::force:
      case Quantity::spring_force:
      case Quantity::stop_force:
        return true;
      case Quantity::reaction:
      case Quantity::section_force:
      case Quantity::stress:
        return shared;
      default:
        return false;
    }
  });
}

bool LeftOut::has_forces() const {
  return std::any_of(columns_.begin(), columns_.end(), [](const Column& column) {
    switch (column.quantity) {
      case Quantity::reaction:
      case Quantity::section_force:
      case Quantity::stress:
      case Quantity::force:
      case Quantity::power:
      case Quantity::work:
      case Quantity::kinetic:
      case Quantity::energy:
        return true;
      default:
        return false;
    }
  });
}

void LeftOut::compare_shown(const Item& item, double deformed, LeftOutWorth& found) const {
  constexpr double counts = 1.0 / 3.0, rounding = 1e-12;
  double length = 0.0;
  for (const int b : item.bodies) length = std::max(length, beam_of(scene_, b).length);
  const bool second_order = is_of_second_order(item.effect);
  if (second_order || item.reach <= rounding * length) return;
  found.reach = item.reach;
  found.shown = item.reach / std::max(item.reach, deformed);
  if (!pictures_ || found.shown < counts || found.shown <= found.share) return;
  found.share = found.shown;
  found.column = "the deformation that pictures show";
}

namespace {

// The place or angle that moves most, of its own size; else the first column.
std::string turns_most(const Histories& run, const VecX& ranges) {
  double most = 0.0;
  std::string out = run.columns.front();
  for (Eigen::Index c = 0; c < ranges.size(); ++c)
    if ((run.units[c] == "m" || run.units[c].starts_with("rad")) && ranges[c] > most) most = ranges[c], out = run.columns[c];
  return out;
}

}  // namespace

std::vector<LeftOutWorth> LeftOut::worth(const Results& results, bool from_rest) const {
  std::vector<LeftOutWorth> out;
  if (items_.empty() || times_.empty()) return out;
  const Histories run = to_histories(results);
  // Without loops, which close to some 1e-11 of the size, what stands still stands exactly.
  const VecX ranges = model_.loops.empty() && !from_rest ? output_ranges(run, run) : output_ranges(run);
  // Forces that are nothing but rounding of those inside the mechanism, at rest too.
  Histories moving = run;
  moving.scales.rests = false;
  const VecX rounding = rounding_of_outputs(moving);
  // What stands still has no range in time: places and deflections are then seen against the largest deflection, angles against the
  // largest turn of a section.
  std::map<std::string, double> deformed = {{"m", 0.0}, {"rad", 0.0}};
  for (const ResultBody& body : results.bodies) {
    if (body.displacement.size() > 0) deformed["m"] = std::max(deformed["m"], body.displacement.cwiseAbs().maxCoeff());
    if (body.rotation.size() > 0) deformed["rad"] = std::max(deformed["rad"], body.rotation.cwiseAbs().maxCoeff());
  }
  const double still = model_.loops.empty() ? 1e-13 : 1e-9;
  const auto sized = [&](size_t c) { return run.sizes.size() > 0 && run.sizes[static_cast<Eigen::Index>(c)] > 0.0; };
  const auto vector_of = [&](size_t c) { return run.columns[c].substr(0, run.columns[c].rfind('.')) + "\n" + run.units[c]; };
  std::map<std::string, double> largest, sizes;  // of a unit, of a vector
  for (size_t c = 0; c < columns_.size(); ++c) {
    const double most = run.values.row(static_cast<Eigen::Index>(c)).cwiseAbs().maxCoeff();
    for (double* size : {&largest[run.units[c]], &sizes[vector_of(c)]}) *size = std::max(*size, most);
  }
  const VecX swing = run.values.rowwise().maxCoeff() - run.values.rowwise().minCoeff();
  const bool unjudged = has_unjudged_forces();
  const double stored = std::accumulate(strain_.begin(), strain_.end(), 0.0);
  Unseen unseen;
  for (size_t i = 0; i < items_.size(); ++i) {
    const Item& item = items_[i];
    LeftOutWorth found;
    found.effect = item.effect;
    found.possible = item.possible;
    for (const int b : item.bodies) found.owners.push_back(scene_.bodies[b].name);
    const Drifts lost = drifts(item, results, unseen);
    const VecX slower = slowed_vibrations(i, results.times[results.times.size() - 1] - results.times[0]);
    const Response pulled = response(item, item.pull, from_rest);
    const double softened = is_of_second_order(item.effect) ? 1.0 : softened_;
    std::vector<double> error(columns_.size(), 0.0);
    std::map<std::string, double> size;
    std::vector<double> s(times_.size());
    for (size_t c = 0; c < columns_.size(); ++c) {
      const Column& column = columns_[c];
      const bool of_item = std::find(item.bodies.begin(), item.bodies.end(), column.body) != item.bodies.end();
      if (column.row >= 0) {
        for (size_t k = 0; k < s.size(); ++k) s[k] = item.change[k][column.row];
        const Response r = response(item, s, from_rest);
        error[c] = softened * (column.order == 0 ? r.size : column.order == 1 ? r.rate : r.acceleration);
      } else if (column.quantity == Quantity::reaction) {
        // A reaction follows the section forces that it supports.
        error[c] = softened * pulled.over * std::min(run.units[c] == "N" ? item.force : item.moment, sizes[vector_of(c)]);
      } else if (column.quantity == Quantity::q && of_item) {
        error[c] = item.reach;
      } else if (run.units[c] == "J" && (column.body < 0 || of_item)) {
        error[c] = *std::max_element(item.energy.begin(), item.energy.end());
      }
      double& most = size[vector_of(c)];
      most = std::max(most, error[c]);
    }
    found.columns = VecX::Constant(static_cast<Eigen::Index>(columns_.size()), -1.0);
    double named = 0.0;  // what the column that is named moves by, of a vector told as a whole the most
    for (size_t c = 0; c < columns_.size(); ++c) {
      const double most = size[vector_of(c)], known = ranges[static_cast<Eigen::Index>(c)],
                   range = sized(c) ? known : std::max({known, most, known == 0.0 ? deformed[run.units[c]] : 0.0});
      // What counts as moving: histories.cpp.
      const bool length = run.units[c] == "m", kinematic = length || run.units[c] == "m/s" || run.units[c].starts_with("rad");
      const double floor = run.units[c].starts_with("N")     ? rounding[static_cast<Eigen::Index>(c)]
                           : run.units[c].starts_with("rad") ? 1e-12
                                                             : 0.0;
      if (!sized(c) && range <= std::max((kinematic ? still : 1e-6) * std::max(largest[run.units[c]], most), floor)) continue;
      const double drifted = known > 0.0 ? std::max(out_of_phase(lost, columns_[c], run.units[c], range),
                                                    std::min(1.0, slower[static_cast<Eigen::Index>(c)] / range))
                                         : 0.0;
      const double share = error[c] / range + drifted;
      if (columns_[c].row >= 0) found.columns[static_cast<Eigen::Index>(c)] = share;
      if (share < found.share || (share == found.share && (share == 0.0 || swing[static_cast<Eigen::Index>(c)] <= named))) continue;
      found.share = share, named = swing[static_cast<Eigen::Index>(c)];
      found.column = run.columns[c];
    }
    const double by_looks = found.share;
    if (!run.columns.empty()) found.turning = turned_share(item, results);
    if (found.turning > found.share) found.share = found.turning, found.column = turns_most(run, ranges);
    if (item.failed) found.share = std::max(found.share, 1.0);
    compare_shown(item, deformed["m"], found);
    if (found.share > by_looks) found.columns.resize(0);
    else found.columns = (found.columns.array() < 0.0).select(found.share, found.columns);
    found.blow = taken_of_blows(item);
    found.critical = item.critical;
    const double missing = std::accumulate(item.energy.begin(), item.energy.end(), 0.0);
    if (unjudged && stored > 0.0 && missing > 0.0) found.inside = missing / (missing + stored);
    out.push_back(found);
  }
  std::stable_sort(out.begin(), out.end(), [](const LeftOutWorth& a, const LeftOutWorth& b) { return a.share > b.share; });
  return out;
}

}  // namespace flexframe::sim
