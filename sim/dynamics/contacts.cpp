#include "sim/dynamics/contacts.h"

#include "sim/scene/curve.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::sim {
namespace {

// Slower than that share of the fastest motion so far surfaces do not slide.
constexpr double contact_at_rest = 1e-7;

const ContactDef& def_of(const Model& model, int at) { return *model.loads[model.contacts[at].load].def.contact; }

double elastic_force(const ContactDef& def, double depth) { return depth > 0.0 ? def.stiffness * std::pow(depth, def.exponent) : 0.0; }

// D of the normal force, s/m.
double damping_of(const ContactDef& def, const ContactWork& at) {
  if (def.restitution < 1.0) return at.impact > 0.0 ? def.damping / at.impact : 0.0;
  return def.damping;
}

// Force of a contact that is not apart, N.
double pressing_force(const ContactDef& def, const ContactWork& at, ContactPhase phase) {
  if (phase == ContactPhase::pushed) return elastic_force(def, at.depth) * (1.0 + def.damping);
  return phase == ContactPhase::pressed ? elastic_force(def, at.depth) * (1.0 + damping_of(def, at) * at.rate) : 0.0;
}

ContactPhase live_phase(const ContactDef& def, const ContactWork& at) {
  if (at.depth <= 0.0) return ContactPhase::apart;
  return 1.0 + damping_of(def, at) * at.rate > 0.0 ? ContactPhase::pressed : ContactPhase::parting;
}

// Masses that meet, kg.
double meeting_mass(const Model& model, int at) {
  const Load& load = model.loads[model.contacts[at].load];
  double inverse = 0.0;
  for (const int frame : {load.on, load.from})
    if (const int part = model.frames[frame].part; part != ground && model.parts[part].body.mass > 0.0)
      inverse += 1.0 / model.parts[part].body.mass;
  return inverse > 0.0 ? 1.0 / inverse : std::max(model.mass, 1e-300);
}

// The speed of a vibration as deep as weight presses, m/s.
double speed_of_weight(const Model& model, int at) {
  const ContactDef& def = def_of(model, at);
  const double mass = meeting_mass(model, at), weight = mass * model.settings.gravity.norm();
  const double depth = std::pow(weight / def.stiffness, 1.0 / def.exponent);
  const double stiffness = def.stiffness * def.exponent * std::pow(depth, def.exponent - 1.0);
  return depth * std::sqrt(stiffness / mass);
}

// That speed, by what an impact of its size is damped.
double settling_speed(const Model& model, int at) {
  return std::max(0.5 * def_of(model, at).damping * speed_of_weight(model, at), 1e-12 * model.size);
}

double fastest(const Work& work) {
  double out = work.signals.fastest;
  for (const PartWork& p : work.parts) out = std::max(out, p.V.head<3>().norm());
  return out;
}

bool has_friction(const Model& model, int at) { return model.contacts[at].z0 >= 0; }

// Sticks where it does not move, else slides the way it goes; the states of friction begin anew.
void begin_friction(const Model& model, Work& work, int at) {
  ContactWork& c = work.signals.contacts[at];
  c.slip = ContactSlip::none;
  if (!has_friction(model, at)) return;
  auto z = work.signals.z.segment<3>(model.contacts[at].z0);
  z.setZero();
  if (c.phase == ContactPhase::apart) return;
  c.slip = ContactSlip::sticks;
  if (c.slide.norm() <= contact_at_rest * fastest(work)) return;
  c.slip = ContactSlip::slips;
  z = c.slide.normalized();
}

// What touches from now on. Without weight nothing says how fast what begins slower than rounding will be: it waits for what pushes it.
ContactPhase begin_impact(const Model& model, Work& work, int at) {
  ContactWork& c = work.signals.contacts[at];
  if (!(def_of(model, at).restitution < 1.0)) return ContactPhase::pressed;
  const double settling = settling_speed(model, at);
  c.impact = std::max(c.rate, settling);
  return c.rate <= settling && speed_of_weight(model, at) == 0.0 ? ContactPhase::pushed : ContactPhase::pressed;
}

// A rate beyond what an impact and weight make by themselves: something else pushes.
double pushed_rate(const Model& model, int at, const ContactWork& c) {
  return def_of(model, at).restitution < 1.0 ? std::max(1.1 * c.impact, 2.0 * speed_of_weight(model, at))
                                             : std::numeric_limits<double>::infinity();
}

}  // namespace

