// A sequence as one animated glTF 2.0 file (Khronos Group, glTF 2.0 specification, 2021): a node a body with its motion, elastic
// deformation as morph targets with weights, joints' symbols, camera. Any viewer plays it; Blender imports it.
#pragma once

#include "render/film/animation.h"

#include <cstdint>
#include <string>
#include <vector>

namespace flexframe::film {

struct GltfReport {
  int nodes = 0, morph_targets = 0, pictures = 0;
  double error = 0.0;  // m, largest distance of a vertex from where it is drawn (compression of the deformation)
  std::vector<std::string> notes;
};

// What is added to the bodies.
struct GltfExtras {
  bool ghosts = false;  // translucent copies at the animation's further scales
  bool traces = false;  // the paths of its traces over the run, as lines
};

// Times are seconds of playback; y is up in glTF, a root node turns the animation's up there. Deformation is multiplied by scale.
// binary: one .glb, else .gltf (JSON) with the data inside. Throws FileError if the data exceed the format's 4 GiB.
std::vector<std::uint8_t> make_gltf(const Animation& animation, double scale, bool binary, GltfReport& report,
                                    const GltfExtras& extras = {});

}  // namespace flexframe::film
