#include "sim/model/effects.h"

#include "sim/model/joint_motion.h"
#include "sim/scene/joint_kinds.h"
#include "sim/scene/named.h"
#include "sim/scene/section.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <tuple>

namespace flexframe::sim {
namespace {

// Directions count as parallel or normal to rounding of what a person types (1e-9).
constexpr double aligned = 1e-9;
// b is a unit vector.
bool parallel(const Vec3& a, const Vec3& b) { return a.cross(b).norm() <= aligned * a.norm(); }
bool normal(const Vec3& a, const Vec3& b) { return std::abs(a.dot(b)) <= aligned * a.norm(); }

bool has(const std::vector<std::string>& list, std::string_view name) { return std::find(list.begin(), list.end(), name) != list.end(); }

// Place of a frame in its body, m; nothing for nodes of files, whose places the scene does not tell.
std::optional<Vec3> place_in_body(const BodyDef& body, const std::string& frame) {
  if (std::holds_alternative<BeamDef>(body.kind)) return Vec3(0.0, 0.0, 0.0);  // on the axis: x does not count
  const auto* rigid = std::get_if<RigidDef>(&body.kind);
  if (!rigid) return std::nullopt;
  if (frame.empty()) return Vec3(Vec3::Zero());
  const auto at = rigid->frames.find(frame);
  return at == rigid->frames.end() ? std::nullopt : std::optional<Vec3>(at->second);
}

// Axes of a frame in its body, whose number b is (-1: the ground).
Mat3 own_axes(const Scene& scene, int b, const std::string& frame) {
  if (b >= 0) return frame_axes(scene.bodies[b], frame);
  const auto at = scene.ground_axes.find(frame);
  return at == scene.ground_axes.end() ? Mat3(Mat3::Identity()) : at->second;
}

// Axes of a frame at the start, world, columns; orientation: of the bodies.
Mat3 axes_at_start(const Scene& scene, const std::vector<Mat3>& orientation, const FrameRef& ref) {
  const int b = body_number(scene, ref.body);
  const Mat3 own = own_axes(scene, b, ref.frame);
  return b < 0 ? own : Mat3(orientation[b] * own);
}

// How far the bodies' origins lie along n over the world's, m, which nothing changes while they move in the plane normal to it: as their
// joints tell; nothing where they do not.
class Heights {
 public:
  Heights(const Scene& scene, const std::vector<Mat3>& orientation, const Vec3& n)
      : scene_(scene), orientation_(orientation), n_(n), of_(scene.bodies.size()) {
    for (const JointDef& j : scene.joints) {
      largest_ = std::max(largest_, j.position.norm());
      for (const FrameRef* ref : {&j.parent, &j.child}) largest_ = std::max(largest_, reach(*ref));
    }
    for (const ForceDef& f : scene.forces)
      for (const FrameRef* ref : {&f.on, &f.from}) largest_ = std::max(largest_, reach(*ref));
    for (bool found = true; found;) {
      found = false;
      for (const JointDef& j : scene.joints) {
        if (!is_tree_kind(j.kind)) continue;
        const int p = body_number(scene, j.parent.body), c = body_number(scene, j.child.body);
        const auto a = in_body(j.parent, p, j.position), b = in_body(j.child, c, Vec3::Zero());
        if (!a || !b) continue;
        const std::optional<double> parent = p < 0 ? 0.0 : of_[p];
        if (parent && !of_[c]) of_[c] = *parent + *a - *b, found = true;
        else if (!parent && of_[c]) of_[p] = *of_[c] + *b - *a, found = true;
      }
    }
  }

  std::optional<double> of(const FrameRef& ref, const Vec3& beside = Vec3::Zero()) const {
    const int b = body_number(scene_, ref.body);
    const auto here = in_body(ref, b, beside);
    if (!here || (b >= 0 && !of_[b])) return std::nullopt;
    return *here + (b < 0 ? 0.0 : *of_[b]);
  }
  // Whether two heights are one, to rounding of the places of frames that a person types.
  bool same(double a, double b) const { return std::abs(a - b) <= aligned * largest_; }
  bool level(const std::vector<FrameRef>& frames) const {
    for (const FrameRef& ref : frames) {
      const auto first = of(frames.front()), here = of(ref);
      if (!first || !here || !same(*first, *here)) return false;
    }
    return true;
  }