namespace {

// Side of a curve on which bodies are: left of the way its points run, outside of a closed one.
double body_side(const SpaceCurve& curve) { return curve.closed() && curve.area_xy() > 0.0 ? -1.0 : 1.0; }

// The point of a cylinder, a solid, that is nearest to a sphere: on its side, an edge or a flat end. World axes, from the cylinder's
// middle.
struct NearestOfCylinder {
  Vec3 along, across = Vec3::Zero();  // its shares along the axis and across it
  bool side, end;                     // where it lies; an edge is neither
};

NearestOfCylinder nearest_of_cylinder(const ContactDef& def, const Vec3& axis, const Vec3& towards) {
  const double along = axis.dot(towards), half = 0.5 * def.width;
  const Vec3 across = towards - along * axis;
  const double beside = across.norm();
  NearestOfCylinder out;
  out.along = std::clamp(along, -half, half) * axis;
  out.side = std::abs(along) <= half;
  out.end = !out.side && beside < def.radius;
  if (out.end) out.across = across;
  else if (beside > 0.0) out.across = def.radius / beside * across;
  return out;
}

// Outward normal of the curve at the point nearest to p, and how far p is outside; axes of the curve, z left out of account.
double distance_to(const SpaceCurve& curve, const Vec3& p, Vec3& normal) {
  const Vec3 flat(p.x(), p.y(), 0.0);
  const SpaceCurve::Jet at = curve.at(curve.nearest(flat));
  const double side = body_side(curve);
  normal = Vec3(-side * at.tangent.y(), side * at.tangent.x(), 0.0).normalized();
  return normal.dot(flat - at.place);
}

}  // namespace

template <class W>
Touch find_touch(const Model& model, const W& work, const Contact& contact) {
  const Load& load = model.loads[contact.load];
  const ContactDef& def = *load.def.contact;
  const Pose on = pose_in_space(model, work, load.on), from = pose_in_space(model, work, load.from);
  const Vec6 Vb = in_space(work, load.on, work.frames[load.on].V), Va = in_space(work, load.from, work.frames[load.from].V);
  Touch out;
  const bool sphere = def.from_radius > 0.0;
  Vec3 centre = on.p, reach = Vec3::Zero();  // towards the partner
  if (def.cylinder && sphere) {
    const NearestOfCylinder nearest = nearest_of_cylinder(def, on.R * def.axis, from.p - on.p);
    centre += nearest.along;
    reach = nearest.across;
  } else if (def.cylinder && !def.curve) {
    const Vec3 axis = on.R * def.axis;
    centre += 0.5 * contact.side * def.width * axis;
    const Vec3 towards = from.R * def.normal;
    const Vec3 across = towards - axis.dot(towards) * axis;
    if (across.norm() > 1e-12 * towards.norm()) reach = -def.radius * across.normalized();
  }
  if (def.own_curve) {
    out.normal = from.R * def.normal;
    Vec3 down = -(on.R.transpose() * out.normal);
    down.z() = 0.0;
    centre = on.p + on.R * def.curve->at(def.curve->farthest(down)).place;
    out.depth = -out.normal.dot(centre - from.p);
  } else if (def.curve) {
    Vec3 normal;
    out.depth = -distance_to(*def.curve, from.R.transpose() * (centre - from.p), normal);
    out.normal = from.R * normal;
  } else if (sphere) {
    const Vec3 apart = centre + reach - from.p;
    const double distance = apart.norm();
    out.normal = distance > 0.0 ? Vec3(apart / distance) : Vec3(Vec3::UnitZ());
    out.depth = def.from_radius - distance;
  } else {
    out.normal = from.R * def.normal;
    out.depth = -out.normal.dot(centre + reach - from.p);
  }
  if (!def.cylinder || def.curve) {
    reach = -def.radius * out.normal;
    out.depth += def.radius;
  }
  out.place = centre + reach;
  const auto velocity = [&](const Pose& pose, const Vec6& V) {
    return Vec3(pose.R * (V.head<3>() + Vec3(V.tail<3>()).cross(Vec3(pose.R.transpose() * (out.place - pose.p)))));
  };
  const Vec3 v = velocity(on, Vb) - velocity(from, Va);
  out.rate = -out.normal.dot(v);
  out.slide = v + out.rate * out.normal;
  return out;
}
template Touch find_touch(const Model&, const Work&, const Contact&);
template Touch find_touch(const Model&, const PlaneWork&, const Contact&);

