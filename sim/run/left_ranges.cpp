#include "sim/run/left_ranges.h"

#include "sim/dynamics/contacts.h"
#include "sim/dynamics/loads.h"
#include "sim/results/outputs.h"
#include "sim/scene/curve.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

namespace flexframe::sim {
namespace {

// A rope that lies straight without load is pushed by rounding: this share of the mechanism's weight and inertia forces is none.
constexpr double no_push = 1e-6;

// Of the distance of two spheres' centres as they touch: the force of a contact is meant for depths that are small beside it, and turns
// round where the centres meet.
constexpr double too_deep = 0.7;

// Angle of a quaternion, rad, that goes on beyond half a turn where the quaternion was followed there.
double turn_of(const double* q) { return 2.0 * std::atan2(Vec3(q[1], q[2], q[3]).norm(), q[0]); }

// The quaternion of a rotation vector that lies nearer to the last one, of the two that say the same rotation: it is followed beyond half
// a turn. What turns by more than half a turn from sample to sample is seen beyond it in one of them sooner or later.
Quat followed(const Quat& last, const Vec3& turn) {
  const double angle = turn.norm();
  const Vec3 axis = angle > 0.0 ? Vec3(std::sin(0.5 * angle) / angle * turn) : Vec3(Vec3::Zero());
  const Quat q(std::cos(0.5 * angle), axis.x(), axis.y(), axis.z());
  return q.dot(last) < 0.0 ? Quat(-q.w(), -q.x(), -q.y(), -q.z()) : q;
}

}  // namespace

LeftRanges::LeftRanges(const System& system) {
  const Model& model = system.model;
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const TreeJoint& joint = model.parts[i].joint;
    if (const int at = traits(joint.kind).quaternion; at >= 0 && joint.spring) {
      Watched w{fmt::format("joint '{}'", joint.name),
                "its spring acts along the rotation vector, which jumps at half a turn, and the spring with it; joints about one axis have "
                "springs for any turn"};
      w.part = static_cast<int>(i);
      w.quaternion = at;
      w.high = std::numbers::pi;
      watched_.push_back(w);
    }
    if (!joint.curve || joint.curve->closed()) continue;
    Watched w{fmt::format("joint '{}'", joint.name), "its point runs beyond the end of its curve, which goes on straight there"};
    w.part = static_cast<int>(i);
    w.high = joint.curve->length();
    watched_.push_back(w);
  }
  for (size_t i = 0; i < model.loads.size(); ++i) {
    const ForceDef& def = model.loads[i].def;
    if (def.kind != ForceKind::bushing || def.bushing_stiffness.tail<3>().isZero(0.0)) continue;
    Watched w{def.name.empty() ? fmt::format("bushing on '{}'", def.on.body) : fmt::format("force '{}'", def.name),
              "its stiffness against rotation acts along the rotation vector of its ends, which jumps at half a turn, and its moment with "
              "it, and mixes tilt with spin long before; what turns needs a joint, with a spring for any turn"};
    w.bushing = static_cast<int>(i);
    w.high = std::numbers::pi;
    watched_.push_back(w);
  }
  for (size_t k = 0; k < model.couplings.size(); ++k) {
    const CouplingRow& row = model.couplings[k];
    const CouplingDef& def = system.scene.couplings[row.scene_coupling];
    for (size_t t = 0; t < row.terms.size(); ++t) {
      if (!def.terms[t].range) continue;
      Watched w{fmt::format("coupling '{}'", row.name),
                "the cam leaves the table of its lift, whose end value stays there with a jump of its slope"};
      w.part = row.terms[t].part;
      w.coordinate = row.terms[t].rate;
      std::tie(w.low, w.high) = *def.terms[t].range;
      watched_.push_back(w);
    }
    if (row.frames.empty()) continue;
    Watched w{fmt::format("coupling '{}'", row.name),
              fmt::format("the rope '{}' is pushed, which no rope bears; take a [[force]] of kind \"cable\", which goes slack", row.name)};
    w.coupling = static_cast<int>(k);
    w.high = std::numeric_limits<double>::infinity();
    watched_.push_back(w);
    ropes_ = true;
  }
  for (size_t k = 0; k < model.contacts.size(); ++k) {
    const ContactDef& def = *model.loads[model.contacts[k].load].def.contact;
    if (!(def.from_radius > 0.0)) continue;
    Watched w{contact_name(model, static_cast<int>(k)),
              "the bodies are pressed into each other so far that they may come out at the other side; take a larger stiffness"};
    w.contact = static_cast<int>(k);
    w.high = too_deep * (def.radius + def.from_radius);
    watched_.push_back(w);
  }
  for (size_t k = 0; k < model.loops.size(); ++k) {
    const LoopJoint& loop = model.loops[k];
    const bool asked = std::any_of(system.scene.outputs.begin(), system.scene.outputs.end(), [&](const OutputDef& o) {
      return o.quantity == Quantity::value && o.of.frame.empty() && o.of.body == loop.name;
    });
    if (!asked || is_length(loop.kind, 0) || TurnPath::find(model, loop.a, loop.b, loop.axis)) continue;
    Watched w{fmt::format("joint '{}'", loop.name),
              "it turns by more than half a turn between samples, and its value may miss whole turns; take a larger output_rate"};
    w.loop = static_cast<int>(k);
    w.high = std::numbers::pi;
    watched_.push_back(w);
  }
}

