// The pieces of a beam along its axis: one of a finite-element or modal beam, the volumes of a mixed one, the rigid pieces of a lumped one.
#pragma once

#include "sim/base/spatial.h"
#include "sim/scene/scene.h"

#include <utility>
#include <vector>

namespace flexframe::sim {

int piece_count(const BeamDef& beam);

// x of the root of piece k in the undeformed beam, m. Lumped: halves at the ends, cut at the elements' middles.
double piece_start(const BeamDef& beam, int k);

double piece_length(const BeamDef& beam, int k);

// Its section: that of its middle, where the beam's changes.
Section piece_section(const BeamDef& beam, int k);
// The section at x/L = s; at a step the one before it.
Section section_at(const BeamDef& beam, double s);
// Its shear per third derivative of the deflection at x/L = s, (k G A)^-1 E I, m^2, as yy yz zy zz; 0 where no shear factor is known.
Eigen::Vector4d shear_length2(const BeamDef& beam, double s);

// Pose of piece k of a curved beam in the body's frame, in whose axes the curve is given. It is straight: along its chord, as far beside
// that as the curve is on the average (Simpson's rule, exact for a parabola), so that forces have their true levers.
Pose chord_pose(const BeamDef& beam, int k);
// Undeformed pose of a piece in the body's frame; of all of them.
Pose piece_pose(const BeamDef& beam, int k);
std::vector<Pose> piece_poses(const BeamDef& beam);
// How the tangent frame of a curved beam at x/L = s is turned against piece k: x along the curve, y carried along it without twist.
Mat3 tangent_in_piece(const BeamDef& beam, int k, double s);
// Place of the axis at x/L = s in the body's frame, m.
Vec3 place_on_axis(const BeamDef& beam, double s);
// From piece k's own axis to the place of a curved beam's axis at x/L = s, in the axes of the piece, m.
Vec3 beside_piece(const BeamDef& beam, int k, double s);

// Piece that carries x/L = s, and the share of its length at which (0 on a rigid piece). At a seam of volumes the piece before it is meant,
// of lumped pieces the one after it.
std::pair<int, double> locate_piece(const BeamDef& beam, double s);

// One piece of a finite-element, modal or mixed beam as a beam of its own: its share of the length, and the named frames that lie in it.
// A volume is damped by the whole beam's time constant, s.
BeamDef piece_of(const BeamDef& beam, int k, double time_constant);

}  // namespace flexframe::sim
