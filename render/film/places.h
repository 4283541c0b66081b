// Points and frames of bodies over the run: what traces, triads, force arrows and springs hang on.
#pragma once

#include "render/film/motion.h"
#include "sim/scene/scene.h"

#include <glm/glm.hpp>

#include <optional>
#include <string>

namespace flexframe::film {

// A frame of a body: its origin in the undeformed body, carried by one node or, on a beam, by the two next to it.
struct FramePlace {
  int body = -1;             // index in Results::bodies; -1: ground
  glm::dvec3 origin{0.0};    // m, body frame
  glm::dmat3 axes{1.0};      // of a turned frame, body axes
  int node = -1, next = -1;  // indices of the body's nodes, -1: rigid
  double share = 0.0;        // of `next`
  bool held = false;         // the frame of a body's coordinates, where it is shown from another
};

// The frame by its name in scenes: "body", "body.frame", "ground". scene may be null: then only bodies and their nodes are known.
// None if there is no such frame.
std::optional<FramePlace> find_place(const sim::Results& results, const sim::Scene* scene, const std::string& name);

// The place at a share 0 .. 1 of a beam's length along its axis; none where scene or results have no such beam.
std::optional<FramePlace> place_along(const sim::Results& results, const sim::Scene& scene, const std::string& beam, double share);

// World from frame with the elastic displacement scaled (its rotation is not).
glm::dmat4 place_pose(const sim::Results& results, const FramePlace& frame, const SamplePlace& at, double scale);

}  // namespace flexframe::film
