// A scene with another model of one of its beams: finite elements or volumes instead of eigenforms or one frame, more or fewer elements.
//
// Places that the scene names by node become frames. Outputs that mean something else then (coordinates; displacements in a frame that is
// not clamped to the root) are left out. None where that is not possible: the scene gives coordinates at the start.
#pragma once

#include "sim/bodies/beam.h"
#include "sim/model/model.h"
#include "sim/scene/scene.h"

#include <optional>
#include <string>
#include <vector>

namespace flexframe::sim {

// Elements of the whole beam, of eigenforms as many as their waves need.
int elements_of(const BeamDef& beam);
// Deformations that a body has.
BeamEffects deformations(const std::vector<EffectState>& states, size_t body);
// Whether a beam deforms in forms that belong to certain ends, whatever holds it in the scene.
bool has_forms_of_ends(const BeamDef& beam);
// The beam has the effects that are on, by name, and the program chooses no others. body: its name.
void list_effects(const std::vector<EffectState>& states, const std::string& body, BeamDef& beam);

// A beam as `volumes` volumes, of as many elements in all at least, two for each eigenform. Not lumped ones.
std::optional<Scene> with_volumes(const Scene& scene, const std::vector<EffectState>& states, size_t body, int volumes);
// As finite elements in one frame that hold nothing by themselves.
std::optional<Scene> with_elements(const Scene& scene, const std::vector<EffectState>& states, size_t body);
// As it is, of half as many elements: of a mixed one in each volume, or half its volumes where each is one element. None where it has too
// few for that.
std::optional<Scene> with_half_as_many(const Scene& scene, const std::vector<EffectState>& states, size_t body);
// Of twice as many. A beam that has as many as it may gets them in two volumes, each with as many: `divided`.
std::optional<Scene> with_twice_as_many(const Scene& scene, const std::vector<EffectState>& states, size_t body, bool& divided);
// The changed scene's beam keeps as many modes as the scene's has: what they leave out is told by few_modes.h.
void keep_as_many(const Scene& scene, size_t body, Scene& changed);

// Every beam's damping as one Kelvin-Voigt time constant, which all models can have: that of the first mode.
Scene with_plain_damping(const Scene& scene, const std::vector<size_t>& bodies, const std::vector<EffectState>& states);
// Whether one of them is damped by mode or by mass, which not all models can be.
bool damped_by_modes(const Scene& scene, const std::vector<size_t>& bodies);

}  // namespace flexframe::sim
