// Contact of a point, sphere or cylinder with a plane, a sphere or a curve, or of a convex outline with a plane: a compliant normal force
// and Coulomb friction, as smooth pieces between located events. W: Work or PlaneWork.
//
// Normal: N = k d^n (1 + D d'), d how deep (Hunt and Crossley 1975; n = 1 linear, 3/2 Hertz), never pulling. With a coefficient of
// restitution e, D = c / v with v the speed of the impact and (1 + e) c = ln((1 + c) / (1 - c e)): from m v dv/dd = -k d^n (1 + D v), whose
// integral over a whole impact does not hold n, k and m, so that every free impact comes back with e exactly (ContactDef::damping is then
// c). Slower than the speed at which weight alone keeps the two together (settling_speed) impacts count as that one: what has settled is
// damped, near its critical damping. What is pushed on while it touches counts by its largest speed since: pushed it is pressed by
// k d^n (1 + c) until it gets no faster. (By the speed at which it was met, which is none where balls of a cradle touch, they would stick
// together.)
//
// Friction: surfaces that stick are held by a spring and a damper in the plane of contact; beyond static_friction N they slide, against
// friction N along the slide. The spring starts slack where they came to rest, but with what keeps them at rest where that is more than
// half of what friction holds (hold_contacts in events.h): loaded at once it would overshoot to twice that and let go, again and again.
// While something is struck it starts slack, as the forces of a blow are gone in a moment. So what rests stays where it is, and what rolls
// rolls: round a sphere or a curve the spring turns with the plane of contact. (Left as it is in the partner's axes, it would have to be
// stretched anew on every turn: a friction drive would creep ever faster.)
#pragma once

#include "sim/dynamics/kinematics.h"

#include <string>
#include <vector>

namespace flexframe::sim {

// Of a contact at the present state, world axes.
struct Touch {
  Vec3 normal, place;  // from the partner to the body; where it touches
  double depth = 0.0, rate = 0.0;
  Vec3 slide;  // velocity of the body's surface against the partner's, without its share along the normal
};

// How fast the normal of a touch turns as seen from the partner, 1/s, world axes.
template <class W>
Vec3 turn_of_normal(const Model& model, const W& work, const Contact& contact, const Touch& touch);

template <class W>
Touch find_touch(const Model& model, const W& work, const Contact& contact);

// Forces of a load's contacts (ContactWork and the rates of their states), as calls of on_frame(frame, wrench). Frames are refreshed.
template <class W, class OnFrame>
void visit_contacts(const Model& model, W& work, int load, const OnFrame& on_frame);

// Energy that contacts store, J, at the present positions, and power that they take out, W, as visited last.
double contact_energy(const Model& model, const Work& work);
double contact_power(const Model& model, const SignalWork& signals);

// Three margins a contact, positive while its pieces hold, and what rounding leaves of one that is zero; as visited last. (The second of
// what is pushed is the acceleration at which it gets deeper, contact_accelerations in events.cpp.)
void contact_margins(const Model& model, const Work& work, double* margin);
void contact_roundings(const Model& model, const Work& work, std::vector<double>& rounding);
// The pieces that hold where a run begins; those after the margins that ended (three a contact), with a sentence for what touches anew.
// Returns the energy that friction lets go, J. A change shows in the next visit. at_rest: contacts that barely slide where their margins
// came to zero; resting: those that have come to rest.
void begin_contacts(const Model& model, Work& work);
double pass_contacts(const Model& model, Work& work, const std::vector<bool>& ended, const std::vector<bool>& at_rest,
                     std::vector<int>& resting, std::vector<std::string>& changes);
// Whether nothing that touches is struck or springs back, faster than a tenth of the speed of a vibration as deep as weight presses.
bool all_settled(const Model& model, const Work& work);
// Whether a contact slides so slowly that it counts as at rest.
bool barely_slides(const Model& model, const Work& work, int contact);
std::string contact_name(const Model& model, int contact);

// Of its spring and the masses that meet, rad/s: how fast an impact is over.
double contact_frequency(const Model& model, const Work& work, int contact);

namespace contact {
// Normal force and friction at a touch, with the rates of its states but for the turning of its plane. axes: of the partner's frame, in
// the world's.
Vec3 force(const Model& model, SignalWork& signals, int at, const Touch& touch, const Mat3& axes);
// Whether a spring is stretched in a plane of contact that may turn as seen from the partner.
bool spring_turns(const Model& model, const SignalWork& signals, int at);
// Turns that spring with the plane. turn: of the normal, 1/s, axes of the partner; n: the normal in these.
void turn_spring(const Model& model, SignalWork& signals, int at, const Vec3& n, const Vec3& turn);
}  // namespace contact

template <class W, class OnFrame>
void visit_contacts(const Model& model, W& work, int load, const OnFrame& on_frame) {
  const Load& l = model.loads[load];
  for (int at = l.contact; at < static_cast<int>(model.contacts.size()) && model.contacts[at].load == load; ++at) {
    const Touch touch = find_touch(model, work, model.contacts[at]);
    const Pose on = pose_in_space(model, work, l.on), from = pose_in_space(model, work, l.from);
    const Vec3 F = contact::force(model, work.signals, at, touch, from.R);
    if (contact::spring_turns(model, work.signals, at))
      contact::turn_spring(model, work.signals, at, from.R.transpose() * touch.normal,
                           from.R.transpose() * turn_of_normal(model, work, model.contacts[at], touch));
    const auto wrench = [&](const Pose& pose, const Vec3& force) {
      return joined(Vec3(pose.R.transpose() * force), Vec3(pose.R.transpose() * (touch.place - pose.p).cross(force)));
    };
    on_frame(l.on, within(work, l.on, wrench(on, F)));
    on_frame(l.from, within(work, l.from, wrench(from, Vec3(-F))));
  }
}

}  // namespace flexframe::sim
