// What is done where a beam's truncated kinetic energy does not last.
#pragma once

#include "sim/base/notes.h"
#include "sim/base/types.h"
#include "sim/scene/scene.h"

#include <fmt/format.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace flexframe::sim {

// A run that loses the positive kinetic energy of a beam (far deformed, many modes: sim/DECISIONS.md, "One energy") is made again with
// the complete one of the particles of the beam's axis, which costs several times as much but lasts. All beams of the scene get it at
// once: which of them a method blames hangs on its steps, and what a scene is computed with must not.
template <class Run>
auto with_complete_inertia(const Scene& scene, Run&& once) {
  std::optional<Scene> changed;
  Notes notes;
  while (true) {
    int indefinite = -1;
    try {
      auto out = once(changed ? *changed : scene, indefinite);
      if constexpr (requires { out.results; }) out.results.statistics.notes.prepend(notes);
      else out.statistics.notes.prepend(notes);
      return out;
    } catch (const SimulationError&) {
      if (indefinite < 0 || changed) throw;
      changed = scene;
      bool more = false;
      for (BodyDef& body : changed->bodies) {
        auto* beam = std::get_if<BeamDef>(&body.kind);
        if (!beam || beam->chosen.complete_inertia) continue;
        beam->chosen.complete_inertia = more = true;
        const std::string& lost = changed->bodies[indefinite].name;
        notes.tell(fmt::format("body '{}'", body.name),
                   body.name == lost
                       ? "deforms too far for the second-order kinetic energy: computed with the full kinetic energy of its axis"
                       : fmt::format("computed with the full kinetic energy of its axis, because body '{}' deforms too far", lost));
      }
      if (!more) throw;
    }
  }
}

}  // namespace flexframe::sim
