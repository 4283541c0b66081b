// Shapes of a finite element model beyond the elastic coordinates of the body that was made of it: with them a body moves nearly as the
// model does, so that it can be told what its coordinates leave out. Beside coordinates that have every static deflection (Craig and
// Bampton, Guyan) they do not move the interfaces; what they have in common with the coordinates is mass.
#pragma once

#include "sim/bodies/flexible_body.h"

#include <map>
#include <string>
#include <vector>

namespace flexframe::sim {

struct FurtherShapes {
  VecX stiffness;  // m, (rad/s)^2: of unit mass; none in common with each other and with the coordinates. Those that matter most first
  MatX coupling;   // n x m: the mass in common with the coordinates
  Mat3X md, Cr;    // 3 x m: first moment of mass and angular momentum, as FlexibleBody::md1 and Cr0
  Mat6X J;         // 6 x m: inertia tensor, as FlexibleBody::J1
  MatX motion;     // 6 nodes x m: displacement and rotation vector of each of the body's nodes, in their order

  Eigen::Index count() const { return stiffness.size(); }
  bool operator==(const FurtherShapes& other) const;
};

// By name of the body that is to move with them.
using FurtherOfBodies = std::map<std::string, FurtherShapes>;

// Whether all sizes fit `count` shapes of a body of so many coordinates and nodes, all numbers are finite and each shape has a stiffness.
bool is_sound(const FurtherShapes& shapes, Eigen::Index coordinates, Eigen::Index nodes);

// Some of them, by index.
FurtherShapes some_of(const FurtherShapes& all, const std::vector<int>& which);

// The body with the shapes as elastic coordinates behind its own. They are linear: of second order is what the body's own coordinates have.
// Their damping, where the body has any, is the ratio of its highest coordinate.
void add_shapes(const FurtherShapes& shapes, FlexibleBody& body);

}  // namespace flexframe::sim
