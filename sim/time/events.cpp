#include "sim/time/events.h"

#include "sim/base/eigen_solvers.h"
#include "sim/dynamics/contacts.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/friction_rest.h"
#include "sim/dynamics/loads.h"
#include "sim/dynamics/massless.h"
#include "sim/dynamics/signals.h"
#include "sim/dynamics/stops.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace flexframe::sim {
namespace {

// What contacts and expressions read of the present state, with the forces of contacts. Positions and velocities come first.
void read_state(System& s) {
  if (s.model.contacts.empty()) update_signals(s.model, s.work);
  else update_loads(s.model, s.work);
}

double coordinate(const System& s, int part) { return s.work.q[s.model.parts[part].q0]; }
double rate(const System& s, int part) { return s.work.w[s.model.parts[part].v0]; }

// Switches of expressions and contacts, whose margins begin at `at`. at_rest: contacts that do not slide; resting: those that have come to
// rest.
bool pass_state_events(System& s, size_t at, const std::vector<int>& directions, const std::vector<bool>& at_rest,
                       std::vector<int>& resting, std::vector<std::string>& changes, double& released) {
  std::vector<bool> ended;
  for (size_t k = at; k < directions.size(); ++k) ended.push_back(directions[k] < 0);
  if (std::find(ended.begin(), ended.end(), true) == ended.end()) return false;
  read_state(s);
  const auto contacts = ended.begin() + switch_count(s.model);
  pass_switches(s.model, s.work, {ended.begin(), contacts});
  released = pass_contacts(s.model, s.work, {contacts, ended.end()}, at_rest, resting, changes);
  return true;
}

// A place of contact: its two directions along the plane of contact, axes of the partner, and the most that friction holds there, N.
struct HeldContact {
  int contact;
  Vec3 along[2];
  double most;
};

std::vector<HeldContact> held_contacts(System& s, const std::vector<int>& contacts) {
  std::vector<HeldContact> out;
  for (const int k : contacts) {
    const Contact& contact = s.model.contacts[k];
    const Load& load = s.model.loads[contact.load];
    const double most = load.def.contact->static_friction * s.work.signals.contacts[k].force;
    if (!(most > 0.0)) continue;
    const Vec3 n = pose_in_space(s.model, s.work, load.from).R.transpose() * find_touch(s.model, s.work, contact).normal;
    const Vec3 a = n.unitOrthogonal();
    out.push_back({k, {a, n.cross(a)}, most});
  }
  return out;
}

// Velocities along the planes of contact at (t, y), two a place.
VecX slides_at(System& s, double t, const VecX& y, const std::vector<HeldContact>& places) {
  set_state(s, t, y.data(), false);
  read_state(s);
  VecX out(2 * static_cast<Eigen::Index>(places.size()));
  Eigen::Index row = 0;
  for (const HeldContact& p : places)
    for (const Vec3& along : p.along) out[row++] = along.dot(s.work.signals.contacts[p.contact].slide);
  return out;
}

// How fast what touches is accelerated against its partner, m/s^2, along free, the rates at (t, y).
VecX contact_accelerations(System& s, double t, const VecX& y, const VecX& free) {
  constexpr double beside = 1e-7;
  const auto rates = [&](double step) {
    const VecX at = y + step * free;
    set_state(s, t + step, at.data(), false);
    read_state(s);
    VecX out(static_cast<Eigen::Index>(s.work.signals.contacts.size()));
    for (size_t k = 0; k < s.work.signals.contacts.size(); ++k) out[static_cast<Eigen::Index>(k)] = s.work.signals.contacts[k].rate;
    return out;
  };
  return (rates(beside) - rates(-beside)) / (2.0 * beside);
}

// Whether what presses the places together stays: what touches is accelerated against its partner, on the average of the forces (what
// slides tilts as well), by no more than a fifth of what these would give the whole mechanism. (At the turning point of a bounce nothing
// moves.)
bool pressed_evenly(System& s, double t, const VecX& y) {
  constexpr double evenly = 0.2;
  VecX free(y.size());
  state_rate(s, t, y.data(), free.data());
  const VecX accelerations = contact_accelerations(s, t, y, free);
  double presses = 0.0, gains = 0.0;
  for (size_t k = 0; k < s.work.signals.contacts.size(); ++k) {
    const ContactWork& c = s.work.signals.contacts[k];
    if (c.phase == ContactPhase::apart || !(c.force > 0.0)) continue;
    presses += c.force, gains += c.force * accelerations[static_cast<Eigen::Index>(k)];
  }
  return std::abs(gains) <= evenly * presses * presses / s.model.mass;
}

double largest_share(const VecX& shares) {
  double out = 0.0;
  for (Eigen::Index k = 0; k < shares.size(); k += 2) out = std::max(out, shares.segment<2>(k).norm());
  return out;
}

// Shares of the most that friction holds, two a place, that leave the places without acceleration: the least ones, as near as any do.
// y: with the springs of the places slack.
VecX holding_shares(System& s, double t, const VecX& y, const std::vector<HeldContact>& places) {
  const Eigen::Index z0 = y.size() - (s.quadrature ? 2 : 0) - s.model.nz;
  VecX free(y.size()), pushed(y.size());
  state_rate(s, t, y.data(), free.data());
  // Short against all that is in motion, long against the rounding of velocities.
  constexpr double beside = 1e-7, unit = 1e-3;
  const VecX a0 =
      (slides_at(s, t + beside, y + beside * free, places) - slides_at(s, t - beside, y - beside * free, places)) / (2.0 * beside);
  // Slides are linear in the rates.
  const VecX before = slides_at(s, t, y, places);
  MatX A(a0.size(), a0.size());
  Eigen::Index column = 0;
  for (const HeldContact& p : places) {
    const Contact& contact = s.model.contacts[p.contact];
    for (const Vec3& along : p.along) {
      VecX at = y;
      at.segment<3>(z0 + contact.z0) = -p.most / s.model.loads[contact.load].def.contact->tangential_stiffness * along;
      state_rate(s, t, at.data(), pushed.data());
      A.col(column++) = (slides_at(s, t, y + unit * (pushed - free), places) - before) / unit;
    }
  }
  // Places that move as one but for how deep they are pressed do not push against one another.
  constexpr double independent = 1e-3;
  const VecX least = -least_squares(A, MatX(a0), independent);
  // Of many places the least sum of squares loads those most that are pressed most. Shares alike, in the same directions, as far as they
  // go.
  VecX alike = VecX::Zero(least.size());
  for (Eigen::Index k = 0; k < alike.size(); k += 2)
    if (const double size = least.segment<2>(k).norm(); size > 0.0) alike.segment<2>(k) = least.segment<2>(k) / size;
  const VecX pull = A * alike;
  if (!(pull.squaredNorm() > 0.0)) return least;
  const double size = -pull.dot(a0) / pull.squaredNorm();
  const VecX even = size * alike - least_squares(A, MatX(a0 + size * pull), independent);
  return largest_share(even) < largest_share(least) ? even : least;
}

// What starts at rest among the points of friction sticks or is let go, and all that stick where the loads have jumped.
void start_friction(System& s, bool first, std::vector<std::string>& changes) {
  std::vector<int> resting;
  for (size_t k = 0; k < s.friction.points.size(); ++k) {
    FrictionPoint& p = s.friction.points[k];
    const double w = s.work.w[s.model.parts[p.part].v0 + p.rate];
    if (!first || p.phase == FrictionPhase::regularised || p.phase == FrictionPhase::stick) continue;
    const bool rests = p.phase == FrictionPhase::slip ? slip_rests(p, s.friction, s.model, s.work)
                                                      : std::abs(w) <= friction_rounding(p, s.friction, s.model);
    if (rests) resting.push_back(static_cast<int>(k));
    else if (p.phase != FrictionPhase::slip) p.phase = w > 0.0 ? FrictionPhase::forward : FrictionPhase::backward;
  }
  settle_friction(s.model, s.friction, resting, s.work, changes);
}

}  // namespace