 private:
  // How far a frame lies from its body's origin or, on the ground, from the world's; of a beam its length.
  double reach(const FrameRef& ref) const {
    const int b = body_number(scene_, ref.body);
    if (b < 0) {
      const auto at = scene_.ground_frames.find(ref.frame);
      return at == scene_.ground_frames.end() ? 0.0 : at->second.norm();
    }
    if (const auto* beam = std::get_if<BeamDef>(&scene_.bodies[b].kind)) return beam->length;
    const auto place = place_in_body(scene_.bodies[b], ref.frame);
    return place ? place->norm() : 0.0;
  }
  // Of a place beside a frame over its body's origin.
  std::optional<double> in_body(const FrameRef& ref, int b, const Vec3& beside) const {
    const Vec3 way = beside.isZero(0.0) ? beside : Vec3(own_axes(scene_, b, ref.frame) * beside);
    if (b < 0) {
      const auto at = scene_.ground_frames.find(ref.frame);
      return n_.dot(way + (at == scene_.ground_frames.end() ? Vec3(Vec3::Zero()) : at->second));
    }
    const auto place = place_in_body(scene_.bodies[b], ref.frame);
    if (!place) return std::nullopt;
    return n_.dot(orientation_[b] * (*place + way));
  }

  const Scene& scene_;
  const std::vector<Mat3>& orientation_;
  const Vec3 n_;
  std::vector<std::optional<double>> of_;
  double largest_ = 0.0;  // of the places of frames, m
};

// Whether a contact pushes and rubs within the plane: between profiles that are the same all along n.
bool contact_within(const ContactDef& c, const ForceDef& f, const Mat3& on, const Mat3& from, const Heights& heights, const Vec3& n) {
  // What it presses on is not pushed beside its own plane; the ground does not care.
  if (f.from.body != "ground" && !heights.level({f.on, f.from})) return false;
  if (c.own_curve) return parallel(on.col(2), n) && normal(from * c.normal, n);
  if (c.cylinder && !parallel(on * c.axis, n)) return false;
  if (c.curve) return parallel(from.col(2), n);
  if (c.from_radius > 0.0) return heights.level({f.on, f.from});
  return normal(from * c.normal, n);
}

// Whether a force stays in the plane normal to n while the bodies do.
bool force_within(const ForceDef& f, const Mat3& on, const Mat3& from, const Heights& heights, const Vec3& n) {
  switch (f.kind) {
    case ForceKind::force:
    case ForceKind::torque:
    case ForceKind::distributed: {
      const Vec3 d = f.follower ? Vec3(on * f.direction) : f.direction;
      return f.kind == ForceKind::torque ? parallel(d, n) : normal(d, n);
    }
    case ForceKind::spring_damper: {
      std::vector<FrameRef> way = f.through;
      way.push_back(f.on);
      way.push_back(f.from);
      return heights.level(way);
    }
    case ForceKind::bushing: {
      // Its axes are those of `from`: one along n, and both bodies turn about that alone.
      const Vec3 seen = from.transpose() * n;
      return (parallel(seen, Vec3::UnitX()) || parallel(seen, Vec3::UnitY()) || parallel(seen, Vec3::UnitZ())) &&
             (on.transpose() * n - seen).norm() <= aligned && heights.level({f.on, f.from});
    }
    case ForceKind::drag:
      return normal(f.wind, n);
    case ForceKind::contact:
      return contact_within(*f.contact, f, on, from, heights, n);
    case ForceKind::user:
      break;
  }
  return false;
}

bool planar_about(const Scene& scene, const std::vector<Mat3>& orientation, const Vec3& n) {
  if (!normal(scene.simulation.gravity, n)) return false;
  std::vector<char> held(scene.bodies.size(), 0);
  for (const JointDef& j : scene.joints) {
    const Vec3 a = axes_at_start(scene, orientation, j.parent) * rotation_exp(j.rotation) * j.axis;
    switch (traits(j.kind).in_plane) {
      case InPlane::any_axis:
        break;
      case InPlane::axis_normal:
        if (!parallel(a, n)) return false;
        break;
      case InPlane::axis_within:
        if (!normal(a, n)) return false;
        break;
      case InPlane::never:
        return false;
    }
    if (is_tree_kind(j.kind)) {
      const int b = body_number(scene, j.child.body);
      if (b >= 0) held[b] = 1;
      const int p = body_number(scene, j.parent.body);
      if (p >= 0 && j.child.body == "ground") held[p] = 1;
    }
  }
  // A body without a joint is free to leave the plane.
  if (std::find(held.begin(), held.end(), 0) != held.end()) return false;
  const Heights heights(scene, orientation, n);
  for (const ForceDef& f : scene.forces)
    if (!force_within(f, axes_at_start(scene, orientation, f.on), axes_at_start(scene, orientation, f.from), heights, n)) return false;
  for (const JointDef& j : scene.joints) {
    const auto a = heights.of(j.parent, j.position), b = heights.of(j.child);
    if (j.kind == JointKind::distance && a && b && !heights.same(*a, *b)) return false;
  }
  for (const CouplingDef& c : scene.couplings)
    if (!c.through.empty() && !heights.level(c.through)) return false;
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    // Its matrices may move it anywhere.
    if (std::holds_alternative<StateSpaceDef>(scene.bodies[i].kind)) return false;
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[i].kind);
    if (!beam) continue;
    if (beam->axis) return false;  // curved: its pieces may lie anywhere
    const Vec3 local = orientation[i].transpose() * n;
    if (!parallel(local, Vec3::UnitZ()) && !parallel(local, Vec3::UnitY())) return false;
    if (std::abs(beam->section.iyz) > 1e-12 * (beam->section.iy + beam->section.iz)) return false;
    if (beam->section.shear_yz != 0.0) return false;
    if (const Vec3 mass = mass_moments(beam->section); std::abs(mass[2]) > 1e-12 * (mass[0] + mass[1])) return false;
    for (double q : beam->initial.q)
      if (q != 0.0) return false;
    for (double q : beam->initial.qd)
      if (q != 0.0) return false;
  }
  return true;
}

}  // namespace