template <class W>
Vec3 turn_of_normal(const Model& model, const W& work, const Contact& contact, const Touch& touch) {
  const Load& load = model.loads[contact.load];
  const ContactDef& def = *load.def.contact;
  if (def.own_curve || (!def.curve && !(def.from_radius > 0.0))) return Vec3::Zero();
  const Pose on = pose_in_space(model, work, load.on), from = pose_in_space(model, work, load.from);
  const Vec6 Vb = in_space(work, load.on, work.frames[load.on].V), Va = in_space(work, load.from, work.frames[load.from].V);
  const Vec3 turning = on.R * Vb.tail<3>() - from.R * Va.tail<3>();  // of the body as seen from the partner
  // Velocity of the body's point at p as seen from the partner.
  const auto velocity = [&](const Vec3& p) {
    const Vec3 body = on.R * (Vb.head<3>() + Vec3(Vb.tail<3>()).cross(Vec3(on.R.transpose() * (p - on.p))));
    return Vec3(body - from.R * (Va.head<3>() + Vec3(Va.tail<3>()).cross(Vec3(from.R.transpose() * (p - from.p)))));
  };
  const Vec3& n = touch.normal;
  if (def.curve) {
    // The middle runs beside the curve: n(s) with the s of the nearest point.
    Vec3 p = from.R.transpose() * (on.p - from.p);
    p.z() = 0.0;
    const SpaceCurve::Jet at = def.curve->at(def.curve->nearest(p));
    const double side = body_side(*def.curve);
    const Vec3 bend(-side * at.bend.y(), side * at.bend.x(), 0.0);  // dn/ds
    const double outside = Vec3(from.R.transpose() * n).dot(p - at.place);
    const double along = at.tangent.dot(from.R.transpose() * velocity(on.p));
    return from.R * (along / (1.0 + outside * bend.dot(at.tangent)) * bend);
  }
  // From the sphere's middle to the nearest point of the body, which moves on the body as the sphere does.
  Vec3 nearest = on.p, moves = Vec3::Zero();
  const Vec3 passes = -velocity(from.p);  // the sphere's middle as seen from the body
  if (def.cylinder) {
    const Vec3 axis = on.R * def.axis;
    const NearestOfCylinder on_it = nearest_of_cylinder(def, axis, from.p - on.p);
    nearest += on_it.along + on_it.across;
    const Vec3 across = from.p - on.p - axis.dot(from.p - on.p) * axis, around = axis.cross(across);
    if (on_it.end) moves = passes - axis.dot(passes) * axis;
    else if (across.squaredNorm() > 0.0) moves = def.radius / across.norm() * around.dot(passes) / across.squaredNorm() * around;
    if (on_it.side) moves += axis.dot(passes) * axis;
  }
  const double distance = (nearest - from.p).norm();
  if (!(distance > 0.0)) return Vec3::Zero();
  const Vec3 apart = moves - passes;
  return turning.cross(n) + (apart - n.dot(apart) * n) / distance;
}
template Vec3 turn_of_normal(const Model&, const Work&, const Contact&, const Touch&);
template Vec3 turn_of_normal(const Model&, const PlaneWork&, const Contact&, const Touch&);

bool contact::spring_turns(const Model& model, const SignalWork& signals, int at) {
  const ContactDef& def = def_of(model, at);
  return signals.contacts[at].slip == ContactSlip::sticks && !def.own_curve && (def.curve || def.from_radius > 0.0);
}

void contact::turn_spring(const Model& model, SignalWork& signals, int at, const Vec3& n, const Vec3& turn) {
  const int z0 = model.contacts[at].z0;
  signals.zdot.segment<3>(z0) -= turn.dot(Vec3(signals.z.segment<3>(z0))) * n;
}

Vec3 contact::force(const Model& model, SignalWork& signals, int at, const Touch& touch, const Mat3& axes) {
  const ContactDef& def = def_of(model, at);
  ContactWork& c = signals.contacts[at];
  c.depth = touch.depth;
  c.rate = touch.rate;
  c.slide = axes.transpose() * touch.slide;
  const ContactPhase phase = c.phase == ContactPhase::live ? live_phase(def, c) : c.phase;
  c.force = pressing_force(def, c, phase);
  c.friction.setZero();
  if (has_friction(model, at)) {
    const int z0 = model.contacts[at].z0;
    const Vec3 z = signals.z.segment<3>(z0), n = axes.transpose() * touch.normal;
    auto rate = signals.zdot.segment<3>(z0);
    rate.setZero();
    if (c.slip == ContactSlip::sticks) {
      // Within the plane of contact, with which it turns (turn_spring); what rounding leaves along the normal does not pull.
      const Vec3 stretched = z - n.dot(z) * n;
      c.friction = -def.tangential_stiffness * stretched - def.tangential_damping * c.slide;
      rate = c.slide;
    } else if (c.slip == ContactSlip::slips) {
      // Beyond the end of the slide its force goes on as it was, so that the end is met smoothly.
      const Vec3 along = c.slide.dot(z) > 0.0 ? Vec3(c.slide.normalized()) : Vec3((z - n.dot(z) * n).normalized());
      c.friction = -def.friction * c.force * along;
    } else if (c.phase == ContactPhase::live && phase != ContactPhase::apart) {
      // Where nothing has begun yet, a static start among others, a step is not told from a slide: it holds nothing.
      c.friction = -def.tangential_damping * c.slide;
    }
  }
  return c.force * touch.normal + axes * c.friction;
}

