// Open sections whose warping is held where they are welded, told from the results of a run and closed formulas; no second run.
#pragma once

#include "sim/base/notes.h"
#include "sim/model/model.h"
#include "sim/results/results.h"
#include "sim/scene/scene.h"

#include <vector>

namespace flexframe::sim {

// Warping constant of thin walls by their middle lines, m^6: I and U; 0 of the others, whose walls meet in a point or are closed.
// Source: Vlasov, Thin-walled elastic beams, 1961; Young, Budynas: Roark's Formulas, table 10.2.
double warping_constant(const Section& section);

// By how much of Saint-Venant's twist a beam of length L is twisted less between its ends where warping is held at `ends` (1 or 2) of them:
// tanh(z)/z, z = L sqrt(GJ/(E Cw)) / ends. 0 where nothing is held.
double held_twist(const Section& section, const Material& material, double length, int ends);

// Warns of beams that twist, as their section warps freely, though welds hold their ends, where that changes the mechanism by more than
// `asked`: held_twist times the share of twist in the largest elastic energy of the run.
void warn_of_held_warping(const Scene& scene, const std::vector<EffectState>& effects, const Results& results, double asked, Notes& notes);

}  // namespace flexframe::sim