Vec3 plane_normal(const Scene& scene, const std::vector<Mat3>& orientation) {
  // Candidates: the axes that hinges have, then the world's, then the beams' own.
  std::vector<Vec3> candidates;
  for (const JointDef& j : scene.joints)
    if (traits(j.kind).in_plane == InPlane::axis_normal) {
      candidates.push_back(axes_at_start(scene, orientation, j.parent) * rotation_exp(j.rotation) * j.axis);
      break;
    }
  for (const Vec3& e : {Vec3(Vec3::UnitZ()), Vec3(Vec3::UnitY()), Vec3(Vec3::UnitX())}) candidates.push_back(e);
  for (size_t i = 0; i < scene.bodies.size(); ++i)
    if (std::holds_alternative<BeamDef>(scene.bodies[i].kind))
      for (const int a : {2, 1}) candidates.push_back(orientation[i].col(a));
  for (const Vec3& n : candidates)
    if (planar_about(scene, orientation, n)) return n;
  return Vec3::Zero();
}

// Whether everything that acts on each body (joints, forces, its own mass) lies in one plane normal to n: else beams are twisted and bent
// out of it.
bool flat_about(const Scene& scene, const std::vector<Mat3>& orientation, const Vec3& n) {
  std::vector<std::optional<double>> height(scene.bodies.size());
  bool flat = true;
  const auto put = [&](int b, const Vec3& place) {
    const double here = (orientation[b].transpose() * n).dot(place);
    std::optional<double>& known = height[b];
    if (!known) known = here;
    else flat = flat && std::abs(here - *known) <= aligned * std::max(place.norm(), std::abs(*known));
  };
  const auto put_frame = [&](const FrameRef& ref, const Vec3& beside) {
    const int b = body_number(scene, ref.body);
    if (b < 0) return;
    if (const auto at = place_in_body(scene.bodies[b], ref.frame)) put(b, *at + own_axes(scene, b, ref.frame) * beside);
  };
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    const int b = static_cast<int>(i);
    if (std::holds_alternative<BeamDef>(scene.bodies[i].kind)) put(b, Vec3::Zero());
    const auto* rigid = std::get_if<RigidDef>(&scene.bodies[i].kind);
    if (!rigid || rigid->mass == 0.0) continue;
    put(b, rigid->centre_of_mass);
    const Vec6& J = rigid->inertia;
    Mat3 inertia;
    inertia << J[0], J[3], J[4], J[3], J[1], J[5], J[4], J[5], J[2];
    const Vec3 local = orientation[i].transpose() * n, spin = inertia * local;
    flat = flat && spin.cross(local).norm() <= aligned * inertia.norm();
  }
  for (const JointDef& j : scene.joints) {
    put_frame(j.parent, j.position);
    put_frame(j.child, Vec3::Zero());
  }
  for (const ForceDef& f : scene.forces) {
    if (f.kind == ForceKind::torque || f.kind == ForceKind::distributed) continue;
    put_frame(f.on, Vec3::Zero());
    put_frame(f.from, Vec3::Zero());
    for (const FrameRef& frame : f.through) put_frame(frame, Vec3::Zero());
  }
  for (const CouplingDef& c : scene.couplings)
    for (const FrameRef& frame : c.through) put_frame(frame, Vec3::Zero());
  return flat;
}

