// What a linear elastic body cannot show: deformation whose rotations are not small in its own frame.
//
// Two errors grow with the square of the turn of the material in its frame. The deflection under a given load errs by `at_rest`: with a
// clamped beam under an end load P linear theory turns the tip by P L^2/2 EI and errs by 0.42 of that squared against the elastica (K. E.
// Bisshopp, D. C. Drucker, Quart. Appl. Math. 3 (1945)); finite elements move on mean axes, from which both ends turn by half as much, and
// with the second-order displacement field the error is smaller by another six. The frequency errs too, so that what swings loses its
// phase: by `phase` radians, the relative error of the frequency times the radians swung. Measured with a cantilever that is let go under
// its weight against a chain of 40 rigid links, at tip turns of 0.19 to 1.26: 0.11 of the mean square of the turn (finite elements of
// second order), 0.18 (linear ones), 0.22 (one frame clamped to the root). On a hinge or free it is more, by the energies that the
// second-order field leaves out: these are found along the motion, and the larger of both counts. With the effect large_bending (RodAxis)
// both errors vanish; what shapes of few modes leave is that of the linear beam at any turn (a cantilever in two kept modes 1.0e-3, 1.1e-3
// and 1.5e-3 of the swing at tip turns of 0.03, 0.35 and 1.2), which few_modes and coarse_beams tell.
#pragma once

#include "sim/model/model.h"
#include "sim/results/results.h"
#include "sim/scene/scene.h"

#include <string>
#include <vector>

namespace flexframe::sim {

struct LinearLimit {
  int body = -1;           // of the scene
  double turn = 0.0;       // rad, the farthest that the material turned in its frame; of a chain of volumes in the frame of one of them
  double when = 0.0;       // s, at that time
  double at_rest = 0.0;    // error of the deflection under a given load, relative
  double phase = 0.0;      // rad, of the body's vibration at the end of the run
  int pieces = 1;          // volumes it has
  double swung = 0.0;      // rad, of the body's vibration in the run
  bool may_go_on = false;  // the effect large_bending is off and would make both errors vanish
  // What the loads along a beam do (pressed_beams.h): the largest share of buckling, which is counted in already; the largest strain along
  // its axis, and the share of its stiffness that one frame lacks by it.
  double pressed = 0.0, stretched = 0.0, stretching = 0.0;
  double seen = 1.0;  // what outputs see of it, whose sizes are those of whole pictures (outputs_over_sizes)
  // Error of what the body's deflection decides, relative to that, and what counts of it beside an asked accuracy.
  double error() const { return at_rest + 0.5 * phase + lacks_stretched(); }
  double counts() const { return seen * error(); }
  // Of it, what the strain along the axis makes: the frequency errs by half the share of the stiffness.
  double lacks_stretched() const { return stretching * (1.0 + 0.25 * swung); }
};

// "bends by up to 3 degrees within its own frame, pressed by 0.9 of what buckles it (t = 2 s)"
std::string far_words(const LinearLimit& limit, const char* frame, bool when = true);

// Of every flexible body but lumped beams, whose pieces are rigid, as it moved in the results. Beams: the turn of the tangent (torsion
// alone stays right); others: of the nodes.
std::vector<LinearLimit> linear_limits(const Scene& scene, const Model& model, const Results& results);

// Adds large_bending to beams with automatic effects whose error counts more than `tolerated` where they can have it: the scene is to be
// simulated anew. A note says what and why. False if nothing.
bool call_large_bending(const std::vector<LinearLimit>& limits, double tolerated, Scene& scene, Notes& notes);

// A warning for each body whose error counts more than `tolerated`: how far it turned, when, how wrong that makes it, and what to use
// instead.
void warn_of_linear_limits(const Scene& scene, const std::vector<LinearLimit>& limits, double tolerated, Notes& into);

}  // namespace flexframe::sim
