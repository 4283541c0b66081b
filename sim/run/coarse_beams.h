// Beams whose elements are too few for how they vibrate, or their pieces for how their section or axis changes, told from the histories of
// a run and closed formulas; no second run.
#pragma once

#include "sim/base/notes.h"
#include "sim/model/model.h"
#include "sim/results/results.h"
#include "sim/scene/scene.h"

#include <string>
#include <vector>

namespace flexframe::sim {

struct CoarseBeam {
  std::string body, column;
  double share = 0.0;      // of the range of that output, by the end of the run
  double frequency = 0.0;  // at which the beam vibrates, Hz
  int elements = 0;        // that the scene gives, of a mixed beam in all volumes; by its section or axis: volumes
  int wanted = 0;          // that would do
  enum class Cause { vibration, section, axis };
  Cause cause = Cause::vibration;
};

// Beams of finite elements, mixed and lumped ones with fewer elements than their motion needs. What is estimated: the beam's largest
// deflection passes so many cycles; at that frequency its wave number k follows from its bending stiffness and mass. Elements of length h
// vibrate too fast by (k h)^4 / 2880 (cubic elements, consistent mass), lumped ones too slowly by (k h)^2 / 15 (45 with coupled
// curvatures; fitted to cantilevers of 3 to 20 elements, whose deflection is off by 1 / (4 n^2) at rest and twice that under slow loads),
// and the phase that the first four modes lose moves the outputs on the body, as those of a cantilever let go at its tip. Where the largest
// deflection is along the axis, linear elements vibrate too fast by (k h)^2 / 24, k = omega / sqrt(E / rho): what that leaves of the sum of
// all vibrations by the end goes with the third derivative of the deflection. With shear elements vibrate too fast by (omega h / c)^2 / 24
// besides, c the speed of shear waves; a twist by (k h)^2 / 24 in each mode of a shaft let go at its end, or by its third derivative where
// that is less. Of a changing section: how far the deflections at rest of the pieces, each of its middle's section, are off under a force
// at either end, the other one held. Of a curved axis: the same of its chords, under forces in those directions in which the end gives way
// easily. Kept modes are judged by few_modes.h, eigenforms by model_check.h.
std::vector<CoarseBeam> coarse_beams(const Scene& scene, const std::vector<EffectState>& effects, const Results& results);

// Indices of the bodies among them whose elements are too few for how they vibrate by more than `asked`; and all of them without those of
// `measured` bodies, of whose elements runs with other numbers of them have told.
std::vector<size_t> coarse_bodies(const std::vector<CoarseBeam>& beams, const Scene& scene, double asked);
std::vector<CoarseBeam> unmeasured_beams(std::vector<CoarseBeam> beams, const Scene& scene, const std::vector<size_t>& measured);

// Indices of bodies: beams that vibrate between the samples so fast that their elements may be too few for that, by the same formulas and
// one node that runs faster than the samples show (sampling.h), and rods along which waves run whose fronts they may be too few for.
// Whether the outputs move with it is told by a run with twice as many (model_check.h).
std::vector<size_t> beams_between_samples(const Scene& scene, const Model& model, const std::vector<EffectState>& effects,
                                          const Results& results, double asked);

// Indices of bodies: beams bent across their stiff way so hard that they may be near tipping over sideways, where bending and twist make
// each other larger and a small error of the load at which they tip is a large one of the deflection aside. Whether their elements are
// enough is told by a run with half of them (model_check.h).
std::vector<size_t> beams_that_may_tip(const Scene& scene, const std::vector<EffectState>& effects, const Results& results);

// A warning for each beam with large_bending that bends in one plane across its stiff way so far that it may tip over sideways, which a
// plane scene does not show.
void warn_of_tipping(const Scene& scene, const std::vector<EffectState>& effects, const Results& results, Notes& notes);

// Says of beams under their weight and constant loads along them what pictures lack between the ends of their elements, which are right:
// q h^4 / (384 EI) at the middle of an element (of one between two hinges 20 %, between two clamps all). Beyond `asked` of the largest
// displacement a warning where pictures are what the run is made for, else a note.
void tell_of_bare_spans(const Scene& scene, const std::vector<EffectState>& effects, const Results& results, bool pictures, double asked,
                        Notes& notes);

// A warning for each whose share is beyond `asked`.
void warn_of_coarse_beams(const std::vector<CoarseBeam>& beams, double asked, Notes& notes);

}  // namespace flexframe::sim