Attachments attachments_of(const Scene& scene, const std::string& body) {
  Attachments out;
  const auto elastic = [&](const std::string& name) {
    const int b = body_number(scene, name);
    return b >= 0 && !std::holds_alternative<RigidDef>(scene.bodies[b].kind);
  };
  for (const JointDef& j : scene.joints) {
    out.count += (j.parent.body == body) + (j.child.body == body);
    if (j.kind == JointKind::weld && ((j.parent.body == body && elastic(j.child.body)) || (j.child.body == body && elastic(j.parent.body))))
      out.continued = true;
  }
  for (const ForceDef& f : scene.forces)
    if (f.kind != ForceKind::distributed) out.count += (f.on.body == body) + (f.from.body == body);
  return out;
}

double shear_share(const BeamDef& beam, bool bending_xy, bool bending_xz) {
  const Section& s = beam.section;
  const double ratio = 2.0 * (1.0 + beam.material.poisson), scale = 3.0 * ratio / (s.area * beam.length * beam.length);
  const double xy = bending_xy && s.shear_y > 0.0 ? scale * s.iz / s.shear_y : 0.0;
  const double xz = bending_xz && s.shear_z > 0.0 ? scale * s.iy / s.shear_z : 0.0;
  return std::max(xy, xz);
}

std::span<const EffectInfo> effect_registry() {
  static constexpr EffectInfo registry[] = {
      {"axial", "lengthening along the axis", "EA u_xx = rho A u_tt", "axial vibration, or axial deformation comparable with bending",
       "P / EA, and the forcing against (pi/2L) sqrt(E/rho)"},
      {"bending_xy", "bending in the body's xy plane, Euler-Bernoulli", "EIz v_xxxx + rho A v_tt = p",
       "loads across the beam in that plane", "(q L^4 / 8EI + F L^3 / 3EI) / (1 - (omega/omega_1)^2) against the output's range"},
      {"bending_xz", "bending in the body's xz plane, Euler-Bernoulli", "EIy w_xxxx + rho A w_tt = p",
       "loads across the beam in that plane; none in a planar scene", "as bending_xy"},
      {"torsion", "twist about the axis, Saint-Venant", "GJ theta_xx = rho Ip theta_tt", "moments about the axis, loads off the axis",
       "M L / GJ times the output's distance from the axis"},
      {"stiffening", "second-order displacements: geometric stiffness and foreshortening", "u -= 1/2 int (v_x^2 + w_x^2) dx",
       "axial forces comparable with the buckling load, rotation rates comparable with the first frequency",
       "s = P / Pcr; frequencies change by s/2, the phase by omega_1 T s/2"},
      {"gyroscopic", "angular momentum of elastic rates that follows the deformation; centrifugal forces stay without it",
       "Cr(q) = Cr0 + Cr1 q, its part skew in q and qd", "fast rotation of a deformed body",
       "Omega / omega_1, (Omega / omega_1)^2, deflection / length"},
      {"shear", "Timoshenko's shear and the sections' rotary inertia", "kGA (v_x - phi), rho I phi_tt", "stocky beams, high modes",
       "n^2 pi^2 (r/L)^2 (1 + E/kG)/2 of the frequency of mode n"},
      {"large_bending", "bending in one plane however far it turns, as an exact rod in the body's frame", "r_x = (cos theta, sin theta)",
       "tangents that turn by more than some 0.1 rad within the body, at its ends or while it vibrates",
       "turn^2 / 40 of the deflection; along a vibration more"},
      {"damping", "structural damping", "De qd", "many periods of free vibration", "zeta omega_1 T"},
      {"friction", "Coulomb friction of a joint, with stiction", "|F| <= mu N", "friction forces comparable with the driving force",
       "mu N / F"},
      {"stops", "contact at the ends of a joint's travel", "k d + c d_t beyond the stop", "the coordinate reaches them",
       "reached or not along the trajectory"},
      {"gravity", "weight", "m g", "weight comparable with the other forces", "weight against the other forces"},
  };
  return registry;
}

