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
  const char* matters;    // when
  const char* estimate;   // the dimensionless number that says so
};
std::span<const EffectInfo> effect_registry();
const EffectInfo* find_effect(std::string_view name);   // null: there is none of that name

struct EffectDecision {
  BeamEffects effects;
  std::vector<EffectState> states;  // every effect that a beam can have
  std::vector<std::string> why;     // one sentence a decision
};

// Whether the scene moves in a plane by symmetry (all axes normal to one direction, loads in the plane): exact and free.
// normal: unit, world axes, or zero when the scene is spatial. orientation: of every body at the start, world axes.
Vec3 plane_normal(const Scene& scene, const std::vector<Mat3>& orientation);

// Joints and forces that act on a body.
int attachment_count(const Scene& scene, const std::string& body);

// Effects of one beam. `normal_in_body`: the plane's normal in body axes, zero when spatial. `attachments`: joints and forces on it.
EffectDecision decide_effects(const BodyDef& body, const BeamDef& beam, const Vec3& normal_in_body, int attachments);

// Of a body from a SID file, before anything is left out: which of its blocks are there.
std::vector<EffectState> modal_effects(const BodyDef& body, const ModalDef& modal, const FlexibleBody& made);

}  // namespace flexframe::sim
