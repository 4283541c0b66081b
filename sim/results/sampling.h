// Whether the samples of a run show its motion.
#pragma once

#include "sim/model/model.h"
#include "sim/results/results.h"

#include <optional>
#include <string>

namespace flexframe::sim {

struct FastMotion {
  std::string owner;       // "joint 'pin'", "body 'rod'"
  double frequency = 0.0;  // Hz, about: the fast part of the rate over that of the value, root mean squares
  double samples = 0.0;    // a second
};

// The coordinate of a joint or of a body's deformation that runs on the most from sample to sample, if any does: for which h (v1 + v2)/2
// misses the way from one sample to the next by half or more (root mean squares). A vibration of less than 2.7 samples a period does, and
// histories, spectra and pictures show it at a lower frequency. first, count: the samples that are looked at. Coordinates of a body that
// move a twentieth of its fastest do not count, nor bodies that deform by a twentieth of another, nor joints whose rate is not the
// derivative of their value (rotation vectors).
std::optional<FastMotion> faster_than_samples(const Results& results, Eigen::Index first, Eigen::Index count);
std::optional<FastMotion> faster_than_samples(const Results& results);

// The same of the displacements and rotations of a body's nodes, by first order: radians that the fast part of one of them goes through in
// the run, and its share of the largest swing of all. Of several the one that goes through most for its share; coordinates of a body tell
// nothing of that, as some of them hardly move it. None: samples show how it deforms. body: index in the scene.
struct UnseenSwing {
  double radians = 0.0, share = 0.0;
};
// least: samples below which nothing is told.
std::optional<UnseenSwing> unseen_swing(const Model& model, int body, const Results& results, Eigen::Index least = 16);

// "vibrates at about 70 Hz, too fast for 100 samples a second; output_rate = 700 shows it".
std::string fast_motion_text(const FastMotion& fast);

}  // namespace flexframe::sim