const EffectInfo* find_effect(std::string_view name) {
  for (const EffectInfo& e : effect_registry())
    if (name == e.name) return &e;
  return nullptr;
}

std::vector<EffectState> modal_effects(const BodyDef& body, const ModalDef& modal, const FlexibleBody& made) {
  const auto any = [](const auto& blocks) { return std::any_of(blocks.begin(), blocks.end(), [](const MatX& b) { return b.size() > 0; }); };
  const bool second = any(made.md2) || any(made.J2) ||
                      std::any_of(made.nodes.begin(), made.nodes.end(), [&](const FlexibleNode& n) { return any(n.phi2) || any(n.psi2); });
  std::vector<EffectState> out;
  const auto add = [&](const char* name, bool there) {
    const bool left_out = has(modal.effects.without, name);
    EffectState s;
    s.owner = body.name;
    s.effect = name;
    s.on = there && !left_out;
    s.possible = there;
    s.by = left_out ? "scene" : "file";
    s.why = left_out ? "the scene leaves it out" : there ? "the file has it" : "the file has none";
    out.push_back(s);
  };
  add("stiffening", second);
  add("gyroscopic", any(made.Cr1));
  add("damping", made.De.size() > 0);
  return out;
}

namespace {

struct Switch {
  const char* name;
  bool BeamEffects::*on;
};
constexpr Switch switches[] = {{"axial", &BeamEffects::axial},
                               {"bending_xy", &BeamEffects::bending_xy},
                               {"bending_xz", &BeamEffects::bending_xz},
                               {"torsion", &BeamEffects::torsion},
                               {"stiffening", &BeamEffects::stiffening},
                               {"shear", &BeamEffects::shear},
                               {"large_bending", &BeamEffects::large_bending}};
// Whether its model can follow bending to any turn.
bool can_bend_far(const BeamDef& beam) {
  return (beam.model == BeamModel::finite_element || beam.model == BeamModel::modal) && beam.stations.empty() && !beam.axis;
}
using Reasons = std::map<std::string, std::pair<std::string, std::string>>;  // of an effect: by whom, why

// Whether the beam's model and section can have shear.
bool can_shear(const BeamDef& beam, const BeamEffects& e) {
  const bool model = beam.model == BeamModel::finite_element || (beam.model == BeamModel::mixed && beam.modes.empty());
  return model && (!e.bending_xy || beam.section.shear_y > 0.0) && (!e.bending_xz || beam.section.shear_z > 0.0);
}

// What "auto" takes before the run; then what the scene or the run before added to it.
template <class Say>
void choose(const BeamDef& beam, const Vec3& normal_in_body, const Attachments& attachments, BeamEffects& e, Reasons& reason,
            const Say& say) {
  const bool planar = !normal_in_body.isZero(0.0), in_xy = planar && parallel(normal_in_body, Vec3::UnitZ());
  if (planar) {
    e.bending_xy = in_xy;
    e.bending_xz = !in_xy;
    for (const char* name : {"bending_xy", "bending_xz", "torsion"}) reason[name] = {"symmetry", "the scene moves in a plane"};
    say(fmt::format("{} on, {} and torsion off: the scene moves in a plane", e.bending_xy ? "bending_xy" : "bending_xz",
                    e.bending_xy ? "bending_xz" : "bending_xy"));
  } else {
    const bool called = has(beam.effects.names, "bending_xy") || has(beam.effects.names, "bending_xz");
    const bool idle = beam.chosen.first_bending > 0.0 && !called;
    e.bending_xy = e.bending_xz = !idle;
    e.torsion = attachments.count > 1;
    const char* why = idle ? "what acts on it, but for weight, acts along and about its axis" : "the scene is spatial";
    reason["bending_xy"] = reason["bending_xz"] = {idle ? "symmetry" : "program", why};
    reason["torsion"] = {"program", e.torsion ? "what is attached may twist it" : "it is held in one place only"};
    say(fmt::format("bending_xy and bending_xz {}: {}", idle ? "off" : "on", why));
    say(e.torsion ? "torsion on: what is attached may twist it" : "torsion off: it is attached in one place only, nothing twists it");
  }
  e.stiffening = true;
  reason["stiffening"] = {"program", "axial forces may be carried"};
  reason["large_bending"] = {"program", "how far it bends is told after the run"};
  e.axial = !beam.chosen.held_by.empty();
  reason["axial"] = {"program", e.axial ? fmt::format("the loop of joint '{}' holds its length", beam.chosen.held_by)
                                        : "a slender beam bends long before it stretches"};
  const double share = can_shear(beam, e) && !attachments.continued ? shear_share(beam, e.bending_xy, e.bending_xz) : 0.0;
  // Who gives a section moments of its own for its mass wants their inertia, which comes with shear.
  const bool rotary = has_rotary(beam.section) && can_shear(beam, e);
  e.shear = rotary || share > worth_leaving_out;
  reason["shear"] = {"program", rotary    ? "the section has rotary inertia of its own"
                                : e.shear ? fmt::format("shear is {:.2g} of the deflection under a tip load", share)
                                          : "a slender beam bends long before it shears"};
  say("stiffening on: axial forces may be carried");
  for (const Switch& s : switches) {
    if (e.*s.on || !has(beam.effects.names, s.name)) continue;
    e.*s.on = true;
    reason[s.name] = beam.chosen.effects ? std::pair<std::string, std::string>{"program", "the motion needs it"}
                                         : std::pair<std::string, std::string>{"scene", "the scene lists it"};
  }
  for (const char* name : {"axial", "shear"})
    say(fmt::format("{} {}: {}", name, e.*(name[0] == 'a' ? &BeamEffects::axial : &BeamEffects::shear) ? "on" : "off",
                    reason[name].second));
}

}  // namespace

