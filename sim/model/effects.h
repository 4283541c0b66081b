// Effects: which elastic coordinates and terms a body gets. What is not called for is not in the model at all.
//
// The registry says of every effect what it is, by which equation, when it matters and how its share is estimated. effect_report.h
// measures the shares.
#pragma once

#include "sim/bodies/beam.h"
#include "sim/model/model.h"
#include "sim/scene/scene.h"

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace flexframe::sim {

struct EffectInfo {
  const char* name;
  const char* meaning;
  const char* equation;
  const char* matters;   // when
  const char* estimate;  // the dimensionless number that says so
};
// All effects that a beam can have, in the order in which they are listed to users.
std::span<const EffectInfo> effect_registry();
const EffectInfo* find_effect(std::string_view name);  // null: there is none of that name

struct EffectDecision {
  BeamEffects effects;
  std::vector<EffectState> states;  // every effect that a beam can have
  std::vector<std::string> why;     // one sentence a decision
};

// Whether the scene moves in a plane: all axes are normal to one direction, loads in the plane: exact and free.
// normal: unit, world axes, or zero when the scene is spatial. orientation: of every body at the start, world axes.
Vec3 plane_normal(const Scene& scene, const std::vector<Mat3>& orientation);

// Whether, in a scene that moves in the plane with this normal, beams are not bent or twisted out of it either: of no body lies the centre
// of mass, a joint or a force beside the plane of the others.
bool flat_about(const Scene& scene, const std::vector<Mat3>& orientation, const Vec3& normal);

// What holds and loads a body.
struct Attachments {
  int count = 0;           // joints and forces on it
  bool continued = false;  // welded to another elastic body: the two bend as one longer beam
};
// body: a name of the scene.
Attachments attachments_of(const Scene& scene, const std::string& body);

// How much of a cantilever's deflection under a load at its tip is shear, 3 EI / (k G A L^2), the larger of the directions that bend; 0
// where the section's shear factors are unknown (Timoshenko).
double shear_share(const BeamDef& beam, bool bending_xy, bool bending_xz);

// What an effect may be worth without being counted in, relative to an output's range: a third of what counts as an error where no accuracy
// is asked for.
inline constexpr double worth_leaving_out = 1.0 / 300.0;

// Effects of one beam before anything is known of its motion (left_out.h judges them along it). `normal_in_body`: the plane's normal in
// body axes, zero when spatial.
EffectDecision decide_effects(const BodyDef& body, const BeamDef& beam, const Vec3& normal_in_body, const Attachments& attachments);

// Of a body from a SID file, before anything is left out: which of its blocks are there.
std::vector<EffectState> modal_effects(const BodyDef& body, const ModalDef& modal, const FlexibleBody& made);

}  // namespace flexframe::sim
