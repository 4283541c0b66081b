// Solids that stand for joints: pins, balls, rails, clamps, feet and welds.
#pragma once

#include "render/film/animation.h"

namespace flexframe::film {

// One symbol for each joint that has one, into animation.symbols; bodies must be made. size: m, of the machine, where no body tells how
// large a symbol should be. A weld on the ground: a plate across the beam's end or below the body's face; between bodies: a sleeve around
// the beam, a small block where rigid bodies meet.
void add_joint_symbols(Animation& animation, const sim::Scene& scene, double size);

}  // namespace flexframe::film