EffectDecision decide_effects(const BodyDef& body, const BeamDef& beam, const Vec3& normal_in_body, const Attachments& attachments) {
  EffectDecision out;
  BeamEffects& e = out.effects;
  const auto say = [&](const std::string& text) { out.why.push_back(text); };
  const bool planar = !normal_in_body.isZero(0.0);
  const bool in_xy = planar && parallel(normal_in_body, Vec3::UnitZ());
  Reasons reason;
  if (!beam.effects.automatic) {
    for (const Switch& s : switches) {
      e.*s.on = has(beam.effects.names, s.name);
      if (beam.chosen.effects)
        reason[s.name] = {"program", e.*s.on ? "the requested accuracy needs it" : "the requested accuracy does not need it"};
      else reason[s.name] = {"scene", e.*s.on ? "the scene lists it" : "the scene does not list it"};
    }
    say(beam.effects.names.empty()
            ? "rigid: the scene lists no effect"
            : fmt::format("effects as {}: {}", beam.chosen.effects ? "the requested accuracy needs them" : "the scene lists them",
                          fmt::join(beam.effects.names, ", ")));
  } else {
    choose(beam, normal_in_body, attachments, e, reason, say);
  }
  if (beam.model == BeamModel::modal && !beam.modes.empty()) {
    // The modes that a scene names are the coordinates it wants.
    for (const Switch& s : switches) {
      if (s.on == &BeamEffects::stiffening || s.on == &BeamEffects::shear || s.on == &BeamEffects::large_bending) continue;
      e.*s.on = beam.modes.count(s.name) > 0;
      reason[s.name] = {"scene", e.*s.on ? "its modes are listed" : "no mode of it is listed"};
    }
    say("elastic coordinates are the modes that the scene lists");
  }
  for (const Switch& s : switches)
    if (has(beam.effects.without, s.name)) {
      e.*s.on = false;
      reason[s.name] = {"scene", "the scene leaves it out"};
      say(fmt::format("{} off: the scene leaves it out", s.name));
    }

  const bool bends_once = e.bending_xy != e.bending_xz && !e.torsion && e.stiffening;
  const bool bends_far = bends_once && can_bend_far(beam) && !has(beam.effects.without, "gyroscopic");
  if (e.large_bending && !bends_far) {
    say("large_bending off: it needs bending in one plane only, stiffening and no torsion, in a beam of one body and one section");
    e.large_bending = false;
  }
  const bool elastic = e.axial || e.bending_xy || e.bending_xz || e.torsion;
  for (const Switch& s : switches) {
    EffectState state;
    state.owner = body.name;
    state.effect = s.name;
    state.on = e.*s.on;
    std::tie(state.by, state.why) = reason[s.name];
    const bool off_plane = s.on == &BeamEffects::torsion || s.on == (in_xy ? &BeamEffects::bending_xz : &BeamEffects::bending_xy);
    if (planar && off_plane) state.possible = state.on;
    if (s.on == &BeamEffects::shear) state.possible = can_shear(beam, e) || (state.on && beam.model != BeamModel::lumped);
    if (s.on == &BeamEffects::stiffening) state.possible = elastic && beam.model != BeamModel::lumped;
    if (s.on == &BeamEffects::large_bending && !bends_far) continue;
    if (!state.possible) state.on = false;
    out.states.push_back(state);
  }
  const bool damped = !beam.damping.ratio.empty() || beam.damping.mass != 0.0 || beam.damping.stiffness != 0.0;
  for (const bool damping : {false, true}) {
    EffectState state;
    state.owner = body.name;
    state.effect = damping ? "damping" : "gyroscopic";
    const bool left_out = has(beam.effects.without, state.effect.c_str());
    state.possible = elastic && (!damping || damped);
    state.on = state.possible && !left_out;
    state.by = damping || left_out ? "scene" : "program";
    state.why = left_out   ? "the scene leaves it out"
                : !damping ? "part of the inertia forces"
                : damped   ? "the scene gives it"
                           : "the scene gives none";
    out.states.push_back(state);
    if (left_out) say(fmt::format("{} off: the scene leaves it out", state.effect));
  }
  return out;
}

}  // namespace flexframe::sim