double hold_contacts(System& s, double t, std::vector<int> resting, std::vector<std::string>& changes) {
  const VecX y = pack_state(s, Eigen::Vector2d::Zero());
  const Work work = s.work;
  const FrictionState friction = s.friction;
  set_state(s, t, y.data(), false);
  read_state(s);
  if (!all_settled(s.model, s.work)) {
    s.work = work;
    s.friction = friction;
    return 0.0;
  }
  const auto alone = static_cast<std::ptrdiff_t>(resting.size());
  for (size_t k = 0; k < work.signals.contacts.size(); ++k)
    if (barely_slides(s.model, s.work, static_cast<int>(k))) resting.push_back(static_cast<int>(k));
  for (const int k : resting) s.work.signals.contacts[k].slip = ContactSlip::sticks;
  VecX slack = y;
  const Eigen::Index z0 = y.size() - (s.quadrature ? 2 : 0) - s.model.nz;
  for (const int k : resting) slack.segment<3>(z0 + s.model.contacts[k].z0).setZero();
  const std::vector<HeldContact> places = held_contacts(s, resting);
  VecX share;
  try {
    if (!places.empty() && pressed_evenly(s, t, slack)) share = holding_shares(s, t, slack, places);
  } catch (const SimulationError&) {
    share.resize(0);  // no friction in a joint goes with these
  }
  s.work = work;
  s.friction = friction;
  // A spring that starts slack is loaded up to twice as far as what presses along the plane asks for: that holds up to half.
  constexpr double slack_holds = 0.5, most = 0.999;
  if (share.size() == 0 || !share.allFinite() || largest_share(share) <= slack_holds) return 0.0;
  const auto beside = resting.begin() + alone;
  double energy = 0.0;
  for (size_t k = 0; k < places.size(); ++k) {
    const HeldContact& p = places[k];
    Vec3 part = share[2 * static_cast<Eigen::Index>(k)] * p.along[0] + share[2 * static_cast<Eigen::Index>(k) + 1] * p.along[1];
    if (part.norm() > most) part *= most / part.norm();
    const double stiffness = s.model.loads[s.model.contacts[p.contact].load].def.contact->tangential_stiffness;
    s.work.signals.contacts[p.contact].slip = ContactSlip::sticks;
    s.work.signals.z.segment<3>(s.model.contacts[p.contact].z0) = -p.most / stiffness * part;
    if (std::find(resting.begin(), beside, p.contact) == beside)
      changes.push_back(fmt::format("{} sticks", contact_name(s.model, p.contact)));
    energy += 0.5 * std::pow(p.most * part.norm(), 2) / stiffness;
  }
  return energy;
}

