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
// the complete one of the particles of the beam's axis, which costs several times as much but lasts.
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
      if (indefinite < 0) throw;
      if (!changed) changed = scene;
      // The one that is blamed; where that was not enough, all beams: in a loop one moves with the other.
      bool more = false;
      const auto complete = [&](BodyDef& body) {
        auto* beam = std::get_if<BeamDef>(&body.kind);
        if (!beam || beam->chosen.complete_inertia) return;
        beam->chosen.complete_inertia = more = true;
        notes.tell(fmt::format("body '{}'", body.name),
                   "deforms too far for the second-order kinetic energy: computed with the full kinetic energy of its axis");
      };
      complete(changed->bodies[indefinite]);
      if (!more)
        for (BodyDef& body : changed->bodies) complete(body);
      if (!more) throw;
    }
  }
}

}  // namespace flexframe::sim
