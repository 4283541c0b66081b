// The frame from which a body's deformation is shown: outputs `displacement`, ghosts, colours. The equations of motion hold bodies in
// frames of their own (mean axes of finite-element beams, whatever a SID file chose); what an engineer calls the deflection of a part is
// measured from where the part is mounted. Scene word: shown = "joints" (default), "frame", "mean", or one or two frames of the body.
//
//   joints  the joints that hold the body (supports.h): a clamp or a single joint: the frame that rides on it; two or more: the
//           chord through the first two that lie apart, turned about itself as the first is; none: mean axes
//   frame   the frame in which the body is given: of a beam its `boundary`, else the body frame
//   mean    mean axes (Buckens): int u dm = 0 and int c x u dm = 0, to first order of the deformation; chains of bodies: the rigid
//           motion that fits the masses' places best (least squares by polar decomposition; Horn, Hilden, Negahdaripour 1988)
#pragma once

#include "sim/dynamics/work.h"

#include <string>
#include <vector>

namespace flexframe::sim {

struct ShownFrom {
  enum Kind {
    body,      // the body frame of the equations of motion
    boundary,  // ShownFrame of the model: that of the beam's boundary
    tangent,   // rides on frame a
    chord,     // lies along the line from frame a to frame b, turned about it as a is
    mean       // mean axes
  } kind = body;
  int a = -1, b = -1;   // frames of the model
  Pose rest_a, rest_b;  // of the undeformed body, in its own frame
  Mat6X mean_motion;    // kind mean, one part: translation and rotation of the mean axes per elastic coordinate
};

// Of a body of the scene; frames that it needs are added to the model. Throws InputError: a frame that the body lacks, two frames at one
// place.
ShownFrom find_shown_frame(Model& model, const Scene& scene, int body);

// Likewise from one frame of the body (its tangent) or two (their chord). where: begins messages.
ShownFrom shown_from_frames(Model& model, const Scene& scene, int body, const std::vector<std::string>& names, const std::string& where);

// Pose of the shown frame in the frame of the body's first part. Positions in `work` must be up to date; refreshes the frames it needs,
// unless they are `placed`.
Pose shown_pose(const Model& model, int body, const ShownFrom& shown, Work& work, bool placed = false);
// Those frames.
std::vector<int> frames_of(const Model& model, int body, const ShownFrom& shown);

// Translation (m) and rotation (rad) of the shown frame per elastic coordinate, for small deformations, in the body frame; of a body of one
// part whose nodes move linearly with its coordinates. 6 x n.
Mat6X shown_columns(const Model& model, int body, const ShownFrom& shown);

}  // namespace flexframe::sim