bool has_events(const System& s) {
  if (!s.stops.empty() || switch_count(s.model) > 0 || !s.model.contacts.empty()) return true;
  for (const FrictionPoint& p : s.friction.points)
    if (p.phase != FrictionPhase::regularised) return true;
  return false;
}

double watched_turning(const System& s) {
  double out = 0.0;
  const auto watch = [&](int frame) {
    if (const int part = frame >= 0 ? s.model.frames[frame].part : ground; part != ground)
      out = std::max(out, s.work.parts[part].V.tail<3>().norm());
  };
  for (const Signal& signal : s.model.signals) {
    watch(signal.frame);
    watch(signal.relative_to);
  }
  for (const Contact& contact : s.model.contacts) {
    watch(s.model.loads[contact.load].on);
    watch(s.model.loads[contact.load].from);
  }
  return out;
}

namespace {

bool any_pushed(const System& s) {
  return std::any_of(s.work.signals.contacts.begin(), s.work.signals.contacts.end(),
                     [](const ContactWork& c) { return c.phase == ContactPhase::pushed; });
}

}  // namespace

int event_count(const System& s) {
  if (!has_events(s)) return 0;
  return static_cast<int>(s.friction.points.size() + 2 * s.stops.size() + 3 * s.model.contacts.size()) + switch_count(s.model);
}

void event_margins(System& s, double t, const double* y, double* margin) {
  const bool sticks = any_sticks(s.friction), reads = !s.model.functions.empty() || !s.model.contacts.empty();
  VecX accelerations;
  if (any_pushed(s)) {
    const VecX at = Eigen::Map<const VecX>(y, state_size(s));
    VecX free(at.size());
    state_rate(s, t, y, free.data());
    accelerations = contact_accelerations(s, t, at, free);
  }
  // Slips and stops ask for rates and coordinates only.
  if (sticks || reads) set_state(s, t, y, sticks);
  else set_rates(s, t, y);
  for (const FrictionPoint& p : s.friction.points) *margin++ = friction_margin(p, s.friction, s.model, s.work);
  for (int i : s.stops) {
    const StopMargins m = stop_margins(*s.model.parts[i].joint.stop, s.work.joints[i].stop, coordinate(s, i), rate(s, i));
    *margin++ = m.out;
    *margin++ = m.in;
  }
  if (!reads) return;
  read_state(s);
  switch_margins(s.model, s.work, margin);
  margin += switch_count(s.model);
  contact_margins(s.model, s.work, margin);
  for (Eigen::Index k = 0; k < accelerations.size(); ++k)
    if (s.work.signals.contacts[k].phase == ContactPhase::pushed) margin[3 * k + 1] = accelerations[k];
}

void event_rates(const System& s, double* rate) {
  std::fill_n(rate, event_count(s), std::numeric_limits<double>::quiet_NaN());
  rate += event_count(s) - static_cast<int>(3 * s.model.contacts.size());
  for (const ContactWork& c : s.work.signals.contacts) {
    if (c.phase == ContactPhase::apart) *rate = -c.rate;
    rate += 3;
  }
}