double contact_energy(const Model& model, const Work& work) {
  double e = 0.0;
  for (size_t k = 0; k < model.contacts.size(); ++k) {
    const ContactDef& def = def_of(model, static_cast<int>(k));
    const double depth = find_touch(model, work, model.contacts[k]).depth;
    e += elastic_force(def, depth) * std::max(depth, 0.0) / (def.exponent + 1.0);
    if (work.signals.contacts[k].slip == ContactSlip::sticks)
      e += 0.5 * def.tangential_stiffness * work.signals.z.segment<3>(model.contacts[k].z0).squaredNorm();
  }
  return e;
}

double contact_power(const Model& model, const SignalWork& signals) {
  double power = 0.0;
  for (size_t k = 0; k < model.contacts.size(); ++k) {
    const ContactDef& def = def_of(model, static_cast<int>(k));
    const ContactWork& c = signals.contacts[k];
    // A step that begins apart and ends pressed in sees no force all along, so nothing elastic either.
    if (c.phase != ContactPhase::apart) power += (c.force - elastic_force(def, c.depth)) * c.rate;
    power -= c.friction.dot(c.slide);
    if (c.slip == ContactSlip::sticks) power -= def.tangential_stiffness * Vec3(signals.z.segment<3>(model.contacts[k].z0)).dot(c.slide);
  }
  return power;
}

void contact_margins(const Model& model, const Work& work, double* margin) {
  for (size_t k = 0; k < model.contacts.size(); ++k, margin += 3) {
    const ContactDef& def = def_of(model, static_cast<int>(k));
    const ContactWork& c = work.signals.contacts[k];
    const double push = 1.0 + damping_of(def, c) * c.rate;
    margin[0] = c.phase == ContactPhase::apart ? -c.depth : c.depth;
    margin[1] = c.phase == ContactPhase::pressed ? push : c.phase == ContactPhase::parting ? -push : 1.0;
    if (c.phase == ContactPhase::pressed && c.rate > 0.0) margin[1] = 1.0 - c.rate / pushed_rate(model, static_cast<int>(k), c);
    margin[2] = 1.0;
    if (c.slip == ContactSlip::sticks) margin[2] = def.static_friction * c.force - c.friction.norm();
    if (c.slip == ContactSlip::slips) margin[2] = c.slide.dot(Vec3(work.signals.z.segment<3>(model.contacts[k].z0)));
  }
}

void contact_roundings(const Model& model, const Work& work, std::vector<double>& rounding) {
  for (size_t k = 0; k < model.contacts.size(); ++k) {
    const ContactDef& def = def_of(model, static_cast<int>(k));
    const ContactWork& c = work.signals.contacts[k];
    const double place = 4e-15 * model.size, speed = 4e-15 * fastest(work);
    rounding.push_back(place);
    // Pushed: of accelerations, which are differences of rates.
    rounding.push_back(c.phase == ContactPhase::pushed ? 1e-7 * fastest(work) : 1e-14 + damping_of(def, c) * speed);
    rounding.push_back(c.slip == ContactSlip::sticks
                           ? 1e-13 * def.static_friction * c.force + def.tangential_stiffness * place + def.tangential_damping * speed
                           : speed);
  }
}

void begin_contacts(const Model& model, Work& work) {
  work.signals.fastest = fastest(work);
  for (size_t k = 0; k < model.contacts.size(); ++k) {
    const int at = static_cast<int>(k);
    const ContactDef& def = def_of(model, at);
    ContactWork& c = work.signals.contacts[k];
    const ContactPhase before = c.phase;
    const ContactPhase touching = begin_impact(model, work, at);
    // What starts right on its partner is pressed by whatever presses.
    if (before == ContactPhase::live && std::abs(c.depth) <= 1e-9 * model.size && c.rate >= -contact_at_rest * fastest(work))
      c.phase = touching;
    else if (before == ContactPhase::live) c.phase = live_phase(def, c);
    if (before == ContactPhase::live) begin_friction(model, work, at);
  }
}