void LeftRanges::look(System& system, double t) {
  if (watched_.empty()) return;
  const Model& model = system.model;
  if (ropes_) {
    update_system_accelerations(system);
    compute_reactions(model, system.work, reactions_);
  }
  double forces = 0.0;
  for (const Vec6& F : reactions_.part) forces = std::max(forces, F.head<3>().norm());
  for (Watched& w : watched_) {
    double value = 0.0;
    if (w.coupling >= 0) {
      value = -reactions_.coupling[w.coupling];
    } else if (w.contact >= 0) {
      value = std::max(0.0, find_touch(model, system.work, model.contacts[w.contact]).depth);
    } else if (w.loop >= 0) {
      value = std::abs(loop_rate(model, system.work, w.loop)) * (t - last_);
    } else if (w.bushing >= 0) {
      w.last = followed(w.last, load_state(model, system.work, {w.bushing}).turn);
      const double q[] = {w.last.w(), w.last.x(), w.last.y(), w.last.z()};
      value = turn_of(q);
    } else {
      const Part& part = model.parts[w.part];
      if (w.quaternion >= 0) value = turn_of(system.work.q.data() + part.q0 + w.quaternion);
      else value = part.joint.motion >= 0 ? system.work.motion[part.joint.motion].value : system.work.q[part.q0 + w.coordinate];
    }
    const double slack = w.coupling >= 0 ? no_push * forces : 1e-9 * (w.high - w.low);
    const double beyond = std::max(w.low - value, value - w.high);
    if (beyond <= slack) continue;
    if (!w.left || beyond > std::max(w.low - w.farthest, w.farthest - w.high)) w.farthest = value;
    if (!w.left) w.first = t;
    w.left = true;
  }
  last_ = t;
}

void LeftRanges::warn(Notes& into) const {
  for (const Watched& w : watched_) {
    if (!w.left) continue;
    if (w.coupling >= 0) into.warn(w.owner, fmt::format("{}: from t = {:.6g} s on, with up to {:.4g} N", w.what, w.first, -w.farthest));
    else if (w.contact >= 0)
      into.warn(w.owner, fmt::format("{}: from t = {:.6g} s on, as deep as {:.4g} m of {:.4g} m between their centres", w.what, w.first,
                                     w.farthest, w.high / too_deep));
    else
      into.warn(w.owner, fmt::format("{}: from t = {:.6g} s on, as far as {:.6g} (allowed: {:.6g} to {:.6g})", w.what, w.first, w.farthest,
                                     w.low, w.high));
  }
}

}  // namespace flexframe::sim