void event_roundings(System& s, std::vector<double>& rounding) {
  constexpr double digits = 4e-16;
  rounding.clear();
  if (!s.friction.points.empty()) follow_fastest(s.model, s.friction, s.work);
  for (const FrictionPoint& p : s.friction.points) rounding.push_back(friction_rounding(p, s.friction, s.model));
  for (int i : s.stops) {
    const Stop& stop = *s.model.parts[i].joint.stop;
    const double q =
        digits * (std::abs(coordinate(s, i)) + std::max(std::abs(stop.lower.value_or(0.0)), std::abs(stop.upper.value_or(0.0))));
    const double push = stop.stiffness * q + stop.damping * digits * std::abs(rate(s, i));
    const bool touches = s.work.joints[i].stop != StopPhase::free;
    rounding.push_back(q);
    rounding.push_back(touches ? push : q);
  }
  if (!s.model.functions.empty()) switch_roundings(s.model, s.work, rounding);
  contact_roundings(s.model, s.work, rounding);
}

void start_phases(System& s, double t, const VecX& y, bool first, std::vector<std::string>& changes) {
  set_state(s, t, y.data(), false);
  if (first) follow_slip(s.model, s.friction, s.work, true);
  sample_blocks(s.model, s.work, t);
  hold_switches(s.model, s.work);
  if (first && !s.model.contacts.empty()) {
    read_state(s);
    begin_contacts(s.model, s.work);
  }
  for (int i : s.stops) s.work.joints[i].stop = find_stop_phase(*s.model.parts[i].joint.stop, coordinate(s, i), rate(s, i));
  if (!s.stops.empty()) renew_dampers(s.model, s.work);
  if (!s.friction.points.empty()) start_friction(s, first, changes);
  if (!first) return;
  std::vector<int> sticking;
  for (size_t k = 0; k < s.work.signals.contacts.size(); ++k)
    if (s.work.signals.contacts[k].slip == ContactSlip::sticks) sticking.push_back(static_cast<int>(k));
  if (!sticking.empty()) hold_contacts(s, t, sticking, changes);
}

namespace {

// What slides at (t, y) so slowly that it is at rest: places of joints' friction, contacts.
struct AtRest {
  std::vector<bool> joints, contacts;
};

AtRest find_at_rest(System& s, double t, const VecX& y) {
  set_state(s, t, y.data(), any_sticks(s.friction));
  AtRest out;
  for (const FrictionPoint& p : s.friction.points)
    out.joints.push_back(p.phase == FrictionPhase::slip && slip_rests(p, s.friction, s.model, s.work));
  if (s.model.contacts.empty()) return out;
  read_state(s);
  for (size_t k = 0; k < s.model.contacts.size(); ++k) out.contacts.push_back(barely_slides(s.model, s.work, static_cast<int>(k)));
  return out;
}

}  // namespace

bool pass_events(System& s, double t, const VecX& seen, const VecX& y, const std::vector<int>& directions,
                 std::vector<std::string>& changes, double& released) {
  released = 0.0;
  const AtRest at_rest = find_at_rest(s, t, seen);
  set_state(s, t, y.data(), any_sticks(s.friction));
  std::vector<int> resting, contacts;
  bool passed = false, turned = false;
  for (size_t k = 0; k < s.friction.points.size(); ++k) {
    if (directions[k] >= 0) continue;
    passed = true;
    const FrictionPoint& p = s.friction.points[k];
    // A slip that has only turned goes on.
    if (p.phase == FrictionPhase::slip ? at_rest.joints[k] : p.phase != FrictionPhase::stick) resting.push_back(static_cast<int>(k));
    else if (p.phase == FrictionPhase::slip) turned = true;
  }
  const size_t first = s.friction.points.size();
  for (size_t k = 0; k < s.stops.size(); ++k) {
    StopPhase& phase = s.work.joints[s.stops[k]].stop;
    const std::string& name = s.model.parts[s.stops[k]].joint.name;
    for (size_t m = 0; m < 2; ++m) {
      if (directions[first + 2 * k + m] >= 0) continue;
      const StopPhase before = phase;
      phase = next_stop_phase(phase, m == 0);
      passed = true;
      if (before == StopPhase::free)
        changes.push_back(fmt::format("joint '{}' meets its {} stop", name, phase == StopPhase::lower ? "lower" : "upper"));
      break;
    }
  }
  if (pass_state_events(s, first + 2 * s.stops.size(), directions, at_rest.contacts, contacts, changes, released)) passed = true;
  if (!passed) return false;
  if (!s.stops.empty()) renew_dampers(s.model, s.work);
  if (turned) follow_slip(s.model, s.friction, s.work, true);
  if (!s.friction.points.empty()) settle_friction(s.model, s.friction, resting, s.work, changes);
  if (!contacts.empty()) released -= hold_contacts(s, t, contacts, changes);
  return true;
}

}  // namespace flexframe::sim