bool all_settled(const Model& model, const Work& work) {
  constexpr double slowly = 0.1;  // what presses changes by as much of the weight
  for (size_t k = 0; k < work.signals.contacts.size(); ++k) {
    const ContactWork& c = work.signals.contacts[k];
    if (c.phase != ContactPhase::apart && c.force > 0.0 && std::abs(c.rate) > slowly * speed_of_weight(model, static_cast<int>(k)))
      return false;
  }
  return true;
}

bool barely_slides(const Model& model, const Work& work, int contact) {
  const ContactWork& c = work.signals.contacts[contact];
  return has_friction(model, contact) && c.slip == ContactSlip::slips && c.slide.norm() <= contact_at_rest * fastest(work);
}

double pass_contacts(const Model& model, Work& work, const std::vector<bool>& ended, const std::vector<bool>& at_rest,
                     std::vector<int>& resting, std::vector<std::string>& changes) {
  double released = 0.0;
  work.signals.fastest = fastest(work);
  for (size_t k = 0; k < model.contacts.size(); ++k) {
    const int at = static_cast<int>(k);
    const ContactDef& def = def_of(model, at);
    ContactWork& c = work.signals.contacts[k];
    const auto drop = [&]() {
      if (c.slip == ContactSlip::sticks)
        released += 0.5 * def.tangential_stiffness * work.signals.z.segment<3>(model.contacts[k].z0).squaredNorm();
    };
    if (ended[3 * k]) {
      drop();
      if (c.phase == ContactPhase::apart) {
        c.phase = begin_impact(model, work, at);
        changes.push_back(fmt::format("{} touches", contact_name(model, at)));
      } else {
        c.phase = ContactPhase::apart;
        changes.push_back(fmt::format("{} lifts off", contact_name(model, at)));
      }
      begin_friction(model, work, at);
      continue;
    }
    if (ended[3 * k + 1]) {
      if (c.phase == ContactPhase::pushed) c.impact = std::max(c.rate, settling_speed(model, at));
      const bool pressed = c.phase == ContactPhase::pressed;
      c.phase = !pressed ? ContactPhase::pressed : c.rate > 0.0 ? ContactPhase::pushed : ContactPhase::parting;
    }
    if (!ended[3 * k + 2]) continue;
    auto z = work.signals.z.segment<3>(model.contacts[k].z0);
    if (c.slip == ContactSlip::sticks) {
      const double force = c.friction.norm();
      if (force == 0.0 && c.slide.isZero(0.0)) continue;
      drop();
      c.slip = ContactSlip::slips;
      // Where what presses falls while the spring draws it back, it slides against the way that the spring was stretched.
      const bool back = c.slide.dot(c.friction) > 0.0;
      z = force > 0.0 && !back ? Vec3(-c.friction / force) : Vec3(c.slide.normalized());
      changes.push_back(fmt::format("{} slides", contact_name(model, at)));
    } else if (!at_rest[k]) {
      z = c.slide.normalized();  // it has only turned
    } else {
      c.slip = ContactSlip::sticks;
      z.setZero();
      resting.push_back(at);
      changes.push_back(fmt::format("{} sticks", contact_name(model, at)));
    }
  }
  return released;
}

std::string contact_name(const Model& model, int contact) {
  const Load& load = model.loads[model.contacts[contact].load];
  return load.def.name.empty() ? fmt::format("contact of '{}'", model.frames[load.on].name) : fmt::format("contact '{}'", load.def.name);
}

double contact_frequency(const Model& model, const Work& work, int contact) {
  const ContactDef& def = def_of(model, contact);
  const ContactWork& c = work.signals.contacts[contact];
  const double mass = meeting_mass(model, contact), speed = std::max(std::abs(c.rate), 1e-3 * fastest(work));
  // As stiff as where it turns round.
  const double deepest = std::pow(0.5 * (def.exponent + 1.0) * mass * speed * speed / def.stiffness, 1.0 / (def.exponent + 1.0));
  const double depth = std::max({deepest, c.depth, 1e-12 * model.size});
  return std::sqrt(def.stiffness * def.exponent * std::pow(depth, def.exponent - 1.0) / mass);
}

}  // namespace flexframe::sim
